//! What the page works on, on the CPU: always complete and at once; the GPU follows with the next frame.

use std::sync::Arc;

use cagework_core::deform::OutsideVertex;
use cagework_core::dynamic::Lattice;
use cagework_core::edit::{Element, Gesture, Pivot, Pull, Selection, SharedPull, Symmetry, Topology};
use cagework_core::enclosure::Enclosure;
use cagework_core::slice::Slice;
use cagework_core::{Bounds, ControlSet, Frames, PolygonMesh, Weights};
use cagework_gpu::Session;
use cagework_gpu::render::{Camera, GizmoPart};
use cagework_io::{Model, UpAxis};
use glam::{Vec2, Vec3};

use crate::controls::MadeCage;
use crate::error::{Answer, ErrorName, Fault};
use crate::joints::JointDots;
use crate::models::Models;
use crate::options::{Coordinates, SceneAsked};
use crate::playing::Playing;
use crate::problems::Faults;
use crate::views::{CageInfo, CageState, SurfacePoint};

/// Model, cage, selection, gesture and camera of a page.
#[derive(Default)]
pub(crate) struct State {
    pub(crate) models: Models,
    /// How many points their rigs have, once they were counted.
    pub(crate) n_rig: Option<usize>,
    /// Whether the GPU has to be told what the cage does not bend.
    pub(crate) other_parts: bool,
    /// What stays of the model that is being painted, and its number. `[n_vertices]` of all models
    pub(crate) painting: Option<(u32, Arc<Vec<f32>>)>,
    /// The cage at rest, or a draft of one, with the controls inside.
    pub(crate) made: MadeCage,
    pub(crate) topology: Topology,
    pub(crate) symmetry: Symmetry,
    /// Where something is wrong with the cage, once it was checked.
    pub(crate) faults: Faults,
    /// Some vertices of the model, to be watched while the rest cage is dragged; made when first asked.
    pub(crate) watched: Option<(ControlSet, Enclosure)>,
    /// Where the cage and controls inside are. `[n_controls]`
    pub(crate) positions: Vec<Vec3>,
    pub(crate) editing_rest: bool,
    pub(crate) is_bound: bool,
    /// What the last export did to the rig.
    pub(crate) rig_notices: Vec<String>,
    /// The clip that plays, in place of the cage.
    pub(crate) playing: Option<Playing>,
    /// What is needed for the cage to bend the moving model: a lattice around it, weights of its points, their frames.
    pub(crate) lattice: Option<(Lattice, Weights, Frames)>,
    /// Weights of the points of the model's rig.
    pub(crate) rig: Option<Weights>,
    /// Vertices outside the cage, then points of the rig that are, counted after all vertices.
    pub(crate) outside: Vec<OutsideVertex>,
    /// The joints among them; none before the model is bound.
    pub(crate) joints: Option<JointDots>,
    /// What there are weights of to compare with.
    pub(crate) others: Vec<Coordinates>,
    pub(crate) element: Element,
    pub(crate) selection: Selection,
    pub(crate) hovered: Vec<u32>,
    pub(crate) pivot: Pivot,
    pub(crate) is_mirrored: bool,
    /// Of proportional editing, fraction of the cage's diagonal.
    pub(crate) radius: f32,
    pub(crate) gesture: Option<Gesture>,
    pub(crate) active_part: Option<GizmoPart>,
    pub(crate) slice: Option<Arc<Slice>>,
    /// What a hand holds of the model.
    pub(crate) held: Held,
    pub(crate) view: SceneAsked,
    pub(crate) camera: Camera,
    /// The viewport, CSS pixels.
    pub(crate) size: Vec2,
    /// Pixels of a CSS pixel.
    pub(crate) scale: f32,
    /// Counts changes of model and rest cage: each job is for one of them.
    pub(crate) revision: u32,
    /// The revision of the cage that the GPU has.
    pub(crate) on_gpu: Option<u32>,
    pub(crate) is_moved: bool,
    pub(crate) is_changed: bool,
    /// What went wrong on the way to the GPU, for the next frame to tell.
    pub(crate) fault: Option<Fault>,
}

/// What is held, and what stays.
#[derive(Default)]
pub(crate) struct Held {
    /// Points that are grabbed, pinned or pointed at.
    pub(crate) points: Vec<SurfacePoint>,
    /// Where the grab should be, where it cannot follow.
    pub(crate) target: Option<Vec3>,
    /// Of each vertex of the model how much it stays; none without a drag.
    pub(crate) stays: Option<Arc<Vec<f32>>>,
    /// Places of a control inside that is being put in.
    pub(crate) placed: Vec<Vec3>,
    /// The model where it was asked for last, and the cage for it.
    pub(crate) posed: Vec<Vec3>,
    pub(crate) posed_for: Vec<Vec3>,
}

impl State {
    /// Another model, without a cage.
    pub(crate) fn set_models(&mut self, models: Models) {
        self.models = models;
        (self.n_rig, self.painting) = (None, None);
        self.set_cage(MadeCage::default());
        self.camera = Camera::default();
        self.fit_camera();
        self.frame_all();
    }

