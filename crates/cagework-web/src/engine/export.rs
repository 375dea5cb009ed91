//! Methods that write files and return arrays of the models.

use std::sync::Arc;

use cagework_core::deform::{OutsideVertex, displacements};
use cagework_core::field::bend_vertices;
use cagework_core::{Frames, InnerControls, PolygonMesh, Weights};
use cagework_io::{
    Clip, Feet, Ground, Model, ModelFormat, ReshapeOptions, ReshapeReport, Skeleton, Timeline, compact,
    shown, write_cage_obj, write_inner_controls, write_weights_npz, write_zip,
};
use glam::{DVec3, Vec3};
use js_sys::{Array, Float32Array, Uint8Array, Uint32Array};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::arrays::flat;
use crate::error::{Answer, ErrorName, Fault};
use crate::options::{JsRigOptions, READ_LIMIT, decode};
use crate::playing::SharedClip;
use crate::state::{BoundModels, State};
use crate::views::object;

#[wasm_bindgen]
impl Engine {
    /// Packs files into an uncompressed zip archive. The names must be distinct.
    ///
    /// # Errors
    /// If two names are equal.
    #[wasm_bindgen(js_name = zipFiles)]
    pub fn zip_files(names: Vec<String>, files: Vec<Uint8Array>) -> Result<Vec<u8>, JsValue> {
        let files: Vec<(String, Vec<u8>)> =
            names.into_iter().zip(files.iter().map(Uint8Array::to_vec)).collect();
        let equal = || Fault::new(ErrorName::Error, "two files of an archive have the same name");
        Ok(write_zip(&files).ok_or_else(equal)?)
    }

    /// Exports the posed model as GLB; a rigged model keeps its skeleton, morph targets and clips. With
    /// `options.dynamic`, the frames of the clip with the index `clip` become morph targets instead, if the model has
    /// this clip.
    ///
    /// # Errors
    /// If the file cannot be written.
    #[wasm_bindgen(js_name = exportGlb)]
    pub fn export_glb(
        &self,
        id: u32,
        #[wasm_bindgen(unchecked_param_type = "RigOptions")] options: JsValue,
        clip: u32,
    ) -> Result<Vec<u8>, JsValue> {
        if let Some(bytes) = self.posed_capture(id, ModelFormat::Gltf)? {
            return Ok(bytes);
        }
        let request: JsRigOptions = decode(options)?;
        let clips = self.read(|state| SharedClip::all(state.models()));
        let (bytes, notices) = match clips.get(clip as usize).and_then(|clip| clip.of(id)) {
            Some(clip) if request.dynamic => self.baked(id, clip)?,
            _ => self.posed_glb(id, &request)?,
        };
        self.state.borrow_mut().rig_notices = notices;
        Ok(compact(bytes, request.size).map_err(Fault::from)?)
    }

    /// Fits a file of clips without a mesh to the posed skeleton of the model with the most joints. Matches joints by
    /// name. `name`: the file's name.
    ///
    /// # Errors
    /// If the file has a mesh or no clips, no model has a skeleton, or no joint of the file has the name of a joint of
    /// the model.
    #[wasm_bindgen(js_name = exportClips)]
    pub fn export_clips(
        &self,
        name: &str,
        bytes: Vec<u8>,
        #[wasm_bindgen(unchecked_param_type = "RigOptions")] options: JsValue,
    ) -> Result<Vec<u8>, JsValue> {
        let request: JsRigOptions = decode(options)?;
        let mut clips =
            Model::read_with_clips(name, bytes, &mut |_| None, READ_LIMIT).map_err(Fault::from)?;
        if !clips.positions.is_empty() {
            return Err(Fault::new(
                ErrorName::Error,
                format!("{} has a mesh: open it as a model", shown(name)),
            )
            .into());
        }
        let pose = self.read(|state| state.pose().to_vec());
        let options = self.of_rig(&pose, &request)?;
        let skeleton = self.read(|state| {
            let bodies = state.models().iter().rev().filter(|member| member.model.is_rigged());
            let body = bodies.max_by_key(|member| member.model.counts.joints);
            let id = body.ok_or_else(|| Fault::missing("skeleton", "open a model that has one"))?.id;
            let moved = MovedModel::new(state, id)?;
            clips.set_up(state.up());
            clips.set_origin(state.models().origin());
            Answer::Ok(moved.model.skeleton(&moved.by(state, &pose)?, &moved.outside, &options)?)
        })?;
        let options = ReshapeOptions { skeleton: Some(Arc::new(skeleton)), ..options };
        let by = vec![DVec3::ZERO; clips.extra_points().map_err(Fault::from)?.len()];
        let (bytes, report) = clips.write_reshaped(&by, &[], &[], &options).map_err(Fault::from)?;
        self.state.borrow_mut().rig_notices = report.notices();
        Ok(compact(bytes, request.size).map_err(Fault::from)?)
    }

