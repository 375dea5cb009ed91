//! Cage generation: a coarse closed surface that follows the model's shape.
//!
//! [`generate`] accepts any triangle soup, however open, overlapping or scattered. Steps: conservative voxelisation;
//! flood fill of the outside; a dilated hull of voxels whose boundary is a 2-manifold by construction; smoothing of the
//! stairs of this boundary; edge collapses that never make the cage meet the solid or itself; relaxation and pairing
//! into quads under the same constraints. The final f32 mesh is verified as a whole. If verification fails, fewer edges
//! are collapsed; as a last resort, the cage is the hull itself ([`CageReport::hull`]).
//!
//! Sources: Xian, Lin and Gao 2009 (voxels and hull); Garland and Heckbert 1997 (quadrics); Sander et al. 2000
//! (progressive hulls). Changes: the constraint is a voxel set and a grid of the cage's own triangles instead of a
//! linear program; symmetric models are simplified as one half. `docs/notes/cage-generator.md` derives the constants.

mod buckets;
mod collapse;
mod components;
mod footprint;
mod gaps;
mod guarded;
mod lattice;
mod mirrors;
mod options;
mod pairing;
mod quadric;
mod quads;
mod relax;
mod shell;
mod smooth;
pub(crate) mod solid;
mod soup;
mod surface;
#[cfg(test)]
mod tests;
mod unfold;
mod verify;
mod voxels;

use std::cell::Cell;

use glam::{DVec3, Vec3};

use cagework_core::cage::Cage;
use cagework_core::disjoint::DisjointSets;
use cagework_core::progress::{Cancellation, Progress, ProgressEvent, Stage};
use collapse::Collapser;
use components::Components;
use gaps::{ModelGap, NarrowGaps};
use guarded::GuardedSurface;
pub(crate) use guarded::MIN_FOLD_COSINE;
use lattice::{Lattice, MARGIN_VOXELS};
use mirrors::Mirrors;
pub use options::{
    BOX_DIVISIONS, BOX_MARGIN, CLEARANCE, CageGenError, CageKind, CageOptions, CageReport, DETAIL, DIVISIONS,
    GeneratedCage, HULL_TARGET, MAX_TARGET, MAX_VOXELS, MIN_TARGET, MIN_VOXELS, Mirror, RingPlace, Rings,
    Symmetry, TARGET, VOXELS,
};
use quads::Faces;
use shell::{Shell, Spacing, VoxelHull};
use soup::Soup;
use verify::{verify_faces, verify_surface};

/// Limit on the number of lattices that are tried to meet the target.
const MAX_LATTICES: usize = 4;

/// A coarser lattice is tried if a cage has more than this multiple of the target number of vertices.
const MAX_TARGET_RATIO: f64 = 1.1;

/// A cage that is symmetric in one plane only is preferred if the cage with all planes of the model has more than this
/// multiple of its vertices.
const MIN_SAVING: f64 = 1.6;

/// Layers of voxels around the hull to which the cage is confined, tried in this order until the target is met. Narrow
/// bands keep the cage from spanning gaps; `None` does not confine it.
const BAND_LAYERS: [Option<usize>; 5] = [Some(1), Some(2), Some(3), Some(5), None];

/// Smallest area of the gaps that must stay open, as a share of the largest gap's area. The shares are tried in this
/// order until the target is met.
const MIN_GAP_SHARES: [f64; 3] = [0.0, 0.3, f64::INFINITY];

/// Number of the first passes, which collapse edges only within the allowed distance from the hull
/// ([`CageOptions::detail`]): one pass for each of the first [`BAND_LAYERS`].
const N_NARROW_BANDS: usize = 3;

/// For models in several pieces, and on lattices refined for gaps: a coarser lattice is tried without further passes if
/// the collapses within the allowed distance leave more than this multiple of the target. Bridges between pieces and
/// walls of gaps cannot be collapsed.
const MAX_FIRST_RATIO: f64 = 5.0;

/// Estimated ratio of the number of vertices after the collapses within the allowed distance to the final number. If
/// [`MAX_FIRST_RATIO`] ends the passes early, this ratio predicts the final number.
const LATER_RATIO: f64 = 3.7;

