//! A model as arrays of bytes. A web worker reads a file and stores the model; the page restores the model without
//! parsing the file again.
//!
//! The first array is JSON with the small values. The other arrays are in the order in which [`Model::store`] and
//! [`Look::store`] append them. Worker and page belong to one build, so the format has no version.

use std::collections::HashMap;
use std::sync::Arc;

use bytemuck::Pod;
use cagework_core::splats::Splats;
use glam::{DVec3, Vec3};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{Document, Model, ModelFormat};
use crate::counts::Counts;
use crate::gltf::{GltfDocument, GltfParts};
use crate::look::{Look, LookAlpha, LookGroup, LookImage, sniff_image};
use crate::obj::{Group, Material, PolygonDocument};
use crate::polygons::Encoding;
use crate::siblings::Image;
use crate::splats::{Capture, Records};
use crate::up::UpAxis;

/// Why a stored model cannot be restored.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RestoreError {
    /// An array is missing, or was not written by [`Model::store`].
    #[error("the model that was read is damaged: open the file again")]
    Damaged,
}

/// Arrays of bytes of a stored model.
#[derive(Debug, Default)]
pub struct Store {
    arrays: Vec<Vec<u8>>,
    /// Contents of buffers and images. Contents that a document refers to more than once are stored once.
    shared: Vec<Arc<Vec<u8>>>,
    /// Index in `shared` by address. A file may have hundreds of thousands of images.
    numbers: HashMap<*const Vec<u8>, usize>,
}

/// Takes the arrays of a [`Store`] in order.
pub struct StoredArrays<'a>(pub &'a mut dyn FnMut() -> Option<Vec<u8>>);

#[derive(Serialize, Deserialize)]
struct Head {
    name: String,
    counts: Counts,
    notices: Vec<String>,
    up: UpAxis,
    bytes: u64,
    format: ModelFormat,
    encoding: Encoding,
    has_normals: bool,
    document: HeadDocument,
    n_shared: usize,
}

#[derive(Serialize, Deserialize)]
enum HeadDocument {
    /// Degree of the spherical harmonics, and the records without the body of an SPZ.
    Capture(u8, Records),
    Obj {
        materials: Vec<String>,
        groups: Vec<Group>,
        looks: Vec<(String, Option<StoredImage>)>,
    },
    Gltf(GltfHead),
}

#[derive(Serialize, Deserialize)]
struct GltfHead {
    /// Index of each buffer among the shared contents.
    buffers: Vec<usize>,
    images: Vec<Option<StoredImage>>,
    has_text: bool,
    has_packed: bool,
    is_decoded: bool,
    bytes: u64,
}

/// Name of an image, and the index of its contents among the shared contents.
type StoredImage = (String, usize);

impl Store {
    /// The arrays, to be passed to [`Model::restore`] and [`Look::restore`].
    #[must_use]
    pub fn into_arrays(self) -> Vec<Vec<u8>> {
        self.arrays
    }

    /// Appends numbers.
    pub fn push<T: Pod>(&mut self, numbers: &[T]) {
        self.arrays.push(bytemuck::cast_slice(numbers).to_vec());
    }

    /// Appends JSON.
    pub fn push_json(&mut self, value: &impl Serialize) {
        // Serialisation cannot fail: maps have strings as keys, and numbers that may be infinite are in arrays of their
        // own.
        self.arrays.push(serde_json::to_vec(value).unwrap_or_default());
    }

    fn share(&mut self, bytes: &Arc<Vec<u8>>) -> usize {
        *self.numbers.entry(Arc::as_ptr(bytes)).or_insert_with(|| {
            self.shared.push(Arc::clone(bytes));
            self.shared.len() - 1
        })
    }

    fn image(&mut self, image: &Image) -> StoredImage {
        (image.name.to_string(), self.share(&image.bytes))
    }

    fn push_shared(&mut self) {
        self.numbers.clear();
        for bytes in std::mem::take(&mut self.shared) {
            self.arrays.push(Arc::unwrap_or_clone(bytes));
        }
    }
}

impl StoredArrays<'_> {
    fn bytes(&mut self) -> Result<Vec<u8>, RestoreError> {
        (self.0)().ok_or(RestoreError::Damaged)
    }

    /// Takes the next array as numbers.
    ///
    /// # Errors
    /// [`RestoreError::Damaged`] if there are no more arrays.
    pub fn numbers<T: Pod>(&mut self) -> Result<Vec<T>, RestoreError> {
        let bytes = self.bytes()?;
        let mut list = vec![T::zeroed(); bytes.len() / size_of::<T>()];
        let room: &mut [u8] = bytemuck::cast_slice_mut(&mut list);
        room.copy_from_slice(&bytes[..room.len()]);
        Ok(list)
    }

    /// Takes the next array as JSON.
    ///
    /// # Errors
    /// [`RestoreError::Damaged`] if there are no more arrays, or it is not the JSON of a `T`.
    pub fn json<T: DeserializeOwned>(&mut self) -> Result<T, RestoreError> {
        serde_json::from_slice(&self.bytes()?).map_err(|_| RestoreError::Damaged)
    }

    fn shared(&mut self, n: usize) -> Result<Vec<Arc<Vec<u8>>>, RestoreError> {
        (0..n).map(|_| self.bytes().map(Arc::new)).collect()
    }
}

