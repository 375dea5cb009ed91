//! Atomic writes: the bytes go to a temporary file in the same folder, which is then renamed.

use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::{Builder, NamedTempFile};

use super::folder_of;

/// Prefix of the names of temporary files.
const PREFIX: &str = ".cagework-";
/// Suffix of the names of temporary files.
const SUFFIX: &str = ".part";

/// Path of the temporary file that is being written. The lock is held while the file is created, renamed or removed, so
/// that the signal handler can delete it.
static TEMPORARY_FILE: Mutex<Option<PathBuf>> = Mutex::new(None);

/// Creates or replaces a file. Keeps the permissions of an existing file.
///
/// # Errors
/// If the file cannot be written; an existing file is then unchanged.
pub(super) fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    // Renaming would replace even a read-only file, so check first that the existing file can be opened for writing.
    let permissions = match OpenOptions::new().write(true).open(path) {
        Ok(older) => Some(older.metadata()?.permissions()),
        Err(e) if e.kind() == ErrorKind::NotFound => None,
        Err(e) => return Err(e),
    };
    remove_stale_files(folder_of(path));
    let mut file = {
        let mut temporary = lock_temporary_file();
        let file = create_temporary_file(folder_of(path), permissions.is_some())?;
        *temporary = Some(file.path().to_path_buf());
        file
    };
    let written = permissions
        .map_or(Ok(()), |permissions| file.as_file().set_permissions(permissions))
        .and_then(|()| file.as_file_mut().write_all(bytes))
        // Some file systems report a full disk only when the file is synchronised.
        .and_then(|()| file.as_file().sync_all());
    let mut temporary = lock_temporary_file();
    // On failure, dropping `file` deletes the temporary file before the lock is released.
    let renamed = written.and_then(|()| Ok(file.persist(path).map(drop)?));
    *temporary = None;
    renamed
}

/// Creates a temporary file and locks it, so that [`remove_stale_files`] in another process does not delete it.
/// `is_private`: only the user may open it, until it gets the permissions of the file that it replaces.
fn create_temporary_file(folder: &Path, is_private: bool) -> io::Result<NamedTempFile<File>> {
    let mut builder = Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    loop {
        // `File::create_new` applies the umask; tempfile's default is private.
        let part = if is_private {
            builder.tempfile_in(folder)?
        } else {
            builder.make_in(folder, |path| File::create_new(path))?
        };
        // Retry if another process deleted the file before it was locked. On file systems without locks, no process
        // deletes such files.
        if part.as_file().lock().is_err() || part.path().exists() {
            return Ok(part);
        }
    }
}

/// Deletes temporary files that killed processes left behind; such files are not locked. Runs once per folder.
fn remove_stale_files(folder: &Path) {
    static CLEANED_FOLDERS: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    if !CLEANED_FOLDERS.lock().unwrap_or_else(PoisonError::into_inner).insert(folder.to_path_buf()) {
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
            // Ignore failures: a remaining temporary file does no harm.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Deletes the temporary file, then calls `end`, which ends the process. The lock prevents a rename in between.
pub(crate) fn abandon(end: &mut dyn FnMut()) {
    let temporary = lock_temporary_file();
    if let Some(path) = &*temporary {
        // Ignore failures, because the process ends anyway.
        let _ = std::fs::remove_file(path);
    }
    end();
}

fn lock_temporary_file() -> MutexGuard<'static, Option<PathBuf>> {
    TEMPORARY_FILE.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;

    #[test]
    fn temporary_file_of_a_private_file_is_private_from_its_creation() {
        let folder = tempfile::tempdir().unwrap();
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
        let part = create_temporary_file(folder.path(), true).unwrap();
        assert_eq!(mode(part.path()), 0o600);
        let path = folder.path().join("weights.npz");
        replace(&path, b"old").unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o640)).unwrap();
        replace(&path, b"new").unwrap();
        assert_eq!((mode(&path), std::fs::read(&path).unwrap().as_slice()), (0o640, b"new".as_slice()));
    }
}
