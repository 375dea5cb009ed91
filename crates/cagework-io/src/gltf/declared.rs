//! The price of compressed geometry that another program decodes: the page's decoder has no limits of its own, so a
//! build without decoders prices a file by its headers before it asks for them.

use serde_json::Value;

use super::accessor::{MAX_DECODED_VALUES, MAX_ELEMENTS};
use super::root::{DRACO, MESHOPT};
use crate::order::{Order, Price};

/// Memory of a value of an accessor, bytes: the decoder copies each accessor and converts quantised values to floats.
const VALUE_BYTES: u64 = 8;

/// Largest number of components of a vertex attribute in a Draco stream.
const DRACO_COMPONENTS: u64 = 4;

/// What a decoder produces from a document.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Declared {
    /// Bytes of all streams.
    unpacked: u64,
    /// Values of all accessors. Each is copied, also if accessors share their bytes.
    values: u64,
    /// Elements of the largest Draco stream.
    elements: u64,
}

impl Declared {
    /// `bin`: binary chunk of a GLB. Draco streams in other files are priced by their accessors alone.
    pub(super) fn of(json: &Value, bin: Option<&[u8]>) -> Self {
        let mut all = Self::default();
        let list = |key: &str| json[key].as_array().into_iter().flatten();
        let add = |sum: &mut u64, n: u64| *sum = sum.saturating_add(n);
        for packed in list("bufferViews").flat_map(|view| MESHOPT.map(|name| &view["extensions"][name])) {
            let number = |key: &str| packed[key].as_u64().unwrap_or(0);
            add(&mut all.unpacked, number("count").saturating_mul(number("byteStride").max(1)));
        }
        for accessor in list("accessors") {
            let width = match accessor["type"].as_str() {
                Some("SCALAR") => 1,
                Some("VEC2") => 2,
                Some("VEC3") => 3,
                Some("MAT3") => 9,
                Some("MAT4") => 16,
                _ => 4,
            };
            add(&mut all.values, accessor["count"].as_u64().unwrap_or(0).saturating_mul(width));
        }
        let primitives = list("meshes").filter_map(|mesh| mesh["primitives"].as_array()).flatten();
        for packed in primitives.map(|primitive| &primitive["extensions"][DRACO]) {
            let view = packed["bufferView"].as_u64().and_then(|view| json["bufferViews"].get(view as usize));
            let stream = view.filter(|view| view["buffer"].as_u64() == Some(0)).zip(bin);
            let number = |view: &Value, key: &str| view[key].as_u64().map_or(0, |n| n as usize);
            let bytes = stream.and_then(|(view, bin)| {
                let end = number(view, "byteOffset").checked_add(number(view, "byteLength"))?;
                bin.get(number(view, "byteOffset")..end)
            });
            let Some([points, faces]) = bytes.and_then(draco_counts) else { continue };
            // Each primitive copies its attributes, also if primitives share a stream.
            let attributes = packed["attributes"].as_object().map_or(0, |all| all.len() as u64);
            let copied = points.saturating_mul(attributes * DRACO_COMPONENTS);
            add(&mut all.values, copied.saturating_add(faces.saturating_mul(3)));
            all.elements = all.elements.max(points).max(faces / 2);
        }
        all
    }
}

impl Order for Declared {
    fn price(&self) -> Price {
        let counts = vec![
            ("points of a Draco stream", self.elements, MAX_ELEMENTS),
            ("values of accessors of compressed geometry", self.values, MAX_DECODED_VALUES),
        ];
        let bytes = self.unpacked.saturating_add(self.values.saturating_mul(VALUE_BYTES));
        Price { counts, unpacked: self.unpacked, bytes }
    }
}

