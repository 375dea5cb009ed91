//! Arguments of the commands that solve for a pose of the cage: `pull` and `fit`.

use std::path::PathBuf;

use cagework_core::options::{self, parse_grid};
use clap::Args;

use super::{CageSource, ControlArgs, ModelOutput, ReadArgs, mesh_help, model_help, obj_output};

/// Files of the bound model, and files for the pose that the command finds.
#[derive(Args, Debug)]
pub(crate) struct PoseArgs {
    /// Mesh that was bound.
    #[arg(help = model_help("Mesh that was bound"))]
    pub(crate) mesh: PathBuf,
    #[command(flatten)]
    pub(crate) read: ReadArgs,
    /// Cage that it was bound to: a file, or the same auto:VERTICES, hull:VERTICES or box:DIVISIONS.
    #[arg(long, value_name = "CAGE")]
    pub(crate) cage: CageSource,
    /// Weights that `cagework bind --weights` wrote; not for splats and points.
    #[arg(long, value_name = "FILE")]
    pub(crate) weights: Option<PathBuf>,
    /// File for the pose of the cage; the extension selects the format.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: ModelOutput,
    #[arg(short, long, help = format!("{}. The solver samples the gradients of the weights on this grid", options::GRID.about()), default_value = "auto", value_parser = parse_grid)]
    pub(crate) grid: u32,
    #[command(flatten)]
    pub(crate) controls: ControlArgs,
    /// File for the pose of the controls inside the cage (.obj).
    #[arg(long, value_name = "FILE", requires = "controls", value_parser = obj_output)]
    pub(crate) save_controls: Option<PathBuf>,
}

/// Arguments of `cagework fit`.
#[derive(Args, Debug)]
#[command(after_help = "The file of --landmarks is a list, such as\n\n  \
    [{\"vertex\": 1204, \"to\": [0.4, 1.1, 0]},\n   {\"triangle\": 88, \"bary\": [0.2, 0.3, 0.5], \"to\": [0, 1, 0]},\n   \
    {\"point\": [0.1, 1.7, 0.1], \"to\": [0.1, 1.9, 0.2]}]\n\n\
    A landmark is a vertex of the model, a point of a triangle, or the model's closest point to a position. \
    An optional \"weight\" says how much it counts, 1 by default.\n\n\
    Examples:\n  cagework fit shirt.glb --cage cage.obj --weights shirt.npz --target shirt-large.glb -o large.obj\n  \
    cagework fit shirt.glb --cage cage.obj --weights shirt.npz --landmarks body.json -o body.obj")]
// Unlike `pull`, a fit takes no splats and points.
#[command(mut_arg("mesh", |arg| arg.help(mesh_help("Mesh that was bound"))))]
#[command(mut_arg("weights", |arg| arg.help("Weights that `cagework bind --weights` wrote")))]
#[command(group = clap::ArgGroup::new("to").required(true).args(["target", "landmarks"]))]
pub(crate) struct FitArgs {
    #[command(flatten)]
    pub(crate) pose: PoseArgs,
    /// Target model: the same vertices in the same order.
    #[arg(long, value_name = "MESH")]
    pub(crate) target: Option<PathBuf>,
    /// Target positions of points of the model, as JSON.
    #[arg(long, value_name = "FILE")]
    pub(crate) landmarks: Option<PathBuf>,
    /// Stiffness: larger values bend the model less but miss the targets by more [default: estimated from the noise of
    /// the targets; 1e-5 with fewer than four targets per cage vertex].
    #[arg(long, value_name = "NUMBER")]
    pub(crate) lambda: Option<f64>,
}
