//! Cages made for a model: a box of quads, or a coarse closed surface that follows the model's shape.
//!
//! [`generate`] takes any triangle soup, however open, overlapping or scattered. The way: conservative voxels, the
//! outside flooded, a hull of voxels at a distance whose boundary is a 2-manifold by construction, its stairs
//! smoothed, then edge collapses that never make the cage meet the solid or itself, then better triangles under the
//! same constraints. What is returned has been checked as a whole on its final f32 numbers; if the check fails, fewer
//! edges are collapsed, down to the hull itself, and [`CageReport`] says so.
//!
//! Sources: Xian, Lin, Gao 2009 (voxels and hull); Garland, Heckbert 1997 (quadrics); Sander et al. 2000
//! (progressive hulls). Changes: the constraint is a bit set of voxels and a grid of the cage's own triangles, not a
//! linear program; symmetric models are simplified as one half. Where the constants come from: `docs/notes/cage-generator.md`.

mod buckets;
mod collapse;
mod footprint;
mod gaps;
mod guarded;
mod lattice;
mod options;
mod pairing;
mod quadric;
mod quads;
mod relax;
mod shell;
mod smooth;
mod surface;
#[cfg(test)]
mod tests;
mod verify;
mod voxels;

use glam::{DVec3, Vec3};

use cagework_core::cage::Cage;
use cagework_core::progress::{Cancelled, Progress, ProgressEvent, Stage};
use collapse::Collapser;
use gaps::NarrowGaps;
use guarded::Guarded;
pub use options::{
    CLEARANCE, CageGenError, CageOptions, CageReport, DETAIL, DETAILS, GeneratedCage, MAX_CLEARANCE,
    MAX_TARGET, MAX_VOXELS, MIN_TARGET, MIN_VOXELS, Mirror, Shape, Symmetry, TARGET, VOXELS,
};
use quads::Faces;
use shell::Shell;
use verify::{verified, verified_faces};

/// Most lattices that are tried until the target is met.
const MAX_LATTICES: usize = 4;

/// Vertices of a cage over those asked for, above which a coarser lattice is tried.
const MAX_TARGET_RATIO: f64 = 1.1;

/// Layers of voxels around the hull in which the cage must stay, tried one after the other until the target is met:
/// as far as possible it spans no gap. At last anywhere.
const BAND_LAYERS: [Option<usize>; 5] = [Some(1), Some(2), Some(3), Some(5), None];

/// Gaps that stay open, one share after the other until the target is met: of the largest one's volume.
const KEPT_GAPS: [f64; 3] = [0.0, 0.3, f64::INFINITY];

/// Of these, those in which a cage takes the shape that the budget allows.
const NARROW_BANDS: usize = 3;

/// Vertices that the budget leaves over those asked for, above which a coarser lattice is tried at once for a model in pieces: the
/// bridges between them cannot be collapsed.
const MAX_FIRST_RATIO: f64 = 5.0;

/// Vertices that the budget leaves over those left at the end, of such models.
const LATER_RATIO: f64 = 3.7;

/// Vertices that a gap costs, nearly: a ring on each side.
const VERTICES_PER_GAP: usize = 10;

/// Most vertices of a hull, or of its half in a mirror, on a lattice that is refined for gaps: two seconds of collapses.
const MAX_HULL: usize = 20_000;

/// Gaps that a report names.
const MAX_NOTICES: usize = 3;

/// Rounds in which quads that break the promise become triangles again.
const MAX_SPLITS: usize = 4;

/// Makes a cage that encloses a model strictly.
///
/// `positions`: `[n_vertices]`, object units; vertices of no triangle are enclosed, too. `triangles`:
/// `[n_triangles]`, any soup. 0.2 to 1.5 s for a figure and 80 vertices on one core, most of it for the gaps between limbs.
///
/// # Errors
/// [`CageGenError`]: nothing to enclose, numbers or options out of range, cancelled.
pub fn generate(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    options: &CageOptions,
    progress: &dyn Progress,
) -> Result<GeneratedCage, CageGenError> {
    if options.smooth > 0 {
        return smooth::generate(positions, triangles, options, progress);
    }
    generate_plain(positions, triangles, options, progress)
}

