//! The commands of the pages run as they stand: each line of a page's blocks, one after the other,
//! in one folder, as somebody pastes them; and what it says is what the page says.
//! [`crate::first_flight`], [`crate::launch_day`] and [`crate::crew`] run the pages whose programs
//! wait for each other and for keys.

use std::path::{Path, PathBuf};
use std::process::Command;

use e2e::{Program, Running, program};

use crate::pages::page;

/// The pages, from the root of the workspace.
const PAGES: [&str; 10] = [
    "README.md",
    "docs/safety.md",
    "docs/engineer.md",
    "docs/build-mk3.md",
    "CONTRIBUTING.md",
    "ground/README.md",
    "ground/packaging/README.md",
    "onboard-sim/lab/cortex-m7/README.md",
    "onboard-sim/lab/peers/README.md",
    "tests/README.md",
];

/// Lines that do not run here: their page, how they begin, and why.
const ELSEWHERE: [(&str, &str, &str); 28] = [
    ("README.md", "cargo run ", "compiles; tests/demo.rs flies the same demonstration"),
    ("README.md", "cargo test", "is this test among all others"),
    ("docs/engineer.md", "npm ", "installs from the network"),
    ("docs/engineer.md", "onboard-sim check mk2 --from node_modules", "needs what npm installs"),
    ("docs/engineer.md", "pip ", "installs from the network"),
    ("docs/engineer.md", "python3 ", "needs what pip installs; tests/clients/tests/log_readers.rs runs it"),
    ("docs/engineer.md", "ground ", "tests/demo.rs flies it"),
    (
        "docs/engineer.md",
        "onboard-sim fly --mavlink udpout:192.168.1.20:14550",
        "waits for a station, as on docs/crew.md",
    ),
    (
        "docs/engineer.md",
        "cargo install --path replay/rerun-export",
        "compiles for ten minutes; .ci/run exports a log to Rerun",
    ),
    ("docs/engineer.md", "replay-rerun ", "needs the line above"),
    ("docs/engineer.md", "rerun ", "opens a window"),
    (
        "docs/engineer.md",
        "replay import ",
        "needs logs of other programs; replay/tests/replay/import.rs makes some",
    ),
    ("docs/engineer.md", "lichtblick ", "opens a window"),
    (
        "docs/build-mk3.md",
        "onboard-sim campaign ",
        "flies for minutes; docs/engineer.md has shorter campaigns",
    ),
    ("CONTRIBUTING.md", "cargo run ", "compiles; tests/demo.rs flies it"),
    ("CONTRIBUTING.md", "cargo test", "is or holds this test"),
    ("CONTRIBUTING.md", "cargo clippy", "compiles everything; .ci/run runs it"),
    ("CONTRIBUTING.md", "cargo fmt", "looks at sources that may be half written; .ci/run runs it"),
    ("ground/README.md", "cargo test", "is a test"),
    ("ground/README.md", "cargo bench", "measures an idle machine"),
    ("ground/packaging/README.md", "cargo install", "compiles for minutes and installs"),
    ("ground/packaging/README.md", "systemctl", "needs a session of systemd"),
    ("ground/packaging/README.md", "ground attach", "tests/first_flight.rs runs it"),
    ("ground/packaging/README.md", "ground stop", "tests/first_flight.rs runs it"),
    ("ground/packaging/README.md", "ground/packaging/build", "needs containers of Debian for two processors"),
    (
        "onboard-sim/lab/cortex-m7/README.md",
        "onboard-sim/lab/cortex-m7/emulate",
        "needs QEMU and cross compilers",
    ),
    ("onboard-sim/lab/peers/README.md", "onboard-sim/lab/peers/run", "installs peers"),
    ("tests/README.md", "cargo bench", "lasts two hours"),
];

/// What the pages say that a line answers: how the line begins, and words of its answer.
const COMMANDS: [(&str, &str); 21] = [
    ("onboard-sim fly --start pad --fault abort@descent", "ABORTED, then DOWN UNDER THE PARACHUTE"),
    ("onboard-sim fly --start pad --fault separation-fails@0", "DOWN UNDER THE PARACHUTE"),
    ("onboard-sim campaign --only 17", "touchdown_vertical_m_s"),
    (
        "onboard-sim playback onboard-sim/tests/recorded/hedy.csv.zst",
        "REFUSES 10 of 10 s  no GNSS fix for 19.0 s",
    ),
    ("replay verify hedy.mcap", "11439 of 11439 frames identical"),
    ("replay info flight.mcap", "verdict"),
    ("replay verify flight.mcap ", "frames identical"),
    ("replay verify flight.mcap --explain", "identical bit for bit"),
    ("replay recover cut.mcap", "whole.mcap"),
    ("replay refly flight.mcap --without-fault gnss-out", "flown again"),
    ("replay compare flight.mcap without.mcap", "without.mcap"),
    ("replay export flight.mcap --out flight.kml", "touchdown planned at ignition"),
    ("replay export flight.mcap --out tables", "tables"),
    ("replay fit flight.mcap ", "drag"),
    ("replay fit fits.json --mission mk3 --flights", "GO"),
    ("replay compare logs again", "shows no difference"),
    ("onboard-sim check mk2 ", "flights stand"),
    ("onboard-sim new drawn", "`onboard-sim check drawn.toml` says whether it will land"),
    ("onboard-sim check drawn.toml", "drawn: 1.900 kg on G33"),
    ("replay fit drawn/first.mcap --out drawn.toml", "drawn.toml"),
    ("onboard-sim card --mission drawn.toml", "drawn-card/card.html"),
];

