//! The worker's entry points: computations that take longer than a frame.
//!
//! The worker has its own GPU device. Its methods take and return arrays; the page passes the results to `Engine`.

mod results;

use std::cell::RefCell;

use cagework_cage::check::repair_smooth;
use cagework_cage::generate::{CageOptions, GeneratedCage, generate};
use cagework_cage::samples;
use cagework_core::deform::deform_bound;
use cagework_core::field::{self, Lattice};
use cagework_core::options::OutsidePolicy;
use cagework_core::progress::NoProgress;
use cagework_core::slice::Slice;
use cagework_core::{BindOptions, Binding, ControlSet, Controls, Coordinates, PolygonMesh};
use cagework_editor::CageControls;
use cagework_gpu::{ContextOptions, GpuContext, bind_on};
use cagework_io::{Model, ModelFormat};
use glam::{DVec3, Vec3};
use js_sys::Function;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::arrays::{flat, points, polygon_mesh};
use crate::clock::Listener;
use crate::controls::{control_set, from_js};
use crate::error::{Answer, ErrorName, Fault};
use crate::options::{JsBindOptions, READ_LIMIT, decode};
use crate::problems::{self, Check};
use crate::views::object;

pub(crate) use results::Offsets;
pub use results::{BindResult, BuiltSample, Polygons};

/// Number of model vertices that [`Binder::carry_poses`] binds along with the new cage's controls. The controls may all
/// be outside the old cage, and a bind without a point inside the cage fails.
const MODEL_SAMPLES: usize = 256;

/// Binds models and slices, generates, checks and repairs cages, and builds samples.
#[wasm_bindgen]
pub struct Binder {
    /// The GPU of the last bind on a GPU.
    gpu: RefCell<Option<GpuContext>>,
}

#[wasm_bindgen]
impl Binder {
    /// Creates a binder. The first bind on a GPU opens the GPU.
    #[wasm_bindgen(constructor)]
    #[allow(clippy::new_without_default, reason = "constructed by JavaScript only")]
    pub fn new() -> Self {
        Self { gpu: RefCell::default() }
    }

    /// Computes the harmonic coordinates of `positions`, `[n_points, 3]`. The last `extra_points` points are not
    /// vertices of the model.
    ///
    /// `cage`: `[n_controls, 3]`. `corners`: for each face its corner count, then its vertex indices. `controls`: as
    /// for `Engine.setCage`. `progress` is called with each progress event; returning false cancels the bind.
    ///
    /// # Errors
    /// If the arrays are not a valid cage, or the bind fails. `NoAdapter` or `NoDevice` if the options select the GPU
    /// and no GPU can be opened.
    #[allow(clippy::too_many_arguments, reason = "JavaScript passes arrays as separate arguments")]
    pub async fn bind(
        &self,
        positions: Vec<f32>,
        extra_points: usize,
        cage: Vec<f32>,
        corners: Vec<u32>,
        #[wasm_bindgen(unchecked_param_type = "CageControls | undefined")] controls: JsValue,
        #[wasm_bindgen(unchecked_param_type = "BindOptions")] options: JsValue,
        #[wasm_bindgen(unchecked_param_type = "(event: Progress) => boolean")] progress: Function,
    ) -> Result<BindResult, JsValue> {
        let mut request: JsBindOptions = decode(options)?;
        request.options.extra_points = extra_points;
        let set = control_set(&cage, &corners, controls)?;
        let at = points(&positions);
        drop(positions);
        let binding = self.run(&at, &set, request, progress).await?;
        let report = object(&binding.report);
        Ok(BindResult {
            weights: binding.weights,
            offsets: Offsets { frames: binding.frames, outside: binding.outside },
            report,
        })
    }

    /// Computes closed-form coordinates of the cage, ignoring its interior controls. Arrays as for `bind`.
    ///
    /// # Errors
    /// If the coordinates are undefined at a point, or the arrays are not a valid cage.
    #[wasm_bindgen(js_name = bindByFormula)]
    pub fn bind_by_formula(
        &self,
        #[wasm_bindgen(unchecked_param_type = "Coordinates")] kind: JsValue,
        positions: &[f32],
        cage: &[f32],
        corners: &[u32],
        #[wasm_bindgen(unchecked_param_type = "CageControls | undefined")] controls: JsValue,
    ) -> Result<BindResult, JsValue> {
        let set = control_set(cage, corners, controls)?;
        let kind: Coordinates = decode(kind)?;
        let weights =
            kind.weights(&points(positions), set.cage(), READ_LIMIT, &NoProgress).map_err(Fault::from)?;
        Ok(BindResult { weights, offsets: Offsets::default(), report: JsValue::UNDEFINED })
    }

