//! Poses of a cage for what the model should do: points of it are pulled, or it is fitted to a target; and parts of it that the
//! cage does not bend.
//!
//! No I/O, no GPU, no JavaScript; everything here compiles for `wasm32-unknown-unknown`.

pub mod parts;
pub mod pull;

pub use parts::Parts;

/// The example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
