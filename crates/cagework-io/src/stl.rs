//! STL in and out: triangles without vertices of their own.
//!
//! Corners at one place are one vertex, in order of first occurrence, so that a bind has no place twice and a cage is closed.

use cagework_core::mesh::weld;
use glam::Vec3;
use stl_io::{Normal, Triangle, Vertex, create_stl_reader};

use crate::polygons::{Encoding, Polygons, PolygonsError};

/// Bytes of the header with the number of triangles, and of each triangle, in a binary file.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Bytes that a triangle takes at least in a text.
const SHORTEST: usize = 60;

/// Whether the bytes can be nothing else: a binary file has the length that it says, a text begins with two words.
pub(crate) fn is_stl(bytes: &[u8]) -> bool {
    is_binary(bytes) || is_text(bytes)
}

fn is_binary(bytes: &[u8]) -> bool {
    let count = bytes.get(HEADER - 4..HEADER).and_then(|count| <[u8; 4]>::try_from(count).ok());
    count.is_some_and(|count| {
        let count = u32::from_le_bytes(count) as u64;
        count > 0 && bytes.len() as u64 == HEADER as u64 + count * TRIANGLE as u64
    })
}

fn is_text(bytes: &[u8]) -> bool {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let start = &bytes[..bytes.len().min(4096)];
    bytes.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
        // A binary file may have both words in its header, and bytes after its triangles; but it has zeros.
        && !start.contains(&0)
        && start.windows(5).any(|word| word.eq_ignore_ascii_case(b"facet"))
}

/// Reads a file within `memory_limit` bytes.
pub(crate) fn read(bytes: &[u8], memory_limit: u64) -> Result<Polygons, PolygonsError> {
    let is_text = is_text(bytes) && !is_binary(bytes);
    let most = if is_text { bytes.len() / SHORTEST } else { bytes.len() / TRIANGLE } as u64;
    Polygons::check_memory(2 * bytes.len() as u64, 3 * most, 3 * most, memory_limit)?;
    let mut corners = Vec::new();
    let mut is_whole = true;
    if is_text {
        let (solids, has_ended) = solids(bytes);
        is_whole = has_ended;
        for solid in solids {
            add(&mut std::io::Cursor::new(solid), &mut corners)?;
        }
    } else {
        let count = bytes.get(HEADER - 4..HEADER).and_then(|count| <[u8; 4]>::try_from(count).ok());
        let Some(count) = count.map(|count| u64::from(u32::from_le_bytes(count))) else {
            return Err(PolygonsError::Syntax(
                "it has no facets of text, and is too short for a binary file".into(),
            ));
        };
        if HEADER as u64 + count * TRIANGLE as u64 > bytes.len() as u64 {
            let bytes = bytes.len() as u64;
            return Err(PolygonsError::Count { name: "triangle".into(), count, bytes });
        }
        // The reader takes whatever begins with this word for text.
        let mut bytes = bytes.to_vec();
        bytes.iter_mut().take(1).for_each(|first| *first = b' ');
        add(&mut std::io::Cursor::new(bytes), &mut corners)?;
    }
    let welded = weld(&corners);
    let mut read = Polygons {
        positions: welded.first.iter().map(|&v| corners[v as usize]).collect(),
        face_starts: vec![0],
        encoding: if is_text { Encoding::Text } else { Encoding::LittleEndian },
        ..Polygons::default()
    };
    let mut collapsed = 0;
    for triangle in welded.unique_of.as_chunks::<3>().0 {
        let [a, b, c] = *triangle;
        if a == b || b == c || c == a {
            collapsed += 1;
            continue;
        }
        read.corners.extend(triangle);
        read.end_face()?;
    }
    if !is_whole {
        read.notices.push("the text does not end with 'endsolid': it may be cut off".into());
    }
    if collapsed > 0 {
        read.notices.push(format!("{collapsed} triangles have two corners at one place: left out"));
    }
    Ok(read)
}

fn add(file: &mut std::io::Cursor<Vec<u8>>, corners: &mut Vec<Vec3>) -> Result<(), PolygonsError> {
    let wrong = |e: std::io::Error| PolygonsError::Syntax(e.to_string());
    for triangle in create_stl_reader(file).map_err(wrong)? {
        corners.extend(triangle.map_err(wrong)?.vertices.map(|v| Vec3::from_array(v.0)));
    }
    Ok(())
}

/// The solids of a text, each as the reader takes it: in small letters, with a name and an end. Normals are not looked at, which
/// some programs write as "nan"; nor is what is in no format of STL, such as colours. Also says whether the last one has ended.
fn solids(bytes: &[u8]) -> (Vec<Vec<u8>>, bool) {
    let mut solids: Vec<Vec<u8>> = Vec::new();
    let mut has_ended = true;
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    for line in bytes.split(|&b| b == b'\n' || b == b'\r') {
        let line = line.trim_ascii().to_ascii_lowercase();
        let word = line.split(u8::is_ascii_whitespace).next().unwrap_or_default();
        match (word, solids.last_mut()) {
            (b"solid", _) => {
                solids.push(b"solid x\n".to_vec());
                has_ended = false;
            }
            (b"endsolid", _) => has_ended = true,
            (b"facet", Some(solid)) => solid.extend(b"facet normal 0 0 0\n"),
            (b"outer" | b"vertex" | b"endloop" | b"endfacet", Some(solid)) => {
                solid.extend(&line);
                solid.push(b'\n');
            }
            _ => {}
        }
    }
    solids.iter_mut().for_each(|solid| solid.extend(b"endsolid x\n"));
    (solids, has_ended)
}

/// Triangles as a file, with the normals of their planes.
pub(crate) fn write(positions: &[Vec3], triangles: &[[u32; 3]], encoding: Encoding) -> Vec<u8> {
    let all = triangles.iter().map(|t| {
        let corners = t.map(|v| positions[v as usize]);
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        let normal = (b - a).cross(c - a).normalize_or_zero().as_vec3();
        Triangle {
            normal: Normal::new(normal.to_array()),
            vertices: corners.map(|p| Vertex::new(p.to_array())),
        }
    });
    if encoding == Encoding::Text {
        let mut text = String::from("solid cagework\n");
        for Triangle { normal: n, vertices } in all {
            text += &format!("facet normal {} {} {}\nouter loop\n", n[0], n[1], n[2]);
            vertices.iter().for_each(|v| text += &format!("vertex {} {} {}\n", v[0], v[1], v[2]));
            text += "endloop\nendfacet\n";
        }
        return (text + "endsolid cagework\n").into_bytes();
    }
    let mut bytes = Vec::with_capacity(HEADER + TRIANGLE * triangles.len());
    stl_io::write_stl(&mut bytes, all).expect("a Vec takes all bytes");
    bytes
}
