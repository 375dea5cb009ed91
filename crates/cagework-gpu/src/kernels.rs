//! Table of the compute shaders, each with its bindings and workgroup size. `tests/shaders.rs` compares it with the
//! WGSL files.

use BindingType::{Read, ReadWrite, Uniform};

/// Type of a binding. The bindings of a kernel are in group 0, numbered in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindingType {
    /// `var<uniform>`: the dispatch's [`crate::layout::Work`] at a dynamic offset.
    Uniform,
    /// `var<storage, read>`.
    Read,
    /// `var<storage, read_write>`.
    ReadWrite,
}

/// A compute shader.
#[derive(Debug)]
pub struct Kernel {
    /// Name of the file and the entry point. The file names the CPU implementation.
    pub name: &'static str,
    /// Complete source of the shader in WGSL.
    pub wgsl: &'static str,
    /// Number of invocations per workgroup. All kernels are one-dimensional.
    pub workgroup: u32,
    /// Bindings, in order.
    pub bindings: &'static [BindingType],
    /// Approximate memory accesses per invocation, for sizing slices of work.
    pub cost: u32,
}

/// Declares kernels and the list `ALL`.
macro_rules! kernels {
    ($($(#[$doc:meta])* $id:ident = $name:literal + [$($shared:literal),+], $workgroup:literal, $cost:literal, $bindings:expr;)+) => {
        $(
            $(#[$doc])*
            pub const $id: Kernel = Kernel {
                name: $name,
                wgsl: concat!(
                    $(include_str!(concat!("../shaders/", $shared, ".wgsl")),)+
                    include_str!(concat!("../shaders/", $name, ".wgsl"))
                ),
                workgroup: $workgroup,
                bindings: $bindings,
                cost: $cost,
            };
        )+
        /// All kernels.
        pub const ALL: &[&Kernel] = &[$(&$id),+];
    };
}

kernels! {
    /// Gauss-Seidel sweep over the rows of one colour, in place.
    RELAX_CELLS = "relax_cells" + ["work"], 64, 40, &[Uniform, Read, Read, Read, Read, ReadWrite];
    /// Jacobi sweep: the smoothing step of K. Smith's paper (`docs/method.md`, sources).
    JACOBI_CELLS = "jacobi_cells" + ["work"], 64, 40, &[Uniform, Read, Read, Read, Read, Read, ReadWrite];
    /// Sums the changes of each cell over columns: the inner sum of the paper's Eq. 2.
    CHANGE_NORMS = "change_norms" + ["work"], 64, 64, &[Uniform, Read, Read, ReadWrite];
    /// Computes the residual of the red rows, the first colour of the red-black ordering.
    RESIDUAL = "residual" + ["work"], 64, 44, &[Uniform, Read, Read, Read, Read, Read, ReadWrite];
    /// Restricts the residual to the coarse right-hand side.
    RESTRICT_RESIDUAL = "restrict_residual" + ["work"], 64, 69, &[Uniform, Read, Read, ReadWrite];
    /// Prolongs the coarse correction.
    PROLONG_CORRECTION = "prolong_correction" + ["work"], 64, 24, &[Uniform, Read, Read, ReadWrite];
    /// Computes partial sums of squares.
    SUM_SQUARES = "sum_squares" + ["work", "reduce"], 256, 0, &[Uniform, Read, ReadWrite];
    /// Computes partial sums of square roots, for the outer sum of the paper's Eq. 2.
    SUM_ROOTS = "sum_roots" + ["work", "reduce"], 256, 0, &[Uniform, Read, ReadWrite];
    /// Adds up partial sums.
    REDUCE_SUM = "reduce_sum" + ["work", "reduce"], 256, 0, &[Uniform, Read, ReadWrite];
    /// Samples weights at mesh vertices.
    SAMPLE_WEIGHTS = "sample_weights" + ["work"], 64, 70, &[Uniform, Read, Read, Read, Read, ReadWrite];
    /// Computes deformed positions.
    DEFORM_VERTICES = "deform_vertices" + ["work"], 64, 900, &[Uniform, Read, Read, Read, Read, ReadWrite];
    /// Replaces the deformed positions of fixed vertices and rigid pieces.
    HOLD_PARTS = "hold_parts" + ["work"], 64, 16, &[Uniform, Read, Read, Read, ReadWrite];
    /// Computes skinned positions.
    SKIN_VERTICES = "skin_vertices" + ["work"], 64, 60, &[Uniform, Read, Read, Read, Read, Read, Read, ReadWrite];
    /// Adds the cage's displacement field to skinned positions.
    BEND_VERTICES = "bend_vertices" + ["work", "field"], 64, 12, &[Uniform, Read, ReadWrite];
    /// Deforms splats.
    DEFORM_SPLATS = "deform_splats" + ["work", "field"], 64, 80, &[Uniform, Read, Read, ReadWrite];
    /// Counts the splats of each block by the value of a digit of their depth.
    COUNT_SPLATS = "count_splats" + ["work", "depths"], 64, 8192, &[Uniform, Read, Read, Read, ReadWrite];
    /// Computes where the splats of each block and bin start in the sorted order.
    SCAN_SPLATS = "scan_splats" + ["work", "depths"], 128, 8192, &[Uniform, Read, ReadWrite];
    /// Writes splats in the order of their bins, with their colours as seen by the eye.
    SCATTER_SPLATS = "scatter_splats" + ["work", "depths", "harmonics"], 64, 8192, &[Uniform, Read, Read, Read, Read, ReadWrite, Read, ReadWrite];
    /// Computes normals of the deformed mesh.
    VERTEX_NORMALS = "vertex_normals" + ["work"], 64, 50, &[Uniform, Read, Read, Read, ReadWrite];
}
