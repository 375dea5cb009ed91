//! Files of Gaussian splats.

use std::io::{Read as _, Write as _};

use cagework_core::splats::{Splats, color_along, n_harmonics, splat_covariance};
use cagework_io::{Model, ModelFormat, UpAxis};
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use glam::{Quat, Vec3};

const FORMATS: [ModelFormat; 4] = [ModelFormat::Ply, ModelFormat::Splat, ModelFormat::Spz, ModelFormat::Gltf];
/// Properties of a 3DGS file with spherical harmonics of degree 1, and one that is not read.
const NAMES: &str = "x y z nx ny nz f_dc_0 f_dc_1 f_dc_2 f_rest_0 f_rest_1 f_rest_2 f_rest_3 f_rest_4 f_rest_5 f_rest_6 \
    f_rest_7 f_rest_8 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3 label";

fn read(name: &str, bytes: &[u8]) -> Result<Model, String> {
    Model::read_within(name, bytes, &mut |_| None, 1 << 28).map_err(|e| e.to_string())
}

/// Value of property `column` of splat `splat`: a sine that depends on both indices. Logarithms of scales are 3 lower.
fn number(splat: usize, column: usize) -> f32 {
    let wave = ((7 * splat + 3 * column) as f32).sin();
    if (19..22).contains(&column) { wave - 3.0 } else { wave }
}

fn header(names: &str, count: usize, format: &str) -> String {
    let lines: String = names.split_whitespace().map(|name| format!("property float {name}\n")).collect();
    format!("ply\nformat {format} 1.0\ncomment a\nelement vertex {count}\n{lines}end_header\n")
}

/// A 3DGS file of six splats, whose numbers `change` may replace.
fn ply(change: impl Fn(usize, usize) -> Option<f32>) -> Vec<u8> {
    let mut bytes = header(NAMES, 6, "binary_little_endian").into_bytes();
    for (splat, column) in (0..6).flat_map(|splat| (0..27).map(move |column| (splat, column))) {
        let x = change(splat, column).unwrap_or_else(|| number(splat, column));
        bytes.extend(x.to_le_bytes());
    }
    bytes
}

/// Position of the first splat in the space of the file.
fn place(model: &Model) -> Vec3 {
    (model.origin() + model.positions[0].as_dvec3()).as_vec3()
}

fn capture() -> Model {
    read("a.ply", &ply(|_, _| None)).unwrap()
}

#[test]
fn ply_stores_logarithms_and_harmonics_by_channel() {
    let model = capture();
    let splats = model.splats().unwrap();
    assert_eq!((model.positions.len(), splats.degree, model.n_faces()), (6, 1, 0));
    for s in 0..6 {
        let vector = |columns: [usize; 3]| Vec3::from_array(columns.map(|column| number(s, column)));
        assert_eq!(splats.positions[s], vector([0, 1, 2]));
        assert!(splats.scales[s].abs_diff_eq(vector([19, 20, 21]).map(f32::exp), 1e-7));
        let rotation = Quat::from_xyzw(number(s, 23), number(s, 24), number(s, 25), number(s, 22));
        assert!(splats.rotations[s].dot(rotation.normalize()) > 0.999_999);
        assert!((splats.opacities[s] - 1.0 / (1.0 + (-number(s, 18)).exp())).abs() <= 1e-6);
        // The harmonic of band 0 has the constant value 1 / (2 sqrt(pi)).
        let color = 0.5 + vector([6, 7, 8]) * 0.5 / std::f32::consts::PI.sqrt();
        assert!(splats.colors[s].abs_diff_eq(color, 1e-6));
        for k in 0..3 {
            assert_eq!(splats.harmonics_of(s)[k], vector([9 + k, 12 + k, 15 + k]));
        }
    }
}

#[test]
fn text_and_big_endian_files_equal_the_binary_one() {
    let expected = capture();
    let mut text = header(NAMES, 6, "ascii");
    let mut big = header(NAMES, 6, "binary_big_endian").into_bytes();
    for (splat, column) in (0..6).flat_map(|splat| (0..27).map(move |column| (splat, column))) {
        text += &format!("{} ", number(splat, column));
        big.extend(number(splat, column).to_be_bytes());
    }
    for file in [text.into_bytes(), big] {
        let model = read("a.ply", &file).unwrap();
        assert_eq!(model.splats(), expected.splats());
        assert_eq!(model.write(ModelFormat::Ply, &model.positions).unwrap(), file, "unchanged");
        let mut moved = model.splats().unwrap().clone();
        moved.positions[2].x += 0.5;
        let again = read("a.ply", &model.write_splats(ModelFormat::Ply, &moved).unwrap()).unwrap();
        assert_eq!(again.positions, moved.positions);
    }
}

