//! A project in one file: model, cage, poses and settings as a GLB that any viewer opens.
//!
//! The visible part is the model at rest, its document unchanged, and the cage as lines. What only we read is in the
//! extension [`EXTENSION`] of the document: buffer views with the cage's positions, its faces (for each the number of
//! corners, then the corners) and the poses, all little endian and in the model's axes, and which of them points up. A model that is no
//! glTF travels as a file in a buffer view, and what viewers see is made from it; so do further models in the same cage, which
//! viewers do not see. Weights are not kept: they are made again from the same settings.

use cagework_core::PolygonMesh;
use glam::{DVec3, Vec3};
use serde_json::{Value, json};
use thiserror::Error;

use crate::error::WriteError;
use crate::format::ModelFormat;
use crate::gltf::{self, PROJECT_EXTENSION as EXTENSION, Pack, push};
use crate::model::{Document, Model, ReadError};
use crate::origin::translation;
use crate::shown::shown;
use crate::up::UpAxis;

/// Version that is written for one model. Older programs cannot read the next two: those of several models, and of models far
/// from the origin.
const VERSION: u64 = 1;
const VERSION_OF_SEVERAL: u64 = 2;
const VERSION_OF_FAR: u64 = 3;

/// What a project holds.
#[derive(Clone, Debug)]
pub struct Project {
    /// The models, one at least.
    pub models: Vec<Model>,
    /// The cage, as it was: it may not be closed yet.
    pub cage: PolygonMesh,
    /// Names and cage positions of the poses. `[n_cage]` each
    pub poses: Vec<(String, Vec<Vec3>)>,
    /// What the program that wrote it wants to remember.
    pub settings: String,
}

/// Why a project could not be read.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ProjectError {
    /// The model in it.
    #[error(transparent)]
    Model(#[from] ReadError),
    /// From another version of this program.
    #[error(
        "{} is a project of version {found}, but this program reads versions up to {VERSION_OF_FAR}: update it",
        shown(name)
    )]
    Version {
        /// Name the caller gave.
        name: String,
        /// Its version.
        found: u64,
    },
    /// A part of it is not what it should be.
    #[error("{} is a damaged project: {what}", shown(name))]
    Damaged {
        /// Name the caller gave.
        name: String,
        /// What is wrong.
        what: &'static str,
    },
}

/// Everything as one GLB. `models`: in one cage, all with the same axis up and the same origin, which cage and poses share; `poses`: cage positions, `[n_cage]` each.
///
/// # Errors
/// [`WriteError`] when there is no model, a document cannot be written or the file would be too large.
pub fn write_project(
    models: &[&Model],
    cage: &PolygonMesh,
    poses: &[(String, Vec<Vec3>)],
    settings: &str,
) -> Result<Vec<u8>, WriteError> {
    let (model, more) =
        models.split_first().ok_or_else(|| WriteError::Document("there is no model".into()))?;
    let built;
    // What viewers see of another format.
    let (document, source) = match &model.document {
        Document::Gltf(document) => (&**document, None),
        Document::Obj(document) => {
            let (glb, _) =
                gltf::build_from_obj(&model.name, document, &model.positions_in_file(), model.origin)?;
            built = gltf::read(&model.name, &glb, &mut |_| None, u64::MAX, Some(model.origin))?.document;
            (&built, Some(file_of(model)?))
        }
    };
    let mut json = document.json.clone();
    let mut pack = Pack::of(document);
    gltf::embed_images(document, &mut json, &mut pack);
    let up = model.up();
    let cage = &up.mesh_turned_back(cage);
    let node = add_cage(&mut json, &mut pack, cage, model.origin);
    let mut view =
        |json: &mut Value, bytes: Vec<u8>| json!({ "bufferView": pack.push_view(json, bytes, None) });
    let version = if more.is_empty() { VERSION } else { VERSION_OF_SEVERAL };
    let version = if model.origin == DVec3::ZERO { version } else { VERSION_OF_FAR };
    let mut project = json!({ "version": version, "name": model.name, "node": node, "settings": settings });
    project["up"] = up.name().into();
    if version == VERSION_OF_FAR {
        project["origin"] = json!(model.origin.to_array());
    }
    if let Some(source) = source {
        project["source"] = view(&mut json, source);
    }
    for model in more {
        let mut part = view(&mut json, file_of(model)?);
        part["name"] = model.name.as_str().into();
        push(&mut project, "more", part);
    }
    project["cage"] = json!({
        "positions": view(&mut json, position_bytes(&cage.positions)),
        "faces": view(&mut json, face_bytes(&cage.faces)),
    });
    project["poses"] = json!([]);
    for (name, positions) in poses {
        let mut pose = view(&mut json, position_bytes(&up.turned_back(positions)));
        pose["name"] = name.as_str().into();
        push(&mut project, "poses", pose);
    }
    // An object of extensions may be there already, or anything else.
    if !json["extensions"].is_object() {
        json["extensions"] = json!({});
    }
    json["extensions"][EXTENSION] = project;
    push(&mut json, "extensionsUsed", EXTENSION.into());
    pack.finish(json)
}

