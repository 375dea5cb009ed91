//! Reads and writes PLY files of meshes and points: vertices with colours, and polygons.

pub(crate) mod table;

use glam::DVec3;

use crate::polygons::{Polygons, PolygonsError, Shape, color_bytes};
use crate::shown::{MAX_NAME_CHARS, shown_start, without_byte_order_mark};
use table::{Column, Element, Header, Kind, NO_INDEX, PlyError, Row, Writer};

// Names of the vertex properties that are read.
pub(crate) const POSITION: [&str; 3] = ["x", "y", "z"];
const NORMAL: [&str; 3] = ["nx", "ny", "nz"];
const COLOR: [&str; 3] = ["red", "green", "blue"];
/// Names of the property that lists the vertices of a face. Files use either name.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

impl From<PlyError> for PolygonsError {
    fn from(error: PlyError) -> Self {
        match error {
            PlyError::Syntax(problem) => Self::Syntax(problem),
            PlyError::Count { name, count, bytes, .. } => Self::Count { name, count, bytes },
        }
    }
}

/// All faces or triangle strips of a file in two lists. A list per face would take four times the memory.
#[derive(Default)]
struct Faces {
    corners: Vec<u32>,
    /// End of each face in `corners`.
    ends: Vec<usize>,
    /// The first face with a corner that is not a valid index, and that corner as written.
    odd: Option<(usize, f64)>,
}

impl Faces {
    fn iter(&self) -> impl Iterator<Item = &[u32]> {
        let starts = std::iter::once(&0).chain(&self.ends);
        starts.zip(&self.ends).map(|(&start, &end)| &self.corners[start..end])
    }
}

/// Converts a colour channel to a byte, from bytes, 16-bit integers or floats in 0 to 1.
fn color(kind: Kind, x: f64) -> u8 {
    match kind {
        Kind::U16 => (x as u16 >> 8) as u8,
        Kind::F32 | Kind::F64 => (x * 255.0).round() as u8,
        _ => x as u8,
    }
}

/// Iterates over the triangles of strips, which are separated by [`NO_INDEX`]. Every second triangle of a strip has
/// the opposite orientation.
fn unstrip(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    let strips = corners.split(|&v| v == NO_INDEX);
    let triangles = strips.flat_map(|strip| strip.windows(3).enumerate());
    // Triangles with a repeated corner only join the parts of a strip.
    triangles
        .map(|(k, of)| [of[0], of[1 + k % 2], of[2 - k % 2]])
        .filter(|&[a, b, c]| a != b && b != c && c != a)
}

/// Whether the first line is `ply`.
pub(crate) fn is_ply(bytes: &[u8]) -> bool {
    let bytes = without_byte_order_mark(bytes);
    bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r")
}

