//! Deformation gradients at the vertices of a surface.
//!
//! Stored normals can carry hard edges and artistic weighting, so exports do not recompute them. The cofactor matrix of
//! the gradient transforms normals, and the gradient transforms tangents.

use glam::{DMat3, DVec3, Vec3};

use cagework_core::mesh::weld;

use crate::origin::{origin_near, relative};

/// Gradients without the mean stretch whose determinant does not exceed this value, because they are singular or mirror,
/// are replaced by the identity. The value is also the diagonal term that regularises the least squares.
const MIN_DETERMINANT: f64 = 1e-9;

/// Weights of the pair of normals relative to all edges at a vertex, in the order in which they are tried. At a flat
/// vertex, the pair alone determines the gradient along the normal, whatever its weight. At a sharp vertex, the edges
/// determine it, and the pair contradicts them where the surface is stretched along its normal. Edges of a curved
/// surface that bends the other way can give a mirrored gradient; the larger weight prevents it.
const NORMAL_WEIGHTS: [f64; 2] = [1e-4, 1.0];

/// Coincident vertices whose normals have a smaller dot product belong to opposite sides of a thin sheet,
/// such as hair or a cape.
const MIN_FACING_COS: f64 = -0.5;

/// Limit on groups of vertices compared per position. Without it, n vertices that leave one point cost O(n²).
const MAX_GROUPS_AT_ONE_PLACE: usize = 64;

/// Largest sum of areas that counts as zero, as a fraction of the sum of their lengths.
const MAX_CANCELLED: f64 = 1e-6;

/// Triangles for estimating gradients by least squares over the edges at each vertex.
pub(crate) struct Surface {
    triangles: Vec<[u32; 3]>,
    /// Merged index of each vertex. Coincident vertices merge if their positions after the deformation also coincide
    /// and they are not on opposite sides of a sheet. `[n]`
    unique_of: Vec<u32>,
    n_unique: usize,
}

impl Surface {
    /// Groups coincident vertices. `from` and `to`: positions of the vertices before and after the deformation.
    /// `triangles`: indices of these vertices.
    pub(crate) fn new(from: &[DVec3], to: &[DVec3], triangles: Vec<[u32; 3]>) -> Self {
        let world: Vec<Vec3> = from.iter().map(|p| p.as_vec3()).collect();
        let origin = origin_near(&world);
        let places: Vec<Vec3> = from.iter().map(|&p| relative(p, origin)).collect();
        let welded = weld(&places);
        let (mut normals, mut sizes) = (vec![DVec3::ZERO; from.len()], vec![0.0_f64; from.len()]);
        for triangle in &triangles {
            let [a, b, c] = triangle.map(|v| from[v as usize]);
            let area = (b - a).cross(c - a);
            for &v in triangle {
                normals[v as usize] += area;
                sizes[v as usize] += area.length();
            }
        }
        for (normal, size) in normals.iter_mut().zip(sizes) {
            *normal = if cancels(*normal, size) { DVec3::ZERO } else { normal.normalize_or_zero() };
        }
        // For each position, the groups of merged vertices there: the first vertex and the index of each group.
        let mut at: Vec<Vec<(usize, u32)>> = vec![Vec::new(); welded.first.len()];
        let mut n_unique = 0;
        let mut unique_of = Vec::with_capacity(from.len());
        for (v, &place) in welded.unique_of.iter().enumerate() {
            let here = &mut at[place as usize];
            let is_same = |&&(first, _): &&(usize, u32)| {
                to[first] == to[v] && normals[first].dot(normals[v]) >= MIN_FACING_COS
            };
            let known = here.iter().take(MAX_GROUPS_AT_ONE_PLACE).find(is_same).map(|&(_, unique)| unique);
            if known.is_none() {
                here.push((v, n_unique));
                n_unique += 1;
            }
            unique_of.push(known.unwrap_or(n_unique - 1));
        }
        Self { triangles, unique_of, n_unique: n_unique as usize }
    }

    /// Computes the gradient of the map from `from` to `to` at each vertex: least squares over the edges at the vertex,
    /// and, with a small weight, over the normals before and after as one more pair of vectors. The ratio of their lengths
    /// is the mean stretch of the surface, the square root of the ratio of the areas around the vertex. `None` if no
    /// adjacent triangle has moved. `[n]`
    pub(crate) fn gradients(&self, from: &[DVec3], to: &[DVec3]) -> Vec<Option<DMat3>> {
        self.gradients_where(from, to, &vec![true; self.n_unique], &[])
    }

    /// Like [`Self::gradients`], for a state that differs only at the vertices `changed` from a state whose gradients
    /// are `others`.
    pub(crate) fn gradients_near(
        &self,
        from: &[DVec3],
        to: &[DVec3],
        changed: &[u32],
        others: &[Option<DMat3>],
    ) -> Vec<Option<DMat3>> {
        let mut has_changed = vec![false; self.n_unique];
        changed.iter().for_each(|&v| has_changed[self.unique_of[v as usize] as usize] = true);
        let mut is_near = has_changed.clone();
        let unique = |v: &u32| self.unique_of[*v as usize] as usize;
        for triangle in self.triangles.iter().filter(|t| t.iter().any(|v| has_changed[unique(v)])) {
            triangle.iter().for_each(|v| is_near[unique(v)] = true);
        }
        self.gradients_where(from, to, &is_near, others)
    }

