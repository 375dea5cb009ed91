use predicates::prelude::*;
use predicates::str::contains;

use crate::support::{Sandbox, obj_positions};

fn bound() -> Sandbox {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.run("bind mesh.obj --cage cage.obj -g 16 --weights w.npz").success();
    sandbox
}

const PULL: &str = "pull mesh.obj --cage cage.obj --weights w.npz --job job.json -o pose.obj";

#[test]
fn grabbed_vertex_reaches_its_target_and_a_pin_stays() {
    let sandbox = bound();
    let rest = obj_positions(&sandbox.read("mesh.obj"));
    let farthest = |sign: f64| {
        (0..rest.len()).max_by(|&a, &b| (sign * rest[a][1]).total_cmp(&(sign * rest[b][1]))).unwrap()
    };
    let (top, bottom) = (farthest(1.0), farthest(-1.0));
    let [x, y, z] = rest[top];
    sandbox.write(
        "job.json",
        format!(
            r#"{{"grabs": [{{"vertex": {top}, "to": [{x}, {}, {z}]}}], "pins": [{{"vertex": {bottom}}}], "reach": "all"}}"#,
            y + 0.4
        ),
    );
    let done = sandbox.json(&format!("{PULL} --json"));
    for field in [
        "frame_ms",
        "grab_ms",
        "precompute_ms",
        "error",
        "lag",
        "settle_frames",
        "stretch_max",
        "stretch_99",
        "stretch_1",
        "samples",
        "groups",
        "cage",
    ] {
        assert!(done[field].is_number(), "{field}: {done}");
    }
    assert!(done["reach"].is_null() && done["far_mean"].is_null(), "the whole model follows");
    assert!(done["error"].as_f64().unwrap() < 1e-3);
    // Editors on Windows write a byte order mark.
    let (job, pose) = (sandbox.read("job.json"), sandbox.read("pose.obj"));
    sandbox.write("job.json", [b"\xef\xbb\xbf".as_slice(), &job].concat());
    sandbox.run(PULL).success();
    assert!(sandbox.read("pose.obj") == pose);
    sandbox.run("deform mesh.obj --cage cage.obj --weights w.npz --pose pose.obj -o out.obj").success();
    let posed = obj_positions(&sandbox.read("out.obj"));
    assert!((posed[top][1] - y - 0.4).abs() < 2e-3, "{:?}", posed[top]);
    assert!((posed[bottom][1] - rest[bottom][1]).abs() < 2e-3);

    // The squares of such lengths are beyond the range of 32-bit floats.
    sandbox.write("job.json", format!(r#"{{"grabs": [{{"vertex": {top}, "to": [0, 3e30, 0]}}]}}"#));
    let far = sandbox.json(&format!("{PULL} --json"));
    assert!(far["stretch_max"].as_f64().unwrap() > 1e25, "{far}");
    let has_exponent = |text: &str| {
        let (_, rest) = text.split_once("stretched to at most ").unwrap_or_default();
        rest.split_whitespace().next().is_some_and(|number| number.contains('e'))
    };
    sandbox.run(PULL).success().stdout(predicate::function(has_exponent));

    // 3e30 is between 2^101 and 2^102, where floats of 24 bits have steps of 2^78.
    sandbox.write(
        "job.json",
        format!(r#"{{"grabs": [{{"vertex": {top}, "to": [0, 3e30, 0]}}], "reach": "all"}}"#),
    );
    let sentence = format!("coordinates up to 3e30, where 32-bit floats have steps of {:e}", 78_f32.exp2());
    sandbox.run(PULL).failure().code(1).stderr(contains(sentence));
}

#[test]
fn invalid_jobs_are_rejected_and_write_nothing() {
    let sandbox = bound();
    sandbox.write("job.json", r#"{"grabs": [{"vertex": 0, "to": [0, 0, 0]}]}"#);
    sandbox
        .run(&PULL.replace("--weights w.npz", ""))
        .failure()
        .code(1)
        .stderr(contains("can only be posed with its weights").and(contains("give --weights")));
    for (job, message) in [
        ("grab it", "job.json: not a job: the JSON is damaged, at line 1, column 1, after 'g'"),
        ("[]", "job.json: not a job: a value has the wrong type"),
        (
            "{\"grabs\": [],\n \"pin\": []}",
            "'pin' is not known; it must be one of grabs, pins, reach, start, relax, frames, at line 2, column 6, after '\"pin\"'",
        ),
        (r#"{"grabs": []}"#, "nothing is grabbed"),
        (
            r#"{"grabs": [{"vertex": 100000, "to": [0, 0, 0]}]}"#,
            "no vertex of the model 100000: indices run from 0 to 177",
        ),
        (r#"{"grabs": [{"vertex": -1, "to": [0, 0, 0]}]}"#, "-1"),
        (
            r#"{"grabs": [{"triangle": 5000, "bary": [1, 0, 0], "to": [0, 0, 0]}]}"#,
            "no triangle of the model 5000",
        ),
        (
            r#"{"grabs": [{"triangle": 0, "bary": [1, 1, 0], "to": [0, 0, 0]}]}"#,
            "not barycentric coordinates",
        ),
        (r#"{"grabs": [{"cage": 8, "to": [0, 0, 0]}]}"#, "no vertex of the cage 8: indices run from 0 to 7"),
        (r#"{"grabs": [{"vertex": 0}]}"#, "grab 0 has no target"),
        (r#"{"grabs": [{"to": [0, 0, 0]}]}"#, "one of vertex, triangle"),
        (r#"{"grabs": [{"vertex": 0, "to": [0, 1e300, 0]}]}"#, "grab 0 has the target coordinate inf"),
        (r#"{"grabs": [{"vertex": 0, "to": [0, 1e999, 0]}]}"#, "a number is out of range, at line 1"),
        (r#"{"grabs": [{"vertex": 0, "to": [0, 0, 0]}], "reach": -1}"#, "the reach is -1"),
        (r#"{"grabs": [{"vertex": 0, "to": [0, 0, 0]}], "reach": "far"}"#, "the reach is 'far'"),
        (
            r#"{"grabs": [{"vertex": 0, "to": [0, 0, 0]}], "pins": [{"vertex": 1}, {"vertex": 2, "to": [0, 0, 1]}]}"#,
            "pin 1 has a target \"to\", but pins stay in place",
        ),
        (r#"{"grabs": [{"vertex": 0, "vertex": 1, "to": [0, 0, 0]}]}"#, "not a job: 'vertex' is given twice"),
        (r#"{"grabs": [{"vertex": 0, "to": [0, 0, 0]}], "relax": 3}"#, "relax is 3"),
        (r#"{"grabs": [{"vertex": 0, "to": [0, 0, 0]}], "frames": 0}"#, "frames is 0"),
        (r#"{"grabs": [{"vertex": 0, "to": [0, 0, 0]}], "start": "none.obj"}"#, "none.obj"),
        (r#"{"grabs": [{"vertex": 0, "to": [0, 0, 0]}], "start": "mesh.obj"}"#, "178"),
    ] {
        sandbox.write("job.json", job);
        sandbox.run(PULL).failure().code(1).stderr(contains("error:").and(contains(message)));
        assert!(!sandbox.path("pose.obj").exists(), "{job}");
    }
    let pins: Vec<String> = (0..178).map(|v| format!(r#"{{"vertex": {v}}}"#)).collect();
    let all = |n: usize| {
        let pins = pins.iter().cycle().take(n).cloned().collect::<Vec<_>>().join(", ");
        format!(r#"{{"grabs": [{{"vertex": 0, "to": [0, 5, 0]}}], "pins": [{pins}]}}"#)
    };
    sandbox.write("job.json", all(200));
    sandbox.run(PULL).failure().stderr(contains("201 grabs and pins are more than the limit of 200"));
    sandbox.write("job.json", all(178));
    sandbox.run(PULL).success();
    assert!(obj_positions(&sandbox.read("pose.obj")).iter().flatten().all(|x| x.is_finite()));
}

#[test]
fn weights_of_another_model_are_rejected() {
    let sandbox = bound();
    sandbox.write("job.json", r#"{"grabs": [{"vertex": 0, "to": [0, 0, 0]}]}"#);
    sandbox
        .run("pull cage.obj --cage cage.obj --weights w.npz --job job.json -o pose.obj")
        .failure()
        .stderr(contains("178").and(contains("8")));
}

#[test]
fn targets_and_poses_use_the_axes_of_the_files() {
    let sandbox = Sandbox::with_sphere_in_box();
    let rest = obj_positions(&sandbox.read("mesh.obj"));
    let top = (0..rest.len()).max_by(|&a, &b| rest[a][2].total_cmp(&rest[b][2])).unwrap();
    let [x, y, z] = rest[top];
    sandbox.write(
        "job.json",
        format!(r#"{{"grabs": [{{"vertex": {top}, "to": [{x}, {y}, {}]}}], "reach": "all"}}"#, z + 0.3),
    );
    for cage in ["cage.obj", "box:1"] {
        let files = format!("mesh.obj --up z --cage {cage}");
        sandbox.run(&format!("bind {files} -g 16 --weights w.npz")).success();
        sandbox.run(&format!("pull {files} --weights w.npz --job job.json -o pose.obj")).success();
        sandbox.run(&format!("deform {files} --weights w.npz --pose pose.obj -o out.obj")).success();
        let posed = obj_positions(&sandbox.read("out.obj"))[top];
        let off = (posed[0] - x).abs() + (posed[1] - y).abs() + (posed[2] - z - 0.3).abs();
        assert!(off < 2e-3, "{cage}: {posed:?} for {:?}", rest[top]);
    }
}
