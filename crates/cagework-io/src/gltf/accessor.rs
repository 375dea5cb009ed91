//! Accessors: typed, bounds-checked views into buffers.
//!
//! The accessors of the crate `gltf` are not used: they assume `f32` positions, panic on KHR_mesh_quantization and
//! slice unchecked. A count is trusted only after its bytes were found in a buffer.

use std::sync::Arc;

use ::gltf::json::Root;
use ::gltf::json::accessor::{Accessor, ComponentType, Type};
use ::gltf::json::validation::Checked;
use cagework_core::words::counted;

use super::{GltfError, get};
use crate::order::Permit;

/// Limit on the elements of an accessor and on the vertices of a model. A model of this size takes about 1 GB to read
/// and weld.
pub(crate) const MAX_ELEMENTS: u64 = 1 << 24;

/// Limit on decoded values: vertices times attributes and morph targets, indices, keys of clips. Decoding this many
/// takes 1 to 2 s.
pub(super) const MAX_DECODED_VALUES: u64 = 1 << 28;

/// Limit on implicit zeros: elements of an accessor without buffer view that sparse values do not set.
const MAX_IMPLICIT_ZEROS: u64 = 1 << 20;

/// A document and its buffers, from which accessors are read.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a> {
    root: &'a Root,
    buffers: &'a [Arc<Vec<u8>>],
}

/// Number of elements that an accessor declares.
///
/// # Errors
/// If the accessor does not exist or has too many implicit zeros.
pub(super) fn count(root: &Root, accessor: u32) -> Result<u64, GltfError> {
    let a = get(&root.accessors, accessor as usize, "accessor", || "a primitive".into())?;
    let absent = count_absent(root, accessor);
    if absent > MAX_IMPLICIT_ZEROS {
        return Err(fault(
            accessor,
            format!(
                "has {absent} elements without data in the file, more than the limit of {MAX_IMPLICIT_ZEROS}"
            ),
        ));
    }
    Ok(a.count.0)
}

/// Number of implicit zeros; 0 if the accessor does not exist.
pub(super) fn count_absent(root: &Root, accessor: u32) -> u64 {
    let without_view = |a: &&Accessor| a.buffer_view.is_none();
    root.accessors
        .get(accessor as usize)
        .filter(without_view)
        .map_or(0, |a| a.count.0.saturating_sub(a.sparse.as_ref().map_or(0, |sparse| sparse.count.0)))
}

/// Type of a component: `f32`, or an integer that is converted as is or normalised.
#[derive(Clone, Copy)]
struct Component {
    kind: ComponentType,
    normalized: bool,
}

impl Component {
    /// Decodes a component from its bytes. Normalisation follows glTF 2.0, section 3.6.2.2.
    fn float(self, bytes: &[u8]) -> f32 {
        let (value, unit): (f32, f32) = match (self.kind, bytes) {
            (ComponentType::I8, &[a]) => (f32::from(a as i8), 127.0),
            (ComponentType::U8, &[a]) => (f32::from(a), 255.0),
            (ComponentType::I16, &[a, b]) => (f32::from(i16::from_le_bytes([a, b])), 32767.0),
            (ComponentType::U16, &[a, b]) => (f32::from(u16::from_le_bytes([a, b])), 65535.0),
            (ComponentType::F32, &[a, b, c, d]) => return f32::from_le_bytes([a, b, c, d]),
            _ => return f32::NAN,
        };
        if self.normalized { (value / unit).max(-1.0) } else { value }
    }
}

fn unsigned(kind: ComponentType, bytes: &[u8]) -> u32 {
    match (kind, bytes) {
        (ComponentType::U8, &[a]) => u32::from(a),
        (ComponentType::U16, &[a, b]) => u32::from(u16::from_le_bytes([a, b])),
        (ComponentType::U32, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]),
        _ => u32::MAX,
    }
}

/// Bytes of an accessor's elements: `size` bytes each, at intervals of `stride` bytes.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
}

