//! Reads and writes PLY files: vertices with colours, and polygons.

use glam::{DVec3, Vec3};
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{
    Addable as _, ElementDef, Encoding as PlyEncoding, Header, Property, PropertyAccess,
    PropertyAccessResult, PropertyDef, PropertyType, ScalarType,
};
use ply_rs_bw::writer::Writer;

use crate::ply_text::{fault_of, readable, stray_line};
use crate::polygons::{Encoding, Polygons, PolygonsError, Shape, color_bytes};
use crate::shown::{MAX_NAME_CHARS, shown_start, without_byte_order_mark};

// Names of the vertex properties that are read.
const POSITION: [&str; 3] = ["x", "y", "z"];
const NORMAL: [&str; 3] = ["nx", "ny", "nz"];
const COLOR: [&str; 3] = ["red", "green", "blue"];
/// Vertex index that ends a triangle strip. The reader also stores it for values that are not valid indices.
const NO_VERTEX: u32 = u32::MAX;
/// Number of elements that are parsed or written at a time, each with memory of its own.
const ELEMENTS_AT_A_TIME: usize = 1 << 16;
/// Names of the property that lists the vertices of a face. Files use either name.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// A vertex, or a face to be written. Members of properties that the element does not have are zero or empty.
#[derive(Default)]
struct Element {
    place: [f64; 3],
    normal: [f32; 3],
    color: [u8; 3],
    corners: Vec<u32>,
}

/// A face or triangle strip as read.
#[derive(Default)]
struct Face {
    corners: Vec<u32>,
    /// The first corner that is not a valid index, as written.
    odd: Option<f64>,
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
    fn push(&mut self, face: &Face) {
        self.odd = self.odd.or(face.odd.map(|odd| (self.ends.len(), odd)));
        self.corners.extend(&face.corners);
        self.ends.push(self.corners.len());
    }

    fn iter(&self) -> impl Iterator<Item = &[u32]> {
        let starts = std::iter::once(&0).chain(&self.ends);
        starts.zip(&self.ends).map(|(&start, &end)| &self.corners[start..end])
    }
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !CORNERS.contains(&name) {
            return PropertyAccessResult::Ignored;
        }
        let set = corners(&property).map(|(corners, odd)| *self = Self { corners, odd });
        set.map_or(PropertyAccessResult::UnsupportedType, |()| PropertyAccessResult::Set)
    }
}

impl PropertyAccess for Element {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let of = |names: [&str; 3]| names.iter().position(|&n| n == name);
        let set = if let Some(k) = of(POSITION) {
            place(&property).map(|x| self.place[k] = x)
        } else if let Some(k) = of(COLOR) {
            color(&property).map(|x| self.color[k] = x)
        } else {
            return PropertyAccessResult::Ignored;
        };
        set.map_or(PropertyAccessResult::UnsupportedType, |()| PropertyAccessResult::Set)
    }

    fn get_float(&self, name: &str) -> Option<f32> {
        let find =
            |names: [&str; 3], values: [f32; 3]| names.iter().position(|&n| n == name).map(|k| values[k]);
        find(POSITION, self.place.map(|x| x as f32)).or_else(|| find(NORMAL, self.normal))
    }

    fn get_double(&self, name: &str) -> Option<f64> {
        POSITION.iter().position(|&n| n == name).map(|k| self.place[k])
    }

    fn get_uchar(&self, name: &str) -> Option<u8> {
        COLOR.iter().position(|&n| n == name).map(|k| self.color[k])
    }

    fn get_list_uint(&self, _name: &str) -> Option<&[u32]> {
        Some(&self.corners)
    }
}

/// Reads a coordinate from a property of any numeric type; `None` for a list.
fn place(property: &Property) -> Option<f64> {
    match property {
        Property::Double(x) => Some(*x),
        Property::Int(x) => Some(f64::from(*x)),
        Property::UInt(x) => Some(f64::from(*x)),
        other => other.to_f32_lossy().map(f64::from),
    }
}

