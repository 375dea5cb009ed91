//! Errors that JavaScript receives. The page branches on the name and shows the message to the user.

use std::fmt::Display;

use cagework_cage::check::RepairError;
use cagework_cage::generate::CageGenError;
use cagework_core::cage::CageError;
use cagework_core::slice::SliceError;
use cagework_core::weights::WeightsError;
use cagework_core::{BindError, ClosedFormError, ControlError};
use cagework_editor::{BoundError, EditError};
use cagework_gpu::GpuError;
use cagework_io::{NpzError, ObjError, PoseCodeError, ProjectError, ReadError, WriteError};
use cagework_job::JobError;
use cagework_pose::pull::PullError;
use serde::Serialize;
use wasm_bindgen::JsValue;

/// Kinds of errors that the page handles differently.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) enum ErrorName {
    /// The job was cancelled, or its result is out of date.
    Cancelled,
    /// A file cannot be read.
    Format,
    /// The work is too large to be saved while the user works.
    TooLarge,
    /// A bind needs more memory than its limit.
    Memory,
    /// A bind needs more memory than its limit, and most of it is for weights.
    WeightsMemory,
    /// Some vertices of the model are outside the cage.
    Outside,
    /// All vertices of the model are outside the cage.
    NoneInside,
    /// The browser offers no GPU adapter.
    NoAdapter,
    /// The GPU adapter provides no device.
    NoDevice,
    /// The GPU device is lost.
    DeviceLost,
    /// A computation failed on the GPU: out of memory, refused, timed out or unsupported. The CPU may still perform it.
    Gpu,
    /// The GPU cannot draw into the canvas.
    Canvas,
    /// A required object does not exist yet, such as a model or weights.
    Missing,
    /// Any other error.
    Error,
}

/// Name and message of an error. JavaScript receives it as an `Error`.
#[derive(Debug)]
pub struct Fault {
    name: ErrorName,
    message: String,
}

/// Result of functions that JavaScript calls.
pub(crate) type Answer<T> = Result<T, Fault>;

impl Fault {
    pub(crate) fn new(name: ErrorName, message: impl Display) -> Self {
        Self { name, message: message.to_string() }
    }

    /// Whether the error has this name.
    pub(crate) fn is(&self, name: ErrorName) -> bool {
        self.name == name
    }

    #[cfg(test)]
    pub(crate) fn message(&self) -> &str {
        &self.message
    }

    /// Creates a [`ErrorName::Missing`] error: `what` is missing, `how` says what to do first.
    pub(crate) fn missing(what: &str, how: &str) -> Self {
        Self::new(ErrorName::Missing, format!("there is no {what} yet: {how}"))
    }
}

impl From<Fault> for JsValue {
    fn from(fault: Fault) -> Self {
        let error = js_sys::Error::new(&fault.message);
        let name = serde_wasm_bindgen::to_value(&fault.name).ok().and_then(|name| name.as_string());
        error.set_name(&name.unwrap_or_default());
        error.into()
    }
}

/// Converts error types that need no name of their own: the page shows only their message.
macro_rules! plain {
    ($($error:ty),*) => {$(
        impl From<$error> for Fault {
            fn from(error: $error) -> Self {
                Self::new(ErrorName::Error, error)
            }
        }
    )*};
}

plain!(
    CageError,
    ClosedFormError,
    ControlError,
    NpzError,
    ObjError,
    PoseCodeError,
    PullError,
    RepairError,
    SliceError,
    WeightsError,
    WriteError,
    serde_wasm_bindgen::Error
);

impl From<BindError> for Fault {
    fn from(error: BindError) -> Self {
        let name = match error {
            BindError::Cancelled(_) => ErrorName::Cancelled,
            BindError::Memory { .. } => ErrorName::Memory,
            BindError::WeightsMemory { .. } => ErrorName::WeightsMemory,
            BindError::Outside { .. } => ErrorName::Outside,
            BindError::NoneInside { .. } => ErrorName::NoneInside,
            _ => ErrorName::Error,
        };
        Self::new(name, error)
    }
}

impl From<JobError> for Fault {
    fn from(error: JobError) -> Self {
        match error {
            JobError::Bind(error) => error.into(),
            error => Self::new(ErrorName::Error, error),
        }
    }
}

impl From<EditError> for Fault {
    fn from(error: EditError) -> Self {
        let name = match error {
            EditError::NoModel | EditError::NoCage => ErrorName::Missing,
            EditError::Rig(WriteError::Limit { .. }) => ErrorName::TooLarge,
            _ => ErrorName::Error,
        };
        Self::new(name, error)
    }
}

impl From<BoundError> for Fault {
    fn from(error: BoundError) -> Self {
        match error {
            BoundError::Missing { .. } => Self::new(ErrorName::Missing, error),
            BoundError::Edit(error) => error.into(),
            BoundError::Read(error) => error.into(),
            BoundError::Job(error) => error.into(),
            _ => Self::new(ErrorName::Error, error),
        }
    }
}

impl From<CageGenError> for Fault {
    fn from(error: CageGenError) -> Self {
        let is_cancelled = matches!(error, CageGenError::Cancelled(_));
        Self::new(if is_cancelled { ErrorName::Cancelled } else { ErrorName::Error }, error)
    }
}

impl From<ReadError> for Fault {
    fn from(error: ReadError) -> Self {
        Self::new(ErrorName::Format, error)
    }
}

impl From<ProjectError> for Fault {
    fn from(error: ProjectError) -> Self {
        match error {
            ProjectError::Model(error) => error.into(),
            other => Self::new(ErrorName::Format, other),
        }
    }
}

impl From<GpuError> for Fault {
    fn from(error: GpuError) -> Self {
        let name = match error {
            GpuError::Bind(error) => return error.into(),
            GpuError::NoAdapter { .. } => ErrorName::NoAdapter,
            GpuError::NoDevice { .. } => ErrorName::NoDevice,
            GpuError::DeviceLost { .. } => ErrorName::DeviceLost,
            GpuError::OutOfMemory { .. }
            | GpuError::Refused { .. }
            | GpuError::Timeout { .. }
            | GpuError::Plan(_) => ErrorName::Gpu,
            _ => ErrorName::Error,
        };
        Self::new(name, error)
    }
}