impl<'a> Elements<'a> {
    fn get(&self, i: usize) -> &'a [u8] {
        &self.bytes[i * self.stride..i * self.stride + self.size]
    }
}

impl<'a> Source<'a> {
    /// A source of the values that `_permit` covers.
    pub(crate) fn new<T>(root: &'a Root, buffers: &'a [Arc<Vec<u8>>], _permit: &Permit<T>) -> Self {
        Self { root, buffers }
    }

    /// Reads vectors of `N` floats. `what` names the attribute in errors.
    pub(crate) fn floats<const N: usize>(
        self,
        accessor: u32,
        what: &str,
    ) -> Result<Vec<[f32; N]>, GltfError> {
        let component = self.component(accessor)?;
        if component.kind == ComponentType::U32 {
            return Err(fault(accessor, format!("has 32-bit integers, which are not allowed for {what}")));
        }
        self.read(accessor, what, component.kind, 0.0, |bytes| component.float(bytes))
    }

    /// Reads vectors of `N` unsigned integers, such as indices and joints.
    pub(crate) fn unsigned<const N: usize>(
        self,
        accessor: u32,
        what: &str,
    ) -> Result<Vec<[u32; N]>, GltfError> {
        let kind = self.component(accessor)?.kind;
        if !matches!(kind, ComponentType::U8 | ComponentType::U16 | ComponentType::U32) {
            return Err(fault(accessor, format!("must have unsigned integers for {what}")));
        }
        self.read(accessor, what, kind, 0, |bytes| unsigned(kind, bytes))
    }

    /// Number of elements, as [`count`].
    pub(crate) fn count(self, accessor: u32) -> Result<u64, GltfError> {
        count(self.root, accessor)
    }

    /// Upper bound on the number of non-zero elements. Reads the stored bytes and allocates nothing; every sparse value
    /// counts.
    pub(crate) fn count_nonzero(self, accessor: u32) -> Result<u64, GltfError> {
        let a = get(&self.root.accessors, accessor as usize, "accessor", || "a primitive".into())?;
        let sparse = a.sparse.as_ref().map_or(0, |sparse| sparse.count.0);
        let (Some(view), Checked::Valid(kind)) = (a.buffer_view, &a.type_) else { return Ok(sparse) };
        let (count, size) =
            (self.count(accessor)?.min(MAX_ELEMENTS) as usize, self.component(accessor)?.kind.size());
        let offset = a.byte_offset.map_or(0, |o| o.0);
        let elements = self.elements(accessor, view.value(), offset, count, kind.multiplicity() * size)?;
        let nonzero = (0..count).filter(|&i| elements.get(i).iter().any(|&b| b != 0)).count();
        Ok(nonzero as u64 + sparse)
    }

    fn component(self, accessor: u32) -> Result<Component, GltfError> {
        let a = get(&self.root.accessors, accessor as usize, "accessor", || "a primitive".into())?;
        match a.component_type {
            Checked::Valid(kind) => Ok(Component { kind: kind.0, normalized: a.normalized }),
            Checked::Invalid => Err(fault(accessor, "has an unknown component type".into())),
        }
    }

