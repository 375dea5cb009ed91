//! Errors of deforming a model file.

use cagework_core::bind::BindError;
use cagework_core::words::counted;
use cagework_io::{MemoryError, ModelFormat, ReadError, SelectError, TimelineError, WriteError};
use thiserror::Error;

/// Reason why a model file cannot be deformed.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum JobError {
    /// An option has no effect on splats and points.
    #[error(
        "the option {option} needs a mesh, but splats and points have neither joints nor parts: leave it out"
    )]
    NeedsMesh {
        /// Name of the option, such as "rigid".
        option: &'static str,
    },
    /// A rig has no clip to follow.
    #[error("the rig has no clips: give a file with a clip")]
    NoClips,
    /// Only splats are split.
    #[error("the option split needs a capture of splats, but the model has none: leave it out")]
    NeedsSplats,
    /// Feet cannot be held without a skeleton.
    #[error(
        "locked feet need a model with a skeleton, and a file that keeps it: leave the feet free, or write a GLB"
    )]
    NoFeet,
    /// Expressions need a VRM.
    #[error("expressions need a VRM to read and to write, but {}: write morph targets instead", if *reads_vrm { "the output is not a VRM" } else { "the model has no VRM data" })]
    NoVrm {
        /// Whether the model is a VRM.
        reads_vrm: bool,
    },
    /// Joints cannot be taken from this model.
    #[error("the model has no skeleton: give the body that the models were made for")]
    NoSkeleton,
    /// The format stores one shape.
    #[error(
        "format {} stores one pose, but there are {n}: write a .glb, which stores one morph target per pose, or one \
         file per pose",
        format.name()
    )]
    FormatPoses {
        /// Format of the output.
        format: ModelFormat,
        /// Number of poses.
        n: usize,
    },
    /// An option or a kind of model takes a single pose.
    #[error("{what} takes one pose as its shape, not {}: write one file per pose", counted(*n, "morph target", "morph targets"))]
    OnePose {
        /// Option or kind of model, with an article.
        what: &'static str,
        /// Number of poses.
        n: usize,
    },
    /// The format stores no animation.
    #[error("format {} cannot store a clip: write a .glb", format.name())]
    ClipFormat {
        /// Format of the output.
        format: ModelFormat,
    },
    /// No pose is given.
    #[error("there are no poses: give at least one")]
    NoPoses,
    /// A pose has another number of controls than the cage.
    #[error(
        "a pose has {given} positions, but {expected} controls were bound: give one position per control"
    )]
    OtherCage {
        /// Number of positions of the pose.
        given: usize,
        /// Number of controls.
        expected: usize,
    },
    /// Expressions, times and interpolation belong to poses that are played one after the other.
    #[error(
        "{option}: one pose gives the deformed model, without an animation: leave it out, or give the cage at rest as \
         another pose"
    )]
    NoAnimation {
        /// Name of the option, such as "times".
        option: &'static str,
    },
    /// The number of times differs from the number of poses.
    #[error(
        "times: expected one number per pose ({expected}), got {given}; each keyframe of a clip and each shape key in a \
         file is a pose"
    )]
    Times {
        /// Number of times.
        given: usize,
        /// Number of poses.
        expected: usize,
    },
    /// The weights do not include all points of the model's rig.
    #[error(
        "the weights were made for another version of this rig ({given} points, now {expected}): bind the model again, \
         or write it without its rig"
    )]
    RigPoints {
        /// Number of points with weights.
        given: usize,
        /// Number of points of the rig.
        expected: usize,
    },
    /// The points of another kind of model were bound.
    #[error("the bound points belong to another kind of model: bind those that `Job::points` returns")]
    Unbound,
    /// Times of poses are out of range or out of order.
    #[error(transparent)]
    Timeline(#[from] TimelineError),
    /// A part cannot be selected.
    #[error(transparent)]
    Select(#[from] SelectError),
    /// The points cannot be bound.
    #[error(transparent)]
    Bind(#[from] BindError),
    /// The deformed model and its morph targets do not fit into the memory limit.
    #[error("{}{source}", if *targets > 0 { format!("with {} ", counted(*targets, "morph target", "morph targets")) } else { String::new() })]
    Memory {
        /// Number of morph targets.
        targets: usize,
        /// The memory that is needed, and the limit.
        source: MemoryError,
    },
    /// A file with a moved rig, to which morph targets are added, cannot be read.
    #[error(transparent)]
    Read(Box<ReadError>),
    /// The rig cannot be read, or the file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}
