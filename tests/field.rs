//! The deformation as a field, tested on cages of the samples.

#![expect(clippy::unwrap_used, reason = "helpers of tests: a panic is a failed test")]

use cagework_cage::samples;
use cagework_core::closest::FaceBoxes;
use cagework_core::deform::deform_bound;
use cagework_core::field::{self, Field, FieldWeights, InverseField, bend_vertices};
use cagework_core::progress::NoProgress;
use cagework_core::{BindOptions, Bounds, Cage, bind, subdivided_box};
use cagework_tests::random::RandomGenerator;
use glam::{Mat3, Vec3};

/// Returns a sample's vertices, its cage, and the field of the pose that `posed` gives the cage.
fn field_of(id: &str, posed: impl Fn(&samples::Sample) -> Vec<Vec3>) -> (Vec<Vec3>, Cage, Field) {
    let sample = samples::build(id).unwrap();
    let cage = Cage::new(&sample.cage).unwrap();
    let weights = FieldWeights::bind(&cage, field::CELLS, &BindOptions::default(), &NoProgress).unwrap();
    let field = weights.pose(cage.positions(), &posed(&sample));
    (sample.mesh.positions, cage, field)
}

/// Finds vertices at a distance of at least `cells` lattice cells from the cage, among every seventh vertex.
fn deep_vertices(positions: &[Vec3], cage: &Cage, field: &Field, cells: f32) -> Vec<usize> {
    let reach = f64::from(cells * field.lattice.cell);
    let is_deep = |&v: &usize| FaceBoxes::new(cage).find(positions[v].as_dvec3()).distance >= reach;
    (0..positions.len()).step_by(7).filter(is_deep).collect()
}

#[test]
fn field_approximates_the_exact_deformation_of_vertices_inside() {
    let (positions, cage, field) = field_of("strider", |sample| sample.poses[0].1.clone());
    let posed = &samples::build("strider").unwrap().poses[0].1;
    let binding = bind(&positions, &cage, &BindOptions::default(), &NoProgress).unwrap();
    let exact = deform_bound(&binding.weights, &binding.frames, posed);
    let mut bent = positions.clone();
    bend_vertices(&field, &mut bent);
    let error = |v: usize| bent[v].distance(exact[v]) / cage.diagonal();
    let mean = (0..bent.len()).map(error).sum::<f32>() / bent.len() as f32;
    let max = (0..bent.len()).map(error).fold(0.0, f32::max);
    let deep = deep_vertices(&positions, &cage, &field, 1.0);
    let max_deep = deep.iter().map(|&v| error(v)).fold(0.0, f32::max);
    // Errors are fractions of the cage's diagonal. The measured mean is 3e-5, the maximum 1.7e-3, and the maximum over
    // deep vertices 5e-4. The pose moves vertices by up to 0.56 of the diagonal; a lattice cell is 0.014 of it.
    assert!(mean <= 5e-5 && max <= 3e-3 && max_deep <= 1e-3 && deep.len() > 50, "{mean} {max} {max_deep}");
}

#[test]
fn affine_map_of_the_cage_is_reproduced_inside() {
    let matrix = Mat3::from_cols_array(&[1.2, 0.3, 0.0, -0.1, 0.9, 0.2, 0.0, 0.1, 1.1]);
    let affine = |p: Vec3| matrix * p + Vec3::new(0.1, -0.2, 0.3);
    let (positions, cage, field) =
        field_of("rat", |sample| sample.cage.positions.iter().map(|&p| affine(p)).collect());
    // At this distance from the cage, all corners of a vertex's lattice cell are inside.
    let deep = deep_vertices(&positions, &cage, &field, 3.0_f32.sqrt());
    assert!(deep.len() > 50, "{}", deep.len());
    let mut bent = positions.clone();
    bend_vertices(&field, &mut bent);
    for v in deep {
        assert!(bent[v].distance(affine(positions[v])) <= 1e-5 * cage.diagonal(), "{v}");
        let error = field.gradient(positions[v]) - matrix;
        assert!(error.to_cols_array().iter().all(|e| e.abs() <= 1e-3), "{v}: {error}");
    }
}

