//! Tests the campaign's command line.

use std::fs;
use std::path::Path;
use std::process::Output;

use crate::command_card::{run, stderr};

fn campaign(directory: &Path, arguments: &[&str]) -> Output {
    run(directory, &[&["campaign"], arguments].concat())
}

#[test]
fn a_file_with_the_name_of_the_lock_is_unchanged() {
    let directory = tempfile::tempdir().unwrap();
    let lock = directory.path().join("lock");
    fs::write(&lock, "notes").unwrap();
    let flown = campaign(directory.path(), &["--flights", "1", "--out", "."]);
    assert_eq!(flown.status.code(), Some(0), "{}", stderr(&flown));
    assert_eq!(fs::read_to_string(lock).unwrap(), "notes");
}

#[test]
fn a_wrong_request_is_refused_with_the_reason() {
    let directory = tempfile::tempdir().unwrap();
    for (arguments, words) in [
        (
            &["--out", "x", "--flights", "0"][..],
            "'--flights <N>': must be a whole number from 1 to 1000000000",
        ),
        (&["--out", "x", "--flights", "-5"], "'-5' for '--flights <N>': must be a whole number from 1 to"),
        (&["--out", "x", "--seed", "abc"], "'abc' for '--seed <SEED>': must be a whole number from 0 to"),
        (&["--out", "x", "--dispersion", "windy"], "neither a built-in set of dispersions"),
        (&["--out", "x", "--mission", "mk9"], "vlr; did you mean `mk2`?) nor a readable file"),
        (&["--out", "x", "--fault", "gnss@5"], "no fault is named"),
        (&["--only", "1", "--jobs", "2"], "cannot be used with"),
        (&[], "--out"),
    ] {
        let refused = campaign(directory.path(), arguments);
        assert!(!refused.status.success() && stderr(&refused).contains(words), "{}", stderr(&refused));
        assert!(!directory.path().join("x").exists(), "{words}");
    }
    let dark = campaign(directory.path(), &["--only", "0", "--fault", "no-light@0"]);
    assert_eq!(dark.status.code(), Some(3), "{dark:?}");
}
