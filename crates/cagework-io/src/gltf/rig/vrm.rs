//! Offsets in VRM 0 and VRM 1: springs, colliders, where a head looks from.
//!
//! All else of a VRM is indices of nodes, meshes and targets, which a reshape never renumbers.

use std::collections::HashSet;

use glam::{DMat3, DMat4, DVec3};
use serde_json::{Value, json};

use super::Rig;
use super::nodes::{Given, gradient, vector};
use crate::gltf::GltfDocument;
use crate::gltf::scene::Worlds;

/// A place in a node's space that an extension names.
pub(super) struct Spot {
    node: usize,
    /// Where it is, world space.
    pub(super) at: DVec3,
    /// Its first point.
    pub(super) point: usize,
    what: What,
}

enum What {
    /// JSON pointer to an array of three numbers.
    Array(String),
    /// To an object with x, y and z; VRM 0 turns z round.
    Object(String),
    /// To a radius there.
    Radius(String),
}

/// The spots of a document, their points not numbered yet.
pub(super) fn spots(document: &GltfDocument, worlds: &Worlds, diagonal: f64) -> Vec<Spot> {
    let mut spots = Vec::new();
    let json = &document.json;
    let mut add = |node: Option<u64>, offset: DVec3, what: What| {
        let Some((node, world)) = node.and_then(|n| Some((n as usize, worlds.world.get(n as usize)?))) else {
            return;
        };
        let at = world.transform_point3(offset);
        // What is farther away than the model is large is no place on it: colliders that stand in for others have such.
        let is_near = at.distance(world.w_axis.truncate()) <= diagonal;
        if is_near {
            spots.push(Spot { node, at, point: 0, what });
        }
    };
    let items = |path: String| {
        let n = json.pointer(&path).and_then(Value::as_array).map_or(0, Vec::len);
        (0..n).map(move |k| format!("{path}/{k}"))
    };
    let number = |path: &str| json.pointer(path).and_then(Value::as_u64);
    let array = |path: &str| {
        let all = json.pointer(path)?.as_array()?;
        Some(DVec3::new(all.first()?.as_f64()?, all.get(1)?.as_f64()?, all.get(2)?.as_f64()?))
    };
    let object = |path: &str| {
        let of = json.pointer(path)?;
        Some(DVec3::new(of["x"].as_f64()?, of["y"].as_f64()?, -of["z"].as_f64()?))
    };

    // VRM 0.
    let person = "/extensions/VRM/firstPerson";
    let bone = number(&format!("{person}/firstPersonBone"));
    let offset = format!("{person}/firstPersonBoneOffset");
    if let Some(at) = object(&offset) {
        add(bone, at, What::Object(offset));
    }
    let springs = "/extensions/VRM/secondaryAnimation";
    for group in items(format!("{springs}/colliderGroups")) {
        let node = number(&format!("{group}/node"));
        for collider in items(format!("{group}/colliders")) {
            let Some(at) = object(&format!("{collider}/offset")) else { continue };
            add(node, at, What::Radius(format!("{collider}/radius")));
            add(node, at, What::Object(format!("{collider}/offset")));
        }
    }
    for group in items(format!("{springs}/boneGroups")) {
        add(number(&format!("{group}/bones/0")), DVec3::ZERO, What::Radius(format!("{group}/hitRadius")));
    }
    // VRM 1.
    let head = number("/extensions/VRMC_vrm/humanoid/humanBones/head/node");
    let offset = "/extensions/VRMC_vrm/lookAt/offsetFromHeadBone".to_owned();
    if let Some(at) = array(&offset) {
        add(head, at, What::Array(offset));
    }
    for collider in items("/extensions/VRMC_springBone/colliders".into()) {
        let node = number(&format!("{collider}/node"));
        let extended = format!("{collider}/extensions/VRMC_springBone_extended_collider");
        let shapes = [&collider, &extended]
            .into_iter()
            .flat_map(|of| ["sphere", "capsule", "plane"].map(|shape| format!("{of}/shape/{shape}")));
        for shape in shapes {
            if !json.pointer(&shape).is_some_and(Value::is_object) {
                continue;
            }
            // Without an offset it is at the node.
            let offset = array(&format!("{shape}/offset"));
            add(node, offset.unwrap_or(DVec3::ZERO), What::Radius(format!("{shape}/radius")));
            if let Some(offset) = offset {
                add(node, offset, What::Array(format!("{shape}/offset")));
            }
            if let Some(tail) = array(&format!("{shape}/tail")) {
                add(node, tail, What::Array(format!("{shape}/tail")));
            }
        }
    }
    for spring in items("/extensions/VRMC_springBone/springs".into()) {
        for joint in items(format!("{spring}/joints")) {
            add(number(&format!("{joint}/node")), DVec3::ZERO, What::Radius(format!("{joint}/hitRadius")));
        }
    }
    spots
}

/// Writes the spots that have moved. `world` of the nodes as they are now.
pub(super) fn write(rig: &Rig<'_>, given: &Given<'_>, world: &[DMat4], json: &mut Value) {
    let outside = rig.follows.iter().filter(|(_, at)| given.is_outside[*at]);
    let outside: HashSet<usize> = outside.map(|(node, _)| *node as usize).collect();
    // What hangs on a joint outside the cage keeps its place to it.
    for spot in rig.spots.iter().filter(|spot| !outside.contains(&spot.node)) {
        let by = given.by[spot.point];
        let has_moved = by != DVec3::ZERO || world[spot.node] != rig.worlds.world[spot.node];
        let at = world[spot.node].inverse().transform_point3(spot.at + by);
        if !has_moved || !at.is_finite() {
            continue;
        }
        match &spot.what {
            What::Array(path) => {
                if let Some(of) = json.pointer_mut(path) {
                    *of = vector(at.as_vec3());
                }
            }
            What::Object(path) => {
                for (key, x) in [("x", at.x), ("y", at.y), ("z", -at.z)] {
                    if let Some(of) = json.pointer_mut(&format!("{path}/{key}")) {
                        *of = json!(x as f32);
                    }
                }
            }
            What::Radius(path) => {
                let grows = DMat3::determinant(&gradient(given.by, spot.point, rig.diagonal)).abs().cbrt();
                if let Some(of) = json.pointer_mut(path)
                    && let Some(radius) = of.as_f64()
                {
                    *of = json!((radius * grows) as f32);
                }
            }
        }
    }
}
