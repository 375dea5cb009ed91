//! Mirrors of the draw shaders' structs. `tests/shaders.rs` compares names, offsets and sizes.

use bytemuck::{Pod, Zeroable};

/// See `shaders/camera.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Camera {
    /// Clip from world, columns.
    pub clip_from_world: [[f32; 4]; 4],
    /// View from world, columns.
    pub view_from_world: [[f32; 4]; 4],
    /// Where the eye is, world space, object units.
    pub eye: [f32; 3],
    /// 1 in perspective, 0 in an orthographic picture.
    pub perspective: f32,
    /// Width and height of the picture, pixels of the target.
    pub viewport: [f32; 2],
    /// The target's pixels per CSS pixel.
    pub scale: f32,
    /// 1 if the target does not turn linear colours into sRGB itself.
    pub encode: u32,
    /// Background above, linear.
    pub background_top: [f32; 4],
    /// Background below, linear.
    pub background_bottom: [f32; 4],
    /// Lines of the floor, linear, straight alpha.
    pub floor_color: [f32; 4],
    /// Middle of the floor, world space.
    pub floor_center: [f32; 3],
    /// Where it ends, object units.
    pub floor_radius: f32,
    /// Distance of its lines, object units.
    pub floor_spacing: f32,
    /// How much smaller clip depth is for a point that is nearer by all of its depth.
    pub lift: f32,
    /// Size of a pixel of the target in clip space.
    pub pixel: [f32; 2],
}

/// See `shaders/draw_mesh.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Surface {
    /// Factor of the base colour, linear RGBA.
    pub base_color: [f32; 4],
    /// What colours it, see [`surface_mode`].
    pub mode: u32,
    /// Below this alpha nothing is drawn.
    pub alpha_cutoff: f32,
    /// Value of the first colour.
    pub low: f32,
    /// Value of the last colour; of a material, how much of the vertices' values greys it.
    pub high: f32,
}

/// Values of [`Surface::mode`], the shader's constants of the same names.
pub mod surface_mode {
    /// The material, which covers everything behind it.
    pub const MATERIAL: u32 = 0;
    /// Weights of one cage vertex.
    pub const WEIGHTS: u32 = 1;
    /// Logarithms of errors.
    pub const ERRORS: u32 = 2;
    /// One colour, without texture and vertex colours.
    pub const CLAY: u32 = 3;
    /// The material, with its alpha.
    pub const BLENDED: u32 = 4;
}

/// See `shaders/overlay.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Style {
    /// Colour of each state, linear, straight alpha.
    pub colors: [[f32; 4]; 8],
    /// Width of lines or diameter of points in each state, CSS pixels.
    pub widths: [[f32; 4]; 2],
    /// Rim of points, linear, straight alpha.
    pub rim_color: [f32; 4],
    /// Width of the rim, CSS pixels.
    pub rim: f32,
    /// How much nearer to the eye than it is it is drawn, as a fraction of its depth.
    pub lift: f32,
    /// Factor of all alphas.
    pub opacity: f32,
    /// Factor of all widths.
    pub size: f32,
}

/// Upper bits of an item that hold its state; the constant of `shaders/overlay.wgsl`.
pub const STATE_SHIFT: u32 = 28;

/// The state of what is not drawn; the constant of `shaders/overlay.wgsl`.
pub const HIDDEN: u32 = 15;

/// See `shaders/draw_slice.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct SliceView {
    /// Outer corner of the first cell, world space.
    pub corner: [f32; 3],
    /// Value of the last colour; 0 if kinds of cells are shown.
    pub high: f32,
    /// Edge of a cell along u, object units.
    pub u: [f32; 3],
    /// Cells along u.
    pub n_u: u32,
    /// Edge of a cell along v, object units.
    pub v: [f32; 3],
    /// Cells along v.
    pub n_v: u32,
    /// Colour of each kind (untyped, boundary, interior, exterior), linear, straight alpha.
    pub kinds: [[f32; 4]; 4],
    /// Lines between cells, linear, straight alpha.
    pub line_color: [f32; 4],
}

/// See `shaders/draw_gizmo.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct GizmoView {
    /// World from the gizmo's own space, where its axes are 1 long.
    pub world_from_gizmo: [[f32; 4]; 4],
}
