//! Checks that dependencies of crates (`cargo tree`) follow [`RULES`], the arrows of the diagram in ARCHITECTURE.md,
//! and that the modules of a crate have no circular dependencies. Every crate of the workspace must have a rule.

mod modules;

use std::collections::BTreeSet;

use crate::command::output;

/// Allowed and forbidden dependencies of a crate of this workspace, direct or indirect.
struct Rule {
    name: &'static str,
    /// Crates of this workspace that the crate may depend on.
    may_use: &'static [&'static str],
    /// Third-party crates that the crate must not depend on.
    must_not_use: &'static [&'static str],
}

const RULES: &[Rule] = &[
    Rule {
        name: "cagework-core",
        may_use: &[],
        must_not_use: &["wgpu", "naga", "gltf", "gltf-json", "wasm-bindgen", "web-sys", "js-sys", "clap"],
    },
    Rule {
        name: "cagework-cage",
        may_use: &["cagework-core"],
        must_not_use: &["wgpu", "naga", "gltf", "gltf-json", "wasm-bindgen", "web-sys", "js-sys", "clap"],
    },
    Rule {
        name: "cagework-pose",
        may_use: &["cagework-core"],
        must_not_use: &["wgpu", "naga", "gltf", "gltf-json", "wasm-bindgen", "web-sys", "js-sys", "clap"],
    },
    Rule {
        name: "cagework-fbx",
        may_use: &["cagework-core"],
        // wasm-bindgen is allowed: the page has a wasm file of this crate alone.
        must_not_use: &["wgpu", "naga", "web-sys", "clap", "rayon"],
    },
    Rule {
        name: "cagework-io",
        may_use: &["cagework-core", "cagework-fbx", "cagework-pose"],
        // wasm-bindgen is allowed: on wasm32, zip depends on it through getrandom, but never calls it here.
        must_not_use: &["wgpu", "naga", "web-sys", "clap"],
    },
    Rule {
        name: "cagework-job",
        may_use: &["cagework-cage", "cagework-core", "cagework-io", "cagework-pose"],
        // wasm-bindgen is allowed: on wasm32, cagework-io depends on it through zip.
        must_not_use: &["wgpu", "naga", "web-sys", "clap"],
    },
    Rule {
        name: "cagework-editor",
        may_use: &["cagework-cage", "cagework-core", "cagework-io", "cagework-job", "cagework-pose"],
        // wasm-bindgen is allowed: on wasm32, cagework-io depends on it through zip.
        must_not_use: &["wgpu", "naga", "web-sys", "clap"],
    },
    Rule {
        name: "cagework-files",
        may_use: &["cagework-core", "cagework-io", "cagework-pose"],
        must_not_use: &["wgpu", "naga", "web-sys", "clap"],
    },
    Rule {
        name: "cagework-cli",
        may_use: &[
            "cagework-cage",
            "cagework-core",
            "cagework-fbx",
            "cagework-files",
            "cagework-gpu",
            "cagework-io",
            "cagework-job",
            "cagework-pose",
        ],
        must_not_use: &[],
    },
    Rule {
        name: "cagework-py",
        may_use: &[
            "cagework-cage",
            "cagework-core",
            "cagework-fbx",
            "cagework-files",
            "cagework-io",
            "cagework-job",
            "cagework-pose",
        ],
        must_not_use: &["wgpu", "clap"],
    },
    Rule {
        name: "cagework-gpu",
        may_use: &["cagework-core", "cagework-pose"],
        must_not_use: &["gltf", "gltf-json", "clap"],
    },
    Rule {
        name: "cagework-web",
        may_use: &[
            "cagework-cage",
            "cagework-core",
            "cagework-editor",
            "cagework-gpu",
            "cagework-io",
            "cagework-job",
            "cagework-pose",
        ],
        must_not_use: &["clap", "rayon"],
    },
    Rule { name: "cagework-tests", may_use: &["cagework-core"], must_not_use: &[] },
    Rule {
        name: "cagework-benches",
        may_use: &[
            "cagework-cage",
            "cagework-core",
            "cagework-editor",
            "cagework-gpu",
            "cagework-io",
            "cagework-job",
            "cagework-pose",
            "cagework-tests",
        ],
        must_not_use: &[],
    },
    Rule { name: "xtask", may_use: &[], must_not_use: &["wgpu"] },
];

/// Checks every crate of the workspace with all its features, natively and for the browser.
///
/// # Errors
/// Names the first forbidden dependency, or shows the first circle.
pub(crate) fn check() -> Result<(), String> {
    let members = tree(&["--workspace", "--depth", "0"])?;
    if let Some(stranger) = members.iter().find(|m| RULES.iter().all(|r| r.name != **m)) {
        return Err(format!("crate {stranger} has no rule in crates/xtask/src/arrows.rs: give it one"));
    }
    for rule in RULES {
        // `--target all` would follow combinations of targets and features that no build uses.
        let mut used = tree(&["--package", rule.name, "--all-features"])?;
        used.extend(tree(&["--package", rule.name, "--all-features", "--target", "wasm32-unknown-unknown"])?);
        for name in used.iter().filter(|name| **name != rule.name) {
            if members.contains(name) && !rule.may_use.contains(&name.as_str()) {
                return Err(format!("{} must not depend on {name} (ARCHITECTURE.md, arrows)", rule.name));
            }
            if rule.must_not_use.contains(&name.as_str()) {
                return Err(format!("{} must not depend on {name} (ARCHITECTURE.md, arrows)", rule.name));
            }
        }
    }
    println!("arrows: {} crates depend on nothing that they must not", RULES.len());
    modules::check()
}

/// Lists the names of the packages in a dependency tree, without development and build dependencies.
fn tree(args: &[&str]) -> Result<BTreeSet<String>, String> {
    let fixed = ["tree", "--locked", "--edges", "normal", "--prefix", "none", "--format", "{p}"];
    let text = output("cargo", &[&fixed[..], args].concat())?;
    Ok(text.lines().filter_map(|line| line.split_whitespace().next()).map(str::to_owned).collect())
}
