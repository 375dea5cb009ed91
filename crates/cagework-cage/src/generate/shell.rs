//! Converts a triangle soup to a solid and a hull around it, for any input.
//!
//! Source: Xian, Lin and Gao 2009, "Automatic generation of coarse bounding cages from dense meshes", for voxels, flood
//! fill and hull. Changes: the hull is dilated for clearance, its boundary is made a 2-manifold by adding voxels, and
//! separate parts are bridged if one cage is requested.

use std::collections::VecDeque;

use glam::{DVec3, Vec3};

use super::gaps::{Gap, MIN_GAP_AREA, gaps};
use super::guarded::{GuardedSurface, Obstacle};
use super::lattice::{Lattice, MARGIN_VOXELS};
use super::mirrors::Mirrors;
use super::soup::Soup;
use super::surface::{SMOOTHING_REACH, Surface};
use super::voxels::Voxels;
use super::{CageKind, CageOptions, Symmetry, first_voxels};
use cagework_core::progress::Cancellation;

/// Smallest share of the solid's voxels with a mirror image for which the model counts as symmetric.
const MIN_MIRROR_SHARE: f64 = 0.985;

/// Smallest share of voxels whose mirror image is a voxel, too, for the second and third mirror plane.
const MIN_EXACT_SHARE: f64 = 0.995;

/// Distance up to which a voxel counts as the mirror image of another one, as a fraction of the model's longest side;
/// at least one voxel.
const MIRROR_TOLERANCE: f64 = 1.0 / 36.0;

/// Number of voxels along the model's longest side of the lattice on which symmetry is tested. It does not depend on the
/// number of vertices, so that all cages of a model have the same symmetry.
const MIRROR_VOXELS: usize = 64;

/// Largest extent of a cluster of voxels without mirror image, as a fraction of the model's longest side. A larger
/// cluster counts as an asymmetric part.
const MAX_UNMATCHED_SHARE: f64 = 0.08;

/// Half the width of the widest gaps that are detected, as a fraction of the model's longest side.
const MAX_GAP_HALF: f64 = 0.12;

/// Minimum clearance between the cage and the solid, in voxels. It applies if the options request less.
const DEFAULT_CLEARANCE: f64 = 0.5;

/// Clearance of a hull dilated by one voxel, in voxels: one voxel, minus the largest movement of a smoothed vertex,
/// minus an allowance for rounding.
const HULL_CLEARANCE: f64 = 1.0 - SMOOTHING_REACH - 1e-3;

/// The hull around a vertex counts as a limb if its length along the longest chord, divided by its mean thickness
/// across this chord, exceeds this.
const MIN_LIMB_RATIO: f64 = 2.8;

/// A direction counts as across a limb or plate if its cosine with the longest chord is below this.
const MAX_ACROSS_COSINE: f64 = 0.3;

/// Largest allowed distance between rings of cage vertices along a limb, as a multiple of the limb's thickness. A small
/// target number of vertices may enlarge the distance.
const MAX_RING_DISTANCE: f64 = 1.3;

/// The hull around a vertex counts as a plate if its length along the longest chord, divided by its smallest thickness
/// across this chord, exceeds this, and it is wide enough ([`MIN_PLATE_WIDTH`]).
const MIN_PLATE_RATIO: f64 = 5.0;

/// Ratio of width to length that a plate exceeds. The width is the longest chord across the length.
const MIN_PLATE_WIDTH: f64 = 0.5;

/// Largest allowed distance between vertices on a plate, as a fraction of the plate's length. A small target number of
/// vertices may enlarge the distance.
const MAX_PLATE_SPACING: f64 = 0.5;

/// The spacing of vertices on limbs is limited only if at least this share of the hull's vertices lies on limbs, and that
/// of vertices on plates only if this share lies on plates. Furniture, such as a chair of a seat, a back and four legs,
/// needs neither.
const MIN_SHARE: f64 = 0.6;

