//! Node hierarchy: world transforms and mesh instances.

use cagework_core::words::counted;
use std::collections::HashSet;

use ::gltf::json::Root;
use ::gltf::json::scene::Node;
use glam::{DMat4, DQuat, DVec3, Mat4};
use serde_json::Value;

use super::{GltfDocument, GltfError, get};
use crate::counts::Counts;

/// World transforms of all nodes. They are in f64, so that transforming a position to another space and back preserves
/// its f32 value.
#[derive(Clone, Debug)]
pub(crate) struct Worlds {
    pub(crate) world: Vec<DMat4>,
    /// Nodes, each with its parent; parents come first.
    pub(super) order: Vec<(u32, Option<u32>)>,
}

/// A mesh shown by a node.
#[derive(Clone, Debug)]
pub(crate) struct Instance {
    /// Node that shows the mesh; `None` in a file without nodes.
    pub(crate) node: Option<u32>,
    pub(crate) mesh: u32,
    pub(crate) skin: Option<u32>,
    /// Transform from mesh space to world space.
    pub(crate) world: DMat4,
}

impl Worlds {
    /// Computes the world transforms of all nodes.
    ///
    /// # Errors
    /// If an index is out of range, a node has two parents, there is a cycle, or a transform is not finite.
    pub(crate) fn new(root: &Root) -> Result<Self, GltfError> {
        let n = root.nodes.len();
        let mut parent = vec![None; n];
        for (node, children) in
            root.nodes.iter().enumerate().filter_map(|(i, n)| Some((i, n.children.as_ref()?)))
        {
            for child in children {
                get(&root.nodes, child.value(), "child node", || format!("node {node}"))?;
                let place = &mut parent[child.value()];
                if place.is_some() {
                    return Err(GltfError::Node {
                        node: child.value() as u32,
                        problem: "has two parents: the nodes must be a tree",
                    });
                }
                *place = Some(node as u32);
            }
        }
        let mut world = vec![DMat4::IDENTITY; n];
        let mut reached = vec![false; n];
        let mut order = Vec::with_capacity(n);
        let mut stack: Vec<usize> = (0..n).filter(|&i| parent[i].is_none()).collect();
        while let Some(node) = stack.pop() {
            let above = parent[node].map_or(DMat4::IDENTITY, |p| world[p as usize]);
            world[node] = above * local(&root.nodes[node]);
            reached[node] = true;
            order.push((node as u32, parent[node]));
            if !world[node].is_finite() {
                return Err(GltfError::Node {
                    node: node as u32,
                    problem: "has a transform that is not finite",
                });
            }
            stack.extend(root.nodes[node].children.iter().flatten().map(::gltf::json::Index::value));
        }
        match reached.iter().position(|&r| !r) {
            Some(node) => Err(GltfError::Node {
                node: node as u32,
                problem: "is its own ancestor: the nodes must be a tree",
            }),
            None => Ok(Self { world, order }),
        }
    }

    /// Marks in `nodes` the descendants of marked nodes. `[n_nodes]`
    pub(super) fn mark_below(&self, nodes: &mut [bool]) {
        for &(node, parent) in &self.order {
            nodes[node as usize] |= parent.is_some_and(|p| nodes[p as usize]);
        }
    }
}

pub(super) fn local(node: &Node) -> DMat4 {
    if let Some(m) = node.matrix {
        return Mat4::from_cols_array(&m).as_dmat4();
    }
    let vec = |v: Option<[f32; 3]>, default| v.map_or(default, |v| glam::Vec3::from_array(v).as_dvec3());
    let rotation = node.rotation.map_or(DQuat::IDENTITY, |r| {
        let q = DQuat::from_array(r.0.map(f64::from));
        if q.length_squared() > 0.0 { q.normalize() } else { DQuat::IDENTITY }
    });
    DMat4::from_scale_rotation_translation(
        vec(node.scale, DVec3::ONE),
        rotation,
        vec(node.translation, DVec3::ZERO),
    )
}