/// Reads corners from a list of any numeric type. Values that are not valid indices become [`NO_VERTEX`]; the first
/// such value is also returned.
fn corners(property: &Property) -> Option<(Vec<u32>, Option<f64>)> {
    let of = |numbers: &mut dyn Iterator<Item = f64>| {
        let whole = |x: f64| x >= 0.0 && x < f64::from(NO_VERTEX) && x.fract() == 0.0;
        let mut odd = None;
        let list = numbers.map(|x| {
            odd = odd.or((!whole(x)).then_some(x));
            if whole(x) { x as u32 } else { NO_VERTEX }
        });
        Some((list.collect(), odd))
    };
    match property {
        Property::ListChar(list) => of(&mut list.iter().map(|&x| x.into())),
        Property::ListShort(list) => of(&mut list.iter().map(|&x| x.into())),
        Property::ListInt(list) => of(&mut list.iter().map(|&x| x.into())),
        Property::ListFloat(list) => of(&mut list.iter().map(|&x| x.into())),
        Property::ListDouble(list) => of(&mut list.iter().copied()),
        list => list.to_u32_list().map(|list| (list, None)),
    }
}

/// Converts a colour channel to a byte, from bytes, 16-bit integers or floats in 0 to 1.
fn color(property: &Property) -> Option<u8> {
    match property {
        Property::UShort(x) => Some((x >> 8) as u8),
        Property::Float(x) => Some((x * 255.0).round() as u8),
        Property::Double(x) => Some((x * 255.0).round() as u8),
        other => other.to_u8_color_lossy(),
    }
}

