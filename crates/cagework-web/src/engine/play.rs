//! Clips: what plays is the model as it would be exported.

use js_sys::Float32Array;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::{Engine, lost};
use crate::error::{Answer, Fault};
use crate::options::taken;
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
        let pose = self.read(|state| state.positions.clone());
        let bytes = match self.reshaped(&pose, &[], &taken(options)?)? {
            Some((bytes, _)) => bytes,
            None => {
                let mut posed = self.deformed(&[pose])?;
                self.read(|state| {
                    Answer::Ok(state.the_model()?.write_glb(&posed.pop().unwrap_or_default())?)
                })?
            }
        };
        let (player, up) = self.read(|state| {
            let model = state.the_model()?;
            Answer::Ok((model.player_of(&bytes)?, model.up().turn()))
        })?;
        let mut gpu = self.gpu.lock().await;
        let gpu = gpu.as_mut().ok_or_else(lost)?;
        gpu.main.start_playing(&player.skin).await.map_err(Fault::from)?;
        self.read(|state| state.require(revision))?;
        let posed = player.at(None, 0.0, &[]);
        self.change(|state| {
            state.playing = Some(Playing { player, up, posed, is_new: true });
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

    /// Where the vertices are while a clip plays, by the processor; for tests and pictures. `[n_vertices, 3]`
    #[wasm_bindgen(js_name = clipPositions)]
    #[must_use]
    pub fn clip_positions(&self) -> Vec<f32> {
        self.read(|state| {
            let at = state.playing.as_ref().map(|playing| {
                let palette = playing.palette();
                cagework_core::skin::skin_vertices(&playing.player.skin, &palette, &playing.posed.targets)
            });
            crate::arrays::flat(&at.unwrap_or_default())
        })
    }
}
