//! Tests that the user's settings for Python, pip, Node and npm change neither where packages are
//! installed nor what a program sees.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use std::path::{Path, PathBuf};
use std::process::Command;

use clients::{NodePackages, PythonPackages, found, outside};

/// When this variable is set, this test program installs into the folder that it names.
const INSTALLS_HERE: &str = "TOUCHDOWN_INSTALLS_HERE";

static PYSERIAL: PythonPackages = PythonPackages::without_dependencies("pyserial", &["pyserial==3.5"]);
static REACT: NodePackages = NodePackages::new("react", &["react@17.0.2"]);

fn output_of(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let words = [output.stdout, output.stderr].concat();
    let words = String::from_utf8_lossy(&words).trim().to_owned();
    assert!(output.status.success(), "{command:?}: {words}");
    words
}

#[test]
fn a_users_settings_of_python_and_node_have_no_effect() {
    if let Some(folder) = std::env::var_os(INSTALLS_HERE) {
        return install_and_look(Path::new(&folder));
    }
    // A project with other packages of the same names, which claims every folder below it.
    let project = tempfile::tempdir().unwrap();
    let at = |name: &str| project.path().join(name);
    std::fs::create_dir_all(at("node_modules/react")).unwrap();
    std::fs::write(at("node_modules/react/index.js"), "throw new Error('another react')").unwrap();
    std::fs::write(at("package.json"), "{\"private\": true, \"workspaces\": [\"*\", \"*/*\"]}").unwrap();
    std::fs::create_dir(at("python")).unwrap();
    for module in ["pip", "venv", "serial", "sitecustomize"] {
        let other = format!("raise SystemExit('another {module}')\n");
        std::fs::write(at("python").join(module).with_extension("py"), other).unwrap();
    }
    let mut again = Command::new(std::env::current_exe().unwrap());
    again.args(["--exact", "a_users_settings_of_python_and_node_have_no_effect"]);
    again.env(INSTALLS_HERE, at("target")).current_dir(project.path());
    for (name, value) in [
        ("PYTHONPATH", at("python")),
        ("PYTHONHOME", at("python")),
        ("VIRTUAL_ENV", at("python")),
        ("PIP_USER", PathBuf::from("1")),
        ("PIP_TARGET", at("elsewhere")),
        ("PIP_PREFIX", at("elsewhere")),
        ("PIP_DRY_RUN", PathBuf::from("1")),
        ("NODE_PATH", at("node_modules")),
        ("NODE_OPTIONS", PathBuf::from("--require=/nonexistent.js")),
        ("npm_config_global", PathBuf::from("true")),
        ("npm_config_prefix", at("elsewhere")),
        ("npm_config_local_prefix", at("elsewhere")),
        ("npm_config_dry_run", PathBuf::from("true")),
    ] {
        again.env(name, value);
    }
    assert!(output_of(&mut again).contains("1 passed"));
    assert!(!at("elsewhere").exists());
}

fn install_and_look(folder: &Path) {
    let python = PYSERIAL.install_below(folder).join("bin/python");
    let serial = output_of(outside(python).args(["-c", "import serial; print(serial.__file__)"]));
    assert!(Path::new(&serial).starts_with(folder), "{serial}");
    let react = REACT.install_below(folder);
    let mut node = outside(found(&["node", "nodejs"], "nodejs"));
    let react = output_of(node.args(["-p", "require.resolve('react')"]).current_dir(react));
    assert!(Path::new(&react).starts_with(folder), "{react}");
    let seen = output_of(&mut outside("env"));
    let names: Vec<&str> =
        seen.lines().filter_map(|line| line.split_once('=')).map(|(name, _)| name).collect();
    let ours = ["PATH", "TMPDIR", "HOME", "LANG", "PYTHONUNBUFFERED", "PYTHONDONTWRITEBYTECODE"];
    let home = seen.lines().find_map(|line| line.strip_prefix("HOME=")).unwrap();
    assert!(Path::new(home).is_dir() && Some(Path::new(home)) != std::env::home_dir().as_deref(), "{home}");
    assert!(!names.is_empty() && names.iter().all(|name| ours.contains(name)), "{names:?}");
}

#[test]
#[should_panic(
    expected = "NOT RUN: there is no such-program-is-nowhere here (Debian: apt-get install such-package)"
)]
fn a_missing_program_fails_its_test_and_names_what_to_install() {
    found(&["such-program-is-nowhere"], "such-package");
}
