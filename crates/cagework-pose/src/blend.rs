//! Blends of poses of a cage.

use glam::Vec3;
use thiserror::Error;

/// The pose has the wrong number of vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("the pose has {given} vertices, but the cage has {expected}: it belongs to another cage")]
pub struct VertexCountError {
    /// Number of vertices of the pose.
    pub given: usize,
    /// Number of vertices of the cage.
    pub expected: usize,
}

/// Computes the linear blend `rest + sum_k share_k (pose_k - rest)` of cage poses. Without inner controls, deformation
/// is linear in the cage's vertices, so the deformed model is the same blend of the models deformed by the poses. A
/// missing share counts as 0.
///
/// # Errors
/// [`VertexCountError`] if a pose and the cage differ in their number of vertices.
pub fn blend(rest: &[Vec3], poses: &[Vec<Vec3>], shares: &[f32]) -> Result<Vec<Vec3>, VertexCountError> {
    let mut mixed = rest.to_vec();
    for (k, pose) in poses.iter().enumerate() {
        if pose.len() != rest.len() {
            return Err(VertexCountError { given: pose.len(), expected: rest.len() });
        }
        let share = shares.get(k).copied().unwrap_or(0.0);
        for ((mixed, &pose), &rest) in mixed.iter_mut().zip(pose).zip(rest) {
            *mixed += share * (pose - rest);
        }
    }
    Ok(mixed)
}

/// Changes the shares of a blend from `before` to `shares`: `from + sum_k (share_k - before_k) (pose_k - rest)`. Edits
/// made after the blend are kept. `[n_cage]`
///
/// # Errors
/// [`VertexCountError`] if a pose and the cage differ in their number of vertices.
pub fn reblend(
    rest: &[Vec3],
    poses: &[Vec<Vec3>],
    from: &[Vec3],
    before: &[f32],
    shares: &[f32],
) -> Result<Vec<Vec3>, VertexCountError> {
    let more = |(k, share): (usize, &f32)| share - before.get(k).copied().unwrap_or(0.0);
    let change: Vec<f32> = shares.iter().enumerate().map(more).collect();
    let moved = blend(rest, poses, &change)?;
    Ok(from.iter().zip(&moved).zip(rest).map(|((&from, &moved), &rest)| from + (moved - rest)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_add_up_from_rest() {
        let rest = [Vec3::ONE];
        let poses = [vec![Vec3::new(3.0, 1.0, 1.0)], vec![Vec3::new(1.0, 5.0, 1.0)]];
        let mixed = blend(&rest, &poses, &[0.5, 1.0]);
        assert_eq!(mixed, Ok(vec![Vec3::new(2.0, 5.0, 1.0)]));
        assert_eq!(blend(&rest, &poses, &[]), Ok(rest.to_vec()));
        assert_eq!(
            blend(&rest, &[vec![Vec3::ZERO; 2]], &[1.0]),
            Err(VertexCountError { given: 2, expected: 1 })
        );
    }

    #[test]
    fn reblending_keeps_manual_edits() {
        let rest = [Vec3::ONE];
        let poses = [vec![Vec3::new(3.0, 1.0, 1.0)], vec![Vec3::new(1.0, 5.0, 1.0)]];
        let by_hand = Vec3::new(0.0, 0.0, 0.25);
        let from = [blend(&rest, &poses, &[0.5, 1.0]).unwrap()[0] + by_hand];
        let now = reblend(&rest, &poses, &from, &[0.5, 1.0], &[0.25, 0.5]);
        assert_eq!(now, Ok(vec![blend(&rest, &poses, &[0.25, 0.5]).unwrap()[0] + by_hand]));
        assert_eq!(reblend(&rest, &poses, &from, &[], &[0.0, 0.0]), Ok(from.to_vec()));
    }
}
