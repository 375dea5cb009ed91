use glam::{Vec3, vec3};
use proptest::prelude::*;

use super::{Code, Fix, MAX_PLACES, Repair, Severity, check, check_smooth, repair, repair_smooth};
use cagework_core::bind::bind;
use cagework_core::cage::Cage;
use cagework_core::cage::subdivided_box;
use cagework_core::crossing::notices;
use cagework_core::mesh::{Bounds, PolygonMesh};
use cagework_core::options::BindOptions;
use cagework_core::progress::NoProgress;
use cagework_core::words::grouped;

fn box_mesh(divisions: u32) -> PolygonMesh {
    subdivided_box(Bounds { min: Vec3::splat(-1.0), max: Vec3::ONE }, 0.0, [divisions; 3])
}

fn codes(mesh: &PolygonMesh) -> Vec<Code> {
    check(mesh, None, None).problems.iter().map(|p| p.code).collect()
}

fn mended(mesh: &PolygonMesh, repairs: &[Repair]) -> PolygonMesh {
    repair(mesh, repairs, None).unwrap().mesh
}

#[test]
fn sound_cage_has_no_problems() {
    let found = check(&box_mesh(3), Some(&[Vec3::ZERO]), Some(64));
    assert_eq!((found.valid, found.encloses, found.components), (true, Some(true), 1));
    assert_eq!(found.problems, []);
    assert!((found.thickness.unwrap() - 2.0).abs() < 1e-6, "the box is 2 wide");
}

/// The mesh diagonal scales the area tolerance, so it must ignore vertices without faces. Otherwise one such vertex far
/// away would make every face count as having no area.
#[test]
fn a_far_unused_vertex_does_not_make_a_valid_cage_faulty() {
    let mut mesh = box_mesh(2);
    mesh.positions.push(Vec3::splat(1e12));
    let found = check(&mesh, None, None);
    assert!(found.valid);
    assert_eq!(codes(&mesh), [Code::UnusedVertex]);
}

/// Of 1,500 boxes inside each other, each pair takes 11 samples and 12 triangles.
#[test]
fn components_inside_each_other_are_compared_up_to_a_limit() {
    let mut boxes = PolygonMesh { positions: Vec::new(), faces: Vec::new() };
    for k in 1..=1500_u16 {
        let corner = Vec3::splat(f32::from(k));
        let shell = subdivided_box(Bounds { min: -corner, max: corner }, 0.0, [1; 3]);
        let first = boxes.positions.len() as u32;
        boxes.faces.extend(shell.faces.iter().map(|face| face.iter().map(|&i| first + i).collect()));
        boxes.positions.extend(shell.positions);
    }
    let found = check(&boxes, None, None);
    let sentence = "cage has 1500 components, and too many inside each other: comparing them visits 148401000 \
                    triangles, more than the limit of 134217728: remove inner components";
    assert_eq!(found.problem(Code::NotACage).unwrap().message, sentence);
}

#[test]
fn holes_are_reported_with_their_edges_and_filled() {
    let mut mesh = box_mesh(2);
    let missing = mesh.faces.remove(5);
    let found = check(&mesh, None, None);
    assert!(!found.valid);
    let problem = found.problem(Code::OpenEdge).unwrap();
    assert_eq!((problem.count, problem.severity), (4, Severity::Error));
    for edge in &problem.places.edges {
        assert!(edge.iter().all(|v| missing.contains(v)));
    }
    assert_eq!(problem.fixes, [Fix::Repair { repair: Repair::FillHoles }]);
    let cage = Cage::new(&mended(&mesh, &[Repair::FillHoles])).unwrap();
    assert_eq!(cage.notices(), [], "the new faces point outward");
}

