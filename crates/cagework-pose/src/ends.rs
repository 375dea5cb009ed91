//! Keeps the shape of hands, feet and head when a cage is posed.
//!
//! Few vertices of a cage lie at a chin or an ankle, and they follow the neck and the shin, too. So the pose is corrected
//! by regularised least squares: the vertices of hands, feet and head come close to their images.

use cagework_core::rig::Rig;
use cagework_core::weights::Weights;
use glam::{DVec3, Vec3};
use nalgebra::{Cholesky, DMatrix};

use crate::drive::{Map, skin_of_bones};
use crate::humanoid::{Bone, ENDS, Humanoid, N_BONES};

/// Vertices of the model with more than this weight for one of [`ENDS`] should keep its shape.
const OF_END: f64 = 0.95;
/// Number of vertices of each end that count.
const PER_END: usize = 256;
/// Number of the other vertices that count.
const OTHERS: usize = 1024;
/// Cages with more controls are not corrected: the matrix has as many rows and columns.
const MAX_CONTROLS: usize = 1000;
/// Weight of the squared moves of other vertices against those of the ends.
const STAY: f64 = 0.05;
/// Weight of the squared moves of the cage's vertices, against the mean weight of a cage vertex.
const HOLD: f64 = 0.01;

/// Vertices of the ends, and the matrix that corrects a pose.
#[derive(Clone, Debug)]
pub(crate) struct EndFit {
    /// Bone and position at rest of each vertex that counts. `[n]`, object units
    vertices: Vec<(Bone, DVec3)>,
    /// Weights of the controls at these vertices. `[n, n_controls]`
    weights: DMatrix<f64>,
    /// Moves of the controls per error of a vertex. `[n_controls, n]`
    correction: DMatrix<f64>,
}

impl EndFit {
    /// Prepares the correction. `weights`: bind of the model, with one row per vertex and more rows of other points,
    /// and with one column per control and more columns of frames. `None` if the model has no vertices of hands, feet
    /// and head, or the cage has more than 1000 controls.
    pub(crate) fn new(
        n_controls: usize,
        weights: &Weights,
        positions: &[Vec3],
        rig: &Rig,
        humanoid: &Humanoid,
    ) -> Option<Self> {
        if n_controls > MAX_CONTROLS {
            return None;
        }
        let skin = skin_of_bones(rig, humanoid);
        let n = skin.len().min(positions.len()).min(weights.n_rows());
        let mut rows = Vec::new();
        for end in ENDS {
            let share = |v: &usize| end.iter().map(|bone| skin[*v][*bone as usize]).sum::<f64>();
            let own: Vec<usize> = (0..n).filter(|v| share(v) > OF_END).collect();
            rows.extend(spread(&own, PER_END).map(|v| (end[0], v)));
        }
        if rows.is_empty() {
            return None;
        }
        let is_end = |row: &[f64; N_BONES]| {
            ENDS.iter().any(|end| end.iter().map(|bone| row[*bone as usize]).sum::<f64>() > OF_END)
        };
        let others: Vec<usize> = (0..n).filter(|v| !is_end(&skin[*v])).collect();
        let others: Vec<usize> = spread(&others, OTHERS).collect();
        let dense = |rows: &mut dyn ExactSizeIterator<Item = usize>| {
            let mut dense = DMatrix::zeros(rows.len(), n_controls);
            for (k, v) in rows.enumerate() {
                let (columns, values) = weights.row(v);
                for (&column, &value) in columns.iter().zip(values) {
                    if (column as usize) < n_controls {
                        dense[(k, column as usize)] = f64::from(value);
                    }
                }
            }
            dense
        };
        let of_ends = dense(&mut rows.iter().map(|(_, v)| *v));
        let of_others = dense(&mut others.into_iter());
        let mut normal = of_ends.tr_mul(&of_ends) + STAY * of_others.tr_mul(&of_others);
        let hold = HOLD * normal.trace() / n_controls as f64;
        for k in 0..n_controls {
            normal[(k, k)] += hold;
        }
        let correction = Cholesky::new(normal)?.solve(&of_ends.transpose());
        let vertices = rows.into_iter().map(|(bone, v)| (bone, positions[v].as_dvec3())).collect();
        Some(Self { vertices, weights: of_ends, correction })
    }

    /// Corrects a pose. `rest`, `posed`: controls, object units; `maps`: the maps from which the pose was made.
    pub(crate) fn correct(&self, rest: &[Vec3], posed: &mut [DVec3], maps: &[Map; N_BONES]) {
        let moved = |axis: usize| {
            let moves = posed.iter().zip(rest).map(|(p, rest)| p[axis] - f64::from(rest[axis]));
            &self.weights * DMatrix::from_iterator(posed.len(), 1, moves)
        };
        let moved: [DMatrix<f64>; 3] = std::array::from_fn(moved);
        let wanted = |&(bone, at): &(Bone, DVec3)| maps[bone as usize].apply(at) - at;
        let wanted: Vec<DVec3> = self.vertices.iter().map(wanted).collect();
        for (axis, moved) in moved.iter().enumerate() {
            let errors = wanted.iter().zip(moved.iter()).map(|(wanted, moved)| wanted[axis] - moved);
            let by = &self.correction * DMatrix::from_iterator(wanted.len(), 1, errors);
            posed.iter_mut().zip(by.iter()).for_each(|(p, by)| p[axis] += by);
        }
    }
}

/// At most `limit` elements of a list, evenly spread.
fn spread(all: &[usize], limit: usize) -> impl ExactSizeIterator<Item = usize> {
    let n = all.len().min(limit);
    (0..n).map(move |k| all[k * all.len() / n])
}