    /// Exports the posed model in a format that stores only its shape, without rig or animation. With `frame`, exports
    /// the shown frame of a clip instead of the pose, if playback shows a clip.
    ///
    /// # Errors
    /// If the file cannot be written.
    #[wasm_bindgen(js_name = exportShape)]
    pub fn export_shape(
        &self,
        id: u32,
        #[wasm_bindgen(unchecked_param_type = "ModelFormat")] format: JsValue,
        frame: bool,
    ) -> Result<Vec<u8>, JsValue> {
        let format: ModelFormat = decode(format)?;
        if let Some(bytes) = self.posed_capture(id, format)? {
            return Ok(bytes);
        }
        let shown = self.read(|state| {
            let playing = state.playing.as_ref().filter(|_| frame)?;
            let is_stale = playing.is_stale(&state.editor);
            Some(if is_stale { Err(playing.options.clone()) } else { Ok(playing.positions()) })
        });
        let posed = match shown {
            Some(Ok(positions)) => positions,
            Some(Err(options)) => {
                let mut current = self.playback(options)?;
                self.read(|state| state.playing.as_ref().map(|playing| current.show_as(playing)));
                current.positions()
            }
            None => self.read(|state| state.deformed(state.pose()))?,
        };
        let (bytes, lost) = self.read(|state| {
            let model = &state.models().get(id)?.model;
            let bytes = model.write(format, state.models().get(id)?.share(&posed))?;
            let lost = [model.lost_in(format), model.copies_in(format, &bytes)];
            Answer::Ok((bytes, lost.into_iter().flatten().collect()))
        })?;
        self.state.borrow_mut().rig_notices = lost;
        Ok(bytes)
    }

    /// Returns notices from the last export, one sentence each: changes of the rig, and data that the file format
    /// loses. Clears them, so that each is returned once.
    #[wasm_bindgen(js_name = rigNotices)]
    pub fn rig_notices(&self) -> Vec<String> {
        std::mem::take(&mut self.state.borrow_mut().rig_notices)
    }

    /// Exports a model as GLB with a morph target for each saved pose of the cage and the animation that `playAt`
    /// shows.
    ///
    /// # Errors
    /// If the file cannot be written.
    #[wasm_bindgen(js_name = exportPoses)]
    pub fn export_poses(
        &self,
        id: u32,
        #[wasm_bindgen(unchecked_param_type = "RigOptions")] options: JsValue,
    ) -> Result<Vec<u8>, JsValue> {
        self.require_mesh()?;
        let (rest, timeline, named): (Vec<Vec3>, Timeline, Vec<(String, Vec<Vec3>)>) = self.read(|state| {
            let document = state.editor.document();
            let poses = document.fitting_poses();
            let named = poses.map(|pose| (pose.name.to_string(), pose.positions.to_vec()));
            (state.rest().positions.clone(), document.timeline(), named.collect())
        });
        let request: JsRigOptions = decode(options)?;
        if let Some((bytes, _)) = self.reshaped(id, &rest, &named, &request)? {
            return Ok(compact(bytes, request.size).map_err(Fault::from)?);
        }
        Ok(self.read(|state| {
            let member = state.models().get(id)?;
            let own = |(name, pose): (String, Vec<Vec3>)| {
                Ok((name, member.share(&state.deformed(&pose)?).to_vec()))
            };
            let named = named.into_iter().map(own).collect::<Answer<Vec<(String, Vec<Vec3>)>>>()?;
            let glb = member.model.write_glb_poses_at(&member.model.positions, &named, &timeline)?;
            Answer::Ok(compact(glb, request.size)?)
        })?)
    }

