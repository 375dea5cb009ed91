use glam::{Vec3, vec3};
use proptest::prelude::*;

use super::{CageEdit, RestEditError, collapse_edge, delete_faces, extrude_faces, move_vertices, split_edge};
use cagework_core::crossing::{crossings_of, notices};
use cagework_core::{Bounds, Cage, PolygonMesh, subdivided_box};

/// Tolerance for f32 rounding of positions of size 1.
const ROUNDING: f32 = 1e-6;

fn cube() -> PolygonMesh {
    subdivided_box(Bounds { min: Vec3::splat(-1.0), max: Vec3::ONE }, 0.0, [1; 3])
}

fn tetrahedron() -> PolygonMesh {
    PolygonMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
        faces: vec![vec![0, 2, 1], vec![0, 1, 3], vec![1, 2, 3], vec![2, 0, 3]],
    }
}

fn volume(mesh: &PolygonMesh) -> f64 {
    let cage = Cage::new(mesh).unwrap();
    let six: f64 = (0..cage.triangles().len() as u32)
        .map(|t| cage.triangle_corners(t))
        .map(|[a, b, c]| a.dot(b.cross(c)))
        .sum();
    six / 6.0
}

fn assert_follows(before: &PolygonMesh, edited: &CageEdit, except: &[u32]) {
    for (old, new) in edited.vertex_of.iter().enumerate() {
        if !except.contains(&(old as u32)) {
            assert_eq!(before.positions[old], edited.mesh.positions[new.unwrap() as usize], "vertex {old}");
        }
    }
}

#[test]
fn moved_vertices_are_at_their_new_positions() {
    let edited = move_vertices(&cube(), &[(0, vec3(-2.0, -1.5, -1.0))]).unwrap();
    assert_eq!(edited.mesh.positions[0], vec3(-2.0, -1.5, -1.0));
    assert_eq!(edited.mesh.faces, cube().faces);
    assert_follows(&cube(), &edited, &[0]);
}

#[test]
fn moves_that_break_the_cage_are_errors_with_a_message() {
    let cube = cube();
    let all: Vec<(u32, Vec3)> = (0..8).map(|v| (v, -cube.positions[v as usize])).collect();
    assert_eq!(move_vertices(&cube, &all).unwrap_err(), RestEditError::InsideOut { operation: "moving" });
    let flat: Vec<(u32, Vec3)> =
        (0..8).map(|v| (v, cube.positions[v as usize] * vec3(1.0, 0.0, 1.0))).collect();
    assert!(matches!(move_vertices(&cube, &flat).unwrap_err(), RestEditError::Breaks { .. }));
    let far = cube.positions[0] * -3.0;
    let error = move_vertices(&cube, &[(0, far)]).unwrap_err();
    assert!(error.to_string().contains("would"), "{error}");
    assert_eq!(move_vertices(&cube, &[(8, Vec3::ZERO)]).unwrap_err().to_string(), "the cage has no vertex 8");
    assert!(matches!(move_vertices(&cube, &[(0, Vec3::NAN)]).unwrap_err(), RestEditError::NotFinite { .. }));
}

#[test]
fn splitting_an_edge_keeps_the_solid() {
    let mesh = tetrahedron();
    let edited = split_edge(&mesh, [1, 2], 0.25).unwrap();
    assert_eq!(edited.touched, [4]);
    assert!(edited.mesh.positions[4].abs_diff_eq(vec3(0.75, 0.25, 0.0), ROUNDING));
    assert_eq!(edited.mesh.faces.len(), 6, "two triangles become four");
    assert!((volume(&edited.mesh) - 1.0 / 6.0).abs() < 1e-6);
    assert_follows(&mesh, &edited, &[]);
    let cube = cube();
    let (a, b) = (cube.faces[0][0], cube.faces[0][1]);
    let edited = split_edge(&cube, [a, b], 0.5).unwrap();
    assert_eq!(edited.mesh.faces.iter().filter(|f| f.len() == 5).count(), 2, "two quads get a fifth corner");
    assert!((volume(&edited.mesh) - 8.0).abs() < 1e-6);
    assert!(matches!(split_edge(&tetrahedron(), [0, 9], 0.5).unwrap_err(), RestEditError::Missing { .. }));
}

