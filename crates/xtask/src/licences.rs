//! Lists the licences of everything compiled into the page, the `cagework` command, the Python packages and the npm
//! package.
//!
//! `cargo tree` lists the crates, their sources in the registry contain the licence files, and Vite writes the licences
//! of the npm packages that it bundles. No other tool and no network is needed.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value;

use crate::command::{output, root};

/// First lines of the file of notices.
const HEAD: &str = include_str!("licences.txt");
/// Name of the file of notices that [`write()`] creates in each folder.
const NOTICES: &str = "licences.txt";
/// Name of the file with the licences of Rust's standard library.
const STANDARD_LIBRARY: &str = "rust-standard-library.html";
/// File in which Vite lists the npm packages of the page; see vite.config.ts. Workers bundle none.
const NPM_LICENCES: &str = "licences-npm.json";
/// Beginnings of the names of files that contain licences or required notices, in lower case.
const BEGINNINGS: [&str; 6] = ["licen", "copying", "copyright", "notice", "unlicense", "third"];

/// A third-party package, and the licence texts in its folder.
#[derive(Clone, Debug)]
struct Part {
    /// Name and version.
    name: String,
    /// Licence expression, as in the package's manifest.
    licence: String,
    authors: String,
    texts: Vec<String>,
}

/// Writes the notices of the page into `folder`, which contains the built page and Vite's list.
///
/// # Errors
/// Names the package whose licence is not known.
pub(crate) fn of_page(folder: &Path) -> Result<(), String> {
    write(folder, [of_wasm()?, of_bundle(folder)?].concat())
}

/// Lists the packages compiled into the wasm files.
fn of_wasm() -> Result<Vec<Part>, String> {
    let target = "wasm32-unknown-unknown";
    let mut parts = of_crates("cagework-web", target, &[])?;
    parts.extend(of_crates("cagework-fbx", target, &[])?);
    parts.extend(of_crates("cagework-web", target, &["--no-default-features", "--features", "webgl"])?);
    Ok(parts)
}

/// Lists the npm packages in Vite's list in `folder`, and deletes the list.
fn of_bundle(folder: &Path) -> Result<Vec<Part>, String> {
    let list = folder.join(NPM_LICENCES);
    let parts = of_npm_packages(&read(&list)?)?;
    std::fs::remove_file(&list).map_err(|e| format!("cannot remove {}: {e}", list.display()))?;
    Ok(parts)
}

/// Writes the notices of the `cagework` command for a target into `folder`.
///
/// # Errors
/// Names the package whose licence is not known.
pub(crate) fn of_command(folder: &Path, target: &str) -> Result<(), String> {
    write(folder, of_crates("cagework-cli", target, &[])?)
}

/// Writes the notices of the Python package into `folder`, which belongs to the package.
///
/// # Errors
/// Names the package whose licence is not known.
pub(crate) fn of_wheel(folder: &Path) -> Result<(), String> {
    write(folder, of_crates("cagework-py", &host()?, &[])?)
}

/// Writes the notices of the npm package into `folder`, which belongs to the package.
///
/// # Errors
/// Names the package whose licence is not known.
pub(crate) fn of_package(folder: &Path) -> Result<(), String> {
    write(folder, of_wasm()?)
}

/// Writes the notices of the notebook widget into `folder`. The folder `files` contains Vite's list of the npm
/// packages that the widget bundles.
///
/// # Errors
/// Names the package whose licence is not known.
pub(crate) fn of_widget(files: &Path, folder: &Path) -> Result<(), String> {
    write(folder, [of_wasm()?, of_bundle(files)?].concat())
}

/// Target of this machine's programs.
///
/// # Errors
/// When rustc does not name it.
pub(crate) fn host() -> Result<String, String> {
    let about = output("rustc", &["-vV"])?;
    about
        .lines()
        .find_map(|line| line.strip_prefix("host: "))
        .map(str::to_owned)
        .ok_or("rustc names no host".to_owned())
}