/// A face hangs by its corners between four holes. A loop around the face and one around the holes would use the same
/// edges.
#[test]
fn holes_that_meet_in_corners_are_filled_one_by_one() {
    let mut mesh = box_mesh(3);
    let is_middle = |face: &&Vec<u32>| {
        let mut at = face.iter().map(|&i| mesh.positions[i as usize]);
        at.all(|p| p.z == 1.0 && p.x.abs() < 0.5 && p.y.abs() < 0.5)
    };
    let middle = mesh.faces.iter().find(is_middle).unwrap().clone();
    mesh.faces.retain(|face| face.iter().filter(|i| middle.contains(i)).count() != 2);
    assert_eq!(mesh.faces.len(), 54 - 4);
    let filled = repair(&mesh, &[Repair::FillHoles], None).unwrap();
    assert_eq!(filled.done, ["Filled 4 holes."]);
    let cage = Cage::new(&filled.mesh).unwrap();
    assert_eq!(cage.notices(), []);
    let volume: f64 = (0..cage.triangles().len() as u32)
        .map(|t| cage.triangle_corners(t))
        .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
        .sum();
    assert!((volume - 8.0).abs() < 1e-6, "{volume}");
}

/// Many triangulations of a flat hole have the same area. The corners in the middle of the sides lie in line with others.
#[test]
fn a_flat_hole_is_filled_without_triangles_in_line() {
    let mut mesh = box_mesh(3);
    let positions = &mesh.positions;
    mesh.faces.retain(|face| face.iter().any(|&i| positions[i as usize].z < 1.0));
    let filled = mended(&mesh, &[Repair::FillHoles]);
    assert_eq!(codes(&filled), [Code::UnusedVertex], "only the vertices in the middle of the hole");
}

#[test]
fn split_seams_are_welded() {
    let whole = box_mesh(1);
    let mut split = PolygonMesh::default();
    for face in &whole.faces {
        let first = split.positions.len() as u32;
        split.positions.extend(face.iter().map(|&i| whole.positions[i as usize]));
        split.faces.push((first..first + face.len() as u32).collect());
    }
    // Offset a corner by the rounding error of a text file.
    split.positions[3].x += 1e-6;
    let found = check(&split, None, None);
    assert_eq!(found.problem(Code::DuplicateVertex).unwrap().count, 24 - 8);
    assert_eq!(found.problem(Code::OpenEdge).unwrap().fixes[0], Fix::Repair { repair: Repair::Weld });
    let repaired = repair(&split, &[Repair::Weld], None).unwrap();
    assert_eq!(repaired.mesh.positions.len(), 8);
    assert_eq!(codes(&repaired.mesh), []);
    for (old, new) in repaired.vertex_of.iter().enumerate() {
        let at = repaired.mesh.positions[new.unwrap() as usize];
        assert!(at.distance(split.positions[old]) < 2e-6);
    }
}

/// A face of a cube is cut into three. The four cuts end on edges of its neighbours, two on each, which is a T-junction.
#[test]
fn vertices_on_edges_are_reported_and_become_corners() {
    let mut mesh = box_mesh(1);
    let face = mesh.faces.remove(2);
    let [a, b, c, d] = face[..] else { panic!("a quad") };
    let at = |p: u32, q: u32, t: f32| mesh.positions[p as usize].lerp(mesh.positions[q as usize], t);
    let cuts = [at(a, b, 0.25), at(a, b, 0.7), at(d, c, 0.25), at(d, c, 0.7)];
    mesh.positions.extend(cuts);
    mesh.faces.extend([vec![a, 8, 10, d], vec![8, 9, 11, 10], vec![9, b, c, 11]]);
    let found = check(&mesh, None, None);
    assert_eq!(found.problem(Code::TJunction).unwrap().places.vertices, [8, 9, 10, 11]);
    assert_eq!(found.problem(Code::OpenEdge).unwrap().fixes, [Fix::Repair { repair: Repair::Weld }]);
    let repaired = repair(&mesh, &[Repair::Weld], None).unwrap();
    assert_eq!(repaired.done, ["Joined 4 vertices with open edges."]);
    assert_eq!(codes(&repaired.mesh), []);
    assert_eq!(Cage::new(&repaired.mesh).unwrap().notices(), []);
}

