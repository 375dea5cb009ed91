//! The pose of skeletons at rest.
//!
//! An FBX file stores the pose in which a skin was bound and the pose in which the figure was saved, often the first frame of
//! a clip. Where a joint is bent far, the blended matrices of its vertices are almost singular, and a change of the shape
//! cannot be carried back to the bound vertices. Such a file is therefore at rest in the pose of its skins.

use glam::DVec3;
use ufbx::{Matrix, Scene, matrix_invert, matrix_mul, matrix_to_transform, quat_dot, transform_to_matrix};

use crate::node::{Nodes, Rest};

/// Cosine of half the turn of a joint against the first joint of its skin, beyond which the saved pose is not used: 20 degrees.
const MIN_COSINE: f64 = 0.984_8;
/// Largest difference of two bound poses of a joint that are taken as equal: of axes, and of positions relative to the size
/// of the skeleton. It is also the limit of the shear that translation, rotation and scale of a node cannot express.
const TOLERANCE: f64 = 1e-3;

/// Notice about a saved pose that is not the rest pose.
pub(crate) const NOTICE: &str = "the FBX file was saved in another pose than that of its skin: it is opened in the pose of the \
    skin, and clips keep joints that they do not move as they were saved";

/// Sets the rest pose to the pose of the skins if a joint was saved with a larger turn than that of [`MIN_COSINE`]. Returns
/// the saved transform of each node that it changes, or an empty list. It changes none if two skins bind a joint in
/// different poses. `[n_nodes]`
pub(crate) fn apply(scene: &Scene, nodes: &mut Nodes) -> Vec<Option<Rest>> {
    let rests = bound(scene, nodes).unwrap_or_default();
    rests.into_iter().enumerate().map(|(node, rest)| Some(nodes.set_rest(node, rest?))).collect()
}

/// Rest transform of each joint in the pose of the skins; `None` if the saved pose stays. `[n_nodes]`
fn bound(scene: &Scene, nodes: &Nodes) -> Option<Vec<Option<Rest>>> {
    let order = nodes.parents_first();
    // The root of the scene has no node, and stays where it is.
    let clusters = || scene.skin_deformers.iter().map(|skin| skin.clusters.iter());
    let joint = |cluster: &ufbx::SkinCluster| nodes.number(cluster.bone_node.as_ref()?);
    let mut now = vec![Matrix::default(); nodes.rest.len()];
    for &(node, parent) in &order {
        now[node] = below(&now, parent, &transform_to_matrix(&nodes.rest[node].transform()));
    }
    let mut is_posed = false;
    let mut bound: Vec<Option<Matrix>> = vec![None; now.len()];
    let [mut least, mut most] = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    for skin in clusters() {
        let mut first = None;
        for cluster in skin {
            let Some(node) = joint(cluster) else { continue };
            let matrix = cluster.bind_to_world;
            let turn = matrix_to_transform(&matrix_mul(&now[node], &matrix_invert(&matrix))).rotation;
            is_posed |= quat_dot(*first.get_or_insert(turn), turn).abs() < MIN_COSINE;
            let at = DVec3::new(matrix.m03, matrix.m13, matrix.m23);
            (least, most) = (least.min(at), most.max(at));
            bound[node].get_or_insert(matrix);
        }
    }
    let size = least.distance(most);
    let is_agreed =
        |cluster| joint(cluster).is_none_or(|node| is_same(bound[node], &cluster.bind_to_world, size));
    if !is_posed || !clusters().flatten().all(|cluster| is_agreed(cluster)) {
        return None;
    }
    let mut rests = vec![None; now.len()];
    for (node, parent) in order {
        let Some(matrix) = &bound[node] else {
            now[node] = below(&now, parent, &transform_to_matrix(&nodes.rest[node].transform()));
            continue;
        };
        let local = parent.map_or(*matrix, |parent| matrix_mul(&matrix_invert(&now[parent]), matrix));
        let rest = Rest::of(&matrix_to_transform(&local))?;
        now[node] = below(&now, parent, &transform_to_matrix(&rest.transform()));
        if !is_same(Some(now[node]), matrix, size) {
            return None;
        }
        rests[node] = Some(rest);
    }
    Some(rests)
}

/// World transform of a node with this transform in its parent.
fn below(world: &[Matrix], parent: Option<usize>, local: &Matrix) -> Matrix {
    parent.map_or(*local, |parent| matrix_mul(&world[parent], local))
}

/// Whether two transforms of a joint are equal within [`TOLERANCE`].
fn is_same(a: Option<Matrix>, b: &Matrix, size: f64) -> bool {
    a.is_some_and(|a| {
        let axes = [
            ([a.m00, a.m10, a.m20], [b.m00, b.m10, b.m20]),
            ([a.m01, a.m11, a.m21], [b.m01, b.m11, b.m21]),
            ([a.m02, a.m12, a.m22], [b.m02, b.m12, b.m22]),
        ];
        let near = |(a, b): ([f64; 3], [f64; 3]), limit| DVec3::from(a).distance(b.into()) <= limit;
        let unit = DVec3::from(axes[0].1).length();
        axes.into_iter().all(|pair| near(pair, TOLERANCE * unit))
            && near(([a.m03, a.m13, a.m23], [b.m03, b.m13, b.m23]), TOLERANCE * size)
    })
}