/// A text file stays text: only the words of numbers that changed differ, and other elements are kept.
#[test]
fn text_files_keep_their_words_and_elements() {
    let camera = "element camera 1\nproperty float view_px\nproperty list uchar int ids\n";
    let mut text = header(NAMES, 6, "ascii").replace("end_header", &format!("{camera}end_header"));
    for splat in 0..6 {
        // Zeros at the end of a number are not in its shortest form, so they show that the word is kept.
        let words: Vec<String> = (0..27).map(|column| format!("{}00", number(splat, column))).collect();
        text += &format!("{}\r\n", words.join("  "));
    }
    text += "1.50 2 7 8\n";
    let model = read("a.ply", text.as_bytes()).unwrap();
    let mut moved = model.splats().unwrap().clone();
    moved.positions[2].x = 0.5;
    let out = model.write_splats(ModelFormat::Ply, &moved).unwrap();
    let lines = |text: &str| text.split('\n').map(str::to_owned).collect::<Vec<_>>();
    let (before, after) = (lines(&text), lines(std::str::from_utf8(&out).unwrap()));
    let n_header = before.iter().position(|line| line == "end_header").unwrap() + 1;
    assert_eq!(before.len(), after.len());
    for line in (0..before.len()).filter(|&line| line != n_header + 2) {
        assert_eq!(before[line], after[line]);
    }
    let [before, after] = [&before, &after].map(|all| all[n_header + 2].split("  ").collect::<Vec<_>>());
    // A PLY of splats has y down, so its x is that of the model.
    assert_eq!((after[0], &after[1..19]), ("0.5", &before[1..19]));
    assert!(after[26].ends_with('\r') && after.len() == 27);
    assert_eq!(read("a.ply", &out).unwrap().splats().unwrap().positions[2].x, 0.5);
}

/// Position, scale, colour with opacity, and rotation, as the format lays them out: 3 floats, 3 floats, 4 bytes, 4
/// bytes.
#[test]
fn splat_records_are_32_bytes() {
    let mut record = Vec::new();
    for x in [1.0_f32, -2.0, 3.0, 0.1, 0.2, 0.3] {
        record.extend(x.to_le_bytes());
    }
    record.extend([255, 128, 0, 51, 128, 255, 128, 128]);
    let model = read("a.splat", &record).unwrap();
    let splats = model.splats().unwrap();
    assert_eq!((place(&model), splats.scales[0]), (Vec3::new(1.0, -2.0, 3.0), Vec3::new(0.1, 0.2, 0.3)));
    assert_eq!((splats.opacities[0], splats.colors[0].x), (0.2, 1.0));
    assert_eq!(splats.rotations[0], Quat::from_xyzw(1.0, 0.0, 0.0, 0.0));
    assert_eq!(model.write(ModelFormat::Splat, &model.positions).unwrap(), record);
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// A Zstandard frame with one block, uncompressed (RFC 8878, section 3.1).
fn zstd_frame(bytes: &[u8]) -> Vec<u8> {
    let block = ((bytes.len() as u32) << 3 | 1).to_le_bytes();
    [&[0x28, 0xb5, 0x2f, 0xfd, 0xa0][..], &(bytes.len() as u32).to_le_bytes(), &block[..3], bytes].concat()
}

/// A Zstandard frame of `n` zeros: blocks of 128 KiB that repeat a byte, four bytes each.
fn zstd_zeros(n: usize) -> Vec<u8> {
    const BLOCK: usize = 1 << 17;
    let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, 0xa0];
    frame.extend((n as u32).to_le_bytes());
    for start in (0..n).step_by(BLOCK) {
        let size = BLOCK.min(n - start) as u32;
        frame.extend(&(size << 3 | 1 << 1 | u32::from(start + BLOCK >= n)).to_le_bytes()[..3]);
        frame.push(0);
    }
    frame
}

/// An SPZ of version 4 with extension records and `(size, frame)` of each stream.
fn spz_4(count: u32, degree: u8, extensions: &[u8], streams: &[(usize, Vec<u8>)]) -> Vec<u8> {
    let flags = if extensions.is_empty() { 0 } else { 2 };
    let mut file = [&b"NGSP"[..], &4_u32.to_le_bytes(), &count.to_le_bytes()].concat();
    file.extend([degree, 12, flags, streams.len() as u8]);
    file.extend((32 + extensions.len() as u32).to_le_bytes());
    file.extend([0; 12]);
    file.extend(extensions);
    for (size, frame) in streams {
        file.extend((frame.len() as u64).to_le_bytes());
        file.extend((*size as u64).to_le_bytes());
    }
    file.extend(streams.iter().flat_map(|(_, frame)| frame));
    file
}

/// Arrays of the splat of [`spz`], apart from position and rotation.
const ARRAYS: [&[u8]; 4] =
    [&[51], &[128, 166, 128], &[160, 144, 128], &[128, 192, 64, 128, 192, 64, 128, 192, 64]];

/// The splat of [`spz`], as version 4.
fn spz_4_of_one(position: &[u8], rotation: &[u8], extensions: &[u8]) -> Vec<u8> {
    let [opacity, color, scale, harmonics] = ARRAYS;
    let streams = [position, opacity, color, scale, rotation, harmonics];
    spz_4(1, 1, extensions, &streams.map(|bytes| (bytes.len(), zstd_frame(bytes))))
}

