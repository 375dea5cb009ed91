//! The worker's half: what takes longer than a frame.
//!
//! It has its own GPU device and reads nothing but arrays. Results are taken apart by the page's `Engine`.

mod results;

use cagework_cage::check::repair_smooth;
use cagework_cage::generate::{CageOptions, GeneratedCage, generate};
use cagework_cage::samples;
use cagework_core::deform::deform_bound;
use cagework_core::dynamic::Lattice;
use cagework_core::green::green_weights;
use cagework_core::options::OutsidePolicy;
use cagework_core::progress::Silent;
use cagework_core::slice::Slice;
use cagework_core::{BindOptions, Binding, ControlSet, Controls, PolygonMesh, mean_value_weights};
use cagework_gpu::{ContextOptions, GpuContext, bind_on};
use glam::Vec3;
use js_sys::Function;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::arrays::{flat, points, polygon_mesh};
use crate::clock::Listener;
use cagework_editor::CageControls;

use crate::controls::{control_set, from_js};
use crate::error::{Answer, ErrorName, Fault};
use crate::options::{BindAsked, CageAsked, Coordinates, READ_LIMIT, taken};
use crate::problems::{self, Check};
use crate::views::object;

pub(crate) use results::Offsets;
pub use results::{Bound, BuiltSample, Polygons};

/// Vertices of the model that are bound along with a cage, so that some lie inside.
const INSIDE: usize = 256;

/// Binds, makes cages, cuts slices and builds samples.
#[wasm_bindgen]
pub struct Binder {
    gpu: Option<GpuContext>,
}

#[wasm_bindgen]
impl Binder {
    /// Without a GPU yet.
    #[wasm_bindgen(constructor)]
    #[must_use]
    #[allow(clippy::new_without_default, reason = "only JavaScript makes one")]
    pub fn new() -> Self {
        Self { gpu: None }
    }

    /// Opens a GPU for the binds to come, unless there is one, or none that could bind.
    ///
    /// # Errors
    /// `NoAdapter`, `NoDevice`.
    #[wasm_bindgen(js_name = openGpu)]
    pub async fn open_gpu(&mut self) -> Result<(), JsValue> {
        if cfg!(feature = "webgpu") && self.gpu.as_ref().is_none_or(|gpu| gpu.check().is_err()) {
            self.gpu = Some(GpuContext::new(&ContextOptions::default()).await.map_err(Fault::from)?);
        }
        Ok(())
    }

    /// Harmonic coordinates. `positions` `[n_points, 3]`, of which the last `extra_points` are no vertices, `cage` `[n_controls, 3]`; `corners`: for each face their number,
    /// then them; `controls` as `Engine.setCage` takes them. `progress` is called with every step and stops the bind by returning false.
    ///
    /// # Errors
    /// Those of a bind; when the arrays are no cage; `Missing` when the GPU is asked for and not open.
    #[allow(clippy::too_many_arguments, reason = "arrays cross the border one by one")]
    pub async fn bind(
        &self,
        positions: Vec<f32>,
        extra_points: usize,
        cage: Vec<f32>,
        corners: Vec<u32>,
        #[wasm_bindgen(unchecked_param_type = "CageControls | undefined")] controls: JsValue,
        #[wasm_bindgen(unchecked_param_type = "BindOptions")] options: JsValue,
        #[wasm_bindgen(unchecked_param_type = "(event: Progress) => boolean")] progress: Function,
    ) -> Result<Bound, JsValue> {
        let mut asked: BindAsked = taken(options)?;
        asked.options.extra_points = extra_points;
        let set = control_set(&cage, &corners, controls)?;
        let at = points(&positions);
        drop(positions);
        let binding = self.run(&at, &set, asked, progress).await?;
        let report = object(&binding.report)?;
        Ok(Bound {
            weights: binding.weights,
            offsets: Offsets { frames: binding.frames, outside: binding.outside },
            report,
        })
    }