    fn read<const N: usize, T: Copy>(
        self,
        accessor: u32,
        what: &str,
        kind: ComponentType,
        zero: T,
        decode: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<[T; N]>, GltfError> {
        let a = get(&self.root.accessors, accessor as usize, "accessor", || "a primitive".into())?;
        let found = match a.type_ {
            Checked::Valid(found) => found,
            Checked::Invalid => return Err(fault(accessor, "has an unknown type".into())),
        };
        if found != type_of(N) {
            return Err(fault(
                accessor,
                format!("has type {found:?}, but {what} needs {:?}", type_of(N)).to_ascii_lowercase(),
            ));
        }
        let count = self.count(accessor)?;
        if count > MAX_ELEMENTS {
            return Err(GltfError::TooLarge { what: "elements of an accessor", count, limit: MAX_ELEMENTS });
        }
        let (count, size) = (count as usize, kind.size());
        let decode_element = |bytes: &[u8]| {
            let mut element = [zero; N];
            for (value, bytes) in element.iter_mut().zip(bytes.chunks_exact(size)) {
                *value = decode(bytes);
            }
            element
        };
        let mut values = match a.buffer_view {
            // Without a buffer view, all values are zero until sparse values replace some of them.
            None => vec![[zero; N]; count],
            Some(view) => {
                let offset = a.byte_offset.map_or(0, |o| o.0);
                let elements = self.elements(accessor, view.value(), offset, count, N * size)?;
                (0..count).map(|i| decode_element(elements.get(i))).collect()
            }
        };
        if let Some(sparse) = &a.sparse {
            if sparse.count.0 > a.count.0 {
                return Err(fault(
                    accessor,
                    format!("has {} sparse values for only {count} elements", sparse.count.0),
                ));
            }
            let n = sparse.count.0 as usize;
            let Checked::Valid(index_kind) = sparse.indices.component_type else {
                return Err(fault(accessor, "has sparse indices of an unknown component type".into()));
            };
            let index_kind = index_kind.0;
            let (places, offset) = (&sparse.indices, sparse.indices.byte_offset.0);
            let places = self.elements(accessor, places.buffer_view.value(), offset, n, index_kind.size())?;
            let (new, offset) = (&sparse.values, sparse.values.byte_offset.0);
            let new = self.elements(accessor, new.buffer_view.value(), offset, n, N * size)?;
            for i in 0..n {
                let place = unsigned(index_kind, places.get(i));
                let value = values.get_mut(place as usize).ok_or_else(|| {
                    fault(
                        accessor,
                        format!("has a sparse value for element {place}, but has {count} elements"),
                    )
                })?;
                *value = decode_element(new.get(i));
            }
        }
        Ok(values)
    }

    /// The bytes of `count` elements of `size` bytes. Checks that they are within the buffer.
    fn elements(
        self,
        accessor: u32,
        view: usize,
        offset: u64,
        count: usize,
        size: usize,
    ) -> Result<Elements<'a>, GltfError> {
        let from = || format!("accessor {accessor}");
        let v = get(&self.root.buffer_views, view, "buffer view", from)?;
        let buffer = get(self.buffers, v.buffer.value(), "buffer", || format!("buffer view {view}"))?;
        let stride = v.byte_stride.map(|s| s.0).filter(|&s| s > 0).unwrap_or(size);
        if stride < size && count > 1 {
            return Err(fault(
                accessor,
                format!(
                    "has elements of {size} bytes every {}, so they overlap: export it again",
                    counted(stride, "byte", "bytes")
                ),
            ));
        }
        let view_start = v.byte_offset.map_or(0, |o| o.0);
        let view_end = view_start.checked_add(v.byte_length.0).filter(|&end| end <= buffer.len() as u64);
        let Some(view_end) = view_end else {
            return Err(fault(
                accessor,
                format!("is in buffer view {view}, which extends beyond its buffer"),
            ));
        };
        let start = view_start.checked_add(offset);
        let length = match count {
            0 => Some(0),
            // `count` is limited, but `stride` is not: check for overflow.
            _ => (stride as u64).checked_mul(count as u64 - 1).and_then(|n| n.checked_add(size as u64)),
        };
        let end = start.zip(length).and_then(|(start, length)| start.checked_add(length));
        match (start, end) {
            (Some(start), Some(end)) if end <= view_end => {
                Ok(Elements { bytes: &buffer[start as usize..end as usize], stride, size })
            }
            _ => Err(fault(accessor, format!("has {count} elements, more than fit into buffer view {view}"))),
        }
    }
}

fn type_of(components: usize) -> Type {
    match components {
        1 => Type::Scalar,
        2 => Type::Vec2,
        3 => Type::Vec3,
        4 => Type::Vec4,
        _ => Type::Mat4,
    }
}

fn fault(accessor: u32, problem: String) -> GltfError {
    GltfError::Accessor { accessor, problem }
}
