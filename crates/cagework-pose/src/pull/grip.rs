//! Points that a drag moves or fixes.

use super::samples::dense;
use super::{Pull, PullError};
use cagework_core::weights::Weights;

/// Tolerance of barycentric coordinates, which come from pointers and files: each may be at most this far below 0, and
/// their sum at most this far from 1.
const BARYCENTRIC_TOLERANCE: f64 = 1e-3;

/// Whether three numbers are barycentric coordinates: not negative, with the sum 1, up to a tolerance of 1e-3.
#[must_use]
pub fn is_barycentric(bary: [f64; 3]) -> bool {
    let sum: f64 = bary.iter().sum();
    bary.iter().all(|b| *b >= -BARYCENTRIC_TOLERANCE) && (sum - 1.0).abs() <= BARYCENTRIC_TOLERANCE
}

/// Seed of a grip on a cage vertex in [`Grip::of_seed`].
pub const CAGE_SEED: u32 = u32::MAX;

/// A point that can be grabbed or pinned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Handle {
    /// A vertex of the model.
    Vertex(u32),
    /// A point of the model: a triangle and barycentric coordinates.
    Triangle(u32, [f64; 3]),
    /// A cage vertex, or an inner control if the index is at least the number of cage vertices.
    Cage(u32),
}

/// A handle with the weights of the controls at its point.
#[derive(Clone, Debug, PartialEq)]
pub struct Grip {
    /// Weights of the controls at the point, then of the [frames](cagework_core::Frames), which a grip on a control
    /// lacks. `[n_columns]`
    pub(super) row: Vec<f64>,
    /// Vertex of the model from which surface distances are measured.
    pub(super) seed: u32,
    pub(super) is_cage: bool,
}

impl Grip {
    /// Creates a grip at a point of the model from its weights, `[n_columns]`, and its nearest vertex.
    /// [`super::Drag::new`] checks both.
    #[must_use]
    pub fn of_row(row: Vec<f64>, seed: u32) -> Self {
        Self { row, seed, is_cage: false }
    }

    /// Like [`Self::of_row`]; if `seed` is [`CAGE_SEED`], creates a grip on the cage vertex whose weight in `row` is 1.
    ///
    /// # Errors
    /// [`PullError::Missing`] if no weight is 1.
    pub fn of_seed(row: Vec<f64>, seed: u32, pull: &Pull) -> Result<Self, PullError> {
        if seed != CAGE_SEED {
            return Ok(Self::of_row(row, seed));
        }
        let vertex = row.iter().position(|&w| w == 1.0).unwrap_or(usize::MAX);
        pull.on_cage(vertex as u32)
    }

    /// Creates the grip of a handle. `triangles` and `weights`: triangles and weights of the model.
    ///
    /// # Errors
    /// [`PullError`] if the handle does not exist, its coordinates are not barycentric, or `weights` belong to another
    /// model or cage.
    pub fn new(
        handle: Handle,
        pull: &Pull,
        triangles: &[[u32; 3]],
        weights: &Weights,
    ) -> Result<Self, PullError> {
        let (rows, columns, vertices, controls) =
            (weights.n_rows(), weights.n_columns(), pull.n_vertices, pull.n_cage());
        if rows != vertices || columns < controls {
            return Err(PullError::Shape { rows, columns, vertices, controls });
        }
        match handle {
            Handle::Vertex(v) => {
                check("vertex of the model", v, vertices)?;
                Ok(Self::of_row(dense(weights, v as usize), v))
            }
            Handle::Triangle(t, bary) => {
                check("triangle of the model", t, triangles.len())?;
                if !is_barycentric(bary) {
                    return Err(PullError::Barycentric(bary));
                }
                let corners = triangles[t as usize];
                let rows = corners.map(|v| dense(weights, v as usize));
                let row = (0..columns).map(|i| (0..3).map(|k| bary[k] * rows[k][i]).sum()).collect();
                let most = (0..3).max_by(|&a, &b| bary[a].total_cmp(&bary[b])).unwrap_or(0);
                Ok(Self::of_row(row, corners[most]))
            }
            Handle::Cage(i) => pull.on_cage(i),
        }
    }
}

pub(super) fn check(what: &'static str, index: u32, count: usize) -> Result<(), PullError> {
    let last = count.saturating_sub(1);
    if (index as usize) < count { Ok(()) } else { Err(PullError::Missing { what, index, last }) }
}
