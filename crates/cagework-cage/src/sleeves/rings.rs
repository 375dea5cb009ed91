//! Choice of rings: cross-sections of limbs, and the places of the rings along them.

use glam::DVec3;

use super::Plan;
use super::limb::{Exit, Limb, Profile, rotated};
use super::starts::{MIN_HOLE, flipped, widened};

/// Number of places of a profile.
const N_PLACES: usize = 48;

/// Half the thickness of the slab of samples of a place.
const SLAB: f64 = 0.015;

/// Smallest distance between two rings of a sleeve.
const MIN_GAP: f64 = 0.04;

/// Distance below which rings that children need merge.
const MERGE_GAP: f64 = 0.03;

/// Gain of a ring at a joint between long bones; and the length from which a bone is long.
const JOINT_GAIN: f64 = 0.3;
const LONG_BONE: f64 = 0.12;

/// Factor of the gain of a ring at a joint of the trunk.
const TRUNK_JOINT: f64 = 0.3;

/// Gain of a ring per distance from its neighbours.
const SPACING_GAIN: f64 = 0.12;

/// Cosine between a limb and the side through which it leaves, below which a ring is placed where it turns; and the
/// distance of this ring from the start.
const TURN_COSINE: f64 = 0.6;
const TURN_AT: f64 = 0.02;

/// Share of the extents between neighbouring rings in the size of a ring; the rest are the extents at the ring.
const NEIGHBOUR_SHARE: f64 = 0.15;

/// Length of limbs outside their parents up to which they may merge into them.
const MAX_MERGED: f64 = 0.15;

/// Extents of a place of a limb that has no samples.
const EMPTY_EXTENT: f64 = 0.015;

/// A ring before its vertices are placed.
#[derive(Clone, Debug)]
pub(super) struct Ring {
    pub(super) limb: usize,
    /// Arc length along the limb.
    pub(super) s: f64,
    pub(super) center: DVec3,
    /// Unit vectors in the plane of the ring.
    pub(super) across: [DVec3; 2],
    /// Normal of the plane of the ring, along the limb.
    pub(super) along: DVec3,
    /// Smallest and largest coordinate along the first vector, then along the second.
    pub(super) extents: [f64; 4],
    /// Whether the ring is at a closed end of the sleeve.
    pub(super) is_end: bool,
    /// Whether the ring is its own mirror image, or that of another ring.
    pub(super) is_symmetric: bool,
    pub(super) vertices: Vec<u32>,
    /// Coordinates of the vertices: -1 and 1 stand for the smallest and the largest extent, 0 for the middle.
    pub(super) corners: Vec<[i8; 2]>,
}

