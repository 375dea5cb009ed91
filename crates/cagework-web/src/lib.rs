//! JavaScript classes for the page and the npm package, over the crates core, cage, pose, io, editor and gpu. This
//! crate implements no algorithms.
//!
//! One wasm module runs in two instances: on the main thread `engine::Engine` draws, picks and deforms; in a worker
//! `binder::Binder` binds. Arrays are passed as typed arrays, everything else as plain objects. A failing method throws
//! an `Error` whose name is the variant of `error::ErrorName` and whose message is a sentence.

// Only browsers have canvases. Everything else also compiles natively, for tests and lints.
#![cfg_attr(
    not(all(target_family = "wasm", feature = "full")),
    allow(dead_code, unused_imports, reason = "used only by code for the browser")
)]

mod arrays;
pub mod binder;
#[cfg(all(test, feature = "full"))]
mod border;
mod cage;
mod clock;
pub mod deformer;
#[cfg(all(target_family = "wasm", feature = "full"))]
pub mod engine;
mod error;
mod field;
#[cfg(feature = "full")]
mod folds;
#[cfg(all(target_family = "wasm", feature = "full"))]
mod gpu;
#[cfg(feature = "full")]
mod incoming;
#[cfg(feature = "full")]
pub mod loaded;
#[cfg(feature = "full")]
mod opening;
pub mod options;
#[cfg(feature = "full")]
mod problems;
#[cfg(feature = "full")]
pub mod puller;
#[cfg(feature = "full")]
pub mod reshape;
#[cfg(feature = "full")]
mod scene;
#[cfg(feature = "full")]
mod state;
#[cfg(all(target_family = "wasm", feature = "full"))]
mod surface;
mod views;
mod weights;

use wasm_bindgen::prelude::wasm_bindgen;

/// TypeScript types that the `unchecked_*_type` attributes name; `border.rs` writes their declarations.
#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = r#"
import type { BindOptions, BindReport, BoundArrays, BuiltSample, CageArrays, CageControls, CageOptions, CageState, Command,
  Coordinates, FoldArrays, Frames, Gesture, GizmoPart, GrabInput, GrabResult, HumanoidInfo, Legend, ModelFormat, ModelInfo, Offsets, OpenContents,
  Problem, Progress, ProportionRange, PullFrame, Repair, RigArrays, RigOptions, SceneOptions, SelectMode, Settings, SurfacePoint, CameraView, Tools, UpAxis,
  View, WalkInfo } from "../contract/generated";

/** Column indices and weights from `start` to `end` of sparse rows. */
export type WeightRows = (start: number, end: number) => Rows | Promise<Rows>;
type Rows = readonly [Uint32Array, Float32Array];
"#;

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_name = reportError)]
    fn report_error(error: &js_sys::Error);
}

/// Called once by the JavaScript glue. Installs a panic hook that reports location and message as an uncaught error
/// named `Panic`, which the page's `crash.ts` handles. The wasm module traps after the hook returns.
#[wasm_bindgen(start)]
pub fn start() {
    std::panic::set_hook(Box::new(|panic| {
        let error = js_sys::Error::new(&panic.to_string());
        error.set_name("Panic");
        report_error(&error);
    }));
}
