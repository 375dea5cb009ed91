//! Camera interface for picking and dragging: projection, rays, and the size of a pixel.

use glam::{Vec2, Vec3};

/// Projection and axes of a camera, for picking and dragging.
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
