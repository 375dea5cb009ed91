//! Skeletons of figures: chains of joints, and the chain of each vertex of the model.

use glam::{DVec3, Vec3};

/// A polyline of joints: the trunk, an arm, a leg or a tail.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    /// Name of the first joint; "trunk" for the trunk.
    pub name: String,
    /// Joints from the trunk outwards; the last one is the tip. Object units, `[n_joints]`, at least two.
    pub at: Vec<DVec3>,
    /// Bone of each segment `at[i]..at[i + 1]`, see [`Skeleton::bone_of`]. `[n_joints - 1]`
    pub bones: Vec<u32>,
    /// Bones whose vertices belong to the chain, from the trunk outwards.
    pub own_bones: Vec<u32>,
    /// Index of the chain from which this one branches; `None` for the trunk.
    pub parent: Option<usize>,
    /// Whether all joints lie on the mirror plane.
    pub is_midline: bool,
    /// Index of the mirror image in [`Skeleton::chains`].
    pub mirror: Option<usize>,
    /// Whether the chain's vertices are images of those of its mirror image, or of its own on the mirror plane.
    pub is_symmetric: bool,
}

/// The skeleton of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct Skeleton {
    /// Chains; the first is the trunk, and each one follows its parent.
    pub chains: Vec<Chain>,
    /// Index of the chain of each vertex. `[n_vertices]`
    pub chain_of: Vec<u32>,
    /// Bone of each vertex: the index of a joint of the rig, or of a segment of a curve skeleton. `[n_vertices]`
    pub bone_of: Vec<u32>,
    /// Axis of the mirror plane: 0 for a plane of constant x.
    pub axis: usize,
    /// Coordinate of the mirror plane along `axis`, object units.
    pub offset: f64,
    /// Whether the whole model is symmetric.
    pub is_symmetric: bool,
    /// Whether the legs run against the spine, so that the trunk ends at the hips.
    pub is_biped: bool,
}

/// A joint of a rigged model, at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Name in the file.
    pub name: String,
    /// Index of the parent joint.
    pub parent: Option<u32>,
    /// Position at rest, object units.
    pub at: Vec3,
}

/// The joints of a rigged model and their influences on its vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rig {
    /// All joints.
    pub joints: Vec<Joint>,
    /// Start of each vertex's influences in `influences`; the last element is their number. `[n_vertices + 1]`
    pub first: Vec<u32>,
    /// Joint and weight of each influence. Rigid vertices have one influence, the joint on which they hang.
    pub influences: Vec<(u32, f32)>,
}
