//! Solvers of Laplace's equation, one right-hand side per control.
//!
//! A solver needs a level's operator ([`operator`]), its right-hand sides ([`hierarchy::Hierarchy`]), and the stop rule
//! ([`stop`]). One that solves batch after batch is a [`BatchSolver`]; Jacobi, whose stop rule couples all columns, is not.

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

/// Solves batch after batch of columns on the finest level, with fields that it allocated once.
pub trait BatchSolver {
    /// Solves a batch, from nothing. `done(iteration, delta)` is called after each iteration and cancels by returning false.
    ///
    /// # Errors
    /// `None` when cancelled.
    fn solve(
        &mut self,
        hierarchy: &Hierarchy,
        batch: usize,
        rule: StopRule,
        done: &mut dyn FnMut(u32, f64) -> bool,
    ) -> Option<SolveReport>;

    /// The solution of the latest batch. `[n_rows]`
    fn field(&self) -> &[Row];

    /// Bytes of all fields.
    fn bytes(&self) -> usize;
}
