//! Fits a cage so that the model meets targets for all vertices (a model of the same topology) or for landmarks.

use glam::{DVec3, Vec3};
use nalgebra::{DMatrix, DVector};

use super::anderson::Anderson;
use super::drag::{CAGE_WEIGHT, REGULARISATION, flat};
use super::energy::Pull;
use super::frame::turned;
use super::{MAX_CONTROLS, PullError};
use crate::parts::Motion;
use cagework_core::deform::{deform_bound, deform_vertices};
use cagework_core::frames::Frames;
use cagework_core::weights::Weights;

/// Range of lambda, the weight of the energy E ([`super`]), if it is estimated from the noise of the targets. With the
/// smallest value, targets without noise are met within 1e-5 of the model's size.
const LAMBDA_RANGE: [f64; 2] = [1e-10, 1e-2];

/// Limit on the rounds that estimate lambda.
const MAX_LAMBDA_ROUNDS: usize = 8;

/// The estimate of lambda has converged if successive values differ by less than this factor.
const LAMBDA_RATIO: f64 = 1.1;

/// Smallest number of points per cage vertex with which the noise can be estimated.
const MIN_POINTS_PER_VERTEX: usize = 4;

/// Value of lambda with fewer points per cage vertex. Landmarks are then met within about 1e-3 of the model's size, and
/// the model bends as little as possible between them.
const LANDMARK_LAMBDA: f64 = 1e-5;

/// Limit on local-global steps.
const MAX_STEPS: usize = 2000;

/// Local-global steps stop when the cage moves by less than this in a step, as a fraction of the model's size.
const MIN_STEP_MOVE: f64 = 1e-8;

/// Limit on the fits of a model with bones.
const MAX_FITS: usize = 20;

/// These fits stop when no shifted target changes by more than this, as a fraction of the model's size. Each fit makes
/// the change about ten times smaller.
const MIN_TARGET_CHANGE: f64 = 1e-5;

/// Options of [`Pull::fit`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FitOptions {
    /// Weight of the energy E ([`crate::pull`]) against the mean squared distance from the targets (divided by the
    /// model's size squared), at least 0. `None`: the most likely value `n d / (N E)` for N points, a cage of n vertices
    /// and the variance d of the noise, which is estimated as the mean squared distance times `N / (N - n)`; limited to
    /// 1e-10 to 1e-2. With fewer than four points per cage vertex, 1e-5.
    pub lambda: Option<f64>,
}

/// A fitted pose. Distances are fractions of the model's size, the diagonal of its box.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Positions of the cage vertices and inner controls. `[n]`, object units
    pub cage: Vec<DVec3>,
    /// Weight lambda of the energy in the fit: the value in the options, or its estimate.
    pub lambda: f64,
    /// Energy of the pose: mean squared distance of the model's gradients from rotations, plus 0.1 times that of the
    /// cage's edges.
    pub energy: f64,
    /// Root of the mean squared distance from the targets.
    pub rms: f64,
    /// The largest distance from a target.
    pub largest: f64,
    /// Number of local-global steps that ran.
    pub steps: usize,
    /// Whether the steps converged.
    pub is_settled: bool,
}

/// The data term `sum_k m_k |W_k c - t_k|^2`, divided by the model's size squared, as normal equations.
struct Goals<'a> {
    weights: &'a Weights,
    shares: &'a [f64],
    to: &'a [Vec3],
    total: f64,
    /// Matrix, `[n, n]`, and right-hand side, `[n, 3]`.
    matrix: DMatrix<f64>,
    right: DMatrix<f64>,
}

impl Pull {
    /// Share of the model's area at each vertex, for use as `shares` of [`Self::fit`] with targets for all vertices.
    /// `[n_vertices]`
    #[must_use]
    pub fn areas(&self) -> &[f64] {
        &self.probes.areas
    }

    /// Minimises `sum_k m_k |W_k c - t_k|^2 / size^2 + lambda E(c)`. E is the first sum of the energy of a pull
    /// ([`crate::pull`]), with the rest shape as reference.
    ///
    /// `weights`: rows of the points (vertices or landmarks), `[n_points, n_columns]`, and the `frames` of their bind.
    /// `shares`: weight `m_k` of each point, scaled to sum to 1; a point with the share 0 is ignored. `to`: targets,
    /// object units.
    ///
    /// The solver needs positions that are linear in the cage ([`Frames::folded`]). Rotated bones and constant offsets
    /// add a part that is not linear. It is computed in the fitted pose and subtracted from the targets, and the fit is
    /// repeated until this part no longer changes.
    ///
    /// # Errors
    /// [`PullError`]: the weights belong to another cage, lengths differ, no point has a target, or numbers are out of
    /// range.
    pub fn fit(
        &self,
        weights: &Weights,
        frames: &Frames,
        shares: &[f64],
        to: &[Vec3],
        options: FitOptions,
    ) -> Result<Fit, PullError> {
        let (rows, columns, n) = (weights.n_rows(), weights.n_columns(), self.n_cage());
        if columns != n + frames.n_columns() || !frames.fits(n) {
            let columns = columns.saturating_sub(frames.n_columns());
            return Err(PullError::Shape { rows, columns, vertices: shares.len(), controls: n });
        }
        let linear = frames.folded(weights);
        let mut shifted = to.to_vec();
        let mut fitted = self.fit_linear(&linear, shares, &shifted, options)?;
        if !frames.is_used() {
            return Ok(fitted);
        }
        for _ in 1..MAX_FITS {
            let pose: Vec<Vec3> = fitted.cage.iter().map(|p| p.as_vec3()).collect();
            let exact = deform_bound(weights, frames, &pose);
            let pairs = exact.iter().zip(deform_vertices(&linear, &pose));
            let next: Vec<Vec3> =
                to.iter().zip(pairs).map(|(to, (at, linear))| *to - (*at - linear)).collect();
            let pairs = next.iter().zip(&shifted).zip(shares).filter(|(_, share)| **share > 0.0);
            let change = pairs.map(|((a, b), _)| f64::from(a.distance(*b))).fold(0.0, f64::max);
            if change <= MIN_TARGET_CHANGE * self.size || !change.is_finite() {
                return Ok(fitted);
            }
            shifted = next;
            fitted = self.fit_linear(&linear, shares, &shifted, options)?;
        }
        Ok(Fit { is_settled: false, ..fitted })
    }

