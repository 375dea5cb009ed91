//! Gaussian splats (Kerbl et al. 2023, "3D Gaussian Splatting for Real-Time Radiance Field Rendering") and their
//! deformation by a [`Field`]: the centre moves by u, the covariance becomes F S F^T, and the spherical harmonics turn
//! with the rotation in F.

mod harmonics;
mod outline;
mod sorted;
mod split;
mod stand_in;

use glam::{IVec3, Mat3, Quat, Vec3};

use crate::field::Field;
use crate::mesh::Bounds;
use crate::rotation::nearest_rotation;
use crate::team::map_indices;

pub use harmonics::{MAX_DEGREE, harmonic_basis, n_harmonics, rotate_harmonics};
pub use outline::{Outline, outlines};
pub use sorted::{SortedSplats, deform_splats};
pub use split::SplitSplats;

/// Length of a splat's half axis at which the error of its first-order deformation is measured, standard deviations: a
/// uniform distribution along an axis of this half length has the same variance as the Gaussian.
const AXIS_SIGMAS: f32 = 1.732_050_8;
/// Error of the first-order deformation above which a splat counts as inexact, as a fraction of its half axis.
pub const MAX_FIRST_ORDER_ERROR: f32 = 0.1;
/// Half diagonal of the octahedra that represent splats for cage generation, standard deviations.
const SHELL_SIGMAS: f32 = 1.5;
/// Opacity below which a splat does not belong to the captured object.
const MIN_SHELL_OPACITY: f32 = 0.1;
/// Share of the splats, from the largest down, that do not belong to the captured object.
const LARGEST_SHARE: f64 = 0.01;

/// Number of grid cells along the longest side of a capture. Of the splats smaller than a cell, only the largest in
/// each cell gets an octahedron. A cell is 0.3 times as long as a voxel in the generation of a cage of 80 vertices,
/// which does not resolve smaller splats.
const SHELL_CELLS: f32 = 128.0;

/// Gaussian splats. All arrays have one entry per splat, unless stated otherwise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Splats {
    /// Centres, object units.
    pub positions: Vec<Vec3>,
    /// Standard deviations along the three axes, object units, not negative.
    pub scales: Vec<Vec3>,
    /// Rotations of the axes, unit quaternions.
    pub rotations: Vec<Quat>,
    /// Opacities at the centre, 0 to 1.
    pub opacities: Vec<f32>,
    /// Colours without spherical harmonics, sRGB; 0 to 1 is displayable.
    pub colors: Vec<Vec3>,
    /// Degree of the spherical harmonics, 0 to [`MAX_DEGREE`].
    pub degree: u8,
    /// Red, green and blue coefficients of bands 1 to `degree`, in the order of [`harmonic_basis`].
    /// `[n_splats, n_harmonics(degree)]`
    pub harmonics: Vec<Vec3>,
}

/// Positions and covariances of splats, as they are drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SplatPose {
    /// Centres, object units.
    pub positions: Vec<Vec3>,
    /// xx, xy, xz, yy, yz and zz of the covariance matrix, square object units.
    pub covariances: Vec<[f32; 6]>,
}

impl Splats {
    /// Memory of a splat with spherical harmonics of a degree, bytes.
    #[must_use]
    pub fn bytes_per_splat(degree: u8) -> u64 {
        (size_of::<[Vec3; 3]>() + size_of::<Quat>() + size_of::<f32>()) as u64
            + (n_harmonics(degree) * size_of::<Vec3>()) as u64
    }

    /// Number of splats.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there are no splats.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Axes of a splat: columns with the lengths of the standard deviations.
    #[must_use]
    pub fn axes(&self, splat: usize) -> Mat3 {
        Mat3::from_quat(self.rotations[splat]) * Mat3::from_diagonal(self.scales[splat])
    }

    /// Spherical harmonics of a splat, bands 1 to `degree`.
    #[must_use]
    pub fn harmonics_of(&self, splat: usize) -> &[Vec3] {
        let n = n_harmonics(self.degree);
        &self.harmonics[splat * n..][..n]
    }

    /// Positions and covariances at rest.
    #[must_use]
    pub fn rest_pose(&self) -> SplatPose {
        let covariances = map_indices(self.len(), |splat| splat_covariance(self.axes(splat)));
        SplatPose { positions: self.positions.clone(), covariances }
    }

