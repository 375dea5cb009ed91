//! The hierarchy: each level's unknowns, their stencils and the transfers between levels.
//!
//! Unknowns are stored by colour, red cells first, each colour in grid order (x fastest) and closed by one row that
//! stays zero, the neighbour of whoever has none: `[red .., 0, black .., 0]`. A red-black sweep then streams
//! through contiguous memory, and a *run* of whole stencils needs seven numbers, not seven gathers a cell.

use glam::DVec3;

use crate::grid::{Grid, NO_CELL};
use crate::voxelize::map_indices;

/// Planes that a thread takes at a time: cells next to the cage, which cost most, are not spread evenly.
const SLAB: u32 = 8;

/// The cage as a level sees it: which cells are unknowns, and where their arms end on the cage.
pub trait Boundary {
    /// The level's grid.
    fn grid(&self) -> Grid;
    /// Whether a cell is solved for.
    fn is_unknown(&self, cell: [u32; 3]) -> bool;
    /// Number of cells that are solved for.
    fn count_unknowns(&self) -> usize {
        self.grid().cells().filter(|&cell| self.is_unknown(cell)).count()
    }
    /// Directions (bit d: +x, -x, +y, -y, +z, -z) in which the arm of an unknown ends on the cage.
    fn cut_arms(&self, cell: [u32; 3]) -> u8;
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
#[derive(Clone, Debug, Default)]
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

/// One level: its unknowns and their stencils.
#[derive(Clone, Debug)]
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

    /// Builds the stencils of all unknowns.
    #[must_use]
    pub fn new(boundary: &(impl Boundary + Sync)) -> Self {
        let grid = boundary.grid();
        let (row_of, n_cells, isolated) = number_cells(boundary, &grid);
        let mut level = Self {
            grid,
            colours: n_cells.map(|n_cells| Colour { n_cells, ..Colour::default() }),
            boundary: Vec::new(),
            row_of,
            isolated,
        };
        let nz = grid.dims[2];
        let slabs = map_indices(nz.div_ceil(SLAB) as usize, |k| {
            let first = k as u32 * SLAB;
            let mut slab = Slab::default();
            for z in first..nz.min(first + SLAB) {
                slab.mark_plane();
                for y in 0..grid.dims[1] {
                    level.add_line(boundary, y, z, &mut slab);
                }
            }
            slab
        });
        level.join(slabs);
        level
    }

    /// Takes over the planes' stencils, in order.
    fn join(&mut self, slabs: Vec<Slab>) {
        let mut terms = [Vec::new(), Vec::new()];
        for slab in slabs {
            let parts = self.colours.iter_mut().zip(slab.colours).zip(terms.iter_mut().zip(slab.terms));
            for ((colour, part), (terms, part_terms)) in parts {
                let [runs, cut] = [colour.runs.len() as u32, colour.cut.len() as u32];
                colour.planes.extend(part.planes.iter().map(|&[r, c]| [r + runs, c + cut]));
                terms
                    .extend(part_terms.into_iter().map(|t| BoundaryTerm { cut_cell: t.cut_cell + cut, ..t }));
                colour.runs.extend(part.runs);
                colour.cut.extend(part.cut);
            }
        }
        for colour in &mut self.colours {
            colour.planes.push([colour.runs.len() as u32, colour.cut.len() as u32]);
        }
        let red_cut = self.colours[0].cut.len() as u32;
        let [red, black] = terms;
        self.boundary = red;
        let renumbered = black.into_iter().map(|t| BoundaryTerm { cut_cell: t.cut_cell + red_cut, ..t });
        self.boundary.extend(renumbered);
    }

