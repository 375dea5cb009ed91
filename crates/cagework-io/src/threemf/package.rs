//! The zip archive of a 3MF.

use std::collections::HashMap;
use std::io::Write as _;

use flate2::Compression;
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;
use quick_xml::Reader;
use quick_xml::events::Event;
use rawzip::path::EntryPath;
use rawzip::{CompressionMethod, DataDescriptorOutput, Error, ZipArchive, ZipArchiveWriter, crc32};

use super::xml::attributes;
use crate::error::WriteError;
use crate::order::{Budget, Expansion, Stream};
use crate::polygons::PolygonsError;
use crate::shown::{MAX_NAME_CHARS, shown_start};

/// File that names the first model part.
const RELATIONSHIPS: &str = "_rels/.rels";
/// End of the type of the relationship to the first model part.
const MODEL_TYPE: &str = "/3dmodel";
/// The first model part of a file without relationships, as most programs name it.
const USUAL_PART: &str = "3D/3dmodel.model";
/// Bytes at the end of a file in which [`is_3mf`] looks for the name of a model part, which the archive's directory
/// contains.
const DIRECTORY_BYTES: usize = 1 << 20;

/// Limit on the memory for the relationships in [`is_3mf`], bytes.
const MAX_RELATIONSHIPS: u64 = 1 << 20;

/// First bytes of an encrypted part (Secure Content Extension, appendix D).
const ENCRYPTED: &[u8] = b"%3McF";

/// Whether the content is a zip archive with a model part, which has the extension `.model` or is named by the
/// relationships.
pub(crate) fn is_3mf(bytes: &[u8]) -> bool {
    let directory = &bytes[bytes.len().saturating_sub(DIRECTORY_BYTES)..];
    let names = |name: &[u8]| directory.windows(name.len()).any(|at| at.eq_ignore_ascii_case(name));
    let is_related = || {
        let package = Package::open(bytes, MAX_RELATIONSHIPS);
        package.and_then(|mut package| package.model_parts()).is_ok_and(|parts| !parts.is_empty())
    };
    bytes.starts_with(b"PK\x03\x04") && (names(b".model") || names(RELATIONSHIPS.as_bytes()) && is_related())
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

/// An archive, and the limit on the text unpacked from it.
pub(super) struct Package<'a> {
    entries: Vec<Entry<'a>>,
    /// Index of each entry by [`part_name`].
    index_of: HashMap<Vec<u8>, usize>,
    comment: Vec<u8>,
    /// Memory of the archive and of the texts unpacked so far.
    pub(super) budget: Budget,
}

/// Normalises a name for comparisons. Names of parts ignore case and may begin with a slash.
pub(super) fn part_name(name: &[u8]) -> Vec<u8> {
    let slashes = name.iter().take_while(|&&byte| byte == b'/').count();
    name[slashes..].to_ascii_lowercase()
}

/// Creates the error for a damaged part of the archive.
///
/// `problem` continues the part's name: it is a predicate, such as "is missing", or begins with a colon.
pub(super) fn fault(name: &str, problem: &str) -> PolygonsError {
    let space = if problem.starts_with(':') { "" } else { " " };
    PolygonsError::Syntax(format!("its part '{}'{space}{problem}", shown_start(name, MAX_NAME_CHARS)))
}

