//! The hierarchy: each level's unknowns, their stencils and the transfers between levels.
//!
//! Unknowns are stored by colour, red cells first, each colour in grid order (x fastest) and closed by one row that
//! stays zero, the neighbour of whoever has none: `[red .., 0, black .., 0]`. A red-black sweep then streams
//! through contiguous memory, and a *run* of whole stencils needs seven numbers, not seven gathers a cell.

use std::ops::Range;

use glam::DVec3;

use crate::grid::{Grid, NO_CELL};

mod build;

/// Coarsening stops at this many unknowns: there, a few dozen sweeps cost nothing.
const COARSEST_UNKNOWNS: usize = 200;

/// The cage as a level sees it: which cells are unknowns, and where their arms end on the cage.
pub trait Boundary: Sync {
    /// The level's grid.
    fn grid(&self) -> Grid;
    /// Whether each cell is solved for. `[nz, ny, nx]`
    fn unknowns(&self) -> &[bool];
    /// Of each unknown the directions (bit d: +x, -x, +y, -y, +z, -z) in which its arm ends on the cage;
    /// what is there of other cells does not count. `[nz, ny, nx]`
    fn cut_arms(&self) -> &[u8];
    /// Weight of the arm (1 over its length in cells; 0 if it does not end on the cage after all); calls
    /// `hats(control vertex, value)` for the Dirichlet values at its end.
    fn arm(&self, cell: [u32; 3], direction: usize, hats: &mut dyn FnMut(u32, f64)) -> f64;
}

/// Unknowns of one colour in a row along x whose six neighbours are all unknowns, every second cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// First cell, within its colour.
    pub start: u32,
    /// Number of cells.
    pub len: u32,
    /// First cell's -x neighbour within the other colour; its +x neighbour is the next one.
    pub x: u32,
    /// First cell's -y, +y, -z, +z neighbours within the other colour.
    pub yz: [u32; 4],
}

/// An unknown next to the cage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutCell {
    /// The cell, within its colour.
    pub cell: u32,
    /// Neighbours within the other colour; the zero row where the arm is cut.
    pub neighbours: [u32; 6],
    /// Sum of the six arms' weights.
    pub diagonal: f32,
}

/// Dirichlet values that reach a cut cell: `value` is the hat value times the arm's weight, summed over arms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundaryTerm {
    /// Number of the cut cell: red ones first, then black.
    pub cut_cell: u32,
    /// Control vertex.
    pub column: u32,
    /// Its share of the right-hand side.
    pub value: f32,
}

/// What one colour's half sweep goes through.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Colour {
    /// Number of cells.
    pub n_cells: u32,
    /// Cells with whole stencils.
    pub runs: Vec<Run>,
    /// Cells next to the cage.
    pub cut: Vec<CutCell>,
    /// Where each z-plane's runs and cut cells start. `[nz + 1]`
    pub planes: Vec<[u32; 2]>,
}

impl Colour {
    /// The runs and the cut cells of a z-plane.
    #[inline(always)]
    #[must_use]
    pub fn of_plane(&self, plane: usize) -> [Range<usize>; 2] {
        let (start, end) = (self.planes[plane], self.planes[plane + 1]);
        [start[0] as usize..end[0] as usize, start[1] as usize..end[1] as usize]
    }
}

/// One level: its unknowns and their stencils.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// The level's grid.
    pub grid: Grid,
    /// Red and black.
    pub colours: [Colour; 2],
    /// Right-hand sides, ascending in `cut_cell`, then `column`.
    pub boundary: Vec<BoundaryTerm>,
    /// Row of each grid cell in the level's fields; [`NO_CELL`] where it is no unknown. `[nz, ny, nx]`
    pub row_of: Vec<u32>,
    /// Cells with no arm at all, which the axes' disagreement cut off from everything; not solved for.
    pub isolated: u64,
}

impl Level {
    /// Rows of a field on this level, the two zero rows included.
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.n_unknowns() + 2
    }

    /// Unknowns of both colours.
    #[must_use]
    pub fn n_unknowns(&self) -> usize {
        (self.colours[0].n_cells + self.colours[1].n_cells) as usize
    }

    /// First row of each colour.
    #[must_use]
    pub fn first_row(&self, colour: usize) -> usize {
        if colour == 0 { 0 } else { self.colours[0].n_cells as usize + 1 }
    }

    /// The row that stays zero, for cells that are no unknowns.
    #[must_use]
    pub fn zero_row(&self) -> u32 {
        self.colours[0].n_cells
    }

    /// Row of the cell at `cell + offset`; the zero row where it is no unknown.
    #[must_use]
    pub fn row_at(&self, cell: [u32; 3], offset: [i32; 3]) -> u32 {
        self.rows_at(cell, &[offset])[0]
    }

    /// Rows of the cells at `cell + offset`; the zero row where there is no unknown.
    #[inline]
    #[must_use]
    pub fn rows_at<const N: usize>(&self, cell: [u32; 3], offsets: &[[i32; 3]; N]) -> [u32; N] {
        let [sx, sy, sz] = self.grid.strides().map(|s| s as isize);
        // One step from the grid's sides, which is nearly everywhere, there is nothing to be checked.
        let is_within = (0..3).all(|a| cell[a] > 0 && cell[a] + 1 < self.grid.dims[a]);
        let center = if is_within { self.grid.index(cell) } else { 0 };
        offsets.map(|offset| {
            let row = if is_within && offset.iter().all(|d| d.abs() <= 1) {
                let [dx, dy, dz] = offset.map(|d| d as isize);
                self.row_of[center.wrapping_add_signed(dx * sx + dy * sy + dz * sz)]
            } else {
                self.grid.offset(cell, offset).map_or(NO_CELL, |c| self.row_of[self.grid.index(c)])
            };
            if row == NO_CELL { self.zero_row() } else { row }
        })
    }

    /// Number of cut cells of both colours.
    #[must_use]
    pub fn n_cut(&self) -> usize {
        self.colours[0].cut.len() + self.colours[1].cut.len()
    }

    /// Row of a cut cell, by its number: red ones first, then black.
    #[must_use]
    pub fn row_of_cut(&self, number: usize) -> usize {
        let [red, black] = &self.colours;
        match number.checked_sub(red.cut.len()) {
            None => red.cut[number].cell as usize,
            Some(number) => self.first_row(1) + black.cut[number].cell as usize,
        }
    }

    /// Centre of a cell, object units.
    #[must_use]
    pub fn center(&self, cell: [u32; 3]) -> DVec3 {
        self.grid.center(cell)
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(self.row_of.as_slice())
            + size_of_val(self.boundary.as_slice())
            + self
                .colours
                .iter()
                .map(|c| {
                    size_of_val(c.runs.as_slice())
                        + size_of_val(c.cut.as_slice())
                        + size_of_val(c.planes.as_slice())
                })
                .sum::<usize>()
    }
}

/// Cells of doubling size, from the finest on until few unknowns remain. `coarsen` makes the next coarser ones.
pub fn coarsened_until_few<C>(
    finest: C,
    unknowns: impl Fn(&C) -> &[bool],
    coarsen: impl Fn(&C) -> C,
) -> Vec<C> {
    let mut levels = vec![finest];
    loop {
        let last = &levels[levels.len() - 1];
        if unknowns(last).iter().filter(|&&unknown| unknown).count() <= COARSEST_UNKNOWNS {
            return levels;
        }
        let coarse = coarsen(last);
        if !unknowns(&coarse).contains(&true) {
            return levels;
        }
        levels.push(coarse);
    }
}

#[cfg(test)]
pub(crate) mod plain;
#[cfg(test)]
mod tests;
