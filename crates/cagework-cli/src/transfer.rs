//! `cagework transfer`: gives clothes the skeleton and the joint weights of a body.

use cagework_core::inpaint::Inpainted;
use cagework_io::{shown, transfer_report};
use serde::Serialize;

use crate::args::TransferArgs;
use crate::error::CliError;
use crate::files::{check_outputs, json, print, write};
use crate::load::load_model;

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct TransferSummary {
    output: String,
    /// Numbers of positions by the origin of their weights: the closest point of the body, their neighbours, or the
    /// closest point for a part that is nowhere near the body.
    matched: usize,
    inpainted: usize,
    copied: usize,
}

/// Runs `cagework transfer`.
///
/// # Errors
/// If a file cannot be read or written, the body has no skin, or the clothes have one or are not near the body.
pub(crate) fn run(args: &TransferArgs, as_json: bool) -> Result<(), CliError> {
    check_outputs(&[&args.output], &[&args.body, &args.clothes])?;
    let (up, memory) = (args.read.axis(), args.read.memory);
    let [body, clothes] = [load_model(&args.body, up, memory)?, load_model(&args.clothes, up, memory)?];
    let done = clothes.write_with_skin_of(&body, memory.bytes());
    let (glb, found) = done.map_err(|e| CliError::Mismatch {
        message: e.to_string(),
        hint: "`cagework info` describes both files; the memory limit is set by --memory-limit, in MiB",
    })?;
    write(&args.output, &glb)?;
    let report = transfer_report(&found);
    let Inpainted { matched, inpainted, copied, .. } = found;
    let output = args.output.display().to_string();
    if as_json {
        return print(&json(&TransferSummary { output, matched, inpainted, copied }));
    }
    print(&format!("{}\nwrote {}\n", report.join("\n"), shown(&output)))
}
