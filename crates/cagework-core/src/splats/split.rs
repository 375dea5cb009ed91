//! Splits of splats that bend: one ellipsoid cannot show a bend, a row of shorter ones can.
//!
//! Source of the idea: Huang et al. 2024, "GSDeformer: Direct, Real-time and Extensible Cage-based Deformation for 3D
//! Gaussian Splatting", which splits splats whose axes bend.
//!
//! Changes: the parts overlap and their opacities follow from alpha blending, so that the undeformed splat looks the
//! same. A splat shows the alpha `a exp(-x^2 / 2)` at `x` standard deviations along its longest axis. The `n` parts are
//! at `x_k = 1.2 s (k - (n - 1) / 2)`, have the standard deviation `s` along this axis, the other two unchanged, and the
//! opacities `a_k` that solve `1 - prod_k (1 - a_k exp(-(x_j - x_k)^2 / (2 s^2))) = a exp(-x_j^2 / 2)` at each centre
//! `x_j`: eight sweeps of Gauss-Seidel, clamped to 0 to 1. For `s` from 0.3 to 0.7 and `a` from 0.1 to 0.99, the alpha
//! differs by at most 2.3 % of the largest one, its integral by at most 1.2 % and its variance by at most 7 %.

use super::{MAX_FIRST_ORDER_ERROR, Splats, n_harmonics};
use crate::field::Field;

/// Distance of neighbouring parts, in their standard deviations.
const SPACING: f32 = 1.2;
/// Standard deviation of a part, as a fraction of the whole splat's. With more, two parts would almost coincide; with
/// less, parts could exceed the limit of 13.
const SIZES: [f32; 2] = [0.3, 0.7];
/// Distance from the centre that the parts cover at least, standard deviations of the whole splat.
const REACH: f32 = 2.0;
/// Sweeps that solve for the opacities.
const SWEEPS: usize = 8;

/// Splats, some of which were split.
#[derive(Clone, Debug, PartialEq)]
pub struct SplitSplats {
    /// All splats; the parts of a splat are at its place in the order.
    pub splats: Splats,
    /// Number of splats that bend too much for an ellipsoid.
    pub n_bent: usize,
    /// Number of splats that were split.
    pub n_split: usize,
}

impl Splats {
    /// Splits, at rest, the splats that a field bends by more than [`MAX_FIRST_ORDER_ERROR`], along their longest axis.
    /// The bend of a part is proportional to its length, so the parts are shorter by this limit divided by the error,
    /// between 0.3 and 0.7. `None` if no splat bends.
    ///
    /// The result has at most twice as many splats: splats that bend most are split first.
    #[must_use]
    pub fn split(&self, field: &Field) -> Option<SplitSplats> {
        let errors = self.first_order_errors(field);
        let is_bent = |s: &u32| errors[*s as usize] > MAX_FIRST_ORDER_ERROR;
        // Sort arrays of integers: the wasm module contains the sort for this type anyway. The bits of positive numbers
        // ascend as the numbers do.
        let order = |s: u32| [u32::MAX - errors[s as usize].to_bits(), s, 0];
        let mut bent: Vec<[u32; 3]> = (0..self.len() as u32).filter(is_bent).map(order).collect();
        bent.sort_unstable();
        let (n_bent, mut left) = (bent.len(), self.len());
        let mut sizes = vec![None; self.len()];
        let mut n_split = 0;
        for [_, splat, _] in bent {
            let size = (MAX_FIRST_ORDER_ERROR / errors[splat as usize]).clamp(SIZES[0], SIZES[1]);
            let Some(rest) = left.checked_sub(n_parts(size) - 1) else { break };
            (left, sizes[splat as usize]) = (rest, Some(size));
            n_split += 1;
        }
        if n_split == 0 {
            return None;
        }
        Some(SplitSplats { splats: self.in_parts(|splat| sizes[splat]), n_bent, n_split })
    }

    /// Replaces splats by parts along their longest axis, which look the same. `size`: standard deviation of the parts of
    /// a splat along this axis, as a fraction of the splat's, 0.3 to 0.7; `None` for a splat that stays.
    #[must_use]
    pub fn in_parts(&self, size: impl Fn(usize) -> Option<f32>) -> Self {
        let n = (0..self.len()).map(|splat| size(splat).map_or(1, n_parts)).sum();
        let mut splats = Self {
            positions: Vec::with_capacity(n),
            scales: Vec::with_capacity(n),
            rotations: Vec::with_capacity(n),
            opacities: Vec::with_capacity(n),
            colors: Vec::with_capacity(n),
            degree: self.degree,
            harmonics: Vec::with_capacity(n * n_harmonics(self.degree)),
        };
        for splat in 0..self.len() {
            self.push_parts(splat, size(splat), &mut splats);
        }
        splats
    }

