//! FBX files, which `cagework_fbx` converts to GLB before they are read.

use std::collections::BTreeMap;

use serde_json::Value;
use thiserror::Error;

use crate::displacements::FbxDisplacements;
use crate::gltf::{self, GltfError};
use crate::memory::MemoryError;

/// Error of reading an FBX file.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum FbxError {
    /// The file cannot be converted, for the reason given.
    #[error("{0}")]
    Refused(String),
    /// The file exceeds the memory limit.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// This build has no converter: the caller converts the file, and reads the GLB.
    #[error("it is an FBX file, and no converter is available: convert it to GLB first")]
    NoConverter,
}

/// A GLB, and what it lacks of the FBX file.
pub(crate) struct Converted {
    pub(crate) glb: Vec<u8>,
    pub(crate) notices: Vec<String>,
}

/// Converts an FBX file, using at most `memory_limit` bytes together with the file.
#[cfg(feature = "fbx")]
pub(crate) fn convert(bytes: &[u8], memory_limit: u64) -> Result<Converted, FbxError> {
    let held = bytes.len() as u64;
    MemoryError::check(held, memory_limit)?;
    let cagework_fbx::Converted { glb, notices } = cagework_fbx::convert(bytes, memory_limit - held)
        .map_err(|error| FbxError::Refused(error.to_string()))?;
    Ok(Converted { glb, notices })
}

#[cfg(not(feature = "fbx"))]
pub(crate) fn convert(_: &[u8], _: u64) -> Result<Converted, FbxError> {
    Err(FbxError::NoConverter)
}

/// Names of external images; empty if the file cannot be converted.
pub(crate) fn named_files(bytes: &[u8], memory_limit: u64) -> Vec<String> {
    convert(bytes, memory_limit).map_or(Vec::new(), |fbx| gltf::named_files(&fbx.glb, memory_limit))
}

/// Memory of a number of the displacements while they are written, bytes: as it is, and as JSON.
const BYTES_PER_NUMBER: usize = 4 + 16;

/// Reads the last `n_poses` morph targets of a GLB that was written from an FBX file. Nodes that show the same mesh of the
/// file have one item each. Empty if the GLB has no meshes of an FBX file. `memory_limit`: limit on the memory of the GLB
/// and the result, bytes.
///
/// # Errors
/// If the GLB cannot be read, or the result needs more memory.
pub fn fbx_displacements(
    glb: &[u8],
    n_poses: usize,
    memory_limit: u64,
) -> Result<Vec<FbxDisplacements>, GltfError> {
    let document = gltf::document_written("displacements.glb", glb)?;
    let (mut held, mut longest) = (2 * glb.len() as u64, 0);
    let vectors = |accessor: &Value, scale: f64| -> Result<Vec<[f32; 3]>, GltfError> {
        let Some(accessor) = accessor.as_u64() else { return Ok(Vec::new()) };
        let values = document.source().floats::<3>(accessor as u32, "a position")?;
        Ok(values.into_iter().map(|p| p.map(|x| (f64::from(x) / scale) as f32)).collect())
    };
    let mut all = Vec::new();
    for node in document.json["nodes"].as_array().into_iter().flatten() {
        let origin = &node["extras"]["fbx"];
        let (Some(name), Some(scale), Some(mesh)) =
            (origin["node"].as_str(), origin["scale"].as_f64(), node["mesh"].as_u64())
        else {
            continue;
        };
        let mesh = &document.json["meshes"][mesh as usize];
        // Position and displacements of each control point, from its first vertex.
        let mut points: BTreeMap<u32, Vec<[f32; 3]>> = BTreeMap::new();
        for primitive in mesh["primitives"].as_array().into_iter().flatten() {
            let attributes = &primitive["attributes"];
            let Some(indices) = attributes["_FBX_POINT"].as_u64() else { continue };
            let indices = document.source().floats::<1>(indices as u32, "_FBX_POINT")?;
            let targets = primitive["targets"].as_array().map_or(&[][..], Vec::as_slice);
            let targets = &targets[targets.len().saturating_sub(n_poses)..];
            let mut columns = vec![vectors(&attributes["POSITION"], scale)?];
            for target in targets {
                columns.push(vectors(&target["POSITION"], scale)?);
            }
            let of = |v: usize| columns.iter().map(move |column| column.get(v).copied().unwrap_or_default());
            for (v, [index]) in indices.into_iter().enumerate() {
                points.entry(index as u32).or_insert_with(|| of(v).collect());
            }
        }
        // An array of names in NPZ has 4 bytes per character of the longest name.
        let mesh_name = mesh["name"].as_str().unwrap_or_default();
        longest = name.len().max(mesh_name.len()).max(longest);
        held += (points.len() * BYTES_PER_NUMBER * (1 + 3 * (1 + n_poses))) as u64;
        MemoryError::check(held + 8 * (longest * (all.len() + 1)) as u64, memory_limit)?;
        let column = |k: usize| points.values().map(|of| of.get(k).copied().unwrap_or_default()).collect();
        all.push(FbxDisplacements {
            node: name.to_owned(),
            mesh: mesh_name.to_owned(),
            indices: points.keys().copied().collect(),
            positions: column(0),
            displacements: (1..=n_poses).map(column).collect(),
        });
    }
    Ok(all)
}
