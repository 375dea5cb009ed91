//! Gaussian splats in glTF: point primitives with the extension KHR_gaussian_splatting. Scales and opacities are
//! linear, rotations x, y, z, w.

use cagework_core::color::linear_from_srgb;
use cagework_core::splats::{decompose, n_harmonics, rotate_harmonics, turn_of};
use glam::{DMat3, DVec3, Mat3, Quat, Vec3};
use serde_json::{Value, json};

use super::accessor::{Source, count};
use super::container::glb_of;
use super::size::MAX_PRIMITIVES;
use super::{GltfError, Headers, SPLATS_EXTENSION};
use crate::error::WriteError;
use crate::order::{Budget, Expansion};
use crate::splats::{RawSplats, SplatError, SplatOrder, SplatsToWrite, band_0, color_of, unit_byte};

/// Colour space of 3DGS captures.
const SRGB: &str = "srgb_rec709_display";
/// Colour space whose numbers are linear.
pub(crate) const LINEAR: &str = "lin_rec709_display";
/// Limit on the splats of all nodes; or [`SPLATS_PER_BYTE`] per byte of the document, if that is more.
const MAX_SPLATS: u64 = 1 << 20;
const SPLATS_PER_BYTE: u64 = 1;
const FLOAT: u32 = 5126;
const UNSIGNED_BYTE: u32 = 5121;
const ARRAY_BUFFER: u32 = 34962;

/// Splats of one primitive: a transform to world space and the accessors of its attributes.
struct SplatPrimitive<'a> {
    world: glam::DMat4,
    count: u64,
    attributes: &'a Value,
    degree: u8,
}

fn harmonic(degree: u8, coefficient: usize) -> String {
    format!("{SPLATS_EXTENSION}:SH_DEGREE_{degree}_COEF_{coefficient}")
}

/// Reads the splats of the scene, and their colour space. `None` if it has triangles or no splats.
pub(crate) fn read(headers: &Headers, memory_limit: u64) -> Result<Option<(RawSplats, String)>, GltfError> {
    let mut spaces = Vec::new();
    let (document, held) = (&headers.loaded, headers.loaded.bytes);
    let mut parts = Vec::new();
    for instance in &headers.instances {
        for (p, primitive) in document.root.meshes[instance.mesh as usize].primitives.iter().enumerate() {
            if super::geometry::surface(primitive).is_some() {
                return Ok(None);
            }
            let json = &document.json["meshes"][instance.mesh as usize]["primitives"][p];
            let extension = &json["extensions"][SPLATS_EXTENSION];
            if !extension.is_object() {
                continue;
            }
            if let Some(inner) = extension["extensions"].as_object().and_then(|all| all.keys().next()) {
                let problem = format!(
                    "its splats use {}, which is not supported: export them as .ply or .spz instead",
                    crate::shown::shown(inner)
                );
                return Err(SplatError::Unsupported(problem).into());
            }
            spaces.push(extension["colorSpace"].as_str().unwrap_or(SRGB));
            let attributes = &json["attributes"];
            let has = |degree: u8| {
                (0..2 * usize::from(degree) + 1).all(|k| attributes.get(harmonic(degree, k)).is_some())
            };
            let degree = (1..=3).take_while(|&degree| has(degree)).last().unwrap_or(0);
            let count = count(&document.root, accessor(attributes, "POSITION")?)?;
            parts.push(SplatPrimitive { world: instance.world, count, attributes, degree });
        }
    }
    let Some(degree) = parts.iter().map(|part| part.degree).max() else { return Ok(None) };
    let count = parts.iter().map(|part| part.count).fold(0, u64::saturating_add);
    // The size of the file does not limit this count: several nodes can show the same splats, and accessors need no
    // data.
    let most = MAX_SPLATS.max(held.saturating_mul(SPLATS_PER_BYTE));
    if spaces.iter().any(|space| *space != spaces[0]) {
        let problem = "its splats have different colour spaces: export them as .ply or .spz instead";
        return Err(SplatError::Unsupported(problem.into()).into());
    }
    if count == 0 {
        return Err(SplatError::Empty.into());
    }
    let counts = vec![
        ("primitives of all nodes", parts.len() as u64, MAX_PRIMITIVES),
        ("splats of all nodes", count, most),
    ];
    let mut budget = Budget::new(held, held, memory_limit, Expansion::GEOMETRY);
    let permit = budget.permit(SplatOrder { counts, count, degree, unpacked: 0, window: 0 })?;
    let source = Source::new(&document.root, &document.buffers, &permit);
    let mut raw = RawSplats::new(&permit);
    for part in &parts {
        part.read(source, &mut raw)?;
    }
    Ok(Some((raw, spaces[0].to_owned())))
}

