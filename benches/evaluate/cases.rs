//! Runs the binds of the evaluation: the classic method on the grids of the paper, and the embedded method on the same
//! grids. Figures are numbered as in the paper, which the parent module names.

use cagework_core::Frames;
use cagework_core::bind::{Binding, bind};
use cagework_core::options::{BindOptions, Method, Solver};
use cagework_core::progress::NoProgress;
use cagework_core::{BindReport, Cage, Weights};
use cagework_gpu::{GpuContext, GpuError, bind_on};
use cagework_io::Model;
use pollster::block_on;

use super::spread::Spread;

/// A combination of method, solver, and number of threads or GPU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Implementation {
    /// The paper's algorithm on one thread.
    PaperOneThread,
    /// The paper's algorithm on all threads.
    PaperThreads,
    /// The paper's algorithm on the GPU.
    PaperGpu,
    /// The embedded method with conjugate gradients, on one thread.
    CgOneThread,
    /// The embedded method with conjugate gradients, on all threads.
    CgThreads,
    /// The embedded method with multigrid, on one thread.
    MultigridOneThread,
    /// The embedded method with multigrid, on all threads.
    MultigridThreads,
    /// The embedded method with multigrid, on the GPU.
    MultigridGpu,
}

impl Implementation {
    /// All implementations, in the order in which plots show them.
    pub(super) const ALL: [Self; 8] = [
        Self::PaperOneThread,
        Self::PaperThreads,
        Self::PaperGpu,
        Self::CgOneThread,
        Self::CgThreads,
        Self::MultigridOneThread,
        Self::MultigridThreads,
        Self::MultigridGpu,
    ];

    /// Name of the implementation in tables and plots.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::PaperOneThread => "paper, one thread",
            Self::PaperThreads => "paper, all threads",
            Self::PaperGpu => "paper, GPU",
            Self::CgOneThread => "conjugate gradients, one thread",
            Self::CgThreads => "conjugate gradients, all threads",
            Self::MultigridOneThread => "multigrid, one thread",
            Self::MultigridThreads => "multigrid, all threads",
            Self::MultigridGpu => "multigrid, GPU",
        }
    }

    /// Name of the implementation in CSV files.
    pub(super) fn id(self) -> &'static str {
        match self {
            Self::PaperOneThread => "paper-one-thread",
            Self::PaperThreads => "paper-threads",
            Self::PaperGpu => "paper-gpu",
            Self::CgOneThread => "cg-one-thread",
            Self::CgThreads => "cg-threads",
            Self::MultigridOneThread => "multigrid-one-thread",
            Self::MultigridThreads => "multigrid-threads",
            Self::MultigridGpu => "multigrid-gpu",
        }
    }

    /// What the solver's iterations are called.
    pub(super) fn iterations(self) -> &'static str {
        match self {
            Self::PaperOneThread | Self::PaperThreads | Self::PaperGpu => "sweeps",
            Self::CgOneThread | Self::CgThreads => "steps",
            Self::MultigridOneThread | Self::MultigridThreads | Self::MultigridGpu => "cycles",
        }
    }

    /// Whether the implementation solves on the GPU.
    pub(super) fn is_gpu(self) -> bool {
        matches!(self, Self::PaperGpu | Self::MultigridGpu)
    }

    fn options(self, grid: u32, tau: f32) -> BindOptions {
        let threads = match self {
            Self::PaperOneThread | Self::CgOneThread | Self::MultigridOneThread => 1,
            _ => 0,
        };
        let (method, solver) = match self {
            Self::PaperOneThread | Self::PaperThreads | Self::PaperGpu => (Method::Classic, Solver::Jacobi),
            Self::CgOneThread | Self::CgThreads => (Method::Embedded, Solver::ConjugateGradient),
            _ => (Method::Embedded, Solver::Multigrid),
        };
        BindOptions { grid, tau, method, solver, threads, ..BindOptions::default() }
    }
}

