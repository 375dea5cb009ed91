//! Tests of `cagework refit`, which deforms many models in one cage with one solve.

use std::time::{Duration, SystemTime};

use predicates::prelude::*;
use predicates::str::contains;

use crate::rigs;
use crate::support::{CORNERS, Sandbox, box_obj, sphere_obj};

/// A folder with the spheres `a.obj` and `b.obj`, their cage `cage.obj`, and a pose of it, `wide.obj`.
fn spheres() -> Sandbox {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.write("a.obj", sphere_obj(0.7));
    sandbox.write("b.obj", sphere_obj(0.5));
    sandbox.write("wide.obj", box_obj(&CORNERS.map(|[x, y, z]| [1.5 * x, y, z + 0.1 * x])));
    sandbox
}

const REFIT: &str = "refit --cage cage.obj --pose wide.obj -g 8 -o out";

/// Asserts that the files in `out` are identical to what `bind` and `deform` write for each model.
fn assert_same_as_deform(sandbox: &Sandbox, names: &[&str], bind: &str, deform: &str) {
    for name in names {
        sandbox.run(&format!("bind {name} --cage cage.obj --weights w.npz {bind}")).success();
        let alone =
            format!("deform {name} --cage cage.obj --weights w.npz --pose wide.obj -o alone_{name} {deform}");
        sandbox.run(&alone).success();
        let [together, alone] =
            [format!("out/{name}"), format!("alone_{name}")].map(|file| sandbox.read(&file));
        assert!(together == alone, "{name}: {} and {} bytes", together.len(), alone.len());
    }
}

#[test]
fn refit_equals_bind_and_deform_of_each_model() {
    // The models are two rigged ones, of which one is wider than the cage, and one without a rig.
    let sandbox = rigs::bound();
    sandbox.run("deform humanoid.glb --cage cage.obj --weights w.npz --pose cage.obj -o shape.obj").success();
    sandbox
        .run("deform humanoid.glb --cage cage.obj --weights w.npz --pose wide.obj -o larger.vrm")
        .success();
    let refit = "refit humanoid.glb larger.vrm shape.obj --cage cage.obj --pose wide.obj -g 24 -o out";
    let names = ["humanoid.glb", "larger.vrm", "shape.obj"];
    for (bind, deform) in [("", "--joints turn"), ("--sparsify 1e-3 --static", "--static")] {
        let options = format!("{} {deform}", bind.trim_end_matches("--static"));
        let done = sandbox.json(&format!("{refit} {options} --json"));
        assert_eq!([&done["written"], &done["failed"], &done["skipped"]], [3, 0, 0]);
        assert_same_as_deform(&sandbox, &names, &format!("-g 24 {bind}"), deform);
        let joints = &done["models"][0]["joints"];
        assert_eq!((joints == 16, joints.is_null()), (bind.is_empty(), !bind.is_empty()), "{done}");
    }
}

#[test]
fn parts_missing_in_some_models_are_notices_and_in_all_an_error() {
    let sandbox = rigs::bound();
    sandbox
        .run("deform humanoid.glb --cage cage.obj --weights w.npz --pose wide.obj -o larger.glb")
        .success();
    // This model has no named parts.
    sandbox.run("deform humanoid.glb --cage cage.obj --weights w.npz --pose cage.obj -o shape.obj").success();
    let parts = "--mask joint:head=0.5 --rigid joint:spine";
    let refit = "refit humanoid.glb larger.glb shape.obj --cage cage.obj --pose wide.obj -g 24 -o out";
    let done = sandbox.json(&format!("{refit} {parts} --json"));
    assert_same_as_deform(&sandbox, &["humanoid.glb", "larger.glb"], "-g 24", parts);
    assert_same_as_deform(&sandbox, &["shape.obj"], "-g 24", "");
    let notices = &done["models"][2]["notices"];
    let expected =
        ["joint:spine", "joint:head"].map(|name| format!("this model has no part called '{name}'"));
    assert!(
        expected.iter().all(|text| notices.as_array().unwrap().contains(&text.as_str().into())),
        "{notices}"
    );
    sandbox
        .run(&format!("{refit} {parts} --rigid Hed"))
        .code(1)
        .stdout(contains("refitted 3 of 3 models"))
        .stderr(contains("error: no model has a part called 'Hed'\nhint: "));
}

