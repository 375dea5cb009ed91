//! The page: builds it into `dist/`, serves it, and tests it in a browser.

use crate::command::{root, run};
use crate::licences;
use crate::npm::{self, exec};
use crate::wasm;

/// Limit on the wasm file that visitors download, gzip-compressed bytes: less than 2 % above the file's size when the
/// limit was set.
const MAX_WASM_BYTES: usize = 2_140_000;
/// The same limit for the wasm file of browsers without WebGPU, which also contains a translator of shaders.
const MAX_WEBGL_BYTES: usize = 2_795_000;
/// The same limit for the converter of FBX files, which visitors download with the first such file.
const MAX_FBX_BYTES: usize = 199_000;
/// Limit on the script of the page, gzip-compressed bytes.
const MAX_SCRIPT_BYTES: usize = 106_000;

/// Minimum number of `f32x4.add` instructions in a wasm file, to detect that loops are not vectorised. A vectorised
/// build has 596. A scalar build has 261, which are in libraries and hand-written code. The limit is in between.
const MIN_VECTOR_ADDS: usize = 450;
/// Bytes that encode the instruction `f32x4.add`.
const VECTOR_ADD: [u8; 3] = [0xfd, 0xe4, 0x01];

/// Folder of the built page, in the repository's root.
const FOLDER: &str = "dist";

/// Builds the page into `dist/`: files that work under any path of any web server.
///
/// # Errors
/// When a step fails or the result is too large to download.
pub(crate) fn build() -> Result<(), String> {
    npm::install()?;
    wasm::ensure()?;
    exec(&["vite", "build", "web", "--config", "web/vite.config.ts", "--logLevel", "warn"])?;
    licences::of_page(&root().join(FOLDER))?;
    check_sizes()?;
    println!("the page is in {FOLDER}/: any web server can serve it, from any path");
    Ok(())
}

/// Builds the page and serves it on this machine.
///
/// # Errors
/// When a step fails.
pub(crate) fn start(args: &[&str]) -> Result<(), String> {
    build()?;
    exec(&[&["vite", "preview", "web", "--config", "web/vite.config.ts"], args].concat())
}

/// Tests TypeScript modules without a browser; `args` are passed to Vitest.
///
/// # Errors
/// When a test fails.
pub(crate) fn test_scripts(args: &[&str]) -> Result<(), String> {
    npm::install()?;
    exec(&[&["vitest", "run", "--root", "web"], args].concat())
}

/// Builds the page and tests it in a browser; `args` are passed to Playwright.
///
/// # Errors
/// When a test fails.
pub(crate) fn test_page(args: &[&str]) -> Result<(), String> {
    build()?;
    test_built_page(args)
}

/// Tests the page in `dist/`; `args` are passed to Playwright.
///
/// # Errors
/// When a test fails.
pub(crate) fn test_built_page(args: &[&str]) -> Result<(), String> {
    exec(&[&["playwright", "test", "--config", "web/playwright.config.ts"], args].concat())
}

/// Tests the page in `dist/` in Firefox.
///
/// # Errors
/// When a test fails.
pub(crate) fn test_firefox() -> Result<(), String> {
    run("node", &["web/e2e/firefox.mjs"], &[])
}

/// Makes the pictures of the samples (`web/public/samples`) and of the documents (`docs/pictures`) in the page.
///
/// # Errors
/// When a step fails.
pub(crate) fn pictures() -> Result<(), String> {
    build()?;
    let playwright = ["--no-install", "playwright", "test", "--config", "web/playwright.config.ts"];
    run("npx", &playwright, &[("PICTURES", "1")])
}

/// Checks the types of the TypeScript sources, which the build does not check.
///
/// # Errors
/// When a type is wrong.
pub(crate) fn check_types() -> Result<(), String> {
    wasm::ensure()?;
    exec(&["tsc", "--project", "web"])
}

/// Checks the sizes of the files that visitors download, and that the wasm uses vector instructions.
fn check_sizes() -> Result<(), String> {
    let folder = root().join(FOLDER).join("assets");
    let entries = std::fs::read_dir(&folder).map_err(|e| format!("cannot read {}: {e}", folder.display()))?;
    for entry in entries.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let limit = match name.as_str() {
            n if n.starts_with("cagework_bg") => MAX_WASM_BYTES,
            n if n.starts_with("cagework_webgl_bg") => MAX_WEBGL_BYTES,
            n if n.starts_with("cagework_fbx_bg") => MAX_FBX_BYTES,
            n if n.starts_with("index") && n.to_ascii_lowercase().ends_with(".js") => MAX_SCRIPT_BYTES,
            _ => continue,
        };
        let bytes = std::fs::read(entry.path()).map_err(|e| format!("cannot read {name}: {e}"))?;
        let size = compressed(&bytes)?;
        println!("{name}: {} kB, {} kB compressed", bytes.len() / 1000, size / 1000);
        if size > limit {
            return Err(format!("{name} has {size} bytes compressed; it may have {limit}"));
        }
        let adds = bytes.windows(VECTOR_ADD.len()).filter(|w| *w == VECTOR_ADD).count();
        if name.ends_with(".wasm") && limit != MAX_FBX_BYTES && adds < MIN_VECTOR_ADDS {
            return Err(format!(
                "{name} adds vectors in {adds} places, not {MIN_VECTOR_ADDS}: its loops are scalar, see RUSTFLAGS in wasm.rs"
            ));
        }
    }
    Ok(())
}

/// Computes the size after gzip compression, bytes.
fn compressed(bytes: &[u8]) -> Result<usize, String> {
    use std::io::Write as _;
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    let packed = encoder.write_all(bytes).and_then(|()| encoder.finish());
    packed.map(|p| p.len()).map_err(|e| format!("cannot compress: {e}"))
}
