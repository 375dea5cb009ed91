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
pub(crate) mod footprint;
mod guarded;
mod lattice;
mod options;
mod pairing;
mod quadric;
mod quads;
mod relax;
mod shell;
mod smooth;
mod subdivided_box;
mod surface;
#[cfg(test)]
mod tests;
mod verify;
mod voxels;

use glam::{DVec3, Vec3};

use crate::cage::Cage;
use crate::progress::{Cancelled, Progress, ProgressEvent, Stage};
use collapse::Collapser;
use guarded::Guarded;
pub use options::{
    CLEARANCE, CageGenError, CageOptions, CageReport, DETAIL, DETAILS, GeneratedCage, MAX_CLEARANCE,
    MAX_TARGET, MAX_VOXELS, MIN_TARGET, MIN_VOXELS, Mirror, Shape, Symmetry, TARGET, VOXELS,
};
use quads::Faces;
use shell::Shell;
pub use subdivided_box::subdivided_box;
use verify::{verified, verified_faces};

/// Most lattices that are tried until the target is met.
const MAX_LATTICES: usize = 4;

/// Vertices of a cage over those asked for, above which a coarser lattice is tried.
const MAX_TARGET_RATIO: f64 = 1.1;

/// Layers of voxels around the hull in which the cage must stay, tried one after the other until the target is met:
/// as far as possible it spans no gap. At last anywhere.
const BAND_LAYERS: [Option<usize>; 5] = [Some(1), Some(2), Some(3), Some(5), None];

/// Of these, those in which a cage takes the shape that the budget allows.
const NARROW_BANDS: usize = 3;

/// Rounds in which quads that break the promise become triangles again.
const MAX_SPLITS: usize = 4;

/// Makes a cage that encloses a model strictly.
///
/// `positions`: `[n_vertices]`, object units; vertices of no triangle are enclosed, too. `triangles`:
/// `[n_triangles]`, any soup. About 30 ms for 50,000 triangles and 80 vertices on one core.
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
    let mut voxels = if options.voxels > 0 { options.voxels as usize } else { first_voxels(target) };
    let mut best: Option<GeneratedCage> = None;
    let mut tried = Vec::new();
    for attempt in 0..MAX_LATTICES {
        tried.push(voxels);
        let go_on = |stage: Stage, share: f32| {
            let fraction = (attempt as f32 + share) / (attempt + 1) as f32;
            let event = ProgressEvent { stage, fraction, iteration: attempt as u32, delta: None };
            if progress.report(event).is_break() { Err(Cancelled) } else { Ok(()) }
        };
        let shell = Shell::new(positions, triangles, bounds, voxels, options, &|share| {
            go_on(Stage::Voxelize, 0.4 * share)
        })?;
        let n_hull = shell.hull.n_whole();
        let (cage, hull) = simplified(&shell, options, &|share| go_on(Stage::Simplify, 0.4 + 0.6 * share))?;
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
            parts: n_parts(&cage),
            separate: shell.separate as u32,
            hull_vertices: n_hull as u32,
            hull,
            attempts: attempt as u32 + 1,
            elapsed_ms: progress.now_ms() - began,
        };
        let made = GeneratedCage { cage, report };
        let met = made.report.target_met;
        if best.as_ref().is_none_or(|b| made.cage.n_vertices() < b.cage.n_vertices()) {
            best = Some(made);
        }
        if met {
            break;
        }
        // The solid's handles and gaps need more vertices than asked for: a coarser lattice closes them.
        voxels = (voxels * 3 / 4).max(MIN_VOXELS);
        if tried.contains(&voxels) {
            break;
        }
    }
    let mut made = best.ok_or(CageGenError::Empty)?;
    made.report.attempts = tried.len() as u32;
    made.report.elapsed_ms = progress.now_ms() - began;
    Ok(made)
}

/// Voxels along the longest side for a target: a cage of few vertices cannot follow small gaps anyway.
fn first_voxels(target: usize) -> usize {
    ((4.0 * (target as f64).sqrt()).round() as usize).clamp(MIN_VOXELS, MAX_VOXELS)
}

/// The verified cage: as few vertices as its shape needs and at most as many as asked for, if that can be; and whether it is
/// the hull itself.
fn simplified(
    shell: &Shell,
    options: &CageOptions,
    go_on: &dyn Fn(f32) -> Result<(), Cancelled>,
) -> Result<(Cage, bool), CageGenError> {
    let n_hull = shell.hull.n_whole();
    let mut target = options.target as usize;
    // The lattice may be coarser than the first one: the budget is the model's, not the lattice's.
    let mut budget = Some(f64::from(options.detail) * shell.longest / shell.lattice.cell);
    while target < n_hull {
        let mut guarded = Guarded::new(shell.hull.clone(), &shell.obstacle);
        let mut collapser = Collapser::new(&mut guarded);
        let mut left = n_hull;
        // First as far as the budget goes, in narrow bands; then on to the count, in any.
        let narrow = BAND_LAYERS[..NARROW_BANDS].iter().map(|&layers| (layers, budget, MIN_TARGET as usize));
        let wide = BAND_LAYERS.iter().map(|&layers| (layers, None, target));
        let n_passes = (NARROW_BANDS + BAND_LAYERS.len()) as f32;
        for (k, (layers, budget, aim)) in narrow.chain(wide).enumerate() {
            if left <= aim || (budget.is_none() && left <= target) {
                continue;
            }
            collapser.surface.set_band(layers.map(|layers| shell.band(layers)));
            collapser.budget = budget;
            let from = 0.6 * k as f32 / n_passes;
            left = collapser.run(aim, &|share| go_on(from + 0.6 * share / n_passes))?;
        }
        let quadrics = collapser.quadrics;
        if let Some(cage) = relaxed(shell, guarded, &quadrics, options.quads, go_on)? {
            return Ok((cage, false));
        }
        target = left.max(target) * 2;
        budget = budget.map(|budget| 0.5 * budget);
    }
    for surface in [&shell.hull, &shell.stairs] {
        if let Some(cage) = verified(shell, surface) {
            return Ok((cage, true));
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
