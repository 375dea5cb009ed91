//! Sizes of rings: the smallest change of the model's cross-sections that encloses the model.

use cagework_core::progress::Cancellation;
use glam::DVec3;

use super::Plan;
use super::base::Base;
use super::guard::{Faults, faults};
use super::limb::quantile;
use super::program::Constraints;
use super::samples::Sample;
use super::starts::flipped;

/// Number of linearisations of the constraints on rings, and of those on single vertices.
const RING_ROUNDS: usize = 24;
const FREE_ROUNDS: usize = 12;

/// Number of linearisations after points have been added.
const LATER_ROUNDS: usize = 6;

/// Rounds at the end that use closest points instead of rays.
const CLOSEST_ROUNDS: usize = 6;

/// Sweeps of the quadratic program per round.
const N_SWEEPS: usize = 150;

/// Largest change of an unknown in a round.
const MAX_STEP: f64 = 0.03;

/// Factor of the changes in the second half of the rounds.
const DAMPING: f64 = 0.6;

/// Rounds in a row with changes below [`QUIET_STEP`], after which rays, or the rounds of rings, end.
const QUIET_ROUNDS: usize = 2;
const QUIET_STEP: f64 = 2e-4;

/// Weights of the shift of rings along the limb: inside a limb, at its closed end, and at the crotch.
const SHIFT_WEIGHT: f64 = 4.0;
const END_WEIGHT: f64 = 1.0;
const CROTCH_WEIGHT: f64 = 40.0;

/// Share of a limb's width by which the origins of rays stay away from closed ends, so that rays meet the ends.
const CORE_MARGIN: f64 = 0.35;

/// Largest number of missed points that are added.
const MAX_MISSED: usize = 1000;

/// Share of the clearance that added points keep.
const MISSED_CLEARANCE: f64 = 0.3;

/// Attempts at undoing the moves of the vertices of faulty quads.
const UNDO_ATTEMPTS: usize = 6;

/// A point that must be inside, by at least its clearance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Target {
    pub(super) at: DVec3,
    pub(super) limb: usize,
    pub(super) clearance: f64,
    /// Stop of the limb after which the ray through the point starts, and the share of the next stop.
    stop: usize,
    share: f64,
}

/// Unknowns of a ring.
#[derive(Clone, Copy, Debug)]
pub(super) struct RingUnknowns {
    /// Unknowns of the smallest and the largest extent along the first vector. Both are the same unknown if the ring is
    /// symmetric: half the width.
    pub(super) u: [u32; 2],
    pub(super) v: [u32; 2],
    /// Extents of the middles of long sides.
    pub(super) middle: Option<[u32; 2]>,
    /// Shift along the limb.
    shift: u32,
}

/// A fit in progress. Positions of vertices are linear in the unknowns.
pub(super) struct Fit<'a> {
    pub(super) plan: &'a Plan<'a>,
    pub(super) base: Base,
    pub(super) targets: Vec<Target>,
    /// Quads that were closest to the targets in the previous round, as indices in `near`. `[n_targets]`
    pub(super) hints: Vec<usize>,
    /// Triangles of both cuts of all quads: two per quad and cut.
    pub(super) cuts: [Vec<[u32; 3]>; 2],
    /// Quads of each limb, its parent and its children. `[n_limbs]`
    pub(super) near: Vec<Vec<u32>>,
    pub(super) unknowns_of_ring: Vec<RingUnknowns>,
    /// Vertices that must stay on one side of a plane: `(vertex, normal, least coordinate along the normal)`.
    pub(super) halfspaces: Vec<(u32, DVec3, f64)>,
    /// Parts of different limbs that no plane separates, as indices of limbs.
    pub(super) unseparated: Vec<[usize; 2]>,
    /// Positions for unknowns of 0. `[n_vertices]`
    start: Vec<DVec3>,
    /// Derivatives of each vertex's position. `[n_vertices]`
    terms: Vec<Vec<(u32, DVec3)>>,
    q: Vec<f64>,
    inverse_weights: Vec<f64>,
    /// Whether the unknowns are those of single vertices.
    pub(super) is_free: bool,
}

