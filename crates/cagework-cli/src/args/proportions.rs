//! Arguments of `cagework proportions`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use cagework_core::options::{self, Choice, parse_grid};
use cagework_pose::humanoid::Bone;
use cagework_pose::proportions::{FACTOR, PRESETS, Proportion, Proportions};
use clap::builder::PossibleValuesParser;
use clap::error::ErrorKind;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, Error, FromArgMatches};

use super::{CageSource, ModelOutput, ReadArgs, RigArgs, SolveArgs, number, obj_output};

/// Arguments of `cagework proportions`.
#[derive(Args, Debug)]
// The result always stands on the ground of the model.
#[command(mut_arg("ground", |arg| arg.hide(true)))]
#[command(mut_arg("shape_only", |arg| arg.help("Write the mesh only, without skin and clips")))]
#[command(after_help = "Factors are numbers from 0.5 to 2; 1 changes nothing.\n\n\
    The bones are those that a VRM names, or those whose joints have usual names, or else the legs, arms \
    and head that the shape of the skeleton shows. The summary lists them; --bone changes one.\n\n\
    The lowest point of the model, and of each clip, keeps its height. Clothes of the same body follow with `cagework \
    refit`, if --cage gives a cage around body and clothes and --pose-out writes its pose.\n\n\
    Examples:\n  \
    cagework proportions avatar.vrm --leg 1.2 --head 1.15 -o tall.vrm\n  \
    cagework proportions avatar.vrm --preset chibi --left arm=0.8 -o chibi.vrm\n  \
    cagework proportions body.glb --leg 1.2 --save-cage cage.obj --pose-out tall.obj\n  \
    cagework proportions golem.glb --bone leftHand=Grip_L --arm 1.2 -o golem2.glb\n  \
    cagework proportions --presets")]
#[command(group = clap::ArgGroup::new("result").required(true).multiple(true).args(["output", "pose_out", "ranges", "presets"]))]
pub(crate) struct ProportionsArgs {
    /// Rigged humanoid.
    #[arg(help = "Rigged humanoid (.glb, .vrm, .gltf, .fbx)", required_unless_present = "presets")]
    pub(crate) mesh: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) read: ReadArgs,
    #[command(flatten)]
    pub(crate) factors: FactorArgs,
    /// Joint of a humanoid bone that is not found or wrong. Bones are named as in VRM 1.0. May be given several times.
    #[arg(long, value_name = "BONE=JOINT", value_parser = bone)]
    pub(crate) bone: Vec<(Bone, String)>,
    /// Cage: a file; auto or auto:VERTICES for a cage that follows the mesh; hull:VERTICES or box:DIVISIONS.
    #[arg(long, value_name = "CAGE", default_value = "auto")]
    pub(crate) cage: CageSource,
    /// Pose of the cage to which the proportions are added, such as one that `cagework pull` wrote.
    #[arg(long, value_name = "FILE")]
    pub(crate) pose: Option<PathBuf>,
    /// File to write; the extension selects the format.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<ModelOutput>,
    /// Write the pose of the cage; the extension selects the format.
    #[arg(long, value_name = "FILE")]
    pub(crate) pose_out: Option<ModelOutput>,
    /// Write the cage that was used (.obj).
    #[arg(long, value_name = "FILE", value_parser = obj_output)]
    pub(crate) save_cage: Option<PathBuf>,
    /// Also find the factors beyond which parts of this model fold.
    #[arg(long)]
    pub(crate) ranges: bool,
    /// List the presets and their factors.
    #[arg(long, conflicts_with_all = ["output", "pose_out", "save_cage", "ranges"])]
    pub(crate) presets: bool,
    #[arg(short, long, help = options::GRID.about(), default_value = "auto", value_parser = parse_grid)]
    pub(crate) grid: u32,
    #[command(flatten)]
    pub(crate) rig: RigArgs,
    #[command(flatten)]
    pub(crate) solve: SolveArgs,
}

pub(super) fn bone(text: &str) -> Result<(Bone, String), String> {
    let (bone, joint) = text.split_once('=').ok_or("expected BONE=JOINT, such as leftHand=Grip_L")?;
    Ok((bone.parse::<Bone>().map_err(|e| e.to_string())?, joint.to_owned()))
}

/// Factors of the proportions: one option each, options for one side, and presets.
#[derive(Debug)]
pub(crate) struct FactorArgs(pub(crate) Proportions);

impl FactorArgs {
    /// Name of an option in clap.
    fn id(word: &str) -> String {
        format!("factor_{word}")
    }
}

impl Args for FactorArgs {
    fn augment_args(command: Command) -> Command {
        let presets = PossibleValuesParser::new(PRESETS.map(|preset| preset.name));
        let preset = Arg::new(Self::id("preset")).long("preset").value_name("NAME").value_parser(presets);
        let preset = preset.help("Start from the factors of a preset; other factors replace its own");
        let factor = |&(word, proportion): &(&'static str, Proportion)| {
            let facts = proportion.facts();
            let [low, high] = facts.natural;
            Arg::new(Self::id(word))
                .long(word)
                .value_name("FACTOR")
                .value_parser(number::<f64>(FACTOR))
                .help(format!("{}; natural from {low} to {high}", facts.help))
        };
        let side = |side: &'static str| {
            let sided = Proportion::ALL.iter().filter(|(_, proportion)| proportion.facts().is_sided);
            let names: Vec<&str> = sided.map(|(word, _)| *word).collect();
            Arg::new(Self::id(side))
                .long(side)
                .value_name("NAME=FACTOR")
                .action(ArgAction::Append)
                .help(format!("Factor on the {side} only, of {}", names.join(", ")))
        };
        command
            .arg(preset)
            .args(Proportion::ALL.iter().map(factor))
            .args([side("left"), side("right")])
            .next_help_heading(None)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for FactorArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let wrong = |text: String| Error::raw(ErrorKind::ValueValidation, format!("{text}\n"));
        let preset = matches.get_one::<String>(&Self::id("preset")).map(String::as_str);
        let mut named = BTreeMap::new();
        for (word, _) in Proportion::ALL {
            if let Some(factor) = matches.get_one::<f64>(&Self::id(word)) {
                named.insert((*word).to_owned(), *factor);
            }
        }
        for side in ["left", "right"] {
            for text in matches.get_many::<String>(&Self::id(side)).into_iter().flatten() {
                let parsed =
                    text.split_once('=').and_then(|(name, factor)| Some((name, factor.parse().ok()?)));
                let (name, factor) = parsed.ok_or_else(|| {
                    wrong(format!("--{side} {text}: expected NAME=FACTOR, such as leg=1.1"))
                })?;
                named.insert(format!("{side}_{name}"), factor);
            }
        }
        Ok(Self(Proportions::from_preset(preset, &named).map_err(|e| wrong(e.to_string()))?))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}
