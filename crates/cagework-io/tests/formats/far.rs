//! Models far from the world origin.

use cagework_io::{Model, ModelFormat};
use glam::{DVec3, Vec3};

use crate::common::{self, Builder, CUBE, cube, json_of, plain_cube, read};

/// Position of a unit cube in map coordinates, where f32 has steps of 0.5.
const PLACE: DVec3 = DVec3::new(500_000.25, 0.125, 4_500_000.5);

/// Tolerance for rounding to f32, which changes coordinates below 2 by at most 6e-8.
const TOLERANCE: f64 = 1e-7;

/// Cube corners with six decimals, as exporters write them.
fn corners() -> Vec<DVec3> {
    let micro = |x: f64| (1e6 * x).round() / 1e6;
    let corner = |p: [f32; 3]| (PLACE + 0.987_654 * DVec3::from_array(p.map(f64::from))).map(micro);
    CUBE.map(corner).to_vec()
}

/// A cube with the vertices [`corners`] in a text format, each coordinate with six decimals.
fn file(format: ModelFormat) -> String {
    let near = read("x.obj", common::CUBE_OBJ.as_bytes()).unwrap();
    let line = |start: &str, p: &DVec3| format!("{start}{:.6} {:.6} {:.6}\n", p.x, p.y, p.z);
    let lines = |start: &str| corners().iter().map(|p| line(start, p)).collect::<String>();
    let faces = |start: &str, first: u32| {
        let face = |f: &Vec<u32>| {
            let corners: Vec<String> = f.iter().map(|v| (v + first).to_string()).collect();
            format!("{} {}\n", start.replace('n', &f.len().to_string()), corners.join(" "))
        };
        near.cage_mesh().faces.iter().map(face).collect::<String>()
    };
    match format {
        ModelFormat::Obj => lines("v ") + &faces("f", 1),
        ModelFormat::Off => "OFF\n8 6 0\n".to_owned() + &lines("") + &faces("n", 0),
        ModelFormat::Ply => {
            "ply\nformat ascii 1.0\nelement vertex 8\nproperty double x\nproperty double y\nproperty double z\n\
             element face 6\nproperty list uchar int vertex_indices\nend_header\n"
                .to_owned()
                + &lines("")
                + &faces("n", 0)
        }
        _ => {
            let facet = |t: &[u32; 3]| {
                let corners = t.map(|v| line("vertex ", &corners()[v as usize])).concat();
                format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
            };
            format!("solid a\n{}endsolid a\n", near.triangles.iter().map(facet).collect::<String>())
        }
    }
}

fn read_near(name: &str, bytes: &[u8]) -> Model {
    Model::read(name, bytes, &mut |_| None).unwrap()
}

/// Positions of all triangle corners in f64.
fn places(model: &Model) -> Vec<DVec3> {
    let place = |&v: &u32| model.origin() + model.positions[v as usize].as_dvec3();
    model.triangles.iter().flatten().map(place).collect()
}

fn assert_near(found: &[DVec3], expected: &[DVec3], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(expected) {
        assert!(a.distance(*b) < tolerance, "{a} instead of {b}");
    }
}

