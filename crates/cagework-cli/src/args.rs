//! Definition of the command line. If the arguments do not parse, the command ends with exit code 2 before any work
//! starts.

mod cages;
mod clip;
mod controls;
mod field;
mod many;
mod pose;
mod proportions;
mod render;
mod rig;
mod solve;
mod transfer;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::str::FromStr;

pub(crate) use cages::{CageArgs, CageSource, CheckArgs, KindArg};
use cagework_core::field as field_options;
use cagework_core::options::{self, Choice, Number, parse_grid};
use cagework_io::{Interpolation, MAX_SECONDS, ModelFormat, UpAxis};
use clap::builder::{
    NonEmptyStringValueParser, PossibleValue, PossibleValuesParser, StringValueParser, TypedValueParser,
};
use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::files::{STREAM, is_stream, stream_name};
pub(crate) use clip::ClipArgs;
pub(crate) use controls::{ControlArgs, SmoothArgs};
pub(crate) use field::MapArgs;
pub(crate) use many::RefitArgs;
pub(crate) use pose::{FitArgs, PoseArgs};
pub(crate) use proportions::ProportionsArgs;
pub(crate) use render::{RenderArgs, ShowArg};
pub(crate) use rig::RigArgs;
pub(crate) use solve::{MemoryArgs, SolveArgs};
pub(crate) use transfer::TransferArgs;

/// Bind a 3-D model to a cage by harmonic coordinates, then deform it by moving the cage.
#[derive(Debug, Parser)]
#[command(name = "cagework", version, propagate_version = true, max_term_width = 100)]
#[command(
    after_help = "Errors go to stderr; the exit code is 1 after an error and 2 if the arguments are invalid.\n\n\
    Examples:\n  \
    cagework demo\n  \
    cagework info horse.glb\n  \
    cagework bind horse.glb --cage cage.obj --weights horse.npz --report horse.json\n  \
    cagework deform horse.glb --cage cage.obj --weights horse.npz --pose gallop.obj -o gallop.glb\n  \
    cagework cage - --format stl -o cage.obj < horse.stl"
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Print the result as JSON on stdout, an error as JSON on stderr, and no text.
    #[arg(long, global = true)]
    pub(crate) json: bool,
    /// Show no progress and print no notes.
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,
    /// Format of a model that is read from standard input or written to standard output; both are named -.
    #[arg(long, global = true, value_name = "FORMAT", value_parser = stream_format)]
    pub(crate) format: Option<String>,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Describe a model, and check whether it is a valid cage.
    Info(InfoArgs),
    /// Compute the weights that tie a mesh to a cage.
    Bind(BindArgs),
    /// Move the cage, and deform the mesh with it.
    Deform(DeformArgs),
    /// Change the proportions of a humanoid: longer legs, a bigger head.
    Proportions(ProportionsArgs),
    /// Map points through the deformation of a moved cage, or back.
    Map(MapArgs),
    /// Deform many models with one cage and one pose. The cage is solved once; each model gets its own output file.
    Refit(RefitArgs),
    /// Give clothes the skeleton and the joint weights of a body.
    Transfer(TransferArgs),
    /// Move points of the model to given positions by solving for the pose of the cage.
    Pull(PullArgs),
    /// Find the cage pose that deforms a model into a target: another model with the same vertices, or landmarks.
    Fit(FitArgs),
    /// Draw a picture of a model in its cage (needs a GPU, or the software adapter of mesa-vulkan-drivers).
    Render(RenderArgs),
    /// Make a cage for a model: a cage that follows its limbs, its convex hull, or a subdivided box.
    Cage(CageArgs),
    /// List the faults of a cage and repair them.
    Check(CheckArgs),
    /// Bind and deform the built-in sample.
    Demo(DemoArgs),
    /// Write completions for shells, and manual pages.
    #[command(hide = true)]
    ShellFiles(ShellFilesArgs),
}