#[test]
fn field_decays_continuously_to_zero_at_the_edge_of_the_lattice() {
    let up = Vec3::new(0.0, 0.5, 0.0);
    let (_, cage, field) = field_of("rat", |sample| sample.cage.positions.iter().map(|&p| p + up).collect());
    let centre = cage.bounds().center();
    // A translated cage displaces all points inside by the same vector. Outside, the displacement decays to 0 at the
    // lattice's boundary.
    let edge = field.lattice.origin.x + (field.lattice.dims.x - 1) as f32 * field.lattice.cell;
    let far = Vec3::new(edge, centre.y, centre.z);
    let mut along: Vec<Vec3> =
        (0..200).map(|k| centre.lerp(far, k as f32 / 199.0)).chain([far + Vec3::X]).collect();
    let before = along.clone();
    bend_vertices(&field, &mut along);
    let by: Vec<f32> = along.iter().zip(&before).map(|(a, b)| (*a - *b).y).collect();
    assert!((by[0] - up.y).abs() <= 1e-5 && by[199].abs() <= 1e-6 && by[200] == 0.0, "{by:?}");
    assert!(by.windows(2).all(|w| w[0] - w[1] <= 0.03 * up.y && w[1] <= w[0] + 1e-3), "{by:?}");
    // Maximum principle: the largest values of a harmonic field are on the boundary.
    assert!(field.values.iter().all(|value| value.truncate().length() <= up.y * 1.0001));
}

#[test]
fn a_cage_at_rest_moves_nothing() {
    let (positions, _, field) =
        field_of("clamp", |sample| Cage::new(&sample.cage).unwrap().positions().to_vec());
    let mut bent = positions.clone();
    bend_vertices(&field, &mut bent);
    assert_eq!(bent, positions);
}

/// Creates the cage of a bar of 1 x 1 x 4, and a pose of the cage that bends the bar by 120 degrees about the y axis.
/// Straight lines along z become arcs.
fn bent_bar() -> (Cage, Vec<Vec3>) {
    let bounds = Bounds { min: Vec3::new(-0.5, -0.5, 0.0), max: Vec3::new(0.5, 0.5, 4.0) };
    let cage = Cage::new(&subdivided_box(bounds, 0.05, [3, 3, 9])).unwrap();
    let radius = 4.0 / 120_f32.to_radians();
    let bend = |p: &Vec3| {
        let (sin, cos) = (p.z / radius).sin_cos();
        Vec3::new(radius - (radius - p.x) * cos, p.y, (radius - p.x) * sin)
    };
    let posed = cage.positions().iter().map(bend).collect();
    (cage, posed)
}

fn points_in_bar() -> Vec<Vec3> {
    let mut random = RandomGenerator::new(5);
    (0..2000).map(|_| random.point(Vec3::new(-0.5, -0.5, 0.0), Vec3::new(0.5, 0.5, 4.0))).collect()
}

