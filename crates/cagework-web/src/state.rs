//! The page's state on the CPU: the editor, what is derived from its document, and the view. The GPU follows with the next frame.

use std::collections::BTreeMap;
use std::sync::Arc;

use cagework_core::deform::OutsideVertex;
use cagework_core::dynamic::Lattice;
use cagework_core::enclosure::Enclosure;
use cagework_core::slice::Slice;
use cagework_core::{Bounds, ControlSet, Frames, PolygonMesh, Weights};
use cagework_editor::{Cache, Editor, Key, Models, RestCage, SurfacePoint};
use cagework_gpu::Session;
use cagework_gpu::render::{Camera, DrawModel, GizmoPart};
use cagework_io::{Model, UpAxis};
use glam::{Vec2, Vec3};
use wasm_bindgen::JsValue;

use crate::error::{Answer, ErrorName, Fault};
use crate::joints::JointDots;
use crate::options::{Coordinates, SceneAsked};
use crate::playing::Playing;
use crate::problems::Faults;
use crate::views::{CageInfo, CageState, View};

/// Bytes of weights that are kept for documents that undo and redo come back to.
const CACHE_BYTES: usize = 256 << 20;

/// Document, camera, and what is derived from them.
pub(crate) struct State {
    pub(crate) editor: Editor,
    /// How each model is drawn, by its number.
    pub(crate) draws: BTreeMap<u32, Arc<DrawModel>>,
    /// Number of points of the models' rigs, once they were counted.
    pub(crate) n_rig: Option<usize>,
    /// The model that is painted, and how much of each vertex of all models stays in place. `[n_vertices]`
    pub(crate) painting: Option<(u32, Arc<Vec<f32>>)>,
    /// Faults of the cage, once it was checked.
    pub(crate) faults: Faults,
    /// Some vertices of the model to count outside the cage while it is reshaped; made when first needed.
    pub(crate) watched: Option<(ControlSet, Enclosure)>,
    /// The weights in use; none before the models are bound to the cage as it is.
    pub(crate) bound: Option<Arc<BoundModels>>,
    /// Weights of documents that undo and redo come back to.
    pub(crate) cache: Cache<Arc<BoundModels>>,
    /// What the last export did not keep.
    pub(crate) rig_notices: Vec<String>,
    /// The clip that is shown in place of the pose.
    pub(crate) playing: Option<Playing>,
    /// Lattice by which the cage bends a moving model, the weights of its points, and their offsets.
    pub(crate) lattice: Option<(Lattice, Weights, Frames)>,
    /// Kinds of coordinates to compare with.
    pub(crate) others: Vec<Coordinates>,
    pub(crate) active_part: Option<GizmoPart>,
    pub(crate) slice: Option<Arc<Slice>>,
    pub(crate) held: Held,
    pub(crate) view: SceneAsked,
    pub(crate) camera: Camera,
    /// The viewport, CSS pixels.
    pub(crate) size: Vec2,
    /// Device pixels of a CSS pixel.
    pub(crate) scale: f32,
    /// Counts changes of mesh and cage: the result of a job is for one of them.
    pub(crate) revision: u32,
    /// The document that everything derived here belongs to.
    derived: Derived,
    /// What the GPU holds.
    pub(crate) on_gpu: OnGpu,
    /// Whether an upload is in progress; it looks again when it is done.
    pub(crate) is_uploading: bool,
    /// Whether models of the document are being added, and may still be refused.
    pub(crate) is_adding: bool,
    pub(crate) is_moved: bool,
    pub(crate) is_changed: bool,
    /// An error of an upload, for the next frame to report.
    pub(crate) fault: Option<Fault>,
}

/// Weights of all models for a cage.
pub(crate) struct BoundModels {
    pub(crate) weights: Arc<Weights>,
    pub(crate) frames: Arc<Frames>,
    /// Weights of the points of the models' rigs.
    pub(crate) rig: Option<Weights>,
    /// Vertices outside the cage, then points of rigs outside, counted after all vertices.
    pub(crate) outside: Vec<OutsideVertex>,
    /// The joints among them.
    pub(crate) joints: Option<JointDots>,
    /// The report of the bind, as the page shows it.
    pub(crate) report: JsValue,
}

