//! What can be said about controls: how smooth the cage is, and what is inside.

use std::path::PathBuf;

use cagework_core::options;
use clap::Args;

/// How smooth a cage is.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(crate) struct SmoothArgs {
    /// Smooth the cage by so many steps of subdivision (Catmull-Clark), 0 to 3: its vertices stay the controls, and the model
    /// shows no edges of it.
    #[arg(long, default_value_t = 0, value_name = "STEPS", value_parser = super::number::<u32>(options::SMOOTH))]
    pub(crate) smooth: u32,
}

/// Controls of a bind besides the cage's vertices.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct ControlArgs {
    #[command(flatten)]
    pub(crate) smooth: SmoothArgs,
    /// Controls inside the cage (.obj): points (p), polylines (l), and faces (f) of sheets; each of its vertices is a column
    /// after those of the cage.
    #[arg(long, value_name = "FILE")]
    pub(crate) controls: Option<PathBuf>,
    /// Radius of these points and lines, in the model's units [default: 1/32 of the cage's longest side].
    #[arg(long, value_name = "LENGTH", requires = "controls", value_parser = super::positive)]
    pub(crate) radius: Option<f32>,
}
