//! Checks that outputs overwrite no input and no other output, and writes them.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::PoisonError;
use std::time::SystemTime;

use cagework_core::bind::BindError;
use cagework_core::progress::Cancellation;
use cagework_io::Model;

use super::whole::replace;
use super::{INPUT_FILES, folder_of, is_stream, read, read_beside, reason, write_to_stdout};
use crate::error::{CliError, shown_path};
use crate::signals;

/// Maximum number of symbolic links that are followed for one path, as in Linux.
const MAX_LINKS: usize = 40;

/// Folders whose entries stand for open file descriptors.
const DESCRIPTOR_FOLDERS: [&str; 2] = ["/proc", "/dev/fd"];

/// Checks, before the work starts, that the folders of all outputs exist and that no output is an input or another
/// output.
///
/// # Errors
/// If a check fails. The error names the missing folder or the conflicting file.
pub(crate) fn check_outputs(outputs: &[&Path], inputs: &[&Path]) -> Result<(), CliError> {
    let inputs: Vec<FileIdentity> = inputs.iter().map(|path| FileIdentity::new(path)).collect();
    let identities: Vec<FileIdentity> = outputs.iter().map(|path| FileIdentity::new(path)).collect();
    for (i, (output, identity)) in outputs.iter().zip(&identities).enumerate() {
        let folder = folder_of(output);
        if !folder.is_dir() {
            return Err(CliError::Mismatch {
                message: format!(
                    "{}: cannot be written, the folder {} does not exist",
                    shown_path(output),
                    shown_path(folder)
                ),
                hint: "create the folder first",
            });
        }
        if output.is_dir() {
            return Err(CliError::file(output, "cannot be written, a folder has this name"));
        }
        refuse_inputs(identity, &inputs)?;
        let is_second_stream = is_stream(output) && outputs[..i].contains(output);
        if is_second_stream || identities[..i].iter().any(|other| other.is_same(identity)) {
            return Err(CliError::Mismatch {
                message: format!("{}: is given for two outputs", shown_path(output)),
                hint: "choose different names",
            });
        }
    }
    Ok(())
}

/// Checks, after all inputs have been read and before anything is written, that no output is one of the files that were
/// read.
///
/// # Errors
/// If an output was read. The error names it.
pub(crate) fn refuse_files_read(outputs: &[&Path]) -> Result<(), CliError> {
    let read = INPUT_FILES.lock().unwrap_or_else(PoisonError::into_inner);
    outputs.iter().try_for_each(|output| refuse_inputs(&FileIdentity::new(output), &read))
}

/// Checks, before anything is written, that no output is a file that a model names and that will be read later.
///
/// # Errors
/// If an output is such a file. The error names the output and the model.
pub(crate) fn refuse_files_named(
    models: &[&Path],
    outputs: &[&Path],
    memory_limit: u64,
) -> Result<(), CliError> {
    let outputs: Vec<FileIdentity> = outputs.iter().map(|path| FileIdentity::new(path)).collect();
    for model in models {
        // A model can only name files in its own folder and its subfolders.
        let folder = fs::canonicalize(folder_of(model)).unwrap_or_default();
        let is_below =
            |output: &&FileIdentity| output.place.as_ref().is_some_and(|place| place.starts_with(&folder));
        let beside: Vec<&FileIdentity> = outputs.iter().filter(is_below).collect();
        if beside.is_empty() {
            continue;
        }
        // Skip unreadable models; their error is reported when they are refitted.
        let Ok(bytes) = read(model) else { continue };
        let mut resolve = |name: &str| read_beside(model, name);
        for name in Model::named_files(&model.to_string_lossy(), &bytes, &mut resolve, memory_limit) {
            let identity = FileIdentity::new(&folder_of(model).join(name));
            if let Some(output) = beside.iter().find(|output| output.is_same(&identity)) {
                return Err(CliError::Mismatch {
                    message: format!(
                        "{}: would be overwritten, but {} uses it",
                        shown_path(&output.path),
                        shown_path(model)
                    ),
                    hint: "choose another folder for the output",
                });
            }
        }
    }
    Ok(())
}

