//! Skins: where joints hold a mesh's vertices at rest.

use ::gltf::json::mesh::{Primitive, Semantic};
use ::gltf::json::validation::Checked;
use glam::{DMat4, Mat4};

use super::scene::Instance;
use super::{GltfDocument, GltfError, get};

/// Most sets `JOINTS_n` that are read: 32 joints for a vertex.
const MAX_SETS: u32 = 8;

/// World from mesh for each vertex of a skinned primitive: `sum_j w_j * world_j * inverse_bind_j`.
///
/// The joints stand where the node tree puts them, which is what viewers show with no animation playing. The
/// transform of the mesh's own node plays no part (glTF 2.0, section 3.7.3.3).
pub(crate) fn matrices(
    document: &GltfDocument,
    instance: &Instance,
    skin: u32,
    primitive: &Primitive,
    count: usize,
) -> Result<Vec<DMat4>, GltfError> {
    let source = document.source();
    let s = &document.root.skins[skin as usize];
    let from = || format!("skin {skin}");
    let binds =
        s.inverse_bind_matrices.map(|a| source.floats::<16>(a.value() as u32, "a skin")).transpose()?;
    let mut joints = Vec::with_capacity(s.joints.len());
    for (j, node) in s.joints.iter().enumerate() {
        let world = *get(&document.worlds.world, node.value(), "joint node", from)?;
        let bind = match &binds {
            Some(binds) => Mat4::from_cols_array(get(binds, j, "inverse bind matrix", from)?).as_dmat4(),
            None => DMat4::IDENTITY,
        };
        joints.push(world * bind);
    }
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
                    sum[v] += f64::from(weight) * *get(&joints, joint as usize, "joint", from)?;
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
