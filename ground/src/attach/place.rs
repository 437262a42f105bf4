//! Where the stations of this user are found, and that nobody else can reach them.
//!
//! Each station has a socket of its own, named by its process, in one directory; a socket that was asked for elsewhere is
//! linked to from there.

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
        None => PathBuf::from(format!("/tmp/touchdown-{}", own_user().unwrap_or(0))),
    }
}

/// This process's place in the directory of stations.
pub fn own_path() -> PathBuf {
    directory().join(format!("{}.{ENDING}", std::process::id()))
}

/// The places where a station of this user may listen, in the order of their names.
///
/// # Errors
/// The directory is somebody else's, or cannot be read.
pub fn places() -> io::Result<Vec<PathBuf>> {
    let directory = directory();
    let entries = match std::fs::read_dir(&directory) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(error),
    };
    own_directory(&directory)?;
    let paths = entries.filter_map(|entry| entry.ok().map(|entry| entry.path()));
    let mut places: Vec<PathBuf> =
        paths.filter(|path| path.extension().is_some_and(|ending| ending == ENDING)).collect();
    places.sort();
    Ok(places)
}

/// Whose process this is; `None` where the system does not say.
pub fn own_user() -> Option<u32> {
    std::fs::metadata("/proc/self").ok().map(|process| process.uid())
}

/// Connects to a running station.
///
/// # Errors
/// None runs there, or it belongs to somebody else.
pub async fn connect(path: &Path) -> io::Result<UnixStream> {
    let stream = UnixStream::connect(path).await?;
    own(&stream)?;
    Ok(stream)
}

/// Whether the other end is this user's, too.
///
/// # Errors
/// It is somebody else's, or the system does not say.
pub fn own(stream: &UnixStream) -> io::Result<()> {
    let other = stream.peer_cred()?.uid();
    match own_user() {
        Some(user) if user != other => Err(io::Error::new(
            io::ErrorKind::PermissionDenied,
            format!("the other end belongs to user {other}, not to user {user}"),
        )),
        _ => Ok(()),
    }
}

/// Anybody can make a directory below `/tmp` before its user does.
fn own_directory(directory: &Path) -> io::Result<()> {
    let owner = std::fs::metadata(directory)?.uid();
    match own_user() {
        Some(user) if user != owner => Err(io::Error::new(
            io::ErrorKind::PermissionDenied,
            format!("{} belongs to user {owner}, not to user {user}", directory.display()),
        )),
        _ => Ok(()),
    }
}

/// Listens; a socket that nobody listens on any more is replaced.
///
/// # Errors
/// A station runs there already, or the place cannot be written.
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
        own_directory(parent)?;
    }
    // Bound where nobody else can look, so that it is never open to others for a moment.
    let hidden = parent.join(format!(".touchdown-{}", std::process::id()));
    std::fs::DirBuilder::new().mode(DIRECTORY_MODE).create(&hidden)?;
    let bound = bind_and_move(&hidden.join("s"), path);
    // Empty by now, unless binding failed; then the failure says more.
    let _ = std::fs::remove_dir_all(&hidden);
    bound
}

/// Makes a socket elsewhere known in the directory of stations; returns the link to it.
///
/// # Errors
/// The directory cannot be written.
pub fn make_known(path: &Path) -> io::Result<PathBuf> {
    let link = own_path();
    make(&directory())?;
    own_directory(&directory())?;
    if link.symlink_metadata().is_ok() {
        // Of a process that had the same number and is gone.
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
