//! Records values over time, with their limits.

use std::collections::BTreeSet;

use flight::guidance::powered::ControlLevel;
use flight::rules::phase::Phase;
use flight_log::estimate::state_from_log;
use protocol::log::computer_v1::ComputerFrame;
use protocol::log::flight_v1::{PilotTiming, TruthSample};
use protocol::log::v1::Telemetry;
use rerun::archetypes::{Scalars, SeriesLines, StateChange};
use rerun::components::InterpolationMode;
use rerun::datatypes::Rgba32;
use rerun::{RecordingStream, RecordingStreamResult};

use crate::entity;
use crate::plot_list::{GIMBAL_IN_SPACE, Plot, PlotLimit};
use crate::pose::pitch_error_deg;
use crate::times::{Instant, Times};

const BLUE: Rgba32 = Rgba32::from_rgb(92, 170, 255);
const ORANGE: Rgba32 = Rgba32::from_rgb(255, 176, 59);
const GREEN: Rgba32 = Rgba32::from_rgb(120, 200, 130);
const VIOLET: Rgba32 = Rgba32::from_rgb(190, 150, 255);
const RED: Rgba32 = Rgba32::from_rgb(200, 70, 70);
const PINK: Rgba32 = Rgba32::from_rgb(255, 120, 190);
const BROWN: Rgba32 = Rgba32::from_rgb(190, 130, 90);
const TURQUOISE: Rgba32 = Rgba32::from_rgb(80, 200, 200);

/// Which of two flights in one recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Whose {
    /// The flight that the recording is of.
    Own,
    /// The one that is drawn beside it.
    Beside,
}

/// The source of a line in a plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Line {
    Truth,
    Telemetry,
    Commanded,
    Actual,
    Measured,
    Replayed,
    Deadline,
    Lowest,
    Highest,
}

impl Line {
    fn name(self) -> &'static str {
        match self {
            Self::Truth => "true",
            Self::Telemetry => "telemetry",
            Self::Commanded => "commanded",
            Self::Actual => "actual",
            Self::Measured => "controller",
            Self::Replayed => "replayed",
            Self::Deadline => "deadline",
            Self::Lowest => "limit_low",
            Self::Highest => "limit_high",
        }
    }

    fn style(self, whose: Whose) -> SeriesLines {
        let (own, beside, width) = match self {
            Self::Truth | Self::Actual | Self::Measured => (BLUE, PINK, 1.5),
            Self::Commanded => (ORANGE, BROWN, 1.0),
            Self::Telemetry => (GREEN, TURQUOISE, 1.0),
            Self::Replayed => (VIOLET, BROWN, 0.75),
            Self::Deadline | Self::Lowest | Self::Highest => (RED, RED, 0.75),
        };
        let (color, name) = match whose {
            Whose::Own => (own, self.name().to_owned()),
            Whose::Beside => (beside, format!("{} (beside)", self.name())),
        };
        let style = SeriesLines::new().with_colors([color]).with_widths([width]).with_names([name]);
        // The decision of a frame holds until the next one.
        let steps = matches!(self, Self::Commanded | Self::Measured | Self::Replayed);
        if steps { style.with_interpolation_mode(InterpolationMode::StepAfter) } else { style }
    }
}

/// The plots being recorded.
pub(crate) struct Plots<'a> {
    recording: &'a RecordingStream,
    whose: Whose,
    styled: BTreeSet<String>,
    level: Option<u32>,
    level_replayed: Option<u32>,
    phase: Option<u32>,
}

impl<'a> Plots<'a> {
    pub(crate) fn new(recording: &'a RecordingStream, whose: Whose) -> Self {
        Self { recording, whose, styled: BTreeSet::new(), level: None, level_replayed: None, phase: None }
    }

    /// Records the true state, and the commands to its servos.
    pub(crate) fn in_space(&mut self, truth: &TruthSample) -> RecordingStreamResult<()> {
        let (at, moving) = (&truth.state.position_m, &truth.state.velocity_m_s);
        let degrees = |angles_rad: &[f64], axis: usize| angles_rad.get(axis).copied().map(f64::to_degrees);
        self.draw("altitude_m", Line::Truth, truth.height_m)?;
        self.draw("x_m", Line::Truth, at.x)?;
        self.draw("y_m", Line::Truth, at.y)?;
        self.draw("vertical_m_s", Line::Truth, moving.z)?;
        self.draw("lateral_m_s", Line::Truth, libm::hypot(moving.x, moving.y))?;
        self.draw("tilt_deg", Line::Truth, state_from_log(&truth.state).tilt_rad().to_degrees())?;
        self.draw("thrust_n", Line::Truth, truth.thrust_n)?;
        for (axis, plot) in GIMBAL_IN_SPACE.into_iter().enumerate() {
            self.maybe(plot, Line::Commanded, degrees(&truth.gimbal_commanded_rad, axis))?;
            self.maybe(plot, Line::Actual, degrees(&truth.gimbal_actual_rad, axis))?;
        }
        self.maybe("fins_mean_deg", Line::Commanded, mean_deg(&truth.fins_commanded_rad))?;
        self.maybe("fins_mean_deg", Line::Actual, mean_deg(&truth.fins_actual_rad))
    }

