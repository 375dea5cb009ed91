//! Smooth cages and controls inside: what their weights must be, by formula or by another route.

// Always true here; it tells clippy that these are tests.
#[cfg(test)]
mod inner;
#[cfg(test)]
mod smooth;
#[cfg(test)]
mod support;