/// Directions of the chords that measure length and thickness of limbs and plates: to the 26 neighbours on the lattice,
/// one of each opposite pair.
const DIRECTIONS: [DVec3; 13] = [
    DVec3::new(1.0, 0.0, 0.0),
    DVec3::new(0.0, 1.0, 0.0),
    DVec3::new(0.0, 0.0, 1.0),
    DVec3::new(1.0, 1.0, 0.0),
    DVec3::new(1.0, -1.0, 0.0),
    DVec3::new(1.0, 0.0, 1.0),
    DVec3::new(1.0, 0.0, -1.0),
    DVec3::new(0.0, 1.0, 1.0),
    DVec3::new(0.0, 1.0, -1.0),
    DVec3::new(1.0, 1.0, 1.0),
    DVec3::new(1.0, 1.0, -1.0),
    DVec3::new(1.0, -1.0, 1.0),
    DVec3::new(-1.0, 1.0, 1.0),
];

/// Largest share of the sheet of a gap that the image of a symmetric model covers. A model with a larger share has a part
/// on one side only that closes the gap.
const MAX_CLOSED_SHARE: f64 = 0.1;

/// Half the width, in voxels, of the widest passages of a hull that are filled.
const MAX_CLOSING: usize = 4;

/// A hull with more handles, such as that of scattered cards, keeps them.
const MAX_HANDLES: usize = 100;

/// Limit on the passages of each width that are tried, largest first.
const MAX_PASSAGES: usize = 24;

/// Limit on the distance between neighbouring cage vertices on a limb or plate. With wider spacing, the cage has too
/// few vertices to bend the limb or plate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spacing {
    /// Unit vector along a limb, to which the limit applies; `None` on a plate, where it applies in all directions.
    pub(super) along: Option<DVec3>,
    /// Largest distance, voxels.
    pub(super) distance: f64,
}

impl Spacing {
    /// Whether neighbours that differ by `d` are too far apart.
    pub(super) fn is_below(&self, d: DVec3) -> bool {
        self.along.map_or_else(|| d.length(), |along| along.dot(d).abs()) > self.distance
    }
}

/// A solid in a lattice and the hull around it.
#[derive(Debug)]
pub(super) struct Shell {
    pub(super) lattice: Lattice,
    /// Number of voxels along the model's longest side, divided by [`super::first_voxels`] of the target.
    pub(super) fineness: f64,
    /// Longest side of the model's box, object units.
    pub(super) longest: f64,
    /// Voxels that the cage must keep clear of.
    pub(super) obstacle: Obstacle,
    solid: Voxels,
    filled: Voxels,
    /// The smoothed hull, which meets neither the obstacle nor itself.
    pub(super) hull: Surface,
    /// The hull before smoothing, a 2-manifold by construction.
    pub(super) stairs: Surface,
    /// Number of components of the hull before bridges of voxels join them.
    pub(super) separate: usize,
    /// One voxel of each connected component of the solid.
    pub(super) parts: Vec<[usize; 3]>,
    /// Smallest allowed Chebyshev distance of the cage from the model, object units.
    pub(super) clearance: f64,
    /// Gaps that the hull leaves open, largest first, set by [`Self::find_gaps`].
    pub(super) gaps: Vec<Gap>,
}

/// A solid in a lattice and the hull around it, before the hull is smoothed.
pub(super) struct VoxelHull {
    lattice: Lattice,
    stretch: DVec3,
    fineness: f64,
    longest: f64,
    /// Requested distance of the cage from the model, object units.
    asked: f64,
    solid: Voxels,
    filled: Voxels,
    stairs: Surface,
    /// Number of components before bridges of voxels join them.
    pub(super) separate: usize,
}