    /// The splats after a rotation about the origin.
    #[must_use]
    pub fn rotated(&self, by: Quat) -> Self {
        let matrix = Mat3::from_quat(by);
        let mut turned = self.clone();
        turned.positions.iter_mut().for_each(|p| *p = matrix * *p);
        turned.rotations.iter_mut().for_each(|q| *q = (by * *q).normalize());
        if self.degree > 0 {
            for of_splat in turned.harmonics.chunks_mut(n_harmonics(self.degree)) {
                rotate_harmonics(matrix, of_splat);
            }
        }
        turned
    }

    /// The splats after the deformation, in the form that files store. Scales, rotations and harmonics of splats at
    /// which the gradient of the field is the identity stay identical to the last bit.
    #[must_use]
    pub fn deformed(&self, field: &Field) -> Self {
        struct DeformedSplat {
            position: Vec3,
            shape: Option<(Vec3, Quat, Mat3)>,
        }
        let of_splat = |splat: usize| {
            let (position, gradient) = (self.positions[splat], field.gradient(self.positions[splat]));
            let shape = (gradient != Mat3::IDENTITY).then(|| {
                let (scale, rotation) = decompose(gradient * self.axes(splat));
                let turn = if self.degree > 0 { turn_of(gradient) } else { Mat3::IDENTITY };
                (scale, rotation, turn)
            });
            DeformedSplat { position: position + field.displacement(position), shape }
        };
        let mut deformed = self.clone();
        let n = n_harmonics(self.degree);
        for (splat, bent) in map_indices(self.len(), of_splat).into_iter().enumerate() {
            deformed.positions[splat] = bent.position;
            if let Some((scale, rotation, turn)) = bent.shape {
                (deformed.scales[splat], deformed.rotations[splat]) = (scale, rotation);
                rotate_harmonics(turn, &mut deformed.harmonics[splat * n..][..n]);
            }
        }
        deformed
    }

    /// Error of the first-order deformation of each splat, as a fraction of its longest half axis: the distance between
    /// the true and the linear image of an end of this axis. The larger of the errors of the two ends counts.
    #[must_use]
    pub fn first_order_errors(&self, field: &Field) -> Vec<f32> {
        map_indices(self.len(), |splat| {
            let (center, axes) = (self.positions[splat], self.axes(splat));
            let squared = |a: &Vec3| a.length_squared();
            let longest = [axes.x_axis, axes.y_axis, axes.z_axis]
                .into_iter()
                .max_by(|a, b| squared(a).total_cmp(&squared(b)))
                .unwrap_or_default();
            let half = AXIS_SIGMAS * longest;
            let linear = field.gradient(center) * half;
            let u = field.displacement(center);
            let error =
                |side: f32| (field.displacement(center + side * half) - u + side * (half - linear)).length();
            if half == Vec3::ZERO { 0.0 } else { error(1.0).max(error(-1.0)) / half.length() }
        })
    }

    /// Number of splats whose first-order error exceeds [`MAX_FIRST_ORDER_ERROR`].
    #[must_use]
    pub fn n_inexact(&self, field: &Field) -> usize {
        self.first_order_errors(field).into_iter().filter(|&error| error > MAX_FIRST_ORDER_ERROR).count()
    }

    /// Returns a triangle soup of octahedra that represent the splats, from which a cage can be generated. Leaves out
    /// transparent splats and the largest ones, unless no splat remains: captures contain haze and background. Of the
    /// small splats in a cell of a grid, only the largest gets an octahedron.
    #[must_use]
    pub fn shells(&self) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let mut sizes: Vec<f32> = self.scales.iter().map(|s| s.max_element()).collect();
        let last = sizes.len().saturating_sub(1);
        let rank = ((1.0 - LARGEST_SHARE) * last as f64).ceil() as usize;
        let largest =
            if sizes.is_empty() { 0.0 } else { *sizes.select_nth_unstable_by(rank, f32::total_cmp).1 };
        let solid =
            |&s: &usize| self.opacities[s] >= MIN_SHELL_OPACITY && self.scales[s].max_element() <= largest;
        let mut kept: Vec<usize> = (0..self.len()).filter(solid).collect();
        if kept.is_empty() {
            kept = (0..self.len()).collect();
        }
        self.thin_out(&mut kept);
        let corners = |&splat: &usize| octahedron(self.positions[splat], SHELL_SIGMAS * self.axes(splat));
        (kept.iter().flat_map(corners).collect(), octahedra(kept.len()))
    }
}

