//! The tasks of the repository. Each task installs what it needs.

use std::process::Command;
use std::time::Instant;

use crate::command::{root, run};
use crate::npm::{self, exec};
use crate::parts::{self, part};
use crate::{advisories, arrows, deny, licences, package, python, release, site, wasm};

/// Builds the `cagework` command in release mode and runs it on its built-in sample.
pub(crate) fn demo(args: &[&str]) -> Result<(), String> {
    let fixed = ["run", "--quiet", "--release", "--locked", "--package", "cagework-cli", "--", "demo"];
    run("cargo", &[&fixed[..], args].concat(), &[])
}

/// Builds the page, and the `cagework` command in release mode (`target/release/cagework`).
pub(crate) fn build() -> Result<(), String> {
    site::build()?;
    run("cargo", &["build", "--release", "--locked", "--package", "cagework-cli"], &[])?;
    licences::of_command(&wasm::target_folder()?.join("release"), &licences::host()?)
}

/// Arguments of Cargo that select the packages of all test builds. They are always the same, so that builds share
/// features and artifacts. Benches have no tests but need criterion, which takes half a minute to build; xtask has
/// other features.
const TEST_PACKAGES: [&str; 5] = ["--workspace", "--exclude", "cagework-benches", "--exclude", "xtask"];

/// How many of the tests run.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Tier {
    /// The Rust and TypeScript tests, and one story per step of the page in Chromium: what a change needs.
    Change,
    /// Also the other tests of the page, Firefox, the packages, damaged files and exported files.
    All,
}

/// Marks the tests of the page that belong to [`Tier::Change`].
const STORY: &str = "@story";

/// Runs the tests of a tier. Prints a table of them.
pub(crate) fn test(tier: Tier) -> Result<(), String> {
    let began = Instant::now();
    parts::begin()?;
    npm::install()?;
    let outcome = test_parts(tier);
    parts::end(began.elapsed()).and(outcome)
}

/// Runs what takes longest: the Blender extension, the notebooks, the evaluation, and two and a half hours of damaged files.
pub(crate) fn test_long() -> Result<(), String> {
    let began = Instant::now();
    parts::begin()?;
    part("Blender extension", "cargo xtask blender", python::test_blender)?;
    part("notebooks", "cargo xtask notebooks", python::test_notebooks)?;
    let evaluation = ["test", "--locked", "--package", "cagework-benches", "--bin", "evaluate"];
    part("evaluation", &format!("cargo {}", evaluation.join(" ")), || run("cargo", &evaluation, &[]))?;
    part("build of the page", "cargo xtask page", site::build)?;
    for (name, args) in
        [("damaged files", ["--minutes", "120"]), ("damaged files on the page", ["--page", "30"])]
    {
        part(name, &format!("cargo xtask fuzz {}", args.join(" ")), || fuzz(&args))?;
    }
    parts::end(began.elapsed())
}

fn test_parts(tier: Tier) -> Result<(), String> {
    let (task, build): (_, fn() -> _) = match tier {
        Tier::Change => ("test-scripts-beside", build_rust_tests),
        Tier::All => ("test-beside", build_tests),
    };
    if !part("build of the Rust tests", "cargo test --no-run", build)? {
        return Ok(());
    }
    // Run two tasks in parallel, because most Rust tests leave one of two cores idle.
    beside(task, || {
        let own = ["test", "--locked", "--package", "xtask"];
        part("tasks of the repository", &format!("cargo {}", own.join(" ")), || run("cargo", &own, &[]))?;
        let rust = [&["test", "--locked", "--no-fail-fast"], &TEST_PACKAGES[..]].concat();
        part("Rust", &format!("cargo {}", rust.join(" ")), || run("cargo", &rust, &[]))?;
        if tier == Tier::Change {
            return Ok(());
        }
        // A fixed seed gives the same inputs in each run; `cargo xtask fuzz` alone uses new ones each time.
        let fixed = ["--minutes", "0.1", "--seed", "1"];
        part("damaged files", &format!("cargo xtask fuzz {}", fixed.join(" ")), || fuzz(&fixed))?;
        part("exported files", "cargo xtask exports", validate_exports).map(drop)
    })?;
    let (name, args): (_, &[&str]) = match tier {
        Tier::Change => ("stories of the page", &["--grep", STORY]),
        Tier::All => ("page in Chromium", &[]),
    };
    part(name, "cargo xtask page-test --last-failed", || site::test_built_page(args)).map(drop)
}

/// Builds the Rust tests and the programs that they run.
fn build_rust_tests() -> Result<(), String> {
    run("cargo", &[&["test", "--locked", "--no-run"], &TEST_PACKAGES[..]].concat(), &[])
}

/// Builds the Rust tests, what they run, and the native module of the Python package.
pub(crate) fn build_tests() -> Result<(), String> {
    build_rust_tests()?;
    // `cargo test` omits the native module, which has no Rust tests. The example needs the features of the tests, which
    // therefore apply to the whole build.
    let native = ["--lib", "--example", "export_samples"];
    run("cargo", &[&["build", "--quiet", "--locked"], &TEST_PACKAGES[..], &native].concat(), &[])
}

