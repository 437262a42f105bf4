//! Runs every command of docs/crew.md as printed. The page's addresses and devices are replaced by
//! those of this test.

use std::fs;
use std::net::SocketAddr;
use std::path::Path;
use std::process::Command;

use e2e::{
    Program, Running, SerialLine, Signal, Terminal, auto_ground, keygen, landed_vehicle, program,
    unshared_address, vehicle,
};

use crate::pages::{commands_of, lines_of_code, page};

const SIZE: (u16, u16) = (100, 34);
const READY: &str = "every arming check passes";

/// What the page calls the station's address and the radios is here something else.
struct Places {
    station: SocketAddr,
    radio: SerialLine,
}

impl Places {
    fn new() -> Self {
        Self { station: unshared_address(), radio: SerialLine::new(57_600) }
    }

    fn here(&self, word: &str) -> String {
        let station = self.station.to_string();
        let of_page = [
            ("0.0.0.0:14550", station.clone()),
            ("192.168.1.20:14550", station),
            // Any free port.
            ("127.0.0.1:8765", "127.0.0.1:0".to_owned()),
            ("serial:/dev/ttyUSB0:57600", self.radio.near_link()),
            ("serial:/dev/ttyUSB1:57600", self.radio.far_link()),
        ];
        of_page.into_iter().fold(word.to_owned(), |word, (there, here)| word.replace(there, &here))
    }

    /// The command of a line of the page that begins like this, in a folder.
    fn command(&self, folder: &Path, begins: &str) -> Command {
        let lines = lines_of_code(&page("docs/crew.md"));
        let line = lines.iter().find(|line| line.starts_with(begins));
        let line = line.unwrap_or_else(|| panic!("no line `{begins}` on the page"));
        let (which, words) = commands_of(line).pop().expect("a command of ours");
        let mut command = program(which);
        command.args(words.iter().map(|word| self.here(word))).current_dir(folder);
        command.envs([("XDG_RUNTIME_DIR", folder), ("XDG_CONFIG_HOME", folder)]);
        command
    }

    fn screen(&self, folder: &Path, begins: &str, words: &str) -> Terminal {
        let terminal = Terminal::start(&self.command(folder, begins), SIZE, false);
        terminal.wait_for(words);
        terminal
    }

    fn answer(&self, folder: &Path, begins: &str, words: &str) {
        let ended = Running::to_end(&mut self.command(folder, begins));
        assert!(
            ended.code == Some(0) && ended.output.contains(words),
            "{begins}: {:?} {}",
            ended.code,
            ended.output
        );
    }
}

/// How each line of the page begins; the tests below run them.
const LINES: [&str; 21] = [
    "ground daemon --connect",
    "ground attach ",
    "ground attach --watch",
    "ground status",
    "ground stop",
    "ground --replay",
    "onboard-sim fly --start pad --mavlink udpout",
    "onboard-sim fly --start pad --mavlink serial",
    "ground --connect udpin",
    "ground --connect udpin:0.0.0.0:14550 --foxglove",
    "ground --connect serial",
    "onboard-sim keygen flight.key",
    "onboard-sim fly --start pad --key",
    "ground --key flight.key --connect",
    "ground download",
    "replay verify vehicle1-flight.mcap",
    "onboard-sim fly --start pad --mission mk3 --key",
    "ground --key flight.key --crew crew.toml --operator Ann",
    "ground --key flight.key --crew crew.toml --operator Bob",
    "replay verify --book ground.mcap vehicle.mcap",
    "replay verify --book ground.mcap --public-key",
];

/// A line that is new on the page needs a test.
#[test]
fn every_command_of_the_crews_page_is_run_here() {
    let lines = lines_of_code(&page("docs/crew.md"));
    let ours: Vec<&String> = lines.iter().filter(|line| !commands_of(line).is_empty()).collect();
    let starts = |line: &str| LINES.iter().any(|begin| format!("{line} ").starts_with(begin));
    let new: Vec<_> = ours.iter().filter(|line| !starts(line)).collect();
    assert!(new.is_empty() && ours.len() == LINES.len(), "{} of {}, new: {new:?}", ours.len(), LINES.len());
}

#[test]
fn a_station_of_the_crews_page_has_screens() {
    let (folder, places) = (tempfile::tempdir().unwrap(), Places::new());
    let folder = folder.path();
    let mut station = Running::start(&mut places.command(folder, "ground daemon --connect"));
    station.wait_for_line("type next: ground attach");
    let flown = Running::start(&mut places.command(folder, "onboard-sim fly --start pad --mavlink udpout"));
    let attached = places.screen(folder, "ground attach", READY);
    let watching = places.screen(folder, "ground attach --watch", "WATCH");
    places.answer(folder, "ground status", "PAD_IDLE disarmed");
    places.answer(folder, "ground stop", "");
    // It has seen no flight.
    assert_eq!(station.wait().code, Some(5));
    drop((attached, watching));
    flown.signal(Signal::SIGINT);
    flown.wait();
}