impl VoxelHull {
    /// Builds the hull of a model on a lattice of `n` voxels along the model's longest side, with the given stretch.
    /// Passages of the hull are filled if it has more than `handles` handles. `go_on` may cancel.
    pub(super) fn new(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        bounds: [DVec3; 2],
        (n, stretch): (usize, DVec3),
        (mirrors, handles): (Mirrors, usize),
        options: &CageOptions,
        go_on: &dyn Fn(f32) -> Result<(), Cancellation>,
    ) -> Result<Self, Cancellation> {
        let asked = options.distance(bounds);
        // Number of layers of voxels, of edge `cell`, between solid and hull that give the requested clearance.
        let layers_for =
            |cell: f64| ((asked / cell).max(DEFAULT_CLEARANCE) + 1.0 - HULL_CLEARANCE).ceil() as usize;
        let rough = Lattice::around(bounds, n, stretch, MARGIN_VOXELS);
        let layers = layers_for(rough.shortest());
        let lattice = Lattice::around(bounds, n, stretch, MARGIN_VOXELS + layers);
        let touched = match options.kind {
            CageKind::Hull => slab_hull(&lattice, positions),
            _ => lattice.voxelize(positions, triangles, &|f| go_on(0.5 * f))?,
        };
        let mut solid = touched.filled();
        if !mirrors.is_empty() {
            solid.mirror(mirrors);
            solid = solid.filled();
        }
        go_on(0.6)?;
        let mut hull = dilate_hull(&solid, layers, mirrors);
        let separate = hull.parts().len();
        if !options.per_component {
            while bridge(&mut solid, &hull, layers, mirrors) {
                go_on(0.7)?;
                hull = dilate_hull(&solid, layers, mirrors);
            }
        }
        close_handles(&mut hull, handles, mirrors);
        go_on(0.8)?;
        Ok(Self {
            stretch,
            fineness: n as f64 / first_voxels(options.target as usize) as f64,
            longest: (bounds[1] - bounds[0]).max_element(),
            asked,
            solid,
            stairs: Surface::of(&hull, mirrors),
            filled: hull,
            separate,
            lattice,
        })
    }

    /// Number of vertices of the hull, or of its half with a mirror.
    pub(super) fn n_vertices(&self) -> usize {
        self.stairs.positions.len()
    }

    /// Smooths the hull, which takes most of the time of making a shell.
    pub(super) fn smoothed(self) -> Shell {
        let Self { lattice, stretch, fineness, longest, asked, solid, filled, stairs, separate } = self;
        let clearance = (asked / lattice.shortest()).max(DEFAULT_CLEARANCE);
        // Dilate the obstacle by the whole voxels of the clearance; the rest, less than a voxel, is a distance that
        // triangles keep from it.
        let whole = clearance.floor();
        let mut keep_out = solid.clone();
        for _ in 0..whole as usize {
            keep_out = keep_out.dilated();
        }
        let obstacle = Obstacle { voxels: keep_out, clearance: clearance - whole, stretch };
        let hull = smooth_hull(&stairs, &obstacle);
        Shell {
            gaps: Vec::new(),
            parts: solid.parts(),
            solid,
            clearance: clearance * lattice.shortest(),
            fineness,
            longest,
            lattice,
            obstacle,
            filled,
            hull,
            stairs,
            separate,
        }
    }
}

impl Shell {
    /// Finds at most `most` gaps that the hull leaves open. `n`: voxels along the model's longest side.
    pub(super) fn find_gaps(&mut self, soup: &Soup<'_>, [n, most]: [usize; 2]) {
        let reach = (MAX_GAP_HALF * n as f64).ceil() as usize;
        let found = gaps(&self.solid, &self.filled, reach).into_iter();
        let found = found.filter(|gap| !gap.is_hollow(&self.lattice, soup));
        self.gaps = found.take(most).collect();
    }

    /// Returns the voxels of the hull, dilated by `layers` voxels.
    pub(super) fn band(&self, layers: usize) -> Voxels {
        (0..layers).fold(self.filled.clone(), |band, _| band.dilated())
    }

