use predicates::str::contains;
use serde_json::json;

use crate::support::{CORNERS, Sandbox, box_obj, obj_positions};

#[test]
fn info_counts_vertices_and_faces() {
    let sandbox = Sandbox::with_sphere_in_box();
    let info = sandbox.json("info cage.obj --json");
    assert_eq!(info["vertices"], 8);
    assert_eq!(info["unique_vertices"], 8);
    assert_eq!(info["triangles"], 12, "six quads");
    assert_eq!(info["bounds"]["min"], json!([-1.0, -1.0, -1.0]));
    assert_eq!(info["bounds"]["max"], json!([1.0, 1.0, 1.0]));
    assert_eq!(info["closed"], true);
    assert_eq!(info["cage"]["valid"], true);
    for key in ["file", "format", "nodes", "primitives", "materials", "notices"] {
        assert!(info.get(key).is_some(), "{key} is missing");
    }
    sandbox.run("info cage.obj").success().stdout(contains("8 unique positions"));
}

#[test]
fn diagonal_beyond_single_precision_is_printed() {
    let sandbox = Sandbox::new();
    sandbox.write("vast.obj", box_obj(&CORNERS.map(|corner| corner.map(|x| 3e38 * x))));
    let bounds = &sandbox.json("info vast.obj --json")["bounds"];
    assert_eq!(bounds["max"], json!([3e38, 3e38, 3e38]));
    // The diagonal of a cube with edges of 6e38.
    let diagonal = bounds["diagonal"].as_f64().unwrap();
    assert!((diagonal / (6e38 * 3.0_f64.sqrt()) - 1.0).abs() < 1e-6, "{bounds}");
}

#[test]
fn info_explains_why_a_model_is_not_a_valid_cage() {
    let sandbox = Sandbox::new();
    sandbox.write("open.obj", box_obj(&CORNERS).replace("f 5 6 8 7\n", ""));
    let info = sandbox.json("info open.obj --json");
    assert_eq!(info["closed"], false);
    assert_eq!(info["cage"]["valid"], false);
    assert!(info["cage"]["problem"].as_str().unwrap().contains("not closed"));
}

#[test]
fn box_cage_keeps_its_margin() {
    let sandbox = Sandbox::with_sphere_in_box();
    let made = sandbox.json("cage mesh.obj -o box.obj --divisions 3 --margin 0.1 --json");
    // A cube with n divisions has (n + 1)^3 - (n - 1)^3 lattice points on its surface, and n^2 quads on each of its six
    // sides.
    assert_eq!(made["vertices"], 56);
    assert_eq!(made["faces"], 54);
    // The bounding box of a sphere of radius 0.7 has the diagonal 1.4 sqrt(3). The margin adds a tenth of it on each
    // side.
    let half = 0.7 + 0.14 * 3.0_f64.sqrt();
    for p in obj_positions(&sandbox.read("box.obj")) {
        assert!(p.iter().any(|x| (x.abs() - half).abs() < 1e-6), "{p:?} is not on the box");
    }
    assert_eq!(sandbox.json("info box.obj --json")["cage"]["valid"], true);
}
