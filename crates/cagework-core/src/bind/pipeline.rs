//! The stages of a bind: voxelize; per batch, solve and sample; assemble.
//!
//! All back ends share [`PreparedBind::new`] and [`PreparedBind::finish`]. Between these two calls, the solver of the
//! back end produces a [`Solution`].

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::Vec3;

use crate::assemble::{AssembledWeights, RowOptions, assemble};
use crate::controls::{ControlSet, Controls, InnerControls};
use crate::crossing;
use crate::deform::{OutsideVertex, outside_in_words};
use crate::frames::Frames;
use crate::grid::Grid;
use crate::mesh::Weld;
use crate::narrow::NarrowPlaces;
use crate::options::{Backend, BindOptions, Method, OutsidePolicy};
use crate::progress::{Progress, ProgressEvent, Stage};
use crate::report::{BindReport, MemoryBytes, Timings, WeightStats};
use crate::sample::{OutsidePoint, Stencils};
use crate::solve::hierarchy::Hierarchy;
use crate::team::{Team, VERTEX_RUN};
use crate::weights::Weights;
use crate::words::counted;

use super::fineness::{self, GridChoice};
use super::memory::{estimate, needs_all, updates};
use super::offsets::{JointPoints, Offsets};
use super::outside::{oversized, refuse_outside};
use super::points::WeldedPoints;
pub use super::solving::Solution;
use super::solving::solve_and_sample;
use super::voxels::{Voxelization, VoxelizedCage, check_overlaps};
use super::watch::Watch;
use super::{BindError, Binding};

/// Notice of the report if conjugate gradients finished the solve.
const STALL_NOTICE: &str = "Multigrid converged slowly, as it does around many small parts or controls inside the cage: conjugate \
                       gradients finished the solve on the processor.";

/// Where the fields of a solve are stored. Only fields in host memory count towards the memory limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldStorage {
    /// In the memory of this process.
    Host,
    /// In GPU memory, whose use the GPU back end plans.
    Device,
}

/// A bind before the solve: grid and sampling stencils.
pub struct PreparedBind<'a> {
    mesh: WeldedPoints<'a>,
    controls: Controls<'a>,
    options: BindOptions,
    fineness: Fineness,
    pub(super) voxelized: Arc<VoxelizedCage>,
    stencils: Stencils,
    estimated: u64,
    /// Times on the watch's clock, in milliseconds: start, end of voxelization, end of the stencils.
    times_ms: [f64; 3],
}

/// Choice of the grid, and notices about places that it does not resolve.
#[derive(Clone, Debug)]
pub(super) struct Fineness {
    pub(super) choice: GridChoice,
    unresolved: Option<String>,
}

impl Fineness {
    /// Chooses the grid of the options. `fits`: whether a bind with these options stays within the memory limit.
    pub(super) fn new(
        controls: Controls<'_>,
        options: &BindOptions,
        fits: impl Fn(&BindOptions) -> bool,
    ) -> Self {
        let places = NarrowPlaces::new(controls);
        let choice = fineness::choose(options, &places, fits, |options| updates(controls, options));
        // Classic cells count wherever the cage touches them, so no part is too thin.
        let unresolved = match options.method {
            Method::Classic => None,
            Method::Embedded => places.unresolved(choice.cells).map(|places| places.to_string()),
        };
        Self { choice, unresolved }
    }
}

pub(super) fn run(
    positions: &[Vec3],
    controls: Controls<'_>,
    options: &BindOptions,
    progress: &dyn Progress,
) -> Result<Binding, BindError> {
    let watch = Watch::new(progress);
    let prepared = PreparedBind::new(positions, controls, options, FieldStorage::Host, &watch)?;
    let solved = prepared.solve(&watch)?;
    prepared.finish(solved, &watch)
}

impl<'a> PreparedBind<'a> {
    /// Checks the input, voxelizes the surface and computes every vertex's sampling stencil.
    ///
    /// # Errors
    /// As [`super::bind`].
    pub fn new(
        positions: &'a [Vec3],
        controls: Controls<'a>,
        options: &BindOptions,
        fields: FieldStorage,
        watch: &Watch<'_>,
    ) -> Result<Self, BindError> {
        options.check()?;
        let began = watch.now_ms();
        let mesh = WeldedPoints::new(positions)?;
        check_overlaps(controls.surface())?;
        let team = Team::new(options.threads);
        watch.report(Stage::Voxelize, 0.0, 0, None)?;
        let field_threads = if fields == FieldStorage::Host { team.n_threads() } else { 0 };
        let needed = |options: &BindOptions| {
            let grid = Voxelization::grid(controls.surface(), options);
            estimate(controls, &grid, mesh.count(), field_threads, options)
        };
        let fits = |options: &BindOptions| needed(options).bytes <= options.memory_limit;
        let fineness = Fineness::new(controls, options, fits);
        let options = BindOptions { grid: fineness.choice.cells, ..*options };
        let needed = needed(&options);
        needed.check(mesh.count(), controls.n_controls(), options.memory_limit)?;
        let grid = Voxelization::grid(controls.surface(), &options);
        let voxelized = Arc::new(VoxelizedCage::new(controls, grid, &options, team, watch)?);
        Self::in_grid(mesh, controls, (options, fineness), voxelized, needed.bytes, began, watch)
    }

