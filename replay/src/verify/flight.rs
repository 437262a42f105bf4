//! Verifies one flight of a log, record by record.

use std::io::Read;

use avionics::log::frame::{estimate_to_log, start_to_log};
use protocol::log::computer_v1::ComputerStart;
use protocol::log::record::{
    TOPIC_ESTIMATE, TOPIC_EVENTS, TOPIC_PILOT_TIMING, TOPIC_TRANSFORM, TOPIC_TRUTH_SAMPLE,
};

use super::again::WorldAgain;
use super::difference::{Tally, encode_into};
use super::inputs::Inputs;
use super::parts::Part;
use super::{FlightPlace, Obstacle, VerifyReport};
use crate::controller::LoggedComputer;
use crate::log::{
    Cut, Entry, FlightLog, FrameOrder, Gap, Head, LogError, LoggedFrame, StampedEntry, misread_frame,
};

/// One flight being verified.
#[derive(Default)]
pub(super) struct FlightVerifier {
    /// Of what was read so far.
    report: VerifyReport,
    computer: Option<LoggedComputer>,
    /// The computer has begun at its power-up, and was not built again at its release.
    from_power_up: bool,
    /// The computer was built at a release, and remembers less than the recorded one.
    remembers_less: bool,
    order: FrameOrder,
    tally: Tally,
    inputs: Inputs,
    awaited: Awaited,
    parts: Parts,
    flies: bool,
    /// Why not every frame on the pad was compared.
    on_the_pad: Option<Obstacle>,
    /// Why some record could not be read.
    unreadable: Option<String>,
    /// Record of the verdict.
    verdict: Option<Vec<u8>>,
    /// Of a strict verification from the release on: the world, if the log is of a drawn flight, or
    /// why it cannot be drawn again.
    world: Option<Result<WorldAgain, String>>,
}

/// Records that must follow the last frame, as bytes; empty if none must.
#[derive(Default)]
struct Awaited {
    estimate: Vec<u8>,
    release: Vec<u8>,
}

/// What was compared beside the frames.
#[derive(Default)]
struct Parts {
    inputs: Part,
    digests: u64,
    estimates: Part,
    starts: Part,
    verdicts: u64,
    truth: u64,
    transforms: u64,
    events: u64,
    timing: u64,
}

impl FlightVerifier {
    /// A flight before its first record. `strict`: its world is drawn again. `behind_another`:
    /// another flight comes before it in the log. `unreadable`: why a record that may have been its
    /// beginning could not be read.
    pub(super) fn new(strict: bool, behind_another: bool, unreadable: Option<String>) -> Self {
        let order = if behind_another { FrameOrder::behind_another() } else { FrameOrder::default() };
        let report = VerifyReport { strict, ..VerifyReport::default() };
        Self { report, order, unreadable, ..Self::default() }
    }

    /// Takes a record of the flight.
    pub(super) fn take<R: Read>(
        &mut self,
        stamped: StampedEntry,
        log: &FlightLog<R>,
        complete_head: &impl Fn() -> Result<Head, LogError>,
    ) -> Result<(), LogError> {
        match stamped.entry {
            Entry::ComputerStart(start) => self.start(&start, &stamped.data, log, complete_head)?,
            Entry::ComputerFrame(frame) => self.check(&frame, &stamped.data, stamped.lost_before),
            Entry::Verdict(_) => {
                self.parts.verdicts += 1;
                self.verdict = Some(stamped.data);
            }
            Entry::Unreadable { reason } => {
                self.unreadable.get_or_insert(reason);
            }
            _ => match log.channel(stamped.channel_id).map(|channel| channel.topic.as_str()) {
                Some(TOPIC_ESTIMATE) => self.estimate(&stamped.data),
                Some(TOPIC_TRUTH_SAMPLE) => self.parts.truth += 1,
                Some(TOPIC_TRANSFORM) => self.parts.transforms += 1,
                Some(TOPIC_EVENTS) => self.parts.events += 1,
                Some(TOPIC_PILOT_TIMING) => self.parts.timing += 1,
                _ => {}
            },
        }
        Ok(())
    }

