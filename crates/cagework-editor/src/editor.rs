//! The editor: a document, its history and its selection.

use std::sync::Arc;

use cagework_core::view::View;
use cagework_core::{Bounds, PolygonMesh};
use cagework_io::{Model, WritePieces, write_project_in_pieces};
use cagework_pose::blend::{VertexCountError, blend};
use cagework_pose::humanoid::{Bone, Humanoid, HumanoidError};
use cagework_pose::proportions::{HumanoidCage, Proportions};
use cagework_pose::symmetry::Symmetry;
use glam::{Vec2, Vec3};

use crate::controls::RestCage;
use crate::document::{Document, Key, NamedPose, ScaledPose, Transition, cage_id};
use crate::edit::{
    Constraint, Element, Gesture, GestureKind, Pull, SelectMode, Selection, SharedPull, Topology,
};
use crate::error::EditError;
use crate::history::History;
use crate::humanoid::{HumanoidCache, HumanoidInfo};
use crate::models::{Models, NewModel};
use crate::options::{PROPORTIONAL_RADIUS, Tools};
use crate::settings::DocumentSettings;
use crate::surface::SurfacePoint;
use crate::view::{DocumentView, PoseView, SelectionView};
use crate::walk::{Walk, WalkInfo};

/// A document, its history and its selection.
///
/// Methods change the document immediately. [`Self::commit`] adds one step with all changes since the last step.
#[derive(Debug, Default)]
pub struct Editor {
    document: Document,
    /// The document as of the last history step, without changes since then.
    committed: Document,
    history: History,
    /// Number of openings, steps, undos and redos so far.
    steps: u64,
    /// The last number that was assigned as a key of models, a mesh or a cage.
    keys: u64,
    topology: Topology,
    symmetry: Symmetry,
    editing_rest: bool,
    /// Value of `steps` after the step with which reshaping reset the pose; `None` without such a step.
    reset_at: Option<u64>,
    /// Whether a model was painted since the last step.
    is_painting: bool,
    gesture: Option<Gesture>,
    /// Selected vertices of the cage and its inner controls.
    pub selection: Selection,
    /// Vertices of the element under the pointer.
    pub hovered: Vec<u32>,
    tools: Tools,
    humanoid: HumanoidCache,
    /// Rig whose clips the cage follows.
    walk: Option<Walk>,
    /// Identifier of the last cage that was replaced, and the factors of the proportions that its pose contained.
    replaced: (u32, Proportions),
}

/// Contents that are opened together with models.
#[derive(Clone, Debug, Default)]
pub struct Contents {
    /// The cage, if there is one.
    pub cage: Option<RestCage>,
    /// Saved poses, in their order in lists and in the animation.
    pub poses: Vec<NamedPose>,
    /// Share of each saved pose in the current pose. `[n_poses]`, or shorter: missing shares are 0
    pub shares: Vec<f32>,
    /// How the animation of the saved poses goes from one to the next, and how it ends.
    pub transition: Transition,
    /// Surface points that pulls keep in place.
    pub pins: Vec<SurfacePoint>,
    /// Humanoid bones, and the names of the joints that the user has given them.
    pub bones: Vec<(Bone, String)>,
    /// Identifier of the built-in sample that the contents belong to, if any.
    pub sample: Option<String>,
}

impl Editor {
    /// Creates an editor with a history limit in bytes.
    #[must_use]
    pub fn with_history_limit(bytes: usize) -> Self {
        Self { history: History::with_limit(bytes), ..Self::default() }
    }

    /// The current document, including changes since the last history step.
    #[must_use]
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// Whether the pose is that of the last history step.
    #[must_use]
    pub fn is_pose_committed(&self) -> bool {
        Arc::ptr_eq(&self.document.pose, &self.committed.pose)
    }

    /// The document as of the last history step, without changes since then.
    pub(crate) fn committed(&self) -> &Document {
        &self.committed
    }

    pub(crate) fn document_mut(&mut self) -> &mut Document {
        &mut self.document
    }

