//! The tree of nodes.

use cagework_core::words::counted;
use glam::{DQuat, DVec3, Quat, Vec3};
use serde_json::{Map, Value, json};
use ufbx::{Node, Scene, Transform};

use crate::document::Document;
use crate::limits::FbxError;

/// Nodes of the document, in the order of the FBX file without its root, followed by additional nodes.
pub(crate) struct Nodes {
    items: Vec<Map<String, Value>>,
    children: Vec<Vec<usize>>,
    /// Nodes without a parent.
    roots: Vec<usize>,
    /// Local transforms at rest. `[n_nodes]`
    pub(crate) rest: Vec<Rest>,
    /// Joints of each skin.
    skins: Vec<Vec<usize>>,
    /// Number of each FBX node, by its index in the scene; `None` for the root, until a joint needs it.
    numbers: Vec<Option<usize>>,
}

/// Translation, rotation and scale of a node.
#[derive(Clone, Copy)]
pub(crate) struct Rest {
    pub(crate) translation: Vec3,
    pub(crate) rotation: Quat,
    pub(crate) scale: Vec3,
}

/// Name of an additional node at the world origin.
const ROOT: &str = "root";
const IDENTITY: Rest = Rest { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::ONE };

impl Nodes {
    pub(crate) fn new(scene: &Scene, notices: &mut Vec<String>) -> Self {
        let mut numbers: Vec<Option<usize>> = Vec::with_capacity(scene.nodes.len());
        let mut next = 0;
        for node in &scene.nodes {
            numbers.push((!node.is_root).then_some(next));
            next += usize::from(!node.is_root);
        }
        let mut nodes = Self {
            items: Vec::new(),
            children: Vec::new(),
            roots: Vec::new(),
            rest: Vec::new(),
            skins: Vec::new(),
            numbers,
        };
        let mut n_faults = 0;
        for node in scene.nodes.iter().filter(|node| !node.is_root) {
            let rest = Rest::of(&node.local_transform);
            n_faults += usize::from(rest.is_none());
            let children = node.children.iter().filter_map(|child| nodes.number(child)).collect();
            // A node that ufbx adds for a scale has no name. It takes the place of its parent as a joint.
            let parent = node.parent.as_ref().filter(|_| node.is_scale_helper);
            let name = parent.map_or(&node.element.name, |parent| &parent.element.name);
            nodes.add(name, rest.unwrap_or(IDENTITY), children);
        }
        let of_root = scene.root_node.children.iter();
        nodes.roots = of_root.filter_map(|child| nodes.number(child)).collect();
        if n_faults > 0 {
            notices.push(format!(
                "{} not finite: placed at the origin of the parent",
                counted(n_faults, "transform of a node is", "transforms of nodes are")
            ));
        }
        nodes
    }

    fn add(&mut self, name: &str, rest: Rest, children: Vec<usize>) -> usize {
        let mut item = Map::new();
        item.insert("name".into(), name.into());
        rest.store(&mut item);
        self.items.push(item);
        self.children.push(children);
        self.rest.push(rest);
        self.items.len() - 1
    }

    /// Replaces the transform of a node at rest; returns the previous one.
    pub(crate) fn set_rest(&mut self, number: usize, rest: Rest) -> Rest {
        rest.store(&mut self.items[number]);
        std::mem::replace(&mut self.rest[number], rest)
    }

    /// All nodes with their parents, parents first.
    pub(crate) fn parents_first(&self) -> Vec<(usize, Option<usize>)> {
        let mut order: Vec<(usize, Option<usize>)> = self.roots.iter().map(|&root| (root, None)).collect();
        let mut next = 0;
        while let Some(&(node, _)) = order.get(next) {
            order.extend(self.children[node].iter().map(|&child| (child, Some(node))));
            next += 1;
        }
        order
    }

    /// Number of an FBX node; `None` for the root.
    pub(crate) fn number(&self, node: &Node) -> Option<usize> {
        self.numbers.get(node.element.typed_id as usize).copied().flatten()
    }

