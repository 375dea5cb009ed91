//! Writes a model with new positions.

use std::borrow::Cow;
use std::ffi::OsStr;
use std::path::Path;
use std::sync::Arc;

use ::gltf::json::validation::Checked;
use cagework_core::PolygonMesh;
use cagework_core::color::srgb_from_linear;
use cagework_core::field::{Field, bend_vertices};
use cagework_core::splats::Splats;
use cagework_core::words::counted;
use glam::{DVec3, Quat, Vec3};

use super::format::ModelProperty;
use super::{Document, Model, ModelFormat};
use crate::error::WriteError;
use crate::gltf::{self, Pose, PoseClip, Rest};
use crate::obj;
use crate::polygons::{Encoding, Shape};
use crate::splats::{self, Capture, MAX_COLOR, MAX_SCALE, Records, SplatsToWrite, changed, records, spz};
use crate::threemf;
use crate::timeline::Timeline;
use crate::up::UpAxis;

impl Model {
    /// Exports the model with new positions as `format`.
    ///
    /// # Errors
    /// The errors of the writer for `format`, such as [`Self::write_glb`].
    pub fn write(&self, format: ModelFormat, positions: &[Vec3]) -> Result<Vec<u8>, WriteError> {
        match &self.capture {
            Some(capture) if format.holds_splats() => {
                self.check(positions)?;
                self.write_splats(format, &Splats { positions: positions.to_vec(), ..capture.splats.clone() })
            }
            _ if format.holds_faces() => (format.facts().write)(self, positions),
            _ => Err(Self::not_written(format)),
        }
    }

    /// Error for a format that is only read, or that stores only splats, which the model lacks.
    fn not_written(format: ModelFormat) -> WriteError {
        let (is_written, format) = (format.is_written(), format.export_extension());
        let others = if is_written { ModelProperty::Faces } else { ModelProperty::Splats };
        let others = ModelFormat::listed(others);
        if is_written {
            WriteError::NoSplats { format, others }
        } else {
            WriteError::ReadOnly { format, others }
        }
    }

