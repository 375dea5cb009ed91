//! Share of each vertex in a gesture: the selection, its surroundings by proportional editing, and mirror images.

use glam::Vec3;

use cagework_pose::symmetry::{Symmetry, reflect};

use super::selection::Selection;

/// Relative difference below which the shares of a pair count as equal. It covers poses and cages that are not exactly
/// symmetric, in which rounding would otherwise decide which vertex of the pair leads.
const SHARE_TOLERANCE: f32 = 0.01;

/// Options for the vertices that move together with the selection.
#[derive(Clone, Copy, Debug, Default)]
pub struct SharedPull<'a> {
    /// Radius of proportional editing, object units. Vertices nearer than this to a selected vertex make a share of its
    /// movement; 0 turns proportional editing off.
    pub radius: f32,
    /// Mirror images of the vertices; `None` if movements are not mirrored.
    pub symmetry: Option<&'a Symmetry>,
}

/// Share of a gesture's movement that each vertex makes, 0 to 1, directly or as a mirror image.
#[derive(Clone, Debug, PartialEq)]
pub struct Pull {
    share: Vec<f32>,
    motions: Vec<Motion>,
}

/// The movement that a vertex makes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Motion {
    /// Its own.
    Own,
    /// The mirror image of the movement of this vertex.
    ImageOf(u32),
    /// The mean of its own movement and the mirror image of the movement of this vertex, its partner. A vertex on the
    /// mirror plane is its own partner, so it moves within the plane.
    MeanWith(u32),
}

impl Pull {
    /// Computes the shares for a selection in the pose `positions`.
    ///
    /// With symmetry, if both vertices of a pair are selected, the side of the vertex that was selected last leads: the
    /// other side makes its mirrored movement. `rest`, the cage at rest, determines on which side of the mirror plane a
    /// vertex is.
    #[must_use]
    pub fn new(selection: &Selection, positions: &[Vec3], rest: &[Vec3], shared: SharedPull<'_>) -> Self {
        let n = positions.len();
        let mut leads: Vec<bool> = (0..n as u32).map(|i| selection.contains(i)).collect();
        if let Some(symmetry) = shared.symmetry {
            let side = |i: u32| rest[i as usize].x - symmetry.plane() < 0.0;
            let leading = selection.last().is_some_and(side);
            for i in 0..n as u32 {
                let twice = symmetry.partner(i).is_some_and(|p| p != i && selection.contains(p));
                if selection.contains(i) && twice && side(i) != leading {
                    leads[i as usize] = false;
                }
            }
        }
        let share: Vec<f32> = (0..n).map(|i| share(i, &leads, positions, shared.radius)).collect();
        let mut pull = Self { motions: vec![Motion::Own; n], share };
        if let Some(symmetry) = shared.symmetry {
            let all = pull.share.clone();
            for i in 0..n {
                let Some(p) = symmetry.partner(i as u32) else { continue };
                let (own, other) = (all[i], all[p as usize]);
                if (own - other).abs() <= SHARE_TOLERANCE * own.max(other) {
                    pull.share[i] = 0.5 * (own + other);
                    pull.motions[i] = Motion::MeanWith(p);
                } else if other > own {
                    // The vertex with the larger share leads, the other one mirrors it.
                    pull.share[i] = other;
                    pull.motions[i] = Motion::ImageOf(p);
                }
            }
        }
        pull
    }

    /// Whether no vertex moves.
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.share.iter().all(|&s| s == 0.0)
    }

    /// Positions after the gesture. `moved(position, share)` is the position to which a vertex with this share moves;
    /// mirror images make the reflected movement of their leading vertex. If neither vertex of a pair leads, both make
    /// the mean of their movements.
    #[must_use]
    pub fn apply(&self, start: &[Vec3], moved: &dyn Fn(Vec3, f32) -> Vec3) -> Vec<Vec3> {
        (0..start.len())
            .map(|i| {
                let share = self.share[i];
                if share == 0.0 {
                    return start[i];
                }
                let own = |i: usize| moved(start[i], share) - start[i];
                let movement = match self.motions[i] {
                    Motion::Own => own(i),
                    Motion::ImageOf(leader) => reflect(own(leader as usize)),
                    Motion::MeanWith(p) => 0.5 * (own(i) + reflect(own(p as usize))),
                };
                start[i] + movement
            })
            .collect()
    }
}