fn accessor(attributes: &Value, name: &str) -> Result<u32, GltfError> {
    let number = attributes[name].as_u64().and_then(|number| u32::try_from(number).ok());
    number.ok_or_else(|| SplatError::Damaged(format!("its splats have no attribute {name}")).into())
}

impl SplatPrimitive<'_> {
    fn floats<const N: usize>(&self, source: Source<'_>, name: &str) -> Result<Vec<[f32; N]>, GltfError> {
        let accessor = accessor(self.attributes, name)?;
        let values = source.floats::<N>(accessor, name)?;
        if values.len() as u64 == self.count {
            return Ok(values);
        }
        let (count, what) = (values.len() as u64, name.to_owned());
        Err(GltfError::Count { accessor, what, count, expected: self.count, of: "splats" })
    }

    fn read(&self, source: Source<'_>, raw: &mut RawSplats) -> Result<(), GltfError> {
        let of = |name: &str| format!("{SPLATS_EXTENSION}:{name}");
        let first = raw.positions.len();
        let positions = self.floats::<3>(source, "POSITION")?;
        raw.positions
            .extend(positions.iter().map(|&p| self.world.transform_point3(Vec3::from(p).as_dvec3())));
        let splats = &mut raw.splats;
        splats.scales.extend(self.floats::<3>(source, &of("SCALE"))?.into_iter().map(Vec3::from));
        splats.rotations.extend(self.floats::<4>(source, &of("ROTATION"))?.into_iter().map(Quat::from_array));
        splats.opacities.extend(self.floats::<1>(source, &of("OPACITY"))?.as_flattened());
        let colors = self.floats::<3>(source, &harmonic(0, 0))?;
        splats.colors.extend(colors.into_iter().map(|c| color_of(c.into())));
        let n = n_harmonics(splats.degree);
        splats.harmonics.resize(n * raw.positions.len(), Vec3::ZERO);
        for degree in 1..=self.degree {
            for k in 0..2 * usize::from(degree) + 1 {
                let values = self.floats::<3>(source, &harmonic(degree, k))?;
                for (value, of_splat) in
                    values.into_iter().zip(splats.harmonics[n * first..].chunks_exact_mut(n))
                {
                    of_splat[n_harmonics(degree - 1) + k] = value.into();
                }
            }
        }
        let linear = DMat3::from_mat4(self.world).as_mat3();
        if linear != Mat3::IDENTITY {
            let turn = turn_of(linear);
            for splat in first..raw.positions.len() {
                let rotation = splats.rotations[splat];
                if !rotation.is_finite() || rotation.length_squared() == 0.0 {
                    continue;
                }
                splats.rotations[splat] = rotation.normalize();
                (splats.scales[splat], splats.rotations[splat]) = decompose(linear * splats.axes(splat));
                rotate_harmonics(turn, &mut splats.harmonics[splat * n..][..n]);
            }
        }
        Ok(())
    }
}

