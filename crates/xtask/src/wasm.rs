//! Compiles Rust to wasm, and generates its JavaScript.

use std::path::Path;
use std::time::SystemTime;

use wasm_bindgen_cli_support::Bindgen;

use crate::command::{output, root, run};

/// Cargo profile with which the wasm is compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Profile {
    /// Quick to build; used for development.
    Dev,
    /// Small and fast; used for the page and the npm package.
    Web,
}

impl Profile {
    fn name(self) -> &'static str {
        match self {
            Self::Dev => "dev",
            Self::Web => "web",
        }
    }
}

/// A wasm file: the converter of FBX files, or one of the builds of `cagework-web`: for browsers with and without WebGPU,
/// and without files and drawing, for functions of the npm package.
struct Artifact {
    /// Cargo's subcommand, and arguments that select the package and its features.
    build: &'static [&'static str],
    /// Name of Cargo's output.
    output: &'static str,
    /// Folder of the generated JavaScript package; ignored by git.
    package: &'static str,
    /// Name of the generated files, without extension.
    name: &'static str,
}

/// All artifacts, in build order. Cargo keeps only the artifact of the last build of `cagework-web`, and must link the
/// other builds again. The build for browsers with WebGPU comes last, because developers repeat it most often.
const ARTIFACTS: [Artifact; 4] = [
    Artifact {
        build: &["rustc", "--package", "cagework-fbx", "--crate-type", "cdylib"],
        output: "cagework_fbx.wasm",
        package: "web/package/src/pkg-fbx",
        name: "cagework_fbx",
    },
    Artifact {
        // It contains nothing of WebGL. With the features of the next build, dependencies are compiled once for both.
        build: &["build", "--package", "cagework-web", "--no-default-features", "--features", "webgl"],
        output: "cagework_web.wasm",
        package: "web/package/src/pkg-compute",
        name: "cagework_compute",
    },
    Artifact {
        build: &["build", "--package", "cagework-web", "--no-default-features", "--features", "webgl,full"],
        output: "cagework_web.wasm",
        package: "web/package/src/pkg-webgl",
        name: "cagework_webgl",
    },
    Artifact {
        build: &["build", "--package", "cagework-web"],
        output: "cagework_web.wasm",
        package: "web/package/src/pkg",
        name: "cagework",
    },
];

/// Flags of rustc for wasm. All browsers with WebGPU or WebGL2 support 128-bit vectors. The vectorizer must be added to
/// LLVM's passes by name: otherwise all loops stay scalar at any optimization level, and a bind takes 1.6 times as long.
const RUSTFLAGS: &str = "-C target-feature=+simd128 -C passes=slp-vectorizer";

/// Compiler, archiver and flags for the C code of `ufbx`, as its build script expects them. Its calls of the C library
/// become calls of functions in `cagework-fbx`. Features that this crate does not use, such as subdivision and OBJ files,
/// are left out.
const C_COMPILER: [(&str, &str); 3] = [
    ("CC_wasm32_unknown_unknown", "clang"),
    ("AR_wasm32_unknown_unknown", "ar"),
    (
        "CFLAGS_wasm32_unknown_unknown",
        "-DUFBX_NO_LIBC -DUFBX_NO_STDIO -DUFBX_MINIMAL -DUFBX_ENABLE_ANIMATION_BAKING -DUFBX_ENABLE_SCENE_EVALUATION \
         -DUFBX_ENABLE_TRIANGULATION -DUFBX_ENABLE_INDEX_GENERATION -Oz",
    ),
];

/// Files and folders that the packages are built from.
const SOURCES: [&str; 12] = [
    "crates/cagework-core",
    "crates/cagework-fbx",
    "crates/cagework-cage",
    "crates/cagework-pose",
    "crates/cagework-io",
    "crates/cagework-job",
    "crates/cagework-editor",
    "crates/cagework-gpu",
    "crates/cagework-web",
    "shaders",
    "Cargo.toml",
    "Cargo.lock",
];

/// File in each package that contains the name of its profile.
const PROFILE: &str = "profile.txt";

/// Builds all JavaScript packages with [`Profile::Web`], unless both are newer than all sources. Cargo keeps only the
/// artifact of the last build, so building up-to-date packages again would link all, which takes five minutes on two
/// cores.
///
/// # Errors
/// When a step fails.
pub(crate) fn ensure() -> Result<(), String> {
    let is_web = |a: &Artifact| {
        let profile = std::fs::read_to_string(root().join(a.package).join(PROFILE));
        profile.is_ok_and(|profile| profile == Profile::Web.name())
    };
    let made = ARTIFACTS.iter().map(|a| modified(&root().join(a.package).join(format!("{}.d.ts", a.name))));
    let newest = SOURCES.iter().filter_map(|source| newest(&root().join(source))).max();
    if ARTIFACTS.iter().all(is_web) && made.into_iter().min().flatten() >= newest {
        return Ok(());
    }
    build(Profile::Web)
}

fn modified(path: &Path) -> Option<SystemTime> {
    path.metadata().and_then(|m| m.modified()).ok()
}

/// Finds the modification time of a file, or of the newest file in a folder.
fn newest(path: &Path) -> Option<SystemTime> {
    let Ok(entries) = path.read_dir() else { return modified(path) };
    entries.flatten().filter_map(|entry| newest(&entry.path())).max()
}

/// Builds [`ARTIFACTS`] for the browser, and generates their JavaScript packages.
///
/// # Errors
/// When a step fails.
pub(crate) fn build(profile: Profile) -> Result<(), String> {
    let name = profile.name();
    let folder = if profile == Profile::Dev { "debug" } else { name };
    let output = target_folder()?.join("wasm32-unknown-unknown").join(folder);
    let variables = [&[("RUSTFLAGS", RUSTFLAGS)], &C_COMPILER[..]].concat();
    for artifact in &ARTIFACTS {
        let target = ["--locked", "--lib", "--target", "wasm32-unknown-unknown", "--profile", name];
        let [subcommand, build @ ..] = artifact.build else { continue };
        run("cargo", &[&[*subcommand], &target[..], build].concat(), &variables)?;
        bindgen(&output.join(artifact.output), artifact, profile)?;
    }
    Ok(())
}

/// Generates the JavaScript package of an artifact from its wasm.
fn bindgen(wasm: &Path, artifact: &Artifact, profile: Profile) -> Result<(), String> {
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
        // Function names are only for debugging and are a fifth of the file.
        .remove_name_section(profile == Profile::Web)
        .remove_producers_section(profile == Profile::Web)
        .out_name(artifact.name);
    let package = root().join(artifact.package);
    bindgen.generate(&package).map_err(fault("cannot make JavaScript of the wasm"))?;
    std::fs::write(package.join(PROFILE), profile.name())
        .map_err(|e| format!("cannot write in {}: {e}", package.display()))
}

/// Asks Cargo for the absolute path of its target folder.
pub(crate) fn target_folder() -> Result<std::path::PathBuf, String> {
    let metadata = output("cargo", &["metadata", "--format-version", "1", "--no-deps", "--locked"])?;
    let key = "\"target_directory\":\"";
    let start = metadata.find(key).ok_or("cargo metadata names no target folder")? + key.len();
    let end = metadata[start..].find('"').ok_or("cargo metadata is cut off")? + start;
    Ok(metadata[start..end].replace("\\\\", "\\").into())
}
