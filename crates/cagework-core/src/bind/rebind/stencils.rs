//! The stencils of a few equations, and what cells that were outside begin with.

use crate::grid::NO_CELL;
use crate::levels::{CutCell, Level};
use crate::solve::rows::{LANES, Row};

use super::equations::Equations;
use super::fields::Extended;
use super::known::MAX_KNOWN;
use super::local::OldCells;
use super::shares::add_scaled;

/// Stencils of some equations of a level.
pub(super) struct FewStencils<'a> {
    level: &'a Level,
    equations: &'a Equations,
    /// For each equation its cut arms, if it has any, and the row that stands for no neighbour. `[n_equations]`
    cut_of: Vec<Option<(&'a CutCell, u32)>>,
}

impl<'a> FewStencils<'a> {
    /// Of these equations.
    pub(super) fn new(level: &'a Level, equations: &'a Equations) -> Self {
        let mut cut_of = vec![None; equations.cells.len()];
        for (c, colour) in level.colours.iter().enumerate() {
            let (first, none) = (level.first_row(c) as u32, level.colours[1 - c].n_cells);
            for cut in &colour.cut {
                let k = equations.number[(first + cut.cell) as usize];
                if k != NO_CELL {
                    cut_of[k as usize] = Some((cut, none));
                }
            }
        }
        Self { level, equations, cut_of }
    }

    /// Sum of the arms' weights.
    pub(super) fn diagonal(&self, k: usize) -> f32 {
        self.cut_of[k].map_or(6.0, |(cut, _)| cut.diagonal)
    }

    /// Adds the cage's values. `values`: of all columns, and whatever follows, `[n_equations][n_batches or more]`
    pub(super) fn add_boundary(&self, values: &mut [Row]) {
        let n = values.len() / self.equations.cells.len().max(1);
        for term in &self.level.boundary {
            let k = self.equations.number[self.level.row_of_cut(term.cut_cell as usize)];
            if k != NO_CELL {
                let column = term.column as usize;
                values[k as usize * n + column / LANES][column % LANES] += term.value;
            }
        }
    }

    /// Cells of an equation's neighbours.
    pub(super) fn neighbours(&self, k: usize) -> impl Iterator<Item = usize> {
        let (cell, strides) = (self.equations.cells[k] as usize, self.level.grid.strides());
        let is_there = move |d: usize| self.cut_of[k].is_none_or(|(cut, none)| cut.neighbours[d] != none);
        (0..6).filter(move |&d| is_there(d)).map(move |d| {
            let stride = strides[d / 2];
            if d % 2 == 0 { cell + stride } else { cell - stride }
        })
    }

    /// Puts what meets their equations into cells that were outside, from what is known around them: then a correction is as
    /// smooth there as elsewhere, where from nothing it would be a weight high. Columns as known corrections, which are zero on
    /// the cage, go on into them in the same way. `boundary`: the cage's values, as of [`Self::add_boundary`]. Cells with none
    /// around them stay what they are.
    pub(super) fn extend(&self, before: &Level, boundary: &[Row], old: &mut OldCells<'_>) {
        let is_new = |cell: usize| before.row_of[cell] == NO_CELL;
        let cells = &self.equations.cells;
        let n = boundary.len() / cells.len().max(1);
        let mut pending: Vec<usize> = (0..cells.len()).filter(|&k| is_new(cells[k] as usize)).collect();
        loop {
            let mut found = Vec::new();
            pending.retain(|&k| {
                let mut row = boundary[k * n..][..old.n_batches()].to_vec();
                let (mut weight, mut of_moved) = (self.diagonal(k), [0.0; MAX_KNOWN]);
                for cell in self.neighbours(k) {
                    if is_new(cell) && !old.is_extended(cell) {
                        weight -= 1.0;
                    } else {
                        add_scaled(&mut row, old.at(cell), 1.0);
                        for (sum, of) in of_moved.iter_mut().zip(old.of_moved(cell)) {
                            *sum += of;
                        }
                    }
                }
                // At least one known arm, which is no longer than a cell, or what rounding leaves of none.
                let is_known = weight > 0.5;
                if is_known {
                    row.iter_mut().flatten().for_each(|w| *w /= weight);
                    of_moved = of_moved.map(|of| of / weight);
                    found.push(Extended { cell: cells[k], row, of_moved });
                }
                !is_known
            });
            if found.is_empty() {
                return;
            }
            for extended in found {
                old.set(extended);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DVec3, Vec3};

    use super::*;
    use crate::bind::rebind::CHANGED;
    use crate::bind::rebind::fields::Fields;
    use crate::bind::rebind::moved::swept_by;
    use crate::bind::rebind::region::Region;
    use crate::cage::Cage;
    use crate::levels::plain::askew_c;
    use crate::solve::rows::ZERO;
    use crate::voxelize::embedded::Embedding;

    /// f32 rounding of a row of some dozen weights, made of up to six rows with weights up to 1,000.
    const ROUNDED: f32 = 1e-5;

    /// Hat values sum to 1, and so do old weights: what is made of both does too, and lies between them. Where cells are several
    /// layers deep inside, the inner ones are found first.
    #[test]
    fn cells_that_were_outside_get_means_of_what_is_around_them() {
        let (cage, grid) = askew_c();
        let level_of = |cage: &Cage| Level::new(&Embedding::new(cage, &grid).boundaries(cage)[0]);
        let mut smaller = cage.to_polygon_mesh();
        let pushed = &mut smaller.positions[3];
        *pushed += (cage.bounds().center() - *pushed).normalize() * (3.0 * grid.cell.x) as f32;
        let smaller = Cage::new(&smaller).unwrap();
        let (before, level) = (level_of(&smaller), level_of(&cage));
        let to_grid = |p: Vec3| -> DVec3 { grid.to_grid(p.as_dvec3()) };
        let swept = swept_by(&smaller, &cage, to_grid).unwrap();
        let region = Region::around(&swept.triangles, CHANGED + swept.slack, &grid);
        let equations = Equations::changed(&level, &before, &region, None);

        let (n, n_batches) = (cage.n_vertices(), cage.n_vertices().div_ceil(LANES));
        let equal = |batch: usize| -> Row {
            std::array::from_fn(|k| if batch * LANES + k < n { 1.0 / n as f32 } else { 0.0 })
        };
        let base = (0..n_batches).map(|batch| vec![equal(batch); before.n_rows()]).collect();
        let mut fields = Fields::new(base, Arc::clone(&before.row_of));
        let needed = equations.neighbourhood(&level);
        let mut old = OldCells::new(&mut fields, &needed, n_batches, &[]);
        let stencils = FewStencils::new(&level, &equations);
        let mut boundary = vec![ZERO; equations.cells.len() * n_batches];
        stencils.add_boundary(&mut boundary);
        stencils.extend(&before, &boundary, &mut old);

        let new = |cell: usize| level.row_of[cell] != NO_CELL && before.row_of[cell] == NO_CELL;
        let found: Vec<usize> = (0..grid.n_cells()).filter(|&cell| new(cell)).collect();
        assert!(
            found.len() > 5 && old.n_extended() == found.len(),
            "{} of {}",
            old.n_extended(),
            found.len()
        );
        for cell in found {
            let row = old.at(cell).as_flattened();
            let sum: f32 = row.iter().sum();
            assert!((sum - 1.0).abs() <= ROUNDED, "cell {cell}: weights sum to {sum}");
            assert!(row.iter().all(|w| (-ROUNDED..=1.0 + ROUNDED).contains(w)), "cell {cell}: {row:?}");
        }
    }
}
