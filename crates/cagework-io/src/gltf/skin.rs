//! Skins: skinning matrices at rest.

use ::gltf::json::mesh::{Primitive, Semantic};
use ::gltf::json::validation::Checked;
use glam::{DMat4, Mat4};

use super::accessor::Source;
use super::scene::Worlds;
use super::{GltfDocument, GltfError, get};

/// Largest number of sets `JOINTS_n` that are read, each with four joints per vertex.
const MAX_SETS: u32 = 8;

/// Computes the transform from bind space to world space of each joint, `world_j * inverse_bind_j`; empty for unused
/// skins. Joints are at their positions in the node hierarchy, as in viewers without animation.
pub(crate) fn shown_joints(document: &GltfDocument, worlds: &Worlds) -> Result<Vec<Vec<DMat4>>, GltfError> {
    let skins = &document.root.skins;
    let mut all = vec![Vec::new(); skins.len()];
    for skin in document.instances.iter().filter_map(|i| i.skin) {
        if all[skin as usize].is_empty() {
            all[skin as usize] = joints(document, skin, worlds, &inverse_binds(document, skin)?)?;
        }
    }
    Ok(all)
}

/// Computes the transform from bind space to world space of each joint of one skin.
pub(crate) fn joints(
    document: &GltfDocument,
    skin: u32,
    worlds: &Worlds,
    binds: &[DMat4],
) -> Result<Vec<DMat4>, GltfError> {
    let joints = document.root.skins[skin as usize].joints.iter().zip(binds);
    let joint = |(node, bind): (&::gltf::json::Index<_>, &DMat4)| {
        let world = get(&worlds.world, node.value(), "joint node", || format!("skin {skin}"))?;
        Ok(*world * *bind)
    };
    joints.map(joint).collect()
}

/// Reads the inverse bind matrices of a skin's joints. Excess matrices are allowed unless they are implicit zeros.
pub(crate) fn inverse_binds(document: &GltfDocument, number: u32) -> Result<Vec<DMat4>, GltfError> {
    let skin = &document.root.skins[number as usize];
    let Some(accessor) = skin.inverse_bind_matrices.map(|a| a.value() as u32) else {
        return Ok(vec![DMat4::IDENTITY; skin.joints.len()]);
    };
    let (count, expected) = (document.source().count(accessor)?, skin.joints.len() as u64);
    let in_buffer = document.root.accessors[accessor as usize].buffer_view.is_some();
    if count > expected && !in_buffer {
        let what = "inverse bind matrices".to_owned();
        return Err(GltfError::Count { accessor, what, count, expected, of: "joints" });
    }
    let binds = document.source().floats::<16>(accessor, "a skin")?;
    let from = || format!("skin {number}");
    let bind = |j| Ok(Mat4::from_cols_array(get(&binds, j, "inverse bind matrix", from)?).as_dmat4());
    let all = (0..skin.joints.len()).map(bind).collect::<Result<Vec<DMat4>, GltfError>>()?;
    match all.iter().position(|bind| !bind.is_finite()) {
        Some(joint) => {
            let problem = format!("has a non-finite inverse bind matrix for joint {joint} of skin {number}");
            Err(GltfError::Accessor { accessor, problem })
        }
        None => Ok(all),
    }
}

/// Calls `visit` with vertex, joint (index in the skin) and weight, for each positive weight.
pub(crate) fn each_influence(
    source: Source<'_>,
    primitive: &Primitive,
    count: usize,
    mut visit: impl FnMut(usize, u32, f64),
) -> Result<(), GltfError> {
    for set in 0..MAX_SETS {
        let attribute =
            |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(|a| a.value() as u32);
        let (Some(j), Some(w)) = (attribute(Semantic::Joints(set)), attribute(Semantic::Weights(set))) else {
            break;
        };
        let indices = source.unsigned::<4>(j, "joints")?;
        let weights = source.floats::<4>(w, "joint weights")?;
        for v in 0..count {
            let joints = get(&indices, v, "element", || format!("accessor {j}: a vertex"))?;
            let weights = get(&weights, v, "element", || format!("accessor {w}: a vertex"))?;
            for (&joint, &weight) in joints.iter().zip(weights) {
                if weight.is_finite() && weight > 0.0 {
                    visit(v, joint, f64::from(weight));
                }
            }
        }
    }
    Ok(())
}

/// Computes the transform from mesh space to world space of each vertex of a skinned primitive, `sum_j w_j * joint_j`,
/// and the number of vertices without positive weight, whose transform is `world`.
///
/// The transform of the mesh's node is ignored (glTF 2.0, section 3.7.3.3).
pub(crate) fn matrices(
    source: Source<'_>,
    (skin, joints): (u32, &[DMat4]),
    world: DMat4,
    primitive: &Primitive,
    count: usize,
) -> Result<(Vec<DMat4>, usize), GltfError> {
    let mut sum = vec![(DMat4::ZERO, 0.0_f64); count];
    let mut wrong = None;
    each_influence(source, primitive, count, |v, joint, weight| match joints.get(joint as usize) {
        Some(&matrix) => {
            sum[v].0 += weight * matrix;
            sum[v].1 += weight;
        }
        None => wrong = wrong.or(Some(joint)),
    })?;
    if let Some(joint) = wrong {
        get(joints, joint as usize, "joint", || format!("a vertex of skin {skin}"))?;
    }
    // Divide by the sum of the weights, which quantisation may have changed from 1.
    let n_unweighted = sum.iter().filter(|(_, w)| *w <= 0.0).count();
    Ok((sum.into_iter().map(|(m, w)| if w > 0.0 { m * (1.0 / w) } else { world }).collect(), n_unweighted))
}
