//! Runs every command of docs/first-flight.md as printed and in its order, over a simulated pair of
//! radios.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use e2e::{Program, Running, SerialLine, Signal, Terminal, program};

use crate::pages::{commands_of, lines_of_code, page};

const RADIO: &str = "serial:/dev/ttyUSB0:57600";
const SIZE: (u16, u16) = (80, 24);

/// The commands of the page, each at its end of the radio.
fn commands(folder: &Path, radio: &SerialLine) -> Vec<Command> {
    let of_the_page = lines_of_code(&page("docs/first-flight.md"));
    let commands = of_the_page.iter().flat_map(|line| commands_of(line));
    let as_a_process = |(which, words): (Program, Vec<String>)| {
        let end = if which == Program::Ground { radio.far_link() } else { radio.near_link() };
        let mut command = program(which);
        command.args(words.into_iter().map(|word| if word == RADIO { end.clone() } else { word }));
        command.current_dir(folder).env("XDG_RUNTIME_DIR", folder).env("XDG_CONFIG_HOME", folder);
        command
    };
    commands.map(as_a_process).collect()
}

/// Ten seconds, and what a busy machine adds.
const COUNTDOWN: Duration = Duration::from_secs(20);

#[test]
fn a_first_flight_follows_its_page() {
    let folder = tempfile::tempdir().unwrap();
    let radio = SerialLine::new(57_600);
    let mut commands = commands(folder.path(), &radio);
    let [keygen, fly, daemon, attach, stop, verify, report, prove] = &mut commands[..] else {
        panic!("other commands on the page: {commands:?}");
    };
    let made = Running::to_end(keygen);
    assert_eq!(made.code, Some(0), "{}", made.output);
    let vehicle = Running::start(fly);
    let mut station = Running::start(daemon);
    let log = station.wait_for_line("log: ");
    assert!(log.contains(&format!("{}", folder.path().join("ground.mcap").display())), "{log}");
    station.wait_for_line("type next: ground attach");
    let mut screen = Terminal::start(attach.env("TERM", "xterm-256color"), SIZE, false);
    screen.wait_for("every arming check passes");
    screen.arm_and_start(COUNTDOWN, "STANDS UNDAMAGED, inside");
    screen.wait_for("STANDS UNDAMAGED, inside");
    screen.wait_for("STANDS UNDAMAGED; may be approached");
    // The station ends first, so that the vehicle's log confirms all of its book.
    let stopped = Running::to_end(stop);
    assert_eq!(stopped.code, Some(0), "{}", stopped.output);
    assert_eq!(station.wait().code, Some(0));
    vehicle.signal(Signal::SIGINT);
    let flown = vehicle.wait();
    assert_eq!(flown.code, Some(0), "{}", flown.output);
    let verified = Running::to_end(verify);
    assert!(verified.code == Some(0) && verified.output.contains("frames identical"), "{}", verified.output);
    for looked in [report, prove] {
        let ended = Running::to_end(looked);
        assert_eq!(ended.code, Some(0), "{}", ended.output);
    }
}