impl Plan<'_> {
    /// Chooses the rings of all limbs. If the needed rings exceed the target, short limbs merge into their parents.
    ///
    /// # Errors
    /// Number of vertices needed, if limbs are too long to merge.
    pub(super) fn choose_rings(&mut self) -> Result<(), usize> {
        loop {
            for i in 0..self.limbs.len() {
                let has_six = |parent: usize| self.limbs[parent].is_hexagonal;
                self.limbs[i].is_hexagonal =
                    self.limbs[i].parent.is_none_or(|p| self.limbs[i].is_midline && has_six(p));
                self.measure_profile(i);
            }
            for i in 0..self.limbs.len() {
                self.need_rings(i);
            }
            self.find_segments();
            if self.n_vertices() <= self.target {
                break;
            }
            let is_leaf = |&i: &usize| self.limbs.iter().all(|limb| limb.parent != Some(i));
            let length = |i: usize| self.limbs[i].total() - self.limbs[i].first;
            let leaves = (1..self.limbs.len()).filter(is_leaf);
            let least = leaves.min_by(|&a, &b| length(a).total_cmp(&length(b)));
            let least = least.filter(|&i| length(i) < MAX_MERGED).ok_or_else(|| self.n_vertices())?;
            self.merge(least);
        }
        while let Some((i, s)) = self.best_ring() {
            let share = (s - self.limbs[i].first) / (self.limbs[i].total() - self.limbs[i].first);
            for j in self.with_image(i) {
                let limb = &mut self.limbs[j];
                limb.rings.push(if i == j { s } else { limb.first + share * (limb.total() - limb.first) });
                limb.rings.sort_by(f64::total_cmp);
            }
        }
        Ok(())
    }

    /// A limb, and its mirror image if both get the same rings.
    pub(super) fn with_image(&self, i: usize) -> Vec<usize> {
        std::iter::once(i).chain(self.limbs[i].mirror.filter(|_| self.limbs[i].is_symmetric)).collect()
    }

    fn n_vertices(&self) -> usize {
        let base = self.limbs[0].ring_size();
        base + self.limbs.iter().map(|limb| limb.rings.len() * limb.ring_size()).sum::<usize>()
    }

    /// Merges a limb, its descendants and their mirror images into the parents.
    pub(super) fn merge(&mut self, i: usize) {
        let mut gone = self.with_image(i);
        for k in 0..self.limbs.len() {
            if self.limbs[k].parent.is_some_and(|parent| gone.contains(&parent)) && !gone.contains(&k) {
                gone.push(k);
            }
        }
        gone.sort_unstable();
        for &k in gone.iter().rev() {
            let name = &self.limbs[k].name;
            self.notes.push(format!("{name} has no sleeve of its own: it lies in that of its parent"));
            self.remove(k, self.limbs[k].parent.unwrap_or(0));
        }
    }

    /// Gives a limb and its mirror image a common sleeve across the mirror plane.
    pub(super) fn fuse(&mut self, i: usize) {
        let Some(image) = self.limbs[i].mirror else { return };
        let is_symmetric = self.limbs[0].is_symmetric;
        let names = [i, image].map(|k| self.limbs[k].name.clone());
        self.notes.push(format!("{} and {} touch: they have one sleeve", names[0], names[1]));
        let limb = &mut self.limbs[i];
        limb.name = names.join(" and ");
        limb.at.iter_mut().for_each(|p| p.x = 0.0);
        limb.measure();
        (limb.is_midline, limb.is_symmetric, limb.mirror) = (true, is_symmetric, None);
        self.remove(image, i);
    }

    /// Removes a limb. The limb `into` takes its samples and children.
    fn remove(&mut self, k: usize, into: usize) {
        self.limbs.remove(k);
        let moved = |j: usize| if j > k { j - 1 } else { j };
        for sample in &mut self.samples {
            let limb = sample.limb as usize;
            sample.limb = moved(if limb == k { into } else { limb }) as u32;
        }
        for limb in &mut self.limbs {
            limb.parent = limb.parent.map(|parent| moved(if parent == k { into } else { parent }));
            limb.mirror = limb.mirror.filter(|&image| image != k).map(moved);
        }
    }

    /// Measures the extents of a limb's samples across its axis.
    fn measure_profile(&mut self, i: usize) {
        if let Some(image) = self.primary(i) {
            let mut profile = self.limbs[image].profile.clone();
            profile.along.iter_mut().chain(profile.across.as_flattened_mut()).for_each(|v| *v = flipped(*v));
            self.limbs[i].profile = profile;
            return;
        }
        let limb = &self.limbs[i];
        let (first, total) = (limb.first, limb.total());
        let step = (total - first) / (N_PLACES - 1) as f64;
        let at: Vec<f64> = (0..N_PLACES).map(|k| first + step * k as f64).collect();
        let reach = 0.012;
        let along: Vec<DVec3> = at.iter().map(|&s| limb.direction_within(s, 0.5 * reach, reach)).collect();
        let across = self.frames(i, &along);
        let mut extents =
            vec![[f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY]; N_PLACES];
        let mut counts = [0; N_PLACES];
        let centers: Vec<DVec3> = at.iter().map(|&s| limb.point(s)).collect();
        let width = SLAB;
        for sample in self.samples.iter().filter(|sample| sample.limb == i as u32) {
            let s = limb.project(sample.at).s;
            let place = |s: f64| {
                ((s - first) / step.max(f64::MIN_POSITIVE)).clamp(0.0, (N_PLACES - 1) as f64) as usize
            };
            for k in place(s - width)..=(place(s + width) + 1).min(N_PLACES - 1) {
                let is_last = k == N_PLACES - 1;
                if (s - at[k]).abs() < width || is_last && s > at[k] - 2.0 * width {
                    let [u, v] = across[k].map(|axis| axis.dot(sample.at - centers[k]));
                    let [a, b, c, d] = extents[k];
                    extents[k] = [a.min(u), b.max(u), c.min(v), d.max(v)];
                    counts[k] += 1;
                }
            }
        }
        // Places with too few samples take the extents of their neighbours.
        let good: Vec<usize> = (0..N_PLACES).filter(|&k| counts[k] >= 3).collect();
        let e = EMPTY_EXTENT;
        let filled = (0..N_PLACES).map(|k| {
            let next = good.partition_point(|&g| g < k);
            match (next.checked_sub(1).map(|p| good[p]), good.get(next).copied()) {
                (Some(a), Some(b)) => {
                    let share = (k - a) as f64 / (b - a) as f64;
                    [0, 1, 2, 3].map(|c| (1.0 - share) * extents[a][c] + share * extents[b][c])
                }
                (Some(a), None) | (None, Some(a)) => extents[a],
                (None, None) => [-e, e, -e, e],
            }
        });
        let extents = filled.collect();
        self.limbs[i].profile = Profile { at, along, across, extents };
    }

    /// Frames across a limb. Those of a limb are carried along it by the smallest rotations.
    fn frames(&self, i: usize, along: &[DVec3]) -> Vec<[DVec3; 2]> {
        let limb = &self.limbs[i];
        let Some(parent) = limb.parent.filter(|_| !limb.is_hexagonal) else {
            return along.iter().map(|&t| self.trunk_frame(t)).collect();
        };
        let reach = 0.012;
        let t = self.limbs[parent].direction_within(0.5 * (limb.hole[0] + limb.hole[1]), reach, reach);
        let [mut right, depth] = self.trunk_frame(t);
        let middle = limb.at.iter().map(|p| p.x).sum::<f64>() / limb.at.len() as f64;
        if !limb.is_midline && middle < 0.0 {
            right = -right;
        }
        let (mut frame, mut before) = match limb.exit {
            Exit::End => ([right, depth], t),
            Exit::Start => ([right, depth], -t),
            Exit::Side if limb.side.dot(right).abs() > limb.side.dot(depth).abs() => {
                ([depth, t], right * limb.side.dot(right).signum())
            }
            Exit::Side => ([right, t], depth * limb.side.dot(depth).signum()),
        };
        let carried = along.iter().map(|&t| {
            frame = rotated(frame, before, t);
            before = t;
            frame
        });
        carried.collect()
    }

    /// Finds the rings that a limb needs: its ends, both ends of each hole, the ring where it turns, and ankles.
    fn need_rings(&mut self, i: usize) {
        let (first, total) = (self.limbs[i].first, self.limbs[i].total());
        let mut marks = Vec::new();
        for child in self.limbs.iter_mut().filter(|c| c.parent == Some(i) && c.exit == Exit::Side) {
            let half = 0.5 * MIN_HOLE;
            let mut hole = child.hole.map(|s| s.max(first).min(total));
            if hole[1] - hole[0] < MIN_HOLE {
                let middle = (0.5 * (hole[0] + hole[1])).max(first + half).min(total - half);
                hole = widened([middle; 2], MIN_HOLE);
            }
            child.hole = hole;
            marks.extend(hole);
        }
        marks.sort_by(f64::total_cmp);
        let mut groups: Vec<Vec<f64>> = Vec::new();
        let gap = MERGE_GAP;
        for mark in marks {
            match groups.last_mut() {
                Some(group) if mark - group[group.len() - 1] < gap && mark - group[0] < 2.0 * gap => {
                    group.push(mark);
                }
                _ => groups.push(vec![mark]),
            }
        }
        let middles = groups.iter().map(|group| group.iter().sum::<f64>() / group.len() as f64);
        let mut rings: Vec<f64> =
            middles.filter(|s| (s - first).abs().min((s - total).abs()) > gap).collect();
        rings.push(total);
        let limb = &self.limbs[i];
        let is_leg = limb.exit == Exit::Start && self.is_biped && !limb.is_midline;
        let joints = &limb.lengths[1..limb.lengths.len() - 1];
        let ankle = joints.iter().rev().find(|&&s| s > first + 0.02 && total - s > 0.03);
        rings.extend(ankle.filter(|_| i > 0 && is_leg));
        let mut turn = None;
        if i > 0 && (limb.exit == Exit::Side || limb.is_midline && !self.is_biped) {
            let after = limb.direction_within(first + 0.03, 1e-3, 0.02);
            if after.dot(limb.side) < TURN_COSINE {
                let s = first + TURN_AT;
                rings.retain(|r| (r - s).abs() > 0.02);
                rings.push(s);
                turn = Some(s);
            }
        }
        rings.sort_by(f64::total_cmp);
        let limb = &mut self.limbs[i];
        (limb.needed, limb.rings, limb.turn) = (rings.clone(), rings, turn);
    }

    /// Finds the interval between needed rings through which each limb leaves its parent.
    fn find_segments(&mut self) {
        self.limbs.iter_mut().for_each(|limb| limb.blocked.clear());
        for i in 1..self.limbs.len() {
            let Some(parent) = self.limbs[i].parent.filter(|_| self.limbs[i].exit == Exit::Side) else {
                continue;
            };
            let hole = self.limbs[i].hole;
            let stops = self.limbs[parent].stops();
            let mut best = [0.0; 2];
            let mut most = f64::NEG_INFINITY;
            for pair in stops.windows(2) {
                let overlap = (pair[1].min(hole[1]) - pair[0].max(hole[0])).max(0.0);
                if overlap > most {
                    (best, most) = ([pair[0], pair[1]], overlap);
                }
            }
            self.limbs[i].segment = best;
            self.limbs[parent].blocked.push(best);
        }
    }

    /// Finds the additional ring with the largest gain per vertex that the target allows.
    fn best_ring(&self) -> Option<(usize, f64)> {
        let left = self.target.checked_sub(self.n_vertices())?;
        let mut best = None;
        let mut most = 0.0;
        for i in (0..self.limbs.len()).filter(|&i| self.primary(i).is_none()) {
            let cost = self.with_image(i).len() * self.limbs[i].ring_size();
            if cost > left {
                continue;
            }
            for (s, joint) in self.candidates(i) {
                let gain = self.gain(&self.limbs[i], s, joint) / cost as f64;
                if gain > most {
                    (best, most) = (Some((i, s)), gain);
                }
            }
        }
        best
    }

    /// Places at which a limb may get another ring, and how much each is a joint, 0 to 1.
    fn candidates(&self, i: usize) -> Vec<(f64, f64)> {
        let limb = &self.limbs[i];
        let stops = limb.stops();
        let places = limb.profile.at[1..N_PLACES - 1].iter().map(|&s| (s, 0.0));
        let joints = limb.lengths.windows(3).filter(|l| l[1] > limb.first).map(|l| {
            let shorter = (l[1] - l[0].max(limb.first)).min(l[2] - l[1]);
            let joint = (shorter / (LONG_BONE)).min(1.0).powf(1.5);
            (l[1], if i == 0 { TRUNK_JOINT * joint } else { joint })
        });
        let is_allowed = |&(s, _): &(f64, f64)| {
            let is_apart = stops.iter().all(|x| (s - x).abs() >= MIN_GAP);
            let is_blocked = limb.blocked.iter().any(|&[a, b]| a < s && s < b);
            let is_inside = |(origin, least): (DVec3, f64)| (limb.point(s) - origin).dot(limb.side) < least;
            let is_avoided = self
                .remedies
                .avoided
                .iter()
                .any(|&(id, share)| id == limb.id && (s - share * limb.total()).abs() < 0.05);
            let is_in_parent = i > 0 && limb.turn.is_none() && limb.beyond.is_some_and(is_inside);
            is_apart && !(is_blocked || is_in_parent || is_avoided)
        };
        places.chain(joints).filter(is_allowed).collect()
    }

    /// Misfit that a ring removes, and the gain of a joint.
    fn gain(&self, limb: &Limb, s: f64, joint: f64) -> f64 {
        let stops = limb.stops();
        let k = stops.partition_point(|&x| x < s).clamp(1, stops.len() - 1);
        let [a, b] = [stops[k - 1], stops[k]];
        let share = (s - a) / (b - a).max(1e-12);
        let [at_s, at_a, at_b] = [s, a, b].map(|x| limb.profile.extents_at(x));
        let misfit = (0..4).map(|c| (at_s[c] - (1.0 - share) * at_a[c] - share * at_b[c]).abs());
        let misfit = misfit.fold(0.0, f64::max);
        let bend = limb.point(s).distance(limb.point(a).lerp(limb.point(b), share));
        (misfit + bend + SPACING_GAIN * (s - a).min(b - s)) + JOINT_GAIN * joint
    }

    /// Computes the plane and the initial size of ring `j` of [`Limb::stops`].
    pub(super) fn ring(&self, i: usize, stops: &[f64], j: usize) -> Ring {
        let limb = &self.limbs[i];
        let s = stops[j];
        let is_end = j == stops.len() - 1 || i == 0 && j == 0;
        let reach = if is_end { 0.002 } else { 0.02 };
        let along = limb.direction_within(s, reach, reach);
        let k = limb.profile.nearest(s);
        let across = rotated(limb.profile.across[k], limb.profile.along[k], along);
        let center = limb.point(s);
        // Symmetric legs have a symmetric crotch, also if they carry an asymmetric trunk.
        let is_leg = |limb: &Limb| limb.exit == Exit::Start && limb.mirror.is_some() && limb.is_symmetric;
        let is_crotch = || i == 0 && j == 0 && self.limbs.iter().any(is_leg);
        let mut ring = Ring {
            limb: i,
            s,
            center,
            across,
            along,
            extents: [0.0; 4],
            is_end,
            is_symmetric: limb.is_symmetric || is_crotch(),
            vertices: Vec::new(),
            corners: Vec::new(),
        };
        let padding = [-self.clearance, self.clearance, -self.clearance, self.clearance];
        if limb.turn == Some(s) {
            // The ring lies in the plane that bisects the angle between the parent's side and the limb.
            let between = (along + limb.side).normalize_or(along);
            ring.across = rotated(across, along, between);
            ring.along = between;
            let near = self.samples_near(i, &ring, 0.03);
            if near.len() >= 4 {
                let r = 0.12;
                let range = |axis: usize| {
                    let x = || near.iter().map(|q| q.dot(ring.across[axis]));
                    [x().fold(f64::INFINITY, f64::min).max(-r), x().fold(f64::NEG_INFINITY, f64::max).min(r)]
                };
                let ([a, b], [c, d]) = (range(0), range(1));
                ring.extents = [a + padding[0], b + padding[1], c + padding[2], d + padding[3]];
                return ring;
            }
        }
        let low = 0.5 * (stops[j.saturating_sub(1)] + s);
        let high = 0.5 * (stops[(j + 1).min(stops.len() - 1)] + s);
        let mut around = limb.profile.extents[k];
        for (x, e) in limb.profile.at.iter().zip(&limb.profile.extents) {
            if (low..=high).contains(x) {
                around = [around[0].min(e[0]), around[1].max(e[1]), around[2].min(e[2]), around[3].max(e[3])];
            }
        }
        let own = limb.profile.extents_at(s);
        ring.extents =
            [0, 1, 2, 3].map(|c| (1.0 - NEIGHBOUR_SHARE) * own[c] + NEIGHBOUR_SHARE * around[c] + padding[c]);
        ring
    }

    /// Samples of limb `i` near the plane of a ring, relative to its centre.
    fn samples_near(&self, i: usize, ring: &Ring, reach: f64) -> Vec<DVec3> {
        let own = self.samples.iter().filter(|sample| sample.limb == i as u32);
        own.map(|sample| sample.at - ring.center).filter(|q| q.dot(ring.along).abs() < reach).collect()
    }
}
