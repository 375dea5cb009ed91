//! Parts of a model by the names that its file gives them.

use cagework_core::deform::deform_bound;
use cagework_core::{Frames, Weights};
use cagework_pose::parts::{Parts, pieces};
use glam::Vec3;
use thiserror::Error;

use crate::error::WriteError;
use crate::gltf::GltfError;
use crate::model::{Document, Model};
use crate::part_kind::PartKind;
use crate::shown::{MAX_NAME_CHARS, shown_start};

/// Names that an error lists.
const LISTED: usize = 20;

/// Why a name selects nothing.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum SelectError {
    /// Nothing is called so.
    #[error("no part is called '{}'; there are {}", name(asked), listed(names))]
    Unknown {
        /// Name asked for.
        asked: String,
        /// Names there are, each with its kind.
        names: Vec<String>,
    },
    /// Things of several kinds are.
    #[error("several parts are called '{}': write {}", name(asked), choices.join(" or "))]
    Ambiguous {
        /// Name asked for.
        asked: String,
        /// What may be meant.
        choices: Vec<String>,
    },
    /// Vertices of a part cannot be read.
    #[error(transparent)]
    Gltf(#[from] GltfError),
    /// Its rig cannot be.
    #[error(transparent)]
    Rig(#[from] WriteError),
}

fn name(text: &str) -> String {
    shown_start(text, MAX_NAME_CHARS)
}

fn listed(names: &[String]) -> String {
    if names.is_empty() {
        return "none: the file names no part".into();
    }
    let mut text = names.iter().take(LISTED).map(|n| name(n)).collect::<Vec<_>>().join(", ");
    if names.len() > LISTED {
        text += &format!(" and {} more", names.len() - LISTED);
    }
    text
}

impl Model {
    /// Where the vertices go with a posed cage, and `parts` as they are held; exactly where they are if no control has moved, which
    /// sums of weighted controls are not.
    ///
    /// `weights`, `frames` of the vertices; `rest`, `posed`: `[n_controls]`, object units. Returns `[n_vertices]`.
    ///
    /// # Panics
    /// As [`deform_bound`].
    #[must_use]
    pub fn deformed(
        &self,
        (weights, frames): (&Weights, &Frames),
        (rest, posed): (&[Vec3], &[Vec3]),
        parts: &Parts,
    ) -> Vec<Vec3> {
        if posed == rest {
            return self.positions.clone();
        }
        let deformed = deform_bound(weights, frames, posed);
        if parts.is_empty() { deformed } else { parts.hold(&self.positions, &deformed) }
    }

    /// Vertices of what the file calls `name`, ascending: `material:skin`, `node:Buckle`, `joint:Head`, `group:eyes`, or the name
    /// alone where only one kind of thing is called so.
    ///
    /// # Errors
    /// [`SelectError`], with the names there are.
    pub fn select(&self, name: &str) -> Result<Vec<u32>, SelectError> {
        let kinds = PartKind::ALL.into_iter();
        let prefixed =
            kinds.clone().find_map(|kind| Some((kind, name.strip_prefix(kind.word())?.strip_prefix(':')?)));
        let mut found = Vec::new();
        if let Some((kind, name)) = prefixed {
            found.push((kind, self.vertices_of(kind, name)?));
        }
        if found.iter().all(|(_, vertices)| vertices.is_empty()) {
            // Names may have colons of their own.
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

    /// Names that [`Self::select`] takes, each with its kind.
    #[must_use]
    pub fn part_names(&self) -> Vec<String> {
        let names = match &self.document {
            Document::Obj(document) => document.part_names(),
            Document::Gltf(document) => document.part_names(),
        };
        names.into_iter().map(|(kind, name)| format!("{}:{name}", kind.word())).collect()
    }

    /// What the cage does not bend, by the names of what stays, with how much of it, and of what keeps its shape, piece by piece.
    ///
    /// # Errors
    /// [`SelectError`]
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
            Document::Obj(document) => document.vertices_of(kind, name),
            Document::Gltf(document) => document.vertices_of(kind, name)?,
        };
        vertices.sort_unstable();
        vertices.dedup();
        Ok(vertices)
    }
}
