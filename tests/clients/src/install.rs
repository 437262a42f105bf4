//! Installs Python and Node packages, each group into a folder of its own.

use std::ffi::OsStr;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use crate::run::{found, outside};

/// The settings of pip and npm in the environment that determine how packages are downloaded and
/// where downloads are cached. They stay as the user has set them. All other settings are removed,
/// because they could change where packages are installed.
const WAYS: [&str; 17] = [
    "index_url",
    "extra_index_url",
    "find_links",
    "no_index",
    "cert",
    "client_cert",
    "trusted_host",
    "default_timeout",
    "timeout",
    "retries",
    "config_file",
    "cache_dir",
    "cache",
    "registry",
    "cafile",
    "strict_ssl",
    "userconfig",
];
const PROXIES: [&str; 4] = ["proxy", "https_proxy", "http_proxy", "noproxy"];

/// A Python environment with these packages.
#[derive(Debug)]
pub struct PythonPackages {
    name: &'static str,
    packages: &'static [&'static str],
    options: &'static [&'static str],
    folder: OnceLock<PathBuf>,
}

impl PythonPackages {
    /// These packages and their dependencies.
    pub const fn with_dependencies(name: &'static str, packages: &'static [&'static str]) -> Self {
        Self { name, packages, options: &[], folder: OnceLock::new() }
    }

    /// These packages without their dependencies.
    pub const fn without_dependencies(name: &'static str, packages: &'static [&'static str]) -> Self {
        Self { name, packages, options: &["--no-deps"], folder: OnceLock::new() }
    }

    /// The environment's Python, to which a script is passed.
    pub fn python(&self) -> Command {
        outside(self.installed().join("bin/python"))
    }

    /// A program that a package contains. It is a Python script whose first line may name another
    /// folder.
    pub fn program(&self, name: &str) -> Command {
        let mut command = self.python();
        command.arg(self.installed().join("bin").join(name));
        command
    }

    /// The environment's folder; the first call installs it.
    pub fn installed(&self) -> &Path {
        self.folder.get_or_init(|| self.install_below(&clients()))
    }

    /// Installs it into a folder of its name below this one, unless it is installed there; returns
    /// its folder.
    pub fn install_below(&self, below: &Path) -> PathBuf {
        let folder = below.join(self.name);
        let version = done(self.name, installer(found(&["python3"], "python3")).arg("--version"));
        let what = format!("{} {}\n{version}", self.packages.join(" "), folder.display());
        once(&folder, &what, || {
            let mut make = installer(found(&["python3"], "python3"));
            done(self.name, make.args(["-m", "venv", "--clear"]).arg(&folder));
            let mut pip = installer(folder.join("bin/python"));
            pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
            // A settings file may select the user's own folder.
            done(self.name, pip.env("PIP_USER", "0").args(self.options).args(self.packages));
        });
        folder
    }
}

/// A folder with these Node packages.
#[derive(Debug)]
pub struct NodePackages {
    name: &'static str,
    packages: &'static [&'static str],
    installed: OnceLock<(PathBuf, PathBuf)>,
}

impl NodePackages {
    /// These packages and their dependencies.
    pub const fn new(name: &'static str, packages: &'static [&'static str]) -> Self {
        Self { name, packages, installed: OnceLock::new() }
    }

    /// Node with this folder as working directory, to which a script is passed.
    pub fn node(&self) -> Command {
        let (node, folder) = self.installed.get_or_init(|| (node(), self.install_below(&clients())));
        let mut command = outside(node);
        command.current_dir(folder);
        command
    }

    /// Installs them into a folder of their name below this one, unless they are installed there;
    /// returns their folder.
    pub fn install_below(&self, below: &Path) -> PathBuf {
        let folder = below.join(self.name);
        let what = format!("{} {}", self.packages.join(" "), folder.display());
        once(&folder, &what, || {
            std::fs::create_dir_all(&folder).expect("a folder for packages");
            // Without this file npm would use the nearest folder above that has one.
            std::fs::write(folder.join("package.json"), "{\"private\": true}\n").expect("a file");
            let mut npm = installer(found(&["npm"], "npm"));
            npm.args(["install", "--silent", "--no-fund", "--no-audit", "--ignore-scripts"]);
            // Use neither the user's own folder nor a project that contains this folder.
            npm.args(["--global=false", "--workspaces=false", "--prefix"]).arg(&folder);
            done(self.name, npm.args(self.packages).current_dir(&folder));
        });
        folder
    }
}

/// The path of Node itself: the first `node` on the path may be a script that chooses a version by
/// the user's settings.
fn node() -> PathBuf {
    let mut ask = installer(found(&["node", "nodejs"], "nodejs"));
    PathBuf::from(done("node", ask.args(["-p", "process.execPath"])).trim())
}

/// The folder of all installed packages: `target/clients`.
pub(crate) fn clients() -> PathBuf {
    let test = std::env::current_exe().expect("the path of this test");
    // target/<profile>/deps/<test>
    test.ancestors().nth(3).expect("the target folder").join("clients")
}

/// Runs `install` unless `what` is installed in this folder already. Two programs that need it wait
/// for each other.
fn once(folder: &Path, what: &str, install: impl FnOnce()) {
    std::fs::create_dir_all(folder.parent().expect("a folder in another")).expect("a folder");
    let lock = File::create(folder.with_extension("lock")).expect("a file");
    lock.lock().expect("a lock");
    let note = folder.with_extension("installed");
    if std::fs::read_to_string(&note).is_ok_and(|noted| noted == what) {
        return;
    }
    let _ = std::fs::remove_dir_all(folder);
    install();
    std::fs::write(note, what).expect("a file");
}

/// A program that installs packages. It has the user's environment except for settings that choose
/// where packages go.
fn installer(program: impl AsRef<OsStr>) -> Command {
    let mut command = Command::new(program);
    for (name, _) in std::env::vars_os() {
        if name.to_str().is_none_or(chooses_a_place) {
            command.env_remove(name);
        }
    }
    command
}

fn chooses_a_place(name: &str) -> bool {
    let name = name.to_lowercase();
    let way = |rest: &str| WAYS.contains(&rest) || PROXIES.contains(&rest);
    if let Some(rest) = name.strip_prefix("pip_").or_else(|| name.strip_prefix("npm_config_")) {
        return !way(rest);
    }
    name.starts_with("python") || name == "node_options" || name == "node_path" || name == "virtual_env"
}

/// Runs a command to its end; returns its output.
fn done(name: &str, command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("NOT RUN: {name}: {command:?}: {error}"));
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said).into_owned();
    assert!(output.status.success(), "NOT RUN: {name} cannot be installed here: {command:?}\n{said}");
    said
}
