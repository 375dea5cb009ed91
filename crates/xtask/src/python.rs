//! The Python package: builds its wheel, installs it into a blank environment, and tests it there.

use std::path::PathBuf;

use crate::command::{root, run};
use crate::licences;
use crate::wasm::target_folder;

const PACKAGE: &str = "crates/cagework-py";
/// Folder for the licences of everything compiled into the wheel; ignored by git.
const NOTICES: &str = "crates/cagework-py/python/cagework/licences";
/// Arguments of Python that install packages. `--no-compile`: compiling all of SciPy would double the time of the
/// installation, and Python compiles each module when it is first imported.
const INSTALL: [&str; 6] = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-compile"];

/// Tests the wheel. Needs the command built by `cargo test` for comparisons.
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

/// Builds the release wheel for distribution, into `target/wheels`. `args` are passed to maturin.
///
/// # Errors
/// When a step fails.
pub(crate) fn wheel(args: &[&str]) -> Result<(), String> {
    build(&environment()?, &[&["--release"], args].concat()).map(drop)
}

/// Makes a virtual environment with the tools that build and test the package; returns its interpreter.
fn environment() -> Result<String, String> {
    let folder = target_folder()?.join("python");
    run("python3", &["-m", "venv", "--clear", &path(folder.clone())?], &[])?;
    let python = path(folder.join(if cfg!(windows) { "Scripts/python" } else { "bin/python" }))?;
    let needed = path(root().join(PACKAGE).join("requirements.txt"))?;
    let pinned = ["--require-hashes", "--only-binary", ":all:", "--requirement", &needed];
    run(&python, &[&INSTALL[..], &pinned].concat(), &[])?;
    Ok(python)
}

/// Builds the wheel into an emptied folder; returns the folder.
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
