//! Timelines: when a clip shows each pose of a model, and how it interpolates in between. Exports and the preview of
//! the web page use the same timeline.

use cagework_core::choice;
use thiserror::Error;

use crate::error::WriteError;

/// Largest allowed time of a pose, seconds.
pub const MAX_SECONDS: f32 = 3600.0;
/// Smallest allowed time between a pose and the next one, seconds.
pub const MIN_GAP: f32 = 1e-3;
/// Name of the clip that plays poses, unless the user has named it.
const CLIP_NAME: &str = "poses";
/// Time between two poses that have no times of their own, seconds.
pub const SECONDS_PER_POSE: f32 = 1.0;

choice! {
    /// Interpolation between two keys, as in glTF 2.0, appendix C.
    Interpolation {
        /// The earlier shape.
        Step = "step",
        /// Linear interpolation between the two shapes.
        #[default]
        Linear = "linear",
        /// A cubic spline. Its slope at a key is the slope of the line between the neighbouring keys, and zero at the
        /// first and the last key.
        Cubic = "cubic",
    }
}

impl Interpolation {
    /// Value of `interpolation` in a glTF sampler.
    pub(crate) fn in_gltf(self) -> &'static str {
        match self {
            Self::Step => "STEP",
            Self::Linear => "LINEAR",
            Self::Cubic => "CUBICSPLINE",
        }
    }
}

/// Cubic Hermite basis: factors of value and out-tangent at the earlier key, and of value and in-tangent at the later
/// key. `gap`: time between the keys, seconds; `u`: time since the earlier key, as a fraction of `gap`.
pub(crate) fn hermite(u: f64, gap: f64) -> [f64; 4] {
    let (u2, u3) = (u * u, u * u * u);
    [2.0 * u3 - 3.0 * u2 + 1.0, gap * (u3 - 2.0 * u2 + u), 3.0 * u2 - 2.0 * u3, gap * (u3 - u2)]
}

/// Error in the times of poses: a time is out of range, or the times do not ascend.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum TimelineError {
    /// A time is not a number of seconds within the limits.
    #[error("the time of pose {number} is {seconds} s: times are from 0 to {MAX_SECONDS} s")]
    OutOfRange {
        /// Number of the pose, from 1.
        number: usize,
        /// Time given for this pose, seconds.
        seconds: f32,
    },
    /// The time between a pose and the previous one is negative or too short.
    #[error(
        "the time of pose {number} is {seconds} s, but the previous pose is at {previous} s: each pose is at least {MIN_GAP} s later than the previous one"
    )]
    Order {
        /// Number of the pose, from 1.
        number: usize,
        /// Time given for this pose, seconds.
        seconds: f32,
        /// Time of the previous pose, seconds.
        previous: f32,
    },
}

/// Times at which a clip shows each pose, and the interpolation in between.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Timeline {
    /// Times are ascending.
    keys: Vec<TimelineKey>,
    n_poses: usize,
    /// Name of the clip; empty for [`CLIP_NAME`].
    name: String,
}

/// A time of a timeline and the shape that it shows.
#[derive(Clone, Copy, Debug, PartialEq)]
struct TimelineKey {
    seconds: f32,
    /// Index of the pose; `None` is the shape at rest.
    pose: Option<usize>,
    /// Interpolation from the previous key to this one.
    interpolation: Interpolation,
}

impl TimelineKey {
    fn new(seconds: f32, pose: Option<usize>) -> Self {
        Self { seconds, pose, interpolation: Interpolation::Linear }
    }
}

/// A key of a glTF sampler, which shows the shape of the [`TimelineKey`] with index `key`.
struct SamplerKey {
    seconds: f32,
    key: usize,
    /// Indices of the keys at which the segments before and after this sampler key end; `None` if the slope is zero.
    segments: [Option<usize>; 2],
}

impl Timeline {
    /// Creates a timeline of one pose per second that starts and ends at rest.
    #[must_use]
    pub fn every_second(n_poses: usize) -> Self {
        let pose = |k: usize| k.checked_sub(1).filter(|&pose| pose < n_poses);
        let keys = (0..n_poses + 2).map(|k| TimelineKey::new(k as f32 * SECONDS_PER_POSE, pose(k))).collect();
        Self { keys, n_poses, name: String::new() }
    }

