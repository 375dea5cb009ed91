//! Points of the model that a cage must enclose.

use glam::{DVec3, U64Vec3};

use super::Model;

/// Largest distance between neighbouring samples of a triangle that sleeves are fitted to.
pub(super) const SPACING: f64 = 0.02;

/// Largest distance between neighbouring samples of a triangle in the final check.
pub(super) const FINE_SPACING: f64 = 0.01;

/// Largest number of parts into which the edges of a triangle are divided for sampling.
const MAX_PARTS: usize = 40;

/// Limit on the samples of a model. Figures have up to some hundred thousand; triangles as large as the model that
/// overlap each other have many more, and take memory and time in proportion.
pub(super) const MAX_SAMPLES: usize = 1_000_000;

/// Edge of the cells in which only extreme points are kept.
const CELL: f64 = 0.025;

/// Directions in which points of a cell may be extreme.
const DIRECTIONS: [DVec3; 7] = [
    DVec3::X,
    DVec3::Y,
    DVec3::Z,
    DVec3::new(1.0, 1.0, 1.0),
    DVec3::new(1.0, 1.0, -1.0),
    DVec3::new(1.0, -1.0, 1.0),
    DVec3::new(-1.0, 1.0, 1.0),
];

/// A point of the model's surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) at: DVec3,
    /// Index of the limb whose sleeve encloses the point.
    pub(super) limb: u32,
    pub(super) bone: u32,
}

/// Number of parts into which the edges of a triangle are divided.
fn parts_of(corners: [DVec3; 3], spacing: f64) -> usize {
    let longest = (0..3).map(|k| corners[k].distance(corners[(k + 1) % 3])).fold(0.0, f64::max);
    ((longest / spacing).ceil() as usize).min(MAX_PARTS)
}

/// Number of samples of a model, at most three per triangle more than [`samples`] returns.
pub(super) fn n_samples(model: &Model, spacing: f64) -> usize {
    let of = |triangle: &[u32; 3]| match parts_of(triangle.map(|v| model.at[v as usize]), spacing) {
        0 | 1 => 0,
        n => (n + 1) * (n + 2) / 2,
    };
    model.at.len() + model.triangles.iter().map(of).sum::<usize>()
}

/// Samples vertices and triangles. `spacing`: largest distance between neighbouring samples of a triangle. `limb_of`: limb
/// of each vertex. `[n_vertices]`
pub(super) fn samples(model: &Model, spacing: f64, limb_of: &[u32], bone_of: &[u32]) -> Vec<Sample> {
    let of = |at: DVec3, vertex: usize| Sample { at, limb: limb_of[vertex], bone: bone_of[vertex] };
    let mut samples: Vec<Sample> = model.at.iter().enumerate().map(|(v, &p)| of(p, v)).collect();
    for triangle in &model.triangles {
        let corners = triangle.map(|v| model.at[v as usize]);
        let n = parts_of(corners, spacing);
        for (i, j) in (0..=n).flat_map(|i| (0..=n - i).map(move |j| (i, j))) {
            let parts = [i, j, n - i - j];
            let most = (0..3).max_by_key(|&k| (parts[k], 2 - k)).unwrap_or(0);
            if n > 1 && parts[most] < n {
                let weights = parts.map(|x| x as f64 / n as f64);
                let at = weights[0] * corners[0] + weights[1] * corners[1] + weights[2] * corners[2];
                samples.push(of(at, triangle[most] as usize));
            }
        }
    }
    samples
}

/// Keeps, for each limb, the points of each cell that are extreme in one of 14 directions.
pub(super) fn thinned(samples: &[Sample]) -> Vec<Sample> {
    let low = samples.iter().fold(DVec3::INFINITY, |low, sample| low.min(sample.at));
    let cell = |sample: &Sample| {
        let cell: U64Vec3 = ((sample.at - low) / CELL).as_u64vec3();
        (sample.limb, cell.to_array())
    };
    let mut order: Vec<_> = (0..samples.len()).map(|i| (cell(&samples[i]), i)).collect();
    order.sort_unstable();
    let mut kept = Vec::new();
    for group in order.chunk_by(|a, b| a.0 == b.0) {
        for direction in DIRECTIONS {
            let height = |&&(_, i): &&(_, usize)| direction.dot(samples[i].at);
            let ends = [
                group.iter().min_by(|a, b| height(a).total_cmp(&height(b))),
                group.iter().min_by(|a, b| height(b).total_cmp(&height(a))),
            ];
            kept.extend(ends.into_iter().flatten().map(|&(_, i)| i));
        }
    }
    kept.sort_unstable();
    kept.dedup();
    kept.into_iter().map(|i| samples[i]).collect()
}
