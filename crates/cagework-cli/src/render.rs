//! `cagework render`: draws a picture of a model in its cage on the GPU.

use std::f32::consts::TAU;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use cagework_core::bind::Binding;
use cagework_core::field::{CELLS, FieldWeights};
use cagework_core::slice::Slice;
use cagework_core::{BindOptions, Bounds, Controls, Coordinates, Weights};
use cagework_gpu::Session;
use cagework_gpu::render::{
    DrawModel, MeshStyle, Projection, SceneOptions, Selection, SliceView, ViewOptions, check_layers,
};
use cagework_io::{Clip, Model, shown};
use glam::Vec3;
use serde::Serialize;

use crate::args::{CageSource, RenderArgs, ShowArg};
use crate::bind::bind_positions;
use crate::controls::with_inner;
use crate::error::CliError;
use crate::files::{check_outputs, json, print, write};
use crate::gpu;
use crate::load::{LoadedCage, load_any, load_cage, load_weights};
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
    check_pictures(args)?;
    let model = load_any(&args.model, args.read.axis(), args.read.memory)?;
    check_capture(args, &model)?;
    let frames = frames(args, &model)?;
    let cage = args
        .cage
        .as_ref()
        .map(|source| load_cage(source, &model, args.read.memory, &args.controls))
        .transpose()?;
    let (drawn, mut notices) = gpu::draw_model(&model);
    notices.splice(0..0, model.notices.iter().cloned());
    let mut session = Session::new(gpu::open()?);
    // Keep a copy of the model, which the frames of a clip draw with other positions.
    let moving = (!frames.is_empty()).then(|| drawn.clone());
    pollster::block_on(session.set_model(drawn))?;
    let mut scene = scene_of(args);
    let mut other = None;
    // Stray splats of a capture can be far away, so frame the cage instead.
    let is_framed_by_cage = model.n_faces() == 0 && cage.is_some();
    let mut points = match (is_framed_by_cage, frames.is_empty()) {
        (true, _) => Vec::new(),
        (false, true) => model.positions.clone(),
        (false, false) => frames.concat(),
    };
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
    let size = args.size();
    let part = if other.is_some() { [half(size[0]), size[1]] } else { size };
    let camera = session.camera_mut();
    (camera.yaw, camera.pitch) = args.view.angles();
    if args.orthographic {
        camera.projection = Projection::Orthographic;
    }
    camera.set_viewport(glam::Vec2::from(part.map(|s| s as f32)));
    session.frame_all();
    let bounds = Bounds::around(&points).filter(|_| moving.is_some() || args.turntable.is_some());
    if let Some(bounds) = bounds {
        session.camera_mut().frame(bounds);
    }
    // Fit the camera to a cylinder about the axis of the turn, so that all views have the same scale.
    let fitted = if args.turntable.is_some() { cylinder(&points) } else { points };
    session.camera_mut().fit(&fitted);
    check_layers(session.context(), session.camera(), &model.positions, &model.triangles, part)?;

    let started = Instant::now();
    let mut pictures = Vec::new();
    for positions in frames {
        let Some(moving) = &moving else { break };
        pollster::block_on(session.set_model(DrawModel { positions, ..moving.clone() }))?;
        bounds.iter().for_each(|&bounds| session.set_floor(bounds));
        pictures.push(pollster::block_on(session.picture(part, args.scale))?);
    }
    let n_views = if pictures.is_empty() { args.n_pictures() } else { 0 };
    for view in 0..n_views {
        session.camera_mut().yaw = args.view.angles().0 + TAU * view as f32 / n_views as f32;
        pictures.push(pollster::block_on(session.picture(part, args.scale))?);
    }
    let compared = args.compare.map(|right| {
        let of = if right == Coordinates::Harmonic { " of the plain cage" } else { "" };
        ["harmonic coordinates".to_owned(), format!("{} coordinates{of}", right.name())]
    });
    let mut divider = DIVIDER_WIDTH;
    if let Some(mut other) = other {
        *other.camera_mut() = *session.camera();
        pictures.push(pollster::block_on(other.picture(part, args.scale))?);
        divider = size[0] - 2 * part[0];
    }
    let n = pictures.len() as u32;
    let size = [n * part[0] + (n - 1) * divider, size[1]];
    let rgba = beside(&pictures, part[0], divider);
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

/// Rejects strips that are too wide, and several numbers of `--at` without a clip.
fn check_pictures(args: &RenderArgs) -> Result<(), CliError> {
    let ([width, _], n) = (args.size(), args.n_pictures());
    let total = n as u64 * u64::from(width + DIVIDER_WIDTH);
    if n > 1 && total > u64::from(MAX_STRIP_WIDTH) {
        return Err(CliError::Mismatch {
            message: format!(
                "{n} pictures of {width} pixels are {total} pixels wide, above the limit of {MAX_STRIP_WIDTH}"
            ),
            hint: "give a smaller --size, or fewer pictures",
        });
    }
    if args.clip.is_none() && args.at.len() > 1 {
        return Err(CliError::Mismatch {
            message: format!(
                "--at has {} numbers, but without --clip it is the place of one slice",
                args.at.len()
            ),
            hint: "give one number, or --clip",
        });
    }
    Ok(())
}

