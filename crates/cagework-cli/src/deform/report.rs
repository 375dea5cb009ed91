//! Output of `cagework deform`.

use cagework_core::words::{counted, decimals, grouped};
use cagework_io::{ReshapeReport, shown};
use cagework_job::Written;
use serde::Serialize;

use crate::controls::inner_controls_text;
use crate::field::LatticeSummary;

/// Output of `--json`.
#[derive(Debug, Serialize)]
pub(super) struct DeformSummary {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) output: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) displacements: Option<String>,
    #[serde(flatten)]
    pub(super) subject: Subject,
    /// Changes to skeleton, morph targets and clips; `None` if the file keeps none.
    #[serde(flatten)]
    pub(super) rig: Option<ReshapeReport>,
    /// Time to compute all poses, without reading and writing files, ms.
    pub(super) deform_ms: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) lattice: Option<LatticeSummary>,
    pub(super) notices: Vec<String>,
}

/// What was deformed.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub(super) enum Subject {
    /// A mesh, by its weights.
    Mesh {
        vertices: usize,
        cage_vertices: usize,
        inner_controls: usize,
        outside_vertices: usize,
        /// Number of vertices outside the cage that do not follow it at all.
        staying_vertices: usize,
        poses: Vec<String>,
        /// Whether the poses are expressions of a VRM.
        #[serde(skip)]
        expressions: bool,
        /// Length of the animation; `None` without one.
        #[serde(skip_serializing_if = "Option::is_none")]
        animation_seconds: Option<f32>,
    },
    /// Splats or points, by the deformation of space.
    Capture {
        points: usize,
        is_splats: bool,
        /// Number of points outside the cage. Near the cage they move with it; with growing distance they move less.
        outside_points: usize,
        /// Number of splats that bend too much for an ellipsoid.
        inexact_splats: usize,
    },
    /// The frames of a clip (`--dynamic`), by the deformation of space.
    Clip { clip: String, frames: usize, seconds: f32, vertices: usize },
}

impl Subject {
    /// Sets the names of the poses of a mesh and the length of their animation.
    pub(super) fn set_poses(&mut self, names: Vec<String>, seconds: Option<f32>) {
        if let Self::Mesh { poses, animation_seconds, .. } = self {
            (*poses, *animation_seconds) = (names, seconds);
        }
    }

    /// Sets the counts that are known after writing.
    pub(super) fn count(&mut self, written: &Written) {
        match self {
            Self::Mesh { .. } => {}
            Self::Capture { inexact_splats, .. } => *inexact_splats = written.inexact_splats,
            Self::Clip { frames, .. } => *frames = written.frames,
        }
    }

    /// Says how many splats or points are outside the cage; `None` if all are inside, and for other models.
    pub(super) fn outside_in_words(&self) -> Option<String> {
        let Self::Capture { points, is_splats, outside_points: outside @ 1.., .. } = self else {
            return None;
        };
        Some(format!(
            "{} of {} are outside the cage: near it they move with it, farther out they stay.",
            grouped(*outside),
            splats_or_points(*is_splats, *points)
        ))
    }
}

fn splats_or_points(is_splats: bool, n: usize) -> String {
    if is_splats { counted(n, "splat", "splats") } else { counted(n, "point", "points") }
}

/// Formats the summary as text.
pub(super) fn text(summary: &DeformSummary) -> String {
    let ms = summary.deform_ms;
    let output = summary.output.as_ref().or(summary.displacements.as_ref());
    let output = output.map_or_else(String::new, |output| shown(output));
    let mut out = match &summary.subject {
        Subject::Mesh {
            vertices,
            cage_vertices,
            inner_controls,
            poses,
            expressions,
            animation_seconds,
            ..
        } => {
            let inner = inner_controls_text(*inner_controls);
            let poses = poses_in_words(poses, *expressions, *animation_seconds);
            format!(
                "deformed {vertices} vertices by {cage_vertices} cage vertices{inner} in {ms:.1} ms\nwrote {output}: {poses}\n"
            )
        }
        Subject::Capture { points, is_splats, .. } => {
            format!("deformed {} in {ms:.0} ms\nwrote {output}\n", splats_or_points(*is_splats, *points))
        }
        Subject::Clip { clip, frames, seconds, .. } => format!(
            "bent {frames} frames of clip {} ({} s)\nwrote {output}\n",
            shown(clip),
            decimals(*seconds, 2),
        ),
    };
    if let (Some(_), Some(displacements)) = (&summary.output, &summary.displacements) {
        out += &format!("wrote {}\n", shown(displacements));
    }
    out += &summary.lattice.as_ref().map_or_else(String::new, LatticeSummary::text);
    for notice in &summary.notices {
        out += &format!("note: {notice}\n");
    }
    out
}

fn poses_in_words(names: &[String], expressions: bool, seconds: Option<f32>) -> String {
    if let ([only], false) = (names, expressions) {
        return format!("pose {}", shown(only));
    }
    let kind = if expressions { "VRM expressions" } else { "morph targets" };
    let clip = seconds.map_or_else(String::new, |s| format!(" and an animation of {s} s"));
    format!("{} as {kind} ({}){clip}", counted(names.len(), "pose", "poses"), shown(&names.join(", ")))
}
