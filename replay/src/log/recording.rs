//! Holds one flight in memory, for questions that need more than one pass.
//!
//! Plans and raw frames are left out, so a flight of some minutes takes some tens of megabytes. A
//! log that is longer than any real flight is refused.

use std::io::Read;
use std::path::Path;

use avionics::log::logged::RecordError;
use flight::computer::flight_time_s;
use foxglove::messages::Log as EventRecord;
use protocol::log::computer_v1::{ComputerFrame, ComputerStart};
use protocol::log::{flight_v1, v1};

use crate::controller::LoggedComputer;

use super::{Clock, Clocks, Cut, Entry, FlightLog, FrameOrder, Gap, Head, LogError, StampedEntry, Verdict};

/// Most records of one kind: seventeen minutes of frames at 200 Hz.
const RECORDS_MAX: usize = 200_000;

/// Why a log cannot be executed or flown again.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file is not a flight log, or cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// Longer than any flight.
    #[error(
        "{name}: has more than {RECORDS_MAX} {kind}, more than this command holds in memory; no flight is that long"
    )]
    TooLong { name: String, kind: &'static str },
    /// The log has no frames to re-execute.
    #[error(
        "{name}: has no frames of a flight computer after its release: {}",
        unreadable.as_deref().unwrap_or("this command needs the log of the vehicle or of the demonstration")
    )]
    NoFrames { name: String, unreadable: Option<String> },
    /// The first frames are lost.
    #[error(
        "{name}: begins with frame {first} of the flight computer, and the frames before it are lost: what the computer remembered there is unknown"
    )]
    BeginningLost { name: String, first: u64 },
    /// The log holds several flights.
    #[error(
        "{name}: holds {flights} flights, and this command takes one; `replay verify` reports on each of them"
    )]
    SeveralFlights { name: String, flights: usize },
    #[error(
        "{name}: has no frames of a flight computer with its sensors and estimates ({found}). A fit needs the vehicle's own log: at \
         the rates of telemetry neither thrust nor delays can be found"
    )]
    NoTrace { name: String, found: &'static str },
    #[error("{name}")]
    Frame { name: String, source: RecordError },
    /// The log has no profile to build the controller from.
    #[error("{name}: has no attachment profile.toml, and without the profile the controller cannot be built")]
    NoProfile { name: String },
    /// This build cannot use the profile.
    #[error("{name}: its profile cannot be used by this build: {reason}")]
    ProfileUnusable { name: String, reason: String },
}

/// A flight, read from its log.
#[derive(Debug, Clone, Default)]
pub struct Recording {
    /// The file.
    pub name: String,
    /// Metadata and attachments of the log.
    pub head: Head,
    /// The start record of the flight computer at its release, where its frames and their times
    /// begin.
    pub start: Option<ComputerStart>,
    /// The log has the power-up: the digests of its frames cover what the computer remembers of the
    /// pad.
    pub from_power_up: bool,
    /// Its frames in flight, in file order: numbers and times count from the release.
    pub frames: Vec<ComputerFrame>,
    /// What is added to the number of a frame in flight for its number in the log, which counts
    /// from power-up and is the one that people read.
    pub release_frame: u64,
    /// The computer at its release, run from its power-up on; see
    /// [`RecordingReader::of`].
    pub(crate) at_release: Option<Box<LoggedComputer>>,
    /// Number of frames before the first lost one.
    pub frames_unbroken: usize,
    /// Solve times of planning frames, in file order; empty for a flight simulated without a clock.
    pub timings: Vec<flight_v1::PilotTiming>,
    /// The flight computer's estimates in flight, each with the place of its frame in `frames`.
    pub estimates: Vec<(usize, flight_v1::Estimate)>,
    /// Its simulated world, in file order.
    pub world: Vec<flight_v1::TruthSample>,
    /// The values that a ground station knew, in file order.
    pub telemetry: Vec<v1::Telemetry>,
    /// Events, with log time in seconds after the first record.
    pub events: Vec<(f64, EventRecord)>,
    /// The landing verdict, recorded or received.
    pub verdict: Option<Verdict>,
    /// How the clocks of the log differ.
    pub clocks: Clocks,
    /// When the log ends, ns of Unix time.
    pub last_ns: Option<u64>,
    /// Why the log could not be read to its end, if so.
    pub damage: Option<String>,
    /// Where the record ends, if that is before the end of the flight.
    pub cut: Option<Cut>,
    /// Why the first unreadable record could not be read.
    pub unreadable: Option<String>,
}

