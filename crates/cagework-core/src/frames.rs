//! Frames: columns of the weights after those of the controls. They carry offsets, the part of each vertex's position
//! that the weights do not reproduce.
//!
//! A vertex moves to `sum_i w_i c_i' + sum_f x_f e_f'`, where `c_i'` are the posed controls and the vectors `e_f'` are
//! computed from them. The first three `e_f'` are the unit vectors: their entries `x_f` are a constant offset. The next
//! three are the columns of the affine map nearest to the motion of the whole cage (least squares over its vertices).
//! For each *hold*, three more are the columns of the hold's matrix. The three entries `x_f` of a matrix are a share
//! of the vertex's rest vector `d = p - sum_i w_i c_i` at the rest position `p`.
//!
//! A hold is a joint (a point inside the cage, or a corner of a polyline) with one of the *bones* (segments of the
//! polyline) that end at it, or the joint alone if no bone ends at it. Its matrix is `R F`. `F = sum_j c_j' grad w_j`,
//! from the coordinates of the cage without inner controls, is the Jacobian of the cage's motion at the joint. `R`
//! belongs to the bone. The cage and the previous bone of the polyline predict a direction of the bone; `R` is the
//! smallest rotation from the predicted to the posed direction, so that the bone does not roll. If one affine map moves
//! all controls, `F` is the matrix of that map and `R` the identity.

use std::borrow::Cow;

use glam::{DMat3, DQuat, DVec3, Vec3};
use serde::{Deserialize, Serialize};

use crate::weights::Weights;

/// Shares of a rest vector that are smaller than this times the largest share are dropped.
const MIN_SHARE: f64 = 1e-3;

/// First column of the matrix of the whole cage's motion, counted from the first frame column.
pub(crate) const CAGE_COLUMN: usize = 3;
/// First column of the first hold, counted from the first frame column.
const HOLD_COLUMN: usize = 6;

/// Columns of a bind's weights that follow those of its controls.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct Frames {
    /// Contribution of each cage vertex to the matrix of the whole cage's motion, per object unit; empty without
    /// frames. `[n_cage]`
    pub whole: Vec<[f32; 3]>,
    /// The control of each joint. `[n_joints]`
    pub joints: Vec<u32>,
    /// The two joints of each bone, as indices into `joints`; bones of a line are consecutive. `[n_bones]`
    pub bones: Vec<[u32; 2]>,
    /// Weights of the cage vertices at each joint in the cage without inner controls, and their gradients (per object
    /// unit). `[n_joints, n_cage]`
    pub plain: Vec<[f32; 4]>,
}

impl Frames {
    /// Creates frames without holds, for a cage with its vertices at `rest`, object units.
    #[must_use]
    pub fn of_cage(rest: &[Vec3]) -> Self {
        let rest = || rest.iter().map(|p| p.as_dvec3());
        let mean = rest().sum::<DVec3>() / rest().count() as f64;
        // The sum |A (c - mean) - (c' - mean')|^2 is least for A = (sum c' (c - mean)^T) M^-1, with
        // M = sum (c - mean) (c - mean)^T.
        let spread = rest().map(|c| c - mean).map(|d| DMat3::from_cols(d * d.x, d * d.y, d * d.z));
        let inverse = spread.fold(DMat3::ZERO, |sum, one| sum + one).inverse();
        Self {
            whole: rest().map(|c| (inverse * (c - mean)).as_vec3().to_array()).collect(),
            ..Self::default()
        }
    }

    /// Whether the weights have columns of frames.
    #[must_use]
    pub fn is_used(&self) -> bool {
        !self.whole.is_empty()
    }

    /// Whether the sizes and indices of deserialised frames match this many controls.
    #[must_use]
    pub fn fits(&self, n_controls: usize) -> bool {
        let n = self.joints.len();
        let of_cage = self.plain.len().checked_div(n).unwrap_or(0);
        of_cage * n == self.plain.len()
            && self.whole.len() <= n_controls
            && (n == 0 || of_cage == self.whole.len())
            && self.joints.iter().all(|&c| (c as usize) < n_controls)
            && self.bones.iter().flatten().all(|&j| (j as usize) < n)
            && self.plain.iter().flatten().chain(self.whole.iter().flatten()).all(|x| x.is_finite())
    }

    /// Number of columns of the frames; 0 without frames.
    #[must_use]
    pub fn n_columns(&self) -> usize {
        if self.is_used() { HOLD_COLUMN + 3 * self.holds().count() } else { 0 }
    }

