//! Gaps between parts of a model, represented by sheets of outside voxels halfway between two facing walls. A gap stays
//! open if the cage does not cross its sheet.

use glam::{DVec3, Vec3};

use super::lattice::{Lattice, MARGIN_VOXELS};
use super::soup::Soup;
use super::voxels::Voxels;
use super::{CageOptions, MAX_VOXELS};
use cagework_core::cage::Cage;
use cagework_core::geometry::winding_number;
use cagework_core::progress::Cancellation;
use cagework_core::words::decimals;

/// Largest allowed cosine of the angle between the directions from a sheet to its two walls. Creases whose walls open
/// by more than 60 degrees are therefore not gaps.
const MAX_WALL_COSINE: f64 = -0.5;

/// Smallest allowed distance of a sheet from the crease where its walls meet, as a multiple of the distance between the
/// walls.
const MIN_DEPTH: f64 = 1.0;

/// Smallest width, in voxels, of a gap that a hull always leaves open. Most gaps need only three voxels; a gap at the
/// mirror plane needs four, because the plane lies between two voxels.
const MIN_OPEN_WIDTH: f64 = 4.0;

/// Smallest area of a gap for which the lattice is refined, as a fraction of the squared longest side of the model.
pub(super) const MIN_GAP_AREA: f64 = 0.003;

/// Aspect ratios of a voxel: length divided by thickness across narrow gaps. The second is used if the first would need
/// a resolution above [`MAX_RESOLUTION`].
const STRETCHES: [f64; 2] = [3.0, 8.0];

/// Largest resolution for the first of [`STRETCHES`]. The resolution is the model's longest side divided by the
/// thickness of a voxel.
const MAX_RESOLUTION: f64 = 250.0;

/// Smallest width of the narrow part of a gap that a hull leaves open, in thicknesses of a stretched voxel. Six is too
/// small: the hull of a figure in the tests then bridges a gap.
const MIN_OPEN_NARROW_WIDTH: f64 = 7.0;

/// Share of a gap's sheet that counts as the narrow part.
const NARROW_SHARE: f64 = 0.1;

/// A gap counts as lying across the thin axis of a stretched lattice if the mean `cos^2` between this axis and the
/// vectors from wall to wall exceeds this.
const MIN_ACROSS_COSINE_SQUARED: f64 = 0.7;

/// If cubes leave as many gaps open as stretched voxels, voxels are stretched only if the number of cubes along the
/// longest side would exceed this factor times [`super::first_voxels`].
const MIN_REFINEMENT: f64 = 2.0;

/// Two limits on the number of voxels along the longest side of a stretched lattice: this fraction of [`MAX_VOXELS`],
/// and, if a lattice of cubes leaves as many gaps open, this fraction of the cubes along its longest side.
const MAX_STRETCHED_SHARE: f64 = 0.66;

/// Number of sample points of a sheet at which a cage is tested for closing the gap.
const SAMPLES: usize = 32;

/// Marks a voxel that has no solid voxel within the search distance.
const NO_WALL: u32 = u32::MAX;

#[derive(Clone, Debug)]
pub(super) struct Gap {
    pub(super) voxels: Vec<[usize; 3]>,
    /// Area of the sheet, voxels squared.
    pub(super) area: f64,
    /// Mean distance between the gap's two walls, voxels.
    width: f64,
    /// Distance between the two walls where the sheet is narrow, voxels: the quantile [`NARROW_SHARE`] of the distances
    /// over the sheet.
    narrow_width: f64,
    /// Mean squared components of the unit vectors between the walls.
    across: DVec3,
}

/// A large gap of the model.
#[derive(Clone, Debug)]
pub(super) struct ModelGap {
    /// Sample points of the gap's sheet, object units.
    points: Vec<Vec3>,
    /// Mean distance between the walls, object units.
    width: f64,
    /// Mean squared components of the unit vectors between the walls.
    across: DVec3,
    /// Smallest number of cubic voxels along the model's longest side with which the gap stays open.
    least_voxels: f64,
    /// Smallest number of voxels of the chosen lattice along the model's longest side with which the gap stays open.
    pub(super) voxels: usize,
}

/// Narrow gaps of a model, and a lattice that resolves them.
#[derive(Debug)]
pub(super) struct NarrowGaps {
    pub(super) gaps: Vec<ModelGap>,
    /// Longest edge of a voxel divided by its edge along each axis.
    pub(super) stretch: DVec3,
    /// Number of voxels along the model's longest side.
    pub(super) voxels: usize,
}

