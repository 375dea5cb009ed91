//! Tests of the deformation of splats, on random splats in a box cage.

use glam::{Mat3, Quat, Vec3, Vec4};

use super::*;
use crate::field::{FieldWeights, Lattice};
use crate::progress::NoProgress;
use crate::team::Team;
use crate::{BindOptions, Bounds, Cage, subdivided_box};

/// Largest relative error of a covariance, from f32 rounding in the differences of displacements.
const COVARIANCE_TOLERANCE: f32 = 1e-5;

/// A box cage with a corner at (-2, -2, -2) and edges of 4.
fn cage() -> Cage {
    let bounds = Bounds { min: Vec3::splat(-2.0), max: Vec3::splat(2.0) };
    Cage::new(&subdivided_box(bounds, 0.0, [2; 3])).unwrap()
}

/// The field that results when `map` moves the cage's vertices.
fn field_of(map: impl Fn(Vec3) -> Vec3) -> Field {
    let cage = cage();
    let options = BindOptions { grid: 32, ..BindOptions::default() };
    let weights = FieldWeights::bind(&cage, 16, &options, &NoProgress).unwrap();
    let posed: Vec<Vec3> = cage.positions().iter().map(|&p| map(p)).collect();
    weights.pose(cage.positions(), &posed)
}

/// Splats with centres within 1.5 of the origin along each axis, and spherical harmonics.
fn splats(n: usize) -> Splats {
    let mut seed = 7_u64;
    let mut next = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (seed >> 33) as f32 / (1_u32 << 30) as f32 - 1.0
    };
    let mut vector = |size: f32| Vec3::new(size * next(), size * next(), size * next());
    let mut splats = Splats { degree: MAX_DEGREE, ..Splats::default() };
    for _ in 0..n {
        splats.positions.push(vector(1.5));
        splats.scales.push(vector(3.0).map(|x| 0.02 * x.exp()));
        splats.rotations.push(Quat::from_vec4(vector(1.0).extend(0.3)).normalize());
        splats.opacities.push(0.5);
        splats.colors.push(vector(0.5) + 0.5);
        splats.harmonics.extend((0..n_harmonics(MAX_DEGREE)).map(|_| vector(0.3)));
    }
    splats
}

fn posed(splats: &Splats, field: &Field) -> SplatPose {
    let sorted = SortedSplats::new(splats, &field.lattice);
    let (mut pose, mut in_order) = (SplatPose::default(), splats.rest_pose());
    deform_splats(&sorted, field, &Team::new(2), &mut pose);
    for (k, &splat) in sorted.order.iter().enumerate() {
        in_order.positions[splat as usize] = pose.positions[k];
        in_order.covariances[splat as usize] = pose.covariances[k];
    }
    in_order
}

/// Largest difference of two covariances, relative to the largest entry.
fn error(a: &[f32; 6], b: &[f32; 6]) -> f32 {
    let size = b.iter().fold(0.0_f32, |size, x| size.max(x.abs()));
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) / size
}

#[test]
fn affine_motion_of_the_cage_transforms_covariances_exactly() {
    let matrix = Mat3::from_cols_array(&[1.3, 0.4, 0.0, -0.2, 0.8, 0.3, 0.1, 0.0, 1.1]);
    let field = field_of(|p| matrix * p + Vec3::new(0.3, -0.2, 0.1));
    let splats = splats(1000);
    let (pose, deformed) = (posed(&splats, &field), splats.deformed(&field));
    for splat in 0..splats.len() {
        let expected = splat_covariance(matrix * splats.axes(splat));
        let (drawn, written) = (&pose.covariances[splat], splat_covariance(deformed.axes(splat)));
        assert!(error(drawn, &expected) <= COVARIANCE_TOLERANCE, "{splat}: {}", error(drawn, &expected));
        assert!(
            error(&written, &expected) <= COVARIANCE_TOLERANCE,
            "{splat}: {}",
            error(&written, &expected)
        );
    }
    assert_eq!(splats.n_inexact(&field), 0);
}

