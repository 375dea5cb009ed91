//! Sessions on the GPU, and the upload that brings them to the document.
//!
//! A frame is skipped while the lock is held; an allocation holds the lock until the GPU has answered.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

use async_lock::Mutex;
use cagework_gpu::Session;

use crate::error::Answer;
use crate::options::Coordinates;
use crate::state::{OnGpu, State, Upload};
use crate::surface::Surface;

/// Sessions and the canvas they are drawn into.
pub(crate) struct Gpu {
    /// Harmonic coordinates.
    pub(crate) main: Session,
    /// Others beside them, each once at most.
    pub(crate) others: Vec<(Coordinates, Session)>,
    pub(crate) surface: Surface,
}

impl Gpu {
    /// Takes what has changed.
    pub(crate) fn take(&mut self, state: &mut State) {
        state.write(&mut self.main, self.others.iter_mut().map(|(_, session)| session));
    }

    /// The canvas, and sessions by kinds of coordinates, in that order, as far as there are such.
    pub(crate) fn shown(&mut self, kinds: &[Coordinates]) -> (&mut Surface, Vec<&mut Session>) {
        let Self { main, others, surface } = self;
        let others = others.iter_mut().map(|(kind, session)| (*kind, session));
        let all = std::iter::once((Coordinates::Harmonic, main)).chain(others);
        let placed =
            all.filter_map(|(kind, session)| Some((kinds.iter().position(|k| *k == kind)?, session)));
        let mut placed: Vec<_> = placed.collect();
        placed.sort_unstable_by_key(|(place, _)| *place);
        (surface, placed.into_iter().map(|(_, session)| session).collect())
    }
}

/// Empty only while it is rebuilt after a loss, and after that failed.
pub(crate) type SharedGpu = Rc<Mutex<Option<Gpu>>>;

/// Brings the GPU to what the document refers to: mesh, cage, weights that were computed before, and parts that the cage does not
/// bend. Looks again after each upload, because the document may have changed while the GPU answered.
///
/// # Errors
/// When the GPU has no room. What was not uploaded is tried again after the next change.
pub(crate) async fn upload(state: &RefCell<State>, gpu: &mut Gpu) -> Answer<()> {
    loop {
        let Some(next) = state.borrow().next_upload() else { return Ok(()) };
        let (key, models_key) = {
            let state = state.borrow();
            (state.editor.key(), state.editor.models_key())
        };
        match next {
            Upload::Mesh => {
                let draw = state.borrow().draw_model();
                gpu.others.clear();
                {
                    let on_gpu = &mut state.borrow_mut().on_gpu;
                    *on_gpu = OnGpu { cage: on_gpu.cage, ..OnGpu::default() };
                }
                gpu.main.set_shared_model(draw).await?;
                state.borrow_mut().on_gpu.mesh = Some(key.mesh);
            }
            Upload::Cage => {
                let Some(set) = state.borrow().set().cloned() else { return Ok(()) };
                gpu.others.clear();
                {
                    let on_gpu = &mut state.borrow_mut().on_gpu;
                    (on_gpu.cage, on_gpu.bound) = (None, None);
                }
                gpu.main.set_cage(&set).await?;
                state.borrow_mut().on_gpu.cage = Some(key.cage);
            }
            Upload::Weights => {
                let Some(bound) = state.borrow_mut().cache.get(key).cloned() else { continue };
                let (weights, frames) = (Arc::clone(&bound.weights), Arc::clone(&bound.frames));
                gpu.main.adopt(weights, frames).await?;
                let mut state = state.borrow_mut();
                if state.editor.key() == key {
                    state.set_bound(bound);
                }
            }
            Upload::Parts => {
                let parts = state.borrow().models().parts();
                let Gpu { main, others, .. } = gpu;
                for session in std::iter::once(main).chain(others.iter_mut().map(|(_, session)| session)) {
                    session.set_parts(parts.clone()).await?;
                }
                let mut state = state.borrow_mut();
                state.on_gpu.parts = Some(models_key);
                state.held.posed_for.clear();
            }
        }
        let mut state = state.borrow_mut();
        (state.is_moved, state.is_changed) = (true, true);
    }
}
