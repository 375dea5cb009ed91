//! Builder of small glTF files, and models with special cases.

#![allow(dead_code, clippy::unwrap_used, reason = "each test file uses only some of these helpers")]

pub(crate) mod fbx;

use cagework_io::{Model, ReadError};
use glam::{Mat4, Vec3};
use serde_json::{Value, json};

pub(crate) const F32: u32 = 5126;
pub(crate) const U32: u32 = 5125;
pub(crate) const U16: u32 = 5123;
pub(crate) const I16: u32 = 5122;
pub(crate) const U8: u32 = 5121;

/// Vertices of the unit cube, x fastest.
pub(crate) const CUBE: [[f32; 3]; 8] = [
    [0., 0., 0.],
    [1., 0., 0.],
    [0., 1., 0.],
    [1., 1., 0.],
    [0., 0., 1.],
    [1., 0., 1.],
    [0., 1., 1.],
    [1., 1., 1.],
];

/// Outward triangles of the cube.
pub(crate) const CUBE_TRIANGLES: [[u32; 3]; 12] = [
    [0, 2, 3],
    [0, 3, 1],
    [4, 5, 7],
    [4, 7, 6],
    [0, 1, 5],
    [0, 5, 4],
    [2, 6, 7],
    [2, 7, 3],
    [0, 4, 6],
    [0, 6, 2],
    [1, 3, 7],
    [1, 7, 5],
];

pub(crate) fn cube() -> Vec<Vec3> {
    CUBE.map(Vec3::from_array).to_vec()
}

/// A 1 x 1 PNG: one red pixel.
pub(crate) const PNG: [u8; 69] = [
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0, 0, 0, 0x0d, 0x49, 0x48, 0x44, 0x52, 0, 0, 0, 1, 0, 0,
    0, 1, 8, 2, 0, 0, 0, 0x90, 0x77, 0x53, 0xde, 0, 0, 0, 0x0c, 0x49, 0x44, 0x41, 0x54, 0x78, 0x9c, 0x63,
    0xf8, 0xcf, 0xc0, 0, 0, 3, 1, 1, 0, 0xc9, 0xfe, 0x92, 0xef, 0, 0, 0, 0, 0x49, 0x45, 0x4e, 0x44, 0xae,
    0x42, 0x60, 0x82,
];

/// Builds a glTF from JSON and one binary buffer.
pub(crate) struct Builder {
    pub(crate) json: Value,
    pub(crate) bin: Vec<u8>,
}

impl Builder {
    pub(crate) fn new() -> Self {
        let json = json!({
            "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
            "nodes": [], "meshes": [], "accessors": [], "bufferViews": [],
        });
        Self { json, bin: Vec::new() }
    }

    pub(crate) fn push(&mut self, list: &str, item: Value) -> usize {
        if !self.json[list].is_array() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().unwrap();
        list.push(item);
        list.len() - 1
    }

    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let view = json!({ "buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len() });
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", view)
    }

    pub(crate) fn accessor(&mut self, bytes: &[u8], component: u32, count: usize, kind: &str) -> usize {
        let view = self.view(bytes);
        let accessor =
            json!({ "bufferView": view, "componentType": component, "count": count, "type": kind });
        self.push("accessors", accessor)
    }

    pub(crate) fn vec3(&mut self, values: &[[f32; 3]]) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let accessor = self.accessor(&bytes, F32, values.len(), "VEC3");
        let bound = |f: fn(f32, f32) -> f32| {
            values.iter().copied().reduce(|a, b| [f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2])]).unwrap()
        };
        self.json["accessors"][accessor]["min"] = json!(bound(f32::min));
        self.json["accessors"][accessor]["max"] = json!(bound(f32::max));
        accessor
    }

    pub(crate) fn indices(&mut self, indices: &[u32]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|i| (*i as u16).to_le_bytes()).collect();
        self.accessor(&bytes, U16, indices.len(), "SCALAR")
    }

    /// Adds a mesh of one cube; returns the mesh's index.
    pub(crate) fn cube_mesh(&mut self, name: &str) -> usize {
        let (position, indices) = (self.vec3(&CUBE), self.indices(CUBE_TRIANGLES.as_flattened()));
        let primitive = json!({ "attributes": { "POSITION": position }, "indices": indices });
        self.push("meshes", json!({ "name": name, "primitives": [primitive] }))
    }

    pub(crate) fn primitive(&mut self, mesh: usize) -> &mut Value {
        &mut self.json["meshes"][mesh]["primitives"][0]
    }

    pub(crate) fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{ "byteLength": self.bin.len() }]);
        glb(&json, Some(&self.bin))
    }
}

