//! Moves a cage by its skeleton: each vertex of the cage follows maps of the bones, weighted.
//!
//! A cage vertex takes its weights from the skin of the nearest vertices of the model. The pose of a vertex `c` is the
//! sum over the bones `b` of `w_b(c) map_b(c)`.

use cagework_core::rig::Rig;
use glam::{DAffine3, DVec3, Vec3};

use crate::humanoid::{Bone, ENDS, Humanoid, N_BONES};

/// Number of vertices of the model from which a cage vertex takes its weights.
const NEAREST: usize = 16;
/// Distance at which the share of a vertex falls to 1/e, in distances of the nearest one.
const SPREAD: f64 = 1.5;
/// Share of the mean of its ring in the weights of a vertex on a limb.
const RING_SHARE: f64 = 0.4;
/// Weights of hands, feet and head above this make a vertex follow that bone more closely.
const END_FROM: f64 = 0.05;
/// Weights of hands, feet and head above this make a vertex follow that bone only.
const END_FULL: f64 = 0.5;
/// Vertices of the model whose weights sum to at most this are ignored.
const LEAST: f64 = 0.5;
/// Limit on the distances that are computed. With more vertices, every second, third and so on is taken.
const MAX_DISTANCES: usize = 1 << 28;

/// Weights of the bones at each vertex of a cage; each row sums to 1. `[n_cage][N_BONES]`
#[derive(Clone, Debug, PartialEq)]
pub struct BoneWeights(Vec<[f64; N_BONES]>);

/// Weight of each bone at each vertex of the model. `[n_vertices][N_BONES]`
pub(crate) fn skin_of_bones(rig: &Rig, humanoid: &Humanoid) -> Vec<[f64; N_BONES]> {
    let bones = humanoid.bones_of_joints(rig);
    let row = |range: &[u32]| {
        let mut row = [0.0; N_BONES];
        for &(joint, weight) in rig.influences.get(range[0] as usize..range[1] as usize).unwrap_or_default() {
            if let Some(Some(bone)) = bones.get(joint as usize) {
                row[*bone as usize] += f64::from(weight);
            }
        }
        row
    };
    rig.first.windows(2).map(row).collect()
}

impl BoneWeights {
    /// Takes the weights of a cage from the skin of a model.
    ///
    /// `cage`: vertices of the cage at rest, object units, `[n_cage]`. `rings`: loops of cage vertices around limbs, such
    /// as those of generated cages; may be empty. `positions`: vertices of the model at the rest of the rig, object
    /// units. Vertices of the cage without a skinned vertex follow the hips.
    ///
    /// Hands, feet and head keep their shape: where one of them has more than 0.05 of the weight, its weight grows, to 1
    /// from 0.5 on.
    #[must_use]
    pub fn of_skin(
        cage: &[Vec3],
        rings: &[Vec<u32>],
        positions: &[Vec3],
        rig: &Rig,
        humanoid: &Humanoid,
    ) -> Self {
        Self::of_rows(cage, rings, positions, &skin_of_bones(rig, humanoid))
    }

    /// Takes the weights of a cage from weights of the bones at points. `skin`: `[n_points][N_BONES]`
    pub(crate) fn of_rows(
        cage: &[Vec3],
        rings: &[Vec<u32>],
        positions: &[Vec3],
        skin: &[[f64; N_BONES]],
    ) -> Self {
        let total = |row: &[f64; N_BONES]| row.iter().sum::<f64>();
        let skinned: Vec<usize> =
            (0..skin.len().min(positions.len())).filter(|&v| total(&skin[v]) > LEAST).collect();
        let step = (cage.len().saturating_mul(skinned.len()) / MAX_DISTANCES).max(1);
        let skinned: Vec<usize> = skinned.into_iter().step_by(step).collect();
        let mut weights: Vec<[f64; N_BONES]> = cage
            .iter()
            .map(|at| {
                let near = nearest(*at, positions, &skinned);
                let spread = near.first().map_or(1.0, |(first, _)| (SPREAD * first.sqrt()).max(1e-9));
                let mut row = [0.0; N_BONES];
                for (squared, vertex) in near {
                    let share = (-squared / (spread * spread)).exp();
                    row.iter_mut().zip(&skin[vertex]).for_each(|(sum, w)| *sum += share * w);
                }
                normalized(row)
            })
            .collect();
        for ring in rings {
            let on_ring: Vec<usize> =
                ring.iter().map(|&v| v as usize).filter(|&v| v < weights.len()).collect();
            let mut mean = [0.0; N_BONES];
            for &v in &on_ring {
                mean.iter_mut().zip(weights[v]).for_each(|(sum, w)| *sum += w / on_ring.len() as f64);
            }
            for &v in &on_ring {
                weights[v].iter_mut().zip(mean).for_each(|(w, mean)| *w += RING_SHARE * (mean - *w));
            }
        }
        weights.iter_mut().for_each(|row| *row = with_ends(*row));
        Self(weights)
    }

    /// Weight of a bone at each vertex of the cage. `[n_cage]`
    pub fn of_bone(&self, bone: Bone) -> impl Iterator<Item = f64> {
        self.0.iter().map(move |row| row[bone as usize])
    }

