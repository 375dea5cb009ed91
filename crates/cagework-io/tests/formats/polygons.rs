//! PLY and STL readers and writers.

use cagework_io::{Model, ModelFormat};
use glam::Vec3;

use crate::common::{CUBE_OBJ, cube, read, twist, volume};

fn fault(name: &str, bytes: &[u8]) -> String {
    read(name, bytes).unwrap_err().to_string()
}

fn obj() -> Model {
    read("cube.obj", CUBE_OBJ.as_bytes()).unwrap()
}

/// A cube whose faces are quads, as a PLY with colours, an unknown property and edges.
fn ply_text() -> String {
    let mut text = "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 8\nproperty double x\nproperty double y\n\
        property double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty float quality\n\
        element edge 1\nproperty int vertex1\nproperty int vertex2\nelement face 6\n\
        property list uchar int vertex_indices\nend_header\n"
        .to_owned();
    for (k, p) in cube().iter().enumerate() {
        text += &format!("{} {} {} {} 0 51 0.5\n", p.x, p.y, p.z, 10 * k);
    }
    text += "0 1\n";
    for face in obj().cage_mesh().faces {
        let corners: Vec<String> = face.iter().map(u32::to_string).collect();
        text += &format!("{} {}\n", face.len(), corners.join(" "));
    }
    text
}

#[test]
fn indented_lines_of_a_ply_header_are_read() {
    let [plain, indented] =
        [ply_text(), ply_text().replace("\nelement", "\n  element").replace("\nend", "\n\tend")]
            .map(|text| read("cube.ply", text.as_bytes()).unwrap());
    assert_eq!((&plain.positions, plain.cage_mesh()), (&indented.positions, indented.cage_mesh()));
    let binary = String::from_utf8_lossy(
        b"ply\nformat binary_little_endian 1.0\n element vertex 2\n property float x\n \
        property float y\n property float z\n end_header\n",
    )
    .into_owned();
    let body: Vec<u8> = [0.0_f32, 0.0, 0.0, 1.5, 2.5, 3.5].iter().flat_map(|x| x.to_le_bytes()).collect();
    let points = read("points.ply", &[binary.as_bytes(), &body].concat()).unwrap();
    assert_eq!(points.positions, [Vec3::ZERO, Vec3::new(1.5, 2.5, 3.5)]);
}

#[test]
fn ply_is_read_with_polygons_and_colours_and_lists_ignored_data() {
    let model = read("cube.ply", ply_text().as_bytes()).unwrap();
    assert_eq!((model.format(), model.n_faces(), model.triangles.len()), (ModelFormat::Ply, 6, 12));
    assert_eq!(model.positions, cube());
    assert_eq!(model.cage_mesh().faces, obj().cage_mesh().faces);
    assert!((volume(&model) - volume(&obj())).abs() < 1e-6);
    // The seventh vertex has red 60 / 255 and blue 51 / 255, which are converted from sRGB to linear (IEC 61966-2-1).
    let look = model.look();
    let corner = look.vertices.iter().find(|v| v.source == 6).unwrap();
    let linear = |c: f32| ((c + 0.055) / 1.055).powf(2.4);
    assert!(
        (corner.color[0] - linear(60.0 / 255.0)).abs() < 1e-5 && (corner.color[2] - linear(0.2)).abs() < 1e-5
    );
    assert_eq!(model.notices, ["PLY data that is not supported is ignored: quality, edge"]);
}

#[test]
fn written_ply_and_stl_can_be_read() {
    let moved: Vec<Vec3> = cube().into_iter().map(twist).collect();
    let from_text = read("cube.ply", ply_text().as_bytes()).unwrap();
    let written = from_text.write(ModelFormat::Ply, &moved).unwrap();
    assert!(written.starts_with(b"ply\nformat ascii 1.0\n"), "text stays text");
    let again = read("again.ply", &written).unwrap();
    assert_eq!((&again.positions, again.cage_mesh().faces), (&moved, from_text.cage_mesh().faces));
    assert_eq!(again.look().vertices, from_text.look().vertices, "colours stay");

    // Exports of an OBJ as PLY or STL are binary.
    for format in [ModelFormat::Ply, ModelFormat::Stl] {
        let bytes = obj().write(format, &moved).unwrap();
        let again = read("again", &bytes).unwrap();
        assert_eq!((again.format(), again.triangles.len()), (format, 12));
        let twice = again.write(format, &again.positions).unwrap();
        assert!(twice == bytes, "{format:?}: the same bytes again");
        if format == ModelFormat::Ply {
            assert_eq!(again.positions, moved);
        } else {
            // STL numbers vertices by their first use in a triangle, so compare the positions of all triangle corners.
            let places = |model: &Model| -> Vec<Vec3> {
                model.triangles.iter().flatten().map(|&v| model.positions[v as usize]).collect()
            };
            let mut shape = obj();
            shape.positions = moved.clone();
            assert_eq!((again.positions.len(), places(&again)), (8, places(&shape)));
        }
    }
}

