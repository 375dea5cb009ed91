//! A frame of a drag: alternates rotations of the groups (local step) with a solve for the cage (global step).

use glam::{DMat3, DQuat, DVec3};
use nalgebra::{DMatrix, DVector};

use super::drag::{Drag, group_matrices, smooth};
use crate::symmetry::Symmetry;
use cagework_core::rotation::nearest_rotation;

/// Limit on the frames that [`Drag::settle`] runs.
const MAX_SETTLING_FRAMES: u32 = 60;
/// Local-global steps per frame.
const STEPS_PER_FRAME: usize = 4;
/// A target counts as changed if it moves by more than this, as a fraction of the model's size.
const MIN_TARGET_MOVE: f64 = 1e-9;
/// A point whose weights sum to less than this stays in place, so a shift of the whole cage cannot move it.
const MIN_SHARE: f64 = 1e-3;
/// Length of a drag, as a fraction of the model's size, at which relaxation is complete.
const RELAX_LENGTH: f64 = 0.1;

/// Rotation of the grabs, in radians, above which [`Drag::frame`] and [`Drag::go`] move them on arcs. On straight
/// paths, grabs that make a half turn would meet in one point.
const MIN_ARC_ANGLE: f64 = 0.5;
/// Multiple of the identity that is added to the grabs' covariance, as a fraction of the covariance's trace. It
/// prevents rotations that the grabs do not determine, such as the rotation of two grabs about the line between them.
const IDENTITY_WEIGHT: f64 = 1e-3;

impl Drag {
    /// Like [`Self::frame`]. For a drag of one grab and its mirror image, the target of the image may be omitted.
    pub fn frame_with_image(&mut self, to: &[DVec3]) {
        match (to, &*self.start) {
            // The image moves by the reflected displacement of the grab.
            (&[to], &[first, image]) => {
                self.frame(&[to, image + (to - first) * DVec3::new(-1.0, 1.0, 1.0)]);
            }
            _ => self.frame(to),
        }
    }

    /// Runs one frame with the grabs at `to` (`[n_grabs]`, object units). If the grabs rotate together by more than 0.5
    /// radians, runs intermediate frames first. Ignores targets that are not finite, so the pose stays finite.
    pub fn frame(&mut self, to: &[DVec3]) {
        if to.len() != self.start.len() || !to.iter().all(|t| t.is_finite()) {
            return;
        }
        if self.is_shift {
            // A shift of the cage moves the point by this share of the shift.
            let share = self.handles.row(0).sum();
            if share < MIN_SHARE {
                return;
            }
            let place = self.places();
            for (x, target) in to[0].to_array().into_iter().enumerate() {
                let mut column = self.cage.rows_mut(x * self.n, self.n);
                column.add_scalar_mut((target - place[(0, x)]) / share);
            }
            self.targets.set_row(0, &nalgebra::RowVector3::from(to[0].to_array()));
            return;
        }
        let from: Vec<DVec3> = (0..to.len()).map(|h| self.target(h)).collect();
        let way = GrabPath::new(&from, to);
        let n = (way.angle() / MIN_ARC_ANGLE).ceil().max(1.0);
        for k in 1..n as u32 {
            self.frame_straight(&way.at(f64::from(k) / n));
        }
        self.frame_straight(to);
    }

    fn frame_straight(&mut self, to: &[DVec3]) {
        self.set_targets(to);
        for _ in 0..STEPS_PER_FRAME {
            let image = self.step();
            if image.iter().any(|x| !x.is_finite()) {
                self.anderson.forget();
                return;
            }
            self.moved = (&image - &self.cage).amax() / self.size;
            let mut next = self.anderson.next(&self.cage, image);
            if let Some(symmetry) = &self.mirror {
                average(&mut next, symmetry);
            }
            self.cage = next;
        }
    }

    /// Moves the grabs from the start to `to` (`[n_grabs]`, object units) in `frames` frames. Paths are straight, or
    /// arcs if the grabs rotate together by more than 0.5 radians.
    pub fn go(&mut self, to: &[DVec3], frames: u32) {
        if to.len() != self.start.len() || !to.iter().all(|t| t.is_finite()) {
            return;
        }
        let start = self.start.clone();
        let way = GrabPath::new(&start, to);
        for k in 1..=frames {
            self.frame(&way.at(f64::from(k) / f64::from(frames)));
        }
    }

    /// Runs frames with the grabs at `to` until the cage settles, at most 60. Returns the number of frames.
    pub fn converge(&mut self, to: &[DVec3]) -> u32 {
        let mut frames = 0;
        while frames == 0 || frames < MAX_SETTLING_FRAMES && !self.is_settled() {
            self.frame(to);
            frames += 1;
        }
        frames
    }

