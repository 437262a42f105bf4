//! Exports a log into a recording, record by record.

use std::collections::VecDeque;
use std::io::{Read, Write};

use flight::guidance::powered::ControlLevel;
use protocol::log::flight_v1::TruthSample;
use protocol::log::v1::{LandingVerdict as RecordedVerdict, Telemetry};
use replay::log::LoggedFrame;
use replay::log::{Entry, FlightLog, StampedEntry};
use rerun::{RecordingStream, RecordingStreamResult};

use crate::ExportError;
use crate::again::{Again, FrameAgain};
use crate::identity;
use crate::layout::send_layout;
use crate::plot_list::{Plot, limits_of, plots_of};
use crate::plots::{Plots, Whose};
use crate::pose::{
    Pose, rocket_from_nozzle, rocket_from_nozzle_in_space, world_from_rocket_in_space, world_from_telemetry,
};
use crate::rrd::{Batches, RrdWriter};
use crate::scene::{Extent, Scene, Seen};
use crate::survey::{PoseSource, StampedEvent, Survey};
use crate::times::Times;
use crate::words;

/// Summary of an export.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Exported {
    /// Frames of the flight computer.
    pub ticks: u64,
    /// Records that carry the pose of the rocket.
    pub poses: u64,
    pub events: u64,
    /// Events that were left out: unreadable, or too many.
    pub events_left_out: u64,
    /// Flight records that this build cannot read; not exported.
    pub unreadable: u64,
    /// Why the first of them cannot be read.
    pub first_unreadable: Option<String>,
    /// Why this build cannot use the log's profile, if so.
    pub profile_problem: Option<String>,
    /// What ended the reading early.
    pub damage: Option<String>,
}

/// When a log is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pace {
    /// After the flight; the survey has seen all of it.
    Afterwards,
    /// While it is being written; the survey has seen its beginning.
    Live,
}

/// Writes the recording of a log to any output.
///
/// # Errors
/// The log cannot be used, or the recording cannot be written.
pub fn export<R: Read, W: Write + Send + 'static>(
    log: &mut FlightLog<R>,
    survey: &Survey,
    output: W,
) -> Result<(Exported, W), ExportError> {
    let writer = RrdWriter::new(identity::builder(log.name(), survey), output, Batches::Large)?;
    let exported = fill(writer.recording(), log, survey, Pace::Afterwards)?;
    Ok((exported, writer.finish()?))
}

/// Writes two flights into one recording: the second one in other colours, below the first one's entities, on the same
/// clock. What was done with the second log is the second answer.
///
/// # Errors
/// As [`export`].
pub fn export_two<R: Read, W: Write + Send + 'static>(
    (log, survey): (&mut FlightLog<R>, &Survey),
    (other, other_survey): (&mut FlightLog<R>, &Survey),
    output: W,
) -> Result<(Exported, Exported, W), ExportError> {
    let builder = || identity::builder(log.name(), survey);
    let writer = RrdWriter::new(builder(), output, Batches::Large)?;
    let below = writer.beside(builder())?;
    let (of_other, beside) =
        Export::new(&below, other_survey, Whose::Beside, Pace::Afterwards)?.run(other)?;
    below.flush_blocking().map_err(|error| ExportError::Encode { reason: error.to_string() })?;
    let recording = writer.recording();
    let (done, own) = Export::new(recording, survey, Whose::Own, Pace::Afterwards)?.run(log)?;
    let shown = Shown { extent: own.extent.around(&beside.extent), ..own };
    shown.send(recording)?;
    Ok((done, of_other, writer.finish()?))
}

/// Fills a recording with a log.
pub(crate) fn fill<R: Read>(
    recording: &RecordingStream,
    log: &mut FlightLog<R>,
    survey: &Survey,
    pace: Pace,
) -> Result<Exported, ExportError> {
    let (done, shown) = Export::new(recording, survey, Whose::Own, pace)?.run(log)?;
    shown.send(recording)?;
    Ok(done)
}

/// What the layout depends on.
pub(crate) struct Shown {
    extent: Extent,
    plots: Vec<&'static Plot>,
    phases_as_text: bool,
}

impl Shown {
    /// Everything that a flight may have, in the space where it is expected.
    pub(crate) fn expected(survey: &Survey) -> Self {
        Self {
            extent: Extent::expected(survey),
            plots: plots_of(survey).iter().collect(),
            phases_as_text: true,
        }
    }

