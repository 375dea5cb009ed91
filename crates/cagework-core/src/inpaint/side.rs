//! The side of a surface that points are on.
//!
//! The sign of the pseudonormal at the closest point decides (Baerentzen and Aanaes 2005, "Signed distance computation
//! using the angle weighted pseudonormal"). It needs no closed surface: bodies often have holes at the neck or the eyes.
//! Points whose closest point is on the rim of a hole are outside. Of surfaces inside each other, the closest one decides.

use glam::{DVec3, Vec3};
use serde::Serialize;

use super::tree::{Hit, TriangleTree};
use super::welded;
use crate::mesh::{Bounds, TriMesh};
use crate::team::map_indices;

/// Points that are less deep inside count as outside, as a fraction of the surface's diagonal: coordinates are rounded.
const MIN_DEPTH: f64 = 1e-5;
/// Points do not move if they are closer by less than this fraction of their distance, so that rounding moves none.
const SLACK: f64 = 1e-3;
/// Number of times that points move. The first move can bring a point close to another part, such as an arm.
const ROUNDS: usize = 4;

/// Number of points inside a surface, and the greatest distance of one to the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct InsidePoints {
    /// Number of points.
    pub count: usize,
    /// Greatest distance, object units.
    pub depth: f32,
}

/// Result of [`push_out`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Separation {
    /// Points that were inside.
    pub inside: InsidePoints,
    /// Points that are inside now.
    pub left: InsidePoints,
    /// Signed distances now, negative inside. `[n_points]`
    pub distances: Vec<f32>,
}

/// Counts the `points` inside `surface`. Those closer to it than their distance in `least` move out to this distance: away
/// from the closest point or, if inside, through it. Each point moves on its own; in a gap that is too narrow it stays at the
/// best place that it reaches. `least`: `[n_points]`, object units, or empty to move none.
pub fn push_out(surface: &TriMesh, points: &mut [Vec3], least: &[f32]) -> Separation {
    let (_, surface, _) = welded(surface);
    let (tree, normals) = (TriangleTree::new(&surface), Pseudonormals::new(&surface));
    let least_depth =
        MIN_DEPTH * Bounds::around(&surface.positions).map_or(0.0, |bounds| f64::from(bounds.diagonal()));
    // Signed distance, negative inside, and the closest point with the direction out of the surface.
    let side = |p: Vec3| {
        let hit = tree.closest(p)?;
        let at: DVec3 =
            (0..3).map(|k| hit.shares[k] * surface.positions[hit.corners[k] as usize].as_dvec3()).sum();
        let normal = normals.at(&hit);
        let away = p.as_dvec3() - at;
        let is_inside = away.dot(normal) < 0.0;
        let out = if is_inside { -away } else { away };
        let out =
            if hit.distance > least_depth { out.normalize_or_zero() } else { normal.normalize_or_zero() };
        Some((if is_inside { -hit.distance } else { hit.distance }, at, out))
    };
    let reached = map_indices(points.len(), |v| {
        let (mut p, least) = (points[v], least.get(v).map_or(f64::NEG_INFINITY, |&least| least.into()));
        let (first, ..) = side(p)?;
        let mut best = (f64::NEG_INFINITY, p);
        for _ in 0..=ROUNDS {
            let (signed, at, out) = side(p)?;
            if signed > best.0 {
                best = (signed, p);
            }
            if signed >= least - SLACK * least.abs() || out == DVec3::ZERO {
                break;
            }
            p = (at + least * out).as_vec3();
        }
        Some((first, best))
    });
    let inside = |distances: &mut dyn Iterator<Item = f64>| {
        distances.filter(|&distance| distance < -least_depth).fold(
            InsidePoints::default(),
            |all, distance| InsidePoints { count: all.count + 1, depth: all.depth.max(-distance as f32) },
        )
    };
    let of = |k: usize| reached[k].unwrap_or((f64::INFINITY, (f64::INFINITY, points[k])));
    let n = points.len();
    let result = Separation {
        inside: inside(&mut (0..n).map(|k| of(k).0)),
        left: inside(&mut (0..n).map(|k| of(k).1.0)),
        distances: (0..n).map(|k| of(k).1.0 as f32).collect(),
    };
    points.iter_mut().zip(&reached).for_each(|(p, reached)| *p = reached.map_or(*p, |(_, best)| best.1));
    result
}

/// Sums of face normals around corners, weighted by the angle, and at edges. Zero on the rims of holes.
struct Pseudonormals {
    faces: Vec<DVec3>,
    /// Edges, ascending, with their normals.
    edges: Vec<([u32; 2], DVec3)>,
    corners: Vec<DVec3>,
}

