//! Tests of files that a model refers to: only regular files in its folder are read, and only images are embedded as
//! textures.

use std::fmt::Write as _;
use std::os::unix::fs::symlink;
use std::process::Command;
use std::time::Duration;

use predicates::prelude::*;
use predicates::str::contains;
use serde_json::{Value, json};

use crate::support::{Sandbox, glb_json};

/// Content that must not reach the output. It starts with a PNG signature, so that it passes as an image.
const SECRET: &[u8] = b"\x89PNG\r\n\x1a\nTOP-SECRET";
/// Time limit of commands that must not wait for a pipe.
const TIMEOUT: Duration = Duration::from_secs(20);

/// A glTF tetrahedron with an embedded buffer, and images with these URIs.
fn gltf(images: &[&str]) -> Value {
    let positions = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let corners = [0_u16, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];
    let positions = positions.as_flattened().iter().flat_map(|x| x.to_le_bytes());
    let mut uri = "data:application/octet-stream,".to_owned();
    for byte in positions.chain(corners.iter().flat_map(|i| i.to_le_bytes())) {
        write!(uri, "%{byte:02x}").unwrap();
    }
    json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 48 }, { "buffer": 0, "byteOffset": 48, "byteLength": 24 },
        ],
        "buffers": [{ "byteLength": 72, "uri": uri }],
        "images": images.iter().map(|uri| json!({ "uri": uri, "mimeType": "image/png" })).collect::<Vec<_>>(),
    })
}

/// A folder that contains an empty folder `model` and, outside of it, the file `secret.png`.
fn with_secret() -> Sandbox {
    let sandbox = Sandbox::new();
    std::fs::create_dir(sandbox.path("model")).unwrap();
    sandbox.write("secret.png", SECRET);
    sandbox
}

fn make_pipe(sandbox: &Sandbox, name: &str) {
    assert!(Command::new("mkfifo").arg(sandbox.path(name)).status().unwrap().success());
}

#[test]
fn files_outside_the_models_folder_are_not_embedded() {
    let sandbox = with_secret();
    symlink("../secret.png", sandbox.path("model/link.png")).unwrap();
    symlink("..", sandbox.path("model/above")).unwrap();
    let absolute = sandbox.path("secret.png").display().to_string();
    let names = [
        "../secret.png",
        "%2e%2e/secret.png",
        "textures/../../secret.png",
        "link.png",
        "above/secret.png",
        &absolute,
    ];
    std::fs::create_dir(sandbox.path("model/textures")).unwrap();
    sandbox.write("model/m.gltf", gltf(&names).to_string());
    let mut run = sandbox.run("bind model/m.gltf --cage box -g 8 -o out.glb").success();
    for name in names {
        run = run.stdout(contains(format!(
            "texture '{}' leads out of the model's folder: exports keep the reference",
            name.replace("%2e", ".")
        )));
    }
    let glb = sandbox.read("out.glb");
    assert!(!glb.windows(SECRET.len()).any(|w| w == SECRET));
    assert_eq!(glb_json(&glb)["images"][0]["uri"], "../secret.png");
}

#[test]
fn images_in_the_models_folder_are_embedded_even_through_links() {
    let sandbox = with_secret();
    std::fs::create_dir(sandbox.path("model/textures")).unwrap();
    sandbox.write("model/textures/inside.png", SECRET);
    symlink("textures/inside.png", sandbox.path("model/link.png")).unwrap();
    for name in ["textures/inside.png", "textures/../textures/inside.png", "link.png"] {
        sandbox.write("model/m.gltf", gltf(&[name]).to_string());
        sandbox
            .run("bind model/m.gltf --cage box -g 8 -o out.glb")
            .success()
            .stdout(contains("texture").not());
        assert!(sandbox.read("out.glb").windows(SECRET.len()).any(|w| w == SECRET), "{name}");
    }
}

