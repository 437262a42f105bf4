//! The sockets of this user's stations: where they are, and that no other user can reach them.
//!
//! Each station has its own socket in one directory, named after its process id. A socket at
//! another path is linked from that directory.

use std::io;
use std::os::unix::fs::{DirBuilderExt as _, MetadataExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

use tokio::net::{UnixListener, UnixStream};

/// Read and write for the owner alone.
const SOCKET_MODE: u32 = 0o600;
const DIRECTORY_MODE: u32 = 0o700;
const ENDING: &str = "sock";

/// The directory of this user's stations: in `XDG_RUNTIME_DIR`, else below `/tmp`.
pub fn directory() -> PathBuf {
    match std::env::var_os("XDG_RUNTIME_DIR").filter(|directory| !directory.is_empty()) {
        Some(directory) => PathBuf::from(directory).join("touchdown"),
        None => PathBuf::from(format!("/tmp/touchdown-{}", current_user().unwrap_or(0))),
    }
}

/// The socket path of this process in that directory.
pub fn default_path() -> PathBuf {
    directory().join(format!("{}.{ENDING}", std::process::id()))
}

/// The sockets in the directory, sorted by name. A station may or may not be running on each.
///
/// # Errors
/// The directory belongs to another user or cannot be read.
pub fn sockets() -> io::Result<Vec<PathBuf>> {
    let directory = directory();
    let entries = match std::fs::read_dir(&directory) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(error),
    };
    check_owner(&directory)?;
    let paths = entries.filter_map(|entry| entry.ok().map(|entry| entry.path()));
    let mut sockets: Vec<PathBuf> =
        paths.filter(|path| path.extension().is_some_and(|ending| ending == ENDING)).collect();
    sockets.sort();
    Ok(sockets)
}

/// The user id of this process; `None` if the system does not tell it.
pub fn current_user() -> Option<u32> {
    std::fs::metadata("/proc/self").ok().map(|process| process.uid())
}

/// Connects to a running station.
///
/// # Errors
/// No station runs there, or it belongs to another user.
pub async fn connect(path: &Path) -> io::Result<UnixStream> {
    let stream = UnixStream::connect(path).await?;
    check_peer(&stream)?;
    Ok(stream)
}

/// Checks that the other end belongs to the same user.
///
/// # Errors
/// It belongs to another user, or the system does not tell.
pub fn check_peer(stream: &UnixStream) -> io::Result<()> {
    check_user(stream.peer_cred()?.uid(), "the other end")
}

/// Checks that something belongs to this user.
fn check_user(other: u32, what: &str) -> io::Result<()> {
    match current_user() {
        Some(user) if user != other => Err(io::Error::new(
            io::ErrorKind::PermissionDenied,
            format!("{what} belongs to user {other}, not to user {user}"),
        )),
        _ => Ok(()),
    }
}

/// Checks the owner of the directory, because anybody could create it below `/tmp`.
fn check_owner(directory: &Path) -> io::Result<()> {
    check_user(std::fs::metadata(directory)?.uid(), &directory.display().to_string())
}

/// Listens on a path and replaces a socket without a listener.
///
/// # Errors
/// A station already runs there, or the path cannot be written.
pub async fn listen(path: &Path) -> io::Result<UnixListener> {
    if path.symlink_metadata().is_ok() {
        if UnixStream::connect(path).await.is_ok() {
            return Err(io::Error::new(io::ErrorKind::AddrInUse, "a ground station serves it already"));
        }
        std::fs::remove_file(path)?;
    }
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    make(parent)?;
    if parent == directory() {
        check_owner(parent)?;
    }
    // Bound in a private directory first, so that it is never open to other users.
    let hidden = parent.join(format!(".touchdown-{}", std::process::id()));
    std::fs::DirBuilder::new().mode(DIRECTORY_MODE).create(&hidden)?;
    let bound = bind_and_move(&hidden.join("s"), path);
    // The directory is empty unless binding failed, and then that error is returned.
    let _ = std::fs::remove_dir_all(&hidden);
    bound
}

/// Links a socket at another path from the directory of stations; returns the link.
///
/// # Errors
/// The directory cannot be written.
pub fn link_from_directory(path: &Path) -> io::Result<PathBuf> {
    let link = default_path();
    make(&directory())?;
    check_owner(&directory())?;
    if link.symlink_metadata().is_ok() {
        // Left by a process with the same id that is gone.
        std::fs::remove_file(&link)?;
    }
    std::os::unix::fs::symlink(std::path::absolute(path)?, &link)?;
    Ok(link)
}

fn make(directory: &Path) -> io::Result<()> {
    if directory.exists() {
        return Ok(());
    }
    std::fs::DirBuilder::new().recursive(true).mode(DIRECTORY_MODE).create(directory)
}

fn bind_and_move(from: &Path, to: &Path) -> io::Result<UnixListener> {
    let listener = UnixListener::bind(from)?;
    std::fs::set_permissions(from, std::fs::Permissions::from_mode(SOCKET_MODE))?;
    std::fs::rename(from, to)?;
    Ok(listener)
}
