//! Arguments of `cagework render`.

use std::path::PathBuf;
use std::str::FromStr;

use cagework_core::Coordinates;
use cagework_core::options::{Choice, GRID, parse_grid};
use cagework_gpu::render::{AxisView, Camera, Theme};
use cagework_gpu::session::MAX_PICTURE;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};

use super::{CageSource, ControlArgs, ReadArgs, SolveArgs, output};

/// Arguments of `cagework render`.
#[derive(Args, Debug)]
#[command(
    after_help = "The model is bound first if the picture needs weights and --weights is not given.\n\n\
    Examples:\n  \
    cagework render horse.glb -o horse.png\n  \
    cagework render horse.glb --cage cage.obj --pose gallop.obj -o gallop.png\n  \
    cagework render horse.glb --cage cage.obj --pose gallop.obj --compare -o beside-mean-value.png\n  \
    cagework render horse.glb --cage cage.obj --show weights --column 17 -o weights.png\n  \
    cagework render horse.glb --cage cage.obj --show wireframe --method classic -g 16 --no-cage -o figure-4.png\n  \
    cagework render fox.glb --clip Walk --at 0,0.2,0.4 -o strip.png\n  \
    cagework render horse.glb --turntable 8 -o turn.png\n  \
    cagework render horse.glb --cage cage.obj --show cells --axis x --at 0.5 --theme light -o cells.png"
)]
pub(crate) struct RenderArgs {
    /// Model to draw.
    #[arg(help = super::model_help("Model to draw"))]
    pub(crate) model: PathBuf,
    #[command(flatten)]
    pub(crate) read: ReadArgs,
    /// Cage: a file, auto:VERTICES, hull:VERTICES or box:DIVISIONS.
    #[arg(long, value_name = "CAGE", required_if_eq_any = [
        ("show", "wireframe"), ("show", "weights"), ("show", "error"), ("show", "cells"), ("show", "slice"),
    ])]
    pub(crate) cage: Option<CageSource>,
    /// Moved cage that deforms the model.
    #[arg(long, value_name = "FILE", requires = "cage")]
    pub(crate) pose: Option<PathBuf>,
    /// Moved controls inside the cage (.obj).
    #[arg(long, value_name = "FILE", requires_all = ["pose", "controls"])]
    pub(crate) pose_controls: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) controls: ControlArgs,
    /// Weights that `cagework bind --weights` wrote; without them the model is bound first.
    #[arg(long, value_name = "FILE", requires = "cage")]
    pub(crate) weights: Option<PathBuf>,
    /// Draw two pictures side by side: harmonic coordinates on the left, these coordinates on the right.
    #[arg(long, value_parser = compared(), num_args = 0..=1, default_missing_value = "mean-value", requires = "cage")]
    pub(crate) compare: Option<Coordinates>,
    /// What to draw.
    #[arg(long, value_enum, default_value_t = ShowArg::Solid)]
    pub(crate) show: ShowArg,
    /// Control whose weights are drawn, counted from 0: the vertices of the cage, then the controls inside.
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub(crate) column: u32,
    /// Axis perpendicular to the slice.
    #[arg(long, default_value = "z", value_parser = axis())]
    pub(crate) axis: usize,
    /// Draw the model as a clip moves it; `cagework info` lists the clips.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["cage", "turntable"])]
    pub(crate) clip: Option<String>,
    /// Times of the clip in seconds, separated by commas; several are drawn side by side [default: 0]. Without a clip:
    /// position of the slice along the axis, 0 to 1 [default: 0.5].
    #[arg(long, value_name = "NUMBER", value_delimiter = ',', value_parser = finite)]
    pub(crate) at: Vec<f32>,
    /// Draw the model from this many directions, side by side: a full turn that starts at --view.
    #[arg(long, value_name = "N", conflicts_with = "compare", value_parser = clap::value_parser!(u32).range(2..=36))]
    pub(crate) turntable: Option<u32>,
    /// Width and height in pixels; with --turntable or several times, of each picture [default: 1280x960; 480x640 for
    /// several pictures].
    #[arg(long, value_name = "WxH")]
    size: Option<Size>,
    /// Pixels per unit of line widths and handle sizes; use 2 for pictures that are displayed at half their size.
    #[arg(long, default_value_t = 1.0, value_parser = super::positive)]
    pub(crate) scale: f32,
    /// Colours of background and floor.
    #[arg(long, default_value_t, value_parser = super::words::<Theme>())]
    pub(crate) theme: Theme,
    /// Camera direction: default, front, back, left, right, top, bottom, or YAW,PITCH in degrees (0,0 is the front; positive pitch looks down).
    #[arg(long, default_value = "default", allow_hyphen_values = true)]
    pub(crate) view: View,
    /// Use an orthographic projection.
    #[arg(long)]
    pub(crate) orthographic: bool,
    /// Hide the cage.
    #[arg(long)]
    pub(crate) no_cage: bool,
    /// Hide the vertices of the cage.
    #[arg(long)]
    pub(crate) no_handles: bool,
    /// Hide the floor.
    #[arg(long)]
    pub(crate) no_floor: bool,
    /// Picture to write (.png).
    #[arg(short, long, value_name = "FILE", value_parser = png_output)]
    pub(crate) output: PathBuf,
    #[arg(short, long, help = GRID.about(), default_value = "auto", value_parser = parse_grid)]
    pub(crate) grid: u32,
    #[command(flatten)]
    pub(crate) solve: SolveArgs,
}

