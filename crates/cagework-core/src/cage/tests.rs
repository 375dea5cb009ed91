//! Tests of accepted, repaired and rejected meshes.

use glam::{DVec3, Vec3};
use proptest::prelude::*;

use super::shapes::*;
use super::*;
use crate::geometry::winding_number;

fn error(mesh: &PolygonMesh) -> CageError {
    Cage::new(mesh).expect_err("the mesh must be rejected")
}

fn defect(mesh: &PolygonMesh) -> (u32, FaceDefect) {
    match error(mesh) {
        CageError::DegenerateFace { face, why } => (face, why),
        other => panic!("expected a degenerate face, got {other:?}"),
    }
}

/// Six times the signed volume. It is exact for the small integer coordinates of these shapes.
fn volume6(cage: &Cage) -> f64 {
    (0..cage.triangles().len() as u32)
        .map(|t| cage.triangle_corners(t))
        .map(|[a, b, c]| a.dot(b.cross(c)))
        .sum()
}

/// Asserts that every edge has one side in each direction.
fn assert_closed(faces: &[Vec<u32>]) {
    let mut sides: Vec<[u32; 2]> =
        faces.iter().flat_map(|f| (0..f.len()).map(|k| [f[k], f[(k + 1) % f.len()]])).collect();
    sides.sort_unstable();
    assert!(sides.windows(2).all(|w| w[0] != w[1]), "an edge has two sides in the same direction");
    assert!(sides.iter().all(|&[a, b]| sides.binary_search(&[b, a]).is_ok()), "an edge has only one face");
}

#[test]
fn valid_cages_are_unchanged() {
    for (mesh, volume) in [
        (tetrahedron(), 1.0 / 6.0),
        (octahedron(), 4.0 / 3.0),
        (cube(), 1.0),
        (l_shape(), 3.0),
        (c_shape(), 7.0),
        (prism(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]], 1.0), 2.0),
    ] {
        let cage = Cage::new(&mesh).unwrap();
        assert_eq!(cage.to_polygon_mesh(), mesh);
        assert_eq!(cage.notices(), []);
        assert_eq!(cage.n_vertices(), mesh.positions.len());
        assert_eq!(cage.triangles().len(), mesh.faces.iter().map(|f| f.len() - 2).sum::<usize>());
        assert!((volume6(&cage) - 6.0 * volume).abs() < 1e-12, "{} is not {}", volume6(&cage), 6.0 * volume);
        assert_closed(&cage.triangles().iter().map(|t| t.to_vec()).collect::<Vec<_>>());
    }
}

#[test]
fn triangles_know_their_face() {
    let cage = Cage::new(&l_shape()).unwrap();
    for (triangle, &face) in cage.triangles().iter().zip(cage.face_of_triangle()) {
        assert!(triangle.iter().all(|i| cage.faces()[face as usize].contains(i)));
    }
}

#[test]
fn inverted_cage_is_flipped_with_a_notice() {
    let cage = Cage::new(&inside_out(l_shape())).unwrap();
    assert_eq!(cage.notices(), [CageNotice::Flipped { component: 0, faces: 8, of: 8 }]);
    assert_eq!(volume6(&cage), 18.0);
    assert_eq!(
        cage.notices()[0].to_string(),
        "Component 0 of the cage was inside out: all its 8 faces were flipped."
    );
}

#[test]
fn single_inverted_faces_are_flipped() {
    for face in 0..6 {
        let mut mesh = cube();
        mesh.faces[face].reverse();
        let cage = Cage::new(&mesh).unwrap();
        assert_eq!(cage.notices(), [CageNotice::Flipped { component: 0, faces: 1, of: 6 }]);
        assert_eq!(volume6(&cage), 6.0);
    }
}

#[test]
fn components_are_oriented_independently() {
    let aside = cuboid(Vec3::splat(3.0), Vec3::splat(5.0));
    let cage = Cage::new(&together(&cube(), &inside_out(aside))).unwrap();
    assert_eq!(cage.notices(), [CageNotice::Flipped { component: 1, faces: 6, of: 6 }]);
    assert_eq!(volume6(&cage), 6.0 * 9.0);
}