#[test]
fn collapsing_undoes_splitting() {
    let mesh = tetrahedron();
    let split = split_edge(&mesh, [1, 2], 0.5).unwrap().mesh;
    let edited = collapse_edge(&split, [1, 4], 0.0).unwrap();
    assert_eq!(edited.mesh.positions, mesh.positions);
    assert_eq!(edited.vertex_of[4], Some(1));
    let from_least = |faces: &[Vec<u32>]| {
        let mut faces = faces.to_vec();
        for face in &mut faces {
            let least = (0..3).min_by_key(|&k| face[k]).unwrap();
            face.rotate_left(least);
        }
        faces.sort();
        faces
    };
    assert_eq!(from_least(&edited.mesh.faces), from_least(&mesh.faces));
    assert!(collapse_edge(&mesh, [0, 1], 0.5).is_err(), "two coinciding triangles are not a cage");
}

#[test]
fn extruding_a_face_adds_a_box() {
    let cube = cube();
    for (face, distance) in [(0, 1.0), (3, 0.5), (5, 0.25)] {
        let edited = extrude_faces(&cube, &[face], distance).unwrap();
        assert_eq!((edited.mesh.positions.len(), edited.mesh.faces.len()), (12, 10));
        let expected = 8.0 + 4.0 * f64::from(distance);
        assert!((volume(&edited.mesh) - expected).abs() < 1e-5, "face {face}");
        assert_eq!(edited.mesh.faces[face as usize], edited.touched);
        assert_follows(&cube, &edited, &[]);
    }
    // Extruding the central one of a side's nine faces into the cage makes a pit of 2/3 x 2/3.
    let fine = subdivided_box(Bounds { min: Vec3::splat(-1.0), max: Vec3::ONE }, 0.0, [3; 3]);
    let middle = fine.faces.iter().position(|f| {
        let center: Vec3 = f.iter().map(|&i| fine.positions[i as usize]).sum::<Vec3>() / 4.0;
        center.distance(Vec3::X) < ROUNDING
    });
    let middle = middle.unwrap() as u32;
    let edited = extrude_faces(&fine, &[middle], -0.5).unwrap();
    assert!((volume(&edited.mesh) - (8.0 - 0.5 * 4.0 / 9.0)).abs() < 1e-5);
    assert!(extrude_faces(&fine, &[middle], -2.5).is_err(), "through the opposite side");
    assert!(extrude_faces(&cube, &[0], -0.5).is_err(), "the pit's walls would coincide with the sides");
    assert!(extrude_faces(&cube, &[0], 0.0).is_err(), "side faces would have no area");
}

/// A side of this box has 9 faces of area 4/9 and 16 vertices, 4 of them inside the side.
#[test]
fn adjacent_faces_are_extruded_as_one() {
    let fine = subdivided_box(Bounds { min: Vec3::splat(-1.0), max: Vec3::ONE }, 0.0, [3; 3]);
    let is_on_side =
        |f: &u32| fine.faces[*f as usize].iter().all(|&i| fine.positions[i as usize].x > 1.0 - ROUNDING);
    let side: Vec<u32> = (0..fine.faces.len() as u32).filter(is_on_side).collect();
    let n_common =
        |f: u32| fine.faces[side[0] as usize].iter().filter(|i| fine.faces[f as usize].contains(i)).count();
    let beside = *side.iter().find(|f| n_common(**f) == 2).unwrap();
    for (faces, n_new, n_walls) in [(side.as_slice(), 12, 12), (&[side[0], beside], 6, 6)] {
        let edited = extrude_faces(&fine, faces, 0.5).unwrap();
        let added =
            (edited.mesh.positions.len() - fine.positions.len(), edited.mesh.faces.len() - fine.faces.len());
        assert_eq!((added, edited.made_from.len()), ((n_new, n_walls), n_new));
        let expected = 8.0 + 0.5 * faces.len() as f64 * 4.0 / 9.0;
        assert!((volume(&edited.mesh) - expected).abs() < 1e-5, "{} faces", faces.len());
    }
    assert!(extrude_faces(&fine, &[side[0], 999], 0.5).is_err());
}

