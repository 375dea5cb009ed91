//! 3MF reader and writer.

use std::io::{Cursor, Read as _, Write as _};

use cagework_io::{Model, ModelFormat};
use glam::Vec3;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use crate::common::{CUBE, CUBE_OBJ, cube, cube_mesh, model_part, package, plate, read, twist, volume};

fn files(bytes: &[u8]) -> Vec<(String, Vec<u8>)> {
    let mut zip = ZipArchive::new(Cursor::new(bytes)).unwrap();
    let file = |k| {
        let mut entry = zip.by_index(k).unwrap();
        let mut content = Vec::new();
        entry.read_to_end(&mut content).unwrap();
        (entry.name().unwrap().into_owned(), content)
    };
    (0..ZipArchive::new(Cursor::new(bytes)).unwrap().len()).map(file).collect()
}

fn text(bytes: &[u8], name: &str) -> String {
    String::from_utf8(files(bytes).into_iter().find(|(of, _)| of == name).unwrap().1).unwrap()
}

const ROOT: &str = "3D/3dmodel.model";

/// Applies a transform of the core specification, section 3.3: the row vector (x, y, z, 1) times the 4 x 3 matrix `m`,
/// which is stored row by row.
fn moved([x, y, z]: [f32; 3], m: [f32; 12]) -> Vec3 {
    Vec3::from_array([0, 1, 2].map(|k| x * m[k] + y * m[3 + k] + z * m[6 + k] + m[9 + k]))
}

#[test]
fn build_places_objects_components_and_parts() {
    let model = read("plate.3mf", &plate()).unwrap();
    assert_eq!((model.format(), model.positions.len(), model.n_faces()), (ModelFormat::ThreeMf, 40, 60));
    let (mirror, shift) = (
        [-1., 0., 0., 0., 2., 0., 0., 0., 1., 4., 5., 6.],
        [1., 0., 0., 0., 1., 0., 0., 0., 1., 10., 20., 30.],
    );
    let turn = [0., 1., 0., -1., 0., 0., 0., 0., 1., 0., 0., 0.5];
    let both = |m: [f32; 12]| {
        CUBE.iter()
            .map(move |&p| moved(p, m))
            .chain(CUBE.iter().map(move |&p| moved(moved(p, mirror).to_array(), m)))
    };
    let expected: Vec<Vec3> = both(shift).chain(both(turn)).chain(cube()).collect();
    assert_eq!(model.positions, expected);
    // Five cubes; the mirrored ones have twice the volume, and their triangles also face outwards.
    assert!((volume(&model) - 7.0).abs() < 1e-4, "{}", volume(&model));
    assert_eq!(model.notices, ["colours painted in a slicer are kept, but not shown"]);
    // Each of the four cubes of the first part has one blue triangle and eleven red ones. The cube of the other part
    // has no colours.
    let look = model.look();
    let colors: Vec<([f32; 4], u32)> = look
        .groups
        .iter()
        .map(|group| (group.base_color, group.triangles.end - group.triangles.start))
        .collect();
    assert_eq!(colors, [([1., 0., 0., 1.], 44), ([0., 0., 1., 128. / 255.], 4)]);
}

#[test]
fn exports_change_only_the_numbers_of_moved_vertices() {
    let part = model_part(
        &format!("<object id=\"7\" type=\"model\">{}</object>", cube_mesh()),
        "<item objectid=\"7\" transform=\"0 1 0 -1 0 0 0 0 1 5 0 0\"/>",
    );
    let file = package(&[(ROOT, part.clone())]);
    let model = read("a.3mf", &file).unwrap();
    assert_eq!(model.write(ModelFormat::ThreeMf, &model.positions).unwrap(), file);
    let mut positions = model.positions.clone();
    // The item turns the object by 90 degrees about z, x to y: (1, 0, 0) is at (5, 1, 0).
    assert_eq!(positions[1], Vec3::new(5.0, 1.0, 0.0));
    positions[1] = Vec3::new(4.5, 1.25, -2.0);
    let written = model.write(ModelFormat::ThreeMf, &positions).unwrap();
    let old = "<vertex x=\"1.000\"  y='0.000' z=\"0.000\" />";
    assert_eq!(text(&written, ROOT), part.replace(old, "<vertex x=\"1.25\"  y='0.5' z=\"-2\" />"));
    for ((name, content), (of, before)) in files(&written).into_iter().zip(files(&file)) {
        assert!(name == of && (name == ROOT || content == before), "{name}");
    }
}

/// Tolerance of positions that are written with seven digits and transformed with numbers up to 60.
const ROUNDING: f32 = 1e-4;

