//! Cagework on the GPU, using baseline WebGPU compute. The same kernels run natively, on lavapipe and in browsers.
//!
//! [`GpuContext`] holds the device and one pipeline per kernel of [`kernels`]. [`bind_gpu`] solves batch by
//! batch and reads back only the weights at mesh vertices. [`Deformer`] keeps the weights on the GPU and
//! deforms the mesh. [`Session`] combines them for one model and [`render`]s it.
//!
//! All calls are async and do not block the event loop of a browser: work is submitted in short slices ([`stream`]).

pub mod bind;
pub mod buffers;
pub mod canvas;
pub mod deform;
pub mod device;
pub mod error;
mod hold;
pub mod jacobi;
pub mod kernels;
pub mod layout;
pub mod levels;
pub mod multigrid;
pub mod pipelines;
pub mod plan;
pub mod render;
pub mod sample;
pub mod session;
pub mod skin;
pub mod splats;
pub mod stream;
pub mod table;

pub use bind::{bind_gpu, bind_on};
pub use deform::{Deformer, GpuWeights};
pub use device::{ContextOptions, GpuContext};
pub use error::GpuError;
pub use plan::{Plan, PlanError};
pub use session::Session;
pub use skin::Skinner;

/// The example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
