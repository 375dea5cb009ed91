//! Files in and out: the only place of the command that touches the file system.

mod outputs;
mod whole;

use std::fs;
use std::io::{ErrorKind, Read as _, Write as _};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use cap_fs_ext::OpenOptionsSyncExt as _;
use cap_std::ambient_authority;
use cap_std::fs::{Dir, File, OpenOptions};
use serde::Serialize;

use crate::error::CliError;
pub(crate) use crate::error::shown_path;

use outputs::Named;
pub(crate) use outputs::{check_outputs, refuse_files_named, refuse_files_read, write};
pub(crate) use whole::abandon;

/// Largest file that is read, bytes: above it the model's arrays would not fit a 32-bit index any more.
pub(crate) const MAX_FILE_BYTES: u64 = 2 << 30;

/// All files that were read so far, those that a model names (buffers, materials, textures) among them.
static READ: Mutex<Vec<Named>> = Mutex::new(Vec::new());

/// Reads a whole file.
///
/// # Errors
/// When it is missing, no regular file, empty, too large, or cannot be read.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, CliError> {
    let file = File::open_ambient_with(path, &to_read(), ambient_authority()).map_err(|e| reason(&e));
    let bytes = file.and_then(content).map_err(|problem| CliError::file(path, problem))?;
    note_read(path);
    Ok(bytes)
}

/// Reads a file that another one names by a relative path, such as a glTF's buffer. Nothing when there is none.
///
/// # Errors
/// When [`read`] refuses it, or the path or a link on it leads out of the other file's folder; as what follows its name.
pub(crate) fn read_beside(main: &Path, relative: &str) -> Option<Result<Vec<u8>, String>> {
    let folder = Dir::open_ambient_dir(folder_of(main), ambient_authority());
    match folder.and_then(|folder| folder.open_with(relative, &to_read())) {
        Ok(file) => {
            note_read(&folder_of(main).join(relative));
            Some(content(file))
        }
        Err(error) => match error.kind() {
            ErrorKind::NotFound => None,
            // Not from the operating system but from cap-std.
            ErrorKind::PermissionDenied if error.raw_os_error().is_none() => {
                Some(Err("leads out of the model's folder".into()))
            }
            _ => Some(Err(format!("cannot be read ({})", reason(&error)))),
        },
    }
}

/// Remembers a file that was read: no output may take its place.
fn note_read(path: &Path) {
    READ.lock().unwrap_or_else(PoisonError::into_inner).push(Named::new(path));
}

/// To open what may be a pipe: without this that waits until somebody writes.
fn to_read() -> OpenOptions {
    let mut options = OpenOptions::new();
    options.read(true).nonblock(true);
    options
}

/// All of an open file; or why not, as what follows its name.
fn content(file: File) -> Result<Vec<u8>, String> {
    // Of the open file: what the name means may have changed since.
    let metadata = file.metadata().map_err(|e| reason(&e))?;
    if metadata.is_dir() {
        return Err("is a folder, not a file".into());
    }
    if !metadata.is_file() {
        return Err("is a pipe or a device, not a regular file".into());
    }
    let too_large = |bytes: u64| {
        let limit = MAX_FILE_BYTES >> 20;
        (bytes > MAX_FILE_BYTES)
            .then(|| format!("is {} MiB large; at most {limit} MiB are read", bytes >> 20))
    };
    if let Some(problem) = too_large(metadata.len()) {
        return Err(problem);
    }
    // Files that the system makes as they are read, such as those in /proc, are of this length too.
    if metadata.len() == 0 {
        return Err("is empty".into());
    }
    let mut bytes = Vec::new();
    let no_memory = || format!("needs {} MiB of memory to be read, more than there is", metadata.len() >> 20);
    bytes.try_reserve_exact(metadata.len() as usize).map_err(|_| no_memory())?;
    // It may grow meanwhile.
    file.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes).map_err(|e| reason(&e))?;
    too_large(bytes.len() as u64).map_or(Ok(bytes), Err)
}

/// Makes a folder and the ones above it.
///
/// # Errors
/// When that is not possible.
pub(crate) fn make_folder(path: &Path) -> Result<(), CliError> {
    fs::create_dir_all(path)
        .map_err(|e| CliError::file(path, format!("cannot be made a folder: {}", reason(&e))))
}

/// Whether a file is there and was written after all of these. What cannot be asked was not.
pub(crate) fn is_newer(file: &Path, than: &[&Path]) -> bool {
    let modified = |path: &Path| fs::metadata(path).and_then(|metadata| metadata.modified()).ok();
    modified(file)
        .is_some_and(|file| than.iter().all(|path| modified(path).is_some_and(|other| other < file)))
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
