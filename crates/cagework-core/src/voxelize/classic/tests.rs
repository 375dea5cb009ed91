//! Tests kinds of cells against formulas, and values against a test of every cell with every triangle (K. Smith,
//! Algorithm 1).

use glam::{Quat, Vec3};
use proptest::prelude::*;

use super::*;
use crate::cage::shapes;
use crate::geometry::winding_number;
use crate::mesh::PolygonMesh;

/// Tolerance for f32 rounding of sums of up to eight values.
const SUM_TOLERANCE: f32 = 1e-6;

fn voxelized(mesh: &PolygonMesh, grid: u32) -> (Cage, ClassicCells) {
    let cage = Cage::new(mesh).unwrap();
    let cells = voxelize_classic((&cage).into(), grid);
    (cage, cells)
}

fn count(cells: &ClassicCells, kind: CellKind) -> usize {
    cells.kinds.iter().filter(|&&k| k == kind).count()
}

fn center(cells: &ClassicCells, cell: usize) -> DVec3 {
    let [nx, ny, _] = cells.dims.map(|n| n as usize);
    let at = UVec3::new((cell % nx) as u32, (cell / nx % ny) as u32, (cell / nx / ny) as u32);
    cells.origin + at.as_dvec3() * cells.cell_size
}

/// Asserts that the values of each boundary cell sum to 1, that the centres of exterior cells are outside the cage and,
/// unless `pockets`, that those of interior cells are inside. Pockets are cells outside the cage that boundary cells
/// separate from the exterior; they count as interior.
fn assert_sound(cage: &Cage, cells: &ClassicCells, pockets: bool) {
    let boundary: Vec<u32> =
        (0u32..).zip(&cells.kinds).filter(|(_, k)| **k == CellKind::Boundary).map(|(c, _)| c).collect();
    assert_eq!(cells.boundary.cells, boundary);
    for (row, &cell) in boundary.iter().enumerate() {
        let sum: f32 = cells.boundary.row(row).1.iter().sum();
        assert!((sum - 1.0).abs() <= SUM_TOLERANCE);
        assert_eq!(cells.boundary.row_of(cell), Some(row));
    }
    for (cell, kind) in cells.kinds.iter().enumerate() {
        let inside = || {
            let triangles = (0..cage.facets().len() as u32).map(|t| cage.facet_corners(t));
            winding_number(center(cells, cell), triangles) > 0.5
        };
        match kind {
            CellKind::Boundary => {}
            CellKind::Interior => assert!(pockets || inside(), "cell {cell} is outside"),
            CellKind::Exterior => assert!(!inside(), "cell {cell} is inside"),
            CellKind::Untyped => panic!("cell {cell} is untyped"),
        }
    }
}

#[test]
fn box_has_one_layer_of_boundary() {
    let (cage, cells) = voxelized(&shapes::cube(), 9);
    assert_eq!(cells.dims, [9; 3]);
    assert_eq!(count(&cells, CellKind::Interior), 7 * 7 * 7);
    assert_eq!(count(&cells, CellKind::Boundary), 9 * 9 * 9 - 7 * 7 * 7);
    assert_sound(&cage, &cells, false);
}

#[test]
fn cells_are_equally_many_per_axis() {
    let long = shapes::cuboid(Vec3::ZERO, Vec3::new(4.0, 2.0, 1.0));
    let (cage, cells) = voxelized(&long, 16);
    assert_eq!(cells.dims, [16; 3]);
    // The cage's box is as long as 16 cells minus the padding, which is 1/500 cell.
    assert!((cells.cell_size * (16.0 - 2.0 * PADDING) - DVec3::new(4.0, 2.0, 1.0)).length() < 1e-12);
    assert_sound(&cage, &cells, false);
}

#[test]
fn l_shape_has_the_kinds_of_its_outline() {
    // The inner walls are in the middle of cell 16.
    let (cage, cells) = voxelized(&shapes::l_shape(), 33);
    assert_eq!(count(&cells, CellKind::Exterior), 16 * 16 * 33);
    assert_eq!(count(&cells, CellKind::Interior), (31 * 31 - 16 * 16) * 31);
    assert_sound(&cage, &cells, false);
}

#[test]
fn all_eight_corners_of_an_octahedron_are_exterior() {
    // The corners are not connected: flooding from cell (0, 0, 0) alone would miss seven of them.
    let (cage, cells) = voxelized(&shapes::octahedron(), 21);
    for corner in 0..8usize {
        let at = |axis: usize| (corner >> axis & 1) * 20;
        assert_eq!(cells.kinds[at(0) + 21 * (at(1) + 21 * at(2))], CellKind::Exterior);
    }
    assert_sound(&cage, &cells, false);
}

#[test]
fn cavity_is_enclosed_and_counts_as_interior() {
    // As in K. Smith's paper, cells that the flood of the exterior does not reach are interior.
    let hollow = shapes::together(&shapes::cube(), &shapes::cuboid(Vec3::splat(0.3), Vec3::splat(0.7)));
    let (_, cells) = voxelized(&hollow, 21);
    assert_eq!(count(&cells, CellKind::Exterior), 0);
    assert_eq!(cells.kinds[10 + 21 * (10 + 21 * 10)], CellKind::Interior);
}

#[test]
fn boundary_values_are_those_of_the_closest_triangle_in_the_cell() {
    for mesh in [shapes::octahedron(), shapes::l_shape()] {
        let (cage, cells) = voxelized(&mesh, 11);
        for cell in 0..cells.kinds.len() {
            let center = center(&cells, cell);
            let mut closest: Option<(f64, u32, [f64; 3])> = None;
            for t in 0..cage.facets().len() as u32 {
                let triangle = cage.facet_corners(t);
                if triangle_box_overlaps(center, 0.5 * cells.cell_size, triangle) {
                    let found = closest_point_on_triangle(center, triangle);
                    let distance_squared = found.point.distance_squared(center);
                    if closest.is_none_or(|c| distance_squared < c.0) {
                        closest = Some((distance_squared, t, found.barycentric));
                    }
                }
            }
            let row = cells.boundary.row_of(cell as u32);
            assert_eq!(row.is_some(), closest.is_some(), "cell {cell}");
            if let (Some(row), Some((_, t, barycentric))) = (row, closest) {
                let (mut indices, mut values) = (Vec::new(), Vec::new());
                cage.hats_at(t, barycentric, &mut |i, value| {
                    indices.push(i);
                    values.push(value as f32);
                });
                assert_eq!(cells.boundary.row(row), (&indices[..], &values[..]), "cell {cell}");
            }
        }
    }
}

#[cfg(feature = "parallel")]
#[test]
fn one_thread_and_many_give_the_same_cells() {
    let cage = Cage::new(&shapes::c_shape()).unwrap();
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| voxelize_classic((&cage).into(), 40))
    };
    assert_eq!(on(1), on(4));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn exterior_never_leaks_into_rotated_cages(
        axis in [-1.0..1.0f32, -1.0..1.0, 0.1..1.0], angle in 0.0..6.3f32, grid in 1..30u32,
    ) {
        let turn = Quat::from_axis_angle(Vec3::from(axis).normalize(), angle);
        let mut mesh = shapes::c_shape();
        for p in &mut mesh.positions {
            *p = turn * *p + Vec3::new(7.0, 0.0, -3.0);
        }
        let (cage, cells) = voxelized(&mesh, grid);
        assert_sound(&cage, &cells, true);
    }
}
