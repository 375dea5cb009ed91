//! Generates cages of four sizes for models defined by formulas, and measures their quality under other triangulations
//! and under bending. Prints a Markdown table with a row per cage and a summary per size.
//!
//! The columns `crossings` (pairs of intersecting triangles), `open` (edges that do not belong to two triangles) and
//! `outside` (model vertices) give the worst of four triangulations: diagonals from the first vertex, from the second,
//! the shorter and the longer ones. The column `fold` is the largest angle between the normals of adjacent triangles,
//! for either diagonal of each quad. For `off` and `over`, the cage is bent by 1.2 rad along its longest side: `off` is
//! the largest distance of the model from the exact bend, relative to its diagonal, and `over` is the number of flipped
//! triangles.
//!
//! `cargo bench -p cagework-benches --bench survey -- cup` measures the models whose names contain `cup`.

use std::collections::{BTreeMap, BTreeSet};
use std::f32::consts::{PI, TAU};

use cagework_benches::fastest_ms;
use cagework_cage::check::{Code, check};
use cagework_cage::generate::{CageOptions, generate};
use cagework_core::bind::bind;
use cagework_core::deform::deform_bound;
use cagework_core::options::BindOptions;
use cagework_core::progress::NoProgress;
use cagework_core::{Bounds, Cage, PolygonMesh, TriMesh};
use cagework_tests::RandomGenerator;
use glam::{Quat, Vec3, Vec3Swizzles as _, vec3};

/// Target numbers of cage vertices.
const TARGETS: [u32; 4] = [40, 80, 120, 200];

/// Number of cells of the bind grid along the longest side of the cage.
const GRID: u32 = 32;
/// Angle of the bend, radians.
const BEND: f32 = 1.2;

/// A model assembled from surface patches over the unit square.
#[derive(Clone, Default)]
struct Patches(TriMesh);

impl Patches {
    fn patch(mut self, [nu, nv]: [u32; 2], at: impl Fn(f32, f32) -> Vec3) -> Self {
        let first = self.0.positions.len() as u32;
        for i in 0..(nu + 1) * (nv + 1) {
            self.0.positions.push(at((i / (nv + 1)) as f32 / nu as f32, (i % (nv + 1)) as f32 / nv as f32));
        }
        for (u, v) in (0..nu).flat_map(|u| (0..nv).map(move |v| (u, v))) {
            let [a, b, c, d] =
                [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[du, dv]| first + (u + du) * (nv + 1) + v + dv);
            self.0.triangles.extend([[a, b, c], [a, c, d]]);
        }
        self
    }

    /// Adds a tube. `curve` maps the parameter, 0 to 1, to the tube's centre and radius; `along` is the number of
    /// segments.
    fn tube(self, along: u32, curve: impl Fn(f32) -> (Vec3, f32)) -> Self {
        self.patch([along, 12], |u, v| {
            let way = (curve(u + 1e-3).0 - curve(u - 1e-3).0).normalize();
            let side = way.cross(vec3(0.31, 0.17, 0.94)).normalize();
            let (point, radius) = curve(u);
            point + radius * (side * (TAU * v).cos() + way.cross(side) * (TAU * v).sin())
        })
    }

    /// Adds a capsule between two points.
    fn limb(self, from: impl Into<Vec3>, to: impl Into<Vec3>, radius: f32) -> Self {
        let (from, to) = (from.into(), to.into());
        let way = (to - from).normalize_or(Vec3::Z);
        let side = way.any_orthonormal_vector();
        self.patch([23, 12], |u, v| {
            let (polar, around) = (PI * u, TAU * v);
            let out = side * around.cos() + way.cross(side) * around.sin();
            let center = if u < 0.5 { from } else { to };
            center + radius * (polar.sin() * out - polar.cos() * way)
        })
    }

    fn block(self, min: impl Into<Vec3>, max: impl Into<Vec3>) -> Self {
        let (min, max) = (min.into(), max.into());
        (0..6).fold(self, |parts, side| {
            parts.patch([8, 8], |u, v| {
                let mut p = [u, v, (side % 2) as f32];
                p.rotate_right(side / 2);
                min + Vec3::from(p) * (max - min)
            })
        })
    }

    fn ball(self, at: Vec3, radius: f32) -> Self {
        self.limb(at, at, radius)
    }

