//! The native module of the Python package `cagework`. Its Python code is in `python/cagework`.
//!
//! Wraps core, cage, pose and io. Arrays are exchanged with NumPy without copies where possible; weights are
//! scipy.sparse matrices. Long work releases the interpreter lock, and Ctrl-C cancels it (`work.rs`). Python's `help`
//! shows the doc comments of functions and classes.

mod arrays;
mod bind;
mod cage;
mod error;
mod field;
mod files;
mod options;
mod proportions;
mod pull;
mod reshape;
mod splats;
mod transfer;
mod work;

use pyo3::pymodule;

/// The module `cagework._native`; `cagework/__init__.py` re-exports its contents.
#[pymodule]
#[pyo3(name = "_native")]
mod native {
    #[pymodule_export]
    use crate::bind::{bind, bind_many, deform};
    #[pymodule_export]
    use crate::cage::{Cage, check_cage, generate_cage, restored_cage};
    #[pymodule_export]
    use crate::field::Field;
    #[pymodule_export]
    use crate::files::{read_model, to_glb};
    #[pymodule_export]
    use crate::options::defaults;
    #[pymodule_export]
    use crate::proportions::{humanoid_bones, proportions};
    #[pymodule_export]
    use crate::pull::{Drag, Puller, pull};
    #[pymodule_export]
    use crate::reshape::reshape;
    #[pymodule_export]
    use crate::splats::{Splats, restored_splats};
    #[pymodule_export]
    use crate::transfer::transfer;
    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "this is the conventional name in Python")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
