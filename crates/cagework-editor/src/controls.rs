//! The cage at rest, with its subdivision and its inner controls.
//!
//! Inner controls are the corners of points, lines and sheets inside the cage. They are the last of the cage's
//! positions and belong to no face. Selection, gestures, poses, undo and projects treat them like the cage's vertices.

use cagework_core::{
    Cage, CageError, ControlError, ControlSet, Controls, InnerControls, InnerElement, PolygonMesh,
};
use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::error::EditError;

/// Subdivision and inner controls of a cage.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct CageControls {
    /// Number of subdivision steps from the cage to its smooth surface.
    pub smooth: u32,
    /// Number of inner controls, which are the last of the cage's positions.
    pub inner: usize,
    /// Points, lines and faces; indices are relative to the first inner control.
    pub elements: Vec<InnerElement>,
    /// Radius of points and lines, object units; null for 1/32 of the cage's longest side.
    pub radius: Option<f32>,
    /// Loops of cage vertices around limbs, of a generated cage.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[cfg_attr(feature = "typescript", ts(optional, as = "Option<Vec<Vec<u32>>>"))]
    pub rings: Vec<Vec<u32>>,
}

/// A kind of inner control.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub enum InnerKind {
    /// A ball around a point.
    Point,
    /// A tube around a polyline.
    Line,
    /// A polygonal sheet.
    Face,
}

impl InnerKind {
    fn element(self, corners: Vec<u32>) -> InnerElement {
        match (self, corners.as_slice()) {
            (Self::Point, [corner, ..]) => InnerElement::Point(*corner),
            (Self::Face, _) => InnerElement::Face(corners),
            _ => InnerElement::Line(corners),
        }
    }
}

/// A cage at rest with its inner controls, or a draft that is not a valid cage yet.
#[derive(Clone, Debug)]
pub struct RestCage {
    /// Positions of the cage's vertices, then of inner controls; faces of the cage.
    pub mesh: PolygonMesh,
    /// Subdivision and inner controls.
    pub controls: CageControls,
    /// The controls of a bind, or why the mesh is not a valid cage.
    pub set: Result<ControlSet, CageError>,
    /// Notices about inner controls that were dropped because they do not fit, and notices of the generator.
    pub notices: Vec<String>,
}

/// Compares only mesh and controls, from which the set is derived.
impl PartialEq for RestCage {
    fn eq(&self, other: &Self) -> bool {
        self.mesh == other.mesh && self.controls == other.controls
    }
}

impl Default for RestCage {
    fn default() -> Self {
        let set = Err(CageError::Empty);
        Self { mesh: PolygonMesh::default(), controls: CageControls::default(), set, notices: Vec::new() }
    }
}

impl RestCage {
    /// Creates a cage from a mesh whose last positions are the inner controls.
    ///
    /// # Errors
    /// If a position is not finite, an index does not exist, or the controls do not fit into the cage.
    pub fn new(mut mesh: PolygonMesh, controls: CageControls) -> Result<Self, EditError> {
        if !mesh.positions.iter().all(|p| p.is_finite()) {
            return Err(EditError::NotFinite { what: "positions of a cage" });
        }
        check_indices(&mesh, &controls)?;
        let n_cage = mesh.positions.len().saturating_sub(controls.inner);
        let positions = mesh.positions.split_off(n_cage);
        let inner = if positions.is_empty() && controls.elements.is_empty() {
            // Without controls, omit the radius, which applies to controls that may be added later.
            InnerControls::default()
        } else {
            InnerControls {
                positions: positions.clone(),
                elements: controls.elements.clone(),
                radius: controls.radius,
            }
        };
        let set = match Cage::new(&mesh) {
            Ok(cage) => Ok(ControlSet::new(&cage, controls.smooth, inner)?),
            Err(fault) => Err(fault),
        };
        if let Ok(set) = &set {
            // `Cage::new` orients the faces outward and closes seams.
            mesh = set.cage().to_polygon_mesh();
        }
        mesh.positions.extend(positions);
        Ok(Self { mesh, controls, set, notices: Vec::new() })
    }