/// An SPZ of one splat of degree 1 with the bytes that the format's documentation prescribes.
fn spz(version: u32, position: &[u8], rotation: &[u8]) -> Vec<u8> {
    let header = [&b"NGSP"[..], &version.to_le_bytes(), &1_u32.to_le_bytes(), &[1, 12, 0, 0]].concat();
    let [opacity, color, scale, harmonics] = ARRAYS;
    gzip(&[&header[..], position, opacity, color, scale, rotation, harmonics].concat())
}

#[test]
fn spz_versions_decode_by_their_documentation() {
    // The position (1, -0.5, 2): as 24-bit integers with 12 fractional bits, and as 16-bit floats.
    let fixed = [[0, 16, 0], [0, 248, 255], [0, 32, 0]].concat();
    let halves = [0x3c00_u16, 0xb800, 0x4000].map(u16::to_le_bytes).concat();
    // Versions 1 and 2 have half a turn about x. Version 3 has a quarter turn: the largest component is w, index 3, and
    // x is sqrt(1/2), stored as 511.
    let quarter = ((3_u32 << 30) | (511 << 20)).to_le_bytes();
    for (version, position, rotation, expected) in [
        (1, &halves, &[255, 127, 128][..], Quat::from_rotation_x(std::f32::consts::PI)),
        (2, &fixed, &[255, 127, 128], Quat::from_rotation_x(std::f32::consts::PI)),
        (3, &fixed, &quarter, Quat::from_rotation_x(std::f32::consts::FRAC_PI_2)),
        (4, &fixed, &quarter, Quat::from_rotation_x(std::f32::consts::FRAC_PI_2)),
    ] {
        let file = if version == 4 {
            spz_4_of_one(position, rotation, &[])
        } else {
            spz(version, position, rotation)
        };
        let model = read("a.spz", &file).unwrap();
        let splats = model.splats().unwrap();
        assert_eq!(place(&model), Vec3::new(1.0, -0.5, 2.0), "version {version}");
        assert!(splats.scales[0].abs_diff_eq(Vec3::new(1.0, (-1.0_f32).exp(), (-2.0_f32).exp()), 1e-6));
        assert!(splats.rotations[0].angle_between(expected) < 0.02, "{}", splats.rotations[0]);
        // Byte 166 stores the coefficient f of band 0 as 255 (0.15 f + 0.5), and f is (colour - 0.5) 2 sqrt(pi).
        let green = 0.5 + (166.0 / 255.0 - 0.5) / 0.15 * 0.5 / std::f32::consts::PI.sqrt();
        assert!((splats.colors[0].y - green).abs() < 1e-5 && (splats.opacities[0] - 0.2).abs() < 1e-6);
        assert_eq!(splats.harmonics_of(0), [Vec3::new(0.0, 0.5, -0.5); 3]);
    }
}

/// `splats/helix-4.spz` was written by splat-transform 2.7.1 (Niantic's library, with libzstd) from a PLY with the numbers
/// below. All its streams are compressed.
#[test]
fn spz_4_of_another_program_has_the_numbers_of_its_source() {
    let file = include_bytes!("../splats/helix-4.spz");
    let model = read("helix.spz", file).unwrap();
    let splats = model.splats().unwrap();
    assert_eq!((splats.len(), splats.degree), (240, 1));
    // Half a turn about x, from the axes of a PLY to those of an SPZ.
    let half = Quat::from_rotation_x(std::f32::consts::PI);
    let mut source = Splats { degree: 1, ..Splats::default() };
    for k in 0..240 {
        let t = k as f32 / 10.0;
        source.positions.push(Vec3::new(t.cos(), k as f32 / 120.0 - 1.0, t.sin()));
        source.scales.push(Vec3::new(-4.0, -3.5, (k % 8) as f32 / 8.0 - 3.0).map(f32::exp));
        source.rotations.push(Quat::from_xyzw(0.0, (t / 4.0).sin(), 0.0, (t / 4.0).cos()));
        source.opacities.push(1.0 / (1.0 + (-2.0_f32).exp()));
        source.colors.push(0.5 + Vec3::new((t / 2.0).cos(), 0.5, -0.5) * 0.5 / std::f32::consts::PI.sqrt());
        let wave = |c: usize| 0.25 * (t + c as f32).sin();
        source.harmonics.extend((0..3).map(|k| Vec3::new(wave(k), wave(3 + k), wave(6 + k))));
    }
    let source = source.rotated(half);
    let [scale, angle, color, _] = tolerances(ModelFormat::Spz);
    for s in 0..240 {
        assert!((model.origin().as_vec3() + splats.positions[s]).distance(source.positions[s]) < 4e-4, "{s}");
        assert!((splats.scales[s] / source.scales[s] - 1.0).abs().max_element() <= scale);
        // splat-transform also turns the splat's own axes by half a turn about x, which maps the ellipsoid to itself.
        let off = splats.rotations[s].angle_between(source.rotations[s] * half);
        assert!(off <= angle, "{s}: {off}");
        assert!((splats.colors[s] - source.colors[s]).abs().max_element() <= color);
        assert!((splats.opacities[s] - source.opacities[s]).abs() <= 0.002);
        // splat-transform stores harmonics of degree 1 in steps of 8/128.
        for (a, b) in splats.harmonics_of(s).iter().zip(source.harmonics_of(s)) {
            assert!((*a - *b).abs().max_element() <= 0.04, "{s}: {a} {b}");
        }
    }
    assert_eq!(model.write(ModelFormat::Spz, &model.positions).unwrap(), file, "unchanged");
    // An export of changed splats is a file of version 3 with the other arrays of the source.
    let mut moved = splats.clone();
    moved.positions[7].x += 0.25;
    let again = read("a.spz", &model.write_splats(ModelFormat::Spz, &moved).unwrap()).unwrap();
    let after = again.splats().unwrap();
    assert_eq!(
        (&after.colors, &after.opacities, &after.harmonics),
        (&splats.colors, &splats.opacities, &splats.harmonics)
    );
    assert!((again.positions[7] - moved.positions[7]).length() < 1e-3);
}

