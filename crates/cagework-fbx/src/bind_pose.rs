//! The pose of skeletons at rest.
//!
//! An FBX file stores the pose in which a skin was bound and the pose in which the figure was saved, often the first frame of
//! a clip. Where a joint is bent far, the blended matrices of its vertices are almost singular, and a change of the shape
//! cannot be carried back to the bound vertices. The document is therefore at rest in the pose of its skins.

use std::collections::BTreeMap;

use glam::{DMat4, DQuat, DVec3};
use ufbx::Scene;

use crate::node::{Nodes, Rest};

/// Turn of a joint against the first joint of its skin, radians, above which the saved pose is not used: 20 degrees.
const MAX_TURN: f64 = 0.35;
/// Largest difference of two bound poses of a joint that are taken as equal: of axes, and of positions relative to the size
/// of the skeleton. It is also the limit of the shear that translation, rotation and scale of a node cannot express.
const TOLERANCE: f64 = 1e-3;

/// Notice about a saved pose that is not the rest pose.
pub(crate) const NOTICE: &str = "the FBX file was saved in another pose than that of its skin: it is opened in the pose of the \
    skin, and its clips show the saved one";

/// Sets the rest pose to the pose of the skins if the saved one differs from it by more than [`MAX_TURN`]. Returns the saved
/// transforms of the nodes that it changes. It changes none if skins bind a joint in different poses.
pub(crate) fn apply(scene: &Scene, nodes: &mut Nodes) -> BTreeMap<usize, Rest> {
    changed(scene, nodes)
        .map(|rests| rests.into_iter().map(|(node, rest)| (node, nodes.set_rest(node, rest))).collect())
        .unwrap_or_default()
}

/// Rest transforms of the joints in the pose of the skins.
fn changed(scene: &Scene, nodes: &Nodes) -> Option<Vec<(usize, Rest)>> {
    let skins: Vec<Vec<(usize, DMat4)>> = scene
        .skin_deformers
        .iter()
        .map(|skin| {
            let clusters = skin.clusters.iter();
            clusters
                .filter_map(|c| Some((nodes.number(c.bone_node.as_ref()?)?, matrix(&c.bind_to_world))))
                .collect()
        })
        .collect();
    let order = nodes.parents_first();
    let mut now = vec![DMat4::IDENTITY; nodes.rest.len()];
    for &(node, parent) in &order {
        now[node] = parent.map_or(DMat4::IDENTITY, |parent| now[parent]) * nodes.rest[node].matrix();
    }
    let moved = skins.iter().any(|skin| {
        let turns = skin.iter().map(|&(node, bound)| rotation(&(now[node] * bound.inverse())));
        let turns: Vec<DQuat> = turns.collect();
        turns.iter().any(|turn| turn.angle_between(turns[0]) > MAX_TURN)
    });
    if !moved {
        return None;
    }
    let mut bound: BTreeMap<usize, DMat4> = BTreeMap::new();
    for &(node, matrix) in skins.iter().flatten() {
        bound.entry(node).or_insert(matrix);
    }
    let positions = bound.values().map(|matrix| matrix.w_axis.truncate());
    let size = positions.clone().reduce(DVec3::max)?.distance(positions.reduce(DVec3::min)?);
    let is_same = |a: &DMat4, b: &DMat4| {
        let unit = a.x_axis.length().max(f64::MIN_POSITIVE);
        let axes = [a.x_axis - b.x_axis, a.y_axis - b.y_axis, a.z_axis - b.z_axis];
        axes.iter().all(|axis| axis.length() <= TOLERANCE * unit)
            && (a.w_axis - b.w_axis).length() <= TOLERANCE * size
    };
    if !skins.iter().flatten().all(|(node, matrix)| is_same(&bound[node], matrix)) {
        return None;
    }
    let mut rests = Vec::new();
    for (node, parent) in order {
        let above = parent.map_or(DMat4::IDENTITY, |parent| now[parent]);
        let Some(&matrix) = bound.get(&node) else {
            now[node] = above * nodes.rest[node].matrix();
            continue;
        };
        let rest = Rest::of_matrix(&(above.inverse() * matrix))?;
        now[node] = above * rest.matrix();
        if !is_same(&matrix, &now[node]) {
            return None;
        }
        rests.push((node, rest));
    }
    Some(rests)
}

/// The rotation of a matrix without shear.
fn rotation(matrix: &DMat4) -> DQuat {
    matrix.to_scale_rotation_translation().1
}

fn matrix(m: &ufbx::Matrix) -> DMat4 {
    DMat4::from_cols_array_2d(&[
        [m.m00, m.m10, m.m20, 0.0],
        [m.m01, m.m11, m.m21, 0.0],
        [m.m02, m.m12, m.m22, 0.0],
        [m.m03, m.m13, m.m23, 1.0],
    ])
}
