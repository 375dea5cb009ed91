//! The browser's half: Rust to wasm to JavaScript.

use std::path::Path;

use wasm_bindgen_cli_support::Bindgen;

use crate::command::{output, root, run};

/// Profile of Cargo that the wasm is built with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Profile {
    /// Quick to build.
    Dev,
    /// Small and fast.
    Web,
}

/// Where the JavaScript package goes: beside the page's sources, ignored by git.
const PACKAGE: &str = "web/src/pkg";

/// What the web's profile adds to rustc. Vectors of 128 bits are wherever WebGPU is.
const RUSTFLAGS: &str = "-C target-feature=+simd128";

/// Builds `crates/cagework-web` for the browser and makes a JavaScript package of it.
///
/// # Errors
/// When a step fails.
pub(crate) fn build(profile: Profile) -> Result<(), String> {
    let name = match profile {
        Profile::Dev => "dev",
        Profile::Web => "web",
    };
    let target = ["--target", "wasm32-unknown-unknown", "--profile", name];
    let build = ["build", "--locked", "--package", "cagework-web", "--lib"];
    run("cargo", &[&build[..], &target].concat(), &[("RUSTFLAGS", RUSTFLAGS)])?;
    let folder = match profile {
        Profile::Dev => "debug",
        Profile::Web => "web",
    };
    let wasm = target_folder()?.join("wasm32-unknown-unknown").join(folder).join("cagework_web.wasm");
    bindgen(&wasm, profile)
}

/// Makes the JavaScript package.
fn bindgen(wasm: &Path, profile: Profile) -> Result<(), String> {
    let fault = |what: &str| {
        let what = what.to_owned();
        move |error: anyhow::Error| format!("{what}: {error:#}")
    };
    let mut bindgen = Bindgen::new();
    bindgen
        .input_path(wasm)
        .web(true)
        .map_err(fault("cannot target the web"))?
        .typescript(true)
        // Names of functions are for debugging; they are a fifth of the file.
        .remove_name_section(profile == Profile::Web)
        .remove_producers_section(profile == Profile::Web)
        .out_name("cagework");
    bindgen.generate(root().join(PACKAGE)).map_err(fault("cannot make JavaScript of the wasm"))
}

/// Cargo's target folder, wherever the user has put it.
pub(crate) fn target_folder() -> Result<std::path::PathBuf, String> {
    let metadata = output("cargo", &["metadata", "--format-version", "1", "--no-deps", "--locked"])?;
    let key = "\"target_directory\":\"";
    let start = metadata.find(key).ok_or("cargo metadata names no target folder")? + key.len();
    let end = metadata[start..].find('"').ok_or("cargo metadata is cut off")? + start;
    Ok(metadata[start..end].replace("\\\\", "\\").into())
}
