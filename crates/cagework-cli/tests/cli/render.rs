use predicates::prelude::PredicateBooleanExt as _;
use predicates::str::contains;

use crate::splats::cloud;
use crate::support::{CORNERS, Sandbox, box_obj};

/// Width and height that the IHDR chunk of a PNG contains (PNG specification, 11.2.2).
fn png_size(bytes: &[u8]) -> [u32; 2] {
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
    let word = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
    [word(16), word(20)]
}

#[test]
fn every_style_draws_a_different_picture() {
    let sandbox = Sandbox::with_sphere_in_box();
    // `clay` is omitted, because it equals `solid` for a model without materials.
    let kinds = ["solid", "edges", "wireframe", "weights", "error", "cells", "slice"];
    let pictures = kinds.map(|show| {
        let drawn = sandbox.json(&format!(
            "render mesh.obj --cage cage.obj -g 12 --show {show} --column 3 --size 96x64 -o p.png --json"
        ));
        assert_eq!(drawn["size"], serde_json::json!([96, 64]));
        assert!(drawn["adapter"].as_str().is_some_and(|name| !name.is_empty()));
        let bytes = sandbox.read("p.png");
        assert_eq!(png_size(&bytes), [96, 64]);
        bytes
    });
    for (k, a) in pictures.iter().enumerate() {
        for (l, b) in pictures.iter().enumerate().take(k) {
            assert!(a != b, "{} and {} are the same picture", kinds[k], kinds[l]);
        }
    }
}

#[test]
fn saved_weights_draw_the_same_picture_as_a_bind() {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.write("pose.obj", box_obj(&CORNERS.map(|[x, y, z]| [1.5 * x, y, z])));
    sandbox.run("bind mesh.obj --cage cage.obj -g 12 --weights w.npz").success();
    let base = "render mesh.obj --cage cage.obj --size 64x64 --view front --theme light --orthographic -o";
    sandbox.run(&format!("{base} rest.png")).success().stdout(contains("wrote rest.png"));
    sandbox.run(&format!("{base} a.png --pose pose.obj --weights w.npz")).success();
    sandbox.run(&format!("{base} b.png --pose pose.obj -g 12")).success();
    assert_ne!(sandbox.read("rest.png"), sandbox.read("a.png"));
    assert_eq!(sandbox.read("a.png"), sandbox.read("b.png"), "weights from a file and from a bind");
}

/// The cloud is a sphere, and splats that show points stretch with the space around them.
#[test]
fn a_point_cloud_is_drawn_and_follows_its_cage() {
    /// Tolerance of the drawn width divided by the height, which is at least 80 pixels: two pixels on each side.
    const PIXELS: f64 = 0.05;
    let sandbox = Sandbox::new();
    sandbox.write("cloud.ply", cloud());
    sandbox.write("cage.obj", box_obj(&CORNERS));
    sandbox.write("wide.obj", box_obj(&CORNERS.map(|[x, y, z]| [1.5 * x, y, z])));
    let base = "render cloud.ply --size 300x200 --view front --orthographic --no-floor --no-cage -o p.png";
    for (pose, expected) in [("", 1.0), (" --pose wide.obj", 1.5)] {
        sandbox.run(&format!("{base} --cage cage.obj{pose}")).success();
        let picture = image::load_from_memory(&sandbox.read("p.png")).unwrap().into_rgb8();
        // The background is grey, unlike the points, whose colours depend on their positions.
        let is_colored =
            |pixel: &image::Rgb<u8>| pixel.0.iter().max().unwrap() - pixel.0.iter().min().unwrap() > 40;
        let drawn: Vec<(u32, u32)> =
            picture.enumerate_pixels().filter(|p| is_colored(p.2)).map(|p| (p.0, p.1)).collect();
        let extent = |of: fn(&(u32, u32)) -> u32| {
            f64::from(drawn.iter().map(of).max().unwrap() - drawn.iter().map(of).min().unwrap() + 1)
        };
        let (width, height) = (extent(|p| p.0), extent(|p| p.1));
        assert!(height > 80.0 && (width / height - expected).abs() < PIXELS, "{pose}: {width} x {height}");
    }
    sandbox.run(base).success();
    let refused = format!("{base} --cage cage.obj --show weights");
    sandbox.run(&refused).failure().stderr(contains("splats and points are drawn as they are"));
}

