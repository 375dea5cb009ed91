//! Models to try: made by formula, so that they cost no download and belong to nobody else.
//!
//! Each is a signed distance function (smooth unions of a few round solids), meshed by surface nets and laid onto the
//! zero level; with a cage, prepared poses of that cage and a sentence on what to see. A few hundred milliseconds each.

mod clamp;
mod humanoid;
mod mesher;
mod rat;
mod sdf;
mod skeleton;
mod strider;

use glam::Vec3;
use serde::Serialize;

use crate::generate::{CageOptions, generate};
use cagework_core::mesh::{PolygonMesh, TriMesh};
use cagework_core::progress::Silent;
use cagework_core::skin::Rig;

use sdf::Body;

/// What can be built, and what to look at in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct SampleInfo {
    /// Name for programs: lower case, unique.
    pub id: &'static str,
    /// Name for people.
    pub label: &'static str,
    /// What there is to see.
    pub sentence: &'static str,
}

/// A built sample.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Its label.
    pub name: String,
    /// The model: y is up, z is forward, about two units long. Closed, counter-clockwise seen from outside.
    pub mesh: TriMesh,
    /// Colour of every vertex: sRGB and opacity, 0 to 255. `[n_vertices]`
    pub colours: Vec<[u8; 4]>,
    /// A cage that encloses it.
    pub cage: PolygonMesh,
    /// Prepared poses: name and positions of the cage's vertices. `[n_cage]` each
    pub poses: Vec<(String, Vec<Vec3>)>,
    /// Its skeleton, if it has one, with a clip.
    pub rig: Option<Rig>,
}

const SAMPLES: [SampleInfo; 4] = [rat::INFO, humanoid::INFO, clamp::INFO, strider::INFO];

/// The samples there are, the one to begin with first.
#[must_use]
pub fn all() -> &'static [SampleInfo] {
    &SAMPLES
}

/// Builds a sample; `None` if there is none with this id.
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
        CageRecipe::Made(cage) => cage,
        CageRecipe::Generate(options) => {
            let made = generate(&mesh.positions, &mesh.triangles, &options, &Silent);
            made.expect("the options and the model are constants, and tests make every cage")
                .cage
                .to_polygon_mesh()
        }
    };
    let posed = |(name, pose): &(&str, Pose)| ((*name).to_owned(), pose(&cage.positions));
    let mut poses: Vec<_> = recipe.poses.iter().map(posed).collect();
    poses.push((recipe.pulled.name.to_owned(), recipe.pulled.pose(&cage.positions)));
    let rig = recipe.rig.map(|rig| rig(&mesh.positions));
    Some(Sample { name: info.label.to_owned(), mesh, colours, cage, poses, rig })
}

/// How a cage comes about.
enum CageRecipe {
    /// Drawn by hand.
    Made(PolygonMesh),
    /// Generated around the mesh.
    Generate(CageOptions),
}

/// What a sample is made of.
struct Recipe {
    body: Body,
    /// Edge of a meshing cell, object units.
    cell: f32,
    cage: CageRecipe,
    poses: Vec<(&'static str, Pose)>,
    /// The last pose.
    pulled: Pulled,
    /// A rig for the mesh's vertices.
    rig: Option<fn(&[Vec3]) -> Rig>,
}

/// A pose made by one pull. It is kept as bytes: a pull needs a bind, which would keep a visitor waiting.
struct Pulled {
    name: &'static str,
    /// The model's vertex nearest to this point is taken hold of, object units.
    #[cfg_attr(not(test), expect(dead_code, reason = "the test that makes the bytes pulls"))]
    at: Vec3,
    /// How far it is pulled, object units.
    #[cfg_attr(not(test), expect(dead_code, reason = "the test that makes the bytes pulls"))]
    by: Vec3,
    /// Offsets of the cage's vertices, i16, little endian, in [`PULLED_UNIT`]. `[n_cage, 3]`
    bytes: &'static [u8],
}

/// Object units in a unit of stored poses.
const PULLED_UNIT: f32 = 1e-4;

impl Pulled {
    fn pose(&self, rest: &[Vec3]) -> Vec<Vec3> {
        let numbers =
            self.bytes.as_chunks().0.iter().map(|&b| PULLED_UNIT * f32::from(i16::from_le_bytes(b)));
        let numbers: Vec<f32> = numbers.collect();
        rest.iter().zip(numbers.as_chunks().0).map(|(&p, &by)| p + Vec3::from_array(by)).collect()
    }
}

/// From the rest positions of a cage to posed ones.
type Pose = Box<dyn Fn(&[Vec3]) -> Vec<Vec3>>;

#[cfg(test)]
mod tests;
