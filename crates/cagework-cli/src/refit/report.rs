//! Output of `cagework refit`: a line for each finished model, and a summary at the end.

use std::path::Path;

use cagework_io::ReshapeReport;
use serde::Serialize;

use crate::card::duration;
use crate::error::{CliError, print_error};
use crate::files::{print, shown_path};

/// Output of `--json`.
#[derive(Debug, Serialize)]
pub(super) struct RefitSummary {
    /// Folder that the outputs are written to.
    pub(super) output: String,
    pub(super) cage_vertices: usize,
    pub(super) inner_controls: usize,
    /// Time to voxelise and solve, ms; null if all models were skipped, or if the cage was solved for each model
    /// separately.
    pub(super) solve_ms: Option<f64>,
    pub(super) written: usize,
    pub(super) skipped: usize,
    pub(super) failed: usize,
    pub(super) notices: Vec<String>,
    pub(super) models: Vec<ModelEntry>,
}

/// Result of refitting one model.
#[derive(Debug, Serialize)]
pub(super) struct ModelEntry {
    pub(super) input: String,
    pub(super) output: String,
    #[serde(flatten)]
    pub(super) outcome: Outcome,
}

#[derive(Debug, Serialize)]
#[serde(tag = "state", rename_all = "snake_case")]
pub(super) enum Outcome {
    Written(Box<ModelReport>),
    /// Skipped by `--resume`, because the output is newer than its inputs.
    Skipped,
    Failed {
        error: String,
        hint: Option<&'static str>,
    },
}

#[derive(Debug, Default, Serialize)]
pub(super) struct ModelReport {
    pub(super) vertices: usize,
    pub(super) outside_vertices: usize,
    /// Time to sample and assemble the weights, ms. It excludes the shared solve.
    pub(super) bind_ms: f64,
    pub(super) deform_ms: f64,
    /// Time of the whole model, including reading and writing, ms.
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

/// Returns the error message, with the model's path in front of it unless the message already contains the path.
fn named(error: &CliError, model: &Path) -> String {
    let (message, name) = (error.message(), shown_path(model));
    if message.contains(&name) { message } else { format!("{name}: {message}") }
}

/// Prints the result of one model. With `--json`, prints only errors, on stderr.
pub(super) fn print_entry(entry: &ModelEntry, as_json: bool) -> Result<(), CliError> {
    let output = shown_path(entry.output.as_ref());
    match &entry.outcome {
        Outcome::Failed { error, hint } => {
            print_error(error, *hint, as_json);
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

pub(super) fn text(summary: &RefitSummary, n: usize) -> String {
    let solve = summary.solve_ms.map_or(String::new(), |ms| format!("; one solve of {}", duration(ms)));
    let mut out = format!(
        "refitted {} of {n} models, {} skipped, {} failed{solve}\n",
        summary.written, summary.skipped, summary.failed
    );
    for notice in &summary.notices {
        out += &format!("note: {notice}\n");
    }
    out
}
