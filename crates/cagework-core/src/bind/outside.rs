//! Checks how cage and model fit: rejects binds without any vertex inside, with the likely cause, and notices a cage
//! that is far too large.

use std::fmt;

use glam::{DVec3, Vec3};

use super::BindError;
use super::points::WeldedPoints;
use crate::cage::Cage;
use crate::controls::Controls;
use crate::deform::OutsideVertex;
use crate::mesh::Bounds;
use crate::options::{BindOptions, OutsidePolicy};
use crate::sample::Stencils;
use crate::weights::Weights;

/// Ratio of sizes from which cage and model are assumed to have different units. Feet and metres differ by 3.3; a cage
/// is rarely twice as large as its model.
const MIN_UNIT_RATIO: f64 = 3.0;

/// If no weight varies by more than this over the enclosed part of the model, this part hardly bends.
const MIN_WEIGHT_SPREAD: f32 = 1e-3;

/// Ratio of sizes from which the cage may have another unit: metres and centimetres differ by 100, and a cage is up to
/// twice as large as its model. Over a model that is smaller than a coarse cage by this ratio, each weight varies by
/// less than the inverse of the ratio.
const MIN_OVERSIZE_RATIO: f64 = 50.0;

/// If a weight varies by more than this over the enclosed part of the model, the cage is not oversized. This limit is
/// the larger of [`MIN_WEIGHT_SPREAD`] and the inverse of [`MIN_OVERSIZE_RATIO`].
const MAX_OVERSIZE_SPREAD: f32 = 0.02;

/// Relative position and size of a cage and a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misfit {
    /// Distance between the bounding boxes of cage and model, object units; 0 if they overlap.
    pub gap: f64,
    /// Diagonal of the model's bounding box divided by that of the cage's.
    pub ratio: f64,
}

impl Misfit {
    fn of(cage: Bounds, model: Bounds) -> Self {
        let [low, high, min, max] = [cage.min, cage.max, model.min, model.max].map(Vec3::as_dvec3);
        let gap = (low - max).max(min - high).max(DVec3::ZERO).length();
        Self { gap, ratio: max.distance(min) / high.distance(low) }
    }
}

impl fmt::Display for Misfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let gap = about(self.gap);
        // A model of a single point has the ratio 0.
        let size = if self.ratio >= MIN_UNIT_RATIO {
            Some(format!("{} times smaller than the model", about(self.ratio)))
        } else if self.ratio > 0.0 && self.ratio <= 1.0 / MIN_UNIT_RATIO {
            Some(format!("{} times larger than the model", about(1.0 / self.ratio)))
        } else {
            None
        };
        match (self.gap > 0.0, size) {
            (true, None) => write!(f, "the cage is {gap} away from it: move one of them to the other"),
            (true, Some(size)) => write!(
                f,
                "the cage is {gap} away from it and {size}: bring both into the same unit and place"
            ),
            (false, Some(size)) => write!(f, "the cage is {size}: bring both into the same unit"),
            (false, None) => f.write_str(
                "they overlap, but the model lies outside the cage's interior: does the cage belong to another model?",
            ),
        }
    }
}

/// Formats a length or factor with two significant digits.
fn about(x: f64) -> String {
    let rounded = format!("{x:.1e}").parse().unwrap_or(x);
    if (0.01..1e4).contains(&rounded) { rounded.to_string() } else { format!("{rounded:e}") }
}

/// Checks that the cage encloses at least one vertex of a model or, if the options require it, all of them.
///
/// # Errors
/// [`BindError::NoneInside`], [`BindError::Outside`].
pub(super) fn refuse_outside(
    controls: Controls<'_>,
    mesh: &WeldedPoints<'_>,
    stencils: &Stencils,
    options: &BindOptions,
) -> Result<(), BindError> {
    let positions = mesh.positions;
    let cage = controls.surface();
    let outside = stencils.outside.iter().filter(|o| !o.is_held);
    if outside.clone().count() == stencils.len() {
        return Err(none_inside(cage, positions));
    }
    let n_vertices = positions.len().saturating_sub(options.extra_points);
    let vertices = outside.map(|o| mesh.welded.first[o.vertex as usize]);
    let mut vertices = vertices.filter(|&v| (v as usize) < n_vertices);
    match (options.outside, vertices.next()) {
        (OutsidePolicy::Refuse, Some(first)) => {
            Err(BindError::Outside { count: 1 + vertices.count() as u32, first })
        }
        _ => Ok(()),
    }
}

