//! Attributes of XML tags, as slices of the text.

use std::borrow::Cow;
use std::ops::Range;

use quick_xml::events::BytesStart;

/// Iterates over the keys and values of a tag. Values are not unescaped.
pub(super) fn attributes<'a>(tag: &'a BytesStart<'_>) -> impl Iterator<Item = (&'a str, &'a str)> {
    // Values borrow from the text, because quick-xml copies only values that it decodes. The check for repeated keys is
    // off, because it takes quadratic time.
    let mut all = tag.attributes();
    all.with_checks(false);
    let raw = tag.attributes_raw();
    all.map_while(Result::ok).map(move |one| {
        let value = match one.value {
            Cow::Borrowed(value) => value,
            Cow::Owned(_) => &raw[..0],
        };
        (one.key.0, value)
    })
}

/// Returns the byte range of `part`, a slice of `text`.
pub(super) fn span_of(text: &str, part: &str) -> Range<usize> {
    let start = part.as_ptr().addr() - text.as_ptr().addr();
    start..start + part.len()
}
