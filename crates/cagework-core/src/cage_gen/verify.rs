//! The promise of a generated cage, checked on the very numbers that are returned.

use glam::DVec3;

use super::guarded::Obstacle;
use super::shell::Shell;
use super::surface::Surface;
use crate::cage::Cage;
use crate::contact::{Corners, meeting};
use crate::geometry::winding_number;
use crate::mesh::PolygonMesh;

/// Share of the clearance that must be left after rounding to f32.
const MIN_CLEARANCE_SHARE: f64 = 0.98;

/// Largest distance of a winding number from 1; of a closed surface it is whole.
const WINDING_TOLERANCE: f64 = 1e-3;

/// The cage of a whole surface, if it keeps the promise: closed, manifold, outward, free of self-intersection, clear
/// of the solid, around every part of it. All of the model lies in the solid, so all of it lies strictly inside.
pub(super) fn verified(shell: &Shell, surface: &Surface) -> Option<Cage> {
    let whole = surface.whole();
    let positions: Vec<_> = whole.positions.iter().map(|&p| shell.lattice.object(p)).collect();
    let faces = whole.triangles.iter().map(|t| t.to_vec()).collect();
    let cage = Cage::new(&PolygonMesh { positions, faces }).ok()?;
    if !cage.notices().is_empty() {
        return None;
    }
    let at: Vec<DVec3> = cage.positions().iter().map(|&p| shell.lattice.centred(p)).collect();
    let triangles: Vec<Corners> =
        cage.triangles().iter().map(|&index| Corners { index, at: index.map(|i| at[i as usize]) }).collect();
    let mut obstacle = Obstacle { voxels: shell.obstacle.voxels.clone(), ..shell.obstacle };
    obstacle.clearance *= MIN_CLEARANCE_SHARE;
    if triangles.iter().any(|t| !obstacle.is_clear(t.at, None)) || !meeting(&triangles).is_empty() {
        return None;
    }
    let half = shell.lattice.half();
    let around = shell.parts.iter().all(|&voxel| {
        let p = DVec3::from_array(voxel.map(|x| x as f64 + 0.5)) - half;
        (winding_number(p, triangles.iter().map(|t| t.at)) - 1.0).abs() < WINDING_TOLERANCE
    });
    around.then_some(cage)
}
