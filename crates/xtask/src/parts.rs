//! The parts of `test`: what ran, what failed, how to run only that again, and how long each part took.

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use crate::wasm::target_folder;

/// One part of the tests that has ended.
struct Part {
    name: String,
    seconds: u64,
    passed: bool,
    /// Command that runs only this part.
    again: String,
}

/// The file in which the parts are listed when they end. Two processes append to it, see `tasks::beside`.
fn file() -> Result<PathBuf, String> {
    Ok(target_folder()?.join("test-parts.tsv"))
}

/// Empties the list, before the first part.
pub(crate) fn begin() -> Result<(), String> {
    let file = file()?;
    fs::write(&file, "").map_err(|e| format!("cannot write {}: {e}", file.display()))
}

/// Runs a part and notes its outcome. A failure is shown at once but returned only by [`end`], so that the other parts
/// still run. Returns whether the part has passed. `again`: the command that runs only this part.
pub(crate) fn part(
    name: &str,
    again: &str,
    work: impl FnOnce() -> Result<(), String>,
) -> Result<bool, String> {
    let began = Instant::now();
    let outcome = work();
    if let Err(message) = &outcome {
        eprintln!("error: {name}: {message}");
    }
    let result = if outcome.is_ok() { "passed" } else { "FAILED" };
    let file = file()?;
    let fault = |e| format!("cannot write {}: {e}", file.display());
    let mut list = fs::OpenOptions::new().append(true).create(true).open(&file).map_err(fault)?;
    // One call, so that lines of two processes do not mix.
    let line = format!("{result}\t{}\t{name}\t{again}\n", began.elapsed().as_secs());
    list.write_all(line.as_bytes()).map_err(fault)?;
    Ok(outcome.is_ok())
}

/// Prints the table of all parts.
///
/// # Errors
/// When a part has failed.
pub(crate) fn end(whole: Duration) -> Result<(), String> {
    let file = file()?;
    let text = fs::read_to_string(&file).map_err(|e| format!("cannot read {}: {e}", file.display()))?;
    let parts: Vec<Part> = text.lines().filter_map(parse).collect();
    println!("\n{}", table(&parts, whole.as_secs()));
    let failed: Vec<&str> = parts.iter().filter(|p| !p.passed).map(|p| p.name.as_str()).collect();
    if failed.is_empty() { Ok(()) } else { Err(format!("failed: {}", failed.join(", "))) }
}

fn parse(line: &str) -> Option<Part> {
    let mut fields = line.split('\t');
    let (result, seconds) = (fields.next()?, fields.next()?);
    let (name, again) = (fields.next()?.to_owned(), fields.next()?.to_owned());
    Some(Part { name, seconds: seconds.parse().ok()?, passed: result == "passed", again })
}

fn table(parts: &[Part], whole: u64) -> String {
    let minutes = |seconds: u64| format!("{}:{:02}", seconds / 60, seconds % 60);
    let width = parts.iter().map(|p| p.name.chars().count()).max().unwrap_or(0).max(5);
    let mut out = format!("{:width$}  min:s  result  only this part\n", "part");
    for Part { name, seconds, passed, again } in parts {
        let result = if *passed { "passed" } else { "FAILED" };
        writeln!(out, "{name:width$}  {:>5}  {result}  {again}", minutes(*seconds)).ok();
    }
    write!(out, "{:width$}  {:>5}  (parts that run in parallel count once)", "all", minutes(whole)).ok();
    out
}

#[cfg(test)]
mod tests {
    use super::{parse, table};

    #[test]
    fn the_table_shows_each_part_its_time_its_result_and_its_command() {
        let lines =
            "passed\t65\tRust\tcargo test\nFAILED\t3\tpage in Chromium\tcargo xtask page-test --last-failed";
        let parts: Vec<_> = lines.lines().filter_map(parse).collect();
        let expected = "part              min:s  result  only this part\n\
                        Rust               1:05  passed  cargo test\n\
                        page in Chromium   0:03  FAILED  cargo xtask page-test --last-failed\n\
                        all                1:08  (parts that run in parallel count once)";
        assert_eq!(table(&parts, 68), expected);
        assert!(parse("damaged").is_none());
    }
}
