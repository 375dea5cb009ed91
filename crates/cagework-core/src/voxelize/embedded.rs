//! The embedded boundary: which cell centres are inside the cage, and where their six arms end on it.
//!
//! Lines through the centres are intersected with the cage once, on the finest grid. Parity along a line classifies
//! each centre. Where the three axes disagree (because of rounding, or in a self-intersecting cage) the majority
//! decides, and the cell counts as ambiguous. An *arm* of an inside centre has length 1 if it reaches the next centre
//! without crossing the cage; otherwise it ends on the cage at a distance theta, in cells. Two centres on either side
//! of a wall are never neighbours, however thin the wall. Coarser grids keep every second centre, so they reuse a
//! subset of the lines.
//!
//! Source: Joshi et al. 2007, section 4, for the grid; Gibou et al. 2002 for the stencil with cut arms.

use glam::DVec3;

use crate::cage::Cage;
use crate::controls::Controls;
use crate::grid::Grid;
use crate::levels::{Boundary, coarsened_until_few};

use super::lines::{Hit, Lines, Overlaps};

/// Shortest arm, in cells. A centre this close to the cage has the cage's value within the solver's accuracy, and
/// shorter arms would cost f32 precision (measured on the Armadillo and the horse).
const MIN_ARM: f64 = 1e-3;

/// Limits on the factor of arms that end on a ball. Values beyond occur on levels whose cells are larger than the ball,
/// and at centres so close to the ball that its mesh differs from the sphere by more.
const BALL_SCALE_RANGE: [f64; 2] = [0.5, 2.0];

/// Classification of a level's cells. Level k uses every 2^k-th centre of the finest grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Cells {
    grid: Grid,
    /// Distance between this level's centres, in cells of the finest grid.
    step: u32,
    inside: Vec<bool>,
    cut: Vec<u8>,
}

/// The cage embedded in all levels: grid lines and the cells of every level.
#[derive(Clone, Debug, PartialEq)]
pub struct Embedding {
    lines: [Lines; 3],
    /// Number of cells for which lines along x, y and z disagree about inside and outside the cage.
    pub ambiguous: u64,
    /// Levels, finest first; at least one.
    levels: Vec<Cells>,
}

impl Embedding {
    /// Embeds a cage in levels of doubling cell size until few unknowns remain, or in the finest level only.
    #[must_use]
    pub fn new(cage: &Cage, grid: &Grid, has_coarse_levels: bool) -> Self {
        let lines = shoot_lines(cage, grid);
        let votes = votes(&lines, grid);
        let ambiguous = votes.iter().filter(|&&votes| is_ambiguous(votes)).count() as u64;
        let finest = Cells::finest(&lines, *grid, &votes);
        let levels = if has_coarse_levels {
            coarsened_until_few(finest, |cells| &cells.inside, |cells| cells.coarsened(&lines))
        } else {
            vec![finest]
        };
        Self { lines, ambiguous, levels }
    }

    /// The embedded cage on each level, finest first, with the controls that give its boundary values.
    #[must_use]
    pub fn boundaries<'a>(&'a self, controls: Controls<'a>) -> Vec<EmbeddedCells<'a>> {
        self.levels.iter().map(|cells| cells.with(controls, &self.lines)).collect()
    }

    /// Overlaps of parts of the cage. Only walls of the union of all parts bound the interior.
    #[must_use]
    pub fn overlaps(&self) -> Overlaps {
        Overlaps::sum(&self.lines)
    }

    /// Peak size of lines, levels and temporary votes in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let lines: usize = self.lines.iter().map(Lines::bytes).sum();
        // Votes are temporary: one byte per cell of the finest level.
        let finest = self.levels[0].inside.len();
        lines + finest + self.levels.iter().map(|cells| 2 * cells.inside.len()).sum::<usize>()
    }
}

/// The embedded cage on one level.
#[derive(Debug)]
pub struct EmbeddedCells<'a> {
    controls: Controls<'a>,
    lines: &'a [Lines; 3],
    cells: &'a Cells,
}

/// Lines along x, y and z through the cage.
#[must_use]
pub fn shoot_lines(cage: &Cage, grid: &Grid) -> [Lines; 3] {
    let lines = crate::team::map_indices(3, |axis| Lines::shoot(cage, grid, axis));
    lines.try_into().expect("three axes")
}

