//! Constraints of a fit: points inside, rings in order, smallest sizes.

use cagework_core::enclosure::{Columns, MIN_INSIDE_WINDING};
use cagework_core::geometry::closest_point_on_triangle;
use glam::DVec3;

use super::fit::{Fit, Target};
use super::limb::Exit;
use super::program::Constraints;

/// Distance up to which a point inside constrains the closest triangle, as a multiple of the clearance.
const REACH: f64 = 8.0;

/// Compliances of containment of points by rings and by single vertices, and of all other constraints.
const RING_COMPLIANCE: f64 = 0.003;
const FREE_COMPLIANCE: f64 = 0.0005;
const SHAPE_COMPLIANCE: f64 = 0.0003;

/// Smallest distance of a sleeve's first ring from its base.
const BASE_ORDER: f64 = 0.004;

/// Share of the distance between neighbouring rings that each edge between them keeps, for each ring's normal.
const ORDER: f64 = 0.125;

/// Smallest side of a ring.
const MIN_EXTENT: f64 = 0.012;

/// Largest distance of the middle of a ring's long side behind the line of the corners.
const MIDDLE: f64 = 0.004;

/// The barycentric coordinates of a ray's hit may be this much below zero.
const EDGE_TOLERANCE: f64 = 1e-6;

/// Place of a triangle that a constraint moves, and the direction in which the point must lie behind it.
struct Anchor {
    triangle: [u32; 3],
    barycentric: [f64; 3],
    normal: DVec3,
}

