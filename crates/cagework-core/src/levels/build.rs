//! Builds a level: rows first, then the stencils line by line.

use std::sync::Arc;

use crate::grid::{Grid, NO_CELL};
use crate::voxelize::map_indices;

use super::{Before, Boundary, BoundaryTerm, Colour, CutCell, Level, Run};

/// Planes that a thread takes at a time: cells next to the cage, which cost most, are not spread evenly.
const SLAB: u32 = 8;

impl Level {
    /// Builds the stencils of all unknowns.
    #[must_use]
    pub fn new(boundary: &dyn Boundary) -> Self {
        build(boundary, None).0
    }

    /// Builds it from what it was before an edit. [`Level::boundary`] has only the terms of lines that are made anew; the second
    /// is the new number of each old cut cell whose terms are what they were, [`NO_CELL`] for the others.
    #[must_use]
    pub fn renewed(boundary: &dyn Boundary, before: &Before<'_>) -> (Self, Vec<u32>) {
        build(boundary, Some(before))
    }

    /// Takes over the planes' stencils, in order. Returns, if there was a level before, the new number of each of its cut cells.
    fn join(&mut self, slabs: Vec<Slab>, before: Option<&Before<'_>>) -> Vec<u32> {
        let mut terms = [Vec::new(), Vec::new()];
        let mut from = [Vec::new(), Vec::new()];
        for (k, colour) in self.colours.iter_mut().enumerate() {
            colour.runs.reserve(slabs.iter().map(|slab| slab.colours[k].runs.len()).sum());
            colour.cut.reserve(slabs.iter().map(|slab| slab.colours[k].cut.len()).sum());
        }
        for slab in slabs {
            for (k, part) in slab.colours.into_iter().enumerate() {
                let colour = &mut self.colours[k];
                let [runs, cut] = [colour.runs.len() as u32, colour.cut.len() as u32];
                colour.planes.extend(part.planes.iter().map(|&[r, c]| [r + runs, c + cut]));
                colour.runs.extend(part.runs);
                colour.cut.extend(part.cut);
                let shifted = slab.terms[k].iter().map(|t| BoundaryTerm { cut_cell: t.cut_cell + cut, ..*t });
                terms[k].extend(shifted);
                from[k].extend_from_slice(&slab.from[k]);
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

        let mut moved_to = vec![NO_CELL; before.map_or(0, |before| before.level.n_cut())];
        for (first, from) in [0, red_cut].into_iter().zip(from) {
            for (new, old) in (first..).zip(from).filter(|&(_, old)| old != NO_CELL) {
                moved_to[old as usize] = new;
            }
        }
        moved_to
    }

    /// Adds the runs and cut cells of the line (y, z).
    fn add_line(
        &self,
        boundary: &dyn Boundary,
        before: Option<&Before<'_>>,
        [y, z]: [u32; 2],
        slab: &mut Slab,
    ) {
        let [nx, ny, nz] = self.grid.dims;
        let line = self.grid.index([0, y, z]);
        let mut next_cut = before.map_or([0; 2], |before| before.first_cut((z * ny + y) as usize));
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
                let untouched = before.and_then(|b| b.untouched(index, colour, &mut next_cut[colour]));
                if let Some((number, was)) = untouched {
                    // Its terms are what they were.
                    slab.from[colour].resize(slab.colours[colour].cut.len(), NO_CELL);
                    slab.from[colour].push(number);
                    slab.colours[colour].cut.push(CutCell { cell: own, neighbours, ..*was });
                    continue;
                }
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

/// The level, and the new number of each cut cell of the level before, if there is one.
fn build(boundary: &dyn Boundary, before: Option<&Before<'_>>) -> (Level, Vec<u32>) {
    let mut level = number_cells(boundary, before);
    let [_, ny, nz] = level.grid.dims;
    let shifts = before.map_or_else(Vec::new, |before| before.shifts(&level));
    let slabs = map_indices(nz.div_ceil(SLAB) as usize, |k| {
        let first = k as u32 * SLAB;
        let mut slab =
            before.map_or_else(Slab::default, |before| before.slab_like(first..nz.min(first + SLAB)));
        for z in first..nz.min(first + SLAB) {
            slab.mark_plane();
            let mut y = 0;
            while y < ny {
                let mut next = y + 1;
                match before {
                    Some(before) if before.is_kept((z * ny + y) as usize) => {
                        next = before.end_of_stretch(&shifts, y, z);
                        before.copy_lines(&level, &shifts, z, y..next, &mut slab);
                    }
                    _ => level.add_line(boundary, before, [y, z], &mut slab),
                }
                y = next;
                if before.is_some() {
                    for (from, colour) in slab.from.iter_mut().zip(&slab.colours) {
                        from.resize(colour.cut.len(), NO_CELL);
                    }
                }
            }
        }
        slab
    });
    let moved_to = level.join(slabs, before);
    (level, moved_to)
}

/// Stencils of some planes, numbered from 0: what one thread makes.
#[derive(Default)]
pub(super) struct Slab {
    /// `n_cells` is not known here.
    pub(super) colours: [Colour; 2],
    terms: [Vec<BoundaryTerm>; 2],
    /// For each cut cell its number in the level before, if there is one; [`NO_CELL`] where it is made anew.
    pub(super) from: [Vec<u32>; 2],
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
/// nowhere is left out. Stencils are still missing.
fn number_cells(boundary: &dyn Boundary, before: Option<&Before<'_>>) -> Level {
    let grid = boundary.grid();
    let [nx, ny, nz] = grid.dims;
    let (unknowns, cut) = (boundary.unknowns(), boundary.cut_arms());
    let mut row_of = before.map_or_else(|| vec![NO_CELL; grid.n_cells()], Before::row_of);
    let mut lines = Vec::with_capacity((ny * nz) as usize + 1);
    let (mut n_cells, mut isolated) = ([0u32; 2], 0);
    let is_connected = |cell: [u32; 3], index: usize| {
        cut[index] != 0 || (0..6).any(|d| grid.neighbour(cell, d).is_some_and(|c| unknowns[grid.index(c)]))
    };
    for (line, rows) in row_of.chunks_exact_mut(nx as usize).enumerate() {
        lines.push(n_cells);
        if let Some(before) = before.filter(|before| before.is_kept(line)) {
            let kept = before.n_cells(line);
            n_cells = [0, 1].map(|c| n_cells[c] + kept[c]);
            continue;
        }
        let (y, z) = (line as u32 % ny, line as u32 / ny);
        let first = line * nx as usize;
        let unknowns = &unknowns[first..][..nx as usize];
        rows.fill(NO_CELL);
        for (x, row) in (0..nx).zip(rows) {
            let (cell, x) = ([x, y, z], x as usize);
            if !unknowns[x] {
                continue;
            }
            // Most have one beside them.
            if unknowns.get(x + 1) == Some(&true) || is_connected(cell, first + x) {
                let n = &mut n_cells[Grid::colour(cell)];
                *row = *n;
                *n += 1;
            } else {
                isolated += 1;
            }
        }
    }
    lines.push(n_cells);
    let first_rows = [0, n_cells[0] + 1];
    for (line, rows) in row_of.chunks_exact_mut(nx as usize).enumerate() {
        if lines[line] == lines[line + 1] {
            continue;
        }
        let first = [0, 1].map(|c| first_rows[c] + lines[line][c]);
        let mut by = first_rows;
        if let Some(before) = before.filter(|before| before.is_kept(line)) {
            by = before.rows_grew_by(line, first);
        }
        let red = (line as u32 % ny + line as u32 / ny) as usize % 2;
        add_to_rows(rows, [by[red], by[1 - red]]);
    }
    let colours = n_cells.map(|n_cells| Colour { n_cells, ..Colour::default() });
    Level { grid, colours, boundary: Vec::new(), row_of: Arc::new(row_of), lines, isolated }
}

/// Adds to a line's rows what is to be added in even places and in odd ones.
fn add_to_rows(rows: &mut [u32], [even, odd]: [u32; 2]) {
    for (x, row) in rows.iter_mut().enumerate() {
        let n = if x % 2 == 0 { even } else { odd };
        *row = if *row == NO_CELL { NO_CELL } else { row.wrapping_add(n) };
    }
}

/// Adds the Dirichlet terms of a cell's cut arms, columns ascending; returns the sum of the arms' weights.
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
