use cagework_cage::generate::{CageOptions, generate};
use cagework_core::deform::deform_bound;
use cagework_core::options::{Method, Solver};
use cagework_core::progress::NoProgress;
use cagework_core::{
    BindOptions, Binding, Bounds, ControlSet, Controls, InnerControls, InnerElement, subdivided_box,
};
use cagework_gpu::{ContextOptions, GpuContext, bind_on};
use cagework_tests::cages::{blocks, cage, cuboid, icosphere};
use cagework_tests::creature::creature;
use cagework_tests::points::is_inside;
use cagework_tests::{RandomGenerator, dense};
use glam::{Mat3, Quat, Vec3, Vec3Swizzles as _};
use pollster::block_on;

use crate::support::{bound, samples, scattered};

/// Weights of one control at all points. `[n_points]`
fn column(binding: &Binding, control: usize) -> Vec<f64> {
    binding.weights.column(control as u32).map(f64::from).collect()
}

fn points_at(positions: &[Vec3], radius: f32) -> InnerControls {
    let elements = (0..positions.len() as u32).map(InnerElement::Point).collect();
    InnerControls { positions: positions.to_vec(), elements, radius: Some(radius) }
}

/// Creates a ball of radius 1/4 in the centre of a sphere of radius 1.
fn ball_in_sphere() -> ControlSet {
    ControlSet::new(&cage(&icosphere(3)), 0, points_at(&[Vec3::ZERO], 0.25)).unwrap()
}

/// Between concentric spheres of radius R = 1/4 and 1, the harmonic function that is 1 on the inner sphere and 0 on the
/// outer one is (1/r - 1) / (1/R - 1) = (1/r - 1) / 3.
#[test]
fn weight_of_a_ball_in_a_sphere_matches_the_formula() {
    let set = ball_in_sphere();
    let radii = [0.35_f32, 0.5, 0.65, 0.8];
    let directions = scattered(40, Vec3::NEG_ONE, Vec3::ONE);
    let points: Vec<Vec3> =
        directions.iter().flat_map(|d| radii.map(|r| r * d.normalize_or(Vec3::X))).collect();
    let binding = bound(&points, &set, |options| options.grid = 64);
    let weights = column(&binding, set.cage().n_vertices());
    for (k, r) in radii.iter().enumerate() {
        let mean = weights.iter().skip(k).step_by(radii.len()).sum::<f64>() / directions.len() as f64;
        let expected = (1.0 / f64::from(*r) - 1.0) / 3.0;
        let error = (mean / expected - 1.0).abs();
        assert!(error < 0.03, "r = {r}: {mean}, not {expected}");
    }
}

/// Next to the ball, weights match the formula (1/r - 1) / 3 within 5e-3 in each direction, not only on average. Linear
/// interpolation alone misses by up to 6.3e-3. The cage is an icosphere of four subdivisions, whose deviation from a
/// sphere is negligible.
#[test]
fn weights_next_to_a_ball_match_the_formula_in_every_direction() {
    let set = ControlSet::new(&cage(&icosphere(4)), 0, points_at(&[Vec3::ZERO], 0.25)).unwrap();
    let ball = set.cage().n_vertices();
    let options = BindOptions { grid: 64, tau: 1e-7, ..BindOptions::default() };
    let directions = scattered(60, Vec3::NEG_ONE, Vec3::ONE);
    let radii = [0.26_f32, 0.27, 0.3, 0.35, 0.4];
    let points: Vec<Vec3> =
        radii.iter().flat_map(|r| directions.iter().map(move |d| r * d.normalize_or(Vec3::X))).collect();
    let weights = &samples(&points, Controls::from(&set), &options)[ball];
    for (p, w) in points.iter().zip(weights) {
        let expected = (1.0 / f64::from(p.length()) - 1.0) / 3.0;
        assert!((f64::from(*w) - expected).abs() < 5e-3, "{p}: {w}, not {expected}");
    }
}

