//! What clothes take over from a body: joint weights and morph targets.

use std::borrow::Cow;
use std::collections::HashSet;

use cagework_core::inpaint::{Inpainting, InsidePoints, Origins, REACH, Separation, push_out};
use cagework_core::skin::Skin;
use cagework_core::words::{counted, three_digits};
use glam::{DVec3, Mat4, Vec3};
use serde::Serialize;
use thiserror::Error;

use crate::error::WriteError;
use crate::gltf::{self, Player, PoseDisplacements, Rig};
use crate::memory::MemoryError;
use crate::model::{Document, Model, ReadError};
use crate::shown::shown;

/// Displacements shorter than this fraction of the target's longest one on the body count as zero: the accuracy of inpainting.
const MIN_SHARE: f32 = 1e-3;

/// Error of [`Model::transfer_from`].
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum TransferError {
    /// The body has neither joint weights nor morph targets.
    #[error("{} has no skin and no morph targets: take a body with a skeleton or morph targets (.glb, .gltf or .vrm)", shown(.0))]
    NoSkin(String),
    /// The clothes have a skin, and the body has no morph targets.
    #[error("{} has a skin already, and the body has no morph targets: export the clothes without a skeleton", shown(.0))]
    HasSkin(String),
    /// No vertex is near the body.
    #[error(
        "no vertex of {} is near the body and parallel to it (distance at most {REACH} of the body's diagonal, angle at \
         most 30 degrees): give both files the same units, axes and pose",
        shown(.0)
    )]
    Far(String),
    /// Weights and targets exceed the memory limit.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// A file cannot be converted to a GLB.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The clothes cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// What [`Model::transfer_from`] did. Counts are of distinct positions of the clothes.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TransferReport {
    /// Positions by the origin of their weights and displacements.
    #[serde(flatten)]
    pub origins: Origins,
    /// Whether the faces of clothes and body point in opposite directions, so that the normals of the clothes were negated
    /// to match them.
    pub opposite_faces: bool,
    /// Number of joints that were added; 0 if the clothes have a skin, or the body has none.
    pub joints: usize,
    /// Targets of the body that move nothing on the clothes. They are left out.
    pub still_targets: usize,
    /// Targets of the body whose names the clothes have already. Those of the clothes are kept.
    pub existing_targets: usize,
    /// [`TransferOptions::push_out`].
    pub push_out: Option<f32>,
    /// Positions inside the body at rest.
    pub rest: Penetration,
    /// The targets that were added.
    pub targets: Vec<TargetReport>,
}

/// Positions of clothes inside the body, before and after they are pushed out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Penetration {
    /// Before.
    pub inside: InsidePoints,
    /// After; equal to `inside` without [`TransferOptions::push_out`].
    pub left: InsidePoints,
}

/// A morph target that clothes took over.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TargetReport {
    /// Name of the target.
    pub name: String,
    /// Positions inside the body with the target at weight 1, the others at their default weights.
    #[serde(flatten)]
    pub penetration: Penetration,
}

/// Options of [`Model::transfer_from`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransferOptions {
    /// Distance from the body, object units. Vertices inside the body or closer to it move out to this distance.
    pub push_out: Option<f32>,
    /// Limit in bytes.
    pub memory_limit: u64,
}

/// A morph target for clothes: nonzero displacements of their positions at weight 1.
struct ClothTarget {
    default: f32,
    by: Vec<(u32, Vec3)>,
}

impl Model {
    /// Like [`Self::transfer_from`] without pushing out, as a model with the positions, up axis and origin of this one. Its
    /// name ends in `.glb` if the clothes are not a glTF, and its vertices then are in the order of the GLB.
    ///
    /// # Errors
    /// As [`Self::transfer_from`].
    pub fn with_skin_of(
        &self,
        body: &Self,
        memory_limit: u64,
    ) -> Result<(Self, TransferReport), TransferError> {
        let (glb, report) = self.transfer_from(body, &TransferOptions { push_out: None, memory_limit })?;
        let clothes = self.as_gltf()?;
        let mut model = Self::read_within(&clothes.name, glb, &mut |_| None, memory_limit)?;
        model.set_up(self.up);
        model.set_origin(self.origin);
        // The order of the vertices changes if nodes share a mesh. Otherwise keep positions, which skinning rounds.
        if let (Document::Gltf(own), Document::Gltf(original)) = (&model.document, &clothes.document) {
            let order = own.vertices_in(original);
            model.positions = order.iter().map(|&v| clothes.positions[v as usize]).collect();
        }
        Ok((model, report))
    }

