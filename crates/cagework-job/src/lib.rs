#![doc = include_str!("../README.md")]

mod clip;
mod error;
mod follow;
mod job;
mod options;
mod poses;

pub use clip::{ClipPoses, ClipRig, FigureSurface, MAX_BEND};
pub use error::JobError;
pub use follow::{BoundPoints, Follow, JobPoints};
pub use job::{Deformed, Job, JobModel, Written, require_memory};
pub use options::JobOptions;
pub use poses::{NamedPose, PoseTimes, Poses};
