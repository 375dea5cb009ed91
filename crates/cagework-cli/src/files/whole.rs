//! Files appear whole or not at all: each is written beside its place, then renamed.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::Builder;

use super::folder_of;

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
    let mut file = {
        let mut unfinished = unfinished();
        // Made as any new file is, not for the user alone as temporary files are.
        let file = Builder::new()
            .prefix(".cagework-")
            .suffix(".part")
            .make_in(folder_of(path), |path| File::create_new(path))?;
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