/// Largest errors due to quantisation: relative error of positions and scales, then errors of rotations (radians),
/// colours and harmonics.
fn tolerances(format: ModelFormat) -> [f32; 4] {
    match format {
        ModelFormat::Splat => [1e-6, 0.02, 0.003, f32::INFINITY],
        // Values are rounded to the nearest step, so errors are up to half a step. Steps are 1/16 for logarithms of
        // scales, 0.28 / (255 * 0.15) for colours and 1/128 for harmonics. The components of a rotation have steps of
        // 0.7 / 511.
        ModelFormat::Spz => [0.032, 0.004, 0.004, 0.004],
        _ => [1e-6, 1e-3, 1e-5, 1e-6],
    }
}

#[test]
fn every_format_returns_what_every_other_wrote() {
    for from in FORMATS {
        let model = read("a", &capture().write(from, &capture().positions).unwrap());
        let model = if from == ModelFormat::Splat {
            read("a.splat", &capture().write(from, &capture().positions).unwrap())
        } else {
            model
        }
        .unwrap();
        assert_eq!(model.format(), from);
        for to in FORMATS {
            let bytes = model.write(to, &model.positions).unwrap();
            let again = read(&format!("b.{}", to.export_extension()), &bytes).unwrap();
            // PLY and .splat have y down, SPZ and glTF y up.
            let is_turned = from.usual_up() != to.usual_up();
            let half = if is_turned { Quat::from_rotation_x(std::f32::consts::PI) } else { Quat::IDENTITY };
            let (a, b) = (&model.splats().unwrap().rotated(half), again.splats().unwrap());
            let [scale, angle, color, harmonic] = tolerances(to);
            for s in 0..6 {
                assert!(a.positions[s].distance(b.positions[s]) <= 1e-5, "{from:?} {to:?}");
                assert!((b.scales[s] / a.scales[s] - 1.0).abs().max_element() <= scale, "{from:?} {to:?}");
                assert!(a.rotations[s].angle_between(b.rotations[s]) <= angle, "{from:?} {to:?}");
                let [a_color, b_color] = [a, b].map(|of| of.colors[s].extend(of.opacities[s]));
                // A .splat stores colours and opacities as bytes, so values are limited to the range from 0 to 1.
                let limit = if to == ModelFormat::Splat {
                    a_color.clamp(Vec3::ZERO.extend(0.0), Vec3::ONE.extend(1.0))
                } else {
                    a_color
                };
                assert!(
                    (limit - b_color).abs().max_element() <= color,
                    "{from:?} {to:?} {a_color} {b_color}"
                );
                for (x, y) in a
                    .harmonics_of(s)
                    .iter()
                    .zip(b.harmonics.chunks(n_harmonics(b.degree).max(1)).nth(s).unwrap_or_default())
                {
                    // SPZ stores harmonics from -1 to 127/128, about 0.992.
                    assert!(
                        (x.clamp(Vec3::NEG_ONE, Vec3::splat(0.992)) - *y).abs().max_element()
                            <= harmonic.max(0.008),
                        "{from:?} {to:?}"
                    );
                }
            }
        }
    }
}

/// 16 (ln 400 + 10) = 256 exceeds a byte. The colour of band 0 is stored from -10/3 to 10/3, harmonics from -1 to 1.
#[test]
fn values_outside_the_ranges_of_spz_are_named() {
    let of = |column: usize, x: f32| {
        let model = read("a.ply", &ply(|s, c| (s == 2 && c == column).then_some(x))).unwrap();
        model.lost_in(ModelFormat::Spz)
    };
    for (column, within, beyond) in [(19, 5.9, 6.0), (7, 3.3, 3.4), (12, -1.0, -1.1)] {
        assert_eq!(of(column, within), None, "column {column}");
        assert!(of(column, beyond).unwrap().contains("outside the ranges"), "column {column}");
    }
}