/// Keys of the document that derived state belongs to, and its pose.
#[derive(Default)]
struct Derived {
    key: Key,
    models: u64,
    pose: Arc<[Vec3]>,
}

/// Keys of what the GPU holds; none for what it does not hold.
#[derive(Clone, Copy, Default, PartialEq)]
pub(crate) struct OnGpu {
    pub(crate) mesh: Option<u64>,
    pub(crate) parts: Option<u64>,
    pub(crate) cage: Option<u64>,
    /// The weights.
    pub(crate) bound: Option<Key>,
}

/// Grabs, and positions of the models for picking.
#[derive(Default)]
pub(crate) struct Held {
    /// Points that are grabbed or pointed at.
    pub(crate) points: Vec<SurfacePoint>,
    /// Where the grab should be, if the cage cannot bring it there.
    pub(crate) target: Option<Vec3>,
    /// How much of each vertex of the model stays in place during the drag.
    pub(crate) stays: Option<Arc<Vec<f32>>>,
    /// Places of an interior control that is being added.
    pub(crate) placed: Vec<Vec3>,
    /// The models as posed, and the pose that it was computed for.
    pub(crate) posed: Vec<Vec3>,
    pub(crate) posed_for: Vec<Vec3>,
}

impl Default for State {
    fn default() -> Self {
        Self {
            editor: Editor::default(),
            draws: BTreeMap::new(),
            n_rig: None,
            painting: None,
            faults: Faults::default(),
            watched: None,
            bound: None,
            cache: Cache::new(CACHE_BYTES),
            rig_notices: Vec::new(),
            playing: None,
            lattice: None,
            others: Vec::new(),
            active_part: None,
            slice: None,
            held: Held::default(),
            view: SceneAsked::default(),
            camera: Camera::default(),
            size: Vec2::default(),
            scale: 0.0,
            revision: 0,
            derived: Derived::default(),
            on_gpu: OnGpu::default(),
            is_uploading: false,
            is_adding: false,
            is_moved: false,
            is_changed: false,
            fault: None,
        }
    }
}

impl State {
    pub(crate) fn models(&self) -> &Models {
        &self.editor.document().models
    }

    /// The cage at rest, or a draft of one.
    pub(crate) fn cage(&self) -> &RestCage {
        &self.editor.document().cage
    }

    /// Positions of the cage and its interior controls. `[n_controls]`
    pub(crate) fn pose(&self) -> &[Vec3] {
        &self.editor.document().pose
    }

    /// The controls of a bind; none while there is only a draft of a cage.
    pub(crate) fn set(&self) -> Option<&ControlSet> {
        self.cage().set.as_ref().ok()
    }

    /// The controls of a bind.
    ///
    /// # Errors
    /// When there is no cage.
    pub(crate) fn the_set(&self) -> Answer<&ControlSet> {
        self.set().ok_or_else(|| Fault::missing("cage", "make or open one first"))
    }

    /// Positions of cage and interior controls at rest, and the cage's faces; or the draft's.
    pub(crate) fn rest(&self) -> &PolygonMesh {
        &self.cage().mesh
    }

    /// Drops what was derived from another document. Called after each change.
    pub(crate) fn follow_document(&mut self) {
        let document = self.editor.document();
        let (key, models, pose) = (document.key(), self.editor.models_key(), Arc::clone(&document.pose));
        let Derived { key: before, models: models_before, pose: pose_before } =
            std::mem::replace(&mut self.derived, Derived { key, models, pose: Arc::clone(&pose) });
        if key != before {
            self.revision += 1;
            self.watched = None;
            self.active_part = None;
            (self.slice, self.lattice, self.playing) = (None, None, None);
            self.held = Held::default();
            self.others.clear();
            self.faults = Faults::default();
            self.bound = None;
            if key.mesh != before.mesh {
                self.n_rig = None;
                self.painting = None;
            }
            self.fit_camera();
        }
        if models != models_before {
            self.held.posed_for.clear();
            self.show_painting();
            self.is_changed = true;
        }
        if !Arc::ptr_eq(&pose, &pose_before) {
            self.playing = None;
        }
        if key != before || !Arc::ptr_eq(&pose, &pose_before) {
            // The gizmo is drawn in the middle of the selection.
            (self.is_moved, self.is_changed) = (true, true);
        }
    }