    /// Returns `cage` with the subdivision and the inner controls of this cage. If they do not fit, keeps only the
    /// subdivision, or neither, and adds a notice.
    ///
    /// # Errors
    /// If a position is not finite.
    pub fn replaced(&self, cage: &PolygonMesh) -> Result<Self, EditError> {
        let with = |inner: &[Vec3], controls: CageControls| {
            let mut mesh = cage.clone();
            mesh.positions.extend(inner);
            Self::new(mesh, controls)
        };
        let smooth = CageControls { smooth: self.controls.smooth, ..CageControls::default() };
        // The rings are those of the replaced cage.
        let kept = CageControls { rings: Vec::new(), ..self.controls.clone() };
        let (made, fault) = match with(self.inner_positions(), kept) {
            Ok(made) => return Ok(made),
            Err(fault) if self.controls.inner > 0 => match with(&[], smooth) {
                Ok(made) => {
                    return Ok(Self { notices: vec![dropped("The controls inside are", &fault)], ..made });
                }
                Err(fault) => (with(&[], CageControls::default()), fault),
            },
            Err(fault) => (with(&[], CageControls::default()), fault),
        };
        let notices = vec![dropped("The smooth surface is", &fault)];
        Ok(Self { notices, ..made? })
    }

    /// Positions of inner controls, object units. `[n_inner]`
    pub fn inner_positions(&self) -> &[Vec3] {
        &self.mesh.positions[self.n_cage()..]
    }

    /// Number of vertices of the cage, without inner controls.
    pub fn n_cage(&self) -> usize {
        self.mesh.positions.len().saturating_sub(self.controls.inner)
    }

    /// Adds an element with corners at `places`. Corners of lines and faces within [`Self::radius`] of a control reuse
    /// that control, so that lines can meet in it.
    ///
    /// # Errors
    /// If the element does not fit into the cage.
    pub fn with(&self, kind: InnerKind, places: &[Vec3]) -> Result<Self, EditError> {
        let (mut mesh, mut controls) = (self.mesh.clone(), self.controls.clone());
        let (first, radius) = (self.n_cage(), self.radius());
        let mut corners: Vec<u32> = Vec::new();
        for place in places {
            let near = mesh.positions[first..].iter().position(|p| p.distance(*place) <= radius);
            let corner = near.filter(|_| kind != InnerKind::Point).unwrap_or_else(|| {
                mesh.positions.push(*place);
                controls.inner += 1;
                controls.inner - 1
            });
            if corners.last() != Some(&(corner as u32)) {
                corners.push(corner as u32);
            }
        }
        controls.elements.push(kind.element(corners));
        Self::new(mesh, controls)
    }

    /// Removes inner controls, and the points and sheets that use them. Polylines keep their other points if at
    /// least two are left.
    ///
    /// # Errors
    /// Those of [`Self::new`]. They do not occur in practice, because a subset of controls that fit also fits.
    pub fn without(&self, vertices: &[u32]) -> Result<Self, EditError> {
        let (mut mesh, mut controls) = (self.mesh.clone(), self.controls.clone());
        let first = self.n_cage();
        let is_gone = |i: u32| vertices.contains(&(first as u32 + i));
        let left: Vec<InnerElement> = controls
            .elements
            .into_iter()
            .filter_map(|element| {
                let mut corners: Vec<u32> =
                    element.corners().iter().copied().filter(|&i| !is_gone(i)).collect();
                // Without the points between them, two ends of a closed polyline become one.
                corners.dedup();
                match element {
                    InnerElement::Point(_) => corners.first().map(|&i| InnerElement::Point(i)),
                    InnerElement::Line(_) => (corners.len() >= 2).then_some(InnerElement::Line(corners)),
                    InnerElement::Face(all) => {
                        (corners.len() == all.len()).then_some(InnerElement::Face(corners))
                    }
                }
            })
            .collect();
        // Drop positions that no element uses.
        let mut numbers = vec![None; controls.inner];
        let mut kept = Vec::new();
        for (i, number) in numbers.iter_mut().enumerate() {
            if left.iter().any(|element| element.corners().contains(&(i as u32))) {
                *number = Some(kept.len() as u32);
                kept.push(mesh.positions[first + i]);
            }
        }
        let renumbered = |corners: &[u32]| corners.iter().filter_map(|&i| numbers[i as usize]).collect();
        controls.elements = left
            .iter()
            .filter_map(|element| match element {
                InnerElement::Point(i) => numbers[*i as usize].map(InnerElement::Point),
                InnerElement::Line(corners) => Some(InnerElement::Line(renumbered(corners))),
                InnerElement::Face(corners) => Some(InnerElement::Face(renumbered(corners))),
            })
            .collect();
        controls.inner = kept.len();
        mesh.positions.truncate(first);
        mesh.positions.extend(kept);
        Self::new(mesh, controls)
    }