    /// Adds the runs and cut cells of the line (y, z).
    fn add_line(&self, boundary: &impl Boundary, y: u32, z: u32, slab: &mut Slab) {
        let first_rows = [self.first_row(0) as u32, self.first_row(1) as u32];
        let mut open = [None::<Run>; 2];
        let [nx, ny, nz] = self.grid.dims;
        let steps = self.grid.strides().map(|s| [s as isize, -(s as isize)]).concat();
        let across = u8::from(y + 1 < ny) << 2
            | u8::from(y > 0) << 3
            | u8::from(z + 1 < nz) << 4
            | u8::from(z > 0) << 5;
        for x in 0..self.grid.dims[0] {
            let cell = [x, y, z];
            let index = self.grid.index(cell);
            let row = self.row_of[index];
            if row == NO_CELL {
                continue;
            }
            let colour = Grid::colour(cell);
            let own = row - first_rows[colour];
            let other_first = first_rows[1 - colour];
            let zero = self.colours[1 - colour].n_cells;
            let cut = boundary.cut_arms(cell);
            let in_grid = across | u8::from(x + 1 < nx) | u8::from(x > 0) << 1;
            let neighbours = std::array::from_fn(|d| {
                let exists = cut >> d & 1 == 0 && in_grid >> d & 1 == 1;
                let neighbour = index.wrapping_add_signed(steps[d]);
                let row = if exists { self.row_of[neighbour] } else { NO_CELL };
                if row == NO_CELL { zero } else { row - other_first }
            });
            if cut == 0 && !neighbours.contains(&zero) {
                let [px, mx, py, my, pz, mz] = neighbours;
                debug_assert_eq!(px, mx + 1, "x neighbours are consecutive within their colour");
                let run = Run { start: own, len: 1, x: mx, yz: [my, py, mz, pz] };
                let slot = &mut open[colour];
                match slot {
                    Some(r) if r.continues_with(&run) => r.len += 1,
                    _ => slab.colours[colour].runs.extend(slot.replace(run)),
                }
            } else {
                let whole = neighbours.iter().filter(|&&n| n != zero).count();
                let number = slab.colours[colour].cut.len() as u32;
                let weight = add_terms(boundary, cell, cut, number, &mut slab.terms[colour]);
                let diagonal = (whole as f64 + weight) as f32;
                slab.colours[colour].cut.push(CutCell { cell: own, neighbours, diagonal });
            }
        }
        for (colour, run) in slab.colours.iter_mut().zip(open) {
            colour.runs.extend(run);
        }
    }
}

/// Stencils of some planes, numbered from 0: what one thread makes.
#[derive(Default)]
struct Slab {
    /// `n_cells` is not known here.
    colours: [Colour; 2],
    terms: [Vec<BoundaryTerm>; 2],
}

impl Slab {
    fn mark_plane(&mut self) {
        for colour in &mut self.colours {
            colour.planes.push([colour.runs.len() as u32, colour.cut.len() as u32]);
        }
    }
}

impl Run {
    fn continues_with(&self, next: &Self) -> bool {
        let n = self.len;
        self.start + n == next.start
            && self.x + n == next.x
            && self.yz.iter().zip(next.yz).all(|(a, b)| a + n == b)
    }
}

/// Gives the unknowns their rows: red ones from 0, black ones after the red ones' zero row. A cell whose arms all lead
/// nowhere is left out. Returns (rows, cells of each colour, cells left out).
fn number_cells(boundary: &impl Boundary, grid: &Grid) -> (Vec<u32>, [u32; 2], u64) {
    let mut row_of = vec![NO_CELL; grid.n_cells()];
    let (mut n_cells, mut isolated) = ([0u32; 2], 0);
    let connected = |cell| {
        boundary.cut_arms(cell) != 0
            || (0..6).any(|d| grid.neighbour(cell, d).is_some_and(|c| boundary.is_unknown(c)))
    };
    let [nx, ny, nz] = grid.dims;
    for colour in 0..2 {
        let first = if colour == 0 { 0 } else { n_cells[0] + 1 };
        for z in 0..nz {
            for y in 0..ny {
                let line = grid.index([0, y, z]);
                for x in ((y + z + colour) % 2..nx).step_by(2) {
                    let cell = [x, y, z];
                    if !boundary.is_unknown(cell) {
                        continue;
                    }
                    if connected(cell) {
                        row_of[line + x as usize] = first + n_cells[colour as usize];
                        n_cells[colour as usize] += 1;
                    } else {
                        isolated += 1;
                    }
                }
            }
        }
    }
    (row_of, n_cells, isolated)
}

/// Adds the Dirichlet terms of a cell's cut arms, columns ascending; returns the sum of the arms' weights.
fn add_terms(
    boundary: &impl Boundary,
    cell: [u32; 3],
    cut: u8,
    cut_cell: u32,
    terms: &mut Vec<BoundaryTerm>,
) -> f64 {
    let first = terms.len();
    let mut total = 0.0;
    let mut hats: Vec<(u32, f64)> = Vec::new();
    for direction in (0..6).filter(|d| cut >> d & 1 == 1) {
        hats.clear();
        let weight = boundary.arm(cell, direction, &mut |column, value| hats.push((column, value)));
        total += weight;
        for &(column, value) in &hats {
            let value = (weight * value) as f32;
            match terms[first..].binary_search_by_key(&column, |t| t.column) {
                Ok(found) => terms[first + found].value += value,
                Err(place) => terms.insert(first + place, BoundaryTerm { cut_cell, column, value }),
            }
        }
    }
    total
}

#[cfg(test)]
pub(crate) mod plain;
#[cfg(test)]
mod tests;