/// Limit on the rows of voxels in the bounding boxes of all triangles, which many triangles as large as the model
/// exceed. Voxelising that many rows takes about 2 s.
const MAX_ROWS: f64 = 1.3e8;

/// Share of a gap's sheet up to which a cage may close it without a flaw.
const MIN_CLOSED_SHARE: f64 = 0.1;

/// Share of a gap's sheet inside a cage above which the cage closes the gap.
const MAX_OPEN_SHARE: f64 = 0.5;

/// Share of a gap's sheet inside a cage above which the gap is reported.
const MIN_REPORTED_SHARE: f64 = 0.25;

/// Area of a closed gap that counts as much as a handle that the model lacks, as a fraction of the squared longest side.
const HANDLE_AREA: f64 = 0.001;

/// Limit on the voxels along the longest side of the lattice whose closed gaps are looked for.
const GAP_VOXELS: usize = 36;

/// Estimated number of vertices per open gap: a ring on each side.
const VERTICES_PER_GAP: usize = 10;

/// Limit on the vertices of a hull, or of its half with a mirror, on a lattice refined for gaps. Collapsing that many
/// takes about three seconds.
const MAX_HULL: usize = 26_000;

/// The same limit if the number of voxels is given, or a lattice keeps components apart.
const MAX_FINE_HULL: usize = 2 * MAX_HULL;

/// Limit on the searches of all attempts at a cage, in visits ([`GuardedSurface::visits`]). Most models take 1 to 10
/// million; that many take about seven seconds.
const MAX_VISITS: u64 = 40_000_000;

/// Number of rows of voxels, of [`MAX_ROWS`], that take as long as a visit.
const ROWS_PER_VISIT: f64 = 10.0;

/// Number of visits that take as long as making a hull, for each of its vertices.
const VISITS_PER_VERTEX: usize = 60;

/// Limit on the gaps that a report names.
const MAX_NOTICES: usize = 3;

/// Limit on rounds that split quads back into triangles where verification fails.
const MAX_SPLIT_ROUNDS: usize = 4;

pub(crate) use options::check as check_input;

/// Generates a hull ([`CageKind::Hull`]) or a shell (all other kinds) that strictly encloses a model. With
/// [`CageOptions::smooth`], the subdivided surface encloses the model.
///
/// `positions`: `[n_vertices]`, object units; vertices without triangles are enclosed, too. `triangles`:
/// `[n_triangles]`, any soup. A cage of 80 vertices for a human figure takes 0.2 to 1.5 s on one core, most of it for
/// the gaps between limbs.
///
/// # Errors
/// [`CageGenError`]: the model is empty, numbers or options are out of range, no cage passes verification, or the work
/// is cancelled.
pub fn generate(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    options: &CageOptions,
    progress: &dyn Progress,
) -> Result<GeneratedCage, CageGenError> {
    if options.smooth > 0 {
        return smooth::generate(positions, triangles, options, &Effort::default(), progress);
    }
    generate_plain(positions, triangles, options, &Effort::default(), progress)
}

/// Visits of the searches for a cage that are left of [`MAX_VISITS`].
struct Effort(Cell<u64>);

impl Default for Effort {
    fn default() -> Self {
        Self(Cell::new(MAX_VISITS))
    }
}

impl Effort {
    /// Limit on the visits of the next attempt: half of what is left, because coarser lattices may follow.
    fn next_limit(&self) -> u64 {
        self.0.get() / 2
    }

    /// Whether most of the visits are spent.
    fn is_low(&self) -> bool {
        self.0.get() < MAX_VISITS / 2
    }

    fn spend(&self, visits: u64) {
        self.0.set(self.0.get().saturating_sub(visits));
    }

    /// Spends what making hulls with that many vertices takes, but at most half of what is left, so that some remains
    /// for simplifying them.
    fn spend_on_hulls(&self, n_vertices: usize) {
        self.spend(self.next_limit().min((VISITS_PER_VERTEX * n_vertices) as u64));
    }
}