#[test]
fn nested_components_alternate_between_cavity_and_solid() {
    let shell = |r: f32| cuboid(Vec3::splat(-r), Vec3::splat(r));
    let nested = together(&together(&shell(1.0), &shell(3.0)), &shell(2.0));
    let cage = Cage::new(&nested).unwrap();
    assert_eq!(
        cage.notices(),
        [CageNotice::Flipped { component: 2, faces: 6, of: 6 }, CageNotice::Cavity { component: 2 }]
    );
    assert_eq!(volume6(&cage), 6.0 * (6.0f64.powi(3) - 4.0f64.powi(3) + 2.0f64.powi(3)));
    let triangles = || (0..cage.triangles().len() as u32).map(|t| cage.triangle_corners(t));
    for (x, inside) in [(0.5, 1.0), (1.5, 0.0), (2.5, 1.0), (3.5, 0.0)] {
        assert!((winding_number(DVec3::new(x, 0.1, 0.2), triangles()) - inside).abs() < 1e-12);
    }
}

#[test]
fn open_cage_is_rejected() {
    let mut mesh = cube();
    mesh.faces.remove(0);
    let open = error(&mesh);
    assert_eq!(open, CageError::Open { edge: [0, 1], count: 4 });
    assert!(
        open.to_string()
            .starts_with("cage is not closed: edge 0-1 belongs to one face (4 open edges in all)")
    );
}

#[test]
fn moebius_strip_is_open() {
    let mesh = PolygonMesh {
        positions: (0..6).map(|k| Vec3::new((k as f32).cos(), (k as f32).sin(), (k % 2) as f32)).collect(),
        faces: (0..6).map(|k| vec![k, (k + 1) % 6, (k + 2) % 6]).collect(),
    };
    assert!(matches!(error(&mesh), CageError::Open { .. }));
}

#[test]
fn one_sided_surface_is_rejected() {
    // The projective plane with six vertices: the icosahedron with opposite faces identified.
    let faces: [[u32; 3]; 10] = [
        [0, 1, 2],
        [0, 2, 3],
        [0, 3, 4],
        [0, 4, 5],
        [0, 5, 1],
        [1, 2, 4],
        [2, 3, 5],
        [3, 4, 1],
        [4, 5, 2],
        [5, 1, 3],
    ];
    let mesh = PolygonMesh {
        positions: (0..6).map(|k| Vec3::new(k as f32, (k * k) as f32, (k * k * k) as f32)).collect(),
        faces: faces.iter().map(|f| f.to_vec()).collect(),
    };
    assert!(matches!(error(&mesh), CageError::Inconsistent { .. }));
}

#[test]
fn edge_of_four_faces_is_rejected() {
    // Two cubes share the vertices 1 and 3 of the first, an edge along y at x = 1, z = 0.
    let mut mesh = together(&cube(), &cuboid(Vec3::new(1.0, 0.0, -1.0), Vec3::new(2.0, 1.0, 0.0)));
    for i in mesh.faces.iter_mut().flatten() {
        *i = match *i {
            12 => 1,
            14 => 3,
            i => i,
        };
    }
    assert_eq!(error(&mesh), CageError::NonManifoldEdge { edge: [1, 3], faces: 4 });
}

#[test]
fn touching_in_a_vertex_gives_a_notice() {
    let mut mesh = together(&cube(), &cuboid(Vec3::ONE, Vec3::splat(2.0)));
    for i in mesh.faces.iter_mut().flatten() {
        *i = if *i == 8 { 7 } else { *i };
    }
    let cage = Cage::new(&mesh).unwrap();
    assert_eq!(
        cage.notices(),
        [
            CageNotice::TouchingVertices { vertices: 1, first: 7 },
            CageNotice::UnusedVertices { vertices: 1, first: 8 }
        ]
    );
}

#[test]
fn duplicate_face_is_rejected() {
    let mut mesh = cube();
    mesh.faces.push(vec![3, 2, 0, 1]);
    assert_eq!(error(&mesh), CageError::DuplicateFace { first: 0, second: 6 });
    mesh.faces[6] = vec![0, 1, 3, 2];
    assert_eq!(error(&mesh), CageError::DuplicateFace { first: 0, second: 6 });
}

/// Two components that coincide enclose an empty solid between them.
#[test]
fn coinciding_component_is_rejected() {
    let beside = cuboid(Vec3::new(5.0, 0.0, 0.0), Vec3::new(6.0, 1.0, 1.0));
    let mut turned = cube();
    turned.faces.reverse();
    turned.faces.iter_mut().for_each(|face| face.rotate_left(1));
    for copy in [cube(), inside_out(cube()), turned] {
        let doubled = together(&together(&cube(), &beside), &copy);
        assert_eq!(error(&doubled), CageError::DoubledPart { first: 0, second: 2 });
    }
    // Stacked components share only one face, and nested components share none.
    let Bounds { min, max } = Cage::new(&cube()).unwrap().bounds();
    let above = cuboid(Vec3::new(min.x, max.y, min.z), Vec3::new(max.x, 2.0 * max.y - min.y, max.z));
    assert!(Cage::new(&together(&cube(), &above)).is_ok());
    let inner = cuboid(0.5 * (min + max) - 0.1, 0.5 * (min + max) + 0.1);
    assert!(Cage::new(&together(&cube(), &inner)).is_ok());
}

