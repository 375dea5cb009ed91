//! Solvers of Laplace's equation with one right-hand side per control.
//!
//! A solver uses a level's operator ([`operator`]), right-hand sides ([`hierarchy::Hierarchy`]) and the stopping rule
//! ([`stop`]). Solvers that work batch by batch implement [`BatchSolver`]; Jacobi does not, since its stopping rule
//! couples all columns.

pub mod centres;
pub mod conjugate_gradient;
pub mod hierarchy;
pub mod jacobi;
pub mod multigrid;
pub mod operator;
pub mod rows;
pub mod stop;

use hierarchy::Hierarchy;
use rows::Row;
use stop::{SolveReport, StopRule};

/// Solves batches of columns one after another on the finest level, in fields allocated once.
pub trait BatchSolver {
    /// Solves a batch from an initial guess that the solver chooses. Calls `done(iteration, delta)` after each
    /// iteration; if it returns false, the solve stops and returns `None`.
    fn solve(
        &mut self,
        hierarchy: &Hierarchy,
        batch: usize,
        rule: StopRule,
        done: &mut dyn FnMut(u32, f64) -> bool,
    ) -> Option<SolveReport>;

    /// Solution of the latest batch. `[n_rows]`
    fn field(&self) -> &[Row];

    /// Size of all fields in bytes.
    fn bytes(&self) -> usize;
}