    /// Creates a timeline that shows each pose at its time. The clip starts at 0 s, at rest unless the first pose is at
    /// 0 s, and ends with the last pose or, with `seconds_back`, this number of seconds later with its first shape.
    ///
    /// # Errors
    /// If a time is outside the limits, or not later than the previous time.
    pub fn new(seconds: &[f32], seconds_back: Option<f32>) -> Result<Self, TimelineError> {
        check_times(seconds)?;
        let mut keys: Vec<_> =
            seconds.iter().enumerate().map(|(k, &at)| TimelineKey::new(at + 0.0, Some(k))).collect();
        if seconds.first().is_none_or(|&first| first >= 0.5 * MIN_GAP) {
            keys.insert(0, TimelineKey::new(0.0, None));
        }
        if let (Some(back), Some(last)) = (seconds_back, keys.last()) {
            keys.push(TimelineKey::new(last.seconds + back.clamp(MIN_GAP, MAX_SECONDS), keys[0].pose));
        }
        Ok(Self { keys, n_poses: seconds.len(), name: String::new() })
    }

    /// Creates a timeline with one pose at each key time of a clip. `seconds`: ascending, not checked.
    #[must_use]
    pub fn at_keys(seconds: &[f32]) -> Self {
        let keys = seconds.iter().enumerate().map(|(k, &at)| TimelineKey::new(at, Some(k))).collect();
        Self { keys, n_poses: seconds.len(), name: String::new() }
    }

    /// Replaces the interpolation between all keys.
    #[must_use]
    pub fn with(mut self, interpolation: Interpolation) -> Self {
        self.keys.iter_mut().for_each(|key| key.interpolation = interpolation);
        self
    }

    /// Replaces the interpolation towards each pose that has one of its own. `[n_poses]`
    #[must_use]
    pub fn with_own(mut self, own: &[Option<Interpolation>]) -> Self {
        for key in &mut self.keys {
            if let Some(own) = key.pose.and_then(|pose| own.get(pose).copied().flatten()) {
                key.interpolation = own;
            }
        }
        self
    }

    /// Replaces the name of the clip. An empty name stands for "poses".
    #[must_use]
    pub fn named(mut self, name: impl Into<String>) -> Self {
        self.name = name.into();
        self
    }

    /// Name of the clip.
    #[must_use]
    pub fn name(&self) -> &str {
        if self.name.is_empty() { CLIP_NAME } else { &self.name }
    }

    /// Whether a key shows the shape at rest.
    #[must_use]
    pub fn shows_rest(&self) -> bool {
        self.keys.iter().any(|key| key.pose.is_none())
    }

    /// Adds a pose, which takes the place of the shape at rest.
    #[must_use]
    pub fn with_rest_as_pose(mut self) -> Self {
        for key in &mut self.keys {
            key.pose = key.pose.or(Some(self.n_poses));
        }
        self.n_poses += 1;
        self
    }

    /// Interpolation of the glTF samplers: that of all keys if it is the same, or else a cubic spline, whose slopes can
    /// express the others.
    pub(crate) fn interpolation(&self) -> Interpolation {
        match self.keys.get(1..) {
            Some([first, rest @ ..]) if rest.iter().all(|key| key.interpolation == first.interpolation) => {
                first.interpolation
            }
            Some([_, ..]) => Interpolation::Cubic,
            _ => Interpolation::Linear,
        }
    }

    /// Checks that `given`, a number of poses, equals the number of poses in the timeline.
    pub(crate) fn require(&self, given: usize) -> Result<(), WriteError> {
        let expected = self.n_poses;
        if given == expected { Ok(()) } else { Err(WriteError::Poses { given, expected }) }
    }

    /// Number of poses.
    #[must_use]
    pub fn n_poses(&self) -> usize {
        self.n_poses
    }

    /// Time of the last key, seconds; 0 without keys.
    #[must_use]
    pub fn seconds(&self) -> f32 {
        self.keys.last().map_or(0.0, |key| key.seconds)
    }