    /// Builds the computer: at power-up; or at the release, if there was no power-up or frames on
    /// the pad were lost. Then it remembers less, and digests are not compared.
    fn start<R: Read>(
        &mut self,
        start: &ComputerStart,
        data: &[u8],
        log: &FlightLog<R>,
        complete_head: &impl Fn() -> Result<Head, LogError>,
    ) -> Result<(), LogError> {
        let starts = &mut self.parts.starts;
        starts.recorded += u64::from(self.awaited.release.is_empty());
        let runs = self.computer.is_some() && self.report.obstacle.is_none();
        let goes_on = start.released && (runs || self.flies);
        if goes_on {
            if runs {
                starts.compare(self.awaited.release == data);
            }
            self.awaited.release.clear();
        }
        let draws = self.report.strict && self.world.is_none() && start.released;
        if goes_on && !draws {
            return Ok(());
        }
        let later;
        let head = if log.head().profile_toml.is_some() {
            log.head()
        } else {
            later = complete_head()?;
            &later
        };
        let toml = match &head.profile_toml {
            Some(Ok(text)) => text,
            _ if goes_on => return Ok(()),
            lacking => {
                let error = lacking.as_ref().and_then(|text| text.as_ref().err()).map(ToString::to_string);
                self.report.obstacle = Some(error.map_or(Obstacle::NoProfile, Obstacle::ProfileUnreadable));
                return Ok(());
            }
        };
        if draws {
            let drawn = WorldAgain::drawn(log.name(), head, toml, start);
            self.world = drawn.map_err(|error| error.to_string()).transpose();
        }
        if goes_on {
            return Ok(());
        }
        match LoggedComputer::recorded(toml, start, &head.run, &[]) {
            Ok(mut computer) => {
                // What it begins from decides what it does.
                self.parts.starts.compared += 1;
                self.remembers_less = start.released && (self.report.frames_recorded > 0 || start.frame > 0);
                computer.compares_digests = !self.remembers_less;
                self.computer = Some(computer);
                self.from_power_up = !start.released;
                self.report.from_power_up |= self.from_power_up;
                self.on_the_pad = self.report.obstacle.take();
                self.awaited.release.clear();
            }
            Err(error) => self.report.obstacle = Some(Obstacle::ProfileUnreadable(error.to_string())),
        }
        Ok(())
    }

    /// Runs a frame again and compares it; `data` are the bytes of its record.
    fn check(&mut self, frame: &LoggedFrame, data: &[u8], lost_before: u32) {
        self.report.frames_recorded += 1;
        self.flies |= frame.since_release.is_some();
        let number = frame.record.input.frame;
        let impossible = self.inputs.judge(&frame.record, frame.since_release);
        // The default of a missing field is no evidence.
        let impossible = impossible.filter(|_| misread_frame(data).is_none());
        self.parts.inputs.recorded += 1;
        self.parts.inputs.compare(impossible.is_none());
        if let Some(reason) = impossible {
            self.parts.inputs.why.get_or_insert_with(|| format!("frame {number}: {reason}"));
        }
        let lost = self.order.note(number, lost_before);
        // A computer that begins at its release can be run again behind a loss on the pad.
        let begins = !self.from_power_up && frame.since_release == Some(1);
        self.awaited.estimate.clear();
        if self.report.obstacle.is_some() {
            return;
        }
        let or_misread = |obstacle| Some(misread_frame(data).map_or(obstacle, Obstacle::Unreadable));
        let obstacle = match (lost.filter(|_| !begins), &mut self.computer) {
            (_, None) => or_misread(Obstacle::NoStart),
            (Some(Gap { after: 0, before }), _) => Some(Obstacle::BeginningMissing(before)),
            (Some(gap), _) => Some(Obstacle::Gap(gap)),
            (None, Some(computer)) => match computer.run_again(&frame.record) {
                Ok(again) => {
                    if let Err(reason) = self.tally.compare(&mut self.report, frame, data, &again) {
                        self.report.obstacle = Some(Obstacle::Unreadable(reason));
                        return;
                    }
                    self.parts.digests += u64::from(!self.remembers_less);
                    if again.output.released {
                        self.parts.starts.recorded += 1;
                        encode_into(&start_to_log(computer.computer()), &mut self.awaited.release);
                    }
                    if frame.since_release.is_some()
                        && let Some(estimate) = estimate_to_log(computer.pilot())
                    {
                        self.parts.estimates.recorded += 1;
                        encode_into(&estimate, &mut self.awaited.estimate);
                    }
                    if let Some(Ok(world)) = &mut self.world {
                        world.follow(frame, computer.computer());
                    }
                    None
                }
                Err(error) => or_misread(Obstacle::Frame(error)),
            },
        };
        self.report.obstacle = obstacle;
    }

