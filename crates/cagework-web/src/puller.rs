//! Pulling of the model's surface. It runs in a separate worker, so that binds and long frames of the page do not block
//! it.

use cagework_core::bind::fineness::ROUGH_GRID;
use cagework_core::progress::NoProgress;
use cagework_core::{BindOptions, Frames, TriMesh, bind};
use cagework_pose::pull::{Drag, DragOptions, Grip, Probes, Pull};
use glam::{DVec3, Vec3};
use js_sys::{Float32Array, Float64Array, Uint32Array};
use serde::{Deserialize, Serialize};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::arrays::{flat, points};
use crate::cage::control_set;
use crate::error::Answer;
use crate::options::decode;
use crate::views::object;

/// A prepared model with its cage, and the drag in progress.
#[wasm_bindgen]
pub struct Puller {
    pull: Pull,
    drag: Option<Drag>,
}

/// Start of a pull.
#[derive(Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct GrabInput {
    /// Current pose of the cage and of the controls inside it. `[n_controls, 3]`
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Float32Array"))]
    start: Float32Array,
    /// Weights of the grabbed points, then of the pinned points. `[n_grabs + n_pins, n_columns]`
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Float64Array"))]
    rows: Float64Array,
    /// For each row of `rows`, the model vertex nearest to the point; 2^32 - 1 if the point is a cage vertex.
    /// `[n_grabs + n_pins]`
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Uint32Array"))]
    seeds: Uint32Array,
    /// Frames of the bind that the weights come from.
    frames: Frames,
    /// Number of grabbed points.
    grabs: usize,
    #[cfg_attr(test, ts(type = "Partial<DragOptions>"))]
    options: DragOptions,
}

/// Result of starting a pull: the grabbed points, and which part of the model the pull moves.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct GrabResult {
    /// Positions of the grabbed points in the pose `start`. `[n_grabs, 3]`
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Float32Array"))]
    place: Float32Array,
    /// How strongly the pull keeps each model vertex in place, 0 to 1. `[n_vertices]`
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Float32Array"))]
    stays: Float32Array,
    /// Distance along the surface within which the pull moves the model, as a fraction of the model's size. Infinite if
    /// the pull moves the whole model.
    reach: f64,
}

/// One frame of a pull.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct PullFrame {
    /// Pose of the cage. `[n_controls, 3]`
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Float32Array"))]
    cage: Float32Array,
    /// True once further frames would not change the pose.
    settled: bool,
    /// Largest distance of a grabbed or pinned point from its target, as a fraction of the model's size.
    error: f64,
}

#[wasm_bindgen]
impl Puller {
    /// Prepares a model, `[n_vertices, 3]` and `[n_triangles, 3]`, and its rest cage.
    ///
    /// # Errors
    /// If the arrays are not a valid cage, or the model has no triangles.
    #[wasm_bindgen(constructor)]
    pub fn new(
        positions: &[f32],
        triangles: &[u32],
        #[wasm_bindgen(unchecked_param_type = "CageArrays")] cage: JsValue,
    ) -> Answer<Self> {
        let mesh = TriMesh { positions: points(positions), triangles: triangles.as_chunks().0.to_vec() };
        let set = control_set(cage)?;
        let probes = Probes::new(&mesh, &set)?;
        let options = BindOptions { grid: ROUGH_GRID, ..BindOptions::default() };
        let bound = bind(probes.points(), &set, &options, &NoProgress)?;
        let pull = Pull::new(&mesh, &set, probes, &bound.frames.folded(&bound.weights))?;
        Ok(Self { pull, drag: None })
    }

    /// Starts a drag. The grips are the grabs, then the pins.
    ///
    /// # Errors
    /// If a grip does not fit the model or the cage, there are too many grips, an option is invalid, or the pose is
    /// not finite.
    #[wasm_bindgen(unchecked_return_type = "GrabResult")]
    pub fn grab(
        &mut self,
        #[wasm_bindgen(unchecked_param_type = "GrabInput")] input: JsValue,
    ) -> Answer<JsValue> {
        let GrabInput { start, rows, seeds, frames, grabs, options } = decode(input)?;
        self.drag = None;
        let (rows, seeds) = (rows.to_vec(), seeds.to_vec());
        let rows = rows.chunks_exact((self.pull.n_cage() + frames.n_columns()).max(1)).map(<[f64]>::to_vec);
        let grips = rows.zip(seeds).map(|(row, seed)| Grip::of_seed(row, seed, &self.pull));
        let grips = grips.collect::<Result<Vec<_>, _>>()?;
        let (grabs, pins) = grips.split_at(grabs.min(grips.len()));
        let drag = Drag::new(&self.pull, &doubles(&start.to_vec()), grabs, pins, &frames, options)?;
        let stays: Vec<f32> = (0..drag.distances().len() as u32).map(|v| drag.stays(v) as f32).collect();
        let (place, reach) = (array(drag.start()), drag.reach());
        self.drag = Some(drag);
        Ok(object(&GrabResult { place, stays: stays.as_slice().into(), reach }))
    }

    /// Advances the solve by one frame towards the targets `to` of the grabs, `[n_grabs, 3]`; the target of a grab's
    /// mirror image may be omitted. Without a drag, the pose is empty.
    #[wasm_bindgen(unchecked_return_type = "PullFrame")]
    pub fn frame(&mut self, to: &[f32]) -> JsValue {
        object(&match &mut self.drag {
            Some(drag) => {
                drag.frame_with_image(&doubles(to));
                PullFrame { cage: array(&drag.cage()), settled: drag.is_settled(), error: drag.error() }
            }
            None => PullFrame { cage: Float32Array::new_with_length(0), settled: true, error: 0.0 },
        })
    }
}

fn doubles(flat: &[f32]) -> Vec<DVec3> {
    points(flat).into_iter().map(Vec3::as_dvec3).collect()
}

fn array(points: &[DVec3]) -> Float32Array {
    flat(&points.iter().map(|p| p.as_vec3()).collect::<Vec<Vec3>>()).as_slice().into()
}
