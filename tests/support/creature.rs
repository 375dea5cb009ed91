//! An animal of capsules in a cage of blocks: a generated input of realistic size.

use std::f32::consts::{PI, TAU};

use cagework_core::{PolygonMesh, TriMesh};
use glam::{Quat, Vec3};

use crate::cages::{blocks, moved};

/// Rotation of the animal and of its cage, so that no face is aligned with the grid.
fn turn() -> Quat {
    Quat::from_euler(glam::EulerRot::XYZ, 0.2, -0.35, 0.5)
}

/// Ends (in blocks of the cage) and radius of each capsule: body, neck, head, tail, legs.
const PARTS: [(Vec3, Vec3, f32); 8] = [
    (Vec3::new(0.9, 1.5, 3.0), Vec3::new(4.1, 1.5, 3.0), 0.8),
    (Vec3::new(4.6, 1.5, 3.4), Vec3::new(5.5, 1.5, 4.3), 0.3),
    (Vec3::new(5.5, 1.5, 4.5), Vec3::new(6.5, 1.5, 4.5), 0.4),
    (Vec3::new(0.6, 1.5, 3.5), Vec3::new(-0.6, 1.5, 3.5), 0.2),
    (Vec3::new(0.5, 0.5, 2.6), Vec3::new(0.5, 0.5, 0.5), 0.35),
    (Vec3::new(0.5, 2.5, 2.6), Vec3::new(0.5, 2.5, 0.5), 0.35),
    (Vec3::new(4.5, 0.5, 2.6), Vec3::new(4.5, 0.5, 0.5), 0.35),
    (Vec3::new(4.5, 2.5, 2.6), Vec3::new(4.5, 2.5, 0.5), 0.35),
];

/// Number of rings of a capsule, and of vertices per ring.
const RINGS: u32 = 42;
const N_SECTORS: u32 = 44;

/// Creates the animal: 8 capsules of 1,850 vertices, 14,800 in all.
#[must_use]
pub fn creature() -> TriMesh {
    let mut mesh = TriMesh::default();
    for (from, to, radius) in PARTS {
        add_capsule(&mut mesh, from, to, radius);
    }
    for p in &mut mesh.positions {
        *p = turn() * *p;
    }
    mesh
}

/// Creates the animal's cage: a body of 5 x 3 x 2 blocks, four legs of two blocks, tail, neck and head; 112 vertices,
/// all faces are quads.
#[must_use]
pub fn creature_cage() -> PolygonMesh {
    let body = (0..30).map(|k| [k % 5, k / 5 % 3, 2 + k / 15]);
    let legs = (0..8).map(|k| [4 * (k & 1), 2 * (k >> 1 & 1), k >> 2]);
    let ends = [[-1, 1, 3], [5, 1, 3], [5, 1, 4], [6, 1, 4]];
    let cubes: Vec<[i32; 3]> = body.chain(legs).chain(ends).collect();
    moved(&blocks(&cubes), |p| turn() * p)
}

fn add_capsule(mesh: &mut TriMesh, from: Vec3, to: Vec3, radius: f32) {
    let axis = (to - from).normalize();
    let side = axis.any_orthonormal_vector();
    let other = axis.cross(side);
    let first = mesh.positions.len() as u32;
    mesh.positions.push(from - radius * axis);
    for ring in 0..RINGS {
        // Half of the rings are on each hemisphere.
        let polar = PI * (ring + 1) as f32 / (RINGS + 1) as f32;
        let center = if 2 * ring < RINGS { from } else { to };
        for step in 0..N_SECTORS {
            let (sin, cos) = (TAU * step as f32 / N_SECTORS as f32).sin_cos();
            let out = polar.sin() * (cos * side + sin * other) - polar.cos() * axis;
            mesh.positions.push(center + radius * out);
        }
    }
    mesh.positions.push(to + radius * axis);
    let last = mesh.positions.len() as u32 - 1;
    let at = |ring: u32, step: u32| first + 1 + ring * N_SECTORS + step % N_SECTORS;
    for step in 0..N_SECTORS {
        mesh.triangles.push([first, at(0, step + 1), at(0, step)]);
        for ring in 1..RINGS {
            let quad = [at(ring - 1, step), at(ring - 1, step + 1), at(ring, step + 1), at(ring, step)];
            mesh.triangles.extend([[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]);
        }
        mesh.triangles.push([last, at(RINGS - 1, step), at(RINGS - 1, step + 1)]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cages::cage;
    use crate::points::is_inside;

    #[test]
    fn creature_lies_in_its_cage() {
        let (mesh, cage) = (creature(), cage(&creature_cage()));
        assert_eq!(mesh.positions.len(), 14_800);
        assert_eq!(cage.n_vertices(), 112);
        assert_eq!(cage.notices(), []);
        assert!(mesh.positions.iter().all(|&p| is_inside(&cage, p)));
    }

    #[test]
    fn creature_faces_outward() {
        let mesh = creature();
        let volume: f32 = mesh
            .triangles
            .iter()
            .map(|t| t.map(|i| mesh.positions[i as usize]))
            .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
            .sum();
        // pi r^2 (length + 4/3 r), summed over the capsules. The mesh is inscribed, so its volume is smaller.
        let exact: f32 = PARTS.iter().map(|(a, b, r)| PI * r * r * (a.distance(*b) + 4.0 / 3.0 * r)).sum();
        assert!((0.98..1.0).contains(&(volume / exact)), "{volume} against {exact}");
    }
}
