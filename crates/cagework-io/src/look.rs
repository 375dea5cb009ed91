//! How a model looks: texture coordinates, colours, materials and the bytes of their textures.
//!
//! Decoration, so nothing here is an error: what cannot be read is left out. Images stay undecoded: a browser does that
//! itself, and a command has a library for it.

use std::ops::Range;

/// A model's triangles for drawing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Look {
    /// Corners of triangles. `[n_corners]`
    pub vertices: Vec<LookVertex>,
    /// Vertices that an OBJ shares between surfaces with a hard edge between them, once more for each further surface:
    /// the model's vertex that each moves with. They are counted on from the model's own. A glTF has split them itself.
    pub copies: Vec<u32>,
    /// Indices into `vertices`; the model's triangles, those of one material in a row. `[n_triangles]`
    pub triangles: Vec<[u32; 3]>,
    /// Materials of ranges of triangles; those of none have no material.
    pub groups: Vec<LookGroup>,
    /// Images that materials name.
    pub images: Vec<LookImage>,
}

/// A corner of triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LookVertex {
    /// The model's vertex that it moves with, or one of [`Look::copies`]. Corners that are one surface at a seam of a
    /// glTF name one vertex, so that normals of the moved mesh show no seam; where the file has a hard edge, they name
    /// different ones.
    pub source: u32,
    /// Texture coordinates, v downwards, transformed by the material.
    pub uv: [f32; 2],
    /// Factor of the base colour, linear RGBA.
    pub color: [f32; 4],
}

/// Triangles of one material.
#[derive(Clone, Debug, PartialEq)]
pub struct LookGroup {
    /// Range of [`Look::triangles`].
    pub triangles: Range<u32>,
    /// Base colour factor, linear RGBA.
    pub base_color: [f32; 4],
    /// Base colour texture, an index into [`Look::images`].
    pub image: Option<u32>,
    /// What the texture is outside its image, along u and v.
    pub wrap: [LookWrap; 2],
    /// What alpha means.
    pub alpha: LookAlpha,
    /// Whether the file asks for both sides to be drawn.
    pub double_sided: bool,
}

/// What alpha means (glTF 2.0, section 3.9.4).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum LookAlpha {
    /// Nothing.
    #[default]
    Opaque,
    /// Below the cutoff nothing is drawn.
    Mask {
        /// The cutoff.
        cutoff: f32,
    },
    /// How much covers what is behind.
    Blend,
}

/// What a texture is outside its image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LookWrap {
    /// The image again.
    #[default]
    Repeat,
    /// The image mirrored.
    Mirror,
    /// Its edge.
    Clamp,
}

/// An encoded image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LookImage {
    /// What the file calls it, for messages.
    pub name: String,
    /// PNG, JPEG, WebP or KTX2.
    pub bytes: Vec<u8>,
    /// Media type, by content.
    pub mime: String,
}

impl Default for LookGroup {
    fn default() -> Self {
        Self {
            triangles: 0..0,
            base_color: [1.0; 4],
            image: None,
            wrap: [LookWrap::Repeat; 2],
            alpha: LookAlpha::Opaque,
            double_sided: false,
        }
    }
}

impl LookVertex {
    /// A corner without texture and colour.
    #[must_use]
    pub fn plain(source: u32) -> Self {
        Self { source, uv: [0.0; 2], color: [1.0; 4] }
    }
}

/// Media type by content, of the formats that glTF has: what a file calls an image may be anything.
pub(crate) fn sniff_image(bytes: &[u8]) -> Option<&'static str> {
    match bytes {
        [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n', ..] => Some("image/png"),
        [0xff, 0xd8, 0xff, ..] => Some("image/jpeg"),
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Some("image/webp"),
        [0xab, b'K', b'T', b'X', b' ', b'2', b'0', 0xbb, b'\r', b'\n', 0x1a, b'\n', ..] => Some("image/ktx2"),
        _ => None,
    }
}

/// Linear from sRGB (IEC 61966-2-1): colours of OBJ files are written as they look.
pub(crate) fn linear_from_srgb(c: f32) -> f32 {
    if c <= 0.040_45 { c.max(0.0) / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}
