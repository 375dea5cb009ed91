//! The cage laid into the grid.

pub mod classic;
pub mod embedded;
pub mod lines;
pub mod published;

pub use classic::{BoundaryValues, CellKind, ClassicCells, voxelize_classic};

/// `f` of each of `0..n`, in order; on all threads with the feature `parallel`.
pub(crate) fn map_indices<T: Send>(n: usize, f: impl Fn(usize) -> T + Send + Sync) -> Vec<T> {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        (0..n).into_par_iter().map(f).collect()
    }
    #[cfg(not(feature = "parallel"))]
    {
        (0..n).map(f).collect()
    }
}