impl RenderArgs {
    /// Number of pictures side by side, without those of `--compare`.
    pub(crate) fn n_pictures(&self) -> usize {
        self.turntable.map_or(if self.clip.is_some() { self.at.len().max(1) } else { 1 }, |n| n as usize)
    }

    /// Width and height of each picture, pixels; with `--compare`, of the two pictures together.
    pub(crate) fn size(&self) -> [u32; 2] {
        self.size.map_or(if self.n_pictures() > 1 { [480, 640] } else { [1280, 960] }, |size| size.0)
    }
}

/// Parses a finite number.
fn finite(text: &str) -> Result<f32, String> {
    text.trim().parse().ok().filter(|x: &f32| x.is_finite()).ok_or_else(|| "not a number".into())
}

/// Value of `--compare` that selects the harmonic coordinates of the cage, without `--smooth` and `--controls`.
const PLAIN_CAGE: &str = "plain";

/// Returns a parser of the word that selects the coordinates to compare with.
fn compared() -> impl TypedValueParser<Value = Coordinates> {
    let forms =
        Coordinates::ALL.iter().filter(|(_, kind)| *kind != Coordinates::Harmonic).map(|(word, kind)| {
            let name = kind.name();
            let help = format!("{}{} coordinates ({})", name[..1].to_uppercase(), &name[1..], kind.about());
            PossibleValue::new(word.replace('_', "-")).help(help)
        });
    let plain = PossibleValue::new(PLAIN_CAGE)
        .help("Harmonic coordinates of the cage without --smooth and --controls");
    PossibleValuesParser::new(forms.chain([plain]))
        .try_map(|word| if word == PLAIN_CAGE { Ok(Coordinates::Harmonic) } else { word.parse() })
}

/// What the picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ShowArg {
    /// The model with its materials.
    Solid,
    /// The model in one colour.
    Clay,
    /// The model with its edges.
    Edges,
    /// The rest pose reconstructed from the weights, with the base mesh as a wireframe: figures 2 to 5 of K.
    /// Smith's paper.
    Wireframe,
    /// Weights of one control (--column) as colours.
    Weights,
    /// Distance between the reconstructed and the true rest position, as colours on a logarithmic scale.
    Error,
    /// A slice of the grid: interior, boundary and exterior cells.
    Cells,
    /// A slice of the grid: weights of one control (--column).
    Slice,
}

/// Returns a parser of the index of a coordinate axis.
fn axis() -> impl TypedValueParser<Value = usize> {
    PossibleValuesParser::new(["x", "y", "z"]).map(|name| "xyz".find(&name).unwrap_or(2))
}

/// Width and height of a picture, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Size(pub(crate) [u32; 2]);

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let side = |text: &str| text.parse().ok().filter(|s| (1..=MAX_PICTURE).contains(s));
        text.split_once('x').and_then(|(width, height)| Some(Self([side(width)?, side(height)?]))).ok_or_else(
            || format!("expected WIDTHxHEIGHT, such as 800x600, with sides of 1 to {MAX_PICTURE}"),
        )
    }
}

/// Direction of the camera, radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct View {
    yaw: f32,
    pitch: f32,
}

impl View {
    /// Yaw and pitch of the camera, radians.
    pub(crate) fn angles(self) -> (f32, f32) {
        (self.yaw, self.pitch)
    }
}

impl FromStr for View {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut camera = Camera::default();
        match text {
            "default" => {}
            "front" => camera.look_along(AxisView::Front),
            "back" => camera.look_along(AxisView::Back),
            "left" => camera.look_along(AxisView::Left),
            "right" => camera.look_along(AxisView::Right),
            "top" => camera.look_along(AxisView::Top),
            "bottom" => camera.look_along(AxisView::Bottom),
            _ => {
                let angle = |text: &str| text.trim().parse::<f32>().ok().filter(|a| a.is_finite());
                let angles = text.split_once(',').and_then(|(y, p)| Some((angle(y)?, angle(p)?)));
                let (yaw, pitch) = angles.filter(|(_, pitch)| pitch.abs() <= 90.0).ok_or(
                    "expected default, front, back, left, right, top, bottom or YAW,PITCH in degrees",
                )?;
                return Ok(Self { yaw: yaw.to_radians(), pitch: pitch.to_radians() });
            }
        }
        Ok(Self { yaw: camera.yaw, pitch: camera.pitch })
    }
}

fn png_output(text: &str) -> Result<PathBuf, String> {
    output(text, &["png"])
}
