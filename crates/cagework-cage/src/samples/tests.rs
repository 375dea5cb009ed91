use crate::check::{Severity, check};
use crate::generate::{CageOptions, generate};
use glam::{DVec3, Vec3};

use super::{PULLED_UNIT, Recipe, Sample, all, build, knot};
use cagework_core::bind::bind;
use cagework_core::bind::fineness::ROUGH_GRID;
use cagework_core::cage::Cage;
use cagework_core::frames::Frames;
use cagework_core::geometry::winding_number;
use cagework_core::options::BindOptions;
use cagework_core::progress::NoProgress;
use cagework_core::splats::color_along;
use cagework_pose::pull::{Drag, DragOptions, Grip, Handle, Probes, Pull};

/// Largest allowed mean rest error, as a fraction of the cage's diagonal. It is due to f32 rounding of the weights.
const REST_ERROR: f64 = 2e-6;

fn recipes() -> [Recipe; 4] {
    [super::rat::recipe(), super::humanoid::recipe(), super::clamp::recipe(), super::strider::recipe()]
}

#[test]
fn every_sample_is_enclosed_by_its_cage_and_bound_exactly() {
    for info in all() {
        let sample = build(info.id).unwrap();
        let n = sample.mesh.positions.len();
        assert!((10_000..=40_000).contains(&n), "{}: {n} vertices", info.id);
        assert_eq!(sample.colours.len(), n);
        assert!(sample.cage.faces.len() < 500);
        let cage = Cage::new(&sample.cage).unwrap();
        assert_eq!(cage.notices(), [], "{}", info.id);
        for p in sample.mesh.positions.iter().step_by(29) {
            let triangles = (0..cage.triangles().len() as u32).map(|t| cage.triangle_corners(t));
            let winding = winding_number(p.as_dvec3(), triangles);
            assert!((winding - 1.0).abs() < 1e-6, "{}: {p} has winding number {winding}", info.id);
        }
        let binding = bind(&sample.mesh.positions, &cage, &BindOptions::default(), &NoProgress).unwrap();
        assert_eq!(binding.outside.len(), 0, "{}", info.id);
        let error = binding.report.rest_error.mean_rel;
        assert!(error <= REST_ERROR, "{}: {error:e}", info.id);
    }
}

#[test]
fn poses_move_part_of_the_cage_and_keep_its_vertex_count() {
    for info in all() {
        let sample = build(info.id).unwrap();
        assert!(!sample.poses.is_empty());
        for (name, pose) in &sample.poses {
            assert_eq!(pose.len(), sample.cage.positions.len());
            let farthest =
                pose.iter().zip(&sample.cage.positions).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
            assert!(pose.iter().all(|p| p.is_finite()) && farthest > 0.1, "{}: {name}", info.id);
        }
    }
}

/// Regenerates stored poses: if a sample's model, cage or pull has changed, the test rewrites the pose's file and fails
/// once.
#[test]
fn the_last_pose_of_each_sample_is_that_of_its_pull() {
    for (info, recipe) in all().iter().zip(recipes()) {
        let Sample { mesh, cage, poses, grip: held, .. } = build(info.id).unwrap();
        let (rest, pulled) = (cage.positions.clone(), recipe.pulled);
        let cage = Cage::new(&cage).unwrap();
        let weights = |points: &[Vec3]| {
            let options = BindOptions { grid: ROUGH_GRID, ..BindOptions::default() };
            let bound = bind(points, &cage, &options, &NoProgress).unwrap();
            bound.frames.folded(&bound.weights)
        };
        let probes = Probes::new(&mesh, &cage).unwrap();
        let of_probes = weights(probes.points());
        let pull = Pull::new(&mesh, &cage, probes, &of_probes).unwrap();
        let grip =
            Grip::new(Handle::Vertex(held), &pull, &mesh.triangles, &weights(&mesh.positions)).unwrap();
        let start: Vec<DVec3> = rest.iter().map(|p| p.as_dvec3()).collect();
        let mut drag =
            Drag::new(&pull, &start, &[grip], &[], &Frames::default(), DragOptions::default()).unwrap();
        for _ in 0..30 {
            drag.frame(&[(mesh.positions[held as usize] + pulled.by).as_dvec3()]);
        }
        let made: Vec<Vec3> = drag.cage().iter().map(|p| p.as_vec3()).collect();
        let stored = &poses.last().unwrap().1;
        let off = made.iter().zip(stored).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
        if stored.len() != made.len() || off > 1e-3 {
            let number = |x: f32| ((x / PULLED_UNIT).round() as i16).to_le_bytes();
            let offsets = made.iter().zip(&rest).flat_map(|(p, r)| (*p - *r).to_array());
            let path = format!("{}/src/samples/pulled/{}.bin", env!("CARGO_MANIFEST_DIR"), info.id);
            std::fs::write(&path, offsets.flat_map(number).collect::<Vec<u8>>()).unwrap();
            panic!("{path} was off by {off} and has been rewritten: run the test again");
        }
    }
}

