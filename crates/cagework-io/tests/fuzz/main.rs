//! Random and damaged input: always a model or an error, never a panic, never minutes.

mod common;

use cagework_core::Weights;
use cagework_core::bind::OutsideVertex;
use cagework_io::{Model, read_weights_npz, write_weights_npz};
use common::{
    CUBE_OBJ, glb, instanced, json_of, plain_cube, quantized, read, skinned, textured_square, twist,
};
use glam::Vec3;
use proptest::prelude::*;
use proptest::sample::Index;
use serde_json::{Value, json};

/// One change to a file.
#[derive(Clone, Debug)]
enum Damage {
    Set(Index, u8),
    Cut(Index),
    Insert(Index, Vec<u8>),
    Repeat(Index, Index),
}

/// Bytes that mean something to a parser.
const SYNTAX: &[u8] = b"0123456789-.,/e \\\n{}[]\"";

fn damage() -> impl Strategy<Value = Vec<Damage>> {
    let one = prop_oneof![
        4 => (any::<Index>(), any::<u8>()).prop_map(|(at, b)| Damage::Set(at, b)),
        1 => any::<Index>().prop_map(Damage::Cut),
        2 => (any::<Index>(), prop::collection::vec(prop_oneof![any::<u8>(), prop::sample::select(SYNTAX)], 1..5))
            .prop_map(|(at, bytes)| Damage::Insert(at, bytes)),
        1 => (any::<Index>(), any::<Index>()).prop_map(|(a, b)| Damage::Repeat(a, b)),
    ];
    prop::collection::vec(one, 1..6)
}

fn damaged(mut bytes: Vec<u8>, damage: &[Damage]) -> Vec<u8> {
    for d in damage {
        if bytes.is_empty() {
            break;
        }
        match d {
            Damage::Set(at, b) => {
                let at = at.index(bytes.len());
                bytes[at] = *b;
            }
            Damage::Cut(at) => bytes.truncate(at.index(bytes.len())),
            Damage::Insert(at, new) => {
                let at = at.index(bytes.len());
                bytes.splice(at..at, new.iter().copied());
            }
            Damage::Repeat(a, b) => {
                let (a, b) = (a.index(bytes.len()), b.index(bytes.len()));
                let part = bytes[a.min(b)..a.max(b)].to_vec();
                bytes.splice(a..a, part);
            }
        }
    }
    bytes
}

fn samples() -> Vec<Vec<u8>> {
    vec![
        plain_cube().glb(),
        textured_square().glb(),
        instanced().glb(),
        skinned().glb(),
        quantized().glb(),
        CUBE_OBJ.as_bytes().to_vec(),
    ]
}

/// Reads, and exports what could be read: both may fail, neither may panic; a GLB that was written can be read.
fn try_everything(bytes: &[u8]) {
    let Ok(model) = read("x", bytes) else { return };
    assert!(model.positions.iter().all(|p| p.is_finite()));
    assert!(model.triangles.iter().flatten().all(|&v| (v as usize) < model.positions.len()));
    let moved: Vec<Vec3> = model.positions.iter().map(|&p| twist(p.clamp_length_max(1e6))).collect();
    let _ = model.cage_mesh();
    let _ = model.write_obj(&moved);
    if let Ok(glb) = model.write_glb_poses(&model.positions, &[("moved".into(), moved)]) {
        let again = Model::read("y.glb", &glb, &mut |_| None);
        assert!(again.is_ok(), "{}", again.err().map(|e| e.to_string()).unwrap_or_default());
    }
}

/// Every number and list of a document, as paths.
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
        prop::sample::select(vec![
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

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes_are_survived(bytes in prop::collection::vec(any::<u8>(), 0..300), magic in 0..4) {
        let magic: &[u8] = [&b""[..], b"glTF\x02\0\0\0", b"{\"asset\":{\"version\":\"2.0\"},", b"v 0 0 0\nf "][magic as usize];
        try_everything(&[magic, &bytes].concat());
        let _ = read_weights_npz(&bytes);
    }

    #[test]
    fn damaged_files_are_survived(which in any::<Index>(), damage in damage()) {
        let samples = samples();
        try_everything(&damaged(which.get(&samples).clone(), &damage));
    }

    #[test]
    fn odd_values_in_the_json_are_survived(which in 0..5_usize, changes in prop::collection::vec((any::<Index>(), odd_value()), 1..4)) {
        let sample = &samples()[which];
        let mut json = json_of(sample);
        for (at, value) in changes {
            let mut paths = Vec::new();
            places(&json, "", &mut paths);
            *json.pointer_mut(&paths[at.index(paths.len())]).unwrap() = value;
        }
        let json_length = u32::from_le_bytes(sample[12..16].try_into().unwrap()) as usize;
        try_everything(&glb(&json, Some(&sample[28 + json_length..])));
    }

    #[test]
    fn lines_of_numbers_and_slashes_are_survived(lines in prop::collection::vec("(v|vn|vt|f|usemtl|#|f|v) [-0-9./ e\\\\]{0,12}", 0..20)) {
        try_everything(format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{}", lines.join("\n")).as_bytes());
    }

    #[test]
    fn polygons_of_any_shape_are_survived(points in prop::collection::vec(prop::array::uniform3(-1e3_f32..1e3), 3..40)) {
        let mut text = String::new();
        for [x, y, z] in &points {
            text += &format!("v {x} {y} {z}\n");
        }
        text += "f";
        (1..=points.len()).for_each(|i| text += &format!(" {i}"));
        prop_assert_eq!(read("x.obj", text.as_bytes()).unwrap().triangles.len(), points.len() - 2);
    }

    #[test]
    fn damaged_weights_are_survived(damage in damage()) {
        let weights = Weights::new(5, vec![0, 2, 2, 5], vec![0, 4, 1, 2, 3], vec![0.25, 0.75, 0.5, 0.375, 0.125]).unwrap();
        let outside = OutsideVertex { vertex: 2, corners: [1, 2, 4], offset: Vec3::ONE };
        let _ = read_weights_npz(&damaged(write_weights_npz(&weights, &[outside]), &damage));
    }
}
