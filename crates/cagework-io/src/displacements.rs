//! Displacements of the control points of an FBX file.

use serde::Serialize;

/// Displacements of the control points of a mesh, in the units and axes of the mesh in the FBX file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FbxDisplacements {
    /// Name of the node that shows the mesh.
    pub node: String,
    /// Name of the mesh.
    pub mesh: String,
    /// Indices of the control points of faces, ascending. `[n_points]`
    pub indices: Vec<u32>,
    /// Positions at rest, without blend shapes. `[n_points, 3]`
    pub positions: Vec<[f32; 3]>,
    /// `[n_poses][n_points, 3]`
    pub displacements: Vec<Vec<[f32; 3]>>,
}

/// Writes displacements as JSON: `poses`, the names of the poses, and `meshes`, a list of [`FbxDisplacements`].
///
/// # Panics
/// Never: the struct has no keys that JSON cannot represent.
#[must_use]
pub fn write_displacements_json(poses: &[String], meshes: &[FbxDisplacements]) -> Vec<u8> {
    #[derive(Serialize)]
    struct File<'a> {
        poses: &'a [String],
        meshes: &'a [FbxDisplacements],
    }
    serde_json::to_vec(&File { poses, meshes }).expect("the struct has text keys only")
}
