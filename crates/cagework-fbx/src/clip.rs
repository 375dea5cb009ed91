//! Animation clips, baked to keys that glTF interpolates in the same way.

use std::collections::HashMap;

use glam::{Quat, Vec3};
use serde_json::json;
use ufbx::{AnimStack, BakeOpts, BakedAnim, BakedAnimRoot, BakedQuat, BakedVec3, Scene};

use crate::document::Document;
use crate::limits::{FbxError, Shares};
use crate::mesh::Morphed;
use crate::node::{Nodes, Rest, rotation, vector};

/// Property of a channel that is its weight, percent.
const WEIGHT: &str = "DeformPercent";

/// Name of the clip of a saved pose.
const SAVED_POSE: &str = "saved pose";

/// Range of [`sample_rate`], Hz. Between two samples, a movement bends little, and files stay small.
const MIN_RATE: f64 = 30.0;
const MAX_RATE: f64 = 120.0;

/// A clip that is being written.
struct Clip<'a> {
    document: &'a mut Document,
    samplers: Vec<serde_json::Value>,
    channels: Vec<serde_json::Value>,
    /// Time of the clip's start and end in the FBX file, seconds.
    range: [f64; 2],
}

/// Writes all clips. Keys outside the time range of a clip are left out.
pub(crate) fn write(
    scene: &Scene,
    nodes: &Nodes,
    morphed: &[Morphed],
    saved: &[Option<Rest>],
    shares: Shares,
    document: &mut Document,
) -> Result<(), FbxError> {
    let mut n_clips = 0;
    for stack in &scene.anim_stacks {
        let baked = bake(scene, stack, shares)?;
        let mut clip = Clip { document, samplers: Vec::new(), channels: Vec::new(), range: range(&baked) };
        let mut still = saved.to_vec();
        clip.write_nodes(scene, &baked, nodes, &mut still)?;
        clip.write_weights(&baked, morphed)?;
        clip.hold(&still, nodes)?;
        n_clips += usize::from(clip.finish(&stack.element.name)?);
    }
    if n_clips == 0 && !saved.is_empty() {
        let mut clip = Clip { document, samplers: Vec::new(), channels: Vec::new(), range: [0.0; 2] };
        clip.hold(saved, nodes)?;
        clip.finish(SAVED_POSE)?;
    }
    Ok(())
}

fn bake(scene: &Scene, stack: &AnimStack, shares: Shares) -> Result<BakedAnimRoot, FbxError> {
    let options = BakeOpts {
        temp_allocator: shares.allocator(),
        result_allocator: shares.allocator(),
        resample_rate: sample_rate(scene.settings.frames_per_second),
        key_reduction_enabled: true,
        key_reduction_rotation: true,
        ..BakeOpts::default()
    };
    ufbx::bake_anim(scene, &stack.anim, options).map_err(|error| shares.fault(&error))
}

/// Samples per second of curves that are not linear: a multiple of the file's frame rate, so that frames are exact.
fn sample_rate(frames_per_second: f64) -> f64 {
    let rate = if (1.0..=MAX_RATE).contains(&frames_per_second) { frames_per_second } else { MIN_RATE };
    rate * (MIN_RATE / rate).ceil()
}

/// Start and end of a clip: those that the file declares, or the first and last key if no key is between these.
fn range(baked: &BakedAnim) -> [f64; 2] {
    let keys = [baked.key_time_min, baked.key_time_max];
    let declared = [baked.playback_time_begin, baked.playback_time_end];
    let is_shown = declared[0] < declared[1] && keys[0] < declared[1] && keys[1] > declared[0];
    if is_shown { declared } else { keys }
}

