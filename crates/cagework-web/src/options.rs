//! Options as JavaScript passes them; border.rs generates their TypeScript declarations.

use cagework_core::Coordinates;
use cagework_core::options::{Backend, Solver};
use cagework_editor::{PageBindOptions, Settings};
use cagework_gpu::render::{GizmoMode, ViewOptions};
use cagework_io::{Joints, value_fault};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::error::{Answer, ErrorName, Fault};
use crate::views::object;

/// Memory limit for reading a file, and for closed-form coordinates, bytes. It is a quarter of the 4 GiB that a tab can
/// use, because drawing and binding need memory too.
pub(crate) const READ_LIMIT: u64 = 1 << 30;

/// Limit on the memory of models that are open together, bytes. Three files of 100 MB with
/// large textures take 1 GiB of a tab: the last one is in memory three times while a worker reads it, beside the arrays
/// of the others.
pub(crate) const HELD_LIMIT: u64 = READ_LIMIT / 3;

/// Limit on the project file that is saved while the user works, bytes. Saving a larger one pauses the page.
pub(crate) const KEPT_LIMIT: u64 = 200 << 20;

/// Bytes of a project file that are copied out of the module at a time.
pub(crate) const KEPT_PIECE: usize = 8 << 20;

/// Whether a bind runs on the CPU: because the options say so, the build has no WebGPU, or the solver has no GPU version.
pub(crate) fn is_on_cpu(request: &PageBindOptions) -> bool {
    request.backend == Backend::Cpu
        || request.options.solver == Solver::ConjugateGradient
        || !cfg!(feature = "webgpu")
}

/// Reads the settings of a project, see [`Settings::read`].
#[wasm_bindgen(js_name = readSettings, unchecked_return_type = "Settings")]
pub fn read_settings(text: &str, memory_limit: f64) -> JsValue {
    object(&Settings::read(text, memory_limit as u64))
}

/// Elements of the scene that are drawn, and their colours.
#[derive(Clone, Deserialize, PartialEq, Eq)]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
#[cfg_attr(test, ts(rename = "SceneOptions"))]
pub(crate) struct JsSceneOptions {
    #[serde(flatten)]
    pub(crate) options: ViewOptions,
    pub(crate) model: bool,
    pub(crate) cage: bool,
    pub(crate) original: bool,
    pub(crate) colour: Colour,
    pub(crate) slice: SliceContent,
    /// What dragging a handle of the gizmo does to the selection. Null hides the gizmo.
    pub(crate) gizmo: Option<GizmoMode>,
    /// Whether dragging pulls the model's surface. The cage is then drawn faintly.
    pub(crate) pull: bool,
    /// Kinds of coordinates shown side by side, from the left. Kinds that are not computed yet are skipped.
    pub(crate) compare: Vec<Coordinates>,
    pub(crate) problems: bool,
    /// How the next export treats joints, which determines where the joints are marked. Null hides the marks.
    pub(crate) joints: Option<Joints>,
    /// Whether exports keep the models on their ground, so that the floor is drawn below the posed models.
    pub(crate) ground: bool,
}

impl Default for JsSceneOptions {
    fn default() -> Self {
        Self {
            options: ViewOptions::default(),
            model: true,
            cage: true,
            original: false,
            colour: Colour::Material,
            slice: SliceContent::Off,
            gizmo: None,
            pull: true,
            compare: vec![Coordinates::Harmonic],
            problems: true,
            joints: None,
            ground: false,
        }
    }
}

/// What the colours of the model show: its materials, plain clay, weights, or errors.
#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
pub(crate) enum Colour {
    Material,
    Clay,
    Weight,
    Error,
}

/// What the slice through the grid shows: nothing, the types of the cells, or the weights of a control.
#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
pub(crate) enum SliceContent {
    Off,
    Kinds,
    Value,
}

/// Decodes a JavaScript value to a Rust type.
///
/// # Errors
/// If the value does not match the type, for instance because the page and the wasm file have different versions.
pub(crate) fn decode<T: DeserializeOwned>(value: JsValue) -> Answer<T> {
    serde_wasm_bindgen::from_value(value)
        .map_err(|error| Fault::new(ErrorName::Error, value_fault(&error.to_string())))
}
