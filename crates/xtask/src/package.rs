//! The npm package: packs it, installs it into a blank project, and tests it there in Node and in a browser.

use std::path::Path;

use serde_json::Value;

use crate::command::{output, root, run};
use crate::licences;
use crate::npm::{self, exec};
use crate::wasm::{self, target_folder};

/// Folder for the licences of everything compiled into the package; ignored by git.
const NOTICES: &str = "web/package/licences";
/// Folders whose files are copied into the blank project, each with the folder to copy to.
const COPIED_FOLDERS: [(&str, &str); 3] = [
    ("web/package/examples", ""),
    ("web/package/examples/stackblitz", "stackblitz"),
    ("web/package/test", ""),
];

/// Tests the package. Needs the wasm of a page build, and the command built by `cargo test` for comparisons.
///
/// # Errors
/// When a step fails.
pub(crate) fn test() -> Result<(), String> {
    let tarball = pack()?;
    let project = blank_project(&tarball)?;
    let command = path(&target_folder()?.join("debug/cagework"))?;
    let envs = [("NPM_PROJECT", project.as_str()), ("CAGEWORK_COMMAND", &command)];
    for module in ["nodenext", "esnext"] {
        let resolution = if module == "esnext" { "bundler" } else { module };
        let strict = ["--noEmit", "--strict", "--skipLibCheck", "false", "--target", "es2023", "--types", ""];
        let as_users = ["--module", module, "--moduleResolution", resolution];
        exec(&[&["tsc"], &strict[..], &as_users, &[&format!("{project}/consumer.ts")]].concat())?;
    }
    // Build the test pages as a user's bundler would.
    let vite = ["vite", "build", "--config", "web/package/test/vite.config.ts", "--logLevel", "error"];
    run("npx", &[&["--no-install"], &vite[..]].concat(), &envs)?;
    let playwright = ["playwright", "test", "--config", "web/package/playwright.config.ts"];
    run("npx", &[&["--no-install"], &playwright[..]].concat(), &envs)?;
    run("node", &["--test", "--test-reporter", "spec", &format!("{project}/node.test.mjs")], &envs)
}

/// Builds the package and packs it into `target/npm`; returns the archive.
///
/// # Errors
/// When a step fails.
pub(crate) fn pack() -> Result<String, String> {
    npm::install()?;
    wasm::ensure()?;
    run("node", &["web/package/build.mjs"], &[])?;
    let notices = root().join(NOTICES);
    emptied(&notices)?;
    licences::of_package(&notices)?;
    for ours in ["LICENSE-MIT", "LICENSE-APACHE"] {
        copy(&root().join(ours), &notices.join(ours))?;
    }
    let folder = target_folder()?.join("npm");
    emptied(&folder)?;
    let folder = path(&folder)?;
    let name = output("npm", &["pack", "./web/package", "--silent", "--pack-destination", &folder])?;
    let tarball = format!("{folder}/{}", name.trim());
    let size = std::fs::metadata(&tarball).map_err(|e| format!("cannot find {tarball}: {e}"))?.len();
    println!("{tarball}: {} kB", size / 1000);
    Ok(tarball)
}

/// Makes a project that depends on the package and three.js only; returns its folder.
fn blank_project(tarball: &str) -> Result<String, String> {
    let folder = target_folder()?.join("npm/project");
    emptied(&folder)?;
    std::fs::write(folder.join("package.json"), "{ \"private\": true, \"type\": \"module\" }\n")
        .map_err(|e| format!("cannot write package.json: {e}"))?;
    let project = path(&folder)?;
    // Install the locked versions, because npm has them in its cache and needs no network for them.
    let lock = read(&root().join("package-lock.json"))?;
    let lock: Value = serde_json::from_str(&lock).map_err(|e| format!("package-lock.json: {e}"))?;
    let locked = |name: &str| {
        let version = lock["packages"][format!("node_modules/{name}")]["version"].as_str();
        version.map(|version| format!("{name}@{version}")).ok_or(format!("{name} is not locked"))
    };
    let (three, types) = (locked("three")?, locked("@types/three")?);
    let quiet = ["--prefer-offline", "--no-audit", "--no-fund", "--ignore-scripts"];
    run("npm", &[&["install", "--prefix", &project], &quiet[..], &[tarball, &three, &types]].concat(), &[])?;
    for (from, to) in COPIED_FOLDERS {
        let (from, to) = (root().join(from), folder.join(to));
        std::fs::create_dir_all(&to).map_err(|e| format!("cannot create {}: {e}", to.display()))?;
        let entries = from.read_dir().map_err(|e| format!("cannot read {}: {e}", from.display()))?;
        for file in entries.flatten().filter(|entry| entry.path().is_file()) {
            copy(&file.path(), &to.join(file.file_name()))?;
        }
    }
    Ok(project)
}

fn emptied(folder: &Path) -> Result<(), String> {
    if folder.exists() {
        std::fs::remove_dir_all(folder).map_err(|e| format!("cannot remove {}: {e}", folder.display()))?;
    }
    std::fs::create_dir_all(folder).map_err(|e| format!("cannot create {}: {e}", folder.display()))
}

fn copy(from: &Path, to: &Path) -> Result<(), String> {
    std::fs::copy(from, to).map(drop).map_err(|e| format!("cannot copy {}: {e}", from.display()))
}

fn read(path: &Path) -> Result<String, String> {
    std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))
}

fn path(path: &Path) -> Result<String, String> {
    path.to_str().map(str::to_owned).ok_or_else(|| "the repository's path is not UTF-8".to_owned())
}
