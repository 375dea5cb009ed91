//! What JavaScript asks for: the option types of contract.ts.

use cagework_cage::generate::{CageOptions, Shape, Symmetry};
use cagework_core::BindOptions;
use cagework_core::options::{Backend, Solver};
use cagework_gpu::render::Theme;
use cagework_io::{Joints, ReshapeOptions, value_fault};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use wasm_bindgen::JsValue;

use crate::error::{Answer, ErrorName, Fault};

/// Bytes that reading a file, or coordinates by formula, may take: a tab has 4 GiB, of which drawing and binding take their part.
pub(crate) const READ_LIMIT: u64 = 1 << 30;

/// `BindOptions`: those of the core, and where to compute.
#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
#[cfg_attr(test, ts(rename = "BindOptions"))]
pub(crate) struct BindAsked {
    pub(crate) backend: Backend,
    #[serde(flatten)]
    pub(crate) options: BindOptions,
}

impl From<BindAsked> for BindOptions {
    fn from(asked: BindAsked) -> Self {
        asked.options
    }
}

impl BindAsked {
    /// Whether the processor computes: it was asked to, there is no WebGPU, or the solver runs nowhere else.
    pub(crate) fn is_on_cpu(&self) -> bool {
        self.backend == Backend::Cpu
            || self.options.solver == Solver::ConjugateGradient
            || !cfg!(feature = "webgpu")
    }
}

