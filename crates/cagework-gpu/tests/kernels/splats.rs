//! Kernels of splats: deformation by a field, and sorting by depth.

use cagework_core::field::{Field, Lattice};
use cagework_core::splats::{
    SortedSplats, SplatPose, Splats, color_along, deform_splats, n_harmonics, turn_of,
};
use cagework_core::team::Team;
use cagework_core::{Bounds, Cage, PolygonMesh, TriMesh};
use cagework_gpu::kernels;
use cagework_gpu::skin::field_table;
use cagework_gpu::splats::{
    BINS, Depths, FLOATER, MIRROR, sort_splats, splat_colors, splat_harmonics, splat_rows,
};
use glam::{Mat3, Quat, UVec3, Vec3};

use super::support::{Rng, assert_close, egg};
use super::{ROWS, Work, bytes, mode, run};

fn random_splats(rng: &mut Rng, n: usize, at: impl Fn(&mut Rng) -> Vec3) -> Splats {
    Splats {
        positions: (0..n).map(|_| at(rng)).collect(),
        scales: (0..n).map(|_| 0.1 * rng.point()).collect(),
        rotations: (0..n)
            .map(|_| Quat::from_axis_angle(rng.point().normalize_or(Vec3::Y), 3.0 * rng.unit()))
            .collect(),
        opacities: rng.values(n),
        colors: (0..n).map(|_| rng.point()).collect(),
        ..Splats::default()
    }
}

fn lattice() -> Lattice {
    let TriMesh { positions, triangles } = egg(5, 6);
    let faces = triangles.iter().map(|t| t.to_vec()).collect();
    Lattice::new(&Cage::new(&PolygonMesh { positions, faces }).expect("an egg is a valid cage"), 24)
}

#[test]
fn deform_splats_matches_cpu() {
    let mut rng = Rng(18);
    let lattice = lattice();
    // Displacements of neighbouring nodes differ by up to a third of a cell along each axis. Runs of seven nodes with
    // the fourth component 0 alternate with runs of seven with 1.
    let n = lattice.dims.element_product();
    let values = (0..n).map(|k| (0.3 * lattice.cell * rng.point()).extend((k / 7 % 2) as f32)).collect();
    let size = lattice.cell * (lattice.dims - 1).as_vec3();
    let (origin, field) = (lattice.origin, Field::of_values(lattice, values));
    // Some splats are inside the lattice, others outside of it.
    let splats = random_splats(&mut rng, 131, |rng| origin + size * (1.2 * rng.point() - 0.1));
    let rest = splats.rest_pose();
    let (table, rows) = (field_table(&field), splat_rows(&rest, &[]));
    let work = Work { mode: mode::ROTATIONS, ..ROWS };
    let result = run(&kernels::DEFORM_SPLATS, work, 131, &[bytes(&table), bytes(&rows), bytes(&rows)]);
    let sorted = SortedSplats::new(&splats, &field.lattice);
    let (mut posed, mut expected) = (SplatPose::default(), rest);
    deform_splats(&sorted, &field, &Team::new(1), &mut posed);
    for (k, &splat) in sorted.order.iter().enumerate() {
        expected.positions[splat as usize] = posed.positions[k];
        expected.covariances[splat as usize] = posed.covariances[k];
    }
    // Rounding changes a point's place in its cell by about 1e-6 of a cell. Results differ by about as much, because
    // gradients are near 1 and change by at most about 1 per cell; the tolerance leaves a margin.
    let mut expected = splat_rows(&expected, &[]);
    for (row, &p) in expected.iter_mut().zip(&splats.positions) {
        set_turn(row, turn_of(field.gradient(p)));
    }
    assert_close(&result, expected.as_flattened(), 4e-6);
}

