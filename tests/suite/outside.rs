//! Mesh vertices outside the cage.

use cagework_core::PolygonMesh;
use cagework_core::bind::BindError;
use cagework_core::deform::deform_bound;
use cagework_core::options::OutsidePolicy;
use cagework_tests::cages::{c_shape, cage, cuboid, moved, sphere};
use cagework_tests::{RandomGenerator, points};
use glam::{Mat3, Quat, Vec3};

use super::BackEnd;

/// Allowed distance of a deformed vertex from its expected position, object units: 1e-5 times 5, the largest extent of
/// the points of [`some_outside`].
const AFFINE_TOLERANCE: f32 = 5e-5;

/// Creates three groups of points: inside the C-shaped cage; outside, but within 5 % of the cage's diagonal of 5.1,
/// some of them in the gap of the C; and corners of a box, farther away than 15 % of the diagonal. Returns all points,
/// the indices of the second group, and the indices of the third.
fn some_outside(n_inside: usize) -> (Vec<Vec3>, Vec<u32>, Vec<u32>) {
    let mut vertices = points::inside(&cage(&c_shape()), n_inside, 40);
    let near = [[-0.2, 1.5, 0.5], [2.0, -0.1, 0.4], [2.5, 1.2, 0.5], [3.0, 1.9, 0.7], [1.5, 0.3, 1.2]]
        .map(Vec3::from);
    let far = cuboid(Vec3::splat(-0.5), Vec3::new(4.5, 3.5, 1.5)).positions;
    let mut lists = [Vec::new(), Vec::new()];
    let all = near.iter().map(|p| (0, *p)).chain(far.into_iter().map(|p| (1, p)));
    for (k, (list, p)) in all.enumerate() {
        let at = (3 * k).min(vertices.len());
        vertices.insert(at, p);
        lists[list].push(at as u32);
    }
    let [near, far] = lists;
    (vertices, near, far)
}

pub(crate) fn vertices_near_the_cage_follow_affine_maps_and_far_ones_stay(back_end: &BackEnd) {
    let cage = cage(&c_shape());
    let (vertices, near, far) = some_outside(200);
    let matrix = Mat3::from_cols_array(&[1.4, 0.3, -0.2, 0.1, 0.8, 0.4, -0.5, 0.2, 1.1]);
    let moved = |p: Vec3| matrix * p + Vec3::new(2.0, -1.0, 3.0);
    let posed: Vec<Vec3> = cage.positions().iter().map(|&c| moved(c)).collect();
    for policy in [OutsidePolicy::Extend, OutsidePolicy::Stay] {
        let binding = back_end.bind_with(&vertices, &cage, |o| (o.grid, o.outside) = (32, policy));
        let listed: Vec<u32> = binding.outside.iter().map(|o| o.vertex).collect();
        assert_eq!(binding.report.outside_vertices, listed.len() as u64);
        let deformed = deform_bound(&binding.weights, &binding.frames, &posed);
        let rest = deform_bound(&binding.weights, &binding.frames, cage.positions());
        for &v in &far {
            assert!(
                deformed[v as usize].distance(vertices[v as usize]) <= AFFINE_TOLERANCE,
                "{policy}: {v} moves"
            );
        }
        for &v in &listed {
            assert!(
                rest[v as usize].distance(vertices[v as usize]) <= AFFINE_TOLERANCE,
                "{policy}: vertex {v} at rest"
            );
        }
        // The classic method also assigns weights outside the cage, in cells that the cage intersects.
        if back_end.is_embedded() {
            let mut expected = [near.as_slice(), &far].concat();
            expected.sort_unstable();
            assert_eq!(listed, expected);
            let stays = if policy == OutsidePolicy::Stay { listed.len() } else { far.len() };
            assert_eq!(binding.report.staying_vertices, stays as u64);
            for &v in &near {
                let p = vertices[v as usize];
                let expected = if policy == OutsidePolicy::Stay { p } else { moved(p) };
                let at = deformed[v as usize];
                assert!(at.distance(expected) <= AFFINE_TOLERANCE, "{policy}: {p} at {at}, not {expected}");
            }
        }
    }
}

/// A round bar that protrudes from an octagonal prism by up to 1.2 % of its diagonal is twisted by one radian per unit.
/// The twist shears the surface at radius r = 1/2 by 1/2, so that it stretches edges by at most the larger singular
/// value of that shear, 1.28.
pub(crate) fn protruding_model_deforms_smoothly(back_end: &BackEnd) {
    let ring = |n: u16, r: f32, z: f32| {
        (0..n).map(move |k| {
            let (sin, cos) = (std::f32::consts::TAU * f32::from(k) / f32::from(n)).sin_cos();
            Vec3::new(r * cos, r * sin, z)
        })
    };
    let positions: Vec<Vec3> = (0..6u8).flat_map(|l| ring(8, 0.51, 0.42 * f32::from(l) - 1.05)).collect();
    let side = |l: u32, k: u32| vec![8 * l + k, 8 * l + (k + 1) % 8, 8 * l + 8 + (k + 1) % 8, 8 * l + 8 + k];
    let mut faces: Vec<Vec<u32>> = (0..5).flat_map(|l| (0..8).map(move |k| side(l, k))).collect();
    faces.extend([(0..8).rev().collect(), (40..48).collect()]);
    let cage = cage(&PolygonMesh { positions, faces });
    let (n, n_rings) = (48, 41u16);
    let bar: Vec<Vec3> =
        (0..n_rings).flat_map(|l| ring(n, 0.5, f32::from(l) / 20.0 - 1.0)).chain([Vec3::ZERO]).collect();
    let twist = |p: &Vec3| Quat::from_rotation_z(p.z) * *p;
    let binding = back_end.bind_with(&bar, &cage, |o| o.grid = 32);
    let posed: Vec<Vec3> = cage.positions().iter().map(twist).collect();
    let moved = deform_bound(&binding.weights, &binding.frames, &posed);
    if !back_end.is_embedded() {
        return;
    }
    assert!(binding.report.outside_vertices > 1000, "{}", binding.report.outside_vertices);
    let n = usize::from(n);
    for k in 0..n * (usize::from(n_rings) - 1) {
        for other in [k + n, k - k % n + (k + 1) % n, k - k % n + n + (k + 1) % n] {
            let stretch = moved[k].distance(moved[other]) / bar[k].distance(bar[other]);
            assert!((0.95..1.3).contains(&stretch), "{}: {stretch}", bar[k]);
        }
    }
}

