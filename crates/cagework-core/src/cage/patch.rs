//! A bent face as a patch: the planar coordinates of the face's outline, applied to its corners in space.
//!
//! Over each point of the face's best-fitting plane, the patch is `sum hat_k c_k`, where `hat_k` are the planar
//! coordinates of the projected outline and `c_k` the corners in space. Values on a face therefore depend continuously
//! on its corners, whether flat or bent. The patch over a parallelogram is bilinear. Each patch is cut into *facets* along
//! rings around its centre, on which points and values are linear. The sides of the face are not divided, so that
//! neighbouring faces meet without gaps.

use glam::DVec2;

/// Scales of the rings inside the outline. The sides of the rings are halved. No facet is further from a bilinear patch
/// than 1.8 % of the distance of the patch's fourth corner from the plane of the other three. Between rings at the
/// relative distances a and b from the centre, the error of facets is `a (a - b) / 16` of that distance; at the outline
/// it is 1/64.
const RINGS: [f64; 2] = [0.75, 0.375];

pub(super) struct Facets {
    /// Positions of the inner points in the plane of the face.
    pub(super) inner: Vec<DVec2>,
    /// Triangles, as indices of the face's corners, then of the inner points.
    pub(super) facets: Vec<[u32; 3]>,
}

/// Cuts a strictly convex counter-clockwise polygon into facets along [`RINGS`].
pub(super) fn rings(outline: &[DVec2]) -> Facets {
    let n = outline.len();
    let middle = outline.iter().sum::<DVec2>() / n as f64;
    let mut inner = Vec::new();
    for size in RINGS {
        for k in 0..n {
            let (corner, next) = (outline[k], outline[(k + 1) % n]);
            inner.extend([corner, 0.5 * (corner + next)].map(|p| middle + size * (p - middle)));
        }
    }
    inner.push(middle);
    // A ring has its corners at even places and the midpoints of its sides at odd ones.
    let ring = |r: usize, place: usize| (n + 2 * n * r + place % (2 * n)) as u32;
    let last = (n + 2 * n * RINGS.len()) as u32;
    let mut facets = Vec::new();
    for k in 0..n {
        let (corner, next) = (k as u32, ((k + 1) % n) as u32);
        let side = [2 * k, 2 * k + 1, 2 * k + 2].map(|place| ring(0, place));
        facets.extend([[corner, next, side[1]], [corner, side[1], side[0]], [next, side[2], side[1]]]);
        for place in [2 * k, 2 * k + 1] {
            for r in 1..RINGS.len() {
                let [a, b] = [ring(r - 1, place), ring(r - 1, place + 1)];
                let [c, d] = [ring(r, place), ring(r, place + 1)];
                facets.extend([[a, b, d], [a, d, c]]);
            }
            facets.push([ring(RINGS.len() - 1, place), ring(RINGS.len() - 1, place + 1), last]);
        }
    }
    Facets { inner, facets }
}

/// Cuts a simple polygon, triangulated by `triangles`, into facets. Each triangle becomes a fan around its
/// centroid; the diagonals of the polygon are halved.
pub(super) fn fans(outline: &[DVec2], triangles: &[[u32; 3]]) -> Facets {
    let n = outline.len() as u32;
    let (mut inner, mut facets) = (Vec::new(), Vec::new());
    let mut halved: Vec<([u32; 2], u32)> = Vec::new();
    for triangle in triangles {
        let corners = triangle.map(|k| outline[k as usize]);
        let mut rim = Vec::new();
        for k in 0..3 {
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            rim.push(a);
            if (a + 1) % n == b {
                continue;
            }
            let ends = [a.min(b), a.max(b)];
            let half = halved.iter().find(|(known, _)| *known == ends).map(|&(_, half)| half);
            rim.push(half.unwrap_or_else(|| {
                let half = n + inner.len() as u32;
                inner.push(0.5 * (corners[k] + corners[(k + 1) % 3]));
                halved.push((ends, half));
                half
            }));
        }
        let middle = n + inner.len() as u32;
        inner.push(corners.iter().sum::<DVec2>() / 3.0);
        facets.extend((0..rim.len()).map(|k| [rim[k], rim[(k + 1) % rim.len()], middle]));
    }
    Facets { inner, facets }
}
