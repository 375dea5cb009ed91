//! Options as JavaScript passes them; border.rs generates their TypeScript declarations.

use cagework_core::options::{Backend, Solver};
use cagework_core::{BindOptions, Coordinates};
use cagework_gpu::render::Theme;
use cagework_io::{Joints, ReshapeOptions, value_fault};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use wasm_bindgen::JsValue;

use crate::error::{Answer, ErrorName, Fault};

/// Memory limit for reading a file, and for closed-form coordinates, bytes. The 4 GiB of a tab must also hold drawing
/// and binding.
pub(crate) const READ_LIMIT: u64 = 1 << 30;

/// Options of a bind, and the processor that it runs on.
#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
#[cfg_attr(test, ts(rename = "BindOptions"))]
pub(crate) struct JsBindOptions {
    pub(crate) backend: Backend,
    #[serde(flatten)]
    pub(crate) options: BindOptions,
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

/// What the scene shows.
#[derive(Clone, Deserialize, PartialEq, Eq)]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
#[cfg_attr(test, ts(rename = "SceneOptions"))]
pub(crate) struct JsSceneOptions {
    pub(crate) theme: Theme,
    pub(crate) model: bool,
    pub(crate) base_wireframe: bool,
    pub(crate) cage: bool,
    pub(crate) floor: bool,
    pub(crate) original: bool,
    pub(crate) colour: Colour,
    /// Whether the colour scale of weights ends at 1 rather than at the largest weight.
    pub(crate) weights_to_one: bool,
    pub(crate) slice: SliceShown,
    pub(crate) gizmo: JsGizmo,
    /// Whether dragging pulls the model's surface. The cage is then drawn faintly.
    pub(crate) pull: bool,
    /// Kinds of coordinates shown side by side, from the left. Kinds that are not computed yet are skipped.
    pub(crate) compare: Vec<Coordinates>,
    pub(crate) problems: bool,
    /// Treatment of joints by the next export, which the marks of joints show. Null hides the marks.
    pub(crate) joints: Option<Joints>,
}

impl Default for JsSceneOptions {
    fn default() -> Self {
        Self {
            theme: Theme::Dark,
            model: true,
            base_wireframe: false,
            cage: true,
            floor: true,
            original: false,
            colour: Colour::Material,
            weights_to_one: false,
            slice: SliceShown::Off,
            gizmo: JsGizmo::None,
            pull: true,
            compare: vec![Coordinates::Harmonic],
            problems: true,
            joints: None,
        }
    }
}

/// Quantity that the colours of the model show.
#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
pub(crate) enum Colour {
    Material,
    Clay,
    Weight,
    Error,
}

/// Quantity that the slice shows.
#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
pub(crate) enum SliceShown {
    Off,
    Kinds,
    Value,
}

/// Type of gizmo.
#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
#[cfg_attr(test, ts(rename = "Gizmo"))]
pub(crate) enum JsGizmo {
    None,
    Move,
    Rotate,
    Scale,
}

/// Handle of the gizmo: one axis, the plane normal to an axis, or all axes.
#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) enum GizmoHandle {
    X,
    Y,
    Z,
    PlaneX,
    PlaneY,
    PlaneZ,
    All,
}

/// Options for pulling the model's surface.
#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[cfg_attr(test, ts(rename = "PullOptions"))]
pub(crate) struct JsPullOptions {
    /// Distance along the surface that a pull affects, as a fraction of the model's size; null for automatic.
    pub(crate) reach: Option<f64>,
    /// Whether a pull affects the whole model, without a limit of distance.
    pub(crate) whole: bool,
    /// Whether the mirror image of the grabbed point is pulled symmetrically.
    pub(crate) mirrored: bool,
}

/// Options for exporting a rig.
#[derive(Clone, Deserialize)]
#[cfg_attr(test, derive(Default, serde::Serialize, ts_rs::TS))]
#[cfg_attr(test, ts(rename = "RigOptions"))]
pub(crate) struct JsRigOptions {
    joints: Joints,
    /// Whether translations in clips keep their length; otherwise they scale with the height of the hips.
    keep_travel: bool,
    /// Names of parts that move rigidly, without changing their shape.
    #[serde(default)]
    rigid: Vec<String>,
    /// Whether to export only the shape, without the rig.
    pub(crate) plain: bool,
    /// Whether the cage deforms the model after a clip has moved it.
    pub(crate) dynamic: bool,
}

impl JsRigOptions {
    pub(crate) fn options(&self) -> ReshapeOptions {
        let (joints, keep_travel, rigid) = (self.joints, self.keep_travel, self.rigid.clone());
        ReshapeOptions { joints, keep_travel, rigid, ..ReshapeOptions::default() }
    }
}

/// Decodes a JavaScript value to a Rust type.
///
/// # Errors
/// If the value does not match the type, for instance because the page and the wasm file have different versions.
pub(crate) fn decode<T: DeserializeOwned>(value: JsValue) -> Answer<T> {
    serde_wasm_bindgen::from_value(value)
        .map_err(|error| Fault::new(ErrorName::Error, value_fault(&error.to_string())))
}
