//! Animation clips, evaluated at a time.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DQuat, DVec3};
use serde_json::Value;

use crate::gltf::channels::{ChannelTarget, channel_target};
use crate::gltf::{GltfDocument, GltfError};
use crate::timeline::{Interpolation, hermite};

/// An animation of a glTF, which can be evaluated at any time.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Clip {
    /// Name, if any.
    pub name: Option<String>,
    /// Duration from time 0 to the last key, seconds.
    pub seconds: f32,
    /// Number of playable channels: transforms of nodes and morph weights.
    pub channels: usize,
    /// Number of keys in all channels.
    pub keys: usize,
    #[serde(skip)]
    tracks: Vec<(ChannelTarget, Track)>,
}

/// Keys of one animation channel.
#[derive(Clone, Debug, PartialEq)]
struct Track {
    times: Numbers,
    /// `[n_keys, width]`; for cubic splines, which have tangents, `[n_keys, 3, width]`.
    values: Numbers,
    width: usize,
    interpolation: Interpolation,
}

/// Numbers of an accessor. Tracks that use the same accessor share them.
type Numbers = Arc<[f32]>;

/// Cache of decoded accessors by index and element width, with a flag for ascending values. `None` if
/// decoding failed or a value is not finite.
type AccessorCache = HashMap<(u32, usize), Option<(Numbers, bool)>>;

/// The clips of a document. Unreadable channels are left out.
pub(crate) fn clips(document: &GltfDocument) -> Vec<Clip> {
    let mut decoded = AccessorCache::new();
    let animations = document.json["animations"].as_array().into_iter().flatten();
    animations
        .map(|animation| {
            let mut clip = Clip { name: animation["name"].as_str().map(str::to_owned), ..Clip::default() };
            for channel in animation["channels"].as_array().into_iter().flatten() {
                let read = channel_target(channel).and_then(|driven| {
                    let sampler = animation["samplers"].get(channel["sampler"].as_u64()? as usize)?;
                    Some((driven, Track::read(document, sampler, driven, &mut decoded)?))
                });
                clip.tracks.extend(read);
            }
            clip.channels = clip.tracks.len();
            clip.keys = clip.tracks.iter().map(|(_, track)| track.times.len()).sum();
            let last = clip.tracks.iter().filter_map(|(_, track)| track.times.last().copied());
            clip.seconds = last.fold(0.0, f32::max);
            clip
        })
        .collect()
}

impl Clip {
    /// Times of all keys of all channels, seconds, ascending.
    pub(crate) fn times(&self) -> Vec<f32> {
        let mut times: Vec<f32> =
            self.tracks.iter().flat_map(|(_, track)| track.times.iter().copied()).collect();
        times.sort_unstable_by(f32::total_cmp);
        times.dedup();
        times
    }

    /// Times at which STEP tracks jump, seconds, ascending.
    pub(super) fn jumps(&self) -> Vec<f32> {
        let steps = self.tracks.iter().filter(|(_, track)| track.interpolation == Interpolation::Step);
        let jumps = steps.flat_map(|(_, track)| {
            let values: Vec<&[f32]> = track.values.chunks(track.width).collect();
            let jumps = (1..values.len()).filter(move |&k| values[k] != values[k - 1]);
            jumps.map(|k| track.times[k])
        });
        let mut times: Vec<f32> = jumps.collect();
        times.sort_unstable_by(f32::total_cmp);
        times.dedup();
        times
    }

    /// Whether all nodes stand still between the keys, because the tracks of their transforms are STEP.
    pub(super) fn is_stepped(&self) -> bool {
        let is_weights = |driven| matches!(driven, ChannelTarget::Weights(_) | ChannelTarget::MeshWeights(_));
        let is_step = |track: &Track| track.interpolation == Interpolation::Step;
        self.tracks.iter().all(|(driven, track)| is_weights(*driven) || is_step(track))
    }

    /// Nodes whose transforms the clip animates; a node occurs once per channel.
    pub(super) fn nodes(&self) -> impl Iterator<Item = usize> {
        self.tracks.iter().filter_map(|(driven, _)| match *driven {
            ChannelTarget::Translation(n) | ChannelTarget::Rotation(n) | ChannelTarget::Scale(n) => Some(n),
            ChannelTarget::Weights(_) | ChannelTarget::MeshWeights(_) => None,
        })
    }

    /// The value of each channel at a time, seconds.
    pub(super) fn at(&self, time: f32) -> impl Iterator<Item = (ChannelTarget, Vec<f64>)> {
        self.tracks.iter().map(move |(driven, track)| (*driven, track.at(time, *driven)))
    }
}

