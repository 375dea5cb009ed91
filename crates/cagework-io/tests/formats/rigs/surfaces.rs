//! Normals of double-sided sheets and at seams between primitives.

use cagework_io::{Joints, ReshapeOptions};
use glam::{Mat3, Vec3, vec3};
use serde_json::json;

use super::{f, read, reshaped};
use crate::common::{Builder, F32, floats, json_of};

/// Number of cells along a side of the sheet.
const N: u32 = 24;

/// Positions, normals and triangles.
type Sheet = (Vec<Vec3>, Vec<Vec3>, Vec<[u32; 3]>);

/// Height and slope of a wave at `u`.
fn wave(u: f32) -> [f32; 2] {
    [0.2 * (3.0 * u).sin(), 0.6 * (3.0 * u).cos()]
}

/// Height and slope at `u` of a roof whose normal at the ridge is vertical.
fn roof(u: f32) -> [f32; 2] {
    let slope = 0.5 - u;
    [-slope.abs(), if slope == 0.0 { 0.0 } else { slope.signum() }]
}

/// A sheet with the given profile, columns `from` to `to` of `N`.
fn sheet(height: fn(f32) -> [f32; 2], from: u32, to: u32) -> Sheet {
    let at = |i: u32, k: u32| {
        let (u, v) = (i as f32 / N as f32, k as f32 / N as f32);
        let [height, slope] = height(u);
        (vec3(u, v, height), vec3(-slope, 0.0, 1.0).normalize())
    };
    let (places, normals) = (0..=N).flat_map(|k| (from..=to).map(move |i| at(i, k))).unzip();
    let width = to - from + 1;
    let cells = (0..N).flat_map(|k| (0..to - from).map(move |i| k * width + i));
    let triangles = cells.flat_map(|a| [[a, a + 1, a + width], [a + 1, a + width + 1, a + width]]).collect();
    (places, normals, triangles)
}

/// Transforms a normal by the inverse transpose of the gradient of `f`.
fn brought(p: Vec3, normal: Vec3) -> Vec3 {
    let [x, y] = [p.x, p.y];
    let gradient =
        Mat3::from_cols(vec3(1.0, 0.0, 0.05 * y), vec3(0.2 * y, 1.2, 0.05 * x), vec3(0.0, 0.0, 1.0));
    (gradient.inverse().transpose() * normal).normalize()
}

