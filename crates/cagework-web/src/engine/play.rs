//! Methods that play clips. Playback shows the models as an export would contain them.

use cagework_core::field::{self, Field, FieldWeights, Lattice};
use cagework_core::{Controls, Weights};
use cagework_io::ModelFormat;
use js_sys::Float32Array;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::{Engine, lost};
use crate::binder::Offsets;
use crate::error::{Answer, ErrorName, Fault};
use crate::options::{JsRigOptions, decode};
use crate::playing::{ModelMotion, Playback, SharedClip};

#[wasm_bindgen]
impl Engine {
    /// Prepares playback of the models in the current pose; `showClip` then shows a time of a clip.
    ///
    /// # Errors
    /// If the models are not bound or cannot be exported, or the GPU runs out of memory.
    #[wasm_bindgen(js_name = startClip)]
    pub async fn start_clip(
        &self,
        #[wasm_bindgen(unchecked_param_type = "RigOptions")] options: JsValue,
    ) -> Result<(), JsValue> {
        let revision = self.revision();
        let request: JsRigOptions = decode(options)?;
        let field = if request.dynamic { Some(self.field()?) } else { None };
        let ids: Vec<u32> = self.read(|state| state.models().iter().map(|member| member.id).collect());
        let parts =
            ids.into_iter().map(|id| Ok((id, self.part(id, &request)?))).collect::<Answer<Vec<_>>>()?;
        let (clips, up) = self.read(|state| (SharedClip::all(state.models()), state.up().turn()));
        let playing = Playback::new(parts, clips, up, field.clone());
        let mut gpu = self.gpu.lock().await;
        let gpu = gpu.as_mut().ok_or_else(lost)?;
        gpu.main.start_playing(&playing.skin, field).await.map_err(Fault::from)?;
        self.read(|state| state.require(revision))?;
        self.change(|state| {
            state.playing = Some(playing);
            state.is_changed = true;
        });
        Ok(())
    }

    /// Shows the models at a time of a clip, in seconds; without a clip, at rest. `targets`: weights of the morph
    /// targets that the clip does not animate; if empty, the weights of the file. Does nothing before `startClip`.
    #[wasm_bindgen(js_name = showClip)]
    pub fn show_clip(&self, clip: Option<u32>, seconds: f32, targets: &Float32Array) {
        let is_ready = self.read(|state| state.playing.is_some());
        if !is_ready {
            return;
        }
        self.change(|state| {
            if let Some(playing) = &mut state.playing {
                playing.show(clip.map(|clip| clip as usize), seconds, &targets.to_vec());
                // Joint marks are part of the scene, which must be rebuilt.
                state.is_changed |= state.view.joints.is_some();
            }
        });
    }

    /// Whether playback of a clip is shown instead of the posed model. Changing the pose stops playback.
    #[wasm_bindgen(getter, js_name = showsClip)]
    #[must_use]
    pub fn shows_clip(&self) -> bool {
        self.read(|state| state.playing.is_some())
    }

    /// Stops playback; the model follows the cage's pose again.
    #[wasm_bindgen(js_name = stopClip)]
    pub fn stop_clip(&self) {
        self.change(|state| {
            state.playing = None;
            (state.is_moved, state.is_changed) = (true, true);
        });
    }

    /// Whether weights on a lattice around the current cage are available.
    #[wasm_bindgen(getter, js_name = hasLattice)]
    #[must_use]
    pub fn has_lattice(&self) -> bool {
        self.read(|state| state.lattice.is_some())
    }

    /// Stores the weights of `Binder.bindLattice`, which deform a model that a clip moves. Arrays as for `adopt`.
    ///
    /// # Errors
    /// Without a cage, or if the arrays do not match a lattice around this cage.
    #[wasm_bindgen(js_name = takeLattice)]
    pub fn take_lattice(
        &self,
        indptr: Vec<u32>,
        indices: Vec<u32>,
        data: Vec<f32>,
        #[wasm_bindgen(unchecked_param_type = "Offsets")] offsets: JsValue,
    ) -> Result<(), JsValue> {
        let lattice = self.read(|state| {
            let controls = Controls::from(state.require_set()?);
            let lattice = Lattice::new(controls.surface(), field::CLIP_CELLS);
            let Offsets { frames, .. } = decode(offsets)?;
            let n_columns = controls.n_controls() + frames.n_columns();
            let weights = Weights::new(n_columns as u32, indptr, indices, data)?;
            if weights.n_rows() != lattice.points().len() || !frames.fits(controls.n_controls()) {
                return Err(Fault::new(ErrorName::Error, "the weights are those of another cage's lattice"));
            }
            Answer::Ok(FieldWeights::new(lattice, weights, frames))
        })?;
        self.state.borrow_mut().lattice = Some(lattice);
        Ok(())
    }

    /// Vertices during playback, computed on the CPU for tests and pictures. `[n_vertices, 3]`
    #[wasm_bindgen(js_name = clipPositions)]
    #[must_use]
    pub fn clip_positions(&self) -> Vec<f32> {
        self.read(|state| {
            let at = state.playing.as_ref().map(Playback::positions);
            crate::arrays::flat(&at.unwrap_or_default())
        })
    }
}

impl Engine {
    /// Motion of one model: that of its export, or with `dynamic` that of the original file, which the cage then
    /// deforms.
    fn part(&self, id: u32, request: &JsRigOptions) -> Answer<ModelMotion> {
        let is_gltf =
            self.read(|state| Answer::Ok(state.models().get(id)?.model.format() == ModelFormat::Gltf))?;
        if is_gltf && !request.dynamic {
            let bytes = self.posed_glb(id, request)?.0;
            let player = self.read(|state| Answer::Ok(state.models().get(id)?.model.player_of(&bytes)?))?;
            return Ok(ModelMotion::Player(Box::new(player)));
        }
        if let Some(player) = self.read(|state| Answer::Ok(state.models().get(id)?.model.player()?))? {
            return Ok(ModelMotion::Player(Box::new(player)));
        }
        // A model whose format has no clips moves only with the cage.
        let pose =
            self.read(|state| if request.dynamic { &state.rest().positions } else { state.pose() }.to_vec());
        let posed = self.deformed(&[pose])?.pop().unwrap_or_default();
        self.read(|state| {
            let own = state.models().get(id)?.share(&posed);
            Ok(ModelMotion::Still(state.up().turned_back(own).into_owned()))
        })
    }

    /// The displacement field of the posed cage.
    ///
    /// # Errors
    /// If the lattice is not available.
    pub(super) fn field(&self) -> Answer<Field> {
        self.read(|state| {
            let Some(lattice) = &state.lattice else {
                return Err(Fault::missing("lattice", "bind it first"));
            };
            let (rest, posed) = (&state.rest().positions, state.pose());
            Ok(lattice.pose(rest, posed))
        })
    }
}