/// Creates the error for an encrypted part.
fn encrypted(name: &str) -> PolygonsError {
    let name = shown_start(name, MAX_NAME_CHARS);
    PolygonsError::Unsupported(format!(
        "its part '{name}' is encrypted: save the model without protection in the program that wrote it"
    ))
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

impl<'a> Package<'a> {
    pub(super) fn open(bytes: &'a [u8], memory_limit: u64) -> Result<Self, PolygonsError> {
        let (entries, comment) =
            entries(bytes).map_err(|_| PolygonsError::Syntax("its zip archive cannot be read".into()))?;
        let mut names: Vec<&[u8]> = entries.iter().map(|entry| entry.name.as_slice()).collect();
        names.sort_unstable();
        let is_repeated = names.windows(2).any(|pair| pair[0] == pair[1]);
        // Entries that overlap would make an export larger than the file.
        let size: usize = entries.iter().map(|entry| entry.data.len()).sum();
        if is_repeated || size > bytes.len() {
            return Err(PolygonsError::Syntax(
                "entries of its zip archive overlap or have the same name".into(),
            ));
        }
        let index_of = (0..entries.len()).rev().map(|k| (part_name(&entries[k].name), k)).collect();
        let size = bytes.len() as u64;
        Ok(Self {
            entries,
            index_of,
            comment,
            budget: Budget::new(size, size, memory_limit, Expansion::TEXT),
        })
    }

    /// Index of an entry.
    pub(super) fn index(&self, name: &str) -> Option<usize> {
        self.index_of.get(&part_name(name.as_bytes())).copied()
    }

    /// Finds the name of the first model part.
    pub(super) fn first_part(&mut self) -> Result<String, PolygonsError> {
        match self.model_parts()?.as_slice() {
            [] => Ok(USUAL_PART.into()),
            [first] => Ok(first.clone()),
            [first, second, ..] => {
                let [first, second] = [first, second].map(|name| shown_start(name, MAX_NAME_CHARS));
                Err(PolygonsError::Unsupported(format!(
                    "its relationships name two first model parts, '{first}' and '{second}': save the model again with one"
                )))
            }
        }
    }

    /// Names of the model parts in the relationships, without repetitions.
    fn model_parts(&mut self) -> Result<Vec<String>, PolygonsError> {
        let mut parts: Vec<String> = Vec::new();
        let Some(index) = self.index(RELATIONSHIPS) else { return Ok(parts) };
        let text = self.text(RELATIONSHIPS, index)?;
        let mut reader = Reader::from_str(&text);
        loop {
            match reader.read_event().map_err(|_| fault(RELATIONSHIPS, "is not well-formed XML"))? {
                Event::Start(tag) | Event::Empty(tag) if tag.local_name().as_ref() == "Relationship" => {
                    let (mut target, mut is_model) = (String::new(), false);
                    for (key, value) in attributes(&tag) {
                        match key {
                            "Target" => target = value.into(),
                            "Type" => is_model = value.ends_with(MODEL_TYPE),
                            _ => {}
                        }
                    }
                    let same = |part: &String| part_name(part.as_bytes()) == part_name(target.as_bytes());
                    if is_model && !parts.iter().any(same) {
                        parts.push(target);
                    }
                }
                Event::Eof => return Ok(parts),
                _ => {}
            }
        }
    }

    /// Unpacks an entry, with a permit for the size that the archive's directory declares. Fails if the entry has another
    /// size.
    pub(super) fn text(&mut self, name: &str, index: usize) -> Result<String, PolygonsError> {
        let entry = &self.entries[index];
        // Text and parsed content: a vertex or triangle takes less memory than its text, which has at least 27 or 34
        // characters.
        let permit = self.budget.permit(Stream { unpacked: entry.size, copies: 2 })?;
        let unpacked = match entry.method {
            CompressionMethod::STORE if !entry.is_encrypted => permit.unpack(entry.data),
            CompressionMethod::DEFLATE if !entry.is_encrypted => {
                permit.unpack(DeflateDecoder::new(entry.data))
            }
            _ if entry.is_encrypted => return Err(encrypted(name)),
            _ => return Err(fault(name, "is compressed by a method other than deflate")),
        };
        let fits = |bytes: &Vec<u8>| bytes.len() as u64 == entry.size && crc32(bytes) == entry.crc;
        let bytes = unpacked.ok().filter(fits).ok_or_else(|| fault(name, "cannot be unpacked"))?;
        if bytes.starts_with(ENCRYPTED) {
            return Err(encrypted(name));
        }
        String::from_utf8(bytes).map_err(|_| fault(name, "is not UTF-8 text"))
    }

    /// Copies the archive with new texts of some entries; the others keep their compressed bytes.
    pub(super) fn with_texts(self, texts: &HashMap<usize, String>) -> Result<Vec<u8>, WriteError> {
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
pub(super) fn write_new(files: &[(&str, &str)]) -> Result<Vec<u8>, WriteError> {
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
