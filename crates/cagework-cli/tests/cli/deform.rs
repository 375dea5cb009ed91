use predicates::prelude::*;
use predicates::str::contains;

use crate::support::{CORNERS, Sandbox, assert_close, box_obj, glb_json, obj_positions, sphere_obj};

/// Tolerance of positions, object units: weights have the precision of `f32`, and coordinates are below 10.
const TOLERANCE: f64 = 1e-4;

/// An affine map with scale, shear and translation.
fn affine([x, y, z]: [f64; 3]) -> [f64; 3] {
    [1.5 * x + 0.25 * y + 3.0, 0.75 * y - 0.5 * z, z + 0.1 * x - 2.0]
}

fn bound() -> Sandbox {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.run("bind mesh.obj --cage cage.obj -g 16 --weights w.npz").success();
    sandbox.write("affine.obj", box_obj(&CORNERS.map(affine)));
    sandbox.write("lifted.obj", box_obj(&CORNERS.map(|[x, y, z]| [x, y + 0.5 * (z + 1.0), z])));
    sandbox
}

#[test]
fn affine_map_of_the_cage_is_applied_to_the_mesh() {
    // By linear precision, sum w = 1 and sum w c = v imply sum w A(c) = A(v).
    let sandbox = bound();
    sandbox
        .run("deform mesh.obj --cage cage.obj --weights w.npz --pose affine.obj -o out.obj")
        .success()
        .stdout(contains("178 vertices").and(contains("wrote out.obj")));
    let expected: Vec<_> = obj_positions(&sandbox.read("mesh.obj")).into_iter().map(affine).collect();
    assert_close(&obj_positions(&sandbox.read("out.obj")), &expected, TOLERANCE);
}

#[test]
fn vertices_outside_follow_affine_maps() {
    let sandbox = Sandbox::with_sphere_in_box();
    // Vertices of this sphere are outside the cage by up to 4.3 % of the cage's diagonal. Up to 5 %, they follow the
    // cage fully.
    sandbox.write("mesh.obj", sphere_obj(1.15));
    sandbox.run("bind mesh.obj --cage cage.obj -g 16 --weights w.npz").success();
    let moved = |[x, y, z]: [f64; 3]| [-1.5 * y + 1.0, x + 0.2 * z, z + 2.0];
    sandbox.write("rotated.obj", box_obj(&CORNERS.map(moved)));
    let done =
        sandbox.json("deform mesh.obj --cage cage.obj --weights w.npz --pose rotated.obj -o out.obj --json");
    assert!(done["outside_vertices"].as_u64().unwrap() > 0 && done["staying_vertices"] == 0);
    assert!(done["notices"][0].as_str().unwrap().contains("vertices are outside the cage, up to 4.33 %"));
    let expected: Vec<_> = obj_positions(&sandbox.read("mesh.obj")).into_iter().map(moved).collect();
    assert_close(&obj_positions(&sandbox.read("out.obj")), &expected, TOLERANCE);
}

#[test]
fn several_poses_become_morph_targets_and_an_animation() {
    let sandbox = bound();
    let done = sandbox.json(
        "deform mesh.obj --cage cage.obj --weights w.npz --pose affine.obj --pose lifted.obj -o out.glb --json",
    );
    assert_eq!(done["poses"], serde_json::json!(["affine", "lifted"]));
    let document = glb_json(&sandbox.read("out.glb"));
    for primitive in document["meshes"][0]["primitives"].as_array().unwrap() {
        assert_eq!(primitive["targets"].as_array().unwrap().len(), 2);
    }
    assert_eq!(document["animations"].as_array().unwrap().len(), 1);
}

