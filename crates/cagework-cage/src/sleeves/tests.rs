use std::f32::consts::{PI, TAU};
use std::ops::ControlFlow;

use cagework_core::geometry::winding_number;
use cagework_core::progress::{NoProgress, ProgressEvent};
use glam::{DVec3, Vec3};

use super::*;

/// Number of meridians of a capsule, and of circles of latitude on each half.
const N_AROUND: u32 = 12;
const N_LATITUDES: u32 = 4;

/// A figure made of capsules, one for each bone: trunk, head, arms and legs. Units: about 2 high.
struct Figure {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    skeleton: Skeleton,
}

/// Triangles of a capsule around the segment from `a` to `b`.
fn capsule(a: Vec3, b: Vec3, radius: f32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let along = (b - a).normalize();
    // Frames of mirrored segments are mirror images.
    let across = along.cross(Vec3::Z).normalize() * if a.x + b.x < 0.0 { -1.0 } else { 1.0 };
    let depth = Vec3::Z;
    let mut positions = vec![a - radius * along];
    for k in 1..=2 * N_LATITUDES {
        let (end, angle) = match k <= N_LATITUDES {
            true => (a, PI / 2.0 * (k as f32 / N_LATITUDES as f32 - 1.0)),
            false => (b, PI / 2.0 * ((k - N_LATITUDES - 1) as f32 / N_LATITUDES as f32)),
        };
        for i in 0..N_AROUND {
            let turn = TAU * i as f32 / N_AROUND as f32;
            let out = turn.cos() * across + turn.sin() * depth;
            positions.push(end + radius * (angle.sin() * along + angle.cos() * out));
        }
    }
    positions.push(b + radius * along);
    let last = positions.len() as u32 - 1;
    let mut triangles = Vec::new();
    for i in 0..N_AROUND {
        let next = (i + 1) % N_AROUND;
        triangles.push([0, 1 + next, 1 + i]);
        for k in 0..2 * N_LATITUDES - 1 {
            let [a, b] = [1 + k * N_AROUND, 1 + (k + 1) * N_AROUND];
            triangles.extend([[a + i, a + next, b + next], [a + i, b + next, b + i]]);
        }
        let top = last - N_AROUND;
        triangles.push([top + i, top + next, last]);
    }
    (positions, triangles)
}

/// `half_gap`: distance of the axes of the legs from the mirror plane; their radius is 0.1.
fn figure(half_gap: f32) -> Figure {
    let v = Vec3::new;
    let mirrored = |p: Vec3| p.with_x(-p.x);
    let trunk =
        vec![v(0.0, 0.85, 0.0), v(0.0, 0.95, 0.0), v(0.0, 1.2, 0.0), v(0.0, 1.45, 0.0), v(0.0, 1.9, 0.0)];
    let arm = [v(0.0, 1.45, 0.0), v(0.2, 1.42, 0.0), v(0.5, 1.40, 0.0), v(0.85, 1.38, 0.0)];
    let leg = [v(0.0, 0.95, 0.0), v(half_gap, 0.9, 0.0), v(half_gap, 0.5, 0.02), v(half_gap, 0.06, 0.0)];
    let mut figure = Figure {
        positions: Vec::new(),
        triangles: Vec::new(),
        skeleton: Skeleton {
            chains: Vec::new(),
            chain_of: Vec::new(),
            bone_of: Vec::new(),
            axis: 0,
            offset: 0.0,
            is_symmetric: true,
            is_biped: true,
            is_rigged: true,
        },
    };
    let limbs = [
        ("trunk", trunk, 0.14, None),
        ("leg.L", leg.to_vec(), 0.1, Some(2)),
        ("leg.R", leg.map(mirrored).to_vec(), 0.1, Some(1)),
        ("arm.L", arm.to_vec(), 0.06, Some(4)),
        ("arm.R", arm.map(mirrored).to_vec(), 0.06, Some(3)),
    ];
    for (chain, (name, at, radius, mirror)) in limbs.into_iter().enumerate() {
        let first = 10 * chain as u32;
        let n = at.len();
        // The first bone of a limb lies inside the trunk.
        for k in 1..n - 1 {
            let (positions, triangles) = capsule(at[k], at[k + 1], radius);
            let start = figure.positions.len() as u32;
            figure.triangles.extend(triangles.into_iter().map(|t| t.map(|i| start + i)));
            figure.skeleton.chain_of.resize(figure.positions.len() + positions.len(), chain as u32);
            figure.skeleton.bone_of.resize(figure.positions.len() + positions.len(), first + k as u32 - 1);
            figure.positions.extend(positions);
        }
        let mut joints: Vec<DVec3> = at.iter().map(|p| p.as_dvec3()).collect();
        let last = (joints[n - 1] - joints[n - 2]).normalize();
        joints[n - 1] += f64::from(radius) * last;
        figure.skeleton.chains.push(Chain {
            name: name.to_owned(),
            at: joints,
            bones: (0..n as u32 - 1).map(|k| first + k.saturating_sub(1)).collect(),
            own_bones: (first..first + n as u32 - 2).collect(),
            parent: (chain > 0).then_some(0),
            is_midline: chain == 0,
            mirror,
            is_symmetric: true,
        });
    }
    figure
}

