//! Vertices, morph targets, normals and tangents of a primitive after a deformation.

use std::cell::OnceCell;

use ::gltf::json::mesh::Semantic;
use glam::{DMat3, DMat4, DVec3};

use super::{Rig, RigPrimitive};
use crate::gltf::GltfError;
use crate::gltf::geometry::{Frame, attribute, vectors};
use crate::surface::{Surface, cofactor};

/// Condition number above which a skinning matrix counts as singular.
const MAX_CONDITION: f64 = 1e4;

/// A primitive after the deformation, in mesh space, as its accessors store it.
pub(super) struct Shape {
    pub(super) positions: Vec<DVec3>,
    pub(super) normals: Option<Vec<DVec3>>,
    /// Tangents with their handedness, 1 or -1.
    pub(super) tangents: Option<Vec<(DVec3, f32)>>,
    pub(super) targets: Vec<Deltas>,
    pub(super) condition: f64,
    /// Number of vertices whose skinning matrix is singular.
    pub(super) n_singular: usize,
}

/// Deltas of a morph target. Normals and tangents are present if the file has them.
pub(super) struct Deltas {
    pub(super) positions: Vec<DVec3>,
    pub(super) normals: Option<Vec<DVec3>>,
    pub(super) tangents: Option<Vec<DVec3>>,
}

/// Displacements, and deformation gradients computed over all visible primitives together, so that both sides
/// of a seam get the same normals.
pub(super) struct SurfaceGradients<'a> {
    triangles: &'a [[u32; 3]],
    by: &'a [DVec3],
    /// Gradients at rest of all visible vertices, computed on demand.
    gradients: OnceCell<Vec<Option<DMat3>>>,
}

impl<'a> SurfaceGradients<'a> {
    /// Stores the input; gradients are computed when first needed. `triangles`: triangles of the model. `by`:
    /// displacements of all points.
    pub(super) fn new(triangles: &'a [[u32; 3]], by: &'a [DVec3]) -> Self {
        Self { triangles, by, gradients: OnceCell::new() }
    }

    /// Gradients at the vertices of a primitive at rest; `None` if the primitive is not visible.
    fn of(&self, rig: &Rig<'_>, part: &RigPrimitive) -> Option<&[Option<DMat3>]> {
        part.slot?;
        let all = self.gradients.get_or_init(|| {
            let mut from = vec![DVec3::ZERO; rig.n_vertices];
            let mut triangles = Vec::with_capacity(self.triangles.len());
            for part in &rig.parts {
                let Some(slot) = part.slot.map(|slot| &rig.document.slots[slot]) else { continue };
                from[part.first..].iter_mut().zip(part.rest()).for_each(|(from, rest)| *from = rest);
                triangles.extend(&self.triangles[slot.triangles.clone()]);
            }
            let to: Vec<DVec3> = from.iter().zip(self.by).map(|(&from, &by)| from + by).collect();
            Surface::new(&from, &to, triangles).gradients(&from, &to)
        });
        Some(&all[part.first..part.first + part.local.len()])
    }
}

/// World positions of a primitive's vertices in one morph state, before and after the deformation.
struct State {
    from: Vec<DVec3>,
    to: Vec<DVec3>,
}

/// Normals and tangents of a primitive, as its accessors store them.
struct Directions {
    normals: Option<Vec<DVec3>>,
    tangents: Option<Vec<DVec3>>,
    handedness: Vec<f32>,
    /// Deltas of the normals and tangents of each morph target.
    of_targets: Vec<[Option<Vec<DVec3>>; 2]>,
}

