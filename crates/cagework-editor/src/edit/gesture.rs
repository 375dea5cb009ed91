//! Grab, rotate and scale: maps the pointer or a typed number to cage positions.

use glam::{Quat, Vec2, Vec3};

use cagework_core::view::View;

use super::pull::Pull;

/// Minimum sine of the angle between the pointer's ray and a constraint axis or plane. Below it, the gesture uses the
/// pointer's movement in the view plane, because a pixel would move vertices too far along an axis that almost points
/// at the eye, or in a plane that is seen almost edge-on.
const MIN_PLANE_SINE: f32 = 0.05;

/// Minimum distance between the start of a scale gesture and the centre, pixels. Shorter distances count as this
/// distance, because otherwise moving by a pixel would change the factor too much.
const MIN_SCALE_DISTANCE: f32 = 8.0;

/// Transformation that a gesture applies to the selection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS), ts(rename = "Gesture"))]
pub enum GestureKind {
    /// Translation of the selection.
    Grab,
    /// Rotation about the centre of the selection.
    Rotate,
    /// Scaling about the centre of the selection.
    Scale,
}

/// Directions to which a gesture is restricted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Constraint {
    /// The view plane (grab), the view axis (rotate), or all axes equally (scale).
    #[default]
    Free,
    /// One axis: 0 is x, 1 is y, 2 is z.
    Axis(usize),
    /// The plane normal to an axis, 0 to 2. Rotations turn about this axis.
    Plane(usize),
}

/// Kind, amount and constraint of a gesture, for a status line.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct GestureView {
    /// Whether the gesture translates, rotates or scales, which determines the unit of `amounts`.
    pub kind: GestureKind,
    /// Movement along the axis or along x, y and z, object units; the angle in degrees; or the factor.
    pub amounts: Vec<f32>,
    /// Axis of the constraint, 0 to 2; null if the gesture is free.
    pub axis: Option<usize>,
    /// Whether the gesture is restricted to the plane normal to `axis`.
    pub plane: bool,
}

/// A gesture in progress. Positions are always computed from those at the start of the gesture, so that errors do not
/// accumulate.
#[derive(Clone, Debug)]
pub struct Gesture {
    kind: GestureKind,
    constraint: Constraint,
    start: Vec<Vec3>,
    pull: Pull,
    pivot: Vec3,
    pointer_start: Vec2,
    pointer: Vec2,
    typed: Option<f32>,
}

impl Gesture {
    /// Starts a gesture at `pointer`. `start`: current positions, `[n_controls]`; `pivot`: centre of rotation and
    /// scaling.
    #[must_use]
    pub fn new(kind: GestureKind, start: Vec<Vec3>, pull: Pull, pivot: Vec3, pointer: Vec2) -> Self {
        let constraint = Constraint::Free;
        Self { kind, constraint, start, pull, pivot, pointer_start: pointer, pointer, typed: None }
    }

    /// Whether the gesture translates, rotates or scales.
    #[must_use]
    pub fn kind(&self) -> GestureKind {
        self.kind
    }

    /// Positions of the controls at the start of the gesture. `[n_controls]`
    #[must_use]
    pub fn start(&self) -> &[Vec3] {
        &self.start
    }

    /// Centre of rotation and scaling.
    #[must_use]
    pub fn pivot(&self) -> Vec3 {
        self.pivot
    }

    /// Restricts the gesture to the directions of `constraint`.
    pub fn constrain(&mut self, constraint: Constraint) {
        self.constraint = constraint;
    }

    /// Directions to which the gesture is restricted.
    #[must_use]
    pub fn constraint(&self) -> Constraint {
        self.constraint
    }

    /// Replaces the share of each vertex, for instance when the radius of proportional editing changes.
    pub fn set_pull(&mut self, pull: Pull) {
        self.pull = pull;
    }

    /// Sets the current position of the pointer, pixels.
    pub fn drag(&mut self, pointer: Vec2) {
        self.pointer = pointer;
    }

    /// Sets an amount that replaces the pointer (object units, degrees, or a factor); `None` returns to the pointer.
    pub fn type_amount(&mut self, amount: Option<f32>) {
        self.typed = amount.filter(|a| a.is_finite());
    }

    /// Positions to which the gesture moves the controls. `[n_controls]`
    #[must_use]
    pub fn positions(&self, view: &dyn View) -> Vec<Vec3> {
        match self.kind {
            GestureKind::Grab => {
                let movement = self.movement(view);
                self.pull.apply(&self.start, &|p, share| p + share * movement)
            }
            GestureKind::Rotate => {
                let (axis, angle) = self.turn(view);
                self.pull.apply(&self.start, &|p, share| {
                    self.pivot + Quat::from_axis_angle(axis, share * angle) * (p - self.pivot)
                })
            }
            GestureKind::Scale => {
                let factors = self.factors(view);
                self.pull.apply(&self.start, &|p, share| {
                    self.pivot + Vec3::ONE.lerp(factors, share) * (p - self.pivot)
                })
            }
        }
    }