#[test]
fn bind_on_the_gpu_reports_the_adapter() {
    let sandbox = Sandbox::with_sphere_in_box();
    let cpu = sandbox.json("bind mesh.obj --cage cage.obj -g 16 --json");
    let gpu = sandbox.json("bind mesh.obj --cage cage.obj -g 16 --backend gpu --json");
    assert_eq!([&cpu["backend"], &gpu["backend"]], ["cpu", "gpu"]);
    assert!(cpu.get("adapter").is_none());
    let adapter = gpu["adapter"].as_str().unwrap();
    sandbox.run("bind mesh.obj --cage cage.obj -g 16 --backend gpu").success().stdout(contains(adapter));
    assert_eq!(gpu["cells"], cpu["cells"]);
}

#[test]
fn invalid_arguments_are_rejected_before_the_work() {
    let sandbox = Sandbox::with_sphere_in_box();
    for (args, message) in [
        ("render mesh.obj -o p.jpg", "must end in .png"),
        ("render mesh.obj --size 10 -o p.png", "800x600"),
        ("render mesh.obj --size 9000x10 -o p.png", "8192"),
        ("render mesh.obj --view sideways -o p.png", "YAW,PITCH"),
        ("render mesh.obj --show weights -o p.png", "--cage"),
        ("render mesh.obj --turntable 1 -o p.png", "2..=36"),
        ("render mesh.obj --clip Walk --cage cage.obj -o p.png", "cannot be used with"),
    ] {
        sandbox.run(args).code(2).stderr(contains(message));
    }
    let args = "render mesh.obj --cage cage.obj --show weights --column 8 -o p.png";
    sandbox.run(args).code(1).stderr(contains("the weights have 8 columns"));
    for (args, message) in [
        (
            "render mesh.obj --turntable 36 -o p.png",
            "36 pictures of 480 pixels are 17352 pixels wide, above the limit of 16384",
        ),
        ("render mesh.obj --at 0.1,0.2 -o p.png", "--at has 2 numbers"),
        ("render mesh.obj --clip Walk -o p.png", "there is no clip 'Walk'; the model has none"),
    ] {
        sandbox.run(args).code(1).stderr(contains(message));
    }
}

/// A software adapter would take minutes for 20,000 triangles that each fill the picture, so the command rejects them.
#[test]
fn too_many_overlapping_triangles_are_rejected() {
    let sandbox = Sandbox::new();
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (n, code) in [(100, 0), (20_000, 1)] {
        sandbox.write("mesh.obj", corners.to_owned() + &"f 1 2 3\n".repeat(n));
        let drawn = sandbox.run("render mesh.obj --view front --size 640x480 -o p.png").code(code);
        if code == 1 {
            drawn.stderr(contains("20000 triangles cover").and(contains("a smaller picture")));
        }
    }
}

/// A C-shaped solid as OBJ: two arms along x with a gap between them. `room`: distance by which the surface is offset
/// outwards; `lift`: motion of the upper arm's tip in y.
fn clamp_obj(room: f64, lift: f64) -> String {
    // x and y of each corner, its outward direction, and its share of `lift`.
    const OUTLINE: [([f64; 2], [f64; 2], f64); 8] = [
        ([0.0, 0.0], [-1.0, -1.0], 0.0),
        ([3.0, 0.0], [1.0, -1.0], 0.0),
        ([3.0, 1.0], [1.0, 1.0], 0.0),
        ([1.0, 1.0], [1.0, 1.0], 0.0),
        ([1.0, 1.6], [1.0, -1.0], 0.0),
        ([3.0, 1.6], [1.0, -1.0], 1.0),
        ([3.0, 2.6], [1.0, 1.0], 1.0),
        ([0.0, 2.6], [-1.0, 1.0], 0.0),
    ];
    let mut text = String::new();
    for z in [-0.5 - room, 0.5 + room] {
        for ([x, y], [dx, dy], share) in OUTLINE {
            text += &format!("v {} {} {z}\n", x + room * dx, y + room * dy + lift * share);
        }
    }
    // Write both caps as three convex quads each, then the sides.
    for [a, b, c, d] in [[1, 2, 3, 4], [1, 4, 5, 8], [5, 6, 7, 8]] {
        text += &format!("f {d} {c} {b} {a}\nf {} {} {} {}\n", a + 8, b + 8, c + 8, d + 8);
    }
    for k in 0..8 {
        let (a, b) = (k + 1, (k + 1) % 8 + 1);
        text += &format!("f {a} {b} {} {}\n", b + 8, a + 8);
    }
    text
}

/// Maximum number of pixels that differ between equal shapes. They differ because `f32` rounding moves antialiased
/// edges.
const MAX_ROUND_OFF_PIXELS: usize = 10;

