//! Skeletons of figures made of capsules. Expected joints are those with which the figures are made.

use std::f32::consts::TAU;
use std::ops::ControlFlow;

use cagework_core::progress::{NoProgress, ProgressEvent};
use glam::{DVec3, Vec3};

use super::{Joint, Rig, Skeleton, SkeletonError};

/// Corners of each ring of a capsule, and rings along it.
const SIDES: usize = 8;
const RINGS: usize = 6;

/// Capsules along bones, each with all its weight on one joint.
#[derive(Clone, Default)]
pub(crate) struct Figure {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) rig: Rig,
}

impl Figure {
    fn joint(&mut self, name: &str, parent: Option<u32>, at: [f32; 3]) -> u32 {
        self.rig.joints.push(Joint { name: name.to_owned(), parent, at: at.into(), bone: None });
        self.rig.joints.len() as u32 - 1
    }

    /// Adds a closed tube with conical ends; the tips are at `from` and `to`.
    fn capsule(&mut self, joint: u32, [from, to]: [[f32; 3]; 2], radius: f32) {
        let [from, to] = [from, to].map(Vec3::from);
        let way = (to - from).normalize();
        let (u, v) = way.any_orthonormal_pair();
        // The same frame for a bone and its image in x = 0.
        let u = if way.cross(Vec3::Z).length() > 0.1 { way.cross(Vec3::Z).normalize() } else { u };
        let v = if way.cross(Vec3::Z).length() > 0.1 { way.cross(u) } else { v };
        let first = self.positions.len() as u32;
        self.positions.push(from);
        for ring in 0..RINGS {
            let center = from.lerp(to, (ring as f32 + 0.5) / RINGS as f32);
            for side in 0..SIDES {
                let angle = TAU * side as f32 / SIDES as f32;
                self.positions.push(center + radius * (angle.cos() * u + angle.sin() * v));
            }
        }
        self.positions.push(to);
        let at = |ring: usize, side: usize| first + 1 + (ring * SIDES + side % SIDES) as u32;
        for side in 0..SIDES {
            self.triangles.push([first, at(0, side + 1), at(0, side)]);
            self.triangles.push([
                self.positions.len() as u32 - 1,
                at(RINGS - 1, side),
                at(RINGS - 1, side + 1),
            ]);
            for ring in 1..RINGS {
                let [a, b] = [at(ring - 1, side), at(ring - 1, side + 1)];
                let [c, d] = [at(ring, side), at(ring, side + 1)];
                self.triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
        for _ in first as usize..self.positions.len() {
            self.rig.influences.push((joint, 1.0));
        }
        self.rig.first = (0..=self.positions.len() as u32).collect();
    }

    /// The figure with its coordinates rotated cyclically, so that x becomes z (1) or y (2).
    fn rolled(mut self, by: usize) -> Self {
        let roll = |p: &mut Vec3| *p = Vec3::from_array([0, 1, 2].map(|k| p[(k + by) % 3]));
        self.positions.iter_mut().for_each(roll);
        self.rig.joints.iter_mut().for_each(|joint| roll(&mut joint.at));
        self
    }

    fn skeleton(&self) -> Skeleton {
        Skeleton::of_rig(&self.positions, &self.rig).unwrap()
    }
}

/// Two legs and two arms. `feet`: whether the feet hang on a control joint on the floor instead of the shins.
pub(crate) fn biped(feet: bool) -> Figure {
    let mut of = Figure::default();
    let control = feet.then(|| of.joint("control", None, [0.0; 3]));
    let hips = of.joint("hips", control, [0.0, 1.0, 0.0]);
    of.capsule(hips, [[0.0, 0.9, 0.0], [0.0, 1.25, 0.0]], 0.15);
    let chest = of.joint("chest", Some(hips), [0.0, 1.2, 0.0]);
    of.capsule(chest, [[0.0, 1.15, 0.0], [0.0, 1.5, 0.0]], 0.16);
    let head = of.joint("head", Some(chest), [0.0, 1.5, 0.0]);
    of.capsule(head, [[0.0, 1.45, 0.0], [0.0, 1.8, 0.0]], 0.1);
    for (side, x) in [("L", 1.0), ("R", -1.0)] {
        let eye = of.joint(&format!("eye.{side}"), Some(head), [0.04 * x, 1.65, 0.08]);
        of.capsule(eye, [[0.04 * x, 1.65, 0.05], [0.04 * x, 1.65, 0.12]], 0.02);
        let thigh = of.joint(&format!("thigh.{side}"), Some(hips), [0.14 * x, 0.95, 0.0]);
        of.capsule(thigh, [[0.14 * x, 1.0, 0.0], [0.16 * x, 0.45, 0.0]], 0.09);
        let shin = of.joint(&format!("shin.{side}"), Some(thigh), [0.16 * x, 0.5, 0.0]);
        of.capsule(shin, [[0.16 * x, 0.55, 0.0], [0.18 * x, 0.05, 0.0]], 0.07);
        let above = if feet { control } else { Some(shin) };
        let foot = of.joint(&format!("foot.{side}"), above, [0.18 * x, 0.08, 0.0]);
        of.capsule(foot, [[0.18 * x, 0.05, -0.08], [0.18 * x, 0.05, 0.25]], 0.05);
        let arm = of.joint(&format!("arm.{side}"), Some(chest), [0.16 * x, 1.4, 0.0]);
        of.capsule(arm, [[0.12 * x, 1.4, 0.0], [0.5 * x, 1.4, 0.0]], 0.06);
        let hand = of.joint(&format!("hand.{side}"), Some(arm), [0.48 * x, 1.4, 0.0]);
        of.capsule(hand, [[0.45 * x, 1.4, 0.0], [0.9 * x, 1.4, 0.0]], 0.05);
    }
    of
}

/// The diagonal is 2.57, so joints within 0.0515 of the mirror plane lie on it.
#[test]
fn shoulders_beside_the_mirror_plane_are_a_pair() {
    let mut figure = biped(false);
    for (name, x) in [("arm.L", 0.052), ("arm.R", -0.0505)] {
        let joint = figure.rig.joints.iter_mut().find(|joint| joint.name == name).unwrap();
        joint.at.x = x;
    }
    let skeleton = figure.skeleton();
    assert_eq!(names(&skeleton), names(&biped(false).skeleton()));
    assert_eq!(skeleton.chains[3].mirror, Some(4));
}

fn quadruped() -> Figure {
    let mut of = Figure::default();
    let hips = of.joint("hips", None, [0.0, 1.0, -0.7]);
    of.capsule(hips, [[0.0, 1.0, -0.9], [0.0, 1.0, 0.1]], 0.2);
    let chest = of.joint("chest", Some(hips), [0.0, 1.0, 0.0]);
    of.capsule(chest, [[0.0, 1.0, -0.1], [0.0, 1.0, 0.9]], 0.2);
    let neck = of.joint("neck", Some(chest), [0.0, 1.0, 0.8]);
    of.capsule(neck, [[0.0, 1.0, 0.7], [0.0, 1.4, 1.4]], 0.12);
    let tail = of.joint("tail", Some(hips), [0.0, 1.05, -0.9]);
    of.capsule(tail, [[0.0, 1.05, -0.85], [0.0, 0.9, -1.6]], 0.05);
    for (side, x) in [("L", 0.2), ("R", -0.2)] {
        for (place, parent, z) in [("front", chest, 0.7), ("hind", hips, -0.7)] {
            let leg = of.joint(&format!("{place}.{side}"), Some(parent), [x, 0.9, z]);
            of.capsule(leg, [[x, 1.0, z], [x, 0.0, z]], 0.08);
        }
    }
    of
}

fn names(skeleton: &Skeleton) -> Vec<&str> {
    skeleton.chains.iter().map(|chain| chain.name.as_str()).collect()
}

fn bones(figure: &Figure, skeleton: &Skeleton, chain: usize) -> Vec<String> {
    let name = |&bone: &u32| figure.rig.joints[bone as usize].name.clone();
    skeleton.chains[chain].own_bones.iter().map(name).collect()
}

/// Checks that chains are linked, and that pairs are exact images.
fn assert_consistent(skeleton: &Skeleton, n_vertices: usize) {
    assert_eq!((skeleton.chain_of.len(), skeleton.bone_of.len()), (n_vertices, n_vertices));
    let image = |mut p: DVec3| {
        p[skeleton.axis] = 2.0 * skeleton.offset - p[skeleton.axis];
        p
    };
    for (k, chain) in skeleton.chains.iter().enumerate() {
        assert_eq!(chain.parent.is_none(), k == 0);
        assert!(chain.parent.is_none_or(|parent| parent < k), "{}", chain.name);
        assert_eq!(chain.bones.len() + 1, chain.at.len(), "{}", chain.name);
        if let Some(other) = chain.mirror {
            let other = &skeleton.chains[other];
            assert_eq!(other.mirror, Some(k));
            let pairs = chain.at.iter().zip(&other.at);
            assert!(pairs.clone().all(|(&a, &b)| image(a) == b || image(b) == a), "{}", chain.name);
            assert!(chain.is_symmetric, "{}", chain.name);
        }
    }
    assert!(skeleton.chain_of.iter().all(|&chain| (chain as usize) < skeleton.chains.len()));
}

#[test]
fn a_biped_has_a_trunk_two_legs_and_two_arms() {
    let figure = biped(false);
    let skeleton = figure.skeleton();
    assert_consistent(&skeleton, figure.positions.len());
    assert_eq!(names(&skeleton), ["trunk", "thigh.L", "thigh.R", "arm.L", "arm.R"]);
    assert_eq!((skeleton.axis, skeleton.is_symmetric, skeleton.is_biped), (0, true, true));
    assert!(skeleton.offset.abs() < 1e-6);
    // The head reaches less far than 0.13 diagonals, as do the eyes: both belong to the chest.
    assert_eq!(bones(&figure, &skeleton, 0), ["hips", "chest"]);
    assert_eq!(bones(&figure, &skeleton, 1), ["thigh.L", "shin.L", "foot.L"]);
    assert_eq!((skeleton.chains[1].mirror, skeleton.chains[3].mirror), (Some(2), Some(4)));
    // The trunk goes from the lowest vertex of the hips, through the joints, to the top of the head.
    let expected = [0.9, 1.0, 1.2, 1.8].map(|y| DVec3::new(0.0, y, 0.0));
    let trunk = &skeleton.chains[0].at;
    assert!(trunk.iter().zip(expected).all(|(a, b)| a.distance(b) < 1e-6), "{trunk:?}");
    let eye =
        figure.rig.influences.iter().position(|of| figure.rig.joints[of.0 as usize].name == "eye.L").unwrap();
    assert_eq!((skeleton.bone_of[eye], skeleton.chain_of[eye]), (skeleton.chains[0].own_bones[1], 0));
    // The tip of an arm continues its last bone to the furthest vertex.
    assert!(skeleton.chains[3].at.last().unwrap().distance(DVec3::new(0.9, 1.4, 0.0)) < 1e-6);
    assert_eq!(skeleton, figure.skeleton(), "deterministic");
}

#[test]
fn feet_on_control_joints_join_the_shins() {
    let expected = biped(false);
    let mut figure = biped(true);
    let by_distance = figure.skeleton();
    assert_eq!(names(&by_distance), names(&expected.skeleton()));
    assert_eq!(bones(&figure, &by_distance, 1), ["thigh.L", "shin.L", "foot.L"]);
    // Weights that a foot shares with the opposite thigh count more than the distance to the shin.
    let joint = |name: &str| figure.rig.joints.iter().position(|joint| joint.name == name).unwrap() as u32;
    let (thigh, foot) = (joint("thigh.R"), joint("foot.L"));
    let (mut first, mut influences) = (vec![0], Vec::new());
    for &(joint, weight) in &figure.rig.influences {
        influences.push((joint, weight));
        if joint == foot {
            influences.push((thigh, 0.4));
        }
        first.push(influences.len() as u32);
    }
    (figure.rig.first, figure.rig.influences) = (first, influences);
    let by_weights = figure.skeleton();
    assert_eq!(bones(&figure, &by_weights, 1), ["thigh.L", "shin.L"]);
}

#[test]
fn a_quadruped_has_four_legs_and_a_tail() {
    let figure = quadruped();
    let skeleton = figure.skeleton();
    assert_consistent(&skeleton, figure.positions.len());
    assert_eq!(names(&skeleton), ["trunk", "tail", "hind.L", "hind.R", "front.L", "front.R"]);
    assert!(!skeleton.is_biped && skeleton.chains[1].is_midline);
    assert_eq!(bones(&figure, &skeleton, 0), ["hips", "chest", "neck"]);
    let paired: Vec<_> = skeleton.chains.iter().map(|chain| chain.mirror).collect();
    assert_eq!(paired, [None, None, Some(3), Some(2), Some(5), Some(4)]);
}

#[test]
fn mirror_planes_may_have_any_axis() {
    let skeleton = biped(false).skeleton();
    for (by, axis) in [(1, 2), (2, 1)] {
        let rolled = biped(false).rolled(by).skeleton();
        assert_eq!((rolled.axis, names(&rolled)), (axis, names(&skeleton)));
        assert_eq!(rolled.chain_of, skeleton.chain_of);
        for (a, b) in skeleton.chains.iter().zip(&rolled.chains) {
            let same = |(p, q): (&DVec3, &DVec3)| (0..3).all(|k| (p[(k + by) % 3] - q[k]).abs() < 1e-5);
            assert!(a.at.iter().zip(&b.at).all(same), "{}: {:?} {:?}", a.name, a.at, b.at);
        }
    }
}

#[test]
fn an_unrigged_figure_has_the_same_limbs() {
    let figure = biped(false);
    let skeleton = Skeleton::of_surface(&figure.positions, &figure.triangles, &NoProgress).unwrap();
    assert_consistent(&skeleton, figure.positions.len());
    assert_eq!((skeleton.chains.len(), skeleton.is_symmetric, skeleton.is_biped), (5, true, true));
    // The tips of the limbs are those of the feet and hands, within three voxels.
    let voxel = 1.8 / 72.0;
    let mut tips: Vec<DVec3> = skeleton.chains.iter().map(|chain| *chain.at.last().unwrap()).collect();
    tips.retain(|tip| tip.x > 0.05);
    tips.sort_by(|a, b| a.y.total_cmp(&b.y));
    let expected = [DVec3::new(0.18, 0.05, 0.25), DVec3::new(0.9, 1.4, 0.0)];
    assert_eq!(tips.len(), 2);
    assert!(tips.iter().zip(expected).all(|(a, b)| a.distance(b) < 3.0 * voxel), "{tips:?}");
    assert!((skeleton.chains[0].at.last().unwrap().y - 1.8).abs() < 4.0 * voxel);
    // The hand's tip and the shin belong to limbs, the top of the head to the trunk.
    let chain_at = |p: [f32; 3]| {
        let away = |v: &usize| figure.positions[*v].distance(p.into());
        let nearest = (0..figure.positions.len()).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap();
        skeleton.chain_of[nearest] as usize
    };
    assert_eq!(chain_at([0.0, 1.8, 0.0]), 0);
    let [hand, other, shin] = [[0.9, 1.4, 0.0], [-0.9, 1.4, 0.0], [0.18, 0.05, 0.25]].map(chain_at);
    assert!(hand > 0 && shin > 0 && hand != shin);
    assert_eq!(skeleton.chains[hand].mirror, Some(other));
    let again = Skeleton::of_surface(&figure.positions, &figure.triangles, &NoProgress).unwrap();
    assert_eq!(skeleton, again, "deterministic");
}

#[test]
fn vertices_without_weights_follow_the_nearest_vertex() {
    let mut figure = biped(false);
    let n = figure.positions.len();
    // The end of a morph target near the hand, beyond the rig's vertices.
    figure.positions.push(Vec3::new(0.88, 1.42, 0.0));
    let skeleton = figure.skeleton();
    assert_eq!(skeleton.chains[skeleton.chain_of[n] as usize].name, "arm.L");
}

#[test]
fn invalid_rigs_are_refused() {
    let figure = biped(false);
    let refused = |change: &dyn Fn(&mut Rig)| {
        let mut rig = figure.rig.clone();
        change(&mut rig);
        Skeleton::of_rig(&figure.positions, &rig).unwrap_err()
    };
    let n = figure.rig.joints.len();
    assert_eq!(refused(&|rig| rig.first = vec![0]), SkeletonError::NoWeights { joints: n });
    assert_eq!(refused(&|rig| *rig = Rig::default()), SkeletonError::NoWeights { joints: 0 });
    for change in [
        &|rig: &mut Rig| rig.joints[0].parent = Some(1),
        &|rig: &mut Rig| rig.joints[3].parent = Some(99),
        &|rig: &mut Rig| rig.influences[7].0 = 99,
        &|rig: &mut Rig| rig.influences[7].1 = f32::NAN,
        &|rig: &mut Rig| rig.joints[2].at.y = f32::INFINITY,
        &|rig: &mut Rig| rig.first.push(rig.influences.len() as u32),
        &|rig: &mut Rig| rig.first[3] = 1_000_000,
    ] as [&dyn Fn(&mut Rig); 7]
    {
        assert!(matches!(refused(change), SkeletonError::Rig(_)));
    }
    // One joint per vertex, more than the limit.
    let points = vec![Vec3::ONE; 1100];
    let joints = (0..1100).map(|k| Joint {
        name: String::new(),
        parent: (k > 0).then(|| k - 1),
        at: Vec3::ZERO,
        bone: None,
    });
    let rig = Rig {
        joints: joints.collect(),
        first: (0..=1100).collect(),
        influences: (0..1100).map(|k| (k, 1.0)).collect(),
    };
    let error = Skeleton::of_rig(&points, &rig).unwrap_err();
    assert_eq!(error, SkeletonError::TooManyJoints { joints: 1100 });
    assert!(error.to_string().contains("at most 1024"), "{error}");
}

#[test]
fn surfaces_without_limbs_are_refused() {
    let figure = biped(false);
    let refused = |positions: &[Vec3], triangles: &[[u32; 3]]| {
        Skeleton::of_surface(positions, triangles, &NoProgress).unwrap_err()
    };
    assert_eq!(refused(&figure.positions, &[]), SkeletonError::NoFaces);
    assert_eq!(refused(&[], &[]), SkeletonError::NoFaces);
    let flat: Vec<Vec3> = figure.positions.iter().map(|p| *p * Vec3::new(1.0, 1.0, 0.0)).collect();
    assert_eq!(refused(&flat, &figure.triangles), SkeletonError::Flat);
    assert_eq!(refused(&[Vec3::ONE; 3], &[[0, 1, 2]]), SkeletonError::Flat);
    let cancel = |_: ProgressEvent| ControlFlow::Break(());
    let cancelled = Skeleton::of_surface(&figure.positions, &figure.triangles, &cancel).unwrap_err();
    assert!(matches!(cancelled, SkeletonError::Cancelled(_)));
}