#[test]
fn cage_with_too_many_faces_is_rejected() {
    let faces = MAX_FACES + 1;
    let soup = PolygonMesh { positions: tetrahedron().positions, faces: vec![vec![0, 1, 2]; faces] };
    assert_eq!(
        error(&soup).to_string(),
        "cage has 100,001 faces, more than 100,000: use a simpler mesh around the model"
    );
}

#[test]
fn seams_are_closed_with_a_notice() {
    // A cube as glTF stores it with flat normals: four vertices per face.
    let whole = cube();
    let split = PolygonMesh {
        positions: whole.faces.iter().flatten().map(|&i| whole.positions[i as usize]).collect(),
        faces: (0..6).map(|f| (4 * f..4 * f + 4).collect()).collect(),
    };
    let cage = Cage::new(&split).unwrap();
    assert_eq!(cage.notices(), [CageNotice::Welded { vertices: 16, first: 8 }]);
    assert_eq!(cage.n_vertices(), 24);
    assert_eq!(volume6(&cage), 6.0);

    let mut hole = split;
    hole.faces.remove(5);
    assert!(matches!(error(&hole), CageError::Open { count: 4, .. }));
}

#[test]
fn coincident_vertices_of_a_closed_cage_stay_separate() {
    let cage = Cage::new(&together(&cube(), &cuboid(Vec3::ONE, Vec3::splat(2.0)))).unwrap();
    assert_eq!(cage.notices(), []);
}

#[test]
fn unused_vertex_gives_a_notice_and_is_ignored_by_the_bounds() {
    let mut mesh = cube();
    mesh.positions.push(Vec3::splat(100.0));
    let cage = Cage::new(&mesh).unwrap();
    assert_eq!(cage.notices(), [CageNotice::UnusedVertices { vertices: 1, first: 8 }]);
    assert_eq!(cage.n_vertices(), 9);
    assert_eq!(cage.bounds().max, Vec3::ONE);
}

#[test]
fn invalid_faces_and_vertices_are_errors_with_their_index() {
    assert_eq!(error(&PolygonMesh::default()), CageError::Empty);
    let broken = |change: &dyn Fn(&mut PolygonMesh)| {
        let mut mesh = cube();
        change(&mut mesh);
        mesh
    };
    assert_eq!(error(&broken(&|m| m.faces.clear())), CageError::Empty);
    assert_eq!(error(&broken(&|m| m.positions[5].y = f32::NAN)), CageError::NotFinite { vertex: 5 });
    assert_eq!(error(&broken(&|m| m.faces[2].truncate(2))), CageError::TooFewCorners { face: 2, corners: 2 });
    assert_eq!(error(&broken(&|m| m.faces[3][1] = 8)), CageError::Index { face: 3, vertex: 8, n: 8 });
    assert!(matches!(error(&broken(&|m| m.positions[7].x = 1e20)), CageError::Size { .. }));
    assert!(matches!(error(&broken(&|m| m.positions.fill(Vec3::ONE))), CageError::Size { .. }));
    let repeated = (3, FaceDefect::RepeatedVertex { vertex: 2 });
    assert_eq!(defect(&broken(&|m| m.faces[3][1] = 2)), repeated);
    let flattened = broken(&|m| m.positions.iter_mut().for_each(|p| p.z = 0.0));
    assert_eq!(defect(&flattened), (2, FaceDefect::NoArea));
}

#[test]
fn face_without_area_is_rejected() {
    // A tetrahedron with an extra vertex on one side of an edge; the slit is closed by a triangle without area.
    let mut mesh = tetrahedron();
    mesh.positions.push(Vec3::new(0.5, 0.0, 0.0));
    mesh.faces[1] = vec![0, 4, 3];
    mesh.faces.extend([vec![4, 1, 3], vec![0, 1, 4]]);
    assert_eq!(defect(&mesh), (5, FaceDefect::NoArea));
}