/// Computes the positions of the vertices at each time of the clip; empty without a clip. `[n_times][n_vertices]`
fn frames(args: &RenderArgs, model: &Model) -> Result<Vec<Vec<Vec3>>, CliError> {
    let Some(name) = &args.clip else { return Ok(Vec::new()) };
    let clips = model.clips();
    let clip = Clip::named(&clips, name).map_err(|e| CliError::file(&args.model, e))?;
    let seconds = clips[clip].seconds;
    if let Some(at) = args.at.iter().find(|at| !(0.0..=seconds).contains(*at)) {
        return Err(CliError::Mismatch {
            message: format!(
                "--at: {at} s is outside of the clip '{}', which lasts {seconds} s",
                shown(name)
            ),
            hint: "give times from 0 to the length of the clip",
        });
    }
    let times = if args.at.is_empty() { &[0.0] } else { args.at.as_slice() };
    model.frames_at(clip, times).map_err(|e| CliError::file(&args.model, e))
}

/// Rejects arguments for which `--compare` has nothing to show.
fn check_compare(args: &RenderArgs) -> Result<(), CliError> {
    let hint = "leave out --compare, or --show the model";
    if args.compare.is_some() && matches!(args.show, ShowArg::Cells | ShowArg::Slice) {
        let message = "--compare shows a deformed model, but --show is a slice of the grid".to_owned();
        return Err(CliError::Mismatch { message, hint });
    }
    if args.compare.is_some() && args.size()[0] < MIN_PAIR_WIDTH {
        let message = format!("--compare needs a picture at least {MIN_PAIR_WIDTH} pixels wide");
        return Err(CliError::Mismatch { message, hint: "give a larger --size" });
    }
    Ok(())
}

/// Rejects arguments that a file without faces, which has splats or points, does not support.
fn check_capture(args: &RenderArgs, model: &Model) -> Result<(), CliError> {
    let is_drawn = matches!(args.show, ShowArg::Solid | ShowArg::Cells | ShowArg::Slice);
    if model.n_faces() > 0 || is_drawn && args.compare.is_none() && args.weights.is_none() {
        return Ok(());
    }
    let message = "splats and points are drawn as they are, and follow the cage by a field".to_owned();
    Err(CliError::Mismatch { message, hint: "leave out --compare, --weights and other values of --show" })
}

/// Minimum width of a picture that consists of two parts, pixels: one column for each part, and the divider.
const MIN_PAIR_WIDTH: u32 = 2 + DIVIDER_WIDTH;

/// Maximum width of an output that consists of several pictures side by side, pixels.
const MAX_STRIP_WIDTH: u32 = 16384;

/// Width of the divider between the parts of a picture, pixels.
const DIVIDER_WIDTH: u32 = 2;

/// RGBA colour of the divider, visible on dark and light backgrounds.
const DIVIDER_COLOR: [u8; 4] = [128, 128, 128, 255];

/// Width of each of the two parts of a picture of `width` pixels.
fn half(width: u32) -> u32 {
    (width - DIVIDER_WIDTH) / 2
}

/// Returns points on the rims of a vertical cylinder that contains `points`. Its axis goes through the centre of their
/// bounding box.
fn cylinder(points: &[Vec3]) -> Vec<Vec3> {
    let Some(bounds) = Bounds::around(points) else { return Vec::new() };
    let middle = bounds.center();
    let radius = points.iter().map(|p| (*p - middle).with_y(0.0).length()).fold(0.0, f32::max);
    let rim = (0..72).map(|k| {
        let (sin, cos) = (TAU * k as f32 / 72.0).sin_cos();
        Vec3::new(cos, 0.0, sin)
    });
    rim.flat_map(|way| [bounds.min.y, bounds.max.y].map(|y| (middle + radius * way).with_y(y))).collect()
}

/// Joins RGBA pictures side by side into one, each `part` pixels wide, with dividers of `divider` pixels between them.
fn beside(pictures: &[Vec<u8>], part: u32, divider: u32) -> Vec<u8> {
    let row = 4 * part as usize;
    let line = DIVIDER_COLOR.repeat(divider as usize);
    let height = pictures.first().map_or(0, |picture| picture.len() / row);
    let rows = (0..height).map(|y| pictures.iter().map(|p| &p[y * row..][..row]).collect::<Vec<_>>());
    rows.flat_map(|parts| parts.join(line.as_slice())).collect()
}

/// Returns the scene options that depend only on the arguments.
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
        view: ViewOptions {
            theme: args.theme,
            base_wireframe: args.show == ShowArg::Wireframe,
            floor: !args.no_floor,
            ..ViewOptions::default()
        },
        mesh,
        mesh_edges: args.show == ShowArg::Edges,
        cage_lines: !args.no_cage,
        handles: !args.no_cage && !args.no_handles,
        selection: Selection { vertices: chosen, ..Selection::default() },
        ..SceneOptions::default()
    }
}

/// Sets the weights, pose and slice that the picture needs. Returns the rest and posed positions of the controls, so
/// that the camera frames both.
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
    let is_capture = model.n_faces() == 0;
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
    let mut slice = Slice::new(controls, &options, args.axis, args.at.first().copied().unwrap_or(0.5));
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
