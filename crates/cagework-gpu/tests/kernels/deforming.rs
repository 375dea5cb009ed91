//! Tests of the kernels that run in each frame: deformation (also of vertices outside the cage), skinning, and normals.

use cagework_core::field::{Field, Lattice, bend_vertices};
use cagework_core::skin::{Skin, skin_vertices};
use cagework_core::stencil::tables::{BUNDLE, NormalTable, SlicedWeights};
use cagework_core::{Cage, PolygonMesh, TriMesh, Weights, stencil};
use cagework_gpu::kernels;
use cagework_gpu::skin::{SkinTables, field_table};
use cagework_pose::parts::{PieceMotion, hold_parts};
use glam::{Mat4, Quat, Vec3, Vec4};

use super::support::{Rng, assert_close, egg, flat};
use super::{ROWS, bytes, run};

/// Tolerance for rounding of sums of dozens of products near 1.
const POINT_TOLERANCE: f32 = 2e-6;

/// Tolerance for rounding of unit vectors: `inverseSqrt` has an error of 2 ulp.
const NORMAL_TOLERANCE: f32 = 2e-6;

/// Random weights; rows have different lengths, some are empty.
fn random_weights(rng: &mut Rng, n_rows: usize, n_columns: u32) -> Weights {
    let (mut indptr, mut indices, mut data) = (vec![0], Vec::new(), Vec::new());
    for _ in 0..n_rows {
        let stride = 1 + (rng.bits() % 40) as u32;
        let first = indices.len();
        indices.extend((0..n_columns).step_by(stride as usize).skip(1));
        let row = rng.values(indices.len() - first);
        let total: f32 = row.iter().sum();
        data.extend(row.iter().map(|w| w / total));
        indptr.push(indices.len() as u32);
    }
    Weights::new(n_columns, indptr, indices, data).expect("rows are built in order")
}

fn padded(points: &[Vec3], w: f32) -> Vec<Vec4> {
    points.iter().map(|p| p.extend(w)).collect()
}

fn unpadded(values: &[f32]) -> Vec<f32> {
    values.chunks(4).flat_map(|v| [v[0], v[1], v[2]]).collect()
}

#[test]
fn deform_vertices_matches_cpu() {
    let mut rng = Rng(12);
    let weights = random_weights(&mut rng, 203, 31);
    let sliced = SlicedWeights::new(&weights);
    let posed: Vec<Vec3> = (0..31).map(|_| rng.point()).collect();
    let mut expected = vec![Vec3::ZERO; 203];
    let inputs = [
        bytes(&sliced.slices).to_vec(),
        bytes(&sliced.columns).to_vec(),
        bytes(&sliced.weights).to_vec(),
        bytes(&padded(&posed, 1.0)).to_vec(),
        bytes(&padded(&expected, 0.0)).to_vec(),
    ];
    let inputs: Vec<&[u8]> = inputs.iter().map(Vec::as_slice).collect();
    let result = run(&kernels::DEFORM_VERTICES, ROWS, 203u32.div_ceil(BUNDLE as u32), &inputs);
    stencil::deform_vertices(&sliced, &posed, &mut expected);
    assert_close(&unpadded(&result), &flat(&expected), POINT_TOLERANCE);
    let double = cagework_core::deform::deform_vertices(&weights, &posed);
    assert_close(&unpadded(&result), &flat(&double), POINT_TOLERANCE);
}

#[test]
fn skin_vertices_matches_cpu() {
    let mut rng = Rng(15);
    let (n, n_joints, n_targets) = (131, 9, 4);
    let mut skin = Skin { joint_starts: vec![0], delta_starts: vec![0], ..Skin::default() };
    for v in 0..n {
        skin.positions.push(rng.point());
        // Each vertex has one to five joints, and every third vertex has morph targets.
        let weights: Vec<f32> = rng.values(1 + v % 5).iter().map(|w| w.abs() + 0.1).collect();
        let total: f32 = weights.iter().sum();
        skin.joints.extend((0..).zip(weights).map(|(k, w)| ((v as u32 + 3 * k) % n_joints, w / total)));
        skin.joint_starts.push(skin.joints.len() as u32);
        if v % 3 == 0 {
            skin.deltas.extend((0..n_targets).map(|target| (target, rng.point())));
        }
        skin.delta_starts.push(skin.deltas.len() as u32);
    }
    let palette: Vec<Mat4> = (0..n_joints)
        .map(|_| {
            let turn = Quat::from_axis_angle(rng.point().normalize_or(Vec3::Y), 2.0);
            Mat4::from_scale_rotation_translation(Vec3::ONE + 0.2 * rng.point(), turn, rng.point())
        })
        .collect();
    let targets = rng.values(n_targets as usize);
    let tables = SkinTables::new(&skin);
    let matrices: Vec<[f32; 16]> = palette.iter().map(Mat4::to_cols_array).collect();
    let inputs = [
        bytes(&tables.rest).to_vec(),
        bytes(&tables.starts).to_vec(),
        bytes(&tables.influences).to_vec(),
        bytes(&tables.deltas).to_vec(),
        bytes(&matrices).to_vec(),
        bytes(&targets).to_vec(),
        bytes(&padded(&skin.positions, 0.0)).to_vec(),
    ];
    let inputs: Vec<&[u8]> = inputs.iter().map(Vec::as_slice).collect();
    let result = run(&kernels::SKIN_VERTICES, ROWS, n as u32, &inputs);
    let expected = skin_vertices(&skin, &palette, &targets);
    assert_close(&unpadded(&result), &flat(&expected), 4.0 * POINT_TOLERANCE);
}