    /// These clothes as a GLB with the joints and the morph targets of `body`. Each vertex takes over joint weights, at most
    /// four, and displacements from the body's surface ([`Inpainting`]). Both models must be in the same pose and space.
    /// A skin and targets that the clothes have are kept.
    ///
    /// # Errors
    /// [`TransferError`] if the body has nothing that the clothes lack, the clothes are not near the body, or the work needs
    /// more memory than the limit.
    pub fn transfer_from(
        &self,
        body: &Self,
        options: &TransferOptions,
    ) -> Result<(Vec<u8>, TransferReport), TransferError> {
        let mut clothes = self.as_gltf()?.into_owned();
        clothes.set_origin(body.origin);
        let no_skin = || TransferError::NoSkin(body.name.clone());
        let (Document::Gltf(skeleton), Some(player)) = (&body.document, body.player()?) else {
            return Err(no_skin());
        };
        let (joints, targets) = (body.joint_nodes(&player), named_targets(&player));
        if joints.is_empty() && targets.is_empty() {
            return Err(no_skin());
        }
        let takes_skin = !joints.is_empty() && clothes.counts.skins == 0;
        if !takes_skin && targets.is_empty() {
            return Err(TransferError::HasSkin(self.name.clone()));
        }
        // Weights of the body, and of the clothes three times. One target at a time, with the displaced meshes; all targets
        // of the clothes, in memory and in the file.
        let [of_body, own, n] =
            [body.positions.len(), clothes.positions.len(), joints.len()].map(|n| n as u64);
        let weights = 4 * (of_body + 3 * own).saturating_mul(if takes_skin { n } else { 0 });
        let of_targets = own.saturating_mul(32 * targets.len() as u64) + 64 * (of_body + own);
        MemoryError::check(weights.saturating_add(of_targets), options.memory_limit)?;

        let mut surface = body.tri_mesh();
        let inpainting = Inpainting::new(&surface, &clothes.tri_mesh());
        if inpainting.origins().matched == 0 {
            return Err(TransferError::Far(self.name.clone()));
        }
        let mut report = TransferReport { push_out: options.push_out, ..TransferReport::default() };
        report.joints = if takes_skin { joints.len() } else { 0 };
        report.origins = inpainting.origins();
        report.opposite_faces = inpainting.is_turned();
        let weights = takes_skin.then(|| inpainting.weights(&weights_of(&player, &joints), joints.len()));

        let mut rest = inpainting.positions().to_vec();
        let mut least = options.push_out.map_or_else(Vec::new, |distance| vec![distance; rest.len()]);
        let Separation { inside, left, distances } = push_out(&surface, &mut rest, &least);
        report.rest = Penetration { inside, left };
        // Targets do not move vertices that are closer at rest, because there is no room.
        least.iter_mut().zip(distances).for_each(|(least, at_rest)| *least = least.min(at_rest));
        let mut base: Vec<Vec3> = rest.iter().zip(inpainting.positions()).map(|(a, b)| *a - *b).collect();
        let existing: HashSet<String> =
            clothes.player()?.map_or_else(HashSet::new, |own| own.targets().0.iter().cloned().collect());
        let palette = player.pose_at(None, 0.0, &[]).palette;
        let mut added: Vec<ClothTarget> = Vec::new();
        for (name, numbers) in targets {
            if existing.contains(name) {
                report.existing_targets += 1;
                continue;
            }
            let of_body = body.up.turned(&displacements(&player.skin, &palette, &numbers)).into_owned();
            let default = player.targets().1[numbers[0] as usize];
            let mut by = carried(&inpainting, &of_body);
            let share = 1.0 - default;
            let moved =
                |at: &[Vec3], by: &[Vec3]| at.iter().zip(by).map(|(p, by)| *p + share * *by).collect();
            surface.positions = moved(&body.positions, &of_body);
            let mut posed: Vec<Vec3> = moved(&rest, &by);
            let before = posed.clone();
            let Separation { inside, left, .. } = push_out(&surface, &mut posed, &least);
            for ((by, from), to) in by.iter_mut().zip(before).zip(posed) {
                if from != to && share != 0.0 {
                    *by += (to - from) / share;
                }
            }
            if by.iter().all(|by| *by == Vec3::ZERO) {
                report.still_targets += 1;
                continue;
            }
            base.iter_mut().zip(&by).for_each(|(base, by)| *base -= default * *by);
            let penetration = Penetration { inside, left };
            report.targets.push(TargetReport { name: name.to_owned(), penetration });
            let nonzero = (0..).zip(by).filter(|(_, by)| *by != Vec3::ZERO);
            added.push(ClothTarget { default, by: nonzero.collect() });
        }
        let write_skin = weights.map(|weights| {
            move |document: &gltf::GltfDocument, order: &[u32]| {
                let row = |&v: &u32| &weights[v as usize * joints.len()..][..joints.len()];
                let rows: Vec<f32> = order.iter().flat_map(row).copied().collect();
                gltf::write_skinned(document, skeleton, (&joints, &rows))
            }
        });
        let glb = clothes.write_taken(&inpainting, &base, (&report.targets, &added), write_skin)?;
        Ok((glb, report))
    }

