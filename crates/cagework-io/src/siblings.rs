//! The files that a model names.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use thiserror::Error;

use crate::look::sniff_image;
use crate::shown::{MAX_NAME_CHARS, shown_start};

/// Fetches a file that a model names by a relative path, percent-decoded. `None`: there is none. An error says why it is
/// not read, as what follows its name: "is a folder".
pub type Resolve<'a> = dyn FnMut(&str) -> Option<Result<Vec<u8>, String>> + 'a;

/// Most bytes of all files that one model names: as many as the model itself may have.
const MAX_BYTES: u64 = 2 << 30;

/// An encoded image, known by its content to be one.
#[derive(Clone, Debug)]
pub(crate) struct Image {
    /// What the model calls it, shortened.
    pub(crate) name: Arc<str>,
    pub(crate) bytes: Arc<Vec<u8>>,
    pub(crate) mime: &'static str,
}

/// Why there is no file or image of a name, as what follows it.
#[derive(Clone, Debug, Error)]
pub(crate) enum Absent {
    /// Nobody has it.
    #[error("is not there")]
    Missing,
    /// It is there.
    #[error("{0}")]
    Refused(String),
}

/// The files that one model names, each asked for once and shared by all that name it.
pub(crate) struct Siblings<'a> {
    resolve: &'a mut Resolve<'a>,
    files: BTreeMap<String, Result<Arc<Vec<u8>>, Absent>>,
    images: HashMap<String, Option<Image>>,
    /// Bytes that were read, of the same file under several names each time.
    bytes: u64,
    /// Most of them.
    limit: u64,
}

impl Image {
    /// # Errors
    /// That the bytes are no image.
    pub(crate) fn new(name: &str, bytes: Arc<Vec<u8>>) -> Result<Self, Absent> {
        match sniff_image(&bytes) {
            Some(mime) => Ok(Self { name: shown_start(name, MAX_NAME_CHARS).into(), bytes, mime }),
            None => Err(Absent::Refused(NO_IMAGE.into())),
        }
    }
}

/// What follows the name of what should be an image.
pub(crate) const NO_IMAGE: &str = "is no PNG, JPEG, WebP or KTX2 image";

impl<'a> Siblings<'a> {
    /// Files that `resolve` fetches, as far as they fit into `memory_limit` bytes.
    pub(crate) fn new(resolve: &'a mut Resolve<'_>, memory_limit: u64) -> Self {
        let limit = memory_limit.min(MAX_BYTES);
        Self { resolve, files: BTreeMap::new(), images: HashMap::new(), bytes: 0, limit }
    }

    /// Bytes of all files that were read.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The file of this name. Names that differ in `.` and doubled slashes alone are one; files with the same bytes are held once.
    ///
    /// # Errors
    /// Why there is none.
    pub(crate) fn file(&mut self, name: &str) -> Result<Arc<Vec<u8>>, Absent> {
        let parts: Vec<&str> = name
            .split('/')
            .enumerate()
            .filter(|(k, part)| *part != "." && (*k == 0 || !part.is_empty()))
            .map(|(_, part)| part)
            .collect();
        let name = &*parts.join("/");
        if let Some(known) = self.files.get(name) {
            return known.clone();
        }
        let found = match (self.resolve)(name) {
            None => Err(Absent::Missing),
            Some(Err(reason)) => Err(Absent::Refused(reason)),
            Some(Ok(bytes)) if bytes.len() as u64 > self.limit - self.bytes => {
                let limit = self.limit >> 20;
                Err(Absent::Refused(format!(
                    "is too large: all files that a model names may have {limit} MiB"
                )))
            }
            Some(Ok(bytes)) => {
                self.bytes += bytes.len() as u64;
                let same = self.files.values().flatten().find(|known| ***known == bytes).cloned();
                Ok(same.unwrap_or_else(|| Arc::new(bytes)))
            }
        };
        self.files.insert(name.to_owned(), found.clone());
        found
    }

    /// The image of this name. Where there is none the notices say so, once, and what becomes of it: `otherwise`.
    pub(crate) fn image(&mut self, name: &str, otherwise: &str, notices: &mut Vec<String>) -> Option<Image> {
        if let Some(known) = self.images.get(name) {
            return known.clone();
        }
        let image = self.file(name).and_then(|bytes| Image::new(name, bytes));
        if let Err(reason) = &image {
            notices.push(format!("texture '{}' {reason}: {otherwise}", shown_start(name, MAX_NAME_CHARS)));
        }
        let image = image.ok();
        self.images.insert(name.to_owned(), image.clone());
        image
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spellings_of_a_name_are_one_file_and_equal_files_are_held_once() {
        let mut asked = Vec::new();
        let mut resolve = |name: &str| {
            asked.push(name.to_owned());
            Some(Ok(vec![7; 100]))
        };
        let mut siblings = Siblings::new(&mut resolve, 1 << 20);
        let files = ["h.mtl", "./h.mtl", "././h.mtl", "a/../h.mtl", "a//b/./c.mtl", "a/b/c.mtl"]
            .map(|name| siblings.file(name).expect("it is there"));
        assert!(files.iter().all(|file| Arc::ptr_eq(file, &files[0])));
        assert_eq!(asked, ["h.mtl", "a/../h.mtl", "a/b/c.mtl"]);
    }
}