impl Track {
    fn read(
        document: &GltfDocument,
        sampler: &Value,
        driven: ChannelTarget,
        decoded: &mut AccessorCache,
    ) -> Option<Self> {
        let mut numbers = |key: &str, width: usize| {
            let accessor = sampler[key].as_u64()? as u32;
            let read = || {
                let numbers = numbers(document, accessor, width).ok()?;
                let is_sorted = numbers.is_sorted();
                numbers.iter().all(|x| x.is_finite()).then_some((numbers, is_sorted))
            };
            decoded.entry((accessor, width)).or_insert_with(read).clone()
        };
        let (times, is_sorted) = numbers("input", 1)?;
        let width = match driven {
            ChannelTarget::Translation(_) | ChannelTarget::Scale(_) => 3,
            ChannelTarget::Rotation(_) => 4,
            ChannelTarget::Weights(_) | ChannelTarget::MeshWeights(_) => 1,
        };
        let (values, _) = numbers("output", width)?;
        let interpolation = match sampler["interpolation"].as_str() {
            Some("STEP") => Interpolation::Step,
            Some("CUBICSPLINE") => Interpolation::Cubic,
            _ => Interpolation::Linear,
        };
        let per_key = if interpolation == Interpolation::Cubic { 3 } else { 1 };
        // Each key has one weight per morph target.
        let width = if width == 1 { values.len() / (per_key * times.len()).max(1) } else { width };
        let is_right =
            !times.is_empty() && width > 0 && values.len() == width * per_key * times.len() && is_sorted;
        is_right.then_some(Self { times, values, width, interpolation })
    }

    /// Value at a time, interpolated as in glTF 2.0, appendix C.
    fn at(&self, time: f32, driven: ChannelTarget) -> Vec<f64> {
        let n = self.times.len();
        let time = time.clamp(self.times[0], self.times[n - 1]);
        let next = self.times.partition_point(|&t| t <= time).clamp(1, n.max(2) - 1).min(n - 1);
        let last = next.saturating_sub(1);
        let gap = f64::from(self.times[next]) - f64::from(self.times[last]);
        let share = if gap > 0.0 { (f64::from(time) - f64::from(self.times[last])) / gap } else { 1.0 };
        let is_rotation = matches!(driven, ChannelTarget::Rotation(_));
        let w = self.width;
        let of = |at: usize| self.values[at * w..(at + 1) * w].iter().map(|&x| f64::from(x));
        match self.interpolation {
            Interpolation::Step => of(if share >= 1.0 { next } else { last }).collect(),
            Interpolation::Cubic => {
                let [a, b, c, d] = hermite(share, gap);
                let (p, m) = (of(3 * last + 1), of(3 * last + 2));
                let (q, n) = (of(3 * next + 1), of(3 * next));
                p.zip(m).zip(q.zip(n)).map(|((p, m), (q, n))| a * p + b * m + c * q + d * n).collect()
            }
            Interpolation::Linear if is_rotation => {
                let [from, to] = [last, next].map(|k| quaternion(&of(k).collect::<Vec<_>>()));
                // Of the two arcs between the rotations, take the shorter one.
                let to = if from.dot(to) < 0.0 { -to } else { to };
                from.slerp(to, share).to_array().to_vec()
            }
            Interpolation::Linear => of(last).zip(of(next)).map(|(a, b)| a + share * (b - a)).collect(),
        }
    }
}

/// Numbers of an accessor whose elements have `width` components.
fn numbers(document: &GltfDocument, accessor: u32, width: usize) -> Result<Numbers, GltfError> {
    let source = document.source();
    Ok(match width {
        1 => source.floats::<1>(accessor, "times or weights")?.as_flattened().into(),
        3 => source.floats::<3>(accessor, "a vector")?.as_flattened().into(),
        _ => source.floats::<4>(accessor, "a rotation")?.as_flattened().into(),
    })
}

/// Converts `[x, y, z, w]` to a unit quaternion; the identity if all four are zero.
pub(super) fn quaternion(q: &[f64]) -> DQuat {
    let q = DQuat::from_xyzw(q[0], q[1], q[2], q[3]);
    if q.length_squared() > 0.0 { q.normalize() } else { DQuat::IDENTITY }
}

pub(super) fn vector(v: &[f64]) -> DVec3 {
    DVec3::new(v[0], v[1], v[2])
}
