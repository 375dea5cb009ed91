//! Triangles over each other, by the thousand: what a GPU made of processor cores would draw for minutes.

use glam::Vec3;

use super::camera::Camera;
use crate::device::GpuContext;
use crate::error::GpuError;

/// Most pixels, counted for each triangle that covers them, that an adapter made of processor cores draws: 10 s of one core for a
/// picture in llvmpipe; in a browser some 3 s for a rough one, of which opening a model waits for several.
const SOFTWARE_PIXELS: f64 = 1e8;

/// What each pixel of a triangle's longest side counts for beside the triangle's area: slivers have hardly any. Measured
/// on a fan of 100,000 of them, in SwiftShader (which browsers have) and in llvmpipe.
const SIDE: f64 = if cfg!(target_family = "wasm") { 10.0 } else { 0.5 };

/// Refuses a model whose picture of `size` pixels an adapter made of processor cores would draw for minutes.
///
/// # Errors
/// [`GpuError::Layers`] when its triangles cover too many pixels.
pub fn check_layers(
    context: &GpuContext,
    camera: &Camera,
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    size: [u32; 2],
) -> Result<(), GpuError> {
    let pixels = if context.is_software() { covered(camera, positions, triangles, size) } else { 0.0 };
    if pixels <= SOFTWARE_PIXELS {
        return Ok(());
    }
    Err(GpuError::Layers { triangles: triangles.len(), pixels, limit: SOFTWARE_PIXELS })
}

/// Pixels that triangles cover, each triangle's counted for itself, and their sides; one that reaches behind the camera
/// covers all.
fn covered(camera: &Camera, positions: &[Vec3], triangles: &[[u32; 3]], size: [u32; 2]) -> f64 {
    let picture = f64::from(size[0]) * f64::from(size[1]);
    let places: Vec<_> = positions.iter().map(|&p| camera.project(p).map(|at| at.position)).collect();
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| places[i as usize]);
        let (Some(a), Some(b), Some(c)) = (a, b, c) else { return picture };
        let side = (b - a).length().max((c - b).length()).max((a - c).length());
        (f64::from(0.5 * (b - a).perp_dot(c - a).abs()) + SIDE * f64::from(side)).min(picture)
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
    fn each_triangle_is_counted_for_itself() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::ONE.with_z(0.0), Vec3::Y];
        let mut camera = Camera::default();
        (camera.yaw, camera.pitch, camera.projection) = (0.0, 0.0, Projection::Orthographic);
        let bounds = Bounds::of(&corners).unwrap();
        camera.set_scene(bounds);
        camera.set_viewport(Vec2::splat(100.0));
        camera.frame(bounds);
        let at = |p| camera.project(p).unwrap().position;
        let side = f64::from(at(Vec3::X).distance(at(Vec3::ZERO)));
        let square = side * side + 2.0 * SIDE * side * 2.0_f64.sqrt();
        let triangles = [[0, 1, 2], [0, 2, 3]].repeat(50);
        let counted = covered(&camera, &corners, &triangles, [100, 100]);
        assert!((counted / (50.0 * square) - 1.0).abs() < 1e-4, "{counted} of {}", 50.0 * square);
    }
}
