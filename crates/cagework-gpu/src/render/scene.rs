//! What of it all is drawn, and how: plain values that a page or a command sets.

use std::ops::Range;
use std::sync::Arc;

use cagework_core::slice::Slice;
use glam::{Quat, Vec3};

/// Colours of the surroundings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Theme {
    /// For dark pages.
    #[default]
    Dark,
    /// For light pages and for print.
    Light,
}

/// How the mesh is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum MeshStyle {
    /// Not at all.
    Hidden,
    /// With its materials.
    #[default]
    Solid,
    /// One plain colour, whatever its materials.
    Clay,
    /// Weights of one cage vertex, from 0 to the largest of the mesh (or to 1), in the colours of [`super::colormap`]; negative
    /// ones in a warning colour. See [`crate::Session::value_range`] for a legend.
    Weights {
        /// The cage vertex.
        column: u32,
    },
    /// How far the weights miss the rest pose, over the cage's diagonal, logarithmic from
    /// [`super::colormap::ERROR_RANGE`].
    Errors,
}

/// What is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneOptions {
    /// Colours of the surroundings.
    pub theme: Theme,
    /// Whether the gradient behind everything is drawn; without it the picture is transparent there.
    pub backdrop: bool,
    /// How the mesh is drawn.
    pub mesh: MeshStyle,
    /// Whether colours of weights span 0 to 1, not 0 to the largest.
    pub weights_to_one: bool,
    /// How much each vertex of the mesh is greyed where it shows its materials, 0 to 1: what stays where it is.
    /// `[n_vertices]`
    pub greyed: Option<Arc<Vec<f32>>>,
    /// Whether the mesh's edges are drawn on it.
    pub mesh_edges: bool,
    /// Whether the mesh in its rest pose is drawn as a wireframe over everything, as in the paper's figures 2 to 5.
    pub base_wireframe: bool,
    /// Whether the cage's edges are drawn.
    pub cage_lines: bool,
    /// Whether the cage's vertices are drawn as round handles.
    pub handles: bool,
    /// Whether the cage steps back: fainter lines, and only handles that are chosen or pointed at.
    pub cage_faint: bool,
    /// Ranges of [`super::DrawModel::triangles`] that are not drawn, each of whole groups.
    pub hidden: Vec<Range<u32>>,
    /// Whether a floor grid is drawn below the model.
    pub floor: bool,
    /// What of the cage is chosen or pointed at.
    pub selection: Selection,
    /// Handles of the tool in use.
    pub gizmo: Option<Gizmo>,
    /// A slice of the grid.
    pub slice: Option<SliceView>,
    /// Places with a problem.
    pub marks: Marks,
    /// What a hand holds of the model: points, and a line to where it cannot follow.
    pub held: Marks,
    /// Joints of a skeleton, seen through everything.
    pub joints: Marks,
}

impl Default for SceneOptions {
    fn default() -> Self {
        Self {
            theme: Theme::Dark,
            backdrop: true,
            mesh: MeshStyle::Solid,
            weights_to_one: false,
            greyed: None,
            mesh_edges: false,
            base_wireframe: false,
            cage_lines: true,
            handles: true,
            cage_faint: false,
            hidden: Vec::new(),
            floor: true,
            selection: Selection::default(),
            gizmo: None,
            slice: None,
            marks: Marks::default(),
            held: Marks::default(),
            joints: Marks::default(),
        }
    }
}

/// What of the cage is chosen or pointed at. Numbers that the cage does not have are ignored.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// Chosen vertices.
    pub vertices: Vec<u32>,
    /// Chosen edges, by their vertices in any order.
    pub edges: Vec<[u32; 2]>,
    /// Chosen faces.
    pub faces: Vec<u32>,
    /// The vertex under the pointer.
    pub hovered_vertex: Option<u32>,
    /// The edge under the pointer.
    pub hovered_edge: Option<[u32; 2]>,
    /// The face under the pointer.
    pub hovered_face: Option<u32>,
    /// Vertices without a partner, where symmetry is asked for.
    pub unmatched: Vec<u32>,
}

/// What a gizmo does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GizmoMode {
    /// Arrows.
    #[default]
    Move,
    /// Rings.
    Rotate,
    /// Boxes.
    Scale,
}

/// A part of a gizmo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GizmoPart {
    /// Along or around one of its axes: 0, 1, 2.
    Axis(u8),
    /// In the plane across one of its axes, when moving.
    Plane(u8),
    /// In the view plane (moving), around the view direction (rotating), or all axes alike (scaling).
    View,
}

/// Handles around the selection, of constant size in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gizmo {
    /// What it does.
    pub mode: GizmoMode,
    /// Where it is, world space.
    pub center: Vec3,
    /// Its axes.
    pub rotation: Quat,
    /// The part under the pointer or in use.
    pub active: Option<GizmoPart>,
}

/// How a slice is drawn.
#[derive(Clone, Debug)]
pub struct SliceView {
    /// The slice. Made anew for another place; sharing it makes setting a scene cheap.
    pub slice: Arc<Slice>,
    /// One coordinate's value, from 0 to its largest, instead of the kinds of cells: a cage vertex. Needs [`Slice::weights`].
    pub column: Option<u32>,
}

impl PartialEq for SliceView {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.slice, &other.slice) && self.column == other.column
    }
}

/// Places on or beside the model: of a problem, or what is held.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Marks {
    /// Points, world space.
    pub points: Vec<Vec3>,
    /// Points drawn as rings, world space.
    pub rings: Vec<Vec3>,
    /// Segments, world space.
    pub segments: Vec<[Vec3; 2]>,
    /// Vertices of the mesh, where they are now.
    pub mesh_vertices: Vec<u32>,
    /// Vertices of the cage, where they are now.
    pub cage_vertices: Vec<u32>,
}