#[test]
fn rotation_of_the_cage_equals_rotation_of_the_capture() {
    // Positions: object units. Covariances: relative to the largest entry. Colours: full intensity is 1.
    const TOLERANCE: f32 = 1e-4;
    let rotation = Quat::from_axis_angle(Vec3::new(1.0, 2.0, -0.5).normalize(), 1.1);
    let field = field_of(|p| rotation * p);
    let splats = splats(300);
    let (deformed, expected) = (splats.deformed(&field), splats.rotated(rotation));
    let value =
        |of: &Splats, splat: usize, d: Vec3| -> Vec3 { color_along(Vec3::ZERO, of.harmonics_of(splat), d) };
    for splat in 0..splats.len() {
        assert!(deformed.positions[splat].distance(expected.positions[splat]) <= TOLERANCE);
        let [a, b] = [&deformed, &expected].map(|of| splat_covariance(of.axes(splat)));
        assert!(error(&a, &b) <= TOLERANCE);
        for k in 0..100 {
            let d = Quat::from_rotation_y(k as f32) * Quat::from_rotation_x(0.37 * k as f32) * Vec3::Z;
            let [a, b] = [&deformed, &expected].map(|of| value(of, splat, d));
            // The rotated capture has, in direction d, the colour of the original in the direction that the rotation
            // takes to d.
            let c = value(&splats, splat, rotation.inverse() * d);
            assert!((a - b).abs().max_element() <= TOLERANCE && (b - c).abs().max_element() <= TOLERANCE);
        }
    }
}

/// A mirrored splat has, in direction d, the colour of the original in the mirrored direction.
#[test]
fn mirrored_splats_have_mirrored_colours() {
    // Covariances: relative to the largest entry. Colours: full intensity is 1.
    const TOLERANCE: f32 = 1e-4;
    let mirror = Mat3::from_diagonal(Vec3::new(-1.0, 1.0, 1.0));
    let splats = splats(100);
    let deformed = splats.deformed(&field_of(|p| mirror * p));
    for splat in 0..splats.len() {
        let expected = splat_covariance(mirror * splats.axes(splat));
        assert!(error(&splat_covariance(deformed.axes(splat)), &expected) <= TOLERANCE);
        for k in 0..100 {
            let d = Quat::from_rotation_y(k as f32) * Quat::from_rotation_x(0.37 * k as f32) * Vec3::Z;
            let found = color_along(Vec3::ZERO, deformed.harmonics_of(splat), d);
            let expected = color_along(Vec3::ZERO, splats.harmonics_of(splat), mirror * d);
            assert!((found - expected).abs().max_element() <= TOLERANCE, "{splat} {d}: {found} {expected}");
        }
    }
}

#[test]
fn rest_pose_keeps_every_bit() {
    let (field, splats) = (field_of(|p| p), splats(1000));
    assert_eq!(splats.deformed(&field), splats);
    assert_eq!(posed(&splats, &field).positions, splats.positions);
}

#[test]
fn sorted_kernel_equals_the_definition_for_each_splat() {
    let bend = |p: Vec3| Quat::from_rotation_z(0.4 * p.y) * p;
    let (field, mut splats) = (field_of(bend), splats(20_000));
    // Splats outside the lattice stay in place.
    splats.positions[5] = Vec3::new(50.0, 0.0, 0.0);
    splats.positions[6].y = -9.0;
    let pose = posed(&splats, &field);
    for splat in 0..splats.len() {
        let p = splats.positions[splat];
        // The kernel evaluates polynomials, the definition interpolates: they differ by rounding.
        assert!(pose.positions[splat].distance(field.map(p)) <= 1e-5);
        let expected = splat_covariance(field.gradient(p) * splats.axes(splat));
        assert!(error(&pose.covariances[splat], &expected) <= COVARIANCE_TOLERANCE);
    }
    let rest = splats.rest_pose();
    for outside in [5, 6] {
        assert_eq!(pose.positions[outside], rest.positions[outside]);
        assert_eq!(pose.covariances[outside], rest.covariances[outside]);
    }
}