/// Largest angle, degrees, between exported normals and normals transformed by the gradient of `f`.
fn largest_angle(primitives: &[Sheet]) -> f32 {
    let mut rig = Builder::new();
    let list = |all: &[Vec3]| all.iter().map(Vec3::to_array).collect::<Vec<_>>();
    let of = |(at, normals, triangles): &Sheet| {
        let attributes = json!({ "POSITION": rig.vec3(&list(at)), "NORMAL": rig.vec3(&list(normals)) });
        // A morph target makes the model rigged.
        let target = json!({ "POSITION": rig.vec3(&vec![[0.0, 0.0, 0.1]; at.len()]) });
        let indices = rig.indices(triangles.as_flattened());
        json!({ "attributes": attributes, "indices": indices, "targets": [target] })
    };
    let primitives_json: Vec<_> = primitives.iter().map(of).collect();
    rig.push("meshes", json!({ "primitives": primitives_json }));
    rig.json["nodes"] = json!([{ "mesh": 0 }]);
    let (bytes, _) = reshaped(&read(&rig.glb()), Joints::Follow);
    let (document, mut largest) = (json_of(&bytes), 0.0_f32);
    let start = bytes.len() - document["buffers"][0]["byteLength"].as_u64().unwrap() as usize;
    for (k, (at, normals, _)) in primitives.iter().enumerate() {
        let accessor = &document["meshes"][0]["primitives"][k]["attributes"]["NORMAL"];
        let accessor = &document["accessors"][accessor.as_u64().unwrap() as usize];
        let view = &document["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let first = start + view["byteOffset"].as_u64().unwrap_or(0) as usize;
        for (v, (&p, &normal)) in at.iter().zip(normals).enumerate() {
            let number =
                |c: usize| f32::from_le_bytes(bytes[first + 12 * v + 4 * c..][..4].try_into().unwrap());
            let found = vec3(number(0), number(1), number(2));
            largest = largest.max(found.angle_between(brought(p, normal)).to_degrees());
        }
    }
    largest
}

#[test]
fn analytic_gradient_matches_the_deformation() {
    let (p, step) = (vec3(0.3, 0.7, 0.2), 1e-3);
    let along = |way: Vec3| (f(p + step * way) - f(p - step * way)) / (2.0 * step);
    let normal = vec3(0.2, -0.5, 0.8).normalize();
    let [a, b] = [normal.any_orthonormal_vector(), normal.cross(normal.any_orthonormal_vector())];
    let expected = along(a).cross(along(b)).normalize();
    assert!(brought(p, normal).dot(expected).abs() > 0.9999);
}

/// Hair cards and capes have a back side at the same positions, with opposite normals.
#[test]
fn double_sided_sheets_have_the_normals_of_single_ones() {
    let front = sheet(wave, 0, N);
    let one = largest_angle(std::slice::from_ref(&front));
    let (mut at, mut normals, mut triangles) = front;
    let n = at.len() as u32;
    at.extend(at.clone());
    normals.extend(normals.clone().iter().map(|normal| -normal));
    triangles.extend(triangles.clone().iter().map(|&[a, b, c]| [n + a, n + c, n + b]));
    let both = largest_angle(&[(at, normals, triangles)]);
    assert!(one < 2.0 && both < one + 0.1, "{one} and {both} degrees");
}

/// Primitives that meet at a seam must have equal normals there.
#[test]
fn normals_of_two_primitives_agree_at_their_seam() {
    let one = largest_angle(&[sheet(roof, 0, N)]);
    let two = largest_angle(&[sheet(roof, 0, N / 2), sheet(roof, N / 2, N)]);
    assert!((two - one).abs() < 0.05, "{one} and {two} degrees");
}

/// The numbers of an attribute of the first primitive. `[n_vertices, width]`
fn attribute(glb: &[u8], name: &str, width: usize) -> Vec<Vec3> {
    let document = json_of(glb);
    let start = glb.len() - document["buffers"][0]["byteLength"].as_u64().unwrap() as usize;
    let accessor = &document["meshes"][0]["primitives"][0]["attributes"][name];
    let accessor = &document["accessors"][accessor.as_u64().unwrap() as usize];
    let view = &document["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let first = start + view["byteOffset"].as_u64().unwrap_or(0) as usize;
    let number = |at: usize| f32::from_le_bytes(glb[at..at + 4].try_into().unwrap());
    let count = accessor["count"].as_u64().unwrap() as usize;
    (0..count).map(|v| Vec3::from_array([0, 4, 8].map(|c| number(first + 4 * width * v + c)))).collect()
}

/// At the corners of a cube, the edges span all directions. An affine map A turns normals by its inverse transpose and
/// tangents by A.
#[test]
fn flat_faces_keep_the_normals_of_affine_maps() {
    let mut rig = Builder::new();
    let (mut at, mut normals, mut tangents) = (Vec::new(), Vec::new(), Vec::new());
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let [normal, u, v] = [0, 1, 2].map(|k| Vec3::AXES[(axis + k) % 3]);
            for [a, b] in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]] {
                at.push(side * (normal + a * u) + b * v);
                normals.push(side * normal);
                tangents.push(side * u);
            }
        }
    }
    let indices: Vec<u32> = (0..6).flat_map(|f| [0, 1, 2, 0, 2, 3].map(|k| 4 * f + k)).collect();
    let list = |all: &[Vec3]| all.iter().map(Vec3::to_array).collect::<Vec<_>>();
    let of_tangents: Vec<f32> = tangents.iter().flat_map(|t: &Vec3| [t.x, t.y, t.z, 1.0]).collect();
    let of_tangents = rig.accessor(&floats(&of_tangents), F32, 24, "VEC4");
    let attributes = json!({
        "POSITION": rig.vec3(&list(&at)), "NORMAL": rig.vec3(&list(&normals)), "TANGENT": of_tangents,
    });
    let indices = rig.indices(&indices);
    rig.push("meshes", json!({ "primitives": [{ "attributes": attributes, "indices": indices }] }));
    rig.json["nodes"] = json!([{ "mesh": 0, "translation": [1.0, 2.0, 3.0] }]);
    let model = read(&rig.glb());
    assert!(model.is_rigged());
    let shear = Mat3::from_cols(Vec3::X, vec3(0.5, 1.5, 0.0), vec3(0.0, -0.25, 0.75));
    for map in [Mat3::from_diagonal(Vec3::splat(2.0)), Mat3::from_diagonal(vec3(3.0, 1.0, 0.5)), shear] {
        let points = [model.positions.clone(), model.extra_points().unwrap()].concat();
        let by: Vec<_> = points.iter().map(|&p| (map * p - p).as_dvec3()).collect();
        let (bytes, _) = model.write_reshaped(&by, &[], &[], &ReshapeOptions::default()).unwrap();
        let of_normals = map.inverse().transpose();
        for (name, width, before, turn) in
            [("NORMAL", 3, &normals, of_normals), ("TANGENT", 4, &tangents, map)]
        {
            for (found, &before) in attribute(&bytes, name, width).iter().zip(before) {
                let angle = found.angle_between(turn * before).to_degrees();
                assert!(angle < 0.1, "{name} {before} under {map}: {angle} degrees");
            }
        }
    }
}

