//! Evaluation of animation clips for playback.

use std::collections::HashMap;

use cagework_core::skin::Skin;
use glam::{DMat4, DVec3, Mat4, Vec3};

use super::clip::{Clip, clips};
use super::skeleton::bare;
use super::tree::NodeTree;
use crate::gltf::channels::ChannelTarget;
use crate::gltf::geometry::{attribute, vectors};
use crate::gltf::target_names::target_names;
use crate::gltf::{GltfDocument, GltfError, Slot, skin};
use crate::origin::relative;
use ::gltf::json::mesh::Semantic;

/// Plays the clips of a model.
#[derive(Clone, Debug)]
pub struct Player {
    /// Vertices of the model with their joint weights and morph deltas.
    pub skin: Skin,
    clips: Vec<Clip>,
    tree: NodeTree,
    /// Names of the nodes without their namespaces. `[n_nodes]`
    node_names: Vec<Option<String>>,
    /// Node and inverse bind matrix of each entry of the palette.
    pub(super) palette: Vec<(Option<u32>, DMat4)>,
    /// Default weights of all morph targets. `of_nodes` and `of_meshes` give the index of the first target of a node or
    /// mesh that a clip animates; a mesh has one entry for each of its instances.
    defaults: Vec<f32>,
    of_nodes: HashMap<usize, usize>,
    of_meshes: HashMap<usize, Vec<usize>>,
    names: Vec<String>,
    /// Point in world space to which the model's positions are relative.
    origin: DVec3,
}

/// Input of skinning at one time of a clip.
#[derive(Clone, Debug, PartialEq)]
pub struct RigPose {
    /// Transforms from mesh space to world space relative to the model's origin. `[n_palette]`
    pub palette: Vec<Mat4>,
    /// Weights of the morph targets. `[n_targets]`
    pub targets: Vec<f32>,
    /// Positions of the nodes, world space relative to the model's origin. `[n_nodes]`
    pub origins: Vec<Vec3>,
}

impl Player {
    /// Creates a player of `document`. `like`: document that defines the vertex order, either `document` itself or the
    /// original from which it was exported.
    pub(crate) fn new(
        document: &GltfDocument,
        like: &GltfDocument,
        origin: DVec3,
    ) -> Result<Self, GltfError> {
        let mut player = Self {
            skin: Skin { joint_starts: vec![0], delta_starts: vec![0], ..Skin::default() },
            clips: clips(document),
            tree: NodeTree::new(document)?,
            node_names: (0..document.root.nodes.len())
                .map(|node| Some(bare(document.json["nodes"][node]["name"].as_str()?).to_owned()))
                .collect(),
            palette: Vec::new(),
            defaults: Vec::new(),
            of_nodes: HashMap::new(),
            of_meshes: HashMap::new(),
            names: Vec::new(),
            origin,
        };
        let mut of_skins: HashMap<u32, usize> = HashMap::new();
        let mut first_targets = Vec::new();
        for instance in &document.instances {
            let mesh = instance.mesh as usize;
            let primitives = &document.root.meshes[mesh].primitives;
            let n = primitives.iter().map(|p| p.targets.as_ref().map_or(0, Vec::len)).max().unwrap_or(0);
            let first = player.defaults.len();
            first_targets.push(first);
            instance.node.map(|node| player.of_nodes.insert(node as usize, first));
            player.of_meshes.entry(mesh).or_default().push(first);
            let defaults = document.default_weights(instance);
            player.defaults.extend((0..n).map(|k| defaults.and_then(|w| w.get(k)).copied().unwrap_or(0.0)));
            let named = target_names(&document.json["meshes"][mesh]);
            player.names.extend((0..n).map(|k| match named[k].as_str() {
                Some(name) => name.to_owned(),
                None => format!("target {k}"),
            }));
        }
        let place = |of: &GltfDocument, slot: &Slot| {
            Some((of.instances[slot.instance as usize].node?, slot.primitive))
        };
        let places: HashMap<(u32, u32), &Slot> =
            document.slots.iter().filter_map(|slot| Some((place(document, slot)?, slot))).collect();
        for (number, wanted) in like.slots.iter().enumerate() {
            // Slots are matched by node and primitive number, which exports preserve. Slots without a match, such as
            // the slots of meshes without nodes, are matched by their order in the file.
            let same = place(like, wanted).and_then(|place| places.get(&place).copied());
            let Some(slot) = same.or_else(|| document.slots.get(number)) else { continue };
            let (instance, primitive) = document.primitive(slot);
            let own = player.palette.len() as u32;
            // A mesh without a node is in world space.
            player.palette.push((instance.node, DMat4::IDENTITY));
            let first_joint = match instance.skin {
                None => 0,
                Some(number) => match of_skins.get(&number) {
                    Some(&first) => first,
                    None => {
                        let first = player.palette.len();
                        let binds = skin::inverse_binds(document, number)?;
                        let joints = document.root.skins[number as usize].joints.iter().zip(binds);
                        player.palette.extend(joints.map(|(j, bind)| (Some(j.value() as u32), bind)));
                        of_skins.insert(number, first);
                        first
                    }
                },
            };
            let Some(accessor) = attribute(primitive, Semantic::Positions) else { continue };
            let local = vectors(document, accessor, "POSITION")?;
            let mut joints = vec![Vec::new(); local.len()];
            if instance.skin.is_some() {
                skin::each_influence(document.source(), primitive, local.len(), |v, joint, weight| {
                    joints[v].push((first_joint as u32 + joint, weight));
                })?;
            }
            let mut deltas = vec![Vec::new(); local.len()];
            for (k, target) in primitive.targets.iter().flatten().enumerate() {
                let Some(accessor) = target.positions else { continue };
                let number = (first_targets[slot.instance as usize] + k) as u32;
                let all = vectors(document, accessor.value() as u32, "POSITION")?;
                for (of_vertex, delta) in deltas.iter_mut().zip(all) {
                    if delta != DVec3::ZERO {
                        of_vertex.push((number, delta.as_vec3()));
                    }
                }
            }
            let Skin { positions, joint_starts, joints: all_joints, delta_starts, deltas: all_deltas } =
                &mut player.skin;
            for ((position, joints), deltas) in local.iter().zip(joints).zip(deltas) {
                positions.push(position.as_vec3());
                let total: f64 = joints.iter().map(|(_, weight)| weight).sum();
                if total > 0.0 {
                    all_joints.extend(joints.iter().map(|&(j, weight)| (j, (weight / total) as f32)));
                } else {
                    all_joints.push((own, 1.0));
                }
                joint_starts.push(all_joints.len() as u32);
                all_deltas.extend(deltas);
                delta_starts.push(all_deltas.len() as u32);
            }
        }
        Ok(player)
    }

