//! What an edit does to the linear system, looked at only where the moved faces are.

use glam::{DVec3, DVec4};

use crate::grid::{Grid, NO_CELL};
use crate::levels::Level;
use crate::simd::dispatch;
use crate::solve::rows::{LANES, Row, ZERO};
use crate::weights::affine::Columns;

use super::equations::Equations;
use super::fields::{Extended, Fields};
use super::known::{Known, MAX_KNOWN, OfMoved};
use super::lenience;
use super::region::Region;
use super::shares::{Shares, add_scaled};
use super::stencils::FewStencils;

/// What is left out, as changes of a weight.
#[derive(Clone, Copy, Debug)]
pub(super) struct Negligible {
    /// Smallest entry of a residual that counts: the solver leaves that much anyway.
    pub(super) residual: f32,
    /// Smallest change of a weight by one of the corrections that counts: all that are left out stay below the residual's.
    pub(super) correction: f32,
    /// Smallest weight that is stored where none was.
    pub(super) weight: f32,
}

impl Negligible {
    /// The threshold that is solved to, but no less than f32 can tell, and no more than the default. Of 48 edits of the
    /// samples' cages, three in a row each, a third of it makes the mean error of a weight, 5.5e-8 to 1.6e-7, smaller by up
    /// to 2e-8, and takes a quarter more corrections.
    pub(super) fn at(tau: f32) -> Self {
        // Whole binds with a coarser tau are far more exact than it, by full multigrid: edits must not be worse.
        let residual = tau.clamp(1e-6, 1e-5);
        // There are seldom more than 40 corrections.
        Self { residual, correction: residual / 40.0, weight: residual / 10.0 }
    }
}

/// What residuals change by must be so many times what counts to be worth a batch of its own, 2.2 times as many with 24 vertices
/// (the root of [`lenience`]: then 12 times; 16 times leave weights 7.4e-5 off where a bind's are 2e-5, in a box of 18 vertices).
const MANY: f32 = 5.5;

/// So many times a residual, which may change its own cell's weight by itself, must be below that, too.
const FLATTER: f32 = 1.5;

/// An arm to the cage counts for no more than this in a block: cells on the cage do not hold those around them.
const FIRMEST: f32 = 6.0;

/// Moments must be met so many times as well as weights: then most rows need not be restored after they were corrected.
const KEENER: f32 = 30.0;

/// What the old fields leave of equations that may have changed: one row of all columns for each unknown, as the change of
/// the cell's weights that would meet its own equation.
pub(super) struct Residual {
    /// Cell of each unknown.
    cells: Vec<u32>,
    diagonals: Vec<f32>,
    /// Of each, what its arms to the cage add to the diagonal.
    bound: Vec<f32>,
    grid: Grid,
    /// The last batch is none of columns, but of moments: [`KEENER`] times what the columns' residuals sum to, each times its
    /// cage vertex (x, y, z, over the cage's diagonal) and by themselves; and of what `times` the moved vertices' columns
    /// are solutions for. `[n_unknowns][n_batches + 1]`
    values: Vec<Row>,
    n_batches: usize,
    known: Known,
    /// As large as their moments are. `[at most MAX_KNOWN]`
    times: Vec<f32>,
    negligible: Negligible,
}

/// Independent residuals and every column's shares in them.
pub(super) struct Split {
    /// Cells that right-hand sides have anything in.
    pub(super) cells: Vec<u32>,
    /// Right-hand sides. `[n_batches of them][cells.len()]`
    pub(super) right: Vec<Vec<Row>>,
    pub(super) shares: Shares,
}

