//! A file that has been read but is not displayed yet. In this state, the browser decodes its textures.

use std::collections::VecDeque;
use std::sync::Arc;

use cagework_core::words::{size_rounded_down, size_rounded_up};
use cagework_core::{PolygonMesh, TriMesh};
use cagework_editor::{DocumentSettings, MemberSettings, up_of_capture};
use cagework_gpu::render::{Alpha, DrawGroup, DrawModel, DrawTexture, DrawVertex, Wrap};
use cagework_io::{
    Look, LookAlpha, LookWrap, Model, ModelFormat, RestoreError, Store, StoredArrays, TexturePlan, UpAxis,
    read_project, shown, transfer_report,
};
use glam::{DVec3, Vec3};
use js_sys::{Function, Uint8Array};
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{JsCast as _, JsValue};

use crate::arrays::flat;
use crate::cage::CageArrays;
use crate::error::{Answer, ErrorName, Fault};
use crate::options::{HELD_LIMIT, READ_LIMIT, decode};
use crate::views::{object, optional};

/// The bytes of a file, copied into wasm memory in chunks, so that JavaScript never holds the whole file.
#[wasm_bindgen]
pub struct FileBytes(Vec<u8>);

#[wasm_bindgen]
impl FileBytes {
    /// Reserves memory for a file of `size` bytes.
    #[wasm_bindgen(constructor)]
    pub fn new(size: usize) -> Self {
        Self(Vec::with_capacity(size))
    }

    /// Appends a chunk.
    pub fn push(&mut self, chunk: &Uint8Array) {
        let start = self.0.len();
        self.0.resize(start + chunk.length() as usize, 0);
        chunk.copy_to(&mut self.0[start..]);
    }
}

/// A model with its materials, and the other contents of its file.
#[wasm_bindgen]
pub struct LoadedModel {
    pub(crate) model: Model,
    cage: Option<PolygonMesh>,
    look: Look,
    textures: Vec<DrawTexture>,
    /// Upper limit of the longer side of decoded textures, pixels. Larger textures are scaled down to this limit.
    side: u32,
    poses: Vec<(String, Vec<Vec3>)>,
    settings: Option<String>,
    /// Index of the model in its project.
    number: usize,
    /// The remaining models of a project.
    more: VecDeque<Self>,
}

#[wasm_bindgen]
impl LoadedModel {
    /// Reads a model of any supported format, or a project. Call [`Self::prepare`] next. `sibling` is called with the
    /// path of each file that the model refers to, and returns a Uint8Array or undefined. `held`: memory of the other
    /// models that are open, bytes.
    ///
    /// # Errors
    /// If the file cannot be read, or the models would take more memory than a page holds.
    pub fn read(name: &str, bytes: FileBytes, sibling: &Function, held: f64) -> Answer<LoadedModel> {
        // A model takes at least the bytes of its file.
        require_room(name, bytes.0.len() as u64, held as u64)?;
        let loaded = Self::from_bytes(name, bytes.0, sibling)?;
        require_room(name, loaded.bytes() as u64, held as u64)?;
        Ok(loaded)
    }

    /// Approximate memory of all models of the file, bytes.
    #[wasm_bindgen(getter)]
    pub fn bytes(&self) -> f64 {
        self.more.iter().fold(self.model.bytes() as f64, |sum, next| sum + next.model.bytes() as f64)
    }

    /// Whether a file that begins with `start` is an FBX, which is converted to a GLB before it is read.
    #[wasm_bindgen(js_name = isFbx)]
    pub fn is_fbx(name: &str, start: &[u8]) -> bool {
        ModelFormat::of_file(name, start) == Ok(ModelFormat::Fbx)
    }

    /// Reads materials and textures of all models of the file; call it before [`Self::take_next`]. It is separate from
    /// [`Self::read`] so that the page can handle events in between. `used`: number of texture pixels of the other
    /// models that are drawn together with these.
    pub fn prepare(&mut self, used: f64) {
        self.more.iter_mut().for_each(Self::read_look);
        self.read_look();
        let looks: Vec<&Look> =
            [&self.look].into_iter().chain(self.more.iter().map(|next| &next.look)).collect();
        let TexturePlan { side, admitted, notices } = TexturePlan::new(&looks, used as u64);
        self.model.notices.extend(notices);
        self.keep_images(side, &admitted[0]);
        for (next, admitted) in self.more.iter_mut().zip(&admitted[1..]) {
            next.keep_images(side, admitted);
        }
    }

