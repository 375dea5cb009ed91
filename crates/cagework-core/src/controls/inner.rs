//! Controls inside a cage: points, polylines and sheets (Joshi et al. 2007, "interior control structure").
//!
//! A point or a line has no capacity in space: on a grid its influence would depend on the size of a cell. So a point is a ball
//! and a line a tube, with a radius.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::cage::{CageError, MAX_FACES};
use crate::options::OutOfRange;
use crate::words::grouped;

/// Largest radius of balls and tubes, as a share of the cage's longest side.
pub const MAX_RADIUS: f32 = 0.25;

/// Smallest radius, as a share of the same: no grid resolves it, and in 32 bits a smaller ball has faces without area.
const MIN_RADIUS: f32 = 1e-4;

/// The radius unless one is given, as a share of the cage's longest side: two cells of a grid of 64.
const DEFAULT_RADIUS: f32 = 2.0 / 64.0;

/// One element: indices into [`InnerControls::positions`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub enum InnerElement {
    /// A ball.
    Point(u32),
    /// A polyline of tubes: two corners or more.
    Line(Vec<u32>),
    /// A face of a sheet, which both sides feel: three corners or more.
    Face(Vec<u32>),
}

impl InnerElement {
    /// Its corners.
    #[must_use]
    pub fn corners(&self) -> &[u32] {
        match self {
            Self::Point(corner) => std::slice::from_ref(corner),
            Self::Line(corners) | Self::Face(corners) => corners,
        }
    }

    /// What people call it.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Point(_) => "point",
            Self::Line(_) => "line",
            Self::Face(_) => "face",
        }
    }
}

/// Controls inside a cage. Elements that share a vertex hang together, so that a spine bends.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct InnerControls {
    /// Rest positions: columns after those of the cage. `[n_inner]`, object units.
    pub positions: Vec<Vec3>,
    /// What they are corners of.
    pub elements: Vec<InnerElement>,
    /// Radius of points and lines, object units; none: 1/32 of the cage's longest side.
    pub radius: Option<f32>,
}

/// Why controls cannot be used. Vertices and elements inside count from 0.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ControlError {
    /// Steps of subdivision out of range.
    #[error(transparent)]
    Option(#[from] OutOfRange),
    /// The smooth surface is no cage.
    #[error("the smooth surface of the cage cannot be used: {0}; take fewer steps, or a simpler cage")]
    Smooth(CageError),
    /// There are vertices but no element, or nothing at all.
    #[error("there is no control inside: give points (p), polylines (l) or faces (f)")]
    Empty,
    /// A coordinate is not a finite number.
    #[error("control {vertex} inside the cage has a coordinate that is not a finite number")]
    NotFinite {
        /// The vertex.
        vertex: u32,
    },
    /// A vertex that does not exist.
    #[error("{what} {element} inside the cage names vertex {vertex}, but there are only {n} (0 to {})", n - 1)]
    Index {
        /// Point, line or face.
        what: &'static str,
        /// The element.
        element: u32,
        /// The vertex it names.
        vertex: u32,
        /// Vertices there are.
        n: usize,
    },
    /// An element of no extent.
    #[error("{what} {element} inside the cage has {why}")]
    Degenerate {
        /// Line or face.
        what: &'static str,
        /// The element.
        element: u32,
        /// What is wrong.
        why: &'static str,
    },
    /// A radius out of range.
    #[error(
        "the radius of controls inside is {radius}; it must be from {least} to {most}, a quarter of the cage's longest side"
    )]
    Radius {
        /// What was given, object units.
        radius: f32,
        /// The smallest, object units.
        least: f32,
        /// The largest, object units.
        most: f32,
    },
    /// More than the surface may have.
    #[error(
        "{} points, lines and faces inside need {} faces, more than {}: use fewer",
        grouped(*elements), grouped(*faces), grouped(MAX_FACES)
    )]
    TooMany {
        /// Elements.
        elements: usize,
        /// Faces of the surface.
        faces: usize,
    },
    /// A control lies outside.
    #[error("control {vertex} is outside the cage{}: move it in", if *smooth { "'s smooth surface" } else { "" })]
    Outside {
        /// The vertex.
        vertex: u32,
        /// Whether it is the smooth surface.
        smooth: bool,
    },
    /// Two controls meet.
    #[error("{} {} and {} {} inside the cage overlap: move them apart, join them at a vertex, or use a smaller radius",
        what[0], elements[0], what[1], elements[1])]
    Overlap {
        /// Points, lines or faces.
        what: [&'static str; 2],
        /// The elements.
        elements: [u32; 2],
    },
}

impl InnerControls {
    /// The radius in a cage whose longest side is given, object units.
    #[must_use]
    pub fn radius_in(&self, longest: f32) -> f32 {
        self.radius.unwrap_or(DEFAULT_RADIUS * longest)
    }

    /// Whether an element needs the radius.
    #[must_use]
    pub fn has_radius(&self) -> bool {
        self.elements.iter().any(|element| !matches!(element, InnerElement::Face(_)))
    }

    /// Whether a control is of a ball or tube, whose surface is off it by the radius.
    pub(crate) fn is_rounded(&self, control: usize) -> bool {
        let rounded = self.elements.iter().filter(|element| !matches!(element, InnerElement::Face(_)));
        rounded.flat_map(InnerElement::corners).any(|&i| i as usize == control)
    }

    /// The foot of a place inside of balls and tubes, on the nearest of their points and lines: controls and their shares. Nothing
    /// without balls and tubes.
    pub(crate) fn foot(&self, place: DVec3) -> Option<[(u32, f64); 2]> {
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
        feet.min_by(|(d, _), (e, _)| d.total_cmp(e)).map(|(_, shares)| shares)
    }

    /// Vertices of no element, which move nothing.
    #[must_use]
    pub fn unused(&self) -> Vec<u32> {
        let mut is_used = vec![false; self.positions.len()];
        self.elements.iter().flat_map(InnerElement::corners).for_each(|&i| is_used[i as usize] = true);
        (0u32..).zip(is_used).filter(|(_, is_used)| !is_used).map(|(i, _)| i).collect()
    }

    /// Checks numbers, in a cage whose longest side is given.
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
                    Some("two corners after each other at one place")
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
