//! Transfers between a level and the next coarser one.
//!
//! Prolongation is trilinear, with zero in cells outside the cage, as the error is zero on the cage. Restriction is its
//! transpose, scaled by 1/2 = 4/8: the coarse operator is `(2h)^2` times the Laplacian, which is a factor of 4, and the
//! transpose gathers the weight of eight fine cells. A red-black sweep that ends with black leaves no residual on black
//! cells, and a sweep that starts with red overwrites red cells. Restriction therefore reads only red cells, and
//! prolongation writes only black ones.

use crate::grid::{Grid, NO_CELL};
use crate::levels::Level;

/// Weight in restriction of the fine cell at the coarse cell's centre.
pub const RESTRICT_CENTRE: f32 = 0.5;
/// Weight in restriction of each of the twelve red cells that share an edge with the centre cell.
pub const RESTRICT_EDGE: f32 = 0.125;

/// Red fine cells around a coarse cell, as rows of the fine level: the centre, then twelve edge neighbours.
pub type RestrictRow = [u32; 13];

/// A black fine cell between two coarse cells (one odd coordinate) or eight (three odd coordinates).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProlongRow<const N: usize> {
    /// Index of the fine cell among the black cells.
    pub cell: u32,
    /// Rows of the coarse cells around the fine cell; the coarse level's zero row for cells that are not unknowns.
    pub coarse: [u32; N],
    /// Inverse of the number of coarse cells around the fine cell that are unknowns; 0 if there are none. Full
    /// multigrid starts from the mean of the coarse values, because the solution, unlike the error, is not zero on the
    /// cage.
    pub mean: f32,
}

/// Restriction and prolongation between a level and the next coarser one.
#[derive(Clone, Debug, PartialEq)]
pub struct Transfer {
    /// For each coarse unknown, red ones before black ones: the fine cells whose residuals it gathers.
    pub restrict_rows: [Vec<RestrictRow>; 2],
    /// Black cells with one odd coordinate, ascending.
    pub faces: Vec<ProlongRow<2>>,
    /// Black cells with three odd coordinates, ascending.
    pub corners: Vec<ProlongRow<8>>,
    /// First entry of `faces` and of `corners` for each z-plane. `[nz + 1]`
    pub planes: Vec<[u32; 2]>,
}

/// Offsets of a cell and its twelve edge neighbours.
const CENTRE_AND_EDGES: [[i32; 3]; 13] = [
    [0, 0, 0],
    [1, 1, 0],
    [-1, 1, 0],
    [1, -1, 0],
    [-1, -1, 0],
    [1, 0, 1],
    [-1, 0, 1],
    [1, 0, -1],
    [-1, 0, -1],
    [0, 1, 1],
    [0, -1, 1],
    [0, 1, -1],
    [0, -1, -1],
];

/// Offsets of the corners of a cube.
const CORNERS: [[i32; 3]; 8] =
    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1]];

impl Transfer {
    /// Computes the transfer between `fine` and `coarse`, whose grid must be `fine.grid.coarsened()`.
    #[must_use]
    pub fn new(fine: &Level, coarse: &Level) -> Self {
        let [nx, ny, nz] = fine.grid.dims;
        // Black cells have one odd coordinate or three. About a quarter of them have three.
        let n_black = fine.colours[1].n_cells as usize;
        let mut tables = Self {
            restrict_rows: [0, 1].map(|c| Vec::with_capacity(coarse.colours[c].n_cells as usize)),
            faces: Vec::with_capacity(n_black * 13 / 16),
            corners: Vec::with_capacity(n_black * 5 / 16),
            planes: Vec::with_capacity(nz as usize + 1),
        };
        for z in 0..nz {
            tables.mark_plane();
            for y in 0..ny {
                let rows = &fine.row_of[fine.grid.index([0, y, z])..][..nx as usize];
                for x in (1 - (y + z) % 2..nx).step_by(2).filter(|&x| rows[x as usize] != NO_CELL) {
                    let cell = rows[x as usize] - fine.first_row(1) as u32;
                    let low = [x / 2, y / 2, z / 2];
                    let odd = [x, y, z].map(|i| (i % 2) as i32);
                    if odd == [1; 3] {
                        tables.corners.push(prolong_row(coarse, cell, low, &CORNERS));
                    } else {
                        tables.faces.push(prolong_row(coarse, cell, low, &[[0; 3], odd]));
                    }
                }
            }
        }
        tables.mark_plane();
        let [nx, ny, nz] = coarse.grid.dims;
        for (y, z) in (0..nz).flat_map(|z| (0..ny).map(move |y| (y, z))) {
            let rows = &coarse.row_of[coarse.grid.index([0, y, z])..][..nx as usize];
            for cell in (0..nx).filter(|&x| rows[x as usize] != NO_CELL).map(|x| [x, y, z]) {
                let around = fine.rows_at(cell.map(|i| 2 * i), &CENTRE_AND_EDGES);
                tables.restrict_rows[Grid::colour(cell)].push(around);
            }
        }
        tables
    }

    fn mark_plane(&mut self) {
        self.planes.push([self.faces.len() as u32, self.corners.len() as u32]);
    }

    /// Size in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.restrict_rows.iter().map(|r| size_of_val(r.as_slice())).sum::<usize>()
            + size_of_val(self.faces.as_slice())
            + size_of_val(self.corners.as_slice())
            + size_of_val(self.planes.as_slice())
    }
}

fn prolong_row<const N: usize>(
    coarse: &Level,
    cell: u32,
    low: [u32; 3],
    offsets: &[[i32; 3]; N],
) -> ProlongRow<N> {
    let rows = coarse.rows_at(low, offsets);
    let unknowns = rows.iter().filter(|&&row| row != coarse.zero_row()).count();
    let mean = if unknowns == 0 { 0.0 } else { 1.0 / unknowns as f32 };
    ProlongRow { cell, coarse: rows, mean }
}

#[cfg(test)]
mod tests;
