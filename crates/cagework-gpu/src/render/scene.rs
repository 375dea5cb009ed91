//! Contents and display options of a picture: plain values, set by the page or by a command.

use std::ops::Range;
use std::sync::Arc;

use cagework_core::slice::Slice;
use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

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

/// Display options that the user chooses, for the view and for exported pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct ViewOptions {
    /// Colours of background and overlays.
    pub theme: Theme,
    /// Whether the rest pose is drawn as a wireframe, as in figures 2 to 5 of K. Smith's paper (`docs/method.md`,
    /// sources).
    pub base_wireframe: bool,
    /// Whether the floor grid is drawn.
    pub floor: bool,
    /// Whether splats outside the cage are drawn.
    pub floaters: bool,
    /// Whether colours of weights span 0 to 1 instead of 0 to the maximum.
    pub weights_to_one: bool,
}

impl Default for ViewOptions {
    fn default() -> Self {
        Self { theme: Theme::Dark, base_wireframe: false, floor: true, floaters: true, weights_to_one: false }
    }
}

/// How the mesh is drawn.
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
        /// Index of the control whose weights are drawn.
        column: u32,
    },
    /// Reproduction error of the weights at rest, as a fraction of the cage's diagonal, on a logarithmic scale:
    /// [`super::colormap::ERROR_RANGE`].
    Errors,
}

/// Contents and display options of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneOptions {
    /// Theme, wireframe, floor, floaters and colour scale.
    pub view: ViewOptions,
    /// Whether the background is drawn. Otherwise it is transparent.
    pub backdrop: bool,
    /// How the mesh is drawn.
    pub mesh: MeshStyle,
    /// Strength, 0 to 1, with which each vertex is blended towards grey or, if [`Self::painted`], towards the colour of
    /// paint, in [`MeshStyle::Solid`] and [`MeshStyle::Clay`]. It shows which vertices stay in place. `[n_vertices]`
    pub greyed: Option<Arc<Vec<f32>>>,
    /// Whether vertices are blended towards the colour of paint, not towards grey.
    pub painted: bool,
    /// Whether the mesh's edges are drawn.
    pub mesh_edges: bool,
    /// Whether the cage's edges are drawn.
    pub cage_lines: bool,
    /// Whether handles are drawn at the cage's vertices.
    pub handles: bool,
    /// Whether the cage is drawn fainter, with handles only at selected, hovered and unmatched vertices.
    pub cage_faint: bool,
    /// Ranges of [`super::DrawModel::triangles`] that are not drawn. Each consists of whole groups.
    pub hidden: Vec<Range<u32>>,
    /// Selected and hovered elements of the cage.
    pub selection: Selection,
    /// Transform gizmo; `None` if it is not drawn.
    pub gizmo: Option<Gizmo>,
    /// Slice of the solver's grid; `None` if it is not drawn.
    pub slice: Option<SliceView>,
    /// Marks at the places of problems.
    pub marks: Marks,
    /// Grabbed points, and for each point that cannot reach its target a line to the target.
    pub held: Marks,
    /// Joints of a skeleton, visible through surfaces.
    pub joints: Marks,
    /// Edges of a cage that is previewed, as segments.
    pub draft: Marks,
    /// Height of the floor above the lowest point of the model at rest, object units.
    pub floor_height: f32,
}

impl Default for SceneOptions {
    fn default() -> Self {
        Self {
            view: ViewOptions::default(),
            backdrop: true,
            mesh: MeshStyle::Solid,
            greyed: None,
            painted: false,
            mesh_edges: false,
            cage_lines: true,
            handles: true,
            cage_faint: false,
            hidden: Vec::new(),
            selection: Selection::default(),
            gizmo: None,
            slice: None,
            marks: Marks::default(),
            held: Marks::default(),
            joints: Marks::default(),
            draft: Marks::default(),
            floor_height: 0.0,
        }
    }
}

impl SceneOptions {
    /// [`Surface::low`](super::layout::Surface::low) and `high` for styles without a colour map, each 0 or 1: whether
    /// vertices are painted instead of greyed, and whether they are painted or greyed at all.
    pub(super) fn overlay(&self) -> [f32; 2] {
        [self.painted, self.greyed.is_some()].map(|on| f32::from(u8::from(on)))
    }
}

/// Selected and hovered elements of the cage. Invalid indices are ignored.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// Indices of the selected controls: the cage's vertices, then the controls inside the cage.
    pub vertices: Vec<u32>,
    /// Selected edges, each as its two ends in any order.
    pub edges: Vec<[u32; 2]>,
    /// Indices of the selected faces of the cage.
    pub faces: Vec<u32>,
    /// Index of the control under the pointer, if there is one.
    pub hovered_vertex: Option<u32>,
    /// Ends of the edge under the pointer, if there is one.
    pub hovered_edge: Option<[u32; 2]>,
    /// Index of the face under the pointer, if there is one.
    pub hovered_face: Option<u32>,
    /// Vertices without a mirror image, in symmetric editing.
    pub unmatched: Vec<u32>,
}

cagework_core::choice! {
    /// Operation of a gizmo, with the shape of its handles.
    GizmoMode {
        /// Move the selection; handles are arrows.
        #[default]
        Move = "move",
        /// Rotate the selection; handles are rings.
        Rotate = "rotate",
        /// Scale the selection; handles are boxes.
        Scale = "scale",
    }
}

/// A handle of a gizmo.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
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
    /// Rotation from the world's axes to the gizmo's axes.
    pub rotation: Quat,
    /// Hovered or dragged handle.
    pub active: Option<GizmoPart>,
}

/// A slice of the grid, and how it is coloured.
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
    /// Centres of filled points, world space.
    pub points: Vec<Vec3>,
    /// Centres of points drawn as rings, world space.
    pub rings: Vec<Vec3>,
    /// Ends of line segments, world space.
    pub segments: Vec<[Vec3; 2]>,
    /// Indices of mesh vertices to mark. The marks follow the deformation.
    pub mesh_vertices: Vec<u32>,
    /// Indices of cage vertices to mark. The marks follow the cage's pose.
    pub cage_vertices: Vec<u32>,
}
