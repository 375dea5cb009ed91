//! Models that play a clip, as one.

use std::ops::Range;

use cagework_core::dynamic::{DisplacementField, bend_vertices};
use cagework_core::skin::{Skin, skin_vertices};
use cagework_io::{Player, Posed};
use glam::{Mat4, Vec3};

use cagework_editor::Models;

/// A clip, of all models that have one of this name.
pub(crate) struct SharedClip {
    /// Or its number, if it has none.
    pub(crate) name: String,
    /// Of the longest.
    pub(crate) seconds: f32,
    /// Numbers of the models, and of their clips.
    of: Vec<(u32, usize)>,
}

impl SharedClip {
    /// All clips there are, in order of the models.
    pub(crate) fn all(models: &Models) -> Vec<Self> {
        let mut all: Vec<Self> = Vec::new();
        for member in models.iter() {
            for (number, clip) in member.model.clips().iter().enumerate() {
                let name = clip.label(number);
                // One file may have several of a name.
                let is_same = |other: &&mut Self| other.name == name && other.of(member.id).is_none();
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

    /// The number of a model's own clip, if it has one.
    pub(crate) fn of(&self, id: u32) -> Option<usize> {
        self.of.iter().find(|(member, _)| *member == id).map(|(_, clip)| *clip)
    }
}

/// What one model is played by.
pub(crate) enum Part {
    /// Its skeleton, morph targets and clips.
    Player(Box<Player>),
    /// Nothing: it stays where it is, in the axes of the file.
    Still(Vec<Vec3>),
}

/// One model of those that play.
struct Played {
    id: u32,
    part: Part,
    /// Its weights among those of all morph targets.
    targets: Range<usize>,
}

/// Models that play.
pub(crate) struct Playing {
    played: Vec<Played>,
    clips: Vec<SharedClip>,
    /// Vertices of all.
    pub(crate) skin: Skin,
    /// From the file's axes to those that are drawn.
    up: Mat4,
    /// Each model where it is now.
    posed: Vec<Posed>,
    /// Weights of all morph targets. `[n_targets]`
    targets: Vec<f32>,
    /// What bends them.
    pub(crate) field: Option<DisplacementField>,
    /// Whether the GPU does not have it yet.
    pub(crate) is_new: bool,
}

impl Playing {
    /// At rest. `parts`: of each model, with its number.
    pub(crate) fn new(
        parts: Vec<(u32, Part)>,
        clips: Vec<SharedClip>,
        up: Mat4,
        field: Option<DisplacementField>,
    ) -> Self {
        let mut skin = Skin { joint_starts: vec![0], delta_starts: vec![0], ..Skin::default() };
        let (mut played, mut n_palette, mut n_targets) = (Vec::new(), 0, 0);
        for (id, part) in parts {
            let own = match &part {
                Part::Player(player) => player.targets().1.len(),
                Part::Still(_) => 0,
            };
            append(&mut skin, &part, n_palette as u32, n_targets as u32);
            n_palette += posed(&part, None, 0.0, &[]).palette.len();
            played.push(Played { id, part, targets: n_targets..n_targets + own });
            n_targets += own;
        }
        let mut playing =
            Self { played, clips, skin, up, posed: Vec::new(), targets: Vec::new(), field, is_new: true };
        playing.show(None, 0.0, &[]);
        playing
    }

    /// Goes to a time of a clip, seconds; at rest without one. `targets`: weights of the morph targets that the clip does not drive;
    /// nothing for those of the files.
    pub(crate) fn show(&mut self, clip: Option<usize>, seconds: f32, targets: &[f32]) {
        let clip = clip.and_then(|clip| self.clips.get(clip));
        let at = |one: &Played| {
            let own = targets.get(one.targets.clone()).unwrap_or_default();
            posed(&one.part, clip.and_then(|clip| clip.of(one.id)), seconds, own)
        };
        self.posed = self.played.iter().map(at).collect();
        self.targets = self.posed.iter().flat_map(|posed| &posed.targets).copied().collect();
        self.is_new = true;
    }

    /// Matrices of the joints, in the axes that are drawn.
    pub(crate) fn palette(&self) -> Vec<Mat4> {
        self.posed.iter().flat_map(|posed| &posed.palette).map(|&m| self.up * m).collect()
    }

    /// Weights of the morph targets. `[n_targets]`
    pub(crate) fn targets(&self) -> &[f32] {
        &self.targets
    }

    /// Where a node of a model is, in the axes that are drawn; none if there is no such node.
    pub(crate) fn origin(&self, id: u32, node: u32) -> Option<Vec3> {
        let place = self.played.iter().position(|one| one.id == id)?;
        self.posed[place].origins.get(node as usize).map(|&p| self.up.transform_point3(p))
    }

    /// Where the vertices are, by the processor. `[n_vertices]`
    pub(crate) fn positions(&self) -> Vec<Vec3> {
        let mut positions = skin_vertices(&self.skin, &self.palette(), &self.targets);
        if let Some(field) = &self.field {
            bend_vertices(field, &mut positions);
        }
        positions
    }
}

/// One model at a time of a clip of its own.
fn posed(part: &Part, clip: Option<usize>, seconds: f32, targets: &[f32]) -> Posed {
    match part {
        Part::Player(player) => player.at(clip, seconds, targets),
        Part::Still(_) => Posed { palette: vec![Mat4::IDENTITY], targets: Vec::new(), origins: Vec::new() },
    }
}

/// Adds the vertices of one more model.
fn append(skin: &mut Skin, part: &Part, first_joint: u32, first_target: u32) {
    let still;
    let own = match part {
        Part::Player(player) => &player.skin,
        Part::Still(positions) => {
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
