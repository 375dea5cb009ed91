//! The models in one cage, joined to one mesh: vertices and triangles are concatenated in the order of the models.
//!
//! A surface point is stored as a triangle number and barycentric coordinates. Triangle numbers are unique among all
//! models that a document has ever contained, so that a point keeps its triangle when other models are added or
//! removed.

use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

use cagework_core::TriMesh;
use cagework_core::rig::Rig;
use cagework_core::splats::Splats;
use cagework_io::{Clip, JointPoint, Model, UnknownClip, UpAxis, WriteError};
use cagework_pose::Parts;
use cagework_pose::humanoid::Bone;
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use crate::error::EditError;

/// Bones and the names of their joints that the user has given.
pub(crate) type GivenBones = Arc<Vec<(Bone, String)>>;

/// Largest number that is accepted from a project for the first triangle of a model. The limit leaves room for the
/// triangles of models that are opened later.
const MAX_FIRST_TRIANGLE: u32 = u32::MAX / 2;
/// Name that stands for a whole model in a list of part names.
const WHOLE_MODEL: &str = "all";

/// Visibility of a model, and which of its parts the cage does not bend.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct PartOptions {
    /// Whether the model is drawn and can be picked.
    pub shown: bool,
    /// Names of parts that keep their shape; "all" for the whole model.
    pub rigid: Vec<String>,
    /// Names of parts that stay in place; "all" for the whole model.
    pub stays: Vec<String>,
}

impl Default for PartOptions {
    fn default() -> Self {
        Self { shown: true, rigid: Vec::new(), stays: Vec::new() }
    }
}

/// Settings of a model in a project.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MemberSettings {
    /// Number by which surface points refer to the model's first triangle.
    first_triangle: u32,
    options: PartOptions,
    /// [`Member::painted`] as runs of (amount, number of vertices); empty for an unpainted model.
    painted: Vec<(u8, u32)>,
}

/// A model in the cage.
#[derive(Clone, Debug)]
pub struct Member {
    /// Identifier, unique in the document.
    pub id: u32,
    /// The model as read from its file.
    pub model: Arc<Model>,
    /// Visibility, and the parts that keep their shape or stay in place.
    pub options: PartOptions,
    /// How strongly the user fixed each vertex with the brush, 0 (moves with the cage) to 255 (stays in place).
    /// `[n_vertices]`, or empty for an unpainted model
    pub painted: Arc<Vec<u8>>,
    first_triangle: u32,
    /// Splats that show a point cloud.
    points: Option<Arc<Splats>>,
    /// Surface mesh that represents a capture of splats or a point cloud, for picking and pulling.
    stand_in: Option<Arc<TriMesh>>,
    known: Arc<KnownRig>,
    /// Range of vertices in the joined mesh.
    pub vertices: Range<usize>,
    /// Range of triangles in the joined mesh.
    pub triangles: Range<usize>,
}

/// Positions and triangles of a model in all its states ([`Model::states`]).
type States = (Vec<Vec3>, Vec<[u32; 3]>);

/// What is read from the rig of a model, once: reading decodes all morph targets.
#[derive(Debug, Default)]
struct KnownRig {
    extra_points: OnceLock<Vec<Vec3>>,
    joints: OnceLock<Vec<JointPoint>>,
    states: OnceLock<States>,
    /// `None` without joints, or if they cannot be read.
    rest: OnceLock<Option<Rig>>,
}

/// The value of `cell`, computed if it is empty.
fn known<T, E>(cell: &OnceLock<T>, read: impl FnOnce() -> Result<T, E>) -> Result<&T, E> {
    match cell.get() {
        Some(value) => Ok(value),
        None => read().map(|value| cell.get_or_init(|| value)),
    }
}

/// Compares name and geometry of the file, the number of the first triangle, the options, and [`Member::painted`].
impl PartialEq for Member {
    fn eq(&self, other: &Self) -> bool {
        let is_same_file = Arc::ptr_eq(&self.model, &other.model)
            || (self.model.name == other.model.name
                && self.model.positions == other.model.positions
                && self.model.triangles == other.model.triangles);
        is_same_file
            && self.first_triangle == other.first_triangle
            && self.options == other.options
            && self.painted == other.painted
    }
}

