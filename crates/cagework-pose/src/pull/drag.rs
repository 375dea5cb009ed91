//! A drag: the matrices that are factorised when the drag starts, and its state while the pointer moves.

use glam::{DMat3, DVec3, Vec3};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::anderson::Anderson;
use super::energy::Pull;
use super::grip::{Grip, check as check_index};
use super::{MAX_HANDLES, PullError};
use crate::symmetry::Symmetry;
use cagework_core::frames::Frames;
use cagework_core::options::{Number, Slider};
use cagework_core::rotation::nearest_rotation;

/// Weight of the cage's edges in the energy E ([`super`]). Results are nearly equal from 0.02 to 0.4. Below this range,
/// the cage gets spikes where it hardly moves the model.
pub(super) const CAGE_WEIGHT: f64 = 0.1;
/// Weight of the cage's edges while a cage vertex is dragged. With a lower weight, the vertex's neighbours move against
/// the drag.
const GRABBED_CAGE_WEIGHT: f64 = 3.0;
/// Weight that keeps samples beyond the reach in place. Results are nearly equal from 100 to 300.
const STAY_WEIGHT: f64 = 200.0;
/// Share of the reach within which samples move freely. From there to the full reach, the weight that keeps a sample in
/// place rises from 0 to [`STAY_WEIGHT`].
const FREE_SHARE: f64 = 0.75;
/// Share of the model's area that the automatic reach of one grab encloses. With more grabs, it is twice this share.
const REACH_AREA: f64 = 0.15;
/// Range of the automatic reach, as multiples of the model's size. [`REACH_PER_GRAB_DISTANCE`] can extend it further.
const REACH_RANGE: [f64; 2] = [0.15, 0.5];
/// Lower limit on the automatic reach of several grabs, as a multiple of the largest distance between two of them.
const REACH_PER_GRAB_DISTANCE: f64 = 1.2;
/// Radius of the patch that a pin fixes, as a fraction of the model's size. With a single point pinned, the model would
/// rotate about that point.
const PIN_RADIUS: f64 = 0.05;
/// Weight of the samples in a pin's patch.
const PIN_WEIGHT: f64 = 2e4;
/// Stiffness mu of grabs and pins, as a multiple of the mean diagonal entry of the matrix of the energy E, fixed samples
/// included.
const HANDLE_STIFFNESS: f64 = 1e3;
/// Regularisation eps, as a fraction of the mean diagonal entry of the matrix of the energy E, computed without the
/// fixed samples.
pub(super) const REGULARISATION: f64 = 1e-6;
/// The drag has settled when the last step of a frame changes each coordinate of the cage by less than this, as a
/// fraction of the model's size. With 1e-4 instead, a pull of the whole model would stop 5 % short of the targets.
const MIN_FRAME_MOVE: f64 = 2e-5;

/// Distance along the surface, from the grabs, up to which a drag moves the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub enum Reach {
    /// The distance within which 15 % of the model's area lies, or 30 % with two or more grabs; limited to 0.15 to 0.5
    /// times the model's size, but at least 1.2 times the largest distance between two grabs.
    #[default]
    Automatic,
    /// The given multiple of the model's size.
    Of(f64),
    /// The whole model moves: only pins stay in place.
    Whole,
}

/// Options of a drag.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(default)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct DragOptions {
    /// Distance along the surface up to which the model moves.
    pub reach: Reach,
    /// Share by which parts within the reach return to their rest shape as the drag grows, 0 to 1. Default 0.5.
    pub relax: f64,
    /// Whether the cage stays symmetric: each step averages it with its mirror image. Default false.
    pub symmetry: bool,
}

impl Default for DragOptions {
    fn default() -> Self {
        Self { reach: Reach::Automatic, relax: 0.5, symmetry: false }
    }
}

