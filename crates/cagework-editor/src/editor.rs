//! The editor: a document, its history, and what is selected in it.

use std::sync::Arc;

use cagework_core::view::View;
use cagework_core::{Bounds, PolygonMesh};
use cagework_pose::symmetry::Symmetry;
use glam::{Vec2, Vec3};

use crate::controls::RestCage;
use crate::document::{Document, Key, NamedPose};
use crate::edit::{
    Constraint, Element, Gesture, GestureKind, Pivot, Pull, Selection, SharedPull, Topology, moment,
};
use crate::error::EditError;
use crate::history::History;
use crate::models::{Models, NewModel};
use crate::surface::SurfacePoint;
use crate::view::{DocumentView, PoseView, SelectionView};

/// A document, its history, and the selection in it.
///
/// Methods that change the document do so at once; [`Self::commit`] makes one step of everything since the last step.
#[derive(Debug, Default)]
pub struct Editor {
    document: Document,
    /// The document at the last step.
    committed: Document,
    history: History,
    /// The last key that was given out.
    keys: u64,
    topology: Topology,
    symmetry: Symmetry,
    editing_rest: bool,
    gesture: Option<Gesture>,
    /// Selected vertices of the cage and its interior controls.
    pub selection: Selection,
    /// Vertices of the element under the pointer.
    pub hovered: Vec<u32>,
    /// What a click selects.
    pub element: Element,
    /// Centre of turns and scales.
    pub pivot: Pivot,
    /// Whether mirror images move along.
    pub is_mirrored: bool,
    /// Radius of proportional editing, diagonals of the cage; 0 for none.
    pub radius: f32,
}

/// What is opened besides models.
#[derive(Clone, Debug, Default)]
pub struct Contents {
    /// The cage; none if it is still to be made.
    pub cage: Option<RestCage>,
    /// Saved poses.
    pub poses: Vec<NamedPose>,
    /// Share of each saved pose in the pose. `[n_poses]`, or fewer: the others have none
    pub shares: Vec<f32>,
    /// Points of the model that pulls leave in place.
    pub pins: Vec<SurfacePoint>,
    /// Identifier of the built-in sample that it is.
    pub sample: Option<String>,
}

impl Editor {
    /// An editor whose history takes at most so many bytes.
    #[must_use]
    pub fn with_history_limit(bytes: usize) -> Self {
        Self { history: History::with_limit(bytes), ..Self::default() }
    }

    /// The document as it is now.
    #[must_use]
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// The document at the last step.
    pub(crate) fn committed(&self) -> &Document {
        &self.committed
    }

    pub(crate) fn document_mut(&mut self) -> &mut Document {
        &mut self.document
    }

    /// Opens other models; the history starts anew.
    pub fn open(&mut self, models: impl IntoIterator<Item = NewModel>, contents: Contents) {
        let Contents { cage, poses, mut shares, pins, sample } = contents;
        let (element, pivot) = (Element::default(), self.pivot);
        let (keys, limit) = (self.keys, self.history.limit());
        shares.resize(poses.len(), 0.0);
        *self = Self { keys, element, pivot, ..Self::with_history_limit(limit) };
        let has_sample_cage = sample.is_some() && cage.is_some();
        let mut all = Models::default();
        all.add(models);
        self.document = Document {
            models: all,
            poses: Arc::new(poses),
            shares: shares.into(),
            pins: pins.into(),
            sample: sample.map(Into::into),
            ..Document::default()
        };
        (self.document.mesh_key, self.document.models_key) = (self.next_key(), self.next_key());
        let shares = self.document.shares.clone();
        self.set_cage(cage.unwrap_or_default());
        self.document.shares = shares;
        self.document.has_sample_cage = has_sample_cage;
        self.amend();
    }

    /// Adds models; cage and pose stay.
    pub fn add_models(&mut self, models: impl IntoIterator<Item = NewModel>) {
        // Adding does not fail.
        let _ = self.change_models(|all| {
            all.add(models);
            Ok(())
        });
    }

    /// Makes one step of all changes since the last step; false if there were none.
    pub fn commit(&mut self, label: impl Into<String>) -> bool {
        if self.document.is_same(&self.committed) {
            return false;
        }
        let before = std::mem::replace(&mut self.committed, self.document.clone());
        self.history.push(label.into(), before, &self.document);
        true
    }

    /// Keeps all changes since the last step without making a step of them.
    pub fn amend(&mut self) {
        self.committed = self.document.clone();
    }

    /// Takes back all changes since the last step.
    pub fn revert(&mut self) {
        self.set_document(self.committed.clone());
    }

    /// Takes back the last step; false if there is none.
    pub fn undo(&mut self) -> bool {
        self.go(History::undo)
    }

    /// Repeats the step that was taken back last; false if there is none.
    pub fn redo(&mut self) -> bool {
        self.go(History::redo)
    }

