//! State of the engine on the CPU: the editor, data derived from its document, and the view. The next frame writes
//! changes to the GPU.

use std::collections::BTreeMap;
use std::rc::Rc;
use std::sync::Arc;

use cagework_cage::check::Problem;
use cagework_core::field::FieldWeights;
use cagework_core::slice::Slice;
use cagework_core::view::View as _;
use cagework_core::{Bounds, ControlSet, Coordinates, PolygonMesh};
use cagework_editor::{
    BoundDocument, BoundModels, Cache, CageWatch, Editor, Key, KnownGround, Models, Playback, PosedModels,
    RestCage, RigOptions, SurfacePoint,
};
use cagework_gpu::Session;
use cagework_gpu::render::{Camera, CameraPlace, DrawModel, GizmoPart};
use cagework_io::UpAxis;
use cagework_pose::parts::BoundParts;
use glam::{Vec2, Vec3};
use wasm_bindgen::JsValue;

use crate::error::{Answer, ErrorName, Fault};
use crate::options::JsSceneOptions;
use crate::views::View;

/// How far exports lift the models.
#[derive(Debug, Default)]
pub(crate) struct Lift {
    /// Pose and models that the height was computed for.
    of: Option<(Arc<[Vec3]>, u64)>,
    /// Height, object units.
    pub(crate) height: f32,
}

/// The editor's document, the camera, and derived data.
#[derive(Default)]
pub(crate) struct State {
    pub(crate) editor: Editor,
    /// Draw data of each model, by id.
    pub(crate) draws: BTreeMap<u32, Arc<DrawModel>>,
    /// Id of the model in paint mode, and how much each vertex of all models stays in place, from 0 to 1.
    /// `[n_vertices]`
    pub(crate) painting: Option<(u32, Arc<Vec<f32>>)>,
    /// Faults of the cage that the last check found.
    pub(crate) faults: Vec<Problem>,
    /// Finds vertices outside while the user reshapes the cage; computed on first use.
    pub(crate) watch: Option<CageWatch>,
    /// Weights of the current models and cage; `None` before a bind.
    pub(crate) bound: Option<Arc<BoundModels>>,
    /// Report of the bind, as JavaScript receives it.
    pub(crate) report: Rc<JsValue>,
    /// Parts of the models that stay in place or are rigid, prepared for the current weights. `None` if all vertices
    /// follow the cage.
    parts: Option<BoundParts>,
    /// Cached weights for documents in the history.
    pub(crate) cache: Cache<(Arc<BoundModels>, Rc<JsValue>)>,
    /// Notices from the last export: changes of the rig, and data that the file format loses.
    pub(crate) rig_notices: Vec<String>,
    ground: KnownGround,
    pub(crate) lift: Lift,
    /// Playback of a clip, shown instead of the pose.
    pub(crate) playing: Option<Playback>,
    /// Weights on a lattice around the cage. They deform splats, and models that a clip moves.
    pub(crate) lattice: Option<FieldWeights>,
    /// Indices of the splats outside the cage.
    pub(crate) floaters: Vec<u32>,
    /// Kinds of coordinates available for comparison.
    pub(crate) others: Vec<Coordinates>,
    pub(crate) active_part: Option<GizmoPart>,
    pub(crate) slice: Option<Arc<Slice>>,
    pub(crate) held: GrabState,
    /// Edges of the previewed cage.
    pub(crate) draft: Vec<[Vec3; 2]>,
    pub(crate) view: JsSceneOptions,
    pub(crate) camera: Camera,
    /// Placement of the camera after `frame_all`. If the camera is still there when the view is resized,
    /// `frame_all` is called again.
    framed: Option<CameraPlace>,
    /// Size of the viewport, CSS pixels.
    pub(crate) size: Vec2,
    /// Widths of the viewport's margins under overlays: left, top, right, bottom, CSS pixels.
    pub(crate) covered: [f32; 4],
    /// Device pixels per CSS pixel.
    pub(crate) scale: f32,
    /// Number of changes of the joined mesh and of the cage so far. The result of a job is valid only if the revision
    /// has not changed since the job started.
    pub(crate) revision: u32,
    /// Keys of the document that the derived state belongs to.
    derived: DerivedKeys,
    /// Keys of the data on the GPU. Where the document has other keys, an upload is needed.
    pub(crate) on_gpu: GpuKeys,
    /// Whether an upload is in progress. When it finishes, it compares document and GPU again.
    pub(crate) is_uploading: bool,
    /// Whether a playback is being prepared for a new pose.
    pub(crate) is_preparing: bool,
    /// Whether models are being added. Their upload may still fail, which removes them.
    pub(crate) is_adding: bool,
    pub(crate) is_moved: bool,
    pub(crate) is_changed: bool,
    /// Error of an upload, which the next frame reports.
    pub(crate) fault: Option<Fault>,
}