    /// Exports the posed cage as OBJ.
    ///
    /// # Errors
    /// Without a cage.
    #[wasm_bindgen(js_name = exportCage)]
    pub fn export_cage(&self) -> Result<Vec<u8>, JsValue> {
        let mesh = self.read(|state| PolygonMesh {
            positions: state.pose()[..state.cage().n_cage()].to_vec(),
            faces: state.rest().faces.clone(),
        });
        if mesh.faces.is_empty() {
            return Err(Fault::missing("cage", "make one first").into());
        }
        let (up, origin) = self.read(|state| (state.up(), state.models().origin()));
        Ok(write_cage_obj(&up.mesh_turned_back(&mesh), origin))
    }

    /// Exports the interior controls in the current pose, as OBJ.
    ///
    /// # Errors
    /// If the cage has no interior controls.
    #[wasm_bindgen(js_name = exportControls)]
    pub fn export_controls(&self) -> Result<Vec<u8>, JsValue> {
        Ok(self.read(|state| {
            if state.cage().controls.inner == 0 {
                return Err(Fault::missing("interior control", "add one first"));
            }
            let positions = state.up().turned_back(&state.pose()[state.cage().n_cage()..]).into_owned();
            let elements = state.cage().controls.elements.clone();
            let controls = InnerControls { positions, elements, radius: None };
            Ok(write_inner_controls(&controls, state.models().origin()))
        })?)
    }

    /// Exports the weights of one model as NPZ, which `scipy.sparse.load_npz` reads.
    ///
    /// # Errors
    /// If the models are not bound.
    #[wasm_bindgen(js_name = exportWeights)]
    pub fn export_weights(&self, id: u32) -> Result<Vec<u8>, JsValue> {
        self.require_mesh()?;
        Ok(self.read(|state| {
            let ModelRows { mut weights, frames, outside, rig } =
                state.own_rows(id, state.require_bound()?)?;
            let inner = state.cage().inner_positions();
            weights.append(&rig);
            let points = state.models().get(id)?.model.extra_points()?;
            Answer::Ok(write_weights_npz(&weights, frames, &outside, &points, inner))
        })?)
    }

    /// Writes a project file with the document, and with the page's settings as a JSON object.
    ///
    /// # Errors
    /// If no model is open, or the file would be too large.
    #[wasm_bindgen(js_name = writeProject)]
    pub fn write_project(&self, settings: &str) -> Result<Vec<u8>, JsValue> {
        Ok(self.read(|state| state.editor.write_project(settings)).map_err(Fault::from)?)
    }

    /// Up axis of the models' files.
    #[wasm_bindgen(unchecked_return_type = "UpAxis")]
    pub fn up(&self) -> JsValue {
        self.read(|state| object(&state.up()))
    }

    /// Origin of all positions, in the axes of the models' files; zero unless the models are far from the world origin.
    /// `[3]`
    pub fn origin(&self) -> Vec<f64> {
        self.read(|state| state.models().origin().to_array().to_vec())
    }

    /// Vertices of all models at rest, concatenated. `[n_vertices, 3]`
    #[wasm_bindgen(js_name = modelPositions)]
    pub fn model_positions(&self) -> Vec<f32> {
        self.read(|state| flat(state.models().positions()))
    }