#[test]
fn times_and_interpolation_of_the_animation_are_as_given() {
    let sandbox = bound();
    let command = "deform mesh.obj --cage cage.obj --weights w.npz --pose affine.obj --pose lifted.obj";
    let animation = |options: &str| {
        let done = sandbox.json(&format!("{command} {options} -o out.glb --json"));
        let glb = glb_json(&sandbox.read("out.glb"));
        let sampler = &glb["animations"][0]["samplers"][0];
        let accessor = |key: &str| &glb["accessors"][sampler[key].as_u64().unwrap() as usize];
        let [times, weights] = ["input", "output"].map(|key| accessor(key)["count"].as_u64().unwrap());
        (done["animation_seconds"].as_f64().unwrap(), times, weights, sampler["interpolation"].clone())
    };
    // There is a key at rest at 0 s, unless the first pose is at 0 s. Each key has two weights; with cubic splines,
    // each weight has two tangents.
    assert_eq!(animation("--times 0.5,1.25"), (1.25, 3, 6, "LINEAR".into()));
    assert_eq!(animation("--times 0,1.25 --interpolation step"), (1.25, 2, 4, "STEP".into()));
    assert_eq!(animation("--interpolation cubic"), (3.0, 4, 24, "CUBICSPLINE".into()));
    for (options, message) in [
        ("--times 1", "times: expected one number per pose (2), got 1"),
        ("--times 1,2,3", "expected one number per pose (2), got 3"),
        ("--times 2,1", "the time of pose 2 is 1 s, but the previous pose is at 2 s"),
        ("--times 1,1", "the time of pose 2 is 1 s, but the previous pose is at 1 s"),
        ("--times 0,-1", "not a number of seconds from 0 to 3600"),
        ("--times 0,nan", "not a number of seconds from 0 to 3600"),
        ("--times 0,1e9", "not a number of seconds from 0 to 3600"),
        ("--times 0,", "not a number of seconds from 0 to 3600"),
        ("--interpolation smooth", "possible values: step, linear, cubic"),
    ] {
        sandbox.run(&format!("{command} {options} -o out.glb")).failure().stderr(contains(message));
    }
    sandbox
        .run("deform mesh.obj --cage cage.obj --weights w.npz --pose affine.obj --times 1 -o out.glb")
        .failure()
        .stderr(contains("one pose gives the deformed model").and(contains("another pose")));
}

#[test]
fn poses_above_the_memory_limit_are_rejected_before_they_are_computed() {
    let many = " --pose lifted.obj".repeat(300);
    bound()
        .run(&format!("deform mesh.obj --cage cage.obj --weights w.npz{many} -o out.glb --memory-limit 4"))
        .code(1)
        .stderr(contains("out.glb: with 300 morph targets it needs about").and(contains("limit of 4 MiB")));
}

#[test]
fn one_pose_is_written_without_morph_targets() {
    let sandbox = bound();
    sandbox.run("deform mesh.obj --cage cage.obj --weights w.npz --pose lifted.obj -o out.glb").success();
    let document = glb_json(&sandbox.read("out.glb"));
    assert!(document["meshes"][0]["primitives"][0].get("targets").is_none());
    assert!(document.get("animations").is_none());
    // The output is a readable GLB with all vertices.
    assert_eq!(sandbox.json("info out.glb --json")["unique_vertices"], 178);
}

#[test]
fn several_poses_are_rejected_for_obj() {
    bound()
        .run("deform mesh.obj --cage cage.obj --weights w.npz --pose affine.obj --pose lifted.obj -o out.obj")
        .code(1)
        .stderr(contains("format obj stores one pose, but there are 2: write a .glb"));
}

#[test]
fn pose_with_another_vertex_count_is_rejected_with_both_numbers() {
    let sandbox = bound();
    sandbox.write("long.obj", box_obj(&CORNERS) + "v 0 0 0\n");
    sandbox
        .run("deform mesh.obj --cage cage.obj --weights w.npz --pose long.obj -o out.obj")
        .code(1)
        .stderr(contains("long.obj").and(contains("9 vertices")).and(contains("8")));
}

#[test]
fn weights_of_another_mesh_or_cage_are_rejected_with_the_numbers_or_noted() {
    let sandbox = bound();
    sandbox
        .run("deform cage.obj --cage cage.obj --weights w.npz --pose affine.obj -o out.obj")
        .code(1)
        .stderr(contains("w.npz").and(contains("178 mesh vertices")).and(contains("the mesh has 8")));
    // As many vertices, in other places.
    sandbox
        .run("deform mesh.obj --cage lifted.obj --weights w.npz --pose affine.obj -o out.obj")
        .success()
        .stdout(contains("note: at rest the weights miss the mesh by up to"));
    sandbox
        .run("deform mesh.obj --cage box:2 --weights w.npz --pose affine.obj -o out.obj")
        .code(1)
        .stderr(contains("8 cage vertices").and(contains("the cage 26")));
}