/// Numbers of points and faces in the header of a Draco mesh of version 2.2. The points of an edgebreaker stream are its
/// vertices, which attributes with seams repeat. `None` for other streams, and for those with metadata.
fn draco_counts(stream: &[u8]) -> Option<[u64; 2]> {
    const HEADER_BYTES: usize = 11;
    const HAS_METADATA: u8 = 0x80;
    let (header, mut rest) = stream.split_at_checked(HEADER_BYTES)?;
    if !header.starts_with(b"DRACO\x02\x02\x01") || header[HEADER_BYTES - 1] & HAS_METADATA != 0 {
        return None;
    }
    // Numbers of seven bits per byte, least significant first.
    let mut number = || {
        let n = rest.iter().take(5).position(|byte| byte & 0x80 == 0)?;
        let (bytes, after) = rest.split_at(n + 1);
        rest = after;
        Some(bytes.iter().rev().fold(0, |sum: u64, byte| sum << 7 | u64::from(byte & 0x7f)))
    };
    match header[8] {
        0 => {
            let faces = number()?;
            Some([number()?, faces])
        }
        1 => {
            let _traversal = number()?;
            Some([number()?, number()?])
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::order::{Budget, Expansion, Refusal};

    const LIMIT: u64 = 1 << 30;

    fn refusal(json: &Value, bin: &[u8]) -> Option<Refusal> {
        let order = Declared::of(json, Some(bin));
        Budget::new(1 << 20, 1 << 20, LIMIT, Expansion::GEOMETRY).permit(order).err()
    }

    #[test]
    fn meshopt_streams_and_accessors_that_share_them_are_priced() {
        let views = |count: u64, n: usize| {
            let packed = json!({ "count": count, "byteStride": 16, "buffer": 0 });
            json!(vec![json!({ "extensions": { MESHOPT[0]: packed } }); n])
        };
        assert_eq!(refusal(&json!({ "bufferViews": views(1 << 20, 15) }), &[]), None);
        assert!(matches!(
            refusal(&json!({ "bufferViews": views(1 << 20, 17) }), &[]),
            Some(Refusal::Unpacked(_))
        ));
        // As in a file of 725 kB: a stream of 16 MiB, and thousands of accessors of it with bounds.
        let accessor = json!({ "bufferView": 0, "count": 1 << 20, "type": "VEC3", "min": [0, 0, 0] });
        let shared = json!({ "bufferViews": views(1 << 20, 1), "accessors": vec![accessor; 3000] });
        assert!(matches!(refusal(&shared, &[]), Some(Refusal::Count { count: 9_437_184_000, .. })));
    }

    #[test]
    fn draco_streams_are_priced_for_each_primitive_that_uses_them() {
        // Headers of draco's encoder: 4,000,000 points and 8 faces, sequential, and 4,000,000 vertices by edgebreaker.
        let points = [0x80, 0x92, 0xf4, 0x01];
        let sequential = [&b"DRACO\x02\x02\x01\x00\x00\x00\x08"[..], &points].concat();
        let edgebreaker = [&b"DRACO\x02\x02\x01\x01\x00\x00\x00"[..], &points, &[0x08]].concat();
        for stream in [sequential, edgebreaker] {
            assert_eq!(draco_counts(&stream), Some([4_000_000, 8]));
            let document = |n: usize| {
                let packed = json!({ "bufferView": 0, "attributes": { "POSITION": 0, "NORMAL": 1 } });
                let primitive = json!({ "extensions": { DRACO: packed } });
                json!({ "bufferViews": [{ "buffer": 0, "byteLength": stream.len() }],
                    "meshes": [{ "primitives": vec![primitive; n] }] })
            };
            assert_eq!(refusal(&document(2), &stream), None);
            assert!(matches!(
                refusal(&document(1000), &stream),
                Some(Refusal::Count { count: 32_000_024_000, .. })
            ));
        }
        let cut_off = [&b"DRACO\x02\x02\x01\x01\x00\x00\x00"[..], &[0xff; 9]].concat();
        assert_eq!([draco_counts(&cut_off), draco_counts(b"DRACO"), draco_counts(&[0; 40])], [None; 3]);
    }
}
