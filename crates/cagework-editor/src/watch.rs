//! Vertices of the models outside a cage while the user reshapes it.

use cagework_core::enclosure::Enclosure;
use cagework_core::{ControlSet, Controls, InnerControls};

use crate::document::Document;

/// Maximum number of vertex–triangle pairs that are tested at each pointer event.
const WATCHED_PAIRS: usize = 250_000;

/// A cage without its inner controls, and a sample of the models' vertices that is small enough to be tested at every
/// pointer event.
pub struct CageWatch {
    cage: ControlSet,
    sample: Enclosure,
}

impl CageWatch {
    /// Samples the models' vertices; `None` if the cage is a draft.
    #[must_use]
    pub fn new(document: &Document) -> Option<Self> {
        let set = document.cage.set.as_ref().ok()?;
        // Test against the cage alone: inner controls cut balls and tubes out of the enclosed volume.
        let cage = ControlSet::new(set.cage(), set.smooth(), InnerControls::default())
            .unwrap_or_else(|_| ControlSet::plain(set.cage()));
        let surface = Controls::from(&cage).surface();
        let vertices = document.models.positions();
        let step = (vertices.len() * surface.triangles().len()).div_ceil(WATCHED_PAIRS).max(1);
        let some: Vec<_> = vertices.iter().copied().step_by(step).collect();
        Some(Self { sample: Enclosure::new(surface, &some), cage })
    }

    /// Number of sampled vertices outside the cage in the pose of `document`, which has the cage of [`Self::new`].
    #[must_use]
    pub fn n_outside(&self, document: &Document) -> usize {
        let n_cage = self.cage.cage().n_vertices();
        self.sample.outside_of(&self.cage.surface_at(&document.pose[..n_cage])).len()
    }
}

#[cfg(test)]
mod tests {
    use cagework_io::Model;
    use glam::Vec3;

    use super::*;
    use crate::edit::tests::cube;
    use crate::{Command, Contents, Editor};

    #[test]
    fn vertices_that_a_dragged_cage_leaves_outside_are_counted() {
        let text = b"v 0.2 0.2 0.2\nv 0.8 0.2 0.2\nv 0.2 0.8 0.2\nf 1 2 3\n";
        let mut editor = Editor::default();
        editor.open([(Model::read("a.obj", text, &mut |_| None).unwrap(), None)], Contents::default());
        assert!(CageWatch::new(editor.document()).is_none(), "without a cage");
        editor
            .apply(Command::ReplaceCage {
                mesh: cube(),
                controls: None,
                notices: Vec::new(),
                rings: Vec::new(),
            })
            .unwrap();
        let watch = CageWatch::new(editor.document()).unwrap();
        assert_eq!(watch.n_outside(editor.document()), 0);
        let half = Vec3::new(0.5, 1.0, 1.0);
        editor.set_pose(editor.document().pose.iter().map(|p| *p * half).collect()).unwrap();
        assert_eq!(watch.n_outside(editor.document()), 1, "the vertex at x = 0.8");
    }
}
