//! Report about the reshaping of a document.

use cagework_core::words::{counted, decimals, three_digits};
use serde::Serialize;

use super::ground::Ground;
use super::lattice::MAX_ENDS;
use crate::shown::{MAX_NAME_CHARS, shown_start};

/// Counts and measures of reshaping a document.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ReshapeReport {
    /// Number of nodes that follow the cage: joints, animated nodes, nodes with meshes, and their descendants.
    pub joints: usize,
    /// Number of nodes among `joints` whose transform has changed.
    pub joints_moved: usize,
    /// Number of joints outside the cage that carry vertices. They move like vertices outside the cage.
    pub joints_outside: usize,
    /// Their names.
    #[serde(skip)]
    pub names_outside: Vec<String>,
    /// Number of joints outside the cage that carry no vertices. They follow their parent.
    pub joints_following_parent: usize,
    /// Number of ends of morph targets. An end is a vertex with one target at weight 0 or 1.
    pub morph_ends: usize,
    /// Number of ends of morph targets outside the cage. They move like vertices outside the cage.
    pub morph_ends_outside: usize,
    /// Number of nodes of the lattice that is bound instead of a large number of ends; 0 without a lattice.
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
    /// Distance by which the model was lifted so that its lowest point keeps its height, object units.
    pub lift: f64,
    /// Additional lift of each clip, object units; empty unless the model is kept on its ground.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub clip_lifts: Vec<f64>,
    /// Lowest points, if the model is kept on its ground.
    #[serde(skip)]
    pub ground: Option<Ground>,
    /// Number of legs, and of their contacts with the ground in all clips; `None` unless planted feet are locked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feet: Option<[usize; 2]>,
    /// Mean distance that a foot slides during a contact, object units: without and with the correction.
    pub slide: [f64; 2],
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
                "{} outside the cage ({}): near it they follow it, farther away they stay",
                counted(
                    *joints_outside,
                    "joint or node with vertices is",
                    "joints or nodes with vertices are"
                ),
                shown_start(&self.names_outside.join(", "), MAX_NAME_CHARS)
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
        if self.lift != 0.0 {
            let moved = if self.lift > 0.0 { "lifted" } else { "lowered" };
            notice(
                1,
                format!("{moved} by {} to stand at the same height", three_digits(self.lift.abs() as f32)),
            );
        }
        let n = self.clip_lifts.iter().filter(|lift| **lift != 0.0).count();
        let most = three_digits(self.clip_lifts.iter().map(|lift| lift.abs()).fold(0.0, f64::max) as f32);
        let clips = counted(self.clip_lifts.len(), "clip", "clips");
        notice(
            n,
            format!(
                "lifted or lowered {n} of {clips} by up to {most}, so that their lowest points keep their heights"
            ),
        );
        if let Some([legs, contacts]) = self.feet {
            let [before, after] = self.slide.map(|slide| decimals(slide, 4));
            notice(
                1,
                match (legs, contacts) {
                    (0, _) => {
                        "found no legs: a leg is a joint named foot, ankle, paw or hoof below two other joints".into()
                    }
                    (_, 0) => format!(
                        "found {}, but no contact with the ground in the clips",
                        counted(legs, "leg", "legs")
                    ),
                    _ => format!(
                        "held feet in {} of {}: a foot slides by {after} instead of {before}",
                        counted(contacts, "contact", "contacts"),
                        counted(legs, "leg", "legs")
                    ),
                },
            );
        }
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

#[cfg(test)]
mod tests {
    use super::ReshapeReport;

    #[test]
    fn small_lifts_have_three_significant_digits() {
        let report =
            ReshapeReport { lift: -0.001_234_5, clip_lifts: vec![0.0, -0.000_02], ..Default::default() };
        let all = report.notices().join("\n");
        assert!(all.contains("lowered by 0.00123 to stand"), "{all}");
        assert!(all.contains("lifted or lowered 1 of 2 clips by up to 0.0000200,"), "{all}");
    }
}
