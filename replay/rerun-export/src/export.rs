//! A log into a recording, record by record.

use std::io::{Read, Write};
use std::path::Path;

use flight::dynamics::PlanarState as FlightState;
use flight::verdict::{LandingVerdict, TouchdownLimits};
use protocol::log::flight_v1::{PilotTick, TruthSample};
use protocol::log::v1::{
    ControllerTick, LandingVerdict as RecordedVerdict, PlanarState, PlantTruth, Telemetry,
};
use re_sdk::{RecordingStream, RecordingStreamBuilder, RecordingStreamResult};
use replay::log::{Entry, FlightLog, StampedEntry};

use crate::ExportError;
use crate::layout::send_layout;
use crate::plots::{FROM_APOGEE, PLANAR, PlotLimit, Plots, plot_of_verdict};
use crate::pose::{
    Pose, rocket_from_nozzle, rocket_from_nozzle_in_space, world_from_rocket, world_from_rocket_in_space,
};
use crate::rrd::RrdWriter;
use crate::scene::{Scene, Seen};
use crate::survey::{PoseSource, StampedEvent, Survey};
use crate::times::Times;
use crate::words;

/// Recordings of one application share a layout in the viewer.
const APPLICATION: &str = "touchdown";

/// What was exported.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Exported {
    /// Controller ticks.
    pub ticks: u64,
    /// Records that carry the pose of the rocket.
    pub poses: u64,
    /// Events.
    pub events: u64,
    /// Events that were left out: unreadable, or too many.
    pub events_left_out: u64,
    /// Flight records that this build cannot read; not exported.
    pub unreadable: u64,
    /// Why the first of them cannot be read.
    pub first_unreadable: Option<String>,
    /// What keeps this build from using the log's profile.
    pub profile_problem: Option<String>,
    /// What ended the reading early.
    pub damage: Option<String>,
}

/// Writes the recording of a log to anywhere.
///
/// # Errors
/// The log cannot be used, or the recording cannot be written.
pub fn export<R: Read, W: Write + Send + 'static>(
    log: &mut FlightLog<R>,
    survey: &Survey,
    output: W,
) -> Result<(Exported, W), ExportError> {
    let writer = RrdWriter::new(builder(log.name(), survey), output)?;
    let exported = Export::new(writer.recording(), survey)?.run(log)?;
    Ok((exported, writer.finish()?))
}

/// The recording's identity: a log gives the same one every time, and two runs never share one.
fn builder(log_name: &str, survey: &Survey) -> RecordingStreamBuilder {
    let stem = Path::new(log_name).file_stem().map_or(log_name.into(), |stem| stem.to_string_lossy());
    let start_ns = survey.start_unix_ns();
    let id =
        start_ns.map_or_else(|| format!("recorded-{stem}"), |start_ns| format!("recorded-{start_ns}-{stem}"));
    let builder = RecordingStreamBuilder::new(APPLICATION)
        .enabled(true)
        .recording_id(id)
        .recording_name(format!("{stem} (recorded)"))
        .send_properties(true);
    match start_ns.and_then(|start_ns| i64::try_from(start_ns).ok()) {
        Some(start_ns) => builder.recording_started(start_ns),
        None => builder,
    }
}

/// An export under way.
struct Export<'a> {
    recording: &'a RecordingStream,
    survey: &'a Survey,
    waiting: std::iter::Peekable<std::slice::Iter<'a, StampedEvent>>,
    times: Times,
    scene: Scene<'a>,
    plots: Plots<'a>,
    verdict: Option<RecordedVerdict>,
    done: Exported,
}

impl<'a> Export<'a> {
    fn new(recording: &'a RecordingStream, survey: &'a Survey) -> Result<Self, ExportError> {
        Ok(Self {
            recording,
            survey,
            waiting: survey.events.iter().peekable(),
            times: Times::default(),
            scene: Scene::new(recording, survey)?,
            plots: Plots::new(recording),
            verdict: None,
            done: Exported {
                events_left_out: survey.events_left_out,
                profile_problem: survey.profile_problem.clone(),
                ..Exported::default()
            },
        })
    }

    fn run<R: Read>(mut self, log: &mut FlightLog<R>) -> Result<Exported, ExportError> {
        while let Some(StampedEntry { entry, log_time_ns, .. }) = log.next_entry()? {
            if self.times.known() {
                self.events_until(log_time_ns)?;
            }
            match entry {
                Entry::Tick(tick) => self.tick(&tick, log_time_ns)?,
                Entry::Truth(truth) => self.truth(&truth, log_time_ns)?,
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
                Entry::PilotTick(tick) => self.frame(&tick, log_time_ns)?,
                Entry::World(truth) => self.world(&truth, log_time_ns)?,
                Entry::PilotStart(_) | Entry::RawFrame | Entry::Operator | Entry::Event(_) | Entry::Other => {
                }
            }
        }
        self.events_until(u64::MAX)?;
        self.done.damage = log.damage().map(ToString::to_string);
        if let Some(span) = self.times.span() {
            self.plots.limits(&self.limits(), span)?;
        }
        let Self { recording, survey, scene, verdict, done, .. } = self;
        words::report(recording, log.name(), survey, verdict.as_ref(), done.damage.as_deref())?;
        let extent = scene.finish()?;
        let plots = if survey.from_apogee { &FROM_APOGEE } else { &PLANAR };
        send_layout(recording, APPLICATION, &extent, plots, survey.events.is_empty())?;
        Ok(done)
    }