#[test]
fn text_files_far_from_the_origin_are_read_and_written_without_loss() {
    let triangles = read("x.obj", common::CUBE_OBJ.as_bytes()).unwrap().triangles;
    let expected: Vec<DVec3> = triangles.iter().flatten().map(|&v| corners()[v as usize]).collect();
    for format in [ModelFormat::Obj, ModelFormat::Ply, ModelFormat::Stl, ModelFormat::Off] {
        let text = file(format);
        let model = read_near("x", text.as_bytes());
        assert_eq!((model.format(), model.positions.len(), model.origin().y), (format, 8, 0.0));
        assert_eq!(model.notices, [""; 0]);
        assert_near(&places(&model), &expected, TOLERANCE);
        let again = model.write(format, &model.positions).unwrap();
        if format == ModelFormat::Obj {
            assert_eq!(
                String::from_utf8(again.clone()).unwrap(),
                text,
                "unmoved coordinates keep their digits"
            );
        }
        assert_near(&places(&read_near("again", &again)), &expected, 2.0 * TOLERANCE);
        let moved: Vec<Vec3> = model.positions.iter().map(|&p| p + Vec3::splat(0.25)).collect();
        let expected: Vec<DVec3> = expected.iter().map(|&p| p + 0.25).collect();
        for to in ModelFormat::ALL
            .into_iter()
            .filter(|&to| to.is_written() && to.holds_faces() && (to != ModelFormat::Stl || to == format))
        {
            let written = read_near("moved", &model.write(to, &moved).unwrap());
            assert_near(&places(&written), &expected, 3.0 * TOLERANCE);
        }
        // Relative to the world origin, positions are rounded and a notice gives the step.
        let mut rounded = read_near("x", text.as_bytes());
        rounded.set_origin(DVec3::ZERO);
        assert_eq!(
            rounded.notices,
            ["the model is so far from the origin that its coordinates have steps of 5e-1: move it nearer"]
        );
    }
    let binary = read_near("x.obj", file(ModelFormat::Obj).as_bytes());
    let lost = binary.lost_in(ModelFormat::Stl).unwrap();
    assert_eq!(
        lost,
        "the stl file does not keep: the full precision of positions, as the model is far from the origin"
    );
}

/// Poses, cages and further models use the origin of the model.
#[test]
fn positions_can_be_relative_to_another_models_origin() {
    let model = read_near("x.obj", file(ModelFormat::Obj).as_bytes());
    let mut cage = read_near(
        "x.obj",
        "v 500000 0 4500000\nv 500002 0 4500000\nv 500000 2 4500000\nv 500000 0 4500002.5\n".as_bytes(),
    );
    assert!(cage.origin() != model.origin());
    let before: Vec<DVec3> = cage.positions.iter().map(|p| cage.origin() + p.as_dvec3()).collect();
    cage.set_origin(model.origin());
    let after: Vec<DVec3> = cage.positions.iter().map(|p| model.origin() + p.as_dvec3()).collect();
    assert_near(&after, &before, TOLERANCE);
    // Models near the world origin stay unchanged.
    let near = read_near("x.obj", common::CUBE_OBJ.as_bytes());
    assert_eq!((near.origin(), &near.positions), (DVec3::ZERO, &cube()));
}

#[test]
fn positions_of_a_node_far_away_are_kept() {
    let place = |b: &mut Builder| b.json["nodes"][0]["translation"] = PLACE.as_vec3().to_array().into();
    let mut b = plain_cube();
    place(&mut b);
    let model = read_near("x.glb", &b.glb());
    let written = model.write_glb(&model.positions).unwrap();
    assert_eq!(json_of(&written)["nodes"][0], b.json["nodes"][0]);
    let mut local = read("y.glb", &written).unwrap();
    local.set_origin(PLACE.as_vec3().as_dvec3());
    assert_near(&places(&read_near("y.glb", &written)), &places(&model), TOLERANCE);
    let accessor = &json_of(&written)["accessors"]
        [json_of(&written)["meshes"][0]["primitives"][0]["attributes"]["POSITION"].as_u64().unwrap()
            as usize];
    assert_eq!(
        (&accessor["min"], &accessor["max"]),
        (&serde_json::json!([0.0, 0.0, 0.0]), &serde_json::json!([1.0, 1.0, 1.0]))
    );
    // A mesh under a singular transform gets a new node at the model's origin.
    b.json["nodes"][0]["scale"] = serde_json::json!([1.0, 1.0, 0.0]);
    let flat = read_near("x.glb", &b.glb());
    let written = flat.write_glb(&flat.positions).unwrap();
    assert_near(&places(&read_near("y.glb", &written)), &places(&flat), TOLERANCE);
}
