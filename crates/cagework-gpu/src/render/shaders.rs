//! The draw table: every draw shader with what it is composed of and bound to. `tests/shaders.rs` compares it with the
//! WGSL.

use DrawBinding::{Sampler, Table, Texture, Uniform};

use crate::device::GpuContext;
use crate::table::Entry;

/// What a binding of a draw shader is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DrawBinding {
    /// `var<uniform>`.
    Uniform,
    /// What shaders read by number: `var<storage, read>`, or a `texture_2d`.
    Table(Entry),
    /// `texture_2d<f32>`.
    Texture,
    /// `sampler`.
    Sampler,
}

/// One draw shader; its entry points are `vertex` and `fragment`.
#[derive(Debug)]
pub struct DrawShader {
    /// Name of the file.
    pub name: &'static str,
    /// The whole source, its tables in buffers.
    pub wgsl: &'static str,
    /// The same with tables in textures, for WebGL2.
    #[cfg(feature = "webgl")]
    pub wgsl_textures: &'static str,
    /// Bindings of groups 1 and up, in order; group 0 is the camera's uniform where there is one.
    pub groups: &'static [&'static [DrawBinding]],
}

/// Bindings of what is drawn over the model: style, positions, items.
const OVERLAY_GROUP: &[DrawBinding] = &[Uniform, Table(Entry::Point), Table(Entry::Pair)];

/// Text of the files of some shaders, joined.
macro_rules! text {
    ($($file:expr),+) => {
        concat!($(include_str!(concat!("../../shaders/", $file, ".wgsl"))),+)
    };
}

/// Declares shaders and the list of them all. In brackets what they share; then where their tables are, as buffers or
/// as textures.
macro_rules! shaders {
    ($(
        $(#[$doc:meta])*
        $id:ident = $name:literal + [$($shared:literal),*] $(+ ($buffers:literal, $textures:literal))?, $groups:expr;
    )+) => {
        $(
            $(#[$doc])*
            pub const $id: DrawShader = DrawShader {
                name: $name,
                wgsl: text!($($shared,)* $($buffers,)? $name),
                #[cfg(feature = "webgl")]
                wgsl_textures: text!($($shared,)* $("rows", $textures,)? $name),
                groups: $groups,
            };
        )+
        /// All draw shaders.
        pub const ALL: &[&DrawShader] = &[$(&$id),+];
    };
}

shaders! {
    /// Gradient behind everything.
    BACKGROUND = "draw_background" + ["camera"], &[];
    /// The mesh.
    MESH = "draw_mesh" + ["camera", "colormap", "light"] + ("mesh_buffers", "mesh_textures"),
        &[&[Table(Entry::Point), Table(Entry::Point), Table(Entry::Value)], &[Uniform, Texture, Sampler]];
    /// Edges of cage and mesh, segments of marks.
    LINES = "draw_lines" + ["camera", "overlay"] + ("overlay_buffers", "overlay_textures"), &[OVERLAY_GROUP];
    /// Handles and marks.
    POINTS = "draw_points" + ["camera", "overlay"] + ("overlay_buffers", "overlay_textures"), &[OVERLAY_GROUP];
    /// Chosen faces.
    FACES = "draw_faces" + ["camera", "overlay"] + ("overlay_buffers", "overlay_textures"), &[OVERLAY_GROUP];
    /// Floor grid.
    FLOOR = "draw_floor" + ["camera"], &[];
    /// Slice of the grid.
    SLICE = "draw_slice" + ["camera", "colormap"] + ("slice_buffers", "slice_textures"),
        &[&[Uniform, Table(Entry::Pair)]];
    /// Handles of the tool in use.
    GIZMO = "draw_gizmo" + ["camera"], &[&[Uniform]];
    /// A picture at its place on a canvas; knows no camera.
    PART = "draw_part" + [], &[&[Texture]];
}

impl DrawShader {
    /// The source for a device.
    pub(crate) fn source(&self, context: &GpuContext) -> &'static str {
        #[cfg(feature = "webgl")]
        if context.draws_only() {
            return self.wgsl_textures;
        }
        let _ = context;
        self.wgsl
    }
}
