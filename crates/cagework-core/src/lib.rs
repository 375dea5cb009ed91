//! The numerical core of cage deformation by harmonic coordinates.
//!
//! Data flow: mesh and [`Controls`] -> grid -> levels -> (per batch: solve, sample) -> [`Weights`] -> deform. No I/O,
//! no GPU, no JavaScript; everything here compiles for `wasm32-unknown-unknown`.

pub mod assemble;
pub mod bind;
pub mod cage;
pub mod closest;
pub mod color;
pub mod contact;
pub mod controls;
pub mod coordinates;
pub mod crossing;
pub mod deform;
pub mod disjoint;
pub mod enclosure;
pub mod field;
pub mod fill;
pub mod frames;
pub mod geometry;
pub mod grid;
pub mod inpaint;
pub mod levels;
pub mod mesh;
pub mod narrow;
pub mod nearest;
pub mod options;
pub mod progress;
pub mod report;
pub mod rig;
pub mod rotation;
pub mod sample;
mod simd;
pub mod skin;
pub mod slice;
pub mod smooth;
pub mod solve;
pub mod splats;
pub mod stencil;
pub mod team;
pub mod transfer;
pub mod view;
pub mod voxelize;
pub mod weights;
pub mod words;

pub use bind::{BindError, Binding, bind};
pub use cage::{Cage, CageError, CageNotice, FaceDefect, subdivided_box};
pub use controls::{ControlError, ControlSet, Controls, InnerControls, InnerElement};
pub use coordinates::{ClosedFormError, Coordinates};
pub use frames::Frames;
/// Vectors and matrices of the public functions, in the version that the crates use.
pub use glam;
pub use mesh::{Bounds, PolygonMesh, TriMesh};
pub use options::BindOptions;
pub use progress::{Cancellation, Progress, ProgressEvent, Stage};
pub use report::BindReport;
pub use weights::Weights;

/// Compiles the README's example.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
