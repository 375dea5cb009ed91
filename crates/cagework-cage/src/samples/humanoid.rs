//! A person with legs close together.

use std::f32::consts::{PI, TAU};

use glam::{Quat, Vec3, vec3};

use super::sdf::{Body, Solid};
use super::skeleton::Skeleton;
use super::{CageRecipe, PulledPose, Recipe, SampleInfo};
use crate::generate::CageOptions;
use cagework_core::skin::Rig;

pub(super) const INFO: SampleInfo = SampleInfo { id: "humanoid", label: "Legs close together" };

const SKIN: [u8; 3] = [224, 178, 148];
const SHIRT: [u8; 3] = [58, 108, 158];
const TROUSERS: [u8; 3] = [66, 70, 84];
const SHOE: [u8; 3] = [112, 62, 44];
const HAIR: [u8; 3] = [74, 50, 36];

/// Points and radii of the trunk from the pelvis to the head.
const TRUNK: [(Vec3, f32); 4] = [
    (vec3(0.0, 0.98, 0.0), 0.15),
    (vec3(0.0, 1.18, 0.0), 0.13),
    (vec3(0.0, 1.42, 0.0), 0.15),
    (vec3(0.0, 1.60, 0.01), 0.065),
];
/// Points and radii of the left arm from the shoulder to the fingers.
const ARM: [(Vec3, f32); 4] = [
    (vec3(0.20, 1.46, 0.0), 0.085),
    (vec3(0.47, 1.38, -0.01), 0.062),
    (vec3(0.73, 1.31, 0.04), 0.048),
    (vec3(0.88, 1.27, 0.06), 0.044),
];
/// Points and radii of the left leg from the hip to the toes.
const LEG: [(Vec3, f32); 4] = [
    (vec3(0.135, 0.90, 0.0), 0.108),
    (vec3(0.142, 0.50, 0.01), 0.078),
    (vec3(0.145, 0.10, -0.01), 0.058),
    (vec3(0.148, 0.05, 0.15), 0.052),
];

pub(super) fn recipe() -> Recipe {
    Recipe {
        body: body(),
        cell: 0.0125,
        cage: CageRecipe::Generate(CageOptions {
            target: 148,
            voxels: 72,
            detail: 0.014,
            ..CageOptions::default()
        }),
        poses: vec![("A step", Box::new(step))],
        pulled: PulledPose {
            name: "Knee up",
            at: vec3(0.142, 0.5, 0.1),
            by: vec3(0.03, 0.24, 0.26),
            bytes: include_bytes!("pulled/humanoid.bin"),
        },
        rig: Some(walk),
    }
}

fn body() -> Body {
    let ball = |center: Vec3, radii: Vec3| Solid::Ellipsoid { center, radii, turn: Quat::IDENTITY };
    let mut body = Body::default();
    body.add(ball(vec3(0.0, 1.36, 0.0), vec3(0.215, 0.20, 0.135)), 0.0, SHIRT);
    body.add(ball(vec3(0.0, 1.15, 0.0), vec3(0.165, 0.22, 0.12)), 0.1, SHIRT);
    body.add(ball(vec3(0.0, 0.97, -0.005), vec3(0.20, 0.13, 0.135)), 0.06, TROUSERS);
    body.add_chain_both(&LEG[..3], 0.03, TROUSERS);
    body.add_chain_both(&LEG[2..], 0.03, SHOE);
    body.add_chain_both(&ARM[..2], 0.05, SHIRT);
    body.add_chain_both(&ARM[1..3], 0.02, SKIN);
    body.add_both(ball(vec3(0.83, 1.285, 0.05), vec3(0.085, 0.036, 0.06)), 0.03, SKIN);
    body.add_both(
        Solid::Cone { a: vec3(0.79, 1.29, 0.08), b: vec3(0.83, 1.29, 0.14), ra: 0.024, rb: 0.018 },
        0.02,
        SKIN,
    );
    body.add(
        Solid::Cone { a: vec3(0.0, 1.48, -0.01), b: vec3(0.0, 1.62, 0.0), ra: 0.075, rb: 0.065 },
        0.04,
        SKIN,
    );
    body.add(ball(vec3(0.0, 1.73, 0.02), vec3(0.105, 0.135, 0.12)), 0.03, SKIN);
    body.add(ball(vec3(0.0, 1.785, -0.015), vec3(0.113, 0.105, 0.118)), 0.008, HAIR);
    body.add(ball(vec3(0.0, 1.715, 0.145), vec3(0.02, 0.028, 0.025)), 0.03, SKIN);
    body
}

