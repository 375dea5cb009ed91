use std::cell::Cell;
use std::ops::ControlFlow;

use glam::{DVec3, Vec2, Vec3, vec3};
use proptest::prelude::*;

use super::{
    CageGenError, CageKind, CageOptions, CageReport, Effort, GeneratedCage, Lattice, MAX_FINE_HULL, MAX_ROWS,
    MAX_VISITS, Mirror, Mirrors, Simplification, Symmetry, VoxelHull, check_input, generate, simplify_hull,
    smooth,
};
use cagework_core::bind::bind;
use cagework_core::cage::{Cage, subdivided_box};
use cagework_core::contact::{Corners, meeting};
use cagework_core::deform::displacements;
use cagework_core::geometry::winding_number;
use cagework_core::mesh::{Bounds, PolygonMesh};
use cagework_core::options::{BindOptions, RangeError};
use cagework_core::progress::{NoProgress, ProgressEvent};
use cagework_core::smooth::subdivide;

/// Tolerance for f32 rounding of positions of size 1 after mirroring.
const ROUNDING: f32 = 1e-6;

type Soup = (Vec<Vec3>, Vec<[u32; 3]>);

/// Tolerance for rounding of winding numbers, which are integers for closed surfaces.
const WINDING_TOLERANCE: f64 = 1e-6;

fn winding(cage: &Cage, p: Vec3) -> f64 {
    winding_number(p.as_dvec3(), (0..cage.triangles().len() as u32).map(|t| cage.triangle_corners(t)))
}

/// Cuts each face into a fan of triangles from corner `k`, as other programs may do with quads.
fn cut(mesh: &PolygonMesh, k: usize) -> PolygonMesh {
    let cut = |f: &Vec<u32>| {
        let f = f.clone();
        (2..f.len()).map(move |n| [0, n - 1, n].map(|i| f[(i + k) % f.len()]).to_vec())
    };
    PolygonMesh { positions: mesh.positions.clone(), faces: mesh.faces.iter().flat_map(cut).collect() }
}

/// Asserts by winding numbers that a cage encloses the model, whichever diagonal its quads are cut along.
fn assert_promise((positions, _): &Soup, made: &GeneratedCage) {
    let cage = &made.cage;
    let mesh = cage.to_polygon_mesh();
    for (way, mesh) in [cut(&mesh, 0), cut(&mesh, 1), mesh].iter().enumerate() {
        let again = Cage::new(mesh).unwrap_or_else(|error| panic!("cut {way}: {error}"));
        assert_eq!(again.notices(), [], "closed, oriented, manifold, without unused vertices");
        let triangles: Vec<Corners> = (0..again.triangles().len())
            .map(|t| Corners { index: again.triangles()[t], at: again.triangle_corners(t as u32) })
            .collect();
        assert_eq!(meeting(&triangles), Vec::<[u32; 2]>::new(), "cut {way}: it intersects itself");
        let step = (positions.len() / 200).max(1);
        for &p in positions.iter().step_by(step) {
            let w = winding(&again, p);
            assert!((w - 1.0).abs() < WINDING_TOLERANCE, "cut {way}: {p} has winding number {w}");
        }
    }
    assert_eq!(made.report.vertices as usize, cage.n_vertices());
    assert_eq!(
        made.report.target_met,
        f64::from(made.report.vertices) <= 1.1 * f64::from(made.report.target)
    );
}

fn make(soup: &Soup, options: &CageOptions) -> GeneratedCage {
    let made = generate(&soup.0, &soup.1, options, &NoProgress).unwrap();
    assert_promise(soup, &made);
    made
}

fn options(target: u32) -> CageOptions {
    CageOptions { target, ..CageOptions::default() }
}

/// A tube of triangulated quads along a polyline, without caps. If `closed` is set, its two ends are joined to a ring.
fn tube(line: &[Vec3], radius: f32, closed: bool) -> Soup {
    const SIDES: u32 = 12;
    let n = line.len();
    let mut soup: Soup = (Vec::new(), Vec::new());
    for k in 0..n {
        let (before, after) = if closed {
            (line[(k + n - 1) % n], line[(k + 1) % n])
        } else {
            (line[k.saturating_sub(1)], line[(k + 1).min(n - 1)])
        };
        let along = (after - before).normalize();
        let u = along.cross(vec3(0.31, 0.17, 0.94)).normalize();
        let v = along.cross(u);
        for s in 0..SIDES {
            let (sin, cos) = (std::f32::consts::TAU * s as f32 / SIDES as f32).sin_cos();
            soup.0.push(line[k] + radius * (u * cos + v * sin));
        }
    }
    let rings = if closed { n } else { n - 1 } as u32;
    for k in 0..rings {
        for s in 0..SIDES {
            let at = |k: u32, s: u32| k % n as u32 * SIDES + s % SIDES;
            soup.1.push([at(k, s), at(k, s + 1), at(k + 1, s)]);
            soup.1.push([at(k + 1, s), at(k, s + 1), at(k + 1, s + 1)]);
        }
    }
    soup
}