/// Builds a GLB from a JSON chunk and an optional binary chunk.
pub(crate) fn glb(json: &Value, bin: Option<&[u8]>) -> Vec<u8> {
    let mut text = serde_json::to_vec(json).unwrap();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut out = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    let mut chunk = |kind: &[u8; 4], bytes: &[u8]| {
        out.extend_from_slice(&(bytes.len() as u32).to_le_bytes());
        out.extend_from_slice(kind);
        out.extend_from_slice(bytes);
    };
    chunk(b"JSON", &text);
    if let Some(bin) = bin {
        let mut bin = bin.to_vec();
        bin.resize(bin.len().next_multiple_of(4), 0);
        chunk(b"BIN\0", &bin);
    }
    let length = (out.len() as u32).to_le_bytes();
    out[8..12].copy_from_slice(&length);
    out
}

/// JSON chunk of a GLB.
pub(crate) fn json_of(glb: &[u8]) -> Value {
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    serde_json::from_slice(&glb[20..20 + length]).unwrap()
}

pub(crate) fn read(name: &str, bytes: &[u8]) -> Result<Model, ReadError> {
    Model::read(name, bytes, &mut |_| None)
}

/// Bytes of f32 numbers, little-endian.
pub(crate) fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// One cube at one node.
pub(crate) fn plain_cube() -> Builder {
    let mut b = Builder::new();
    let mesh = b.cube_mesh("cube");
    b.push("nodes", json!({ "name": "box", "mesh": mesh }));
    b
}

