//! The embedded boundary: which cell centres are inside the cage, and how far each is from it along its six arms.
//!
//! Lines through the centres are shot through the cage once, on the finest grid. Parity along a line types each
//! centre; where the three axes disagree (a crossing lost to rounding, a cage that meets itself) the majority wins
//! and the cell is counted. An *arm* of an inside centre is whole (1 cell) when the neighbour is reached without
//! crossing the cage, and otherwise ends on the cage at a distance theta. Two centres with a wall between them are
//! never neighbours, however thin the wall. Coarser grids keep every second centre, so that their lines are a
//! subset of the finest grid's and nothing is shot again.
//!
//! Source: Joshi et al. 2007, section 4, for the grid; Gibou et al. 2002 for the stencil with cut arms.

use crate::cage::Cage;
use crate::grid::Grid;
use crate::levels::Boundary;

use super::lines::{Hit, Lines};

/// Shortest arm, in cells: a centre this close to the cage has the cage's value to within the solver's accuracy, and
/// a shorter arm would only cost f32 digits (1e-3 measured on the Armadillo and the horse).
const MIN_ARM: f64 = 1e-3;

/// The cage in the grid, on one level: level k looks at every 2^k-th centre of the finest grid.
#[derive(Debug)]
pub struct EmbeddedCells<'a> {
    cage: &'a Cage,
    lines: &'a [Lines; 3],
    grid: Grid,
    /// Distance between this level's centres in cells of the finest grid.
    step: u32,
    inside: Vec<bool>,
    cut: Vec<u8>,
}

/// Lines along x, y and z.
#[must_use]
pub fn shoot_lines(cage: &Cage, grid: &Grid) -> [Lines; 3] {
    shoot_some(cage, grid, &|_| true)
}

/// Lines through the faces that an edit has changed: as they were, and as they are now. What [`Lines::renewed`] asks for.
#[must_use]
pub fn shoot_changed(before: &Cage, cage: &Cage, grid: &Grid) -> [[Lines; 3]; 2] {
    let has_changed = cage.changed_faces(before);
    [before, cage]
        .map(|cage| shoot_some(cage, grid, &|t| has_changed[cage.face_of_triangle()[t as usize] as usize]))
}

fn shoot_some(cage: &Cage, grid: &Grid, wanted: &(dyn Fn(u32) -> bool + Sync)) -> [Lines; 3] {
    let lines = super::map_indices(3, |axis| Lines::shoot(cage, grid, axis, wanted));
    lines.try_into().expect("three axes")
}

/// Types every centre of the finest grid. Returns (inside, cells about which the axes disagreed).
#[must_use]
pub fn classify(lines: &[Lines; 3], grid: &Grid) -> (Vec<bool>, u64) {
    let (mut votes, mut flips) = (vec![0u8; grid.n_cells()], vec![0u8; grid.n_cells()]);
    let strides = grid.strides();
    for (axis, lines) in lines.iter().enumerate() {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let (stride, n) = (strides[axis], grid.dims[axis] as usize);
        for (iu, iv, hits) in lines.crossing() {
            let first = iu as usize * strides[u] + iv as usize * strides[v];
            for pair in hits.chunks_exact(2) {
                // Centres s with t0 <= s < t1 lie between an odd and an even crossing.
                let [start, end] = [pair[0].t, pair[1].t].map(|t| t.ceil().clamp(0.0, n as f64) as usize);
                if axis == 0 {
                    votes[first + start..first + end].iter_mut().for_each(|vote| *vote += 1);
                    continue;
                }
                for s in [start, end].into_iter().filter(|&s| s < n) {
                    flips[first + s * stride] ^= 1;
                }
            }
        }
        if axis == 0 {
            continue;
        }
        // Along y and z neighbours are far apart: all of a row or plane go on together.
        for (flips, votes) in flips.chunks_exact_mut(stride * n).zip(votes.chunks_exact_mut(stride * n)) {
            for s in 1..n {
                let (before, now) = flips.split_at_mut(s * stride);
                for (flip, before) in now[..stride].iter_mut().zip(&before[(s - 1) * stride..]) {
                    *flip ^= before;
                }
            }
            for (vote, flip) in votes.iter_mut().zip(flips) {
                *vote += std::mem::take(flip);
            }
        }
    }
    let ambiguous = votes.iter().filter(|&&v| v == 1 || v == 2).count() as u64;
    (votes.into_iter().map(|v| v >= 2).collect(), ambiguous)
}

impl<'a> EmbeddedCells<'a> {
    /// The finest level.
    #[must_use]
    pub fn finest(cage: &'a Cage, lines: &'a [Lines; 3], grid: Grid, inside: Vec<bool>) -> Self {
        Self::with_walls(cage, lines, grid, 1, inside)
    }

