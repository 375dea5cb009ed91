//! Tests of reading and writing files. They are one program, because each further program compiles the same generic code
//! again.

#![allow(clippy::unwrap_used, reason = "helpers of tests, outside the test functions")]

#[path = "../common/mod.rs"]
mod common;

mod compressed;
mod far;
mod fbx;
mod glb_export;
mod gltf_bad;
mod gltf_read;
mod look;
mod npz;
mod obj;
mod off;
mod packed_splats;
mod polygons;
mod project;
mod rigs;
mod select;
mod siblings;
mod splats;
mod stored;
mod threemf;
mod transfer;