#[test]
fn bend_vertices_matches_cpu() {
    let mut rng = Rng(16);
    let TriMesh { positions, triangles } = egg(5, 6);
    let faces = triangles.iter().map(|t| t.to_vec()).collect();
    let lattice = Lattice::new(&Cage::new(&PolygonMesh { positions, faces }).unwrap(), 48);
    let n = lattice.dims.element_product() as usize;
    let values = (0..n).map(|_| rng.point().extend(0.0)).collect();
    let size = lattice.cell * lattice.dims.as_vec3();
    // The points are inside the lattice, on its boundary and outside.
    let mut points: Vec<Vec3> = (0..131)
        .map(|_| lattice.origin + 0.5 * size + 0.7 * size * rng.point())
        .chain([lattice.origin, lattice.origin + size])
        .collect();
    let field = Field::of_values(lattice, values);
    let (table, moved) = (field_table(&field), padded(&points, 1.0));
    let result = run(&kernels::BEND_VERTICES, ROWS, points.len() as u32, &[bytes(&table), bytes(&moved)]);
    bend_vertices(&field, &mut points);
    // Random displacements of neighbouring nodes differ by up to 1. Such a gradient amplifies the rounding of positions
    // up to a hundredfold.
    assert_close(&unpadded(&result), &flat(&points), 100.0 * POINT_TOLERANCE);
}

#[test]
fn hold_parts_matches_cpu() {
    let mut rng = Rng(17);
    let n = 131;
    // Half of the vertices are partly or fully held in place, and every third vertex belongs to one of four rigid
    // pieces.
    let rest: Vec<Vec4> = (0..n).map(|v| rng.point().extend([0.0, 0.0, 0.4, 1.0][v as usize % 4])).collect();
    let piece_of: Vec<u32> = (0..n).map(|v| if v % 3 == 0 { 1 + v / 3 % 4 } else { 0 }).collect();
    let motions: Vec<PieceMotion> =
        (0..4).map(|_| [0, 1, 2].map(|_| rng.point().extend(rng.point().x))).collect();
    let mut moved: Vec<Vec3> = (0..n).map(|_| rng.point()).collect();
    let inputs = [bytes(&rest), bytes(&piece_of), bytes(&motions)].map(<[u8]>::to_vec);
    let at = padded(&moved, 1.0);
    let inputs = [&inputs[0], &inputs[1], &inputs[2], bytes(&at)];
    let result = run(&kernels::HOLD_PARTS, ROWS, n, &inputs);
    hold_parts(&rest, &piece_of, &motions, &mut moved);
    assert_close(&unpadded(&result), &flat(&moved), POINT_TOLERANCE);
}

#[test]
fn vertex_normals_matches_cpu() {
    let mut mesh = egg(11, 13);
    // Add a vertex without triangles.
    mesh.positions.push(Vec3::ONE);
    let n = mesh.positions.len();
    let table = NormalTable::new(n, &mesh.triangles);
    let mut expected = vec![Vec3::ONE; n];
    let inputs = [
        bytes(&table.starts).to_vec(),
        bytes(&table.others).to_vec(),
        bytes(&padded(&mesh.positions, 1.0)).to_vec(),
        bytes(&padded(&expected, 1.0)).to_vec(),
    ];
    let inputs: Vec<&[u8]> = inputs.iter().map(Vec::as_slice).collect();
    let result = run(&kernels::VERTEX_NORMALS, ROWS, n as u32, &inputs);
    stencil::vertex_normals(&table, &mesh.positions, &mut expected);
    assert_close(&unpadded(&result), &flat(&expected), NORMAL_TOLERANCE);
    let scattered = cagework_core::deform::vertex_normals(&mesh.positions, &mesh.triangles);
    assert_close(&unpadded(&result), &flat(&scattered), NORMAL_TOLERANCE);
}
