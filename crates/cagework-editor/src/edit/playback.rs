//! Blending of poses, and their playback as an animation.

use glam::Vec3;
use thiserror::Error;

/// The pose has the wrong number of vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("the pose has {given} vertices, but the cage has {expected}: it belongs to another cage")]
pub struct PoseError {
    /// Vertices of the pose.
    pub given: usize,
    /// Vertices of the cage.
    pub expected: usize,
}

/// Linear blend `rest + sum_k share_k (pose_k - rest)`; exact for the model, because deformation is linear in the cage.
/// A missing share counts as 0.
///
/// # Errors
/// [`PoseError`] if a pose and the cage differ in their number of vertices.
pub fn blend(rest: &[Vec3], poses: &[Vec<Vec3>], shares: &[f32]) -> Result<Vec<Vec3>, PoseError> {
    let mut mixed = rest.to_vec();
    for (k, pose) in poses.iter().enumerate() {
        if pose.len() != rest.len() {
            return Err(PoseError { given: pose.len(), expected: rest.len() });
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
/// [`PoseError`] if a pose and the cage differ in their number of vertices.
pub fn reblend(
    rest: &[Vec3],
    poses: &[Vec<Vec3>],
    from: &[Vec3],
    before: &[f32],
    shares: &[f32],
) -> Result<Vec<Vec3>, PoseError> {
    let more = |(k, share): (usize, &f32)| share - before.get(k).copied().unwrap_or(0.0);
    let change: Vec<f32> = shares.iter().enumerate().map(more).collect();
    let moved = blend(rest, poses, &change)?;
    Ok(from.iter().zip(&moved).zip(rest).map(|((&from, &moved), &rest)| from + (moved - rest)).collect())
}

/// Positions at a time of the looping animation from rest through all poses back to rest, one second each. Exports
/// contain the same animation. `[n_cage]`
///
/// # Errors
/// [`PoseError`] if a pose and the cage differ in their number of vertices.
pub fn moment(rest: &[Vec3], poses: &[Vec<Vec3>], seconds: f32) -> Result<Vec<Vec3>, PoseError> {
    let stops = poses.len() + 1;
    let time = seconds.rem_euclid(stops as f32);
    let (from, part) = ((time as usize).min(stops - 1), time.fract());
    let mut shares = vec![0.0; poses.len()];
    // Stop 0 is rest, stop k is pose k - 1.
    if from > 0 {
        shares[from - 1] = 1.0 - part;
    }
    if from < poses.len() {
        shares[from] = part;
    }
    blend(rest, poses, &shares)
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
        assert_eq!(blend(&rest, &[vec![Vec3::ZERO; 2]], &[1.0]), Err(PoseError { given: 2, expected: 1 }));
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

    #[test]
    fn animation_passes_every_pose_and_returns_to_rest() {
        let rest = [Vec3::ZERO];
        let poses = [vec![Vec3::X], vec![Vec3::Y]];
        let at = |seconds| moment(&rest, &poses, seconds).unwrap()[0];
        for (seconds, expected) in [
            (0.0, Vec3::ZERO),
            (0.25, 0.25 * Vec3::X),
            (1.0, Vec3::X),
            (1.5, 0.5 * Vec3::X + 0.5 * Vec3::Y),
            (2.0, Vec3::Y),
            (2.75, 0.25 * Vec3::Y),
            (3.0, Vec3::ZERO),
            (7.0, Vec3::X),
        ] {
            assert!(at(seconds).abs_diff_eq(expected, 1e-6), "at {seconds} s");
        }
        assert_eq!(moment(&rest, &[], 0.7), Ok(rest.to_vec()));
    }
}
