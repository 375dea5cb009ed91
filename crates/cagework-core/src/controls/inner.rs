//! Controls inside a cage: points, polylines and sheets (Joshi et al. 2007, "inner control structure").
//!
//! On a grid, the influence of a point or line would depend on the cell size, as points and lines have zero capacity in
//! space. Points are therefore balls and lines are tubes, with a radius.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::cage::{CageError, MAX_FACES};
use crate::options::RangeError;
use crate::words::grouped;

/// Largest allowed radius of balls and tubes, as a fraction of the cage's longest side.
pub const MAX_RADIUS: f32 = 0.25;

/// Smallest allowed radius of balls and tubes, as a fraction of the cage's longest side. No grid resolves a ball of
/// this radius. The faces of smaller balls would have no area in f32.
const MIN_RADIUS: f32 = 1e-4;

/// Default radius of balls and tubes, as a fraction of the cage's longest side: two cells of a grid of 64.
const DEFAULT_RADIUS: f32 = 2.0 / 64.0;

/// An element of inner controls: indices into [`InnerControls::positions`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub enum InnerElement {
    /// A ball around the control with this index.
    Point(u32),
    /// A polyline of tubes, at least two corners.
    Line(Vec<u32>),
    /// A face of a sheet, at least three corners. Values are prescribed on both of its sides.
    Face(Vec<u32>),
}

impl InnerElement {
    /// Indices of its controls in [`InnerControls::positions`].
    #[must_use]
    pub fn corners(&self) -> &[u32] {
        match self {
            Self::Point(corner) => std::slice::from_ref(corner),
            Self::Line(corners) | Self::Face(corners) => corners,
        }
    }

    /// Kind of the element in messages: "point", "line" or "face".
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Point(_) => "point",
            Self::Line(_) => "line",
            Self::Face(_) => "face",
        }
    }
}

/// Controls inside a cage. Elements that share a vertex are connected.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct InnerControls {
    /// Rest positions. In the weight matrix, their columns come after those of the cage vertices. `[n_inner]`, object
    /// units.
    pub positions: Vec<Vec3>,
    /// Elements, with indices into `positions`.
    pub elements: Vec<InnerElement>,
    /// Radius of points and lines, object units; `None`: 1/32 of the cage's longest side.
    pub radius: Option<f32>,
}

/// Why controls cannot be used. Indices start at 0.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ControlError {
    /// The number of subdivision steps is out of range.
    #[error(transparent)]
    Option(#[from] RangeError),
    /// The subdivided surface is not a valid cage.
    #[error("the smooth surface of the cage cannot be used: {0}; use fewer steps or a simpler cage")]
    Smooth(CageError),
    /// The inner controls have no elements.
    #[error("there is no control inside: give points (p), polylines (l) or faces (f)")]
    Empty,
    /// A coordinate is not a finite number.
    #[error("control {vertex} inside the cage has a coordinate that is not a finite number")]
    NotFinite {
        /// Index of the vertex among the inner controls.
        vertex: u32,
    },
    /// An element has the index of a vertex that does not exist.
    #[error("{what} {element} inside the cage names vertex {vertex}; indices run from 0 to {}", n - 1)]
    Index {
        /// Kind of element.
        what: &'static str,
        /// Index of the element with the invalid index.
        element: u32,
        /// The vertex index that does not exist.
        vertex: u32,
        /// Number of vertices of the inner controls.
        n: usize,
    },
    /// An element has too few corners, a repeated corner, or no area.
    #[error("{what} {element} inside the cage has {why}")]
    Degenerate {
        /// Kind of element.
        what: &'static str,
        /// Index of the degenerate element.
        element: u32,
        /// Description of the defect.
        why: &'static str,
    },
    /// The radius of balls and tubes is out of range.
    #[error(
        "the radius of controls inside is {radius}; it must be from {least} to {most}, a quarter of the cage's longest side"
    )]
    Radius {
        /// The rejected radius, in object units.
        radius: f32,
        /// The smallest allowed radius, in object units.
        least: f32,
        /// The largest allowed radius, in object units.
        most: f32,
    },
    /// The surface has too many faces.
    #[error(
        "{} points, lines and faces inside need {} faces, more than {}: use fewer",
        grouped(*elements), grouped(*faces), grouped(MAX_FACES)
    )]
    TooMany {
        /// Number of elements inside the cage.
        elements: usize,
        /// Number of faces that the surface would have.
        faces: usize,
    },
    /// A control lies outside the surface.
    #[error("control {vertex} is outside the cage{}: move it in", if *smooth { "'s smooth surface" } else { "" })]
    Outside {
        /// Index of the vertex among the inner controls.
        vertex: u32,
        /// Whether the surface is subdivided.
        smooth: bool,
    },
    /// Two elements overlap.
    #[error("{} {} and {} {} inside the cage overlap: move them apart, join them at a vertex, or use a smaller radius",
        what[0], elements[0], what[1], elements[1])]
    Overlap {
        /// Kinds of the two overlapping elements.
        what: [&'static str; 2],
        /// Indices of the two overlapping elements.
        elements: [u32; 2],
    },
}