/// A straight bone in a limb is bent at its middle joint. In each direction of the bend, the points around the bone
/// rotate with its moved half, without twist about the bone, and are not torn apart at the joint.
#[test]
fn bent_bone_rotates_the_points_around_it_without_twist() {
    let joints = [-0.6_f32, 0.0, 0.6].map(|z| Vec3::new(0.0, 0.0, z));
    let inner = InnerControls {
        positions: joints.to_vec(),
        elements: vec![InnerElement::Line(vec![0, 1, 2])],
        radius: Some(0.0625),
    };
    let limb = cuboid(Vec3::new(-0.16, -0.16, -1.0), Vec3::new(0.16, 0.16, 1.0));
    let set = ControlSet::new(&cage(&limb), 0, inner).unwrap();
    let at = |z: i16, k: i16| {
        let (sin, cos) = (f32::from(k) * std::f32::consts::TAU / 8.0).sin_cos();
        Vec3::new(0.05 * cos, 0.05 * sin, 0.01 * f32::from(z))
    };
    let points: Vec<Vec3> = (-50..=50).flat_map(|z| (0..8).map(move |k| at(z, k))).collect();
    let binding = bound(&points, &set, |options| options.grid = 64);
    for way in [0.0_f32, 1.6, 3.5, 5.0] {
        for degrees in [5.0_f32, 20.0, 60.0] {
            let turn = Quat::from_axis_angle(Vec3::new(way.cos(), way.sin(), 0.0), degrees.to_radians());
            let mut controls = Controls::from(&set).rest().to_vec();
            *controls.last_mut().unwrap() = turn * joints[2];
            let posed = deform_bound(&binding.weights, &binding.frames, &controls);
            for (v, p) in points.iter().enumerate().filter(|(_, p)| (0.18..0.32).contains(&p.z)) {
                // Compare with the opposite point across the bone, and with a point further along the bone.
                for other in [v - v % 8 + (v + 4) % 8, v + 80] {
                    let [rest, posed] = [points[other] - *p, posed[other] - posed[v]];
                    let off = (turn * rest).angle_between(posed).to_degrees();
                    assert!(off < 1.0, "{way} {degrees}: {p} is off by {off} degrees");
                }
            }
            if degrees <= 20.0 {
                for v in 8..points.len() {
                    let stretch = posed[v].distance(posed[v - 8]) / points[v].distance(points[v - 8]);
                    assert!((0.7..1.3).contains(&stretch), "{way} {degrees}: {stretch} at {}", points[v]);
                }
            }
        }
    }
}

/// A sheet separates two halves of a box: points in one half have no weight of the cage vertices of the other half.
#[test]
fn sheet_across_a_box_separates_its_halves() {
    let corners = [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [1.0, 0.0, 1.0]];
    let inner = InnerControls {
        positions: corners.map(Vec3::from).to_vec(),
        elements: vec![InnerElement::Face(vec![0, 1, 2, 3])],
        radius: None,
    };
    let set = ControlSet::new(&cage(&blocks(&[[0, 0, 0], [1, 0, 0]])), 0, inner).unwrap();
    let points = scattered(400, Vec3::splat(0.01), Vec3::new(1.99, 0.99, 0.99));
    let binding = bound(&points, &set, |options| options.grid = 33);
    let at = set.cage().positions();
    for (v, p) in points.iter().enumerate() {
        let (columns, weights) = binding.weights.row(v);
        let is_beyond = |c: usize| c < at.len() && at[c].x != 1.0 && (at[c].x > 1.0) != (p.x > 1.0);
        let beyond = columns.iter().zip(weights).filter(|(c, _)| is_beyond(**c as usize));
        let most = beyond.map(|(_, w)| *w).fold(0.0, f32::max);
        assert!(most < 1e-6, "{p}: {most}");
        let of_sheet: f32 =
            columns.iter().zip(weights).filter(|(c, _)| **c as usize >= at.len()).map(|(_, w)| w).sum();
        // Near the middle of the sheet the sheet's weights sum to nearly 1; near the walls the cage's weights dominate.
        let is_close = (p.x - 1.0).abs() < 0.05 && (p.yz() - 0.5).abs().max_element() < 0.3;
        assert!(of_sheet > 0.0 && (!is_close || of_sheet > 0.8), "{p}: {of_sheet}");
    }
    assert!(binding.outside.is_empty());
}

