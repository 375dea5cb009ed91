//! Normals that follow a deformation.
//!
//! The original normals of a model may be an artist's work (hard edges, weighted normals), so they are not thrown away:
//! area-weighted normals are computed before and after, and each original normal (and tangent) is turned by the rotation
//! between the two. At rest the result is the original; where the original was the area-weighted normal, it is the new
//! area-weighted normal. Vertices at one rest position whose normals agree are one surface there (a UV seam) and stay
//! smooth; where they differ there is a hard edge and it stays hard. Without normals, a smoothing group is one surface.

use cagework_core::mesh::weld;
use glam::{DVec3, Quat, Vec3};

/// Cosine of about 2.5 degrees: normals this close were one normal before rounding or quantisation to 8 bits.
const SAME_NORMAL: f32 = 0.999;
/// Different normals looked through at one position. A hundred thousand vertices at the origin must not take hours.
const MAX_CLUSTERS_AT_ONE_PLACE: usize = 64;

/// Vertices for shading: a model's vertex with one of the normals it has there.
pub(crate) struct Shading {
    /// Model vertex of each.
    pub(crate) vertex: Vec<u32>,
    /// Unit normal of each; area-weighted where the model has none.
    pub(crate) normal: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    cluster: Vec<u32>,
    rest: Vec<Vec3>,
}

impl Shading {
    /// For each shading vertex the surface it belongs to, counted from 0.
    pub(crate) fn clusters(&self) -> &[u32] {
        &self.cluster
    }

    /// `vertex`: model vertex of each shading vertex; `normal`: its original unit normal, zero where it has none;
    /// `surface`: what it belongs to if it has none, empty where that is not known; `triangles`: of shading vertices;
    /// `positions`: of model vertices, at rest.
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
                n.dot(m) >= SAME_NORMAL || (n == Vec3::ZERO && m == Vec3::ZERO && surface == other)
            };
            let found = here.iter().take(MAX_CLUSTERS_AT_ONE_PLACE).find(same).map(|&(c, ..)| c);
            cluster.push(found.unwrap_or_else(|| {
                here.push((n_clusters, n, surface));
                n_clusters += 1;
                n_clusters - 1
            }));
        }
        let mut shading = Self { vertex, normal: Vec::new(), triangles, cluster, rest: Vec::new() };
        shading.rest = shading.area_weighted(positions, n_clusters as usize);
        for (n, &c) in normal.iter_mut().zip(&shading.cluster) {
            if *n == Vec3::ZERO {
                *n = shading.rest[c as usize];
            }
            if *n == Vec3::ZERO {
                // No face and no normal: any unit vector is as good, and formats demand one.
                *n = Vec3::Z;
            }
        }
        shading.normal = normal;
        shading
    }

    /// Rotation of each shading vertex between the rest shape and `positions`.
    pub(crate) fn rotations(&self, positions: &[Vec3]) -> Vec<Quat> {
        let now = self.area_weighted(positions, self.rest.len());
        let turns: Vec<Quat> = self
            .rest
            .iter()
            .zip(&now)
            .map(|(&a, &b)| {
                let none = a == b || a == Vec3::ZERO || b == Vec3::ZERO;
                if none { Quat::IDENTITY } else { Quat::from_rotation_arc(a, b) }
            })
            .collect();
        self.cluster.iter().map(|&c| turns[c as usize]).collect()
    }

    /// Normal of each shading vertex on the deformed shape.
    pub(crate) fn normals(&self, rotations: &[Quat]) -> Vec<Vec3> {
        rotations.iter().zip(&self.normal).map(|(&q, &n)| (q * n).normalize_or(n)).collect()
    }

    /// Unit normal of each cluster; zero where no face has an area. In f64: squares of kilometres in millimetres.
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
