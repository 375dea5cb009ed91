//! Full multigrid and V(2,1) cycles on one batch of columns.
//!
//! Solves the discrete Laplace equation of the embedded boundary for [`LANES`] right-hand sides at once. Red-black
//! Gauss-Seidel relaxes; coarse levels are discretised anew from the cage. The first black half sweep of a cycle goes
//! `OMEGA` times as far (Yavneh 1996), which costs nothing and makes V(2,1) converge as V(2,2) does without.
//! Measured on the Armadillo, g = 64, root mean square error of a cell's 16 columns: 5.7e-4 after full multigrid, then
//! 3.1e-5, 2.5e-6, 2.3e-7 after each further cycle. The first guess of a level is the mean of the coarse solution, not
//! its trilinear interpolation with zeros outside: the solution is not zero on the cage (7.5e-2 -> 2.9e-2).
//!
//! From the second cycle on, the finest level's residual is injected ([`centres`](super::centres)): 42 cycles for the
//! Armadillo's 14 batches instead of 43, the later ones cheaper, and 4e-6 of error left at the end instead of 7e-6 (5e-6 with the
//! shorter last cycle, `SPARE`).
//!
//! All passes between two restrictions are one stream through memory (`stream`): the coarse correction, the sweep after it,
//! the next cycle's two sweeps and the residual of the red cells follow each other one z-plane apart.

mod convergence;
mod other;
mod stream;

pub use convergence::{BatchReport, Convergence, Stop, histories};
pub use other::Places;

use std::sync::Arc;

use super::hierarchy::Hierarchy;
use super::rows::{LANES, Rhs, Row, ZERO, over_relax_plane, relax_plane, restrict_residual};
use crate::levels::Level;
use crate::simd::dispatch;

use stream::{DOWN, DOWN_FROM_COARSE, DOWN_FROM_ZERO, OF_COLUMNS, Pass, UP, Ways, add_whole, stream};

/// Over-relaxation of the first black half sweep: 1.1 to 1.3 all lower the error 1.5 to 2 times per cycle (Armadillo).
pub const OMEGA: f32 = 1.2;

/// A cycle that is expected to leave so many times less than it may, and to be the last, does with one sweep less.
const SPARE: f64 = 1.5;

/// Sweeps on the coarsest level, which has at most a few hundred unknowns, six or so across.
pub const COARSEST_SWEEPS: usize = 8;

/// Their over-relaxation. Six cells across, Jacobi leaves 0.90 of the error, for which 1.4 is Young's optimum: 0.4 are
/// left after a sweep, where 0.8 are without.
pub const COARSEST_OMEGA: f32 = 1.4;

/// Fields of one batch on every level; allocated once per thread, used for batch after batch.
#[derive(Debug)]
pub struct Workspace {
    /// `u[k]`: the solution, on coarse levels the correction. `[n_rows]`
    u: Vec<Vec<Row>>,
    /// `f[0]`: one row per cut cell, then those of whole cells (`places`); `f[k]`: one row per cell.
    f: Vec<Vec<Row>>,
    /// Residual of the red cells of the level under way, and a zero row.
    residual: Vec<Row>,
    /// Where the finest level's right-hand side is, if it is not the cage's.
    places: Arc<Places>,
    /// What the coarsest level's last sweeps changed in the cell where that is most, squared and summed over lanes.
    largest_change: f64,
}

impl Workspace {
    /// Fields for all levels but the finest one's solution, which a solve makes.
    #[must_use]
    pub fn new(hierarchy: &Hierarchy) -> Self {
        // The finest level's is made by whoever solves: it may be handed out.
        let mut u = vec![Vec::new()];
        u.extend(hierarchy.levels[1..].iter().map(|l| vec![ZERO; l.n_rows()]));
        let f = hierarchy
            .levels
            .iter()
            .enumerate()
            .map(|(k, l)| vec![ZERO; if k == 0 { l.n_cut() } else { l.n_rows() }])
            .collect();
        Self {
            u,
            f,
            residual: vec![ZERO; hierarchy.levels[0].first_row(1)],
            places: Arc::default(),
            largest_change: 0.0,
        }
    }

    /// Bytes of a workspace for `hierarchy`, but for right-hand sides of whole cells, of which edits have a few.
    #[must_use]
    pub fn bytes(hierarchy: &Hierarchy) -> usize {
        let rows: usize = hierarchy
            .levels
            .iter()
            .enumerate()
            .map(|(k, l)| if k == 0 { l.n_rows() + l.n_cut() + l.first_row(1) } else { 2 * l.n_rows() })
            .sum();
        rows * size_of::<Row>()
    }

