//! Fits the joints of a rig to another figure.

use cagework_core::options::Choice;
use glam::{DQuat, DVec3};

use super::landmarks::{Landmarks, Limb, first_point, length};
use super::{Figure, chains_of};
use crate::humanoid::{Bone, N_BONES};

cagework_core::choice! {
    /// What the joints were fitted by.
    FitSource {
        /// Limbs of both figures.
        #[default]
        Limbs = "limbs",
        /// The boxes of both figures.
        Bounds = "bounds",
        /// Joints that the user gave.
        Given = "given",
    }
}

/// Result of a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Joints in the target.
    pub figure: Figure,
    /// Rotation about the vertical that turns the rig to face as the target does.
    pub turn: DQuat,
    /// What the joints were fitted by.
    pub source: FitSource,
}

impl Fit {
    /// Fits the joints of a rig to the box of a figure: they keep their places relative to the box, with one scale, the
    /// ratio of the heights. `from`, `to`: corners of the boxes of the rig's model and of the target, object units.
    #[must_use]
    pub fn by_bounds(rig: &Figure, from: [DVec3; 2], to: [DVec3; 2]) -> Self {
        let height = |[low, high]: [DVec3; 2]| high.y - low.y;
        let scale = height(to) / height(from).max(f64::MIN_POSITIVE);
        let foot = |[low, high]: [DVec3; 2]| low.midpoint(high).with_y(low.y);
        let map = |p: DVec3| foot(to) + scale * (p - foot(from));
        Self { figure: rig.mapped(&map), turn: DQuat::IDENTITY, source: FitSource::Bounds }
    }

    /// Fits the joints of a rig to the limbs of a figure.
    ///
    /// `from`: landmarks of the rig's own model at rest, and `to`: those of the target, both found in the same way, so
    /// that a model is fitted to itself exactly. Joints of the trunk keep their offsets from its middle, scaled, at
    /// heights that are linear between the ground, the crotch, the arms and the top. Joints of a limb keep their share
    /// of the way from its tip to its first joint, and their offset from the limb's line.
    #[must_use]
    pub fn by_limbs(rig: &Figure, from: &Landmarks, to: &Landmarks) -> Self {
        let turn = DQuat::from_rotation_arc(from.left, to.left);
        let aside = |bone: Bone| rig.at(bone).map(|p| from.aside(p).abs());
        let shoulders = [Bone::LeftUpperArm, Bone::RightUpperArm].map(|bone| aside(bone).unwrap_or_default());
        let reach = 0.5 * (shoulders[0] + shoulders[1]);
        let [crotch, arms] = [from.crotch(), from.arm_height(reach)];
        let mut scale = to.height() / from.height();
        let mut heights = Vec::new();
        for _ in 0..2 {
            let [crotch_to, arms_to] = [to.crotch(), to.arm_height(scale * reach)];
            heights = ascending([
                [from.bounds[0].y, to.bounds[0].y],
                [crotch, crotch_to],
                [arms, arms_to],
                [from.bounds[1].y, to.bounds[1].y],
            ]);
            let trunk = (arms_to - crotch_to) / (arms - crotch);
            if heights.len() == 4 && trunk.is_finite() {
                scale = trunk.clamp(0.5 * scale, 2.0 * scale);
            }
        }
        let forward = from.forward();
        let in_trunk = |p: DVec3| {
            let depth = (p - from.middle(p.y)).dot(forward);
            let height = interpolated(&heights, p.y);
            to.middle(height) + scale * (from.aside(p) * to.left + depth * to.forward())
        };
        let mut figure = rig.mapped(&in_trunk);
        for (side, (arm, leg)) in chains_of().into_iter().enumerate() {
            let own = |p: DVec3| from.aside(p).abs();
            let other = |p: DVec3| to.aside(p).abs();
            let first = rig.at(arm[0]).map_or(0.0, own);
            let starts = [
                first_point(&from.arms[side].line, &|p| own(p) - first),
                first_point(&to.arms[side].line, &|p| other(p) - scale * first),
            ];
            let ways = LimbMap::new(&from.arms[side], &to.arms[side], starts, (turn, scale));
            figure.place(rig, &arm, &|p| ways.map(p));
            let hip = rig.at(leg[0]).map_or(0.0, |p| p.y);
            let hip_to = interpolated(&heights, hip);
            let starts = [
                first_point(&from.legs[side].line, &|p| hip - p.y),
                first_point(&to.legs[side].line, &|p| hip_to - p.y),
            ];
            let ways = LimbMap::new(&from.legs[side], &to.legs[side], starts, (turn, scale));
            figure.place(rig, &leg, &|p| ways.map(p));
        }
        for (_, bone) in Bone::ALL {
            figure.ends[*bone as usize] = to.end(*bone);
        }
        Self { figure, turn, source: FitSource::Limbs }
    }

