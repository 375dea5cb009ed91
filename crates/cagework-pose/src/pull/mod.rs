//! Direct manipulation of the model: the user moves points of the model, and a solver finds the cage that moves them
//! there while the rest of the model bends as little as possible.
//!
//! The unknowns are the cage's vertices `c` (`[n, 3]`). The energy is the as-rigid-as-possible energy of Sorkine and
//! Alexa 2007, with one rotation per group as in Jacobson et al. 2012, "Fast automatic skinning transformations":
//!
//! ```text
//! E(c) = sum_r sum_{e in r} w_e |D_e c - R_r d_e|^2    groups r with one rotation each
//!      + sum_s m_s |W_s c - p_s|^2                      samples far from the moved points stay in place
//!      + mu |Q c - T|^2 + eps |c - c0|^2                grabs and pins; regularisation
//! ```
//!
//! `W_s` and `Q` are the weights of samples, and of grabs and pins; `p_s` and `T` are the positions at which these are
//! held. `d_e` are the vectors `D_e c` of a reference pose, and `c0` is the cage at the start.
//!
//! A group is a sample of the model with the gradients of the weights there (three rows `D_e`: the energy measures the
//! distance of the deformation's Jacobian from a rotation), or a cage vertex with its edges. The gradients come from a
//! bind of additional points, once per model ([`Probes`]). A drag factorises its matrix once ([`Drag`]), and a frame is
//! a few local-global steps ([`Drag::frame`]). [`Pull::fit`] minimises the same energy with targets for all vertices or
//! for landmarks.

mod anderson;
mod drag;
mod energy;
mod fit;
mod frame;
mod geodesic;
mod grip;
mod samples;
#[cfg(test)]
mod tests;

use cagework_core::words::number;
use thiserror::Error;

pub use drag::{Drag, DragOptions, REACH, Reach};
pub use energy::Pull;
pub use fit::{Fit, FitOptions};
pub use grip::{CAGE_SEED, Grip, Handle, is_barycentric};
pub use samples::Probes;

/// Limit on grabs and pins together, because a drag inverts a dense matrix of that size.
pub const MAX_HANDLES: usize = 200;

/// Usual number of frames in which a drag that is not interactive moves its grabs to their targets.
pub const DRAG_FRAMES: u32 = 30;

/// Limit on controls (cage vertices and inner controls), because the matrices are dense and every frame multiplies by
/// them.
pub const MAX_CONTROLS: usize = 1000;

/// Why a pull or a fit failed.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PullError {
    /// The model has no vertices.
    #[error("the model has no vertices to grab")]
    Empty,
    /// The weights belong to another model or cage.
    #[error(
        "the weights are for {rows} model vertices and {columns} controls, but the model has {vertices} and the cage {controls}: \
     bind this model to this cage"
    )]
    Shape {
        /// Number of rows of the weights.
        rows: usize,
        /// Number of columns of the weights.
        columns: usize,
        /// Number of vertices of the model.
        vertices: usize,
        /// Number of controls: vertices of the cage and inner controls.
        controls: usize,
    },
    /// There are too many controls.
    #[error(
        "the cage has {controls} controls (its vertices and the controls inside); a pull or fit takes at most \
         {MAX_CONTROLS}: make a coarser cage"
    )]
    Controls {
        /// Number of controls: vertices of the cage and inner controls.
        controls: usize,
    },
    /// A handle does not exist.
    #[error("there is no {what} {index}: indices run from 0 to {last}")]
    Missing {
        /// Kind of handle: vertex, triangle or cage vertex.
        what: &'static str,
        /// The index that does not exist.
        index: u32,
        /// The largest valid index.
        last: usize,
    },
    /// The coordinates are not barycentric.
    #[error("{0:?} are not barycentric coordinates: give three numbers that are not negative and sum to 1")]
    Barycentric([f64; 3]),
    /// There is no grab.
    #[error("nothing is grabbed: give at least one grab")]
    NoGrab,
    /// There are too many grabs and pins.
    #[error("{0} grabs and pins are more than the limit of {MAX_HANDLES}: remove some")]
    Handles(usize),
    /// A value is not finite, or it is out of range.
    #[error("{what} is {}; it must be {range}", number(*value))]
    Value {
        /// Name of the invalid quantity.
        what: &'static str,
        /// The rejected value.
        value: f64,
        /// The valid range, in words.
        range: &'static str,
    },
    /// Targets and points differ in number.
    #[error("there are {given} targets for {points} points: give one per point")]
    Targets {
        /// Number of targets.
        given: usize,
        /// Number of points, each of which needs a target.
        points: usize,
    },
    /// No point has a target and weight.
    #[error("no point has a target: all points lie outside the cage or have zero weight")]
    NoTarget,
    /// The start pose belongs to another cage.
    #[error("the start pose has {given} vertices, but the cage has {cage}")]
    Start {
        /// Number of vertices of the start pose.
        given: usize,
        /// Number of vertices of the cage.
        cage: usize,
    },
    /// The matrix is singular in f64.
    #[error(
        "the pull cannot be solved: check that the cage is not flat and that the pose has only finite numbers"
    )]
    Singular,
}
