//! File formats that can be read and written.

use thiserror::Error;

use crate::shown::shown;
use crate::{off, stl};

/// File format of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub enum ModelFormat {
    /// Wavefront OBJ.
    Obj,
    /// glTF 2.0: JSON or GLB to read, GLB to write.
    Gltf,
    /// Stanford PLY, text or binary.
    Ply,
    /// STL, text or binary.
    Stl,
    /// Geomview OFF, text: OFF, COFF, NOFF.
    Off,
}

/// A file is not in a supported format.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{} is {found}: {hint}", shown(name))]
pub struct FormatError {
    /// Name given by the caller.
    pub name: String,
    /// What the content looks like.
    pub found: &'static str,
    /// What to do.
    pub hint: &'static str,
}

impl ModelFormat {
    /// All formats, in the order of listings.
    pub const ALL: [Self; 5] = [Self::Gltf, Self::Obj, Self::Ply, Self::Stl, Self::Off];

    /// Short name, lower case.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Obj => "obj",
            Self::Gltf => "gltf",
            Self::Ply => "ply",
            Self::Stl => "stl",
            Self::Off => "off",
        }
    }

    /// Extensions of readable files, lower case, without the dot. The most complete variant comes first.
    #[must_use]
    pub fn endings(self) -> &'static [&'static str] {
        match self {
            Self::Obj => &["obj"],
            Self::Gltf => &["glb", "vrm", "gltf"],
            Self::Ply => &["ply"],
            Self::Stl => &["stl"],
            Self::Off => &["off"],
        }
    }

    /// Extension of exported files, lower case, without the dot.
    #[must_use]
    pub fn export_extension(self) -> &'static str {
        match self {
            Self::Obj => "obj",
            Self::Gltf => "glb",
            Self::Ply => "ply",
            Self::Stl => "stl",
            Self::Off => "off",
        }
    }

    /// Whether a file can store several poses.
    #[must_use]
    pub fn holds_poses(self) -> bool {
        self == Self::Gltf
    }

    /// Format for exporting to a file of this name, by its extension.
    #[must_use]
    pub fn of_export(name: &str) -> Option<Self> {
        match extension(name).as_str() {
            // A VRM is a GLB.
            "vrm" => Some(Self::Gltf),
            extension => Self::ALL.into_iter().find(|format| extension == format.export_extension()),
        }
    }

    /// Detects the format of a file from its content.
    ///
    /// # Errors
    /// [`FormatError`] if the content contradicts the file's extension or is known to be something else.
    pub fn of_file(name: &str, bytes: &[u8]) -> Result<Self, FormatError> {
        let fault = |found, hint| Err(FormatError { name: name.into(), found, hint });
        let export = "export it as GLB, OBJ, PLY, STL or OFF";
        let unmarked = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let text = unmarked.trim_ascii_start();
        match bytes {
            [] => return fault("empty", "the file has no bytes"),
            [b'g', b'l', b'T', b'F', ..] => return Ok(Self::Gltf),
            [b'P', b'K', 3, 4, ..] => return fault("a zip archive", "unpack it first"),
            [b'K', b'a', b'y', b'd', b'a', b'r', b'a', ..] => return fault("an FBX file", export),
            [b'B', b'L', b'E', b'N', b'D', b'E', b'R', ..] => return fault("a Blender file", export),
            _ if unmarked.starts_with(b"ply\n") || unmarked.starts_with(b"ply\r") => return Ok(Self::Ply),
            _ if stl::is_stl(bytes) => return Ok(Self::Stl),
            [0xff, 0xfe, ..]
            | [0xfe, 0xff, ..]
            | [b'#' | b'v' | b'o' | b'g' | b's' | b'm' | b'p' | b'{', 0, ..] => {
                return fault("a UTF-16 text", "save it as UTF-8");
            }
            _ if off::is_off(bytes) => return Ok(Self::Off),
            _ if text.starts_with(b"version https://git-lfs.github.com/spec/") => {
                return fault("a Git LFS pointer, not the file itself", "fetch the file with `git lfs pull`");
            }
            [b'<', ..] => return fault("an XML or HTML file", export),
            _ => {}
        }
        if text.first() == Some(&b'{') {
            return Ok(Self::Gltf);
        }
        match extension(name).as_str() {
            "glb" => {
                fault("not a GLB", "its first four bytes are not 'glTF': it is damaged or has the wrong name")
            }
            "gltf" => fault("not a glTF", "it does not begin with '{': it is damaged or has the wrong name"),
            "stl" => Ok(Self::Stl),
            "off" => Ok(Self::Off),
            "ply" => fault("not a PLY", "its first line is not 'ply': it is damaged or has the wrong name"),
            "fbx" | "dae" | "usdz" | "usd" | "3ds" | "blend" => fault("in an unsupported format", export),
            _ => Ok(Self::Obj),
        }
    }
}

fn extension(name: &str) -> String {
    name.rsplit_once('.').map_or(String::new(), |(_, extension)| extension.to_ascii_lowercase())
}
