//! Runs the command as a user does, and checks output files, messages and exit codes.

#![expect(clippy::unwrap_used, reason = "helpers of tests: a panic is a failed test")]

mod bad_input;
mod bind;
mod cage_and_info;
mod cages;
mod clips;
mod controls;
mod deform;
mod demo;
mod documents;
mod doors;
mod fbx;
mod field;
mod fit;
#[cfg(unix)]
mod outputs;
mod proportions;
mod pull;
mod refit;
mod render;
mod rigs;
mod siblings;
mod splats;
mod streams;
mod support;
mod transfer;
mod usage;