/// Keys and pose of the document that the derived data belongs to.
#[derive(Default)]
struct DerivedKeys {
    key: Key,
    models: u64,
    pose: Arc<[Vec3]>,
}

/// Keys of the data on the GPU; `None` for data that is not uploaded.
#[derive(Clone, Copy, Default, PartialEq)]
pub(crate) struct GpuKeys {
    pub(crate) mesh: Option<u64>,
    pub(crate) parts: Option<u64>,
    pub(crate) cage: Option<u64>,
    /// Key of the cage for which floaters (splats outside the cage) were computed.
    pub(crate) floaters: Option<u64>,
}

/// Marks of grabs and of an inner control that is being placed, and the posed models for picking.
#[derive(Default)]
pub(crate) struct GrabState {
    /// Surface points that are grabbed or hovered. Pins are stored in the document.
    pub(crate) points: Vec<SurfacePoint>,
    /// Target of the first grabbed point, if the point has not reached it.
    pub(crate) target: Option<Vec3>,
    /// How much each vertex of the model stays in place during the drag, 0 to 1. `[n_vertices]`
    pub(crate) stays: Option<Arc<Vec<f32>>>,
    /// Points of an inner control that is being placed.
    pub(crate) placed: Vec<Vec3>,
    /// Vertices of the models in the pose `posed_for` of the cage. `[n_vertices]`
    pub(crate) posed: Vec<Vec3>,
    pub(crate) posed_for: Vec<Vec3>,
}

impl State {
    pub(crate) fn models(&self) -> &Models {
        &self.editor.document().models
    }

    /// The cage at rest, or a draft that is not a valid cage.
    pub(crate) fn cage(&self) -> &RestCage {
        &self.editor.document().cage
    }

    /// Current positions of the cage's vertices and inner controls. `[n_controls]`
    pub(crate) fn pose(&self) -> &[Vec3] {
        &self.editor.document().pose
    }

    /// The control set for a bind; `None` if the cage is a draft.
    pub(crate) fn set(&self) -> Option<&ControlSet> {
        self.cage().set.as_ref().ok()
    }

    /// The control set for a bind.
    ///
    /// # Errors
    /// Without a cage, or if it is a draft.
    pub(crate) fn require_set(&self) -> Answer<&ControlSet> {
        self.set().ok_or_else(|| Fault::missing("cage", "make or open one first"))
    }

    /// Rest positions of the cage's vertices and inner controls, and faces of the cage or draft.
    pub(crate) fn rest(&self) -> &PolygonMesh {
        &self.cage().mesh
    }

    /// Drops data that was derived from an earlier document. Called after each change.
    pub(crate) fn follow_document(&mut self) {
        let document = self.editor.document();
        let (key, models, pose) = (document.key(), self.editor.models_key(), Arc::clone(&document.pose));
        let DerivedKeys { key: before, models: models_before, pose: pose_before } =
            std::mem::replace(&mut self.derived, DerivedKeys { key, models, pose: Arc::clone(&pose) });
        if key != before {
            self.revision += 1;
            self.watch = None;
            self.active_part = None;
            (self.slice, self.lattice, self.playing) = (None, None, None);
            self.floaters.clear();
            self.held = GrabState::default();
            self.others.clear();
            self.faults.clear();
            self.draft.clear();
            (self.bound, self.parts) = (None, None);
            self.editor.set_bind(None);
            if key.mesh != before.mesh {
                self.painting = None;
            }
            self.fit_camera();
        }
        if models != models_before {
            self.prepare_parts();
            self.show_painting();
            self.is_changed = true;
        }
        if key != before || models != models_before || !Arc::ptr_eq(&pose, &pose_before) {
            self.ground.take();
        }
        if key != before || !Arc::ptr_eq(&pose, &pose_before) {
            // Write the scene too: it contains the gizmo and the marks, whose positions depend on the pose.
            (self.is_moved, self.is_changed) = (true, true);
        }
    }