impl Recording {
    /// Reads a log file.
    ///
    /// # Errors
    /// The file is not a flight log, cannot be read, holds several flights or is longer than any
    /// flight. Damage is not an error.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        Self::read(&mut FlightLog::open(path)?)
    }

    /// Reads a log to its end.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn read<R: Read>(log: &mut FlightLog<R>) -> Result<Self, RecordingError> {
        let mut reader = RecordingReader::of(log, false);
        while let Some(stamped) = log.next_entry()? {
            reader.take(stamped, log)?;
        }
        reader.finish(log)
    }

    fn check_length(&self) -> Result<(), RecordingError> {
        let Self { frames, timings, estimates, world, telemetry, events, .. } = self;
        let lengths =
            [frames.len(), timings.len(), estimates.len(), world.len(), telemetry.len(), events.len()];
        match lengths.into_iter().max().filter(|most| *most > RECORDS_MAX) {
            Some(_) => Err(RecordingError::TooLong { name: self.name.clone(), kind: "records of a kind" }),
            None => Ok(()),
        }
    }

    /// Time of contact on the clock of its frames, or of its telemetry, s.
    pub fn contact_s(&self) -> Option<f64> {
        let Verdict { time_s, clock, .. } = self.verdict.as_ref()?;
        if *clock == Clock::Flight {
            return Some(*time_s);
        }
        let Clocks { boot_zero_s, telemetry_zero_s, .. } = self.clocks;
        Some(time_s + boot_zero_s.unwrap_or(0.0) - telemetry_zero_s.unwrap_or(0.0))
    }

    /// The start record and all frames.
    ///
    /// # Errors
    /// The log has no frames or no start record.
    pub fn recorded_frames(&self) -> Result<(&ComputerStart, &[ComputerFrame]), RecordingError> {
        match &self.start {
            Some(start) if !self.frames.is_empty() => Ok((start, &self.frames)),
            _ => {
                Err(RecordingError::NoFrames { name: self.name.clone(), unreadable: self.unreadable.clone() })
            }
        }
    }

    /// The start record and the frames that can be re-executed: those before the first lost one.
    ///
    /// # Errors
    /// The log has no frames or no start record.
    pub fn replayable_frames(&self) -> Result<(&ComputerStart, &[ComputerFrame]), RecordingError> {
        let (start, frames) = self.recorded_frames()?;
        match (frames.get(..self.frames_unbroken), frames.first()) {
            (Some([]), Some(first)) => Err(RecordingError::BeginningLost {
                name: self.name.clone(),
                first: self.release_frame + first.input.frame,
            }),
            (unbroken, _) => Ok((start, unbroken.unwrap_or(frames))),
        }
    }

    /// A frame in flight as it was logged: number and time count from power-up.
    pub(crate) fn since_power_up(&self, frame: &ComputerFrame) -> ComputerFrame {
        let mut logged = frame.clone();
        logged.input.frame += self.release_frame;
        logged.input.time_s = flight_time_s(logged.input.frame);
        logged
    }

    /// Where re-execution must stop, if the log has frames after that.
    pub fn gap(&self) -> Option<Gap> {
        let number =
            |place: usize| self.frames.get(place).map(|frame| self.release_frame + frame.input.frame);
        let before = number(self.frames_unbroken)?;
        let after = self.frames_unbroken.checked_sub(1).and_then(number).unwrap_or(0);
        Some(Gap { after, before })
    }

    /// The text of the profile that was flown.
    ///
    /// # Errors
    /// The log has no profile, or it is not text.
    pub fn profile_toml(&self) -> Result<&str, RecordingError> {
        match &self.head.profile_toml {
            None => Err(RecordingError::NoProfile { name: self.name.clone() }),
            Some(Ok(text)) => Ok(text),
            Some(Err(error)) => {
                Err(RecordingError::ProfileUnusable { name: self.name.clone(), reason: error.to_string() })
            }
        }
    }
}

