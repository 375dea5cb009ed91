//! Pulling of the model's surface. It runs in a separate worker, so that binds and long frames of the page do not block
//! it.

use cagework_core::progress::NoProgress;
use cagework_core::{BindOptions, ControlSet, Frames, TriMesh, bind};
use cagework_pose::pull::{Drag, DragOptions, Grip, Probes, Pull};
use glam::{DVec3, Vec3};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::arrays::{flat, points};
use crate::controls::control_set;
use crate::error::Answer;
use crate::options::decode;

/// Value in the `seeds` of [`Puller::grab`] that marks a grip on a cage vertex.
pub(crate) const CAGE_SEED: u32 = u32::MAX;

/// A prepared model with its cage, and the drag in progress.
#[wasm_bindgen]
pub struct Puller {
    pull: Pull,
    drag: Option<Drag>,
}

#[wasm_bindgen]
impl Puller {
    /// Prepares a model, `[n_vertices, 3]` and `[n_triangles, 3]`, and its rest cage. Cage arrays as for `Binder.bind`.
    ///
    /// # Errors
    /// If the arrays are not a valid cage, or the model has no triangles.
    #[wasm_bindgen(constructor)]
    pub fn new(
        positions: &[f32],
        triangles: &[u32],
        cage: &[f32],
        corners: &[u32],
        #[wasm_bindgen(unchecked_param_type = "CageControls | undefined")] controls: JsValue,
    ) -> Result<Self, JsValue> {
        let set = control_set(cage, corners, controls)?;
        let mesh = TriMesh { positions: points(positions), triangles: triangles.as_chunks().0.to_vec() };
        Ok(Self::of(&mesh, &set)?)
    }

    /// Starts a drag in the pose `start`, `[n_controls, 3]`. The grips are the grabs, then the pins. `rows`: weights of
    /// the grips, `[n_grips, n_controls]`; `seeds`: nearest model vertex of each grip, or 2^32 - 1 for a cage vertex.
    /// Returns the positions of the grabs, `[n_grabs, 3]`.
    ///
    /// # Errors
    /// If a grip does not fit the model or the cage, there are too many grips, an option is invalid, or the pose is
    /// not finite.
    pub fn grab(
        &mut self,
        start: &[f32],
        rows: &[f64],
        seeds: &[u32],
        n_grabs: usize,
        #[wasm_bindgen(unchecked_param_type = "Partial<DragOptions>")] options: JsValue,
    ) -> Result<Vec<f32>, JsValue> {
        let options = decode(options)?;
        self.drag = None;
        let drag = self.begin(start, rows, seeds, n_grabs, options)?;
        let at: Vec<Vec3> = drag.start().iter().map(|p| p.as_vec3()).collect();
        self.drag = Some(drag);
        Ok(flat(&at))
    }

    /// How much each vertex of the model stays in place during the drag, from 0 to 1; empty without a drag.
    /// `[n_vertices]`
    pub fn stays(&self) -> Vec<f32> {
        self.drag.as_ref().map_or_else(Vec::new, |drag| {
            (0..drag.distances().len() as u32).map(|v| drag.stays(v) as f32).collect()
        })
    }

    /// Advances the solve by one frame towards the targets `to` of the grabs, `[n_grabs, 3]`; the target of a grab's
    /// mirror image may be omitted. Returns the positions of the controls, `[n_controls, 3]`, or an empty array without
    /// a drag.
    pub fn frame(&mut self, to: &[f32]) -> Vec<f32> {
        let Some(drag) = &mut self.drag else { return Vec::new() };
        let mut to: Vec<DVec3> = points(to).into_iter().map(Vec3::as_dvec3).collect();
        if let (&[to_first], &[first, image]) = (&*to, drag.start()) {
            // The mirror image moves by the reflected displacement of the grab.
            to.push(image + (to_first - first) * DVec3::new(-1.0, 1.0, 1.0));
        }
        drag.frame(&to);
        flat(&drag.cage().iter().map(|p| p.as_vec3()).collect::<Vec<Vec3>>())
    }

    /// Whether the last frame barely moved the cage, so that no further frame is needed. True without a drag.
    #[wasm_bindgen(getter)]
    pub fn settled(&self) -> bool {
        self.drag.as_ref().is_none_or(Drag::is_settled)
    }

    /// Distance along the surface within which the drag moves the model, as a fraction of the model's size. Infinite if
    /// the drag moves the whole model; 0 without a drag.
    #[wasm_bindgen(getter)]
    pub fn reach(&self) -> f64 {
        self.drag.as_ref().map_or(0.0, Drag::reach)
    }

    /// Largest distance of a grab or pin from its target, as a fraction of the model's size; 0 without a drag.
    #[wasm_bindgen(getter)]
    pub fn error(&self) -> f64 {
        self.drag.as_ref().map_or(0.0, Drag::error)
    }
}

impl Puller {
    fn of(mesh: &TriMesh, set: &ControlSet) -> Answer<Self> {
        let probes = Probes::new(mesh, set)?;
        let bound = bind(probes.points(), set, &BindOptions::default(), &NoProgress)?;
        let pull = Pull::new(mesh, set, probes, &bound.frames.folded(&bound.weights))?;
        Ok(Self { pull, drag: None })
    }

    fn begin(
        &self,
        start: &[f32],
        rows: &[f64],
        seeds: &[u32],
        n_grabs: usize,
        options: DragOptions,
    ) -> Answer<Drag> {
        let rows = rows.chunks_exact(self.pull.n_cage().max(1));
        let grip = |(row, &seed): (&[f64], &u32)| {
            if seed == CAGE_SEED {
                let vertex = row.iter().position(|&w| w == 1.0).unwrap_or(usize::MAX);
                return self.pull.on_cage(vertex as u32);
            }
            Ok(Grip::of_row(row.to_vec(), seed))
        };
        let grips = rows.zip(seeds).map(grip).collect::<Result<Vec<_>, _>>()?;
        let (grabs, pins) = grips.split_at(n_grabs.min(grips.len()));
        let start: Vec<DVec3> = points(start).into_iter().map(Vec3::as_dvec3).collect();
        Ok(Drag::new(&self.pull, &start, grabs, pins, &Frames::default(), options)?)
    }
}

#[cfg(test)]
mod tests {
    use cagework_cage::samples;
    use cagework_core::Cage;

    use super::*;

    #[test]
    fn a_vertex_of_the_cage_is_pulled_by_its_row_of_one() {
        let sample = samples::build("clamp").unwrap();
        let cage = Cage::new(&sample.cage).unwrap();
        let mut puller = Puller::of(&sample.mesh, &ControlSet::plain(&cage)).unwrap();
        let n = cage.n_vertices();
        let mut row = vec![0.0; n];
        row[3] = 1.0;
        let options = DragOptions::default();
        let start = flat(cage.positions());
        puller.drag = Some(puller.begin(&start, &row, &[CAGE_SEED], 1, options).unwrap());
        let to = cage.positions()[3] + 0.1 * Vec3::Y;
        let mut moved = Vec::new();
        for _ in 0..20 {
            moved = points(&puller.frame(&to.to_array()));
        }
        assert!(moved[3].distance(to) < 1e-2, "{} {to}", moved[3]);
        assert_eq!(puller.stays().len(), sample.mesh.positions.len());
        let none = puller.begin(&start, &vec![0.0; n], &[CAGE_SEED], 1, options).err();
        assert!(none.is_some(), "no vertex of the cage");
    }
}
