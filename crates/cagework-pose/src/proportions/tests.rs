use std::sync::LazyLock;

use cagework_cage::samples;
use cagework_core::progress::NoProgress;
use cagework_core::rig::{Joint, Rig};
use cagework_core::{BindOptions, Binding, Cage, bind};

use super::*;

/// A sample with legs, arms and head in its cage, bound on a coarse grid.
struct Figure {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    rig: Rig,
    humanoid: Humanoid,
    cage: HumanoidCage,
    rest: Vec<Vec3>,
    bound: Binding,
}

static FIGURE: LazyLock<Figure> = LazyLock::new(|| {
    let sample = samples::build("humanoid").unwrap();
    let own = sample.rig.unwrap();
    let joints = own.joints.iter().map(|joint| Joint {
        name: joint.name.to_owned(),
        parent: joint.parent.map(|parent| parent as u32),
        at: joint.at,
        bone: None,
    });
    let rig = Rig {
        joints: joints.collect(),
        first: (0..=own.influences.len() as u32).map(|v| 4 * v).collect(),
        influences: own.influences.iter().flatten().copied().collect(),
    };
    let humanoid = Humanoid::of_rig(&rig, &[]).unwrap();
    let (positions, triangles) = (sample.mesh.positions, sample.mesh.triangles);
    let cage = Cage::new(&sample.cage).unwrap();
    let options = BindOptions { grid: 48, ..BindOptions::default() };
    let bound = bind(&positions, &cage, &options, &NoProgress).unwrap();
    let rest = cage.positions().to_vec();
    let cage = HumanoidCage::new(&rest, &[], &positions, &rig, &humanoid);
    let cage = cage.with_bind(&bound.weights, &positions, &rig, &humanoid);
    Figure { positions, triangles, rig, humanoid, cage, rest, bound }
});

impl Figure {
    fn posed(&self, factors: &[(&str, f64)]) -> Vec<Vec3> {
        let named: BTreeMap<String, f64> = factors.iter().map(|(name, f)| ((*name).to_owned(), *f)).collect();
        let pose = self.cage.pose(&named.try_into().unwrap());
        deform_bound(&self.bound.weights, &self.bound.frames, &pose)
    }

    /// Length of the diagonal of the box of the vertices that follow a bone, in `at`, as a multiple of that at rest.
    fn size_of(&self, bone: Bone, at: &[Vec3]) -> f32 {
        let skin = skin_of_bones(&self.rig, &self.humanoid);
        let diagonal = |at: &[Vec3]| {
            let own = at.iter().zip(&skin).filter(|(_, row)| row[bone as usize] > 0.99).map(|(p, _)| *p);
            cagework_core::Bounds::around(&own.collect::<Vec<_>>()).unwrap().diagonal()
        };
        diagonal(at) / diagonal(&self.positions)
    }

    fn ends(&self, at: &[Vec3]) -> [f32; 2] {
        let heights = || at.iter().map(|p| p.y);
        [heights().fold(f32::INFINITY, f32::min), heights().fold(f32::NEG_INFINITY, f32::max)]
    }
}

#[test]
fn factors_of_one_keep_the_cage() {
    let figure = &*FIGURE;
    assert_eq!(figure.cage.pose(&Proportions::default()), figure.rest);
    // Without the shortcut, too: the maps are the identity up to rounding.
    let mut almost = Proportions::default();
    almost.set("neck", 1.0 + 1e-12).unwrap();
    let moved =
        figure.cage.pose(&almost).iter().zip(&figure.rest).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
    assert!(moved < 1e-6, "{moved}");
}

/// The figure grows by the factor times the lengths of thigh and shin; what is above the hips and the feet keeps its
/// shape and size.
#[test]
fn longer_legs_raise_the_figure_and_keep_feet_and_head() {
    let figure = &*FIGURE;
    let posed = figure.posed(&[("leg", 1.3)]);
    let at = |bone| figure.humanoid.at(&figure.rig, bone).unwrap();
    let leg = at(Bone::LeftUpperLeg).y - at(Bone::LeftFoot).y;
    let [[low, high], [low_after, high_after]] = [figure.ends(&figure.positions), figure.ends(&posed)];
    assert!((low_after - low).abs() < 0.01, "{low} {low_after}");
    let grown = f64::from(high_after - low_after - (high - low));
    assert!((grown - 0.3 * leg).abs() < 0.03 * leg, "{grown} {leg}");
    for bone in [Bone::Head, Bone::LeftFoot, Bone::RightFoot, Bone::LeftHand] {
        let size = figure.size_of(bone, &posed);
        assert!((size - 1.0).abs() < 0.02, "{bone}: {size}");
    }
}