#[test]
fn objects_with_several_shapes_are_copied() {
    let file = plate();
    let model = read("plate.3mf", &file).unwrap();
    let bent: Vec<Vec3> = model.positions.iter().map(|&p| twist(p / 10.0)).collect();
    let written = model.write(ModelFormat::ThreeMf, &bent).unwrap();
    let again = read("again.3mf", &written).unwrap();
    assert_eq!((again.triangles.clone(), again.counts), (model.triangles.clone(), model.counts));
    assert_eq!(again.look().groups, model.look().groups);
    for (p, q) in again.positions.iter().zip(&bent) {
        assert!(p.distance(*q) < ROUNDING, "{p} {q}");
    }
    // The archive has four shapes of object 2 and two of object 3. The copies have new identifiers and new UUIDs.
    let root = text(&written, ROOT);
    let count = |word: &str| root.matches(word).count();
    assert_eq!((count("<object "), count("paint_color=\"8\""), count("<component ")), (6, 4, 4));
    for id in 1..=7 {
        assert_eq!(count(&format!(" id=\"{id}\"")), 1, "{id}: {root}");
    }
    assert!(
        [2, 3, 4, 5]
            .iter()
            .all(|n| count(&format!("p:UUID=\"00000002-61cb-4c03-9d28-80fed5dfa1d{:x}\"", n + 10)) == 1)
    );
    let notice = model.copies_in(ModelFormat::ThreeMf, &written).unwrap();
    assert!(notice.starts_with("4 copies of objects are written"), "{notice}");
    // Placements with the same motion share one object.
    let shifted: Vec<Vec3> = model.positions.iter().map(|&p| p + Vec3::Z).collect();
    let written = model.write(ModelFormat::ThreeMf, &shifted).unwrap();
    let root = text(&written, ROOT);
    assert_eq!(root.matches("<object ").count(), 2, "{root}");
    assert_eq!(model.copies_in(ModelFormat::ThreeMf, &written), None);
}

/// Placed coordinates are rounded to 24 bits, so the same shift gives slightly different shapes of one object: 0.1 has an
/// error of 2^-28 near the origin, and of 2^-18 at 128 mm.
#[test]
fn placements_that_differ_by_rounding_share_an_object() {
    let corners = ["0.1 0.2 0.3", "10.1 0.7 0", "0.3 9.7 0", "0.9 0.7 5.3"].map(|corner| {
        let [x, y, z] = <[&str; 3]>::try_from(corner.split(' ').collect::<Vec<_>>()).unwrap();
        format!("<vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>")
    });
    let triangles = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
        .map(|[a, b, c]| format!("<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>"));
    let mesh = format!(
        "<mesh><vertices>{}</vertices><triangles>{}</triangles></mesh>",
        corners.concat(),
        triangles.concat()
    );
    let items = ["0 0 0", "33.3 0 0", "0 129.7 0.1", "200.9 180.3 0"]
        .map(|at| format!("<item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 {at}\"/>"));
    let part = model_part(&format!("<object id=\"1\" type=\"model\">{mesh}</object>"), &items.concat());
    let model = read("a.3mf", &package(&[(ROOT, part)])).unwrap();
    let n_objects = |positions: &[Vec3]| {
        let written = model.write(ModelFormat::ThreeMf, positions).unwrap();
        let again = read("b.3mf", &written).unwrap();
        assert!(again.positions.iter().zip(positions).all(|(p, q)| p.distance(*q) < ROUNDING));
        text(&written, ROOT).matches("<object ").count()
    };
    // Positions in f32, moved by sums of weights that have errors of their own.
    let shift = Vec3::new(0.123, -4.567, 8.9);
    let by_weights = |p: &Vec3| (*p + 7.7) * 0.3 + (*p - 1.1) * 0.7 - Vec3::splat(1.54) + shift;
    let shifted: Vec<Vec3> = model.positions.iter().map(by_weights).collect();
    assert_eq!(n_objects(&shifted), 1);
    // A motion of a tenth of a millimetre is none of these errors.
    let mut bent = shifted;
    bent[5].z += 0.1;
    assert_eq!(n_objects(&bent), 2);
}

#[test]
fn other_formats_become_one_object() {
    let obj = read("cube.obj", CUBE_OBJ.as_bytes()).unwrap();
    let bent: Vec<Vec3> = cube().into_iter().map(twist).collect();
    let written = obj.write(ModelFormat::ThreeMf, &bent).unwrap();
    let again = read("cube.3mf", &written).unwrap();
    assert_eq!((&again.positions, &again.triangles), (&bent, &obj.triangles));
    assert!(again.notices.is_empty() && read("x", &written).unwrap().format() == ModelFormat::ThreeMf);
    let glb =
        read("a.glb", &read("plate.3mf", &plate()).unwrap().write_glb(&[Vec3::ONE; 40]).unwrap()).unwrap();
    assert_eq!(glb.counts.materials, 2);
}

