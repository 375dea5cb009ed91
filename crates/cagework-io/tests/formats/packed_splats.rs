//! Captures in the compressed formats of PlayCanvas: compressed PLY and SOG.

use cagework_core::splats::Splats;
use cagework_io::{Model, ModelFormat, UpAxis, read_project, write_project, write_zip};
use glam::{Quat, Vec3};
use image_webp::{ColorType, WebPEncoder};
use serde_json::{Value, json};

const SH_0: f32 = 0.282_094_8;
/// Files that splat-transform 2.7.1 wrote from [`source`] stored as a PLY: `splat-transform helix.ply
/// helix.compressed.ply`, and `helix.sog`, whose entries were compressed by deflate afterwards.
const COMPRESSED_PLY: &[u8] = include_bytes!("../splats/helix.compressed.ply");
const SOG: &[u8] = include_bytes!("../splats/helix.sog");

fn read(name: &str, bytes: &[u8]) -> Result<Model, String> {
    Model::read_within(name, bytes, &mut |_| None, 1 << 28).map_err(|e| e.to_string())
}

/// The splats of `helix-4.spz`, in the axes of a PLY.
fn source() -> Splats {
    let mut source = Splats { degree: 1, ..Splats::default() };
    for k in 0..240 {
        let t = k as f32 / 10.0;
        source.positions.push(Vec3::new(t.cos(), k as f32 / 120.0 - 1.0, t.sin()));
        source.scales.push(Vec3::new(-4.0, -3.5, (k % 8) as f32 / 8.0 - 3.0).map(f32::exp));
        source.rotations.push(Quat::from_xyzw(0.0, (t / 4.0).sin(), 0.0, (t / 4.0).cos()));
        source.opacities.push(1.0 / (1.0 + (-2.0_f32).exp()));
        source.colors.push(0.5 + Vec3::new((t / 2.0).cos(), 0.5, -0.5) * SH_0);
        let wave = |c: usize| 0.25 * (t + c as f32).sin();
        source.harmonics.extend((0..3).map(|k| Vec3::new(wave(k), wave(3 + k), wave(6 + k))));
    }
    source
}

/// Largest differences between splats and those of [`source`] at the nearest place, since splat-transform sorts them:
/// positions, logarithms of scales, rotations in radians, colours, opacities, harmonics.
fn differences(found: &Splats) -> [f32; 6] {
    let source = source();
    assert_eq!((found.len(), found.degree), (source.len(), source.degree));
    let mut seen = vec![false; source.len()];
    let mut largest = [0.0_f32; 6];
    for s in 0..found.len() {
        let off = |k: &usize| found.positions[s].distance(source.positions[*k]);
        let k = (0..source.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
        assert!(!std::mem::replace(&mut seen[k], true), "splat {k} is read once");
        let harmonics = found.harmonics_of(s).iter().zip(source.harmonics_of(k));
        let differences = [
            off(&k),
            (found.scales[s] / source.scales[k]).map(f32::ln).abs().max_element(),
            found.rotations[s].angle_between(source.rotations[k]),
            (found.colors[s] - source.colors[k]).abs().max_element(),
            (found.opacities[s] - source.opacities[k]).abs(),
            harmonics.map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f32::max),
        ];
        largest = std::array::from_fn(|k| largest[k].max(differences[k]));
    }
    largest
}

fn assert_within(found: [f32; 6], limits: [f32; 6]) {
    let is_within = found.iter().zip(limits).all(|(found, limit)| *found <= limit);
    assert!(is_within, "{found:?}, limits {limits:?}");
}