fn join(soups: impl IntoIterator<Item = Soup>) -> Soup {
    soups.into_iter().fold((Vec::new(), Vec::new()), |mut all: Soup, (positions, triangles)| {
        let first = all.0.len() as u32;
        all.0.extend(positions);
        all.1.extend(triangles.into_iter().map(|t| t.map(|i| i + first)));
        all
    })
}

fn segment(a: Vec3, b: Vec3) -> Vec<Vec3> {
    (0..=8).map(|k| a.lerp(b, k as f32 / 8.0)).collect()
}

/// Two legs below a bar, as overlapping open tubes; symmetric about x = 0.
fn trousers() -> Soup {
    join([
        tube(&segment(vec3(-0.3, 1.0, 0.0), vec3(0.3, 1.0, 0.0)), 0.2, false),
        tube(&segment(vec3(-0.3, 1.0, 0.0), vec3(-0.3, -1.0, 0.0)), 0.12, false),
        tube(&segment(vec3(0.3, 1.0, 0.0), vec3(0.3, -1.0, 0.0)), 0.12, false),
    ])
}

fn ring() -> Soup {
    let circle = |k: usize| {
        let (sin, cos) = (std::f32::consts::TAU * k as f32 / 48.0).sin_cos();
        vec3(cos, 0.0, sin)
    };
    tube(&(0..48).map(circle).collect::<Vec<_>>(), 0.15, true)
}

fn cuboid(size: Vec3, center: Vec3) -> Soup {
    let bounds = Bounds { min: center - 0.5 * size, max: center + 0.5 * size };
    let cage = Cage::new(&subdivided_box(bounds, 0.0, [1; 3])).unwrap();
    (cage.positions().to_vec(), cage.triangles().to_vec())
}

#[test]
fn winding_numbers_with_dipoles_equal_the_sum_over_all_triangles() {
    let PolygonMesh { positions, faces } =
        subdivided_box(Bounds { min: Vec3::splat(-0.8), max: Vec3::splat(0.8) }, 0.0, [60; 3]);
    let fine_box = (positions, faces.iter().flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]]).collect());
    for (positions, triangles) in [trousers(), ring(), crate::samples::knot().shells(), fine_box] {
        let soup = super::soup::Soup::new(&positions, &triangles);
        let all = || triangles.iter().map(|t| t.map(|v| positions[v as usize].as_dvec3()));
        for k in 0..216 {
            let point = DVec3::new(f64::from(k % 6), f64::from(k / 6 % 6), f64::from(k / 36)) * 0.4 - 1.01;
            let (found, exact) = (soup.winding(point), winding_number(point, all()));
            assert!((found - exact).abs() < 0.01, "{point}: {found} instead of {exact}");
        }
    }
}

#[test]
fn cage_goes_into_the_gap_between_legs() {
    for target in [40, 80, 200] {
        let made = make(&trousers(), &options(target));
        assert!(made.report.target_met, "{:?}", made.report);
        let between = winding(&made.cage, vec3(0.0, -0.6, 0.0));
        assert!(between.abs() < WINDING_TOLERANCE, "with {target} vertices the legs are webbed: {between}");
    }
}

/// Trunk, two legs with feet and two arms, 1.8 high. `gap`: distance between the legs; `radius`: radius of a leg.
fn mannequin(gap: f32, radius: f32) -> Soup {
    let x = 0.5 * gap + radius;
    let limb = |a: Vec3, b: Vec3, radius: f32| tube(&segment(a, b), radius, false);
    let mut parts = vec![limb(vec3(0.0, 0.9, 0.0), vec3(0.0, 1.8, 0.0), 0.15)];
    for side in [-1.0, 1.0] {
        parts.push(limb(vec3(side * x, 1.0, 0.0), vec3(side * x, 0.0, 0.0), radius));
        parts.push(limb(vec3(side * x, 0.05, 0.0), vec3(side * x, 0.05, 0.15), 0.05));
        parts.push(limb(vec3(side * 0.1, 1.5, 0.0), vec3(side * 0.8, 1.4, 0.0), 0.05));
    }
    join(parts)
}

