//! `cagework cage`: makes a cage for a model.

use cagework_cage::generate::{BOX_DIVISIONS, CageReport, MIN_VOXELS};
use cagework_core::PolygonMesh;
use cagework_core::words::three_digits;
use cagework_io::{MemoryError, Model, shown};
use glam::{DVec3, Vec3};
use serde::Serialize;

use crate::args::{CageArgs, KindArg, ModelOutput};
use crate::bind::export;
use crate::error::CliError;
use crate::files::{check_outputs, json, models_of_folders, print, write};
use crate::load::{box_mesh, generate_for, load_any, states_of};

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct CageSummary {
    output: String,
    /// Number of models that the cage encloses.
    models: usize,
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
    notices: Vec<String>,
}

/// Vertices and triangles of all models that the cage encloses.
struct CageInput {
    /// Positions of the vertices relative to `origin`, Y up. `[n_vertices]`, object units
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// Origin of the first model, in the axes of its file.
    origin: DVec3,
    models: usize,
    notices: Vec<String>,
}

/// Runs `cagework cage`.
///
/// # Errors
/// If a model cannot be read, or the cage cannot be made or written.
pub(crate) fn run(args: &CageArgs, as_json: bool) -> Result<(), CliError> {
    args.check()?;
    let around = enclosed(args)?;
    let mut summary = CageSummary {
        output: args.output.path.display().to_string(),
        models: around.models,
        kind: "box",
        vertices: 0,
        faces: 0,
        divisions: None,
        margin: None,
        report: None,
        notices: around.notices,
    };
    let cage = match args.kind() {
        KindArg::Box => {
            let divisions = args.divisions.unwrap_or(BOX_DIVISIONS);
            (summary.divisions, summary.margin) = (Some(divisions), Some(args.margin));
            box_mesh(&around.positions, divisions, args.margin)?
        }
        kind => {
            summary.kind = if kind == KindArg::Hull { "hull" } else { "auto" };
            let (cage, report) = generate_for(&around.positions, &around.triangles, &args.options())?;
            summary.report = Some(report);
            cage
        }
    };
    (summary.vertices, summary.faces) = (cage.positions.len(), cage.faces.len());
    write_cage(&args.output, &args.read.axis().mesh_turned_back(&cage), around.origin)?;
    if as_json {
        return print(&json(&summary));
    }
    print(&text(&summary))
}

/// Reads the models that the cage encloses, one at a time, and joins their vertices and triangles.
fn enclosed(args: &CageArgs) -> Result<CageInput, CliError> {
    let paths = models_of_folders(&args.models, &[&args.output.path])?;
    check_outputs(&[&args.output.path], &paths.iter().map(AsRef::as_ref).collect::<Vec<_>>())?;
    let mut all = CageInput {
        positions: Vec::new(),
        triangles: Vec::new(),
        origin: DVec3::ZERO,
        models: paths.len(),
        notices: Vec::new(),
    };
    let (mut unknown_clip, mut has_clip) = (None, args.around_clip.is_none());
    for path in &paths {
        let mut model = load_any(path, args.read.axis(), args.read.memory)?;
        if all.positions.is_empty() {
            all.origin = model.origin();
        }
        let n_notices = model.notices.len();
        model.set_origin(all.origin);
        all.notices.extend(model.notices[n_notices..].iter().map(|n| format!("{}: {n}", shown(&model.name))));
        let (positions, triangles) = match states_of(&model, args.around_clip.as_deref()) {
            Ok(states) => {
                has_clip = true;
                states
            }
            Err(unknown) => {
                unknown_clip = unknown_clip.or(Some(unknown));
                states_of(&model, None)?
            }
        };
        let first = all.positions.len() as u32;
        let n_positions = all.positions.len() + positions.len();
        let bytes = 12 * (n_positions + all.triangles.len() + triangles.len()) as u64;
        // Vertices and triangles take 12 bytes each. Cap the limit at `u32::MAX` of them, so that indices fit in 32
        // bits.
        MemoryError::check(bytes, args.read.memory.bytes().min(12 * u64::from(u32::MAX)))
            .map_err(|e| CliError::file(path, format!("with the models before it, {e}")))?;
        all.positions.extend(positions);
        all.triangles.extend(triangles.iter().map(|t| t.map(|v| first + v)));
    }
    match unknown_clip {
        Some(unknown) if !has_clip => Err(unknown),
        _ => Ok(all),
    }
}

/// Writes a cage in the output's format. `origin` is added to all its positions.
///
/// # Errors
/// If the file cannot be written.
pub(crate) fn write_cage(output: &ModelOutput, cage: &PolygonMesh, origin: DVec3) -> Result<(), CliError> {
    write(&output.path, &export(&Model::of_mesh("cage.obj", cage, origin)?, &cage.positions, output)?)
}

fn text(summary: &CageSummary) -> String {
    let around = match summary.models {
        1 => String::new(),
        n => format!(" around {n} models"),
    };
    let notices: String = summary.notices.iter().map(|notice| format!("\nnote: {notice}")).collect();
    let Some(report) = &summary.report else {
        return format!(
            "wrote {}: a box{around} of {} vertices and {} faces{notices}",
            shown(&summary.output),
            summary.vertices,
            summary.faces
        );
    };
    let mut text = format!(
        "wrote {}{around}: {} vertices and {} faces ({:.0} % quads) in {:.0} ms; minimum distance from the model {}",
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
            ".\nnote: the model's shape needs {} vertices instead of {}",
            report.vertices, report.target
        ));
        if report.voxels as usize > MIN_VOXELS {
            text.push_str(&format!(
                "; fewer --voxels than {} close more of its holes and gaps",
                report.voxels
            ));
        }
    }
    for notice in &report.notices {
        text.push_str(&format!("\nnote: {notice}"));
    }
    text + &notices
}
