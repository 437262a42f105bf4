//! Programs that the machine has, run with settings of their own.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::install::clients;

/// The account without rights; its number is the same on every Linux.
const NOBODY: u32 = 65_534;

/// The first of these programs that is on the path.
///
/// # Panics
/// There is none; the message names the Debian package that has it.
pub fn found(names: &[&str], package: &str) -> PathBuf {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    let all = names.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    all.into_iter().find(|program| program.is_file()).unwrap_or_else(|| {
        panic!("NOT RUN: there is no {} here (Debian: apt-get install {package})", names.join(", no "))
    })
}

/// A program that sees none of the user's settings: a bare environment, and a home of ours below the target folder. A home
/// that does not exist would not do: run by root, these programs make it.
///
/// # Panics
/// The folder for its home cannot be made.
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
    // Lines come as they are written, and no file is left beside our scripts.
    command.env("PYTHONUNBUFFERED", "1").env("PYTHONDONTWRITEBYTECODE", "1");
    command
}

/// Wireshark without a window, in a folder of [`tshark_folder`]. It takes no script from root, so nobody runs it then.
pub fn tshark(folder: &Path) -> Command {
    let mut command = outside(found(&["tshark"], "tshark"));
    // Names are not looked up: a reader of files asks nobody.
    command.arg("-n").current_dir(folder).env("HOME", folder.join("no-home"));
    // A dissector that was installed for the whole machine may have our dissector's name.
    command.env("WIRESHARK_PLUGIN_DIR", folder.join("no-plugins"));
    if nix::unistd::geteuid().is_root() {
        use std::os::unix::process::CommandExt as _;
        command.uid(NOBODY).gid(NOBODY);
    }
    command
}

/// A folder that nobody can read; the usual one for temporary files may be root's alone.
///
/// # Errors
/// As [`std::fs::set_permissions`].
pub fn tshark_folder(folder: &Path) -> std::io::Result<()> {
    std::fs::set_permissions(folder, std::os::unix::fs::PermissionsExt::from_mode(0o755))
}
