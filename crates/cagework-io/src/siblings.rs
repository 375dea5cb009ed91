//! Files that a model refers to: buffers, images and material files.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use thiserror::Error;

use crate::look::sniff_image;
use crate::shown::{MAX_NAME_CHARS, shown_start};

/// Callback that returns an external file by relative path, percent-decoded. `None` if it does not exist; an
/// error is the reason as a predicate, such as "is a folder".
pub type Resolve<'a> = dyn FnMut(&str) -> Option<Result<Vec<u8>, String>> + 'a;

/// Limit on the total size of the files that one model refers to, bytes; the command has the same limit for a file. The
/// arrays of a larger model would exceed 32-bit indices.
pub const MAX_MODEL_BYTES: u64 = 2 << 30;

/// An encoded image; its format is recognised by its content.
#[derive(Clone, Debug)]
pub(crate) struct Image {
    /// Name in the model, shortened.
    pub(crate) name: Arc<str>,
    pub(crate) bytes: Arc<Vec<u8>>,
    pub(crate) mime: &'static str,
}

/// Why a file or image is unavailable, as a predicate.
#[derive(Clone, Debug, Error)]
pub(crate) enum SiblingError {
    #[error("is missing")]
    Missing,
    /// The file exists but cannot be used.
    #[error("{0}")]
    Refused(String),
}

/// Cache of a model's external files. Each is requested once.
pub(crate) struct Siblings<'a> {
    resolve: &'a mut Resolve<'a>,
    files: BTreeMap<String, Result<Arc<Vec<u8>>, SiblingError>>,
    images: HashMap<String, Option<Image>>,
    /// Bytes of all files read. A file that has two names counts twice.
    bytes: u64,
    /// Limit for `bytes`.
    limit: u64,
}

impl Image {
    /// Recognises an image by its content. `name`: name of the file.
    ///
    /// # Errors
    /// [`SiblingError`] if the bytes are not an image.
    pub(crate) fn new(name: &str, bytes: Arc<Vec<u8>>) -> Result<Self, SiblingError> {
        match sniff_image(&bytes) {
            Some(mime) => Ok(Self { name: shown_start(name, MAX_NAME_CHARS).into(), bytes, mime }),
            None => Err(SiblingError::Refused(IMAGE_FAULT.into())),
        }
    }
}

/// Predicate for a message: a file is not an image.
pub(crate) const IMAGE_FAULT: &str = "is not a PNG, JPEG, WebP or KTX2 image";

impl<'a> Siblings<'a> {
    /// Creates a cache of files from `resolve`, up to `memory_limit` bytes.
    pub(crate) fn new(resolve: &'a mut Resolve<'_>, memory_limit: u64) -> Self {
        let limit = memory_limit.min(MAX_MODEL_BYTES);
        Self { resolve, files: BTreeMap::new(), images: HashMap::new(), bytes: 0, limit }
    }

    /// Bytes of all files read.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Returns the file of this name. Paths are compared without `.` and empty components; files with equal content
    /// share memory.
    ///
    /// # Errors
    /// [`SiblingError`] with the reason.
    pub(crate) fn file(&mut self, name: &str) -> Result<Arc<Vec<u8>>, SiblingError> {
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
            None => Err(SiblingError::Missing),
            Some(Err(reason)) => Err(SiblingError::Refused(reason)),
            Some(Ok(bytes)) if bytes.len() as u64 > self.limit - self.bytes => {
                let limit = self.limit >> 20;
                Err(SiblingError::Refused(format!(
                    "exceeds the limit of {limit} MiB for all files of a model"
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

    /// Returns the image of this name. If it is unavailable, adds a notice that ends with `otherwise`, the consequence,
    /// once per name.
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
    fn equivalent_paths_are_one_request_and_equal_files_share_memory() {
        let mut requested = Vec::new();
        let mut resolve = |name: &str| {
            requested.push(name.to_owned());
            Some(Ok(vec![7; 100]))
        };
        let mut siblings = Siblings::new(&mut resolve, 1 << 20);
        let files = ["h.mtl", "./h.mtl", "././h.mtl", "a/../h.mtl", "a//b/./c.mtl", "a/b/c.mtl"]
            .map(|name| siblings.file(name).expect("the file exists"));
        assert!(files.iter().all(|file| Arc::ptr_eq(file, &files[0])));
        assert_eq!(requested, ["h.mtl", "a/../h.mtl", "a/b/c.mtl"]);
    }
}
