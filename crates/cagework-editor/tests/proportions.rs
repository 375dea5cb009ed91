//! Proportions of a humanoid: factors displace the pose, and are undone, saved and restored with it.

use std::sync::{Arc, LazyLock};

use cagework_cage::samples;
use cagework_core::bind::fineness::ROUGH_GRID;
use cagework_core::deform::deform_bound;
use cagework_core::progress::NoProgress;
use cagework_core::skin::skin_vertices;
use cagework_core::{BindOptions, Binding, bind, subdivided_box};
use cagework_editor::{
    BoundDocument, BoundModels, Command, Contents, DocumentSettings, Editor, FoldSample, KnownGround,
    Playback, PoseSettings, RigOptions,
};
use cagework_io::{Joints, Model, RigPose, read_project, write_mesh_glb};
use cagework_pose::proportions::Proportion;
use glam::Vec3;

/// Rounding of 32-bit coordinates of about 2 units.
const ROUNDING: f32 = 1e-6;

/// The humanoid sample as a GLB file.
static GLB: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let sample = samples::build("humanoid").expect("a sample");
    write_mesh_glb("humanoid", &sample.mesh, &sample.colours, sample.rig.as_ref()).expect("valid input")
});

fn opened(glb: &[u8]) -> Editor {
    let mut editor = Editor::default();
    editor
        .open([(Model::read("a.glb", glb, &mut |_| None).expect("valid input"), None)], Contents::default());
    let mesh = subdivided_box(editor.bounds().expect("valid input"), 0.1, [4, 8, 2]);
    let rings = vec![vec![0, 1, 2]];
    editor
        .apply(Command::ReplaceCage { mesh, controls: None, notices: Vec::new(), rings })
        .expect("valid input");
    editor.amend();
    editor
}

fn set(editor: &mut Editor, name: &str, factor: f64) {
    editor.apply(Command::SetProportion { name: name.to_owned(), factor }).expect("valid input");
}

fn pull(editor: &mut Editor) {
    let mut pose = editor.document().pose.to_vec();
    pose[3] += Vec3::new(0.1, 0.2, -0.3);
    editor.set_pose(pose).expect("valid input");
}

fn factors(editor: &Editor) -> [f64; 2] {
    [0, 1].map(|side| editor.document().proportions.factor(Proportion::Leg, side))
}

/// Height of the posed cage.
fn height(editor: &Editor) -> f32 {
    let ys = || editor.document().pose.iter().map(|p| p.y);
    ys().fold(f32::MIN, f32::max) - ys().fold(f32::MAX, f32::min)
}

fn farthest(a: &[Vec3], b: &[Vec3]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}

#[test]
fn a_pull_is_kept_while_factors_change_and_after_they_are_reset() {
    let mut editor = opened(&GLB);
    let at_rest = height(&editor);
    set(&mut editor, "leg", 1.3);
    assert!(height(&editor) > at_rest + 0.15, "a leg of 0.8 units becomes 0.24 units longer");
    pull(&mut editor);
    let pulled_by = |editor: &Editor, rest: Vec3| editor.document().pose[3] - rest;
    set(&mut editor, "leg", 1.0);
    let rest = editor.document().cage.mesh.positions.clone();
    assert!(pulled_by(&editor, rest[3]).distance(Vec3::new(0.1, 0.2, -0.3)) < ROUNDING);
    assert_eq!(editor.document().pose[4..], rest[4..], "all other vertices are exactly at rest");

    let pulled = editor.document().pose.clone();
    for factor in [1.1, 1.25, 0.7] {
        set(&mut editor, "leg", factor);
        set(&mut editor, "head", factor);
    }
    assert_ne!(editor.document().pose, pulled);
    editor.apply(Command::SetPreset { name: None }).unwrap();
    assert_eq!(editor.document().pose, pulled, "exactly");
}

