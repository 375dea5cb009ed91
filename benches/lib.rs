//! Input of the benches, and functions that run single stages of a bind.
//!
//! Mesh and cage are the animal of `cagework_tests::creature`, or the files in the environment variables
//! `CAGEWORK_BENCH_MESH` and `CAGEWORK_BENCH_CAGE` (OBJ, glTF, GLB).

use std::time::Instant;

use cagework_core::bind::bind;
use cagework_core::grid::Grid;
use cagework_core::options::{BindOptions, Method, OutsidePolicy, Solver};
use cagework_core::progress::NoProgress;
use cagework_core::sample::Stencils;
use cagework_core::sample::embedded::Sampler;
use cagework_core::solve::BatchSolver as _;
use cagework_core::solve::hierarchy::Hierarchy;
use cagework_core::solve::multigrid::Workspace;
use cagework_core::voxelize::embedded::Embedding;
use cagework_core::voxelize::lines::Overlaps;
use cagework_core::{Binding, Cage};
use cagework_io::Model;
use cagework_tests::creature::{creature, creature_cage};
use glam::Vec3;

/// Grid sizes at which whole binds are timed, in cells along the cage's longest side.
pub const GRIDS: [u32; 3] = [32, 64, 128];

/// A mesh in a cage.
#[derive(Debug)]
pub struct Input {
    /// Mesh vertices, object units.
    pub points: Vec<Vec3>,
    /// The cage around the points.
    pub cage: Cage,
}

impl Input {
    /// Loads the files that the environment names, or generates the animal.
    ///
    /// # Panics
    /// If only one of the two files is named, or a file cannot be read.
    #[must_use]
    pub fn load() -> Self {
        let input = match files_of_environment() {
            None => Self {
                points: creature().positions,
                cage: Cage::new(&creature_cage()).expect("the generated cage is one"),
            },
            Some((model, cage)) => Self { points: model.tri_mesh().positions, cage },
        };
        println!("{} vertices, {}-vertex cage", input.points.len(), input.cage.n_vertices());
        input
    }

    /// Binds the input with the default tolerance `tau`.
    ///
    /// # Panics
    /// If the input cannot be bound.
    #[must_use]
    pub fn bind(&self, method: Method, solver: Solver, grid: u32, threads: usize) -> Binding {
        let options = BindOptions { method, solver, grid, threads, ..BindOptions::default() };
        bind(&self.points, &self.cage, &options, &NoProgress).expect("the input can be bound")
    }

    /// Builds the grid levels of the input's cage for the embedded method. `grid`: cells along the cage's longest side.
    #[must_use]
    pub fn hierarchy(&self, grid: u32) -> Hierarchy {
        let grid = Grid::cubic(self.cage.bounds(), grid);
        let embedding = Embedding::new(&self.cage, &grid, true);
        Hierarchy::new(&embedding.boundaries((&self.cage).into()), self.cage.n_vertices())
    }

    /// Computes the sampling stencils of the input's points on the finest level.
    #[must_use]
    pub fn stencils(&self, hierarchy: &Hierarchy) -> Stencils {
        let overlaps = Overlaps::default();
        let sampler =
            Sampler::new((&self.cage).into(), &hierarchy.levels[0], &overlaps, OutsidePolicy::Extend);
        sampler.stencils(self.points.iter().map(|p| p.as_dvec3()))
    }
}

/// Reads the model and the cage that the environment names. Returns `None` if it names neither.
///
/// # Panics
/// If only one of the two files is named, or a file cannot be read.
#[must_use]
pub fn files_of_environment() -> Option<(Model, Cage)> {
    match ["CAGEWORK_BENCH_MESH", "CAGEWORK_BENCH_CAGE"].map(|name| std::env::var(name).ok()) {
        [None, None] => None,
        [Some(mesh), Some(cage)] => {
            let cage = Cage::new(&read(&cage).cage_mesh()).expect("CAGEWORK_BENCH_CAGE is a cage");
            Some((read(&mesh), cage))
        }
        _ => panic!("set both CAGEWORK_BENCH_MESH and CAGEWORK_BENCH_CAGE, or neither"),
    }
}

/// Reads a model.
///
/// # Panics
/// If the file cannot be read or is not a model.
#[must_use]
pub fn read(path: &str) -> Model {
    let bytes = std::fs::read(path).unwrap_or_else(|error| panic!("{path}: {error}"));
    Model::read(path, &bytes, &mut |_| None).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// Solves for one batch of the weights' columns.
pub fn solve_batch(workspace: &mut Workspace, hierarchy: &Hierarchy, batch: usize) {
    let rule = BindOptions::default().stop_rule().of_batch(hierarchy.n_batches());
    let report = workspace.solve(hierarchy, batch, rule, &mut |_, _| true);
    debug_assert!(report.is_some(), "never cancelled");
}

/// Solves all columns, batch by batch in one workspace.
pub fn solve_all(workspace: &mut Workspace, hierarchy: &Hierarchy) {
    for batch in 0..hierarchy.n_batches() {
        solve_batch(workspace, hierarchy, batch);
    }
}

/// Solves each batch in its own workspace, so that a sweep over all columns reads every field from memory, not from the
/// cache.
#[must_use]
pub fn resident_workspaces(hierarchy: &Hierarchy) -> Vec<Workspace> {
    (0..hierarchy.n_batches())
        .map(|batch| {
            let mut workspace = Workspace::new(hierarchy);
            solve_batch(&mut workspace, hierarchy, batch);
            workspace
        })
        .collect()
}

/// Makes several calls and returns the shortest time of a call, milliseconds. Other load on the machine affects the
/// shortest time least.
pub fn fastest_ms(times: usize, mut call: impl FnMut()) -> f64 {
    let measured = (0..times.max(1)).map(|_| {
        let begin = Instant::now();
        call();
        begin.elapsed().as_secs_f64() * 1e3
    });
    measured.fold(f64::INFINITY, f64::min)
}