#[test]
fn a_narrow_gap_stays_open_by_default_and_with_more_voxels() {
    for voxels in [0, 128] {
        // The gap is 4 % of the height.
        let made = make(&mannequin(0.08, 0.12), &CageOptions { voxels, ..CageOptions::default() });
        let between = winding(&made.cage, vec3(0.0, 0.5, 0.0));
        assert!(between.abs() < WINDING_TOLERANCE, "with {voxels} voxels the legs are webbed: {between}");
    }
}

/// The weights of a leg's lower cage vertices sum to nearly 1 at its own foot and to nearly 0 at the other foot.
#[test]
fn lower_cage_vertices_of_a_leg_move_only_its_foot() {
    let mannequins =
        [(0.17, 0.06, 80), (0.1, 0.06, 80), (0.08, 0.05, 120), (0.03, 0.07, 80), (0.025, 0.07, 80)];
    let mannequins = mannequins
        .map(|(gap, radius, target)| (format!("gap {gap}, radius {radius}"), mannequin(gap, radius), target));
    let sample = crate::samples::build("humanoid").unwrap().mesh;
    let sample = ("sample".to_owned(), (sample.positions, sample.triangles), 80);
    for (name, (positions, triangles), target) in mannequins.into_iter().chain([sample]) {
        let bounds = Bounds::around(&positions).unwrap();
        let height = |p: &Vec3| (p.y - bounds.min.y) / bounds.extent().y;
        let cage = generate(&positions, &triangles, &options(target), &NoProgress).unwrap().cage;
        let bind_options = BindOptions { grid: 40, ..BindOptions::default() };
        let bound = bind(&positions, &cage, &bind_options, &NoProgress).unwrap();
        for side in [-1.0, 1.0] {
            let is_lower = |c: &Vec3| {
                let near = |p: &&Vec3| p.distance_squared(*c);
                let nearest = positions.iter().min_by(|p, q| near(p).total_cmp(&near(q))).unwrap();
                height(nearest) < 0.28 && nearest.x * side > 0.0
            };
            let posed: Vec<Vec3> =
                cage.positions().iter().map(|c| if is_lower(c) { *c + Vec3::Z } else { *c }).collect();
            let moved = displacements(&bound.weights, &bound.frames, cage.positions(), &posed);
            let mean = |side: f32| {
                let foot = positions.iter().zip(&moved).filter(|(p, _)| height(p) < 0.08 && p.x * side > 0.0);
                let (sum, n) = foot.fold((0.0, 0.0), |(sum, n), (_, by)| (sum + by.z, n + 1.0));
                sum / n
            };
            let (own, other) = (mean(side), mean(-side));
            assert!(own > 0.8 && other < 0.02, "{name}: own {own}, other {other}");
        }
    }
}

/// A trunk with four legs, 5 % of its length apart in pairs: a gap that few vertices keep stays open with more.
#[test]
fn more_vertices_close_no_gap() {
    let leg = |x: f32, z: f32| cuboid(vec3(0.25, 0.7, 0.14), vec3(x, 0.35, z));
    let legs = [(-0.7, -0.12), (-0.7, 0.12), (0.7, -0.12), (0.7, 0.12)].map(|(x, z)| leg(x, z));
    let soup = join([cuboid(vec3(2.0, 0.4, 0.4), vec3(0.0, 0.85, 0.0))].into_iter().chain(legs));
    for target in [60, 120, 240] {
        let cage = make(&soup, &options(target)).cage;
        for x in [-0.7, 0.0, 0.7] {
            let between = winding(&cage, vec3(x, 0.3, 0.0));
            assert!(between.abs() < WINDING_TOLERANCE, "{target}: closed at {x}: {between}");
        }
    }
}

/// Two rings in one plane have two handles, and so have their cages, although bridges between the rings are mirrored.
#[test]
fn cages_have_no_handle_that_the_model_lacks() {
    let (positions, triangles) = ring();
    let inner = positions.iter().map(|&p| 0.6 * p).collect();
    let soup = join([(positions, triangles.clone()), (inner, triangles)]);
    for target in [60, 120] {
        let CageReport { parts, notices, .. } = make(&soup, &options(target)).report;
        let cage = make(&soup, &options(target)).cage;
        let euler = cage.n_vertices() as i64 - cage.triangles().len() as i64 / 2;
        assert!(i64::from(parts) - euler / 2 <= 2, "{target}: Euler characteristic {euler}, {notices:?}");
    }
}

/// Two plates with a post on one side: the image of the post would close the mouth.
#[test]
fn a_mouth_that_is_open_on_one_side_is_not_mirrored() {
    let plate = |y: f32| cuboid(vec3(1.0, 0.3, 1.0), vec3(0.0, y, 0.0));
    let jaw = join([plate(-0.2), plate(0.2), cuboid(vec3(0.2, 0.7, 1.0), vec3(-0.45, 0.0, 0.0))]);
    let made = make(&jaw, &options(80));
    assert_eq!(made.report.mirror, Some(Mirror::Z));
    let mouth = winding(&made.cage, vec3(0.45, 0.0, 0.0));
    assert!(mouth.abs() < WINDING_TOLERANCE, "the mouth is closed: {mouth}");
}

