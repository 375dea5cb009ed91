//! Methods that write files and return arrays of the models.

use std::borrow::Cow;

use cagework_cage::CageOptions;
use cagework_editor::{BoundError, Exported, SharedClip};
use cagework_io::write_zip;
use js_sys::{Array, Float32Array, Function, Uint8Array, Uint32Array};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::arrays::flat;
use crate::cage::RigArrays;
use crate::error::{Answer, ErrorName, Fault};
use crate::options::{KEPT_LIMIT, KEPT_PIECE, READ_LIMIT, decode};
use crate::state::State;
use crate::views::object;

#[wasm_bindgen]
impl Engine {
    /// Packs files into an uncompressed zip archive. The names must be distinct.
    ///
    /// # Errors
    /// If two names are equal.
    #[wasm_bindgen(js_name = zipFiles)]
    #[allow(clippy::needless_pass_by_value, reason = "wasm-bindgen passes arrays by value")]
    pub fn zip_files(names: Vec<String>, files: Vec<Uint8Array>) -> Answer<Vec<u8>> {
        let files: Vec<(String, Vec<u8>)> =
            names.into_iter().zip(files.iter().map(Uint8Array::to_vec)).collect();
        let equal = || Fault::new(ErrorName::Error, "two files of an archive have the same name");
        write_zip(&files).ok_or_else(equal)
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
    ) -> Answer<Vec<u8>> {
        let options = decode(options)?;
        let clips = self.read(|state| SharedClip::group(state.models()));
        let clip = clips.get(clip as usize).and_then(|clip| clip.index_in(id));
        self.export(|state| state.bound_document().glb(id, &options, clip))
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
    ) -> Answer<Vec<u8>> {
        let options = decode(options)?;
        self.export(|state| state.bound_document().clips(name, bytes, &options, READ_LIMIT))
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
    ) -> Answer<Vec<u8>> {
        let format = decode(format)?;
        self.export(|state| {
            let shown = state.playing.as_ref().filter(|_| frame);
            state.bound_document().shape(id, format, shown)
        })
    }

    /// Sentences that list what the files of [`Self::export_shape`] lose, one per kind of model.
    #[wasm_bindgen(js_name = lostIn)]
    pub fn lost_in(
        &self,
        #[wasm_bindgen(unchecked_param_type = "ModelFormat")] format: JsValue,
    ) -> Answer<Vec<String>> {
        let format = decode(format)?;
        Ok(self.read(|state| {
            let mut lost: Vec<String> =
                state.models().iter().filter_map(|member| member.model.lost_in(format)).collect();
            lost.sort_unstable();
            lost.dedup();
            lost
        }))
    }

    /// Returns notices from the last export, one sentence each: changes of the rig, and data that the file format
    /// loses. Clears them, so that each is returned once.
    #[wasm_bindgen(js_name = rigNotices)]
    pub fn rig_notices(&self) -> Vec<String> {
        std::mem::take(&mut self.state.borrow_mut().rig_notices)
    }

    /// Exports a model as GLB with a morph target for each saved pose of the cage and the animation that `playAt`
    /// shows. `in_pose`: the model has the shape of the current pose; otherwise it stays at rest. `name`: name of
    /// the animation.
    ///
    /// # Errors
    /// If the file cannot be written.
    #[wasm_bindgen(js_name = exportPoses)]
    pub fn export_poses(
        &self,
        id: u32,
        #[wasm_bindgen(unchecked_param_type = "RigOptions")] options: JsValue,
        in_pose: bool,
        name: &str,
    ) -> Answer<Vec<u8>> {
        let options = decode(options)?;
        self.export(|state| state.bound_document().poses(id, &options, in_pose, name))
    }

    /// Exports the posed cage as OBJ.
    ///
    /// # Errors
    /// Without a cage.
    #[wasm_bindgen(js_name = exportCage)]
    pub fn export_cage(&self) -> Answer<Vec<u8>> {
        self.read(|state| Ok(state.editor.document().cage_obj()?))
    }

    /// Exports the inner controls in the current pose, as OBJ.
    ///
    /// # Errors
    /// If the cage has no inner controls.
    #[wasm_bindgen(js_name = exportControls)]
    pub fn export_controls(&self) -> Answer<Vec<u8>> {
        self.read(|state| Ok(state.editor.document().controls_obj()?))
    }

