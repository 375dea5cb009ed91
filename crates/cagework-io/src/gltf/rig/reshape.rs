//! Reshapes a rigged document and writes it.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

use cagework_pose::Parts;
use cagework_pose::parts::Motion;
use glam::{DMat3, DMat4, DVec3, Vec3};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::binds::write_binds;
use super::edit::Edit;
use super::feet::Feet;
use super::ground::{Ground, MIN_LIFT};
use super::lattice::ends;
use super::nodes::{Deformation, Joints};
use super::poses::PoseDisplacements;
use super::report::ReshapeReport;
use super::shape::{Shape, SurfaceGradients};
use super::skeleton::Skeleton;
use super::{Rig, RigPrimitive, expressions, feet, key_of, lift, poses, tracks, vrm};
use crate::error::WriteError;
use crate::gltf::geometry::{Frame, triangles_of};
use crate::gltf::pack::push;
use crate::gltf::scene::name_of;
use crate::gltf::{GltfDocument, skin};
use crate::shown::shown;
use crate::timeline::Timeline;

/// Options for reshaping a rigged document.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct ReshapeOptions {
    /// How the skeleton follows the cage.
    pub joints: Joints,
    /// Whether translations of clips stay unchanged. Otherwise they scale with the height of the hips.
    pub keep_travel: bool,
    /// Names of nodes with unskinned meshes that stay rigid, such as buckles, eyes and weapons.
    pub rigid: Vec<String>,
    /// Vertices that stay in place or keep their shape.
    #[serde(skip)]
    #[cfg_attr(feature = "typescript", ts(skip))]
    pub parts: Parts,
    /// When the animation of the poses shows each pose; `None` for one per second, starting and ending at rest.
    #[serde(skip)]
    #[cfg_attr(feature = "typescript", ts(skip))]
    pub timeline: Option<Timeline>,
    /// Whether the lowest points of the shape at rest and in each clip keep their heights.
    pub ground: bool,
    /// What happens to planted feet in clips.
    pub feet: Feet,
    /// How joints with given names move, for files that share a rig.
    #[serde(skip)]
    #[cfg_attr(feature = "typescript", ts(skip))]
    pub skeleton: Option<Arc<Skeleton>>,
    /// Whether each pose becomes an expression of a VRM. The poses then get a clip only if `timeline` is set.
    pub expressions: bool,
}

/// How the cage moves the points of a rig. `[n_points]` each
#[derive(Clone, Copy)]
pub(crate) struct PointMoves<'a> {
    /// Displacements, world space as in the file.
    pub(crate) by: &'a [DVec3],
    /// Whether each point is outside the cage.
    pub(crate) is_outside: &'a [bool],
}

