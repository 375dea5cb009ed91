//! A bent face as a patch: its planar coordinates, lifted to its corners.
//!
//! Over each point of the plane that fits the face best, the patch lies where the planar coordinates of the face's outline
//! put it: `sum hat_k c_k`. So values on a face depend continuously on its corners, from flat to bent, and reproduce the
//! patch; over a parallelogram it is the bilinear patch. It is cut into *facets* along rings around its middle. Sides stay
//! whole, so that neighbours of any kind meet it without gaps.

use glam::DVec2;

/// Sizes of the rings within the outline, in which sides are halved: no facet is further from a bilinear patch than 1.8 %
/// of how far its fourth corner is off the plane of the other three. Between rings at the distances a and b from the middle
/// (of half a side) facets are off by `a (a - b) / 16` of that, at the outline by 1/64.
const RINGS: [f64; 2] = [0.75, 0.375];

/// The points of a patch inside its outline, and its facets.
pub(super) struct Facets {
    /// In the plane.
    pub(super) inner: Vec<DVec2>,
    /// Corners of the face, then inner points.
    pub(super) facets: Vec<[u32; 3]>,
}

/// Cuts a strictly convex polygon, counter-clockwise.
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
    // Ring r has its corners at even places, the middles of its sides at odd ones.
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

/// Cuts a simple polygon of which `triangles` are given: each into a fan around its middle, with its diagonals halved.
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