    /// Returns the points to bind: vertices of all models, then points of their rigs. `[n_points, 3]`
    ///
    /// # Errors
    /// If the rig cannot be read.
    #[wasm_bindgen(js_name = boundPoints)]
    pub fn bound_points(&self) -> Result<Vec<f32>, JsValue> {
        Ok(self.read(|state| {
            let mut points = flat(state.models().positions());
            points.extend(flat(&state.models().extra_points()?));
            Answer::Ok(points)
        })?)
    }

    /// Returns the geometry that a cage should enclose: positions and triangles of the models at rest, with each morph
    /// target, and in the frames of `clip` if it is given. `[n, 3]` each
    ///
    /// # Errors
    /// If no model has this clip.
    #[wasm_bindgen(js_name = modelStates, unchecked_return_type = "[Float32Array, Uint32Array]")]
    pub fn model_states(&self, clip: Option<String>) -> Result<JsValue, JsValue> {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        self.read(|state| {
            let is_alone = state.models().iter().nth(1).is_none();
            for member in state.models().iter() {
                // Models without this clip contribute no frames. They stay at rest, or follow the joints of one with it.
                let has = |name: &&str| is_alone || Clip::named(&member.model.clips(), name).is_ok();
                let states = member.model.states(clip.as_deref().filter(has));
                let (own, corners) = states.map_err(|e| Fault::new(ErrorName::Error, e))?;
                let first = positions.len() as u32;
                triangles.extend(corners.into_iter().map(|t| t.map(|v| first + v)));
                positions.extend(own);
            }
            Answer::Ok(())
        })?;
        let positions = Float32Array::from(flat(&positions).as_slice());
        let triangles = Uint32Array::from(triangles.as_flattened());
        Ok(Array::of2(&positions, &triangles).into())
    }

    /// Triangles of all models. `[n_triangles, 3]`
    #[wasm_bindgen(js_name = modelTriangles)]
    pub fn model_triangles(&self) -> Vec<u32> {
        self.read(|state| state.models().triangles().as_flattened().to_vec())
    }
}

impl Engine {
    /// Exports a posed capture of splats, or a posed point cloud, as a file; `None` for other models. Stores a notice
    /// of what the format loses.
    fn posed_capture(&self, id: u32, format: ModelFormat) -> Answer<Option<Vec<u8>>> {
        let (bytes, lost) = self.read(|state| {
            let model = &state.models().get(id)?.model;
            if model.n_faces() > 0 {
                return Answer::Ok((None, None));
            }
            if state.editor.document().is_posed() && state.lattice.is_none() {
                return Err(Fault::missing("lattice", "wait until the splats follow the cage"));
            }
            let bytes = match state.field() {
                Some(field) => model.write_in_field(format, &field)?,
                None => model.write(format, &model.positions)?,
            };
            Ok((Some(bytes), model.lost_in(format)))
        })?;
        self.state.borrow_mut().rig_notices.extend(lost);
        Ok(bytes)
    }

    /// Rejects captures of splats and point clouds.
    fn require_mesh(&self) -> Answer<()> {
        if self.read(|state| state.models().splats().is_none()) {
            return Ok(());
        }
        let reason = "splats and points have neither morph targets nor weights: export them as PLY";
        Err(Fault::new(ErrorName::Error, reason))
    }

    /// Exports a posed model as GLB; also returns notices about its rig.
    pub(super) fn posed_glb(&self, id: u32, request: &JsRigOptions) -> Answer<(Vec<u8>, Vec<String>)> {
        let pose = self.read(|state| state.pose().to_vec());
        if let Some((bytes, report)) = self.reshaped(id, &pose, &[], request)? {
            return Ok((bytes, report.notices()));
        }
        let options = self.of_rig(&pose, request)?;
        self.read(|state| {
            let member = state.models().get(id)?;
            let mut posed = member.share(&state.deformed(&pose)?).to_vec();
            member.model.lift(&mut posed, &options);
            Ok((member.model.write_glb(&posed)?, Vec::new()))
        })
    }