/// Finds the large gaps that a lattice with `base` voxels along the model's longest side closes or nearly closes, and a
/// lattice that leaves them open. With more than `most` gaps, the lattice has `base` cubic voxels instead. Gaps
/// narrower than twice the `clearance` of the cage from the model (object units) are left out, because they close on
/// any lattice.
///
/// # Errors
/// If `go_on` cancels.
pub(super) fn narrow_gaps(
    soup: &Soup<'_>,
    bounds: [DVec3; 2],
    clearance: f64,
    [base, most]: [usize; 2],
    go_on: &dyn Fn(f32) -> Result<(), Cancellation>,
) -> Result<NarrowGaps, Cancellation> {
    let lattice = Lattice::around(bounds, MAX_VOXELS, DVec3::ONE, MARGIN_VOXELS);
    let solid = lattice.voxelize(soup.positions, soup.triangles, go_on)?.filled();
    let n = MAX_VOXELS as f64;
    let reach = (0.5 * MIN_OPEN_WIDTH * n / base as f64).ceil() as usize;
    let mut found = gaps(&solid, &solid, reach);
    found.retain(|gap| {
        gap.area >= MIN_GAP_AREA * n * n
            && gap.width * lattice.cell > 2.0 * clearance
            && !gap.is_hollow(&lattice, soup)
    });
    let of_model = |gap: Gap| ModelGap {
        points: gap
            .voxels
            .iter()
            .step_by(gap.voxels.len().div_ceil(SAMPLES))
            .map(|&v| center(&lattice, v))
            .collect(),
        width: gap.width * lattice.cell,
        across: gap.across,
        least_voxels: MIN_OPEN_WIDTH * n / gap.width,
        voxels: 0,
    };
    let mut found: Vec<ModelGap> = found.into_iter().map(of_model).collect();
    let mut stretch = if found.len() > most { DVec3::ONE } else { stretch(&found, base) };
    let mut voxels = base;
    if stretch != DVec3::ONE {
        let resolution = resolution_of_narrows(soup, bounds, (clearance, stretch), go_on)?;
        if resolution > MAX_RESOLUTION {
            stretch = stretch.map(|times| if times > 1.0 { STRETCHES[1] } else { 1.0 });
        }
        voxels = voxels.max((resolution / stretch.max_element()).ceil() as usize);
    }
    found.iter_mut().for_each(|gap| gap.voxels = gap.voxels_of(stretch));
    let needed = found.iter().map(|gap| gap.voxels).filter(|&n| n <= most_voxels(stretch));
    let voxels = if found.len() > most { base } else { needed.fold(voxels, usize::max) };
    Ok(NarrowGaps { gaps: found, stretch, voxels: voxels.min(MAX_VOXELS) })
}

/// Computes the resolution (longest side divided by voxel thickness) that leaves open the narrow parts of the large
/// gaps across the thin axis of `stretch`. Ignores gaps whose narrow part is at most two clearances wide; 0 if no gap
/// is left.
///
/// # Errors
/// If `go_on` cancels.
fn resolution_of_narrows(
    soup: &Soup<'_>,
    bounds: [DVec3; 2],
    (clearance, stretch): (f64, DVec3),
    go_on: &dyn Fn(f32) -> Result<(), Cancellation>,
) -> Result<f64, Cancellation> {
    let lattice = Lattice::around(bounds, MAX_VOXELS, stretch, MARGIN_VOXELS);
    let solid = lattice.voxelize(soup.positions, soup.triangles, go_on)?.filled();
    let axis = stretch.max_position();
    let n = MAX_VOXELS as f64;
    let reach = (MIN_OPEN_NARROW_WIDTH * stretch.max_element()).ceil() as usize;
    let mut found = gaps(&solid, &solid, reach);
    found.retain(|gap| {
        gap.area >= MIN_GAP_AREA * n * n
            && gap.across[axis] > MIN_ACROSS_COSINE_SQUARED
            && gap.narrow_width * lattice.shortest() > 2.0 * clearance
            && !gap.is_hollow(&lattice, soup)
    });
    let narrowest = found.iter().map(|gap| gap.narrow_width).fold(f64::INFINITY, f64::min);
    Ok(n * stretch.max_element() * MIN_OPEN_NARROW_WIDTH / narrowest)
}

/// Returns the limit on voxels along the longest side of a lattice that is refined for gaps.
fn most_voxels(stretch: DVec3) -> usize {
    if stretch == DVec3::ONE { usize::MAX } else { (MAX_STRETCHED_SHARE * MAX_VOXELS as f64) as usize }
}

