//! All levels of one bind with their transfers and right-hand sides in batches: what every solver reads.

use crate::grid::NO_CELL;
use crate::levels::{Before, Boundary, BoundaryTerm, Level, Touched};
use crate::transfer::Transfer;
use crate::voxelize::map_indices;

use super::centres::Centres;
use super::rows::{LANES, Row};

/// Levels, finest first, and the transfers between neighbours.
#[derive(Clone, Debug, PartialEq)]
pub struct Hierarchy {
    /// Levels, finest first; at least one.
    pub levels: Vec<Level>,
    /// `transfers[k]` lies between levels k and k + 1.
    pub transfers: Vec<Transfer>,
    /// Centres of the second level's cells in the finest.
    pub centres: Centres,
    /// Columns: control vertices.
    pub n_columns: usize,
    /// For each level, where each batch's terms start in `Level::boundary`, which is sorted by batch.
    batches: Vec<Vec<u32>>,
}

impl Hierarchy {
    /// One level only: for Jacobi.
    #[must_use]
    pub fn single(level: Level, n_columns: usize) -> Self {
        let (boundary, starts) = sorted_by_batch(&level.boundary, n_columns.div_ceil(LANES));
        Self {
            levels: vec![Level { boundary, ..level }],
            transfers: Vec::new(),
            centres: Centres::default(),
            n_columns,
            batches: vec![starts],
        }
    }

    /// Of what each level's cells see of the cage, finest first ([`coarsened_until_few`](crate::levels::coarsened_until_few)).
    #[must_use]
    pub fn new<B: Boundary>(boundaries: &[B], n_columns: usize) -> Self {
        let boundaries: Vec<&dyn Boundary> = boundaries.iter().map(|b| b as &dyn Boundary).collect();
        Self::of(&boundaries, n_columns, None)
    }

    /// The same from what it was before an edit of the cage that leaves the grid and the number of levels: the outcome is that
    /// of [`Self::new`]. `touched`: of each level.
    #[must_use]
    pub fn renewed<B: Boundary>(&self, boundaries: &[B], touched: &[Touched]) -> Self {
        let boundaries: Vec<&dyn Boundary> = boundaries.iter().map(|b| b as &dyn Boundary).collect();
        debug_assert!(boundaries.len() == self.levels.len() && touched.len() == self.levels.len());
        // Where cells without neighbours have no row, nobody knows which those were.
        let old = self.levels.iter().all(|level| level.isolated == 0).then_some((self, touched));
        Self::of(&boundaries, self.n_columns, old)
    }

    fn of(boundaries: &[&dyn Boundary], n_columns: usize, old: Option<(&Self, &[Touched])>) -> Self {
        let before: Vec<Option<Before<'_>>> = map_indices(boundaries.len(), |k| {
            let (old, touched) = old?;
            Some(Before::new(&old.levels[k], &touched[k]))
        });
        let n_batches = n_columns.div_ceil(LANES);
        let levels = map_indices(boundaries.len(), |k| match (&before[k], old) {
            (Some(before), Some((old, _))) => {
                let (mut level, moved_to) = Level::renewed(boundaries[k], before);
                let anew = sorted_by_batch(&level.boundary, n_batches);
                let kept = (old.levels[k].boundary.as_slice(), old.batches[k].as_slice());
                let starts;
                (level.boundary, starts) = merged(kept, &moved_to, (&anew.0, &anew.1));
                (level, starts)
            }
            _ => {
                let mut level = Level::new(boundaries[k]);
                let starts;
                (level.boundary, starts) = sorted_by_batch(&level.boundary, n_batches);
                (level, starts)
            }
        });
        let (levels, batches): (Vec<Level>, _) = levels.into_iter().unzip();
        if old.is_some() && levels.iter().any(|level| level.isolated > 0) {
            // A cell that has lost its last neighbour has no row, but its line has the unknowns it had.
            return Self::of(boundaries, n_columns, None);
        }
        let transfers = map_indices(levels.len() - 1, |k| {
            let [fine, coarse] = [&levels[k], &levels[k + 1]];
            match (&before[k], &before[k + 1], old) {
                (Some(fine_before), Some(coarse_before), Some((old, _))) => {
                    old.transfers[k].renewed([fine, coarse], [fine_before, coarse_before])
                }
                _ => Transfer::new(fine, coarse),
            }
        });
        let centres = transfers.first().map(|t| Centres::new(&levels[0], t)).unwrap_or_default();
        Self { levels, transfers, centres, n_columns, batches }
    }

    /// Batches of [`LANES`] columns.
    #[must_use]
    pub fn n_batches(&self) -> usize {
        self.n_columns.div_ceil(LANES)
    }

    fn terms(&self, level: usize, batch: usize) -> &[BoundaryTerm] {
        let starts = &self.batches[level];
        &self.levels[level].boundary[starts[batch] as usize..starts[batch + 1] as usize]
    }

    /// Dirichlet terms of a level for some columns.
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

    /// Writes a batch's right-hand side of the finest level: one row per cut cell.
    pub fn fill_cut_rhs(&self, batch: usize, f: &mut Vec<Row>) {
        f.clear();
        f.resize(self.levels[0].n_cut(), [0.0; LANES]);
        for term in self.terms(0, batch) {
            f[term.cut_cell as usize][term.column as usize % LANES] = term.value;
        }
    }

    /// Writes a batch's right-hand side of a coarse level: one row per cell.
    pub fn fill_dense_rhs(&self, level: usize, batch: usize, f: &mut [Row]) {
        f.fill([0.0; LANES]);
        for term in self.terms(level, batch) {
            let row = self.levels[level].row_of_cut(term.cut_cell as usize);
            f[row][term.column as usize % LANES] = term.value;
        }
    }

    /// Bytes held by levels and transfers.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(Level::bytes).sum::<usize>()
            + self.transfers.iter().map(Transfer::bytes).sum::<usize>()
            + self.centres.bytes()
    }
}

/// A level's terms sorted by batch, within which they keep their order, and where each batch starts.
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

/// Terms of cut cells that were there before, by the number that each has now, and of those made anew. All are sorted by
/// batch, with where each batch starts.
fn merged(
    (kept, kept_starts): (&[BoundaryTerm], &[u32]),
    moved_to: &[u32],
    (anew, starts): (&[BoundaryTerm], &[u32]),
) -> (Vec<BoundaryTerm>, Vec<u32>) {
    let mut all = Vec::with_capacity(kept.len() + anew.len());
    let mut all_starts = vec![0];
    for (old, new) in kept_starts.windows(2).zip(starts.windows(2)) {
        let mut anew = &anew[new[0] as usize..new[1] as usize];
        for term in &kept[old[0] as usize..old[1] as usize] {
            let cut_cell = moved_to[term.cut_cell as usize];
            if cut_cell == NO_CELL {
                continue;
            }
            while let [first, rest @ ..] = anew
                && first.cut_cell < cut_cell
            {
                all.push(*first);
                anew = rest;
            }
            all.push(BoundaryTerm { cut_cell, ..*term });
        }
        all.extend_from_slice(anew);
        all_starts.push(all.len() as u32);
    }
    (all, all_starts)
}
