//! The page's half of Cagework: JavaScript classes over core, io and gpu. No mathematics.
//!
//! One wasm module, two instances: on the main thread `engine::Engine` draws, picks and deforms; in a worker
//! `binder::Binder` binds. Arrays go across as typed arrays, everything else as plain objects. What fails throws an
//! `Error` whose name is the variant and whose message is the sentence.

// Canvases are the browser's. What does without compiles everywhere, so that tests and lints see it.
#![cfg_attr(
    not(target_family = "wasm"),
    allow(dead_code, unused_imports, reason = "used by what only the browser has")
)]

mod arrays;
pub mod binder;
#[cfg(test)]
mod border;
mod clock;
mod controls;
#[cfg(target_family = "wasm")]
pub mod engine;
mod error;
#[cfg(target_family = "wasm")]
mod gpu;
mod held;
mod incoming;
mod joints;
pub mod loaded;
mod opening;
mod options;
mod playing;
mod problems;
pub mod puller;
pub mod reshape;
mod scene;
pub mod settings;
mod state;
#[cfg(target_family = "wasm")]
mod surface;
mod views;

use wasm_bindgen::prelude::wasm_bindgen;

/// The types of `unchecked_*_type` below: serde's, as `border.rs` writes them for TypeScript.
#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = r#"
import type { BindOptions, BindReport, CageControls, CageOptions, CageState, Command, Coordinates, Element, Gesture,
  GizmoHandle, Grip, Legend, ModelFormat, ModelInfo, OpenContents, Pivot, Problem, Progress, PullOptions, Repair, RigOptions,
  SceneOptions, SelectMode, Settings, SurfacePoint, CameraView, UpAxis, View } from "../contract/generated";
"#;

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_name = reportError)]
    fn report_error(error: &js_sys::Error);
}

/// Called once by the glue: a panic becomes an error called `Panic` that nobody can catch by accident, in the console with
/// its place and message, and for the page's `crash.ts` or the worker's page to hear. What follows is a trap.
#[wasm_bindgen(start)]
pub fn start() {
    std::panic::set_hook(Box::new(|panic| {
        let error = js_sys::Error::new(&panic.to_string());
        error.set_name("Panic");
        report_error(&error);
    }));
}
