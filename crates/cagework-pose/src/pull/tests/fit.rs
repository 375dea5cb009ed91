//! Tests of fits to targets.

use glam::{DQuat, DVec3, Vec3};

use super::{BoundSample, bound, humanoid};
use crate::pull::{Fit, FitOptions, PullError};
use cagework_core::deform::deform_vertices;
use cagework_core::frames::Frames;

/// A map that bends, twists, stretches and translates the cage. Its lengths are fractions of the model's size.
fn moved(bound: &BoundSample, cage: &[DVec3]) -> Vec<DVec3> {
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 0.5).normalize(), 1.0);
    let size = bound.size;
    let map = |p: DVec3| {
        let q = p / size;
        let twisted = DQuat::from_rotation_y(0.8 * q.y) * q;
        let bent = twisted + DVec3::new(0.3 * q.y * q.y, 0.15 * q.y, 0.1 * (3.0 * q.x).sin());
        size * (turn * bent + DVec3::new(2.0, -1.0, 0.5))
    };
    cage.iter().map(|&p| map(p)).collect()
}

/// Normally distributed numbers (Box and Muller 1958) from a linear congruential generator.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| {
            let (a, b) = (self.uniform(), self.uniform());
            (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
        }))
    }
}

fn narrow(cage: &[DVec3]) -> Vec<Vec3> {
    cage.iter().map(|p| p.as_vec3()).collect()
}

impl BoundSample {
    fn model(&self, cage: &[DVec3]) -> Vec<Vec3> {
        deform_vertices(&self.weights, &narrow(cage))
    }

    fn fit(&self, to: &[Vec3], lambda: Option<f64>) -> Fit {
        self.pull
            .fit(&self.weights, &Frames::default(), self.pull.areas(), to, FitOptions { lambda })
            .unwrap()
    }
}

/// Root mean squared and largest distance, as fractions of the model's size.
fn apart(a: &[Vec3], b: &[Vec3], size: f64) -> [f64; 2] {
    let all: Vec<f64> = a.iter().zip(b).map(|(a, b)| f64::from(a.distance(*b)) / size).collect();
    [
        (all.iter().map(|d| d * d).sum::<f64>() / all.len() as f64).sqrt(),
        all.iter().copied().fold(0.0, f64::max),
    ]
}

#[test]
fn a_pose_is_recovered_from_its_model() {
    for id in ["humanoid", "rat"] {
        let bound = bound(id);
        let truth = moved(&bound, &bound.rest());
        let fitted = bound.fit(&bound.model(&truth), None);
        let [_, largest] = apart(&narrow(&fitted.cage), &narrow(&truth), bound.size);
        // The limit 1e-5 lies between the required accuracy, 1e-4, and the error that rounding positions to f32
        // causes, 1e-6.
        assert!(fitted.is_settled && largest <= 1e-5, "{id}: {largest:e} in {} steps", fitted.steps);
    }
}

#[test]
fn a_fit_averages_noise_as_statistics_predict() {
    let bound = humanoid();
    let truth = moved(bound, &bound.rest());
    let model = bound.model(&truth);
    for noise in [1e-3, 5e-3] {
        // Standard deviation per coordinate so that the root mean squared distance is `noise`.
        let (mut random, each) = (Noise(1), noise / 3.0_f64.sqrt() * bound.size);
        let noisy: Vec<Vec3> =
            model.iter().map(|p| (p.as_dvec3() + each * random.vector()).as_vec3()).collect();
        let fitted = bound.fit(&noisy, None);
        let [rms, _] = apart(&bound.model(&fitted.cage), &model, bound.size);
        // RMS error of a fit with n unknowns to N values of unit variance.
        let expected = noise * (bound.pull.n_cage() as f64 / model.len() as f64).sqrt();
        assert!(rms <= 1.2 * expected, "{noise:e}: {rms:e}, expected {expected:e}");
        assert!(rms <= 1e-4 || noise > 1e-3, "{noise:e}: {rms:e}");
        assert!((fitted.rms - noise).abs() <= 0.02 * noise, "the residual is the noise: {:e}", fitted.rms);
        let [cage, _] = apart(&narrow(&fitted.cage), &narrow(&truth), bound.size);
        assert!(cage <= 2.0 * noise, "{noise:e}: the cage is off by {cage:e}");
    }
}