    /// Sets the up axis of the file, and rotates model, cage and poses accordingly.
    ///
    /// # Errors
    /// If `up` is not an up axis.
    #[wasm_bindgen(js_name = setUp)]
    pub fn set_up(&mut self, #[wasm_bindgen(unchecked_param_type = "UpAxis")] up: JsValue) -> Answer<()> {
        self.turn_to(decode(up)?);
        Ok(())
    }

    /// Origin of model, cage and poses, in the file's axes; zero unless the model is far from the world origin. `[3]`
    #[wasm_bindgen(getter)]
    pub fn origin(&self) -> Vec<f64> {
        self.model.origin().to_array().to_vec()
    }

    /// Expresses the positions of a model or a cage relative to `origin`, the origin of another file. `[3]`
    ///
    /// # Errors
    /// If `origin` is not three numbers, or is too far from the model.
    #[wasm_bindgen(js_name = seeFrom)]
    pub fn see_from(&mut self, origin: &[f64]) -> Answer<()> {
        let origin: [f64; 3] =
            origin.try_into().map_err(|_| Fault::new(ErrorName::Error, "origin must be three numbers"))?;
        self.model.set_origin(DVec3::from_array(origin));
        if self.model.positions.iter().all(|p| p.is_finite()) {
            return Ok(());
        }
        Err(Fault::new(ErrorName::Error, "origin is too far from the model"))
    }

    /// Gives these clothes the joints, joint weights and morph targets of `body`. Returns what was copied, as an English
    /// sentence.
    ///
    /// # Errors
    /// Those of `Model::with_skin_of`; the clothes are then unchanged.
    #[wasm_bindgen(js_name = takeSkinOf)]
    pub fn take_skin_of(&mut self, body: &LoadedModel) -> Answer<String> {
        let taken = self.model.with_skin_of(&body.model, READ_LIMIT);
        let (model, found) = taken.map_err(|e| Fault::new(ErrorName::Error, e))?;
        self.model = model;
        Ok(transfer_report(&found).join("; "))
    }

    /// Converts the model to arrays, from which [`Self::restore`] recreates it in another instance of the module
    /// without reading its file. Call it after [`Self::prepare`] and [`Self::take_next`]. The cage is not included.
    pub fn store(mut self) -> Vec<Uint8Array> {
        // Images are decoded before the model is stored.
        self.look.images.iter_mut().for_each(|image| image.bytes = Vec::new());
        let mut store = Store::default();
        let names: Vec<&str> = self.poses.iter().map(|(name, _)| name.as_str()).collect();
        store.push_json(&(&self.settings, self.number, names));
        for (_, positions) in &self.poses {
            store.push(positions);
        }
        self.look.store(&mut store);
        self.model.store(&mut store);
        store.into_arrays().into_iter().map(|bytes| Uint8Array::from(bytes.as_slice())).collect()
    }

    /// Rebuilds a model from the arrays of [`Self::store`].
    ///
    /// # Errors If the arrays are not from [`Self::store`].
    pub fn restore(arrays: Vec<Uint8Array>) -> Answer<LoadedModel> {
        let mut arrays = arrays.into_iter();
        let mut next = || arrays.next().map(|array| array.to_vec());
        Self::restored(&mut StoredArrays(&mut next)).map_err(|error| Fault::new(ErrorName::Error, error))
    }

    /// Removes and returns the next remaining model of a project; undefined after the last one.
    #[wasm_bindgen(js_name = takeNext)]
    pub fn take_next(&mut self) -> Option<LoadedModel> {
        self.more.pop_front()
    }

    /// Vertices of the model. `[n_vertices, 3]`
    #[wasm_bindgen(getter)]
    pub fn positions(&self) -> Vec<f32> {
        flat(&self.model.positions)
    }

    /// Vertices that a cage must enclose: those of the model or, for splats, of the mesh that approximates them.
    /// `[n_vertices, 3]`
    #[wasm_bindgen(getter, js_name = checkedPositions)]
    pub fn checked_positions(&self) -> Vec<f32> {
        match self.model.drawn_splats() {
            Some(splats) => flat(&splats.stand_in().positions),
            None => flat(&self.model.positions),
        }
    }

    /// The cage of a project; undefined for other files.
    #[wasm_bindgen(getter, unchecked_return_type = "CageArrays | undefined")]
    pub fn cage(&self) -> JsValue {
        optional(self.cage.as_ref().map(|mesh| {
            let (cage, _) = self.document_settings().cage(mesh);
            CageArrays { controls: cage.map(|cage| cage.controls), ..CageArrays::of(mesh) }
        }))
    }

    /// The mesh of the model, used as a cage.
    #[wasm_bindgen(js_name = asCage, unchecked_return_type = "CageArrays")]
    pub fn as_cage(&self) -> JsValue {
        object(&CageArrays::of(&self.model.cage_mesh()))
    }

