//! Controls whose surface is not the cage: subdivided cages, and inner controls.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use glam::{DVec3, Vec3};

use super::Controls;
use super::inner::{ControlError, InnerControls, InnerElement};
use super::shapes::{self, Shape, Size};
use crate::cage::{Cage, MAX_FACES};
use crate::contact::{Corners, each_meeting};
use crate::deform::deform_vertices;
use crate::enclosure::Enclosure;
use crate::geometry::closest_point_on_triangle;
use crate::options::SMOOTH_STEPS;
use crate::smooth::subdivide;
use crate::weights::Weights;

/// Largest distance from the cage at which a corner of a sheet may lie outside, as a fraction of the cage's diagonal.
/// Users draw sheets slightly beyond the cage, to leave no gap between the sheet and the cage.
const MAX_PROTRUSION: f64 = 0.02;

/// Number of intervals into which the axis of a tube is divided to measure its distance from the cage.
const AXIS_SAMPLES: u32 = 32;

/// Limit on the points at which this distance is measured, each of which is compared with all faces of the cage.
const MAX_AXIS_SAMPLES: usize = 1000;

/// Owned form of [`Controls`], with optional subdivision and inner controls.
#[derive(Clone, Debug)]
pub struct ControlSet {
    cage: Cage,
    smooth: u32,
    inner: InnerControls,
    /// Rest positions of the controls, object units. `[n_controls]`
    rest: Vec<Vec3>,
    surface: Cage,
    /// Matrix B of [`Controls`], `[n_surface, n_controls]`; `None` for the identity.
    rows: Option<Weights>,
    /// Cage face of each surface face; `None` for an inner wall. `[n_surface_faces]`
    origins: Vec<Option<u32>>,
    /// Balls and tubes that intersect the cage's surface, as indices of elements, ascending.
    reaching: Vec<u32>,
}

impl<'a> From<&'a ControlSet> for Controls<'a> {
    fn from(set: &'a ControlSet) -> Self {
        if set.rows.is_none() {
            return Self::from(&set.cage);
        }
        let ControlSet { cage, rest, surface, rows, origins, .. } = set;
        Self { cage, rest, surface, rows: rows.as_ref(), origins: Some(origins), set: Some(set) }
    }
}

impl ControlSet {
    /// Creates the controls of a plain cage.
    #[must_use]
    pub fn plain(cage: &Cage) -> Self {
        Self {
            cage: cage.clone(),
            smooth: 0,
            inner: InnerControls::default(),
            rest: cage.positions().to_vec(),
            surface: cage.clone(),
            rows: None,
            origins: (0..cage.faces().len() as u32).map(Some).collect(),
            reaching: Vec::new(),
        }
    }

    /// Creates the controls of a cage whose surface is subdivided `smooth` times (0 to 3), with optional inner
    /// controls.
    ///
    /// # Errors
    /// [`ControlError`]: too many subdivision steps, or inner controls that are outside, overlap, have invalid indices,
    /// or are too many.
    pub fn new(cage: &Cage, smooth: u32, inner: InnerControls) -> Result<Self, ControlError> {
        SMOOTH_STEPS.check(smooth)?;
        let mut set = Self::plain(cage);
        if smooth > 0 {
            let made = subdivide(&cage.to_polygon_mesh(), smooth);
            set.smooth = smooth;
            set.surface = Cage::new(&made.mesh).map_err(ControlError::Smooth)?;
            set.origins = made.face_of.iter().map(|&f| set.origins[f as usize]).collect();
            set.rows = Some(made.rows);
        }
        if inner != InnerControls::default() {
            set.add(inner)?;
        }
        Ok(set)
    }

    /// The cage, without subdivision and inner controls.
    #[must_use]
    pub fn cage(&self) -> &Cage {
        &self.cage
    }

    /// Number of subdivision steps from the cage to the surface.
    #[must_use]
    pub fn smooth(&self) -> u32 {
        self.smooth
    }

    /// The inner controls; empty if the set has none.
    #[must_use]
    pub fn inner(&self) -> &InnerControls {
        &self.inner
    }

    /// Balls and tubes that reach through the cage's surface, as indices of elements, ascending.
    #[must_use]
    pub fn reaching(&self) -> &[u32] {
        &self.reaching
    }

