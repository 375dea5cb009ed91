//! The tasks themselves: each does its own set-up.

use crate::command::{root, run};
use crate::npm::{self, exec};
use crate::{arrows, deny, licences, package, prose, python, site, wasm};

/// Builds the release command and runs it on its built-in sample.
pub(crate) fn demo(args: &[&str]) -> Result<(), String> {
    let fixed = ["run", "--quiet", "--release", "--locked", "--package", "cagework-cli", "--", "demo"];
    run("cargo", &[&fixed[..], args].concat(), &[])
}

/// Builds the page, and the release command (`target/release/cagework`).
pub(crate) fn build() -> Result<(), String> {
    site::build()?;
    run("cargo", &["build", "--release", "--locked", "--package", "cagework-cli"], &[])?;
    licences::of_command(&wasm::target_folder()?.join("release"))
}

/// What is tested, and built with the same features each time. Benches have no tests, and criterion takes half a minute; what
/// this crate needs has been built with its own features.
const TESTED: [&str; 5] = ["--workspace", "--exclude", "cagework-benches", "--exclude", "xtask"];

/// Everything that can fail because the program is wrong.
pub(crate) fn test() -> Result<(), String> {
    npm::install()?;
    run("cargo", &["test", "--locked", "--package", "xtask"], &[])?;
    run("cargo", &[&["test", "--locked"], &TESTED[..]].concat(), &[])?;
    // The same inputs in each run; `cargo xtask fuzz` alone takes others each time.
    fuzz(&["--minutes", "0.1", "--seed", "1"])?;
    validate_exports()?;
    python::test()?;
    site::test_scripts()?;
    site::test_page(&[])?;
    site::test_firefox()?;
    package::test()
}

/// Damaged files through everything that reads them. As tests are built: overflows and debug assertions count.
pub(crate) fn fuzz(args: &[&str]) -> Result<(), String> {
    // The workspace's features, as `cargo test` has built them.
    run(
        "cargo",
        &[&["test", "--quiet", "--locked"], &TESTED[..], &["--test", "fuzz", "--"], args].concat(),
        &[],
    )
}

/// Everything that can fail because the source is untidy.
pub(crate) fn check() -> Result<(), String> {
    npm::install()?;
    run("cargo", &["fmt", "--all", "--check"], &[])?;
    run("cargo", &["clippy", "--workspace", "--all-targets", "--locked", "--", "-D", "warnings"], &[])?;
    // Not among all targets, because `cargo test` leaves it to [`fuzz`].
    let fuzz = ["clippy", "--workspace", "--test", "fuzz", "--locked", "--", "-D", "warnings"];
    run("cargo", &fuzz, &[])?;
    run("cargo", &["doc", "--workspace", "--no-deps", "--locked"], &[("RUSTDOCFLAGS", "-D warnings")])?;
    arrows::check()?;
    prose::check()?;
    deny::check()?;
    one_version()?;
    // Names what a package lacks; `cargo publish --dry-run` builds them as well, once before a release.
    let mut package = vec!["package", "--quiet", "--no-verify", "--allow-dirty", "--locked"];
    for name in ["cagework-core", "cagework-cage", "cagework-pose", "cagework-io", "cagework-gpu"] {
        package.extend(["-p", name]);
    }
    run("cargo", &package, &[])?;
    site::check_types()?;
    exec(&["biome", "ci", "--error-on-warnings"])
}

/// Packages have the version of the workspace.
fn one_version() -> Result<(), String> {
    let own = concat!("\"version\": \"", env!("CARGO_PKG_VERSION"), "\"");
    for path in ["package.json", "web/package/package.json"] {
        let text = std::fs::read_to_string(root().join(path)).map_err(|e| format!("{path}: {e}"))?;
        if !text.contains(own) {
            return Err(format!("{path} must say {own}, as Cargo.toml does"));
        }
    }
    Ok(())
}

/// Exported GLBs must pass the Khronos glTF validator, and play in three.js as they do here.
fn validate_exports() -> Result<(), String> {
    let folder = root().join("target/exported-samples");
    let folder = folder.to_str().ok_or("the repository's path is not UTF-8")?;
    std::fs::create_dir_all(folder).map_err(|e| format!("cannot create {folder}: {e}"))?;
    // Built with the workspace's features, as `cargo test` has done already; `cargo run` would build with its package's.
    run(
        "cargo",
        &[&["build", "--quiet", "--locked"], &TESTED[..], &["--example", "export_samples"]].concat(),
        &[],
    )?;
    let export = wasm::target_folder()?.join("debug/examples/export_samples");
    run(export.to_str().ok_or("the target folder's path is not UTF-8")?, &[folder], &[])?;
    run("node", &["crates/cagework-io/tests/validate.mjs", folder], &[])?;
    // What plays a clip here must be what others show.
    run("node", &["crates/cagework-io/tests/three.mjs", folder], &[])
}
