//! Parts of a model that the cage does not bend: vertices that stay in place and rigid pieces.
//!
//! Both depend only on displacements, so they can be applied after any deformation, to vertices and to morph targets.

mod bound;

use std::collections::HashMap;

use glam::{DMat3, DMat4, DVec3, Vec3};

use cagework_core::disjoint::DisjointSets;
use cagework_core::mesh::weld;
use cagework_core::rotation::nearest_rotation;

pub use bound::{BoundParts, PieceMotion, hold_parts};

/// Multiple of the identity that is added to a piece's covariance, as a fraction of the covariance's trace. It fixes
/// rotations that the points do not determine: a line of points does not rotate about itself.
const IDENTITY_WEIGHT: f64 = 1e-9;

/// Vertices that the cage does not move freely: vertices that stay in place, wholly or in part, and rigid pieces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parts {
    /// Share of each vertex's displacement that is suppressed, 0 to 1. `[n_vertices]`, or empty if all vertices follow
    /// the cage.
    pub stays: Vec<f32>,
    /// Vertices of each rigid piece, such as a buckle, an eye or a tooth. [`pieces`] finds them in a selection.
    pub rigid: Vec<Vec<u32>>,
}

/// Displacement field of a rigid motion: `x` moves by `turn (x - centre) + shift`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    centre: DVec3,
    /// Rotation minus identity.
    turn: DMat3,
    shift: DVec3,
}

impl Motion {
    /// Fits the rigid motion nearest to the given displacements in least squares (Kabsch 1976). `points`:
    /// `(position, displacement)` pairs; must not be empty.
    #[must_use]
    pub fn fit(points: &[(DVec3, DVec3)]) -> Self {
        // No displacement: return exactly zero, without rounding.
        if points.iter().all(|(_, by)| *by == DVec3::ZERO) {
            return Self { centre: DVec3::ZERO, turn: DMat3::ZERO, shift: DVec3::ZERO };
        }
        let sum = |of: fn(&(DVec3, DVec3)) -> DVec3| points.iter().map(of).sum::<DVec3>();
        let [centre, shift] = [sum(|p| p.0), sum(|p| p.1)].map(|sum| sum / points.len() as f64);
        let (mut at_rest, mut moved) = (DMat3::ZERO, DMat3::ZERO);
        for &(at, by) in points {
            let from = at - centre;
            at_rest += outer(from, from);
            moved += outer(by, from);
        }
        Self::from_sums(centre, shift, at_rest, moved)
    }

    /// Creates a rotation about `centre`, which itself moves by `shift`.
    #[must_use]
    pub fn about(centre: DVec3, rotation: DMat3, shift: DVec3) -> Self {
        Self { centre, turn: rotation - DMat3::IDENTITY, shift }
    }

    /// Computes Kabsch's rotation from sums over the points: `centre`, their mean; `shift`, their mean displacement;
    /// `at_rest`, the sum of `from from^T`; `moved`, the sum of `by from^T`, with `from` the position minus the centre
    /// and `by` the displacement.
    fn from_sums(centre: DVec3, shift: DVec3, at_rest: DMat3, moved: DMat3) -> Self {
        let size = at_rest.x_axis.x + at_rest.y_axis.y + at_rest.z_axis.z;
        let rotation =
            nearest_rotation(at_rest + moved + DMat3::from_diagonal(DVec3::splat(IDENTITY_WEIGHT * size)));
        Self { centre, turn: rotation - DMat3::IDENTITY, shift }
    }

    /// The motion as three rows of a matrix, see [`PieceMotion`].
    fn rows(&self) -> PieceMotion {
        let at_origin = self.by(DVec3::ZERO);
        let rows = self.turn.transpose();
        [0, 1, 2].map(|axis| rows.col(axis).extend(at_origin[axis]).as_vec4())
    }

    /// Displacement of the point at `at`.
    #[must_use]
    pub fn by(&self, at: DVec3) -> DVec3 {
        self.turn * (at - self.centre) + self.shift
    }

    /// The rigid motion as a matrix that maps rest positions to moved positions.
    #[must_use]
    pub fn transform(&self) -> DMat4 {
        DMat4::from_mat3_translation(DMat3::IDENTITY + self.turn, self.by(DVec3::ZERO))
    }
}

/// The matrix `a b^T`.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