    /// Replaces models and contents, and clears the history.
    pub fn open(&mut self, models: impl IntoIterator<Item = NewModel>, contents: Contents) {
        let Contents { cage, poses, mut shares, transition, pins, bones, sample } = contents;
        let tools = Tools { element: Element::default(), symmetry: false, ..self.tools };
        let (keys, steps) = (self.keys, self.steps + 1);
        let limit = self.history.limit();
        shares.resize(poses.len(), 0.0);
        *self = Self { tools, keys, steps, ..Self::with_history_limit(limit) };
        let has_sample_cage = sample.is_some() && cage.is_some();
        let mut all = Models::default();
        all.add(models);
        bones.into_iter().for_each(|(bone, joint)| all.set_bone(bone, Some(joint)));
        self.document = Document {
            models: all,
            poses: Arc::new(poses),
            shares: shares.into(),
            transition: transition.within_limits(),
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

    /// Moves the cage to the pose in the settings of a project, without adding a step to the history. If the settings
    /// contain no pose, the cage is at rest and all shares are 0.
    ///
    /// # Errors
    /// If the pose is damaged or belongs to another cage. The cage is at rest then.
    pub fn take_pose(&mut self, settings: &DocumentSettings) -> Result<(), &'static str> {
        let pose = settings.pose_of(&self.document);
        match &pose {
            Ok(Some(pose)) if self.set_pose(pose.clone()).is_ok() => {
                self.document.proportions = settings.proportions;
            }
            _ => self.reset_pose(),
        }
        self.amend();
        pose.map(|_| ())
    }

    /// Adds models; keeps cage and pose. Returns the ids of the models.
    pub fn add_models(&mut self, models: impl IntoIterator<Item = NewModel>) -> std::ops::Range<u32> {
        let first = self.document.models.next_id();
        // Adding models never fails.
        let _ = self.change_models(|all| {
            all.add(models);
            Ok(())
        });
        first..self.document.models.next_id()
    }

    /// Replaces a model by one with the same surface, see [`Models::replace`]; keeps cage and poses. Returns the id of the
    /// new model.
    ///
    /// # Errors
    /// If there is no such model. Nothing changes then.
    pub fn replace_model(&mut self, id: u32, model: Model) -> Result<u32, EditError> {
        let own = self.document.models.next_id();
        self.change_models(|all| all.replace(id, model))?;
        Ok(own)
    }

    /// Changes the [painted amounts](crate::Member::painted) of a model. The key of the models changes only at the next
    /// step, so that the dabs of a stroke do not trigger updates of derived data.
    pub fn paint(&mut self, id: u32, change: impl FnOnce(&mut Vec<u8>)) {
        if let Some(painted) = self.document.models.painted_mut(id) {
            change(painted);
            self.is_painting = true;
        }
    }

    /// Adds a step with all changes since the last step; false if nothing has changed.
    pub fn commit(&mut self, label: impl Into<String>) -> bool {
        if std::mem::take(&mut self.is_painting) && self.document.models != self.committed.models {
            self.document.models_key = self.next_key();
        }
        if self.document.is_same(&self.committed) {
            return false;
        }
        let before = std::mem::replace(&mut self.committed, self.document.clone());
        self.history.push(label.into(), before, &self.document);
        self.steps += 1;
        true
    }

    /// Adds all changes since the last step to that step.
    pub fn amend(&mut self) {
        self.committed = self.document.clone();
    }

    /// Reverts all changes since the last step.
    pub fn revert(&mut self) {
        self.is_painting = false;
        self.set_document(self.committed.clone());
    }

    /// Undoes the last step; false if there is no step to undo. Keeps the visibility of models.
    pub fn undo(&mut self) -> bool {
        self.go(History::undo)
    }

    /// Redoes the step that was undone last; false if nothing was undone.
    pub fn redo(&mut self) -> bool {
        self.go(History::redo)
    }

    fn go(&mut self, way: fn(&mut History, &mut Document) -> bool) -> bool {
        let mut document = self.committed.clone();
        let went = way(&mut self.history, &mut document);
        if went {
            self.steps += 1;
            if document.models.show_as(&self.document.models) {
                document.models_key = self.next_key();
            }
            self.set_document(document);
            self.amend();
            if self.document.is_posed() {
                self.editing_rest = false;
            }
        }
        went
    }

    /// Clears the history, so that earlier steps can be neither undone nor redone.
    pub fn clear_history(&mut self) {
        self.history = History::with_limit(self.history.limit());
    }

    /// Replaces the document and drops the gesture in progress. Clears the selection if the cage differs.
    pub(crate) fn set_document(&mut self, document: Document) {
        let has_other_cage = document.cage_key != self.document.cage_key;
        self.document = document;
        self.gesture = None;
        if has_other_cage {
            self.follow_cage();
        }
    }

    /// Replaces the cage at rest, resets the pose to it, and sets the shares of all saved poses to 0.
    pub(crate) fn set_cage(&mut self, cage: RestCage) {
        self.replaced = (self.document.cage_id, self.document.proportions);
        self.document.cage_key = self.next_key();
        self.document.cage_id = cage_id(&cage.mesh);
        self.document.pose = cage.mesh.positions.as_slice().into();
        self.document.proportions = Proportions::default();
        self.document.cage = Arc::new(cage);
        self.document.shares = vec![0.0; self.document.poses.len()].into();
        self.follow_cage();
    }

    /// Recomputes topology and symmetry for the current cage. Clears the selection and drops the gesture in progress.
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

    /// Extends the selection to whole connected components.
    pub fn select_linked(&mut self) {
        self.selection.linked(&self.topology);
    }

    /// Selects the ring through vertices of the cage, see [`Topology::ring`]. Returns whether there is one.
    pub fn select_ring(&mut self, through: &[u32], mode: SelectMode) -> bool {
        let ring = self.topology.ring(through, &self.document.cage.mesh.positions);
        ring.is_some_and(|ring| {
            self.selection.change(&ring, mode);
            true
        })
    }

    /// Identifies the inputs of a bind.
    #[must_use]
    pub fn key(&self) -> Key {
        self.document.key()
    }

    /// Identifies the models with their options and [painted amounts](crate::Member::painted).
    #[must_use]
    pub fn models_key(&self) -> u64 {
        self.document.models_key
    }

    /// Faces and edges of the cage, and edges of inner controls.
    #[must_use]
    pub fn topology(&self) -> &Topology {
        &self.topology
    }

    /// Mirror images among the vertices of the cage at rest.
    #[must_use]
    pub fn symmetry(&self) -> &Symmetry {
        &self.symmetry
    }

    /// Bounds of models and cage at rest; `None` if there is neither.
    #[must_use]
    pub fn bounds(&self) -> Option<Bounds> {
        let (models, cage) = (self.document.models.positions(), &self.document.cage.mesh.positions);
        match (Bounds::around(models), Bounds::around(cage)) {
            (Some(a), Some(b)) => Some(Bounds { min: a.min.min(b.min), max: a.max.max(b.max) }),
            (one, other) => one.or(other),
        }
    }

    /// The cage without inner controls, at rest or as reshaped so far.
    #[must_use]
    pub fn cage_as_shown(&self) -> PolygonMesh {
        let cage = &self.document.cage;
        let positions: &[Vec3] = if self.editing_rest { &self.document.pose } else { &cage.mesh.positions };
        PolygonMesh { positions: positions[..cage.n_cage()].to_vec(), faces: cage.mesh.faces.clone() }
    }

    /// Whether the cage is being reshaped rather than posed.
    #[must_use]
    pub fn is_editing_rest(&self) -> bool {
        self.editing_rest
    }

    /// Starts or ends reshaping. The start resets the pose to the rest position, as a step with this label. The end removes
    /// this step, which restores the pose, if it contains no other change and nothing has changed since.
    pub fn set_editing_rest(&mut self, editing: bool, label: &str) {
        if self.editing_rest == editing {
            return;
        }
        self.editing_rest = editing;
        self.gesture = None;
        if editing {
            let is_committed = self.document.is_same(&self.committed);
            self.reset_pose();
            self.reset_at = (self.commit(label) && is_committed).then_some(self.steps);
            return;
        }
        self.tools.element = Element::Vertex;
        let is_unchanged = self.reset_at == Some(self.steps) && self.document.is_same(&self.committed);
        if is_unchanged {
            self.go(History::retract);
        } else {
            self.reset_pose();
        }
        self.reset_at = None;
    }

    pub(crate) fn reset_pose(&mut self) {
        if self.document.is_posed() {
            self.document.pose = self.document.cage.mesh.positions.as_slice().into();
        }
        self.document.proportions = Proportions::default();
        if self.document.shares.iter().any(|&share| share != 0.0) {
            self.document.shares = vec![0.0; self.document.poses.len()].into();
        }
    }

    /// Moves the controls to `positions`, `[n_controls]`, object units.
    ///
    /// # Errors
    /// If the number of positions is wrong, or one is not finite.
    pub fn set_pose(&mut self, positions: Vec<Vec3>) -> Result<(), EditError> {
        let (given, expected) = (positions.len(), self.document.pose.len());
        if given != expected {
            return Err(VertexCountError { given, expected }.into());
        }
        if !positions.iter().all(|p| p.is_finite()) {
            return Err(EditError::NotFinite { what: "positions" });
        }
        if *self.document.pose != *positions {
            self.document.replace_pose(positions.into());
        }
        Ok(())
    }

    /// Sets the pose that factors make of `own`, the pose with factors of 1. `[n_controls]` each
    pub(crate) fn set_scaled_pose(&mut self, factors: Proportions, own: Arc<[Vec3]>, pose: Arc<[Vec3]>) {
        self.document.proportions = factors;
        self.document.scaled_from = Some(ScaledPose { factors, pose: Arc::clone(&pose), own });
        self.document.pose = pose;
    }

    /// Factors of the proportions that the pose of the cage `id` contained when it was replaced.
    pub(crate) fn proportions_with(&self, id: u32) -> Proportions {
        if self.replaced.0 == id { self.replaced.1 } else { Proportions::default() }
    }

    /// Humanoid bones of the models, for panels; `None` if the models have no skeleton.
    pub fn humanoid_info(&mut self) -> Option<HumanoidInfo> {
        self.humanoid.info(&self.document)
    }

    pub(crate) fn humanoid_cache(&mut self) -> &mut HumanoidCache {
        &mut self.humanoid
    }

    /// Humanoid bones of the models of this document or of a changed copy of it.
    pub(crate) fn humanoid_of(&mut self, document: &Document) -> Result<Humanoid, HumanoidError> {
        self.humanoid.humanoid(document)
    }

    /// The cage, prepared for proportions. Computed once for each cage and models.
    ///
    /// # Errors
    /// If the models are not a humanoid, or there is no cage.
    pub fn humanoid_cage(&mut self) -> Result<Arc<HumanoidCage>, EditError> {
        self.humanoid.cage(&self.document)
    }

    /// Moves the cage to its pose at a time of the animation of the saved poses, seconds, and sets the shares of the
    /// poses.
    pub fn play_at(&mut self, seconds: f32) {
        let poses: Vec<Vec<Vec3>> =
            self.document.fitting_poses().map(|pose| pose.positions.to_vec()).collect();
        let shares = self.document.timeline().shares(seconds);
        if let Ok(positions) = blend(&self.document.cage.mesh.positions, &poses, &shares) {
            // `blend` returns one position per control, so this cannot fail.
            let _ = self.set_pose(positions);
            let Document { poses, .. } = &self.document;
            let mut of_fitting = shares.iter();
            let share = |pose| if self.document.fits(pose) { of_fitting.next().copied() } else { None };
            let shares: Arc<[f32]> = poses.iter().map(share).map(Option::unwrap_or_default).collect();
            let at = shares.iter().position(|&share| share == 1.0);
            // The blend of factors is not the factor of the blend.
            self.document.proportions = at.map(|k| poses[k].proportions).unwrap_or_default();
            self.document.shares = shares;
        }
    }

    /// Fits a humanoid rig with clips to the models, so that [`Self::walk_at`] moves the cage. Takes up to seconds.
    ///
    /// # Errors
    /// [`EditError`] without a cage, or if the rig is not a humanoid with clips.
    pub fn set_walk(&mut self, rig: &Model) -> Result<WalkInfo, EditError> {
        let (walk, info) = Walk::new(&self.document, rig)?;
        self.walk = Some(walk);
        Ok(info)
    }

    /// The fitted rig, if it was fitted to the current models and cage.
    fn walk(&self) -> Option<&Walk> {
        self.walk.as_ref().filter(|walk| walk.key == self.document.key())
    }

    /// Moves the cage to its pose at a time of a clip of the fitted rig, seconds. Like a gesture, this is not a step of the
    /// history until it is committed. False if no rig is fitted to these models and this cage.
    pub fn walk_at(&mut self, clip: usize, seconds: f32) -> bool {
        let pose = self.walk().map(|walk| walk.poses.at(clip, seconds).0);
        pose.is_some_and(|pose| self.set_pose(pose).is_ok())
    }

    /// Joints of the fitted rig in the models at rest, object units. Empty without one.
    #[must_use]
    pub fn walk_joints(&self) -> Vec<Vec3> {
        self.walk().map_or_else(Vec::new, |walk| walk.joints.clone())
    }

    /// Radius of proportional editing, object units; 0 while it is off.
    #[must_use]
    pub fn reach(&self) -> f32 {
        let diagonal = Bounds::around(&self.document.cage.mesh.positions).map_or(0.0, |b| b.diagonal());
        if self.tools.proportional_on { self.tools.proportional as f32 * diagonal } else { 0.0 }
    }

    /// Share of the movement that each vertex makes in a gesture that starts at `positions`.
    #[must_use]
    pub fn pull(&self, positions: &[Vec3]) -> Pull {
        let rest = &self.document.cage.mesh.positions;
        let symmetry = self.tools.symmetry.then_some(&self.symmetry);
        let radius = self.reach();
        Pull::new(&self.selection, positions, rest, SharedPull { radius, symmetry })
    }

    /// Starts a gesture; false if nothing is selected or another gesture is in progress.
    pub fn begin(&mut self, kind: GestureKind, pointer: Vec2, constraint: Constraint) -> bool {
        let pose = self.document.pose.to_vec();
        let Some(pivot) = self.selection.pivot(&pose, &self.topology, self.tools.pivot) else { return false };
        if self.gesture.is_some() {
            return false;
        }
        let pull = self.pull(&pose);
        let mut gesture = Gesture::new(kind, pose, pull, pivot, pointer);
        gesture.constrain(constraint);
        self.gesture = Some(gesture);
        true
    }

    /// The gesture in progress, if there is one.
    #[must_use]
    pub fn gesture(&self) -> Option<&Gesture> {
        self.gesture.as_ref()
    }

    /// Changes the gesture in progress and moves the cage accordingly.
    pub fn drag(&mut self, view: &dyn View, change: impl FnOnce(&mut Gesture)) {
        if let Some(mut gesture) = self.gesture.take() {
            change(&mut gesture);
            let positions = gesture.positions(view);
            self.gesture = Some(gesture);
            // `set_pose` rejects positions that are not finite: the cage then keeps its pose.
            let _ = self.set_pose(positions);
        }
    }

    /// How clicks and gestures act on the cage.
    #[must_use]
    pub fn tools(&self) -> Tools {
        self.tools
    }

    /// Changes how clicks and gestures act on the cage, and updates the gesture in progress. Radii outside the range of
    /// [`PROPORTIONAL_RADIUS`] become its nearest end.
    pub fn set_tools(&mut self, tools: Tools, view: &dyn View) {
        let proportional = PROPORTIONAL_RADIUS
            .slider
            .map_or(tools.proportional, |of| tools.proportional.clamp(of.min, of.max));
        self.tools = Tools { proportional, ..tools };
        if let Some(gesture) = &self.gesture {
            let pull = self.pull(gesture.start());
            self.drag(view, |gesture| gesture.set_pull(pull));
        }
    }

    /// Ends the gesture; keeps its movement, or reverts it if `keep` is false. True if a movement was kept.
    pub fn end(&mut self, keep: bool) -> bool {
        let Some(gesture) = self.gesture.take() else { return false };
        let moved = gesture.start() != &*self.document.pose;
        if !keep {
            let _ = self.set_pose(gesture.start().to_vec());
        }
        keep && moved
    }

    /// Moves the selection by a vector, object units; false if nothing is selected or the vector is not finite.
    pub fn shift(&mut self, by: Vec3) -> bool {
        if self.selection.is_empty() || !by.is_finite() {
            return false;
        }
        let pose = self.document.pose.to_vec();
        let moved = self.pull(&pose).apply(&pose, &|p, share| p + share * by);
        self.set_pose(moved).is_ok()
    }

    /// Writes a project file with the document and `settings`, a JSON object with the caller's other settings.
    ///
    /// # Errors
    /// If no model is open, or the file would be too large.
    pub fn write_project(&self, settings: &str) -> Result<Vec<u8>, EditError> {
        let mut file = Vec::new();
        self.write_project_in_pieces(settings, u64::MAX, &mut |pieces| file = pieces.concat())?;
        Ok(file)
    }

    /// As [`Self::write_project`], for a file of at most `limit` bytes. `write` is called once with the pieces of the file,
    /// which borrow the models.
    ///
    /// # Errors
    /// If no model is open, or the file would be larger than `limit`.
    pub fn write_project_in_pieces(
        &self,
        settings: &str,
        limit: u64,
        write: &mut WritePieces<'_>,
    ) -> Result<(), EditError> {
        let Document { models, cage, poses, .. } = &self.document;
        let models: Vec<&Model> = models.iter().map(|member| &*member.model).collect();
        let poses: Vec<(String, Vec<Vec3>)> =
            poses.iter().map(|pose| (pose.name.to_string(), pose.positions.to_vec())).collect();
        let settings = DocumentSettings::from_document(&self.document).beside(settings);
        Ok(write_project_in_pieces(&models, &cage.mesh, &poses, &settings, limit, write)?)
    }

    /// The part of the document that panels show.
    #[must_use]
    pub fn view(&self) -> DocumentView {
        let Document {
            poses,
            shares,
            transition,
            pins,
            sample,
            has_sample_cage,
            models_key,
            cage_key,
            cage_id,
            mesh_key,
            ..
        } = &self.document;
        let unmatched = if self.tools.symmetry { self.symmetry.unmatched().len() } else { 0 };
        let mut seconds = self.document.pose_seconds().into_iter();
        let pose_view = |pose: &NamedPose| {
            let fits = self.document.fits(pose);
            let seconds = if fits { seconds.next().unwrap_or_default() } else { 0.0 };
            PoseView {
                name: pose.name.to_string(),
                fits,
                seconds,
                interpolation: pose.interpolation,
                hash: hash_of(&pose.positions),
            }
        };
        let center = || self.selection.center(&self.document.pose).map(|c| c.to_array());
        DocumentView {
            models: *models_key,
            mesh: *mesh_key,
            cage: *cage_key,
            cage_id: *cage_id,
            poses: poses.iter().map(pose_view).collect(),
            shares: shares.to_vec(),
            modified: self.document.is_modified(),
            transition: transition.clone(),
            animation_seconds: self.document.timeline().seconds(),
            pins: pins.to_vec(),
            posed: !self.editing_rest && self.document.is_posed(),
            factors: self.document.factors(),
            preset: self.document.preset().map(str::to_owned),
            scaled: self.document.proportions != Proportions::default(),
            editing_rest: self.editing_rest,
            sample: sample.as_deref().map(str::to_owned),
            sample_cage: *has_sample_cage,
            selected: SelectionView {
                count: self.selection.vertices().len(),
                last: self.selection.last(),
                center: if self.gesture.is_some() { None } else { center() },
            },
            tools: self.tools,
            unmatched,
            steps: self.steps,
            undo: self.history.undo_label().map(str::to_owned),
            redo: self.history.redo_label().map(str::to_owned),
            forgotten: self.history.forgotten(),
        }
    }
}

/// Hash of the coordinates' bits: FNV-1a with 32-bit words instead of bytes.
fn hash_of(positions: &[Vec3]) -> u32 {
    let bits = positions.iter().flat_map(Vec3::to_array).map(f32::to_bits);
    bits.fold(0x811c_9dc5, |hash, bits| (hash ^ bits).wrapping_mul(0x0100_0193))
}
