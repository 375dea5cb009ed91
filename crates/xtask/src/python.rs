//! The Python package: tests it in a blank environment, and builds its wheel.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::{Path, PathBuf};

use crate::command::{output, root, run};
use crate::licences;
use crate::npm;
use crate::wasm::{self, target_folder};

const PACKAGE: &str = "crates/cagework-py";
/// Folder for the licences of everything compiled into the wheel; ignored by git.
const NOTICES: &str = "crates/cagework-py/python/cagework/licences";
/// Arguments of Python that install packages. `--no-compile`: compiling all of SciPy would double the time of the
/// installation, and Python compiles each module when it is first imported.
const INSTALL: [&str; 6] = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-compile"];

/// Tests the package. Needs the command and the native module as [`crate::tasks::build_tests`] builds them. maturin
/// would build the module with other features, which compiles 43 crates again: four minutes of processor time. `args`
/// are passed to pytest.
///
/// # Errors
/// When a step fails.
pub(crate) fn test(args: &[&str]) -> Result<(), String> {
    let python = environment()?;
    install_built(&python)?;
    let command = path(target_folder()?.join("debug/cagework"))?;
    let tests = format!("{PACKAGE}/tests");
    run(&python, &[&["-m", "pytest", &tests], args].concat(), &[("CAGEWORK_COMMAND", &command)])?;
    // The types are also checked by mypy, which one of the tests above runs.
    npm::install()?;
    npm::exec(&["pyright", "--pythonpath", &python, &format!("{PACKAGE}/tests/typed.py")])
}

/// Copies the package and its native module into a virtual environment.
fn install_built(python: &str) -> Result<(), String> {
    let site = output(python, &["-c", "import sysconfig; print(sysconfig.get_path('platlib'))"])?;
    let package = Path::new(site.trim()).join("cagework");
    let fault = |e: std::io::Error| format!("cannot copy the package to {}: {e}", package.display());
    std::fs::create_dir_all(&package).map_err(fault)?;
    for file in std::fs::read_dir(root().join(PACKAGE).join("python/cagework")).map_err(fault)? {
        let file = file.map_err(fault)?.path();
        if let Some(name) = file.file_name().filter(|_| file.is_file()) {
            std::fs::copy(&file, package.join(name)).map_err(fault)?;
        }
    }
    let module = format!("debug/{DLL_PREFIX}cagework_py{DLL_SUFFIX}");
    let name = if cfg!(windows) { "_native.pyd" } else { "_native.abi3.so" };
    std::fs::copy(target_folder()?.join(module), package.join(name)).map_err(fault)?;
    Ok(())
}

/// Folder of the Blender extension.
const BLENDER: &str = "crates/cagework-py/blender";
/// Blender as a Python package. Each version of Blender needs a particular version of Python; 4.5 needs Python 3.11.
const BPY: &str = "bpy==4.5.*";

/// Tests the Blender extension, in an environment with Blender as a Python package (400 MB to download).
///
/// # Errors
/// When a step fails.
pub(crate) fn test_blender() -> Result<(), String> {
    let wheel = only_file(&build(&environment()?, &["--release", "--auditwheel", "skip"])?)?;
    let python = blank("blender")?;
    // Do not install the wheel's dependencies: Blender has NumPy, but no SciPy.
    run(&python, &[&INSTALL[..], &[BPY, "pytest"]].concat(), &[])?;
    run(&python, &[&INSTALL[..], &["--no-deps", &wheel]].concat(), &[])?;
    let out = target_folder()?.join("blender-extension");
    empty(&out)?;
    let out = path(out)?;
    run(&python, &[&format!("{BLENDER}/build.py"), &wheel, &out], &[])?;
    run(&python, &["-m", "pytest", "-q", BLENDER], &[("CAGEWORK_EXTENSION", &only_file(&out)?)])
}

/// Folder of the notebook widget, the Python package cagework-notebook.
const NOTEBOOK: &str = "crates/cagework-py/notebook";
/// Folder in [`NOTEBOOK`] for the widget's script and wasm; ignored by git.
const FILES: &str = "crates/cagework-py/notebook/cagework_notebook/files";
/// Example notebooks.
const EXAMPLES: &str = "crates/cagework-py/notebooks";
/// Packages that the notebooks and their tests need.
const LAB: [&str; 10] = [
    "jupyterlab==4.*",
    "nbclient",
    "pytest",
    "anywidget",
    "scipy",
    "trimesh",
    "meshio",
    "rtree",
    "matplotlib",
    "distributed",
];