#[test]
fn a_gap_that_no_lattice_resolves_is_reported() {
    let (positions, triangles) = mannequin(0.004, 0.08);
    let report = generate(&positions, &triangles, &options(80), &NoProgress).unwrap().report;
    let named = report.notices.iter().any(|notice| notice.contains("closes the gap"));
    assert!(named, "{:?}", report.notices);
    // The gap is centred on x = 0, except for a rounding error, here below zero.
    assert!(!report.notices.concat().contains("-0.000"), "{:?}", report.notices);
    let open = mannequin(0.17, 0.06);
    assert_eq!(generate(&open.0, &open.1, &options(120), &NoProgress).unwrap().report.notices, [""; 0]);
}

/// A clearance closes narrow gaps on any lattice, so the lattice must not be refined for such gaps. Otherwise, the
/// voxels become so thin across the gap that the clearance takes hundreds of layers. Along the other axes, where voxels
/// are several times longer, the same number of layers dilates the hull several times too far. Such a hull takes 17 GB
/// of memory.
#[test]
fn clearance_that_closes_a_gap_asks_for_no_finer_lattice() {
    let (positions, triangles) = mannequin(0.03, 0.07);
    let narrow = make(&(positions.clone(), triangles.clone()), &options(80)).report;
    // The gap between the legs is at x = 0; a small one between a leg and the trunk is closed.
    let closes = |notice: &String| notice.contains("closes the gap") && notice.contains("at (0.000");
    assert!(!narrow.notices.iter().any(closes), "it stays open: {narrow:?}");
    let made = make(&(positions.clone(), triangles), &CageOptions { clearance: 0.25, ..options(80) });
    let (model, cage) = (Bounds::around(&positions).unwrap(), Bounds::around(made.cage.positions()).unwrap());
    let farthest = (model.min - cage.min).max(cage.max - model.max).max_element();
    let most = made.report.clearance + 5.0 * made.report.voxel_size;
    assert!(farthest < most, "{farthest} instead of {}: {:?}", made.report.clearance, made.report);
}

/// A sword in one hand is less than 1.5 % of the model's voxels, so the share of voxels with a mirror image does not
/// reveal the asymmetry.
#[test]
fn an_accessory_on_one_side_prevents_mirroring() {
    let sword = tube(&segment(vec3(0.8, 1.4, 0.0), vec3(0.8, 1.4, 0.8)), 0.02, false);
    let soup = join([mannequin(0.17, 0.06), sword]);
    let made = make(&soup, &options(80));
    assert_eq!(made.report.mirror, None);
    assert!(winding(&made.cage, vec3(-0.8, 1.4, 0.7)).abs() < WINDING_TOLERANCE);
    assert_eq!(make(&mannequin(0.17, 0.06), &options(80)).report.mirror, Some(Mirror::X));
}

/// Twelve vertices would bound a straight bar, but bending needs rings at most 1.3 hull thicknesses apart.
#[test]
fn limbs_get_rings_and_compact_models_few_vertices() {
    let bar = tube(&segment(vec3(0.0, 0.0, 0.0), vec3(0.0, 6.0, 0.0)), 0.4, false);
    let made = make(&bar, &options(80));
    let mut heights: Vec<f32> = made.cage.positions().iter().map(|p| p.y).collect();
    heights.sort_by(f32::total_cmp);
    let widest = heights.windows(2).map(|w| w[1] - w[0]).fold(0.0, f32::max);
    assert!(widest < 2.5, "rings are {widest} apart");
    assert!(make(&cuboid(Vec3::ONE, Vec3::ZERO), &options(80)).report.vertices <= 12);
}