impl Fit<'_> {
    /// Whether each point is inside, for both cuts of all quads. `[n_points]`
    pub(super) fn inside(&self, at: &[DVec3], points: impl Iterator<Item = DVec3>) -> Vec<[bool; 2]> {
        let corners = [0, 1].map(|cut| corners(at, &self.cuts[cut]));
        let columns = [0, 1].map(|cut| Columns::new(&corners[cut]));
        points.map(|p| [0, 1].map(|cut| columns[cut].winding_number(p) > MIN_INSIDE_WINDING)).collect()
    }

    /// Adds the constraints that keep each target inside: behind the triangle through which the ray from the limb's
    /// axis leaves, if it is outside and `has_rays`, otherwise behind the closest triangle. Returns the number of
    /// targets outside, counted for each cut.
    pub(super) fn contain(&mut self, constraints: &mut Constraints, has_rays: bool) -> usize {
        let at = self.positions();
        let is_inside = self.inside(&at, self.targets.iter().map(|target| target.at));
        let reach = REACH * self.plan.clearance;
        let compliance = if self.is_free { FREE_COMPLIANCE } else { RING_COMPLIANCE };
        let boxes: Vec<[DVec3; 2]> = self
            .base
            .quads
            .iter()
            .map(|quad| {
                let corners = quad.corners.map(|v| at[v as usize]);
                let fold =
                    |f: fn(DVec3, DVec3) -> DVec3| corners[1..].iter().fold(corners[0], |a, &b| f(a, b));
                [fold(DVec3::min), fold(DVec3::max)]
            })
            .collect();
        let origins = if has_rays { self.origins(&at) } else { Vec::new() };
        let mut hints = std::mem::take(&mut self.hints);
        for (k, target) in self.targets.iter().enumerate() {
            let reach = is_inside[k].map(|inside| if inside { reach } else { f64::INFINITY });
            let anchors = self.closest(&at, &boxes, target, (reach, &mut hints[k]));
            for (cut, mut anchor) in anchors.into_iter().enumerate() {
                let Some((distance, found)) = &mut anchor else { continue };
                let sign = if is_inside[k][cut] { -1.0 } else { 1.0 };
                let p: DVec3 = (0..3).map(|c| found.barycentric[c] * at[found.triangle[c] as usize]).sum();
                if *distance > 1e-7 {
                    found.normal = sign * (target.at - p) / *distance;
                } else {
                    found.normal = normal(&at, found.triangle);
                }
                if has_rays
                    && !is_inside[k][cut]
                    && let Some(hit) = self.exit(&at, cut, k, origins[k])
                {
                    *found = hit;
                }
                let bound = found.normal.dot(target.at) + target.clearance;
                let vertices = [0, 1, 2].map(|c| (found.triangle[c], found.barycentric[c]));
                self.constrain(constraints, &vertices, found.normal, bound, compliance);
            }
        }
        self.hints = hints;
        is_inside.iter().flatten().filter(|inside| !**inside).count()
    }

    /// Finds the closest triangles of the target's own sleeve, its parent's and its children's, in both cuts, within
    /// the distances `reach`. Their normals are not set. `hint`: quad to try first, as an index in [`Self::near`]; it
    /// becomes the closest quad.
    fn closest(
        &self,
        at: &[DVec3],
        boxes: &[[DVec3; 2]],
        target: &Target,
        (reach, hint): ([f64; 2], &mut usize),
    ) -> [Option<(f64, Anchor)>; 2] {
        let p = target.at;
        let near = &self.near[target.limb];
        let mut best = reach.map(|reach| (reach * reach, None));
        for k in std::iter::once(*hint).chain(0..near.len()) {
            let quad = near[k] as usize;
            let [low, high] = boxes[quad];
            let to_box = p.distance_squared(p.clamp(low, high));
            for (best, cut) in best.iter_mut().zip(&self.cuts) {
                if to_box >= best.0 {
                    continue;
                }
                for triangle in &cut[2 * quad..2 * quad + 2] {
                    let found = closest_point_on_triangle(p, triangle.map(|v| at[v as usize]));
                    let distance = found.point.distance_squared(p);
                    if distance < best.0 {
                        *hint = k;
                        *best = (distance, Some((*triangle, found.barycentric)));
                    }
                }
            }
        }
        best.map(|(squared, found)| {
            let (triangle, barycentric) = found?;
            Some((squared.sqrt(), Anchor { triangle, barycentric, normal: DVec3::ZERO }))
        })
    }

    /// Finds the first triangle of one cut through which the ray from `origin` through a target leaves.
    fn exit(&self, at: &[DVec3], cut: usize, target: usize, origin: DVec3) -> Option<Anchor> {
        let target = &self.targets[target];
        let way = target.at - origin;
        let mut best: Option<(f64, Anchor)> = None;
        for &triangle in
            self.near[target.limb].iter().flat_map(|&q| &self.cuts[cut][2 * q as usize..2 * q as usize + 2])
        {
            let [a, b, c] = triangle.map(|v| at[v as usize]);
            let (e, f) = (b - a, c - a);
            let n = e.cross(f);
            let determinant = -way.dot(n);
            if determinant >= 0.0 {
                continue;
            }
            let r = origin - a;
            let s = r.dot(n) / determinant;
            if s <= 0.0 || best.as_ref().is_some_and(|best| s >= best.0) {
                continue;
            }
            let q = r.cross(way);
            let (u, v) = (f.dot(q) / determinant, -e.dot(q) / determinant);
            if u >= -EDGE_TOLERANCE && v >= -EDGE_TOLERANCE && u + v <= 1.0 + EDGE_TOLERANCE {
                let anchor =
                    Anchor { triangle, barycentric: [1.0 - u - v, u, v], normal: n.normalize_or_zero() };
                best = Some((s, anchor));
            }
        }
        best.map(|best| best.1)
    }

    /// Adds the constraints on planes between limbs, on the order of rings, and with `has_extents` on their sizes.
    pub(super) fn keep_shape(&self, constraints: &mut Constraints, has_extents: bool) {
        for &(vertex, normal, least) in &self.halfspaces {
            self.constrain(constraints, &[(vertex, 1.0)], normal, least, SHAPE_COMPLIANCE);
        }
        for (i, limb) in self.plan.limbs.iter().enumerate() {
            let rings: Vec<_> = self.base.of_limb[i].iter().map(|&r| &self.base.rings[r]).collect();
            let edges =
                |from: &[u32], to: &[u32]| from.iter().copied().zip(to.iter().copied()).collect::<Vec<_>>();
            let mut order = Vec::new();
            if i > 0 {
                let side = if limb.exit == Exit::Side { limb.side } else { rings[0].along };
                order.push((
                    edges(&self.base.loops[i], &rings[0].vertices),
                    [side, rings[0].along],
                    BASE_ORDER,
                ));
            }
            for pair in rings.windows(2) {
                let ways = [pair[0].along, pair[1].along];
                order.push((
                    edges(&pair[0].vertices, &pair[1].vertices),
                    ways,
                    ORDER * (pair[1].s - pair[0].s),
                ));
            }
            for (edges, ways, least) in order {
                for (a, b) in edges {
                    for way in ways {
                        self.constrain(constraints, &[(a, -1.0), (b, 1.0)], way, least, SHAPE_COMPLIANCE);
                    }
                }
            }
        }
        if !has_extents {
            return;
        }
        for (r, unknowns) in self.unknowns_of_ring.iter().enumerate() {
            // Mirrored rings share their unknowns.
            if self.plan.primary(self.base.rings[r].limb).is_some() {
                continue;
            }
            let mut least = |low: u32, high: u32, bound: f64| {
                constraints.push(&[(low, -1.0), (high, 1.0)], bound, SHAPE_COMPLIANCE);
            };
            if let Some([low, high]) = unknowns.middle {
                least(low, unknowns.v[0], -MIDDLE);
                least(unknowns.v[1], high, -MIDDLE);
                least(low, high, MIN_EXTENT);
            }
            least(unknowns.v[0], unknowns.v[1], MIN_EXTENT);
            if unknowns.u[0] == unknowns.u[1] {
                constraints.push(&[(unknowns.u[0], 1.0)], 0.5 * MIN_EXTENT, SHAPE_COMPLIANCE);
            } else {
                least(unknowns.u[0], unknowns.u[1], MIN_EXTENT);
            }
        }
    }
}

/// Corners of triangles.
fn corners(at: &[DVec3], triangles: &[[u32; 3]]) -> Vec<[DVec3; 3]> {
    triangles.iter().map(|t| t.map(|v| at[v as usize])).collect()
}

fn normal(at: &[DVec3], triangle: [u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|v| at[v as usize]);
    (b - a).cross(c - a).normalize_or_zero()
}
