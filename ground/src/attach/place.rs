//! Where the socket is, and that nobody but its owner can reach it.

use std::io;
use std::os::unix::fs::{DirBuilderExt as _, MetadataExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

use tokio::net::{UnixListener, UnixStream};

const NAME: &str = "touchdown-ground.sock";
/// Read and write for the owner alone.
const SOCKET_MODE: u32 = 0o600;
const DIRECTORY_MODE: u32 = 0o700;

/// The socket of this user: in `XDG_RUNTIME_DIR`, else in a directory of its own below `/tmp`.
pub fn default_path() -> PathBuf {
    match std::env::var_os("XDG_RUNTIME_DIR").filter(|directory| !directory.is_empty()) {
        Some(directory) => PathBuf::from(directory).join(NAME),
        None => PathBuf::from(format!("/tmp/touchdown-{}", own_user().unwrap_or(0))).join(NAME),
    }
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

/// Listens; a socket that nobody listens on any more is replaced.
///
/// # Errors
/// A station runs there already, or the place cannot be written.
pub async fn listen(path: &Path) -> io::Result<UnixListener> {
    if path.exists() {
        if UnixStream::connect(path).await.is_ok() {
            return Err(io::Error::new(io::ErrorKind::AddrInUse, "a ground station serves it already"));
        }
        std::fs::remove_file(path)?;
    }
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !parent.exists() {
        std::fs::DirBuilder::new().recursive(true).mode(DIRECTORY_MODE).create(parent)?;
    }
    // Bound where nobody else can look, so that it is never open to others for a moment.
    let hidden = parent.join(format!(".touchdown-{}", std::process::id()));
    std::fs::DirBuilder::new().mode(DIRECTORY_MODE).create(&hidden)?;
    let bound = bind_and_move(&hidden.join("s"), path);
    // Empty by now, unless binding failed; then the failure says more.
    let _ = std::fs::remove_dir_all(&hidden);
    bound
}

fn bind_and_move(from: &Path, to: &Path) -> io::Result<UnixListener> {
    let listener = UnixListener::bind(from)?;
    std::fs::set_permissions(from, std::fs::Permissions::from_mode(SOCKET_MODE))?;
    std::fs::rename(from, to)?;
    Ok(listener)
}
