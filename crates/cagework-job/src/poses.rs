//! Poses of the cage that a job applies, and when an animation shows them.

use cagework_io::{Interpolation, Timeline};
use glam::Vec3;

use crate::error::JobError;

/// A pose of the controls that becomes a morph target.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedPose {
    /// Name of the morph target.
    pub name: String,
    /// Positions of the controls. `[n_controls]`, object units
    pub positions: Vec<Vec3>,
}

/// What the poses of a cage do to a model.
#[derive(Clone, Debug, PartialEq)]
pub enum Poses {
    /// The model takes the shape of this pose. `[n_controls]`, object units
    Shape(Vec<Vec3>),
    /// Each pose becomes a morph target.
    Targets {
        /// Pose whose shape the model takes; `None` for the shape at rest. `[n_controls]`, object units
        base: Option<Vec<Vec3>>,
        /// The poses.
        all: Vec<NamedPose>,
        /// When an animation shows them; `None` without an animation.
        timeline: Option<Timeline>,
    },
}

/// When an animation shows the morph targets. By default one per second.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoseTimes {
    /// Times that the user has given, one per pose. Seconds
    pub times: Option<Vec<f32>>,
    /// Times of the keyframes that the poses are, one per pose; empty if they are not the keyframes of one clip. Seconds
    pub keys: Vec<f32>,
    /// Interpolation that the user has given.
    pub interpolation: Option<Interpolation>,
}

impl Poses {
    /// The shape that the model takes, which has no animation.
    ///
    /// # Errors
    /// If options of animations or expressions are given.
    pub fn shape(positions: Vec<Vec3>, times: &PoseTimes, expressions: bool) -> Result<Self, JobError> {
        let options = [
            ("expressions", expressions),
            ("times", times.times.is_some()),
            ("interpolation", times.interpolation.is_some()),
        ];
        match options.into_iter().find(|(_, is_given)| *is_given) {
            Some((option, _)) => Err(JobError::NoAnimation { option }),
            None => Ok(Self::Shape(positions)),
        }
    }

    /// Morph targets, and an animation of them. Expressions get an animation only with times or an interpolation.
    ///
    /// # Errors
    /// If there are no poses, or the times are not one per pose, within range and ascending.
    pub fn targets(all: Vec<NamedPose>, times: &PoseTimes, expressions: bool) -> Result<Self, JobError> {
        let PoseTimes { times, keys, interpolation } = times;
        let n = all.len();
        if n == 0 {
            return Err(JobError::NoPoses);
        }
        if expressions && times.is_none() && interpolation.is_none() {
            return Ok(Self::Targets { base: None, all, timeline: None });
        }
        let timeline = match times {
            Some(times) if times.len() == n => Timeline::new(times, None)?,
            Some(times) => return Err(JobError::Times { given: times.len(), expected: n }),
            None if keys.len() == n => Timeline::at_keys(keys),
            None => Timeline::every_second(n),
        };
        Ok(Self::Targets {
            base: None,
            all,
            timeline: Some(timeline.with(interpolation.unwrap_or_default())),
        })
    }

    /// When an animation shows the morph targets; `None` without one.
    #[must_use]
    pub fn timeline(&self) -> Option<&Timeline> {
        match self {
            Self::Shape(_) => None,
            Self::Targets { timeline, .. } => timeline.as_ref(),
        }
    }

    /// Returns the pose that the model takes. `[n_controls]`, object units
    ///
    /// # Errors
    /// [`JobError::OnePose`] for morph targets. `what` takes one pose, such as "a capture".
    pub fn require_shape(&self, what: &'static str) -> Result<&[Vec3], JobError> {
        match self {
            Self::Shape(pose) => Ok(pose),
            Self::Targets { all, .. } => Err(JobError::OnePose { what, n: all.len() }),
        }
    }

    /// Number of morph targets.
    pub(crate) fn n_targets(&self) -> usize {
        match self {
            Self::Shape(_) => 0,
            Self::Targets { all, .. } => all.len(),
        }
    }
}