/// Around a straight bone, the weights at a point are linear in the projection of the point onto the bone's axis.
#[test]
fn weights_are_linear_along_a_tube() {
    let (a, b, radius) = (Vec3::new(-0.6, 0.1, 0.0), Vec3::new(0.5, -0.2, 0.1), 0.1);
    let inner = InnerControls {
        positions: vec![a, b],
        elements: vec![InnerElement::Line(vec![0, 1])],
        radius: Some(radius),
    };
    let set = ControlSet::new(&cage(&cuboid(Vec3::NEG_ONE, Vec3::ONE)), 0, inner).unwrap();
    let way = (b - a).normalize();
    let side = way.any_orthonormal_vector();
    let shares: Vec<f32> = (1..20).map(|k| k as f32 / 20.0).collect();
    // Distances of the points from the axis, inside and just outside the bone's surface, each with the largest allowed
    // error.
    for (distance, most) in [(0.5 * radius, 1e-4), (1.06 * radius, 0.02)] {
        let around = |s: f32| {
            (0..6).map(move |k| a.lerp(b, s) + Quat::from_axis_angle(way, k as f32) * (distance * side))
        };
        let points: Vec<Vec3> = shares.iter().flat_map(|&s| around(s)).collect();
        let binding = bound(&points, &set, |options| options.grid = 64);
        let [of_a, of_b] = [8, 9].map(|control| column(&binding, control));
        for (v, s) in shares.iter().flat_map(|&s| [f64::from(s); 6]).enumerate() {
            let both = of_a[v] + of_b[v];
            assert!(both > 0.9 && (of_b[v] / both - s).abs() < most, "{}: {} of {both}", points[v], of_b[v]);
        }
    }
}

/// Creates a cage with a ball, a bent bone and a sheet inside.
fn all_kinds() -> ControlSet {
    let inner = InnerControls {
        positions: [
            [-0.5, 0.5, 0.2],
            [-0.6, -0.5, 0.0],
            [0.0, -0.4, 0.1],
            [0.5, -0.6, 0.3],
            [0.3, 0.2, -0.4],
            [0.7, 0.3, -0.5],
            [0.6, 0.7, -0.4],
        ]
        .map(Vec3::from)
        .to_vec(),
        elements: vec![
            InnerElement::Point(0),
            InnerElement::Line(vec![1, 2, 3]),
            InnerElement::Face(vec![4, 5, 6]),
        ],
        radius: Some(0.08),
    };
    ControlSet::new(&cage(&cuboid(Vec3::NEG_ONE, Vec3::ONE)), 0, inner).unwrap()
}

/// Creates points in the cage of [`all_kinds`], with extra points inside inner controls and next to them.
fn everywhere() -> Vec<Vec3> {
    let mut points = scattered(1500, Vec3::splat(-0.99), Vec3::splat(0.99));
    for center in [Vec3::new(-0.5, 0.5, 0.2), Vec3::new(0.0, -0.4, 0.1)] {
        points.extend(scattered(300, center - 0.1, center + 0.1));
    }
    points
}

/// The radius is a length, not a number of cells, so weights converge under refinement of the grid.
#[test]
fn refinement_converges_with_the_radius_fixed() {
    let set = all_kinds();
    let points = scattered(600, Vec3::splat(-0.95), Vec3::splat(0.95));
    let [coarse, middle, fine] =
        [32, 64, 128].map(|grid| bound(&points, &set, |options| options.grid = grid));
    let difference = |a: &Binding, b: &Binding| {
        let n = set.cage().n_vertices() + set.inner().positions.len();
        let of_column =
            |c: usize| column(a, c).iter().zip(column(b, c)).map(|(a, b)| (a - b).abs()).sum::<f64>();
        (0..n).map(of_column).sum::<f64>() / points.len() as f64
    };
    let (first, second) = (difference(&coarse, &middle), difference(&middle, &fine));
    assert!(second < 0.6 * first && second < 5e-3, "{first}, then {second}");
}

