//! Shows names and other text of files in messages.

use serde_json::error::Category;

/// Number of bytes that a message shows before the position of a JSON error.
const MAX_CONTEXT_BYTES: usize = 40;

/// Limit on a text in a message, characters.
const MAX_CHARS: usize = 200;

/// Mark at the beginning of UTF-8 files that some editors write.
pub(crate) const BYTE_ORDER_MARK: char = '\u{feff}';

/// Text of a file without the byte order mark.
#[must_use]
pub fn without_byte_order_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// Formats text of a file for a message: escaped, with the middle of long texts removed. At most 200 characters before
/// escaping.
#[must_use]
pub fn shown(text: &str) -> String {
    let n = text.chars().take(1 << 20).count();
    if n <= MAX_CHARS {
        return escaped(text);
    }
    let (head, tail) = (text.chars().take(MAX_CHARS / 2), text.chars().rev().take(MAX_CHARS / 2 - 1));
    let tail: String = tail.collect::<Vec<char>>().into_iter().rev().collect();
    format!("{}…{}", escaped(&head.collect::<String>()), escaped(&tail))
}

/// Escapes control characters, and characters that change the reading direction, in text of a file: a line feed becomes
/// `\n`, an escape `\u{1b}`.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        // These are the marks, embeddings, overrides and isolates of the Unicode Bidirectional Algorithm (UAX 9,
        // section 2).
        let turns = matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
        if c.is_control() || turns { out.extend(c.escape_default()) } else { out.push(c) }
    }
    out
}

/// Rephrases a serde error about an invalid value or name. `error`: its message, with names and values in quotes.
#[must_use]
pub fn value_fault(error: &str) -> String {
    let mut words = error.split(['`', '"']).skip(1).step_by(2).map(shown);
    let error = error.strip_prefix("Error: ").unwrap_or(error);
    match words.next() {
        Some(word) if error.starts_with("duplicate") => format!("'{word}' is given twice"),
        Some(word) if error.starts_with("unknown") => {
            format!("'{word}' is not known; it must be one of {}", words.collect::<Vec<_>>().join(", "))
        }
        Some(word) if error.starts_with("missing") => format!("'{word}' is missing"),
        Some(word) => match error.split_once(", expected ") {
            Some((_, expected)) if error.starts_with("invalid value") => {
                format!("'{word}' is given; it must be {}", escaped(expected))
            }
            _ => format!("'{word}' has the wrong type"),
        },
        None if error.starts_with("invalid type: map, expected a sequence") => {
            "an object is given, but a list is expected".to_owned()
        }
        None => "a value has the wrong type".to_owned(),
    }
}

/// Describes a JSON error: the problem, its position and the text before it.
#[must_use]
pub fn json_fault(text: &[u8], error: &serde_json::Error) -> String {
    let what = match error.classify() {
        Category::Eof => "the JSON ends too early: the file is cut off".to_owned(),
        Category::Data => value_fault(&error.to_string()),
        _ if error.to_string().starts_with("number out of range") => "a number is out of range".to_owned(),
        _ if error.to_string().starts_with("recursion limit") => "the JSON is nested too deeply".to_owned(),
        _ => "the JSON is damaged".to_owned(),
    };
    let (line, column) = (error.line(), error.column());
    // Serde gives the end of the previous token, so a fault of the first token is at column 0.
    if column == 0 {
        return format!("{what}, at the start of line {line}");
    }
    let of_line = text.split(|&byte| byte == b'\n').nth(line.saturating_sub(1)).unwrap_or_default();
    let before = String::from_utf8_lossy(
        &of_line[column.saturating_sub(MAX_CONTEXT_BYTES).min(of_line.len())..column.min(of_line.len())],
    )
    .into_owned();
    format!("{what}, at line {line}, column {column}, after '{}'", escaped(before.trim()))
}

/// The first `max_chars` characters, escaped: a name in a damaged file can be megabytes long.
pub(crate) fn shown_start(text: &str, max_chars: usize) -> String {
    escaped(&text.chars().take(max_chars).collect::<String>())
}

/// Limit on a name in a message, characters.
pub(crate) const MAX_NAME_CHARS: usize = 120;

#[cfg(test)]
mod tests {
    use serde_json::{Value, from_slice};

    use super::{json_fault, shown, value_fault};

    #[test]
    fn json_errors_are_rephrased() {
        let message =
            |text: &str| json_fault(text.as_bytes(), &from_slice::<Value>(text.as_bytes()).unwrap_err());
        assert_eq!(
            message("[1,"),
            "the JSON ends too early: the file is cut off, at line 1, column 3, after '[1,'"
        );
        assert_eq!(
            message(&format!("{}\u{1b}\n\t{{\"a\": 1 b", " ".repeat(50))),
            "the JSON is damaged, at line 1, column 51, after '\\u{1b}'"
        );
        assert_eq!(
            message(&"[".repeat(1000)),
            format!("the JSON is nested too deeply, at line 1, column 128, after '{}'", "[".repeat(40))
        );
        let error = from_slice::<Vec<u32>>(b"{}").unwrap_err();
        assert_eq!(
            json_fault(b"{}", &error),
            "an object is given, but a list is expected, at the start of line 1"
        );
        let kinds = [
            (
                "unknown variant `run`, expected `follow` or `stay`",
                "'run' is not known; it must be one of follow, stay",
            ),
            ("Error: missing field `to`", "'to' is missing"),
            ("invalid type: floating point `64.5`, expected u32", "'64.5' has the wrong type"),
            (
                "invalid value: floating point `64.5`, expected auto (0) or a whole number from 8 to 512",
                "'64.5' is given; it must be auto (0) or a whole number from 8 to 512",
            ),
            ("invalid type: map, expected a sequence", "an object is given, but a list is expected"),
            ("invalid length 0, expected an array of length 3", "a value has the wrong type"),
            ("duplicate field `vertex`", "'vertex' is given twice"),
        ];
        for (error, ours) in kinds {
            assert_eq!(value_fault(error), ours);
        }
    }

    #[test]
    fn long_text_keeps_both_ends() {
        let message = shown(&format!("{}\u{1b}{}.obj", "a".repeat(5000), "b".repeat(5000)));
        assert_eq!(message, format!("{}…{}.obj", "a".repeat(100), "b".repeat(95)));
    }

    #[test]
    fn only_control_characters_and_direction_marks_are_escaped() {
        assert_eq!(
            shown("\u{1b}[31mred\r\n\u{9b}\u{202e}gnp.exe"),
            r"\u{1b}[31mred\r\n\u{9b}\u{202e}gnp.exe"
        );
        // German, a combining accent, Devanagari, a quote and a backslash are not escaped.
        let plain = "Größe e\u{301} हिन्दी 'C:\\a b'";
        assert_eq!(shown(plain), plain);
    }
}
