//! Positions of bound points in a pose, for the npm package.

use cagework_core::deform::deform_finite;
use cagework_core::{Frames, Weights};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::arrays::{flat, pose};
use crate::error::{Answer, ErrorName, Fault};
use crate::options::decode;
use crate::weights::BoundArrays;

/// Weights for deforming points by many poses.
#[wasm_bindgen]
pub struct Deformer {
    n_controls: usize,
    weights: Weights,
    frames: Frames,
}

#[wasm_bindgen]
impl Deformer {
    /// Creates a deformer from weights for `n_controls` controls.
    ///
    /// # Errors
    /// If the arrays do not match each other or `n_controls`.
    #[wasm_bindgen(constructor)]
    pub fn new(
        n_controls: u32,
        #[wasm_bindgen(unchecked_param_type = "BoundArrays")] rows: JsValue,
    ) -> Answer<Self> {
        let n_controls = n_controls as usize;
        let (weights, frames) = decode::<BoundArrays>(rows)?.bound(n_controls)?;
        Ok(Self { n_controls, weights, frames })
    }

    /// Computes the positions of the points, `[n_points, 3]`, in a pose of the controls, `[n_controls, 3]`.
    ///
    /// # Errors
    /// If the pose does not have `n_controls` points, or moves a point beyond the range of 32-bit floats.
    pub fn deform(&self, posed: &[f32]) -> Answer<Vec<f32>> {
        let posed = pose(posed, self.n_controls)?;
        let points = deform_finite(&self.weights, &self.frames, &posed);
        Ok(flat(&points.map_err(|e| Fault::new(ErrorName::Error, e))?))
    }
}
