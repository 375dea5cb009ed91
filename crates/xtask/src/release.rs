//! Releases: one version and one address in all manifests, and the archives of the command.

use std::fs;

use crate::command::{output, root, run};
use crate::licences;
use crate::python::{empty, our_licences};
use crate::wasm::target_folder;

const VERSION: &str = env!("CARGO_PKG_VERSION");
const REPOSITORY: &str = env!("CARGO_PKG_REPOSITORY");
const HOMEPAGE: &str = env!("CARGO_PKG_HOMEPAGE");
const MIN_RUST: &str = env!("CARGO_PKG_RUST_VERSION");

/// Texts that files outside the Cargo workspace contain: the version and the addresses of `Cargo.toml`, and its minimum
/// Rust version, with which everything is built and tested.
fn expected() -> [(&'static str, Vec<String>); 10] {
    let quoted = |key: &str| format!("{key} = \"{VERSION}\"");
    let json = format!("\"version\": \"{VERSION}\"");
    let link = vec![format!("{REPOSITORY}/blob/main/docs/")];
    let urls = [REPOSITORY, HOMEPAGE].map(|url| format!("\"{url}\""));
    [
        ("rust-toolchain.toml", vec![format!("channel = \"{MIN_RUST}.0\"")]),
        ("package.json", vec![json.clone()]),
        ("web/package/package.json", vec![json, format!("\"git+{REPOSITORY}.git\""), urls[1].clone()]),
        ("web/package/README.md", link.clone()),
        ("crates/cagework-py/README.md", link),
        ("crates/cagework-py/pyproject.toml", urls.to_vec()),
        (
            "crates/cagework-py/notebook/pyproject.toml",
            [&urls[..], &[quoted("version"), format!("\"cagework>={VERSION}\"")]].concat(),
        ),
        ("crates/cagework-py/notebook/cagework_notebook/__init__.py", vec![quoted("__version__")]),
        ("crates/cagework-py/blender/blender_manifest.toml", vec![quoted("version"), urls[0].clone()]),
        (
            "CITATION.cff",
            vec![
                format!("version: {VERSION}"),
                format!("repository-code: {REPOSITORY}"),
                format!("url: {HOMEPAGE}"),
            ],
        ),
    ]
}

/// Checks that manifests, citation and packed READMEs have the version and the addresses of `Cargo.toml`.
///
/// # Errors
/// Names the first file that differs.
pub(crate) fn check_manifests() -> Result<(), String> {
    for (path, texts) in expected() {
        let manifest = read(path)?;
        if let Some(text) = texts.iter().find(|text| !manifest.contains(*text)) {
            return Err(format!("{path} must say {text}, as Cargo.toml does"));
        }
    }
    Ok(())
}

/// Checks that a release may be made from this commit as `tag`: manifests, changelog and citation have its version, and
/// the address is that of the repository in which a workflow runs.
///
/// # Errors
/// Names what differs.
pub(crate) fn check(tag: &str) -> Result<(), String> {
    check_manifests()?;
    if tag.strip_prefix('v') != Some(VERSION) {
        return Err(format!("the tag is {tag}, and Cargo.toml has version {VERSION}: expected v{VERSION}"));
    }
    let changelog = read("CHANGELOG.md")?;
    let heading = format!("## [{VERSION}] - ");
    let date = changelog.lines().find_map(|line| line.strip_prefix(&heading));
    let date = date.ok_or(format!("CHANGELOG.md has no heading {heading}and a date"))?;
    if !is_date(date) {
        return Err(format!("CHANGELOG.md says {heading}{date}: expected a date such as 2026-11-30"));
    }
    let released = format!("date-released: {date}");
    if !read("CITATION.cff")?.lines().any(|line| line == released) {
        return Err(format!("CITATION.cff must say {released}, as CHANGELOG.md does"));
    }
    match std::env::var("GITHUB_REPOSITORY") {
        Ok(name) if REPOSITORY != format!("https://github.com/{name}") => {
            Err(format!("Cargo.toml has the repository {REPOSITORY}, and this is https://github.com/{name}"))
        }
        _ => Ok(()),
    }
}

/// Whether a text has the form of 2026-11-30.
fn is_date(text: &str) -> bool {
    text.len() == 10
        && text
            .bytes()
            .enumerate()
            .all(|(k, b)| if k == 4 || k == 7 { b == b'-' } else { b.is_ascii_digit() })
}

/// Builds the release `cagework` for a target, by default this machine, and packs it with its licences into
/// `target/archives`: a tar archive, which keeps the permission to run, or a zip for Windows. Returns the archive.
///
/// # Errors
/// When a step fails.
pub(crate) fn archive(target: Option<&str>) -> Result<String, String> {
    let host = licences::host()?;
    let name = target.unwrap_or(&host);
    let mut build = vec!["build", "--release", "--locked", "--package", "cagework-cli"];
    build.extend(target.iter().flat_map(|target| ["--target", target]));
    run("cargo", &build, &[])?;
    let out = target_folder()?;
    let program = if name.contains("windows") { "cagework.exe" } else { "cagework" };
    let built = target.map_or(out.clone(), |target| out.join(target)).join("release").join(program);
    let packed = format!("cagework-{VERSION}-{name}");
    let archives = out.join("archives");
    let folder = archives.join(&packed);
    empty(&folder)?;
    licences::of_command(&folder, name)?;
    our_licences(&folder)?;
    // A program for another processor cannot write these here, and they are the same for all.
    let packed_folder = folder.to_str().ok_or("the repository's path is not UTF-8")?;
    let shell_files =
        ["run", "--quiet", "--release", "--locked", "--package", "cagework-cli", "--", "shell-files"];
    run("cargo", &[&shell_files[..], &[packed_folder]].concat(), &[])?;
    for (from, to) in [(built, program), (root().join("docs/cli.md"), "cli.md")] {
        fs::copy(&from, folder.join(to)).map_err(|e| format!("cannot copy {}: {e}", from.display()))?;
    }
    let archives = archives.to_str().ok_or("the repository's path is not UTF-8")?;
    let is_zip = name.contains("windows");
    let archive = format!("{archives}/{packed}.{}", if is_zip { "zip" } else { "tar.gz" });
    // The tar of Windows also writes zips, by the ending of the archive.
    let kind = if is_zip { "-acf" } else { "-czf" };
    output("tar", &[kind, &archive, "-C", archives, &packed])?;
    Ok(archive)
}

fn read(path: &str) -> Result<String, String> {
    fs::read_to_string(root().join(path)).map_err(|e| format!("{path}: {e}"))
}
