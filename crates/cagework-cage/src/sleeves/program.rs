//! Quadratic programs with soft inequality constraints.

/// A sweep over all constraints follows this number of sweeps over those that are active.
const ACTIVE_SWEEPS: usize = 10;

/// Change of the unknowns in a sweep below which the solver stops.
const TOLERANCE: f64 = 1e-9;

/// Squared length below which the coefficients of a constraint are zero.
const MIN_NORM: f64 = 1e-14;

/// Constraints `sum of coefficient * unknown >= bound`, as a sparse matrix.
#[derive(Clone, Debug, Default)]
pub(super) struct Constraints {
    /// End of each constraint's entries. `[n_constraints]`
    ends: Vec<usize>,
    entries: Vec<(u32, f64)>,
    bounds: Vec<f64>,
    compliances: Vec<f64>,
}

impl Constraints {
    /// Adds a constraint with different unknowns. Its `compliance` is the violation per unit of force: with 0 it is
    /// exact.
    pub(super) fn push(&mut self, entries: &[(u32, f64)], bound: f64, compliance: f64) {
        self.entries.extend_from_slice(entries);
        self.ends.push(self.entries.len());
        self.bounds.push(bound);
        self.compliances.push(compliance);
    }

    /// Moves `q` to the minimum of `1/2 sum (q - q0)^2 / inverse_weight + 1/2 sum violation^2 / compliance`, where `q0`
    /// is the value of `q` before the call.
    ///
    /// Hildreth 1957, "A quadratic programming procedure": coordinate ascent in the dual, with one multiplier per
    /// constraint. Compliance keeps constraints that contradict each other bounded. Most sweeps visit only constraints
    /// with a positive multiplier.
    pub(super) fn solve(&self, q: &mut [f64], inverse_weights: &[f64], n_sweeps: usize) {
        let n = self.bounds.len();
        let start = |r: usize| if r == 0 { 0 } else { self.ends[r - 1] };
        let norm = |r: usize| {
            let entries = &self.entries[start(r)..self.ends[r]];
            entries.iter().map(|&(j, c)| c * c * inverse_weights[j as usize]).sum::<f64>()
        };
        let norms: Vec<f64> = (0..n).map(norm).collect();
        let mut multipliers = vec![0.0; n];
        let all: Vec<usize> = (0..n).filter(|&r| norms[r] > MIN_NORM).collect();
        let mut active: Vec<usize> = Vec::new();
        let mut wait = 0;
        for _ in 0..n_sweeps {
            let is_full = wait == 0;
            let mut largest: f64 = 0.0;
            for &r in if is_full { &all } else { &active } {
                let entries = &self.entries[start(r)..self.ends[r]];
                let value: f64 = entries.iter().map(|&(j, c)| c * q[j as usize]).sum();
                let force = self.bounds[r] - value - self.compliances[r] * multipliers[r];
                let step = (force / (norms[r] + self.compliances[r])).max(-multipliers[r]);
                if step != 0.0 {
                    multipliers[r] += step;
                    for &(j, c) in entries {
                        q[j as usize] += inverse_weights[j as usize] * c * step;
                    }
                    largest = largest.max(step.abs() * norms[r].sqrt());
                }
            }
            if is_full {
                active = all.iter().copied().filter(|&r| multipliers[r] > 0.0).collect();
                wait = ACTIVE_SWEEPS;
            }
            wait -= 1;
            if largest < TOLERANCE {
                if is_full {
                    return;
                }
                wait = 0;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The closest point to (2, 3) with x <= 1 and x + y <= 3 is (1, 2): both constraints are active.
    #[test]
    fn the_closest_point_of_a_polygon_is_found() {
        let mut constraints = Constraints::default();
        constraints.push(&[(0, -1.0)], -1.0, 0.0);
        constraints.push(&[(0, -1.0), (1, -1.0)], -3.0, 0.0);
        constraints.push(&[(1, 1.0)], -5.0, 0.0);
        let mut q = [2.0, 3.0];
        constraints.solve(&mut q, &[1.0, 1.0], 200);
        assert!((q[0] - 1.0).abs() < 1e-6 && (q[1] - 2.0).abs() < 1e-6, "{q:?}");
    }

    /// With weight 1 and equal compliances a, the constraints x >= 1 and x <= -1 cancel at 0. With x >= 1 alone, the
    /// minimum of x^2 / 2 + (1 - x)^2 / (2 a) is 1 / (1 + a).
    #[test]
    fn contradicting_constraints_stay_bounded() {
        let mut constraints = Constraints::default();
        constraints.push(&[(0, 1.0)], 1.0, 0.25);
        let mut q = [0.0];
        constraints.solve(&mut q, &[1.0], 100);
        assert!((q[0] - 0.8).abs() < 1e-9, "{q:?}");
        constraints.push(&[(0, -1.0)], 1.0, 0.25);
        let mut q = [0.0];
        constraints.solve(&mut q, &[1.0], 100);
        assert!(q[0].abs() < 1e-6, "{q:?}");
    }
}