/// Builds the skeleton. Also returns the bone indices of arms and legs (left, right).
fn skeleton() -> (Skeleton, [Vec<usize>; 2], [Vec<usize>; 2]) {
    let mut skeleton = Skeleton::default();
    let trunk = skeleton.add_chain(&TRUNK, 0);
    skeleton.add(vec3(0.0, 1.60, 0.01), vec3(0.0, 1.82, 0.02), 0.12, trunk[2]);
    let mirrored = |limb: [(Vec3, f32); 4]| limb.map(|(p, r)| (vec3(-p.x, p.y, p.z), r));
    let arms = [ARM, mirrored(ARM)].map(|arm| skeleton.add_chain(&arm, trunk[1]));
    let legs = [LEG, mirrored(LEG)].map(|leg| skeleton.add_chain(&leg, 0));
    (skeleton, arms, legs)
}

/// Names of the skeleton's bones, in order.
const NAMES: [&str; 16] = [
    "hips",
    "spine",
    "neck",
    "head",
    "arm.L",
    "forearm.L",
    "hand.L",
    "arm.R",
    "forearm.R",
    "hand.R",
    "thigh.L",
    "shin.L",
    "foot.L",
    "thigh.R",
    "shin.R",
    "foot.R",
];

/// Builds a rig with a looping walk on the spot: two steps in two seconds.
fn walk(vertices: &[Vec3]) -> Rig {
    const SECONDS: f32 = 2.0;
    const KEYS: usize = 17;
    let times: Vec<f32> = (0..KEYS).map(|k| SECONDS * k as f32 / (KEYS - 1) as f32).collect();
    let turn = |bone: usize, t: f32| {
        let phase = TAU * t / SECONDS;
        // Left and right are half a cycle apart.
        let (side, own) = if matches!(bone, 7..=9 | 13..=15) { (-1.0, phase + PI) } else { (1.0, phase) };
        match bone {
            0 => vec3(0.0, -0.08 * phase.sin(), 0.0),
            2 => vec3(0.0, 0.10 * phase.sin(), 0.0),
            // Arms hang down, and each swings opposite to the leg on its side.
            4 | 7 => vec3(0.35 * own.sin(), 0.0, -1.1 * side),
            5 | 8 => vec3(0.0, -0.25 * side, 0.0),
            10 | 13 => vec3(-0.42 * own.sin(), 0.0, 0.0),
            // The knee bends while the leg swings forward.
            11 | 14 => vec3(0.08 + 0.75 * own.cos().max(0.0).powi(2), 0.0, 0.0),
            12 | 15 => vec3(0.12 * own.sin(), 0.0, 0.0),
            _ => Vec3::ZERO,
        }
    };
    let hips = TRUNK[0].0;
    let lift = |t: f32| hips + vec3(0.0, 0.012 * (2.0 * TAU * t / SECONDS).cos() - 0.02, 0.0);
    skeleton().0.rig(&NAMES, vertices, ("Walk", times), turn, lift)
}

fn step(cage: &[Vec3]) -> Vec<Vec3> {
    let (skeleton, arms, legs) = skeleton();
    let turns = [
        (legs[0][0], vec3(-0.85, 0.0, 0.0)),
        (legs[0][1], vec3(0.75, 0.0, 0.0)),
        (arms[0][0], vec3(0.0, 0.0, -0.9)),
        (arms[1][0], vec3(0.0, 0.5, 0.9)),
        (arms[1][1], vec3(0.0, 0.6, 0.0)),
    ];
    skeleton.pose(cage, &turns)
}
