//! Meshes of balls and tubes, oriented inwards, because they are inner boundaries of the space between them and the
//! cage.

use std::f64::consts::{PI, TAU};

use glam::{DQuat, DVec3};

/// Number of sides of a tube's cross-section.
const SIDES: usize = 16;
/// Number of rings of vertices on a tube's hemispherical end, excluding its equator and pole.
const RINGS: usize = 4;

/// Number of faces of one tube segment with both of its ends.
pub(super) const TUBE_FACES: usize = SIDES * (1 + 2 * (RINGS + 1));

/// Returns the number of subdivisions of a ball's icosahedron for a given number of balls. Weights beside a ball are
/// off by 2e-3 after three subdivisions, 6e-3 after two and 2e-2 after one; fewer faces per ball allow more balls
/// ([`crate::cage::MAX_FACES`]).
pub(super) fn ball_steps(n_balls: usize) -> u32 {
    match n_balls {
        0..=16 => 3,
        17..=250 => 2,
        _ => 1,
    }
}

pub(super) fn ball_faces(steps: u32) -> usize {
    20 << (2 * steps)
}

/// Size of a mesh relative to the ball or tube that it approximates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Size {
    /// The mesh has the same volume (ball) or cross-section (tube); its corners exceed the radius by a few per cent.
    EqualVolume,
    /// The mesh is inscribed. Used for neighbours whose meshes of equal volume would intersect.
    Inscribed,
}

/// Mesh of a ball or of a segment of a tube.
pub(super) struct Shape {
    /// Position of each point, and the parameter, 0 to 1, of the closest point on the segment.
    pub(super) points: Vec<(DVec3, f64)>,
    pub(super) faces: Vec<Vec<u32>>,
}

/// Builds a ball: an icosahedron with `steps` subdivisions.
pub(super) fn ball(center: DVec3, radius: f64, steps: u32, size: Size) -> Shape {
    let golden = f64::midpoint(1.0, 5.0_f64.sqrt());
    let corner = |k: usize| {
        let sign = |bit: usize| if k >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let mut at = [0.0, sign(0), sign(1) * golden];
        at.rotate_right(k / 4);
        DVec3::from(at).normalize()
    };
    let mut points: Vec<DVec3> = (0..12).map(corner).collect();
    // Neighbouring corners are at a distance of about 1.05; all other pairs are further apart.
    let is_edge = |a: usize, b: usize| points[a].distance(points[b]) < 1.2;
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            triangles.extend((b + 1..12).filter(|&c| is_edge(a, b) && is_edge(b, c) && is_edge(a, c)).map(
                |c| {
                    let outward = points[a].dot(points[b].cross(points[c])) > 0.0;
                    if outward { [a, c, b] } else { [a, b, c] }
                },
            ));
        }
    }
    let mut faces = triangles;
    for _ in 0..steps {
        let mut middles = std::collections::BTreeMap::new();
        let mut middle = |a: usize, b: usize| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                points.push((points[a] + points[b]).normalize());
                points.len() - 1
            })
        };
        let four = |[a, b, c]: [usize; 3]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
        };
        faces = faces.into_iter().flat_map(four).collect();
    }
    let faces: Vec<Vec<u32>> = faces.iter().map(|t| t.map(|i| i as u32).to_vec()).collect();
    let volume: f64 = faces
        .iter()
        .map(|t| {
            let [a, b, c] = [0, 1, 2].map(|k| points[t[k] as usize]);
            a.dot(c.cross(b)) / 6.0
        })
        .sum();
    let larger = if size == Size::EqualVolume { (4.0 / 3.0 * PI / volume).cbrt() } else { 1.0 };
    let size = radius * larger;
    Shape { points: points.into_iter().map(|p| (center + size * p, 0.0)).collect(), faces }
}

/// Builds a tube from `a` to `b` with hemispherical ends.
pub(super) fn tube(a: DVec3, b: DVec3, radius: f64, size: Size) -> Shape {
    let turn = DQuat::from_rotation_arc(DVec3::Z, (b - a).normalize());
    let larger = (TAU / (SIDES as f64 * (TAU / SIDES as f64).sin())).sqrt();
    let size = if size == Size::EqualVolume { radius * larger } else { radius };
    // Rings from the pole at `a` to the pole at `b`: (index from the equator, end, direction, parameter along the
    // segment).
    let rings = (0..=RINGS).rev().map(|k| (k, a, -1.0, 0.0)).chain((0..=RINGS).map(|k| (k, b, 1.0, 1.0)));
    let mut points = vec![(a - turn * (size * DVec3::Z), 0.0)];
    for (k, end, side, share) in rings {
        let (sin, cos) = (0.5 * PI * k as f64 / (RINGS + 1) as f64).sin_cos();
        points.extend((0..SIDES).map(|s| {
            let (y, x) = (TAU * s as f64 / SIDES as f64).sin_cos();
            (end + turn * (size * DVec3::new(cos * x, cos * y, side * sin)), share)
        }));
    }
    points.push((b + turn * (size * DVec3::Z), 1.0));
    let (n, last) = (SIDES as u32, points.len() as u32 - 1);
    let mut faces = Vec::with_capacity(TUBE_FACES);
    for s in 0..n {
        let next = (s + 1) % n;
        faces.push(vec![0, 1 + s, 1 + next]);
        for ring in 0..2 * RINGS as u32 + 1 {
            let (low, high) = (1 + ring * n, 1 + (ring + 1) * n);
            faces.push(vec![low + s, high + s, high + next, low + next]);
        }
        faces.push(vec![last, last - n + next, last - n + s]);
    }
    Shape { points, faces }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(shape: &Shape) -> f64 {
        let at = |i: u32| shape.points[i as usize].0;
        let of_face = |face: &Vec<u32>| -> f64 {
            (2..face.len()).map(|k| at(face[0]).dot(at(face[k - 1]).cross(at(face[k]))) / 6.0).sum()
        };
        shape.faces.iter().map(of_face).sum()
    }

    /// A ball has the volume 4/3 pi r^3; a tube of length l has l pi r^2 plus slightly less than a ball for its ends.
    #[test]
    fn balls_and_tubes_face_inwards_and_have_their_volumes() {
        let ball = ball(DVec3::new(3.0, 2.0, 1.0), 0.5, 2, Size::EqualVolume);
        assert_eq!((ball.points.len(), ball.faces.len()), (162, ball_faces(2)));
        assert!((volume(&ball) + 4.0 / 3.0 * PI * 0.125).abs() < 1e-9, "{}", volume(&ball));
        let (a, b) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(2.0, 4.0, 5.0));
        let tube = tube(a, b, 0.5, Size::EqualVolume);
        assert_eq!(tube.faces.len(), TUBE_FACES);
        let side = 3.0 * PI * 0.25;
        let excess = (-volume(&tube) - side) / (4.0 / 3.0 * PI * 0.125);
        assert!((0.9..1.1).contains(&excess), "{excess}");
        for (p, share) in &tube.points {
            let foot = a.lerp(b, *share);
            assert!((p.distance(foot) / 0.5 - 1.013).abs() < 1e-3, "{p}");
        }
    }
}
