//! A flight of the complete chain with an emulated Cortex-M7, controlled from the ordinary screen:
//! arming, start and landing; and an abort in the descent.
//!
//! It types into `onboard-sim/lab/cortex-m7/emulate chain`, the command that a person uses. It is
//! not part of `cargo test`: it requires QEMU, the programs of `emulate build` and some minutes of
//! real time. Without them it prints NOT RUN and the reason.
//!
//! `cargo bench -p board --bench chain` in `onboard-sim/lab`, or `onboard-sim/lab/cortex-m7/emulate
//! test`.

use std::io::Write as _;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use e2e::{Terminal, Window};
use ground::exit::Exit;

type Failure = Box<dyn std::error::Error + Send + Sync>;

const SIZE: (u16, u16) = (100, 40);
/// A flight of mk2 takes a minute and a half, after up to half a minute on the pad, and its motor
/// remains hot for another minute and a half. A machine without a free processor core takes several
/// times as long.
const FLIGHT_LIMIT: Duration = Duration::from_mins(10);
/// Longest time from a key to its answer.
const ANSWERS_WITHIN: Duration = Duration::from_secs(5);

/// Exit status of `emulate ready` if a program that `emulate chain` needs is missing.
const NOT_HERE: i32 = 2;

fn main() -> Result<(), Failure> {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../.."));
    let ready = emulate(root, &["ready"]).output()?;
    if ready.status.code() == Some(NOT_HERE) {
        let why = String::from_utf8_lossy(&ready.stderr);
        return print_line(&format!("NOT RUN: {}", why.trim()));
    }
    if !ready.status.success() {
        return Err(String::from_utf8_lossy(&ready.stderr).into());
    }
    land(root)?;
    abort(root)
}

fn emulate(root: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(root.join("onboard-sim/lab/cortex-m7/emulate"));
    command.args(arguments).current_dir(root);
    command
}

/// Arms and starts a flight by keys.
fn started(root: &Path) -> Terminal {
    let settings = root.join("target/board/chain-settings");
    let mut chain = emulate(root, &["chain"]);
    chain.env("XDG_RUNTIME_DIR", &settings).env("XDG_CONFIG_HOME", &settings);
    let mut terminal = Terminal::start(&chain, SIZE, false);
    terminal.wait_for("every arming check passes");
    terminal.type_until(b"AARM\r", " ARMED ");
    terminal.type_until(b"SSTART\r", "START  commanded");
    terminal
}

fn land(root: &Path) -> Result<(), Failure> {
    let mut terminal = started(root);
    let shown = ["BOOST", "AERO_DESCENT", "POWERED", "TOUCHDOWN"];
    for phase in shown {
        wait(&terminal, phase)?;
    }
    // The image for a chip sends no verdict on its landing.
    let report = end(&mut terminal, Exit::NotSeen)?;
    expect(&report, "LANDED")?;
    print_line("armed, started and landed from the screen:")?;
    print_line(&report)
}

/// An abort with room for the parachute opens it and inhibits the landing motor.
fn abort(root: &Path) -> Result<(), Failure> {
    let mut terminal = started(root);
    wait(&terminal, "AERO_DESCENT")?;
    terminal.type_bytes(b"\x18\r");
    let seen = |window: &Window| {
        window
            .row_with(" ABORT  commanded ")
            .filter(|facts| facts.contains("acknowledged accepted  observed yes"))
    };
    terminal.wait_within(FLIGHT_LIMIT, seen).ok_or_else(|| missing(&terminal, "an abort that was seen"))?;
    wait(&terminal, " CHUTE ")?;
    wait(&terminal, "TOUCHDOWN")?;
    let report = end(&mut terminal, Exit::RefusedOrAborted)?;
    expect(&report, "ABORTED")?;
    print_line("aborted in the descent, down under the parachute:")?;
    print_line(&report)
}

fn wait(terminal: &Terminal, words: &str) -> Result<(), Failure> {
    let shown = terminal.wait_within(FLIGHT_LIMIT, |window| window.shows(words).then_some(()));
    shown.ok_or_else(|| missing(terminal, words).into())
}

fn missing(terminal: &Terminal, what: &str) -> String {
    format!("no {what} on:\n{}", terminal.window().rows().join("\n"))
}

/// Ends the screen, and with it the chain; returns the output of the script. A station quits at one
/// key only after its vehicle has reported that it is disarmed.
fn end(terminal: &mut Terminal, expected: Exit) -> Result<String, Failure> {
    wait(terminal, "disarmed")?;
    let before = terminal.window().bytes().len();
    terminal.type_bytes(b"q");
    // While people must keep away the station continues without its screen, and Ctrl-C ends it.
    let asks = |window: &Window| window.shows("QUIT too early").then_some(());
    if terminal.wait_within(ANSWERS_WITHIN, asks).is_some() {
        terminal.type_by_hand(b"quit\r");
        wait(terminal, "so the station continues")?;
        terminal.type_bytes(b"\x03");
    }
    let code = terminal.wait_for_end();
    let window = terminal.window();
    let report = String::from_utf8_lossy(&window.bytes()[before..]).into_owned();
    if code == Some(expected as i32) {
        Ok(report)
    } else {
        Err(format!("ended with {code:?}:\n{report}").into())
    }
}

fn expect(report: &str, words: &str) -> Result<(), Failure> {
    if report.contains(words) { Ok(()) } else { Err(format!("no {words} in:\n{report}").into()) }
}

fn print_line(line: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{line}")?;
    Ok(out.flush()?)
}
