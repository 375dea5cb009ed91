//! Exports of posed models: files that keep the rig, files of the shape alone, saved poses, clips and weights.

use std::sync::Arc;

use cagework_core::field::bend_vertices;
use cagework_core::{InnerControls, PolygonMesh};
use cagework_io::{
    Feet, Ground, Model, ModelFormat, ReshapeOptions, ReshapeReport, Skeleton, shown, write_cage_obj,
    write_inner_controls, write_weights_npz,
};
use glam::{DVec3, Vec3};

use crate::bound::{BoundDocument, BoundError, MovedModel};
use crate::document::Document;
use crate::options::RigOptions;
use crate::playback::Playback;

/// A written file, and what the user should know about it.
#[derive(Clone, Debug, Default)]
pub struct Exported {
    /// Contents of the file.
    pub bytes: Vec<u8>,
    /// Changes of the rig, and data that the file format loses, one sentence each.
    pub notices: Vec<String>,
}

impl BoundDocument<'_> {
    /// Exports the posed model as GLB; a rigged model keeps its skeleton, morph targets and clips. With
    /// `options.dynamic`, the frames of the model's clip with the index `clip` become morph targets instead.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn glb(&self, id: u32, options: &RigOptions, clip: Option<usize>) -> Result<Exported, BoundError> {
        if let Some(capture) = self.posed_capture(id, ModelFormat::Gltf)? {
            return Ok(capture);
        }
        match clip {
            Some(clip) if options.dynamic => self.baked(id, clip),
            _ => self.posed_glb(id, options),
        }
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
        let moved = MovedModel::new(self, body.id)?;
        clips.set_up(models.up());
        clips.set_origin(models.origin());
        let skeleton = moved.model.skeleton(&moved.by(pose)?, &moved.outside, &options)?;
        let options = ReshapeOptions { skeleton: Some(Arc::new(skeleton)), ..options };
        let by = vec![DVec3::ZERO; clips.extra_points()?.len()];
        let (bytes, report) = clips.write_reshaped(&by, &[], &[], &options)?;
        Ok(Exported { bytes, notices: report.notices() })
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
        if let Some(capture) = self.posed_capture(id, format)? {
            return Ok(capture);
        }
        let posed = match shown {
            Some(playback) => playback.current_positions(*self)?,
            None => self.deformed(&self.document().pose)?,
        };
        let member = self.document().models.get(id)?;
        let bytes = member.model.write(format, member.share(&posed))?;
        let lost = [member.model.lost_in(format), member.model.copies_in(format, &bytes)];
        Ok(Exported { bytes, notices: lost.into_iter().flatten().collect() })
    }

    /// Exports a model as GLB with a morph target for each saved pose of the cage and the animation of the poses.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn poses(&self, id: u32, request: &RigOptions) -> Result<Vec<u8>, BoundError> {
        self.require_mesh()?;
        let poses = self.document().fitting_poses();
        let named: Vec<_> = poses.map(|pose| (pose.name.to_string(), pose.positions.to_vec())).collect();
        if let Some((bytes, _)) = self.reshaped(id, self.rest(), &named, request)? {
            return Ok(bytes);
        }
        let member = self.document().models.get(id)?;
        let own =
            |(name, pose): (String, Vec<Vec3>)| Ok((name, member.share(&self.deformed(&pose)?).to_vec()));
        let named = named.into_iter().map(own).collect::<Result<Vec<_>, BoundError>>()?;
        let timeline = self.document().timeline();
        Ok(member.model.write_glb_poses_at(&member.model.positions, &named, &timeline)?)
    }

    /// Exports the weights of one model as NPZ, which `scipy.sparse.load_npz` reads.
    ///
    /// # Errors
    /// If the models are not bound.
    pub fn weights(&self, id: u32) -> Result<Vec<u8>, BoundError> {
        self.require_mesh()?;
        let mut rows = self.rows(id, self.require_bound()?)?;
        rows.weights.append(&rows.rig);
        let points = self.document().models.get(id)?.model.extra_points()?;
        let inner = self.document().cage.inner_positions();
        Ok(write_weights_npz(&rows.weights, rows.frames, &rows.outside, &points, inner))
    }

    /// Exports a posed capture of splats, or a posed point cloud; `None` for other models.
    fn posed_capture(&self, id: u32, format: ModelFormat) -> Result<Option<Exported>, BoundError> {
        let model = &self.document().models.get(id)?.model;
        if model.n_faces() > 0 {
            return Ok(None);
        }
        if self.document().is_posed() && self.lattice.is_none() {
            let how = "wait until the splats follow the cage";
            return Err(BoundError::Missing { what: "lattice", how });
        }
        let bytes = match self.field_of_splats() {
            Some(field) => model.write_in_field(format, &field)?,
            None => model.write(format, &model.positions)?,
        };
        Ok(Some(Exported { bytes, notices: model.lost_in(format).into_iter().collect() }))
    }

    /// Rejects captures of splats and point clouds.
    fn require_mesh(&self) -> Result<(), BoundError> {
        if self.document().models.splats().is_none() { Ok(()) } else { Err(BoundError::Capture) }
    }

    /// Exports a posed model as GLB.
    pub(crate) fn posed_glb(&self, id: u32, request: &RigOptions) -> Result<Exported, BoundError> {
        let pose = &self.document().pose;
        if let Some((bytes, report)) = self.reshaped(id, pose, &[], request)? {
            return Ok(Exported { bytes, notices: report.notices() });
        }
        let options = self.of_rig(pose, request)?;
        let member = self.document().models.get(id)?;
        let mut posed = member.share(&self.deformed(pose)?).to_vec();
        member.model.lift(&mut posed, &options);
        Ok(Exported { bytes: member.model.write_glb(&posed)?, notices: Vec::new() })
    }

    /// Exports a model as GLB whose morph targets are the frames of a clip, each deformed by the cage.
    fn baked(&self, id: u32, clip: usize) -> Result<Exported, BoundError> {
        let field = self.field()?;
        let model = &self.document().models.get(id)?.model;
        let (mut frames, mut rest) = (model.frames(clip)?, model.positions.clone());
        frames.iter_mut().chain([&mut rest]).for_each(|frame| bend_vertices(&field, frame));
        let notice = match frames.len() {
            1 => "1 frame became a morph target; the skeleton is left out".to_owned(),
            n => format!("{n} frames became morph targets; the skeleton is left out"),
        };
        Ok(Exported { bytes: model.write_baked(clip, &rest, frames)?, notices: vec![notice] })
    }

    /// Exports a rigged model in a pose of the cage, with `poses` as morph targets. Returns the bytes of the file and a
    /// report. `None` if the model has no rig, or the options omit it.
    fn reshaped(
        &self,
        id: u32,
        pose: &[Vec3],
        poses: &[(String, Vec<Vec3>)],
        request: &RigOptions,
    ) -> Result<Option<(Vec<u8>, ReshapeReport)>, BoundError> {
        if request.plain {
            return Ok(None);
        }
        let mut options = self.of_rig(pose, request)?;
        if !poses.is_empty() {
            let is_vrm = self.document().models.get(id)?.model.vrm().is_some();
            options.expressions = request.reshape.expressions && is_vrm;
            options.timeline = Some(self.document().timeline()).filter(|_| !options.expressions);
        }
        self.reshaped_as(id, pose, poses, options)
    }

    fn reshaped_as(
        &self,
        id: u32,
        pose: &[Vec3],
        poses: &[(String, Vec<Vec3>)],
        mut options: ReshapeOptions,
    ) -> Result<Option<(Vec<u8>, ReshapeReport)>, BoundError> {
        let member = self.document().models.get(id)?;
        if !member.model.is_rigged() {
            return Ok(None);
        }
        let moved = MovedModel::new(self, id)?;
        let by_poses = poses.iter().map(|(name, pose)| Ok((name.clone(), moved.by(pose)?)));
        let by_poses = by_poses.collect::<Result<Vec<_>, BoundError>>()?;
        // `rigid` may name parts of other models.
        let props = moved.model.props()?;
        options.rigid.retain(|name| props.contains(name));
        options.parts = member.parts()?;
        Ok(Some(moved.model.write_reshaped(&moved.by(pose)?, &moved.outside, &by_poses, &options)?))
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
            let found = if request.plain { None } else { self.reshaped_as(member.id, pose, &[], free)? };
            let of_rig = found.and_then(|(_, report)| report.ground);
            all.add(of_rig.unwrap_or_else(|| member.model.ground(member.share(&posed))));
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
