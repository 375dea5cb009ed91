//! Report about the reshaping of a document.

use cagework_core::words::counted;
use serde::Serialize;

use super::lattice::MAX_ENDS;

/// Counts and measures of reshaping a document.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ReshapeReport {
    /// Nodes that follow the cage: joints, animated nodes, nodes with meshes, and their descendants.
    pub joints: usize,
    /// Nodes among `joints` with a changed transform.
    pub joints_moved: usize,
    /// Joints outside the cage that carry vertices. They move like vertices outside the cage.
    pub joints_outside: usize,
    /// Joints outside the cage that have no vertices; they follow their parent.
    pub joints_loose: usize,
    /// Ends of morph targets: vertices with one target at weight 0 or 1.
    pub morph_ends: usize,
    /// Ends of morph targets outside the cage. They move like vertices outside the cage.
    pub morph_ends_outside: usize,
    /// Nodes of the lattice that replaces a large number of ends; otherwise 0.
    pub lattice_points: usize,
    /// Cell size of the lattice, as a fraction of the model's diagonal.
    pub lattice_cell: f64,
    /// Number of animation tracks that have changed.
    pub tracks: usize,
    /// Number of unreadable animation tracks, which stay unchanged.
    pub tracks_unread: usize,
    /// Largest condition number of a skinning matrix.
    pub max_condition: f64,
    /// Number of vertices whose skinning matrix is singular; they follow their neighbours.
    pub singular_vertices: usize,
}

impl ReshapeReport {
    /// Notices for the user, one sentence each.
    #[must_use]
    pub fn notices(&self) -> Vec<String> {
        let Self { joints, joints_moved, joints_outside, morph_ends, morph_ends_outside, tracks, .. } = self;
        let mut notices = Vec::new();
        let mut notice = |n: usize, text: String| notices.extend((n > 0).then_some(text));
        notice(
            *joints,
            format!(
                "moved {joints_moved} of {} and adapted {}",
                counted(*joints, "joint or other node", "joints and other nodes"),
                counted(*tracks, "animation track", "animation tracks")
            ),
        );
        notice(
            *joints_outside,
            format!(
                "{} outside the cage: near it they follow it, farther away they stay",
                counted(
                    *joints_outside,
                    "joint or node with vertices is",
                    "joints or nodes with vertices are"
                )
            ),
        );
        notice(
            *morph_ends_outside,
            format!(
                "{morph_ends_outside} of {} leave the cage: near it they follow it, farther away they stay; generate a cage that \
                 encloses them",
                counted(*morph_ends, "vertex position in morph targets", "vertex positions in morph targets")
            ),
        );
        let (n, cell) = (self.lattice_points, 100.0 * self.lattice_cell);
        notice(
            n,
            format!(
                "the morph targets have {morph_ends} vertex positions, more than the limit of {MAX_ENDS} for individual weights: \
                 they are interpolated between {n} points at a distance of {cell:.1} % of the model's size"
            ),
        );
        let n = self.singular_vertices;
        notice(
            n,
            format!(
                "{} collapsed by the skin: they follow their neighbours",
                counted(n, "vertex is", "vertices are")
            ),
        );
        let n = self.tracks_unread;
        notice(
            n,
            format!(
                "{} and stay unchanged",
                counted(n, "animation track cannot be read", "animation tracks cannot be read")
            ),
        );
        notices
    }
}
