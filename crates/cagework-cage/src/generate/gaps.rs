//! Gaps between parts of a model, represented by sheets of outside voxels halfway between two facing walls. A gap stays
//! open if the cage does not cross its sheet.

use glam::{DVec3, Vec3};

use super::lattice::{Lattice, MARGIN_VOXELS};
use super::mirrors::Mirrors;
use super::soup::Soup;
use super::voxels::Voxels;
use super::{CageOptions, MAX_OPEN_SHARE, MAX_TARGET, MAX_VOXELS, VERTICES_PER_GAP};
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

/// Smallest area of a gap for which the lattice is refined if the cage has enough vertices for all gaps of that area.
const MIN_SMALL_GAP_AREA: f64 = 0.0015;

/// Smallest area of a gap that is reported. Fingers of a standing figure have gaps of 0.0006.
const MIN_REPORTED_GAP_AREA: f64 = 0.0005;

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

/// A solid voxel.
type Wall = [u16; 3];

/// Marks a voxel that has no solid voxel within the search distance.
const NO_WALL: Wall = [u16::MAX; 3];

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

/// A gap of the model.
#[derive(Clone, Debug)]
pub(super) struct ModelGap {
    /// Area of the gap's sheet as a fraction of the squared longest side of the model.
    pub(super) area: f64,
    /// Sample points of the gap's sheet, object units.
    points: Vec<Vec3>,
    /// Mean distance between the walls, object units.
    width: f64,
    /// Mean squared components of the unit vectors between the walls.
    across: DVec3,
    /// Smallest number of cubic voxels along the model's longest side with which the gap stays open.
    least_voxels: f64,
    /// Smallest target for which the lattice is refined for the gap; `usize::MAX` for gaps that are only reported.
    least_target: usize,
}

/// Narrow gaps of a model, and a lattice that resolves them.
#[derive(Debug)]
pub(super) struct NarrowGaps {
    /// Gaps that a cage with few voxels closes or nearly closes, largest first.
    pub(super) gaps: Vec<ModelGap>,
    /// Number of the first of `gaps` for which the lattice is refined.
    pub(super) n_kept: usize,
    /// Whether cages keep gaps open: false if the large gaps alone are too many.
    pub(super) keeps: bool,
    /// Number of handles of the model on the finest lattice; `usize::MAX` if not counted.
    pub(super) handles: usize,
    /// Longest edge of a voxel divided by its edge along each axis.
    pub(super) stretch: DVec3,
    /// Number of voxels along the model's longest side.
    pub(super) voxels: usize,
}

