//! The same model, cage and poses give the same bytes through the command and through the page's document. The tests
//! of the Python and npm packages compare their bytes with those of the command.

use std::sync::Arc;

use cagework_core::field::{CELLS, CLIP_CELLS, FieldWeights};
use cagework_core::progress::NoProgress;
use cagework_core::{BindOptions, Controls};
use cagework_editor::{BoundDocument, BoundModels, Command, Contents, Editor, KnownGround, RigOptions};
use cagework_io::{Model, ModelFormat, read_weights_npz};

use crate::rigs::{self, DEFORM};
use crate::splats;
use crate::support::Sandbox;

/// The page's document with a model and its cage, and what is bound.
struct Page {
    editor: Editor,
    bound: Option<Arc<BoundModels>>,
    lattice: Option<FieldWeights>,
}

impl Page {
    /// Opens a model and its cage. `weights`: file of weights; without one, nothing is bound.
    fn open(sandbox: &Sandbox, model: &str, cage: &str, weights: Option<&str>) -> Self {
        let read = |name: &str| Model::read(name, &sandbox.read(name), &mut |_| None).unwrap();
        let mut editor = Editor::default();
        editor.open([(read(model), None)], Contents::default());
        let mesh = read(cage).cage_mesh();
        let cage = Command::ReplaceCage { mesh, controls: None, notices: Vec::new(), rings: Vec::new() };
        editor.apply(cage).unwrap();
        let bound = weights.map(|name| {
            let saved = read_weights_npz(&sandbox.read(name), u64::MAX).unwrap();
            let bound = BoundModels::new(editor.document(), saved.weights, saved.frames, saved.outside);
            Arc::new(bound)
        });
        Self { editor, bound, lattice: None }
    }

    /// Binds the space around the cage.
    fn bind_lattice(&mut self, cells: u32) {
        let set = self.editor.document().cage.set.as_ref().unwrap();
        let options = BindOptions::default();
        self.lattice = Some(FieldWeights::bind(Controls::from(set), cells, &options, &NoProgress).unwrap());
    }

    fn pose(&mut self, sandbox: &Sandbox, name: &str) {
        let posed = Model::read(name, &sandbox.read(name), &mut |_| None).unwrap();
        self.editor.set_pose(posed.positions).unwrap();
    }

    /// Calls a function with the document and what is bound.
    fn with<T>(&self, call: impl FnOnce(BoundDocument<'_>) -> T) -> T {
        let ground = KnownGround::default();
        let (bound, lattice) = (self.bound.as_ref(), self.lattice.as_ref());
        call(BoundDocument { editor: &self.editor, bound, parts: None, lattice, ground: &ground })
    }
}

#[test]
fn a_rigged_model_is_the_same_file_through_command_and_page() {
    let sandbox = rigs::bound();
    let mut page = Page::open(&sandbox, "humanoid.glb", "cage.obj", Some("w.npz"));
    page.pose(&sandbox, "wide.obj");
    let glb = |options: &RigOptions| page.with(|all| all.glb(0, options, None)).unwrap().bytes;
    let (mut turned, plain) = (RigOptions::default(), RigOptions { plain: true, ..RigOptions::default() });
    turned.reshape.joints = cagework_io::Joints::Turn;
    turned.reshape.ground = true;
    for (name, options, bytes) in [
        ("rig.glb", "", glb(&RigOptions::default())),
        ("turned.glb", "--joints turn --ground", glb(&turned)),
        ("static.glb", "--static", glb(&plain)),
        ("shape.obj", "", page.with(|all| all.shape(0, ModelFormat::Obj, None)).unwrap().bytes),
        ("shape.ply", "", page.with(|all| all.shape(0, ModelFormat::Ply, None)).unwrap().bytes),
    ] {
        sandbox.run(&format!("{DEFORM} --pose wide.obj {options} -o {name}")).success();
        assert!(sandbox.read(name) == bytes, "{name}");
    }
    sandbox.run("refit humanoid.glb --cage cage.obj --pose wide.obj -g 24 -o out").success();
    assert!(sandbox.read("out/humanoid.glb") == sandbox.read("rig.glb"));
}

#[test]
fn saved_poses_are_the_same_morph_targets_through_command_and_page() {
    let sandbox = rigs::bound();
    let mut page = Page::open(&sandbox, "humanoid.glb", "cage.obj", Some("w.npz"));
    page.pose(&sandbox, "wide.obj");
    page.editor.apply(Command::SavePose { name: "wide".into() }).unwrap();
    page.pose(&sandbox, "cage.obj");
    page.editor.apply(Command::SavePose { name: "rest".into() }).unwrap();
    for (name, options, plain) in [("poses.glb", "", false), ("static.glb", "--static", true)] {
        let request = RigOptions { plain, ..RigOptions::default() };
        let bytes = page.with(|all| all.poses(0, &request, false, "poses")).unwrap().bytes;
        let poses = "--pose wide.obj --name wide --pose cage.obj --name rest";
        sandbox.run(&format!("{DEFORM} {poses} {options} -o {name}")).success();
        assert!(sandbox.read(name) == bytes, "{name}");
    }
}

#[test]
fn a_bent_clip_is_the_same_file_through_command_and_page() {
    let sandbox = rigs::bound();
    let mut page = Page::open(&sandbox, "humanoid.glb", "cage.obj", Some("w.npz"));
    page.pose(&sandbox, "wide.obj");
    page.bind_lattice(CLIP_CELLS);
    let options = RigOptions { dynamic: true, ..RigOptions::default() };
    let bytes = page.with(|all| all.glb(0, &options, Some(0))).unwrap().bytes;
    sandbox.run("deform humanoid.glb --cage cage.obj --dynamic Walk --pose wide.obj -o bent.glb").success();
    assert!(sandbox.read("bent.glb") == bytes);
}

#[test]
fn a_capture_is_the_same_file_through_command_and_page() {
    let sandbox = splats::sandbox();
    let mut page = Page::open(&sandbox, "a.splat", "box.obj", None);
    page.pose(&sandbox, "pose.obj");
    page.bind_lattice(CELLS);
    for (name, format) in [("b.splat", ModelFormat::Splat), ("b.spz", ModelFormat::Spz)] {
        let bytes = page.with(|all| all.shape(0, format, None)).unwrap().bytes;
        sandbox.run(&format!("deform a.splat --cage box.obj --pose pose.obj -o {name}")).success();
        assert!(sandbox.read(name) == bytes, "{name}");
    }
}
