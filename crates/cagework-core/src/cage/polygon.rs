//! A face as a polygon in its plane: which hats it carries and how it is cut into triangles.

use glam::{DVec2, DVec3};

use super::defects::{FaceDefect, MAX_CORNERS};
use super::hats;
use super::patch::{self, Facets};
use super::triangulate::{cross, ear_clip};

/// A face lower than this fraction of the cage's diagonal has no area: it is lost in the rounding of f32 coordinates
/// (6e-8 relative).
pub(super) const FLAT_HEIGHT: f64 = 1e-7;

/// A polygon is planar if its corners are within this fraction of the cage's diagonal of its plane. Six decimals of
/// an OBJ file move the corners of a model of unit size by so much, and the rest pose can be off by no more.
pub(super) const PLANAR: f64 = 2e-6;

/// Smallest sine of the turn at a corner of an outline that is cut as a convex one.
const MIN_TURN: f64 = 1e-3;

/// Quads whose smallest turn has at least this sine (14 degrees) have Meyer's coordinates alone. At a straight corner Meyer's
/// hat vanishes, so below it they are blended with pseudo-harmonic ones, which the quad has when the corner is straight.
const MEYER_TURN: f64 = 0.25;

/// Smaller shares of Meyer's coordinates are set to 0: at a straight corner their quotient is 0 / 0.
const MIN_SHARE: f64 = 1e-6;

/// A face in its plane.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Polygon {
    /// Corners in the plane, counter-clockwise seen from outside, then the patch's inner points; empty if hats are linear
    /// on each facet.
    pub(super) outline: Vec<DVec2>,
    /// Share of Meyer's coordinates in the hats; the rest is pseudo-harmonic coordinates. 0 unless the face is a quad.
    meyer: f64,
    /// Triangles that cover the face, as corners of it, turned like it.
    pub(super) triangles: Vec<[u32; 3]>,
    /// The surface on which hats are prescribed: the triangles, or those of a patch, as corners and inner points.
    pub(super) facets: Vec<[u32; 3]>,
    /// The hats of the patch's inner points. `[n_inner][n_corners]`
    pub(super) inner: Vec<Vec<f64>>,
}

impl Polygon {
    /// Measures a face with three corners or more; `diagonal` of the cage.
    pub(super) fn new(corners: &[DVec3], diagonal: f64) -> Result<Self, FaceDefect> {
        let n = corners.len();
        if n > MAX_CORNERS {
            return Err(FaceDefect::TooManyCorners { corners: n });
        }
        let center = corners.iter().sum::<DVec3>() / n as f64;
        let arms: Vec<DVec3> = corners.iter().map(|&p| p - center).collect();
        // Newell's normal: its length is twice the area of the projection that has the largest one.
        let normal: DVec3 = (0..n).map(|k| arms[k].cross(arms[(k + 1) % n])).sum();
        let extent = 2.0 * arms.iter().map(|p| p.length()).fold(0.0, f64::max);
        if normal.length() <= FLAT_HEIGHT * diagonal * extent {
            return Err(FaceDefect::NoArea);
        }
        if n == 3 {
            return Ok(Self::linear(vec![[0, 1, 2]]));
        }
        let normal = normal.normalize();
        let outline = project(&arms, normal);
        let height = arms.iter().map(|p| p.dot(normal).abs()).fold(0.0, f64::max);
        let (is_bent, is_convex) = (height > PLANAR * diagonal, is_convex(&outline));
        let crosses = !is_convex && crosses_itself(&outline);
        if crosses && !is_bent {
            return Err(FaceDefect::CrossesItself);
        }
        let triangles = match n {
            4 if is_bent => split_quad(&arms, normal),
            _ if is_convex && !is_bent => (2..n as u32).map(|k| [0, k - 1, k]).collect(),
            _ => ear_clip(&outline)?,
        };
        if crosses {
            return Ok(Self::linear(triangles));
        }
        let Facets { inner: points, facets } = match (is_bent, is_convex) {
            (false, _) => Facets { inner: Vec::new(), facets: triangles.clone() },
            (true, true) => patch::rings(&outline),
            (true, false) => patch::fans(&outline, &triangles),
        };
        let meyer = if n == 4 { meyer_share(&outline) } else { 0.0 };
        let mut polygon = Self { outline, meyer, triangles, facets, inner: Vec::new() };
        for &point in &points {
            let mut hats = vec![0.0; n];
            polygon.values(point, &mut hats);
            polygon.inner.push(hats);
        }
        polygon.outline.extend(points);
        Ok(polygon)
    }