    /// Number of textures to decode.
    #[wasm_bindgen(getter, js_name = textureCount)]
    pub fn texture_count(&self) -> usize {
        self.look.images.len()
    }

    /// Upper limit of the longer side of decoded textures, pixels. Larger textures must be scaled down to this limit.
    #[wasm_bindgen(getter, js_name = textureSide)]
    pub fn texture_side(&self) -> u32 {
        self.side
    }

    /// Encoded bytes of a texture; empty if the texture is not drawn.
    #[wasm_bindgen(js_name = textureBytes)]
    pub fn texture_bytes(&self, index: usize) -> Vec<u8> {
        self.look.images.get(index).map(|t| t.bytes.clone()).unwrap_or_default()
    }

    /// Media type of a texture; empty if unknown.
    #[wasm_bindgen(js_name = textureType)]
    pub fn texture_type(&self, index: usize) -> String {
        self.look.images.get(index).map(|t| t.mime.clone()).unwrap_or_default()
    }

    /// Sets the decoded pixels of a texture: RGBA, rows from the top. `[height, width, 4]`
    #[wasm_bindgen(js_name = setTexture)]
    pub fn set_texture(&mut self, index: usize, width: u32, height: u32, rgba: Vec<u8>) {
        let fits = rgba.len() as u64 == 4 * u64::from(width) * u64::from(height);
        if let Some(texture) = self.textures.get_mut(index).filter(|_| fits) {
            *texture = DrawTexture { width, height, rgba, wrap: texture.wrap };
        }
    }

    /// JSON of the page's settings in a project; undefined for other files.
    #[wasm_bindgen(getter)]
    pub fn settings(&self) -> Option<String> {
        self.settings.clone()
    }
}

/// Checks that a model of `bytes` can be opened beside models of `held` bytes.
fn require_room(name: &str, bytes: u64, held: u64) -> Answer<()> {
    if held == 0 || held.saturating_add(bytes) <= HELD_LIMIT {
        return Ok(());
    }
    let message = format!(
        "{} takes {} of memory and the models that are open take {}, together more than the limit of {}: remove a model \
         first, or use smaller ones",
        shown(name),
        size_rounded_up(bytes),
        size_rounded_up(held),
        size_rounded_down(HELD_LIMIT)
    );
    Err(Fault::new(ErrorName::Format, message))
}

impl LoadedModel {
    fn from_bytes(name: &str, bytes: Vec<u8>, sibling: &Function) -> Answer<Self> {
        if let Some(project) = read_project(name, &bytes, READ_LIMIT)? {
            let mut models = project.models.into_iter().enumerate().map(|(number, model)| {
                let settings = Some(project.settings.clone());
                Self { number, settings, ..Self::new(model) }
            });
            let mut loaded = models.next().ok_or_else(|| Fault::missing("model", "the project has none"))?;
            loaded.more = models.collect();
            loaded.cage = Some(project.cage);
            loaded.poses = project.poses;
            let notice =
                loaded.document_settings().cage(loaded.cage.as_ref().unwrap_or(&PolygonMesh::default())).1;
            loaded.model.notices.extend(notice.map(str::to_owned));
            return Ok(loaded);
        }
        let mut resolve = |path: &str| {
            let found = sibling.call1(&JsValue::NULL, &path.into()).ok()?;
            Some(Ok(found.dyn_into::<Uint8Array>().ok()?.to_vec()))
        };
        let model = Model::read_within(name, bytes, &mut resolve, READ_LIMIT)?;
        if model.positions.is_empty() {
            model.require_faces()?;
        }
        Ok(Self::new(model))
    }

    pub(crate) fn new(model: Model) -> Self {
        let (look, textures, side) = (Look::default(), Vec::new(), 0);
        let (poses, more) = (Vec::new(), VecDeque::new());
        Self { model, cage: None, look, textures, side, poses, settings: None, number: 0, more }
    }

    fn restored(from: &mut StoredArrays<'_>) -> Result<Self, RestoreError> {
        let (settings, number, names): (Option<String>, usize, Vec<String>) = from.json()?;
        let poses = names.into_iter().map(|name| Ok((name, from.numbers()?)));
        let poses = poses.collect::<Result<_, RestoreError>>()?;
        let look = Look::restore(from)?;
        let mut loaded = Self { settings, number, poses, ..Self::new(Model::restore(from)?) };
        loaded.set_look(look);
        Ok(loaded)
    }

    fn read_look(&mut self) {
        let look = self.model.look();
        self.set_look(look);
    }

