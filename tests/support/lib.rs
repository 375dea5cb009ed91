//! Helpers of tests and benches: cages with known coordinates, points inside them, seeded random numbers, comparison of
//! lists.
//!
//! All inputs of this library are generated, so that tests and benches need no files for them.

pub mod cages;
pub mod compare;
pub mod creature;
pub mod points;
pub mod random;

pub use compare::{assert_close, dense, largest_difference};
pub use random::RandomGenerator;