    /// Computes the share of each pose in the shape at a time: `rest + sum_k share_k (pose_k - rest)`. `[n_poses]`
    #[must_use]
    pub fn shares(&self, seconds: f32) -> Vec<f32> {
        let Some(last) = self.keys.len().checked_sub(1) else { return vec![0.0; self.n_poses] };
        let next = self.keys.partition_point(|key| key.seconds <= seconds);
        if next == 0 || next > last {
            return (0..self.n_poses).map(|pose| self.share(next.min(last), pose) as f32).collect();
        }
        let before = next - 1;
        let start = f64::from(self.keys[before].seconds);
        let gap = f64::from(self.keys[next].seconds) - start;
        let u = (f64::from(seconds) - start) / gap;
        let [a, b, c, d] = match self.keys[next].interpolation {
            Interpolation::Step => [1.0, 0.0, 0.0, 0.0],
            Interpolation::Linear => [1.0 - u, 0.0, u, 0.0],
            Interpolation::Cubic => hermite(u, gap),
        };
        let at = |pose| {
            a * self.share(before, pose)
                + b * self.slope(before, pose)
                + c * self.share(next, pose)
                + d * self.slope(next, pose)
        };
        (0..self.n_poses).map(|pose| at(pose) as f32).collect()
    }

    /// The keys of the clip's samplers. A spline has two keys at the end of a step: the earlier shape just before the
    /// time of the later one.
    fn sampler_keys(&self) -> Vec<SamplerKey> {
        let is_spline = self.interpolation() == Interpolation::Cubic;
        let slope_of = |end: usize| {
            (end < self.keys.len() && self.keys[end].interpolation != Interpolation::Step).then_some(end)
        };
        let mut keys = Vec::new();
        for (k, key) in self.keys.iter().enumerate() {
            let before = (k > 0).then(|| slope_of(k)).flatten();
            if k > 0 && is_spline && before.is_none() {
                keys.push(SamplerKey { seconds: key.seconds.next_down(), key: k - 1, segments: [None; 2] });
            }
            keys.push(SamplerKey { seconds: key.seconds, key: k, segments: [before, slope_of(k + 1)] });
        }
        keys
    }

    /// Times of the keys, the input of the clip's samplers.
    pub(crate) fn times(&self) -> Vec<f32> {
        self.sampler_keys().iter().map(|key| key.seconds).collect()
    }

    /// Computes the output of a sampler of morph weights. `before`: constant weights of the targets that precede the
    /// poses.
    pub(crate) fn weights(&self, before: &[f32]) -> Vec<f32> {
        let mut weights = Vec::new();
        let is_spline = self.interpolation() == Interpolation::Cubic;
        for SamplerKey { key, segments: [earlier, later], .. } in self.sampler_keys() {
            let slopes = |segment: Option<usize>| {
                let slope = move |pose| segment.map_or(0.0, |end| self.slope_in(end, key, pose)) as f32;
                std::iter::repeat_n(0.0, before.len()).chain((0..self.n_poses).map(slope))
            };
            weights.extend(slopes(earlier).filter(|_| is_spline));
            weights.extend(before);
            weights.extend((0..self.n_poses).map(|pose| self.share(key, pose) as f32));
            weights.extend(slopes(later).filter(|_| is_spline));
        }
        weights
    }

    fn share(&self, key: usize, pose: usize) -> f64 {
        f64::from(u8::from(self.keys[key].pose == Some(pose)))
    }

    /// Slope at a key of the segment that ends at the key `end`.
    fn slope_in(&self, end: usize, key: usize, pose: usize) -> f64 {
        if self.keys[end].interpolation == Interpolation::Cubic {
            return self.slope(key, pose);
        }
        let time = f64::from(self.keys[end].seconds) - f64::from(self.keys[end - 1].seconds);
        (self.share(end, pose) - self.share(end - 1, pose)) / time.max(f64::from(MIN_GAP))
    }

