//! Cages of figures: sleeves of quads along a skeleton.
//!
//! [`generate`] surrounds the trunk with a tube of six-cornered rings. Limbs leave through quads of the trunk as tubes of
//! four-cornered rings, so all faces are quads. Rings stand at joints and where the cross-section changes. Their sizes
//! are the smallest change of the model's cross-sections that encloses the model: a quadratic program with linearised
//! constraints. Single vertices then move to enclose points that rings leave outside. A cage is returned only if it
//! passes the checks of its final coordinates; otherwise the result is a [`Refusal`], and the caller uses
//! [`crate::generate`].
//!
//! Inside this module, lengths are shares of the diagonal of the model's box.
//!
//! Extruding limbs from quads is how modellers build such cages by hand. The fit is new; sources of its parts are named
//! there.

mod base;
mod constraints;
mod fit;
mod guard;
mod limb;
mod program;
mod remedies;
mod rings;
mod samples;
mod separate;
mod starts;
#[cfg(test)]
mod tests;

use cagework_core::cage::Cage;
use cagework_core::closest::distances;
use cagework_core::mesh::TriMesh;
use cagework_core::progress::{Cancellation, Progress, ProgressEvent, Stage};
use glam::{DVec3, Vec3};
use thiserror::Error;

use crate::generate::RingPlace;
use crate::skeleton::{Chain, Skeleton};
use base::Place;
use fit::Fit;
use guard::{Fault, verify};
use limb::Limb;
use remedies::Remedies;
use samples::{FINE_SPACING, MAX_SAMPLES, SPACING, Sample, n_samples, samples, thinned};

/// Smallest distance of rings from the model, as a share of the model's diagonal.
const CLEARANCE: f64 = 0.006;

/// Attempts: share of the target number of vertices, clearance, and whether the tips of limbs that crossed themselves
/// before are straightened.
const ATTEMPTS: [(f64, f64, bool); 6] = [
    (1.0, CLEARANCE, false),
    (1.0, CLEARANCE, true),
    (1.0, 0.5 * CLEARANCE, true),
    (0.9, 0.5 * CLEARANCE, true),
    (0.8, 0.5 * CLEARANCE, true),
    (0.7, 0.5 * CLEARANCE, true),
];

/// Number of [`ATTEMPTS`] before limbs are changed. The last of them is repeated after each change. If there is no change
/// left, the rest of [`ATTEMPTS`] follows.
const FIRST_REMEDY: usize = 4;

/// Largest number of attempts.
const MAX_ATTEMPTS: usize = 11;

/// Limit on the sum, over all attempts, of the number of points that rings are fitted to, for at most [`MANY_LIMBS`]
/// limbs. Figures have 4,000 to 10,000 points. Fitting 45,000 points of a soup takes about six seconds.
const MAX_FITTED: usize = 45_000;

/// With more limbs, the limit is smaller in proportion, because each limb is separated from the others.
const MANY_LIMBS: usize = 6;

/// Number of pairs of quads that meet after the fit of rings, above which the fit of vertices is left out: it does not
/// separate them. The first attempts for a rig have it in any case.
const MAX_CROSSINGS: usize = 6;

/// Share of the work of an attempt that is the fit of rings; the rest is that of vertices.
const RING_SHARE: f32 = 0.6;

/// Smallest number of vertices of a sleeve cage: two rings of the trunk.
const MIN_VERTICES: usize = 12;

/// Shortest straightened tip.
const MIN_TIP: f64 = 0.02;

/// A cage made of sleeves.
#[derive(Clone, Debug)]
pub struct Sleeves {
    /// The verified cage; all faces are quads.
    pub cage: Cage,
    /// Names of the chains that have sleeves; the first is the trunk.
    pub chains: Vec<String>,
    /// Ring of each vertex of the cage. `[n_cage]`
    pub places: Vec<RingPlace>,
    /// Axis along which the cage is mirror-symmetric: its vertices and faces are images of each other.
    pub mirror: Option<usize>,
    /// Mean distance of the cage from the model, as a fraction of the diagonal of the model's box.
    pub mean_distance: f64,
    /// Largest distance of the cage from the model, as a fraction of the diagonal of the model's box.
    pub largest_distance: f64,
    /// Chains without a sleeve of their own, one sentence each.
    pub notices: Vec<String>,
}

