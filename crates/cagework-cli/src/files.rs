//! File input and output of the command.

mod outputs;
mod whole;

use std::fs;
use std::io::{ErrorKind, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use cagework_io::ModelFormat;
use cap_fs_ext::OpenOptionsSyncExt as _;
use cap_std::ambient_authority;
use cap_std::fs::{Dir, File, OpenOptions};
use serde::Serialize;

use crate::error::CliError;
pub(crate) use crate::error::shown_path;

use outputs::FileIdentity;
pub(crate) use outputs::{check_outputs, refuse_files_named, refuse_files_read, write};
pub(crate) use whole::abandon;

/// Largest size of a file that is read, bytes.
const MAX_FILE_BYTES: u64 = cagework_io::MAX_MODEL_BYTES;

/// All files read so far, including buffers, materials and textures that models name. Outputs must not overwrite them.
static INPUT_FILES: Mutex<Vec<FileIdentity>> = Mutex::new(Vec::new());

/// Reads a whole file.
///
/// # Errors
/// If it is missing, empty, too large, not a regular file, or cannot be read.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, CliError> {
    let file = File::open_ambient_with(path, &to_read(), ambient_authority()).map_err(|e| reason(&e));
    let bytes = file.and_then(content).map_err(|problem| CliError::file(path, problem))?;
    record_input(path);
    Ok(bytes)
}

/// Reads a file that `main` names by a relative path, such as a glTF buffer. `None` if the file does not exist.
///
/// # Errors
/// If [`read`] would fail, or if the path, or a symbolic link on it, leads out of the folder of `main`. The message has
/// no subject, because the caller puts the file's name in front of it.
pub(crate) fn read_beside(main: &Path, relative: &str) -> Option<Result<Vec<u8>, String>> {
    let folder = Dir::open_ambient_dir(folder_of(main), ambient_authority());
    match folder.and_then(|folder| folder.open_with(relative, &to_read())) {
        Ok(file) => {
            record_input(&folder_of(main).join(relative));
            Some(content(file))
        }
        Err(error) => match error.kind() {
            ErrorKind::NotFound => None,
            // cap-std reports a path that leads out of the folder with this kind, and without a system error number.
            ErrorKind::PermissionDenied if error.raw_os_error().is_none() => {
                Some(Err("leads out of the model's folder".into()))
            }
            _ => Some(Err(format!("cannot be read ({})", reason(&error)))),
        },
    }
}

/// Replaces each folder by the models in it, ordered by name, without hidden files and without the files `except`.
///
/// # Errors
/// If a folder cannot be read, or has no models.
pub(crate) fn models_of_folders(given: &[PathBuf], except: &[&Path]) -> Result<Vec<PathBuf>, CliError> {
    let mut models = Vec::with_capacity(given.len());
    for path in given {
        if !path.is_dir() {
            models.push(path.clone());
            continue;
        }
        let entries = fs::read_dir(path).and_then(Iterator::collect::<Result<Vec<_>, _>>);
        let mut found: Vec<PathBuf> = entries
            .map_err(|e| CliError::file(path, reason(&e)))?
            .into_iter()
            .filter(|entry| ModelFormat::is_name_of_model(&entry.file_name().to_string_lossy()))
            .map(|entry| entry.path())
            .filter(|file| file.is_file())
            .filter(|file| !except.iter().any(|other| same_file::is_same_file(file, other).unwrap_or(false)))
            .collect();
        if found.is_empty() {
            let endings = ModelFormat::ALL.map(|format| format.facts().endings).concat().join(", .");
            return Err(CliError::file(path, format!("the folder has no models (.{endings})")));
        }
        found.sort();
        models.append(&mut found);
    }
    Ok(models)
}

fn record_input(path: &Path) {
    INPUT_FILES.lock().unwrap_or_else(PoisonError::into_inner).push(FileIdentity::new(path));
}

/// Returns the options for opening files to read. Opening is non-blocking, because opening a pipe would otherwise wait
/// for a writer.
fn to_read() -> OpenOptions {
    let mut options = OpenOptions::new();
    options.read(true).nonblock(true);
    options
}

/// Reads an open file. The error message has no subject, because the caller puts the file's name in front of it.
fn content(file: File) -> Result<Vec<u8>, String> {
    // Ask the open file rather than its path, which another process may replace.
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
    // Files in /proc and similar file systems report a length of 0 as well. They are rejected too, although they are
    // not empty.
    if metadata.len() == 0 {
        return Err("is empty".into());
    }
    let mut bytes = Vec::new();
    let no_memory = || format!("needs {} MiB of memory, more than is available", metadata.len() >> 20);
    bytes.try_reserve_exact(metadata.len() as usize).map_err(|_| no_memory())?;
    // The file may have grown since its length was read.
    file.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes).map_err(|e| reason(&e))?;
    too_large(bytes.len() as u64).map_or(Ok(bytes), Err)
}

/// Creates a folder and its parents.
///
/// # Errors
/// If a folder cannot be created.
pub(crate) fn make_folder(path: &Path) -> Result<(), CliError> {
    fs::create_dir_all(path)
        .map_err(|e| CliError::file(path, format!("the folder cannot be created: {}", reason(&e))))
}

/// Whether a file was modified after all files in `than`. False if a modification time is not available.
pub(crate) fn is_newer(file: &Path, than: &[&Path]) -> bool {
    let modified = |path: &Path| fs::metadata(path).and_then(|metadata| metadata.modified()).ok();
    modified(file)
        .is_some_and(|file| than.iter().all(|path| modified(path).is_some_and(|other| other < file)))
}

/// Prints text and a line end on stdout. Ignores a closed pipe, such as after `| head`.
///
/// # Errors
/// If stdout cannot be written to.
pub(crate) fn print(text: &str) -> Result<(), CliError> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{}", text.trim_end()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(CliError::file(Path::new("stdout"), reason(&e))),
        _ => Ok(()),
    }
}

/// Formats a value as indented JSON.
pub(crate) fn json(value: &impl Serialize) -> String {
    serde_json::to_string_pretty(value).expect("only structs with text keys are serialized here")
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Describes an operating-system error.
fn reason(error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "there is no such file".into(),
        ErrorKind::PermissionDenied => "permission denied".into(),
        ErrorKind::OutOfMemory => "not enough memory to read the file".into(),
        ErrorKind::StorageFull => "the disk is full".into(),
        ErrorKind::FileTooLarge => "the file would exceed the file-size limit (`ulimit -f`)".into(),
        _ => error.to_string(),
    }
}
