//! What is drawn of a model: corners with texture coordinates and colours, material groups, decoded textures.

use std::collections::HashMap;

use bytemuck::{Pod, Zeroable};
use cagework_core::Weights;
use cagework_core::deform::OutsideVertex;
use glam::Vec3;

/// Base colour without a material, linear: a light, slightly warm grey, as of unfired clay.
pub const CLAY: [f32; 4] = [0.52, 0.505, 0.485, 1.0];

/// A model as it is drawn.
///
/// Vertices that are bound and deformed (`positions`) and corners that are drawn (`vertices`) are two lists: an OBJ's
/// vertex may have several texture coordinates, and a glTF's seams must not show in the shading.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DrawModel {
    /// Rest positions, what is bound. `[n_vertices]`, object units.
    pub positions: Vec<Vec3>,
    /// Vertices once more, for surfaces that share them but not their normals: an OBJ's hard edges. The vertex that each
    /// moves with; they are counted on from `positions`. `[n_copies]`
    pub copies: Vec<u32>,
    /// Corners of triangles. `[n_corners]`
    pub vertices: Vec<DrawVertex>,
    /// Indices into `vertices`, counter-clockwise seen from outside. `[n_triangles]`
    pub triangles: Vec<[u32; 3]>,
    /// Material of each range of triangles; triangles of no group are drawn as clay.
    pub groups: Vec<DrawGroup>,
    /// Textures that groups name.
    pub textures: Vec<DrawTexture>,
}

/// A corner of triangles.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct DrawVertex {
    /// The vertex of `positions`, or the one of `copies`, that it moves with and that it shares its normal with.
    pub source: u32,
    /// Texture coordinates, v downwards as in glTF.
    pub uv: [f32; 2],
    /// Factor of the base colour, linear RGBA, 65,535 for one.
    pub color: [u16; 4],
}

/// Triangles of one material.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawGroup {
    /// Range of [`DrawModel::triangles`].
    pub triangles: std::ops::Range<u32>,
    /// Base colour factor, linear RGBA.
    pub base_color: [f32; 4],
    /// Base colour texture, an index into [`DrawModel::textures`].
    pub texture: Option<u32>,
    /// What alpha means.
    pub alpha: Alpha,
}

/// What a material's alpha means.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Alpha {
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
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// The image mirrored.
    Mirror,
    /// Its edge.
    Clamp,
}

/// A decoded image.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DrawTexture {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// sRGB with straight alpha, rows from the top. `[height, width, 4]`
    pub rgba: Vec<u8>,
    /// Along u and v.
    pub wrap: [Wrap; 2],
}

impl DrawVertex {
    /// A corner without texture and colour.
    #[must_use]
    pub fn plain(source: u32) -> Self {
        Self { source, uv: [0.0; 2], color: [u16::MAX; 4] }
    }
}

impl Default for DrawGroup {
    fn default() -> Self {
        Self { triangles: 0..0, base_color: CLAY, texture: None, alpha: Alpha::Opaque }
    }
}