    /// Coordinates by formula, mean value or Green, of the cage alone; the arrays are those of `bind`.
    ///
    /// # Errors
    /// When they are not defined somewhere, or the arrays are no cage.
    #[wasm_bindgen(js_name = bindByFormula)]
    pub fn bind_by_formula(
        &self,
        #[wasm_bindgen(unchecked_param_type = "Coordinates")] kind: JsValue,
        positions: &[f32],
        cage: &[f32],
        corners: &[u32],
        #[wasm_bindgen(unchecked_param_type = "CageControls | undefined")] controls: JsValue,
    ) -> Result<Bound, JsValue> {
        let set = control_set(cage, corners, controls)?;
        let by_formula = match taken(kind)? {
            Coordinates::MeanValue => mean_value_weights,
            Coordinates::Green => green_weights,
            Coordinates::Harmonic => {
                return Err(
                    Fault::new(ErrorName::Error, "there is no formula for harmonic coordinates").into()
                );
            }
        };
        let weights = by_formula(&points(positions), set.cage(), READ_LIMIT, &Silent).map_err(Fault::from)?;
        Ok(Bound { weights, offsets: Offsets::default(), report: JsValue::UNDEFINED })
    }

    /// Coordinates at the centres of a slice's cells: rows for `Engine.takeSlice`. Takes the cage's arrays, the axis,
    /// where along it (0 to 1), and the options of a bind.
    ///
    /// # Errors
    /// Those of a bind.
    #[allow(clippy::too_many_arguments, reason = "arrays cross the border one by one")]
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
    ) -> Result<Option<Bound>, JsValue> {
        let asked: BindAsked = taken(options)?;
        let set = control_set(&cage, &corners, controls)?;
        let centers = Slice::new(&set, &asked.into(), axis.min(2), fraction).centers();
        if centers.is_empty() {
            return Ok(None);
        }
        let binding = match self.run(&centers, &set, asked, progress).await {
            // Rounding may put all of a layer that only grazes the cage outside.
            Err(fault) if fault.is(ErrorName::NoneInside) => return Ok(None),
            ran => ran?,
        };
        let n_controls = Controls::from(&set).n_controls() as u32;
        let (weights, offsets) = (binding.weights.columns(0..n_controls), Offsets::default());
        Ok(Some(Bound { weights, offsets, report: JsValue::UNDEFINED }))
    }

    /// Coordinates of a lattice around a cage, for `Engine.takeLattice`; arguments as for `bind`.
    ///
    /// # Errors
    /// Those of a bind.
    #[wasm_bindgen(js_name = bindLattice)]
    pub async fn bind_lattice(
        &self,
        cage: Vec<f32>,
        corners: Vec<u32>,
        #[wasm_bindgen(unchecked_param_type = "CageControls | undefined")] controls: JsValue,
        #[wasm_bindgen(unchecked_param_type = "BindOptions")] options: JsValue,
        #[wasm_bindgen(unchecked_param_type = "(event: Progress) => boolean")] progress: Function,
    ) -> Result<Bound, JsValue> {
        let mut asked: BindAsked = taken(options)?;
        asked.options.outside = OutsidePolicy::Extend;
        let set = control_set(&cage, &corners, controls)?;
        let lattice = Lattice::new(Controls::from(&set).surface());
        let binding = self.run(&lattice.points(), &set, asked, progress).await?;
        let offsets = Offsets { frames: binding.frames, outside: Vec::new() };
        Ok(Bound { weights: binding.weights, offsets, report: JsValue::UNDEFINED })
    }

    /// A cage for a model: `CageOptions` of contract.ts, and after how many steps of subdivision it encloses the model. `progress`
    /// as for `bind`.
    ///
    /// # Errors
    /// When there is nothing to enclose or an option is out of range.
    #[wasm_bindgen(js_name = generateCage)]
    pub fn generate_cage(
        &self,
        positions: &[f32],
        triangles: &[u32],
        #[wasm_bindgen(unchecked_param_type = "CageOptions")] options: JsValue,
        smooth: u32,
        #[wasm_bindgen(unchecked_param_type = "(event: Progress) => boolean")] progress: Function,
    ) -> Result<Polygons, JsValue> {
        let asked: CageAsked = taken(options)?;
        let options = CageOptions { smooth, ..asked.into() };
        let triangles: Vec<[u32; 3]> = triangles.as_chunks().0.to_vec();
        let listener = Listener::new(progress);
        let made = generate(&points(positions), &triangles, &options, &listener);
        let GeneratedCage { cage, report } = made.map_err(Fault::from)?;
        let bridged = if report.separate > report.parts { report.separate } else { 0 };
        Ok(Polygons { mesh: cage.to_polygon_mesh(), bridged, notices: report.notices, controls: None })
    }

    /// Poses of a cage for another one around the same model: where harmonic coordinates in the old cage bring the new one's
    /// vertices. (The new one's coordinates at the old vertices would be equations to solve, and bend the new cage where
    /// the old one reaches beyond it.) Controls inside are carried as vertices are. `poses` and what is returned: one pose after
    /// the other, `[n_controls, 3]` each.
    ///
    /// # Errors
    /// When the arrays are no cages; those of a bind.
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
        // A cage that lies around the old one has no vertex inside of it: some of the model's are.
        at.extend(points(model).into_iter().take(INSIDE));
        let bound = cagework_core::bind(&at, &set, &BindOptions::default(), &Silent).map_err(Fault::from)?;
        let poses = points(poses);
        let carried = poses.chunks_exact(n_old).flat_map(|pose| {
            let moved = deform_bound(&bound.weights, &bound.frames, pose);
            flat(&moved[..n_new])
        });
        Ok(carried.collect())
    }

    /// What is wrong with a cage for a model, `[n_vertices, 3]`; a cage's arrays are those of `bind`.
    ///
    /// # Errors
    /// When the arrays are no mesh.
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

    /// A repaired cage, from the arrays of `checkCage`; without controls inside.
    ///
    /// # Errors
    /// When growing did not help.
    #[wasm_bindgen(js_name = repairCage)]
    pub fn repair_cage(
        #[wasm_bindgen(unchecked_param_type = "Repair")] kind: JsValue,
        model: &[f32],
        positions: &[f32],
        corners: &[u32],
        #[wasm_bindgen(unchecked_param_type = "CageControls | undefined")] controls: JsValue,
    ) -> Result<Polygons, JsValue> {
        let asked = taken(kind)?;
        let (mesh, smooth) = cage_alone(positions, corners, controls)?;
        let repaired = repair_smooth(&mesh, &[asked], Some(&points(model)), smooth).map_err(Fault::from)?;
        Ok(repaired.mesh.into())
    }

    /// Identifier, label and what there is to see of each sample, in turn.
    #[must_use]
    pub fn samples() -> Vec<String> {
        samples::all().iter().flat_map(|s| [s.id, s.label, s.sentence]).map(str::to_owned).collect()
    }

    /// Builds a sample.
    ///
    /// # Errors
    /// When there is none of that name.
    #[wasm_bindgen(js_name = buildSample)]
    pub fn build_sample(id: &str) -> Result<BuiltSample, JsValue> {
        let unknown = || Fault::new(ErrorName::Error, format!("there is no sample called {id:?}"));
        let sample = samples::build(id).ok_or_else(unknown)?;
        let glb =
            cagework_io::write_mesh_glb(&sample.name, &sample.mesh, &sample.colours, sample.rig.as_ref())
                .map_err(Fault::from)?;
        let positions = sample.mesh.positions;
        Ok(BuiltSample { glb, positions, cage: sample.cage, poses: sample.poses })
    }
}

/// A cage's mesh without the controls inside it, and its steps of subdivision.
fn cage_alone(positions: &[f32], corners: &[u32], controls: JsValue) -> Answer<(PolygonMesh, u32)> {
    let mut mesh = polygon_mesh(positions, corners)?;
    let CageControls { smooth, inner, .. } = from_js(controls)?.unwrap_or_default();
    mesh.positions.truncate(mesh.positions.len().saturating_sub(inner));
    Ok((mesh, smooth))
}

impl Binder {
    fn open(&self) -> Answer<&GpuContext> {
        self.gpu.as_ref().ok_or_else(|| Fault::missing("GPU", "open one first"))
    }

    pub(crate) async fn run(
        &self,
        positions: &[Vec3],
        set: &ControlSet,
        asked: BindAsked,
        progress: Function,
    ) -> Answer<Binding> {
        let options = BindOptions::from(asked);
        let listener = Listener::new(progress);
        if asked.is_on_cpu() {
            return Ok(cagework_core::bind(positions, set, &options, &listener)?);
        }
        Ok(bind_on(positions, set, &options, &listener, self.open()?).await?)
    }
}
