//! Where sleeves start: the ends of the trunk, and the places at which limbs leave their parents.

use glam::DVec3;

use super::Plan;
use super::limb::{Exit, Limb, quantile};

/// Distance of a limb's rings from its parent's surface.
const BEYOND: f64 = 0.02;

/// Smallest cosine between a limb and the end of its parent's sleeve through which it may leave; and that of a tail.
const END_COSINE: f64 = 0.5;
const TAIL_COSINE: f64 = 0.2;

/// Largest distance of a limb's first joint from the end of its parent's sleeve through which it may leave, as a share
/// of the diagonal; and that of a tail.
const END_REACH: f64 = 0.12;
const TAIL_REACH: f64 = 0.2;

/// A first bone shorter than this share of the next bone, such as a collar bone, lies inside the parent.
const MAX_INNER_RATIO: f64 = 0.6;

/// Number of places along a limb at which its distance from its parent is computed.
const N_PLACES: usize = 200;

/// Smallest length of a hole in a parent's sleeve.
pub(super) const MIN_HOLE: f64 = 0.04;

/// Smallest number of samples of a part below the crotch that gets a sleeve of its own.
const MIN_CAPE: usize = 8;

impl Plan<'_> {
    /// Moves the ends of the trunk, finds where limbs start, and assigns samples before these places to the parents.
    pub(super) fn start(&mut self) {
        if self.is_biped {
            self.find_crotch();
        } else {
            self.find_rump();
        }
        for i in 1..self.limbs.len() {
            match self.primary(i) {
                Some(image) => self.copy_start(image, i),
                None => self.find_start(i),
            }
        }
        if self.is_biped {
            self.add_capes();
        }
        for i in 1..self.limbs.len() {
            let (limb, parent) = (&self.limbs[i], self.limbs[i].parent.unwrap_or(0) as u32);
            for sample in self.samples.iter_mut().filter(|sample| sample.limb == i as u32) {
                if limb.project(sample.at).s < limb.first {
                    sample.limb = parent;
                }
            }
        }
        let dropped = &self.remedies.dropped;
        while let Some(i) = (1..self.limbs.len()).find(|&i| dropped.contains(&self.limbs[i].id)) {
            self.merge(i);
        }
    }

    /// Returns the mirror image of limb `i` if its start, profile and rings are copied from that image.
    pub(super) fn primary(&self, i: usize) -> Option<usize> {
        self.limbs[i].mirror.filter(|&image| image < i && self.limbs[i].is_symmetric)
    }

    fn copy_start(&mut self, image: usize, i: usize) {
        let from = self.limbs[image].clone();
        let limb = &mut self.limbs[i];
        limb.at = from.at.iter().map(|&p| flipped(p)).collect();
        limb.measure();
        (limb.exit, limb.first, limb.hole) = (from.exit, from.first, from.hole);
        limb.side = flipped(from.side);
        limb.beyond = from.beyond.map(|(p, distance)| (flipped(p), distance));
    }

    fn samples_of(&self, limb: usize) -> impl Iterator<Item = DVec3> {
        self.samples.iter().filter(move |sample| sample.limb == limb as u32).map(|sample| sample.at)
    }

    /// Whether limb `i` leaves the trunk within `reach` of its first joint, off the mirror plane.
    fn is_leg(&self, i: usize, reach: f64) -> bool {
        let (limb, hips) = (&self.limbs[i], self.limbs[0].at[1]);
        limb.parent == Some(0) && !limb.is_midline && limb.at[0].distance(hips) < reach
    }

    /// Moves the start of the trunk to the crotch: the lowest point at which the surface of hips and thighs crosses the
    /// mirror plane.
    fn find_crotch(&mut self) {
        let trunk = &self.limbs[0];
        let hips = trunk.at[1];
        let along = (trunk.at[2] - hips).normalize_or(DVec3::Y);
        let is_down = |limb: &Limb| {
            let leg = limb.at[limb.at.len() - 1] - hips;
            leg.dot(along) < -0.5 * leg.length()
        };
        let legs: Vec<&Limb> =
            (1..self.limbs.len()).filter(|&i| self.is_leg(i, 0.1)).map(|i| &self.limbs[i]).collect();
        let legs: Vec<&Limb> = legs.into_iter().filter(|limb| is_down(limb)).collect();
        let first = |limb: &Limb| limb.bones.map(|bones| bones[0]);
        let depth = along.cross(DVec3::X);
        let radius = |bone: Option<u32>| {
            let own = self.samples.iter().filter(|sample| Some(sample.bone) == bone);
            own.map(|sample| (sample.at - hips).dot(depth).abs()).reduce(f64::max).unwrap_or(0.1)
        };
        let radius = legs.iter().map(|leg| radius(first(leg))).fold(f64::INFINITY, f64::min);
        let bones: Vec<u32> = legs.iter().copied().chain([trunk]).filter_map(first).collect();
        let is_near = |v: u32| bones.contains(&self.bone_of[v as usize]);
        let mut lowest = f64::INFINITY;
        for t in &self.model.triangles {
            for [a, b] in [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]
                .into_iter()
                .filter(|e| e.iter().all(|&v| is_near(v)))
            {
                let [p, q] = [a, b].map(|v| self.model.at[v as usize]);
                let [x, y] = [p.x, q.x];
                if x * y <= 0.0 && (x - y).abs() > 1e-12 {
                    let crossing = p + (q - p) * (x / (x - y)) - hips;
                    if crossing.dot(depth).abs() < 1.2 * radius {
                        lowest = lowest.min(crossing.dot(along));
                    }
                }
            }
        }
        let knees = legs.iter().map(|leg| (leg.at[2.min(leg.at.len() - 1)] - hips).dot(along));
        let knees = knees.fold(f64::NEG_INFINITY, f64::max);
        let lowest = if lowest.is_finite() { lowest } else { -0.03 };
        let lowest = lowest.max(0.9 * knees).min(-0.005);
        self.limbs[0].at[0] = hips + along * (lowest - self.clearance);
        self.limbs[0].measure();
    }

    /// Moves the start of the trunk of a four-legged model to the end of the body behind the hips.
    fn find_rump(&mut self) {
        let trunk = &mut self.limbs[0];
        let overall = (trunk.at[trunk.at.len() - 2] - trunk.at[1]).normalize_or(DVec3::Y);
        let slope = |at: &[DVec3]| (at[2] - at[1]).normalize_or_zero().dot(overall);
        // A hip joint below the spine is left out.
        while trunk.at.len() > 4 && slope(&trunk.at) < 0.75 {
            trunk.at.remove(1);
        }
        let hips = trunk.at[1];
        let along =
            if slope(&trunk.at) < 0.85 { overall } else { (trunk.at[2] - hips).normalize_or(overall) };
        trunk.measure();
        let near = (1..self.limbs.len()).filter(|&i| !self.limbs[i].is_midline);
        let near = near.filter(|&i| self.limbs[i].at[0].distance(hips) < 0.15);
        let bones: Vec<u32> =
            near.chain([0]).filter_map(|i| self.limbs[i].bones.map(|bones| bones[0])).collect();
        let own = self.samples.iter().filter(|sample| bones.contains(&sample.bone));
        let end = quantile(own.map(|sample| (sample.at - hips).dot(along)), 0.02).unwrap_or(-0.02);
        self.limbs[0].at[0] = hips + along * end.min(-0.01);
        self.limbs[0].measure();
    }

    /// Gives the parts of the trunk beyond the crotch, such as capes and tails without bones, sleeves of their own.
    fn add_capes(&mut self) {
        for sign in [1.0, -1.0] {
            let trunk = &self.limbs[0];
            let start = trunk.at[0];
            let along = (trunk.at[2] - start).normalize_or(DVec3::Y);
            let depth = sign * self.trunk_frame(along)[1];
            let is_low = |p: DVec3| {
                let q = p - start;
                q.dot(along) < -0.015 && q.dot(depth) > 0.0
            };
            let low: Vec<DVec3> = self.samples_of(0).filter(|&p| is_low(p)).map(|p| p - start).collect();
            let height = |share| quantile(low.iter().map(|q| q.dot(along)), share);
            let (Some(bottom), Some(lower), Some(upper)) = (height(0.0), height(0.15), height(0.7)) else {
                continue;
            };
            if low.len() < MIN_CAPE || !trunk.is_symmetric {
                continue;
            }
            let mean = |is_used: &dyn Fn(f64) -> bool| {
                let used: Vec<f64> =
                    low.iter().filter(|q| is_used(q.dot(along))).map(|q| q.dot(depth)).collect();
                used.iter().sum::<f64>() / used.len() as f64
            };
            let hem = start + along * (bottom - self.clearance) + depth * mean(&|h| h <= lower);
            let top = start + depth * mean(&|h| h >= upper);
            let joints = [trunk.point(0.06), top, hem].map(|p| p.with_x(0.0));
            let name = if sign < 0.0 { "cape" } else { "apron" };
            let id = self.n_chains + usize::from(sign < 0.0);
            if self.remedies.dropped.contains(&id) {
                self.give_to_legs(&is_low);
                continue;
            }
            let mut limb = Limb::new(name.to_owned(), id, joints.to_vec());
            (limb.parent, limb.is_midline, limb.is_symmetric) = (Some(0), true, trunk.is_symmetric);
            (limb.side, limb.first, limb.hole) = (depth, limb.lengths[1], [0.0, 0.08]);
            let index = self.limbs.len() as u32;
            self.limbs.push(limb);
            for sample in &mut self.samples {
                let q = sample.at - start;
                if sample.limb == 0 && q.dot(along) < -0.015 && q.dot(depth) > 0.0 {
                    sample.limb = index;
                }
            }
        }
    }

    /// Assigns samples of the trunk to the nearest leg.
    fn give_to_legs(&mut self, is_given: &dyn Fn(DVec3) -> bool) {
        let legs: Vec<usize> = (1..self.limbs.len())
            .filter(|&i| self.limbs[i].exit == Exit::Start && self.limbs[i].parent == Some(0))
            .collect();
        let limbs = &self.limbs;
        for sample in self.samples.iter_mut().filter(|sample| sample.limb == 0 && is_given(sample.at)) {
            let distance = |i: usize| limbs[i].project(sample.at).distance;
            let nearest = legs.iter().copied().min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
            sample.limb = nearest.map_or(0, |leg| leg as u32);
        }
    }

    /// Finds where a limb leaves its parent: through the end of the parent's sleeve, or through a side.
    fn find_start(&mut self, i: usize) {
        let limb = &self.limbs[i];
        let parent_index = limb.parent.unwrap_or(0);
        let parent = &self.limbs[parent_index];
        let is_trunk = parent_index == 0;
        let total = limb.total();
        let places: Vec<f64> = (0..N_PLACES).map(|k| total * k as f64 / (N_PLACES - 1) as f64).collect();
        let overall = (limb.at[limb.at.len() - 1] - limb.at[0]).normalize_or(DVec3::Y);
        let root = parent.project(limb.at[1]).s;
        let n = parent.at.len();
        let ends = [
            (Exit::Start, 0.0, parent.at[0] - parent.at[1], is_trunk && (self.is_biped || limb.is_midline)),
            (Exit::End, parent.total(), parent.at[n - 1] - parent.at[n - 2], !is_trunk),
        ];
        for (exit, end, outward, _) in ends.into_iter().filter(|end| end.3) {
            let outward = outward.normalize_or(DVec3::Y);
            let is_tail = exit == Exit::Start && !self.is_biped && limb.is_midline;
            let (reach, cosine) = if is_tail { (TAIL_REACH, TAIL_COSINE) } else { (END_REACH, END_COSINE) };
            if (root - end).abs() < reach && overall.dot(outward) > cosine {
                let is_past = |s: &f64| (limb.point(*s) - parent.point(end)).dot(outward) >= 0.0;
                let first = places.iter().copied().find(is_past).unwrap_or(0.0);
                let limb = &mut self.limbs[i];
                (limb.exit, limb.side, limb.first, limb.hole) = (exit, outward, first, [end; 2]);
                return;
            }
        }
        let lengths = &limb.lengths;
        let is_inner =
            lengths.len() > 3 && lengths[2] - lengths[1] < MAX_INNER_RATIO * (lengths[3] - lengths[2]);
        let inner = lengths[if is_inner { 2 } else { 1 }];
        let margin = 1e-3;
        let clamped = |s: f64, of: &Limb| s.max(0.0).min(of.total());
        let off = limb.point(inner) - parent.point(clamped(parent.project(limb.point(inner)).s, parent));
        let after = limb.direction_within(inner + 0.04, margin, margin);
        let side = 0.5 * off / off.length().max(0.03) + after;
        let along = parent.direction_within(root, margin, margin);
        let side = side.reject_from_normalized(along).normalize_or(along.any_orthonormal_vector());

        let around: Vec<DVec3> = self.samples_of(parent_index).collect();
        let centre = clamped(root, parent);
        let near = |p: &&DVec3| (parent.project(**p).s - centre).abs() < 0.06;
        let origin = parent.point(root);
        let height = |p: &DVec3| (*p - origin).dot(side);
        let reach = quantile(around.iter().filter(near).map(height), 0.9)
            .or_else(|| quantile(around.iter().map(height), 0.9))
            .unwrap_or_else(|| height(&limb.at[1]));
        let past = places.iter().copied().find(|&s| (limb.point(s) - origin).dot(side) >= 0.95 * reach);
        let cap = if lengths.len() > 2 { 0.9 * lengths[2] } else { 0.4 * total };
        let further = self.remedies.further.get(&limb.id).copied().unwrap_or(0.0);
        let first = (past.unwrap_or(cap).max(inner).min(cap.max(inner)) + further).min(0.6 * total);

        let own: Vec<DVec3> = self.samples_of(i).collect();
        let mut slab: Vec<(f64, f64, DVec3)> = Vec::new();
        for &p in &own {
            let projection = limb.project(p);
            slab.push(((projection.s - first).abs(), projection.distance, p));
        }
        slab.sort_by(|a, b| a.0.total_cmp(&b.0));
        let n_close = slab.partition_point(|x| x.0 < 0.03);
        slab.truncate(if n_close < 8 { 30 } else { n_close });
        let radius = quantile(slab.iter().map(|x| x.1), 0.5).unwrap_or(0.03);
        let centre = parent.project(limb.point(first)).s;
        let at_parent = || slab.iter().map(|x| parent.project(x.2).s);
        let low = quantile(at_parent(), 0.05).unwrap_or(root).max(centre - 1.6 * radius);
        let high = quantile(at_parent(), 0.95).unwrap_or(root).min(centre + 1.6 * radius);
        // A limb that leaves aslant needs a longer hole.
        let go = limb.direction_within(first + 0.04, margin, 0.02);
        let half = 1.1 * radius / go.dot(side).max(0.45);
        let hole = widened([low.min(centre - half), high.max(centre + 0.8 * half)], MIN_HOLE);
        let limb = &mut self.limbs[i];
        (limb.exit, limb.side, limb.first, limb.hole) = (Exit::Side, side, first, hole);
        limb.beyond = Some((origin, reach + BEYOND));
    }

    /// Unit vectors across the trunk: to the right as far as possible, and the other one.
    pub(super) fn trunk_frame(&self, along: DVec3) -> [DVec3; 2] {
        let right = DVec3::X.reject_from_normalized(along).normalize_or(along.any_orthonormal_vector());
        [right, along.cross(right)]
    }
}

/// Mirrors a point or a direction at the plane x = 0.
pub(super) fn flipped(p: DVec3) -> DVec3 {
    p.with_x(-p.x)
}

/// Widens an interval about its middle to a smallest length.
pub(super) fn widened([low, high]: [f64; 2], least: f64) -> [f64; 2] {
    if high - low >= least {
        return [low, high];
    }
    let middle = 0.5 * (low + high);
    [middle - 0.5 * least, middle + 0.5 * least]
}