#[test]
fn a_drag_of_a_slider_is_one_step_that_undoes_factors_and_pose() {
    let mut editor = opened(&GLB);
    pull(&mut editor);
    editor.commit("Pull");
    let pulled = editor.document().pose.clone();
    for k in 0..10 {
        set(&mut editor, "left_leg", 1.0 + 0.03 * f64::from(k));
    }
    assert!(editor.commit("Legs"));
    let scaled = editor.document().pose.clone();
    assert_eq!(factors(&editor), [1.27, 1.0]);
    assert!(editor.undo());
    assert_eq!((factors(&editor), &editor.document().pose), ([1.0, 1.0], &pulled));
    assert!(editor.redo());
    assert_eq!((factors(&editor), &editor.document().pose), ([1.27, 1.0], &scaled));
    editor.apply(Command::MirrorProportions).unwrap();
    assert_eq!(factors(&editor), [1.27, 1.27]);
    editor.apply(Command::ResetPose).unwrap();
    assert_eq!(factors(&editor), [1.0, 1.0]);
    assert!(!editor.document().is_posed());
}

/// The factors of a saved pose are removed from it, not those of the pose before.
#[test]
fn a_pose_that_is_applied_on_other_factors_loses_its_own_at_a_reset() {
    let mut editor = opened(&GLB);
    set(&mut editor, "leg", 1.2);
    editor.apply(Command::SavePose { name: "long".to_owned() }).unwrap();
    set(&mut editor, "leg", 1.5);
    editor.apply(Command::ApplyPose { index: 0 }).unwrap();
    set(&mut editor, "leg", 1.0);
    assert_eq!(editor.document().pose[..], editor.document().cage.mesh.positions[..]);
}

#[test]
fn presets_of_one_part_add_up_and_whole_figures_replace_all() {
    let mut editor = opened(&GLB);
    let mut preset = |name: &str| {
        editor.apply(Command::SetPreset { name: Some(name.to_owned()) }).unwrap();
        let proportions = editor.document().proportions;
        [Proportion::Leg, Proportion::Head].map(|proportion| proportions.factor(proportion, 0))
    };
    assert_eq!(preset("longer legs"), [1.2, 1.0]);
    assert_eq!(preset("big head"), [1.2, 1.35]);
    assert_eq!(preset("chibi"), [0.65, 1.7]);
    assert_eq!(preset("longer legs"), [1.2, 1.7]);
}

#[test]
fn saved_poses_restore_their_factors_and_a_blend_shows_factors_of_1() {
    let mut editor = opened(&GLB);
    editor.apply(Command::SavePose { name: "rest".to_owned() }).unwrap();
    editor.apply(Command::SetPreset { name: Some("longer legs".to_owned()) }).unwrap();
    assert_eq!(editor.view().preset.as_deref(), Some("longer legs"));
    pull(&mut editor);
    editor.apply(Command::SavePose { name: "long".to_owned() }).unwrap();
    let long = editor.document().pose.clone();
    editor.apply(Command::ApplyPose { index: 0 }).unwrap();
    assert_eq!((factors(&editor), editor.view().scaled), ([1.0, 1.0], false));
    editor.apply(Command::ApplyPose { index: 1 }).unwrap();
    assert_eq!((factors(&editor), editor.view().scaled), ([1.2, 1.2], true));
    set(&mut editor, "leg", 1.0);
    assert_eq!(editor.document().pose[4..], editor.document().cage.mesh.positions[4..]);
    set(&mut editor, "leg", 1.2);
    assert!(farthest(&editor.document().pose, &long) < ROUNDING);
    editor.commit("Pose");
    editor.apply(Command::Blend { index: 0, share: 0.5 }).unwrap();
    assert_eq!(factors(&editor), [1.0, 1.0]);
}

