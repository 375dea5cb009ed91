//! Landmarks: the JSON of `cagework fit --landmarks`.

use std::path::Path;

use cagework_core::Weights;
use cagework_core::geometry::closest_point_on_triangle;
use cagework_io::json_fault;
use glam::DVec3;
use serde::Deserialize;

use super::{Goals, wrong};
use crate::error::CliError;
use crate::files::read;
use crate::pose::Bound;

/// Most landmarks: of each the nearest of all triangles may be looked for.
const MAX: usize = 10_000;

/// Landmarks that fix place, turn and size of the whole; fewer leave something of it open.
const FEW: usize = 4;

/// How far barycentric coordinates may be off.
const OFF: f64 = 1e-3;

/// A landmark as its file says it, in the file's axes.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Said {
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

/// Corners and how much each counts.
type Place = ([u32; 3], [f64; 3]);

/// Reads landmarks of a model.
///
/// # Errors
/// When the file cannot be read, is no JSON, or names what there is not.
pub(super) fn landmarks(bound: &Bound, path: &Path) -> Result<Goals, CliError> {
    let bytes = read(path)?;
    let all: Vec<Said> =
        serde_json::from_slice(&bytes).map_err(|e| CliError::file(path, json_fault(&bytes, &e)))?;
    if !(1..=MAX).contains(&all.len()) {
        return Err(wrong(path, &format!("{} landmarks; there must be 1 to {MAX}", all.len())));
    }
    let model = &bound.model;
    let up = model.up();
    let from_origin = |p: [f64; 3]| (DVec3::from_array(p) - model.origin()).as_vec3();
    let (mut indptr, mut indices, mut data) = (vec![0], Vec::new(), Vec::new());
    let (mut shares, mut to, mut n_outside) = (Vec::new(), Vec::new(), 0);
    let is_outside = |v: u32| bound.outside.iter().any(|o| o.vertex == v && o.share < 1.0);
    let rows = bound.rows();
    let n = rows.n_columns();
    for (k, said) in all.iter().enumerate() {
        let wrong = |what: String| wrong(path, &format!("landmark {k} {what}"));
        let numbers = said.to.iter().chain(said.point.iter().flatten()).map(|&x| x as f32);
        if let Some(x) = numbers.into_iter().find(|x| !x.is_finite()) {
            return Err(wrong(format!("has the coordinate {x}: numbers of 32 bits end at {:e}", f32::MAX)));
        }
        if !(said.weight > 0.0 && said.weight.is_finite()) {
            return Err(wrong(format!("weighs {}; it must be above 0", said.weight)));
        }
        let (corners, shares_of) = place(bound, said).map_err(wrong)?;
        n_outside +=
            usize::from(corners.iter().zip(shares_of).any(|(&v, share)| share > 0.0 && is_outside(v)));
        let mut row = vec![0.0; n];
        for (&v, share) in corners.iter().zip(shares_of).filter(|(_, share)| *share > 0.0) {
            let (columns, weights) = rows.row(v as usize);
            columns.iter().zip(weights).for_each(|(&c, &w)| row[c as usize] += share * f64::from(w));
        }
        for (column, weight) in row.iter().enumerate().filter(|(_, weight)| **weight != 0.0) {
            indices.push(column as u32);
            data.push(*weight as f32);
        }
        indptr.push(indices.len() as u32);
        shares.push(said.weight);
        to.push(up.turned(&[from_origin(said.to)])[0]);
    }
    let weights = Weights::new(n as u32, indptr, indices, data).map_err(|e| CliError::file(path, e))?;
    let notices = (n_outside > 0).then(|| {
        format!(
            "{n_outside} landmarks are so far outside the cage that they follow it in part: they miss their targets"
        )
    });
    let few = (to.len() < FEW).then(|| {
        format!("{} landmarks leave turns open: the energy alone decides on them; {FEW} or more that are not in one plane do not", to.len())
    });
    Ok(Goals { weights, shares, to, notices: notices.into_iter().chain(few).collect() })
}

fn place(bound: &Bound, said: &Said) -> Result<Place, String> {
    let model = &bound.model;
    let below = |what: &str, index: u32, count: usize| {
        let last = count.saturating_sub(1);
        ((index as usize) < count)
            .then_some(())
            .ok_or(format!("names {what} {index}: they count from 0 to {last}"))
    };
    match *said {
        Said { vertex: Some(v), triangle: None, bary: None, point: None, .. } => {
            below("vertex", v, model.positions.len())?;
            Ok(([v; 3], [1.0, 0.0, 0.0]))
        }
        Said { triangle: Some(t), vertex: None, point: None, bary, .. } => {
            below("triangle", t, model.triangles.len())?;
            let bary = bary.unwrap_or([1.0 / 3.0; 3]);
            if bary.iter().any(|b| *b < -OFF) || (bary.iter().sum::<f64>() - 1.0).abs() > OFF {
                return Err(format!(
                    "has {bary:?}, which is no point of a triangle: numbers from 0 on that sum to 1"
                ));
            }
            Ok((model.triangles[t as usize], bary.map(|b| b.max(0.0))))
        }
        Said { point: Some(point), vertex: None, triangle: None, bary: None, .. } => {
            let point = (DVec3::from_array(point) - model.origin()).as_vec3();
            let point = model.up().turned(&[point])[0];
            nearest(bound, point.as_dvec3())
                .ok_or_else(|| "is a point, but the model has no triangles".into())
        }
        _ => Err("must name one of vertex, triangle (with bary) and point".into()),
    }
}

/// The point of the model that is nearest to a place.
fn nearest(bound: &Bound, at: DVec3) -> Option<Place> {
    let model = &bound.model;
    let mut best = (f64::INFINITY, None);
    for &triangle in &model.triangles {
        let corners = triangle.map(|v| model.positions[v as usize].as_dvec3());
        // No point of it is nearer than its first corner less its longest edge from there.
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