/// Writes an orthogonal matrix into the rows of a splat as a vector: the axis of its rotation times tan(angle / 4). The
/// rotation of a matrix that mirrors is that of its negative.
fn set_turn(row: &mut [f32; 12], turn: Mat3) {
    let sign = turn.determinant().signum();
    let turn = Quat::from_mat3(&(sign * turn));
    // Of the two quaternions of the rotation, the one with an angle of at most 180 degrees.
    let (axis, angle) = if turn.w < 0.0 { -turn } else { turn }.to_axis_angle();
    let turn = axis * (0.25 * angle).tan();
    let mirror = if sign < 0.0 { MIRROR } else { 0.0 };
    (row[3], row[10], row[11]) = (row[3] + turn.z, turn.x + mirror, turn.y);
}

/// Each branch of the kernel's conversion is tested: rotations above 120 degrees have a negative trace.
#[test]
fn splats_turn_with_a_rotation() {
    let mut rng = Rng(29);
    let work = Work { mode: mode::ROTATIONS, ..ROWS };
    for axis in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_ONE.normalize(), Vec3::new(0.6, -0.64, 0.48)] {
        for (angle, sign) in [0.0, 1.0, 2.2, 3.1].into_iter().flat_map(|angle| [(angle, 1.0), (angle, -1.0)])
        {
            let turn = sign * Mat3::from_quat(Quat::from_axis_angle(axis, angle));
            let lattice = lattice();
            let (from, size) = (lattice.origin, lattice.cell * (lattice.dims - 1).as_vec3());
            let [nx, ny, nz] = lattice.dims.to_array();
            let node = |k: u32| UVec3::new(k % nx, k / nx % ny, k / nx / ny).as_vec3();
            let moved = |at: Vec3| (turn * at - at).extend(1.0);
            let values = (0..nx * ny * nz).map(|k| moved(from + lattice.cell * node(k))).collect();
            let rest = random_splats(&mut rng, 3, |rng| from + size * rng.point()).rest_pose();
            let field = Field::of_values(lattice, values);
            let (table, rows) = (field_table(&field), splat_rows(&rest, &[FLOATER; 3]));
            let result = run(&kernels::DEFORM_SPLATS, work, 3, &[bytes(&table), bytes(&rows), bytes(&rows)]);
            for row in result.as_chunks::<12>().0 {
                let mut expected = [0.0; 12];
                set_turn(&mut expected, turn);
                let error = [3, 10, 11].map(|k| row[k] - expected[k] - if k == 3 { FLOATER } else { 0.0 });
                // Displacements are rounded to 1e-7, and divided by a cell of a thirtieth of the lattice.
                assert!(error.iter().all(|e| e.abs() < 1e-5), "{axis}, {angle}, {sign}: {error:?}");
            }
        }
    }
}

