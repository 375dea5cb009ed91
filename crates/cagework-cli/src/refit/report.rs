//! What a refit says: a line for each model when it is done, and everything as JSON in the end.

use std::path::Path;

use cagework_io::ReshapeReport;
use serde::Serialize;

use crate::card::duration;
use crate::error::{CliError, say};
use crate::files::{print, shown_path};

/// What was done; its JSON is the output of `--json`.
#[derive(Debug, Serialize)]
pub(super) struct Refitted {
    /// The folder.
    pub(super) output: String,
    pub(super) cage_vertices: usize,
    /// Controls inside the cage.
    pub(super) inner_controls: usize,
    /// Voxelizing and solving once for all models; none if no model asked for it, or if each was bound on its own.
    pub(super) solve_ms: Option<f64>,
    pub(super) written: usize,
    pub(super) skipped: usize,
    pub(super) failed: usize,
    pub(super) notices: Vec<String>,
    pub(super) models: Vec<Entry>,
}

/// One model.
#[derive(Debug, Serialize)]
pub(super) struct Entry {
    pub(super) input: String,
    pub(super) output: String,
    #[serde(flatten)]
    pub(super) outcome: Outcome,
}

/// What became of it.
#[derive(Debug, Serialize)]
#[serde(tag = "state", rename_all = "snake_case")]
pub(super) enum Outcome {
    Written(Box<Written>),
    /// It is newer than its inputs.
    Skipped,
    Failed {
        error: String,
        hint: Option<&'static str>,
    },
}

#[derive(Debug, Serialize)]
pub(super) struct Written {
    pub(super) vertices: usize,
    pub(super) outside_vertices: usize,
    /// Its samples and weights, without the solve that all models share.
    pub(super) bind_ms: f64,
    pub(super) deform_ms: f64,
    /// All of it, reading and writing included.
    pub(super) total_ms: f64,
    #[serde(flatten)]
    pub(super) rig: Option<ReshapeReport>,
    pub(super) notices: Vec<String>,
}

impl Outcome {
    pub(super) fn of_error(error: &CliError, model: &Path) -> Self {
        Self::Failed { error: named(error, model), hint: error.hint() }
    }
}

/// An error with the name of the model, unless it says it.
fn named(error: &CliError, model: &Path) -> String {
    let (message, name) = (error.message(), shown_path(model));
    if message.contains(&name) { message } else { format!("{name}: {message}") }
}

/// Says what became of a model, at once; for JSON, only on stderr what failed.
pub(super) fn tell(entry: &Entry, as_json: bool) -> Result<(), CliError> {
    let output = shown_path(entry.output.as_ref());
    match &entry.outcome {
        Outcome::Failed { error, hint } => {
            say(error, *hint);
            Ok(())
        }
        _ if as_json => Ok(()),
        Outcome::Skipped => print(&format!("skipped {output}: newer than its inputs")),
        Outcome::Written(done) => {
            let outside = match done.outside_vertices {
                0 => String::new(),
                n => format!(", {n} outside the cage"),
            };
            let mut line =
                format!("wrote {output}: {} vertices{outside}, {}", done.vertices, duration(done.total_ms));
            for notice in &done.notices {
                line += &format!("\nnote: {notice}");
            }
            print(&line)
        }
    }
}

pub(super) fn text(done: &Refitted, n: usize) -> String {
    let solve = done.solve_ms.map_or(String::new(), |ms| format!("; one solve of {}", duration(ms)));
    let mut out = format!(
        "refitted {} of {n} models, {} skipped, {} failed{solve}\n",
        done.written, done.skipped, done.failed
    );
    for notice in &done.notices {
        out += &format!("note: {notice}\n");
    }
    out
}