/// Steps: 2 / 2047 for x and z and 2 / 1023 for y, sqrt(2) / 1023 for three components of a rotation, 1/255 of the range
/// for opacities and colours, 8/256 for harmonics. Errors are up to half a step.
#[test]
fn a_compressed_ply_of_another_program_has_the_numbers_of_its_source() {
    let model = read("a.ply", COMPRESSED_PLY).unwrap();
    assert_eq!((model.format(), model.notices.len()), (ModelFormat::Ply, 0));
    assert_within(differences(model.splats().unwrap()), [0.0013, 0.001, 0.003, 0.003, 0.002, 0.016]);
    assert_eq!(model.write(ModelFormat::Ply, &model.positions).unwrap(), COMPRESSED_PLY, "unchanged");
    // An export of changed splats is a new 3DGS file.
    let mut moved = model.splats().unwrap().clone();
    moved.positions[7].x += 0.25;
    let again = read("b.ply", &model.write_splats(ModelFormat::Ply, &moved).unwrap()).unwrap();
    let after = again.splats().unwrap();
    assert_eq!((&after.positions, &after.harmonics), (&moved.positions, &moved.harmonics));
    let off = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
    assert!(off(&after.colors, &moved.colors) < 1e-6 && off(&after.scales, &moved.scales) < 1e-6);
}

/// 16 bits between logarithms of positions, eight bits for opacities and for three components of a rotation (steps of
/// 1 / 255 and sqrt(2) / 255), and tables of 256 clustered numbers for the others. splat-transform rounds down, so errors
/// are up to a step. An error d in each of y and w turns by up to 4 d.
#[test]
fn a_sog_of_another_program_has_the_numbers_of_its_source() {
    let model = read("a.sog", SOG).unwrap();
    assert_eq!((model.format(), model.notices.len()), (ModelFormat::Sog, 0));
    assert_within(differences(model.splats().unwrap()), [1e-4, 0.01, 0.022, 0.01, 0.004, 0.02]);
    assert_eq!(ModelFormat::Sog.usual_up(), UpAxis::YDown);
    for format in [ModelFormat::Ply, ModelFormat::Spz] {
        let again = read("b", &model.write(format, &model.positions).unwrap()).unwrap();
        assert_eq!((again.format(), again.splats().unwrap().len()), (format, 240));
    }
    assert_eq!(
        model.write(ModelFormat::Sog, &model.positions).unwrap_err().to_string(),
        "a SOG is read, but not written: export GLB, PLY, SPLAT or SPZ"
    );
    // A project stores the file.
    let project = write_project(&[&model], &Default::default(), &[], "{}").unwrap();
    let project = read_project("x.glb", &project, u64::MAX).unwrap().unwrap();
    assert_eq!(project.models[0].splats(), model.splats());
}

/// Writes a PLY of one splat in one chunk: bytes of an element per line of the header.
fn compressed(chunk: &[f32], words: [u32; 4], harmonics: &[u8]) -> Vec<u8> {
    let ranges = "min_x min_y min_z max_x max_y max_z min_scale_x min_scale_y min_scale_z max_scale_x max_scale_y max_scale_z \
        min_r min_g min_b max_r max_g max_b";
    let properties = |kind: &str, names: &mut dyn Iterator<Item = String>| -> String {
        names.map(|name| format!("property {kind} {name}\n")).collect()
    };
    let mut file = format!(
        "ply\nformat binary_little_endian 1.0\nelement chunk 1\n{}element vertex 1\n{}",
        properties("float", &mut ranges.split(' ').take(chunk.len()).map(str::to_owned)),
        properties(
            "uint",
            &mut ["position", "rotation", "scale", "color"].map(|n| format!("packed_{n}")).into_iter()
        ),
    );
    if !harmonics.is_empty() {
        file += "element sh 1\n";
        file += &properties("uchar", &mut (0..harmonics.len()).map(|k| format!("f_rest_{k}")));
    }
    file += "end_header\n";
    let chunk = chunk.iter().flat_map(|x| x.to_le_bytes());
    let words = words.into_iter().flat_map(u32::to_le_bytes);
    file.bytes().chain(chunk).chain(words).chain(harmonics.iter().copied()).collect()
}

