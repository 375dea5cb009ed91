//! Options of a job, and the parts that they name.

use cagework_io::{Feet, Joints, Model, ReshapeOptions, SelectError, shown};

use crate::error::JobError;

/// How a model is deformed and written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JobOptions {
    /// Options of skeletons, clips and poses. `rigid` names parts of any kind that keep their shape: nodes, materials,
    /// joints or groups. `parts` is replaced by the parts that are named.
    pub reshape: ReshapeOptions,
    /// Parts that stay in place, each with the share of its displacement that is suppressed, 0 to 1.
    pub mask: Vec<(String, f32)>,
    /// Whether only the shape is written, without skeleton, morph targets and clips.
    pub shape_only: bool,
    /// Index of a clip whose frames are written as morph targets, each bent by the cage.
    pub clip: Option<usize>,
    /// Cells along the longest side of the cage in the lattice that deforms splats and points. `None` for the usual
    /// number.
    pub cells: Option<u32>,
    /// Whether the same options apply to many models: parts that this model lacks are skipped, as are options that have
    /// no effect on it.
    pub ignores_unused: bool,
}

/// Options of a rig with the parts of one model, and what the user should know about the names of these parts.
#[derive(Clone, Debug, Default)]
pub(crate) struct ResolvedOptions {
    pub(crate) reshape: ReshapeOptions,
    /// Names that the model lacks.
    pub(crate) missing: Vec<String>,
    pub(crate) notices: Vec<String>,
}

impl JobOptions {
    /// Name of the first option that is set and changes the shape of parts or the height of a model; `None` if there is
    /// none. Captures have no parts.
    #[must_use]
    pub fn first_for_parts(&self) -> Option<&'static str> {
        let ReshapeOptions { rigid, ground, .. } = &self.reshape;
        first(&[("ground", *ground), ("rigid", !rigid.is_empty()), ("mask", !self.mask.is_empty())])
    }

    /// Name of the first option that is set and applies to rigs; `None` if there is none.
    #[must_use]
    pub fn first_for_rigs(&self) -> Option<&'static str> {
        let ReshapeOptions { joints, keep_travel, feet, expressions, skeleton, .. } = &self.reshape;
        first(&[
            ("joints", *joints != Joints::default()),
            ("feet", *feet != Feet::default()),
            ("keep-travel", *keep_travel),
            ("static", self.shape_only),
            ("expression", *expressions),
            ("skeleton", skeleton.is_some()),
        ])
    }

    /// Selects the named parts of a model. Parts that hang on joints are passed to the rig if the file keeps it. A name
    /// that parts of several kinds share means the first of them, with a notice.
    ///
    /// # Errors
    /// If the model lacks a part, unless the options are for many models, or if the rig cannot be read.
    pub(crate) fn resolve(&self, model: &Model, keeps_rig: bool) -> Result<ResolvedOptions, JobError> {
        let props = if keeps_rig { model.props()? } else { Vec::new() };
        let (mut missing, mut notices) = (Vec::new(), Vec::new());
        let mut find = |name: &String| -> Option<String> {
            match model.select(name) {
                Err(SelectError::Unknown { .. }) if self.ignores_unused => {
                    missing.push(name.clone());
                    None
                }
                Err(SelectError::Ambiguous { choices, .. }) => Some(first_of(name, &choices, &mut notices)),
                _ => Some(name.clone()),
            }
        };
        let (rigid, others): (Vec<_>, Vec<_>) =
            self.reshape.rigid.iter().cloned().partition(|name| props.contains(name));
        let others: Vec<_> = others.iter().filter_map(&mut find).collect();
        let mask: Vec<_> =
            self.mask.iter().filter_map(|(name, amount)| Some((find(name)?, *amount))).collect();
        let parts = model.parts(&mask, &others)?;
        Ok(ResolvedOptions {
            reshape: ReshapeOptions { rigid, parts, ..self.reshape.clone() },
            missing,
            notices,
        })
    }
}

fn first(options: &[(&'static str, bool)]) -> Option<&'static str> {
    options.iter().find_map(|(option, is_given)| is_given.then_some(*option))
}

/// Returns the first of several parts with the same name, and adds a notice about the others.
fn first_of(name: &str, choices: &[String], notices: &mut Vec<String>) -> String {
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