impl Parts {
    /// Whether no vertex is constrained.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.stays.is_empty() && self.rigid.is_empty()
    }

    /// Computes the motion of vertices at `rest` that the cage displaces by `by`, `[n_vertices]`, object units, with
    /// fixed vertices and rigid pieces. A fully fixed vertex, and a rigid piece without displacements, move by exactly
    /// zero.
    ///
    /// # Panics
    /// If a piece has a vertex outside `rest`, or the lengths differ.
    #[must_use]
    pub fn held(&self, rest: &[DVec3], by: &[DVec3]) -> HeldMotion {
        assert!(rest.len() == by.len(), "one displacement per vertex");
        assert!(self.stays.is_empty() || self.stays.len() == rest.len(), "one amount per vertex");
        let motion_of = |piece: &Vec<u32>| {
            let points: Vec<_> = piece.iter().map(|&v| (rest[v as usize], by[v as usize])).collect();
            Motion::fit(&points)
        };
        let pieces = self.rigid.iter().zip(0..).flat_map(|(piece, k)| piece.iter().map(move |&v| (v, k)));
        HeldMotion {
            motions: self.rigid.iter().map(motion_of).collect(),
            piece_of: pieces.collect(),
            stays: self.stays.clone(),
        }
    }

    /// Returns the deformed positions with fixed vertices kept in place and rigid pieces moved rigidly. `rest`,
    /// `deformed`: `[n_vertices]`, object units.
    ///
    /// # Panics
    /// As [`Self::held`].
    #[must_use]
    pub fn hold(&self, rest: &[Vec3], deformed: &[Vec3]) -> Vec<Vec3> {
        let at: Vec<DVec3> = rest.iter().map(|p| p.as_dvec3()).collect();
        let by: Vec<DVec3> = at.iter().zip(deformed).map(|(a, d)| d.as_dvec3() - a).collect();
        let held = self.held(&at, &by);
        let moved = |v: usize| {
            if held.is_held(v as u32) {
                (at[v] + held.by(v as u32, at[v], by[v])).as_vec3()
            } else {
                deformed[v]
            }
        };
        (0..rest.len()).map(moved).collect()
    }
}

/// [`Parts`] under one deformation: the rigid motion of each piece, and the vertices that stay in place.
#[derive(Clone, Debug)]
pub struct HeldMotion {
    motions: Vec<Motion>,
    piece_of: HashMap<u32, usize>,
    stays: Vec<f32>,
}

impl HeldMotion {
    /// Whether a vertex is constrained: it stays in place, wholly or in part, or belongs to a rigid piece.
    #[must_use]
    pub fn is_held(&self, vertex: u32) -> bool {
        self.piece_of.contains_key(&vertex) || self.stays.get(vertex as usize).is_some_and(|&s| s > 0.0)
    }

    /// Returns the constrained displacement of a vertex at the position `at` (at rest or in a morph target) that the
    /// cage would move by `by`.
    #[must_use]
    pub fn by(&self, vertex: u32, at: DVec3, by: DVec3) -> DVec3 {
        let by = self.piece_of.get(&vertex).map_or(by, |&piece| self.motions[piece].by(at));
        match self.stays.get(vertex as usize) {
            // Return a literal zero: a product could be -0.
            Some(&stays) if stays >= 1.0 => DVec3::ZERO,
            Some(&stays) if stays > 0.0 => (1.0 - f64::from(stays)) * by,
            _ => by,
        }
    }
}

