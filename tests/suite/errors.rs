//! Invalid input gives an error that names the input at fault.

use cagework_core::bind::BindError;
use cagework_core::options::BindOptions;
use cagework_tests::cages::{c_shape, cage};
use cagework_tests::points;
use glam::Vec3;

use super::BackEnd;

type Edit = fn(&mut BindOptions);

pub(crate) fn options_out_of_range_are_named(back_end: &BackEnd) {
    let cage = cage(&c_shape());
    let points = points::inside(&cage, 10, 30);
    let refused: [(&str, Edit); 9] = [
        ("grid", |o| o.grid = 7),
        ("grid", |o| o.grid = 513),
        ("tau", |o| o.tau = 0.0),
        ("tau", |o| o.tau = -1.0),
        ("tau", |o| o.tau = f32::NAN),
        ("max_iterations", |o| o.max_iterations = 0),
        ("sparsify", |o| o.sparsify = 0.5),
        ("sparsify", |o| o.sparsify = -1e-3),
        ("sparsify", |o| o.sparsify = f32::NAN),
    ];
    for (name, edit) in refused {
        let error = back_end.try_bind(&points, &cage, edit).expect_err(name);
        assert!(matches!(&error, BindError::Option(wrong) if wrong.option == name), "{error:?}");
        assert!(error.to_string().starts_with(&format!("{name} is ")), "{error}");
    }
}

pub(crate) fn bad_meshes_are_named(back_end: &BackEnd) {
    let cage = cage(&c_shape());
    assert_eq!(back_end.try_bind(&[], &cage, |_| ()).unwrap_err(), BindError::EmptyMesh);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for axis in 0..3 {
            let mut points = points::inside(&cage, 10, 31);
            points[7][axis] = bad;
            let error = back_end.try_bind(&points, &cage, |_| ()).unwrap_err();
            assert_eq!(error, BindError::NotFinite { vertex: 7 });
        }
    }
    // Distant vertices are valid as long as one vertex is inside.
    let mut points = points::inside(&cage, 1, 31);
    points.push(Vec3::splat(1e20));
    let far = back_end.bind(&points, &cage);
    assert_eq!(far.outside.len(), 1);
    assert!(far.weights.data().iter().all(|w| w.is_finite()) && far.outside[0].share == 0.0);
}

pub(crate) fn memory_limit_is_kept_and_named(back_end: &BackEnd) {
    let cage = cage(&c_shape());
    let points = points::inside(&cage, 10, 32);
    let limit = 3 << 20;
    let error = back_end.try_bind(&points, &cage, |o| (o.grid, o.memory_limit) = (512, limit)).unwrap_err();
    let BindError::Memory { needed, limit: named } = error else { panic!("{error:?}") };
    // The box of 4 x 3 x 1 has 25 million cells at g = 512, each of several bytes.
    assert!(named == limit && needed > 50 << 20, "{needed} of {named} bytes");
    let message = BindError::Memory { needed, limit }.to_string();
    assert!(
        message.contains(&format!("{} MiB", needed.div_ceil(1 << 20))) && message.contains("3 MiB"),
        "{message}"
    );

    let binding = back_end.bind(&points, &cage);
    let memory = binding.report.memory_bytes;
    assert!(memory.estimated >= memory.peak, "estimated {} and needed {}", memory.estimated, memory.peak);
    assert!(back_end.try_bind(&points, &cage, |o| o.memory_limit = memory.estimated).is_ok());
}
