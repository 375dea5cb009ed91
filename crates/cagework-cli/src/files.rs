//! File input and output of the command.

mod outputs;
mod whole;

use std::fs;
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use cagework_files::folder_of;
use cagework_io::ModelFormat;
use serde::Serialize;

use crate::error::CliError;
pub(crate) use crate::error::shown_path;

use outputs::FileIdentity;
pub(crate) use outputs::{check_outputs, refuse_files_named, refuse_files_read, write};
pub(crate) use whole::abandon;

/// All files read so far, including buffers, materials and textures that models name. Outputs must not overwrite them.
static INPUT_FILES: Mutex<Vec<FileIdentity>> = Mutex::new(Vec::new());

/// Reads a whole file.
///
/// # Errors
/// If it is missing, empty, too large, not a regular file, or cannot be read.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, CliError> {
    let bytes = cagework_files::read(path).map_err(|e| CliError::file(path, reason(&e)))?;
    record_input(path);
    Ok(bytes)
}

/// Reads a file that `main` names by a relative path, such as a glTF buffer. `None` if the file does not exist.
///
/// # Errors
/// If [`read`] would fail, or if the path, or a symbolic link on it, leads out of the folder of `main`. The message has
/// no subject, because the caller puts the file's name in front of it.
pub(crate) fn read_beside(main: &Path, relative: &str) -> Option<Result<Vec<u8>, String>> {
    let read = cagework_files::read_beside(main, relative)?;
    record_input(&folder_of(main).join(relative));
    Some(read.map_err(|e| match e.raw_os_error() {
        None => e.to_string(),
        Some(_) => format!("cannot be read ({})", reason(&e)),
    }))
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
