//! Draw table: each draw shader with its sources and bindings. `tests/draw_shaders.rs` compares it with the WGSL.

use DrawBinding::{Sampler, Table, Texture, Uniform};

use crate::device::GpuContext;
use crate::table::Entry;

/// Type of a binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DrawBinding {
    /// `var<uniform>`.
    Uniform,
    /// An indexed array: `var<storage, read>`, or a `texture_2d`.
    Table(Entry),
    /// `texture_2d<f32>`.
    Texture,
    /// `sampler`.
    Sampler,
}

/// A draw shader with entry points `vertex` and `fragment`.
#[derive(Debug)]
pub struct DrawShader {
    /// Name of the WGSL file in `shaders/`, without its extension.
    pub name: &'static str,
    /// Complete source, with tables in buffers.
    pub wgsl: &'static str,
    /// Complete source with tables in textures, for WebGL2.
    #[cfg(feature = "webgl")]
    pub wgsl_textures: &'static str,
    /// Bindings of groups 1 and up. Group 0 is the camera's uniform, if used.
    pub groups: &'static [&'static [DrawBinding]],
}

/// Bindings of overlays: style, positions, items.
const OVERLAY_GROUP: &[DrawBinding] = &[Uniform, Table(Entry::Point), Table(Entry::Pair)];

/// Bindings of the mesh: positions, normals, values.
const MESH_GROUP: &[DrawBinding] = &[Table(Entry::Point), Table(Entry::Point), Table(Entry::Value)];

/// Concatenates shader files.
macro_rules! text {
    ($($file:expr),+) => {
        concat!($(include_str!(concat!("../../shaders/", $file, ".wgsl"))),+)
    };
}

/// Declares shaders and the list `ALL`. In brackets: included files; in parentheses: the files that declare
/// tables, as buffers and as textures.
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
    /// Draws the background gradient.
    BACKGROUND = "draw_background" + ["camera"], &[];
    /// Draws the mesh.
    MESH = "draw_mesh" + ["camera", "colormap", "light"] + ("mesh_buffers", "mesh_textures"),
        &[MESH_GROUP, &[Uniform, Texture, Sampler]];
    /// Draws edges of cage and mesh, and segments of marks.
    LINES = "draw_lines" + ["camera", "overlay"] + ("overlay_buffers", "overlay_textures"), &[OVERLAY_GROUP];
    /// Draws handles and marks.
    POINTS = "draw_points" + ["camera", "overlay"] + ("overlay_buffers", "overlay_textures"), &[OVERLAY_GROUP];
    /// Draws selected faces.
    FACES = "draw_faces" + ["camera", "overlay"] + ("overlay_buffers", "overlay_textures"), &[OVERLAY_GROUP];
    /// Draws the map of the model's shadow on the floor.
    SHADOW = "draw_shadow" + ["camera", "shadow"] + ("mesh_buffers", "mesh_textures"), &[MESH_GROUP];
    /// Draws the floor: shadow and grid.
    FLOOR = "draw_floor" + ["camera", "shadow"], &[&[Texture, Sampler]];
    /// Draws a slice of the grid.
    SLICE = "draw_slice" + ["camera", "colormap"] + ("slice_buffers", "slice_textures"),
        &[&[Uniform, Table(Entry::Pair)]];
    /// Draws the transform gizmo.
    GIZMO = "draw_gizmo" + ["camera"], &[&[Uniform]];
    /// Draws Gaussian splats into a layer.
    SPLATS = "draw_splats" + ["camera"] + ("splat_buffers", "splat_textures"),
        &[&[Table(Entry::Point), Table(Entry::Pair)]];
    /// Draws the layer of splats into the picture.
    LAYER = "draw_layer" + ["camera"], &[&[Texture]];
    /// Draws a texture on a part of a canvas. Has no camera.
    PART = "draw_part" + [], &[&[Texture]];
}

impl DrawShader {
    /// Source for a device: with tables in textures if the device only draws, otherwise in buffers.
    pub(crate) fn source(&self, context: &GpuContext) -> &'static str {
        #[cfg(feature = "webgl")]
        if context.draws_only() {
            return self.wgsl_textures;
        }
        let _ = context;
        self.wgsl
    }
}