/// Tests the notebook widget in JupyterLab and executes the example notebooks, in an environment with JupyterLab.
///
/// # Errors
/// When a step fails.
pub(crate) fn test_notebooks() -> Result<(), String> {
    let widget = notebook_wheel()?;
    let wheel =
        only_file(&build(&environment()?, &["--profile", "dev", "--auditwheel", "skip", "--quiet"])?)?;
    let python = blank("notebooks")?;
    run(&python, &[&INSTALL[..], &LAB].concat(), &[])?;
    run(&python, &[&INSTALL[..], &["--no-deps", &wheel, &widget]].concat(), &[])?;
    run(&python, &["-m", "pytest", "-q", EXAMPLES], &[])?;
    let playwright = ["playwright", "test", "--config", "web/notebook/playwright.config.ts"];
    run("npx", &[&["--no-install"], &playwright[..]].concat(), &[("NOTEBOOK_PYTHON", &python)])
}

/// Builds the wheel of the notebook widget, which works on all systems; returns its path.
///
/// # Errors
/// When a step fails.
pub(crate) fn notebook_wheel() -> Result<String, String> {
    npm::install()?;
    wasm::ensure()?;
    npm::exec(&["vite", "build", "--config", "web/notebook/vite.config.ts", "--logLevel", "warn"])?;
    let files = root().join(FILES);
    let notices = files.join("licences");
    empty(&notices)?;
    licences::of_widget(&files, &notices)?;
    our_licences(&notices)?;
    let out = target_folder()?.join("notebook");
    empty(&out)?;
    let out = path(out)?;
    let python = blank("notebook-build")?;
    let pip = ["-m", "pip", "wheel", "--quiet", "--disable-pip-version-check", "--no-deps"];
    run(&python, &[&pip[..], &["--wheel-dir", &out, &format!("./{NOTEBOOK}")]].concat(), &[])?;
    only_file(&out)
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
    let python = blank("python")?;
    let needed = path(root().join(PACKAGE).join("requirements.txt"))?;
    let pinned = ["--require-hashes", "--only-binary", ":all:", "--requirement", &needed];
    run(&python, &[&INSTALL[..], &pinned].concat(), &[])?;
    Ok(python)
}

/// Makes an empty virtual environment in the target folder; returns its interpreter.
fn blank(name: &str) -> Result<String, String> {
    let folder = target_folder()?.join(name);
    run("python3", &["-m", "venv", "--clear", &path(folder.clone())?], &[])?;
    path(folder.join(if cfg!(windows) { "Scripts/python" } else { "bin/python" }))
}

/// Builds the wheel of [`PACKAGE`] into an emptied folder; returns the folder. `args` are passed to maturin.
fn build(python: &str, args: &[&str]) -> Result<String, String> {
    let wheels = target_folder()?.join("wheels");
    empty(&wheels)?;
    write_notices()?;
    let (manifest, wheels) = (path(root().join(PACKAGE).join("Cargo.toml"))?, path(wheels)?);
    let fixed = ["-m", "maturin", "build", "--locked", "--manifest-path", &manifest, "--out", &wheels];
    run(python, &[&fixed[..], args].concat(), &[])?;
    Ok(wheels)
}

/// Writes the licences of everything compiled into the wheel to [`NOTICES`], where maturin finds them.
///
/// # Errors
/// When a step fails.
pub(crate) fn write_notices() -> Result<(), String> {
    let notices = root().join(NOTICES);
    empty(&notices)?;
    licences::of_wheel(&notices)?;
    our_licences(&notices)
}

/// Copies the licences of this repository to a folder.
pub(crate) fn our_licences(to: &Path) -> Result<(), String> {
    for ours in ["LICENSE-MIT", "LICENSE-APACHE"] {
        std::fs::copy(root().join(ours), to.join(ours)).map_err(|e| format!("cannot copy {ours}: {e}"))?;
    }
    Ok(())
}

/// Makes a folder, or removes its contents.
pub(crate) fn empty(folder: &Path) -> Result<(), String> {
    if folder.exists() {
        std::fs::remove_dir_all(folder).map_err(|e| format!("cannot remove {}: {e}", folder.display()))?;
    }
    std::fs::create_dir_all(folder).map_err(|e| format!("cannot create {}: {e}", folder.display()))
}

/// Finds the only file in a folder.
fn only_file(folder: &str) -> Result<String, String> {
    let fault = || format!("there is no file in {folder}");
    let entry = std::fs::read_dir(folder).map_err(|e| format!("{folder}: {e}"))?.next().ok_or_else(fault)?;
    path(entry.map_err(|e| format!("{folder}: {e}"))?.path())
}

fn path(path: PathBuf) -> Result<String, String> {
    path.into_os_string().into_string().map_err(|_| "the repository's path is not UTF-8".to_owned())
}
