//! Interface of the camera that editing needs.

use glam::{Vec2, Vec3};

/// A camera.
pub trait View {
    /// Pixel of a point, and its depth along the view direction; `None` behind the eye.
    fn project(&self, point: Vec3) -> Option<(Vec2, f32)>;
    /// Origin and unit direction of the ray through a pixel.
    fn ray(&self, pixel: Vec2) -> (Vec3, Vec3);
    /// Size of a pixel at a point, object units.
    fn units_per_pixel(&self, point: Vec3) -> f32;
    /// Unit vector to the right of the screen.
    fn right(&self) -> Vec3;
    /// Unit vector to the top of the screen.
    fn up(&self) -> Vec3;

    /// Unit vector towards the eye.
    fn backward(&self) -> Vec3 {
        self.right().cross(self.up())
    }

    /// Displacement at `point`, parallel to the screen, for a pointer movement of `delta` pixels.
    fn in_view_plane(&self, point: Vec3, delta: Vec2) -> Vec3 {
        self.units_per_pixel(point) * (delta.x * self.right() - delta.y * self.up())
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Orthographic view along -z, 100 pixels per unit, with the origin at pixel (200, 100).
    pub(crate) struct Flat;

    impl View for Flat {
        fn project(&self, point: Vec3) -> Option<(Vec2, f32)> {
            Some((Vec2::new(200.0 + 100.0 * point.x, 100.0 - 100.0 * point.y), 10.0 - point.z))
        }
        fn ray(&self, pixel: Vec2) -> (Vec3, Vec3) {
            (Vec3::new((pixel.x - 200.0) / 100.0, (100.0 - pixel.y) / 100.0, 10.0), Vec3::NEG_Z)
        }
        fn units_per_pixel(&self, _point: Vec3) -> f32 {
            0.01
        }
        fn right(&self) -> Vec3 {
            Vec3::X
        }
        fn up(&self) -> Vec3 {
            Vec3::Y
        }
    }

    #[test]
    fn pointer_to_the_right_and_down_moves_in_the_view_plane() {
        assert_eq!(Flat.backward(), Vec3::Z);
        let moved = Flat.in_view_plane(Vec3::ZERO, Vec2::new(50.0, 20.0));
        assert!(moved.abs_diff_eq(Vec3::new(0.5, -0.2, 0.0), 1e-6));
    }
}
