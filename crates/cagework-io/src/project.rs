//! Projects: model, cage, poses and settings in one GLB that any viewer opens.
//!
//! Viewers show the model at rest, its document unchanged, and the cage as lines. All other data is in the document
//! extension [`EXTENSION`]: the up axis, and buffer views with cage positions, cage faces (for each face the number of
//! corners, then the corners) and poses, all little-endian and in the model's axes. A model that is not a glTF is
//! stored as its original file, and the visible mesh is built from this file. Additional models of the same cage are
//! stored as files and are not visible. Weights are not stored; they are recomputed from the settings.

use std::borrow::Cow;

use cagework_core::PolygonMesh;
use cagework_core::splats::Splats;
use glam::{DVec3, Vec3};
use serde_json::{Value, json};
use thiserror::Error;

use crate::error::WriteError;
use crate::gltf::{self, PROJECT_EXTENSION as EXTENSION, Pack, Pieces, push};
use crate::model::{Document, Model, ModelFormat, ReadError};
use crate::origin::translation;
use crate::shown::shown;
use crate::splats::SplatsToWrite;

/// Format version of projects.
const VERSION: u64 = 5;

/// Contents of a project.
#[derive(Clone, Debug)]
pub struct Project {
    /// The models, at least one. All have the same up axis and origin.
    pub models: Vec<Model>,
    /// The cage; may be open or otherwise invalid.
    pub cage: PolygonMesh,
    /// Name and cage positions of each pose. `[n_cage]`
    pub poses: Vec<(String, Vec<Vec3>)>,
    /// Settings of the program that wrote the project, opaque to this crate.
    pub settings: String,
}

/// Why a project cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ProjectError {
    /// The model in the project cannot be read.
    #[error(transparent)]
    Model(#[from] ReadError),
    /// The project has another format version.
    #[error(
        "{} is a project of version {found}, but this program reads version {VERSION}: open it with the program that wrote it",
        shown(name)
    )]
    Version {
        /// Name given by the caller.
        name: String,
        /// Format version of the project.
        found: u64,
    },
    /// A part of the project is missing or invalid.
    #[error("{} is a damaged project: {what}", shown(name))]
    Damaged {
        /// Name given by the caller.
        name: String,
        /// The problem, as a clause: "its origin is not three numbers".
        what: &'static str,
    },
}

/// Callback that takes the pieces of a file, in their order.
pub type WritePieces<'a> = dyn FnMut(&[Cow<'_, [u8]>]) + 'a;

/// Writes a project as one GLB.
///
/// `models`: all with the same up axis and origin, which cage and poses share. `poses`: names and cage
/// positions, `[n_cage]` each.
///
/// # Errors
/// [`WriteError`] if `models` is empty, a document cannot be written or the file would be too large.
pub fn write_project(
    models: &[&Model],
    cage: &PolygonMesh,
    poses: &[(String, Vec<Vec3>)],
    settings: &str,
) -> Result<Vec<u8>, WriteError> {
    let mut file = Vec::new();
    write_project_in_pieces(models, cage, poses, settings, u64::MAX, &mut |pieces| file = pieces.concat())?;
    Ok(file)
}