/// The direction from which a splat is seen is rotated into the axes of the splat. All splats are at the same place, so
/// the kernel keeps their order.
#[test]
fn seen_colours_match_cpu() {
    let mut rng = Rng(23);
    let n = 131;
    for degree in 1..=3 {
        let mut splats = random_splats(&mut rng, n, |_| Vec3::ONE);
        splats.degree = degree;
        splats.harmonics = (0..n * n_harmonics(degree)).map(|_| rng.point() - 0.5).collect();
        let (harmonics, unit) = splat_harmonics(&splats, degree);
        let eye = Vec3::new(3.0, -1.0, 2.0);
        let within = Bounds { min: Vec3::ZERO, max: Vec3::ONE };
        let depths = Depths {
            viewer: eye.extend(1.0).to_array(),
            degree: u32::from(degree),
            unit,
            ..Depths::new(n, within, Vec3::Z, false)
        };
        // Every third splat is a floater.
        let floaters: Vec<f32> = (0..n).map(|k| if k % 3 == 0 { FLOATER } else { 0.0 }).collect();
        let (mut rows, colors) = (splat_rows(&splats.rest_pose(), &floaters), splat_colors(&splats));
        // Every second splat is mirrored.
        let sign = |splat: usize| if splat.is_multiple_of(2) { 1.0 } else { -1.0 };
        let turn = |splat: usize| sign(splat) * Mat3::from_quat(splats.rotations[splat]);
        rows.iter_mut().enumerate().for_each(|(splat, row)| set_turn(row, turn(splat)));
        let (places, empty) = (vec![0_u32; BINS as usize], vec![[0_u32; 2]; n]);
        let work = Work { mode: mode::LOWER_DIGIT, ..ROWS };
        let depths = bytes(std::slice::from_ref(&depths));
        let [rows, colors, source] = [bytes(&rows), bytes(&colors), bytes(&empty)];
        let inputs = [depths, rows, colors, source, bytes(&places), bytes(&harmonics), source];
        let seen = run(&kernels::SCATTER_SPLATS, work, 1, &inputs);
        for (splat, entry) in seen.as_chunks::<2>().0.iter().enumerate() {
            assert_eq!(entry[0].to_bits() as usize, splat);
            let direction = turn(splat).transpose() * (Vec3::ONE - eye).normalize();
            let expected = color_along(splats.colors[splat], splats.harmonics_of(splat), direction);
            let [r, g, b, _] = entry[1].to_bits().to_le_bytes().map(|byte| f32::from(byte) / 255.0);
            let error = (Vec3::new(r, g, b) - expected.clamp(Vec3::ZERO, Vec3::ONE)).abs().max_element();
            // The kernel rounds colours to 8 bits and up to 16 coefficients to 16 bits each.
            assert!(error < 0.5 / 255.0 + 16.0 * unit / 65534.0, "{error}");
        }
    }
}

/// Coordinates are multiples of powers of two, and the view is along an axis, so depths are computed without rounding.
/// Half of the centres share the lower digit of their depths.
#[test]
fn sorting_kernels_match_cpu() {
    let mut rng = Rng(19);
    let n = 5003;
    let grid = |rng: &mut Rng| {
        let steps = if rng.unit() < 0.5 { 1024.0 } else { 4_194_304.0 };
        (steps * rng.point()).floor() / steps
    };
    let splats = random_splats(&mut rng, n, grid);
    let within = Bounds { min: Vec3::ZERO, max: Vec3::ONE };
    for backward in [Vec3::Z, Vec3::NEG_X] {
        let depths = Depths::new(n, within, backward, true);
        assert_eq!(depths.n_blocks, 3, "the last block is not full");
        let hidden: Vec<f32> = (0..n).map(|k| if k % 3 > 0 { FLOATER } else { 0.0 }).collect();
        let rows = splat_rows(&splats.rest_pose(), &hidden);
        let (colors, none) = (vec![7_u32; n], vec![9_u32; (BINS * depths.n_blocks) as usize]);
        let depths_bytes = bytes(std::slice::from_ref(&depths));
        let empty = vec![[0_u32; 2]; n];
        let mut order = empty.as_flattened().to_vec();
        for mode in [mode::LOWER_DIGIT, mode::HIGHER_DIGIT] {
            let work = Work { mode, ..ROWS };
            let source = order;
            let inputs = [depths_bytes, bytes(&rows), bytes(&source), bytes(&none)];
            let counts = run(&kernels::COUNT_SPLATS, work, depths.n_blocks, &inputs);
            let places = run(&kernels::SCAN_SPLATS, work, 128, &[depths_bytes, bytes(&counts)]);
            let [rows, colors] = [bytes(&rows), bytes(&colors)];
            let none = &[0; 16][..];
            let inputs = [depths_bytes, rows, colors, bytes(&source), bytes(&places), none, bytes(&empty)];
            let sorted = run(&kernels::SCATTER_SPLATS, work, depths.n_blocks, &inputs);
            order = sorted.iter().map(|x| x.to_bits()).collect();
        }
        let expected = sort_splats(&splats.positions, &depths);
        let entry = |splat: u32| [splat, if splat.is_multiple_of(3) { 7 } else { 0 }];
        assert_eq!(order.as_chunks().0, expected.into_iter().map(entry).collect::<Vec<_>>());
    }
}
