//! The pose that brings a model to a target: all of its vertices where the two have the same, or landmarks where they do not.

use glam::{DVec3, Vec3};
use nalgebra::{DMatrix, DVector};

use super::anderson::Anderson;
use super::drag::{CAGE, REGULAR, flat};
use super::energy::Pull;
use super::frame::turned;
use super::{MAX_CAGE, PullError};
use crate::parts::Motion;
use cagework_core::weights::Weights;

/// Least and most of what the energy weighs where it is chosen by the noise: the least leaves a target without noise within 1e-5 of
/// the model's size.
const LAMBDAS: [f64; 2] = [1e-10, 1e-2];

/// Rounds of that choice, and the change below which it stands.
const ROUNDS: usize = 8;
const STANDS: f64 = 1.1;

/// Points for each of the cage's vertices from which on the noise can be told from the shape.
const ENOUGH: usize = 4;

/// What the energy weighs with fewer points: they are met within about a thousandth of the model's size, and between them the model
/// bends as little as it can.
const OF_LANDMARKS: f64 = 1e-5;

/// Steps of rotations and of the cage that fits them, and the movement, over the model's size, that ends them.
const STEPS: usize = 2000;
const SETTLED: f64 = 1e-8;

/// How a pose is fitted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FitOptions {
    /// What the energy weighs, over the mean squared distance from the targets (over the model's size); at least 0. None: as much as
    /// the distance that is left says of noise, `n d / (N E)` for N points with the mean squared distance d and a cage of n vertices with
    /// the energy E, which makes the pose the most likely one; with fewer than four points for each cage vertex, 1e-5.
    pub lambda: Option<f64>,
}

/// A pose that was fitted. Lengths are shares of the model's size, the diagonal of its box.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// Cage vertices and controls inside. `[n]`, object units
    pub cage: Vec<DVec3>,
    /// What the energy weighed.
    pub lambda: f64,
    /// Energy of the pose: the mean squared distance of the model's gradients from rotations, and a tenth of the cage's own.
    pub energy: f64,
    /// Root of the mean squared distance from the targets.
    pub rms: f64,
    /// The largest distance from a target.
    pub largest: f64,
    /// Steps that were taken.
    pub steps: usize,
    /// Whether it moved no more at the end.
    pub is_settled: bool,
}

/// `sum_k m_k |W_k c - t_k|^2`, over the model's size squared, as normal equations.
struct Goals<'a> {
    weights: &'a Weights,
    shares: &'a [f64],
    to: &'a [Vec3],
    total: f64,
    /// `[n, n]`, `[n, 3]`
    matrix: DMatrix<f64>,
    right: DMatrix<f64>,
}

impl Pull {
    /// Share of the model's area at each vertex: how much it counts in a fit of all of them. `[n_vertices]`
    #[must_use]
    pub fn areas(&self) -> &[f64] {
        &self.probes.areas
    }

    /// The pose that minimises `sum_k m_k |W_k c - t_k|^2 / size^2 + lambda E(c)`, with E the energy of a pull (see the module) without
    /// what stays, from the shape at rest.
    ///
    /// `weights`: of the points, `[n_points, n]`: vertices of the model, or landmarks. `shares`: how much each counts, made to sum to
    /// 1; 0 leaves it out. `to`: where each should be, object units.
    ///
    /// # Errors
    /// [`PullError`]: weights of another cage, not one target for each point, none at all, numbers out of range.
    pub fn fit(
        &self,
        weights: &Weights,
        shares: &[f64],
        to: &[Vec3],
        options: FitOptions,
    ) -> Result<Fitted, PullError> {
        let goals = self.goals(weights, shares, to)?;
        let used = shares.iter().filter(|&&share| share > 0.0).count();
        let n = self.n_cage();
        let value = |value| PullError::Value { what: "lambda", value, range: "a number from 0 on" };
        if let Some(lambda) = options.lambda {
            if !(0.0..f64::MAX).contains(&lambda) {
                return Err(value(lambda));
            }
            return self.fit_with(&goals, lambda);
        }
        if used < ENOUGH * n {
            return self.fit_with(&goals, OF_LANDMARKS);
        }
        let [least, most] = LAMBDAS;
        let mut fitted = self.fit_with(&goals, least)?;
        for _ in 0..ROUNDS {
            // The fit itself has taken a share of the noise.
            let noise = fitted.rms * fitted.rms * used as f64 / (used - n) as f64;
            let lambda = (noise * n as f64 / (used as f64 * fitted.energy)).clamp(least, most);
            let ratio = lambda / fitted.lambda;
            if (1.0 / STANDS..STANDS).contains(&ratio) {
                break;
            }
            fitted = self.fit_with(&goals, lambda)?;
        }
        Ok(fitted)
    }

