//! Tests of rendered splats: their shapes and drawing order, deformation by a field, and drawing without storage
//! buffers.

#![expect(clippy::unwrap_used, reason = "helpers of tests: a panic is a failed test")]

mod support;

use std::sync::Arc;

use cagework_core::field::{Field, FieldWeights};
use cagework_core::options::BindOptions;
use cagework_core::progress::NoProgress;
use cagework_core::splats::{Splats, n_harmonics};
use cagework_core::{Bounds, Cage, subdivided_box};
use cagework_gpu::render::{DrawModel, Projection, SceneOptions, ViewOptions};
use cagework_gpu::{GpuContext, Session};
use glam::{Quat, Vec2, Vec3};
use support::{Rng, gpu};

const SIZE: [u32; 2] = [160, 160];

/// A session with splats and no mesh, seen from the front.
fn session(context: &GpuContext, splats: Splats) -> Session {
    let mut session = Session::new(context.clone());
    let model = DrawModel { splats: Some(Arc::new(splats)), ..DrawModel::default() };
    pollster::block_on(session.set_model(model)).unwrap();
    let view = ViewOptions { floor: false, ..ViewOptions::default() };
    let nothing = SceneOptions { view, backdrop: false, ..SceneOptions::default() };
    session.set_scene(nothing);
    let camera = session.camera_mut();
    (camera.yaw, camera.pitch, camera.projection) = (0.0, 0.0, Projection::Orthographic);
    camera.set_viewport(Vec2::from(SIZE.map(|s| s as f32)));
    let bounds = Bounds { min: Vec3::splat(-1.5), max: Vec3::splat(1.5) };
    camera.set_scene(bounds);
    camera.frame(bounds);
    session
}

fn picture(session: &mut Session) -> Vec<[u8; 4]> {
    pollster::block_on(session.picture(SIZE, 1.0)).unwrap().as_chunks().0.to_vec()
}

fn pixel(picture: &[[u8; 4]], x: u32, y: u32) -> [u8; 4] {
    picture[(y * SIZE[0] + x) as usize]
}

fn one(position: Vec3, scale: Vec3, color: Vec3, opacity: f32) -> Splats {
    Splats {
        positions: vec![position],
        scales: vec![scale],
        rotations: vec![Quat::IDENTITY],
        opacities: vec![opacity],
        colors: vec![color],
        ..Splats::default()
    }
}

fn joined(parts: &[Splats]) -> Splats {
    let mut all = Splats::default();
    for part in parts {
        all.positions.extend(&part.positions);
        all.scales.extend(&part.scales);
        all.rotations.extend(&part.rotations);
        all.opacities.extend(&part.opacities);
        all.colors.extend(&part.colors);
    }
    all
}

/// The alpha of a splat is its opacity times exp(-d^2 / 2). Here d is the distance from the centre, divided along each
/// axis by the standard deviation in pixels; 3DGS adds 0.3 square pixels to each variance.
#[test]
fn splat_is_a_gaussian() {
    let context = gpu();
    let turn = Quat::from_rotation_z(0.5);
    let mut splats = one(Vec3::ZERO, Vec3::new(0.4, 0.1, 0.2), Vec3::new(1.0, 0.5, 0.0), 0.8);
    splats.rotations[0] = turn;
    let mut session = session(&context, splats);
    let drawn = picture(&mut session);
    let unit = session.camera().units_per_pixel(Vec3::ZERO);
    for (x, y) in [(80, 80), (90, 75), (60, 85), (85, 95), (100, 70), (20, 80)] {
        let at = Vec2::new(x as f32 + 0.5 - 80.0, 80.0 - (y as f32 + 0.5));
        let along = (turn.inverse() * at.extend(0.0)).truncate();
        let variance = (Vec2::new(0.4, 0.1) / unit).powf(2.0) + 0.3;
        let alpha = 0.8 * (-0.5 * (along * along / variance).element_sum()).exp();
        let [r, g, b, a] = pixel(&drawn, x, y);
        // The layer of splats and the picture are both rounded to bytes, so alpha can differ by 2 of 255.
        assert!((f32::from(a) - 255.0 * alpha).abs() <= 2.0, "{x}, {y}: {a}, not {}", 255.0 * alpha);
        if a > 100 {
            assert!(r >= 252 && g.abs_diff(128) <= 4 && b == 0, "{:?}", [r, g, b]);
        }
    }
}

#[test]
fn near_splats_cover_far_ones_from_every_side() {
    let context = gpu();
    let color = |z: f32| if z > 0.0 { Vec3::X } else { Vec3::Y };
    let disc = |z: f32| one(Vec3::new(0.0, 0.0, z), Vec3::splat(0.3), color(z), 1.0);
    let mut session = session(&context, joined(&[disc(0.5), disc(-0.5)]));
    assert!(pixel(&picture(&mut session), 80, 80)[0] > 240, "red is in front");
    session.camera_mut().yaw = std::f32::consts::PI;
    assert!(pixel(&picture(&mut session), 80, 80)[1] > 240, "green is in front");
    session.set_floaters(&[1]);
    let view = ViewOptions { floaters: false, ..session.scene().view };
    session.set_scene(SceneOptions { view, ..session.scene().clone() });
    assert!(pixel(&picture(&mut session), 80, 80)[0] > 240, "green is hidden");
}