#[test]
fn compare_draws_both_coordinates_side_by_side() {
    let sandbox = Sandbox::new();
    sandbox.write("mesh.obj", clamp_obj(0.0, 0.0));
    sandbox.write("cage.obj", clamp_obj(0.2, 0.0));
    sandbox.write("pose.obj", clamp_obj(0.2, 1.5));
    let args = "render mesh.obj --cage cage.obj -g 24 --no-cage --no-floor --view front --size 202x120";
    let picture = |more: &str| {
        let done = sandbox.json(&format!("{args} {more} -o p.png --json"));
        let picture = image::load_from_memory(&sandbox.read("p.png")).unwrap().into_rgb8();
        assert_eq!(picture.dimensions(), (202, 120));
        (picture, done)
    };
    // Number of pixels that differ between the two halves, which are 100 columns wide with two columns between them.
    let differing = |picture: &image::RgbImage| {
        let differs = |x, y| {
            let pair = [picture.get_pixel(x, y), picture.get_pixel(x + 102, y)].map(|p| p.0);
            pair[0].iter().zip(pair[1]).any(|(a, b)| a.abs_diff(b) > 8)
        };
        (0..100).flat_map(|x| (0..120).map(move |y| (x, y))).filter(|&(x, y)| differs(x, y)).count()
    };
    // Both kinds of coordinates reproduce the rest shape.
    let (rest, done) = picture("--compare");
    assert_eq!(done["compared"], serde_json::json!(["harmonic coordinates", "mean value coordinates"]));
    assert!(differing(&rest) <= MAX_ROUND_OFF_PIXELS, "{} pixels differ at rest", differing(&rest));
    // Only mean value coordinates move the lower arm, because they are not zero across the gap.
    let (posed, _) = picture("--compare --pose pose.obj");
    assert!(differing(&posed) > 10 * MAX_ROUND_OFF_PIXELS, "{} pixels differ", differing(&posed));
    let (rest, done) = picture("--compare green");
    assert_eq!(done["compared"], serde_json::json!(["harmonic coordinates", "Green coordinates"]));
    assert!(differing(&rest) <= MAX_ROUND_OFF_PIXELS, "{} pixels differ at rest", differing(&rest));
    let (green, _) = picture("--compare green --pose pose.obj");
    assert!(differing(&green) > 10 * MAX_ROUND_OFF_PIXELS && green != posed);
    // Only the harmonic coordinates on the left use the inner control.
    sandbox.write("inner.obj", "v 0.5 1.3 0\np 1\n");
    for kind in ["mean-value", "green", "plain"] {
        let (rest, _) = picture(&format!("--compare {kind} --controls inner.obj --radius 0.2"));
        assert!(differing(&rest) <= MAX_ROUND_OFF_PIXELS, "{kind}: {} pixels differ", differing(&rest));
    }
    let (alone, done) = picture("--pose pose.obj");
    assert!(done.get("compared").is_none());
    assert_ne!(alone, posed);
    sandbox.run(&format!("{args} --compare -o p.png")).success().stdout(contains("right: mean value"));
    sandbox.run("render mesh.obj --compare -o p.png").code(2).stderr(contains("--cage"));
    for (more, message) in [("--show cells", "slice"), ("--size 3x3", "4 pixels")] {
        let args = format!("render mesh.obj --cage cage.obj --compare {more} -o p.png");
        sandbox.run(&args).code(1).stderr(contains(message));
    }
}

/// For each of the `n` parts of a strip, the pixel columns in which something is drawn: a pixel differs from the
/// background, whose colour is that of the upper left corner.
fn drawn_columns(picture: &image::RgbImage, part: u32, n: u32) -> Vec<Vec<u32>> {
    let differs = |x: u32| {
        (0..picture.height()).any(|y| {
            picture.get_pixel(x, y).0.iter().zip(picture.get_pixel(1, 1).0).any(|(a, b)| a.abs_diff(b) > 40)
        })
    };
    (0..n).map(|k| (0..part).filter(|x| differs(k * (part + 2) + x)).collect()).collect()
}

