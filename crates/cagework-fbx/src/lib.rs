//! Converts FBX files to GLB.
//!
//! The library `ufbx` parses the file and converts units and axes. Pivots, pre-rotations, geometry transforms and
//! inherited scales become transforms of nodes, some of them additional nodes. This crate writes what glTF can express,
//! and lists the rest in notices.

mod bind_pose;
mod clip;
mod convert;
mod document;
#[cfg(target_family = "wasm")]
mod libc;
mod limits;
mod material;
mod mesh;
mod node;
mod skin;
#[cfg(target_family = "wasm")]
mod web;

pub use convert::{Converted, convert};
pub use limits::FbxError;
#[cfg(target_family = "wasm")]
pub use web::ConvertedFbx;