    /// Moves the vertices of a cage by one map per bone. `cage`: object units, `[n_cage]`; `maps`: indexed by [`Bone`].
    #[must_use]
    pub fn drive(&self, cage: &[Vec3], maps: &[Map]) -> Vec<DVec3> {
        let moved = |(at, row): (&Vec3, &[f64; N_BONES])| {
            let at = at.as_dvec3();
            let by = |(map, w): (&Map, &f64)| if *w == 0.0 { DVec3::ZERO } else { *w * (map.apply(at) - at) };
            at + maps.iter().zip(row).map(by).sum::<DVec3>()
        };
        cage.iter().zip(&self.0).map(moved).collect()
    }
}

/// Motion of a bone's surroundings.
#[derive(Clone, Debug, PartialEq)]
pub enum Map {
    /// An affine map, such as that of a limb or of a bone in a clip.
    Affine(DAffine3),
    /// The trunk, scaled by heights.
    Trunk(Trunk),
}

/// A map whose lengths along an axis and widths across it depend on the height along the axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Trunk {
    /// Origin of the heights, object units.
    pub origin: DVec3,
    /// Directions of the heights, to the left, and forwards: orthonormal.
    pub axes: [DVec3; 3],
    /// Heights and their images, ascending by height; linear between them, and beyond them with the factor 1.
    pub heights: Vec<[f64; 2]>,
    /// Heights, and the factors of the widths to the left and forwards there; linear between them, constant beyond.
    pub widths: Vec<[f64; 3]>,
    /// Points of the middle line, heights ascending: height, and offsets to the left and forwards.
    pub middle: Vec<[f64; 3]>,
}

impl Map {
    /// Image of a point, object units.
    #[must_use]
    pub fn apply(&self, p: DVec3) -> DVec3 {
        match self {
            Self::Affine(map) => map.transform_point3(p),
            Self::Trunk(trunk) => trunk.apply(p),
        }
    }
}

impl Trunk {
    /// Image of a height.
    #[must_use]
    pub fn height(&self, h: f64) -> f64 {
        let (Some(first), Some(last)) = (self.heights.first(), self.heights.last()) else { return h };
        if h <= first[0] {
            return h + (first[1] - first[0]);
        }
        if h >= last[0] {
            return h + (last[1] - last[0]);
        }
        interpolate(&self.heights, h)[1]
    }

    fn apply(&self, p: DVec3) -> DVec3 {
        let [up, left, forward] = self.axes;
        let d = p - self.origin;
        let h = d.dot(up);
        let [_, across, along] = interpolate(&self.widths, h);
        let [_, mid_left, mid_forward] = interpolate(&self.middle, h);
        let [x, z] = [d.dot(left) - mid_left, d.dot(forward) - mid_forward];
        self.origin
            + self.height(h) * up
            + (mid_left + across * x) * left
            + (mid_forward + along * z) * forward
    }
}

/// Row at the position `at` of rows that ascend by their first number; the first and last row beyond them.
fn interpolate<const N: usize>(rows: &[[f64; N]], at: f64) -> [f64; N] {
    let k = rows.partition_point(|row| row[0] <= at);
    let before = k.checked_sub(1).and_then(|k| rows.get(k));
    let (Some(before), Some(after)) = (before, rows.get(k)) else {
        return rows.get(k).or(rows.last()).copied().unwrap_or([0.0; N]);
    };
    let t = (at - before[0]) / (after[0] - before[0]);
    std::array::from_fn(|i| before[i] + t * (after[i] - before[i]))
}

/// Squared distances and indices of the nearest points of a list, ascending.
fn nearest(at: Vec3, positions: &[Vec3], among: &[usize]) -> Vec<(f64, usize)> {
    let mut near: Vec<(f64, usize)> = Vec::with_capacity(NEAREST + 1);
    for &v in among {
        let squared = f64::from(positions[v].distance_squared(at));
        if near.len() < NEAREST || near.last().is_some_and(|(last, _)| squared < *last) {
            let place = near.partition_point(|(other, _)| *other <= squared);
            near.insert(place, (squared, v));
            near.truncate(NEAREST);
        }
    }
    near
}

/// Row scaled to the sum 1; the hips only if the sum is 0.
fn normalized(mut row: [f64; N_BONES]) -> [f64; N_BONES] {
    let sum: f64 = row.iter().sum();
    if sum > 0.0 {
        row.iter_mut().for_each(|w| *w /= sum);
    } else {
        row[Bone::Hips as usize] = 1.0;
    }
    row
}

/// Row with larger weights of the bones that keep their shape.
fn with_ends(mut row: [f64; N_BONES]) -> [f64; N_BONES] {
    let shares = ENDS.map(|end| {
        let own: f64 = end.iter().map(|bone| row[*bone as usize]).sum();
        let t = ((own - END_FROM) / (END_FULL - END_FROM)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    });
    let total: f64 = shares.iter().sum();
    row.iter_mut().for_each(|w| *w *= 1.0 - total.min(1.0));
    for (end, share) in ENDS.iter().zip(shares) {
        row[end[0] as usize] += share / total.max(1.0);
    }
    row
}