#[test]
fn both_byte_orders_of_a_ply_are_read_and_kept() {
    let little = obj().write(ModelFormat::Ply, &cube()).unwrap();
    let end = little.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = String::from_utf8(little[..end].to_vec()).unwrap();
    assert!(
        header.contains("property float x") && header.contains("property list uchar uint vertex_indices")
    );
    let mut big = header.replace("little", "big").into_bytes();
    let (vertices, faces) = little[end..].split_at(8 * 12);
    vertices.chunks(4).for_each(|x| big.extend(x.iter().rev()));
    for face in faces.chunks(1 + 4 * 4) {
        big.push(face[0]);
        face[1..].chunks(4).for_each(|v| big.extend(v.iter().rev()));
    }
    // The word "ascii" in a comment does not make the file a text file.
    let commented = header.replacen("element", "comment converted from ascii\nelement", 1).into_bytes();
    assert_eq!(read("x.ply", &[&commented, &little[end..]].concat()).unwrap().positions, cube());
    let model = read("big.ply", &big).unwrap();
    assert_eq!(model.positions, cube());
    assert!(model.write(ModelFormat::Ply, &cube()).unwrap() == big);
}

#[test]
fn text_stl_can_have_several_solids_in_any_case() {
    let triangle = |x: f32| {
        format!(
            "FACET NORMAL 0 0 1\r\n OUTER LOOP\r\n VERTEX {x} 0 0\r\n VERTEX {} 0 0\r\n vertex {x} 1e0 0\r\n endloop\r\nendfacet\r\n",
            x + 1.0
        )
    };
    let text = format!(
        "solid\r\n{}{}endsolid\r\nsolid second one\r\n{}endsolid second one\r\n",
        triangle(0.0),
        triangle(1.0),
        triangle(5.0)
    );
    let model = read("x.stl", text.as_bytes()).unwrap();
    assert_eq!((model.format(), model.triangles.len()), (ModelFormat::Stl, 3));
    // The first corner of the second triangle coincides with the second corner of the first triangle.
    assert_eq!(model.positions.len(), 8);
    assert_eq!(model.triangles[1], [1, 3, 4]);
    let again = model.write(ModelFormat::Stl, &model.positions).unwrap();
    assert!(again.starts_with(b"solid cagework\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"));
    assert_eq!(read("again.stl", &again).unwrap().positions, model.positions);
}

#[test]
fn binary_stl_can_begin_with_solid_and_has_flat_normals() {
    let mut bytes = obj().write(ModelFormat::Stl, &cube()).unwrap();
    assert_eq!(bytes.len(), 84 + 12 * 50);
    let float = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    for t in 0..12 {
        let [n, a, b, c] =
            [0, 12, 24, 36].map(|k| Vec3::from_array([0, 4, 8].map(|x| float(84 + 50 * t + k + x))));
        assert!((n - (b - a).cross(c - a).normalize()).length() < 1e-6 && n.dot(a - Vec3::splat(0.5)) > 0.0);
    }
    bytes[..12].copy_from_slice(b"solid facets");
    assert_eq!(read("x.stl", &bytes).unwrap().triangles.len(), 12);
    bytes.extend(b"\0\0");
    assert_eq!(read("x.stl", &bytes).unwrap().triangles.len(), 12, "trailing bytes");
}

