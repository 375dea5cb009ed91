//! The gizmo: its shape, where it is on the GPU, and which part is under the pointer.

use std::f32::consts::TAU;

use glam::{Mat4, Quat, Vec2, Vec3};

use super::camera::Camera;
use super::layout::GizmoView;
use super::pipelines::{GIZMO_STRIDE, Layouts};
use super::scene::{Gizmo, GizmoMode, GizmoPart};
use super::theme::{ACTIVE, AXES, linear};
use crate::device::GpuContext;

/// Length of an axis in the picture, CSS pixels.
pub const GIZMO_PX: f32 = 84.0;

/// How near the pointer must be, CSS pixels.
const REACH_PX: f32 = 8.0;

/// Where an axis begins, over its length: inside it the whole is grabbed.
const AXIS_START: f32 = 0.16;

/// The square of a plane, from and to, along both of its axes.
const PLANE: [f32; 2] = [0.30, 0.50];

/// Segments of a ring, and around cones and rods.
const RING_SEGMENTS: u32 = 64;
const AROUND: u32 = 16;

/// Most vertices of a gizmo: three rings of 64 x 8 quads are the largest.
const MAX_VERTICES: u64 = 3 * 64 * 8 * 6;

type Vertex = [f32; 10];

/// The part of a gizmo under the pointer. `cursor`: pixels of the camera's viewport.
#[must_use]
pub fn pick_gizmo(camera: &Camera, gizmo: &Gizmo, cursor: Vec2) -> Option<GizmoPart> {
    let size = GIZMO_PX * camera.units_per_pixel(gizmo.center);
    let at = |p: Vec3| camera.project(gizmo.center + size * (gizmo.rotation * p)).map(|p| p.position);
    let center = at(Vec3::ZERO)?;
    if gizmo.mode != GizmoMode::Rotate && center.distance(cursor) <= 1.2 * REACH_PX {
        return Some(GizmoPart::View);
    }
    let mut best: Option<(f32, GizmoPart)> = None;
    for axis in 0..3u8 {
        let distance = match gizmo.mode {
            GizmoMode::Rotate => ring_points(axis)
                .zip(ring_points(axis).cycle().skip(1))
                .filter_map(|(a, b)| Some(to_segment(cursor, at(a)?, at(b)?)))
                .fold(f32::INFINITY, f32::min),
            GizmoMode::Move | GizmoMode::Scale => {
                let along = unit(axis);
                match (at(AXIS_START * along), at(along)) {
                    (Some(a), Some(b)) => to_segment(cursor, a, b),
                    _ => f32::INFINITY,
                }
            }
        };
        if distance <= REACH_PX && best.is_none_or(|(d, _)| distance < d) {
            best = Some((distance, GizmoPart::Axis(axis)));
        }
    }
    if best.is_none() && gizmo.mode == GizmoMode::Move {
        for axis in 0..3u8 {
            let corners = plane_corners(axis).map(at);
            let [Some(a), Some(b), Some(c), Some(d)] = corners else { continue };
            if is_in_quad(cursor, [a, b, c, d]) {
                return Some(GizmoPart::Plane(axis));
            }
        }
    }
    best.map(|(_, part)| part)
}

fn unit(axis: u8) -> Vec3 {
    [Vec3::X, Vec3::Y, Vec3::Z][usize::from(axis % 3)]
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
    let [a, b] = PLANE;
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

/// A gizmo as it is drawn.
#[derive(Debug)]
pub(super) struct GizmoShape {
    vertices: wgpu::Buffer,
    count: u32,
    uniform: wgpu::Buffer,
    bind_group: wgpu::BindGroup,
    shape: Option<(GizmoMode, Option<GizmoPart>)>,
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
        let uniform = buffer("gizmo", size_of::<GizmoView>() as u64, wgpu::BufferUsages::UNIFORM);
        let bind_group = context.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("gizmo"),
            layout: &layouts.gizmo,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() }],
        });
        let vertices = buffer("gizmo's shape", MAX_VERTICES * GIZMO_STRIDE, wgpu::BufferUsages::VERTEX);
        Self { vertices, count: 0, uniform, bind_group, shape: None }
    }

    /// Writes the shape, if it changed, and where it is in this camera.
    pub(super) fn update(&mut self, context: &GpuContext, gizmo: &Gizmo, camera: &Camera) {
        if self.shape != Some((gizmo.mode, gizmo.active)) {
            let vertices = shape(gizmo.mode, gizmo.active);
            context.queue.write_buffer(&self.vertices, 0, bytemuck::cast_slice(&vertices));
            self.count = vertices.len() as u32;
            self.shape = Some((gizmo.mode, gizmo.active));
        }
        let size = GIZMO_PX * camera.units_per_pixel(gizmo.center);
        let place = Mat4::from_scale_rotation_translation(Vec3::splat(size), gizmo.rotation, gizmo.center);
        let view = GizmoView { world_from_gizmo: place.to_cols_array_2d() };
        context.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&view));
    }

    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(1, &self.bind_group, &[]);
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.draw(0..self.count, 0..1);
    }
}