/// Why a skeleton gives no sleeve cage.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum Refusal {
    /// The skeleton does not fit the model, or has no usable trunk.
    #[error("the skeleton has {what}: sleeves need {limit}")]
    Skeleton {
        /// What was found.
        what: String,
        /// What is needed.
        limit: String,
    },
    /// The rings that limbs need do not fit into the target.
    #[error("{target} vertices are too few for sleeves: allow at least {needed}")]
    TooFew {
        /// Target number of vertices.
        target: usize,
        /// Smallest number of vertices.
        needed: usize,
    },
    /// The faces are so large together that checking them takes too long.
    #[error(
        "the model's faces overlap too much for sleeves: they take {samples} samples, and at most {limit} are allowed; use the kind shell"
    )]
    TooManySamples {
        /// Number of samples of the model's surface, or of those fitted in all attempts.
        samples: usize,
        /// Largest number allowed.
        limit: usize,
    },
    /// Limbs touch or overlap.
    #[error(
        "no plane separates {first} from {second}: move them apart in the rest pose, or use a cage without sleeves"
    )]
    Unseparated {
        /// Name of a chain.
        first: String,
        /// Name of the other chain.
        second: String,
    },
    /// The sleeves intersect.
    #[error(
        "the sleeves of {first} and {second} go through each other: use fewer vertices, or a cage without sleeves"
    )]
    Crossing {
        /// Name of a chain.
        first: String,
        /// Name of the other chain, or the same.
        second: String,
    },
    /// Neighbouring quads are folded too sharply.
    #[error(
        "the sleeve of {chain} is folded by more than 120 degrees: use fewer vertices, or a cage without sleeves"
    )]
    Folded {
        /// Name of the chain.
        chain: String,
    },
    /// Parts of the model stay outside.
    #[error(
        "{points} points of the model stay outside the sleeves: use more vertices, or a cage without sleeves"
    )]
    Outside {
        /// Number of vertices and sampled points outside.
        points: usize,
    },
    /// The cage of a symmetric model is not symmetric.
    #[error("the sleeves of the symmetric model are not symmetric: {chain} has no mirror image")]
    Asymmetric {
        /// Name of a chain without an image.
        chain: String,
    },
    /// The cage is not closed, or a face has no area.
    #[error("the sleeves do not form a closed surface: use more vertices, or a cage without sleeves")]
    Invalid,
}

/// Why [`generate`] returns no cage.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum SleeveError {
    /// The figure has no sleeve cage.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// Cancelled by the caller.
    #[error(transparent)]
    Cancelled(#[from] Cancellation),
}

/// A model whose diagonal is 1 and whose mirror plane is x = 0.
struct Model {
    at: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

/// Maps object coordinates to those of [`Model`].
#[derive(Clone, Copy, Debug)]
struct Units {
    /// Axis of the mirror plane. It becomes x, the next axis y.
    axis: usize,
    center: DVec3,
    diagonal: f64,
}

impl Units {
    fn new(positions: &[Vec3], skeleton: &Skeleton) -> Self {
        let points = || positions.iter().map(|p| p.as_dvec3());
        let (low, high) =
            (points().fold(DVec3::INFINITY, DVec3::min), points().fold(DVec3::NEG_INFINITY, DVec3::max));
        let mut center = 0.5 * (low + high);
        center[skeleton.axis] = skeleton.offset;
        Self { axis: skeleton.axis, center, diagonal: high.distance(low) }
    }

