//! Run-time choice of the instruction set.
//!
//! The kernels are plain loops over rows of lanes. [`dispatch`] runs a closure compiled for the best instruction set
//! that this processor has (AVX2 on x86-64, NEON on Arm, and simd128 where wasm is built with it), so that a binary
//! built for the baseline still fills the registers. Results do not depend on the choice: only additions and
//! multiplications in a fixed order, never fused.

/// Runs `op` with the widest instruction set this processor has.
#[cfg(not(target_family = "wasm"))]
#[inline(always)]
pub(crate) fn dispatch<R>(op: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(op)
}

/// Runs `op`. A wasm file cannot ask: it is built for simd128 or not, and a second copy of each kernel would be
/// downloaded in vain.
#[cfg(target_family = "wasm")]
#[inline(always)]
pub(crate) fn dispatch<R>(op: impl FnOnce() -> R) -> R {
    op()
}
