//! Runs every command of docs/launch-day.md as printed and in its order, each with its answer.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use e2e::{Running, Signal, Terminal, unshared_address};

use crate::pages::page;
use crate::pages_run::{in_shell, lines_of_commands, root};

const PAGE: &str = "docs/launch-day.md";
const SIZE: (u16, u16) = (120, 40);
/// The countdown of mk3, and what a busy machine adds.
const COUNTDOWN: Duration = Duration::from_mins(1);

/// What the lines of the page that end by themselves answer: how they begin, and words.
const ANSWERS: [(&str, &str); 11] = [
    ("cp onboard-sim/flight/vehicles", ""),
    ("cp docs/examples/mk3-field.geojson", ""),
    ("sed -i", ""),
    ("cp onboard-sim/tests/onboard/soundings", ""),
    ("onboard-sim check", "crowd line at 277 m"),
    ("onboard-sim card", "card/card.html"),
    ("replay verify vehicle.mcap", "frames identical"),
    ("replay report", ".html"),
    ("replay export", "flight.kml"),
    ("replay verify --book", "PROVEN"),
    ("ground --replay", "STANDS UNDAMAGED"),
];

/// The lines of the page that run as others do, with the addresses of this test.
struct Day<'a> {
    folder: &'a Path,
    lines: Vec<String>,
}

impl<'a> Day<'a> {
    fn new(folder: &'a Path) -> Self {
        let [link, position] = [unshared_address(), unshared_address()];
        let udp = |address: std::net::SocketAddr| format!("/dev/udp/{}/{}", address.ip(), address.port());
        let here = |line: &str| {
            line.replace("127.0.0.1:14550", &link.to_string())
                .replace("127.0.0.1:10110", &position.to_string())
                .replace("/dev/udp/127.0.0.1/10110", &udp(position))
        };
        let text = page(PAGE);
        Self { folder, lines: lines_of_commands(&text).into_iter().map(here).collect() }
    }

    /// The only line that begins so.
    fn command(&mut self, begins: &str) -> Command {
        let place = self.lines.iter().position(|line| line.starts_with(begins));
        let line = self.lines.remove(place.unwrap_or_else(|| panic!("no line `{begins}` on the page")));
        let mut command = in_shell(self.folder, &line);
        command.env("XDG_RUNTIME_DIR", self.folder).env("XDG_CONFIG_HOME", self.folder);
        command
    }

    /// Runs the lines up to one that begins so.
    fn run_up_to(&mut self, begins: &str) {
        while let Some(line) = self.lines.first().filter(|line| !line.starts_with(begins)).cloned() {
            let (_, answer) = ANSWERS.iter().find(|(begin, _)| line.starts_with(begin)).expect("an answer");
            let ended = Running::to_end(&mut self.command(&line));
            let is_right = ended.code == Some(0) && ended.output.contains(answer);
            assert!(is_right, "{line}\ncode {:?}, `{answer}` in\n{}", ended.code, ended.output);
        }
    }
}

#[test]
fn a_launch_day_follows_its_page() {
    let folder = tempfile::tempdir().unwrap();
    for room in ["docs", "onboard-sim"] {
        std::os::unix::fs::symlink(root().join(room), folder.path().join(room)).unwrap();
    }
    let mut day = Day::new(folder.path());
    day.run_up_to("onboard-sim fly");
    let vehicle = Running::start(&mut day.command("onboard-sim fly"));
    let mut station = Running::start(&mut day.command("ground daemon"));
    station.wait_for_line("type next: ground attach");
    let mut screen = Terminal::start(&day.command("ground attach"), SIZE, false);
    screen.wait_for("every arming check passes");
    screen.wait_for("crowd line  277 m, fence 120 m");
    screen.type_until(b"X\r", "check of the vehicle begins");
    screen.wait_for("check passed");
    screen.arm_and_start(COUNTDOWN, "STANDS UNDAMAGED, inside");
    screen.wait_for("STANDS UNDAMAGED, inside");
    screen.wait_for("may be approached");
    let sent = Running::to_end(&mut day.command("printf"));
    assert_eq!(sent.code, Some(0), "{}", sent.output);
    screen.type_until(b"f", "Last received, from here");
    screen.wait_for("own position");
    let stopped = Running::to_end(&mut day.command("ground stop"));
    assert_eq!(stopped.code, Some(0), "{}", stopped.output);
    assert_eq!(station.wait().code, Some(0));
    vehicle.signal(Signal::SIGINT);
    let flown = vehicle.wait();
    assert_eq!(flown.code, Some(0), "{}", flown.output);
    day.run_up_to("nothing");
    for report in ["vehicle.html", "ground.html"] {
        let text = std::fs::read_to_string(folder.path().join(report)).unwrap();
        assert!(text.contains("crowd line") && text.contains("Touchdown to the nearest"), "{report}");
        // The vehicle is sound: what its check of step 2 found is nothing of the flight.
        // (On a busy machine the countdown may have been held, which is a sign.)
        assert!(!text.contains("First sign: not ready"), "{report}");
    }
}
