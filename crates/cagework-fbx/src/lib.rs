//! Converts FBX files to GLB.
//!
//! The library `ufbx` parses the file and converts units and axes. Pivots, pre-rotations, geometry transforms and
//! inherited scales become transforms of nodes, some of them additional nodes. This crate writes what glTF can express,
//! and lists the rest in notices.

mod clip;
mod document;
#[cfg(target_family = "wasm")]
mod libc;
mod material;
mod mesh;
mod node;
mod skin;
#[cfg(target_family = "wasm")]
mod web;

use cagework_core::words::{counted, size_rounded_down};
use thiserror::Error;
use ufbx::{
    AllocatorOpts, CoordinateAxes, CoordinateAxis, ErrorType, FileFormat, GeometryTransformHandling,
    IndexErrorHandling, InheritModeHandling, LoadOpts, Scene, SceneRoot, SpaceConversion, WarningType,
};

use document::Document;
#[cfg(target_family = "wasm")]
pub use web::ConvertedFbx;

/// Limit on the depth of the tree of nodes. Rigs have less than 100 levels.
const MAX_DEPTH: u32 = 1000;
/// Largest memory limit that is passed to `ufbx`, bytes. Rust's allocator accepts sizes up to half the address space.
const MAX_MEMORY: u64 = isize::MAX as u64 / 2;

/// Error of converting an FBX file.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum FbxError {
    /// The file is damaged or too old.
    #[error("not readable as FBX: {0}. Export it again, as FBX 7.4 or newer")]
    Damaged(String),
    /// The contents exceed the memory limit.
    #[error(
        "its contents need more than the limit of {} of memory: use a smaller model or raise the limit",
        size_rounded_down(*.limit)
    )]
    Memory {
        /// Limit in bytes.
        limit: u64,
    },
    /// The tree of nodes is too deep.
    #[error("its nodes are nested more than {MAX_DEPTH} levels deep, the limit: flatten its hierarchy")]
    Depth,
    /// There are too many items of one kind.
    #[error("it has more than {limit} {what}, the limit: use a smaller model")]
    TooMany {
        /// Kind of the items.
        what: &'static str,
        /// Limit on their number.
        limit: usize,
    },
    /// A control point is NaN or infinite.
    #[error("control point {point} of mesh '{mesh}' is not finite: repair the mesh and export it again")]
    NotFinite {
        /// Name of the mesh.
        mesh: String,
        /// Index of the control point, from 0.
        point: usize,
    },
}

/// A converted file.
#[derive(Clone, Debug)]
pub struct Converted {
    /// The GLB. Images that are not embedded are references to files beside the FBX file.
    pub glb: Vec<u8>,
    /// What was not converted, one sentence each.
    pub notices: Vec<String>,
}

/// Converts an FBX file, binary or text, to a GLB in metres with the y axis up.
///
/// `memory_limit`: limit on the memory of the parsed file and of the GLB together, bytes.
///
/// # Errors
/// [`FbxError`] if the file is damaged or exceeds a limit.
pub fn convert(fbx: &[u8], memory_limit: u64) -> Result<Converted, FbxError> {
    let shares = Shares::of(memory_limit);
    let scene = load(fbx, shares)?;
    let mut document = Document::new(shares.glb, memory_limit);
    let mut notices = warnings(&scene);
    let uv_sets = material::write(&scene, &mut document, &mut notices)?;
    let mut nodes = node::Nodes::new(&scene, &mut notices);
    let morphed = mesh::write(&scene, &uv_sets, shares, &mut nodes, &mut document, &mut notices)?;
    clip::write(&scene, &nodes, &morphed, shares, &mut document)?;
    nodes.finish(&mut document)?;
    notices.extend(left_out(&scene));
    Ok(Converted { glb: document.finish()?, notices })
}

/// Parts of the memory limit, bytes. `ufbx` limits its temporary and its resulting memory separately.
#[derive(Clone, Copy)]
struct Shares {
    parser: usize,
    glb: u64,
    limit: u64,
}

impl Shares {
    /// A quarter each for temporary memory, for the parsed file and for the clip that is being baked, and for the GLB. The
    /// GLB exists twice when it is written, and then temporary memory is free.
    fn of(limit: u64) -> Self {
        let quarter = limit.min(MAX_MEMORY) / 4;
        Self { parser: quarter as usize, glb: quarter, limit }
    }

    fn allocator(self) -> AllocatorOpts {
        AllocatorOpts { memory_limit: self.parser, ..AllocatorOpts::default() }
    }

    fn fault(self, error: &ufbx::Error) -> FbxError {
        match error.type_ {
            ErrorType::MemoryLimit | ErrorType::AllocationLimit | ErrorType::OutOfMemory => {
                FbxError::Memory { limit: self.limit }
            }
            ErrorType::NodeDepthLimit => FbxError::Depth,
            _ => FbxError::Damaged(error.description.to_lowercase()),
        }
    }
}

fn load(fbx: &[u8], shares: Shares) -> Result<SceneRoot, FbxError> {
    let options = LoadOpts {
        temp_allocator: shares.allocator(),
        result_allocator: shares.allocator(),
        clean_skin_weights: true,
        use_blender_pbr_material: true,
        index_error_handling: IndexErrorHandling::Clamp,
        generate_missing_normals: true,
        node_depth_limit: MAX_DEPTH,
        geometry_transform_handling: GeometryTransformHandling::HelperNodes,
        inherit_mode_handling: InheritModeHandling::HelperNodes,
        space_conversion: SpaceConversion::ModifyGeometry,
        target_axes: CoordinateAxes {
            right: CoordinateAxis::PositiveX,
            up: CoordinateAxis::PositiveY,
            front: CoordinateAxis::PositiveZ,
        },
        target_unit_meters: 1.0,
        path_separator: b'/',
        // Other formats that the library reads are not tried.
        file_format: FileFormat::Fbx,
        ..LoadOpts::default()
    };
    ufbx::load_memory(fbx, options).map_err(|error| shares.fault(&error))
}

/// Notices about damage that the parser repaired.
fn warnings(scene: &Scene) -> Vec<String> {
    let harmless = [
        WarningType::MissingExternalFile,
        WarningType::BadUnicode,
        WarningType::DuplicateConnection,
        WarningType::UnsupportedVersion,
        WarningType::EmptyFaceRemoved,
    ];
    let all = scene.metadata.warnings.iter().filter(|warning| !harmless.contains(&warning.type_));
    all.map(|warning| {
        format!("the FBX file is damaged, and opened as far as possible: {}", &*warning.description)
    })
    .collect()
}

/// Notices about elements that glTF, or this converter, does not express.
fn left_out(scene: &Scene) -> Vec<String> {
    let caches = scene.cache_deformers.len();
    let curves = scene.line_curves.len() + scene.nurbs_curves.len();
    let surfaces = scene.nurbs_surfaces.len() + scene.nurbs_trim_surfaces.len();
    let subdivided = scene.meshes.iter().filter(|mesh| mesh.subdivision_display_mode as u32 > 0).count();
    let all = [
        (scene.constraints.len(), "constraint is", "constraints are"),
        (surfaces, "NURBS surface is", "NURBS surfaces are"),
        (curves, "curve is", "curves are"),
        (caches, "vertex cache is", "vertex caches are"),
        (subdivided, "subdivision of a mesh is", "subdivisions of meshes are"),
    ];
    let some = all.into_iter().filter(|(n, ..)| *n > 0);
    some.map(|(n, one, many)| format!("{} not converted from FBX", counted(n, one, many))).collect()
}