    fn go(&mut self, way: fn(&mut History, &mut Document) -> bool) -> bool {
        let mut document = self.committed.clone();
        let went = way(&mut self.history, &mut document);
        if went {
            self.set_document(document);
            self.amend();
            if self.document.is_posed() {
                self.editing_rest = false;
            }
        }
        went
    }

    /// Drops all steps.
    pub fn clear_history(&mut self) {
        self.history = History::with_limit(self.history.limit());
    }

    /// Takes another document, and drops a selection in another cage.
    pub(crate) fn set_document(&mut self, document: Document) {
        let has_other_cage = document.cage_key != self.document.cage_key;
        self.document = document;
        self.gesture = None;
        if has_other_cage {
            self.follow_cage();
        }
    }

    /// Takes another cage at rest; shares of saved poses in the pose are 0.
    pub(crate) fn set_cage(&mut self, cage: RestCage) {
        self.document.cage_key = self.next_key();
        self.document.pose = cage.mesh.positions.as_slice().into();
        self.document.cage = Arc::new(cage);
        self.document.shares = vec![0.0; self.document.poses.len()].into();
        self.follow_cage();
    }

    /// Derives from the cage what picking and symmetry need.
    fn follow_cage(&mut self) {
        let cage = &self.document.cage;
        self.topology = Topology::new(&cage.mesh.faces);
        self.topology.edges.extend(cage.inner_edges());
        self.symmetry = Symmetry::new(&cage.mesh.positions);
        self.selection = Selection::new(cage.mesh.positions.len());
        self.hovered.clear();
        self.gesture = None;
    }

    pub(crate) fn change_models(
        &mut self,
        change: impl FnOnce(&mut Models) -> Result<(), EditError>,
    ) -> Result<(), EditError> {
        self.change_parts(change)?;
        self.document.mesh_key = self.next_key();
        (self.document.sample, self.document.has_sample_cage) = (None, false);
        Ok(())
    }

    pub(crate) fn change_parts(
        &mut self,
        change: impl FnOnce(&mut Models) -> Result<(), EditError>,
    ) -> Result<(), EditError> {
        change(&mut self.document.models)?;
        self.document.models_key = self.next_key();
        Ok(())
    }

    fn next_key(&mut self) -> u64 {
        self.keys += 1;
        self.keys
    }

    /// Identifies what weights are computed from.
    #[must_use]
    pub fn key(&self) -> Key {
        self.document.key()
    }

    /// Identifies the models with their options and painted amounts.
    #[must_use]
    pub fn models_key(&self) -> u64 {
        self.document.models_key
    }

    /// Faces and edges of the cage, and edges of interior controls.
    #[must_use]
    pub fn topology(&self) -> &Topology {
        &self.topology
    }

    /// Mirror images among the vertices of the cage at rest.
    #[must_use]
    pub fn symmetry(&self) -> &Symmetry {
        &self.symmetry
    }

    /// Bounds of models and cage at rest; none without either.
    #[must_use]
    pub fn bounds(&self) -> Option<Bounds> {
        let (models, cage) = (self.document.models.positions(), &self.document.cage.mesh.positions);
        match (Bounds::of(models), Bounds::of(cage)) {
            (Some(a), Some(b)) => Some(Bounds { min: a.min.min(b.min), max: a.max.max(b.max) }),
            (one, other) => one.or(other),
        }
    }

    /// The cage as it is reshaped, or at rest, without interior controls.
    #[must_use]
    pub fn cage_as_shown(&self) -> PolygonMesh {
        let cage = &self.document.cage;
        let positions: &[Vec3] = if self.editing_rest { &self.document.pose } else { &cage.mesh.positions };
        PolygonMesh { positions: positions[..cage.n_cage()].to_vec(), faces: cage.mesh.faces.clone() }
    }

    /// Whether the cage at rest is reshaped rather than posed.
    #[must_use]
    pub fn is_editing_rest(&self) -> bool {
        self.editing_rest
    }

    /// Starts or ends reshaping. The pose is the rest position afterwards.
    pub fn set_editing_rest(&mut self, editing: bool) {
        if self.editing_rest != editing {
            self.editing_rest = editing;
            self.gesture = None;
            if !editing {
                self.element = Element::Vertex;
            }
            self.reset_pose();
        }
    }

    pub(crate) fn reset_pose(&mut self) {
        if self.document.is_posed() {
            self.document.pose = self.document.cage.mesh.positions.as_slice().into();
        }
        if self.document.shares.iter().any(|&share| share != 0.0) {
            self.document.shares = vec![0.0; self.document.poses.len()].into();
        }
    }