#[test]
fn cage_is_solved_per_model_if_its_fields_exceed_half_of_the_memory_limit() {
    let sandbox = spheres();
    let refit = "refit a.obj b.obj --cage cage.obj --pose wide.obj -g 64 -o out --json";
    assert!(sandbox.json(refit)["solve_ms"].as_f64().is_some());
    // The fields take 64^3 * 32 bytes = 8 MiB. With the solver's memory they exceed half of 64 MiB, but a single bind
    // stays below 64 MiB.
    let done = sandbox.json(&format!("{refit} --memory-limit 64"));
    assert!(done["solve_ms"].is_null());
    assert!(done["notices"][0].as_str().unwrap().contains("do not fit in half of 64 MiB"), "{done}");
    assert_same_as_deform(&sandbox, &["a.obj", "b.obj"], "-g 64", "");
}

#[test]
fn failed_models_are_reported_and_the_others_are_written() {
    let sandbox = spheres();
    sandbox.write("broken.glb", "glTF");
    sandbox.write("far.obj", box_obj(&CORNERS.map(|[x, y, z]| [x + 9.0, y, z])));
    let refit = format!("{REFIT} a.obj missing.obj broken.glb far.obj b.obj");
    sandbox
        .run(&refit)
        .code(1)
        .stdout(
            contains("wrote out/a.obj: 178 vertices")
                .and(contains("wrote out/b.obj"))
                .and(contains("refitted 2 of 5 models, 0 skipped, 3 failed; one solve of ")),
        )
        .stderr(
            contains("error: missing.obj: there is no such file\n")
                .and(contains("error: broken.glb: "))
                .and(contains("error: far.obj: none of the model's 8 vertices is inside the cage"))
                .and(contains("error: 3 of 5 models failed\nhint: ")),
        );
    let names = |folder: &str| {
        let entries = std::fs::read_dir(sandbox.path(folder)).unwrap();
        let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    };
    assert_eq!(names("out"), ["a.obj", "b.obj"]);
    let output = sandbox.run(&format!("{refit} --json")).code(1).get_output().stdout.clone();
    let done: serde_json::Value = serde_json::from_slice(&output).unwrap();
    let states: Vec<_> = done["models"].as_array().unwrap().iter().map(|m| m["state"].clone()).collect();
    assert_eq!(states, ["written", "failed", "failed", "failed", "written"]);
    assert_eq!(done["models"][1]["error"], "missing.obj: there is no such file");

    // An invalid pose makes the command fail before it reads any model.
    sandbox.write("short.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    sandbox
        .run("refit a.obj b.obj --cage cage.obj --pose short.obj -o other")
        .code(1)
        .stdout("")
        .stderr(contains("3 vertices").and(contains("8")));
    assert!(names("other").is_empty());
}

#[test]
fn models_with_the_same_output_are_rejected_before_the_work() {
    let sandbox = spheres();
    std::fs::create_dir(sandbox.path("more")).unwrap();
    sandbox.write("more/a.obj", sphere_obj(0.3));
    sandbox
        .run(&format!("{REFIT} a.obj b.obj more/a.obj"))
        .code(1)
        .stdout("")
        .stderr(contains("a.obj and more/a.obj would both be written to out/a.obj\nhint: "));
    sandbox.write("list.txt", "b.obj\na.obj\n");
    sandbox
        .run(&format!("{REFIT} a.obj --manifest list.txt"))
        .code(1)
        .stderr(contains("a.obj is given twice\nhint: give each model once"));
    // A `.gltf` model is written as `.glb`.
    sandbox.run(&format!("{REFIT} x.gltf x.glb")).code(1).stderr(contains("both be written to out/x.glb"));
    assert!(!sandbox.path("out").exists());
    let in_place = REFIT.replace("-o out", "-o .");
    sandbox.run(&format!("{in_place} b.obj more/a.obj")).code(1).stdout("").stderr(contains("is an input"));
    assert_eq!(sandbox.read("b.obj"), sphere_obj(0.5).as_bytes());
}

/// Writing the first model would overwrite a buffer or material that the second model needs.
#[test]
fn outputs_that_later_models_refer_to_are_rejected_before_anything_is_written() {
    let sandbox = spheres();
    std::fs::create_dir_all(sandbox.path("kit/out")).unwrap();
    let named = "newmtl m\nKd 1 0 0\nmap_Kd out/a.obj\n";
    let scene = |uri: &str| {
        format!(r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":4,"uri":"{uri}"}}]}}"#)
    };
    let obj = |library: &str| format!("mtllib {library}\n{}", sphere_obj(0.3));
    std::os::unix::fs::symlink("out/a.obj", sandbox.path("kit/link.bin")).unwrap();
    for (model, content) in [
        ("kit/b.obj", obj("out/a.obj")),
        ("kit/b.obj", obj(".//x/../out/./a.obj")),
        ("kit/b.obj", obj("textured.mtl")),
        ("kit/b.gltf", scene("out/%61.obj")),
        ("kit/b.gltf", scene("link.bin")),
    ] {
        std::fs::create_dir_all(sandbox.path("kit/x")).unwrap();
        sandbox.write("kit/textured.mtl", named);
        sandbox.write("kit/out/a.obj", named);
        sandbox.write(model, &content);
        let refit = format!("{} a.obj {model}", REFIT.replace("-o out", "-o kit/out"));
        sandbox.run(&refit).code(1).stdout("").stderr(contains(format!(
            "error: kit/out/a.obj: would be overwritten, but {model} names it\nhint: "
        )));
        assert_eq!(sandbox.read("kit/out/a.obj"), named.as_bytes(), "{content}");
        std::fs::remove_file(sandbox.path(model)).unwrap();
    }
    // A file of the same name in another folder does not conflict, but a link to the referenced file does.
    sandbox.write("kit/b.obj", obj("textured.mtl"));
    sandbox.write("kit/textured.mtl", "newmtl m\nmap_Kd a.obj\n");
    sandbox.run(&format!("{REFIT} a.obj kit/b.obj")).success();
    std::fs::remove_file(sandbox.path("out/a.obj")).unwrap();
    std::os::unix::fs::symlink("../kit/textured.mtl", sandbox.path("out/a.obj")).unwrap();
    sandbox
        .run(&format!("{REFIT} a.obj kit/b.obj"))
        .code(1)
        .stderr(contains("out/a.obj: would be overwritten, but kit/b.obj names it"));
}

#[test]
fn resume_skips_outputs_newer_than_their_inputs() {
    let sandbox = spheres();
    sandbox.write("list.txt", "\u{feff}# garments\r\n\r\n  a.obj\r\nb.obj\n");
    let now = SystemTime::now();
    let set_age = |name: &str, hours: u64| {
        let file = std::fs::File::options().append(true).open(sandbox.path(name)).unwrap();
        file.set_modified(now - Duration::from_secs(3600 * hours)).unwrap();
    };
    for name in ["a.obj", "b.obj", "cage.obj", "wide.obj"] {
        set_age(name, 5);
    }
    let resume = format!("{REFIT} --manifest list.txt --resume --json");
    let states = || {
        let done = sandbox.json(&resume);
        [0, 1].map(|k| done["models"][k]["state"].as_str().unwrap().to_owned())
    };
    assert_eq!(states(), ["written", "written"]);
    assert_eq!(states(), ["skipped", "skipped"]);
    let all_skipped = sandbox.json(&resume);
    assert!(all_skipped["solve_ms"].is_null(), "no model needed the solve");
    // The outputs are 3 hours old. An input of the same age counts as newer, because file times are coarse.
    let older = || ["out/a.obj", "out/b.obj"].map(|name| set_age(name, 3));
    for (name, hours, expected) in [
        ("b.obj", 2, ["skipped", "written"]),
        ("cage.obj", 2, ["written", "written"]),
        ("wide.obj", 3, ["written", "written"]),
        ("wide.obj", 4, ["skipped", "skipped"]),
    ] {
        older();
        set_age(name, hours);
        assert_eq!(states(), expected, "{name} of {hours} hours");
        set_age(name, 5);
    }
    sandbox.write("list.txt", "# nothing\n");
    sandbox.run(&resume).code(1).stderr(contains("list.txt: names no model"));
}
