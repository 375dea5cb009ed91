//! Smooth cages and controls inside, as the page says them beside a cage's positions and faces.
//!
//! Controls inside are vertices of no face at the end of the positions: what is selected, dragged, posed, undone and saved does
//! not tell them from the cage's.

use cagework_core::cage::CageError;
use cagework_core::{Cage, ControlSet, Controls, InnerControls, InnerElement, PolygonMesh};
use glam::Vec3;
use serde::{Deserialize, Serialize};
use wasm_bindgen::JsValue;

use crate::arrays::polygon_mesh;
use crate::error::{Answer, Fault};
use crate::options::taken;

/// What is said of a cage besides its positions and faces.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct CageControls {
    /// Steps of subdivision.
    pub(crate) smooth: u32,
    /// So many of the positions, the last ones, are controls inside.
    pub(crate) inner: usize,
    /// What they are corners of; counted from the first of them.
    pub(crate) elements: Vec<InnerElement>,
    /// Radius of points and lines, object units; null for a share of the cage.
    pub(crate) radius: Option<f32>,
}

/// A kind of control inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) enum InnerKind {
    Point,
    Line,
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

/// A cage, or a draft of one, with its controls.
#[derive(Clone)]
pub(crate) struct MadeCage {
    /// Positions of cage and controls inside; faces of the cage.
    pub(crate) mesh: PolygonMesh,
    pub(crate) controls: CageControls,
    /// Why it is no cage yet, if it is none.
    pub(crate) set: Result<ControlSet, CageError>,
    /// What became of controls that did not fit.
    pub(crate) notice: Option<String>,
}

impl Default for MadeCage {
    fn default() -> Self {
        let set = Err(CageError::Empty);
        Self { mesh: PolygonMesh::default(), controls: CageControls::default(), set, notice: None }
    }
}

impl MadeCage {
    /// A cage whose last positions are those of controls inside.
    ///
    /// # Errors
    /// When the controls do not fit into it.
    pub(crate) fn new(mut mesh: PolygonMesh, controls: CageControls) -> Answer<Self> {
        let n_cage = mesh.positions.len().saturating_sub(controls.inner);
        let positions = mesh.positions.split_off(n_cage);
        let inner = if positions.is_empty() && controls.elements.is_empty() {
            // Only a radius, for controls to come.
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
            // Turned outward, seams closed.
            mesh = set.cage().to_polygon_mesh();
        }
        mesh.positions.extend(positions);
        Ok(Self { mesh, controls, set, notice: None })
    }

    /// Another cage in its place: controls stay as far as they fit into it.
    pub(crate) fn replaced(&self, cage: &PolygonMesh) -> Self {
        let with = |inner: &[Vec3], controls: CageControls| {
            let mut mesh = cage.clone();
            mesh.positions.extend(inner);
            Self::new(mesh, controls)
        };
        let smooth = CageControls { smooth: self.controls.smooth, ..CageControls::default() };
        let (made, fault) = match with(self.inner_positions(), self.controls.clone()) {
            Ok(made) => return made,
            Err(fault) if self.controls.inner > 0 => match with(&[], smooth) {
                Ok(made) => return Self { notice: Some(dropped("The controls inside are", &fault)), ..made },
                Err(fault) => (with(&[], CageControls::default()), fault),
            },
            Err(fault) => (with(&[], CageControls::default()), fault),
        };
        let notice = Some(dropped("The smooth surface is", &fault));
        made.map_or_else(|_| Self::default(), |made| Self { notice, ..made })
    }

    /// Positions of controls inside.
    pub(crate) fn inner_positions(&self) -> &[Vec3] {
        &self.mesh.positions[self.n_cage()..]
    }

    /// Vertices of the cage alone.
    pub(crate) fn n_cage(&self) -> usize {
        self.mesh.positions.len().saturating_sub(self.controls.inner)
    }