#[test]
fn solids_keep_their_names_and_ignored_data_is_listed() {
    let triangle = |z: f32| {
        format!(
            "facet normal 0 0 1\nouter loop\nvertex 0 0 {z}\nvertex 1 0 {z}\nvertex 0 1 {z}\nendloop\nendfacet\n"
        )
    };
    let [first, second, third] = [0.0, 1.0, 2.0].map(triangle);
    let text = format!("solid left wing\n{first}{second}endsolid left wing\nsolid b\n{third}endsolid b\n");
    let model = read("x.stl", text.as_bytes()).unwrap();
    assert_eq!(model.counts.nodes, 2);
    assert_eq!(String::from_utf8(model.write(ModelFormat::Stl, &model.positions).unwrap()).unwrap(), text);
    assert_eq!(model.lost_in(ModelFormat::Ply).unwrap(), "the ply file does not keep: names of parts");
    assert_eq!((model.notices.len(), model.lost_in(ModelFormat::Stl)), (0, None));

    let mut bytes = obj().write(ModelFormat::Stl, &cube()).unwrap();
    assert_eq!(read("x.stl", &bytes).unwrap().notices, [""; 0]);
    // The attribute bytes of the first facet are blue in 15-bit colour, as VisCAM and Materialise Magics write it.
    bytes[84 + 48] = 0x1f;
    let colors = "STL colours (attributes of facets, COLOR= in the header) are not supported: ignored";
    assert_eq!(read("x.stl", &bytes).unwrap().notices, [colors]);
    bytes[84 + 48] = 0;
    bytes[..6].copy_from_slice(b"COLOR=");
    assert_eq!(read("x.stl", &bytes).unwrap().notices, [colors]);
    bytes[..6].fill(0);
    bytes[80] = 7;
    let short = read("x.stl", &bytes).unwrap();
    assert_eq!(short.notices, ["its header declares 7 facets: the 250 bytes after them are ignored"]);
    bytes[80] = 0;
    assert!(fault("x.stl", &bytes).ends_with("its header declares 0 facets, but 600 bytes follow"));
}

/// Errors name the line and the word, and do not quote the messages of the parser library.
#[test]
fn errors_in_text_files_name_the_line() {
    let stl = "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid x\n";
    let ply = ply_text();
    for (name, text, expected) in [
        ("x.stl", stl.replace("vertex 1 0", "vertex 1,5 0"), "line 5: '1,5' is not a number such as 1.25"),
        ("x.stl", stl.replace("vertex 1 0 0\n", ""), "line 7: the facet that ends here has 2 corners, not 3"),
        ("x.stl", stl.replace("vertex 1 0 0", "vertex 1 0"), "line 5: has only 2 of 3 numbers"),
        ("x.ply", ply.replacen("\n1 0 0 ", "\n1,5 0 0 ", 1), "line 19: '1,5' is not a number such as 1.25"),
        (
            "x.ply",
            ply.replacen("double y", "duble y", 1),
            "line 6: 'property duble y' is not a statement of a PLY header",
        ),
        (
            "x.ply",
            ply.replacen("4 0 2", "5 0 2", 1),
            "it ends early, or its elements do not match the header",
        ),
    ] {
        let message = fault(name, text.as_bytes());
        assert!(message.contains(&format!("the file is damaged: {expected}")), "{message}");
    }
    // Blender 2.47 omitted the keyword 'comment'.
    let old = ply.replace("comment by hand", "Created by hand");
    let model = read("x.ply", old.as_bytes()).unwrap();
    assert_eq!(model.positions, cube());
    assert_eq!(model.notices[0], "line 3 'Created by hand' is not a statement of a PLY header: ignored");
}

