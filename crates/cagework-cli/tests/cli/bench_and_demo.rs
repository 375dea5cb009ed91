use predicates::prelude::*;
use predicates::str::contains;

use crate::support::{Sandbox, glb_json, obj_positions};

#[test]
fn bench_times_both_methods_on_one_thread_and_on_all() {
    let sandbox = Sandbox::with_sphere_in_box();
    let bench = sandbox.json("bench mesh.obj --cage cage.obj -g 8,16 --runs 2 --json");
    let grids = bench["grids"].as_array().unwrap();
    assert_eq!(grids.len(), 2);
    for grid in grids {
        let cases = grid["cases"].as_array().unwrap();
        let kinds: Vec<_> =
            cases.iter().map(|c| (c["method"].as_str().unwrap(), c["threads"] == 1)).collect();
        assert_eq!(kinds.iter().filter(|(method, _)| *method == "classic").count(), 2);
        assert_eq!(kinds.len(), 4);
        for case in cases {
            assert!(case["median_ms"]["total"].as_f64().unwrap() > 0.0);
        }
        assert!(grid["ratios"]["classic_over_embedded_one_thread"].as_f64().unwrap() > 0.0);
    }
    sandbox
        .run("bench mesh.obj --cage cage.obj -g 8 --runs 1")
        .success()
        .stdout(contains("embedded multigrid").and(contains("times as fast")));
}

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