/// Limits on vertices and on the share of quads for shapes that a person would enclose with few quads.
#[test]
fn simple_shapes_get_few_vertices_and_mostly_quads() {
    let cube = cuboid(Vec3::ONE, Vec3::ZERO);
    let corner = |k: u8| 0.3 * Vec2::from_angle(std::f32::consts::TAU * f32::from(k) / 48.0);
    let positions = (0..48).map(corner).flat_map(|p| [p.extend(-1.0), p.extend(1.0)]);
    let side = |k: u32| [2 * k, 2 * k + 1, (2 * k + 2) % 96, (2 * k + 3) % 96];
    let cylinder: Soup = (
        positions.chain([-Vec3::Z, Vec3::Z]).collect(),
        (0..48).map(side).flat_map(|[a, b, c, d]| [[a, c, b], [c, d, b], [a, 96, c], [b, d, 97]]).collect(),
    );
    let legs = [(-0.42, -0.42), (-0.42, 0.42), (0.42, -0.42), (0.42, 0.42)];
    let leg = |(x, z)| cuboid(vec3(0.12, 1.0, 0.12), vec3(x, -0.5, z));
    let seat = [cuboid(vec3(1.0, 0.1, 1.0), Vec3::ZERO), cuboid(vec3(1.0, 1.0, 0.1), vec3(0.0, 0.5, -0.45))];
    let chair = join(seat.into_iter().chain(legs.map(leg)));
    for (soup, most, least) in [(cube, 12, 90), (cylinder, 24, 70), (chair, 56, 70)] {
        let report = make(&soup, &options(80)).report;
        assert!(report.vertices <= most, "{report:?}");
        assert!(100 * report.quads >= least * report.faces, "{report:?}");
    }
}

/// A cage can bend a plate only with vertices in the middle of both sides.
#[test]
fn plates_have_vertices_in_the_middle() {
    let made = make(&cuboid(vec3(2.0, 0.08, 1.6), Vec3::ZERO), &options(80));
    for side in [-1.0, 1.0] {
        let is_in_the_middle = |p: &&Vec3| p.y * side > 0.0 && p.x.hypot(p.z) < 0.6;
        let n = made.cage.positions().iter().filter(is_in_the_middle).count();
        assert!((1..9).contains(&n), "{n} vertices in the middle");
    }
}

#[test]
fn cage_of_a_ring_keeps_its_hole() {
    let made = make(&ring(), &options(80));
    assert!(winding(&made.cage, Vec3::ZERO).abs() < WINDING_TOLERANCE);
    // Euler characteristic of a torus: V - E + F = 0. With 2 E = 3 F, as all faces are triangles, 2 V = F.
    assert_eq!(2 * made.cage.n_vertices(), made.cage.triangles().len());
}

#[test]
fn folds_stay_below_120_degrees_for_either_cut_of_quads() {
    for (soup, target) in [(trousers(), 80), (trousers(), 120), (ring(), 80), (ring(), 200)] {
        let mesh = make(&soup, &options(target)).cage.to_polygon_mesh();
        for k in 0..2 {
            let cage = Cage::new(&cut(&mesh, k)).unwrap();
            let triangles: Vec<Corners> = (0..cage.triangles().len())
                .map(|t| Corners { index: cage.triangles()[t], at: cage.triangle_corners(t as u32) })
                .collect();
            let folds = triangles.iter().flat_map(|a| triangles.iter().filter_map(|b| a.fold_cosine(b)));
            let sharpest = folds.fold(1.0, f64::min);
            assert!(sharpest > -0.501, "{target}: {} degrees", sharpest.acos().to_degrees());
        }
    }
}

/// Asserts that mirroring maps the vertices of a cage onto vertices and its faces onto faces.
fn assert_symmetric(cage: &Cage, axis: usize) {
    let (points, center) = (cage.positions(), cage.bounds().center());
    let image = |&p: &Vec3| {
        let mut image = p;
        image[axis] = 2.0 * center[axis] - p[axis];
        let next = (0..points.len())
            .min_by(|&k, &l| points[k].distance(image).total_cmp(&points[l].distance(image)))
            .unwrap();
        let off = points[next].distance(image);
        assert!(off < ROUNDING, "axis {axis}: {p} has no image: the next is {off} away");
        next as u32
    };
    let images: Vec<u32> = points.iter().map(image).collect();
    let sorted = |face: &mut dyn Iterator<Item = u32>| {
        let mut face: Vec<u32> = face.collect();
        face.sort_unstable();
        face
    };
    let faces: Vec<_> = cage.faces().iter().map(|face| sorted(&mut face.iter().copied())).collect();
    for face in &faces {
        let image = sorted(&mut face.iter().map(|&v| images[v as usize]));
        assert!(faces.contains(&image), "axis {axis}: face {face:?} has no image");
    }
}

