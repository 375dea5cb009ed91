//! Outlines of a splat and of the deformation at a point, as ellipses on the screen.

use glam::{Mat3, Vec2, Vec3};

use super::Splats;
use crate::field::Field;

/// Outline of an ellipsoid in a parallel projection: semi-axes of an ellipse, and the counter-clockwise angle from the
/// screen's right to the first semi-axis, radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outline {
    /// Lengths of the semi-axes, the longer one first.
    pub half_axes: Vec2,
    /// Angle of the first semi-axis, radians.
    pub angle: f32,
}

/// Computes the outline of the unit sphere's image under `by`. `right`, `up`: unit vectors to the right and up on the
/// screen.
fn outline(by: Mat3, right: Vec3, up: Vec3) -> Outline {
    let [x, y] = [right, up].map(|direction| by.transpose() * direction);
    // Eigenvalues and first eigenvector of [[a, b], [b, c]].
    let (a, b, c) = (x.length_squared(), x.dot(y), y.length_squared());
    let (mean, half) = (0.5 * (a + c), 0.5 * (a - c));
    let spread = half.hypot(b);
    let half_axes = Vec2::new(mean + spread, (mean - spread).max(0.0)).map(f32::sqrt);
    Outline { half_axes, angle: 0.5 * b.atan2(half) }
}

/// Computes the outlines of the splat nearest to the point `place` at rest, of the unit sphere's image under the
/// deformation gradient at this splat, and of the splat in the pose; `None` without splats.
#[must_use]
pub fn outlines(
    splats: &Splats,
    field: Option<&Field>,
    place: Vec3,
    [right, up]: [Vec3; 2],
) -> Option<[Outline; 3]> {
    let near = |&a: &usize, &b: &usize| {
        let [a, b] = [a, b].map(|splat| splats.positions[splat].distance_squared(place));
        a.total_cmp(&b)
    };
    let splat = (0..splats.len()).min_by(near)?;
    let f = field.map_or(Mat3::IDENTITY, |field| field.gradient(splats.positions[splat]));
    let axes = splats.axes(splat);
    Some([axes, f, f * axes].map(|by| outline(by, right, up)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sphere is stretched by 3 along a direction 0.5 radians above the screen's right, and by 7 along the view
    /// direction, which does not change its outline.
    #[test]
    fn outline_of_a_stretched_sphere_is_an_ellipse() {
        let turn = Mat3::from_rotation_z(0.5);
        let by = turn * Mat3::from_diagonal(Vec3::new(3.0, 1.0, 7.0)) * turn.transpose();
        let Outline { half_axes, angle } = outline(by, Vec3::X, Vec3::Y);
        assert!(half_axes.abs_diff_eq(Vec2::new(3.0, 1.0), 1e-5), "{half_axes}");
        assert!((angle - 0.5).abs() < 1e-5, "{angle}");
    }

    #[test]
    fn without_a_field_the_nearest_splat_is_unchanged() {
        let splats = Splats {
            positions: vec![Vec3::ZERO, Vec3::X],
            scales: vec![Vec3::ONE, Vec3::new(0.2, 0.1, 0.1)],
            rotations: vec![glam::Quat::IDENTITY; 2],
            ..Splats::default()
        };
        let [rest, f, posed] = outlines(&splats, None, 0.9 * Vec3::X, [Vec3::X, Vec3::Y]).unwrap();
        assert_eq!(rest, posed);
        assert_eq!([rest.half_axes.x, f.half_axes.x], [0.2, 1.0]);
        assert_eq!(outlines(&Splats::default(), None, Vec3::X, [Vec3::X, Vec3::Y]), None);
    }
}
