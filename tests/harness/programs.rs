//! The programs under test, built as the tests are.

use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

/// One of the project's programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Program {
    /// `ground`
    Ground,
    /// `onboard-sim`
    OnboardSim,
    /// `replay`
    Replay,
}

/// A command that runs the program; the first call builds all of them.
///
/// # Panics
/// They do not build.
pub fn program(program: Program) -> Command {
    let name = match program {
        Program::Ground => "ground",
        Program::OnboardSim => "onboard-sim",
        Program::Replay => "replay",
    };
    Command::new(built().join(name))
}

/// The folder with this build's programs. Cargo gives a test the paths of its own package's programs only, so
/// they are built here, with the profile and into the target folder that the test itself was built with.
fn built() -> &'static PathBuf {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    BUILT.get_or_init(|| {
        let test = std::env::current_exe().expect("the path of this test");
        // target/<profile>/deps/<test>
        let folder = test.ancestors().nth(2).expect("the folder of the profile").to_owned();
        let target = folder.parent().expect("the target folder");
        let mut build = Command::new(env!("CARGO"));
        // With any one test among them, the programs are those that `cargo test` has built already. Without, their
        // dependencies would lack what the tests' own dependencies want of them, and half of all would be built anew.
        build.current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
        build.args(["build", "--quiet", "--bins", "--test", "outside_clients"]);
        build.arg("--target-dir").arg(target);
        if !cfg!(debug_assertions) {
            build.arg("--release");
        }
        assert!(build.status().expect("cargo runs").success(), "the programs do not build");
        folder
    })
}