    /// Number of an FBX node that is a joint. The root gets a node.
    pub(crate) fn joint(&mut self, node: &Node) -> usize {
        if let Some(number) = self.number(node) {
            return number;
        }
        let number = self.add(ROOT, IDENTITY, Vec::new());
        self.roots.push(number);
        if let Some(place) = self.numbers.get_mut(node.element.typed_id as usize) {
            *place = Some(number);
        }
        number
    }

    /// Adds a node at the place of another one. glTF lists a joint of a skin only once.
    pub(crate) fn copy_of(&mut self, number: usize) -> usize {
        let name = self.items[number]["name"].as_str().unwrap_or_default().to_owned();
        let copy = self.add(&name, IDENTITY, Vec::new());
        self.children[number].push(copy);
        copy
    }

    /// Stores the joints of a skin, which must have a common ancestor.
    pub(crate) fn add_skin(&mut self, joints: &[usize]) {
        self.skins.push(joints.to_vec());
    }

    /// Whether the joints of a skin are below several nodes without a parent.
    fn has_split_skin(&self) -> bool {
        let mut root = vec![None; self.items.len()];
        let mut stack: Vec<(usize, usize)> = self.roots.iter().map(|&node| (node, node)).collect();
        while let Some((node, top)) = stack.pop() {
            root[node] = Some(top);
            stack.extend(self.children[node].iter().map(|&child| (child, top)));
        }
        let is_split = |joints: &Vec<usize>| joints.iter().any(|&joint| root[joint] != root[joints[0]]);
        self.skins.iter().any(is_split)
    }

    /// Sets a member of a node.
    pub(crate) fn set(&mut self, number: usize, member: &str, value: Value) {
        self.items[number].insert(member.into(), value);
    }

    /// Writes nodes and scene.
    pub(crate) fn finish(mut self, document: &mut Document) -> Result<(), FbxError> {
        if self.has_split_skin() {
            let all = std::mem::take(&mut self.roots);
            self.roots = vec![self.add(ROOT, IDENTITY, all)];
        }
        for (mut item, children) in self.items.into_iter().zip(self.children) {
            if !children.is_empty() {
                item.insert("children".into(), json!(children));
            }
            document.push("nodes", item.into())?;
        }
        let scene = if self.roots.is_empty() { json!({}) } else { json!({ "nodes": self.roots }) };
        document.push("scenes", scene)?;
        Ok(())
    }
}

impl Rest {
    /// `None` unless all numbers are finite.
    pub(crate) fn of(transform: &Transform) -> Option<Self> {
        let rest = Self {
            translation: vector(transform.translation),
            rotation: rotation(transform.rotation),
            scale: vector(transform.scale),
        };
        let Self { translation, rotation, scale } = rest;
        (translation.is_finite() && rotation.is_finite() && scale.is_finite()).then_some(rest)
    }

    /// Sets the transform of a node. What glTF takes for granted is left out.
    fn store(&self, item: &mut Map<String, Value>) {
        let Self { translation, rotation, scale } = *self;
        let members = [
            ("translation", json!(translation.to_array()), translation == Vec3::ZERO),
            ("rotation", json!(rotation.to_array()), rotation == Quat::IDENTITY),
            ("scale", json!(scale.to_array()), scale == Vec3::ONE),
        ];
        for (name, value, is_default) in members {
            item.remove(name);
            if !is_default {
                item.insert(name.into(), value);
            }
        }
    }

    pub(crate) fn transform(&self) -> Transform {
        let Self { translation, rotation, scale } = *self;
        let three = |v: Vec3| ufbx::Vec3 { x: v.x.into(), y: v.y.into(), z: v.z.into() };
        let [x, y, z, w] = rotation.to_array().map(f64::from);
        Transform {
            translation: three(translation),
            rotation: ufbx::Quat { x, y, z, w },
            scale: three(scale),
        }
    }
}

pub(crate) fn vector(v: ufbx::Vec3) -> Vec3 {
    DVec3::new(v.x, v.y, v.z).as_vec3()
}

/// A unit quaternion; the identity for a quaternion without length.
pub(crate) fn rotation(q: ufbx::Quat) -> Quat {
    let q = DQuat::from_xyzw(q.x, q.y, q.z, q.w);
    if q.length_squared() > 0.0 { q.normalize().as_quat() } else { Quat::IDENTITY }
}
