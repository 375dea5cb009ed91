//! Arguments of `cagework refit`.

use std::path::PathBuf;

use cagework_core::options::{self, parse_grid};
use clap::Args;

use super::{ControlArgs, ReadArgs, RigArgs, SolveArgs};

/// Arguments of `cagework refit`.
#[derive(Args, Debug)]
// The GPU is refused with a hint, so the option is parsed, but not listed.
#[command(mut_arg("backend", |arg| arg.hide(true)))]
#[command(mut_arg("shape_only", |arg| arg.help("Write the mesh only, without skin and clips")))]
#[command(
    after_help = "Each model is written under its own name (.gltf and .fbx as .glb) as soon as it is done. If a model fails, the \
    error is printed and the other models are still written; the exit code is then 1.\n\n\
    Examples:\n  \
    cagework refit jacket.glb trousers.glb --cage body.obj --pose bulky.obj -o out\n  \
    cagework refit walk.glb run.glb --skeleton body.glb --cage body.obj --pose bulky.obj -o out   (clips without a mesh)\n  \
    cagework refit --manifest garments.txt --cage body.obj --pose bulky.obj -o out --resume --json"
)]
pub(crate) struct RefitArgs {
    /// Models inside the cage, and folders of models.
    #[arg(value_name = "MODEL", required_unless_present = "manifest", help = super::mesh_help("Models inside the cage, and folders of models"))]
    pub(crate) models: Vec<PathBuf>,
    /// Text file with more models, one name per line; empty lines and lines that start with # are ignored.
    #[arg(long, value_name = "FILE")]
    pub(crate) manifest: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) read: ReadArgs,
    /// File of the cage that encloses all models.
    #[arg(long, value_name = "FILE")]
    pub(crate) cage: PathBuf,
    /// Moved cage: the same vertices in the same order.
    #[arg(long, value_name = "FILE")]
    pub(crate) pose: PathBuf,
    /// Moved controls inside the cage (.obj): the same vertices in the same order [default: at rest].
    #[arg(long, value_name = "FILE", requires = "controls")]
    pub(crate) pose_controls: Option<PathBuf>,
    /// Body whose joints the models share: joints with the same name move as in this file, and files of clips without a mesh are
    /// accepted. Without it, joints with the same name still move by the same distance in all models.
    #[arg(long, value_name = "FILE", conflicts_with = "shape_only")]
    pub(crate) skeleton: Option<PathBuf>,
    /// Folder to write to; created if it does not exist.
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: PathBuf,
    /// Skip outputs that are newer than their model, cage, pose and controls. Options are not compared.
    #[arg(long)]
    pub(crate) resume: bool,
    #[arg(short, long, help = options::GRID.about(), default_value = "auto", value_parser = parse_grid)]
    pub(crate) grid: u32,
    #[command(flatten)]
    pub(crate) rig: RigArgs,
    #[command(flatten)]
    pub(crate) controls: ControlArgs,
    #[command(flatten)]
    pub(crate) solve: SolveArgs,
}