/// With a cage around one end of a bar, vertices beyond 15 % of the cage's diagonal are bit-identical after
/// deformation.
pub(crate) fn partial_cage_leaves_the_rest_of_the_model(back_end: &BackEnd) {
    let cage = cage(&cuboid(Vec3::new(0.0, -0.3, -0.3), Vec3::new(1.0, 0.3, 0.3)));
    let bar: Vec<Vec3> = (0..100u8).map(|k| Vec3::new(f32::from(k) / 50.0 - 1.0, 0.1, 0.05)).collect();
    let binding = back_end.bind_with(&bar, &cage, |o| o.grid = 16);
    let posed: Vec<Vec3> = cage.positions().iter().map(|&p| p + Vec3::new(0.3, 0.5, 0.0) * p.x).collect();
    let moved = deform_bound(&binding.weights, &binding.frames, &posed);
    let reach = 0.15 * cage.diagonal();
    for (p, at) in bar.iter().zip(&moved) {
        assert!(p.x > -reach || at == p, "{p} goes to {at}");
    }
    if !back_end.is_embedded() {
        return;
    }
    // The displacement is continuous along the bar.
    let steps = moved.windows(2).map(|w| w[0].distance(w[1]));
    assert!(steps.fold(0.0, f32::max) < 0.03, "the pose stretches steps of 0.02 to 0.0233 inside the cage");
}

pub(crate) fn refusal_names_count_and_first_vertex(back_end: &BackEnd) {
    let cage = cage(&c_shape());
    let mut vertices = points::inside(&cage, 20, 42);
    vertices[11] = Vec3::new(-9.0, 0.0, 0.0);
    vertices[5] = Vec3::new(0.0, 9.0, 0.0);
    // Vertices outside with equal positions count once.
    let error = back_end.try_bind(&vertices, &cage, |o| o.outside = OutsidePolicy::Refuse).unwrap_err();
    assert_eq!(error, BindError::Outside { count: 2, first: 5 });
    let message = error.to_string();
    assert!(message.contains("2 mesh vertices") && message.contains("vertex 5"), "{message}");
    vertices.retain(|p| p.abs().max_element() < 5.0);
    let inside = back_end.bind_with(&vertices, &cage, |o| o.outside = OutsidePolicy::Refuse);
    assert_eq!(inside.report.outside_vertices, 0);
}

/// Cages that contain no vertex: far away, or in another unit of length.
pub(crate) fn cage_that_contains_no_vertex_is_rejected(back_end: &BackEnd) {
    let vertices = points::inside(&cage(&c_shape()), 20, 45);
    let away = cage(&moved(&c_shape(), |p| p + Vec3::new(0.0, 0.0, 2e4)));
    let small = cage(&moved(&c_shape(), |p| Vec3::new(2.5, 1.5, 0.5) + 1e-3 * p));
    for outside in [OutsidePolicy::Extend, OutsidePolicy::Refuse] {
        for (cage, message) in [(&away, "2e4 away"), (&small, "times smaller")] {
            let error = back_end.try_bind(&vertices, cage, |o| o.outside = outside).unwrap_err();
            assert!(matches!(error, BindError::NoneInside { vertices: 20, .. }), "{error:?}");
            assert!(error.to_string().contains(message), "{error}");
        }
    }
}

/// Vertices on the surface of the cage count as inside in spite of rounding.
pub(crate) fn vertices_on_the_cage_are_not_outside(back_end: &BackEnd) {
    let turn = RandomGenerator::new(43).rotation();
    for mesh in [moved(&c_shape(), |p| turn * p), sphere(2)] {
        let cage = cage(&mesh);
        let mut random = RandomGenerator::new(44);
        let vertices: Vec<Vec3> = (0..cage.triangles().len() as u32)
            .flat_map(|t| {
                let [a, b, c] = cage.triangle_corners(t);
                let (u, v) = (f64::from(random.unit()), f64::from(random.unit()));
                [(u * (1.0 - v), u * v), (u, 0.0), (0.0, 1.0)]
                    .map(|(u, v)| (a + u * (b - a) + v * (c - a)).as_vec3())
            })
            .collect();
        let binding = back_end.bind(&vertices, &cage);
        assert_eq!(binding.outside, []);
        let diagonal = f64::from(cage.diagonal());
        super::assert_combined(&binding.weights, cage.positions(), &vertices, 1e-5 * diagonal);
    }
}
