//! The Python package: its wheel, built, installed into a blank environment and tested there.

use std::path::PathBuf;

use crate::command::{root, run};
use crate::licences;
use crate::wasm::target_folder;

const PACKAGE: &str = "crates/cagework-py";
/// What is compiled into the wheel, for those who get it; ignored by git.
const NOTICES: &str = "crates/cagework-py/python/cagework/licences";
/// Modules are compiled when they are first imported: to compile all of SciPy takes as long as to install it.
const INSTALL: [&str; 6] = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-compile"];

/// Tests the wheel. `cargo test` has built the command that it is compared with.
///
/// # Errors
/// When a step fails.
pub(crate) fn test() -> Result<(), String> {
    let python = environment()?;
    let wheels = build(&python, &["--profile", "dev", "--auditwheel", "skip", "--quiet"])?;
    let from = ["--no-index", "--no-deps", "--find-links", &wheels, "cagework"];
    run(&python, &[&INSTALL[..], &from].concat(), &[])?;
    let command = path(target_folder()?.join("debug/cagework"))?;
    run(&python, &["-m", "pytest", PACKAGE], &[("CAGEWORK_COMMAND", &command)])
}

/// Builds the wheel to be given to others, into `target/wheels`. `args`: for maturin.
///
/// # Errors
/// When a step fails.
pub(crate) fn wheel(args: &[&str]) -> Result<(), String> {
    build(&environment()?, &[&["--release"], args].concat()).map(drop)
}

/// An empty environment of Python with what builds and tests the package; returns its interpreter.
fn environment() -> Result<String, String> {
    let folder = target_folder()?.join("python");
    run("python3", &["-m", "venv", "--clear", &path(folder.clone())?], &[])?;
    let python = path(folder.join(if cfg!(windows) { "Scripts/python" } else { "bin/python" }))?;
    let needed = path(root().join(PACKAGE).join("requirements.txt"))?;
    let pinned = ["--require-hashes", "--only-binary", ":all:", "--requirement", &needed];
    run(&python, &[&INSTALL[..], &pinned].concat(), &[])?;
    Ok(python)
}

/// Builds the wheel; returns its folder, where no other one is.
fn build(python: &str, args: &[&str]) -> Result<String, String> {
    let wheels = target_folder()?.join("wheels");
    let notices = root().join(NOTICES);
    for folder in [&wheels, &notices] {
        if folder.exists() {
            std::fs::remove_dir_all(folder)
                .map_err(|e| format!("cannot remove {}: {e}", folder.display()))?;
        }
        std::fs::create_dir_all(folder).map_err(|e| format!("cannot create {}: {e}", folder.display()))?;
    }
    licences::of_wheel(&notices)?;
    for ours in ["LICENSE-MIT", "LICENSE-APACHE"] {
        std::fs::copy(root().join(ours), notices.join(ours))
            .map_err(|e| format!("cannot copy {ours}: {e}"))?;
    }
    let (manifest, wheels) = (path(root().join(PACKAGE).join("Cargo.toml"))?, path(wheels)?);
    let fixed = ["-m", "maturin", "build", "--locked", "--manifest-path", &manifest, "--out", &wheels];
    run(python, &[&fixed[..], args].concat(), &[])?;
    Ok(wheels)
}

fn path(path: PathBuf) -> Result<String, String> {
    path.into_os_string().into_string().map_err(|_| "the repository's path is not UTF-8".to_owned())
}
