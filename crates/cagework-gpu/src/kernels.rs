//! The kernel table: every compute shader with what its pipeline needs. `tests/shaders.rs` compares it with the WGSL.

use Binding::{Read, ReadWrite, Uniform};

/// What a binding is. All are in group 0, numbered in the table's order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Binding {
    /// `var<uniform>`: the dispatch's [`crate::layout::Work`], at a dynamic offset.
    Uniform,
    /// `var<storage, read>`.
    Read,
    /// `var<storage, read_write>`.
    ReadWrite,
}

/// One compute shader.
#[derive(Debug)]
pub struct Kernel {
    /// Name of the file, the entry point, and the CPU twin in `cagework_core::stencil`, `parts`, `skin` or `dynamic`.
    pub name: &'static str,
    /// The whole source.
    pub wgsl: &'static str,
    /// Invocations of a workgroup; all are one-dimensional.
    pub workgroup: u32,
    /// Bindings in order.
    pub bindings: &'static [Binding],
    /// Rough number of memory accesses of an invocation: what slices of work are measured in.
    pub cost: u32,
}

/// Declares kernels and the list of them all.
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
    /// Gauss-Seidel on one colour, in place.
    RELAX_CELLS = "relax_cells" + ["work"], 64, 40, &[Uniform, Read, Read, Read, Read, ReadWrite];
    /// The paper's smoothing.
    JACOBI_CELLS = "jacobi_cells" + ["work"], 64, 40, &[Uniform, Read, Read, Read, Read, Read, ReadWrite];
    /// Eq. 2, inner sum.
    CHANGE_NORMS = "change_norms" + ["work"], 64, 64, &[Uniform, Read, Read, ReadWrite];
    /// Residual of the red rows.
    RESIDUAL = "residual" + ["work"], 64, 44, &[Uniform, Read, Read, Read, Read, Read, ReadWrite];
    /// Residual to the coarse right-hand side.
    RESTRICT_RESIDUAL = "restrict_residual" + ["work"], 64, 69, &[Uniform, Read, Read, ReadWrite];
    /// Coarse correction to the fine level.
    PROLONG_CORRECTION = "prolong_correction" + ["work"], 64, 24, &[Uniform, Read, Read, ReadWrite];
    /// Partial sums of squares of a field.
    SUM_SQUARES = "sum_squares" + ["work", "reduce"], 256, 0, &[Uniform, Read, ReadWrite];
    /// Partial sums of roots: Eq. 2, outer sum.
    SUM_ROOTS = "sum_roots" + ["work", "reduce"], 256, 0, &[Uniform, Read, ReadWrite];
    /// Sum of partial sums.
    REDUCE_SUM = "reduce_sum" + ["work", "reduce"], 256, 0, &[Uniform, Read, ReadWrite];
    /// Weights at the mesh's vertices.
    SAMPLE_WEIGHTS = "sample_weights" + ["work"], 64, 70, &[Uniform, Read, Read, Read, Read, ReadWrite];
    /// Deformed positions.
    DEFORM_VERTICES = "deform_vertices" + ["work"], 64, 900, &[Uniform, Read, Read, Read, Read, ReadWrite];
    /// Parts that the cage does not bend.
    HOLD_PARTS = "hold_parts" + ["work"], 64, 16, &[Uniform, Read, Read, Read, ReadWrite];
    /// Positions of a clip.
    SKIN_VERTICES = "skin_vertices" + ["work"], 64, 60, &[Uniform, Read, Read, Read, Read, Read, Read, ReadWrite];
    /// Positions of a clip, bent by the cage.
    BEND_VERTICES = "bend_vertices" + ["work"], 64, 12, &[Uniform, Read, ReadWrite];
    /// Normals of the deformed mesh.
    VERTEX_NORMALS = "vertex_normals" + ["work"], 64, 50, &[Uniform, Read, Read, Read, ReadWrite];
}