    /// Computes the coordinates at the cell centres of a slice, for `Engine.takeSlice`; undefined if no centre is
    /// inside the cage. `axis`: 0 to 2; `fraction`: position along the axis, 0 to 1; other arguments as for `bind`.
    ///
    /// # Errors
    /// The errors of `bind`.
    #[allow(clippy::too_many_arguments, reason = "JavaScript passes arrays as separate arguments")]
    #[wasm_bindgen(js_name = bindSlice)]
    pub async fn bind_slice(
        &self,
        cage: Vec<f32>,
        corners: Vec<u32>,
        #[wasm_bindgen(unchecked_param_type = "CageControls | undefined")] controls: JsValue,
        axis: usize,
        fraction: f32,
        #[wasm_bindgen(unchecked_param_type = "BindOptions")] options: JsValue,
        #[wasm_bindgen(unchecked_param_type = "(event: Progress) => boolean")] progress: Function,
    ) -> Result<Option<BindResult>, JsValue> {
        let request: JsBindOptions = decode(options)?;
        let set = control_set(&cage, &corners, controls)?;
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
        Ok(Some(BindResult { weights, offsets, report: JsValue::UNDEFINED }))
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
        cage: Vec<f32>,
        corners: Vec<u32>,
        #[wasm_bindgen(unchecked_param_type = "CageControls | undefined")] controls: JsValue,
        cells: Option<u32>,
        #[wasm_bindgen(unchecked_param_type = "BindOptions")] options: JsValue,
        #[wasm_bindgen(unchecked_param_type = "(event: Progress) => boolean")] progress: Function,
    ) -> Result<BindResult, JsValue> {
        let mut request: JsBindOptions = decode(options)?;
        request.options.outside = OutsidePolicy::Extend;
        let cells = cells.unwrap_or(field::CLIP_CELLS);
        field::CELLS_RANGE.check(cells).map_err(|wrong| Fault::new(ErrorName::Error, wrong))?;
        let set = control_set(&cage, &corners, controls)?;
        let lattice = Lattice::new(Controls::from(&set).surface(), cells);
        let binding = self.run(&lattice.points(), &set, request, progress).await?;
        let offsets = Offsets { frames: binding.frames, outside: Vec::new() };
        Ok(BindResult { weights: binding.weights, offsets, report: JsValue::UNDEFINED })
    }

    /// Generates a cage whose surface after `smooth` subdivision steps encloses the model. `progress` as for `bind`.
    ///
    /// # Errors
    /// If the model has no triangles or an option is out of range.
    #[wasm_bindgen(js_name = generateCage)]
    pub fn generate_cage(
        &self,
        positions: &[f32],
        triangles: &[u32],
        #[wasm_bindgen(unchecked_param_type = "CageOptions")] options: JsValue,
        smooth: u32,
        #[wasm_bindgen(unchecked_param_type = "(event: Progress) => boolean")] progress: Function,
    ) -> Result<Polygons, JsValue> {
        let options = CageOptions { smooth, ..decode(options)? };
        let triangles: Vec<[u32; 3]> = triangles.as_chunks().0.to_vec();
        let listener = Listener::new(progress);
        let made = generate(&points(positions), &triangles, &options, &listener);
        let GeneratedCage { cage, report } = made.map_err(Fault::from)?;
        let bridged = if report.separate > report.parts { report.separate } else { 0 };
        Ok(Polygons { mesh: cage.to_polygon_mesh(), bridged, notices: report.notices, controls: None })
    }

