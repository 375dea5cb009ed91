//! Restores `sum w = 1` and `sum w c = v` for a row w of weights after some were dropped or rounded. c: rest positions
//! of the controls; v: rest position of the row's vertex.
//!
//! Of all corrections d of the row that restore these four sums, the correction minimises `sum d_i^2 / w_i`. With
//! `phi_i = (1, (c_i - v) / s)` and s the cage's diagonal, it is `d_i = w_i phi_i . lambda`, where lambda solves the 4
//! x 4 system `(sum w_i phi_i phi_i^T) lambda = e_1 - sum w_i phi_i`. Zero weights stay zero. Each weight is multiplied
//! by a factor that is linear in the control's position, and near 1 if the sums are nearly right. The factors are not
//! bounded: callers that drop weights must check the corrected row.

use glam::{DMat4, DVec3, DVec4};

use crate::controls::Controls;
use crate::solve::rows::{LANES, Row, ZERO};

/// Tikhonov term on the diagonal of the 4 x 4 system, relative to its trace. On a face of the cage all controls with
/// weights lie in a plane. The system is then singular in the direction normal to the plane, in which no correction is
/// needed.
const RIDGE: f64 = 1e-7;

/// Sums over a row of weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sums {
    /// Sum of the weights, `sum w`, which should be 1.
    pub sum: f64,
    /// Distance of `sum w c` from the position that the row should reproduce, as a fraction of the cage's diagonal.
    pub miss: f64,
}

impl Sums {
    /// Largest deviation of the sums from 1 and from the target.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.miss.max((self.sum - 1.0).abs())
    }
}

/// Rest positions of the controls in the layout of a row of weights: batches of [`LANES`] controls.
#[derive(Clone, Debug)]
pub struct Columns {
    /// Positions relative to the cage's centre, divided by its diagonal. `[3][n_batches]`
    scaled: [Vec<Row>; 3],
    /// The same positions in f64, to measure sums.
    exact: [Vec<[f64; LANES]>; 3],
    center: DVec3,
    diagonal: f64,
}

/// Weighted sums of 1; x, y, z; xx, xy, xz, yy, yz, zz over a row, where x, y, z are positions relative to the target.
type Moments = [f64; 10];

impl Columns {
    /// Arranges the controls' rest positions in batches of lanes, in scaled coordinates.
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

    /// Number of batches in a row.
    #[must_use]
    pub fn n_batches(&self) -> usize {
        self.exact[0].len()
    }

    /// Converts a point to the scaled coordinates of the columns.
    #[must_use]
    pub fn scale(&self, point: DVec3) -> DVec3 {
        (point - self.center) / self.diagonal
    }

    /// Computes the sum of the weights of a row, `[n_batches]`, and the distance of `sum w c` from the scaled `target`
    /// ([`Self::scale`]).
    #[inline(always)]
    #[must_use]
    pub fn sums(&self, row: &[Row], target: DVec3) -> Sums {
        let (sum, point) = self.combined(row);
        Sums { sum, miss: (point - target).length() }
    }

    /// Computes `(sum w, sum w c)` of a row, `[n_batches]`, in scaled coordinates.
    // Inlined where callers are compiled for several instruction sets; wasm keeps one copy to save download size.
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    #[cfg_attr(target_family = "wasm", inline(never))]
    #[must_use]
    pub fn combined(&self, row: &[Row]) -> (f64, DVec3) {
        let [x, y, z] = &self.exact;
        // Separate variables instead of an array: they stay in registers.
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

    /// Corrects a row so that it sums to 1 and reproduces the scaled `target` ([`Self::scale`]). Returns the sums of
    /// the row before the correction, in f32 precision.
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
        // Separate variables instead of an array: they stay in registers.
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
