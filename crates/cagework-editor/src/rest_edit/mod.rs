//! Editing of the rest cage: each operation takes a mesh and returns a new one, or an error if the result would be
//! invalid.
//!
//! Nothing changes in place, so callers implement undo by keeping the meshes. [`Cage::new`] accepts every result, flips
//! its faces only if it also flips those of the input, and the result has no more self-intersections than the input.
//! Vertices keep their order; [`CageEdit::vertex_of`] maps old to new indices for selections and poses.

mod operations;
#[cfg(test)]
mod tests;

use glam::DVec3;
use thiserror::Error;

use cagework_core::contact::{Corners, meeting};
use cagework_core::{Cage, CageError, CageNotice, PolygonMesh};

pub use operations::{collapse_edge, delete_faces, extrude_faces, move_vertices, split_edge};

/// Mesh after an edit, and its relation to the mesh before the edit.
#[derive(Clone, Debug, PartialEq)]
pub struct CageEdit {
    /// The new mesh.
    pub mesh: PolygonMesh,
    /// New index of every old vertex; `None` for removed vertices. `[n_old]`
    pub vertex_of: Vec<Option<u32>>,
    /// For every new vertex, the two old vertices that it lies between, or twice the old vertex that it is a copy of. New
    /// vertices are the last ones of the mesh. `[n_added]`
    pub made_from: Vec<[u32; 2]>,
    /// New and moved vertices, and vertices around filled holes. The editor selects them after the edit.
    pub touched: Vec<u32>,
}

/// Reason why an edit is not possible.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RestEditError {
    /// The vertex, edge or face does not exist.
    #[error("the cage has no {what}")]
    Missing {
        /// What is missing, such as `vertex 12`, `edge 3-4` or `face 7`.
        what: String,
    },
    /// A value is not finite.
    #[error("{what} is not a finite number")]
    NotFinite {
        /// The value that is not finite, such as "the new position".
        what: &'static str,
    },
    /// The result would not be a valid cage.
    #[error("{operation} here would break the cage: {source}")]
    Breaks {
        /// The operation, such as `moving` or `splitting`.
        operation: &'static str,
        /// Reason why the result is not a valid cage. Indices refer to the result.
        source: CageError,
    },
    /// The result would be inverted.
    #[error("{operation} here would turn the cage inside out")]
    InsideOut {
        /// The operation, such as `moving` or `splitting`.
        operation: &'static str,
    },
    /// The result would intersect itself.
    #[error("{operation} here would make the cage intersect itself: faces {first} and {second} would meet")]
    Meets {
        /// The operation, such as `moving` or `splitting`.
        operation: &'static str,
        /// Index of a face in the result.
        first: u32,
        /// Index of a face in the result that intersects face `first`.
        second: u32,
    },
    /// The hole has too many edges.
    #[error("the hole would have {edges} edges, more than 64: delete fewer faces at a time")]
    LargeHole {
        /// Number of the hole's edges.
        edges: usize,
    },
    /// No face would be left.
    #[error("these are all faces of the cage: keep at least one")]
    NothingLeft,
}

/// Returns the edit if its mesh is a valid cage that is not turned inside out and has no more self-intersections than
/// `before`.
fn finish(
    operation: &'static str,
    before: &PolygonMesh,
    edited: CageEdit,
) -> Result<CageEdit, RestEditError> {
    let cage = Cage::new(&edited.mesh).map_err(|source| RestEditError::Breaks { operation, source })?;
    let was_turned = Cage::new(before).is_ok_and(|c| is_turned(&c));
    if is_turned(&cage) && !was_turned {
        return Err(RestEditError::InsideOut { operation });
    }
    if let Some([a, b]) = crossings(&cage).first().copied() {
        // A cage that already intersects itself may be edited, so that it can be repaired.
        let n_before = Cage::new(before).map_or(usize::MAX, |c| crossings(&c).len());
        if crossings(&cage).len() > n_before {
            let face = |t: u32| cage.face_of_triangle()[t as usize];
            return Err(RestEditError::Meets { operation, first: face(a), second: face(b) });
        }
    }
    Ok(edited)
}

fn is_turned(cage: &Cage) -> bool {
    cage.notices().iter().any(|notice| matches!(notice, CageNotice::Flipped { .. }))
}

/// Pairs of intersecting triangles of different faces.
fn crossings(cage: &Cage) -> Vec<[u32; 2]> {
    let at = |i: u32| -> DVec3 { cage.positions()[i as usize].as_dvec3() };
    let triangles: Vec<Corners> =
        cage.triangles().iter().map(|&index| Corners { index, at: index.map(at) }).collect();
    let faces = cage.face_of_triangle();
    let mut pairs = meeting(&triangles);
    pairs.retain(|&[a, b]| faces[a as usize] != faces[b as usize]);
    pairs
}