#[test]
fn decomposition_restores_the_covariance_and_small_scales() {
    let splats = splats(500);
    let stretch = Mat3::from_cols_array(&[1.5, 0.7, 0.0, -0.9, 0.6, 0.2, 0.3, 0.0, 1.1]);
    for splat in 0..splats.len() {
        let axes = stretch * splats.axes(splat);
        let (scale, rotation) = decompose(axes);
        let again = splat_covariance(Mat3::from_quat(rotation) * Mat3::from_diagonal(scale));
        assert!(error(&again, &splat_covariance(axes)) <= COVARIANCE_TOLERANCE, "{splat}");
        // The product of the scales is the volume. Scales derived from a squared matrix would lose it to rounding.
        let volume = axes.determinant().abs();
        assert!((scale.element_product() - volume).abs() <= 1e-4 * volume, "{splat}");
        assert!(rotation.is_normalized());
    }
    let thin = Mat3::from_diagonal(Vec3::new(1e-9, 1.0, 1e-4));
    let (scale, rotation) = decompose(Mat3::from_rotation_x(0.3) * thin);
    assert!((scale / Vec3::new(1e-9, 1.0, 1e-4) - 1.0).abs().max_element() <= 1e-5, "{scale}");
    assert!(rotation.angle_between(Quat::from_rotation_x(0.3)) <= 1e-3);
    for scale in [Vec3::ZERO, Vec3::X, Vec3::new(0.0, 2.0, 1.0), Vec3::splat(1e-30)] {
        let (found, rotation) = decompose(Mat3::from_diagonal(scale));
        assert!(found.abs_diff_eq(scale, 1e-6 * scale.max_element()) && rotation.is_normalized(), "{scale}");
    }
}

/// In u = a x^2 e_y, the end of a half axis h along x is at the distance `a h^2` from its linear image.
#[test]
fn first_order_error_of_a_parabola_is_a_h() {
    let lattice = Lattice::new(&cage(), 16);
    let (cell, dims) = (lattice.cell, lattice.dims);
    let x = |k: u32| lattice.origin.x + cell * (k % dims.x) as f32;
    let values = (0..dims.element_product()).map(|k| Vec4::new(0.0, 0.1 * x(k) * x(k), 0.0, 1.0)).collect();
    let field = Field::of_values(lattice, values);
    // The centre and both ends of the axis are nodes, where the interpolation is exact.
    let half = 3.0 * cell;
    let splats = Splats {
        positions: vec![Vec3::new(1.0, 0.0, 0.0)],
        scales: vec![Vec3::new(half / 3.0_f32.sqrt(), 0.01, 0.01)],
        rotations: vec![Quat::IDENTITY],
        ..Splats::default()
    };
    let [error] = splats.first_order_errors(&field)[..] else { panic!("one splat") };
    assert!((error - 0.1 * half).abs() <= 1e-4, "{error}");
    assert_eq!(splats.n_inexact(&field), 0);
}

#[test]
fn shells_leave_out_haze_and_the_largest_splats() {
    let mut splats = splats(200);
    splats.opacities[3] = 0.05;
    splats.scales[8] = Vec3::new(0.1, 40.0, 0.1);
    let (positions, triangles) = splats.shells();
    // Splat 3 is left out because it is transparent. The size limit is the size at index 198 (0.99 * 199, rounded up)
    // of the 200 sizes in ascending order, so only the largest splat, number 8, is left out as well.
    assert_eq!((positions.len(), triangles.len()), (6 * 198, 8 * 198));
    let outwards = triangles[..8].iter().all(|t| {
        let [a, b, c] = t.map(|v| positions[v as usize] - splats.positions[0]);
        a.dot(b.cross(c)) > 0.0
    });
    assert!(outwards);
    splats.opacities.fill(0.0);
    assert_eq!(splats.shells().0.len(), 6 * 200);
}