/// The layout of <https://developer.playcanvas.com/user-manual/gaussian-splatting/formats/ply>: 11, 10 and 11 bits for
/// positions and logarithms of scales, 2 and three times 10 bits for rotations, four bytes for the colour.
#[test]
fn words_of_a_compressed_ply_are_fractions_of_the_ranges_of_their_chunk() {
    let ranges = [-1.0, 0.0, 10.0, 1.0, 4.0, 20.0, -5.0, -6.0, -7.0, -1.0, -2.0, -3.0];
    let position = 2047 << 21 | 1023;
    let scale = 1023 << 11 | 2047;
    // The largest component is y, index 2 of w, x, y and z. x is sqrt(1/2), and w and z are 0.5 steps above 0.
    let rotation = 2 << 30 | 512 << 20 | 1023 << 10 | 512;
    let harmonics = [0, 255, 128, 64, 128, 128, 192, 128, 128];
    for (colors, red) in [(&[][..], 51.0 / 255.0), (&[-1.0, 0.0, 0.0, 1.0, 1.0, 1.0][..], -0.6)] {
        let chunk = [&ranges[..], colors].concat();
        let file = compressed(&chunk, [position, rotation, scale, 0x33_80_00_ff], &harmonics);
        let model = read("a.ply", &file).unwrap();
        let splats = model.splats().unwrap();
        let at = model.origin().as_vec3() + splats.positions[0];
        assert!(at.abs_diff_eq(Vec3::new(1.0, 0.0, 10.0 + 10.0 * 1023.0 / 2047.0), 1e-5), "{at}");
        let logarithms = splats.scales[0].map(f32::ln);
        assert!(logarithms.abs_diff_eq(Vec3::new(-5.0, -2.0, -3.0), 1e-5), "{logarithms}");
        let turn = Quat::from_xyzw(0.5_f32.sqrt(), 0.5_f32.sqrt(), 0.0, 0.0);
        assert!(splats.rotations[0].angle_between(turn) < 0.003, "{}", splats.rotations[0]);
        let color = splats.colors[0];
        assert!(color.abs_diff_eq(Vec3::new(red, 128.0 / 255.0, 0.0), 1e-6), "{color}");
        assert_eq!(splats.opacities[0], 1.0);
        // Byte b stands for 8 (b + 0.5) / 256 - 4, and the bytes 0 and 255 for -4 and 4. Coefficients are by channel.
        let number = |b: f32| 8.0 * (b + 0.5) / 256.0 - 4.0;
        let expected = [
            Vec3::new(-4.0, number(64.0), number(192.0)),
            Vec3::new(4.0, number(128.0), number(128.0)),
            Vec3::splat(number(128.0)),
        ];
        assert_eq!(splats.harmonics_of(0), expected);
    }
}

#[test]
fn damaged_compressed_plys_are_refused() {
    let good = compressed(&[0.0; 12], [0; 4], &[128; 9]);
    let fault = |from: &str, to: &str| {
        let text: String = good.iter().map(|&b| char::from(b)).collect();
        assert!(text.contains(from), "{from}");
        read("a.ply", &text.replace(from, to).chars().map(|c| c as u8).collect::<Vec<u8>>()).unwrap_err()
    };
    for (from, to, expected) in [
        ("element chunk 1", "element chunks 1", "it has 0 chunks of 256 splats for 1 splats"),
        ("min_scale_y", "scale_y", "its element 'chunk' has no property 'min_scale_y'"),
        ("packed_color", "color", "its element 'vertex' has no property 'packed_color'"),
        ("f_rest_8", "other", "it has 8 properties f_rest_*, but spherical harmonics of degree 0 to 3 have"),
        ("f_rest_8", "f_rest_9", "its element 'sh' has no property 'f_rest_8'"),
        ("element sh 1", "element sh 0", "it has spherical harmonics of 0 splats, but 1 splats"),
        ("element vertex 1", "element vertex 256", "its header declares 256 splats, which need 4144 bytes"),
    ] {
        let message = fault(from, to);
        assert!(message.contains(expected), "{message}");
    }
    let (head, rest) = good.split_at(good.len() - 16 - 9);
    let text = String::from_utf8_lossy(head)
        .replace("element chunk", "element x")
        .replace("element vertex", "element chunk");
    let swapped = [text.replace("element x", "element vertex").as_bytes(), rest].concat();
    assert!(read("a.ply", &swapped).is_err());
}

