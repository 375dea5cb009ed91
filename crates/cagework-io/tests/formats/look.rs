//! Appearance of models: texture coordinates, colours and materials.

use cagework_io::{Look, LookAlpha, LookWrap, Model, TexturePlan};
use serde_json::json;

use crate::common::{Builder, F32, PNG, U8, floats, plain_cube, read, textured_square};

/// Tolerance of colours after conversion from sRGB. The expected values have four decimals.
const COLOUR_TOLERANCE: f32 = 1e-4;

fn look(builder: &Builder) -> Look {
    read("x.glb", &builder.glb()).unwrap().look()
}

fn obj(text: &str, files: &[(&str, &[u8])]) -> Look {
    let mut resolve =
        |name: &str| files.iter().find(|(n, _)| *n == name).map(|(_, bytes)| Ok(bytes.to_vec()));
    Model::read("x.obj", text.as_bytes(), &mut resolve).unwrap().look()
}

#[test]
fn texture_is_found_beside_the_file() {
    let mut b = textured_square();
    b.json["samplers"] = json!([{ "wrapS": 33_071, "wrapT": 33_648 }]);
    b.json["textures"][0]["sampler"] = json!(0);
    let bytes = b.glb();
    let model =
        Model::read("x.glb", &bytes, &mut |name| (name == "red dot.png").then(|| Ok(PNG.to_vec()))).unwrap();
    let look = model.look();
    assert_eq!((look.images.len(), look.images[0].mime.as_str()), (1, "image/png"));
    assert_eq!(look.images[0].bytes, PNG);
    let group = &look.groups[0];
    assert_eq!((group.triangles.clone(), group.image, group.base_color), (0..2, Some(0), [1.0; 4]));
    assert_eq!(group.wrap, [LookWrap::Clamp, LookWrap::Mirror]);
    let uvs: Vec<_> = look.vertices.iter().map(|v| v.uv).collect();
    assert_eq!(uvs, [[0.0, 0.0], [0.5, 0.0], [0.5, 1.0], [0.0, 0.0], [0.5, 1.0], [0.0, 1.0]]);
}

#[test]
fn missing_texture_leaves_the_colour() {
    let mut b = textured_square();
    b.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.25, 0.5, 1.0, 0.75]);
    let look = look(&b);
    assert_eq!((look.images.len(), look.groups[0].image), (0, None));
    assert_eq!(look.groups[0].base_color, [0.25, 0.5, 1.0, 0.75]);
}

#[test]
fn image_in_a_buffer_view_is_read() {
    let mut b = textured_square();
    let view = b.view(&PNG);
    b.json["images"] = json!([{ "bufferView": view, "mimeType": "image/jpeg" }]);
    let look = look(&b);
    // The media type is detected from the content, not taken from the document.
    assert_eq!((look.images[0].bytes.as_slice(), look.images[0].mime.as_str()), (&PNG[..], "image/png"));
}

/// Ten windows of one buffer, each of a different length, are images. Copies of all would need ten times the file.
#[test]
fn overlapping_images_need_no_more_memory_than_the_file() {
    let mut b = textured_square();
    let view = b.view(&[&PNG[..], &[0; 1000]].concat());
    let (mut views, mut images, mut primitives) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..10 {
        let mut window = b.json["bufferViews"][view].clone();
        window["byteLength"] = json!(1000 + k);
        views.push(window);
        images.push(json!({ "bufferView": view + 1 + k }));
        let mut primitive = b.json["meshes"][0]["primitives"][0].clone();
        primitive["material"] = json!(k);
        primitives.push(primitive);
    }
    b.json["bufferViews"].as_array_mut().unwrap().extend(views);
    let material = |k| json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": k } } });
    b.json["materials"] = (0..10).map(material).collect();
    b.json["textures"] = (0..10).map(|k| json!({ "source": k })).collect();
    b.json["images"] = json!(images);
    b.json["meshes"][0]["primitives"] = json!(primitives);
    let found = look(&b);
    assert_eq!(found.images.len(), 10);
    assert!(found.images.iter().map(|image| image.bytes.len()).sum::<usize>() <= b.glb().len());
    let plan = TexturePlan::new(&[&found], 0);
    assert!(plan.notices.iter().any(|notice| notice.contains("overlap")), "{:?}", plan.notices);
}