/// Smoothstep from 1 at a leading vertex to 0 at distance `radius` from the nearest leading vertex.
fn share(i: usize, leads: &[bool], positions: &[Vec3], radius: f32) -> f32 {
    if leads[i] {
        return 1.0;
    }
    if radius <= 0.0 {
        return 0.0;
    }
    let leaders = positions.iter().zip(leads).filter(|(_, leads)| **leads);
    let nearest = leaders.map(|(p, _)| p.distance(positions[i])).fold(f32::INFINITY, f32::min);
    let near = (1.0 - nearest / radius).clamp(0.0, 1.0);
    near * near * (3.0 - 2.0 * near)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::SelectMode;
    use crate::edit::tests::cuboid;

    fn selection(n: usize, vertices: &[u32]) -> Selection {
        let mut selection = Selection::new(n);
        selection.change(vertices, SelectMode::Replace);
        selection
    }

    /// Translates by `(1, 2, 3)` times the share.
    fn shifted(p: Vec3, share: f32) -> Vec3 {
        p + share * Vec3::new(1.0, 2.0, 3.0)
    }

    #[test]
    fn share_falls_smoothly_with_the_distance() {
        let line: Vec<Vec3> = (0..5).map(|k| k as f32 * Vec3::X).collect();
        let pull = Pull::new(&selection(5, &[0]), &line, &line, SharedPull { radius: 4.0, symmetry: None });
        // The shares are the values of smoothstep at 1, 3/4, 1/2, 1/4 and 0.
        assert_eq!(pull.share, [1.0, 0.84375, 0.5, 0.15625, 0.0]);
        let alone = Pull::new(&selection(5, &[0]), &line, &line, SharedPull::default());
        assert_eq!(alone.share, [1.0, 0.0, 0.0, 0.0, 0.0]);
        assert!(Pull::new(&selection(5, &[]), &line, &line, SharedPull::default()).is_none());
    }

    #[test]
    fn mirror_image_moves_symmetrically() {
        let rest = cuboid(Vec3::NEG_ONE, Vec3::ONE).positions;
        let symmetry = Symmetry::new(&rest);
        let shared = SharedPull { radius: 0.0, symmetry: Some(&symmetry) };
        // Either vertex 1 of a pair is selected, or both with vertex 1 last: vertex 1 leads, and vertex 0 mirrors it.
        for vertices in [&[1][..], &[0, 1]] {
            let moved = Pull::new(&selection(8, vertices), &rest, &rest, shared).apply(&rest, &shifted);
            assert_eq!(moved[1], rest[1] + Vec3::new(1.0, 2.0, 3.0));
            assert_eq!(moved[0], rest[0] + Vec3::new(-1.0, 2.0, 3.0));
            assert_eq!(moved[2..], rest[2..]);
        }
    }

    #[test]
    fn vertex_on_the_plane_stays_on_it() {
        let rest = [Vec3::NEG_X, Vec3::X, Vec3::Y];
        let symmetry = Symmetry::new(&rest);
        let shared = SharedPull { radius: 0.0, symmetry: Some(&symmetry) };
        let moved = Pull::new(&selection(3, &[2]), &rest, &rest, shared).apply(&rest, &shifted);
        assert_eq!(moved[2], Vec3::new(0.0, 3.0, 3.0));
    }

    #[test]
    fn symmetric_pull_of_surroundings_is_symmetric() {
        let rest = cuboid(Vec3::NEG_ONE, Vec3::ONE).positions;
        let symmetry = Symmetry::new(&rest);
        let shared = SharedPull { radius: 3.0, symmetry: Some(&symmetry) };
        let moved = Pull::new(&selection(8, &[1]), &rest, &rest, shared).apply(&rest, &shifted);
        for i in 0..8 {
            assert!(moved[i ^ 1].abs_diff_eq(reflect(moved[i]), 1e-6), "{i}");
        }
        assert_ne!(moved[3], rest[3], "near enough to follow");
    }

    /// Vertex 2 is on the mirror plane, and the pair at its sides has the share 1/2 of smoothstep at half the radius.
    /// The mean of the movement and its mirror image has no x.
    #[test]
    fn surroundings_of_a_vertex_on_the_plane_move_symmetrically() {
        for off in [0.0, 1e-3] {
            let rest = [Vec3::NEG_X, Vec3::new(1.0 + off, 0.0, 0.0), Vec3::ZERO];
            let symmetry = Symmetry::new(&rest);
            assert_eq!(symmetry.partner(0), Some(1));
            let shared = SharedPull { radius: 2.0, symmetry: Some(&symmetry) };
            let moved = Pull::new(&selection(3, &[2]), &rest, &rest, shared).apply(&rest, &shifted);
            let half = Vec3::new(0.0, 1.0, 1.5);
            assert!(moved[0].abs_diff_eq(rest[0] + half, 2.0 * off + 1e-6), "{moved:?}");
            assert!((moved[1] - rest[1]).abs_diff_eq(reflect(moved[0] - rest[0]), 1e-6), "{moved:?}");
            assert_eq!(moved[2], rest[2] + 2.0 * half);
        }
    }
}
