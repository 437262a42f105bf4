//! Python and Node packages in folders of their own.

use std::ffi::OsStr;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use crate::run::{found, outside};

/// Of the settings that pip and npm take from the environment, the ones that say how packages are reached and where they
/// are kept between installations. They stay as the user has them; the others say where packages go, and are dropped.
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
    /// These packages and what they ask for.
    pub const fn with_dependencies(name: &'static str, packages: &'static [&'static str]) -> Self {
        Self { name, packages, options: &[], folder: OnceLock::new() }
    }

    /// These packages alone.
    pub const fn without_dependencies(name: &'static str, packages: &'static [&'static str]) -> Self {
        Self { name, packages, options: &["--no-deps"], folder: OnceLock::new() }
    }

    /// Its interpreter, to be given a script.
    pub fn python(&self) -> Command {
        outside(self.installed().join("bin/python"))
    }

    /// A program that came with a package. It is a script of Python's, whose first line may name another folder.
    pub fn program(&self, name: &str) -> Command {
        let mut command = self.python();
        command.arg(self.installed().join("bin").join(name));
        command
    }

    /// Its folder; the first call installs.
    ///
    /// # Panics
    /// It cannot be installed.
    pub fn installed(&self) -> &Path {
        self.folder.get_or_init(|| self.install_below(&clients()))
    }

    /// Installs it into a folder of its name in this one, unless it is there; returns its folder.
    ///
    /// # Panics
    /// It cannot be installed.
    pub fn install_below(&self, below: &Path) -> PathBuf {
        let folder = below.join(self.name);
        let version = done(self.name, installer(found(&["python3"], "python3")).arg("--version"));
        let what = format!("{} {}\n{version}", self.packages.join(" "), folder.display());
        once(&folder, &what, || {
            let mut make = installer(found(&["python3"], "python3"));
            done(self.name, make.args(["-m", "venv", "--clear"]).arg(&folder));
            let mut pip = installer(folder.join("bin/python"));
            pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
            // A settings file may ask for the user's own folder.
            done(self.name, pip.env("PIP_USER", "0").args(self.options).args(self.packages));
        });
        folder
    }
}

/// A folder with these packages of Node.
#[derive(Debug)]
pub struct NodePackages {
    name: &'static str,
    packages: &'static [&'static str],
    installed: OnceLock<(PathBuf, PathBuf)>,
}

impl NodePackages {
    /// These packages and what they ask for.
    pub const fn new(name: &'static str, packages: &'static [&'static str]) -> Self {
        Self { name, packages, installed: OnceLock::new() }
    }

    /// Node in its folder, to be given a script.
    ///
    /// # Panics
    /// It cannot be installed.
    pub fn node(&self) -> Command {
        let (node, folder) = self.installed.get_or_init(|| (node(), self.install_below(&clients())));
        let mut command = outside(node);
        command.current_dir(folder);
        command
    }

    /// Installs it into a folder of its name in this one, unless it is there; returns its folder.
    ///
    /// # Panics
    /// It cannot be installed.
    pub fn install_below(&self, below: &Path) -> PathBuf {
        let folder = below.join(self.name);
        let what = format!("{} {}", self.packages.join(" "), folder.display());
        once(&folder, &what, || {
            std::fs::create_dir_all(&folder).expect("a folder for packages");
            // Without it, npm would take the nearest folder above that has one.
            std::fs::write(folder.join("package.json"), "{\"private\": true}\n").expect("a file");
            let mut npm = installer(found(&["npm"], "npm"));
            npm.args(["install", "--silent", "--no-fund", "--no-audit", "--ignore-scripts"]);
            // Neither the user's own folder nor a project that this one lies in.
            npm.args(["--global=false", "--workspaces=false", "--prefix"]).arg(&folder);
            done(self.name, npm.args(self.packages).current_dir(&folder));
        });
        folder
    }
}

/// Node itself: what is found first may be a script that chooses a version by the user's settings.
fn node() -> PathBuf {
    let mut ask = installer(found(&["node", "nodejs"], "nodejs"));
    PathBuf::from(done("node", ask.args(["-p", "process.execPath"])).trim())
}

/// Where everything is installed: `target/clients`.
pub(crate) fn clients() -> PathBuf {
    let test = std::env::current_exe().expect("the path of this test");
    // target/<profile>/deps/<test>
    test.ancestors().nth(3).expect("the target folder").join("clients")
}

/// Runs `install` unless `what` is in this folder already. Two programs that want it wait for each other.
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

/// A program that installs: as the user calls it, but that packages go where we say.
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

/// Runs it to its end; returns what it said.
fn done(name: &str, command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("NOT RUN: {name}: {command:?}: {error}"));
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said).into_owned();
    assert!(output.status.success(), "NOT RUN: {name} cannot be installed here: {command:?}\n{said}");
    said
}