    /// Exports the weights of one model as NPZ, which `scipy.sparse.load_npz` reads.
    ///
    /// # Errors
    /// If the models are not bound.
    #[wasm_bindgen(js_name = exportWeights)]
    pub fn export_weights(&self, id: u32) -> Answer<Vec<u8>> {
        self.read(|state| Ok(state.bound_document().weights(id)?))
    }

    /// Writes a project file with the document, and with the page's settings as a JSON object.
    ///
    /// # Errors
    /// If no model is open, or the file would be too large.
    #[wasm_bindgen(js_name = writeProject)]
    pub fn write_project(&self, settings: &str) -> Answer<Vec<u8>> {
        self.read(|state| Ok(state.editor.write_project(settings)?))
    }

    /// Writes the project file that the page keeps while the user works. `push` is called with each piece of at most
    /// 8 MiB as a Uint8Array, so that wasm and JavaScript never hold the whole file.
    ///
    /// # Errors
    /// If no model is open, or named `TooLarge` if the file would take more than 200 MiB.
    #[wasm_bindgen(js_name = writeKept)]
    pub fn write_kept(&self, settings: &str, push: &Function) -> Answer<()> {
        let mut write = |pieces: &[Cow<'_, [u8]>]| {
            // The function of the page only collects what it is given.
            let copy = |bytes: &[u8]| drop(push.call1(&JsValue::NULL, &Uint8Array::from(bytes)));
            let mut next = Vec::new();
            for piece in pieces.iter().flat_map(|piece| piece.chunks(KEPT_PIECE)) {
                if next.len() + piece.len() > KEPT_PIECE {
                    copy(&next);
                    next.clear();
                }
                next.extend_from_slice(piece);
            }
            copy(&next);
        };
        self.read(|state| Ok(state.editor.write_project_in_pieces(settings, KEPT_LIMIT, &mut write)?))
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
    pub fn bound_points(&self) -> Answer<Vec<f32>> {
        self.read(|state| Ok(flat(&[state.models().positions(), &state.models().extra_points()?].concat())))
    }

    /// Returns the geometry that a cage should enclose: positions and triangles of the models at rest, with each morph
    /// target, and in the frames of `clip` if it is given. `[n, 3]` each
    ///
    /// # Errors
    /// If no model has this clip.
    #[wasm_bindgen(js_name = modelStates, unchecked_return_type = "[Float32Array, Uint32Array]")]
    #[allow(clippy::needless_pass_by_value, reason = "wasm-bindgen passes optional strings by value")]
    pub fn model_states(&self, clip: Option<String>) -> Answer<JsValue> {
        let states = self.read(|state| state.models().states(clip.as_deref()));
        let (positions, triangles) = states.map_err(|e| Fault::new(ErrorName::Error, e))?;
        let positions = Float32Array::from(flat(&positions).as_slice());
        let triangles = Uint32Array::from(triangles.as_flattened());
        Ok(Array::of2(&positions, &triangles).into())
    }

    /// Options of a cage around the frames of a clip.
    ///
    /// # Errors
    /// If the options are not valid.
    #[wasm_bindgen(js_name = clipCageOptions, unchecked_return_type = "CageOptions")]
    pub fn clip_cage_options(
        #[wasm_bindgen(unchecked_param_type = "CageOptions")] options: JsValue,
    ) -> Answer<JsValue> {
        let options: CageOptions = decode(options)?;
        Ok(object(&options.around_clip()))
    }

    /// Joints of all models at rest, for the positions that [`Self::model_states`] returns without a clip; undefined
    /// without joints.
    #[wasm_bindgen(js_name = modelRig, unchecked_return_type = "RigArrays | undefined")]
    pub fn model_rig(&self) -> JsValue {
        let rig = self.read(|state| state.models().rest_rig());
        rig.map_or(JsValue::UNDEFINED, |rig| object(&RigArrays::of(&rig)))
    }

    /// Triangles of all models. `[n_triangles, 3]`
    #[wasm_bindgen(js_name = modelTriangles)]
    pub fn model_triangles(&self) -> Vec<u32> {
        self.read(|state| state.models().triangles().as_flattened().to_vec())
    }
}

impl Engine {
    /// Writes a file, and keeps its notices for [`Self::rig_notices`].
    fn export(&self, write: impl FnOnce(&State) -> Result<Exported, BoundError>) -> Answer<Vec<u8>> {
        let Exported { bytes, notices } = self.read(write)?;
        self.state.borrow_mut().rig_notices = notices;
        Ok(bytes)
    }
}
