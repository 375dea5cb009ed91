//! A face projected to its plane: its hats and its triangulation.

use glam::{DVec2, DVec3};

use super::defects::{FaceDefect, MAX_CORNERS};
use super::hats;
use super::patch::{self, Facets};
use super::triangulate::{cross, ear_clip};

/// Height of a face, as a fraction of the cage's diagonal, below which the face has no area. It is slightly above the
/// relative rounding of f32 coordinates, 6e-8.
pub(super) const MIN_FACE_HEIGHT: f64 = 1e-7;

/// Distance of the corners from the face's plane, as a fraction of the cage's diagonal, up to which a face is planar.
/// Rounding to the six decimals of OBJ files moves the corners of a model of size 1 by up to 0.9e-6, less than half of
/// this. This distance bounds the rest error on the face.
pub(super) const PLANE_TOLERANCE: f64 = 2e-6;

/// Distance of the corners from the face's plane, as a fraction of the cage's diagonal, from which on hats are linear on
/// the facets of the patch. Between [`PLANE_TOLERANCE`] and this, they blend into the coordinates of the outline, so that
/// they are continuous in the corners.
const FACETED: f64 = 1e-4;

/// Smallest sine of the exterior angle at the corners of an outline that counts as convex.
const MIN_CONVEX_SINE: f64 = 1e-3;

/// Smallest sine of the exterior angles (14 degrees) for which a quad has Meyer's coordinates ([`hats::wachspress`])
/// alone. At a straight corner Meyer's hat vanishes, so below this sine Meyer's coordinates are blended with
/// pseudo-harmonic ones.
const MIN_MEYER_SINE: f64 = 0.25;

/// Shortest side of a projected face, as a fraction of the face's size: a few roundings of f64.
const MIN_PROJECTED_SIDE: f64 = 1e-14;

/// Shares of Meyer's coordinates below this are set to 0, because at a straight corner the coordinates are 0 / 0.
const MIN_SHARE: f64 = 1e-6;

/// A face projected to its plane.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Polygon {
    /// Corners in the plane, counter-clockwise seen from outside, then inner points of the patch; empty if hats are
    /// linear on each facet.
    pub(super) outline: Vec<DVec2>,
    /// Share of Meyer's coordinates in the hats; the rest is pseudo-harmonic. 0 unless the face is a quad.
    meyer: f64,
    /// Triangulation of the face, as indices of its corners, with its orientation.
    pub(super) triangles: Vec<[u32; 3]>,
    /// The surface on which hats are prescribed: the triangles, or those of a patch. Indices of corners and inner
    /// points.
    pub(super) facets: Vec<[u32; 3]>,
    /// Hats at the inner points of the patch. `[n_inner][n_corners]`
    pub(super) inner: Vec<Vec<f64>>,
    /// Share of the hats that is linear on each facet of the patch, 0 to 1. Only linear hats reproduce the points of
    /// facets.
    faceted: f64,
}

impl Polygon {
    /// Projects a face with at least three corners and triangulates it. `diagonal`: diagonal of the cage.
    pub(super) fn new(corners: &[DVec3], diagonal: f64) -> Result<Self, FaceDefect> {
        let n = corners.len();
        if n > MAX_CORNERS {
            return Err(FaceDefect::TooManyCorners { corners: n });
        }
        let center = corners.iter().sum::<DVec3>() / n as f64;
        let arms: Vec<DVec3> = corners.iter().map(|&p| p - center).collect();
        // Newell's normal: twice the area vector.
        let normal: DVec3 = (0..n).map(|k| arms[k].cross(arms[(k + 1) % n])).sum();
        let extent = 2.0 * arms.iter().map(|p| p.length()).fold(0.0, f64::max);
        if normal.length() <= MIN_FACE_HEIGHT * diagonal * extent {
            return Err(FaceDefect::NoArea);
        }
        if n == 3 {
            return Ok(Self::linear(vec![[0, 1, 2]]));
        }
        let normal = normal.normalize();
        let outline = project(&arms, normal);
        let height = arms.iter().map(|p| p.dot(normal).abs()).fold(0.0, f64::max);
        let (is_bent, is_convex) = (height > PLANE_TOLERANCE * diagonal, is_convex(&outline));
        let crosses = !is_convex && crosses_itself(&outline);
        // A side along the normal projects to nearly a point: the angles at its ends would be rounding errors.
        let is_flattened = is_bent && shortest_side(&outline) < MIN_PROJECTED_SIDE * extent;
        if crosses && !is_bent {
            return Err(FaceDefect::CrossesItself);
        }
        let triangles = match n {
            4 if is_bent => split_quad(&arms, normal),
            _ if is_convex && !is_bent => (2..n as u32).map(|k| [0, k - 1, k]).collect(),
            _ => ear_clip(&outline)?,
        };
        if crosses || is_flattened {
            return Ok(Self::linear(triangles));
        }
        let Facets { inner: points, facets } = match (is_bent, is_convex) {
            (false, _) => Facets { inner: Vec::new(), facets: triangles.clone() },
            (true, true) => patch::rings(&outline),
            (true, false) => patch::fans(&outline, &triangles),
        };
        let meyer = if n == 4 { meyer_share(&outline) } else { 0.0 };
        let faceted = ((height / diagonal - PLANE_TOLERANCE) / (FACETED - PLANE_TOLERANCE)).clamp(0.0, 1.0);
        let mut polygon = Self { outline, meyer, triangles, facets, inner: Vec::new(), faceted };
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
        Self { outline: Vec::new(), meyer: 0.0, facets, triangles, inner: Vec::new(), faceted: 0.0 }
    }

