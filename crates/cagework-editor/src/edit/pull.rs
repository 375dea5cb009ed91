//! Share of each vertex in a gesture: the selection, its surroundings by proportional editing, and mirror images.

use glam::Vec3;

use cagework_pose::symmetry::{Symmetry, reflect};

use super::selection::Selection;

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
    /// For each vertex, the vertex whose mirrored movement it makes, if any.
    mirrors: Vec<Option<u32>>,
    /// Whether each vertex lies on the mirror plane. Such vertices move only within the plane.
    on_plane: Vec<bool>,
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
        let mut pull = Self { mirrors: vec![None; n], on_plane: vec![false; n], share };
        if let Some(symmetry) = shared.symmetry {
            let own = pull.share.clone();
            for i in 0..n {
                match symmetry.partner(i as u32) {
                    Some(p) if p as usize == i => pull.on_plane[i] = true,
                    // The vertex with the larger share leads, the other one mirrors it.
                    Some(p) if own[p as usize] > own[i] => {
                        pull.share[i] = own[p as usize];
                        pull.mirrors[i] = Some(p);
                    }
                    _ => {}
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
    /// mirror images make the reflected movement of their leading vertex.
    #[must_use]
    pub fn apply(&self, start: &[Vec3], moved: &dyn Fn(Vec3, f32) -> Vec3) -> Vec<Vec3> {
        (0..start.len())
            .map(|i| {
                let share = self.share[i];
                if share == 0.0 {
                    return start[i];
                }
                let movement = match self.mirrors[i] {
                    Some(leader) => {
                        let leader = start[leader as usize];
                        reflect(moved(leader, share) - leader)
                    }
                    None => moved(start[i], share) - start[i],
                };
                let within = if self.on_plane[i] { Vec3::new(0.0, 1.0, 1.0) } else { Vec3::ONE };
                start[i] + movement * within
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
}
