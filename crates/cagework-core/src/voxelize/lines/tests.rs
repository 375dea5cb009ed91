//! Tests watertightness: lines enter the cage as often as they leave it, and parity equals the winding number.

use glam::{DQuat, Vec3};
use proptest::prelude::*;

use super::*;
use crate::cage::shapes;
use crate::geometry::winding_number;
use crate::mesh::PolygonMesh;
use crate::voxelize::embedded::{shoot_lines, votes};

/// Asserts that lines cross the cage an even number of times. At every `every`-th cell centre, the parity along each axis
/// must match the winding number.
fn assert_watertight(cage: &Cage, grid: &Grid, every: usize) {
    let lines = shoot_lines(cage, grid);
    for lines in &lines {
        for (u, v, hits) in lines.crossing() {
            assert!(hits.len().is_multiple_of(2), "{} hits on line {u}, {v}", hits.len());
            assert!(hits.windows(2).all(|w| w[0].t <= w[1].t));
            for hit in hits {
                let [a, b] = hit.barycentric;
                assert!(a >= 0.0 && b >= 0.0 && a + b <= 1.0 + 1e-12, "hits lie in their triangle");
            }
        }
    }
    let votes = votes(&lines, grid);
    assert!(votes.iter().all(|votes| [0, 3].contains(votes)), "the axes agree");
    let triangles = || (0..cage.facets().len() as u32).map(|t| cage.facet_corners(t));
    for cell in grid.cells().step_by(every) {
        let winding = winding_number(grid.center(cell), triangles());
        // Centres on the surface itself are not checked: either classification is valid.
        if (winding - winding.round()).abs() < 1e-6 {
            assert_eq!(
                votes[grid.index(cell)] == 3,
                winding > 0.5,
                "cell {cell:?}, winding number {winding}"
            );
        }
    }
}

fn turned(mesh: &PolygonMesh, turn: DQuat) -> Cage {
    let positions = mesh.positions.iter().map(|p| (turn * p.as_dvec3()).as_vec3()).collect();
    Cage::new(&PolygonMesh { positions, faces: mesh.faces.clone() }).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn rotated_cages_are_watertight(x in -3.2..3.2f64, y in -1.6..1.6f64, z in -3.2..3.2f64, g in 8u32..20) {
        let turn = DQuat::from_euler(glam::EulerRot::XYZ, x, y, z);
        for mesh in [shapes::c_shape(), shapes::octahedron(), shapes::tetrahedron()] {
            let cage = turned(&mesh, turn);
            assert_watertight(&cage, &Grid::cubic(cage.bounds(), g), 7);
        }
    }
}

/// The shapes have integer corners, so lines run along edges, through vertices and in the planes of faces.
#[test]
fn lines_through_vertices_and_along_edges_cross_once() {
    for mesh in [shapes::cube(), shapes::c_shape(), shapes::l_shape(), shapes::octahedron()] {
        let cage = Cage::new(&mesh).unwrap();
        for step in [1.0, 0.5, 0.25] {
            let n = (6.0 / step) as u32 + 1;
            let grid = Grid { dims: [n; 3], origin: DVec3::splat(-2.0), cell: DVec3::splat(step) };
            for axis in 0..3 {
                for (u, v, hits) in Lines::shoot(&cage, &grid, axis).crossing() {
                    assert!(hits.len().is_multiple_of(2), "{} hits on line {u}, {v}", hits.len());
                }
            }
        }
    }
}

#[test]
fn axis_aligned_cages_in_their_own_grid_are_watertight() {
    for mesh in [shapes::cube(), shapes::c_shape(), shapes::l_shape(), shapes::octahedron()] {
        let cage = Cage::new(&mesh).unwrap();
        for g in 8..24 {
            assert_watertight(&cage, &Grid::cubic(cage.bounds(), g), 5);
        }
    }
}

#[test]
fn hits_lie_on_the_cage() {
    let cage = Cage::new(&shapes::cuboid(Vec3::ZERO, Vec3::new(1.0, 2.0, 4.0))).unwrap();
    let grid = Grid::cubic(cage.bounds(), 16);
    for axis in 0..3 {
        let lines = Lines::shoot(&cage, &grid, axis);
        assert!(lines.crossing().count() > 0);
        for (_, _, hits) in lines.crossing() {
            let ends: Vec<f64> = hits.iter().map(|h| grid.origin[axis] + grid.cell[axis] * h.t).collect();
            // The line crosses one face at 0 and the opposite face at the box's size.
            assert!(ends.len() == 2 && ends[0].abs() < 1e-12);
            assert!((ends[1] - f64::from(cage.bounds().max[axis])).abs() < 1e-12);
        }
    }
}