    fn inner(&self, p: DVec3) -> DVec3 {
        let q = ((p - self.center) / self.diagonal).to_array();
        DVec3::from_array([0, 1, 2].map(|k| q[(k + self.axis) % 3]))
    }

    fn object(&self, p: DVec3) -> Vec3 {
        let q = p.to_array();
        let turned = DVec3::from_array([0, 1, 2].map(|k| q[(k + 3 - self.axis) % 3]));
        (self.center + self.diagonal * turned).as_vec3()
    }
}

/// A cage being planned.
struct Plan<'a> {
    model: &'a Model,
    bone_of: &'a [u32],
    samples: Vec<Sample>,
    limbs: Vec<Limb>,
    /// Number of chains of the skeleton.
    n_chains: usize,
    is_biped: bool,
    target: usize,
    clearance: f64,
    remedies: &'a Remedies,
    /// Limbs without a sleeve of their own, one sentence each.
    notes: Vec<String>,
}

/// Generates a cage of at most `target` vertices around a model with a skeleton.
///
/// `positions`: `[n_vertices]`, object units. `triangles`: `[n_triangles]`, any soup. The cage encloses all vertices, and
/// triangles as sampled at distances of 0.02 diagonals, and of 0.01 if one more attempt suffices. An attempt takes
/// 0.3 s of one core for 12,000 triangles and 0.5 s for 100,000; there are at most eleven.
///
/// # Errors
/// [`Refusal`] if no attempt passes the checks, or cancellation.
pub fn generate(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    skeleton: &Skeleton,
    target: usize,
    progress: &dyn Progress,
) -> Result<Sleeves, SleeveError> {
    check(positions, triangles, skeleton)?;
    if target < MIN_VERTICES {
        return Err(Refusal::TooFew { target, needed: MIN_VERTICES }.into());
    }
    let units = Units::new(positions, skeleton);
    let at = positions.iter().map(|p| units.inner(p.as_dvec3())).collect();
    let model = Model { at, triangles: triangles.to_vec() };
    let n = n_samples(&model, SPACING);
    if n > MAX_SAMPLES {
        return Err(Refusal::TooManySamples { samples: n, limit: MAX_SAMPLES }.into());
    }
    let sampled = |spacing| samples(&model, spacing, &skeleton.chain_of, &skeleton.bone_of);
    let mut unmirrored = sampled(SPACING);
    let checked = if n_samples(&model, FINE_SPACING) > MAX_SAMPLES {
        unmirrored.clone()
    } else {
        sampled(FINE_SPACING)
    };
    let points = |of: &[Sample]| -> Vec<Vec3> {
        let sampled = of[positions.len()..].iter().map(|sample| units.object(sample.at));
        positions.iter().copied().chain(sampled).collect()
    };
    let [coarse, fine] = [points(&unmirrored), points(&checked)];
    let mut refusal = None;
    let mut remedies = Remedies::default();
    // Encloses only the samples to which sleeves are fitted. Used if the next attempt does not enclose all points.
    let mut enclosing = None;
    let (mut next, mut n_fitted) = (0, 0);
    for attempt in 0..MAX_ATTEMPTS {
        let Some((share, clearance, may_straighten)) = ATTEMPTS.get(next).copied() else { break };
        let go_on = |done: f32| {
            let fraction = (attempt as f32 + done) / MAX_ATTEMPTS as f32;
            let event =
                ProgressEvent { stage: Stage::Simplify, fraction, iteration: attempt as u32, delta: None };
            if progress.report(event).is_break() { Err(Cancellation) } else { Ok(()) }
        };
        go_on(0.0)?;
        // The attempt would repeat the first one.
        if attempt == 1 && remedies.straight.is_empty() && remedies.fused.is_empty() && enclosing.is_none() {
            next += 1;
            continue;
        }
        let mut plan = Plan {
            model: &model,
            bone_of: &skeleton.bone_of,
            samples: with_images(&unmirrored, skeleton),
            limbs: (0..skeleton.chains.len()).map(|id| limb(id, skeleton, &units)).collect(),
            n_chains: skeleton.chains.len(),
            is_biped: skeleton.is_biped,
            target: ((share * target as f64) as usize).max(MIN_VERTICES),
            clearance,
            remedies: &remedies,
            notes: Vec::new(),
        };
        if may_straighten {
            plan.straighten();
        }
        // Descending, so that indices of limbs are still those of chains.
        remedies.fused.iter().rev().for_each(|&chain| plan.fuse(chain));
        plan.start();
        let base = loop {
            match plan.choose_rings().map(|()| plan.base()) {
                Ok(Ok(base)) => break base,
                Ok(Err(limb)) => plan.merge(limb),
                // Later attempts have fewer vertices.
                Err(needed) => return Err(refusal.unwrap_or(Refusal::TooFew { target, needed }).into()),
            }
        };
        let thin = thinned(&plan.samples);
        n_fitted += thin.len();
        let limit = MAX_FITTED * MANY_LIMBS / plan.limbs.len().max(MANY_LIMBS);
        if n_fitted > limit {
            let samples = n_fitted;
            return enclosing.ok_or(refusal.unwrap_or(Refusal::TooManySamples { samples, limit }).into());
        }
        let mut fit = Fit::new(&plan, base, &thin);
        fit.fit_rings(&|done| go_on(RING_SHARE * done))?;
        let is_tangled = fit.n_crossings() > MAX_CROSSINGS;
        if !is_tangled || (skeleton.is_rigged && attempt < FIRST_REMEDY) {
            fit.fit_vertices(&plan.samples, &|done| go_on(RING_SHARE + (1.0 - RING_SHARE) * done))?;
        }
        let (fault, why) = match finish(&fit, &units, skeleton, &fine) {
            Ok(cage) => return Ok(sleeves(&fit, cage, &units, skeleton, positions, triangles)),
            Err(failure) => failure,
        };
        if let Some(coarse) = enclosing {
            return Ok(coarse);
        }
        // A model without a rig may be a soup, for which each attempt takes seconds and none succeeds.
        if !skeleton.is_rigged && is_tangled && attempt > 0 {
            return Err(why.into());
        }
        if let Fault::Outside(points) = &fault
            && let Ok(cage) = finish(&fit, &units, skeleton, &coarse)
        {
            unmirrored.extend(points.iter().map(|&i| checked[i]));
            enclosing = Some(sleeves(&fit, cage, &units, skeleton, positions, triangles));
        }
        let mut learnt = remedies.clone();
        learnt.learn(&fit, &fault);
        next += 1;
        if skeleton.is_rigged && next >= FIRST_REMEDY && learnt.change_limbs(&fit, &fault) {
            // The rings to avoid were those of other limbs.
            learnt.avoided.clear();
            next = FIRST_REMEDY - 1;
        }
        remedies = learnt;
        refusal = Some(why);
    }
    Err(refusal.unwrap_or(Refusal::Invalid).into())
}

