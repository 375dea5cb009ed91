//! The part of a document that panels show.

use serde::Serialize;

use crate::document::Transition;
use crate::surface::SurfacePoint;

/// The part of a document that panels show. Meshes are read separately when their keys change.
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
    /// How the animation of the saved poses goes from one to the next, and how it ends.
    pub transition: Transition,
    /// Length of this animation, seconds.
    pub animation_seconds: f32,
    /// Surface points that pulls keep in place.
    pub pins: Vec<SurfacePoint>,
    /// Whether the pose differs from the cage at rest.
    pub posed: bool,
    /// Whether the cage is being reshaped.
    pub editing_rest: bool,
    /// Identifier of the built-in sample that is open.
    pub sample: Option<String>,
    /// Whether the cage is the one of the sample.
    pub sample_cage: bool,
    /// The selection.
    pub selected: SelectionView,
    /// Changes with each step, undo and redo.
    pub steps: u64,
    /// Label of the step that undo reverts.
    pub undo: Option<String>,
    /// Label of the step that redo repeats.
    pub redo: Option<String>,
    /// Number of steps that were dropped because the history exceeded its limit.
    pub forgotten: usize,
}

/// A saved pose.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct PoseView {
    /// Name of the pose.
    pub name: String,
    /// Whether the pose belongs to the current cage rather than a replaced one.
    pub fits: bool,
    /// Time in the animation, seconds; 0 if the pose belongs to a replaced cage.
    pub seconds: f32,
}

/// The selection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct SelectionView {
    /// Number of selected vertices.
    pub count: usize,
    /// The vertex that was selected last.
    pub last: Option<u32>,
    /// Centre of the selection, object units; null without a selection and during a gesture.
    pub center: Option<[f32; 3]>,
}
