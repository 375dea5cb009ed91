//! Conversion between JavaScript's flat arrays and Rust's points and faces.

use cagework_core::PolygonMesh;
use glam::Vec3;

use crate::error::{Answer, ErrorName, Fault};

/// Converts a flat array `[n, 3]` to points.
pub(crate) fn points(flat: &[f32]) -> Vec<Vec3> {
    flat.chunks_exact(3).map(Vec3::from_slice).collect()
}

/// Converts the flat array `posed`, `[n, 3]`, to a pose of `n` controls.
///
/// # Errors
/// If the array does not have `3 n` numbers.
pub(crate) fn pose(posed: &[f32], n: usize) -> Answer<Vec<Vec3>> {
    if posed.len() == 3 * n {
        return Ok(points(posed));
    }
    let (given, needed) = (posed.len(), 3 * n);
    let message = format!("posed has {given} numbers; it must have {needed}, three for each of {n} controls");
    Err(Fault::new(ErrorName::Error, message))
}

/// Converts points to a flat array `[n, 3]`.
pub(crate) fn flat(points: &[Vec3]) -> Vec<f32> {
    points.iter().flat_map(Vec3::to_array).collect()
}

/// Builds a polygon mesh from positions `[n_vertices, 3]` and `corners`, which lists for each face its corner count and
/// then the vertex indices of its corners.
///
/// # Errors
/// If `corners` ends in the middle of a face.
pub(crate) fn polygon_mesh(positions: &[f32], corners: &[u32]) -> Answer<PolygonMesh> {
    let mut faces = Vec::new();
    let mut rest = corners;
    while let [count, tail @ ..] = rest {
        let Some((face, tail)) = tail.split_at_checked(*count as usize) else {
            return Err(Fault::new(ErrorName::Error, "the last face of the cage is cut off"));
        };
        faces.push(face.to_vec());
        rest = tail;
    }
    Ok(PolygonMesh { positions: points(positions), faces })
}

/// Converts faces to a flat list: for each face its corner count, then the vertex indices of its corners.
pub(crate) fn corners(faces: &[Vec<u32>]) -> Vec<u32> {
    faces.iter().flat_map(|f| std::iter::once(f.len() as u32).chain(f.iter().copied())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_round_trip_and_truncated_faces_are_errors() {
        let faces = vec![vec![0, 1, 2], vec![0, 2, 3, 1]];
        let flat = corners(&faces);
        assert_eq!(flat, [3, 0, 1, 2, 4, 0, 2, 3, 1]);
        assert_eq!(polygon_mesh(&[], &flat).unwrap().faces, faces);
        assert!(polygon_mesh(&[], &flat[..7]).is_err());
    }

    #[test]
    fn a_pose_of_another_length_is_refused_with_both_lengths() {
        assert_eq!(pose(&[0.0; 6], 2).unwrap(), [Vec3::ZERO; 2]);
        let fault = pose(&[0.0; 6], 3).unwrap_err();
        assert!(fault.message().starts_with("posed has 6 numbers; it must have 9"), "{}", fault.message());
    }
}
