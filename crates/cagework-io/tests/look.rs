//! What a preview shows of a document.

#![allow(clippy::unwrap_used, reason = "helpers of tests, outside the test functions")]

mod common;

use cagework_io::{LookAlpha, LookWrap, Model};
use common::{CUBE_OBJ, PNG, plain_cube, read, textured_square};
use serde_json::json;

fn square(change: impl FnOnce(&mut serde_json::Value)) -> Model {
    let mut builder = textured_square();
    change(&mut builder.json);
    Model::read("square.glb", &builder.glb(), &mut |uri| (uri == "red dot.png").then(|| PNG.to_vec()))
        .unwrap()
}

#[test]
fn texture_and_material_of_the_document_are_shown() {
    let look = square(|json| {
        json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([1.0, 0.5, 0.25, 0.5]);
        json["materials"][0]["alphaMode"] = json!("MASK");
        json["samplers"] = json!([{ "wrapS": 33071, "wrapT": 33648 }]);
        json["textures"][0]["sampler"] = json!(0);
    })
    .look();
    let group = &look.groups[0];
    assert_eq!((group.base_color, group.alpha), (Some([1.0, 0.5, 0.25, 0.5]), LookAlpha::Mask(0.5)));
    let texture = &look.textures[group.texture.unwrap() as usize];
    assert_eq!((&texture.bytes[..], texture.mime.as_str()), (&PNG[..], "image/png"));
    assert_eq!(texture.wrap, [LookWrap::Clamp, LookWrap::Mirror]);
}

#[test]
fn texture_transform_moves_coordinates() {
    let plain = square(|_| {}).look();
    let moved = square(|json| {
        json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
            json!({ "KHR_texture_transform": { "offset": [0.5, 0.25], "scale": [2.0, 3.0] } });
    })
    .look();
    for (a, b) in plain.corners.iter().zip(&moved.corners) {
        assert_eq!(b.uv, [2.0 * a.uv[0] + 0.5, 3.0 * a.uv[1] + 0.25]);
    }
}

#[test]
fn missing_or_damaged_looks_do_not_refuse_the_model() {
    let look = square(|json| {
        json["textures"][0]["source"] = json!(99);
        json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!("red");
    })
    .look();
    assert_eq!((look.groups[0].texture, look.groups[0].base_color), (None, Some([1.0; 4])));
    let bare = read("cube.glb", &plain_cube().glb()).unwrap().look();
    assert_eq!((bare.groups[0].base_color, bare.textures.len()), (None, 0));
}

#[test]
fn corners_of_an_obj_are_its_distinct_texture_coordinates() {
    let model = read("box.obj", CUBE_OBJ.as_bytes()).unwrap();
    let look = model.look();
    assert_eq!(look.triangles.len(), model.triangles.len());
    for (drawn, bound) in look.triangles.iter().zip(&model.triangles) {
        assert_eq!(drawn.map(|c| look.corners[c as usize].source), *bound);
    }
}
