//! What is on the GPU, and taking turns at it.
//!
//! Frames are drawn at once or not at all; what allocates waits for the GPU's answer and holds the lock meanwhile.

use std::rc::Rc;

use async_lock::Mutex;
use cagework_gpu::Session;

use crate::surface::Surface;

/// Sessions and the canvas they are drawn into.
pub(crate) struct Gpu {
    /// Harmonic coordinates.
    pub(crate) main: Session,
    /// Mean value coordinates beside them.
    pub(crate) other: Option<Session>,
    pub(crate) surface: Surface,
}

/// Empty only while it is rebuilt after a loss, and after that failed.
pub(crate) type SharedGpu = Rc<Mutex<Option<Gpu>>>;
