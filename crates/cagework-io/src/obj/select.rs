//! Finds the vertices of an OBJ's materials, objects and groups by name.

use std::collections::HashSet;

use super::read::PolygonDocument;
use crate::part_kind::PartKind;

impl PolygonDocument {
    /// Lists the distinct names of materials, objects and groups.
    pub(crate) fn part_names(&self) -> Vec<(PartKind, String)> {
        let materials = self.materials.iter().map(|name| (PartKind::Material, name.clone()));
        let mut seen = HashSet::new();
        let groups = self.groups.iter().filter(|group| seen.insert(group.name.as_str()));
        materials.chain(groups.map(|group| (PartKind::Group, group.name.clone()))).collect()
    }

    /// Finds the vertices of all parts of this kind and name, unsorted and with duplicates.
    pub(crate) fn vertices_of(&self, kind: PartKind, name: &str) -> Vec<u32> {
        let n_faces = self.face_materials.len();
        let mut is_of = vec![false; n_faces];
        match kind {
            PartKind::Material => {
                let material = self.materials.iter().position(|m| m == name).map(|m| m as u32);
                is_of.iter_mut().zip(&self.face_materials).for_each(|(is, m)| *is = Some(*m) == material);
            }
            PartKind::Group => {
                for (k, group) in self.groups.iter().enumerate().filter(|(_, group)| group.is_called(name)) {
                    let next = self.groups[k + 1..].iter().find(|g| g.is_object == group.is_object);
                    let end = next.map_or(n_faces, |g| g.first_face as usize);
                    is_of[group.first_face as usize..end].fill(true);
                }
            }
            PartKind::Node | PartKind::Joint => {}
        }
        let corners = |face: usize| self.face_starts[face] as usize..self.face_starts[face + 1] as usize;
        let faces = (0..n_faces).filter(|&face| is_of[face]);
        faces.flat_map(|face| self.corners[corners(face)].iter().map(|c| c.v)).collect()
    }
}
