//! Weights of smooth cages and inner controls, compared with formulas or with an independent computation.

// `cfg(test)` is always true here; it makes clippy treat these modules as tests.
#[cfg(test)]
mod inner;
#[cfg(test)]
mod smooth;
#[cfg(test)]
mod support;
