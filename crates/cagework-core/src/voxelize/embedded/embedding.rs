//! The cage in the grid on all levels, made at once or brought up to date after an edit: then only lines through faces that
//! have changed are looked at.

use crate::cage::Cage;
use crate::grid::Grid;
use crate::levels::{Touched, coarsened_until_few, is_few};
use crate::voxelize::lines::{Hit, Lines};

use super::{Cells, EmbeddedCells, is_ambiguous, is_inside, shoot_lines, votes};

/// Lines through the cage, and what the cells of every level are.
#[derive(Clone, Debug, PartialEq)]
pub struct Embedding {
    lines: [Lines; 3],
    /// How many axes say of each centre of the finest grid that it is inside.
    votes: Vec<u8>,
    /// Cells about which the axes disagree.
    ambiguous: u64,
    /// Finest first; at least one.
    levels: Vec<Cells>,
}

impl Embedding {
    /// Of a cage, on levels of doubling cell size until few unknowns remain.
    #[must_use]
    pub fn new(cage: &Cage, grid: &Grid) -> Self {
        let lines = shoot_lines(cage, grid, &|_| true);
        let votes = votes(&lines, grid);
        let ambiguous = votes.iter().filter(|&&votes| is_ambiguous(votes)).count() as u64;
        let finest = Cells::finest(&lines, *grid, &votes);
        let levels = coarsened_until_few(finest, |cells| &cells.inside, |cells| cells.coarsened(&lines));
        Self { lines, votes, ambiguous, levels }
    }

    /// Cells about which the axes disagreed.
    #[must_use]
    pub fn ambiguous(&self) -> u64 {
        self.ambiguous
    }

    /// What each level's cells see of the cage, finest first.
    #[must_use]
    pub fn boundaries<'a>(&'a self, cage: &'a Cage) -> Vec<EmbeddedCells<'a>> {
        self.levels.iter().map(|cells| cells.with(cage, &self.lines)).collect()
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let lines: usize = self.lines.iter().map(Lines::bytes).sum();
        lines + self.votes.len() + self.levels.iter().map(|cells| 2 * cells.inside.len()).sum::<usize>()
    }

    /// Brings it up to date with an edit that leaves the grid and the faces: it becomes what [`Self::new`] makes. Returns what
    /// it has touched on each level; `None` if there are more or fewer levels now: then it must be made anew.
    #[must_use]
    pub fn edit(&mut self, before: &Cage, cage: &Cage) -> Option<Vec<Touched>> {
        debug_assert_eq!(before.faces(), cage.faces(), "an edit leaves the faces");
        let Self { lines: all_lines, votes, ambiguous, levels } = self;
        let grid = levels[0].grid;
        let changed = cage.changed_faces(before);
        let has_changed = |cage: &Cage, t: u32| changed[cage.face_of_triangle()[t as usize] as usize];
        let [gone, come] = [before, cage].map(|cage| shoot_lines(cage, &grid, &|t| has_changed(cage, t)));
        let mut touched: Vec<Touched> = levels.iter().map(|cells| Touched::none(&cells.grid)).collect();
        for (axis, lines_before) in all_lines.iter_mut().enumerate() {
            let (gone, come) = (&gone[axis], &come[axis]);
            let lines = lines_before.renewed(gone, come);
            let (stride, n) = (grid.strides()[axis], grid.dims[axis] as usize);
            for line in 0..lines.n_lines() {
                if !gone.is_hit(line) && !come.is_hit(line) {
                    continue;
                }
                let [gone, come, were, are] = [gone, come, lines_before, &lines].map(|lines| lines.at(line));
                let place = lines.place(line);
                let first = grid.line_start(axis, place);
                for_each_difference([were, are], n, |centre, is_now| {
                    let cell = first + centre * stride;
                    let before = votes[cell];
                    let now = if is_now { before + 1 } else { before - 1 };
                    *ambiguous = *ambiguous + u64::from(is_ambiguous(now)) - u64::from(is_ambiguous(before));
                    votes[cell] = now;
                    if is_inside(now) != is_inside(before) {
                        flip(levels, grid.cell(cell), &mut touched);
                    }
                });
                for (cells, touched) in levels.iter_mut().zip(&mut touched) {
                    if cells.has(&place) {
                        cells.move_walls(axis, place, [gone, come, are], touched);
                    }
                }
            }
            *lines_before = lines;
        }
        let (coarsest, finer) = levels.split_last()?;
        // The coarser, the fewer.
        let is_finer_few = finer.last().is_some_and(|cells| is_few(&cells.inside));
        let is_any_coarser = || coarsest.coarsened(all_lines).inside.contains(&true);
        let is_last = coarsest.inside.contains(&true) && (is_few(&coarsest.inside) || !is_any_coarser());
        (is_last && !is_finer_few).then_some(touched)
    }
}

