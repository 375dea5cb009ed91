//! [`Parts`] of a model bound to a cage. Computing the motions of the pieces in a pose needs no pass over the pieces'
//! vertices.
//!
//! Displacements are linear in the vectors of the weights' columns (controls and [`Frames`]), and so are the two sums
//! from which Kabsch's rotation follows. These sums are precomputed per piece and column, so the motion of a piece
//! costs a few operations per column, whatever the size of the piece.

use glam::{DMat3, DVec3, Vec3, Vec4};

use super::{Motion, Parts, outer};
use cagework_core::frames::Frames;
use cagework_core::weights::Weights;

/// Fixed vertices and rigid pieces of a bound model, ready for any pose.
#[derive(Clone, Debug)]
pub struct BoundParts {
    /// Rest position, object units. The fourth component is the share of the displacement that is suppressed, 0 to 1.
    /// `[n_vertices]`
    pub rest: Vec<Vec4>,
    /// Rigid piece of each vertex, counted from 1; 0 if the vertex belongs to none. `[n_vertices]`
    pub piece_of: Vec<u32>,
    pieces: Vec<PieceSums>,
    /// Rest positions of the columns of the weights.
    columns: Vec<Vec3>,
    frames: Frames,
}

impl Parts {
    /// Prepares the parts for a bind; `None` if all vertices follow the cage. Arguments and panics as
    /// [`BoundParts::new`].
    #[must_use]
    pub fn bound(
        &self,
        rest: &[Vec3],
        weights: &Weights,
        frames: &Frames,
        controls: &[Vec3],
    ) -> Option<BoundParts> {
        let is_nothing = self.rigid.is_empty() && self.stays.iter().all(|&s| s == 0.0);
        (!is_nothing).then(|| BoundParts::new(self, rest, weights, frames, controls))
    }
}

/// Displacement field of a rigid piece: a vertex at `x` moves by `rows * (x, 1)`.
pub type PieceMotion = [Vec4; 3];

/// Sums over the vertices of a rigid piece.
#[derive(Clone, Debug)]
struct PieceSums {
    /// Mean of the rest positions.
    centre: DVec3,
    /// Sum of `from from^T`, with `from` the rest position minus the centre.
    moments: DMat3,
    n: f64,
    /// For each column that moves the piece: its index, the sum of its weights, and the sum of weight times `from`.
    columns: Vec<(u32, f64, DVec3)>,
}

impl BoundParts {
    /// Precomputes the sums of all pieces. `rest`: the model's vertices; `weights`, `frames`: results of its bind;
    /// `controls`: rest positions of the controls. Object units.
    ///
    /// # Panics
    /// If `weights` or `parts.stays` does not have one entry per vertex.
    #[must_use]
    pub fn new(parts: &Parts, rest: &[Vec3], weights: &Weights, frames: &Frames, controls: &[Vec3]) -> Self {
        assert_eq!(weights.n_rows(), rest.len(), "one row per vertex");
        assert!(parts.stays.is_empty() || parts.stays.len() == rest.len(), "one amount per vertex");
        let stays = |v: usize| parts.stays.get(v).copied().unwrap_or(0.0);
        let mut piece_of = vec![0; rest.len()];
        for (piece, number) in parts.rigid.iter().zip(1..) {
            piece.iter().for_each(|&v| piece_of[v as usize] = number);
        }
        Self {
            rest: rest.iter().enumerate().map(|(v, p)| p.extend(stays(v))).collect(),
            pieces: parts.rigid.iter().map(|piece| PieceSums::new(piece, rest, weights)).collect(),
            piece_of,
            columns: frames.columns(controls).into_owned(),
            frames: frames.clone(),
        }
    }

    /// Number of rigid pieces.
    #[must_use]
    pub fn n_pieces(&self) -> usize {
        self.pieces.len()
    }

    /// Computes the motion of each piece when the controls are at `posed`, `[n_controls]`, object units. `[n_pieces]`
    ///
    /// # Panics
    /// If there is not one position per control.
    #[must_use]
    pub fn motions(&self, posed: &[Vec3]) -> Vec<PieceMotion> {
        let posed = self.frames.columns(posed);
        assert_eq!(posed.len(), self.columns.len(), "one position per control");
        self.pieces.iter().map(|piece| piece.motion(&self.columns, &posed)).collect()
    }

    /// Holds deformed vertices in place or moves them rigidly. `posed`: positions of the controls; `positions`:
    /// `[n_vertices]`, object units.
    ///
    /// # Panics
    /// If there is not one position per control.
    pub fn hold(&self, posed: &[Vec3], positions: &mut [Vec3]) {
        hold_parts(&self.rest, &self.piece_of, &self.motions(posed), positions);
    }
}

impl PieceSums {
    fn new(piece: &[u32], rest: &[Vec3], weights: &Weights) -> Self {
        let at = |v: u32| rest[v as usize].as_dvec3();
        let n = piece.len() as f64;
        let centre = piece.iter().map(|&v| at(v)).sum::<DVec3>() / n;
        let mut moments = DMat3::ZERO;
        let mut sums = vec![(0.0, DVec3::ZERO); weights.n_columns()];
        for &v in piece {
            let from = at(v) - centre;
            moments += outer(from, from);
            let (columns, values) = weights.row(v as usize);
            for (&column, &weight) in columns.iter().zip(values) {
                let (sum, moment) = &mut sums[column as usize];
                *sum += f64::from(weight);
                *moment += f64::from(weight) * from;
            }
        }
        let used = (0..).zip(sums).filter(|(_, (sum, moment))| *sum != 0.0 || *moment != DVec3::ZERO);
        Self {
            centre,
            moments,
            n,
            columns: used.map(|(column, (sum, moment))| (column, sum, moment)).collect(),
        }
    }

