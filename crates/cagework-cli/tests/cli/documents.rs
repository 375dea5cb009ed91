//! Runs every `cagework` command in the code blocks of README.md and docs/cli.md.

use std::path::Path;

use cagework_cage::samples;
use cagework_io::write_mesh_glb;

use crate::support::Sandbox;

/// A folder with the files that the documents name. The humanoid sample stands for every mesh.
fn files() -> Sandbox {
    let sandbox = Sandbox::new();
    let sample = samples::build("humanoid").unwrap();
    let positions = &sample.mesh.positions;
    assert!(positions.len() > 1680, "rear.json grabs vertex 1680");
    let horse = write_mesh_glb("horse", &sample.mesh, &sample.colours, None).unwrap();
    for name in ["horse", "shirt", "body", "jacket", "trousers", "boots", "saddle"] {
        sandbox.write(&format!("{name}.glb"), &horse);
    }
    for name in ["fox.glb", "avatar.vrm"] {
        let rigged = write_mesh_glb(name, &sample.mesh, &sample.colours, sample.rig.as_ref()).unwrap();
        sandbox.write(name, rigged);
    }
    sandbox.run("cage horse.glb -o cage.obj").success();
    sandbox.run("cage fox.glb -o fox-cage.obj").success();
    sandbox.run("bind horse.glb --cage cage.obj -g 16 --weights horse.npz").success();
    for (cage, poses) in [
        ("cage.obj", &["gallop.obj", "bent.obj", "a.obj", "b.obj", "body.obj", "bulky.obj"][..]),
        ("fox-cage.obj", &["long-legs.obj"]),
    ] {
        for pose in poses {
            sandbox.write(
                pose,
                if *pose == "body.obj" { sandbox.read(cage) } else { wider(&sandbox, cage).into_bytes() },
            );
        }
    }
    for weights in ["shirt.npz", "body.npz"] {
        sandbox.write(weights, sandbox.read("horse.npz"));
    }
    sandbox
        .run("deform horse.glb --cage cage.obj --weights horse.npz --pose gallop.obj -o shirt-large.glb")
        .success();
    let top = positions.iter().map(|p| p.y).fold(0.0, f32::max);
    for name in ["inside.obj", "moved.obj"] {
        sandbox.write(name, format!("v 0 {} 0\np 1\n", 0.65 * top));
    }
    let landmarks = (0..positions.len())
        .step_by(positions.len() / 8)
        .map(|v| format!(r#"{{"vertex": {v}, "to": [{}, {}, {}]}}"#, positions[v].x, positions[v].y, 0.1))
        .collect::<Vec<_>>();
    sandbox.write("body.json", format!("[{}]", landmarks.join(",")));
    for name in ["probes.csv", "sliced.csv"] {
        sandbox.write(name, format!("x,y,z\n0,{},0\n", 0.65 * top));
    }
    sandbox.write("plant.splat", crate::splats::capture());
    sandbox.run("cage plant.splat -o plant-cage.obj").success();
    sandbox.write("bent-plant.obj", wider(&sandbox, "plant-cage.obj"));
    sandbox.write("garments.txt", "jacket.glb\ntrousers.glb\n");
    sandbox
}

/// The text of a cage file in the folder, stretched along x.
fn wider(sandbox: &Sandbox, cage: &str) -> String {
    let text = String::from_utf8(sandbox.read(cage)).unwrap();
    let stretch = |line: &str| match line.strip_prefix("v ").and_then(|xyz| xyz.split_once(' ')) {
        Some((x, rest)) => format!("v {} {rest}\n", 1.1 * x.parse::<f64>().unwrap()),
        None => format!("{line}\n"),
    };
    text.lines().map(stretch).collect()
}

/// Language and lines of each code block of a Markdown text.
fn blocks(text: &str) -> Vec<(&str, Vec<&str>)> {
    let mut blocks = Vec::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if let Some(language) = line.strip_prefix("```") {
            blocks.push((language, lines.by_ref().take_while(|line| *line != "```").collect()));
        }
    }
    blocks
}

#[test]
fn commands_of_the_documents_run() {
    let files = files();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut n_commands = 0;
    for document in ["README.md", "docs/cli.md"] {
        let text = std::fs::read_to_string(root.join(document)).unwrap();
        for (language, lines) in blocks(&text) {
            if language == "json" {
                files.write("rear.json", lines.join("\n"));
            }
        }
        for (_, lines) in blocks(&text).into_iter().filter(|block| block.0 == "sh") {
            // Run each code block in its own copy of the folder.
            let sandbox = Sandbox::new();
            for name in files.names() {
                sandbox.write(&name, files.read(&name));
            }
            for line in lines.iter().filter_map(|line| line.strip_prefix("cagework ")) {
                let command = line.split('#').next().unwrap_or_default();
                sandbox.run(command).success();
                n_commands += 1;
            }
        }
    }
    assert!(n_commands > 30, "{n_commands} commands");
}
