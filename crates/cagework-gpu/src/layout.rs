//! Mirrors of the shaders' structs. `tests/shaders.rs` compares names, offsets and sizes.

use bytemuck::{Pod, Zeroable};

/// One dispatch; see `shaders/work.wgsl`, whose `Work` it mirrors.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Work {
    /// First item.
    pub first: u32,
    /// Number of items.
    pub count: u32,
    /// Invocations in one row of workgroups; further ones lie along y.
    pub stride: u32,
    /// Quads in a row of a field: columns of the batch over four.
    pub n_quads: u32,
    /// First row of a field, or first slot of a result, that items count from.
    pub first_row: u32,
    /// First quad of the batch among all columns.
    pub first_quad: u32,
    /// A kernel's variants, see [`mode`].
    pub mode: u32,
    /// Coarse rows that a fine row is interpolated from.
    pub n_sources: u32,
    /// Over-relaxation; 1 goes to the Gauss-Seidel value. Dimensionless.
    pub omega: f32,
}

/// Values of [`Work::mode`], the shaders' constants of the same names.
pub mod mode {
    /// `change_norms`: absolute values instead of squares.
    pub const CHANGE_ABSOLUTE: u32 = 1;
    /// `change_norms`: replace what is there.
    pub const CHANGE_FIRST: u32 = 2;
    /// `prolong_correction`: replace by the mean.
    pub const PROLONG_REPLACE: u32 = 1;
}