/// Writes the document with points displaced by `moves`, and adds each of the `poses` as a morph target. With poses, the
/// displacements are zero, so that the document stays at rest.
///
/// `triangles`: of the model. The caller checks the lengths of the slices.
pub(crate) fn reshape(
    document: &GltfDocument,
    rig: &Rig<'_>,
    triangles: &[[u32; 3]],
    moves: PointMoves<'_>,
    poses: &[PoseDisplacements<'_>],
    options: &ReshapeOptions,
    up: DVec3,
) -> Result<(Vec<u8>, ReshapeReport), WriteError> {
    let PointMoves { by, is_outside } = moves;
    check_turn(document, options)?;
    let mut edit = Edit::new(document);
    let grounded;
    let mut by = by;
    let named = options.skeleton.as_ref().map(|skeleton| rig.named(skeleton));
    let carried = if options.ground { rig.carried_in_hands(triangles) } else { Vec::new() };
    let own = options.ground.then(|| rig.ground(by, &carried, up));
    // Vertices are in the unit of the cage. A file without vertices can be in another unit than the body.
    let unit = named.as_ref().filter(|_| rig.parts.is_empty()).map_or(1.0, |named| named.scale);
    let shared = options.skeleton.as_ref().and_then(|skeleton| skeleton.ground.as_ref());
    let shared = shared.map(|ground| ground.scaled(unit));
    let lift = shared.as_ref().or(own.as_ref()).map_or(DVec3::ZERO, |ground| rig.lift(ground) * up);
    if lift != DVec3::ZERO {
        grounded = by.iter().map(|&by| by + lift).collect::<Vec<_>>();
        by = &grounded;
    }
    let mut rigid = Vec::new();
    for name in &options.rigid {
        let found = rig.props_named(name);
        if found.is_empty() {
            let name = shown(name);
            return Err(WriteError::Document(format!(
                "there is no node '{name}' attached to a joint that could stay rigid: cagework info lists the names"
            )));
        }
        rigid.extend(found);
    }
    let mut report = ReshapeReport {
        joints: rig.following(named.as_ref()).into_iter().filter(|follows| *follows).count(),
        morph_ends: rig.n_ends,
        morph_ends_outside: rig.ends_outside(is_outside),
        lattice_points: rig.lattice.as_ref().map_or(0, |lattice| lattice.nodes.len()),
        lattice_cell: rig.lattice.as_ref().map_or(0.0, |lattice| lattice.cell / rig.diagonal),
        ..ReshapeReport::default()
    };
    if let Some(named) = named.as_ref().filter(|_| rig.parts.is_empty())
        && named.of_nodes.iter().all(Option::is_none)
    {
        return Err(WriteError::Document("none of its nodes has the name of a joint of the skeleton".into()));
    }
    let is_shared = named
        .iter()
        .flat_map(|named| named.of_nodes.iter().flatten())
        .any(|named| named.by != DVec3::ZERO || named.turn != DMat3::IDENTITY);
    let has_moved = is_shared || by.iter().any(|&by| by != DVec3::ZERO);
    if has_moved || !poses.is_empty() {
        separate(rig, &mut edit);
    }
    if has_moved {
        let (joints, keep_travel) = (options.joints, options.keep_travel);
        let motions = rig.motions(&rigid, by, is_outside);
        let named = named.as_ref();
        let given = Deformation {
            by,
            is_outside,
            joints,
            keep_travel,
            rigid: &motions,
            named,
            carried: &carried,
            up,
        };
        let moved = rig.moved(&given, &mut edit.json);
        report.joints_moved = moved.n_moved;
        report.joints_outside = moved.outside.len();
        report.names_outside =
            moved.outside.iter().map(|&node| name_of(&document.json, "nodes", node, "node")).collect();
        report.joints_following_parent = moved.n_follow_parent;
        let binds = write_binds(rig, &mut edit, (by, &moved.world));
        // Vertices of rigid meshes stay, unless their node cannot move rigidly.
        let sheared = |node: &u32| moved.sheared.contains(node);
        let with_rigid = rig.moved_rigidly(by, |node| motions.get(&node).filter(|_| sheared(&node)));
        let turned = SurfaceGradients::new(triangles, &with_rigid);
        for part in &rig.parts {
            if part.instance.node.is_some_and(|node| motions.contains_key(&node) && !sheared(&node)) {
                continue;
            }
            let frame = rig.frame(part, &moved.world, &binds)?;
            let Some(shape) = rig.shape(part, &turned, &frame)? else { continue };
            let states = shape.targets.iter().map(|target| &target.positions).chain([&shape.positions]);
            // Check the values that readers get, after rounding to f32.
            let is_seen = |(v, p): (usize, &DVec3)| {
                frame.world(v).transform_point3(p.as_vec3().as_dvec3()).as_vec3().is_finite()
            };
            if states.flatten().any(|p| !p.as_vec3().is_finite())
                || !shape.positions.iter().enumerate().all(is_seen)
            {
                return Err(WriteError::Document(format!(
                    "mesh {}: its skin scales vertices so strongly that their new positions exceed the range of f32; \
                     export it without the rig (--static)",
                    part.instance.mesh
                )));
            }
            report.max_condition = report.max_condition.max(shape.condition);
            report.singular_vertices += shape.n_singular;
            write_part(rig, &mut edit, part, &shape);
        }
        tracks::rescale(document, &mut edit, &moved.changes, &mut report);
        vrm::write(rig, &given, &moved.world, &mut edit.json);
    }
    let every_second = (!options.expressions).then(|| Timeline::every_second(poses.len()));
    let timeline = options.timeline.as_ref().filter(|_| !poses.is_empty()).or(every_second.as_ref());
    timeline.map_or(Ok(()), |timeline| timeline.require(poses.len()))?;
    let targets = poses::append(rig, &mut edit, triangles, (poses, timeline), (&rigid, is_outside))?;
    if options.expressions {
        expressions::add(&mut edit.json, &targets)?;
    }
    report.lift = lift.dot(up);
    report.ground = own;
    let lifts_clips = options.ground && has_moved && options.joints != Joints::Stay;
    let locks_feet = options.feet == Feet::Lock && has_moved;
    if !lifts_clips && !locks_feet {
        return Ok((edit.finish()?, report));
    }
    let mut edited = edit.into_document()?;
    if lifts_clips {
        let (named, shared, lift) = (named.as_ref(), shared.as_ref(), report.lift);
        let lows = lift::LiftInput { named, shared, lift, carried: &carried, up };
        let (lifted, clips) = lift::lift_clips(rig, edited, &lows)?;
        edited = lifted;
        report.clip_lifts = clips.iter().map(|clip| clip.lift).collect();
        report.ground = report.ground.map(|ground| ground.with(clips));
    }
    if locks_feet {
        let (locked, contacts) = feet::lock(document, edited, up)?;
        edited = locked;
        report.feet = Some([contacts.legs, contacts.n]);
        report.slide = contacts.slide;
    }
    Ok((edited.write_edited()?, report))
}

/// Refuses `--joints turn` for VRM 0.
fn check_turn(document: &GltfDocument, options: &ReshapeOptions) -> Result<(), WriteError> {
    if options.joints == Joints::Turn && document.json.pointer("/extensions/VRM").is_some() {
        let message = "bones of a VRM 0 cannot have rotations: choose --joints follow or stay, or convert the file to VRM 1";
        return Err(WriteError::Document(message.into()));
    }
    Ok(())
}

/// Writes the document with its vertices displaced by `by`, `[n_vertices]`, and its joints in place. Ends of morph targets
/// move with the vertices.
pub(crate) fn write_moved(
    document: &GltfDocument,
    rig: &Rig<'_>,
    triangles: &[[u32; 3]],
    by: &[DVec3],
) -> Result<Vec<u8>, WriteError> {
    let by = poses::held(rig, (&[], &[]), by);
    let is_outside = vec![false; by.len()];
    let options = ReshapeOptions { joints: Joints::Stay, ..ReshapeOptions::default() };
    let moves = PointMoves { by: &by, is_outside: &is_outside };
    Ok(reshape(document, rig, triangles, moves, &[], &options, DVec3::Y)?.0)
}

/// Writes the document with `poses`, whose displacements are those of the vertices, as morph targets without an animation.
pub(crate) fn write_targets(
    document: &GltfDocument,
    rig: &Rig<'_>,
    triangles: &[[u32; 3]],
    poses: &[PoseDisplacements<'_>],
) -> Result<Vec<u8>, WriteError> {
    let mut edit = Edit::new(document);
    separate(rig, &mut edit);
    poses::append(rig, &mut edit, triangles, (poses, None), (&[], &[]))?;
    edit.finish()
}

/// Computes how the joints of a document move when its points are displaced by `moves`.
pub(crate) fn skeleton(
    document: &GltfDocument,
    rig: &Rig<'_>,
    triangles: &[[u32; 3]],
    moves: PointMoves<'_>,
    options: &ReshapeOptions,
    up: DVec3,
) -> Result<Skeleton, WriteError> {
    let PointMoves { by, is_outside } = moves;
    check_turn(document, options)?;
    let (joints, keep_travel, none) = (options.joints, options.keep_travel, HashMap::new());
    let ground = if options.ground {
        let options = ReshapeOptions { feet: Feet::Free, ..options.clone() };
        reshape(document, rig, triangles, moves, &[], &options, up)?.1.ground
    } else {
        None
    };
    let lift = ground.as_ref().map_or(DVec3::ZERO, |ground| rig.lift(ground) * up);
    let by = by.iter().map(|&by| by + lift).collect::<Vec<_>>();
    let carried = if options.ground { rig.carried_in_hands(triangles) } else { Vec::new() };
    let carried = carried.as_slice();
    let given =
        Deformation { by: &by, is_outside, joints, keep_travel, rigid: &none, named: None, carried, up };
    let mut json = document.json.clone();
    // `Rig::moved` computes the travel factors only for documents with animations. The clips of other files need them.
    if json["animations"].as_array().is_none_or(Vec::is_empty) {
        json["animations"] = json!([{}]);
    }
    Ok(rig.skeleton(&given, ground, &mut json))
}

impl Rig<'_> {
    /// Finds the heights of the lowest visible vertex at rest, before and after the deformation. Ignores vertices that
    /// are `carried`. `[n_vertices]`
    pub(crate) fn ground(&self, by: &[DVec3], carried: &[bool], up: DVec3) -> Ground {
        let mut lows = [f64::INFINITY; 2];
        for part in self.parts.iter().filter(|part| part.slot.is_some()) {
            let own = part.rest().into_iter().zip(&by[part.first..]).zip(&carried[part.first..]);
            for ((at, by), _) in own.filter(|(_, carried)| !**carried) {
                let heights = [at, at + *by].map(|p| p.dot(up));
                lows = [0, 1].map(|k| lows[k].min(heights[k]));
            }
        }
        Ground::at_rest(lows)
    }

    /// Height by which the model is lifted; 0 if the difference is only rounding.
    fn lift(&self, ground: &Ground) -> f64 {
        Some(ground.lift()).filter(|lift| lift.abs() > MIN_LIFT * self.diagonal).unwrap_or(0.0)
    }

    /// Displacements of all points, with the meshes of nodes moved rigidly. `motion`: of a node whose mesh is moved.
    fn moved_rigidly<'m>(
        &self,
        by: &'m [DVec3],
        motion: impl Fn(u32) -> Option<&'m Motion>,
    ) -> Cow<'m, [DVec3]> {
        let mut all = Cow::Borrowed(by);
        for part in &self.parts {
            let Some(motion) = part.instance.node.and_then(&motion) else { continue };
            let mut put = |first: usize, at: &[DVec3]| {
                all.to_mut()[first..].iter_mut().zip(at).for_each(|(by, &at)| *by = motion.by(at));
            };
            put(part.first, &part.rest());
            for (target, first) in ends(part) {
                put(first, &self.extras[self.range(target, first)]);
            }
        }
        all
    }

    /// Number of ends of morph targets outside the cage.
    fn ends_outside(&self, is_outside: &[bool]) -> usize {
        let targets = self.parts.iter().flat_map(|part| &part.targets);
        let ends = targets.flat_map(|t| t.ends.iter().flatten().map(|&first| first..first + t.moved.len()));
        ends.map(|points| is_outside[points].iter().filter(|outside| **outside).count()).sum()
    }

    /// Triangles of a primitive, with indices of the primitive's own vertices; empty for points and lines.
    pub(super) fn triangles(&self, part: &RigPrimitive, all: &[[u32; 3]]) -> Vec<[u32; 3]> {
        let Some(slot) = part.slot.map(|slot| &self.document.slots[slot]) else {
            // Meshes outside the scene are not among the model's triangles. Unreadable meshes get no triangles.
            let own = triangles_of(self.document, part.primitive(self.document), part.local.len());
            return own.unwrap_or_default();
        };
        all[slot.triangles.clone()].iter().map(|t| t.map(|v| v - slot.start)).collect()
    }

    /// Skinning matrices of a primitive, or its node if it has no skin, after the nodes have been updated.
    fn frame(
        &self,
        part: &RigPrimitive,
        world: &[DMat4],
        binds: &HashMap<u32, Vec<DMat4>>,
    ) -> Result<Frame, WriteError> {
        let node = part.instance.node.map_or(part.instance.world, |node| world[node as usize]);
        let Some(number) = part.instance.skin else { return Ok(Frame::Rigid(node)) };
        let joints = &self.document.root.skins[number as usize].joints;
        let joints: Vec<DMat4> =
            joints.iter().zip(&binds[&number]).map(|(j, &bind)| world[j.value()] * bind).collect();
        let source = self.document.source();
        let primitive = part.primitive(self.document);
        let (all, _) = skin::matrices(source, (number, &joints), node, primitive, part.local.len())?;
        Ok(Frame::Skinned(all))
    }
}

