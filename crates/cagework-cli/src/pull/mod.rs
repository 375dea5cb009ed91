//! `cagework pull`: solves for the pose of the cage that moves points of the model to given positions.

mod job;
mod measure;

use std::path::Path;
use std::time::Instant;

use cagework_core::deform::{deform_bound, deform_finite};
use cagework_core::{Bounds, words::decimals};
use cagework_io::shown;
use cagework_pose::pull::{Drag, DragOptions, Handle};
use glam::{DVec3, Vec3};
use serde::Serialize;

use crate::args::PullArgs;
use crate::error::CliError;
use crate::files::{json, print, shown_path};
use crate::pose::{BoundModel, pull, write_pose};
use job::Job;
use measure::{Stretches, far_mean, stretches};

/// Output of `--json`. Lengths are fractions of the model's size, except `lag` and `far_mean`, which are fractions of
/// the drag's length.
#[derive(Debug, Serialize)]
struct PullSummary {
    output: String,
    samples: usize,
    groups: usize,
    cage: usize,
    /// Time of the precomputation for this model and cage, ms. It includes the bind of the
    /// [`Probes`](cagework_pose::pull::Probes).
    precompute_ms: f64,
    /// Time to start a grab, ms.
    grab_ms: f64,
    /// Mean time of a frame, ms.
    frame_ms: f64,
    /// Distance along the surface that the drag affects; null if it affects the whole model.
    reach: Option<f64>,
    /// Largest distance of a grab or pin from its target after the last frame.
    error: f64,
    /// Largest motion of a vertex after the targets have stopped.
    lag: f64,
    /// Number of frames after the targets have stopped until the pose converges.
    settle_frames: u32,
    #[serde(flatten)]
    stretches: Stretches,
    /// Mean displacement of the vertices farther than 1.2 times `reach` from the grabs; null if no vertex is that far.
    far_mean: Option<f64>,
    notices: Vec<String>,
}

/// Runs `cagework pull`.
///
/// # Errors
/// If a file cannot be read or written, files do not match, or the job is invalid.
pub(crate) fn run(given: &PullArgs, as_json: bool) -> Result<(), CliError> {
    let mut job = Job::read(&given.job)?;
    let args = &given.pose;
    let bound = {
        let inputs = [Some(given.job.as_path()), job.start.as_deref()];
        let vertex = |handle: &Handle| if let Handle::Vertex(v) = handle { Some(*v) } else { None };
        let vertices: Vec<u32> = job.grabs.iter().chain(&job.pins).filter_map(vertex).collect();
        BoundModel::load(args, inputs.into_iter().flatten(), Some(&vertices))?
    };
    bound.number_handles(job.grabs.iter_mut().chain(&mut job.pins));
    let BoundModel { model, mesh, cage, weights, frames, .. } = &bound;
    let (controls, output) = (cage.controls(), &args.output.path);
    let inner = &controls.rest()[cage.cage.n_vertices()..];
    let start = match &job.start {
        Some(path) => [cage.load_pose(path)?.as_slice(), inner].concat(),
        None => controls.rest().to_vec(),
    };
    let wrong = |e| CliError::file(&given.job, e);

    let begun = Instant::now();
    let pull = pull(mesh, controls, args)?;
    let precompute_ms = since(begun);

    let begun = Instant::now();
    let from: Vec<DVec3> = start.iter().copied().map(Vec3::as_dvec3).collect();
    let drag_options = DragOptions { reach: job.reach, relax: job.relax, ..DragOptions::default() };
    let grips = |handles: &[Handle]| {
        let grips = handles.iter().map(|&h| bound.grip(h, &pull, &given.job));
        grips.collect::<Result<Vec<_>, _>>()
    };
    let mut drag = Drag::new(&pull, &from, &grips(&job.grabs)?, &grips(&job.pins)?, frames, drag_options)
        .map_err(wrong)?;
    let grab_ms = since(begun);

    let pose = |drag: &Drag| drag.cage().iter().map(|p| p.as_vec3()).collect::<Vec<Vec3>>();
    let deformed = |cage: &[Vec3]| deform_bound(weights, frames, cage);
    let before = deformed(&start);
    let to = job.to(model.origin());
    let to: Vec<DVec3> = model.up().turned(&to).iter().map(|p| p.as_dvec3()).collect();
    let grabbed = drag.start().to_vec();
    let begun = Instant::now();
    drag.go(&to, job.frames);
    let frame_ms = since(begun) / f64::from(job.frames);
    let at_stop = deformed(&pose(&drag));
    let settle_frames = drag.converge(&to);
    let cage_pose = pose(&drag);
    check_precision(&cage_pose, &given.job)?;
    let after = deform_finite(weights, frames, &cage_pose).map_err(|e| CliError::file(&given.job, e))?;
    let drag_length = grabbed.iter().zip(&to).map(|(a, b)| a.distance(*b)).fold(f64::MIN_POSITIVE, f64::max);
    let apart = |(a, b): (&Vec3, &Vec3)| a.as_dvec3().distance(b.as_dvec3());
    write_pose(model, cage, &cage_pose, args)?;
    let summary = PullSummary {
        output: output.display().to_string(),
        samples: pull.n_samples(),
        groups: pull.n_groups(),
        cage: pull.n_cage(),
        precompute_ms,
        grab_ms,
        frame_ms,
        reach: drag.reach().is_finite().then(|| drag.reach()),
        error: drag.error(),
        lag: after.iter().zip(&at_stop).map(apart).fold(0.0, f64::max) / drag_length,
        settle_frames,
        stretches: stretches(mesh, &after),
        far_mean: far_mean(&drag, &before, &after).map(|mean| mean / drag_length),
        notices: model.notices.clone(),
    };
    print(&if as_json { json(&summary) } else { text(&summary, output) })
}

