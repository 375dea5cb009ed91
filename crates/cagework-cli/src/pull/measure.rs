//! Measures the quality of a pull: stretch of the edges, and motion of vertices far from the grabs.

use cagework_core::TriMesh;
use cagework_pose::pull::Drag;
use glam::Vec3;
use serde::Serialize;

/// Edges shorter than this fraction of the model's size are ignored, because their stretch is rounding noise.
const MIN_EDGE_RATIO: f64 = 1e-9;
/// Vertices should not move if their distance from the grabs, along the surface, exceeds this multiple of the drag's
/// [`reach_length`](Drag::reach_length).
const FAR_REACH_RATIO: f64 = 1.2;

/// Stretch of edges: posed length over rest length.
#[derive(Debug, Serialize)]
pub(super) struct Stretches {
    pub(super) stretch_max: f64,
    /// 99th percentile, interpolated linearly.
    pub(super) stretch_99: f64,
    /// First percentile, interpolated linearly.
    pub(super) stretch_1: f64,
}

/// Measures the stretch of all edges of a mesh. An edge of several triangles counts once.
pub(super) fn stretches(mesh: &TriMesh, posed: &[Vec3]) -> Stretches {
    let mut edges: Vec<[u32; 2]> = mesh
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    let size = cagework_core::Bounds::around(&mesh.positions).map_or(0.0, |b| f64::from(b.diagonal()));
    let length = |positions: &[Vec3], edge: [u32; 2]| {
        let [a, b] = edge.map(|v| positions[v as usize].as_dvec3());
        a.distance(b)
    };
    let mut all: Vec<f64> = edges
        .into_iter()
        .map(|edge| (length(&mesh.positions, edge), length(posed, edge)))
        .filter(|(rest, _)| *rest > MIN_EDGE_RATIO * size)
        .map(|(rest, posed)| posed / rest)
        .collect();
    all.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let place = share * all.len().saturating_sub(1) as f64;
        let [low, high] = [place.floor(), place.ceil()].map(|k| all.get(k as usize).copied().unwrap_or(1.0));
        low + (high - low) * place.fract()
    };
    Stretches { stretch_max: at(1.0), stretch_99: at(0.99), stretch_1: at(0.01) }
}

/// Computes the mean displacement, object units, of the vertices farther than [`FAR_REACH_RATIO`] times the reach from
/// the grabs along the surface; `None` if no vertex is that far.
pub(super) fn far_mean(drag: &Drag, before: &[Vec3], after: &[Vec3]) -> Option<f64> {
    let limit = FAR_REACH_RATIO * drag.reach_length();
    let moves = drag.distances().iter().zip(before.iter().zip(after));
    let far: Vec<f64> = moves
        .filter(|(walk, _)| f64::from(**walk) > limit)
        .map(|(_, (before, after))| before.as_dvec3().distance(after.as_dvec3()))
        .collect();
    (!far.is_empty()).then(|| far.iter().sum::<f64>() / far.len() as f64)
}