    /// Adds a surface of revolution about z. `outline`: points (radius, height).
    fn revolved(self, outline: [[f32; 2]; 5]) -> Self {
        let outline = outline.map(|[r, z]| vec3(r, r, z));
        self.patch([40, 32], |u, v| {
            let k = (4.0 * u).min(3.0) as usize;
            outline[k].lerp(outline[k + 1], 4.0 * u - k as f32) * (on_circle(TAU * v) + Vec3::Z)
        })
    }

    /// Adds a block of 2 x 2 x 0.6 with a round hole through it. The wall of the hole is missing.
    fn holed(self, x: f32, y: f32) -> Self {
        self.patch([3, 32], |u, v| {
            let round = on_circle(TAU * v);
            let [inner, outer] = [0.5 * round, round / round.abs().max_element()];
            let height = 0.6 * Vec3::Z;
            vec3(x, y, 0.0) + [inner, outer, outer + height, inner + height][(3.0 * u).round() as usize]
        })
    }

    fn rotated(mut self) -> Self {
        let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.4, 0.5, 0.7);
        self.0.positions.iter_mut().for_each(|p| *p = turn * *p);
        self
    }
}

/// A human figure of height 2, symmetric about x = 0.
fn figure() -> Patches {
    let half = |parts: Patches, s: f32| {
        let leg = parts.limb([s * 0.13, 0.0, 0.95], [s * 0.16, 0.0, 0.1], 0.09);
        let foot = leg.limb([s * 0.16, 0.0, 0.06], [s * 0.16, -0.2, 0.05], 0.06);
        foot.limb([s * 0.2, 0.0, 1.5], [s * 0.8, 0.0, 1.4], 0.06)
    };
    let halves = half(half(Patches::default(), -1.0), 1.0);
    halves.limb([0.0, 0.0, 1.0], [0.0, 0.0, 1.45], 0.2).limb([0.0, 0.0, 1.75], [0.0, 0.0, 1.8], 0.14)
}

/// Joins `n` parts. `add(parts, k)` adds part `k` to the previous parts.
fn each(n: u32, add: impl Fn(Patches, f32) -> Patches) -> Patches {
    (0..n).fold(Patches::default(), |parts, k| add(parts, k as f32))
}

/// Calls `add` `n` times, each time with the patches so far and the same sequence of random numbers.
fn random(n: u32, add: impl Fn(Patches, &mut RandomGenerator) -> Patches) -> Patches {
    let mut random = RandomGenerator::new(38);
    (0..n).fold(Patches::default(), |parts, _| add(parts, &mut random))
}

fn point(random: &mut RandomGenerator) -> Vec3 {
    random.point(Vec3::splat(-1.0), Vec3::ONE)
}

fn on_circle(angle: f32) -> Vec3 {
    vec3(angle.cos(), angle.sin(), 0.0)
}

