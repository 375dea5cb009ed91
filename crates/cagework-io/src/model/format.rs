//! File formats of models. To add a format, add a file beside `ply.rs` and a row of [`ModelFormat`].

use glam::Vec3;
use thiserror::Error;

use super::read::Source;
use super::{Model, ReadError};
use crate::error::WriteError;
use crate::polygons::Shape;
use crate::shown::{shown, without_byte_order_mark};
use crate::siblings::Resolve;
use crate::splats::{records, sog, spz};
use crate::up::UpAxis;
use crate::{fbx, gltf, obj, off, ply, stl, threemf};

/// Extensions, MIME types and capabilities of a format, and the functions that read and write it.
#[derive(Debug)]
pub struct FormatFacts {
    /// Extensions of readable files, lower case, without the dot. The first one is the extension of exported files.
    pub endings: &'static [&'static str],
    /// Extensions among `endings` that are supported for reading only.
    read_only: &'static [&'static str],
    /// Names of readable files whose extension is not that of a model, lower case.
    pub names: &'static [&'static str],
    /// MIME types, for file choosers that support MIME types better than extensions. The first one is used for exported
    /// files.
    pub mime_types: &'static [&'static str],
    /// Extensions of files that refer to other files: buffers, textures, materials.
    pub naming: &'static [&'static str],
    /// Extensions of the other files that files of this format refer to.
    pub companions: &'static [&'static str],
    /// Whether the bytes identify a file of this format.
    is: fn(&[u8]) -> bool,
    /// Whether a text looks like this format. The text has no byte order mark and no leading space.
    is_text: fn(&[u8]) -> bool,
    /// Extensions whose files must satisfy `is` or `is_text`. Each entry has the extension, a description of a file
    /// that does not satisfy them, such as "not a PLY", and the reason, such as "its first line is not 'ply'".
    marked: &'static [[&'static str; 3]],
    pub(super) read: fn(Source<'_, '_>) -> Result<Model, ReadError>,
    pub(super) write: fn(&Model, &[Vec3]) -> Result<Vec<u8>, WriteError>,
    /// Names of the files that a file refers to.
    pub(super) named_files: fn(&[u8], &mut Resolve<'_>, u64) -> Vec<String>,
    /// Approximate memory for writing a model, bytes. The second argument is the part of it that depends only
    /// on the numbers of vertices and triangles.
    pub(super) bytes_to_write: fn(&Model, u64) -> u64,
    /// Properties that a file in this format keeps of a model that was read from another format.
    keeps: &'static [ModelProperty],
    /// Whether a file is recognised by its extension alone, whatever its bytes look like.
    is_unmarked: bool,
}

/// A property of a model that files of some formats keep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ModelProperty {
    /// Meshes. Formats without this property store only splats.
    Faces,
    /// Gaussian splats.
    Splats,
    /// Spherical harmonics of splats.
    Harmonics,
    /// The order of the vertices.
    Order,
    /// Positions far from the world origin without rounding to f32.
    Digits,
    Colors,
    Texcoords,
    Materials,
    /// Names of the parts of a glTF.
    Names,
    /// Skeleton, morph targets and animations.
    Rig,
    /// Several poses.
    Poses,
}

/// Defaults for the facts about a format: no companions, recognised by the extension only.
const DEFAULT_FACTS: FormatFacts = FormatFacts {
    endings: &[],
    read_only: &[],
    names: &[],
    mime_types: &[],
    naming: &[],
    companions: &[],
    is: |_| false,
    is_text: |_| false,
    marked: &[],
    read: |source| source.obj(),
    named_files: |_, _, _| Vec::new(),
    write: Model::write_obj,
    bytes_to_write: |_, shape| shape,
    keeps: &[],
    is_unmarked: false,
};