#[test]
fn rigidly_moved_landmarks_move_the_model_rigidly() {
    let bound = humanoid();
    let turn = DQuat::from_axis_angle(DVec3::new(0.0, 1.0, 0.3).normalize(), 2.0);
    let map = |p: DVec3| turn * p + DVec3::new(0.3, -1.0, 2.0);
    let rows = [0, 3000, 9000, 15000, 21000];
    let weights = bound.weights.with_rows(&rows);
    let to: Vec<Vec3> = rows.map(|v| map(bound.mesh.positions[v as usize].as_dvec3()).as_vec3()).to_vec();
    let fitted = bound.pull.fit(&weights, &Frames::default(), &[1.0; 5], &to, FitOptions::default()).unwrap();
    let truth: Vec<Vec3> = bound.rest().into_iter().map(|p| map(p).as_vec3()).collect();
    let [_, largest] = apart(&narrow(&fitted.cage), &truth, bound.size);
    assert!(largest <= 1e-4 && fitted.energy < 1e-6, "{largest:e}, energy {:e}", fitted.energy);
}

#[test]
fn landmarks_are_met_and_a_larger_lambda_lowers_the_energy() {
    let bound = humanoid();
    let ways = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::new(1.0, -2.0, 0.0)];
    let rows = ways.map(|way| {
        let all = bound.mesh.positions.iter().enumerate();
        all.max_by(|a, b| a.1.dot(way).total_cmp(&b.1.dot(way))).unwrap().0 as u32
    });
    let weights = bound.weights.with_rows(&rows);
    let mut to = deform_vertices(&weights, &narrow(&bound.rest()));
    // Raise the hand by a tenth of the model's size.
    to[0].y += 0.1 * bound.size as f32;
    let fits: Vec<Fit> = [None, Some(1e-3), Some(1e-1)]
        .map(|lambda| {
            bound.pull.fit(&weights, &Frames::default(), &[1.0; 5], &to, FitOptions { lambda }).unwrap()
        })
        .into();
    assert!(fits[0].largest <= 1e-3, "{:e}", fits[0].largest);
    for pair in fits.windows(2) {
        assert!(pair[1].energy < pair[0].energy && pair[1].rms > pair[0].rms, "{pair:?}");
    }
}

#[test]
fn invalid_fits_are_errors() {
    let bound = humanoid();
    let (n, rest) = (bound.weights.n_rows(), bound.mesh.positions.clone());
    let fit = |shares: &[f64], to: &[Vec3], lambda| {
        bound.pull.fit(&bound.weights, &Frames::default(), shares, to, FitOptions { lambda }).unwrap_err()
    };
    let areas = bound.pull.areas();
    assert_eq!(fit(areas, &rest[1..], None), PullError::Targets { given: n - 1, points: n });
    assert!(matches!(fit(&areas[1..], &rest, None), PullError::Shape { .. }));
    assert_eq!(fit(&vec![0.0; n], &rest, None), PullError::NoTarget);
    assert!(matches!(fit(areas, &rest, Some(f64::NAN)), PullError::Value { what: "lambda", .. }));
    let mut broken = rest;
    broken[7].y = f32::NAN;
    assert!(matches!(fit(areas, &broken, None), PullError::Value { what: "a target", .. }));
    // A vertex with zero weight may have any target.
    let mut shares = areas.to_vec();
    shares[7] = 0.0;
    bound.pull.fit(&bound.weights, &Frames::default(), &shares, &broken, FitOptions::default()).unwrap();
}
