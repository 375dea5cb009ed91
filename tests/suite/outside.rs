//! Mesh vertices outside the cage.

use cagework_core::bind::BindError;
use cagework_core::deform::deform_bound;
use cagework_core::options::OutsidePolicy;
use cagework_tests::cages::{c_shape, cage, cuboid, moved, sphere};
use cagework_tests::{Random, points};
use glam::Vec3;

use super::BackEnd;

/// Rounding of rotated f32 positions of size 10.
const RIGID: f32 = 1e-5;

/// Corners of a box around the C, and points inside it.
fn some_outside(n_inside: usize) -> (Vec<Vec3>, Vec<u32>) {
    let mut vertices = points::inside(&cage(&c_shape()), n_inside, 40);
    let around = cuboid(Vec3::splat(-0.5), Vec3::new(4.5, 3.5, 1.5)).positions;
    // In the gap of the C: outside, though in the middle of its box.
    let gap = [Vec3::new(2.5, 1.5, 0.5), Vec3::new(3.9, 1.2, 0.3)];
    let mut outside = Vec::new();
    for (k, p) in around.into_iter().chain(gap).enumerate() {
        let at = (3 * k).min(vertices.len());
        vertices.insert(at, p);
        outside.push(at as u32);
    }
    (vertices, outside)
}

pub(crate) fn vertices_outside_are_listed_and_follow_rigidly(back_end: &BackEnd) {
    let cage = cage(&c_shape());
    let (vertices, outside) = some_outside(200);
    let binding = back_end.bind_with(&vertices, &cage, |o| o.grid = 32);
    let listed: Vec<u32> = binding.outside.iter().map(|o| o.vertex).collect();
    if back_end.is_embedded() {
        assert_eq!(listed, outside);
    } else {
        // A cell that the cage touches has weights, on either side of the cage.
        assert!(listed.iter().all(|v| outside.contains(v)) && listed.len() >= 9, "{listed:?}");
    }
    assert_eq!(binding.report.outside_vertices, listed.len() as u64);
    let (turn, shift) = (Random::new(41).rotation(), Vec3::new(2.0, -1.0, 3.0));
    let posed: Vec<Vec3> = cage.positions().iter().map(|&c| turn * c + shift).collect();
    let deformed = deform_bound(&binding.weights, &binding.outside, &posed);
    let rest = deform_bound(&binding.weights, &binding.outside, cage.positions());
    for &v in &listed {
        let v = v as usize;
        assert!(rest[v].distance(vertices[v]) <= RIGID, "vertex {v} rests at {}", rest[v]);
        let expected = turn * vertices[v] + shift;
        assert!(deformed[v].distance(expected) <= RIGID, "vertex {v} at {}, not {expected}", deformed[v]);
    }
}

pub(crate) fn refusal_names_count_and_first_vertex(back_end: &BackEnd) {
    let cage = cage(&c_shape());
    let mut vertices = points::inside(&cage, 20, 42);
    vertices[11] = Vec3::new(-9.0, 0.0, 0.0);
    vertices[5] = Vec3::new(0.0, 9.0, 0.0);
    // A repeat of a vertex outside counts once, by its position.
    let error = back_end.try_bind(&vertices, &cage, |o| o.outside = OutsidePolicy::Refuse).unwrap_err();
    assert_eq!(error, BindError::Outside { count: 2, first: 5 });
    let message = error.to_string();
    assert!(message.contains("2 mesh vertices") && message.contains("vertex 5"), "{message}");
    vertices.retain(|p| p.abs().max_element() < 5.0);
    let inside = back_end.bind_with(&vertices, &cage, |o| o.outside = OutsidePolicy::Refuse);
    assert_eq!(inside.report.outside_vertices, 0);
}

/// A cage elsewhere, or in another unit.
pub(crate) fn cage_around_nothing_is_refused(back_end: &BackEnd) {
    let vertices = points::inside(&cage(&c_shape()), 20, 45);
    let away = cage(&moved(&c_shape(), |p| p + Vec3::new(0.0, 0.0, 2e4)));
    let small = cage(&moved(&c_shape(), |p| Vec3::new(2.5, 1.5, 0.5) + 1e-3 * p));
    for outside in [OutsidePolicy::ClosestPoint, OutsidePolicy::Refuse] {
        for (cage, said) in [(&away, "2e4 away"), (&small, "times smaller")] {
            let error = back_end.try_bind(&vertices, cage, |o| o.outside = outside).unwrap_err();
            assert!(matches!(error, BindError::NoneInside { vertices: 20, .. }), "{error:?}");
            assert!(error.to_string().contains(said), "{error}");
        }
    }
}

/// Vertices of a cage made from the model, or a model that touches its cage: on it, whatever rounding says.
pub(crate) fn vertices_on_the_cage_are_not_outside(back_end: &BackEnd) {
    let turn = Random::new(43).rotation();
    for mesh in [moved(&c_shape(), |p| turn * p), sphere(2)] {
        let cage = cage(&mesh);
        let mut random = Random::new(44);
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
