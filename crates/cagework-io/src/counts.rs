//! Numbers of elements in a document: scenes, nodes, meshes and so on.

use serde::{Deserialize, Serialize};

/// Numbers of elements in a document. OBJ: `o` and `g` lines count as nodes, `usemtl` names as materials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Number of scenes.
    pub scenes: usize,
    /// Number of nodes.
    pub nodes: usize,
    /// Number of meshes.
    pub meshes: usize,
    /// Number of triangle primitives in use. A primitive counts once for each node that shows its mesh.
    pub primitives: usize,
    /// Number of materials.
    pub materials: usize,
    /// Number of textures of a glTF; 0 for other formats.
    pub textures: usize,
    /// Number of skins.
    pub skins: usize,
    /// Number of joints of all skins. A joint of several skins counts once.
    pub joints: usize,
    /// Number of animations.
    pub animations: usize,
    /// Number of morph targets of all meshes.
    pub morph_targets: usize,
}
