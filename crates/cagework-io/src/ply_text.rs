//! Rewrites PLY files for the parser `ply-rs-bw`, which rejects non-ASCII comments, CR line ends, empty lines, indented
//! lines, property names with special characters, unknown header lines and, in text files, numbers such as `.5`, `1.` and `nan`.

use std::borrow::Cow;

use crate::obj::{lines, shown_token};
use crate::polygons::{PolygonsError, fault};
use crate::shown::{MAX_NAME_CHARS, shown_start, without_byte_order_mark};

/// Replacement for non-finite numbers of text files. The parser reads it as infinity.
const INFINITY_TEXT: &[u8] = b"1e999";

/// Words that start the lines of a header.
const STATEMENTS: [&[u8]; 7] =
    [b"ply", b"format", b"comment", b"obj_info", b"element", b"property", b"end_header"];

/// Finds the first header line with an unknown keyword, for a notice. Blender 2.47 wrote a comment without keyword.
pub(crate) fn stray_line(bytes: &[u8]) -> Option<String> {
    for line in lines(bytes) {
        let text = &bytes[line.range];
        match words(text).next() {
            Some(b"end_header") => return None,
            Some(word) if !STATEMENTS.contains(&word) => {
                let text = shown_start(String::from_utf8_lossy(text).trim(), MAX_NAME_CHARS);
                return Some(format!("line {} '{text}'", line.number));
            }
            _ => {}
        }
    }
    None
}

/// Explains why the parser rejected a file: the first invalid header statement or number.
pub(crate) fn fault_of(bytes: &[u8]) -> PolygonsError {
    const TYPES: [&[u8]; 16] = [
        b"char", b"uchar", b"short", b"ushort", b"int", b"uint", b"float", b"double", b"int8", b"uint8",
        b"int16", b"uint16", b"int32", b"uint32", b"float32", b"float64",
    ];
    let mut is_text = false;
    let mut is_body = false;
    for line in lines(bytes) {
        let words: Vec<&[u8]> = words(&bytes[line.range.clone()]).collect();
        if is_body {
            let is_number =
                |word: &&[u8]| std::str::from_utf8(word).is_ok_and(|word| word.parse::<f64>().is_ok());
            if let Some(word) = words.iter().find(|word| !is_number(word)) {
                return fault(line.number, &format!("'{}' is not a number such as 1.25", shown_token(word)));
            }
            continue;
        }
        let is_statement = match words.as_slice() {
            [b"format", kind, _] => {
                is_text = *kind == b"ascii";
                is_text || [&b"binary_little_endian"[..], b"binary_big_endian"].contains(kind)
            }
            [b"element", _, count] => {
                std::str::from_utf8(count).is_ok_and(|count| count.parse::<usize>().is_ok())
            }
            [b"property", b"list", count, kind, _] => TYPES.contains(count) && TYPES.contains(kind),
            [b"property", kind, _] => TYPES.contains(kind),
            [b"end_header"] if !is_text => break,
            [b"end_header"] => {
                is_body = true;
                true
            }
            [b"format" | b"element" | b"property" | b"end_header", ..] => false,
            _ => true,
        };
        if !is_statement {
            let text = shown_start(&String::from_utf8_lossy(&words.join(&b' ')), MAX_NAME_CHARS);
            return fault(line.number, &format!("'{text}' is not a statement of a PLY header"));
        }
    }
    PolygonsError::Syntax("it ends early, or its elements do not match the header".into())
}

