//! The pilot flies a rocket in space from its release to touchdown: one frame in, one set of commands out.
//!
//! It is a part of the [flight computer](crate::computer) and deterministic like it. A frame is 5 ms: estimate, watch
//! the motor, move through the phases, point fins and gimbal. Every tenth frame it makes the outlook and plans the
//! landing.

mod ascent;
mod assumed;
mod digest;
mod fin_watch;
mod hopeless;
mod inspect;
mod known;
mod outlook;
mod restart;
#[cfg(test)]
pub(super) mod sample;
mod step;

use ascent::{AscentWatch, axial_m_s2};
use fin_watch::FinWatch;
use known::Known;
pub use outlook::{ApogeeAhead, Outlook, touchdown_from_below_m, touchdown_m};
pub use restart::SavedPilot;
use serde::{Deserialize, Serialize};

use nalgebra::Vector3;

use crate::control::aim::AimLoop;
use crate::estimation::estimator::{Estimate, Estimator, Measurements, StartUncertainty};
use crate::estimation::motor_estimate::{MotorEstimate, MotorPrior};
use crate::guidance::baseline::{Baseline, Law};
use crate::guidance::powered::ControlLevel;
use crate::guidance::powered::{PoweredGuidance, PoweredReport};
use crate::rules::phase::Phase;
use crate::vehicle::airframe::MassModel;
use crate::vehicle::mission::Mission;
use crate::vehicle::mission::StartPoint;
use crate::vehicle::rigid::RigidState;
use crate::vehicle::thrust_curve::ThrustCurve;

/// Frames between plans.
pub const FRAMES_PER_PLAN: u64 = 10;

/// The input about the vehicle's motion.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "plain data, one a frame, so that a log of it is whole")]
pub enum Sensed {
    /// Measurements, for the estimator.
    Measured(Measurements),
    /// The truth as the estimate: for studies of guidance alone.
    Known(Estimate),
}

/// Everything a frame depends on besides the pilot's memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PilotInput {
    /// Number of the frame.
    pub frame: u64,
    /// End of the frame, s.
    pub time_s: f64,
    pub sensed: Sensed,
    /// Fin angles reported by the servos, rad.
    pub fins_rad: [f64; 4],
    /// A foot touches the ground.
    pub contact: bool,
    /// The igniter has continuity.
    pub igniter_continuity: bool,
    /// The wire between booster and vehicle is whole.
    pub booster_attached: bool,
    /// The operator asked for an abort.
    pub abort: bool,
}

/// The commands to the booster.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct BoosterCommands {
    /// Current through the ascent motor's igniter.
    pub ignite: bool,
    /// Current through the charge that separates the booster.
    pub separate: bool,
}

/// The commands of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PilotOutput {
    /// Gimbal angles (pitch, yaw), rad.
    pub gimbal_rad: [f64; 2],
    /// Fin openings, rad.
    pub fins_rad: [f64; 4],
    /// Current through the landing motor's igniter.
    pub ignite: bool,
    /// The parachute is released.
    pub parachute: bool,
    /// To the booster.
    pub booster: BoosterCommands,
    /// The phase after the frame.
    pub phase: Phase,
    /// What decided where the nose points.
    pub level: ControlLevel,
}

/// The pilot and everything that it remembers.
#[derive(Debug, Clone)]
pub struct Pilot {
    known: Known,
    estimator: Estimator,
    estimate: Option<Estimate>,
    ascent: AscentWatch,
    /// Height at which the fall begins or began, m.
    apogee_m: f64,
    ignited_at_s: Option<f64>,
    outlook: Outlook,
    powered: PoweredGuidance,
    /// The law that flies the landing burn instead of a plan, if any.
    baseline: Option<Baseline>,
    aim_loop: AimLoop,
    fin_share: f64,
    fins_rad: [f64; 4],
    fin_watch: FinWatch,
    gimbal_rad: [f64; 2],
    gate_refusal: Option<&'static str>,
    /// Since when a lasting reason has kept the gate shut, s.
    gate_shut_since_s: Option<f64>,
}

