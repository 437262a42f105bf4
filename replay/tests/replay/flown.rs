//! Flies a short landing with the real controller against its own model, and writes logs of it.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read as _;
use std::sync::LazyLock;

use flight::guidance::controller::{ControllerConfig, ControllerInput, ControllerState, step};
use flight::rules::phase::Phase;
use flight::rules::verdict::{LandingVerdict, TouchdownLimits};
use protocol::log::record::{Direction, Event, EventLevel, RawFrame, Record};
use protocol::log::v1;
use protocol::log::writer::{LogHeader, LogWriter};
use replay::log::{FlightLog, LogError};
use replay::verify::{VerifyReport, verify_log};
use tick_log::{state_to_log, tick_to_log, verdict_to_log};

pub(crate) const PROFILE: &str = "paper-calibrated";
const PAD_TICKS: u64 = 4;
const TICK_NS: u64 = 100_000_000;
const DEADLINE_S: f64 = 0.1;
const START_UNIX_NS: u64 = 1_760_000_000_000_000_000;

/// A flown landing.
pub(crate) struct Flight {
    pub(crate) ticks: Vec<v1::ControllerTick>,
    pub(crate) verdict: v1::LandingVerdict,
}

/// The landing every test starts from, flown once.
pub(crate) static FLIGHT: LazyLock<Flight> = LazyLock::new(|| fly(|_| ()));

/// Pad, release and landing burn to the ground; the plant is the controller's own model, stepped at 1 ms. The
/// controller's inputs may be changed.
pub(crate) fn fly(tell: impl Fn(&mut ControllerInput)) -> Flight {
    let profile = vehicles::profile::builtin(PROFILE).unwrap();
    let config = ControllerConfig::from_profile(&profile);
    let model = profile.planar_model();
    let mut controller = ControllerState::new(&config);
    let mut plant = profile.start.planar_state();
    // The command of a tick is held during the next one.
    let mut held_rad = 0.0;
    let mut ticks = Vec::new();
    for tick in 0..1000_u64 {
        let burn_tick = tick.checked_sub(PAD_TICKS);
        let since_s = burn_tick.map_or(0.0, |n| n as f64 * config.sample_time_s());
        let phase = match (tick, burn_tick) {
            (0 | 1, _) => Phase::PadIdle,
            (_, None) => Phase::PadArmed,
            (_, Some(0)) => Phase::Ignition,
            _ => Phase::Powered,
        };
        let mut input = ControllerInput {
            tick,
            time_s: tick as f64 * config.sample_time_s(),
            phase,
            time_since_ignition_s: since_s,
            state: plant,
            gimbal_applied_rad: held_rad,
            thrust_scale: 1.0,
            degraded: false,
            lands_here: false,
            deadline_missed: false,
        };
        tell(&mut input);
        let output = step(&mut controller, &input);
        let solve_time_s = 0.001 * (tick % 7 + 1) as f64;
        ticks.push(tick_to_log(&input, &output, controller.digest(), solve_time_s, DEADLINE_S));
        if burn_tick.is_some() {
            for millisecond in 0..100 {
                let thrust_n = profile.motor.mean_thrust_n(since_s + f64::from(millisecond) * 1e-3, 1e-3);
                plant = model.rk4_step(&plant, held_rad, thrust_n, 1e-3);
                if plant.z_m <= 0.0 {
                    let verdict = LandingVerdict::judge(&TouchdownLimits::from_profile(&profile), &plant);
                    return Flight { ticks, verdict: verdict_to_log(input.time_s, &plant, &verdict) };
                }
            }
            held_rad = output.gimbal_command_rad;
        }
    }
    panic!("the test flight has not come down");
}

/// Options of a log.
pub(crate) struct Recipe {
    pub(crate) profile_toml: Option<String>,
    pub(crate) with_frames: bool,
}

impl Default for Recipe {
    fn default() -> Self {
        Self { profile_toml: vehicles::profile::builtin_toml(PROFILE).map(str::to_owned), with_frames: true }
    }
}

