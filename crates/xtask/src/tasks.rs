//! The tasks themselves: each does its own set-up.

use crate::arrows;
use crate::command::{root, run};

/// Builds the release command and runs it on its built-in sample.
pub(crate) fn start(args: &[&str]) -> Result<(), String> {
    build()?;
    let fixed = ["run", "--quiet", "--release", "--locked", "--package", "cagework-cli", "--", "demo"];
    run("cargo", &[&fixed[..], args].concat(), &[])
}

/// Builds the release command.
pub(crate) fn build() -> Result<(), String> {
    run("cargo", &["build", "--release", "--locked", "--package", "cagework-cli"], &[])
}

/// Everything that can fail because the program is wrong.
pub(crate) fn test() -> Result<(), String> {
    install_node_modules()?;
    run("cargo", &["test", "--workspace", "--locked"], &[])?;
    // The browser's half: no threads, no file system, no surprises when the page arrives.
    let packages = ["--package", "cagework-core", "--package", "cagework-io", "--no-default-features"];
    let wasm = ["check", "--locked", "--target", "wasm32-unknown-unknown"];
    run("cargo", &[&wasm[..], &packages].concat(), &[])?;
    validate_exports()
}

/// Everything that can fail because the source is untidy.
pub(crate) fn check() -> Result<(), String> {
    install_node_modules()?;
    run("cargo", &["fmt", "--all", "--check"], &[])?;
    run("cargo", &["clippy", "--workspace", "--all-targets", "--locked", "--", "-D", "warnings"], &[])?;
    run("cargo", &["doc", "--workspace", "--no-deps", "--locked"], &[("RUSTDOCFLAGS", "-D warnings")])?;
    arrows::check()?;
    run("npx", &["--no-install", "biome", "ci", "--error-on-warnings"], &[])
}

/// Exported GLBs must pass the Khronos glTF validator.
fn validate_exports() -> Result<(), String> {
    let folder = root().join("target/exported-samples");
    let folder = folder.to_str().ok_or("the repository's path is not UTF-8")?;
    std::fs::create_dir_all(folder).map_err(|e| format!("cannot create {folder}: {e}"))?;
    let export =
        ["run", "--quiet", "--locked", "--package", "cagework-io", "--example", "export_samples", "--"];
    run("cargo", &[&export[..], &[folder]].concat(), &[])?;
    run("node", &["crates/cagework-io/tests/validate.mjs", folder], &[])
}

/// Installs the development dependencies that package-lock.json names, unless that has been done.
fn install_node_modules() -> Result<(), String> {
    let root = root();
    let modified = |path: &str| root.join(path).metadata().and_then(|m| m.modified()).ok();
    // npm writes this file last; an older one belongs to another lock file.
    let installed = modified("node_modules/.package-lock.json");
    if installed.is_some() && installed >= modified("package-lock.json") {
        return Ok(());
    }
    println!("setup: installing npm development dependencies");
    // Not `npm ci`, which fails where the registry lacks the optional packages of other platforms; --no-save leaves
    // the lock file alone, and what it names is what is installed.
    run("npm", &["install", "--no-save", "--no-audit", "--no-fund"], &[])
}
