//! Numbered fuzz inputs: files of every readable kind, with random damage.

use std::io::{Cursor, Read as _, Write as _};

use cagework_core::deform::OutsideVertex;
use cagework_core::mesh::Bounds;
use cagework_core::{Frames, PolygonMesh, Weights, subdivided_box};
use cagework_io::{ModelFormat, encode_pose, write_cage_obj, write_project, write_weights_npz, write_zip};
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use glam::{DVec3, Vec3};
use proptest::prelude::*;
use proptest::sample::{Index, select};
use proptest::strategy::ValueTree as _;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use serde_json::{Value, json};
use zip::ZipArchive;

use crate::common::{
    Builder, CUBE_OBJ, U8, cube, fbx, glb, instanced, json_of, package, plain_cube, plate, plate_parts,
    quantized, read, rigged, skinned, textured_square, twist,
};

/// A SOG of 240 splats with spherical harmonics of degree 1.
const SOG: &[u8] = include_bytes!("../../crates/cagework-io/tests/splats/helix.sog");

/// Number of GLB samples, which precede all other samples.
const N_GLB: usize = 7;

/// Generates numbered inputs from a seed.
pub(crate) struct Inputs {
    seed: u64,
    files: BoxedStrategy<Vec<u8>>,
}

impl Inputs {
    pub(crate) fn new(seed: u64) -> Self {
        Self { seed, files: files() }
    }

    /// The input with this number. It depends only on the seed and the number.
    pub(crate) fn get(&mut self, number: u64) -> Vec<u8> {
        let mut seed = [0; 32];
        seed[..8].copy_from_slice(&self.seed.to_le_bytes());
        seed[8..16].copy_from_slice(&number.to_le_bytes());
        let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &seed);
        let mut runner = TestRunner::new_with_rng(Config::default(), rng);
        self.files.new_tree(&mut runner).expect("nothing is filtered").current()
    }
}

/// Undamaged samples: small files of every kind, so that mutations reach most bytes.
pub(crate) fn samples() -> Vec<Vec<u8>> {
    let builders = [plain_cube(), textured_square(), instanced(), skinned(), quantized(), rigged(), shared()];
    let mut samples: Vec<Vec<u8>> = builders.iter().map(Builder::glb).collect();
    let model = read("cube.obj", CUBE_OBJ.as_bytes()).expect("the OBJ is valid");
    let bent: Vec<Vec3> = cube().into_iter().map(twist).collect();
    let weights = Weights::new(5, vec![0, 2, 2, 5], vec![0, 4, 1, 2, 3], vec![0.25, 0.75, 0.5, 0.375, 0.125]);
    let outside = OutsideVertex { vertex: 1, distance: 1.0, share: 0.5 };
    samples.push(CUBE_OBJ.as_bytes().to_vec());
    samples.push(
        write_project(&[&model, &model], &model.cage_mesh(), &[("bent".into(), bent.clone())], "{}")
            .expect("the project is small"),
    );
    samples.push(write_weights_npz(
        &weights.expect("the matrix is valid"),
        &Frames::default(),
        &[outside],
        &[Vec3::ONE],
        &[Vec3::ONE],
    ));
    // Weights of six cage vertices and two joints with a bone between them. Entries are in all kinds of columns: cage
    // vertices, joints and offsets of the frames.
    let frames = Frames {
        joints: vec![6, 7],
        bones: vec![[0, 1]],
        plain: vec![[0.25; 4]; 12],
        ..Frames::of_cage(&cube()[..6])
    };
    let n = 8 + frames.n_columns() as u32;
    let weights = Weights::new(n, vec![0, 3, 5], vec![0, 8, 11, 7, n - 1], vec![0.5, 0.25, 1.0, 0.75, 0.5]);
    samples.push(write_weights_npz(&weights.expect("the matrix is valid"), &frames, &[outside], &[], &[]));
    samples.push(encode_pose(&cube(), &bent));
    // A file of controls inside the cube: a polyline, a point and a face.
    samples.push(
        b"v .2 .2 .2\nv .5 .4 .5\nv .8 .2 .2\nv .3 .7 .5\nv .6 .7 .4\nv .5 .9 .6\nl 1 2 3\np -3\nf 4 5 6\n"
            .to_vec(),
    );
    samples.extend(cages().iter().map(|cage| write_cage_obj(cage, DVec3::ZERO)));
    let text = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n\
        property uchar green\nproperty uchar blue\nelement face 1\nproperty list uchar int vertex_index\nend_header\n\
        0 0 0 9 9 9\n1 0 0 9 9 9\n0 1 0 255 0 9\n3 0 1 2\n";
    samples.push(text.to_vec());
    samples.push(
        b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n"
            .to_vec(),
    );
    samples.push(model.write(ModelFormat::Ply, &model.positions).expect("positions are valid"));
    samples.push(model.write(ModelFormat::Stl, &model.positions).expect("it has triangles"));
    samples.push(model.write(ModelFormat::Off, &model.positions).expect("positions are valid"));
    samples.push(
        b"# c\nCOFF 3 1 0\n0 0 0 9 9 9 255\n1 0 0 9 9 9 255\n0 1 0 255 0 9 255\n3 0 1 2 1 0 0\n".to_vec(),
    );
    samples.push(plate());
    let capture = read("a.ply", &splats()).expect("the capture is valid");
    for format in ModelFormat::ALL.into_iter().filter(|format| format.holds_splats()) {
        samples.push(capture.write(format, &capture.positions).expect("the capture is valid"));
    }
    // SPZ 4 with compressed blocks, and with uncompressed blocks, in which damaged bytes change the decoded values.
    samples.push(include_bytes!("../../crates/cagework-io/tests/splats/helix-4.spz").to_vec());
    samples.push(include_bytes!("../../crates/cagework-io/tests/splats/six-4.spz").to_vec());
    samples.push(include_bytes!("../../crates/cagework-io/tests/splats/helix.compressed.ply").to_vec());
    samples.push(SOG.to_vec());
    samples
        .extend([fbx::placed(), fbx::rigged()].iter().flat_map(|file| [fbx::text(file), fbx::binary(file)]));
    samples
}