impl Rig<'_> {
    /// Computes a primitive after the deformation; `None` if it does not change. `frame`: its skinning matrices after
    /// the deformation.
    pub(super) fn shape(
        &self,
        part: &RigPrimitive,
        turned: &SurfaceGradients<'_>,
        frame: &Frame,
    ) -> Result<Option<Shape>, GltfError> {
        let (n, by) = (part.local.len(), turned.by);
        let is_framed = |v: usize| frame.world(v) == part.frame.world(v);
        let mut is_kept: Vec<bool> =
            (0..n).map(|v| is_framed(v) && by[part.first + v] == DVec3::ZERO).collect();
        for target in &part.targets {
            for first in target.ends.iter().flatten() {
                for (k, &v) in target.moved.iter().enumerate() {
                    is_kept[v as usize] &= by[first + k] == DVec3::ZERO;
                }
            }
        }
        if is_kept.iter().all(|&kept| kept) {
            return Ok(None);
        }
        let rest = part.rest();
        let moved = |from: &[DVec3], first: usize| -> Vec<DVec3> {
            from.iter().enumerate().map(|(k, &p)| p + by[first + k]).collect()
        };
        let base = State { to: moved(&rest, part.first), from: rest };

        let (mut condition, mut back) = (0.0_f64, Vec::with_capacity(n));
        for v in 0..n {
            let world = frame.world(v);
            let inverse = world.inverse();
            let [a, b] = [world, inverse]
                .map(|m| DMat3::from_mat4(m).to_cols_array().into_iter().map(|x| x * x).sum::<f64>().sqrt());
            let of_vertex = if inverse.is_finite() { a * b / 3.0 } else { f64::INFINITY };
            condition = condition.max(of_vertex);
            back.push((of_vertex <= MAX_CONDITION).then_some(inverse));
        }
        let is_known: Vec<bool> = back.iter().map(Option::is_some).collect();
        let n_singular = is_known.iter().filter(|known| !**known).count();
        let inverse = |v: usize| back[v].unwrap_or(DMat4::IDENTITY);

        let mut positions: Vec<DVec3> =
            base.to.iter().enumerate().map(|(v, &p)| inverse(v).transform_point3(p)).collect();
        let mut targets: Vec<Deltas> = Vec::with_capacity(part.targets.len());
        for target in &part.targets {
            let mut deltas = vec![DVec3::ZERO; n];
            for (k, (&v, &delta)) in target.moved.iter().zip(&target.deltas).enumerate() {
                let v = v as usize;
                if is_kept[v] || back[v].is_none() {
                    deltas[v] = delta;
                } else {
                    let world = part.frame.world(v);
                    let end = |e: usize| {
                        let share = e as f64 - target.default;
                        let by = target.ends[e].map_or(by[part.first + v], |first| by[first + k]);
                        base.from[v] + world.transform_vector3(share * delta) + by
                    };
                    deltas[v] = inverse(v).transform_vector3(end(1) - end(0));
                }
                positions[v] -= target.default * deltas[v];
            }
            targets.push(Deltas { positions: deltas, normals: None, tangents: None });
        }
        for v in (0..n).filter(|&v| is_kept[v]) {
            positions[v] = part.local[v];
        }
        let surface = Surface::new(&base.from, &base.to, self.triangles(part, turned.triangles));
        if n_singular > 0 {
            let mut offsets: Vec<DVec3> = positions.iter().zip(&part.local).map(|(a, b)| *a - *b).collect();
            surface.fill_from_neighbours(&mut offsets, &is_known);
            for v in (0..n).filter(|&v| !is_known[v]) {
                positions[v] = part.local[v] + offsets[v];
            }
        }

        let mut shape = Shape { positions, normals: None, tangents: None, targets, condition, n_singular };
        if let Some(directions) = Directions::of(self, part)? {
            let own = || surface.gradients(&base.from, &base.to);
            let at_base = turned.of(self, part).map_or_else(own, <[_]>::to_vec);
            let resting =
                [0, 1].map(|kind| (0..n).map(|v| directions.at_rest(part, kind, v)).collect::<Vec<DVec3>>());
            let turn = |gradients: &[Option<DMat3>], at: &dyn Fn(usize, usize) -> DVec3| {
                (0..n)
                    .map(|v| {
                        let known = gradients[v].or((!is_framed(v)).then_some(DMat3::IDENTITY));
                        let (Some(gradient), Some(back)) = (known, back[v]) else {
                            return [0, 1].map(|kind| at(kind, v));
                        };
                        let [world, back] = [part.frame.world(v), back].map(DMat3::from_mat4);
                        let map = back * gradient * world;
                        let maps = [cofactor(back) * cofactor(gradient) * cofactor(world), map];
                        [0, 1].map(|kind| {
                            let before = at(kind, v);
                            (maps[kind] * before).normalize_or_zero() * before.length()
                        })
                    })
                    .collect::<Vec<[DVec3; 2]>>()
            };
            directions.turned(part, &mut shape, |target| {
                let Some((k, end, share)) = target else {
                    return turn(&at_base, &|kind, v| resting[kind][v]);
                };
                let of = &part.targets[k];
                let mut state = State { from: base.from.clone(), to: base.to.clone() };
                if let Some(first) = of.ends[end] {
                    for (i, &v) in of.moved.iter().enumerate() {
                        let v = v as usize;
                        state.from[v] += part.frame.world(v).transform_vector3(share * of.deltas[i]);
                        state.to[v] = state.from[v] + by[first + i];
                    }
                }
                let near = surface.gradients_near(&state.from, &state.to, &of.moved, &at_base);
                turn(&near, &|kind, v| resting[kind][v] + share * directions.added(k, kind, v))
            });
        }
        Ok(Some(shape))
    }
}

