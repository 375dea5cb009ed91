//! Arguments of `cagework deform` for a cage that follows the clip of a rig.

use std::path::PathBuf;

use cagework_core::options::Number;
use cagework_pose::humanoid::Bone;
use clap::Args;
use clap::builder::NonEmptyStringValueParser;

use super::{number, output};

/// Frames per second of a sequence.
const FPS: Number = Number {
    name: "fps",
    help: "Frames per second of the sequence",
    unit: "frames per second",
    allowed: "a number from 1 to 120",
    is_allowed: |n| (1.0..=120.0).contains(&n),
    slider: None,
};

/// A clip that the cage follows instead of poses.
#[derive(Args, Debug)]
pub(crate) struct ClipArgs {
    /// Let the cage follow this clip of the rig. Captures and points are written as a sequence of files, such as
    /// walk-0001.ply; a mesh with its weights as one .glb with a morph target per frame, or as a sequence.
    #[arg(long, value_name = "CLIP", requires = "rig", requires = "output", value_parser = NonEmptyStringValueParser::new(), conflicts_with_all = ["pose", "name", "expression", "pose_controls", "times", "interpolation", "lattice", "dynamic", "rigid", "mask", "ground", "feet"])]
    pub(crate) clip: Option<String>,
    /// Humanoid rig with the clip (.glb, .vrm, .gltf, .fbx). Its joints are fitted to the model: by the limbs of both, or else by
    /// their boxes.
    #[arg(long, value_name = "FILE", requires = "clip")]
    pub(crate) rig: Option<PathBuf>,
    /// Joint of a humanoid bone of the rig that is not found or wrong. May be given several times.
    #[arg(long, value_name = "BONE=JOINT", value_parser = super::proportions::bone, requires = "clip")]
    pub(crate) bone: Vec<(Bone, String)>,
    /// Joints in the model (.json), as --joints-out writes them. Joints that the file lacks are fitted.
    #[arg(long, value_name = "FILE", requires = "clip")]
    pub(crate) joints_in: Option<PathBuf>,
    /// Write the joints in the model (.json), to correct them and give them back with --joints-in.
    #[arg(long, value_name = "FILE", requires = "clip", value_parser = json_output)]
    pub(crate) joints_out: Option<PathBuf>,
    #[arg(long, help = FPS.about(), default_value_t = 24.0, value_name = "FPS", requires = "clip", value_parser = number::<f32>(FPS))]
    pub(crate) fps: f32,
    /// Skip frames whose files are newer than all inputs.
    #[arg(long, requires = "clip")]
    pub(crate) resume: bool,
}

fn json_output(text: &str) -> Result<PathBuf, String> {
    output(text, &["json"])
}
