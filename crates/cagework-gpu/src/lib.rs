//! Cagework on the GPU: core WebGPU compute, the same kernels on lavapipe, a desktop GPU and in the browser.
//!
//! [`GpuContext`] holds the device and one pipeline per [`kernels`] row; [`bind_gpu`] solves batch after batch on it and
//! reads back only the weights sampled at the mesh's vertices; [`Deformer`] keeps them on the GPU and moves the mesh.
//! [`Session`] is all of it for one model, with pictures by the [`render`]er.
//! Everything is async and nothing blocks the web's event loop: work goes out in short slices ([`stream`]), awaited.

pub mod bind;
pub mod buffers;
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