    fn target(&self, h: usize) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|x| self.targets[(h, x)]))
    }

    fn set_targets(&mut self, to: &[DVec3]) {
        let is_same =
            |h: usize| (0..3).all(|x| (self.targets[(h, x)] - to[h][x]).abs() <= MIN_TARGET_MOVE * self.size);
        if (0..to.len()).all(is_same) {
            return;
        }
        for (h, target) in to.iter().enumerate() {
            (0..3).for_each(|x| self.targets[(h, x)] = target[x]);
        }
        // New targets change the map that is iterated, so the history of iterates no longer applies.
        self.anderson.forget();
        let drag = to.iter().zip(&self.start).map(|(to, from)| to.distance(*from)).fold(0.0, f64::max);
        let relax = self.relax * smooth(drag / (RELAX_LENGTH * self.size));
        let parts = self.posed.iter().zip(&self.relaxing);
        self.moments.iter_mut().zip(parts).for_each(|(m, (posed, more))| *m = posed + relax * more);
    }

    /// Runs one local step (rotations of the groups) and one global step (the cage that best fits these rotations).
    fn step(&self) -> DVector<f64> {
        let right = turned(&self.moments, &self.cage, self.n_groups) + &self.constant;
        let free = &self.inverse * right;
        let pulled = &self.targets - self.nonlinear_part() - &self.handles * &free;
        let fitted = free + &self.spread * (&self.hold * pulled);
        DVector::from_column_slice(fitted.as_slice())
    }
}

/// Paths of the grabs: a common rigid motion, plus the remaining displacement of each grab, which grows linearly along
/// the path.
struct GrabPath<'a> {
    from: &'a [DVec3],
    to: &'a [DVec3],
    /// Means of `from` and `to`, and the rotation that best maps `from` to `to`, each relative to its mean.
    middles: [DVec3; 2],
    turn: DQuat,
}

impl<'a> GrabPath<'a> {
    fn new(from: &'a [DVec3], to: &'a [DVec3]) -> Self {
        let middles = [from, to].map(|places| places.iter().sum::<DVec3>() / places.len() as f64);
        let pairs = || from.iter().zip(to).map(|(a, b)| (*a - middles[0], *b - middles[1]));
        let size: f64 = pairs().map(|(a, b)| a.length() * b.length()).sum();
        let of_pair = |(a, b): (DVec3, DVec3)| DMat3::from_cols(b * a.x, b * a.y, b * a.z);
        let covariance = pairs()
            .map(of_pair)
            .fold(DMat3::from_diagonal(DVec3::splat(IDENTITY_WEIGHT * size)), |m, p| m + p);
        Self { from, to, middles, turn: DQuat::from_mat3(&nearest_rotation(covariance)) }
    }

    fn angle(&self) -> f64 {
        self.turn.angle_between(DQuat::IDENTITY)
    }

    /// Returns the grab positions at a share of the path, 0 to 1.
    fn at(&self, share: f64) -> Vec<DVec3> {
        let straight = |(a, b): (&DVec3, &DVec3)| a.lerp(*b, share);
        if self.angle() <= MIN_ARC_ANGLE {
            return self.from.iter().zip(self.to).map(straight).collect();
        }
        let (part, [first, last]) = (DQuat::IDENTITY.slerp(self.turn, share), self.middles);
        let arc = |(a, b): (&DVec3, &DVec3)| {
            let (arm, off) = (*a - first, *b - last - self.turn * (*a - first));
            first.lerp(last, share) + part * arm + share * off
        };
        self.from.iter().zip(self.to).map(arc).collect()
    }
}

/// `sum_r B_r R_r^T`, where R_r is the rotation nearest to the covariance of group r for `cage`. `[n, 3]`
pub(super) fn turned(moments: &[f64], cage: &DVector<f64>, n_groups: usize) -> DMatrix<f64> {
    let width = 3 * n_groups;
    let mut turned = vec![0.0; 3 * width];
    for (r, matrix) in group_matrices(moments, cage, n_groups).into_iter().enumerate() {
        let rotation = nearest_rotation(matrix);
        for x in 0..3 {
            turned[x * width + 3 * r..][..3].copy_from_slice(&rotation.row(x).to_array());
        }
    }
    let rows: Vec<&[f64]> = moments.chunks_exact(width).collect();
    DMatrix::from_fn(rows.len(), 3, |i, x| dot(rows[i], &turned[x * width..][..width]))
}

/// Computes a dot product as eight partial sums, which the compiler vectorises.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        (0..8).for_each(|k| sums[k] += a[k] * b[k]);
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// Averages the cage with its mirror image.
fn average(cage: &mut DVector<f64>, symmetry: &Symmetry) {
    let (n, plane) = (cage.len() / 3, f64::from(symmetry.plane()));
    let before = cage.clone();
    for i in 0..n {
        let Some(p) = symmetry.partner(i as u32).map(|p| p as usize) else { continue };
        cage[i] = 0.5 * (before[i] + 2.0 * plane - before[p]);
        for x in 1..3 {
            cage[x * n + i] = 0.5 * (before[x * n + i] + before[x * n + p]);
        }
    }
}
