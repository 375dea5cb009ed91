use predicates::str::contains;

use crate::support::{CORNERS, Sandbox, box_obj};

/// Width and height of a PNG, from its first chunk (PNG specification, 11.2.2).
fn png_size(bytes: &[u8]) -> [u32; 2] {
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
    let word = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
    [word(16), word(20)]
}

#[test]
fn every_kind_of_picture_is_drawn() {
    let sandbox = Sandbox::with_sphere_in_box();
    // Clay looks as a model without material does anyway.
    let kinds = ["solid", "edges", "wireframe", "weights", "error", "cells", "slice"];
    let pictures = kinds.map(|show| {
        let drawn = sandbox.json(&format!(
            "render mesh.obj --cage cage.obj -g 12 --show {show} --column 3 --size 96x64 -o p.png --json"
        ));
        assert_eq!(drawn["size"], serde_json::json!([96, 64]));
        assert!(drawn["adapter"].as_str().is_some_and(|name| !name.is_empty()));
        let bytes = sandbox.read("p.png");
        assert_eq!(png_size(&bytes), [96, 64]);
        bytes
    });
    for (k, a) in pictures.iter().enumerate() {
        for (l, b) in pictures.iter().enumerate().take(k) {
            assert!(a != b, "{} and {} are the same picture", kinds[k], kinds[l]);
        }
    }
}

#[test]
fn pose_and_weights_of_a_bind_are_drawn() {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.write("pose.obj", box_obj(&CORNERS.map(|[x, y, z]| [1.5 * x, y, z])));
    sandbox.run("bind mesh.obj --cage cage.obj -g 12 --weights w.npz").success();
    let base = "render mesh.obj --cage cage.obj --size 64x64 --view front --theme light --orthographic -o";
    sandbox.run(&format!("{base} rest.png")).success().stdout(contains("wrote rest.png"));
    sandbox.run(&format!("{base} a.png --pose pose.obj --weights w.npz")).success();
    sandbox.run(&format!("{base} b.png --pose pose.obj -g 12")).success();
    assert_ne!(sandbox.read("rest.png"), sandbox.read("a.png"));
    assert_eq!(sandbox.read("a.png"), sandbox.read("b.png"), "weights from the file, or bound here");
}

#[test]
fn bind_on_the_gpu_says_which() {
    let sandbox = Sandbox::with_sphere_in_box();
    let cpu = sandbox.json("bind mesh.obj --cage cage.obj -g 16 --json");
    let gpu = sandbox.json("bind mesh.obj --cage cage.obj -g 16 --backend gpu --json");
    assert_eq!([&cpu["backend"], &gpu["backend"]], ["cpu", "gpu"]);
    assert!(cpu.get("adapter").is_none());
    let adapter = gpu["adapter"].as_str().unwrap();
    sandbox.run("bind mesh.obj --cage cage.obj -g 16 --backend gpu").success().stdout(contains(adapter));
    assert_eq!(gpu["cells"], cpu["cells"]);
}

#[test]
fn what_cannot_be_drawn_is_refused_before_the_work() {
    let sandbox = Sandbox::with_sphere_in_box();
    for (args, message) in [
        ("render mesh.obj -o p.jpg", "must end in .png"),
        ("render mesh.obj --size 10 -o p.png", "800x600"),
        ("render mesh.obj --size 9000x10 -o p.png", "8192"),
        ("render mesh.obj --view sideways -o p.png", "YAW,PITCH"),
        ("render mesh.obj --show weights -o p.png", "--cage"),
    ] {
        sandbox.run(args).code(2).stderr(contains(message));
    }
    let args = "render mesh.obj --cage cage.obj --show weights --column 8 -o p.png";
    sandbox.run(args).code(1).stderr(contains("the cage has 8 vertices"));
}