/// Writes splats as a new GLB. `color_space`: colour space of the file that the splats come from, if it is a glTF.
///
/// # Errors
/// [`WriteError::TooLarge`] above 4 GiB.
pub(crate) fn write(to_write: &SplatsToWrite<'_>, color_space: Option<&str>) -> Result<Vec<u8>, WriteError> {
    let color_space = color_space.unwrap_or(SRGB);
    let SplatsToWrite { splats, origin, .. } = *to_write;
    let n = splats.len();
    let mut glb =
        Builder { n, bin: Vec::new(), views: Vec::new(), accessors: Vec::new(), attributes: json!({}) };
    let bytes = (n as u64) * (64 + 12 * n_harmonics(splats.degree) as u64);
    if bytes > u64::from(u32::MAX) - (1 << 20) {
        return Err(WriteError::TooLarge { bytes });
    }
    glb.floats("POSITION", splats.positions.iter().map(Vec3::to_array));
    let bounds = cagework_core::Bounds::around(&splats.positions);
    let [min, max] = bounds.map_or([[0.0; 3]; 2], |b| [b.min.to_array(), b.max.to_array()]);
    (glb.accessors[0]["min"], glb.accessors[0]["max"]) = (json!(min), json!(max));
    let of = |name: &str| format!("{SPLATS_EXTENSION}:{name}");
    glb.floats(&of("ROTATION"), splats.rotations.iter().map(Quat::to_array));
    glb.floats(&of("SCALE"), splats.scales.iter().map(Vec3::to_array));
    glb.floats(&of("OPACITY"), splats.opacities.iter().map(|&x| [x]));
    glb.floats(&harmonic(0, 0), splats.colors.iter().map(|&c| band_0(c).to_array()));
    for degree in 1..=splats.degree {
        for k in 0..2 * usize::from(degree) + 1 {
            let at = n_harmonics(degree - 1) + k;
            glb.floats(&harmonic(degree, k), (0..n).map(|s| splats.harmonics_of(s)[at].to_array()));
        }
    }
    // Colours for programs that draw the splats as points. COLOR_0 is linear (glTF 2.0, section 3.9.2).
    let color = |s: usize| {
        let color = splats.colors[s];
        let linear = if color_space == SRGB { color.map(linear_from_srgb) } else { color };
        linear.extend(splats.opacities[s]).to_array().map(unit_byte)
    };
    glb.push("COLOR_0", (0..n).flat_map(color).collect(), (UNSIGNED_BYTE, "VEC4"));
    glb.accessors[glb.views.len() - 1]["normalized"] = true.into();
    let mut node = json!({ "mesh": 0 });
    if origin != DVec3::ZERO {
        node["translation"] = json!(origin.as_vec3().to_array());
    }
    let json = json!({
        "asset": { "version": "2.0", "generator": "Cagework" },
        "extensionsUsed": [SPLATS_EXTENSION],
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [node],
        "meshes": [{ "primitives": [{
            "mode": 0,
            "attributes": glb.attributes,
            "extensions": { SPLATS_EXTENSION: { "kernel": "ellipse", "colorSpace": color_space } },
        }] }],
        "accessors": glb.accessors,
        "bufferViews": glb.views,
        "buffers": [{ "byteLength": glb.bin.len() }],
    });
    Ok(glb_of(&json, &glb.bin)?)
}

/// Builds a GLB from arrays, each of which gets an accessor.
struct Builder {
    /// Number of splats.
    n: usize,
    bin: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    attributes: Value,
}

impl Builder {
    fn floats<const N: usize>(&mut self, name: &str, values: impl Iterator<Item = [f32; N]>) {
        let bytes = values.flat_map(|value| value.map(f32::to_le_bytes)).flatten().collect();
        self.push(name, bytes, (FLOAT, ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1]));
    }

    fn push(&mut self, name: &str, bytes: Vec<u8>, (component, kind): (u32, &str)) {
        self.attributes[name] = self.accessors.len().into();
        let view = self.views.len();
        self.accessors
            .push(json!({ "bufferView": view, "componentType": component, "count": self.n, "type": kind }));
        let (start, length) = (self.bin.len(), bytes.len());
        self.views
            .push(json!({ "buffer": 0, "byteOffset": start, "byteLength": length, "target": ARRAY_BUFFER }));
        self.bin.extend(bytes);
    }
}