    /// Computes the spacing limit at each vertex of the hull; `None` for a vertex on neither a limb nor a plate.
    pub(super) fn spacings(&self) -> Vec<Option<Spacing>> {
        let mut normals = vec![DVec3::ZERO; self.hull.positions.len()];
        for t in &self.hull.triangles {
            let [a, b, c] = t.map(|i| self.hull.positions[i as usize]);
            t.iter().for_each(|&i| normals[i as usize] += (b - a).cross(c - a));
        }
        // Number of steps `along` from a point (lattice coordinates) until the next point is outside the hull.
        let run = |from: DVec3, along: DVec3| {
            let is_inside = |k: usize| {
                let p = from + k as f64 * along;
                let v = p.to_array().map(|x| x as usize);
                p.min_element() >= 0.0 && (0..3).all(|k| v[k] < self.filled.dims[k]) && self.filled.has(v)
            };
            (0..).take_while(|&k| is_inside(k)).count() as f64
        };
        let half = self.lattice.half();
        let spacing = |(&p, normal): (&DVec3, &DVec3)| {
            let inward = -normal.normalize_or_zero();
            let below = p + half + 0.7 * inward;
            let center = below + 0.5 * run(below, inward) * inward;
            let chord = |along: DVec3| run(center, along) + run(center, -along);
            let chords = DIRECTIONS.map(|along| (along.normalize(), chord(along.normalize())));
            let (along, length) = chords.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
            let across = chords.iter().filter(|(other, _)| other.dot(along).abs() < MAX_ACROSS_COSINE);
            let across: Vec<f64> = across.map(|&(_, chord)| chord).collect();
            let (least, most) = across.iter().fold((length, 0.0), |(a, b), &x| (x.min(a), x.max(b)));
            let thickness = across.iter().sum::<f64>() / across.len() as f64;
            if length > MIN_PLATE_RATIO * least && most > MIN_PLATE_WIDTH * length {
                Some(Spacing { along: None, distance: MAX_PLATE_SPACING * length })
            } else if length > MIN_LIMB_RATIO * thickness {
                Some(Spacing { along: Some(along), distance: MAX_RING_DISTANCE * thickness })
            } else {
                None
            }
        };
        let mut spacings: Vec<_> = self.hull.positions.iter().zip(&normals).map(spacing).collect();
        for is_plate in [false, true] {
            let is_of_kind =
                |s: &Option<Spacing>| s.is_some_and(|spacing| spacing.along.is_none() == is_plate);
            let n = spacings.iter().filter(|&spacing| is_of_kind(spacing)).count();
            if (n as f64) < MIN_SHARE * spacings.len() as f64 {
                spacings.iter_mut().filter(|spacing| is_of_kind(spacing)).for_each(|spacing| *spacing = None);
            }
        }
        spacings
    }

    /// Returns the voxels of the sheets that span the open gaps, for gaps with at least the share `least` of the
    /// largest gap's area; `None` if there are no gaps.
    pub(super) fn sheets(&self, least: f64) -> Option<Voxels> {
        let largest = self.gaps.first()?.area;
        let mut sheets = Voxels::new(self.filled.dims);
        let kept = self.gaps.iter().filter(|gap| gap.area >= least * largest);
        kept.flat_map(|gap| &gap.voxels).for_each(|&v| sheets.add(v));
        Some(sheets)
    }
}

/// Dilates the solid by `layers` voxels, fills cavities, and makes the boundary a 2-manifold.
fn dilate_hull(solid: &Voxels, layers: usize, mirrors: Mirrors) -> Voxels {
    let mut hull = solid.clone();
    for _ in 0..layers {
        hull = hull.dilated();
    }
    hull = hull.filled();
    compose_hull(&mut hull, mirrors);
    hull
}

/// Makes the boundary of a hull a 2-manifold, and fills the cavities that the added voxels enclose.
fn compose_hull(hull: &mut Voxels, mirrors: Mirrors) {
    loop {
        hull.compose(mirrors);
        let filled = hull.filled();
        if filled == *hull {
            return;
        }
        *hull = filled;
    }
}

/// Fills narrow passages of a hull, narrowest first, each only if that leaves fewer handles, until at most `most` handles
/// are left. A lattice that is too coarse for a gap closes it in some places only, and each opening is a handle.
fn close_handles(hull: &mut Voxels, most: usize, mirrors: Mirrors) {
    for layers in 1..=MAX_CLOSING {
        let n_handles = (hull.parts().len() as isize - hull.euler()).max(0) as usize;
        if n_handles <= most || n_handles > MAX_HANDLES {
            return;
        }
        let mut islands = hull.closed(layers).without(hull).islands();
        islands.sort_by_key(|island| std::cmp::Reverse(island.len()));
        for island in islands.into_iter().take(MAX_PASSAGES) {
            let mut wider = hull.clone();
            island.iter().for_each(|&v| wider.add(v));
            wider.mirror(mirrors);
            if wider.euler() > hull.euler() {
                *hull = wider;
            }
        }
        compose_hull(hull, mirrors);
    }
}