impl Model {
    /// Appends the model to `store`.
    pub fn store(self, store: &mut Store) {
        let Self { name, positions, triangles, counts, notices, up, origin, bytes, format, .. } = self;
        let Self { encoding, has_normals, document, capture, .. } = self;
        let head = |document, n_shared| Head {
            name,
            counts,
            notices,
            up,
            bytes,
            format,
            encoding,
            has_normals,
            document,
            n_shared,
        };
        let first = store.arrays.len();
        store.arrays.push(Vec::new());
        store.push(&origin.to_array());
        store.push(&positions);
        if let Some(capture) = capture {
            let Capture { splats, file, mut records } = Arc::unwrap_or_clone(capture);
            store.arrays.push(file);
            store.arrays.push(records.take_body());
            store.push(&splats.scales);
            store.push(&splats.rotations);
            store.push(&splats.opacities);
            store.push(&splats.colors);
            store.push(&splats.harmonics);
            let document = HeadDocument::Capture(splats.degree, records);
            store.arrays[first] = serde_json::to_vec(&head(document, 0)).unwrap_or_default();
            return;
        }
        store.push(&triangles);
        drop((positions, triangles));
        let document = match document {
            Document::Polygons(document) => store_obj(*document, store),
            Document::Gltf(document) => store_gltf(*document, store),
        };
        let n_shared = store.shared.len();
        store.arrays[first] = serde_json::to_vec(&head(document, n_shared)).unwrap_or_default();
        store.push_shared();
    }

    /// Rebuilds a model from the arrays that [`Self::store`] appended.
    ///
    /// # Errors
    /// [`RestoreError`].
    pub fn restore(from: &mut StoredArrays<'_>) -> Result<Self, RestoreError> {
        let head: Head = from.json()?;
        let origin: [f64; 3] = from.numbers::<f64>()?.try_into().map_err(|_| RestoreError::Damaged)?;
        let origin = DVec3::from_array(origin);
        let positions: Vec<Vec3> = from.numbers()?;
        let (mut triangles, mut capture) = (Vec::new(), None);
        if !matches!(head.document, HeadDocument::Capture(..)) {
            triangles = from.numbers()?;
        }
        let document = match head.document {
            HeadDocument::Capture(degree, mut records) => {
                let file = from.bytes()?;
                records.put_body(from.bytes()?);
                let splats = Splats {
                    positions: positions.clone(),
                    scales: from.numbers()?,
                    rotations: from.numbers()?,
                    opacities: from.numbers()?,
                    colors: from.numbers()?,
                    degree,
                    harmonics: from.numbers()?,
                };
                capture = Some(Arc::new(Capture { splats, file, records }));
                Document::Polygons(Box::default())
            }
            HeadDocument::Obj { materials, groups, looks } => {
                let mut document = restore_obj(from)?;
                (document.materials, document.groups) = (materials, groups);
                let colors: Vec<[f32; 4]> = from.numbers()?;
                let shared = from.shared(head.n_shared)?;
                for ((name, image), color) in looks.into_iter().zip(colors) {
                    let image = image.map(|image| image_of(&image, &shared)).transpose()?;
                    document.looks.insert(name, Material { color, image });
                }
                Document::Polygons(Box::new(document))
            }
            HeadDocument::Gltf(head_of_gltf) => {
                Document::Gltf(Box::new(restore_gltf(&head_of_gltf, head.n_shared, from)?))
            }
        };
        let Head { name, counts, notices, up, bytes, format, encoding, has_normals, .. } = head;
        Ok(Self {
            name,
            positions,
            triangles,
            counts,
            notices,
            up,
            origin,
            bytes,
            format,
            encoding,
            has_normals,
            document,
            capture,
        })
    }
}

fn store_obj(document: PolygonDocument, store: &mut Store) -> HeadDocument {
    let PolygonDocument { bytes, texcoords, normals, corners, face_starts, .. } = document;
    let PolygonDocument { face_materials, face_smoothing, triangles, colors, .. } = document;
    store.arrays.push(bytes);
    store.push(&texcoords);
    store.push(&normals);
    store.push(&corners);
    store.push(&face_starts);
    store.push(&face_materials);
    store.push(&face_smoothing);
    store.push(&triangles);
    let (vertices, colors): (Vec<u32>, Vec<[f32; 3]>) = colors.into_iter().unzip();
    store.push(&vertices);
    store.push(&colors);
    let colors: Vec<[f32; 4]> = document.looks.values().map(|material| material.color).collect();
    store.push(&colors);
    let image = |store: &mut Store, material: &Material| material.image.as_ref().map(|i| store.image(i));
    let looks = document.looks.iter();
    let looks = looks.map(|(name, material)| (name.clone(), image(store, material))).collect();
    HeadDocument::Obj { materials: document.materials, groups: document.groups, looks }
}

