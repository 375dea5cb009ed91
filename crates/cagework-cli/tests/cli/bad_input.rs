//! Tests that invalid input ends with exit code 1 and a message that names the file, without a panic.

use std::fs::File;

use predicates::prelude::*;
use predicates::str::contains;

use crate::support::{CORNERS, Sandbox, box_obj, sphere_obj};

/// Asserts that the command fails without a panic, and that its message contains all of `words`.
fn assert_refused(sandbox: &Sandbox, args: &str, words: &[&str]) {
    let assert = sandbox.run(args).code(1).stdout("");
    let assert = assert.stderr(predicates::str::starts_with("error: ").and(contains("panicked").not()));
    for word in words {
        let message = String::from_utf8_lossy(&assert.get_output().stderr).into_owned();
        assert!(message.contains(word), "`cagework {args}` does not print '{word}': {message}");
    }
}

/// A GLB with one JSON chunk, whose header claims a length of `claimed` bytes.
fn glb(json: &str, claimed: u32) -> Vec<u8> {
    let mut bytes = b"glTF".to_vec();
    bytes.extend(2_u32.to_le_bytes());
    bytes.extend((20 + json.len() as u32).to_le_bytes());
    bytes.extend(claimed.to_le_bytes());
    bytes.extend(b"JSON");
    bytes.extend(json.as_bytes());
    bytes
}

#[test]
fn options_without_effect_are_refused() {
    let sandbox = Sandbox::with_sphere_in_box();
    for (args, words) in [
        ("cage mesh.obj --margin 0.1 -o c.obj", ["--margin: only a box cage", "hint: give --kind box"]),
        ("cage mesh.obj --kind hull --divisions 3 -o c.obj", ["--divisions: only a box cage", "hint: "]),
        ("cage mesh.obj --kind box --vertices 40 -o c.obj", ["--vertices: a box cage", "hint: "]),
        (
            "cage mesh.obj --kind skeleton --around-clip Run -o c.obj",
            ["--around-clip: rings", "hint: leave out"],
        ),
        ("cage mesh.obj --divisions 3 --clearance 0.1 -o c.obj", ["--clearance: a box cage", "hint: "]),
    ] {
        assert_refused(&sandbox, args, &words);
    }
}