#[test]
fn self_crossing_face_is_rejected() {
    let mut mesh = prism(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [1.0, -1.0], [0.0, 4.0]], 1.0);
    mesh.positions[3].y = -1.0;
    assert_eq!(defect(&mesh), (0, FaceDefect::CrossesItself));
}

/// Triangulating a disc takes time at least quadratic in its number of corners.
#[test]
fn face_with_too_many_corners_is_rejected() {
    let disc = |n: u32| (0..n).map(move |k| f64::from(k) / f64::from(n) * std::f64::consts::TAU);
    let outline = |n| disc(n).map(|a| [a.cos() as f32, a.sin() as f32]).collect::<Vec<_>>();
    assert!(Cage::new(&prism(&outline(1000), 1.0)).is_ok());
    assert_eq!(defect(&prism(&outline(1001), 1.0)), (0, FaceDefect::TooManyCorners { corners: 1001 }));
}

#[test]
fn flat_component_is_rejected() {
    let mut mesh = octahedron();
    mesh.positions[4].z = 0.0;
    mesh.positions[5].z = 0.0;
    assert_eq!(error(&mesh), CageError::Flat { component: 0, face: 0 });
}

/// A valid cage with a few faults.
fn damaged() -> impl Strategy<Value = PolygonMesh> {
    let shape = prop_oneof![
        Just(tetrahedron()),
        Just(octahedron()),
        Just(cube()),
        Just(l_shape()),
        Just(together(&cube(), &cuboid(Vec3::splat(0.25), Vec3::splat(0.5)))),
    ];
    let fault = (0..7u8, any::<prop::sample::Index>(), any::<prop::sample::Index>(), -2.0f32..2.0);
    (shape, prop::collection::vec(fault, 0..4)).prop_map(|(mut mesh, faults)| {
        for (kind, at, other, x) in faults {
            if mesh.faces.is_empty() {
                break;
            }
            let n = mesh.positions.len();
            let f = at.index(mesh.faces.len());
            match kind {
                0 => mesh.faces[f].reverse(),
                1 => drop(mesh.faces.remove(f)),
                2 => mesh.positions[at.index(n)] += Vec3::new(x, -x, 0.5 * x),
                3 => mesh.positions[at.index(n)] = mesh.positions[other.index(n)],
                4 => mesh.faces[f].rotate_left(1),
                5 => {
                    let k = other.index(mesh.faces[f].len());
                    mesh.faces[f][k] = at.index(n) as u32;
                }
                _ => mesh.positions[at.index(n)].x = if x > 0.0 { f32::NAN } else { 1e30 * x },
            }
        }
        mesh
    })
}

fn soup() -> impl Strategy<Value = PolygonMesh> {
    let coordinate = prop_oneof![4 => (-2i8..=2).prop_map(f32::from), 1 => any::<f32>()];
    let position = [coordinate.clone(), coordinate.clone(), coordinate].prop_map(Vec3::from);
    let faces = prop::collection::vec(prop::collection::vec(0..7u32, 0..6), 0..9);
    (prop::collection::vec(position, 0..8), faces)
        .prop_map(|(positions, faces)| PolygonMesh { positions, faces })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn accepted_meshes_are_closed_and_have_hats(mesh in prop_oneof![damaged(), soup()]) {
        if let Ok(cage) = Cage::new(&mesh) {
            assert_closed(cage.faces());
            prop_assert!(cage.diagonal() > 0.0);
            for t in 0..cage.triangles().len() as u32 {
                for b in [[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.2, 0.3, 0.5]] {
                    let mut sum = 0.0;
                    cage.hats_at(t, b, &mut |_, value| sum += value);
                    prop_assert!((sum - 1.0f64).abs() < 1e-9, "hats sum to {sum}");
                }
            }
        }
    }
}

#[test]
fn comparing_nested_components_is_limited() {
    let nested = |n: usize| {
        let mut all = PolygonMesh::default();
        for k in 0..n {
            let mut cube = cube();
            cube.positions.iter_mut().for_each(|p| *p *= 1.0 + 1e-3 * k as f32);
            all = together(&all, &cube);
        }
        all
    };
    // Every second cube bounds a cavity.
    assert_eq!(Cage::new(&nested(20)).unwrap().notices().len(), 20);
    // 2000 cubes of 12 triangles, 11 samples each: 11 * 12 * 2000 * 1999 / 2 triangles.
    let error = Cage::new(&nested(2000)).unwrap_err().to_string();
    assert!(error.contains("2000 components") && error.contains("visits 263868000 triangles"), "{error}");
}
