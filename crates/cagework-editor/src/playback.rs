//! Playback of clips on all models.

use std::cell::OnceCell;
use std::ops::Range;
use std::sync::Arc;

use cagework_core::field::{Field, bend_vertices};
use cagework_core::skin::{Skin, skin_vertices};
use cagework_io::{ModelFormat, Player, RigPose};
use glam::{Mat3, Mat4, Vec3};
use serde::Serialize;

use crate::bound::{BoundDocument, BoundError};
use crate::editor::Editor;
use crate::models::Models;
use crate::options::RigOptions;

/// Preparation time of a playback above which changes of the pose are shown only when the gesture ends, ms.
const SLOW_MS: f64 = 100.0;

/// Clips with the same name, of all models that have one.
#[derive(Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct SharedClip {
    /// Name of the clip, or its number if it has no name.
    pub name: String,
    /// Duration of the longest of these clips, seconds.
    pub seconds: f32,
    /// `(model id, clip index)` pairs, at most one per model.
    #[serde(skip)]
    of: Vec<(u32, usize)>,
}

impl SharedClip {
    /// Collects the clips of all models, grouped by name, in the order of the models.
    #[must_use]
    pub fn group(models: &Models) -> Vec<Self> {
        let mut all: Vec<Self> = Vec::new();
        for member in models.iter() {
            for (number, clip) in member.model.clips().iter().enumerate() {
                let name = clip.label(number);
                // A file may contain several clips with the same name; each gets a group of its own.
                let is_same = |other: &&mut Self| other.name == name && other.index_in(member.id).is_none();
                match all.iter_mut().find(is_same) {
                    Some(other) => {
                        other.of.push((member.id, number));
                        other.seconds = other.seconds.max(clip.seconds);
                    }
                    None => all.push(Self { name, seconds: clip.seconds, of: vec![(member.id, number)] }),
                }
            }
        }
        all
    }

    /// Index of the clip within a model; `None` if the model has no clip in this group.
    #[must_use]
    pub fn index_in(&self, id: u32) -> Option<usize> {
        self.of.iter().find(|(member, _)| *member == id).map(|(_, clip)| *clip)
    }
}

/// Motion of one model during playback.
enum ModelMotion {
    /// The model moves by its skeleton, morph targets and clips.
    Player(Box<Player>),
    /// The model does not move. Positions in the axes of the file. `[n_vertices]`
    Still(Vec<Vec3>),
}

impl ModelMotion {
    /// Prepares the motion of one model: the motion of its export or, with `dynamic`, of the original file, which the
    /// cage then deforms.
    fn new(all: BoundDocument<'_>, id: u32, options: &RigOptions, lift: f32) -> Result<Self, BoundError> {
        let member = all.document().models.get(id)?;
        if member.model.format() == ModelFormat::Gltf && !options.dynamic {
            let glb = all.glb(id, options, None)?.bytes;
            return Ok(Self::Player(Box::new(member.model.player_of(&glb)?)));
        }
        if let Some(player) = member.model.player()? {
            return Ok(Self::Player(Box::new(player)));
        }
        // A model whose format has no clips has one shape: that of the cage's pose or, for `dynamic`, the rest shape,
        // which the field then deforms.
        let posed = all.deformed(if options.dynamic { all.rest() } else { &all.document().pose })?;
        let own: Vec<Vec3> = member.share(&posed).iter().map(|p| *p + lift * Vec3::Y).collect();
        Ok(Self::Still(all.document().models.up().turned_back(&own).into_owned()))
    }
}

/// A model in a playback, and the source of its motion.
struct PlayedModel {
    id: u32,
    part: ModelMotion,
    /// Range of the model's weights within `Playback::targets`.
    targets: Range<usize>,
}

/// A time of a clip.
#[derive(Clone, Default)]
struct Moment {
    /// Index of the clip; `None` for the rest pose.
    clip: Option<usize>,
    seconds: f32,
    /// Weights of the morph targets that the clip does not animate. If empty, the models' files provide these weights.
    targets: Vec<f32>,
}

/// A clip being played on all models: skinning data, current pose, and the cage's field.
pub struct Playback {
    /// Options of the export that the playback shows.
    pub options: RigOptions,
    /// Pose of the cage and key of the models that this playback was prepared for.
    prepared_for: (Arc<[Vec3]>, u64),
    /// Time that the preparation took, ms.
    pub prepared_ms: f64,
    /// Whether the clip is paused. The cage is then shown and can be moved.
    pub is_paused: bool,
    shown: Moment,
    played: Vec<PlayedModel>,
    clips: Vec<SharedClip>,
    /// Vertices of all models with their joints and morph targets.
    pub skin: Skin,
    /// Rotation from the axes of the files to the axes of the scene.
    up: Mat4,
    /// Height by which the exported models are lifted at rest, object units.
    lift: f32,
    /// Current joint matrices and target weights of each model.
    posed: Vec<RigPose>,
    /// Current weights of the morph targets of all models. `[n_targets]`
    targets: Vec<f32>,
    /// Displacement field of the cage, if it deforms the models after the clip moves them.
    pub field: Option<Field>,
    /// Whether the current time still has to be written to the GPU.
    pub is_new: bool,
    /// Current vertices in the view, computed when first needed.
    in_view: OnceCell<Vec<Vec3>>,
}

