//! A drawable model: corners with texture coordinates and colours, material groups, decoded textures.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use cagework_core::Weights;
use cagework_core::splats::Splats;
use glam::Vec3;

/// Default base colour, linear: light, slightly warm grey.
pub const CLAY: [f32; 4] = [0.52, 0.505, 0.485, 1.0];

/// Base colours of models without materials that are drawn together, linear. All have about the same lightness. None is
/// blue, the colour of the cage's lines and of painted vertices. The first is [`CLAY`].
const TINTS: [[f32; 4]; 6] = [
    CLAY,
    [0.217, 0.528, 0.523, 1.0],
    [0.577, 0.427, 0.242, 1.0],
    [0.358, 0.502, 0.317, 1.0],
    [0.654, 0.376, 0.388, 1.0],
    [0.575, 0.387, 0.524, 1.0],
];

/// A drawable model.
///
/// Vertices (`positions`) are bound and deformed, corners (`vertices`) are drawn. Vertices and corners differ because
/// an OBJ vertex can have several texture coordinates, and seams of a glTF must not show in the shading.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DrawModel {
    /// Rest positions of the vertices. `[n_vertices]`, object units.
    pub positions: Vec<Vec3>,
    /// Duplicated vertices with normals of their own, for hard edges of an OBJ. Each entry is the vertex whose position
    /// the duplicate takes. Duplicates are numbered after `positions`. `[n_copies]`
    pub copies: Vec<u32>,
    /// Corners of the triangles, which `triangles` indexes. `[n_corners]`
    pub vertices: Vec<DrawVertex>,
    /// Indices into `vertices`, counter-clockwise seen from outside. `[n_triangles]`
    pub triangles: Vec<[u32; 3]>,
    /// Materials of ranges of triangles. The other triangles have the base colour [`CLAY`].
    pub groups: Vec<DrawGroup>,
    /// Textures, to which [`DrawGroup::texture`] refers by index.
    pub textures: Vec<Arc<DrawTexture>>,
    /// Splats, drawn instead of the triangles, which then only fill the depth buffer.
    pub splats: Option<Arc<Splats>>,
}

/// A corner of a triangle.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct DrawVertex {
    /// Index into `positions` followed by `copies`: determines position and normal.
    pub source: u32,
    /// Texture coordinates, v downwards as in glTF.
    pub uv: [f32; 2],
    /// Factor of the base colour, linear RGBA; 65,535 is 1.
    pub color: [u16; 4],
}

/// A range of triangles with one material.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawGroup {
    /// Range of indices into [`DrawModel::triangles`].
    pub triangles: std::ops::Range<u32>,
    /// Base colour factor, linear RGBA.
    pub base_color: [f32; 4],
    /// Base colour texture, an index into [`DrawModel::textures`].
    pub texture: Option<u32>,
    /// How the material's alpha is used.
    pub alpha: Alpha,
}

/// How a material's alpha is used.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Alpha {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// Fragments with less alpha than the cutoff are discarded.
    Mask {
        /// Alpha cutoff, 0 to 1.
        cutoff: f32,
    },
    /// Fragments are blended with the colour behind them.
    Blend,
}

/// Texture sampling outside the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The image is repeated.
    #[default]
    Repeat,
    /// The image is repeated, mirrored every other time.
    Mirror,
    /// The colour at the image's edge continues outside the image.
    Clamp,
}

/// A decoded image.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DrawTexture {
    /// Number of pixels in a row.
    pub width: u32,
    /// Number of rows of pixels.
    pub height: u32,
    /// sRGB with straight alpha, rows from the top. `[height, width, 4]`
    pub rgba: Vec<u8>,
    /// Wrapping along u and v.
    pub wrap: [Wrap; 2],
}

