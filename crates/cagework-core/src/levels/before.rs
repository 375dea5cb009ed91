//! A level before an edit, of which most lines stay what they are.

use std::ops::Range;

use crate::grid::{Grid, NO_CELL};

use super::build::Slab;
use super::{CutCell, Level, Run};

/// Lines along x of a level, and cells, that an edit has touched.
#[derive(Clone, Debug)]
pub struct Touched {
    /// Those with cells whose arms may end elsewhere now. `[nz * ny]`
    pub moved: Vec<bool>,
    /// Those that may have other unknowns. `[nz * ny]`
    pub changed: Vec<bool>,
    /// Cells whose arms may end elsewhere now, that may be unknowns or none, or that have such neighbours.
    pub cells: CellSet,
}

/// Some cells of a grid, a bit each.
#[derive(Clone, Debug)]
pub struct CellSet(Vec<u64>);

impl CellSet {
    /// None of so many cells.
    #[must_use]
    pub fn none(n_cells: usize) -> Self {
        Self(vec![0; n_cells.div_ceil(64)])
    }

    /// Adds a cell, or does not.
    #[inline]
    pub fn add_if(&mut self, is_wanted: bool, cell: usize) {
        self.0[cell / 64] |= u64::from(is_wanted) << (cell % 64);
    }

    /// Whether a cell is one of them.
    #[inline]
    #[must_use]
    pub fn has(&self, cell: usize) -> bool {
        self.0[cell / 64] >> (cell % 64) & 1 == 1
    }
}

impl Touched {
    /// No lines of a grid.
    pub(crate) fn none(grid: &Grid) -> Self {
        let none = vec![false; (grid.dims[1] * grid.dims[2]) as usize];
        Self { moved: none.clone(), changed: none, cells: CellSet::none(grid.n_cells()) }
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.moved.len() + self.changed.len() + size_of_val(self.cells.0.as_slice())
    }
}

/// A level before an edit, and what has become of its lines along x.
#[derive(Debug)]
pub struct Before<'a> {
    pub(super) level: &'a Level,
    /// Whether there may be other unknowns in a line now. `[nz * ny]`
    changed: &'a [bool],
    /// [`Touched::cells`]
    touched: &'a CellSet,
    /// Whether a line's stencils are made anew. `[nz * ny]`
    is_anew: Vec<bool>,
}

impl<'a> Before<'a> {
    /// A level, and what the edit has touched of it.
    #[must_use]
    pub fn new(level: &'a Level, touched: &'a Touched) -> Self {
        let Touched { moved, changed, cells: touched } = touched;
        let ny = level.grid.dims[1] as usize;
        debug_assert_eq!(changed.len() + 1, level.lines.len(), "an edit leaves the grid");
        let mut is_anew = moved.clone();
        for line in (0..changed.len()).filter(|&line| changed[line]) {
            // Whoever has neighbours in it.
            for other in
                [Some(line), Some(line + 1), line.checked_sub(1), Some(line + ny), line.checked_sub(ny)]
            {
                if let Some(is_anew) = other.and_then(|other| is_anew.get_mut(other)) {
                    *is_anew = true;
                }
            }
        }
        Self { level, changed, touched, is_anew }
    }

    /// The level as it was.
    pub(crate) fn level(&self) -> &Level {
        self.level
    }

    /// Whether a line's stencils are what they were, but for their rows.
    pub(super) fn is_kept(&self, line: usize) -> bool {
        !self.is_anew[line]
    }

    /// Whether a line's unknowns are those that they were.
    pub(crate) fn has_same_cells(&self, line: usize) -> bool {
        !self.changed[line]
    }

    /// What the numbers of a line's cells grew by, within each colour.
    pub(crate) fn shift(&self, now: &Level, line: usize) -> [u32; 2] {
        [0, 1].map(|c| now.lines[line][c].wrapping_sub(self.level.lines[line][c]))
    }

    /// Cells of a line of each colour.
    pub(super) fn n_cells(&self, line: usize) -> [u32; 2] {
        [0, 1].map(|c| self.level.lines[line + 1][c] - self.level.lines[line][c])
    }

    /// The rows as they were.
    pub(super) fn row_of(&self) -> Vec<u32> {
        self.level.row_of.to_vec()
    }

    /// What is to be added to the rows of a line, whose first ones of each colour are `first` now.
    pub(super) fn rows_grew_by(&self, line: usize, first: [u32; 2]) -> [u32; 2] {
        let was = self.level.lines[line];
        [0, 1].map(|c| first[c].wrapping_sub(was[c] + self.level.first_row(c) as u32))
    }

    /// [`Self::shift`] of all lines, `[nz * ny]`.
    pub(super) fn shifts(&self, now: &Level) -> Vec<[u32; 2]> {
        (0..self.changed.len()).map(|line| self.shift(now, line)).collect()
    }

    /// A slab with room for somewhat more than there was in some planes.
    pub(super) fn slab_like(&self, planes: Range<u32>) -> Slab {
        let mut slab = Slab::default();
        for (c, colour) in self.level.colours.iter().enumerate() {
            let [first, end] = [planes.start, planes.end].map(|z| colour.planes[z as usize]);
            let [runs, cut] = [0, 1].map(|k| (end[k] - first[k]) as usize * 9 / 8 + 64);
            slab.colours[c].runs.reserve(runs);
            slab.colours[c].cut.reserve(cut);
            slab.from[c].reserve(cut);
        }
        slab
    }