/// Finds the connected pieces of a selection. Vertices are connected by triangles whose corners are all selected, and
/// by equal positions (seams). Pieces are in order of their first vertex, vertices in ascending order.
///
/// # Panics
/// If a vertex is not in `positions`.
#[must_use]
pub fn pieces(positions: &[Vec3], triangles: &[[u32; 3]], selected: &[u32]) -> Vec<Vec<u32>> {
    if selected.is_empty() {
        return Vec::new();
    }
    let mut is_selected = vec![false; positions.len()];
    selected.iter().for_each(|&v| is_selected[v as usize] = true);
    let unique_of = weld(positions).unique_of;
    let mut sets = DisjointSets::new(positions.len());
    for triangle in triangles.iter().filter(|t| t.iter().all(|&v| is_selected[v as usize])) {
        let [a, b, c] = triangle.map(|v| unique_of[v as usize]);
        sets.join(a, b);
        sets.join(a, c);
    }
    let mut number_of = HashMap::new();
    let mut pieces: Vec<Vec<u32>> = Vec::new();
    for v in (0..positions.len() as u32).filter(|&v| is_selected[v as usize]) {
        let place = sets.root(unique_of[v as usize]);
        let number = *number_of.entry(place).or_insert_with(|| {
            pieces.push(Vec::new());
            pieces.len() - 1
        });
        pieces[number].push(v);
    }
    pieces
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    fn cloud(n: u32) -> Vec<Vec3> {
        let hash = |k: u32| ((k.wrapping_mul(2_654_435_761) >> 8) % 1000) as f32 / 1000.0;
        (0..n).map(|k| Vec3::new(hash(k), hash(k + 1000), hash(k + 2000))).collect()
    }

    fn all_rigid(n: u32) -> Parts {
        Parts { stays: Vec::new(), rigid: vec![(0..n).collect()] }
    }

    fn displaced(rest: &[Vec3], by: impl Fn(DVec3) -> DVec3) -> Vec<Vec3> {
        rest.iter().map(|p| (p.as_dvec3() + by(p.as_dvec3())).as_vec3()).collect()
    }

    #[test]
    fn a_rigid_piece_keeps_its_edge_lengths() {
        let rest = cloud(30);
        let bent = displaced(&rest, |p| DVec3::new(p.y * p.y, 0.5 * p.x, 2.0 * p.z));
        let held = all_rigid(30).hold(&rest, &bent);
        for (a, b) in (0..29).map(|k| (k, k + 1)) {
            let change = held[a].distance(held[b]) - rest[a].distance(rest[b]);
            assert!(change.abs() <= 1e-6, "edge {a}: {change:e}");
        }
    }

    #[test]
    fn a_rigid_motion_is_recovered() {
        let rest = cloud(12);
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, -2.0, 0.5).normalize(), 2.5);
        let to = displaced(&rest, |p| turn * p - p + DVec3::new(3.0, -1.0, 0.25));
        for (held, to) in all_rigid(12).hold(&rest, &to).iter().zip(&to) {
            assert!(held.distance(*to) <= 1e-6, "{held} instead of {to}");
        }
    }

    #[test]
    fn the_rotation_minimises_squared_distances() {
        let rest = cloud(20);
        let bent = displaced(&rest, |p| DVec3::new(p.y * p.z, p.x * p.x - p.z, -p.y));
        let held = all_rigid(20).hold(&rest, &bent);
        let squares = |at: &dyn Fn(usize) -> DVec3| -> f64 {
            (0..20).map(|v| at(v).distance_squared(bent[v].as_dvec3())).sum()
        };
        let centre = held.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / 20.0;
        let best = squares(&|v| held[v].as_dvec3());
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            for angle in [-0.05, 0.05, 1.0, 3.0] {
                let turn = DQuat::from_axis_angle(axis, angle);
                let turned = squares(&|v| centre + turn * (held[v].as_dvec3() - centre));
                assert!(turned > best, "{axis} by {angle}: {turned} below {best}");
            }
        }
    }

    #[test]
    fn a_line_turns_without_twist_and_a_point_only_moves() {
        let line: Vec<Vec3> = (0..5).map(|k| Vec3::new(k as f32, 0.0, 0.0)).collect();
        // A quarter turn about z maps x to y.
        let to: Vec<Vec3> = line.iter().map(|p| Vec3::new(0.0, p.x, 0.0)).collect();
        let at: Vec<DVec3> = line.iter().map(|p| p.as_dvec3()).collect();
        let by: Vec<DVec3> = to.iter().zip(&at).map(|(t, a)| t.as_dvec3() - a).collect();
        let held = all_rigid(5).held(&at, &by);
        let above = DVec3::new(0.0, 0.0, 1.0);
        assert!(
            held.by(2, at[2] + above, DVec3::ZERO).distance(by[2]) <= 1e-6,
            "the turn is about z, without twist"
        );
        let point = all_rigid(1).hold(&line[..1], &to[2..3]);
        assert_eq!(point, [to[2]]);
    }

    #[test]
    fn the_rest_pose_is_exact() {
        let rest = cloud(10);
        let parts = Parts { stays: vec![0.5; 10], ..all_rigid(10) };
        assert_eq!(parts.hold(&rest, &rest), rest);
    }

    #[test]
    fn a_fixed_share_reduces_the_displacement() {
        let rest = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let to = [Vec3::Z, Vec3::X + 2.0 * Vec3::Z, Vec3::Y + Vec3::Z];
        let parts = Parts { stays: vec![1.0, 0.25, 0.0], rigid: Vec::new() };
        assert_eq!(parts.hold(&rest, &to), [Vec3::ZERO, Vec3::X + 1.5 * Vec3::Z, to[2]]);
    }

    #[test]
    fn pieces_are_connected_by_selected_triangles_and_equal_positions() {
        // Vertices 2 and 3 are at the same position, which connects the first two triangles. Vertex 7 is not selected,
        // so the other two triangles connect nothing.
        let positions = [0, 1, 2, 2, 3, 4, 5, 6, 7].map(|x| Vec3::new(x as f32, (x * x) as f32, 0.0));
        let triangles = [[0, 1, 2], [3, 4, 5], [6, 7, 8], [5, 6, 7]];
        let found = pieces(&positions, &triangles, &[0, 1, 2, 3, 4, 5, 6, 8]);
        assert_eq!(found, [vec![0, 1, 2, 3, 4, 5], vec![6], vec![8]]);
        assert_eq!(pieces(&positions, &triangles, &[6, 7, 8]), [vec![6, 7, 8]]);
    }
}