#[test]
fn a_project_keeps_factors_rings_and_given_bones() {
    let mut editor = opened(&GLB);
    let toes = Command::SetBone { bone: "leftToes".to_owned(), joint: Some("foot.L".to_owned()) };
    assert!(editor.apply(toes).is_err(), "the joint is the left foot");
    let chest = Command::SetBone { bone: "chest".to_owned(), joint: Some("spine".to_owned()) };
    editor.apply(chest).unwrap();
    set(&mut editor, "leg", 1.2);
    set(&mut editor, "left_arm", 0.9);
    editor.apply(Command::SavePose { name: "a".to_owned() }).unwrap();
    set(&mut editor, "head", 1.5);
    pull(&mut editor);
    let project = editor.write_project("{}").unwrap();
    let project = read_project("a.glb", &project, 1 << 28).unwrap().unwrap();
    let settings = DocumentSettings::read(&project.settings);
    let (cage, _) = settings.cage(&project.cage);
    let contents = Contents {
        poses: settings.poses(project.poses, cage.as_ref()),
        cage,
        bones: settings.given_bones(),
        ..Contents::default()
    };
    let mut again = Editor::default();
    again.open(project.models.into_iter().map(|model| (model, None)), contents);
    again.take_pose(&settings).unwrap();
    let (a, b) = (editor.document(), again.document());
    assert_eq!((a.proportions, &a.poses, &a.pose), (b.proportions, &b.poses, &b.pose));
    assert_eq!(b.cage.controls.rings, [[0, 1, 2]]);
    assert!(again.humanoid_info().unwrap().bones.iter().any(|bone| bone.given && bone.bone == "chest"));
    again.apply(Command::SetPreset { name: None }).unwrap();
    assert_eq!(again.document().pose[4..], again.document().cage.mesh.positions[4..]);

    let old = DocumentSettings::read(
        r#"{"proportions": {"leg": 7}, "saved_poses": [{"proportions": {"tail": 1}}]}"#,
    );
    assert_eq!(old.proportions, DocumentSettings::default().proportions);
    assert_eq!(old.saved_poses, [PoseSettings::default()]);
}

#[test]
fn models_that_are_no_humanoid_get_a_reason() {
    let mut editor = opened(&GLB);
    let info = editor.humanoid_info().unwrap();
    assert_eq!((info.fault, info.bones.len()), (None, 22));
    let mut pillar = Editor::default();
    let obj = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    pillar.open([(Model::read("a.obj", obj, &mut |_| None).unwrap(), None)], Contents::default());
    assert_eq!(pillar.humanoid_info(), None);
    let wrong = pillar.apply(Command::SetProportion { name: "leg".to_owned(), factor: 1.2 }).unwrap_err();
    assert!(wrong.to_string().contains("no skeleton"), "{wrong}");

    let mut sample = samples::build("humanoid").unwrap();
    let names = ["link 0", "link 1", "link 2", "link 3"];
    for (k, joint) in sample.rig.iter_mut().flat_map(|rig| &mut rig.joints).enumerate() {
        joint.name = names[k.min(3)];
        (joint.at, joint.parent) = (Vec3::new(0.0, 0.1 * k as f32, 0.0), k.checked_sub(1));
    }
    let glb = write_mesh_glb("snake", &sample.mesh, &sample.colours, sample.rig.as_ref()).unwrap();
    let mut snake = opened(&glb);
    let info = snake.humanoid_info().unwrap();
    assert!(info.fault.is_some_and(|fault| fault.contains("no joint was found for hips")));
    assert_eq!((info.source, info.bones.len(), info.joints), (None, 14, names.map(str::to_owned).to_vec()));
    let head = |joint: &str| Command::SetBone { bone: "head".to_owned(), joint: Some(joint.to_owned()) };
    snake.apply(head("link 2")).unwrap();
    let given = snake.humanoid_info().unwrap().bones.into_iter().find(|bone| bone.given).unwrap();
    assert_eq!((given.bone.as_str(), given.joint.as_deref()), ("head", Some("link 2")));
    assert!(snake.apply(head("link 9")).unwrap_err().to_string().contains("there is no joint"));

    let wrong = editor.apply(Command::SetProportion { name: "leg".to_owned(), factor: 3.0 }).unwrap_err();
    assert!(wrong.to_string().contains("0.5 to 2"), "{wrong}");
    let wrong = editor.apply(Command::SetPreset { name: Some("giant".to_owned()) }).unwrap_err();
    assert!(wrong.to_string().contains("chibi"), "{wrong}");
}

