//! `cagework deform` for files without faces (Gaussian splats and point clouds): maps them by the deformation field of
//! the cage, without weights.

use std::time::Instant;

use cagework_core::enclosure::Enclosure;
use cagework_core::words::{counted, grouped};
use cagework_io::{MemoryError, Model, shown};
use serde::Serialize;

use crate::args::{DeformArgs, ModelOutput};
use crate::error::CliError;
use crate::field::{LatticeSummary, field_of_deform};
use crate::files::{json, print, write};

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct CaptureSummary {
    output: String,
    /// Number of splats or points.
    points: usize,
    is_splats: bool,
    /// Number of points outside the cage. Near the cage they move with it; with growing distance they move less.
    outside_points: usize,
    /// Number of splats for which the deformation differs from its first-order approximation by more than 10 % of half
    /// the longest axis, at an end of this axis.
    inexact_splats: usize,
    /// Time to compute the field and the points, without reading and writing files, ms.
    deform_ms: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    lattice: Option<LatticeSummary>,
    notices: Vec<String>,
}

/// Deforms splats or points by one pose.
///
/// # Errors
/// If a file cannot be read or written, files do not match, or the bind fails.
pub(crate) fn deform(
    args: &DeformArgs,
    model: &Model,
    output: &ModelOutput,
    lattice: Option<LatticeSummary>,
    as_json: bool,
) -> Result<(), CliError> {
    if args.weights.is_some() {
        return Err(CliError::Mismatch {
            message: "the file has no faces, so it is deformed without weights".into(),
            hint: "leave out --weights",
        });
    }
    let to_write = model.bytes_to_write(output.format);
    MemoryError::check(model.bytes() + to_write, args.read.memory.bytes())
        .map_err(|e| CliError::file(&output.path, e))?;
    let started = Instant::now();
    let (cage, field) = field_of_deform(args, model)?;
    let outside_points = Enclosure::new(&cage, &model.positions).outside().len();
    let inexact_splats = model.splats().map_or(0, |splats| splats.n_inexact(&field));
    let deform_ms = started.elapsed().as_secs_f64() * 1e3;
    let bytes = model.write_in_field(output.format, &field).map_err(|e| CliError::file(&output.path, e))?;
    let mut notices = model.notices.clone();
    let points = model.positions.len();
    if outside_points > 0 {
        notices.push(format!(
            "{} of {} are outside the cage: near it they move with it, farther out they stay.",
            grouped(outside_points),
            kinds(model.splats().is_some(), points)
        ));
    }
    if inexact_splats > 0 {
        notices.push(format!(
            "{} by more than 10 % of the longest axis, which an ellipsoid cannot show.",
            counted(inexact_splats, "splat bends", "splats bend")
        ));
    }
    notices.extend(model.lost_in(output.format));
    write(&output.path, &bytes)?;
    let summary = CaptureSummary {
        output: output.path.display().to_string(),
        points,
        is_splats: model.splats().is_some(),
        outside_points,
        inexact_splats,
        deform_ms,
        lattice,
        notices,
    };
    print(&if as_json { json(&summary) } else { text(&summary) })
}

fn kinds(is_splats: bool, n: usize) -> String {
    if is_splats { counted(n, "splat", "splats") } else { counted(n, "point", "points") }
}

fn text(summary: &CaptureSummary) -> String {
    let mut out = format!(
        "deformed {} in {:.0} ms\nwrote {}\n",
        kinds(summary.is_splats, summary.points),
        summary.deform_ms,
        shown(&summary.output)
    );
    out += &summary.lattice.as_ref().map_or_else(String::new, LatticeSummary::text);
    for notice in &summary.notices {
        out += &format!("note: {notice}\n");
    }
    out
}
