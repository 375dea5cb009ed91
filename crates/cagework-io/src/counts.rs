//! Statistics of a document.

/// Numbers of elements in a document. OBJ: `o` and `g` lines count as nodes, `usemtl` names as materials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Scenes.
    pub scenes: usize,
    /// Nodes.
    pub nodes: usize,
    /// Meshes.
    pub meshes: usize,
    /// Triangle primitives in use, once per node that shows their mesh.
    pub primitives: usize,
    /// Materials.
    pub materials: usize,
    /// Textures of a glTF; 0 for other formats.
    pub textures: usize,
    /// Skins.
    pub skins: usize,
    /// Joints of all skins. Shared joints count once.
    pub joints: usize,
    /// Animations.
    pub animations: usize,
    /// Morph targets of all meshes.
    pub morph_targets: usize,
}