fn models() -> Vec<(&'static str, Patches)> {
    let mut models = Vec::new();
    let mut add = |name, parts| models.push((name, parts));
    let new = Patches::default;
    let brick = || new().block([-1.0, -0.6, -0.4], [1.0, 0.6, 0.4]);
    add("box", brick());
    add("rotated box", brick().rotated());
    add("sphere", new().ball(Vec3::ZERO, 1.0));
    add("limb", new().limb([-1.0, 0.1, 0.0], [1.0, 0.0, 0.3], 0.2));
    add("bent limb", new().tube(24, |t| (on_circle(2.2 * t), 0.15)));
    add("star", each(6, |p, k| p.limb([0.0; 3], on_circle(TAU * k / 6.0), 0.15)));
    let arm =
        |k: f32, t: f32| ((0.4 + 1.4 * t) * on_circle(TAU * k / 8.0) - Vec3::Z * (6.0 * t).sin() * 0.3, 0.1);
    add("octopus", each(8, |p, k| p.tube(16, move |t| arm(k, t))).ball(Vec3::ZERO, 0.5));
    add("figure", figure());
    add("figure with a sword", figure().block([0.8, -1.2, 1.37], [0.86, 0.3, 1.43]));
    let finger = |p: Patches, y: f32| p.limb([0.4, y, 0.0], [1.2 - 0.8 * y * y, 1.3 * y, 0.0], 0.09);
    let palm = each(4, |p, k| finger(p, 0.24 * k - 0.36)).block([-0.4, -0.42, -0.12], [0.45, 0.42, 0.12]);
    add("hand", palm.limb([-0.2, 0.4, 0.0], [0.4, 0.9, 0.1], 0.1));
    add("animal", Patches(cagework_tests::creature::creature()));
    let plate = |z: f32| new().block([-1.0, -0.7, z], [1.0, 0.7, z + 0.05]);
    add("crossed plates", plate(0.0).block([-0.03, -1.0, -1.0], [0.03, 1.0, 1.0]));
    add("stacked plates", plate(0.0).block([-1.0, -0.7, 0.5], [1.0, 0.7, 0.55]));
    add("rotated plate", plate(0.0).rotated());
    add(
        "saddle",
        new().patch([24, 24], |u, v| vec3(u, v, 2.0 * (u - 0.5).powi(2) - 2.0 * (v - 0.5).powi(2))),
    );
    let card =
        |p: Patches, turn: Quat| p.patch([8, 2], |u, v| turn * vec3(0.1 * (v - 0.5), 1.0 - 0.4 * u * u, u));
    add("hair cards", random(60, |p, random| card(p, random.rotation())));
    add("wires", random(20, |p, random| p.limb(point(random), point(random), 0.01)));
    add("coil", new().tube(120, |t| (0.5 * on_circle(5.0 * TAU * t) + Vec3::Z * 2.0 * t, 0.05)));
    let knot = |t: f32| {
        let wave = |k: f32| on_circle(PI / 2.0 - k * TAU * t);
        wave(1.0) + 2.0 * wave(2.0) * vec3(1.0, -1.0, 0.0) - Vec3::Z * wave(3.0).x
    };
    add("knot", new().tube(96, |t| (knot(t), 0.5)));
    add("wire knot", new().tube(96, |t| (knot(t), 0.12)));
    add("five balls", random(5, |p, random| p.ball(point(random), 0.25)));
    add("dots", random(60, |p, random| p.ball(point(random), 0.02)));
    let cup =
        |r: f32, depth: f32| new().revolved([[0.0, 0.0], [1.0, 0.0], [1.0, depth], [r, depth], [r, 0.1]]);
    add("cup", cup(0.92, 1.6));
    add("bowl", cup(0.95, 0.5));
    let handle = |t: f32| (vec3(1.0, 0.0, 1.0) + 0.5 * on_circle(PI * (t - 0.5)).xzy(), 0.1);
    add("mug", cup(0.88, 2.0).tube(16, handle));
    let side = |p: Patches, x: f32| p.limb([x, 0.0, 0.0], [x, -1.5, 0.0], 0.2);
    add("U", side(side(new().tube(24, |t| (on_circle(PI * t), 0.2)), -1.0), 1.0));
    add("S", new().tube(48, |t| (vec3((TAU * t).sin(), 3.0 * t, 0.0), 0.2)));
    let ring = |radius| new().tube(48, move |t| (on_circle(TAU * t), radius));
    add("torus", ring(0.3));
    add("linked rings", ring(0.12).tube(48, |t| (Vec3::X + on_circle(TAU * t).xzy(), 0.12)));
    let holes = |n: u32| each(n, |p, k| p.holed(2.0 * (k % 3.0), 2.0 * (k / 3.0).floor()));
    add("block with holes", holes(6));
    add("bracket", holes(2).block([-1.0, -1.0, 0.3], [-0.6, 1.0, 2.5]));
    add("washer", new().revolved([[0.4, 0.3], [1.0, 0.3], [1.0, -0.3], [0.4, -0.3], [0.4, 0.3]]));
    let leg = |p: Patches, at: Vec3, r| p.limb(at, at + 1.4 * Vec3::Z, r);
    let legs = |r| each(4, |p, k| leg(p, 1.4 * on_circle(TAU * (k + 0.5) / 4.0), r));
    add("table", legs(0.06).block([-1.2, -1.2, 1.4], [1.2, 1.2, 1.5]));
    let seat = legs(0.18).block([-1.2, -1.2, 1.2], [1.2, 1.2, 1.5]);
    add("chair", seat.block([-1.2, 1.0, 1.5], [1.2, 1.2, 3.5]));
    let spoke = |p: Patches, k: f32| p.limb([0.0; 3], on_circle(TAU * k / 6.0), 0.06);
    add("wheel", (0..6).fold(ring(0.1), |p, k| spoke(p, k as f32)));
    let hull =
        new().limb([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], 0.15).block([-0.2, -1.2, -0.02], [0.2, 1.2, 0.02]);
    add("plane", hull.block([-1.1, -0.4, 0.0], [-0.85, 0.4, 0.03]));
    models
}