#[test]
fn unchanged_splats_keep_their_bytes_and_changed_ones_the_rest() {
    let file = ply(|_, _| None);
    let start = file.len() - 6 * 27 * 4;
    for up in [UpAxis::Y, UpAxis::Z, UpAxis::YDown] {
        let mut model = read("a.ply", &file).unwrap();
        model.set_up(up);
        assert_eq!(model.write(ModelFormat::Ply, &model.positions).unwrap(), file);
        let mut moved: Splats = model.splats().unwrap().clone();
        moved.positions[3] += up.vector_turned(glam::DVec3::X).as_vec3();
        let bytes = model.write_splats(ModelFormat::Ply, &moved).unwrap();
        for splat in 0..6 {
            for column in 0..27 {
                let at = start + 4 * (27 * splat + column);
                let [was, now] =
                    [&file, &bytes].map(|of| f32::from_le_bytes(of[at..at + 4].try_into().unwrap()));
                match (splat, column) {
                    (3, 0) => assert!((now - was - 1.0).abs() < 1e-6),
                    (3, 1..=2 | 9..=17 | 19..=21) => {
                        assert!((now - was).abs() < 1e-5, "{column}: {was} {now}");
                    }
                    // The file's rotation is not normalised, but the exported one is.
                    (3, 22..=25) => {}
                    _ => assert_eq!(now.to_bits(), was.to_bits(), "{splat} {column}"),
                }
            }
        }
    }
    for format in FORMATS {
        let written = capture().write(format, &capture().positions).unwrap();
        let model = read(&format!("a.{}", format.export_extension()), &written).unwrap();
        assert_eq!(model.write(format, &model.positions).unwrap(), written, "{format:?}");
        let mut moved = model.splats().unwrap().clone();
        moved.positions[3].x += 0.25;
        let again =
            read(&format!("a.{}", format.export_extension()), &model.write_splats(format, &moved).unwrap());
        let again = again.unwrap();
        for splat in 0..6 {
            assert!(again.positions[splat].distance(moved.positions[splat]) < 1e-5);
        }
        assert_eq!(again.splats().unwrap().opacities, moved.opacities, "{format:?}");
    }
}

#[test]
fn up_axis_turns_shapes_and_harmonics() {
    let mut model = capture();
    let before = model.splats().unwrap().clone();
    model.set_up(UpAxis::Z);
    let after = model.splats().unwrap();
    let turn = Quat::from_mat4(&UpAxis::Z.turn());
    assert_eq!(after.positions, model.positions);
    for s in 0..6 {
        let axes = glam::Mat3::from_quat(turn) * before.axes(s);
        let [a, b] = [splat_covariance(axes), splat_covariance(after.axes(s))];
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6));
    }
    let value = |of: &Splats, d: Vec3| -> Vec3 {
        let basis = cagework_core::splats::harmonic_basis(d);
        basis.iter().zip(of.harmonics_of(0)).map(|(&y, &c)| y * c).sum()
    };
    assert!(value(after, turn * Vec3::X).abs_diff_eq(value(&before, Vec3::X), 1e-5));
}

#[test]
fn nodes_of_a_glb_move_turn_and_scale_splats() {
    let glb = capture().write(ModelFormat::Gltf, &capture().positions).unwrap();
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let json = String::from_utf8(glb[20..20 + length].to_vec()).unwrap();
    // A quarter turn about y and twice the size.
    let with_node = |node: &str| {
        let mut json = json.replace(r#"{"mesh":0}"#, node).into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut glb_of_node = glb[..8].to_vec();
        glb_of_node.extend((12 + 8 + json.len() as u32 + (glb.len() - 20 - length) as u32).to_le_bytes());
        glb_of_node.extend((json.len() as u32).to_le_bytes());
        glb_of_node.extend(b"JSON");
        glb_of_node.extend(json);
        glb_of_node.extend(&glb[20 + length..]);
        read("a.glb", &glb_of_node).unwrap()
    };
    let node = r#"{"mesh":0,"scale":[2,2,2],"rotation":[0,0.70710678,0,0.70710678],"translation":[1,0,0]}"#;
    let (before, after) = (capture(), with_node(node));
    let quarter = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
    // A GLB has y up, a PLY y down.
    let half = Quat::from_rotation_x(std::f32::consts::PI);
    let (before, after) = (&before.splats().unwrap().rotated(half), after.splats().unwrap());
    for s in 0..6 {
        assert!((2.0 * (quarter * before.positions[s]) + Vec3::X).distance(after.positions[s]) < 1e-5);
        let axes = glam::Mat3::from_quat(quarter) * before.axes(s) * 2.0;
        let [a, b] = [splat_covariance(axes), splat_covariance(after.axes(s))];
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5 * a.abs().max(0.01)));
    }
    // A node that mirrors shows, in each direction, the colour of the mirrored direction.
    let mirrored = with_node(r#"{"mesh":0,"scale":[-1,1,1]}"#);
    let mirrored = mirrored.splats().unwrap();
    for s in 0..6 {
        for direction in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::new(0.6, 0.64, -0.48)] {
            let seen = |of: &Splats, d: Vec3| color_along(of.colors[s], of.harmonics_of(s), d);
            let [found, expected] =
                [seen(mirrored, direction), seen(before, direction * Vec3::new(-1.0, 1.0, 1.0))];
            assert!(found.abs_diff_eq(expected, 1e-5), "{s} {direction}: {found} {expected}");
        }
    }
}

