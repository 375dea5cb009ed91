//! `cagework fit`: the pose of the cage that brings a model to a target.

mod landmarks;

use std::time::Instant;

use cagework_core::{Bounds, Weights};
use cagework_io::{Model, shown};
use cagework_pose::pull::FitOptions;
use glam::{DVec3, Vec3};
use serde::Serialize;

use crate::args::FitArgs;
use crate::error::CliError;
use crate::files::{json, print, shown_path};
use crate::load::load_model;
use crate::pose::{Bound, pull, write_pose};
use landmarks::landmarks;

/// What was done; its JSON is the output of `--json`. Lengths are shares of the diagonal of the model's box.
#[derive(Debug, Serialize)]
struct Fit {
    output: String,
    /// Vertices or landmarks that were brought to their targets.
    points: usize,
    /// Vertices that were left out: those outside the cage.
    left_out: usize,
    cage: usize,
    lambda: f64,
    energy: f64,
    /// Root of the mean squared distance from the targets, and the largest one, at rest.
    rms_before: f64,
    largest_before: f64,
    /// The same in the pose.
    rms: f64,
    largest: f64,
    steps: usize,
    settled: bool,
    /// Once per binding, with the bind of the probes.
    precompute_ms: f64,
    fit_ms: f64,
    notices: Vec<String>,
}

/// Points of the model, and where they should be.
struct Goals {
    /// Their rows. `[n_points, n]`
    weights: Weights,
    /// How much each counts. `[n_points]`
    shares: Vec<f64>,
    /// Object units. `[n_points]`
    to: Vec<Vec3>,
    notices: Vec<String>,
}

/// Runs `cagework fit`.
///
/// # Errors
/// When a file cannot be read or written, or files do not belong together.
pub(crate) fn run(given: &FitArgs, as_json: bool) -> Result<(), CliError> {
    let args = &given.pose;
    let inputs = given.target.iter().chain(&given.landmarks).map(std::path::PathBuf::as_path);
    let bound = Bound::load(args, inputs)?;
    let begun = Instant::now();
    let pull = pull(&bound.model, bound.cage.controls(), args)?;
    let precompute_ms = begun.elapsed().as_secs_f64() * 1e3;
    let Goals { weights, shares, to, notices } = match (&given.target, &given.landmarks) {
        (Some(path), _) => {
            let mut target = load_model(path, args.read.axis(), args.read.memory)?;
            target.see_from(bound.model.origin());
            vertices(&bound, target, pull.areas())?
        }
        (None, Some(path)) => landmarks(&bound, path)?,
        // The command line's own rules leave no such case.
        (None, None) => return Ok(()),
    };
    let begun = Instant::now();
    let options = FitOptions { lambda: given.lambda };
    let fitted = pull.fit(&weights, &shares, &to, options).map_err(|e| CliError::file(&args.mesh, e))?;
    let fit_ms = begun.elapsed().as_secs_f64() * 1e3;
    let pose: Vec<Vec3> = fitted.cage.iter().map(|p| p.as_vec3()).collect();
    if let Some(i) = pose.iter().position(|p| !p.is_finite()) {
        return Err(CliError::Mismatch {
            message: format!("the pose's vertex {i} is beyond numbers of 32 bits"),
            hint: "are the targets in the model's units? a larger --lambda holds the cage together",
        });
    }
    write_pose(&bound.model, &bound.cage, &pose, args)?;

    let size = Bounds::of(&bound.model.positions).map_or(1.0, |b| f64::from(b.diagonal()));
    let (rms_before, largest_before) = distances(&weights, bound.cage.controls().rest(), &shares, &to, size);
    let points = shares.iter().filter(|&&share| share > 0.0).count();
    let done = Fit {
        output: args.output.path.display().to_string(),
        points,
        left_out: shares.len() - points,
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
        notices: bound.model.notices.into_iter().chain(notices).collect(),
    };
    print(&if as_json { json(&done) } else { text(&done) })
}

/// All vertices inside the cage to those of another model.
fn vertices(bound: &Bound, target: Model, areas: &[f64]) -> Result<Goals, CliError> {
    let (given, expected) = (target.positions.len(), bound.model.positions.len());
    if given != expected {
        return Err(CliError::Mismatch {
            message: format!(
                "{}: has {given} vertices, but {} has {expected}: vertices are matched by their order",
                shown(&target.name),
                shown(&bound.model.name),
            ),
            hint: "give some --landmarks where the two have different vertices",
        });
    }
    let mut notices = Vec::new();
    if target.triangles != bound.model.triangles {
        notices.push(
            "the target has other triangles: if its vertices are in another order, the pose is wrong".into(),
        );
    }
    let mut shares = areas.to_vec();
    bound.outside.iter().for_each(|o| shares[o.vertex as usize] = 0.0);
    if !bound.outside.is_empty() {
        let n = bound.outside.len();
        notices.push(format!("{n} vertices outside the cage are left out"));
    }
    Ok(Goals { weights: bound.rows(), shares, to: target.positions, notices })
}

/// Root of the mean squared distance of points from their targets, and the largest one, over `size`.
fn distances(weights: &Weights, cage: &[Vec3], shares: &[f64], to: &[Vec3], size: f64) -> (f64, f64) {
    let (mut sum, mut total, mut largest) = (0.0, 0.0, 0.0_f64);
    for (((indices, data), share), to) in weights.rows().zip(shares).zip(to).filter(|((_, s), _)| **s > 0.0) {
        let terms = indices.iter().zip(data).map(|(&i, &w)| f64::from(w) * cage[i as usize].as_dvec3());
        let distance = terms.sum::<DVec3>().distance(to.as_dvec3()) / size;
        sum += share * distance * distance;
        total += share;
        largest = largest.max(distance);
    }
    ((sum / total).sqrt(), largest)
}

fn text(done: &Fit) -> String {
    let mut out = format!(
        "fitted {} cage vertices to {} points in {:.0} ms: mean distance {:.1e} of the model's size, before {:.1e} (largest {:.1e}, \
         before {:.1e}); lambda {:.1e}, energy {:.1e}\nwrote {}\n",
        done.cage,
        done.points,
        done.fit_ms,
        done.rms,
        done.rms_before,
        done.largest,
        done.largest_before,
        done.lambda,
        done.energy,
        shown(&done.output)
    );
    if !done.settled {
        out += &format!("note: it still moved after {} steps\n", done.steps);
    }
    for notice in &done.notices {
        out += &format!("note: {notice}\n");
    }
    out
}

/// A fault of a file that was understood.
fn wrong(path: &std::path::Path, what: &str) -> CliError {
    CliError::Mismatch {
        message: format!("{}: {what}", shown_path(path)),
        hint: "see `cagework fit --help` for an example of landmarks",
    }
}
