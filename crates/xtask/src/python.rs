//! The Python package: its wheel is built, installed into a blank environment, and tested there.

use std::path::Path;

use crate::command::{root, run};
use crate::wasm::target_folder;

const PACKAGE: &str = "crates/cagework-py";

/// Builds the wheel and runs its tests. `cargo test` has built the command that they compare with.
///
/// # Errors
/// When a step fails.
pub(crate) fn test() -> Result<(), String> {
    let target = target_folder()?;
    let [environment, wheels, command] =
        ["python", "wheels", "debug/cagework"].map(|name| target.join(name).display().to_string());
    // Of an earlier version: pip must find one wheel.
    if Path::new(&wheels).exists() {
        std::fs::remove_dir_all(&wheels).map_err(|e| format!("cannot remove {wheels}: {e}"))?;
    }
    run("python3", &["-m", "venv", "--clear", &environment], &[])?;
    let python = format!("{environment}/bin/python");
    let in_package = |name: &str| root().join(PACKAGE).join(name).display().to_string();
    let (pip, maturin) =
        (["-m", "pip", "install", "--quiet", "--disable-pip-version-check"], ["-m", "maturin", "build"]);
    let needed = in_package("requirements.txt");
    let pinned = ["--require-hashes", "--only-binary", ":all:", "--requirement", &needed];
    run(&python, &[&pip[..], &pinned].concat(), &[])?;
    let built = ["--profile", "dev", "--locked", "--auditwheel", "skip"];
    let manifest = in_package("Cargo.toml");
    let into = ["--quiet", "--manifest-path", &manifest, "--out", &wheels];
    run(&python, &[&maturin[..], &built, &into].concat(), &[])?;
    let wheel = ["--no-index", "--no-deps", "--find-links", &wheels, "cagework"];
    run(&python, &[&pip[..], &wheel].concat(), &[])?;
    run(&python, &["-m", "pytest", PACKAGE], &[("CAGEWORK_COMMAND", &command)])
}
