//! STL reader and writer.
//!
//! STL stores triangles without shared vertices. Coincident corners are welded, in order of first occurrence,
//! so that cages are closed.

use cagework_core::mesh::weld;
use cagework_core::words::counted;
use glam::{DVec3, Vec3};
use stl_io::{Normal, Triangle, Vertex};

use crate::error::WriteError;
use crate::obj::{Group, lines, rest_of, shown_token, tokens};
use crate::origin::Coordinate;
use crate::polygons::{Encoding, Polygons, PolygonsError, Shape, fault, numbers};
use crate::shown::without_byte_order_mark;

/// Sizes in a binary file, bytes: header with triangle count, and one triangle.
const HEADER_BYTES: usize = 84;
const TRIANGLE_BYTES: usize = 50;

/// Lower bound on the size of a triangle in a text file, bytes.
const MIN_TEXT_TRIANGLE_BYTES: usize = 60;

/// Whether the content identifies an STL: a binary file whose length matches its triangle count, or a text
/// with `solid` and `facet`.
pub(crate) fn is_stl(bytes: &[u8]) -> bool {
    is_binary(bytes) || is_text(bytes)
}

fn is_binary(bytes: &[u8]) -> bool {
    let count = bytes.get(HEADER_BYTES - 4..HEADER_BYTES).and_then(|count| <[u8; 4]>::try_from(count).ok());
    count.is_some_and(|count| {
        let count = u32::from_le_bytes(count) as u64;
        count > 0 && bytes.len() as u64 == HEADER_BYTES as u64 + count * TRIANGLE_BYTES as u64
    })
}

fn is_text(bytes: &[u8]) -> bool {
    let bytes = without_byte_order_mark(bytes);
    let start = &bytes[..bytes.len().min(4096)];
    bytes.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
        // The header of a binary file can contain `solid` and `facet`, but the file also contains zero bytes.
        && !start.contains(&0)
        && start.windows(5).any(|word| word.eq_ignore_ascii_case(b"facet"))
}

/// Reads a file using at most `memory_limit` bytes. `near`: store positions relative to an origin near them.
pub(crate) fn read(bytes: &[u8], memory_limit: u64, near: bool) -> Result<Polygons, PolygonsError> {
    let is_text = is_text(bytes) && !is_binary(bytes);
    let most =
        if is_text { bytes.len() / MIN_TEXT_TRIANGLE_BYTES } else { bytes.len() / TRIANGLE_BYTES } as u64;
    Polygons::check_memory(2 * bytes.len() as u64, 3 * most, 3 * most, memory_limit)?;
    let mut read = Polygons {
        face_starts: vec![0],
        encoding: if is_text { Encoding::Text } else { Encoding::LittleEndian },
        ..Polygons::default()
    };
    let (corners, solids) = if is_text {
        read_text(bytes, &mut read.notices)?
    } else {
        (read_binary(bytes, &mut read.notices)?, Vec::new())
    };
    read.place(&corners, near);
    let welded = weld(&read.positions);
    read.positions = welded.first.iter().map(|&v| read.positions[v as usize]).collect();
    let mut collapsed = 0;
    let mut solids = solids.into_iter().peekable();
    for (t, triangle) in welded.unique_of.as_chunks::<3>().0.iter().enumerate() {
        while let Some((name, _)) = solids.next_if(|(_, first)| *first <= t) {
            let first_face = read.face_starts.len() as u32 - 1;
            read.groups.push(Group { is_object: true, name, first_face });
        }
        let [a, b, c] = *triangle;
        if a == b || b == c || c == a {
            collapsed += 1;
            continue;
        }
        read.corners.extend(triangle);
        read.end_face(None)?;
    }
    if read.groups.iter().all(|solid| solid.name.is_empty()) && read.groups.len() < 2 {
        read.groups.clear();
    }
    if collapsed > 0 {
        read.notices.push(format!(
            "{} with coincident corners: ignored",
            counted(collapsed, "triangle", "triangles")
        ));
    }
    Ok(read)
}

/// Reads the corners of the triangles of a binary file.
fn read_binary(bytes: &[u8], notices: &mut Vec<String>) -> Result<Vec<DVec3>, PolygonsError> {
    let count = bytes.get(HEADER_BYTES - 4..HEADER_BYTES).and_then(|count| <[u8; 4]>::try_from(count).ok());
    let Some(count) = count.map(|count| u64::from(u32::from_le_bytes(count))) else {
        return Err(PolygonsError::Syntax("it has no text facets and is too short for a binary file".into()));
    };
    let (length, follow) = (bytes.len() as u64, (bytes.len() - HEADER_BYTES) as u64);
    if count * TRIANGLE_BYTES as u64 > follow {
        return Err(PolygonsError::Count { name: "triangle".into(), count, bytes: length });
    }
    if count == 0 && follow > 0 {
        let problem = format!("its header declares 0 facets, but {follow} bytes follow");
        return Err(PolygonsError::Syntax(problem));
    }
    let (triangles, rest) = bytes[HEADER_BYTES..].split_at(count as usize * TRIANGLE_BYTES);
    if !rest.is_empty() {
        let n = rest.len();
        notices.push(format!("its header declares {count} facets: the {n} bytes after them are ignored"));
    }
    let is_colored =
        triangles.chunks(TRIANGLE_BYTES).any(|triangle| triangle[TRIANGLE_BYTES - 2..] != [0, 0]);
    if is_colored || bytes[..HEADER_BYTES - 4].windows(6).any(|word| word == b"COLOR=") {
        notices.push(
            "STL colours (attributes of facets, COLOR= in the header) are not supported: ignored".into(),
        );
    }
    let number = |bytes: &[u8; 4]| f32::from_le_bytes(*bytes);
    let corners = triangles.chunks(TRIANGLE_BYTES).flat_map(|triangle| {
        let numbers: Vec<f32> = triangle[12..48].as_chunks().0.iter().map(number).collect();
        [0, 3, 6].map(|k| Vec3::from_slice(&numbers[k..]).as_dvec3())
    });
    Ok(corners.collect())
}

