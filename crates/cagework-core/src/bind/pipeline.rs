//! The stages of a bind, one after the other: voxelize, (batch: solve, sample), assemble.
//!
//! Everything but the middle is the same for every back end: [`Prepared::new`], then whoever solves makes a
//! [`Solved`], then [`Prepared::finish`].

use glam::Vec3;

use crate::cage::Cage;
use crate::mesh::{Weld, weld};
use crate::progress::{Progress, Stage};
use crate::report::{BindReport, MemoryBytes, Timings, WeightStats};
use crate::sample::{Outside, Stencils};
use crate::solve::hierarchy::Hierarchy;
use crate::solve::rows::Row;
use crate::solve::team::{Team, VERTEX_RUN};
use crate::weights::assemble::{Assembled, RowOptions, assemble};

use super::outside::refuse_unless_any_is_inside;
use super::solving::solve_and_sample;
use super::voxels::Voxels;
use super::watch::Watch;
use super::{BindError, BindOptions, Binding, Method, OutsidePolicy, OutsideVertex, memory};

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
    pub(super) positions: &'a [Vec3],
    pub(super) cage: &'a Cage,
    pub(super) options: &'a BindOptions,
    pub(super) welded: Weld,
    pub(super) points: Vec<Vec3>,
    pub(super) team: Team,
    pub(super) voxels: Voxels,
    pub(super) stencils: Stencils,
    pub(super) estimated: u64,
    /// On the watcher's clock: the beginning, voxels made, stencils made.
    pub(super) times_ms: [f64; 3],
}

/// The sampled columns and how the solve went.
#[derive(Clone, Debug, Default)]
pub struct Solved {
    /// `[n_batches][n_points]` rows of lanes.
    pub blocks: Vec<Vec<Row>>,
    /// Corrections that were solved for in place of the columns; none if all columns were.
    pub corrections: Option<u32>,
    /// Sweeps or V-cycles.
    pub iterations: u32,
    /// Whether delta fell below tau.
    pub converged: bool,
    /// Delta after every `delta_interval` iterations.
    pub delta_history: Vec<f32>,
    /// Iterations between two entries of `delta_history`.
    pub delta_interval: u32,
    /// Root mean square residual before each V-cycle.
    pub residual_history: Vec<f32>,
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
    cage: &Cage,
    options: &BindOptions,
    progress: &dyn Progress,
) -> Result<Binding, BindError> {
    let watch = Watch::new(progress);
    let mut prepared = Prepared::new(positions, cage, options, FieldsOn::Host, &watch)?;
    prepared.forget_edits();
    let solved = solve_and_sample(&prepared.voxels, &prepared.stencils, options, &prepared.team, &watch)?;
    prepared.finish(solved, &watch)
}

impl<'a> Prepared<'a> {
    /// Checks the input, lays the cage into the grid and finds every vertex's sampling stencil.
    ///
    /// # Errors
    /// Those of [`super::bind`].
    pub fn new(
        positions: &'a [Vec3],
        cage: &'a Cage,
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
        let grid = Voxels::grid(cage, options);
        let field_threads = if fields == FieldsOn::Host { team.n_threads() } else { 0 };
        let estimated = memory::estimate(cage, &grid, points.len(), field_threads, options);
        if estimated > options.memory_limit {
            return Err(BindError::Memory { needed: estimated, limit: options.memory_limit });
        }
        let voxels = team.install(|| Voxels::new(cage, grid, options));
        watch.report(Stage::Voxelize, 1.0, 0, None)?;
        if voxels.hierarchy.levels[0].n_unknowns() == 0 && options.method == Method::Classic {
            return Err(BindError::NoInterior { grid: options.grid });
        }
        let voxelized = watch.now_ms();

        let stencils = sampling_stencils(cage, &voxels, &points, &team, watch)?;
        refuse_outside(cage, positions, &stencils, options, &welded)?;
        let times_ms = [began, voxelized, watch.now_ms()];
        Ok(Self { positions, cage, options, welded, points, team, voxels, stencils, estimated, times_ms })
    }

