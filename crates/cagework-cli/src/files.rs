//! File input and output of the command.

mod outputs;
mod whole;

use std::fs;
use std::io::{self, ErrorKind, IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
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

/// Name that stands for standard input and standard output.
pub(crate) const STREAM: &str = "-";

/// Whether standard input was read: its content cannot be read again.
static IS_STDIN_READ: AtomicBool = AtomicBool::new(false);

/// Whether an output was written to standard output, so that text goes to stderr.
static IS_STDOUT_TAKEN: AtomicBool = AtomicBool::new(false);

/// Whether notes are left out.
static IS_QUIET: AtomicBool = AtomicBool::new(false);

/// Leaves out notes and progress from now on.
pub(crate) fn be_quiet() {
    IS_QUIET.store(true, Ordering::Relaxed);
}

/// Whether notes and progress are left out.
pub(crate) fn is_quiet() -> bool {
    IS_QUIET.load(Ordering::Relaxed)
}

/// Whether a path stands for standard input or standard output.
pub(crate) fn is_stream(path: &Path) -> bool {
    path.as_os_str() == STREAM
}

/// Name of a model in a standard stream, with the extension that `--format` gives. It is looked up in the arguments
/// because the names of outputs are parsed before that option is known.
pub(crate) fn stream_name() -> String {
    let mut arguments = std::env::args().skip_while(|one| one != "--format" && !one.starts_with("--format="));
    let format = arguments.next().and_then(|first| match first.split_once('=') {
        Some((_, format)) => Some(format.to_owned()),
        None => arguments.next(),
    });
    format.map_or_else(|| STREAM.to_owned(), |format| format!("{STREAM}.{format}"))
}

/// Name of a model by which its reader finds the format.
pub(crate) fn model_name(path: &Path) -> String {
    if is_stream(path) { stream_name() } else { path.display().to_string() }
}

/// Reads a whole file, or standard input.
///
/// # Errors
/// If it is missing, empty, too large, not a regular file, or cannot be read; if standard input was read before.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, CliError> {
    if is_stream(path) {
        if IS_STDIN_READ.swap(true, Ordering::Relaxed) {
            return Err(CliError::file(path, "standard input can only be read once"));
        }
        return cagework_files::read_stream(io::stdin().lock())
            .map_err(|e| CliError::file(path, format!("standard input {}", reason(&e))));
    }
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
    let read = if is_stream(main) { None } else { cagework_files::read_beside(main, relative) }?;
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

/// Prints text and a line end on stdout, or on stderr if an output was written to stdout. With `--quiet`, leaves out
/// notes.
///
/// # Errors
/// If the stream cannot be written to.
pub(crate) fn print(text: &str) -> Result<(), CliError> {
    let is_left_out = |line: &&str| is_quiet() && line.starts_with("note: ");
    let text =
        text.trim_end().split('\n').filter(|line| !is_left_out(line)).collect::<Vec<_>>().join("\n") + "\n";
    if IS_STDOUT_TAKEN.load(Ordering::Relaxed) {
        // As for errors, ignore failures of stderr.
        let _ = io::stderr().write_all(text.as_bytes());
        return Ok(());
    }
    print_bytes(text.as_bytes())
}

/// Writes an output to stdout.
///
/// # Errors
/// If stdout is a terminal and the output is not text, or stdout cannot be written to.
fn write_to_stdout(bytes: &[u8]) -> Result<(), CliError> {
    let is_text = std::str::from_utf8(bytes).is_ok_and(|text| !text.contains('\0'));
    if !is_text && io::stdout().is_terminal() {
        return Err(CliError::Mismatch {
            message: "standard output is a terminal, and the output is not text".to_owned(),
            hint: "redirect it to a file or a pipe",
        });
    }
    IS_STDOUT_TAKEN.store(true, Ordering::Relaxed);
    print_bytes(bytes)
}

/// Writes to stdout. Ignores a closed pipe, such as after `| head`.
fn print_bytes(bytes: &[u8]) -> Result<(), CliError> {
    let mut out = io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(CliError::file(Path::new("stdout"), reason(&e))),
        _ => Ok(()),
    }
}

/// Formats a value as indented JSON.
pub(crate) fn json(value: &impl Serialize) -> String {
    serde_json::to_string_pretty(value).expect("only structs with text keys are serialized here")
}

/// Describes an operating-system error.
fn reason(error: &io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "there is no such file".into(),
        ErrorKind::PermissionDenied => "permission denied".into(),
        ErrorKind::OutOfMemory => "not enough memory to read the file".into(),
        ErrorKind::StorageFull => "the disk is full".into(),
        ErrorKind::FileTooLarge => "the file would exceed the file-size limit (`ulimit -f`)".into(),
        _ => error.to_string(),
    }
}