impl DrawVertex {
    /// A corner without texture coordinates and colour.
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
    /// A model without materials.
    #[must_use]
    pub fn plain(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Self {
        let vertices = (0..positions.len() as u32).map(DrawVertex::plain).collect();
        Self { positions, vertices, triangles, ..Self::default() }
    }

    /// Concatenates models: vertices, copies, corners and triangles in order. Textures are not duplicated. Triangles
    /// without a material get a colour per model.
    #[must_use]
    pub fn joined(models: &[&Self]) -> Self {
        let n_vertices: usize = models.iter().map(|m| m.positions.len()).sum();
        let mut all = Self::default();
        for (model, tint) in models.iter().zip(TINTS.iter().cycle()) {
            let first = all.positions.len() as u32;
            let own = model.positions.len() as u32;
            // Copies are numbered after the vertices of all models.
            let first_copy = (n_vertices + all.copies.len()) as u32;
            let source = |s: u32| if s < own { first + s } else { first_copy + s - own };
            let (corner, triangle) = (all.vertices.len() as u32, all.triangles.len() as u32);
            let texture = all.textures.len() as u32;
            all.positions.extend(&model.positions);
            all.copies.extend(model.copies.iter().map(|v| first + v));
            all.vertices.extend(model.vertices.iter().map(|v| DrawVertex { source: source(v.source), ..*v }));
            all.triangles.extend(model.triangles.iter().map(|t| t.map(|c| corner + c)));
            all.textures.extend(model.textures.iter().cloned());
            all.splats = all.splats.or_else(|| model.splats.clone());
            // Triangles without a group get one, so that no group spans two models.
            all.groups.extend(model.whole_groups(*tint).into_iter().map(|group| DrawGroup {
                triangles: triangle + group.triangles.start..triangle + group.triangles.end,
                texture: group.texture.map(|t| texture + t),
                ..group
            }));
        }
        all
    }

    /// The groups, and further groups with `base_color` for the triangles that belong to no group.
    pub(super) fn whole_groups(&self, base_color: [f32; 4]) -> Vec<DrawGroup> {
        let gap = |triangles| DrawGroup { triangles, base_color, ..DrawGroup::default() };
        // Sort pairs of numbers. Sorting another type would add an instance of `sort_unstable` to the page's module.
        let mut order: Vec<[u32; 2]> =
            (0u32..).zip(&self.groups).map(|(k, g)| [g.triangles.start, k]).collect();
        order.sort_unstable();
        let mut groups: Vec<DrawGroup> =
            order.iter().map(|[_, k]| self.groups[*k as usize].clone()).collect();
        let mut gaps = Vec::new();
        let mut covered = 0;
        for group in &groups {
            if group.triangles.start > covered {
                gaps.push(gap(covered..group.triangles.start));
            }
            covered = covered.max(group.triangles.end);
        }
        let n = self.triangles.len() as u32;
        if covered < n {
            gaps.push(gap(covered..n));
        }
        groups.extend(gaps);
        groups
    }

    /// Appends the values of the copies. `[n_vertices]` -> `[n_vertices + n_copies]`
    #[must_use]
    pub(crate) fn with_copies<T: Copy>(&self, values: &[T]) -> Vec<T> {
        values.iter().copied().chain(self.copies.iter().map(|&v| values[v as usize])).collect()
    }

    /// Weights with rows for the copies. `None` without copies.
    pub(crate) fn rows_with_copies(&self, weights: &Weights) -> Option<Weights> {
        let rows = || (0..self.positions.len() as u32).chain(self.copies.iter().copied()).collect::<Vec<_>>();
        (!self.copies.is_empty()).then(|| weights.with_rows(&rows()))
    }

    /// Triangles as indices into `positions` followed by `copies`, for computing normals. `[n_triangles]`
    #[must_use]
    pub fn shading_triangles(&self) -> Vec<[u32; 3]> {
        let source = |corner: u32| self.vertices[corner as usize].source;
        self.triangles.iter().map(|t| t.map(source)).collect()
    }

    /// Describes the first inconsistency of the lists.
    pub(crate) fn fault(&self) -> Option<String> {
        let (n_vertices, n_corners) = (self.positions.len(), self.vertices.len());
        if let Some(v) = self.copies.iter().find(|&&v| v as usize >= n_vertices) {
            return Some(format!("a copy refers to vertex {v}; number of vertices: {n_vertices}"));
        }
        let n_sources = n_vertices + self.copies.len();
        if let Some(v) = self.vertices.iter().find(|v| v.source as usize >= n_sources) {
            return Some(format!(
                "a corner refers to vertex {}; number of vertices and copies: {n_sources}",
                v.source
            ));
        }
        if let Some(i) = self.triangles.iter().flatten().find(|&&i| i as usize >= n_corners) {
            return Some(format!("a triangle refers to corner {i}; number of corners: {n_corners}"));
        }
        for group in &self.groups {
            let range = &group.triangles;
            if range.start > range.end || range.end as usize > self.triangles.len() {
                return Some(format!(
                    "a material covers triangles {range:?}; number of triangles: {}",
                    self.triangles.len()
                ));
            }
            if let Some(t) = group.texture.filter(|&t| t as usize >= self.textures.len()) {
                return Some(format!(
                    "a material refers to texture {t}; number of textures: {}",
                    self.textures.len()
                ));
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
    fn copies_have_the_weights_of_their_vertices() {
        let mut model = triangle();
        model.copies = vec![2, 0];
        assert_eq!(model.fault(), None);
        assert_eq!(model.with_copies(&[10, 11, 12]), [10, 11, 12, 12, 10]);
        let weights = Weights::new(2, vec![0, 1, 2, 4], vec![0, 1, 0, 1], vec![1.0, 1.0, 0.25, 0.75]);
        let weights = weights.expect("the weights are valid");
        let all = model.rows_with_copies(&weights).expect("there are copies");
        for (row, source) in [0, 1, 2, 2, 0].into_iter().enumerate() {
            assert_eq!(all.row(row), weights.row(source));
        }
        assert!(triangle().rows_with_copies(&weights).is_none());
    }

    #[test]
    fn triangles_without_group_get_the_default_material() {
        let mut model = DrawModel::plain(vec![Vec3::ZERO; 3], vec![[0, 1, 2]; 10]);
        let group = |range| DrawGroup { triangles: range, base_color: [1.0; 4], ..DrawGroup::default() };
        model.groups = vec![group(6..8), group(1..4)];
        let mut all = model.whole_groups(CLAY);
        all.sort_by_key(|g| g.triangles.start);
        let ranges: Vec<_> = all.iter().map(|g| (g.triangles.clone(), g.base_color == CLAY)).collect();
        assert_eq!(ranges, [(0..1, true), (1..4, false), (4..6, true), (6..8, false), (8..10, true)]);
    }

    /// Joins a model of two triangles with a hard edge (two copies) and, twice, a model of one triangle with one copy
    /// and a texture.
    #[test]
    fn joined_models_keep_their_corners_copies_and_textures() {
        let mut first = DrawModel::plain(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2], [2, 1, 0]]);
        first.copies = vec![0, 2];
        first.vertices.extend([3, 4].map(DrawVertex::plain));
        let mut second = triangle();
        second.copies = vec![1];
        second.vertices.push(DrawVertex::plain(3));
        let texture = DrawTexture { width: 1, height: 1, rgba: vec![9; 4], ..DrawTexture::default() };
        second.textures = vec![texture.into()];
        second.groups = vec![DrawGroup { triangles: 0..1, texture: Some(0), ..DrawGroup::default() }];
        let all = DrawModel::joined(&[&first, &second, &second]);
        assert_eq!(all.fault(), None);
        assert_eq!(all.copies, [0, 2, 4, 7]);
        let sources: Vec<u32> = all.vertices.iter().map(|v| v.source).collect();
        // Sources 0 to 8 are vertices, 9 to 12 are copies: two of the first model, and one of each of the other two.
        assert_eq!(sources, [0, 1, 2, 9, 10, 3, 4, 5, 11, 6, 7, 8, 12]);
        assert_eq!(all.triangles[2..], [[5, 6, 7], [9, 10, 11]]);
        let groups: Vec<_> = all.groups.iter().map(|g| (g.triangles.clone(), g.texture)).collect();
        assert_eq!(groups, [(0..2, None), (2..3, Some(0)), (3..4, Some(1))]);
    }

    #[test]
    fn models_without_materials_get_different_colours_together() {
        let plain = triangle();
        let with_material = DrawModel {
            groups: vec![DrawGroup { triangles: 0..1, base_color: [1.0; 4], ..DrawGroup::default() }],
            ..triangle()
        };
        let all = DrawModel::joined(&[&plain, &plain, &with_material, &plain]);
        let colors: Vec<_> = all.groups.iter().map(|g| g.base_color).collect();
        assert_eq!(colors, [TINTS[0], TINTS[1], [1.0; 4], TINTS[3]]);
        assert!((1..TINTS.len()).all(|k| !TINTS[..k].contains(&TINTS[k])));
    }

    #[test]
    fn faults_name_the_invalid_index() {
        let faulty = |edit: fn(&mut DrawModel)| {
            let mut model = triangle();
            edit(&mut model);
            model.fault().expect("the model has a fault")
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
            vec![DrawTexture { width: 2, height: 2, rgba: vec![0; 15], ..DrawTexture::default() }.into()];
        assert!(model.fault().is_some_and(|f| f.contains("2 x 2") && f.contains("15")));
    }
}
