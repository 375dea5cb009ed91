//! Tables before an edit, of which most lines stay what they are but for the rows' numbers.

use crate::levels::{Before, Level};

use super::{AROUND, CORNERS, ProlongRow, Transfer};

/// Tables before an edit and both levels, fine and coarse, before and now.
pub(super) struct Old<'a> {
    pub(super) tables: &'a Transfer,
    pub(super) before: [&'a Before<'a>; 2],
    pub(super) levels: [&'a Level; 2],
}

/// How the rows of some lines have moved: those of red cells and of black ones of each, and the row that stays zero and where that
/// is now, the same for all.
struct Moved<const N: usize> {
    red: [u32; N],
    black: [u32; N],
    zero: u32,
    zero_now: u32,
}

impl<const N: usize> Moved<N> {
    /// Rows, one in each of the lines.
    #[inline(always)]
    fn rows(&self, rows: &[u32; N]) -> [u32; N] {
        std::array::from_fn(|k| {
            let row = rows[k];
            // Without branches, so that several are taken at once.
            let moved = row.wrapping_add(if row > self.zero { self.black[k] } else { self.red[k] });
            if row == self.zero { self.zero_now } else { moved }
        })
    }
}

impl Old<'_> {
    /// A line of a level (0 fine, 1 coarse) if it is in the grid.
    fn line(&self, level: usize, y: i64, z: i64) -> Option<usize> {
        let [_, ny, nz] = self.levels[level].grid.dims.map(i64::from);
        ((0..ny).contains(&y) && (0..nz).contains(&z)).then_some((z * ny + y) as usize)
    }

    /// Whether a level has the same unknowns as before in all lines that there are of these.
    fn are_same(&self, level: usize, mut lines: impl Iterator<Item = (i64, i64)>) -> bool {
        lines.all(|(y, z)| self.line(level, y, z).is_none_or(|line| self.before[level].has_same_cells(line)))
    }

    /// How lines' rows have moved; of a line that is not in the grid nobody knows a row but zero.
    fn moved<const N: usize>(&self, level: usize, line: impl Fn(usize) -> (i64, i64)) -> Moved<N> {
        let (now, before) = (self.levels[level], self.before[level]);
        let [zero, zero_now] = [before.level().zero_row(), now.zero_row()];
        let mut moved = Moved { red: [0; N], black: [0; N], zero, zero_now };
        for k in 0..N {
            let (y, z) = line(k);
            let [red, black] = self.line(level, y, z).map_or([0; 2], |line| before.shift(now, line));
            // Black rows begin after the red ones.
            (moved.red[k], moved.black[k]) = (red, black.wrapping_add(zero_now).wrapping_sub(zero));
        }
        moved
    }

    /// Whether what a fine line is prolonged from has stayed.
    pub(super) fn can_prolong(&self, y: u32, z: u32) -> bool {
        let [y, z] = [y, z].map(i64::from);
        let coarse = [(0, 0), (y % 2, 0), (0, z % 2), (y % 2, z % 2)];
        self.are_same(0, [(y, z)].into_iter())
            && self.are_same(1, coarse.into_iter().map(|(dy, dz)| (y / 2 + dy, z / 2 + dz)))
    }

    /// Copies a fine line's black cells. `next`: where the lines before it in its plane ended in both tables, or began.
    pub(super) fn prolong_line(&self, y: u32, z: u32, next: &mut [u32; 2], tables: &mut Transfer) {
        let ny = self.levels[0].grid.dims[1];
        let (line, level) = ((z * ny + y) as usize, self.before[0].level());
        let cells = level.lines[line][1]..level.lines[line + 1][1];
        if cells.is_empty() {
            return;
        }
        let by = self.before[0].shift(self.levels[0], line)[1];
        let low = [y / 2, z / 2].map(i64::from);
        let [face_end, corner_end] = self.tables.planes[z as usize + 1];
        // Black cells of a line are all of one kind.
        if y % 2 == 1 && z % 2 == 1 {
            let moved = self.moved(1, |k| {
                let [_, dy, dz] = CORNERS[k].map(i64::from);
                (low[0] + dy, low[1] + dz)
            });
            let rows = &self.tables.corners[..corner_end as usize];
            copy(rows, cells, by, &moved, &mut next[1], &mut tables.corners);
        } else {
            let high = (low[0] + i64::from(y % 2), low[1] + i64::from(z % 2));
            let moved = self.moved(1, |k| if k == 0 { (low[0], low[1]) } else { high });
            let rows = &self.tables.faces[..face_end as usize];
            copy(rows, cells, by, &moved, &mut next[0], &mut tables.faces);
        }
    }

    /// Whether what a coarse line gathers has stayed.
    pub(super) fn can_restrict(&self, y: u32, z: u32) -> bool {
        let [y, z] = [y, z].map(i64::from);
        let fine = (0..9).map(|k| (2 * y + k % 3 - 1, 2 * z + k / 3 - 1));
        self.are_same(1, [(y, z)].into_iter()) && self.are_same(0, fine)
    }

    /// Copies a coarse line's cells.
    pub(super) fn restrict_line(&self, y: u32, z: u32, tables: &mut Transfer) {
        let level = self.before[1].level();
        let line = (z * level.grid.dims[1] + y) as usize;
        let (start, end) = (level.lines[line], level.lines[line + 1]);
        if start == end {
            return;
        }
        let (y, z) = (2 * i64::from(y), 2 * i64::from(z));
        let moved = self.moved(0, |k| {
            let [_, dy, dz] = AROUND[k].map(i64::from);
            (y + dy, z + dz)
        });
        for colour in 0..2 {
            let rows = &self.tables.restrict_rows[colour][start[colour] as usize..end[colour] as usize];
            tables.restrict_rows[colour].extend(rows.iter().map(|rows| moved.rows(rows)));
        }
    }
}

/// Copies what there is in `rows`, ascending, of some cells; `next`: from where on they may be, and where they end then.
fn copy<const N: usize>(
    rows: &[ProlongRow<N>],
    cells: std::ops::Range<u32>,
    by: u32,
    moved: &Moved<N>,
    next: &mut u32,
    out: &mut Vec<ProlongRow<N>>,
) {
    let n_until =
        |first: u32, end: u32| rows[first as usize..].iter().take_while(|row| row.cell < end).count();
    let first = *next + n_until(*next, cells.start) as u32;
    *next = first + n_until(first, cells.end) as u32;
    out.extend(rows[first as usize..*next as usize].iter().map(|row| ProlongRow {
        cell: row.cell.wrapping_add(by),
        coarse: moved.rows(&row.coarse),
        mean: row.mean,
    }));
}
