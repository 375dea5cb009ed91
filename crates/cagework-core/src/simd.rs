//! Run-time choice of the instruction set.
//!
//! The kernels are plain loops over rows of lanes. [`dispatch`] runs a closure compiled for the best instruction set
//! that this processor has (AVX2 on x86-64, NEON on Arm, and simd128 where wasm is built with it), so that a binary
//! built for the baseline still fills the registers. Results do not depend on the choice: only additions and
//! multiplications in a fixed order, never fused.

use pulp::Arch;

/// Runs `op` with the widest instruction set this processor has.
#[inline(always)]
pub(crate) fn dispatch<R>(op: impl FnOnce() -> R) -> R {
    Arch::new().dispatch(op)
}
