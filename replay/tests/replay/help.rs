//! The help of the commands that answer questions about the vehicle, as snapshots.
//! `INSTA_UPDATE=always` records new ones.

use std::process::Command;

use crate::command_line::run;

/// The options of every day fit a terminal of 24 lines of 80 columns; `--help` has the rest.
#[test]
fn the_short_help_of_refly_fits_a_screen() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_replay"));
    let (code, stdout, _) = run(command.args(["refly", "-h"]).env("COLUMNS", "80"));
    assert_eq!(code, 0);
    assert!(stdout.lines().count() <= 24, "{stdout}");
    assert!(stdout.lines().all(|line| line.chars().count() <= 80), "{stdout}");
    insta::assert_snapshot!("help_refly", stdout);
}

#[test]
fn the_help_of_fit() {
    for question in ["fit"] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_replay"));
        // Lines are as long as in a terminal of this width.
        let (code, stdout, _) = run(command.args([question, "--help"]).env("COLUMNS", "100"));
        assert_eq!(code, 0);
        insta::assert_snapshot!(format!("help_{question}"), stdout);
    }
}