    /// Drops what only edits need: none will follow.
    pub fn forget_edits(&mut self) {
        self.voxels.forget_edits();
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

    /// Bytes of all columns' fields on the finest level, 4 for each unknown and column.
    #[must_use]
    pub fn fields_bytes(&self) -> u64 {
        let hierarchy = self.hierarchy();
        (hierarchy.levels[0].n_rows() * hierarchy.n_batches() * size_of::<Row>()) as u64
    }

    /// Makes weights and report of the sampled columns.
    ///
    /// # Errors
    /// Cancelled.
    pub fn finish(self, mut solved: Solved, watch: &Watch<'_>) -> Result<Binding, BindError> {
        let solved_at = watch.now_ms();
        let rows = self.rows(&mut solved, watch)?;
        self.reported(&rows, &mut solved, solved_at, watch)
    }

    /// The rows of the sampled columns, one per different position; the samples are used up.
    pub(super) fn rows(&self, solved: &mut Solved, watch: &Watch<'_>) -> Result<Assembled, BindError> {
        watch.report(Stage::Sample, 0.5, solved.iterations, None)?;
        let row_options = RowOptions {
            threshold: self.options.sparsify,
            preserve_affine: self.options.method == Method::Embedded,
        };
        let is_outside = |vertex| self.stencils.is_outside(vertex);
        Ok(assemble(self.cage, &mut solved.blocks, &self.points, row_options, is_outside, &self.team))
    }

    /// The weights of all vertices, and the report. `sampled`: when the samples were there, on the watcher's clock.
    pub(super) fn reported(
        &self,
        rows: &Assembled,
        solved: &mut Solved,
        sampled: f64,
        watch: &Watch<'_>,
    ) -> Result<Binding, BindError> {
        let Self { positions, cage, options, welded, points, team, voxels, stencils, .. } = self;
        let [began, voxelized, stencils_made] = self.times_ms;
        let unique = &rows.weights;
        let (rest_error, weight_stats) = rows.statistics(f64::from(cage.diagonal()));
        let blocks_bytes: usize = solved.blocks.iter().map(|b| size_of_val(b.as_slice())).sum();
        let held = voxels.bytes + stencils.bytes() + blocks_bytes;
        let peak = held + solved.field_bytes.max(unique.bytes());
        let all_differ = points.len() == positions.len();
        let weights = if all_differ { unique.clone() } else { unique.with_rows(&welded.unique_of) };
        let outside = outside_vertices(cage, &stencils.outside, positions, welded);
        watch.report(Stage::Sample, 1.0, solved.iterations, None)?;
        let ended = watch.now_ms();

        let solve_ms = (sampled - stencils_made) * solved.solve_share;
        let level = &voxels.hierarchy.levels[0];
        let report = BindReport {
            method: options.method,
            solver: options.solver,
            backend: if solved.adapter.is_some() { "gpu" } else { "cpu" }.to_owned(),
            adapter: solved.adapter.take(),
            threads: team.n_threads(),
            grid: options.grid,
            dims: level.grid.dims,
            cell_size: level.grid.cell.as_vec3().to_array(),
            cell_shape: options.cell_shape,
            delta_norm: options.delta_norm,
            tau: options.tau,
            cells: voxels.counts,
            levels: voxels.hierarchy.levels.iter().map(|l| l.n_unknowns() as u64).collect(),
            corrections: solved.corrections,
            iterations: solved.iterations,
            converged: solved.converged,
            delta_history: std::mem::take(&mut solved.delta_history),
            delta_interval: solved.delta_interval,
            residual_history: std::mem::take(&mut solved.residual_history),
            timings_ms: Timings {
                voxelize: voxelized - began,
                solve: solve_ms,
                sample: (ended - voxelized) - solve_ms,
                total: ended - began,
            },
            memory_bytes: MemoryBytes { estimated: self.estimated + solved.planned_bytes, peak: peak as u64 },
            rest_error,
            weights: WeightStats { nonzeros: weights.data().len() as u64, ..weight_stats },
            vertices: positions.len() as u64,
            cage_vertices: cage.n_vertices() as u64,
            outside_vertices: outside.len() as u64,
            ambiguous_cells: voxels.ambiguous,
            notices: cage.notices().iter().map(ToString::to_string).collect(),
        };
        Ok(Binding { weights, outside, report })
    }
}

/// Stencils of all points, in runs shared among threads.
pub(super) fn sampling_stencils(
    cage: &Cage,
    voxels: &Voxels,
    points: &[Vec3],
    team: &Team,
    watch: &Watch<'_>,
) -> Result<Stencils, BindError> {
    let sampler = voxels.sampler(cage);
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

pub(super) fn refuse_outside(
    cage: &Cage,
    positions: &[Vec3],
    stencils: &Stencils,
    options: &BindOptions,
    welded: &Weld,
) -> Result<(), BindError> {
    refuse_unless_any_is_inside(cage, positions, stencils)?;
    match (options.outside, stencils.outside.first()) {
        (OutsidePolicy::Refuse, Some(first)) => Err(BindError::Outside {
            count: stencils.outside.len() as u32,
            first: welded.first[first.vertex as usize],
        }),
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
            let corners = cage.triangles()[o.triangle as usize];
            let rest = corners.map(|i| cage.positions()[i as usize]);
            let closest: Vec3 = rest.iter().zip(o.barycentric).map(|(&c, b)| c * b as f32).sum();
            let offset = positions[vertex as usize] - closest;
            let offset = crate::deform::triangle_frame(rest).transpose() * offset;
            Some(OutsideVertex { vertex, corners, offset })
        })
        .collect()
}