#[test]
fn a_pose_that_is_carried_to_another_cage_keeps_its_factors() {
    let mut editor = opened(&GLB);
    set(&mut editor, "leg", 1.2);
    let from = editor.view().cage_id;
    let mesh = subdivided_box(editor.bounds().unwrap(), 0.2, [4, 8, 2]);
    let replace = Command::ReplaceCage { mesh, controls: None, notices: Vec::new(), rings: Vec::new() };
    editor.apply(replace).unwrap();
    assert_eq!((factors(&editor), editor.document().cage.controls.rings.len()), ([1.0, 1.0], 0));
    let positions = editor.document().pose.to_vec();
    let carry = |from| Command::CarryPoses { from, positions: positions.clone(), shares: Vec::new() };
    editor.apply(carry(from)).unwrap();
    assert_eq!(factors(&editor), [1.2, 1.2]);
    editor.apply(carry(from + 1)).unwrap();
    assert_eq!(factors(&editor), [1.0, 1.0]);
}

#[test]
fn a_joint_of_another_bone_is_exchanged_with_it() {
    let mut editor = opened(&GLB);
    let joint = |editor: &mut Editor, bone: &str| {
        let bones = editor.humanoid_info().unwrap().bones;
        bones.into_iter().find(|view| view.bone == bone).and_then(|view| view.joint).unwrap()
    };
    let [left, right] = ["leftHand", "rightHand"].map(|bone| joint(&mut editor, bone));
    assert_ne!(left, right);
    editor.apply(Command::SetBone { bone: "leftHand".to_owned(), joint: Some(right.clone()) }).unwrap();
    assert_eq!(["leftHand", "rightHand"].map(|bone| joint(&mut editor, bone)), [right, left]);
}

fn bound_document<'a>(
    editor: &'a Editor,
    bound: &'a Arc<BoundModels>,
    ground: &'a KnownGround,
) -> BoundDocument<'a> {
    BoundDocument { editor, bound: Some(bound), parts: None, lattice: None, ground }
}

/// The document, bound on a coarse grid.
fn bound(editor: &Editor) -> Arc<BoundModels> {
    let document = editor.document();
    let options = BindOptions { grid: ROUGH_GRID, ..BindOptions::default() };
    let points =
        [document.models.positions(), &document.models.extra_points().expect("valid input")].concat();
    let set = document.cage.set.as_ref().expect("valid input");
    let Binding { weights, frames, .. } = bind(&points, set, &options, &NoProgress).expect("valid input");
    Arc::new(BoundModels::new(document, weights, frames, Vec::new()))
}

/// The head of the sample is about 0.35 units high and above 1.6. The box around the figure has no vertices at its chin.
#[test]
fn with_a_bind_the_head_reaches_its_size() {
    let mut editor = opened(&GLB);
    let (bound, positions) = (bound(&editor), editor.document().models.positions().to_vec());
    let head = |pose: &[Vec3]| {
        let at = deform_bound(&bound.weights, &bound.frames, pose);
        let own = at.iter().zip(&positions).filter(|(_, rest)| rest.y > 1.7).map(|(p, _)| p.x);
        own.clone().fold(f32::MIN, f32::max) - own.fold(f32::MAX, f32::min)
    };
    let width = head(&editor.document().pose);
    set(&mut editor, "head", 1.4);
    let without = head(&editor.document().pose) / width;
    set(&mut editor, "head", 1.0);
    editor.set_bind(Some(&bound.weights));
    set(&mut editor, "head", 1.4);
    let with = head(&editor.document().pose) / width;
    assert!((with - 1.4).abs() < 0.5 * (without - 1.4).abs(), "{without} {with}");
    // A pull is kept, also if the bind changes before the factors are reset.
    pull(&mut editor);
    editor.set_bind(None);
    set(&mut editor, "head", 1.0);
    let mut expected = editor.document().cage.mesh.positions.clone();
    expected[3] += Vec3::new(0.1, 0.2, -0.3);
    assert!(farthest(&editor.document().pose, &expected) < ROUNDING);
}