/// The content of a file, not the `mimeType` in the model, decides whether it is an image.
#[test]
fn files_that_are_not_images_are_not_embedded() {
    let sandbox = with_secret();
    sandbox.write("model/notes.txt", "TOP-SECRET");
    sandbox.write("model/m.gltf", gltf(&["notes.txt", "data:image/png,TOP-SECRET"]).to_string());
    sandbox
        .run("bind model/m.gltf --cage box -g 8 -o out.glb")
        .success()
        .stdout(contains(
            "texture 'notes.txt' is not a PNG, JPEG, WebP or KTX2 image: exports keep the reference",
        ))
        .stdout(contains("texture 'data:image/png,TOP-SECRET' is not a PNG"));
    let json = glb_json(&sandbox.read("out.glb"));
    let uris: Vec<_> = json["images"].as_array().unwrap().iter().map(|image| &image["uri"]).collect();
    assert_eq!(uris, ["notes.txt", "data:image/png,TOP-SECRET"]);
}

#[test]
fn buffer_outside_the_models_folder_is_an_error_that_names_it() {
    let sandbox = with_secret();
    for (uri, message) in [
        ("../secret.png", "it needs the file '../secret.png', which leads out of the model's folder"),
        ("textures", "it needs the file 'textures', which is a folder"),
        ("gone.bin", "it needs the file 'gone.bin', which is missing"),
        ("data:;base64,???", "which is not a valid data: URI"),
    ] {
        let mut model = gltf(&[]);
        model["buffers"][0] = json!({ "byteLength": 18, "uri": uri });
        std::fs::create_dir_all(sandbox.path("model/textures")).unwrap();
        sandbox.write("model/m.gltf", model.to_string());
        sandbox.run("info model/m.gltf").code(1).stderr(contains("model/m.gltf").and(contains(message)));
    }
}

#[test]
fn materials_of_an_obj_come_from_its_folder() {
    let sandbox = with_secret();
    sandbox.write("paint.mtl", "newmtl a\nKd 1 0 0\n");
    sandbox.write("model/own.mtl", "newmtl b\nmap_Kd ../secret.png\nnewmtl c\nmap_Kd own.mtl\n");
    sandbox.write(
        "model/m.obj",
        "mtllib ../paint.mtl\nmtllib own.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl b\nf 1 2 3\n",
    );
    sandbox
        .run("info model/m.obj")
        .success()
        .stdout(contains(
            "material file '../paint.mtl' leads out of the model's folder: its materials are not drawn",
        ))
        .stdout(contains("texture '../secret.png' leads out of the model's folder: it is not drawn"))
        .stdout(contains("texture 'own.mtl' is not a PNG, JPEG, WebP or KTX2 image: it is not drawn"));
}