/// Checks that a skeleton fits a model.
fn check(positions: &[Vec3], triangles: &[[u32; 3]], skeleton: &Skeleton) -> Result<(), Refusal> {
    let wrong = |what: String, limit: &str| Err(Refusal::Skeleton { what, limit: limit.to_owned() });
    let n = positions.len();
    let n_chains = skeleton.chains.len();
    if skeleton.chain_of.len() != n || skeleton.bone_of.len() != n || n == 0 {
        return wrong(
            format!("{} of {n} vertices", skeleton.chain_of.len()),
            "one chain and bone for each vertex",
        );
    }
    if skeleton.chain_of.iter().any(|&chain| chain as usize >= n_chains) || skeleton.axis > 2 {
        return wrong(format!("{n_chains} chains"), "vertices and axes with valid numbers");
    }
    if triangles.iter().flatten().any(|&v| v as usize >= n) || !positions.iter().all(|p| p.is_finite()) {
        return wrong(format!("{n} vertices"), "triangles of finite vertices");
    }
    for (i, chain) in skeleton.chains.iter().enumerate() {
        let is_linked =
            if i == 0 { chain.parent.is_none() } else { chain.parent.is_some_and(|parent| parent < i) };
        let is_paired = chain.mirror.is_none_or(|image| {
            skeleton.chains.get(image).is_some_and(|c| c.mirror == Some(i) && c.at.len() == chain.at.len())
        });
        if !is_linked || !is_paired || !chain.at.iter().all(|p| p.is_finite()) || chain.at.len() < 2 {
            return wrong(
                format!("an invalid chain {}", chain.name),
                "chains of two joints after their parents",
            );
        }
    }
    match skeleton.chains.first() {
        Some(trunk) if trunk.at.len() >= 3 => Ok(()),
        Some(trunk) => wrong(format!("a trunk of {} joints", trunk.at.len()), "at least three"),
        None => wrong("no chains".to_owned(), "a trunk"),
    }
}