/// Result of one or more binds with the same options.
#[derive(Clone, Debug)]
pub(super) struct Run {
    pub(super) implementation: Implementation,
    /// Report of the bind that has the median total time.
    pub(super) report: BindReport,
    /// Range of the total times of all binds, ms.
    pub(super) total_ms: Spread,
}

impl Run {
    /// Summarises repeated binds with the same options, whose reports differ only in their times. `None` if `reports`
    /// is empty.
    fn median(implementation: Implementation, mut reports: Vec<BindReport>) -> Option<Self> {
        let total_ms = Spread::of(reports.iter().map(|r| r.timings_ms.total))?;
        reports.sort_by(|a, b| a.timings_ms.total.total_cmp(&b.timings_ms.total));
        let report = reports.swap_remove(reports.len() / 2);
        Some(Self { implementation, report, total_ms })
    }

    /// Returns (milliseconds of solving, delta) pairs at the iterations that report delta, assuming that all iterations
    /// take the same time.
    pub(super) fn delta_over_time(&self) -> impl Iterator<Item = (f64, f32)> + '_ {
        let each = self.report.timings_ms.solve / f64::from(self.report.iterations.max(1));
        let every = f64::from(self.report.delta_interval);
        let deltas = self.report.delta_history.iter().enumerate();
        deltas.map(move |(k, &delta)| (each * every * (k + 1) as f64, delta))
    }
}

/// Weights and frames that reconstruct the rest pose, for one of figures 2 to 5.
#[derive(Clone, Debug)]
pub(super) struct Reconstruction {
    /// File name of the figure, without extension.
    pub(super) figure: &'static str,
    /// Caption of the figure in the report.
    pub(super) caption: String,
    pub(super) report: BindReport,
    pub(super) weights: Weights,
    pub(super) frames: Frames,
}

/// Names and contents of files.
pub(super) type Files = Vec<(String, Vec<u8>)>;

/// A model in a cage.
#[derive(Debug)]
pub(super) struct Input {
    /// Name of the model in the report.
    pub(super) name: String,
    pub(super) model: Model,
    pub(super) cage: Cage,
}

/// Results of the whole evaluation.
#[derive(Clone, Debug)]
pub(super) struct Evaluation {
    pub(super) mesh: String,
    pub(super) n_vertices: usize,
    pub(super) n_cage: usize,
    pub(super) threads: usize,
    pub(super) runs: u32,
    pub(super) grids: Grids,
    /// Name of the GPU, or the reason why none is available.
    pub(super) adapter: Result<String, String>,
    /// Runs of figures 8 to 11: each implementation on each grid of [`Grids::timed`], for each of [`TIMED_TAUS`].
    pub(super) timed: Vec<Run>,
    /// Runs of figure 12, which shows the error at rest.
    pub(super) errors: Vec<Run>,
    pub(super) reconstructions: Vec<Reconstruction>,
}

/// Convergence thresholds of figures 8 to 11.
pub(super) const TIMED_TAUS: [f32; 2] = [1e-4, 1e-5];
/// Convergence thresholds of figure 12.
pub(super) const ERROR_TAUS: [f32; 3] = [1e-3, 1e-4, 1e-5];

/// Numbers of cells along the cage's longest side. The paper uses 16, 32 and 64.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Grids {
    pub(super) coarse: u32,
    pub(super) middle: u32,
    pub(super) fine: u32,
}

impl Grids {
    fn up_to(fine: u32) -> Self {
        Self { coarse: fine / 4, middle: fine / 2, fine }
    }

    /// Grids that figures 8 to 11 use.
    pub(super) fn timed(self) -> [u32; 2] {
        [self.middle, self.fine]
    }

    /// Grids that figure 12 uses.
    pub(super) fn all(self) -> [u32; 3] {
        [self.coarse, self.middle, self.fine]
    }
}

