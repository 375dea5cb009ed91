//! What is on the GPU, and taking turns at it.
//!
//! Frames are drawn at once or not at all; what allocates waits for the GPU's answer and holds the lock meanwhile.

use std::rc::Rc;

use async_lock::Mutex;
use cagework_gpu::Session;

use crate::options::Coordinates;
use crate::state::State;
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