    /// Exports a model as GLB whose morph targets are the frames of a clip, each deformed by the cage; also returns
    /// notices.
    fn baked(&self, id: u32, clip: usize) -> Answer<(Vec<u8>, Vec<String>)> {
        let field = self.field()?;
        self.read(|state| {
            let model = &state.models().get(id)?.model;
            let (mut frames, mut rest) = (model.frames(clip)?, model.positions.clone());
            frames.iter_mut().chain([&mut rest]).for_each(|frame| bend_vertices(&field, frame));
            let notice = match frames.len() {
                1 => "1 frame became a morph target; the skeleton is left out".to_owned(),
                n => format!("{n} frames became morph targets; the skeleton is left out"),
            };
            Ok((model.write_baked(clip, &rest, frames)?, vec![notice]))
        })
    }

    /// Exports a rigged model in a pose of the cage, with `poses` as morph targets. Returns the bytes of the file and a
    /// report. `None` if the model has no rig, or the options omit it.
    fn reshaped(
        &self,
        id: u32,
        pose: &[Vec3],
        poses: &[(String, Vec<Vec3>)],
        request: &JsRigOptions,
    ) -> Answer<Option<(Vec<u8>, ReshapeReport)>> {
        if request.plain {
            return Ok(None);
        }
        let mut options = self.of_rig(pose, request)?;
        if !poses.is_empty() {
            let is_vrm = self.read(|state| Answer::Ok(state.models().get(id)?.model.vrm().is_some()))?;
            options.expressions = request.reshape.expressions && is_vrm;
            let timeline = self.read(|state| state.editor.document().timeline());
            options.timeline = Some(timeline).filter(|_| !options.expressions);
        }
        self.reshaped_as(id, pose, poses, options)
    }

    fn reshaped_as(
        &self,
        id: u32,
        pose: &[Vec3],
        poses: &[(String, Vec<Vec3>)],
        mut options: ReshapeOptions,
    ) -> Answer<Option<(Vec<u8>, ReshapeReport)>> {
        let is_rigged = |state: &State| Answer::Ok(state.models().get(id)?.model.is_rigged());
        if !self.read(is_rigged)? {
            return Ok(None);
        }
        self.read(|state| {
            let moved = MovedModel::new(state, id)?;
            let by_poses = poses
                .iter()
                .map(|(name, pose)| Ok((name.clone(), moved.by(state, pose)?)))
                .collect::<Answer<Vec<_>>>()?;
            // `rigid` may name parts of other models.
            let props = moved.model.props()?;
            options.rigid.retain(|name| props.contains(name));
            options.parts = state.models().get(id)?.parts()?;
            let by = moved.by(state, pose)?;
            Ok(Some(moved.model.write_reshaped(&by, &moved.outside, &by_poses, &options)?))
        })
    }

    /// Builds the options for exporting the rig of a model. With several models, joints with the same name get the same
    /// displacement, and the lowest point of all models determines the ground.
    fn of_rig(&self, pose: &[Vec3], request: &JsRigOptions) -> Answer<ReshapeOptions> {
        // Only `export_poses` writes saved poses, which can become expressions.
        let mut options = ReshapeOptions { expressions: false, ..request.reshape.clone() };
        let models: Vec<(u32, Arc<Model>)> = self.read(|state| {
            state.models().iter().map(|member| (member.id, Arc::clone(&member.model))).collect()
        });
        if models.len() < 2 {
            return Ok(options);
        }
        let mut skeleton = Skeleton::default();
        models.iter().for_each(|(_, model)| skeleton.add(model.joints_with_vertices()));
        options.skeleton = Some(Arc::new(skeleton.clone()));
        if !options.ground {
            return Ok(options);
        }
        let known = self.read(|state| {
            let (bound, of_request, ground) = state.ground.as_ref()?;
            let is_same = state.bound.as_ref().is_some_and(|own| Arc::ptr_eq(own, bound));
            (is_same && of_request == request && state.pose() == pose).then(|| ground.clone())
        });
        let ground = match known {
            Some(ground) => ground,
            None => {
                let posed = self.read(|state| state.deformed(pose))?;
                let mut all = Ground::default();
                for (id, model) in &models {
                    let free = ReshapeOptions { feet: Feet::Free, ..options.clone() };
                    let found = if request.plain { None } else { self.reshaped_as(*id, pose, &[], free)? };
                    all.add(match found.and_then(|(_, report)| report.ground) {
                        Some(ground) => ground,
                        None => self
                            .read(|state| Answer::Ok(model.ground(state.models().get(*id)?.share(&posed))))?,
                    });
                }
                let mut state = self.state.borrow_mut();
                if state.pose() == pose {
                    state.ground = state.bound.clone().map(|bound| (bound, request.clone(), all.clone()));
                }
                all
            }
        };
        options.skeleton = Some(Arc::new(skeleton.with_ground(ground)));
        Ok(options)
    }
}