/// Arguments of `cagework shell-files`.
#[derive(Args, Debug)]
pub(crate) struct ShellFilesArgs {
    /// Folder to write to.
    pub(crate) folder: PathBuf,
}

/// Arguments of `cagework info`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  cagework info horse.glb\n  cagework info cage.obj --json")]
pub(crate) struct InfoArgs {
    /// Model to describe.
    #[arg(help = model_help("Model to describe"))]
    pub(crate) model: PathBuf,
    #[command(flatten)]
    pub(crate) read: ReadArgs,
}

/// Arguments of `cagework bind`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  \
    cagework bind horse.glb --cage cage.obj --weights horse.npz\n  \
    cagework bind horse.glb --cage cage.obj -g 128 --sparsify 1e-5 --report horse.json\n  \
    cagework bind horse.obj --cage auto:80 --save-cage cage.obj -o rest.glb\n  \
    cagework bind horse.glb --cage cage.obj --smooth 2 --controls spine.obj --weights horse.npz\n  \
    cagework bind horse.obj --cage cage.obj --method classic --threads 1   (the published algorithm)")]
pub(crate) struct BindArgs {
    /// Mesh to bind.
    #[arg(help = mesh_help("Mesh to bind"))]
    pub(crate) mesh: PathBuf,
    #[command(flatten)]
    pub(crate) read: ReadArgs,
    /// Cage: a file; auto or auto:VERTICES for a cage that follows the mesh; hull or hull:VERTICES for its convex hull; box or
    /// box:DIVISIONS for a subdivided box.
    #[arg(long, value_name = "CAGE")]
    pub(crate) cage: CageSource,
    #[arg(short, long, help = options::GRID.about(), default_value = "auto", value_parser = parse_grid)]
    pub(crate) grid: u32,
    /// Write the rest pose as reconstructed from the weights; the file extension selects the format.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<ModelOutput>,
    /// Write the weights (.npz; one row per vertex of the mesh file, one column per cage vertex, then one per control inside).
    #[arg(long, value_name = "FILE", value_parser = npz_output)]
    pub(crate) weights: Option<PathBuf>,
    /// For a rigged model, bind the mesh only, without joints and morph targets; `deform` then needs --static too.
    #[arg(long = "static")]
    pub(crate) shape_only: bool,
    /// Write the report as JSON; use - for stdout.
    #[arg(long, value_name = "FILE")]
    pub(crate) report: Option<PathBuf>,
    /// Write the cage that was used (.obj).
    #[arg(long, value_name = "FILE", value_parser = obj_output)]
    pub(crate) save_cage: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) controls: ControlArgs,
    #[command(flatten)]
    pub(crate) solve: SolveArgs,
}

/// Options for reading files. All commands that read a model or a cage share them.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct ReadArgs {
    /// Up axis of the files. With z or y-down, models, cages and poses are rotated to y up when they are read, and rotated
    /// back when they are written.
    #[arg(long, default_value_t, value_name = "AXIS", value_parser = words::<UpAxis>())]
    up: UpAxis,
    #[command(flatten)]
    pub(crate) memory: MemoryArgs,
}

impl ReadArgs {
    /// The up axis of the files that the command reads and writes.
    pub(crate) fn axis(self) -> UpAxis {
        self.up
    }
}

/// Formats of `cagework deform --lattice`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum LatticeFormat {
    #[default]
    Npz,
    Blender,
}