    pub(crate) fn send(&self, recording: &RecordingStream) -> RecordingStreamResult<()> {
        send_layout(recording, identity::APPLICATION, &self.extent, &self.plots, self.phases_as_text)
    }
}

/// An export in progress.
struct Export<'a> {
    recording: &'a RecordingStream,
    survey: &'a Survey,
    whose: Whose,
    pace: Pace,
    /// The best source of the pose so far.
    pose_source: PoseSource,
    waiting: VecDeque<StampedEvent>,
    times: Times,
    scene: Scene<'a>,
    plots: Plots<'a>,
    again: Again,
    /// Whether the flight computer, run again, currently follows a plan.
    planning: bool,
    verdict: Option<RecordedVerdict>,
    done: Exported,
}

impl<'a> Export<'a> {
    fn new(
        recording: &'a RecordingStream,
        survey: &'a Survey,
        whose: Whose,
        pace: Pace,
    ) -> Result<Self, ExportError> {
        Ok(Self {
            recording,
            survey,
            whose,
            pace,
            pose_source: survey.pose_source,
            // A log that is being written tells its events one by one.
            waiting: if pace == Pace::Live { VecDeque::new() } else { survey.events.clone().into() },
            times: Times::default(),
            scene: Scene::new(recording, survey, whose)?,
            plots: Plots::new(recording, whose),
            again: Again::default(),
            planning: false,
            verdict: None,
            done: Exported {
                events_left_out: survey.events_left_out,
                profile_problem: survey.profile_problem.clone(),
                ..Exported::default()
            },
        })
    }

    fn run<R: Read>(mut self, log: &mut FlightLog<R>) -> Result<(Exported, Shown), ExportError> {
        while let Some(StampedEntry { entry, log_time_ns, sequence, .. }) = log.next_entry()? {
            if self.times.known() {
                self.events_until(log_time_ns)?;
            }
            self.pose_source = self.pose_source.max(source_of(&entry));
            match entry {
                Entry::Telemetry(telemetry) => self.telemetry(&telemetry, log_time_ns)?,
                Entry::Verdict(verdict) => {
                    self.times.at_vehicle_time(self.recording, verdict.time_s);
                    words::verdict(self.recording, &verdict)?;
                    self.verdict = Some(*verdict);
                }
                Entry::Unreadable { reason } => {
                    self.done.unreadable += 1;
                    self.done.first_unreadable.get_or_insert(reason);
                }
                Entry::ComputerStart(start) => self.again.start(self.survey, &start),
                Entry::ComputerFrame(frame) => self.frame(&frame, sequence, log_time_ns)?,
                Entry::PilotTiming(timing) => {
                    self.times.learn(timing.time_s, log_time_ns);
                    self.times.at_vehicle_time(self.recording, timing.time_s);
                    self.plots.timing(&timing)?;
                }
                Entry::World(truth) => self.world(&truth, log_time_ns)?,
                Entry::Event(event) if self.pace == Pace::Live => {
                    self.waiting.push_back(StampedEvent::of(&event, log_time_ns));
                }
                Entry::Estimate(_) | Entry::RawFrame | Entry::Operator | Entry::Event(_) | Entry::Other => {}
            }
        }
        self.events_until(u64::MAX)?;
        self.done.damage = log.damage().map(ToString::to_string);
        if let Some(span) = self.times.span().filter(|_| self.whose == Whose::Own) {
            self.plots.limits(&limits_of(self.survey, self.verdict.as_ref()), span)?;
        }
        let Self { recording, survey, scene, verdict, plots, again, done, .. } = self;
        let again = again.words();
        let remarks = words::Remarks { damage: done.damage.as_deref(), again: again.as_deref() };
        words::report(recording, log.name(), survey, verdict.as_ref(), remarks)?;
        let extent = scene.finish()?;
        let plots = plots_of(survey).iter().filter(|plot| plots.has(plot)).collect();
        Ok((
            done,
            Shown { extent, plots, phases_as_text: self.pace == Pace::Live || survey.events.is_empty() },
        ))
    }

