//! GPU sessions, and uploads of the document to them.
//!
//! An upload holds the lock until the GPU has allocated and filled its buffers; frames are skipped during this time.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

use async_lock::Mutex;
use cagework_core::Coordinates;
use cagework_gpu::Session;

use crate::error::Answer;
use crate::state::{GpuKeys, State, Upload};
use crate::surface::CanvasSurface;

/// GPU sessions, and the canvas that they draw into.
pub(crate) struct Gpu {
    /// The session that draws the model deformed by harmonic coordinates.
    pub(crate) main: Session,
    /// The sessions that draw it deformed by other kinds of coordinates, at most one per kind.
    pub(crate) others: Vec<(Coordinates, Session)>,
    pub(crate) surface: CanvasSurface,
}

impl Gpu {
    /// Writes the changed parts of the state to all sessions.
    pub(crate) fn take(&mut self, state: &mut State) {
        state.write(&mut self.main, self.others.iter_mut().map(|(_, session)| session));
    }

    /// The canvas, and the available sessions of `kinds` in the order of `kinds`.
    pub(crate) fn shown(&mut self, kinds: &[Coordinates]) -> (&mut CanvasSurface, Vec<&mut Session>) {
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

/// GPU state of the engine; `None` while a lost device is being replaced, and after the replacement has failed.
pub(crate) type SharedGpu = Rc<Mutex<Option<Gpu>>>;

/// Uploads the data of the document that the GPU lacks: mesh, cage, cached weights, and the fixed and rigid parts.
/// Compares document and GPU again after each upload, because the document may have changed during the upload.
///
/// # Errors
/// If the GPU runs out of memory. The next change of the state retries the upload.
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
                    *on_gpu = GpuKeys { cage: on_gpu.cage, ..GpuKeys::default() };
                }
                gpu.main.set_shared_model(draw).await?;
                state.borrow_mut().on_gpu.mesh = Some(key.mesh);
            }
            Upload::Cage => {
                let Some(set) = state.borrow().set().cloned() else { return Ok(()) };
                gpu.others.clear();
                state.borrow_mut().on_gpu.cage = None;
                gpu.main.set_cage(&set).await?;
                state.borrow_mut().on_gpu.cage = Some(key.cage);
            }
            Upload::Weights => {
                let Some(cached) = state.borrow_mut().cache.get(key).cloned() else { continue };
                let (weights, frames) = (Arc::clone(&cached.0.weights), Arc::clone(&cached.0.frames));
                gpu.main.adopt(weights, frames).await?;
                let mut state = state.borrow_mut();
                if state.editor.key() == key {
                    state.set_bound(cached);
                }
            }
            Upload::Parts => {
                let parts = state.borrow().models().parts();
                let Gpu { main, others, .. } = gpu;
                for session in std::iter::once(main).chain(others.iter_mut().map(|(_, session)| session)) {
                    session.set_parts(parts.clone()).await?;
                }
                state.borrow_mut().on_gpu.parts = Some(models_key);
            }
        }
        let mut state = state.borrow_mut();
        (state.is_moved, state.is_changed) = (true, true);
    }
}
