//! Zip archives: those of 3MF files and SOG captures.

use std::collections::HashMap;
use std::io::Write as _;

use flate2::Compression;
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;
use rawzip::path::EntryPath;
use rawzip::{CompressionMethod, DataDescriptorOutput, Error, ZipArchive, ZipArchiveWriter, crc32};
use thiserror::Error;

use crate::error::WriteError;
use crate::order::{Budget, Refusal, Stream};
use crate::shown::{MAX_NAME_CHARS, shown_start};

/// Error of reading an archive.
#[derive(Debug, Error)]
pub(crate) enum ArchiveError {
    #[error("{0}")]
    Damaged(String),
    #[error("its part '{0}' is encrypted: save the model without protection in the program that wrote it")]
    Encrypted(String),
    #[error(transparent)]
    Refused(#[from] Refusal),
}

/// A file of the archive.
struct Entry<'a> {
    name: Vec<u8>,
    is_utf8: bool,
    is_encrypted: bool,
    method: CompressionMethod,
    crc: u32,
    /// Unpacked size in the directory, bytes.
    size: u64,
    /// Compressed bytes.
    data: &'a [u8],
}

/// The files of an archive.
pub(crate) struct Archive<'a> {
    entries: Vec<Entry<'a>>,
    /// Index of each entry by [`part_name`].
    index_of: HashMap<Vec<u8>, usize>,
    comment: Vec<u8>,
}

/// Normalises a name for comparisons. Names of parts ignore case and may begin with a slash.
pub(crate) fn part_name(name: &[u8]) -> Vec<u8> {
    let slashes = name.iter().take_while(|&&byte| byte == b'/').count();
    name[slashes..].to_ascii_lowercase()
}

/// Describes a fault of a part. `problem` continues the part's name: it is a predicate, such as "is missing", or begins
/// with a colon.
pub(crate) fn fault_of(name: &str, problem: &str) -> String {
    let space = if problem.starts_with(':') { "" } else { " " };
    format!("its part '{}'{space}{problem}", shown_start(name, MAX_NAME_CHARS))
}

/// Creates the error for an encrypted part.
pub(crate) fn encrypted(name: &str) -> ArchiveError {
    ArchiveError::Encrypted(shown_start(name, MAX_NAME_CHARS))
}

/// Whether the bytes begin like an archive.
pub(crate) fn is_archive(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04")
}

/// Lists all files of an archive; also returns its comment.
fn entries(bytes: &[u8]) -> Result<(Vec<Entry<'_>>, Vec<u8>), Error> {
    let archive = ZipArchive::from_slice(bytes)?;
    let mut entries = Vec::new();
    let mut records = archive.entries();
    while let Some(record) = records.next_entry()? {
        let (start, end) = archive.get_entry(record.wayfinder())?.compressed_data_range();
        entries.push(Entry {
            name: record.file_path().as_bytes().to_vec(),
            is_utf8: record.flags().is_utf8(),
            is_encrypted: record.flags().is_encrypted(),
            method: record.compression_method(),
            crc: record.crc32(),
            size: record.uncompressed_size_hint(),
            data: &bytes[start as usize..end as usize],
        });
    }
    Ok((entries, archive.comment().as_bytes().to_vec()))
}

impl<'a> Archive<'a> {
    pub(crate) fn open(bytes: &'a [u8]) -> Result<Self, ArchiveError> {
        let damaged = |what: &str| ArchiveError::Damaged(what.into());
        let (entries, comment) = entries(bytes).map_err(|_| damaged("its zip archive cannot be read"))?;
        let mut names: Vec<&[u8]> = entries.iter().map(|entry| entry.name.as_slice()).collect();
        names.sort_unstable();
        let is_repeated = names.windows(2).any(|pair| pair[0] == pair[1]);
        // Entries that overlap would make an export larger than the file.
        let size: usize = entries.iter().map(|entry| entry.data.len()).sum();
        if is_repeated || size > bytes.len() {
            return Err(damaged("entries of its zip archive overlap or have the same name"));
        }
        let index_of = (0..entries.len()).rev().map(|k| (part_name(&entries[k].name), k)).collect();
        Ok(Self { entries, index_of, comment })
    }

