//! How a pulled model looks, in numbers.

use cagework_io::Model;
use cagework_pose::pull::Drag;
use glam::Vec3;
use serde::Serialize;

/// Edges shorter than this, over the model's size, say nothing about stretching.
const SHORTEST: f32 = 1e-9;
/// What is farther than so many times the reach should not move.
const BEYOND: f64 = 1.2;

/// Lengths of edges over those at rest.
#[derive(Debug, Serialize)]
pub(super) struct Stretches {
    pub(super) stretch_max: f64,
    /// The 99th and the first of hundred, between two edges in proportion.
    pub(super) stretch_99: f64,
    pub(super) stretch_1: f64,
}

/// Of a model's edges, each once.
pub(super) fn stretches(mesh: &Model, posed: &[Vec3]) -> Stretches {
    let mut edges: Vec<[u32; 2]> = mesh
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    let size = cagework_core::Bounds::of(&mesh.positions).map_or(0.0, |b| b.diagonal());
    let length = |positions: &[Vec3], [a, b]: [u32; 2]| positions[a as usize].distance(positions[b as usize]);
    let mut all: Vec<f64> = edges
        .into_iter()
        .map(|edge| (length(&mesh.positions, edge), length(posed, edge)))
        .filter(|(rest, _)| *rest > SHORTEST * size)
        .map(|(rest, posed)| f64::from(posed) / f64::from(rest))
        .collect();
    all.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let place = share * all.len().saturating_sub(1) as f64;
        let [low, high] = [place.floor(), place.ceil()].map(|k| all.get(k as usize).copied().unwrap_or(1.0));
        low + (high - low) * place.fract()
    };
    Stretches { stretch_max: at(1.0), stretch_99: at(0.99), stretch_1: at(0.01) }
}

/// Mean movement of what is far beyond the reach, object units; none where nothing is.
pub(super) fn far_mean(drag: &Drag, before: &[Vec3], after: &[Vec3]) -> Option<f64> {
    let limit = BEYOND * drag.reach_length();
    let moves = drag.walks().iter().zip(before.iter().zip(after));
    let far: Vec<f64> = moves
        .filter(|(walk, _)| f64::from(**walk) > limit)
        .map(|(_, (before, after))| f64::from(before.distance(*after)))
        .collect();
    (!far.is_empty()).then(|| far.iter().sum::<f64>() / far.len() as f64)
}
