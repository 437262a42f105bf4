//! Builds the programs under test with the profile of the tests.

use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

/// One of the project's programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Program {
    Ground,
    OnboardSim,
    Replay,
}

/// A command that runs the program. The first call builds all programs.
pub fn program(program: Program) -> Command {
    let name = match program {
        Program::Ground => "ground",
        Program::OnboardSim => "onboard-sim",
        Program::Replay => "replay",
    };
    Command::new(built().join(name))
}

/// The folder with the programs of this build. Cargo gives a test only the paths of its own
/// package's programs, so they are built here, with the profile and into the target folder of the
/// test itself.
fn built() -> &'static PathBuf {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    BUILT.get_or_init(|| {
        let test = std::env::current_exe().expect("the path of this test");
        // target/<profile>/deps/<test>
        let folder = test.ancestors().nth(2).expect("the folder of the profile").to_owned();
        let target = folder.parent().expect("the target folder");
        let mut build = Command::new(env!("CARGO"));
        // Building one test as well makes Cargo choose the same dependency features as `cargo
        // test`, which has built the programs already. Otherwise half of the dependencies would be
        // built again.
        build.current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
        build.args(["build", "--quiet", "--bins", "--test", "igniter"]);
        build.arg("--target-dir").arg(target);
        if !cfg!(debug_assertions) {
            build.arg("--release");
        }
        assert!(build.status().expect("cargo runs").success(), "the programs do not build");
        folder
    })
}