impl Clip<'_> {
    /// Adds the clip to the document if it moves anything, and returns whether it does.
    fn finish(self, name: &str) -> Result<bool, FbxError> {
        let Self { document, samplers, channels, .. } = self;
        if channels.is_empty() {
            return Ok(false);
        }
        document.push("animations", json!({ "name": name, "samplers": samplers, "channels": channels }))?;
        Ok(true)
    }

    /// Keeps nodes in these transforms, with one key each.
    fn hold(&mut self, transforms: &[Option<Rest>], nodes: &Nodes) -> Result<(), FbxError> {
        for (node, held) in transforms.iter().enumerate() {
            let Some(held) = held else { continue };
            let rest = nodes.rest[node];
            self.write_vectors(&[0.0], &[held.translation], rest.translation, node, "translation")?;
            self.write_vectors(&[0.0], &[held.scale], rest.scale, node, "scale")?;
            self.write_rotations(&[0.0], &[held.rotation], rest.rotation, node)?;
        }
        Ok(())
    }

    /// Writes keys unless all equal the transform at rest.
    fn write_vectors(
        &mut self,
        times: &[f32],
        values: &[Vec3],
        rest: Vec3,
        node: usize,
        path: &str,
    ) -> Result<(), FbxError> {
        let is_rest = values.iter().all(|value| value.abs_diff_eq(rest, 1e-6 * rest.length()));
        if !is_rest && values.iter().all(|value| value.is_finite()) {
            let values: Vec<[f32; 3]> = values.iter().map(Vec3::to_array).collect();
            let values = self.document.floats(&values, None, false)?;
            self.add(times, values, node, path)?;
        }
        Ok(())
    }

    fn write_rotations(
        &mut self,
        times: &[f32],
        values: &[Quat],
        rest: Quat,
        node: usize,
    ) -> Result<(), FbxError> {
        let is_rest = values.iter().all(|value| value.dot(rest).abs() > 1.0 - 1e-7);
        if !is_rest && values.iter().all(|value| value.is_finite()) {
            let values: Vec<[f32; 4]> = values.iter().map(|value| value.to_array()).collect();
            let values = self.document.floats(&values, None, false)?;
            self.add(times, values, node, "rotation")?;
        }
        Ok(())
    }

    /// Writes translations, rotations and scales. Removes the nodes that the clip moves from `still`.
    fn write_nodes(
        &mut self,
        scene: &Scene,
        baked: &BakedAnim,
        nodes: &Nodes,
        still: &mut [Option<Rest>],
    ) -> Result<(), FbxError> {
        for keys in &*baked.nodes {
            let node = scene.nodes.get(keys.typed_id as usize).and_then(|node| nodes.number(node));
            let Some(node) = node else { continue };
            if let Some(held) = still.get_mut(node) {
                *held = None;
            }
            let rest = nodes.rest[node];
            let paths = [
                ("translation", &keys.translation_keys, keys.constant_translation, rest.translation),
                ("scale", &keys.scale_keys, keys.constant_scale, rest.scale),
            ];
            for (path, keys, is_constant, rest) in paths {
                let (times, values) = self.cut_vectors(keys, is_constant);
                self.write_vectors(&times, &values, rest, node, path)?;
            }
            let (times, values) = self.cut_rotations(&keys.rotation_keys, keys.constant_rotation);
            self.write_rotations(&times, &values, rest.rotation, node)?;
        }
        Ok(())
    }

    /// Writes weights of morph targets. glTF animates all targets of a node together.
    fn write_weights(&mut self, baked: &BakedAnim, morphed: &[Morphed]) -> Result<(), FbxError> {
        let mut keys: HashMap<u32, &[BakedVec3]> = HashMap::new();
        for element in &*baked.elements {
            if let Some(prop) = element.props.iter().find(|prop| *prop.name == *WEIGHT) {
                keys.insert(element.element_id, &prop.keys);
            }
        }
        for Morphed { node, targets } in morphed {
            let own: Vec<Option<&[BakedVec3]>> =
                targets.iter().map(|target| keys.get(&target.channel).copied()).collect();
            let mut times: Vec<f64> = Vec::new();
            for keys in own.iter().flatten() {
                times.extend(self.cut(keys.iter().map(|key| key.time)));
            }
            times.sort_by(f64::total_cmp);
            let times = distinct(times, self.range[0]);
            if times.is_empty() {
                continue;
            }
            self.document.reserve(times.len() * targets.len(), 8)?;
            let mut weights = Vec::new();
            for &(time, _) in &times {
                for (target, keys) in targets.iter().zip(&own) {
                    let weight = keys.map_or(target.weight, |keys| {
                        (ufbx::evaluate_baked_vec3(keys, time).x / (100.0 * target.full)) as f32
                    });
                    weights.push([if weight.is_finite() { weight } else { 0.0 }]);
                }
            }
            let values = self.document.floats(&weights, None, false)?;
            let times: Vec<f32> = times.into_iter().map(|(_, time)| time).collect();
            self.add(&times, values, *node, "weights")?;
        }
        Ok(())
    }

    /// Times of keys within the clip, with its start and end if keys are outside.
    fn cut(&self, times: impl Iterator<Item = f64> + Clone) -> Vec<f64> {
        let [start, end] = self.range;
        let is_before = times.clone().any(|time| time < start);
        let is_after = times.clone().any(|time| time > end);
        let inner = times.filter(|time| (start..=end).contains(time));
        is_before.then_some(start).into_iter().chain(inner).chain(is_after.then_some(end)).collect()
    }

    /// Keys of vectors within the clip. Constant ones have one key.
    fn cut_vectors(&self, keys: &[BakedVec3], is_constant: bool) -> (Vec<f32>, Vec<Vec3>) {
        let times = distinct(self.cut(keys.iter().map(|key| key.time)), self.range[0]);
        let one = |(time, at)| (at, vector(ufbx::evaluate_baked_vec3(keys, time)));
        times.into_iter().map(one).take(if is_constant { 1 } else { usize::MAX }).unzip()
    }

    /// Keys of rotations within the clip. Constant ones have one key.
    fn cut_rotations(&self, keys: &[BakedQuat], is_constant: bool) -> (Vec<f32>, Vec<Quat>) {
        let times = distinct(self.cut(keys.iter().map(|key| key.time)), self.range[0]);
        let one = |(time, at)| (at, rotation(ufbx::evaluate_baked_quat(keys, time)));
        times.into_iter().map(one).take(if is_constant { 1 } else { usize::MAX }).unzip()
    }

    fn add(&mut self, times: &[f32], values: usize, node: usize, path: &str) -> Result<(), FbxError> {
        let times: Vec<[f32; 1]> = times.iter().map(|&time| [time]).collect();
        let input = self.document.floats(&times, None, true)?;
        let sampler = self.samplers.len();
        self.samplers.push(json!({ "input": input, "output": values, "interpolation": "LINEAR" }));
        self.channels.push(json!({ "sampler": sampler, "target": { "node": node, "path": path } }));
        Ok(())
    }
}

/// Pairs times in the FBX file, which are sorted, with times in the clip. Those that are equal in f32 become one.
fn distinct(times: Vec<f64>, start: f64) -> Vec<(f64, f32)> {
    let mut all: Vec<(f64, f32)> = Vec::new();
    for time in times {
        let at = (time - start) as f32;
        if at.is_finite() && at >= 0.0 && all.last().is_none_or(|&(_, last)| at > last) {
            all.push((time, at));
        }
    }
    all
}