fn webp([width, height]: [u32; 2], pixels: &[[u8; 4]]) -> Vec<u8> {
    let mut pixels = pixels.to_vec();
    pixels.resize((width * height) as usize, [0; 4]);
    let mut file = Vec::new();
    WebPEncoder::new(&mut file).encode(pixels.as_flattened(), width, height, ColorType::Rgba8).unwrap();
    file
}

type Files = Vec<(String, Vec<u8>)>;

/// A SOG of two splats with harmonics of degree 1. In version 2, byte b stands for -b / 16 in scales, b / 64 - 2 in
/// colours and b / 128 - 1 in harmonics; in version 1, for the same ranges.
fn two_splats(version: u32) -> Files {
    let pair = [2, 1];
    let mut palette = vec![[128; 4]; 192];
    // Entry 5 of the palette.
    palette[15..18].copy_from_slice(&[[0, 64, 128, 255], [192, 128, 128, 255], [255, 0, 128, 255]]);
    let images = [
        // Position (0, 65535, 32768) / 65535 of the ranges, and half of the range of x.
        ("means_l.webp", webp(pair, &[[0, 255, 0, 255], [0, 0, 0, 255]])),
        ("means_u.webp", webp(pair, &[[0, 255, 128, 255], [128, 0, 0, 255]])),
        ("scales.webp", webp(pair, &[[16, 32, 48, 255], [64, 64, 64, 255]])),
        // x is the largest component, index 1 of w, x, y and z: w = -sqrt(1/2), y and z half a step above 0. The tag of
        // the second one is not valid.
        ("quats.webp", webp(pair, &[[0, 128, 128, 253], [0, 0, 0, 7]])),
        ("sh0.webp", webp(pair, &[[128, 192, 64, 51], [128, 128, 128, 255]])),
        ("shN_centroids.webp", webp([192, 1], &palette)),
        ("shN_labels.webp", webp(pair, &[[5, 0, 0, 255], [6, 0, 0, 255]])),
    ];
    let codebook = |number: fn(f32) -> f32| -> Value { (0..256).map(|b| number(b as f32)).collect() };
    let means = json!({ "mins": [-1.0, 0.0, 0.0], "maxs": [1.0, 2.0, 3.0], "files": ["means_l.webp", "means_u.webp"] });
    let mut meta = json!({
        "version": 2,
        "count": 2,
        "means": means,
        "scales": { "codebook": codebook(|b| -b / 16.0), "files": ["scales.webp"] },
        "quats": { "files": ["quats.webp"] },
        "sh0": { "codebook": codebook(|b| b / 64.0 - 2.0), "files": ["sh0.webp"] },
        "shN": {
            "count": 7,
            "bands": 1,
            "codebook": codebook(|b| b / 128.0 - 1.0),
            "files": ["shN_centroids.webp", "shN_labels.webp"],
        },
    });
    if version == 1 {
        meta["version"].take();
        meta.as_object_mut().unwrap().remove("version");
        meta.as_object_mut().unwrap().remove("count");
        meta["means"]["shape"] = json!([2, 3]);
        let range = |least: f32, most: f32, n: usize| (json!(vec![least; n]), json!(vec![most; n]));
        let (mins, maxs) = range(0.0, -255.0 / 16.0, 3);
        meta["scales"] = json!({ "mins": mins, "maxs": maxs, "files": ["scales.webp"] });
        // The last channel has the logarithms of the odds.
        let (mins, maxs) = (json!([-2.0, -2.0, -2.0, -4.0]), json!([1.984_375, 1.984_375, 1.984_375, 4.0]));
        meta["sh0"] = json!({ "mins": mins, "maxs": maxs, "files": ["sh0.webp"] });
        let files = meta["shN"]["files"].take();
        meta["shN"] = json!({ "mins": -1.0, "maxs": 0.992_187_5, "files": files });
    }
    let images = images.into_iter().map(|(name, bytes)| (name.to_owned(), bytes));
    images.chain([("meta.json".to_owned(), meta.to_string().into_bytes())]).collect()
}

fn zip(files: &Files) -> Vec<u8> {
    write_zip(files).unwrap()
}

