use predicates::prelude::*;
use predicates::str::contains;
use serde_json::Value;

use crate::support::{CORNERS, Sandbox, assert_close, box_obj, obj_positions, sphere_obj};

/// Tolerance of rest positions, far above the f32 rounding of a weighted sum of at most 98 coordinates near 1.
const REST_TOLERANCE: f64 = 1e-4;

/// Keys that every bind report must contain, because scripts rely on them.
const REPORT_KEYS: &[&str] = &[
    "/method",
    "/solver",
    "/backend",
    "/threads",
    "/grid",
    "/cells/interior",
    "/cells/boundary",
    "/cells/exterior",
    "/iterations",
    "/converged",
    "/delta_history",
    "/timings_ms/voxelize",
    "/timings_ms/solve",
    "/timings_ms/sample",
    "/timings_ms/total",
    "/memory_bytes/estimated",
    "/memory_bytes/peak",
    "/rest_error/mean",
    "/rest_error/p99",
    "/rest_error/max",
    "/rest_error/mean_rel",
    "/rest_error/max_rel",
    "/weights/min",
    "/weights/max_sum_error",
    "/weights/nonzeros",
    "/outside_vertices",
    "/ambiguous_cells",
];

fn number(report: &Value, pointer: &str) -> f64 {
    report.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("{pointer} is not a number"))
}

#[test]
fn report_has_every_guaranteed_key() {
    let sandbox = Sandbox::with_sphere_in_box();
    for options in ["", "--solver jacobi", "--method classic", "--method classic --solver multigrid"] {
        let report = sandbox.json(&format!("bind mesh.obj --cage cage.obj -g 16 --json {options}"));
        for key in REPORT_KEYS {
            assert!(
                report.pointer(key).is_some_and(|value| !value.is_null()),
                "{key} is missing ({options})"
            );
        }
        assert_eq!(report["converged"], true, "{options}");
        assert_eq!(report["grid"], 16);
        assert_eq!(report["outside_vertices"], 0);
        let history = report["delta_history"].as_array().unwrap();
        assert_eq!(history.len() as u64, report["iterations"].as_u64().unwrap(), "{options}");
    }
}

#[test]
fn default_solver_is_jacobi_for_classic_and_multigrid_for_embedded() {
    let sandbox = Sandbox::with_sphere_in_box();
    let classic = sandbox.json("bind mesh.obj --cage cage.obj -g 8 --method classic --json");
    assert_eq!([&classic["method"], &classic["solver"]], ["classic", "jacobi"]);
    let embedded = sandbox.json("bind mesh.obj --cage cage.obj -g 8 --json");
    assert_eq!([&embedded["method"], &embedded["solver"]], ["embedded", "multigrid"]);
}

#[test]
fn report_in_a_file_and_on_stdout_have_the_same_keys() {
    let sandbox = Sandbox::with_sphere_in_box();
    let printed = sandbox.json("bind mesh.obj --cage cage.obj -g 8 --report -");
    assert_eq!(printed["grid"], 8);
    sandbox
        .run("bind mesh.obj --cage cage.obj -g 8 --report r.json")
        .success()
        .stdout(contains("bound 178 vertices to 8 cage vertices").and(contains("wrote r.json")));
    let written: Value = serde_json::from_slice(&sandbox.read("r.json")).unwrap();
    let keys = |value: &Value| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    assert_eq!(keys(&written), keys(&printed));
}

#[test]
fn rest_pose_is_reconstructed() {
    let sandbox = Sandbox::with_sphere_in_box();
    let report = sandbox.json("bind mesh.obj --cage cage.obj -g 16 -o rest.obj --json");
    assert!(number(&report, "/rest_error/max_rel") <= 5e-5, "default method");
    assert!(number(&report, "/weights/min") >= -1e-6);
    assert!(number(&report, "/weights/max_sum_error") <= 1e-5);
    let mesh = obj_positions(&sandbox.read("mesh.obj"));
    assert_close(&obj_positions(&sandbox.read("rest.obj")), &mesh, REST_TOLERANCE);
}

#[test]
fn runs_are_bit_identical() {
    let sandbox = Sandbox::with_sphere_in_box();
    for threads in [0, 1] {
        let args = format!("bind mesh.obj --cage cage.obj -g 16 --threads {threads} --weights");
        sandbox.run(&format!("{args} first.npz")).success();
        sandbox.run(&format!("{args} second.npz")).success();
        assert_eq!(sandbox.read("first.npz"), sandbox.read("second.npz"), "with {threads} threads");
    }
}

#[test]
fn sparsify_removes_weights_and_keeps_the_rest_pose() {
    let sandbox = Sandbox::with_sphere_in_box();
    let dense = sandbox.json("bind mesh.obj --cage box:4 -g 16 --json");
    let sparse = sandbox.json("bind mesh.obj --cage box:4 -g 16 --sparsify 1e-3 -o rest.obj --json");
    assert!(number(&sparse, "/weights/nonzeros") < number(&dense, "/weights/nonzeros"));
    let mesh = obj_positions(&sandbox.read("mesh.obj"));
    assert_close(&obj_positions(&sandbox.read("rest.obj")), &mesh, REST_TOLERANCE);
}

#[test]
fn box_cage_is_generated_and_saved() {
    let sandbox = Sandbox::with_sphere_in_box();
    let report = sandbox.json("bind mesh.obj --cage box:3 --save-cage box.obj -g 8 --json");
    // A cube with n divisions has (n + 1)^3 - (n - 1)^3 lattice points on its surface: 56 for n = 3.
    assert_eq!(report["cage_vertices"], 56);
    assert_eq!(obj_positions(&sandbox.read("box.obj")).len(), 56);
    let again = sandbox.json("bind mesh.obj --cage box.obj -g 8 --json");
    assert_eq!(again["cage_vertices"], 56);
}

#[test]
fn inside_out_cage_is_flipped_with_a_notice() {
    let sandbox = Sandbox::with_sphere_in_box();
    // Reflect the cage, so that its faces point inwards.
    sandbox.write("cage.obj", box_obj(&CORNERS.map(|[x, y, z]| [-x, y, z])));
    sandbox
        .run("bind mesh.obj --cage cage.obj -g 8")
        .success()
        .stdout(contains("note: ").and(contains("inside out")));
}

#[test]
fn reaching_the_iteration_limit_is_a_warning() {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox
        .run("bind mesh.obj --cage cage.obj -g 16 --method classic --max-iterations 2")
        .success()
        .stdout(contains("warning: ").and(contains("NOT converged")));
    let report =
        sandbox.json("bind mesh.obj --cage cage.obj -g 16 --method classic --max-iterations 2 --json");
    assert_eq!(report["converged"], false);
    assert_eq!(report["iterations"], 2);
}

#[test]
fn vertices_outside_the_cage_are_counted_and_stay_in_place() {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.write("mesh.obj", sphere_obj(1.2));
    let report = sandbox.json("bind mesh.obj --cage cage.obj -g 16 -o rest.obj --json");
    let mesh = obj_positions(&sandbox.read("mesh.obj"));
    let outside = mesh.iter().filter(|p| p.iter().any(|x| x.abs() > 1.0)).count();
    assert!(outside > 0);
    assert_eq!(report["outside_vertices"], outside);
    assert_close(&obj_positions(&sandbox.read("rest.obj")), &mesh, REST_TOLERANCE);
}