fn fault(bytes: &[u8]) -> String {
    Model::read_within("a.3mf", bytes, &mut |_| None, 1 << 26).unwrap_err().to_string()
}

fn fault_of(resources: &str, build: &str) -> String {
    fault(&package(&[(ROOT, model_part(resources, build))]))
}

#[test]
fn damaged_files_are_errors_that_name_the_fault() {
    let part = "a.3mf: the file is damaged: its part '3D/3dmodel.model' ";
    let part = part.replace("3D", "/3D");
    let item = "<item objectid=\"2\"/>";
    let object = |mesh: &str| format!("<object id=\"2\">{mesh}</object>");
    for (resources, build, problem) in [
        (object(""), "<item objectid=\"3\"/>", ": it shows object 3, which does not exist"),
        (object(""), "<item objectid=\"2\" path=\"/b.model\"/>", ""),
        (
            object("<components><component objectid=\"2\"/></components>"),
            item,
            ": components of object 2 contain it, or are nested more than 64 deep",
        ),
        (
            object("<mesh><vertices><vertex x=\"1\" y=\"a\" z=\"0\"/></vertices></mesh>"),
            item,
            ": vertex 0 has y=\"a\", which is not a number in range",
        ),
        (
            object(&cube_mesh().replace("v1=\"4\"", "v1=\"99\"")),
            item,
            ": triangle 2 of object 2 refers to vertex 99, but the object has 8, counted from 0",
        ),
        (
            object(&cube_mesh().replace("v1=\"4\"", "v1=\"-1\"")),
            item,
            ": triangle 2 has v1=\"-1\", which is not a number in range",
        ),
        (object("") + &object(""), item, ": two objects have the id 2"),
        (
            object(&cube_mesh()),
            "<item objectid=\"2\" transform=\"1 0 0 0 1 0 0 0 0 1 1 1\"/>",
            ": a component or item has a transform that flattens it or is not finite",
        ),
        (
            object(&cube_mesh()),
            "<item objectid=\"2\" transform=\"1 0 0\"/>",
            ": a component or item has a transform without 12 numbers",
        ),
        (object("<mesh>"), item, "is not well-formed XML, at line 5"),
    ] {
        let found = fault_of(&resources, build);
        let expected = if problem.is_empty() {
            "a.3mf: the file is damaged: its part '/b.model' is missing".to_owned()
        } else {
            let part = if problem.starts_with(':') { part.trim_end() } else { &part };
            format!("{part}{problem}")
        };
        assert_eq!(found, expected);
    }
    assert_eq!(
        fault_of(&object(&cube_mesh().replace("y='1.000'", "y='nan'")), item),
        "a.3mf: vertex 2 has a coordinate that is not finite"
    );
    assert_eq!(
        fault_of(&object(&cube_mesh()), ""),
        "a.3mf: its build is empty: put an object on the plate and save the file again"
    );
    assert_eq!(fault_of(&object(""), item), "a.3mf: it has no vertices");
    let mut inches =
        model_part(&object(&cube_mesh()), "<item objectid=\"2\"/>").replace("millimeter", "inch");
    assert_eq!(
        read("a.3mf", &package(&[(ROOT, inches.clone())])).unwrap().notices[1],
        "its unit is the inch: coordinates are not converted"
    );
    inches = inches.replace("objectid=\"2\"", "objectid=\"2\" p:path=\"b.model\"");
    let other = model_part(&object(&cube_mesh()), "");
    assert_eq!(
        fault(&package(&[(ROOT, inches.clone()), ("b.model", other.clone())])),
        "a.3mf: the file is damaged: its part 'b.model' has the unit millimeter, but '/3D/3dmodel.model' has inch: use one unit"
    );
    let odd = other.replace("millimeter", &format!("\u{1b}[31m{}", "u".repeat(5000)));
    let found = fault(&package(&[(ROOT, inches), ("b.model", odd)]));
    assert!(found.contains("has the unit \\u{1b}[31muuu") && found.len() < 500, "{found}");
    assert_eq!(fault(&package(&[("x.model", other.clone())])), format!("{part}is missing"));
    assert_eq!(
        fault(&package(&[(ROOT, "<a/>".into()), ("x.model", other)])),
        format!("{part}is not a model: its root is 'a'")
    );
    assert_eq!(
        fault(b"solid a"),
        "a.3mf is not a 3MF: it is not a zip archive with a model part: it is damaged or has the wrong name"
    );
    let file = plate();
    for n in 4..file.len() {
        assert!(read("a.3mf", &file[..n]).is_err(), "{n}");
    }
}

