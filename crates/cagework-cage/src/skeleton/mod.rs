//! Skeletons of figures: chains of joints, and the chain of each vertex of the model.
//!
//! A skeleton is derived from the joints of a rigged model ([`Skeleton::of_rig`]), or from the voxels of the model
//! ([`Skeleton::of_surface`]).

mod curve;
mod mirror;
mod paths;
mod rigged;
#[cfg(test)]
pub(crate) mod tests;
mod tree;

use cagework_core::progress::{Cancellation, Progress};
pub use cagework_core::rig::{Joint, Rig};
use glam::{DVec3, Vec3};
use thiserror::Error;

use rigged::MAX_JOINTS;

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
    /// Whether all joints lie on the mirror plane; always true for the trunk.
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
    /// Bone of each vertex: the index of a joint of the rig, or of a chain of a curve skeleton. `[n_vertices]`
    pub bone_of: Vec<u32>,
    /// Axis of the mirror plane: 0 for a plane of constant x.
    pub axis: usize,
    /// Coordinate of the mirror plane along `axis`, object units.
    pub offset: f64,
    /// Whether the whole model is symmetric.
    pub is_symmetric: bool,
    /// Whether the legs run against the spine, so that the trunk ends at the hips.
    pub is_biped: bool,
    /// Whether the chains follow the joints of a rig, not a curve skeleton of voxels.
    pub is_rigged: bool,
}

/// Why a model has no skeleton.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum SkeletonError {
    /// The model has no triangles.
    #[error("the model has no faces, so it has no limbs: use another kind of cage")]
    NoFaces,
    /// The model is thinner than one voxel.
    #[error(
        "the model is thinner than 1/72 of its longest side, so its limbs are not found: use another kind of cage"
    )]
    Flat,
    /// The triangles cover too many voxels together.
    #[error("the model has too many large triangles to find its limbs: use another kind of cage")]
    Soup,
    /// No joint moves a vertex.
    #[error("none of the {joints} joints of the rig moves a vertex: remove the rig, or assign weights")]
    NoWeights {
        /// Number of joints of the rig.
        joints: usize,
    },
    /// Too many joints move vertices.
    #[error(
        "{joints} joints of the rig move vertices; at most {MAX_JOINTS} are supported: use another kind of cage"
    )]
    TooManyJoints {
        /// Number of joints with vertices at them or below them.
        joints: usize,
    },
    /// The arrays of the rig contradict each other.
    #[error("the rig is not valid: {0}")]
    Rig(&'static str),
    /// Cancelled by the caller.
    #[error(transparent)]
    Cancelled(#[from] Cancellation),
}

impl Skeleton {
    /// Derives the skeleton from a rig.
    ///
    /// `positions`: vertices of the model at the rest of the rig, object units, `[n_vertices]`. Vertices
    /// without weights, and those beyond the rig's, such as the ends of morph targets, belong to the joint of the nearest
    /// vertex with weights.
    ///
    /// # Errors
    /// [`SkeletonError`] if the rig is not valid, no joint moves a vertex, or too many do.
    pub fn of_rig(positions: &[Vec3], rig: &Rig) -> Result<Self, SkeletonError> {
        rigged::of_rig(positions, rig)
    }

    /// Derives the skeleton from the model's voxels: 72 along its longest side.
    ///
    /// `positions`: `[n_vertices]`, object units, finite. `triangles`: `[n_triangles]`, any soup with valid indices.
    ///
    /// Source: Sato et al. 2000, "TEASAR: tree-structure extraction algorithm for accurate and robust skeletons".
    /// Changes: steps cost more away from the middle of the local thickness, and the paths of symmetric models are
    /// mirrored.
    ///
    /// # Errors
    /// [`SkeletonError`] if the model has no faces or is flat, or if `progress` cancels.
    pub fn of_surface(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        progress: &dyn Progress,
    ) -> Result<Self, SkeletonError> {
        curve::of_surface(positions, triangles, progress)
    }

    /// Segments between the joints of all chains. `[n_segments]`, object units
    #[must_use]
    pub fn segments(&self) -> Vec<[Vec3; 2]> {
        let pairs =
            |chain: &Chain| chain.at.windows(2).map(|pair| [pair[0].as_vec3(), pair[1].as_vec3()]).collect();
        self.chains.iter().flat_map(|chain| -> Vec<[Vec3; 2]> { pairs(chain) }).collect()
    }
}
