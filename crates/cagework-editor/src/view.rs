//! What panels show of a document.

use serde::Serialize;

use crate::surface::SurfacePoint;

/// What panels show of a document. Meshes are read separately, when their keys change.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct DocumentView {
    /// Changes with the models, their options and painted amounts.
    pub models: u64,
    /// Changes with the models' joined mesh.
    pub mesh: u64,
    /// Changes with the cage at rest.
    pub cage: u64,
    /// Saved poses.
    pub poses: Vec<PoseView>,
    /// Share of each saved pose in the pose.
    pub shares: Vec<f32>,
    /// Points of the model that pulls leave in place.
    pub pins: Vec<SurfacePoint>,
    /// Whether the cage is posed.
    pub posed: bool,
    /// Whether the cage at rest is reshaped.
    pub editing_rest: bool,
    /// Identifier of the built-in sample that is open.
    pub sample: Option<String>,
    /// Whether the cage is that sample's own.
    pub sample_cage: bool,
    /// The selection.
    pub selected: SelectionView,
    /// Changes with each step, undo and redo.
    pub steps: u64,
    /// Label of the step that undo takes back.
    pub undo: Option<String>,
    /// Label of the step that redo repeats.
    pub redo: Option<String>,
    /// Steps that were dropped because the history exceeded its limit.
    pub forgotten: usize,
}

/// A saved pose.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct PoseView {
    /// Its name.
    pub name: String,
    /// Whether it belongs to the cage; poses of a cage that was replaced do not.
    pub fits: bool,
}

/// The selection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct SelectionView {
    /// Selected vertices.
    pub count: usize,
    /// The vertex that was selected last.
    pub last: Option<u32>,
    /// Centre of the selection, object units; none without a selection and during a gesture.
    pub center: Option<[f32; 3]>,
}