    /// Computes the stencils in a grid that is already voxelized. `estimated`: memory, bytes; `began`: start on the
    /// watch's clock, ms.
    pub(super) fn in_grid(
        mesh: WeldedPoints<'a>,
        controls: Controls<'a>,
        (options, fineness): (BindOptions, Fineness),
        voxelized: Arc<VoxelizedCage>,
        estimated: u64,
        began: f64,
        watch: &Watch<'_>,
    ) -> Result<Self, BindError> {
        let voxelized_ms = watch.now_ms();
        let stencils = sampling_stencils(controls, &voxelized, &mesh.points, options.outside, watch)?;
        refuse_outside(controls, &mesh, &stencils, &options)?;
        let times_ms = [began, voxelized_ms, watch.now_ms()];
        Ok(Self { mesh, controls, options, fineness, voxelized, stencils, estimated, times_ms })
    }

    /// The discrete problem on all levels.
    #[must_use]
    pub fn hierarchy(&self) -> &Hierarchy {
        &self.voxelized.voxels.hierarchy
    }

    /// Sampling stencils, one per distinct vertex position.
    #[must_use]
    pub fn stencils(&self) -> &Stencils {
        &self.stencils
    }

    fn solve(&self, watch: &Watch<'_>) -> Result<Solution, BindError> {
        Ok(solve_and_sample(self.hierarchy(), &self.stencils, &self.options, &self.voxelized.team, watch)?)
    }

    /// Solves and samples all columns in this process, as a fallback if the GPU cannot.
    ///
    /// # Errors
    /// If the memory exceeds the limit, or the bind is cancelled.
    pub fn solve_on_host(&mut self, watch: &Watch<'_>) -> Result<Solution, BindError> {
        let (vertices, threads) = (self.mesh.count(), self.voxelized.team.n_threads());
        let needed =
            estimate(self.controls, &self.hierarchy().levels[0].grid, vertices, threads, &self.options);
        needed.check(vertices, self.controls.n_controls(), self.options.memory_limit)?;
        self.estimated = needed.bytes;
        self.solve(watch)
    }

    /// Assembles weights and report from the sampled columns.
    ///
    /// # Errors
    /// [`BindError::Cancelled`] if the bind is cancelled.
    pub fn finish(self, mut solved: Solution, watch: &Watch<'_>) -> Result<Binding, BindError> {
        let sampled = watch.now_ms();
        watch.report(Stage::Sample, 0.5, solved.iterations, None)?;
        let row_options = RowOptions {
            threshold: self.options.sparsify,
            preserve_affine: self.options.method == Method::Embedded,
        };
        let all = needs_all(self.controls, &self.options);
        let has_offset = |point| all || self.stencils.is_outside(point);
        let blocks_bytes: usize = solved.blocks.iter().map(|b| size_of_val(b.as_slice())).sum();
        let (points, team) = (&self.mesh.points, &self.voxelized.team);
        let joints = bound_joints(self.controls, &self.options, watch)?;
        let offsets = Offsets::new(self.controls, &self.stencils, &solved.blocks, joints);
        let rows = assemble(self.controls, &mut solved.blocks, points, row_options, has_offset, team);
        drop(std::mem::take(&mut solved.blocks));
        let (rows, frames) = offsets.add_to(rows, points, has_offset);
        self.reported((rows, frames), blocks_bytes, solved, sampled, watch)
    }