    /// Whether the result of a job that was started at a revision is still wanted.
    ///
    /// # Errors
    /// `Cancelled` when mesh or cage have changed since.
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

    /// Tells the camera where everything is.
    pub(crate) fn fit_camera(&mut self) {
        self.place_viewport();
        if let Some(bounds) = self.editor.bounds() {
            self.camera.set_scene(bounds);
        }
    }

    /// Tells the camera the size of one picture: a part of the view when several are compared.
    pub(crate) fn place_viewport(&mut self) {
        self.camera.set_viewport(Vec2::new(self.part_width(), self.size.y));
    }

    /// Kinds of coordinates that are shown side by side.
    pub(crate) fn shown(&self) -> Vec<Coordinates> {
        let is_there = |one: &Coordinates| *one == Coordinates::Harmonic || self.others.contains(one);
        let shown: Vec<_> = self.view.compare.iter().copied().filter(is_there).collect();
        if shown.is_empty() { vec![Coordinates::Harmonic] } else { shown }
    }

    fn part_width(&self) -> f32 {
        self.size.x / self.shown().len() as f32
    }

    /// A pointer's place in the picture it is over.
    pub(crate) fn pointer(&self, x: f32, y: f32) -> Vec2 {
        self.pointers().at(x, y)
    }

    /// How pointers of the view become those of one picture.
    pub(crate) fn pointers(&self) -> Pointers {
        Pointers { width: self.part_width(), last: self.shown().len() as f32 - 1.0 }
    }

    /// The camera that a model is first seen from, and the size of its picture, pixels.
    pub(crate) fn view_of(&self, model: &Model) -> (Camera, [u32; 2]) {
        let size = (self.size * self.scale).max(Vec2::ONE);
        let mut camera = Camera::default();
        camera.set_viewport(size);
        if let Some(bounds) = Bounds::of(&model.positions) {
            camera.set_scene(bounds);
            camera.frame(bounds);
        }
        (camera, size.as_uvec2().to_array())
    }

    pub(crate) fn frame_all(&mut self) {
        if let Some(bounds) = self.editor.bounds() {
            self.camera.frame(bounds);
        }
    }

    /// Greys what stays of the model that is painted.
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

    /// The cage as panels show it; none without a cage.
    pub(crate) fn cage_state(&self) -> Option<CageState> {
        (!self.rest().faces.is_empty()).then(|| CageState {
            usable: self.set().is_some(),
            info: CageInfo::of(self.cage()),
            controls: self.cage().controls.clone(),
            radius: self.cage().radius(),
        })
    }

    /// What panels show.
    pub(crate) fn document_view(&self) -> View {
        View { document: self.editor.view(), bound: self.bound.is_some() }
    }

    /// Takes weights of the present document.
    pub(crate) fn set_bound(&mut self, bound: Arc<BoundModels>) {
        self.bound = Some(bound);
        self.on_gpu.bound = Some(self.editor.key());
        self.playing = None;
        (self.is_moved, self.is_changed) = (true, true);
    }

    /// The models as they are drawn, as one.
    pub(crate) fn draw_model(&self) -> Arc<DrawModel> {
        joined(&self.models().iter().filter_map(|member| self.draws.get(&member.id)).collect::<Vec<_>>())
    }

    /// Whether the GPU holds mesh and cage of the document.
    pub(crate) fn is_on_gpu(&self) -> bool {
        let key = self.editor.key();
        self.set().is_some() && self.on_gpu.cage == Some(key.cage) && self.on_gpu.mesh == Some(key.mesh)
    }

    /// Whether the GPU lacks something that the document has.
    pub(crate) fn needs_upload(&self) -> bool {
        self.next_upload().is_some()
    }

    /// What is to be uploaded next. Each upload may drop what is uploaded after it.
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

    /// The device holds nothing.
    pub(crate) fn forget_gpu(&mut self) {
        self.on_gpu = OnGpu::default();
    }

