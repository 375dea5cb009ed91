//! `cagework fit`: finds the pose of the cage that deforms a model into a target.

mod landmarks;

use std::borrow::Cow;
use std::time::Instant;

use cagework_core::deform::deform_bound;
use cagework_core::{Bounds, Weights};
use cagework_io::{Model, shown};
use cagework_pose::pull::FitOptions;
use glam::Vec3;
use serde::Serialize;

use crate::args::FitArgs;
use crate::error::CliError;
use crate::files::{json, print, shown_path};
use crate::load::load_model;
use crate::pose::{BoundModel, pull, write_pose};
use landmarks::landmarks;

/// Output of `--json`. Lengths are fractions of the diagonal of the model's bounding box.
#[derive(Debug, Serialize)]
struct FitSummary {
    output: String,
    /// Number of vertices or landmarks with a target.
    points: usize,
    /// Number of vertices without a target, because they are outside the cage.
    left_out: usize,
    cage: usize,
    lambda: f64,
    energy: f64,
    /// Root mean square of the points' distances from their targets, with the cage at rest.
    rms_before: f64,
    /// Largest distance of a point from its target, with the cage at rest.
    largest_before: f64,
    /// Root mean square of the points' distances from their targets after the fit.
    rms: f64,
    /// Largest distance of a point from its target after the fit.
    largest: f64,
    steps: usize,
    settled: bool,
    /// Time of the precomputation for this model and cage, ms. It includes the bind of the
    /// [`Probes`](cagework_pose::pull::Probes).
    precompute_ms: f64,
    fit_ms: f64,
    notices: Vec<String>,
}

/// Points of the model with their target positions.
struct Goals<'a> {
    /// Weights of the points. `[n_points, n_columns]`
    weights: Cow<'a, Weights>,
    /// Weight of each point in the sum of squared distances. `[n_points]`
    importance: Vec<f64>,
    /// Target position of each point, object units. `[n_points]`
    to: Vec<Vec3>,
    notices: Vec<String>,
}

/// Runs `cagework fit`.
///
/// # Errors
/// If a file cannot be read or written, or files do not match.
pub(crate) fn run(given: &FitArgs, as_json: bool) -> Result<(), CliError> {
    let args = &given.pose;
    let inputs = given.target.iter().chain(&given.landmarks).map(std::path::PathBuf::as_path);
    let bound = BoundModel::load(args, inputs, None)?;
    let begun = Instant::now();
    let pull = pull(&bound.mesh, bound.cage.controls(), args)?;
    let precompute_ms = begun.elapsed().as_secs_f64() * 1e3;
    let Goals { weights, importance, to, notices } = match (&given.target, &given.landmarks) {
        (Some(path), _) => {
            let mut target = load_model(path, args.read.axis(), args.read.memory)?;
            target.set_origin(bound.model.origin());
            vertices(&bound, target, pull.areas())?
        }
        (None, Some(path)) => landmarks(&bound, path)?,
        // clap rejects this case: one of the two arguments is required.
        (None, None) => return Ok(()),
    };
    let begun = Instant::now();
    let options = FitOptions { lambda: given.lambda };
    let fitted = pull
        .fit(&weights, &bound.frames, &importance, &to, options)
        .map_err(|e| CliError::file(&args.mesh, e))?;
    let fit_ms = begun.elapsed().as_secs_f64() * 1e3;
    let pose: Vec<Vec3> = fitted.cage.iter().map(|p| p.as_vec3()).collect();
    if let Some(i) = pose.iter().position(|p| !p.is_finite()) {
        return Err(CliError::Mismatch {
            message: format!("vertex {i} of the pose exceeds the range of 32-bit floats"),
            hint: "check that the targets are in the model's units, or give a larger --lambda",
        });
    }
    write_pose(&bound.model, &bound.cage, &pose, args)?;
    let unsettled = (!fitted.is_settled).then(|| {
        format!("The fit did not converge within {} steps: the pose is that of the last one.", fitted.steps)
    });

    let size = Bounds::around(&bound.model.positions).map_or(1.0, |b| f64::from(b.diagonal()));
    let before = deform_bound(&weights, &bound.frames, bound.cage.controls().rest());
    let (rms_before, largest_before) = distances(&before, &importance, &to, size);
    let points = importance.iter().filter(|&&w| w > 0.0).count();
    let summary = FitSummary {
        output: args.output.path.display().to_string(),
        points,
        left_out: importance.len() - points,
        cage: pull.n_cage(),
        lambda: fitted.lambda,
        energy: fitted.energy,
        rms_before,
        largest_before,
        rms: fitted.rms,
        largest: fitted.largest,
        steps: fitted.steps,
        settled: fitted.is_settled,
        precompute_ms,
        fit_ms,
        notices: bound.model.notices.into_iter().chain(notices).chain(unsettled).collect(),
    };
    print(&if as_json { json(&summary) } else { text(&summary) })
}

