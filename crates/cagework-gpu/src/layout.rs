//! Rust mirrors of shader structs. `tests/shaders.rs` compares names, offsets and sizes.

use bytemuck::{Pod, Zeroable};

/// Stride of dispatch parameters, bytes: WebGPU's baseline alignment of dynamic offsets.
pub(crate) const WORK_STRIDE: u64 = 256;

/// Parameters of a dispatch. Mirrors `Work` in `shaders/work.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Work {
    /// Index of the first item of the dispatch.
    pub first: u32,
    /// Number of items of the dispatch.
    pub count: u32,
    /// Number of invocations per row of workgroups; further rows are along y.
    pub stride: u32,
    /// Number of quads per row of a field: the number of the batch's columns / 4.
    pub n_quads: u32,
    /// Row of the field, or slot of the result, that belongs to item 0.
    pub first_row: u32,
    /// Number of quads in all batches before the current one. A quad is four columns.
    pub first_quad: u32,
    /// Variant of a kernel, see [`mode`].
    pub mode: u32,
    /// Number of coarse rows that a fine row is interpolated from.
    pub n_sources: u32,
    /// Over-relaxation factor; 1 is Gauss-Seidel. Dimensionless.
    pub omega: f32,
}

/// Values of [`Work::mode`]. The shaders define constants with the same names.
pub mod mode {
    /// Mode of `change_norms`: overwrite sums instead of adding to them.
    pub const CHANGE_FIRST: u32 = 1;
    /// Mode of `prolong_correction`: overwrite values by the mean of their coarse neighbours.
    pub const PROLONG_REPLACE: u32 = 1;
    /// Mode of `deform_splats`: also compute rotations.
    pub const ROTATIONS: u32 = 1;
    /// Mode of `count_splats` and `scatter_splats`: sort by the lower digit of the depth.
    pub const LOWER_DIGIT: u32 = 0;
    /// Mode of `count_splats` and `scatter_splats`: sort by the higher digit, after the sort by the lower digit.
    pub const HIGHER_DIGIT: u32 = 1;
}