/// A 3MF with the cube in `part`; its relationships name `targets`.
fn related(part: &str, text: &[u8], targets: &[&str]) -> Vec<u8> {
    const MODEL: &str = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";
    let related: Vec<String> = targets
        .iter()
        .map(|t| format!("<Relationship Id=\"a\" Target=\"/{t}\" Type=\"{MODEL}\"/>"))
        .collect();
    let relationships = format!("<Relationships>{}</Relationships>", related.concat());
    let files = [("_rels/.rels", relationships.as_bytes()), (part, text)];
    let files: Vec<_> = files.map(|(name, bytes)| (name.to_owned(), bytes.to_vec())).into();
    cagework_io::write_zip(&files).unwrap()
}

#[test]
fn model_part_is_the_one_that_the_relationships_name() {
    let text = model_part(
        &format!("<object id=\"1\" type=\"model\">{}</object>", cube_mesh()),
        "<item objectid=\"1\"/>",
    );
    let file = |targets: &[&str]| related("3D/cube.custom", text.as_bytes(), targets);
    for targets in [&["3D/cube.custom"][..], &["3D/cube.custom", "3d/CUBE.custom"]] {
        assert_eq!(read("a.3mf", &file(targets)).unwrap().positions, cube());
    }
    let two = fault(&file(&["3D/cube.custom", "3D/b.model"]));
    assert!(
        two.ends_with(
            "name two first model parts, '/3D/cube.custom' and '/3D/b.model': save the model again with one"
        ),
        "{two}"
    );
    assert!(fault(&file(&[])).contains("is not a 3MF"));
    let secret = fault(&related(ROOT, b"%3McF\0\0\0", &[ROOT]));
    let end = "its part '/3D/3dmodel.model' is encrypted: save the model without protection in the program that wrote it";
    assert!(secret.ends_with(end), "{secret}");
    let requires = |prefix: &str, space: &str| {
        let root = format!(
            "<model requiredextensions=\"p {prefix}\" xmlns:{prefix}=\"http://a.org/{space}/2015/07\" "
        );
        related(ROOT, text.replacen("<model ", &root, 1).as_bytes(), &[ROOT])
    };
    assert_eq!(read("a.3mf", &requires("m", "material")).unwrap().positions, cube());
    let unknown = fault(&requires("q", "gadgets"));
    assert!(
        unknown.contains("requires the extension 'http://a.org/gadgets/2015/07', which is not read"),
        "{unknown}"
    );
}

/// Entities are not expanded: document types are refused, and other references to entities are text.
#[test]
fn entities_are_not_expanded() {
    let bomb = "<!DOCTYPE a [<!ENTITY a \"aaaaaaaa\"><!ENTITY b \"&a;&a;&a;\">]><model/>";
    let end = "has a document type definition, which 3MF forbids";
    assert!(fault(&package(&[(ROOT, bomb.into())])).ends_with(end));
    let resources = format!("<object id=\"2\" name=\"&b;\">{}</object>", cube_mesh());
    let model = read("a.3mf", &package(&[(ROOT, model_part(&resources, "<item objectid=\"2\"/>"))])).unwrap();
    assert_eq!(model.positions, cube());
}

/// Each object shows the previous one twice: 2^40 cubes from a few kilobytes.
#[test]
fn doubling_components_are_refused_before_they_are_placed() {
    let doubled = |n: u32| {
        let object = |k: u32| {
            let one = format!("<component objectid=\"{k}\"/>");
            format!("<object id=\"{}\"><components>{one}{one}</components></object>", k + 1)
        };
        let objects: String = (1..=n).map(object).collect();
        fault_of(
            &format!("<object id=\"1\">{}</object>{objects}", cube_mesh()),
            &format!("<item objectid=\"{}\"/>", n + 1),
        )
    };
    // Object k + 1 has 2^k cubes and 2^(k + 1) - 1 objects.
    assert_eq!(
        doubled(40),
        format!(
            "a.3mf: its build shows {} objects, more than the limit of 131072: split the model",
            (1_u64 << 41) - 1
        )
    );
    assert!(doubled(64).contains("nested more than 64 deep"), "{}", doubled(64));
    assert!(doubled(16).contains("MiB of memory, more than the limit of 64 MiB"), "{}", doubled(16));
}