    /// Other models in the same cage: its pose stays, the weights are of others.
    pub(crate) fn change_models(&mut self, models: Models) {
        self.models = models;
        let (on_gpu, selection) = (self.is_on_gpu(), self.selection.clone());
        let (made, positions) = (std::mem::take(&mut self.made), std::mem::take(&mut self.positions));
        (self.n_rig, self.painting) = (None, None);
        self.set_cage(made);
        // The cage itself is the same.
        self.on_gpu = on_gpu.then_some(self.revision);
        (self.positions, self.selection) = (positions, selection);
    }

    /// Another cage, or a draft of one.
    pub(crate) fn set_cage(&mut self, made: MadeCage) {
        self.faults = Faults::default();
        self.made = made;
        self.topology = Topology::new(&self.rest().faces);
        self.topology.edges.extend(self.made.inner_edges());
        self.symmetry = Symmetry::new(&self.rest().positions);
        self.positions.clone_from(&self.made.mesh.positions);
        self.watched = None;
        self.selection = Selection::new(self.positions.len());
        self.hovered.clear();
        self.gesture = None;
        self.active_part = None;
        self.slice = None;
        self.held = Held::default();
        self.playing = None;
        self.lattice = None;
        (self.is_bound, self.rig, self.joints) = (false, None, None);
        self.outside.clear();
        self.others.clear();
        self.revision += 1;
        self.is_moved = true;
        self.is_changed = true;
        self.fit_camera();
    }

    /// The cage at rest; none while there is only a draft of one.
    pub(crate) fn set(&self) -> Option<&ControlSet> {
        self.made.set.as_ref().ok()
    }

    /// Positions of cage and controls inside at rest, and the cage's faces; or the draft's.
    pub(crate) fn rest(&self) -> &PolygonMesh {
        &self.made.mesh
    }

    /// Drops what was computed for a model or cage of before.
    ///
    /// # Errors
    /// `Cancelled` when there is another one by now.
    pub(crate) fn require(&self, revision: u32) -> Answer<()> {
        let is_current = self.revision == revision;
        is_current
            .then_some(())
            .ok_or_else(|| Fault::new(ErrorName::Cancelled, "there is another model or cage by now"))
    }

    /// What points up in the model's file.
    pub(crate) fn up(&self) -> UpAxis {
        self.models.up()
    }

    /// Tells the camera where everything is.
    fn fit_camera(&mut self) {
        self.place_viewport();
        if let Some(bounds) = self.bounds() {
            self.camera.set_scene(bounds);
        }
    }

    /// Tells the camera how large the picture is: a part of the view when several are compared.
    pub(crate) fn place_viewport(&mut self) {
        self.camera.set_viewport(Vec2::new(self.part_width(), self.size.y));
    }

    /// What is shown side by side.
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
        let width = self.part_width();
        let last = self.shown().len() as f32 - 1.0;
        Vec2::new(x - width * (x / width).floor().clamp(0.0, last), y)
    }

    /// Where a model will be seen from when it opens, and the pixels of its picture.
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

    /// Where model and cage are at rest.
    pub(crate) fn bounds(&self) -> Option<Bounds> {
        match (Bounds::of(&self.models.positions), Bounds::of(&self.rest().positions)) {
            (Some(a), Some(b)) => Some(Bounds { min: a.min.min(b.min), max: a.max.max(b.max) }),
            (one, other) => one.or(other),
        }
    }

    pub(crate) fn frame_all(&mut self) {
        if let Some(bounds) = self.bounds() {
            self.camera.frame(bounds);
        }
    }

    /// What JavaScript is told about the cage; nothing without one.
    pub(crate) fn cage_state(&self) -> Option<CageState> {
        (!self.rest().faces.is_empty()).then(|| CageState {
            usable: self.set().is_some(),
            info: CageInfo::of(&self.made),
            controls: self.made.controls.clone(),
            radius: self.made.radius(),
        })
    }

    /// How the selection of the moment pulls the others along.
    pub(crate) fn pull(&self, positions: &[Vec3]) -> Pull {
        let diagonal = Bounds::of(&self.rest().positions).map_or(0.0, |b| b.diagonal());
        let symmetry = self.is_mirrored.then_some(&self.symmetry);
        let shared = SharedPull { radius: self.radius * diagonal, symmetry };
        Pull::new(&self.selection, positions, &self.rest().positions, shared)
    }

    /// Moves the cage.
    pub(crate) fn move_to(&mut self, positions: Vec<Vec3>) {
        if positions.len() == self.positions.len() && positions.iter().all(|p| p.is_finite()) {
            self.positions = positions;
            self.playing = None;
            self.is_moved = true;
            // The gizmo sits in the middle of the selection.
            self.is_changed = true;
        }
    }

    /// Whether the GPU has this cage.
    pub(crate) fn is_on_gpu(&self) -> bool {
        self.set().is_some() && self.on_gpu == Some(self.revision)
    }

    /// Brings what changed to the GPU.
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
                let at_rest = self.view.original || self.editing_rest;
                // Closed forms, of the other one, know the plain cage alone.
                let n = session.cage_positions().len();
                session.pose(if at_rest { &self.made.mesh.positions[..n] } else { &self.positions[..n] });
                if self.editing_rest && !self.view.original {
                    session.show_cage(&self.positions[..n]);
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