impl Residual {
    /// Residuals of equations; `old` must know their cells and those around them. Their moments are made what they must be if
    /// there are `columns`.
    pub(super) fn new(
        [level, before]: [&Level; 2],
        equations: &Equations,
        n_batches: usize,
        old: &mut OldCells<'_>,
        columns: Option<&Columns>,
        moved: &[(usize, DVec3)],
        negligible: Negligible,
    ) -> Self {
        let cells = equations.cells.clone();
        let stencils = FewStencils::new(level, equations);
        let mut values = vec![ZERO; cells.len() * (n_batches + 1)];
        stencils.add_boundary(&mut values);
        stencils.extend(before, &values, old);
        let diagonals: Vec<f32> = (0..cells.len()).map(|k| stencils.diagonal(k)).collect();
        let bound =
            diagonals.iter().enumerate().map(|(k, d)| d - stencils.neighbours(k).count() as f32).collect();
        let grid = level.grid;
        let times = moved.iter().take(MAX_KNOWN).map(|(_, way)| KEENER * way.length() as f32).collect();
        let known = old.known.clone();
        let mut residual =
            Self { cells, diagonals, bound, grid, values, n_batches, known, times, negligible };
        for (k, cell) in equations.cells.iter().map(|&cell| cell as usize).enumerate() {
            let row = &mut residual.values[k * (n_batches + 1)..][..n_batches + 1];
            let (out, moments) = row.split_at_mut(n_batches);
            let of = |row: &[Row], column: usize| row[column / LANES][column % LANES];
            let given: Vec<f32> = moved.iter().map(|&(column, _)| of(out, column)).collect();
            let mut ideal = DVec4::ZERO;
            let mut missing = |cell: usize, weight: f64| {
                if let (NO_CELL, Some(columns)) = (before.row_of[cell], columns) {
                    let row = old.at(cell);
                    let (sum, point) = columns.combined(row);
                    let way: DVec3 = moved.iter().map(|&(c, way)| f64::from(of(row, c)) * way).sum();
                    let place = columns.scale(level.grid.center(level.grid.cell(cell)));
                    ideal += weight * (place + way - point).extend(1.0 - sum);
                }
            };
            let mut left = old.of_moved(cell).map(|of| of * residual.diagonals[k]);
            for neighbour in stencils.neighbours(k) {
                add_scaled(out, old.at(neighbour), 1.0);
                missing(neighbour, -1.0);
                for (left, of) in left.iter_mut().zip(old.of_moved(neighbour)) {
                    *left -= of;
                }
            }
            add_scaled(out, old.at(cell), -residual.diagonals[k]);
            missing(cell, f64::from(residual.diagonals[k]));
            let scale = 1.0 / residual.diagonals[k];
            // Linear functions meet the new equations with the new cage's values, and old weights reproduce the place of a
            // cell and, for each moved vertex of the cage, its weight times its way. What cells that were outside got
            // does so but for what is `missing`.
            for (&(column, way), given) in moved.iter().zip(given) {
                ideal += (way * f64::from(of(out, column) - given)).extend(0.0);
            }
            if columns.is_some() {
                let ideal = (ideal * f64::from(KEENER * scale)).as_vec4().to_array();
                moments[0][..4].copy_from_slice(&ideal);
            }
            let known = moments[0][LANES - MAX_KNOWN..].iter_mut();
            for (known, (left, times)) in known.zip(left.iter().zip(&residual.times)) {
                *known = left * times * scale;
            }
            for w in out.iter_mut().flatten() {
                *w *= scale;
            }
        }
        residual.drop_negligible();
        if let Some(columns) = columns {
            for row in residual.values.chunks_exact_mut(n_batches + 1) {
                let (row, moments) = row.split_at_mut(n_batches);
                let [x, y, z, sum, ..] = moments[0].map(|moment| f64::from(moment / KEENER));
                columns.impose(row, sum, DVec3::new(x, y, z));
            }
        }
        residual
    }

    /// Leaves only unknowns whose equations have changed.
    fn drop_negligible(&mut self) {
        let (mut kept, n) = (0, self.n_batches + 1);
        for k in 0..self.cells.len() {
            let row = &self.values[k * n..][..n];
            if row.iter().flatten().any(|w| w.abs() >= self.negligible.residual) {
                self.values.copy_within(k * n..(k + 1) * n, kept * n);
                self.cells.swap(kept, k);
                self.diagonals.swap(kept, k);
                self.bound.swap(kept, k);
                kept += 1;
            }
        }
        self.values.truncate(kept * n);
        self.cells.truncate(kept);
        self.diagonals.truncate(kept);
        self.bound.truncate(kept);
    }

