//! The conversion, in order.

use cagework_core::words::counted;
use ufbx::{
    CoordinateAxes, CoordinateAxis, FileFormat, GeometryTransformHandling, IndexErrorHandling,
    InheritModeHandling, LoadOpts, Scene, SceneRoot, SpaceConversion, WarningType,
};

use crate::document::Document;
use crate::limits::{FbxError, MAX_DEPTH, Shares};
use crate::{bind_pose, clip, material, mesh, node};

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
    let saved = bind_pose::apply(&scene, &mut nodes);
    let morphed = mesh::write(&scene, &uv_sets, shares, &mut nodes, &mut document, &mut notices)?;
    clip::write(&scene, &nodes, &morphed, &saved, shares, &mut document)?;
    if !saved.is_empty() {
        notices.push(bind_pose::NOTICE.to_owned());
    }
    nodes.finish(&mut document)?;
    notices.extend(left_out(&scene));
    Ok(Converted { glb: document.finish()?, notices })
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
        // Additional nodes only for scales that are animated or not uniform.
        inherit_mode_handling: InheritModeHandling::Compensate,
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
