//! How a model looks: corners with texture coordinates and colours, materials, encoded textures.
//!
//! Only what a preview shows: base colour, its texture and transparency. Everything else a document says about its
//! materials stays in the document. Damage here never refuses a model: the shape matters more.

use std::collections::HashMap;
use std::ops::Range;

use crate::model::{Document, Model};
use crate::obj::NONE;

/// A corner of triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LookCorner {
    /// The model's vertex that it moves with and shares its normal with.
    pub source: u32,
    /// Texture coordinates, v downwards as in glTF.
    pub uv: [f32; 2],
    /// Factor of the base colour, linear RGBA, 0 to 1.
    pub color: [f32; 4],
}

/// What alpha means.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum LookAlpha {
    /// Nothing.
    #[default]
    Opaque,
    /// Below this nothing is drawn.
    Mask(f32),
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

/// Triangles of one material.
#[derive(Clone, Debug, PartialEq)]
pub struct LookGroup {
    /// Range of [`Look::triangles`].
    pub triangles: Range<u32>,
    /// Base colour factor, linear RGBA; nothing without a material.
    pub base_color: Option<[f32; 4]>,
    /// Base colour texture, an index into [`Look::textures`].
    pub texture: Option<u32>,
    /// What alpha means.
    pub alpha: LookAlpha,
}

/// A texture as it lies in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LookTexture {
    /// PNG, JPEG or WebP file.
    pub bytes: Vec<u8>,
    /// Its media type, empty if unknown.
    pub mime: String,
    /// Along u and v.
    pub wrap: [LookWrap; 2],
}

/// A model as it is drawn. Corners and the model's vertices are two lists: an OBJ's vertex may have several texture
/// coordinates, and a glTF's vertices that were split at a seam must not show in the shading.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Look {
    /// Corners of triangles. `[n_corners]`
    pub corners: Vec<LookCorner>,
    /// Indices into `corners`, in the order of the model's triangles but for OBJ files, where they are by material.
    pub triangles: Vec<[u32; 3]>,
    /// Materials of ranges of triangles, ascending, without gaps.
    pub groups: Vec<LookGroup>,
    /// Base colour textures in use.
    pub textures: Vec<LookTexture>,
}

impl Model {
    /// How the model looks.
    #[must_use]
    pub fn look(&self) -> Look {
        match &self.document {
            Document::Gltf(document) => crate::gltf::look(document, &self.positions, &self.triangles),
            Document::Obj(document) => obj_look(document),
        }
    }
}

/// One corner for each distinct (vertex, texture coordinate); materials have no colours, because `.mtl` files are not
/// read.
fn obj_look(document: &crate::obj::ObjDocument) -> Look {
    let mut look = Look::default();
    let mut numbers = HashMap::new();
    for triangle in &document.triangles {
        look.triangles.push(triangle.map(|corner| {
            let corner = document.corners[corner as usize];
            *numbers.entry((corner.v, corner.vt)).or_insert_with(|| {
                let uv = match corner.vt {
                    NONE => [0.0; 2],
                    vt => document.texcoords.get(vt as usize).map_or([0.0; 2], |&[u, v]| [u, 1.0 - v]),
                };
                look.corners.push(LookCorner { source: corner.v, uv, color: [1.0; 4] });
                look.corners.len() as u32 - 1
            })
        }));
    }
    let all = 0..look.triangles.len() as u32;
    look.groups =
        vec![LookGroup { triangles: all, base_color: None, texture: None, alpha: LookAlpha::Opaque }];
    look
}
