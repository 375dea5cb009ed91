//! What is drawn and how: plain values, set by the page or a command.

use std::ops::Range;
use std::sync::Arc;

use cagework_core::slice::Slice;
use glam::{Quat, Vec3};

cagework_core::choice! {
    /// Colours of background and overlays.
    Theme {
        /// Dark colours, for dark pages.
        #[default]
        Dark = "dark",
        /// Light colours, for light pages and print.
        Light = "light",
    }
}

/// Display of the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum MeshStyle {
    /// The mesh is not drawn.
    Hidden,
    /// The mesh is drawn with its materials.
    #[default]
    Solid,
    /// The mesh is drawn in one colour, without materials.
    Clay,
    /// Weights of a control in the colours of [`super::colormap`], from 0 to the mesh's maximum or to 1;
    /// negative weights in a warning colour. Legend: [`crate::Session::value_range`].
    Weights {
        /// Index of the control.
        column: u32,
    },
    /// Reproduction error of the weights at rest, over the cage diagonal, on a logarithmic scale:
    /// [`super::colormap::ERROR_RANGE`].
    Errors,
}

/// Contents and display options of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneOptions {
    /// Colours of background and overlays.
    pub theme: Theme,
    /// Whether the background is drawn. Otherwise it is transparent.
    pub backdrop: bool,
    /// Display of the mesh.
    pub mesh: MeshStyle,
    /// Whether colours of weights span 0 to 1 instead of 0 to the maximum.
    pub weights_to_one: bool,
    /// How grey or painted each vertex is in [`MeshStyle::Solid`] and [`MeshStyle::Clay`], from 0 to 1; shows which
    /// vertices stay in place. `[n_vertices]`
    pub greyed: Option<Arc<Vec<f32>>>,
    /// Whether `greyed` is shown as paint.
    pub painted: bool,
    /// Whether the mesh's edges are drawn.
    pub mesh_edges: bool,
    /// Whether the rest pose is drawn as a wireframe, as in figures 2 to 5 of the paper.
    pub base_wireframe: bool,
    /// Whether the cage's edges are drawn.
    pub cage_lines: bool,
    /// Whether handles are drawn at the cage's vertices.
    pub handles: bool,
    /// Whether the cage is drawn fainter, with only selected and hovered handles.
    pub cage_faint: bool,
    /// Hidden ranges of [`super::DrawModel::triangles`], each of whole groups.
    pub hidden: Vec<Range<u32>>,
    /// Whether splats outside the cage are hidden.
    pub floaters_hidden: bool,
    /// Whether the floor grid is drawn.
    pub floor: bool,
    /// Selected and hovered elements of the cage.
    pub selection: Selection,
    /// Transform gizmo.
    pub gizmo: Option<Gizmo>,
    /// Slice of the grid.
    pub slice: Option<SliceView>,
    /// Marked places with a problem.
    pub marks: Marks,
    /// Grabbed points, with lines to targets that they cannot reach.
    pub held: Marks,
    /// Joints of a skeleton, visible through surfaces.
    pub joints: Marks,
    /// Edges of a cage that is previewed, as segments.
    pub draft: Marks,
}

impl Default for SceneOptions {
    fn default() -> Self {
        Self {
            theme: Theme::Dark,
            backdrop: true,
            mesh: MeshStyle::Solid,
            weights_to_one: false,
            greyed: None,
            painted: false,
            mesh_edges: false,
            base_wireframe: false,
            cage_lines: true,
            handles: true,
            cage_faint: false,
            hidden: Vec::new(),
            floaters_hidden: false,
            floor: true,
            selection: Selection::default(),
            gizmo: None,
            slice: None,
            marks: Marks::default(),
            held: Marks::default(),
            joints: Marks::default(),
            draft: Marks::default(),
        }
    }
}

impl SceneOptions {
    /// Whether the mesh is painted instead of greyed, and the strength of either, 0 or 1.
    pub(super) fn overlay(&self) -> [f32; 2] {
        [self.painted, self.greyed.is_some()].map(|on| f32::from(u8::from(on)))
    }
}

/// Selected and hovered elements of the cage. Invalid indices are ignored.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// Selected vertices.
    pub vertices: Vec<u32>,
    /// Selected edges, as vertices in any order.
    pub edges: Vec<[u32; 2]>,
    /// Selected faces.
    pub faces: Vec<u32>,
    /// Hovered vertex.
    pub hovered_vertex: Option<u32>,
    /// Hovered edge.
    pub hovered_edge: Option<[u32; 2]>,
    /// Hovered face.
    pub hovered_face: Option<u32>,
    /// Vertices without a mirror image, in symmetric editing.
    pub unmatched: Vec<u32>,
}

/// Operation of a gizmo, with the shape of its handles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GizmoMode {
    /// Move the selection; handles are arrows.
    #[default]
    Move,
    /// Rotate the selection; handles are rings.
    Rotate,
    /// Scale the selection; handles are boxes.
    Scale,
}

/// A handle of a gizmo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GizmoPart {
    /// Moves or scales along an axis of the gizmo, or rotates about it: 0 is x, 1 is y, 2 is z.
    Axis(u8),
    /// Moves in the plane normal to an axis.
    Plane(u8),
    /// Moves in the view plane, rotates about the view direction, or scales uniformly.
    View,
}

/// A transform gizmo. Its size in the picture is constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gizmo {
    /// Operation of the gizmo.
    pub mode: GizmoMode,
    /// Origin of the gizmo, world space.
    pub center: Vec3,
    /// Orientation of the axes.
    pub rotation: Quat,
    /// Hovered or dragged handle.
    pub active: Option<GizmoPart>,
}

/// Display of a slice.
#[derive(Clone, Debug)]
pub struct SliceView {
    /// The slice. Shared, so that setting a scene is cheap; compared by identity.
    pub slice: Arc<Slice>,
    /// Control whose weights are shown, from 0 to the maximum, instead of cell types. Requires [`Slice::weights`].
    pub column: Option<u32>,
}

impl PartialEq for SliceView {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.slice, &other.slice) && self.column == other.column
    }
}

/// Marked places on or near the model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Marks {
    /// Points, world space.
    pub points: Vec<Vec3>,
    /// Points drawn as rings, world space.
    pub rings: Vec<Vec3>,
    /// Segments, world space.
    pub segments: Vec<[Vec3; 2]>,
    /// Vertices of the mesh, which follow the deformation.
    pub mesh_vertices: Vec<u32>,
    /// Vertices of the cage, which follow its pose.
    pub cage_vertices: Vec<u32>,
}
