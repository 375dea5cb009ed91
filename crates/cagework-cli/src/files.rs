//! Files in and out: the only place of the command that touches the file system.

use std::fs::{self, File};
use std::io::{ErrorKind, Read as _, Write as _};
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::error::CliError;

/// Largest file that is read, bytes: above it the model's arrays would not fit a 32-bit index any more.
const MAX_FILE_BYTES: u64 = 2 << 30;

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

/// Checks, before the work starts, that outputs can be written and will not destroy an input or each other.
///
/// # Errors
/// When a folder is missing or two names mean one file.
pub(crate) fn check_outputs(outputs: &[&Path], inputs: &[&Path]) -> Result<(), CliError> {
    for (i, output) in outputs.iter().enumerate() {
        let folder = folder_of(output);
        if !folder.is_dir() {
            return Err(CliError::Mismatch {
                message: format!(
                    "{}: cannot be written, there is no folder {}",
                    output.display(),
                    folder.display()
                ),
                hint: "make the folder first",
            });
        }
        if output.is_dir() {
            return Err(CliError::file(output, "cannot be written, it is a folder"));
        }
        if inputs.iter().any(|input| same_file(input, output)) {
            return Err(CliError::Mismatch {
                message: format!("{}: is an input and would be overwritten", output.display()),
                hint: "choose another name for the output",
            });
        }
        if outputs[..i].iter().any(|other| same_file(other, output)) {
            return Err(CliError::Mismatch {
                message: format!("{}: is named for two outputs", output.display()),
                hint: "choose different names",
            });
        }
    }
    Ok(())
}

/// Writes a whole file.
///
/// # Errors
/// When it cannot be written.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    fs::write(path, bytes).map_err(|e| CliError::file(path, format!("cannot be written: {}", reason(&e))))
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

/// Whether two names mean one file; neither need exist.
fn same_file(a: &Path, b: &Path) -> bool {
    let resolve = |path: &Path| -> Option<PathBuf> {
        fs::canonicalize(path)
            .or_else(|_| {
                Ok::<_, std::io::Error>(
                    fs::canonicalize(folder_of(path))?.join(path.file_name().unwrap_or_default()),
                )
            })
            .ok()
    };
    // Devices such as /dev/null may well be named twice.
    let special = fs::metadata(a).is_ok_and(|m| !m.is_file());
    !special && resolve(a).is_some_and(|a| resolve(b) == Some(a))
}

/// An operating-system error in our own words.
fn reason(error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "there is no such file".into(),
        ErrorKind::PermissionDenied => "permission denied".into(),
        ErrorKind::OutOfMemory => "not enough memory to read it".into(),
        _ => error.to_string(),
    }
}