impl Pilot {
    /// A pilot at the start of its flight, with its estimate of its state and the uncertainty of that estimate.
    pub fn starting(
        mission: &Mission,
        time_s: f64,
        believed: &RigidState,
        uncertainty: &StartUncertainty,
    ) -> Self {
        let airframe = &mission.airframe;
        let frame_s = mission.estimator.frame_s;
        let known = Known {
            mission: mission.clone(),
            mass: MassModel::new(&airframe.mass, mission.motor_curve.propellant_mass_kg()),
            motor: MotorEstimate::new(&MotorPrior { frame_s, ..mission.motor }),
        };
        Self {
            estimator: Estimator::new(&mission.estimator, uncertainty, time_s, believed),
            estimate: None,
            ascent: AscentWatch::default(),
            apogee_m: match mission.start.at {
                // The fall is felt a moment after it began.
                StartPoint::Drone => {
                    let falls_m_s = believed.velocity_m_s.z;
                    believed.position_m.z + 0.5 * falls_m_s * falls_m_s / mission.gravity_m_s2
                }
                _ => mission.start.height_m,
            },
            ignited_at_s: None,
            outlook: Outlook::default(),
            powered: known.guidance(),
            baseline: None,
            aim_loop: AimLoop::new(mission.aim, frame_s),
            fin_share: 1.0,
            fins_rad: [airframe.fins.closed_rad(); 4],
            fin_watch: FinWatch::default(),
            gimbal_rad: [0.0; 2],
            gate_refusal: None,
            gate_shut_since_s: None,
            known,
        }
    }

    /// Takes over the state on the rail, and the gyro's bias, body, rad/s, from there.
    pub(super) fn stand(&mut self, believed: &RigidState, gyro_bias_rad_s: Vector3<f64>) {
        let config = &self.known.mission.estimator;
        let estimator = Estimator::new(config, &StartUncertainty::on_pad(), 0.0, believed);
        self.estimator = estimator.with_gyro_bias(gyro_bias_rad_s);
    }

    /// Whether a vehicle that nobody has started lifts off from its rail in this frame.
    pub(super) fn feels_lift_off(&mut self, sensed: &Sensed) -> bool {
        self.ascent.feels_lift_off(axial_m_s2(sensed), self.known.mission.estimator.frame_s)
    }

    /// Sets the law that flies the landing burn from now on.
    pub(crate) fn set_law(&mut self, law: Law) {
        self.baseline = match law {
            Law::Nmpc => None,
            Law::Baseline(baseline) => Some(baseline),
        };
    }

    /// The estimate of the last frame.
    pub fn estimate(&self) -> Option<&Estimate> {
        self.estimate.as_ref()
    }

    /// The estimator, to compare it with the truth.
    pub fn estimator(&self) -> &Estimator {
        &self.estimator
    }

    /// The guidance of the landing burn, with the plan being flown.
    pub fn powered(&self) -> &PoweredGuidance {
        &self.powered
    }

    /// Report of the last plan.
    pub fn report(&self) -> &PoweredReport {
        self.powered.report()
    }

    /// The outlook on ignition and abort.
    pub fn outlook(&self) -> &Outlook {
        &self.outlook
    }

    /// The landing motor as certified.
    pub fn curve(&self) -> &ThrustCurve {
        &self.known.mission.motor_curve
    }

    /// The motor as estimated in flight, and the scale of the aerodynamic forces.
    pub fn motor(&self) -> &MotorEstimate {
        &self.known.motor
    }

    /// Time since the landing motor's thrust began, s.
    pub fn burning_s(&self, time_s: f64) -> Option<f64> {
        self.known.burning_s(time_s)
    }

    /// When the landing motor was commanded to light, s.
    pub fn ignited_at_s(&self) -> Option<f64> {
        self.ignited_at_s
    }

    /// The gate check that failed at the last evaluation, if any.
    pub fn gate_refusal(&self) -> Option<&'static str> {
        self.gate_refusal
    }
}