/// Arguments of `cagework deform`.
#[derive(Args, Debug)]
#[command(
    after_help = "One pose gives the deformed model. Several give a GLB with one morph target per pose and an \
    animation that plays them: without --times, one pose per second, starting and ending at rest; poses of one file with \
    keyframes keep their times. Gaussian splats and point clouds take one pose and no weights.\n\n\
    Examples:\n  \
    cagework deform plant.ply --cage cage.obj --pose bent.obj -o bent.ply\n  \
    cagework deform person.ply --cage cage.obj --rig humanoid.glb --clip Walk --split -o walk.ply\n  \
    cagework deform horse.glb --cage cage.obj --weights horse.npz --pose gallop.obj -o gallop.glb\n  \
    cagework deform horse.glb --cage cage.obj --weights horse.npz --pose a.obj --pose b.obj -o poses.glb\n  \
    cagework deform avatar.fbx --cage cage.obj --weights avatar.npz --pose wide.obj --displacements wide.json\n  \
    cagework deform horse.glb --cage cage.obj --weights horse.npz --pose a.obj --pose b.obj --times 0.4,1.2 \
    --interpolation cubic -o poses.glb\n  \
    cagework deform face.vrm --cage cage.obj --weights face.npz --pose a.obj --pose b.obj --name happy --name smirk \
    --expression -o faces.vrm"
)]
pub(crate) struct DeformArgs {
    /// Mesh that was bound.
    #[arg(help = model_help("Mesh that was bound"))]
    pub(crate) mesh: PathBuf,
    #[command(flatten)]
    pub(crate) read: ReadArgs,
    /// Cage that it was bound to: a file, or the same auto:VERTICES, hull:VERTICES or box:DIVISIONS.
    #[arg(long, value_name = "CAGE")]
    pub(crate) cage: CageSource,
    /// Weights that `cagework bind --weights` wrote; not for splats and points, and not needed with --dynamic or for
    /// --lattice alone.
    #[arg(long, value_name = "FILE")]
    pub(crate) weights: Option<PathBuf>,
    /// Moved cage: the same vertices in the same order. May be given several times. Each keyframe of a clip and each shape
    /// key in the file is a pose.
    #[arg(long, value_name = "FILE", required_unless_present = "clip")]
    pub(crate) pose: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) clip: ClipArgs,
    /// Split splats that bend by more than 10 % of their longest axis into shorter ones along it. Such a capture is written
    /// as a new file.
    #[arg(long, requires = "output")]
    pub(crate) split: bool,
    /// Name of a pose and of its morph target; give one per --pose, in the same order [default: the name of the file].
    /// For a file with several poses it precedes the name of the keyframe or shape key.
    #[arg(long, value_name = "NAME", requires = "output", conflicts_with = "dynamic", value_parser = NonEmptyStringValueParser::new())]
    pub(crate) name: Vec<String>,
    /// Make each pose an expression of a VRM, with the name of the pose: one of its presets if it has that name, otherwise
    /// a custom one. The model stays at rest, and gets an animation only with --times or --interpolation.
    #[arg(long, requires = "output", conflicts_with_all = ["dynamic", "shape_only"])]
    pub(crate) expression: bool,
    /// Moved controls inside the cage (.obj): the same vertices in the same order. Give one per --pose, or none if they do not move.
    #[arg(long, value_name = "FILE")]
    pub(crate) pose_controls: Vec<PathBuf>,
    /// File to write; the extension selects the format.
    #[arg(short, long, value_name = "FILE", required_unless_present_any = ["lattice", "displacements"])]
    pub(crate) output: Option<ModelOutput>,
    /// For an FBX: write how the poses move its control points (.npz, .json), in the units and axes of the file, for a blend
    /// shape of the original file.
    #[arg(long, value_name = "FILE", value_parser = displacements_output, conflicts_with_all = ["clip", "dynamic", "split", "expression", "shape_only", "ground", "feet"])]
    pub(crate) displacements: Option<PathBuf>,
    /// Times of the poses in the animation, in seconds, ascending: one per pose, separated by commas. The animation starts
    /// at 0 with the shape at rest, or with the first pose if its time is 0, and ends with the last pose. To return to
    /// rest, give the cage as the last pose.
    #[arg(long, value_name = "SECONDS", value_delimiter = ',', allow_negative_numbers = true, requires = "output", conflicts_with = "dynamic", value_parser = seconds)]
    pub(crate) times: Vec<f32>,
    /// What the animation shows between two poses: step keeps the earlier one, linear goes straight to the next one, cubic
    /// is a smooth curve, which may swing past a pose [default: linear].
    #[arg(long, value_name = "KIND", requires = "output", conflicts_with = "dynamic", value_parser = words::<Interpolation>())]
    pub(crate) interpolation: Option<Interpolation>,
    /// Write the deformation of the space around the cage (.npz): displacements `u` and gradients `F` at the nodes of a
    /// lattice. Takes one pose.
    #[arg(long, value_name = "FILE", value_parser = lattice_output, conflicts_with = "dynamic")]
    pub(crate) lattice: Option<PathBuf>,
    /// Format of the lattice: arrays (.npz), or a script (.py) that makes a lattice object in Blender.
    #[arg(long, value_enum, default_value_t, value_name = "FORMAT", requires = "lattice")]
    pub(crate) lattice_format: LatticeFormat,
    #[arg(long, help = field_options::CELLS_RANGE.about(), default_value_t = field_options::CELLS, value_name = "N", value_parser = number::<u32>(field_options::CELLS_RANGE))]
    pub(crate) lattice_cells: u32,
    #[command(flatten)]
    pub(crate) rig: RigArgs,
    /// Experimental: apply the clip to the model first, then bend every frame with the cage. Writes the frames as morph
    /// targets, without a skeleton.
    #[arg(long, value_name = "CLIP", conflicts_with_all = ["weights", "joints", "keep_travel", "rigid", "mask", "shape_only", "ground", "feet"])]
    pub(crate) dynamic: Option<String>,
    /// With --dynamic or --lattice, and for splats and points: steps of Catmull-Clark subdivision of the cage, as for `bind`.
    #[arg(long, default_value_t = 0, value_name = "STEPS", value_parser = number::<u32>(options::SMOOTH_STEPS))]
    pub(crate) smooth: u32,
}

