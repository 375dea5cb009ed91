//! `cagework cage`: a cage for a model.

use cagework_io::write_cage_obj;
use serde::Serialize;

use crate::args::CageArgs;
use crate::error::CliError;
use crate::files::{check_outputs, json, print, write};
use crate::load::{box_mesh, load_model};

/// What was made; its JSON is the output of `--json`.
#[derive(Debug, Serialize)]
struct Made {
    output: String,
    kind: &'static str,
    divisions: u32,
    margin: f32,
    vertices: usize,
    faces: usize,
}

/// Runs `cagework cage`.
///
/// # Errors
/// When the model cannot be read or the cage cannot be written.
pub(crate) fn run(args: &CageArgs, as_json: bool) -> Result<(), CliError> {
    check_outputs(&[&args.output], &[&args.model])?;
    let model = load_model(&args.model)?;
    let cage = box_mesh(&model.positions, args.divisions, args.margin)?;
    write(&args.output, &write_cage_obj(&cage))?;
    let made = Made {
        output: args.output.display().to_string(),
        kind: "box",
        divisions: args.divisions,
        margin: args.margin,
        vertices: cage.positions.len(),
        faces: cage.faces.len(),
    };
    if as_json {
        return print(&json(&made));
    }
    print(&format!("wrote {}: a box of {} vertices and {} faces", made.output, made.vertices, made.faces))
}