    /// How much weights change about by what is left of the columns' residuals together: cells of a block that are off in the same
    /// way change by more than each alone, and only arms to the cage hold them. Residuals of both signs do not add up.
    fn effect(&self) -> f32 {
        let (n, blocks) = (self.n_batches, self.grid.coarsened());
        let block_of = |cell: u32| blocks.index(self.grid.cell(cell as usize).map(|x| x / 2)) as u32;
        let mut order: Vec<[u32; 2]> =
            (0u32..).zip(&self.cells).map(|(k, &cell)| [block_of(cell), k]).collect();
        order.sort_unstable();
        let mut largest: f32 = 0.0;
        for block in order.chunk_by(|a, b| a[0] == b[0]) {
            let (mut sum, mut bound) = (vec![ZERO; n], 0.0);
            for k in block.iter().map(|[_, k]| *k as usize) {
                let firm = self.bound[k].min(FIRMEST);
                let share = if firm < self.bound[k] { firm / self.bound[k] } else { 1.0 };
                add_scaled(&mut sum, &self.values[k * (n + 1)..], share * self.diagonals[k]);
                bound += firm;
            }
            let most = sum.iter().flatten().fold(0.0, |a: f32, w| a.max(w.abs()));
            largest = largest.max(most / bound.max(1.0));
        }
        largest
    }

    /// Splits the residuals of all columns into a few independent ones and the columns' shares in them.
    ///
    /// Gram-Schmidt, the largest column first: harmonic functions that vanish on the same faces are nearly alike a few
    /// cells away, so 44 to 219 columns have 8 to 24 independent residuals to five digits.
    pub(super) fn split(self, n_columns: usize) -> Split {
        dispatch(
            #[inline(always)]
            || self.split_columns(n_columns),
        )
    }

    #[inline(always)]
    fn split_columns(mut self, n_columns: usize) -> Split {
        let n_batches = n_columns.div_ceil(LANES);
        let many = MANY * lenience(n_batches).sqrt();
        self.known.take_out(&mut self.values, n_batches, &self.times);
        // The last four are moments.
        let columns = || (0..n_columns).chain((0..4).map(|k| n_batches * LANES + k));
        let mut right = Vec::new();
        let mut shares = Shares::new(n_batches, self.known.clone());
        let mut largest = vec![ZERO; n_batches + 1];
        let nothing = vec![ZERO; n_batches + 1];
        for row in self.values.chunks_exact_mut(n_batches + 1) {
            add_scaled_and_measure(row, &nothing, 0.0, &mut largest);
        }
        loop {
            let size = |c: usize| largest[c / LANES][c % LANES];
            let pivot = columns().max_by(|&a, &b| size(a).total_cmp(&size(b))).unwrap_or(0);
            let rank = shares.len();
            // Another batch for little more than nothing costs as much as the one before.
            let needs_batch = rank > 0 && rank.is_multiple_of(LANES);
            let least = self.negligible.residual;
            let is_little = || FLATTER * size(pivot) < many * least && self.effect() < many * least;
            if size(pivot) < least || needs_batch && is_little() {
                return Split { cells: self.cells, right, shares };
            }
            let of_pivot = self.values.iter().skip(pivot / LANES).step_by(n_batches + 1);
            let column: Vec<f32> = of_pivot.map(|row| row[pivot % LANES]).collect();
            let norm = column.iter().map(|&x| f64::from(x).powi(2)).sum::<f64>().sqrt() as f32;
            let unit: Vec<f32> = column.iter().map(|x| x / norm).collect();
            let mut share = vec![ZERO; n_batches + 1];
            for (row, &q) in self.values.chunks_exact(n_batches + 1).zip(&unit) {
                add_scaled(&mut share, row, q);
            }
            largest.fill(ZERO);
            for (row, &q) in self.values.chunks_exact_mut(n_batches + 1).zip(&unit) {
                add_scaled_and_measure(row, &share, -q, &mut largest);
                // Exactly, so that no column is taken twice.
                row[pivot / LANES][pivot % LANES] = 0.0;
            }
            largest[pivot / LANES][pivot % LANES] = 0.0;
            if rank.is_multiple_of(LANES) {
                right.push(vec![ZERO; self.cells.len()]);
            }
            share.truncate(n_batches);
            let norm = shares.push(share, self.negligible);
            let batch = &mut right[rank / LANES];
            for ((values, &q), &diagonal) in batch.iter_mut().zip(&unit).zip(&self.diagonals) {
                values[rank % LANES] = q * diagonal * norm;
            }
        }
    }
}

