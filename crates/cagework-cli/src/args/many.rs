//! Many models in one cage, and one bind on many machines.

use std::ops::Range;
use std::path::PathBuf;

use cagework_core::options;
use clap::Args;

use super::{ControlArgs, MemoryArgs, ReadArgs, RigArgs, SolveArgs, npz_output, number};

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

/// `cagework merge`
#[derive(Args, Debug)]
#[command(after_help = "The weights are those of one bind of all columns, to the bit.\n\n\
    Example:\n  \
    cagework bind horse.glb --cage cage.obj -g 256 --columns 0:400 --weights part1.npz\n  \
    cagework bind horse.glb --cage cage.obj -g 256 --columns 400:812 --weights part2.npz\n  \
    cagework merge part1.npz part2.npz -o weights.npz")]
pub(crate) struct MergeArgs {
    /// The parts, in any order (.npz): together all columns, each once.
    #[arg(value_name = "PART", required = true)]
    pub(crate) parts: Vec<PathBuf>,
    /// Weights file to write (.npz).
    #[arg(short, long, value_name = "FILE", value_parser = npz_output)]
    pub(crate) output: PathBuf,
    /// Threads; 0 for all.
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub(crate) threads: usize,
    #[command(flatten)]
    pub(crate) memory: MemoryArgs,
}

/// A half-open range such as `0:40`.
pub(super) fn columns(text: &str) -> Result<Range<usize>, String> {
    let wrong = || "not two whole numbers A:B with A below B".to_owned();
    let (begin, end) = text.split_once(':').ok_or_else(wrong)?;
    match (begin.parse(), end.parse()) {
        (Ok(begin), Ok(end)) if begin < end => Ok(begin..end),
        _ => Err(wrong()),
    }
}
