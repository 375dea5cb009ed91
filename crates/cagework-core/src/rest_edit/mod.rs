//! Editing the rest cage: each operation takes a mesh and returns a new one, or says in words why it would break it.
//!
//! Nothing is changed in place, so a page undoes by keeping the meshes. Every result is a cage ([`Cage::new`] takes it
//! without turning a face) and goes through itself nowhere that it did not before. Vertices keep their order;
//! [`Edited::vertex_of`] says where each went, so that a selection or a pose can follow.

mod operations;
#[cfg(test)]
mod tests;

use glam::DVec3;
use thiserror::Error;

use crate::cage::{Cage, CageError, CageNotice};
use crate::contact::{Corners, meeting};
use crate::mesh::PolygonMesh;

pub use operations::{collapse_edge, delete_faces, extrude_face, move_vertices, split_edge};

/// An edited cage.
#[derive(Clone, Debug, PartialEq)]
pub struct Edited {
    /// The new mesh.
    pub mesh: PolygonMesh,
    /// For every old vertex the new one that stands for it; none if it is gone. `[n_old]`
    pub vertex_of: Vec<Option<u32>>,
    /// Vertices that the operation made or moved: what one would select next.
    pub touched: Vec<u32>,
}

/// Why an operation was refused.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RestEditError {
    /// There is no such vertex, edge or face.
    #[error("the cage has no {what}")]
    Missing {
        /// `vertex 12`, `edge 3-4`, `face 7`.
        what: String,
    },
    /// A number is not one.
    #[error("{what} is not a finite number")]
    NotFinite {
        /// What.
        what: &'static str,
    },
    /// The result would not be a cage.
    #[error("{operation} here would break the cage: {source}")]
    Breaks {
        /// `moving`, `splitting`, ...
        operation: &'static str,
        /// What would be wrong; vertices and faces are those of the result.
        source: CageError,
    },
    /// The result would be inside out.
    #[error("{operation} here would turn the cage inside out")]
    InsideOut {
        /// `moving`, `splitting`, ...
        operation: &'static str,
    },
    /// The result would go through itself.
    #[error("{operation} here would make the cage go through itself: faces {first} and {second} would meet")]
    Meets {
        /// `moving`, `splitting`, ...
        operation: &'static str,
        /// A face of the result.
        first: u32,
        /// The face that it would meet.
        second: u32,
    },
    /// The hole cannot be closed.
    #[error("the hole would have {edges} edges, more than 64: delete fewer faces at a time")]
    LargeHole {
        /// Its edges.
        edges: usize,
    },
    /// Nothing would be left.
    #[error("deleting these faces would leave nothing of the cage")]
    NothingLeft,
}

/// Checks a result against what it was made from.
fn finish(operation: &'static str, before: &PolygonMesh, edited: Edited) -> Result<Edited, RestEditError> {
    let cage = Cage::new(&edited.mesh).map_err(|source| RestEditError::Breaks { operation, source })?;
    let was_turned = Cage::new(before).is_ok_and(|c| is_turned(&c));
    if is_turned(&cage) && !was_turned {
        return Err(RestEditError::InsideOut { operation });
    }
    if let Some([a, b]) = crossings(&cage).first().copied() {
        // A cage that goes through itself already may be edited: that is how it is mended.
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

/// Pairs of triangles of different faces that meet.
fn crossings(cage: &Cage) -> Vec<[u32; 2]> {
    let at = |i: u32| -> DVec3 { cage.positions()[i as usize].as_dvec3() };
    let triangles: Vec<Corners> =
        cage.triangles().iter().map(|&index| Corners { index, at: index.map(at) }).collect();
    let faces = cage.face_of_triangle();
    let mut pairs = meeting(&triangles);
    pairs.retain(|&[a, b]| faces[a as usize] != faces[b as usize]);
    pairs
}