/// Rejects a pose whose shape is lost because it is so far away that 32-bit floats round it coarsely.
fn check_precision(pose: &[Vec3], job: &Path) -> Result<(), CliError> {
    /// Largest step between coordinates, as a fraction of the pose's size.
    const MAX_STEP: f32 = 0.01;
    let far = pose.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max);
    let size = Bounds::around(pose).map_or(0.0, |bounds| bounds.extent().max_element());
    let step = far.next_up() - far;
    if step <= MAX_STEP * size {
        return Ok(());
    }
    Err(CliError::Mismatch {
        message: format!(
            "{}: the pulled cage has coordinates up to {far:e}, where 32-bit floats have steps of {step:e}, more than \
             {MAX_STEP} of its size {size:?}",
            shown_path(job)
        ),
        hint: "give targets nearer to the model",
    })
}

fn since(begun: Instant) -> f64 {
    begun.elapsed().as_secs_f64() * 1e3
}

fn text(summary: &PullSummary, output: &Path) -> String {
    let reach = summary.reach.map_or_else(
        || "the whole model".to_owned(),
        |reach| format!("{:.0} % of the model's size", 100.0 * reach),
    );
    let mut out = format!(
        "pulled by {} samples and {} cage vertices: {:.2} ms per frame, {:.1} ms per grab, {:.0} ms precomputation\n\
         reach {reach}; grabs within {:.1e} of the model's size; edges stretched to at most {} (99th percentile {}, \
         first percentile {})\nwrote {}\n",
        summary.samples,
        summary.cage,
        summary.frame_ms,
        summary.grab_ms,
        summary.precompute_ms,
        summary.error,
        decimals(summary.stretches.stretch_max, 2),
        decimals(summary.stretches.stretch_99, 2),
        decimals(summary.stretches.stretch_1, 2),
        shown(&output.display().to_string()),
    );
    for notice in &summary.notices {
        out += &format!("note: {notice}\n");
    }
    out
}
