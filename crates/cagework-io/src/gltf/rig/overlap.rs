//! Finds accessors that cannot be overwritten in place, because they share bytes with others.

use std::collections::{HashMap, HashSet};

use serde_json::Value;

/// Location of an accessor: index of its buffer view, and its offset in it.
pub(super) type ViewOffset = (u64, u64);

/// Byte range `start..end` with elements of `size` bytes every `stride` bytes.
struct Span {
    /// Location of the accessor; `None` for images and sparse values, which are not overwritten.
    place: Option<ViewOffset>,
    start: u64,
    end: u64,
    stride: u64,
    size: u64,
}

/// Locations of accessors that partially overlap others. Interleaved attributes do not overlap, and accessors
/// at the same location are counted as shared.
pub(super) fn overlapping(json: &Value) -> HashSet<ViewOffset> {
    let mut spans = spans(json);
    spans.sort_by_key(|span| span.start);
    let (mut found, mut first, mut end) = (HashSet::new(), 0, 0);
    for k in 0..=spans.len() {
        if k == spans.len() || spans[k].start >= end {
            let cluster = &spans[first..k];
            if cluster.len() > 1 && !take_turns(cluster) {
                found.extend(cluster.iter().filter_map(|span| span.place));
            }
            (first, end) = (k, 0);
        }
        end = end.max(spans.get(k).map_or(0, |span| span.end));
    }
    found
}

/// Whether the spans are interleaved attributes of the same vertices.
fn take_turns(spans: &[Span]) -> bool {
    let stride = spans[0].stride;
    let mut parts: Vec<(u64, u64)> =
        spans.iter().map(|span| (span.start % stride, span.start % stride + span.size)).collect();
    parts.sort_unstable();
    let around = parts[0].0 + stride;
    spans.iter().all(|span| span.stride == stride)
        && parts.windows(2).all(|pair| pair[0].1 <= pair[1].0)
        && parts.iter().all(|part| part.1 <= around)
}

fn spans(json: &Value) -> Vec<Span> {
    let number = |of: &Value, key: &str| of[key].as_u64().unwrap_or(0);
    let list = |key: &str| json[key].as_array().into_iter().flatten();
    let view = |of: &Value| of["bufferView"].as_u64().map(|view| (view, &json["bufferViews"][view as usize]));
    let whole = |of: &Value| {
        let (_, view) = view(of)?;
        let (start, size) = (number(view, "byteOffset"), number(view, "byteLength"));
        (size > 0).then(|| Span { place: None, start, end: start.saturating_add(size), stride: size, size })
    };
    let mut at_places: HashMap<ViewOffset, Span> = HashMap::new();
    let mut spans: Vec<Span> = list("images").filter_map(whole).collect();
    for accessor in list("accessors") {
        let sparse = &accessor["sparse"];
        spans.extend([&sparse["indices"], &sparse["values"]].into_iter().filter_map(whole));
        let (Some((number_of_view, view)), count) = (view(accessor), number(accessor, "count")) else {
            continue;
        };
        let components = match accessor["type"].as_str() {
            Some("SCALAR") => 1,
            Some("VEC2") => 2,
            Some("VEC3") => 3,
            Some("MAT3") => 9,
            Some("MAT4") => 16,
            _ => 4,
        };
        let size = components
            * match number(accessor, "componentType") {
                5120 | 5121 => 1,
                5122 | 5123 => 2,
                _ => 4,
            };
        let offset = number(accessor, "byteOffset");
        let start = number(view, "byteOffset").saturating_add(offset);
        let stride = view["byteStride"].as_u64().filter(|&stride| stride > 0).unwrap_or(size);
        let end = start.saturating_add(stride.saturating_mul(count.saturating_sub(1))).saturating_add(size);
        let place = (number_of_view, offset);
        let span = Span { place: Some(place), start, end, stride, size };
        // If several accessors start here, the span covers the longest.
        let at_place = at_places.entry(place).or_insert(span);
        (at_place.end, at_place.size) = (at_place.end.max(end), at_place.size.max(size));
    }
    spans.extend(at_places.into_values());
    spans
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// Overlapping locations of a test document. `views`: offset, length and stride (0 for none) of each buffer view.
    /// `accessors`: view, offset and element type of accessors with ten f32 elements each.
    fn found(views: &[[u64; 3]], accessors: &[(u64, u64, &str)]) -> Vec<ViewOffset> {
        let views: Vec<Value> = views
            .iter()
            .map(|[start, length, stride]| match stride {
                0 => json!({ "byteOffset": start, "byteLength": length }),
                _ => json!({ "byteOffset": start, "byteLength": length, "byteStride": stride }),
            })
            .collect();
        let accessors: Vec<Value> = accessors
            .iter()
            .map(|(view, offset, kind)| {
                json!({ "bufferView": view, "byteOffset": offset, "componentType": 5126, "count": 10, "type": kind })
            })
            .collect();
        let mut found: Vec<ViewOffset> = overlapping(
            &json!({ "bufferViews": views, "accessors": accessors, "images": [{ "bufferView": 0 }] }),
        )
        .into_iter()
        .collect();
        found.sort_unstable();
        found
    }

    #[test]
    fn accessors_that_share_bytes_are_found() {
        let image = [0, 100, 0];
        let apart = found(&[image, [100, 120, 0], [220, 40, 0]], &[(1, 0, "VEC3"), (2, 0, "SCALAR")]);
        assert_eq!(apart, []);
        let by_a_byte = found(&[image, [101, 120, 0], [220, 40, 0]], &[(1, 0, "VEC3"), (2, 0, "SCALAR")]);
        assert_eq!(by_a_byte, [(1, 0), (2, 0)]);
        assert_eq!(found(&[image, [99, 120, 0]], &[(1, 0, "VEC3")]), [(1, 0)], "overlaps an image");
        let within = found(&[image, [100, 240, 0]], &[(1, 0, "VEC3"), (1, 60, "VEC3")]);
        assert_eq!(within, [(1, 0), (1, 60)], "within one view");
        assert_eq!(found(&[image, [100, 120, 0]], &[(1, 0, "VEC3"), (1, 0, "SCALAR")]), [], "same location");
    }

    #[test]
    fn interleaved_attributes_do_not_overlap() {
        let one_view = found(&[[0, 100, 0], [100, 240, 24]], &[(1, 0, "VEC3"), (1, 12, "VEC3")]);
        assert_eq!(one_view, []);
        let two_views = [[0, 100, 0], [100, 228, 24], [112, 228, 24]];
        assert_eq!(found(&two_views, &[(1, 0, "VEC3"), (2, 0, "VEC3")]), []);
        let too_wide = found(&[[0, 100, 0], [100, 244, 24]], &[(1, 0, "VEC3"), (1, 12, "VEC4")]);
        assert_eq!(too_wide, [(1, 0), (1, 12)]);
    }
}
