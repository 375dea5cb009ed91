//! Options as JavaScript passes them; border.rs generates their TypeScript declarations.

use cagework_core::options::{Backend, Solver};
use cagework_core::{BindOptions, Coordinates};
use cagework_gpu::render::{GizmoMode, ViewOptions};
use cagework_io::{CompactOptions, Joints, ReshapeOptions, value_fault};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use wasm_bindgen::JsValue;

use crate::error::{Answer, ErrorName, Fault};

/// Memory limit for reading a file, and for closed-form coordinates, bytes. It is a quarter of the 4 GiB that a tab can
/// use, because drawing and binding need memory too.
pub(crate) const READ_LIMIT: u64 = 1 << 30;

/// Default memory limit of a bind in the page, bytes: half of the 4 GiB that a browser tab can address.
const BIND_LIMIT: u64 = 2 << 30;

/// Options of a bind, and the processor that it runs on.
#[derive(Clone, Copy, Deserialize, Serialize)]
#[serde(default)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[cfg_attr(test, ts(rename = "BindOptions"))]
pub(crate) struct JsBindOptions {
    pub(crate) backend: Backend,
    #[serde(flatten)]
    pub(crate) options: BindOptions,
}

impl Default for JsBindOptions {
    fn default() -> Self {
        let options = BindOptions { memory_limit: BIND_LIMIT, ..BindOptions::default() };
        Self { backend: Backend::Gpu, options }
    }
}

impl JsBindOptions {
    /// Whether the bind runs on the CPU: because the options say so, the build has no WebGPU, or the solver has no GPU
    /// version.
    pub(crate) fn is_on_cpu(&self) -> bool {
        self.backend == Backend::Cpu
            || self.options.solver == Solver::ConjugateGradient
            || !cfg!(feature = "webgpu")
    }
}

/// Elements of the scene that are drawn, and their colours.
#[derive(Clone, Deserialize, PartialEq, Eq)]
#[cfg_attr(test, derive(Serialize, ts_rs::TS))]
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
        }
    }
}

/// What the colours of the model show: its materials, plain clay, weights, or errors.
#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(Serialize, ts_rs::TS))]
pub(crate) enum Colour {
    Material,
    Clay,
    Weight,
    Error,
}

/// What the slice through the grid shows: nothing, the types of the cells, or the weights of a control.
#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(Serialize, ts_rs::TS))]
pub(crate) enum SliceContent {
    Off,
    Kinds,
    Value,
}

/// How an export treats the rig of a model.
#[derive(Clone, Default, Deserialize, PartialEq, Serialize)]
#[serde(default)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[cfg_attr(test, ts(rename = "RigOptions"))]
pub(crate) struct JsRigOptions {
    #[serde(flatten)]
    pub(crate) reshape: ReshapeOptions,
    /// Options that reduce the size of the file.
    #[serde(flatten)]
    pub(crate) size: CompactOptions,
    /// Whether to export only the shape, without the rig.
    pub(crate) plain: bool,
    /// Whether the cage deforms the model after a clip has moved it.
    pub(crate) dynamic: bool,
}

/// Fields of options as JSON, without `threads` and `smooth`, which JavaScript does not set.
pub(crate) fn fields(options: &impl Serialize) -> Map<String, Value> {
    // Text keeps the digits of an `f32`; `serde_json::to_value` would widen it to `f64`.
    let text = serde_json::to_string(options).unwrap_or_default();
    let mut fields: Map<String, Value> = serde_json::from_str(&text).unwrap_or_default();
    // The page binds with one thread, and smoothing is a property of the cage.
    fields.retain(|name, _| name != "threads" && name != "smooth");
    fields
}

/// Decodes a JavaScript value to a Rust type.
///
/// # Errors
/// If the value does not match the type, for instance because the page and the wasm file have different versions.
pub(crate) fn decode<T: DeserializeOwned>(value: JsValue) -> Answer<T> {
    serde_wasm_bindgen::from_value(value)
        .map_err(|error| Fault::new(ErrorName::Error, value_fault(&error.to_string())))
}
