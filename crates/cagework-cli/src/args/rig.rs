//! Arguments for rigged models, and for parts of models that the cage does not bend.

use cagework_io::{Feet, Joints, ReshapeOptions, ReshapeReport};
use cagework_job::JobOptions;
use clap::Args;

/// Arguments that select parts of the model which the cage does not bend.
#[derive(Args, Debug)]
pub(crate) struct PartArgs {
    /// Part that keeps its shape, such as buckles, eyes or teeth: each connected piece moves rigidly. The name of a material, a node,
    /// a joint (the vertices it influences most) or an OBJ group; use material:NAME, node:NAME, joint:NAME or group:NAME if several have the name. May be given several times.
    #[arg(long, value_name = "NAME")]
    rigid: Vec<String>,
    /// Part that stays in place, named as for --rigid; with =0.25 after the name it stays by a quarter and follows three quarters of the way. May be given several
    /// times.
    #[arg(long, value_name = "NAME[=AMOUNT]", value_parser = mask)]
    mask: Vec<(String, f32)>,
}

fn mask(text: &str) -> Result<(String, f32), String> {
    let Some((name, Ok(amount))) = text.rsplit_once('=').map(|(name, amount)| (name, amount.parse::<f32>()))
    else {
        return Ok((text.to_owned(), 1.0));
    };
    if (0.0..=1.0).contains(&amount) {
        return Ok((name.to_owned(), amount));
    }
    Err(format!("the amount is {amount}; expected 0 (follows the cage) to 1 (stays in place)"))
}

/// Arguments for the treatment of a model's rig.
#[derive(Args, Debug)]
pub(crate) struct RigArgs {
    /// Joints, and other nodes that clips animate or that carry meshes: follow moves them with the cage and keeps their rotations; stay leaves
    /// them at rest, for skeletons that several files share; turn also rotates them with the shape.
    #[arg(long, default_value_t, value_parser = super::words::<Joints>())]
    joints: Joints,
    /// Keep the travel distance of clips; by default it is scaled with the height of the hips.
    #[arg(long)]
    keep_travel: bool,
    /// Lift or lower the deformed model, and each of its clips, so that the lowest point keeps its height. What a humanoid
    /// carries in one hand does not count.
    #[arg(long, conflicts_with = "shape_only")]
    pub(crate) ground: bool,
    /// Feet in clips: lock holds them in place while they are on the ground, by rotating thighs and shins; free leaves the
    /// rotations of the clip, so that feet of longer legs slide.
    #[arg(long, default_value_t, value_name = "KIND", value_parser = super::words::<Feet>(), conflicts_with = "shape_only")]
    feet: Feet,
    #[command(flatten)]
    pub(crate) parts: PartArgs,
    /// Write the mesh only, without skin and clips; several poses still become morph targets.
    #[arg(long = "static")]
    pub(crate) shape_only: bool,
}

impl RigArgs {
    /// Returns the options of a job. `ignores_unused`: whether they apply to many models.
    pub(crate) fn job_options(&self, ignores_unused: bool) -> JobOptions {
        let Self { joints, keep_travel, ground, feet, parts: PartArgs { rigid, mask }, shape_only } = self;
        let reshape = ReshapeOptions {
            joints: *joints,
            keep_travel: *keep_travel,
            rigid: rigid.clone(),
            ground: *ground,
            feet: *feet,
            ..ReshapeOptions::default()
        };
        JobOptions {
            reshape,
            mask: mask.clone(),
            shape_only: *shape_only,
            ignores_unused,
            ..JobOptions::default()
        }
    }

    /// Whether `--joints stay` leaves the skeleton at rest.
    pub(crate) fn stays(&self) -> bool {
        self.joints == Joints::Stay
    }

    /// Whether a model takes the travel of its clips or the turns of its joints from its own vertices, unless a skeleton
    /// gives them.
    pub(crate) fn depends_on_vertices(&self, report: &ReshapeReport) -> bool {
        self.joints == Joints::Turn && report.joints_moved > 0 || !self.keep_travel && report.tracks > 0
    }

    /// Returns the part names that `--rigid` and `--mask` give.
    pub(crate) fn part_names(&self) -> impl Iterator<Item = &String> {
        self.parts.rigid.iter().chain(self.parts.mask.iter().map(|(name, _)| name))
    }
}
