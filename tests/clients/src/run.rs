//! Finds programs on the machine and runs them with settings of their own.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::install::clients;

/// The user id of `nobody`, which is the same on every Linux.
const NOBODY: u32 = 65_534;

/// Finds the first of these programs on the path. If there is none, the test fails with the Debian
/// package to install.
pub fn found(names: &[&str], package: &str) -> PathBuf {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    let all = names.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    all.into_iter().find(|program| program.is_file()).unwrap_or_else(|| {
        panic!("NOT RUN: there is no {} here (Debian: apt-get install {package})", names.join(", no "))
    })
}

/// A program that sees none of the user's settings: it has a bare environment and a home folder of
/// ours below the target folder. The home must exist, because these programs create it if root runs
/// them.
pub fn outside(program: impl AsRef<OsStr>) -> Command {
    let mut command = Command::new(program);
    command.env_clear();
    for kept in ["PATH", "TMPDIR"] {
        if let Some(value) = std::env::var_os(kept) {
            command.env(kept, value);
        }
    }
    let home = clients().join("home");
    std::fs::create_dir_all(&home).expect("a folder");
    command.env("HOME", home).env("LANG", "C.UTF-8");
    // Python writes lines at once and leaves no files beside our scripts.
    command.env("PYTHONUNBUFFERED", "1").env("PYTHONDONTWRITEBYTECODE", "1");
    command
}

/// Wireshark without a window, in a folder made with [`tshark_folder`]. It runs no scripts as root,
/// so root runs it as `nobody`.
pub fn tshark(folder: &Path) -> Command {
    let mut command = outside(found(&["tshark"], "tshark"));
    // `-n` turns name resolution off.
    command.arg("-n").current_dir(folder).env("HOME", folder.join("no-home"));
    // A dissector installed for the whole machine may have the name of ours.
    command.env("WIRESHARK_PLUGIN_DIR", folder.join("no-plugins"));
    if nix::unistd::geteuid().is_root() {
        use std::os::unix::process::CommandExt as _;
        command.uid(NOBODY).gid(NOBODY);
    }
    command
}

/// Makes a folder readable for `nobody`; the usual folder for temporary files may be readable by
/// root only.
///
/// # Errors
/// As [`std::fs::set_permissions`].
pub fn tshark_folder(folder: &Path) -> std::io::Result<()> {
    std::fs::set_permissions(folder, std::os::unix::fs::PermissionsExt::from_mode(0o755))
}
