//! The rat of Joshi et al. 2007 (figures 1, 5 and 6): a body on short legs with a long tail.

use glam::{Quat, Vec3, vec3};

use super::sdf::{Body, Solid};
use super::skeleton::Skeleton;
use super::{CageRecipe, PulledPose, Recipe, SampleInfo};
use crate::generate::CageOptions;

pub(super) const INFO: SampleInfo = SampleInfo { id: "rat", label: "Rat" };

const FUR: [u8; 3] = [142, 126, 116];
const BELLY: [u8; 3] = [196, 184, 172];
const SKIN: [u8; 3] = [222, 160, 152];
const EYE: [u8; 3] = [28, 22, 24];

/// Points and radii of the spine from the hips to the nose.
const SPINE: [(Vec3, f32); 5] = [
    (vec3(0.0, 0.46, -0.52), 0.34),
    (vec3(0.0, 0.47, -0.05), 0.35),
    (vec3(0.0, 0.45, 0.38), 0.25),
    (vec3(0.0, 0.52, 0.68), 0.22),
    (vec3(0.0, 0.45, 1.06), 0.06),
];

/// Points and radii of the tail from the root to the tip.
const TAIL: [(Vec3, f32); 8] = [
    (vec3(0.0, 0.40, -0.80), 0.105),
    (vec3(0.0, 0.31, -1.05), 0.085),
    (vec3(0.0, 0.24, -1.30), 0.076),
    (vec3(0.0, 0.20, -1.55), 0.069),
    (vec3(0.0, 0.20, -1.80), 0.062),
    (vec3(0.0, 0.24, -2.05), 0.055),
    (vec3(0.0, 0.31, -2.28), 0.048),
    (vec3(0.0, 0.42, -2.48), 0.038),
];

/// Points and radii of the left front leg from the hip to the toes.
const FRONT_LEG: [(Vec3, f32); 4] = [
    (vec3(0.17, 0.36, 0.36), 0.125),
    (vec3(0.23, 0.20, 0.32), 0.085),
    (vec3(0.23, 0.055, 0.38), 0.058),
    (vec3(0.23, 0.04, 0.52), 0.045),
];
/// Points and radii of the left hind leg from the hip to the toes.
const HIND_LEG: [(Vec3, f32); 4] = [
    (vec3(0.23, 0.38, -0.46), 0.21),
    (vec3(0.31, 0.20, -0.32), 0.12),
    (vec3(0.31, 0.06, -0.48), 0.065),
    (vec3(0.31, 0.045, -0.22), 0.05),
];

pub(super) fn recipe() -> Recipe {
    Recipe {
        body: body(),
        cell: 0.0165,
        cage: CageRecipe::Generate(CageOptions {
            target: 120,
            voxels: 64,
            detail: 0.014,
            ..CageOptions::default()
        }),
        poses: vec![("Tail up, head turned", Box::new(curled))],
        pulled: PulledPose {
            name: "Looking round",
            at: vec3(0.0, 0.47, 1.1),
            by: vec3(0.32, 0.12, -0.14),
            bytes: include_bytes!("pulled/rat.bin"),
        },
        rig: None,
    }
}

fn body() -> Body {
    let mut body = Body::default();
    body.add_chain(&SPINE, 0.12, FUR);
    body.add(
        Solid::Ellipsoid {
            center: vec3(0.0, 0.30, -0.1),
            radii: vec3(0.27, 0.20, 0.48),
            turn: Quat::IDENTITY,
        },
        0.12,
        BELLY,
    );
    body.add_chain_both(&HIND_LEG[..3], 0.1, FUR);
    body.add_chain_both(&FRONT_LEG[..3], 0.08, FUR);
    body.add_chain_both(&HIND_LEG[2..], 0.03, SKIN);
    body.add_chain_both(&FRONT_LEG[2..], 0.03, SKIN);
    for (foot, spread) in [(FRONT_LEG[3].0, 0.07), (HIND_LEG[3].0, 0.09)] {
        for side in [-1.0, 0.0, 1.0] {
            let tip = foot + vec3(0.6 * side * spread, -0.012, spread * (1.0 - 0.2 * side * side));
            body.add_both(Solid::Cone { a: foot, b: tip, ra: 0.034, rb: 0.024 }, 0.02, SKIN);
        }
    }
    body.add_chain(&TAIL, 0.05, SKIN);
    let ear = Quat::from_rotation_z(-0.55) * Quat::from_rotation_y(0.35);
    body.add_both(
        Solid::Ellipsoid { center: vec3(0.19, 0.76, 0.60), radii: vec3(0.13, 0.14, 0.05), turn: ear },
        0.04,
        FUR,
    );
    body.add_both(
        Solid::Ellipsoid { center: vec3(0.197, 0.765, 0.634), radii: vec3(0.085, 0.095, 0.03), turn: ear },
        0.015,
        SKIN,
    );
    let ball = |center: Vec3, radius: f32| Solid::Ellipsoid {
        center,
        radii: Vec3::splat(radius),
        turn: Quat::IDENTITY,
    };
    body.add_both(ball(vec3(0.135, 0.585, 0.80), 0.043), 0.008, EYE);
    body.add(ball(vec3(0.0, 0.455, 1.105), 0.048), 0.03, SKIN);
    body
}

/// Builds the skeleton. Also returns the bone indices of spine, tail and legs (left front, right front, left hind,
/// right hind).
fn skeleton() -> (Skeleton, Vec<usize>, Vec<usize>, Vec<Vec<usize>>) {
    let mut skeleton = Skeleton::default();
    let spine = skeleton.add_chain(&SPINE, 0);
    let tail = skeleton.add_chain(&TAIL, spine[0]);
    let mirrored = |leg: [(Vec3, f32); 4]| leg.map(|(p, r)| (vec3(-p.x, p.y, p.z), r));
    let legs = [
        (FRONT_LEG, spine[1]),
        (mirrored(FRONT_LEG), spine[1]),
        (HIND_LEG, spine[0]),
        (mirrored(HIND_LEG), spine[0]),
    ];
    let legs = legs.map(|(leg, parent)| skeleton.add_chain(&leg, parent)).to_vec();
    (skeleton, spine, tail, legs)
}

fn curled(cage: &[Vec3]) -> Vec<Vec3> {
    let (skeleton, spine, tail, _) = skeleton();
    let mut turns = vec![(spine[2], vec3(-0.15, 0.35, 0.0)), (spine[3], vec3(-0.2, 0.45, 0.2))];
    turns.extend(tail.iter().map(|&bone| (bone, vec3(0.36, 0.14, 0.0))));
    skeleton.pose(cage, &turns)
}
