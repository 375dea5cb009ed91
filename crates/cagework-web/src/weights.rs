//! Weights as JavaScript passes them.

use cagework_core::deform::OutsideVertex;
use cagework_core::{Frames, Weights};
use js_sys::{Float32Array, Uint32Array};
use serde::{Deserialize, Serialize};

use crate::error::{Answer, ErrorName, Fault};

/// Frames of a bind, and the points outside the cage.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct Offsets {
    /// Local coordinate frames that carry the part of each position that the weights of the controls do not reproduce.
    /// In the weights, their columns follow the columns of the controls.
    pub(crate) frames: Frames,
    /// Points outside the cage.
    pub(crate) outside: Vec<OutsideVertex>,
}

impl Offsets {
    /// Rebuilds weights and frames from the arrays of a [`BindResult`] for `n_controls` controls.
    ///
    /// # Errors
    /// If the arrays do not match each other or `n_controls`.
    pub(crate) fn bound(
        self,
        n_controls: usize,
        indptr: Vec<u32>,
        indices: Vec<u32>,
        data: Vec<f32>,
    ) -> Answer<(Weights, Frames)> {
        let frames = self.frames;
        if !frames.fits(n_controls) {
            let message =
                format!("offsets has frames of more than {n_controls} controls, or joints without bones");
            return Err(Fault::new(ErrorName::Error, message));
        }
        let n_columns = (n_controls + frames.n_columns()) as u32;
        Ok((Weights::new(n_columns, indptr, indices, data)?, frames))
    }
}

/// Weights as compressed sparse rows. `offsets` describes the columns after the columns of the controls.
#[derive(Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct BoundArrays {
    /// Start of each row. `[n_rows + 1]`
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Uint32Array"))]
    indptr: Uint32Array,
    /// Column of each weight: controls first, then frames. `[n_nonzeros]`
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Uint32Array"))]
    indices: Uint32Array,
    /// Weights that are not 0. `[n_nonzeros]`
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Float32Array"))]
    data: Float32Array,
    offsets: Offsets,
}

impl BoundArrays {
    pub(crate) fn of(weights: &Weights, offsets: Offsets) -> Self {
        Self {
            indptr: Uint32Array::from(weights.indptr()),
            indices: Uint32Array::from(weights.indices()),
            data: Float32Array::from(weights.data()),
            offsets,
        }
    }

    /// Rebuilds weights and frames for `n_controls` controls.
    ///
    /// # Errors
    /// If the arrays do not match each other or `n_controls`.
    pub(crate) fn bound(self, n_controls: usize) -> Answer<(Weights, Frames)> {
        let (indptr, indices, data) = (self.indptr.to_vec(), self.indices.to_vec(), self.data.to_vec());
        self.offsets.bound(n_controls, indptr, indices, data)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_that_name_no_column_are_refused() {
        let bound = |joints: Vec<u32>, column: u32| {
            let plain = vec![[0.0; 4]; 3 * joints.len()];
            let frames = Frames { joints, plain, whole: vec![[0.0; 3]; 3], ..Frames::default() };
            let offsets = Offsets { frames, outside: Vec::new() };
            offsets.bound(3, vec![0, 1], vec![column], vec![1.0])
        };
        // The frames add 9 columns to the 3 columns of the controls: 3 for the coordinate axes, 3 for the motion of the
        // whole cage, and 3 for the joint.
        assert!(bound(vec![2], 11).is_ok());
        assert!(bound(vec![2], 12).is_err(), "a column");
        assert!(bound(vec![3], 2).is_err(), "a joint");
    }
}
