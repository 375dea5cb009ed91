//! Heights of the lowest points of models, before and after a deformation.

/// Heights that differ by less than this fraction of the model's diagonal are equal.
pub(super) const MIN_LIFT: f64 = 1e-6;
/// Largest difference of the lengths of the same clip in two files, seconds.
const MAX_SAME_SECONDS: f32 = 1e-3;

/// Heights of the lowest points of one or several models, before and after a deformation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ground {
    rest: Option<[f64; 2]>,
    pub(super) clips: Vec<ClipGround>,
}

/// Lowest point of a model during a clip.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ClipGround {
    pub(super) name: String,
    pub(super) seconds: f32,
    /// Heights before and after the deformation. The height after the deformation includes neither the lift of the rest
    /// shape nor `lift`.
    pub(super) lows: [f64; 2],
    /// Vertical offset of the clip.
    pub(super) lift: f64,
}

impl Ground {
    /// Lowest points at rest, before and after a deformation. Ignored unless both are finite.
    pub(crate) fn at_rest(lows: [f64; 2]) -> Self {
        Self { rest: Some(lows).filter(|lows| lows.iter().all(|low| low.is_finite())), clips: Vec::new() }
    }

    pub(super) fn with(self, clips: Vec<ClipGround>) -> Self {
        Self { clips, ..self }
    }

    /// The ground in another unit, in which all heights are `by` times as large.
    pub(super) fn scaled(&self, by: f64) -> Self {
        let scaled = |lows: [f64; 2]| lows.map(|low| by * low);
        let clip =
            |clip: &ClipGround| ClipGround { lows: scaled(clip.lows), lift: by * clip.lift, ..clip.clone() };
        Self { rest: self.rest.map(scaled), clips: self.clips.iter().map(clip).collect() }
    }

    /// Height by which the models are lifted.
    #[must_use]
    pub fn lift(&self) -> f64 {
        self.rest.map_or(0.0, |[before, after]| before - after)
    }

    /// Adds the lowest points of another model on the same ground.
    pub fn add(&mut self, other: Self) {
        let lowest = |a: [f64; 2], b: [f64; 2]| [0, 1].map(|k| a[k].min(b[k]));
        self.rest = match (self.rest, other.rest) {
            (Some(own), Some(other)) => Some(lowest(own, other)),
            (own, other) => own.or(other),
        };
        for clip in other.clips {
            match self.clips.iter_mut().find(|own| own.is(&clip.name, clip.seconds)) {
                Some(own) => own.lows = lowest(own.lows, clip.lows),
                None => self.clips.push(clip),
            }
        }
    }
}

impl ClipGround {
    pub(super) fn is(&self, name: &str, seconds: f32) -> bool {
        self.name == name && (self.seconds - seconds).abs() <= MAX_SAME_SECONDS
    }
}