    /// Transfers poses from an old cage to a new one around the same model: binds the new controls to the old cage and
    /// deforms them by each pose. `poses`: `[n_poses, n_old, 3]`; returns `[n_poses, n_new, 3]`.
    ///
    /// The reverse, binding the old vertices to the new cage, would need a linear solve, and would bend the new cage
    /// where the old one extends beyond it.
    ///
    /// # Errors
    /// If the arrays are not a valid cage, or the bind fails.
    #[wasm_bindgen(js_name = carryPoses)]
    pub fn carry_poses(
        model: &[f32],
        new: &[f32],
        old: &[f32],
        old_corners: &[u32],
        #[wasm_bindgen(unchecked_param_type = "CageControls | undefined")] old_controls: JsValue,
        poses: &[f32],
    ) -> Result<Vec<f32>, JsValue> {
        let (mut at, set) = (points(new), control_set(old, old_corners, old_controls)?);
        let (n_new, n_old) = (at.len(), Controls::from(&set).n_controls());
        // Bind model vertices too. If the new cage surrounds the old one, they are the only points inside the old cage,
        // and a bind without a point inside fails.
        at.extend(points(model).into_iter().take(MODEL_SAMPLES));
        let bound =
            cagework_core::bind(&at, &set, &BindOptions::default(), &NoProgress).map_err(Fault::from)?;
        let poses = points(poses);
        let carried = poses.chunks_exact(n_old).flat_map(|pose| {
            let moved = deform_bound(&bound.weights, &bound.frames, pose);
            flat(&moved[..n_new])
        });
        Ok(carried.collect())
    }

    /// Finds the faults of a cage around a model with vertices `model`, `[n_vertices, 3]`. Cage arrays as for `bind`.
    ///
    /// # Errors
    /// If the arrays are not a polygon mesh.
    #[wasm_bindgen(js_name = checkCage)]
    pub fn check_cage(
        model: &[f32],
        positions: &[f32],
        corners: &[u32],
        #[wasm_bindgen(unchecked_param_type = "CageControls | undefined")] controls: JsValue,
    ) -> Result<Check, JsValue> {
        let (mesh, smooth) = cage_alone(positions, corners, controls)?;
        Ok(Check { check: problems::find(&mesh, &points(model), smooth) })
    }

    /// Repairs a cage. Arrays as for `checkCage`. The repaired cage has no interior controls.
    ///
    /// # Errors
    /// If the arrays are not a polygon mesh, or the cage cannot be grown until it encloses the model.
    #[wasm_bindgen(js_name = repairCage)]
    pub fn repair_cage(
        #[wasm_bindgen(unchecked_param_type = "Repair")] kind: JsValue,
        model: &[f32],
        positions: &[f32],
        corners: &[u32],
        #[wasm_bindgen(unchecked_param_type = "CageControls | undefined")] controls: JsValue,
    ) -> Result<Polygons, JsValue> {
        let repair = decode(kind)?;
        let (mesh, smooth) = cage_alone(positions, corners, controls)?;
        let repaired = repair_smooth(&mesh, &[repair], Some(&points(model)), smooth).map_err(Fault::from)?;
        Ok(repaired.mesh.into())
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
    pub fn knot_capture() -> Result<Vec<u8>, JsValue> {
        let model = Model::of_splats("knot", samples::knot(), DVec3::ZERO).map_err(Fault::from)?;
        Ok(model.write(ModelFormat::Spz, &model.positions).map_err(Fault::from)?)
    }

    /// Builds the sample with this identifier.
    ///
    /// # Errors
    /// If no sample has this identifier.
    #[wasm_bindgen(js_name = buildSample)]
    pub fn build_sample(id: &str) -> Result<BuiltSample, JsValue> {
        let unknown = || Fault::new(ErrorName::Error, format!("there is no sample called {id:?}"));
        let sample = samples::build(id).ok_or_else(unknown)?;
        let glb =
            cagework_io::write_mesh_glb(&sample.name, &sample.mesh, &sample.colours, sample.rig.as_ref())
                .map_err(Fault::from)?;
        let positions = sample.mesh.positions;
        let grip = positions[sample.grip as usize];
        Ok(BuiltSample { glb, positions, cage: sample.cage, poses: sample.poses, grip })
    }
}

/// Returns the cage mesh without interior controls, and its number of subdivision steps.
fn cage_alone(positions: &[f32], corners: &[u32], controls: JsValue) -> Answer<(PolygonMesh, u32)> {
    let mut mesh = polygon_mesh(positions, corners)?;
    let CageControls { smooth, inner, .. } = from_js(controls)?.unwrap_or_default();
    mesh.positions.truncate(mesh.positions.len().saturating_sub(inner));
    Ok((mesh, smooth))
}

impl Binder {
    /// Returns a working GPU: the GPU of the last bind, or a new one.
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
        request: JsBindOptions,
        progress: Function,
    ) -> Answer<Binding> {
        let listener = Listener::new(progress);
        if request.is_on_cpu() {
            return Ok(cagework_core::bind(positions, set, &request.options, &listener)?);
        }
        Ok(bind_on(positions, set, &request.options, &listener, &self.open().await?).await?)
    }
}
