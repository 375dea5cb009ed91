//! Clips: what plays is the model as it would be exported.

use cagework_core::dynamic::{DisplacementField, Lattice};
use cagework_core::{Controls, Weights};
use cagework_io::WriteError;
use js_sys::Float32Array;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::{Engine, lost};
use crate::error::{Answer, ErrorName, Fault};
use crate::incoming;
use crate::options::{RigAsked, taken};
use crate::state::Playing;

#[wasm_bindgen]
impl Engine {
    /// Gets the model ready to be played in the pose of the moment; `showClip` shows it.
    ///
    /// # Errors
    /// When it is not bound or cannot be exported, or the GPU has no room for its skin.
    #[wasm_bindgen(js_name = startClip)]
    pub async fn start_clip(
        &self,
        #[wasm_bindgen(unchecked_param_type = "RigOptions")] options: JsValue,
    ) -> Result<(), JsValue> {
        let revision = self.revision();
        let asked: RigAsked = taken(options)?;
        let (player, field) = if asked.dynamic {
            let player = self.read(|state| Answer::Ok(state.the_model()?.player()?))?;
            (player.ok_or_else(|| Fault::from(WriteError::NoRig))?, Some(self.field()?))
        } else {
            let bytes = self.posed_glb(&asked)?.0;
            (self.read(|state| Answer::Ok(state.the_model()?.player_of(&bytes)?))?, None)
        };
        let up = self.read(|state| Answer::Ok(state.the_model()?.up().turn()))?;
        let mut gpu = self.gpu.lock().await;
        let gpu = gpu.as_mut().ok_or_else(lost)?;
        gpu.main.start_playing(&player.skin, field.clone()).await.map_err(Fault::from)?;
        self.read(|state| state.require(revision))?;
        let posed = player.at(None, 0.0, &[]);
        self.change(|state| {
            state.playing = Some(Playing { player, up, posed, field, is_new: true });
            state.is_changed = true;
        });
        Ok(())
    }

    /// Shows a time of a clip, seconds; at rest without one. `targets`: weights of the morph targets that the clip does not
    /// drive, or nothing for those of the file. Nothing happens before `startClip`.
    #[wasm_bindgen(js_name = showClip)]
    pub fn show_clip(&self, clip: Option<u32>, seconds: f32, targets: &Float32Array) {
        let is_ready = self.read(|state| state.playing.is_some());
        if !is_ready {
            return;
        }
        self.change(|state| {
            if let Some(playing) = &mut state.playing {
                let clip = clip.map(|clip| clip as usize);
                playing.posed = playing.player.at(clip, seconds, &targets.to_vec());
                playing.is_new = true;
                // Joints are part of the scene.
                state.is_changed |= state.view.joints.is_some();
            }
        });
    }

    /// Whether a clip is shown in place of the cage's pose: another pose of the cage ends it.
    #[wasm_bindgen(getter, js_name = showsClip)]
    #[must_use]
    pub fn shows_clip(&self) -> bool {
        self.read(|state| state.playing.is_some())
    }

    /// The model follows the cage again.
    #[wasm_bindgen(js_name = stopClip)]
    pub fn stop_clip(&self) {
        self.change(|state| {
            state.playing = None;
            (state.is_moved, state.is_changed) = (true, true);
        });
    }

    /// Whether [`Self::take_lattice`] has been called for this cage.
    #[wasm_bindgen(getter, js_name = hasLattice)]
    #[must_use]
    pub fn has_lattice(&self) -> bool {
        self.read(|state| state.lattice.is_some())
    }

    /// Takes what the cage needs to bend a moving model, as `Binder.bindLattice` bound it; the arrays are those of `adopt`.
    ///
    /// # Errors
    /// When there is no cage or the arrays are another one's.
    #[wasm_bindgen(js_name = takeLattice)]
    pub fn take_lattice(
        &self,
        indptr: Vec<u32>,
        indices: Vec<u32>,
        data: Vec<f32>,
        outside: &[u32],
        offsets: &[f32],
    ) -> Result<(), JsValue> {
        let lattice = self.read(|state| {
            let controls = Controls::from(state.parts()?.1);
            let lattice = Lattice::new(controls.surface());
            let weights = Weights::new(controls.n_controls() as u32, indptr, indices, data)?;
            let outside = incoming::outside(outside, offsets);
            let n = weights.n_rows();
            if n != lattice.points().len() || outside.iter().any(|o| o.vertex as usize >= n) {
                return Err(Fault::new(ErrorName::Error, "the weights are those of another cage's lattice"));
            }
            Answer::Ok((lattice, weights, outside))
        })?;
        self.state.borrow_mut().lattice = Some(lattice);
        Ok(())
    }

    /// Where the vertices are while a clip plays, by the processor; for tests and pictures. `[n_vertices, 3]`
    #[wasm_bindgen(js_name = clipPositions)]
    #[must_use]
    pub fn clip_positions(&self) -> Vec<f32> {
        self.read(|state| {
            let at = state.playing.as_ref().map(Playing::positions);
            crate::arrays::flat(&at.unwrap_or_default())
        })
    }
}

impl Engine {
    /// How far the cage as posed moves each place.
    ///
    /// # Errors
    /// When no lattice has come.
    pub(super) fn field(&self) -> Answer<DisplacementField> {
        self.read(|state| {
            let Some((lattice, weights, outside)) = &state.lattice else {
                return Err(Fault::missing("lattice", "bind it first"));
            };
            let (rest, posed) = (&state.rest().positions, &state.positions);
            Ok(DisplacementField::new(lattice.clone(), weights, outside, rest, posed))
        })
    }
}