#[test]
fn damaged_captures_are_refused_with_value_and_limit() {
    let fault = |name: &str, bytes: &[u8]| read(name, bytes).unwrap_err();
    let text =
        |names: &str| format!("{}{}", header(names, 1, "ascii"), "0.5 ".repeat(names.split(' ').count()));
    let without = |name: &str| fault("a.ply", text(&NAMES.replace(name, "other")).as_bytes());
    assert!(without("scale_1").contains("its splats have no 'scale_1': a 3DGS file has x, y, z"));
    assert!(without("f_rest_8").contains("it has 8 properties f_rest_*"));
    assert!(without("opacity").contains("no 'opacity'"));
    let with = |column: usize, x: f32| read("a.ply", &ply(|s, c| (s == 2 && c == column).then_some(x)));
    assert!(with(0, f32::NAN).unwrap_err().contains("splat 2 has the position"));
    let huge = with(20, 100.0).unwrap_err();
    assert!(
        huge.contains("splat 2 has the scale") && huge.contains("the limit is 1e15: remove such splats"),
        "{huge}"
    );
    for (column, property) in [(19, "scale_0"), (20, "scale_1"), (21, "scale_2")] {
        let fault = with(column, f32::NAN).unwrap_err();
        let reason = format!("but {property} is not a number: remove such splats");
        assert!(fault.contains("splat 2 has the scale [") && fault.contains(&reason), "{fault}");
    }
    for (color, limit) in [(f32::INFINITY, "1e15"), (f32::NAN, "all numbers must be finite"), (1e38, "1e15")]
    {
        let fault = with(10, color).unwrap_err();
        assert!(fault.contains("splat 2 has the colour") && fault.contains(limit), "{fault}");
    }
    assert!(with(18, f32::NAN).unwrap_err().contains("the opacity NaN"));
    // Infinite odds are an opacity of 1, and a scale of exp(-200) is 0.
    assert_eq!(with(18, f32::INFINITY).unwrap().splats().unwrap().opacities[2], 1.0);
    assert_eq!(with(19, -200.0).unwrap().splats().unwrap().scales[2].x, 0.0);
    for length in [0.0, 1e-41] {
        let unrotated =
            read("a.ply", &ply(|s, c| (s == 2 && (22..26).contains(&c)).then_some(length))).unwrap();
        assert_eq!(unrotated.splats().unwrap().rotations[2], Quat::IDENTITY);
        assert_eq!(unrotated.notices, ["1 splat has a rotation of length 0, which is ignored"]);
    }
    let many = fault("a.ply", &ply(|_, _| None)[..900]);
    assert!(many.contains("its header declares 6 splats, which need 648 bytes"), "{many}");
    let claimed = String::from_utf8_lossy(&ply(|_, _| None)[..800]).replace("vertex 6", "vertex 50000000");
    assert!(fault("a.ply", claimed.as_bytes()).contains("declares 50000000 splats"));

    assert!(fault("a.splat", &[0; 33]).contains("it has 33 bytes, which is not a multiple of the 32 bytes"));
    assert!(fault("a.splat", b"").contains("the file has no bytes"));
    let mut negative = [0; 32];
    negative[12..16].copy_from_slice(&(-2.0_f32).to_le_bytes());
    let negative = read("a.splat", &negative).unwrap();
    assert_eq!(negative.splats().unwrap().scales[0].x, 2.0);
    assert_eq!(negative.notices[0], "1 splat has a negative scale: its absolute value is used");
    // A .splat has no header, so its first bytes can equal the first bytes of a glTF or of a UTF-16 text.
    let braces = [&b"{\0\0\0"[..], &[0; 28]].concat();
    assert_eq!(read("a.splat", &braces).unwrap().format(), ModelFormat::Splat);

    let good = spz(3, &[0; 9], &[0; 4]);
    let mut body = Vec::new();
    GzDecoder::new(&good[..]).read_to_end(&mut body).unwrap();
    let changed = |at: usize, to: &[u8]| {
        let mut body = body.clone();
        body[at..at + to.len()].copy_from_slice(to);
        fault("a.spz", &gzip(&body))
    };
    assert!(changed(0, b"XXXX").contains("not an SPZ"));
    assert!(changed(4, &[9]).contains("SPZ of version 9, but versions 1 to 4 are read"));
    assert!(changed(12, &[4]).contains("degree 4") && changed(13, &[60]).contains("60 fractional bits"));
    assert!(changed(8, &2_u32.to_le_bytes()).contains("its header declares 2 splats, which need 58 bytes"));
    assert!(changed(8, &50_000_000_u32.to_le_bytes()).contains("declares 50000000 splats"));
    assert!(changed(8, &[0; 4]).contains("it has no splats"));
    assert!(fault("a.spz", &good[..good.len() - 12]).contains("damaged or cut off"));
    // 10 MB of zeros in a small file: the limit is checked before they are decompressed.
    let mut bomb = body[..16].to_vec();
    bomb[8..12].copy_from_slice(&340_000_u32.to_le_bytes());
    bomb.resize(16 + 29 * 340_000, 0);
    let bomb = gzip(&bomb);
    let limited = Model::read_within("a.spz", &bomb, &mut |_| None, 1 << 24).unwrap_err().to_string();
    assert!(limited.contains("MiB of memory, more than the limit of 16 MiB"), "{limited}");
    let mut bomb = body[..16].to_vec();
    bomb[8..12].copy_from_slice(&2_400_000_u32.to_le_bytes());
    bomb.resize(16 + 29 * 2_400_000, 0);
    let unpacked = fault("a.spz", &gzip(&bomb));
    assert!(unpacked.contains("unpack to 69600000, more than the limit of 10 MiB or 16 times"), "{unpacked}");

    let bare = fault("a.spz", &body);
    assert!(
        bare.contains("it is an SPZ of version 3 without its gzip stream: compress it with `gzip`"),
        "{bare}"
    );
    let good = spz_4_of_one(&[0; 9], &[0; 4], &[]);
    let changed = |at: usize, to: &[u8]| {
        let mut file = good.clone();
        file[at..at + to.len()].copy_from_slice(to);
        fault("a.spz", &file)
    };
    assert!(changed(4, &[9]).contains("SPZ of version 9, but versions 1 to 4 are read"));
    assert!(changed(8, &50_000_000_u32.to_le_bytes()).contains("declares 50000000 splats"));
    assert!(changed(8, &2_u32.to_le_bytes()).contains("its stream 0 holds 9 bytes, but its array has 18"));
    let without_harmonics = ARRAYS[..3].iter().map(|bytes| (bytes.len(), zstd_frame(bytes)));
    let mut streams: Vec<_> = without_harmonics.collect();
    streams.insert(0, (9, zstd_frame(&[0; 9])));
    streams.push((4, zstd_frame(&[0; 4])));
    let missing = fault("a.spz", &spz_4(1, 1, &[], &streams));
    assert!(missing.contains("its table has no stream for an array of 9 bytes"), "{missing}");
    for start in [31, u32::MAX] {
        let table = format!("its table of 6 streams at byte {start} is not in the file");
        assert!(changed(16, &start.to_le_bytes()).contains(&table));
    }
    assert!(changed(32, &u64::MAX.to_le_bytes()).contains("its stream 0 has 18446744073709551615 bytes"));
    assert!(changed(32 + 6 * 16, &[0]).contains("its Zstandard stream 0 cannot be decompressed to 9 bytes"));
    assert!(fault("a.spz", &good[..31]).contains("its header has 31 bytes, not 32"));
    assert!(fault("a.spz", &good[..good.len() - 1]).contains("its stream 5 has 21 bytes, but 20 are left"));
    // Streams that decompress to more or fewer bytes than their table declares.
    let with_positions = |zeros: usize| {
        let [opacity, color, scale, _] = ARRAYS.map(|bytes| (bytes.len(), zstd_frame(bytes)));
        let rotation = (4, zstd_frame(&[0; 4]));
        fault("a.spz", &spz_4(1, 0, &[], &[(9, zstd_zeros(zeros)), opacity, color, scale, rotation]))
    };
    for zeros in [8, 10, 1 << 30] {
        assert!(with_positions(zeros).contains("its Zstandard stream 0 cannot be decompressed to 9 bytes"));
    }
    // 10 MB of zeros in a small file: the limit is checked before they are decompressed.
    let streams = [9, 1, 3, 3, 4].map(|size| (size * 500_000, zstd_zeros(size * 500_000)));
    let mut bomb = spz_4(500_000, 0, &[], &streams);
    assert!(fault("a.spz", &bomb).contains("declares 500000 splats"), "{} bytes", bomb.len());
    bomb.resize(9_000, 0);
    let limited = Model::read_within("a.spz", &bomb, &mut |_| None, 1 << 24).unwrap_err().to_string();
    assert!(limited.contains("MiB of memory, more than the limit of 16 MiB"), "{limited}");
    // An extension record declares the axes right, down and front (6), after a record of an unknown type.
    let extensions = [1_u32, 4, 9, 0xadbe_0003, 4, 6].map(u32::to_le_bytes).concat();
    let turned = read("a.spz", &spz_4_of_one(&[0; 9], &[0; 4], &extensions)).unwrap();
    assert!(turned.notices[0].contains("SPZ_ADOBE_coordinate_system 6"), "{:?}", turned.notices);
    let mut legacy = Vec::new();
    GzDecoder::new(&spz(3, &[0; 9], &[0; 4])[..]).read_to_end(&mut legacy).unwrap();
    legacy[14] = 2;
    legacy.extend(&extensions);
    assert_eq!(read("a.spz", &gzip(&legacy)).unwrap().notices, turned.notices);

    let glb = capture().write(ModelFormat::Gltf, &capture().positions).unwrap();
    // A GLB stores opacities as 32-bit floats, without a logarithm.
    let mut beyond = glb.clone();
    for (splat, opacity) in [(1, -0.25_f32), (4, 1.5)] {
        let stored = capture().splats().unwrap().opacities[splat].to_le_bytes();
        let mut places = (0..glb.len() - 3).filter(|&at| glb[at..at + 4] == stored);
        let at = places.next().unwrap();
        assert_eq!(places.next(), None, "no other number of the file has these bytes");
        beyond[at..at + 4].copy_from_slice(&opacity.to_le_bytes());
    }
    let clamped = read("a.glb", &beyond).unwrap();
    let opacities = &clamped.splats().unwrap().opacities;
    assert_eq!((opacities[1], opacities[4]), (0.0, 1.0));
    assert_eq!(clamped.notices, ["2 splats have an opacity outside 0 to 1: it is clamped"]);
    let renamed = |from: &str, to: &str| {
        let text: String = glb.iter().map(|&b| char::from(b)).collect();
        let bytes: Vec<u8> = text.replace(from, to).chars().map(|c| c as u8).collect();
        fault("a.glb", &bytes)
    };
    assert!(
        renamed("splatting:SCALE", "splatting:SCALF").contains("no attribute KHR_gaussian_splatting:SCALE")
    );
    assert!(
        renamed(
            r#""kernel":"ellipse","colorSpace":"srgb_rec709_display""#,
            r#""extensions":{"a":1},"colorSpace":"srgb_rec709_displ""#,
        )
        .contains("use a, which is not supported")
    );
    let cube = read("cube.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    assert_eq!(
        cube.write(ModelFormat::Spz, &cube.positions).unwrap_err().to_string(),
        "the model has no splats, but a SPZ stores nothing else: export GLB, OBJ, PLY, STL, OFF or 3MF"
    );
}