    /// Solves a batch; returns how it converged. `cycle_done(cycle, delta)` may cancel by returning false.
    ///
    /// # Errors
    /// `None` when cancelled.
    pub fn solve(
        &mut self,
        hierarchy: &Hierarchy,
        batch: usize,
        stop: Stop,
        cycle_done: &mut dyn FnMut(u32, f64) -> bool,
    ) -> Option<BatchReport> {
        let coarsest = hierarchy.levels.len() - 1;
        if self.u[0].is_empty() {
            self.u[0] = vec![ZERO; hierarchy.levels[0].n_rows()];
        }
        hierarchy.fill_cut_rhs(batch, &mut self.f[0]);
        for k in (1..=coarsest).rev() {
            hierarchy.fill_dense_rhs(k, batch, &mut self.f[k]);
            self.cycle(hierarchy, k, if k == coarsest { DOWN_FROM_ZERO } else { DOWN_FROM_COARSE });
        }
        let start = if coarsest == 0 { DOWN_FROM_ZERO } else { DOWN_FROM_COARSE };
        self.cycles(hierarchy, (start, &OF_COLUMNS), stop, cycle_done)
    }

    /// V-cycles on the finest level until the stop rule holds, the first of which begins with `start`.
    fn cycles(
        &mut self,
        hierarchy: &Hierarchy,
        (mut start, ways): (&[Pass], &Ways),
        stop: Stop,
        cycle_done: &mut dyn FnMut(u32, f64) -> bool,
    ) -> Option<BatchReport> {
        let mut convergence = Convergence::new(stop);
        loop {
            let (correction_square, residual_square) = self.down(hierarchy, 0, start);
            let largest = if stop.in_any_cell < f64::INFINITY { self.largest_correction() } else { 0.0 };
            let done = convergence.cycle_done(correction_square, largest, residual_square);
            let (cycle, delta) = convergence.latest();
            if !cycle_done(cycle, delta) {
                return None;
            }
            if done {
                let report = convergence.into_report();
                let last = if report.leaves_little(&stop) { ways.last_of_little } else { ways.last };
                self.up(hierarchy, 0, last);
                return Some(report);
            }
            start = match hierarchy.levels.len() {
                1 => DOWN,
                _ if convergence.is_nearly_done(SPARE) => ways.before_little,
                _ => ways.between,
            };
        }
    }

    /// The finest level's field, `[n_rows]`; empty before the first solve and once it was handed out.
    #[must_use]
    pub fn field(&self) -> &[Row] {
        &self.u[0]
    }

    /// Hands the finest level's field out, `[n_rows]`. The next solve makes another; until then there is none to look at, to
    /// sweep or to cycle on.
    pub fn take_field(&mut self) -> Vec<Row> {
        std::mem::take(&mut self.u[0])
    }

    /// One full relaxation of the finest level, both colours, as the solver does it: the unit in which a solve's
    /// cost is measured. After a [`Self::solve`].
    pub fn sweep(&mut self, hierarchy: &Hierarchy) {
        let (level, u, f) = (&hierarchy.levels[0], &mut self.u[0], Rhs::Cut(&self.f[0]));
        relax(level, u, f);
    }

    /// One V(2,1) cycle on the finest level, after [`Self::solve`] has set up a batch: for measuring.
    pub fn v_cycle(&mut self, hierarchy: &Hierarchy) {
        self.cycle(hierarchy, 0, DOWN);
    }

    /// One V(2,1) cycle from level k down, which begins with `start`.
    fn cycle(&mut self, hierarchy: &Hierarchy, k: usize, start: &[Pass]) {
        self.down(hierarchy, k, start);
        self.up(hierarchy, k, UP);
    }

