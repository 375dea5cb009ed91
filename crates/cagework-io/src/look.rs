//! Appearance of a model: texture coordinates, colours, materials and encoded textures.
//!
//! Appearance is optional, so unreadable parts are skipped and never an error. Images stay encoded: browsers
//! decode them, and the command line has a decoder.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

/// A model's triangles for drawing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Look {
    /// Vertices for drawing. Each corner of a triangle refers to one of them.
    pub vertices: Vec<LookVertex>,
    /// Duplicates of OBJ vertices at hard edges. Each entry is the model vertex whose position the duplicate takes.
    /// Duplicate `k` has index `n_vertices + k`. Empty for glTF, which stores split vertices.
    pub copies: Vec<u32>,
    /// Indices into `vertices`: the model's triangles, grouped by material. `[n_triangles, 3]`
    pub triangles: Vec<[u32; 3]>,
    /// Materials of ranges of `triangles`. Triangles in no range have no material.
    pub groups: Vec<LookGroup>,
    /// Images that the groups refer to.
    pub images: Vec<LookImage>,
}

/// A vertex for drawing. A glTF has one per model vertex; in an OBJ, triangle corners with equal members share one.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct LookVertex {
    /// Model vertex whose position the corner takes, or a duplicate in [`Look::copies`]. Corners on both sides of a UV
    /// seam share one source, so recomputed normals stay smooth there; corners across a hard edge have different
    /// sources.
    pub source: u32,
    /// Texture coordinates, v downwards, with the material's texture transform applied.
    pub uv: [f32; 2],
    /// Vertex colour, linear RGBA; multiplies the base colour.
    pub color: [f32; 4],
}

/// Triangles of one material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LookGroup {
    /// Range of [`Look::triangles`].
    pub triangles: Range<u32>,
    /// Base colour factor, linear RGBA.
    pub base_color: [f32; 4],
    /// Base colour texture, an index into [`Look::images`].
    pub image: Option<u32>,
    /// Wrap mode along u and v.
    pub wrap: [LookWrap; 2],
    /// How alpha is used: not at all, to discard fragments, or to blend.
    pub alpha: LookAlpha,
    /// Whether back faces are drawn.
    pub double_sided: bool,
}

/// Alpha mode of a material (glTF 2.0, section 3.9.4).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum LookAlpha {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// Fragments with alpha below the cutoff are discarded.
    Mask {
        /// Alpha cutoff, 0 to 1.
        cutoff: f32,
    },
    /// Alpha is the coverage for blending over the background.
    Blend,
}

/// Wrap mode of a texture outside [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum LookWrap {
    /// Repeats the image.
    #[default]
    Repeat,
    /// Repeats the image, mirrored every second time.
    Mirror,
    /// Repeats the edge texel.
    Clamp,
}

/// An encoded image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LookImage {
    /// Name in the file, for messages.
    pub name: String,
    /// Encoded PNG, JPEG, WebP or KTX2; empty if image views overlap so much that copies of all of them would exceed
    /// the size of the file's buffers.
    pub bytes: Vec<u8>,
    /// Media type, detected from the bytes.
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
    /// A white corner without texture coordinates.
    #[must_use]
    pub fn plain(source: u32) -> Self {
        Self { source, uv: [0.0; 2], color: [1.0; 4] }
    }
}

/// Detects the media type of an image from its bytes. The type that the file declares is not trusted.
pub(crate) fn sniff_image(bytes: &[u8]) -> Option<&'static str> {
    match bytes {
        [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n', ..] => Some("image/png"),
        [0xff, 0xd8, 0xff, ..] => Some("image/jpeg"),
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Some("image/webp"),
        [0xab, b'K', b'T', b'X', b' ', b'2', b'0', 0xbb, b'\r', b'\n', 0x1a, b'\n', ..] => Some("image/ktx2"),
        _ => None,
    }
}