/// A textured square with normals, tangents and texture coordinates, as two triangles with a seam, under a
/// rotated node.
pub(crate) fn textured_square() -> Builder {
    let mut b = Builder::new();
    let corners = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
    let position = b.vec3(&corners);
    let normal = b.vec3(&[[0., 0., 1.]; 6]);
    let tangent = b.accessor(&floats(&[[1., 0., 0., 1.]; 6].concat()), F32, 6, "VEC4");
    let uv: Vec<f32> = corners.iter().flat_map(|c: &[f32; 3]| [c[0] * 0.5, c[1]]).collect();
    let uv = b.accessor(&floats(&uv), F32, 6, "VEC2");
    b.push("images", json!({ "name": "red", "uri": "red%20dot.png" }));
    b.push("textures", json!({ "source": 0 }));
    b.push(
        "materials",
        json!({ "name": "paint", "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }),
    );
    let attributes = json!({ "POSITION": position, "NORMAL": normal, "TANGENT": tangent, "TEXCOORD_0": uv });
    let mesh = b.push(
        "meshes",
        json!({ "name": "square", "primitives": [{ "attributes": attributes, "material": 0 }] }),
    );
    b.push(
        "nodes",
        json!({ "name": "top", "rotation": [0.0, 0.6, 0.0, 0.8], "children": [1], "extras": { "a": 1 } }),
    );
    b.push(
        "nodes",
        json!({ "name": "leaf", "mesh": mesh, "scale": [2.0, 0.5, 3.0], "translation": [1.0, 2.0, 3.0] }),
    );
    b
}

/// A cube mesh at two nodes, one of them mirrored.
pub(crate) fn instanced() -> Builder {
    let mut b = Builder::new();
    let mesh = b.cube_mesh("cube");
    b.push("nodes", json!({ "name": "left", "mesh": mesh }));
    b.push(
        "nodes",
        json!({ "name": "right", "mesh": mesh, "translation": [5.0, 0.0, 0.0], "scale": [-1.0, 1.0, 1.0] }),
    );
    b.json["scenes"] = json!([{ "nodes": [0, 1] }]);
    b
}

/// A skinned cube: its upper half follows a joint raised by 2, its lower half a joint at rest. One animation
/// rotates a joint, another one drives the morph target.
pub(crate) fn skinned() -> Builder {
    let mut b = Builder::new();
    let mesh = b.cube_mesh("cube");
    let joints: Vec<u8> = CUBE.iter().flat_map(|p| [u8::from(p[2] > 0.5), 0, 0, 0]).collect();
    let joints = b.accessor(&joints, U8, 8, "VEC4");
    let weights = b.accessor(&[[255, 0, 0, 0]; 8].concat(), U8, 8, "VEC4");
    b.json["accessors"][weights]["normalized"] = true.into();
    let delta = b.vec3(&[[0.25, 0., 0.]; 8]);
    let primitive = b.primitive(mesh);
    primitive["attributes"]["JOINTS_0"] = joints.into();
    primitive["attributes"]["WEIGHTS_0"] = weights.into();
    primitive["targets"] = json!([{ "POSITION": delta }]);
    b.json["meshes"][mesh]["weights"] = json!([0.0]);
    b.json["meshes"][mesh]["extras"] = json!({ "targetNames": ["wide"], "kept": 7 });
    let times = b.accessor(&floats(&[0., 1.]), F32, 2, "SCALAR");
    b.json["accessors"][times]["min"] = json!([0.0]);
    b.json["accessors"][times]["max"] = json!([1.0]);
    let turns = b.accessor(&floats(&[0., 0., 0., 1., 1., 0., 0., 0.]), F32, 2, "VEC4");
    let morph = b.accessor(&floats(&[0., 1.]), F32, 2, "SCALAR");
    let animation = |output: usize, node: usize, path: &str| {
        json!({
            "samplers": [{ "input": times, "output": output }],
            "channels": [{ "sampler": 0, "target": { "node": node, "path": path } }],
        })
    };
    let (wave, widen) = (animation(turns, 2, "rotation"), animation(morph, 0, "weights"));
    b.push("animations", wave);
    b.push("animations", widen);
    // The transform of a skinned mesh's node is ignored.
    b.push("nodes", json!({ "name": "body", "mesh": mesh, "skin": 0, "translation": [100.0, 0.0, 0.0] }));
    b.push("nodes", json!({ "name": "low", "children": [2] }));
    b.push("nodes", json!({ "name": "high", "translation": [0.0, 0.0, 2.0] }));
    b.push("skins", json!({ "joints": [1, 2] }));
    b.json["scenes"] = json!([{ "nodes": [0, 1] }]);
    b
}

/// A cube in 16-bit integers (KHR_mesh_quantization), scaled back by its node.
pub(crate) fn quantized() -> Builder {
    let mut b = Builder::new();
    let bytes: Vec<u8> = CUBE
        .iter()
        .flat_map(|p| [p[0], p[1], p[2], 0.0])
        .flat_map(|x| (x as u16 * 1000).to_le_bytes())
        .collect();
    let position = b.accessor(&bytes, U16, 8, "VEC3");
    let view = b.json["accessors"][position]["bufferView"].as_u64().unwrap() as usize;
    b.json["bufferViews"][view]["byteStride"] = 8.into();
    b.json["bufferViews"][view]["target"] = 34962.into();
    b.json["accessors"][position]["min"] = json!([0, 0, 0]);
    b.json["accessors"][position]["max"] = json!([1000, 1000, 1000]);
    let indices = b.indices(CUBE_TRIANGLES.as_flattened());
    let primitive = json!({ "attributes": { "POSITION": position }, "indices": indices });
    let mesh = b.push("meshes", json!({ "primitives": [primitive] }));
    b.push("nodes", json!({ "name": "dequantize", "mesh": mesh, "scale": [0.001, 0.001, 0.001] }));
    b.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
    b.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    b
}

/// The cube as an OBJ with hard edges, texture coordinates, two materials and a comment.
pub(crate) const CUBE_OBJ: &str = "# a box\nmtllib box.mtl\no box\n\
    v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n\
    vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
    vn 0 0 -1\nvn 0 0 1\nvn 0 -1 0\nvn 0 1 0\nvn -1 0 0\nvn 1 0 0\n\
    usemtl red\ns off\n\
    f 1/1/1 3/2/1 4/3/1 2/4/1\nf 5/1/2 6/2/2 8/3/2 7/4/2\n\
    usemtl blue\n\
    f 1/1/3 2/2/3 6/3/3 5/4/3\nf 3/1/4 7/2/4 8/3/4 4/4/4\nf 1/1/5 5/2/5 7/3/5 3/4/5\nf 2/1/6 4/2/6 8/3/6 6/4/6\n";

/// A twist about the z axis with a translation; moves all vertices differently.
pub(crate) fn twist(p: Vec3) -> Vec3 {
    let (s, c) = (0.7 * p.z + 0.2).sin_cos();
    Vec3::new(c * p.x - s * p.y + 0.5, s * p.x + c * p.y, 1.5 * p.z - 0.25)
}

/// Largest distance between corresponding points, divided by the largest distance of a point of `a` from the origin.
pub(crate) fn relative_error(a: &[Vec3], b: &[Vec3]) -> f32 {
    assert_eq!(a.len(), b.len());
    let size = a.iter().map(|p| p.length()).fold(f32::MIN_POSITIVE, f32::max);
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max) / size
}

/// Signed volume of a closed mesh; positive if its triangles face outwards.
pub(crate) fn volume(model: &Model) -> f32 {
    let p = |i: u32| model.positions[i as usize];
    model.triangles.iter().map(|&[a, b, c]| p(a).dot(p(b).cross(p(c))) / 6.0).sum()
}

/// A bar with three joints under an armature that scales by two. Its bind pose is four units away from its
/// rest pose. Two morph targets with default weights [0.25, 0], and a clip that moves the root, animates a
/// bone's constant translation, rotates the tip and changes the targets.
pub(crate) fn rigged() -> Builder {
    let mut rig = Builder::new();
    // A closed square column from height 0 to 2 in world space: five cross-sections, joined by four segments.
    let (mut at, mut triangles) = (Vec::new(), Vec::new());
    for k in 0..5_u32 {
        let y = 0.5 * k as f32;
        at.extend([[-0.2, y, -0.2], [0.2, y, -0.2], [0.2, y, 0.2], [-0.2, y, 0.2]]);
        for side in (0..4).filter(|_| k < 4) {
            let [a, b] = [4 * k + side, 4 * k + (side + 1) % 4];
            triangles.extend([a, a + 4, b, b, a + 4, b + 4]);
        }
    }
    triangles.extend([0, 1, 2, 0, 2, 3, 16, 18, 17, 16, 19, 18]);
    // Positions in mesh space: scaled by half and moved by four units.
    let local: Vec<[f32; 3]> =
        at.iter().map(|p: &[f32; 3]| [4.0 + 0.5 * p[0], 0.5 * p[1], 0.5 * p[2]]).collect();
    let delta = |d: [f32; 3], from: f32| -> Vec<[f32; 3]> {
        at.iter()
            .map(|p| if p[1] >= from { [p[0].signum() * d[0], d[1], p[2].signum() * d[2]] } else { [0.0; 3] })
            .collect()
    };
    let position = rig.vec3(&local);
    let normals: Vec<[f32; 3]> =
        at.iter().map(|p| Vec3::new(p[0], 0.0, p[2]).normalize().to_array()).collect();
    let normal = rig.vec3(&normals);
    let indices = rig.indices(&triangles);
    let targets = [delta([0.3, 0.0, 0.0], 0.9), delta([0.0, 0.2, 0.0], 1.4)]
        .map(|d| json!({ "POSITION": rig.vec3(&d) }));
    let joints: Vec<u8> =
        at.iter().flat_map(|p| if p[1] < 0.9 { [0, 1, 0, 0] } else { [1, 2, 0, 0] }).collect();
    let weights: Vec<u8> = at
        .iter()
        .flat_map(|p| {
            let share = (p[1] / 2.0 * 2.0).fract();
            [1.0 - share, share, 0.0, 0.0_f32].map(f32::to_le_bytes).concat()
        })
        .collect();
    let joints = rig.accessor(&joints, U8, at.len(), "VEC4");
    let weights = rig.accessor(&weights, F32, at.len(), "VEC4");
    let attributes =
        json!({ "POSITION": position, "NORMAL": normal, "JOINTS_0": joints, "WEIGHTS_0": weights });
    let primitive = json!({ "attributes": attributes, "indices": indices, "targets": targets });
    let mesh = json!({ "primitives": [primitive], "weights": [0.25, 0.0], "extras": { "targetNames": ["wide", "tall"] } });
    rig.push("meshes", mesh);
    rig.json["nodes"] = json!([
        { "name": "armature", "translation": [0.0, 0.0, 0.0], "scale": [2.0, 2.0, 2.0], "children": [1] },
        { "name": "root", "translation": [0.0, 0.0, 0.0], "children": [2] },
        { "name": "middle", "translation": [0.0, 0.5, 0.0], "children": [3] },
        { "name": "tip", "translation": [0.0, 0.5, 0.0] },
        { "name": "bar", "mesh": 0, "skin": 0, "translation": [7.0, 7.0, 7.0] },
    ]);
    rig.json["scenes"] = json!([{ "nodes": [0, 4] }]);
    // The joints' world transforms scale by two, so the transform from bind space to world space scales by two and
    // moves by -8.
    let binds: Vec<u8> = [0.0_f32, 0.5, 1.0]
        .iter()
        .flat_map(|y| Mat4::from_translation(Vec3::new(-4.0, -y, 0.0)).to_cols_array())
        .flat_map(f32::to_le_bytes)
        .collect();
    let binds = rig.accessor(&binds, F32, 3, "MAT4");
    rig.push("skins", json!({ "joints": [1, 2, 3], "inverseBindMatrices": binds }));
    let floats = |rig: &mut Builder, values: &[f32], count: usize, kind: &str| {
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        let accessor = rig.accessor(&bytes, F32, count, kind);
        if kind == "SCALAR" {
            rig.json["accessors"][accessor]["min"] =
                json!([values.iter().copied().fold(f32::INFINITY, f32::min)]);
            rig.json["accessors"][accessor]["max"] = json!([values.iter().copied().fold(0.0, f32::max)]);
        }
        accessor
    };
    let times = floats(&mut rig, &[0.0, 1.0], 2, "SCALAR");
    let root = floats(&mut rig, &[0.0, 0.0, 0.0, 0.0, 0.1, 0.6], 2, "VEC3");
    let bone = floats(&mut rig, &[0.0, 0.5, 0.0, 0.0, 0.5, 0.0], 2, "VEC3");
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let turn = floats(&mut rig, &[0.0, 0.0, 0.0, 1.0, half, 0.0, 0.0, half], 2, "VEC4");
    let weights = floats(&mut rig, &[0.25, 0.0, 1.0, 0.5], 4, "SCALAR");
    let channels = [(1, "translation"), (2, "translation"), (3, "rotation"), (4, "weights")];
    let samplers = [root, bone, turn, weights].map(|output| json!({ "input": times, "output": output }));
    let channels: Vec<Value> = (0..4)
        .map(|k| json!({ "sampler": k, "target": { "node": channels[k].0, "path": channels[k].1 } }))
        .collect();
    rig.push("animations", json!({ "name": "walk", "samplers": samplers, "channels": channels }));
    rig
}

/// Relationships of a 3MF whose first model part is `3D/3dmodel.model`.
const RELATIONSHIPS: &str = "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">\
    <Relationship Target=\"/3D/3dmodel.model\" Id=\"a\" Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/>\
    </Relationships>";

/// A 3MF with these model parts, and a file of settings that is not read.
pub(crate) fn package(parts: &[(&str, String)]) -> Vec<u8> {
    let mut files = vec![
        ("_rels/.rels".to_owned(), RELATIONSHIPS.as_bytes().to_vec()),
        ("Metadata/settings.config".to_owned(), b"layer_height = 0.2\r\n".to_vec()),
    ];
    files.extend(parts.iter().map(|(name, text)| ((*name).to_owned(), text.as_bytes().to_vec())));
    cagework_io::write_zip(&files).unwrap()
}

/// The cube as the mesh of a 3MF, with a painted triangle, and a triangle with property 1 of group 1.
pub(crate) fn cube_mesh() -> String {
    let vertices =
        CUBE.map(|[x, y, z]| format!("   <vertex x=\"{x:.3}\"  y='{y:.3}' z=\"{z:.3}\" />\r\n")).concat();
    let triangles: Vec<String> = CUBE_TRIANGLES
        .iter()
        .enumerate()
        .map(|(t, [a, b, c])| {
            let more = [" paint_color=\"8\"", " pid=\"1\" p1=\"1\""].get(t).copied().unwrap_or_default();
            format!("<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"{more}/>")
        })
        .collect();
    format!("<mesh><vertices>\r\n{vertices}</vertices><triangles>{}</triangles></mesh>", triangles.concat())
}

/// A model part of a 3MF.
pub(crate) fn model_part(resources: &str, build: &str) -> String {
    format!(
        "\u{feff}<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<!-- by hand -->\n<model unit=\"millimeter\" \
        xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\" \
        xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\">\n\
        <metadata name=\"Title\">A &amp; B</metadata>\n<resources>{resources}</resources>\n<build>{build}</build></model>\n"
    )
}

/// A 3MF with two placements of a pair of cubes, one of which is mirrored, and a cube in another model part.
pub(crate) fn plate() -> Vec<u8> {
    package(&plate_parts())
}

/// Names and texts of the model parts of [`plate`].
pub(crate) fn plate_parts() -> [(&'static str, String); 2] {
    let resources = format!(
        "<basematerials id=\"1\"><base name=\"Red\" displaycolor=\"#FF0000\"/><base name=\"Blue\" displaycolor=\"#0000FF80\"/>\
        </basematerials>\n<object id=\"2\" name=\"cube &lt;1&gt;\" pid=\"1\" pindex=\"0\" type=\"model\" \
        p:UUID=\"00000002-61cb-4c03-9d28-80fed5dfa1dc\">{}</object>\n\
        <object id=\"3\" type=\"model\"><components><component objectid=\"2\"/>\
        <component objectid=\"2\" transform=\"-1 0 0 0 2 0 0 0 1 4 5 6\"/></components></object>",
        cube_mesh()
    );
    let build = "<item objectid=\"3\" transform=\"1 0 0 0 1 0 0 0 1 10 20 30\"/><item objectid=\"3\" \
        transform=\"0 1 0 -1 0 0 0 0 1 0 0 0.5\"/><item objectid=\"2\" p:path=\"/3D/Objects/b.model\" printable=\"0\"/>";
    let other = format!("<object id=\"2\" type=\"model\">{}</object>", cube_mesh());
    [("3D/3dmodel.model", model_part(&resources, build)), ("3D/Objects/b.model", model_part(&other, ""))]
}