/// Function that summarises a column of the table over all cages of a size.
type Total = fn(&[f64]) -> f64;

/// Measured quantities: the columns of the table.
const COLUMNS: [(&str, Total); 12] = [
    ("vertices", |of| of.iter().sum()),
    ("quads / faces", |of| of.iter().sum::<f64>() / of.len() as f64),
    ("two-edged", count),
    ("open", count),
    ("crossings", count),
    ("outside", count),
    ("fold", largest),
    ("folds > 120", count),
    ("angle", |of| of.iter().copied().fold(f64::INFINITY, f64::min)),
    ("off", largest),
    ("over", count),
    ("ms", largest),
];

/// Counts the positive values in a column.
fn count(of: &[f64]) -> f64 {
    of.iter().filter(|&&x| x > 0.0).count() as f64
}

fn largest(of: &[f64]) -> f64 {
    of.iter().copied().fold(0.0, f64::max)
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // `cargo test --benches` also runs this program, without `--bench`. Skip the measurements then.
    if !arguments.iter().any(|argument| argument == "--bench") {
        return;
    }
    let names: Vec<&String> = arguments.iter().filter(|argument| !argument.starts_with("--")).collect();
    let models: Vec<_> = models()
        .into_iter()
        .filter(|model| names.is_empty() || names.iter().any(|name| model.0.contains(name.as_str())))
        .collect();
    println!("| model | target | {} |", COLUMNS.map(|column| column.0).join(" | "));
    println!("|---|---|{}", "---|".repeat(COLUMNS.len()));
    for target in TARGETS {
        let mut rows = Vec::new();
        for (name, Patches(mesh)) in &models {
            rows.push(row(mesh, target));
            print_row(name, target, rows[rows.len() - 1]);
        }
        let column = |k: usize| rows.iter().map(|row: &[f64; COLUMNS.len()]| row[k]).collect::<Vec<_>>();
        print_row("**all**", target, std::array::from_fn(|k| COLUMNS[k].1(&column(k))));
    }
}

fn print_row(name: &str, target: u32, row: [f64; COLUMNS.len()]) {
    let cells = row.map(|x| if x.fract() == 0.0 { x.to_string() } else { format!("{x:.3}") });
    println!("| {name} | {target} | {} |", cells.join(" | "));
}

fn row(model: &TriMesh, target: u32) -> [f64; COLUMNS.len()] {
    let options = CageOptions { target, ..CageOptions::default() };
    let mut made = None;
    let ms =
        fastest_ms(1, || made = generate(&model.positions, &model.triangles, &options, &NoProgress).ok());
    let cage = made.expect("any model has a cage").cage;
    let mesh = cage.to_polygon_mesh();
    let mut neighbours = vec![BTreeSet::new(); mesh.positions.len()];
    let mut smallest = f32::INFINITY;
    for (f, k) in mesh.faces.iter().flat_map(|f| (0..f.len()).map(move |k| (f, k))) {
        let [a, b, c] = [f.len() - 1, 0, 1].map(|step| f[(k + step) % f.len()]);
        neighbours[b as usize].extend([a, c]);
        let [to_a, to_c] = [a, c].map(|v| mesh.positions[v as usize] - mesh.positions[b as usize]);
        smallest = smallest.min(to_a.angle_between(to_c).to_degrees());
    }
    let quads = mesh.faces.iter().filter(|f| f.len() == 4).count();
    let [mut open, mut crossings, mut outside] = [0.0_f64; 3];
    let length = |a: u32, b: u32| mesh.positions[a as usize].distance(mesh.positions[b as usize]);
    for way in 0..4 {
        let faces = mesh.faces.iter().flat_map(|f| {
            let is_shorter = f.len() == 4 && length(f[0], f[2]) <= length(f[1], f[3]);
            let k = usize::from([false, true, !is_shorter, is_shorter][way]);
            (2..f.len()).map(move |n| [0, n - 1, n].map(|i| f[(i + k) % f.len()]).to_vec())
        });
        let cut = PolygonMesh { positions: mesh.positions.clone(), faces: faces.collect() };
        let checked = check(&cut, Some(&model.positions), None);
        let count = |code| checked.problem(code).map_or(0.0, |problem| problem.count as f64);
        open = open.max(count(Code::OpenEdge) + count(Code::NonManifoldEdge) + count(Code::DuplicateFace));
        crossings = crossings.max(count(Code::SelfIntersection));
        outside = outside.max(count(Code::ModelOutside));
    }
    let folds = folds(&mesh);
    let [off, over] = bent(model, &cage);
    [
        cage.n_vertices() as f64,
        quads as f64 / mesh.faces.len() as f64,
        neighbours.iter().filter(|near| near.len() < 3).count() as f64,
        open,
        crossings,
        outside,
        largest(&folds),
        folds.iter().filter(|&&fold| fold > 120.0).count() as f64,
        f64::from(smallest),
        off,
        over,
        ms.round(),
    ]
}

