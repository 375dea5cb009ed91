//! What is taken hold of.

use super::samples::dense;
use super::{Pull, PullError};
use cagework_core::weights::Weights;

/// How far barycentric coordinates may be off: they come from pointers and from files.
const OFF: f64 = 1e-3;

/// Something to take hold of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Handle {
    /// A vertex of the model.
    Vertex(u32),
    /// A point of the model: a triangle and barycentric coordinates in it.
    Triangle(u32, [f64; 3]),
    /// A vertex of the cage.
    Cage(u32),
}

/// A handle as a drag needs it: how it follows the cage.
#[derive(Clone, Debug, PartialEq)]
pub struct Grip {
    /// Weights of the point. `[n_cage]`
    pub(super) row: Vec<f64>,
    /// The vertex of the model that walks over it start from.
    pub(super) seed: u32,
    pub(super) is_cage: bool,
}

impl Grip {
    /// Of a point of the model: its weights, `[n_cage]`, and the nearest vertex. What is wrong with them [`super::Drag::new`] says.
    #[must_use]
    pub fn of_row(row: Vec<f64>, seed: u32) -> Self {
        Self { row, seed, is_cage: false }
    }

    /// Of a handle; `triangles` and `weights` are the model's.
    ///
    /// # Errors
    /// When there is no such handle, or the weights are another model's or another cage's.
    pub fn new(
        handle: Handle,
        pull: &Pull,
        triangles: &[[u32; 3]],
        weights: &Weights,
    ) -> Result<Self, PullError> {
        let (rows, columns, vertices, cage) =
            (weights.n_rows(), weights.n_columns(), pull.n_vertices, pull.n_cage());
        if (rows, columns) != (vertices, cage) {
            return Err(PullError::Shape { rows, columns, vertices, cage });
        }
        match handle {
            Handle::Vertex(v) => {
                check("vertex of the model", v, vertices)?;
                Ok(Self::of_row(dense(weights, v as usize), v))
            }
            Handle::Triangle(t, bary) => {
                check("triangle of the model", t, triangles.len())?;
                let sum: f64 = bary.iter().sum();
                if !(bary.iter().all(|b| *b >= -OFF) && (sum - 1.0).abs() < OFF) {
                    return Err(PullError::Barycentric(bary));
                }
                let corners = triangles[t as usize];
                let rows = corners.map(|v| dense(weights, v as usize));
                let row = (0..cage).map(|i| (0..3).map(|k| bary[k] * rows[k][i]).sum()).collect();
                let most = (0..3).max_by(|&a, &b| bary[a].total_cmp(&bary[b])).unwrap_or(0);
                Ok(Self::of_row(row, corners[most]))
            }
            Handle::Cage(i) => pull.on_cage(i),
        }
    }
}

/// Whether an index is below a count.
pub(super) fn check(what: &'static str, index: u32, count: usize) -> Result<(), PullError> {
    let last = count.saturating_sub(1);
    if (index as usize) < count { Ok(()) } else { Err(PullError::Missing { what, index, last }) }
}