#[test]
fn a_sample_of_the_triangles_folds_where_the_model_does() {
    let mut editor = opened(&GLB);
    let cage = editor.humanoid_cage().unwrap();
    let bound = bound(&editor);
    let document = editor.document();
    let ground = KnownGround::default();
    let all =
        BoundDocument { editor: &editor, bound: Some(&bound), parts: None, lattice: None, ground: &ground };
    let FoldSample { weights, frames, positions, triangles } = all.fold_sample().unwrap();
    assert!((7_000..=8_000).contains(&triangles.len()), "{} triangles", triangles.len());
    let sampled = cage.ranges(&weights, &frames, &positions, &triangles);
    let models = &document.models;
    let exact = cage.ranges(&bound.weights, &bound.frames, models.positions(), models.triangles());
    assert_eq!(sampled, exact);
}

#[test]
fn a_cage_follows_the_clip_of_a_fitted_rig_until_the_cage_changes() {
    let sample = samples::build("humanoid").unwrap();
    let statue = write_mesh_glb("statue", &sample.mesh, &sample.colours, None).unwrap();
    let mut editor = opened(&statue);
    assert!(!editor.walk_at(0, 0.5), "no rig is fitted");
    let rig = Model::read("rig.glb", &GLB, &mut |_| None).unwrap();
    let info = editor.set_walk(&rig).unwrap();
    assert_eq!((info.clips, info.notice), (vec![("Walk".to_owned(), 2.0)], None));
    let joints: Vec<Vec3> = sample.rig.unwrap().joints.iter().map(|joint| joint.at).collect();
    for at in editor.walk_joints() {
        let near = joints.iter().map(|joint| joint.distance(at)).fold(f32::MAX, f32::min);
        assert!(near < ROUNDING, "the rig fits its own mesh: {at}");
    }
    let rest = editor.document().pose.clone();
    assert!(editor.walk_at(0, 0.5));
    assert!(farthest(&editor.document().pose, &rest) > 0.2);
    assert!(!editor.is_pose_committed(), "a frame is no step of the history");
    editor.revert();
    assert_eq!(editor.document().pose, rest);
    let mesh = subdivided_box(editor.bounds().unwrap(), 0.2, [2, 4, 2]);
    let replace = Command::ReplaceCage { mesh, controls: None, notices: Vec::new(), rings: Vec::new() };
    editor.apply(replace).unwrap();
    assert!(!editor.walk_at(0, 0.5) && editor.walk_joints().is_empty());
    assert!(editor.set_walk(&Model::read("statue.glb", &statue, &mut |_| None).unwrap()).is_err());
}

#[test]
fn an_export_in_the_pose_plays_what_the_page_plays() {
    let mut editor = opened(&GLB);
    let bound = bound(&editor);
    for (name, factor) in [("leg", 1.3), ("head", 1.5)] {
        set(&mut editor, name, factor);
        editor.apply(Command::SavePose { name: name.to_owned() }).unwrap();
    }
    set(&mut editor, "arm", 1.4);
    editor.commit("Arms");
    let ground = KnownGround::default();
    let (id, options) = (editor.document().models.first().unwrap().id, RigOptions::default());
    let read = |bytes: Vec<u8>| Model::read("a.glb", &bytes, &mut |_| None).unwrap();
    let posed = read(bound_document(&editor, &bound, &ground).glb(id, &options, None).unwrap().bytes);
    let animated =
        read(bound_document(&editor, &bound, &ground).poses(id, &options, true, "Wave").unwrap().bytes);
    assert_eq!(animated.positions, posed.positions);
    let clip = animated.clips().iter().position(|clip| clip.name.as_deref() == Some("Wave")).unwrap();
    let player = animated.player().unwrap().unwrap();
    assert_eq!(player.targets().0, ["leg", "head", "Rest"]);
    for seconds in [0.0, 0.5, 1.0, 1.7, 2.5] {
        editor.play_at(seconds);
        let RigPose { palette, targets, .. } = player.pose_at(Some(clip), seconds, &[]);
        let exported = skin_vertices(&player.skin, &palette, &targets);
        let shown = bound_document(&editor, &bound, &ground).deformed(&editor.document().pose).unwrap();
        let off = farthest(&exported, &shown);
        assert!(off < 10.0 * ROUNDING, "{off} at {seconds} s");
        let shares = editor.document().timeline().shares(seconds);
        assert_eq!(editor.view().shares, shares);
    }
}

