//! The interface of the wasm file to JavaScript.

use wasm_bindgen::prelude::*;

use crate::convert::{Converted, convert};

/// A converted file, for JavaScript.
#[wasm_bindgen]
#[derive(Debug)]
pub struct ConvertedFbx {
    glb: Vec<u8>,
    notices: Vec<String>,
}

#[wasm_bindgen]
impl ConvertedFbx {
    /// Converts an FBX file, using at most `memory_limit` bytes.
    ///
    /// # Errors
    /// The message says what is wrong in the file.
    #[wasm_bindgen(constructor)]
    pub fn new(fbx: &[u8], memory_limit: f64) -> Result<Self, JsError> {
        let Converted { glb, notices } = convert(fbx, memory_limit as u64)?;
        Ok(Self { glb, notices })
    }

    /// Takes the GLB out.
    #[wasm_bindgen(js_name = takeGlb)]
    pub fn take_glb(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.glb)
    }

    /// What was not converted, one sentence each.
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn notices(&self) -> Vec<String> {
        self.notices.clone()
    }
}