/// Arguments of `cagework pull`.
#[derive(Args, Debug)]
#[command(
    after_help = "JOB.json:\n  {\"grabs\": [{\"vertex\": 12, \"to\": [0.1, 2.0, 0.3]}],\n   \"pins\": [{\"vertex\": 5}, \
    {\"triangle\": 7, \"bary\": [0.2, 0.3, 0.5]}, {\"cage\": 4}],\n   \"reach\": null, \"start\": \"pose.obj\", \
    \"relax\": 0.5, \"frames\": 30}\n\n\
    A grab or pin is a vertex of the model (for splats and points, the number of one of them, from 0), a point of a \
    triangle, or a vertex of the cage. Only \"grabs\" is \
    required.\n\"reach\": how far along the surface the model follows: null for automatic (default), a fraction of the model's \
    diagonal, or \"all\".\n\"start\": the initial pose; the default is the cage at rest.\n\"relax\": 0 keeps the details of the \
    initial pose, 1 restores those of the rest shape; the default is 0.5.\n\"frames\": number of steps in which the grabs move \
    to their targets, 1 to 10,000; the default is 30.\n\n\
    Example:\n  cagework pull horse.glb --cage cage.obj --weights horse.npz --job rear.json -o rear.obj"
)]
pub(crate) struct PullArgs {
    #[command(flatten)]
    pub(crate) pose: PoseArgs,
    /// Grabs, pins and their targets, as JSON.
    #[arg(long, value_name = "FILE")]
    pub(crate) job: PathBuf,
}

/// Arguments of `cagework demo`.
#[derive(Args, Debug)]
#[command(after_help = "Example:\n  cagework demo -o out")]
pub(crate) struct DemoArgs {
    /// Folder to write to; created if it does not exist.
    #[arg(short, long, value_name = "FOLDER", default_value = "out")]
    pub(crate) output: PathBuf,
}

/// A model file that the command writes, and its format.
#[derive(Clone, Debug)]
pub(crate) struct ModelOutput {
    pub(crate) path: PathBuf,
    /// Format that the file extension selects.
    pub(crate) format: ModelFormat,
}

