//! Tests of subdivided cages and inner controls.

use predicates::prelude::*;
use predicates::str::contains;

use crate::support::{Sandbox, assert_close, obj_positions, sphere_obj};

/// Inner controls as OBJ: a polyline of two segments, and a point in front of it.
const SPINE: &str = "v -0.3 -0.4 -0.2\nv 0 0 -0.2\nv 0.3 0.4 -0.2\nv 0 0 0.4\nl 1 2 3\np 4\n";
/// A pose of the inner controls [`SPINE`], in which only the point has moved.
const MOVED_SPINE: &str = "v -0.3 -0.4 -0.2\nv 0 0 -0.2\nv 0.3 0.4 -0.2\nv 0 0 0.6\nl 1 2 3\np 4\n";

fn with_spine() -> Sandbox {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.write("spine.obj", SPINE);
    sandbox
}

#[test]
fn smooth_cage_keeps_the_rest_pose_and_reports_outside_vertices() {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.write("mesh.obj", sphere_obj(0.9));
    let report =
        sandbox.json("bind mesh.obj --cage cage.obj -g 16 --smooth 2 --weights w.npz -o rest.obj --json");
    assert_eq!((&report["smooth"], &report["cage_vertices"]), (&2.into(), &8.into()));
    // The subdivided surface cuts the corners of the cube, so parts of the sphere are outside.
    assert!(report["outside_vertices"].as_u64().unwrap() > 0);
    assert_close(&obj_positions(&sandbox.read("rest.obj")), &obj_positions(&sandbox.read("mesh.obj")), 1e-6);
    sandbox.run("check cage.obj --mesh mesh.obj --smooth 2").success().stdout(contains("outside"));
    sandbox.run("check cage.obj --mesh mesh.obj --smooth 2 --repair grow -o grown.obj").success();
    let grown = sandbox.json("bind mesh.obj --cage grown.obj -g 16 --smooth 2 --json");
    assert_eq!(grown["outside_vertices"], 0);
    let made = sandbox.json("cage mesh.obj --smooth 2 -o made.obj --json");
    assert!(made["vertices"].as_u64().unwrap() <= 80);
    sandbox
        .run("check made.obj --mesh mesh.obj --smooth 2")
        .success()
        .stdout(contains("all vertices of the model are inside"));
    sandbox.run("bind mesh.obj --cage cage.obj --smooth 4").code(2).stderr(contains("from 0 to 3"));
}

#[test]
fn inner_controls_are_columns_after_the_cage_and_move_the_model() {
    let sandbox = with_spine();
    let report = sandbox.json(
        "bind mesh.obj --cage cage.obj -g 16 --controls spine.obj --radius 0.15 --weights w.npz -o rest.obj --json",
    );
    assert_eq!((&report["cage_vertices"], &report["inner_controls"]), (&8.into(), &4.into()));
    // All rows have offsets, so the error of their weights says nothing about the solver. It was given as 0.
    assert!(report["raw_error"].is_null() && report["rest_error"]["max_rel"].is_number(), "{report}");
    let bind = "bind mesh.obj --cage cage.obj -g 16 --weights plain.npz";
    sandbox.run(bind).success().stdout(contains("solver error"));
    sandbox
        .run(&format!("{bind} --controls spine.obj"))
        .success()
        .stdout(contains("rest error").and(contains("solver error").not()));
    let rest = obj_positions(&sandbox.read("mesh.obj"));
    assert_close(&obj_positions(&sandbox.read("rest.obj")), &rest, 1e-6);

    let deform = "deform mesh.obj --cage cage.obj --weights w.npz --pose cage.obj -o out.obj";
    sandbox.run(deform).success().stdout(contains("by 8 cage vertices and 4 controls inside"));
    assert_close(&obj_positions(&sandbox.read("out.obj")), &rest, 1e-6);
    sandbox.write("moved.obj", MOVED_SPINE);
    sandbox.run(&format!("{deform} --pose-controls moved.obj")).success();
    let posed = obj_positions(&sandbox.read("out.obj"));
    // The front of the sphere, near the point, moves most; its back hardly moves.
    let motion = |front: f64| {
        let far = (0..rest.len()).max_by(|&a, &b| (front * rest[a][2]).total_cmp(&(front * rest[b][2])));
        let v = far.unwrap();
        posed[v][2] - rest[v][2]
    };
    assert!(
        motion(1.0) > 0.02 && motion(-1.0).abs() < 0.25 * motion(1.0),
        "{} {}",
        motion(1.0),
        motion(-1.0)
    );

    sandbox.run("info spine.obj").success().stdout(contains("1 point, 1 line, 0 faces"));
    sandbox.write("few.obj", "v 0 0 0\np 1\n");
    sandbox
        .run(&format!("{deform} --pose-controls few.obj"))
        .failure()
        .stderr(contains("has 1 vertex, but 4 controls inside were bound"));
    sandbox
        .run(&format!("{deform} --pose-controls moved.obj --pose-controls moved.obj"))
        .failure()
        .stderr(contains("--pose-controls: 2 files for 1 pose"));
}

#[test]
fn pull_moves_inner_controls() {
    let sandbox = with_spine();
    let controls = "--controls spine.obj --radius 0.15";
    sandbox.run(&format!("bind mesh.obj --cage cage.obj -g 16 {controls} --weights w.npz")).success();
    sandbox.write("job.json", r#"{"grabs": [{"cage": 11, "to": [0, 0, 0.7]}], "reach": "all"}"#);
    let pull = "pull mesh.obj --cage cage.obj --weights w.npz --job job.json -o pose.obj";
    sandbox.run(&format!("{pull} {controls} -g 16 --save-controls posed.obj")).success();
    // Control 11 is the point, because 8 cage vertices and 3 vertices of the polyline precede it.
    let posed = obj_positions(&sandbox.read("posed.obj"));
    assert_eq!(posed.len(), 4);
    assert!((posed[3][2] - 0.7).abs() < 1e-2, "{:?}", posed[3]);
    sandbox.run(pull).failure().stderr(contains("was bound with 4 controls inside, but 0 were given"));
}

#[test]
fn invalid_inner_controls_are_rejected() {
    let sandbox = with_spine();
    let many: String = (0..10_000).map(|k| format!("v 0 0 {}\n", f64::from(k) * 1e-5)).collect();
    let points: String = (1..=10_000).map(|k| format!("p {k}\n")).collect();
    for (file, message) in [
        ("", "is empty"),
        ("# nothing\n", "no vertices"),
        ("v 0 0 0\n", "there is no control inside: give points (p), polylines (l) or faces (f)"),
        ("v 0 0 0\np 2\n", "line 2: refers to vertex 2, but there are 1"),
        ("v 0 0 5\np 1\n", "control 0 is outside the cage: move it in"),
        ("v 0 0 0\nv 0 0 0.01\np 1 2\n", "point 0 and point 1 inside the cage overlap"),
        (
            &(many + &points),
            "10,000 points, lines and faces inside need 800,006 faces, more than 100,000: use fewer",
        ),
    ] {
        sandbox.write("wrong.obj", file);
        sandbox
            .run("bind mesh.obj --cage cage.obj -g 16 --controls wrong.obj")
            .failure()
            .stderr(contains("wrong.obj"))
            .stderr(contains(message));
    }
    sandbox
        .run("bind mesh.obj --cage cage.obj -g 16 --controls spine.obj --radius 0.05")
        .success()
        .stdout(contains("The radius of the controls inside, 5.000e-2, is below two cells of this grid"));
    sandbox.run("bind mesh.obj --cage cage.obj --radius 0.1").code(2);
}
