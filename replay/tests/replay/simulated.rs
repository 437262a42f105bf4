//! Flies the simulated vehicle, with the logs that it writes itself.

use std::num::NonZeroU32;
use std::path::PathBuf;
use std::sync::LazyLock;

use protocol::log::recorder::Recorder;
use protocol::transport::LinkAddress;
use replay::log::Recording;
use sim::recipe::Recipe;
use sim::wire::fly::{FlyOptions, OnTheWire, Speed, fly, load_flight};
use sim::wire::vehicle::RocketFlight;
use tempfile::TempDir;
use tokio::sync::watch;

/// Start of every run, so that the logs do not depend on the day.
const START_UNIX_NS: u64 = 1_760_000_000_000_000_000;

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
    let recorder = Recorder::create(&log, false, &flight.log_header("onboard-sim", START_UNIX_NS)).unwrap();
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
