//! Run-time selection of the instruction set.
//!
//! Kernels are plain loops over rows of lanes. [`dispatch`] runs a closure compiled for the best instruction set of the
//! processor (AVX2 on x86-64, NEON on Arm, simd128 if wasm is built with it), so that binaries built for the baseline
//! instruction set also use wide registers. Results do not depend on the selection, because the kernels add and
//! multiply in a fixed order without fusing.

/// Runs `op` with the widest instruction set of the processor.
#[cfg(not(target_family = "wasm"))]
#[inline(always)]
pub(crate) fn dispatch<R>(op: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(op)
}

/// Runs `op`. wasm cannot detect features at run time: the whole file is built with or without simd128.
#[cfg(target_family = "wasm")]
#[inline(always)]
pub(crate) fn dispatch<R>(op: impl FnOnce() -> R) -> R {
    op()
}
