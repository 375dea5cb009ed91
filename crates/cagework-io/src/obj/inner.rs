//! Controls inside a cage as OBJ elements: `p` points, `l` polylines, `f` faces of sheets.

use cagework_core::{InnerControls, InnerElement};
use glam::DVec3;

use super::error::ObjError;
use super::lex::{lines, shown, tokens};
use super::read::{check_count, integer, resolve, wide_number};
use crate::memory::MemoryError;
use crate::origin::{Coordinate, relative};

/// Approximate upper bounds on the memory of a vertex and of an element, bytes.
const VERTEX_BYTES: u64 = 24;
const ELEMENT_BYTES: u64 = 80;

/// Limit on the corners of all elements. The surface of a bind has up to 100,000 faces, and at least one face for each
/// element.
const MAX_CORNERS: usize = 1 << 20;

/// Reads controls inside a cage. Every `v` line is a control, in the file's axes, relative to `origin`; `p`, `l` and
/// `f` lines are elements; other lines are ignored. A `p` line can list several points. The `radius` of the
/// result is `None`.
///
/// # Errors
/// [`ObjError`] if a line cannot be read or an index is out of range, or the memory limit is exceeded.
pub fn read_inner_controls(
    bytes: &[u8],
    origin: DVec3,
    memory_limit: u64,
) -> Result<InnerControls, ObjError> {
    let mut inner = InnerControls::default();
    let mut lines_of = Vec::new();
    let mut n_corners = 0;
    for line in lines(bytes) {
        let mut words = tokens(bytes, line.range.clone());
        let Some(keyword) = words.next() else { continue };
        let needed = VERTEX_BYTES * inner.positions.len() as u64
            + ELEMENT_BYTES * inner.elements.len() as u64
            + 8 * n_corners as u64;
        MemoryError::check(bytes.len() as u64 + needed, memory_limit)?;
        match &bytes[keyword] {
            b"v" => {
                let mut p = [0.0_f64; 3];
                for (value, axis) in p.iter_mut().zip(['x', 'y', 'z']) {
                    let token = words.next();
                    *value = token.clone().and_then(|t| wide_number(&bytes[t])).ok_or_else(|| {
                        let found = token.map_or("missing".into(), |t| format!("'{}'", shown(&bytes[t])));
                        ObjError::Coordinate { line: line.number, axis, found }
                    })?;
                }
                inner.positions.push(relative(DVec3::from_array(p), origin));
                check_count(inner.positions.len(), line.number)?;
            }
            kind @ (b"p" | b"l" | b"f") => {
                let corner = |token: std::ops::Range<usize>| {
                    let token = &bytes[token];
                    let bad = || ObjError::Corner { line: line.number, found: shown(token) };
                    // Slashes separate the vertex from texture coordinate and normal.
                    let index = token.split(|&b| b == b'/').next().and_then(integer).ok_or_else(bad)?;
                    let vertices = inner.positions.len();
                    resolve(index, vertices).ok_or(ObjError::Vertex { line: line.number, index, vertices })
                };
                let corners = words.map(corner).take(MAX_CORNERS + 1).collect::<Result<Vec<u32>, _>>()?;
                if corners.is_empty() {
                    return Err(ObjError::Corner { line: line.number, found: String::new() });
                }
                n_corners += corners.len();
                if n_corners > MAX_CORNERS {
                    return Err(ObjError::TooLarge { line: line.number, limit: MAX_CORNERS as u32 });
                }
                match kind {
                    b"p" => inner.elements.extend(corners.into_iter().map(InnerElement::Point)),
                    b"l" => inner.elements.push(InnerElement::Line(corners)),
                    _ => inner.elements.push(InnerElement::Face(corners)),
                }
                lines_of.resize(inner.elements.len(), line.number);
            }
            _ => {}
        }
    }
    let vertices = inner.positions.len();
    if vertices == 0 {
        return Err(ObjError::Empty);
    }
    // Indices are checked at the end, because elements may precede their vertices.
    for (element, line) in inner.elements.iter().zip(lines_of) {
        if let Some(&v) = element.corners().iter().find(|&&v| v as usize >= vertices) {
            return Err(ObjError::Vertex { line, index: i64::from(v) + 1, vertices });
        }
    }
    Ok(inner)
}

/// Writes controls inside a cage, relative to `origin`, in the format of [`read_inner_controls`].
#[must_use]
pub fn write_inner_controls(inner: &InnerControls, origin: DVec3) -> Vec<u8> {
    let vertices = inner.positions.iter().map(|&p| {
        let [x, y, z] = Coordinate::of(origin, p);
        format!("v {x} {y} {z}\n")
    });
    let elements = inner.elements.iter().map(|element| {
        let kind = &element.name()[..1];
        let corners = element.corners().iter().map(|&i| format!(" {}", u64::from(i) + 1));
        format!("{kind}{}\n", corners.collect::<String>())
    });
    vertices.chain(elements).collect::<String>().into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// File size limit, bytes.
    const LIMIT: u64 = 1 << 20;

    #[test]
    fn elements_of_all_kinds_are_read_with_any_indices() {
        let text = b"# controls\nv 0 0 0\nv 1 0 0\nv 1 1 0\np 1 -1\nl 1 2 3\nf 1/1 2//2 3\nusemtl red\n";
        let inner = read_inner_controls(text, DVec3::ZERO, LIMIT).unwrap();
        assert_eq!(inner.positions.len(), 3);
        let expected = [
            InnerElement::Point(0),
            InnerElement::Point(2),
            InnerElement::Line(vec![0, 1, 2]),
            InnerElement::Face(vec![0, 1, 2]),
        ];
        assert_eq!((inner.elements.as_slice(), inner.radius), (&expected[..], None));
        assert_eq!(
            read_inner_controls(&write_inner_controls(&inner, DVec3::ZERO), DVec3::ZERO, LIMIT).unwrap(),
            inner
        );
    }

    #[test]
    fn unreadable_files_are_errors_with_a_reason() {
        for (text, expected) in [
            ("", "no vertices: an OBJ file has lines such as 'v 0 1 0'"),
            ("v 0 0\n", "line 1: z coordinate is missing"),
            ("v 0 0 0\np 2\n", "line 2: refers to vertex 2, but there are 1"),
            ("v 0 0 0\nl 1 x\n", "line 2: corner 'x' is not an index"),
            ("v 0 0 0\np\n", "line 2: corner '' is not an index"),
            ("v 0 0 0\nf\n", "line 2: corner '' is not an index"),
        ] {
            let message = read_inner_controls(text.as_bytes(), DVec3::ZERO, LIMIT).unwrap_err().to_string();
            assert!(message.starts_with(expected), "{message}");
        }
        // An element takes up to 80 bytes, a corner of a `p` line 2 bytes in the file.
        for many in ["p 1\n".repeat(MAX_CORNERS + 1), format!("p{}\n", " 1".repeat(MAX_CORNERS + 1))] {
            let text = format!("v 0 0 0\n{many}");
            let message =
                read_inner_controls(text.as_bytes(), DVec3::ZERO, u64::MAX).unwrap_err().to_string();
            assert!(
                message.ends_with("more than 1048576 vertices or corners: simplify the model"),
                "{message}"
            );
        }
        let many = "v 0 0 0\n".repeat(10_000);
        assert!(
            read_inner_controls(many.as_bytes(), DVec3::ZERO, 100_000)
                .unwrap_err()
                .to_string()
                .contains("memory")
        );
    }
}
