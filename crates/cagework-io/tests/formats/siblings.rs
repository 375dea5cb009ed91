//! External files of a model.

use std::collections::HashMap;

use cagework_io::Model;
use serde_json::json;

use crate::common::{self, PNG, json_of, read, textured_square};

#[test]
fn file_with_many_references_is_requested_and_stored_once() {
    const TIMES: usize = 1000;
    let mut requests: HashMap<String, usize> = HashMap::new();
    let mut files = |name: &str| {
        *requests.entry(name.to_owned()).or_default() += 1;
        Some(Ok(if name == "dot.png" { PNG.to_vec() } else { b"newmtl a\nmap_Kd dot.png\n".repeat(TIMES) }))
    };
    let mut b = textured_square();
    b.json["images"] = json!(vec![json!({ "uri": "dot.png" }); TIMES]);
    b.json["textures"] = (0..TIMES).map(|source| json!({ "source": source })).collect();
    b.json["materials"] = (0..TIMES)
        .map(|t| json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": t } } }))
        .collect();
    let primitive = b.primitive(0).clone();
    b.json["meshes"][0]["primitives"] = (0..TIMES)
        .map(|material| {
            let mut primitive = primitive.clone();
            primitive["material"] = material.into();
            primitive
        })
        .collect();
    let mut buffers = vec![json!({ "byteLength": b.bin.len() })];
    buffers.resize(TIMES, json!({ "byteLength": PNG.len(), "uri": "dot.png" }));
    b.json["buffers"] = json!(buffers);
    let gltf = Model::read("x.glb", &common::glb(&b.json, Some(&b.bin)), &mut files).unwrap();
    let look = gltf.look();
    assert_eq!((look.images.len(), look.groups.len()), (1, TIMES));
    let glb = gltf.write_glb(&gltf.positions).unwrap();
    assert_eq!(glb.windows(PNG.len()).filter(|w| *w == PNG).count(), 1);
    let json = json_of(&glb);
    let views: Vec<_> = json["images"].as_array().unwrap().iter().map(|image| &image["bufferView"]).collect();
    assert!(views.len() == TIMES && views.iter().all(|view| view.is_u64() && *view == views[0]));

    let obj = "mtllib paint.mtl\n".repeat(TIMES) + "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
    let obj = Model::read("x.obj", obj.as_bytes(), &mut files).unwrap();
    assert_eq!(obj.look().images.len(), 1);
    // Each of the two models requests dot.png once.
    assert_eq!(requests, HashMap::from([("dot.png".to_owned(), 2), ("paint.mtl".to_owned(), 1)]));
}

#[test]
fn unavailable_file_causes_one_notice() {
    let mut b = textured_square();
    b.json["images"] = json!(vec![json!({ "uri": "a.png" }); 3]);
    let mut refuse = |_: &str| Some(Err("is a folder".to_owned()));
    let model = Model::read("x.glb", &b.glb(), &mut refuse).unwrap();
    assert_eq!(model.notices, ["texture 'a.png' is a folder: exports keep the reference"]);
    let obj = "mtllib a.mtl\nmtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let model = Model::read("x.obj", obj.as_bytes(), &mut refuse).unwrap();
    assert_eq!(model.notices, ["material file 'a.mtl' is a folder: its materials are not drawn"]);
}

#[test]
fn external_files_have_a_total_limit() {
    // Three files of this size exceed 2 GiB together. Zeros that are never written take no memory.
    const BYTES: usize = 800 << 20;
    let mut b = textured_square();
    b.json["images"] = json!([{ "uri": "a" }, { "uri": "b" }, { "uri": "c" }]);
    let model = Model::read("x.glb", &b.glb(), &mut |_| Some(Ok(vec![0; BYTES]))).unwrap();
    assert!(model.notices[1].contains("'b' is not a PNG"), "{:?}", model.notices);
    let expected = "'c' exceeds the limit of 2048 MiB for all files of a model";
    assert!(model.notices[2].contains(expected), "{:?}", model.notices);
}

#[test]
fn invalid_image_in_a_buffer_view_is_a_notice() {
    let mut b = textured_square();
    let view = b.view(b"TOP-SECRET");
    b.json["images"] = json!([{ "bufferView": view, "mimeType": "image/png" }]);
    let model = read("x.glb", &b.glb()).unwrap();
    assert_eq!(model.notices, ["image 0 is not a PNG, JPEG, WebP or KTX2 image: it is not drawn"]);
    assert_eq!(model.look().images.len(), 0);
}
