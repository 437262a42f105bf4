//! What a flight's log gives to a fit: sensor samples, commands and the flight computer's own
//! estimates. The simulated truth that some logs have beside them is never read.

use avionics::log::frame::{commands_from_log, input_from_log, phase_of};
use avionics::log::logged::{At, Logged, RecordError};
use flight::computer::{Commands, SensedInput};
use flight::estimation::estimator::{Estimate, Measurements};
use flight::rules::outputs::PyroOutput;
use flight::rules::phase::Phase;
use flight::vehicle::airframe::MassModel;
use flight::vehicle::mission::Mission;
use nalgebra::Vector3;
use protocol::log::computer_v1::ComputerFrame;
use protocol::log::flight_v1 as v1;

use crate::log::{Recording, RecordingError};

/// One frame of the flight computer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// End of the frame, s.
    pub time_s: f64,
    pub measured: Measurements,
    /// Fin openings by the feedback at the end of the frame, rad.
    pub fins_rad: [f64; 4],
    /// Gimbal angles by the feedback at the end of the frame, rad.
    pub gimbal_reported_rad: [f64; 2],
    /// The gimbal's command that is given at the end of the frame, rad.
    pub gimbal_rad: [f64; 2],
    /// The igniter of the landing motor is fired from the end of the frame on.
    pub ignite: bool,
    /// The parachute is or was thrown out.
    pub parachute: bool,
    pub contact: bool,
    pub booster_attached: bool,
    pub phase: Phase,
    /// The flight computer's estimate at the end of the frame, and the standard deviations with it.
    pub estimate: Estimate,
}

impl Frame {
    /// Velocity through the air in body axes, m/s.
    pub(super) fn through_air_m_s(&self) -> Vector3<f64> {
        let Estimate { state, .. } = &self.estimate;
        state.world_from_body.inverse_transform_vector(&self.estimate.velocity_through_air_m_s())
    }

    /// Rotation rate without the gyro's bias, rad/s.
    pub(super) fn rate_rad_s(&self) -> Vector3<f64> {
        self.measured.imu.gyro_rad_s - self.estimate.gyro_bias_rad_s
    }

    /// Specific force without the accelerometer's bias, m/s^2.
    pub(super) fn force_m_s2(&self) -> Vector3<f64> {
        self.measured.imu.specific_force_m_s2 - self.estimate.accelerometer_bias_m_s2
    }

    /// Openings of the fins on average since the frame before, rad.
    pub(super) fn fins_since_rad(&self, before: &Self) -> [f64; 4] {
        core::array::from_fn(|fin| 0.5 * (before.fins_rad[fin] + self.fins_rad[fin]))
    }
}

/// A flight as its log has it.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// The log's name, for messages.
    pub name: String,
    pub mission: Mission,
    /// The mission's text.
    pub mission_toml: String,
    /// In order of time. A gap is a restart of the computer, or lost records.
    pub frames: Vec<Frame>,
    /// Why the log could not be read to its end, if so.
    pub damage: Option<String>,
    /// Whether the flight landed, if the log has a verdict.
    pub landed: Option<bool>,
    /// Hash that identifies the recorded flight.
    pub content: Option<u64>,
    /// When the log ends, ns of Unix time.
    pub last_ns: Option<u64>,
}

impl Trace {
    /// A flight without frames yet.
    pub fn new(name: &str, mission: Mission, mission_toml: &str) -> Self {
        let (name, mission_toml) = (name.to_owned(), mission_toml.to_owned());
        let frames = Vec::new();
        Self { name, mission, mission_toml, frames, damage: None, landed: None, content: None, last_ns: None }
    }

    /// Density of the air around a frame, kg/m^3.
    pub(super) fn density_kg_m3(&self, frame: &Frame) -> f64 {
        self.mission.site.air_at_m(frame.estimate.state.position_m.z).density_kg_m3
    }