    /// Distance from the cage's surface to the centres and axes of the balls and tubes in [`Self::reaching`], object
    /// units: with a smaller radius, none of them reaches through. Axes are sampled, at [`MAX_AXIS_SAMPLES`] points in
    /// all.
    pub(crate) fn distance_of_reaching(&self) -> f64 {
        let at = |i: u32| self.inner.positions[i as usize].as_dvec3();
        let of_element = |&element: &u32| match &self.inner.elements[element as usize] {
            InnerElement::Line(corners) => {
                let along = |pair: &[u32]| {
                    let [a, b] = [at(pair[0]), at(pair[1])];
                    (0..=AXIS_SAMPLES).map(move |k| a.lerp(b, f64::from(k) / f64::from(AXIS_SAMPLES)))
                };
                corners.windows(2).flat_map(along).collect()
            }
            element => element.corners().iter().map(|&i| at(i)).collect::<Vec<_>>(),
        };
        let of_cage =
            |facet: &u32| self.origins[self.surface.face_of_facet()[*facet as usize] as usize].is_some();
        let facets: Vec<u32> = (0..self.surface.facets().len() as u32).filter(of_cage).collect();
        let distance = |p: DVec3| {
            let to = |&f: &u32| closest_point_on_triangle(p, self.surface.facet_corners(f)).point.distance(p);
            facets.iter().map(to).fold(f64::INFINITY, f64::min)
        };
        let samples = self.reaching.iter().flat_map(of_element).take(MAX_AXIS_SAMPLES);
        samples.map(distance).fold(f64::INFINITY, f64::min)
    }

    /// Computes the positions of the surface vertices for display, with the controls at `positions` (`[n_controls]`,
    /// object units). Balls and tubes are translated without rotation, so they keep their radius. `[n_surface]`
    ///
    /// # Panics
    /// If there is not one position per control.
    #[must_use]
    pub fn surface_at(&self, positions: &[Vec3]) -> Vec<Vec3> {
        let Some(rows) = &self.rows else { return positions.to_vec() };
        let by: Vec<Vec3> = positions.iter().zip(&self.rest).map(|(p, rest)| p - rest).collect();
        let moved = deform_vertices(rows, &by);
        self.surface.positions().iter().zip(moved).map(|(rest, by)| rest + by).collect()
    }

    fn add(&mut self, inner: InnerControls) -> Result<(), ControlError> {
        let extent = self.surface.bounds().extent();
        inner.check(extent.max_element())?;
        let n_faces = self.surface.faces().len()
            + inner.elements.iter().map(|e| faces_of(e, steps_of(&inner))).sum::<usize>();
        if n_faces > MAX_FACES {
            return Err(ControlError::TooMany { elements: inner.elements.len(), faces: n_faces });
        }
        self.check_inside(&inner)?;
        let radius = f64::from(inner.radius_in(extent.max_element()));
        let mut sizes = vec![Size::EqualVolume; inner.elements.len()];
        let mut walls = Walls::new(&inner, &self.cage, radius, &sizes)?;
        let meeting = walls.meeting(&inner);
        if !meeting.is_empty() {
            // Meshes of equal volume exceed the radius, so they may intersect although balls and tubes do not: retry
            // with inscribed meshes.
            meeting.iter().flatten().for_each(|&element| sizes[element as usize] = Size::Inscribed);
            walls = Walls::new(&inner, &self.cage, radius, &sizes)?;
            if let Some(&elements) = walls.meeting(&inner).first() {
                let what = elements.map(|element| inner.elements[element as usize].name());
                return Err(ControlError::Overlap { what, elements });
            }
        }

        self.reaching = walls.reaching(&inner, &self.surface);
        let n_cage = self.rest.len() as u32;
        let first = self.surface.n_vertices() as u32;
        let faces: Vec<Vec<u32>> =
            walls.faces.iter().map(|face| face.iter().map(|&i| first + i).collect()).collect();
        let positions: Vec<Vec3> = walls.points.iter().map(|(p, _)| p.as_vec3()).collect();
        let surface =
            self.surface.with_walls(&positions, &faces, &walls.part_of).map_err(ControlError::Smooth)?;
        let (mut indptr, mut indices, mut data) = match &self.rows {
            Some(rows) => (rows.indptr().to_vec(), rows.indices().to_vec(), rows.data().to_vec()),
            None => ((0..=n_cage).collect(), (0..n_cage).collect(), vec![1.0; n_cage as usize]),
        };
        for (_, [(a, of_a), (b, of_b)]) in &walls.points {
            for (control, share) in [(*a, *of_a), (*b, *of_b)].into_iter().filter(|(_, share)| *share > 0.0) {
                indices.push(n_cage + control);
                data.push(share as f32);
            }
            indptr.push(indices.len() as u32);
        }
        let n_columns = n_cage + inner.positions.len() as u32;
        self.rows = Some(Weights::from_parts(n_columns, indptr, indices, data));
        self.origins.resize(self.origins.len() + faces.len(), None);
        self.rest.extend(&inner.positions);
        self.surface = surface;
        self.inner = inner;
        Ok(())
    }