#[test]
fn damaged_ply_and_stl_files_are_errors() {
    let ply = ply_text();
    for (from, to, expected) in [
        (
            "element vertex 8",
            "element vertex 80000",
            "its header declares 80000 'vertex' elements, too many for a file of",
        ),
        ("element vertex 8", "element vertex 9", "damaged"),
        ("property double x\n", "", "its vertices have no x, y or z"),
        ("\n0 1\n4 0", "\n0 1\n4 8", "face 0 refers to vertex 8, but there are 8, counted from 0"),
        ("format ascii 1.0", "format braille 1.0", "damaged"),
    ] {
        let broken = ply.replacen(from, to, 1);
        assert!(broken != ply, "{from}");
        let message = fault("x.ply", broken.as_bytes());
        assert!(message.contains(expected), "{to}: {message}");
    }
    let short = read(
        "x.ply",
        ply.replacen("element face 6", "element face 7", 1)
            .replacen("\n0 1\n", "\n0 1\n2 0 1\n", 1)
            .as_bytes(),
    );
    let short = short.unwrap();
    assert_eq!(short.triangles, read("x.ply", ply.as_bytes()).unwrap().triangles);
    assert!(short.notices.contains(&"1 face with fewer than three corners: ignored".to_owned()));
    let alone = b"ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n3 0 1 2\n";
    let message = fault("x.ply", alone);
    assert!(message.contains("face 0 refers to vertex 0, but there are 0"), "{message}");
    // Elements without properties take no bytes, so the sum of their counts is limited.
    let mut idle = String::from("ply\nformat binary_little_endian 1.0\n");
    (0..2000).for_each(|k| idle += &format!("element a{k} 20000\n"));
    let message = fault("x.ply", (idle + "end_header\n").as_bytes());
    assert!(message.contains("its header declares 20000 'a"), "{message}");
    // The reader rewrites the lines of this text, which become longer.
    let empty =
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
                 element face 500\nproperty list uchar int vertex_indices\nend_header\n.5 0 0\n"
            .to_owned()
            + &"0\n".repeat(500);
    let message = fault("x.ply", empty.as_bytes());
    let expected =
        format!("its header declares 500 'face' elements, too many for a file of {} bytes", empty.len());
    assert!(message.contains(&expected), "{message}");
    let mut stl = obj().write(ModelFormat::Stl, &cube()).unwrap();
    assert!(!stl.starts_with(b"solid"), "other programs would read it as text");
    stl.truncate(300);
    let message = fault("x.stl", &stl);
    assert!(
        message.contains("its header declares 12 'triangle' elements, too many for a file of 300 bytes"),
        "{message}"
    );
    assert!(fault("x.stl", b"solid x\nfacet normal 0 0\n").contains("damaged"));
    assert!(fault("x.stl", b"solid x\nfacet\nendsolid x\n").contains("damaged"));
    let mut stl = obj().write(ModelFormat::Stl, &cube()).unwrap();
    stl[96..100].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(fault("x.stl", &stl).contains("vertex 0 has a coordinate that is not finite"));
    let tight =
        Model::read_within("x.stl", obj().write(ModelFormat::Stl, &cube()).unwrap(), &mut |_| None, 1000);
    assert!(tight.unwrap_err().to_string().contains("memory"));
}

/// Variants written by other programs: non-numeric normals, a missing end, tabs, a byte order mark, unknown keywords.
#[test]
fn variants_of_text_stl_are_read() {
    let triangle = |x: f32, normal: &str| {
        format!(
            "facet normal {normal}\n outer loop\n vertex {x} 0 0\n vertex {} 0 0\n vertex {x} 1 0\n endloop\n endfacet\n",
            x + 1.0
        )
    };
    let plain = format!("solid a\n{}{}endsolid a\n", triangle(0.0, "0 0 1"), triangle(3.0, "0 0 1"));
    let expected = read("x.stl", plain.as_bytes()).unwrap();
    assert_eq!((expected.triangles.len(), expected.notices.len()), (2, 0));
    let cut = plain.replace("endsolid a\n", "");
    for text in [
        format!("solid a\n{}{}endsolid", triangle(0.0, "nan nan nan"), triangle(3.0, "-nan(ind) 0 1")),
        plain.replace("solid a", "solid\ta"),
        plain.replace(' ', "\t"),
        format!("\u{feff}{plain}"),
        plain.replace(" outer", " color 1 0 0\n outer"),
        cut.clone(),
    ] {
        let model = read("x.stl", text.as_bytes()).unwrap();
        assert_eq!(
            (&model.positions, &model.triangles),
            (&expected.positions, &expected.triangles),
            "{text}"
        );
        let is_cut =
            model.notices.iter().any(|n| n == "the file does not end with 'endsolid': it may be cut off");
        assert_eq!(is_cut, text == cut, "{text}");
    }
}