impl<'a> Fit<'a> {
    pub(super) fn new(plan: &'a Plan<'a>, base: Base, samples: &[Sample]) -> Self {
        let n = plan.limbs.len();
        let mut cuts = [Vec::new(), Vec::new()];
        let mut near = vec![Vec::new(); n];
        for (k, quad) in base.quads.iter().enumerate() {
            let [a, b, c, d] = quad.corners;
            cuts[0].extend([[a, b, c], [a, c, d]]);
            cuts[1].extend([[a, b, d], [b, c, d]]);
            let own = quad.limb;
            let related = |&i: &usize| {
                i == own || plan.limbs[i].parent == Some(own) || plan.limbs[own].parent == Some(i)
            };
            (0..n).filter(related).for_each(|i| near[i].push(k as u32));
        }
        let mut fit = Self {
            plan,
            targets: Vec::new(),
            hints: Vec::new(),
            cuts,
            near,
            unknowns_of_ring: Vec::new(),
            halfspaces: Vec::new(),
            unseparated: Vec::new(),
            start: vec![DVec3::ZERO; base.positions.len()],
            terms: vec![Vec::new(); base.positions.len()],
            q: Vec::new(),
            inverse_weights: Vec::new(),
            is_free: false,
            base,
        };
        fit.name_unknowns();
        fit.targets = samples
            .iter()
            .map(|sample| fit.target(sample.at, sample.limb as usize, plan.clearance))
            .collect();
        fit.separate();
        // Mirrored targets give the same constraints.
        fit.targets.retain(|target| {
            let limb = &plan.limbs[target.limb];
            let is_second = plan.primary(target.limb).is_some() || limb.is_midline && target.at.x < 0.0;
            !(limb.is_symmetric && is_second)
        });
        fit.hints = vec![0; fit.targets.len()];
        fit
    }

    /// Positions of the vertices.
    pub(super) fn positions(&self) -> Vec<DVec3> {
        let moved =
            |terms: &Vec<(u32, DVec3)>| terms.iter().map(|&(j, v)| self.q[j as usize] * v).sum::<DVec3>();
        self.start.iter().zip(&self.terms).map(|(&p, terms)| p + moved(terms)).collect()
    }

    /// The quads, as indices of vertices.
    pub(super) fn faces(&self) -> Vec<[u32; 4]> {
        self.base.quads.iter().map(|quad| quad.corners).collect()
    }

    fn unknown(&mut self, value: f64, weight: f64) -> u32 {
        self.q.push(value);
        self.inverse_weights.push(1.0 / weight);
        self.q.len() as u32 - 1
    }

    /// Creates the unknowns of all rings. Mirrored rings share theirs, so the cage is exactly symmetric.
    fn name_unknowns(&mut self) {
        for r in 0..self.base.rings.len() {
            let ring = self.base.rings[r].clone();
            let limb = &self.plan.limbs[ring.limb];
            let rank = self.base.of_limb[ring.limb].iter().position(|&other| other == r).unwrap_or(0);
            let image = self.plan.primary(ring.limb).map(|image| self.base.of_limb[image][rank]);
            let is_crotch = ring.limb == 0 && rank == 0 && self.plan.is_biped;
            let is_symmetric = limb.is_hexagonal && ring.is_symmetric;
            let weight = match ring.is_end {
                true if is_crotch => CROTCH_WEIGHT,
                true => END_WEIGHT,
                false => SHIFT_WEIGHT,
            };
            let [a, b, c, d] = ring.extents;
            let unknowns = if let Some(image) = image {
                self.unknowns_of_ring[image]
            } else {
                let u = if is_symmetric {
                    [self.unknown(0.5 * (b - a), 1.0); 2]
                } else {
                    [self.unknown(a, 1.0), self.unknown(b, 1.0)]
                };
                let v = [self.unknown(c, 1.0), self.unknown(d, 1.0)];
                let middle = limb.is_hexagonal.then(|| [self.unknown(c, 1.0), self.unknown(d, 1.0)]);
                RingUnknowns { u, v, middle, shift: self.unknown(0.0, weight) }
            };
            self.unknowns_of_ring.push(unknowns);
            for (&vertex, &[i, j]) in ring.vertices.iter().zip(&ring.corners) {
                self.start[vertex as usize] = ring.center;
                let terms = &mut self.terms[vertex as usize];
                terms.push((unknowns.shift, ring.along));
                let [u, v] = ring.across;
                if is_symmetric {
                    terms.push((unknowns.u[0], f64::from(i) * u));
                } else if i == 0 {
                    terms.extend(unknowns.u.map(|k| (k, 0.5 * u)));
                } else {
                    terms.push((unknowns.u[usize::from(i > 0)], u));
                }
                let pair = unknowns.middle.filter(|_| i == 0).unwrap_or(unknowns.v);
                terms.push((pair[usize::from(j > 0)], v));
            }
        }
    }

    /// Vertices of the ring at stop `k` of limb `i`.
    fn vertices_at(&self, i: usize, k: usize) -> &[u32] {
        match (i, k) {
            (_, 0) => &self.base.loops[i],
            (0, _) => &self.base.rings[self.base.of_limb[0][k]].vertices,
            _ => &self.base.rings[self.base.of_limb[i][k - 1]].vertices,
        }
    }