    /// This model as a glTF.
    fn as_gltf(&self) -> Result<Cow<'_, Self>, TransferError> {
        if matches!(self.document, Document::Gltf(_)) {
            return Ok(Cow::Borrowed(self));
        }
        let stem = self.name.rsplit_once('.').map_or(self.name.as_str(), |(stem, _)| stem);
        let mut model = self.reread(&self.write_glb(&self.positions)?)?;
        model.name = format!("{stem}.glb");
        Ok(Cow::Owned(model))
    }

    /// The model of a GLB that this model was written to.
    fn reread(&self, glb: &[u8]) -> Result<Self, TransferError> {
        let mut model = Self::read(&format!("{}.glb", self.name), glb, &mut |_| None)?;
        model.set_up(self.up);
        model.set_origin(self.origin);
        Ok(model)
    }

    /// Nodes of the joints that carry vertices of the palette, ascending; none without a skin.
    fn joint_nodes(&self, player: &Player) -> Vec<u32> {
        if self.counts.skins == 0 {
            return Vec::new();
        }
        let nodes = player.palette_nodes();
        let mut joints: Vec<u32> =
            player.skin.joints.iter().filter_map(|&(entry, _)| nodes[entry as usize]).collect();
        joints.sort_unstable();
        joints.dedup();
        joints
    }

    /// Writes these clothes with positions displaced by `base`, then with targets, then with what `write_skin` adds to a
    /// document; it gets the original vertex of each vertex.
    fn write_taken(
        self,
        inpainting: &Inpainting,
        base: &[Vec3],
        (names, targets): (&[TargetReport], &[ClothTarget]),
        write_skin: Option<impl FnOnce(&gltf::GltfDocument, &[u32]) -> Result<Vec<u8>, WriteError>>,
    ) -> Result<Vec<u8>, TransferError> {
        let Document::Gltf(original) = &self.document else { return Err(WriteError::NoRig.into()) };
        let original = original.clone();
        let (mut model, mut glb) = (self, Vec::new());
        let has_moved = base.iter().any(|by| *by != Vec3::ZERO);
        for is_base in [true, false] {
            if is_base && !has_moved || !is_base && targets.is_empty() && write_skin.is_some() {
                continue;
            }
            let Document::Gltf(document) = &model.document else { return Err(WriteError::NoRig.into()) };
            let order = document.vertices_in(&original);
            let in_file = |by: &[Vec3]| -> Vec<DVec3> {
                let of_vertex = |&v: &u32| by[inpainting.position_of()[v as usize] as usize].as_dvec3();
                order.iter().map(|v| model.up.vector_turned_back(of_vertex(v))).collect()
            };
            let rig =
                Rig::new(document, &model.positions_in_file(), model.origin).map_err(WriteError::from)?;
            let written = if is_base {
                gltf::write_moved(document, &rig, &model.triangles, &in_file(base))?
            } else {
                let all = |target: &ClothTarget| {
                    let mut by = vec![Vec3::ZERO; base.len()];
                    target.by.iter().for_each(|&(p, to)| by[p as usize] = to);
                    Cow::Owned(in_file(&by))
                };
                let (all, poses) = (&all, names.iter().zip(targets));
                let poses: Vec<PoseDisplacements<'_>> = poses
                    .map(|(of, target)| PoseDisplacements {
                        name: &of.name,
                        default: target.default,
                        by: Box::new(move || all(target)),
                    })
                    .collect();
                gltf::write_targets(document, &rig, &model.triangles, &poses)?
            };
            model = model.reread(&written)?;
            glb = written;
        }
        let Some(write_skin) = write_skin else { return Ok(glb) };
        let Document::Gltf(document) = &model.document else { return Err(WriteError::NoRig.into()) };
        Ok(write_skin(document, &document.vertices_in(&original))?)
    }
}