    /// Current state for a status line.
    #[must_use]
    pub fn view(&self, view: &dyn View) -> GestureView {
        let (axis, plane) = match self.constraint {
            Constraint::Free => (None, false),
            Constraint::Axis(axis) => (Some(axis), false),
            Constraint::Plane(axis) => (Some(axis), true),
        };
        let amounts = match self.kind {
            GestureKind::Grab => {
                let movement = self.movement(view).to_array();
                axis.filter(|_| !plane).map_or_else(|| movement.to_vec(), |axis| vec![movement[axis]])
            }
            GestureKind::Rotate => vec![self.turn(view).1.to_degrees()],
            GestureKind::Scale => vec![self.factor(view)],
        };
        GestureView { kind: self.kind, amounts, axis, plane }
    }

    fn movement(&self, view: &dyn View) -> Vec3 {
        if let Some(amount) = self.typed {
            return match self.constraint {
                Constraint::Axis(axis) => amount * Vec3::AXES[axis],
                // A typed amount moves along the first axis of the plane.
                Constraint::Plane(axis) => amount * Vec3::AXES[if axis == 0 { 1 } else { 0 }],
                Constraint::Free => amount * view.right(),
            };
        }
        let free = view.in_view_plane(self.pivot, self.pointer - self.pointer_start);
        match self.constraint {
            Constraint::Free => free,
            Constraint::Axis(axis) => {
                let axis = Vec3::AXES[axis];
                let from = along_axis(view, self.pointer_start, self.pivot, axis);
                match from.zip(along_axis(view, self.pointer, self.pivot, axis)) {
                    Some((from, to)) => (to - from) * axis,
                    // The axis is almost parallel to the pointer's ray: moving the pointer up moves vertices away from
                    // the eye.
                    None => -free.dot(view.up()) * axis.dot(view.backward()).signum() * axis,
                }
            }
            Constraint::Plane(axis) => {
                let normal = Vec3::AXES[axis];
                let from = in_plane(view, self.pointer_start, self.pivot, normal);
                match from.zip(in_plane(view, self.pointer, self.pivot, normal)) {
                    Some((from, to)) => to - from,
                    None => free - free.dot(normal) * normal,
                }
            }
        }
    }

    /// Rotation axis and angle, radians.
    fn turn(&self, view: &dyn View) -> (Vec3, f32) {
        let backward = view.backward();
        let axis = match self.constraint {
            Constraint::Free => backward,
            Constraint::Axis(axis) | Constraint::Plane(axis) => Vec3::AXES[axis],
        };
        if let Some(degrees) = self.typed {
            return (axis, degrees.to_radians());
        }
        let center = view.project(self.pivot).map_or(self.pointer_start, |(pixel, _)| pixel);
        let (from, to) = (self.pointer_start - center, self.pointer - center);
        if from == Vec2::ZERO || to == Vec2::ZERO {
            return (axis, 0.0);
        }
        // The pixel y axis points down, so a counter-clockwise turn has a negative angle.
        let seen = -from.angle_to(to);
        // About an axis that points away from the eye, the turn appears reversed.
        (axis, if axis.dot(backward) < 0.0 { -seen } else { seen })
    }

    fn factor(&self, view: &dyn View) -> f32 {
        if let Some(factor) = self.typed {
            return factor;
        }
        let Some((center, _)) = view.project(self.pivot) else { return 1.0 };
        let from = self.pointer_start - center;
        // Project the pointer's movement on the initial direction, so that crossing the centre mirrors the selection.
        let reach = from.length().max(MIN_SCALE_DISTANCE);
        let direction = if from == Vec2::ZERO { Vec2::X } else { from.normalize() };
        1.0 + (self.pointer - self.pointer_start).dot(direction) / reach
    }

    fn factors(&self, view: &dyn View) -> Vec3 {
        let factor = self.factor(view);
        match self.constraint {
            Constraint::Free => Vec3::splat(factor),
            Constraint::Axis(axis) => {
                Vec3::from_array(std::array::from_fn(|k| if k == axis { factor } else { 1.0 }))
            }
            Constraint::Plane(axis) => {
                Vec3::from_array(std::array::from_fn(|k| if k == axis { 1.0 } else { factor }))
            }
        }
    }
}

/// Coordinate on the axis through `through` that is nearest to the pointer's ray; `None` if axis and ray are almost
/// parallel.
fn along_axis(view: &dyn View, pointer: Vec2, through: Vec3, axis: Vec3) -> Option<f32> {
    let (origin, direction) = view.ray(pointer);
    let between = through - origin;
    let cosine = direction.dot(axis);
    let sine_squared = 1.0 - cosine * cosine;
    if sine_squared < MIN_PLANE_SINE * MIN_PLANE_SINE {
        return None;
    }
    Some((cosine * direction.dot(between) - axis.dot(between)) / sine_squared)
}

/// Intersection of the pointer's ray with a plane; `None` if the ray is almost parallel to the plane or meets the plane
/// behind the eye.
fn in_plane(view: &dyn View, pointer: Vec2, through: Vec3, normal: Vec3) -> Option<Vec3> {
    let (origin, direction) = view.ray(pointer);
    let towards = direction.dot(normal);
    if towards.abs() < MIN_PLANE_SINE {
        return None;
    }
    let along = (through - origin).dot(normal) / towards;
    (along > 0.0).then(|| origin + along * direction)
}

#[cfg(test)]
mod tests;
