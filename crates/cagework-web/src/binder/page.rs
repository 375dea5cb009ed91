//! Computations that only the page offers: closed forms, slices, repairs, transferred poses and samples.

use cagework_cage::check::repair_smooth;
use cagework_cage::samples::{self, Sample};
use cagework_core::progress::NoProgress;
use cagework_core::slice::Slice;
use cagework_core::{Controls, Coordinates};
use cagework_editor::{PageBindOptions, carry_poses};
use cagework_io::{Model, ModelFormat, write_mesh_glb};
use glam::{DVec3, Vec3};
use js_sys::{Float32Array, Function, Uint8Array};
use serde::Serialize;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::{BindResult, Binder};
use crate::arrays::{flat, points};
use crate::cage::{CageArrays, control_set};
use crate::error::{Answer, ErrorName, Fault};
use crate::opening::PoseArrays;
use crate::options::{READ_LIMIT, decode};
use crate::views::object;
use crate::weights::Offsets;

/// A built-in sample: model, cage and poses.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct BuiltSample {
    /// The model as a GLB file.
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Uint8Array"))]
    glb: Uint8Array,
    /// Vertices of the model. `[n_vertices, 3]`
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Float32Array"))]
    positions: Float32Array,
    cage: CageArrays,
    poses: Vec<PoseArrays>,
    /// Point of the model that the page asks the user to pull first, object units.
    grip: [f32; 3],
}

#[wasm_bindgen]
impl Binder {
    /// Computes closed-form coordinates of the cage, ignoring its inner controls. Arrays as for `bind`.
    ///
    /// # Errors
    /// If the coordinates are undefined at a point, or the arrays are not a valid cage.
    #[wasm_bindgen(js_name = bindByFormula)]
    pub fn bind_by_formula(
        &self,
        #[wasm_bindgen(unchecked_param_type = "Coordinates")] kind: JsValue,
        positions: &[f32],
        #[wasm_bindgen(unchecked_param_type = "CageArrays")] cage: JsValue,
    ) -> Answer<BindResult> {
        let set = control_set(cage)?;
        let kind: Coordinates = decode(kind)?;
        let weights = kind.weights(&points(positions), set.cage(), READ_LIMIT, &NoProgress)?;
        Ok(BindResult { weights, offsets: Offsets::default(), report: None })
    }

    /// Computes the coordinates at the cell centres of a slice, for `Engine.takeSlice`; undefined if no centre is
    /// inside the cage. `axis`: 0 to 2; `fraction`: position along the axis, 0 to 1; other arguments as for `bind`.
    ///
    /// # Errors
    /// The errors of `bind`.
    #[wasm_bindgen(js_name = bindSlice)]
    pub async fn bind_slice(
        &self,
        #[wasm_bindgen(unchecked_param_type = "CageArrays")] cage: JsValue,
        axis: usize,
        fraction: f32,
        #[wasm_bindgen(unchecked_param_type = "BindOptions")] options: JsValue,
        #[wasm_bindgen(unchecked_param_type = "(event: Progress) => boolean")] progress: Function,
    ) -> Answer<Option<BindResult>> {
        let request: PageBindOptions = decode(options)?;
        let set = control_set(cage)?;
        let centers = Slice::new(&set, &request.options, axis.min(2), fraction).centers();
        if centers.is_empty() {
            return Ok(None);
        }
        let binding = match self.run(&centers, &set, request, progress).await {
            // Rounding can put all cell centres of a slice outside the cage if the slice only touches the cage.
            Err(fault) if fault.is(ErrorName::NoneInside) => return Ok(None),
            ran => ran?,
        };
        let n_controls = Controls::from(&set).n_controls() as u32;
        let (weights, offsets) = (binding.weights.columns(0..n_controls), Offsets::default());
        Ok(Some(BindResult { weights, offsets, report: None }))
    }

    /// Transfers poses, `[n_poses, n_old, 3]`, from an old cage to a new one around the same model, see
    /// [`carry_poses`]. Returns `[n_poses, n_new, 3]`.
    ///
    /// # Errors
    /// If the arrays are not a valid cage, or the bind fails.
    #[wasm_bindgen(js_name = carryPoses)]
    pub fn carry_poses(
        model: &[f32],
        new: &[f32],
        #[wasm_bindgen(unchecked_param_type = "CageArrays")] old: JsValue,
        poses: &[f32],
    ) -> Answer<Vec<f32>> {
        let carried = carry_poses(&points(model), &points(new), &control_set(old)?, &points(poses))?;
        Ok(flat(&carried))
    }

    /// Repairs a cage. Arrays as for `checkCage`. The repaired cage has no inner controls.
    ///
    /// # Errors
    /// If the arrays are not a polygon mesh, or the cage cannot be grown until it encloses the model.
    #[wasm_bindgen(js_name = repairCage, unchecked_return_type = "CageArrays")]
    pub fn repair_cage(
        #[wasm_bindgen(unchecked_param_type = "Repair")] kind: JsValue,
        model: &[f32],
        #[wasm_bindgen(unchecked_param_type = "CageArrays")] cage: JsValue,
    ) -> Answer<JsValue> {
        let (mesh, smooth) = decode::<CageArrays>(cage)?.alone()?;
        let repaired = repair_smooth(&mesh, &[decode(kind)?], Some(&points(model)), smooth)?;
        Ok(object(&CageArrays::of(&repaired.mesh)))
    }

    /// Identifiers of the built-in samples, which `buildSample` takes.
    pub fn samples() -> Vec<String> {
        samples::all().iter().map(|sample| sample.id.to_owned()).collect()
    }

    /// Builds the sample capture "knot", whose splats are computed by a formula, as an SPZ file.
    ///
    /// # Errors
    /// If memory is exhausted.
    #[wasm_bindgen(js_name = knotCapture)]
    pub fn knot_capture() -> Answer<Vec<u8>> {
        let model = Model::of_splats("knot", samples::knot(), DVec3::ZERO)?;
        Ok(model.write(ModelFormat::Spz, &model.positions)?)
    }

    /// Builds the sample with this identifier.
    ///
    /// # Errors
    /// If no sample has this identifier.
    #[wasm_bindgen(js_name = buildSample, unchecked_return_type = "BuiltSample")]
    pub fn build_sample(id: &str) -> Answer<JsValue> {
        let unknown = || Fault::new(ErrorName::Error, format!("there is no sample called {id:?}"));
        let Sample { name, mesh, colours, rig, cage, poses, grip, .. } =
            samples::build(id).ok_or_else(unknown)?;
        let glb = write_mesh_glb(&name, &mesh, &colours, rig.as_ref())?;
        let pose =
            |(name, at): (String, Vec<Vec3>)| PoseArrays { name, positions: flat(&at).as_slice().into() };
        Ok(object(&BuiltSample {
            glb: glb.as_slice().into(),
            positions: flat(&mesh.positions).as_slice().into(),
            cage: CageArrays::of(&cage),
            poses: poses.into_iter().map(pose).collect(),
            grip: mesh.positions[grip as usize].to_array(),
        }))
    }
}