/// A text PLY of four splats with spherical harmonics of degree 1 and a property that is not read.
fn splats() -> Vec<u8> {
    let rest: String = (0..9).map(|k| format!("property float f_rest_{k}\n")).collect();
    let names = "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3 label";
    let others: String = names.split(' ').map(|name| format!("property float {name}\n")).collect();
    let numbers: String = (0..4 * 24).map(|k| format!("{} ", ((7 * k % 13) as f32 - 6.0) / 4.0)).collect();
    format!("ply\nformat ascii 1.0\nelement vertex 4\n{rest}{others}end_header\n{numbers}\n").into_bytes()
}

/// A file compressed by gzip, with damage to the uncompressed bytes.
fn gzip_damaged(gzipped: &[u8], damage: &[Damage]) -> Vec<u8> {
    let mut bytes = Vec::new();
    GzDecoder::new(gzipped).read_to_end(&mut bytes).expect("the sample is valid");
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(&damaged(bytes, damage)).expect("a Vec takes all bytes");
    encoder.finish().expect("a Vec takes all bytes")
}

/// A rig with shared data: a second mesh and clip with the same accessors, channels with one sampler, sparse positions.
fn shared() -> Builder {
    let mut rig = rigged();
    let (places, values) = (rig.view(&[0, 7]), rig.view(&[0; 24]));
    let position = rig.primitive(0)["attributes"]["POSITION"].as_u64().expect("it has positions") as usize;
    rig.json["accessors"][position]["sparse"] = json!({
        "count": 2,
        "indices": { "bufferView": places, "componentType": U8 },
        "values": { "bufferView": values },
    });
    for list in ["meshes", "animations"] {
        let again = rig.json[list][0].clone();
        rig.push(list, again);
    }
    rig.push("nodes", json!({ "mesh": 1, "skin": 0 }));
    rig.json["scenes"][0]["nodes"] = json!([0, 4, 5]);
    let channels = rig.json["animations"][0]["channels"].as_array_mut().expect("it moves");
    let mut other = channels[0].clone();
    other["target"]["node"] = 3.into();
    channels.push(other);
    rig
}

/// Closed meshes: quads, a concave polygon and a cavity.
pub(crate) fn cages() -> Vec<PolygonMesh> {
    let unit = Bounds { min: Vec3::ZERO, max: Vec3::ONE };
    let block = |shrink, divisions| subdivided_box(unit, shrink, [divisions; 3]);
    let l_shape = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)];
    let mut prism = PolygonMesh::default();
    for z in [0.0, 1.0] {
        prism.positions.extend(l_shape.map(|(x, y)| Vec3::new(x as f32, y as f32, z)));
    }
    prism.faces = vec![(0..6).rev().collect(), (6..12).collect()];
    prism.faces.extend((0..6).map(|k| vec![k, (k + 1) % 6, 6 + (k + 1) % 6, 6 + k]));
    let mut hollow = block(0.0, 1);
    let inner = block(-0.1, 1);
    hollow.positions.extend(inner.positions);
    hollow.faces.extend(inner.faces.into_iter().map(|f| f.into_iter().rev().map(|i| i + 8).collect()));
    vec![block(0.0, 1), block(0.0, 2), prism, hollow]
}