fn sleeves_of(figure: &Figure, target: usize) -> Result<Sleeves, SleeveError> {
    generate(&figure.positions, &figure.triangles, &figure.skeleton, target, &NoProgress)
}

/// Whether all vertices of a figure are inside a cage, whichever diagonal its quads are cut along.
fn encloses(cage: &Cage, points: &[Vec3]) -> bool {
    [0, 1].into_iter().all(|cut| {
        let corner = |face: &[u32], k: usize| cage.positions()[face[(k + cut) % 4] as usize].as_dvec3();
        let triangles: Vec<[DVec3; 3]> = cage
            .faces()
            .iter()
            .flat_map(|f| [[0, 1, 2], [2, 3, 0]].map(|t| t.map(|k| corner(f, k))))
            .collect();
        points.iter().all(|p| (winding_number(p.as_dvec3(), triangles.iter().copied()) - 1.0).abs() < 1e-6)
    })
}

#[test]
fn a_figure_gets_mirrored_rings_of_quads_around_all_its_points() {
    let figure = figure(0.16);
    let sleeves = sleeves_of(&figure, 80).unwrap();
    let cage = &sleeves.cage;
    assert!((60..=80).contains(&cage.n_vertices()), "{} vertices", cage.n_vertices());
    assert!(cage.faces().iter().all(|face| face.len() == 4));
    assert!(encloses(cage, &figure.positions));
    assert_eq!((sleeves.chains.len(), sleeves.chains[0].as_str(), sleeves.mirror), (5, "trunk", Some(0)));
    assert!(sleeves.mean_distance < 0.04 && sleeves.largest_distance < 0.15, "{}", sleeves.mean_distance);
    // Rings of the trunk have six vertices, others four, and each place of a ring is taken once.
    let mut places: Vec<[u32; 3]> = sleeves.places.iter().map(|p| [p.chain, p.ring, p.place]).collect();
    places.sort_unstable();
    for ring in places.chunk_by(|a, b| a[..2] == b[..2]) {
        let n = if ring[0][0] == 0 { 6 } else { 4 };
        assert!(ring.iter().map(|place| place[2]).eq(0..n), "{ring:?}");
    }
    // Each limb has a ring within 0.05 of its elbow or knee.
    for (chain, joint) in [(1, figure.skeleton.chains[1].at[2]), (3, figure.skeleton.chains[3].at[2])] {
        let of_ring = |ring: u32| -> Vec<DVec3> {
            let of = sleeves.places.iter().zip(cage.positions());
            of.filter(|(p, _)| p.chain == chain && p.ring == ring).map(|(_, at)| at.as_dvec3()).collect()
        };
        let center = |at: Vec<DVec3>| at.iter().sum::<DVec3>() / at.len() as f64;
        let n_rings = sleeves.places.iter().filter(|p| p.chain == chain).map(|p| p.ring + 1).max().unwrap();
        let nearest =
            (0..n_rings).map(|ring| center(of_ring(ring)).distance(joint)).fold(f64::INFINITY, f64::min);
        assert!(nearest < 0.05, "chain {chain}: {nearest}");
    }
    let image = |v: usize| {
        let p = cage.positions()[v];
        let image = p.with_x(0.0 - p.x);
        cage.positions().iter().position(|&q| q == image).unwrap()
    };
    let sorted = |face: Vec<usize>| {
        let mut face = face;
        face.sort_unstable();
        face
    };
    let faces: Vec<Vec<usize>> =
        cage.faces().iter().map(|f| sorted(f.iter().map(|&v| v as usize).collect())).collect();
    assert!(faces.iter().all(|face| faces.contains(&sorted(face.iter().map(|&v| image(v)).collect()))));
    let again = sleeves_of(&figure, 80).unwrap();
    assert_eq!((again.cage.positions(), again.cage.faces()), (cage.positions(), cage.faces()));
}

/// The same figure, turned so that the mirror plane is z = 2.
#[test]
fn the_mirror_plane_may_be_anywhere() {
    let mut figure = figure(0.16);
    let turned = |p: DVec3| DVec3::new(p.y - 5.0, p.z, p.x + 2.0);
    figure.positions.iter_mut().for_each(|p| *p = turned(p.as_dvec3()).as_vec3());
    figure.skeleton.chains.iter_mut().flat_map(|chain| &mut chain.at).for_each(|p| *p = turned(*p));
    (figure.skeleton.axis, figure.skeleton.offset) = (2, 2.0);
    let sleeves = sleeves_of(&figure, 80).unwrap();
    assert_eq!(sleeves.mirror, Some(2));
    assert!(encloses(&sleeves.cage, &figure.positions));
    for p in sleeves.cage.positions() {
        let image = |q: &&Vec3| (q.z - (4.0 - p.z)).abs() <= 4.0 * f32::EPSILON && (q.x, q.y) == (p.x, p.y);
        assert!(sleeves.cage.positions().iter().any(|q| image(&q)), "{p}");
    }
}