/// Duplicates meshes that several nodes show with different deformations. The first node keeps the original mesh. Clips
/// that point to the original mesh also play its copies.
fn separate(rig: &Rig<'_>, edit: &mut Edit<'_>) {
    let mut first = HashMap::new();
    let mut copies = HashMap::new();
    let document = rig.document;
    for instance in document.instances.iter().chain(&document.elsewhere) {
        let key = key_of(instance);
        let mesh = instance.mesh as usize;
        if *first.entry(mesh).or_insert(key) == key {
            continue;
        }
        let copy = *copies.entry(key).or_insert_with(|| {
            let copy = edit.json["meshes"][mesh].clone();
            let copy = push(&mut edit.json, "meshes", copy);
            play_copy(&mut edit.json, mesh, copy);
            copy
        });
        if let Some(node) = instance.node {
            edit.json["nodes"][node as usize]["mesh"] = copy.into();
        }
    }
    if !copies.is_empty() {
        edit.count_uses();
    }
}

/// For each channel that points into a mesh (KHR_animation_pointer), adds a channel that points into its copy.
fn play_copy(json: &mut Value, mesh: usize, copy: usize) {
    let (pointer, original) =
        ("/target/extensions/KHR_animation_pointer/pointer", format!("/meshes/{mesh}/"));
    let animations = json.get_mut("animations").and_then(Value::as_array_mut);
    for animation in animations.into_iter().flatten() {
        let channels = animation.get_mut("channels").and_then(Value::as_array_mut);
        let Some(channels) = channels else { continue };
        let of_copy = |channel: &Value| {
            let rest = channel.pointer(pointer)?.as_str()?.strip_prefix(&original)?;
            let mut channel = channel.clone();
            *channel.pointer_mut(pointer)? = format!("/meshes/{copy}/{rest}").into();
            Some(channel)
        };
        let added: Vec<Value> = channels.iter().filter_map(of_copy).collect();
        channels.extend(added);
    }
}

