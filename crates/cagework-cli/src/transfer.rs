//! `cagework transfer`: gives clothes the skeleton, the joint weights and the morph targets of a body.

use cagework_io::{TransferError, TransferOptions, TransferReport, shown, transfer_report};
use serde::Serialize;

use crate::args::TransferArgs;
use crate::error::CliError;
use crate::files::{check_outputs, json, print, write};
use crate::load::load_model;

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct TransferSummary {
    output: String,
    #[serde(flatten)]
    report: TransferReport,
}

/// Runs `cagework transfer`.
///
/// # Errors
/// If a file cannot be read or written, the body has nothing that the clothes lack, or the clothes are not near the body.
pub(crate) fn run(args: &TransferArgs, as_json: bool) -> Result<(), CliError> {
    check_outputs(&[&args.output], &[&args.body, &args.clothes])?;
    let (up, memory) = (args.read.axis(), args.read.memory);
    let [body, clothes] = [load_model(&args.body, up, memory)?, load_model(&args.clothes, up, memory)?];
    let options = TransferOptions { push_out: args.push_out, memory_limit: memory.bytes() };
    let done = clothes.transfer_from(&body, &options);
    let (glb, report) = done.map_err(|error| {
        let hint = match &error {
            TransferError::Memory(_) => "the limit is set by --memory-limit, in MiB",
            _ => "`cagework info` describes both files",
        };
        CliError::Mismatch { message: error.to_string(), hint }
    })?;
    write(&args.output, &glb)?;
    let output = args.output.display().to_string();
    if as_json {
        return print(&json(&TransferSummary { output, report }));
    }
    print(&format!("{}\nwrote {}\n", transfer_report(&report).join("\n"), shown(&output)))
}
