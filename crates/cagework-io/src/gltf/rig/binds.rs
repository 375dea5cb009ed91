//! Inverse bind matrices of a deformed skeleton.
//!
//! `B' = G'^-1 G B` keeps the skinning matrices `M = G B` of all joints. If the rest pose differs from the bind pose,
//! these matrices differ between joints. A vertex of several joints then has one position in mesh space, but its
//! deformed position needs another one for each joint, so clips are not exact. For a shift and a uniform scale of the
//! whole model, `S(x) = s x + b`, they are exact with `B' = G'^-1 S N S^-1 M0`, where `N = M M0^-1` leads from the pose
//! of one joint, `M0`, to that of another. A joint in the same pose as the first one keeps its `M`.

use std::collections::HashMap;

use ::gltf::json::Index;
use glam::{DMat3, DMat4, DVec3, Mat4};

use super::Rig;
use super::edit::Edit;

/// Largest distance of a point from its place after a uniform scale, as a fraction of the model's diagonal. Weights
/// reproduce affine maps within 1e-6.
const MAX_RESIDUAL: f64 = 1e-5;
/// Change of a skinning matrix that is rounding, as a fraction of the model's diagonal.
const MIN_CHANGE: f64 = 1e-6;

/// Writes the inverse bind matrices for joints with the new transforms `world`. `by`: displacements of all points.
/// Returns those of all skins, rounded to f32.
pub(super) fn write_binds(
    rig: &Rig<'_>,
    edit: &mut Edit<'_>,
    (by, world): (&[DVec3], &[DMat4]),
) -> HashMap<u32, Vec<DMat4>> {
    let mut all = rig.binds.clone();
    let mut numbers: Vec<u32> = all.keys().copied().collect();
    numbers.sort_unstable();
    let scaling = Scaling::of(rig, by, world);
    for number in numbers {
        let skin = &rig.document.root.skins[number as usize];
        let Some(binds) = all.get_mut(&number) else { continue };
        let before = |joint: usize, bind: DMat4| rig.worlds.world[joint] * bind;
        let joints = || skin.joints.iter().map(Index::value);
        let first = joints().zip(&*binds).find(|(joint, _)| rig.held[*joint] > 0.0);
        let reference = first.map(|(joint, &bind)| before(joint, bind).inverse()).filter(DMat4::is_finite);
        let mut has_changed = false;
        for (joint, bind) in joints().zip(binds.iter_mut()) {
            let [old, new] = [&rig.worlds.world[joint], &world[joint]];
            let mut matrix = before(joint, *bind);
            let shift = scaling.zip(reference).map(|(scaling, from)| scaling.shift_of(matrix * from));
            let shift = shift.filter(|by| by.length() > MIN_CHANGE * rig.diagonal).unwrap_or(DVec3::ZERO);
            matrix.w_axis += shift.extend(0.0);
            let back = new.inverse();
            if (old != new || shift != DVec3::ZERO) && back.is_finite() {
                *bind = (back * matrix).as_mat4().as_dmat4();
                has_changed = true;
            }
        }
        if has_changed {
            let values: Vec<[f32; 16]> =
                binds.iter().map(|b: &DMat4| Mat4::to_cols_array(&b.as_mat4())).collect();
            let accessor = skin.inverse_bind_matrices.map(|a| a.value());
            let accessor = edit.write(accessor, &values, false, false);
            edit.json["skins"][number as usize]["inverseBindMatrices"] = accessor.into();
        }
    }
    all
}

/// A uniform scale and a shift, `x -> scale x + shift`.
#[derive(Clone, Copy)]
struct Scaling {
    scale: f64,
    shift: DVec3,
}

impl Scaling {
    /// Fits the deformation of all skinned vertices and of their joints, by least squares. `None` if it is anything else
    /// than a shift and a uniform scale.
    fn of(rig: &Rig<'_>, by: &[DVec3], world: &[DMat4]) -> Option<Self> {
        let skinned = rig.parts.iter().filter(|part| part.instance.skin.is_some());
        let vertices = skinned
            .flat_map(|part| part.rest().into_iter().zip(&by[part.first..]).map(|(p, by)| (p, p + *by)));
        let nodes = rig.held.iter().zip(rig.worlds.world.iter().zip(world));
        let joints = nodes.filter(|(held, _)| **held > 0.0);
        let origins = joints.map(|(_, (old, new))| (old.w_axis.truncate(), new.w_axis.truncate()));
        let points: Vec<(DVec3, DVec3)> = vertices.chain(origins).collect();
        let sum = points.iter().fold((DVec3::ZERO, DVec3::ZERO), |sum, p| (sum.0 + p.0, sum.1 + p.1));
        let n = points.len() as f64;
        let middle = (sum.0 / n, sum.1 / n);
        let from_middle = || points.iter().map(|p| (p.0 - middle.0, p.1 - middle.1));
        let scale = from_middle().map(|(p, q)| p.dot(q)).sum::<f64>()
            / from_middle().map(|(p, _)| p.length_squared()).sum::<f64>();
        let is_near = |(p, q): (DVec3, DVec3)| q.distance(scale * p) <= MAX_RESIDUAL * rig.diagonal;
        let is_uniform = scale > 0.0 && scale.is_finite() && from_middle().all(is_near);
        is_uniform.then_some(Self { scale, shift: middle.1 - scale * middle.0 })
    }

    /// Translation by which `S N S^-1` differs from `N`. It is applied after the pose of the reference, so it also is the
    /// translation by which `S N S^-1 M0` differs from `N M0`.
    fn shift_of(self, n: DMat4) -> DVec3 {
        let (linear, translation) = (DMat3::from_mat4(n), n.w_axis.truncate());
        (self.scale - 1.0) * translation + (DMat3::IDENTITY - linear) * self.shift
    }
}