#[test]
fn samples_are_closed_surfaces_that_face_outward() {
    for info in all() {
        let mesh = build(info.id).unwrap().mesh;
        let mut sides: Vec<[u32; 2]> =
            mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
        sides.sort_unstable();
        for &[a, b] in &sides {
            assert!(sides.binary_search(&[b, a]).is_ok(), "{}: edge {a}-{b} is open", info.id);
        }
        let volume: f32 = mesh
            .triangles
            .iter()
            .map(|t| t.map(|i| mesh.positions[i as usize]))
            .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
            .sum();
        assert!(volume > 0.0, "{}", info.id);
    }
}

#[test]
fn an_unknown_sample_is_none() {
    assert!(build("unicorn").is_none());
}

#[test]
fn a_pruned_body_has_the_same_distance_and_colour() {
    let reach = 0.1;
    for recipe in recipes() {
        let body = recipe.body;
        let [min, max] = body.bounds();
        let steps = |n: u32| (0..=n).map(move |k| k as f32 / n as f32);
        let lattice =
            steps(9).flat_map(|x| steps(9).flat_map(move |y| steps(9).map(move |z| Vec3::new(x, y, z))));
        for middle in lattice.map(|share| min + share * (max - min)) {
            let near = body.near(middle, reach);
            for corner in 0..8 {
                let side =
                    Vec3::from_array([0, 1, 2].map(|axis| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 }));
                let p = middle + reach / 3.0_f32.sqrt() * side;
                assert_eq!(near.distance(p), body.distance(p), "at {p}");
                assert_eq!(near.colour(p), body.colour(p), "at {p}");
            }
        }
    }
}

/// The page opens with a sample, so no sample may show an error or a warning.
#[test]
fn no_sample_has_a_problem() {
    for info in all() {
        let sample = build(info.id).unwrap();
        let found = check(&sample.cage, Some(&sample.mesh.positions), Some(BindOptions::default().grid));
        let faults: Vec<_> = found.problems.iter().filter(|p| p.severity != Severity::Note).collect();
        assert!(
            faults.is_empty(),
            "{}: {:?}",
            info.id,
            faults.iter().map(|p| &p.message).collect::<Vec<_>>()
        );
    }
}

/// Expected values by formula: the distance of each centre from the curve of the trefoil knot
/// ((2 + cos 3t) cos 2t, (2 + cos 3t) sin 2t, sin 3t) / 3, and the change of colour seen from outside.
#[test]
fn knot_is_a_tube_whose_colours_depend_on_the_direction_of_view() {
    let splats = knot();
    let on_curve = |k: u32| {
        let t = std::f64::consts::TAU * f64::from(k) / 4000.0;
        let ring = 2.0 + (3.0 * t).cos();
        (DVec3::new(ring * (2.0 * t).cos(), ring * (2.0 * t).sin(), (3.0 * t).sin()) / 3.0).as_vec3()
    };
    let curve: Vec<Vec3> = (0..4000).map(on_curve).collect();
    for s in (0..splats.len()).step_by(101) {
        let (at, color) = (splats.positions[s], splats.colors[s]);
        let distance = |c: &&Vec3| c.distance(at);
        let nearest = curve.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap();
        assert!((at.distance(*nearest) - 0.32 / 3.0).abs() < 1e-4, "splat {s}");
        let normal = (at - nearest).normalize();
        let [outside, inside] =
            [-normal, normal].map(|d| color_along(color, splats.harmonics_of(s), d) - color);
        let sheen = Vec3::new(0.3 * 0.5_f32.sqrt(), 0.15, 0.4 * 0.5_f32.sqrt());
        // The nearest point of the curve is sought among samples, so it is off by up to 0.0014, 1.3 % of the radius.
        assert!(outside.abs_diff_eq(sheen, 0.02) && inside.abs_diff_eq(-sheen, 0.02), "splat {s}: {outside}");
        let axes = splats.axes(s);
        assert!(axes.z_axis.normalize().dot(normal) > 0.999 && axes.x_axis.dot(normal).abs() < 1e-3);
    }
    let (positions, triangles) = splats.shells();
    let made = generate(&positions, &triangles, &CageOptions::default(), &NoProgress).unwrap();
    assert!(made.report.target_met && made.report.notices.is_empty(), "{:?}", made.report);
}