/// The two boxes share a face, an edge or part of their solid. None is inside the other.
#[test]
fn parts_that_touch_or_overlap_are_not_inside_out_and_not_welded() {
    for (offset, duplicates) in [(vec3(2.0, 0.0, 0.0), 4), (vec3(2.0, 2.0, 0.0), 2), (vec3(1.0, 0.5, 0.5), 0)]
    {
        let one = box_mesh(1);
        let mut both = one.clone();
        both.positions.extend(one.positions.iter().map(|p| *p + offset));
        both.faces.extend(one.faces.iter().map(|f| f.iter().map(|i| i + 8).collect::<Vec<_>>()));
        let found = check(&both, None, None);
        assert!(found.valid, "{:?}", found.problems);
        assert!(found.problem(Code::Flipped).is_none(), "{offset}");
        assert_eq!(found.problem(Code::DuplicateVertex).map_or(0, |p| p.count), duplicates);
        assert!(found.problem(Code::DuplicateVertex).is_none_or(|p| p.fixes.is_empty()));
        let repaired = repair(&both, &[Repair::Weld, Repair::Flip], None).unwrap();
        assert_eq!((repaired.mesh, repaired.done), (both, vec![]), "{offset}");
    }
}

/// Two cubes whose common face was welded by another program: its edges have four faces, and it is there twice.
#[test]
fn inner_walls_are_dropped() {
    let one = box_mesh(1);
    let mut both = one.clone();
    let offset = vec3(2.0, 0.0, 0.0);
    let place = |p: Vec3| one.positions.iter().position(|q| q.distance(p) < 1e-6).map(|v| v as u32);
    let index: Vec<u32> = one
        .positions
        .iter()
        .map(|p| {
            place(*p + offset).unwrap_or_else(|| {
                both.positions.push(*p + offset);
                both.positions.len() as u32 - 1
            })
        })
        .collect();
    both.faces.extend(one.faces.iter().map(|f| f.iter().map(|&i| index[i as usize]).collect::<Vec<_>>()));
    assert_eq!((both.positions.len(), both.faces.len()), (12, 12));
    assert!(codes(&both).contains(&Code::NonManifoldEdge));
    let whole = mended(&both, &[Repair::DropDegenerate]);
    assert_eq!((whole.faces.len(), codes(&whole)), (10, vec![]));
}

#[test]
fn holes_that_are_too_long_are_named_and_not_offered() {
    let n = 100;
    let ring = |z: f32| (0..n).map(move |k| (std::f32::consts::TAU * k as f32 / n as f32, z));
    let mut tube = PolygonMesh {
        positions: ring(0.0).chain(ring(1.0)).map(|(t, z)| vec3(t.cos(), t.sin(), z)).collect(),
        faces: (0..n).map(|k| vec![k, (k + 1) % n, n + (k + 1) % n, n + k]).collect(),
    };
    tube.faces.push((0..n).rev().collect());
    let found = check(&tube, None, None);
    let open = found.problem(Code::OpenEdge).unwrap();
    assert_eq!(
        open.message,
        "The cage is not closed: 100 edges belong to one face only. A hole has 100 edges; only holes of up to 64 edges \
         are filled."
    );
    assert_eq!(open.fixes, []);
}

#[test]
fn flipped_faces_are_reported_by_component_and_flipped_back() {
    let inner = box_mesh(1);
    let mut mesh = inner.clone();
    mesh.positions.extend(inner.positions.iter().map(|p| *p + vec3(5.0, 0.0, 0.0)));
    mesh.faces.extend(inner.faces.iter().map(|f| f.iter().map(|i| i + 8).collect::<Vec<_>>()));
    mesh.faces[2].reverse();
    for face in &mut mesh.faces[6..] {
        face.reverse();
    }
    let found = check(&mesh, None, None);
    let turned: Vec<_> = found.problems.iter().filter(|p| p.code == Code::Flipped).collect();
    assert_eq!(turned.len(), 2, "one for each component");
    assert_eq!(turned[0].places.faces, [2]);
    assert_eq!(turned[0].message, "In component 0, 1 of 6 faces points inwards.");
    assert_eq!(turned[1].count, 6);
    assert_eq!(Cage::new(&mended(&mesh, &[Repair::Flip])).unwrap().notices(), []);
    mesh = inner;
    mesh.faces[2].reverse();
    assert_eq!(repair(&mesh, &[Repair::Flip], None).unwrap().done, ["Flipped 1 face."]);
}