#[test]
fn seams_share_a_vertex_and_hard_edges_do_not() {
    // Vertices 0 and 3, and 2 and 4, are split at the seam with equal normals.
    let sources = |look: &Look| look.vertices.iter().map(|v| v.source).collect::<Vec<_>>();
    assert_eq!(sources(&look(&textured_square())), [0, 1, 2, 0, 2, 5]);
    let mut b = textured_square();
    let half = [[0., 0., 1.], [0., 0., 1.], [0., 0., 1.], [1., 0., 0.], [1., 0., 0.], [1., 0., 0.]];
    let normals = b.vec3(&half);
    b.primitive(0)["attributes"]["NORMAL"] = json!(normals);
    assert_eq!(sources(&look(&b)), [0, 1, 2, 3, 4, 5]);
}

/// KHR_texture_transform applies the scale first, then the rotation, then the offset.
#[test]
fn texture_transform_is_applied() {
    let mut b = textured_square();
    b.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] = json!({
        "KHR_texture_transform": { "offset": [0.1, 0.2], "rotation": std::f32::consts::FRAC_PI_2, "scale": [2.0, 4.0] }
    });
    let look = look(&b);
    // (0.5, 1) scales to (1, 4), rotates by 90 degrees to (4, -1) and moves to (4.1, -0.8).
    let [u, v] = look.vertices[2].uv;
    assert!((u - 4.1).abs() < 1e-5 && (v + 0.8).abs() < 1e-5, "{u} {v}");
}

#[test]
fn vertex_colours_are_read_in_every_encoding() {
    let mut b = plain_cube();
    let bytes: Vec<u8> = (0..8).flat_map(|v| [255, 0, 17 * v, 128]).collect();
    let colors = b.accessor(&bytes, U8, 8, "VEC4");
    b.json["accessors"][colors]["normalized"] = json!(true);
    b.primitive(0)["attributes"]["COLOR_0"] = json!(colors);
    let [r, g, blue, a] = look(&b).vertices[3].color;
    assert_eq!((r, g, blue), (1.0, 0.0, 51.0 / 255.0));
    assert!((a - 128.0 / 255.0).abs() < 1e-6);
    let mut b = plain_cube();
    let colors = b.accessor(&floats(&[0.25, 0.5, 2.0].repeat(8)), F32, 8, "VEC3");
    b.primitive(0)["attributes"]["COLOR_0"] = json!(colors);
    assert_eq!(look(&b).vertices[0].color, [0.25, 0.5, 1.0, 1.0]);
}

#[test]
fn alpha_mode_and_double_sided_are_read_and_no_material_means_no_group() {
    assert!(look(&plain_cube()).groups.is_empty());
    for (material, alpha) in [
        (json!({ "alphaMode": "MASK" }), LookAlpha::Mask { cutoff: 0.5 }),
        (json!({ "alphaMode": "MASK", "alphaCutoff": 0.25 }), LookAlpha::Mask { cutoff: 0.25 }),
        (json!({ "alphaMode": "BLEND" }), LookAlpha::Blend),
        (json!({ "alphaMode": "nonsense" }), LookAlpha::Opaque),
    ] {
        let mut b = plain_cube();
        b.json["materials"] = json!([material]);
        b.json["materials"][0]["doubleSided"] = json!(true);
        b.primitive(0)["material"] = json!(0);
        let group = &look(&b).groups[0];
        assert_eq!((group.alpha, group.double_sided), (alpha, true));
    }
}

/// Errors in materials never reject a file.
#[test]
fn invalid_materials_are_ignored() {
    let mut b = textured_square();
    b.primitive(0)["attributes"]["COLOR_0"] = json!(9_999);
    b.primitive(0)["material"] = json!(7);
    assert!(look(&b).groups.is_empty());
    let mut b = textured_square();
    b.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = json!(50);
    assert_eq!(look(&b).groups[0].image, None);
    let mut b = textured_square();
    b.json["images"] = json!([{ "bufferView": 500, "mimeType": "image/png" }]);
    assert_eq!(look(&b).groups[0].image, None);
}

const SQUARE: &str = "mtllib paint box.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
    usemtl blue\nf 1/1 2/2 3/3\nusemtl plain\nf 1/2 3/3 4/4\nusemtl blue\nf 4/4 1/1 3/3\n";

#[test]
fn obj_gets_the_colours_of_its_materials() {
    let mtl = b"# by hand\nnewmtl blue\nKd 0.5 0 1\nd 0.5\nnewmtl unused\nKd 1 1 1\n";
    let look = obj(SQUARE, &[("paint box.mtl", mtl)]);
    // Triangles are grouped by material. The library lacks `plain`, so its triangle has no group.
    assert_eq!((look.triangles.len(), look.groups.len()), (3, 1));
    let group = &look.groups[0];
    assert_eq!((group.triangles.clone(), group.alpha), (0..2, LookAlpha::Blend));
    // sRGB 0.5 is linear 0.2140 (IEC 61966-2-1).
    let expected = [0.2140, 0.0, 1.0, 0.5];
    assert!(group.base_color.iter().zip(expected).all(|(a, b)| (a - b).abs() < COLOUR_TOLERANCE));
    // The first vertex has two texture coordinates; v points down.
    let first: Vec<_> = look.vertices.iter().filter(|v| v.source == 0).map(|v| v.uv).collect();
    assert_eq!(first, [[0.0, 1.0], [1.0, 1.0]]);
}