impl FromStr for ModelOutput {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let name = if is_stream(Path::new(text)) { stream_name() } else { text.to_owned() };
        if let Some(format) = ModelFormat::of_export(&name) {
            return Ok(Self { path: text.into(), format });
        }
        if name == STREAM {
            return Err("standard output needs a format, such as --format obj".to_owned());
        }
        let written = ModelFormat::ALL.into_iter().filter(|format| format.is_written());
        let endings: Vec<&str> = written.map(ModelFormat::export_extension).collect();
        let is_read = ModelFormat::of_name(&name).is_some_and(|format| !format.is_written());
        let reason = if is_read { "this format is read, but not written: " } else { "" };
        Err(format!("{reason}{}", wrong_ending(&endings)))
    }
}

/// Composes the help text of a model argument: `what`, followed by the supported file extensions.
fn model_help(what: &str) -> String {
    help_with_endings(what, |_| true)
}

/// Composes the help text of an argument for a model with faces.
fn mesh_help(what: &str) -> String {
    help_with_endings(what, ModelFormat::holds_faces)
}

fn help_with_endings(what: &str, is_read: impl Fn(ModelFormat) -> bool) -> String {
    let formats = ModelFormat::ALL.into_iter().filter(|format| is_read(*format));
    let endings: Vec<&str> = formats.flat_map(|format| format.facts().endings).copied().collect();
    format!("{what} (.{})", endings.join(", ."))
}

/// Returns a parser of an option whose value is one word of a fixed set.
fn words<T>() -> impl TypedValueParser<Value = T>
where
    T: Choice + FromStr<Err: Error + Send + Sync> + Send + Sync,
{
    let values = T::ALL.iter().map(|(word, _)| PossibleValue::new(word.replace('_', "-")).alias(*word));
    PossibleValuesParser::new(values).try_map(|word| word.parse::<T>())
}

/// Returns a parser of a number that must be within the range of `option`.
fn number<T>(option: Number) -> impl TypedValueParser<Value = T>
where
    T: FromStr + Into<f64> + Copy + Send + Sync + 'static,
{
    // Without the option's name, which is that of the library: clap puts the command's name in front.
    StringValueParser::new().try_map(move |text| {
        option.parse::<T>(&text).map_err(|wrong| format!("it must be {}", wrong.allowed))
    })
}

fn positive(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("not a positive number".into()),
    }
}

fn seconds(text: &str) -> Result<f32, String> {
    match text.trim().parse::<f32>() {
        Ok(value) if (0.0..=MAX_SECONDS).contains(&value) => Ok(value),
        _ => Err(format!("not a number of seconds from 0 to {MAX_SECONDS}")),
    }
}

fn npz_output(text: &str) -> Result<PathBuf, String> {
    output(text, &["npz"])
}

fn lattice_output(text: &str) -> Result<PathBuf, String> {
    output(text, &["npz", "py"])
}

fn displacements_output(text: &str) -> Result<PathBuf, String> {
    output(text, &["npz", "json"])
}

fn glb_output(text: &str) -> Result<PathBuf, String> {
    output(text, &["glb"])
}

fn obj_output(text: &str) -> Result<PathBuf, String> {
    output(text, &["obj"])
}

fn output(text: &str, extensions: &[&str]) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if is_stream(&path) {
        return Ok(path);
    }
    let given = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    if extensions.contains(&given.as_str()) {
        return Ok(path);
    }
    Err(wrong_ending(extensions))
}

fn stream_format(text: &str) -> Result<String, String> {
    let known = ModelFormat::of_name(&format!("model.{text}")).is_some();
    if known { Ok(text.to_owned()) } else { Err("not the extension of a model's format".to_owned()) }
}

fn wrong_ending(extensions: &[&str]) -> String {
    let known = extensions.iter().map(|e| format!(".{e}")).collect::<Vec<_>>().join(" or ");
    format!("the name must end in {known}")
}