/// Collects the recording of a flight from the records of its log.
pub(crate) struct RecordingReader {
    recording: Recording,
    order: FrameOrder,
    frames_lost: Option<usize>,
    runs_the_pad: bool,
}

impl RecordingReader {
    /// `runs_the_pad`: the computer is run from its power-up to its release; one that is built at
    /// its release lacks what the pad left in the memory of the recorded one.
    pub(crate) fn of<R: Read>(log: &FlightLog<R>, runs_the_pad: bool) -> Self {
        let recording = Recording { name: log.name().to_owned(), ..Recording::default() };
        Self { recording, order: FrameOrder::default(), frames_lost: None, runs_the_pad }
    }

    /// Takes the next record of the log.
    ///
    /// # Errors
    /// There are more than in any flight.
    pub(crate) fn take<R: Read>(
        &mut self,
        stamped: StampedEntry,
        log: &FlightLog<R>,
    ) -> Result<(), RecordingError> {
        let Self { recording, order: frame_order, frames_lost, runs_the_pad } = self;
        match stamped.entry {
            Entry::PilotTiming(timing) => recording.timings.push(*timing),
            Entry::World(sample) => recording.world.push(*sample),
            Entry::Telemetry(telemetry) => recording.telemetry.push(*telemetry),
            Entry::Event(event) => {
                recording.events.push((log.since_first_s(stamped.log_time_ns), *event));
            }
            Entry::Unreadable { reason } => {
                recording.unreadable.get_or_insert(reason);
            }
            // A start record without frames after it says nothing.
            Entry::ComputerStart(start) if start.released && recording.frames.is_empty() => {
                recording.start = Some(ComputerStart { frame: 0, ..*start });
            }
            Entry::ComputerFrame(frame) => {
                let lost = frame_order.note(frame.record.input.frame, stamped.lost_before).is_some();
                let logged = frame.record.input.frame;
                if let Some(computer) = &mut recording.at_release
                    && recording.frames.is_empty()
                    && frame.since_release.is_none()
                {
                    let again = computer.run_again(&frame.record).ok().filter(|_| !lost);
                    if again.is_none_or(|again| again.output != frame.record.output) {
                        recording.at_release = None;
                    }
                }
                if let Some(frame) = frame.in_flight() {
                    recording.release_frame = logged - frame.input.frame;
                    // What is lost before the release is not of the flight.
                    if lost && frame.input.frame > 1 {
                        frames_lost.get_or_insert(recording.frames.len());
                    }
                    recording.frames.push(frame);
                }
            }
            Entry::ComputerStart(start) => {
                recording.from_power_up |= !start.released;
                let head = log.head();
                if let (Some(Ok(toml)), true) = (&head.profile_toml, *runs_the_pad && !start.released) {
                    let computer = LoggedComputer::recorded(toml, &start, &head.run, &[]);
                    recording.at_release = computer.ok().map(Box::new);
                }
            }
            Entry::Estimate(estimate) => {
                let place = recording.frames.len().checked_sub(1);
                recording.estimates.extend(place.map(|place| (place, *estimate)));
            }
            Entry::Verdict(_) | Entry::RawFrame | Entry::Operator | Entry::Other => {}
        }
        recording.check_length()
    }

    /// The flight of a log that was read to its end.
    ///
    /// # Errors
    /// It has several.
    pub(crate) fn finish<R: Read>(self, log: &FlightLog<R>) -> Result<Recording, RecordingError> {
        let Self { mut recording, frames_lost, .. } = self;
        log.flights.refuse_several(&recording.name)?;
        recording.cut = log.flights.cut();
        recording.clocks = log.clocks;
        recording.verdict = log.verdict();
        recording.head = log.head().clone();
        recording.last_ns = log.last_log_time_ns;
        recording.damage = log.damage().map(ToString::to_string);
        recording.frames_unbroken = frames_lost.unwrap_or(recording.frames.len());
        Ok(recording)
    }
}
