//! Restores `sum w = 1` and `sum w c = v` after weights were dropped or rounded.
//!
//! The correction is the smallest one relative to the weights themselves: among all corrections d of the row w that
//! restore the four sums, it minimises `sum d_i^2 / w_i`. Its solution is `d_i = w_i phi_i . lambda` with the 4 x 4
//! system `(sum w_i phi_i phi_i^T) lambda = e_1 - sum w_i phi_i`, `phi_i = (1, (c_i - v) / s)`, s the cage's diagonal.
//! Zero weights stay zero, so the row stays as sparse as it was. Each weight is multiplied by a factor that is linear in
//! the control's position: next to 1, and the row not negative, as long as the sums miss by little. Nothing here bounds the
//! factors; who drops weights must look at them.

use glam::{DMat4, DVec3, DVec4};

use crate::controls::Controls;
use crate::solve::rows::{LANES, Row, ZERO};

/// Added to the diagonal of the 4 x 4 system, relative to its trace: on a face of the cage all weights lie in a plane
/// and the system is singular in its normal direction, along which there is nothing to correct.
const RIDGE: f64 = 1e-7;

/// What a row of weights adds up to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sums {
    /// Its sum.
    pub sum: f64,
    /// Distance between `sum w c` and a target over the cage's diagonal.
    pub miss: f64,
}

impl Sums {
    /// How far it is from a row that sums to 1 and meets the target.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.miss.max((self.sum - 1.0).abs())
    }
}

/// The controls as columns of weights: rows of lanes, as batches are.
#[derive(Clone, Debug)]
pub struct Columns {
    /// Positions from the cage's centre over its diagonal. `[3][n_batches]`
    scaled: [Vec<Row>; 3],
    /// The same as f64, to measure with.
    exact: [Vec<[f64; LANES]>; 3],
    center: DVec3,
    diagonal: f64,
}

/// Sums over a row: 1; x, y, z; xx, xy, xz, yy, yz, zz of the columns' distances from the target, each weighted.
type Moments = [f64; 10];

impl Columns {
    /// Columns at rest.
    #[must_use]
    pub fn new(controls: Controls<'_>) -> Self {
        let surface = controls.surface();
        let (center, diagonal) = (surface.bounds().center().as_dvec3(), f64::from(surface.diagonal()));
        let exact = [0, 1, 2].map(|axis| {
            controls
                .rest()
                .chunks(LANES)
                .map(|batch| {
                    let mut lanes = [0.0; LANES];
                    for (lane, p) in lanes.iter_mut().zip(batch) {
                        *lane = (f64::from(p[axis]) - center[axis]) / diagonal;
                    }
                    lanes
                })
                .collect::<Vec<_>>()
        });
        let scaled = exact.each_ref().map(|e| e.iter().map(|lanes| lanes.map(|x| x as f32)).collect());
        Self { scaled, exact, center, diagonal }
    }

    /// Batches of lanes that a row has.
    #[must_use]
    pub fn n_batches(&self) -> usize {
        self.exact[0].len()
    }

    /// A point in the columns' units.
    #[must_use]
    pub fn scale(&self, point: DVec3) -> DVec3 {
        (point - self.center) / self.diagonal
    }

    /// What a row adds up to. `row`: `[n_batches]`.
    #[inline(always)]
    #[must_use]
    pub fn sums(&self, row: &[Row], target: DVec3) -> Sums {
        let (sum, point) = self.combined(row);
        Sums { sum, miss: (point - target).length() }
    }

    /// (sum of a row, where it puts its vertex in the columns' units). `row`: `[n_batches]`.
    // Part of its callers where they are compiled for several instruction sets; elsewhere copies would be downloaded.
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    #[cfg_attr(target_family = "wasm", inline(never))]
    #[must_use]
    pub fn combined(&self, row: &[Row]) -> (f64, DVec3) {
        let [x, y, z] = &self.exact;
        // Sums in variables of their own, not in an array: they stay in registers.
        let (mut s, mut sx, mut sy, mut sz) =
            ([0.0f64; LANES], [0.0f64; LANES], [0.0f64; LANES], [0.0f64; LANES]);
        for (((w, x), y), z) in row.iter().zip(x).zip(y).zip(z) {
            for k in 0..LANES {
                let w = f64::from(w[k]);
                s[k] += w;
                sx[k] += w * x[k];
                sy[k] += w * y[k];
                sz[k] += w * z[k];
            }
        }
        let [sum, x, y, z] = [s, sx, sy, sz].map(|lanes| lanes.iter().sum::<f64>());
        (sum, DVec3::new(x, y, z))
    }

    /// Corrects a row so that it sums to 1 and reproduces `target` ([`Self::scale`]d). Returns what [`Self::sums`] said of it
    /// before, to f32.
    #[inline(always)]
    pub fn restore_affine(&self, row: &mut [Row], target: DVec3) -> Sums {
        let m = self.moments(row, target);
        let matrix = DMat4::from_cols(
            DVec4::new(m[0], m[1], m[2], m[3]),
            DVec4::new(m[1], m[4], m[5], m[6]),
            DVec4::new(m[2], m[5], m[7], m[8]),
            DVec4::new(m[3], m[6], m[8], m[9]),
        );
        let sums = DVec4::new(m[0], m[1], m[2], m[3]);
        let point_off = DVec3::new(m[1], m[2], m[3]) + (m[0] - 1.0) * target;
        let before = Sums { sum: m[0], miss: point_off.length() };
        let ridge = RIDGE * (m[0] + m[4] + m[7] + m[9]);
        let lambda = (matrix + DMat4::from_diagonal(DVec4::splat(ridge))).inverse() * (DVec4::X - sums);
        if !lambda.is_finite() {
            return before;
        }
        let (l, t) = (lambda.as_vec4(), target.as_vec3());
        let [x, y, z] = &self.scaled;
        for (((w, x), y), z) in row.iter_mut().zip(x).zip(y).zip(z) {
            let mut change = ZERO;
            for k in 0..LANES {
                change[k] = l.x + l.y * (x[k] - t.x) + l.z * (y[k] - t.y) + l.w * (z[k] - t.z);
            }
            for k in 0..LANES {
                w[k] *= 1.0 + change[k];
            }
        }
        before
    }

    #[inline(always)]
    fn moments(&self, row: &[Row], target: DVec3) -> Moments {
        let t = target.as_vec3();
        let [x, y, z] = &self.scaled;
        // In variables of their own, not in an array: they stay in registers.
        let (mut s, mut sx, mut sy, mut sz) = (ZERO, ZERO, ZERO, ZERO);
        let (mut sxx, mut sxy, mut sxz, mut syy, mut syz, mut szz) = (ZERO, ZERO, ZERO, ZERO, ZERO, ZERO);
        for (((w, x), y), z) in row.iter().zip(x).zip(y).zip(z) {
            for k in 0..LANES {
                let (dx, dy, dz) = (x[k] - t.x, y[k] - t.y, z[k] - t.z);
                let (wx, wy, wz) = (w[k] * dx, w[k] * dy, w[k] * dz);
                s[k] += w[k];
                sx[k] += wx;
                sy[k] += wy;
                sz[k] += wz;
                sxx[k] += wx * dx;
                sxy[k] += wx * dy;
                sxz[k] += wx * dz;
                syy[k] += wy * dy;
                syz[k] += wy * dz;
                szz[k] += wz * dz;
            }
        }
        let moments = [s, sx, sy, sz, sxx, sxy, sxz, syy, syz, szz];
        moments.map(|lanes| lanes.iter().map(|&s| f64::from(s)).sum::<f64>())
    }
}

#[cfg(test)]
mod tests;
