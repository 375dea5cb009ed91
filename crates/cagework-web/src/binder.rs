//! The worker's entry points: computations that take longer than a frame.
//!
//! The worker has its own GPU device. Its methods take and return arrays; the page passes the results to `Engine`.

#[cfg(feature = "full")]
pub(crate) mod page;
mod results;

use std::cell::RefCell;

use cagework_cage::check::check_smooth;
use cagework_cage::{CageOptions, GeneratedCage, generate_with_skeleton};
use cagework_core::field::{self, Lattice};
use cagework_core::options::OutsidePolicy;
use cagework_core::{BindOptions, Binding, ControlSet, Controls};
use cagework_editor::PageBindOptions;
#[cfg(feature = "full")]
use cagework_gpu::{ContextOptions, GpuContext, bind_on};
use glam::Vec3;
use js_sys::{Float32Array, Function};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::arrays::{flat, points};
use crate::cage::{CageArrays, RigArrays, control_set};
use crate::clock::Listener;
use crate::error::{Answer, ErrorName, Fault};
use crate::options::decode;
#[cfg(feature = "full")]
use crate::options::is_on_cpu;
use crate::views::object;
use crate::weights::Offsets;

pub use results::BindResult;

/// Binds models and slices, generates, checks and repairs cages, and builds samples.
#[wasm_bindgen]
pub struct Binder {
    /// The GPU of the last bind on a GPU.
    #[cfg(feature = "full")]
    gpu: RefCell<Option<GpuContext>>,
}

#[wasm_bindgen]
impl Binder {
    /// Creates a binder. The first bind on a GPU opens the GPU.
    #[wasm_bindgen(constructor)]
    #[allow(clippy::new_without_default, reason = "constructed by JavaScript only")]
    pub fn new() -> Self {
        Self {
            #[cfg(feature = "full")]
            gpu: RefCell::default(),
        }
    }

    /// Computes the harmonic coordinates of `positions`, `[n_points, 3]`. The last `extra_points` points are not
    /// vertices of the model.
    ///
    /// `progress` is called with each progress event; returning false cancels the bind.
    ///
    /// # Errors
    /// If the arrays are not a valid cage, or the bind fails. `NoAdapter` or `NoDevice` if the options select the GPU
    /// and no GPU can be opened.
    pub async fn bind(
        &self,
        positions: Vec<f32>,
        extra_points: usize,
        #[wasm_bindgen(unchecked_param_type = "CageArrays")] cage: JsValue,
        #[wasm_bindgen(unchecked_param_type = "BindOptions")] options: JsValue,
        #[wasm_bindgen(unchecked_param_type = "(event: Progress) => boolean")] progress: Function,
    ) -> Answer<BindResult> {
        let mut request: PageBindOptions = decode(options)?;
        request.options.extra_points = extra_points;
        let set = control_set(cage)?;
        let at = points(&positions);
        drop(positions);
        let binding = self.run(&at, &set, request, progress).await?;
        let Binding { weights, frames, outside, report, .. } = binding;
        Ok(BindResult { weights, offsets: Offsets { frames, outside }, report: Some(report) })
    }

    /// Computes the harmonic coordinates at the points of a lattice around a cage. With `cells`, the number of cells
    /// along the longest side of the cage, the result is for `FieldMap`, otherwise for `Engine.takeLattice`. Other
    /// arguments as for `bind`.
    ///
    /// # Errors
    /// The errors of `bind`.
    #[wasm_bindgen(js_name = bindLattice)]
    pub async fn bind_lattice(
        &self,
        #[wasm_bindgen(unchecked_param_type = "CageArrays")] cage: JsValue,
        cells: Option<u32>,
        #[wasm_bindgen(unchecked_param_type = "BindOptions")] options: JsValue,
        #[wasm_bindgen(unchecked_param_type = "(event: Progress) => boolean")] progress: Function,
    ) -> Answer<BindResult> {
        let mut request: PageBindOptions = decode(options)?;
        request.options.outside = OutsidePolicy::Extend;
        let cells = cells.unwrap_or(field::CLIP_CELLS);
        field::CELLS_RANGE.check(cells).map_err(|wrong| Fault::new(ErrorName::Error, wrong))?;
        let set = control_set(cage)?;
        let lattice = Lattice::new(Controls::from(&set).surface(), cells);
        let binding = self.run(&lattice.points(), &set, request, progress).await?;
        let offsets = Offsets { frames: binding.frames, outside: Vec::new() };
        Ok(BindResult { weights: binding.weights, offsets, report: None })
    }

