//! The draw table: every draw shader with what it is composed of and bound to. `tests/shaders.rs` compares it with the
//! WGSL.

use DrawBinding::{Read, Sampler, Texture, Uniform};

/// What a binding of a draw shader is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DrawBinding {
    /// `var<uniform>`.
    Uniform,
    /// `var<storage, read>`.
    Read,
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
    /// The whole source.
    pub wgsl: &'static str,
    /// Bindings of groups 1 and up, in order; group 0 is the camera's uniform.
    pub groups: &'static [&'static [DrawBinding]],
}

/// Bindings of what is drawn over the model: style, positions, items.
const OVERLAY_GROUP: &[DrawBinding] = &[Uniform, Read, Read];

/// Declares shaders and the list of them all.
macro_rules! shaders {
    ($($(#[$doc:meta])* $id:ident = $name:literal + [$($shared:literal),+], $groups:expr;)+) => {
        $(
            $(#[$doc])*
            pub const $id: DrawShader = DrawShader {
                name: $name,
                wgsl: concat!(
                    $(include_str!(concat!("../../../../shaders/", $shared, ".wgsl")),)+
                    include_str!(concat!("../../../../shaders/", $name, ".wgsl"))
                ),
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
    MESH = "draw_mesh" + ["camera", "colormap", "light"], &[&[Read, Read, Read], &[Uniform, Texture, Sampler]];
    /// Edges of cage and mesh, segments of marks.
    LINES = "draw_lines" + ["camera", "overlay"], &[OVERLAY_GROUP];
    /// Handles and marks.
    POINTS = "draw_points" + ["camera", "overlay"], &[OVERLAY_GROUP];
    /// Chosen faces.
    FACES = "draw_faces" + ["camera", "overlay"], &[OVERLAY_GROUP];
    /// Floor grid.
    FLOOR = "draw_floor" + ["camera"], &[];
    /// Slice of the grid.
    SLICE = "draw_slice" + ["camera", "colormap"], &[&[Uniform, Read]];
    /// Handles of the tool in use.
    GIZMO = "draw_gizmo" + ["camera"], &[&[Uniform]];
}