/// Number of axes, 0 to 3, that classify each centre of the finest grid as inside.
#[must_use]
pub fn votes(lines: &[Lines; 3], grid: &Grid) -> Vec<u8> {
    let (mut votes, mut flips) = (vec![0u8; grid.n_cells()], vec![0u8; grid.n_cells()]);
    for (axis, lines) in lines.iter().enumerate() {
        let (stride, n) = (grid.strides()[axis], grid.dims[axis] as usize);
        for (iu, iv, hits) in lines.crossing() {
            let first = grid.line_start(axis, [iu, iv]);
            for pair in hits.chunks_exact(2) {
                // Centres s with t0 <= s < t1 lie between an odd crossing and the next, even one, hence inside.
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
        // Along y and z, neighbours are far apart in memory: process whole rows or planes.
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
    votes
}

fn is_inside(votes: u8) -> bool {
    votes >= 2
}

fn is_ambiguous(votes: u8) -> bool {
    votes == 1 || votes == 2
}

impl Cells {
    /// Classifies the cells of the finest level.
    #[must_use]
    pub fn finest(lines: &[Lines; 3], grid: Grid, votes: &[u8]) -> Self {
        Self::with_walls(lines, grid, 1, votes.iter().map(|&votes| is_inside(votes)).collect())
    }

    /// Classifies the cells of the next coarser level, which keeps every second centre.
    #[must_use]
    pub fn coarsened(&self, lines: &[Lines; 3]) -> Self {
        let grid = self.grid.coarsened();
        let inside = grid.cells().map(|cell| self.inside[self.grid.index(cell.map(|x| 2 * x))]).collect();
        Self::with_walls(lines, grid, 2 * self.step, inside)
    }

    fn with_walls(lines: &[Lines; 3], grid: Grid, step: u32, inside: Vec<bool>) -> Self {
        let (mut cells, mut cut) = (Self { grid, step, inside, cut: Vec::new() }, vec![0; grid.n_cells()]);
        for (axis, lines) in lines.iter().enumerate() {
            for (iu, iv, hits) in lines.crossing() {
                // Skip lines that this level does not have.
                if (iu | iv) & (step - 1) != 0 {
                    continue;
                }
                let first = cells.grid.line_start(axis, [iu / step, iv / step]);
                let (stride, n) = (cells.grid.strides()[axis], i64::from(cells.grid.dims[axis]));
                for hit in hits {
                    let (below, above) = wall_between(hit.t / f64::from(step));
                    for (x, direction) in [(below, 2 * axis), (above, 2 * axis + 1)] {
                        if (0..n).contains(&x) {
                            cut[first + x as usize * stride] |= 1 << direction;
                        }
                    }
                }
            }
        }
        cells.cut = cut;
        cells
    }

    /// Combines the cells with the controls and lines from which they were classified.
    #[must_use]
    pub fn with<'a>(&'a self, controls: Controls<'a>, lines: &'a [Lines; 3]) -> EmbeddedCells<'a> {
        EmbeddedCells { controls, lines, cells: self }
    }
}

impl EmbeddedCells<'_> {
    /// Nearest crossing of the cage in a direction within one cell of a centre, and its distance in cells.
    fn nearest(&self, cell: [u32; 3], direction: usize) -> Option<(Hit, f64)> {
        let axis = direction / 2;
        let step = self.cells.step;
        let hits = self.lines[axis].through(cell.map(|x| x * step));
        let step = f64::from(step);
        let s = f64::from(cell[axis]);
        let hit = if direction.is_multiple_of(2) {
            hits.iter().find(|h| h.t / step > s)
        } else {
            hits.iter().rev().find(|h| h.t / step <= s)
        };
        hit.map(|h| (*h, (h.t / step - s).abs())).filter(|(_, theta)| *theta <= 1.0)
    }

    /// Factor of the arms of a cell that end on the ball around `center`, with which the cell's equation is exact for
    /// `1/r`, where r is the distance from the center. Without it, a ball acts like one that is smaller by 2 % if its
    /// radius is two cells.
    fn ball_scale(&self, cell: [u32; 3], center: DVec3) -> f64 {
        let grid = &self.cells.grid;
        let radius = self.controls.inner_radius().map_or(0.0, f64::from);
        let potential = |p: DVec3| 1.0 / p.distance(center).max(radius);
        let at = grid.center(cell);
        let (mut of_ball, mut of_others) = (0.0, 0.0);
        for direction in 0..6 {
            let way = DVec3::AXES[direction / 2] * grid.cell * if direction % 2 == 0 { 1.0 } else { -1.0 };
            match self.nearest(cell, direction) {
                Some((hit, theta)) if self.controls.ball_center(hit.triangle) == Some(center) => {
                    of_ball += (1.0 / radius - potential(at)) / arm_length(theta);
                }
                Some((_, theta)) => {
                    of_others += (potential(at + theta * way) - potential(at)) / arm_length(theta);
                }
                None => of_others += potential(at + way) - potential(at),
            }
        }
        let [low, high] = BALL_SCALE_RANGE;
        if of_ball > 0.0 { (-of_others / of_ball).clamp(low, high) } else { 1.0 }
    }
}

/// The two centres next to a crossing at `t`. A centre exactly at the crossing counts as above it, as in [`votes`],
/// where centre s is past the crossing if `t <= s`.
fn wall_between(t: f64) -> (i64, i64) {
    let above = t.ceil() as i64;
    (above - 1, above)
}

impl Boundary for EmbeddedCells<'_> {
    fn grid(&self) -> Grid {
        self.cells.grid
    }

    fn unknowns(&self) -> &[bool] {
        &self.cells.inside
    }

    fn cut_arms(&self) -> &[u8] {
        &self.cells.cut
    }

    fn arm(&self, cell: [u32; 3], direction: usize, hats: &mut dyn FnMut(u32, f64)) -> f64 {
        let Some((hit, theta)) = self.nearest(cell, direction) else { return 0.0 };
        let [b0, b1] = hit.barycentric;
        self.controls.values_at(hit.triangle, [b0, b1, 1.0 - b0 - b1], hats);
        let scale = self.controls.ball_center(hit.triangle).map_or(1.0, |ball| self.ball_scale(cell, ball));
        scale / arm_length(theta)
    }
}

/// Length of an arm, in cells, that ends on the cage at a distance of `theta`. A comparison instead of `max`, which has
/// no single wasm instruction.
fn arm_length(theta: f64) -> f64 {
    if theta > MIN_ARM { theta } else { MIN_ARM }
}
