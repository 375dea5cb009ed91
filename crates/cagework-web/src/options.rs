//! Option types as JavaScript passes them; contract.ts has their declarations.

use cagework_core::options::{Backend, Solver};
use cagework_core::{BindOptions, Coordinates};
use cagework_gpu::render::Theme;
use cagework_io::{Joints, ReshapeOptions, value_fault};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use wasm_bindgen::JsValue;

use crate::error::{Answer, ErrorName, Fault};

/// Memory limit for reading a file, and for closed-form coordinates, bytes. A tab has 4 GiB, also for drawing and binding.
pub(crate) const READ_LIMIT: u64 = 1 << 30;

/// Options of a bind, and where it runs.
#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
#[cfg_attr(test, ts(rename = "BindOptions"))]
pub(crate) struct JsBindOptions {
    pub(crate) backend: Backend,
    #[serde(flatten)]
    pub(crate) options: BindOptions,
}

impl JsBindOptions {
    /// Whether the bind runs on the CPU: as set, without WebGPU, or because the solver has no GPU version.
    pub(crate) fn is_on_cpu(&self) -> bool {
        self.backend == Backend::Cpu
            || self.options.solver == Solver::ConjugateGradient
            || !cfg!(feature = "webgpu")
    }
}

/// Options of the scene.
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
    /// Whether the colours of weights span 0 to 1 rather than 0 to the largest weight.
    pub(crate) weights_to_one: bool,
    pub(crate) slice: SliceShown,
    pub(crate) gizmo: JsGizmo,
    /// Whether dragging pulls the model; the cage is drawn faintly then.
    pub(crate) pull: bool,
    /// Kinds shown side by side, from the left. Kinds that are not computed yet are skipped.
    pub(crate) compare: Vec<Coordinates>,
    pub(crate) problems: bool,
    /// How joints are shown: as they will be exported. Null hides them.
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

/// Quantity that the colours of the mesh show.
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

/// Mode of the gizmo.
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

/// Handle of the gizmo: an axis, the plane normal to an axis, or all axes.
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

/// Options of pulling the model.
#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[cfg_attr(test, ts(rename = "PullOptions"))]
pub(crate) struct JsPullOptions {
    /// Reach along the surface, over the model's size; null for automatic.
    pub(crate) reach: Option<f64>,
    /// Whether the whole model follows.
    pub(crate) whole: bool,
    /// Whether the pull is symmetric.
    pub(crate) mirrored: bool,
}

/// Options of exporting a rig.
#[derive(Clone, Deserialize)]
#[cfg_attr(test, derive(Default, serde::Serialize, ts_rs::TS))]
#[cfg_attr(test, ts(rename = "RigOptions"))]
pub(crate) struct JsRigOptions {
    joints: Joints,
    /// Whether translations of clips keep their length; otherwise they scale with the height of the hips.
    keep_travel: bool,
    /// Names of parts that keep their shape.
    #[serde(default)]
    rigid: Vec<String>,
    /// Whether to export the shape without the rig.
    pub(crate) plain: bool,
    /// Whether the cage deforms the model after a clip moves it.
    pub(crate) dynamic: bool,
}

impl JsRigOptions {
    pub(crate) fn options(&self) -> ReshapeOptions {
        let (joints, keep_travel, rigid) = (self.joints, self.keep_travel, self.rigid.clone());
        ReshapeOptions { joints, keep_travel, rigid, ..ReshapeOptions::default() }
    }
}

/// Decodes a JavaScript value into a Rust type.
///
/// # Errors
/// If the value has another type, for instance because page and wasm file are of different versions.
pub(crate) fn decode<T: DeserializeOwned>(value: JsValue) -> Answer<T> {
    serde_wasm_bindgen::from_value(value)
        .map_err(|error| Fault::new(ErrorName::Error, value_fault(&error.to_string())))
}
