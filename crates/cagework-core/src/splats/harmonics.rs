//! Real spherical harmonics of bands 1 to 3, and their rotation.

use std::sync::LazyLock;

use glam::{Mat3, Vec3};

/// Largest degree of the spherical harmonics.
pub const MAX_DEGREE: u8 = 3;
/// Number of coefficients of bands 1 to 3.
const N: usize = 15;
/// First coefficient and number of coefficients of each band.
const BANDS: [(usize, usize); 3] = [(0, 3), (3, 5), (8, 7)];
/// Step of the spiral of sample directions, radians. Of all steps from 0.05 to 3.2, this one gives the best condition
/// numbers of the three sample matrices: 4, 5 and 8.
const SPIRAL_STEP: f32 = 2.8;

/// Number of coefficients of bands 1 to `degree`.
#[must_use]
pub const fn n_harmonics(degree: u8) -> usize {
    let bands = degree as usize + 1;
    bands * bands - 1
}

/// Values of bands 1 to 3 for a unit direction from the camera to the splat, with the constants and signs of 3DGS
/// files: 3, 5 and 7 numbers.
#[must_use]
pub fn harmonic_basis(direction: Vec3) -> [f32; N] {
    const C1: f32 = 0.488_602_52;
    const C2: [f32; 3] = [1.092_548_5, 0.315_391_57, 0.546_274_24];
    const C3: [f32; 5] = [0.590_043_6, 2.890_611_4, 0.457_045_8, 0.373_176_34, 1.445_305_7];
    let Vec3 { x, y, z } = direction;
    let [xx, yy, zz] = [x * x, y * y, z * z];
    [
        -C1 * y,
        C1 * z,
        -C1 * x,
        C2[0] * x * y,
        -C2[0] * y * z,
        C2[1] * (2.0 * zz - xx - yy),
        -C2[0] * x * z,
        C2[2] * (xx - yy),
        -C3[0] * y * (3.0 * xx - yy),
        C3[1] * x * y * z,
        -C3[2] * y * (4.0 * zz - xx - yy),
        C3[3] * z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
        -C3[2] * x * (4.0 * zz - xx - yy),
        C3[4] * z * (xx - yy),
        -C3[0] * x * (xx - 3.0 * yy),
    ]
}

/// `n` directions on a spiral over the upper hemisphere.
fn directions(n: usize) -> impl Iterator<Item = Vec3> {
    (0..n).map(move |k| {
        let z = 1.0 - (k as f32 + 0.5) / n as f32;
        let (sin, cos) = (SPIRAL_STEP * k as f32).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        Vec3::new(radius * cos, radius * sin, z)
    })
}

/// For each band, the inverse of the matrix `[direction][coefficient]` of its values at the sample directions.
static INVERSES: LazyLock<[Vec<Vec<f32>>; 3]> = LazyLock::new(|| {
    BANDS.map(|(first, n)| {
        let row = |d: Vec3| harmonic_basis(d)[first..first + n].iter().map(|&y| f64::from(y)).collect();
        inverse(directions(n).map(row).collect())
    })
});

/// Inverse of a matrix, by Gauss-Jordan elimination with row pivoting.
fn inverse(mut a: Vec<Vec<f64>>) -> Vec<Vec<f32>> {
    let n = a.len();
    for (i, row) in a.iter_mut().enumerate() {
        row.extend((0..n).map(|j| f64::from(u8::from(i == j))));
    }
    for i in 0..n {
        let pivot = (i..n).max_by(|&p, &q| a[p][i].abs().total_cmp(&a[q][i].abs())).unwrap_or(i);
        a.swap(i, pivot);
        let scale = a[i][i].recip();
        a[i].iter_mut().for_each(|x| *x *= scale);
        let row = a[i].clone();
        for (_, other) in a.iter_mut().enumerate().filter(|(k, _)| *k != i) {
            let factor = other[i];
            other.iter_mut().zip(&row).for_each(|(x, y)| *x -= factor * y);
        }
    }
    a.into_iter().map(|row| row[n..].iter().map(|&x| x as f32).collect()).collect()
}

/// Rotates the coefficients of a splat, in place: 0, 3, 8 or 15 of them.
///
/// The rotated function has the values f(R^T d) at the sample directions d of each band, which determine its
/// coefficients.
pub fn rotate_harmonics(rotation: Mat3, coefficients: &mut [Vec3]) {
    let back = rotation.transpose();
    for ((first, n), inverse) in BANDS.into_iter().zip(&*INVERSES) {
        let Some(of_band) = coefficients.get_mut(first..first + n) else { return };
        let mut values = [Vec3::ZERO; 7];
        for (value, direction) in values.iter_mut().zip(directions_of(n)) {
            let basis = harmonic_basis(back * *direction);
            *value = basis[first..].iter().zip(&*of_band).map(|(&y, &c)| y * c).sum();
        }
        for (coefficient, row) in of_band.iter_mut().zip(inverse) {
            *coefficient = row.iter().zip(&values).map(|(&a, &value)| a * value).sum();
        }
    }
}

/// [`directions`], computed once.
fn directions_of(n: usize) -> &'static [Vec3] {
    static DIRECTIONS: LazyLock<[Vec<Vec3>; 3]> =
        LazyLock::new(|| BANDS.map(|(_, n)| directions(n).collect()));
    &DIRECTIONS[(n - 3) / 2]
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;

    /// Tolerance for f32 rounding, which the condition numbers of the sample matrices amplify.
    const TOLERANCE: f32 = 2e-6;

    #[test]
    fn rotated_harmonics_have_the_value_of_the_direction_rotated_back() {
        let rotation = Mat3::from_quat(Quat::from_xyzw(0.3, -0.5, 0.7, 0.4).normalize());
        let given: [Vec3; N] = std::array::from_fn(|k| Vec3::new(1.0, -0.5, 0.1) * (k as f32 * 1.7).sin());
        let value =
            |of: &[Vec3], d: Vec3| -> Vec3 { harmonic_basis(d).iter().zip(of).map(|(&y, &c)| y * c).sum() };
        for degree in 0..=MAX_DEGREE {
            let given = &given[..n_harmonics(degree)];
            let mut rotated = given.to_vec();
            rotate_harmonics(rotation, &mut rotated);
            for d in directions(100).flat_map(|d| [d, -d]) {
                let difference = value(&rotated, rotation * d) - value(given, d);
                assert!(
                    difference.abs().max_element() <= TOLERANCE * (N as f32),
                    "{degree} {d}: {difference}"
                );
            }
        }
    }

    /// The integral of a product of two real spherical harmonics over the sphere is 1 or 0.
    #[test]
    fn basis_is_orthonormal() {
        const STEPS: usize = 100_000;
        let mut sums = [[0.0_f64; N]; N];
        for d in directions(STEPS).flat_map(|d| [d, -d]) {
            let basis = harmonic_basis(d);
            for (i, j) in (0..N).flat_map(|i| (0..=i).map(move |j| (i, j))) {
                sums[i][j] += f64::from(basis[i] * basis[j]) * std::f64::consts::TAU / STEPS as f64;
            }
        }
        for (i, j) in (0..N).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            let expected = f64::from(u8::from(i == j));
            // The tolerance covers the error of replacing the integral by a sum over the spiral.
            assert!((sums[i][j] - expected).abs() <= 1e-2, "{i} {j}: {}", sums[i][j]);
        }
    }
}