/// The cage stretches the model by 1.3 along y and lowers it by 0.2.
#[test]
fn the_lift_of_the_view_is_that_of_exports_and_clips() {
    let mut editor = opened(&GLB);
    let bound = bound(&editor);
    let stretched = |p: &Vec3| Vec3::new(p.x, 1.3 * p.y - 0.2, p.z);
    let positions = editor.document().pose.iter().map(stretched).collect();
    editor.apply(Command::SetPose { positions }).unwrap();
    let ground = KnownGround::default();
    let all =
        BoundDocument { editor: &editor, bound: Some(&bound), parts: None, lattice: None, ground: &ground };
    let low = |all: &[Vec3]| all.iter().map(|p| p.y).fold(f32::MAX, f32::min);
    let models = &editor.document().models;
    let (rest, posed) = (low(models.positions()), low(&all.deformed(&editor.document().pose).unwrap()));
    let lift = all.lift().unwrap();
    assert!((lift - (rest - posed)).abs() < 10.0 * ROUNDING, "{lift}");
    let mut options = RigOptions::default();
    options.reshape.ground = true;
    let glb = all.glb(models.first().unwrap().id, &options, None).unwrap().bytes;
    let exported = Model::read("a.glb", &glb, &mut |_| None).unwrap();
    assert!((low(&exported.positions) - rest).abs() < 10.0 * ROUNDING);
    let playback = Playback::new(all, options).unwrap();
    assert!((low(&playback.positions()) - rest).abs() < 10.0 * ROUNDING);
    let in_view = skin_vertices(&playback.skin, &playback.palette(), playback.targets());
    assert!((low(&in_view) - posed).abs() < 10.0 * ROUNDING, "where the cage is");
}

/// The cage moves as a whole, and the joints stay: the clip then moves a point by its blended matrix alone.
#[test]
fn a_displacement_before_a_clip_is_shown_as_wanted() {
    let mut editor = opened(&GLB);
    let bound = bound(&editor);
    let ground = KnownGround::default();
    let mut options = RigOptions::default();
    options.reshape.joints = Joints::Stay;
    let shown = |editor: &Editor| {
        let all = BoundDocument { editor, bound: Some(&bound), parts: None, lattice: None, ground: &ground };
        let mut playback = Playback::new(all, options.clone()).unwrap();
        playback.show(Some(0), 0.3, Vec::new());
        playback
    };
    let before = shown(&editor);
    assert!(before.can_pull());
    let wanted = Vec3::new(0.1, -0.05, 0.2);
    let models = &editor.document().models;
    // Points on triangles whose joints the clip turns differently.
    let points: Vec<([u32; 3], [f32; 3])> = models
        .triangles()
        .iter()
        .step_by(models.triangles().len() / 4)
        .map(|&corners| (corners, [0.2, 0.3, 0.5]))
        .collect();
    let place = |playback: &Playback, (corners, bary): ([u32; 3], [f32; 3])| -> Vec3 {
        corners.iter().zip(bary).map(|(&v, share)| share * playback.positions_in_view()[v as usize]).sum()
    };
    let mut largest = 0.0_f32;
    let pose = editor.document().pose.to_vec();
    for point in points {
        let by = before.before_clip(point.0, point.1, wanted).unwrap();
        largest = largest.max(by.distance(wanted));
        editor.set_pose(pose.iter().map(|p| *p + by).collect()).unwrap();
        let moved = place(&shown(&editor), point) - place(&before, point);
        assert!(moved.distance(wanted) < 10.0 * ROUNDING, "{moved}");
    }
    assert!(largest > 0.05, "the clip turns no point: {largest}");
}
