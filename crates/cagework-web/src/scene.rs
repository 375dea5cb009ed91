//! Converts the engine's state to options of the renderer.

use std::sync::Arc;

use cagework_core::field::bend_vertices;
use cagework_editor::edit::Element;
use cagework_gpu::render::{Gizmo, Marks, MeshStyle, SceneOptions, Selection, SliceView, ViewOptions};
use cagework_io::Joints;
use glam::{Quat, Vec3};

use crate::options::{Colour, SliceContent};
use crate::problems;
use crate::state::{GrabState, State};

impl State {
    /// Style of the mesh. Colours of weights and errors need a bind; colours of weights also need a
    /// selected vertex.
    pub(crate) fn mesh_style(&self) -> MeshStyle {
        match self.view.colour {
            _ if !self.view.model => MeshStyle::Hidden,
            Colour::Material => MeshStyle::Solid,
            Colour::Clay => MeshStyle::Clay,
            Colour::Error if self.bound.is_some() => MeshStyle::Errors,
            Colour::Weight if self.bound.is_some() => match self.editor.selection.last() {
                Some(column) => MeshStyle::Weights { column },
                None => MeshStyle::Clay,
            },
            Colour::Weight | Colour::Error => MeshStyle::Clay,
        }
    }

    /// Creates the scene that the view shows.
    pub(crate) fn scene(&self) -> SceneOptions {
        let cage = self.view.cage && self.is_on_gpu() && self.has_cage_in_view() && self.draft.is_empty();
        SceneOptions {
            view: self.view.options,
            backdrop: true,
            mesh: self.mesh_style(),
            mesh_edges: false,
            cage_lines: cage,
            handles: cage,
            selection: self.shown_selection(),
            cage_faint: self.pulls() && self.is_nothing_chosen(),
            gizmo: self.gizmo().filter(|_| cage),
            slice: self.shown_slice(),
            marks: self.marks(),
            hidden: self.models().hidden(),
            painted: self.painting.is_some(),
            greyed: self
                .painting
                .as_ref()
                .map(|(_, stays)| Arc::clone(stays))
                .or_else(|| self.held.stays.clone()),
            held: self.held_marks(),
            joints: self.joint_marks(),
            draft: self.draft_marks(),
            floor_height: self.floor_height(),
        }
    }

    /// Height of the floor above the lowest point of the models at rest: exports lift the posed models by as much, and the
    /// view lowers the floor.
    fn floor_height(&self) -> f32 {
        let is_bent = self.playing.as_ref().is_some_and(|playing| playing.field.is_some());
        let is_lifted = self.view.ground && !is_bent && !self.view.original && !self.editor.is_editing_rest();
        if is_lifted { -self.lift.height } else { 0.0 }
    }

    /// Whether the cage is drawn and can be moved: no clip is shown, the clip is paused, or the cage deforms the model
    /// after the clip has moved it.
    pub(crate) fn has_cage_in_view(&self) -> bool {
        self.playing.as_ref().is_none_or(|playing| playing.is_paused || playing.field.is_some())
    }

    /// Whether dragging pulls the model's surface. Cage vertices whose faces all face away from the camera cannot be
    /// picked then.
    pub(crate) fn pulls(&self) -> bool {
        self.view.pull && self.bound.is_some() && !self.editor.is_editing_rest()
    }

    /// Element type that a click selects: vertices in pull mode, unless the cage is being reshaped; otherwise the type
    /// that the user has chosen.
    pub(crate) fn element(&self) -> Element {
        let is_pull = self.view.pull && !self.editor.is_editing_rest();
        if is_pull { Element::Vertex } else { self.editor.tools().element }
    }

    /// Whether no cage element is selected, hovered or dragged.
    fn is_nothing_chosen(&self) -> bool {
        self.editor.hovered.is_empty()
            && self.editor.selection.vertices().is_empty()
            && self.editor.gesture().is_none()
    }

    /// Creates the scene of an exported picture. `alone`: only the model, on a transparent background.
    pub(crate) fn picture_scene(&self, alone: bool) -> SceneOptions {
        if !alone {
            return self.scene();
        }
        SceneOptions {
            view: ViewOptions { base_wireframe: false, floor: false, ..self.view.options },
            backdrop: false,
            mesh: self.mesh_style(),
            hidden: self.models().hidden(),
            cage_lines: false,
            handles: false,
            ..SceneOptions::default()
        }
    }

