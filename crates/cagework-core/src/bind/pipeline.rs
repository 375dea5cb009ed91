//! The stages of a bind, one after the other: voxelize, (batch: solve, sample), assemble.
//!
//! Everything but the middle is the same for every back end: [`Prepared::new`], then whoever solves makes a
//! [`Solved`], then [`Prepared::finish`].

use glam::{DVec3, Vec3};

use crate::assemble::{Assembled, RowOptions, assemble};
use crate::cage::Cage;
use crate::controls::Controls;
use crate::deform::{OutsideVertex, triangle_frame};
use crate::mesh::{Weld, weld};
use crate::options::{Backend, BindOptions, Method, OutsidePolicy};
use crate::progress::{Progress, Stage};
use crate::report::{BindReport, MemoryBytes, Timings, WeightStats};
use crate::sample::{Outside, Stencils};
use crate::solve::hierarchy::Hierarchy;
use crate::solve::rows::Row;
use crate::solve::stop::SolveReport;
use crate::team::{Team, VERTEX_RUN};

use super::outside::refuse_unless_any_is_inside;
use super::solving::solve_and_sample;
use super::voxels::Voxels;
use super::watch::Watch;
use super::{BindError, Binding, memory};

/// Where the fields of a solve live: what counts towards the limit on working memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldsOn {
    /// In this process.
    Host,
    /// On a GPU, whose memory is planned there.
    Device,
}

/// A bind up to the solve: the geometry of grid and mesh.
pub struct Prepared<'a> {
    positions: &'a [Vec3],
    controls: Controls<'a>,
    options: &'a BindOptions,
    welded: Weld,
    points: Vec<Vec3>,
    team: Team,
    voxels: Voxels,
    stencils: Stencils,
    estimated: u64,
    /// On the watcher's clock: the beginning, voxels made, stencils made.
    times_ms: [f64; 3],
}

/// The sampled columns and how the solve went.
#[derive(Clone, Debug, Default)]
pub struct Solved {
    /// `[n_batches][n_points]` rows of lanes.
    pub blocks: Vec<Vec<Row>>,
    /// How the solve of all columns went.
    pub report: SolveReport,
    /// Sweeps, V-cycles or steps.
    pub iterations: u32,
    /// Iterations between two of the report's deltas: 1 but for the GPU's Jacobi sweeps.
    pub delta_interval: u32,
    /// Bytes of fields alive at once.
    pub field_bytes: usize,
    /// Bytes planned for them on a device, which the estimate made here leaves out; 0 in this process.
    pub planned_bytes: u64,
    /// Share of the stage's time that went into solving; the rest is sampling.
    pub solve_share: f64,
    /// Name of the GPU; none for the CPU.
    pub adapter: Option<String>,
}

pub(super) fn run(
    positions: &[Vec3],
    controls: Controls<'_>,
    options: &BindOptions,
    progress: &dyn Progress,
) -> Result<Binding, BindError> {
    let watch = Watch::new(progress);
    let prepared = Prepared::new(positions, controls, options, FieldsOn::Host, &watch)?;
    let solved =
        solve_and_sample(&prepared.voxels.hierarchy, &prepared.stencils, options, &prepared.team, &watch)?;
    prepared.finish(solved, &watch)
}

impl<'a> Prepared<'a> {
    /// Checks the input, lays the surface into the grid and finds every vertex's sampling stencil.
    ///
    /// # Errors
    /// Those of [`super::bind`].
    pub fn new(
        positions: &'a [Vec3],
        controls: Controls<'a>,
        options: &'a BindOptions,
        fields: FieldsOn,
        watch: &Watch<'_>,
    ) -> Result<Self, BindError> {
        options.check()?;
        if positions.is_empty() {
            return Err(BindError::EmptyMesh);
        }
        if let Some(vertex) = positions.iter().position(|p| !p.is_finite()) {
            return Err(BindError::NotFinite { vertex: vertex as u32 });
        }
        let began = watch.now_ms();
        let team = Team::new(options.threads);
        let welded = weld(positions);
        let points: Vec<Vec3> = welded.first.iter().map(|&v| positions[v as usize]).collect();

        watch.report(Stage::Voxelize, 0.0, 0, None)?;
        let grid = Voxels::grid(controls.surface(), options);
        let field_threads = if fields == FieldsOn::Host { team.n_threads() } else { 0 };
        let estimated = memory::estimate(
            controls,
            &grid,
            memory::Vertices { rows: positions.len(), points: points.len() },
            field_threads,
            options,
        );
        if estimated > options.memory_limit {
            return Err(BindError::Memory { needed: estimated, limit: options.memory_limit });
        }
        let voxels = team.install(|| Voxels::new(controls, grid, options));
        watch.report(Stage::Voxelize, 1.0, 0, None)?;
        if voxels.hierarchy.levels[0].n_unknowns() == 0 && options.method == Method::Classic {
            return Err(BindError::NoInterior { grid: options.grid });
        }
        let voxelized = watch.now_ms();

        let stencils = sampling_stencils(controls, &voxels, &points, &team, watch)?;
        refuse_outside(controls.surface(), positions, &stencils, options, &welded)?;
        let times_ms = [began, voxelized, watch.now_ms()];
        Ok(Self { positions, controls, options, welded, points, team, voxels, stencils, estimated, times_ms })
    }