    /// Exports the model deformed by `field`, which is defined in the space of [`Self::positions`]. For a capture, the
    /// positions, shapes and spherical harmonics of the splats are deformed; for other models, the vertices.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn write_in_field(&self, format: ModelFormat, field: &Field) -> Result<Vec<u8>, WriteError> {
        match &self.capture {
            Some(capture) if format.holds_splats() => {
                self.write_splats(format, &capture.splats.deformed(field))
            }
            _ => {
                let mut positions = self.positions.clone();
                bend_vertices(field, &mut positions);
                self.write(format, &positions)
            }
        }
    }

    /// A capture with other splats, at rest. Exports are new files, which lack other properties and elements of the
    /// file that the capture was read from. `splats`: in the axes of [`Self::positions`].
    ///
    /// # Errors
    /// [`WriteError::NoSplats`] if the model is not a capture.
    pub fn with_splats(&self, splats: Splats) -> Result<Self, WriteError> {
        let Some(capture) = &self.capture else { return Err(Self::not_written(self.format)) };
        let records = match &capture.records {
            Records::Gltf(color_space) => Records::Gltf(color_space.clone()),
            _ => Records::New,
        };
        let positions = splats.positions.clone();
        let capture = Some(Arc::new(Capture { splats, file: Vec::new(), records }));
        Ok(Self { positions, capture, ..self.clone() })
    }

    /// Exports a capture with new positions, shapes and spherical harmonics. If `format` is the format of the capture's
    /// file and the file can be patched, unchanged splats are copied from the file, and changed splats keep all
    /// properties that are not replaced. If one of the two formats has y up and the other y down, the capture is
    /// rotated by half a turn about x.
    ///
    /// # Errors
    /// [`WriteError`] if the model is not a capture, the format cannot store splats, the number of splats differs, or a
    /// number is not finite.
    pub fn write_splats(&self, format: ModelFormat, splats: &Splats) -> Result<Vec<u8>, WriteError> {
        let Some(capture) = self.capture.as_ref().filter(|_| format.holds_splats()) else {
            return Err(Self::not_written(format));
        };
        self.check(&splats.positions)?;
        let n_harmonics = splats.harmonics.len() / splats.len().max(1);
        let tables = [
            ("the scale", &splats.scales, 1, MAX_SCALE),
            ("the colour", &splats.colors, 1, MAX_COLOR),
            ("the spherical harmonic", &splats.harmonics, n_harmonics, MAX_COLOR),
        ];
        for (what, values, per_splat, limit) in tables {
            if let Some(k) = values.iter().position(|value| !value.abs().cmple(Vec3::splat(limit)).all()) {
                let (splat, value) = (k / per_splat, values[k].to_string());
                return Err(WriteError::Splat { splat, what, value, limit: "1e15" });
            }
        }
        let is_same = format == self.format && !capture.file.is_empty();
        let changed = is_same.then(|| changed(&capture.splats, splats));
        // A .gltf refers to other files, so its bytes alone are not a complete export.
        let is_whole = format != ModelFormat::Gltf || capture.file.starts_with(b"glTF");
        if changed.as_ref().is_some_and(|changed| is_whole && !changed.contains(&true)) {
            return Ok(capture.file.clone());
        }
        let mut turned = Cow::Borrowed(splats);
        let mut turn = |turn: Quat, positions: &dyn Fn(&[Vec3]) -> Vec<Vec3>| {
            turned = Cow::Owned(Splats { positions: positions(&turned.positions), ..turned.rotated(turn) });
        };
        if self.up != UpAxis::Y {
            let to_file = Quat::from_mat4(&self.up.turn()).inverse();
            turn(to_file, &|positions| self.up.turned_back(positions).into_owned());
        }
        let mut origin = self.origin;
        let [from, to] = [self.format, format].map(ModelFormat::usual_up);
        if from != to {
            // Half a turn about x, in either direction.
            let half = UpAxis::YDown;
            turn(Quat::from_mat4(&half.turn()), &|positions| half.turned(positions).into_owned());
            origin = half.vector_turned(origin);
        }
        if is_linear(capture) && format != ModelFormat::Gltf {
            turned.to_mut().colors.iter_mut().for_each(|color| *color = color.map(srgb_from_linear));
        }
        let to_write = SplatsToWrite { splats: &turned, origin, changed: changed.as_deref() };
        Ok(match (format, &capture.records) {
            (ModelFormat::Ply, Records::Ply) => splats::ply::write(&to_write, Some(&capture.file)),
            (ModelFormat::Ply, _) => splats::ply::write(&to_write, None),
            (ModelFormat::Splat, Records::Splat) => records::write(&to_write, Some(&capture.file)),
            (ModelFormat::Splat, _) => records::write(&to_write, None),
            (ModelFormat::Spz, Records::Spz(body)) => spz::write(&to_write, Some(body))?,
            (ModelFormat::Spz, _) => spz::write(&to_write, None)?,
            (_, Records::Gltf(color_space)) => gltf::write_splats(&to_write, Some(color_space))?,
            _ => gltf::write_splats(&to_write, None)?,
        })
    }

    /// Returns a sentence that lists what an export to `format` loses; `None` if it loses nothing.
    #[must_use]
    pub fn lost_in(&self, format: ModelFormat) -> Option<String> {
        let is_same = self.format == format;
        let loses = |what| !is_same && !format.keeps(what);
        let (colors, texcoords, materials, names, rig) = match &self.document {
            Document::Polygons(document) => (
                !document.colors.is_empty() && loses(ModelProperty::Colors),
                !document.texcoords.is_empty() && loses(ModelProperty::Texcoords),
                !document.materials.is_empty() && loses(ModelProperty::Materials),
                document.groups.len() > 1 && !is_same,
                false,
            ),
            Document::Gltf(document) => {
                let has = |name: &str| {
                    let all = document.root.meshes.iter().flat_map(|mesh| &mesh.primitives);
                    let mut names = all.flat_map(|primitive| primitive.attributes.keys());
                    names.any(|key| matches!(key, Checked::Valid(key) if key.to_string().starts_with(name)))
                };
                (
                    has("COLOR_") && !is_same,
                    has("TEXCOORD_") && loses(ModelProperty::Texcoords),
                    // An OBJ export of a glTF keeps only the names of the materials.
                    self.counts.materials > 0 && loses(ModelProperty::Materials),
                    self.counts.nodes > 1 && loses(ModelProperty::Names),
                    self.is_rigged() && loses(ModelProperty::Rig),
                )
            }
        };
        let is_mesh_of_splats = self.capture.is_some() && !format.holds_splats();
        let has_harmonics = self.splats().is_some_and(|splats| splats.degree > 0) && format.holds_splats();
        let is_clamped = format == ModelFormat::Spz && self.splats().is_some_and(spz::exceeds_ranges);
        let is_converted = has_harmonics
            && !loses(ModelProperty::Harmonics)
            && format != ModelFormat::Gltf
            && self.capture.as_ref().is_some_and(|capture| is_linear(capture));
        let all = [
            (
                is_converted,
                "the exact colours from each side (harmonics of linear colours are not converted)",
            ),
            (is_clamped, "scales, colours or harmonics of splats outside the ranges of the format"),
            (is_mesh_of_splats, "everything but the centres of the splats"),
            (has_harmonics && loses(ModelProperty::Harmonics), "spherical harmonics of the splats"),
            (colors, "colours"),
            (texcoords, "texture coordinates"),
            (materials, "materials and textures"),
            (names, "names of parts"),
            (rig, "skeleton, morph targets and animations"),
            (
                self.origin != DVec3::ZERO
                    && self.encoding != Encoding::Text
                    && !format.keeps(ModelProperty::Digits),
                "the full precision of positions, as the model is far from the origin",
            ),
        ];
        let lost: Vec<&str> = all.into_iter().filter_map(|(is_lost, what)| is_lost.then_some(what)).collect();
        (!lost.is_empty())
            .then(|| format!("the {} file does not keep: {}", format.export_extension(), lost.join(", ")))
    }

    /// Returns a sentence about the copies of objects in `written`, an export to `format`; `None` without copies. An
    /// object of a 3MF that is placed several times is copied if its placements take different shapes.
    #[must_use]
    pub fn copies_in(&self, format: ModelFormat, written: &[u8]) -> Option<String> {
        let Document::Polygons(document) = &self.document else { return None };
        if [self.format, format] != [ModelFormat::ThreeMf; 2] || *document.bytes == *written {
            return None;
        }
        let n = threemf::n_objects(written).saturating_sub(threemf::n_objects(&document.bytes));
        (n > 0).then(|| {
            format!(
                "{} written, because placements of one object take different shapes: settings of a slicer for the \
                 object apply to its first shape only",
                counted(n, "copy of an object is", "copies of objects are")
            )
        })
    }

    /// Exports the model with new positions as an OBJ file.
    ///
    /// An OBJ source is patched: coordinates and normals change, all other bytes stay. Other sources become a
    /// new OBJ with their vertices in the same order. `positions`: world space, `[n_vertices]`.
    ///
    /// # Errors
    /// [`WriteError`] unless there is one finite position per vertex.
    pub fn write_obj(&self, positions: &[Vec3]) -> Result<Vec<u8>, WriteError> {
        self.check(positions)?;
        let (rest, positions) = (self.positions_in_file(), self.up.turned_back(positions));
        match &self.document {
            Document::Polygons(document) if self.format == ModelFormat::Obj => {
                Ok(obj::patch(document, &rest, &positions, self.origin))
            }
            Document::Polygons(_) => {
                let faces = self.cage_mesh().faces;
                Ok(obj::write_cage_obj(
                    &PolygonMesh { positions: positions.into_owned(), faces },
                    self.origin,
                ))
            }
            Document::Gltf(document) => {
                let rest = Rest { positions: &rest, origin: self.origin, triangles: &self.triangles };
                gltf::write_obj(document, rest, &positions)
            }
        }
    }

    /// Prepares the model with new positions as input for the writers of PLY, STL, OFF and 3MF.
    ///
    /// # Errors
    /// [`WriteError`] unless there is one finite position per vertex.
    pub(super) fn shape<'a>(&'a self, positions: &'a [Vec3]) -> Result<Shape<'a>, WriteError> {
        self.check(positions)?;
        let document = match &self.document {
            Document::Polygons(document) => Some(document.as_ref()),
            Document::Gltf(_) => None,
        };
        Ok(Shape {
            positions: self.up.turned_back(positions),
            origin: self.origin,
            triangles: &self.triangles,
            document,
            has_normals: self.has_normals,
            encoding: self.encoding,
        })
    }

    /// Exports the model with new positions as a GLB file.
    ///
    /// A glTF source keeps materials, textures (external ones are embedded), texture coordinates, names and nodes; the
    /// notices list what a deformed shape loses. An OBJ becomes one mesh. `positions`: world space, `[n_vertices]`.
    ///
    /// # Errors
    /// [`WriteError`] unless there is one finite position per vertex, there are triangles and the file fits into 4 GiB.
    pub fn write_glb(&self, positions: &[Vec3]) -> Result<Vec<u8>, WriteError> {
        self.glb(positions, &[], PoseClip::of(&Timeline::default()))
    }

    /// Exports `rest` with one morph target per pose and an animation from rest through all poses and back, with one
    /// second between successive shapes.
    ///
    /// # Errors
    /// As [`Self::write_glb`].
    pub fn write_glb_poses(
        &self,
        rest: &[Vec3],
        poses: &[(String, Vec<Vec3>)],
    ) -> Result<Vec<u8>, WriteError> {
        self.write_glb_poses_at(rest, poses, &Timeline::every_second(poses.len()))
    }

    /// Like [`Self::write_glb_poses`], with a timeline of these poses.
    ///
    /// # Errors
    /// As [`Self::write_glb`], and [`WriteError::Poses`] if the timeline has another number of poses.
    pub fn write_glb_poses_at(
        &self,
        rest: &[Vec3],
        poses: &[(String, Vec<Vec3>)],
        timeline: &Timeline,
    ) -> Result<Vec<u8>, WriteError> {
        timeline.require(poses.len())?;
        self.glb(rest, poses, PoseClip::of(timeline))
    }

    pub(crate) fn glb(
        &self,
        base: &[Vec3],
        poses: &[(String, Vec<Vec3>)],
        clip: PoseClip<'_>,
    ) -> Result<Vec<u8>, WriteError> {
        self.check(base)?;
        poses.iter().try_for_each(|(_, positions)| self.check(positions))?;
        let at_rest = self.positions_in_file();
        let base = self.up.turned_back(base);
        let turned: Vec<_> = poses.iter().map(|(_, positions)| self.up.turned_back(positions)).collect();
        let document = match &self.document {
            Document::Gltf(document) => {
                let rest = Rest { positions: &at_rest, origin: self.origin, triangles: &self.triangles };
                return gltf::patch(document, rest, &base, &named(poses, &turned), clip);
            }
            Document::Polygons(_) if self.triangles.is_empty() => {
                return Err(WriteError::NoFaces { format: "GLB" });
            }
            Document::Polygons(document) => document,
        };
        // Build a GLB of the rest shape, then patch it like a glTF source. The name may be a path, which stays private.
        let stem = Path::new(&self.name).file_stem().and_then(OsStr::to_str).unwrap_or_default();
        let (glb, source) = gltf::build_from_obj(stem, document, &at_rest, self.origin)?;
        let built = gltf::read_written(&self.name, &glb, self.origin)?;
        let spread = |positions: &[Vec3]| source.iter().map(|&v| positions[v as usize]).collect::<Vec<_>>();
        let spread_poses: Vec<_> = turned.iter().map(|positions| spread(positions).into()).collect();
        let rest = Rest { positions: &built.positions, origin: self.origin, triangles: &built.triangles };
        gltf::patch(&built.document, rest, &spread(&base), &named(poses, &spread_poses), clip)
    }

    fn check(&self, positions: &[Vec3]) -> Result<(), WriteError> {
        if positions.len() != self.positions.len() {
            return Err(WriteError::Count { given: positions.len(), expected: self.positions.len() });
        }
        match positions.iter().position(|p| !p.is_finite()) {
            Some(vertex) => Err(WriteError::NotFinite { vertex }),
            None => Ok(()),
        }
    }
}

/// Whether the numbers of the colours are linear. Those of all formats but glTF are sRGB.
fn is_linear(capture: &Capture) -> bool {
    matches!(&capture.records, Records::Gltf(space) if space == gltf::LINEAR_SPLATS)
}

/// Pairs the name of each pose with its positions in the axes and vertex order of the exported document.
fn named<'a>(poses: &'a [(String, Vec<Vec3>)], positions: &'a [Cow<'_, [Vec3]>]) -> Vec<Pose<'a>> {
    poses.iter().zip(positions).map(|((name, _), positions)| Pose { name, positions }).collect()
}