    /// Appends the parts of a splat, whose standard deviation along the longest axis is `size` times the splat's; the
    /// splat itself without a size.
    fn push_parts(&self, splat: usize, size: Option<f32>, to: &mut Self) {
        let (axes, mut scales) = (self.axes(splat), self.scales[splat]);
        let longest = scales.max_position();
        scales[longest] *= size.unwrap_or(1.0);
        for (at, opacity) in parts(self.opacities[splat], size) {
            to.positions.push(self.positions[splat] + at * axes.col(longest));
            to.scales.push(scales);
            to.rotations.push(self.rotations[splat]);
            to.opacities.push(opacity);
            to.colors.push(self.colors[splat]);
            to.harmonics.extend_from_slice(self.harmonics_of(splat));
        }
    }
}

/// Number of parts of the given size: odd, so that one is at the centre.
fn n_parts(size: f32) -> usize {
    2 * (REACH / (SPACING * size)).ceil() as usize + 1
}

/// Places, in standard deviations of the whole splat, and opacities of its parts.
fn parts(opacity: f32, size: Option<f32>) -> Vec<(f32, f32)> {
    let Some(size) = size else { return vec![(0.0, opacity)] };
    let n = n_parts(size);
    let place = |k: usize| SPACING * size * (k as f32 - (n / 2) as f32);
    let gauss = |x: f32| (-0.5 * x * x).exp();
    let mut opacities = vec![0.0_f32; n];
    for _ in 0..SWEEPS {
        for k in 0..n {
            let passed = |j: usize| 1.0 - opacities[j] * gauss((place(j) - place(k)) / size);
            let others: f32 = (0..n).filter(|&j| j != k).map(passed).product();
            let wanted = 1.0 - opacity * gauss(place(k));
            opacities[k] = (1.0 - wanted / others.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        }
    }
    (0..n).map(|k| (place(k), opacities[k])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};

    /// Alpha along the longest axis, its integral and its variance, by sums over 10 standard deviations.
    fn alpha(parts: &[(f32, f32)], size: f32) -> (Vec<f64>, f64, f64) {
        let at = |k: i32| f64::from(k) / 100.0;
        let value = |k: i32| {
            let passed = |&(place, opacity): &(f32, f32)| {
                let x = (at(k) - f64::from(place)) / f64::from(size);
                1.0 - f64::from(opacity) * (-0.5 * x * x).exp()
            };
            1.0 - parts.iter().map(passed).product::<f64>()
        };
        let values: Vec<f64> = (-500..=500).map(value).collect();
        let sum: f64 = values.iter().sum();
        let second: f64 = (-500..=500).zip(&values).map(|(k, v)| v * at(k) * at(k)).sum();
        (values, sum, second / sum)
    }

    #[test]
    fn parts_keep_mass_covariance_and_look() {
        for opacity in [0.1, 0.5, 0.99_f32] {
            let (whole, mass, variance) = alpha(&[(0.0, opacity)], 1.0);
            for size in [0.3, 0.4, 0.5, 0.6, 0.7_f32] {
                let all = parts(opacity, Some(size));
                assert!(all.iter().all(|(_, a)| (0.0..=1.0).contains(a)));
                let (split, own_mass, own_variance) = alpha(&all, size);
                let worst = whole.iter().zip(&split).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(worst < 0.023 * f64::from(opacity), "{opacity} {size}: {worst}");
                assert!((own_mass / mass - 1.0).abs() < 0.012, "{opacity} {size}: {}", own_mass / mass);
                assert!((own_variance / variance - 1.0).abs() < 0.071, "{own_variance}");
            }
        }
    }

    #[test]
    fn parts_lie_along_the_longest_axis_and_keep_the_other_two() {
        let turn = Quat::from_rotation_z(0.5);
        let splats = Splats {
            positions: vec![Vec3::new(1.0, 2.0, 3.0)],
            scales: vec![Vec3::new(0.1, 0.8, 0.2)],
            rotations: vec![turn],
            opacities: vec![0.9],
            colors: vec![Vec3::ONE],
            degree: 1,
            harmonics: vec![Vec3::X, Vec3::Y, Vec3::Z],
        };
        let split = splats.in_parts(|_| Some(0.5));
        assert_eq!((split.len(), split.harmonics.len()), (9, 27));
        let along = turn * Vec3::Y;
        for (at, scale) in split.positions.iter().zip(&split.scales) {
            let by = *at - splats.positions[0];
            assert!((by - by.dot(along) * along).length() < 1e-6);
            assert_eq!(*scale, Vec3::new(0.1, 0.4, 0.2));
        }
        assert_eq!(split.positions[4], splats.positions[0]);
    }
}