fn files() -> BoxedStrategy<Vec<u8>> {
    let samples = samples();
    let mut glbs = samples[..N_GLB].to_vec();
    glbs.extend(samples.iter().rev().find(|sample| sample.starts_with(b"glTF")).cloned());
    let gzipped =
        samples.iter().find(|sample| sample.starts_with(&[0x1f, 0x8b])).expect("one is an SPZ").clone();
    let texts: Vec<String> =
        cages().iter().map(|c| String::from_utf8(write_cage_obj(c, DVec3::ZERO)).expect("text")).collect();
    let magic: Vec<&[u8]> =
        vec![b"", b"glTF\x02\0\0\0", b"{\"asset\":{\"version\":\"2.0\"},", b"PK\x03\x04", b"v 0 0 0\nf "];
    prop_oneof![
        1 => (select(magic), prop::collection::vec(any::<u8>(), 0..300)).prop_map(|(magic, bytes)| [magic, &bytes].concat()),
        1 => prop::collection::vec("(v|vn|vt|f|usemtl|#|f|v) [-0-9./ e\\\\]{0,12}", 0..20)
            .prop_map(|lines| format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{}", lines.join("\n")).into_bytes()),
        4 => (select(samples), prop::collection::vec(damage(), 1..6)).prop_map(|(sample, damage)| damaged(sample, &damage)),
        3 => (select(glbs), prop::collection::vec((any::<Index>(), odd_value()), 1..4), any::<bool>())
            .prop_map(|(glb, changes, as_text)| odd_json(&glb, changes, as_text)),
        5 => (select(texts), prop::collection::vec(line_damage(), 1..6)).prop_map(|(text, damage)| damaged_lines(&text, &damage)),
        1 => prop::collection::vec(damage(), 1..6).prop_map(move |damage| gzip_damaged(&gzipped, &damage)),
        2 => (prop::collection::vec((any::<Index>(), odd_attribute()), 1..5), prop::collection::vec(damage(), 0..2))
            .prop_map(|(changes, damage)| odd_package(&changes, &damage)),
        2 => (any::<Index>(), prop::collection::vec(damage(), 1..4), prop::collection::vec((any::<Index>(), odd_value()), 1..3))
            .prop_map(|(file, damage, changes)| odd_sog(file, &damage, changes)),
        2 => soup(),
    ]
    .boxed()
}

/// A random change of a file's bytes.
#[derive(Clone, Debug)]
enum Damage {
    Set(Index, u8),
    Number(Index, f32),
    Cut(Index),
    Insert(Index, Vec<u8>),
    Repeat(Index, Index),
}

/// Bytes that have a meaning in text formats.
const SYNTAX: &[u8] = b"0123456789-.,/e \\\n{}[]\"";

fn damage() -> impl Strategy<Value = Damage> {
    prop_oneof![
        4 => (any::<Index>(), any::<u8>()).prop_map(|(at, b)| Damage::Set(at, b)),
        2 => (any::<Index>(), odd_number()).prop_map(|(at, x)| Damage::Number(at, x)),
        1 => any::<Index>().prop_map(Damage::Cut),
        2 => (any::<Index>(), prop::collection::vec(prop_oneof![any::<u8>(), select(SYNTAX)], 1..5))
            .prop_map(|(at, bytes)| Damage::Insert(at, bytes)),
        1 => (any::<Index>(), any::<Index>()).prop_map(|(a, b)| Damage::Repeat(a, b)),
    ]
}

fn damaged(mut bytes: Vec<u8>, damage: &[Damage]) -> Vec<u8> {
    for d in damage {
        let n = bytes.len();
        if n < 4 {
            break;
        }
        match d {
            Damage::Set(at, b) => bytes[at.index(n)] = *b,
            Damage::Number(at, x) => {
                let at = at.index(n / 4) * 4;
                bytes[at..at + 4].copy_from_slice(&x.to_le_bytes());
            }
            Damage::Cut(at) => bytes.truncate(at.index(n)),
            Damage::Insert(at, new) => {
                let at = at.index(n);
                bytes.splice(at..at, new.iter().copied());
            }
            Damage::Repeat(a, b) => {
                let (a, b) = (a.index(n), b.index(n));
                let part = bytes[a.min(b)..a.max(b)].to_vec();
                bytes.splice(a..a, part);
            }
        }
    }
    bytes
}

/// Coordinates of all magnitudes, and values that make vertices coincide.
fn odd_number() -> impl Strategy<Value = f32> {
    prop_oneof![
        3 => -2.0_f32..3.0,
        3 => select(vec![0.0, 1.0, 0.5, -1.0, 1e-7, 1.000_001, -0.0]),
        2 => (-45..39_i32, prop::bool::ANY).prop_map(|(e, minus)| if minus { -(10_f32.powi(e)) } else { 10_f32.powi(e) }),
        1 => -3e6_f32..3e6,
        1 => select(vec![f32::NAN, f32::INFINITY, f32::MAX, f32::MIN_POSITIVE]),
    ]
}

/// A random change of the lines of an OBJ file.
#[derive(Clone, Debug)]
enum LineDamage {
    Word(Index, Index, String),
    Swap(Index, Index),
    Drop(Index),
    Repeat(Index, Index),
}

fn line_damage() -> impl Strategy<Value = LineDamage> {
    let word = prop_oneof![
        4 => odd_number().prop_map(|x| x.to_string()),
        3 => (-4..30_i32).prop_map(|i| i.to_string()),
        1 => "[-0-9./ev\\\\]{0,4}",
    ];
    prop_oneof![
        6 => (any::<Index>(), any::<Index>(), word).prop_map(|(line, at, word)| LineDamage::Word(line, at, word)),
        2 => (any::<Index>(), any::<Index>()).prop_map(|(a, b)| LineDamage::Swap(a, b)),
        1 => any::<Index>().prop_map(LineDamage::Drop),
        1 => (any::<Index>(), any::<Index>()).prop_map(|(a, b)| LineDamage::Repeat(a, b)),
    ]
}

fn damaged_lines(text: &str, damage: &[LineDamage]) -> Vec<u8> {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for d in damage {
        let n = lines.len();
        match d {
            LineDamage::Word(line, at, word) => {
                let line = &mut lines[line.index(n)];
                let mut words: Vec<&str> = line.split(' ').collect();
                let at = at.index(words.len());
                words[at] = word;
                *line = words.join(" ");
            }
            LineDamage::Swap(a, b) => lines.swap(a.index(n), b.index(n)),
            LineDamage::Drop(at) if n > 1 => {
                lines.remove(at.index(n));
            }
            LineDamage::Drop(_) => {}
            LineDamage::Repeat(a, b) => lines.insert(a.index(n), lines[b.index(n)].clone()),
        }
    }
    lines.join("\n").into_bytes()
}

/// Random faces between a few points, some of them coincident.
fn soup() -> impl Strategy<Value = Vec<u8>> {
    let coordinate =
        prop_oneof![6 => (0..4_i32).prop_map(|x| x as f32), 3 => -2.0_f32..2.0, 1 => odd_number()];
    let points = prop::collection::vec(prop::array::uniform3(coordinate), 4..20);
    let faces = prop::collection::vec(prop::collection::vec(any::<Index>(), 3..7), 1..30);
    (points, faces).prop_map(|(points, faces)| {
        let corner = |i: &Index| i.index(points.len()) as u32;
        let faces = faces.iter().map(|f| f.iter().map(corner).collect()).collect();
        write_cage_obj(
            &PolygonMesh { positions: points.iter().map(|&p| p.into()).collect(), faces },
            DVec3::ZERO,
        )
    })
}

/// JSON pointers to all values and lists of a document.
fn places(value: &Value, path: &str, out: &mut Vec<String>) {
    match value {
        Value::Object(object) => {
            for (key, value) in object {
                places(value, &format!("{path}/{}", key.replace('~', "~0").replace('/', "~1")), out);
            }
        }
        Value::Array(items) => {
            out.push(path.to_owned());
            items.iter().enumerate().for_each(|(i, item)| places(item, &format!("{path}/{i}"), out));
        }
        _ => out.push(path.to_owned()),
    }
}

fn odd_value() -> impl Strategy<Value = Value> {
    prop_oneof![
        (0_u64..12).prop_map(Value::from),
        select(vec![
            json!(-1),
            json!(u64::MAX),
            json!(u32::MAX),
            json!(1e38),
            json!(-0.0),
            json!(null),
            json!([]),
            json!({}),
            json!("x"),
            json!([0, 0, 0]),
            json!(5126),
            json!(5121),
            json!("VEC3"),
            json!("SCALAR"),
        ]),
    ]
}

/// Replaces values of a document.
fn change(json: &mut Value, changes: Vec<(Index, Value)>) {
    for (at, value) in changes {
        let mut paths = Vec::new();
        places(json, "", &mut paths);
        let Some(place) = paths.get(at.index(paths.len().max(1))) else { break };
        *json.pointer_mut(place).expect("the pointer is valid") = value;
    }
}

/// The SOG with a damaged image, or with mutated values of its document.
fn odd_sog(file: Index, damage: &[Damage], changes: Vec<(Index, Value)>) -> Vec<u8> {
    let mut archive = ZipArchive::new(Cursor::new(SOG)).expect("the sample is valid");
    let mut files = Vec::new();
    for k in 0..archive.len() {
        let (mut entry, mut bytes) = (archive.by_index(k).expect("the sample is valid"), Vec::new());
        entry.read_to_end(&mut bytes).expect("the sample is valid");
        files.push((entry.name().expect("it is UTF-8").into_owned(), bytes));
    }
    let n = files.len();
    let (name, bytes) = &mut files[file.index(n)];
    if name == "meta.json" {
        let mut json: Value = serde_json::from_slice(bytes).expect("the sample is valid");
        // Without the codebooks, which have most of the values.
        let codebooks = ["scales", "sh0", "shN"].map(|name| json[name]["codebook"].take());
        change(&mut json, changes);
        for (name, codebook) in ["scales", "sh0", "shN"].into_iter().zip(codebooks) {
            if let Some(of) = json.get_mut(name).and_then(|part| part.get_mut("codebook")) {
                *of = codebook;
            }
        }
        *bytes = json.to_string().into_bytes();
    } else {
        *bytes = damaged(std::mem::take(bytes), damage);
    }
    write_zip(&files).expect("the names differ")
}

/// A GLB with mutated JSON values; with `as_text`, a glTF with an external buffer.
fn odd_json(sample: &[u8], changes: Vec<(Index, Value)>, as_text: bool) -> Vec<u8> {
    let mut json = json_of(sample);
    if as_text {
        json["buffers"][0]["uri"] = sample_name(sample).into();
    }
    change(&mut json, changes);
    if as_text { json.to_string().into_bytes() } else { glb(&json, Some(bin_of(sample))) }
}

fn odd_attribute() -> impl Strategy<Value = String> {
    prop_oneof![
        3 => (-1..12_i64).prop_map(|x| x.to_string()),
        1 => odd_number().prop_map(|x| x.to_string()),
        1 => "[-0-9. e/#&;a]{0,9}",
        1 => select(vec!["4294967295", "2147483647", "/3D/Objects/b.model", "3D/3dmodel.model", "1 0 0 0 1 0 0 0 1 0 0 0"])
            .prop_map(str::to_owned),
    ]
}

/// The 3MF of [`plate`] with changed attributes in its first part and damaged bytes in its second one.
fn odd_package(changes: &[(Index, String)], damage: &[Damage]) -> Vec<u8> {
    let [(root, first), (other, second)] = plate_parts();
    // Of the pieces of the XML between quotes, every second one is the value of an attribute.
    let mut pieces: Vec<&str> = first.split('"').collect();
    for (at, value) in changes {
        let n = pieces.len() / 2;
        pieces[2 * at.index(n) + 1] = value.as_str();
    }
    let second = String::from_utf8_lossy(&damaged(second.into_bytes(), damage)).into_owned();
    package(&[(root, pieces.join("\"")), (other, second)])
}

/// Name of a sample's external buffer. It contains the length of the sample, which differs for all samples.
fn sample_name(sample: &[u8]) -> String {
    format!("{}.bin", sample.len())
}

/// Binary chunk of a GLB.
fn bin_of(glb: &[u8]) -> &[u8] {
    let json = u32::from_le_bytes([glb[12], glb[13], glb[14], glb[15]]) as usize;
    &glb[28 + json..]
}

/// The external buffer with this name; `None` if no GLB sample has this name.
pub(crate) fn beside(samples: &[Vec<u8>], name: &str) -> Option<Vec<u8>> {
    samples[..N_GLB].iter().find(|s| sample_name(s) == name).map(|s| bin_of(s).to_vec())
}
