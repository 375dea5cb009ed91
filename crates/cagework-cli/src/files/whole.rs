//! Files appear whole or not at all: each is written beside its place, then renamed.

use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::{Builder, NamedTempFile};

use super::folder_of;

/// How the names of parts begin and end.
const PREFIX: &str = ".cagework-";
const SUFFIX: &str = ".part";

/// The file that is being written beside its place. Locked while it comes and goes, so that a signal finds it.
static UNFINISHED: Mutex<Option<PathBuf>> = Mutex::new(None);

/// Replaces a file by one with these bytes and the permissions of the older one, if there is one.
///
/// # Errors
/// When that is not possible; the older file is then as it was.
pub(super) fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    // Opened only to ask: renaming replaces even a file that must not be written to.
    let permissions = match OpenOptions::new().write(true).open(path) {
        Ok(older) => Some(older.metadata()?.permissions()),
        Err(e) if e.kind() == ErrorKind::NotFound => None,
        Err(e) => return Err(e),
    };
    sweep(folder_of(path));
    let mut file = {
        let mut unfinished = unfinished();
        let file = create_part(folder_of(path))?;
        *unfinished = Some(file.path().to_path_buf());
        file
    };
    let written = file
        .as_file_mut()
        .write_all(bytes)
        .and_then(|()| permissions.map_or(Ok(()), |permissions| file.as_file().set_permissions(permissions)))
        // Some disks say only now that they are full.
        .and_then(|()| file.as_file().sync_all());
    let mut unfinished = unfinished();
    // What is not renamed is removed before the lock is.
    let renamed = written.and_then(|()| Ok(file.persist(path).map(drop)?));
    *unfinished = None;
    renamed
}

/// A new part, locked until it is closed: [`sweep`] leaves it alone.
fn create_part(folder: &Path) -> io::Result<NamedTempFile<File>> {
    loop {
        // Made as any new file is, not for the user alone as temporary files are.
        let part =
            Builder::new().prefix(PREFIX).suffix(SUFFIX).make_in(folder, |path| File::create_new(path))?;
        // A sweep may have removed it before it was locked. Where there are no locks there are no sweeps.
        if part.as_file().lock().is_err() || part.path().exists() {
            return Ok(part);
        }
    }
}

/// Removes what killed processes left in a folder, once for each folder: parts that nobody holds a lock on.
fn sweep(folder: &Path) {
    static SWEPT: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    if !SWEPT.lock().unwrap_or_else(PoisonError::into_inner).insert(folder.to_path_buf()) {
        return;
    }
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let is_part = name.to_str().is_some_and(|name| name.starts_with(PREFIX) && name.ends_with(SUFFIX));
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        if is_part
            && is_file
            && let Ok(part) = OpenOptions::new().write(true).open(entry.path())
            && part.try_lock().is_ok()
        {
            // What cannot be removed stays.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Removes an unfinished file and does `end`, which is to end the process; nothing is renamed meanwhile.
pub(crate) fn abandon(end: &mut dyn FnMut()) {
    let unfinished = unfinished();
    if let Some(path) = &*unfinished {
        // Nobody is left to tell.
        let _ = std::fs::remove_file(path);
    }
    end();
}

fn unfinished() -> MutexGuard<'static, Option<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}
