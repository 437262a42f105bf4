//! The help of the commands that answer questions about the vehicle, as snapshots. `INSTA_UPDATE=always` records new ones.

use std::process::Command;

use crate::command_line::run;

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