/// Reads a project within `memory_limit` bytes; `None` when the file is no project.
///
/// # Errors
/// [`ProjectError`] when it is one that cannot be read.
pub fn read_project(name: &str, bytes: &[u8], memory_limit: u64) -> Result<Option<Project>, ProjectError> {
    // A search is cheaper than a parse of every GLB that is opened. Its first chunk is the JSON.
    let json = match bytes {
        [b'g', b'l', b'T', b'F', _, _, _, _, _, _, _, _, a, b, c, d, _, _, _, _, rest @ ..] => {
            &rest[..rest.len().min(u32::from_le_bytes([*a, *b, *c, *d]) as usize)]
        }
        _ => return Ok(None),
    };
    if !json.windows(EXTENSION.len()).any(|w| w == EXTENSION.as_bytes()) {
        return Ok(None);
    }
    let damaged = |what| ProjectError::Damaged { name: name.into(), what };
    let (mut json, bin) = gltf::glb_parts(bytes, memory_limit)
        .map_err(|source| ReadError::Gltf { name: name.into(), source })?;
    let Some(project) = take_project(&mut json) else { return Ok(None) };
    let found = project["version"].as_u64().unwrap_or(0);
    if !(VERSION..=VERSION_OF_FAR).contains(&found) {
        return Err(ProjectError::Version { name: name.into(), found });
    }
    let views = json["bufferViews"].clone();
    let view = |part: &Value| {
        let view = &views[part["bufferView"].as_u64()? as usize];
        let start = view["byteOffset"].as_u64().unwrap_or(0);
        bin.get(start as usize..start.checked_add(view["byteLength"].as_u64()?)? as usize)
    };
    let model_name = project["name"].as_str().unwrap_or(name);
    // Projects from before the choice have none.
    let up = project["up"].as_str().and_then(UpAxis::named).unwrap_or_default();
    // Projects of models near the origin have none.
    let origin: Option<[f64; 3]> = serde_json::from_value(project["origin"].clone())
        .map_err(|_| damaged("its origin is not three numbers"))?;
    let origin = DVec3::from_array(origin.unwrap_or_default());
    let place = |model: &mut Model| {
        model.see_from(origin);
        model.set_up(up);
        let is_finite = model.positions.iter().all(|p| p.is_finite());
        is_finite.then_some(()).ok_or(damaged("its origin is too far from its models"))
    };
    let positions_of = |bytes: &[u8]| Some(up.turned(&positions_of(bytes)?).into_owned());
    let cage = &project["cage"];
    let positions = view(&cage["positions"]).and_then(positions_of).ok_or(damaged("its cage is cut off"))?;
    let faces =
        view(&cage["faces"]).and_then(faces_of).ok_or(damaged("the faces of its cage are cut off"))?;
    let mut poses = Vec::new();
    for pose in project["poses"].as_array().into_iter().flatten() {
        let positions = view(pose).and_then(positions_of).ok_or(damaged("a pose is cut off"))?;
        poses.push((pose["name"].as_str().unwrap_or_default().to_owned(), positions));
    }
    let settings = project["settings"].as_str().unwrap_or_default().to_owned();
    let mut model = if project["source"].is_object() {
        let source = view(&project["source"]).ok_or(damaged("its model is cut off"))?;
        Model::read_within(model_name, source, &mut |_| None, memory_limit)?
    } else {
        drop_cage(&mut json, project["node"].as_u64());
        let plain = gltf::glb_of(&json, &bin).map_err(|_| damaged("it cannot be put together again"))?;
        Model::read_within(model_name, &plain, &mut |_| None, memory_limit)?
    };
    place(&mut model)?;
    let mut models = vec![model];
    for part in project["more"].as_array().into_iter().flatten() {
        let bytes = view(part).ok_or(damaged("one of its models is cut off"))?;
        let taken: u64 = models.iter().map(Model::bytes).sum();
        let left = memory_limit.saturating_sub(taken);
        let name = part["name"].as_str().unwrap_or("model");
        let mut model = Model::read_within(name, bytes, &mut |_| None, left)?;
        model.require_faces()?;
        place(&mut model)?;
        models.push(model);
    }
    Ok(Some(Project { models, cage: PolygonMesh { positions, faces }, poses, settings }))
}

/// A model as a file of its own format that needs no other file.
fn file_of(model: &Model) -> Result<Vec<u8>, WriteError> {
    match (&model.document, model.format()) {
        (Document::Gltf(document), _) => {
            let (mut json, mut pack) = (document.json.clone(), Pack::of(document));
            gltf::embed_images(document, &mut json, &mut pack);
            pack.finish(json)
        }
        (Document::Obj(document), ModelFormat::Obj) => Ok(document.bytes.clone()),
        // Of them nothing but what is written is kept.
        (_, format) => model.write(format, &model.positions),
    }
}

