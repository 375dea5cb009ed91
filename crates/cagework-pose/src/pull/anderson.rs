//! Anderson's acceleration of a fixed point iteration (Peng et al. 2018, "Anderson acceleration for geometry optimization").

use nalgebra::{DMatrix, DVector};

/// Iterations that are remembered.
const WINDOW: usize = 6;

/// A residual that grows by more than this forgets them.
const GROWTH: f64 = 2.0;

/// Keeps the small system solvable, over its trace.
const RIDGE: f64 = 1e-10;

/// The last iterates: what the map made of them, and how far that moved them.
#[derive(Default)]
pub(super) struct Anderson {
    /// Residual and image, oldest first.
    last: Vec<(DVector<f64>, DVector<f64>)>,
}

impl Anderson {
    /// Begins anew: the map has changed.
    pub(super) fn forget(&mut self) {
        self.last.clear();
    }

    /// A better next iterate than `image`, which the map made of `from`.
    pub(super) fn next(&mut self, from: &DVector<f64>, image: DVector<f64>) -> DVector<f64> {
        let residual = &image - from;
        if self.last.last().is_some_and(|(before, _)| residual.norm() > GROWTH * before.norm()) {
            self.last.clear();
        }
        self.last.push((residual, image));
        if self.last.len() > WINDOW + 1 {
            self.last.remove(0);
        }
        let (residual, image) = &self.last[self.last.len() - 1];
        let steps: Vec<DVector<f64>> = self.last.windows(2).map(|pair| &pair[1].0 - &pair[0].0).collect();
        let n = steps.len();
        let mut matrix = DMatrix::from_fn(n, n, |i, j| steps[i].dot(&steps[j]));
        let ridge = RIDGE * matrix.trace() + f64::MIN_POSITIVE;
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

    /// `x -> A x + b` converges by 0.95 a step; accelerated, a map of two dimensions is at its fixed point in four.
    #[test]
    fn a_linear_map_ends_after_as_many_steps_as_it_has_dimensions() {
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
