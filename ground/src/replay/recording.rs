//! A recorded flight in an MCAP log or a `.tlog`: its length and its phases. Its events are read from the file while
//! it is played, so that memory does not grow with the log.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use protocol::dialect::{MavMessage, TdPhase};
use protocol::frame::Frame;
use protocol::identity::Address;

pub use super::log_events::RecordedEvent;
use super::log_events::{LogEvents, Side};
use crate::model::telemetry::phase_of as phase_of_heartbeat;

/// How often the reading progress is reported, bytes.
const PROGRESS_BYTES: u64 = 4 * 1024 * 1024;
/// A larger step back in time means that the clock was set back, not that frames of two links are out of order.
const CLOCK_SET_BACK_NS: i128 = 1_000_000_000;
/// A longer gap is skipped: the log was continued on another day, or a time stamp is wrong.
const LEFT_OUT_NS: i128 = 3_600 * 1_000_000_000;
/// The most phase changes that are kept; a flight has about ten.
const PHASES_MAX: usize = 10_000;

/// Why a log cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be read.
    #[error("cannot read {}", path.display())]
    Read { path: PathBuf, source: io::Error },
    /// There is nothing to show.
    #[error("{}: contains no frames of a vehicle; is it a log of `ground` or `onboard-sim`?", path.display())]
    Empty { path: PathBuf },
}

/// The reading progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    pub read: u64,
    pub total: u64,
}

/// A recorded flight.
#[derive(Debug)]
pub struct Recording {
    path: PathBuf,
    /// Kept open, because the file may be renamed while it is played.
    file: File,
    side: Side,
    /// The number of events to play; a log that is still being written grows behind them.
    events: u64,
    length: Duration,
    /// When each phase began.
    pub phases: Vec<(TdPhase, Duration)>,
    /// Why reading ended early, if it did.
    pub damage: Option<String>,
    /// The vehicle that is shown: the chosen one, otherwise the first that was heard.
    pub vehicle: Option<Address>,
}

impl Recording {
    /// Reads a log once for the flight of this vehicle (`None`: the first that was heard). A name that ends in
    /// `.tlog` is read as such, everything else as MCAP.
    ///
    /// # Errors
    /// The file cannot be read, or holds nothing to show.
    pub fn load(
        path: &Path,
        vehicle: Option<Address>,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Self, RecordingError> {
        let read = |source| RecordingError::Read { path: path.to_owned(), source };
        let file = File::open(path).map_err(read)?;
        let total = file.metadata().map_err(read)?.len();
        let mut events = LogEvents::begin(&file, path, vehicle).map_err(read)?;
        // What the ground received; if that is missing, what the vehicle sent.
        let (mut ground, mut vehicle) = (Survey::default(), Survey::default());
        let mut told = 0;
        while let Some(stamped) = events.next_event().map_err(read)? {
            let survey = match stamped.side {
                Side::Ground => &mut ground,
                Side::Vehicle => &mut vehicle,
            };
            survey.note(stamped.stamp_ns, &stamped.event);
            if events.bytes_read() >= told + PROGRESS_BYTES {
                told = events.bytes_read();
                progress(Progress { read: told, total });
            }
        }
        let found = [(Side::Ground, ground), (Side::Vehicle, vehicle)];
        let Some((side, survey)) = found.into_iter().find(|(_, survey)| survey.has_vehicle) else {
            return Err(RecordingError::Empty { path: path.to_owned() });
        };
        Ok(Self {
            path: path.to_owned(),
            damage: events.damage(),
            vehicle: events.vehicle(),
            file,
            side,
            events: survey.events,
            length: survey.length,
            phases: survey.phases,
        })
    }

    /// The time of the last event.
    pub fn length(&self) -> Duration {
        self.length
    }

    /// When a phase first began.
    pub fn begin_of(&self, phase: TdPhase) -> Option<Duration> {
        self.phases.iter().find(|(known, _)| *known == phase).map(|(_, at)| *at)
    }

    /// A reader at the first event.
    ///
    /// # Errors
    /// The file can no longer be read.
    pub fn reader(&self) -> io::Result<Reader> {
        let events = LogEvents::begin(&self.file, &self.path, self.vehicle)?;
        Ok(Reader { events, side: self.side, clock: RecordingClock::default(), left: self.events })
    }
}

/// What the first pass finds for one side of the log.
#[derive(Default)]
struct Survey {
    clock: RecordingClock,
    events: u64,
    has_vehicle: bool,
    length: Duration,
    phases: Vec<(TdPhase, Duration)>,
}

impl Survey {
    fn note(&mut self, stamp_ns: u64, event: &RecordedEvent) {
        self.length = self.clock.at(stamp_ns);
        self.events += 1;
        if let RecordedEvent::Heard(frame) = event {
            self.has_vehicle = true;
            if let Some(phase) = phase_of(frame)
                && self.phases.last().is_none_or(|(last, _)| *last != phase)
                && self.phases.len() < PHASES_MAX
            {
                self.phases.push((phase, self.length));
            }
        }
    }
}

/// Reads the events of a recording in order.
pub struct Reader {
    events: LogEvents,
    side: Side,
    clock: RecordingClock,
    left: u64,
}

impl Reader {
    /// The next event and its time.
    ///
    /// # Errors
    /// The file can no longer be read.
    pub fn next_event(&mut self) -> io::Result<Option<(Duration, RecordedEvent)>> {
        while self.left > 0 {
            let Some(stamped) = self.events.next_event()? else { break };
            if stamped.side == self.side {
                self.left -= 1;
                return Ok(Some((self.clock.at(stamped.stamp_ns), stamped.event)));
            }
        }
        Ok(None)
    }
}

/// Converts the time stamps of a file to times from zero that never decrease, and skips long gaps.
#[derive(Debug, Clone, Copy, Default)]
struct RecordingClock {
    last_ns: u64,
    /// The time stamp that corresponds to time zero; `None` before the first.
    zero_ns: Option<i128>,
}

impl RecordingClock {
    fn at(&mut self, stamp_ns: u64) -> Duration {
        let stamp_ns = i128::from(stamp_ns);
        let zero_ns = *self.zero_ns.get_or_insert(stamp_ns);
        let (at_ns, last_ns) = (stamp_ns - zero_ns, i128::from(self.last_ns));
        if (last_ns - CLOCK_SET_BACK_NS..=last_ns + LEFT_OUT_NS).contains(&at_ns) {
            self.last_ns = self.last_ns.max(u64::try_from(at_ns).unwrap_or(0));
        } else {
            self.zero_ns = Some(stamp_ns - last_ns);
        }
        Duration::from_nanos(self.last_ns)
    }
}

fn phase_of(frame: &Frame) -> Option<TdPhase> {
    match frame.decode().ok()? {
        MavMessage::HEARTBEAT(data) => phase_of_heartbeat(&data),
        MavMessage::TD_FLIGHT_STATUS(data) => Some(data.phase),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_never_decreases_and_continues_when_the_clock_is_set() {
        let seconds = |stamps: &[u64]| -> Vec<u64> {
            let mut clock = RecordingClock::default();
            stamps.iter().map(|second| clock.at(second * 1_000_000_000).as_secs()).collect()
        };
        assert_eq!(seconds(&[100, 101, 104, 103, 50, 51, 52]), [0, 1, 4, 4, 4, 5, 6]);
        assert_eq!(seconds(&[100, 101, 90_000, 90_002]), [0, 1, 1, 3]);
        let mut clock = RecordingClock::default();
        assert_eq!([u64::MAX, 0, u64::MAX].map(|stamp_ns| clock.at(stamp_ns)), [Duration::ZERO; 3]);
    }
}