    /// The vehicle's mass over its burn, by the mission's data.
    pub(super) fn mass_model(&self) -> MassModel {
        MassModel::new(&self.mission.airframe.mass, self.mission.motor_curve.propellant_mass_kg())
    }

    /// Adds a frame; one with numbers that are not finite is left out.
    pub fn push(&mut self, input: &SensedInput, commands: &Commands, phase: Phase, estimate: &Estimate) {
        let SensedInput { time_s, measured, gimbal_rad, fins_rad, .. } = *input;
        let fix = measured.gnss.as_ref().map(|fix| [&fix.position_m, &fix.velocity_m_s]);
        let vectors = [measured.imu.gyro_rad_s, measured.imu.specific_force_m_s2];
        let numbers = vectors.iter().chain(fix.into_iter().flatten()).flat_map(|vector| vector.iter());
        let angles = fins_rad.iter().chain(&commands.gimbal_rad).chain(&gimbal_rad);
        let times = measured.gnss.as_ref().map(|fix| &fix.valid_at_s).into_iter().chain([&time_s]);
        let mut numbers = numbers.chain(&estimate.wind_m_s).chain(angles).chain(times);
        let sound = estimate.state.is_finite() && numbers.all(|number| number.is_finite());
        if !sound || self.frames.last().is_some_and(|last| last.time_s >= time_s) {
            return;
        }
        self.frames.push(Frame {
            time_s,
            measured,
            fins_rad,
            gimbal_reported_rad: gimbal_rad,
            gimbal_rad: commands.gimbal_rad,
            ignite: commands.outputs.is_on(PyroOutput::LandingIgniter),
            parachute: commands.outputs.is_on(PyroOutput::Parachute),
            contact: input.contact,
            booster_attached: input.booster_attached,
            phase,
            estimate: *estimate,
        });
    }

    /// What a recorded flight gives.
    ///
    /// # Errors
    /// Names what the log lacks: it has no usable mission, or no frames.
    pub fn of(recording: &Recording) -> Result<Self, RecordingError> {
        /// What is remembered after so many frames of noise is remembered in no other flight.
        const NAMING_FRAMES: usize = 100;
        let name = &recording.name;
        let found =
            if recording.telemetry.is_empty() { "none of either" } else { "it is a ground station's" };
        let nothing = || RecordingError::NoTrace { name: name.clone(), found };
        recording.estimates.first().ok_or_else(nothing)?;
        let text = recording.profile_toml()?;
        let mission = flight::vehicles::mission::from_toml(text, "the mission").map_err(|error| {
            RecordingError::ProfileUnusable { name: name.clone(), reason: error.to_string() }
        })?;
        let mut trace = Self {
            damage: recording.damage.clone(),
            landed: recording.verdict.as_ref().map(|verdict| verdict.landing.stands),
            content: recording.frames.iter().take(NAMING_FRAMES).next_back().map(|frame| frame.state_digest),
            last_ns: recording.last_ns,
            ..Self::new(name, mission, text)
        };
        for (place, estimate) in &recording.estimates {
            let Some(frame) = recording.frames.get(*place) else { continue };
            let taken = trace.take(frame, estimate);
            taken.map_err(|source| RecordingError::Frame { name: name.clone(), source })?;
        }
        if trace.frames.is_empty() { Err(nothing()) } else { Ok(trace) }
    }

    /// Adds a recorded frame; an error names a value that this build does not support.
    fn take(
        &mut self,
        ComputerFrame { input, output, .. }: &ComputerFrame,
        estimate: &v1::Estimate,
    ) -> Result<(), RecordError> {
        let number = input.frame;
        let input = input_from_log(input)?;
        let commands = commands_from_log(output, number)?;
        let phase = phase_of(output).ok_or(RecordError::Unknown {
            frame: number,
            field: "phase",
            found: output.phase,
            most: Phase::ALL.len() - 1,
        })?;
        let estimate = Logged::from_log(estimate, At { frame: number, field: "estimate" })?;
        self.push(&input.input(), &commands, phase, &estimate);
        Ok(())
    }
}
