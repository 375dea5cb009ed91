//! Smooth cages and controls inside: how they are changed.

use cagework_core::edit::{SelectMode, pick_middle};
use cagework_core::{ControlError, InnerControls};
use cagework_io::read_inner_controls;
use glam::Vec3;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::arrays::points;
use crate::controls::{CageControls, InnerKind, MadeCage};
use crate::error::Fault;
use crate::models::Models;
use crate::options::READ_LIMIT;
use crate::options::taken;
use crate::views::object;

/// Sizes that are tried for a sheet, each four fifths of the one before.
const SHEETS: i32 = 16;

#[wasm_bindgen]
impl Engine {
    /// Smooth surface and controls inside, as `setCage` takes them.
    ///
    /// # Errors
    /// Never.
    #[wasm_bindgen(js_name = cageControls, unchecked_return_type = "CageControls")]
    pub fn cage_controls(&self) -> Result<JsValue, JsValue> {
        Ok(self.read(|state| object(&state.made.controls))?)
    }

    /// Subdivides the cage so often before values are prescribed on its surface, 0 to 3. It has to be bound again.
    ///
    /// # Errors
    /// When that is no surface, or a control would be outside of it; nothing changes then.
    #[wasm_bindgen(js_name = setSmooth, unchecked_return_type = "CageState")]
    pub fn set_smooth(&self, steps: u32) -> Result<JsValue, JsValue> {
        self.put_controls(|now| CageControls { smooth: steps, ..now })
    }

    /// Radius of points and lines inside, object units; undefined for a share of the cage. It has to be bound again.
    ///
    /// # Errors
    /// When it is out of range, or two controls would overlap; nothing changes then.
    #[wasm_bindgen(js_name = setRadius, unchecked_return_type = "CageState")]
    pub fn set_radius(&self, radius: Option<f32>) -> Result<JsValue, JsValue> {
        self.put_controls(|now| CageControls { radius, ..now })
    }

    /// Adds a control inside: a point, a line through places, or a face between them; `[n, 3]`. It is selected afterwards, and
    /// the cage has to be bound again.
    ///
    /// # Errors
    /// When it does not fit; nothing changes then.
    #[wasm_bindgen(js_name = addControl, unchecked_return_type = "CageState")]
    pub fn add_control(
        &self,
        #[wasm_bindgen(unchecked_param_type = "InnerKind")] kind: JsValue,
        places: &[f32],
    ) -> Result<JsValue, JsValue> {
        let kind: InnerKind = taken(kind)?;
        if self.read(|state| state.set().is_none()) {
            return Err(Fault::missing("cage", "make or open one first").into());
        }
        let made = self.read(|state| state.made.with(kind, &points(places)))?;
        self.put_added(made)
    }

    /// Controls inside from an OBJ file, in the axes of the model's, in place of those there are.
    ///
    /// # Errors
    /// When the file cannot be read, or what is in it does not fit; nothing changes then.
    #[wasm_bindgen(js_name = readControls, unchecked_return_type = "CageState")]
    pub fn read_controls(&self, bytes: &[u8]) -> Result<JsValue, JsValue> {
        let InnerControls { positions, elements, .. } =
            read_inner_controls(bytes, self.read(|state| state.models.origin()), READ_LIMIT)
                .map_err(Fault::from)?;
        if elements.is_empty() {
            return Err(Fault::from(ControlError::Empty).into());
        }
        let made = self.read(|state| {
            let mut mesh = state.rest().clone();
            mesh.positions.truncate(state.made.n_cage());
            mesh.positions.extend(state.up().turned(&positions).iter());
            let controls = CageControls { inner: positions.len(), elements, ..state.made.controls };
            MadeCage::new(mesh, controls)
        })?;
        Ok(self.put_made(made)?)
    }

    /// The middle of the model under the pointer, at rest: where a control would be put. `[3]`
    #[wasm_bindgen(js_name = middleAt)]
    #[must_use]
    pub fn middle_at(&self, x: f32, y: f32) -> Vec<f32> {
        let middle = self.read(|state| {
            let center = state.bounds().map_or(Vec3::ZERO, |b| b.center());
            let Models { positions, triangles, .. } = &state.models;
            pick_middle(positions, triangles, &state.camera, state.pointer(x, y), center)
        });
        middle.to_array().to_vec()
    }

    /// Adds a sheet around a place, in the plane that faces the eye, as large as fits. As `addControl`.
    ///
    /// # Errors
    /// When the smallest does not fit either.
    #[wasm_bindgen(js_name = addSheet, unchecked_return_type = "CageState")]
    pub fn add_sheet(&self, center: &[f32]) -> Result<JsValue, JsValue> {
        let half = self.read(|state| {
            let (right, up) = (state.camera.right(), state.camera.up());
            let half = 0.5 * state.bounds().map_or(Vec3::ZERO, |b| b.extent());
            [right * right.abs().dot(half), up * up.abs().dot(half)]
        });
        let center = points(center).first().copied().unwrap_or_default();
        let corners = |size: f32| {
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(x, y)| center + size * (x * half[0] + y * half[1]))
        };
        let made = self.read(|state| {
            let mut sizes = (1..=SHEETS).map(|k| 0.8_f32.powi(k));
            let first_that_fits =
                sizes.find_map(|size| state.made.with(InnerKind::Face, &corners(size)).ok());
            first_that_fits
                .map_or_else(|| state.made.with(InnerKind::Face, &corners(0.8_f32.powi(SHEETS))), Ok)
        })?;
        self.put_added(made)
    }

    /// Shows places of a control that is being put in.
    #[wasm_bindgen(js_name = showPlaced)]
    pub fn show_placed(&self, places: &[f32]) {
        self.change(|state| {
            state.held.placed = points(places);
            state.is_changed = true;
        });
    }
}

impl Engine {
    /// The same cage with one more element, which is selected.
    fn put_added(&self, made: MadeCage) -> Result<JsValue, JsValue> {
        let first = made.n_cage() as u32;
        let corners: Vec<u32> = made
            .controls
            .elements
            .last()
            .map(|element| element.corners().iter().map(|&i| first + i).collect())
            .unwrap_or_default();
        let shown = self.put_made(made)?;
        self.change(|state| {
            state.selection.change(&corners, SelectMode::Replace);
            state.is_changed = true;
        });
        Ok(shown)
    }

    /// The same cage with other controls; the pose stays.
    fn put_controls(&self, change: impl FnOnce(CageControls) -> CageControls) -> Result<JsValue, JsValue> {
        let made =
            self.read(|state| MadeCage::new(state.rest().clone(), change(state.made.controls.clone())))?;
        let positions = self.read(|state| state.positions.clone());
        let shown = self.put_made(made)?;
        self.change(|state| state.move_to(positions));
        Ok(shown)
    }
}
