//! Arguments of `cagework transfer`.

use std::path::PathBuf;

use clap::Args;

use super::{ReadArgs, glb_output, model_help};

/// Arguments of `cagework transfer`.
#[derive(Args, Debug)]
#[command(
    after_help = "Both files must show the same pose in the same units and axes, as when the clothes were modelled on \
    the body.\n\nExample:\n  cagework transfer body.glb shirt.obj -o shirt.glb"
)]
pub(crate) struct TransferArgs {
    /// Body with a skeleton (.glb, .gltf, .vrm).
    pub(crate) body: PathBuf,
    #[arg(help = model_help("Clothes without a skeleton"))]
    pub(crate) clothes: PathBuf,
    #[command(flatten)]
    pub(crate) read: ReadArgs,
    /// File to write (.glb): the clothes with the joints and weights of the body.
    #[arg(short, long, value_name = "FILE", value_parser = glb_output)]
    pub(crate) output: PathBuf,
}