/// Defines [`ModelFormat`] and the facts about each format.
macro_rules! formats {
    ($($(#[$about:meta])* $format:ident = $name:literal: $row:expr;)+) => {
        /// File format of a model.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
        #[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
        pub enum ModelFormat {
            $($(#[$about])* #[serde(rename = $name)] $format,)+
        }

        impl ModelFormat {
            /// All formats, in the order in which they are shown to users.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$format),+];

            /// Short name, lower case, also in serialised data: "gltf", "ply".
            #[must_use]
            pub fn name(self) -> &'static str {
                match self { $(Self::$format => $name,)+ }
            }

            /// Extensions, capabilities and functions of the format.
            #[must_use]
            pub fn facts(self) -> &'static FormatFacts {
                match self { $(Self::$format => const { &$row },)+ }
            }
        }
    };
}

formats! {
    /// glTF 2.0: JSON or GLB to read, GLB to write.
    Gltf = "gltf": FormatFacts {
        endings: &["glb", "vrm", "gltf"],
        read_only: &["gltf"],
        names: &[],
        mime_types: &["model/gltf-binary", "model/gltf+json"],
        naming: &["gltf"],
        companions: &["bin", "png", "jpg", "jpeg", "webp", "ktx2"],
        is: |bytes| bytes.starts_with(b"glTF"),
        is_text: |text| text.starts_with(b"{"),
        marked: &[
            ["glb", "not a GLB", "its first four bytes are not 'glTF'"],
            ["vrm", "not a VRM", "its first four bytes are not 'glTF'"],
            ["gltf", "not a glTF", "it does not begin with '{'"],
        ],
        read: |source| source.gltf(),
        named_files: |bytes, _, memory_limit| gltf::named_files(bytes, memory_limit),
        write: Model::write_glb,
        // Each primitive adds about 6000 bytes of JSON for new accessors and buffer views.
        bytes_to_write: |model, shape| shape + 6000 * model.counts.primitives as u64 + model.bytes,
        keeps: &[
            ModelProperty::Faces,
            ModelProperty::Splats,
            ModelProperty::Harmonics,
            ModelProperty::Digits,
            ModelProperty::Colors,
            ModelProperty::Texcoords,
            ModelProperty::Materials,
            ModelProperty::Rig,
            ModelProperty::Poses,
        ],
        is_unmarked: false,
    };
    /// Autodesk FBX, binary or text, to read. The model's document is a glTF, and GLB is its format.
    Fbx = "fbx": FormatFacts {
        endings: &["fbx"],
        read_only: &["fbx"],
        naming: &["fbx"],
        is: |bytes| bytes.starts_with(b"Kaydara FBX Binary"),
        is_text: |text| text.starts_with(b"; FBX"),
        read: |source| source.fbx(),
        named_files: |bytes, _, memory_limit| fbx::named_files(bytes, memory_limit),
        write: Model::write_glb,
        keeps: &[ModelProperty::Faces, ModelProperty::Rig, ModelProperty::Poses],
        ..DEFAULT_FACTS
    };
    /// Wavefront OBJ.
    Obj = "obj": FormatFacts {
        endings: &["obj"],
        mime_types: &["model/obj"],
        naming: &["obj"],
        companions: &["mtl"],
        named_files: obj::named_files,
        // `shape` is an estimate for exports with normals. An OBJ without normals needs a third of it.
        bytes_to_write: |model, shape| shape / 3 + model.bytes,
        keeps: &[ModelProperty::Faces, ModelProperty::Order, ModelProperty::Digits, ModelProperty::Texcoords, ModelProperty::Names],
        ..DEFAULT_FACTS
    };
    /// Stanford PLY, text or binary.
    Ply = "ply": FormatFacts {
        endings: &["ply"],
        is: ply::is_ply,
        marked: &[["ply", "not a PLY", "its first line is not 'ply'"]],
        read: |source| source.ply(),
        write: |model, positions| model.shape(positions).map(|shape| ply::write(&shape)),
        keeps: &[
            ModelProperty::Faces,
            ModelProperty::Splats,
            ModelProperty::Harmonics,
            ModelProperty::Order,
            ModelProperty::Digits,
            ModelProperty::Colors,
        ],
        ..DEFAULT_FACTS
    };
    /// STL, text or binary.
    Stl = "stl": FormatFacts {
        endings: &["stl"],
        mime_types: &["model/stl"],
        is: stl::is_stl,
        read: |source| source.polygons(ModelFormat::Stl, stl::read),
        write: |model, positions| model.shape(positions).and_then(|shape| stl::write(&shape)),
        keeps: &[ModelProperty::Faces],
        ..DEFAULT_FACTS
    };
    /// Geomview OFF, text: OFF, COFF, NOFF.
    Off = "off": FormatFacts {
        endings: &["off"],
        is_text: off::is_off,
        read: |source| source.polygons(ModelFormat::Off, off::read),
        write: |model, positions| {
            let has_normals = model.has_normals && model.format == ModelFormat::Off;
            model.shape(positions).map(|shape| off::write(&Shape { has_normals, ..shape }))
        },
        keeps: &[ModelProperty::Faces, ModelProperty::Order, ModelProperty::Digits, ModelProperty::Colors],
        ..DEFAULT_FACTS
    };
    /// 3MF, the format of slicers: a zip archive with a model in XML.
    ThreeMf = "3mf": FormatFacts {
        endings: &["3mf"],
        mime_types: &["model/3mf"],
        is: threemf::is_3mf,
        marked: &[["3mf", "not a 3MF", "it is not a zip archive with a model part"]],
        read: |source| source.polygons(ModelFormat::ThreeMf, threemf::read),
        write: |model, positions| {
            let shape = model.shape(positions)?;
            match shape.document {
                Some(document) if model.format == ModelFormat::ThreeMf => {
                    threemf::patch(&document.bytes, &model.positions_in_file(), &shape)
                }
                _ => threemf::write(&shape),
            }
        },
        // The model's bytes include the archive and its unpacked text.
        bytes_to_write: |model, shape| shape + 2 * model.bytes,
        keeps: &[ModelProperty::Faces, ModelProperty::Order, ModelProperty::Digits],
        ..DEFAULT_FACTS
    };
    /// `.splat`: Gaussian splats in uncompressed records of 32 bytes.
    Splat = "splat": FormatFacts {
        endings: &["splat"],
        read: |source| source.splats(ModelFormat::Splat, records::read),
        keeps: &[ModelProperty::Splats],
        is_unmarked: true,
        ..DEFAULT_FACTS
    };
    /// SPZ: Niantic Labs' compressed format for Gaussian splats.
    Spz = "spz": FormatFacts {
        endings: &["spz"],
        is: spz::is_spz,
        marked: &[["spz", "not an SPZ", "neither it nor its gzip stream begins with 'NGSP'"]],
        read: |source| source.splats(ModelFormat::Spz, spz::read),
        keeps: &[ModelProperty::Splats, ModelProperty::Harmonics],
        ..DEFAULT_FACTS
    };
    /// SOG: PlayCanvas' compressed format for Gaussian splats. It is read, but not written.
    Sog = "sog": FormatFacts {
        endings: &["sog"],
        read_only: &["sog"],
        names: &["meta.json"],
        naming: &["json"],
        is: sog::is_sog,
        marked: &[["sog", "not a SOG", "it is not a zip archive with a meta.json"]],
        read: |source| source.sog(),
        named_files: |bytes, _, _| sog::named_files(bytes),
        ..DEFAULT_FACTS
    };
}

/// A file is not in a supported format.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{} is {found}: {hint}", shown(name))]
pub struct FormatError {
    /// Name given by the caller.
    pub name: String,
    /// Description of the content, such as "a Blender file".
    pub found: &'static str,
    /// Advice to the user.
    pub hint: String,
}

impl ModelFormat {
    /// Extension of exported files, lower case, without the dot.
    #[must_use]
    pub fn export_extension(self) -> &'static str {
        self.facts().endings[0]
    }

    /// Whether files of this format are written, not only read.
    #[must_use]
    pub fn is_written(self) -> bool {
        !self.facts().read_only.contains(&self.export_extension())
    }

    /// Format of the exports of a model of this format, unless the user chooses another one: PLY for a SOG, which is not
    /// written.
    #[must_use]
    pub fn of_exports(self) -> Self {
        if self.is_written() { self } else { Self::Ply }
    }

    /// Whether a file of this format can store several poses of a model.
    #[must_use]
    pub fn holds_poses(self) -> bool {
        self.keeps(ModelProperty::Poses)
    }

    /// Conventional up axis of captures in this format, and of all models in a 3MF.
    #[must_use]
    pub fn usual_up(self) -> UpAxis {
        match self {
            Self::Ply | Self::Splat | Self::Sog => UpAxis::YDown,
            Self::ThreeMf => UpAxis::Z,
            _ => UpAxis::Y,
        }
    }

    pub(crate) fn keeps(self, what: ModelProperty) -> bool {
        self.facts().keeps.contains(&what)
    }

    /// Whether a file of this format can store meshes, not only splats.
    #[must_use]
    pub fn holds_faces(self) -> bool {
        self.keeps(ModelProperty::Faces)
    }

    /// Whether a file of this format can store Gaussian splats.
    #[must_use]
    pub fn holds_splats(self) -> bool {
        self.keeps(ModelProperty::Splats)
    }

    /// Extensions of the formats that can be written and keep the property `what`, as text: "OBJ, PLY, OFF or 3MF".
    pub(crate) fn listed(what: ModelProperty) -> String {
        let all = Self::ALL.into_iter().filter(|format| format.is_written() && format.keeps(what));
        let names: Vec<String> = all.map(|format| format.export_extension().to_uppercase()).collect();
        names.split_last().map_or(String::new(), |(last, others)| format!("{} or {last}", others.join(", ")))
    }

    /// Finds the export format for a file name by its extension.
    #[must_use]
    pub fn of_export(name: &str) -> Option<Self> {
        let extension = extension(name);
        Self::of_ending(&extension).filter(|format| !format.facts().read_only.contains(&extension.as_str()))
    }

    /// Whether a file name has the extension of a readable model and is not hidden.
    #[must_use]
    pub fn is_name_of_model(name: &str) -> bool {
        let is_named = |format: &Self| format.facts().names.iter().any(|of| of.eq_ignore_ascii_case(name));
        !name.starts_with('.') && (Self::of_name(name).is_some() || Self::ALL.iter().any(is_named))
    }

    /// Finds the format of a file name by its extension, also one that is only read.
    #[must_use]
    pub fn of_name(name: &str) -> Option<Self> {
        Self::of_ending(&extension(name))
    }

    fn of_ending(extension: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.facts().endings.contains(&extension))
    }

    /// Detects the format of a file from its content or, if the content identifies no format, from its extension. The
    /// default is OBJ.
    ///
    /// # Errors
    /// [`FormatError`] if the content contradicts the file's extension or is known to be something else.
    pub fn of_file(name: &str, bytes: &[u8]) -> Result<Self, FormatError> {
        let fault = |found, hint: &str| Err(FormatError { name: name.into(), found, hint: hint.into() });
        let export = format!("export it as {}", Self::listed(ModelProperty::Faces));
        let text = without_byte_order_mark(bytes).trim_ascii_start();
        let ending = extension(name);
        if ["ksplat", "lcc"].contains(&ending.as_str()) {
            let hint = format!("convert it with `splat-transform IN.{ending} OUT.ply`");
            return fault("a compressed capture of Gaussian splats", &hint);
        }
        let unmarked = |format: &Self| format.facts().is_unmarked && !bytes.is_empty();
        if let Some(format) = Self::of_ending(&ending).filter(unmarked) {
            return Ok(format);
        }
        if let Some(found) = Self::ALL.into_iter().find(|format| (format.facts().is)(bytes)) {
            return Ok(found);
        }
        match bytes {
            [] => return fault("empty", "the file has no bytes"),
            [b'P', b'K', 3, 4, ..] if ending == "npz" => {
                return fault("weights or arrays, not a model", &export);
            }
            [b'P', b'K', 3, 4, ..] if !["3mf", "sog"].contains(&ending.as_str()) => {
                return fault("a zip archive", "unpack it first");
            }
            [b'B', b'L', b'E', b'N', b'D', b'E', b'R', ..] => return fault("a Blender file", &export),
            [0xff, 0xfe, ..]
            | [0xfe, 0xff, ..]
            | [b'#' | b'v' | b'o' | b'g' | b's' | b'm' | b'p' | b'{', 0, ..] => {
                return fault("a UTF-16 text", "save it as UTF-8");
            }
            _ if text.starts_with(b"version https://git-lfs.github.com/spec/") => {
                return fault("a Git LFS pointer, not the file itself", "fetch the file with `git lfs pull`");
            }
            [b'<', ..] => return fault("an XML or HTML file", &export),
            _ => {}
        }
        if let Some(found) = Self::ALL.into_iter().find(|format| (format.facts().is_text)(text)) {
            return Ok(found);
        }
        if ["dae", "usdz", "usd", "3ds", "blend"].contains(&ending.as_str()) {
            return fault("in an unsupported format", &export);
        }
        let format = Self::of_ending(&ending).unwrap_or(Self::Obj);
        match format.facts().marked.iter().find(|[of, ..]| *of == ending) {
            Some([_, found, sign]) => fault(found, &format!("{sign}: it is damaged or has the wrong name")),
            None => Ok(format),
        }
    }
}