impl Splats {
    /// Creates round splats that show a point cloud. Their size is proportional to the distance between neighbouring
    /// points on a surface. `colors`: sRGB, one per point.
    #[must_use]
    pub fn of_points(points: &[Vec3], colors: Vec<Vec3>) -> Self {
        /// Standard deviation, as a fraction of the distance between neighbours.
        const RADIUS: f32 = 0.6;
        /// Opacity: the splats are opaque, apart from their soft edge.
        const OPACITY: f32 = 0.95;
        let OccupiedCells { size, cells, .. } = OccupiedCells::by(points);
        let n = points.len();
        let radius = RADIUS * size * (cells.len() as f32 / n.max(1) as f32).sqrt();
        Self {
            positions: points.to_vec(),
            scales: vec![Vec3::splat(radius); n],
            rotations: vec![Quat::IDENTITY; n],
            opacities: vec![OPACITY; n],
            colors,
            ..Self::default()
        }
    }

    /// Drops splats whose octahedron is smaller than a cell of a grid, except the largest one in each cell, because the
    /// time to generate a cage is proportional to the number of triangles.
    fn thin_out(&self, kept: &mut Vec<usize>) {
        let centers: Vec<Vec3> = kept.iter().map(|&s| self.positions[s]).collect();
        let longest = Bounds::around(&centers).map_or(0.0, |bounds| bounds.extent().max_element());
        let size = longest / SHELL_CELLS;
        let cell = |s: usize| (self.positions[s] / size).floor().as_ivec3().to_array();
        let extent = |s: usize| SHELL_SIGMAS * self.scales[s].max_element();
        kept.sort_by_cached_key(|&s| (cell(s), std::cmp::Reverse(extent(s).to_bits())));
        let mut last = None;
        kept.retain(|&s| {
            let is_first = last.replace(cell(s)) != Some(cell(s));
            is_first || extent(s) > size
        });
        kept.sort_unstable();
    }
}

/// Orthogonal matrix that turns the spherical harmonics of a splat in a deformation with this gradient: the orthogonal
/// factor of its polar decomposition. Where the deformation mirrors, it is a rotation times -1, so that colours are seen
/// from mirrored directions.
#[must_use]
pub fn turn_of(gradient: Mat3) -> Mat3 {
    let gradient = gradient.as_dmat3();
    let sign = if gradient.determinant() < 0.0 { -1.0 } else { 1.0 };
    (sign * nearest_rotation(sign * gradient)).as_mat3()
}

/// Colour, sRGB, of a splat that is seen along a unit vector from the eye, in the axes of its spherical harmonics.
#[must_use]
pub fn color_along(color: Vec3, harmonics: &[Vec3], direction: Vec3) -> Vec3 {
    color + harmonic_basis(direction).iter().zip(harmonics).map(|(&y, &c)| y * c).sum::<Vec3>()
}

/// Octahedra around the centres of all cells of a grid that contain points: the shells of a point cloud.
#[must_use]
pub fn shells_of_points(points: &[Vec3]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    /// Half diagonal of an octahedron that covers a cell, in cells.
    const REACH: f32 = 1.5;
    let OccupiedCells { min, size, cells } = OccupiedCells::by(points);
    let center = |cell: &[i32; 3]| min + size * (IVec3::from_array(*cell).as_vec3() + 0.5);
    let of_cell = |cell: &[i32; 3]| octahedron(center(cell), Mat3::from_diagonal(Vec3::splat(REACH * size)));
    (cells.iter().flat_map(of_cell).collect(), octahedra(cells.len()))
}

/// Cells of a grid that contain points. The grid is the finest of several grids in which an occupied cell has at least
/// six occupied neighbours on average, as on a sampled surface, or else the coarsest.
#[derive(Default)]
struct OccupiedCells {
    /// Lowest corner of cell (0, 0, 0), object units.
    min: Vec3,
    /// Edge length of a cell, object units.
    size: f32,
    cells: Vec<[i32; 3]>,
}

impl OccupiedCells {
    /// Numbers of cells along the longest side of the points' box, in the order in which they are tried.
    const CELLS: [f32; 4] = [128.0, 64.0, 32.0, 16.0];

