//! Arguments that subdivide the cage, and that add controls inside it.

use std::path::PathBuf;

use cagework_core::options;
use clap::Args;

/// Argument for the subdivision of the cage.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(crate) struct SmoothArgs {
    #[arg(long, help = options::SMOOTH_STEPS.about(), default_value_t = 0, value_name = "STEPS", value_parser = super::number::<u32>(options::SMOOTH_STEPS))]
    pub(crate) smooth: u32,
}

/// Arguments for the subdivision of the cage, and for controls inside it.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct ControlArgs {
    #[command(flatten)]
    pub(crate) smooth: SmoothArgs,
    /// Controls inside the cage (.obj): points (p), polylines (l) and sheets of faces (f). Each vertex is a column of the
    /// weights, after those of the cage.
    #[arg(long, value_name = "FILE")]
    pub(crate) controls: Option<PathBuf>,
    /// Radius of the points and lines, in the model's units [default: 1/32 of the cage's longest side].
    #[arg(long, value_name = "LENGTH", requires = "controls", value_parser = super::positive)]
    pub(crate) radius: Option<f32>,
}
