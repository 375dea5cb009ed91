//! Rust mirrors of shader structs. `tests/shaders.rs` compares names, offsets and sizes.

use bytemuck::{Pod, Zeroable};

/// Parameters of a dispatch. Mirrors `Work` in `shaders/work.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Work {
    /// First item.
    pub first: u32,
    /// Number of items.
    pub count: u32,
    /// Invocations per row of workgroups; further rows are along y.
    pub stride: u32,
    /// Quads per row of a field: columns of the batch / 4.
    pub n_quads: u32,
    /// Offset of items: first row of a field, or first slot of a result.
    pub first_row: u32,
    /// First quad of the batch.
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
    /// `change_norms`: absolute values instead of squares.
    pub const CHANGE_ABSOLUTE: u32 = 1;
    /// `change_norms`: overwrite instead of add.
    pub const CHANGE_FIRST: u32 = 2;
    /// `prolong_correction`: overwrite by the mean.
    pub const PROLONG_REPLACE: u32 = 1;
}
