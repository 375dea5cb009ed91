use predicates::str::contains;

use crate::support::{CORNERS, Sandbox, box_obj, obj_positions, sphere_obj};

/// A folder with a bound sphere, a bent cage, and as the target the sphere deformed by this cage.
fn bound() -> Sandbox {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.run("bind mesh.obj --cage cage.obj -g 16 --weights w.npz").success();
    let bent = CORNERS.map(|[x, y, z]| [x + 0.4 * y * y * z + 2.0, 1.3 * y + 0.2 * x * z, z - 0.1 * x]);
    sandbox.write("bent.obj", box_obj(&bent));
    sandbox.run("deform mesh.obj --cage cage.obj --weights w.npz --pose bent.obj -o target.obj").success();
    sandbox
}

const FIT: &str = "fit mesh.obj --cage cage.obj --weights w.npz -o pose.obj";

fn max_distance(sandbox: &Sandbox, a: &str, b: &str) -> f64 {
    let [a, b] = [a, b].map(|name| obj_positions(&sandbox.read(name)));
    assert_eq!(a.len(), b.len());
    let apart = |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    a.iter().zip(&b).map(apart).fold(0.0, f64::max)
}

#[test]
fn fit_recovers_the_pose_that_deformed_the_target() {
    let sandbox = bound();
    let done = sandbox.json(&format!("{FIT} --target target.obj --json"));
    // The tolerance is small compared with the diagonal of the box, 3.46.
    assert!(max_distance(&sandbox, "pose.obj", "bent.obj") <= 1e-4, "{done}");
    assert_eq!(
        (&done["points"], &done["left_out"], &done["settled"]),
        (&178.into(), &0.into(), &true.into())
    );
    assert!(done["rms"].as_f64().unwrap() < 1e-5 && done["rms_before"].as_f64().unwrap() > 0.1, "{done}");
    for field in ["cage", "lambda", "energy", "largest", "largest_before", "steps", "precompute_ms", "fit_ms"]
    {
        assert!(done[field].is_number(), "{field}: {done}");
    }
}

#[test]
fn landmarks_recover_the_pose_and_a_single_one_translates_the_model() {
    let sandbox = bound();
    let [rest, target] = ["mesh.obj", "target.obj"].map(|name| obj_positions(&sandbox.read(name)));
    let json = |p: [f64; 3]| format!("[{}, {}, {}]", p[0], p[1], p[2]);
    // Every third landmark names a vertex, the others name a point of the surface.
    let landmarks = (0..rest.len()).map(|v| {
        let named =
            if v % 3 == 0 { format!("\"vertex\": {v}") } else { format!("\"point\": {}", json(rest[v])) };
        format!("{{{named}, \"to\": {}}}", json(target[v]))
    });
    sandbox.write("all.json", format!("[{}]", landmarks.collect::<Vec<_>>().join(",")));
    let done = sandbox.json(&format!("{FIT} --landmarks all.json --json"));
    assert!(max_distance(&sandbox, "pose.obj", "bent.obj") <= 1e-3, "{done}");

    // Editors on Windows write a byte order mark.
    let [all, pose] = ["all.json", "pose.obj"].map(|name| sandbox.read(name));
    sandbox.write("all.json", [b"\xef\xbb\xbf".as_slice(), &all].concat());
    sandbox.run(&format!("{FIT} --landmarks all.json")).success();
    assert!(sandbox.read("pose.obj") == pose);

    // A single landmark leads to a translation.
    sandbox.write("one.json", format!("[{{\"vertex\": 7, \"to\": {}}}]", json(rest[7].map(|x| x + 0.5))));
    sandbox
        .run(&format!("{FIT} --landmarks one.json"))
        .success()
        .stdout(contains("to 1 point in"))
        .stdout(contains("note: 1 landmark does not determine the rotation"));
    let [pose, cage] = ["pose.obj", "cage.obj"].map(|name| obj_positions(&sandbox.read(name)));
    for (a, b) in pose.iter().zip(&cage) {
        assert!((0..3).all(|k| (a[k] - b[k] - 0.5).abs() < 1e-3), "{a:?} {b:?}");
    }
}