fn extension(name: &str) -> String {
    name.rsplit_once('.').map_or(String::new(), |(_, extension)| extension.to_ascii_lowercase())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first two tables of docs/formats.md have a row for each format.
    #[test]
    fn page_about_formats_has_every_format_and_extension() {
        let page = include_str!("../../../../docs/formats.md");
        let tables: Vec<&str> = page.split("\n## ").collect();
        for format in ModelFormat::ALL {
            let starts = |row: &&str| {
                let name = row.trim_start_matches("| ").split([' ', ':']).next().unwrap_or_default();
                row.starts_with("| ") && name.to_lowercase() == format.name()
            };
            let row = tables[0].lines().find(starts).unwrap_or_default();
            let says = |ending: &&str| *ending == format.name() || row.contains(&format!("`.{ending}`"));
            assert!(!row.is_empty() && format.facts().endings.iter().all(says), "{format:?}: {row}");
            assert!(tables[1].lines().any(|row| starts(&row)), "{format:?}");
        }
    }

    #[test]
    fn lists_name_the_formats_that_keep_something() {
        assert_eq!(ModelFormat::listed(ModelProperty::Faces), "GLB, OBJ, PLY, STL, OFF or 3MF");
        assert_eq!(ModelFormat::listed(ModelProperty::Order), "OBJ, PLY, OFF or 3MF");
    }
}