impl Evaluation {
    /// Runs all binds of the evaluation. `finest`: cells of the finest grid along the longest side of the cage; `runs`:
    /// timed binds per case.
    pub(super) fn run(
        Input { name, model, cage }: &Input,
        (finest, runs): (u32, u32),
        gpu: Result<&GpuContext, &GpuError>,
    ) -> Result<Self, GpuError> {
        let bind = |implementation: Implementation, grid, tau| -> Result<Binding, GpuError> {
            eprintln!("{}, g = {grid}, tau = {tau:e}", implementation.name());
            let options = implementation.options(grid, tau);
            match gpu {
                Ok(context) if implementation.is_gpu() => {
                    block_on(bind_on(&model.positions, cage, &options, &NoProgress, context))
                }
                _ => Ok(bind(&model.positions, cage, &options, &NoProgress)?),
            }
        };
        let grids = Grids::up_to(finest);
        let (mut timed, mut errors) = (Vec::new(), Vec::new());
        for grid in grids.timed() {
            for tau in TIMED_TAUS {
                let implementations: Vec<Implementation> =
                    Implementation::ALL.into_iter().filter(|w| gpu.is_ok() || !w.is_gpu()).collect();
                let mut reports = vec![Vec::new(); implementations.len()];
                // Run the implementations in turn, so that a change of the machine's speed affects all of them equally.
                for _ in 0..runs {
                    for (&implementation, reports) in implementations.iter().zip(&mut reports) {
                        reports.push(bind(implementation, grid, tau)?.report);
                    }
                }
                let reports = implementations.into_iter().zip(reports);
                timed.extend(
                    reports.filter_map(|(implementation, reports)| Run::median(implementation, reports)),
                );
            }
        }
        for grid in grids.all() {
            let paper = ERROR_TAUS.map(|tau| (Implementation::PaperThreads, tau));
            for (implementation, tau) in paper.into_iter().chain([(Implementation::MultigridThreads, 1e-5)]) {
                errors.extend(Run::median(implementation, vec![bind(implementation, grid, tau)?.report]));
            }
        }
        let figures: [(&str, &str, Implementation, u32, f32); 4] = [
            ("figure-2", ": insufficient smoothing", Implementation::PaperThreads, grids.middle, 1e-3),
            ("figure-3", "", Implementation::PaperThreads, grids.middle, 1e-5),
            ("figure-4", ": quantisation", Implementation::PaperThreads, grids.coarse, 1e-5),
            ("figure-5-ours", ": embedded multigrid", Implementation::MultigridThreads, grids.coarse, 1e-5),
        ];
        let reconstructions = figures
            .into_iter()
            .map(|(figure, what, implementation, grid, tau)| {
                let caption = format!("g = {grid}, tau = {tau:e}{what}");
                let Binding { weights, frames, report, .. } = bind(implementation, grid, tau)?;
                Ok(Reconstruction { figure, caption, report, weights, frames })
            })
            .collect::<Result<_, GpuError>>()?;
        Ok(Self {
            mesh: name.clone(),
            n_vertices: model.positions.len(),
            n_cage: cage.n_vertices(),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            runs,
            grids,
            adapter: gpu.map(GpuContext::adapter_name).map_err(ToString::to_string),
            timed,
            errors,
            reconstructions,
        })
    }

    /// Returns the timed run of an implementation for one grid and threshold.
    pub(super) fn timed(&self, implementation: Implementation, grid: u32, tau: f32) -> Option<&Run> {
        self.timed.iter().find(|run| {
            run.implementation == implementation && run.report.grid == grid && run.report.tau == tau
        })
    }

    /// Returns the run of an implementation whose delta figure 7 shows.
    pub(super) fn delta_run(&self, implementation: Implementation) -> Option<&Run> {
        self.timed(implementation, self.grids.middle, 1e-5)
    }

    /// Returns the mean rest error of an implementation for one grid and threshold, as a fraction of the cage's
    /// diagonal.
    pub(super) fn mean_rel(&self, implementation: Implementation, grid: u32, tau: f32) -> Option<f64> {
        self.errors
            .iter()
            .find(|run| {
                run.implementation == implementation && run.report.grid == grid && run.report.tau == tau
            })
            .map(|run| run.report.rest_error.mean_rel)
    }
}