/// Finds the gaps that a lattice with `base` voxels along the model's longest side closes or nearly closes, and a lattice
/// that leaves open as many of them as `target` vertices suffice for: all but the smallest, only the large ones, or none.
/// In the last case, the lattice has `base` cubic voxels. Gaps narrower than twice the `clearance` of
/// the cage from the model (object units) are left out, because they close on any lattice.
///
/// # Errors
/// If `go_on` cancels.
pub(super) fn narrow_gaps(
    soup: &Soup<'_>,
    bounds: [DVec3; 2],
    clearance: f64,
    [base, target]: [usize; 2],
    go_on: &dyn Fn(f32) -> Result<(), Cancellation>,
) -> Result<NarrowGaps, Cancellation> {
    let lattice = Lattice::around(bounds, MAX_VOXELS, DVec3::ONE, MARGIN_VOXELS);
    let solid = lattice.voxelize(soup.positions, soup.triangles, go_on)?.filled();
    let mut composed = solid.clone();
    composed.compose(Mirrors::NONE);
    let handles = (composed.parts().len() as isize - composed.euler()).max(0) as usize;
    let n = MAX_VOXELS as f64;
    let reach = (0.5 * MIN_OPEN_WIDTH * n / base as f64).ceil() as usize;
    let mut found = gaps(&solid, &solid, reach);
    found.retain(|gap| {
        gap.area >= MIN_REPORTED_GAP_AREA * n * n
            && gap.width * lattice.cell > 2.0 * clearance
            && !gap.is_hollow(&lattice, soup)
    });
    let of_model = |gap: Gap| ModelGap {
        area: gap.area / (n * n),
        points: gap
            .voxels
            .iter()
            .step_by(gap.voxels.len().div_ceil(SAMPLES))
            .map(|&v| center(&lattice, v))
            .collect(),
        width: gap.width * lattice.cell,
        across: gap.across,
        least_voxels: MIN_OPEN_WIDTH * n / gap.width,
        least_target: usize::MAX,
    };
    let mut found: Vec<ModelGap> = found.into_iter().map(of_model).collect();
    let n_above = |area: f64| found.iter().filter(|gap| gap.area >= area).count();
    let (n_large, n_small) = (n_above(MIN_GAP_AREA), n_above(MIN_SMALL_GAP_AREA));
    // Handles need vertices, too: those of hair cards (hundreds) are too many. For small gaps, the lattice is refined only if
    // vertices abound.
    let needed = |n: usize| VERTICES_PER_GAP * n.max(handles.div_ceil(2));
    let targets = [(n_small, needed(3 * n_small)), (n_large, needed(n_large))];
    for (n, least) in targets {
        found[..n].iter_mut().for_each(|gap| gap.least_target = least);
    }
    let kept = targets.into_iter().find(|&(_, least)| least <= target);
    let (n_kept, keeps) = (kept.map_or(0, |(n, _)| n), kept.is_some());
    let mut narrow = NarrowGaps { gaps: found, n_kept, keeps, handles, stretch: DVec3::ONE, voxels: base };
    if n_kept == 0 {
        return Ok(narrow);
    }
    let kept = &mut narrow.gaps[..n_kept];
    let mut stretch = stretch(kept, base);
    if stretch != DVec3::ONE {
        let resolution = resolution_of_narrows(soup, bounds, (clearance, stretch), go_on)?;
        if resolution > MAX_RESOLUTION {
            stretch = stretch.map(|times| if times > 1.0 { STRETCHES[1] } else { 1.0 });
        }
        narrow.voxels = narrow.voxels.max((resolution / stretch.max_element()).ceil() as usize);
    }
    let needed = kept.iter().map(|gap| gap.voxels_of(stretch)).filter(|&n| n <= most_voxels(stretch));
    narrow.voxels = needed.fold(narrow.voxels, usize::max).min(MAX_VOXELS);
    narrow.stretch = stretch;
    Ok(narrow)
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

    /// Returns the share of the gap's sheet that lies inside a cage.
    pub(super) fn closed_share(&self, cage: &Cage) -> f64 {
        let triangles = || (0..cage.triangles().len() as u32).map(|t| cage.triangle_corners(t));
        let inside = self.points.iter().filter(|p| winding_number(p.as_dvec3(), triangles()) > 0.5).count();
        inside as f64 / self.points.len() as f64
    }

    /// Returns a sentence about a gap that a cage closes, with its position. `share`: share of the gap that is closed.
    /// `[first, voxels]`: voxels along the longest side of the first lattice, and of the lattice of the cage.
    pub(super) fn notice(&self, share: f64, [first, voxels]: [usize; 2], options: &CageOptions) -> String {
        let wanted = self.voxels_of(DVec3::ONE);
        let least = self.least_target;
        let remedy = if options.voxels > 0 && voxels == first && voxels < wanted && wanted <= MAX_VOXELS {
            format!("; to keep it open, use {wanted} voxels instead of {voxels}")
        } else if least > options.target as usize && least <= MAX_TARGET as usize {
            format!("; to keep it open, allow at least {least} vertices")
        } else if wanted > (STRETCHES[1] * MAX_STRETCHED_SHARE) as usize * MAX_VOXELS {
            "; to keep it open, move its two sides apart: no lattice is fine enough".to_owned()
        } else {
            String::new()
        };
        let middle = self.points.iter().sum::<Vec3>() / self.points.len() as f32;
        let [x, y, z] = middle.to_array().map(|x| decimals(x, 3));
        let width = decimals(self.width, 3);
        let part = if share > MAX_OPEN_SHARE { "" } else { "a part of " };
        format!("the cage closes {part}the gap of about {width} at ({x}, {y}, {z}){remedy}")
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
    let from_to = |v: [usize; 3], wall: Wall| [0, 1, 2].map(|k| i32::from(wall[k]) - v[k] as i32);
    let to_wall = |i: usize| DVec3::from_array(from_to(voxel(dims, i), wall[i]).map(f64::from));
    let dot = |a: [i32; 3], b: [i32; 3]| (0..3).map(|k| a[k] * b[k]).sum::<i32>();
    // For each voxel of the sheet, the neighbour whose nearest wall is the facing one.
    let mut facing = vec![u32::MAX; wall.len()];
    let mut sheet = Voxels::new(dims);
    let strides = [1, dims[0], dims[0] * dims[1]];
    for i in (0..wall.len()).filter(|&i| wall[i] != NO_WALL) {
        let v = voxel(dims, i);
        let to = from_to(v, wall[i]);
        for (axis, stride) in strides.into_iter().enumerate() {
            if v[axis] + 1 == dims[axis] || wall[i + stride] == NO_WALL {
                continue;
            }
            let mut next = v;
            next[axis] += 1;
            let across = from_to(next, wall[i + stride]);
            let cosine = f64::from(dot(to, across));
            let lengths = f64::from(dot(to, to)) * f64::from(dot(across, across));
            if cosine < 0.0
                && cosine < MAX_WALL_COSINE * lengths.sqrt()
                && !closed.has(v)
                && !closed.has(next)
            {
                (facing[i], facing[i + stride]) = ((i + stride) as u32, i as u32);
                sheet.add(v);
                sheet.add(next);
            }
        }
    }
    let width = |v: [usize; 3]| {
        let i = number(dims, v);
        [i, facing[i] as usize].map(|i| to_wall(i).length()).iter().sum::<f64>()
    };
    let depth = depths(&sheet, closed, &to_wall);
    let mut deep = Voxels::new(dims);
    sheet.for_each(|v| {
        if depth[number(dims, v)] as f64 >= MIN_DEPTH * width(v) {
            deep.add(v);
        }
    });
    let of_island = |voxels: Vec<[usize; 3]>| {
        let n = voxels.len() as f64;
        let mut widths: Vec<f64> = voxels.iter().map(|&v| width(v)).collect();
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
fn nearest(solid: &Voxels, reach: usize) -> Vec<Wall> {
    let dims = solid.dims;
    let square =
        |wall: Wall, v: [usize; 3]| (0..3).map(|k| usize::from(wall[k]).abs_diff(v[k]).pow(2)).sum::<usize>();
    let mut wall = vec![NO_WALL; dims.iter().product()];
    let mut front: Vec<(Wall, Wall)> = Vec::new();
    solid.border().for_each(|v| front.push((v.map(|x| x as u16), v.map(|x| x as u16))));
    while !front.is_empty() {
        let mut ahead = Vec::new();
        for (v, from) in front {
            for next in solid.neighbours(v.map(usize::from)) {
                let (i, far) = (number(dims, next), square(from, next));
                if far <= reach * reach
                    && (wall[i] == NO_WALL || square(wall[i], next) > far)
                    && !solid.has(next)
                {
                    wall[i] = from;
                    ahead.push((next.map(|x| x as u16), from));
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