fn write(folder: &Path, parts: Vec<Part>) -> Result<(), String> {
    let save = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).map_err(|e| format!("cannot write {}: {e}", path.display()))
    };
    save(NOTICES, &notices(parts)?)?;
    let sysroot = output("rustc", &["--print", "sysroot"])?;
    save(STANDARD_LIBRARY, &read(&Path::new(sysroot.trim()).join("share/doc/rust/COPYRIGHT-library.html"))?)
}

/// Lists the third-party packages compiled into one of our packages for a target.
fn of_crates(package: &str, target: &str, features: &[&str]) -> Result<Vec<Part>, String> {
    let fixed =
        ["tree", "--locked", "--edges", "normal,no-proc-macro", "--prefix", "none", "--format", "{p}"];
    let tree =
        output("cargo", &[&fixed[..], &["--package", package, "--target", target], features].concat())?;
    let metadata = ["metadata", "--locked", "--format-version", "1", "--filter-platform", target];
    let metadata: Value = serde_json::from_str(&output("cargo", &metadata)?)
        .map_err(|e| format!("cargo metadata cannot be read: {e}"))?;
    let word = |of: &Value, key: &str| of[key].as_str().unwrap_or_default().to_owned();
    let mut parts = Vec::new();
    for found in metadata["packages"].as_array().into_iter().flatten() {
        let name = format!("{} v{}", word(found, "name"), word(found, "version"));
        // In the metadata, our packages have no `source`. In the tree, ` (*)` marks repeated packages.
        let is_ours = found["source"].is_null();
        if is_ours || !tree.lines().any(|line| line.trim_end_matches(" (*)") == name) {
            continue;
        }
        let manifest = word(found, "manifest_path");
        let folder = Path::new(&manifest).parent().ok_or("a manifest lies nowhere")?;
        let authors = found["authors"].as_array().into_iter().flatten().filter_map(Value::as_str);
        parts.push(Part {
            licence: word(found, "license"),
            authors: authors.collect::<Vec<_>>().join(", "),
            texts: texts_in(folder)?,
            name,
        });
    }
    Ok(parts)
}

/// Reads the licence files in a package's folder.
fn texts_in(folder: &Path) -> Result<Vec<String>, String> {
    let entries = folder.read_dir().map_err(|e| format!("cannot read {}: {e}", folder.display()))?;
    let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    paths.retain(|path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        path.is_file() && !name.ends_with(".rs") && BEGINNINGS.iter().any(|start| name.starts_with(start))
    });
    paths.sort();
    paths.iter().map(|path| read(path)).collect()
}

/// Reads a list in which Vite names the packages that it has bundled.
fn of_npm_packages(json: &str) -> Result<Vec<Part>, String> {
    let found: Vec<Value> =
        serde_json::from_str(json).map_err(|e| format!("{NPM_LICENCES} cannot be read: {e}"))?;
    let word = |of: &Value, key: &str| of[key].as_str().unwrap_or_default().to_owned();
    let part = |of: &Value| Part {
        name: format!("{} v{}", word(of, "name"), word(of, "version")),
        licence: word(of, "identifier"),
        authors: String::new(),
        texts: of["text"].as_str().map(str::to_owned).into_iter().collect(),
    };
    Ok(found.iter().map(part).collect())
}