    /// Node of each entry of the palette; `None` for a mesh without a node.
    pub(crate) fn palette_nodes(&self) -> Vec<Option<u32>> {
        self.palette.iter().map(|&(node, _)| node).collect()
    }

    /// Animation clips of the file.
    #[must_use]
    pub fn clips(&self) -> &[Clip] {
        &self.clips
    }

    /// Names and default weights of the morph targets of all visible meshes. `[n_targets]`
    #[must_use]
    pub fn targets(&self) -> (&[String], &[f32]) {
        (&self.names, &self.defaults)
    }

    /// Evaluates a clip at a time in seconds; `None` is the rest pose. `targets`: weights of the morph targets that the
    /// clip does not animate, `[n_targets]`; empty for the file's defaults.
    #[must_use]
    pub fn pose_at(&self, clip: Option<usize>, seconds: f32, targets: &[f32]) -> RigPose {
        let clip = clip.and_then(|clip| self.clips.get(clip));
        self.with(clip.into_iter().flat_map(|clip| clip.at(seconds)), targets)
    }

    /// Like [`Self::pose_at`], for a clip of another file. It moves the nodes that have the same names.
    #[must_use]
    pub fn pose_at_clip_of(&self, other: &Self, clip: usize, seconds: f32, targets: &[f32]) -> RigPose {
        let own = |n: usize| {
            let name = other.node_names.get(n)?.as_ref()?;
            self.node_names.iter().position(|own| own.as_ref() == Some(name))
        };
        let values = other.clips.get(clip).into_iter().flat_map(|clip| clip.at(seconds));
        let named = values.filter_map(|(driven, value)| {
            let driven = match driven {
                ChannelTarget::Translation(n) => ChannelTarget::Translation(own(n)?),
                ChannelTarget::Rotation(n) => ChannelTarget::Rotation(own(n)?),
                ChannelTarget::Scale(n) => ChannelTarget::Scale(own(n)?),
                ChannelTarget::Weights(_) | ChannelTarget::MeshWeights(_) => return None,
            };
            Some((driven, value))
        });
        self.with(named, targets)
    }

    /// The pose with these values of animated properties.
    fn with(&self, values: impl Iterator<Item = (ChannelTarget, Vec<f64>)>, targets: &[f32]) -> RigPose {
        let values: Vec<_> = values.collect();
        let mut weights = if targets.is_empty() { self.defaults.clone() } else { targets.to_vec() };
        weights.resize(self.defaults.len(), 0.0);
        for (driven, value) in &values {
            let firsts = match driven {
                ChannelTarget::Weights(n) => self.of_nodes.get(n).map_or(&[][..], std::slice::from_ref),
                ChannelTarget::MeshWeights(n) => self.of_meshes.get(n).map_or(&[][..], Vec::as_slice),
                _ => &[],
            };
            for &first in firsts {
                weights.iter_mut().skip(first).zip(value).for_each(|(w, &value)| *w = value as f32);
            }
        }
        let world = self.tree.posed(&values).world;
        let seen = DMat4::from_translation(-self.origin);
        let matrix = |&(node, bind): &(Option<u32>, DMat4)| {
            (seen * node.map_or(DMat4::IDENTITY, |n| world[n as usize] * bind)).as_mat4()
        };
        let origins = world.iter().map(|w| relative(w.w_axis.truncate(), self.origin)).collect();
        RigPose { palette: self.palette.iter().map(matrix).collect(), targets: weights, origins }
    }
}