/// Affine maps of all controls are reproduced. Inside inner controls and next to them, the weighted mean of the
/// controls misses the point; the columns of [`Binding::frames`] add the difference.
#[test]
fn affine_maps_of_all_controls_are_reproduced() {
    let set = all_kinds();
    let points = everywhere();
    for method in [Method::Embedded, Method::Classic] {
        let binding = bound(&points, &set, |options| {
            (options.grid, options.method, options.tau) = (32, method, 1e-5);
        });
        let report = &binding.report;
        assert_eq!((report.outside_vertices, report.cage_vertices, report.inner_controls), (0, 8, 7));
        // The classic method does not reproduce linear functions.
        if method == Method::Classic {
            continue;
        }
        assert!(report.held_vertices > 50, "{}", report.held_vertices);
        let n_controls = Controls::from(&set).n_controls() as u32;
        assert!(binding.weights.columns(0..n_controls).data().iter().all(|&w| w >= 0.0));
        let matrix = Mat3::from_cols_array(&[1.5, 0.4, -0.2, 0.1, 0.7, 0.3, -0.6, 0.2, 1.2]);
        for (matrix, shift) in [(Mat3::IDENTITY, Vec3::ZERO), (matrix, Vec3::new(3.0, 2.0, 1.0))] {
            let motion = |p: Vec3| matrix * p + shift;
            let controls: Vec<Vec3> = Controls::from(&set).rest().iter().map(|&p| motion(p)).collect();
            let posed = deform_bound(&binding.weights, &binding.frames, &controls);
            for (p, at) in points.iter().zip(posed) {
                // The tolerance is 1e-5 of the cage's size of 2.
                assert!(at.distance(motion(*p)) < 2e-5, "{p}: {at}");
            }
        }
    }
}

/// Points inside a ball are translated with it and do not rotate.
#[test]
fn points_inside_a_ball_follow_it() {
    let set = all_kinds();
    let center = set.inner().positions[0];
    let points = scattered(50, center - 0.04, center + 0.04);
    let binding = bound(&points, &set, |options| options.grid = 32);
    let by = Vec3::new(0.1, -0.05, 0.2);
    let mut controls = Controls::from(&set).rest().to_vec();
    controls[8] += by;
    let posed = deform_bound(&binding.weights, &binding.frames, &controls);
    for (p, at) in points.iter().zip(posed) {
        assert!(at.distance(*p + by) < 1e-6, "{p}: {at}");
    }
}

/// Points inside a ball follow it even if the ball reaches through the cage, and do not count as outside the cage.
#[test]
fn points_inside_a_ball_that_reaches_through_the_cage_follow_it() {
    let walls = cage(&subdivided_box(Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE }, 0.0, [1; 3]));
    for (y, reaches) in [(0.93, false), (0.95, true), (0.99, true)] {
        let set = ControlSet::new(&walls, 0, points_at(&[y * Vec3::Y], 0.0625)).unwrap();
        assert_eq!(set.reaching(), if reaches { &[0][..] } else { &[] }, "{y}");
        let points: Vec<Vec3> = [-0.05, -0.02, 0.0, 0.005].map(|d| (y + d) * Vec3::Y).into();
        let binding = bound(&points, &set, |options| options.grid = 32);
        assert!(binding.outside.is_empty(), "{y}: {:?}", binding.outside);
        let notice = binding.report.notices.iter().find(|notice| notice.contains("through the cage"));
        assert_eq!(notice.is_some(), reaches, "{:?}", binding.report.notices);
        // The wall is at y = 1.
        let remedy = format!("use a radius below {:.3e}, or move it inwards.", 1.0 - f64::from(y));
        assert!(notice.is_none_or(|notice| notice.ends_with(&remedy)), "{notice:?}");
        let mut controls = Controls::from(&set).rest().to_vec();
        controls[8] += 0.1 * Vec3::X;
        for (p, at) in points.iter().zip(deform_bound(&binding.weights, &binding.frames, &controls)) {
            assert!(at.distance(*p + 0.1 * Vec3::X) < 1e-6, "{y}, {p}: {at}");
        }
    }
}