    /// The GPU holds the mesh of the document, and nothing else.
    pub(crate) fn has_uploaded_mesh(&mut self) {
        let cage = self.on_gpu.cage;
        self.on_gpu = OnGpu { mesh: Some(self.editor.key().mesh), cage, ..OnGpu::default() };
    }

    /// Brings moved cage, camera and scene to the GPU.
    pub(crate) fn write<'a>(&mut self, main: &'a mut Session, others: impl Iterator<Item = &'a mut Session>) {
        let scene = self.is_changed.then(|| self.scene(main.weights()));
        match &mut self.playing {
            Some(playing) if playing.is_new => {
                main.play(&playing.palette(), playing.targets());
                playing.is_new = false;
            }
            Some(_) => {}
            None => main.stop_playing(),
        }
        for session in std::iter::once(main).chain(others) {
            *session.camera_mut() = self.camera;
            if self.is_moved && self.is_on_gpu() {
                let editing = self.editor.is_editing_rest();
                let at_rest = self.view.original || editing;
                // Closed forms know the plain cage alone.
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
}

/// Pictures side by side: their width, CSS pixels, and the index of the last.
pub(crate) struct Pointers {
    width: f32,
    last: f32,
}

impl Pointers {
    /// A pointer's place in the picture it is over.
    pub(crate) fn at(&self, x: f32, y: f32) -> Vec2 {
        Vec2::new(x - self.width * (x / self.width).floor().clamp(0.0, self.last), y)
    }
}

/// Models as they are drawn, as one.
pub(crate) fn joined(draws: &[&Arc<DrawModel>]) -> Arc<DrawModel> {
    match draws {
        [only] => Arc::clone(only),
        _ => Arc::new(DrawModel::joined(&draws.iter().map(|draw| &***draw).collect::<Vec<_>>())),
    }
}

/// What is uploaded at once.
#[derive(Clone, Copy)]
pub(crate) enum Upload {
    Mesh,
    Cage,
    Weights,
    Parts,
}

#[cfg(test)]
mod tests {
    use cagework_core::subdivided_box;
    use cagework_editor::{Command, Contents};

    use super::*;

    /// A model in a box, of which the GPU holds everything but weights.
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
        state.editor.apply(Command::ReplaceCage { mesh, controls: None, notices: Vec::new() }).unwrap();
    }

    /// What is uploaded, in order.
    fn upload_all(state: &mut State) -> String {
        let mut order = String::new();
        while let Some(next) = state.next_upload() {
            let (key, models) = (state.editor.key(), state.editor.models_key());
            match next {
                Upload::Mesh => state.has_uploaded_mesh(),
                Upload::Cage => state.on_gpu.cage = Some(key.cage),
                Upload::Weights => {
                    let bound = Arc::clone(state.cache.get(key).unwrap());
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
        let bound = Arc::new(BoundModels {
            weights: Arc::new(Weights::with_room(8, 0, 0)),
            frames: Arc::default(),
            rig: None,
            outside: Vec::new(),
            joints: None,
            report: JsValue::UNDEFINED,
        });
        state.cache.insert(state.editor.key(), Arc::clone(&bound), 100);
        state.set_bound(bound);
    }

    #[test]
    fn undo_of_a_cage_brings_its_weights_back_without_a_bind() {
        let mut state = uploaded();
        bind(&mut state);
        let revision = state.revision;
        take_box(&mut state, 0.2);
        assert!(state.editor.commit("cage"));
        state.follow_document();
        assert!(state.bound.is_none() && state.require(revision).is_err());
        assert_eq!(upload_all(&mut state), "c");
        assert!(state.bound.is_none(), "there are no weights for the new cage");
        assert!(state.editor.undo());
        state.follow_document();
        assert_eq!(upload_all(&mut state), "cw");
        assert!(state.bound.is_some());
    }

    #[test]
    fn parts_and_poses_keep_weights_and_other_models_do_not() {
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
    fn a_lost_device_gets_everything_again() {
        let mut state = uploaded();
        bind(&mut state);
        state.forget_gpu();
        state.bound = None;
        assert_eq!(upload_all(&mut state), "mcwp");
    }
}