/// Creates the [`BindError::NoneInside`] for a model whose vertices are all outside. `positions` must not be empty.
fn none_inside(cage: &Cage, positions: &[Vec3]) -> BindError {
    let model = Bounds::around(positions).unwrap_or(cage.bounds());
    BindError::NoneInside { vertices: positions.len(), misfit: Misfit::of(cage.bounds(), model) }
}

/// Returns a notice if the cage is so much larger than the enclosed part of the model that this part has nearly the
/// same weights everywhere. `positions`: vertices of the model, the first rows of `weights`; vertices `outside` are
/// ignored.
pub(super) fn oversized(
    cage: Bounds,
    positions: &[Vec3],
    outside: &[OutsideVertex],
    weights: &Weights,
    n_controls: usize,
) -> Option<String> {
    let mut is_inside = vec![true; positions.len()];
    for vertex in outside.iter().map(|o| o.vertex as usize).filter(|&v| v < positions.len()) {
        is_inside[vertex] = false;
    }
    let inside = || (0..positions.len()).filter(|&v| is_inside[v]);
    let held = inside().count();
    let none = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    let [min, max] = inside().fold(none, |[min, max], v| [min.min(positions[v]), max.max(positions[v])]);
    let larger = 1.0 / Misfit::of(cage, Bounds { min, max }).ratio;
    // A single point has no size, so the ratio is infinite.
    if held == 0 || larger.is_infinite() {
        return None;
    }
    let mut ranges = vec![(f32::INFINITY, f32::NEG_INFINITY, 0_usize); n_controls];
    let entries = inside().flat_map(|v| {
        let (columns, data) = weights.row(v);
        columns.iter().zip(data)
    });
    for (&column, &weight) in entries.filter(|(column, _)| (**column as usize) < n_controls) {
        let (low, high, count) = &mut ranges[column as usize];
        (*low, *high, *count) = (low.min(weight), high.max(weight), *count + 1);
        // Return early: in most models, the weights of the first few vertices already differ by more than this limit.
        if *high - low.max(0.0) > MAX_OVERSIZE_SPREAD {
            return None;
        }
    }
    // Weights that are not stored are 0.
    let spread = |&(low, high, n): &(f32, f32, usize)| if n < held { high.max(0.0) } else { high - low };
    let spread = ranges.iter().map(spread).fold(0.0, f32::max);
    let is_flat = spread < MIN_WEIGHT_SPREAD
        || larger >= MIN_OVERSIZE_RATIO && f64::from(spread) < 1.0 / MIN_OVERSIZE_RATIO;
    is_flat.then(|| format!(
        "The cage is {} times larger than what it encloses of the model, and weights differ by {spread:.0e} over it at most: it hardly \
         bends. Are both in the same unit?",
        about(larger)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bind::bind;
    use crate::cage::subdivided_box;
    use crate::mesh::PolygonMesh;
    use crate::options::BindOptions;
    use crate::progress::NoProgress;

    /// Error message of a bind of points of the unit square to a box.
    fn said(min: Vec3, size: f32) -> String {
        let bounds = Bounds { min, max: min + size };
        let cage = Cage::new(&subdivided_box(bounds, 0.0, [1, 1, 1])).unwrap();
        let points: Vec<Vec3> =
            (0..15_002).map(|k| Vec3::new((k % 2) as f32, (k / 2) as f32 / 7500.0, 0.0)).collect();
        bind(&points, &cage, &BindOptions { grid: 8, ..BindOptions::default() }, &NoProgress)
            .unwrap_err()
            .to_string()
    }

    /// If all vertices are outside the cage, the bind fails, and the error names the likely cause.
    #[test]
    fn cage_without_enclosed_vertices_is_rejected_with_the_cause() {
        let elsewhere = said(Vec3::new(10_001.0, 0.0, -0.5), 1.0);
        let expected =
            "none of the model's 15,002 vertices is inside the cage; the cage is 1e4 away from it: move";
        assert!(elsewhere.starts_with(expected), "{elsewhere}");
        // 82 is the ratio of the diagonals of the points, sqrt(2), and of the cage, sqrt(3) times 0.01.
        let small = said(Vec3::new(0.2, 0.3, -0.005), 0.01);
        assert!(
            small.ends_with("; the cage is 82 times smaller than the model: bring both into the same unit"),
            "{small}"
        );
        let both = said(Vec3::new(3.0, 0.0, 0.0), 100.0);
        assert!(both.contains("the cage is 2 away from it and 120 times larger than the model: "), "{both}");
        // A cage that encloses the model and is 100 times larger can be bound, with a notice.
        let bound = |size: f32| {
            let bounds = Bounds { min: Vec3::splat(-0.4 * size), max: Vec3::splat(0.6 * size) };
            let cage = Cage::new(&subdivided_box(bounds, 0.0, [1; 3])).unwrap();
            let options = BindOptions { grid: 8, ..BindOptions::default() };
            let binding = bind(&[Vec3::ZERO, Vec3::X, Vec3::Y], &cage, &options, &NoProgress).unwrap();
            binding.report.notices.into_iter().find(|said| said.starts_with("The cage is "))
        };
        let large = bound(100.0).unwrap();
        // 120 is the ratio of the diagonals of the cage, sqrt(3) times 100, and of the model, sqrt(2).
        let large_by =
            "The cage is 120 times larger than what it encloses of the model, and weights differ by ";
        let rest = large.strip_prefix(large_by);
        let spread: f64 = rest.and_then(|rest| rest.split(' ').next()?.parse().ok()).unwrap();
        // Weights are trilinear: the corner with the largest x and the smallest y and z has 0.41 * 0.6 * 0.6 at X and
        // 0.4 * 0.59 * 0.6 at Y, which differ by 6e-3.
        assert!((spread - 6e-3).abs() < 2e-3, "{large}");
        assert_eq!(bound(20.0), None);
        let beside = said(Vec3::new(0.1, 0.1, -0.4), 0.8);
        assert!(beside.contains("outside the cage's interior"), "{beside}");
    }

    /// The notice depends on the enclosed part of the model only, not on the size of the model or of other parts of the
    /// cage.
    #[test]
    fn oversize_is_judged_by_the_enclosed_part() {
        let box_of = |center: f32, size: f32, cuts: u32| {
            let half = Vec3::splat(size / 2.0);
            let bounds = Bounds { min: Vec3::X * center - half, max: Vec3::X * center + half };
            subdivided_box(bounds, 0.0, [cuts; 3])
        };
        let said = |parts: &[PolygonMesh], points: &[Vec3]| {
            let mut mesh = PolygonMesh::default();
            for part in parts {
                let first = mesh.positions.len() as u32;
                mesh.positions.extend(&part.positions);
                mesh.faces
                    .extend(part.faces.iter().map(|f| f.iter().map(|v| first + v).collect::<Vec<u32>>()));
            }
            let grid = if parts.len() > 1 { 64 } else { 24 };
            let options = BindOptions { grid, ..BindOptions::default() };
            let binding = bind(points, &Cage::new(&mesh).unwrap(), &options, &NoProgress).unwrap();
            binding.report.notices.into_iter().find(|said| said.starts_with("The cage is "))
        };
        let tiny = [Vec3::ZERO, 0.3 * Vec3::X, 0.3 * Vec3::Y];
        let with = |p: Vec3| [&tiny[..], &[p]].concat();
        // A cage 45 times larger than the model, with vertices so dense that none has a large weight at the cage's
        // centre.
        let fine = said(&[box_of(0.0, 11.0, 12)], &tiny).unwrap();
        assert!(fine.starts_with("The cage is 45 times larger than what it encloses"), "{fine}");
        // A second part of the model is ignored if it is outside the cage. Inside, it bends, so there is no notice.
        assert!(said(&[box_of(0.0, 30.0, 1)], &with(Vec3::X * 200.0)).is_some());
        assert_eq!(said(&[box_of(0.0, 30.0, 1)], &with(Vec3::X * 12.0)), None);
        // The model lies in the large part of a cage, then in the small part beside a large one.
        assert!(said(&[box_of(0.0, 30.0, 1), box_of(40.0, 1.0, 1)], &tiny).is_some());
        assert_eq!(said(&[box_of(0.0, 2.0, 1), box_of(40.0, 30.0, 1)], &tiny), None);
    }
}