    /// A frame of the flight computer; its values are plotted with the truth.
    fn frame(&mut self, frame: &LoggedFrame, record: u32, log_time_ns: u64) -> RecordingStreamResult<()> {
        let in_flight = frame.tick.zip(frame.flight_time_s());
        if let Some((tick, time_s)) = in_flight {
            self.times.learn(time_s, log_time_ns);
            self.times.tick(tick);
            self.times.at_vehicle_time(self.recording, time_s);
        }
        let flown = self.run_again(|again| again.frame(&frame.record, record))?;
        if in_flight.is_none() {
            return Ok(());
        }
        self.done.ticks += 1;
        self.phase(frame.record.output.phase)?;
        self.plots.level(frame.record.output.level)?;
        let Some(FrameAgain { tick: again, plan }) = flown else { return Ok(()) };
        self.plots.frame_again(&again, plan.as_ref().map(|(_, iterations)| *iterations))?;
        let planning = again.output.level != u32::from(ControlLevel::Idle.index());
        match plan {
            Some((path_m, _)) => self.scene.path(path_m, again.output.phase)?,
            // A plan that is no longer followed is no longer shown.
            None if self.planning && !planning => self.scene.path(Vec::new(), again.output.phase)?,
            None => {}
        }
        self.planning = planning;
        Ok(())
    }

    /// Runs the controller again, and records where it first differs or ends.
    fn run_again<T>(
        &mut self,
        run: impl FnOnce(&mut Again) -> Option<T>,
    ) -> RecordingStreamResult<Option<T>> {
        let before = (self.again.first_different, self.again.obstacle.is_some());
        let again = run(&mut self.again);
        if let (None, Some(frame)) = (before.0, self.again.first_different) {
            words::replay(self.recording, &format!("frame {frame}, run again, differs from the record"))?;
        }
        if let (false, Some(reason)) = (before.1, &self.again.obstacle) {
            words::replay(self.recording, &format!("from here on nothing is run again: {reason}"))?;
        }
        Ok(again)
    }

    fn world(&mut self, truth: &TruthSample, log_time_ns: u64) -> RecordingStreamResult<()> {
        self.times.learn(truth.time_s, log_time_ns);
        self.times.at_vehicle_time(self.recording, truth.time_s);
        self.plots.in_space(truth)?;
        let angle = |axis: usize| truth.gimbal_actual_rad.get(axis).copied().unwrap_or(0.0);
        let nozzle = rocket_from_nozzle_in_space([angle(0), angle(1)], self.scene.pivot_x_m());
        let weights = self.scene.in_weights(truth.thrust_n, truth.mass_kg);
        self.rocket(world_from_rocket_in_space(&truth.state), nozzle, Some(weights))
    }

    fn telemetry(&mut self, telemetry: &Telemetry, log_time_ns: u64) -> RecordingStreamResult<()> {
        self.times.learn(telemetry.time_s, log_time_ns);
        self.times.at_vehicle_time(self.recording, telemetry.time_s);
        let alone = self.pose_source == PoseSource::Telemetry;
        self.plots.telemetry(telemetry, alone)?;
        if !alone {
            return Ok(());
        }
        if let Some(phase) = telemetry.phase {
            self.phase(phase)?;
        }
        let (Some(z_m), Some(theta_rad)) = (telemetry.altitude_m, telemetry.pitch_rad) else {
            return Ok(());
        };
        let rocket = world_from_telemetry(telemetry.x_m.unwrap_or(0.0), z_m, theta_rad);
        let gimbal_rad = telemetry.gimbal_measured_rad.filter(|angle| angle.is_finite()).unwrap_or(0.0);
        let nozzle = rocket_from_nozzle(gimbal_rad, self.scene.pivot_x_m());
        self.rocket(rocket, nozzle, None)
    }

    fn rocket(
        &mut self,
        rocket: Pose,
        nozzle: Pose,
        thrust_in_weights: Option<f64>,
    ) -> RecordingStreamResult<()> {
        self.done.poses += 1;
        self.scene.rocket(&Seen { rocket, nozzle, thrust_in_weights })
    }

    fn phase(&mut self, phase: u32) -> RecordingStreamResult<()> {
        match self.plots.phase(phase)? {
            Some(name) => words::phase(self.recording, &name),
            None => Ok(()),
        }
    }

    /// Events have log time only, so they wait until log time can be converted to vehicle time.
    fn events_until(&mut self, log_time_ns: u64) -> RecordingStreamResult<()> {
        while let Some(event) = self.waiting.pop_front_if(|event| event.log_time_ns <= log_time_ns) {
            self.times.at_log_time(self.recording, event.log_time_ns);
            words::event(self.recording, &event)?;
            self.done.events += 1;
        }
        Ok(())
    }
}

/// The pose that a record brings.
fn source_of(entry: &Entry) -> PoseSource {
    match entry {
        Entry::World(_) => PoseSource::Truth,
        Entry::Telemetry(_) => PoseSource::Telemetry,
        _ => PoseSource::None,
    }
}