/// A model to add, and its settings in a project.
pub type NewModel = (Model, Option<MemberSettings>);

/// The models in one cage. Clones share files and the joined mesh.
#[derive(Clone, Debug, Default)]
pub struct Models {
    members: Arc<Vec<Member>>,
    mesh: Arc<TriMesh>,
    next_id: u32,
    next_triangle: u32,
    /// Origin of the model that was opened first. It stays the same when that model is removed.
    origin: DVec3,
    bones: GivenBones,
}

/// Compares the members and the given bones.
impl PartialEq for Models {
    fn eq(&self, other: &Self) -> bool {
        (Arc::ptr_eq(&self.members, &other.members) || self.members == other.members)
            && self.bones == other.bones
    }
}

impl Models {
    /// Adds models at the end.
    pub fn add(&mut self, models: impl IntoIterator<Item = NewModel>) {
        for (model, settings) in models {
            self.push(model, settings);
        }
        self.join();
    }

    fn push(&mut self, model: Model, settings: Option<MemberSettings>) {
        if self.next_id == 0 {
            self.origin = model.origin();
        }
        // Triangle numbers stay unique even if those in the project's settings collide.
        let stored = settings.as_ref().map_or(0, |s| s.first_triangle).min(MAX_FIRST_TRIANGLE);
        let first_triangle = stored.max(self.next_triangle);
        let splats = model.drawn_splats();
        let stand_in = splats.as_deref().map(|splats| Arc::new(splats.stand_in()));
        let points = match splats {
            Some(Cow::Owned(points)) => Some(Arc::new(points)),
            _ => None,
        };
        let n_triangles = stand_in.as_ref().map_or(model.triangles.len(), |mesh| mesh.triangles.len());
        self.next_triangle = first_triangle + n_triangles as u32;
        let mut member = Member {
            id: self.next_id,
            options: PartOptions::default(),
            painted: Arc::default(),
            first_triangle,
            points,
            stand_in,
            known: Arc::default(),
            vertices: 0..0,
            triangles: 0..0,
            model: Arc::new(model),
        };
        self.next_id += 1;
        if let Some(MemberSettings { options, painted, .. }) = settings {
            let kept = |names: &[String]| names.iter().filter(|name| member.selects(name)).cloned().collect();
            member.options = PartOptions {
                shown: options.shown,
                rigid: kept(&options.rigid),
                stays: kept(&options.stays),
            };
            let n: u64 = painted.iter().map(|&(_, n)| u64::from(n)).sum();
            if n == member.positions().len() as u64 {
                let runs = painted.iter().flat_map(|&(amount, n)| std::iter::repeat_n(amount, n as usize));
                member.painted = Arc::new(runs.collect());
            }
        }
        Arc::make_mut(&mut self.members).push(member);
    }

    /// Removes a model.
    ///
    /// # Errors
    /// If there is no such model, or it is the only one. Nothing changes then.
    pub fn remove(&mut self, id: u32) -> Result<(), EditError> {
        self.get(id)?;
        if self.members.len() == 1 {
            return Err(EditError::OnlyModel);
        }
        Arc::make_mut(&mut self.members).retain(|member| member.id != id);
        self.join();
        Ok(())
    }