/// Smooths the hull. Vertices of triangles that intersect others return to their unsmoothed positions until none
/// intersect.
fn smooth_hull(stairs: &Surface, obstacle: &Obstacle) -> Surface {
    let mut smooth = stairs.clone();
    smooth.smooth();
    loop {
        let offenders = GuardedSurface::new(smooth.clone(), obstacle).offenders();
        let mut moved = false;
        for v in offenders {
            let (now, before) = (&mut smooth.positions[v as usize], stairs.positions[v as usize]);
            moved |= *now != before;
            *now = before;
        }
        if !moved {
            return smooth;
        }
    }
}

/// Finds the mirror planes: the requested one, or the first of x, z, y in which the model is symmetric up to
/// [`MIRROR_TOLERANCE`], and the others in which it is symmetric voxel by voxel. In both cases, small scattered parts may
/// differ, unless the image of a part would close a gap. `finest`: limit on the number of voxels along the model's
/// longest side.
///
/// # Errors
/// If `go_on` cancels.
pub(super) fn find_mirrors(
    soup: &Soup<'_>,
    bounds: [DVec3; 2],
    finest: usize,
    options: &CageOptions,
    go_on: &dyn Fn(f32) -> Result<(), Cancellation>,
) -> Result<Mirrors, Cancellation> {
    match options.symmetry {
        Symmetry::Auto => {}
        Symmetry::None => return Ok(Mirrors::NONE),
        Symmetry::X => return Ok(Mirrors::of_axis(0)),
        Symmetry::Y => return Ok(Mirrors::of_axis(1)),
        Symmetry::Z => return Ok(Mirrors::of_axis(2)),
    }
    let n = MIRROR_VOXELS.min(finest);
    let lattice = Lattice::around(bounds, n, DVec3::ONE, MARGIN_VOXELS);
    let touched = match options.kind {
        CageKind::Hull => slab_hull(&lattice, soup.positions),
        _ => lattice.voxelize(soup.positions, soup.triangles, go_on)?,
    };
    let solid = touched.filled();
    let mut sheets: Option<Vec<Gap>> = None;
    let mut is_symmetric = |axis: usize, tolerance: usize, share: f64| {
        let whole_image = solid.mirrored(axis);
        let image = (0..tolerance).fold(whole_image.clone(), |image, _| image.dilated());
        let unmatched = solid.without(&image);
        let extent = |island: &Vec<[usize; 3]>| {
            let side = |k: usize| {
                let at = || island.iter().map(|v| v[k]);
                at().max().unwrap_or(0) - at().min().unwrap_or(0)
            };
            (0..3).map(side).max().unwrap_or(0)
        };
        let is_small = |island: &Vec<[usize; 3]>| (extent(island) as f64) < MAX_UNMATCHED_SHARE * n as f64;
        unmatched.count() as f64 <= (1.0 - share) * solid.count() as f64
            && unmatched.islands().iter().all(is_small)
            && sheets.get_or_insert_with(|| large_gaps(&solid, n)).iter().all(|gap| {
                let closed = gap.voxels.iter().filter(|v| whole_image.has(**v)).count();
                closed as f64 <= MAX_CLOSED_SHARE * gap.voxels.len() as f64
            })
    };
    let tolerance = (MIRROR_TOLERANCE * n as f64).round().max(1.0) as usize;
    Ok(Mirrors::ALL.axes().fold(Mirrors::NONE, |mirrors, axis| {
        let (tolerance, share) =
            if mirrors.is_empty() { (tolerance, MIN_MIRROR_SHARE) } else { (0, MIN_EXACT_SHARE) };
        if is_symmetric(axis, tolerance, share) { mirrors.or(Mirrors::of_axis(axis)) } else { mirrors }
    }))
}

/// Finds the large gaps of a solid. `n`: number of voxels along the model's longest side.
fn large_gaps(solid: &Voxels, n: usize) -> Vec<Gap> {
    let mut found = gaps(solid, solid, (MAX_GAP_HALF * n as f64).ceil() as usize);
    found.retain(|gap| gap.area >= MIN_GAP_AREA * (n * n) as f64);
    found
}

