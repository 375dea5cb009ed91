//! Installs the npm packages of the lock file, and runs programs from node_modules.

use crate::command::{root, run};

/// Installs the dependencies of package-lock.json, unless they are installed.
///
/// # Errors
/// When npm fails.
pub(crate) fn install() -> Result<(), String> {
    let root = root();
    let modified = |path: &str| root.join(path).metadata().and_then(|m| m.modified()).ok();
    // npm writes this file last. If it is older than the lock file, the installation is outdated.
    let installed = modified("node_modules/.package-lock.json");
    if installed.is_some() && installed >= modified("package-lock.json") {
        return Ok(());
    }
    println!("setup: installing npm dependencies");
    // Not `npm ci`, which fails if the registry lacks the optional packages of other platforms. With --no-save, npm
    // installs the locked versions and does not change the lock file.
    run("npm", &["install", "--no-save", "--no-audit", "--no-fund"], &[])
}

/// Runs a program from node_modules. `args`: the name of the program, then its arguments.
///
/// # Errors
/// When the program fails.
pub(crate) fn exec(args: &[&str]) -> Result<(), String> {
    run("npx", &[&["--no-install"], args].concat(), &[])
}
