//! The first frames of a simulated flight, and logs of them: short, so that they can be cut and
//! broken everywhere.

use std::fs::File;
use std::io::Read as _;
use std::sync::LazyLock;

use protocol::log::computer_v1::{ComputerFrame, ComputerStart};
use protocol::log::flight_v1::PilotTiming;
use protocol::log::record::{Direction, Event, EventLevel, RawFrame, Record};
use protocol::log::v1;
use protocol::log::writer::{LogHeader, LogWriter};
use replay::log::{FlightLog, LogError};
use replay::verify::{VerifyReport, verify_log};
use sim::outside::Outside;
use sim::recipe::Recipe as FlightRecipe;
use sim::sortie::Sortie;
use sim::wire::record::{self, LastFrame, campaign_header};

pub(crate) const MISSION: &str = "mk2";
const FRAMES: usize = 68;
const NUMBER: u64 = 3;
pub(crate) const FRAME_NS: u64 = 5_000_000;
pub(crate) const FRAME_S: f64 = 0.005;
const DEADLINE_S: f64 = 0.005;

/// The beginning of a flight from apogee, with a verdict as if it had come down then.
pub(crate) struct Flight {
    pub(crate) start: ComputerStart,
    pub(crate) frames: Vec<ComputerFrame>,
    pub(crate) verdict: v1::LandingVerdict,
    /// The estimate after each frame.
    estimates: Vec<Record>,
    header: LogHeader,
}

/// The flight every test starts from, flown once.
pub(crate) static FLIGHT: LazyLock<Flight> = LazyLock::new(|| {
    let recipe = FlightRecipe::built_in(MISSION, "field").unwrap();
    let mut flight = Sortie::new(&recipe, NUMBER).unwrap();
    let start = record::start(flight.computer());
    let (mut frames, mut estimates, mut last) = (Vec::new(), Vec::new(), LastFrame::default());
    while frames.len() < FRAMES {
        flight.step_with(&Outside::NOBODY, &mut last);
        frames.push(*last.take().unwrap());
        let beside = record::estimate_and_truth(&flight).into_iter();
        estimates.extend(beside.filter(|record| matches!(record, Record::Estimate(_))));
    }
    let limit = |name: &str| v1::LimitResult {
        name: name.to_owned(),
        value: 0.5,
        minimum: -1.0,
        maximum: 1.0,
        unit: "m".to_owned(),
        passed: true,
    };
    let verdict = v1::LandingVerdict {
        time_s: FRAMES as f64 * FRAME_S,
        landing: v1::Landing { stands: true, upright: true, envelope: true, table_2: true },
        envelope: ["vertical speed", "lateral speed", "tilt", "rotation rate"].map(limit).into(),
        table_2: vec![limit("distance")],
        ..v1::LandingVerdict::default()
    };
    Flight { start, frames, verdict, estimates, header: campaign_header(&recipe, NUMBER) }
});

/// The mission of the flight.
pub(crate) fn mission_toml() -> &'static str {
    flight::vehicles::mission::BUILTIN.iter().find(|(name, _)| *name == MISSION).unwrap().1
}

/// Options of a log.
pub(crate) struct Recipe {
    pub(crate) profile_toml: Option<String>,
    pub(crate) with_frames: bool,
}

impl Default for Recipe {
    fn default() -> Self {
        Self { profile_toml: Some(mission_toml().to_owned()), with_frames: true }
    }
}

/// A written log.
pub(crate) struct Written {
    pub(crate) bytes: Vec<u8>,
    /// File size and number of frames at each sync.
    pub(crate) synced: Vec<(u64, usize)>,
}

/// A log of these frames, synced after every fifth. The start is left out if there are no frames.
pub(crate) fn write_log(frames: &[ComputerFrame], recipe: &Recipe) -> Written {
    let file = tempfile::tempfile().unwrap();
    let header = LogHeader { profile_toml: recipe.profile_toml.clone(), ..FLIGHT.header.clone() };
    let mut writer = LogWriter::new(file.try_clone().unwrap(), &header).unwrap();
    let mut synced = Vec::new();
    let size = |file: &File| file.metadata().unwrap().len();
    if !frames.is_empty() {
        writer.write(&Record::ComputerStart(Box::new(FLIGHT.start)), 0).unwrap();
    }
    for (index, frame) in frames.iter().enumerate() {
        let time_ns = (index as u64 + 1) * FRAME_NS;
        if recipe.with_frames {
            for record in around(frame) {
                writer.write(&record, time_ns).unwrap();
            }
        }
        writer.write(&Record::ComputerFrame(Box::new(frame.clone())), time_ns).unwrap();
        let place = usize::try_from(frame.input.frame).ok().and_then(|number| number.checked_sub(1));
        if let Some(estimate) = place.and_then(|place| FLIGHT.estimates.get(place)) {
            writer.write(estimate, time_ns).unwrap();
        }
        if index % 5 == 4 {
            writer.flush().unwrap();
            synced.push((size(&file), index + 1));
        }
    }
    if recipe.with_frames {
        let verdict = Record::LandingVerdict(Box::new(FLIGHT.verdict.clone()));
        writer.write(&verdict, frames.len() as u64 * FRAME_NS).unwrap();
    }
    writer.flush().unwrap();
    synced.push((size(&file), frames.len()));
    let mut file = writer.finish().unwrap();
    std::io::Seek::rewind(&mut file).unwrap();
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).unwrap();
    Written { bytes, synced }
}

/// What else a vehicle records in a frame.
fn around(frame: &ComputerFrame) -> [Record; 3] {
    let raw = RawFrame {
        direction: Direction::Tx,
        endpoint: "vehicle",
        link: "udpout:127.0.0.1:14550".to_owned(),
        bytes: vec![0xfd; 40],
    };
    let ComputerFrame { input, .. } = frame;
    let timing = PilotTiming {
        frame: input.frame,
        time_s: input.time_s,
        solve_time_s: 0.001 * (input.frame % 7 + 1) as f64,
        deadline_s: DEADLINE_S,
    };
    let event = Event { level: EventLevel::Info, name: "vehicle".to_owned(), message: "frame".to_owned() };
    [Record::RawFrame(raw), Record::PilotTiming(timing), Record::Event(event)]
}

/// A log of the whole flight.
pub(crate) static COMPLETE: LazyLock<Written> =
    LazyLock::new(|| write_log(&FLIGHT.frames, &Recipe::default()));

/// The report on a log's only flight.
pub(crate) fn only(mut reports: Vec<VerifyReport>) -> VerifyReport {
    assert_eq!(reports.len(), 1, "{reports:?}");
    reports.remove(0)
}

/// Verifies a log in memory, of one flight.
pub(crate) fn verify_bytes(bytes: &[u8]) -> Result<VerifyReport, LogError> {
    let open = || FlightLog::read("test.mcap".to_owned(), bytes);
    let reports = verify_log(&mut open()?, false, || {
        let mut whole = open()?;
        while whole.next_entry()?.is_some() {}
        Ok(whole.head().clone())
    });
    reports.map(only)
}

/// Verifies a log of these frames.
pub(crate) fn verify_frames(frames: &[ComputerFrame]) -> VerifyReport {
    let recipe = Recipe { with_frames: false, ..Recipe::default() };
    verify_bytes(&write_log(frames, &recipe).bytes).unwrap()
}
