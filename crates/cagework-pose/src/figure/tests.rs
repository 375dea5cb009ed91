use std::sync::LazyLock;

use cagework_cage::samples;
use cagework_cage::skeleton::Skeleton;
use cagework_core::progress::NoProgress;
use cagework_core::rig::{Joint, JointFrame, Rig};
use glam::{DAffine3, DQuat, Vec3};

use super::*;
use crate::drive::Map;

/// Rounding of 32-bit coordinates of a figure that is two units tall.
const ROUNDING: f64 = 1e-6;
/// Error of joints that are fitted by voxels, of which 72 are on the longest side: two voxels.
const VOXELS: f64 = 2.0 / 72.0;

struct Sample {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    cage: Vec<Vec3>,
    rig: Rig,
    humanoid: Humanoid,
    landmarks: Landmarks,
    chain_of: Vec<u32>,
}

static SAMPLE: LazyLock<Sample> = LazyLock::new(|| {
    let sample = samples::build("humanoid").unwrap();
    let own = sample.rig.unwrap();
    let joints = own.joints.iter().map(|joint| Joint {
        name: joint.name.to_owned(),
        parent: joint.parent.map(|parent| parent as u32),
        at: joint.at,
        bone: None,
    });
    let rig = Rig { joints: joints.collect(), ..Rig::default() };
    let humanoid = Humanoid::of_rig(&rig, &[]).unwrap();
    let (positions, triangles) = (sample.mesh.positions, sample.mesh.triangles);
    let (landmarks, chain_of) = landmarks_of(&positions, &triangles);
    let cage = sample.cage.positions;
    Sample { positions, triangles, cage, rig, humanoid, landmarks: landmarks.unwrap(), chain_of }
});

fn landmarks_of(positions: &[Vec3], triangles: &[[u32; 3]]) -> (Option<Landmarks>, Vec<u32>) {
    let skeleton = Skeleton::of_surface(positions, triangles, &NoProgress).unwrap();
    let chains: Vec<Vec<DVec3>> = skeleton.chains.iter().map(|chain| chain.at.clone()).collect();
    (Landmarks::find(positions, triangles, &chains), skeleton.chain_of)
}

impl Sample {
    fn figure(&self) -> Figure {
        Figure::of_rig(&self.rig, &self.humanoid)
    }

    fn fitted_to_itself(&self) -> Fit {
        Fit::by_limbs(&self.figure(), &self.landmarks, &self.landmarks)
    }

    fn weights(&self, fit: &Fit) -> BoneWeights {
        let limbs = Some((&self.landmarks, self.chain_of.as_slice()));
        BoneWeights::of_figure(&self.cage, &[], &self.positions, &fit.figure, limbs)
    }

    /// The joints, moved by a rigid motion.
    fn moved(&self, by: DAffine3) -> Vec<JointFrame> {
        let turn = DQuat::from_mat3(&by.matrix3);
        let frame = |joint: &Joint| JointFrame { at: by.transform_point3(joint.at.as_dvec3()), turn };
        self.rig.joints.iter().map(frame).collect()
    }
}

fn furthest(a: &Figure, b: &Figure, map: impl Fn(DVec3) -> DVec3) -> f64 {
    let both = Bone::ALL.iter().filter_map(|(_, bone)| Some((a.at(*bone)?, b.at(*bone)?)));
    both.map(|(a, b)| map(a).distance(b)).fold(0.0, f64::max)
}

#[test]
fn a_rig_fits_its_own_model_exactly() {
    let sample = &*SAMPLE;
    let own = sample.figure();
    let bounds = sample.landmarks.bounds;
    for fit in [sample.fitted_to_itself(), Fit::by_bounds(&own, bounds, bounds)] {
        assert!(furthest(&own, &fit.figure, |p| p) < ROUNDING, "{:?}", fit.source);
    }
}

#[test]
fn a_scaled_and_turned_figure_gets_scaled_and_turned_joints() {
    let sample = &*SAMPLE;
    let turn = DQuat::from_rotation_y(-0.7);
    let map = |p: DVec3| DVec3::new(3.0, -1.0, 2.0) + 1.4 * (turn * p);
    let positions: Vec<Vec3> = sample.positions.iter().map(|p| map(p.as_dvec3()).as_vec3()).collect();
    let landmarks = landmarks_of(&positions, &sample.triangles).0.unwrap();
    let fit = Fit::by_limbs(&sample.figure(), &sample.landmarks, &landmarks);
    let height = landmarks.height();
    let error = furthest(&sample.figure(), &fit.figure, map) / height;
    assert!(error < VOXELS, "{error}");
    assert!((fit.turn.inverse() * turn).to_axis_angle().1.abs() < 0.05, "it faces as the target does");
}

#[test]
fn longer_legs_get_longer_leg_bones_and_scaled_travel() {
    let sample = &*SAMPLE;
    let hip = 0.9_f32;
    let longer = |p: &Vec3| Vec3::new(p.x, if p.y < hip { p.y + 0.4 * (p.y - hip) } else { p.y }, p.z);
    let positions: Vec<Vec3> = sample.positions.iter().map(longer).collect();
    let landmarks = landmarks_of(&positions, &sample.triangles).0.unwrap();
    let fit = Fit::by_limbs(&sample.figure(), &sample.landmarks, &landmarks);
    for (_, bone) in Bone::ALL {
        let (Some(at), Some(own)) = (fit.figure.at(*bone), sample.figure().at(*bone)) else { continue };
        let expected = longer(&own.as_vec3()).as_dvec3();
        assert!(at.distance(expected) / landmarks.height() < 1.5 * VOXELS, "{bone}: {at} {expected}");
    }
    let travel = ClipMaps::new(&fit, &sample.rig, &sample.humanoid).travel();
    assert!((travel - 1.4).abs() < 0.07, "{travel}");
}