#[test]
fn intersections_are_reported_with_their_location() {
    let mut mesh = box_mesh(1);
    let other = box_mesh(1);
    mesh.positions.extend(other.positions.iter().map(|p| *p + vec3(1.3, 0.2, 0.1)));
    mesh.faces.extend(other.faces.iter().map(|f| f.iter().map(|i| i + 8).collect::<Vec<_>>()));
    let found = check(&mesh, None, None);
    assert!(found.valid, "overlapping parts are bound as their union");
    assert!(found.problems[0].message.starts_with("Parts of the cage overlap"));
    // A component that intersects itself: a vertex of a box is pushed out through the opposite side.
    let mut pushed = box_mesh(3);
    let through = pushed.positions.iter().position(|p| p.x < -0.99 && p.y.abs() < 0.5 && p.z.abs() < 0.5);
    pushed.positions[through.unwrap()].x = 2.0;
    let crossing = check(&pushed, None, None);
    assert!(crossing.valid, "a cage that intersects itself can be bound");
    let cage = Cage::new(&pushed).unwrap();
    let said = &crossing.problem(Code::SelfIntersection).unwrap().message;
    assert!(said.starts_with("The cage goes through itself: "), "{said}");
    assert_eq!(notices(&cage), [said.as_str()]);
    let bound = bind(&[Vec3::ZERO], &cage, &BindOptions { grid: 16, ..BindOptions::default() }, &NoProgress);
    assert!(bound.unwrap().report.notices.contains(said));
    let problem = found.problem(Code::SelfIntersection).unwrap();
    assert!(problem.message.contains(&format!("near {:?}", problem.places.points[0])), "{}", problem.message);
    for p in &problem.places.points {
        assert!((-0.3..=1.3).contains(&p[0]), "{p:?} is not where the boxes overlap");
    }
}

#[test]
fn degenerate_faces_and_unused_vertices_are_dropped() {
    let mut mesh = box_mesh(1);
    mesh.positions.push(Vec3::ZERO);
    mesh.faces.push(mesh.faces[0].clone());
    mesh.faces.push(vec![0, 1, 1]);
    mesh.faces.push(vec![0, 1, 99]);
    mesh.faces.push(vec![2, 3]);
    let found = codes(&mesh);
    for code in [Code::UnusedVertex, Code::DuplicateFace, Code::DegenerateFace, Code::BadIndex] {
        assert!(found.contains(&code), "{code:?} is not in {found:?}");
    }
    let repaired = repair(&mesh, &[Repair::DropDegenerate], None).unwrap();
    assert_eq!(repaired.mesh, box_mesh(1));
    assert_eq!(repaired.vertex_of[8], None);
    assert_eq!(repaired.done.len(), 2);
}

#[test]
fn non_manifold_edges_and_vertices_are_reported() {
    let mut mesh = box_mesh(1);
    mesh.positions.push(vec3(3.0, 0.0, 0.0));
    mesh.faces.push(vec![mesh.faces[0][0], mesh.faces[0][1], 8]);
    let found = check(&mesh, None, None);
    assert_eq!(found.problem(Code::NonManifoldEdge).unwrap().count, 1);
    // Two tetrahedra that share a vertex.
    let mut pair = PolygonMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z],
        faces: vec![vec![0, 2, 1], vec![0, 1, 3], vec![1, 2, 3], vec![2, 0, 3]],
    };
    pair.faces.extend([vec![0, 4, 5], vec![0, 6, 4], vec![4, 6, 5], vec![5, 6, 0]]);
    let found = check(&pair, None, None);
    assert_eq!(found.problem(Code::NonManifoldVertex).unwrap().places.vertices, [0]);
    assert!(found.valid, "{:?}", found.problems);
}

#[test]
fn vertices_outside_are_listed_and_growing_encloses_them() {
    let mesh = box_mesh(2);
    let model = [Vec3::ZERO, vec3(1.2, 0.3, 0.1), vec3(-0.5, 0.9, 0.2), vec3(0.0, -1.3, 1.1)];
    let found = check(&mesh, Some(&model), None);
    assert_eq!(found.encloses, Some(false));
    let problem = found.problem(Code::ModelOutside).unwrap();
    assert_eq!(problem.places.vertices, [1, 3]);
    assert_eq!(problem.fixes, [Fix::Repair { repair: Repair::Grow }]);
    let grown = repair(&mesh, &[Repair::Grow], Some(&model)).unwrap().mesh;
    assert_eq!(check(&grown, Some(&model), None).encloses, Some(true));
    assert_eq!(grown.faces, mesh.faces);
}