/// The colour space of a GLB is kept. Other formats store sRGB: converted by IEC 61966-2-1.
#[test]
fn linear_colours_are_kept_or_converted() {
    let glb = capture().write(ModelFormat::Gltf, &capture().positions).unwrap();
    let text: String = glb.iter().map(|&b| char::from(b)).collect();
    let linear = text.replace(r#""srgb_rec709_display""#, r#""lin_rec709_display" "#);
    let linear: Vec<u8> = linear.chars().map(|c| c as u8).collect();
    let model = read("a.glb", &linear).unwrap();
    assert_eq!(model.notices, ["the colours of the splats are linear: drawn too dark"]);
    let moved: Vec<Vec3> = model.positions.iter().map(|&p| p + Vec3::X).collect();
    let again = model.write(ModelFormat::Gltf, &moved).unwrap();
    let again: String = again.iter().map(|&b| char::from(b)).collect();
    assert!(again.contains(r#""colorSpace":"lin_rec709_display""#));
    assert_eq!(model.lost_in(ModelFormat::Gltf), None);
    let lost = model.lost_in(ModelFormat::Ply).unwrap();
    assert!(lost.contains("harmonics of linear colours are not converted"), "{lost}");
    let converted = read("a.ply", &model.write(ModelFormat::Ply, &model.positions).unwrap()).unwrap();
    let [before, after] = [&model, &converted].map(|model| model.splats().unwrap());
    for (before, after) in before.colors.iter().zip(&after.colors) {
        let srgb = |c: f32| if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
        assert!(after.abs_diff_eq(before.map(srgb), 1e-5), "{before}: {after}");
    }
}

/// The point colours of a GLB of splats are linear (glTF 2.0, section 3.9.2), and its harmonics are sRGB.
#[test]
fn fallback_colours_of_a_glb_are_linear() {
    let model = capture();
    let glb = model.write(ModelFormat::Gltf, &model.positions).unwrap();
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let json: serde_json::Value = serde_json::from_slice(&glb[20..20 + length]).unwrap();
    let accessor = json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"].as_u64().unwrap() as usize;
    let view = &json["bufferViews"][json["accessors"][accessor]["bufferView"].as_u64().unwrap() as usize];
    let start = 28 + length + view["byteOffset"].as_u64().unwrap() as usize;
    let splats = model.splats().unwrap();
    for (color, bytes) in splats.colors.iter().zip(glb[start..].chunks_exact(4)) {
        let linear = color.map(|c| if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) });
        for (expected, &byte) in linear.to_array().iter().zip(bytes) {
            assert!((255.0 * expected - f32::from(byte)).abs() < 0.51, "{expected} {byte}");
        }
    }
}