/// As [`write_project`], for a file of at most `limit` bytes. `write` is called once with the pieces of the file, which
/// borrow the models that are stored as they were read.
///
/// # Errors
/// As [`write_project`], and [`WriteError::Limit`].
pub fn write_project_in_pieces(
    models: &[&Model],
    cage: &PolygonMesh,
    poses: &[(String, Vec<Vec3>)],
    settings: &str,
    limit: u64,
    write: &mut WritePieces<'_>,
) -> Result<(), WriteError> {
    let (model, more) =
        models.split_first().ok_or_else(|| WriteError::Document("there is no model".into()))?;
    let require = |bytes| if bytes > limit { Err(WriteError::Limit { bytes, limit }) } else { Ok(()) };
    if let Document::Polygons(_) = model.document {
        // The GLB built from it has at least a position per vertex and three indices of 16 bits per face.
        require((12 * model.positions.len() + 6 * model.n_faces()) as u64)?;
    }
    let built;
    // A model in another format is stored beside a GLB built from it, which viewers can show.
    let (document, source) = match &model.document {
        Document::Gltf(document) => (&**document, None),
        Document::Polygons(_) if model.n_faces() == 0 => {
            let glb = match model.drawn_splats() {
                // The GLB of a point cloud has a splat for each point.
                Some(Cow::Owned(points)) => {
                    let positions = model.positions_in_file().into_owned();
                    let splats = Splats { positions, ..points };
                    let to_write = SplatsToWrite { splats: &splats, origin: model.origin, changed: None };
                    gltf::write_splats(&to_write, None)?
                }
                _ => model.write(ModelFormat::Gltf, &model.positions)?,
            };
            built = gltf::document_written(&model.name, &glb)?;
            (&built, Some(file_of(model)?))
        }
        Document::Polygons(document) => {
            let (glb, _) =
                gltf::build_from_obj(&model.name, document, &model.positions_in_file(), model.origin)?;
            built = gltf::document_written(&model.name, &glb)?;
            (&built, Some(file_of(model)?))
        }
    };
    let mut json = document.json.clone();
    let mut pack = Pack::of(document);
    gltf::embed_images(document, &mut json, &mut pack);
    let up = model.up();
    let cage = &up.mesh_turned_back(cage);
    let node = add_cage(&mut json, &mut pack, cage, model.origin);
    let mut project = json!({
        "version": VERSION, "name": model.name, "up": up.to_string(), "origin": model.origin.to_array(),
        "node": node, "settings": settings,
    });
    if let Some(source) = source {
        project["source"] = json!({ "bufferView": pack.push_pieces(&mut json, source) });
    }
    for model in more {
        let number = pack.push_pieces(&mut json, file_of(model)?);
        push(&mut project, "more", json!({ "bufferView": number, "name": model.name }));
    }
    project["cage"] = json!({
        "positions": view(&mut pack, &mut json, position_bytes(&cage.positions)),
        "faces": view(&mut pack, &mut json, face_bytes(&cage.faces)),
    });
    project["poses"] = json!([]);
    for (name, positions) in poses {
        let mut pose = view(&mut pack, &mut json, position_bytes(&up.turned_back(positions)));
        pose["name"] = name.as_str().into();
        push(&mut project, "poses", pose);
    }
    // `extensions` may be missing or malformed.
    if !json["extensions"].is_object() {
        json["extensions"] = json!({});
    }
    json["extensions"][EXTENSION] = project;
    push(&mut json, "extensionsUsed", EXTENSION.into());
    let file = pack.into_pieces(json)?;
    require(gltf::length_of(&file) as u64)?;
    write(&file);
    Ok(())
}

