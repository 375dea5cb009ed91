//! Nearest rotation to a matrix.

use glam::{DMat3, DQuat};

/// Limit on Newton steps. Five suffice at a simple root; at a double root each step only halves the distance to the
/// root.
const STEPS: usize = 40;

/// The proper rotation R that maximises the trace of `R^T m`.
///
/// Its quaternion is the eigenvector of the largest eigenvalue of a symmetric 4 x 4 matrix (Horn 1987, "Closed-form
/// solution of absolute orientation using unit quaternions"; Higham and Noferini 2016 derive the polar factor from the
/// same matrix). Newton's method on the characteristic polynomial finds the eigenvalue from above (Theobald 2005). If
/// several rotations are equally near, returns one of them.
pub fn nearest_rotation(m: DMat3) -> DMat3 {
    let size = m.x_axis.abs().max(m.y_axis.abs()).max(m.z_axis.abs()).max_element();
    if size == 0.0 || !size.is_finite() {
        return DMat3::IDENTITY;
    }
    let m = m * size.recip();
    // `a[row][column]` of m.
    let a = m.transpose().to_cols_array_2d();
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = a;
    let k = [
        [xx + yy + zz, zy - yz, xz - zx, yx - xy],
        [zy - yz, xx - yy - zz, xy + yx, xz + zx],
        [xz - zx, xy + yx, yy - xx - zz, yz + zy],
        [yx - xy, xz + zx, yz + zy, zz - xx - yy],
    ];
    // Characteristic polynomial: det(k - l I) = l^4 + c2 l^2 + c1 l + c0. The term in l^3 vanishes, because the trace
    // of k is 0.
    let c2 = -2.0 * a.as_flattened().iter().map(|x| x * x).sum::<f64>();
    let c1 = -8.0 * m.determinant();
    let c0 = determinant4(&k);
    // Start at sqrt(3) times the Frobenius norm of m: an upper bound on the sum of m's singular values, which is an
    // upper bound on the eigenvalues of k.
    let mut l = (-1.5 * c2).sqrt();
    for _ in 0..STEPS {
        let value = ((l * l + c2) * l + c1) * l + c0;
        let slope = (4.0 * l * l + 2.0 * c2) * l + c1;
        let next = l - value / slope;
        // Newton's iterates decrease towards the root; an increase is a rounding error.
        if !next.is_finite() || next >= l {
            break;
        }
        l = next;
    }
    let mut shifted = k;
    for (i, row) in shifted.iter_mut().enumerate() {
        row[i] -= l;
    }
    // Each column of the adjugate is a multiple of the eigenvector. The longest column is the most accurate.
    let columns = [0, 1, 2, 3].map(|i| [0, 1, 2, 3].map(|j| cofactor(&shifted, i, j)));
    let squared = |q: &[f64; 4]| q.iter().map(|x| x * x).sum::<f64>();
    let longest = columns.into_iter().max_by(|a, b| squared(a).total_cmp(&squared(b))).unwrap_or_default();
    let [w, x, y, z] = longest;
    let q = DQuat::from_xyzw(x, y, z, w);
    let q = q * q.length().recip();
    if q.is_finite() { DMat3::from_quat(q) } else { DMat3::IDENTITY }
}

fn minor(k: &[[f64; 4]; 4], i: usize, j: usize) -> f64 {
    let rest = |skip: usize| [0, 1, 2, 3].into_iter().filter(move |&x| x != skip);
    let mut entries = rest(i).flat_map(|r| rest(j).map(move |c| k[r][c]));
    DMat3::from_cols_array(&std::array::from_fn(|_| entries.next().unwrap_or_default())).determinant()
}

fn cofactor(k: &[[f64; 4]; 4], i: usize, j: usize) -> f64 {
    if (i + j).is_multiple_of(2) { minor(k, i, j) } else { -minor(k, i, j) }
}

fn determinant4(k: &[[f64; 4]; 4]) -> f64 {
    (0..4).map(|j| k[0][j] * cofactor(k, 0, j)).sum()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use nalgebra::Matrix3;

    use super::*;

    /// Reference for the tests: the nearest rotation by singular value decomposition (Kabsch 1976).
    fn by_svd(m: DMat3) -> DMat3 {
        let svd = Matrix3::from_column_slice(&m.to_cols_array()).svd(true, true);
        let (mut u, v) = (svd.u.unwrap(), svd.v_t.unwrap());
        if (u * v).determinant() < 0.0 {
            let least = svd.singular_values.imin();
            u.column_mut(least).neg_mut();
        }
        DMat3::from_cols_slice((u * v).as_slice())
    }

    fn matrices() -> impl Iterator<Item = DMat3> {
        let mut seed = 1_u64;
        let mut next = move || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
        };
        (0..1000).map(move |_| DMat3::from_cols_array(&std::array::from_fn(|_| next())))
    }

    #[test]
    fn rotation_equals_that_of_singular_value_decomposition() {
        for m in matrices() {
            let (found, expected) = (nearest_rotation(m), by_svd(m));
            assert!((found.determinant() - 1.0).abs() < 1e-12);
            // The trace is as large as that of the reference. The rotations are equal unless two rotations give nearly
            // the same trace.
            let trace = |r: DMat3| (r.transpose() * m).to_cols_array();
            let [ours, theirs] = [trace(found), trace(expected)].map(|t| t[0] + t[4] + t[8]);
            assert!(ours >= theirs - 1e-12, "{m}: {ours} {theirs}");
            if m.determinant() > 0.05 {
                assert!(found.abs_diff_eq(expected, 1e-9), "{m}: {found} {expected}");
            }
        }
    }

    #[test]
    fn a_stretch_gives_the_identity_and_a_mirror_a_proper_rotation() {
        for scale in [1e-30, 1.0, 1e30] {
            let stretch = DMat3::from_diagonal(DVec3::new(3.0, 2.0, 0.5) * scale);
            assert!(nearest_rotation(stretch).abs_diff_eq(DMat3::IDENTITY, 1e-14));
        }
        let flat = DMat3::from_diagonal(DVec3::new(1.0, 1.0, 0.0));
        assert!(nearest_rotation(flat).abs_diff_eq(DMat3::IDENTITY, 1e-12));
        for odd in [
            DMat3::ZERO,
            DMat3::from_diagonal(DVec3::NEG_ONE),
            DMat3::from_diagonal(DVec3::X),
            DMat3::from_diagonal(DVec3::splat(f64::NAN)),
        ] {
            let rotation = nearest_rotation(odd);
            assert!((rotation.determinant() - 1.0).abs() < 1e-12, "{odd}: {rotation}");
        }
    }
}
