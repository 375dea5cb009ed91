//! All levels of a bind, the transfers between them, and the right-hand sides of each batch.

use crate::levels::{Boundary, BoundaryTerm, Level};
use crate::team::map_indices;
use crate::transfer::Transfer;

use super::centres::Centres;
use super::rows::{LANES, Row};

/// Levels with the transfers between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Hierarchy {
    /// Levels, finest first; at least one.
    pub levels: Vec<Level>,
    /// `transfers[k]`: between levels k and k + 1.
    pub transfers: Vec<Transfer>,
    /// Fine cells at the centres of the second level's cells.
    pub centres: Centres,
    /// Number of columns (controls).
    pub n_columns: usize,
    /// Per level, the start of each batch's terms in `Level::boundary`, which is sorted by batch.
    batches: Vec<Vec<u32>>,
}

impl Hierarchy {
    /// Builds all levels from their boundaries, finest first
    /// ([`coarsened_until_few`](crate::levels::coarsened_until_few)).
    #[must_use]
    pub fn new<B: Boundary>(boundaries: &[B], n_columns: usize) -> Self {
        let n_batches = n_columns.div_ceil(LANES);
        let levels = map_indices(boundaries.len(), |k| {
            let mut level = Level::new(&boundaries[k]);
            let starts;
            (level.boundary, starts) = sorted_by_batch(&level.boundary, n_batches);
            (level, starts)
        });
        let (levels, batches): (Vec<Level>, _) = levels.into_iter().unzip();
        let transfers = map_indices(levels.len() - 1, |k| Transfer::new(&levels[k], &levels[k + 1]));
        let centres = transfers.first().map(|t| Centres::new(&levels[0], t)).unwrap_or_default();
        Self { levels, transfers, centres, n_columns, batches }
    }

    /// Number of batches of [`LANES`] columns.
    #[must_use]
    pub fn n_batches(&self) -> usize {
        self.n_columns.div_ceil(LANES)
    }

    fn terms(&self, level: usize, batch: usize) -> &[BoundaryTerm] {
        let starts = &self.batches[level];
        &self.levels[level].boundary[starts[batch] as usize..starts[batch + 1] as usize]
    }

    /// Dirichlet terms of a level for a range of columns.
    pub fn boundary_terms(
        &self,
        level: usize,
        columns: std::ops::Range<usize>,
    ) -> impl Iterator<Item = &BoundaryTerm> {
        let batches = columns.start / LANES..columns.end.min(self.n_columns).div_ceil(LANES);
        batches
            .flat_map(move |batch| self.terms(level, batch))
            .filter(move |term| columns.contains(&(term.column as usize)))
    }

    /// Writes a batch's right-hand side of the finest level, one row per cut cell.
    pub fn fill_cut_rhs(&self, batch: usize, f: &mut Vec<Row>) {
        f.clear();
        f.resize(self.levels[0].n_cut(), [0.0; LANES]);
        for term in self.terms(0, batch) {
            f[term.cut_cell as usize][term.column as usize % LANES] = term.value;
        }
    }

    /// Writes a batch's right-hand side of a coarse level, one row per cell.
    pub fn fill_dense_rhs(&self, level: usize, batch: usize, f: &mut [Row]) {
        f.fill([0.0; LANES]);
        for term in self.terms(level, batch) {
            let row = self.levels[level].row_of_cut(term.cut_cell as usize);
            f[row][term.column as usize % LANES] = term.value;
        }
    }

    /// Size in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(Level::bytes).sum::<usize>()
            + self.transfers.iter().map(Transfer::bytes).sum::<usize>()
            + self.centres.bytes()
    }
}

/// Stably sorts a level's terms by batch. Returns them with the start of each batch.
fn sorted_by_batch(terms: &[BoundaryTerm], n_batches: usize) -> (Vec<BoundaryTerm>, Vec<u32>) {
    let batch_of = |t: &BoundaryTerm| t.column as usize / LANES;
    let mut starts = vec![0u32; n_batches + 1];
    for term in terms {
        starts[batch_of(term) + 1] += 1;
    }
    for batch in 0..n_batches {
        starts[batch + 1] += starts[batch];
    }
    let (mut next, mut sorted) = (starts.clone(), terms.to_vec());
    for term in terms {
        let place = &mut next[batch_of(term)];
        sorted[*place as usize] = *term;
        *place += 1;
    }
    (sorted, starts)
}