impl InnerControls {
    /// Radius in a cage with the given longest side, object units.
    #[must_use]
    pub fn radius_in(&self, longest: f32) -> f32 {
        self.radius.unwrap_or(DEFAULT_RADIUS * longest)
    }

    /// Controls that are balls.
    pub(crate) fn balls(&self) -> impl Iterator<Item = u32> {
        self.elements.iter().filter_map(|element| match element {
            InnerElement::Point(control) => Some(*control),
            InnerElement::Line(_) | InnerElement::Face(_) => None,
        })
    }

    /// Whether any element is a ball or tube.
    #[must_use]
    pub fn has_radius(&self) -> bool {
        self.elements.iter().any(|element| !matches!(element, InnerElement::Face(_)))
    }

    /// Whether a control belongs to a ball or tube.
    pub(crate) fn is_rounded(&self, control: usize) -> bool {
        let rounded = self.elements.iter().filter(|element| !matches!(element, InnerElement::Face(_)));
        rounded.flat_map(InnerElement::corners).any(|&i| i as usize == control)
    }

    /// Finds the point on the axes of balls and tubes that is closest to `place`: its distance, object units, and two
    /// controls with their shares. `None` without balls and tubes.
    pub(crate) fn foot(&self, place: DVec3) -> Option<(f64, [(u32, f64); 2])> {
        let at = |i: u32| self.positions[i as usize].as_dvec3();
        let rounded = self.elements.iter().filter(|element| !matches!(element, InnerElement::Face(_)));
        let ends = rounded.flat_map(|element| match element.corners() {
            &[only] => vec![[only, only]],
            corners => corners.windows(2).map(|pair| [pair[0], pair[1]]).collect(),
        });
        let feet = ends.map(|[a, b]| {
            let (from, way) = (at(a), at(b) - at(a));
            let share =
                ((place - from).dot(way) / way.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            (place.distance_squared(from + share * way), [(a, 1.0 - share), (b, share)])
        });
        feet.min_by(|(d, _), (e, _)| d.total_cmp(e)).map(|(squared, shares)| (squared.sqrt(), shares))
    }

    /// Vertices that no element uses; they have no influence.
    #[must_use]
    pub fn unused(&self) -> Vec<u32> {
        let mut is_used = vec![false; self.positions.len()];
        self.elements.iter().flat_map(InnerElement::corners).for_each(|&i| is_used[i as usize] = true);
        (0u32..).zip(is_used).filter(|(_, is_used)| !is_used).map(|(i, _)| i).collect()
    }

    /// Checks numbers and indices, for a cage with the given longest side.
    pub(super) fn check(&self, longest: f32) -> Result<(), ControlError> {
        if self.elements.is_empty() {
            return Err(ControlError::Empty);
        }
        if let Some(vertex) = self.positions.iter().position(|p| !p.is_finite()) {
            return Err(ControlError::NotFinite { vertex: vertex as u32 });
        }
        let radius = self.radius_in(longest);
        let [least, most] = [MIN_RADIUS, MAX_RADIUS].map(|share| share * longest);
        if !(radius >= least && radius <= most) {
            return Err(ControlError::Radius { radius, least, most });
        }
        let n = self.positions.len();
        for (number, element) in (0u32..).zip(&self.elements) {
            let what = element.name();
            if let Some(&vertex) = element.corners().iter().find(|&&i| i as usize >= n) {
                return Err(ControlError::Index { what, element: number, vertex, n });
            }
            let at = |i: &u32| self.positions[*i as usize];
            let corners = element.corners();
            let why = match element {
                InnerElement::Line(_) if corners.len() < 2 => Some("fewer than two corners"),
                InnerElement::Line(_) if corners.windows(2).any(|w| at(&w[0]) == at(&w[1])) => {
                    Some("two consecutive corners at the same position")
                }
                InnerElement::Face(_) if corners.len() < 3 => Some("fewer than three corners"),
                InnerElement::Face(_) if has_repeats(corners) => Some("a corner more than once"),
                _ => None,
            };
            if let Some(why) = why {
                return Err(ControlError::Degenerate { what, element: number, why });
            }
        }
        Ok(())
    }
}

fn has_repeats(corners: &[u32]) -> bool {
    let mut sorted = corners.to_vec();
    sorted.sort_unstable();
    sorted.windows(2).any(|w| w[0] == w[1])
}