impl Rig<'_> {
    /// Normals of a primitive, as its accessor stores them.
    pub(super) fn normals(&self, part: &RigPrimitive) -> Result<Option<Vec<DVec3>>, GltfError> {
        Ok(Directions::of(self, part)?.and_then(|directions| directions.normals))
    }
}

impl Directions {
    fn of(rig: &Rig<'_>, part: &RigPrimitive) -> Result<Option<Self>, GltfError> {
        let primitive = part.primitive(rig.document);
        let n = part.local.len();
        let normals = attribute(primitive, Semantic::Normals)
            .map(|accessor| vectors(rig.document, accessor, "NORMAL"))
            .transpose()?
            .filter(|normals| normals.len() == n);
        let tangents = attribute(primitive, Semantic::Tangents)
            .map(|accessor| rig.document.source().floats::<4>(accessor, "TANGENT"))
            .transpose()?
            .filter(|tangents| tangents.len() == n);
        if normals.is_none() && tangents.is_none() {
            return Ok(None);
        }
        let read = |accessor: Option<u32>, what| {
            let read = accessor.map(|accessor| vectors(rig.document, accessor, what)).transpose();
            Ok::<_, GltfError>(read?.filter(|values| values.len() == n))
        };
        let mut of_targets = Vec::new();
        for target in primitive.targets.iter().flatten() {
            let number = |index: Option<::gltf::json::Index<_>>| index.map(|a| a.value() as u32);
            let normals = read(number(target.normals).filter(|_| normals.is_some()), "NORMAL")?;
            let tangents = read(number(target.tangents).filter(|_| tangents.is_some()), "TANGENT")?;
            of_targets.push([normals, tangents]);
        }
        let handedness = tangents.iter().flatten().map(|t| t[3]).collect();
        let vector = |t: &[f32; 4]| DVec3::new(t[0].into(), t[1].into(), t[2].into());
        let tangents = tangents.map(|tangents| tangents.iter().map(vector).collect());
        Ok(Some(Self { normals, tangents, handedness, of_targets }))
    }

    /// Normal (`kind` 0) or tangent (`kind` 1) of a vertex with all morph targets at their default weights.
    fn at_rest(&self, part: &RigPrimitive, kind: usize, v: usize) -> DVec3 {
        let own = [&self.normals, &self.tangents][kind].as_ref().map_or(DVec3::ZERO, |all| all[v]);
        part.targets.iter().enumerate().fold(own, |sum, (k, t)| {
            if t.default == 0.0 { sum } else { sum + t.default * self.added(k, kind, v) }
        })
    }

    fn added(&self, target: usize, kind: usize, v: usize) -> DVec3 {
        self.of_targets.get(target).and_then(|of| of[kind].as_ref()).map_or(DVec3::ZERO, |all| all[v])
    }

    /// Sets the normals and tangents of a shape and of its morph targets. `turn(None)` returns the normal and the
    /// tangent of each vertex with all targets at their default weights. `turn(Some((k, end, share)))` returns them
    /// with target k at weight `end`, 0 or 1: `share` times its deltas are added to the default state.
    fn turned(
        &self,
        part: &RigPrimitive,
        shape: &mut Shape,
        turn: impl Fn(Option<(usize, usize, f64)>) -> Vec<[DVec3; 2]>,
    ) {
        let at_rest = turn(None);
        let mut base = at_rest.clone();
        for (k, of) in self.of_targets.iter().enumerate() {
            if of.iter().all(Option::is_none) {
                continue;
            }
            let default = part.targets[k].default;
            // An end that equals the default state needs no evaluation.
            let [off, on] = [0, 1].map(|end| {
                let share = end as f64 - default;
                if share == 0.0 { at_rest.clone() } else { turn(Some((k, end, share))) }
            });
            for kind in [0, 1] {
                if of[kind].is_none() {
                    continue;
                }
                let deltas: Vec<DVec3> = on.iter().zip(&off).map(|(on, off)| on[kind] - off[kind]).collect();
                base.iter_mut().zip(&deltas).for_each(|(base, &delta)| base[kind] -= default * delta);
                let target = &mut shape.targets[k];
                *if kind == 0 { &mut target.normals } else { &mut target.tangents } = Some(deltas);
            }
        }
        let unit = |kind: usize| base.iter().map(move |b| b[kind].normalize_or_zero());
        shape.normals = self.normals.is_some().then(|| unit(0).collect());
        shape.tangents =
            self.tangents.is_some().then(|| unit(1).zip(self.handedness.iter().copied()).collect());
    }
}
