//! OFF reader and writer (Geomview's object file format, text only): vertices with colours or normals, and polygons.

use std::fmt::Write as _;
use std::ops::Range;

use glam::DVec3;

use crate::obj::{Line, lines, shown_token, tokens};
use crate::origin::Coordinate;
use crate::polygons::{Encoding, Polygons, PolygonsError, Shape, color_bytes, fault, numbers};

/// Whether the first word is `OFF`, with optional prefix letters for vertex attributes.
pub(crate) fn is_off(bytes: &[u8]) -> bool {
    let word = lines(bytes).find_map(|line| tokens(bytes, line.range).next());
    word.is_some_and(|word| keyword(&bytes[word]).is_some())
}

/// Letters before `OFF` in the keyword of a header, and the digits after it: some programs write no blank before the
/// number of vertices.
fn keyword(word: &[u8]) -> Option<(&[u8], &[u8])> {
    let at = word.windows(3).position(|three| three == b"OFF")?;
    let (letters, digits) = (&word[..at], &word[at + 3..]);
    let is_valid = letters.iter().all(|b| b"STCN4n".contains(b)) && digits.iter().all(u8::is_ascii_digit);
    is_valid.then_some((letters, digits))
}

/// Splits the words of a file on one line into the lines of its vertices and faces. `per_vertex`: number of words of a
/// vertex.
fn split_line(
    bytes: &[u8],
    number: usize,
    mut words: impl Iterator<Item = Range<usize>>,
    (n_vertices, per_vertex): (u64, u32),
) -> impl Iterator<Item = Line> {
    let mut n_before = 0;
    std::iter::from_fn(move || {
        let first = words.next()?;
        let corners = || std::str::from_utf8(&bytes[first.clone()]).ok()?.parse::<u32>().ok();
        let more = if n_before < n_vertices { per_vertex - 1 } else { corners().unwrap_or(0) };
        n_before += 1;
        let end = words.by_ref().take(more as usize).last().map_or(first.end, |word| word.end);
        Some(Line { number, range: first.start..end })
    })
}

