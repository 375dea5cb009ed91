//! Hard edges: a model whose faces share vertices, with a copy of a vertex for each further normal, is drawn like a
//! model with separate vertices for each face.

mod support;

use cagework_core::bind::bind;
use cagework_core::options::BindOptions;
use cagework_core::progress::NoProgress;
use cagework_core::{Bounds, Cage, subdivided_box};
use cagework_gpu::Session;
use cagework_gpu::render::{DrawModel, DrawVertex, SceneOptions};
use glam::Vec3;
use pollster::block_on;

const SIZE: [u32; 2] = [160, 120];

/// Tolerance for rounding of sums of eight f32 products near 1.
const ROUNDING: f32 = 1e-6;

/// Vertices and faces of a cube.
fn corners_of_cube() -> (Vec<Vec3>, Vec<[u32; 4]>) {
    let cube = subdivided_box(Bounds { min: Vec3::splat(-1.0), max: Vec3::ONE }, 0.0, [1; 3]);
    let faces = cube.faces.iter().map(|f| [f[0], f[1], f[2], f[3]]).collect();
    (cube.positions, faces)
}

fn triangles(faces: usize) -> Vec<[u32; 3]> {
    (0..faces as u32).flat_map(|f| [[4 * f, 4 * f + 1, 4 * f + 2], [4 * f, 4 * f + 2, 4 * f + 3]]).collect()
}

/// A cube of eight vertices, with a copy of a vertex for each further face that uses it.
fn with_copies() -> DrawModel {
    let (positions, faces) = corners_of_cube();
    let mut taken = [false; 8];
    let mut model = DrawModel { positions, triangles: triangles(faces.len()), ..DrawModel::default() };
    for &v in faces.iter().flatten() {
        let source = if std::mem::replace(&mut taken[v as usize], true) {
            model.copies.push(v);
            7 + model.copies.len() as u32
        } else {
            v
        };
        model.vertices.push(DrawVertex::plain(source));
    }
    model
}

/// A cube of 24 vertices, four per face.
fn split() -> DrawModel {
    let (positions, faces) = corners_of_cube();
    let positions = faces.iter().flatten().map(|&v| positions[v as usize]).collect();
    DrawModel::plain(positions, triangles(faces.len()))
}

/// A cube of eight vertices that its faces share, for smooth shading.
fn shared() -> DrawModel {
    let (positions, faces) = corners_of_cube();
    let of = |corner: u32| faces[corner as usize / 4][corner as usize % 4];
    DrawModel::plain(positions, triangles(faces.len()).into_iter().map(|t| t.map(of)).collect())
}

/// Draws a model. Returns its pictures at rest and posed, and its posed positions.
fn drawn(model: DrawModel) -> ([Vec<u8>; 2], Vec<Vec3>) {
    let mut session = Session::new(support::gpu());
    let cage = subdivided_box(Bounds { min: Vec3::splat(-1.0), max: Vec3::ONE }, 0.2, [1; 3]);
    let cage = Cage::new(&cage).expect("a box is a cage");
    let options = BindOptions { grid: 16, ..BindOptions::default() };
    let binding = bind(&model.positions, &cage, &options, &NoProgress).expect("the bind succeeds");
    let n = model.positions.len();
    block_on(session.set_model(model)).expect("the model is set");
    block_on(session.set_cage(&cage)).expect("the cage is set");
    session.set_scene(SceneOptions { cage_lines: false, handles: false, ..SceneOptions::default() });
    session.frame_all();
    let rest = block_on(session.picture(SIZE, 1.0)).expect("the picture is rendered");
    block_on(session.adopt(binding.weights, binding.frames)).expect("the weights fit");
    let twisted: Vec<Vec3> =
        cage.positions().iter().map(|p| glam::Quat::from_rotation_y(0.5 * p.y) * *p).collect();
    session.pose(&twisted);
    let posed = block_on(session.picture(SIZE, 1.0)).expect("the picture is rendered");
    let positions = block_on(session.read_positions()).expect("positions can be read");
    assert_eq!(positions.len(), n, "positions do not include copies");
    assert_eq!(session.weights().map(cagework_core::Weights::n_rows), Some(n));
    ([rest, posed], positions)
}

#[test]
fn copies_are_shaded_like_split_vertices() {
    let (copies, split, shared) = (drawn(with_copies()), drawn(split()), drawn(shared()));
    for (k, state) in ["at rest", "posed"].into_iter().enumerate() {
        let largest = |a: &[u8], b: &[u8]| a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0);
        assert!(largest(&copies.0[k], &split.0[k]) <= 1, "{state}: differs from the split model");
        assert!(largest(&copies.0[k], &shared.0[k]) > 20, "{state}: is as smooth as the shared model");
    }
    support::assert_close(&support::flat(&copies.1), &support::flat(&shared.1), ROUNDING);
}
