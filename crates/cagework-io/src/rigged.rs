//! What rigged models have besides a shape.

use cagework_core::skin::skin_vertices;
use glam::{DVec3, Vec3};
use thiserror::Error;

use crate::error::WriteError;
use crate::gltf::{self, Clip, JointPoint, Named, Played, Player, ReshapeOptions, ReshapeReport, Rig};
use crate::model::{Document, Model};
use crate::origin::relative;
use crate::shown::shown;

/// Most frames of a clip that a cage is made around, and most vertices of all of them: fewer frames of a large model.
const FRAMES: usize = 32;
const MOST_FRAME_VERTICES: usize = 1 << 24;

/// Frames of a clip that are baked: for each second, and at most; engines struggle with more morph targets.
const BAKED_PER_SECOND: f32 = 30.0;
const MOST_BAKED: f32 = 60.0;
/// Bytes of all frames of a baked clip.
const MOST_BAKED_BYTES: u64 = 512 << 20;

/// There is no clip of a name.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("there is no clip '{}'; the model has {}", shown(asked), if names.is_empty() { "none".to_owned() } else { shown(&names.join(", ")) })]
pub struct NoClip {
    /// Name asked for.
    pub asked: String,
    /// Names there are.
    pub names: Vec<String>,
}

impl Clip {
    /// The number of the first clip of a name. One without a name of its own is called by its number, "clip 0".
    ///
    /// # Errors
    /// [`NoClip`].
    pub fn named(clips: &[Self], name: &str) -> Result<usize, NoClip> {
        let own = clips.iter().position(|clip| clip.name.as_deref() == Some(name));
        let names: Vec<String> = clips.iter().enumerate().map(|(k, clip)| clip.label(k)).collect();
        let found = own.or_else(|| names.iter().position(|label| label == name));
        found.ok_or_else(|| NoClip { asked: name.to_owned(), names })
    }

    /// What the clip with a number is called: its name, or its number if it has none.
    #[must_use]
    pub fn label(&self, number: usize) -> String {
        self.name.clone().filter(|name| !name.is_empty()).unwrap_or_else(|| format!("clip {number}"))
    }
}

impl Model {
    /// Whether it has skins, morph targets or nodes that follow the cage: what [`Self::write_glb`] leaves out or as it is, and
    /// [`Self::write_reshaped`] brings to the new shape.
    #[must_use]
    pub fn is_rigged(&self) -> bool {
        matches!(&self.document, Document::Gltf(document) if Rig::is_needed(document))
    }

    /// Points that move besides the vertices when a rigged model is reshaped: ends of morph targets, joints and other nodes that
    /// follow, offsets of a VRM.
    /// They are bound after the vertices. Empty without a rig.
    ///
    /// # Errors
    /// [`WriteError`] when a part of the rig cannot be read.
    pub fn extra_points(&self) -> Result<Vec<Vec3>, WriteError> {
        let bound = self.rig()?.map_or_else(Vec::new, |rig| rig.bound());
        let extras: Vec<Vec3> = bound.iter().map(|&p| relative(p, self.origin)).collect();
        Ok(self.up.turned(&extras).into_owned())
    }

    /// Joints and nodes below them: what a picture shows of the skeleton.
    ///
    /// # Errors
    /// [`WriteError`] when a part of the rig cannot be read.
    pub fn joints(&self) -> Result<Vec<JointPoint>, WriteError> {
        Ok(self.rig()?.map_or_else(Vec::new, |rig| rig.joints()))
    }

    /// Names of what hangs on joints, or on nodes that clips move, without a skin and can be kept rigid: buckles, eyes, weapons.
    ///
    /// # Errors
    /// [`WriteError`] when a part of the rig cannot be read.
    pub fn props(&self) -> Result<Vec<String>, WriteError> {
        Ok(self.rig()?.map_or_else(Vec::new, |rig| rig.props()))
    }