    /// The next coarser level.
    #[must_use]
    pub fn coarsened(&self) -> Self {
        let grid = self.grid.coarsened();
        let inside = grid.cells().map(|cell| self.inside[self.grid.index(cell.map(|x| 2 * x))]).collect();
        Self::with_walls(self.cage, self.lines, grid, 2 * self.step, inside)
    }

    fn with_walls(cage: &'a Cage, lines: &'a [Lines; 3], grid: Grid, step: u32, inside: Vec<bool>) -> Self {
        let mut cut = vec![0u8; grid.n_cells()];
        for (axis, lines) in lines.iter().enumerate() {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let last = i64::from(grid.dims[axis]) - 1;
            for (iu, iv, hits) in lines.crossing() {
                if iu % step != 0 || iv % step != 0 {
                    continue;
                }
                let mut cell = [0; 3];
                (cell[u], cell[v]) = (iu / step, iv / step);
                for hit in hits {
                    let (below, above) = wall_between(hit.t / f64::from(step));
                    for (x, direction) in [(below, 2 * axis), (above, 2 * axis + 1)] {
                        if (0..=last).contains(&x) {
                            cell[axis] = x as u32;
                            cut[grid.index(cell)] |= 1 << direction;
                        }
                    }
                }
            }
        }
        Self { cage, lines, grid, step, inside, cut }
    }

    /// The crossing nearest to a cell along a direction, at most one cell away, and its distance in cells.
    fn nearest(&self, cell: [u32; 3], direction: usize) -> Option<(Hit, f64)> {
        let axis = direction / 2;
        let step = f64::from(self.step);
        let hits = self.lines[axis].through(cell.map(|x| x * self.step));
        let s = f64::from(cell[axis]);
        let hit = if direction.is_multiple_of(2) {
            hits.iter().find(|h| h.t / step > s)
        } else {
            hits.iter().rev().find(|h| h.t / step <= s)
        };
        hit.map(|h| (*h, (h.t / step - s).abs())).filter(|(_, theta)| *theta <= 1.0)
    }
}

/// The lines along x with centres whose arms may end at some crossings, on every level: `[n_levels][nz * ny]`.
#[must_use]
pub fn lines_at(crossings: &[[Lines; 3]; 2], grid: &Grid, n_levels: usize) -> Vec<Vec<bool>> {
    let mut grids = vec![*grid];
    while grids.len() < n_levels {
        grids.extend(grids.last().map(Grid::coarsened));
    }
    let mut marked: Vec<Vec<bool>> =
        grids.iter().map(|grid| vec![false; (grid.dims[1] * grid.dims[2]) as usize]).collect();
    for (axis, lines) in crossings.iter().flat_map(|lines| lines.iter().enumerate()) {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for (iu, iv, hit) in lines.crossing().flat_map(|(iu, iv, hits)| hits.iter().map(move |h| (iu, iv, h)))
        {
            for (level, (grid, marked)) in grids.iter().zip(&mut marked).enumerate() {
                let step = 1 << level;
                if iu % step != 0 || iv % step != 0 {
                    break;
                }
                let mut cell = [0; 3];
                (cell[u], cell[v]) = (iu / step, iv / step);
                let (below, above) = wall_between(hit.t / f64::from(step));
                for x in [below, above] {
                    if (0..i64::from(grid.dims[axis])).contains(&x) {
                        cell[axis] = x as u32;
                        marked[(cell[2] * grid.dims[1] + cell[1]) as usize] = true;
                    }
                }
            }
        }
    }
    marked
}

/// The two centres between which a crossing at `t` lies. A crossing exactly on a centre lies below it, as in
/// [`classify`], where centre s is past the crossing when `t <= s`.
fn wall_between(t: f64) -> (i64, i64) {
    let above = t.ceil() as i64;
    (above - 1, above)
}

impl Boundary for EmbeddedCells<'_> {
    fn grid(&self) -> Grid {
        self.grid
    }

    fn unknowns(&self) -> &[bool] {
        &self.inside
    }

    fn cut_arms(&self) -> &[u8] {
        &self.cut
    }

    fn arm(&self, cell: [u32; 3], direction: usize, hats: &mut dyn FnMut(u32, f64)) -> f64 {
        let Some((hit, theta)) = self.nearest(cell, direction) else { return 0.0 };
        let [b0, b1] = hit.barycentric;
        self.cage.hats_at(hit.triangle, [b0, b1, 1.0 - b0 - b1], hats);
        // A comparison: wasm has no instruction for `max`.
        1.0 / if theta > MIN_ARM { theta } else { MIN_ARM }
    }
}
