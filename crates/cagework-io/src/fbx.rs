//! FBX files, which `cagework_fbx` converts to GLB before they are read.

use thiserror::Error;

use crate::gltf;
use crate::memory::MemoryError;

/// Error of reading an FBX file.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
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