    /// Records what the ground station knows. `alone`: the log has no better source.
    pub(crate) fn telemetry(&mut self, telemetry: &Telemetry, alone: bool) -> RecordingStreamResult<()> {
        let degrees = |angle: Option<f64>| angle.map(f64::to_degrees);
        let line = Line::Telemetry;
        self.maybe("altitude_m", line, telemetry.altitude_m)?;
        self.maybe("x_m", line, telemetry.x_m)?;
        self.maybe("u_m_s", line, telemetry.u_m_s)?;
        self.maybe("w_m_s", line, telemetry.w_m_s)?;
        self.maybe("pitch_error_deg", line, telemetry.pitch_rad.map(pitch_error_deg))?;
        self.maybe("q_deg_s", line, degrees(telemetry.q_rad_s))?;
        if alone {
            self.maybe("gimbal_deg", Line::Commanded, degrees(telemetry.gimbal_commanded_rad))?;
            self.maybe("gimbal_deg", Line::Actual, degrees(telemetry.gimbal_measured_rad))?;
            self.maybe("solve_time_ms", Line::Measured, telemetry.solve_time_s.map(|time_s| 1e3 * time_s))?;
            self.maybe("iterations", Line::Measured, telemetry.iterations.map(f64::from))?;
            self.maybe("level", Line::Measured, telemetry.control_level.map(f64::from))?;
            if let Some(level) = telemetry.control_level {
                self.level(level)?;
            }
        }
        Ok(())
    }

    /// Records the current phase; returns its name if it changed.
    pub(crate) fn phase(&mut self, phase: u32) -> RecordingStreamResult<Option<String>> {
        if self.phase == Some(phase) {
            return Ok(None);
        }
        self.phase = Some(phase);
        let known = u8::try_from(phase).ok().and_then(Phase::from_index).map(Phase::name);
        let name = known.map_or_else(|| format!("unknown ({phase})"), str::to_owned);
        self.recording.log(entity::PHASE, &StateChange::single(name.clone()))?;
        Ok(Some(name))
    }

    /// Limits as straight lines over the whole recording.
    pub(crate) fn limits(
        &mut self,
        limits: &[PlotLimit],
        (first, last): (Instant, Instant),
    ) -> RecordingStreamResult<()> {
        for end in [first, last] {
            Times::at_instant(self.recording, end);
            for limit in limits {
                self.draw(limit.plot, Line::Lowest, limit.lowest)?;
                self.draw(limit.plot, Line::Highest, limit.highest)?;
            }
        }
        Ok(())
    }

    /// Records the current control level.
    pub(crate) fn level(&mut self, level: u32) -> RecordingStreamResult<()> {
        if self.level.replace(level) == Some(level) {
            return Ok(());
        }
        self.recording.log(entity::LEVEL, &level_state(level))
    }

    fn replayed_level(&mut self, level: u32) -> RecordingStreamResult<()> {
        if self.level_replayed.replace(level) == Some(level) {
            return Ok(());
        }
        self.recording.log(entity::LEVEL_REPLAYED, &level_state(level))
    }

    /// Records the decision of a re-run frame of a flight computer, and the iterations of its plan.
    pub(crate) fn frame_again(
        &mut self,
        again: &ComputerFrame,
        iterations: Option<usize>,
    ) -> RecordingStreamResult<()> {
        let output = &again.output;
        for (plot, angle_rad) in GIMBAL_IN_SPACE.into_iter().zip(&output.gimbal_rad) {
            self.draw(plot, Line::Replayed, angle_rad.to_degrees())?;
        }
        self.maybe("fins_mean_deg", Line::Replayed, mean_deg(&output.fins_rad))?;
        self.maybe("iterations", Line::Replayed, iterations.map(|count| count as f64))?;
        self.replayed_level(output.level)
    }

    /// Records the solve time of a planning frame.
    pub(crate) fn timing(&mut self, timing: &PilotTiming) -> RecordingStreamResult<()> {
        self.draw("solve_time_ms", Line::Measured, 1e3 * timing.solve_time_s)?;
        self.draw("solve_time_ms", Line::Deadline, 1e3 * timing.deadline_s)
    }

    /// Whether a plot has a line.
    pub(crate) fn has(&self, plot: &Plot) -> bool {
        let below = format!("{}/{}/", entity::PLOTS, plot.name);
        self.styled.iter().any(|path| path.starts_with(&below))
    }

    fn maybe(&mut self, plot: &str, line: Line, value: Option<f64>) -> RecordingStreamResult<()> {
        value.map_or(Ok(()), |value| self.draw(plot, line, value))
    }

    fn draw(&mut self, plot: &str, line: Line, value: f64) -> RecordingStreamResult<()> {
        let path = format!("{}/{plot}/{}", entity::PLOTS, line.name());
        if !self.styled.contains(&path) {
            self.recording.log_static(path.as_str(), &line.style(self.whose))?;
            self.styled.insert(path.clone());
        }
        self.recording.log(path, &Scalars::single(value))
    }
}

fn level_state(level: u32) -> StateChange {
    let known = u8::try_from(level).ok().and_then(ControlLevel::from_index).map(ControlLevel::name);
    StateChange::single(known.map_or_else(|| format!("unknown ({level})"), str::to_owned))
}

fn mean_deg(angles_rad: &[f64]) -> Option<f64> {
    let sum_rad: f64 = angles_rad.iter().sum();
    (!angles_rad.is_empty()).then(|| (sum_rad / angles_rad.len() as f64).to_degrees())
}
