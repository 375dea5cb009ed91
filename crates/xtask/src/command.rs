//! Runs other programs in the root of the repository.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Absolute path of the repository's root.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("crates/xtask has a root").to_path_buf()
}

/// Runs a program in the root and shows its command line and output.
///
/// # Errors
/// When the program cannot be started or fails.
pub(crate) fn run(program: &str, args: &[&str], envs: &[(&str, &str)]) -> Result<(), String> {
    let shown = show(program, args);
    eprintln!("\n$ {shown}");
    let status = Command::new(program)
        .args(args)
        .envs(envs.iter().copied())
        .current_dir(root())
        .status()
        .map_err(|e| format!("cannot run {program}: {e}"))?;
    if status.success() { Ok(()) } else { Err(format!("`{shown}` failed ({status})")) }
}

/// Runs a program in the root and returns its stdout.
///
/// # Errors
/// When the program cannot be started or fails.
pub(crate) fn output(program: &str, args: &[&str]) -> Result<String, String> {
    let output = Command::new(program)
        .args(args)
        .current_dir(root())
        .stderr(Stdio::inherit())
        .output()
        .map_err(|e| format!("cannot run {program}: {e}"))?;
    if !output.status.success() {
        return Err(format!("`{}` failed ({})", show(program, args), output.status));
    }
    String::from_utf8(output.stdout).map_err(|e| format!("{program} printed text that is not UTF-8: {e}"))
}

fn show(program: &str, args: &[&str]) -> String {
    std::iter::once(program).chain(args.iter().copied()).collect::<Vec<_>>().join(" ")
}
