//! Conjugate gradients on a batch of columns. Those that continue a stalled multigrid solve are preconditioned by its
//! V-cycle.
//!
//! Each lane is a separate system with its own step lengths; delta is common to all lanes. Directions are updated by
//! the Polak-Ribiere formula, which allows an unsymmetric preconditioner such as a V(2,1) cycle.
//!
//! Delta estimates the remaining error. Changes of the solution decrease geometrically up to a ripple, so the remaining
//! error is the latest change times `rate / (1 - rate)`. The rate compares the last `WINDOW` steps with as many before
//! them.
//!
//! A V-cycle that diverges for some errors may be an indefinite preconditioner. If the preconditioned residual is not a
//! descent direction, the step uses the residual itself.
//!
//! Sources: Hestenes and Stiefel 1952; Notay 2000, "Flexible conjugate gradients".

use super::BatchSolver;
use super::hierarchy::Hierarchy;
use super::operator;
use super::rows::{LANES, Rhs, Row, ZERO};
use super::stop::{SolveReport, StopRule};
use crate::simd::dispatch;

/// Largest number of steps in each of the two windows from which the convergence rate is measured. Changes of the
/// solution ripple with a period of 5 to 8 steps, and a window must be longer than that.
const WINDOW: usize = 10;

/// Upper bound on the measured convergence rate. The error estimate divides by 1 - rate.
const RATE_BOUND: f64 = 0.99;

/// Near the resolution of f32, a preconditioned solve counts as converged after this many steps without a smaller
/// delta.
const MAX_STALLED_STEPS: usize = 8;

/// Number of rows whose products are summed in f32; these partial sums are added in f64.
const ROWS_PER_SUM: usize = 1024;

/// One number per lane.
type Lanes = [f64; LANES];

/// Preconditioner: writes an approximate solution of `A z = r` to `z`, the second argument. Both are `[n_rows]`.
pub(super) type Cycle<'a> = &'a mut dyn FnMut(&mut Vec<Row>, &mut Vec<Row>);

/// Fields of a batch on the finest level, `[n_rows]` each.
#[derive(Debug)]
pub struct ConjugateGradient {
    u: Vec<Row>,
    residual: Vec<Row>,
    /// Preconditioned residual.
    z: Vec<Row>,
    direction: Vec<Row>,
    /// Product of the operator and the direction.
    image: Vec<Row>,
    cut_rhs: Vec<Row>,
}

impl ConjugateGradient {
    /// Allocates fields of the finest level.
    #[must_use]
    pub fn new(hierarchy: &Hierarchy) -> Self {
        let field = || vec![ZERO; hierarchy.levels[0].n_rows()];
        Self {
            u: field(),
            residual: field(),
            z: field(),
            direction: field(),
            image: field(),
            cut_rhs: Vec::new(),
        }
    }

    /// Size of the fields, bytes.
    #[must_use]
    pub fn bytes_of(hierarchy: &Hierarchy) -> usize {
        5 * hierarchy.levels[0].n_rows() * size_of::<Row>()
    }

    /// Continues from `u`, the latest iterate of V-cycles that stalled, and stores the solution in `u`. `rhs`: one row
    /// per cut cell; `report`: the report of the cycles, which count towards the limit on iterations.
    pub(super) fn resume(
        &mut self,
        hierarchy: &Hierarchy,
        cycle: Cycle<'_>,
        (u, rhs): (&mut Vec<Row>, &[Row]),
        (rule, report): (StopRule, SolveReport),
        done: &mut dyn FnMut(u32, f64) -> bool,
    ) -> Option<SolveReport> {
        std::mem::swap(&mut self.u, u);
        operator::residual(&hierarchy.levels[0], &self.u, Rhs::Cut(rhs), &mut self.residual);
        let report = self.iterate(hierarchy, Some(cycle), rule.of_cycles(), report, done);
        std::mem::swap(&mut self.u, u);
        report
    }

