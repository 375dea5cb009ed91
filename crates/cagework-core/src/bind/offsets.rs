//! Offsets: parts of positions that the weights do not reproduce, for points outside the cage and around balls and
//! tubes. [`Frames`] carry them.

use glam::{DVec3, Vec3};

use crate::assemble::AssembledWeights;
use crate::controls::{Controls, InnerControls, InnerElement};
use crate::frames::{CAGE_COLUMN, Frames};
use crate::sample::Stencils;
use crate::solve::rows::{LANES, Row};
use crate::weights::Weights;

/// Offsets shorter than this fraction of the cage's diagonal are rounding errors and are dropped.
const MIN_OFFSET: f64 = 1e-7;

pub(super) struct Offsets<'a> {
    controls: Controls<'a>,
    /// Points outside the cage: index, share of the cage's motion that the point follows, and sampled row,
    /// `[n_batches]`.
    outside: Vec<(u32, f64, Vec<Row>)>,
    frames: Frames,
    /// Rest lengths of the bones, object units.
    lengths: Vec<f64>,
    radius: f64,
}

impl<'a> Offsets<'a> {
    /// Collects the points that may have offsets, and the frames. `blocks`: sampled values, `[n_batches][n_points]`.
    /// `joints`: joints of balls and tubes, if any, and weights of their points.
    pub(super) fn new(
        controls: Controls<'a>,
        stencils: &Stencils,
        blocks: &[Vec<Row>],
        joints: Option<(JointPoints<'_>, Weights)>,
    ) -> Self {
        let outside = stencils.outside.iter().filter(|o| !o.is_held);
        let row = |point: u32| blocks.iter().map(|block| block[point as usize]).collect();
        let outside = outside.map(|o| (o.vertex, o.share, row(o.vertex))).collect();
        let mut all = Self { controls, outside, frames: Frames::default(), lengths: Vec::new(), radius: 0.0 };
        if let Some((joints, weights)) = joints {
            all.radius = f64::from(joints.radius);
            all.frames = joints.frames(controls, &weights);
            let at = |joint: u32| controls.rest()[all.frames.joints[joint as usize] as usize];
            let length = |&[a, b]: &[u32; 2]| f64::from(at(a).distance(at(b)));
            all.lengths = all.frames.bones.iter().map(length).collect();
        } else if !all.outside.is_empty() {
            all.frames = Frames::of_cage(controls.cage().positions());
        }
        all
    }

    /// Appends the frames' columns to the rows, and returns the frames. `has_offset`: as in `assemble`.
    pub(super) fn add_to(
        self,
        rows: AssembledWeights,
        points: &[Vec3],
        has_offset: impl Fn(usize) -> bool,
    ) -> (AssembledWeights, Frames) {
        let AssembledWeights { weights, mut facts } = rows;
        if !self.frames.is_used() {
            return (AssembledWeights { weights, facts }, self.frames);
        }
        let n_controls = weights.n_columns();
        let columns = self.frames.columns(self.controls.rest());
        let diagonal = f64::from(self.controls.surface().diagonal());
        let n_columns = columns.len() as u32;
        let mut made = Weights::with_room(n_columns, points.len(), weights.data().len());
        let mut outside = self.outside.iter().peekable();
        for (v, (point, facts)) in points.iter().zip(&mut facts).enumerate() {
            let (indices, data) = weights.row(v);
            let mut row: Vec<(u32, f32)> = indices.iter().copied().zip(data.iter().copied()).collect();
            let beyond = outside.next_if(|(point, ..)| *point as usize == v);
            if let Some((_, _, sampled)) = beyond {
                let values = (0..n_controls).map(|c| (c as u32, sampled[c / LANES][c % LANES]));
                row = values.filter(|(_, w)| *w != 0.0).collect();
                (facts.low, facts.high) = (f32::INFINITY, 0.0);
            }
            if has_offset(v) {
                let expected = beyond.map_or(1.0, |(_, share, _)| *share);
                let sum: f64 = row.iter().map(|(_, w)| f64::from(*w)).sum();
                row.iter_mut().for_each(|(_, w)| *w = (f64::from(*w) * expected / sum) as f32);
                facts.sum_error = 0.0;
                let place = |row: &[(u32, f32)]| -> DVec3 {
                    row.iter().map(|&(c, w)| f64::from(w) * columns[c as usize].as_dvec3()).sum()
                };
                let point = point.as_dvec3();
                let rest = point - place(&row);
                let mut put = |column: usize, offset: DVec3| {
                    let column = (n_controls + column) as u32;
                    let entries = (column..).zip(offset.to_array());
                    row.extend(entries.map(|(c, x)| (c, x as f32)).filter(|(_, x)| *x != 0.0));
                };
                if let Some((_, share, _)) = beyond {
                    let stays = (1.0 - share) * point;
                    put(0, stays);
                    put(CAGE_COLUMN, rest - stays);
                } else if rest.length() <= MIN_OFFSET * diagonal {
                    put(CAGE_COLUMN, rest);
                } else {
                    let weights = self.of_joints(indices, data);
                    let put = |column: usize, share: f64| put(column, share * rest);
                    self.frames.shares(&weights, &self.lengths, self.radius, put);
                }
                facts.error = Some((place(&row).distance(point) / diagonal) as f32);
            }
            let (indices, data): (Vec<u32>, Vec<f32>) = row.into_iter().unzip();
            made.append(&Weights::from_parts(n_columns, vec![0, indices.len() as u32], indices, data));
        }
        (AssembledWeights { weights: made, facts }, self.frames)
    }

    fn of_joints(&self, indices: &[u32], data: &[f32]) -> Vec<f64> {
        let of =
            |control: &u32| indices.iter().position(|c| c == control).map_or(0.0, |k| f64::from(data[k]));
        self.frames.joints.iter().map(of).collect()
    }
}

/// Joints of balls and tubes, where the coordinates of the cage without inner controls and their gradients are needed.
pub(super) struct JointPoints<'a> {
    inner: &'a InnerControls,
    /// Indices of the joints among the inner controls.
    joints: Vec<u32>,
    radius: f32,
}