/// `CageOptions`.
#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
#[cfg_attr(test, ts(rename = "CageOptions"))]
pub(crate) struct CageAsked {
    vertices: u32,
    detail: f32,
    quads: bool,
    margin: f32,
    symmetry: SymmetryAsked,
    voxels: u32,
    #[serde(default)]
    shape: Shape,
    #[serde(default)]
    per_component: bool,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
#[cfg_attr(test, ts(rename = "CageSymmetry"))]
pub(crate) enum SymmetryAsked {
    Auto,
    On,
    Off,
}

#[cfg(test)]
impl From<CageOptions> for CageAsked {
    fn from(options: CageOptions) -> Self {
        let CageOptions {
            target: vertices,
            detail,
            quads,
            clearance: margin,
            voxels,
            shape,
            per_component,
            symmetry,
            smooth: _,
        } = options;
        let symmetry = match symmetry {
            Symmetry::Auto => SymmetryAsked::Auto,
            Symmetry::None => SymmetryAsked::Off,
            _ => SymmetryAsked::On,
        };
        Self { vertices, detail, quads, margin, symmetry, voxels, shape, per_component }
    }
}

impl From<CageAsked> for CageOptions {
    fn from(asked: CageAsked) -> Self {
        Self {
            target: asked.vertices,
            detail: asked.detail,
            quads: asked.quads,
            clearance: asked.margin,
            symmetry: match asked.symmetry {
                SymmetryAsked::Auto => Symmetry::Auto,
                SymmetryAsked::On => Symmetry::X,
                SymmetryAsked::Off => Symmetry::None,
            },
            shape: asked.shape,
            per_component: asked.per_component,
            voxels: asked.voxels,
            smooth: 0,
        }
    }
}

/// `SceneOptions`.
#[derive(Clone, Deserialize, PartialEq, Eq)]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
#[cfg_attr(test, ts(rename = "SceneOptions"))]
pub(crate) struct SceneAsked {
    theme: ThemeAsked,
    pub(crate) model: bool,
    pub(crate) base_wireframe: bool,
    pub(crate) cage: bool,
    pub(crate) floor: bool,
    pub(crate) original: bool,
    pub(crate) colour: Colour,
    /// Colours of weights span 0 to 1, not 0 to the largest.
    pub(crate) weights_to_one: bool,
    pub(crate) slice: SliceShown,
    pub(crate) gizmo: GizmoAsked,
    /// The cage steps back: the model itself is pulled.
    pub(crate) pull: bool,
    /// Side by side, from the left. Those by formula only once they are there; harmonic ones alone are no comparison.
    pub(crate) compare: Vec<Coordinates>,
    pub(crate) problems: bool,
    /// Joints are shown as they will be exported; null for none.
    pub(crate) joints: Option<JointsAsked>,
}

impl Default for SceneAsked {
    fn default() -> Self {
        Self {
            theme: ThemeAsked::Dark,
            model: true,
            base_wireframe: false,
            cage: true,
            floor: true,
            original: false,
            colour: Colour::Material,
            weights_to_one: false,
            slice: SliceShown::Off,
            gizmo: GizmoAsked::None,
            pull: true,
            compare: vec![Coordinates::Harmonic],
            problems: true,
            joints: None,
        }
    }
}

impl SceneAsked {
    pub(crate) fn theme(&self) -> Theme {
        match self.theme {
            ThemeAsked::Light => Theme::Light,
            ThemeAsked::Dark => Theme::Dark,
        }
    }
}

#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
#[cfg_attr(test, ts(rename = "Theme"))]
pub(crate) enum ThemeAsked {
    Light,
    Dark,
}

/// What colours of the mesh mean.
#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
pub(crate) enum Colour {
    Material,
    Clay,
    Weight,
    Error,
}

/// How the model follows the cage.
#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
pub(crate) enum Coordinates {
    Harmonic,
    MeanValue,
    Green,
}

/// What the slice shows.
#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
pub(crate) enum SliceShown {
    Off,
    Kinds,
    Value,
}

/// The gizmo.
#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
#[cfg_attr(test, ts(rename = "Gizmo"))]
pub(crate) enum GizmoAsked {
    None,
    Move,
    Rotate,
    Scale,
}

/// A part of the gizmo: an axis, the plane normal to it, or the whole.
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

/// How the model is pulled.
#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[cfg_attr(test, ts(rename = "PullOptions"))]
pub(crate) struct PullAsked {
    /// How far along the surface, over the model's size; null for automatic.
    pub(crate) reach: Option<f64>,
    /// The whole model follows.
    pub(crate) whole: bool,
    /// Mirror images stay mirror images.
    pub(crate) mirrored: bool,
}

/// What becomes of a rig.
#[derive(Clone, Deserialize)]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
#[cfg_attr(test, ts(rename = "RigOptions"))]
pub(crate) struct RigAsked {
    joints: JointsAsked,
    /// Clips travel as far as they did.
    keep_travel: bool,
    /// Names of what hangs on the skeleton and keeps its shape.
    #[serde(default)]
    rigid: Vec<String>,
    /// The shape alone.
    pub(crate) plain: bool,
    /// The cage bends the model while a clip moves it.
    pub(crate) dynamic: bool,
}

#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
#[cfg_attr(test, ts(rename = "Joints"))]
pub(crate) enum JointsAsked {
    Follow,
    Stay,
    Turn,
}

impl RigAsked {
    pub(crate) fn options(&self) -> ReshapeOptions {
        let joints = match self.joints {
            JointsAsked::Follow => Joints::Follow,
            JointsAsked::Stay => Joints::Stay,
            JointsAsked::Turn => Joints::Turn,
        };
        let (keep_travel, rigid) = (self.keep_travel, self.rigid.clone());
        ReshapeOptions { joints, keep_travel, rigid, ..ReshapeOptions::default() }
    }
}

#[cfg(test)]
impl Default for RigAsked {
    fn default() -> Self {
        Self {
            joints: JointsAsked::Follow,
            keep_travel: false,
            rigid: Vec::new(),
            plain: false,
            dynamic: false,
        }
    }
}

/// A word or an object that JavaScript says, typed there as what it becomes here.
///
/// # Errors
/// `Argument` when it is something else: the page and the wasm file are of different versions.
pub(crate) fn taken<T: DeserializeOwned>(said: JsValue) -> Answer<T> {
    serde_wasm_bindgen::from_value(said)
        .map_err(|error| Fault::new(ErrorName::Error, value_fault(&error.to_string())))
}