    /// Checks that the result of a job that was started at `revision` is still valid.
    ///
    /// # Errors
    /// `Cancelled` if mesh or cage have changed since that revision.
    pub(crate) fn require(&self, revision: u32) -> Answer<()> {
        let is_current = self.revision == revision;
        is_current
            .then_some(())
            .ok_or_else(|| Fault::new(ErrorName::Cancelled, "the model or the cage has changed"))
    }

    /// Up axis of the models' files.
    pub(crate) fn up(&self) -> UpAxis {
        self.models().up()
    }

    /// Passes the bounds of model and cage to the camera.
    pub(crate) fn fit_camera(&mut self) {
        self.place_viewport();
        if let Some(bounds) = self.editor.bounds() {
            self.camera.set_scene(bounds);
        }
    }

    /// Sets the camera's viewport: the whole view, or one of several pictures that are shown side by side. If the
    /// viewport changes and the camera is still where `frame_all` placed it, calls `frame_all` again.
    pub(crate) fn place_viewport(&mut self) {
        let is_framed = self.framed == Some(self.camera.place());
        let is_other = self.camera.set_free_part(Vec2::new(self.part_width(), self.size.y), self.covered);
        if is_framed && is_other {
            self.frame_all();
        }
    }

    /// Kinds of coordinates that are shown side by side; harmonic coordinates alone if none of the chosen kinds is
    /// available.
    pub(crate) fn shown(&self) -> Vec<Coordinates> {
        let is_there = |one: &Coordinates| *one == Coordinates::Harmonic || self.others.contains(one);
        let shown: Vec<_> = self.view.compare.iter().copied().filter(is_there).collect();
        if shown.is_empty() { vec![Coordinates::Harmonic] } else { shown }
    }

    fn part_width(&self) -> f32 {
        self.size.x / self.shown().len() as f32
    }

    /// Converts a pointer position to a position in the picture under it, CSS pixels.
    pub(crate) fn pointer(&self, x: f32, y: f32) -> Vec2 {
        self.pointers().at(x, y)
    }

    /// The mapping of pointer positions to the pictures side by side.
    pub(crate) fn pointers(&self) -> Pointers {
        Pointers { width: self.part_width(), last: self.shown().len() as f32 - 1.0 }
    }

    /// Creates a camera that frames these positions. Also returns the picture's size in pixels.
    pub(crate) fn view_of(&self, positions: &[Vec3]) -> (Camera, [u32; 2]) {
        let size = (self.size * self.scale).max(Vec2::ONE);
        let mut camera = Camera::default();
        camera.set_viewport(size);
        if let Some(bounds) = Bounds::around(positions) {
            camera.set_scene(bounds);
            camera.frame(bounds);
        }
        (camera, size.as_uvec2().to_array())
    }

    /// Fits the posed cage into the view; without a cage, the models.
    pub(crate) fn frame_all(&mut self) {
        let pose = self.pose();
        let mut camera = self.camera;
        camera.frame_points(if pose.is_empty() { self.models().positions() } else { pose });
        self.camera = camera;
        self.framed = Some(camera.place());
    }

    /// Recomputes how much each vertex stays in place, which is drawn as paint, for the model in paint mode.
    pub(crate) fn show_painting(&mut self) {
        let Some((id, _)) = self.painting else { return };
        let mut stays = vec![0.0; self.models().positions().len()];
        if let Ok(member) = self.models().get(id) {
            let own = member.parts().unwrap_or_default();
            stays[member.vertices.clone()].iter_mut().zip(own.stays).for_each(|(to, from)| *to = from);
        }
        self.painting = Some((id, Arc::new(stays)));
        self.is_changed = true;
    }

    /// Collects document and bind state for the page's panels.
    pub(crate) fn document_view(&self) -> View {
        View {
            document: self.editor.view(),
            bound: self.bound.is_some(),
            lattice: self.lattice.is_some(),
            floaters: self.floaters.len(),
        }
    }

