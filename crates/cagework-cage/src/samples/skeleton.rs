//! Skeletons for poses of samples: each cage vertex follows the bones near it.

use glam::{Affine3A, Quat, Vec3};

use cagework_core::skin::{Joint, Rig};

/// Exponent of the inverse distance in a bone's weight.
const SHARPNESS: i32 = 6;

/// A rigid segment that rotates about its first end and moves its children.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bone {
    pub(super) from: Vec3,
    pub(super) to: Vec3,
    /// Radius of the limb, the unit of distances from the bone.
    pub(super) radius: f32,
    /// Index of the parent, lower than the bone's own index. The root is its own parent.
    pub(super) parent: usize,
}

/// Bones, parents before children.
#[derive(Clone, Debug, Default)]
pub(super) struct Skeleton {
    bones: Vec<Bone>,
}

impl Skeleton {
    pub(super) fn add(&mut self, from: Vec3, to: Vec3, radius: f32, parent: usize) -> usize {
        self.bones.push(Bone { from, to, radius, parent });
        self.bones.len() - 1
    }

    pub(super) fn add_chain(&mut self, chain: &[(Vec3, f32)], parent: usize) -> Vec<usize> {
        let mut parent = parent;
        let pairs = chain.windows(2);
        pairs
            .map(|pair| {
                parent = self.add(pair[0].0, pair[1].0, 0.5 * (pair[0].1 + pair[1].1), parent);
                parent
            })
            .collect()
    }

    /// Computes the positions of points after bones have rotated. `turns`: (bone, rotation vector in radians about rest
    /// axes). `[n_points]`
    pub(super) fn pose(&self, points: &[Vec3], turns: &[(usize, Vec3)]) -> Vec<Vec3> {
        let mut motion: Vec<Affine3A> = Vec::with_capacity(self.bones.len());
        for (k, bone) in self.bones.iter().enumerate() {
            let turn = turns
                .iter()
                .filter(|t| t.0 == k)
                .fold(Quat::IDENTITY, |q, t| Quat::from_scaled_axis(t.1) * q);
            let own = Affine3A::from_translation(bone.from)
                * Affine3A::from_quat(turn)
                * Affine3A::from_translation(-bone.from);
            let parent = if bone.parent == k { Affine3A::IDENTITY } else { motion[bone.parent] };
            motion.push(parent * own);
        }
        points.iter().map(|&p| self.moved(p, &motion)).collect()
    }

    /// Computes the weighted mean of a point's images under all bones.
    fn moved(&self, p: Vec3, motion: &[Affine3A]) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for (weight, m) in self.weights(p).into_iter().zip(motion) {
            sum += weight * m.transform_point3(p);
        }
        sum
    }

    /// Computes the weights of the bones at a point; they sum to 1.
    fn weights(&self, p: Vec3) -> Vec<f32> {
        let distances = self.bones.iter().map(|bone| {
            let axis = bone.to - bone.from;
            let share = ((p - bone.from).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
            (p - bone.from - axis * share).length() / bone.radius
        });
        let distances: Vec<f32> = distances.collect();
        let nearest = distances.iter().copied().fold(f32::MAX, f32::min).max(1e-3);
        let weights: Vec<f32> = distances.iter().map(|d| (nearest / d.max(1e-3)).powi(SHARPNESS)).collect();
        let total: f32 = weights.iter().sum();
        weights.into_iter().map(|weight| weight / total).collect()
    }

    /// Builds a rig with a joint at the start of each bone and the four largest weights at each vertex. `names`: names
    /// of the bones; `clip`: name and times of the keys, seconds; `turns`: rotation vector of a bone at a time,
    /// radians; `lift`: position of the root at a time.
    pub(super) fn rig(
        &self,
        names: &[&'static str],
        vertices: &[Vec3],
        clip: (&'static str, Vec<f32>),
        turns: impl Fn(usize, f32) -> Vec3,
        lift: impl Fn(f32) -> Vec3,
    ) -> Rig {
        let joint = |(k, bone): (usize, &Bone)| Joint {
            name: names.get(k).copied().unwrap_or_default(),
            at: bone.from,
            parent: (bone.parent != k).then_some(bone.parent),
        };
        let influences = |&p: &Vec3| {
            let mut all: Vec<(u32, f32)> = (0u32..).zip(self.weights(p)).collect();
            all.sort_by(|a, b| b.1.total_cmp(&a.1));
            all.truncate(4);
            all.resize(4, (0, 0.0));
            let total: f32 = all.iter().map(|(_, w)| w).sum();
            [0, 1, 2, 3].map(|k| (all[k].0, all[k].1 / total))
        };
        let (name, times) = clip;
        Rig {
            joints: self.bones.iter().enumerate().map(joint).collect(),
            influences: vertices.iter().map(influences).collect(),
            turns: (0..self.bones.len())
                .map(|bone| times.iter().map(|&t| Quat::from_scaled_axis(turns(bone, t))).collect())
                .collect(),
            root: times.iter().map(|&t| lift(t)).collect(),
            clip: name,
            times,
        }
    }
}