#[test]
fn clips_and_turns_are_drawn_side_by_side() {
    // A cube that a clip moves by three units in x, with a WebP texture of one blue pixel.
    let sandbox = Sandbox::new();
    sandbox.write("cube.gltf", moving_cube().to_string());
    let plain = "--size 60x60 --view front --orthographic --no-floor --theme light -o p.png";
    let strip = |args: &str, n: u32| {
        let drawn = sandbox.json(&format!("render cube.gltf {args} {plain} --json"));
        assert_eq!(drawn["size"], serde_json::json!([62 * n - 2, 60]));
        assert_eq!(drawn["notices"], serde_json::json!([]));
        image::load_from_memory(&sandbox.read("p.png")).unwrap().into_rgb8()
    };
    let picture = strip("--clip slide --at 0,0.5,1", 3);
    assert!(strip("--clip slide --at 0 --at 0.5 --at 1", 3) == picture, "a repeated --at is a list as well");
    let columns = drawn_columns(&picture, 60, 3);
    let middles: Vec<f32> = columns.iter().map(|all| 0.5 * (all[0] + all[all.len() - 1]) as f32).collect();
    // The cube moves by two equal steps, in total by three times its own width.
    let width = columns[0].len() as f32;
    assert!((middles[1] - middles[0] - 1.5 * width).abs() <= 2.0, "{middles:?} {width}");
    assert!((middles[2] - middles[1] - 1.5 * width).abs() <= 2.0, "{middles:?} {width}");
    let [r, g, b] = picture.get_pixel(middles[0] as u32, 30).0;
    assert!(b > 2 * r.max(g), "the texture is blue: {r} {g} {b}");
    // From the front and from the side the cube has the same width; at 45 degrees it is wider by the square root of 2.
    let columns = drawn_columns(&strip("--turntable 8", 8), 60, 8);
    let widths: Vec<f32> = columns.iter().map(|all| all.len() as f32).collect();
    for k in 0..8 {
        let expected = if k % 2 == 0 { widths[0] } else { 2.0_f32.sqrt() * widths[0] };
        assert!((widths[k] - expected).abs() <= 2.0, "{widths:?}");
    }
    sandbox
        .run("render cube.gltf --clip slide --at 1.5 -o p.png")
        .code(1)
        .stderr(contains("--at: 1.5 s is outside of the clip 'slide', which lasts 1 s"));
}

/// A glTF document of a cube with texture coordinates, a clip, and a texture that Pillow 12 encoded as WebP.
fn moving_cube() -> serde_json::Value {
    use serde_json::json;
    const BLUE: &[u8] = b"RIFF\x1c\x00\x00\x00WEBPVP8L\x0f\x00\x00\x00/\x00\x00\x00\x00\x07\x10\xd1\xff\xfe\x07\x22\xa2\xff\x01\x00";
    let mut bytes: Vec<u8> = Vec::new();
    for [x, y, z] in CORNERS {
        bytes.extend([0.5 * x as f32, 0.5 * y as f32, 0.5 * z as f32].into_iter().flat_map(f32::to_le_bytes));
    }
    bytes.extend([0.5_f32; 16].into_iter().flat_map(f32::to_le_bytes));
    for quad in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
        bytes.extend([0, 1, 2, 0, 2, 3].map(|k: usize| quad[k]));
    }
    bytes.extend([0.0_f32, 1.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0].into_iter().flat_map(f32::to_le_bytes));
    let image_at = bytes.len();
    bytes.extend_from_slice(BLUE);
    let view =
        |offset: usize, length: usize| json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
    let accessor = |view: usize, component: u32, count: usize, kind: &str| json!({ "bufferView": view, "componentType": component, "count": count, "type": kind });
    let mut times = accessor(3, 5126, 2, "SCALAR");
    (times["min"], times["max"]) = (json!([0.0]), json!([1.0]));
    let mut positions = accessor(0, 5126, 8, "VEC3");
    (positions["min"], positions["max"]) = (json!([-0.5, -0.5, -0.5]), json!([0.5, 0.5, 0.5]));
    json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["EXT_texture_webp"],
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "indices": 2, "material": 0 }] }],
        "materials": [{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }],
        "textures": [{ "extensions": { "EXT_texture_webp": { "source": 0 } } }],
        "images": [{ "bufferView": 5, "mimeType": "image/webp" }],
        "animations": [{
            "name": "slide",
            "samplers": [{ "input": 3, "output": 4 }],
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }],
        }],
        "accessors": [
            positions, accessor(1, 5126, 8, "VEC2"), accessor(2, 5121, 36, "SCALAR"), times, accessor(4, 5126, 2, "VEC3"),
        ],
        "bufferViews": [
            view(0, 96), view(96, 64), view(160, 36), view(196, 8), view(204, 24), view(image_at, BLUE.len()),
        ],
        "buffers": [{ "byteLength": bytes.len(), "uri": data_uri(&bytes) }],
    })
}

/// Bytes as a `data:` URI, percent-encoded.
fn data_uri(bytes: &[u8]) -> String {
    let encoded: String = bytes.iter().map(|b| format!("%{b:02x}")).collect();
    format!("data:application/octet-stream,{encoded}")
}