/// A cage whose faces enclose the model as they are.
fn generate_plain(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    options: &CageOptions,
    progress: &dyn Progress,
) -> Result<GeneratedCage, CageGenError> {
    let bounds = options::check(positions, triangles, options)?;
    let began = progress.now_ms();
    let target = options.target as usize;
    let base = first_voxels(target);
    let most_gaps = target / VERTICES_PER_GAP;
    let NarrowGaps { gaps, stretch, voxels: finest } = match (options.shape, options.smooth) {
        // A smooth surface is kept clear of the model by its distance, which a finer lattice would halve.
        (Shape::Follow, 0) => gaps::narrow_gaps(positions, triangles, bounds, [base, most_gaps], &|_| {
            let event = ProgressEvent { stage: Stage::Voxelize, fraction: 0.0, iteration: 0, delta: None };
            if progress.report(event).is_break() { Err(Cancelled) } else { Ok(()) }
        })?,
        _ => NarrowGaps { gaps: Vec::new(), stretch: DVec3::ONE, voxels: base },
    };
    let mut voxels = if options.voxels > 0 { options.voxels as usize } else { finest };
    for attempt in 1..=MAX_LATTICES {
        let go_on = |stage: Stage, share: f32| {
            let fraction = (attempt as f32 - 1.0 + share) / attempt as f32;
            let event = ProgressEvent { stage, fraction, iteration: attempt as u32 - 1, delta: None };
            if progress.report(event).is_break() { Err(Cancelled) } else { Ok(()) }
        };
        let mut shell = Shell::new(positions, triangles, bounds, (voxels, stretch), options, &|share| {
            go_on(Stage::Voxelize, 0.4 * share)
        })?;
        if gaps.len() > most_gaps {
            shell.gaps.clear();
        }
        // The solid's handles and gaps may need more vertices than asked for: a coarser lattice closes them.
        let may_coarsen = attempt < MAX_LATTICES && voxels > MIN_VOXELS;
        let n_half = shell.hull.positions.len();
        if options.voxels == 0 && voxels > base && may_coarsen && n_half > MAX_HULL {
            let shrunk = voxels as f64 * (0.9 * MAX_HULL as f64 / n_half as f64).sqrt();
            voxels = (shrunk as usize).max(base);
            continue;
        }
        let simplify = |share| go_on(Stage::Simplify, 0.4 + 0.6 * share);
        let (cage, hull) = match simplified(&shell, options, may_coarsen, &simplify)? {
            Simplified::Cage(cage, hull) => (*cage, hull),
            Simplified::TooMany(left) => {
                let ratio = (target as f64 / left as f64).sqrt().clamp(0.4, 0.7);
                let least = if voxels > base { base } else { MIN_VOXELS };
                voxels = ((ratio * voxels as f64) as usize).max(least);
                continue;
            }
        };
        let closed: Vec<String> = gaps.iter().filter_map(|gap| gap.notice(&cage, voxels, options)).collect();
        let report = CageReport {
            target: options.target,
            vertices: cage.n_vertices() as u32,
            faces: cage.faces().len() as u32,
            quads: cage.faces().iter().filter(|face| face.len() == 4).count() as u32,
            target_met: cage.n_vertices() as f64 <= MAX_TARGET_RATIO * target as f64,
            voxels: voxels as u32,
            voxel_size: shell.lattice.cell as f32,
            clearance: shell.clearance as f32,
            mirror: shell.hull.mirror.map(Mirror::of_axis),
            notices: closed.into_iter().take(MAX_NOTICES).collect(),
            parts: n_parts(&cage),
            separate: shell.separate as u32,
            hull_vertices: shell.hull.n_whole() as u32,
            hull,
            attempts: attempt as u32,
            elapsed_ms: progress.now_ms() - began,
        };
        return Ok(GeneratedCage { cage, report });
    }
    Err(CageGenError::Unresolved)
}

/// Voxels along the longest side for a target: a cage of few vertices cannot follow small gaps anyway.
fn first_voxels(target: usize) -> usize {
    ((4.0 * (target as f64).sqrt()).round() as usize).clamp(MIN_VOXELS, MAX_VOXELS)
}

/// What became of a hull.
enum Simplified {
    /// The verified cage, and whether it is the hull itself.
    Cage(Box<Cage>, bool),
    /// So many vertices are left that a coarser lattice should be tried.
    TooMany(usize),
}