fn restore_obj(from: &mut StoredArrays<'_>) -> Result<PolygonDocument, RestoreError> {
    let mut document = PolygonDocument {
        bytes: from.bytes()?,
        texcoords: from.numbers()?,
        normals: from.numbers()?,
        corners: from.numbers()?,
        face_starts: from.numbers()?,
        face_materials: from.numbers()?,
        face_smoothing: from.numbers()?,
        triangles: from.numbers()?,
        ..PolygonDocument::default()
    };
    let (vertices, colors): (Vec<u32>, Vec<[f32; 3]>) = (from.numbers()?, from.numbers()?);
    document.colors = vertices.into_iter().zip(colors).collect();
    Ok(document)
}

fn store_gltf(document: GltfDocument, store: &mut Store) -> HeadDocument {
    let GltfParts { json, slots, buffers, images, text, packed, is_decoded, bytes } = document.into_parts();
    store.push_json(&json);
    store.push(&slots);
    let head = GltfHead {
        buffers: buffers.iter().map(|buffer| store.share(buffer)).collect(),
        images: images.iter().map(|image| image.as_ref().map(|image| store.image(image))).collect(),
        has_text: text.is_some(),
        has_packed: packed.is_some(),
        is_decoded,
        bytes,
    };
    store.arrays.extend(text.into_iter().chain(packed));
    HeadDocument::Gltf(head)
}

fn restore_gltf(
    head: &GltfHead,
    n_shared: usize,
    from: &mut StoredArrays<'_>,
) -> Result<GltfDocument, RestoreError> {
    let (json, slots) = (from.json()?, from.numbers()?);
    let text = if head.has_text { Some(from.bytes()?) } else { None };
    let packed = if head.has_packed { Some(from.bytes()?) } else { None };
    let shared = from.shared(n_shared)?;
    let buffer = |k: &usize| shared.get(*k).cloned().ok_or(RestoreError::Damaged);
    let image = |image: &Option<StoredImage>| image.as_ref().map(|i| image_of(i, &shared)).transpose();
    let parts = GltfParts {
        json,
        slots,
        buffers: head.buffers.iter().map(buffer).collect::<Result<_, _>>()?,
        images: head.images.iter().map(image).collect::<Result<_, _>>()?,
        text,
        packed,
        is_decoded: head.is_decoded,
        bytes: head.bytes,
    };
    GltfDocument::of_parts(parts).map_err(|_| RestoreError::Damaged)
}

fn image_of((name, contents): &StoredImage, shared: &[Arc<Vec<u8>>]) -> Result<Image, RestoreError> {
    let bytes = shared.get(*contents).cloned().ok_or(RestoreError::Damaged)?;
    let mime = sniff_image(&bytes).ok_or(RestoreError::Damaged)?;
    Ok(Image { name: name.as_str().into(), bytes, mime })
}

impl Look {
    /// Appends the look to `store`, with names of images but without their contents, which are decoded already.
    pub fn store(self, store: &mut Store) {
        let color = |group: &LookGroup| {
            let [r, g, b, a] = group.base_color;
            let cutoff = if let LookAlpha::Mask { cutoff } = group.alpha { cutoff } else { 0.0 };
            [r, g, b, a, cutoff]
        };
        let colors: Vec<[f32; 5]> = self.groups.iter().map(color).collect();
        let finite = |mut group: LookGroup| {
            group.base_color = [0.0; 4];
            if let LookAlpha::Mask { cutoff } = &mut group.alpha {
                *cutoff = 0.0;
            }
            group
        };
        let groups: Vec<LookGroup> = self.groups.into_iter().map(finite).collect();
        let images: Vec<(String, String)> = self.images.into_iter().map(|i| (i.name, i.mime)).collect();
        store.push_json(&(groups, images));
        store.push(&colors);
        store.push(&self.vertices);
        store.push(&self.copies);
        store.push(&self.triangles);
    }

    /// Rebuilds a look from the arrays that [`Self::store`] appended.
    ///
    /// # Errors
    /// [`RestoreError`].
    pub fn restore(from: &mut StoredArrays<'_>) -> Result<Self, RestoreError> {
        let (mut groups, images): (Vec<LookGroup>, Vec<(String, String)>) = from.json()?;
        let colors: Vec<[f32; 5]> = from.numbers()?;
        for (group, [r, g, b, a, cut]) in groups.iter_mut().zip(colors) {
            group.base_color = [r, g, b, a];
            if let LookAlpha::Mask { cutoff } = &mut group.alpha {
                *cutoff = cut;
            }
        }
        let images = images.into_iter().map(|(name, mime)| LookImage { name, bytes: Vec::new(), mime });
        Ok(Self {
            groups,
            images: images.collect(),
            vertices: from.numbers()?,
            copies: from.numbers()?,
            triangles: from.numbers()?,
        })
    }
}