    /// Uses `bound` as the weights of the current document, with the report of their bind, and ends the playback of a
    /// clip.
    pub(crate) fn set_bound(&mut self, (bound, report): (Arc<BoundModels>, Rc<JsValue>)) {
        self.editor.set_bind(Some(&bound.weights));
        (self.bound, self.report) = (Some(bound), report);
        self.playing = None;
        self.prepare_parts();
        (self.is_moved, self.is_changed) = (true, true);
    }

    /// Prepares the parts of the models that stay in place or are rigid for the current weights.
    fn prepare_parts(&mut self) {
        self.held.posed_for.clear();
        let models = self.models();
        self.parts = self.bound.as_ref().and_then(|bound| {
            let (weights, frames) = (&bound.weights, &bound.frames);
            models.parts().bound(models.positions(), weights, frames, &self.rest().positions)
        });
    }

    /// The document with its weights, for exports and playback.
    pub(crate) fn bound_document(&self) -> BoundDocument<'_> {
        BoundDocument {
            editor: &self.editor,
            bound: self.bound.as_ref(),
            parts: self.parts.as_ref(),
            lattice: self.lattice.as_ref(),
            ground: &self.ground,
        }
    }

    /// Recomputes the posed models if the cage's pose has changed.
    ///
    /// # Errors
    /// Before a bind.
    pub(crate) fn pose_models(&mut self) -> Answer<()> {
        let bound = self.bound_document();
        bound.require_bound()?;
        if self.held.posed_for != self.pose() {
            self.held.posed = bound.deformed(self.pose())?;
            self.held.posed_for = self.pose().to_vec();
        }
        Ok(())
    }

    /// The posed models, as of the last [`Self::pose_models`].
    pub(crate) fn posed_models(&self) -> PosedModels<'_> {
        PosedModels {
            editor: &self.editor,
            positions: &self.held.posed,
            is_playing: self.playing.is_some(),
            view: &self.camera,
        }
    }

    /// The models as the view shows them, for picking: those of a clip that can be pulled, otherwise [`Self::posed_models`].
    pub(crate) fn shown_models(&self) -> PosedModels<'_> {
        match self.pulled_clip() {
            Some(clip) => {
                PosedModels { positions: clip.positions_in_view(), is_playing: false, ..self.posed_models() }
            }
            None => self.posed_models(),
        }
    }

    /// The paused clip whose models can be pulled.
    pub(crate) fn pulled_clip(&self) -> Option<&Playback> {
        self.playing.as_ref().filter(|playing| playing.can_pull())
    }

    /// Moves a position of the posed models, `place`, so that the view shows it moved by CSS pixels parallel to the view
    /// plane. `point`: the surface point there, whose motion by a clip is taken into account.
    pub(crate) fn moved_in_view(&self, place: Vec3, by: Vec2, point: Option<SurfacePoint>) -> Vec3 {
        let in_clip = point.zip(self.pulled_clip()).and_then(|(point, clip)| {
            let shown = self.shown_models().place_of(point)?;
            let corners = self.models().corners(point.triangle)?;
            clip.before_clip(corners, point.bary, self.camera.in_view_plane(shown, by))
        });
        place + in_clip.unwrap_or_else(|| self.camera.in_view_plane(place, by))
    }

    /// Joins the draw data of all models.
    pub(crate) fn draw_model(&self) -> Arc<DrawModel> {
        joined(&self.models().iter().filter_map(|member| self.draws.get(&member.id)).collect::<Vec<_>>())
    }

    /// Whether the GPU has the mesh and the cage of the current document.
    pub(crate) fn is_on_gpu(&self) -> bool {
        let key = self.editor.key();
        self.set().is_some() && self.on_gpu.cage == Some(key.cage) && self.on_gpu.mesh == Some(key.mesh)
    }

    /// Options of a playback that should be prepared again for the current pose.
    pub(crate) fn stale_clip(&self) -> Option<RigOptions> {
        let playing = self.playing.as_ref().filter(|playing| playing.needs_update(&self.editor))?;
        Some(playing.options.clone())
    }

    /// Whether the GPU lacks data of the current document.
    pub(crate) fn needs_upload(&self) -> bool {
        self.next_upload().is_some()
    }

    /// Returns the next data to upload, in the order mesh, cage, weights, parts. An upload may invalidate data that
    /// comes later in this order.
    pub(crate) fn next_upload(&self) -> Option<Upload> {
        if self.models().is_empty() {
            return None;
        }
        let (key, parts, gpu) = (self.editor.key(), self.editor.models_key(), self.on_gpu);
        if gpu.mesh != Some(key.mesh) {
            Some(Upload::Mesh)
        } else if gpu.cage != Some(key.cage) && self.set().is_some() {
            Some(Upload::Cage)
        } else if self.bound.is_none() && self.is_on_gpu() && self.cache.contains(key) {
            Some(Upload::Weights)
        } else if gpu.parts != Some(parts) {
            Some(Upload::Parts)
        } else {
            None
        }
    }

    /// Marks all data as not uploaded. Called when the sessions drop the mesh, which also drops their weights.
    pub(crate) fn forget_gpu(&mut self) {
        self.on_gpu = GpuKeys::default();
        (self.bound, self.parts) = (None, None);
        self.editor.set_bind(None);
    }

    /// Marks the mesh of the current document as uploaded, and its weights and parts as not uploaded.
    pub(crate) fn has_uploaded_mesh(&mut self) {
        let cage = self.on_gpu.cage;
        self.on_gpu = GpuKeys { mesh: Some(self.editor.key().mesh), cage, ..GpuKeys::default() };
    }

    /// Writes the camera to the GPU sessions, and also playback, splats, pose and scene if they have changed.
    pub(crate) fn write<'a>(&mut self, main: &'a mut Session, others: impl Iterator<Item = &'a mut Session>) {
        self.update_lift();
        let scene = self.is_changed.then(|| self.scene());
        match &mut self.playing {
            Some(playing) if playing.is_new => {
                main.play(&playing.palette(), playing.targets());
                playing.is_new = false;
            }
            Some(_) => {}
            None => main.stop_playing(),
        }
        main.interrupt_playing(self.view.original);
        self.write_splats(main);
        for session in std::iter::once(main).chain(others) {
            *session.camera_mut() = self.camera;
            if self.is_moved && self.is_on_gpu() {
                let editing = self.editor.is_editing_rest();
                let at_rest = self.view.original || editing;
                // A session of closed-form coordinates has no inner controls.
                let n = session.cage_positions().len();
                session.pose(if at_rest { &self.rest().positions[..n] } else { &self.pose()[..n] });
                if editing && !self.view.original {
                    session.show_cage(&self.pose()[..n]);
                }
            }
            if let Some(scene) = &scene {
                session.set_scene(scene.clone());
            }
        }
        self.is_moved &= !self.is_on_gpu() && self.set().is_some();
        self.is_changed = false;
    }

    /// Recomputes [`Self::lift`] when a pose becomes part of a history step. During a gesture the floor stays.
    fn update_lift(&mut self) {
        if self.bound.is_none() {
            self.lift = Lift::default();
        }
        if !self.view.ground || self.bound.is_none() || !self.editor.is_pose_committed() {
            return;
        }
        let of = (Arc::clone(&self.editor.document().pose), self.editor.models_key());
        if self.lift.of.as_ref().is_some_and(|(pose, models)| Arc::ptr_eq(pose, &of.0) && *models == of.1) {
            return;
        }
        // A rig that cannot be read cannot be exported either, and the export says why.
        self.lift = Lift { of: Some(of), height: self.bound_document().lift().unwrap_or_default() };
        self.is_changed = true;
    }

    /// Writes a saved pose to the GPU. The next frame writes the current pose and the frame of the clip again.
    pub(crate) fn write_saved_pose(&mut self, index: usize, main: &mut Session) -> Answer<()> {
        let document = self.editor.document();
        let pose = document.poses.get(index).filter(|pose| document.fits(pose) && self.is_on_gpu());
        let positions = pose
            .map(|pose| Arc::clone(&pose.positions))
            .ok_or_else(|| Fault::missing("such pose", "wait until the cage of the pose is ready"))?;
        main.interrupt_playing(true);
        main.pose(&positions[..main.cage_positions().len()]);
        if let Some(lattice) = self.lattice.as_ref().filter(|_| self.models().splats().is_some()) {
            main.set_field(Some(lattice.pose(&self.rest().positions, &positions)), &positions);
        }
        self.is_moved = true;
        Ok(())
    }

    /// Writes to the GPU which splats are outside the cage, and the field that deforms the splats.
    fn write_splats(&mut self, main: &mut Session) {
        if !self.is_moved || !self.is_on_gpu() || self.models().splats().is_none() {
            return;
        }
        let cage = self.editor.key().cage;
        if self.on_gpu.floaters != Some(cage) && self.lattice.is_some() {
            main.set_floaters(&self.floaters);
            self.on_gpu.floaters = Some(cage);
        }
        let field = if self.view.original { None } else { self.bound_document().field_of_splats() };
        main.set_field(field, self.pose());
    }
}

