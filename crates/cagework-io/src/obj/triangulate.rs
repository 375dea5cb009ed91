//! Splits polygons into triangles.

use earcut::Earcut;
use glam::{DVec3, Vec3};

/// Limit on the sum of squared corner counts of all ear-clipped polygons, so the largest one has 16,384 corners. Ear
/// clipping takes quadratic time at worst: a polygon of 60,000 corners, far above this limit, took 5 s.
const MAX_CLIP_WORK: u64 = 1 << 28;

/// Triangulates polygons in sequence, with reused buffers.
pub(crate) struct Triangulator {
    earcut: Earcut<f64>,
    flat: Vec<[f64; 2]>,
    corners: Vec<u32>,
    /// Remaining share of [`MAX_CLIP_WORK`].
    left: u64,
    /// Number of concave polygons that were split into fans because [`MAX_CLIP_WORK`] was used up.
    pub(crate) fans: usize,
}

impl Triangulator {
    pub(crate) fn new() -> Self {
        Self { earcut: Earcut::new(), flat: Vec::new(), corners: Vec::new(), left: MAX_CLIP_WORK, fans: 0 }
    }

    /// Appends the n - 2 triangles of `polygon` as `base` + corner numbers. `polygon`: corner positions in order.
    ///
    /// The triangles form a fan if all triangles of the fan face along the polygon's normal; otherwise ears are clipped
    /// in the mean plane. Degenerate and self-intersecting polygons, and polygons beyond the work limit, are split into
    /// fans.
    pub(crate) fn triangulate(&mut self, polygon: &[Vec3], base: u32, out: &mut Vec<[u32; 3]>) {
        let n = polygon.len() as u32;
        if n < 3 {
            return;
        }
        let p: Vec<DVec3> = polygon.iter().map(|p| p.as_dvec3()).collect();
        let normal = newell_normal(&p);
        let fan_is_right = (2..p.len()).all(|k| (p[k - 1] - p[0]).cross(p[k] - p[0]).dot(normal) > 0.0);
        if !fan_is_right
            && self.may_clip(p.len() as u64)
            && let Some(normal) = normal.try_normalize()
            && self.clip_ears(&p, normal)
        {
            out.extend(self.corners.chunks_exact(3).map(|t| [base + t[0], base + t[1], base + t[2]]));
            return;
        }
        out.extend((2..n).map(|k| [base, base + k - 1, base + k]));
    }

    /// Reserves the work of clipping a polygon of `n` corners. Returns false if less work is left.
    fn may_clip(&mut self, n: u64) -> bool {
        let left = self.left.checked_sub(n * n);
        self.fans += usize::from(left.is_none());
        self.left = left.unwrap_or(self.left);
        left.is_some()
    }

    /// Clips ears in the plane with the given normal. Returns false if the triangles do not cover the polygon.
    fn clip_ears(&mut self, p: &[DVec3], normal: DVec3) -> bool {
        let (u, v) = normal.any_orthonormal_pair();
        self.flat.clear();
        self.flat.extend(p.iter().map(|&q| [(q - p[0]).dot(u), (q - p[0]).dot(v)]));
        self.earcut.earcut_slice::<u32>(&self.flat, &[], &mut self.corners);
        if self.corners.len() != 3 * (p.len() - 2) {
            return false;
        }
        // `earcut` does not guarantee the orientation of its triangles: orient each like the polygon.
        for t in self.corners.chunks_exact_mut(3) {
            let [a, b, c] = [p[t[0] as usize], p[t[1] as usize], p[t[2] as usize]];
            if (b - a).cross(c - a).dot(normal) < 0.0 {
                t.swap(1, 2);
            }
        }
        true
    }
}

/// Computes Newell's normal: twice the area vector of the polygon, also for concave polygons.
fn newell_normal(p: &[DVec3]) -> DVec3 {
    let origin = p[0];
    p.iter().zip(p.iter().cycle().skip(1)).map(|(&a, &b)| (a - origin).cross(b - origin)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(polygon: &[Vec3]) -> (usize, f32) {
        let mut out = Vec::new();
        Triangulator::new().triangulate(polygon, 0, &mut out);
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| polygon[i as usize]);
            0.5 * (b - a).cross(c - a).z
        };
        assert!(out.iter().all(|t| area(t) >= 0.0));
        (out.len(), out.iter().map(area).sum())
    }

    #[test]
    fn concave_polygons_are_covered_once() {
        let arrow = [(0., 0.), (2., 1.), (0., 2.), (1., 1.)].map(|(x, y)| Vec3::new(x, y, 0.5));
        assert_eq!(area(&arrow), (2, 1.0));
        let l =
            [(0., 2.), (0., 0.), (2., 0.), (2., 1.), (1., 1.), (1., 2.)].map(|(x, y)| Vec3::new(x, y, 0.));
        assert_eq!(area(&l), (4, 3.0));
    }

    #[test]
    fn degenerate_polygons_keep_their_triangle_count() {
        assert_eq!(area(&[Vec3::ONE; 5]).0, 3);
        assert_eq!(area(&[Vec3::ZERO, Vec3::X, 2.0 * Vec3::X, 3.0 * Vec3::X]).0, 2);
    }
}