/// A model and its weights, from which its displacements in a pose of the cage are computed.
struct MovedModel<'a> {
    model: Arc<Model>,
    rows: Option<ModelRows<'a>>,
    /// Indices of the points outside the cage.
    outside: Vec<u32>,
}

impl<'a> MovedModel<'a> {
    fn new(state: &'a State, id: u32) -> Answer<Self> {
        let model = Arc::clone(&state.models().get(id)?.model);
        let rows = state.bound.as_ref().map(|bound| state.own_rows(id, bound)).transpose()?;
        let outside = rows.iter().flat_map(|rows| &rows.outside).map(|o| o.vertex).collect();
        Ok(Self { model, rows, outside })
    }

    /// Computes the displacements of the model's vertices and of the points of its rig.
    fn by(&self, state: &State, pose: &[Vec3]) -> Answer<Vec<DVec3>> {
        let rest = &state.rest().positions;
        match &self.rows {
            Some(ModelRows { weights, frames, rig, .. }) if pose.len() == rest.len() => {
                let mut by = displacements(weights, frames, rest, pose);
                by.extend(displacements(rig, frames, rest, pose));
                Ok(by)
            }
            Some(_) => Err(Fault::new(ErrorName::Error, "a pose belongs to another cage")),
            None => Ok(vec![DVec3::ZERO; self.model.positions.len() + self.model.extra_points()?.len()]),
        }
    }
}

/// Weights of one model: rows of its vertices, and rows of its rig's points. Indices of points are relative to the
/// model.
struct ModelRows<'a> {
    weights: Weights,
    frames: &'a Frames,
    /// Points outside the cage. Indices of the rig's points follow the indices of the vertices.
    outside: Vec<OutsideVertex>,
    rig: Weights,
}

impl State {
    /// Copies the weights of one model.
    fn own_rows<'a>(&self, id: u32, bound: &'a BoundModels) -> Answer<ModelRows<'a>> {
        let BoundModels { weights: all, frames, .. } = bound;
        let n = self.models().positions().len();
        let (own, of_rig) = (self.models().get(id)?.vertices.clone(), self.models().extra_of(id)?);
        let rig = match &bound.rig {
            Some(rows) => rows.row_range(of_rig.clone()),
            None => Weights::with_room(all.n_columns() as u32, 0, 0),
        };
        let numbered = |o: &OutsideVertex| {
            let v = o.vertex as usize;
            let in_own = own.contains(&v).then(|| v - own.start);
            let in_rig =
                || v.checked_sub(n).filter(|v| of_rig.contains(v)).map(|v| v - of_rig.start + own.len());
            in_own.or_else(in_rig).map(|v| OutsideVertex { vertex: v as u32, ..*o })
        };
        let outside = bound.outside.iter().filter_map(numbered).collect();
        let weights = all.row_range(own.clone());
        Ok(ModelRows { weights, frames, outside, rig })
    }
}
