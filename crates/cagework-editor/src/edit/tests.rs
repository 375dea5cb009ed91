//! A camera and small cages for the tests of this folder.

use cagework_core::PolygonMesh;
use cagework_core::view::View;
use glam::{Vec2, Vec3};

/// A box of quads; vertex `x + 2 y + 4 z` with 0 for `min` and 1 for `max`.
pub(crate) fn cuboid(min: Vec3, max: Vec3) -> PolygonMesh {
    let at = |v: u32, axis: usize| if v >> axis & 1 == 0 { min[axis] } else { max[axis] };
    PolygonMesh {
        positions: (0..8).map(|v| Vec3::new(at(v, 0), at(v, 1), at(v, 2))).collect(),
        faces: [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
            .iter()
            .map(|f: &[u32; 4]| f.to_vec())
            .collect(),
    }
}

/// The unit cube, from (0, 0, 0) to (1, 1, 1).
pub(crate) fn cube() -> PolygonMesh {
    cuboid(Vec3::ZERO, Vec3::ONE)
}

/// A view along -z with 100 pixels per unit, and the origin at pixel (200, 100).
pub(crate) struct FrontView;

impl View for FrontView {
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
    assert_eq!(FrontView.backward(), Vec3::Z);
    let moved = FrontView.in_view_plane(Vec3::ZERO, Vec2::new(50.0, 20.0));
    assert!(moved.abs_diff_eq(Vec3::new(0.5, -0.2, 0.0), 1e-6));
}
