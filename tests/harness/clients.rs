//! Other people's MAVLink clients, installed by `clients/setup` into the target folder and nowhere else.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// Other people's programs in a folder of this name below the target folder, put there by a script that takes the folder.
/// `None`, and a loud line, where this machine cannot have them.
///
/// # Panics
/// They cannot be installed, and [`REQUIRED`] is set.
pub fn install(setup: &Path, name: &str) -> Option<PathBuf> {
    let test = std::env::current_exe().expect("the path of this test");
    // target/<profile>/deps/<test>
    let folder = test.ancestors().nth(3).expect("the target folder").join(name);
    let trouble = match Command::new(setup).arg(&folder).output() {
        Ok(output) if output.status.success() => return Some(folder),
        Ok(output) => String::from_utf8_lossy(&output.stderr).into_owned(),
        Err(error) => error.to_string(),
    };
    assert!(std::env::var_os(REQUIRED).is_none(), "the {name} cannot be installed: {trouble}");
    // Past the test's captured output, so that nobody overlooks it; nothing is left to do if it cannot be said.
    let _ =
        writeln!(std::io::stderr(), "NOT RUN: other people's {name} cannot be installed here:\n{trouble}");
    None
}

/// Where the clients are.
#[derive(Debug, Clone, Copy)]
pub struct Clients {
    folder: &'static Path,
}

/// Set by the continuous integration: there, a missing client fails the test.
const REQUIRED: &str = "TOUCHDOWN_CLIENTS_REQUIRED";

impl Clients {
    /// The clients, installed by the first call. `None`, and a loud line, where this machine cannot have them.
    ///
    /// # Panics
    /// They cannot be installed, and [`REQUIRED`] is set.
    pub fn installed() -> Option<Self> {
        static FOLDER: OnceLock<Option<PathBuf>> = OnceLock::new();
        let folder = FOLDER.get_or_init(|| install(&scripts().join("setup"), "clients"));
        folder.as_deref().map(|folder| Self { folder })
    }

    /// A script of ours in the Python environment of this name.
    pub fn python(self, environment: &str, script: &str) -> Command {
        let mut command = Command::new(self.folder.join(environment).join("bin/python"));
        command.arg(scripts().join(script));
        command
    }

    /// A program that came with the Python environment of this name.
    pub fn program(self, environment: &str, program: &str) -> Command {
        let bin = self.folder.join(environment).join("bin");
        let mut command = Command::new(bin.join("python"));
        command.arg(bin.join(program));
        command
    }

    /// A script of ours for Node.
    pub fn node(self, script: &str) -> Command {
        let mut command = Command::new("node");
        command.arg(scripts().join(script)).current_dir(self.folder.join("node"));
        command
    }

    /// Wireshark without a window. It ignores where its files are when run by root, so it is run by nobody then.
    pub fn tshark(self) -> Command {
        let root = self.folder.join("wireshark/root");
        let program = root.join("usr/bin/tshark");
        let mut command = if nix::unistd::geteuid().is_root() {
            let mut command = Command::new("setpriv");
            command.args(["--reuid=65534", "--regid=65534", "--clear-groups"]).arg(program);
            command
        } else {
            Command::new(program)
        };
        command
            .env("HOME", "/nonexistent")
            .env("LD_LIBRARY_PATH", root.join("usr/lib/x86_64-linux-gnu"))
            .env("WIRESHARK_DATA_DIR", root.join("usr/share/wireshark"));
        command
    }
}

fn scripts() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("clients")
}