/// `out += value * share`; `largest` grows to what is there then, without the sign.
#[inline(always)]
fn add_scaled_and_measure(out: &mut [Row], share: &[Row], value: f32, largest: &mut [Row]) {
    for ((out, share), largest) in out.iter_mut().zip(share).zip(largest) {
        let (mut sum, mut high) = (*out, *largest);
        for lane in 0..LANES {
            sum[lane] += value * share[lane];
            // Wasm has no instruction for `max`.
            let size = sum[lane].abs();
            high[lane] = if size > high[lane] { size } else { high[lane] };
        }
        (*out, *largest) = (sum, high);
    }
}

/// The old fields in some cells: all columns of each.
pub(super) struct OldCells<'a> {
    region: &'a Region,
    /// `[n_cells][n_batches]`
    values: Vec<Row>,
    n_batches: usize,
    nothing: Vec<Row>,
    pub(super) known: Known,
    /// Cells that a row was put into.
    extended: Vec<Extended>,
    /// Number of each cell of the region among those; [`NO_CELL`] if it is none of them.
    number_of_extended: Vec<u32>,
}

impl<'a> OldCells<'a> {
    pub(super) fn new(
        fields: &mut Fields,
        region: &'a Region,
        n_batches: usize,
        moved: &[(usize, DVec3)],
    ) -> Self {
        let mut values = vec![ZERO; region.cells.len() * n_batches];
        dispatch(
            #[inline(always)]
            || fields.read(&region.cells, &mut values),
        );
        let (nothing, number_of_extended) = (vec![ZERO; n_batches], vec![NO_CELL; region.cells.len()]);
        let known = Known::new(moved);
        Self { region, values, n_batches, nothing, known, extended: Vec::new(), number_of_extended }
    }

    /// All columns of a cell of the grid; zeros for one that is none of them.
    pub(super) fn at(&self, cell: usize) -> &[Row] {
        match self.region.number.get(cell) {
            Some(&k) if k != NO_CELL => &self.values[k as usize * self.n_batches..][..self.n_batches],
            _ => &self.nothing,
        }
    }

    pub(super) fn n_batches(&self) -> usize {
        self.n_batches
    }

    /// What the moved vertices' columns are in a cell, as known corrections.
    #[inline(always)]
    pub(super) fn of_moved(&self, cell: usize) -> OfMoved {
        match self.number_of_extended(cell) {
            Some(k) => self.extended[k].of_moved,
            None => self.known.of_moved(self.at(cell)),
        }
    }

    /// Puts a row into a cell that was outside, which must be one of them.
    pub(super) fn set(&mut self, extended: Extended) {
        let number = self.region.number[extended.cell as usize] as usize;
        let first = number * self.n_batches;
        self.values[first..first + self.n_batches].copy_from_slice(&extended.row);
        self.number_of_extended[number] = self.extended.len() as u32;
        self.extended.push(extended);
    }

    /// Number of a cell among those that a row was put into.
    fn number_of_extended(&self, cell: usize) -> Option<usize> {
        let number = self.region.number.get(cell);
        let k = number.and_then(|&k| self.number_of_extended.get(k as usize)).filter(|&&k| k != NO_CELL);
        k.map(|&k| k as usize)
    }

    /// Whether a row was put there.
    pub(super) fn is_extended(&self, cell: usize) -> bool {
        self.number_of_extended(cell).is_some()
    }

    /// Cells that a row was put into.
    pub(super) fn n_extended(&self) -> usize {
        self.extended.len()
    }

    /// What was put into cells, by cell.
    pub(super) fn into_extended(mut self) -> Vec<Extended> {
        let mut order: Vec<[u32; 2]> =
            (0u32..).zip(&self.extended).map(|(k, extended)| [extended.cell, k]).collect();
        // As for blocks of residuals: another type's sort would be downloaded.
        order.sort_unstable();
        let all = &mut self.extended;
        order.into_iter().map(|[_, k]| std::mem::take(&mut all[k as usize])).collect()
    }
}
