//! The part of a document that panels show.

use cagework_io::Interpolation;
use serde::Serialize;

use crate::document::Transition;
use crate::options::Tools;
use crate::surface::SurfacePoint;

/// The part of a document that panels show. Meshes are read separately when their keys change.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct DocumentView {
    /// Key that changes whenever the models, their options or the areas that the user fixed with the brush change.
    pub models: u64,
    /// Key that changes whenever the models' joined mesh changes.
    pub mesh: u64,
    /// Key that changes whenever the cage at rest changes.
    pub cage: u64,
    /// Identifies the content of the cage at rest; saved poses fit cages with equal identifiers.
    pub cage_id: u32,
    /// Names and times of the saved poses, in the order of the list.
    pub poses: Vec<PoseView>,
    /// Share of each saved pose in the current pose.
    pub shares: Vec<f32>,
    /// Whether the pose differs from the blend of the saved poses by `shares`.
    pub modified: bool,
    /// Name of the animation of the saved poses, how it goes from one to the next, and how it ends.
    pub transition: Transition,
    /// Length of the animation of the saved poses, seconds.
    pub animation_seconds: f32,
    /// Surface points that pulls keep in place.
    pub pins: Vec<SurfacePoint>,
    /// Whether the pose differs from the cage at rest; false while the cage is being reshaped.
    pub posed: bool,
    /// Factors of the humanoid's proportions, on the left and on the right. `[n_proportions, 2]`
    pub factors: Vec<f64>,
    /// Name of the preset that the factors are, if they are one.
    pub preset: Option<String>,
    /// Whether a factor differs from 1. An export then keeps the ground, unless the user has switched that off.
    pub scaled: bool,
    /// Whether the cage is being reshaped.
    pub editing_rest: bool,
    /// Identifier of the built-in sample that is open.
    pub sample: Option<String>,
    /// Whether the cage is the built-in one of `sample`; smoothing and inner controls may differ.
    pub sample_cage: bool,
    /// Number, last vertex and centre of the selected vertices.
    pub selected: SelectionView,
    /// How clicks and gestures act on the cage.
    pub tools: Tools,
    /// Number of vertices without a mirror image; 0 unless gestures also move mirror images.
    pub unmatched: usize,
    /// Number of openings, steps, undos and redos so far.
    pub steps: u64,
    /// Label of the step that undo reverts.
    pub undo: Option<String>,
    /// Label of the step that redo repeats.
    pub redo: Option<String>,
    /// Number of steps that were dropped because the history exceeded its limit.
    pub forgotten: usize,
}

/// A saved pose, as panels show it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct PoseView {
    /// Name of the pose, as lists show it.
    pub name: String,
    /// Whether the pose was saved for the current cage.
    pub fits: bool,
    /// Time in the animation, seconds; 0 if `fits` is false.
    pub seconds: f32,
    /// Interpolation from the previous pose to this one; null uses that of the transition.
    pub interpolation: Option<Interpolation>,
    /// Hash of the positions, by which the page finds the pose's picture.
    pub hash: u32,
}

/// The selected vertices, as panels show them.
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
