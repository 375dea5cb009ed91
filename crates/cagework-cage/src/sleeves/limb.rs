//! A chain of the skeleton while its sleeve is planned.

use glam::DVec3;

/// Where a limb leaves its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Exit {
    /// Through the quads that close the start of the parent's sleeve.
    Start,
    /// Through the quads that close the end of the parent's sleeve.
    End,
    /// Through a side of the parent's sleeve.
    Side,
}

/// A chain with the places of its rings. The mirror plane is a plane of constant x.
#[derive(Clone, Debug)]
pub(super) struct Limb {
    pub(super) name: String,
    /// Identifies the limb in all attempts: the index of its chain, or a number beyond the chains.
    pub(super) id: usize,
    /// Joints from the trunk outwards. `[n_joints]`, at least two.
    pub(super) at: Vec<DVec3>,
    /// Arc length at each joint. `[n_joints]`
    pub(super) lengths: Vec<f64>,
    /// Bones of the first and of the last joint.
    pub(super) bones: Option<[u32; 2]>,
    pub(super) parent: Option<usize>,
    pub(super) mirror: Option<usize>,
    pub(super) is_midline: bool,
    pub(super) is_symmetric: bool,
    /// Whether rings have six vertices, of which two lie on the mirror plane.
    pub(super) is_hexagonal: bool,
    pub(super) exit: Exit,
    /// Arc length at which the limb leaves its parent.
    pub(super) first: f64,
    /// Unit vector along which the limb leaves its parent.
    pub(super) side: DVec3,
    /// Arc lengths of the parent between which the limb leaves it through a side.
    pub(super) hole: [f64; 2],
    /// A point of the parent's axis and the distance from it along `side` beyond which rings lie outside the parent.
    pub(super) beyond: Option<(DVec3, f64)>,
    pub(super) profile: Profile,
    /// Arc lengths of the rings, ascending, without the ring of the base.
    pub(super) rings: Vec<f64>,
    /// The rings that may not be left out, a subset of `rings`.
    pub(super) needed: Vec<f64>,
    /// Intervals of this limb's sleeve through which children leave. Rings do not lie inside.
    pub(super) blocked: Vec<[f64; 2]>,
    /// The interval of the parent's sleeve through which this limb leaves.
    pub(super) segment: [f64; 2],
    /// Arc length of the ring at which the limb turns from `side` into its own direction.
    pub(super) turn: Option<f64>,
}

/// Cross-sections of a limb's part of the model, at regular places along the limb.
#[derive(Clone, Debug, Default)]
pub(super) struct Profile {
    /// Arc lengths. `[n_places]`
    pub(super) at: Vec<f64>,
    /// Directions of the limb. `[n_places]`
    pub(super) along: Vec<DVec3>,
    /// Two unit vectors across the limb. `[n_places]`
    pub(super) across: Vec<[DVec3; 2]>,
    /// Smallest and largest coordinate along the first vector, then along the second. `[n_places]`
    pub(super) extents: Vec<[f64; 4]>,
}

impl Profile {
    /// Interpolates the extents linearly.
    pub(super) fn extents_at(&self, s: f64) -> [f64; 4] {
        let (Some(first), Some(last)) = (self.at.first(), self.at.last()) else { return [0.0; 4] };
        let place = (s - first) / (last - first).max(f64::MIN_POSITIVE) * (self.at.len() - 1) as f64;
        let place = place.clamp(0.0, (self.at.len() - 1) as f64);
        let k = (place as usize).min(self.at.len().saturating_sub(2));
        let share = place - k as f64;
        let next = (k + 1).min(self.at.len() - 1);
        [0, 1, 2, 3].map(|c| (1.0 - share) * self.extents[k][c] + share * self.extents[next][c])
    }

    /// Index of the place closest to an arc length.
    pub(super) fn nearest(&self, s: f64) -> usize {
        (0..self.at.len())
            .min_by(|&a, &b| (self.at[a] - s).abs().total_cmp(&(self.at[b] - s).abs()))
            .unwrap_or(0)
    }
}

/// Arc length of a point's projection onto a limb, and its distance from the limb.
#[derive(Clone, Copy, Debug)]
pub(super) struct Projection {
    pub(super) s: f64,
    pub(super) distance: f64,
}