/// Two subdivisions round off the corners of the box: (0.9, 0.9, 0.9) is outside the smooth surface but inside the box.
#[test]
fn a_smooth_cage_is_checked_by_its_smooth_surface() {
    let (mesh, model) = (box_mesh(2), [Vec3::ZERO, Vec3::splat(0.9)]);
    assert_eq!(check(&mesh, Some(&model), None).encloses, Some(true));
    let found = check_smooth(&mesh, Some(&model), None, 2);
    assert_eq!(found.problem(Code::ModelOutside).unwrap().places.vertices, [1]);
    let grown = repair_smooth(&mesh, &[Repair::Grow], Some(&model), 2).unwrap().mesh;
    assert_eq!(check_smooth(&grown, Some(&model), None, 2).encloses, Some(true));
    let unsmooth = check_smooth(&mesh, None, None, 4);
    assert!(!unsmooth.valid && unsmooth.problems[0].message.contains("from 0 to 3"));
}

#[test]
fn thin_parts_are_reported_with_a_grid_that_resolves_them() {
    let bounds = Bounds { min: Vec3::ZERO, max: vec3(4.0, 4.0, 0.05) };
    let mesh = subdivided_box(bounds, 0.0, [4, 4, 1]);
    let thickness = check(&mesh, None, None).thickness.unwrap();
    let found = check(&mesh, None, Some(16));
    let problem = found.problem(Code::ThinPart).unwrap();
    assert_eq!(problem.severity, Severity::Warning);
    let [Fix::Grid { cells }] = problem.fixes[..] else { panic!("{:?}", problem.fixes) };
    assert_eq!(cells, (4.0 / thickness).ceil() as u32);
    assert!(check(&mesh, None, Some(cells)).problem(Code::ThinPart).is_none());
}

/// A ray from a narrow face beside a corner hits the other side of the corner at a short distance.
#[test]
fn a_corner_is_not_a_thin_part() {
    let outline = [[-1.0, -1.0], [1.0002, -1.0], [1.0, -0.999], [1.0, 1.0], [-1.0, 1.0]];
    let n = outline.len() as u32;
    let positions =
        [-1.0, 1.0].into_iter().flat_map(|z| outline.map(|[x, y]| vec3(x, y, z))).collect::<Vec<_>>();
    let mut faces = vec![(0..n).rev().collect::<Vec<_>>(), (n..2 * n).collect()];
    faces.extend((0..n).map(|k| vec![k, (k + 1) % n, n + (k + 1) % n, n + k]));
    let found = check(&PolygonMesh { positions, faces }, None, Some(64));
    assert!(found.valid && found.problems.is_empty(), "{:?}", found.problems);
    assert!((found.thickness.unwrap() - 2.0).abs() < 0.01, "{:?}", found.thickness);
}

#[test]
fn json_of_a_check_has_stable_names() {
    let mut mesh = box_mesh(1);
    mesh.faces.remove(0);
    let found = check(&mesh, None, None);
    assert_eq!(found.problems[0].code, Code::OpenEdge);
    assert!(found.problems.iter().all(|p| !p.message.is_empty()));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_mesh_is_checked_and_repaired_without_a_panic(
        points in prop::collection::vec(prop::array::uniform3(-1.0_f32..1.0), 0..12),
        faces in prop::collection::vec(prop::collection::vec(0_u32..13, 0..6), 0..20),
        broken in any::<bool>(),
    ) {
        let mut positions: Vec<Vec3> = points.into_iter().map(Vec3::from_array).collect();
        if let (true, Some(p)) = (broken, positions.first_mut()) {
            p.x = f32::NAN;
        }
        let mesh = PolygonMesh { positions, faces };
        let found = check(&mesh, Some(&[Vec3::ZERO]), Some(32));
        prop_assert_eq!(found.valid, Cage::new(&mesh).is_ok());
        let all = [Repair::Weld, Repair::DropDegenerate, Repair::FillHoles, Repair::Flip];
        let repaired = repair(&mesh, &all, None).unwrap();
        let again = check(&repaired.mesh, None, None);
        prop_assert!(again.problem(Code::BadIndex).is_none());
        for (old, new) in repaired.vertex_of.iter().enumerate() {
            prop_assert!(new.is_none_or(|v| (v as usize) < repaired.mesh.positions.len()), "{old}");
        }
    }
}