/// Generates a cage that encloses the model without subdivision.
fn generate_plain(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    options: &CageOptions,
    effort: &Effort,
    progress: &dyn Progress,
) -> Result<GeneratedCage, CageGenError> {
    let bounds = options::check(positions, triangles, options)?;
    let soup = Soup::new(positions, triangles);
    let began = progress.now_ms();
    let target = options.target as usize;
    let go_on = |_| {
        let event = ProgressEvent { stage: Stage::Voxelize, fraction: 0.0, iteration: 0, delta: None };
        if progress.report(event).is_break() { Err(Cancellation) } else { Ok(()) }
    };
    let finest = Lattice::around(bounds, MAX_VOXELS, DVec3::ONE, MARGIN_VOXELS);
    let rows = finest.n_rows(positions, triangles, &go_on)?;
    effort.spend((MAX_ROWS.min(rows as f64) / ROWS_PER_VISIT) as u64);
    let affordable = affordable_voxels(rows);
    let base = first_voxels(target).min(affordable);
    let most_gaps = target / VERTICES_PER_GAP;
    let narrow = match (options.kind, options.smooth) {
        // The lattice is refined for gaps only without subdivision: a subdivided surface lies inside its cage, and the
        // finer lattice would leave less space between the cage and the model.
        (kind, 0) if kind != CageKind::Hull && affordable == MAX_VOXELS => {
            // The lattice for gaps does not depend on the target, so that more vertices do not close a gap.
            let clearance = options.distance(bounds);
            gaps::narrow_gaps(&soup, bounds, clearance, [base.min(GAP_VOXELS), target], &go_on)?
        }
        _ => NarrowGaps {
            gaps: Vec::new(),
            n_kept: 0,
            keeps: true,
            handles: usize::MAX,
            stretch: DVec3::ONE,
            voxels: base,
        },
    };
    let mirrors = shell::find_mirrors(&soup, bounds, affordable, options, &go_on)?;
    let components = match (options.per_component, options.kind) {
        (true, kind) if kind != CageKind::Hull => {
            let of = (mirrors, narrow.handles);
            let hull =
                |n| VoxelHull::new(positions, triangles, bounds, (n, narrow.stretch), of, options, &go_on);
            let n_vertices = Cell::new(0);
            let parts = |n| {
                let hull = hull(n)?;
                n_vertices.set(n_vertices.get() + hull.n_vertices());
                Ok((hull.separate, hull.n_vertices()))
            };
            let found = Components::find(parts, [base, affordable], target)?;
            effort.spend_on_hulls(n_vertices.get());
            found
        }
        _ => Components::ONE,
    };
    let stretch = narrow.stretch;
    let voxels = match options.voxels {
        0 if stretch == DVec3::ONE => narrow.voxels.max(base),
        0 => narrow.voxels,
        asked => asked as usize,
    };
    // Filling passages may close a gap, so lattices whose gaps stay open are first tried without.
    let first = Start { voxels, stretch, mirrors, fills: !narrow.keeps || narrow.gaps.is_empty() };
    let mut starts = vec![first, Start { fills: true, ..first }];
    if options.voxels == 0 {
        if stretch == DVec3::ONE {
            starts.push(Start { voxels: (voxels * 3 / 2).min(affordable), ..first });
        }
        let coarse = [base, GAP_VOXELS.min(affordable)];
        starts.extend(coarse.map(|voxels| Start { voxels, stretch: DVec3::ONE, fills: true, ..first }));
    }
    if options.symmetry == Symmetry::Auto {
        // With mirrors, a bridge between components has images, and each makes a handle.
        starts.push(Start { mirrors: Mirrors::NONE, ..first });
    }
    starts.iter_mut().for_each(|start| start.voxels = start.voxels.max(components.voxels));
    let model = Model { soup, bounds, base, most_gaps, least: components.voxels, narrow, effort };
    let mut best: Option<(Flaws, Attempt)> = None;
    let mut attempts = 0;
    for k in 0..starts.len() {
        let is_in_pieces = best.as_ref().is_some_and(|(_, made)| made.shell.separate > 1);
        if starts[..k].contains(&starts[k]) || (k > 0 && starts[k].mirrors.is_empty() && !is_in_pieces) {
            continue;
        }
        let start = starts[k];
        if best.as_ref().is_some_and(|(_, made)| made.voxels < made.first) && start.voxels > first.voxels {
            continue;
        }
        // Without superfluous handles, there are no passages to fill.
        let fills_only = start == Start { fills: true, ..starts[0] };
        if k > 0 && fills_only && best.as_ref().is_some_and(|(flaws, _)| flaws.handles == 0) {
            continue;
        }
        // Only the first lattice is replaced by coarser ones if the cage needs too many vertices.
        let n_lattices = if start.voxels == first.voxels { MAX_LATTICES } else { 1 };
        let made = model.attempt(start, n_lattices, options, &mut attempts, progress)?;
        let Some(made) = made else { continue };
        let flaws = model.flaws(&made.cage, target);
        let is_best = best.as_ref().is_none_or(|(least, _)| flaws.is_less(least));
        if is_best {
            best = Some((flaws, made));
        }
        if best.as_ref().is_some_and(|(flaws, _)| flaws.topology == 0.0) {
            break;
        }
    }
    let Some((_, Attempt { cage, shell, hull, voxels, .. })) = best else {
        let error = if effort.is_low() { CageGenError::TooLong } else { CageGenError::Unresolved };
        return Err(error);
    };
    let (parts, first) = (n_parts(&cage), first.voxels.max(model.least));
    let coarser = (options.voxels > 0 && voxels < first).then(|| {
        format!(
            "the lattice has {voxels} voxels instead of {first}, with which the cage needs more than {} vertices",
            options.target
        )
    });
    let closed = model.narrow.gaps.iter().filter_map(|gap| {
        let share = gap.closed_share(&cage);
        (share > MIN_REPORTED_SHARE).then(|| gap.notice(share, [first, voxels], options))
    });
    let report = CageReport {
        kind: if options.kind == CageKind::Hull { CageKind::Hull } else { CageKind::Shell },
        refusal: None,
        target: options.target,
        vertices: cage.n_vertices() as u32,
        faces: cage.faces().len() as u32,
        quads: cage.faces().iter().filter(|face| face.len() == 4).count() as u32,
        target_met: cage.n_vertices() as f64 <= MAX_TARGET_RATIO * target as f64,
        voxels: voxels as u32,
        voxel_size: shell.lattice.cell as f32,
        clearance: shell.clearance as f32,
        mirror: shell.hull.mirrors.axes().next().map(Mirror::of_axis),
        notices: components
            .notice(parts, options)
            .into_iter()
            .chain(coarser)
            .chain(closed.take(MAX_NOTICES))
            .collect(),
        parts,
        separate: shell.separate as u32,
        hull_vertices: shell.hull.n_whole() as u32,
        hull,
        attempts,
        elapsed_ms: progress.now_ms() - began,
    };
    Ok(GeneratedCage { cage, report, rings: None })
}