impl Playback {
    /// Prepares playback of the models in the current pose, and shows them at rest.
    ///
    /// # Errors
    /// If the models cannot be exported, or for `options.dynamic` without a lattice.
    pub fn new(all: BoundDocument<'_>, options: RigOptions) -> Result<Self, BoundError> {
        let editor = all.editor;
        let field = if options.dynamic { Some(all.field()?) } else { None };
        let lift = if options.reshape.ground && !options.dynamic { all.lift()? } else { 0.0 };
        let motion = |id| Ok((id, ModelMotion::new(all, id, &options, lift)?));
        let ids = editor.document().models.iter().map(|member| member.id);
        let parts = ids.map(motion).collect::<Result<Vec<_>, BoundError>>()?;
        let models = &editor.document().models;
        let (clips, up) = (SharedClip::group(models), models.up().turn());
        let mut skin = Skin { joint_starts: vec![0], delta_starts: vec![0], ..Skin::default() };
        let (mut played, mut n_palette, mut n_targets) = (Vec::new(), 0, 0);
        for (id, part) in parts {
            let own = match &part {
                ModelMotion::Player(player) => player.targets().1.len(),
                ModelMotion::Still(_) => 0,
            };
            append(&mut skin, &part, n_palette as u32, n_targets as u32);
            n_palette += posed(&part, None, 0.0, &[]).palette.len();
            played.push(PlayedModel { id, part, targets: n_targets..n_targets + own });
            n_targets += own;
        }
        let mut playing = Self {
            options,
            prepared_for: (Arc::clone(&editor.document().pose), editor.models_key()),
            prepared_ms: 0.0,
            is_paused: true,
            shown: Moment::default(),
            played,
            clips,
            skin,
            up,
            lift,
            posed: Vec::new(),
            targets: Vec::new(),
            field,
            is_new: true,
            in_view: OnceCell::new(),
        };
        playing.update();
        Ok(playing)
    }

    /// Whether the pose of the cage or the options of models have changed since this playback was prepared.
    #[must_use]
    pub fn is_stale(&self, editor: &Editor) -> bool {
        let (pose, models) = &self.prepared_for;
        !Arc::ptr_eq(pose, &editor.document().pose) || *models != editor.models_key()
    }

    /// Whether the playback is out of date and should be prepared again now. If the last preparation took longer than
    /// 100 ms, this is false until the pose is part of a history step.
    #[must_use]
    pub fn needs_update(&self, editor: &Editor) -> bool {
        self.is_stale(editor) && (self.prepared_ms <= SLOW_MS || editor.is_pose_committed())
    }

    /// Shows the same time of the same clip as another playback.
    pub fn show_as(&mut self, other: &Self) {
        (self.is_paused, self.shown) = (other.is_paused, other.shown.clone());
        self.update();
    }

    /// Moves the models to their pose at `seconds` in the clip with the index `clip`, or to the rest pose without a
    /// clip. `targets`: weights of the morph targets that the clip does not animate; if it is empty, the models' files
    /// provide these weights.
    pub fn show(&mut self, clip: Option<usize>, seconds: f32, targets: Vec<f32>) {
        self.shown = Moment { clip, seconds, targets };
        self.update();
    }

    fn update(&mut self) {
        let Moment { clip, seconds, targets } = &self.shown;
        let clip = clip.and_then(|clip| self.clips.get(clip));
        // The first model with the clip leads those without it that have a skeleton with the same names.
        let leader = self.played.iter().find_map(|one| match (&one.part, clip?.index_in(one.id)) {
            (ModelMotion::Player(player), Some(clip)) => Some((player, clip)),
            _ => None,
        });
        let at = |one: &PlayedModel| {
            let own = targets.get(one.targets.clone()).unwrap_or_default();
            match (&one.part, clip.and_then(|clip| clip.index_in(one.id)), leader) {
                (ModelMotion::Player(player), None, Some((body, clip))) => {
                    player.pose_at_clip_of(body, clip, *seconds, own)
                }
                (part, clip, _) => posed(part, clip, *seconds, own),
            }
        };
        self.posed = self.played.iter().map(at).collect();
        self.targets = self.posed.iter().flat_map(|posed| &posed.targets).copied().collect();
        self.is_new = true;
        self.in_view.take();
    }

    /// Current matrices of the joints in the view, where the floor moves instead of the lifted models, so that models and
    /// cage stay together.
    #[must_use]
    pub fn palette(&self) -> Vec<Mat4> {
        self.palette_by(self.in_view())
    }