/// With one vertex dragged far away, the rest of the cube is small relative to the diagonal. Its other corners count as
/// duplicates, and faces seem to share corners that they do not share.
#[test]
fn a_cube_with_a_far_vertex_is_checked() {
    let mut mesh = box_mesh(1);
    mesh.positions[0].y = -1_429_490.6;
    let found = check(&mesh, Some(&[Vec3::ZERO]), Some(64));
    assert!(found.valid, "closed and free of intersections: {:?}", found.problems);
    // The tolerance, 2e-6 of the diagonal, is 2.86. Of the other six corners near corner 1, five are within it and
    // count as its duplicates. The sixth is opposite and 3.46 away.
    assert_eq!(found.problem(Code::DuplicateVertex).unwrap().count, 5);
    // Two corners of a face are at the same position, as in a damaged file.
    let mut mesh = box_mesh(1);
    mesh.positions[1] = mesh.positions[0];
    assert!(check(&mesh, Some(&[Vec3::ZERO]), Some(64)).problem(Code::DuplicateVertex).is_some());
    let repaired = mended(&mesh, &[Repair::Weld, Repair::DropDegenerate, Repair::FillHoles, Repair::Flip]);
    assert_eq!(codes(&repaired), [], "a cube with one edge collapsed");
}

/// A mesh of separate triangles has as many components and holes as faces. Comparing all pairs of components would take
/// minutes.
#[test]
fn soup_of_separate_triangles_is_checked_and_repaired_within_seconds() {
    let mut soup = PolygonMesh::default();
    for k in 0..30_000_u32 {
        let corner = vec3((k % 200) as f32, (k / 200) as f32, 0.0);
        soup.positions.extend([corner, corner + 0.5 * Vec3::X, corner + 0.5 * Vec3::Y]);
        soup.faces.push(vec![3 * k, 3 * k + 1, 3 * k + 2]);
    }
    let repairs = [Repair::Weld, Repair::DropDegenerate, Repair::FillHoles, Repair::Flip];
    let (found, repaired) = within_seconds(move || (check(&soup, None, None), mended(&soup, &repairs)));
    assert_eq!(found.components, 30_000);
    assert_eq!(found.problem(Code::OpenEdge).unwrap().count, 90_000);
    assert_eq!(repaired.faces.len(), 60_000, "each hole is filled by the triangle's back side");
}

/// The test meshes are stars of triangles, any two of which intersect. A list of all pairs of 100,000 such triangles
/// would take 40 GB.
#[test]
fn crossings_are_counted_and_listed_up_to_a_limit() {
    let star = |n: u32| {
        let mut star = PolygonMesh::default();
        for k in 0..n {
            let (s, c) = (6.0 * k as f32 / n as f32).sin_cos();
            star.positions.extend([
                vec3(c, s, -1.0),
                vec3(c, s, 1.0),
                vec3(-c, -s, 10.0 * k as f32 / n as f32),
            ]);
            star.faces.push(vec![3 * k, 3 * k + 1, 3 * k + 2]);
        }
        star
    };
    let found = check(&star(200), None, None);
    let crossing = found.problem(Code::SelfIntersection).unwrap();
    let said = format!(
        "{} pairs of triangles meet, and {} more, the first of faces ",
        grouped(MAX_PLACES),
        grouped(crossing.count - MAX_PLACES)
    );
    assert!(crossing.message.contains(&said), "{}", crossing.message);
    assert_eq!(crossing.places.points.len(), MAX_PLACES);
    let found = within_seconds(move || check(&star(20_000), None, None));
    let crossing = found.problem(Code::SelfIntersection).unwrap();
    assert!(
        crossing.message.contains(", and at least ") && crossing.count > 1_000_000,
        "{}",
        crossing.message
    );
}

/// Runs `work` on a thread; fails if it takes more than a minute.
fn within_seconds<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> T {
    let (send, receive) = std::sync::mpsc::channel();
    std::thread::spawn(move || send.send(work()));
    receive.recv_timeout(std::time::Duration::from_secs(60)).expect("it takes a second")
}
