//! Helpers of tests and benches: cages with known coordinates, points inside them, seeded random numbers, comparison of
//! lists.
//!
//! All inputs are generated, so that no test depends on a file outside the repository.

pub mod cages;
pub mod compare;
pub mod creature;
pub mod points;
pub mod random;

pub use compare::{assert_close, dense, largest_difference};
pub use random::Random;
