//! What becomes of a rig.

use std::path::Path;

use cagework_io::{Joints, Model, ReshapeOptions};
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
    /// What joints do: follow the cage and keep their directions; stay where they are, for skeletons that other files share; or
    /// turn with the shape as well.
    #[arg(long, value_enum, default_value_t = JointsArg::Follow)]
    joints: JointsArg,
    /// Keep how far clips travel; otherwise it grows with the height of the joint.
    #[arg(long)]
    keep_travel: bool,
    #[command(flatten)]
    pub(crate) parts: PartArgs,
    /// Experimental: let the cage bend the model while a clip moves it, instead of its shape at rest; writes the clip's frames as
    /// morph targets, without skeleton.
    #[arg(long, value_name = "CLIP", conflicts_with_all = ["weights", "joints", "keep_travel", "rigid", "mask", "plain"])]
    pub(crate) dynamic: Option<String>,
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
        let joints = match self.joints {
            JointsArg::Follow => Joints::Follow,
            JointsArg::Stay => Joints::Stay,
            JointsArg::Turn => Joints::Turn,
        };
        let props =
            if self.plain { Vec::new() } else { model.props().map_err(|e| CliError::file(path, e))? };
        let (rigid, others): (Vec<_>, Vec<_>) =
            self.parts.rigid.iter().cloned().partition(|name| props.contains(name));
        let parts = model.parts(&self.parts.mask, &others).map_err(|e| CliError::file(path, e))?;
        Ok(ReshapeOptions { joints, keep_travel: self.keep_travel, rigid, parts })
    }
}
