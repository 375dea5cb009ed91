//! `cagework check`: lists the faults of a cage and repairs them.

use std::fmt::Write as _;

use cagework_cage::check::{CageCheck, Code, Fix, Severity, check_smooth, repair_smooth};
use cagework_io::{UpAxis, shown};
use serde::Serialize;

use crate::args::CheckArgs;
use crate::cage::write_cage;
use crate::error::CliError;
use crate::files::{check_outputs, json, print, shown_path};
use crate::load::{cage_mesh, load_model};

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct CheckSummary {
    file: String,
    /// Sentences that describe the applied repairs, one for each repair.
    repaired: Vec<String>,
    /// Path of the repaired cage; `None` if nothing was written.
    output: Option<String>,
    /// Result of the check of the cage after the repairs.
    #[serde(flatten)]
    check: CageCheck,
}

/// Runs `cagework check`.
///
/// # Errors
/// If a file cannot be read or written, or the mesh is not a valid cage.
pub(crate) fn run(args: &CheckArgs, as_json: bool) -> Result<(), CliError> {
    let inputs: Vec<_> =
        std::iter::once(&args.cage).chain(&args.mesh).map(std::path::PathBuf::as_path).collect();
    let outputs: Vec<_> = args.output.iter().map(|output| output.path.as_path()).collect();
    check_outputs(&outputs, &inputs)?;
    // Read with Y up, because the faults of a cage do not depend on the up axis.
    let load = |path| load_model(path, UpAxis::Y, args.memory);
    let refused = |source| CliError::Cage { name: args.cage.display().to_string(), source };
    let of_cage = load(&args.cage)?;
    let mut cage = cage_mesh(&of_cage).map_err(refused)?;
    let mut model = args.mesh.as_deref().map(load).transpose()?;
    model.iter_mut().for_each(|model| model.set_origin(of_cage.origin()));
    let inside = model.as_ref().map(|m| m.positions.as_slice());
    let smooth = args.smooth.smooth;
    let mut summary = CheckSummary {
        file: args.cage.display().to_string(),
        repaired: Vec::new(),
        output: None,
        check: check_smooth(&cage, inside, Some(args.grid), smooth),
    };
    if let Some(output) = &args.output {
        let repaired = repair_smooth(&cage, &args.repair, inside, smooth)?;
        cage = repaired.mesh;
        write_cage(output, &cage, of_cage.origin())?;
        summary.repaired = repaired.done;
        summary.output = Some(output.path.display().to_string());
        summary.check = check_smooth(&cage, inside, Some(args.grid), smooth);
    }
    print(&if as_json { json(&summary) } else { text(&summary) })?;
    if summary.check.valid {
        return Ok(());
    }
    let errors = summary.check.problems.iter().filter(|p| p.severity == Severity::Error).count();
    Err(CliError::Mismatch {
        message: format!(
            "{} cannot be used as a cage: {errors} {}",
            shown_path(&args.cage),
            if errors == 1 { "kind of fault" } else { "kinds of faults" }
        ),
        hint: "`cagework check CAGE --repair weld,drop-degenerate,fill-holes,flip -o FILE` repairs most faults",
    })
}

fn text(summary: &CheckSummary) -> String {
    let check = &summary.check;
    let mut out = format!(
        "{}: {} vertices, {} faces, {} {}\n",
        shown(&summary.file),
        check.vertices,
        check.faces,
        check.components,
        if check.components == 1 { "component" } else { "components" }
    );
    for done in &summary.repaired {
        let _ = writeln!(out, "repaired: {done}");
    }
    for p in &check.problems {
        let name = match p.severity {
            Severity::Error => "fault",
            Severity::Warning => "warning",
            Severity::Note => "note",
        };
        let _ = write!(out, "{name}: {}", p.message);
        if let Some(place) = place(p) {
            let _ = write!(out, " First: {place}.");
        }
        if let Some(Fix::Repair { repair }) = p.fixes.first() {
            let name = json(repair).replace(['"', '\n'], "").replace('_', "-");
            let _ = write!(out, " (--repair {name})");
        }
        out.push('\n');
    }
    if check.valid {
        out.push_str("valid as a cage");
        match check.encloses {
            Some(true) => out.push_str(", and all vertices of the model are inside"),
            Some(false) => out.push_str(", but some vertices of the model are outside"),
            None => {}
        }
        out.push('\n');
    }
    if let Some(output) = &summary.output {
        let _ = writeln!(out, "wrote {}", shown(output));
    }
    out
}

/// Returns text that names the first faulty edge, face or vertex. `None` for self-intersections, whose message already
/// names the faces.
fn place(p: &cagework_cage::check::Problem) -> Option<String> {
    if p.code == Code::SelfIntersection {
        return None;
    }
    let places = &p.places;
    if let Some([a, b]) = places.edges.first() {
        return Some(format!("edge {a}-{b}"));
    }
    if let Some(f) = places.faces.first() {
        return Some(format!("face {f}"));
    }
    places.vertices.first().map(|v| format!("vertex {v}"))
}