#[test]
fn a_frame_at_rest_keeps_the_cage_and_a_rigid_one_moves_it_rigidly() {
    let sample = &*SAMPLE;
    let fit = sample.fitted_to_itself();
    let (maps, weights) = (ClipMaps::new(&fit, &sample.rig, &sample.humanoid), sample.weights(&fit));
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 0.5);
    for by in [DAffine3::IDENTITY, DAffine3::from_rotation_translation(turn, DVec3::new(1.0, 0.2, -3.0))] {
        let posed = weights.drive(&sample.cage, &maps.at(&sample.moved(by)));
        let error =
            posed.iter().zip(&sample.cage).map(|(p, c)| p.distance(by.transform_point3(c.as_dvec3())));
        let error = error.fold(0.0, f64::max);
        assert!(error < 10.0 * ROUNDING, "{error}");
    }
}

#[test]
fn the_cage_of_a_bent_forearm_follows_it_and_the_rest_stays() {
    let sample = &*SAMPLE;
    let fit = sample.fitted_to_itself();
    let (clip, weights) = (ClipMaps::new(&fit, &sample.rig, &sample.humanoid), sample.weights(&fit));
    let turn = DQuat::from_rotation_y(-1.9);
    let mut frames = sample.moved(DAffine3::IDENTITY);
    for bone in [Bone::LeftLowerArm, Bone::LeftHand] {
        frames[sample.humanoid.joint(bone).unwrap() as usize].turn = turn;
    }
    let maps = clip.at(&frames);
    let bent = clip.most_bent(&maps).unwrap();
    // 1.9 radians are 108.9 degrees. At rest the elbow is not straight: 13 degrees of the bones' directions.
    assert_eq!(bent.bone, Bone::LeftLowerArm);
    assert!((bent.degrees - 108.9).abs() < 15.0, "{}", bent.degrees);
    let Map::Affine(hand) = &maps[Bone::LeftHand as usize] else { panic!("a rigid map") };
    for (p, c) in weights.drive(&sample.cage, &maps).iter().zip(&sample.cage) {
        let by = p.distance(c.as_dvec3());
        if c.x > 0.8 {
            assert!(p.distance(hand.transform_point3(c.as_dvec3())) < 0.02, "{c}: a hand keeps its shape");
        } else if c.x < 0.1 {
            assert!(by < 0.01, "{c} moves by {by}");
        }
    }
}

#[test]
fn named_joints_are_read_as_they_were_written() {
    let figure = SAMPLE.fitted_to_itself().figure;
    let named = figure.named(|p| 2.0 * p);
    assert_eq!(named.joints["leftHand"], (2.0 * figure.at(Bone::LeftHand).unwrap()).to_array());
    assert_eq!(Figure::of_named(&named, |p| 0.5 * p).unwrap(), figure);
    let mut wrong = named.clone();
    wrong.joints.insert("tail".into(), [0.0; 3]);
    assert_eq!(Figure::of_named(&wrong, |p| p), Err(FigureError::Bone("tail".into())));
    let mut wrong = named;
    wrong.joints.insert("neck".into(), [f64::NAN; 3]);
    assert_eq!(Figure::of_named(&wrong, |p| p), Err(FigureError::NotFinite(Bone::Neck)));
}

#[test]
fn a_model_without_limbs_has_no_landmarks() {
    let points = [Vec3::ZERO, Vec3::ONE, Vec3::X];
    assert_eq!(Landmarks::find(&points, &[[0, 1, 2]], &[]), None);
    assert_eq!(Landmarks::find(&points, &[[0, 1, 2]], &[vec![DVec3::ZERO, DVec3::Y]]), None);
    assert_eq!(Landmarks::find(&[], &[], &[vec![DVec3::ZERO, DVec3::Y]]), None);
    let on_four_legs = samples::build("strider").unwrap().mesh;
    assert_eq!(landmarks_of(&on_four_legs.positions, &on_four_legs.triangles).0, None);
}

#[test]
fn a_figure_with_lowered_arms_takes_the_directions_of_the_rig() {
    let sample = &*SAMPLE;
    let (mut fit, own) = (sample.fitted_to_itself(), sample.figure());
    let arm = [Bone::LeftUpperArm, Bone::LeftLowerArm, Bone::LeftHand];
    let shoulder = own.at(arm[0]).unwrap();
    for bone in arm {
        let by = own.at(bone).unwrap() - shoulder;
        fit.figure.joints[bone as usize] = Some(shoulder + DQuat::from_rotation_z(-0.9) * by);
    }
    let maps = ClipMaps::new(&fit, &sample.rig, &sample.humanoid).at(&sample.moved(DAffine3::IDENTITY));
    for pair in arm.windows(2) {
        let [from, to] =
            [pair[0], pair[1]].map(|bone| maps[pair[0] as usize].apply(fit.figure.at(bone).unwrap()));
        let expected = own.at(pair[1]).unwrap() - own.at(pair[0]).unwrap();
        assert!((to - from).distance(expected) < ROUNDING, "{}: {} {expected}", pair[0], to - from);
    }
}
