//! Transform gizmo: geometry, drawing and picking.

mod solids;

use std::f32::consts::TAU;

use glam::{Mat3, Mat4, Quat, Vec2, Vec3};

use self::solids::{cone, cube, ring, vertex};
use super::camera::Camera;
use super::layout::GizmoView;
use super::pipelines::{GIZMO_STRIDE, Layouts};
use super::scene::{Gizmo, GizmoMode, GizmoPart};
use super::theme::{ACTIVE_COLOR, AXES, linear};
use crate::device::GpuContext;

/// Length of an axis in the picture, CSS pixels.
pub const GIZMO_PX: f32 = 84.0;

/// Pick radius of axes and rings, CSS pixels.
const PICK_RADIUS_PX: f32 = 8.0;

/// Distance from the gizmo's centre to the start of an axis, as a fraction of the axis length. The centre handle lies
/// within this distance.
const AXIS_START: f32 = 0.16;

/// Extent of a plane handle along both of its axes, as fractions of the axis length.
const PLANE_RANGE: [f32; 2] = [0.30, 0.50];

/// Radius of the ring that faces the eye, as a multiple of the axis length. The ring is outside the axis rings.
const VIEW_RING_RADIUS: f32 = 1.16;

/// Tube radius of a ring, as a fraction of the axis length.
const TUBE_RADIUS: f32 = 0.014;

/// Number of segments along a ring.
const RING_SEGMENTS: u32 = 64;

/// Number of vertices of the largest gizmo: four rings of 64 x 8 quads.
const MAX_VERTICES: u64 = 4 * 64 * 8 * 6;

type Vertex = [f32; 10];

/// Handle of the gizmo under the pointer or, for touch input, the nearest one within `radius`. `cursor` and `radius`
/// are in pixels of the camera's viewport.
#[must_use]
pub fn pick_gizmo(camera: &Camera, gizmo: &Gizmo, cursor: Vec2, radius: f32) -> Option<GizmoPart> {
    let size = GIZMO_PX * camera.units_per_pixel(gizmo.center);
    let at = |p: Vec3| camera.project(gizmo.center + size * (gizmo.rotation * p)).map(|p| p.position);
    let center = at(Vec3::ZERO)?.distance(cursor);
    if gizmo.mode != GizmoMode::Rotate && center <= 1.2 * PICK_RADIUS_PX {
        return Some(GizmoPart::View);
    }
    let to_line = |a: Vec3, b: Vec3| Some(to_segment(cursor, at(a)?, at(b)?));
    let along = |axis: u8| match gizmo.mode {
        GizmoMode::Rotate => nearest(ring_points(axis), to_line),
        GizmoMode::Move | GizmoMode::Scale => {
            to_line(AXIS_START * unit(axis), unit(axis)).unwrap_or(f32::INFINITY)
        }
    };
    let facing_ring = || {
        let facing = gizmo.rotation.inverse() * facing(camera);
        nearest(ring_points(2).map(|p| VIEW_RING_RADIUS * (facing * p)), to_line)
    };
    let around = (gizmo.mode == GizmoMode::Rotate).then(|| (facing_ring(), GizmoPart::View));
    let thin = around.into_iter().chain((0..3).map(|axis| (along(axis), GizmoPart::Axis(axis))));
    let thin = thin
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(distance, _)| *distance <= PICK_RADIUS_PX.max(radius));
    if let Some((_, part)) = thin.filter(|(distance, _)| *distance <= PICK_RADIUS_PX) {
        return Some(part);
    }
    let square = |axis: u8| {
        let [a, b, c, d] = plane_corners(axis).map(at);
        let corners = [a?, b?, c?, d?];
        let inside = is_in_quad(cursor, corners);
        let rim = || nearest(plane_corners(axis).into_iter(), to_line);
        Some((if inside { 0.0 } else { rim() }, GizmoPart::Plane(axis)))
    };
    let planes = (0..3u8).filter(|_| gizmo.mode == GizmoMode::Move).filter_map(square);
    let whole = (gizmo.mode != GizmoMode::Rotate).then_some((center, GizmoPart::View));
    let all = planes.chain(thin).chain(whole).filter(|(distance, _)| *distance <= radius);
    all.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, part)| part)
}

/// Smallest distance to the segments of a closed line. `to_line`: distance to a segment, `None` behind the eye.
fn nearest(points: impl Iterator<Item = Vec3> + Clone, to_line: impl Fn(Vec3, Vec3) -> Option<f32>) -> f32 {
    let sides = points.clone().zip(points.cycle().skip(1));
    sides.filter_map(|(a, b)| to_line(a, b)).fold(f32::INFINITY, f32::min)
}