/// Objects without a name take the name of the object that contains them.
#[test]
fn names_are_counted_for_every_placement() {
    let (name, component) = ("n".repeat(40_000), "<component objectid=\"1\"/>".repeat(999));
    let named = format!(
        "<object id=\"1\">{}</object><object id=\"2\" name=\"{name}\"><components>{component}</components></object>",
        cube_mesh()
    );
    let refused = "a.3mf: its build shows 40000000 characters in the names of its objects, more than the limit of \
                   33554432: split the model";
    assert_eq!(fault_of(&named, "<item objectid=\"2\"/>"), refused);
}

#[test]
fn zip_bombs_are_refused_by_their_declared_and_their_real_size() {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    zip.start_file(ROOT, options).unwrap();
    for _ in 0..64 {
        zip.write_all(&[b' '; 1 << 20]).unwrap();
    }
    let mut bomb = zip.finish().unwrap().into_inner();
    assert!(bomb.len() < 1 << 18);
    let found = fault(&bomb);
    assert!(found.contains("needs about 129 MiB of memory, more than the limit of 64 MiB"), "{found}");
    // The directory says that the part has one byte.
    let entry = bomb.windows(4).rposition(|word| word == b"PK\x01\x02").unwrap();
    bomb[entry + 24..entry + 28].copy_from_slice(&[1, 0, 0, 0]);
    assert!(fault(&bomb).ends_with("cannot be unpacked"), "{}", fault(&bomb));
}

/// Small files that repeat an element, a name or a text many times. The estimate of a file's memory includes each copy.
#[test]
fn repeated_elements_names_and_copies_are_refused() {
    let object =
        |head: &str, inside: &str| format!("<object id=\"2\"{head}>{inside}{}</object>", cube_mesh());
    let items = |n: usize| "<item objectid=\"2\"/>".repeat(n);
    for (resources, build, count, limit) in [
        (object("", ""), items(131_073), "131073 objects", "131072"),
        (
            (3..131_076).map(|k| format!("<object id=\"{k}\"/>")).collect(),
            items(1),
            "131073 objects",
            "131072",
        ),
        (
            format!("<basematerials id=\"9\">{}</basematerials>", "<base/>".repeat(262_145)),
            items(1),
            "262145 colours",
            "262144",
        ),
    ] {
        assert_eq!(
            fault_of(&resources, &build),
            format!("a.3mf: its build shows {count}, more than the limit of {limit}: split the model")
        );
    }
    let named = fault_of(&object(&format!(" name=\"{}\"", "n".repeat(10_000)), ""), &items(5000));
    assert!(named.contains("shows 50000000 characters in the names of its objects"), "{named}");

    let at = |k| format!("<item objectid=\"2\" transform=\"1 0 0 0 1 0 0 0 1 {k} 0 0\"/>");
    let resources = object("", &format!("<!--{}-->", "x".repeat(1 << 20)));
    let many = package(&[(ROOT, model_part(&resources, &(0..1100).map(at).collect::<String>()))]);
    let model = read("a.3mf", &many).unwrap();
    let bent: Vec<Vec3> = model.positions.iter().map(|&p| twist(p)).collect();
    let error = model.write(ModelFormat::ThreeMf, &bent).unwrap_err().to_string();
    assert!(
        error.ends_with(
            "object 2 takes 1100 shapes, whose text is longer than the limit of 1 GiB: export an OBJ"
        ),
        "{error}"
    );
}

/// Parts are found by a hash of their name. A linear search for the part of each of the 60,000 items would take 30 s.
#[test]
fn parts_are_found_without_a_search() {
    let cube = || model_part(&format!("<object id=\"2\">{}</object>", cube_mesh()), "");
    let item = |k: usize| format!("<item objectid=\"2\" p:path=\"/3D/{}.model\"/>", k % 1000);
    let root = model_part("", &(0..60_000).map(item).collect::<String>());
    let names: Vec<String> = (0..1000).map(|k| format!("3D/{k}.model")).collect();
    let parts = names.iter().map(|name| (name.as_str(), cube()));
    let file = package(&[(ROOT, root)].into_iter().chain(parts).collect::<Vec<_>>());
    assert_eq!(read("a.3mf", &file).unwrap().positions.len(), 480_000);
}

#[test]
fn a_small_archive_may_not_unpack_to_very_much() {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    zip.start_file(ROOT, options).unwrap();
    zip.write_all(&vec![b' '; 70_000_000]).unwrap();
    let found = read("a.3mf", &zip.finish().unwrap().into_inner()).unwrap_err().to_string();
    let limit = "more than the limit of 64 MiB or 100 times its size: save it again";
    assert!(found.contains("unpack to 70000000, ") && found.ends_with(limit), "{found}");
}
