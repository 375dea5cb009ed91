//! `cagework render`: draws a picture of a model in its cage on the GPU.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use cagework_core::bind::Binding;
use cagework_core::field::{CELLS, FieldWeights};
use cagework_core::slice::Slice;
use cagework_core::{BindOptions, Controls, Coordinates, Weights};
use cagework_gpu::Session;
use cagework_gpu::render::{MeshStyle, Projection, SceneOptions, Selection, SliceView, check_layers};
use cagework_io::{Model, shown};
use glam::Vec3;
use serde::Serialize;

use crate::args::{CageSource, RenderArgs, ShowArg};
use crate::bind::bind_positions;
use crate::controls::with_inner;
use crate::deform::load_weights;
use crate::error::CliError;
use crate::files::{check_outputs, json, print, write};
use crate::gpu;
use crate::load::{LoadedCage, load_any, load_cage};
use crate::progress::Bar;

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct RenderSummary {
    output: String,
    size: [u32; 2],
    adapter: String,
    /// Coordinates of the left and of the right picture, with `--compare`.
    #[serde(skip_serializing_if = "Option::is_none")]
    compared: Option<[String; 2]>,
    /// Time to draw the picture and to read it back from the GPU, ms. Binding, and reading and writing files, are not
    /// included.
    render_ms: f64,
    notices: Vec<String>,
}

/// Runs `cagework render`.
///
/// # Errors
/// If a file cannot be read or written, files do not match, no GPU is available, or the bind fails.
pub(crate) fn run(args: &RenderArgs, as_json: bool) -> Result<(), CliError> {
    let mut inputs = vec![args.model.as_path()];
    inputs.extend(args.pose.as_deref());
    inputs.extend(args.weights.as_deref());
    inputs.extend(args.pose_controls.as_deref());
    inputs.extend(args.controls.controls.as_deref());
    if let Some(CageSource::File(path)) = &args.cage {
        inputs.push(path);
    }
    check_outputs(&[&args.output], &inputs)?;
    check_compare(args)?;
    let model = load_any(&args.model, args.read.axis(), args.read.memory)?;
    check_capture(args, &model)?;
    let cage = args
        .cage
        .as_ref()
        .map(|source| load_cage(source, &model, args.read.memory, &args.controls))
        .transpose()?;
    let (drawn, mut notices) = gpu::draw_model(&model);
    notices.splice(0..0, model.notices.iter().cloned());
    let mut session = Session::new(gpu::open()?);
    pollster::block_on(session.set_model(drawn))?;
    let mut scene = scene_of(args);
    let mut other = None;
    // Floaters of a capture can be far away: frame its cage.
    let is_framed_by_cage = model.splats().is_some() && cage.is_some();
    let mut points = if is_framed_by_cage { Vec::new() } else { model.positions.clone() };
    if let Some(cage) = &cage {
        pollster::block_on(session.set_cage(cage.controls()))?;
        points.extend(prepare(args, &model, cage, &mut session, &mut scene)?);
    }
    session.set_scene(scene);
    if let (Some(cage), Some(compared)) = (&cage, args.compare) {
        let mut twin = pollster::block_on(session.twin())?;
        if compared == Coordinates::Harmonic {
            let options = args.solve.options(args.grid, args.read.memory);
            let Binding { weights, frames, .. } =
                bind_positions(&model.positions, (&cage.cage).into(), args.solve.on_gpu(), &options)?;
            pollster::block_on(twin.adopt(weights, frames))?;
        } else {
            let limit = args.read.memory.bytes();
            let weights = compared.weights(&model.positions, &cage.cage, limit, &Bar::start())?;
            pollster::block_on(twin.adopt_closed_form(compared, weights))?;
        }
        other = Some(twin);
    }
    let size = args.size.0;
    let part = if other.is_some() { [half(size[0]), size[1]] } else { size };
    let camera = session.camera_mut();
    (camera.yaw, camera.pitch) = args.view.angles();
    if args.orthographic {
        camera.projection = Projection::Orthographic;
    }
    camera.set_viewport(glam::Vec2::from(part.map(|s| s as f32)));
    session.frame_all();
    session.camera_mut().fit(&points);
    check_layers(session.context(), session.camera(), &model.positions, &model.triangles, part)?;

    let started = Instant::now();
    let mut rgba = pollster::block_on(session.picture(part, args.scale))?;
    let compared = args.compare.map(|right| {
        let of = if right == Coordinates::Harmonic { " of the plain cage" } else { "" };
        ["harmonic coordinates".to_owned(), format!("{} coordinates{of}", right.name())]
    });
    if let Some(mut other) = other {
        *other.camera_mut() = *session.camera();
        let right = pollster::block_on(other.picture(part, args.scale))?;
        rgba = beside(&rgba, &right, part[0], size[0]);
    }
    let render_ms = started.elapsed().as_secs_f64() * 1e3;
    write(&args.output, &gpu::png(rgba, size)?)?;
    let summary = RenderSummary {
        output: args.output.display().to_string(),
        size,
        adapter: session.context().adapter_name(),
        compared,
        render_ms,
        notices,
    };
    print(&if as_json { json(&summary) } else { text(&summary) })
}

