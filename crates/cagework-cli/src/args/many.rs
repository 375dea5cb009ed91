//! Many models in one cage.

use std::path::PathBuf;

use cagework_core::options;
use clap::Args;

use super::{ControlArgs, ReadArgs, RigArgs, SolveArgs, number};

/// `cagework refit`
#[derive(Args, Debug)]
#[command(
    after_help = "Each model is written under its own name (a .gltf as .glb) as soon as it is done. What fails is named, and \
    the rest goes on; the exit code is 1 then.\n\n\
    Examples:\n  \
    cagework refit jacket.glb trousers.glb --cage body.obj --pose bulky.obj -o out\n  \
    cagework refit --manifest garments.txt --cage body.obj --pose bulky.obj -o out --resume --json"
)]
pub(crate) struct RefitArgs {
    /// Models in the cage.
    #[arg(value_name = "MODEL", required_unless_present = "manifest", help = super::model_help("Models in the cage"))]
    pub(crate) models: Vec<PathBuf>,
    /// Read the names of more models from a text file, one a line; empty lines and those that begin with # say nothing.
    #[arg(long, value_name = "FILE")]
    pub(crate) manifest: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) read: ReadArgs,
    /// The cage of all of them, a file.
    #[arg(long, value_name = "FILE")]
    pub(crate) cage: PathBuf,
    /// The cage, moved: same vertices in the same order.
    #[arg(long, value_name = "FILE")]
    pub(crate) pose: PathBuf,
    /// The controls inside, moved (.obj): same vertices in the same order; at rest unless given.
    #[arg(long, value_name = "FILE", requires = "controls")]
    pub(crate) pose_controls: Option<PathBuf>,
    /// Folder to write to; it is made if it is missing.
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: PathBuf,
    /// Leave what is newer than its model, cage, pose and controls. Options are not looked at.
    #[arg(long)]
    pub(crate) resume: bool,
    /// Cells along the longest side of the cage, 8 to 512.
    #[arg(short, long, default_value_t = 64, value_parser = number::<u32>(options::GRID))]
    pub(crate) grid: u32,
    #[command(flatten)]
    pub(crate) rig: RigArgs,
    #[command(flatten)]
    pub(crate) controls: ControlArgs,
    #[command(flatten)]
    pub(crate) solve: SolveArgs,
}