impl DrawModel {
    /// A model of clay.
    #[must_use]
    pub fn plain(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Self {
        let vertices = (0..positions.len() as u32).map(DrawVertex::plain).collect();
        Self { positions, vertices, triangles, ..Self::default() }
    }

    /// Values of vertices, and those of the copies after them. `[n_vertices]` -> `[n_vertices + n_copies]`
    #[must_use]
    pub(crate) fn with_copies<T: Copy>(&self, values: &[T]) -> Vec<T> {
        values.iter().copied().chain(self.copies.iter().map(|&v| values[v as usize])).collect()
    }

    /// Weights and outside vertices with those of the copies; nothing if there are none.
    pub(crate) fn moved_with_copies(
        &self,
        weights: &Weights,
        outside: &[OutsideVertex],
    ) -> Option<(Weights, Vec<OutsideVertex>)> {
        if self.copies.is_empty() {
            return None;
        }
        let n = self.positions.len() as u32;
        let rows: Vec<u32> = (0..n).chain(self.copies.iter().copied()).collect();
        let mut outside = outside.to_vec();
        let known: HashMap<u32, OutsideVertex> = outside.iter().map(|o| (o.vertex, *o)).collect();
        for (vertex, source) in (n..).zip(&self.copies) {
            outside.extend(known.get(source).map(|o| OutsideVertex { vertex, ..*o }));
        }
        Some((weights.with_rows(&rows), outside))
    }

    /// Triangles as indices into `positions` and `copies`: what normals are made of. `[n_triangles]`
    #[must_use]
    pub fn shading_triangles(&self) -> Vec<[u32; 3]> {
        let source = |corner: u32| self.vertices[corner as usize].source;
        self.triangles.iter().map(|t| t.map(source)).collect()
    }

    /// Why the lists do not belong together, if they do not.
    pub(crate) fn fault(&self) -> Option<String> {
        let (n_vertices, n_corners) = (self.positions.len(), self.vertices.len());
        if let Some(v) = self.copies.iter().find(|&&v| v as usize >= n_vertices) {
            return Some(format!("a copy names vertex {v}, but there are {n_vertices}"));
        }
        let n_sources = n_vertices + self.copies.len();
        if let Some(v) = self.vertices.iter().find(|v| v.source as usize >= n_sources) {
            return Some(format!("a corner names vertex {}, but there are {n_sources}", v.source));
        }
        if let Some(i) = self.triangles.iter().flatten().find(|&&i| i as usize >= n_corners) {
            return Some(format!("a triangle names corner {i}, but there are {n_corners}"));
        }
        for group in &self.groups {
            let range = &group.triangles;
            if range.start > range.end || range.end as usize > self.triangles.len() {
                return Some(format!("a material covers triangles {range:?} of {}", self.triangles.len()));
            }
            if let Some(t) = group.texture.filter(|&t| t as usize >= self.textures.len()) {
                return Some(format!("a material names texture {t}, but there are {}", self.textures.len()));
            }
        }
        for (number, t) in self.textures.iter().enumerate() {
            let needed = t.width as usize * t.height as usize * 4;
            if needed == 0 || t.rgba.len() != needed {
                return Some(format!(
                    "texture {number} is {} x {} pixels, but has {} bytes",
                    t.width,
                    t.height,
                    t.rgba.len()
                ));
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> DrawModel {
        DrawModel::plain(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])
    }

    #[test]
    fn plain_model_has_no_fault() {
        assert_eq!(triangle().fault(), None);
        assert_eq!(triangle().shading_triangles(), [[0, 1, 2]]);
        assert_eq!(DrawModel::default().fault(), None);
    }

    #[test]
    fn copies_move_as_their_vertices_do() {
        let mut model = triangle();
        model.copies = vec![2, 0];
        assert_eq!(model.fault(), None);
        assert_eq!(model.with_copies(&[10, 11, 12]), [10, 11, 12, 12, 10]);
        let weights = Weights::new(2, vec![0, 1, 2, 4], vec![0, 1, 0, 1], vec![1.0, 1.0, 0.25, 0.75]);
        let weights = weights.expect("they are weights");
        let outside = OutsideVertex { vertex: 2, corners: [0, 1, 0], offset: Vec3::X };
        let (all, outside) = model.moved_with_copies(&weights, &[outside]).expect("there are copies");
        for (row, source) in [0, 1, 2, 2, 0].into_iter().enumerate() {
            assert_eq!(all.row(row), weights.row(source));
        }
        let vertices: Vec<u32> = outside.iter().map(|o| o.vertex).collect();
        assert_eq!(vertices, [2, 3], "the first copy lies outside as its vertex does");
        assert!(triangle().moved_with_copies(&weights, &outside).is_none());
    }

    #[test]
    fn every_fault_is_named() {
        let faulty = |edit: fn(&mut DrawModel)| {
            let mut model = triangle();
            edit(&mut model);
            model.fault().expect("it is faulty")
        };
        assert!(faulty(|m| m.vertices[1].source = 3).contains("vertex 3"));
        assert!(faulty(|m| m.copies = vec![5]).contains("vertex 5"));
        assert!(faulty(|m| m.triangles[0][2] = 7).contains("corner 7"));
        let group = || DrawGroup { triangles: 0..1, ..DrawGroup::default() };
        assert_eq!(triangle().groups.len(), 0);
        let mut model = triangle();
        model.groups = vec![DrawGroup { triangles: 0..2, ..group() }];
        assert!(model.fault().is_some_and(|f| f.contains("0..2")));
        model.groups = vec![DrawGroup { texture: Some(0), ..group() }];
        assert!(model.fault().is_some_and(|f| f.contains("texture 0")));
        model.textures =
            vec![DrawTexture { width: 2, height: 2, rgba: vec![0; 15], ..DrawTexture::default() }];
        assert!(model.fault().is_some_and(|f| f.contains("2 x 2") && f.contains("15")));
    }
}