    /// The same with another element between these places. Corners of lines and faces that are within the radius of a control
    /// are that control: so bones hang together.
    ///
    /// # Errors
    /// When it does not fit.
    pub(crate) fn with(&self, kind: InnerKind, places: &[Vec3]) -> Answer<Self> {
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

    /// The same without some controls inside, and without elements that need them: polylines keep what is left of them.
    ///
    /// # Errors
    /// Never; what fits with more fits with less.
    pub(crate) fn without(&self, vertices: &[u32]) -> Answer<Self> {
        let (mut mesh, mut controls) = (self.mesh.clone(), self.controls.clone());
        let first = self.n_cage();
        let is_gone = |i: u32| vertices.contains(&(first as u32 + i));
        let left: Vec<InnerElement> = controls
            .elements
            .into_iter()
            .filter_map(|element| {
                let corners: Vec<u32> = element.corners().iter().copied().filter(|&i| !is_gone(i)).collect();
                match element {
                    InnerElement::Point(_) => corners.first().map(|&i| InnerElement::Point(i)),
                    InnerElement::Line(_) => (corners.len() >= 2).then_some(InnerElement::Line(corners)),
                    InnerElement::Face(all) => {
                        (corners.len() == all.len()).then_some(InnerElement::Face(corners))
                    }
                }
            })
            .collect();
        // What belongs to nothing any more goes as well.
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
    pub(crate) fn radius(&self) -> f32 {
        let inner = InnerControls { radius: self.controls.radius, ..InnerControls::default() };
        let longest = |set: &ControlSet| Controls::from(set).surface().bounds().extent().max_element();
        inner.radius_in(self.set.as_ref().map_or(0.0, longest))
    }

    /// Lines between controls, and around faces inside, as pairs of positions.
    pub(crate) fn inner_edges(&self) -> Vec<[u32; 2]> {
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

fn dropped(what: &str, fault: &Fault) -> String {
    format!("{what} gone: {}. Undo brings it back", fault.message())
}

/// A cage with its controls from arrays: see [`CageControls`]. Undefined controls are none.
///
/// # Errors
/// When the arrays are no cage, or the controls do not fit into it.
pub(crate) fn control_set(positions: &[f32], corners: &[u32], controls: JsValue) -> Answer<ControlSet> {
    let mesh = polygon_mesh(positions, corners)?;
    Ok(MadeCage::new(mesh, said(controls)?.unwrap_or_default())?.set?)
}

/// Controls that JavaScript says; none for undefined.
pub(crate) fn said(controls: JsValue) -> Answer<Option<CageControls>> {
    if controls.is_undefined() { Ok(None) } else { taken(controls).map(Some) }
}

#[cfg(test)]
mod tests {
    use cagework_core::{Bounds, subdivided_box};

    use super::*;

    fn made() -> MadeCage {
        let bounds = Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE };
        MadeCage::new(subdivided_box(bounds, 0.0, [1; 3]), CageControls::default()).unwrap()
    }

    fn at(x: f32) -> Vec3 {
        Vec3::new(x, 0.0, 0.0)
    }

    #[test]
    fn bones_that_meet_share_a_control_and_points_do_not() {
        // A radius of 2 / 32 of the box's side.
        let made = made().with(InnerKind::Line, &[at(-0.5), at(0.0)]).unwrap();
        let made = made.with(InnerKind::Line, &[at(0.05), at(0.5)]).unwrap();
        assert_eq!(made.controls.elements, [InnerElement::Line(vec![0, 1]), InnerElement::Line(vec![1, 2])]);
        assert_eq!((made.mesh.positions.len(), made.n_cage(), made.inner_positions()[2]), (11, 8, at(0.5)));
        assert_eq!(made.inner_edges(), [[8, 9], [9, 10]]);
        let overlap = made.with(InnerKind::Point, &[at(0.05)]).err().unwrap();
        assert!(overlap.message().contains("overlap"), "{overlap:?}");
    }

    #[test]
    fn what_belongs_to_nothing_any_more_goes_with_what_is_deleted() {
        let made = made().with(InnerKind::Line, &[at(-0.5), at(0.0), at(0.5)]).unwrap();
        let made = made.with(InnerKind::Point, &[Vec3::new(0.0, 0.5, 0.0)]).unwrap();
        // The middle of the line: it goes on without it.
        let shorter = made.without(&[9]).unwrap();
        assert_eq!(shorter.controls.elements, [InnerElement::Line(vec![0, 1]), InnerElement::Point(2)]);
        assert_eq!(shorter.inner_positions(), [at(-0.5), at(0.5), Vec3::new(0.0, 0.5, 0.0)]);
        // One of two ends: the other is no line.
        let point = shorter.without(&[8]).unwrap();
        assert_eq!(
            (point.controls.elements.as_slice(), point.controls.inner),
            (&[InnerElement::Point(0)][..], 1)
        );
        assert_eq!(point.without(&[8]).unwrap().controls, CageControls::default());
    }

    #[test]
    fn another_cage_keeps_controls_that_fit_into_it() {
        let made = made().with(InnerKind::Point, &[at(0.5)]).unwrap();
        let of = |min: f32, max: f32| {
            subdivided_box(Bounds { min: Vec3::splat(min), max: Vec3::splat(max) }, 0.0, [2; 3])
        };
        let larger = made.replaced(&of(-2.0, 2.0));
        assert_eq!((larger.controls.inner, larger.mesh.positions.len(), larger.notice), (1, 27, None));
        let beside = made.replaced(&of(1.0, 2.0));
        assert_eq!((beside.controls.inner, beside.mesh.positions.len()), (0, 26));
        assert!(beside.notice.unwrap().contains("outside"));
    }

    #[test]
    fn a_draft_keeps_controls_for_the_cage_to_come() {
        let made = made().with(InnerKind::Point, &[at(0.5)]).unwrap();
        let mut open = made.set.as_ref().unwrap().cage().to_polygon_mesh();
        open.faces.pop();
        let draft = made.replaced(&open);
        assert!(draft.set.is_err());
        assert_eq!((draft.inner_positions(), draft.controls.inner), (&[at(0.5)][..], 1));
    }
}
