//! Poses of a cage that is replaced by another one around the same model.

use cagework_core::bind::fineness::ROUGH_GRID;
use cagework_core::deform::deform_bound;
use cagework_core::progress::NoProgress;
use cagework_core::{BindError, BindOptions, ControlSet, Controls, bind};
use glam::Vec3;

/// Number of model vertices that are bound along with the new cage's controls. The controls may all be outside the old
/// cage, and a bind without a point inside the cage fails.
const MODEL_SAMPLES: usize = 256;

/// Transfers poses from the cage `old` to one with the controls `new`, `[n_new]`: binds the new controls to the old cage
/// and deforms them by each pose. `poses`: `[n_poses, n_old]`; returns `[n_poses, n_new]`.
///
/// The reverse, binding the old vertices to the new cage, would need a linear solve, and would bend the new cage where the
/// old one extends beyond it.
///
/// # Errors
/// If the bind fails.
pub fn carry_poses(
    model: &[Vec3],
    new: &[Vec3],
    old: &ControlSet,
    poses: &[Vec3],
) -> Result<Vec<Vec3>, BindError> {
    let some = &model[..model.len().min(MODEL_SAMPLES)];
    let options = BindOptions { grid: ROUGH_GRID, ..BindOptions::default() };
    let bound = bind(&[new, some].concat(), old, &options, &NoProgress)?;
    let carried = poses.chunks_exact(Controls::from(old).n_controls()).flat_map(|pose| {
        let mut moved = deform_bound(&bound.weights, &bound.frames, pose);
        moved.truncate(new.len());
        moved
    });
    Ok(carried.collect())
}

#[cfg(test)]
mod tests {
    use cagework_core::Cage;

    use super::*;
    use crate::edit::tests::cuboid;

    /// Tolerance of the solver, 1e-5, for positions of size 1, and rounding.
    const TOLERANCE: f32 = 1e-4;

    fn carried(new: &[Vec3], by: Vec3) -> Vec<Vec3> {
        let old = Cage::new(&cuboid(Vec3::ZERO, Vec3::ONE)).unwrap();
        let poses: Vec<Vec3> = old.positions().iter().map(|p| *p + by).collect();
        carry_poses(&[Vec3::splat(0.5)], new, &ControlSet::plain(&old), &poses).unwrap()
    }

    #[test]
    fn a_cage_inside_the_old_one_moves_with_it() {
        let new = cuboid(Vec3::splat(0.2), Vec3::splat(0.8)).positions;
        for (to, from) in carried(&new, Vec3::Y).iter().zip(&new) {
            assert!(to.distance(*from + Vec3::Y) < TOLERANCE, "{to} {from}");
        }
    }

    /// A bind of its controls alone would fail, because none of them is inside.
    #[test]
    fn a_cage_around_the_old_one_keeps_its_rest_pose() {
        let new = cuboid(Vec3::splat(-0.1), Vec3::splat(1.1)).positions;
        for (to, from) in carried(&new, Vec3::ZERO).iter().zip(&new) {
            assert!(to.distance(*from) < TOLERANCE, "{to} {from}");
        }
    }
}
