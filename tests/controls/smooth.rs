use cagework_core::deform::deform_bound;
use cagework_core::progress::NoProgress;
use cagework_core::{BindOptions, Cage, ControlSet, Controls, InnerControls, PolygonMesh, bind};
use cagework_tests::cages::{cage, cuboid, l_shape};
use glam::Vec3;

use crate::support::{bound, samples, scattered};

/// Subdivides values at vertices by one Catmull-Clark step, without any code of `cagework_core`. Returns the new values
/// (of vertices, of edges sorted by their ends, of faces) and the new quads.
fn refined(values: &[f64], faces: &[Vec<u32>]) -> (Vec<f64>, Vec<Vec<u32>>) {
    let mut edges: Vec<[u32; 2]> = faces
        .iter()
        .flat_map(|f| (0..f.len()).map(|k| [f[k], f[(k + 1) % f.len()]]))
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    let value = |i: u32| values[i as usize];
    let middle = |f: &Vec<u32>| f.iter().map(|&i| value(i)).sum::<f64>() / f.len() as f64;
    let mut new = Vec::new();
    for (v, &own) in (0u32..).zip(values) {
        let around: Vec<f64> = faces.iter().filter(|f| f.contains(&v)).map(middle).collect();
        let halves: Vec<f64> = edges
            .iter()
            .filter(|e| e.contains(&v))
            .map(|&[a, b]| f64::midpoint(value(a), value(b)))
            .collect();
        let n = around.len() as f64;
        let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
        new.push((mean(&around) + 2.0 * mean(&halves) + (n - 3.0) * own) / n);
    }
    for [a, b] in &edges {
        let beside = faces.iter().filter(|f| f.contains(a) && f.contains(b)).filter(|f| {
            (0..f.len())
                .any(|k| [f[k], f[(k + 1) % f.len()]] == [*a, *b] || [f[k], f[(k + 1) % f.len()]] == [*b, *a])
        });
        let of_faces: Vec<f64> = beside.map(middle).collect();
        new.push((value(*a) + value(*b) + of_faces.iter().sum::<f64>()) / (2.0 + of_faces.len() as f64));
    }
    new.extend(faces.iter().map(middle));
    let (n, n_edges) = (values.len() as u32, edges.len() as u32);
    let of_edge =
        |a: u32, b: u32| n + edges.binary_search(&[a.min(b), a.max(b)]).expect("an edge of a face") as u32;
    let mut quads = Vec::new();
    for (f, face) in (0u32..).zip(faces) {
        for k in 0..face.len() {
            let [before, at, after] = [face.len() - 1, 0, 1].map(|step| face[(k + step) % face.len()]);
            quads.push(vec![at, of_edge(at, after), n + n_edges + f, of_edge(before, at)]);
        }
    }
    (new, quads)
}

/// Subdivides a mesh `steps` times. Returns the new mesh and the subdivision matrix: for each new vertex, a row with
/// the weights of the original vertices.
fn refined_mesh(mesh: &PolygonMesh, steps: u32) -> (PolygonMesh, Vec<Vec<f64>>) {
    let n = mesh.positions.len();
    let mut faces = Vec::new();
    let mut columns: Vec<Vec<f64>> = Vec::new();
    for column in 0..n {
        let mut values: Vec<f64> = (0..n).map(|i| f64::from(u8::from(i == column))).collect();
        faces.clone_from(&mesh.faces);
        for _ in 0..steps {
            (values, faces) = refined(&values, &faces);
        }
        columns.push(values);
    }
    let rows: Vec<Vec<f64>> = (0..columns[0].len()).map(|k| columns.iter().map(|c| c[k]).collect()).collect();
    let place = |row: &Vec<f64>| {
        row.iter().zip(&mesh.positions).map(|(&w, p)| w * p.as_dvec3()).sum::<glam::DVec3>().as_vec3()
    };
    (PolygonMesh { positions: rows.iter().map(place).collect(), faces }, rows)
}

/// Allowed rounding difference between f32 weights of two binds that divide the columns into different batches.
const ROUND_OFF: f64 = 1e-5;

/// On quads that are not planar, boundary values reproduce rest positions with an error of up to 2 % of the corners'
/// distance from a plane. Each bind then corrects its rows: the bind to the smooth cage distributes the error among the
/// controls, the bind to the subdivided cage among the subdivided vertices. The weights of the two binds differ by at
/// most this multiple of the error.
const MAX_ERROR_RATIO: f64 = 2.0;

