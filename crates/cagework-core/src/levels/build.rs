//! Builds a level: numbers the rows, then builds stencils line by line.

use crate::grid::{Grid, NO_CELL};
use crate::team::map_indices;

use super::{Boundary, BoundaryTerm, Colour, CutCell, Level, Run};

/// Number of z-planes per task. It is small because the expensive cells next to the cage are unevenly distributed.
const SLAB: u32 = 8;

impl Level {
    /// Builds the stencils of all unknowns.
    #[must_use]
    pub fn new(boundary: &dyn Boundary) -> Self {
        let mut level = number_cells(boundary);
        let [_, ny, nz] = level.grid.dims;
        let slabs = map_indices(nz.div_ceil(SLAB) as usize, |k| {
            let first = k as u32 * SLAB;
            let mut slab = Slab::default();
            for z in first..nz.min(first + SLAB) {
                slab.mark_plane();
                for y in 0..ny {
                    level.add_line(boundary, [y, z], &mut slab);
                }
            }
            slab
        });
        level.join(slabs);
        level
    }

    fn join(&mut self, slabs: Vec<Slab>) {
        let mut terms = [Vec::new(), Vec::new()];
        for (k, colour) in self.colours.iter_mut().enumerate() {
            colour.runs.reserve(slabs.iter().map(|slab| slab.colours[k].runs.len()).sum());
            colour.cut.reserve(slabs.iter().map(|slab| slab.colours[k].cut.len()).sum());
        }
        for slab in slabs {
            for ((colour, terms), (part, part_terms)) in
                self.colours.iter_mut().zip(&mut terms).zip(slab.colours.into_iter().zip(slab.terms))
            {
                let [runs, cut] = [colour.runs.len() as u32, colour.cut.len() as u32];
                colour.planes.extend(part.planes.iter().map(|&[r, c]| [r + runs, c + cut]));
                colour.runs.extend(part.runs);
                colour.cut.extend(part.cut);
                terms
                    .extend(part_terms.into_iter().map(|t| BoundaryTerm { cut_cell: t.cut_cell + cut, ..t }));
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

    /// Appends the runs and cut cells of the line (y, z).
    fn add_line(&self, boundary: &dyn Boundary, [y, z]: [u32; 2], slab: &mut Slab) {
        let [nx, ny, nz] = self.grid.dims;
        let line = self.grid.index([0, y, z]);
        let rows = &self.row_of[line..][..nx as usize];
        let arms = &boundary.cut_arms()[line..][..nx as usize];
        let first_rows = [self.first_row(0) as u32, self.first_row(1) as u32];
        let mut open = [None::<Run>; 2];
        let steps = self.grid.strides().map(|s| [s as isize, -(s as isize)]).concat();
        let across = u8::from(y + 1 < ny) << 2
            | u8::from(y > 0) << 3
            | u8::from(z + 1 < nz) << 4
            | u8::from(z > 0) << 5;
        for ((x, &row), &cut) in (0..nx).zip(rows).zip(arms) {
            if row == NO_CELL {
                continue;
            }
            let cell = [x, y, z];
            let index = line + x as usize;
            let colour = Grid::colour(cell);
            let own = row - first_rows[colour];
            let other_first = first_rows[1 - colour];
            let zero = self.colours[1 - colour].n_cells;
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

/// Stencils of `SLAB` planes, built by one thread. Cut cells are numbered from 0 in each slab.
#[derive(Default)]
struct Slab {
    /// Runs, cut cells and planes of both colours; `n_cells` is not set.
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

/// Assigns rows to the unknowns: red from 0, black after the red zero row. Omits cells without any arm. The level has
/// no stencils yet.
fn number_cells(boundary: &dyn Boundary) -> Level {
    let grid = boundary.grid();
    let [nx, ny, _] = grid.dims;
    let (unknowns, cut) = (boundary.unknowns(), boundary.cut_arms());
    let mut row_of = vec![NO_CELL; grid.n_cells()];
    let (mut n_cells, mut isolated) = ([0u32; 2], 0);
    let is_connected = |cell: [u32; 3], index: usize| {
        cut[index] != 0 || (0..6).any(|d| grid.neighbour(cell, d).is_some_and(|c| unknowns[grid.index(c)]))
    };
    for (line, rows) in row_of.chunks_exact_mut(nx as usize).enumerate() {
        let (y, z) = (line as u32 % ny, line as u32 / ny);
        let first = line * nx as usize;
        let unknowns = &unknowns[first..][..nx as usize];
        for (x, row) in (0..nx).zip(rows) {
            let (cell, x) = ([x, y, z], x as usize);
            if !unknowns[x] {
                continue;
            }
            // Fast path: most cells have an unknown next to them.
            if unknowns.get(x + 1) == Some(&true) || is_connected(cell, first + x) {
                let n = &mut n_cells[Grid::colour(cell)];
                *row = *n;
                *n += 1;
            } else {
                isolated += 1;
            }
        }
    }
    // Black cells were numbered from 0: add their offset.
    let first_black = n_cells[0] + 1;
    for (line, rows) in row_of.chunks_exact_mut(nx as usize).enumerate() {
        let black = 1 - (line as u32 % ny + line as u32 / ny) as usize % 2;
        for row in rows.iter_mut().skip(black).step_by(2).filter(|row| **row != NO_CELL) {
            *row += first_black;
        }
    }
    let colours = n_cells.map(|n_cells| Colour { n_cells, ..Colour::default() });
    Level { grid, colours, boundary: Vec::new(), row_of, isolated }
}

/// Adds the Dirichlet terms of a cell's cut arms, columns ascending. Returns the sum of the arms' weights.
fn add_terms(
    boundary: &dyn Boundary,
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
