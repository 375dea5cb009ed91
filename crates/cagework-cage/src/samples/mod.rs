//! Built-in sample models, made by formula: no download and no third-party licence.
//!
//! Each model is the zero level of a signed distance function, a smooth union of a few round solids. Surface nets mesh
//! it, and the vertices are projected onto the zero level. A sample also has a cage and poses of this cage. Building a
//! sample takes a few hundred milliseconds.

mod clamp;
mod humanoid;
mod knot;
mod mesher;
mod rat;
mod sdf;
mod skeleton;
mod strider;

use glam::Vec3;
use serde::Serialize;

use crate::generate::{CageOptions, generate};
use cagework_core::mesh::{PolygonMesh, TriMesh};
use cagework_core::progress::NoProgress;
use cagework_core::skin::Rig;

pub use knot::knot;
use sdf::Body;

/// Identifier and name of a sample, known without building it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct SampleInfo {
    /// Identifier: lower case, unique.
    pub id: &'static str,
    /// Name that users see.
    pub label: &'static str,
}

/// A sample with its mesh, cage and poses.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Name that users see.
    pub name: String,
    /// The model: y is up, z is forward, about two units long. Closed, counter-clockwise seen from outside.
    pub mesh: TriMesh,
    /// Vertex colours: sRGB and opacity, 0 to 255. `[n_vertices]`
    pub colours: Vec<[u8; 4]>,
    /// A cage that encloses the model.
    pub cage: PolygonMesh,
    /// Named poses: positions of the cage's vertices, `[n_cage]` each.
    pub poses: Vec<(String, Vec<Vec3>)>,
    /// Skeleton with an animation clip, if the sample has one.
    pub rig: Option<Rig>,
    /// Vertex of the model to pull first. The sample's last pose was made by pulling this vertex.
    pub grip: u32,
}

const SAMPLES: [SampleInfo; 4] = [rat::INFO, humanoid::INFO, clamp::INFO, strider::INFO];

/// Lists all samples; the first one is the default.
#[must_use]
pub fn all() -> &'static [SampleInfo] {
    &SAMPLES
}

/// Builds a sample; `None` if the identifier is unknown.
#[must_use]
pub fn build(id: &str) -> Option<Sample> {
    let recipe = match id {
        "rat" => rat::recipe(),
        "humanoid" => humanoid::recipe(),
        "clamp" => clamp::recipe(),
        "strider" => strider::recipe(),
        _ => return None,
    };
    let info = SAMPLES.iter().find(|info| info.id == id)?;
    let (mesh, colours) = mesher::mesh(&recipe.body, recipe.cell);
    let cage = match recipe.cage {
        CageRecipe::Mesh(cage) => cage,
        CageRecipe::Generate(options) => {
            let made = generate(&mesh.positions, &mesh.triangles, &options, &NoProgress);
            made.expect("options and model are constants, and tests build every cage").cage.to_polygon_mesh()
        }
    };
    let posed = |(name, pose): &(&str, PoseFunction)| ((*name).to_owned(), pose(&cage.positions));
    let mut poses: Vec<_> = recipe.poses.iter().map(posed).collect();
    poses.push((recipe.pulled.name.to_owned(), recipe.pulled.pose(&cage.positions)));
    let rig = recipe.rig.map(|rig| rig(&mesh.positions));
    let away = |v: &u32| mesh.positions[*v as usize].distance(recipe.pulled.at);
    let grip = (0..mesh.positions.len() as u32).min_by(|a, b| away(a).total_cmp(&away(b)))?;
    Some(Sample { name: info.label.to_owned(), mesh, colours, cage, poses, rig, grip })
}

enum CageRecipe {
    /// A mesh modelled by hand.
    Mesh(PolygonMesh),
    /// Options of a cage that is generated around the model.
    Generate(CageOptions),
}

struct Recipe {
    body: Body,
    /// Edge of a meshing cell, object units.
    cell: f32,
    cage: CageRecipe,
    poses: Vec<(&'static str, PoseFunction)>,
    pulled: PulledPose,
    rig: Option<fn(&[Vec3]) -> Rig>,
}

/// A pose made by one pull of the model. It is stored as bytes, because computing it takes a bind of the model.
struct PulledPose {
    name: &'static str,
    /// Point whose nearest vertex of the model is grabbed, object units.
    at: Vec3,
    /// Displacement of the grab, object units.
    #[cfg_attr(not(test), expect(dead_code, reason = "only the test that makes the bytes pulls"))]
    by: Vec3,
    /// Offsets of the cage's vertices, little-endian i16 in units of [`PULLED_UNIT`]. `[n_cage, 3]`
    bytes: &'static [u8],
}

/// Unit of stored offsets, object units.
const PULLED_UNIT: f32 = 1e-4;

impl PulledPose {
    fn pose(&self, rest: &[Vec3]) -> Vec<Vec3> {
        let numbers =
            self.bytes.as_chunks().0.iter().map(|&b| PULLED_UNIT * f32::from(i16::from_le_bytes(b)));
        let numbers: Vec<f32> = numbers.collect();
        rest.iter().zip(numbers.as_chunks().0).map(|(&p, &by)| p + Vec3::from_array(by)).collect()
    }
}

/// Function that maps the rest positions of a cage to posed positions.
type PoseFunction = Box<dyn Fn(&[Vec3]) -> Vec<Vec3>>;

#[cfg(test)]
mod tests;