/// Collects the targets of all vertices of the bound model: the vertices of `target` with the same indices. Vertices
/// outside the cage get importance 0.
fn vertices<'a>(bound: &'a BoundModel, target: Model, areas: &[f64]) -> Result<Goals<'a>, CliError> {
    let (given, expected) = (target.positions.len(), bound.model.positions.len());
    if given != expected {
        return Err(CliError::Mismatch {
            message: format!(
                "{}: has {given} vertices, but {} has {expected}; vertices are matched by index",
                shown(&target.name),
                shown(&bound.model.name),
            ),
            hint: "for a target with other vertices use --landmarks",
        });
    }
    let mut notices = Vec::new();
    if target.triangles != bound.model.triangles {
        notices.push(
            "the target has other triangles; the fit is wrong if its vertices are in another order".into(),
        );
    }
    let mut importance = areas.to_vec();
    bound.outside.iter().for_each(|o| importance[o.vertex as usize] = 0.0);
    if !bound.outside.is_empty() {
        let n = bound.outside.len();
        let (vertices, them) = if n == 1 { ("vertex is", "it") } else { ("vertices are", "them") };
        notices.push(format!("{n} {vertices} outside the cage; the fit ignores {them}"));
    }
    Ok(Goals { weights: Cow::Borrowed(&bound.weights), importance, to: target.positions, notices })
}

/// Computes the weighted root mean square and maximum of the distances of points from their targets, both divided by
/// `size`.
fn distances(points: &[Vec3], importance: &[f64], to: &[Vec3], size: f64) -> (f64, f64) {
    let (mut sum, mut total, mut largest) = (0.0, 0.0, 0.0_f64);
    for ((at, share), to) in points.iter().zip(importance).zip(to).filter(|((_, s), _)| **s > 0.0) {
        let distance = at.as_dvec3().distance(to.as_dvec3()) / size;
        sum += share * distance * distance;
        total += share;
        largest = largest.max(distance);
    }
    ((sum / total).sqrt(), largest)
}

fn text(summary: &FitSummary) -> String {
    let mut out = format!(
        "fitted {} cage vertices to {} {} in {:.0} ms: rms distance {:.1e} of the model's size, {:.1e} at rest (maximum {:.1e}, \
         {:.1e} at rest); lambda {:.1e}, energy {:.1e}\nwrote {}\n",
        summary.cage,
        summary.points,
        if summary.points == 1 { "point" } else { "points" },
        summary.fit_ms,
        summary.rms,
        summary.rms_before,
        summary.largest,
        summary.largest_before,
        summary.lambda,
        summary.energy,
        shown(&summary.output)
    );
    for notice in &summary.notices {
        out += &format!("note: {notice}\n");
    }
    out
}

/// Creates an error about a file with valid JSON but invalid values.
fn wrong(path: &std::path::Path, what: &str) -> CliError {
    CliError::Mismatch {
        message: format!("{}: {what}", shown_path(path)),
        hint: "see `cagework fit --help` for an example of landmarks",
    }
}