impl Pseudonormals {
    fn new(mesh: &TriMesh) -> Self {
        let mut corners = vec![DVec3::ZERO; mesh.positions.len()];
        let (mut faces, mut sides) = (Vec::with_capacity(mesh.triangles.len()), Vec::new());
        for t in &mesh.triangles {
            let p = t.map(|v| mesh.positions[v as usize].as_dvec3());
            let normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
            faces.push(normal);
            for k in 0..3 {
                let (next, last) = ((k + 1) % 3, (k + 2) % 3);
                if normal != DVec3::ZERO {
                    corners[t[k] as usize] += (p[next] - p[k]).angle_between(p[last] - p[k]) * normal;
                }
                sides.push((edge(t[k], t[next]), normal));
            }
        }
        sides.sort_by_key(|&(ends, _)| ends);
        let mut edges = Vec::new();
        for same in sides.chunk_by(|a, b| a.0 == b.0) {
            let ends = same[0].0;
            edges.push((
                ends,
                if same.len() > 1 { same.iter().map(|side| side.1).sum() } else { DVec3::ZERO },
            ));
        }
        for (ends, _) in edges.iter().filter(|(_, normal)| *normal == DVec3::ZERO) {
            ends.iter().for_each(|&v| corners[v as usize] = DVec3::ZERO);
        }
        Self { faces, edges, corners }
    }

    fn at(&self, hit: &Hit) -> DVec3 {
        let on: Vec<u32> = (0..3).filter(|&k| hit.shares[k] > 0.0).map(|k| hit.corners[k]).collect();
        match *on {
            [v] => self.corners[v as usize],
            [a, b] => {
                let found = self.edges.binary_search_by_key(&edge(a, b), |&(ends, _)| ends);
                found.map_or(DVec3::ZERO, |found| self.edges[found].1)
            }
            _ => self.faces[hit.triangle as usize],
        }
    }
}

fn edge(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::winding_number;

    /// A thin spike, whose sharp edges have faces with opposite normals.
    fn spike() -> TriMesh {
        let corners = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.4, 0.3, 1.0]];
        let triangles = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        TriMesh { positions: corners.map(Vec3::from).to_vec(), triangles }
    }

    #[test]
    fn sides_equal_winding_numbers_and_moved_points_keep_their_distance() {
        let mesh = spike();
        let corners: Vec<[DVec3; 3]> =
            mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize].as_dvec3())).collect();
        // Points around each edge and corner, at several distances.
        let mut n_inside = 0;
        for k in 0..4000_u32 {
            let share = |step: u32| (k * step % 997) as f32 / 997.0;
            let (a, b) = (mesh.positions[k as usize % 4], mesh.positions[(k / 4) as usize % 4]);
            let offset = Vec3::new(share(31), share(59), share(113)) - 0.5;
            let mut point = [a.lerp(b, share(7)) + share(17) * 0.2 * offset];
            let is_inside = winding_number(point[0].as_dvec3(), corners.iter().copied()) > 0.5;
            let Separation { inside: before, left: after, .. } = push_out(&mesh, &mut point, &[0.02]);
            // Points within rounding of the surface count as outside.
            let distance = |p: Vec3| TriangleTree::new(&mesh).closest(p).map_or(0.0, |hit| hit.distance);
            assert!(before.count == usize::from(is_inside) || before.depth < 1e-4, "{k}: {before:?}");
            assert_eq!(after.count, 0, "{k}");
            assert!(distance(point[0]) > 0.0199, "{k}: {}", distance(point[0]));
            n_inside += usize::from(is_inside);
        }
        assert!((100..3000).contains(&n_inside), "{n_inside}");
    }

    #[test]
    fn points_beyond_the_rim_are_outside() {
        let mut mesh = spike();
        // Without its base, the spike is open at z = 0. Its faces at the rim lean over the first point.
        mesh.triangles.remove(0);
        let mut points = [Vec3::new(0.2, -0.05, -0.05), Vec3::new(0.12, 0.09, 0.3)];
        let depths = points.map(|p| push_out(&mesh, &mut [p], &[]).inside.count);
        assert_eq!(depths, [0, 0]);
        points[1] = Vec3::new(0.14, 0.115, 0.3);
        assert_eq!(push_out(&mesh, &mut points, &[]).inside.count, 1);
    }

    #[test]
    fn points_in_a_narrow_gap_stay_between_its_sides() {
        // Two sheets at x = 0 and x = 0.015 that face each other.
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let positions = [0.0, 0.015].into_iter().flat_map(|x| corners.map(|[y, z]| Vec3::new(x, y, z)));
        let triangles = vec![[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]];
        let mesh = TriMesh { positions: positions.collect(), triangles };
        let mut point = [Vec3::new(0.004, 0.2, 0.1)];
        let separation = push_out(&mesh, &mut point, &[0.02]);
        assert_eq!([separation.inside.count, separation.left.count], [0, 0]);
        assert!((0.004..0.011).contains(&point[0].x), "{}", point[0]);
    }
}