    /// Radius of points and lines, object units.
    pub fn radius(&self) -> f32 {
        let inner = InnerControls { radius: self.controls.radius, ..InnerControls::default() };
        let longest = |set: &ControlSet| Controls::from(set).surface().bounds().extent().max_element();
        inner.radius_in(self.set.as_ref().map_or(0.0, longest))
    }

    /// Edges of lines and of interior faces, as pairs of position indices.
    pub fn inner_edges(&self) -> Vec<[u32; 2]> {
        let first = self.n_cage() as u32;
        let mut edges = Vec::new();
        for element in &self.controls.elements {
            let corners = element.corners();
            let around =
                matches!(element, InnerElement::Face(_)).then(|| [corners[corners.len() - 1], corners[0]]);
            let pairs = corners.windows(2).map(|pair| [pair[0], pair[1]]).chain(around);
            edges.extend(pairs.map(|[a, b]| [first + a.min(b), first + a.max(b)]));
        }
        edges
    }
}

/// Checks that faces and elements refer to positions that exist, and that sheets and lines have corners. Drafts need
/// this too, because the selection follows their edges.
fn check_indices(mesh: &PolygonMesh, controls: &CageControls) -> Result<(), EditError> {
    let n = mesh.positions.len().min(controls.inner);
    if n < controls.inner {
        return Err(ControlError::Index { what: "control", element: n as u32, vertex: n as u32, n }.into());
    }
    let n_cage = mesh.positions.len() - n;
    for (face, corners) in (0u32..).zip(&mesh.faces) {
        if let Some(&vertex) = corners.iter().find(|&&i| i as usize >= n_cage) {
            return Err(CageError::Index { face, vertex, n: n_cage }.into());
        }
    }
    for (number, element) in (0u32..).zip(&controls.elements) {
        let (what, corners) = (element.name(), element.corners());
        if let Some(&vertex) = corners.iter().find(|&&i| i as usize >= n) {
            return Err(ControlError::Index { what, element: number, vertex, n }.into());
        }
        if corners.is_empty() {
            return Err(ControlError::Degenerate { what, element: number, why: "no corners" }.into());
        }
    }
    Ok(())
}

fn dropped(what: &str, error: &EditError) -> String {
    format!("{what} gone: {error}. Undo brings it back")
}

#[cfg(test)]
mod tests {
    use cagework_core::{Bounds, subdivided_box};

    use super::*;