/// Weights on one thread and on all threads are identical. Weights on the GPU differ from them by less than 1e-4, and
/// classic weights by less than 0.01 on average.
#[test]
fn back_ends_and_methods_agree_on_inner_controls() {
    let set = all_kinds();
    let points = everywhere();
    let options = BindOptions { grid: 48, threads: 1, ..BindOptions::default() };
    let edit = |threads: usize| move |o: &mut BindOptions| *o = BindOptions { threads, ..options };
    let (one, all) = (bound(&points, &set, edit(1)), bound(&points, &set, edit(0)));
    assert_eq!((&one.weights, &one.frames), (&all.weights, &all.frames));
    let context = block_on(GpuContext::new(&ContextOptions::default())).expect("a Vulkan adapter");
    let gpu =
        block_on(bind_on(&points, &set, &options, &NoProgress, &context)).expect("points inside are bound");
    let classic = bound(&points, &set, |o| {
        *o = BindOptions { method: Method::Classic, solver: Solver::Multigrid, ..options };
    });
    let n = Controls::from(&set).n_controls();
    let (mut sum, mut count) = (0.0, 0);
    for c in 0..n {
        for ((a, b), published) in column(&one, c).iter().zip(column(&gpu, c)).zip(column(&classic, c)) {
            assert!((a - b).abs() < 1e-4, "control {c}: {a} and {b}");
            sum += (a - published).abs();
            count += 1;
        }
    }
    // Classic weights are constant in a cell, so their mean error is a fraction of the change across a cell.
    let mean = sum / f64::from(count);
    assert!(mean < 0.01, "{mean}");
    let deformed = |b: &Binding| {
        let mut controls = Controls::from(&set).rest().to_vec();
        controls[9] += Vec3::new(0.0, 0.2, 0.1);
        deform_bound(&b.weights, &b.frames, &controls)
    };
    let apart = deformed(&one).iter().zip(deformed(&gpu)).map(|(a, b)| a.distance(b)).fold(0.0, f32::max);
    assert!(apart < 1e-4, "{apart}");
}

/// 64 balls that are smaller than the cells of coarse levels. V-cycles alone converge slowly or diverge here, so the
/// solver switches to conjugate gradients, which run on the processor even if the bind runs on a GPU. The expected
/// weights are computed by conjugate gradients alone.
#[test]
fn many_small_balls_do_not_stall_the_solve() {
    let places = [-0.787_f32, -0.254, 0.280, 0.813];
    let at = |k: usize| Vec3::new(places[k % 4], places[k / 4 % 4], places[k / 16]);
    let balls: Vec<Vec3> = (0..64).map(at).collect();
    let set = ControlSet::new(&cage(&cuboid(Vec3::NEG_ONE, Vec3::ONE)), 0, points_at(&balls, 0.08)).unwrap();
    let points = scattered(60, Vec3::splat(-0.97), Vec3::splat(0.97));
    let options = BindOptions { grid: 16, tau: 1e-5, threads: 1, ..BindOptions::default() };
    let expected = bound(&points, &set, |o| {
        *o = BindOptions { solver: Solver::ConjugateGradient, tau: 1e-7, ..options };
    });
    let one = bound(&points, &set, |o| *o = options);
    let all = bound(&points, &set, |o| *o = BindOptions { threads: 0, ..options });
    assert_eq!(one.weights, all.weights);
    // This limit leaves no room for the fields of conjugate gradients: the cycles go on without them.
    let limit = one.report.memory_bytes.estimated;
    let tight = bound(&points, &set, |o| *o = BindOptions { memory_limit: limit, ..options }).report;
    assert!(!tight.notices.iter().any(|n| n.contains("conjugate gradients")), "{:?}", tight.notices);
    assert!(tight.memory_bytes.peak < one.report.memory_bytes.peak, "{:?}", tight.memory_bytes);
    let context = block_on(GpuContext::new(&ContextOptions::default())).expect("a Vulkan adapter");
    let gpu =
        block_on(bind_on(&points, &set, &options, &NoProgress, &context)).expect("points inside are bound");
    for binding in [one, gpu] {
        let report = &binding.report;
        assert!(report.converged && report.iterations <= 15, "{:?}", report.delta_history);
        assert!(report.notices.iter().any(|n| n.contains("conjugate gradients")), "{:?}", report.notices);
        for c in 0..Controls::from(&set).n_controls() {
            for (w, expected) in column(&binding, c).iter().zip(column(&expected, c)) {
                // The tolerance is ten times the tau of the bind.
                assert!((w - expected).abs() < 1e-4, "control {c}: {w}, not {expected}");
            }
        }
        // Conjugate gradients need another five fields of 8 columns of f32.
        let fallback = 5 * 32 * report.levels[0] * report.threads as u64;
        let memory = report.memory_bytes;
        assert!(memory.estimated + fallback >= memory.peak, "{memory:?}");
    }
}