    /// Target at a point of limb `i`.
    pub(super) fn target(&self, at: DVec3, i: usize, clearance: f64) -> Target {
        let limb = &self.plan.limbs[i];
        let stops = limb.stops();
        let n = stops.len();
        let widths = limb.profile.extents.iter();
        let widths = widths.map(|&[a, b, c, d]| a.max(b).max(c).max(d) - a.min(b).min(c).min(d));
        let width = quantile(widths, 0.5).unwrap_or(0.0);
        let top = (stops[n - 1] - CORE_MARGIN * width).max(0.5 * (stops[n - 2] + stops[n - 1]));
        let is_rump = i == 0 && !self.plan.is_biped;
        let inset = if is_rump { (CORE_MARGIN * width).min(0.5 * (stops[1] - stops[0])) } else { 0.0 };
        let low = stops[0] + inset;
        let s = limb.project(at).s.min(top).max(low);
        let k = stops.partition_point(|&x| x <= s).clamp(1, n - 1) - 1;
        let share = (s - stops[k]) / (stops[k + 1] - stops[k]).max(f64::MIN_POSITIVE);
        Target { at, limb: i, clearance, stop: k, share }
    }

    /// Origins of the rays through the targets. `[n_targets]`
    pub(super) fn origins(&self, positions: &[DVec3]) -> Vec<DVec3> {
        let center = |i: usize, k: usize| {
            let vertices = self.vertices_at(i, k);
            vertices.iter().map(|&v| positions[v as usize]).sum::<DVec3>() / vertices.len() as f64
        };
        self.targets
            .iter()
            .map(|t| center(t.limb, t.stop).lerp(center(t.limb, t.stop + 1), t.share))
            .collect()
    }

    /// Adds the constraint `sum of coefficient * normal . vertex >= bound`.
    pub(super) fn constrain(
        &self,
        constraints: &mut Constraints,
        vertices: &[(u32, f64)],
        normal: DVec3,
        bound: f64,
        compliance: f64,
    ) {
        let mut entries: Vec<(u32, f64)> = Vec::with_capacity(16);
        let mut constant = 0.0;
        for &(vertex, coefficient) in vertices {
            constant += coefficient * normal.dot(self.start[vertex as usize]);
            for &(j, way) in &self.terms[vertex as usize] {
                let value = coefficient * normal.dot(way);
                match entries.iter_mut().find(|entry| entry.0 == j) {
                    Some(entry) => entry.1 += value,
                    None => entries.push((j, value)),
                }
            }
        }
        constraints.push(&entries, bound - constant, compliance);
    }

    /// Moves the rings. `go_on` is called in each round with the share of the work that is done.
    pub(super) fn fit_rings(&mut self, go_on: &GoOn) -> Result<(), Cancellation> {
        let initial = self.q.clone();
        // Rounds left; the last ones use closest points instead of rays.
        let mut left = RING_ROUNDS;
        let mut quiet = 0;
        while left > 0 {
            go_on(1.0 - left as f32 / RING_ROUNDS as f32)?;
            let has_rays = left > CLOSEST_ROUNDS;
            let mut constraints = Constraints::default();
            let n_outside = self.contain(&mut constraints, has_rays);
            self.keep_shape(&mut constraints, true);
            let mut q = initial.clone();
            constraints.solve(&mut q, &self.inverse_weights, N_SWEEPS);
            let damping = if left < RING_ROUNDS / 2 { DAMPING } else { 1.0 };
            let largest = self.step(&q, damping);
            left -= 1;
            quiet = if largest < QUIET_STEP { quiet + 1 } else { 0 };
            if quiet >= QUIET_ROUNDS && n_outside == 0 {
                break;
            }
            if quiet >= QUIET_ROUNDS && has_rays {
                (left, quiet) = (CLOSEST_ROUNDS, 0);
            }
        }
        Ok(())
    }

    /// Moves the unknowns towards `q`. Returns the largest change.
    fn step(&mut self, q: &[f64], damping: f64) -> f64 {
        let mut largest: f64 = 0.0;
        for (now, next) in self.q.iter_mut().zip(q) {
            let step = damping * (next - *now).clamp(-MAX_STEP, MAX_STEP);
            largest = largest.max(step.abs());
            *now += step;
        }
        largest
    }