/// A lattice to try, and how its hull is made.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Start {
    /// Voxels along the model's longest side.
    voxels: usize,
    /// Longest edge of a voxel divided by its edge along each axis.
    stretch: DVec3,
    mirrors: Mirrors,
    /// Whether passages are filled that make handles which the model lacks.
    fills: bool,
}

/// A model and what its cages have in common.
struct Model<'a> {
    soup: Soup<'a>,
    bounds: [DVec3; 2],
    /// Voxels along the longest side without gaps, and the smallest number that keeps components apart.
    base: usize,
    least: usize,
    /// Limit on the gaps that a cage keeps open.
    most_gaps: usize,
    narrow: NarrowGaps,
    effort: &'a Effort,
}

/// A verified cage, and how it was made.
struct Attempt {
    cage: Cage,
    shell: Shell,
    /// Whether the cage is the hull without simplification.
    hull: bool,
    /// Voxels along the longest side of the first lattice, and of the lattice on which the cage was made.
    first: usize,
    voxels: usize,
}

/// What a cage lacks.
#[derive(Debug)]
struct Flaws {
    /// Sum of the areas of the gaps that the cage closes, in [`HANDLE_AREA`], plus the number of handles that the model
    /// lacks.
    topology: f64,
    /// Number of handles that the model lacks.
    handles: usize,
    /// Volume of the cage, which measures its distance from the model, times its number of vertices.
    size: f64,
}

impl Flaws {
    fn is_less(&self, other: &Self) -> bool {
        [self.topology, self.size] < [other.topology, other.size]
    }
}