/// Finds the largest jump of a weight on lines near the points `corners`: the change between points 1/250 of a cell
/// apart, minus the larger of the changes in the previous and in the next step. The lines keep a distance of at least
/// 0.1 cells from all `corners`.
fn largest_jump(set: &ControlSet, corners: &[Vec3], grid: u32) -> f32 {
    let cell = set.cage().bounds().extent().max_element() / grid as f32;
    let mut random = RandomGenerator::new(81);
    let n_lines = corners.len().max(40);
    let lines = (0..10 * n_lines).map(|k| {
        let near = corners[k % corners.len()] + 0.3 * cell * random.point(Vec3::NEG_ONE, Vec3::ONE);
        let ends = [0, 1].map(|_| near + cell * random.point(Vec3::NEG_ONE, Vec3::ONE));
        let n = (ends[0].distance(ends[1]) / (0.004 * cell)).ceil() as usize;
        let line: Vec<Vec3> = (0..=n).map(|k| ends[0].lerp(ends[1], k as f32 / n as f32)).collect();
        // Keep a distance from the corners, at which the exact field is arbitrarily steep.
        let is_clear = |p: &Vec3| corners.iter().all(|c| c.distance(*p) > 0.1 * cell);
        if line.iter().all(|p| is_clear(p) && is_inside(set.cage(), *p)) { line } else { Vec::new() }
    });
    let lines: Vec<Vec<Vec3>> = lines.filter(|line| line.len() > 3).take(n_lines).collect();
    assert_eq!(lines.len(), n_lines);
    let weights = dense(&bound(&lines.concat(), set, |o| o.grid = grid).weights);
    let mut rows = weights.chunks(Controls::from(set).n_controls());
    let mut largest = 0.0f32;
    for line in &lines {
        let rows: Vec<&[f32]> = rows.by_ref().take(line.len()).collect();
        let change = |w: &[&[f32]]| w[0].iter().zip(w[1]).map(|(b, a)| (b - a).abs()).fold(0.0, f32::max);
        let changes: Vec<f32> = rows.windows(2).map(change).collect();
        largest = changes.windows(3).map(|c| c[1] - c[0].max(c[2])).fold(largest, f32::max);
    }
    largest
}

/// At the tip of a spike, at the corners of a sheet and at the vertices of a generated cage, where re-entrant edges end,
/// weights jump by at most 3e-3 at g = 64, and by more at g = 32 unless both jumps are below 1e-3. (The sampler blends the
/// values of rays that hit an edge and rays that miss it. The test fails if it does not do so just beyond the end of an
/// edge.)
#[test]
fn weights_do_not_jump_where_re_entrant_edges_end() {
    let tip = Vec3::new(0.05, 0.03, -0.3);
    let mut spiked = cuboid(Vec3::NEG_ONE, Vec3::ONE);
    let is_top = |face: &[u32]| face.iter().all(|&i| spiked.positions[i as usize].z == 1.0);
    let place = spiked.faces.iter().position(|face| is_top(face)).unwrap();
    let top = spiked.faces.remove(place);
    spiked.positions.push(tip);
    spiked.faces.extend((0..4).map(|k| vec![top[k], top[(k + 1) % 4], 8]));
    let spike = ControlSet::new(&cage(&spiked), 0, InnerControls::default()).unwrap();
    let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.4, -0.9, 1.3);
    let corners =
        [(-0.4, -0.4), (0.4, -0.4), (0.4, 0.4), (-0.4, 0.4)].map(|(x, y)| turn * Vec3::new(x, y, 0.02));
    let inner = InnerControls {
        positions: corners.to_vec(),
        elements: vec![InnerElement::Face(vec![0, 1, 2, 3])],
        radius: None,
    };
    let sheet = ControlSet::new(&cage(&cuboid(Vec3::NEG_ONE, Vec3::ONE)), 0, inner).unwrap();
    let creature = creature();
    let generated = generate(&creature.positions, &creature.triangles, &CageOptions::default(), &NoProgress)
        .unwrap()
        .cage;
    let vertices = generated.positions().to_vec();
    let generated = ControlSet::new(&generated, 0, InnerControls::default()).unwrap();
    let cases = [(spike, vec![tip]), (sheet, corners.to_vec()), (generated, vertices)];
    for (set, corners) in cases {
        let [coarse, fine] = [32, 64].map(|grid| largest_jump(&set, &corners, grid));
        println!("jumps of {coarse} at g = 32, {fine} at g = 64");
        assert!(fine <= 3e-3 && fine < coarse.max(1e-3), "{coarse} at g = 32, {fine} at g = 64");
    }
}
