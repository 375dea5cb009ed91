//! Inverse posing: solves for the cage that brings points of the model to given positions, and holds parts of the model
//! rigid or in place while the cage bends the rest. Also blends poses.
//!
//! No I/O, no GPU, no JavaScript; everything here compiles for `wasm32-unknown-unknown`.

pub mod blend;
pub mod drive;
mod ends;
pub mod figure;
pub mod humanoid;
pub mod parts;
pub mod proportions;
pub mod pull;
pub mod symmetry;

pub use parts::Parts;

/// Compiles the README's example.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