#[test]
fn cages_are_symmetric_in_every_plane_in_which_the_model_is() {
    let sphere = Cage::new(&subdivided_box(Bounds { min: -Vec3::ONE, max: Vec3::ONE }, 0.0, [6; 3])).unwrap();
    let sphere = (sphere.positions().iter().map(|p| p.normalize()).collect(), sphere.triangles().to_vec());
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let sheet = (corners.map(|[x, z]| vec3(x, 0.0, z)).to_vec(), vec![[0, 2, 1], [0, 3, 2]]);
    // Sections of the ring that are symmetric themselves.
    let (mut around, triangles) = ring();
    for (k, p) in around.iter_mut().enumerate() {
        let [turn, side] = [k / 12 * 15, k % 12 * 60].map(|angle| (0.5 * angle as f32).to_radians());
        let out = 1.0 + 0.15 * side.cos();
        *p = vec3(out * turn.cos(), 0.15 * side.sin(), out * turn.sin());
    }
    for soup in [sphere, sheet, (around, triangles)] {
        let cage = make(&soup, &options(80)).cage;
        (0..3).for_each(|axis| assert_symmetric(&cage, axis));
    }
}

#[test]
fn symmetric_model_gets_a_symmetric_cage() {
    let made = make(&trousers(), &options(80));
    assert_eq!(made.report.mirror, Some(Mirror::X));
    assert_symmetric(&made.cage, 0);
    let without = CageOptions { symmetry: Symmetry::None, ..options(80) };
    assert_eq!(make(&trousers(), &without).report.mirror, None);
}

#[test]
fn an_asymmetric_model_is_mirrored_only_on_request() {
    let soup = tube(&segment(vec3(-1.0, 0.0, 0.3), vec3(1.0, 0.7, -0.4)), 0.1, false);
    assert_eq!(make(&soup, &options(40)).report.mirror, None);
    let asked = CageOptions { symmetry: Symmetry::Y, ..options(40) };
    assert_eq!(make(&soup, &asked).report.mirror, Some(Mirror::Y));
}

#[test]
fn separate_parts_get_one_cage_or_one_each() {
    let places = [vec3(0.0, 0.0, 0.0), vec3(3.0, 0.5, 0.0), vec3(1.0, 2.5, 1.0)];
    let soup = join(places.map(|p| tube(&segment(p, p + vec3(0.3, 0.0, 0.4)), 0.3, false)));
    let CageReport { parts, separate, .. } = make(&soup, &options(80)).report;
    assert_eq!((parts, separate), (1, 3), "bridged");
    let each = CageOptions { per_component: true, ..options(80) };
    assert_eq!(make(&soup, &each).report.parts, 3);
}

/// The cage of nine balls needs a finer lattice than its number of vertices alone, and must not fall back to a coarser one.
/// For 25 balls, 80 vertices are too few.
#[test]
fn a_coarse_lattice_joins_no_components_unless_the_cage_has_too_few_vertices() {
    let balls = |n: u32| {
        let place = |k: u32| 3.0 * vec3((k % n) as f32, (k / n) as f32, 0.0);
        join((0..n * n).map(|k| tube(&segment(place(k), place(k) + 0.1 * Vec3::Z), 1.0, false)))
    };
    let each = CageOptions { per_component: true, ..options(80) };
    let nine = make(&balls(3), &each).report;
    assert_eq!((nine.parts, nine.notices), (9, vec![]));
    let many = make(&balls(5), &each).report;
    assert!(many.parts < 25, "{}", many.parts);
    let remedy = "for 25 components of the model; for a part each, allow more than 80 vertices";
    assert!(many.notices[0].ends_with(remedy), "{:?}", many.notices);
}

/// Two frames of bars, each in the gaps of the other, are kept apart only by lattices on which their hulls have some
/// hundred thousand vertices.
#[test]
fn components_that_only_a_fine_lattice_keeps_apart_get_one_part() {
    let bars = (0..3 * 36 * 2).map(|k| {
        let [axis, at, frame] = [k % 3, k / 3 % 36, k / 108];
        let mut low = [at as f32 % 6.0, (at / 6) as f32, 0.0];
        let mut high = [low[0], low[1], 5.0];
        low.rotate_right(axis);
        high.rotate_right(axis);
        let [low, high] = [low, high].map(|p| Vec3::from_array(p) + 0.5 * frame as f32);
        tube(&segment(low, high), 0.02, false)
    });
    let each = CageOptions { per_component: true, ..options(20) };
    let made = make(&join(bars), &each).report;
    assert!(made.hull_vertices < MAX_FINE_HULL as u32, "{}", made.hull_vertices);
    let sentence = "the cage has 1 closed part for 2 components of the model; for a part each, make their cages from \
                    files of their own: a lattice that keeps them apart would be too fine";
    assert_eq!(made.notices[0], sentence);
}