fn unit(axis: u8) -> Vec3 {
    [Vec3::X, Vec3::Y, Vec3::Z][usize::from(axis % 3)]
}

/// Rotation that turns x to the right of the picture, y to its top, and z towards the eye.
fn facing(camera: &Camera) -> Quat {
    Quat::from_mat3(&Mat3::from_cols(camera.right(), camera.up(), camera.backward()))
}

fn ring_points(axis: u8) -> impl Iterator<Item = Vec3> + Clone {
    let (u, v) = (unit(axis + 1), unit(axis + 2));
    (0..RING_SEGMENTS).map(move |k| {
        let (sin, cos) = (TAU * k as f32 / RING_SEGMENTS as f32).sin_cos();
        cos * u + sin * v
    })
}

fn plane_corners(axis: u8) -> [Vec3; 4] {
    let (u, v) = (unit(axis + 1), unit(axis + 2));
    let [a, b] = PLANE_RANGE;
    [a * u + a * v, b * u + a * v, b * u + b * v, a * u + b * v]
}

fn to_segment(p: Vec2, a: Vec2, b: Vec2) -> f32 {
    let along = b - a;
    let t = ((p - a).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
    p.distance(a + t * along)
}

fn is_in_quad(p: Vec2, corners: [Vec2; 4]) -> bool {
    let sides: [f32; 4] =
        std::array::from_fn(|k| (corners[(k + 1) % 4] - corners[k]).perp_dot(p - corners[k]));
    sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0)
}

/// GPU data of the gizmo.
#[derive(Debug)]
pub(super) struct GizmoShape {
    vertices: wgpu::Buffer,
    /// Numbers of vertices in the gizmo's frame and, after them, in the frame that faces the eye.
    counts: [u32; 2],
    /// Transforms of the gizmo's two frames: its own, and the one that faces the eye.
    transforms: [FrameTransform; 2],
    shape: Option<(GizmoMode, Option<GizmoPart>)>,
}

/// Transform of a frame of the gizmo.
#[derive(Debug)]
struct FrameTransform {
    uniform: wgpu::Buffer,
    bind_group: wgpu::BindGroup,
}

impl FrameTransform {
    fn write(&self, context: &GpuContext, size: f32, rotation: Quat, center: Vec3) {
        let transform = Mat4::from_scale_rotation_translation(Vec3::splat(size), rotation, center);
        let view = GizmoView { world_from_gizmo: transform.to_cols_array_2d() };
        context.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&view));
    }
}

impl GizmoShape {
    pub(super) fn new(context: &GpuContext, layouts: &Layouts) -> Self {
        let buffer = |label, size, usage| {
            context.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let transform = |label| {
            let uniform = buffer(label, size_of::<GizmoView>() as u64, wgpu::BufferUsages::UNIFORM);
            let bind_group = context.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(label),
                layout: &layouts.gizmo,
                entries: &[wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() }],
            });
            FrameTransform { uniform, bind_group }
        };
        let transforms = [transform("gizmo"), transform("gizmo's part that faces the eye")];
        let vertices = buffer("gizmo's shape", MAX_VERTICES * GIZMO_STRIDE, wgpu::BufferUsages::VERTEX);
        Self { vertices, counts: [0; 2], transforms, shape: None }
    }

    /// Updates the transforms and, if mode or active handle changed, the geometry.
    pub(super) fn update(&mut self, context: &GpuContext, gizmo: &Gizmo, camera: &Camera) {
        if self.shape != Some((gizmo.mode, gizmo.active)) {
            let mut vertices = shape(gizmo.mode, gizmo.active);
            let own = vertices.len() as u32;
            vertices.extend(facing_shape(gizmo.mode, gizmo.active));
            context.queue.write_buffer(&self.vertices, 0, bytemuck::cast_slice(&vertices));
            self.counts = [own, vertices.len() as u32 - own];
            self.shape = Some((gizmo.mode, gizmo.active));
        }
        let size = GIZMO_PX * camera.units_per_pixel(gizmo.center);
        let [own, towards_eye] = &self.transforms;
        own.write(context, size, gizmo.rotation, gizmo.center);
        towards_eye.write(context, size, facing(camera), gizmo.center);
    }

    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        let mut first = 0;
        // Browsers warn about empty draw calls.
        for (count, transform) in
            self.counts.into_iter().zip(&self.transforms).filter(|(count, _)| *count > 0)
        {
            pass.set_bind_group(1, &transform.bind_group, &[]);
            pass.draw(first..first + count, 0..1);
            first += count;
        }
    }
}