    /// Replaces joints by those that are given.
    #[must_use]
    pub fn with_joints(mut self, given: &Figure) -> Self {
        for k in 0..N_BONES {
            self.figure.joints[k] = given.joints[k].or(self.figure.joints[k]);
            self.figure.ends[k] = given.ends[k].or(self.figure.ends[k]);
        }
        Self { source: FitSource::Given, ..self }
    }
}

/// Rows whose two numbers ascend from row to row; rows between the ends that do not are left out.
fn ascending(rows: [[f64; 2]; 4]) -> Vec<[f64; 2]> {
    let [first, inner @ .., last] = rows;
    let mut kept = vec![first];
    for row in inner {
        let before = kept[kept.len() - 1];
        if (0..2).all(|k| before[k] < row[k] && row[k] < last[k]) {
            kept.push(row);
        }
    }
    kept.push(last);
    kept
}

/// Value of a function that is linear between rows of argument and value, and beyond them.
fn interpolated(rows: &[[f64; 2]], at: f64) -> f64 {
    let k = rows.partition_point(|row| row[0] <= at).clamp(1, rows.len() - 1);
    let [a, b] = [rows[k - 1], rows[k]];
    a[1] + (at - a[0]) / (b[0] - a[0]).max(f64::MIN_POSITIVE) * (b[1] - a[1])
}

/// Maps points near a limb of one figure to those near the same limb of another one.
struct LimbMap<'a> {
    from: &'a [DVec3],
    to: &'a [DVec3],
    /// Ratio of the lengths from the limb's first joint to its tip.
    ratio: f64,
    turn: DQuat,
    scale: f64,
}

impl<'a> LimbMap<'a> {
    /// `starts`: places of the first joint on the two lines.
    fn new(from: &'a Limb, to: &'a Limb, starts: [DVec3; 2], (turn, scale): (DQuat, f64)) -> Self {
        let way = |line: &[DVec3], start: DVec3| (length(line) - closest(line, start).1).max(1e-9);
        let ratio = way(&to.line, starts[1]) / way(&from.line, starts[0]);
        Self { from: &from.line, to: &to.line, ratio, turn, scale }
    }

    fn map(&self, p: DVec3) -> DVec3 {
        let (at, way, direction) = closest(self.from, p);
        let from_tip = length(self.from) - way;
        let (image, direction_to) = along(self.to, length(self.to) - self.ratio * from_tip);
        let bend = DQuat::from_rotation_arc(self.turn * direction, direction_to);
        image + self.scale * (bend * (self.turn * (p - at)))
    }
}

/// Closest point of a polyline, the length of the way to it, and the direction there.
fn closest(line: &[DVec3], p: DVec3) -> (DVec3, f64, DVec3) {
    let mut best = (DVec3::ZERO, 0.0, DVec3::Y);
    let (mut least, mut way) = (f64::INFINITY, 0.0);
    for pair in line.windows(2) {
        let by = pair[1] - pair[0];
        let share = ((p - pair[0]).dot(by) / by.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let at = pair[0] + share * by;
        if at.distance(p) < least {
            (least, best) = (at.distance(p), (at, way + share * by.length(), by.normalize_or(DVec3::Y)));
        }
        way += by.length();
    }
    best
}

/// Point of a polyline after a way from its start, and the direction there; beyond the ends on the line's continuation.
fn along(line: &[DVec3], mut way: f64) -> (DVec3, DVec3) {
    let mut last = (DVec3::ZERO, DVec3::Y, 0.0);
    for (k, pair) in line.windows(2).enumerate() {
        let by = pair[1] - pair[0];
        let (size, direction) = (by.length(), by.normalize_or(DVec3::Y));
        if way <= size || k + 2 == line.len() {
            last = (pair[0], direction, way);
            break;
        }
        way -= size;
    }
    (last.0 + last.2 * last.1, last.1)
}
