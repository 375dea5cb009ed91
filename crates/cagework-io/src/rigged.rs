//! What rigged models have besides a shape.

use cagework_core::skin::skin_vertices;
use glam::{DVec3, Vec3};
use thiserror::Error;

use crate::error::WriteError;
use crate::gltf::{self, Clip, Named, Player, ReshapeOptions, ReshapeReport, Rig};
use crate::model::{Document, Model};
use crate::shown::shown;

/// Frames of a clip that a cage is made around.
const FRAMES: usize = 32;

/// There is no clip of a name.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("there is no clip '{}'; the model has {}", shown(asked), if names.is_empty() { "none".to_owned() } else { shown(&names.join(", ")) })]
pub struct NoClip {
    /// Name asked for.
    pub asked: String,
    /// Names there are.
    pub names: Vec<String>,
}

impl Model {
    /// Whether it has a skin or morph targets: what [`Self::write_glb`] leaves out and [`Self::write_reshaped`] keeps.
    #[must_use]
    pub fn is_rigged(&self) -> bool {
        matches!(&self.document, Document::Gltf(document) if Rig::is_needed(document))
    }

    /// Points that move besides the vertices when a rigged model is reshaped: ends of morph targets, joints, offsets of a VRM.
    /// They are bound after the vertices. Empty without a rig.
    ///
    /// # Errors
    /// [`WriteError`] when a part of the rig cannot be read.
    pub fn extra_points(&self) -> Result<Vec<Vec3>, WriteError> {
        let Document::Gltf(document) = &self.document else { return Ok(Vec::new()) };
        if !Rig::is_needed(document) {
            return Ok(Vec::new());
        }
        let extras = Rig::new(document, &self.positions_in_file())?.extras;
        let extras: Vec<Vec3> = extras.iter().map(|p| p.as_vec3()).collect();
        Ok(self.up.turned(&extras).into_owned())
    }

    /// The model with its skeleton, morph targets and clips, to be played; its vertices have the file's axes. None of a format
    /// without any.
    ///
    /// # Errors
    /// [`WriteError`] when a part of them cannot be read.
    pub fn player(&self) -> Result<Option<Player>, WriteError> {
        match &self.document {
            Document::Gltf(document) => Ok(Some(Player::new(document, document)?)),
            Document::Obj(_) => Ok(None),
        }
    }

    /// A player of an export of this model, with the vertices in this model's order.
    ///
    /// # Errors
    /// [`WriteError`] when it is none.
    pub fn player_of(&self, export: &[u8]) -> Result<Player, WriteError> {
        let wrong = |e: String| WriteError::Document(e);
        let read = Self::read("export.glb", export, &mut |_| None).map_err(|e| wrong(e.to_string()))?;
        match (&read.document, &self.document) {
            (Document::Gltf(of), Document::Gltf(like)) => Ok(Player::new(of, like)?),
            _ => Err(WriteError::NoRig),
        }
    }

    /// The animation clips of the file.
    #[must_use]
    pub fn clips(&self) -> Vec<Clip> {
        match &self.document {
            Document::Gltf(document) => gltf::clips(document),
            Document::Obj(_) => Vec::new(),
        }
    }

    /// A rigged model reshaped, with its skeleton, morph targets and animations; or, with `poses`, the model at rest with a
    /// morph target more for each.
    ///
    /// `by`: how far each vertex, then each of [`Self::extra_points`], moves. `outside`: those of them outside the cage.
    ///
    /// # Errors
    /// [`WriteError`] when there is not one finite displacement for each point, or the document cannot be written.
    pub fn write_reshaped(
        &self,
        by: &[DVec3],
        outside: &[u32],
        poses: &[(String, Vec<DVec3>)],
        options: &ReshapeOptions,
    ) -> Result<(Vec<u8>, ReshapeReport), WriteError> {
        let Document::Gltf(document) = &self.document else { return Err(WriteError::NoRig) };
        let rig = Rig::new(document, &self.positions_in_file())?;
        let n = self.positions.len() + rig.extras.len();
        let turned = |by: &[DVec3]| -> Result<Vec<DVec3>, WriteError> {
            if by.len() != n {
                return Err(WriteError::Count { given: by.len(), expected: n });
            }
            if let Some(vertex) = by.iter().position(|by| !by.is_finite()) {
                return Err(WriteError::NotFinite { vertex });
            }
            Ok(by.iter().map(|&by| self.up.vector_turned_back(by)).collect())
        };
        let by = turned(by)?;
        let by_poses = poses.iter().map(|(_, by)| turned(by)).collect::<Result<Vec<_>, _>>()?;
        let poses: Vec<Named<'_>> =
            poses.iter().zip(&by_poses).map(|((name, _), by)| Named { name, by }).collect();
        let mut is_outside = vec![false; n];
        for &point in outside {
            if let Some(is_outside) = is_outside.get_mut(point as usize) {
                *is_outside = true;
            }
        }
        let up = self.up.vector_turned_back(DVec3::Y);
        gltf::reshape(document, &rig, &self.triangles, (&by, &is_outside), &poses, (options, up))
    }

    /// The vertices at rest, those that morph targets move with each target at 1, and frames of a clip: what a cage should
    /// enclose.
    ///
    /// # Errors
    /// [`NoClip`]; the rig's own faults only leave it at the rest shape.
    pub fn states(&self, clip: Option<&str>) -> Result<(Vec<Vec3>, Vec<[u32; 3]>), NoClip> {
        let (mut positions, mut triangles) = (self.positions.clone(), self.triangles.clone());
        let player = self.player().ok().flatten().filter(|_| self.is_rigged() || clip.is_some());
        let no_clip = |names| clip.map_or(Ok(()), |asked| Err(NoClip { asked: asked.to_owned(), names }));
        let Some(player) = player else {
            no_clip(Vec::new())?;
            return Ok((positions, triangles));
        };
        let shown_at = |clip, seconds, targets: &[f32]| {
            let posed = player.at(clip, seconds, targets);
            let at = skin_vertices(&player.skin, &posed.palette, &posed.targets);
            self.up().turned(&at).into_owned()
        };
        let (_, defaults) = player.targets();
        for k in 0..defaults.len() {
            let mut targets = defaults.to_vec();
            targets[k] = 1.0;
            let at = shown_at(None, 0.0, &targets);
            let moved = at.iter().zip(&self.positions).filter(|(p, rest)| p.is_finite() && p != rest);
            positions.extend(moved.map(|(p, _)| *p));
        }
        let Some(asked) = clip else { return Ok((positions, triangles)) };
        let clips = player.clips();
        let Some(number) = clips.iter().position(|c| c.name.as_deref() == Some(asked)) else {
            no_clip(clips.iter().filter_map(|c| c.name.clone()).collect())?;
            return Ok((positions, triangles));
        };
        for frame in 0..FRAMES {
            let seconds = clips[number].seconds * frame as f32 / (FRAMES - 1) as f32;
            let at = shown_at(Some(number), seconds, &[]);
            if at.iter().all(|p| p.is_finite()) {
                let first = positions.len() as u32;
                triangles.extend(self.triangles.iter().map(|t| t.map(|v| first + v)));
                positions.extend(at);
            }
        }
        Ok((positions, triangles))
    }
}
