//! Skins: joints, inverse bind matrices and the influences of vertices.

use std::collections::{HashMap, HashSet};

use cagework_core::words::counted;
use glam::Mat4;
use serde_json::json;
use ufbx::{Mesh, Scene, SkinDeformer, SkinVertex, SkinWeight, SkinningMethod};

use crate::document::Document;
use crate::limits::FbxError;
use crate::node::Nodes;

/// Influences per vertex that glTF stores in one pair of attributes.
const PER_SET: usize = 4;
/// Limit on the influences per vertex.
const MAX_INFLUENCES: usize = 2 * PER_SET;
/// Limit on the joints of a skin: indices of joints have 16 bits.
const MAX_JOINTS: usize = 1 << 16;

/// Joints and weights of four influences per vertex.
type Set = (Vec<[u16; PER_SET]>, Vec<[f32; PER_SET]>);

/// Written skins, by deformer and by the node that is a joint itself.
#[derive(Default)]
pub(crate) struct Skins(HashMap<(u32, Option<usize>), usize>);

/// The skin of a mesh: the first one with joints.
pub(crate) fn of(mesh: &Mesh) -> Option<&SkinDeformer> {
    mesh.skin_deformers
        .iter()
        .map(AsRef::as_ref)
        .find(|deformer: &&SkinDeformer| !deformer.clusters.is_empty())
}

impl Skins {
    /// Writes a skin; returns its index. Its joints are the deformer's clusters. `own`: node of the mesh, if it is the joint of
    /// vertices without others.
    pub(crate) fn write(
        &mut self,
        deformer: &SkinDeformer,
        own: Option<usize>,
        nodes: &mut Nodes,
        document: &mut Document,
    ) -> Result<usize, FbxError> {
        let key = (deformer.element.typed_id, own);
        if let Some(&known) = self.0.get(&key) {
            return Ok(known);
        }
        if deformer.clusters.len() >= MAX_JOINTS {
            return Err(FbxError::TooMany { what: "joints in a skin", limit: MAX_JOINTS });
        }
        let (mut joints, mut binds) = (Vec::new(), Vec::new());
        let mut listed = HashSet::new();
        let bones = deformer.clusters.iter().map(|cluster| {
            let bone = cluster.bone_node.as_ref().map(|bone| nodes.joint(bone)).unwrap_or_default();
            (bone, matrix(&cluster.geometry_to_bone))
        });
        let all: Vec<(usize, Mat4)> = bones.collect();
        for (joint, bind) in all.into_iter().chain(own.map(|own| (own, Mat4::IDENTITY))) {
            let joint = if listed.insert(joint) { joint } else { nodes.copy_of(joint) };
            joints.push(joint);
            binds.push(bind.to_cols_array());
        }
        nodes.add_skin(&joints);
        let bind = document.floats(&binds, None, false)?;
        let skin = document.push("skins", json!({ "joints": joints, "inverseBindMatrices": bind }))?;
        self.0.insert(key, skin);
        Ok(skin)
    }
}

/// A matrix; the identity if a number is not finite.
fn matrix(m: &ufbx::Matrix) -> Mat4 {
    let columns = [
        [m.m00, m.m10, m.m20, 0.0],
        [m.m01, m.m11, m.m21, 0.0],
        [m.m02, m.m12, m.m22, 0.0],
        [m.m03, m.m13, m.m23, 1.0],
    ];
    let matrix = Mat4::from_cols_array_2d(&columns.map(|column| column.map(|x| x as f32)));
    if matrix.is_finite() { matrix } else { Mat4::IDENTITY }
}

/// Influences of vertices with these control points, in one or two sets. Sets `has_own_joint` if some have none.
pub(crate) fn influences(deformer: &SkinDeformer, points: &[u32], has_own_joint: &mut bool) -> Vec<Set> {
    let n_sets = if deformer.max_weights_per_vertex > PER_SET { 2 } else { 1 };
    let mut sets: Vec<Set> = (0..n_sets).map(|_| (Vec::new(), Vec::new())).collect();
    for &point in points {
        let (mut joints, mut weights) = ([0_u16; MAX_INFLUENCES], [0.0_f32; MAX_INFLUENCES]);
        let found = weights_of(deformer, point);
        let sum: f64 = found.iter().map(|weight| weight.weight).sum();
        if sum > 0.0 && sum.is_finite() {
            for (k, weight) in found.iter().enumerate().filter(|(_, weight)| weight.weight > 0.0) {
                joints[k] = weight.cluster_index as u16;
                weights[k] = (weight.weight / sum) as f32;
            }
        } else {
            joints[0] = deformer.clusters.len() as u16;
            weights[0] = 1.0;
            *has_own_joint = true;
        }
        for (k, set) in sets.iter_mut().enumerate() {
            let four = |from: usize| 4 * k + from;
            set.0.push([0, 1, 2, 3].map(|c| joints[four(c)]));
            set.1.push([0, 1, 2, 3].map(|c| weights[four(c)]));
        }
    }
    sets
}

/// The largest weights of a control point, up to [`MAX_INFLUENCES`].
fn weights_of(deformer: &SkinDeformer, point: u32) -> &[SkinWeight] {
    let Some(SkinVertex { weight_begin, num_weights, .. }) = deformer.vertices.get(point as usize) else {
        return &[];
    };
    let first = *weight_begin as usize;
    let n = (*num_weights as usize).min(MAX_INFLUENCES);
    deformer.weights.get(first..first.saturating_add(n)).unwrap_or_default()
}

/// What skins lose.
pub(crate) fn notices(scene: &Scene) -> Vec<String> {
    let count = |is: fn(&SkinDeformer) -> bool| scene.skin_deformers.iter().filter(|skin| is(skin)).count();
    let curved = count(|skin| {
        matches!(skin.skinning_method, SkinningMethod::DualQuaternion | SkinningMethod::BlendedDqLinear)
    });
    let many = count(|skin| skin.max_weights_per_vertex > MAX_INFLUENCES);
    let further = scene.meshes.iter().filter(|mesh| mesh.skin_deformers.len() > 1).count();
    let mut all = Vec::new();
    if curved > 0 {
        let skins = counted(curved, "skin blends", "skins blend");
        all.push(format!("{skins} dual quaternions in FBX: glTF blends matrices"));
    }
    if many > 0 {
        let skins = counted(many, "skin has", "skins have");
        all.push(format!(
            "{skins} more than {MAX_INFLUENCES} influences per vertex: the largest {MAX_INFLUENCES} are kept"
        ));
    }
    if further > 0 {
        all.push(format!(
            "{} several skins: only the first one is kept",
            counted(further, "mesh has", "meshes have")
        ));
    }
    all
}
