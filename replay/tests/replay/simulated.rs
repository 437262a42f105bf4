//! Flies the simulated vehicle, with the logs that it writes itself.

use std::fs::File;
use std::num::NonZeroU32;
use std::path::PathBuf;
use std::sync::LazyLock;

use protocol::frame::Framer;
use protocol::log::record::{Direction, Event, EventLevel, RawFrame, Record};
use protocol::log::recorder::Recorder;
use protocol::log::writer::{LogHeader, LogWriter};
use protocol::told::Told;
use protocol::transport::LinkAddress;
use replay::log::{Entry, FlightLog, Recording};
use sim::recipe::Recipe;
use sim::wire::fly::{FlyOptions, OnTheWire, Speed, fly, load_flight};
use sim::wire::vehicle::RocketFlight;
use tempfile::TempDir;
use tokio::sync::watch;

/// Start of every run, so that the logs do not depend on the day.
const START_UNIX_NS: u64 = 1_760_000_000_000_000_000;

/// A station was started this long before its vehicle, records its state so often, and its crew notes something in the burn, ns.
pub(crate) const STATION_EARLIER_NS: u64 = 3_000_000_000;
const STATION_PERIOD_NS: u64 = 100_000_000;
const NOTED_NS: u64 = 25_000_000_000;

/// A directory with the log of one flight in it.
pub(crate) struct Simulated {
    directory: TempDir,
    pub(crate) log: PathBuf,
}

/// A rocket from apogee, flown as the vehicle flies it, without links.
pub(crate) static MK2: LazyLock<Simulated> = LazyLock::new(|| simulate(1, &[]));

/// The same with other dispersions.
pub(crate) static DISPERSED: LazyLock<Simulated> = LazyLock::new(|| simulate(2, &[]));

/// The first flight with telemetry to no receiver, so that its log has raw frames.
pub(crate) static WITH_FRAMES: LazyLock<Simulated> = LazyLock::new(|| to_nobody(|link| simulate(1, &[link])));

/// A flight with telemetry to no receiver.
pub(crate) fn to_nobody(fly: impl FnOnce(LinkAddress) -> Simulated) -> Simulated {
    let sink = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
    fly(format!("udpout:{}", sink.local_addr().unwrap()).parse().unwrap())
}

/// The log that a station writes which hears every frame of a vehicle, beside the vehicle's own.
pub(crate) fn station_log(flight: &Simulated, name: &str) -> PathBuf {
    let path = flight.beside(name);
    let mut from = FlightLog::open(&flight.log).unwrap();
    let header =
        LogHeader { writer: "ground".to_owned(), start_unix_ns: START_UNIX_NS, ..LogHeader::default() };
    let mut log = LogWriter::new(File::create(&path).unwrap(), &header).unwrap();
    let (mut told, mut due_ns, mut noted) = (Told::default(), 0, false);
    while let Some(stamped) = from.next_entry().unwrap() {
        if stamped.entry != Entry::RawFrame {
            continue;
        }
        let at_ns = STATION_EARLIER_NS + stamped.log_time_ns - START_UNIX_NS;
        let mut framer = Framer::new();
        framer.push_datagram(&stamped.data);
        let message = framer.next_frame().unwrap().decode().unwrap();
        let raw = RawFrame {
            direction: Direction::Rx,
            endpoint: "ground",
            link: "udpin:0.0.0.0:14550".to_owned(),
            bytes: stamped.data,
        };
        log.write(&Record::RawFrame(raw), at_ns).unwrap();
        if told.hear(&message) && at_ns >= due_ns {
            due_ns = at_ns + STATION_PERIOD_NS;
            log.write(&Record::Telemetry(Box::new(told.record(at_ns as f64 / 1e9))), at_ns).unwrap();
        }
        if at_ns > NOTED_NS && !noted {
            noted = true;
            let (name, message) = ("ground".to_owned(), "note (screen 1, Ann): a gust".to_owned());
            log.write(&Record::Event(Event { level: EventLevel::Info, name, message }), at_ns).unwrap();
        }
    }
    log.finish().unwrap();
    path
}

impl Simulated {
    pub(crate) fn recording(&self) -> Recording {
        Recording::open(&self.log).unwrap()
    }

    /// A new file's path beside the log.
    pub(crate) fn beside(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }
}

/// Flies mk2 to the ground and writes its log.
fn simulate(seed: u64, links: &[LinkAddress]) -> Simulated {
    let RocketFlight { mut recipe, .. } = load_flight("mk2").unwrap();
    recipe.seed = seed;
    simulate_recipe(recipe, links)
}

/// Flies a recipe until its vehicle is safe, or its start refused, and writes its log.
pub(crate) fn simulate_recipe(recipe: Recipe, links: &[LinkAddress]) -> Simulated {
    let directory = tempfile::tempdir().unwrap();
    let log = directory.path().join("flight.mcap");
    let flight = RocketFlight { recipe, number: 0 };
    let recorder = Recorder::create(&log, None, &flight.log_header("onboard-sim", START_UNIX_NS)).unwrap();
    let options = FlyOptions {
        system_id: 1,
        flight,
        links: links.to_vec(),
        on_the_wire: OnTheWire { boot_number: NonZeroU32::MIN, ..OnTheWire::drawn() },
        recorder: Some(recorder.clone()),
        speed: Speed::Max,
        auto_start: true,
        exit_when_safed: true,
        board: None,
        pin_out: None,
        abort_file: None,
        log_clock: None,
        key_file: None,
        crew: None,
    };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let (_stop, stopped) = watch::channel(false);
    runtime.block_on(fly(options, stopped)).unwrap();
    recorder.finish().unwrap();
    Simulated { directory, log }
}
