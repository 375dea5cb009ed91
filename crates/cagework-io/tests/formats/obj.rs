//! OBJ reader and writer.

use cagework_io::{ModelFormat, UpAxis, write_cage_obj};
use glam::{DVec3, Vec3};
use proptest::prelude::*;

use crate::common::{CUBE_OBJ, cube, plain_cube, read, twist, volume};

/// Message of a failed read.
fn fault(text: &str) -> String {
    read("x.obj", text.as_bytes()).unwrap_err().to_string()
}

#[test]
fn every_v_line_is_a_vertex_in_file_order() {
    let model = read("x.obj", b"v 9 9 9\nv 0 0 0\no a\nv 1 0 0\ng b\nv 0 1 0\nf 2 3 4\n").unwrap();
    assert_eq!(model.format(), ModelFormat::Obj);
    assert_eq!(model.positions, [Vec3::splat(9.0), Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(model.triangles, [[1, 2, 3]]);
    assert_eq!(model.counts.nodes, 2);
}

#[test]
fn all_notations_of_a_face_are_equivalent() {
    let head = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n";
    for face in [
        "f 1 2 3",
        "f 1/1 2/1 3/1",
        "f 1//1 2//1 3//1",
        "f 1/1/1 2/1/1 3/1/1",
        "f -3 -2 -1",
        "f\t1  2 \\\n 3 # c",
    ] {
        let model = read("x.obj", format!("{head}{face}").as_bytes()).unwrap();
        assert_eq!(model.triangles, [[0, 1, 2]], "{face}");
        assert!(model.notices.is_empty(), "{face}: {:?}", model.notices);
    }
}

#[test]
fn windows_line_ends_and_latin_1_names_are_read() {
    let text = CUBE_OBJ.replace('\n', "\r\n").replace("# a box", "# W\u{1}rfel");
    let bytes: Vec<u8> = text.bytes().map(|b| if b == 1 { 0xfc } else { b }).collect();
    let model = read("x.obj", &bytes).unwrap();
    assert_eq!((model.positions.as_slice(), model.n_faces()), (cube().as_slice(), 6));
    assert!((volume(&model) - 1.0).abs() < 1e-6);
    let moved: Vec<Vec3> = model.positions.iter().map(|&p| twist(p)).collect();
    let out = model.write_obj(&moved).unwrap();
    assert!(!String::from_utf8_lossy(&out).replace("\r\n", "").contains('\n'), "line ends are kept");
    assert!(out.windows(2).any(|w| w == [b'W', 0xfc]), "bytes that are not UTF-8 are kept");
}

#[test]
fn cage_keeps_its_polygons() {
    let cage = read("x.obj", CUBE_OBJ.as_bytes()).unwrap().cage_mesh();
    assert_eq!(cage.positions, cube());
    assert_eq!(cage.faces[0], [0, 2, 3, 1]);
    assert_eq!(cage.faces.len(), 6);
    let again = read("y.obj", &write_cage_obj(&cage, DVec3::ZERO)).unwrap().cage_mesh();
    assert_eq!(again, cage);
}

#[test]
fn file_without_faces_is_a_pose_but_not_a_mesh() {
    let cage = read("cage.obj", CUBE_OBJ.as_bytes()).unwrap();
    let pose =
        read("pose.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 2 2 2").unwrap();
    assert_eq!(cage.pose_positions(&pose).unwrap()[7], Vec3::splat(2.0));
    let message = pose.require_faces().unwrap_err().to_string();
    assert!(message.contains("8 vertices but no faces"), "{message}");
    let short = read("pose.obj", b"v 0 0 0").unwrap();
    let message = cage.pose_positions(&short).unwrap_err().to_string();
    assert!(message.contains("has 1 vertices, but cage cage.obj has 8"), "{message}");
}

/// Exporters cut polygons along shape-dependent diagonals, so a pose can have other diagonals than the cage.
#[test]
fn pose_may_cut_polygons_along_other_diagonals_but_not_swap_vertices() {
    // A hexagonal prism: vertices 0 to 5 below, 6 to 11 above.
    let prism = |sides: &dyn Fn(usize) -> [usize; 6], caps: &[[usize; 3]], names: &dyn Fn(usize) -> usize| {
        let mut faces: Vec<Vec<usize>> = Vec::new();
        for k in 0..6 {
            faces.extend(sides(k).chunks(3).map(<[usize]>::to_vec));
        }
        for cap in caps {
            faces.push(cap.iter().rev().copied().collect());
            faces.push(cap.iter().map(|v| v + 6).collect());
        }
        let vertex = |v: usize| {
            let (y, x) = (std::f32::consts::TAU * (v % 6) as f32 / 6.0).sin_cos();
            format!("v {x} {y} {}\n", v / 6)
        };
        let mut places: Vec<String> = (0..12).map(vertex).collect();
        (0..12).for_each(|v| places[names(v)] = vertex(v));
        let face = |f: &Vec<usize>| {
            format!("f {}\n", f.iter().map(|&v| (names(v) + 1).to_string()).collect::<Vec<_>>().join(" "))
        };
        read("prism.obj", (places.concat() + &faces.iter().map(face).collect::<String>()).as_bytes()).unwrap()
    };
    let up = |k: usize| [k, (k + 1) % 6, (k + 1) % 6 + 6, k, (k + 1) % 6 + 6, k + 6];
    let down = |k: usize| [k, (k + 1) % 6, k + 6, (k + 1) % 6, (k + 1) % 6 + 6, k + 6];
    let fan = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]];
    let zigzag = [[1, 2, 3], [1, 3, 0], [0, 3, 4], [0, 4, 5]];
    let corner = [[1, 2, 3], [3, 4, 5], [5, 0, 1], [1, 3, 5]];
    let same = |v: usize| v;
    let cage = prism(&up, &fan, &same);
    for pose in [prism(&down, &zigzag, &same), prism(&down, &corner, &same), prism(&up, &corner, &same)] {
        assert_eq!(cage.pose_positions(&pose).unwrap(), pose.positions);
    }
    // If two vertices are swapped, the wrong order is found for each triangulation.
    for (a, b) in [(0, 9), (2, 11), (4, 8)] {
        let names = |v: usize| {
            if v == a {
                b
            } else if v == b {
                a
            } else {
                v
            }
        };
        for caps in [&fan, &corner] {
            let message = cage.pose_positions(&prism(&down, caps, &names)).unwrap_err().to_string();
            assert!(
                message.ends_with("export it from the cage itself, with the settings of the cage's export"),
                "{message}"
            );
        }
    }
}

