//! Files that a model names.

#![allow(clippy::unwrap_used, reason = "helpers of tests, outside the test functions")]

mod common;

use std::collections::HashMap;

use cagework_io::Model;
use common::{PNG, json_of, read, textured_square};
use serde_json::json;

/// A thousand images, buffers or materials of one file of 10 MB took 10 GB.
#[test]
fn file_that_is_named_often_is_asked_for_and_kept_once() {
    const TIMES: usize = 1000;
    let mut asked: HashMap<String, usize> = HashMap::new();
    let mut files = |name: &str| {
        *asked.entry(name.to_owned()).or_default() += 1;
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
    // Once for each model.
    assert_eq!(asked, HashMap::from([("dot.png".to_owned(), 2), ("paint.mtl".to_owned(), 1)]));
}

#[test]
fn what_is_wrong_with_a_file_is_said_once() {
    let mut b = textured_square();
    b.json["images"] = json!(vec![json!({ "uri": "a.png" }); 3]);
    let mut refuse = |_: &str| Some(Err("is a folder".to_owned()));
    let model = Model::read("x.glb", &b.glb(), &mut refuse).unwrap();
    assert_eq!(model.notices, ["texture 'a.png' is a folder: exports keep the reference"]);
    let obj = "mtllib a.mtl\nmtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let model = Model::read("x.obj", obj.as_bytes(), &mut refuse).unwrap();
    assert_eq!(model.notices, ["material file 'a.mtl' is a folder: it is left out"]);
}

/// One file was limited, but not how many a model has of them.
#[test]
fn all_files_of_a_model_have_a_limit() {
    // Three are more than 2 GiB. They are zeros that nobody touches: they take no memory.
    const BYTES: usize = 800 << 20;
    let mut b = textured_square();
    b.json["images"] = json!([{ "uri": "a" }, { "uri": "b" }, { "uri": "c" }]);
    let model = Model::read("x.glb", &b.glb(), &mut |_| Some(Ok(vec![0; BYTES]))).unwrap();
    assert!(model.notices[1].contains("'b' is no PNG"), "{:?}", model.notices);
    let said = "'c' is too large: all files that a model names may have 2048 MiB";
    assert!(model.notices[2].contains(said), "{:?}", model.notices);
}

#[test]
fn image_in_a_buffer_view_that_is_none_is_a_notice() {
    let mut b = textured_square();
    let view = b.view(b"TOP-SECRET");
    b.json["images"] = json!([{ "bufferView": view, "mimeType": "image/png" }]);
    let model = read("x.glb", &b.glb()).unwrap();
    assert_eq!(model.notices, ["image 0 is no PNG, JPEG, WebP or KTX2 image: it is not drawn"]);
    assert_eq!(model.look().images.len(), 0);
}
