//! The promise of a generated cage, checked on the very numbers that are returned.

use glam::{DVec3, Vec3};

use super::guarded::Obstacle;
use super::shell::Shell;
use super::surface::Surface;
use crate::cage::Cage;
use crate::contact::{Corners, meeting};
use crate::geometry::winding_number;
use crate::mesh::PolygonMesh;

/// Share of the clearance that must be left after rounding to f32.
const MIN_CLEARANCE_SHARE: f64 = 0.98;

/// The same of the facets of bent faces, which lie a little inside of the triangles that were guarded.
const MIN_FACET_CLEARANCE_SHARE: f64 = 0.1;

/// Largest distance of a winding number from 1; of a closed surface it is whole.
const WINDING_TOLERANCE: f64 = 1e-3;

/// The cage of a whole surface, if it keeps the promise: closed, manifold, outward, free of self-intersection, clear
/// of the solid, around every part of it. All of the model lies in the solid, so all of it lies strictly inside.
pub(super) fn verified(shell: &Shell, surface: &Surface) -> Option<Cage> {
    let whole = surface.whole();
    verified_faces(shell, &whole.positions, whole.triangles.iter().map(|t| t.to_vec()).collect()).ok()
}

/// The same of vertices (centred voxel units) and faces. Bent faces keep it as the triangles and as the finer facets that models
/// are bound to.
///
/// # Errors
/// The faces that break the promise, ascending; none where it is the whole.
pub(super) fn verified_faces(
    shell: &Shell,
    positions: &[DVec3],
    faces: Vec<Vec<u32>>,
) -> Result<Cage, Vec<u32>> {
    let positions: Vec<_> = positions.iter().map(|&p| shell.lattice.object(p)).collect();
    let cage = Cage::new(&PolygonMesh { positions, faces }).map_err(|_| Vec::new())?;
    if !cage.notices().is_empty() {
        return Err(Vec::new());
    }
    let corners = |indices: &[[u32; 3]], points: &[Vec3]| -> Vec<Corners> {
        let at: Vec<DVec3> = points.iter().map(|&p| shell.lattice.centred(p)).collect();
        indices.iter().map(|&index| Corners { index, at: index.map(|i| at[i as usize]) }).collect()
    };
    let mut obstacle = Obstacle { voxels: shell.obstacle.voxels.clone(), ..shell.obstacle };
    let points: Vec<Vec3> = cage.facet_points().iter().map(|p| p.as_vec3()).collect();
    let triangles = corners(cage.triangles(), cage.positions());
    let mut wrong = Vec::new();
    for (triangles, face_of, share) in [
        (&triangles, cage.face_of_triangle(), MIN_CLEARANCE_SHARE),
        (&corners(cage.facets(), &points), cage.face_of_facet(), MIN_FACET_CLEARANCE_SHARE),
    ] {
        obstacle.clearance = share * shell.obstacle.clearance;
        let touching = triangles.iter().zip(face_of).filter(|(t, _)| !obstacle.is_clear(t.at));
        wrong.extend(touching.map(|(_, &face)| face));
        wrong.extend(meeting(triangles).into_iter().flatten().map(|t| face_of[t as usize]));
    }
    if !wrong.is_empty() {
        wrong.sort_unstable();
        wrong.dedup();
        return Err(wrong);
    }
    let half = shell.lattice.half();
    let around = shell.parts.iter().all(|&voxel| {
        let p = DVec3::from_array(voxel.map(|x| x as f64 + 0.5)) - half;
        (winding_number(p, triangles.iter().map(|t| t.at)) - 1.0).abs() < WINDING_TOLERANCE
    });
    if around { Ok(cage) } else { Err(Vec::new()) }
}