/// Takes the extension out of the document.
fn take_project(json: &mut Value) -> Option<Value> {
    let extensions = json.get_mut("extensions")?.as_object_mut()?;
    let project = extensions.shift_remove(EXTENSION)?;
    if extensions.is_empty() {
        json.as_object_mut()?.shift_remove("extensions");
    }
    if let Some(used) = json.get_mut("extensionsUsed").and_then(Value::as_array_mut) {
        used.retain(|e| e != EXTENSION);
        if used.is_empty() {
            json.as_object_mut()?.shift_remove("extensionsUsed");
        }
    }
    Some(project)
}

/// The cage as lines at a node of its own; the node.
fn add_cage(json: &mut Value, pack: &mut Pack<'_>, cage: &PolygonMesh, origin: DVec3) -> Option<usize> {
    /// Mode of a primitive: lines.
    const LINES: u32 = 1;
    let mut edges: Vec<[u32; 2]> = Vec::new();
    for face in &cage.faces {
        edges.extend((0..face.len()).map(|k| {
            let (a, b) = (face[k], face[(k + 1) % face.len()]);
            [a.min(b), a.max(b)]
        }));
    }
    edges.sort_unstable();
    edges.dedup();
    // A document without nodes shows all its meshes; a node for the cage would hide them.
    if edges.is_empty() || json["nodes"].as_array().is_none_or(Vec::is_empty) {
        return None;
    }
    let primitive = json!({
        "attributes": { "POSITION": pack.push_vec3(json, &cage.positions, true) },
        "indices": pack.push_lines(json, &edges),
        "mode": LINES,
    });
    let mesh = push(json, "meshes", json!({ "name": "cage", "primitives": [primitive] }));
    let node = push(json, "nodes", json!({ "name": "cage", "mesh": mesh }));
    if origin != DVec3::ZERO {
        json["nodes"][node]["translation"] = json!(translation(origin).0);
    }
    if json["scenes"].as_array().is_none_or(Vec::is_empty) {
        return Some(node);
    }
    let scene = json["scene"].as_u64().unwrap_or(0) as usize;
    if json["scenes"][scene].is_object() {
        push(&mut json["scenes"][scene], "nodes", node.into());
    }
    Some(node)
}

/// Removes the node that [`add_cage`] added, if the file still has it at the end of its list.
fn drop_cage(json: &mut Value, node: Option<u64>) {
    let Some(node) = node else { return };
    let is_cage = |list: &Value, index: u64| {
        list.as_array().is_some_and(|l| l.len() as u64 == index + 1) && list[index as usize]["name"] == "cage"
    };
    if !is_cage(&json["nodes"], node) {
        return;
    }
    let mesh = json["nodes"][node as usize]["mesh"].as_u64();
    let mut pop = |key: &str| {
        if let Some(list) = json[key].as_array_mut() {
            list.pop();
            if list.is_empty()
                && let Some(object) = json.as_object_mut()
            {
                object.shift_remove(key);
            }
        }
    };
    pop("nodes");
    if let Some(mesh) = mesh
        && is_cage(&json["meshes"], mesh)
    {
        json["meshes"].as_array_mut().map(Vec::pop);
    }
    for scene in json["scenes"].as_array_mut().into_iter().flatten() {
        if let Some(nodes) = scene["nodes"].as_array_mut() {
            nodes.retain(|n| n.as_u64() != Some(node));
        }
    }
}

fn position_bytes(positions: &[Vec3]) -> Vec<u8> {
    positions.iter().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes).collect()
}

fn positions_of(bytes: &[u8]) -> Option<Vec<Vec3>> {
    let numbers = |b: &[u8]| b.try_into().map_or(f32::NAN, f32::from_le_bytes);
    let vector = |b: &[u8]| Vec3::new(numbers(&b[..4]), numbers(&b[4..8]), numbers(&b[8..]));
    let positions: Vec<Vec3> = bytes.chunks_exact(12).map(vector).collect();
    (bytes.len().is_multiple_of(12) && positions.iter().all(|p| p.is_finite())).then_some(positions)
}

fn face_bytes(faces: &[Vec<u32>]) -> Vec<u8> {
    let words = faces.iter().flat_map(|f| std::iter::once(f.len() as u32).chain(f.iter().copied()));
    words.flat_map(u32::to_le_bytes).collect()
}

fn faces_of(bytes: &[u8]) -> Option<Vec<Vec<u32>>> {
    let mut words = bytes.chunks_exact(4).map(|b| b.try_into().map_or(u32::MAX, u32::from_le_bytes));
    let mut left = bytes.len() / 4;
    let mut faces = Vec::new();
    while let Some(corners) = words.next() {
        left -= 1;
        if corners as usize > left {
            return None;
        }
        faces.push(words.by_ref().take(corners as usize).collect());
        left -= corners as usize;
    }
    Some(faces)
}