#[test]
fn field_and_gradient_match_points_that_are_bound() {
    let (cage, posed) = bent_bar();
    let points = points_in_bar();
    let weights = FieldWeights::bind(&cage, field::CELLS, &BindOptions::default(), &NoProgress).unwrap();
    let field = weights.pose(cage.positions(), &posed);
    // The expected gradients are central differences between bound points 2e-3 of the diagonal apart. These points are
    // bound on a finer grid than the field.
    let step = 1e-3 * cage.diagonal();
    let around = |p: Vec3| {
        let [x, y, z] = Vec3::AXES.map(|axis| step * axis);
        [p + x, p - x, p + y, p - y, p + z, p - z, p]
    };
    let all: Vec<Vec3> = points.iter().flat_map(|&p| around(p)).collect();
    let options = BindOptions { grid: 128, ..BindOptions::default() };
    let binding = bind(&all, &cage, &options, &NoProgress).unwrap();
    let moved = deform_bound(&binding.weights, &binding.frames, &posed);
    let (mut errors, mut gradient_errors) = (Vec::new(), Vec::new());
    for (k, &p) in points.iter().enumerate() {
        let own = &moved[7 * k..];
        errors.push(field.map(p).distance(own[6]) / cage.diagonal());
        let column = |axis: usize| (own[2 * axis] - own[2 * axis + 1]) / (2.0 * step);
        let expected = Mat3::from_cols(column(0), column(1), column(2));
        let difference = field.gradient(p) - expected;
        gradient_errors.push(norm(difference) / norm(expected));
        assert!(field.gradient(p).determinant() > 0.0, "{p}");
    }
    let [at_half, at_most] = quantiles(&mut errors);
    let [gradient_at_half, gradient_at_most] = quantiles(&mut gradient_errors);
    println!("{at_half} {at_most} {gradient_at_half} {gradient_at_most}");
    assert!(at_half <= 3e-5 && at_most <= 2e-4, "position: {at_half} {at_most}");
    assert!(
        gradient_at_half <= 0.003 && gradient_at_most <= 0.02,
        "gradient: {gradient_at_half} {gradient_at_most}"
    );
}

fn norm(matrix: Mat3) -> f32 {
    matrix.to_cols_array().iter().map(|x| x * x).sum::<f32>().sqrt()
}

/// Finds the median, and the value below which 99 % of the values are.
fn quantiles(values: &mut [f32]) -> [f32; 2] {
    values.sort_by(f32::total_cmp);
    [values[values.len() / 2], values[values.len() * 99 / 100]]
}

#[test]
fn mapped_points_are_mapped_back() {
    let (cage, posed) = bent_bar();
    let weights = FieldWeights::bind(&cage, field::CELLS, &BindOptions::default(), &NoProgress).unwrap();
    let field = weights.pose(cage.positions(), &posed);
    let inverse = InverseField::new(&field);
    for p in points_in_bar() {
        let back = inverse.find(field.map(p));
        assert!(back.is_some_and(|back| back.distance(p) <= 1e-5 * cage.diagonal()), "{p} {back:?}");
    }
    // Far from the cage, the field moves no point.
    let far = Vec3::splat(100.0);
    assert_eq!((field.map(far), inverse.find(far), field.gradient(far)), (far, Some(far), Mat3::IDENTITY));
    let coarse = FieldWeights::bind(&cage, 8, &BindOptions::default(), &NoProgress).unwrap();
    let coarse = coarse.pose(cage.positions(), &posed);
    assert_eq!(
        (coarse.map(far), coarse.map(-far)),
        (far, -far),
        "a lattice of 8 cells moves no point either"
    );
}

/// A pose can move neighbouring nodes many cells apart. Then no node is near the target, but the inverse exists. Where a
/// pose flattens the model, each point has many inverses, so none is returned.
#[test]
fn stretched_points_are_mapped_back_and_flattened_ones_are_not() {
    let (cage, _) = bent_bar();
    let weights = FieldWeights::bind(&cage, field::CELLS, &BindOptions::default(), &NoProgress).unwrap();
    for scale in [6.0, 12.0] {
        let posed: Vec<Vec3> = cage.positions().iter().map(|p| scale * *p).collect();
        let field = weights.pose(cage.positions(), &posed);
        let inverse = InverseField::new(&field);
        for p in points_in_bar().into_iter().step_by(10) {
            let back = inverse.find(field.map(p));
            assert!(
                back.is_some_and(|back| back.distance(p) <= 1e-4 * cage.diagonal()),
                "{scale} {p} {back:?}"
            );
        }
    }
    let flat: Vec<Vec3> = cage.positions().iter().map(|p| p.with_z(0.0)).collect();
    let field = weights.pose(cage.positions(), &flat);
    let inverse = InverseField::new(&field);
    for p in points_in_bar().into_iter().step_by(10) {
        assert_eq!(inverse.find(field.map(p)), None, "{p}");
    }
}