    /// Replaces a model by one with the same surface, such as itself with a skin. The new model has an id of its own, and the
    /// place, visibility and parts of the old one. Vertices at the same position keep their painted amount; surface
    /// points stay if the triangles have the same order.
    ///
    /// # Errors
    /// If there is no such model. Nothing changes then.
    pub fn replace(&mut self, id: u32, model: Model) -> Result<(), EditError> {
        let place = self.iter().position(|member| member.id == id).ok_or(EditError::NoModel)?;
        let old = self.members[place].clone();
        let bits = |p: &Vec3| p.to_array().map(|x| (x + 0.0).to_bits());
        let amounts: HashMap<_, u8> =
            old.positions().iter().map(bits).zip(old.painted.iter().copied()).collect();
        let painted = model.positions.iter().map(|p| (amounts.get(&bits(p)).copied().unwrap_or(0), 1));
        let painted = if amounts.is_empty() { Vec::new() } else { painted.collect() };
        self.push(model, Some(MemberSettings { first_triangle: 0, options: old.options.clone(), painted }));
        let members = Arc::make_mut(&mut self.members);
        members.swap_remove(place);
        let corners = |m: &Member| -> Vec<_> {
            m.triangles().iter().map(|t| t.map(|v| bits(&m.positions()[v as usize]))).collect()
        };
        if corners(&members[place]) == corners(&old) {
            members[place].first_triangle = old.first_triangle;
        }
        self.join();
        Ok(())
    }

    fn join(&mut self) {
        let mut mesh = TriMesh::default();
        for member in Arc::make_mut(&mut self.members) {
            let (v, t) = (mesh.positions.len(), mesh.triangles.len());
            mesh.positions.extend(member.positions());
            mesh.triangles.extend(member.triangles().iter().map(|corners| corners.map(|c| v as u32 + c)));
            member.vertices = v..mesh.positions.len();
            member.triangles = t..mesh.triangles.len();
        }
        self.mesh = Arc::new(mesh);
    }