/// Adds the mirror images of the samples of symmetric limbs.
fn with_images(samples: &[Sample], skeleton: &Skeleton) -> Vec<Sample> {
    let image = |sample: &Sample| {
        let chain = &skeleton.chains[sample.limb as usize];
        let limb = chain.mirror.filter(|_| !chain.is_midline).map_or(sample.limb, |image| image as u32);
        is_symmetric(chain, skeleton).then(|| Sample { at: starts::flipped(sample.at), limb, ..*sample })
    };
    samples.iter().copied().chain(samples.iter().filter_map(image)).collect()
}

/// Whether a chain gets a symmetric sleeve. A few vertices of a symmetric model may lack images.
fn is_symmetric(chain: &Chain, skeleton: &Skeleton) -> bool {
    chain.is_symmetric || skeleton.is_symmetric && (chain.is_midline || chain.mirror.is_some())
}

fn limb(id: usize, skeleton: &Skeleton, units: &Units) -> Limb {
    let chain = &skeleton.chains[id];
    let at = chain.at.iter().map(|&p| units.inner(p)).collect();
    let mut limb = Limb::new(chain.name.clone(), id, at);
    limb.bones = chain.own_bones.first().zip(chain.own_bones.last()).map(|(&a, &b)| [a, b]);
    (limb.parent, limb.mirror) = (chain.parent, chain.mirror);
    limb.is_midline = chain.is_midline;
    limb.is_symmetric = is_symmetric(chain, skeleton);
    limb
}

impl Plan<'_> {
    /// Makes the tips of limbs continue their last bones.
    fn straighten(&mut self) {
        let ids = &self.remedies.straight;
        for limb in self.limbs.iter_mut().filter(|limb| ids.contains(&limb.id)) {
            let (n, Some([_, last])) = (limb.at.len(), limb.bones) else { continue };
            if n < 3 {
                continue;
            }
            let joint = limb.at[n - 2];
            let bone = (joint - limb.at[n - 3]).normalize_or_zero();
            let own = self.samples.iter().filter(|s| s.limb as usize == limb.id && s.bone == last);
            let reach = own.map(|sample| (sample.at - joint).dot(bone)).fold(MIN_TIP, f64::max);
            limb.at[n - 1] = joint + reach * bone;
            limb.measure();
        }
    }
}