impl Cells {
    /// Brings the cut arms along a line up to date: crossings that are gone, those that have come, and all.
    fn move_walls(
        &mut self,
        axis: usize,
        place: [u32; 2],
        [gone, come, all]: [&[Hit]; 3],
        touched: &mut Touched,
    ) {
        let nx = self.grid.dims[0] as usize;
        // All at last: an arm may end at another crossing as well.
        for (k, hit) in
            [gone, come, all].iter().enumerate().flat_map(|(k, hits)| hits.iter().map(move |hit| (k, hit)))
        {
            for (cell, arm) in self.at_wall(axis, place, hit) {
                let cut = &mut self.cut[cell];
                *cut = if k == 0 { *cut & !arm } else { *cut | arm };
                touched.moved[cell / nx] |= k < 2;
                touched.cells.add_if(k < 2, cell);
            }
        }
    }
}

/// Types a cell of the finest grid as what it was not, and so on all levels that have it.
fn flip(levels: &mut [Cells], cell: [u32; 3], touched: &mut [Touched]) {
    for (cells, touched) in levels.iter_mut().zip(touched) {
        if !cells.has(&cell) {
            return;
        }
        let index = cells.grid.index(cell.map(|x| x / cells.step));
        cells.inside[index] = !cells.inside[index];
        touched.changed[index / cells.grid.dims[0] as usize] = true;
        touched.cells.add_if(true, index);
        for neighbour in (0..6).filter_map(|d| cells.grid.neighbour(cells.grid.cell(index), d)) {
            touched.cells.add_if(true, cells.grid.index(neighbour));
        }
    }
}

/// Calls `each(centre, is_inside)` for those of the centres 0..n of a line that lie inside by one list of its crossings only:
/// `is_inside` by the second.
fn for_each_difference([were, are]: [&[Hit]; 2], n: usize, mut each: impl FnMut(usize, bool)) {
    // The first centre past the crossing, as in `votes`; a last crossing without another does not count.
    let end = |hits: &[Hit], k: usize| {
        let hit = hits.get(k).filter(|_| k < hits.len() / 2 * 2);
        hit.map_or(n, |hit| hit.t.ceil().clamp(0.0, n as f64) as usize)
    };
    let (mut i, mut j, mut from) = (0, 0, 0);
    while from < n {
        let ends = [end(were, i), end(are, j)];
        let to = ends[0].min(ends[1]);
        if (i + j) % 2 == 1 {
            (from..to).for_each(|centre| each(centre, j % 2 == 1));
        }
        i += usize::from(ends[0] == to);
        j += usize::from(ends[1] == to);
        from = to;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn is_inside_by(hits: &[Hit], centre: usize) -> bool {
        hits.chunks_exact(2).any(|pair| pair[0].t <= centre as f64 && (centre as f64) < pair[1].t)
    }

    fn hits(mut at: Vec<f64>) -> Vec<Hit> {
        at.sort_by(f64::total_cmp);
        at.into_iter().map(|t| Hit { t, triangle: 0, barycentric: [0.0; 2] }).collect()
    }

    /// Crossings on centres, between them and beyond the line's ends.
    fn some_crossings() -> impl Strategy<Value = Vec<f64>> {
        proptest::collection::vec((-4i32..40).prop_map(|quarters| f64::from(quarters) / 4.0), 0..8)
    }

    proptest! {
        #[test]
        fn differences_are_what_two_lists_of_crossings_say(a in some_crossings(), b in some_crossings()) {
            const N: usize = 8;
            let (were, are) = (hits(a), hits(b));
            let mut found = Vec::new();
            for_each_difference([&were, &are], N, |centre, is_now| found.push((centre, is_now)));
            let differs = |&(centre, is): &(usize, bool)| is_inside_by(&were, centre) != is;
            let expected: Vec<_> = (0..N).map(|centre| (centre, is_inside_by(&are, centre))).filter(differs).collect();
            prop_assert_eq!(found, expected);
        }
    }
}