    fn linear(triangles: Vec<[u32; 3]>) -> Self {
        let facets = triangles.clone();
        Self { outline: Vec::new(), meyer: 0.0, facets, triangles, inner: Vec::new() }
    }

    /// Values of the corners' hats at a point of the plane, not negative. `values`: `[n_corners]`, zeros.
    pub(super) fn values(&self, point: DVec2, values: &mut [f64]) {
        let outline = &self.outline[..values.len()];
        if self.meyer < 1.0 {
            hats::pseudo_harmonic(outline, point, values);
        }
        if self.meyer > 0.0 {
            let (mut meyer, mut areas) = ([0.0; 4], [0.0; 4]);
            hats::wachspress(outline, point, &mut meyer, &mut areas);
            for (value, meyer) in values.iter_mut().zip(meyer) {
                *value += self.meyer * (meyer - *value);
            }
        }
    }
}

/// Share of Meyer's coordinates on a quad: from 0 at a straight corner to 1 at [`MEYER_TURN`], by `3 x^2 - 2 x^3`.
fn meyer_share(quad: &[DVec2]) -> f64 {
    let turns = (0..4).map(|k| {
        let [before, after] =
            [quad[k] - quad[(k + 3) % 4], quad[(k + 1) % 4] - quad[k]].map(DVec2::normalize_or_zero);
        let sine = before.perp_dot(after);
        // Turns above 90 degrees are far from straight.
        if sine > 0.0 && before.dot(after) < 0.0 { 1.0 } else { sine }
    });
    let x = (turns.fold(1.0, f64::min) / MEYER_TURN).clamp(0.0, 1.0);
    let share = x * x * (3.0 - 2.0 * x);
    if share < MIN_SHARE { 0.0 } else { share }
}

/// Coordinates in the plane with this normal, one axis along the longest side, so that a rectangle stays one.
fn project(arms: &[DVec3], normal: DVec3) -> Vec<DVec2> {
    let n = arms.len();
    let side = (0..n)
        .map(|k| arms[(k + 1) % n] - arms[k])
        .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
        .unwrap_or(DVec3::X);
    let x = side.reject_from_normalized(normal).normalize_or(normal.any_orthonormal_vector());
    let y = normal.cross(x);
    arms.iter().map(|p| DVec2::new(p.dot(x), p.dot(y))).collect()
}

/// Whether all corners turn left, clearly, and the outline goes round once.
fn is_convex(outline: &[DVec2]) -> bool {
    let n = outline.len();
    let mut total = 0.0;
    for k in 0..n {
        let (before, after) = (outline[(k + n - 1) % n], outline[(k + 1) % n]);
        if turn(before, outline[k], after) < MIN_TURN {
            return false;
        }
        total += (outline[k] - before).angle_to(after - outline[k]);
    }
    total < 3.0 * std::f64::consts::PI
}

/// Sine of the turn at `b` on the way from `a` to `c`; positive to the left.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).normalize_or_zero().perp_dot((c - b).normalize_or_zero())
}

/// Whether two sides cross in a point inside both.
fn crosses_itself(outline: &[DVec2]) -> bool {
    let n = outline.len();
    let side = |k: usize| (outline[k], outline[(k + 1) % n]);
    (0..n).any(|j| {
        (j + 2..n).any(|k| {
            let ((a, b), (c, d)) = (side(j), side(k));
            cross(a, b, c) * cross(a, b, d) < 0.0 && cross(c, d, a) * cross(c, d, b) < 0.0
        })
    })
}

/// Splits a quad that is not planar along its shorter diagonal (the first one if they are equal), unless that one lies
/// outside of it seen along its normal.
fn split_quad(arms: &[DVec3], normal: DVec3) -> Vec<[u32; 3]> {
    let first = [[0, 1, 2], [0, 2, 3]];
    let second = [[1, 2, 3], [1, 3, 0]];
    let faces_out = |split: &[[usize; 3]; 2]| {
        split.iter().all(|&[a, b, c]| (arms[b] - arms[a]).cross(arms[c] - arms[a]).dot(normal) > 0.0)
    };
    let shorter_first = arms[0].distance_squared(arms[2]) <= arms[1].distance_squared(arms[3]);
    let take_first = if faces_out(&first) == faces_out(&second) { shorter_first } else { faces_out(&first) };
    let split = if take_first { first } else { second };
    split.iter().map(|t| t.map(|k| k as u32)).collect()
}
