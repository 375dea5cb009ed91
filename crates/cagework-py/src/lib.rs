//! Cagework for Python: the package `cagework`, whose Python half is in `python/cagework`.
//!
//! Functions and a class over core and io. Arrays of NumPy come in, as they are where they hold 32-bit floats in rows, and go
//! out without copies; weights are matrices of scipy.sparse. Work runs without the interpreter's lock and hears Ctrl-C
//! (`work.rs`). What is documented here is what Python's `help` shows. No mathematics.

mod arrays;
mod bind;
mod cage;
mod error;
mod files;
mod options;
mod pull;
mod reshape;
mod work;

use pyo3::pymodule;

/// What Python imports; `cagework/__init__.py` passes it on.
#[pymodule]
#[pyo3(name = "_native")]
mod native {
    #[pymodule_export]
    use crate::bind::{bind, bind_many, deform};
    #[pymodule_export]
    use crate::cage::{Cage, check_cage, generate_cage};
    #[pymodule_export]
    use crate::files::read_model;
    #[pymodule_export]
    use crate::pull::pull;
    #[pymodule_export]
    use crate::reshape::reshape;
    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "Python's name")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