/// Layout of the pictures shown side by side: width of each, CSS pixels, and index of the last.
pub(crate) struct Pointers {
    width: f32,
    last: f32,
}

impl Pointers {
    /// Converts a pointer position to a position in the picture under it, CSS pixels.
    pub(crate) fn at(&self, x: f32, y: f32) -> Vec2 {
        Vec2::new(x - self.width * (x / self.width).floor().clamp(0.0, self.last), y)
    }
}

/// Joins the draw data of several models.
pub(crate) fn joined(draws: &[&Arc<DrawModel>]) -> Arc<DrawModel> {
    match draws {
        [only] => Arc::clone(only),
        _ => Arc::new(DrawModel::joined(&draws.iter().map(|draw| &***draw).collect::<Vec<_>>())),
    }
}

/// Data that one upload transfers to the GPU.
#[derive(Clone, Copy)]
pub(crate) enum Upload {
    Mesh,
    Cage,
    Weights,
    Parts,
}

#[cfg(test)]
mod tests {
    use cagework_core::{Frames, Weights, subdivided_box};
    use cagework_editor::edit::Element;
    use cagework_editor::{Command, Contents, Tools};
    use cagework_io::Model;

    use super::*;

    /// Creates a state with a model in a box cage. Its mesh and cage are marked as uploaded, its weights are not.
    fn uploaded() -> State {
        let text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
        let model = Model::read("a.obj", text, &mut |_| None).unwrap();
        let mut state = State::default();
        state.editor.open([(model, None)], Contents::default());
        take_box(&mut state, 0.1);
        state.editor.amend();
        state.follow_document();
        upload_all(&mut state);
        state
    }