    /// Moves single vertices by the least amount that encloses the points that rings leave outside. `samples`: all
    /// points that must be inside; those that are not are added as targets.
    pub(super) fn fit_vertices(&mut self, samples: &[Sample], go_on: &GoOn) -> Result<(), Cancellation> {
        let at = self.positions();
        let images = self.images(&at);
        let n = at.len();
        self.terms = vec![Vec::new(); n];
        let mut count = 0;
        for (v, &image) in images.iter().enumerate() {
            if image.is_some_and(|image| image < v) {
                continue;
            }
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                // Vertices on the mirror plane stay on it.
                if image == Some(v) && axis == DVec3::X {
                    continue;
                }
                self.terms[v].push((count, axis));
                if let Some(image) = image.filter(|&image| image != v) {
                    self.terms[image].push((count, flipped(axis)));
                }
                count += 1;
            }
        }
        self.start = at;
        self.is_free = true;
        self.q = vec![0.0; count as usize];
        self.inverse_weights = vec![1.0; count as usize];
        let is_clean = self.faults().is_empty();
        self.free_rounds(FREE_ROUNDS, is_clean, go_on)?;
        for _ in 0..3 {
            let at = self.positions();
            let is_inside = self.inside(&at, samples.iter().map(|sample| sample.at));
            let missed: Vec<Target> = samples
                .iter()
                .zip(is_inside)
                .filter(|(_, inside)| *inside != [true; 2])
                .map(|(sample, _)| {
                    self.target(sample.at, sample.limb as usize, MISSED_CLEARANCE * self.plan.clearance)
                })
                .collect();
            if missed.is_empty() || missed.len() > MAX_MISSED {
                break;
            }
            self.targets.extend(missed);
            self.hints.resize(self.targets.len(), 0);
            self.free_rounds(LATER_ROUNDS, is_clean, go_on)?;
        }
        Ok(())
    }

    fn free_rounds(&mut self, n_rounds: usize, is_clean: bool, go_on: &GoOn) -> Result<(), Cancellation> {
        for round in 0..n_rounds {
            go_on(round as f32 / n_rounds as f32)?;
            let mut constraints = Constraints::default();
            let n_outside = self.contain(&mut constraints, false);
            self.keep_shape(&mut constraints, false);
            let mut q: Vec<f64> = self.q.iter().map(|x| 0.5 * x).collect();
            constraints.solve(&mut q, &self.inverse_weights, N_SWEEPS);
            let before = self.q.clone();
            let damping = if round < n_rounds / 2 { 1.0 } else { DAMPING };
            let largest = self.step(&q, damping);
            if is_clean {
                self.undo_faults(&before);
            }
            if n_outside == 0 && largest < QUIET_STEP {
                break;
            }
        }
        Ok(())
    }

    /// Takes back the moves of the vertices of faulty quads, or all moves.
    fn undo_faults(&mut self, before: &[f64]) {
        for _ in 0..UNDO_ATTEMPTS {
            let faults = self.faults();
            if faults.is_empty() {
                return;
            }
            for vertex in faults.into_iter().flat_map(|quad| self.base.quads[quad as usize].corners) {
                for &(j, _) in &self.terms[vertex as usize] {
                    self.q[j as usize] = before[j as usize];
                }
            }
        }
        if !self.faults().is_empty() {
            self.q.copy_from_slice(before);
        }
    }

    /// Number of pairs of quads that meet.
    pub(super) fn n_crossings(&self) -> usize {
        faults(&self.positions(), &self.faces()).meeting.len()
    }

    fn faults(&self) -> Vec<u32> {
        let Faults { meeting, mut folded } = faults(&self.positions(), &self.faces());
        folded.extend(meeting.into_flattened());
        folded
    }

    /// The mirror image of each vertex, itself on the plane; `None` in sleeves that are not symmetric.
    pub(super) fn images(&self, at: &[DVec3]) -> Vec<Option<usize>> {
        let mut is_symmetric = vec![false; at.len()];
        for ring in self.base.rings.iter().filter(|ring| ring.is_symmetric) {
            ring.vertices.iter().for_each(|&v| is_symmetric[v as usize] = true);
        }
        let image = |v: usize| {
            let p = flipped(at[v]);
            let near = (0..at.len()).filter(|&w| is_symmetric[w] && at[w].distance(p) < 1e-6);
            near.min_by(|&a, &b| at[a].distance(p).total_cmp(&at[b].distance(p)))
        };
        let found: Vec<Option<usize>> =
            (0..at.len()).map(|v| if is_symmetric[v] { image(v) } else { None }).collect();
        (0..at.len()).map(|v| found[v].filter(|&w| found[w] == Some(v))).collect()
    }
}

/// Reports the share of a fit that is done, and may cancel.
pub(super) type GoOn<'a> = dyn Fn(f32) -> Result<(), Cancellation> + 'a;