/// Lists all packages with their licences, then each licence text once below the names of the packages that have it.
fn notices(parts: Vec<Part>) -> Result<String, String> {
    let mut licences: BTreeMap<String, String> = BTreeMap::new();
    let mut owners: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for mut part in parts {
        if part.texts.is_empty() {
            part.texts = vec![standard_text(&part)?];
        }
        if licences.insert(part.name.clone(), part.licence).is_none() {
            for text in part.texts {
                // Some texts have CRLF line endings.
                let text = text.replace("\r\n", "\n").trim().to_owned();
                owners.entry(text).or_default().push(part.name.clone());
            }
        }
    }
    let list: String = licences.iter().map(|(name, licence)| format!("{name}: {licence}\n")).collect();
    let mut texts: Vec<(Vec<String>, String)> =
        owners.into_iter().map(|(text, names)| (names, text)).collect();
    texts.sort();
    let texts: String = texts
        .iter()
        .map(|(names, text)| format!("\n{}\n{}\n\n{text}\n", "-".repeat(80), names.join(", ")))
        .collect();
    Ok(format!("{HEAD}{list}{texts}"))
}

/// Returns a licence text for a package without a licence file. Apache 2.0 has a fixed text; MIT has a line for the
/// authors.
fn standard_text(part: &Part) -> Result<String, String> {
    let Part { name, licence, authors, .. } = part;
    if licence.contains("Apache-2.0") {
        return read(&root().join("LICENSE-APACHE"));
    }
    if licence.split(|c: char| !c.is_alphanumeric()).any(|word| word == "MIT") {
        let holders = if authors.is_empty() { format!("the authors of {name}") } else { authors.clone() };
        let line = |line: &str| match line.starts_with("Copyright") {
            true => format!("Copyright (c) {holders}\n"),
            false => format!("{line}\n"),
        };
        return Ok(read(&root().join("LICENSE-MIT"))?.lines().map(line).collect());
    }
    Err(format!(
        "{name} ({licence:?}) comes without the text of its licence: see what it asks for, then crates/xtask/src/licences.rs"
    ))
}

fn read(path: &Path) -> Result<String, String> {
    let bytes = std::fs::read(path).map_err(|e| format!("cannot read {}: {e}", path.display()))?;
    // A few old licence files are in Latin-1.
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(name: &str, licence: &str, texts: &[&str]) -> Part {
        let texts = texts.iter().map(|&text| text.to_owned()).collect();
        Part { name: name.to_owned(), licence: licence.to_owned(), authors: "Ada".to_owned(), texts }
    }

    #[test]
    fn notices_list_every_package_and_each_text_once() {
        let twice = part("b v1", "ISC", &["keep this\r\nplease\n"]);
        let text =
            notices(vec![part("a v2", "ISC", &["keep this\nplease", "and this"]), twice.clone(), twice]);
        let text = text.unwrap();
        assert!(text.starts_with(HEAD) && text.contains("a v2: ISC\nb v1: ISC\n"));
        assert!(text.contains("a v2, b v1\n\nkeep this\nplease\n") && text.contains("a v2\n\nand this\n"));
        assert_eq!(text.matches("keep this").count(), 1);
    }

    #[test]
    fn a_missing_text_is_replaced_by_that_of_the_licence_with_the_authors() {
        let mit = notices(vec![part("a v1", "MIT", &[])]).unwrap();
        assert!(mit.contains("Copyright (c) Ada\n") && mit.contains("Permission is hereby granted"));
        let apache = notices(vec![part("a v1", "MIT OR Apache-2.0", &[])]).unwrap();
        assert!(apache.contains("Apache License") && !apache.contains("Ada"));
        let unknown = notices(vec![part("a v1", "EUPL-1.2", &[])]).unwrap_err();
        assert!(unknown.contains("a v1"), "{unknown}");
    }

    #[test]
    fn packages_compiled_into_the_command_are_listed_but_build_tools_are_not() {
        let host = host().unwrap();
        let names: Vec<String> =
            of_crates("cagework-cli", &host, &[]).unwrap().into_iter().map(|part| part.name).collect();
        let has = |name: &str| names.iter().any(|n| n.starts_with(&format!("{name} v")));
        assert!(has("wgpu") && has("glam") && has("clap"), "{names:?}");
        assert!(!has("syn") && !has("clap_derive") && !has("proptest") && !has("wasm-bindgen-cli-support"));
    }
}