    fn take_box(state: &mut State, margin: f32) {
        let mesh = subdivided_box(state.editor.bounds().unwrap(), margin, [1; 3]);
        state
            .editor
            .apply(Command::ReplaceCage { mesh, controls: None, notices: Vec::new(), rings: Vec::new() })
            .unwrap();
    }

    /// Performs all uploads and returns their sequence.
    fn upload_all(state: &mut State) -> String {
        let mut order = String::new();
        while let Some(next) = state.next_upload() {
            let (key, models) = (state.editor.key(), state.editor.models_key());
            match next {
                Upload::Mesh => state.has_uploaded_mesh(),
                Upload::Cage => state.on_gpu.cage = Some(key.cage),
                Upload::Weights => {
                    let bound = state.cache.get(key).unwrap().clone();
                    state.set_bound(bound);
                }
                Upload::Parts => state.on_gpu.parts = Some(models),
            }
            order.push(match next {
                Upload::Mesh => 'm',
                Upload::Cage => 'c',
                Upload::Weights => 'w',
                Upload::Parts => 'p',
            });
        }
        order
    }

    fn bind(state: &mut State) {
        let rows = Weights::new(8, (0..=4).collect(), (0..4).collect(), vec![1.0; 4]).unwrap();
        let bound = BoundModels::new(state.editor.document(), rows, Frames::default(), Vec::new());
        let bound = (Arc::new(bound), Rc::default());
        state.cache.insert(state.editor.key(), bound.clone(), 100);
        state.set_bound(bound);
    }