/// Reads a file using at most `memory_limit` bytes. Each vertex and each face has its own line, unless the whole file is
/// one line. `near`: store positions relative to an origin near them.
pub(crate) fn read(bytes: &[u8], memory_limit: u64, near: bool) -> Result<Polygons, PolygonsError> {
    let n_bytes = bytes.len() as u64;
    Polygons::check_memory(n_bytes, 0, 0, memory_limit)?;
    let mut rows = lines(bytes).filter(|line| tokens(bytes, line.range.clone()).next().is_some()).peekable();
    let mut last = 1;
    let (mut has_colors, mut has_normals) = (false, false);
    let mut n_texcoords = 0;
    let mut header = rows.next();
    if let Some(line) = &mut header
        && let Some(word) = tokens(bytes, line.range.clone()).next()
        && let Some((letters, digits)) = keyword(&bytes[word.clone()])
    {
        if letters.contains(&b'4') || letters.contains(&b'n') {
            return Err(fault(line.number, "only three-dimensional vertices are supported"));
        }
        (has_colors, has_normals) = (letters.contains(&b'C'), letters.contains(&b'N'));
        n_texcoords = if letters.contains(&b'T') { 2 } else { 0 };
        // The counts are on the line of the keyword or on the next one.
        line.range.start = word.end - digits.len();
        if tokens(bytes, line.range.clone()).next().is_none() {
            header = rows.next();
        }
    }
    let Some(line) = header else { return Err(PolygonsError::Empty) };
    let mut words = tokens(bytes, line.range.clone());
    if words.clone().next().is_some_and(|word| bytes[word].eq_ignore_ascii_case(b"BINARY")) {
        return Err(PolygonsError::Unsupported("it is a binary OFF file: save it as text".into()));
    }
    let [n_vertices, n_faces] = numbers::<u64, 2>(bytes, &line, words.by_ref())?;
    let is_one_line = rows.peek().is_none();
    let mut rows: Box<dyn Iterator<Item = Line>> = if is_one_line {
        // The number of edges precedes the vertices. A colour has four channels.
        let per_vertex = 3 + 3 * u32::from(has_normals) + 4 * u32::from(has_colors) + n_texcoords;
        Box::new(split_line(bytes, line.number, words.skip(1), (n_vertices, per_vertex)))
    } else {
        Box::new(rows)
    };
    // A vertex or face takes at least two bytes: a digit, and a blank or the end of the line.
    for (name, count) in [("vertex", n_vertices), ("face", n_faces)] {
        if count > n_bytes / 2 {
            return Err(PolygonsError::Count { name: name.into(), count, bytes: n_bytes });
        }
    }
    Polygons::check_memory(n_bytes, n_vertices, n_bytes / 2, memory_limit)?;
    let mut read = Polygons { face_starts: vec![0], encoding: Encoding::Text, ..Polygons::default() };
    let ends = |last, n, what| fault(last, &format!("the file ends after {n} {what}: it is cut off"));
    let mut odd_words = 0_usize;
    let mut positions = Vec::new();
    for v in 0..n_vertices {
        let line = rows.next().ok_or_else(|| ends(last, v, format!("of {n_vertices} vertices")))?;
        last = line.number;
        let mut words = tokens(bytes, line.range.clone());
        positions.push(DVec3::from_array(numbers(bytes, &line, words.by_ref())?));
        if has_normals {
            let _: [f32; 3] = numbers(bytes, &line, words.by_ref())?;
        }
        if has_colors {
            read.colors.push(numbers(bytes, &line, words.by_ref())?);
        }
        // The fourth colour channel is the opacity, which is ignored.
        odd_words += words.skip(usize::from(has_colors)).count();
    }
    read.place(&positions, near);
    let mut colored = 0_usize;
    for f in 0..n_faces {
        let line = rows.next().ok_or_else(|| ends(last, f, format!("of {n_faces} faces")))?;
        last = line.number;
        let mut words = tokens(bytes, line.range.clone());
        let [n] = numbers::<u32, 1>(bytes, &line, words.by_ref())?;
        let mut odd = None;
        for k in 0..n {
            let word = words.next().ok_or_else(|| fault(last, &format!("has {k} corners of {n}")))?;
            let index: Option<i64> =
                std::str::from_utf8(&bytes[word.clone()]).ok().and_then(|w| w.parse().ok());
            let Some(index) = index else {
                let word = shown_token(&bytes[word]);
                return Err(fault(last, &format!("'{word}' is not a vertex index; indices count from 0")));
            };
            odd = odd.or((index < 0).then_some(index as f64));
            read.corners.push(u32::try_from(index).unwrap_or(u32::MAX));
        }
        read.end_face(odd)?;
        colored += usize::from(words.next().is_some());
    }
    // Colour channels are from 0 to 255 if any is above 1, otherwise from 0 to 1.
    if read.colors.as_flattened().iter().any(|&share| share > 1.0) {
        read.colors.as_flattened_mut().iter_mut().for_each(|share| *share /= 255.0);
    }
    let mut say = |count: usize, what: &str| {
        if count > 0 {
            read.notices.push(format!("{what} in an OFF file are not supported: ignored"));
        }
    };
    say(colored, "face colours");
    say(odd_words, "additional vertex values");
    say(usize::from(has_normals && has_colors), "normals together with colours");
    read.has_normals = has_normals && !has_colors;
    Ok(read)
}

/// Writes COFF if there are vertex colours, NOFF if there are normals, OFF otherwise.
pub(crate) fn write(shape: &Shape<'_>) -> Vec<u8> {
    let (faces, colors, normals) = (shape.faces(), shape.colors(), shape.normals());
    let kind = match (colors.is_some(), normals.is_empty()) {
        (true, _) => "COFF",
        (false, false) => "NOFF",
        (false, true) => "OFF",
    };
    let mut text = format!("{kind}\n{} {} 0\n", shape.positions.len(), faces.len());
    for (v, p) in (0..).zip(shape.positions.iter()) {
        let [x, y, z] = Coordinate::of(shape.origin, *p);
        let _ = write!(text, "{x} {y} {z}");
        if let Some(colors) = colors {
            let bytes = color_bytes(colors.get(&v));
            let _ = write!(text, " {} {} {} 255", bytes[0], bytes[1], bytes[2]);
        } else if let Some(n) = normals.get(v as usize) {
            let _ = write!(text, " {} {} {}", n.x, n.y, n.z);
        }
        text.push('\n');
    }
    for face in faces {
        let _ = write!(text, "{}", face.len());
        face.iter().for_each(|v| {
            let _ = write!(text, " {v}");
        });
        text.push('\n');
    }
    text.into_bytes()
}
