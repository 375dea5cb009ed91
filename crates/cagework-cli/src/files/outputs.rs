//! Outputs: none destroys an input, a file that an input names, or another output.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::PoisonError;
use std::time::SystemTime;

use cagework_core::bind::BindError;
use cagework_core::progress::Cancelled;
use cagework_io::Model;

use super::whole::replace;
use super::{READ, folder_of, read, read_beside, reason};
use crate::error::{CliError, shown_path};
use crate::signals;

/// Most symbolic links on the way to a file, as on Linux.
const MAX_LINKS: usize = 40;

/// Folders whose names stand for files that are open already, such as `/dev/stdout`.
const OPEN_FILES: [&str; 2] = ["/proc", "/dev/fd"];

/// Checks, before the work starts, that outputs can be written and will not destroy an input or each other.
///
/// # Errors
/// When a folder is missing or two names mean one file.
pub(crate) fn check_outputs(outputs: &[&Path], inputs: &[&Path]) -> Result<(), CliError> {
    let inputs: Vec<Named> = inputs.iter().map(|path| Named::new(path)).collect();
    let named: Vec<Named> = outputs.iter().map(|path| Named::new(path)).collect();
    for (i, (output, name)) in outputs.iter().zip(&named).enumerate() {
        let folder = folder_of(output);
        if !folder.is_dir() {
            return Err(CliError::Mismatch {
                message: format!(
                    "{}: cannot be written, there is no folder {}",
                    shown_path(output),
                    shown_path(folder)
                ),
                hint: "make the folder first",
            });
        }
        if output.is_dir() {
            return Err(CliError::file(output, "cannot be written, it is a folder"));
        }
        refuse_inputs(name, &inputs)?;
        if named[..i].iter().any(|other| other.is(name)) {
            return Err(CliError::Mismatch {
                message: format!("{}: is named for two outputs", shown_path(output)),
                hint: "choose different names",
            });
        }
    }
    Ok(())
}

/// Checks, once all inputs are read and before anything is written, that no output is one of the files that were read.
///
/// # Errors
/// When an output is such a file, under this or another name.
pub(crate) fn refuse_files_read(outputs: &[&Path]) -> Result<(), CliError> {
    let read = READ.lock().unwrap_or_else(PoisonError::into_inner);
    outputs.iter().try_for_each(|output| refuse_inputs(&Named::new(output), &read))
}

/// Checks, before anything is written, that no output is a file that one of several models names: it may be read later.
///
/// # Errors
/// Names the output and the model.
pub(crate) fn refuse_files_named(
    models: &[&Path],
    outputs: &[&Path],
    memory_limit: u64,
) -> Result<(), CliError> {
    let outputs: Vec<Named> = outputs.iter().map(|path| Named::new(path)).collect();
    for model in models {
        // What a model names is in its folder or below it.
        let folder = fs::canonicalize(folder_of(model)).unwrap_or_default();
        let is_below =
            |output: &&Named| output.place.as_ref().is_some_and(|place| place.starts_with(&folder));
        let beside: Vec<&Named> = outputs.iter().filter(is_below).collect();
        if beside.is_empty() {
            continue;
        }
        // A model that cannot be read is an error of its own, in its turn.
        let Ok(bytes) = read(model) else { continue };
        let mut resolve = |name: &str| read_beside(model, name);
        for name in Model::named_files(&model.to_string_lossy(), &bytes, &mut resolve, memory_limit) {
            let named = Named::new(&folder_of(model).join(name));
            if let Some(output) = beside.iter().find(|output| output.is(&named)) {
                return Err(CliError::Mismatch {
                    message: format!(
                        "{}: would be overwritten, but {} names it",
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

/// Writes a whole file, or leaves the older one as it was. A symbolic link stays, and the file that it leads to is
/// replaced; devices, pipes and files that are open already are written to as they are.
///
/// # Errors
/// When it cannot be written, is a file that was read, or the work was cancelled meanwhile.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    // The work may have been over before it asked.
    if signals::cancelled() {
        return Err(BindError::Cancelled(Cancelled).into());
    }
    refuse_files_read(&[path])?;
    let written = place(path).and_then(|place| match place {
        Some(file) => replace(&file, bytes),
        None => open_as_it_is(path).and_then(|mut file| file.write_all(bytes)),
    });
    written.map_err(|e| CliError::file(path, format!("cannot be written: {}", reason(&e))))
}

fn refuse_inputs(output: &Named, inputs: &[Named]) -> Result<(), CliError> {
    if inputs.iter().any(|input| input.is(output)) {
        return Err(CliError::Mismatch {
            message: format!("{}: is an input and would be overwritten", shown_path(&output.path)),
            hint: "choose another name for the output",
        });
    }
    Ok(())
}

/// A name of a file, and what the disk says of it: asked once, as thousands are compared with each other.
pub(super) struct Named {
    path: PathBuf,
    /// Length and last change of a regular file; none if it is not there.
    state: Option<(u64, Option<SystemTime>)>,
    /// None for devices, which may well be named twice, and for what is open already.
    place: Option<PathBuf>,
}

impl Named {
    pub(super) fn new(path: &Path) -> Self {
        let state =
            fs::metadata(path).ok().filter(fs::Metadata::is_file).map(|m| (m.len(), m.modified().ok()));
        Self { path: path.into(), state, place: place(path).ok().flatten() }
    }

    /// Whether two names mean one regular file; neither need exist.
    fn is(&self, other: &Self) -> bool {
        // Hard links and descriptors have other names than the file that they are.
        let may_be_linked = self.state.is_some() && self.state == other.state;
        (self.place.is_some() && self.place == other.place)
            || (may_be_linked && same_file::is_same_file(&self.path, &other.path).unwrap_or(false))
    }
}

/// A device or pipe, or the descriptor that a name such as `/dev/fd/3` stands for, at the place where it is: what is open
/// already is neither truncated nor opened again.
fn open_as_it_is(path: &Path) -> io::Result<File> {
    #[cfg(target_os = "linux")]
    if let Some(number) = descriptor(path) {
        use rustix::process::{PidfdFlags, PidfdGetfdFlags, getpid, pidfd_getfd, pidfd_open};
        let own = pidfd_open(getpid(), PidfdFlags::empty())?;
        return Ok(pidfd_getfd(own, number, PidfdGetfdFlags::empty())?.into());
    }
    OpenOptions::new().append(true).open(path)
}

/// The number of this process's descriptor that a name leads to.
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

/// The file that a name leads to through symbolic links, which need not exist. `None`: a device, a pipe or a file that
/// is open already.
fn place(path: &Path) -> io::Result<Option<PathBuf>> {
    if fs::metadata(path).is_ok_and(|m| !m.is_file()) {
        return Ok(None);
    }
    let mut place = path.to_path_buf();
    for _ in 0..MAX_LINKS {
        let folder = fs::canonicalize(folder_of(&place))?;
        if OPEN_FILES.iter().any(|open| folder.starts_with(open)) {
            return Ok(None);
        }
        let file = folder.join(place.file_name().unwrap_or_default());
        match fs::read_link(&file) {
            Ok(target) => place = folder.join(target),
            Err(_) => return Ok(Some(file)),
        }
    }
    Err(io::Error::other("its symbolic links go round in a circle"))
}