    fn tick(&mut self, tick: &ControllerTick, log_time_ns: u64) -> RecordingStreamResult<()> {
        self.times.learn(tick.input.time_s, log_time_ns);
        self.times.tick(tick.input.tick);
        self.times.at_vehicle_time(self.recording, tick.input.time_s);
        self.done.ticks += 1;
        self.phase(tick.input.phase)?;
        let alone = self.survey.pose_source == PoseSource::Estimate;
        self.plots.tick(tick, alone)?;
        self.scene.plan(tick)?;
        if alone {
            let gimbal_rad = Some(tick.input.gimbal_applied_rad);
            self.planar_rocket(&tick.input.state, gimbal_rad, None)?;
        }
        Ok(())
    }

    fn truth(&mut self, truth: &PlantTruth, log_time_ns: u64) -> RecordingStreamResult<()> {
        self.times.learn(truth.time_s, log_time_ns);
        self.times.at_vehicle_time(self.recording, truth.time_s);
        self.phase(truth.phase)?;
        self.plots.truth(truth)?;
        let weights = self.scene.in_weights(truth.thrust_n, truth.mass_kg);
        self.planar_rocket(&truth.state, Some(truth.gimbal_actual_rad), Some(weights))
    }

    /// A frame of a flight from apogee; its numbers stand beside the truth.
    fn frame(&mut self, tick: &PilotTick, log_time_ns: u64) -> RecordingStreamResult<()> {
        self.times.learn(tick.input.time_s, log_time_ns);
        self.times.tick(tick.input.frame);
        self.times.at_vehicle_time(self.recording, tick.input.time_s);
        self.done.ticks += 1;
        self.phase(tick.output.phase)?;
        self.plots.level(tick.output.level)
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
        let alone = self.survey.pose_source == PoseSource::Telemetry;
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
        let x_m = telemetry.x_m.unwrap_or(0.0);
        let state = PlanarState { x_m, z_m, theta_rad, ..PlanarState::default() };
        let gimbal_rad = telemetry.gimbal_measured_rad;
        self.planar_rocket(&state, gimbal_rad, None)
    }

    fn planar_rocket(
        &mut self,
        state: &PlanarState,
        gimbal_rad: Option<f64>,
        thrust_in_weights: Option<f64>,
    ) -> RecordingStreamResult<()> {
        let gimbal_rad = gimbal_rad.filter(|angle| angle.is_finite()).unwrap_or(0.0);
        let nozzle = rocket_from_nozzle(gimbal_rad, self.scene.pivot_x_m());
        self.rocket(world_from_rocket(state), nozzle, thrust_in_weights)
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

    /// Events carry the log's time only, so they wait until that can be told in vehicle time.
    fn events_until(&mut self, log_time_ns: u64) -> RecordingStreamResult<()> {
        while let Some(event) = self.waiting.next_if(|event| event.log_time_ns <= log_time_ns) {
            self.times.at_log_time(self.recording, event.log_time_ns);
            words::event(self.recording, event)?;
            self.done.events += 1;
        }
        Ok(())
    }

    /// The limits a landing is judged by, as recorded with the verdict or else by the profile, and the gimbal's.
    fn limits(&self) -> Vec<PlotLimit> {
        let profile = self.survey.profile.as_ref();
        let limit = |name: &str, lowest, highest| {
            plot_of_verdict(name).map(|plot| PlotLimit { plot, lowest, highest })
        };
        let mut limits: Vec<PlotLimit> = match (&self.verdict, profile) {
            (Some(verdict), _) => verdict
                .limits
                .iter()
                .filter_map(|judged| limit(&judged.name, judged.minimum, judged.maximum))
                .collect(),
            (None, Some(profile)) => {
                let judged =
                    LandingVerdict::judge(&TouchdownLimits::from_profile(profile), &FlightState::default());
                judged
                    .results
                    .iter()
                    .filter_map(|judged| limit(judged.name, judged.lowest, judged.highest))
                    .collect()
            }
            (None, None) => Vec::new(),
        };
        if let Some(mission) = &self.survey.mission {
            let limit_deg = mission.airframe.gimbal.limit_rad().to_degrees();
            for plot in ["gimbal_pitch_deg", "gimbal_yaw_deg"] {
                limits.push(PlotLimit { plot, lowest: -limit_deg, highest: limit_deg });
            }
        }
        if let Some(profile) = profile {
            let limit_deg = profile.gimbal.limit_deg;
            limits.push(PlotLimit { plot: "gimbal_deg", lowest: -limit_deg, highest: limit_deg });
        }
        limits
    }
}