/// Names of solids, each with the index of its first triangle.
type Solids = Vec<(String, usize)>;

/// Reads the corners and solids of a text file. Normals are ignored; some programs write them as "nan".
fn read_text(bytes: &[u8], notices: &mut Vec<String>) -> Result<(Vec<DVec3>, Solids), PolygonsError> {
    let (mut corners, mut solids, mut has_ended) = (Vec::new(), Solids::new(), true);
    let mut unknown = None;
    // Index of the first corner of the current facet.
    let mut open: Option<usize> = None;
    let mut end =
        |line: usize, corners: &[DVec3], next: Option<usize>| match std::mem::replace(&mut open, next) {
            Some(start) if corners.len() != start + 3 => Err(fault(
                line,
                &format!("the facet that ends here has {} corners, not 3", corners.len() - start),
            )),
            _ => Ok(()),
        };
    let mut last = 0;
    for line in lines(bytes) {
        last = line.number;
        let mut words = tokens(bytes, line.range.clone());
        let Some(word) = words.next() else { continue };
        match bytes[word.clone()].to_ascii_lowercase().as_slice() {
            b"solid" => {
                end(last, &corners, None)?;
                solids.push((rest_of(&bytes[line.range], &bytes[word]), corners.len() / 3));
                has_ended = false;
            }
            b"facet" => end(last, &corners, Some(corners.len()))?,
            b"vertex" => {
                let p: [f64; 3] = numbers(bytes, &line, words)?;
                corners.push(DVec3::from_array(p));
            }
            b"outer" | b"endloop" => {}
            b"endfacet" => end(last, &corners, None)?,
            b"endsolid" => {
                end(last, &corners, None)?;
                has_ended = true;
            }
            _ => unknown = unknown.or_else(|| Some(shown_token(&bytes[word]))),
        }
    }
    end(last, &corners, None)?;
    if corners.is_empty() {
        return Err(PolygonsError::Syntax("it has no facets".into()));
    }
    if !corners.len().is_multiple_of(3) {
        return Err(fault(last, "vertices outside a facet"));
    }
    if !has_ended {
        notices.push("the file does not end with 'endsolid': it may be cut off".into());
    }
    if let Some(word) = unknown {
        notices.push(format!("lines with unknown keywords, such as '{word}', are ignored"));
    }
    Ok((corners, solids))
}

/// Names of the solids of a text file, each with the index of its first triangle.
fn solids<'a>(shape: &Shape<'a>) -> Vec<(&'a str, usize)> {
    let Some(document) = shape.document else { return Vec::new() };
    // The triangles are in the order of the faces.
    let mut t = 0;
    let solid = |group: &'a Group| {
        let first = document.face_starts.get(group.first_face as usize).copied().unwrap_or(u32::MAX);
        t += document.triangles[t..].iter().take_while(|triangle| triangle[0] < first).count();
        (group.name.as_str(), t)
    };
    document.groups.iter().map(solid).collect()
}

/// Writes triangles with flat normals: as text if the source was text, binary otherwise.
///
/// # Errors
/// [`WriteError::NoFaces`].
pub(crate) fn write(shape: &Shape<'_>) -> Result<Vec<u8>, WriteError> {
    let Shape { positions, origin, triangles, encoding, .. } = shape;
    if triangles.is_empty() {
        return Err(WriteError::NoFaces { format: "STL" });
    }
    let all = triangles.iter().map(|t| {
        let corners = t.map(|v| positions[v as usize]);
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        ((b - a).cross(c - a).normalize_or_zero().as_vec3(), corners)
    });
    if *encoding == Encoding::Text {
        let mut text = String::new();
        let solids = solids(shape);
        let mut solids = solids.iter().peekable();
        let mut name = "cagework";
        for (t, (n, corners)) in all.enumerate() {
            let before = name;
            let mut is_first = t == 0;
            while let Some((next, _)) = solids.next_if(|(_, first)| *first <= t) {
                (name, is_first) = (if next.is_empty() { "cagework" } else { next }, true);
            }
            if is_first {
                text += &if t == 0 {
                    format!("solid {name}\n")
                } else {
                    format!("endsolid {before}\nsolid {name}\n")
                };
            }
            text += &format!("facet normal {} {} {}\nouter loop\n", n[0], n[1], n[2]);
            for corner in corners {
                let [x, y, z] = Coordinate::of(*origin, corner);
                text += &format!("vertex {x} {y} {z}\n");
            }
            text += "endloop\nendfacet\n";
        }
        return Ok((text + &format!("endsolid {name}\n")).into_bytes());
    }
    let mut bytes = Vec::with_capacity(HEADER_BYTES + TRIANGLE_BYTES * triangles.len());
    let all = all.map(|(normal, corners)| Triangle {
        normal: Normal::new(normal.to_array()),
        vertices: corners.map(|p| Vertex::new((origin + p.as_dvec3()).as_vec3().to_array())),
    });
    stl_io::write_stl(&mut bytes, all).expect("a Vec takes all bytes");
    Ok(bytes)
}