/// The formulas of <https://developer.playcanvas.com/user-manual/gaussian-splatting/formats/sog>: positions are
/// sign(n) (exp |n| - 1).
#[test]
fn pixels_of_a_sog_select_numbers_of_its_tables() {
    for version in [1, 2] {
        let files = two_splats(version);
        let model = read("a.sog", &zip(&files)).unwrap();
        let splats = model.splats().unwrap();
        let at = |s: usize| model.origin().as_vec3() + splats.positions[s];
        let e = std::f32::consts::E;
        let z = (3.0_f32 * 32768.0 / 65535.0).exp() - 1.0;
        assert!(at(0).abs_diff_eq(Vec3::new(1.0 - e, e * e - 1.0, z), 1e-5), "{}", at(0));
        let half = (2.0_f32 * 32768.0 / 65535.0 - 1.0).exp() - 1.0;
        assert!(at(1).abs_diff_eq(Vec3::new(half, 0.0, 0.0), 1e-6), "{}", at(1));
        let logarithms = splats.scales[0].map(f32::ln);
        assert!(logarithms.abs_diff_eq(Vec3::new(-1.0, -2.0, -3.0), 1e-5), "{logarithms}");
        let turn = Quat::from_xyzw(0.5_f32.sqrt(), 0.0, 0.0, -0.5_f32.sqrt());
        assert!(splats.rotations[0].angle_between(turn) < 0.01, "{}", splats.rotations[0]);
        assert_eq!(splats.rotations[1], Quat::IDENTITY);
        assert_eq!(model.notices, ["1 splat has a rotation of length 0, which is ignored"]);
        let color = (splats.colors[0] - 0.5) / SH_0;
        assert!(color.abs_diff_eq(Vec3::new(0.0, 1.0, -1.0), 1e-5), "{color}");
        let odds: f32 = -4.0 + 8.0 * 51.0 / 255.0;
        let opacity = if version == 1 { 1.0 / (1.0 + (-odds).exp()) } else { 0.2 };
        assert!((splats.opacities[0] - opacity).abs() < 1e-6, "{}", splats.opacities[0]);
        let expected =
            [Vec3::new(-1.0, -0.5, 0.0), Vec3::new(0.5, 0.0, 0.0), Vec3::new(127.0 / 128.0, -1.0, 0.0)];
        assert_eq!(splats.degree, 1);
        for (found, expected) in splats.harmonics_of(0).iter().zip(expected) {
            assert!(found.abs_diff_eq(expected, 1e-6), "{found}");
        }
        assert_eq!(splats.harmonics_of(1), [Vec3::ZERO; 3]);

        // The same capture as separate files.
        let file = |name: &str| files.iter().find(|(of, _)| of == name).map(|(_, bytes)| bytes.clone());
        let meta = file("meta.json").unwrap();
        let unpacked = Model::read("meta.json", &meta, &mut |name| file(name).map(Ok)).unwrap();
        assert_eq!((unpacked.format(), unpacked.splats()), (ModelFormat::Sog, model.splats()));
        let names = Model::named_files("meta.json", &meta, &mut |_| None, u64::MAX);
        assert_eq!(names.len(), 7);
        let missing = Model::read("meta.json", &meta, &mut |_| None).unwrap_err().to_string();
        assert!(missing.contains("its part 'means_l.webp' is missing"), "{missing}");
    }
}

/// Old programs wrote null for the first number of a codebook, and PlayCanvas continues the mean step.
#[test]
fn a_codebook_may_begin_with_null() {
    let mut files = two_splats(2);
    let meta = &mut files.last_mut().unwrap().1;
    let mut json: Value = serde_json::from_slice(meta).unwrap();
    json["scales"]["codebook"][0].take();
    *meta = json.to_string().into_bytes();
    files[2].1 = webp([2, 1], &[[0, 32, 48, 255], [64, 64, 64, 255]]);
    let model = read("a.sog", &zip(&files)).unwrap();
    let first = -1.0 / 16.0 + (-1.0 / 16.0 + 255.0 / 16.0) / 255.0;
    assert!((model.splats().unwrap().scales[0].x.ln() - first).abs() < 1e-6);
}

