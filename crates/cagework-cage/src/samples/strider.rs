//! A creature with eight legs thinner than a grid cell.

use glam::{Quat, Vec3, vec3};

use super::sdf::{Body, Solid};
use super::skeleton::Skeleton;
use super::{CageRecipe, PulledPose, Recipe, SampleInfo};
use crate::generate::CageOptions;

pub(super) const INFO: SampleInfo = SampleInfo { id: "strider", label: "Strider" };

const SHELL: [u8; 3] = [176, 84, 52];
const BACK: [u8; 3] = [96, 44, 40];
const LEG: [u8; 3] = [206, 150, 84];
const EYE: [u8; 3] = [20, 20, 26];

/// Angle of each left leg in the horizontal plane, in radians from the front, and factor on the leg's length.
const LEGS: [(f32, f32); 4] = [(0.50, 1.15), (1.20, 1.0), (1.90, 1.0), (2.62, 1.2)];

pub(super) fn recipe() -> Recipe {
    Recipe {
        body: body(),
        cell: 0.0145,
        cage: CageRecipe::Generate(CageOptions {
            target: 208,
            voxels: 72,
            detail: 0.014,
            ..CageOptions::default()
        }),
        poses: vec![("Front legs raised", Box::new(raised))],
        pulled: PulledPose {
            name: "One leg up",
            at: vec3(0.617, 0.03, 1.13),
            by: vec3(0.1, 0.45, 0.1),
            bytes: include_bytes!("pulled/strider.bin"),
        },
        rig: None,
    }
}

/// Returns the points of a left leg (hip, knee, ankle and foot) with their radii.
fn leg(angle: f32, reach: f32) -> [(Vec3, f32); 4] {
    let out = |along: f32, y: f32| vec3(angle.sin() * along, y, angle.cos() * along);
    [
        (out(0.16, 0.52), 0.062),
        (out(0.62 * reach, 0.86), 0.05),
        (out(0.95 * reach, 0.40), 0.04),
        (out(1.12 * reach, 0.03), 0.034),
    ]
}

fn body() -> Body {
    let ball = |center: Vec3, radii: Vec3| Solid::Ellipsoid { center, radii, turn: Quat::IDENTITY };
    let mut body = Body::default();
    body.add(ball(vec3(0.0, 0.56, -0.28), vec3(0.27, 0.23, 0.36)), 0.0, SHELL);
    body.add(ball(vec3(0.0, 0.66, -0.32), vec3(0.19, 0.16, 0.27)), 0.04, BACK);
    body.add(ball(vec3(0.0, 0.52, 0.16), vec3(0.19, 0.15, 0.21)), 0.08, SHELL);
    body.add_both(ball(vec3(0.085, 0.60, 0.31), Vec3::splat(0.045)), 0.01, EYE);
    for (angle, reach) in LEGS {
        body.add_chain_both(&leg(angle, reach), 0.03, LEG);
    }
    body
}

/// Builds the skeleton. Also returns the bone indices of the legs: left ones from the front, then right ones.
fn skeleton() -> (Skeleton, Vec<Vec<usize>>) {
    let mut skeleton = Skeleton::default();
    let trunk = skeleton.add(vec3(0.0, 0.54, -0.4), vec3(0.0, 0.54, 0.25), 0.2, 0);
    let mut legs = Vec::new();
    for side in [1.0, -1.0] {
        for (angle, reach) in LEGS {
            let chain = leg(angle, reach).map(|(p, r)| (vec3(side * p.x, p.y, p.z), r));
            legs.push(skeleton.add_chain(&chain, trunk));
        }
    }
    (skeleton, legs)
}

fn raised(cage: &[Vec3]) -> Vec<Vec3> {
    let (skeleton, legs) = skeleton();
    let mut turns = vec![(0, vec3(-0.18, 0.0, 0.0))];
    for (side, leg) in [(1.0, &legs[0]), (-1.0, &legs[4])] {
        turns.push((leg[0], vec3(-0.45, 0.0, 0.25 * side)));
        turns.push((leg[1], vec3(-0.9, 0.0, 0.35 * side)));
        turns.push((leg[2], vec3(-0.4, 0.0, 0.2 * side)));
    }
    for leg in legs[1..4].iter().chain(&legs[5..]) {
        turns.push((leg[0], vec3(0.18, 0.0, 0.0)));
    }
    skeleton.pose(cage, &turns)
}
