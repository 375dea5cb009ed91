//! 3DGS PLY files: logarithms of the scales, logarithm of the opacity's odds, rotation w, x, y, z, and spherical
//! harmonics by channel.

use cagework_core::splats::n_harmonics;
use glam::{DVec3, Quat, Vec3};

use super::{
    RawSplats, ReadSplats, Records, SplatError, SplatOrder, SplatsToWrite, band_0, color_of, log_odds,
    log_scale, packed, sigmoid,
};
use crate::order::{Budget, Expansion};
use crate::ply::POSITION;
use crate::ply::table::{Column, Element, Header, Kind, PlyError, Row, Writer, patch};
use crate::polygons::Encoding;

/// Properties of a splat, apart from its position and spherical harmonics. The rotation is w, x, y, z.
const COLOR: [&str; 3] = ["f_dc_0", "f_dc_1", "f_dc_2"];
const SHAPE: [&str; 8] = ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"];

impl From<PlyError> for SplatError {
    fn from(error: PlyError) -> Self {
        match error {
            PlyError::Count { name, count, needed, found, .. } if name == "vertex" => {
                Self::Count { count, needed, found }
            }
            other => Self::Damaged(other.to_string()),
        }
    }
}

/// Whether a PLY holds Gaussian splats, not a mesh or points.
pub(crate) fn is_splats(bytes: &[u8]) -> bool {
    let is_of_splats =
        |column: &Column| ["scale_0", "rot_0", "f_dc_0", "packed_position"].contains(&column.name.as_str());
    Header::parse(bytes).is_ok_and(|header| {
        header.element("vertex").is_some_and(|vertex| vertex.columns.iter().any(is_of_splats))
    })
}

/// Properties of a splat in the order in which files have them.
fn names(n_harmonics: usize) -> impl Iterator<Item = String> {
    let rest = (0..3 * n_harmonics).map(|k| format!("f_rest_{k}"));
    let named = |names: &'static [&str]| names.iter().map(|&name| name.to_owned());
    named(&POSITION).chain(named(&COLOR)).chain(rest).chain(named(&SHAPE))
}

/// Finds the columns of the properties [`names`].
fn columns(vertex: &Element) -> Result<Vec<usize>, SplatError> {
    let n = n_harmonics(packed::degree_of(vertex)?);
    let find = |name: String| {
        let missing = if name.starts_with("f_rest_") {
            SplatError::Damaged(format!("it has {} properties f_rest_*, but no {name}", 3 * n))
        } else {
            SplatError::Missing(name.clone())
        };
        vertex.column(&name).ok_or(missing)
    };
    names(n).map(find).collect()
}

/// Reads a file, using at most `memory_limit` bytes.
pub(crate) fn read(bytes: &[u8], memory_limit: u64, near: bool) -> Result<ReadSplats, SplatError> {
    let header = Header::read(bytes)?;
    let size = bytes.len() as u64;
    let mut budget = Budget::new(size, 2 * size, memory_limit, Expansion::SPLATS);
    let Some(vertex) = header.element("vertex") else { return Err(SplatError::Empty) };
    let (raw, records) = if vertex.column("packed_position").is_some() {
        (packed::read(bytes, &header, &mut budget)?, Records::New)
    } else {
        (read_table(bytes, &header, vertex, &mut budget)?, Records::Ply)
    };
    let mut read = raw.finish(near, records)?;
    let stray = header.stray.map(|line| format!("{line} is not a statement of a PLY header: ignored"));
    read.notices.extend(stray);
    Ok(read)
}