#[test]
fn a_head_is_scaled_and_stays_on_the_neck() {
    let figure = &*FIGURE;
    let posed = figure.posed(&[("head", 1.4)]);
    let size = figure.size_of(Bone::Head, &posed);
    assert!((size - 1.4).abs() < 0.05, "{size}");
    assert!((figure.size_of(Bone::LeftHand, &posed) - 1.0).abs() < 0.01);
    // Feet, legs and hands do not move.
    let hands = figure.posed(&[("hand", 1.3), ("foot", 0.8)]);
    assert!((figure.size_of(Bone::RightHand, &hands) - 1.3).abs() < 0.06);
    assert!((figure.size_of(Bone::LeftFoot, &hands) - 0.8).abs() < 0.06);
}

#[test]
fn one_side_may_differ() {
    let figure = &*FIGURE;
    let posed = figure.posed(&[("arm", 1.2), ("right_arm", 1.0)]);
    let reach = |at: &[Vec3], sign: f32| at.iter().map(|p| sign * p.x).fold(0.0, f32::max);
    let [left, right] = [1.0, -1.0].map(|sign| reach(&posed, sign) / reach(&figure.positions, sign));
    assert!(left > 1.1 && (right - 1.0).abs() < 0.01, "{left} {right}");
}

/// A height of 1.5 scales everything, and the soles keep their height.
#[test]
fn height_scales_the_whole_figure() {
    let figure = &*FIGURE;
    let posed = figure.posed(&[("height", 1.5)]);
    let [low, high] = figure.ends(&figure.positions);
    let [low_after, high_after] = figure.ends(&posed);
    assert!(((high_after - low_after) / (high - low) - 1.5).abs() < 1e-3);
    assert!((low_after - low).abs() < 0.02 * (high - low));
}

#[test]
fn no_preset_folds_the_figure() {
    let figure = &*FIGURE;
    let normal = |at: &[Vec3], t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| at[v as usize]);
        (b - a).cross(c - a)
    };
    for preset in PRESETS {
        let posed = figure.posed(preset.factors);
        let folded =
            figure.triangles.iter().filter(|t| normal(&figure.positions, t).dot(normal(&posed, t)) < 0.0);
        assert_eq!(folded.count(), 0, "{}", preset.name);
    }
}

/// A point hangs above a foot by the distance from the chest to the head, less 0.9 of that from the hips to the chest. A
/// longer torso brings it below the foot, and its triangle turns over.
#[test]
fn ranges_end_where_the_model_folds() {
    let figure = &*FIGURE;
    let nearest = |at: Vec3| {
        let distance = |v: &usize| figure.rest[*v].distance(at);
        (0..figure.rest.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap() as u32
    };
    let [head, chest, hips] = [1.9, 1.42, 1.0].map(|y| nearest(Vec3::new(0.0, y, 0.3)));
    let [foot, toe] = [-0.3, 0.5].map(|z| nearest(Vec3::new(0.15, -0.1, z)));
    let rows: [&[(u32, f32)]; 3] =
        [&[(foot, 1.0), (head, 1.0), (chest, -1.9), (hips, 0.9)], &[(foot, 1.0)], &[(toe, 1.0)]];
    let (columns, values): (Vec<u32>, Vec<f32>) = rows.concat().into_iter().unzip();
    let weights = Weights::new(figure.rest.len() as u32, vec![0, 4, 5, 6], columns, values).unwrap();
    let frames = Frames::default();
    let at = |factor: f64| {
        let mut proportions = Proportions::default();
        proportions.set("torso", factor).unwrap();
        let posed = deform_bound(&weights, &frames, &figure.cage.pose(&proportions));
        posed[0].y - posed[1].y
    };
    let positions = deform_bound(&weights, &frames, &figure.rest);
    let ranges = figure.cage.ranges(&weights, &frames, &positions, &[[0, 1, 2]]);
    let torso = ranges.iter().find(|range| range.proportion == Proportion::Torso).unwrap();
    let next = FACTORS_UP.into_iter().find(|factor| *factor > torso.max).unwrap();
    assert!(at(torso.max) > 0.0 && at(next) < 0.0, "{torso:?} {} {}", at(torso.max), at(next));
    assert_eq!(torso.min, 0.5);
}

#[test]
fn proportions_are_named_factors() {
    let parse = |named: &[(&str, f64)]| {
        let named: BTreeMap<String, f64> = named.iter().map(|(name, f)| ((*name).to_owned(), *f)).collect();
        Proportions::try_from(named)
    };
    let proportions = parse(&[("left_leg", 1.1), ("leg", 1.2), ("head", 1.5)]).unwrap();
    assert_eq!([0, 1].map(|side| proportions.factor(Proportion::Leg, side)), [1.1, 1.2]);
    let named = BTreeMap::from(proportions);
    let expected = [("head", 1.5), ("left_leg", 1.1), ("right_leg", 1.2)];
    assert!(named.iter().map(|(name, factor)| (name.as_str(), *factor)).eq(expected));
    assert_eq!(Proportions::try_from(named), Ok(proportions));
    for (wrong, part) in [
        (("leg", 3.0), "leg: factor is 3; it must be a number from 0.5 to 2"),
        (("tail", 1.0), "no proportion \"tail\""),
        (("left_head", 1.0), "head has no sides"),
    ] {
        let error = parse(&[wrong]).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
}