/// A written log.
pub(crate) struct Written {
    pub(crate) bytes: Vec<u8>,
    /// File size and number of ticks at each sync.
    pub(crate) synced: Vec<(u64, usize)>,
}

/// A log of these ticks, synced after every fifth.
pub(crate) fn write_log(ticks: &[v1::ControllerTick], recipe: &Recipe) -> Written {
    let file = tempfile::tempfile().unwrap();
    let header = LogHeader {
        writer: "test".to_owned(),
        start_unix_ns: START_UNIX_NS,
        run: BTreeMap::from([
            ("profile".to_owned(), PROFILE.to_owned()),
            ("seed".to_owned(), "7".to_owned()),
        ]),
        profile_toml: recipe.profile_toml.clone(),
        scenario_toml: None,
    };
    let mut writer = LogWriter::new(file.try_clone().unwrap(), &header).unwrap();
    let mut synced = Vec::new();
    let size = |file: &File| file.metadata().unwrap().len();
    for (index, tick) in ticks.iter().enumerate() {
        let time_ns = index as u64 * TICK_NS;
        if recipe.with_frames {
            for record in around(tick) {
                writer.write(&record, time_ns).unwrap();
            }
        }
        writer.write(&Record::from(tick.clone()), time_ns).unwrap();
        if index % 5 == 4 {
            writer.flush().unwrap();
            synced.push((size(&file), index + 1));
        }
    }
    if recipe.with_frames {
        let verdict = Record::LandingVerdict(Box::new(FLIGHT.verdict.clone()));
        writer.write(&verdict, ticks.len() as u64 * TICK_NS).unwrap();
    }
    writer.flush().unwrap();
    synced.push((size(&file), ticks.len()));
    let mut file = writer.finish().unwrap();
    std::io::Seek::rewind(&mut file).unwrap();
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).unwrap();
    Written { bytes, synced }
}

/// What else a vehicle records at a tick.
fn around(tick: &v1::ControllerTick) -> [Record; 3] {
    let frame = RawFrame {
        direction: Direction::Tx,
        endpoint: "vehicle",
        link: "udpout:127.0.0.1:14550".to_owned(),
        bytes: vec![0xfd; 40],
    };
    let truth = v1::PlantTruth {
        time_s: tick.input.time_s,
        phase: tick.input.phase,
        state: tick.input.state,
        ..v1::PlantTruth::default()
    };
    let event = Event { level: EventLevel::Info, name: "vehicle".to_owned(), message: "tick".to_owned() };
    [Record::RawFrame(frame), Record::PlantTruth(Box::new(truth)), Record::Event(event)]
}

/// A log of the whole flight.
pub(crate) static WHOLE: LazyLock<Written> = LazyLock::new(|| write_log(&FLIGHT.ticks, &Recipe::default()));

/// The report on a log's only flight.
pub(crate) fn only(mut reports: Vec<VerifyReport>) -> VerifyReport {
    assert_eq!(reports.len(), 1, "{reports:?}");
    reports.remove(0)
}

/// Verifies a log in memory, of one flight.
pub(crate) fn verify_bytes(bytes: &[u8]) -> Result<VerifyReport, LogError> {
    let open = || FlightLog::read("test.mcap".to_owned(), bytes);
    let reports = verify_log(&mut open()?, || {
        let mut whole = open()?;
        while whole.next_entry()?.is_some() {}
        Ok(whole.head().clone())
    });
    reports.map(only)
}

/// Verifies a log of these ticks.
pub(crate) fn verify_ticks(ticks: &[v1::ControllerTick]) -> VerifyReport {
    let recipe = Recipe { with_frames: false, ..Recipe::default() };
    verify_bytes(&write_log(ticks, &recipe).bytes).unwrap()
}

/// A tick whose state estimate is upright and still; for tests that need no flight.
pub(crate) fn idle_tick(number: u64) -> v1::ControllerTick {
    let mut tick = FLIGHT.ticks[0].clone();
    tick.input.tick = number;
    tick.input.state = state_to_log(&vehicles::profile::builtin(PROFILE).unwrap().start.planar_state());
    tick
}