#[test]
fn output_does_not_overwrite_a_pose() {
    bound()
        .run("deform mesh.obj --cage cage.obj --weights w.npz --pose affine.obj -o affine.obj")
        .code(1)
        .stderr(contains("affine.obj").and(contains("overwritten")));
}

/// With `--up z`, inputs are rotated when read and outputs are rotated back, so all files have the same axes.
#[test]
fn files_with_z_up_keep_their_axes() {
    let sandbox = bound();
    let long = |[x, y, z]: [f64; 3]| [x, y, 2.0 * z + 5.0];
    let mesh: Vec<_> = obj_positions(&sandbox.read("mesh.obj")).into_iter().map(long).collect();
    let mesh_obj = String::from_utf8(sandbox.read("mesh.obj")).unwrap();
    let faces: String = mesh_obj.lines().filter(|l| l.starts_with("f ")).map(|l| format!("{l}\n")).collect();
    sandbox.write(
        "mesh.obj",
        mesh.iter().map(|p| format!("v {} {} {}\n", p[0], p[1], p[2])).collect::<String>() + &faces,
    );
    sandbox.write("cage.obj", box_obj(&CORNERS.map(long)));
    sandbox.write("affine.obj", box_obj(&CORNERS.map(|p| affine(long(p)))));
    sandbox
        .run("bind mesh.obj --up z --cage cage.obj -g 16 --weights w.npz --save-cage used.obj -o rest.obj")
        .success();
    assert_close(&obj_positions(&sandbox.read("used.obj")), &CORNERS.map(long), 0.0);
    assert_close(&obj_positions(&sandbox.read("rest.obj")), &mesh, TOLERANCE);
    sandbox
        .run("deform mesh.obj --up z --cage cage.obj --weights w.npz --pose affine.obj -o out.obj")
        .success();
    let expected: Vec<_> = mesh.iter().copied().map(affine).collect();
    assert_close(&obj_positions(&sandbox.read("out.obj")), &expected, TOLERANCE);

    // The long side is vertical in `info`, and a generated cage is in the axes of the file.
    let bounds = &sandbox.json("info mesh.obj --up z --json")["bounds"];
    let y = |corner: &str| bounds[corner][1].as_f64().unwrap();
    assert!((y("min") - 3.6).abs() < TOLERANCE && (y("max") - 6.4).abs() < TOLERANCE, "{bounds}");
    sandbox.run("cage mesh.obj --up z --vertices 24 -o generated.obj").success();
    sandbox
        .run("check generated.obj --mesh mesh.obj")
        .success()
        .stdout(contains("all vertices of the model are inside"));
}

#[test]
fn pose_with_another_vertex_order_is_rejected() {
    let sandbox = bound();
    // The posed cage is the affine image of the box, but two diagonally opposite corners of a face have swapped their
    // indices.
    let [a, b] = [
        0,
        CORNERS
            .iter()
            .position(|c| c[0] == CORNERS[0][0] && c[1] != CORNERS[0][1] && c[2] != CORNERS[0][2])
            .unwrap(),
    ];
    let mut corners = CORNERS.map(affine);
    corners.swap(a, b);
    let renumbered = |word: &str| match word.parse::<usize>() {
        Ok(corner) if corner == a + 1 => (b + 1).to_string(),
        Ok(corner) if corner == b + 1 => (a + 1).to_string(),
        _ => word.to_owned(),
    };
    let lines = box_obj(&corners)
        .lines()
        .map(|line| {
            let words: Vec<String> = line
                .split(' ')
                .map(|word| if line.starts_with('f') { renumbered(word) } else { word.into() })
                .collect();
            words.join(" ") + "\n"
        })
        .collect::<String>();
    sandbox.write("swapped.obj", lines);
    sandbox
        .run("deform mesh.obj --cage cage.obj --weights w.npz --pose swapped.obj -o out.obj")
        .failure()
        .stderr(contains("its vertices are in another order"));
}

