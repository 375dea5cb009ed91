//! Arguments for rigged models, and for parts of models that the cage does not bend.

use std::path::Path;

use cagework_io::{Feet, Joints, Model, ReshapeOptions, ReshapeReport, SelectError, shown};
use clap::Args;

use crate::error::CliError;

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
    /// Lift or lower the deformed model, and each of its clips, so that the lowest point keeps its height.
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
    /// Returns options for deforming a rigged model, and notices about ambiguous part names.
    ///
    /// # Errors
    /// If no part of the model has a given name.
    pub(crate) fn options(
        &self,
        model: &Model,
        path: &Path,
    ) -> Result<(ReshapeOptions, Vec<String>), CliError> {
        self.options_with(model, path, &self.parts)
    }

    /// Returns options for deforming one of many models, the names of `--rigid` and `--mask` that this model lacks, and
    /// notices about ambiguous part names.
    ///
    /// # Errors
    /// If the rig cannot be read.
    pub(crate) fn options_for_one(
        &self,
        model: &Model,
        path: &Path,
    ) -> Result<(ReshapeOptions, Vec<String>, Vec<String>), CliError> {
        let props = self.props(model, path)?;
        let mut missing = Vec::new();
        let mut is_there = |name: &String| {
            let there =
                props.contains(name) || !matches!(model.select(name), Err(SelectError::Unknown { .. }));
            if !there {
                missing.push(name.clone());
            }
            there
        };
        let PartArgs { rigid, mask } = &self.parts;
        let rigid = rigid.iter().filter(|name| is_there(name)).cloned().collect();
        let mask = mask.iter().filter(|(name, _)| is_there(name)).cloned().collect();
        let (options, notices) = self.options_with(model, path, &PartArgs { rigid, mask })?;
        Ok((options, missing, notices))
    }

    /// Rejects `--ground` and `--feet lock` where they have no effect.
    ///
    /// # Errors
    /// If there are several poses, or no skeleton for `--feet lock`.
    pub(crate) fn check_clips(&self, model: &Model, path: &Path, n_poses: usize) -> Result<(), CliError> {
        if n_poses > 1 && (self.ground || self.feet == Feet::Lock) {
            return Err(CliError::Mismatch {
                message: format!("--ground and --feet lock take one pose, but there are {n_poses}"),
                hint: "run the command once per pose",
            });
        }
        if self.feet == Feet::Lock && !model.is_rigged() {
            return Err(CliError::file(
                path,
                "has no skeleton whose feet could be held: leave out --feet lock",
            ));
        }
        Ok(())
    }

    /// Rejects the options of rigs and parts for a deformation that cannot follow them, such as that of points.
    /// `of_rig`: also rejects options that only change skeletons and clips. `why`: the reason, as a sentence.
    ///
    /// # Errors
    /// If one of these options is given.
    pub(crate) fn refuse(&self, of_rig: bool, why: &str, hint: &'static str) -> Result<(), CliError> {
        let given = [
            ("--ground", self.ground),
            ("--rigid", !self.parts.rigid.is_empty()),
            ("--mask", !self.parts.mask.is_empty()),
            ("--joints", of_rig && self.joints != Joints::default()),
            ("--feet", of_rig && self.feet != Feet::default()),
            ("--keep-travel", of_rig && self.keep_travel),
            ("--static", of_rig && self.shape_only),
        ];
        match given.iter().find(|(_, is_given)| *is_given) {
            Some((option, _)) => Err(CliError::Mismatch { message: format!("{option}: {why}"), hint }),
            None => Ok(()),
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

    fn props(&self, model: &Model, path: &Path) -> Result<Vec<String>, CliError> {
        if self.shape_only { Ok(Vec::new()) } else { model.props().map_err(|e| CliError::file(path, e)) }
    }

    fn options_with(
        &self,
        model: &Model,
        path: &Path,
        parts: &PartArgs,
    ) -> Result<(ReshapeOptions, Vec<String>), CliError> {
        let props = self.props(model, path)?;
        let (rigid, others): (Vec<_>, Vec<_>) =
            parts.rigid.iter().cloned().partition(|name| props.contains(name));
        let mut notices = Vec::new();
        let others: Vec<String> = others.iter().map(|name| with_kind(model, name, &mut notices)).collect();
        let mask = parts.mask.iter().map(|(name, amount)| (with_kind(model, name, &mut notices), *amount));
        let mask: Vec<_> = mask.collect();
        let parts = model.parts(&mask, &others).map_err(|e| CliError::file(path, e))?;
        let (joints, keep_travel) = (self.joints, self.keep_travel);
        let (ground, feet) = (self.ground, self.feet);
        Ok((
            ReshapeOptions { joints, keep_travel, rigid, parts, ground, feet, ..ReshapeOptions::default() },
            notices,
        ))
    }
}

/// Returns the part name. If parts of several kinds share it, prefixes it with the first kind, and adds a notice about
/// the others.
fn with_kind(model: &Model, name: &str, notices: &mut Vec<String>) -> String {
    let Err(SelectError::Ambiguous { choices, .. }) = model.select(name) else { return name.to_owned() };
    let names: Vec<&str> = choices.iter().map(|choice| choice.trim_matches('\'')).collect();
    let [first, others @ ..] = names.as_slice() else { return name.to_owned() };
    notices.push(format!(
        "'{}' means {}; for the other part write {}",
        shown(name),
        shown(first),
        shown(&others.join(" or "))
    ));
    (*first).to_owned()
}
