//! Mirror planes of models, and mirrored pairs of chains.

use cagework_core::Bounds;
use cagework_core::nearest::KdTree;
use glam::{DVec3, Vec3};

use super::{Chain, Skeleton};

/// Joints at most this far from the mirror plane lie on it. This and the following lengths are shares of the model's
/// diagonal.
const MIDLINE: f64 = 0.02;

/// A vertex whose image is this far from all vertices has no image.
const IMAGE_DISTANCE: f64 = 0.02;

/// Largest distance of an image from the nearest vertex that counts; larger distances are cut to it.
const MAX_DISTANCE: f64 = 0.2;

/// A model is symmetric if fewer than this share of its vertices have no image ...
const MAX_WITHOUT_IMAGE: f64 = 0.015;
/// ... and if all images are at most this far from a vertex.
const MAX_IMAGE_DISTANCE: f64 = 0.06;

/// The same limits for a chain, which has fewer vertices than the model.
const MAX_WITHOUT_IMAGE_OF_CHAIN: f64 = 0.03;
const MAX_IMAGE_DISTANCE_OF_CHAIN: f64 = 0.08;

/// Chains whose joints are at most this far from each other's images are mirror images.
const PAIR_DISTANCE: f64 = 0.06;

/// Number of vertices that are compared with their images.
const SAMPLES: usize = 4000;

/// A plane perpendicular to an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct MirrorPlane {
    pub(super) axis: usize,
    pub(super) offset: f64,
    /// Whether the model is symmetric in the plane.
    pub(super) is_symmetric: bool,
    /// Diagonal of the model's box, object units.
    pub(super) diagonal: f64,
}

impl MirrorPlane {
    /// Finds the mirror plane of the points: x unless they are symmetric in z or y only. `joints` adds a candidate, the
    /// median of their coordinates.
    pub(super) fn of(points: &[Vec3], joints: &[DVec3]) -> Self {
        let bounds = Bounds::around(points).unwrap_or_default();
        let tree = KdTree::new(points, (0..points.len() as u32).collect());
        let find = |axis| Self::along(axis, points, joints, &tree, bounds);
        let planes = [0, 2, 1].map(find);
        planes.into_iter().find(|plane| plane.is_symmetric).unwrap_or(planes[0])
    }

    fn along(axis: usize, points: &[Vec3], joints: &[DVec3], tree: &KdTree<'_>, bounds: Bounds) -> Self {
        let diagonal = f64::from(bounds.diagonal());
        let centre = bounds.min.as_dvec3().midpoint(bounds.max.as_dvec3())[axis];
        let mut offsets = vec![centre, 0.0];
        offsets.extend(median(points.iter().map(|p| f64::from(p[axis])).collect()));
        offsets.extend(median(joints.iter().map(|p| p[axis]).collect()));
        let step = (points.len() / SAMPLES).max(1);
        let rate = |offset: f64| {
            let plane = Self { axis, offset, is_symmetric: false, diagonal };
            let (far, mean, max) = plane.distances(points.iter().step_by(step), tree);
            let is_symmetric = far < MAX_WITHOUT_IMAGE && max < MAX_IMAGE_DISTANCE;
            (far + mean, Self { is_symmetric, ..plane })
        };
        let mut rated = offsets.into_iter().map(rate);
        let first = rated.next().unwrap_or_else(|| rate(centre));
        rated.fold(first, |best, next| if next.0 < best.0 { next } else { best }).1
    }

    /// Image of a point.
    pub(super) fn image(&self, mut p: DVec3) -> DVec3 {
        p[self.axis] = 2.0 * self.offset - p[self.axis];
        p
    }

    /// Whether a joint lies on the plane.
    pub(super) fn has(&self, p: DVec3) -> bool {
        (p[self.axis] - self.offset).abs() < MIDLINE * self.diagonal
    }