/// The verified cage: as few vertices as its shape needs and at most as many as asked for, if that can be.
fn simplified(
    shell: &Shell,
    options: &CageOptions,
    may_coarsen: bool,
    go_on: &dyn Fn(f32) -> Result<(), Cancelled>,
) -> Result<Simplified, CageGenError> {
    let n_hull = shell.hull.n_whole();
    let mut target = options.target as usize;
    // The lattice may be coarser than the first one: the budget is the model's, not the lattice's.
    let mut budget = Some(f64::from(options.detail) * shell.longest / shell.lattice.cell);
    while target < n_hull {
        let mut guarded = Guarded::new(shell.hull.clone(), &shell.obstacle);
        let spacings = shell.spacings();
        let has_plates = spacings.iter().flatten().any(|spacing| spacing.along.is_none());
        let mut collapser = Collapser::new(&mut guarded, spacings);
        let mut left = n_hull;
        // First as far as the budget goes, in narrow bands; then on to the count, in any.
        let narrow = BAND_LAYERS[..NARROW_BANDS]
            .iter()
            .map(|&layers| (layers, budget, MIN_TARGET as usize, 0.0, false, true));
        // A sharp fold is better than a closed gap, and a plate that bends badly better than a fold.
        let passes_of_gaps = |&least| {
            let plates = BAND_LAYERS.iter().map(move |&layers| (layers, None, target, least, false, true));
            let plain = BAND_LAYERS.iter().map(move |&layers| (layers, None, target, least, false, false));
            plates.chain(plain).chain([(None, None, target, least, true, false)])
        };
        let wide = KEPT_GAPS.iter().flat_map(passes_of_gaps);
        let n_passes = (NARROW_BANDS + KEPT_GAPS.len() * (2 * BAND_LAYERS.len() + 1)) as f32;
        for (k, (layers, budget, aim, least, may_fold, keeps_plates)) in narrow.chain(wide).enumerate() {
            let is_repeated =
                (least > 0.0 && shell.gaps.is_empty()) || (budget.is_none() && keeps_plates && !has_plates);
            let is_far = left as f64 > MAX_FIRST_RATIO * f64::from(options.target);
            let is_in_pieces = shell.separate > options.target as usize / 10;
            if k == NARROW_BANDS && may_coarsen && is_far && is_in_pieces {
                return Ok(Simplified::TooMany((left as f64 / LATER_RATIO) as usize));
            }
            if left <= aim || is_repeated || (budget.is_none() && left <= target) {
                continue;
            }
            collapser.surface.set_band(layers.map(|layers| shell.band(layers)).as_ref());
            collapser.surface.set_sheets(shell.sheets(least));
            collapser.surface.may_fold = may_fold;
            collapser.budget = budget;
            collapser.keeps_plates = keeps_plates;
            let from = 0.6 * k as f32 / n_passes;
            left = collapser.run(aim, &|share| go_on(from + 0.6 * share / n_passes))?;
        }
        collapser.surface.may_fold = false;
        if may_coarsen && left as f64 > MAX_TARGET_RATIO * f64::from(options.target) {
            return Ok(Simplified::TooMany(left));
        }
        // Relaxing weighs distances from the hull against shape as on the lattice that the target asks for.
        let quadrics: Vec<_> = collapser.quadrics.iter().map(|q| q.in_units(shell.fineness)).collect();
        if let Some(cage) = relaxed(shell, guarded, &quadrics, options.quads, go_on)? {
            return Ok(Simplified::Cage(Box::new(cage), false));
        }
        target = left.max(target) * 2;
        budget = budget.map(|budget| 0.5 * budget);
    }
    for surface in [&shell.hull, &shell.stairs] {
        if let Some(cage) = verified(shell, surface) {
            return Ok(Simplified::Cage(Box::new(cage), true));
        }
    }
    Err(CageGenError::Unresolved)
}

/// The cage of a collapsed surface, relaxed and of quads as far as it then still keeps the promise.
fn relaxed(
    shell: &Shell,
    mut guarded: Guarded<'_>,
    quadrics: &[quadric::Quadric],
    of_quads: bool,
    go_on: &dyn Fn(f32) -> Result<(), Cancelled>,
) -> Result<Option<Cage>, Cancelled> {
    let collapsed = guarded.surface();
    relax::relax(&mut guarded, quadrics, &|share| go_on(0.6 + 0.2 * share))?;
    let triangles = guarded.surface();
    if of_quads {
        let mut pairing = quads::quads(&mut guarded, quadrics, &|share| go_on(0.8 + 0.2 * share))?;
        for _ in 0..MAX_SPLITS {
            let Faces { positions, faces, first } = quads::faces(&guarded, &pairing);
            match verified_faces(shell, &positions, faces) {
                Ok(cage) => return Ok(Some(cage)),
                Err(wrong) if wrong.is_empty() => break,
                Err(wrong) => wrong.iter().for_each(|&face| pairing.part(first[face as usize])),
            }
        }
    }
    Ok(verified(shell, &triangles).or_else(|| verified(shell, &collapsed)))
}

/// Closed parts of a cage.
fn n_parts(cage: &Cage) -> u32 {
    let mut root: Vec<u32> = (0..cage.n_vertices() as u32).collect();
    let find = |root: &mut Vec<u32>, mut v: u32| {
        while root[v as usize] != v {
            root[v as usize] = root[root[v as usize] as usize];
            v = root[v as usize];
        }
        v
    };
    let mut parts = cage.n_vertices() as u32;
    for t in cage.triangles() {
        for k in 1..3 {
            let (a, b) = (find(&mut root, t[0]), find(&mut root, t[k]));
            if a != b {
                root[a as usize] = b;
                parts -= 1;
            }
        }
    }
    parts
}

/// Corners of the box of all positions in f64.
fn bounds_of(positions: &[Vec3]) -> [DVec3; 2] {
    let points = || positions.iter().map(|p| p.as_dvec3());
    [points().fold(DVec3::INFINITY, DVec3::min), points().fold(DVec3::NEG_INFINITY, DVec3::max)]
}