#[test]
fn a_recorded_flight_is_shown_as_on_the_crews_page() {
    let (folder, places) = (tempfile::tempdir().unwrap(), Places::new());
    // Its frames have no receiver: the log has them all the same.
    let mut fly = program(Program::OnboardSim);
    fly.args(["fly", "--auto", "--speed", "max", "--mavlink", "udpin:127.0.0.1:0", "--log", "flight.mcap"]);
    assert_eq!(Running::to_end(fly.current_dir(folder.path())).code, Some(0));
    drop(places.screen(folder.path(), "ground --replay", "REPLAY"));
}

/// One vehicle after the other on the links of the page: UDP, the same with live values for
/// Foxglove, a radio, and UDP that is signed.
#[test]
fn the_links_of_the_crews_page_join_vehicle_and_station() {
    for (begins, meets) in [
        ("onboard-sim fly --start pad --mavlink udpout", "ground --connect udpin"),
        ("onboard-sim fly --start pad --mavlink udpout", "ground --connect udpin:0.0.0.0:14550 --foxglove"),
        ("onboard-sim fly --start pad --mavlink serial", "ground --connect serial"),
        ("onboard-sim fly --start pad --key", "ground --key flight.key --connect"),
    ] {
        let (folder, places) = (tempfile::tempdir().unwrap(), Places::new());
        places.answer(folder.path(), "onboard-sim keygen flight.key", "");
        let _vehicle = Running::start(&mut places.command(folder.path(), begins));
        drop(places.screen(folder.path(), meets, READY));
    }
}

/// Over a cable: a radio needs minutes for a log.
#[test]
fn the_log_is_fetched_as_on_the_crews_page() {
    let (folder, places) = (tempfile::tempdir().unwrap(), Places::new());
    let vehicle = landed_vehicle(folder.path(), "mk2", &format!("udpin:{}", places.station), &[]);
    let station = tempfile::tempdir().unwrap();
    let of_page = places.command(station.path(), "ground download");
    let mut fetch = program(Program::Ground);
    let cable = format!("udpout:{}", places.station);
    let words = of_page.get_args().map(|word| word.to_str().expect("text"));
    fetch.args(words.map(|word| if word.starts_with("serial:") { &cable } else { word }));
    let fetched = Running::to_end(fetch.current_dir(station.path()));
    assert_eq!(fetched.code, Some(0), "{}", fetched.output);
    places.answer(station.path(), "replay verify vehicle1-flight.mcap", "frames identical");
    vehicle.signal(Signal::SIGTERM);
    vehicle.wait();
}

/// The crew file is the block of the page.
fn crew_file() -> String {
    let page = page("docs/crew.md");
    let block = page.lines().skip_while(|line| *line != "```toml").skip(1).take_while(|line| *line != "```");
    block.collect::<Vec<_>>().join("\n")
}

#[test]
fn the_two_people_of_the_crews_page_see_a_vehicle_that_is_ready() {
    let (folder, places) = (tempfile::tempdir().unwrap(), Places::new());
    for key in ["flight.key", "ann.key", "bob.key", "cleo.key"] {
        keygen(folder.path(), key);
    }
    fs::write(folder.path().join("crew.toml"), crew_file()).unwrap();
    let _vehicle =
        Running::start(&mut places.command(folder.path(), "onboard-sim fly --start pad --mission mk3 --key"));
    for operator in ["Ann", "Bob"] {
        // Each laptop remembers its own time stamps.
        let laptop = folder.path().join(operator);
        fs::create_dir(&laptop).unwrap();
        for file in ["flight.key", "ann.key", "bob.key", "cleo.key", "crew.toml"] {
            fs::copy(folder.path().join(file), laptop.join(file)).unwrap();
        }
        let begins = format!("ground --key flight.key --crew crew.toml --operator {operator}");
        let screen = places.screen(&laptop, &begins, READY);
        screen.wait_for(operator);
    }
}

#[test]
fn the_book_is_proven_as_on_the_crews_page() {
    let (folder, places) = (tempfile::tempdir().unwrap(), Places::new());
    let folder = folder.path();
    keygen(folder, "flight.key");
    fs::create_dir(folder.join("station")).unwrap();
    fs::copy(folder.join("flight.key"), folder.join("station/flight.key")).unwrap();
    let mut station = Running::start(
        auto_ground(&folder.join("station"), &["udpin:127.0.0.1:0"]).args(["--key", "flight.key"]),
    );
    let flown = Running::start(vehicle(folder, &[&station.udp_link()]).args(["--key", "flight.key"]));
    assert_eq!((station.wait().code, flown.wait().code), (Some(0), Some(0)));
    fs::rename(folder.join("station/ground.mcap"), folder.join("ground.mcap")).unwrap();
    places.answer(folder, "replay verify --book ground.mcap vehicle.mcap", "PROVEN");
    // The key on the page is another station's.
    let other = Running::to_end(&mut places.command(folder, "replay verify --book ground.mcap --public-key"));
    assert_eq!(other.code, Some(3), "{}", other.output);
    assert!(other.output.contains("signed with"), "{}", other.output);
}