#[test]
fn obj_texture_is_found_and_replaces_a_grey() {
    let mtl = b"newmtl blue\nKd 0 0 0\nmap_Kd maps\\dot.png\n";
    let look = obj(SQUARE, &[("paint box.mtl", mtl), ("maps/dot.png", &PNG)]);
    assert_eq!((look.groups[0].image, look.groups[0].base_color), (Some(0), [1.0; 4]));
    assert_eq!(look.images[0].bytes, PNG);
    let tinted =
        obj(SQUARE, &[("paint box.mtl", b"newmtl blue\nKd 0 0 1\nmap_Kd dot.png\n"), ("dot.png", &PNG)]);
    assert_eq!(
        tinted.groups[0].base_color,
        [0.0, 0.0, 1.0, 1.0],
        "a colour that is not grey is kept as a factor"
    );
    assert!(obj(SQUARE, &[]).groups.is_empty(), "without the file there are no materials");
}

#[test]
fn obj_colours_after_coordinates_are_vertex_colours() {
    let look = obj("v 0 0 0 1 0 0.5\nv 1 0 0 1 1 1\nv 0 1 0 0 0 0\nf 1 2 3\n", &[]);
    let color = look.vertices[0].color;
    assert!(color.iter().zip([1.0, 0.0, 0.2140, 1.0]).all(|(a, b)| (a - b).abs() < COLOUR_TOLERANCE));
    assert_eq!(look.groups.len(), 1);
    let with_alpha = obj("v 0 0 0 1 0 0.5 1\nv 1 0 0 1 1 1 1\nv 0 1 0 0 0 0 1\nf 1 2 3\n", &[]);
    assert_eq!(with_alpha, look);
    // A fourth number alone is a weight.
    assert!(obj("v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nf 1 2 3\n", &[]).groups.is_empty());
}

/// A cube of eight shared vertices. `normals`: index of the normal at a face and vertex, 0 for none.
fn shared_cube(normals: impl Fn(usize, usize) -> usize) -> Look {
    smoothed_cube(normals, |_| "")
}

/// Like [`shared_cube`], with the lines `before(f)` in front of face `f`.
fn smoothed_cube(normals: impl Fn(usize, usize) -> usize, before: impl Fn(usize) -> &'static str) -> Look {
    let mut text = String::new();
    for k in 0..8 {
        let p = [k & 1, k >> 1 & 1, k >> 2].map(|bit| 2 * bit - 1);
        text += &format!("v {} {} {}\nvn {} {} {}\n", p[0], p[1], p[2], p[0], p[1], p[2]);
    }
    // Normals 1 to 8 point to the corners; 9 to 14 are face normals.
    let faces = [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]];
    for normal in ["0 0 -1", "0 0 1", "0 -1 0", "0 1 0", "-1 0 0", "1 0 0"] {
        text += &format!("vn {normal}\n");
    }
    for (f, face) in faces.iter().enumerate() {
        let corners = face.map(|v| match normals(f, v) {
            0 => format!(" {v}"),
            n => format!(" {v}//{n}"),
        });
        text += &format!("{}f{}\n", before(f), corners.concat());
    }
    obj(&text, &[])
}

/// Sources of the corners of a face's two triangles.
fn sources(look: &Look, face: usize) -> Vec<u32> {
    look.triangles[2 * face..2 * face + 2]
        .iter()
        .flatten()
        .map(|&c| look.vertices[c as usize].source)
        .collect()
}

/// In an OBJ, faces share vertices, and only `vn` indices mark hard edges.
#[test]
fn hard_edges_of_an_obj_split_its_vertices() {
    let hard = shared_cube(|face, _| 9 + face);
    // Three faces meet at each of eight vertices: one uses the vertex, two use a duplicate each.
    assert_eq!(hard.copies.len(), 16);
    for v in 0..8 {
        assert_eq!(hard.copies.iter().filter(|&&c| c == v).count(), 2, "vertex {v}");
    }
    let mut seen = std::collections::HashSet::new();
    for face in 0..6 {
        let mut own = sources(&hard, face);
        own.sort_unstable();
        own.dedup();
        assert_eq!(own.len(), 4);
        assert!(own.into_iter().all(|s| s < 24 && seen.insert(s)), "face {face} shares none with another");
    }
    for (number, vertex) in hard.vertices.iter().enumerate() {
        assert!((vertex.source as usize) < 8 + hard.copies.len(), "corner {number}");
    }
}