/// State of a drag in progress.
pub struct Drag {
    pub(super) n: usize,
    pub(super) n_groups: usize,
    pub(super) size: f64,
    reach: f64,
    pub(super) relax: f64,
    /// Cage positions: all x, then all y, then all z. `[3 n]`
    pub(super) cage: DVector<f64>,
    /// Weights `Q` of the grabs, then of the pins, with the frames folded in ([`Frames::folded`]). `[n_handles, n]`
    pub(super) handles: DMatrix<f64>,
    /// Weights of the grabs, then of the pins. `[n_handles, n_columns]`
    rows: DMatrix<f64>,
    frames: Frames,
    /// Targets of the grabs and pins. `[n_handles, 3]`
    pub(super) targets: DMatrix<f64>,
    /// Positions of the grabs at the start of the drag. `[n_grabs]`
    pub(super) start: Vec<DVec3>,
    /// `A^-1`, `A^-1 Q^T` and `(Q A^-1 Q^T + 1 / mu)^-1`, where A is the matrix of the energy E without grabs and pins,
    /// and mu the stiffness of grabs and pins.
    pub(super) inverse: DMatrix<f64>,
    pub(super) spread: DMatrix<f64>,
    pub(super) hold: DMatrix<f64>,
    /// Part of the right-hand side that does not depend on rotations. `[n, 3]`
    pub(super) constant: DMatrix<f64>,
    /// Moments of the start pose, see [`Pull::moments`].
    pub(super) posed: Vec<f64>,
    /// Change of the moments by full relaxation.
    pub(super) relaxing: Vec<f64>,
    /// Current moments: `posed` and a share of `relaxing`.
    pub(super) moments: Vec<f64>,
    /// Distance along the surface to the nearest grab, object units. `[n_vertices]`
    distances: Vec<f32>,
    /// Whether the drag has a single grab, on the model, no pins and an unlimited reach, so that it only translates the
    /// model.
    pub(super) is_shift: bool,
    pub(super) anderson: Anderson,
    pub(super) moved: f64,
    pub(super) mirror: Option<Symmetry>,
}