    fn made() -> RestCage {
        let bounds = Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE };
        RestCage::new(subdivided_box(bounds, 0.0, [1; 3]), CageControls::default()).unwrap()
    }

    fn at(x: f32) -> Vec3 {
        Vec3::new(x, 0.0, 0.0)
    }

    #[test]
    fn bones_that_meet_share_a_control_and_points_do_not() {
        // The default radius is 1/32 of the box's side, 0.0625, which exceeds the gap of 0.05 between the two lines.
        let made = made().with(InnerKind::Line, &[at(-0.5), at(0.0)]).unwrap();
        let made = made.with(InnerKind::Line, &[at(0.05), at(0.5)]).unwrap();
        assert_eq!(made.controls.elements, [InnerElement::Line(vec![0, 1]), InnerElement::Line(vec![1, 2])]);
        assert_eq!((made.mesh.positions.len(), made.n_cage(), made.inner_positions()[2]), (11, 8, at(0.5)));
        assert_eq!(made.inner_edges(), [[8, 9], [9, 10]]);
        let overlap = made.with(InnerKind::Point, &[at(0.05)]).err().unwrap();
        assert!(overlap.to_string().contains("overlap"), "{overlap:?}");
    }

    #[test]
    fn deleting_controls_drops_unused_positions() {
        let made = made().with(InnerKind::Line, &[at(-0.5), at(0.0), at(0.5)]).unwrap();
        let made = made.with(InnerKind::Point, &[Vec3::new(0.0, 0.5, 0.0)]).unwrap();
        // After the middle point of the line is removed, its ends stay connected.
        let shorter = made.without(&[9]).unwrap();
        assert_eq!(shorter.controls.elements, [InnerElement::Line(vec![0, 1]), InnerElement::Point(2)]);
        assert_eq!(shorter.inner_positions(), [at(-0.5), at(0.5), Vec3::new(0.0, 0.5, 0.0)]);
        // Without one of its two ends the line is removed, because a line needs two points. The separate point is left.
        let point = shorter.without(&[8]).unwrap();
        assert_eq!(
            (point.controls.elements.as_slice(), point.controls.inner),
            (&[InnerElement::Point(0)][..], 1)
        );
        assert_eq!(point.without(&[8]).unwrap().controls, CageControls::default());
    }

    /// A line from A over B and C back to A, without B and C, is one point twice.
    #[test]
    fn a_closed_line_without_its_other_corners_is_removed() {
        let corners = [at(-0.5), at(0.5), Vec3::new(0.0, 0.5, 0.0), at(-0.5)];
        let closed = made().with(InnerKind::Line, &corners).unwrap();
        assert_eq!(closed.controls.elements, [InnerElement::Line(vec![0, 1, 2, 0])]);
        assert_eq!(closed.without(&[9, 10]).unwrap().controls, CageControls::default());
    }

    #[test]
    fn drafts_with_indices_that_do_not_exist_are_refused() {
        let cube = made().mesh;
        let mut open = cube.clone();
        open.faces.pop();
        open.positions.push(Vec3::ZERO);
        let draft = |faces: &[Vec<u32>], inner: usize, elements: Vec<InnerElement>| {
            let mut mesh = open.clone();
            mesh.faces.extend_from_slice(faces);
            RestCage::new(mesh, CageControls { inner, elements, ..CageControls::default() })
        };
        assert!(draft(&[], 1, vec![InnerElement::Point(0)]).is_ok());
        assert!(draft(&[], 1, vec![InnerElement::Face(Vec::new())]).is_err());
        assert!(draft(&[], 1, vec![InnerElement::Line(vec![0, 1])]).is_err());
        assert!(draft(&[], 10, Vec::new()).is_err(), "more controls than positions");
        assert!(draft(&[vec![0, 1, 8]], 1, Vec::new()).is_err(), "a face at a control");
    }

    #[test]
    fn another_cage_keeps_controls_that_fit_into_it() {
        let made = made().with(InnerKind::Point, &[at(0.5)]).unwrap();
        let of = |min: f32, max: f32| {
            subdivided_box(Bounds { min: Vec3::splat(min), max: Vec3::splat(max) }, 0.0, [2; 3])
        };
        let larger = made.replaced(&of(-2.0, 2.0)).unwrap();
        assert_eq!((larger.controls.inner, larger.mesh.positions.len(), larger.notices.len()), (1, 27, 0));
        let beside = made.replaced(&of(1.0, 2.0)).unwrap();
        assert_eq!((beside.controls.inner, beside.mesh.positions.len()), (0, 26));
        assert!(beside.notices[0].contains("outside"));
    }

    #[test]
    fn a_draft_keeps_its_controls() {
        let made = made().with(InnerKind::Point, &[at(0.5)]).unwrap();
        let mut open = made.set.as_ref().unwrap().cage().to_polygon_mesh();
        open.faces.pop();
        let draft = made.replaced(&open).unwrap();
        assert!(draft.set.is_err());
        assert_eq!((draft.inner_positions(), draft.controls.inner), (&[at(0.5)][..], 1));
    }
}
