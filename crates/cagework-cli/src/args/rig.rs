//! What becomes of a rig.

use cagework_io::{Joints, ReshapeOptions};
use clap::{Args, ValueEnum};

/// How a rigged model is deformed.
#[derive(Args, Debug)]
pub(crate) struct RigArgs {
    /// What joints do: follow the cage and keep their directions; stay where they are, for skeletons that other files share; or
    /// turn with the shape as well.
    #[arg(long, value_enum, default_value_t = JointsArg::Follow)]
    joints: JointsArg,
    /// Keep how far clips travel; otherwise it grows with the height of the joint.
    #[arg(long)]
    keep_travel: bool,
    /// Name of a node below a joint whose mesh keeps its shape: a buckle, an eye. May be given several times.
    #[arg(long, value_name = "NODE")]
    rigid: Vec<String>,
    /// Write the shape alone: no skin, no morph targets but those of several poses.
    #[arg(long = "static")]
    pub(crate) plain: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum JointsArg {
    Follow,
    Stay,
    Turn,
}

impl RigArgs {
    /// As the library takes them.
    pub(crate) fn options(&self) -> ReshapeOptions {
        let joints = match self.joints {
            JointsArg::Follow => Joints::Follow,
            JointsArg::Stay => Joints::Stay,
            JointsArg::Turn => Joints::Turn,
        };
        ReshapeOptions { joints, keep_travel: self.keep_travel, rigid: self.rigid.clone() }
    }
}