/// With a limit on the searches, the hull is not simplified, and a coarser lattice follows.
#[test]
fn collapsing_ends_when_the_searches_take_too_long() {
    let soup = tube(&segment(Vec3::ZERO, Vec3::X), 0.2, false);
    let options = options(20);
    let bounds = check_input(&soup.0, &soup.1, &options).unwrap();
    let of = (Mirrors::NONE, usize::MAX);
    let hull = VoxelHull::new(&soup.0, &soup.1, bounds, (36, DVec3::ONE), of, &options, &|_| Ok(()));
    let shell = hull.unwrap().smoothed();
    let simplified = |visits| {
        let effort = Effort(Cell::new(visits));
        let made = simplify_hull(&shell, &options, true, &effort, &|_| Ok(())).unwrap();
        (matches!(made, Simplification::TooMany(_)), effort.0.get())
    };
    let (is_too_much, left) = simplified(MAX_VISITS);
    assert!(!is_too_much && left < MAX_VISITS);
    let needed = MAX_VISITS - left;
    assert_eq!(simplified(needed), (true, simplified(needed).1));
    assert!(simplified(needed).1 > 0, "half of the visits are left for coarser lattices");
}

/// Makes a smooth cage of a tube with a limit on the visits.
fn smooth_tube(visits: u64) -> Result<GeneratedCage, CageGenError> {
    let (positions, triangles) = tube(&segment(Vec3::ZERO, Vec3::X), 0.2, false);
    let options = CageOptions { smooth: 1, ..options(20) };
    smooth::generate(&positions, &triangles, &options, &Effort(Cell::new(visits)), &NoProgress)
}

/// Of eight clearances, the first ones are tried while most of the visits are left, and then the largest.
#[test]
fn smooth_cages_skip_clearances_when_the_searches_take_too_long() {
    let attempts = |visits| smooth_tube(visits).unwrap().report.attempts;
    assert!(attempts(MAX_VISITS) < 8, "{}", attempts(MAX_VISITS));
    assert_eq!(attempts(MAX_VISITS / 2 - 1), 8);
}

#[test]
fn an_error_says_that_the_searches_took_too_long() {
    let made = smooth_tube(0);
    assert!(matches!(made, Err(CageGenError::TooLong)), "{:?}", made.map(|made| made.report));
}

#[test]
fn hull_spans_the_gap_between_the_legs() {
    let hull = CageOptions { kind: CageKind::Hull, ..options(16) };
    let made = make(&trousers(), &hull);
    assert!(made.report.target_met);
    assert!(
        (winding(&made.cage, vec3(0.0, -0.6, 0.0)) - 1.0).abs() < WINDING_TOLERANCE,
        "the hull spans the gap between the legs"
    );
}

#[test]
fn clearance_is_kept() {
    let soup = trousers();
    for clearance in [0.0, 0.02, 0.1] {
        let made = make(&soup, &CageOptions { clearance, ..options(60) });
        assert!(made.report.clearance >= clearance * 2.0, "the diagonal is longer than 2");
        // Each cage vertex keeps the clearance along some axis, up to rounding, so its distance is about that or more.
        for c in made.cage.positions() {
            let nearest = soup.0.iter().map(|p| p.distance(*c)).fold(f32::MAX, f32::min);
            assert!(nearest >= 0.97 * made.report.clearance, "{nearest} < {}", made.report.clearance);
        }
    }
}

#[test]
fn flat_straight_and_single_point_models_are_enclosed() {
    let square = vec![Vec3::ZERO, Vec3::X, vec3(1.0, 1.0, 0.0), Vec3::Y];
    make(&(square, vec![[0, 1, 2], [0, 2, 3]]), &options(24));
    make(&(vec![Vec3::ZERO, Vec3::ONE, 0.3 * Vec3::ONE], vec![[0, 1, 2]]), &options(24));
    make(&(vec![vec3(5.0, -3.0, 2.0)], vec![]), &options(12));
    make(&(vec![Vec3::ZERO], vec![]), &options(12));
}

#[test]
fn a_cage_far_from_the_origin_is_coarser_but_valid() {
    let far = trousers().0.iter().map(|&p| p + vec3(3e4, -1e4, 0.0)).collect();
    make(&(far, trousers().1), &options(60));
}

#[test]
fn invalid_input_is_an_error_with_a_message() {
    let (positions, triangles) = trousers();
    let refused = |p: &[Vec3], t: &[[u32; 3]], o: &CageOptions| generate(p, t, o, &NoProgress).unwrap_err();
    assert_eq!(refused(&[], &[], &options(80)), CageGenError::Empty);
    let mut broken = positions.clone();
    broken[7].y = f32::NAN;
    assert_eq!(refused(&broken, &triangles, &options(80)), CageGenError::NotFinite { vertex: 7 });
    let error = refused(&positions, &[[0, 1, 9999]], &options(80));
    assert!(matches!(error, CageGenError::Index { triangle: 0, vertex: 9999, .. }));
    assert!(matches!(
        refused(&positions, &triangles, &options(5)),
        CageGenError::Option(RangeError { option: "target", .. })
    ));
    let wide = CageOptions { clearance: 0.5, ..options(80) };
    assert!(matches!(
        refused(&positions, &triangles, &wide),
        CageGenError::Option(RangeError { option: "clearance", .. })
    ));
    let huge: Vec<Vec3> = positions.iter().map(|&p| p * 1e30).collect();
    assert!(matches!(refused(&huge, &triangles, &options(80)), CageGenError::Size { .. }));
    let tiny: Vec<Vec3> = positions.iter().map(|&p| p * 1e-20).collect();
    assert!(matches!(refused(&tiny, &triangles, &options(80)), CageGenError::Diagonal { .. }));
}