/// Writes an output to a file or to stdout. Creates or replaces a file atomically; on failure, an existing file is unchanged. A symbolic link is preserved, and
/// its target is written. Devices, pipes and open descriptors are appended to.
///
/// # Errors
/// If the file cannot be written or was an input, or the work was cancelled.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    // A signal may have arrived since the work last polled for cancellation.
    if signals::cancelled() {
        return Err(BindError::Cancelled(Cancellation).into());
    }
    if is_stream(path) {
        return write_to_stdout(bytes);
    }
    refuse_files_read(&[path])?;
    let written = place(path).and_then(|place| match place {
        Some(file) => replace(&file, bytes),
        None => open_for_append(path).and_then(|mut file| file.write_all(bytes)),
    });
    written.map_err(|e| CliError::file(path, format!("cannot be written: {}", reason(&e))))
}

fn refuse_inputs(output: &FileIdentity, inputs: &[FileIdentity]) -> Result<(), CliError> {
    if inputs.iter().any(|input| input.is_same(output)) {
        return Err(CliError::Mismatch {
            message: format!("{}: is an input and would be overwritten", shown_path(&output.path)),
            hint: "choose another name for the output",
        });
    }
    Ok(())
}

/// Identity of a file, which may not exist yet. It is computed once per file, because thousands of files are compared
/// with each other.
pub(super) struct FileIdentity {
    path: PathBuf,
    /// Length and modification time; `None` unless the path is an existing regular file.
    state: Option<(u64, Option<SystemTime>)>,
    /// Canonical path; `None` for devices, which several outputs may use, and for open descriptors.
    place: Option<PathBuf>,
}

impl FileIdentity {
    pub(super) fn new(path: &Path) -> Self {
        if is_stream(path) {
            return Self { path: path.into(), state: None, place: None };
        }
        let state =
            fs::metadata(path).ok().filter(fs::Metadata::is_file).map(|m| (m.len(), m.modified().ok()));
        Self { path: path.into(), state, place: place(path).ok().flatten() }
    }

    /// Whether the two paths lead to the same regular file.
    fn is_same(&self, other: &Self) -> bool {
        // Hard links and descriptors of one file have different paths. Comparing lengths and times first rules out most
        // pairs cheaply.
        let may_be_linked = self.state.is_some() && self.state == other.state;
        (self.place.is_some() && self.place == other.place)
            || (may_be_linked && same_file::is_same_file(&self.path, &other.path).unwrap_or(false))
    }
}

/// Opens a device or pipe for appending. On Linux, a name such as `/dev/fd/3` gives a duplicate of that descriptor,
/// which continues at its position: opening the name would start at the beginning of the file, or append to its end.
fn open_for_append(path: &Path) -> io::Result<File> {
    #[cfg(target_os = "linux")]
    if let Some(number) = descriptor(path) {
        use rustix::process::{PidfdFlags, PidfdGetfdFlags, getpid, pidfd_getfd, pidfd_open};
        let own = pidfd_open(getpid(), PidfdFlags::empty())?;
        return Ok(pidfd_getfd(own, number, PidfdGetfdFlags::empty())?.into());
    }
    OpenOptions::new().append(true).open(path)
}

/// Returns the number of this process's descriptor to which a path leads through symbolic links; `None` for other
/// paths.
#[cfg(target_os = "linux")]
fn descriptor(path: &Path) -> Option<i32> {
    let own = fs::canonicalize("/proc/self/fd").ok()?;
    let mut place = path.to_path_buf();
    for _ in 0..MAX_LINKS {
        let folder = fs::canonicalize(folder_of(&place)).ok()?;
        let name = place.file_name()?;
        if folder == own {
            return name.to_str()?.parse().ok();
        }
        place = folder.join(fs::read_link(folder.join(name)).ok()?);
    }
    None
}

/// Resolves symbolic links of a path; the file itself need not exist. `None` for a device, a pipe or an open
/// descriptor.
fn place(path: &Path) -> io::Result<Option<PathBuf>> {
    if fs::metadata(path).is_ok_and(|m| !m.is_file()) {
        return Ok(None);
    }
    let mut place = path.to_path_buf();
    for _ in 0..MAX_LINKS {
        let folder = fs::canonicalize(folder_of(&place))?;
        if DESCRIPTOR_FOLDERS.iter().any(|descriptors| folder.starts_with(descriptors)) {
            return Ok(None);
        }
        let file = folder.join(place.file_name().unwrap_or_default());
        match fs::read_link(&file) {
            Ok(target) => place = folder.join(target),
            Err(_) => return Ok(Some(file)),
        }
    }
    Err(io::Error::other("its symbolic links form a circle"))
}