    fn fit_linear(
        &self,
        weights: &Weights,
        shares: &[f64],
        to: &[Vec3],
        options: FitOptions,
    ) -> Result<Fit, PullError> {
        let goals = self.goals(weights, shares, to)?;
        let used = shares.iter().filter(|&&share| share > 0.0).count();
        let n = self.n_cage();
        let value = |value| PullError::Value { what: "lambda", value, range: "a number of at least 0" };
        if let Some(lambda) = options.lambda {
            if !(0.0..f64::MAX).contains(&lambda) {
                return Err(value(lambda));
            }
            return self.fit_with(&goals, lambda);
        }
        if used < MIN_POINTS_PER_VERTEX * n {
            return self.fit_with(&goals, LANDMARK_LAMBDA);
        }
        let [least, most] = LAMBDA_RANGE;
        let mut fitted = self.fit_with(&goals, least)?;
        for _ in 0..MAX_LAMBDA_ROUNDS {
            // The n degrees of freedom of the cage absorb part of the noise: `used - n` gives an unbiased variance.
            let noise = fitted.rms * fitted.rms * used as f64 / (used - n) as f64;
            let lambda = (noise * n as f64 / (used as f64 * fitted.energy)).clamp(least, most);
            let ratio = lambda / fitted.lambda;
            if (1.0 / LAMBDA_RATIO..LAMBDA_RATIO).contains(&ratio) {
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
        if n > MAX_CONTROLS {
            return Err(PullError::Controls { controls: n });
        }
        if columns != n || shares.len() != rows {
            return Err(PullError::Shape { rows, columns, vertices: shares.len(), controls: n });
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

    fn fit_with(&self, goals: &Goals<'_>, lambda: f64) -> Result<Fit, PullError> {
        let n = self.n_cage();
        let own = self.matrix(CAGE_WEIGHT);
        let regular = REGULARISATION * own.trace() / n as f64;
        // If lambda is 0 and no point depends on some vertex, a tiny weight of the energy keeps the matrix regular.
        let energy_weight = lambda.max(f64::EPSILON);
        let mut matrix = &goals.matrix + energy_weight * &own;
        for i in 0..n {
            matrix[(i, i)] += energy_weight * regular;
        }
        let factors = matrix.cholesky().ok_or(PullError::Singular)?;
        let rest = flat(&self.cage);
        let moments = self.moments(&self.references(&self.cage), CAGE_WEIGHT);
        let start = flat(&self.align_rest(goals));
        let columns = |flat: &DVector<f64>| DMatrix::from_column_slice(n, 3, flat.as_slice());
        let constant = &goals.right + energy_weight * regular * columns(&start);
        let (mut cage, mut anderson) = (start, Anderson::default());
        let (mut steps, mut is_settled) = (0, false);
        while steps < MAX_STEPS && !is_settled {
            let right = energy_weight * turned(&moments, &cage, self.n_groups()) + &constant;
            let image = DVector::from_column_slice(factors.solve(&right).as_slice());
            if image.iter().any(|x| !x.is_finite()) {
                return Err(PullError::Singular);
            }
            is_settled = (&image - &cage).amax() <= MIN_STEP_MOVE * self.size;
            cage = if is_settled { image } else { anderson.next(&cage, image) };
            steps += 1;
        }
        let quadratic = |c: &DVector<f64>| columns(c).dot(&(&own * columns(c)));
        let turned = turned(&moments, &cage, self.n_groups());
        let energy = quadratic(&cage) - 2.0 * columns(&cage).dot(&turned) + quadratic(&rest);
        let at = |i: usize| DVec3::new(cage[i], cage[n + i], cage[2 * n + i]);
        let cage: Vec<DVec3> = (0..n).map(at).collect();
        let (rms, largest) = goals.distances(&cage);
        Ok(Fit {
            lambda,
            energy: energy.max(f64::EPSILON),
            rms: rms / self.size,
            largest: largest / self.size,
            cage,
            steps,
            is_settled,
        })
    }

    /// Moves the vertices of the rest cage rigidly to fit the targets best. The iteration starts from them: the first
    /// rotations are computed from these positions.
    fn align_rest(&self, goals: &Goals<'_>) -> Vec<DVec3> {
        let points = goals.used().map(|(row, _, to)| {
            let at = place(row, &self.cage);
            (at, to.as_dvec3() - at)
        });
        let motion = Motion::fit(&points.collect::<Vec<_>>());
        self.cage.iter().map(|&c| c + motion.by(c)).collect()
    }
}

impl<'a> Goals<'a> {
    fn used(&self) -> impl Iterator<Item = ((&'a [u32], &'a [f32]), f64, Vec3)> + use<'a> {
        let all = self.weights.rows().zip(self.shares).zip(self.to);
        all.filter(|((_, share), _)| **share > 0.0).map(|((row, &share), &to)| (row, share, to))
    }

    /// Computes the root mean squared and the largest distance from the targets, object units.
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
