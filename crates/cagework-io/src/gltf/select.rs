//! Finds the vertices of materials, nodes and joints by name.

use std::collections::HashSet;

use super::scene::{Worlds, is_called, name_of};
use super::skin::each_influence;
use super::{GltfDocument, GltfError, Slot};
use crate::part_kind::PartKind;

impl GltfDocument {
    /// Lists the names of the materials, nodes and joints that have vertices.
    pub(crate) fn part_names(&self) -> Vec<(PartKind, String)> {
        let (mut names, mut seen, mut known) = (Vec::new(), HashSet::new(), HashSet::new());
        let mut add = |kind: PartKind, list, number: usize| {
            if !known.insert((kind as u8, number)) {
                return;
            }
            let named = (kind, name_of(&self.json, list, number as u32, kind.word()));
            if seen.insert(named.clone()) {
                names.push(named);
            }
        };
        for slot in &self.slots {
            let (instance, primitive) = self.primitive(slot);
            if let Some(material) = primitive.material {
                add(PartKind::Material, "materials", material.value());
            }
            if let Some(node) = instance.node {
                add(PartKind::Node, "nodes", node as usize);
            }
            let joints = instance.skin.map(|skin| &self.root.skins[skin as usize].joints);
            joints.into_iter().flatten().for_each(|joint| add(PartKind::Joint, "nodes", joint.value()));
        }
        names.sort_by_key(|(kind, _)| *kind as u8);
        names
    }

    /// Finds the vertices of all parts of this kind and name, unsorted.
    pub(crate) fn vertices_of(&self, kind: PartKind, name: &str) -> Result<Vec<u32>, GltfError> {
        let named = |list: &str, number: u32| is_called(name, &self.json, list, number, kind.word());
        let of_slot = |slot: &Slot| slot.start..slot.start + slot.count;
        match kind {
            PartKind::Group => Ok(Vec::new()),
            PartKind::Material => {
                let is_of = |slot: &&Slot| {
                    self.primitive(slot).1.material.is_some_and(|m| named("materials", m.value() as u32))
                };
                Ok(self.slots.iter().filter(is_of).flat_map(of_slot).collect())
            }
            PartKind::Node => {
                let n = self.root.nodes.len() as u32;
                let mut is_of: Vec<bool> = (0..n).map(|node| named("nodes", node)).collect();
                if is_of.contains(&true) {
                    Worlds::new(&self.root)?.mark_below(&mut is_of);
                }
                let is_of =
                    |slot: &&Slot| self.primitive(slot).0.node.is_some_and(|node| is_of[node as usize]);
                Ok(self.slots.iter().filter(is_of).flat_map(of_slot).collect())
            }
            PartKind::Joint => {
                let mut all = Vec::new();
                for slot in &self.slots {
                    let (instance, primitive) = self.primitive(slot);
                    let Some(skin) = instance.skin else { continue };
                    let joints = &self.root.skins[skin as usize].joints;
                    let is_of: Vec<bool> = joints.iter().map(|j| named("nodes", j.value() as u32)).collect();
                    if !is_of.contains(&true) {
                        continue;
                    }
                    let mut largest = vec![(0.0, false); slot.count as usize];
                    each_influence(self.source(), primitive, largest.len(), |v, joint, weight| {
                        if weight > largest[v].0 {
                            largest[v] = (weight, is_of.get(joint as usize) == Some(&true));
                        }
                    })?;
                    all.extend(of_slot(slot).zip(&largest).filter(|(_, l)| l.1).map(|(v, _)| v));
                }
                Ok(all)
            }
        }
    }
}