    /// Builds the binding of all vertices, with its report. `sampled`: time at which sampling ended, on the watch's
    /// clock.
    fn reported(
        self,
        (rows, frames): (AssembledWeights, Frames),
        blocks_bytes: usize,
        solved: Solution,
        sampled: f64,
        watch: &Watch<'_>,
    ) -> Result<Binding, BindError> {
        let Self {
            mesh: WeldedPoints { positions, welded, points },
            controls,
            options,
            fineness,
            stencils,
            ..
        } = self;
        let VoxelizedCage { team, voxels } = &*self.voxelized;
        let [began, voxelized, stencils_made] = self.times_ms;
        let cage = controls.surface();
        let (rest_error, raw_error, weight_stats) = rows.statistics(f64::from(cage.diagonal()));
        let held =
            options.held as usize + size_of_val(welded.unique_of.as_slice()) + size_of_val(points.as_slice());
        let held = held + voxels.bytes + stencils.bytes();
        let of_points = rows.weights.bytes();
        let all_differ = points.len() == positions.len();
        let weights = if all_differ { rows.weights } else { rows.weights.with_rows(&welded.unique_of) };
        let copies = if all_differ { 0 } else { weights.bytes() };
        let peak = held + (blocks_bytes + solved.field_bytes).max(of_points + blocks_bytes.max(copies));
        watch.report(Stage::Sample, 1.0, solved.iterations, None)?;
        let ended = watch.now_ms();

        let n_vertices = positions.len().saturating_sub(options.extra_points);
        let solve_ms = (sampled - stencils_made) * solved.solve_share;
        let level = &voxels.hierarchy.levels[0];
        let mut notices = crossing::notices(controls.cage());
        notices.extend(team.notice(options.threads).into_iter().chain(fineness.unresolved));
        notices.extend(notices_of(controls, &level.grid, options.grid));
        let (outside, held_vertices) = outside_of(&stencils.outside, &welded, n_vertices);
        let vertices = &positions[..n_vertices];
        notices.extend(oversized(cage.bounds(), vertices, &outside, &weights, controls.n_controls()));
        notices.extend(solved.report.stalled.then(|| STALL_NOTICE.to_owned()));
        let of_vertices = || outside.iter().filter(|o| (o.vertex as usize) < n_vertices);
        notices.extend(outside_in_words(of_vertices(), cage.diagonal()));
        let narrow = |history: Vec<f64>| history.into_iter().map(|x| x as f32).collect();
        let report = BindReport {
            method: options.method,
            solver: options.solver,
            backend: if solved.adapter.is_some() { Backend::Gpu } else { Backend::Cpu },
            adapter: solved.adapter,
            threads: team.n_threads(),
            grid: options.grid,
            grid_reason: fineness.choice.reason,
            dims: level.grid.dims,
            cell_size: level.grid.cell.as_vec3().to_array(),
            tau: options.tau,
            cells: voxels.counts,
            levels: voxels.hierarchy.levels.iter().map(|l| l.n_unknowns() as u64).collect(),
            iterations: solved.iterations,
            converged: solved.report.converged,
            at_round_off: solved.report.at_round_off,
            delta_history: narrow(solved.report.deltas),
            delta_interval: solved.delta_interval,
            residual_history: narrow(solved.report.residuals),
            timings_ms: Timings {
                voxelize: voxelized - began,
                solve: solve_ms,
                sample: (ended - voxelized) - solve_ms,
                total: ended - began,
            },
            memory_bytes: MemoryBytes { estimated: self.estimated + solved.planned_bytes, peak: peak as u64 },
            rest_error,
            raw_error,
            weights: WeightStats { nonzeros: weights.indptr()[n_vertices] as u64, ..weight_stats },
            vertices: n_vertices as u64,
            cage_vertices: controls.cage().n_vertices() as u64,
            inner_controls: (controls.n_controls() - controls.cage().n_vertices()) as u64,
            smooth: controls.smooth(),
            outside_vertices: of_vertices().count() as u64,
            staying_vertices: of_vertices().filter(|o| o.share == 0.0).count() as u64,
            outside_distance: of_vertices().map(|o| o.distance).fold(0.0, f32::max),
            held_vertices,
            ambiguous_cells: voxels.ambiguous,
            notices,
        };
        Ok(Binding { weights, frames, outside, report })
    }
}

/// Collects the joints of the inner balls and tubes, and binds their points to the cage without inner controls. `None`
/// if there are no balls and tubes.
///
/// # Errors
/// As [`super::bind`].
fn bound_joints<'a>(
    controls: Controls<'a>,
    options: &BindOptions,
    watch: &Watch<'_>,
) -> Result<Option<(JointPoints<'a>, Weights)>, BindError> {
    let Some(joints) = JointPoints::new(controls) else { return Ok(None) };
    let points = joints.points();
    // Bind at half the resolution, which takes an eighth of the work.
    let options = BindOptions {
        grid: (options.grid / 2).max(8),
        sparsify: 0.0,
        outside: OutsidePolicy::Extend,
        extra_points: points.len(),
        ..*options
    };
    let plain = match controls.smooth() {
        0 => ControlSet::plain(controls.cage()),
        steps => ControlSet::new(controls.cage(), steps, InnerControls::default())
            .unwrap_or_else(|_| ControlSet::plain(controls.cage())),
    };
    let bound = run(&points, Controls::from(&plain), &options, &CancellationPoll(watch))?;
    Ok(Some((joints, bound.weights)))
}