    /// Applies the preconditioner to the residual. Returns the dot products `r . z` and `r . r` of each lane.
    fn precondition(&mut self, cycle: &mut Option<Cycle<'_>>) -> [Lanes; 2] {
        match cycle {
            None => self.z.copy_from_slice(&self.residual),
            Some(cycle) => cycle(&mut self.residual, &mut self.z),
        }
        let [descent, squares] = [&self.z, &self.residual].map(|other| products(&self.residual, other));
        let climbs: [bool; LANES] = std::array::from_fn(|k| descent[k] <= 0.0 && squares[k] > 0.0);
        if !climbs.contains(&true) {
            return [descent, squares];
        }
        for (z, r) in self.z.iter_mut().zip(&self.residual) {
            for k in (0..LANES).filter(|&k| climbs[k]) {
                z[k] = r[k];
            }
        }
        [products(&self.residual, &self.z), squares]
    }

    /// Iterates from `u` and its residual until the stopping rule holds.
    fn iterate(
        &mut self,
        hierarchy: &Hierarchy,
        mut cycle: Option<Cycle<'_>>,
        rule: StopRule,
        mut report: SolveReport,
        done: &mut dyn FnMut(u32, f64) -> bool,
    ) -> Option<SolveReport> {
        let level = &hierarchy.levels[0];
        let n_unknowns = level.n_unknowns().max(1) as f64;
        let (is_preconditioned, mut changes) = (cycle.is_some(), Vec::new());
        // After cycles that diverged, the first step removes the errors that they amplified: exclude its change from
        // the rate.
        let unlike = usize::from(report.stalled);
        let [mut descent, mut squares] = self.precondition(&mut cycle);
        self.direction.copy_from_slice(&self.z);
        loop {
            operator::apply(level, &self.direction, &mut self.image);
            let curvature = products(&self.direction, &self.image);
            let step = quotients(&descent, &curvature);
            add(&mut self.u, &step, &self.direction);
            add(&mut self.residual, &step.map(|s| -s), &self.image);

            let lengths = products(&self.direction, &self.direction);
            let change: f64 = step.iter().zip(&lengths).map(|(s, length)| s * s * length).sum();
            changes.push(change / n_unknowns);
            let residual = (squares.iter().sum::<f64>() / n_unknowns).sqrt();
            let error = expected_error(&changes[unlike.min(changes.len() - 1)..]);
            let is_done = report.iteration_done(&rule, error, Some(residual));
            let is_last = is_done || is_preconditioned && report.ends_at_round_off(MAX_STALLED_STEPS);
            let (iteration, delta) = report.latest();
            if !done(iteration, delta) {
                return None;
            }
            if is_last {
                return Some(report);
            }

            let before = descent;
            [descent, squares] = self.precondition(&mut cycle);
            let overlap = products(&self.z, &self.image);
            // Dot product z . (r - r_before), in which r - r_before = -step image.
            let conjugate: Lanes = std::array::from_fn(|k| -step[k] * overlap[k]);
            let share = quotients(&conjugate, &before);
            scale(&mut self.direction, &share);
            add(&mut self.direction, &[1.0; LANES], &self.z);
        }
    }
}

impl BatchSolver for ConjugateGradient {
    fn solve(
        &mut self,
        hierarchy: &Hierarchy,
        batch: usize,
        rule: StopRule,
        done: &mut dyn FnMut(u32, f64) -> bool,
    ) -> Option<SolveReport> {
        let level = &hierarchy.levels[0];
        hierarchy.fill_cut_rhs(batch, &mut self.cut_rhs);
        self.u.fill(ZERO);
        self.residual.fill(ZERO);
        for (number, row) in self.cut_rhs.iter().enumerate() {
            self.residual[level.row_of_cut(number)] = *row;
        }
        self.iterate(hierarchy, None, rule, SolveReport::default(), done)
    }

    fn field(&self) -> &[Row] {
        &self.u
    }

    fn bytes(&self) -> usize {
        (5 * self.u.len() + self.cut_rhs.len()) * size_of::<Row>()
    }
}

/// Estimated remaining error from the mean squared changes of all steps.
fn expected_error(squares: &[f64]) -> f64 {
    let n = squares.len();
    let window = (n / 2).min(WINDOW);
    let latest = squares[n - 1].sqrt();
    if window == 0 {
        return 1.0;
    }
    let sum = |part: &[f64]| part.iter().sum::<f64>();
    let (now, before) = (sum(&squares[n - window..]), sum(&squares[n - 2 * window..n - window]));
    if now == 0.0 {
        return 0.0;
    }
    let rate = (now / before).powf(0.5 / window as f64).min(RATE_BOUND);
    // Latest change, estimated from the RMS change over the window: changes ripple, so the measured latest change may
    // be unusually small.
    let usual = (now / window as f64).sqrt() * rate.powf(0.5 * (window - 1) as f64);
    // Weights lie between 0 and 1, so no error exceeds 1.
    (usual.max(latest) * rate / (1.0 - rate)).min(1.0)
}