/// Colour of a handle: highlighted if it is active.
fn color(active: Option<GizmoPart>, part: GizmoPart, own: usize, alpha: f32) -> [f32; 4] {
    let [r, g, b, _] = linear(if active == Some(part) { ACTIVE_COLOR } else { AXES[own] });
    [r, g, b, alpha]
}

/// Triangles in the frame that faces the eye: the view ring.
fn facing_shape(mode: GizmoMode, active: Option<GizmoPart>) -> Vec<Vertex> {
    let mut out = Vec::new();
    if mode == GizmoMode::Rotate {
        ring(&mut out, 2, [VIEW_RING_RADIUS, TUBE_RADIUS], color(active, GizmoPart::View, 4, 1.0));
    }
    out
}

/// Triangles of the handles that are drawn in the gizmo's frame: all except the view ring.
fn shape(mode: GizmoMode, active: Option<GizmoPart>) -> Vec<Vertex> {
    let mut out = Vec::new();
    let color = |part, own, alpha| color(active, part, own, alpha);
    for axis in 0..3u8 {
        let own = color(GizmoPart::Axis(axis), usize::from(axis), 1.0);
        let turn = Quat::from_rotation_arc(Vec3::Z, unit(axis));
        match mode {
            GizmoMode::Rotate => ring(&mut out, axis, [1.0, TUBE_RADIUS], own),
            GizmoMode::Move => {
                cone(&mut out, turn, [AXIS_START, 0.80], [0.013, 0.013], own);
                cone(&mut out, turn, [0.78, 1.0], [0.058, 0.0], own);
                let across = color(GizmoPart::Plane(axis), usize::from(axis), 0.55);
                let [a, b, c, d] = plane_corners(axis);
                for p in [a, b, c, a, c, d] {
                    out.push(vertex(p, Vec3::ZERO, across));
                }
            }
            GizmoMode::Scale => {
                cone(&mut out, turn, [AXIS_START, 0.90], [0.013, 0.013], own);
                cube(&mut out, 0.94 * unit(axis), 0.055, own);
            }
        }
    }
    if mode != GizmoMode::Rotate {
        cube(&mut out, Vec3::ZERO, 0.05, color(GizmoPart::View, 3, 1.0));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene() -> (Camera, Gizmo) {
        let mut camera = Camera::default();
        (camera.yaw, camera.pitch) = (0.75, 0.6);
        camera.set_viewport(Vec2::new(800.0, 600.0));
        let gizmo = Gizmo {
            mode: GizmoMode::Move,
            center: Vec3::new(0.3, 0.1, -0.2),
            rotation: Quat::from_rotation_y(0.2),
            active: None,
        };
        (camera, gizmo)
    }

    /// Position in the picture of a point in the gizmo's frame.
    fn at(camera: &Camera, gizmo: &Gizmo, p: Vec3) -> Vec2 {
        let size = GIZMO_PX * camera.units_per_pixel(gizmo.center);
        camera.project(gizmo.center + size * (gizmo.rotation * p)).expect("the point is visible").position
    }

    #[test]
    fn every_handle_is_picked_where_it_is_drawn() {
        let (camera, mut gizmo) = scene();
        for mode in [GizmoMode::Move, GizmoMode::Scale] {
            gizmo.mode = mode;
            for axis in 0..3 {
                let cursor = at(&camera, &gizmo, 0.7 * unit(axis));
                assert_eq!(pick_gizmo(&camera, &gizmo, cursor, 0.0), Some(GizmoPart::Axis(axis)));
            }
            assert_eq!(
                pick_gizmo(&camera, &gizmo, at(&camera, &gizmo, Vec3::ZERO), 0.0),
                Some(GizmoPart::View)
            );
        }
        gizmo.mode = GizmoMode::Move;
        for axis in 0..3 {
            let cursor = at(&camera, &gizmo, 0.4 * (unit(axis + 1) + unit(axis + 2)));
            assert_eq!(pick_gizmo(&camera, &gizmo, cursor, 0.0), Some(GizmoPart::Plane(axis)));
        }
        gizmo.mode = GizmoMode::Rotate;
        for axis in 0..3u8 {
            let (sin, cos) = (0.6f32).sin_cos();
            let cursor = at(&camera, &gizmo, cos * unit(axis + 1) + sin * unit(axis + 2));
            assert_eq!(pick_gizmo(&camera, &gizmo, cursor, 0.0), Some(GizmoPart::Axis(axis)));
        }
        assert_eq!(pick_gizmo(&camera, &gizmo, Vec2::ZERO, 0.0), None);
    }

    #[test]
    fn view_ring_is_a_circle_outside_the_axis_rings() {
        let (mut camera, mut gizmo) = scene();
        gizmo.mode = GizmoMode::Rotate;
        // Put the gizmo at the picture's centre, where perspective does not distort circles that face the eye.
        camera.target = gizmo.center;
        let center = at(&camera, &gizmo, Vec3::ZERO);
        for k in 0..12 {
            let away = Vec2::from_angle(TAU * k as f32 / 12.0);
            for (radius, part) in [(1.0, Some(GizmoPart::View)), (1.0 + 12.0 / GIZMO_PX, None)] {
                let cursor = center + radius * VIEW_RING_RADIUS * GIZMO_PX * away;
                assert_eq!(pick_gizmo(&camera, &gizmo, cursor, 0.0), part, "{k}, {radius}");
            }
        }
        gizmo.mode = GizmoMode::Move;
        let cursor = center + VIEW_RING_RADIUS * GIZMO_PX * Vec2::NEG_Y;
        assert_eq!(pick_gizmo(&camera, &gizmo, cursor, 0.0), None, "arrows have no ring");
    }

    /// Touch input passes a larger pick radius.
    #[test]
    fn larger_radius_picks_near_handles_and_covered_ones_come_first() {
        let (camera, mut gizmo) = scene();
        for mode in [GizmoMode::Move, GizmoMode::Scale, GizmoMode::Rotate] {
            gizmo.mode = mode;
            let (tip, part) = match mode {
                GizmoMode::Rotate => (facing(&camera) * Vec3::X * VIEW_RING_RADIUS, GizmoPart::View),
                _ => (Vec3::Y, GizmoPart::Axis(1)),
            };
            let [center, end] = [Vec3::ZERO, gizmo.rotation.inverse() * tip].map(|p| at(&camera, &gizmo, p));
            let beyond = |pixels: f32| end + pixels * (end - center).normalize();
            for (pixels, finger, mouse) in
                [(7.0, Some(part), Some(part)), (20.0, Some(part), None), (28.0, None, None)]
            {
                assert_eq!(pick_gizmo(&camera, &gizmo, beyond(pixels), 24.0), finger, "{mode:?}, {pixels}");
                assert_eq!(pick_gizmo(&camera, &gizmo, beyond(pixels), 8.0), mouse, "{mode:?}, {pixels}");
            }
        }
        gizmo.mode = GizmoMode::Move;
        let square = at(&camera, &gizmo, 0.4 * (Vec3::X + Vec3::Y));
        assert_eq!(
            pick_gizmo(&camera, &gizmo, square, 24.0),
            Some(GizmoPart::Plane(2)),
            "axes are farther away"
        );
    }

    #[test]
    fn view_ring_faces_the_eye() {
        let (camera, _) = scene();
        assert!((facing(&camera) * Vec3::Z).abs_diff_eq(camera.backward(), 1e-6));
        assert!((facing(&camera) * Vec3::X).abs_diff_eq(camera.right(), 1e-6));
    }

    #[test]
    fn gizmo_size_is_independent_of_the_distance() {
        let (mut camera, gizmo) = scene();
        camera.target = gizmo.center;
        for distance in [2.0, 20.0] {
            camera.distance = distance;
            let length = at(&camera, &gizmo, gizmo.rotation.inverse() * camera.up()).distance(at(
                &camera,
                &gizmo,
                Vec3::ZERO,
            ));
            assert!((length - GIZMO_PX).abs() < 0.1, "{length}");
        }
    }

    #[test]
    fn shapes_fit_their_buffer() {
        for mode in [GizmoMode::Move, GizmoMode::Rotate, GizmoMode::Scale] {
            let n = (shape(mode, None).len() + facing_shape(mode, None).len()) as u64;
            assert!(n > 0 && n.is_multiple_of(3) && n <= MAX_VERTICES, "{mode:?}: {n}");
        }
        assert_eq!(size_of::<Vertex>() as u64, GIZMO_STRIDE);
    }
}