    /// Checks that all inner controls are inside. Corners that only sheets use may be up to `MAX_PROTRUSION` outside.
    fn check_inside(&self, inner: &InnerControls) -> Result<(), ControlError> {
        let near = MAX_PROTRUSION * f64::from(self.surface.diagonal());
        let mut may_stick_out = vec![true; inner.positions.len()];
        for element in inner.elements.iter().filter(|element| !matches!(element, InnerElement::Face(_))) {
            element.corners().iter().for_each(|&i| may_stick_out[i as usize] = false);
        }
        let outside = Enclosure::new(&self.surface, &inner.positions).outside();
        let is_far = |v: &u32| {
            let p = inner.positions[*v as usize].as_dvec3();
            let facets = 0..self.surface.facets().len() as u32;
            !may_stick_out[*v as usize]
                || facets.into_iter().all(|f| {
                    closest_point_on_triangle(p, self.surface.facet_corners(f)).point.distance(p) > near
                })
        };
        match outside.into_iter().find(is_far) {
            Some(vertex) => Err(ControlError::Outside { vertex, smooth: self.smooth > 0 }),
            None => Ok(()),
        }
    }
}

fn steps_of(inner: &InnerControls) -> u32 {
    shapes::ball_steps(inner.balls().count())
}

/// Number of faces of an element's mesh. Balls are subdivided `steps` times; sheets have triangles on both sides.
fn faces_of(element: &InnerElement, steps: u32) -> usize {
    match element {
        InnerElement::Point(_) => shapes::ball_faces(steps),
        InnerElement::Line(corners) => (corners.len() - 1) * shapes::TUBE_FACES,
        InnerElement::Face(corners) => 2 * (corners.len() - 2),
    }
}

/// Two controls and their shares in a point's value.
type ControlShares = [(u32, f64); 2];

/// Meshes of the inner controls.
#[derive(Default)]
struct Walls {
    points: Vec<(DVec3, ControlShares)>,
    faces: Vec<Vec<u32>>,
    /// Element to which each face belongs. `[n_faces]`
    element_of: Vec<u32>,
    /// Connected part to which each face belongs. `[n_faces]`
    part_of: Vec<u32>,
    /// Surface vertex of each control that is a corner of a sheet.
    corners: BTreeMap<u32, u32>,
}

impl Walls {
    /// Builds the meshes of all elements. `sizes[k]`: size of the mesh of element k.
    fn new(inner: &InnerControls, cage: &Cage, radius: f64, sizes: &[Size]) -> Result<Self, ControlError> {
        let mut walls = Self::default();
        let at = |i: u32| inner.positions[i as usize].as_dvec3();
        let parts = parts(inner);
        for (number, element) in (0u32..).zip(&inner.elements) {
            let (part, size) = (parts[number as usize], sizes[number as usize]);
            match element {
                InnerElement::Point(i) => {
                    let shape = shapes::ball(at(*i), radius, steps_of(inner), size);
                    walls.add(shape, [*i, *i], number, part);
                }
                InnerElement::Line(corners) => {
                    for pair in corners.windows(2) {
                        let [a, b] = [at(pair[0]), at(pair[1])];
                        walls.add(shapes::tube(a, b, radius, size), [pair[0], pair[1]], number, part);
                    }
                }
                InnerElement::Face(corners) => {
                    let outline: Vec<DVec3> = corners.iter().map(|&i| at(i)).collect();
                    let triangles = crate::cage::face_triangles(&outline, f64::from(cage.diagonal()));
                    let flat = |_| ControlError::Degenerate { what: "face", element: number, why: "no area" };
                    let points: Vec<u32> = corners.iter().map(|&i| walls.corner(i, at(i))).collect();
                    for [a, b, c] in triangles.map_err(flat)? {
                        for side in [[a, b, c], [c, b, a]] {
                            walls.face(side.map(|k| points[k as usize]).to_vec(), number, part);
                        }
                    }
                }
            }
        }
        Ok(walls)
    }

