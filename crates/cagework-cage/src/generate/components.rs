//! Components of a model that get a closed part each.

use cagework_core::progress::Cancellation;
use cagework_core::words::{counted, grouped};

use super::MAX_FINE_HULL;
use super::options::{CageOptions, MIN_VOXELS};

/// Smallest number of vertices of a closed part, a tetrahedron.
const MIN_PART_VERTICES: usize = 4;

/// Components of a model, and the lattice that keeps them apart.
pub(super) struct Components {
    /// Number of components that the finest lattice keeps apart.
    n: usize,
    /// Smallest number of voxels tried, along the model's longest side, with which the hull has that many parts.
    pub(super) voxels: usize,
    /// Whether a lattice that keeps them apart has too many voxels.
    is_too_fine: bool,
}

impl Components {
    /// A model that gets one part.
    pub(super) const ONE: Self = Self { n: 1, voxels: MIN_VOXELS, is_too_fine: false };

    /// Finds the components, and a lattice that keeps them apart unless a cage of `target` vertices has too few for one
    /// part each, or the lattice is so fine that its hull has too many vertices. `hull`: number of parts of the hull on a
    /// lattice, and of its vertices. `[first, finest]`: voxels along the longest side of the coarsest and the finest
    /// lattice.
    ///
    /// # Errors
    /// If `hull` is cancelled.
    pub(super) fn find(
        hull: impl Fn(usize) -> Result<(usize, usize), Cancellation>,
        [first, finest]: [usize; 2],
        target: usize,
    ) -> Result<Self, Cancellation> {
        let (n, _) = hull(finest)?;
        let one = Self { n, ..Self::ONE };
        if n == 1 || n * MIN_PART_VERTICES > target {
            return Ok(one);
        }
        let mut voxels = first;
        loop {
            let (parts, vertices) = hull(voxels)?;
            if vertices > MAX_FINE_HULL {
                return Ok(Self { is_too_fine: true, ..one });
            }
            if parts >= n || voxels >= finest {
                return Ok(Self { voxels, ..one });
            }
            voxels = (voxels * 5 / 4).min(finest);
        }
    }

    /// Returns a sentence with a remedy if a cage that should have a part for each component has only `parts` parts.
    pub(super) fn notice(&self, parts: u32, options: &CageOptions) -> Option<String> {
        if parts as usize >= self.n {
            return None;
        }
        let remedy = if self.is_too_fine {
            "make their cages from files of their own: a lattice that keeps them apart would be too fine"
                .to_owned()
        } else if options.voxels > 0 && (options.voxels as usize) < self.voxels {
            format!("use {} voxels instead of {}", self.voxels, options.voxels)
        } else {
            format!("allow more than {} vertices", options.target)
        };
        let has = counted(parts as usize, "closed part", "closed parts");
        let n = grouped(self.n);
        Some(format!("the cage has {has} for {n} components of the model; for a part each, {remedy}"))
    }
}
