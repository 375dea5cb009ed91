//! Files in and out: the only place of the command that touches the file system.

mod outputs;
mod whole;

use std::fs::{self, File};
use std::io::{ErrorKind, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::Serialize;

use crate::error::CliError;

pub(crate) use outputs::{check_outputs, refuse_files_read, write};
#[cfg(unix)]
pub(crate) use whole::abandon;

/// Largest file that is read, bytes: above it the model's arrays would not fit a 32-bit index any more.
const MAX_FILE_BYTES: u64 = 2 << 30;

/// All files that were read so far, those that a model names (buffers, materials, textures) among them.
static READ: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Reads a whole file.
///
/// # Errors
/// When it is missing, a folder, empty, too large, or cannot be read.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, CliError> {
    let fail = |message: String| CliError::file(path, message);
    let metadata = fs::metadata(path).map_err(|e| fail(reason(&e)))?;
    if metadata.is_dir() {
        return Err(fail("is a folder, not a file".into()));
    }
    if metadata.len() > MAX_FILE_BYTES {
        return Err(fail(format!(
            "is {} MiB large; at most {} MiB are read",
            metadata.len() >> 20,
            MAX_FILE_BYTES >> 20
        )));
    }
    let mut bytes = Vec::new();
    // A pipe has no length: limit it while reading.
    let read = File::open(path).and_then(|file| file.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes));
    read.map_err(|e| fail(reason(&e)))?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(fail(format!("is more than {} MiB large, which is not read", MAX_FILE_BYTES >> 20)));
    }
    if bytes.is_empty() {
        return Err(fail("is empty".into()));
    }
    READ.lock().unwrap_or_else(PoisonError::into_inner).push(path.to_path_buf());
    Ok(bytes)
}

/// Reads a file that another one names by a relative path, such as a glTF's buffer; nothing when it cannot be read.
pub(crate) fn read_beside(main: &Path, relative: &str) -> Option<Vec<u8>> {
    let relative = Path::new(relative);
    // A model must not name files elsewhere on the machine.
    if relative.is_absolute() {
        return None;
    }
    read(&main.parent().unwrap_or(Path::new("")).join(relative)).ok()
}

/// Makes a folder and the ones above it.
///
/// # Errors
/// When that is not possible.
pub(crate) fn make_folder(path: &Path) -> Result<(), CliError> {
    fs::create_dir_all(path)
        .map_err(|e| CliError::file(path, format!("cannot be made a folder: {}", reason(&e))))
}

/// Prints text on stdout, with a line end.
///
/// # Errors
/// When stdout cannot be written to; a closed pipe (`| head`) is none.
pub(crate) fn print(text: &str) -> Result<(), CliError> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{}", text.trim_end()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(CliError::file(Path::new("stdout"), reason(&e))),
        _ => Ok(()),
    }
}

/// A value as indented JSON.
pub(crate) fn json(value: &impl Serialize) -> String {
    serde_json::to_string_pretty(value).expect("only structs with text keys are serialized here")
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// An operating-system error in our own words.
fn reason(error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "there is no such file".into(),
        ErrorKind::PermissionDenied => "permission denied".into(),
        ErrorKind::OutOfMemory => "not enough memory to read it".into(),
        ErrorKind::StorageFull => "the disk is full".into(),
        ErrorKind::FileTooLarge => "it would be larger than files may be here (`ulimit -f`)".into(),
        _ => error.to_string(),
    }
}