impl Drag {
    /// Starts a drag of `grabs` with `pins` fixed, from the cage `start`, `[n]`, object units. `frames`: of the bind
    /// that the weights of the grips come from.
    ///
    /// # Errors
    /// [`PullError`]: a handle does not exist, there are too many handles, a number is out of range, or a pose is not
    /// finite.
    pub fn new(
        pull: &Pull,
        start: &[DVec3],
        grabs: &[Grip],
        pins: &[Grip],
        frames: &Frames,
        options: DragOptions,
    ) -> Result<Self, PullError> {
        check(pull, start, grabs, pins, frames, options)?;
        let n = pull.n_cage();
        let cage_grabbed = grabs.iter().any(|grab| grab.is_cage);
        let gamma = if cage_grabbed { GRABBED_CAGE_WEIGHT } else { CAGE_WEIGHT };
        let grips: Vec<&Grip> = grabs.iter().chain(pins).collect();
        let n_columns = n + frames.n_columns();
        let rows =
            DMatrix::from_fn(grips.len(), n_columns, |h, i| grips[h].row.get(i).copied().unwrap_or(0.0));
        let folded: Vec<Vec<f64>> =
            rows.row_iter().map(|row| frames.folded_row(&row.iter().copied().collect::<Vec<_>>())).collect();
        let handles = DMatrix::from_fn(grips.len(), n, |h, i| folded[h][i]);
        let cage = DMatrix::from_fn(n, 3, |i, x| start[i][x]);
        let targets = places(&rows, frames, &cage);

        let seeds: Vec<u32> = grips.iter().map(|grip| grip.seed).collect();
        let distances: Vec<Vec<f32>> =
            seeds[..grabs.len()].iter().map(|&s| pull.geodesic.from(s, f32::INFINITY)).collect();
        let reach = reach_of(pull, options.reach, &distances, &seeds[..grabs.len()]);
        let samples = &pull.probes.samples;
        let distances: Vec<f32> = (0..pull.n_vertices)
            .map(|v| distances.iter().map(|from_grab| from_grab[v]).fold(f32::INFINITY, f32::min))
            .collect();
        let stays: Vec<f64> = samples.iter().map(|&s| stays(distances[s as usize], reach)).collect();
        let mut holds: Vec<f64> = stays.iter().map(|stay| STAY_WEIGHT * stay).collect();
        let patch = PIN_RADIUS * pull.size;
        for &seed in &seeds[grabs.len()..] {
            let from_pin = pull.geodesic.from(seed, patch as f32);
            for (hold, &s) in holds.iter_mut().zip(samples) {
                *hold += PIN_WEIGHT * (1.0 - smooth(f64::from(from_pin[s as usize]) / patch));
            }
        }
        let mut held = pull.sample_rows.clone();
        for ((mut row, hold), share) in held.row_iter_mut().zip(holds).zip(&pull.probes.shares) {
            row *= hold * share / (pull.size * pull.size);
        }
        let held = held.transpose();

        let matrix = pull.matrix(gamma);
        let mean = matrix.trace() / n as f64;
        let mut matrix = matrix + &held * &pull.sample_rows;
        for i in 0..n {
            matrix[(i, i)] += REGULARISATION * mean;
        }
        // Scale by the trace of the whole matrix: in a coarse cage, each handle is coupled to all cage vertices.
        let firm = HANDLE_STIFFNESS * matrix.trace() / n as f64;
        let constant = &held * (&pull.sample_rows * &cage) + REGULARISATION * mean * &cage;
        let inverse = matrix.cholesky().ok_or(PullError::Singular)?.inverse();
        let spread = &inverse * handles.transpose();
        let mut hold = &handles * &spread;
        for i in 0..hold.nrows() {
            hold[(i, i)] += 1.0 / firm;
        }
        let hold = hold.cholesky().ok_or(PullError::Singular)?.inverse();

        // Gradients and edges of the start pose and of the rest shape. Each group of the rest shape is rotated to fit
        // the start pose best.
        let posed = pull.references(start);
        let rest = pull.references(&pull.cage);
        let of_rest = pull.moments(&rest, gamma);
        let rotations: Vec<DMat3> = group_matrices(&of_rest, &flat(start), pull.n_groups())
            .into_iter()
            .map(nearest_rotation)
            .collect();
        let relaxed: Vec<DVec3> = pull
            .groups()
            .zip(&rest)
            .zip(&posed)
            .map(|((r, rest), posed)| rotations[r] * *rest - *posed)
            .collect();
        let posed = pull.moments(&posed, gamma);
        let follows: Vec<f64> = stays.iter().map(|stay| 1.0 - stay).collect();
        let mut relaxing = pull.moments(&relaxed, gamma);
        let local = locality(pull, &follows);
        let width = 3 * pull.n_groups();
        for (k, moment) in relaxing.iter_mut().enumerate() {
            *moment *= local[k % width / 3];
        }
        let start_of = |h: usize| DVec3::new(targets[(h, 0)], targets[(h, 1)], targets[(h, 2)]);
        Ok(Self {
            n,
            n_groups: pull.n_groups(),
            size: pull.size,
            reach,
            relax: options.relax,
            cage: flat(start),
            start: (0..grabs.len()).map(start_of).collect(),
            handles,
            rows,
            frames: frames.clone(),
            targets,
            inverse,
            spread,
            hold,
            constant,
            moments: posed.clone(),
            posed,
            relaxing,
            distances,
            is_shift: reach.is_infinite() && grips.len() == 1 && !cage_grabbed,
            anderson: Anderson::default(),
            moved: 0.0,
            mirror: options.symmetry.then(|| pull.symmetry.clone()),
        })
    }

    /// Positions of the grabs at the start. `[n_grabs]`, object units
    #[must_use]
    pub fn start(&self) -> &[DVec3] {
        &self.start
    }

    /// Reach as a multiple of the model's size; infinite for the whole model.
    #[must_use]
    pub fn reach(&self) -> f64 {
        self.reach / self.size
    }

    /// Reach, object units.
    #[must_use]
    pub fn reach_length(&self) -> f64 {
        self.reach
    }

    /// Distance of each vertex from the nearest grab along the surface, object units. `[n_vertices]`
    #[must_use]
    pub fn distances(&self) -> &[f32] {
        &self.distances
    }

    /// Weight with which a vertex of the model stays in place: 0 up to 75 % of the reach, 1 from the reach on.
    #[must_use]
    pub fn stays(&self, vertex: u32) -> f64 {
        stays(self.distances[vertex as usize], self.reach)
    }

    /// Cage positions. `[n]`, object units
    #[must_use]
    pub fn cage(&self) -> Vec<DVec3> {
        let [x, y, z] = [0, 1, 2].map(|k| self.cage.rows(k * self.n, self.n));
        (0..self.n).map(|i| DVec3::new(x[i], y[i], z[i])).collect()
    }