#[test]
fn errors_name_the_line() {
    let cases = [
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99", "line 4: refers to vertex 99, but there are 3"),
        ("v 0 0 0\nv 1 0 0\nf 1 2 -3\nv 0 1 0", "line 3: refers to vertex -3, but there are 2"),
        ("v 0 0 0\nf 0 1 1", "line 2: refers to vertex 0, but there are 1"),
        ("v 0 0 0\nf 1 x 1", "line 2: corner 'x' is not an index"),
        ("v 0 0 0\nf 1/1/1/1 1 1", "line 2: corner '1/1/1/1'"),
        ("# c\nv 0 nan 0", "line 2: y coordinate is 'nan'"),
        ("v 0 0 1e99", "line 1: z coordinate is '1e99'"),
        ("v 1,5 0 0", "line 1: x coordinate is '1,5'"),
        ("v 0 0", "line 1: z coordinate is missing"),
        ("hello", "no vertices"),
    ];
    for (text, expected) in cases {
        let message = fault(text);
        assert!(message.contains(expected), "{message} should contain {expected}");
    }
}

#[test]
fn unsupported_formats_are_named_with_a_hint() {
    for (name, bytes, expected) in [
        ("a.obj", &b""[..], "empty"),
        ("a.zip", b"PK\x03\x04rest", "zip archive: unpack it"),
        ("a.npz", b"PK\x03\x04rest", "weights or arrays, not a model: export it as"),
        ("a.blend", b"BLENDER", "export it as GLB, OBJ, PLY, STL, OFF or 3MF"),
        ("a.stl", b"solid x", "damaged: it has no text facets"),
        ("a.glb", b"glXF", "not a GLB"),
        ("a.ply", b"solid", "not a PLY"),
        ("a.obj", b"\xff\xfev\0 \0", "is a UTF-16 text: save it as UTF-8"),
        ("a.obj", b"v\0 \x000\0", "is a UTF-16 text: save it as UTF-8"),
        ("a.obj", b"version https://git-lfs.github.com/spec/v1\noid sha256:0", "`git lfs pull`"),
        ("a.glb", b"version https://git-lfs.github.com/spec/v1\noid sha256:0", "is a Git LFS pointer"),
        ("a.obj", b"<!DOCTYPE html>", "is an XML or HTML file"),
    ] {
        let message = read(name, bytes).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn forward_references_and_dangling_attributes_are_tolerated() {
    let model = read("x.obj", b"f 1/7 2/8//  3\nv 0 0 0".as_slice()).unwrap_err().to_string();
    assert!(model.contains("line 1"), "{model}");
    let model = read("x.obj", b"f 1/7 2/8 3/9\nv 0 0 0\nv 1 0 0\nv 0 1 0").unwrap();
    assert_eq!(model.triangles, [[0, 1, 2]]);
    assert_eq!(model.notices.len(), 1);
}

/// Exporters write faces with one or two corners after merging edges.
#[test]
fn faces_with_fewer_than_three_corners_are_kept_unchanged() {
    let short = "f 3//3 1//2\n";
    let at = CUBE_OBJ.rfind("f ").unwrap();
    let with = [&CUBE_OBJ[..at], short, "f # none\n", &CUBE_OBJ[at..]].concat();
    let [plain, model] = [CUBE_OBJ, &with].map(|text| read("x.obj", text.as_bytes()).unwrap());
    assert_eq!((&model.triangles, model.n_faces()), (&plain.triangles, plain.n_faces()));
    assert!(model.notices[0].starts_with("2 lines, points, curves or faces with fewer than three corners"));
    // The export renumbers the normals of all faces as if the short faces were not in the file.
    let bent: Vec<Vec3> = model.positions.iter().map(|&p| twist(p)).collect();
    let [expected, out] =
        [&plain, &model].map(|model| String::from_utf8(model.write_obj(&bent).unwrap()).unwrap());
    assert_eq!(out.replace(short, "").replace("f # none\n", ""), expected);
}

#[test]
fn concave_polygon_keeps_its_area() {
    let model = read("x.obj", b"v 0 0 0\nv 2 1 0\nv 0 2 0\nv 1 1 0\nf 1 2 3 4").unwrap();
    let p = |i: u32| model.positions[i as usize];
    let area: f32 = model.triangles.iter().map(|&[a, b, c]| (p(b) - p(a)).cross(p(c) - p(a)).z / 2.0).sum();
    let both_up = model.triangles.iter().all(|&[a, b, c]| (p(b) - p(a)).cross(p(c) - p(a)).z > 0.0);
    // The shoelace formula of the four corners gives an area of 1.
    assert!(both_up && (area - 1.0).abs() < 1e-6);
}

#[test]
fn patched_file_at_rest_is_the_same_text() {
    // The first line ends in CRLF, and the text contains double blanks, a tab and comments. All of them must stay.
    let text = "# c\r\nmtllib a.mtl\no x\nv  0.5 0 0 0.1 0.2 0.3 # red\n\tv 1 0 0\nv 0 1 0\nvt 0.25 1\nusemtl m\ns 1\nf 1/1 2/1 3/1\nl 1 2\n";
    let model = read("x.obj", text.as_bytes()).unwrap();
    assert_eq!(String::from_utf8(model.write_obj(&model.positions).unwrap()).unwrap(), text);
}

#[test]
fn patched_file_moves_vertices_and_keeps_the_rest() {
    let text = "v 0 0 0 0.1 0.2 0.3\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n";
    let model = read("x.obj", text.as_bytes()).unwrap();
    let moved = [Vec3::new(1.5, -2.0, 0.125), Vec3::X, Vec3::Y];
    let out = String::from_utf8(model.write_obj(&moved).unwrap()).unwrap();
    assert_eq!(out, text.replacen("v 0 0 0", "v 1.5 -2 0.125", 1));
    assert_eq!(read("x.obj", out.as_bytes()).unwrap().positions, moved);
}

#[test]
fn patched_normals_rotate_with_the_surface() {
    let model = read("x.obj", CUBE_OBJ.as_bytes()).unwrap();
    // The vertices rotate by 90 degrees about z: x becomes y, y becomes -x.
    let turned: Vec<Vec3> = model.positions.iter().map(|p| Vec3::new(-p.y, p.x, p.z)).collect();
    let out = String::from_utf8(model.write_obj(&turned).unwrap()).unwrap();
    let normals: Vec<Vec3> = out
        .lines()
        .filter_map(|l| l.strip_prefix("vn "))
        .map(|l| Vec3::from_slice(&l.split(' ').map(|x| x.parse().unwrap()).collect::<Vec<f32>>()))
        .collect();
    // The source has six `vn` lines, each used by four vertices. The export has a line for each of these uses.
    assert_eq!(normals.len(), 24);
    let expected = [-Vec3::Z, Vec3::Z, Vec3::X, -Vec3::X, -Vec3::Y, Vec3::Y];
    for (k, n) in normals.iter().enumerate() {
        assert!(n.distance(expected[k / 4]) < 1e-6, "normal {k} is {n}");
    }
    let again = read("y.obj", out.as_bytes()).unwrap();
    assert!(again.notices.is_empty());
    assert_eq!((&again.positions, again.n_faces()), (&turned, 6));
}

#[test]
fn invalid_positions_are_rejected() {
    let model = read("x.obj", CUBE_OBJ.as_bytes()).unwrap();
    let message = model.write_obj(&[Vec3::ZERO]).unwrap_err().to_string();
    assert!(message.contains("1 position for a model of 8 vertices"), "{message}");
    let message = model.write_glb(&[Vec3::NAN; 8]).unwrap_err().to_string();
    assert!(message.contains("vertex 0 is not a finite number"), "{message}");
}

#[test]
fn smoothing_is_kept_in_obj_and_split_in_glb_exports() {
    let cube = read("x.obj", CUBE_OBJ.as_bytes()).unwrap().cage_mesh();
    let smooth = String::from_utf8(write_cage_obj(&cube, DVec3::ZERO)).unwrap();
    let flat = smooth.replacen("f ", "s off\nf ", 1);
    let model = read("x.obj", flat.as_bytes()).unwrap();
    assert_eq!(String::from_utf8(model.write_obj(&model.positions).unwrap()).unwrap(), flat);
    // Three flat faces meet at each of the eight vertices, so a GLB with flat faces has 24 vertices.
    let vertices = |text: &str| {
        let model = read("x.obj", text.as_bytes()).unwrap();
        read("x.glb", &model.write_glb(&model.positions).unwrap()).unwrap().positions.len()
    };
    assert_eq!((vertices(&flat), vertices(&smooth)), (24, 8));
}

#[test]
fn model_with_z_up_is_rotated_to_y_up_and_exported_with_z_up() {
    for bytes in [CUBE_OBJ.as_bytes().to_vec(), plain_cube().glb()] {
        let lying = read("x", &bytes).unwrap();
        let mut upright = lying.clone();
        upright.set_up(UpAxis::Z);
        // Setting the up axis rotates by -90 degrees about x: up becomes y, and behind becomes -z.
        for (p, q) in lying.positions.iter().zip(&upright.positions) {
            assert_eq!(*q, Vec3::new(p.x, p.z, -p.y));
        }
        let moved = |positions: &[Vec3]| positions.iter().map(|&p| twist(p)).collect::<Vec<_>>();
        let shape = moved(&lying.positions);
        let poses = [("a".to_owned(), moved(&shape))];
        let turned = |positions: &[Vec3]| UpAxis::Z.turned(positions).into_owned();
        let turned_poses = [("a".to_owned(), turned(&poses[0].1))];
        assert_eq!(lying.write_obj(&shape), upright.write_obj(&turned(&shape)));
        assert_eq!(lying.write_glb(&shape), upright.write_glb(&turned(&shape)));
        assert_eq!(
            lying.write_glb_poses(&shape, &poses),
            upright.write_glb_poses(&turned(&shape), &turned_poses)
        );
        upright.set_up(UpAxis::Y);
        assert_eq!(upright.positions, lying.positions);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn polygons_of_any_shape_become_two_triangles_fewer_than_corners(points in prop::collection::vec(prop::array::uniform3(-1e3_f32..1e3), 3..40)) {
        let mut text = String::new();
        for [x, y, z] in &points {
            text += &format!("v {x} {y} {z}\n");
        }
        text += "f";
        (1..=points.len()).for_each(|i| text += &format!(" {i}"));
        prop_assert_eq!(read("x.obj", text.as_bytes()).unwrap().triangles.len(), points.len() - 2);
    }
}

/// Each material becomes a primitive, and a million primitives would take a gigabyte.
#[test]
fn materials_have_a_limit() {
    let text: String = (0..20_000).map(|i| format!("usemtl m{i}\n")).collect();
    let error = read("x.obj", format!("v 0 0 0\n{text}").as_bytes()).unwrap_err().to_string();
    assert_eq!(error, "x.obj: line 16386: more than 16384 materials: merge some");
}
