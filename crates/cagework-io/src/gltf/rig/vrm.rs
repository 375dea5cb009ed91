//! Offsets in VRM 0 and VRM 1: spring bones, colliders, first-person view and look-at.
//!
//! Other VRM data refers to nodes, meshes and targets by index, which reshaping keeps.

use std::collections::HashMap;

use glam::{DMat3, DMat4, DVec3};
use serde_json::{Value, json};

use super::Rig;
use super::nodes::{Deformation, gradient, vector};
use crate::gltf::GltfDocument;
use crate::gltf::scene::Worlds;

/// A point that a VRM extension stores relative to a node.
pub(super) struct VrmPoint {
    node: usize,
    /// Position of the point in world space.
    pub(super) at: DVec3,
    /// Index of the first bound point of this offset: the point itself, then the six points around it.
    pub(super) bound_index: usize,
    what: VrmField,
}

enum VrmField {
    /// JSON pointer to an array of three numbers.
    Array(String),
    /// JSON pointer to an object with x, y and z. VRM 0 negates z.
    Object(String),
    /// JSON pointer to a radius at this point.
    Radius(String),
}

/// Finds the points of the VRM extensions in a document. Their `bound_index` is 0 until [`Rig::new`] sets it.
pub(super) fn points(document: &GltfDocument, worlds: &Worlds, diagonal: f64) -> Vec<VrmPoint> {
    let mut points = Vec::new();
    let json = &document.json;
    let mut add = |node: Option<u64>, offset: DVec3, what: VrmField| {
        let Some((node, world)) = node.and_then(|n| Some((n as usize, worlds.world.get(n as usize)?))) else {
            return;
        };
        let at = world.transform_point3(offset);
        // Ignore offsets longer than the model: such colliders represent planes.
        let is_near = at.distance(world.w_axis.truncate()) <= diagonal;
        if is_near {
            points.push(VrmPoint { node, at, bound_index: 0, what });
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

    // Points of VRM 0.
    let person = "/extensions/VRM/firstPerson";
    let bone = number(&format!("{person}/firstPersonBone"));
    let offset = format!("{person}/firstPersonBoneOffset");
    if let Some(at) = object(&offset) {
        add(bone, at, VrmField::Object(offset));
    }
    let springs = "/extensions/VRM/secondaryAnimation";
    for group in items(format!("{springs}/colliderGroups")) {
        let node = number(&format!("{group}/node"));
        for collider in items(format!("{group}/colliders")) {
            let Some(at) = object(&format!("{collider}/offset")) else { continue };
            add(node, at, VrmField::Radius(format!("{collider}/radius")));
            add(node, at, VrmField::Object(format!("{collider}/offset")));
        }
    }
    for group in items(format!("{springs}/boneGroups")) {
        add(number(&format!("{group}/bones/0")), DVec3::ZERO, VrmField::Radius(format!("{group}/hitRadius")));
    }
    // Points of VRM 1.
    let head = number("/extensions/VRMC_vrm/humanoid/humanBones/head/node");
    let offset = "/extensions/VRMC_vrm/lookAt/offsetFromHeadBone".to_owned();
    if let Some(at) = array(&offset) {
        add(head, at, VrmField::Array(offset));
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
            // A shape without an offset is at the node's origin.
            let offset = array(&format!("{shape}/offset"));
            add(node, offset.unwrap_or(DVec3::ZERO), VrmField::Radius(format!("{shape}/radius")));
            if let Some(offset) = offset {
                add(node, offset, VrmField::Array(format!("{shape}/offset")));
            }
            if let Some(tail) = array(&format!("{shape}/tail")) {
                add(node, tail, VrmField::Array(format!("{shape}/tail")));
            }
        }
    }
    for spring in items("/extensions/VRMC_springBone/springs".into()) {
        for joint in items(format!("{spring}/joints")) {
            add(
                number(&format!("{joint}/node")),
                DVec3::ZERO,
                VrmField::Radius(format!("{joint}/hitRadius")),
            );
        }
    }
    points
}

/// Writes the offsets that moved. `world`: updated world transforms of the nodes.
pub(super) fn write(rig: &Rig<'_>, given: &Deformation<'_>, world: &[DMat4], json: &mut Value) {
    let anchors: HashMap<usize, usize> = rig.follows.iter().map(|&(node, at)| (node as usize, at)).collect();
    for point in &rig.vrm_points {
        let anchor = anchors.get(&point.node).copied();
        // Points at a node outside the cage stay unchanged.
        if anchor.is_some_and(|at| given.is_outside[at]) {
            continue;
        }
        // A point outside the cage moves with the surroundings of its node.
        let anchor = anchor.filter(|_| given.is_outside[point.bound_index]);
        let gradient = gradient(given.by, anchor.unwrap_or(point.bound_index), rig.diagonal);
        let by = anchor.map_or(given.by[point.bound_index], |at| {
            let offset = point.at - rig.worlds.world[point.node].w_axis.truncate();
            given.by[at] + (gradient - DMat3::IDENTITY) * offset
        });
        let has_moved = by != DVec3::ZERO || world[point.node] != rig.worlds.world[point.node];
        let at = world[point.node].inverse().transform_point3(point.at + by);
        if !has_moved || !at.is_finite() {
            continue;
        }
        match &point.what {
            VrmField::Array(path) => {
                if let Some(of) = json.pointer_mut(path) {
                    *of = vector(at.as_vec3());
                }
            }
            VrmField::Object(path) => {
                for (key, x) in [("x", at.x), ("y", at.y), ("z", -at.z)] {
                    if let Some(of) = json.pointer_mut(&format!("{path}/{key}")) {
                        *of = json!(x as f32);
                    }
                }
            }
            VrmField::Radius(path) => {
                let grows = gradient.determinant().abs().cbrt();
                if let Some(of) = json.pointer_mut(path)
                    && let Some(radius) = of.as_f64()
                {
                    *of = json!((radius * grows) as f32);
                }
            }
        }
    }
}