/// Reads a project using at most `memory_limit` bytes. `None` if the file is not a project.
///
/// # Errors
/// [`ProjectError`] if the project cannot be read.
pub fn read_project(name: &str, bytes: &[u8], memory_limit: u64) -> Result<Option<Project>, ProjectError> {
    // Search the JSON chunk for the extension's name, to avoid parsing every GLB twice.
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
    if found != VERSION {
        return Err(ProjectError::Version { name: name.into(), found });
    }
    let views = json["bufferViews"].clone();
    let view = |part: &Value| {
        let view = &views[part["bufferView"].as_u64()? as usize];
        let start = view["byteOffset"].as_u64().unwrap_or(0);
        bin.get(start as usize..start.checked_add(view["byteLength"].as_u64()?)? as usize)
    };
    let model_name = project["name"].as_str().unwrap_or(name);
    let up =
        project["up"].as_str().and_then(|up| up.parse().ok()).ok_or(damaged("its up axis is unknown"))?;
    let origin: [f64; 3] = serde_json::from_value(project["origin"].clone())
        .map_err(|_| damaged("its origin is not three numbers"))?;
    let origin = DVec3::from_array(origin);
    let place = |model: &mut Model| {
        model.set_origin(origin);
        model.set_up(up);
        let is_finite = model.positions.iter().all(|p| p.is_finite());
        is_finite.then_some(()).ok_or(damaged("its origin is too far from its models"))
    };
    let positions_of = |bytes: &[u8]| Some(up.turned(&positions_of(bytes)?).into_owned());
    let cage = &project["cage"];
    let positions = view(&cage["positions"]).and_then(positions_of).ok_or(damaged("its cage is cut off"))?;
    let faces =
        view(&cage["faces"]).and_then(faces_of).ok_or(damaged("the faces of its cage are cut off"))?;
    let (mut poses, mut left) = (Vec::new(), bin.len());
    for pose in project["poses"].as_array().into_iter().flatten() {
        let bytes = view(pose).ok_or(damaged("a pose is cut off"))?;
        left = left.checked_sub(bytes.len()).ok_or(damaged("its poses share their positions"))?;
        let positions = positions_of(bytes).ok_or(damaged("a pose is cut off"))?;
        poses.push((pose["name"].as_str().unwrap_or_default().to_owned(), positions));
    }
    let mut more = Vec::new();
    for part in project["more"].as_array().into_iter().flatten() {
        let bytes = view(part).ok_or(damaged("one of its models is cut off"))?;
        left = left.checked_sub(bytes.len()).ok_or(damaged("its models share their bytes"))?;
        more.push((part["name"].as_str().unwrap_or("model"), bytes));
    }
    let settings = project["settings"].as_str().unwrap_or_default().to_owned();
    let mut model = if project["source"].is_object() {
        let source = view(&project["source"]).ok_or(damaged("its model is cut off"))?;
        Model::read_within(model_name, source, &mut |_| None, memory_limit)?
    } else {
        drop_cage(&mut json, project["node"].as_u64());
        let plain = gltf::glb_of(&json, &bin).map_err(|_| damaged("its model cannot be restored"))?;
        Model::read_within(model_name, &plain, &mut |_| None, memory_limit)?
    };
    place(&mut model)?;
    let mut models = vec![model];
    for (name, bytes) in more {
        let taken: u64 = models.iter().map(Model::bytes).sum();
        let free = memory_limit.saturating_sub(taken);
        let mut model = Model::read_within(name, bytes, &mut |_| None, free)?;
        model.require_faces()?;
        place(&mut model)?;
        models.push(model);
    }
    Ok(Some(Project { models, cage: PolygonMesh { positions, faces }, poses, settings }))
}

/// Adds a buffer view with these bytes; returns the object that refers to it.
fn view<'a>(pack: &mut Pack<'a>, json: &mut Value, bytes: impl Into<Cow<'a, [u8]>>) -> Value {
    json!({ "bufferView": pack.push_view(json, bytes, None) })
}

/// Returns the model as a self-contained file of its own format.
fn file_of(model: &Model) -> Result<Pieces<'_>, WriteError> {
    match (&model.document, model.format()) {
        (Document::Gltf(document), _) => {
            let (mut json, mut pack) = (document.json.clone(), Pack::of(document));
            gltf::embed_images(document, &mut json, &mut pack);
            pack.into_pieces(json)
        }
        (Document::Polygons(document), ModelFormat::Obj | ModelFormat::ThreeMf) => {
            Ok(vec![document.bytes.as_slice().into()])
        }
        (_, ModelFormat::Sog) => {
            Ok(vec![model.capture.as_ref().map_or(&[][..], |capture| &capture.file).into()])
        }
        // Documents of PLY, STL and OFF do not keep the bytes of their file: write it again.
        (_, format) => Ok(vec![model.write(format, &model.positions)?.into()]),
    }
}

/// Removes the project extension from the document and returns it.
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

/// Adds the cage as lines in a new node; returns the node's index.
fn add_cage(json: &mut Value, pack: &mut Pack<'_>, cage: &PolygonMesh, origin: DVec3) -> Option<usize> {
    /// glTF primitive mode.
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
    // Viewers show all meshes of a file without nodes. If the cage got a node in such a file, they would show only the
    // cage.
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

/// Removes the node and the mesh of the cage if they are the last in their lists, so that no other index changes.
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

/// Positions as projects store them: three little-endian f32 each.
#[must_use]
pub fn position_bytes(positions: &[Vec3]) -> Vec<u8> {
    positions.iter().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes).collect()
}

/// Positions from [`position_bytes`]; `None` if bytes are missing or a number is not finite.
#[must_use]
pub fn positions_of(bytes: &[u8]) -> Option<Vec<Vec3>> {
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