/// The player's morph targets that displace vertices, by name in the order of the file. Meshes may share names.
fn named_targets(player: &Player) -> Vec<(&str, Vec<u32>)> {
    let used: HashSet<u32> = player.skin.deltas.iter().map(|&(target, _)| target).collect();
    let mut all: Vec<(&str, Vec<u32>)> = Vec::new();
    for (number, name) in (0..).zip(player.targets().0) {
        match all.iter_mut().find(|(known, _)| *known == name.as_str()) {
            Some((_, numbers)) => numbers.push(number),
            None => all.push((name, vec![number])),
        }
    }
    all.retain(|(_, numbers)| numbers.iter().any(|number| used.contains(number)));
    all
}

/// Weights of the given nodes. `[n_vertices][n_joints]`
fn weights_of(player: &Player, joints: &[u32]) -> Vec<f32> {
    let (skin, nodes, n) = (&player.skin, player.palette_nodes(), joints.len());
    let mut weights = vec![0.0; n * skin.positions.len()];
    for (v, range) in skin.joint_starts.windows(2).enumerate() {
        for &(entry, weight) in &skin.joints[range[0] as usize..range[1] as usize] {
            let column = nodes[entry as usize].and_then(|node| joints.binary_search(&node).ok());
            column.into_iter().for_each(|column| weights[v * n + column] += weight);
        }
    }
    weights
}

/// Displacements of all vertices by the sum of these targets at weight 1, world space.
fn displacements(skin: &Skin, palette: &[Mat4], targets: &[u32]) -> Vec<Vec3> {
    let range = |starts: &[u32], v: usize| starts[v] as usize..starts[v + 1] as usize;
    let displaced = |v: usize| {
        let own =
            skin.deltas[range(&skin.delta_starts, v)].iter().filter(|(target, _)| targets.contains(target));
        let delta: Vec3 = own.map(|&(_, delta)| delta).sum();
        let joints = skin.joints[range(&skin.joint_starts, v)].iter().filter(|_| delta != Vec3::ZERO);
        joints.map(|&(joint, weight)| weight * palette[joint as usize].transform_vector3(delta)).sum()
    };
    (0..skin.positions.len()).map(displaced).collect()
}

/// Displacements of the clothes' positions.
fn carried(inpainting: &Inpainting, of_body: &[Vec3]) -> Vec<Vec3> {
    let longest = of_body.iter().map(|by| by.length()).fold(0.0, f32::max);
    let flat: Vec<f32> = of_body.iter().flat_map(Vec3::to_array).collect();
    let by = inpainting.values(&flat, 3);
    let by = by.chunks(3).map(Vec3::from_slice);
    by.map(|by| if by.length() > MIN_SHARE * longest { by } else { Vec3::ZERO }).collect()
}

/// What a transfer did, a line for each fact. Facts that are zero are left out.
#[must_use]
pub fn transfer_report(report: &TransferReport) -> Vec<String> {
    let positions = |n| counted(n, "position", "positions");
    let targets = |n| counted(n, "morph target", "morph targets");
    let mut lines = Vec::new();
    let mut add = |n: usize, line: String| lines.extend((n > 0).then_some(line));
    let TransferReport { origins, still_targets, existing_targets, .. } = *report;
    let Origins { matched, inpainted, copied } = origins;
    add(matched, format!("{} like the closest point of the body", positions(matched)));
    add(inpainted, format!("{} that continue their neighbours", positions(inpainted)));
    add(copied, format!("{} in parts away from the body, like its closest point", positions(copied)));
    add(
        usize::from(report.opposite_faces),
        "faces of clothes and body point in opposite directions, so normals of the clothes were negated to match them: \
         check which of the two point inwards"
            .to_owned(),
    );
    add(report.joints, format!("{} of the body", counted(report.joints, "joint", "joints")));
    add(report.targets.len(), format!("{} of the body", targets(report.targets.len())));
    add(still_targets, format!("{} left out, which move nothing", targets(still_targets)));
    add(existing_targets, format!("{} left out, whose names the clothes have", targets(existing_targets)));
    let of_targets = report.targets.iter().map(|of| (format!("in {}", shown(&of.name)), of.penetration));
    for (at, Penetration { inside, left }) in
        std::iter::once(("at rest".to_owned(), report.rest)).chain(of_targets)
    {
        let by = |InsidePoints { count, depth }| match count {
            0 => "none".to_owned(),
            _ => format!("{}, up to {} deep", positions(count), three_digits(depth)),
        };
        let after = if report.push_out.is_some() {
            format!("; after pushing out {}", by(left))
        } else {
            String::new()
        };
        add(inside.count + left.count, format!("inside the body {at}: {}{after}", by(inside)));
    }
    lines
}