    /// Computes the hats of the corners at a point of a facet, non-negative. `values`: `[n_corners]`, zero on entry.
    pub(super) fn values_on(&self, facet: usize, barycentric: [f64; 3], values: &mut [f64]) {
        let corners = self.facets[facet];
        if self.faceted < 1.0 {
            let points = corners.map(|k| self.outline[k as usize]);
            self.values(points.iter().zip(barycentric).map(|(&p, b)| b * p).sum(), values);
        }
        if self.faceted > 0.0 {
            values.iter_mut().for_each(|value| *value *= 1.0 - self.faceted);
            for (k, b) in corners.into_iter().zip(barycentric) {
                let share = self.faceted * b;
                match (k as usize).checked_sub(values.len()) {
                    None => values[k as usize] += share,
                    Some(inner) => {
                        for (value, hat) in values.iter_mut().zip(&self.inner[inner]) {
                            *value += share * hat;
                        }
                    }
                }
            }
        }
    }

    /// Computes the hats of the corners at a point of the plane, non-negative. `values`: `[n_corners]`, zero on entry.
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

/// Computes the share of Meyer's coordinates on a quad: smoothstep from 0 at a straight corner to 1 at
/// [`MIN_MEYER_SINE`].
fn meyer_share(quad: &[DVec2]) -> f64 {
    let turns = (0..4).map(|k| {
        let [before, after] =
            [quad[k] - quad[(k + 3) % 4], quad[(k + 1) % 4] - quad[k]].map(DVec2::normalize_or_zero);
        let sine = before.perp_dot(after);
        // A corner with an exterior angle above 90 degrees is far from straight, even if the sine is small: use 1.
        if sine > 0.0 && before.dot(after) < 0.0 { 1.0 } else { sine }
    });
    let x = (turns.fold(1.0, f64::min) / MIN_MEYER_SINE).clamp(0.0, 1.0);
    let share = x * x * (3.0 - 2.0 * x);
    if share < MIN_SHARE { 0.0 } else { share }
}

/// Projects points to the plane with this normal. One axis of the plane is along the longest side, so that rectangles
/// remain axis-aligned.
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

/// Whether the outline is strictly convex and winds once.
fn is_convex(outline: &[DVec2]) -> bool {
    let n = outline.len();
    let mut total = 0.0;
    for k in 0..n {
        let (before, after) = (outline[(k + n - 1) % n], outline[(k + 1) % n]);
        if turn(before, outline[k], after) < MIN_CONVEX_SINE {
            return false;
        }
        total += (outline[k] - before).angle_to(after - outline[k]);
    }
    total < 3.0 * std::f64::consts::PI
}

/// Returns the sine of the exterior angle at `b` of the path `a`, `b`, `c`; positive for a turn to the left.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).normalize_or_zero().perp_dot((c - b).normalize_or_zero())
}

/// Whether two sides cross at inner points of both.
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

fn shortest_side(outline: &[DVec2]) -> f64 {
    let n = outline.len();
    (0..n).map(|k| outline[k].distance(outline[(k + 1) % n])).fold(f64::INFINITY, f64::min)
}

/// Splits a non-planar quad along its shorter diagonal (the first one if equal), unless that diagonal lies outside the
/// quad in projection.
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
