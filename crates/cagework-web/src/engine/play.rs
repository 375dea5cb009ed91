//! Methods that play clips. Playback shows the models as an export would contain them.

use cagework_core::Controls;
use cagework_core::enclosure::Enclosure;
use cagework_core::field::{self, FieldWeights, Lattice};
use cagework_core::splats::{Outline, outlines};
use cagework_editor::{Playback, RigOptions};
use js_sys::Float32Array;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen_futures::spawn_local;

use super::{Engine, lost};
use crate::clock::now_ms;
use crate::error::{Answer, ErrorName, Fault};
use crate::options::decode;
use crate::state::State;
use crate::weights::BoundArrays;

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
    ) -> Answer<()> {
        self.play(decode(options)?, false).await
    }

    /// Shows the models at a time of a clip, in seconds; without a clip, at rest. `targets`: weights of the morph
    /// targets that the clip does not animate; if empty, the weights of the file. `is_paused`: the cage is shown and
    /// can be moved. Does nothing before `startClip`.
    #[wasm_bindgen(js_name = showClip)]
    pub fn show_clip(&self, clip: Option<u32>, seconds: f32, targets: &Float32Array, is_paused: bool) {
        let is_ready = self.read(|state| state.playing.is_some());
        if !is_ready {
            return;
        }
        self.change(|state| {
            if let Some(playing) = &mut state.playing {
                playing.show(clip.map(|clip| clip as usize), seconds, targets.to_vec());
                // Joint marks and the cage are part of the scene, which must be rebuilt.
                state.is_changed |= state.view.joints.is_some() || playing.is_paused != is_paused;
                playing.is_paused = is_paused;
            }
        });
    }

    /// Whether playback of a clip is shown instead of the posed model. A change of models, cage or weights stops
    /// playback; after a change of the pose, playback shows the models in the new pose.
    #[wasm_bindgen(getter, js_name = showsClip)]
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
    pub fn has_lattice(&self) -> bool {
        self.read(|state| state.lattice.is_some())
    }

    /// Stores the weights of `Binder.bindLattice`, which deform a model that a clip moves.
    ///
    /// # Errors
    /// Without a cage, or if the arrays do not match a lattice around this cage.
    #[wasm_bindgen(js_name = takeLattice)]
    pub fn take_lattice(
        &self,
        #[wasm_bindgen(unchecked_param_type = "BoundArrays")] rows: JsValue,
    ) -> Answer<()> {
        let lattice = self.read(|state| {
            let controls = Controls::from(state.require_set()?);
            let lattice = Lattice::new(controls.surface(), field::CLIP_CELLS);
            let (weights, frames) = decode::<BoundArrays>(rows)?.bound(controls.n_controls())?;
            if weights.n_rows() != lattice.points().len() {
                return Err(Fault::new(ErrorName::Error, "the weights are those of another cage's lattice"));
            }
            Answer::Ok(FieldWeights::new(lattice, weights, frames))
        })?;
        self.change(|state| {
            state.floaters = state.outside_splats();
            state.lattice = Some(lattice);
            (state.is_moved, state.is_changed) = (true, true);
        });
        Ok(())
    }

    /// Returns semi-axes and angle, radians, of three ellipses on the screen: the splat nearest to the pointer at rest,
    /// the unit sphere's image under the deformation gradient at this splat, and the splat in the pose. `[3, 3]`; empty
    /// if the pointer is not on a capture.
    #[wasm_bindgen(js_name = outlinesAt)]
    pub fn outlines_at(&self, x: f32, y: f32) -> Vec<f32> {
        let found = self.posed(|state| {
            let models = state.models();
            let at = state.posed_models().surface_at(state.pointer(x, y));
            let place = at.and_then(|at| at.position(models, models.positions()));
            let across = [state.camera.right(), state.camera.up()];
            let field = state.bound_document().field_of_splats();
            let of = |(splats, place)| outlines(splats, field.as_ref(), place, across);
            models.splats().zip(place).and_then(of)
        });
        let flat = |of: Outline| [of.half_axes.x, of.half_axes.y, of.angle];
        found.ok().flatten().map_or_else(Vec::new, |all| all.map(flat).concat())
    }

    /// Computes the vertices during playback on the CPU, for tests and pictures. `[n_vertices, 3]`
    #[wasm_bindgen(js_name = clipPositions)]
    pub fn clip_positions(&self) -> Vec<f32> {
        self.read(|state| {
            let at = state.playing.as_ref().map(Playback::positions);
            crate::arrays::flat(&at.unwrap_or_default())
        })
    }
}

impl State {
    /// Splats outside the cage, ascending.
    fn outside_splats(&self) -> Vec<u32> {
        match (self.models().splats(), self.set()) {
            (Some(splats), Some(set)) => Enclosure::new(set.cage(), &splats.positions).outside(),
            _ => Vec::new(),
        }
    }
}

impl Engine {
    /// Starts playback of the models in the current pose. If a playback is running, the new one replaces it and
    /// continues at the same time. With `is_update`, does nothing if no playback is running, because the user may have
    /// stopped it during the preparation.
    ///
    /// # Errors
    /// If the models are not bound or cannot be exported, or the GPU runs out of memory. `Cancelled` if models or cage
    /// change during the preparation.
    async fn play(&self, options: RigOptions, is_update: bool) -> Answer<()> {
        // Wait, because `playback` reads weights, which fails during an upload.
        self.ready().await;
        let start = now_ms();
        let revision = self.revision();
        let mut playing = self.read(|state| Playback::new(state.bound_document(), options))?;
        playing.prepared_ms = now_ms() - start;
        let mut gpu = self.gpu.lock().await;
        let gpu = gpu.as_mut().ok_or_else(lost)?;
        gpu.main.start_playing(&playing.skin, playing.field.clone()).await?;
        self.read(|state| state.require(revision))?;
        self.change(|state| {
            match &state.playing {
                Some(before) => playing.show_as(before),
                None if is_update => return,
                None => {}
            }
            state.playing = Some(playing);
            state.is_changed = true;
        });
        Ok(())
    }

    /// Updates the playback after a change of the pose, unless an update is in progress.
    pub(super) fn follow_pose(&self) {
        {
            let mut state = self.state.borrow_mut();
            if state.is_preparing || state.stale_clip().is_none() {
                return;
            }
            state.is_preparing = true;
        }
        let engine = self.clone();
        spawn_local(async move {
            let mut outcome = Ok(());
            while outcome.is_ok()
                && let Some(options) = engine.read(State::stale_clip)
            {
                outcome = engine.play(options, true).await;
            }
            {
                let mut state = engine.state.borrow_mut();
                state.is_preparing = false;
                if let Err(fault) = outcome {
                    state.playing = None;
                    (state.is_moved, state.is_changed) = (true, true);
                    if !fault.is(ErrorName::Cancelled) {
                        state.fault = Some(fault);
                    }
                }
            }
            engine.announce();
        });
    }
}
