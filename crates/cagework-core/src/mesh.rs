//! Meshes as plain arrays, bounding boxes, and welding of vertices.

use glam::Vec3;
use rustc_hash::{FxBuildHasher, FxHashMap};
use serde::{Deserialize, Serialize};

/// Axis-aligned bounding box, in object units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct Bounds {
    /// Corner with the smallest coordinates.
    #[cfg_attr(feature = "typescript", ts(type = "[number, number, number]"))]
    pub min: Vec3,
    /// Corner with the largest coordinates.
    #[cfg_attr(feature = "typescript", ts(type = "[number, number, number]"))]
    pub max: Vec3,
}

impl Bounds {
    /// Computes the bounds of `points`; `None` if there are no points.
    #[must_use]
    pub fn around(points: &[Vec3]) -> Option<Self> {
        let first = *points.first()?;
        Some(
            points
                .iter()
                .fold(Self { min: first, max: first }, |b, &p| Self { min: b.min.min(p), max: b.max.max(p) }),
        )
    }

    /// Edge lengths of the box.
    #[must_use]
    pub fn extent(&self) -> Vec3 {
        self.max - self.min
    }

    /// Centre of the box.
    #[must_use]
    pub fn center(&self) -> Vec3 {
        self.min + 0.5 * self.extent()
    }

    /// Length of the diagonal: the unit of relative errors in reports.
    #[must_use]
    pub fn diagonal(&self) -> f32 {
        self.extent().length()
    }
}

/// Triangle mesh: `positions` `[n_vertices, 3]` in object units, `triangles` `[n_triangles, 3]` counter-clockwise seen
/// from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriMesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Vertex indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
}

/// Polygon mesh whose faces may have any number of corners. [`crate::Cage`] is made from it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PolygonMesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Vertex indices of each face, in order around it.
    pub faces: Vec<Vec<u32>>,
}

impl PolygonMesh {
    /// Diagonal of the box of all finite vertices that faces use, object units. It equals the cage's diagonal, and also
    /// exists for invalid meshes.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        let used = self.faces.iter().flatten().filter_map(|&i| self.positions.get(i as usize));
        let finite: Vec<Vec3> = used.copied().filter(|p| p.is_finite()).collect();
        Bounds::around(&finite).map_or(0.0, |b| b.max.as_dvec3().distance(b.min.as_dvec3()))
    }
}

/// Groups of vertices that share a position. A vertex that is split at a UV or normal seam is thus bound once.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Weld {
    /// First input vertex of each distinct position. `[n_unique]`
    pub first: Vec<u32>,
    /// Index of the distinct position of each input vertex. `[n_vertices]`
    pub unique_of: Vec<u32>,
}

/// Welds vertices with equal positions (`-0` equals `0`), in order of first occurrence.
#[must_use]
pub fn weld(positions: &[Vec3]) -> Weld {
    let mut seen: FxHashMap<[u32; 3], u32> =
        FxHashMap::with_capacity_and_hasher(positions.len(), FxBuildHasher);
    let mut welded = Weld { first: Vec::new(), unique_of: Vec::with_capacity(positions.len()) };
    for (v, p) in positions.iter().enumerate() {
        // Adding zero turns -0 into +0, so that equal positions have equal bits.
        let key = (*p + Vec3::ZERO).to_array().map(f32::to_bits);
        let unique = *seen.entry(key).or_insert_with(|| {
            welded.first.push(v as u32);
            welded.first.len() as u32 - 1
        });
        welded.unique_of.push(unique);
    }
    welded
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_positions_are_welded_in_order_of_first_occurrence() {
        let (a, b) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.0, -1.0, 0.0));
        let same_as_b = Vec3::new(-0.0, -1.0, -0.0);
        let next_to_a = Vec3::new(1.0f32.next_up(), 2.0, 3.0);
        let welded = weld(&[a, b, a, same_as_b, next_to_a, a]);
        assert_eq!(welded.first, [0, 1, 4]);
        assert_eq!(welded.unique_of, [0, 1, 0, 1, 2, 0]);
    }

    #[test]
    fn empty_input_welds_to_an_empty_result() {
        assert_eq!(weld(&[]), Weld::default());
    }

    #[test]
    fn bounds_hold_all_points() {
        let bounds = Bounds::around(&[Vec3::new(1.0, -2.0, 3.0), Vec3::new(-1.0, 0.0, 1.0)]).unwrap();
        assert_eq!((bounds.min, bounds.max), (Vec3::new(-1.0, -2.0, 1.0), Vec3::new(1.0, 0.0, 3.0)));
        assert_eq!((bounds.extent(), bounds.center()), (Vec3::splat(2.0), Vec3::new(0.0, -1.0, 2.0)));
        assert_eq!(Bounds::around(&[]), None);
    }
}