    /// End of the kept lines from (y, z) on in its plane whose rows and neighbours have moved by the same.
    pub(super) fn end_of_stretch(&self, shifts: &[[u32; 2]], y: u32, z: u32) -> u32 {
        let ny = self.level.grid.dims[1];
        let first = (z * ny + y) as usize;
        let around = self.shifts_around(shifts, first);
        let is_like_first = |line: usize| self.is_kept(line) && self.shifts_around(shifts, line) == around;
        let n = (1..(ny - y) as usize).take_while(|k| is_like_first(first + k)).count();
        y + 1 + n as u32
    }

    /// Shifts of a line and of those before and after it along y and z. A line that does not exist has nobody's neighbours.
    fn shifts_around(&self, shifts: &[[u32; 2]], line: usize) -> [[u32; 2]; 5] {
        let ny = self.level.grid.dims[1] as usize;
        [line, line.wrapping_sub(1), line + 1, line.wrapping_sub(ny), line + ny]
            .map(|line| shifts.get(line).copied().unwrap_or_default())
    }

    /// Number among all cut cells, and the cut cell, of a cell that the edit has not touched, if it has been one. `next`: of each
    /// colour's cut cells one that is not behind it, moved on; lines begin with [`Self::first_cut`].
    pub(super) fn untouched(&self, index: usize, colour: usize, next: &mut usize) -> Option<(u32, &CutCell)> {
        let row = self.level.row_of[index];
        if self.touched.has(index) || row == NO_CELL {
            return None;
        }
        let cell = row - self.level.first_row(colour) as u32;
        let cut = &self.level.colours[colour].cut;
        *next += cut[*next..].iter().take_while(|cut| cut.cell < cell).count();
        let found = cut.get(*next).filter(|cut| cut.cell == cell)?;
        let before = if colour == 0 { 0 } else { self.level.colours[0].cut.len() };
        Some(((before + *next) as u32, found))
    }

    /// Where each colour's cut cells of a line began.
    pub(super) fn first_cut(&self, line: usize) -> [usize; 2] {
        let z = line / self.level.grid.dims[1] as usize;
        [0, 1].map(|c| {
            let colour = &self.level.colours[c];
            let [first, end] = [z, z + 1].map(|z| colour.planes[z][1] as usize);
            let start = self.level.lines[line][c];
            first + colour.cut[first..end].partition_point(|cut| cut.cell < start)
        })
    }

    /// Copies the runs and cut cells of the lines `ys` of a plane, a stretch, to where their rows are `now`.
    pub(super) fn copy_lines(
        &self,
        now: &Level,
        shifts: &[[u32; 2]],
        z: u32,
        ys: Range<u32>,
        slab: &mut Slab,
    ) {
        let (ny, z) = (self.level.grid.dims[1] as usize, z as usize);
        let [line, end] = [ys.start, ys.end].map(|y| z * ny + y as usize);
        let (start, end) = (self.level.lines[line], self.level.lines[end]);
        if start == end {
            return;
        }
        let around = self.shifts_around(shifts, line);
        for c in 0..2 {
            let own = around[0][c];
            let [x, y_low, y_high, z_low, z_high] = around.map(|shift| shift[1 - c]);
            let yz = [y_low, y_high, z_low, z_high];
            let (colour, out) = (&self.level.colours[c], &mut slab.colours[c]);
            let ([run, cut], [run_end, cut_end]) = (colour.planes[z], colour.planes[z + 1]);
            let runs = &colour.runs[run as usize..run_end as usize];
            let first = runs.partition_point(|run| run.start < start[c]);
            for run in runs[first..].iter().take_while(|run| run.start < end[c]) {
                out.runs.push(Run {
                    start: run.start.wrapping_add(own),
                    len: run.len,
                    x: run.x.wrapping_add(x),
                    yz: std::array::from_fn(|d| run.yz[d].wrapping_add(yz[d])),
                });
            }
            let by = [x, x, yz[1], yz[0], yz[3], yz[2]];
            let [zero, zero_now] = [self.level, now].map(|level| level.colours[1 - c].n_cells);
            let cells = &colour.cut[cut as usize..cut_end as usize];
            let first = cells.partition_point(|cut| cut.cell < start[c]);
            let red_cut = if c == 0 { 0 } else { self.level.colours[0].cut.len() as u32 };
            for (number, cell) in (red_cut + cut + first as u32..).zip(&cells[first..]) {
                if cell.cell >= end[c] {
                    break;
                }
                let neighbours = std::array::from_fn(|d| {
                    let n = cell.neighbours[d];
                    if n == zero { zero_now } else { n.wrapping_add(by[d]) }
                });
                out.cut.push(CutCell { cell: cell.cell.wrapping_add(own), neighbours, ..*cell });
                slab.from[c].push(number);
            }
        }
    }
}

#[cfg(test)]
mod tests;