    fn set_look(&mut self, look: Look) {
        self.look = look;
        self.textures = vec![DrawTexture::default(); self.look.images.len()];
        let wrap = |wrap: LookWrap| match wrap {
            LookWrap::Repeat => Wrap::Repeat,
            LookWrap::Mirror => Wrap::Mirror,
            LookWrap::Clamp => Wrap::Clamp,
        };
        for group in &self.look.groups {
            if let Some(image) = group.image {
                self.textures[image as usize].wrap = group.wrap.map(wrap);
            }
        }
    }

    /// Sets the upper limit of the longer side of textures, and drops the bytes of images that are not decoded.
    /// `admitted`: for each image, whether it is decoded.
    fn keep_images(&mut self, side: u32, admitted: &[bool]) {
        self.side = side;
        let images = self.look.images.iter_mut().zip(admitted);
        images.filter(|(_, is_admitted)| !**is_admitted).for_each(|(image, _)| image.bytes = Vec::new());
    }

    /// Saved poses of a project.
    pub(crate) fn poses(&self) -> &[(String, Vec<Vec3>)] {
        &self.poses
    }

    fn document_settings(&self) -> DocumentSettings {
        self.settings.as_deref().map(DocumentSettings::read).unwrap_or_default()
    }

    /// Rotates model, cage and poses from the current up axis to `up`.
    pub(crate) fn turn_to(&mut self, up: UpAxis) {
        let before = self.model.up();
        let turn = |positions: &mut Vec<Vec3>| {
            *positions = up.turned(&before.turned_back(positions)).into_owned();
        };
        self.model.set_up(up);
        self.cage.iter_mut().for_each(|cage| turn(&mut cage.positions));
        self.poses.iter_mut().for_each(|(_, positions)| turn(positions));
        self.more.iter_mut().for_each(|next| next.turn_to(up));
    }

    /// Turns a capture to the up axis that its file probably has.
    pub(crate) fn stand_up(&mut self) {
        if let Some(up) = up_of_capture(&self.model) {
            self.turn_to(up);
        }
    }

    /// Settings of this model in its project.
    pub(crate) fn member_settings(&self) -> Option<MemberSettings> {
        self.document_settings().models.into_iter().nth(self.number)
    }

    /// Takes the data for the renderer out of this file, without textures that were not decoded.
    pub(crate) fn draw_model(&mut self) -> DrawModel {
        if let Some(splats) = self.model.drawn_splats() {
            let TriMesh { positions, triangles } = splats.stand_in();
            return DrawModel {
                splats: Some(Arc::new(splats.into_owned())),
                ..DrawModel::plain(positions, triangles)
            };
        }
        let look = std::mem::take(&mut self.look);
        let textures = std::mem::take(&mut self.textures);
        let decoded: Vec<bool> = textures.iter().map(|t| !t.rgba.is_empty()).collect();
        let mut number = 0;
        let numbers: Vec<Option<u32>> = decoded
            .iter()
            .map(|&decoded| {
                number += u32::from(decoded);
                decoded.then(|| number - 1)
            })
            .collect();
        let groups = look.groups.into_iter().map(|group| {
            let texture = group.image.and_then(|t| numbers[t as usize]);
            DrawGroup {
                triangles: group.triangles,
                base_color: group.base_color,
                texture,
                alpha: match group.alpha {
                    LookAlpha::Opaque => Alpha::Opaque,
                    LookAlpha::Mask { cutoff } => Alpha::Mask { cutoff },
                    LookAlpha::Blend => Alpha::Blend,
                },
            }
        });
        let unit = |x: f32| (x.clamp(0.0, 1.0) * f32::from(u16::MAX)).round() as u16;
        let vertex =
            |c: &cagework_io::LookVertex| DrawVertex { source: c.source, uv: c.uv, color: c.color.map(unit) };
        DrawModel {
            positions: self.model.positions.clone(),
            copies: look.copies,
            vertices: look.vertices.iter().map(vertex).collect(),
            groups: groups.collect(),
            triangles: look.triangles,
            textures: textures.into_iter().filter(|t| !t.rgba.is_empty()).map(Arc::new).collect(),
            splats: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_are_refused_beside_large_ones() {
        let mib = 1 << 20;
        assert!(require_room("a.glb", 900 * mib, 0).is_ok(), "a single model has a limit of its own");
        assert!(require_room("a.glb", 41 * mib, 300 * mib).is_ok());
        let refused = require_room("a.glb", 42 * mib, 300 * mib).unwrap_err();
        assert_eq!(
            refused.message(),
            "a.glb takes 42 MiB of memory and the models that are open take 300 MiB, together more than the limit of \
             341 MiB: remove a model first, or use smaller ones"
        );
    }
}
