//! Editing tools and the ranges of their radii; options of exports.

use cagework_core::options::{Number, Slider};
use cagework_io::ReshapeOptions;
use serde::{Deserialize, Serialize};

use crate::edit::{Element, Pivot};

/// How clicks and gestures act on the cage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct Tools {
    /// Element type that a click selects.
    pub element: Element,
    /// Whether gestures also move the mirror images of the selected vertices.
    pub symmetry: bool,
    /// Centre of rotation and scaling.
    pub pivot: Pivot,
    /// Radius of proportional editing, as a fraction of the cage's diagonal. Kept while `proportional_on` is false.
    pub proportional: f64,
    /// Whether vertices near the selection follow it.
    pub proportional_on: bool,
}

impl Default for Tools {
    fn default() -> Self {
        let (element, pivot) = (Element::default(), Pivot::default());
        Self { element, symmetry: false, pivot, proportional: 0.2, proportional_on: false }
    }
}

/// How an export treats the rig of a model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct RigOptions {
    /// Options of joints, clips and the ground.
    #[serde(flatten)]
    pub reshape: ReshapeOptions,
    /// Whether to export only the shape, without the rig.
    pub plain: bool,
    /// Whether the cage deforms the model after a clip has moved it.
    pub dynamic: bool,
    /// Whether the user has switched `ground` off, so that changed proportions do not switch it on.
    pub ground_off: bool,
}

/// Radius of proportional editing.
pub const PROPORTIONAL_RADIUS: Number = Number {
    name: "proportional",
    help: "Distance within which vertices follow the selection",
    unit: "fraction of the cage's diagonal",
    allowed: "a number from 0.02 to 1",
    is_allowed: |radius| (0.02..=1.0).contains(&radius),
    slider: Some(Slider { min: 0.02, max: 1.0, step: 0.01 }),
};
/// Radius of the brush that paints fixed areas.
pub const BRUSH: Number = Number {
    name: "brush",
    help: "Radius of the brush that paints fixed areas",
    unit: "fraction of the models' diagonal",
    allowed: "a number above 0",
    is_allowed: |radius| radius.is_finite() && radius > 0.0,
    slider: Some(Slider { min: 0.01, max: 0.3, step: 0.01 }),
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::SelectMode;
    use crate::edit::tests::{FrontView, cube};
    use crate::{Command, Contents, Editor, RestEdit};
    use cagework_core::Bounds;

    #[test]
    fn tools_of_the_person_stay_when_a_model_opens_and_those_of_the_model_are_reset() {
        let mut editor = Editor::default();
        let (element, pivot) = (Element::Face, Pivot::Last);
        let tools = Tools { element, symmetry: true, pivot, proportional: 7.0, proportional_on: true };
        editor.set_tools(tools, &FrontView);
        let view = editor.view();
        assert_eq!(
            (view.tools.proportional, view.unmatched),
            (1.0, 0),
            "the largest radius of PROPORTIONAL_RADIUS"
        );
        editor.open([], Contents::default());
        let kept = Tools { element: Element::Vertex, symmetry: false, proportional: 1.0, ..tools };
        assert_eq!(editor.tools(), kept);
    }

    #[test]
    fn vertices_without_a_mirror_image_are_counted_while_editing_is_symmetric() {
        let mut mesh = cube();
        mesh.positions[1].y = 0.25;
        let mut editor = Editor::default();
        editor
            .apply(Command::ReplaceCage { mesh, controls: None, notices: Vec::new(), rings: Vec::new() })
            .unwrap();
        assert_eq!(editor.view().unmatched, 0);
        editor.set_tools(Tools { symmetry: true, ..Tools::default() }, &FrontView);
        assert_eq!(editor.view().unmatched, 2, "vertices 0 and 1 were images of each other");
    }

    #[test]
    fn an_extrusion_with_symmetry_also_extrudes_the_mirror_image() {
        let mut editor = Editor::default();
        let mesh = cube();
        let side: Vec<u32> = (0..8).filter(|&v| mesh.positions[v as usize].x == 0.0).collect();
        editor
            .apply(Command::ReplaceCage { mesh, controls: None, notices: Vec::new(), rings: Vec::new() })
            .unwrap();
        editor.set_editing_rest(true, "reset");
        editor.set_tools(Tools { symmetry: true, element: Element::Face, ..Tools::default() }, &FrontView);
        editor.selection.change(&side, SelectMode::Replace);
        editor.apply(Command::EditRest { edit: RestEdit::ExtrudeFace }).unwrap();
        // The cube's faces at x = 0 and x = 1 are mirror images.
        let bounds = Bounds::around(&editor.document().cage.mesh.positions).unwrap();
        assert!(bounds.min.x < 0.0 && (bounds.min.x + bounds.max.x - 1.0).abs() < 1e-6, "{bounds:?}");
    }

    #[test]
    fn faces_are_selected_only_while_the_cage_is_reshaped() {
        let mut editor = Editor::default();
        editor.set_editing_rest(true, "reset");
        editor.set_tools(Tools { element: Element::Face, ..Tools::default() }, &FrontView);
        editor.set_editing_rest(false, "reset");
        assert_eq!(editor.tools().element, Element::Vertex);
    }
}