    /// All models in order.
    pub fn iter(&self) -> std::slice::Iter<'_, Member> {
        self.members.iter()
    }

    /// Number of models.
    #[must_use]
    pub fn len(&self) -> usize {
        self.members.len()
    }

    /// The splats that show the first model, if it is a capture or a point cloud.
    #[must_use]
    pub fn splats(&self) -> Option<&Splats> {
        self.iter().next().and_then(|member| member.model.splats().or(member.points.as_deref()))
    }

    /// Whether no model is open.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.members.is_empty()
    }

    /// Vertices at rest. `[n_vertices]`
    #[must_use]
    pub fn positions(&self) -> &[Vec3] {
        &self.mesh.positions
    }

    /// Triangles of the joined mesh. `[n_triangles]`
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.mesh.triangles
    }

    /// Whether the joined meshes are the same: the same models in the same order.
    #[must_use]
    pub fn has_mesh_of(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.mesh, &other.mesh)
    }

    /// Finds a model by its id.
    ///
    /// # Errors
    /// If there is no such model.
    pub fn get(&self, id: u32) -> Result<&Member, EditError> {
        self.iter().find(|member| member.id == id).ok_or(EditError::NoModel)
    }

    /// The first model.
    ///
    /// # Errors
    /// If no model is open.
    pub fn first(&self) -> Result<&Member, EditError> {
        self.iter().next().ok_or(EditError::NoModel)
    }

    fn member_mut(&mut self, id: u32) -> Result<&mut Member, EditError> {
        self.get(id)?;
        let members = Arc::make_mut(&mut self.members).iter_mut();
        members.into_iter().find(|member| member.id == id).ok_or(EditError::NoModel)
    }

    /// Sets visibility and parts of a model.
    ///
    /// # Errors
    /// If there is no such model, or a name selects no part. Nothing changes then.
    pub fn set_options(&mut self, id: u32, options: PartOptions) -> Result<(), EditError> {
        let model = &self.get(id)?.model;
        for name in options.rigid.iter().chain(&options.stays).filter(|name| *name != WHOLE_MODEL) {
            model.select(name)?;
        }
        self.member_mut(id)?.options = options;
        Ok(())
    }

    /// Copies the visibility of each model from `other`. Returns false if nothing changes.
    pub(crate) fn show_as(&mut self, other: &Self) -> bool {
        let shown = |id: u32| other.get(id).ok().map(|member| member.options.shown);
        let differs = |member: &Member| shown(member.id).is_some_and(|shown| shown != member.options.shown);
        let is_other = self.iter().any(differs);
        if is_other {
            for member in Arc::make_mut(&mut self.members) {
                member.options.shown = shown(member.id).unwrap_or(member.options.shown);
            }
        }
        is_other
    }

    /// Sets [`Member::painted`] of a model. Amounts that are all 0 count as unpainted.
    ///
    /// # Errors
    /// If there is no such model, or it has another number of vertices. Nothing changes then.
    pub fn set_painted(&mut self, id: u32, amounts: Vec<u8>) -> Result<(), EditError> {
        let expected = self.get(id)?.positions().len();
        if !amounts.is_empty() && amounts.len() != expected {
            return Err(EditError::Amounts { given: amounts.len(), expected });
        }
        let is_any = amounts.iter().any(|&amount| amount > 0);
        self.member_mut(id)?.painted = Arc::new(if is_any { amounts } else { Vec::new() });
        Ok(())
    }

    pub(crate) fn painted_mut(&mut self, id: u32) -> Option<&mut Vec<u8>> {
        let members = Arc::make_mut(&mut self.members).iter_mut();
        members.into_iter().find(|member| member.id == id).map(|member| Arc::make_mut(&mut member.painted))
    }

    pub(crate) fn next_id(&self) -> u32 {
        self.next_id
    }

    /// Origin of all positions in the files' axes: that of the model that was opened first.
    #[must_use]
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Notice for the user if the origin is not the world origin.
    #[must_use]
    pub fn origin_notice(&self) -> Option<String> {
        let [x, y, z] = self.up().vector_turned(self.origin).to_array();
        (self.origin != DVec3::ZERO).then(|| {
            format!(
                "the model is far from the world's origin: coordinates are shown as seen from {x}, {y}, {z}, and files keep \
                 those of the world"
            )
        })
    }

    /// Up axis of the files: the same in all of them.
    #[must_use]
    pub fn up(&self) -> UpAxis {
        self.iter().next().map_or_else(UpAxis::default, |member| member.model.up())
    }

    /// Whether the first model faces the negative z axis, as VRM 0 prescribes, instead of the positive one.
    #[must_use]
    pub fn faces_negative_z(&self) -> bool {
        let vrm = self.iter().next().and_then(|member| member.model.vrm());
        vrm.is_some_and(|vrm| vrm.version.starts_with('0'))
    }

    /// Ranges of the triangles of hidden models in the joined mesh.
    #[must_use]
    pub fn hidden(&self) -> Vec<Range<u32>> {
        let hidden = self.iter().filter(|member| !member.options.shown);
        hidden.map(|member| member.triangles.start as u32..member.triangles.end as u32).collect()
    }

    /// Triangles of shown models, each with its index in the joined mesh.
    pub fn shown_triangles(&self) -> impl Iterator<Item = (u32, [u32; 3])> {
        let shown = self.iter().filter(|member| member.options.shown);
        shown.flat_map(|member| {
            let own = self.mesh.triangles[member.triangles.clone()].iter().copied();
            (member.triangles.start as u32..).zip(own)
        })
    }

    /// Corners, as vertices of the joined mesh, of the triangle with this triangle number (see the module's
    /// documentation). `None` if its model was removed.
    #[must_use]
    pub fn corners(&self, triangle: u32) -> Option<[u32; 3]> {
        let place = |member: &Member| {
            let own = triangle.checked_sub(member.first_triangle)? as usize;
            self.mesh.triangles[member.triangles.clone()].get(own).copied()
        };
        self.iter().find_map(place)
    }

    /// Converts the index of a triangle in the joined mesh to the number by which surface points refer to it.
    #[must_use]
    pub fn number_of(&self, triangle: u32) -> u32 {
        let of = |member: &&Member| member.triangles.contains(&(triangle as usize));
        let number = |m: &Member| m.first_triangle + triangle - m.triangles.start as u32;
        self.iter().find(of).map_or(triangle, number)
    }

    /// Points of rigs, which are bound after the vertices, concatenated over the models. `[n_points]`
    ///
    /// # Errors
    /// If a rig cannot be read.
    pub fn extra_points(&self) -> Result<Vec<Vec3>, EditError> {
        let mut points = Vec::new();
        for member in self.iter() {
            points.extend_from_slice(member.extra_points()?);
        }
        Ok(points)
    }

    /// Range of a model's points in [`Self::extra_points`].
    ///
    /// # Errors
    /// If there is no such model, or a rig cannot be read.
    pub fn extra_of(&self, id: u32) -> Result<Range<usize>, EditError> {
        let mut first = 0;
        for member in self.iter() {
            let n = member.extra_points()?.len();
            if member.id == id {
                return Ok(first..first + n);
            }
            first += n;
        }
        Err(EditError::NoModel)
    }

    /// The geometry that a cage should enclose: positions and triangles of the models at rest, with each morph target, and
    /// in the frames of `clip` if it is given.
    ///
    /// # Errors
    /// If there is only one model, and it does not have this clip.
    pub fn states(&self, clip: Option<&str>) -> Result<(Vec<Vec3>, Vec<[u32; 3]>), UnknownClip> {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for member in self.iter() {
            // Models without this clip contribute no frames. They stay at rest, or follow the joints of one with it.
            let has = |name: &&str| self.len() == 1 || Clip::named(&member.model.clips(), name).is_ok();
            let own = member.states(clip.filter(has))?;
            let first = positions.len() as u32;
            triangles.extend(own.1.iter().map(|t| t.map(|v| first + v)));
            positions.extend_from_slice(&own.0);
        }
        Ok((positions, triangles))
    }

    /// Joints of all models at rest and their influences on the vertices that [`Self::states`] returns without a clip.
    /// Joints of the same name are one. `None` without joints, or if they cannot be read.
    #[must_use]
    pub fn rest_rig(&self) -> Option<Rig> {
        self.rig_of(|member| Some(member.states(None).ok()?.0.len()))
    }

    /// Like [`Self::rest_rig`], with the influences on [`Self::positions`].
    pub(crate) fn vertex_rig(&self) -> Option<Rig> {
        self.rig_of(|member| Some(member.model.positions.len()))
    }

    /// The joined rig of the models. `n_points`: number of points of a model, its vertices first.
    fn rig_of(&self, n_points: impl Fn(&Member) -> Option<usize>) -> Option<Rig> {
        let mut all = Rig::default();
        for member in self.iter() {
            let rig = member.known.rest.get_or_init(|| member.model.rest_rig().ok().flatten());
            all.append(rig.as_ref(), n_points(member)?);
        }
        Some(all).filter(|rig| !rig.joints.is_empty())
    }

    /// Humanoid bones, and the names of the joints that the user has given them.
    pub(crate) fn given_bones(&self) -> GivenBones {
        Arc::clone(&self.bones)
    }

    /// Gives a humanoid bone the joint with a name; `None` forgets the given joint.
    pub(crate) fn set_bone(&mut self, bone: Bone, joint: Option<String>) {
        let bones = Arc::make_mut(&mut self.bones);
        bones.retain(|(own, _)| *own != bone);
        bones.extend(joint.map(|joint| (bone, joint)));
    }

    /// Parts of all models that stay in place or are rigid.
    #[must_use]
    pub fn parts(&self) -> Parts {
        let mut all = Parts::default();
        for member in self.iter() {
            // `parts` does not fail, because `push` and `set_options` accept only names of existing parts.
            let own = member.parts().unwrap_or_default();
            if !own.stays.is_empty() {
                all.stays.resize(self.mesh.positions.len(), 0.0);
                all.stays[member.vertices.clone()].copy_from_slice(&own.stays);
            }
            let first = member.vertices.start as u32;
            all.rigid
                .extend(own.rigid.into_iter().map(|piece| piece.into_iter().map(|v| first + v).collect()));
        }
        all
    }

    /// Settings of the models, as a project stores them; empty for a single model whose settings are all default.
    #[must_use]
    pub fn settings(&self) -> Vec<MemberSettings> {
        let of = |member: &Member| MemberSettings {
            first_triangle: member.first_triangle,
            options: member.options.clone(),
            painted: member.painted.chunk_by(|a, b| a == b).map(|run| (run[0], run.len() as u32)).collect(),
        };
        let all: Vec<_> = self.iter().map(of).collect();
        if all == [MemberSettings::default()] { Vec::new() } else { all }
    }

    /// Approximate size of the data that `other` does not share, bytes.
    pub(crate) fn bytes_beyond(&self, other: &Self) -> usize {
        if Arc::ptr_eq(&self.members, &other.members) {
            return 0;
        }
        let shares = |m: &Member| other.iter().any(|o| Arc::ptr_eq(&o.model, &m.model));
        let of = |m: &Member| {
            let file =
                if shares(m) { 0 } else { 4 * (12 * m.model.positions.len() + 12 * m.model.triangles.len()) };
            file + m.painted.len()
        };
        let mesh = if self.has_mesh_of(other) {
            0
        } else {
            12 * (self.mesh.positions.len() + self.mesh.triangles.len())
        };
        mesh + self.iter().map(of).sum::<usize>()
    }
}

