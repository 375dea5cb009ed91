//! `cagework cage`: makes a cage for a model.

use cagework_cage::generate::{BOX_DIVISIONS, CageReport};
use cagework_core::PolygonMesh;
use cagework_io::{Model, shown};
use glam::DVec3;
use serde::Serialize;

use crate::args::{CageArgs, KindArg, ModelOutput};
use crate::bind::export;
use crate::error::CliError;
use crate::files::{check_outputs, json, print, write};
use crate::load::{box_mesh, generate_for, load_any};

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct CageSummary {
    output: String,
    kind: &'static str,
    vertices: usize,
    faces: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    divisions: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    margin: Option<f32>,
    /// Report of the cage generator; `None` for a box.
    #[serde(skip_serializing_if = "Option::is_none")]
    report: Option<CageReport>,
}

/// Runs `cagework cage`.
///
/// # Errors
/// If the model cannot be read, or the cage cannot be made or written.
pub(crate) fn run(args: &CageArgs, as_json: bool) -> Result<(), CliError> {
    check_outputs(&[&args.output.path], &[&args.model])?;
    let model = load_any(&args.model, args.read.axis(), args.read.memory)?;
    let mut summary = CageSummary {
        output: args.output.path.display().to_string(),
        kind: "box",
        vertices: 0,
        faces: 0,
        divisions: None,
        margin: None,
        report: None,
    };
    let cage = match args.kind() {
        KindArg::Box => {
            let divisions = args.divisions.unwrap_or(BOX_DIVISIONS);
            (summary.divisions, summary.margin) = (Some(divisions), Some(args.margin));
            let states = model.states(args.around_clip.as_deref());
            let (positions, _) = states.map_err(|e| CliError::file(&args.model, e))?;
            box_mesh(&positions, divisions, args.margin)?
        }
        kind => {
            summary.kind = if kind == KindArg::Hull { "hull" } else { "auto" };
            let (cage, report) = generate_for(&model, args.around_clip.as_deref(), &args.options())?;
            summary.report = Some(report);
            cage
        }
    };
    (summary.vertices, summary.faces) = (cage.positions.len(), cage.faces.len());
    write_cage(&args.output, &model.up().mesh_turned_back(&cage), model.origin())?;
    if as_json {
        return print(&json(&summary));
    }
    print(&text(&summary))
}

/// Writes a cage in the output's format. `origin` is added to all its positions.
///
/// # Errors
/// If the file cannot be written.
pub(crate) fn write_cage(output: &ModelOutput, cage: &PolygonMesh, origin: DVec3) -> Result<(), CliError> {
    write(&output.path, &export(&Model::of_mesh("cage.obj", cage, origin)?, &cage.positions, output)?)
}

/// Formats a length with three significant digits.
fn three_digits(length: f32) -> String {
    let after_point = 2.0 - length.log10().floor();
    match after_point {
        -4.0..=8.0 => format!("{length:.0$}", after_point.max(0.0) as usize),
        _ => format!("{length:.2e}"),
    }
}

fn text(summary: &CageSummary) -> String {
    let Some(report) = &summary.report else {
        return format!(
            "wrote {}: a box of {} vertices and {} faces",
            shown(&summary.output),
            summary.vertices,
            summary.faces
        );
    };
    let mut text = format!(
        "wrote {}: {} vertices and {} faces ({:.0} % quads) in {:.0} ms; minimum distance from the model {}",
        shown(&summary.output),
        summary.vertices,
        summary.faces,
        100.0 * f64::from(report.quads) / f64::from(report.faces.max(1)),
        report.elapsed_ms,
        three_digits(report.clearance)
    );
    if let Some(mirror) = report.mirror {
        text.push_str(&format!(", symmetric in {}", format!("{mirror:?}").to_lowercase()));
    }
    if report.parts > 1 {
        text.push_str(&format!(", {} closed parts", report.parts));
    }
    if report.vertices > report.target {
        text.push_str(&format!(
            ".\nnote: the model's holes and gaps need {} vertices instead of {}; fewer --voxels than {} close more of them",
            report.vertices, report.target, report.voxels
        ));
    }
    for notice in &report.notices {
        text.push_str(&format!("\nnote: {notice}"));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::three_digits;

    #[test]
    fn lengths_have_three_significant_digits() {
        for (length, text) in
            [(0.0213, "0.0213"), (3.79, "3.79"), (50_100.0, "50100"), (2.5e-8, "2.50e-8"), (0.0, "0.00e0")]
        {
            assert_eq!(three_digits(length), text);
        }
    }
}