#[test]
fn weights_of_a_smooth_cage_equal_those_of_the_subdivided_cage_times_its_rows() {
    for (mesh, steps) in [(cuboid(Vec3::NEG_ONE, Vec3::ONE), 2), (l_shape(), 2), (l_shape(), 3)] {
        let cage = cage(&mesh);
        let set = ControlSet::new(&cage, steps, InnerControls::default()).unwrap();
        let (fine, rows) = refined_mesh(&mesh, steps);
        let fine = Cage::new(&fine).unwrap();
        let bounds = fine.bounds();
        let points = scattered(300, bounds.min, bounds.max);
        let options = BindOptions { grid: 32, tau: 1e-7, ..BindOptions::default() };
        let by_route = bind(&points, &fine, &options, &NoProgress).unwrap();
        let smooth = bound(&points, &set, |options| options.grid = 32);
        assert_eq!(smooth.weights.n_columns() - smooth.frames.n_columns(), cage.n_vertices());
        let outside: Vec<u32> = by_route.outside.iter().map(|o| o.vertex).collect();
        assert_eq!(smooth.outside.iter().map(|o| o.vertex).collect::<Vec<_>>(), outside);
        assert!(points.len() - outside.len() > 100, "{} outside", outside.len());
        let (mut worst, mut sum) = (0.0_f64, 0.0);
        for v in 0..points.len() {
            let mut expected = vec![0.0; cage.n_vertices()];
            let (columns, weights) = by_route.weights.row(v);
            // The remaining columns belong to the frames and contain offsets.
            for (&k, &w) in columns.iter().zip(weights).filter(|(k, _)| (**k as usize) < rows.len()) {
                for (sum, share) in expected.iter_mut().zip(&rows[k as usize]) {
                    *sum += f64::from(w) * share;
                }
            }
            let (columns, weights) = smooth.weights.row(v);
            for (i, expected) in expected.iter().enumerate() {
                let w = columns.iter().position(|&c| c as usize == i).map_or(0.0, |k| f64::from(weights[k]));
                worst = worst.max((w - expected).abs());
                sum += (w - expected).abs();
                assert!(w >= 0.0 || outside.contains(&(v as u32)));
            }
        }
        let mean = sum / (points.len() * cage.n_vertices()) as f64;
        let most = ROUND_OFF + MAX_ERROR_RATIO * by_route.report.raw_error.unwrap().point_rel.max;
        assert!(mean < 1e-6 && worst < most, "mean {mean:e}, most {worst:e} of {most:e}");
    }
}

/// Before weights are corrected to reproduce the rest positions, the weights of a smooth cage and those of the
/// subdivided cage times the subdivision matrix are the same linear combinations of the same fields. The weights agree
/// to 1e-5 even if quads are bent.
#[test]
fn samples_of_a_smooth_cage_equal_those_of_the_subdivided_cage_times_its_rows() {
    for (mesh, steps) in
        [(cuboid(Vec3::NEG_ONE, Vec3::ONE), 2), (l_shape(), 1), (l_shape(), 2), (l_shape(), 3)]
    {
        let cage = cage(&mesh);
        let set = ControlSet::new(&cage, steps, InnerControls::default()).unwrap();
        let (fine, rows) = refined_mesh(&mesh, steps);
        let fine = Cage::new(&fine).unwrap();
        let bounds = fine.bounds();
        let options = BindOptions { grid: 32, tau: 1e-7, ..BindOptions::default() };
        let scattered = scattered(300, bounds.min, bounds.max);
        let outside = bind(&scattered, &fine, &options, &NoProgress).unwrap().outside;
        let is_inside = |v: usize| !outside.iter().any(|o| o.vertex as usize == v);
        let points: Vec<Vec3> = (0..300).filter(|&v| is_inside(v)).map(|v| scattered[v]).collect();
        assert!(points.len() > 100, "{} inside", points.len());
        let [smooth, of_fine] = [Controls::from(&set), Controls::from(&fine)]
            .map(|controls| samples(&points, controls, &options));
        let mut worst = 0.0_f64;
        for (column, ours) in smooth.iter().enumerate() {
            for (point, &ours) in ours.iter().enumerate() {
                let expected: f64 =
                    of_fine.iter().zip(&rows).map(|(w, row)| f64::from(w[point]) * row[column]).sum();
                worst = worst.max((f64::from(ours) - expected).abs());
            }
        }
        assert!(worst < ROUND_OFF, "{} vertices, {steps} steps: {worst:e}", mesh.positions.len());
    }
}

/// Vertices just outside the smooth surface follow a rigid motion fully. Vertices further away follow it partially, so
/// the comparison excludes them.
#[test]
fn smooth_cage_keeps_the_rest_pose_and_rigid_motions() {
    let cage = cage(&l_shape());
    let set = ControlSet::new(&cage, 2, InnerControls::default()).unwrap();
    let points = scattered(400, Vec3::splat(0.02), Vec3::new(1.98, 1.98, 0.98));
    let binding = bound(&points, &set, |options| options.grid = 24);
    assert!(binding.outside.iter().any(|o| o.share == 1.0));
    let in_part: Vec<u32> = binding.outside.iter().filter(|o| o.share < 1.0).map(|o| o.vertex).collect();
    assert!(in_part.len() < 150, "{} of 400", in_part.len());
    let turn = glam::Quat::from_euler(glam::EulerRot::XYZ, 0.4, -0.9, 1.3);
    for moved in [|_: glam::Quat, p: Vec3| p, |turn: glam::Quat, p: Vec3| turn * p + Vec3::new(3.0, 2.0, 1.0)]
    {
        let controls: Vec<Vec3> = Controls::from(&set).rest().iter().map(|&p| moved(turn, p)).collect();
        let posed = deform_bound(&binding.weights, &binding.frames, &controls);
        for (_, (p, at)) in (0..).zip(points.iter().zip(posed)).filter(|(v, _)| !in_part.contains(v)) {
            assert!(at.distance(moved(turn, *p)) < 1e-5 * cage.diagonal(), "{p}: {at}");
        }
    }
}
