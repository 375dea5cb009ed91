//! Arguments for rigged models, and for parts of models that the cage does not bend.

use std::path::Path;

use cagework_io::{Joints, Model, ReshapeOptions, SelectError};
use clap::Args;

use crate::error::CliError;

/// Arguments that select parts of the model which the cage does not bend.
#[derive(Args, Debug)]
pub(crate) struct PartArgs {
    /// Part that keeps its shape, such as buckles, eyes or teeth: each connected piece moves rigidly. The name of a material, a node,
    /// a joint (the vertices it influences most) or an OBJ group; use material:NAME, node:NAME, joint:NAME or group:NAME if several have the name. May be given several times.
    #[arg(long, value_name = "NAME")]
    rigid: Vec<String>,
    /// Part that stays in place, named as for --rigid; with =0.5 after the name it follows half the way. May be given several
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
    /// them, for skeletons that several files share; turn also rotates them with the shape.
    #[arg(long, default_value_t, value_parser = super::words::<Joints>())]
    joints: Joints,
    /// Keep the travel distance of clips; by default it is scaled with the height of the hips.
    #[arg(long)]
    keep_travel: bool,
    #[command(flatten)]
    pub(crate) parts: PartArgs,
    /// Write the mesh only, without skin and clips; several poses still become morph targets.
    #[arg(long = "static")]
    pub(crate) shape_only: bool,
}

impl RigArgs {
    /// Options for deforming a rigged model.
    ///
    /// # Errors
    /// If no part of the model has a given name.
    pub(crate) fn options(&self, model: &Model, path: &Path) -> Result<ReshapeOptions, CliError> {
        self.options_with(model, path, &self.parts)
    }

    /// Options for deforming one of many models, and the given part names that this model does not have.
    ///
    /// # Errors
    /// If a name is ambiguous, or the rig cannot be read.
    pub(crate) fn options_for_one(
        &self,
        model: &Model,
        path: &Path,
    ) -> Result<(ReshapeOptions, Vec<String>), CliError> {
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
        Ok((self.options_with(model, path, &PartArgs { rigid, mask })?, missing))
    }

    /// Part names that `--rigid` and `--mask` give.
    pub(crate) fn part_names(&self) -> impl Iterator<Item = &String> {
        self.parts.rigid.iter().chain(self.parts.mask.iter().map(|(name, _)| name))
    }

    fn props(&self, model: &Model, path: &Path) -> Result<Vec<String>, CliError> {
        if self.shape_only { Ok(Vec::new()) } else { model.props().map_err(|e| CliError::file(path, e)) }
    }

    fn options_with(&self, model: &Model, path: &Path, parts: &PartArgs) -> Result<ReshapeOptions, CliError> {
        let props = self.props(model, path)?;
        let (rigid, others): (Vec<_>, Vec<_>) =
            parts.rigid.iter().cloned().partition(|name| props.contains(name));
        let parts = model.parts(&parts.mask, &others).map_err(|e| CliError::file(path, e))?;
        let (joints, keep_travel) = (self.joints, self.keep_travel);
        Ok(ReshapeOptions { joints, keep_travel, rigid, parts, timeline: None })
    }
}
