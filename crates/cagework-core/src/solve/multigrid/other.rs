//! Right-hand sides other than the cage's.

use std::ops::Range;
use std::sync::Arc;

use super::stream::{AROUND, DOWN_FROM_ZERO, Extent, FROM_ZERO, Pass, stream};
use super::{BatchReport, Stop, Workspace};
use crate::grid::NO_CELL;
use crate::levels::Level;
use crate::solve::hierarchy::Hierarchy;
use crate::solve::rows::{Rhs, Row, ZERO};

/// What a right-hand side of a whole red cell adds to the cell, and to the six neighbours' right-hand sides.
const SIXTH: f32 = 1.0 / 6.0;

/// A solve that is expected to leave more than so much of what it may leave in a cell ends with sweeps around the right-hand
/// sides, where that cell is. They replace a cycle at a tenth to a quarter of its cost, which is why a cell may be left with more
/// (edits of cages of 80 and 200 vertices: 963 cycles instead of 1,034, weights as exact).
const WELL: f64 = 0.45;

/// Where right-hand sides of some cells go.
///
/// Cells next to the cage have a row for theirs, as the cage's values ask for, and whole black cells get one. Whole red ones
/// need none: what is added to them by their own right-hand side is known, and the cells around them, which are black, get
/// what that adds to theirs. So whole cells need not be asked for a right-hand side one after the other.
#[derive(Debug, Default)]
pub struct Places {
    /// Number of a cell, row of the right-hand side, and how much of the cell's goes there.
    shares: Vec<(u32, u32, f32)>,
    /// Whole red cells: their numbers, and their rows in fields.
    red: Vec<[u32; 2]>,
    /// Whole black cells, within their colour, ascending.
    whole: Vec<u32>,
    /// See [`Extent::reach`].
    reach: Vec<Vec<Range<usize>>>,
}

impl Places {
    /// Of cells, by their index in the grid.
    ///
    /// # Panics
    /// If one of them is no unknown of the level.
    #[must_use]
    pub fn new(level: &Level, cells: &[u32]) -> Self {
        let mut place = vec![NO_CELL; level.n_rows()];
        for number in 0..level.n_cut() {
            place[level.row_of_cut(number)] = number as u32;
        }
        let (first_black, strides) = (level.first_row(1), level.grid.strides());
        let (mut shares, mut red, mut whole) = (Vec::new(), Vec::new(), Vec::new());
        let [_, ny, nz] = level.grid.dims.map(|n| n as usize);
        let mut lines = vec![0..0; nz];
        let mut add = |number: u32, cell: usize, share: f32| {
            let row = level.row_of[cell];
            let (y, z) = (cell % strides[2] / strides[1], cell / strides[2]);
            lines[z] = hull(&lines[z], &(y..y + 1));
            if place[row as usize] == NO_CELL {
                // Whole and black.
                whole.push(row - first_black as u32);
            }
            shares.push((number, row, share));
        };
        for (number, &cell) in (0u32..).zip(cells) {
            let (cell, row) = (cell as usize, level.row_of[cell as usize]);
            if (row as usize) < first_black && place[row as usize] == NO_CELL {
                red.push([number, row]);
                for stride in strides {
                    add(number, cell - stride, SIXTH);
                    add(number, cell + stride, SIXTH);
                }
            } else {
                add(number, cell, 1.0);
            }
        }
        whole.sort_unstable();
        whole.dedup();
        for (place_of_whole, &cell) in (level.n_cut() as u32..).zip(&whole) {
            place[first_black + cell as usize] = place_of_whole;
        }
        for (_, row, _) in &mut shares {
            *row = place[*row as usize];
        }
        let mut reach = vec![lines];
        while reach.len() < DOWN_FROM_ZERO.len() {
            let before = &reach[reach.len() - 1];
            // A pass carries what there is no more than a cell further.
            let further = |z: usize| {
                let Range { start, end } = before[z];
                let own = if start < end { start.saturating_sub(1)..ny.min(end + 1) } else { 0..0 };
                let beside = [z.checked_sub(1), Some(z + 1)].into_iter().flatten();
                beside.filter_map(|z| before.get(z)).fold(own, |own, other| hull(&own, other))
            };
            let further = (0..nz).map(further).collect();
            reach.push(further);
        }
        Self { shares, red, whole, reach }
    }

