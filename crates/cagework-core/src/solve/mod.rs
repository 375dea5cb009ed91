//! Solvers of Laplace's equation, one right-hand side per control vertex.

pub mod centres;
pub mod hierarchy;
pub mod jacobi;
pub mod multigrid;
pub mod rows;
pub mod team;
