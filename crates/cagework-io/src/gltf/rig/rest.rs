//! Joints at rest and their influences on the vertices, for cages and sliders that follow the skeleton.

use cagework_core::rig::{Joint, Rig};
use glam::{DVec3, Vec3};

use super::nodes::{holders, vrm_bones};
use super::play::Player;
use crate::gltf::scene::{Worlds, name_of};
use crate::gltf::{GltfDocument, GltfError};

/// Reads the joints of all skins and the bones of a VRM; without skins, the animated nodes, too. Positions are in the
/// file's axes, relative to `origin`. Returns `None` if there are none.
///
/// Vertices of rigid meshes have one influence, the nearest of these joints above their node; without one, they have
/// no influence.
///
/// # Errors
/// If the nodes or the weights cannot be read.
pub(crate) fn rest_rig(document: &GltfDocument, origin: DVec3) -> Result<Option<Rig>, GltfError> {
    let bones = vrm_bones(document);
    let nodes = joint_nodes(document);
    if nodes.is_empty() {
        return Ok(None);
    }
    // Joint of each node that is one.
    let mut joint_of = vec![None; document.root.nodes.len()];
    for (joint, &node) in (0..).zip(&nodes) {
        joint_of[node as usize] = Some(joint);
    }
    // Parents come first in the order.
    let mut parents = vec![None; nodes.len()];
    for (node, parent) in Worlds::new(&document.root)?.order {
        let above = parent.and_then(|parent| joint_of[parent as usize]);
        match joint_of[node as usize] {
            Some(joint) => parents[joint as usize] = above,
            None => joint_of[node as usize] = above,
        }
    }
    let player = Player::new(document, document, origin)?;
    let at = player.pose_at(None, 0.0, &[]).origins;
    let joint = |(&node, parent): (&u32, Option<u32>)| Joint {
        name: name_of(&document.json, "nodes", node, "node"),
        parent,
        at: at.get(node as usize).copied().unwrap_or(Vec3::ZERO),
        bone: bones.iter().find(|(_, of)| *of == node as usize).map(|(name, _)| (*name).to_owned()),
    };
    let joints = nodes.iter().zip(parents).map(joint).collect();
    let palette: Vec<Option<u32>> =
        player.palette_nodes().iter().map(|node| joint_of[(*node)? as usize]).collect();
    let (mut first, mut influences) = (vec![0], Vec::new());
    for range in player.skin.joint_starts.windows(2) {
        let own = &player.skin.joints[range[0] as usize..range[1] as usize];
        let own = own.iter().filter_map(|&(entry, weight)| Some((palette[entry as usize]?, weight)));
        influences.extend(own);
        first.push(influences.len() as u32);
    }
    Ok(Some(Rig { joints, first, influences }))
}

/// Nodes of the joints of [`rest_rig`]. `[n_joints]`
pub(super) fn joint_nodes(document: &GltfDocument) -> Vec<u32> {
    let skins = document.root.skins.iter();
    let mut all: Vec<usize> = skins.flat_map(|skin| &skin.joints).map(::gltf::json::Index::value).collect();
    if all.is_empty() {
        all = holders(document);
    } else {
        all.extend(vrm_bones(document).iter().map(|(_, node)| *node));
    }
    let mut is_listed = vec![false; document.root.nodes.len()];
    let is_new =
        |node: &usize| is_listed.get_mut(*node).is_some_and(|is_listed| !std::mem::replace(is_listed, true));
    all.into_iter().filter(is_new).map(|node| node as u32).collect()
}
