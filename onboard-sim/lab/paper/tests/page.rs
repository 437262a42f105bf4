//! What docs/paper.md names exists: the commands of `paper`, tests and paths.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..")
}

/// What the page has in backticks.
fn named() -> Vec<String> {
    let page = fs::read_to_string(root().join("docs/paper.md")).unwrap();
    page.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// With `--help` at its end a command is read to its end, but not run. The pages' own tests read
/// those of `onboard-sim`.
#[test]
fn every_command_of_the_page_is_understood() {
    let is_ours = |text: &str| text.split(' ').next() == Some("paper") && !text.contains('…');
    let commands: Vec<String> = named().into_iter().filter(|text| is_ours(text)).collect();
    assert!(commands.len() > 15, "{commands:?}");
    for command in commands {
        let words = command.split_whitespace().skip(1);
        let output = Command::new(env!("CARGO_BIN_EXE_paper")).args(words).arg("--help").output().unwrap();
        assert!(output.status.success(), "{command}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn every_test_and_path_of_the_page_exists() {
    let mut sources = String::new();
    read_sources(&root().join("onboard-sim"), &mut sources);
    let tests: Vec<String> = named().into_iter().filter(|text| is_test(text)).collect();
    assert!(tests.len() > 30, "{tests:?}");
    for test in tests {
        assert!(sources.contains(&format!("fn {test}(")), "no test is named {test}");
    }
    for path in named().into_iter().filter(|text| text.starts_with("onboard-sim/")) {
        assert!(root().join(&path).exists(), "{path}");
    }
}

/// A name of several words, as tests have.
fn is_test(text: &str) -> bool {
    text.matches('_').count() > 2 && text.chars().all(|c| c == '_' || c.is_ascii_alphanumeric())
}

fn read_sources(folder: &Path, sources: &mut String) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            read_sources(&path, sources);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            sources.push_str(&fs::read_to_string(&path).unwrap());
        }
    }
}