#[test]
fn refusals_say_what_to_do() {
    let refusal = |figure: &Figure, target: usize| match sleeves_of(figure, target) {
        Err(SleeveError::Refused(refusal)) => refusal,
        other => panic!("{other:?}"),
    };
    let few = refusal(&figure(0.16), 8);
    assert_eq!(few, Refusal::TooFew { target: 8, needed: 12 });
    assert_eq!(few.to_string(), "8 vertices are too few for sleeves: allow at least 12");
    // The number of vertices that the refusal asks for is enough.
    let Refusal::TooFew { target: 20, needed } = refusal(&figure(0.16), 20) else {
        panic!("limbs fit into 20 vertices")
    };
    assert_eq!(sleeves_of(&figure(0.16), needed).unwrap().chains.len(), 5);
    let mut wrong = figure(0.16);
    wrong.skeleton.chain_of.pop();
    assert!(matches!(refusal(&wrong, 80), Refusal::Skeleton { .. }));
    let mut wrong = figure(0.16);
    wrong.skeleton.chains[0].at.truncate(2);
    let sentence = "the skeleton has a trunk of 2 joints: sleeves need at least three";
    assert_eq!(refusal(&wrong, 80).to_string(), sentence);
    // 10,000 copies of a triangle as high as the figure, of more than 100 samples each.
    let mut soup = figure(0.16);
    let order = |a: &u32, b: &u32| soup.positions[*a as usize].y.total_cmp(&soup.positions[*b as usize].y);
    let all = 0..soup.positions.len() as u32;
    let [low, high] = [all.clone().min_by(order).unwrap(), all.max_by(order).unwrap()];
    soup.triangles = vec![[low, high, low + 1]; 10_000];
    let Refusal::TooManySamples { samples, limit: MAX_SAMPLES } = refusal(&soup, 80) else {
        panic!("they are too many")
    };
    assert!(samples > MAX_SAMPLES);
    // 60,000 copies of a vertex, each moved by up to 2: the points of one attempt are already too many.
    let mut cloud = figure(0.16);
    let (n, at) = (cloud.positions.len(), cloud.positions.clone());
    for k in 0..60_000_u32 {
        let [x, y, z] = [k % 40, k / 40 % 40, k / 1600].map(|x| x as f32 / 40.0 - 0.5);
        cloud.positions.push(at[k as usize % n] + 4.0 * Vec3::new(x, y, z));
        cloud.skeleton.chain_of.push(cloud.skeleton.chain_of[k as usize % n]);
        cloud.skeleton.bone_of.push(cloud.skeleton.bone_of[k as usize % n]);
    }
    let why = refusal(&cloud, 80);
    assert!(matches!(why, Refusal::TooManySamples { limit: ..=MAX_FITTED, .. }), "{why}");
}

/// Legs of radius 0.1 whose axes are 0.12 apart overlap.
#[test]
fn legs_that_overlap_get_one_sleeve() {
    let figure = figure(0.06);
    let sleeves = sleeves_of(&figure, 80).unwrap();
    assert_eq!(sleeves.chains, ["trunk", "leg.L and leg.R", "arm.L", "arm.R"]);
    assert_eq!(sleeves.notices, ["leg.L and leg.R touch: they have one sleeve"]);
    assert!(encloses(&sleeves.cage, &figure.positions) && sleeves.mirror == Some(0));
}

/// A flap of the trunk hangs through both thighs, so no sleeve of its own fits beside those of the legs.
#[test]
fn points_that_hang_into_the_legs_belong_to_them() {
    let mut figure = figure(0.16);
    let first = figure.positions.len() as u32;
    for (x, y) in [(-0.2, 0.8), (0.2, 0.8), (-0.2, 0.55), (0.2, 0.55)] {
        figure.positions.push(Vec3::new(x, y, 0.05));
        figure.skeleton.chain_of.push(0);
        figure.skeleton.bone_of.push(0);
    }
    figure.triangles.extend([[0, 2, 1], [1, 2, 3]].map(|t| t.map(|v| first + v)));
    let sleeves = sleeves_of(&figure, 80).unwrap();
    assert_eq!(sleeves.chains, ["trunk", "leg.L", "leg.R", "arm.L", "arm.R"]);
    assert!(encloses(&sleeves.cage, &figure.positions) && sleeves.mirror == Some(0));
}

#[test]
fn generation_is_cancelled_between_rounds() {
    let figure = figure(0.16);
    let stop_at = |fraction: f32| {
        let progress = move |event: ProgressEvent| match event.fraction < fraction {
            true => ControlFlow::Continue(()),
            false => ControlFlow::Break(()),
        };
        generate(&figure.positions, &figure.triangles, &figure.skeleton, 80, &progress)
    };
    for fraction in [0.0, 0.03] {
        assert!(matches!(stop_at(fraction), Err(SleeveError::Cancelled(Cancellation))));
    }
}
