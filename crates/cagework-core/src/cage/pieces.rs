//! A planar polygon as convex pieces, so that its hats are positive and stay near their corner.
//!
//! Source: Hertel, Mehlhorn 1983, "Fast triangulation of simple polygons": diagonals of a triangulation are taken out
//! as long as what they part stays convex; at most four times as many pieces are left as there could be.

use glam::DVec2;

use super::triangulate::ear_clip;
use super::{defects::FaceDefect, polygon::turn};

/// A corner counts as convex if the sine of its turn is not below this: rounding of f32 coordinates.
const STRAIGHT_TURN: f64 = -1e-6;

/// A simple polygon in convex pieces.
pub(super) struct Pieces {
    /// Corners of each piece, counter-clockwise, as corners of the polygon.
    pub(super) corners: Vec<Vec<u32>>,
    /// Triangles that cover the polygon.
    pub(super) triangles: Vec<[u32; 3]>,
    /// The piece that each triangle lies in.
    pub(super) piece_of_triangle: Vec<u32>,
}

/// Cuts a simple counter-clockwise polygon into pieces whose corners turn left or, hardly, not at all.
pub(super) fn convex_pieces(outline: &[DVec2]) -> Result<Pieces, FaceDefect> {
    let triangles = ear_clip(outline)?;
    let mut corners: Vec<Vec<u32>> = triangles.iter().map(|t| t.to_vec()).collect();
    let mut piece_of: Vec<usize> = (0..triangles.len()).collect();
    for t in 0..triangles.len() {
        for k in 0..3 {
            let (i, j) = (triangles[t][k], triangles[t][(k + 1) % 3]);
            let mine = piece_of[t];
            // The piece on the other side runs along the diagonal the other way.
            let other = (0..corners.len()).find(|&p| p != mine && side(&corners[p], j, i).is_some());
            let Some(merged) = other.and_then(|other| merge(&corners[mine], &corners[other], i, j)) else {
                continue;
            };
            if !merged.iter().enumerate().all(|(k, _)| turn_at(outline, &merged, k) >= STRAIGHT_TURN) {
                continue;
            }
            let other = other.unwrap_or(mine);
            corners[mine] = merged;
            corners[other].clear();
            piece_of.iter_mut().filter(|p| **p == other).for_each(|p| *p = mine);
        }
    }
    // The pieces that are left, renumbered.
    let mut rank = vec![0; corners.len()];
    let mut kept = Vec::new();
    for (p, piece) in corners.into_iter().enumerate() {
        rank[p] = kept.len() as u32;
        if !piece.is_empty() {
            kept.push(piece);
        }
    }
    let piece_of_triangle = piece_of.into_iter().map(|p| rank[p]).collect();
    Ok(Pieces { corners: kept, triangles, piece_of_triangle })
}

/// Where `piece` runs from corner `i` to corner `j`.
fn side(piece: &[u32], i: u32, j: u32) -> Option<usize> {
    (0..piece.len()).find(|&k| piece[k] == i && piece[(k + 1) % piece.len()] == j)
}

/// Two pieces without the diagonal from `i` to `j`, along which `a` runs and `b` runs back.
fn merge(a: &[u32], b: &[u32], i: u32, j: u32) -> Option<Vec<u32>> {
    let (at_a, at_b) = (side(a, i, j)?, side(b, j, i)?);
    // All of `a`, beginning at `j` and ending at `i`, then what of `b` lies between `i` and `j`.
    let all_of_a = (1..=a.len()).map(|k| a[(at_a + k) % a.len()]);
    let rest_of_b = (2..b.len()).map(|k| b[(at_b + k) % b.len()]);
    Some(all_of_a.chain(rest_of_b).collect())
}

fn turn_at(outline: &[DVec2], piece: &[u32], k: usize) -> f64 {
    let n = piece.len();
    let at = |k: usize| outline[piece[k % n] as usize];
    turn(at(k + n - 1), at(k), at(k + 1))
}
