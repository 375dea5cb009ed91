//! A C-shaped clamp with nearly closed jaws. With mean value coordinates, cage vertices of one jaw also move the other
//! jaw, across the gap.

use glam::{Quat, Vec3, vec3};

use super::sdf::{Body, Solid};
use super::{CageRecipe, PulledPose, Recipe, SampleInfo};
use cagework_core::mesh::PolygonMesh;

pub(super) const INFO: SampleInfo = SampleInfo { id: "clamp", label: "Clamp" };

const STEEL: [u8; 3] = [84, 104, 128];
const BRASS: [u8; 3] = [198, 156, 76];

/// Half of the cage's extent along z.
const THICKNESS: f32 = 0.27;

/// Centre of the lower jaw's rotation in poses: the middle of the clamp's back.
const HINGE: Vec3 = vec3(-0.8, 0.0, 0.0);

pub(super) fn recipe() -> Recipe {
    Recipe {
        body: body(),
        cell: 0.0135,
        cage: CageRecipe::Mesh(cage()),
        poses: vec![("Lower jaw open", Box::new(open))],
        pulled: PulledPose {
            name: "Lower jaw pulled down",
            at: vec3(0.95, -0.3, 0.18),
            by: vec3(-0.1, -0.4, 0.0),
            bytes: include_bytes!("pulled/clamp.bin"),
        },
        rig: None,
    }
}

fn body() -> Body {
    let mut body = Body::default();
    let block = |x: f32, y: f32, w: f32, h: f32| Solid::Block {
        center: vec3(x, y, 0.0),
        half: vec3(w, h, 0.18),
        round: 0.07,
    };
    for side in [-1.0, 1.0] {
        body.add(block(0.3, 0.30 * side, 0.62, 0.135), 0.0, STEEL);
        body.add(
            Solid::Block { center: vec3(0.84, 0.165 * side, 0.0), half: vec3(0.10, 0.05, 0.15), round: 0.03 },
            0.02,
            BRASS,
        );
    }
    body.add(block(-0.62, 0.0, 0.30, 0.435), 0.1, STEEL);
    for (y, r) in [(0.25, 0.10), (-0.25, 0.10)] {
        body.add(
            Solid::Ellipsoid { center: vec3(-0.6, y, 0.17), radii: vec3(r, r, 0.05), turn: Quat::IDENTITY },
            0.02,
            BRASS,
        );
    }
    body
}

/// The cage: a bent beam of quads.
fn cage() -> PolygonMesh {
    let mut mesh = PolygonMesh::default();
    // Outer and inner outline of the C in the xy plane, from the lower tip to the upper one.
    let outer = [
        (1.04, -0.52),
        (0.50, -0.52),
        (-0.05, -0.54),
        (-0.55, -0.54),
        (-1.02, -0.54),
        (-1.02, 0.0),
        (-1.02, 0.54),
        (-0.55, 0.54),
        (-0.05, 0.54),
        (0.50, 0.52),
        (1.04, 0.52),
    ];
    let inner = [
        (1.04, -0.05),
        (0.50, -0.05),
        (0.12, -0.06),
        (-0.10, -0.07),
        (-0.20, -0.06),
        (-0.22, 0.0),
        (-0.20, 0.06),
        (-0.10, 0.07),
        (0.12, 0.06),
        (0.50, 0.05),
        (1.04, 0.05),
    ];
    for ((ox, oy), (ix, iy)) in outer.into_iter().zip(inner) {
        for (x, y, z) in
            [(ox, oy, THICKNESS), (ix, iy, THICKNESS), (ix, iy, -THICKNESS), (ox, oy, -THICKNESS)]
        {
            mesh.positions.push(vec3(x, y, z));
        }
    }
    let n = outer.len() as u32;
    for s in 0..n - 1 {
        for k in 0..4 {
            let (a, b) = (4 * s + k, 4 * s + (k + 1) % 4);
            mesh.faces.push(vec![a, b, b + 4, a + 4]);
        }
    }
    mesh.faces.push(vec![3, 2, 1, 0]);
    mesh.faces.push([0, 1, 2, 3].map(|k| 4 * (n - 1) + k).to_vec());
    mesh
}

/// Returns the share of the lower jaw's motion that a point follows: 0 at the back and in the upper half, 1 along the
/// lower jaw.
fn share_of_jaw(p: Vec3) -> f32 {
    if p.y >= -0.01 {
        return 0.0;
    }
    ((p.x + 0.6) / 0.55).clamp(0.0, 1.0)
}

fn open(cage: &[Vec3]) -> Vec<Vec3> {
    cage.iter().map(|&p| HINGE + Quat::from_rotation_z(-0.5 * share_of_jaw(p)) * (p - HINGE)).collect()
}
