//! Exports of posed models: files that keep the rig, files of the shape alone, saved poses, clips and weights.

use std::sync::Arc;

use cagework_core::{InnerControls, PolygonMesh};
use cagework_io::{
    Feet, Ground, Model, ModelFormat, ReshapeOptions, Skeleton, shown, write_cage_obj, write_inner_controls,
    write_weights_npz,
};
use cagework_job::{BoundPoints, Job, NamedPose, Poses, Written};
use glam::Vec3;

use crate::bound::{BoundDocument, BoundError, MovedModel};
use crate::document::Document;
use crate::options::RigOptions;
use crate::playback::Playback;

/// Name of the morph target that leads from the posed shape back to the shape at rest.
const REST_NAME: &str = "Rest";

/// A written file, and what the user should know about it.
#[derive(Clone, Debug, Default)]
pub struct Exported {
    /// Contents of the file.
    pub bytes: Vec<u8>,
    /// Changes of the rig, and data that the file format loses, one sentence each.
    pub notices: Vec<String>,
}

impl From<Written> for Exported {
    fn from(Written { bytes, notices, .. }: Written) -> Self {
        Self { bytes, notices }
    }
}

impl BoundDocument<'_> {
    /// Exports the posed model as GLB; a rigged model keeps its skeleton, morph targets and clips. With
    /// `options.dynamic`, the frames of the model's clip with the index `clip` become morph targets instead.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn glb(&self, id: u32, options: &RigOptions, clip: Option<usize>) -> Result<Exported, BoundError> {
        let pose = &self.document().pose;
        let job = match clip {
            Some(clip) if options.dynamic => {
                self.job(id, ModelFormat::Gltf, ReshapeOptions::default(), true)?.with_clip(clip)
            }
            _ => self.job(id, ModelFormat::Gltf, self.of_rig(pose, options)?, options.plain)?,
        };
        self.posed(id, &job, None)
    }

    /// Fits a file of clips without a mesh to the posed skeleton of the model with the most joints. Matches joints by
    /// name. `name`: the file's name; `memory_limit`: the most memory that reading the file may take, bytes.
    ///
    /// # Errors
    /// If the file has a mesh or no clips, no model has a skeleton, or no joint of the file has the name of a joint of
    /// the model.
    pub fn clips(
        &self,
        name: &str,
        file: Vec<u8>,
        request: &RigOptions,
        memory_limit: u64,
    ) -> Result<Exported, BoundError> {
        let mut clips = Model::read_with_clips(name, file, &mut |_| None, memory_limit)?;
        if !clips.positions.is_empty() {
            return Err(BoundError::HasMesh { name: shown(name) });
        }
        let Document { models, pose, .. } = self.document();
        let options = self.of_rig(pose, request)?;
        let bodies = models.iter().rev().filter(|member| member.model.is_rigged());
        let body = bodies.max_by_key(|member| member.model.counts.joints);
        let body = body.ok_or(BoundError::Missing { what: "skeleton", how: "open a model that has one" })?;
        clips.set_up(models.up());
        clips.set_origin(models.origin());
        let job = self.job(body.id, ModelFormat::Gltf, options.clone(), false)?;
        let skeleton = Some(Arc::new(job.skeleton(&MovedModel::new(*self, body.id, None), pose)?));
        let options = ReshapeOptions { skeleton, ..options };
        let job = Job::from_resolved(&clips, ModelFormat::Gltf, options, false)?;
        let nothing = BoundPoints::nothing(pose.to_vec());
        Ok(job.write(job.deform(&nothing, &Poses::Shape(pose.to_vec()))?)?.into())
    }

    /// Exports the posed model in a format that stores only its shape, without rig or animation. `shown`: exports the
    /// shown frame of a clip instead of the pose.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn shape(
        &self,
        id: u32,
        format: ModelFormat,
        shown: Option<&Playback>,
    ) -> Result<Exported, BoundError> {
        let shown = shown.map(|playback| playback.current_positions(*self)).transpose()?;
        self.posed(id, &self.job(id, format, ReshapeOptions::default(), true)?, shown)
    }

    /// Exports a model as GLB with a morph target for each saved pose of the cage and the animation of the poses.
    /// `in_pose`: the model has the shape of the current pose, and no expressions. Otherwise it stays at rest. `name`: name
    /// of the animation.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn poses(
        &self,
        id: u32,
        request: &RigOptions,
        in_pose: bool,
        name: &str,
    ) -> Result<Exported, BoundError> {
        self.require_mesh()?;
        let document = self.document();
        let mut options = self.of_rig(if in_pose { &document.pose } else { self.rest() }, request)?;
        let is_vrm = document.models.get(id)?.model.vrm().is_some();
        options.expressions = request.reshape.expressions && is_vrm && !request.plain && !in_pose;
        let named = |name: &str, positions: &[Vec3]| NamedPose {
            name: name.to_owned(),
            positions: positions.to_vec(),
        };
        let mut all: Vec<NamedPose> =
            document.fitting_poses().map(|pose| named(&pose.name, &pose.positions)).collect();
        let mut timeline = document.timeline().named(name);
        if in_pose && document.is_posed() && timeline.shows_rest() {
            timeline = timeline.with_rest_as_pose();
            all.push(named(REST_NAME, self.rest()));
        }
        let base = in_pose.then(|| document.pose.to_vec());
        let poses = Poses::Targets { base, all, timeline: Some(timeline).filter(|_| !options.expressions) };
        let job = self.job(id, ModelFormat::Gltf, options, request.plain)?;
        Ok(job.write(job.deform(&MovedModel::new(*self, id, None), &poses)?)?.into())
    }

    /// Exports the weights of one model as NPZ, which `scipy.sparse.load_npz` reads.
    ///
    /// # Errors
    /// If the models are not bound.
    pub fn weights(&self, id: u32) -> Result<Vec<u8>, BoundError> {
        self.require_mesh()?;
        let mut rows = self.rows(id, self.require_bound()?)?;
        rows.weights.append(&rows.rig);
        let points = self.document().models.get(id)?.extra_points()?;
        let inner = self.document().cage.inner_positions();
        Ok(write_weights_npz(&rows.weights, rows.frames, &rows.outside, points, inner))
    }

    /// Rejects captures of splats and point clouds.
    fn require_mesh(&self) -> Result<(), BoundError> {
        if self.document().models.splats().is_none() { Ok(()) } else { Err(BoundError::Capture) }
    }

    /// Prepares the export of one model. `plain`: without its rig.
    fn job(
        &self,
        id: u32,
        format: ModelFormat,
        mut options: ReshapeOptions,
        plain: bool,
    ) -> Result<Job<'static>, BoundError> {
        let member = self.document().models.get(id)?;
        options.parts = member.parts()?;
        Ok(Job::from_resolved(Arc::clone(&member.model), format, options, plain)?)
    }

    /// Writes a model in the current pose.
    fn posed(&self, id: u32, job: &Job<'_>, shown: Option<Vec<Vec3>>) -> Result<Exported, BoundError> {
        let pose = Poses::Shape(self.document().pose.to_vec());
        Ok(job.write(job.deform(&MovedModel::new(*self, id, shown), &pose)?)?.into())
    }

    /// Builds the options for exporting the rig of a model. With several models, joints with the same name get the same
    /// displacement, and the lowest point of all models determines the ground.
    fn of_rig(&self, pose: &[Vec3], request: &RigOptions) -> Result<ReshapeOptions, BoundError> {
        // Only `poses` writes saved poses, which can become expressions.
        let mut options = ReshapeOptions { expressions: false, ..request.reshape.clone() };
        let models = &self.document().models;
        if models.len() < 2 {
            return Ok(options);
        }
        let mut skeleton = Skeleton::default();
        models.iter().for_each(|member| skeleton.add(member.model.joints_with_vertices()));
        options.skeleton = Some(Arc::new(skeleton.clone()));
        if !options.ground {
            return Ok(options);
        }
        let is_current = *pose == *self.document().pose;
        let known = self.ground.borrow().as_ref().and_then(|(bound, of_request, ground)| {
            let is_same = self.bound.is_some_and(|own| Arc::ptr_eq(own, bound));
            (is_same && of_request == request && is_current).then(|| ground.clone())
        });
        let ground = match known {
            Some(ground) => ground,
            None => {
                let all = self.find_ground(pose, request, &options)?;
                if is_current {
                    let known = self.bound.map(|bound| (Arc::clone(bound), request.clone(), all.clone()));
                    self.ground.replace(known);
                }
                all
            }
        };
        options.skeleton = Some(Arc::new(skeleton.with_ground(ground)));
        Ok(options)
    }

    /// Finds the lowest points of all models in a pose.
    fn find_ground(
        &self,
        pose: &[Vec3],
        request: &RigOptions,
        options: &ReshapeOptions,
    ) -> Result<Ground, BoundError> {
        let posed = self.deformed(pose)?;
        let mut all = Ground::default();
        for member in self.document().models.iter() {
            let free = ReshapeOptions { feet: Feet::Free, ..options.clone() };
            let job = self.job(member.id, ModelFormat::Gltf, free, request.plain)?;
            let of_rig = if job.keeps_rig() {
                let moved = MovedModel::new(*self, member.id, None);
                job.write(job.deform(&moved, &Poses::Shape(pose.to_vec()))?)?.rig
            } else {
                None
            };
            let ground = of_rig.and_then(|report| report.ground);
            all.add(ground.unwrap_or_else(|| member.model.ground(member.share(&posed))));
        }
        Ok(all)
    }
}

impl Document {
    /// Exports the posed cage as OBJ.
    ///
    /// # Errors
    /// Without a cage.
    pub fn cage_obj(&self) -> Result<Vec<u8>, BoundError> {
        let faces = self.cage.mesh.faces.clone();
        if faces.is_empty() {
            return Err(BoundError::Missing { what: "cage", how: "make one first" });
        }
        let mesh = PolygonMesh { positions: self.pose[..self.cage.n_cage()].to_vec(), faces };
        Ok(write_cage_obj(&self.models.up().mesh_turned_back(&mesh), self.models.origin()))
    }

    /// Exports the inner controls in the current pose, as OBJ.
    ///
    /// # Errors
    /// If the cage has no inner controls.
    pub fn controls_obj(&self) -> Result<Vec<u8>, BoundError> {
        if self.cage.controls.inner == 0 {
            return Err(BoundError::Missing { what: "inner control", how: "add one first" });
        }
        let positions = self.models.up().turned_back(&self.pose[self.cage.n_cage()..]).into_owned();
        let elements = self.cage.controls.elements.clone();
        let controls = InnerControls { positions, elements, radius: None };
        Ok(write_inner_controls(&controls, self.models.origin()))
    }
}