    /// Where level k's right-hand side is, for some passes.
    pub(super) fn extent(&self, k: usize, passes: &[Pass]) -> Extent<'_> {
        if k > 0 {
            return Extent::default();
        }
        let has_reach = passes == DOWN_FROM_ZERO && !self.reach.is_empty();
        Extent { reach: has_reach.then_some(&self.reach), whole: &self.whole }
    }
}

/// The range of both; empty ones have nothing.
fn hull(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    match (a.is_empty(), b.is_empty()) {
        (true, _) => b.clone(),
        (_, true) => a.clone(),
        _ => a.start.min(b.start)..a.end.max(b.end),
    }
}

impl Workspace {
    /// Solves for right-hand sides that are not the cage's: the `values` of the cells that there are `places` for; all others
    /// are zero. From zero, in a new field; `cycle_done` as in [`Self::solve`].
    ///
    /// # Errors
    /// `None` when cancelled.
    ///
    /// # Panics
    /// If there are fewer values than cells.
    pub fn solve_for(
        &mut self,
        hierarchy: &Hierarchy,
        (places, values): (&Arc<Places>, &[Row]),
        stop: Stop,
        cycle_done: &mut dyn FnMut(u32, f64) -> bool,
    ) -> Option<BatchReport> {
        let level = &hierarchy.levels[0];
        // Zeros: first passes write only where right-hand sides reach.
        self.u[0] = vec![ZERO; level.n_rows()];
        self.f[0].clear();
        self.f[0].resize(level.n_cut() + places.whole.len(), ZERO);
        for &(number, place, share) in &places.shares {
            let out = &mut self.f[0][place as usize];
            for (out, value) in out.iter_mut().zip(&values[number as usize]) {
                *out += share * value;
            }
        }
        self.places = Arc::clone(places);
        let report = self.cycles(hierarchy, (DOWN_FROM_ZERO, &FROM_ZERO), stop, cycle_done);
        if let (Some(report), Some(transfer)) = (&report, hierarchy.transfers.first()) {
            let n_passes = match () {
                () if report.largest > WELL * stop.in_any_cell => AROUND.len(),
                () if report.leaves_little(&stop) => AROUND.len() / 2,
                () => 0,
            };
            if n_passes > 0 {
                let extent = Extent { reach: Some(&places.reach[..n_passes]), whole: &places.whole };
                let f = Rhs::Cut(&self.f[0]);
                stream(&AROUND[..n_passes], level, extent, (transfer, &[]), &mut self.u[0], f, &mut []);
            }
        }
        self.places = Arc::default();
        for &[number, row] in &places.red {
            for (out, value) in self.u[0][row as usize].iter_mut().zip(&values[number as usize]) {
                *out += SIXTH * value;
            }
        }
        report
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::levels::plain::{hierarchy, some_field};
    use crate::solve::rows::{Rhs, relax_plane};

    /// f32 rounding of values up to some hundreds, solved for until nothing changes.
    const ROUNDED: f32 = 1e-4;

    fn stop(max_cycles: u32) -> Stop {
        Stop::new(1e-5, max_cycles)
    }

    /// Every `step`-th cell from `first` on, by colour, and some values of each.
    fn some_cells(hierarchy: &Hierarchy, first: usize, step: usize) -> (Vec<u32>, Vec<Row>) {
        let level = &hierarchy.levels[0];
        let values = some_field(level, 1);
        let cells = (0u32..).zip(level.row_of.iter()).filter(|(_, row)| **row != NO_CELL);
        let some = cells.skip(first).step_by(step);
        some.map(|(cell, row)| (cell, values[*row as usize])).unzip()
    }

    /// Sweeps that know each cell's right-hand side leave the solution as it is: red cells and black ones, whole ones and cut
    /// ones; so they do where there is one level only.
    #[test]
    fn the_solution_meets_every_cells_equation() {
        let hierarchy = hierarchy();
        let single = Hierarchy::single(hierarchy.levels[0].clone(), hierarchy.n_columns);
        for (hierarchy, n_cycles) in [(hierarchy, 12), (single, 200)] {
            assert_is_solved(&hierarchy, n_cycles);
        }
    }

    fn assert_is_solved(hierarchy: &Hierarchy, n_cycles: u32) {
        let level = &hierarchy.levels[0];
        let (cells, values) = some_cells(hierarchy, 5, 11);
        let places = Arc::new(Places::new(level, &cells));
        let n_cut = level.n_cut() as u32;
        assert!(!places.red.is_empty() && !places.whole.is_empty());
        assert!(places.shares.iter().any(|&(_, place, share)| place < n_cut && share == 1.0));
        let mut workspace = Workspace::new(hierarchy);
        let exactly = Stop::new(0.0, n_cycles);
        workspace.solve_for(hierarchy, (&places, &values), exactly, &mut |_, _| true).unwrap();
        let mut f = vec![ZERO; level.n_rows()];
        for (cell, values) in cells.iter().zip(&values) {
            f[level.row_of[*cell as usize] as usize] = *values;
        }
        let u = workspace.field();
        assert!(u.iter().flatten().any(|w| w.abs() > 0.1));
        for colour in 0..2 {
            let mut swept = u.to_vec();
            for plane in 0..level.grid.dims[2] as usize {
                relax_plane(level, colour, plane, &mut swept, Rhs::Dense(&f));
            }
            let change =
                |(a, b): (&Row, &Row)| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            let change = u.iter().zip(&swept).map(change).fold(0.0, f32::max);
            assert!(change < ROUNDED, "colour {colour}: {change}");
        }
        // By the mean one cycle would do.
        let by_cells = Stop { in_any_cell: 1e-3, ..Stop::new(f64::INFINITY, n_cycles) };
        let report = workspace.solve_for(hierarchy, (&places, &values), by_cells, &mut |_, _| true).unwrap();
        assert!(report.converged && report.delta_squares.len() > 1);
    }

    /// Where a cell is left with more than it may, sweeps follow around the right-hand sides.
    #[test]
    fn sweeps_around_right_hand_sides_make_up_for_a_cycle() {
        let hierarchy = hierarchy();
        let (cells, values) = some_cells(&hierarchy, 60, usize::MAX);
        let places = Arc::new(Places::new(&hierarchy.levels[0], &cells));
        let solved = |n_cycles: u32, in_any_cell: f64| {
            let mut workspace = Workspace::new(&hierarchy);
            let stop = Stop { in_any_cell, ..Stop::new(0.0, n_cycles) };
            workspace.solve_for(&hierarchy, (&places, &values), stop, &mut |_, _| true).unwrap();
            workspace.take_field()
        };
        let exact = solved(12, f64::INFINITY);
        let error = |u: Vec<Row>| {
            let apart = u.iter().flatten().zip(exact.iter().flatten()).map(|(a, b)| (a - b).abs());
            apart.fold(0.0, f32::max)
        };
        let [without, with] = [f64::INFINITY, 1e-9].map(|in_any_cell| error(solved(1, in_any_cell)));
        assert!(with < 0.75 * without, "{with} with sweeps, {without} without");
    }

    /// What one call leaves, also if it is cancelled, must not be felt by the next.
    #[test]
    fn a_workspace_serves_one_call_after_another() {
        let hierarchy = hierarchy();
        let [some, others] = [0, 13].map(|first| {
            let (cells, values) = some_cells(&hierarchy, first, 29);
            (Arc::new(Places::new(&hierarchy.levels[0], &cells)), values)
        });
        let mut used = Workspace::new(&hierarchy);
        assert!(used.solve_for(&hierarchy, (&some.0, &some.1), stop(3), &mut |_, _| false).is_none());
        for _ in 0..2 {
            let mut fresh = Workspace::new(&hierarchy);
            for workspace in [&mut used, &mut fresh] {
                let others = (&others.0, others.1.as_slice());
                workspace.solve_for(&hierarchy, others, stop(3), &mut |_, _| true).unwrap();
            }
            assert!(used.field() == fresh.field() && used.field().iter().any(|row| *row != ZERO));
            used.take_field();
            let mut fresh = Workspace::new(&hierarchy);
            for workspace in [&mut used, &mut fresh] {
                workspace.solve(&hierarchy, 0, stop(3), &mut |_, _| true).unwrap();
            }
            assert!(used.take_field() == fresh.field());
        }
    }
}