/// Variants written by other programs: non-ASCII comments, empty lines, numbers such as `.5`, `1.` and `nan`
/// in ignored properties, float vertex indices, triangle strips.
#[test]
fn variants_of_text_ply_are_read() {
    let plain = ply_text();
    let expected = read("x.ply", plain.as_bytes()).unwrap();
    let with = |from: &str, to: &[u8]| {
        let at = plain.find(from).unwrap();
        [&plain.as_bytes()[..at], to, &plain.as_bytes()[at + from.len()..]].concat()
    };
    for bytes in [
        with("comment by hand", b"comment M\xf6bel"),
        with("end_header\n", b"end_header\n\n"),
        with("element edge", b"\nelement edge"),
        // CloudCompare writes property names with parentheses.
        with("float quality", b"float scalar_Illuminance_(PCV)"),
        plain.replace("0.5\n", ".5\n").into_bytes(),
        plain.replace("0.5\n", "-.5e1\n\n").into_bytes(),
        plain.replace("0.5\n", "nan\n").into_bytes(),
        plain.replace("0.5\n", "-inf\n").into_bytes(),
        plain.replace("0.5\n", "1.\n").into_bytes(),
        plain.replace('\n', "\r\n").into_bytes(),
        plain.replace('\n', "\r").into_bytes(),
        format!("\u{feff}{plain}").into_bytes(),
        with("list uchar int", b"list uint8 float"),
        with("list uchar int", b"list int double"),
    ] {
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let model = read("x.ply", &bytes).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert_eq!(
            (&model.positions, &model.triangles),
            (&expected.positions, &expected.triangles),
            "{text}"
        );
        assert_eq!(model.look().vertices, expected.look().vertices, "{text}");
    }
    let no_place = plain.replacen("\n1 0 0 ", "\nnan 0 0 ", 1);
    assert!(fault("x.ply", no_place.as_bytes()).contains("vertex 1 has a coordinate that is not finite"));
    let negative = plain.replacen("\n0 1\n4 0", "\n0 1\n4 -1", 1);
    assert!(fault("x.ply", negative.as_bytes()).contains("face 0 refers to vertex -1, but there are 8"));

    // Two strips in one list, joined by degenerate triangles: a quad and two triangles.
    let strips =
        "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n\
        element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
            .to_owned()
            + &cube().iter().map(|p| format!("{} {} {}\n", p.x, p.y, p.z)).collect::<String>()
            + "10 0 1 2 3 -1 4 4 5 6 7\n";
    let model = read("x.ply", strips.as_bytes()).unwrap();
    assert_eq!(model.triangles, [[0, 1, 2], [1, 3, 2], [4, 6, 5], [5, 6, 7]]);
    // 299,998 triangles of 300,000 corners take 42 MiB, at 48 bytes for each of their own corners.
    let long = strips.replace("10 0 1 2 3 -1 4 4 5 6 7", &("300000".to_owned() + &" 0 1 2".repeat(100_000)));
    let found =
        Model::read_within("x.ply", long.as_bytes(), &mut |_| None, 30 << 20).unwrap_err().to_string();
    assert!(found.contains("MiB of memory, more than the limit of 30 MiB"), "{found}");
    assert_eq!(read("x.ply", long.as_bytes()).unwrap().triangles.len(), 299_998);
}

/// Colour channels can be 8-bit integers, 16-bit integers, or floats from 0 to 1.
#[test]
fn ply_colours_can_have_any_numeric_type() {
    let of = |kind: &str, red: &str| {
        let text = ply_text()
            .replace("property uchar", &format!("property {kind}"))
            .replace(" 0 51 0.5", " 0 0 0.5");
        let lines = text.lines().map(|line| {
            let words: Vec<&str> = line.split(' ').collect();
            if words.len() == 7 {
                [&words[..3], &[red], &words[4..]].concat().join(" ")
            } else {
                line.to_owned()
            }
        });
        let text = lines.collect::<Vec<_>>().join("\n") + "\n";
        let model = read("x.ply", text.as_bytes()).unwrap_or_else(|e| panic!("{kind}: {e}"));
        model.look().vertices[0].color[0]
    };
    let expected = of("uchar", "128");
    assert!(expected > 0.2 && expected < 0.22, "{expected}");
    assert_eq!(
        (of("ushort", "32896"), of("float", "0.502"), of("double", "0.502")),
        (expected, expected, expected)
    );
}

#[test]
fn a_face_has_at_most_262_144_corners() {
    // One more corner than 2^18 would be no multiple of three, so add two.
    let n = (1 << 18) + 2;
    let corners = |from: usize| (0..n).map(|k| format!(" {}", from + k % 3)).collect::<String>();
    let obj = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf{}\n", corners(1));
    let off = format!("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n{n}{}\n", corners(0));
    for (name, text, message) in [
        ("a.obj", obj, "a.obj: line 4: the face has more than 262144 corners: split it"),
        ("a.off", off, "a.off: face 0 has 262146 corners, more than the limit of 262144: split it"),
    ] {
        assert_eq!(fault(name, text.as_bytes()), message);
    }
}

#[test]
fn normals_of_points_are_left_out_with_a_notice() {
    let text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
        property float nx\nproperty float ny\nproperty float nz\nend_header\n1 2 3 0 0 1\n";
    let model = read("points.ply", text.as_bytes()).unwrap();
    assert_eq!(
        model.notices,
        ["normals of points are not kept: without faces, they cannot be computed again"]
    );
    let written = String::from_utf8(model.write(ModelFormat::Ply, &model.positions).unwrap()).unwrap();
    assert!(!written.contains("nx") && written.ends_with("1 2 3\n"), "{written}");
}
