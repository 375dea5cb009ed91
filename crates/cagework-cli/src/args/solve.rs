//! Arguments for the solver and the memory limit.

use cagework_core::options::{self, Backend, BindOptions, Method, OutsidePolicy, Solver};
use clap::Args;

use super::{number, words};

/// Argument for the memory limit.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct MemoryArgs {
    /// Memory limit for reading models, binding and writing, in MiB. Work that would need more is refused before it starts.
    #[arg(long, default_value_t = Self::default().memory_limit, value_name = "MIB", value_parser = clap::value_parser!(u64).range(1..=1 << 40))]
    memory_limit: u64,
}

impl Default for MemoryArgs {
    fn default() -> Self {
        Self { memory_limit: BindOptions::default().memory_limit >> 20 }
    }
}

impl MemoryArgs {
    /// The memory limit, bytes.
    pub(crate) fn bytes(self) -> u64 {
        self.memory_limit << 20
    }
}

/// Arguments of the solver. All commands that bind share them.
#[derive(Args, Debug)]
pub(crate) struct SolveArgs {
    /// Boundary of the grid: embedded uses the exact intersections of grid lines with the cage; classic uses whole cells, as published.
    #[arg(long, default_value_t, value_parser = words::<Method>())]
    method: Method,
    /// Solver of Laplace's equation [default: multigrid; jacobi with --method classic].
    #[arg(long, value_parser = words::<Solver>())]
    solver: Option<Solver>,
    /// Number of threads; 0 uses one per processor.
    #[arg(long, default_value_t = 0, value_name = "N")]
    threads: usize,
    #[arg(long, help = options::TAU.about(), default_value = "1e-5", value_parser = number::<f32>(options::TAU))]
    tau: f32,
    #[arg(long, help = options::MAX_ITERATIONS.about(), default_value_t = BindOptions::default().max_iterations, value_name = "N", value_parser = number::<u32>(options::MAX_ITERATIONS))]
    max_iterations: u32,
    #[arg(long, help = options::SPARSIFY.about(), default_value_t = BindOptions::default().sparsify, value_name = "WEIGHT", value_parser = number::<f32>(options::SPARSIFY))]
    sparsify: f32,
    /// Vertices outside the cage: `extend` lets them follow the cage fully up to a distance of 5 % of its diagonal, fading to zero at
    /// 15 %, so that a cage may enclose only an arm; `stay` keeps them in place; `refuse` fails with an error.
    #[arg(long, default_value_t, value_parser = words::<OutsidePolicy>())]
    outside: OutsidePolicy,
    /// Processor or GPU. CAGEWORK_ADAPTER selects one of several GPUs by part of its name.
    #[arg(long, default_value_t, value_parser = words::<Backend>())]
    backend: Backend,
}

impl SolveArgs {
    /// Whether `--backend` selects the GPU.
    pub(crate) fn on_gpu(&self) -> bool {
        self.backend == Backend::Gpu
    }

    /// Returns bind options with `grid` cells along the cage's longest side and this memory limit.
    pub(crate) fn options(&self, grid: u32, memory: MemoryArgs) -> BindOptions {
        BindOptions {
            grid,
            method: self.method,
            solver: self.solver.unwrap_or(self.method.usual_solver()),
            threads: self.threads,
            tau: self.tau,
            max_iterations: self.max_iterations,
            sparsify: self.sparsify,
            memory_limit: memory.bytes(),
            outside: self.outside,
            ..BindOptions::default()
        }
    }
}