    #[test]
    fn undo_of_a_cage_restores_its_weights_from_the_cache() {
        let mut state = uploaded();
        bind(&mut state);
        let revision = state.revision;
        take_box(&mut state, 0.2);
        assert!(state.editor.commit("cage"));
        state.follow_document();
        assert!(state.bound.is_none() && state.require(revision).is_err());
        assert_eq!(upload_all(&mut state), "c");
        assert!(state.bound.is_none(), "the new cage has no weights");
        assert!(state.editor.undo());
        state.follow_document();
        assert_eq!(upload_all(&mut state), "cw");
        assert!(state.bound.is_some());
    }

    #[test]
    fn parts_and_poses_keep_weights_but_new_models_drop_them() {
        let mut state = uploaded();
        bind(&mut state);
        let revision = state.revision;
        let options = cagework_editor::PartOptions { stays: vec!["all".to_owned()], ..Default::default() };
        state.editor.apply(Command::SetParts { id: 0, options }).unwrap();
        let moved = state.pose().iter().map(|p| *p + Vec3::X).collect();
        state.editor.set_pose(moved).unwrap();
        state.follow_document();
        assert_eq!(
            (upload_all(&mut state).as_str(), state.bound.is_some(), state.revision),
            ("p", true, revision)
        );
        let text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        state.editor.add_models([(Model::read("b.obj", text, &mut |_| None).unwrap(), None)]);
        state.follow_document();
        assert_eq!((upload_all(&mut state).as_str(), state.bound.is_some()), ("mp", false));
    }

    #[test]
    fn pulling_picks_vertices_whatever_element_was_chosen_for_reshaping() {
        let mut state = uploaded();
        state.editor.set_editing_rest(true, "reset");
        state.editor.set_tools(Tools { element: Element::Face, ..Tools::default() }, &state.camera);
        assert_eq!(state.element(), Element::Face);
        state.editor.set_editing_rest(false, "reset");
        state.editor.set_tools(Tools { element: Element::Face, ..Tools::default() }, &state.camera);
        assert_eq!(state.element(), Element::Vertex);
        state.view.pull = false;
        assert_eq!(state.element(), Element::Face);
    }

    #[test]
    fn a_paused_clip_is_prepared_again_for_a_new_pose() {
        let mut state = uploaded();
        bind(&mut state);
        let play = |state: &mut State, prepared_ms| {
            let mut playing = Playback::new(state.bound_document(), RigOptions::default()).unwrap();
            playing.prepared_ms = prepared_ms;
            state.playing = Some(playing);
        };
        let pose = |state: &mut State| {
            let moved = state.pose().iter().map(|p| *p + Vec3::X).collect();
            state.editor.set_pose(moved).unwrap();
            state.follow_document();
        };
        play(&mut state, 1.0);
        assert!(state.stale_clip().is_none());
        pose(&mut state);
        assert!(state.stale_clip().is_some(), "during a drag");
        play(&mut state, 1000.0);
        pose(&mut state);
        assert!(state.playing.as_ref().is_some_and(|playing| playing.is_stale(&state.editor)));
        assert!(state.stale_clip().is_none(), "too slow for a drag");
        assert!(state.editor.commit("pose"));
        assert!(state.stale_clip().is_some(), "at its end");
        take_box(&mut state, 0.3);
        state.follow_document();
        assert!(state.playing.is_none(), "of another cage");
    }

    /// Each row has the weight 1 for the control of the same number, so the vertices follow the controls, except the
    /// painted one.
    #[test]
    fn paint_holds_vertices_before_the_gpu_has_it() {
        let mut state = uploaded();
        bind(&mut state);
        let rest = state.models().positions().to_vec();
        let pose: Vec<Vec3> = state.pose().iter().map(|p| *p + Vec3::X).collect();
        let id = state.models().iter().next().unwrap().id;
        state.editor.paint(id, |painted| *painted = vec![0, 255, 0, 0]);
        state.editor.commit("Paint");
        state.follow_document();
        let moved = state.bound_document().deformed(&pose).unwrap();
        assert_eq!(moved, [pose[0], rest[1], pose[2], pose[3]]);
        state.editor.undo();
        state.follow_document();
        assert_eq!(state.bound_document().deformed(&pose).unwrap(), pose[..4]);
    }

    #[test]
    fn recovery_uploads_everything() {
        let mut state = uploaded();
        bind(&mut state);
        state.forget_gpu();
        assert!(state.bound.is_none());
        assert_eq!(upload_all(&mut state), "mcwp");
    }
}