/// Rounds a fit to f32 coordinates and verifies it.
fn finish(fit: &Fit, units: &Units, skeleton: &Skeleton, points: &[Vec3]) -> Result<Cage, (Fault, Refusal)> {
    let at = fit.positions();
    let quads = fit.faces();
    let name = |limb: usize| fit.plan.limbs[limb].name.clone();
    let images = fit.images(&at);
    if skeleton.is_symmetric && !is_mirrored(&images, &quads) {
        let lost =
            fit.base.rings.iter().find(|ring| ring.vertices.iter().any(|&v| images[v as usize].is_none()));
        let chain = name(lost.map_or(0, |ring| ring.limb));
        return Err((Fault::Invalid, Refusal::Asymmetric { chain }));
    }
    let mut positions: Vec<Vec3> = at.iter().map(|&p| units.object(p)).collect();
    for (v, image) in images.iter().enumerate() {
        match *image {
            Some(image) if image > v => positions[image] = units.object(starts::flipped(at[v])),
            Some(image) if image == v => positions[v] = units.object(at[v].with_x(0.0)),
            _ => {}
        }
    }
    verify(positions, &quads, points).map_err(|fault| {
        let unseparated = fit.unseparated.first().map(|pair| pair.map(name));
        let why = match (&fault, unseparated) {
            (Fault::Quads(_) | Fault::Outside(_), Some([first, second])) => {
                Refusal::Unseparated { first, second }
            }
            (Fault::Quads(faults), None) => {
                let limb = |quad: u32| name(fit.base.quads[quad as usize].limb);
                match (faults.meeting.first(), faults.folded.first()) {
                    (Some(&[a, b]), _) => Refusal::Crossing { first: limb(a), second: limb(b) },
                    (None, Some(&quad)) => Refusal::Folded { chain: limb(quad) },
                    (None, None) => Refusal::Invalid,
                }
            }
            (Fault::Outside(points), None) => Refusal::Outside { points: points.len() },
            (Fault::Invalid, _) => Refusal::Invalid,
        };
        (fault, why)
    })
}

/// Whether every vertex has a mirror image, and every quad, too.
fn is_mirrored(images: &[Option<usize>], quads: &[[u32; 4]]) -> bool {
    let sorted = |mut quad: [u32; 4]| {
        quad.sort_unstable();
        quad
    };
    let all: Vec<[u32; 4]> = quads.iter().map(|&quad| sorted(quad)).collect();
    images.iter().all(Option::is_some)
        && all.iter().all(|quad| all.contains(&sorted(quad.map(|v| images[v as usize].unwrap_or(0) as u32))))
}

/// Describes a verified cage.
fn sleeves(
    fit: &Fit,
    cage: Cage,
    units: &Units,
    skeleton: &Skeleton,
    positions: &[Vec3],
    triangles: &[[u32; 3]],
) -> Sleeves {
    let mut places = vec![RingPlace { chain: 0, ring: 0, place: 0 }; cage.n_vertices()];
    for (limb, rings) in fit.base.of_limb.iter().enumerate() {
        for (k, &ring) in rings.iter().enumerate() {
            for (place, &v) in fit.base.rings[ring].vertices.iter().enumerate() {
                places[v as usize] = RingPlace { chain: limb as u32, ring: k as u32, place: place as u32 };
            }
        }
    }
    let at: Vec<DVec3> = cage.positions().iter().map(|p| units.inner(p.as_dvec3())).collect();
    let zeros = vec![0; at.len()];
    let surface = Model { at, triangles: cage.triangles().to_vec() };
    let on: Vec<Vec3> =
        samples(&surface, SPACING, &zeros, &zeros).iter().map(|sample| units.object(sample.at)).collect();
    let mesh = TriMesh { positions: positions.to_vec(), triangles: triangles.to_vec() };
    let away = distances(&on, &mesh);
    let n = away.len() as f64;
    let is_mirrored = is_mirrored(&fit.images(&fit.positions()), &fit.faces());
    Sleeves {
        cage,
        chains: fit.plan.limbs.iter().map(|limb| limb.name.clone()).collect(),
        places,
        mirror: is_mirrored.then_some(skeleton.axis),
        mean_distance: away.iter().sum::<f64>() / n / units.diagonal,
        largest_distance: away.iter().copied().fold(0.0, f64::max) / units.diagonal,
        notices: fit.plan.notes.clone(),
    }
}