/// At map coordinates, `f32` has steps of 0.5, so model, cage and poses are stored relative to an origin near the
/// model.
#[test]
fn models_far_from_the_origin_are_deformed_with_the_same_accuracy() {
    let place = |[x, y, z]: [f64; 3]| [x + 500_000.25, y + 100.0, z + 4_500_000.5];
    let moved = |text: &str| {
        let mut places = obj_positions(text.as_bytes()).into_iter().map(place);
        let line = |line: &str| match line.starts_with("v ").then(|| places.next()).flatten() {
            Some([x, y, z]) => format!("v {x:.6} {y:.6} {z:.6}\n"),
            None => format!("{line}\n"),
        };
        text.lines().map(line).collect::<String>()
    };
    let sandbox = Sandbox::new();
    sandbox.write("mesh.obj", moved(&sphere_obj(0.7)));
    sandbox.write("cage.obj", moved(&box_obj(&CORNERS)));
    sandbox.write("affine.obj", moved(&box_obj(&CORNERS.map(affine))));
    sandbox.run("bind mesh.obj --cage cage.obj -g 16 --weights w.npz -o rest.obj").success();
    let rest = obj_positions(&sandbox.read("mesh.obj"));
    assert_close(&obj_positions(&sandbox.read("rest.obj")), &rest, 1e-6);
    sandbox.run("deform mesh.obj --cage cage.obj --weights w.npz --pose affine.obj -o out.obj").success();
    let near = obj_positions(sphere_obj(0.7).as_bytes());
    let expected: Vec<_> = near.iter().map(|&p| place(affine(p))).collect();
    assert_close(&obj_positions(&sandbox.read("out.obj")), &expected, 1e-5);
    sandbox.run("refit mesh.obj --cage cage.obj --pose affine.obj -g 16 -o fitted").success();
    assert_close(&obj_positions(&sandbox.read("fitted/mesh.obj")), &expected, 1e-5);
    // A generated cage has the model's origin too.
    sandbox.run("cage mesh.obj --kind box --divisions 1 -o box.obj").success();
    sandbox
        .run("check box.obj --mesh mesh.obj")
        .success()
        .stdout(contains("all vertices of the model are inside"));
    let bounds = &sandbox.json("info box.obj --json")["bounds"];
    assert!((bounds["min"][2].as_f64().unwrap() - 4_499_999.8).abs() < 0.3, "{bounds}");
    sandbox.run("bind mesh.obj --cage auto:40 -g 16 --save-cage auto.obj").success();
    sandbox
        .run("check auto.obj --mesh mesh.obj")
        .success()
        .stdout(contains("all vertices of the model are inside"));
}

/// Each keyframe in a pose file is a pose. Commands that accept a single pose reject such a file.
#[test]
fn keyframes_of_a_pose_file_are_separate_poses() {
    let sandbox = bound();
    sandbox.run("bind mesh.obj --cage cage.obj -g 8 -o mesh.glb").success();
    // The bound sphere serves as the cage, and its animated file as the pose.
    sandbox
        .run(
            "deform mesh.obj --cage cage.obj --weights w.npz --pose affine.obj --pose lifted.obj -o keys.glb",
        )
        .success();
    sandbox.write("small.obj", sphere_obj(0.3));
    sandbox.run("bind small.obj --cage mesh.glb -g 8 --weights s.npz").success();
    let done =
        sandbox.json("deform small.obj --cage mesh.glb --weights s.npz --pose keys.glb -o out.glb --json");
    let names = ["keys 0.000 s", "keys 1.000 s", "keys 2.000 s", "keys 3.000 s"];
    assert_eq!(done["poses"], serde_json::json!(names));
    let document = glb_json(&sandbox.read("out.glb"));
    let input = document["animations"][0]["samplers"][0]["input"].as_u64().unwrap() as usize;
    assert_eq!(document["accessors"][input]["max"], serde_json::json!([3.0]));
    sandbox
        .run("deform small.obj --cage mesh.glb --weights s.npz --pose keys.glb -o out.obj")
        .failure()
        .stderr(contains("format obj stores one pose, but there are 4"));
    sandbox
        .run("refit small.obj --cage mesh.glb --pose keys.glb -g 8 -o fitted")
        .failure()
        .stderr(contains("pose keys.glb contains 4 poses (keyframes or shape keys), but one is expected"));
}
