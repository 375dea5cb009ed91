//! Levels of unknowns of the classic method: boundary cells are neighbours with fixed values.
//!
//! The finest level is that of K. Smith's paper (`docs/method.md`, sources): the six arms of each stencil are one cell
//! long, and each cell is the average of its neighbours. Coarser levels, used only by multigrid, keep every second cell;
//! there, an arm ends at the first boundary cell.

use crate::grid::Grid;
use crate::levels::Boundary;

use super::classic::{CellKind, ClassicCells};

/// The classic grid on one level. Level k uses every 2^k-th cell.
#[derive(Clone, Debug)]
pub struct PublishedCells<'a> {
    cells: &'a ClassicCells,
    fine: Grid,
    grid: Grid,
    step: u32,
    unknowns: Vec<bool>,
    cut: Vec<u8>,
}

impl<'a> PublishedCells<'a> {
    /// Creates the finest level, which consists of all cells.
    #[must_use]
    pub fn finest(cells: &'a ClassicCells) -> Self {
        let grid = Grid { dims: cells.dims, origin: cells.origin, cell: cells.cell_size };
        Self::on(cells, grid, grid, 1)
    }

    /// Creates the next coarser level, which keeps every second cell.
    #[must_use]
    pub fn coarsened(&self) -> Self {
        Self::on(self.cells, self.fine, self.grid.coarsened(), 2 * self.step)
    }

    fn on(cells: &'a ClassicCells, fine: Grid, grid: Grid, step: u32) -> Self {
        let mut level = Self { cells, fine, grid, step, unknowns: Vec::new(), cut: Vec::new() };
        level.unknowns =
            grid.cells().map(|c| level.kind(c.map(|x| x * step)) == CellKind::Interior).collect();
        let arms = |(cell, &unknown): ([u32; 3], &bool)| {
            let ends = |&d: &usize| unknown && level.first_boundary(cell, d).is_some();
            (0..6).filter(ends).fold(0, |arms, d| arms | 1 << d)
        };
        level.cut = grid.cells().zip(&level.unknowns).map(arms).collect();
        level
    }

    fn kind(&self, cell: [u32; 3]) -> CellKind {
        self.cells.kinds[self.fine.index(cell)]
    }

    /// First boundary cell in a direction within `step` cells, and its distance in cells of the finest level.
    fn first_boundary(&self, cell: [u32; 3], direction: usize) -> Option<(u32, u32)> {
        let mut at = cell.map(|x| x * self.step);
        for distance in 1..=self.step {
            at = self.fine.neighbour(at, direction)?;
            if self.kind(at) == CellKind::Boundary {
                return Some((self.fine.index(at) as u32, distance));
            }
        }
        None
    }
}

impl Boundary for PublishedCells<'_> {
    fn grid(&self) -> Grid {
        self.grid
    }

    fn unknowns(&self) -> &[bool] {
        &self.unknowns
    }

    fn cut_arms(&self) -> &[u8] {
        &self.cut
    }

    fn arm(&self, cell: [u32; 3], direction: usize, hats: &mut dyn FnMut(u32, f64)) -> f64 {
        let Some((at, distance)) = self.first_boundary(cell, direction) else { return 0.0 };
        let row = self.cells.boundary.row_of(at).expect("every boundary cell has values");
        let (columns, values) = self.cells.boundary.row(row);
        for (&column, &value) in columns.iter().zip(values) {
            hats(column, f64::from(value));
        }
        f64::from(self.step) / f64::from(distance)
    }
}