impl Member {
    /// Vertices at rest: of the model, or of the mesh that stands for splats. `[n_vertices]`
    #[must_use]
    pub fn positions(&self) -> &[Vec3] {
        self.stand_in.as_ref().map_or(&self.model.positions, |mesh| &mesh.positions)
    }

    /// Triangles of [`Self::positions`]. `[n_triangles]`
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        self.stand_in.as_ref().map_or(&self.model.triangles, |mesh| &mesh.triangles)
    }

    /// [`Model::extra_points`] of the model.
    ///
    /// # Errors
    /// If a part of the rig cannot be read.
    pub fn extra_points(&self) -> Result<&[Vec3], WriteError> {
        known(&self.known.extra_points, || self.model.extra_points()).map(Vec::as_slice)
    }

    pub(crate) fn joints(&self) -> Result<&[JointPoint], WriteError> {
        known(&self.known.joints, || self.model.joints()).map(Vec::as_slice)
    }

    fn states(&self, clip: Option<&str>) -> Result<Cow<'_, States>, UnknownClip> {
        match clip {
            None if self.model.is_rigged() => {
                known(&self.known.states, || self.model.states(None)).map(Cow::Borrowed)
            }
            _ => self.model.states(clip).map(Cow::Owned),
        }
    }

    fn selects(&self, name: &str) -> bool {
        name == WHOLE_MODEL || self.model.select(name).is_ok()
    }

    /// Parts that stay in place or are rigid. Vertex indices are relative to the model.
    ///
    /// # Errors
    /// If a name selects no part.
    pub fn parts(&self) -> Result<Parts, EditError> {
        if self.stand_in.is_some() {
            // Captures and point clouds have no parts.
            return Ok(Parts::default());
        }
        let of_parts = |names: &[String]| -> Vec<String> {
            names.iter().filter(|name| *name != WHOLE_MODEL).cloned().collect()
        };
        let is_whole = |names: &[String]| names.iter().any(|name| name == WHOLE_MODEL);
        let PartOptions { rigid, stays, .. } = &self.options;
        let named: Vec<(String, f32)> = of_parts(stays).into_iter().map(|name| (name, 1.0)).collect();
        let mut parts = self.model.parts(&named, &of_parts(rigid))?;
        let n = self.model.positions.len();
        if is_whole(rigid) {
            // The whole model is one rigid piece, even if its mesh has several components, such as a suit of armour.
            parts.rigid = vec![(0..n as u32).collect()];
        }
        if is_whole(stays) {
            parts.stays = vec![1.0; n];
        }
        if !self.painted.is_empty() {
            parts.stays.resize(n, 0.0);
            let painted = self.painted.iter().map(|&amount| f32::from(amount) / 255.0);
            parts.stays.iter_mut().zip(painted).for_each(|(stays, painted)| *stays = stays.max(painted));
        }
        Ok(parts)
    }

    /// The model's slice of a list over all vertices.
    #[must_use]
    pub fn share<'a, T>(&self, of_all: &'a [T]) -> &'a [T] {
        &of_all[self.vertices.clone()]
    }
}

#[cfg(test)]
mod tests;