    fn goals<'a>(
        &self,
        weights: &'a Weights,
        shares: &'a [f64],
        to: &'a [Vec3],
    ) -> Result<Goals<'a>, PullError> {
        let (rows, columns, n) = (weights.n_rows(), weights.n_columns(), self.n_cage());
        if n > MAX_CAGE {
            return Err(PullError::Cage { cage: n });
        }
        if columns != n || shares.len() != rows {
            return Err(PullError::Shape { rows, columns, vertices: shares.len(), cage: n });
        }
        if to.len() != rows {
            return Err(PullError::Targets { given: to.len(), points: rows });
        }
        let used = || shares.iter().zip(to).filter(|(share, _)| **share > 0.0);
        if let Some((_, at)) = used().find(|(_, at)| !at.is_finite()) {
            let value = f64::from(at.to_array().into_iter().find(|x| !x.is_finite()).unwrap_or(f32::NAN));
            return Err(PullError::Value { what: "a target", value, range: "finite" });
        }
        let total: f64 = used().map(|(share, _)| share).sum();
        if !(total > 0.0 && total.is_finite()) {
            return Err(PullError::NoTarget);
        }
        let scale = 1.0 / (total * self.size * self.size);
        let (matrix, right) = (DMatrix::zeros(n, n), DMatrix::zeros(n, 3));
        let mut goals = Goals { weights, shares, to, total, matrix, right };
        for ((indices, data), share, to) in goals.used() {
            for (&i, &a) in indices.iter().zip(data) {
                let heavy = share * scale * f64::from(a);
                for (&j, &b) in indices.iter().zip(data) {
                    goals.matrix[(j as usize, i as usize)] += heavy * f64::from(b);
                }
                (0..3).for_each(|x| goals.right[(i as usize, x)] += heavy * f64::from(to[x]));
            }
        }
        Ok(goals)
    }

    fn fit_with(&self, goals: &Goals<'_>, lambda: f64) -> Result<Fitted, PullError> {
        let n = self.n_cage();
        let own = self.matrix(CAGE);
        let regular = REGULAR * own.trace() / n as f64;
        // Not even lambda 0 leaves a vertex nowhere.
        let energy_weight = lambda.max(f64::EPSILON);
        let mut matrix = &goals.matrix + energy_weight * &own;
        for i in 0..n {
            matrix[(i, i)] += energy_weight * regular;
        }
        let factors = matrix.cholesky().ok_or(PullError::Singular)?;
        let rest = flat(&self.cage);
        let moments = self.moments(&self.references(&self.cage), CAGE);
        let start = flat(&self.brought(goals));
        let columns = |flat: &DVector<f64>| DMatrix::from_column_slice(n, 3, flat.as_slice());
        let constant = &goals.right + energy_weight * regular * columns(&start);
        let (mut cage, mut anderson) = (start, Anderson::default());
        let (mut steps, mut is_settled) = (0, false);
        while steps < STEPS && !is_settled {
            let right = energy_weight * turned(&moments, &cage, self.n_groups()) + &constant;
            let image = DVector::from_column_slice(factors.solve(&right).as_slice());
            if image.iter().any(|x| !x.is_finite()) {
                return Err(PullError::Singular);
            }
            is_settled = (&image - &cage).amax() <= SETTLED * self.size;
            cage = if is_settled { image } else { anderson.next(&cage, image) };
            steps += 1;
        }
        let quadratic = |c: &DVector<f64>| columns(c).dot(&(&own * columns(c)));
        let turned = turned(&moments, &cage, self.n_groups());
        let energy = quadratic(&cage) - 2.0 * columns(&cage).dot(&turned) + quadratic(&rest);
        let at = |i: usize| DVec3::new(cage[i], cage[n + i], cage[2 * n + i]);
        let cage: Vec<DVec3> = (0..n).map(at).collect();
        let (rms, largest) = goals.distances(&cage);
        Ok(Fitted {
            lambda,
            energy: energy.max(f64::EPSILON),
            rms: rms / self.size,
            largest: largest / self.size,
            cage,
            steps,
            is_settled,
        })
    }

    /// The cage at rest, moved as a whole to where the points should be: rotations are looked for from there.
    fn brought(&self, goals: &Goals<'_>) -> Vec<DVec3> {
        let points = goals.used().map(|(row, _, to)| {
            let at = place(row, &self.cage);
            (at, to.as_dvec3() - at)
        });
        let motion = Motion::of(&points.collect::<Vec<_>>());
        self.cage.iter().map(|&c| c + motion.by(c)).collect()
    }
}

impl<'a> Goals<'a> {
    fn used(&self) -> impl Iterator<Item = ((&'a [u32], &'a [f32]), f64, Vec3)> + use<'a> {
        let all = self.weights.rows().zip(self.shares).zip(self.to);
        all.filter(|((_, share), _)| **share > 0.0).map(|((row, &share), &to)| (row, share, to))
    }

    /// Root of the mean squared distance from the targets, and the largest one, object units.
    fn distances(&self, cage: &[DVec3]) -> (f64, f64) {
        let (mut sum, mut largest) = (0.0, 0.0_f64);
        for (row, share, to) in self.used() {
            let distance = place(row, cage).distance(to.as_dvec3());
            sum += share * distance * distance;
            largest = largest.max(distance);
        }
        ((sum / self.total).sqrt(), largest)
    }
}

fn place((indices, data): (&[u32], &[f32]), cage: &[DVec3]) -> DVec3 {
    indices.iter().zip(data).map(|(&i, &w)| f64::from(w) * cage[i as usize]).sum()
}