/// The lines of a page's blocks that hold commands, without the languages of other programs.
pub(crate) fn lines_of_commands(page: &str) -> Vec<&str> {
    let mut found = Vec::new();
    let mut lines = page.lines();
    while let Some(line) = lines.by_ref().find(|line| line.starts_with("```")) {
        let block: Vec<&str> = lines.by_ref().take_while(|line| !line.starts_with("```")).collect();
        if line == "```" {
            found.extend(block.into_iter().filter(|line| !line.is_empty() && !line.starts_with('#')));
        }
    }
    found
}

fn is_elsewhere(page: &str, line: &str) -> bool {
    ELSEWHERE.iter().any(|(of, begin, _)| *of == page && line.starts_with(begin))
}

/// Whether a program has answered with this code: a flight may end outside its limits, and the
/// answer may be no.
fn has_answered(line: &str, code: Option<i32>) -> bool {
    let flies =
        ["onboard-sim fly", "onboard-sim campaign --only"].iter().any(|begin| line.starts_with(begin));
    match code {
        Some(0) => true,
        Some(3) => flies || line.starts_with("replay "),
        Some(4) => flies,
        _ => false,
    }
}

pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A line for a user's shell in the folder, with our programs in its path.
pub(crate) fn in_shell(folder: &Path, line: &str) -> Command {
    let ours = Path::new(program(Program::Replay).get_program()).parent().expect("a folder").to_owned();
    let theirs = std::env::var_os("PATH").unwrap_or_default();
    let path =
        std::env::join_paths([ours].into_iter().chain(std::env::split_paths(&theirs))).expect("a path");
    let mut shell = Command::new("bash");
    shell.args(["-c", line]).env("PATH", &path).env("HOME", folder).env_remove("RUST_BACKTRACE");
    shell.current_dir(folder);
    shell
}

/// Runs a line; says what was wrong.
fn run_line(folder: &Path, line: &str) -> Option<String> {
    let ended = Running::to_end(&mut in_shell(folder, line));
    // The longest beginning is this line's.
    let found = COMMANDS.iter().filter(|(begin, _)| format!("{line} ").starts_with(begin));
    let found = found.max_by_key(|(begin, _)| begin.len());
    let missing = found.filter(|(_, words)| !ended.output.contains(words));
    (!has_answered(line, ended.code) || missing.is_some())
        .then(|| format!("{line}\ncode {:?}, does not say {missing:?}\n{}", ended.code, ended.output))
}

/// Runs a page in a folder of its own; returns how many lines ran, and what was wrong with some.
fn run_page(name: &str) -> (usize, Vec<String>) {
    let folder = tempfile::tempdir().expect("a folder");
    // The page names examples as they lie in a clone.
    for room in ["replay", "onboard-sim"] {
        std::os::unix::fs::symlink(root().join(room), folder.path().join(room)).expect("a link");
    }
    let text = page(name);
    let lines: Vec<&str> =
        lines_of_commands(&text).into_iter().filter(|line| !is_elsewhere(name, line)).collect();
    (lines.len(), lines.iter().filter_map(|line| run_line(folder.path(), line)).collect())
}

#[test]
fn the_engineers_page_runs_as_it_stands() {
    let (run, wrong) = run_page("docs/engineer.md");
    assert!(run > 40, "only {run} lines were run");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_other_pages_run_as_they_stand() {
    for name in PAGES.iter().filter(|name| **name != "docs/engineer.md") {
        let (_, wrong) = run_page(name);
        assert!(wrong.is_empty(), "{name}: {}", wrong.join("\n"));
    }
}

/// A line that a page no longer has needs no exception, and no answer.
#[test]
fn every_exception_and_every_answer_is_of_a_line_of_its_page() {
    let of_page = |name: &str, begin: &str| {
        lines_of_commands(&page(name)).iter().any(|line| format!("{line} ").starts_with(begin))
    };
    let gone: Vec<_> = ELSEWHERE.iter().filter(|(name, begin, _)| !of_page(name, begin)).collect();
    assert!(gone.is_empty(), "not on its page: {gone:?}");
    let missing: Vec<_> =
        COMMANDS.iter().filter(|(begin, _)| !PAGES.iter().any(|name| of_page(name, begin))).collect();
    assert!(missing.is_empty(), "on no page: {missing:?}");
}
