//! `cagework deform --dynamic`: applies a clip to the model, then bends each frame with the posed cage.

use cagework_core::BindOptions;
use cagework_core::field::{self, FieldWeights, Lattice, bend_vertices};
use cagework_core::words::decimals;
use cagework_io::{Clip, ModelFormat, shown};
use serde::Serialize;

use crate::args::{CageSource, ControlArgs, DeformArgs, ModelOutput, SmoothArgs};
use crate::bind::bind_positions;
use crate::error::CliError;
use crate::files::{check_outputs, json, print, shown_path, write};
use crate::load::{load_cage, load_model};

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct DynamicSummary {
    output: String,
    clip: String,
    frames: usize,
    seconds: f32,
    vertices: usize,
    notices: Vec<String>,
}

/// Writes the frames of a clip, each frame bent by the posed cage.
///
/// # Errors
/// If a file cannot be read or written, the model has no clip with this name, or files do not match.
pub(crate) fn run(
    args: &DeformArgs,
    clip: &str,
    output: &ModelOutput,
    as_json: bool,
) -> Result<(), CliError> {
    let (output, format) = (&output.path, output.format);
    let [pose] = args.pose.as_slice() else {
        return Err(CliError::Mismatch {
            message: format!("--dynamic takes one pose, but {} were given", args.pose.len()),
            hint: "run the command once per pose",
        });
    };
    let mut inputs = vec![args.mesh.as_path(), pose.as_path()];
    if let CageSource::File(path) = &args.cage {
        inputs.push(path);
    }
    check_outputs(&[output], &inputs)?;
    if format != ModelFormat::Gltf {
        return Err(CliError::Mismatch {
            message: format!("{}: format {} cannot store a clip", shown_path(output), format.name()),
            hint: "write a .glb",
        });
    }
    let model = load_model(&args.mesh, args.read.axis(), args.read.memory)?;
    let wrong = |e| CliError::file(&args.mesh, e);
    let clips = model.clips();
    let number = Clip::named(&clips, clip).map_err(|e| CliError::file(&args.mesh, e))?;
    let mut frames = model.frames(number).map_err(wrong)?;
    let controls = ControlArgs { smooth: SmoothArgs { smooth: args.smooth }, ..ControlArgs::default() };
    let cage = load_cage(&args.cage, &model, args.read.memory, &controls)?;
    let posed = cage.load_pose(pose)?;
    let lattice = Lattice::new(cage.controls().surface(), field::CLIP_CELLS);
    let options =
        BindOptions { held: model.bytes(), memory_limit: args.read.memory.bytes(), ..BindOptions::default() };
    let binding = bind_positions(&lattice.points(), cage.controls(), false, &options)?;
    let rest = cage.cage.positions();
    let field = FieldWeights::new(lattice, binding.weights, binding.frames).pose(rest, &posed);
    let mut at_rest = model.positions.clone();
    frames.iter_mut().chain([&mut at_rest]).for_each(|frame| bend_vertices(&field, frame));
    let n = frames.len();
    let bytes = model.write_baked(number, &at_rest, frames).map_err(|e| CliError::file(output, e))?;
    write(output, &bytes)?;
    let summary = DynamicSummary {
        output: output.display().to_string(),
        clip: clip.to_owned(),
        frames: n,
        seconds: clips[number].seconds,
        vertices: model.positions.len(),
        notices: model.notices.clone(),
    };
    let text = format!(
        "bent {n} frames of clip {} ({} s)\nwrote {}: its frames as morph targets and an animation, without skeleton\n",
        shown(clip),
        decimals(summary.seconds, 2),
        shown(&summary.output)
    );
    print(&if as_json { json(&summary) } else { text })
}