    /// All holds as pairs of a joint and a bone that ends at the joint; the bone is `None` if there is no such bone.
    fn holds(&self) -> impl Iterator<Item = (usize, Option<usize>)> {
        (0..self.joints.len()).flat_map(move |joint| {
            let of_joint = move |bone: &usize| self.bones[*bone].contains(&(joint as u32));
            let bones = (0..self.bones.len()).filter(of_joint);
            let alone = !self.bones.iter().flatten().any(|&j| j as usize == joint);
            alone.then_some((joint, None)).into_iter().chain(bones.map(move |bone| (joint, Some(bone))))
        })
    }

    /// Computes the vectors of all columns for controls at `controls` (`[n_controls]`, object units): the controls,
    /// then the frames.
    ///
    /// # Panics
    /// If there are fewer controls than these frames refer to.
    #[must_use]
    pub fn columns<'a>(&self, controls: &'a [Vec3]) -> Cow<'a, [Vec3]> {
        if !self.is_used() {
            return Cow::Borrowed(controls);
        }
        let mut columns = controls.to_vec();
        columns.extend(Vec3::AXES);
        let column = |axis: usize| {
            let of_vertex = |(g, c): (&[f32; 3], &Vec3)| f64::from(g[axis]) * c.as_dvec3();
            self.whole.iter().zip(controls).map(of_vertex).sum::<DVec3>().as_vec3()
        };
        columns.extend([0, 1, 2].map(column));
        let moved: Vec<(DVec3, DMat3)> = (0..self.joints.len()).map(|k| self.moved(k, controls)).collect();
        let turns = self.turns(&moved, controls);
        for (joint, bone) in self.holds() {
            let matrix = bone.map_or(DMat3::IDENTITY, |bone| turns[bone]) * moved[joint].1;
            columns.extend([matrix.x_axis, matrix.y_axis, matrix.z_axis].map(DVec3::as_vec3));
        }
        Cow::Owned(columns)
    }

    /// Computes the position of a joint moved by the cage alone, and the Jacobian of that motion.
    fn moved(&self, joint: usize, controls: &[Vec3]) -> (DVec3, DMat3) {
        let n = self.plain.len() / self.joints.len();
        let (mut at, mut matrix) = (DVec3::ZERO, DMat3::ZERO);
        for (row, c) in self.plain[joint * n..][..n].iter().zip(controls) {
            let (c, [w, x, y, z]) = (c.as_dvec3(), row.map(f64::from));
            at += w * c;
            matrix += DMat3::from_cols(x * c, y * c, z * c);
        }
        (at, matrix)
    }

    fn turns(&self, moved: &[(DVec3, DMat3)], controls: &[Vec3]) -> Vec<DMat3> {
        let mut turns: Vec<DMat3> = Vec::with_capacity(self.bones.len());
        for (number, [a, b]) in self.bones.iter().map(|bone| bone.map(|j| j as usize)).enumerate() {
            let meets = |bone: &[u32; 2]| bone.iter().any(|&j| [a, b].contains(&(j as usize)));
            let before = self.bones[..number].iter().position(meets).map_or(DMat3::IDENTITY, |k| turns[k]);
            let [from, to] = [a, b].map(|j| controls[self.joints[j] as usize].as_dvec3());
            let goes = before * (moved[b].0 - moved[a].0);
            turns.push(match (goes.try_normalize(), (to - from).try_normalize()) {
                (Some(goes), Some(posed)) => DMat3::from_quat(DQuat::from_rotation_arc(goes, posed)) * before,
                // A bone of zero length has no direction: use the rotation of an earlier bone that it meets.
                _ => before,
            });
        }
        turns
    }

    /// Folds the columns of the frames into the columns of the controls, for solvers whose unknowns are the controls.
    /// The result moves vertices as `weights` do while no bone rotates, except that it omits constant offsets.
    ///
    /// # Panics
    /// If `weights` has fewer columns than these frames.
    #[must_use]
    pub fn folded(&self, weights: &Weights) -> Weights {
        let n_controls = weights.n_columns() - self.n_columns();
        if !self.is_used() {
            return weights.clone();
        }
        let joints = self.hold_joints();
        let (mut indptr, mut all, mut data) = (vec![0], Vec::new(), Vec::new());
        for (indices, values) in weights.rows() {
            let entries = indices.iter().zip(values).map(|(&column, &x)| (column as usize, f64::from(x)));
            let row = self.fold(&joints, n_controls, entries);
            let stored = (0u32..).zip(row).filter(|(_, w)| *w != 0.0);
            stored.for_each(|(column, w)| {
                all.push(column);
                data.push(w as f32);
            });
            indptr.push(all.len() as u32);
        }
        Weights::from_parts(n_controls as u32, indptr, all, data)
    }

    /// Folds one row, `[n_columns]`, as [`Self::folded`] folds all. `[n_controls]`
    ///
    /// # Panics
    /// If `row` is shorter than the number of these frames' columns.
    #[must_use]
    pub fn folded_row(&self, row: &[f64]) -> Vec<f64> {
        self.fold(&self.hold_joints(), row.len() - self.n_columns(), row.iter().copied().enumerate())
    }

    /// Index of each hold's joint. `[n_holds]`
    fn hold_joints(&self) -> Vec<usize> {
        self.holds().map(|(joint, _)| joint).collect()
    }

    fn fold(
        &self,
        joints: &[usize],
        n_controls: usize,
        entries: impl Iterator<Item = (usize, f64)>,
    ) -> Vec<f64> {
        let n = self.plain.len().checked_div(self.joints.len()).unwrap_or(0);
        let mut row = vec![0.0; n_controls];
        for (column, x) in entries {
            match column.checked_sub(n_controls) {
                None => row[column] += x,
                Some(0..3) => {}
                Some(frame @ 3..HOLD_COLUMN) => {
                    self.whole.iter().zip(&mut row).for_each(|(s, w)| *w += x * f64::from(s[frame % 3]));
                }
                Some(frame) => {
                    let slopes = &self.plain[joints[(frame - HOLD_COLUMN) / 3] * n..][..n];
                    slopes.iter().zip(&mut row).for_each(|(s, w)| *w += x * f64::from(s[1 + frame % 3]));
                }
            }
        }
        row
    }

    /// Distributes a vertex's rest vector over the holds (see the module) in proportion to the vertex's `weights` for
    /// the joints. Calls `each(column, share)` with the hold's first column, counted from the first frame column.
    /// Shares sum to 1. Without weight at any joint, the matrix of the whole cage gets the share 1.
    ///
    /// Along a line, the share blends from bone to bone within about `radius` of the joint. `lengths`: rest lengths of
    /// the bones.
    pub(crate) fn shares(
        &self,
        weights: &[f64],
        lengths: &[f64],
        radius: f64,
        mut each: impl FnMut(usize, f64),
    ) {
        let total: f64 = weights.iter().sum();
        if total <= 0.0 {
            return each(CAGE_COLUMN, 1.0);
        }
        // Fourth power of the radius plus the vertex's distance from the joint along a bone. The distance is estimated
        // from the weight of the bone's other joint.
        let along = |joint: usize, bone: usize| {
            let [a, b] = self.bones[bone];
            let other = if a as usize == joint { b } else { a };
            (lengths[bone] * weights[other as usize] / total + radius).powi(4)
        };
        let share = |(joint, bone): (usize, Option<usize>)| {
            let of_joint = weights[joint] / total;
            bone.map_or(of_joint, |bone| {
                let of = (0..self.bones.len()).filter(|&k| self.bones[k].contains(&(joint as u32)));
                of_joint * along(joint, bone) / of.map(|k| along(joint, k)).sum::<f64>()
            })
        };
        let shares: Vec<f64> = self.holds().map(share).collect();
        let least = MIN_SHARE * shares.iter().copied().fold(0.0, f64::max);
        let kept: f64 = shares.iter().filter(|&&s| s > least).sum();
        for (hold, s) in shares.into_iter().enumerate().filter(|(_, s)| *s > least) {
            each(HOLD_COLUMN + 3 * hold, s / kept);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;

    /// Corners of a unit cube and a line of three joints in it, with trilinear coordinates.
    fn line() -> (Frames, Vec<Vec3>) {
        let cube = (0..8).map(|k| Vec3::new((k & 1) as f32, (k >> 1 & 1) as f32, (k >> 2) as f32));
        let joints = [0.2, 0.5, 0.8].map(|z| Vec3::new(0.5, 0.5, z));
        let controls: Vec<Vec3> = cube.chain(joints).collect();
        let row = |p: Vec3, corner: Vec3| {
            let factor = |a: usize| if corner[a] > 0.0 { p[a] } else { 1.0 - p[a] };
            let slope = |a: usize| (2.0 * corner[a] - 1.0) * factor((a + 1) % 3) * factor((a + 2) % 3);
            [factor(0) * factor(1) * factor(2), slope(0), slope(1), slope(2)]
        };
        let plain = joints.iter().flat_map(|&p| controls[..8].iter().map(move |&c| row(p, c))).collect();
        let frames = Frames {
            joints: vec![8, 9, 10],
            bones: vec![[0, 1], [1, 2]],
            plain,
            ..Frames::of_cage(&controls[..8])
        };
        (frames, controls)
    }

    /// Matrices of the constant offset, of the whole cage's motion, and of the holds.
    fn matrices(columns: &[Vec3]) -> Vec<DMat3> {
        let of = |c: &[Vec3]| DMat3::from_cols(c[0].as_dvec3(), c[1].as_dvec3(), c[2].as_dvec3());
        columns[11..].chunks_exact(3).map(of).collect()
    }

    #[test]
    fn an_affine_map_of_all_controls_is_the_matrix_of_each_hold() {
        let (frames, rest) = line();
        let matrix = DMat3::from_cols_array(&[1.2, 0.4, 0.1, -0.3, 0.9, 0.2, 0.5, -0.1, 1.1]);
        let posed: Vec<Vec3> = rest.iter().map(|p| (matrix * p.as_dvec3()).as_vec3() + 3.0).collect();
        let columns = frames.columns(&posed);
        assert_eq!((columns.len(), &columns[11..14]), (11 + frames.n_columns(), &Vec3::AXES[..]));
        // The first matrix is the constant offset; the whole cage and four holds follow.
        let holds = &matrices(&columns)[1..];
        assert_eq!(holds.len(), 5);
        for hold in holds {
            assert!(hold.abs_diff_eq(matrix, 2e-6), "{hold}");
        }
    }

    /// A bone bent at the middle joint rotates its own holds by the smallest rotation, and leaves those of the other
    /// bone unchanged.
    #[test]
    fn a_bent_bone_turns_by_the_smallest_rotation() {
        let (frames, rest) = line();
        for (way, degrees) in [(0.0_f32, 5.0_f32), (1.6, 20.0), (3.5, 60.0), (5.0, 120.0)] {
            let axis = Vec3::new(way.cos(), way.sin(), 0.0);
            let turn = Quat::from_axis_angle(axis, degrees.to_radians());
            let mut posed = rest.clone();
            posed[10] = rest[9] + turn * (rest[10] - rest[9]);
            let holds = &matrices(&frames.columns(&posed))[2..];
            let expected = DMat3::from_quat(turn.as_dquat());
            for (hold, expected) in holds.iter().zip([DMat3::IDENTITY, DMat3::IDENTITY, expected, expected]) {
                assert!(hold.abs_diff_eq(expected, 2e-6), "{degrees}: {hold}");
            }
        }
    }

    #[test]
    fn a_bone_inherits_the_rotation_of_the_previous_one() {
        let (frames, rest) = line();
        // The line rotates rigidly about z and x: the smallest rotation of the first bone also fits the second.
        let turn = Quat::from_rotation_z(1.0) * Quat::from_rotation_x(1.5);
        let mut posed = rest.clone();
        for k in 8..11 {
            posed[k] = rest[9] + turn * (rest[k] - rest[9]);
        }
        let holds = &matrices(&frames.columns(&posed))[2..];
        assert!(holds.iter().all(|hold| hold.abs_diff_eq(holds[0], 2e-6)), "{holds:?}");
    }

    #[test]
    fn shares_sum_to_one_and_pass_from_bone_to_bone_at_the_joint() {
        let (frames, _) = line();
        let of_bones = |weights: [f64; 3]| {
            let mut all = [0.0; 6];
            frames.shares(&weights, &[0.3, 0.3], 0.02, |column, share| all[column / 3] += share);
            assert!((all.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            // Columns: constant, whole cage, joint 0 with bone 0, joint 1 with both bones, joint 2 with bone 1.
            [all[1], all[2] + all[3], all[4] + all[5]]
        };
        assert_eq!(of_bones([0.0, 0.7, 0.0]), [0.0, 0.5, 0.5]);
        let beyond = of_bones([0.0, 0.4, 0.4]);
        assert!(beyond[2] > 0.98, "{beyond:?}");
        assert_eq!(of_bones([0.0; 3]), [1.0, 0.0, 0.0]);
    }
}
