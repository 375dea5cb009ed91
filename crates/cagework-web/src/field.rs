//! The deformation as a field, for the npm package.

use cagework_core::Controls;
use cagework_core::field::{Field, FieldWeights, InverseField, Lattice};
use glam::Vec3;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::arrays::{flat, points, pose};
use crate::cage::control_set;
use crate::error::{Answer, ErrorName, Fault};
use crate::options::decode;
use crate::weights::BoundArrays;

/// The displacement field of a posed cage, on a lattice around the cage. It moves any points within the lattice, not
/// only the vertices of a bound model.
#[wasm_bindgen]
pub struct FieldMap {
    weights: FieldWeights,
    rest: Vec<Vec3>,
    field: Field,
}

#[wasm_bindgen]
impl FieldMap {
    /// Creates the field of the rest pose from the weights that `Binder.bindLattice` returned for this cage and number
    /// of cells.
    ///
    /// # Errors
    /// If the arrays do not match.
    #[wasm_bindgen(constructor)]
    pub fn new(
        #[wasm_bindgen(unchecked_param_type = "CageArrays")] cage: JsValue,
        cells: u32,
        #[wasm_bindgen(unchecked_param_type = "BoundArrays")] rows: JsValue,
    ) -> Answer<Self> {
        let set = control_set(cage)?;
        let controls = Controls::from(&set);
        let (weights, frames) = decode::<BoundArrays>(rows)?.bound(controls.n_controls())?;
        let lattice = Lattice::new(controls.surface(), cells);
        if weights.n_rows() != lattice.points().len() {
            let message = format!("the lattice of {cells} cells has {} points", lattice.points().len());
            return Err(Fault::new(ErrorName::Error, message));
        }
        let (weights, rest) = (FieldWeights::new(lattice, weights, frames), controls.rest().to_vec());
        let field = weights.pose(&rest, &rest);
        Ok(Self { weights, rest, field })
    }

    /// Moves the controls to the positions `posed`, `[n_controls, 3]`, and updates the field.
    ///
    /// # Errors
    /// If the pose has another number of points.
    pub fn pose(&mut self, posed: &[f32]) -> Answer<()> {
        self.field = self.weights.pose(&self.rest, &pose(posed, self.rest.len())?);
        Ok(())
    }

    /// Positions of points after the deformation. `[n, 3]`
    pub fn map(&self, at: &[f32]) -> Vec<f32> {
        flat(&points(at).into_iter().map(|p| self.field.map(p)).collect::<Vec<_>>())
    }

    /// The points that `map` moves to `at`; NaN if there is no such point. `[n, 3]`
    pub fn inverse(&self, at: &[f32]) -> Vec<f32> {
        let inverse = InverseField::new(&self.field);
        let find = |p: Vec3| inverse.find(p).unwrap_or(Vec3::NAN);
        flat(&points(at).into_iter().map(find).collect::<Vec<_>>())
    }

    /// Deformation gradients at points, by rows. `[n, 3, 3]`
    pub fn gradient(&self, at: &[f32]) -> Vec<f32> {
        points(at).into_iter().flat_map(|p| self.field.gradient(p).transpose().to_cols_array()).collect()
    }

    /// Position of the lattice's first node (three numbers), then the distance between adjacent nodes. Object units.
    #[wasm_bindgen(getter)]
    pub fn frame(&self) -> Vec<f32> {
        self.field.lattice.origin.extend(self.field.lattice.cell).to_array().to_vec()
    }

    /// Number of the lattice's nodes along x, y and z. `[3]`
    #[wasm_bindgen(getter)]
    pub fn dims(&self) -> Vec<u32> {
        self.field.lattice.dims.to_array().to_vec()
    }

    /// Displacements at the nodes, as an RGBA texture stores them; x varies fastest. The fourth component is 1 at nodes
    /// that have weights of the controls, and 0 at other nodes. `[nz, ny, nx, 4]`
    #[wasm_bindgen(getter)]
    pub fn displacements(&self) -> Vec<f32> {
        self.field.values.iter().flat_map(glam::Vec4::to_array).collect()
    }
}