    /// Whether the last step of the last frame changed each coordinate of the cage by less than 2e-5 of the model's
    /// size: no further frame is needed.
    #[must_use]
    pub fn is_settled(&self) -> bool {
        self.moved < MIN_FRAME_MOVE
    }

    /// Largest distance of a grab or pin from its target, as a fraction of the model's size.
    #[must_use]
    pub fn error(&self) -> f64 {
        let off = self.places() - &self.targets;
        off.row_iter().map(|row| row.norm()).fold(0.0, f64::max) / self.size
    }

    /// Positions of the grabs and pins. `[n_handles, 3]`, object units
    pub(super) fn places(&self) -> DMatrix<f64> {
        places(&self.rows, &self.frames, &self.cage_matrix())
    }

    /// Part of the positions of the grabs and pins that is not linear in the cage: the effect of rotated bones, and
    /// constant offsets. `[n_handles, 3]`, object units
    pub(super) fn nonlinear_part(&self) -> DMatrix<f64> {
        self.places() - &self.handles * self.cage_matrix()
    }

    fn cage_matrix(&self) -> DMatrix<f64> {
        DMatrix::from_column_slice(self.n, 3, self.cage.as_slice())
    }
}

/// Positions of points with the weights `rows`, `[n_points, n_columns]`, in the pose `cage`, `[n, 3]`. `[n_points, 3]`
fn places(rows: &DMatrix<f64>, frames: &Frames, cage: &DMatrix<f64>) -> DMatrix<f64> {
    let n = cage.nrows();
    let narrow: Vec<Vec3> = cage.row_iter().map(|p| DVec3::new(p[0], p[1], p[2]).as_vec3()).collect();
    let of_frames = &frames.columns(&narrow)[n..];
    let columns = DMatrix::from_fn(rows.ncols(), 3, |i, x| match i.checked_sub(n) {
        None => cage[(i, x)],
        Some(frame) => f64::from(of_frames[frame][x]),
    });
    rows * columns
}

fn check(
    pull: &Pull,
    start: &[DVec3],
    grabs: &[Grip],
    pins: &[Grip],
    frames: &Frames,
    options: DragOptions,
) -> Result<(), PullError> {
    if grabs.is_empty() {
        return Err(PullError::NoGrab);
    }
    let handles = grabs.len() + pins.len();
    if handles > MAX_HANDLES {
        return Err(PullError::Handles(handles));
    }
    for grip in grabs.iter().chain(pins) {
        check_index("vertex of the model", grip.seed, pull.n_vertices)?;
        let n_frames = if grip.is_cage { 0 } else { frames.n_columns() };
        if grip.row.len() != pull.n_cage() + n_frames || !frames.fits(pull.n_cage()) {
            let (rows, columns, vertices) = (1, grip.row.len().saturating_sub(n_frames), 1);
            return Err(PullError::Shape { rows, columns, vertices, controls: pull.n_cage() });
        }
        if let Some(&value) = grip.row.iter().find(|w| !w.is_finite()) {
            return Err(PullError::Value { what: "a weight", value, range: "finite" });
        }
    }
    if start.len() != pull.n_cage() {
        return Err(PullError::Start { given: start.len(), cage: pull.n_cage() });
    }
    let not_finite = start.iter().flat_map(DVec3::to_array).find(|x| !x.is_finite());
    if let Some(value) = not_finite {
        return Err(PullError::Value { what: "a coordinate of the start", value, range: "finite" });
    }
    if !(0.0..=1.0).contains(&options.relax) {
        return Err(PullError::Value { what: "relax", value: options.relax, range: "from 0 to 1" });
    }
    match options.reach {
        Reach::Of(value) if !(REACH.is_allowed)(value) => {
            Err(PullError::Value { what: "the reach", value, range: REACH.allowed })
        }
        _ => Ok(()),
    }
}

