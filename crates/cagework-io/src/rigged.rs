//! Rigged models: skeleton, morph targets and clips.

use cagework_core::skin::skin_vertices;
use cagework_core::splats::{Splats, shells_of_points};
use cagework_core::words::decimals;
use cagework_pose::Parts;
use cagework_pose::humanoid::{Bone, Humanoid};
use glam::{DMat4, DVec3, Vec3};
use thiserror::Error;

use crate::error::WriteError;
use crate::gltf::{
    self, Clip, Ground, JointPlayer, JointPoint, Player, PointMoves, PoseClip, PoseDisplacements,
    ReshapeOptions, ReshapeReport, Rig, Skeleton, Vrm,
};
use crate::model::{Document, Model};
use crate::origin::relative;
use crate::shown::shown;
use crate::siblings::Resolve;
use crate::timeline::Timeline;

/// Limit on the times of a clip at which a generated cage encloses the model.
pub const MAX_CLIP_TIMES: usize = 32;
/// Limit on the vertices at all these times together. Models with more than 524,288 vertices are enclosed at fewer
/// times.
const MAX_CLIP_VERTICES: usize = 1 << 24;

/// Limit on the frames of a baked clip per second.
const BAKED_FRAMES_PER_SECOND: f32 = 30.0;
/// Limit on the number of frames of a baked clip: two seconds, with the frames at both ends. Each frame becomes a morph
/// target, of which game engines support only a limited number.
const MAX_BAKED_FRAMES: usize = 61;
/// Limit on the positions and normals of all baked frames, bytes.
const MAX_BAKED_BYTES: u64 = 512 << 20;

/// No clip has the requested name.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("there is no clip '{}'; the model has {}", shown(asked), if names.is_empty() { "none".to_owned() } else { shown(&names.join(", ")) })]
pub struct UnknownClip {
    /// Requested name.
    pub asked: String,
    /// Names of all clips.
    pub names: Vec<String>,
}

impl Clip {
    /// Finds the index of the first clip with this name. Unnamed clips have labels such as "clip 0".
    ///
    /// # Errors
    /// [`UnknownClip`] if no clip has this name.
    pub fn named(clips: &[Self], name: &str) -> Result<usize, UnknownClip> {
        let own = clips.iter().position(|clip| clip.name.as_deref() == Some(name));
        let names: Vec<String> = clips.iter().enumerate().map(|(k, clip)| clip.label(k)).collect();
        let found = own.or_else(|| names.iter().position(|label| label == name));
        found.ok_or_else(|| UnknownClip { asked: name.to_owned(), names })
    }

    /// Name of the clip; "clip `number`" if it is unnamed.
    #[must_use]
    pub fn label(&self, number: usize) -> String {
        self.name.clone().filter(|name| !name.is_empty()).unwrap_or_else(|| format!("clip {number}"))
    }
}

impl Model {
    /// Whether the model has skins, morph targets or nodes that follow the cage. [`Self::write_reshaped`]
    /// fits them to the new shape; [`Self::write_glb`] does not.
    #[must_use]
    pub fn is_rigged(&self) -> bool {
        matches!(&self.document, Document::Gltf(document) if Rig::is_needed(document))
    }

    /// Whether [`Self::write_glb`] drops skins or morph targets.
    #[must_use]
    pub fn has_skin_or_targets(&self) -> bool {
        matches!(&self.document, Document::Gltf(document) if Rig::has_skin_or_targets(document))
    }

    /// Returns the points to bind after the vertices when a rigged model is reshaped: ends of morph targets, joints and
    /// other moving nodes, and offsets stored in a VRM. Empty without a rig. Object units, `[n_points]`.
    ///
    /// # Errors
    /// [`WriteError`] if a part of the rig cannot be read.
    pub fn extra_points(&self) -> Result<Vec<Vec3>, WriteError> {
        let bound = self.rig()?.map_or_else(Vec::new, |rig| rig.bound());
        let extras: Vec<Vec3> = bound.iter().map(|&p| relative(p, self.origin)).collect();
        Ok(self.up.turned(&extras).into_owned())
    }