    fn motion(&self, rest: &[Vec3], posed: &[Vec3]) -> PieceMotion {
        let (mut shift, mut moments) = (DVec3::ZERO, DMat3::ZERO);
        for &(column, sum, moment) in &self.columns {
            let by = posed[column as usize].as_dvec3() - rest[column as usize].as_dvec3();
            shift += sum * by;
            moments += outer(by, moment);
        }
        // No displacement: return exactly zero, without rounding.
        if shift == DVec3::ZERO && moments == DMat3::ZERO {
            return [Vec4::ZERO; 3];
        }
        Motion::from_sums(self.centre, shift / self.n, self.moments, moments).rows()
    }
}

/// Applies fixed vertices and rigid pieces to deformed `positions`, `[n_vertices]`, object units, in place. `rest`,
/// `piece_of`: fields of [`BoundParts`]; `motions`: from [`BoundParts::motions`]. GPU kernel:
/// `shaders/hold_parts.wgsl`.
///
/// # Panics
/// If an entry of `piece_of` is larger than the number of `motions`.
pub fn hold_parts(rest: &[Vec4], piece_of: &[u32], motions: &[PieceMotion], positions: &mut [Vec3]) {
    for ((position, &rest), &piece) in positions.iter_mut().zip(rest).zip(piece_of) {
        let (at, stays) = (rest.truncate(), rest.w);
        if piece == 0 && stays == 0.0 {
            continue;
        }
        let by = match piece {
            0 => *position - at,
            _ => Vec3::from(motions[piece as usize - 1].map(|row| row.dot(at.extend(1.0)))),
        };
        *position = at + (1.0 - stays) * by;
    }
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;
    use cagework_core::deform::deform_bound;

    /// Tolerance for f32 rounding of positions of size 1 after sums of 64 terms.
    const ROUNDING: f32 = 2e-6;

    fn hashed(n: u32, seed: u32) -> impl Iterator<Item = f32> {
        (0..n).map(move |k| ((k.wrapping_add(seed).wrapping_mul(2_654_435_761) >> 8) % 1000) as f32 / 1000.0)
    }

    /// Vertices with random weights for the eight corners of a cube; two vertices carry a constant offset.
    fn bound() -> (Vec<Vec3>, Weights, Frames, Vec<Vec3>) {
        let cube: Vec<Vec3> =
            (0..8).map(|k| Vec3::new((k & 1) as f32, (k >> 1 & 1) as f32, (k >> 2) as f32)).collect();
        let n = 40;
        let mut data: Vec<f32> = hashed(8 * n, 3).map(|w| w + 0.01).collect();
        for row in data.chunks_exact_mut(8) {
            let sum: f32 = row.iter().sum();
            row.iter_mut().for_each(|w| *w /= sum);
        }
        let (mut indptr, mut indices, mut all) = (vec![0], Vec::new(), Vec::new());
        for (v, row) in data.chunks_exact(8).enumerate() {
            indices.extend(0..8);
            all.extend(row);
            if [3, 17].contains(&v) {
                indices.extend(8..11);
                all.extend([0.05, -0.1, 0.2]);
            }
            indptr.push(indices.len() as u32);
        }
        let weights = Weights::new(14, indptr, indices, all).expect("rows are whole");
        let frames = Frames::of_cage(&cube);
        (deform_bound(&weights, &frames, &cube), weights, frames, cube)
    }

    #[test]
    fn bound_parts_move_vertices_like_parts() {
        let (rest, weights, frames, cube) = bound();
        let mut stays = vec![0.0; rest.len()];
        stays[..6].copy_from_slice(&[1.0, 0.5, 0.25, 0.0, 1.0, 0.75]);
        let parts = Parts { stays, rigid: vec![(2..15).collect(), vec![17, 20, 21, 30]] };
        let ready = BoundParts::new(&parts, &rest, &weights, &frames, &cube);
        let turn = Quat::from_axis_angle(Vec3::new(1.0, -1.0, 0.5).normalize(), 0.8);
        let posed: Vec<Vec3> = cube
            .iter()
            .map(|&p| turn * p * Vec3::new(1.5, 1.0, 0.8) + Vec3::splat(0.5) * p.x * p.y)
            .collect();
        let mut frame = deform_bound(&weights, &frames, &posed);
        let expected = parts.hold(&rest, &frame);
        let moved = frame.clone();
        hold_parts(&ready.rest, &ready.piece_of, &ready.motions(&posed), &mut frame);
        for (v, (a, b)) in frame.iter().zip(&expected).enumerate() {
            assert!(a.distance(*b) <= ROUNDING, "vertex {v}: {a} instead of {b}");
        }
        assert_eq!(frame[0], rest[0], "a fixed vertex keeps its rest position exactly");
        assert_eq!(frame[39], moved[39], "a free vertex keeps its deformed position exactly");
    }

    #[test]
    fn at_rest_nothing_moves() {
        let (rest, weights, frames, cube) = bound();
        let parts = Parts { stays: Vec::new(), rigid: vec![(0..20).collect()] };
        let ready = BoundParts::new(&parts, &rest, &weights, &frames, &cube);
        assert_eq!(ready.motions(&cube), [[Vec4::ZERO; 3]]);
    }
}
