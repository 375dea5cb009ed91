//! Compares the packages in `Cargo.lock` with the advisories of the RustSec database.
//!
//! `advisories.tsv` has identifiers and versions from the database (CC0, a few entries CC BY 4.0), so that the check
//! needs no network; the nightly workflow asks the database itself. `cargo xtask advisories FOLDER` writes the file from
//! a clone of <https://github.com/rustsec/advisory-db>.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use semver::{Version, VersionReq};
use serde_json::Value;

use crate::command::root;
use crate::deny::{list, metadata, rules};

/// An advisory of the RustSec database that was not withdrawn.
#[derive(Debug, PartialEq)]
struct Advisory {
    id: String,
    package: String,
    /// `vulnerability`, `unsound`, `unmaintained` or `notice`.
    kind: String,
    /// Versions that are not concerned: patched and unaffected ones.
    sound: Vec<VersionReq>,
}

impl Advisory {
    /// Reads the front matter of a file of the database. `None` if the advisory was withdrawn.
    fn read(text: &str) -> Result<Option<Self>, String> {
        let value = |key: &str| {
            let line = text.lines().find_map(|line| line.strip_prefix(key)?.trim().strip_prefix('='));
            line.map(|value| value.trim().trim_matches('"').to_owned())
        };
        if value("withdrawn").is_some() {
            return Ok(None);
        }
        let [id, package] = ["id", "package"].map(|key| value(key).ok_or(format!("no {key}")));
        let kind = value("informational").unwrap_or_else(|| "vulnerability".to_owned());
        let versions = ["\npatched", "\nunaffected"].map(|key| list(text, key).unwrap_or_default()).concat();
        Ok(Some(Self { id: id?, package: package?, kind, sound: requirements(&versions)? }))
    }

    /// Reads a line of the snapshot.
    fn of_line(line: &str) -> Result<Self, String> {
        let [id, package, kind, sound] = line.split('\t').collect::<Vec<_>>()[..] else {
            return Err(format!("not four columns: {line}"));
        };
        let sound: Vec<String> =
            sound.split(" | ").filter(|part| !part.is_empty()).map(str::to_owned).collect();
        let [id, package, kind] = [id, package, kind].map(str::to_owned);
        Ok(Self { id, package, kind, sound: requirements(&sound)? })
    }

    fn to_line(&self) -> String {
        let sound: Vec<String> = self.sound.iter().map(VersionReq::to_string).collect();
        [&*self.id, &*self.package, &*self.kind, &*sound.join(" | ")].join("\t")
    }

    fn concerns(&self, name: &str, version: &Version) -> bool {
        name == self.package && !self.sound.iter().any(|sound| sound.matches(version))
    }
}

fn requirements(versions: &[String]) -> Result<Vec<VersionReq>, String> {
    versions.iter().map(|text| VersionReq::parse(text).map_err(|e| format!("{text}: {e}"))).collect()
}

fn snapshot() -> PathBuf {
    root().join("crates/xtask/advisories.tsv")
}

/// Checks all packages in `Cargo.lock` against the snapshot.
///
/// # Errors
/// Lists every package with an advisory that `deny.toml` does not accept.
pub(crate) fn check() -> Result<(), String> {
    let path = snapshot();
    let text = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let faults = faults(&text, &metadata()?, &list(&rules()?, "\nignore")?)?;
    if faults.is_empty() { Ok(()) } else { Err(faults.join("\n")) }
}

fn faults(text: &str, metadata: &Value, ignored: &[String]) -> Result<Vec<String>, String> {
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let mut advisories = lines.map(Advisory::of_line).collect::<Result<Vec<_>, _>>()?;
    advisories.retain(|advisory| !ignored.contains(&advisory.id));
    let packages = metadata["packages"].as_array().ok_or("cargo metadata names no packages")?;
    let mut faults = Vec::new();
    for package in packages.iter().filter(|package| package["source"].is_string()) {
        let [name, version] = ["name", "version"].map(|key| package[key].as_str().unwrap_or_default());
        let version = Version::parse(version).map_err(|e| format!("{name} {version}: {e}"))?;
        for Advisory { id, kind, .. } in advisories.iter().filter(|a| a.concerns(name, &version)) {
            faults.push(format!("{name} {version}: {kind}, see https://rustsec.org/advisories/{id}"));
        }
    }
    Ok(faults)
}

/// Writes the snapshot from a clone of the database.
///
/// # Errors
/// If a file cannot be read or written, or an advisory has no identifier, package or valid versions.
pub(crate) fn update(clone: &Path) -> Result<(), String> {
    let read = |folder: &Path| -> Result<Vec<PathBuf>, String> {
        let entries = fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        Ok(entries.filter_map(Result::ok).map(|entry| entry.path()).collect())
    };
    let mut lines = Vec::new();
    for package in read(&clone.join("crates"))? {
        for path in read(&package)? {
            let text = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
            let advisory = Advisory::read(&text).map_err(|e| format!("{}: {e}", path.display()))?;
            lines.extend(advisory.map(|advisory| advisory.to_line()));
        }
    }
    lines.sort_unstable();
    let mut text = String::from(
        "# Made by `cargo xtask advisories`: advisory, package, kind, and the versions that are not concerned.\n",
    );
    lines.iter().for_each(|line| writeln!(text, "{line}").expect("a string grows"));
    let path = snapshot();
    fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// Front matter in the form of the database.
    const FILE: &str = "```toml\n[advisory]\nid = \"RUSTSEC-2000-0001\"\npackage = \"pile\"\n\n[versions]\n\
                        patched = [\">= 0.6.14, < 1.0.0\",\n  \">= 1.6.1\"]\nunaffected = [\"< 0.6.3\"]\n```\n";

    #[test]
    fn concerned_versions_are_found() {
        let advisory = Advisory::read(FILE).unwrap().unwrap();
        assert_eq!(Advisory::of_line(&advisory.to_line()).unwrap(), advisory);
        let found = |name: &str, version: &str, ignored: &[String]| {
            let package = json!({ "name": name, "version": version, "source": "registry" });
            faults(&advisory.to_line(), &json!({ "packages": [package] }), ignored).unwrap()
        };
        let fault = |version: &str| {
            format!("pile {version}: vulnerability, see https://rustsec.org/advisories/RUSTSEC-2000-0001")
        };
        for version in ["0.6.3", "0.6.13", "1.0.0", "1.6.0"] {
            assert_eq!(found("pile", version, &[]), [fault(version)]);
        }
        for version in ["0.6.2", "0.6.14", "1.6.1"] {
            assert!(found("pile", version, &[]).is_empty(), "{version}");
        }
        assert!(found("other", "1.0.0", &[]).is_empty());
        assert!(found("pile", "1.0.0", std::slice::from_ref(&advisory.id)).is_empty());
    }

    #[test]
    fn withdrawn_advisories_are_left_out_and_kinds_kept() {
        let with = |line: &str| Advisory::read(&FILE.replace("\n\n", &format!("\n{line}\n\n")));
        assert_eq!(with("withdrawn = \"2001-01-01\""), Ok(None));
        assert_eq!(with("informational = \"unsound\"").unwrap().unwrap().kind, "unsound");
        assert_eq!(Advisory::read("```toml\n```"), Err("no id".to_owned()));
    }
}