    /// The right-hand side of level k.
    fn rhs(f: &[Vec<Row>], k: usize) -> Rhs<'_> {
        if k == 0 { Rhs::Cut(&f[0]) } else { Rhs::Dense(&f[k]) }
    }

    /// A cycle's way down on level k, by the passes `start`, and all of it on coarser levels. Returns (squared norm of the
    /// coarse correction, on level 0; mean squared residual).
    fn down(&mut self, hierarchy: &Hierarchy, k: usize, start: &[Pass]) -> (f64, f64) {
        let level = &hierarchy.levels[k];
        if k + 1 == hierarchy.levels.len() {
            if start == DOWN_FROM_ZERO {
                self.u[k].fill(ZERO);
            }
            let whole = self.places.extent(k, start).whole;
            let (change, largest) = relax_coarsest(level, &mut self.u[k], Self::rhs(&self.f, k), whole);
            self.largest_change = largest;
            return (change, 0.0);
        }
        let (coarse, transfer) = (&hierarchy.levels[k + 1], &hierarchy.transfers[k]);
        let (f, coarse_f) = self.f.split_at_mut(k + 1);
        let (u, coarse_u) = self.u.split_at_mut(k + 1);
        let residual = &mut self.residual[..level.first_row(1)];
        let rhs = Self::rhs(f, k);
        let extent = self.places.extent(k, start);
        let squares = stream(start, level, extent, (transfer, &coarse_u[0]), &mut u[k], rhs, residual);
        let mean_square = dispatch(
            #[inline(always)]
            || {
                // What follows a coarse correction ends without a residual.
                if start.last() != Some(&Pass::Residual) {
                    return hierarchy.centres.inject(level, coarse, &mut u[0], rhs, &mut coarse_f[0]);
                }
                restrict_residual(coarse, transfer, residual, &mut coarse_f[0]);
                squares / level.n_unknowns() as f64
            },
        );
        self.cycle(hierarchy, k + 1, DOWN_FROM_ZERO);
        let correction =
            if k == 0 { sum_squares(&self.u[1]) / coarse.n_unknowns().max(1) as f64 } else { 0.0 };
        (correction, mean_square)
    }

    /// A cycle's way up on level k, by `passes`.
    fn up(&mut self, hierarchy: &Hierarchy, k: usize, passes: &[Pass]) {
        if k + 1 < hierarchy.levels.len() {
            let (u, coarse_u) = self.u.split_at_mut(k + 1);
            let rhs = Self::rhs(&self.f, k);
            stream(
                passes,
                &hierarchy.levels[k],
                self.places.extent(k, passes),
                (&hierarchy.transfers[k], &coarse_u[0]),
                &mut u[k],
                rhs,
                &mut [],
            );
        }
    }

    /// Square of the latest coarse correction of the finest level in the cell where it is largest, summed over lanes; of its
    /// latest sweeps if there is no other level.
    fn largest_correction(&self) -> f64 {
        if self.u.len() == 1 {
            return self.largest_change;
        }
        let square = |row: &Row| row.iter().map(|w| w * w).sum::<f32>();
        f64::from(self.u.get(1).into_iter().flatten().map(square).fold(0.0, |a, b| if b > a { b } else { a }))
    }
}

/// A plain red-black sweep.
fn relax(level: &Level, u: &mut [Row], f: Rhs<'_>) {
    dispatch(
        #[inline(always)]
        || {
            for colour in 0..2 {
                for plane in 0..level.grid.dims[2] as usize {
                    relax_plane(level, colour, plane, u, f);
                }
            }
        },
    );
}

/// Sweeps on the coarsest level. Returns the squared norm of the change per unknown, and its square in the cell with the most.
fn relax_coarsest(level: &Level, u: &mut [Row], f: Rhs<'_>, whole: &[u32]) -> (f64, f64) {
    let before = u.to_vec();
    dispatch(
        #[inline(always)]
        || {
            for _ in 0..COARSEST_SWEEPS {
                for colour in 0..2 {
                    for plane in 0..level.grid.dims[2] as usize {
                        over_relax_plane(level, colour, plane, COARSEST_OMEGA, u, f);
                        if colour == 1 {
                            add_whole(level, plane, COARSEST_OMEGA, u, whole, f);
                        }
                    }
                }
            }
        },
    );
    let square = |(a, b): (&Row, &Row)| a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
    let (mut sum, mut largest) = (0.0, 0.0);
    for square in before.iter().zip(u.iter()).map(square) {
        sum += square;
        largest = f64::max(largest, square);
    }
    (sum / level.n_unknowns().max(1) as f64, largest)
}

/// Sum of squares over all rows and lanes.
fn sum_squares(rows: &[Row]) -> f64 {
    dispatch(
        #[inline(always)]
        || {
            // One partial sum per few thousand rows keeps f32 accurate enough for a stop rule.
            rows.chunks(4096)
                .map(|chunk| {
                    let mut sum = ZERO;
                    for row in chunk {
                        for k in 0..LANES {
                            sum[k] += row[k] * row[k];
                        }
                    }
                    sum.iter().map(|&s| f64::from(s)).sum::<f64>()
                })
                .sum()
        },
    )
}