/// A dome that is bent into a bowl reverses the height differences of its edges. The gradient must not be mirrored.
#[test]
fn dome_bent_into_a_bowl_has_the_normals_of_the_bowl() {
    const BEND: f32 = 0.3;
    let height = |p: Vec3| BEND * (p.x * p.x + p.y * p.y);
    let grid = || (-4..=4).flat_map(|k| (-4..=4).map(move |i| vec3(i as f32 / 4.0, k as f32 / 4.0, 0.0)));
    let at: Vec<Vec3> = grid().map(|p| p.with_z(-height(p))).collect();
    let normals: Vec<Vec3> =
        grid().map(|p| vec3(2.0 * BEND * p.x, 2.0 * BEND * p.y, 1.0).normalize()).collect();
    let cells = (0..8).flat_map(|k| (0..8).map(move |i| 9 * k + i));
    let indices: Vec<u32> = cells.flat_map(|a| [a, a + 1, a + 9, a + 1, a + 10, a + 9]).collect();
    let mut rig = Builder::new();
    let list = |all: &[Vec3]| all.iter().map(Vec3::to_array).collect::<Vec<_>>();
    let attributes = json!({ "POSITION": rig.vec3(&list(&at)), "NORMAL": rig.vec3(&list(&normals)) });
    let indices = rig.indices(&indices);
    rig.push("meshes", json!({ "primitives": [{ "attributes": attributes, "indices": indices }] }));
    rig.json["nodes"] = json!([{ "mesh": 0, "translation": [0.0, 0.0, 1.0] }]);
    let model = read(&rig.glb());
    let mut by: Vec<_> = grid().map(|p| vec3(0.0, 0.0, 2.0 * height(p)).as_dvec3()).collect();
    by.resize(by.len() + model.extra_points().unwrap().len(), Vec3::ZERO.as_dvec3());
    let (bytes, _) = model.write_reshaped(&by, &[], &[], &ReshapeOptions::default()).unwrap();
    let inner = grid().zip(attribute(&bytes, "NORMAL", 3)).filter(|(p, _)| p.abs().max_element() < 1.0);
    for (p, found) in inner {
        let expected = vec3(-2.0 * BEND * p.x, -2.0 * BEND * p.y, 1.0);
        let angle = found.angle_between(expected).to_degrees();
        assert!(angle < 3.0, "at {p}: {angle} degrees");
    }
}

/// Normals and tangents that are oblique to a flat sheet, such as those of hair and foliage, turn with a uniform scale and
/// a rotation.
#[test]
fn oblique_normals_keep_their_angle_to_a_scaled_surface() {
    let (at, _, triangles) = sheet(|_| [0.0; 2], 0, N);
    let normals = vec![vec3(1.0, 0.0, 1.0).normalize(); at.len()];
    let tangents = vec![vec3(0.6, 0.0, -0.8); at.len()];
    let mut rig = Builder::new();
    let list = |all: &[Vec3]| all.iter().map(Vec3::to_array).collect::<Vec<_>>();
    let of_tangents: Vec<f32> = tangents.iter().flat_map(|t: &Vec3| [t.x, t.y, t.z, 1.0]).collect();
    let of_tangents = rig.accessor(&floats(&of_tangents), F32, at.len(), "VEC4");
    let attributes = json!({
        "POSITION": rig.vec3(&list(&at)), "NORMAL": rig.vec3(&list(&normals)), "TANGENT": of_tangents,
    });
    let indices = rig.indices(triangles.as_flattened());
    rig.push("meshes", json!({ "primitives": [{ "attributes": attributes, "indices": indices }] }));
    rig.json["nodes"] = json!([{ "mesh": 0, "translation": [1.0, 2.0, 3.0] }]);
    let model = read(&rig.glb());
    let points = [model.positions.clone(), model.extra_points().unwrap()].concat();
    let turn = Mat3::from_rotation_y(0.4) * Mat3::from_rotation_x(0.7);
    for scale in [0.01, 0.5, 2.0, 100.0] {
        let by: Vec<_> =
            points.iter().map(|&p| (scale * turn).as_dmat3() * p.as_dvec3() - p.as_dvec3()).collect();
        let (bytes, _) = model.write_reshaped(&by, &[], &[], &ReshapeOptions::default()).unwrap();
        for (name, width, before) in [("NORMAL", 3, &normals), ("TANGENT", 4, &tangents)] {
            for (found, &before) in attribute(&bytes, name, width).iter().zip(before) {
                let angle = found.angle_between(turn * before).to_degrees();
                assert!(angle < 0.1, "{name} at scale {scale}: {found}, {angle} degrees");
            }
        }
    }
}
