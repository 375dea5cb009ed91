//! What becomes of a rig.

use std::path::Path;

use cagework_io::{Joints, Model, ReshapeOptions, SelectError};
use clap::{Args, ValueEnum};

use crate::error::CliError;

/// What of a model the cage does not bend.
#[derive(Args, Debug)]
pub(crate) struct PartArgs {
    /// A part that keeps its shape, piece by piece: buckles, eyes, teeth. The name of a material, a node, a joint (the vertices
    /// it holds most) or an OBJ group; where several have it, material:NAME, node:NAME and so on. May be given several times.
    #[arg(long, value_name = "NAME")]
    rigid: Vec<String>,
    /// A part that stays as it is, named in the same way; =0.5 after the name lets it follow half the way. May be given several
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
    Err(format!("the amount {amount} is not between 0, which follows the cage, and 1, which stays"))
}

/// How a rigged model is deformed.
#[derive(Args, Debug)]
pub(crate) struct RigArgs {
    /// What joints, and other nodes that clips move or that carry meshes, do: follow the cage and keep their directions; stay where they are, for skeletons that other files share; or
    /// turn with the shape as well.
    #[arg(long, value_enum, default_value_t = JointsArg::Follow)]
    joints: JointsArg,
    /// Keep how far clips travel; otherwise it grows as the height of the hips does.
    #[arg(long)]
    keep_travel: bool,
    #[command(flatten)]
    pub(crate) parts: PartArgs,
    /// Write the shape alone: no skin, no morph targets but those of several poses.
    #[arg(long = "static")]
    pub(crate) plain: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum JointsArg {
    Follow,
    Stay,
    Turn,
}

impl RigArgs {
    /// As the library takes them.
    ///
    /// # Errors
    /// When the model has no part of a name.
    pub(crate) fn options(&self, model: &Model, path: &Path) -> Result<ReshapeOptions, CliError> {
        self.options_with(model, path, &self.parts)
    }

    /// As the library takes them for one of many models: without the names of parts that it does not have, which come back.
    ///
    /// # Errors
    /// When a name means several parts, or the rig cannot be read.
    pub(crate) fn options_of_one(
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

    /// Names of parts that something is to become of.
    pub(crate) fn part_names(&self) -> impl Iterator<Item = &String> {
        self.parts.rigid.iter().chain(self.parts.mask.iter().map(|(name, _)| name))
    }

    fn props(&self, model: &Model, path: &Path) -> Result<Vec<String>, CliError> {
        if self.plain { Ok(Vec::new()) } else { model.props().map_err(|e| CliError::file(path, e)) }
    }

    fn options_with(&self, model: &Model, path: &Path, parts: &PartArgs) -> Result<ReshapeOptions, CliError> {
        let joints = match self.joints {
            JointsArg::Follow => Joints::Follow,
            JointsArg::Stay => Joints::Stay,
            JointsArg::Turn => Joints::Turn,
        };
        let props = self.props(model, path)?;
        let (rigid, others): (Vec<_>, Vec<_>) =
            parts.rigid.iter().cloned().partition(|name| props.contains(name));
        let parts = model.parts(&parts.mask, &others).map_err(|e| CliError::file(path, e))?;
        Ok(ReshapeOptions { joints, keep_travel: self.keep_travel, rigid, parts, pose_seconds: Vec::new() })
    }
}
