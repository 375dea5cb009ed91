//! What later attempts at a sleeve cage do differently, because of the faults of earlier ones.

use std::collections::{BTreeMap, BTreeSet};

use super::fit::Fit;
use super::guard::Fault;
use super::limb::{Exit, Limb};
use super::{Place, Plan};

/// Arc lengths of rings, as a share of the limb's length, that count as equal.
const SAME_RING: f64 = 0.01;

/// How much further out a limb starts if its sleeve meets that of its parent, and the limit of this.
const FURTHER: f64 = 0.03;
const MAX_FURTHER: f64 = 0.09;

/// Longest limb that may lose its sleeve because it cannot be separated from others.
const MAX_DROPPED: f64 = 0.25;

/// Changes of an attempt. Limbs are named by [`Limb::id`].
#[derive(Clone, Debug, Default)]
pub(super) struct Remedies {
    /// Limbs, and shares of their lengths near which no optional ring is placed.
    pub(super) avoided: Vec<(usize, f64)>,
    /// Limbs that cross themselves. Their tips may be straightened.
    pub(super) straight: BTreeSet<usize>,
    /// Limbs that have one sleeve with their mirror images.
    pub(super) fused: BTreeSet<usize>,
    /// Limbs without sleeves.
    pub(super) dropped: BTreeSet<usize>,
    /// How much further out limbs leave their parents.
    pub(super) further: BTreeMap<usize, f64>,
    /// Whether points of overlapping limbs may change limbs.
    pub(super) may_divide: bool,
}

impl Remedies {
    /// Learns from a fault: rings beside faulty quads are avoided, and legs that touch get one sleeve.
    pub(super) fn learn(&mut self, fit: &Fit, fault: &Fault) {
        let plan = fit.plan;
        if let Fault::Quads(faults) = fault {
            for pair in &faults.meeting {
                let [a, b] = pair.map(|quad| fit.base.quads[quad as usize].limb);
                self.straight.extend((a == b && a > 0).then_some(plan.limbs[a].id));
            }
            for &quad in faults.meeting.as_flattened().iter().chain(&faults.folded) {
                let quad = &fit.base.quads[quad as usize];
                let limb = &plan.limbs[quad.limb];
                for s in rings_beside(limb, quad.place) {
                    let share = s / limb.total();
                    let is_same =
                        |&(id, other): &(usize, f64)| id == limb.id && (share - other).abs() <= SAME_RING;
                    if !self.avoided.iter().any(is_same) {
                        self.avoided.push((limb.id, share));
                        self.avoided.extend(limb.mirror.map(|image| (plan.limbs[image].id, share)));
                    }
                }
            }
        }
        let spine = plan.limbs[0].at[2] - plan.limbs[0].at[1];
        let is_leg = |limb: &Limb| {
            let way = limb.at[limb.at.len() - 1] - limb.at[0];
            limb.mirror.is_some() && way.dot(spine) < -0.5 * way.length() * spine.length()
        };
        let touching = fit.unseparated.iter().map(|pair| pair.map(|i| &plan.limbs[i]));
        let legs = touching.filter(|pair| pair.iter().all(|limb| is_leg(limb)));
        self.fused.extend(legs.map(|[a, b]| a.id.min(b.id)));
    }

    /// Finds the least change of the limbs that may remove a fault. In this order: an apron or a cape loses its sleeve,
    /// limbs start further out, points of overlapping limbs change limbs, legs get one sleeve, and the shortest limb
    /// loses its sleeve. Returns whether there is one.
    pub(super) fn change_limbs(&mut self, fit: &Fit, fault: &Fault) -> bool {
        let plan = fit.plan;
        let mut pairs: Vec<[usize; 2]> = fit.unseparated.clone();
        if let Fault::Quads(faults) = fault {
            let limb_of = |quad: u32| fit.base.quads[quad as usize].limb;
            pairs.extend(faults.meeting.iter().map(|pair| pair.map(limb_of)));
            pairs.extend(faults.folded.iter().map(|&quad| [limb_of(quad); 2]));
        }
        let limbs: BTreeSet<usize> = pairs.as_flattened().iter().copied().collect();
        let id = |i: usize| plan.limbs[i].id;
        if let Some(&cape) = limbs.iter().find(|&&i| plan.is_cape(i)) {
            self.dropped.insert(id(cape));
            return true;
        }
        let further = |i: usize| self.further.get(&id(i)).copied().unwrap_or(0.0);
        let meets_parent = |&i: &usize| {
            let limb = &plan.limbs[i];
            let is_with =
                |pair: &[usize; 2]| pair.contains(&i) && limb.parent.is_some_and(|p| pair.contains(&p));
            limb.exit == Exit::Side && further(i) < MAX_FURTHER && pairs.iter().any(is_with)
        };
        let starts: BTreeSet<usize> =
            limbs.iter().copied().filter(meets_parent).flat_map(|i| plan.with_image(i)).map(id).collect();
        if !starts.is_empty() {
            starts.into_iter().for_each(|id| *self.further.entry(id).or_default() += FURTHER);
            return true;
        }
        if !self.may_divide && !fit.unseparated.is_empty() {
            self.may_divide = true;
            return true;
        }
        let is_pair_of_legs = |pair: &&[usize; 2]| {
            let [a, b] = pair.map(|i| &plan.limbs[i]);
            a.mirror == Some(pair[1]) && a.exit == Exit::Start && b.exit == Exit::Start
        };
        if let Some(pair) = pairs.iter().find(is_pair_of_legs) {
            self.fused.extend(pair.map(id).into_iter().min());
            return true;
        }
        let length = |i: usize| plan.limbs[i].total() - plan.limbs[i].first;
        let is_short_leaf = |i: &usize| {
            *i > 0 && length(*i) < MAX_DROPPED && plan.limbs.iter().all(|limb| limb.parent != Some(*i))
        };
        let shortest =
            limbs.into_iter().filter(is_short_leaf).min_by(|&a, &b| length(a).total_cmp(&length(b)));
        self.dropped.extend(shortest.map(id));
        shortest.is_some()
    }
}

/// Arc lengths of the optional rings beside a quad.
fn rings_beside(limb: &Limb, place: Place) -> Vec<f64> {
    let stops = limb.stops();
    let k = match place {
        Place::Between(k) => k,
        Place::Start => 0,
        Place::End => stops.len() - 2,
    };
    let beside = stops[k.max(1)..].iter().take(k + 2 - k.max(1)).copied();
    beside.filter(|s| !limb.needed.contains(s)).collect()
}

impl Plan<'_> {
    /// Whether a limb is a part of the trunk beyond the crotch.
    fn is_cape(&self, i: usize) -> bool {
        self.limbs[i].id >= self.n_chains
    }
}