/// Chooses the stretch of the voxels. If most gaps have the same direction, a lattice of voxels that are thin in this
/// direction needs fewer voxels than a lattice of cubes.
fn stretch(gaps: &[ModelGap], base: usize) -> DVec3 {
    // Number of gaps that stay closed, and number of voxels with which all other gaps stay open.
    let closed_and_finest = |stretch: DVec3| {
        let most = most_voxels(stretch).min(MAX_VOXELS);
        let needed = || gaps.iter().map(|gap| gap.voxels_of(stretch));
        (needed().filter(|&n| n > most).count(), needed().filter(|&n| n <= most).fold(base, usize::max))
    };
    let thinner = DVec3::AXES.map(|axis| DVec3::ONE + (STRETCHES[0] - 1.0) * axis);
    let best = thinner.into_iter().min_by_key(|&stretch| closed_and_finest(stretch)).unwrap_or(DVec3::ONE);
    let (closed, finest) = closed_and_finest(best);
    let (closed_by_cubes, of_cubes) = closed_and_finest(DVec3::ONE);
    let is_coarser = of_cubes as f64 > MIN_REFINEMENT * base as f64
        && (finest as f64) < MAX_STRETCHED_SHARE * of_cubes as f64;
    if closed < closed_by_cubes || (closed == closed_by_cubes && is_coarser) { best } else { DVec3::ONE }
}

impl ModelGap {
    /// Returns the smallest number of voxels with this stretch along the model's longest side with which the gap stays
    /// open.
    fn voxels_of(&self, stretch: DVec3) -> usize {
        (self.least_voxels * (self.across / (stretch * stretch)).element_sum().sqrt()).ceil() as usize
    }

    /// Returns a sentence with the gap's position and a remedy if the cage closes the gap; otherwise `None`. `[first,
    /// voxels]`: voxels along the longest side of the first lattice, and of the lattice on which the cage was made.
    pub(super) fn notice(
        &self,
        cage: &Cage,
        [first, voxels]: [usize; 2],
        options: &CageOptions,
    ) -> Option<String> {
        let triangles = || (0..cage.triangles().len() as u32).map(|t| cage.triangle_corners(t));
        let inside = self.points.iter().filter(|p| winding_number(p.as_dvec3(), triangles()) > 0.5).count();
        if 2 * inside <= self.points.len() {
            return None;
        }
        let wanted = self.voxels.min(MAX_VOXELS);
        let remedy = if voxels < wanted && voxels == first {
            format!("use {wanted} voxels instead of {voxels}")
        } else if voxels >= wanted && self.voxels > MAX_VOXELS {
            "move its two sides apart: no lattice is fine enough".to_owned()
        } else if voxels < wanted || 10 * cage.n_vertices() > 9 * options.target as usize {
            // On a finer lattice, the cage needed too many vertices.
            format!("allow more than {} vertices", options.target)
        } else {
            format!("choose a smaller detail than {}", options.detail)
        };
        let middle = self.points.iter().sum::<Vec3>() / self.points.len() as f32;
        let [x, y, z] = middle.to_array().map(|x| decimals(x, 3));
        let width = decimals(self.width, 3);
        Some(format!(
            "the cage closes the gap of about {width} at ({x}, {y}, {z}); to keep it open, {remedy}"
        ))
    }
}

impl Gap {
    /// Whether the gap lies within a hollow part, such as an open sleeve, rather than between two parts.
    pub(super) fn is_hollow(&self, lattice: &Lattice, soup: &Soup<'_>) -> bool {
        let n = self.voxels.len();
        let is_inside = |k: usize| {
            let point = center(lattice, self.voxels[k * n / 4]).as_dvec3();
            soup.winding(point).abs() > 0.5
        };
        // Decide by the majority of three points of the sheet; the third is needed only if the first two differ.
        let [first, second] = [1, 2].map(is_inside);
        if first == second { first } else { is_inside(3) }
    }
}

/// The centre of a voxel, object units.
fn center(lattice: &Lattice, voxel: [usize; 3]) -> Vec3 {
    lattice.object(DVec3::from_array(voxel.map(|x| x as f64 + 0.5)) - lattice.half())
}

/// Index of a voxel, x fastest.
fn number(dims: [usize; 3], [x, y, z]: [usize; 3]) -> usize {
    (z * dims[1] + y) * dims[0] + x
}

fn voxel(dims: [usize; 3], i: usize) -> [usize; 3] {
    [i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]]
}

