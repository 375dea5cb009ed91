//! Triangles of the gizmo's solids.

use std::f32::consts::TAU;

use glam::{Quat, Vec3};

use super::{RING_SEGMENTS, Vertex, ring_points, unit};

/// Number of segments around cones and rods.
const CONE_SEGMENTS: u32 = 16;

/// A vertex. A zero normal disables shading.
pub(super) fn vertex(p: Vec3, n: Vec3, [r, g, b, a]: [f32; 4]) -> Vertex {
    [p.x, p.y, p.z, n.x, n.y, n.z, r, g, b, a]
}

/// Appends the triangles of an axis-aligned cube to `out`.
pub(super) fn cube(out: &mut Vec<Vertex>, center: Vec3, half: f32, color: [f32; 4]) {
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

/// Appends a rotated cone or frustum to `out`: along z from `z[0]` to `z[1]`, closed at its lower end.
pub(super) fn cone(out: &mut Vec<Vertex>, turn: Quat, z: [f32; 2], radius: [f32; 2], color: [f32; 4]) {
    let around = |k: u32| {
        let (sin, cos) = (TAU * k as f32 / CONE_SEGMENTS as f32).sin_cos();
        Vec3::new(cos, sin, 0.0)
    };
    for k in 0..CONE_SEGMENTS {
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

/// Appends a torus about an axis to `out`. `radius`: distance of the tube's centre line from the axis; `tube`: radius
/// of the tube.
pub(super) fn ring(out: &mut Vec<Vertex>, axis: u8, [radius, tube]: [f32; 2], color: [f32; 4]) {
    const SIDES: u32 = 8;
    let points: Vec<Vec3> = ring_points(axis).collect();
    let at = |k: u32, s: u32| {
        let p = points[(k % RING_SEGMENTS) as usize];
        let (sin, cos) = (TAU * (s % SIDES) as f32 / SIDES as f32).sin_cos();
        let n = cos * p + sin * unit(axis);
        (radius * p + tube * n, n)
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
