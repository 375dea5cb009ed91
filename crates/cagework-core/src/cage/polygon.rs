//! A face as a polygon in its plane: which hats it carries and how it is cut into triangles.

use glam::{DVec2, DVec3};

use super::defects::FaceDefect;
use super::hats;
use super::patch::{self, Facets};
use super::pieces::{Pieces, convex_pieces};
use super::triangulate::{cross, ear_clip};

/// A face lower than this fraction of the cage's diagonal has no area: it is lost in the rounding of f32 coordinates
/// (6e-8 relative).
pub(super) const FLAT_HEIGHT: f64 = 1e-7;

/// A polygon is planar if its corners are within this fraction of the cage's diagonal of its plane. Six decimals of
/// an OBJ file move the corners of a model of unit size by so much, and the rest pose can be off by no more.
pub(super) const PLANAR: f64 = 2e-6;

/// Smallest sine of a convex corner's turn for Meyer's formula: at a straight corner its hat vanishes, which would
/// not fit the neighbouring faces; mean value coordinates have no trouble there, and are not negative either.
const MIN_TURN: f64 = 1e-3;

/// Most corners for Meyer's formula, a product of one factor an edge: more could underflow.
const MAX_CONVEX_CORNERS: usize = 32;

/// Most corners of a face: cutting it takes the square of them, or the cube at worst.
pub(super) const MAX_CORNERS: usize = 1000;

/// How boundary values are interpolated on a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Hats {
    /// Linear on each triangle.
    Linear,
    /// Meyer et al. 2002.
    Convex,
    /// Hormann & Floater 2006: pieces with straight corners or very many.
    MeanValue,
}

/// A face in its plane.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Polygon {
    /// Corners in the plane, counter-clockwise seen from outside, then the patch's inner points; empty if hats are linear
    /// everywhere.
    pub(super) outline: Vec<DVec2>,
    /// What carries hats of its own; empty if hats are linear everywhere.
    pub(super) pieces: Vec<Piece>,
    /// Triangles that cover the face, as corners of it, turned like it.
    pub(super) triangles: Vec<[u32; 3]>,
    /// The surface on which hats are prescribed: the triangles, or those of a patch, as corners and inner points.
    pub(super) facets: Vec<[u32; 3]>,
    /// The piece that each facet lies in; empty if hats are linear everywhere.
    pub(super) piece_of_facet: Vec<u32>,
    /// The hats of the patch's inner points. `[n_inner][n_corners]`
    pub(super) inner: Vec<Vec<f64>>,
}

/// A convex part of a face.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Piece {
    pub(super) hats: Hats,
    /// Corners of the face, counter-clockwise.
    pub(super) corners: Vec<u32>,
    /// The same in the plane.
    pub(super) outline: Vec<DVec2>,
}

impl Piece {
    fn new(outline: &[DVec2], corners: Vec<u32>) -> Self {
        let outline: Vec<DVec2> = corners.iter().map(|&k| outline[k as usize]).collect();
        let hats = match corners.len() {
            3 => Hats::Linear,
            4..=MAX_CONVEX_CORNERS if is_convex(&outline) => Hats::Convex,
            _ => Hats::MeanValue,
        };
        Self { hats, corners, outline }
    }

    /// Values of its corners' hats at a point. `both`: scratch space, `[2][n_corners]`; returns its first half.
    pub(super) fn values<'a>(&self, point: DVec2, both: &'a mut [f64]) -> &'a [f64] {
        let (values, areas) = both.split_at_mut(self.corners.len());
        match self.hats {
            Hats::Convex => hats::wachspress(&self.outline, point, values, areas),
            Hats::Linear | Hats::MeanValue => hats::mean_value(&self.outline, point, values),
        }
        values
    }
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
        if height > PLANAR * diagonal {
            let triangles = if n == 4 { split_quad(&arms, normal) } else { ear_clip(&outline)? };
            return Ok(if is_convex(&outline) {
                Self::patch(outline, triangles)
            } else {
                Self::linear(triangles)
            });
        }
        let Pieces { corners, triangles, piece_of_triangle } = if is_convex(&outline) {
            Pieces {
                corners: vec![(0..n as u32).collect()],
                triangles: (2..n as u32).map(|k| [0, k - 1, k]).collect(),
                piece_of_triangle: vec![0; n - 2],
            }
        } else if crosses_itself(&outline) {
            return Err(FaceDefect::CrossesItself);
        } else {
            convex_pieces(&outline)?
        };
        let pieces = corners.into_iter().map(|corners| Piece::new(&outline, corners)).collect();
        let facets = triangles.clone();
        Ok(Self { outline, pieces, triangles, facets, piece_of_facet: piece_of_triangle, inner: Vec::new() })
    }

    fn linear(triangles: Vec<[u32; 3]>) -> Self {
        Self {
            outline: Vec::new(),
            pieces: Vec::new(),
            facets: triangles.clone(),
            triangles,
            piece_of_facet: Vec::new(),
            inner: Vec::new(),
        }
    }

    /// A bent face whose outline, seen along its normal, is convex.
    fn patch(mut outline: Vec<DVec2>, triangles: Vec<[u32; 3]>) -> Self {
        let Facets { inner: points, facets } = patch::facets(&outline);
        let piece = Piece::new(&outline, (0..outline.len() as u32).collect());
        let mut both = vec![0.0; 2 * outline.len()];
        let inner = points.iter().map(|&p| piece.values(p, &mut both).to_vec()).collect();
        outline.extend(points);
        let piece_of_facet = vec![0; facets.len()];
        Self { outline, pieces: vec![piece], triangles, facets, piece_of_facet, inner }
    }
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
pub(super) fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
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
