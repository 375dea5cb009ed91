//! Smooth surfaces of vertices with normals.
//!
//! Vertices at the same rest position belong to one smooth surface if their normals agree (a UV seam);
//! otherwise a hard edge separates them. Without normals, smoothing groups define the surfaces.

use cagework_core::mesh::weld;
use glam::{DVec3, Vec3};

/// Cosine of 2.5 degrees. Normals at a smaller angle differ only by rounding or by 8-bit quantisation.
const MIN_SAME_NORMAL_COS: f32 = 0.999;
/// Limit on normals compared per position. Without it, n vertices at one point cost O(n²).
const MAX_CLUSTERS_AT_ONE_PLACE: usize = 64;

/// Shading vertices: distinct (model vertex, normal) pairs.
pub(crate) struct Shading {
    /// Model vertex of each shading vertex.
    pub(crate) vertex: Vec<u32>,
    /// Unit normal of each shading vertex; area-weighted if the model has no normals.
    pub(crate) normal: Vec<Vec3>,
    /// Indices of shading vertices.
    pub(crate) triangles: Vec<[u32; 3]>,
    cluster: Vec<u32>,
}

impl Shading {
    /// For each shading vertex, the number of its smooth surface, from 0.
    pub(crate) fn clusters(&self) -> &[u32] {
        &self.cluster
    }

    /// Groups shading vertices into smooth surfaces.
    ///
    /// `positions`: model vertices at rest. `vertex`: model vertex of each shading vertex. `normal`: original unit
    /// normal of each shading vertex, zero if the vertex has no normal. `surface`: smooth surface of a shading vertex
    /// without normal; may be empty. `triangles`: indices of shading vertices.
    pub(crate) fn new(
        positions: &[Vec3],
        vertex: Vec<u32>,
        mut normal: Vec<Vec3>,
        surface: &[u32],
        triangles: Vec<[u32; 3]>,
    ) -> Self {
        let welded = weld(positions);
        let mut at_place: Vec<Vec<(u32, Vec3, u32)>> = vec![Vec::new(); welded.first.len()];
        let mut n_clusters = 0;
        let mut cluster = Vec::with_capacity(vertex.len());
        for (k, (&v, &n)) in vertex.iter().zip(&normal).enumerate() {
            let surface = surface.get(k).copied().unwrap_or(0);
            let here = &mut at_place[welded.unique_of[v as usize] as usize];
            let same = |&&(_, m, other): &&(u32, Vec3, u32)| {
                n.dot(m) >= MIN_SAME_NORMAL_COS || (n == Vec3::ZERO && m == Vec3::ZERO && surface == other)
            };
            let found = here.iter().take(MAX_CLUSTERS_AT_ONE_PLACE).find(same).map(|&(c, ..)| c);
            cluster.push(found.unwrap_or_else(|| {
                here.push((n_clusters, n, surface));
                n_clusters += 1;
                n_clusters - 1
            }));
        }
        let mut shading = Self { vertex, normal: Vec::new(), triangles, cluster };
        let smooth = shading.area_weighted(positions, n_clusters as usize);
        for (n, &c) in normal.iter_mut().zip(&shading.cluster) {
            if *n == Vec3::ZERO {
                *n = smooth[c as usize];
            }
            if *n == Vec3::ZERO {
                // The vertex has neither a normal nor a face with area. Formats require a unit vector, so use any.
                *n = Vec3::Z;
            }
        }
        shading.normal = normal;
        shading
    }

    /// Computes the unit normal of each cluster, zero for clusters without area. Sums in f64: areas of kilometre-sized
    /// models in millimetres exceed the precision of f32.
    fn area_weighted(&self, positions: &[Vec3], n_clusters: usize) -> Vec<Vec3> {
        let mut sum = vec![DVec3::ZERO; n_clusters];
        for t in &self.triangles {
            let [a, b, c] = t.map(|s| positions[self.vertex[s as usize] as usize].as_dvec3());
            let area = (b - a).cross(c - a);
            for &s in t {
                sum[self.cluster[s as usize] as usize] += area;
            }
        }
        sum.into_iter().map(|n| n.normalize_or_zero().as_vec3()).collect()
    }
}