impl Limb {
    /// Creates a limb from joints, of which there must be at least two.
    pub(super) fn new(name: String, id: usize, at: Vec<DVec3>) -> Self {
        let mut limb = Self {
            name,
            id,
            lengths: Vec::new(),
            at,
            bones: None,
            parent: None,
            mirror: None,
            is_midline: false,
            is_symmetric: false,
            is_hexagonal: false,
            exit: Exit::Side,
            first: 0.0,
            side: DVec3::ZERO,
            hole: [0.0; 2],
            beyond: None,
            profile: Profile::default(),
            rings: Vec::new(),
            needed: Vec::new(),
            blocked: Vec::new(),
            segment: [0.0; 2],
            turn: None,
        };
        limb.measure();
        limb
    }

    /// Computes the arc lengths after joints have changed.
    pub(super) fn measure(&mut self) {
        let steps = self.at.windows(2).map(|p| p[0].distance(p[1]));
        let mut sum = 0.0;
        self.lengths = std::iter::once(0.0)
            .chain(steps.map(|step| {
                sum += step;
                sum
            }))
            .collect();
    }

    /// Length of the whole chain.
    pub(super) fn total(&self) -> f64 {
        self.lengths.last().copied().unwrap_or(0.0)
    }

    /// Index of the joint at which the bone at an arc length starts.
    fn bone_at(&self, s: f64) -> usize {
        self.lengths.partition_point(|&l| l <= s).clamp(1, self.at.len() - 1) - 1
    }

    /// Point at an arc length; the first and the last bone extend beyond their joints.
    pub(super) fn point(&self, s: f64) -> DVec3 {
        let i = self.bone_at(s);
        let length = (self.lengths[i + 1] - self.lengths[i]).max(1e-12);
        self.at[i] + (self.at[i + 1] - self.at[i]) * ((s - self.lengths[i]) / length)
    }

    /// Direction of the chord from `s - reach` to `s + reach`.
    pub(super) fn direction(&self, s: f64, reach: f64) -> DVec3 {
        (self.point(s + reach) - self.point(s - reach)).normalize_or(DVec3::Y)
    }

    /// Direction near an arc length, at least `margin` from both ends.
    pub(super) fn direction_within(&self, s: f64, margin: f64, reach: f64) -> DVec3 {
        self.direction(s.min(self.total() - margin).max(margin), reach)
    }

    /// Projects a point onto the chain, whose first and last bone are extended.
    pub(super) fn project(&self, point: DVec3) -> Projection {
        let mut best = Projection { s: 0.0, distance: f64::INFINITY };
        let last = self.at.len() - 2;
        for i in 0..=last {
            let (from, bone) = (self.at[i], self.at[i + 1] - self.at[i]);
            let mut share = (point - from).dot(bone) / bone.length_squared().max(1e-20);
            if i > 0 {
                share = share.max(0.0);
            }
            if i < last {
                share = share.min(1.0);
            }
            let distance = point.distance(from + share * bone);
            if distance < best.distance {
                best = Projection { s: self.lengths[i] + share * bone.length(), distance };
            }
        }
        best
    }

    /// Arc lengths of all rings, starting with the base.
    pub(super) fn stops(&self) -> Vec<f64> {
        let mut stops: Vec<f64> = std::iter::once(self.first).chain(self.rings.iter().copied()).collect();
        stops.sort_by(f64::total_cmp);
        stops.dedup();
        stops
    }

    /// Number of vertices of each ring.
    pub(super) fn ring_size(&self) -> usize {
        if self.is_hexagonal { 6 } else { 4 }
    }
}

/// Rotates vectors by the smallest rotation that takes the direction `from` to the direction `to`.
pub(super) fn rotated(vectors: [DVec3; 2], from: DVec3, to: DVec3) -> [DVec3; 2] {
    let turn = glam::DQuat::from_rotation_arc(from.normalize_or(DVec3::Y), to.normalize_or(DVec3::Y));
    vectors.map(|v| turn * v)
}

/// Quantile with linear interpolation; `None` if there are no values.
pub(super) fn quantile(values: impl Iterator<Item = f64>, share: f64) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let place = share * values.len().checked_sub(1)? as f64;
    let k = place as usize;
    let next = (k + 1).min(values.len() - 1);
    Some(values[k] + (place - k as f64) * (values[next] - values[k]))
}