    /// Compares the images of points with the points of a tree: the share without an image, and the mean and largest
    /// distance as shares of the diagonal.
    fn distances<'a>(&self, points: impl Iterator<Item = &'a Vec3>, tree: &KdTree<'_>) -> (f64, f64, f64) {
        let limit = (MAX_DISTANCE * self.diagonal).powi(2) as f32;
        let (mut n, mut far, mut sum, mut max) = (0.0, 0.0, 0.0, 0.0_f64);
        for p in points {
            let found = tree.find(self.image(p.as_dvec3()).as_vec3(), limit);
            let distance =
                found.map_or(MAX_DISTANCE, |(_, squared)| f64::from(squared).sqrt() / self.diagonal);
            n += 1.0;
            far += if distance > IMAGE_DISTANCE { 1.0 } else { 0.0 };
            sum += distance;
            max = max.max(distance);
        }
        if n > 0.0 { (far / n, sum / n, max) } else { (0.0, 0.0, 0.0) }
    }

    /// Pairs chains with their mirror images and makes their joints exact images. Moves chains on the plane into it.
    pub(super) fn pair_up(&self, chains: &mut [Chain]) {
        let limit = PAIR_DISTANCE * self.diagonal;
        for a in 0..chains.len() {
            if chains[a].is_midline {
                chains[a].at.iter_mut().for_each(|p| p[self.axis] = self.offset);
                continue;
            }
            if chains[a].mirror.is_some() {
                continue;
            }
            // All but the tips, which depend on what a hand holds.
            let last = chains[a].at.len() - 1;
            let distance = |b: &Chain| {
                let pairs = b.at[..last].iter().zip(&chains[a].at);
                pairs.map(|(&b, &a)| self.image(b).distance(a)).fold(0.0, f64::max)
            };
            let others = (0..chains.len()).filter(|&b| {
                let chain = &chains[b];
                b != a && !chain.is_midline && chain.mirror.is_none() && chain.at.len() == last + 1
            });
            let nearest = others.map(|b| (distance(&chains[b]), b)).min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, b)) = nearest.filter(|(distance, _)| *distance < limit) else { continue };
            (chains[a].mirror, chains[b].mirror) = (Some(b), Some(a));
            for k in 0..=last {
                let other = self.image(chains[b].at[k]);
                if k < last || other.distance(chains[a].at[k]) < limit {
                    let mean = chains[a].at[k].midpoint(other);
                    (chains[a].at[k], chains[b].at[k]) = (mean, self.image(mean));
                }
            }
        }
    }

    /// Sets [`Chain::is_symmetric`] by comparing the vertices of each chain with those of its image.
    pub(super) fn mark_symmetry(&self, skeleton: &mut Skeleton, positions: &[Vec3]) {
        let mut own = vec![Vec::new(); skeleton.chains.len()];
        for (&chain, v) in skeleton.chain_of.iter().zip(0..) {
            own[chain as usize].push(v);
        }
        let is_alike = |(k, chain): (usize, &Chain)| {
            let other = if chain.is_midline { Some(k) } else { chain.mirror };
            let Some(other) = other else { return false };
            if own[k].is_empty() || own[other].is_empty() {
                return own[k].len() == own[other].len();
            }
            let tree = KdTree::new(positions, own[other].clone());
            let (far, _, max) = self.distances(own[k].iter().map(|&v| &positions[v as usize]), &tree);
            far < MAX_WITHOUT_IMAGE_OF_CHAIN && max < MAX_IMAGE_DISTANCE_OF_CHAIN
        };
        let alike: Vec<bool> = skeleton.chains.iter().enumerate().map(is_alike).collect();
        for (k, chain) in skeleton.chains.iter_mut().enumerate() {
            chain.is_symmetric = alike[k] && chain.mirror.is_none_or(|other| alike[other]);
        }
    }
}

fn median(mut numbers: Vec<f64>) -> Option<f64> {
    numbers.sort_unstable_by(f64::total_cmp);
    let n = numbers.len();
    (n > 0).then(|| 0.5 * (numbers[(n - 1) / 2] + numbers[n / 2]))
}