#[test]
fn pipes_devices_and_folders_are_rejected_without_blocking() {
    let sandbox = with_secret();
    make_pipe(&sandbox, "model/pipe");
    make_pipe(&sandbox, "pipe.obj");
    std::fs::create_dir(sandbox.path("model/folder")).unwrap();
    symlink("/dev/zero", sandbox.path("model/zero")).unwrap();
    sandbox.write("model/m.gltf", gltf(&["pipe", "folder", "zero"]).to_string());
    let run = |args: &str| sandbox.command(args).timeout(TIMEOUT).assert();
    run("info model/m.gltf")
        .success()
        .stdout(contains("texture 'pipe' is a pipe or a device, not a regular file"))
        .stdout(contains("texture 'folder' is a folder"))
        .stdout(contains("texture 'zero' leads out of the model's folder"));
    sandbox.write("model/m.obj", "mtllib pipe\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    run("info model/m.obj").success().stdout(contains("material file 'pipe' is a pipe or a device"));
    let mut model = gltf(&[]);
    model["buffers"][0]["uri"] = "pipe".into();
    sandbox.write("model/m.gltf", model.to_string());
    run("info model/m.gltf").code(1).stderr(contains("the file 'pipe', which is a pipe or a device"));
    for file in ["pipe.obj", "/dev/zero"] {
        let message = contains(format!("{file}: is a pipe or a device, not a regular file"));
        run(&format!("info {file}")).code(1).stderr(message.clone());
        run(&format!("bind model/m.obj --cage {file}")).code(1).stderr(message.clone());
        let args = format!("deform model/m.obj --cage box --weights {file} --pose {file} -o out.obj");
        run(&args).code(1).stderr(message);
    }
}

/// Unescaped control characters could set the terminal title, clear the screen or fake a message.
#[test]
fn control_characters_in_files_are_printed_as_escapes() {
    let sandbox = with_secret();
    let escape = || contains("\u{1b}").or(contains("\u{202e}"));
    sandbox.write("model/m.obj", "v 0 0 \u{1b}]0;mine\u{7}\n");
    sandbox
        .run("info model/m.obj")
        .code(1)
        .stderr(contains(r"z coordinate is '\u{1b}]0;mine\u{7}'").and(escape().not()));
    let mut model = gltf(&["gone%1b[2J%0aerror: mine", "\u{202e}gnp.exe"]);
    model["nodes"][0]["name"] = "\u{1b}[31mred".into();
    model["nodes"][0]["skin"] = 0.into();
    model["skins"] = json!([{ "joints": [0] }]);
    sandbox.write("model/m\u{1b}.gltf", model.to_string());
    sandbox
        .run("info model/m\u{1b}.gltf")
        .success()
        .stdout(contains(r"model/m\u{1b}.gltf"))
        .stdout(contains(r"texture 'gone\u{1b}[2J\nerror: mine' is missing"))
        .stdout(contains(r"texture '\u{202e}gnp.exe' is missing"))
        .stdout(escape().not());
    model["buffers"][0]["uri"] = "gone%1b.bin".into();
    sandbox.write("model/m\u{1b}.gltf", model.to_string());
    sandbox
        .run("info model/m\u{1b}.gltf")
        .code(1)
        .stderr(contains(r"m\u{1b}.gltf: it needs the file 'gone\u{1b}.bin', which").and(escape().not()));
}

/// A name of 100,000 characters would fill the terminal for a minute.
#[test]
fn long_names_are_shortened_wherever_info_lists_them() {
    let sandbox = with_secret();
    let mut model = gltf(&[]);
    let name = |k: usize| format!("{k}\u{202e}{}{k}", "n".repeat(100_000));
    model["nodes"] = json!([{ "name": name(0), "mesh": 0, "skin": 0 }, { "name": name(1) }]);
    model["skins"] = json!([{ "joints": [1] }]);
    model["materials"] = json!([{ "name": name(2) }]);
    model["meshes"][0]["primitives"][0]["material"] = 0.into();
    model["scenes"][0]["nodes"] = json!([0, 1]);
    sandbox.write("model/m.gltf", model.to_string());
    let output = sandbox.run("info model/m.gltf").success().get_output().stdout.clone();
    let text = String::from_utf8(output).unwrap();
    assert!(text.contains(r"material:2\u{202e}nnn") && text.contains("nnn2"), "{text}");
    assert!(text.lines().all(|line| line.len() < 1000), "{text}");
    // Programs get the whole names.
    let output = sandbox.run("info --json model/m.gltf").success().get_output().stdout.clone();
    let json: Value = serde_json::from_slice(&output).unwrap();
    let parts = json["parts"].as_array().unwrap();
    assert!(parts.contains(&format!("material:{}", name(2)).into()), "{parts:?}");
}

#[test]
fn file_that_exceeds_the_memory_is_not_reported_as_missing() {
    let sandbox = with_secret();
    // The file is sparse, so it occupies no disk space.
    std::fs::File::create(sandbox.path("model/large.png")).unwrap().set_len(2 << 30).unwrap();
    sandbox.write("model/m.gltf", gltf(&["large.png"]).to_string());
    let command = sandbox.command("info model/m.gltf");
    // The limit in KiB is half of the memory that the texture needs.
    let limited = Command::new("sh")
        .args(["-c", "ulimit -v 1048576; exec \"$0\" info model/m.gltf"])
        .arg(command.get_program())
        .current_dir(sandbox.path("."))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&limited.stdout).into_owned();
    assert!(said.contains("texture 'large.png' needs 2048 MiB of memory, more than is available"), "{said}");
}