    fn gradients_where(
        &self,
        from: &[DVec3],
        to: &[DVec3],
        is_wanted: &[bool],
        others: &[Option<DMat3>],
    ) -> Vec<Option<DMat3>> {
        let mut normals = vec![[DVec3::ZERO; 2]; self.n_unique];
        // The same sums with each triangle turned over that faces away from the sum of the previous ones.
        let mut aligned = normals.clone();
        let mut sizes = vec![[0.0_f64; 2]; self.n_unique];
        let mut sums = vec![(DMat3::ZERO, DMat3::ZERO, 0.0_f64); self.n_unique];
        let mut moved = vec![false; self.n_unique];
        for triangle in &self.triangles {
            let corners = triangle.map(|v| v as usize);
            if !corners.iter().any(|&v| is_wanted[self.unique_of[v] as usize]) {
                continue;
            }
            let [p, q] = [from, to].map(|at| corners.map(|v| at[v]));
            let areas = [p, q].map(|[a, b, c]| (b - a).cross(c - a));
            let has_moved = corners.iter().any(|&v| from[v] != to[v]);
            for k in 0..3 {
                let unique = self.unique_of[corners[k]] as usize;
                moved[unique] |= has_moved;
                let sign = if areas[0].dot(aligned[unique][0]) < 0.0 { -1.0 } else { 1.0 };
                for (k, area) in areas.into_iter().enumerate() {
                    normals[unique][k] += area;
                    aligned[unique][k] += sign * area;
                    sizes[unique][k] += area.length();
                }
                let (both, one, length) = &mut sums[unique];
                for other in [(k + 1) % 3, (k + 2) % 3] {
                    let [e, f] = [p, q].map(|at| at[other] - at[k]);
                    *both += outer(f, e);
                    *one += outer(e, e);
                    *length += e.length_squared();
                }
            }
        }
        let gradients: Vec<Option<DMat3>> = (0..self.n_unique)
            .map(|v| {
                if !is_wanted[v] {
                    return None;
                }
                let (both, one, length) = sums[v];
                let is_doubled = cancels(normals[v][0], sizes[v][0]);
                let normals = if is_doubled { aligned[v] } else { normals[v] };
                let [n, m] = normals.map(DVec3::normalize_or_zero);
                let stretch = (sizes[v][1] / sizes[v][0]).sqrt();
                let stretch = if stretch.is_finite() && stretch > 0.0 { stretch } else { 1.0 };
                let scale = 1.0 / length.max(1e-30);
                let one = scale * one + DMat3::from_diagonal(DVec3::splat(MIN_DETERMINANT));
                // The gradient without the mean stretch, so that the threshold holds for all scales.
                let with = |weight: f64| {
                    (scale / stretch * both + weight * outer(m, n)) * (one + weight * outer(n, n)).inverse()
                };
                let mut tried = NORMAL_WEIGHTS.into_iter().map(with);
                let found = tried.find(|gradient| gradient.determinant() > MIN_DETERMINANT);
                moved[v].then_some(stretch * found.unwrap_or(DMat3::IDENTITY))
            })
            .collect();
        let of = |(v, &unique): (usize, &u32)| {
            let unique = unique as usize;
            if is_wanted[unique] { gradients[unique] } else { others[v] }
        };
        self.unique_of.iter().enumerate().map(of).collect()
    }

    /// Replaces each unknown value by the mean of the known values at adjacent vertices, or by zero if there are none.
    pub(crate) fn fill_from_neighbours(&self, values: &mut [DVec3], is_known: &[bool]) {
        let mut sums = vec![(DVec3::ZERO, 0.0); values.len()];
        for triangle in &self.triangles {
            for &v in triangle {
                for &other in triangle.iter().filter(|&&other| is_known[other as usize]) {
                    sums[v as usize].0 += values[other as usize];
                    sums[v as usize].1 += 1.0;
                }
            }
        }
        for ((value, known), (sum, n)) in values.iter_mut().zip(is_known).zip(sums) {
            if !known {
                *value = if n > 0.0 { sum / n } else { DVec3::ZERO };
            }
        }
    }
}

/// Computes the gradient of the map from `from` to `to` at each vertex ([`Surface::gradients`]). `[n_vertices]`
pub(crate) fn gradients(from: &[Vec3], to: &[Vec3], triangles: Vec<[u32; 3]>) -> Vec<Option<DMat3>> {
    let [from, to] = [from, to].map(|all| all.iter().map(|p| p.as_dvec3()).collect::<Vec<_>>());
    Surface::new(&from, &to, triangles).gradients(&from, &to)
}

/// Transforms a unit normal; without a gradient, it stays unchanged.
pub(crate) fn turned_normal(gradient: Option<DMat3>, normal: Vec3) -> Vec3 {
    gradient.map_or(normal, |g| (cofactor(g) * normal.as_dvec3()).normalize_or(normal.as_dvec3()).as_vec3())
}

/// Whether a sum of areas is only rounding, because every face has a copy that faces the other way. `size`: sum of the
/// lengths.
fn cancels(sum: DVec3, size: f64) -> bool {
    sum.length() <= MAX_CANCELLED * size
}

fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(b.x * a, b.y * a, b.z * a)
}

/// Cofactor matrix, which transforms normals; negated for mirroring maps, so that normals point outwards.
pub(crate) fn cofactor(m: DMat3) -> DMat3 {
    let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    sign * DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis))
}

/// Computes the nearest rotation by Newton's iteration for the polar decomposition; `None` if the matrix is singular or
/// mirrors. See Higham and Noferini (2016).
pub(crate) fn rotation(m: DMat3) -> Option<DMat3> {
    let mut turn = m * (1.0 / m.determinant().abs().cbrt());
    for _ in 0..30 {
        let next = 0.5 * (turn + turn.inverse().transpose());
        let change = (next - turn).to_cols_array().into_iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        turn = next;
        if change < 1e-14 {
            break;
        }
    }
    (turn.is_finite() && turn.determinant() > 0.0).then_some(turn)
}
