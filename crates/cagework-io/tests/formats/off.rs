//! OFF reader and writer.

use cagework_io::{Model, ModelFormat};

use crate::common::{CUBE_OBJ, cube, read, twist};

/// An OFF file of a cube whose faces are quads. `after`: text at the end of each vertex line and of each face line.
fn off(header: &str, after: [&str; 2]) -> String {
    let vertices =
        cube().iter().map(|p| format!("{} {} {}{}\n", p.x, p.y, p.z, after[0])).collect::<String>();
    let faces = quads().cage_mesh().faces;
    let faces = faces.iter().map(|f| {
        let corners: Vec<String> = f.iter().map(u32::to_string).collect();
        format!("{} {}{}\n", f.len(), corners.join(" "), after[1])
    });
    header.to_owned() + &vertices + &faces.collect::<String>()
}

fn quads() -> Model {
    read("cube.obj", CUBE_OBJ.as_bytes()).unwrap()
}

/// Headers as Geomview, CGAL, libigl and MeshLab write them, and one without the keyword. Colours are from 0 to 255 or
/// from 0 to 1.
#[test]
fn off_files_are_read_with_polygons_and_colours() {
    let faces = quads().cage_mesh().faces;
    let colors = "face colours in an OFF file are not supported: ignored";
    for (header, after, color, notices) in [
        ("OFF\n8 6 12\n", ["", ""], None, vec![]),
        ("# by hand\n\nOFF 8 6 0 # counts\n", ["", " 3 0.5 0.5 0.5"], None, vec![colors]),
        ("OFF\r\n8 6\r\n", [" # a vertex", " # a face"], None, vec![]),
        ("8 6 0\n", ["", ""], None, vec![]),
        ("OFF8 6 0\n", ["", ""], None, vec![]),
        ("COFF\n8 6 0\n", [" 255 0 51 255", ""], Some([1.0, 0.0, 0.2]), vec![]),
        ("COFF\n8 6 0\n", [" 1.0 0 0.2 1", ""], Some([1.0, 0.0, 0.2]), vec![]),
        ("NOFF\n8 6 0\n", [" 0 0 1", ""], None, vec![]),
        (
            "NCOFF\n8 6 0\n",
            [" 0 0 1 255 0 51", ""],
            Some([1.0, 0.0, 0.2]),
            vec!["normals together with colours in an OFF file are not supported: ignored"],
        ),
        (
            "STOFF\n8 6 0\n",
            [" 0.5 0.5", ""],
            None,
            vec!["additional vertex values in an OFF file are not supported: ignored"],
        ),
    ] {
        let text = off(header, after);
        let model = read("cube.off", text.as_bytes()).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert_eq!(
            (model.format(), &model.positions, model.cage_mesh().faces),
            (ModelFormat::Off, &cube(), faces.clone()),
            "{text}"
        );
        assert_eq!(model.notices, notices, "{text}");
        // The expected colour is converted from sRGB to linear (IEC 61966-2-1).
        let expected = color.map_or([1.0; 3], |c| {
            c.map(|x: f32| if x == 0.0 { 0.0 } else { ((x + 0.055) / 1.055).powf(2.4) })
        });
        let found = model.look().vertices[0].color;
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?}");
        // Exports can be read again, with colours, normals and order.
        let moved: Vec<_> = cube().into_iter().map(twist).collect();
        let written = model.write(ModelFormat::Off, &moved).unwrap();
        let first = if header.contains('C') {
            "COFF"
        } else if header.starts_with('N') {
            "NOFF"
        } else {
            "OFF"
        };
        assert!(written.starts_with(format!("{first}\n8 6 0\n").as_bytes()));
        let again = read("again", &written).unwrap();
        assert_eq!((&again.positions, again.cage_mesh().faces), (&moved, faces.clone()));
        assert_eq!(again.look().vertices, model.look().vertices);
        assert!(again.write(ModelFormat::Off, &again.positions).unwrap() == written);
        assert_eq!(model.lost_in(ModelFormat::Stl).is_some(), color.is_some());
    }
}

#[test]
fn damaged_off_files_are_errors() {
    let good = off("OFF\n8 6 12\n", ["", ""]);
    for (from, to, expected) in [
        ("OFF\n8", "OFF\n800", "its header declares 800 'vertex' elements, too many for a file of"),
        ("OFF\n8 6", "OFF\n8 7", "damaged: line 16: the file ends after 6 of 7 faces"),
        ("OFF\n8 6", "OFF\n8 x", "damaged: line 2: 'x' is not a number such as 1.25"),
        ("\n1 0 0\n", "\n1,5 0 0\n", "damaged: line 4: '1,5' is not a number such as 1.25"),
        ("\n1 0 0\n", "\n1 0\n", "damaged: line 4: has only 2 of 3 numbers"),
        ("\n1 0 0\n", "\ninf 0 0\n", "vertex 1 has a coordinate that is not finite"),
        ("4 0 2 3 1", "4 0 2 8 1", "face 0 refers to vertex 8, but there are 8"),
        ("4 0 2 3 1", "4 0 2 -3 1", "face 0 refers to vertex -3, but there are 8"),
        ("4 0 2 3 1", "4 0 2 1.5 1", "line 11: '1.5' is not a vertex index; indices count from 0"),
        ("4 0 2 3 1", "5 0 2 3 1", "line 11: has 4 corners of 5"),
        ("OFF\n8 6 12\n", "OFF\n8\n", "damaged: line 2: has only 1 of 2 numbers"),
        ("OFF\n", "4OFF\n", "only three-dimensional vertices are supported"),
        ("OFF\n", "OFF BINARY\n", "x.off: it is a binary OFF file: save it as text"),
    ] {
        let text = good.replacen(from, to, 1);
        assert!(text != good, "{from}");
        let message = read("x.off", text.as_bytes()).unwrap_err().to_string();
        assert!(message.contains(expected), "{to}: {message}");
    }
    let tight = Model::read_within("x.off", good.as_bytes(), &mut |_| None, 1000);
    assert!(tight.unwrap_err().to_string().contains("memory"));
}

#[test]
fn off_files_on_one_line_are_read() {
    let faces = quads().cage_mesh().faces;
    for (header, after) in [("OFF 8 6 0\n", ""), ("OFF8 6 0\n", ""), ("COFF 8 6 0\n", " 255 0 51 255")] {
        let text = off(header, [after, ""]).replace('\n', " ");
        let model = read("cube.off", text.as_bytes()).unwrap();
        assert_eq!((&model.positions, model.cage_mesh().faces), (&cube(), faces.clone()), "{header}");
        let red = if after.is_empty() { [1.0; 3] } else { [1.0, 0.0, 0.033_104_77] };
        let found = model.look().vertices[0].color;
        assert!(found.iter().zip(red).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?}");
        let cut = text.trim_end().rsplit_once(' ').unwrap().0;
        let message = read("cube.off", cut.as_bytes()).unwrap_err().to_string();
        assert!(message.contains("has 3 corners of 4"), "{message}");
    }
}