/// A bar along y of red and green splats, whose colours also depend on the viewing direction, a box cage around the
/// bar, a pose that bends the cage by 90 degrees, and the field of this pose.
fn bent_bar() -> (Splats, Cage, Vec<Vec3>, Field) {
    let mut rng = Rng(31);
    let dot = |k: u32, rng: &mut Rng| {
        let y = k as f32 / 1500.0 - 1.0;
        let side = if k.is_multiple_of(2) { Vec3::X } else { Vec3::Y };
        one(
            Vec3::new(0.4 * rng.unit() - 0.2, y, 0.4 * rng.unit() - 0.2),
            Vec3::new(0.06, 0.05, 0.03),
            side,
            0.98,
        )
    };
    let mut splats = joined(&(0..3000).map(|k| dot(k, &mut rng)).collect::<Vec<_>>());
    splats.degree = 3;
    splats.harmonics =
        (0..3000 * n_harmonics(3)).map(|k| Vec3::splat(0.2 * ((k % 15) as f32).sin())).collect();
    let bounds = Bounds { min: Vec3::new(-0.4, -1.2, -0.4), max: Vec3::new(0.4, 1.2, 0.4) };
    let cage = Cage::new(&subdivided_box(bounds, 0.0, [1, 8, 1])).unwrap();
    // A circular arc of length 2.4 about a point at x = 2.4 / (pi / 2).
    let radius = 2.4 / std::f32::consts::FRAC_PI_2;
    let bend = |p: &Vec3| {
        let (sin, cos) = (p.y / radius).sin_cos();
        Vec3::new(radius - (radius - p.x) * cos, (radius - p.x) * sin, p.z)
    };
    let pose: Vec<Vec3> = cage.positions().iter().map(bend).collect();
    let options = BindOptions { grid: 48, ..BindOptions::default() };
    let weights = FieldWeights::bind(&cage, 32, &options, &NoProgress).unwrap();
    let field = weights.pose(cage.positions(), &pose);
    (splats, cage, pose, field)
}

/// Sum of the absolute differences of all bytes, divided by the sum of all bytes of both pictures.
fn difference(a: &[[u8; 4]], b: &[[u8; 4]]) -> f64 {
    let pairs = || a.as_flattened().iter().zip(b.as_flattened());
    let total: f64 = pairs().map(|(a, b)| f64::from(*a) + f64::from(*b)).sum();
    pairs().map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / total
}

/// Divides the pictures into squares of 10 x 10 pixels. Returns the largest difference between the mean values of a
/// channel in a square, 0 to 255. If two splats are drawn in the wrong order, this difference is up to 60.
fn worst_square(a: &[[u8; 4]], b: &[[u8; 4]]) -> f64 {
    let mut sums = [[0.0; 4]; 256];
    for (k, (a, b)) in a.iter().zip(b).enumerate() {
        let square = &mut sums[k / 1600 * 16 + k % 160 / 10];
        for (sum, (a, b)) in square.iter_mut().zip(a.iter().zip(b)) {
            *sum += f64::from(*a) - f64::from(*b);
        }
    }
    sums.as_flattened().iter().fold(0.0, |worst: f64, sum| worst.max(sum.abs() / 100.0))
}

/// The picture of splats that kernels bend equals the picture of the exported bent splats, although these have other
/// bounds and are sorted into other bins of depth.
#[test]
fn bent_splats_look_like_their_export() {
    let context = gpu();
    let (splats, cage, pose, field) = bent_bar();
    let exported = picture(&mut session(&context, splats.deformed(&field)));
    let mut session = session(&context, splats);
    pollster::block_on(session.set_cage(&cage)).unwrap();
    session.set_scene(SceneOptions { cage_lines: false, handles: false, ..session.scene().clone() });
    let at_rest = picture(&mut session);
    session.pose(&pose);
    session.set_field(Some(field), &pose);
    let bent = picture(&mut session);
    assert!(difference(&bent, &exported) < 2e-3, "{}", difference(&bent, &exported));
    assert!(worst_square(&bent, &exported) < 2.0, "{}", worst_square(&bent, &exported));
    assert!(difference(&bent, &at_rest) > 0.1, "the pose is visible: {}", difference(&bent, &at_rest));
    // Drawing again gives the same frame, and without a field the splats are drawn at rest.
    assert_eq!(picture(&mut session), bent);
    session.set_field(None, &pose);
    assert!(difference(&picture(&mut session), &at_rest) < 1e-3);
}

/// Without storage buffers, the CPU deforms and sorts the splats.
#[cfg(feature = "webgl")]
#[test]
fn splats_look_the_same_without_kernels() {
    let (splats, cage, pose, field) = bent_bar();
    let options = cagework_gpu::ContextOptions { draws_only: true, ..Default::default() };
    let pictures = [gpu(), support::gpu_with(&options)].map(|context| {
        let mut session = session(&context, splats.clone());
        pollster::block_on(session.set_cage(&cage)).unwrap();
        session.set_scene(SceneOptions { cage_lines: false, handles: false, ..session.scene().clone() });
        session.pose(&pose);
        session.set_field(Some(field.clone()), &pose);
        picture(&mut session)
    });
    let [with, without] = &pictures;
    assert!(difference(with, without) < 2e-3, "{}", difference(with, without));
}
