//! Reads the JSON file of `cagework fit --landmarks`.

use std::borrow::Cow;
use std::path::Path;

use cagework_core::Weights;
use cagework_core::geometry::closest_point_on_triangle;
use cagework_io::{json_fault, without_byte_order_mark};
use cagework_pose::pull::is_barycentric;
use glam::DVec3;
use serde::Deserialize;

use super::{Goals, wrong};
use crate::error::CliError;
use crate::files::read;
use crate::pose::BoundModel;

/// Maximum number of landmarks. The limit bounds the time: a landmark with a `point` is compared with all triangles.
const MAX_LANDMARKS: usize = 10_000;

/// Number of landmarks, not all in one plane, that determine an affine map. With fewer, the bending energy of the fit
/// determines the rotation.
const N_AFFINE_LANDMARKS: usize = 4;

/// A landmark as the file contains it, with positions in the file's axes.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct LandmarkJson {
    vertex: Option<u32>,
    triangle: Option<u32>,
    bary: Option<[f64; 3]>,
    point: Option<[f64; 3]>,
    to: [f64; 3],
    #[serde(default = "one")]
    weight: f64,
}

fn one() -> f64 {
    1.0
}

/// A point of the surface: three vertex indices, and the weight of each vertex in the point's position.
type SurfacePoint = ([u32; 3], [f64; 3]);

/// Reads the landmarks of a model from a file.
///
/// # Errors
/// If the file cannot be read, its JSON is invalid, or an index or number is out of range.
pub(super) fn landmarks(bound: &BoundModel, path: &Path) -> Result<Goals<'static>, CliError> {
    let bytes = read(path)?;
    let text = without_byte_order_mark(&bytes);
    let all: Vec<LandmarkJson> =
        serde_json::from_slice(text).map_err(|e| CliError::file(path, json_fault(text, &e)))?;
    if !(1..=MAX_LANDMARKS).contains(&all.len()) {
        return Err(wrong(path, &format!("has {} landmarks; expected 1 to {MAX_LANDMARKS}", all.len())));
    }
    let model = &bound.model;
    let up = model.up();
    let from_origin = |p: [f64; 3]| (DVec3::from_array(p) - model.origin()).as_vec3();
    let (mut indptr, mut indices, mut data) = (vec![0], Vec::new(), Vec::new());
    let (mut importance, mut to, mut n_partly) = (Vec::new(), Vec::new(), 0);
    let follows_partly = |v: u32| bound.outside.iter().any(|o| o.vertex == v && o.share < 1.0);
    let rows = &bound.weights;
    let n = rows.n_columns();
    for (k, landmark) in all.iter().enumerate() {
        let wrong = |what: String| wrong(path, &format!("landmark {k} {what}"));
        let numbers = landmark.to.iter().chain(landmark.point.iter().flatten()).map(|&x| x as f32);
        if let Some(x) = numbers.into_iter().find(|x| !x.is_finite()) {
            return Err(wrong(format!("has the coordinate {x}; 32-bit floats end at {:e}", f32::MAX)));
        }
        if !(landmark.weight > 0.0 && landmark.weight.is_finite()) {
            return Err(wrong(format!("has the weight {}; it must be above 0", landmark.weight)));
        }
        let (corners, shares) = surface_point(bound, landmark).map_err(wrong)?;
        let used = || corners.into_iter().zip(shares).filter(|(_, share)| *share > 0.0);
        n_partly += usize::from(used().any(|(v, _)| follows_partly(v)));
        let mut row = vec![0.0; n];
        for (v, share) in used() {
            let (columns, weights) = rows.row(v as usize);
            columns.iter().zip(weights).for_each(|(&c, &w)| row[c as usize] += share * f64::from(w));
        }
        for (column, weight) in row.iter().enumerate().filter(|(_, weight)| **weight != 0.0) {
            indices.push(column as u32);
            data.push(*weight as f32);
        }
        indptr.push(indices.len() as u32);
        importance.push(landmark.weight);
        to.push(up.turned(&[from_origin(landmark.to)])[0]);
    }
    let weights = Weights::new(n as u32, indptr, indices, data).map_err(|e| CliError::file(path, e))?;
    let outside_notice = (n_partly > 0).then(|| {
        let (landmarks, them) = if n_partly == 1 {
            ("landmark is outside the cage and follows", "it")
        } else {
            ("landmarks are outside the cage and follow", "them")
        };
        format!("{n_partly} {landmarks} it only partly; the fit may miss {them}")
    });
    let affine_notice = (to.len() < N_AFFINE_LANDMARKS).then(|| {
        let plural = if to.len() == 1 { " does" } else { "s do" };
        format!(
            "{} landmark{plural} not determine the rotation, so the bending energy chooses it; give at least {N_AFFINE_LANDMARKS} \
             that are not in one plane",
            to.len()
        )
    });
    let weights = Cow::Owned(weights);
    Ok(Goals { weights, importance, to, notices: outside_notice.into_iter().chain(affine_notice).collect() })
}

fn surface_point(bound: &BoundModel, landmark: &LandmarkJson) -> Result<SurfacePoint, String> {
    let model = &bound.model;
    let below = |what: &str, index: u32, count: usize| {
        let last = count.saturating_sub(1);
        ((index as usize) < count)
            .then_some(())
            .ok_or(format!("names {what} {index}; indices run from 0 to {last}"))
    };
    match *landmark {
        LandmarkJson { vertex: Some(v), triangle: None, bary: None, point: None, .. } => {
            below("vertex", v, model.positions.len())?;
            Ok(([v; 3], [1.0, 0.0, 0.0]))
        }
        LandmarkJson { triangle: Some(t), vertex: None, point: None, bary, .. } => {
            below("triangle", t, model.triangles.len())?;
            let bary = bary.unwrap_or([1.0 / 3.0; 3]);
            if !is_barycentric(bary) {
                return Err(format!(
                    "has the barycentric coordinates {bary:?}; expected non-negative numbers that sum to 1"
                ));
            }
            Ok((model.triangles[t as usize], bary.map(|b| b.max(0.0))))
        }
        LandmarkJson { point: Some(point), vertex: None, triangle: None, bary: None, .. } => {
            let point = (DVec3::from_array(point) - model.origin()).as_vec3();
            let point = model.up().turned(&[point])[0];
            nearest(bound, point.as_dvec3())
                .ok_or_else(|| "is a point, but the model has no triangles".into())
        }
        _ => Err("needs one of vertex, triangle (with bary) and point".into()),
    }
}

/// Finds the closest point on the model's surface. `None` if the model has no triangles.
fn nearest(bound: &BoundModel, at: DVec3) -> Option<SurfacePoint> {
    let model = &bound.model;
    let mut best = (f64::INFINITY, None);
    for &triangle in &model.triangles {
        let corners = triangle.map(|v| model.positions[v as usize].as_dvec3());
        // Lower bound of the distance from a triangle: the distance from its first corner minus the longer edge at that
        // corner.
        let reach = corners[1].distance(corners[0]).max(corners[2].distance(corners[0]));
        if at.distance(corners[0]) - reach > best.0 {
            continue;
        }
        let closest = closest_point_on_triangle(at, corners);
        let distance = closest.point.distance(at);
        if distance < best.0 {
            best = (distance, Some((triangle, closest.barycentric)));
        }
    }
    best.1
}
