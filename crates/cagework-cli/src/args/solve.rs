//! How to solve, and within which memory.

use cagework_core::options::{
    self, Backend, BindOptions, CellShape, DeltaNorm, Method, OutsidePolicy, Preconditioner, Solver,
};
use clap::Args;

use super::{number, words};

/// How much memory may be taken.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct MemoryArgs {
    /// Refuse to start what would need more memory than this, in MiB: reading models, binding, writing.
    #[arg(long, default_value_t = DEFAULT_MEMORY_MIB, value_name = "MIB", value_parser = clap::value_parser!(u64).range(1..=1 << 40))]
    memory_limit: u64,
}

/// Memory that may be taken unless said otherwise, MiB.
const DEFAULT_MEMORY_MIB: u64 = 4096;

impl Default for MemoryArgs {
    fn default() -> Self {
        Self { memory_limit: DEFAULT_MEMORY_MIB }
    }
}

impl MemoryArgs {
    /// The limit, bytes.
    pub(crate) fn bytes(self) -> u64 {
        self.memory_limit << 20
    }
}

/// How to solve: shared by `bind` and what else binds.
#[derive(Args, Debug)]
pub(crate) struct SolveArgs {
    /// How the cage meets the grid: as published, or where it really is.
    #[arg(long, default_value_t, value_parser = words::<Method>())]
    method: Method,
    /// How Laplace's equation is solved [default: multigrid; jacobi with --method classic].
    #[arg(long, value_parser = words::<Solver>())]
    solver: Option<Solver>,
    /// What conjugate gradients (--solver cg) are preconditioned by.
    #[arg(long, default_value_t, value_parser = words::<Preconditioner>())]
    preconditioner: Preconditioner,
    /// Threads; 0 for all.
    #[arg(long, default_value_t = 0, value_name = "N")]
    threads: usize,
    /// Stop when delta (the paper's Eq. 2; multigrid and cg: the error that is expected to remain) falls below this.
    #[arg(long, default_value = "1e-5", value_parser = number::<f32>(options::TAU))]
    tau: f32,
    /// Stop after this many Jacobi sweeps or steps of cg, and after at most 60 V-cycles.
    #[arg(long, default_value_t = 20_000, value_name = "N", value_parser = number::<u32>(options::MAX_ITERATIONS))]
    max_iterations: u32,
    /// Drop the smallest weights of a row as long as their sum is not above this, then restore its sum and rest position; 0
    /// keeps all.
    #[arg(long, default_value_t = 0.0, value_name = "WEIGHT", value_parser = number::<f32>(options::SPARSIFY))]
    sparsify: f32,
    /// Shape of the classic method's cells: of the cage's box (as published), or cubic.
    #[arg(long, default_value_t, value_parser = words::<CellShape>())]
    cells: CellShape,
    /// How Eq. 2 is read: as a Euclidean norm, or to the letter.
    #[arg(long, default_value_t, value_parser = words::<DeltaNorm>())]
    delta: DeltaNorm,
    /// What to do with vertices outside the cage: `extend` the weights within 5 % of its diagonal, fading to nothing at 15 %, so that
    /// the rest of a model stays where it is (a cage may be around an arm alone); let them `stay`; or `refuse`, an error.
    #[arg(long, default_value_t, value_parser = words::<OutsidePolicy>())]
    outside: OutsidePolicy,
    /// Where to compute; CAGEWORK_ADAPTER chooses among several GPUs by part of a name.
    #[arg(long, default_value_t, value_parser = words::<Backend>())]
    backend: Backend,
}

impl SolveArgs {
    /// Whether the GPU is to solve.
    pub(crate) fn on_gpu(&self) -> bool {
        self.backend == Backend::Gpu
    }

    /// The options of a bind on `grid` cells within a limit on memory.
    pub(crate) fn options(&self, grid: u32, memory: MemoryArgs) -> BindOptions {
        BindOptions {
            grid,
            method: self.method,
            solver: self.solver.unwrap_or(self.method.usual_solver()),
            preconditioner: self.preconditioner,
            cell_shape: self.cells,
            delta_norm: self.delta,
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