impl Model<'_> {
    fn flaws(&self, cage: &Cage, target: usize) -> Flaws {
        let closed = |gap: &ModelGap| {
            let share = gap.closed_share(cage);
            match share {
                MAX_OPEN_SHARE.. => gap.area,
                MIN_CLOSED_SHARE.. => share * gap.area,
                _ => 0.0,
            }
        };
        let closed = self.narrow.gaps[..self.narrow.n_kept].iter().map(closed).sum::<f64>();
        let n_handles =
            i64::from(n_parts(cage)) - (cage.n_vertices() as i64 - cage.triangles().len() as i64 / 2) / 2;
        let handles = (n_handles.max(0) as usize).saturating_sub(self.narrow.handles);
        let corners = (0..cage.triangles().len() as u32).map(|t| cage.triangle_corners(t));
        let volume = corners.map(|[a, b, c]| a.dot(b.cross(c))).sum::<f64>() / 6.0;
        let topology = closed / HANDLE_AREA + handles as f64;
        Flaws { topology, handles, size: volume * cage.n_vertices().max(target / 2) as f64 }
    }

    /// Makes a cage on a lattice of `first` voxels along the model's longest side, or on a coarser one if the cage needs
    /// too many vertices. `None` if no cage passes verification.
    fn attempt(
        &self,
        Start { voxels: first, stretch, mirrors, fills }: Start,
        n_lattices: usize,
        options: &CageOptions,
        attempts: &mut u32,
        progress: &dyn Progress,
    ) -> Result<Option<Attempt>, CageGenError> {
        let (base, least, target) = (self.base, self.least.min(first), options.target as usize);
        let (mut voxels, mut mirrors) = (first, mirrors);
        for attempt in 1..=n_lattices {
            *attempts += 1;
            let done = *attempts;
            let go_on = |stage: Stage, share: f32| {
                let fraction = (done as f32 - 1.0 + share) / done as f32;
                let event = ProgressEvent { stage, fraction, iteration: done - 1, delta: None };
                if progress.report(event).is_break() { Err(Cancellation) } else { Ok(()) }
            };
            let Soup { positions, triangles, .. } = self.soup;
            let hull_of = |mirrors: Mirrors| -> Result<VoxelHull, Cancellation> {
                let of = (mirrors, if fills { self.narrow.handles } else { usize::MAX });
                let voxelize = |share| go_on(Stage::Voxelize, 0.4 * share);
                let lattice = (voxels, stretch);
                let hull =
                    VoxelHull::new(positions, triangles, self.bounds, lattice, of, options, &voxelize)?;
                self.effort.spend_on_hulls(hull.n_vertices());
                Ok(hull)
            };
            let shell_of = |hull: VoxelHull| {
                let mut shell = hull.smoothed();
                if self.narrow.keeps {
                    shell.find_gaps(&self.soup, [voxels, self.most_gaps]);
                }
                shell
            };
            let hull = hull_of(mirrors)?;
            // Gaps and handles (in the sense of topology) of the solid may need more vertices than the target; a coarser
            // lattice closes them.
            let may_coarsen = attempt < MAX_LATTICES && voxels > least;
            let may_shrink = attempt < n_lattices && may_coarsen;
            let n_half = hull.n_vertices();
            let max_hull = if options.voxels == 0 { MAX_HULL } else { MAX_FINE_HULL };
            if voxels > base && may_shrink && n_half > max_hull {
                let shrunk = voxels as f64 * (0.9 * max_hull as f64 / n_half as f64).sqrt();
                voxels = (shrunk as usize).max(base).max(least);
                continue;
            }
            let shell = shell_of(hull);
            let simplify = |share| go_on(Stage::Simplify, 0.4 + 0.6 * share);
            let (mut cage, hull) = match simplify_hull(&shell, options, may_coarsen, self.effort, &simplify) {
                Ok(Simplification::Cage(cage, hull)) => (*cage, hull),
                Ok(Simplification::TooMany(_)) if mirrors.len() > 1 => {
                    mirrors = mirrors.first();
                    continue;
                }
                Ok(Simplification::TooMany(left)) => {
                    let ratio = (target as f64 / left as f64).sqrt().clamp(0.4, 0.7);
                    let lowest = if voxels > base { base.max(least) } else { least };
                    voxels = ((ratio * voxels as f64) as usize).max(lowest);
                    continue;
                }
                Err(CageGenError::Unresolved) => return Ok(None),
                Err(error) => return Err(error),
            };
            let mut shell = shell;
            if mirrors.len() > 1 && cage.n_vertices() > MIN_TARGET as usize {
                // Crossings of several mirror planes may cost vertices, and these may be missing for gaps.
                let of_one = shell_of(hull_of(mirrors.first())?);
                let other = simplify_hull(&of_one, options, may_coarsen, self.effort, &simplify);
                if let Err(CageGenError::Cancelled(cancelled)) = other {
                    return Err(cancelled.into());
                }
                if let Ok(Simplification::Cage(other, false)) = other {
                    let [all, one] = [&cage, &*other].map(|cage| self.flaws(cage, target).topology);
                    let saves = other.n_vertices() as f64 * MIN_SAVING < cage.n_vertices() as f64;
                    if one < all || (one == all && saves) {
                        (cage, shell) = (*other, of_one);
                    }
                }
            }
            return Ok(Some(Attempt { cage, shell, hull, first, voxels }));
        }
        Ok(None)
    }
}