/// Reads a file using at most `memory_limit` bytes. `near`: store positions relative to an origin near them.
pub(crate) fn read(bytes: &[u8], memory_limit: u64, near: bool) -> Result<Polygons, PolygonsError> {
    let header = Header::read(bytes)?;
    let (n_bytes, n_vertices) = (bytes.len() as u64, header.count("vertex"));
    // All vertices are in memory at the same time. A corner takes at least one byte.
    let corners = if header.count("face") + header.count("tristrips") > 0 { n_bytes } else { 0 };
    let held = n_bytes + n_vertices * size_of::<DVec3>() as u64;
    Polygons::check_memory(held, n_vertices, corners / 2, memory_limit)?;
    let mut read = Polygons { face_starts: vec![0], encoding: header.encoding, ..Polygons::default() };
    if let Some(line) = &header.stray {
        read.notices.push(format!("{line} is not a statement of a PLY header: ignored"));
    }
    let (mut rows, mut row) = (header.rows(bytes), Row::default());
    let mut left_out: Vec<&str> = Vec::new();
    // Faces may precede their vertices.
    let (mut faces, mut strips) = (Faces::default(), Faces::default());
    for element in &header.elements {
        let names = || element.columns.iter().map(|column| column.name.as_str());
        let is_strip = ["face", "tristrips"].contains(&element.name.as_str());
        let is_list = |of: &Column| is_strip && of.counter.is_some() && CORNERS.contains(&of.name.as_str());
        row.list = element.columns.iter().position(is_list);
        match element.name.as_str() {
            "vertex" => {
                let place = element.columns(POSITION);
                let place =
                    place.map_err(|_| PolygonsError::Syntax("its vertices have no x, y or z".into()))?;
                let colors = element.columns(COLOR).ok();
                let mut places = Vec::with_capacity(element.count as usize);
                for _ in 0..element.count {
                    rows.read(element, &mut row)?;
                    places.push(DVec3::from_array(place.map(|k| row.numbers[k])));
                    let channel = |k: usize| color(element.columns[k].kind, row.numbers[k]);
                    read.colors.extend(colors.map(|of| of.map(|k| f32::from(channel(k)) / 255.0)));
                }
                read.place(&places, near);
                read.has_normals = element.columns(NORMAL).is_ok();
                let known = [POSITION, NORMAL, COLOR].concat();
                left_out.extend(names().filter(|name| !known.contains(name)));
            }
            kind => {
                let mut all = Faces::default();
                for k in 0..element.count as usize {
                    rows.read(element, &mut row)?;
                    all.odd = all.odd.or(row.odd.map(|odd| (k, odd)));
                    all.ends.push(row.items.len());
                }
                all.corners = std::mem::take(&mut row.items);
                match kind {
                    "face" => faces = all,
                    "tristrips" => strips = all,
                    _ => {
                        left_out.push(&element.name);
                        continue;
                    }
                }
                left_out.extend(names().filter(|name| !CORNERS.contains(name)));
            }
        }
    }
    let n_triangles: usize = strips.iter().map(|strip| unstrip(strip).count()).sum();
    let n_corners = faces.corners.len() + 3 * n_triangles;
    Polygons::check_memory(held, n_vertices, n_corners as u64, memory_limit)?;
    read.corners.reserve_exact(n_corners);
    read.face_starts.reserve_exact(faces.ends.len() + n_triangles);
    for (k, corners) in faces.iter().enumerate() {
        read.corners.extend(corners);
        read.end_face(faces.odd.filter(|odd| odd.0 == k).map(|odd| odd.1))?;
    }
    for triangle in strips.iter().flat_map(unstrip) {
        read.corners.extend(triangle);
        read.end_face(None)?;
    }
    if !left_out.is_empty() {
        let names = shown_start(&left_out.join(", "), MAX_NAME_CHARS);
        read.notices.push(format!("PLY data that is not supported is ignored: {names}"));
    }
    Ok(read)
}

/// Writes polygons, colours and normals of vertices in the encoding of the source, by default binary little-endian.
pub(crate) fn write(shape: &Shape<'_>) -> Vec<u8> {
    let (origin, colors, normals) = (shape.origin, shape.colors(), shape.normals());
    let wide = if origin == DVec3::ZERO { Kind::F32 } else { Kind::F64 };
    let mut columns = POSITION.map(|name| Column::number(name, wide)).to_vec();
    if !normals.is_empty() {
        columns.extend(NORMAL.map(|name| Column::number(name, Kind::F32)));
    }
    if colors.is_some() {
        columns.extend(COLOR.map(|name| Column::number(name, Kind::U8)));
    }
    // Many programs expect 8-bit corner counts, so use them if they suffice.
    let counter = if shape.faces().all(|face| face.len() < 256) { Kind::U8 } else { Kind::U32 };
    let corners = Column { name: CORNERS[0].into(), kind: Kind::U32, counter: Some(counter) };
    let element =
        |name: &str, count: usize, columns| Element { name: name.into(), count: count as u64, columns };
    let elements = [
        element("vertex", shape.positions.len(), columns),
        element("face", shape.faces().len(), vec![corners]),
    ];
    let mut writer = Writer::new(shape.encoding, &elements);
    for (v, position) in shape.positions.iter().enumerate() {
        let place = (origin + position.as_dvec3()).to_array();
        let normal = normals.get(v).map(|normal| normal.as_dvec3().to_array());
        let color = colors.map(|colors| color_bytes(colors.get(&(v as u32))).map(f64::from));
        let numbers =
            place.into_iter().chain(normal.into_iter().flatten()).chain(color.into_iter().flatten());
        for (column, x) in elements[0].columns.iter().zip(numbers) {
            writer.put(column.kind, x);
        }
        writer.end_row();
    }
    for face in shape.faces() {
        writer.put(counter, face.len() as f64);
        face.iter().for_each(|&v| writer.put(Kind::U32, v.into()));
        writer.end_row();
    }
    writer.bytes
}