impl<'a> JointPoints<'a> {
    /// Collects the joints of all balls and tubes. `None` if there are no balls and tubes.
    pub(super) fn new(controls: Controls<'a>) -> Option<Self> {
        let inner = controls.inner().filter(|inner| inner.has_radius())?;
        let joints = (0..inner.positions.len()).filter(|&i| inner.is_rounded(i)).map(|i| i as u32).collect();
        Some(Self { inner, joints, radius: controls.inner_radius()? })
    }

    /// Returns each joint, followed by the six points around it, at the distance of the radius, for central
    /// differences. `[7 * n_joints]`
    pub(super) fn points(&self) -> Vec<Vec3> {
        let steps = Vec3::AXES.map(|axis| self.radius * axis);
        let around = |at: Vec3| {
            [at, at + steps[0], at - steps[0], at + steps[1], at - steps[1], at + steps[2], at - steps[2]]
        };
        self.joints.iter().flat_map(|&j| around(self.inner.positions[j as usize])).collect()
    }

    /// Builds the frames from the weights of [`Self::points`] in the cage without inner controls.
    fn frames(self, controls: Controls<'_>, weights: &Weights) -> Frames {
        let Self { inner, joints, radius } = self;
        let number = |i: u32| joints.partition_point(|&j| j < i) as u32;
        let lines = inner.elements.iter().filter(|e| matches!(e, InnerElement::Line(_)));
        let bones: Vec<[u32; 2]> =
            lines.flat_map(|e| e.corners().windows(2)).map(|w| [number(w[0]), number(w[1])]).collect();
        let n_cage = controls.cage().n_vertices();
        let dense = |row: usize| {
            let mut dense = vec![0.0; n_cage];
            let (columns, values) = weights.row(row);
            let of_cage = columns.iter().zip(values).filter(|(c, _)| (**c as usize) < n_cage);
            of_cage.for_each(|(&c, &w)| dense[c as usize] = w);
            dense
        };
        let mut plain = Vec::with_capacity(joints.len() * n_cage);
        for joint in 0..joints.len() {
            let rows: [Vec<f32>; 7] = std::array::from_fn(|k| dense(7 * joint + k));
            let slope =
                |axis: usize, c: usize| (rows[1 + 2 * axis][c] - rows[2 + 2 * axis][c]) / (2.0 * radius);
            plain.extend((0..n_cage).map(|c| [rows[0][c], slope(0, c), slope(1, c), slope(2, c)]));
        }
        let joints = joints.iter().map(|j| n_cage as u32 + j).collect();
        Frames { joints, bones, plain, ..Frames::of_cage(controls.cage().positions()) }
    }
}
