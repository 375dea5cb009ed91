//! Pulling the model itself: points of it are grabbed and moved, and the cage is solved for, so that the rest bends as
//! little as it can.
//!
//! Unknown are the cage's vertices `c` (`[n, 3]`). The energy is of the local and global kind (Sorkine and Alexa 2007), its
//! rotations and moments as in Jacobson et al. 2012, "Fast automatic skinning transformations":
//!
//! ```text
//! E(c) = sum_r sum_{e in r} w_e |D_e c - R_r d_e|^2    groups r with one rotation each
//!      + sum_s m_s |W_s c - p_s|^2                      samples that stay where they were
//!      + mu |Q c - T|^2 + eps |c - c0|^2                grabs and pins, and a little of everything
//! ```
//!
//! A group is a sample of the model with the gradients of the weights there (three rows `D_e`: the energy measures how far
//! the deformation's Jacobian is from a rotation), or a cage vertex with its edges. One solve per binding gives the
//! gradients ([`Probes`]), one factorisation per grab the rest ([`Drag`]), and a frame is a few steps of rotations and
//! multiplications ([`Drag::frame`]). With targets for all of the model, or for landmarks on it, the same energy fills in what they
//! leave open ([`Pull::fit`]).

mod anderson;
mod drag;
mod energy;
mod fit;
mod frame;
mod geodesic;
mod grip;
mod nearest;
mod samples;
#[cfg(test)]
mod tests;

use thiserror::Error;

pub use drag::{Drag, DragOptions, Reach};
pub use energy::Pull;
pub use fit::{FitOptions, Fitted};
pub use grip::{Grip, Handle};
pub use samples::Probes;

/// Grabs and pins together: each is a row of a dense matrix that every grab inverts.
pub const MAX_HANDLES: usize = 200;

/// Cage vertices: a pull's matrices are dense, and a frame multiplies by them.
pub const MAX_CAGE: usize = 1000;

/// Why nothing can be pulled.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PullError {
    /// The model has no vertices.
    #[error("the model has no vertices: there is nothing to take hold of")]
    Empty,
    /// Weights of something else.
    #[error(
        "the weights are of {rows} model vertices and {columns} cage vertices, but the model has {vertices} and the cage {cage}: \
         bind this model to this cage"
    )]
    Shape {
        /// Rows of the weights.
        rows: usize,
        /// Their columns.
        columns: usize,
        /// Vertices of the model.
        vertices: usize,
        /// Vertices of the cage.
        cage: usize,
    },
    /// A cage that is too large.
    #[error("the cage has {cage} vertices; at most {MAX_CAGE} can be pulled: make a coarser cage")]
    Cage {
        /// Its vertices.
        cage: usize,
    },
    /// A handle that is not there.
    #[error("there is no {what} {index}: they count from 0 to {last}")]
    Missing {
        /// Vertex, triangle or cage vertex.
        what: &'static str,
        /// The number that was given.
        index: u32,
        /// The largest there is.
        last: usize,
    },
    /// Barycentric coordinates that are no point of a triangle.
    #[error("{0:?} is no point of a triangle: three numbers that are not negative and sum to 1")]
    Barycentric([f64; 3]),
    /// Nothing is grabbed.
    #[error("nothing is grabbed: give at least one grab")]
    NoGrab,
    /// More handles than there may be.
    #[error("{0} grabs and pins; at most {MAX_HANDLES}")]
    Handles(usize),
    /// A position or a number that is not finite or out of range.
    #[error("{what} is {value}; it must be {range}")]
    Value {
        /// What it is.
        what: &'static str,
        /// What was given.
        value: f64,
        /// What may be given.
        range: &'static str,
    },
    /// Targets of other points.
    #[error("there are {given} targets for {points} points: one for each")]
    Targets {
        /// Targets.
        given: usize,
        /// Points.
        points: usize,
    },
    /// Nothing has a place to go to.
    #[error("no point has a target: all of them lie outside the cage, or count for nothing")]
    NoTarget,
    /// A pose of another cage.
    #[error("the start has {given} vertices, but the cage has {cage}")]
    Start {
        /// Vertices of the start.
        given: usize,
        /// Vertices of the cage.
        cage: usize,
    },
    /// The equations have no solution in f64.
    #[error("the pull cannot be solved: is the cage flat, or the pose not finite?")]
    Singular,
}
