//! The equations that an edit may have changed, and the cells whose old weights they and new stencils ask for.

use crate::grid::NO_CELL;
use crate::levels::{Level, Touched};

use super::region::Region;

/// Unknowns at moved faces whose equations may be others now.
pub(super) struct Equations {
    /// Index of each one's cell in the grid.
    pub(super) cells: Vec<u32>,
    /// Number of each row of the fields among them; [`NO_CELL`] if it is none of them. `[n_rows]`
    pub(super) number: Vec<u32>,
}

impl Equations {
    /// Of the unknowns in a region: those that are or were next to the cage, and new ones. All others have the equation of a
    /// cell with six neighbours, as before. If it is known what the edit has `touched`, those only.
    #[inline(never)]
    pub(super) fn changed(level: &Level, before: &Level, region: &Region, touched: Option<&Touched>) -> Self {
        let (cut, was_cut) = (cut_rows(level), cut_rows(before));
        let mut equations = Self { cells: Vec::new(), number: vec![NO_CELL; level.n_rows()] };
        for &cell in &region.cells {
            let (row, old_row) = (level.row_of[cell as usize], before.row_of[cell as usize]);
            if row == NO_CELL || touched.is_some_and(|touched| !touched.cells.has(cell as usize)) {
                continue;
            }
            let was_whole = old_row != NO_CELL && !was_cut[old_row as usize];
            if cut[row as usize] || !was_whole {
                equations.number[row as usize] = equations.cells.len() as u32;
                equations.cells.push(cell);
            }
        }
        equations
    }

    /// Their cells and those around them.
    #[inline(never)]
    pub(super) fn neighbourhood(&self, level: &Level) -> Region {
        let mut region = Region::none(&level.grid);
        let strides = level.grid.strides();
        for &cell in &self.cells {
            region.add(cell as usize);
            for stride in strides {
                // At the end of a line it is another line's: one too many, which nobody asks for.
                region.add(cell as usize + stride);
                region.add((cell as usize).wrapping_sub(stride));
            }
        }
        region
    }
}

/// Cells next to the cage that are in a region.
pub(super) fn n_cut_in(level: &Level, region: &Region) -> usize {
    let cut = cut_rows(level);
    let rows = region.cells.iter().map(|&cell| level.row_of[cell as usize]);
    rows.filter(|&row| row != NO_CELL && cut[row as usize]).count()
}

/// Whether each row's cell is next to the cage. `[n_rows]`
#[inline(never)]
fn cut_rows(level: &Level) -> Vec<bool> {
    let mut cut = vec![false; level.n_rows()];
    for number in 0..level.n_cut() {
        cut[level.row_of_cut(number)] = true;
    }
    cut
}

/// The cell of each row; [`NO_CELL`] for the two zero rows. `[n_rows]`
#[inline(never)]
pub(super) fn cells_of_rows(level: &Level) -> Vec<u32> {
    let mut cells = vec![NO_CELL; level.n_rows()];
    for (cell, &row) in (0u32..).zip(level.row_of.iter()) {
        if row != NO_CELL {
            cells[row as usize] = cell;
        }
    }
    cells
}