/// Checks what [`check()`] checks, except benches, xtask and documentation, while it builds the tests. `.ci/run` sets
/// clippy as the compiler and makes warnings errors; clippy on its own would check all dependencies in addition to
/// building them. `.ci/rustdoc` checks the documentation when the tests run.
pub(crate) fn check_and_build() -> Result<(), String> {
    npm::install()?;
    run("cargo", &["fmt", "--all", "--check"], &[])?;
    beside("check-scripts", || {
        build_tests()?;
        check_files()
    })
}

/// Runs what [`test()`] runs in parallel with the Rust tests, after these have been built.
///
/// # Errors
/// When the page cannot be built. Failed tests are only noted, see [`part`].
pub(crate) fn test_beside(tier: Tier) -> Result<(), String> {
    if tier == Tier::All {
        part("Python package", "cargo xtask python --last-failed", || python::test(&[]))?;
    }
    part("TypeScript", "cargo xtask scripts", || site::test_scripts(&[]))?;
    if !part("build of the page", "cargo xtask page", site::build)? {
        return Err("there is no page to test".to_owned());
    }
    if tier == Tier::Change {
        return Ok(());
    }
    part("page in Firefox", "cargo xtask firefox", site::test_firefox)?;
    part("npm package", "cargo xtask npm", package::test).map(drop)
}

/// Runs all file readers on damaged files. The readers are built with overflow checks and debug assertions.
pub(crate) fn fuzz(args: &[&str]) -> Result<(), String> {
    // Built with the features of `cargo test`, so that no dependency is built again.
    run(
        "cargo",
        &[&["test", "--quiet", "--locked"], &TEST_PACKAGES[..], &["--test", "fuzz", "--"], args].concat(),
        &[],
    )
}

/// Checks formatting, lints, documentation, packaging and types.
pub(crate) fn check() -> Result<(), String> {
    npm::install()?;
    run("cargo", &["fmt", "--all", "--check"], &[])?;
    beside("check-scripts", check_rust)
}

/// The TypeScript part of [`check`]. Runs in parallel with the Rust part, because it first builds the wasm, whose last
/// crates are compiled one at a time on one core.
pub(crate) fn check_scripts() -> Result<(), String> {
    site::check_types()?;
    exec(&["biome", "ci", "--error-on-warnings"])
}

fn check_rust() -> Result<(), String> {
    run("cargo", &["clippy", "--workspace", "--all-targets", "--locked", "--", "-D", "warnings"], &[])?;
    // `--all-targets` omits this test, since its manifest sets `test = false`.
    let fuzz = ["clippy", "--workspace", "--test", "fuzz", "--locked", "--", "-D", "warnings"];
    run("cargo", &fuzz, &[])?;
    run("cargo", &["doc", "--workspace", "--no-deps", "--locked"], &[("RUSTDOCFLAGS", "-D warnings")])?;
    check_files()
}

/// Checks dependencies, versions and packaging, without compiling anything.
fn check_files() -> Result<(), String> {
    arrows::check()?;
    deny::check()?;
    advisories::check()?;
    release::check_manifests()?;
    // Packs every crate that does not say `publish = false`. Fails if one lacks metadata or files, or depends on a
    // crate that is not published. Building the packages is left to the same command before a release.
    let package =
        ["publish", "--workspace", "--dry-run", "--quiet", "--no-verify", "--allow-dirty", "--locked"];
    run("cargo", &package, &[])
}

/// Checks that exported GLBs pass the Khronos glTF validator and play in three.js as in Cagework, and that three.js
/// reads captures.
pub(crate) fn validate_exports() -> Result<(), String> {
    let folder = root().join("target/exported-samples");
    let folder = folder.to_str().ok_or("the repository's path is not UTF-8")?;
    std::fs::create_dir_all(folder).map_err(|e| format!("cannot create {folder}: {e}"))?;
    let export = wasm::target_folder()?.join("debug/examples/export_samples");
    run(export.to_str().ok_or("the target folder's path is not UTF-8")?, &[folder], &[])?;
    run("node", &["crates/cagework-io/tests/validate.mjs", folder], &[])?;
    run("node", &["crates/cagework-io/tests/three.mjs", folder], &[])?;
    run("node", &["crates/cagework-io/tests/three-splats.mjs", &format!("{folder}/captures")], &[])
}

/// Runs a task of this program in parallel with `work`. If `work` succeeds, shows the task's output when it has ended.
///
/// # Errors
/// Returns the error of `work`, which also stops the task. Otherwise fails if the task fails.
fn beside(task: &str, work: impl FnOnce() -> Result<(), String>) -> Result<(), String> {
    let log = wasm::target_folder()?.join(format!("{task}.log"));
    let fault = |e: std::io::Error| format!("cannot run `xtask {task}`: {e}");
    let file = std::fs::File::create(&log).map_err(fault)?;
    let program = std::env::current_exe().map_err(fault)?;
    let mut child = Command::new(program)
        .arg(task)
        .stdout(file.try_clone().map_err(fault)?)
        .stderr(file)
        .spawn()
        .map_err(fault)?;
    let outcome = work();
    if outcome.is_err() {
        // `kill` fails if the task has already ended. Processes that the task has started continue to run.
        child.kill().ok();
    }
    let status = child.wait().map_err(fault)?;
    outcome?;
    eprint!("\n$ xtask {task}\n{}", std::fs::read_to_string(&log).map_err(fault)?);
    if status.success() { Ok(()) } else { Err(format!("`xtask {task}` failed ({status})")) }
}