#[test]
fn smooth_obj_keeps_its_vertices() {
    let smooth = shared_cube(|_, v| v);
    let bare = shared_cube(|_, _| 0);
    assert_eq!((smooth.copies.len(), bare.copies.len()), (0, 0));
    assert_eq!(smooth, bare);
    // Face 3 has a hard border: its four vertices are duplicated.
    let lid = shared_cube(|face, v| if face == 3 { 12 } else { v });
    assert_eq!(lid.copies.len(), 4);
    let lone = shared_cube(|face, v| if face == 3 { 0 } else { v });
    assert!(lone.copies.is_empty(), "corners without a normal keep their vertex");
}

/// Without normals, `s off` makes faces flat.
#[test]
fn faces_without_smoothing_are_flat() {
    let hard = shared_cube(|face, _| 9 + face);
    for off in ["s off\n", "s 0\n"] {
        assert_eq!(smoothed_cube(|_, _| 0, |face| if face == 0 { off } else { "" }), hard, "{off}");
    }
    // Faces before the first `s` line use the default, off.
    assert_eq!(smoothed_cube(|_, _| 0, |face| if face == 5 { "s off\n" } else { "" }), hard);
}

#[test]
fn smoothing_groups_share_no_normal() {
    let smooth = shared_cube(|_, _| 0);
    assert_eq!(smoothed_cube(|_, _| 0, |_| "s 1\n"), smooth);
    // Face 3 has its own smoothing group: its four vertices are duplicated.
    let lid = smoothed_cube(|_, _| 0, |face| if face == 3 { "s 2\n" } else { "s 1\n" });
    let mut twice = lid.copies.clone();
    twice.sort_unstable();
    assert_eq!(twice, [2, 3, 6, 7], "the corners of face 3");
    // Faces with equal group numbers belong to one group, although the `s` lines alternate. Normals override groups.
    let again = smoothed_cube(|_, _| 0, |face| ["s 1\n", "s 2\n"][face % 2]);
    assert_eq!(again.copies.len(), 6, "all faces around two opposite corners belong to one group");
    assert_eq!(smoothed_cube(|_, v| v, |_| "s off\n"), smooth);
}

#[test]
fn options_before_the_name_of_a_texture_are_skipped() {
    for (options, is_placed) in [
        ("", false),
        ("-s 1 1 1 -o 0 0 0 ", false),
        ("-clamp on -bm 0.5 -blendu off -mm 0 1 -imfchan r ", false),
        ("-s 2 2 ", true),
        ("-o 0.5 -texres 512 ", true),
    ] {
        let mtl = format!("newmtl blue\nmap_Kd {options}my dot.png\n");
        let files = [("paint box.mtl", mtl.as_bytes()), ("my dot.png", &PNG)];
        let mut resolve =
            |name: &str| files.iter().find(|(n, _)| *n == name).map(|(_, bytes)| Ok(bytes.to_vec()));
        let model = Model::read("x.obj", SQUARE.as_bytes(), &mut resolve).unwrap();
        assert_eq!(model.look().groups[0].image, Some(0), "{options}");
        assert_eq!(model.notices.len(), usize::from(is_placed), "{options}: {:?}", model.notices);
    }
}

/// The name of a material file may have blanks, and a line may name several files.
#[test]
fn one_line_names_several_material_files() {
    let (first, second) = (b"newmtl plain\nKd 1 0 0\n", b"newmtl blue\nKd 0 0 1\n");
    let text = SQUARE.replace("paint box.mtl", "a.mtl b.mtl");
    let look = obj(&text, &[("a.mtl", first), ("b.mtl", second)]);
    let colors: Vec<_> = look.groups.iter().map(|group| group.base_color).collect();
    assert_eq!(colors, [[0.0, 0.0, 1.0, 1.0], [1.0, 0.0, 0.0, 1.0]]);
}

/// Some exporters write the opacity as both `d` and `Tr`.
#[test]
fn opacity_overrides_transparency() {
    for (lines, alpha) in [("d 1\nTr 1", 1.0), ("Tr 1\nd 1", 1.0), ("Tr 0.25", 0.75), ("d 0.5\nTr 0.5", 0.5)]
    {
        let mtl = format!("newmtl blue\nKd 1 1 1\n{lines}\n");
        assert_eq!(
            obj(SQUARE, &[("paint box.mtl", mtl.as_bytes())]).groups[0].base_color[3],
            alpha,
            "{lines}"
        );
    }
}