    fn slope(&self, key: usize, pose: usize) -> f64 {
        if key == 0 || key + 1 == self.keys.len() {
            return 0.0;
        }
        let time = f64::from(self.keys[key + 1].seconds) - f64::from(self.keys[key - 1].seconds);
        // Times of keys that were read from a clip can be equal, so the divisor has a lower limit.
        (self.share(key + 1, pose) - self.share(key - 1, pose)) / time.max(f64::from(MIN_GAP))
    }
}

/// Checks that times of poses are within the limits and ascending.
///
/// # Errors
/// [`TimelineError`] for the first pose whose time is wrong.
pub fn check_times(seconds: &[f32]) -> Result<(), TimelineError> {
    let mut previous: Option<f32> = None;
    for (number, &seconds) in (1..).zip(seconds) {
        if !(0.0..=MAX_SECONDS).contains(&seconds) {
            return Err(TimelineError::OutOfRange { number, seconds });
        }
        // The limit is half of `MIN_GAP`, because f32 times near `MAX_SECONDS` are rounded to multiples of 0.0002 s.
        if let Some(previous) = previous.filter(|previous| seconds - previous < 0.5 * MIN_GAP) {
            return Err(TimelineError::Order { number, seconds, previous });
        }
        previous = Some(seconds);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(shares: &[f32], expected: &[f32]) {
        assert!(shares.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{shares:?} {expected:?}");
    }

    #[test]
    fn one_pose_per_second_from_rest_to_rest() {
        let timeline = Timeline::every_second(2);
        assert_eq!((timeline.seconds(), timeline.times()), (3.0, vec![0.0, 1.0, 2.0, 3.0]));
        // A quarter of the way from rest to the first pose, rest is the pose after the last one.
        assert!(timeline.shows_rest());
        near(&timeline.clone().with_rest_as_pose().shares(0.25), &[0.25, 0.0, 0.75]);
        assert_eq!([timeline.name(), timeline.clone().named("wave").name()], ["poses", "wave"]);
        for (seconds, expected) in [
            (0.0, [0.0, 0.0]),
            (0.25, [0.25, 0.0]),
            (1.0, [1.0, 0.0]),
            (1.5, [0.5, 0.5]),
            (2.0, [0.0, 1.0]),
            (2.75, [0.0, 0.25]),
            (3.0, [0.0, 0.0]),
        ] {
            near(&timeline.shares(seconds), &expected);
        }
        assert_eq!(Timeline::every_second(0).shares(0.7), [0.0; 0]);
    }

    #[test]
    fn poses_are_shown_at_their_times() {
        let timeline = Timeline::new(&[0.0, 0.4, 1.2], None).unwrap();
        assert_eq!((timeline.seconds(), timeline.times()), (1.2, vec![0.0, 0.4, 1.2]));
        near(&timeline.shares(0.1), &[0.75, 0.25, 0.0]);
        assert!(!timeline.shows_rest());
        near(&timeline.shares(1.0), &[0.0, 0.25, 0.75]);
        near(&timeline.shares(9.0), &[0.0, 0.0, 1.0]);
        let step = timeline.clone().with(Interpolation::Step);
        near(&step.shares(0.39), &[1.0, 0.0, 0.0]);
        near(&step.shares(0.4), &[0.0, 1.0, 0.0]);
        near(&step.shares(1.2), &[0.0, 0.0, 1.0]);
        // Without a pose at 0 s, the clip starts at rest and, with `seconds_back`, also ends at rest.
        let back = Timeline::new(&[0.5], Some(1.5)).unwrap();
        assert_eq!((back.times(), back.weights(&[])), (vec![0.0, 0.5, 2.0], vec![0.0, 1.0, 0.0]));
        // With a pose at 0 s and `seconds_back`, the clip ends with this pose.
        near(&Timeline::new(&[0.0, 1.0], Some(1.0)).unwrap().shares(2.0), &[1.0, 0.0]);
    }

    /// The formula of glTF 2.0, appendix C, "Cubic spline interpolation", with slopes at the inner keys of
    /// (v_(k+1) - v_(k-1)) / (t_(k+1) - t_(k-1)), the Catmull-Rom spline for uneven times.
    #[test]
    fn cubic_is_the_spline_of_gltf() {
        let timeline = Timeline::new(&[0.0, 0.4, 1.2], None).unwrap().with(Interpolation::Cubic);
        let (t, td) = (0.25_f64, f64::from(0.4_f32));
        let (h00, h01) = (2.0 * t.powi(3) - 3.0 * t.powi(2) + 1.0, -2.0 * t.powi(3) + 3.0 * t.powi(2));
        let h11 = t.powi(3) - t.powi(2);
        // In-tangents at 0.4 s: -1/1.2, 0 and 1/1.2.
        let expected = [h00 - td * h11 / 1.2, h01, td * h11 / 1.2].map(|x| x as f32);
        near(&timeline.shares(0.1), &expected);
        let m = (1.0 / f64::from(1.2_f32)) as f32;
        let outer = |values: [f32; 3]| [[0.0; 3], values, [0.0; 3]].concat();
        let inner = [[-m, 0.0, m], [0.0, 1.0, 0.0], [-m, 0.0, m]].concat();
        assert_eq!(timeline.weights(&[]), [outer([1.0, 0.0, 0.0]), inner, outer([0.0, 0.0, 1.0])].concat());
        // Targets before the poses keep their weights, with slopes of zero.
        assert_eq!(timeline.weights(&[0.5])[..8], [0.0, 0.0, 0.0, 0.0, 0.5, 1.0, 0.0, 0.0]);
    }

    /// Played by the formula of glTF 2.0, appendix C, the sampler of a timeline with three interpolations gives the shares
    /// that the page shows: u for linear, none until the end for step.
    #[test]
    fn each_pose_has_its_own_interpolation() {
        let own = [None, Some(Interpolation::Step), Some(Interpolation::Cubic)];
        let timeline = Timeline::new(&[1.0, 2.0, 3.0], Some(1.0)).unwrap().with_own(&own);
        near(&timeline.shares(0.25), &[0.25, 0.0, 0.0]);
        near(&timeline.shares(1.99), &[1.0, 0.0, 0.0]);
        near(&timeline.shares(2.0), &[0.0, 1.0, 0.0]);
        near(&timeline.shares(3.75), &[0.0, 0.0, 0.25]);
        assert_eq!(timeline.interpolation(), Interpolation::Cubic);
        let (times, weights) = (timeline.times(), timeline.weights(&[]));
        assert_eq!(times, [0.0, 1.0, 2.0_f32.next_down(), 2.0, 3.0, 4.0]);
        let played = |seconds: f32| -> Vec<f32> {
            let k = times.partition_point(|&time| time <= seconds) - 1;
            let (gap, t) = (times[k + 1] - times[k], (seconds - times[k]) / (times[k + 1] - times[k]));
            let of = |key: usize, part: usize, pose: usize| weights[9 * key + 3 * part + pose];
            let at = |pose| {
                (2.0 * t.powi(3) - 3.0 * t.powi(2) + 1.0) * of(k, 1, pose)
                    + gap * (t.powi(3) - 2.0 * t.powi(2) + t) * of(k, 2, pose)
                    + (3.0 * t.powi(2) - 2.0 * t.powi(3)) * of(k + 1, 1, pose)
                    + gap * (t.powi(3) - t.powi(2)) * of(k + 1, 0, pose)
            };
            (0..3).map(at).collect()
        };
        for step in 0..80 {
            let seconds = step as f32 * 0.05;
            near(&timeline.shares(seconds), &played(seconds));
        }
    }

    #[test]
    fn wrong_times_are_named() {
        let error = |seconds: &[f32]| Timeline::new(seconds, None).unwrap_err().to_string();
        assert_eq!(error(&[0.0, -1.0]), "the time of pose 2 is -1 s: times are from 0 to 3600 s");
        assert!(error(&[f32::NAN]).contains("is NaN s"));
        assert!(error(&[f32::INFINITY]).contains("is inf s"));
        assert!(error(&[4000.0]).contains("is 4000 s"));
        assert_eq!(
            error(&[0.4, 0.4]),
            "the time of pose 2 is 0.4 s, but the previous pose is at 0.4 s: each pose is at least 0.001 s later than the previous one"
        );
        assert!(Timeline::new(&[0.001, 0.002, 3599.999, 3600.0], None).is_ok());
    }
}
