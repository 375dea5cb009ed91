use predicates::str::contains;

use crate::support::{CORNERS, Sandbox, box_obj, glb_json, obj_positions, sphere_obj};

#[test]
fn generated_cage_encloses_the_model() {
    let sandbox = Sandbox::with_sphere_in_box();
    let made = sandbox.json("cage mesh.obj -o auto.obj --vertices 40 --json");
    // A sphere has no limbs.
    assert_eq!(made["kind"], "shell");
    assert!(made["report"]["refusal"].as_str().unwrap().contains("no limbs"));
    sandbox.run("cage mesh.obj -o rings.obj --kind skeleton").code(1).stderr(contains("no limbs"));
    assert!((12..=44).contains(&made["vertices"].as_u64().unwrap()));
    assert_eq!(made["report"]["target_met"], true);
    let check = sandbox.json("check auto.obj --mesh mesh.obj -g 32 --json");
    assert_eq!(check["valid"], true);
    assert_eq!(check["encloses"], true);
    let bound = sandbox.json("bind mesh.obj --cage auto.obj -g 16 --json");
    assert_eq!(bound["outside_vertices"], 0);
    assert_eq!(bound["cage_vertices"], made["vertices"]);
}

#[test]
fn every_kind_of_cage_can_be_bound() {
    let sandbox = Sandbox::with_sphere_in_box();
    for (name, at_most) in [("auto:24", 27), ("shell:24", 27), ("hull:16", 18), ("auto", 88), ("box:1", 8)] {
        let bound = sandbox.json(&format!("bind mesh.obj --cage {name} -g 16 --save-cage c.obj --json"));
        assert!(bound["cage_vertices"].as_u64().unwrap() <= at_most, "{name}: {}", bound["cage_vertices"]);
        assert_eq!(bound["outside_vertices"], 0, "{name}");
        sandbox
            .run("check c.obj --mesh mesh.obj")
            .success()
            .stdout(contains("all vertices of the model are inside"));
    }
    for (name, message) in
        [("auto:5", "from 8 to 400"), ("hull:x", "whole number"), ("box:99", "from 1 to 16")]
    {
        sandbox.run(&format!("bind mesh.obj --cage {name}")).code(2).stderr(contains(message));
    }
}

#[test]
fn cage_is_written_as_glb_too() {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.run("cage mesh.obj -o cage.glb --kind hull").success().stdout(contains("wrote cage.glb"));
    assert_eq!(glb_json(&sandbox.read("cage.glb"))["asset"]["version"], "2.0");
    assert_eq!(sandbox.json("info cage.glb --json")["cage"]["valid"], true);
}

#[test]
fn cage_of_a_symmetric_model_is_symmetric_unless_disabled() {
    let sandbox = Sandbox::with_sphere_in_box();
    let made = sandbox.json("cage mesh.obj -o a.obj --vertices 30 --json");
    assert_eq!(made["report"]["mirror"], "x");
    let made = sandbox.json("cage mesh.obj -o b.obj --vertices 30 --symmetry none --json");
    assert!(made["report"]["mirror"].is_null());
}

#[test]
fn check_names_the_fault_and_repair_fixes_it() {
    let sandbox = Sandbox::new();
    sandbox.write("open.obj", box_obj(&CORNERS).replace("f 5 6 8 7\n", "").replace("f 1 2 6 5", "f 5 6 2 1"));
    let assert = sandbox.run("check open.obj --json").code(1).stderr(contains("cannot be used as a cage"));
    let check: serde_json::Value = serde_json::from_slice(&assert.get_output().stdout).unwrap();
    assert_eq!(check["valid"], false);
    let problem = &check["problems"][0];
    assert_eq!((problem["code"].as_str(), problem["count"].as_u64()), (Some("open_edge"), Some(4)));
    assert_eq!(problem["places"]["edges"].as_array().unwrap().len(), 4);
    assert_eq!(problem["fixes"][0]["repair"], "fill_holes");
    sandbox.run("check open.obj").code(1).stdout(contains("--repair fill-holes"));

    let repaired = sandbox.json("check open.obj --repair fill-holes,flip -o repaired.obj --json");
    assert_eq!(repaired["valid"], true);
    assert_eq!(repaired["repaired"].as_array().unwrap().len(), 2);
    assert_eq!(sandbox.json("info repaired.obj --json")["cage"]["notices"].as_array().unwrap().len(), 0);
}