    /// Joints and the nodes below them, for drawing the skeleton.
    ///
    /// # Errors
    /// [`WriteError`] if a part of the rig cannot be read.
    pub fn joints(&self) -> Result<Vec<JointPoint>, WriteError> {
        Ok(self.rig()?.map_or_else(Vec::new, |rig| rig.joints()))
    }

    /// Returns the joints at rest with their influences on the vertices: the joints of all skins and the bones of a VRM;
    /// without skins, the animated nodes, too. Vertices of rigid parts have one influence, the joint on which they hang.
    /// `None` if there are no joints. Positions as [`Self::positions`].
    ///
    /// # Errors
    /// [`WriteError`] if the joints or weights cannot be read.
    pub fn rest_rig(&self) -> Result<Option<cagework_core::rig::Rig>, WriteError> {
        let Document::Gltf(document) = &self.document else { return Ok(None) };
        let Some(mut rig) = gltf::rest_rig(document, self.origin)? else { return Ok(None) };
        let at: Vec<Vec3> = rig.joints.iter().map(|joint| joint.at).collect();
        for (joint, &at) in rig.joints.iter_mut().zip(&*self.up.turned(&at)) {
            joint.at = at;
        }
        Ok(Some(rig))
    }

    /// Returns the joints at rest, and which of them are the bones of a humanoid. `bones`: bones and the names of their
    /// joints, which take precedence over what is found.
    ///
    /// # Errors
    /// [`WriteError`] if the joints cannot be read, or are not those of a humanoid.
    pub fn humanoid(
        &self,
        bones: &[(Bone, String)],
    ) -> Result<(cagework_core::rig::Rig, Humanoid), WriteError> {
        let rig = self.rest_rig()?.unwrap_or_default();
        let humanoid = Humanoid::of_rig(&rig, bones)?;
        Ok((rig, humanoid))
    }

    /// Names of unskinned parts attached to joints or animated nodes, such as buckles, eyes and weapons. They
    /// can be kept rigid.
    ///
    /// # Errors
    /// [`WriteError`] if a part of the rig cannot be read.
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

    /// Creates a player for the model's skeleton, morph targets and clips. Its vertices are in the file's axes,
    /// relative to [`Self::origin`]. `None` if the model is not a glTF.
    ///
    /// # Errors
    /// [`WriteError`] if a part of the rig cannot be read.
    pub fn player(&self) -> Result<Option<Player>, WriteError> {
        match &self.document {
            Document::Gltf(document) => Ok(Some(Player::new(document, document, self.origin)?)),
            Document::Polygons(_) => Ok(None),
        }
    }

    /// Creates a player for the joints of [`Self::rest_rig`] alone, for figures that follow the clips of this rig.
    /// Positions as [`Self::positions`].
    ///
    /// # Errors
    /// [`WriteError`] if the model is not a glTF, or a part of the rig cannot be read.
    pub fn joint_player(&self) -> Result<JointPlayer, WriteError> {
        let Document::Gltf(document) = &self.document else { return Err(WriteError::NoRig) };
        let to_model = self.up.turn().as_dmat4() * DMat4::from_translation(-self.origin);
        Ok(JointPlayer::new(document, to_model)?)
    }

    /// Creates a player for an export of this model, with vertices in this model's order.
    ///
    /// # Errors
    /// [`WriteError`] if this model is not a glTF, or `export` cannot be read.
    pub fn player_of(&self, export: &[u8]) -> Result<Player, WriteError> {
        let Document::Gltf(like) = &self.document else { return Err(WriteError::NoRig) };
        let read = gltf::read_written("export.glb", export, self.origin)?;
        Ok(Player::new(&read.document, like, self.origin)?)
    }

    /// VRM data of the file; `None` unless it is a VRM.
    #[must_use]
    pub fn vrm(&self) -> Option<Vrm> {
        match &self.document {
            Document::Gltf(document) => gltf::vrm(document),
            Document::Polygons(_) => None,
        }
    }