/// Progress of the bind in [`bound_joints`], which polls for cancellation but reports nothing.
struct CancellationPoll<'a>(&'a Watch<'a>);

impl Progress for CancellationPoll<'_> {
    fn report(&self, _: ProgressEvent) -> ControlFlow<()> {
        match self.0.report(Stage::Sample, 0.0, 0, None) {
            Ok(()) => ControlFlow::Continue(()),
            Err(_) => ControlFlow::Break(()),
        }
    }

    fn now_ms(&self) -> f64 {
        self.0.now_ms()
    }
}

/// Computes the stencils of all points on all threads, in runs of `VERTEX_RUN` points.
fn sampling_stencils(
    controls: Controls<'_>,
    voxelized: &VoxelizedCage,
    points: &[Vec3],
    policy: OutsidePolicy,
    watch: &Watch<'_>,
) -> Result<Stencils, BindError> {
    let sampler = voxelized.voxels.sampler(controls, policy);
    let runs: Vec<&[Vec3]> = points.chunks(VERTEX_RUN).collect();
    let parts = voxelized.team.share(
        runs.len(),
        || (),
        |(), run| {
            // Poll for cancellation, because faces with hundreds of corners make the stencils slow.
            let is_wanted = watch.report(Stage::Voxelize, 1.0, 0, None).is_ok();
            let points = if is_wanted { runs[run] } else { &[][..] };
            sampler.stencils(points.iter().map(|p| p.as_dvec3()))
        },
    );
    watch.report(Stage::Solve, 0.0, 0, None)?;
    let mut stencils = Stencils::new();
    for part in &parts {
        stencils.append(part);
    }
    Ok(stencils)
}

/// Returns the vertices outside the cage, and the number of vertices among the first `n_vertices` that lie inside a
/// ball or tube.
fn outside_of(points: &[OutsidePoint], welded: &Weld, n_vertices: usize) -> (Vec<OutsideVertex>, u64) {
    let (mut outside, mut n_held) = (Vec::new(), 0);
    let of_point = |point: u32| points.binary_search_by_key(&point, |o| o.vertex).ok().map(|k| points[k]);
    let found =
        (0u32..).zip(&welded.unique_of).filter_map(|(vertex, &point)| Some((vertex, of_point(point)?)));
    for (vertex, o) in found {
        if !o.is_held {
            outside.push(OutsideVertex { vertex, distance: o.distance as f32, share: o.share as f32 });
        } else if (vertex as usize) < n_vertices {
            n_held += 1;
        }
    }
    (outside, n_held)
}

/// Smallest radius that a notice suggests instead of the current one, as a fraction of it. Below, the axis is on the
/// cage.
const MIN_RADIUS_SHARE: f64 = 1e-3;

/// Radii from this share of two cells on have no notice, so that rounding does not give the default radius one in the
/// default grid, where it is two cells.
const MIN_CELLS_SHARE: f32 = 0.999;

/// Returns notices about inner controls: a radius that is too small for a grid of `cells` cells along the longest side,
/// balls and tubes that reach through the cage, and vertices that no element uses.
fn notices_of(controls: Controls<'_>, grid: &Grid, cells: u32) -> Vec<String> {
    let (Some(inner), Some(radius)) = (controls.inner(), controls.inner_radius()) else { return Vec::new() };
    let mut notices = Vec::new();
    let two_cells = 2.0 * grid.cell.max_element() as f32;
    if inner.has_radius() && radius < MIN_CELLS_SHARE * two_cells {
        let finer = (f64::from(cells) * f64::from(MIN_CELLS_SHARE * two_cells / radius)).ceil();
        notices.push(format!(
            "The radius of the controls inside, {radius:.3e}, is below two cells of this grid, {two_cells:.3e}: their reach depends on \
             their position in the grid. Use a grid of {finer} cells, or a larger radius."
        ));
    }
    if let (n @ 1.., Some(first)) = (controls.reaching().len(), controls.reaching().first()) {
        let [from, reach, them] = if n == 1 { ["", "reaches", "it"] } else { ["from ", "reach", "them"] };
        let distance = controls.distance_of_reaching();
        let smaller = if distance > MIN_RADIUS_SHARE * f64::from(radius) {
            format!("use a radius below {distance:.3e}, or ")
        } else {
            String::new()
        };
        notices.push(format!(
            "{} inside ({from}element {first}) {reach} through the cage, whose surface keeps its own values there: \
             {smaller}move {them} inwards.",
            counted(n, "ball or tube", "balls and tubes"),
        ));
    }
    if let (n @ 1.., Some(first)) = (inner.unused().len(), inner.unused().first()) {
        notices.push(format!(
            "{n} of the controls inside (from {first} on) belong to no point, line or face: they move nothing."
        ));
    }
    notices
}