/// The `reach` option: distance along the surface up to which a pull moves the model. In the upper half of its slider,
/// the page sends [`Reach::Whole`] instead of a distance.
pub const REACH: Number = Number {
    name: "reach",
    help: "Distance along the surface that a pull affects",
    unit: "fraction of the model's size",
    allowed: "a number above 0",
    is_allowed: |reach| reach.is_finite() && reach > 0.0,
    slider: Some(Slider { min: 0.05, max: 2.4, step: 0.05 }),
};

/// Computes the reach in object units. Automatic: the distance that encloses 15 % of the area (30 % with two or more
/// grabs), limited to [`REACH_RANGE`], but at least 1.2 times the largest distance between two grabs.
fn reach_of(pull: &Pull, reach: Reach, distances: &[Vec<f32>], seeds: &[u32]) -> f64 {
    match reach {
        Reach::Whole => return f64::INFINITY,
        Reach::Of(share) => return share * pull.size,
        Reach::Automatic => {}
    }
    let wanted = REACH_AREA * distances.len().min(2) as f64;
    let holding = |from_grab: &Vec<f32>| {
        let mut order: Vec<u32> = (0..from_grab.len() as u32).collect();
        order.sort_unstable_by(|&a, &b| from_grab[a as usize].total_cmp(&from_grab[b as usize]));
        let mut area = 0.0;
        let last = order.iter().find(|&&v| {
            area += pull.probes.areas[v as usize];
            area >= wanted
        });
        last.or(order.last()).map_or(0.0, |&v| f64::from(from_grab[v as usize]))
    };
    let [least, most] = REACH_RANGE.map(|share| share * pull.size);
    let reach = distances.iter().map(holding).fold(0.0, f64::max).clamp(least, most);
    let between =
        distances.iter().flat_map(|from_grab| seeds.iter().map(|&s| f64::from(from_grab[s as usize])));
    reach.max(REACH_PER_GRAB_DISTANCE * between.fold(0.0, f64::max))
}

/// Weight with which a point stays in place, given its distance from the grabs: 0 up to `FREE_SHARE` of the reach, 1
/// from the reach on, smooth in between.
fn stays(distance: f32, reach: f64) -> f64 {
    if reach.is_infinite() {
        0.0
    } else {
        smooth((f64::from(distance) / reach - FREE_SHARE) / (1.0 - FREE_SHARE))
    }
}

/// Computes the share with which each group takes part in relaxation: 1 near the grabs, 0 beyond the reach. The share
/// of a cage vertex is the mean over the samples, weighted by how far the vertex moves them. `[n_groups]`
fn locality(pull: &Pull, follows: &[f64]) -> Vec<f64> {
    let shares = DVector::from_column_slice(&pull.probes.shares);
    let followed =
        DVector::from_iterator(follows.len(), follows.iter().zip(&pull.probes.shares).map(|(f, v)| f * v));
    let (part, whole) = (pull.sample_rows.tr_mul(&followed), pull.sample_rows.tr_mul(&shares));
    let of_cage = part.iter().zip(whole.iter()).map(|(part, whole)| part / whole.max(1e-12));
    follows.iter().copied().chain(of_cage).collect()
}

/// The coordinates of a cage as one vector: all x, then all y, then all z. `[3 n]`
pub(super) fn flat(cage: &[DVec3]) -> DVector<f64> {
    DVector::from_iterator(3 * cage.len(), (0..3).flat_map(|x| cage.iter().map(move |p| p[x])))
}

/// Smoothstep: 0 below 0, 1 above 1.
pub(super) fn smooth(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// `c^T B_r` for each group r: the covariance of the group's current edges with its references.
pub(super) fn group_matrices(moments: &[f64], cage: &DVector<f64>, n_groups: usize) -> Vec<DMat3> {
    let width = 3 * n_groups;
    let n = moments.len() / width;
    let mut sums = vec![0.0; 3 * width];
    for (x, sums) in sums.chunks_exact_mut(width).enumerate() {
        for (i, row) in moments.chunks_exact(width).enumerate() {
            let c = cage[x * n + i];
            sums.iter_mut().zip(row).for_each(|(sum, m)| *sum += c * m);
        }
    }
    let column = |r: usize, k: usize| DVec3::from_array([0, 1, 2].map(|x| sums[x * width + 3 * r + k]));
    (0..n_groups).map(|r| DMat3::from_cols(column(r, 0), column(r, 1), column(r, 2))).collect()
}
