//! Anderson acceleration of a fixed-point iteration (Peng et al. 2018, "Anderson acceleration for geometry
//! optimization").

use nalgebra::{DMatrix, DVector};

/// Number of previous iterates that are combined.
const HISTORY: usize = 6;

/// The history is cleared when the residual grows by more than this factor.
const MAX_GROWTH: f64 = 2.0;

/// Regularisation of the least-squares system, as a fraction of its trace.
const REGULARISATION: f64 = 1e-10;

/// History of a fixed-point iteration `x -> g(x)`.
#[derive(Default)]
pub(super) struct Anderson {
    /// Residual `g(x) - x` and image `g(x)` of each stored iterate, oldest first.
    last: Vec<(DVector<f64>, DVector<f64>)>,
}

impl Anderson {
    /// Clears the history. Call when the map changes.
    pub(super) fn forget(&mut self) {
        self.last.clear();
    }

    /// Computes the accelerated next iterate after `from`, whose image under the map is `image`.
    pub(super) fn next(&mut self, from: &DVector<f64>, image: DVector<f64>) -> DVector<f64> {
        let residual = &image - from;
        if self.last.last().is_some_and(|(before, _)| residual.norm() > MAX_GROWTH * before.norm()) {
            self.last.clear();
        }
        self.last.push((residual, image));
        if self.last.len() > HISTORY + 1 {
            self.last.remove(0);
        }
        let (residual, image) = &self.last[self.last.len() - 1];
        let steps: Vec<DVector<f64>> = self.last.windows(2).map(|pair| &pair[1].0 - &pair[0].0).collect();
        let n = steps.len();
        let mut matrix = DMatrix::from_fn(n, n, |i, j| steps[i].dot(&steps[j]));
        let ridge = REGULARISATION * matrix.trace() + f64::MIN_POSITIVE;
        for i in 0..n {
            matrix[(i, i)] += ridge;
        }
        let Some(factor) = matrix.cholesky() else { return image.clone() };
        let shares = factor.solve(&DVector::from_fn(n, |i, _| steps[i].dot(residual)));
        let mut next = image.clone();
        for (pair, share) in self.last.windows(2).zip(shares.iter()) {
            next -= (&pair[1].1 - &pair[0].1) * *share;
        }
        if next.iter().all(|x| x.is_finite()) { next } else { image.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without acceleration, `x -> A x + b` converges by a factor of 0.95 per step. Anderson acceleration finds the
    /// fixed point as soon as the differences between iterates span both dimensions, which takes at most four steps.
    #[test]
    fn a_linear_map_converges_in_as_many_steps_as_it_has_dimensions() {
        let a = DMatrix::from_row_slice(2, 2, &[0.95, 0.0, 0.0, -0.5]);
        let b = DVector::from_vec(vec![1.0, 3.0]);
        let fixed = DVector::from_vec(vec![20.0, 2.0]);
        let mut x = DVector::zeros(2);
        let mut anderson = Anderson::default();
        for _ in 0..4 {
            let image = &a * &x + &b;
            x = anderson.next(&x, image);
        }
        assert!((x - fixed).norm() < 1e-6);
    }
}