/// Dot product of `a` and `b` in each lane.
fn products(a: &[Row], b: &[Row]) -> Lanes {
    dispatch(
        #[inline(always)]
        || {
            let mut sums = [0.0; LANES];
            for (a, b) in a.chunks(ROWS_PER_SUM).zip(b.chunks(ROWS_PER_SUM)) {
                let mut part = ZERO;
                for (a, b) in a.iter().zip(b) {
                    for k in 0..LANES {
                        part[k] += a[k] * b[k];
                    }
                }
                for k in 0..LANES {
                    sums[k] += f64::from(part[k]);
                }
            }
            sums
        },
    )
}

/// `a / b` per lane; 0 for a converged lane, whose products are all 0.
fn quotients(a: &Lanes, b: &Lanes) -> Lanes {
    std::array::from_fn(|k| if b[k] > 0.0 { a[k] / b[k] } else { 0.0 })
}

/// Adds `factor * v` to `u`, with a factor per lane.
fn add(u: &mut [Row], factor: &Lanes, v: &[Row]) {
    let factor = factor.map(|f| f as f32);
    dispatch(
        #[inline(always)]
        || {
            for (u, v) in u.iter_mut().zip(v) {
                for k in 0..LANES {
                    u[k] += factor[k] * v[k];
                }
            }
        },
    );
}

/// Multiplies `u` by a factor per lane.
fn scale(u: &mut [Row], factor: &Lanes) {
    let factor = factor.map(|f| f as f32);
    for row in u {
        for k in 0..LANES {
            row[k] *= factor[k];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::levels::plain::hierarchy;
    use crate::solve::multigrid::Workspace;

    /// After changes that decrease by 0.8 per step, the remaining error is 0.8 + 0.64 + ... = 0.8 / (1 - 0.8) = 4 times
    /// the latest change.
    #[test]
    fn remaining_error_of_geometric_changes_is_their_sum() {
        let squares: Vec<f64> = (0..40).map(|k| 0.8f64.powi(2 * k)).collect();
        let (left, latest) = (expected_error(&squares), 0.8f64.powi(39));
        assert!(left >= 3.9 * latest && left < 6.0 * latest, "{left} after {latest}");
    }

    /// Plain and preconditioned conjugate gradients find multigrid's solution; the V-cycle at least halves the number
    /// of steps.
    #[test]
    fn solution_equals_that_of_multigrid() {
        let hierarchy = hierarchy();
        let rule = StopRule { tolerance: 1e-6, max_iterations: 500 };
        let mut multigrid = Workspace::new(&hierarchy);
        multigrid.solve(&hierarchy, 0, rule, &mut |_, _| true).unwrap();
        let mut solver = ConjugateGradient::new(&hierarchy);
        let plain = solver.solve(&hierarchy, 0, rule, &mut |_, _| true).unwrap();
        let (mut cycles, mut u, mut rhs) =
            (Workspace::new(&hierarchy), vec![ZERO; solver.u.len()], Vec::new());
        hierarchy.fill_cut_rhs(0, &mut rhs);
        let mut cycle = |r: &mut Vec<Row>, z: &mut Vec<Row>| cycles.precondition(&hierarchy, r, z);
        let so_far = (rule, SolveReport::default());
        let preconditioned = ConjugateGradient::new(&hierarchy)
            .resume(&hierarchy, &mut cycle, (&mut u, &rhs), so_far, &mut |_, _| true)
            .unwrap();
        for (report, field) in [(&plain, solver.field()), (&preconditioned, &u)] {
            assert!(report.converged);
            let pairs = field.as_flattened().iter().zip(multigrid.field().as_flattened());
            let apart = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            // The worst cell may differ by ten times the tolerance.
            assert!(apart < 1e-5, "{apart}");
        }
        let n_steps = [&plain, &preconditioned].map(|report| report.deltas.len());
        assert!(n_steps[1] * 2 < n_steps[0], "{n_steps:?}");
    }
}
