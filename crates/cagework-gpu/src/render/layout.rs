//! Rust mirrors of the draw shaders' structs. `tests/draw_shaders.rs` compares names, offsets and sizes.

use bytemuck::{Pod, Zeroable};

/// Mirrors `Camera` in `shaders/camera.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Camera {
    /// World to clip space, column-major.
    pub clip_from_world: [[f32; 4]; 4],
    /// World to view space, column-major.
    pub view_from_world: [[f32; 4]; 4],
    /// Eye, world space, object units.
    pub eye: [f32; 3],
    /// 1: perspective, 0: orthographic.
    pub perspective: f32,
    /// Width and height of the render target, pixels.
    pub viewport: [f32; 2],
    /// Pixels of the target per CSS pixel.
    pub scale: f32,
    /// 1 if shaders must encode sRGB, because the target's format does not.
    pub encode: u32,
    /// Background colour at the top, linear.
    pub background_top: [f32; 4],
    /// Background colour at the bottom, linear.
    pub background_bottom: [f32; 4],
    /// Colour of the floor grid, linear, straight alpha.
    pub floor_color: [f32; 4],
    /// Centre of the floor, world space.
    pub floor_center: [f32; 3],
    /// Radius of the floor, object units.
    pub floor_radius: f32,
    /// Spacing of the grid lines, object units.
    pub floor_spacing: f32,
    /// Decrease of clip depth per relative decrease of view depth, see [`Style::lift`].
    pub lift: f32,
    /// Size of a pixel of the target, clip space.
    pub pixel: [f32; 2],
}

/// Mirrors `Surface` in `shaders/draw_mesh.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Surface {
    /// Factor of the base colour, linear RGBA.
    pub base_color: [f32; 4],
    /// Source of the colour, see [`surface_mode`].
    pub mode: u32,
    /// Alpha below which fragments are discarded.
    pub alpha_cutoff: f32,
    /// In the modes with a colour map, value of the map's first colour. In the other modes, 1 to blend towards the
    /// colour of paint, 0 to blend towards grey.
    pub low: f32,
    /// In the modes with a colour map, value of the map's last colour. In the other modes, 1 to blend by the vertices'
    /// values, 0 to leave colours unchanged.
    pub high: f32,
}

/// Values of [`Surface::mode`]. The shader defines constants with the same names.
pub mod surface_mode {
    /// The material's colour, opaque.
    pub const MATERIAL: u32 = 0;
    /// The colour map of the weights of a control.
    pub const WEIGHTS: u32 = 1;
    /// The colour map of errors, applied to their base 10 logarithms. The vertices' values are the errors.
    pub const ERRORS: u32 = 2;
    /// A single colour, without texture and vertex colours.
    pub const CLAY: u32 = 3;
    /// The material's colour, blended by its alpha.
    pub const ALPHA_BLENDING: u32 = 4;
}

/// Mirrors `Style` in `shaders/overlay.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Style {
    /// Colour of each state, linear, straight alpha.
    pub colors: [[f32; 4]; 8],
    /// Width of lines or diameter of points in each state, CSS pixels.
    pub widths: [[f32; 4]; 2],
    /// Colour of the rim of points, linear, straight alpha.
    pub rim_color: [f32; 4],
    /// Width of the rim, CSS pixels.
    pub rim: f32,
    /// Offset towards the eye, as a fraction of the view depth, so that lines on a surface appear in front of it.
    pub lift: f32,
    /// Factor of the alpha of all colours.
    pub opacity: f32,
    /// Factor of the widths in all states.
    pub size: f32,
}

/// State of rings: points without a fill.
pub(super) const RING_STATE: u32 = 1;

/// Position of the state bits in an item. Same as in `shaders/overlay.wgsl`.
pub const STATE_SHIFT: u32 = 28;

/// State of hidden items. Same as in `shaders/overlay.wgsl`.
pub const HIDDEN_STATE: u32 = 15;

/// Mirrors `SliceView` in `shaders/draw_slice.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct SliceView {
    /// Outer corner of the first cell, world space.
    pub corner: [f32; 3],
    /// Value of the last colour; 0 to colour by cell type.
    pub high: f32,
    /// Edge vector of a cell along u, object units.
    pub u: [f32; 3],
    /// Number of cells along u.
    pub n_u: u32,
    /// Edge vector of a cell along v, object units.
    pub v: [f32; 3],
    /// Number of cells along v.
    pub n_v: u32,
    /// Colour of each cell type (untyped, boundary, interior, exterior), linear, straight alpha.
    pub kinds: [[f32; 4]; 4],
    /// Colour of the lines between cells, linear, straight alpha.
    pub line_color: [f32; 4],
}

/// Mirrors `GizmoView` in `shaders/draw_gizmo.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct GizmoView {
    /// Gizmo to world space. In gizmo space the axes have length 1.
    pub world_from_gizmo: [[f32; 4]; 4],
}
