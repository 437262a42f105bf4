//! The control engineer's page runs as it stands: its blocks, one after the other, in one folder, as somebody pastes them.

use std::fs;
use std::path::Path;
use std::process::Command;

use e2e::{Program, Running, program};

/// Lines that this machine cannot run, by how they begin, and why.
const ELSEWHERE: [(&str, &str); 10] = [
    ("sbatch ", "needs a Slurm cluster; tests/clients/tests/cluster.rs runs it"),
    ("parallel ", "needs GNU parallel; tests/clients/tests/cluster.rs runs it"),
    ("onboard-sim campaign merge part-*", "needs the parts of both lines above"),
    ("npm ", "installs from the network"),
    ("onboard-sim motors --mission mini-f10 --from node_modules", "needs what npm installs"),
    ("pip ", "installs from the network"),
    ("python3 ", "needs what pip installs; tests/clients/tests/log_readers.rs runs it"),
    ("ground ", "waits for the crew at a terminal"),
    (
        "onboard-sim fly --profile mk2 --mavlink udpout:192.168.1.20:14550",
        "waits for a station at another machine",
    ),
    (
        "cargo run --release -p replay-rerun",
        "compiles for ten minutes, and `replay-rerun` after it needs that",
    ),
];
/// Lines that take minutes: they run in the test that runs everything.
const LONG: [&str; 8] = [
    "onboard-sim campaign --profile",
    "onboard-sim campaign --flights 1000",
    "onboard-sim campaign map",
    "onboard-sim hazard",
    "onboard-sim motors",
    "onboard-sim card",
    "onboard-sim fly --profile mk2 --wind 5",
    "replay fit fits.json --mission mk2 --flights 1000",
];

/// The blocks of a page that hold commands, without the languages of other programs.
fn blocks(page: &str) -> Vec<Vec<&str>> {
    let mut blocks = Vec::new();
    let mut lines = page.lines();
    while let Some(line) = lines.by_ref().find(|line| line.starts_with("```")) {
        let block: Vec<&str> = lines.by_ref().take_while(|line| !line.starts_with("```")).collect();
        if line == "```" {
            blocks.push(block);
        }
    }
    blocks
}

/// Whether a program has answered with this code: a flight may end outside its limits, and the answer may be no.
fn has_answered(command: &str, code: &str) -> bool {
    let flies =
        ["onboard-sim fly", "onboard-sim campaign --only"].iter().any(|begin| command.starts_with(begin));
    let asks = command.starts_with("replay ");
    (flies && ["3", "4"].contains(&code)) || (asks && code == "1")
}

/// Runs the blocks of the page in a folder and returns the lines that failed, with what was said.
fn run_page(folder: &Path, runs: impl Fn(&str) -> bool) -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let page = fs::read_to_string(root.join("ENGINEER.md")).expect("the page");
    // The page names examples as they lie in a clone.
    std::os::unix::fs::symlink(root.join("replay"), folder.join("replay")).expect("a link");
    let ours = Path::new(program(Program::Replay).get_program()).parent().expect("a folder").to_owned();
    let theirs = std::env::var_os("PATH").unwrap_or_default();
    let path =
        std::env::join_paths([ours].into_iter().chain(std::env::split_paths(&theirs))).expect("a path");
    let (mut failed, mut run) = (Vec::new(), 0);
    for block in blocks(&page) {
        let kept: Vec<&str> = block.into_iter().filter(|line| runs(line)).collect();
        run += kept.len();
        // A shell goes on behind a command that fails; this one tells which it was.
        let script = format!("trap 'echo \"$?:$BASH_COMMAND\" >> failed' ERR\n{}\n", kept.join("\n"));
        let mut shell = Command::new("bash");
        shell.args(["-c", &script]).env("PATH", &path).env_remove("RUST_BACKTRACE").current_dir(folder);
        let ended = Running::to_end(&mut shell);
        let told = fs::read_to_string(folder.join("failed")).unwrap_or_default();
        let no_answer: Vec<&str> = told
            .lines()
            .filter(|line| line.split_once(':').is_some_and(|(code, command)| !has_answered(command, code)))
            .collect();
        if !no_answer.is_empty() {
            failed.push(format!("{no_answer:?}\n{}", ended.output));
        }
        let _ = fs::remove_file(folder.join("failed"));
    }
    assert!(run > 25, "only {run} lines were run");
    failed
}

fn is_elsewhere(line: &str) -> bool {
    let begins = |(begin, _): &(&str, &str)| line.starts_with(begin);
    ELSEWHERE.iter().any(begins) || line.starts_with("replay-rerun")
}

#[test]
fn the_engineers_page_runs_as_it_stands() {
    let folder = tempfile::tempdir().unwrap();
    let long = |line: &str| LONG.iter().any(|begin| line.starts_with(begin));
    let failed = run_page(folder.path(), |line| !is_elsewhere(line) && !long(line));
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
#[ignore = "takes half an hour; the other test runs all but the long commands"]
fn the_engineers_page_runs_as_it_stands_with_its_long_commands() {
    let folder = tempfile::tempdir().unwrap();
    let failed = run_page(folder.path(), |line| !is_elsewhere(line));
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

/// A line that the page no longer has needs no exception.
#[test]
fn every_exception_is_a_line_of_the_page() {
    let page =
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../ENGINEER.md")).expect("the page");
    let lines: Vec<&str> = blocks(&page).into_iter().flatten().collect();
    let exceptions = ELSEWHERE.iter().map(|(begin, _)| begin).chain(&LONG);
    let gone: Vec<&&str> =
        exceptions.filter(|begin| !lines.iter().any(|line| line.starts_with(**begin))).collect();
    assert!(gone.is_empty(), "not on the page: {gone:?}");
}