#[test]
fn files_that_are_not_models_are_rejected() {
    let sandbox = Sandbox::with_sphere_in_box();
    let huge = r#"{"asset":{"version":"2.0"},"buffers":[{"byteLength":12}],"bufferViews":[{"buffer":0,"byteLength":12}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":4000000000,"type":"VEC3"}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}]} "#;
    sandbox.write("empty.obj", "");
    sandbox.write("empty.glb", "");
    sandbox.write("text.glb", "this is not a glTF file");
    sandbox.write("text.gltf", "this is not a glTF file");
    sandbox.write("noise.obj", [0x80, 0xff, 0x00, 0x13, 0x37].repeat(50));
    sandbox.write("truncated.glb", &glb(r#"{"asset":{"version":"2.0"}} "#, 28)[..22]);
    sandbox.write("overlong.glb", glb(r#"{"asset":{"version":"2.0"}} "#, u32::MAX));
    sandbox.write("huge.glb", glb(huge, huge.len() as u32));
    sandbox.write("huge.gltf", huge);
    sandbox.write("nan.obj", sphere_obj(0.7).replacen("v 0 0.7", "v 0 nan", 1));
    sandbox.write("faceless.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    sandbox.write("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
    std::fs::create_dir(sandbox.path("folder.obj")).unwrap();
    for file in [
        "empty.obj",
        "empty.glb",
        "text.glb",
        "text.gltf",
        "noise.obj",
        "truncated.glb",
        "overlong.glb",
        "huge.glb",
        "huge.gltf",
        "nan.obj",
        "index.obj",
        "folder.obj",
        "missing.obj",
    ] {
        assert_refused(&sandbox, &format!("info {file}"), &[file]);
        assert_refused(&sandbox, &format!("bind {file} --cage cage.obj -g 8"), &[file]);
        assert_refused(&sandbox, &format!("bind mesh.obj --cage {file} -g 8"), &[file]);
        assert_refused(&sandbox, &format!("cage {file} -o new.obj"), &[file]);
    }
    assert_refused(&sandbox, "info folder.obj", &["is a folder"]);
    assert_refused(&sandbox, "info missing.obj", &["no such file"]);
    assert_refused(&sandbox, "info empty.obj", &["is empty"]);
    assert_refused(&sandbox, "bind faceless.obj --cage cage.obj", &["3 vertices", "no faces"]);
    assert_refused(&sandbox, "bind mesh.obj --cage faceless.obj", &["3 vertices", "no faces"]);
}

#[test]
fn file_above_the_size_limit_is_not_read() {
    let sandbox = Sandbox::new();
    // The file is sparse, so it occupies no disk space.
    File::create(sandbox.path("large.obj")).unwrap().set_len(3 << 30).unwrap();
    assert_refused(&sandbox, "info large.obj", &["large.obj", "3072 MiB", "2048 MiB"]);
}

#[test]
fn invalid_cages_are_rejected_with_the_location() {
    let sandbox = Sandbox::with_sphere_in_box();
    let closed = box_obj(&CORNERS);
    sandbox.write("open.obj", closed.replace("f 5 6 8 7\n", ""));
    sandbox.write("fin.obj", closed.clone() + "v 3 0 0\nf 1 2 9\n");
    sandbox.write("flat.obj", box_obj(&CORNERS.map(|[x, y, _]| [x, y, 0.0])));
    for file in ["open.obj", "fin.obj", "flat.obj"] {
        assert_refused(&sandbox, &format!("bind mesh.obj --cage {file} -g 8"), &[file]);
    }
    assert_refused(&sandbox, "bind mesh.obj --cage open.obj -g 8", &["not closed", "edge"]);
}

#[test]
fn outputs_are_checked_before_the_work() {
    let sandbox = Sandbox::with_sphere_in_box();
    std::fs::create_dir(sandbox.path("dir.glb")).unwrap();
    assert_refused(
        &sandbox,
        "bind mesh.obj --cage cage.obj -o nowhere/out.glb",
        &["nowhere/out.glb", "the folder nowhere does not exist"],
    );
    assert_refused(&sandbox, "bind mesh.obj --cage cage.obj -o mesh.obj", &["mesh.obj", "overwritten"]);
    assert_refused(&sandbox, "bind mesh.obj --cage cage.obj -o ./cage.obj", &["cage.obj", "overwritten"]);
    assert_refused(&sandbox, "bind mesh.obj --cage cage.obj --report mesh.obj", &["mesh.obj", "overwritten"]);
    assert_refused(
        &sandbox,
        "bind mesh.obj --cage box -o a.obj --save-cage a.obj",
        &["a.obj", "two outputs"],
    );
    assert_refused(&sandbox, "bind mesh.obj --cage cage.obj -o dir.glb", &["dir.glb", "folder"]);
    assert_refused(&sandbox, "cage mesh.obj -o mesh.obj", &["mesh.obj", "overwritten"]);
    sandbox.write("blocked", "");
    assert_refused(&sandbox, "demo -o blocked", &["blocked"]);
}

#[test]
fn vertices_outside_the_cage_can_be_refused() {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.write("mesh.obj", sphere_obj(1.5));
    assert_refused(
        &sandbox,
        "bind mesh.obj --cage cage.obj -g 8 --outside refuse",
        &["outside the cage", "hint"],
    );
}

#[test]
fn cage_that_contains_no_vertex_is_rejected_by_every_outside_policy() {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.write("far.obj", box_obj(&CORNERS.map(|[x, y, z]| [x + 10_001.7, y, z])));
    sandbox.write("small.obj", box_obj(&CORNERS.map(|c| c.map(|x| 0.01 * x))));
    for policy in ["extend", "stay", "refuse"] {
        for (cage, message) in [
            // The distance is the gap between x = 0.7 and x = 10,000.7.
            ("far.obj", "none of the model's 178 vertices is inside the cage; the cage is 1e4 away from it"),
            ("small.obj", "the cage is 70 times smaller than the model"),
        ] {
            let args = format!("bind mesh.obj --cage {cage} -g 8 --outside {policy}");
            assert_refused(
                &sandbox,
                &args,
                &[message, "`--outside` applies only if some vertices are inside"],
            );
        }
    }
}

/// The cages are a cube with one vertex far away, and a cube with two corners of a face at the same position.
#[test]
fn degenerate_cages_are_checked_and_repaired_without_a_panic() {
    let sandbox = Sandbox::with_sphere_in_box();
    let closed = box_obj(&CORNERS);
    sandbox.write("far.obj", closed.replacen("v -1 -1 -1", "v -1 -1429490.567295 -1", 1));
    sandbox.write("damaged.obj", closed.replacen("v -1 -1 -1", "v 1 -1 -1", 1));
    sandbox.run("check far.obj --mesh mesh.obj").success().stdout(contains("valid as a cage"));
    for repair in ["weld,drop-degenerate,fill-holes,flip", "weld", "grow"] {
        for file in ["far.obj", "damaged.obj"] {
            let args = format!("check {file} --mesh mesh.obj --repair {repair} -o repaired.obj");
            sandbox.run(&args).stderr(contains("panicked").not());
        }
    }
}

#[test]
fn memory_limit_is_an_error_that_names_the_limit() {
    let sandbox = Sandbox::with_sphere_in_box();
    assert_refused(&sandbox, "bind mesh.obj --cage cage.obj -g 512 --memory-limit 1", &["MiB", "limit"]);
}

#[test]
fn invalid_weights_files_are_rejected() {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.write("empty.npz", "");
    sandbox.write("text.npz", "not a zip archive");
    sandbox.write("cut.npz", b"PK\x03\x04\x14\x00\x00\x00");
    for file in ["empty.npz", "text.npz", "cut.npz", "missing.npz"] {
        let args = format!("deform mesh.obj --cage cage.obj --weights {file} --pose cage.obj -o out.obj");
        assert_refused(&sandbox, &args, &[file]);
    }
}

#[test]
fn box_cage_that_overflows_is_rejected_and_a_far_one_is_valid() {
    let sandbox = Sandbox::with_sphere_in_box();
    assert_refused(&sandbox, "cage mesh.obj --kind box --margin 3e38 -o box.obj", &["box cage"]);
    // Above 2^24 = 16,777,216, f32 represents only whole numbers, so positions are stored relative to an origin near
    // the model.
    let far: String = CORNERS.iter().map(|[x, y, z]| format!("v {} {y} {z}\n", x + 3e7)).collect();
    let closed = box_obj(&CORNERS);
    sandbox.write("far.obj", far + closed.split_at(closed.find('f').expect("a box has faces")).1);
    assert!(!sandbox.path("box.obj").exists());
    sandbox.run("cage far.obj --kind box --divisions 16 -o box.obj").success();
    sandbox
        .run("check box.obj --mesh far.obj")
        .success()
        .stdout(contains("all vertices of the model are inside"));
}
