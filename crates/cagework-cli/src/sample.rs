//! The built-in sample: a four-legged creature made by formula, and two poses of its cage.

use std::collections::HashMap;

use cagework_core::PolygonMesh;
use glam::{Quat, Vec3};

/// Subdivisions of the icosahedron: `10 * 4^n + 2` vertices, 10,242 here.
const SUBDIVISIONS: u32 = 5;
/// Radius of the body, object units; with its legs the creature is about 2 units long.
const BODY: f32 = 0.5;

/// A limb: direction from the body's centre, length in body radii, and how slim it is.
const LIMBS: [([f32; 3], f32, f32); 8] = [
    ([0.55, -0.75, 0.45], 1.0, 16.0),
    ([-0.55, -0.75, 0.45], 1.0, 16.0),
    ([0.55, -0.75, -0.45], 1.0, 16.0),
    ([-0.55, -0.75, -0.45], 1.0, 16.0),
    ([0.0, 0.55, 0.83], 1.1, 9.0),
    ([0.45, 0.85, 0.6], 0.7, 60.0),
    ([-0.45, 0.85, 0.6], 0.7, 60.0),
    ([0.0, 0.35, -0.94], 1.5, 24.0),
];

/// The creature: a sphere drawn out along its limbs, with fine bumps. y is up, z is forward.
///
/// Star-shaped around the origin, so it is closed and never cuts itself.
pub(crate) fn creature() -> PolygonMesh {
    let mut mesh = icosphere(SUBDIVISIONS);
    for p in &mut mesh.positions {
        let limbs: f32 = LIMBS
            .iter()
            .map(|&(direction, length, slimness)| {
                length * (slimness * (p.dot(Vec3::from_array(direction).normalize()) - 1.0)).exp()
            })
            .sum();
        let bumps = 0.015 * (14.0 * p.x).sin() * (14.0 * p.y).sin() * (14.0 * p.z).cos();
        // A body longer than wide.
        *p *= Vec3::new(0.8, 0.8, 1.2) * BODY * (1.0 + limbs + bumps);
    }
    mesh
}

/// A pose of the cage: the model turned around the x axis, more towards head and tail. `[n_cage]`
pub(crate) fn bow(cage: &[Vec3]) -> Vec<Vec3> {
    cage.iter().map(|&p| Quat::from_rotation_x(-0.5 * p.z) * p).collect()
}

/// A pose of the cage: the model twisted around its length. `[n_cage]`
pub(crate) fn twist(cage: &[Vec3]) -> Vec<Vec3> {
    cage.iter().map(|&p| Quat::from_rotation_z(0.7 * p.z) * p).collect()
}

/// A unit sphere of triangles, counter-clockwise seen from outside.
fn icosphere(subdivisions: u32) -> PolygonMesh {
    let t = 0.5 * (1.0 + 5.0_f32.sqrt());
    let mut positions: Vec<Vec3> = [[-1.0, t, 0.0], [1.0, t, 0.0], [-1.0, -t, 0.0], [1.0, -t, 0.0]]
        .into_iter()
        .flat_map(|[a, b, c]| [Vec3::new(a, b, c), Vec3::new(c, a, b), Vec3::new(b, c, a)])
        .map(Vec3::normalize)
        .collect();
    // The twelve corners of three golden rectangles: faces are the triples at the smallest distance.
    let near = |i: usize, j: usize| positions[i].dot(positions[j]) > 0.4;
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward = (positions[b] - positions[a]).cross(positions[c] - positions[a]);
                    let turned = outward.dot(positions[a]) < 0.0;
                    triangles.push(if turned {
                        [a as u32, c as u32, b as u32]
                    } else {
                        [a as u32, b as u32, c as u32]
                    });
                }
            }
        }
    }
    for _ in 0..subdivisions {
        let mut midpoints: HashMap<(u32, u32), u32> = HashMap::new();
        let mut midpoint = |i: u32, j: u32| {
            *midpoints.entry((i.min(j), i.max(j))).or_insert_with(|| {
                positions.push((positions[i as usize] + positions[j as usize]).normalize());
                positions.len() as u32 - 1
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let [ab, bc, ca] = [midpoint(a, b), midpoint(b, c), midpoint(c, a)];
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    PolygonMesh { positions, faces: triangles.into_iter().map(|t| t.to_vec()).collect() }
}

#[cfg(test)]
mod tests {
    use cagework_core::Cage;

    use super::{creature, icosphere};

    #[test]
    fn subdividing_quarters_every_triangle() {
        // Euler: V - E + F = 2 with F = 20 * 4^n and 2 E = 3 F.
        for n in 0..3 {
            let sphere = icosphere(n);
            assert_eq!(sphere.faces.len(), 20 << (2 * n));
            assert_eq!(sphere.positions.len(), sphere.faces.len() / 2 + 2);
        }
    }

    #[test]
    fn creature_is_closed_and_oriented() {
        let creature = creature();
        assert_eq!(creature.positions.len(), 10_242);
        let solid = Cage::new(&creature).unwrap();
        assert!(solid.notices().is_empty(), "{:?}", solid.notices());
    }
}