/// Lists the mesh instances inside and outside the default scene, each ordered by mesh, then node. If the scene has no
/// mesh, all instances are used.
///
/// For files that show each mesh once, this is the order of the primitives in the file, which other programs also use.
pub(crate) fn instances(
    root: &Root,
    worlds: &Worlds,
    notices: &mut Vec<String>,
) -> Result<[Vec<Instance>; 2], GltfError> {
    for (s, scene) in root.scenes.iter().enumerate() {
        for node in &scene.nodes {
            get(&root.nodes, node.value(), "node", || format!("scene {s}"))?;
        }
    }
    if root.nodes.is_empty() {
        let all = 0..root.meshes.len() as u32;
        let whole = |mesh| Instance { node: None, mesh, skin: None, world: DMat4::IDENTITY };
        return Ok([all.map(whole).collect(), Vec::new()]);
    }
    let mut in_scene = vec![root.scenes.is_empty(); root.nodes.len()];
    let scene = root.scene.map_or(0, |s| s.value());
    if !root.scenes.is_empty() {
        for node in &get(&root.scenes, scene, "scene", || "the document".into())?.nodes {
            in_scene[node.value()] = true;
        }
        worlds.mark_below(&mut in_scene);
    }
    let mut shown = Vec::new();
    let mut elsewhere = Vec::new();
    for (i, node) in root.nodes.iter().enumerate() {
        let Some(mesh) = node.mesh else { continue };
        get(&root.meshes, mesh.value(), "mesh", || format!("node {i}"))?;
        if let Some(skin) = node.skin {
            get(&root.skins, skin.value(), "skin", || format!("node {i}"))?;
        }
        let instance = Instance {
            node: Some(i as u32),
            mesh: mesh.value() as u32,
            skin: node.skin.map(|s| s.value() as u32),
            world: worlds.world[i],
        };
        if in_scene[i] { shown.push(instance) } else { elsewhere.push(instance) }
    }
    if shown.is_empty() && !elsewhere.is_empty() {
        notices.push(format!("scene {scene} has no mesh: using the meshes of all nodes"));
        std::mem::swap(&mut shown, &mut elsewhere);
    }
    if !elsewhere.is_empty() {
        notices.push(format!(
            "{} not in scene {scene}: not shown",
            counted(elsewhere.len(), "node with a mesh is", "nodes with a mesh are")
        ));
    }
    // Sort arrays of integers: the wasm module contains the sort for this type anyway, so it does not grow.
    let key = |(k, i): (u32, &Instance)| [i.mesh, i.node.map_or(0, |node| node + 1), k];
    Ok([shown, elsewhere].map(|list| {
        let mut order: Vec<[u32; 3]> = (0u32..).zip(&list).map(key).collect();
        order.sort_unstable();
        order.into_iter().map(|[.., k]| list[k as usize].clone()).collect()
    }))
}

/// Counts the document's elements.
pub(crate) fn counts(document: &GltfDocument) -> Counts {
    let count = |key: &str| document.json[key].as_array().map_or(0, Vec::len);
    let targets = document.root.meshes.iter().map(|mesh| {
        mesh.primitives.iter().map(|p| p.targets.as_ref().map_or(0, Vec::len)).max().unwrap_or(0)
    });
    let joints: HashSet<usize> =
        document.root.skins.iter().flat_map(|skin| &skin.joints).map(::gltf::json::Index::value).collect();
    Counts {
        scenes: count("scenes"),
        nodes: count("nodes"),
        meshes: count("meshes"),
        primitives: document.slots.len(),
        materials: count("materials"),
        textures: count("textures"),
        skins: count("skins"),
        joints: joints.len(),
        animations: count("animations"),
        morph_targets: targets.sum(),
    }
}

/// Name of an object, or its kind and index if it is unnamed.
pub(crate) fn name_of(json: &Value, list: &str, index: u32, kind: &str) -> String {
    stored_name(json, list, index).map_or_else(|| format!("{kind} {index}"), str::to_owned)
}

/// Whether [`name_of`] the object is `name`. Compares without copying, because names can be megabytes long.
pub(crate) fn is_called(name: &str, json: &Value, list: &str, index: u32, kind: &str) -> bool {
    stored_name(json, list, index).map_or_else(|| name == format!("{kind} {index}"), |of| of == name)
}

fn stored_name<'a>(json: &'a Value, list: &str, index: u32) -> Option<&'a str> {
    json[list][index as usize]["name"].as_str()
}
