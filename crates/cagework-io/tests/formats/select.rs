//! Selection of parts by name.

use cagework_io::SelectError;
use serde_json::json;

use crate::common::{instanced, read, rigged};

/// Five triangles. The fourth belongs to the first object but to no group, the fifth to another object.
const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 9 9 9\n\
    o body\ng left arm\nusemtl skin\nf 1 2 3\ng left leg\nusemtl cloth\nf 2 3 4\nf 1 3 4\n\
    g\nf 1 2 4\no hat\nusemtl skin\nf 4 3 2\n";

#[test]
fn materials_objects_and_groups_of_an_obj_are_selected_by_name() {
    let model = read("x.obj", OBJ.as_bytes()).unwrap();
    let select = |name: &str| model.select(name).unwrap();
    assert_eq!(select("group:arm"), [0, 1, 2]);
    assert_eq!(select("left arm"), [0, 1, 2], "the whole line");
    assert_eq!(select("leg"), [0, 1, 2, 3]);
    assert_eq!(select("hat"), [1, 2, 3]);
    assert_eq!(select("body"), [0, 1, 2, 3]);
    assert_eq!(select("material:cloth"), [0, 1, 2, 3]);
    let SelectError::Unknown { names, .. } = model.select("boot").unwrap_err() else { panic!() };
    let all = ["material:skin", "material:cloth", "group:body", "group:left arm", "group:left leg"];
    assert_eq!(names[..5], all);
}

#[test]
fn nodes_joints_and_materials_of_a_gltf_are_selected_by_name() {
    let mut rig = rigged();
    let material = rig.push("materials", json!({ "name": "middle" }));
    rig.primitive(0)["material"] = material.into();
    let model = read("x.glb", &rig.glb()).unwrap();
    let all: Vec<u32> = (0..20).collect();
    assert_eq!(model.select("bar").unwrap(), all);
    assert_eq!(model.select("joint:root").unwrap(), [0, 1, 2, 3, 4, 5, 6, 7], "the first joint wins ties");
    let error = model.select("middle").unwrap_err().to_string();
    assert_eq!(error, "several parts are called 'middle': write 'material:middle' or 'joint:middle'");
    assert_eq!(model.select("material:middle").unwrap(), all);
    assert_eq!(model.select("joint:middle").unwrap(), all[8..]);
    let error = model.select("nose").unwrap_err().to_string();
    let names = "material:middle, node:bar, joint:root, joint:middle, joint:tip";
    assert_eq!(error, format!("no part is called 'nose'; the model has {names}"));
}

#[test]
fn nodes_include_descendants_and_unnamed_parts_are_called_by_index() {
    let model = read("x.glb", &instanced().glb()).unwrap();
    let names = model.part_names();
    assert!(names.len() > 1, "{names:?}");
    let mut all = 0;
    for name in &names {
        all += model.select(name).unwrap().len();
    }
    assert_eq!(all, model.positions.len(), "{names:?}");
    let mut nameless = rigged();
    nameless.json["nodes"][4].as_object_mut().unwrap().shift_remove("name");
    let model = read("x.glb", &nameless.glb()).unwrap();
    assert_eq!(model.select("node 4").unwrap().len(), 20);
}

#[test]
fn largest_amount_wins_and_pieces_are_separate() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 0 0\nv 6 0 0\nv 5 1 0\ng a\nf 1 2 3\ng a b\nf 4 5 6\n";
    let model = read("x.obj", text.as_bytes()).unwrap();
    let parts = model.parts(&[("a".into(), 0.5), ("b".into(), 1.0)], &["a".into()]).unwrap();
    assert_eq!(parts.stays, [0.5, 0.5, 0.5, 1.0, 1.0, 1.0]);
    assert_eq!(parts.rigid, [[0, 1, 2], [3, 4, 5]]);
}