/// Rejects arguments for which `--compare` has nothing to show.
fn check_compare(args: &RenderArgs) -> Result<(), CliError> {
    let hint = "leave out --compare, or --show the model";
    if args.compare.is_some() && matches!(args.show, ShowArg::Cells | ShowArg::Slice) {
        let message = "--compare shows a deformed model, but --show is a slice of the grid".to_owned();
        return Err(CliError::Mismatch { message, hint });
    }
    if args.compare.is_some() && args.size.0[0] < MIN_PAIR_WIDTH {
        let message = format!("--compare needs a picture at least {MIN_PAIR_WIDTH} pixels wide");
        return Err(CliError::Mismatch { message, hint: "give a larger --size" });
    }
    Ok(())
}

/// Rejects files without faces and splats, and displays that a capture of splats does not have.
fn check_capture(args: &RenderArgs, model: &Model) -> Result<(), CliError> {
    let is_drawn = matches!(args.show, ShowArg::Solid | ShowArg::Cells | ShowArg::Slice);
    if model.splats().is_none() {
        return Ok(model.require_faces()?);
    }
    if is_drawn && args.compare.is_none() && args.weights.is_none() {
        return Ok(());
    }
    let message = "a capture of splats is drawn as it is, and follows the cage by a field".to_owned();
    Err(CliError::Mismatch { message, hint: "leave out --compare, --weights and other values of --show" })
}

/// Minimum width of a picture that consists of two parts, pixels: one column for each part, and the divider.
const MIN_PAIR_WIDTH: u32 = 2 + DIVIDER_WIDTH;

/// Width of the divider between the two parts of a picture, pixels.
const DIVIDER_WIDTH: u32 = 2;

/// RGBA colour of the divider, visible on dark and light backgrounds.
const DIVIDER_COLOR: [u8; 4] = [128, 128, 128, 255];

/// Width of each of the two parts of a picture of `width` pixels.
fn half(width: u32) -> u32 {
    (width - DIVIDER_WIDTH) / 2
}

/// Joins two RGBA pictures, each `part` pixels wide, to one that is `width` pixels wide, with the divider between them.
fn beside(left: &[u8], right: &[u8], part: u32, width: u32) -> Vec<u8> {
    let row = 4 * part as usize;
    let line = DIVIDER_COLOR.repeat((width - 2 * part) as usize);
    let rows = left.chunks_exact(row).zip(right.chunks_exact(row));
    rows.flat_map(|(left, right)| [left, &line, right].concat()).collect()
}

/// Scene options that depend only on the arguments.
fn scene_of(args: &RenderArgs) -> SceneOptions {
    let column = args.column;
    let mesh = match args.show {
        ShowArg::Solid | ShowArg::Edges => MeshStyle::Solid,
        ShowArg::Clay | ShowArg::Wireframe => MeshStyle::Clay,
        ShowArg::Weights => MeshStyle::Weights { column },
        ShowArg::Error => MeshStyle::Errors,
        ShowArg::Cells | ShowArg::Slice => MeshStyle::Hidden,
    };
    let chosen =
        if matches!(args.show, ShowArg::Weights | ShowArg::Slice) { vec![column] } else { Vec::new() };
    SceneOptions {
        theme: args.theme,
        mesh,
        mesh_edges: args.show == ShowArg::Edges,
        base_wireframe: args.show == ShowArg::Wireframe,
        cage_lines: !args.no_cage,
        handles: !args.no_cage && !args.no_handles,
        floor: !args.no_floor,
        selection: Selection { vertices: chosen, ..Selection::default() },
        ..SceneOptions::default()
    }
}