    fn shown_selection(&self) -> Selection {
        let mut shown = Selection { vertices: self.editor.selection.vertices(), ..Selection::default() };
        match self.element() {
            Element::Vertex => {
                if let [vertex] = self.editor.hovered[..] {
                    shown.hovered_vertex = Some(vertex);
                }
            }
            Element::Edge => {
                shown.edges = self.editor.selection.edges(self.editor.topology());
                shown.hovered_edge = match self.editor.hovered[..] {
                    [a, b] => Some([a, b]),
                    _ => None,
                };
            }
            Element::Face => {
                shown.faces = self.editor.selection.faces(self.editor.topology());
                let hovered = |f: &Vec<u32>| !self.editor.hovered.is_empty() && *f == self.editor.hovered;
                shown.hovered_face = self.editor.topology().faces.iter().position(hovered).map(|f| f as u32);
            }
        }
        if self.editor.tools().symmetry {
            shown.unmatched = self.editor.symmetry().unmatched();
        }
        shown
    }

    /// Creates the gizmo, placed at the centre of rotation and scaling.
    pub(crate) fn gizmo(&self) -> Option<Gizmo> {
        let mode = self.view.gizmo?;
        let center =
            self.editor.selection.pivot(self.pose(), self.editor.topology(), self.editor.tools().pivot)?;
        Some(Gizmo { mode, center, rotation: Quat::IDENTITY, active: self.active_part })
    }

    fn shown_slice(&self) -> Option<SliceView> {
        let slice = self.slice.as_ref().filter(|_| self.view.slice != SliceContent::Off)?;
        let column = self.editor.selection.last().filter(|_| self.view.slice == SliceContent::Value);
        Some(SliceView { slice: Arc::clone(slice), column })
    }

    /// Creates the lines of a cage that is being made, or of one that is not valid, which is not drawn as a cage.
    fn draft_marks(&self) -> Marks {
        let mut segments = self.draft.clone();
        if segments.is_empty() && self.set().is_none() && self.view.cage {
            segments.extend(problems::sides(&self.rest().faces, self.pose()));
        }
        Marks { segments, ..Marks::default() }
    }

    /// Creates the marks of the cage's faults; none if the view hides faults.
    fn marks(&self) -> Marks {
        if !self.view.problems {
            return Marks::default();
        }
        problems::marks(&self.faults, self.rest(), self.pose())
    }

    /// Creates the marks of grabs, pins and of an inner control that is being placed. Before a bind, grabs and pins
    /// are omitted.
    fn held_marks(&self) -> Marks {
        let GrabState { points, target, placed, .. } = &self.held;
        let held = [points, &*self.editor.document().pins].concat();
        let clip = self.pulled_clip();
        let mut points = match clip {
            Some(_) => held.iter().filter_map(|&point| self.shown_models().place_of(point)).collect(),
            None => self.bound_document().followed(&held),
        };
        // The target is a position without the motion of the clip.
        let line = target.filter(|_| clip.is_none()).zip(points.first()).map(|(to, from)| [*from, to]);
        let placing = placed.windows(2).map(|pair| [pair[0], pair[1]]);
        let segments = line.into_iter().chain(placing).collect();
        points.extend(placed);
        Marks { points, segments, ..Marks::default() }
    }

    /// Creates the marks of joints: dots for those inside the cage, rings for those outside; empty before a bind. For a
    /// fitted rig whose clip the cage follows, dots for its joints while the cage is at rest.
    fn joint_marks(&self) -> Marks {
        let fitted = self.editor.walk_joints();
        if !fitted.is_empty() {
            let is_at_rest = self.view.original || *self.pose() == *self.rest().positions;
            return Marks { points: if is_at_rest { fitted } else { Vec::new() }, ..Marks::default() };
        }
        let dots = self.bound.as_ref().and_then(|bound| bound.joints.as_ref());
        let (Some(mode), Some(dots)) = (self.view.joints, dots) else { return Marks::default() };
        let at = match self.playing.as_ref().filter(|_| !self.view.original) {
            Some(playing) => {
                let joints = dots.joints.iter().zip(&dots.models);
                let mut at: Vec<Vec3> =
                    joints.filter_map(|(joint, &id)| playing.origin(id, joint.node)).collect();
                if let Some(field) = &playing.field {
                    bend_vertices(field, &mut at);
                }
                at
            }
            None if mode == Joints::Stay || self.view.original || self.editor.is_editing_rest() => {
                dots.at.clone()
            }
            None => dots.posed(&self.rest().positions, self.pose()),
        };
        let mut marks = Marks::default();
        for (k, at) in at.into_iter().enumerate() {
            if dots.is_outside(k) { &mut marks.rings } else { &mut marks.points }.push(at);
        }
        marks
    }
}