    fn rig(&self) -> Result<Option<Rig<'_>>, WriteError> {
        match &self.document {
            Document::Gltf(document) if Rig::is_needed(document) => {
                Ok(Some(Rig::new(document, &self.positions_in_file(), self.origin)?))
            }
            _ => Ok(None),
        }
    }

    /// The model with its skeleton, morph targets and clips, to be played; its vertices have the file's axes and this model's
    /// [`Self::origin`]. None of a format
    /// without any.
    ///
    /// # Errors
    /// [`WriteError`] when a part of them cannot be read.
    pub fn player(&self) -> Result<Option<Player>, WriteError> {
        match &self.document {
            Document::Gltf(document) => Ok(Some(Player::new(document, document, self.origin)?)),
            Document::Obj(_) => Ok(None),
        }
    }

    /// A player of an export of this model, with the vertices in this model's order.
    ///
    /// # Errors
    /// [`WriteError`] when it is none.
    pub fn player_of(&self, export: &[u8]) -> Result<Player, WriteError> {
        let Document::Gltf(like) = &self.document else { return Err(WriteError::NoRig) };
        let read = gltf::read("export.glb", export, &mut |_| None, u64::MAX, Some(self.origin))?;
        Ok(Player::new(&read.document, like, self.origin)?)
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
        let rest = self.positions_in_file();
        let rig = Rig::new(document, &rest, self.origin)?;
        let n = self.positions.len() + rig.bound().len();
        let turned = |by: &[DVec3]| -> Result<Vec<DVec3>, WriteError> {
            if by.len() != n {
                return Err(WriteError::Count { given: by.len(), expected: n });
            }
            if let Some(vertex) = by.iter().position(|by| !by.is_finite()) {
                return Err(WriteError::NotFinite { vertex });
            }
            Ok(by.iter().map(|&by| self.up.vector_turned_back(by)).collect())
        };
        let all_moved = |by: &[DVec3]| Ok(rig.held(&options.parts, &rest, rig.all_moved(turned(by)?)));
        let by: Vec<DVec3> = all_moved(by)?;
        let by_poses = poses.iter().map(|(_, by)| all_moved(by)).collect::<Result<Vec<_>, WriteError>>()?;
        let poses: Vec<Named<'_>> =
            poses.iter().zip(&by_poses).map(|((name, _), by)| Named { name, by }).collect();
        let mut is_outside = vec![false; n];
        for &point in outside {
            if let Some(is_outside) = is_outside.get_mut(point as usize) {
                *is_outside = true;
            }
        }
        let is_outside = rig.all_outside(is_outside);
        let up = self.up.vector_turned_back(DVec3::Y);
        gltf::reshape(document, &rig, &self.triangles, (&by, &is_outside), &poses, (options, up))
    }

    /// The vertices at rest, those that morph targets move with each target at 0 and at 1, and frames of a clip: what a cage should
    /// enclose.
    ///
    /// # Errors
    /// [`NoClip`]; the rig's own faults only leave it at the rest shape.
    pub fn states(&self, clip: Option<&str>) -> Result<(Vec<Vec3>, Vec<[u32; 3]>), NoClip> {
        let (mut positions, mut triangles) = (self.positions.clone(), self.triangles.clone());
        if let Ok(Some(rig)) = self.rig() {
            let ends: Vec<Vec3> = rig.shown_ends().filter(|end| end.is_finite()).collect();
            positions.extend_from_slice(&self.up.turned(&ends));
        }
        let Some(asked) = clip else { return Ok((positions, triangles)) };
        let Some(player) = self.player().ok().flatten() else {
            Clip::named(&[], asked)?;
            return Ok((positions, triangles));
        };
        let number = Clip::named(player.clips(), asked)?;
        let n = (MOST_FRAME_VERTICES / self.positions.len().max(1)).clamp(2, FRAMES);
        for at in self.frames_of(&player, number, n) {
            if at.iter().all(|p| p.is_finite()) {
                let first = positions.len() as u32;
                triangles.extend(self.triangles.iter().map(|t| t.map(|v| first + v)));
                positions.extend(at);
            }
        }
        Ok((positions, triangles))
    }

    pub(crate) fn shown_at(
        &self,
        player: &Player,
        clip: Option<usize>,
        seconds: f32,
        targets: &[f32],
    ) -> Vec<Vec3> {
        let posed = player.at(clip, seconds, targets);
        self.up().turned(&skin_vertices(&player.skin, &posed.palette, &posed.targets)).into_owned()
    }

    fn frames_of(&self, player: &Player, clip: usize, n: usize) -> impl Iterator<Item = Vec<Vec3>> {
        let step = player.clips()[clip].seconds / (n.max(2) - 1) as f32;
        (0..n).map(move |frame| self.shown_at(player, Some(clip), frame as f32 * step, &[]))
    }

    /// The vertices at equal distances of time, from a clip's beginning to its end: as many frames as [`Self::write_baked`] bakes.
    ///
    /// # Errors
    /// [`WriteError`] when there is none of this number, or it cannot be played or is too large to be baked.
    pub fn frames(&self, clip: usize) -> Result<Vec<Vec<Vec3>>, WriteError> {
        let player = self.player()?.ok_or(WriteError::NoRig)?;
        let found = player.clips().get(clip).ok_or(WriteError::NoClip(clip))?;
        let n = (found.seconds * BAKED_PER_SECOND).ceil().clamp(1.0, MOST_BAKED) as usize + 1;
        // Positions and normals of each frame.
        let needed = (n * self.positions.len() * 24) as u64;
        if needed > MOST_BAKED_BYTES {
            return Err(WriteError::Document(format!(
                "{n} frames of {} vertices are {} MB, above the limit of {} MB for a baked clip: export it without the cage \
                 bending the moving model",
                self.positions.len(),
                needed >> 20,
                MOST_BAKED_BYTES >> 20
            )));
        }
        Ok(self.frames_of(&player, clip, n).collect())
    }

    /// A clip as morph targets, one for each of its frames, without skeleton: what moves in a way that no skeleton can. `rest` and
    /// each frame: `[n_vertices]`.
    ///
    /// # Errors
    /// As [`Self::write_glb`], and [`WriteError::NoClip`].
    pub fn write_baked(
        &self,
        clip: usize,
        rest: &[Vec3],
        frames: Vec<Vec<Vec3>>,
    ) -> Result<Vec<u8>, WriteError> {
        let clips = self.clips();
        let Clip { name, seconds, .. } = clips.get(clip).ok_or(WriteError::NoClip(clip))?;
        let clip = name.as_deref().unwrap_or("clip");
        let step = seconds / (frames.len().max(2) - 1) as f32;
        let named = |(k, at)| (format!("{:.3} s", k as f32 * step), at);
        let frames: Vec<(String, Vec<Vec3>)> = frames.into_iter().enumerate().map(named).collect();
        self.glb(rest, &frames, Played::Frames { clip, seconds: *seconds })
    }
}