/// Sets the weights, pose and slice that the picture needs. Returns the positions of the controls at rest and posed,
/// which the camera frames.
fn prepare(
    args: &RenderArgs,
    model: &Model,
    cage: &LoadedCage,
    session: &mut Session,
    scene: &mut SceneOptions,
) -> Result<Vec<Vec3>, CliError> {
    let controls = cage.controls();
    let n_cage = controls.n_controls();
    if matches!(args.show, ShowArg::Weights | ShowArg::Slice) && args.column as usize >= n_cage {
        return Err(CliError::Mismatch {
            message: format!("--column is {}, but the weights have {n_cage} columns", args.column),
            hint: "columns are counted from 0",
        });
    }
    let needs_weights = args.compare.is_some()
        || args.pose.is_some()
        || matches!(args.show, ShowArg::Wireframe | ShowArg::Weights | ShowArg::Error);
    let is_capture = model.splats().is_some();
    if needs_weights && !is_capture {
        let (weights, frames) = match &args.weights {
            Some(path) => {
                let saved = load_weights(path, model, &cage.cage, args.read.memory)?.of_vertices();
                (saved.weights, saved.frames)
            }
            None => {
                let held = model.bytes();
                let options = BindOptions { held, ..args.solve.options(args.grid, args.read.memory) };
                let Binding { weights, frames, .. } =
                    bind_positions(&model.positions, controls, args.solve.on_gpu(), &options)?;
                (weights, frames)
            }
        };
        pollster::block_on(session.adopt(weights, frames))?;
    }
    let mut places = controls.rest().to_vec();
    if let Some(path) = &args.pose {
        let files: Vec<_> = args.pose_controls.iter().cloned().collect();
        let inner = &controls.rest()[cage.cage.n_vertices()..];
        let poses = with_inner(
            vec![cage.load_pose(path)?],
            &files,
            inner,
            (model.up(), model.origin()),
            args.read.memory,
        )?;
        let pose = poses.into_iter().flatten().collect::<Vec<_>>();
        session.pose(&pose);
        if is_capture {
            let options = args.solve.options(args.grid, args.read.memory);
            let field = FieldWeights::bind(controls, CELLS, &options, &Bar::start())?;
            session.set_field(Some(field.pose(controls.rest(), &pose)), &pose);
        }
        places.extend(pose);
    }
    if matches!(args.show, ShowArg::Cells | ShowArg::Slice) {
        scene.slice = Some(slice(args, controls)?);
    }
    Ok(places)
}

fn slice(args: &RenderArgs, controls: Controls<'_>) -> Result<SliceView, CliError> {
    let options = args.solve.options(args.grid, args.read.memory);
    let mut slice = Slice::new(controls, &options, args.axis, args.at);
    let mut column = None;
    if args.show == ShowArg::Slice && !slice.cells.is_empty() {
        let weights: Weights =
            bind_positions(&slice.centers(), controls, args.solve.on_gpu(), &options)?.weights;
        slice.set_weights(weights).map_err(|e| CliError::file(Path::new("slice"), e))?;
        column = Some(args.column);
    }
    Ok(SliceView { slice: Arc::new(slice), column })
}

fn text(summary: &RenderSummary) -> String {
    let [width, height] = summary.size;
    let mut out = format!(
        "drew {width} x {height} pixels on {} in {:.0} ms\nwrote {}\n",
        summary.adapter,
        summary.render_ms,
        shown(&summary.output)
    );
    if let Some([left, right]) = &summary.compared {
        out += &format!("left: {left}; right: {right}\n");
    }
    for notice in &summary.notices {
        out += &format!("note: {notice}\n");
    }
    out
}
