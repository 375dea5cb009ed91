//! Tests of `cagework refit`, which deforms many models in one cage with one solve.

use std::time::{Duration, SystemTime};

use cagework_io::Model;
use predicates::prelude::*;
use predicates::str::contains;
use serde_json::Value;

use crate::rigs;
use crate::support::{CORNERS, Sandbox, box_obj, glb_json, sphere_obj};

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
    // Two rigged models, one of them wider than the cage, and a model without a rig.
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
fn a_folder_stands_for_its_models() {
    let sandbox = spheres();
    sandbox.run(&REFIT.replace("refit", "refit .")).success().stdout(contains("refitted 3 of 3 models"));
    let mut names: Vec<_> =
        std::fs::read_dir(sandbox.path("out")).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    // The cage and the pose are in the folder too, but are not models to refit.
    assert_eq!(names, ["a.obj", "b.obj", "mesh.obj"]);
    sandbox.run(&format!("{REFIT} . a.obj")).code(1).stderr(contains("would both be written to out/a.obj"));
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
    let done: Value = serde_json::from_slice(&output).unwrap();
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
            "error: kit/out/a.obj: would be overwritten, but {model} uses it\nhint: "
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
        .stderr(contains("out/a.obj: would be overwritten, but kit/b.obj uses it"));
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

/// A GLB with its JSON and its buffer changed.
fn edited(glb: &[u8], edit: impl Fn(&mut Value, &mut Vec<u8>)) -> Vec<u8> {
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let (mut json, mut bin) = (glb_json(glb), glb[28 + length..].to_vec());
    edit(&mut json, &mut bin);
    let mut text = serde_json::to_vec(&json).unwrap();
    text.resize(text.len().next_multiple_of(4), b' ');
    let word = |n: usize| (n as u32).to_le_bytes();
    let total = 28 + text.len() + bin.len();
    [&glb[..8], &word(total), &word(text.len()), b"JSON", &text, &word(bin.len()), b"BIN\0", &bin].concat()
}

/// Positions of all nodes at a time of the first clip.
fn places(glb: &[u8], seconds: f32) -> Vec<glam::Vec3> {
    let model = Model::read_with_clips("a.glb", glb, &mut |_| None, u64::MAX).unwrap();
    model.player().unwrap().unwrap().pose_at(Some(0), seconds, &[]).origins
}

#[test]
fn clips_without_a_mesh_follow_the_body() {
    let sandbox = rigs::bound();
    let body = sandbox.read("humanoid.glb");
    let clips = |prefix: &str| {
        edited(&body, |json, _| {
            for key in ["meshes", "skins", "materials"] {
                json.as_object_mut().unwrap().remove(key);
            }
            for node in json["nodes"].as_array_mut().unwrap() {
                let node = node.as_object_mut().unwrap();
                node.remove("mesh");
                node.remove("skin");
                let name = format!("{prefix}{}", node["name"].as_str().unwrap());
                node.insert("name".into(), name.into());
            }
        })
    };
    sandbox.write("walk.glb", clips("mixamorig:"));
    sandbox.write("other.glb", clips("x"));
    let nameless = edited(&body, |json, _| {
        for node in json["nodes"].as_array_mut().unwrap() {
            node.as_object_mut().unwrap().remove("name");
        }
    });
    sandbox.write("nameless.glb", nameless);
    let refit = "refit walk.glb --cage cage.obj --pose wide.obj -g 24 -o out";
    sandbox.run(refit).code(1).stderr(contains("walk.glb: it has clips, but no triangles"));
    let done = sandbox.json(&format!("{refit} --skeleton humanoid.glb --json"));
    assert!(done["models"][0]["joints_moved"].as_u64().unwrap() >= 6, "{done}");
    sandbox.run("bind humanoid.glb --cage cage.obj -g 24 --weights w.npz").success();
    sandbox.run("deform humanoid.glb --cage cage.obj --weights w.npz --pose wide.obj -o alone.glb").success();
    let [together, alone] = ["out/walk.glb", "alone.glb"].map(|name| sandbox.read(name));
    for seconds in [0.0, 0.3, 1.1, 2.0] {
        let pairs = places(&together, seconds).into_iter().zip(places(&alone, seconds));
        let off = pairs.map(|(a, b)| a.distance(b)).fold(0.0, f32::max);
        assert!(off < 1e-5, "{seconds} s: {off:e}");
    }
    for (args, message) in [
        ("other.glb --skeleton humanoid.glb", "none of its nodes has the name of a joint of the skeleton"),
        ("walk.glb --skeleton nameless.glb", "none of its nodes has the name of a joint of the skeleton"),
        ("walk.glb --skeleton cage.obj", "cage.obj: the model has no skeleton"),
        ("walk.glb --skeleton missing.glb", "missing.glb: there is no such file"),
    ] {
        let refit = format!("refit {args} --cage cage.obj --pose wide.obj -g 24 -o out2");
        sandbox.run(&refit).code(1).stderr(contains(message));
    }
    // With --ground, a clip gets the vertical offset of the body's clip with the same name and length. Other clips are
    // offset so that their lowest joints keep their height; the height of the soles is then approximate.
    let taller = |line: &str| {
        let Some(xyz) = line.strip_prefix("v ") else { return line.to_owned() };
        let [x, y, z] = [0, 1, 2].map(|k| xyz.split(' ').nth(k).unwrap().parse::<f64>().unwrap());
        format!("v {x} {} {z}", 1.3 * y - 0.2)
    };
    let cage = String::from_utf8(sandbox.read("cage.obj")).unwrap();
    sandbox.write("tall.obj", cage.lines().map(taller).collect::<Vec<_>>().join("\n"));
    let renamed =
        edited(&sandbox.read("walk.glb"), |json, _| json["animations"][0]["name"] = "Stroll".into());
    sandbox.write("stroll.glb", renamed);
    let tall = "--cage cage.obj --pose tall.obj -g 24 --skeleton humanoid.glb";
    let notice = "note: in 2 models clips may travel different distances and joints may turn differently";
    sandbox.write("twin.glb", &body);
    let alone = tall.replace("--skeleton humanoid.glb", "");
    sandbox.run(&format!("refit humanoid.glb twin.glb {alone} -o apart")).success().stdout(contains(notice));
    sandbox
        .run(&format!("refit humanoid.glb walk.glb stroll.glb {tall} -o free"))
        .success()
        .stdout(contains("from their own vertices").not());
    sandbox.run(&format!("refit humanoid.glb walk.glb stroll.glb {tall} --ground -o stands")).success();
    sandbox
        .run("deform humanoid.glb --cage cage.obj --weights w.npz --pose tall.obj --ground -o alone.glb")
        .success();
    assert!(sandbox.read("stands/humanoid.glb") == sandbox.read("alone.glb"));
    let heights = |name: &str| -> Vec<f32> {
        let glb = sandbox.read(name);
        places(&glb, 0.7).iter().map(|p| p.y).collect()
    };
    let largest = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    let body = heights("stands/humanoid.glb");
    assert!(largest(&heights("free/humanoid.glb"), &body) > 0.1);
    assert!(largest(&heights("stands/walk.glb"), &body) < 1e-5);
    let stroll = largest(&heights("stands/stroll.glb"), &body);
    assert!(stroll < 0.02, "ankles and soles are not parallel in all poses: {stroll}");
    sandbox
        .run("refit humanoid.glb walk.glb --ground --cage cage.obj --pose wide.obj -g 24 -o out2")
        .code(1)
        .stderr(contains("--ground would lift each model by a different height"));
}

#[test]
fn garments_of_one_rig_get_the_same_joints() {
    let sandbox = rigs::bound();
    let body = sandbox.read("humanoid.glb");
    // All vertices of the garment are skinned to the hips, as if the rest of the body were cut away.
    let garment = edited(&body, |json, bin| {
        let accessor = &json["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"];
        let accessor = &json["accessors"][accessor.as_u64().unwrap() as usize];
        let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let [start, length] =
            ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap_or(0) as usize);
        bin[start..start + length].fill(0);
    });
    sandbox.write("garment.glb", garment);
    // The cage encloses the upper half: the joints of the legs are outside.
    let corners = CORNERS.map(|[x, y, z]| [x, 1.45 + 0.55 * y, z]);
    sandbox.write("half.obj", box_obj(&corners));
    sandbox.write("bent.obj", box_obj(&corners.map(|[x, y, z]| [x + 0.2 * y, 1.2 * y, z])));
    let joints = |name: &str| {
        let json = glb_json(&sandbox.read(name));
        json["nodes"].as_array().unwrap().iter().map(|node| node["translation"].clone()).collect::<Vec<_>>()
    };
    let refit = |models: &str, out: &str| {
        sandbox.run(&format!("refit {models} --cage half.obj --pose bent.obj -g 16 -o {out}")).success();
    };
    refit("humanoid.glb garment.glb", "together");
    refit("garment.glb", "alone");
    assert_eq!(joints("together/garment.glb"), joints("together/humanoid.glb"));
    assert_ne!(
        joints("alone/garment.glb"),
        joints("together/humanoid.glb"),
        "the joints of the legs are outside"
    );
    refit("garment.glb --skeleton humanoid.glb", "by-name");
    assert_eq!(joints("by-name/garment.glb"), joints("together/humanoid.glb"));
}
