//! Limit on the overdraw of pictures that a software rasteriser draws.

use glam::Vec3;

use super::camera::Camera;
use crate::device::GpuContext;
use crate::error::GpuError;

/// Limit on overdraw for software rasterisers: pixels, counted once per triangle that covers them. At the native limit,
/// a picture takes up to 10 s of two cores in llvmpipe; at the page's limit, a frame takes about 1 s in SwiftShader.
const MAX_SOFTWARE_PIXELS: f64 = if cfg!(target_family = "wasm") { 2.5e7 } else { 4e7 };

/// Cost of a triangle per pixel of its longest side, in addition to its area, because slivers have almost no
/// area. Measured with a fan of 100,000 slivers in SwiftShader (browsers) and llvmpipe.
const SIDE_COST: f64 = if cfg!(target_family = "wasm") { 10.0 } else { 0.5 };

/// Rejects a picture of `size` pixels if it would take a software rasteriser too long.
///
/// # Errors
/// [`GpuError::Layers`] if the overdraw exceeds the limit.
pub fn check_layers(
    context: &GpuContext,
    camera: &Camera,
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    size: [u32; 2],
) -> Result<(), GpuError> {
    let pixels = if context.is_software() { covered(camera, positions, triangles, size) } else { 0.0 };
    if pixels <= MAX_SOFTWARE_PIXELS {
        return Ok(());
    }
    Err(GpuError::Layers { triangles: triangles.len(), pixels, limit: MAX_SOFTWARE_PIXELS })
}

/// Pixels covered by triangles, counting overlaps, plus the cost of their sides. A triangle that extends
/// behind the camera counts as the whole picture.
fn covered(camera: &Camera, positions: &[Vec3], triangles: &[[u32; 3]], size: [u32; 2]) -> f64 {
    let picture = f64::from(size[0]) * f64::from(size[1]);
    let project = camera.projector();
    let places: Vec<_> = positions.iter().map(|&p| project(p).map(|at| at.position)).collect();
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| places[i as usize]);
        let (Some(a), Some(b), Some(c)) = (a, b, c) else { return picture };
        let side = (b - a).length().max((c - b).length()).max((a - c).length());
        (f64::from(0.5 * (b - a).perp_dot(c - a).abs()) + SIDE_COST * f64::from(side)).min(picture)
    };
    triangles.iter().map(area).sum()
}

#[cfg(test)]
mod tests {
    use cagework_core::Bounds;
    use glam::{Vec2, Vec3};

    use super::*;
    use crate::render::Projection;

    #[test]
    fn overlapping_triangles_are_all_counted() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::ONE.with_z(0.0), Vec3::Y];
        let mut camera = Camera::default();
        (camera.yaw, camera.pitch, camera.projection) = (0.0, 0.0, Projection::Orthographic);
        let bounds = Bounds::around(&corners).unwrap();
        camera.set_scene(bounds);
        camera.set_viewport(Vec2::splat(100.0));
        camera.frame(bounds);
        let at = |p| camera.project(p).unwrap().position;
        let side = f64::from(at(Vec3::X).distance(at(Vec3::ZERO)));
        let square = side * side + 2.0 * SIDE_COST * side * 2.0_f64.sqrt();
        let triangles = [[0, 1, 2], [0, 2, 3]].repeat(50);
        let counted = covered(&camera, &corners, &triangles, [100, 100]);
        assert!((counted / (50.0 * square) - 1.0).abs() < 1e-4, "{counted} of {}", 50.0 * square);
    }
}