    fn by(points: &[Vec3]) -> Self {
        let Some(bounds) = Bounds::around(points) else { return Self::default() };
        let longest = bounds.extent().max_element();
        for cells in Self::CELLS {
            let size = (longest / cells).max(f32::MIN_POSITIVE);
            let mut occupied: Vec<[i32; 3]> =
                points.iter().map(|&p| ((p - bounds.min) / size).floor().as_ivec3().to_array()).collect();
            occupied.sort_unstable();
            occupied.dedup();
            let is_neighbour = |&[x, y, z]: &[i32; 3], k: i32| {
                let other = [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1];
                occupied.binary_search(&other).is_ok()
            };
            let neighbours = |cell: &[i32; 3]| (0..27).filter(|&k| k != 13 && is_neighbour(cell, k)).count();
            let total: usize = occupied.iter().map(neighbours).sum();
            if total >= 6 * occupied.len() || cells == Self::CELLS[Self::CELLS.len() - 1] {
                return Self { min: bounds.min, size, cells: occupied };
            }
        }
        Self::default()
    }
}

/// Corners of an octahedron with the given half diagonals.
fn octahedron(center: Vec3, half: Mat3) -> [Vec3; 6] {
    let [x, y, z] = half.to_cols_array_2d().map(Vec3::from_array);
    [x, -x, y, -y, z, -z].map(|half| center + half)
}

/// Faces of `n` octahedra.
fn octahedra(n: usize) -> Vec<[u32; 3]> {
    const FACES: [[u32; 3]; 8] =
        [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    (0..n as u32).flat_map(|k| FACES.map(|face| face.map(|corner| 6 * k + corner))).collect()
}

/// Covariance matrix A A^T of a splat with axes A: xx, xy, xz, yy, yz, zz.
#[must_use]
pub fn splat_covariance(axes: Mat3) -> [f32; 6] {
    let Mat3 { x_axis, y_axis, z_axis } = axes * axes.transpose();
    [x_axis.x, x_axis.y, x_axis.z, y_axis.y, y_axis.z, z_axis.z]
}

/// Scales and rotation of the splat with the covariance A A^T.
///
/// These are the singular values and left singular vectors of A, by one-sided Jacobi rotations of its columns (Hestenes
/// 1958). A A^T is not computed, so that thin splats keep the digits of their smallest scale, and the axes keep their
/// order.
#[must_use]
pub fn decompose(axes: Mat3) -> (Vec3, Quat) {
    /// Largest number of sweeps; three or four suffice.
    const SWEEPS: usize = 8;
    /// Largest cosine between two columns that count as orthogonal: f32 rounding.
    const MAX_COLUMN_COSINE: f32 = 1e-7;
    let largest = axes.to_cols_array().iter().fold(0.0_f32, |a, x| a.max(x.abs()));
    if largest == 0.0 || !largest.is_finite() {
        return (Vec3::ZERO, Quat::IDENTITY);
    }
    let mut columns = (axes * largest.recip()).to_cols_array_2d().map(Vec3::from_array);
    for _ in 0..SWEEPS {
        let mut is_done = true;
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            let (a, b) = (columns[i], columns[j]);
            let (aa, bb, ab) = (a.length_squared(), b.length_squared(), a.dot(b));
            if ab.abs() <= MAX_COLUMN_COSINE * (aa * bb).sqrt() {
                continue;
            }
            is_done = false;
            let half_cotangent = (bb - aa) / (2.0 * ab);
            let tangent = half_cotangent.signum() / (half_cotangent.abs() + half_cotangent.hypot(1.0));
            let cos = tangent.mul_add(tangent, 1.0).sqrt().recip();
            let sin = cos * tangent;
            (columns[i], columns[j]) = (cos * a - sin * b, sin * a + cos * b);
        }
        if is_done {
            break;
        }
    }
    let scales = Vec3::from_array(columns.map(Vec3::length));
    // The two longest columns define the rotation; the third axis is their cross product, which is defined even for a
    // flat splat.
    let third = scales.min_position();
    let [first, second] = [(third + 1) % 3, (third + 2) % 3];
    let (long, short) = if scales[first] >= scales[second] { (first, second) } else { (second, first) };
    let u = columns[long].normalize();
    let v = (columns[short] - u * u.dot(columns[short]))
        .try_normalize()
        .unwrap_or_else(|| u.any_orthonormal_vector());
    let mut unit = [Vec3::ZERO; 3];
    (unit[long], unit[short]) = (u, v);
    unit[third] = unit[first].cross(unit[second]);
    let rotation = Quat::from_mat3(&Mat3::from_cols(unit[0], unit[1], unit[2])).normalize();
    (scales * largest, rotation)
}

#[cfg(test)]
mod tests;