/// Finds the gaps of a solid that are at most `2 * reach` voxels wide, largest first. Voxels of `closed` belong to no
/// gap.
pub(super) fn gaps(solid: &Voxels, closed: &Voxels, reach: usize) -> Vec<Gap> {
    let dims = solid.dims;
    let wall = nearest(solid, reach);
    let to_wall = |i: usize| {
        let at = |i: usize| DVec3::from_array(voxel(dims, i).map(|x| x as f64));
        at(wall[i] as usize) - at(i)
    };
    let is_free = |i: usize| wall[i] != NO_WALL && !closed.has(voxel(dims, i));
    let mut width = vec![0.0; wall.len()];
    let mut sheet = Voxels::new(dims);
    for i in (0..wall.len()).filter(|&i| is_free(i)) {
        let (v, to) = (voxel(dims, i), to_wall(i));
        let after = solid.neighbours(v).map(|next| number(dims, next)).filter(|&next| next > i);
        for next in after.filter(|&next| is_free(next)) {
            let across = to_wall(next);
            if to.dot(across) < MAX_WALL_COSINE * to.length() * across.length() {
                (width[i], width[next]) = (to.length() + across.length(), to.length() + across.length());
                sheet.add(v);
                sheet.add(voxel(dims, next));
            }
        }
    }
    let depth = depths(&sheet, closed, &to_wall);
    let mut deep = Voxels::new(dims);
    sheet.for_each(|v| {
        let i = number(dims, v);
        if depth[i] as f64 >= MIN_DEPTH * width[i] {
            deep.add(v);
        }
    });
    let of_island = |voxels: Vec<[usize; 3]>| {
        let n = voxels.len() as f64;
        let mut widths: Vec<f64> = voxels.iter().map(|&v| width[number(dims, v)]).collect();
        widths.sort_by(f64::total_cmp);
        let width = widths.iter().sum::<f64>() / n;
        let narrow_width = widths[(NARROW_SHARE * n) as usize];
        // The area below is half the number of voxels, because a sheet is two voxels thick.
        let across = |&v: &[usize; 3]| to_wall(number(dims, v)).normalize_or_zero().powf(2.0);
        let across = voxels.iter().map(across).sum::<DVec3>() / n;
        Gap { voxels, area: 0.5 * n, width, narrow_width, across }
    };
    let mut gaps: Vec<Gap> = deep.islands().into_iter().map(of_island).collect();
    gaps.sort_by(|a, b| b.area.total_cmp(&a.area));
    gaps
}

/// Finds approximately the nearest solid voxel of each outside voxel, up to `reach` voxels away; [`NO_WALL`] elsewhere.
/// A voxel chooses among the results of its neighbours, which may not include its own nearest solid voxel.
fn nearest(solid: &Voxels, reach: usize) -> Vec<u32> {
    let dims = solid.dims;
    let square = |i: u32, v: [usize; 3]| {
        let wall = voxel(dims, i as usize);
        (0..3).map(|k| wall[k].abs_diff(v[k]).pow(2)).sum::<usize>()
    };
    let mut wall = vec![NO_WALL; dims.iter().product()];
    let mut front = Vec::new();
    solid.for_each(|v| front.push((v, number(dims, v) as u32)));
    while !front.is_empty() {
        let mut ahead = Vec::new();
        for (v, from) in front {
            for next in solid.neighbours(v) {
                let (i, far) = (number(dims, next), square(from, next));
                let is_farther = wall[i] != NO_WALL && square(wall[i], next) <= far;
                if far <= reach * reach && !is_farther && !solid.has(next) {
                    wall[i] = from;
                    ahead.push((next, from));
                }
            }
        }
        front = ahead;
    }
    wall
}

/// Computes the graph distance within a sheet from each voxel to the crease where its walls meet; `usize::MAX` if they
/// do not meet.
fn depths(sheet: &Voxels, closed: &Voxels, to_wall: &dyn Fn(usize) -> DVec3) -> Vec<usize> {
    let dims = sheet.dims;
    let mut depth = vec![usize::MAX; dims.iter().product()];
    let mut waiting = Vec::new();
    sheet.for_each(|v| {
        let i = number(dims, v);
        let to = to_wall(i).abs();
        let is_along = |next: [usize; 3]| (0..3).all(|k| next[k] == v[k] || to[k] < 0.7 * to.max_element());
        if sheet.neighbours(v).any(|next| is_along(next) && closed.has(next)) {
            depth[i] = 0;
            waiting.push(v);
        }
    });
    let mut done = 0;
    while let Some(&v) = waiting.get(done) {
        done += 1;
        for next in sheet.neighbours(v) {
            if sheet.has(next) && depth[number(dims, next)] == usize::MAX {
                depth[number(dims, next)] = depth[number(dims, v)] + 1;
                waiting.push(next);
            }
        }
    }
    depth
}