/// Rewrites the file in the form that the parser accepts. Borrows if nothing has to change.
pub(crate) fn readable(bytes: &[u8]) -> Cow<'_, [u8]> {
    let bytes = without_byte_order_mark(bytes);
    // The first line shows which line end the file uses.
    let is_old = bytes
        .iter()
        .position(|b| b"\r\n".contains(b))
        .is_some_and(|k| bytes[k] == b'\r' && bytes.get(k + 1) != Some(&b'\n'));
    let line_end = if is_old { b'\r' } else { b'\n' };
    let Some(end) = end_of_header(bytes, line_end) else { return bytes.into() };
    let (header, body) = bytes.split_at(end);
    let mut out = tidy_header(header, line_end);
    let is_text = out.split(|&b| b == b'\n').any(|line| words(line).take(2).eq([&b"format"[..], b"ascii"]));
    let is_line_end = |b: &u8| *b == line_end;
    if out == header && (!is_text || body.split(is_line_end).all(is_readable)) {
        return bytes.into();
    }
    if !is_text {
        out.extend(body);
        return out.into();
    }
    for line in body.split(is_line_end).filter(|line| !line.trim_ascii().is_empty()) {
        for word in words(line) {
            tidy(word, &mut out);
            out.push(b' ');
        }
        out.push(b'\n');
    }
    out.into()
}

/// Rewrites the header in the parser's grammar: `\n` line ends, no empty lines, ASCII only. Property names with other
/// characters are replaced; the reader ignores such properties.
fn tidy_header(header: &[u8], line_end: u8) -> Vec<u8> {
    let mut out = Vec::with_capacity(header.len());
    for (number, line) in header.split(|&b| b == line_end).enumerate() {
        let words: Vec<&[u8]> = words(line).collect();
        let Some((name, before)) = words.split_last() else { continue };
        if !STATEMENTS.contains(&words[0]) {
            continue;
        }
        let is_plain = |b: &u8| b.is_ascii_alphanumeric() || b"_-".contains(b);
        if before.first() == Some(&&b"property"[..]) && !name.iter().all(is_plain) {
            out.extend(before.join(&b' '));
            out.push(b' ');
            out.extend(name.iter().map(|b| if is_plain(b) { *b } else { b'_' }));
            // Append the line number, so that names whose special characters were replaced stay distinct.
            out.extend(format!("-{number}").into_bytes());
        } else {
            out.extend(line.trim_ascii_start().iter().map(|&b| if b.is_ascii() { b } else { b'?' }));
        }
        out.push(b'\n');
    }
    out
}

/// Finds the offset of the first byte after the header; `None` if the header has no end.
fn end_of_header(bytes: &[u8], line_end: u8) -> Option<usize> {
    const END: &[u8] = b"end_header";
    let is_end = |&at: &usize| {
        let mut before = bytes[..at].iter().rev();
        bytes[at..].starts_with(END) && before.find(|b| !b" \t".contains(b)) == Some(&line_end)
    };
    let at = (0..bytes.len()).find(is_end)? + END.len();
    Some(at + bytes[at..].iter().position(|&b| b == line_end)? + 1)
}

fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// Whether the parser accepts a line of numbers. The last line may be empty.
fn is_readable(line: &[u8]) -> bool {
    let is_number = |word: &[u8]| {
        let digits = word.strip_prefix(b"-").or_else(|| word.strip_prefix(b"+")).unwrap_or(word);
        let at_ends = [digits.first(), digits.last()].iter().all(|b| b.is_some_and(u8::is_ascii_digit));
        let is_dotted = |pair: &[u8]| pair[0] == b'.' && !pair[1].is_ascii_digit();
        at_ends && !digits.windows(2).any(is_dotted)
    };
    words(line).next().is_some() && words(line).all(is_number)
}

/// Appends a number in the form that the parser accepts.
fn tidy(word: &[u8], out: &mut Vec<u8>) {
    let lower = word.to_ascii_lowercase();
    if lower.windows(3).any(|part| part == b"nan" || part == b"inf") {
        return out.extend(INFINITY_TEXT);
    }
    let mut before = b' ';
    for (k, &b) in word.iter().enumerate() {
        let after = word.get(k + 1).copied().unwrap_or(b' ');
        if b == b'.' && !before.is_ascii_digit() {
            out.push(b'0');
        }
        out.push(b);
        if b == b'.' && !after.is_ascii_digit() {
            out.push(b'0');
        }
        before = b;
    }
}