    /// Index of an entry.
    pub(crate) fn index(&self, name: &str) -> Option<usize> {
        self.index_of.get(&part_name(name.as_bytes())).copied()
    }

    /// Unpacks an entry, with a permit for the size that the archive's directory declares. Fails if the entry has another
    /// size. `copies`: memory per byte of the contents, bytes.
    pub(crate) fn unpack(
        &self,
        name: &str,
        index: usize,
        copies: u64,
        budget: &mut Budget,
    ) -> Result<Vec<u8>, ArchiveError> {
        let entry = &self.entries[index];
        let permit = budget.permit(Stream { unpacked: entry.size, copies })?;
        let unpacked = match entry.method {
            CompressionMethod::STORE if !entry.is_encrypted => permit.unpack(entry.data),
            CompressionMethod::DEFLATE if !entry.is_encrypted => {
                permit.unpack(DeflateDecoder::new(entry.data))
            }
            _ if entry.is_encrypted => return Err(encrypted(name)),
            _ => {
                let fault = fault_of(name, "is compressed by a method other than deflate");
                return Err(ArchiveError::Damaged(fault));
            }
        };
        let fits = |bytes: &Vec<u8>| bytes.len() as u64 == entry.size && crc32(bytes) == entry.crc;
        let damaged = || ArchiveError::Damaged(fault_of(name, "cannot be unpacked"));
        unpacked.ok().filter(fits).ok_or_else(damaged)
    }

    /// Copies the archive with new texts of some entries; the others keep their compressed bytes.
    pub(crate) fn with_texts(self, texts: &HashMap<usize, String>) -> Result<Vec<u8>, WriteError> {
        let copy = || -> Result<Vec<u8>, Error> {
            let mut writer = ZipArchiveWriter::new(Vec::new());
            writer.set_comment(self.comment);
            for (index, entry) in self.entries.iter().enumerate() {
                // Keep the UTF-8 flag of names that need it; copy other names byte for byte.
                let name = match std::str::from_utf8(&entry.name) {
                    Ok(name) if entry.is_utf8 && !name.is_ascii() => EntryPath::conformant(name),
                    _ => EntryPath::verbatim(entry.name.as_slice()),
                };
                match texts.get(&index) {
                    Some(text) => put(&mut writer, name, text)?,
                    None => {
                        let (mut to, _) = writer.new_file(name).compression_method(entry.method).start()?;
                        to.write_all(entry.data)?;
                        to.finish(DataDescriptorOutput::new(entry.crc, entry.size))?;
                    }
                }
            }
            writer.finish()
        };
        copy().map_err(write_error)
    }
}

/// Writes a compressed archive. Entries have no modification time, so that equal texts give equal bytes.
pub(crate) fn write_new(files: &[(&str, &str)]) -> Result<Vec<u8>, WriteError> {
    let mut writer = ZipArchiveWriter::new(Vec::new());
    for (name, text) in files {
        put(&mut writer, EntryPath::verbatim(name.as_bytes()), text).map_err(write_error)?;
    }
    writer.finish().map_err(write_error)
}

fn put(writer: &mut ZipArchiveWriter<Vec<u8>>, name: EntryPath<'_>, text: &str) -> Result<(), Error> {
    let (mut to, _) = writer.new_file(name).compression_method(CompressionMethod::DEFLATE).start()?;
    let mut encoder = DeflateEncoder::new(&mut to, Compression::default());
    encoder.write_all(text.as_bytes())?;
    encoder.finish()?;
    to.finish(DataDescriptorOutput::new(crc32(text.as_bytes()), text.len() as u64))?;
    Ok(())
}

#[expect(clippy::needless_pass_by_value, reason = "an argument of map_err")]
fn write_error(error: Error) -> WriteError {
    WriteError::Document(error.to_string())
}
