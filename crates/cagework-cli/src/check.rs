//! `cagework check`: everything that is wrong with a cage, and what can be mended.

use std::fmt::Write as _;

use cagework_cage::check::{CageCheck, Code, Fix, Repair, Severity, check_smooth, repair_smooth};
use cagework_io::{UpAxis, shown};
use serde::Serialize;

use crate::args::CheckArgs;
use crate::cage::write_cage;
use crate::error::CliError;
use crate::files::{check_outputs, json, print, shown_path};
use crate::load::{cage_mesh, load_model};

/// What `check` says; its JSON is the output of `--json`.
#[derive(Debug, Serialize)]
struct Checked {
    file: String,
    /// What was mended, a sentence each.
    repaired: Vec<String>,
    /// The mended cage's file.
    output: Option<String>,
    /// The state after the repairs.
    #[serde(flatten)]
    check: CageCheck,
}

/// Runs `cagework check`.
///
/// # Errors
/// When a file cannot be read or written, or the mesh cannot be used as a cage.
pub(crate) fn run(args: &CheckArgs, as_json: bool) -> Result<(), CliError> {
    let inputs: Vec<_> =
        std::iter::once(&args.cage).chain(&args.mesh).map(std::path::PathBuf::as_path).collect();
    let outputs: Vec<_> = args.output.iter().map(|output| output.path.as_path()).collect();
    check_outputs(&outputs, &inputs)?;
    // Which way is up makes no difference to what is wrong with a cage.
    let load = |path| load_model(path, UpAxis::Y, args.memory);
    let refused = |source| CliError::Cage { name: args.cage.display().to_string(), source };
    let of_cage = load(&args.cage)?;
    let mut cage = cage_mesh(&of_cage).map_err(refused)?;
    let mut model = args.mesh.as_deref().map(load).transpose()?;
    model.iter_mut().for_each(|model| model.see_from(of_cage.origin()));
    let inside = model.as_ref().map(|m| m.positions.as_slice());
    let smooth = args.smooth.smooth;
    let mut checked = Checked {
        file: args.cage.display().to_string(),
        repaired: Vec::new(),
        output: None,
        check: check_smooth(&cage, inside, Some(args.grid), smooth),
    };
    if let Some(output) = &args.output {
        let repairs: Vec<Repair> = args.repair.iter().map(|&r| r.into()).collect();
        let mended = repair_smooth(&cage, &repairs, inside, smooth)?;
        cage = mended.mesh;
        write_cage(output, &cage, of_cage.origin())?;
        checked.repaired = mended.done;
        checked.output = Some(output.path.display().to_string());
        checked.check = check_smooth(&cage, inside, Some(args.grid), smooth);
    }
    print(&if as_json { json(&checked) } else { text(&checked) })?;
    if checked.check.valid {
        return Ok(());
    }
    let errors = checked.check.problems.iter().filter(|p| p.severity == Severity::Error).count();
    Err(CliError::Mismatch {
        message: format!(
            "{} cannot be used as a cage: {errors} {}",
            shown_path(&args.cage),
            if errors == 1 { "kind of fault" } else { "kinds of faults" }
        ),
        hint: "`cagework check CAGE --repair weld,drop-degenerate,fill-holes,flip -o FILE` mends what it can",
    })
}

fn text(checked: &Checked) -> String {
    let check = &checked.check;
    let mut out = format!(
        "{}: {} vertices, {} faces, {} {}\n",
        shown(&checked.file),
        check.vertices,
        check.faces,
        check.components,
        if check.components == 1 { "component" } else { "components" }
    );
    for done in &checked.repaired {
        let _ = writeln!(out, "mended: {done}");
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
            Some(true) => out.push_str(", and the whole model is inside"),
            Some(false) => out.push_str(", but not all of the model is inside"),
            None => {}
        }
        out.push('\n');
    }
    if let Some(output) = &checked.output {
        let _ = writeln!(out, "wrote {}", shown(output));
    }
    out
}

/// The first place of a problem in words, if its sentence names none.
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