#[test]
fn cancelling_stops_generation() {
    let (positions, triangles) = trousers();
    let cancel = |_: ProgressEvent| ControlFlow::Break(());
    let error = generate(&positions, &triangles, &options(80), &cancel).unwrap_err();
    assert!(matches!(error, CageGenError::Cancelled(_)));
}

#[test]
fn generation_is_deterministic() {
    let soup = trousers();
    let once = make(&soup, &options(60)).cage;
    let twice = make(&soup, &options(60)).cage;
    assert_eq!((once.positions(), once.faces()), (twice.positions(), twice.faces()));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn any_soup_gets_a_verified_cage(
        points in prop::collection::vec(prop::array::uniform3(-1.0_f32..1.0), 1..40),
        picks in prop::collection::vec(prop::array::uniform3(0_usize..1000), 0..60),
        stretch in prop::array::uniform3(prop_oneof![Just(0.0_f32), Just(1.0), 0.01_f32..3.0]),
        scale in prop_oneof![Just(1.0_f32), Just(1e-6), Just(1e6)],
        target in 12_u32..150,
        symmetry in prop_oneof![Just(Symmetry::Auto), Just(Symmetry::None), Just(Symmetry::Z)],
        per_component in any::<bool>(),
    ) {
        let positions: Vec<Vec3> =
            points.iter().map(|&p| Vec3::from_array(p) * Vec3::from_array(stretch) * scale).collect();
        let triangles: Vec<[u32; 3]> =
            picks.iter().map(|t| t.map(|i| (i % positions.len()) as u32)).collect();
        let soup = (positions, triangles);
        make(&soup, &CageOptions { target, symmetry, per_component, ..CageOptions::default() });
    }
}

/// Winding numbers show that the smooth surface encloses the model; the cage itself need not enclose it.
#[test]
fn the_smooth_surface_of_a_cage_encloses_the_model() {
    for (soup, smooth) in [(trousers(), 1), (trousers(), 2), (ring(), 2)] {
        for symmetry in [Symmetry::Auto, Symmetry::None] {
            let options = CageOptions { smooth, symmetry, ..options(80) };
            let made = generate(&soup.0, &soup.1, &options, &NoProgress).unwrap();
            let fine = subdivide(&made.cage.to_polygon_mesh(), smooth).mesh;
            let surface = Cage::new(&fine).unwrap();
            let outside = soup.0.iter().filter(|&&p| winding(&surface, p) < 0.5).count();
            assert_eq!(outside, 0, "{} vertices, {symmetry:?}", made.report.vertices);
            assert_eq!(made.report.mirror.is_some(), symmetry == Symmetry::Auto);
        }
    }
}

#[test]
fn many_large_triangles_get_a_coarse_lattice() {
    let n = 100_000;
    let ring = (0..n).map(|i| vec3((i as f32).cos(), (i as f32).sin(), 1.0));
    let positions: Vec<Vec3> = [Vec3::ZERO].into_iter().chain(ring).collect();
    let triangles: Vec<[u32; 3]> = (1..n).map(|i| [0, i, i + 1]).collect();
    let made = generate(&positions, &triangles, &options(400), &NoProgress).unwrap();
    // 80 voxels would follow from the target. The bounding box of a triangle has about 4000 rows of 128 voxels.
    let most = 128.0 * (MAX_ROWS / (4000.0 * f64::from(n))).sqrt();
    assert!(f64::from(made.report.voxels) < 1.05 * most, "{} voxels, not {most}", made.report.voxels);
}

#[test]
fn repeated_triangles_count_once() {
    let lattice = Lattice::around([DVec3::ZERO, DVec3::ONE], 128, DVec3::ONE, 0);
    let rows = lattice.n_rows(&[Vec3::ZERO, Vec3::Y, Vec3::Z], &[[0, 1, 2]; 50], &|_| Ok(()));
    assert_eq!(rows, Ok(128 * 128), "the rows of a square");
}