/// Adds to the solid paths of voxels that join the components of the hull, shortest first (breadth-first search from
/// the joined set). The paths will be dilated by `layers`. Returns false if there is only one component.
fn bridge(solid: &mut Voxels, hull: &Voxels, layers: usize, mirrors: Mirrors) -> bool {
    let parts = hull.parts();
    if parts.len() < 2 {
        return false;
    }
    let mut joined = JoinedVoxels { hull, from: vec![[usize::MAX; 3]; hull.dims.iter().product()] };
    let mut queue = VecDeque::new();
    joined.add_part(parts[0], &mut queue);
    let mut left = parts.len() - 1;
    while left > 0
        && let Some(voxel) = queue.pop_front()
    {
        for next in hull.neighbours(voxel) {
            // Stay far enough from the border that the dilated path leaves the outermost layer of voxels empty.
            let edge = (0..3).any(|k| next[k] <= layers || next[k] + layers + 1 >= hull.dims[k]);
            if edge || joined.has(next) {
                continue;
            }
            let index = joined.index(next);
            joined.from[index] = voxel;
            if !hull.has(next) {
                queue.push_back(next);
                continue;
            }
            let mut path = voxel;
            while joined.from[joined.index(path)] != path {
                solid.add(path);
                let before = joined.from[joined.index(path)];
                let index = joined.index(path);
                joined.from[index] = path;
                queue.push_back(path);
                path = before;
            }
            solid.add(path);
            solid.add(next);
            let index = joined.index(next);
            joined.from[index] = [usize::MAX; 3];
            joined.add_part(next, &mut queue);
            left -= 1;
        }
    }
    solid.mirror(mirrors);
    true
}

/// Voxels of components that are already joined, and voxels that the search has visited.
struct JoinedVoxels<'a> {
    hull: &'a Voxels,
    /// Predecessor of each visited voxel on the search's path. A joined voxel is its own predecessor.
    from: Vec<[usize; 3]>,
}

impl JoinedVoxels<'_> {
    fn index(&self, v: [usize; 3]) -> usize {
        (v[2] * self.hull.dims[1] + v[1]) * self.hull.dims[0] + v[0]
    }

    fn has(&self, voxel: [usize; 3]) -> bool {
        self.from[self.index(voxel)][0] != usize::MAX
    }

    /// Adds a component of the hull to the joined set.
    fn add_part(&mut self, seed: [usize; 3], queue: &mut VecDeque<[usize; 3]>) {
        let mut stack = vec![seed];
        let index = self.index(seed);
        self.from[index] = seed;
        while let Some(voxel) = stack.pop() {
            queue.push_back(voxel);
            for next in self.hull.neighbours(voxel) {
                if self.hull.has(next) && !self.has(next) {
                    let index = self.index(next);
                    self.from[index] = next;
                    stack.push(next);
                }
            }
        }
    }
}

/// Returns the voxels inside the model's 26-DOP: the intersection of 13 slabs, normal to the directions from the centre
/// of a cube to its faces, edges and corners (Klosowski et al. 1998).
fn slab_hull(lattice: &Lattice, positions: &[Vec3]) -> Voxels {
    let mut axes = Vec::new();
    for x in -1..=1 {
        for y in -1..=1 {
            for z in 0..=1 {
                let axis = [x, y, z];
                // Of two opposite directions, keep the one whose last nonzero component is positive.
                if axis.iter().rev().find(|&&k| k != 0) == Some(&1) {
                    axes.push(DVec3::from_array(axis.map(f64::from)));
                }
            }
        }
    }
    let mut slabs: Vec<(DVec3, f64, f64)> =
        axes.into_iter().map(|axis| (axis, f64::INFINITY, f64::NEG_INFINITY)).collect();
    for &p in positions {
        let p = lattice.lattice(p);
        for (axis, low, high) in &mut slabs {
            let at = axis.dot(p);
            *low = low.min(at);
            *high = high.max(at);
        }
    }
    let mut voxels = Voxels::new(lattice.dims);
    for z in 0..lattice.dims[2] {
        for y in 0..lattice.dims[1] {
            for x in 0..lattice.dims[0] {
                let center = DVec3::new(x as f64, y as f64, z as f64) + 0.5;
                let inside = slabs.iter().all(|&(axis, low, high)| {
                    let reach = 0.5 * (axis.x.abs() + axis.y.abs() + axis.z.abs());
                    (low - reach..=high + reach).contains(&axis.dot(center))
                });
                if inside {
                    voxels.add([x, y, z]);
                }
            }
        }
    }
    voxels
}
