//! Cages for models: generated, checked and repaired; and models to try, each with a cage and poses.
//!
//! No I/O, no GPU, no JavaScript; everything here compiles for `wasm32-unknown-unknown`.

pub mod check;
pub mod generate;
pub mod samples;

pub use generate::{CageOptions, GeneratedCage};

/// The example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
