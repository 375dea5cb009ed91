//! The hierarchy: unknowns of each level, their stencils, and transfers between levels.
//!
//! Unknowns are stored by colour, red before black, each in grid order (x fastest). One zero row follows each colour
//! and stands for missing neighbours: `[red .., 0, black .., 0]`. A red-black half sweep then streams through
//! contiguous memory, and a *run* of complete stencils is stored as seven numbers instead of seven indices per cell.

use std::ops::Range;

use glam::DVec3;

use crate::grid::{Grid, NO_CELL};

mod build;

/// Coarsening stops at this many unknowns, where a few dozen sweeps take negligible time.
const COARSEST_UNKNOWNS: usize = 200;

/// A level's view of the cage: which cells are unknowns, and which of their arms end on the cage. The six *arms* of a
/// cell are the segments from its centre to the centres of its neighbours, or to the cage if it is nearer.
pub trait Boundary: Sync {
    /// The level's grid.
    fn grid(&self) -> Grid;
    /// Whether each cell is an unknown. `[nz, ny, nx]`
    fn unknowns(&self) -> &[bool];
    /// Directions of each unknown in which its arm ends on the cage (bits: +x, -x, +y, -y, +z, -z). Values of other
    /// cells are ignored. `[nz, ny, nx]`
    fn cut_arms(&self) -> &[u8];
    /// Weight of an arm: 1 over its length in cells, or 0 if it does not end on the cage. Calls `hats(control, value)`
    /// for the Dirichlet values at its end.
    fn arm(&self, cell: [u32; 3], direction: usize, hats: &mut dyn FnMut(u32, f64)) -> f64;
}

/// Consecutive cells of one colour in a row along x, that is, every second cell. They are unknowns whose six neighbours
/// are all unknowns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// Index of the run's first cell among the cells of its colour.
    pub start: u32,
    /// Number of cells of the run.
    pub len: u32,
    /// Index of the first cell's -x neighbour among the cells of the other colour; the +x neighbour follows.
    pub x: u32,
    /// Indices of the first cell's -y, +y, -z, +z neighbours among the cells of the other colour.
    pub yz: [u32; 4],
}

/// An unknown next to the cage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutCell {
    /// Index of the unknown among the cells of its colour.
    pub cell: u32,
    /// Indices of the six neighbours among the cells of the other colour; the zero row if the arm ends on the cage.
    pub neighbours: [u32; 6],
    /// Sum of the weights of the six arms.
    pub diagonal: f32,
}

/// A Dirichlet value of a cut cell: hat value times arm weight, summed over its arms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundaryTerm {
    /// Number of the cut cell, red before black.
    pub cut_cell: u32,
    /// Control whose column the term belongs to.
    pub column: u32,
    /// Contribution of the Dirichlet value to the right-hand side.
    pub value: f32,
}

/// Stencils of one colour, in the order of a half sweep.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Colour {
    /// Number of unknowns of this colour.
    pub n_cells: u32,
    /// Cells with complete stencils.
    pub runs: Vec<Run>,
    /// Cells next to the cage.
    pub cut: Vec<CutCell>,
    /// First run and first cut cell of each z-plane. `[nz + 1]`
    pub planes: Vec<[u32; 2]>,
}

impl Colour {
    /// Ranges of runs and cut cells of a z-plane.
    #[inline(always)]
    #[must_use]
    pub fn of_plane(&self, plane: usize) -> [Range<usize>; 2] {
        let (start, end) = (self.planes[plane], self.planes[plane + 1]);
        [start[0] as usize..end[0] as usize, start[1] as usize..end[1] as usize]
    }
}

/// One level: unknowns and stencils.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// The level's grid.
    pub grid: Grid,
    /// Stencils of the red cells, then of the black cells.
    pub colours: [Colour; 2],
    /// Terms of the right-hand sides, ascending in `cut_cell`, then `column`; in a
    /// [`Hierarchy`](crate::solve::hierarchy::Hierarchy), sorted by batch first.
    pub boundary: Vec<BoundaryTerm>,
    /// Row of each grid cell in the level's fields; [`NO_CELL`] if it is not an unknown. `[nz, ny, nx]`
    pub row_of: Vec<u32>,
    /// Number of inside cells that are not unknowns because they have no arm: no neighbour is an unknown, and no arm
    /// ends on the cage. This happens if lines along x, y and z classify cells differently.
    pub isolated: u64,
}

impl Level {
    /// Number of rows of a field, including the two zero rows.
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.n_unknowns() + 2
    }

    /// Number of unknowns.
    #[must_use]
    pub fn n_unknowns(&self) -> usize {
        (self.colours[0].n_cells + self.colours[1].n_cells) as usize
    }

    /// First row of the cells of a colour: 0 red, 1 black.
    #[must_use]
    pub fn first_row(&self, colour: usize) -> usize {
        if colour == 0 { 0 } else { self.colours[0].n_cells as usize + 1 }
    }

    /// Row of zeros that stands for cells that are not unknowns.
    #[must_use]
    pub fn zero_row(&self) -> u32 {
        self.colours[0].n_cells
    }

    /// Row of the cell at `cell + offset`; the zero row if it is not an unknown.
    #[must_use]
    pub fn row_at(&self, cell: [u32; 3], offset: [i32; 3]) -> u32 {
        self.rows_at(cell, &[offset])[0]
    }

    /// Rows of the cells at `cell + offset`; the zero row for cells that are not unknowns.
    #[inline]
    #[must_use]
    pub fn rows_at<const N: usize>(&self, cell: [u32; 3], offsets: &[[i32; 3]; N]) -> [u32; N] {
        let [sx, sy, sz] = self.grid.strides().map(|s| s as isize);
        // Fast path: a cell that is at least one cell away from the grid's sides needs no bounds checks.
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

    /// Number of cut cells.
    #[must_use]
    pub fn n_cut(&self) -> usize {
        self.colours[0].cut.len() + self.colours[1].cut.len()
    }

    /// Row of a cut cell by its number, red before black.
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

    /// Memory of the level's stencils and tables, bytes.
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

/// Returns the finest level and the coarser ones that `coarsen` makes from it, down to the first level with at most
/// `COARSEST_UNKNOWNS` unknowns. Ends earlier if the next level has none.
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