    /// Returns the surface vertex at a corner of a sheet, which all faces of the sheet share.
    fn corner(&mut self, control: u32, at: DVec3) -> u32 {
        *self.corners.entry(control).or_insert_with(|| {
            self.points.push((at, [(control, 1.0), (control, 0.0)]));
            self.points.len() as u32 - 1
        })
    }

    fn add(&mut self, shape: Shape, [a, b]: [u32; 2], element: u32, part: u32) {
        let first = self.points.len() as u32;
        self.points.extend(shape.points.into_iter().map(|(p, share)| (p, [(a, 1.0 - share), (b, share)])));
        for face in shape.faces {
            self.face(face.into_iter().map(|i| first + i).collect(), element, part);
        }
    }

    fn face(&mut self, face: Vec<u32>, element: u32, part: u32) {
        self.faces.push(face);
        self.element_of.push(element);
        self.part_of.push(part);
    }

    /// The triangles of all meshes, and the element of each.
    fn triangles(&self) -> (Vec<Corners>, Vec<u32>) {
        let (mut triangles, mut element_of) = (Vec::new(), Vec::new());
        for (face, &element) in self.faces.iter().zip(&self.element_of) {
            for k in 2..face.len() {
                let index = [face[0], face[k - 1], face[k]];
                triangles.push(Corners { index, at: index.map(|i| self.points[i as usize].0) });
                element_of.push(element);
            }
        }
        (triangles, element_of)
    }

    /// Finds the balls and tubes whose meshes intersect the cage's surface. The list is incomplete if the search
    /// reaches a limit of [`crate::contact`].
    fn reaching(&self, inner: &InnerControls, surface: &Cage) -> Vec<u32> {
        let (mut triangles, element_of) = self.triangles();
        let first = self.points.len() as u32;
        triangles.extend((0u32..).zip(surface.facets()).map(|(facet, corners)| Corners {
            index: corners.map(|i| first + i),
            at: surface.facet_corners(facet),
        }));
        let mut reaching = Vec::new();
        each_meeting(&triangles, |pair| {
            if let [Some(&element), None] | [None, Some(&element)] = pair.map(|t| element_of.get(t as usize))
            {
                reaching.push(element);
            }
            ControlFlow::Continue(())
        });
        reaching.retain(|&element| !matches!(inner.elements[element as usize], InnerElement::Face(_)));
        reaching.sort_unstable();
        reaching.dedup();
        reaching
    }

    /// Finds the pairs of unconnected elements whose meshes intersect. The list is incomplete if the search reaches a
    /// limit of [`crate::contact`].
    fn meeting(&self, inner: &InnerControls) -> Vec<[u32; 2]> {
        let (triangles, element_of) = self.triangles();
        let parts = parts(inner);
        let mut meeting = Vec::new();
        each_meeting(&triangles, |pair| {
            let elements = pair.map(|t| element_of[t as usize]);
            let [a, b] = elements.map(|element| parts[element as usize]);
            if a == b {
                return ControlFlow::Continue(());
            }
            let [low, high] = [elements[0].min(elements[1]), elements[0].max(elements[1])];
            meeting.push([low, high]);
            if meeting.len() < triangles.len() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        meeting
    }
}

/// Returns the first element of the connected part of each element; elements are connected by shared vertices.
fn parts(inner: &InnerControls) -> Vec<u32> {
    let mut part_of_vertex = vec![u32::MAX; inner.positions.len()];
    let mut parts: Vec<u32> = (0..inner.elements.len() as u32).collect();
    // Repeat until no label changes. Chains of elements are mostly in order, so a few passes suffice.
    loop {
        let before = parts.clone();
        for (part, element) in parts.iter_mut().zip(&inner.elements) {
            let of_corners = element.corners().iter().map(|&i| part_of_vertex[i as usize]);
            *part = of_corners.fold(*part, u32::min);
            element.corners().iter().for_each(|&i| part_of_vertex[i as usize] = *part);
        }
        if parts == before {
            return parts;
        }
    }
}

pub(super) fn nearest_triangle(cage: &Cage, p: DVec3) -> [u32; 3] {
    let distance = |t: u32| closest_point_on_triangle(p, cage.triangle_corners(t)).point.distance(p);
    let nearest = (0..cage.triangles().len() as u32).min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
    cage.triangles()[nearest.unwrap_or(0) as usize]
}

#[cfg(test)]
mod tests;