#[test]
fn holes_of_deleted_faces_are_filled() {
    let cube = cube();
    let tower = extrude_faces(&cube, &[0], 1.0).unwrap().mesh;
    // Delete the top and the four sides of the tower. Filling the hole restores the cube.
    let edited = delete_faces(&tower, &[0, 6, 7, 8, 9]).unwrap();
    assert_eq!(edited.mesh.positions, cube.positions);
    assert!((volume(&edited.mesh) - 8.0).abs() < 1e-6);
    assert_eq!(edited.vertex_of[8..], [None; 4]);
    assert_eq!(delete_faces(&cube, &[0, 1, 2, 3, 4, 5]).unwrap_err(), RestEditError::NothingLeft);
    assert!(matches!(delete_faces(&cube, &[77]).unwrap_err(), RestEditError::Missing { .. }));
}

/// Without a corner, a cube has a hole of six edges with two fillings of equal area. One of them coincides with the
/// three remaining faces and must not be chosen.
#[test]
fn every_corner_of_a_cube_can_be_deleted() {
    let cube = cube();
    for corner in 0..8 {
        let around: Vec<u32> = (0..6).filter(|&f| cube.faces[f as usize].contains(&corner)).collect();
        let edited = delete_faces(&cube, &around).unwrap();
        assert_eq!(edited.mesh.positions.len(), 7);
        // The deletion cuts off a corner that is bounded by three half faces: a sixth of the cube's volume of 8.
        assert!((volume(&edited.mesh) - 8.0 * 5.0 / 6.0).abs() < 1e-6, "corner {corner}");
    }
}

#[test]
fn self_intersecting_cage_can_be_edited() {
    let mut mesh = cube();
    mesh.positions.extend(cube().positions.iter().map(|p| *p + vec3(1.5, 0.3, 0.2)));
    mesh.faces.extend(cube().faces.iter().map(|f| f.iter().map(|i| i + 8).collect::<Vec<_>>()));
    assert!(crossings_of(&Cage::new(&mesh).unwrap()).is_some());
    let apart: Vec<(u32, Vec3)> =
        (8..16).map(|v| (v, mesh.positions[v as usize] + vec3(2.0, 0.0, 0.0))).collect();
    let edited = move_vertices(&mesh, &apart).unwrap();
    assert_eq!(notices(&Cage::new(&edited.mesh).unwrap()), Vec::<String>::new());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_sequence_of_edits_gives_a_valid_cage(
        steps in prop::collection::vec((0_u8..5, 0_usize..1000, -0.6_f32..0.9), 1..8),
    ) {
        let mut mesh = cube();
        for (operation, pick, number) in steps {
            let f = pick % mesh.faces.len();
            let edge = [mesh.faces[f][0], mesh.faces[f][1]];
            let edited = match operation {
                0 => {
                    let v = pick % mesh.positions.len();
                    move_vertices(&mesh, &[(v as u32, mesh.positions[v] * (1.0 + number))])
                }
                1 => split_edge(&mesh, edge, number),
                2 => collapse_edge(&mesh, edge, number),
                3 => extrude_faces(&mesh, &[f as u32], number),
                _ => delete_faces(&mesh, &[f as u32]),
            };
            if let Ok(edited) = edited {
                prop_assert_eq!(edited.vertex_of.len(), mesh.positions.len());
                mesh = edited.mesh;
                let cage = Cage::new(&mesh);
                prop_assert!(cage.is_ok(), "{cage:?}");
            }
        }
    }
}