/// Iterates over the triangles of strips, which are separated by [`NO_VERTEX`]. Every second triangle of a strip has
/// the opposite orientation.
fn unstrip(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    let strips = corners.split(|&v| v == NO_VERTEX);
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
    let original = bytes;
    let wrong = |_| fault_of(original);
    let parser = Parser::<Element>::new();
    Polygons::check_memory(3 * bytes.len() as u64, 0, 0, memory_limit)?;
    let bytes = &*readable(bytes);
    let mut reader = Reader::new(bytes);
    let header = parser.read_header(&mut reader).map_err(wrong)?;
    let n_bytes = original.len() as u64;
    let count = |name: &str| header.elements.get(name).map_or(0, |e| e.count as u64);
    let mut claimed = 0_u64;
    for element in header.elements.values() {
        // An element with properties takes at least one byte, and a face at least four (its corner count and three
        // corners), so the file size limits the sum of all counts. Binary elements without properties take no bytes.
        // The limit applies to them as well, because a huge count of them would stall the reader.
        let least = if element.name == "face" { 4 } else { 1 };
        claimed = claimed.saturating_add(least * element.count as u64);
        if claimed > n_bytes {
            let name = shown_start(&element.name, MAX_NAME_CHARS);
            return Err(PolygonsError::Count { name, count: element.count as u64, bytes: n_bytes });
        }
    }
    // All vertices are in memory at the same time. A corner takes at least one byte.
    let corners = if count("face") + count("tristrips") > 0 { n_bytes } else { 0 };
    let held = n_bytes + bytes.len() as u64 + count("vertex") * size_of::<Element>() as u64;
    Polygons::check_memory(held, count("vertex"), corners / 2, memory_limit)?;

    let mut read = Polygons {
        face_starts: vec![0],
        encoding: match header.encoding {
            PlyEncoding::Ascii => Encoding::Text,
            PlyEncoding::BinaryBigEndian => Encoding::BigEndian,
            PlyEncoding::BinaryLittleEndian => Encoding::LittleEndian,
        },
        ..Polygons::default()
    };
    if let Some(line) = stray_line(original) {
        read.notices.push(format!("{line} is not a statement of a PLY header: ignored"));
    }
    let mut left_out = Vec::new();
    // Faces may precede their vertices.
    let (mut faces, mut strips) = (Faces::default(), Faces::default());
    for (name, element) in &header.elements {
        let has = |names: &[&str]| names.iter().all(|&n| element.properties.contains_key(n));
        let known: Vec<&str> = [&POSITION[..], &NORMAL, &COLOR].concat();
        match name.as_str() {
            "vertex" => {
                if !has(&POSITION) {
                    return Err(PolygonsError::Syntax("its vertices have no x, y or z".into()));
                }
                let elements =
                    parser.read_payload_for_element(&mut reader, element, &header).map_err(wrong)?;
                let places: Vec<DVec3> = elements.iter().map(|e| DVec3::from_array(e.place)).collect();
                read.place(&places, near);
                read.has_normals = has(&NORMAL);
                if has(&COLOR) {
                    read.colors = elements.iter().map(|e| e.color.map(|c| f32::from(c) / 255.0)).collect();
                }
                left_out.extend(element.properties.keys().filter(|k| !known.contains(&k.as_str())).cloned());
            }
            kind => {
                let (parser, mut all) = (Parser::<Face>::new(), Faces::default());
                for start in (0..element.count).step_by(ELEMENTS_AT_A_TIME) {
                    let count = ELEMENTS_AT_A_TIME.min(element.count - start);
                    let part = ElementDef { count, ..element.clone() };
                    let read = parser.read_payload_for_element(&mut reader, &part, &header);
                    read.map_err(wrong)?.iter().for_each(|face| all.push(face));
                }
                match kind {
                    "face" => faces = all,
                    "tristrips" => strips = all,
                    _ => {
                        left_out.push(name.clone());
                        continue;
                    }
                }
                left_out
                    .extend(element.properties.keys().filter(|k| !CORNERS.contains(&k.as_str())).cloned());
            }
        }
    }
    let n_triangles: usize = strips.iter().map(|strip| unstrip(strip).count()).sum();
    let n_corners = faces.corners.len() + 3 * n_triangles;
    Polygons::check_memory(held, count("vertex"), n_corners as u64, memory_limit)?;
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
    let mut header = Header::new();
    header.encoding = match shape.encoding {
        Encoding::Text => PlyEncoding::Ascii,
        Encoding::LittleEndian => PlyEncoding::BinaryLittleEndian,
        Encoding::BigEndian => PlyEncoding::BinaryBigEndian,
    };
    let mut element = |name: &str, count: usize, properties: Vec<(&str, PropertyType)>| {
        let mut element = ElementDef::new(name.into());
        element.count = count;
        for (name, kind) in properties {
            element.properties.add(PropertyDef::new(name.into(), kind));
        }
        header.elements.add(element);
    };
    let scalars =
        |names: [&'static str; 3], kind: ScalarType| names.map(|n| (n, PropertyType::Scalar(kind.clone())));
    let is_near = origin == DVec3::ZERO;
    let mut properties =
        scalars(POSITION, if is_near { ScalarType::Float } else { ScalarType::Double }).to_vec();
    if !normals.is_empty() {
        properties.extend(scalars(NORMAL, ScalarType::Float));
    }
    if colors.is_some() {
        properties.extend(scalars(COLOR, ScalarType::UChar));
    }
    element("vertex", shape.positions.len(), properties);
    // Many programs expect 8-bit corner counts, so use them if they suffice.
    let is_small = shape.faces().all(|face| face.len() < 256);
    let counter = if is_small { ScalarType::UChar } else { ScalarType::UInt };
    element("face", shape.faces().len(), vec![(CORNERS[0], PropertyType::List(counter, ScalarType::UInt))]);
    let vertex = |(v, p): (usize, &Vec3)| Element {
        place: (origin + p.as_dvec3()).to_array(),
        normal: normals.get(v).map_or([0.0; 3], Vec3::to_array),
        color: color_bytes(colors.and_then(|colors| colors.get(&(v as u32)))),
        ..Element::default()
    };
    let face = |corners: Vec<u32>| Element { corners, ..Element::default() };
    let (mut vertices, mut faces) = (shape.positions.iter().enumerate().map(vertex), shape.faces().map(face));
    let payload: [(&str, &mut dyn Iterator<Item = Element>); 2] =
        [("vertex", &mut vertices), ("face", &mut faces)];
    let (mut bytes, writer) = (Vec::new(), Writer::new());
    let mut is_written = writer.write_header(&mut bytes, &header);
    for (name, elements) in payload {
        loop {
            let part: Vec<Element> = elements.take(ELEMENTS_AT_A_TIME).collect();
            if part.is_empty() {
                break;
            }
            let element = &header.elements[name];
            is_written =
                is_written.and_then(|_| writer.write_payload_of_element(&mut bytes, &part, element, &header));
        }
    }
    is_written.expect("a Vec takes all bytes, and both lists are declared");
    bytes
}