    /// What is to be solved.
    #[must_use]
    pub fn hierarchy(&self) -> &Hierarchy {
        &self.voxels.hierarchy
    }

    /// Where the solution is to be sampled, one stencil per different position.
    #[must_use]
    pub fn stencils(&self) -> &Stencils {
        &self.stencils
    }

    /// Makes weights and report of the sampled columns.
    ///
    /// # Errors
    /// Cancelled.
    pub fn finish(self, mut solved: Solved, watch: &Watch<'_>) -> Result<Binding, BindError> {
        let sampled = watch.now_ms();
        watch.report(Stage::Sample, 0.5, solved.iterations, None)?;
        let row_options = RowOptions {
            threshold: self.options.sparsify,
            preserve_affine: self.options.method == Method::Embedded,
        };
        let is_outside = |vertex| self.stencils.is_outside(vertex);
        let blocks_bytes: usize = solved.blocks.iter().map(|b| size_of_val(b.as_slice())).sum();
        let rows =
            assemble(self.controls, &mut solved.blocks, &self.points, row_options, is_outside, &self.team);
        drop(std::mem::take(&mut solved.blocks));
        self.reported(rows, blocks_bytes, solved, sampled, watch)
    }

    /// The weights of all vertices, and the report. `sampled`: when the samples were there, on the watcher's clock.
    fn reported(
        self,
        rows: Assembled,
        blocks_bytes: usize,
        solved: Solved,
        sampled: f64,
        watch: &Watch<'_>,
    ) -> Result<Binding, BindError> {
        let Self { positions, controls, options, welded, points, team, voxels, stencils, .. } = self;
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
        let outside = outside_vertices(cage, &stencils.outside, positions, &welded);
        watch.report(Stage::Sample, 1.0, solved.iterations, None)?;
        let ended = watch.now_ms();

        let n_vertices = positions.len().saturating_sub(options.extra_points);
        let solve_ms = (sampled - stencils_made) * solved.solve_share;
        let level = &voxels.hierarchy.levels[0];
        let mut notices: Vec<String> = cage.notices().iter().map(ToString::to_string).collect();
        notices.extend(team.notice(options.threads).into_iter().chain(voxels.notices));
        let narrow = |history: Vec<f64>| history.into_iter().map(|x| x as f32).collect();
        let report = BindReport {
            method: options.method,
            solver: options.solver,
            preconditioner: options.preconditioner,
            backend: if solved.adapter.is_some() { Backend::Gpu } else { Backend::Cpu },
            adapter: solved.adapter,
            threads: team.n_threads(),
            grid: options.grid,
            dims: level.grid.dims,
            cell_size: level.grid.cell.as_vec3().to_array(),
            cell_shape: options.cell_shape,
            delta_norm: options.delta_norm,
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
            cage_vertices: controls.n_controls() as u64,
            outside_vertices: outside.iter().filter(|o| (o.vertex as usize) < n_vertices).count() as u64,
            ambiguous_cells: voxels.ambiguous,
            notices,
        };
        Ok(Binding { weights, outside, report })
    }
}

/// Stencils of all points, in runs shared among threads.
fn sampling_stencils(
    controls: Controls<'_>,
    voxels: &Voxels,
    points: &[Vec3],
    team: &Team,
    watch: &Watch<'_>,
) -> Result<Stencils, BindError> {
    let sampler = voxels.sampler(controls);
    let runs: Vec<&[Vec3]> = points.chunks(VERTEX_RUN).collect();
    let parts = team.share(
        runs.len(),
        || (),
        |(), run| {
            let cancelled = watch.is_cancelled();
            let points = if cancelled { &[][..] } else { runs[run] };
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

fn refuse_outside(
    cage: &Cage,
    positions: &[Vec3],
    stencils: &Stencils,
    options: &BindOptions,
    welded: &Weld,
) -> Result<(), BindError> {
    refuse_unless_any_is_inside(cage, positions, stencils)?;
    let n_vertices = positions.len().saturating_sub(options.extra_points);
    let vertices = stencils.outside.iter().map(|o| welded.first[o.vertex as usize]);
    let mut vertices = vertices.filter(|&v| (v as usize) < n_vertices);
    match (options.outside, vertices.next()) {
        (OutsidePolicy::Refuse, Some(first)) => {
            Err(BindError::Outside { count: 1 + vertices.count() as u32, first })
        }
        _ => Ok(()),
    }
}

/// Every input vertex outside the cage with its offset from the closest point, in that triangle's frame.
fn outside_vertices(
    cage: &Cage,
    outside: &[Outside],
    positions: &[Vec3],
    welded: &Weld,
) -> Vec<OutsideVertex> {
    let found = |unique: u32| outside.binary_search_by_key(&unique, |o| o.vertex).ok().map(|k| outside[k]);
    if outside.is_empty() {
        return Vec::new();
    }
    (0u32..)
        .zip(&welded.unique_of)
        .filter_map(|(vertex, &unique)| {
            let o = found(unique)?;
            let corners = cage.triangle_near(o.triangle);
            let rest = corners.map(|i| cage.positions()[i as usize]);
            let facet = cage.facet_corners(o.triangle);
            let closest: DVec3 = facet.iter().zip(o.barycentric).map(|(&c, b)| b * c).sum();
            let offset = positions[vertex as usize] - closest.as_vec3();
            let offset = triangle_frame(rest).transpose() * offset;
            Some(OutsideVertex { vertex, corners, offset })
        })
        .collect()
}