    /// Compares the estimate after the last frame.
    fn estimate(&mut self, data: &[u8]) {
        let awaited = &mut self.awaited.estimate;
        if awaited.is_empty() {
            // It belongs to a frame that was not run again, or is there twice.
            self.parts.estimates.recorded += 1;
        } else {
            self.parts.estimates.compare(awaited == data);
            awaited.clear();
        }
    }

    /// The report on the flight, whose log was read to its end or to its damage.
    pub(super) fn into_report<R: Read>(
        self,
        log: &FlightLog<R>,
        flight: Option<FlightPlace>,
        cut: Option<Cut>,
    ) -> VerifyReport {
        let parts = self.parts(log.head());
        let compared = self.report.frames_compared;
        let obstacle = match (self.report.obstacle.or(self.on_the_pad), self.unreadable) {
            // An unreadable frame leaves a gap; the reason why it is unreadable says more than the
            // gap.
            (None | Some(Obstacle::Gap(_) | Obstacle::BeginningMissing(_)), Some(reason)) => {
                Some(Obstacle::Unreadable(reason))
            }
            // If nothing was compared, the result must not be "identical".
            (None, None) if compared == 0 && self.computer.is_some() => Some(Obstacle::NoFrames),
            (None, None) if compared == 0 => Some(Obstacle::NoComputer),
            (obstacle, _) => obstacle,
        };
        let head = log.head();
        let obstacle = match obstacle {
            Some(Obstacle::Unreadable(_) | Obstacle::NoComputer) => obstacle,
            _ if head.is_of_this_schema() => obstacle,
            _ => Some(Obstacle::Schema(head.schema_version().unwrap_or("none").to_owned())),
        };
        // Damage ends the reading, so it belongs to the last flight.
        let damage = log.damage().filter(|_| flight.is_none_or(|flight| flight.number == flight.of));
        let mut report = VerifyReport {
            file: log.name().to_owned(),
            flight,
            parts,
            counted: log.is_counted(),
            frames_identical: compared - self.report.frames_different,
            obstacle,
            cut,
            damage: damage.map(ToString::to_string),
            messages_lost: log.messages_lost(),
            build: head.compare_build(),
            ..self.report
        };
        report.conclude();
        if report.strict {
            report.compare_strictly(self.world, self.verdict.as_deref());
        }
        report
    }

    fn parts(&self, head: &Head) -> Vec<Part> {
        let Self { report, tally, parts, .. } = self;
        let frames = report.frames_recorded;
        let part = |name, compared, different| Part { compared, different, ..Part::of(name, frames) };
        let digests = part("digests", parts.digests, tally.digests_different);
        let remembers_less =
            "a computer that is run again from its release on does not remember what was before";
        let estimates = &parts.estimates;
        let missing = estimates.recorded.saturating_sub(estimates.compared);
        let why =
            (missing > 0).then(|| format!("{missing} are missing, or belong to no frame that was run again"));
        let alone = || "only --strict flies the flight again".to_owned();
        let flown = self.computer.as_ref().map(|computer| &computer.pilot().mission().name);
        let other = head.run.get("profile").zip(flown).filter(|(named, flown)| named != flown);
        let metadata = match other {
            Some((named, flown)) => Part { different: 1, ..Part::of("metadata", 1) }
                .because(format!("its run facts name the profile {named}, and it is {flown}")),
            None => Part::of("metadata", 1).because(alone()),
        };
        vec![
            Part {
                name: "inputs",
                follows: true,
                why: parts.inputs.why.clone().or_else(|| Some(JUDGED.to_owned())),
                ..parts.inputs.clone()
            },
            part("frames", report.frames_compared, report.frames_different),
            part("outputs", report.frames_compared, tally.outputs_different),
            if self.remembers_less { digests.because(remembers_less) } else { digests },
            Part { name: "estimates", why, follows: true, ..estimates.clone() },
            Part { name: "starts", follows: true, ..parts.starts.clone() },
            Part::of("verdict", parts.verdicts).because(alone()),
            metadata,
            Part::beside("truth", parts.truth),
            Part::beside("transforms", parts.transforms),
            Part::beside("events", parts.events),
            Part::beside("timing", parts.timing),
        ]
    }
}

/// The checks that an accepted input has passed.
const JUDGED: &str = "judged by range and step alone: what decides nothing can be another value inside both";