/// Triangles of a gizmo.
fn shape(mode: GizmoMode, active: Option<GizmoPart>) -> Vec<Vertex> {
    let mut out = Vec::new();
    let color = |part: GizmoPart, own: usize, alpha: f32| {
        let [r, g, b, _] = linear(if active == Some(part) { ACTIVE } else { AXES[own] });
        [r, g, b, alpha]
    };
    for axis in 0..3u8 {
        let own = color(GizmoPart::Axis(axis), usize::from(axis), 1.0);
        let turn = Quat::from_rotation_arc(Vec3::Z, unit(axis));
        match mode {
            GizmoMode::Rotate => ring(&mut out, axis, 0.014, own),
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

fn vertex(p: Vec3, n: Vec3, [r, g, b, a]: [f32; 4]) -> Vertex {
    [p.x, p.y, p.z, n.x, n.y, n.z, r, g, b, a]
}

fn cube(out: &mut Vec<Vertex>, center: Vec3, half: f32, color: [f32; 4]) {
    for axis in 0..3u8 {
        for sign in [-1.0, 1.0] {
            let n = sign * unit(axis);
            let (u, v) = (unit(axis + 1), unit(axis + 2));
            let corner = |a: f32, b: f32| center + half * (n + a * u + b * v);
            for p in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                out.push(vertex(corner(p.0, p.1), n, color));
            }
        }
    }
}

/// A cone, rod or stump along z from `z[0]` to `z[1]`, turned; its lower end is closed.
fn cone(out: &mut Vec<Vertex>, turn: Quat, z: [f32; 2], radius: [f32; 2], color: [f32; 4]) {
    let around = |k: u32| {
        let (sin, cos) = (TAU * k as f32 / AROUND as f32).sin_cos();
        Vec3::new(cos, sin, 0.0)
    };
    for k in 0..AROUND {
        let (d, e) = (around(k), around(k + 1));
        let at = |d: Vec3, end: usize| turn * (radius[end] * d + z[end] * Vec3::Z);
        for (p, n) in
            [(at(d, 0), d), (at(e, 0), e), (at(e, 1), e), (at(d, 0), d), (at(e, 1), e), (at(d, 1), d)]
        {
            out.push(vertex(p, turn * n, color));
        }
        for p in [turn * (z[0] * Vec3::Z), at(e, 0), at(d, 0)] {
            out.push(vertex(p, turn * -Vec3::Z, color));
        }
    }
}

/// A ring of radius 1 around an axis.
fn ring(out: &mut Vec<Vertex>, axis: u8, radius: f32, color: [f32; 4]) {
    const SIDES: u32 = 8;
    let points: Vec<Vec3> = ring_points(axis).collect();
    let at = |k: u32, s: u32| {
        let p = points[(k % RING_SEGMENTS) as usize];
        let (sin, cos) = (TAU * (s % SIDES) as f32 / SIDES as f32).sin_cos();
        let n = cos * p + sin * unit(axis);
        (p + radius * n, n)
    };
    for k in 0..RING_SEGMENTS {
        for s in 0..SIDES {
            for (p, n) in [at(k, s), at(k + 1, s), at(k + 1, s + 1), at(k, s), at(k + 1, s + 1), at(k, s + 1)]
            {
                out.push(vertex(p, n, color));
            }
        }
    }
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

    /// Where a point of the gizmo's own space is in the picture.
    fn at(camera: &Camera, gizmo: &Gizmo, p: Vec3) -> Vec2 {
        let size = GIZMO_PX * camera.units_per_pixel(gizmo.center);
        camera.project(gizmo.center + size * (gizmo.rotation * p)).expect("it is in front").position
    }

    #[test]
    fn every_part_is_found_where_it_is_drawn() {
        let (camera, mut gizmo) = scene();
        for mode in [GizmoMode::Move, GizmoMode::Scale] {
            gizmo.mode = mode;
            for axis in 0..3 {
                let cursor = at(&camera, &gizmo, 0.7 * unit(axis));
                assert_eq!(pick_gizmo(&camera, &gizmo, cursor), Some(GizmoPart::Axis(axis)));
            }
            assert_eq!(pick_gizmo(&camera, &gizmo, at(&camera, &gizmo, Vec3::ZERO)), Some(GizmoPart::View));
        }
        gizmo.mode = GizmoMode::Move;
        for axis in 0..3 {
            let cursor = at(&camera, &gizmo, 0.4 * (unit(axis + 1) + unit(axis + 2)));
            assert_eq!(pick_gizmo(&camera, &gizmo, cursor), Some(GizmoPart::Plane(axis)));
        }
        gizmo.mode = GizmoMode::Rotate;
        for axis in 0..3u8 {
            let (sin, cos) = (0.6f32).sin_cos();
            let cursor = at(&camera, &gizmo, cos * unit(axis + 1) + sin * unit(axis + 2));
            assert_eq!(pick_gizmo(&camera, &gizmo, cursor), Some(GizmoPart::Axis(axis)));
        }
        assert_eq!(pick_gizmo(&camera, &gizmo, Vec2::ZERO), None);
    }

    #[test]
    fn size_in_the_picture_does_not_depend_on_the_distance() {
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
            let n = shape(mode, None).len() as u64;
            assert!(n > 0 && n.is_multiple_of(3) && n <= MAX_VERTICES, "{mode:?}: {n}");
        }
        assert_eq!(size_of::<Vertex>() as u64, GIZMO_STRIDE);
    }
}
