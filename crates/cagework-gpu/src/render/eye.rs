//! Implements [`View`], which picking and dragging use, for [`Camera`].

use cagework_core::view::View;
use glam::{Vec2, Vec3};

use super::camera::Camera;

impl View for Camera {
    fn project(&self, point: Vec3) -> Option<(Vec2, f32)> {
        Self::project(self, point).map(|p| (p.position, p.depth))
    }

    fn ray(&self, pixel: Vec2) -> (Vec3, Vec3) {
        let ray = Self::ray(self, pixel);
        (ray.origin, ray.direction)
    }

    fn units_per_pixel(&self, point: Vec3) -> f32 {
        Self::units_per_pixel(self, point)
    }

    fn right(&self) -> Vec3 {
        Self::right(self)
    }

    fn up(&self) -> Vec3 {
        Self::up(self)
    }
}
