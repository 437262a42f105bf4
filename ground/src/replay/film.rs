//! A recorded flight, from MCAP or from a `.tlog`: how long it is and which phases it has. Its scenes stay in the file and
//! are read as they are played, so that memory does not grow with the log.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use protocol::dialect::{MavMessage, TdPhase};
use protocol::frame::Frame;
use protocol::identity::Address;

pub use super::footage::Scene;
use super::footage::{Footage, Side};
use crate::model::telemetry::phase_from_number;

/// How far the reading of a log is, is told this often.
const PROGRESS_BYTES: u64 = 4 * 1024 * 1024;
/// Times that fall by more than this are a clock that was set back, and not frames of two links in the wrong order.
const CLOCK_SET_BACK_NS: i128 = 1_000_000_000;
/// A log that was appended to on another day, or a stamp with a wrong bit, does not stand still for as long.
const LEFT_OUT_NS: i128 = 3_600 * 1_000_000_000;
/// Changes of phase kept; a flight has about ten.
const PHASES_MAX: usize = 10_000;

/// Why a log could not be played.
#[derive(Debug, thiserror::Error)]
pub enum FilmError {
    /// The file cannot be read.
    #[error("cannot read {}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// There is nothing to show.
    #[error("{}: holds no frames of a vehicle; a log that `ground` or `onboard-sim` wrote has them", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
}

/// How far the reading of a log is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Bytes read.
    pub read: u64,
    /// Size of the file.
    pub total: u64,
}

/// A whole flight.
#[derive(Debug)]
pub struct Film {
    path: PathBuf,
    /// Held open: the file may be renamed while it is played.
    file: File,
    side: Side,
    /// A log that is still being written grows behind these; what is behind them is not played.
    scenes: u64,
    length: Duration,
    /// When each phase began.
    pub phases: Vec<(TdPhase, Duration)>,
    /// Why reading ended early, if it did.
    pub damage: Option<String>,
    /// Whose flight it is: of several vehicles the one that was asked for, else the first that was heard.
    pub vehicle: Option<Address>,
}

impl Film {
    /// Looks through a log from its beginning to its end for the flight of this vehicle (`None`: the first that was heard);
    /// a `.tlog` by its name, everything else as MCAP.
    ///
    /// # Errors
    /// The file cannot be read, or holds nothing to show.
    pub fn load(
        path: &Path,
        vehicle: Option<Address>,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Self, FilmError> {
        let read = |source| FilmError::Read { path: path.to_owned(), source };
        let file = File::open(path).map_err(read)?;
        let total = file.metadata().map_err(read)?.len();
        let mut footage = Footage::begin(&file, path, vehicle).map_err(read)?;
        // What the ground heard; else what the vehicle said.
        let (mut ground, mut vehicle) = (Survey::default(), Survey::default());
        let mut told = 0;
        while let Some(stamped) = footage.next_scene().map_err(read)? {
            let survey = match stamped.side {
                Side::Ground => &mut ground,
                Side::Vehicle => &mut vehicle,
            };
            survey.note(stamped.stamp_ns, &stamped.scene);
            if footage.bytes_read() >= told + PROGRESS_BYTES {
                told = footage.bytes_read();
                progress(Progress { read: told, total });
            }
        }
        let found = [(Side::Ground, ground), (Side::Vehicle, vehicle)];
        let Some((side, survey)) = found.into_iter().find(|(_, survey)| survey.has_vehicle) else {
            return Err(FilmError::Empty { path: path.to_owned() });
        };
        Ok(Self {
            path: path.to_owned(),
            damage: footage.damage(),
            vehicle: footage.vehicle(),
            file,
            side,
            scenes: survey.scenes,
            length: survey.length,
            phases: survey.phases,
        })
    }

    /// The time of the last scene.
    pub fn length(&self) -> Duration {
        self.length
    }

    /// When a phase began first.
    pub fn begin_of(&self, phase: TdPhase) -> Option<Duration> {
        self.phases.iter().find(|(known, _)| *known == phase).map(|(_, at)| *at)
    }

    /// Its scenes from the first on.
    ///
    /// # Errors
    /// The file cannot be read any more.
    pub fn reel(&self) -> io::Result<Reel> {
        let footage = Footage::begin(&self.file, &self.path, self.vehicle)?;
        Ok(Reel { footage, side: self.side, clock: FilmClock::default(), left: self.scenes })
    }
}

/// What a first look through a log finds on one of its sides.
#[derive(Default)]
struct Survey {
    clock: FilmClock,
    scenes: u64,
    has_vehicle: bool,
    length: Duration,
    phases: Vec<(TdPhase, Duration)>,
}

impl Survey {
    fn note(&mut self, stamp_ns: u64, scene: &Scene) {
        self.length = self.clock.at(stamp_ns);
        self.scenes += 1;
        if let Scene::Heard(frame) = scene {
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

/// The scenes of a film, one after the other.
pub struct Reel {
    footage: Footage,
    side: Side,
    clock: FilmClock,
    left: u64,
}

impl Reel {
    /// The next scene and its time.
    ///
    /// # Errors
    /// The file cannot be read any more.
    pub fn next_scene(&mut self) -> io::Result<Option<(Duration, Scene)>> {
        while self.left > 0 {
            let Some(stamped) = self.footage.next_scene()? else { break };
            if stamped.side == self.side {
                self.left -= 1;
                return Ok(Some((self.clock.at(stamped.stamp_ns), stamped.scene)));
            }
        }
        Ok(None)
    }
}

/// Times of a film from the stamps in its file: from nil on, never falling, without the stretches in which nothing was
/// recorded for long.
#[derive(Debug, Clone, Copy, Default)]
struct FilmClock {
    last_ns: u64,
    /// What a stamp of time nil would have; `None` before the first.
    nil_ns: Option<i128>,
}

impl FilmClock {
    fn at(&mut self, stamp_ns: u64) -> Duration {
        let stamp_ns = i128::from(stamp_ns);
        let nil_ns = *self.nil_ns.get_or_insert(stamp_ns);
        let (at_ns, last_ns) = (stamp_ns - nil_ns, i128::from(self.last_ns));
        if (last_ns - CLOCK_SET_BACK_NS..=last_ns + LEFT_OUT_NS).contains(&at_ns) {
            self.last_ns = self.last_ns.max(u64::try_from(at_ns).unwrap_or(0));
        } else {
            self.nil_ns = Some(stamp_ns - last_ns);
        }
        Duration::from_nanos(self.last_ns)
    }
}

fn phase_of(frame: &Frame) -> Option<TdPhase> {
    match frame.decode().ok()? {
        MavMessage::HEARTBEAT(data) => phase_from_number(data.custom_mode),
        MavMessage::TD_FLIGHT_STATUS(data) => Some(data.phase),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_films_time_never_falls_and_goes_on_when_the_clock_is_set() {
        let seconds = |stamps: &[u64]| -> Vec<u64> {
            let mut clock = FilmClock::default();
            stamps.iter().map(|second| clock.at(second * 1_000_000_000).as_secs()).collect()
        };
        assert_eq!(seconds(&[100, 101, 104, 103, 50, 51, 52]), [0, 1, 4, 4, 4, 5, 6]);
        assert_eq!(seconds(&[100, 101, 90_000, 90_002]), [0, 1, 1, 3]);
        let mut clock = FilmClock::default();
        assert_eq!([u64::MAX, 0, u64::MAX].map(|stamp_ns| clock.at(stamp_ns)), [Duration::ZERO; 3]);
    }
}