#[test]
fn damaged_sogs_are_refused() {
    let with = |name: &str, bytes: &[u8]| {
        let mut files = two_splats(2);
        files.iter_mut().filter(|(of, _)| of == name).for_each(|(_, to)| *to = bytes.to_vec());
        read("a.sog", &zip(&files)).unwrap_err()
    };
    let of_meta = |path: &str, value: Value| {
        let mut json: Value = serde_json::from_slice(&two_splats(2).last().unwrap().1).unwrap();
        *json.pointer_mut(path).unwrap() = value;
        with("meta.json", json.to_string().as_bytes())
    };
    // The header of a lossy image of 258 x 772 pixels, as an encoder writes it.
    let lossy = b"RIFF\x1a\0\0\0WEBPVP8 \x0e\0\0\0\xf0\xaf\0\x9d\x01\x2a\x02\x01\x04\x03\0\0\0\0";
    // The header of a lossless image of 16383 x 16383 pixels.
    let large = b"RIFF\x12\0\0\0WEBPVP8L\x05\0\0\0\x2f\xfe\xbf\xff\x0f\0";
    // A lossless image of 2 x 1 pixels with one block, which has group 65535 of prefix codes: the decoder would build the
    // tables of 65536 groups.
    let groups = b"RIFF\x1a\0\0\0WEBPVP8L\x0d\0\0\0\x2f\x01\x00\x00\x00\x84\xfe\xf7\xbf\x00\x05\x28\x00\0";
    let cut = webp([2, 1], &[[1, 2, 3, 4]]);
    for (message, expected) in [
        (
            with("sh0.webp", lossy),
            "its part 'sh0.webp' is a lossy image, which changes the numbers in it: write",
        ),
        (with("sh0.webp", large), "more than the limit of 10 MiB or 16 times its size"),
        (with("sh0.webp", groups), "it needs about 1537 MiB of memory"),
        (with("sh0.webp", b"\x89PNG"), "its part 'sh0.webp' is not a WebP image, or is damaged"),
        (with("quats.webp", &cut[..cut.len() - 4]), "its part 'quats.webp'"),
        (with("scales.webp", &webp([1, 1], &[])), "'scales.webp' has 1 x 1 pixels, fewer than the 2 splats"),
        (
            with("shN_centroids.webp", &webp([191, 1], &[])),
            "'shN_centroids.webp' is 191 pixels wide; a palette",
        ),
        (
            with("shN_labels.webp", &webp([2, 1], &[[0; 4], [7, 0, 0, 0]])),
            "'shN_labels.webp': splat 1 has entry 7 of the palette, which has 7",
        ),
        (
            with("meta.json", b"{\"means\":1,\"sh0\":2}"),
            "its part 'meta.json': '1' has the wrong type, at line 1, column 10",
        ),
        (
            of_meta("/version", json!(3)),
            "it is a SOG of version 3, but versions 1 and 2 are read: convert it",
        ),
        (of_meta("/count", json!(3)), "has 2 x 1 pixels, fewer than the 3 splats"),
        (of_meta("/count", json!(0)), "it has no splats"),
        (of_meta("/scales/codebook/9", Value::Null), "has no number 9 in the codebook of 'scales'"),
        (of_meta("/means/mins", json!([0.0])), "has no range of channel 1 of 'means'"),
        (of_meta("/means/files", json!(["means_l.webp"])), "names 1 images of 'means', which has 2"),
        (of_meta("/quats/files/0", json!("q.webp")), "its part 'q.webp' is missing"),
        (of_meta("/shN/bands", json!(2)), "is 192 pixels wide; a palette of spherical harmonics"),
        (of_meta("/sh0/codebook/128", json!(1e30)), "splat 0 has the colour"),
        (read("a.sog", b"PK\x03\x04").unwrap_err(), "not a SOG: it is not a zip archive with a meta.json"),
    ] {
        assert!(message.contains(expected), "{message}\n{expected}");
    }
    let limited = Model::read_within("a.sog", SOG, &mut |_| None, 1 << 16).unwrap_err().to_string();
    assert!(limited.contains("of memory, more than the limit of 64 KiB"), "{limited}");
}
