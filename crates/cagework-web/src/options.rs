//! What JavaScript asks for: the option types of contract.ts.

use cagework_core::BindOptions;
use cagework_core::cage_gen::{CageOptions, Shape, Symmetry};
use cagework_core::edit::{Element, GestureKind, SelectMode};
use cagework_core::options::{Backend, Solver};
use cagework_gpu::render::Theme;
use serde::Deserialize;

use crate::error::{Answer, Fault};

/// `BindOptions`: those of the core, and where to compute.
#[derive(Clone, Copy, Deserialize)]
pub(crate) struct BindAsked {
    backend: Backend,
    #[serde(flatten)]
    options: BindOptions,
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
pub(crate) struct CageAsked {
    vertices: u32,
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
enum SymmetryAsked {
    Auto,
    On,
    Off,
}

impl From<CageAsked> for CageOptions {
    fn from(asked: CageAsked) -> Self {
        Self {
            target: asked.vertices,
            clearance: asked.margin,
            symmetry: match asked.symmetry {
                SymmetryAsked::Auto => Symmetry::Auto,
                SymmetryAsked::On => Symmetry::X,
                SymmetryAsked::Off => Symmetry::None,
            },
            shape: asked.shape,
            per_component: asked.per_component,
            voxels: asked.voxels,
        }
    }
}

/// `SceneOptions`.
#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
pub(crate) struct SceneAsked {
    theme: ThemeAsked,
    pub(crate) model: bool,
    pub(crate) base_wireframe: bool,
    pub(crate) cage: bool,
    pub(crate) floor: bool,
    pub(crate) original: bool,
    pub(crate) colour: Colour,
    pub(crate) slice: SliceShown,
    pub(crate) gizmo: GizmoAsked,
    pub(crate) compare: bool,
    pub(crate) problems: bool,
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
            slice: SliceShown::Off,
            gizmo: GizmoAsked::None,
            compare: false,
            problems: true,
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
enum ThemeAsked {
    Light,
    Dark,
}

/// What colours of the mesh mean.
#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Colour {
    Material,
    Clay,
    Weight,
    Error,
}

/// What the slice shows.
#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(crate) enum SliceShown {
    Off,
    Kinds,
    Value,
}

/// The gizmo.
#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(crate) enum GizmoAsked {
    None,
    Move,
    Rotate,
    Scale,
}

/// How to select, by its name.
pub(crate) fn select_mode(name: &str) -> Answer<SelectMode> {
    Ok(match name {
        "replace" => SelectMode::Replace,
        "add" => SelectMode::Add,
        "remove" => SelectMode::Remove,
        "toggle" => SelectMode::Toggle,
        other => return Err(unknown("way to select", other)),
    })
}

/// What clicks select, by its name.
pub(crate) fn element(name: &str) -> Answer<Element> {
    Ok(match name {
        "vertex" => Element::Vertex,
        "edge" => Element::Edge,
        "face" => Element::Face,
        other => return Err(unknown("element", other)),
    })
}

/// A gesture, by its name.
pub(crate) fn gesture(name: &str) -> Answer<GestureKind> {
    Ok(match name {
        "grab" => GestureKind::Grab,
        "rotate" => GestureKind::Rotate,
        "scale" => GestureKind::Scale,
        other => return Err(unknown("gesture", other)),
    })
}

/// A word that this program does not know: the page and the wasm file are of different versions.
pub(crate) fn unknown(what: &str, word: &str) -> Fault {
    Fault::new("Argument", format!("there is no {what} called {word:?}"))
}
