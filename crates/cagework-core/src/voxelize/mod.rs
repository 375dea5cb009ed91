//! Voxelization of the cage.

pub mod classic;
pub mod embedded;
pub mod lines;
pub mod published;

pub use classic::{BoundaryValues, CellKind, ClassicCells, voxelize_classic};
