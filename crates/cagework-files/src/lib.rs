//! Reads files for the command and the Python package: regular files up to a limit, and the files that a model names in
//! its own folder. Opening never waits, so a pipe without a writer is refused at once.

use std::io::{Error, ErrorKind, Read as _, Result};
use std::path::Path;

use cagework_io::MAX_MODEL_BYTES;
use cap_fs_ext::OpenOptionsSyncExt as _;
use cap_std::ambient_authority;
use cap_std::fs::{Dir, File, OpenOptions};

/// Reads a whole file.
///
/// # Errors
/// If it is missing, empty, larger than [`MAX_MODEL_BYTES`], not a regular file, or cannot be read. The message of a
/// refused file is a predicate, such as "is empty".
pub fn read(path: &Path) -> Result<Vec<u8>> {
    content(File::open_ambient_with(path, &to_read(), ambient_authority())?)
}

/// Reads a stream, such as standard input, to its end.
///
/// # Errors
/// If it is empty, longer than [`MAX_MODEL_BYTES`], or cannot be read. The message of a refused stream is a predicate.
pub fn read_stream(stream: impl std::io::Read) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    stream.take(MAX_MODEL_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.is_empty() {
        return Err(Error::other("is empty"));
    }
    check_size(bytes.len() as u64).map(|()| bytes)
}

/// Reads a file that the model `main` names by a relative path, such as a glTF buffer. `None` if the file does not exist.
///
/// # Errors
/// As [`read`], or if the path, or a symbolic link on it, leads out of the folder of `main`.
#[must_use]
pub fn read_beside(main: &Path, relative: &str) -> Option<Result<Vec<u8>>> {
    let folder = Dir::open_ambient_dir(folder_of(main), ambient_authority());
    match folder.and_then(|folder| folder.open_with(relative, &to_read())) {
        Ok(file) => Some(content(file)),
        Err(error) => match error.kind() {
            ErrorKind::NotFound => None,
            // cap-std reports a path that leads out of the folder with this kind, and without a system error number.
            ErrorKind::PermissionDenied if error.raw_os_error().is_none() => {
                Some(Err(Error::other("leads out of the model's folder")))
            }
            _ => Some(Err(error)),
        },
    }
}

/// Folder of a file; `.` for a file name alone.
#[must_use]
pub fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Returns the options for opening files to read. Opening is non-blocking, because opening a pipe would otherwise wait
/// for a writer.
fn to_read() -> OpenOptions {
    let mut options = OpenOptions::new();
    options.read(true).nonblock(true);
    options
}

fn content(file: File) -> Result<Vec<u8>> {
    // Ask the open file rather than its path, which another process may replace.
    let metadata = file.metadata()?;
    if metadata.is_dir() {
        return Err(Error::new(ErrorKind::IsADirectory, "is a folder, not a file"));
    }
    if !metadata.is_file() {
        return Err(Error::other("is a pipe or a device, not a regular file"));
    }
    check_size(metadata.len())?;
    // Files in /proc and similar file systems report a length of 0 as well. They are rejected too, although they are
    // not empty.
    if metadata.len() == 0 {
        return Err(Error::other("is empty"));
    }
    let mut bytes = Vec::new();
    let no_memory =
        || Error::other(format!("needs {} MiB of memory, more than is available", metadata.len() >> 20));
    bytes.try_reserve_exact(metadata.len() as usize).map_err(|_| no_memory())?;
    // The file may have grown since its length was read.
    file.take(MAX_MODEL_BYTES + 1).read_to_end(&mut bytes)?;
    check_size(bytes.len() as u64).map(|()| bytes)
}

fn check_size(bytes: u64) -> Result<()> {
    let limit = MAX_MODEL_BYTES >> 20;
    let problem = || Error::other(format!("is {} MiB large; at most {limit} MiB are read", bytes >> 20));
    if bytes > MAX_MODEL_BYTES { Err(problem()) } else { Ok(()) }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn pipes_devices_folders_and_paths_out_of_the_folder_are_refused_without_waiting() {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("inner");
        std::fs::create_dir(&inner).unwrap();
        std::fs::write(folder.path().join("outside.bin"), "secret").unwrap();
        let mode = rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR;
        let pipe = inner.join("pipe");
        rustix::fs::mknodat(rustix::fs::CWD, &pipe, rustix::fs::FileType::Fifo, mode, 0).unwrap();
        std::os::unix::fs::symlink("../outside.bin", inner.join("link")).unwrap();
        std::fs::write(inner.join("empty"), "").unwrap();
        let main = inner.join("model.gltf");
        let beside = |name: &str| read_beside(&main, name).unwrap().unwrap_err().to_string();
        assert_eq!(read(&pipe).unwrap_err().to_string(), "is a pipe or a device, not a regular file");
        assert_eq!(
            read(Path::new("/dev/zero")).unwrap_err().to_string(),
            "is a pipe or a device, not a regular file"
        );
        assert_eq!(read(&inner).unwrap_err().kind(), ErrorKind::IsADirectory);
        assert_eq!(beside("pipe"), "is a pipe or a device, not a regular file");
        assert_eq!(beside("empty"), "is empty");
        assert_eq!(beside("link"), "leads out of the model's folder");
        assert_eq!(beside("../outside.bin"), "leads out of the model's folder");
        assert!(read_beside(&main, "missing").is_none());
    }
}