    fn palette_by(&self, turn: Mat4) -> Vec<Mat4> {
        self.posed.iter().flat_map(|posed| &posed.palette).map(|&m| turn * m).collect()
    }

    /// From the axes of the files to the view.
    fn in_view(&self) -> Mat4 {
        Mat4::from_translation(-self.lift * Vec3::Y) * self.up
    }

    /// Current weights of the morph targets. `[n_targets]`
    #[must_use]
    pub fn targets(&self) -> &[f32] {
        &self.targets
    }

    /// Current position of a node of a model in the view, like [`Self::palette`]; `None` if the node does not exist.
    #[must_use]
    pub fn origin(&self, id: u32, node: u32) -> Option<Vec3> {
        let place = self.played.iter().position(|one| one.id == id)?;
        self.posed[place].origins.get(node as usize).map(|&p| self.in_view().transform_point3(p))
    }

    /// Whether points of the models can be pulled: the clip is paused, and moves the models after the cage has deformed
    /// them.
    #[must_use]
    pub fn can_pull(&self) -> bool {
        self.is_paused && self.field.is_none()
    }

    /// Current vertices in the view, like [`Self::palette`], without the cage's field. `[n_vertices]`
    #[must_use]
    pub fn positions_in_view(&self) -> &[Vec3] {
        self.in_view.get_or_init(|| skin_vertices(&self.skin, &self.palette(), &self.targets))
    }

    /// Converts a displacement in the view, at a point of a triangle with these vertices, to the displacement of the models
    /// before the clip moves them: by the inverse of the blended joint matrices. `None` if these are not invertible.
    #[must_use]
    pub fn before_clip(&self, corners: [u32; 3], bary: [f32; 3], displacement: Vec3) -> Option<Vec3> {
        let palette = self.palette();
        let mut blended = Mat3::ZERO;
        for (vertex, share) in corners.into_iter().zip(bary) {
            let [start, end] = [0, 1].map(|next| self.skin.joint_starts[vertex as usize + next] as usize);
            for &(joint, weight) in &self.skin.joints[start..end] {
                blended += share * weight * Mat3::from_mat4(palette[joint as usize]);
            }
        }
        let to_view = blended * Mat3::from_mat4(self.up).transpose();
        let before = to_view.inverse() * displacement;
        before.is_finite().then_some(before)
    }

    /// Computes the current vertices of the exported models, in the axes of the scene. `[n_vertices]`
    #[must_use]
    pub fn positions(&self) -> Vec<Vec3> {
        let mut positions = skin_vertices(&self.skin, &self.palette_by(self.up), &self.targets);
        if let Some(field) = &self.field {
            bend_vertices(field, &mut positions);
        }
        positions
    }

    /// Computes the current vertices like [`Self::positions`], in the current pose even if this playback was prepared for
    /// another one. `[n_vertices]`
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub fn current_positions(&self, all: BoundDocument<'_>) -> Result<Vec<Vec3>, BoundError> {
        if !self.is_stale(all.editor) {
            return Ok(self.positions());
        }
        let mut current = Self::new(all, self.options.clone())?;
        current.show_as(self);
        Ok(current.positions())
    }
}

/// Computes joint matrices and target weights of one model at a time of one of its clips.
fn posed(part: &ModelMotion, clip: Option<usize>, seconds: f32, targets: &[f32]) -> RigPose {
    match part {
        ModelMotion::Player(player) => player.pose_at(clip, seconds, targets),
        ModelMotion::Still(_) => {
            RigPose { palette: vec![Mat4::IDENTITY], targets: Vec::new(), origins: Vec::new() }
        }
    }
}

/// Appends the vertices of a model to the skin of all models.
fn append(skin: &mut Skin, part: &ModelMotion, first_joint: u32, first_target: u32) {
    let still;
    let own = match part {
        ModelMotion::Player(player) => &player.skin,
        ModelMotion::Still(positions) => {
            let n = positions.len() as u32;
            still = Skin {
                positions: positions.clone(),
                joint_starts: (0..=n).collect(),
                joints: vec![(0, 1.0); n as usize],
                delta_starts: vec![0; n as usize + 1],
                deltas: Vec::new(),
            };
            &still
        }
    };
    let (joints, deltas) = (skin.joints.len() as u32, skin.deltas.len() as u32);
    skin.positions.extend(&own.positions);
    skin.joints.extend(own.joints.iter().map(|&(joint, weight)| (first_joint + joint, weight)));
    skin.deltas.extend(own.deltas.iter().map(|&(target, delta)| (first_target + target, delta)));
    skin.joint_starts.extend(own.joint_starts.iter().skip(1).map(|start| joints + start));
    skin.delta_starts.extend(own.delta_starts.iter().skip(1).map(|start| deltas + start));
}