fn write_part(rig: &Rig<'_>, edit: &mut Edit<'_>, part: &RigPrimitive, shape: &Shape) {
    let mesh = edit.mesh_of(&part.instance);
    let number = part.primitive as usize;
    let before = part.primitive(rig.document);
    let path = |rest: &str| format!("/meshes/{mesh}/primitives/{number}/{rest}");
    let mut put = |rest: &str, write: &mut dyn FnMut(&mut Edit<'_>, Option<usize>) -> usize| {
        let path = path(rest);
        let accessor = edit.json.pointer(&path).and_then(Value::as_u64).map(|a| a as usize);
        let written = write(edit, accessor);
        if let Some(reference) = edit.json.pointer_mut(&path) {
            *reference = written.into();
        }
    };
    let narrow = |all: &[DVec3]| -> Vec<[f32; 3]> { all.iter().map(|p| p.as_vec3().to_array()).collect() };
    put("attributes/POSITION", &mut |edit, a| edit.write(a, &narrow(&shape.positions), true, true));
    if let Some(normals) = &shape.normals {
        put("attributes/NORMAL", &mut |edit, a| edit.write(a, &narrow(normals), true, false));
    }
    if let Some(tangents) = &shape.tangents {
        let values: Vec<[f32; 4]> =
            tangents.iter().map(|(t, w)| Vec3::extend(t.as_vec3(), *w).to_array()).collect();
        put("attributes/TANGENT", &mut |edit, a| edit.write(a, &values, true, false));
    }
    for (k, (deltas, target)) in shape.targets.iter().zip(before.targets.iter().flatten()).enumerate() {
        if target.positions.is_some() && !part.targets[k].moved.is_empty() {
            put(&format!("targets/{k}/POSITION"), &mut |edit, a| {
                edit.write(a, &narrow(&deltas.positions), true, true)
            });
        }
        for (what, values) in [("NORMAL", &deltas.normals), ("TANGENT", &deltas.tangents)] {
            if let Some(values) = values {
                put(&format!("targets/{k}/{what}"), &mut |edit, a| {
                    edit.write(a, &narrow(values), true, true)
                });
            }
        }
    }
}