    /// Moves the cage. `[n_controls]`
    ///
    /// # Errors
    /// When there are more or fewer positions, or one is not finite.
    pub fn set_pose(&mut self, positions: Vec<Vec3>) -> Result<(), EditError> {
        let (given, expected) = (positions.len(), self.document.pose.len());
        if given != expected {
            return Err(crate::edit::PoseError { given, expected }.into());
        }
        if !positions.iter().all(|p| p.is_finite()) {
            return Err(EditError::NotFinite { what: "positions" });
        }
        if *self.document.pose != *positions {
            self.document.pose = positions.into();
        }
        Ok(())
    }

    /// Moves the cage to a moment of the animation through all saved poses, a second each.
    pub fn play_at(&mut self, seconds: f32) {
        let poses: Vec<Vec<Vec3>> =
            self.document.fitting_poses().map(|pose| pose.positions.to_vec()).collect();
        if let Ok(positions) = moment(&self.document.cage.mesh.positions, &poses, seconds) {
            // As many as the cage has.
            let _ = self.set_pose(positions);
        }
    }

    /// How a gesture moves the cage from `positions`.
    #[must_use]
    pub fn pull(&self, positions: &[Vec3]) -> Pull {
        let rest = &self.document.cage.mesh.positions;
        let diagonal = Bounds::of(rest).map_or(0.0, |b| b.diagonal());
        let symmetry = self.is_mirrored.then_some(&self.symmetry);
        Pull::new(&self.selection, positions, rest, SharedPull { radius: self.radius * diagonal, symmetry })
    }

    /// Starts a gesture; false when nothing is selected or another one is in progress.
    pub fn begin(&mut self, kind: GestureKind, pointer: Vec2, constraint: Constraint) -> bool {
        let pose = self.document.pose.to_vec();
        let Some(pivot) = self.selection.pivot(&pose, &self.topology, self.pivot) else { return false };
        if self.gesture.is_some() {
            return false;
        }
        let pull = self.pull(&pose);
        let mut gesture = Gesture::new(kind, pose, pull, pivot, pointer);
        gesture.constrain(constraint);
        self.gesture = Some(gesture);
        true
    }

    /// The gesture in progress.
    #[must_use]
    pub fn gesture(&self) -> Option<&Gesture> {
        self.gesture.as_ref()
    }

    /// Changes the gesture in progress, and moves the cage as it says.
    pub fn drag(&mut self, view: &dyn View, change: impl FnOnce(&mut Gesture)) {
        if let Some(mut gesture) = self.gesture.take() {
            change(&mut gesture);
            let positions = gesture.positions(view);
            self.gesture = Some(gesture);
            // Not finite where the pointer is on the horizon: the cage stays.
            let _ = self.set_pose(positions);
        }
    }

    /// Sets the radius of proportional editing, also of the gesture in progress.
    pub fn set_radius(&mut self, radius: f32, view: &dyn View) {
        self.radius = radius.max(0.0);
        if let Some(gesture) = &self.gesture {
            let pull = self.pull(gesture.start());
            self.drag(view, |gesture| gesture.set_pull(pull));
        }
    }

    /// Ends the gesture: keeps what it moved, or moves the cage back. True when something was moved and is kept.
    pub fn end(&mut self, keep: bool) -> bool {
        let Some(gesture) = self.gesture.take() else { return false };
        let moved = gesture.start() != &*self.document.pose;
        if !keep {
            let _ = self.set_pose(gesture.start().to_vec());
        }
        keep && moved
    }

    /// Moves the selection; false when nothing is selected.
    pub fn shift(&mut self, by: Vec3) -> bool {
        if self.selection.is_empty() || !by.is_finite() {
            return false;
        }
        let pose = self.document.pose.to_vec();
        let moved = self.pull(&pose).apply(&pose, &|p, share| p + share * by);
        self.set_pose(moved).is_ok()
    }

    /// What panels show.
    #[must_use]
    pub fn view(&self) -> DocumentView {
        let Document { poses, shares, pins, sample, has_sample_cage, models_key, cage_key, mesh_key, .. } =
            &self.document;
        let pose_view =
            |pose: &NamedPose| PoseView { name: pose.name.to_string(), fits: self.document.fits(pose) };
        let center = || self.selection.center(&self.document.pose).map(|c| c.to_array());
        DocumentView {
            models: *models_key,
            mesh: *mesh_key,
            cage: *cage_key,
            poses: poses.iter().map(pose_view).collect(),
            shares: shares.to_vec(),
            pins: pins.to_vec(),
            posed: !self.editing_rest && self.document.is_posed(),
            editing_rest: self.editing_rest,
            sample: sample.as_deref().map(str::to_owned),
            sample_cage: *has_sample_cage,
            selected: SelectionView {
                count: self.selection.vertices().len(),
                last: self.selection.last(),
                center: if self.gesture.is_some() { None } else { center() },
            },
            undo: self.history.undo_label().map(str::to_owned),
            redo: self.history.redo_label().map(str::to_owned),
            forgotten: self.history.forgotten(),
        }
    }
}
