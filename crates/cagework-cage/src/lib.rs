//! Cages for models: generation, checks and repairs; and built-in sample models with cages and poses.
//!
//! No I/O, no GPU, no JavaScript; everything here compiles for `wasm32-unknown-unknown`.

pub mod check;
pub mod generate;
mod kind;
pub mod samples;
pub mod skeleton;
pub mod sleeves;

pub use generate::{CageOptions, GeneratedCage};
pub use kind::{generate_of_kind, generate_with_skeleton};

/// Compiles the README's example.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
