//! How much of everything a document has.

/// How much of everything a document has. OBJ counts `o` and `g` lines as nodes, `usemtl` names as materials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Scenes.
    pub scenes: usize,
    /// Nodes.
    pub nodes: usize,
    /// Meshes.
    pub meshes: usize,
    /// Triangle primitives in use; a mesh shown twice counts twice.
    pub primitives: usize,
    /// Materials.
    pub materials: usize,
    /// Textures.
    pub textures: usize,
    /// Skins.
    pub skins: usize,
    /// Joints of all skins; one of several skins counts once.
    pub joints: usize,
    /// Animations.
    pub animations: usize,
    /// Morph targets of all meshes.
    pub morph_targets: usize,
}
