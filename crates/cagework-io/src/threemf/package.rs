//! The zip archive of a 3MF.

use quick_xml::Reader;
use quick_xml::events::Event;

use super::xml::attributes;
use crate::archive::{Archive, ArchiveError, encrypted, fault_of, is_archive, part_name};
use crate::order::{Budget, Expansion};
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
    is_archive(bytes) && (names(b".model") || names(RELATIONSHIPS.as_bytes()) && is_related())
}

/// An archive, and the limit on the text unpacked from it.
pub(super) struct Package<'a> {
    pub(super) archive: Archive<'a>,
    /// Memory of the archive and of the texts unpacked so far.
    pub(super) budget: Budget,
}

/// Creates the error for a damaged part, as [`fault_of`] describes it.
pub(super) fn fault(name: &str, problem: &str) -> PolygonsError {
    PolygonsError::Syntax(fault_of(name, problem))
}

impl From<ArchiveError> for PolygonsError {
    fn from(error: ArchiveError) -> Self {
        match error {
            ArchiveError::Damaged(problem) => Self::Syntax(problem),
            ArchiveError::Encrypted(_) => Self::Unsupported(error.to_string()),
            ArchiveError::Refused(refusal) => refusal.into(),
        }
    }
}

impl<'a> Package<'a> {
    pub(super) fn open(bytes: &'a [u8], memory_limit: u64) -> Result<Self, PolygonsError> {
        let size = bytes.len() as u64;
        let budget = Budget::new(size, size, memory_limit, Expansion::TEXT);
        Ok(Self { archive: Archive::open(bytes)?, budget })
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
        let Some(index) = self.archive.index(RELATIONSHIPS) else { return Ok(parts) };
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

    /// Unpacks the text of an entry.
    pub(super) fn text(&mut self, name: &str, index: usize) -> Result<String, PolygonsError> {
        // Text and parsed content: a vertex or triangle takes less memory than its text, which has at least 27 or 34
        // characters.
        let bytes = self.archive.unpack(name, index, 2, &mut self.budget)?;
        if bytes.starts_with(ENCRYPTED) {
            return Err(encrypted(name).into());
        }
        String::from_utf8(bytes).map_err(|_| fault(name, "is not UTF-8 text"))
    }
}
