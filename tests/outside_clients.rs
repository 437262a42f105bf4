//! Tests with other people's programs are a separate step: `cargo test` needs and installs none of
//! them.

use std::io::Write as _;
use std::path::Path;

const STEP: &str = "cargo test -p clients";

fn read(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn tests_with_other_programs_are_a_separate_step_that_is_documented_and_required() {
    let workspace = read("Cargo.toml");
    let (_, default) = workspace.split_once("default-members = [").expect("default members");
    let (default, _) = default.split_once(']').expect("a list");
    let members: Vec<&str> = default.split('"').skip(1).step_by(2).collect();
    assert!(members.contains(&"tests") && !members.contains(&"tests/clients"), "{members:?}");
    for member in members {
        let manifest = read(&format!("{member}/Cargo.toml"));
        assert!(!manifest.lines().any(|line| line.starts_with("clients ")), "{member} installs clients");
    }
    assert!(read("README.md").contains(STEP), "the README does not name the step");
    assert!(read(".ci/run").lines().any(|line| line == format!("step {STEP}")), "the step is not required");
    // This bypasses the test's captured output, so that this run is not mistaken for those tests.
    // If it fails, there is nothing else to do.
    let _ = writeln!(std::io::stderr(), "NOT RUN: other people's programs against ours; `{STEP}` runs them");
}
