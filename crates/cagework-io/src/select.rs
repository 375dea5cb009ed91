//! Selects parts of a model by their names in the file.

use cagework_pose::parts::{Parts, pieces};
use thiserror::Error;

use crate::error::WriteError;
use crate::gltf::GltfError;
use crate::model::{Document, Model};
use crate::part_kind::PartKind;
use crate::shown::{MAX_NAME_CHARS, shown_start};

/// Largest number of names that an error message lists.
const MAX_LISTED_NAMES: usize = 20;

/// Error of selecting a part by name.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum SelectError {
    /// No part has this name.
    #[error("no part is called '{}'; the model has {}", name(asked), listed(names))]
    Unknown {
        /// Requested name.
        asked: String,
        /// Names of all parts, each with its kind.
        names: Vec<String>,
    },
    /// Parts of several kinds have this name.
    #[error("several parts are called '{}': write {}", name(asked), choices.join(" or "))]
    Ambiguous {
        /// Requested name.
        asked: String,
        /// Unambiguous names, with kinds.
        choices: Vec<String>,
    },
    /// The vertices of a part cannot be read.
    #[error(transparent)]
    Gltf(#[from] GltfError),
    /// The rig cannot be read.
    #[error(transparent)]
    Rig(#[from] WriteError),
}

fn name(text: &str) -> String {
    shown_start(text, MAX_NAME_CHARS)
}

fn listed(names: &[String]) -> String {
    if names.is_empty() {
        return "no named parts".into();
    }
    let mut text = names.iter().take(MAX_LISTED_NAMES).map(|n| name(n)).collect::<Vec<_>>().join(", ");
    if names.len() > MAX_LISTED_NAMES {
        text += &format!(" and {} more", names.len() - MAX_LISTED_NAMES);
    }
    text
}

impl Model {
    /// Finds the vertices of the parts called `name`, ascending. `name` starts with a kind, as in `material:skin`,
    /// `node:Buckle`, `joint:Head` or `group:eyes`, or is unique without a kind.
    ///
    /// # Errors
    /// [`SelectError`], listing the available names.
    pub fn select(&self, name: &str) -> Result<Vec<u32>, SelectError> {
        let kinds = PartKind::ALL.into_iter();
        let prefixed =
            kinds.clone().find_map(|kind| Some((kind, name.strip_prefix(kind.word())?.strip_prefix(':')?)));
        let mut found = Vec::new();
        if let Some((kind, name)) = prefixed {
            found.push((kind, self.vertices_of(kind, name)?));
        }
        if found.iter().all(|(_, vertices)| vertices.is_empty()) {
            // A name may contain a colon: also search for the whole text, in all kinds.
            for kind in kinds {
                found.push((kind, self.vertices_of(kind, name)?));
            }
        }
        found.retain(|(_, vertices)| !vertices.is_empty());
        match found.len() {
            0 => Err(SelectError::Unknown { asked: name.to_owned(), names: self.part_names() }),
            1 => Ok(found.remove(0).1),
            _ => {
                let choices = found.iter().map(|(kind, _)| format!("'{}:{name}'", kind.word())).collect();
                Err(SelectError::Ambiguous { asked: name.to_owned(), choices })
            }
        }
    }

    /// Names for [`Self::select`], each with its kind.
    #[must_use]
    pub fn part_names(&self) -> Vec<String> {
        let names = match &self.document {
            Document::Polygons(document) => document.part_names(),
            Document::Gltf(document) => document.part_names(),
        };
        names.into_iter().map(|(kind, name)| format!("{}:{name}", kind.word())).collect()
    }

    /// Selects parts by name. `stay`: parts that stay in place, each with the share of its displacement that is
    /// suppressed, 0 to 1. `rigid`: parts whose connected pieces keep their shape.
    ///
    /// # Errors
    /// [`SelectError`] if a name selects nothing.
    pub fn parts(&self, stay: &[(String, f32)], rigid: &[String]) -> Result<Parts, SelectError> {
        let mut parts = Parts::default();
        for (name, amount) in stay {
            let vertices = self.select(name)?;
            parts.stays.resize(self.positions.len(), 0.0);
            for v in vertices {
                let stays = &mut parts.stays[v as usize];
                *stays = stays.max(*amount);
            }
        }
        let mut all = Vec::new();
        for name in rigid {
            all.extend(self.select(name)?);
        }
        parts.rigid = pieces(&self.positions, &self.triangles, &all);
        Ok(parts)
    }

    fn vertices_of(&self, kind: PartKind, name: &str) -> Result<Vec<u32>, GltfError> {
        let mut vertices = match &self.document {
            Document::Polygons(document) => document.vertices_of(kind, name),
            Document::Gltf(document) => document.vertices_of(kind, name)?,
        };
        vertices.sort_unstable();
        vertices.dedup();
        Ok(vertices)
    }
}
