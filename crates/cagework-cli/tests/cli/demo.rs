use crate::support::{Sandbox, glb_json, obj_positions};

#[test]
fn demo_writes_every_file_that_it_lists() {
    let sandbox = Sandbox::new();
    let done = sandbox.json("demo -o new/folder --json");
    for file in done["files"].as_array().unwrap() {
        assert!(sandbox.path(file.as_str().unwrap()).is_file(), "{file} is missing");
    }
    let document = glb_json(&sandbox.read("new/folder/poses.glb"));
    assert_eq!(document["meshes"][0]["primitives"][0]["targets"].as_array().unwrap().len(), 2);
    let report = &done["report"];
    let sample = obj_positions(&sandbox.read("new/folder/rat.obj")).len();
    assert_eq!(report["vertices"], sample);
    assert_eq!(report["cage_vertices"], obj_positions(&sandbox.read("new/folder/cage.obj")).len());
    assert_eq!(report["outside_vertices"], 0);
    assert_eq!(report["converged"], true);
}