    /// Generates a cage whose surface after `smooth` subdivision steps encloses the model. `rig`: the model's joints
    /// (`RigArrays`), or undefined. `progress` as for `bind`. `show`: called with the segments of the model's skeleton,
    /// `[n_segments, 2, 3]`, before the cage is made along it.
    ///
    /// # Errors
    /// If the model has no triangles or an option is out of range.
    #[wasm_bindgen(js_name = generateCage, unchecked_return_type = "CageArrays")]
    pub fn generate_cage(
        positions: &[f32],
        triangles: &[u32],
        #[wasm_bindgen(unchecked_param_type = "RigArrays | undefined")] rig: JsValue,
        #[wasm_bindgen(unchecked_param_type = "CageOptions")] options: JsValue,
        smooth: u32,
        #[wasm_bindgen(unchecked_param_type = "(event: Progress) => boolean")] progress: Function,
        #[wasm_bindgen(unchecked_param_type = "(segments: Float32Array) => void")] show: &Function,
    ) -> Answer<JsValue> {
        let options = CageOptions { smooth, ..decode(options)? };
        let triangles: Vec<[u32; 3]> = triangles.as_chunks().0.to_vec();
        let listener = Listener::new(progress);
        let rig: Option<RigArrays> = decode(rig)?;
        let rig = rig.map(RigArrays::rig);
        let GeneratedCage { cage, report, rings } = generate_with_skeleton(
            &points(positions),
            &triangles,
            rig.as_ref(),
            &options,
            &listener,
            &|skeleton| {
                let segments = Float32Array::from(flat(skeleton.segments().as_flattened()).as_slice());
                // The skeleton is only shown: an exception of the callback does not concern the cage.
                show.call1(&JsValue::NULL, &segments).ok();
            },
        )?;
        let bridged = if report.separate > report.parts { report.separate } else { 0 };
        let arrays = CageArrays::of(&cage.to_polygon_mesh());
        let (kind, refusal) = (Some(report.kind), report.refusal);
        Ok(object(&CageArrays { bridged, notices: report.notices, kind, refusal, rings, ..arrays }))
    }

    /// Finds the faults of a cage around a model with vertices `model`, `[n_vertices, 3]`, for the default grid of a bind.
    ///
    /// # Errors
    /// If the arrays are not a polygon mesh.
    #[wasm_bindgen(js_name = checkCage, unchecked_return_type = "Problem[]")]
    pub fn check_cage(
        model: &[f32],
        #[wasm_bindgen(unchecked_param_type = "CageArrays")] cage: JsValue,
    ) -> Answer<JsValue> {
        let (mesh, smooth) = decode::<CageArrays>(cage)?.alone()?;
        let grid = BindOptions::default().grid;
        Ok(object(&check_smooth(&mesh, Some(&points(model)), Some(grid), smooth).problems))
    }
}

impl Binder {
    /// Returns a working GPU: the GPU of the last bind, or a new one.
    #[cfg(feature = "full")]
    async fn open(&self) -> Answer<GpuContext> {
        let last = self.gpu.borrow().clone();
        if let Some(gpu) = last.filter(|gpu| gpu.check().is_ok()) {
            return Ok(gpu);
        }
        let gpu = GpuContext::new(&ContextOptions::default()).await?;
        self.gpu.replace(Some(gpu.clone()));
        Ok(gpu)
    }

    pub(crate) async fn run(
        &self,
        positions: &[Vec3],
        set: &ControlSet,
        request: PageBindOptions,
        progress: Function,
    ) -> Answer<Binding> {
        let listener = Listener::new(progress);
        #[cfg(feature = "full")]
        if !is_on_cpu(&request) {
            return Ok(bind_on(positions, set, &request.options, &listener, &self.open().await?).await?);
        }
        Ok(cagework_core::bind(positions, set, &request.options, &listener)?)
    }
}