#[test]
fn self_intersecting_cage_gives_the_same_warning_in_info_check_and_bind() {
    let sandbox = Sandbox::with_sphere_in_box();
    sandbox.run("cage mesh.obj -o box.obj --kind box --divisions 3").success();
    let text = String::from_utf8(sandbox.read("box.obj")).unwrap();
    let mut is_pushed = false;
    // Push a vertex in the middle of one side of the cage through the opposite side.
    let pushed = text.lines().map(|line| {
        let p: Vec<f64> = line.split(' ').skip(1).filter_map(|x| x.parse().ok()).collect();
        if is_pushed || !line.starts_with("v ") || p[1].abs().max(p[2].abs()) > -0.5 * p[0] {
            return format!("{line}\n");
        }
        is_pushed = true;
        format!("v {} {} {}\n", -2.0 * p[0], p[1], p[2])
    });
    sandbox.write("through.obj", pushed.collect::<String>());
    let check = sandbox.json("check through.obj --json");
    let problem = &check["problems"][0];
    assert_eq!((&check["valid"], problem["severity"].as_str()), (&true.into(), Some("warning")));
    let message = problem["message"].as_str().unwrap();
    assert!(message.contains("goes through itself") && message.contains("the first of faces"), "{message}");
    let info = &sandbox.json("info through.obj --json")["cage"];
    assert_eq!((&info["valid"], &info["notices"]), (&true.into(), &serde_json::json!([message])));
    let bound = sandbox.json("bind mesh.obj --cage through.obj -g 16 --json");
    assert!(bound["notices"].as_array().unwrap().contains(&message.into()), "{}", bound["notices"]);
}

#[test]
fn small_cage_grows_around_the_model() {
    let sandbox = Sandbox::with_sphere_in_box();
    let half = CORNERS.map(|c| c.map(|x| 0.6 * x));
    sandbox.write("small.obj", box_obj(&half));
    let before = sandbox.json("check small.obj --mesh mesh.obj --json");
    assert_eq!(before["encloses"], false);
    let after = sandbox.json("check small.obj --mesh mesh.obj --repair grow -o grown.obj --json");
    assert_eq!(after["encloses"], true);
    sandbox.run("check small.obj --repair grow -o other.obj").code(1).stderr(contains("--mesh"));
}

#[test]
fn one_cage_encloses_models_and_folders_of_models() {
    let sandbox = Sandbox::with_sphere_in_box();
    std::fs::create_dir(sandbox.path("clothes")).unwrap();
    let beside = |line: &str| match line.strip_prefix("v ").and_then(|xyz| xyz.split_once(' ')) {
        Some((x, yz)) => format!("v {} {yz}\n", x.parse::<f64>().unwrap() + 0.8),
        None => format!("{line}\n"),
    };
    sandbox.write("clothes/b.obj", sphere_obj(0.5).lines().map(beside).collect::<String>());
    sandbox.write("clothes/c.obj", sphere_obj(0.8));
    sandbox.write("clothes/.hidden.obj", "damaged");
    sandbox.write("clothes/notes.txt", "sizes");
    let together = "cage mesh.obj clothes -o clothes/cage.obj";
    let made = sandbox.json(&format!("{together} --kind shell --vertices 60 --json"));
    assert_eq!((&made["models"], &made["kind"]), (&3.into(), &"shell".into()));
    for model in ["mesh.obj", "clothes/b.obj", "clothes/c.obj"] {
        let check = sandbox.json(&format!("check clothes/cage.obj --mesh {model} --json"));
        assert_eq!((&check["valid"], &check["encloses"]), (&true.into(), &true.into()), "{model}");
    }
    // The folder `clothes` now also contains the cage of the first run. The command leaves it out, because it is the
    // output.
    sandbox.run(&format!("{together} --kind box")).success().stdout(contains("a box around 3 models of"));
    // The spheres reach from -0.8 to 1.3 in x.
    sandbox.run("cage clothes/b.obj clothes/c.obj -o box.obj --kind box --margin 0.001").success();
    let xs = obj_positions(&sandbox.read("box.obj")).into_iter().map(|p| p[0]);
    assert!(
        (xs.clone().fold(0.0, f64::min) + 0.8).abs() < 0.01 && (xs.fold(0.0, f64::max) - 1.3).abs() < 0.01
    );

    std::fs::create_dir(sandbox.path("empty")).unwrap();
    sandbox
        .run("cage mesh.obj empty -o out.obj")
        .code(1)
        .stderr(contains("empty: the folder has no models (.glb, .vrm, .gltf, .fbx, .obj"));
    sandbox
        .run("cage mesh.obj missing.obj -o out.obj")
        .code(1)
        .stderr(contains("missing.obj: there is no such"));
    sandbox
        .run("cage clothes -o out.obj --around-clip Run")
        .code(1)
        .stderr(contains("there is no clip 'Run'"));
}
