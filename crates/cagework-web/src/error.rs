//! Errors as JavaScript has them: name = variant, message = sentence.

use std::fmt::{Debug, Display};

use cagework_core::cage::CageError;
use cagework_core::cage_check::RepairError;
use cagework_core::cage_gen::CageGenError;
use cagework_core::edit::PoseError;
use cagework_core::rest_edit::RestEditError;
use cagework_core::slice::SliceError;
use cagework_core::weights::WeightsError;
use cagework_core::{BindError, MeanValueError};
use cagework_gpu::GpuError;
use cagework_io::{NpzError, PoseCodeError, ProjectError, ReadError, WriteError};
use wasm_bindgen::JsValue;

/// An error on its way to JavaScript.
#[derive(Debug)]
pub(crate) struct Fault {
    name: String,
    message: String,
}

/// What functions that JavaScript calls return.
pub(crate) type Answer<T> = Result<T, Fault>;

impl Fault {
    /// An error of this crate's own.
    pub(crate) fn new(name: &str, message: impl Into<String>) -> Self {
        Self { name: name.to_owned(), message: message.into() }
    }

    /// Whether this is the error of that name.
    pub(crate) fn is(&self, name: &str) -> bool {
        self.name == name
    }

    /// There is none of what is needed.
    pub(crate) fn missing(what: &str, how: &str) -> Self {
        Self::new("Missing", format!("there is no {what} yet: {how}"))
    }

    /// Named for the variant of `error`: the first word of its debug output.
    fn of(error: &(impl Debug + Display)) -> Self {
        let debug = format!("{error:?}");
        let end = debug.find(|c: char| !c.is_alphanumeric()).unwrap_or(debug.len());
        Self { name: debug[..end].to_owned(), message: error.to_string() }
    }

    fn named(mut self, inner: &Self) -> Self {
        self.name.clone_from(&inner.name);
        self
    }
}

impl From<Fault> for JsValue {
    fn from(fault: Fault) -> Self {
        let error = js_sys::Error::new(&fault.message);
        error.set_name(&fault.name);
        error.into()
    }
}

macro_rules! plain {
    ($($error:ty),*) => {$(
        impl From<$error> for Fault {
            fn from(error: $error) -> Self {
                Self::of(&error)
            }
        }
    )*};
}

plain!(
    BindError,
    CageError,
    CageGenError,
    MeanValueError,
    NpzError,
    PoseCodeError,
    PoseError,
    RepairError,
    RestEditError,
    SliceError,
    WeightsError,
    WriteError
);

impl From<ReadError> for Fault {
    fn from(error: ReadError) -> Self {
        let fault = Self::of(&error);
        match &error {
            ReadError::Gltf { source, .. } => fault.named(&Self::of(source)),
            ReadError::Obj { source, .. } => fault.named(&Self::of(source)),
            ReadError::Format(_) | ReadError::NoFaces { .. } => fault,
        }
    }
}

impl From<ProjectError> for Fault {
    fn from(error: ProjectError) -> Self {
        match error {
            ProjectError::Model(error) => error.into(),
            other => Self::of(&other),
        }
    }
}

impl From<GpuError> for Fault {
    fn from(error: GpuError) -> Self {
        match error {
            GpuError::Bind(error) => error.into(),
            other => Self::of(&other),
        }
    }
}

impl From<serde_wasm_bindgen::Error> for Fault {
    fn from(error: serde_wasm_bindgen::Error) -> Self {
        Self::new("Argument", error.to_string())
    }
}