/// Returns the initial number of voxels along the longest side. It grows with the target, as a cage of few vertices
/// cannot follow small gaps.
fn first_voxels(target: usize) -> usize {
    ((4.0 * (target as f64).sqrt()).round() as usize).clamp(MIN_VOXELS, MAX_VOXELS)
}

/// Computes the number of voxels along the longest side with which voxelising visits about [`MAX_ROWS`] rows, from the
/// number of rows with [`MAX_VOXELS`].
fn affordable_voxels(rows: usize) -> usize {
    ((MAX_VOXELS as f64 * (MAX_ROWS / rows as f64).sqrt()) as usize).clamp(MIN_VOXELS, MAX_VOXELS)
}

/// Outcome of simplifying a hull.
enum Simplification {
    /// The verified cage, and whether it is the hull without simplification.
    Cage(Box<Cage>, bool),
    /// Too many vertices are left: try a coarser lattice. The value is their number, or an estimate of the final
    /// number.
    TooMany(usize),
}

/// Simplifies a hull to as few vertices as its shape needs, at most the target if possible, and verifies the result.
fn simplify_hull(
    shell: &Shell,
    options: &CageOptions,
    may_coarsen: bool,
    effort: &Effort,
    go_on: &dyn Fn(f32) -> Result<(), Cancellation>,
) -> Result<Simplification, CageGenError> {
    let n_hull = shell.hull.n_whole();
    let mut target = options.target as usize;
    // The allowed distance is a share of the model's size, so its value in voxels depends on the lattice.
    let mut budget = Some(f64::from(options.detail) * shell.longest / shell.lattice.cell);
    while target < n_hull {
        let mut guarded = GuardedSurface::new(shell.hull.clone(), &shell.obstacle);
        let spacings = shell.spacings();
        let has_plates = spacings.iter().flatten().any(|spacing| spacing.along.is_none());
        let mut collapser = Collapser::new(&mut guarded, spacings);
        collapser.max_visits = effort.next_limit();
        let mut left = n_hull;
        // The first passes collapse edges within the allowed distance, in narrow bands. Later passes ignore this
        // distance and collapse edges down to the target, in any band.
        let narrow = BAND_LAYERS[..N_NARROW_BANDS]
            .iter()
            .map(|&layers| (layers, budget, MIN_TARGET as usize, 0.0, false, true));
        // The passes give up one goal after another until the target is met: first the limit on the spacing of vertices
        // on plates, then the limit on folds, and last, with a larger `least`, open gaps.
        let passes_of_gaps = |&least| {
            let plates = BAND_LAYERS.iter().map(move |&layers| (layers, None, target, least, false, true));
            let plain = BAND_LAYERS.iter().map(move |&layers| (layers, None, target, least, false, false));
            plates.chain(plain).chain([(None, None, target, least, true, false)])
        };
        let wide = MIN_GAP_SHARES.iter().flat_map(passes_of_gaps);
        let n_passes = (N_NARROW_BANDS + MIN_GAP_SHARES.len() * (2 * BAND_LAYERS.len() + 1)) as f32;
        for (k, (layers, budget, aim, least, may_fold, keeps_plates)) in narrow.chain(wide).enumerate() {
            let is_repeated =
                (least > 0.0 && shell.gaps.is_empty()) || (budget.is_none() && keeps_plates && !has_plates);
            let is_far = left as f64 > MAX_FIRST_RATIO * f64::from(options.target);
            let is_in_pieces = shell.separate > options.target as usize / 10;
            let is_refined = !shell.gaps.is_empty() && shell.fineness > 1.0;
            if k == N_NARROW_BANDS && may_coarsen && is_far && (is_in_pieces || is_refined) {
                return Ok(Simplification::TooMany((left as f64 / LATER_RATIO) as usize));
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
        effort.spend(collapser.surface.visits());
        if collapser.is_exhausted()
            || may_coarsen && left as f64 > MAX_TARGET_RATIO * f64::from(options.target)
        {
            return Ok(Simplification::TooMany(left));
        }
        // Convert to voxels of the lattice of `first_voxels`, so that relaxation weighs distance against shape in the
        // same way on every lattice.
        let quadrics: Vec<_> = collapser.quadrics.iter().map(|q| q.in_units(shell.fineness)).collect();
        let limits = budget.filter(|_| options.quads).map(|budget| (budget, collapser.spacings));
        if let Some(cage) = relax_and_verify(shell, guarded, &quadrics, limits, go_on)? {
            return Ok(Simplification::Cage(Box::new(cage), false));
        }
        target = left.max(target) * 2;
        budget = budget.map(|budget| 0.5 * budget);
    }
    for surface in [&shell.hull, &shell.stairs] {
        if let Some(cage) = verify_surface(shell, surface) {
            return Ok(Simplification::Cage(Box::new(cage), true));
        }
    }
    Err(CageGenError::Unresolved)
}

/// Relaxes a collapsed surface, pairs triangles into quads where the result passes verification, and returns the cage.
/// `limits`: distance in voxels and spacings within which vertices on mirror planes are removed; `None` for triangles
/// only.
fn relax_and_verify(
    shell: &Shell,
    mut guarded: GuardedSurface<'_>,
    quadrics: &[quadric::Quadric],
    limits: Option<(f64, Vec<Option<Spacing>>)>,
    go_on: &dyn Fn(f32) -> Result<(), Cancellation>,
) -> Result<Option<Cage>, Cancellation> {
    let collapsed = guarded.surface();
    unfold::unfold(&mut guarded, false);
    relax::relax(&mut guarded, quadrics, &|share| go_on(0.6 + 0.2 * share))?;
    let triangles = guarded.surface();
    if let Some((budget, spacings)) = limits {
        let mut pairing = quads::quads(&mut guarded, quadrics, &|share| go_on(0.8 + 0.2 * share))?;
        let needless = quads::needless_planes(&guarded, &pairing, budget, &spacings);
        let without = || quads::faces(&guarded, &pairing, needless);
        if !needless.is_empty()
            && let Some(cage) = without().and_then(|f| verify_faces(shell, &f.positions, f.faces).ok())
        {
            return Ok(Some(cage));
        }
        for _ in 0..MAX_SPLIT_ROUNDS {
            let Some(Faces { positions, faces, first }) = quads::faces(&guarded, &pairing, Mirrors::NONE)
            else {
                break;
            };
            match verify_faces(shell, &positions, faces) {
                Ok(cage) => return Ok(Some(cage)),
                Err(wrong) if wrong.is_empty() => break,
                Err(wrong) => wrong.iter().for_each(|&face| pairing.part(first[face as usize])),
            }
        }
    }
    Ok(verify_surface(shell, &triangles).or_else(|| verify_surface(shell, &collapsed)))
}

fn n_parts(cage: &Cage) -> u32 {
    let mut sets = DisjointSets::new(cage.n_vertices());
    let mut parts = cage.n_vertices() as u32;
    for &[a, b, c] in cage.triangles() {
        parts -= u32::from(sets.join(a, b)) + u32::from(sets.join(a, c));
    }
    parts
}

fn bounds_of(positions: &[Vec3]) -> [DVec3; 2] {
    let points = || positions.iter().map(|p| p.as_dvec3());
    [points().fold(DVec3::INFINITY, DVec3::min), points().fold(DVec3::NEG_INFINITY, DVec3::max)]
}
