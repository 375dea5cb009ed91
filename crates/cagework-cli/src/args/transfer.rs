//! Arguments of `cagework transfer`.

use std::path::PathBuf;

use clap::Args;

use super::{ReadArgs, glb_output, mesh_help};

/// Arguments of `cagework transfer`.
#[derive(Args, Debug)]
#[command(
    after_help = "Both files must show the same pose in the same units and axes, as when the clothes were modelled on \
    the body.\n\nExamples:\n  cagework transfer body.glb shirt.obj -o shirt.glb\n  \
    cagework transfer body.glb shirt.obj --push-out 0.002 -o shirt.glb"
)]
pub(crate) struct TransferArgs {
    /// Body with a skeleton or morph targets (.glb, .gltf, .vrm, .fbx).
    pub(crate) body: PathBuf,
    #[arg(help = mesh_help("Clothes, to get a skeleton without one of their own"))]
    pub(crate) clothes: PathBuf,
    #[command(flatten)]
    pub(crate) read: ReadArgs,
    /// Move vertices inside the body, or closer to it than this distance, out to this distance, at rest and in each morph
    /// target. In the model's units.
    #[arg(long, value_name = "DISTANCE", value_parser = super::positive)]
    pub(crate) push_out: Option<f32>,
    /// File to write (.glb): the clothes with the joints, weights and morph targets of the body.
    #[arg(short, long, value_name = "FILE", value_parser = glb_output)]
    pub(crate) output: PathBuf,
}