    /// Animation clips of the file.
    #[must_use]
    pub fn clips(&self) -> Vec<Clip> {
        match &self.document {
            Document::Gltf(document) => gltf::clips(document),
            Document::Polygons(_) => Vec::new(),
        }
    }

    /// Exports a rigged model in its deformed shape, with skeleton, morph targets and animations fitted to it. Each of
    /// the `poses` becomes an additional morph target; with poses, pass zeros for `by`, so that the shape stays at
    /// rest.
    ///
    /// `by`: displacements of the vertices, then of [`Self::extra_points`]. `outside`: indices of the points that are
    /// outside the cage.
    ///
    /// # Errors
    /// [`WriteError`] unless there is one finite displacement per point, or if the document cannot be written.
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
        let all_moved = |by: &[DVec3]| Ok(rig.held(&options.parts, &rest, self.all_moved(&rig, by)?));
        let by: Vec<DVec3> = all_moved(by)?;
        let by_poses = poses.iter().map(|(_, by)| all_moved(by)).collect::<Result<Vec<_>, WriteError>>()?;
        let poses = poses.iter().zip(&by_poses);
        let poses: Vec<PoseDisplacements<'_>> = poses
            .map(|((name, _), by)| PoseDisplacements { name, default: 0.0, by: Box::new(|| by.into()) })
            .collect();
        let is_outside = self.all_outside(&rig, outside);
        let up = self.up.vector_turned_back(DVec3::Y);
        let moves = PointMoves { by: &by, is_outside: &is_outside };
        gltf::reshape(document, &rig, &self.triangles, moves, &poses, options, up)
    }

    /// Returns the moves of the joints in [`Self::write_reshaped`], for other files with the same rig.
    ///
    /// # Errors
    /// [`WriteError`] unless there is one finite displacement per point, or if the rig cannot be read.
    pub fn skeleton(
        &self,
        by: &[DVec3],
        outside: &[u32],
        options: &ReshapeOptions,
    ) -> Result<Skeleton, WriteError> {
        let Document::Gltf(document) = &self.document else { return Err(WriteError::NoRig) };
        let rest = self.positions_in_file();
        let rig = Rig::new(document, &rest, self.origin)?;
        let by = rig.held(&options.parts, &rest, self.all_moved(&rig, by)?);
        let is_outside = self.all_outside(&rig, outside);
        let up = self.up.vector_turned_back(DVec3::Y);
        let moves = PointMoves { by: &by, is_outside: &is_outside };
        gltf::skeleton(document, &rig, &self.triangles, moves, options, up)
    }

    /// Heights of the lowest vertex at rest and in `posed`, for a model that is written without its rig. `posed`:
    /// `[n_vertices]`.
    #[must_use]
    pub fn ground(&self, posed: &[Vec3]) -> Ground {
        let low = |all: &[Vec3]| all.iter().map(|p| f64::from(p.y)).fold(f64::INFINITY, f64::min);
        let origin = self.up.vector_turned(self.origin).y;
        Ground::at_rest([low(&self.positions), low(posed)].map(|low| origin + low))
    }

    /// Heights of the lowest vertex at rest, for a model that [`Self::write_reshaped`] writes with these displacements,
    /// except those of rigid attachments.
    ///
    /// # Errors
    /// As [`Self::skeleton`].
    pub fn ground_of_rig(&self, by: &[DVec3], parts: &Parts) -> Result<Ground, WriteError> {
        let Document::Gltf(document) = &self.document else { return Err(WriteError::NoRig) };
        let rest = self.positions_in_file();
        let rig = Rig::new(document, &rest, self.origin)?;
        let by = rig.held(parts, &rest, self.all_moved(&rig, by)?);
        let up = self.up.vector_turned_back(DVec3::Y);
        Ok(rig.ground(&by, &rig.carried_in_hands(&self.triangles), up))
    }

    /// Lifts or lowers a model that is written without its rig: by the lift of [`ReshapeOptions::skeleton`], if it has
    /// one. Otherwise, with [`ReshapeOptions::ground`], the lowest point returns to its height at rest. `posed`:
    /// `[n_vertices]`.
    pub fn lift(&self, posed: &mut [Vec3], options: &ReshapeOptions) {
        let own = options.ground.then(|| self.ground(posed));
        let shared = options.skeleton.as_ref().and_then(|skeleton| skeleton.ground());
        let lift = shared.or(own.as_ref()).map_or(0.0, Ground::lift) as f32;
        if lift != 0.0 {
            posed.iter_mut().for_each(|p| p.y += lift);
        }
    }

    /// Names of the joints that carry vertices.
    #[must_use]
    pub fn joints_with_vertices(&self) -> Skeleton {
        match &self.document {
            Document::Gltf(document) => gltf::joints_with_vertices(document),
            Document::Polygons(_) => Skeleton::default(),
        }
    }

    /// Lists the names of the joints that carry vertices in a file; none if it has no skin or cannot be read.
    pub fn joints_with_vertices_in(
        name: &str,
        bytes: &[u8],
        resolve: &mut Resolve<'_>,
        memory_limit: u64,
    ) -> Skeleton {
        // Files without skins are not parsed.
        let length = bytes.get(12..16).and_then(|b| b.try_into().ok()).map_or(0, u32::from_le_bytes) as usize;
        let text = bytes.get(20..20 + length).filter(|_| bytes.starts_with(b"glTF")).unwrap_or(bytes);
        let key = b"\"skins\"";
        if !text.windows(key.len()).any(|word| word == key) {
            return Skeleton::default();
        }
        gltf::joints_with_vertices_in(name, bytes, resolve, memory_limit)
    }

    /// Computes the displacements of all points of the rig, in the file's axes.
    fn all_moved(&self, rig: &Rig<'_>, by: &[DVec3]) -> Result<Vec<DVec3>, WriteError> {
        let expected = self.positions.len() + rig.bound().len();
        if by.len() != expected {
            return Err(WriteError::Count { given: by.len(), expected });
        }
        if let Some(vertex) = by.iter().position(|by| !by.is_finite()) {
            return Err(WriteError::NotFinite { vertex });
        }
        Ok(rig.all_moved(by.iter().map(|&by| self.up.vector_turned_back(by)).collect()))
    }

    fn all_outside(&self, rig: &Rig<'_>, outside: &[u32]) -> Vec<bool> {
        let mut is_outside = vec![false; self.positions.len() + rig.bound().len()];
        for &point in outside {
            if let Some(is_outside) = is_outside.get_mut(point as usize) {
                *is_outside = true;
            }
        }
        rig.all_outside(is_outside)
    }

    /// Returns the vertices and triangles that a generated cage should enclose: the rest shape, each morph target at
    /// weights 0 and 1, and the shapes at up to 32 equally spaced times of a clip (fewer, but at least two, above
    /// 524,288 vertices). For splats and points, octahedra around them.
    ///
    /// # Errors
    /// [`UnknownClip`] if there is no such clip. If the rig cannot be read, the result contains the rest shape only.
    pub fn states(&self, clip: Option<&str>) -> Result<(Vec<Vec3>, Vec<[u32; 3]>), UnknownClip> {
        if self.n_faces() == 0 {
            if let Some(asked) = clip {
                Clip::named(&[], asked)?;
            }
            return Ok(self.splats().map_or_else(|| shells_of_points(&self.positions), Splats::shells));
        }
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
        let n = (MAX_CLIP_VERTICES / self.positions.len().max(1)).clamp(2, MAX_CLIP_TIMES);
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
        let posed = player.pose_at(clip, seconds, targets);
        self.up().turned(&skin_vertices(&player.skin, &posed.palette, &posed.targets)).into_owned()
    }

    fn frames_of(&self, player: &Player, clip: usize, n: usize) -> impl Iterator<Item = Vec<Vec3>> {
        let step = player.clips()[clip].seconds / (n.max(2) - 1) as f32;
        (0..n).map(move |frame| self.shown_at(player, Some(clip), frame as f32 * step, &[]))
    }

    /// Computes the positions at times of a clip, seconds. `[n_times][n_vertices]`
    ///
    /// # Errors
    /// [`WriteError`] if the model is not a glTF, or a part of the rig cannot be read.
    pub fn frames_at(&self, clip: usize, seconds: &[f32]) -> Result<Vec<Vec<Vec3>>, WriteError> {
        let player = self.player()?.ok_or(WriteError::NoRig)?;
        Ok(seconds.iter().map(|&at| self.shown_at(&player, Some(clip), at, &[])).collect())
    }

    /// Computes the positions at equal time steps from the start of a clip to its end: the frames that
    /// [`Self::write_baked`] exports. `[n_frames][n_vertices]`
    ///
    /// # Errors
    /// [`WriteError`] if there is no such clip, the rig cannot be read, or positions and normals of the frames would
    /// exceed 512 MiB.
    pub fn frames(&self, clip: usize) -> Result<Vec<Vec<Vec3>>, WriteError> {
        let n = self.n_frames(clip)?;
        let player = self.player()?.ok_or(WriteError::NoRig)?;
        Ok(self.frames_of(&player, clip, n).collect())
    }

    /// Number of frames that [`Self::frames`] returns.
    ///
    /// # Errors
    /// [`WriteError`] if there is no such clip, or positions and normals of the frames would exceed 512 MiB.
    pub fn n_frames(&self, clip: usize) -> Result<usize, WriteError> {
        let clips = self.clips();
        let found = clips.get(clip).ok_or(WriteError::NoClip(clip))?;
        // A clip of length 0 has one frame, because the times of keys must increase.
        let n = ((found.seconds * BAKED_FRAMES_PER_SECOND).ceil() as usize).min(MAX_BAKED_FRAMES - 1) + 1;
        // The position and the normal of a vertex take 24 bytes.
        let needed = (n * self.positions.len() * 24) as u64;
        if needed > MAX_BAKED_BYTES {
            return Err(WriteError::Document(format!(
                "{n} frames of {} vertices are {} MiB, above the limit of {} MiB for a baked clip: export the clip without \
                 dynamic bending",
                self.positions.len(),
                needed >> 20,
                MAX_BAKED_BYTES >> 20
            )));
        }
        Ok(n)
    }

    /// Exports a clip without skeleton, as one morph target per frame. Used for motion that skinning cannot
    /// represent. `rest` and each frame: `[n_vertices]`.
    ///
    /// # Errors
    /// As [`Self::write_glb`], and [`WriteError::NoClip`] if there is no such clip.
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
        let times: Vec<f32> = (0..frames.len()).map(|k| k as f32 * step).collect();
        let named = |(at, shape): (&f32, _)| (format!("{} s", decimals(*at, 3)), shape);
        let frames: Vec<(String, Vec<Vec3>)> = times.iter().zip(frames).map(named).collect();
        let timeline = &Timeline::at_keys(&times);
        self.glb(rest, &frames, PoseClip { name: clip, timeline, is_alone: true })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shape_on_the_ground_keeps_the_height_of_its_lowest_vertex() {
        let text = b"v 0 1 0\nv 1 1 0\nv 0 3 0\nf 1 2 3\n";
        let model = Model::read("a.obj", text, &mut |_| None).unwrap();
        for (ground, lowest) in [(false, 1.5), (true, 1.0)] {
            let mut posed: Vec<Vec3> = model.positions.iter().map(|p| 1.5 * *p).collect();
            model.lift(&mut posed, &ReshapeOptions { ground, ..ReshapeOptions::default() });
            assert_eq!(posed[0].y, lowest);
            assert_eq!(posed[2] - posed[0], Vec3::new(0.0, 3.0, 0.0));
        }
    }
}