/// Points at a distance of 0.35 from the cage, 10 % of its diagonal of 3.46, follow it by half.
#[test]
fn a_landmark_outside_the_cage_that_is_in_place_moves_nothing() {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.write("mesh.obj", sphere_obj(1.35));
    sandbox.run("bind mesh.obj --cage cage.obj -g 16 --weights w.npz").success();
    let rest = obj_positions(&sandbox.read("mesh.obj"));
    let farthest = (0..rest.len()).max_by(|&a, &b| rest[a][0].total_cmp(&rest[b][0])).unwrap();
    let [x, y, z] = rest[farthest];
    assert!(x > 1.3, "{x}");
    let triangle = format!("{{\"point\": [{x}, {y}, {z}], \"to\": [{x}, {y}, {z}]}}");
    let vertex = format!("{{\"vertex\": {farthest}, \"to\": [{x}, {y}, {z}]}}");
    for landmark in [vertex, triangle] {
        sandbox.write("one.json", format!("[{landmark}]"));
        let run = sandbox.run(&format!("{FIT} --landmarks one.json")).success();
        run.stdout(contains(
            "1 landmark is outside the cage and follows it only partly; the fit may miss it",
        ));
        assert!(max_distance(&sandbox, "pose.obj", "cage.obj") <= 1e-4);
    }
}

#[test]
fn invalid_targets_are_rejected_and_nothing_is_written() {
    let sandbox = bound();
    sandbox.run(FIT).failure().stderr(contains("--target <MESH>|--landmarks <FILE>"));
    sandbox
        .run(&format!("{FIT} --target cage.obj"))
        .failure()
        .stderr(contains("cage.obj: has 8 vertices, but mesh.obj has 178; vertices are matched by index"))
        .stderr(contains("hint: for a target with other vertices use --landmarks"));
    sandbox
        .run(&format!("{FIT} --target target.obj --lambda=-1"))
        .failure()
        .stderr(contains("lambda is -1; it must be a number of at least 0"));
    for (landmarks, message) in [
        ("[]", "bad.json: has 0 landmarks; expected 1 to 10000"),
        ("{}", "bad.json: an object is given, but a list is expected, at the start of line 1"),
        ("[{\"vertex\": 178, \"to\": [0, 0, 0]}]", "landmark 0 names vertex 178; indices run from 0 to 177"),
        ("[{\"to\": [0, 0, 0]}]", "landmark 0 needs one of vertex, triangle (with bary) and point"),
        (
            "[{\"triangle\": 0, \"bary\": [1, 1, 1], \"to\": [0, 0, 0]}]",
            "expected non-negative numbers that sum to 1",
        ),
        ("[{\"vertex\": 1, \"to\": [0, 0, 1e39]}]", "landmark 0 has the coordinate inf"),
        (
            "[{\"vertex\": 1, \"to\": [0, 0, 1], \"weight\": 0}]",
            "landmark 0 has the weight 0; it must be above 0",
        ),
    ] {
        sandbox.write("bad.json", landmarks);
        sandbox.run(&format!("{FIT} --landmarks bad.json")).failure().stderr(contains(message));
    }
    assert!(!sandbox.path("pose.obj").exists());
}

#[test]
fn pose_formats_that_reorder_vertices_are_rejected() {
    let sandbox = bound();
    let fit =
        |pose: &str| format!("fit mesh.obj --cage cage.obj --weights w.npz --target target.obj -o {pose}");
    for pose in ["pose.stl", "pose.glb"] {
        let message = format!("{pose}: this format would reorder the cage's vertices");
        sandbox.run(&fit(pose)).failure().stderr(contains(message)).stderr(contains("write .obj or .ply"));
        assert!(!sandbox.path(pose).exists());
    }
    sandbox.run(&fit("pose.ply")).success();
    sandbox.run("deform mesh.obj --cage cage.obj --weights w.npz --pose pose.ply -o fitted.obj").success();
    assert!(max_distance(&sandbox, "fitted.obj", "target.obj") <= 1e-4);
}