fn read_table(
    bytes: &[u8],
    header: &Header,
    vertex: &Element,
    budget: &mut Budget,
) -> Result<RawSplats, SplatError> {
    let columns = columns(vertex)?;
    let order =
        SplatOrder { count: vertex.count, degree: packed::degree_of(vertex)?, ..SplatOrder::default() };
    let mut raw = RawSplats::new(&order.permit(budget)?);
    let (mut rows, mut row) = (header.rows(bytes), Row::default());
    for element in &header.elements {
        for _ in 0..element.count {
            rows.read(element, &mut row)?;
            if element.name != "vertex" {
                continue;
            }
            let at = |slot: usize| row.numbers[columns[slot]];
            let vector = |slot: usize| Vec3::new(at(slot) as f32, at(slot + 1) as f32, at(slot + 2) as f32);
            raw.positions.push(DVec3::new(at(0), at(1), at(2)));
            raw.splats.colors.push(color_of(vector(3)));
            let shape = columns.len() - SHAPE.len();
            let n = (shape - 6) / 3;
            let channel = |slot: usize| at(slot) as f32;
            let harmonic = |k: usize| Vec3::from_array([0, n, 2 * n].map(|first| channel(6 + first + k)));
            raw.splats.harmonics.extend((0..n).map(harmonic));
            raw.splats.opacities.push(sigmoid(at(shape) as f32));
            raw.splats.scales.push(vector(shape + 1).map(f32::exp));
            let v = vector(shape + 5);
            raw.splats.rotations.push(Quat::from_xyzw(v.x, v.y, v.z, at(shape + 4) as f32));
        }
        if element.name == "vertex" {
            break;
        }
    }
    Ok(raw)
}

/// Numbers of a splat in the order of [`names`].
fn numbers(to_write: &SplatsToWrite<'_>, splat: usize) -> Vec<f64> {
    let splats = to_write.splats;
    let [x, y, z, w] = splats.rotations[splat].to_array();
    let harmonics = splats.harmonics_of(splat);
    let color = band_0(splats.colors[splat]).to_array();
    let scale = log_scale(splats.scales[splat]).to_array();
    let rest = (0..3).flat_map(|channel| harmonics.iter().map(move |coefficient| coefficient[channel]));
    let others = color.into_iter().chain(rest).chain([log_odds(splats.opacities[splat])]);
    let others = others.chain(scale).chain([w, x, y, z]).map(f64::from);
    to_write.position(splat).to_array().into_iter().chain(others).collect()
}

/// Writes splats into a copy of `file`, or as a new file. A copy keeps all other properties and elements, and those
/// that a deformation does not change: colours and opacities.
pub(crate) fn write(to_write: &SplatsToWrite<'_>, file: Option<&[u8]>) -> Vec<u8> {
    const READ_RULE: &str = "the file was read before";
    let Some(file) = file else { return write_new(to_write) };
    let header = Header::parse(file).expect(READ_RULE);
    let columns = columns(header.element("vertex").expect(READ_RULE)).expect(READ_RULE);
    let opacity = columns.len() - SHAPE.len();
    let change = |splat: usize, row: &mut [f64]| {
        if to_write.writes(splat) {
            let numbers = numbers(to_write, splat);
            let is_kept = |slot: usize| (3..6).contains(&slot) || slot == opacity;
            for slot in (0..columns.len()).filter(|&slot| !is_kept(slot)) {
                row[columns[slot]] = numbers[slot];
            }
        }
    };
    patch(file, "vertex", change).expect(READ_RULE)
}

fn write_new(to_write: &SplatsToWrite<'_>) -> Vec<u8> {
    let splats = to_write.splats;
    let wide = if to_write.origin == DVec3::ZERO { Kind::F32 } else { Kind::F64 };
    let column = |name: String| {
        let kind = if POSITION.contains(&name.as_str()) { wide } else { Kind::F32 };
        Column::number(name, kind)
    };
    let columns = names(n_harmonics(splats.degree)).map(column).collect();
    let vertex = Element { name: "vertex".into(), count: splats.len() as u64, columns };
    let mut writer = Writer::new(Encoding::LittleEndian, std::slice::from_ref(&vertex));
    for splat in 0..splats.len() {
        for (column, x) in vertex.columns.iter().zip(numbers(to_write, splat)) {
            writer.put(column.kind, x);
        }
        writer.end_row();
    }
    writer.bytes
}
