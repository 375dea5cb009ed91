//! Skins: where joints hold a mesh's vertices at rest.

use ::gltf::json::mesh::{Primitive, Semantic};
use ::gltf::json::skin::Skin;
use ::gltf::json::validation::Checked;
use glam::{DMat4, Mat4};

use super::scene::{Instance, Worlds};
use super::{GltfDocument, GltfError, get};

/// Most sets `JOINTS_n` that are read: 32 joints for a vertex.
const MAX_SETS: u32 = 8;

/// World from bind space for each joint: `world_j * inverse_bind_j`, of the skins that are shown; others stay empty.
///
/// The joints stand where the node tree puts them, which is what viewers show with no animation playing.
pub(crate) fn joints(document: &GltfDocument, worlds: &Worlds) -> Result<Vec<Vec<DMat4>>, GltfError> {
    let skins = &document.root.skins;
    let mut joints = vec![Vec::new(); skins.len()];
    let mut is_shown = vec![false; skins.len()];
    document.instances.iter().filter_map(|i| i.skin).for_each(|skin| is_shown[skin as usize] = true);
    for (number, skin) in skins.iter().enumerate().filter(|(number, _)| is_shown[*number]) {
        let from = || format!("skin {number}");
        let binds = skin.inverse_bind_matrices.map(|a| inverse_binds(document, a.value() as u32, skin));
        let binds = binds.transpose()?;
        for (j, node) in skin.joints.iter().enumerate() {
            let world = *get(&worlds.world, node.value(), "joint node", from)?;
            let bind = match &binds {
                Some(binds) => Mat4::from_cols_array(get(binds, j, "inverse bind matrix", from)?).as_dmat4(),
                None => DMat4::IDENTITY,
            };
            joints[number].push(world * bind);
        }
    }
    Ok(joints)
}

/// The matrices of a skin; there may be more than it has joints, but not of zeros that no buffer holds.
fn inverse_binds(document: &GltfDocument, accessor: u32, skin: &Skin) -> Result<Vec<[f32; 16]>, GltfError> {
    let (count, expected) = (document.source().count(accessor)?, skin.joints.len() as u64);
    let in_buffer = document.root.accessors[accessor as usize].buffer_view.is_some();
    if count > expected && !in_buffer {
        let what = "inverse bind matrices".to_owned();
        return Err(GltfError::Count { accessor, what, count, expected, of: "joints" });
    }
    document.source().floats::<16>(accessor, "a skin")
}

/// World from mesh for each vertex of a skinned primitive: `sum_j w_j * joint_j`.
///
/// The transform of the mesh's own node plays no part (glTF 2.0, section 3.7.3.3).
pub(crate) fn matrices(
    document: &GltfDocument,
    instance: &Instance,
    skin: u32,
    primitive: &Primitive,
    count: usize,
) -> Result<Vec<DMat4>, GltfError> {
    let source = document.source();
    let joints = &document.joints[skin as usize];
    let from = || format!("skin {skin}");
    let mut sum = vec![DMat4::ZERO; count];
    let mut total = vec![0.0_f64; count];
    for set in 0..MAX_SETS {
        let attribute =
            |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(|a| a.value() as u32);
        let (Some(j), Some(w)) = (attribute(Semantic::Joints(set)), attribute(Semantic::Weights(set))) else {
            break;
        };
        let indices = source.unsigned::<4>(j, "joints")?;
        let weights = source.floats::<4>(w, "joint weights")?;
        for v in 0..count {
            for (&joint, &weight) in get(&indices, v, "element", || format!("accessor {j}: a vertex"))?
                .iter()
                .zip(get(&weights, v, "element", || format!("accessor {w}: a vertex"))?)
            {
                if weight.is_finite() && weight > 0.0 {
                    sum[v] += f64::from(weight) * *get(joints, joint as usize, "joint", from)?;
                    total[v] += f64::from(weight);
                }
            }
        }
    }
    // Weights need not sum to one after quantisation; a vertex without any stays with its node.
    Ok(sum
        .into_iter()
        .zip(total)
        .map(|(m, w)| if w > 0.0 { m * (1.0 / w) } else { instance.world })
        .collect())
}