/// Measures the angles, in degrees, between the normals of adjacent triangles: across each diagonal of a face, and
/// across each edge the largest angle over all triangulations of its two faces.
fn folds(mesh: &PolygonMesh) -> Vec<f64> {
    let normal = |[a, b, c]: [u32; 3]| {
        let [a, b, c] = [a, b, c].map(|v| mesh.positions[v as usize].as_dvec3());
        (b - a).cross(c - a)
    };
    let mut beside: BTreeMap<[u32; 2], Vec<Vec<glam::DVec3>>> = BTreeMap::new();
    let mut folds = Vec::new();
    for f in &mesh.faces {
        for k in 0..f.len() {
            let [a, b, c, d] = [0, 1, 2, 3].map(|step| f[(k + step) % f.len()]);
            let halves = [c, d].into_iter().take(f.len() - 2).map(|tip| normal([a, b, tip]));
            beside.entry([a.min(b), a.max(b)]).or_default().push(halves.collect());
            if f.len() == 4 {
                folds.push(normal([a, b, c]).angle_between(normal([a, c, d])).to_degrees());
            }
        }
    }
    for sides in beside.values() {
        let pairs = sides[0].iter().flat_map(|m| sides[1..].iter().flatten().map(|n| m.angle_between(*n)));
        folds.push(pairs.fold(0.0, f64::max).to_degrees());
    }
    folds
}

/// Bends the cage. Returns the largest distance of a deformed model vertex from its exactly bent position, relative to
/// the model's diagonal, and the number of triangles whose normal is flipped against that of the exactly bent triangle.
fn bent(model: &TriMesh, cage: &Cage) -> [f64; 2] {
    let bounds = Bounds::around(&model.positions).expect("there are vertices");
    let extent = bounds.extent();
    let long = (0..3).max_by(|&a, &b| extent[a].total_cmp(&extent[b])).expect("there are three");
    let (u, w) = (Vec3::AXES[long], Vec3::AXES[(long + 1) % 3]);
    let radius = extent[long] / BEND;
    let bend = |p: &Vec3| {
        let d = *p - bounds.center();
        let (angle, rest) = (d.dot(u) / radius, radius - d.dot(w));
        *p + u * (rest * angle.sin() - d.dot(u)) + w * (radius - rest * angle.cos() - d.dot(w))
    };
    let options = BindOptions { grid: GRID, ..BindOptions::default() };
    let Ok(binding) = bind(&model.positions, cage, &options, &NoProgress) else { return [f64::INFINITY; 2] };
    let posed: Vec<Vec3> = cage.positions().iter().map(bend).collect();
    let moved = deform_bound(&binding.weights, &binding.frames, &posed);
    let right: Vec<Vec3> = model.positions.iter().map(bend).collect();
    let off = moved.iter().zip(&right).map(|(p, q)| p.distance(*q)).fold(0.0, f32::max);
    let normal = |at: &[Vec3], t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| at[v as usize].as_dvec3());
        (b - a).cross(c - a)
    };
    let smallest = 1e-6 * f64::from(bounds.diagonal()).powi(2);
    let over = model.triangles.iter().filter(|t| {
        let right = normal(&right, t);
        right.length() > smallest && normal(&moved, t).dot(right) < 0.0
    });
    [f64::from(off / bounds.diagonal()), over.count() as f64]
}
