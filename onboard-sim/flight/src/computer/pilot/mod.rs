//! The pilot: flies a rocket from its release to touchdown, one frame in, one set of commands out.
//!
//! It is part of the [flight computer](crate::computer) and deterministic like it. A frame is 5 ms:
//! estimate state and motor, change phases, point fins and gimbal. Every tenth frame requests
//! the prediction, or a plan of the landing, from the [`planner`].

mod ascent;
mod gate;
pub mod planner;
mod prediction;
mod rehearsal;
mod steering;
mod step;
mod swing;
mod vehicle_model;
mod vertical_speed;

use alloc::boxed::Box;
use alloc::sync::Arc;
use serde::{Deserialize, Serialize};

use self::ascent::{AscentWatch, FinWatch};
use self::planner::Planner;
pub use self::prediction::{ApogeeAhead, Prediction, touchdown_from_below_m, touchdown_m};
use self::swing::SwingWatch;
use self::vehicle_model::VehicleModel;
use self::vertical_speed::VerticalSpeeds;
use crate::control::aim::AimLoop;
use crate::estimation::estimator::alignment::ImuCalibration;
use crate::estimation::estimator::{Estimate, Estimator, Measurements, StartUncertainty};
use crate::estimation::motor_estimate::{MotorEstimate, MotorPrior};
use crate::guidance::powered::{ControlLevel, PoweredGuidance, PoweredReport};
use crate::rules::gate::GATE_CHECKS;
use crate::text::Text;
use crate::vehicle::airframe::MassModel;
use crate::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use crate::vehicle::mission::{Mission, StartPoint};
use crate::vehicle::rigid::RigidState;

/// Minimum number of frames between plans.
pub const FRAMES_PER_PLAN: u64 = 10;

/// Surface commands of a frame. Igniters and ejection charges are decided [at the end of the
/// frame](crate::rules::outputs).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pointed {
    /// Gimbal angles (pitch, yaw), rad.
    pub gimbal_rad: [f64; 2],
    /// Fin openings, rad.
    pub fins_rad: [f64; 4],
    /// The control level that set the attitude command.
    pub level: ControlLevel,
}

/// The pilot with its complete memory.
#[derive(Debug, Clone, Serialize)]
pub struct Pilot {
    model: VehicleModel,
    /// Boxed: a pilot is moved when it is constructed, and a board's stack is small.
    estimator: Box<Estimator>,
    estimate: Option<Estimate>,
    speeds: VerticalSpeeds,
    pub(super) ascent: AscentWatch,
    /// Apogee height, expected or passed, m.
    apogee_m: f64,
    ignited_at_s: Option<f64>,
    prediction: Prediction,
    powered: PoweredGuidance,
    /// Its request is part of the memory from the frame of the request on. `None` while it computes
    /// in another context.
    #[serde(skip)]
    planner: Option<Box<Planner>>,
    /// Time of the request whose result is not taken over yet, s.
    request_s: Option<f64>,
    /// Frame from which on the next landing plan is requested.
    plan_due: u64,
    aim_loop: AimLoop,
    fin_share: f64,
    fins_rad: [f64; 4],
    fin_watch: FinWatch,
    swing_watch: SwingWatch,
    gimbal_rad: [f64; 2],
    gate_refusal: Option<&'static str>,
    /// Time since when a lasting reason inhibits ignition, s, and of each of its checks.
    gate_shut_since_s: Option<f64>,
    shut_since_s: [Option<f64>; GATE_CHECKS],
    /// Why the landing was abandoned. It decides nothing.
    #[serde(skip)]
    gave_up: Option<Text>,
}

impl Pilot {
    /// A pilot at the start of its flight, with its estimated state and the uncertainty of that
    /// estimate.
    pub fn starting(
        mission: &Mission,
        time_s: f64,
        initial: &RigidState,
        uncertainty: &StartUncertainty,
    ) -> Self {
        let airframe = &mission.airframe;
        let frame_s = mission.estimator.frame_s;
        let model = VehicleModel {
            mission: Arc::new(mission.clone()),
            mass: MassModel::new(&airframe.mass, mission.motor_curve.propellant_mass_kg()),
            motor: MotorEstimate::new(&MotorPrior { frame_s, ..mission.motor }),
        };
        let (powered, search) = model.guidance();
        Self {
            estimator: Box::new(Estimator::new(&mission.estimator, uncertainty, time_s, initial)),
            estimate: None,
            speeds: VerticalSpeeds::default(),
            ascent: AscentWatch::default(),
            apogee_m: match mission.start.at {
                // The fall is sensed a moment after it began.
                StartPoint::Drone => {
                    let falls_m_s = initial.velocity_m_s.z;
                    initial.position_m.z + 0.5 * falls_m_s * falls_m_s / STANDARD_GRAVITY_M_S2
                }
                _ => mission.start.height_m,
            },
            ignited_at_s: None,
            prediction: Prediction::default(),
            planner: Some(Self::planner(&model, search)),
            request_s: None,
            plan_due: 0,
            powered,
            aim_loop: AimLoop::new(mission.aim, frame_s),
            fin_share: 1.0,
            fins_rad: [airframe.fins.closed_rad(); 4],
            fin_watch: FinWatch::default(),
            swing_watch: SwingWatch::default(),
            gimbal_rad: [0.0; 2],
            gate_refusal: None,
            gate_shut_since_s: None,
            shut_since_s: [None; GATE_CHECKS],
            gave_up: None,
            model,
        }
    }

    /// Takes over the state on the rail, and the inertial unit's calibration there.
    pub(super) fn stand(&mut self, initial: &RigidState, calibration: &ImuCalibration) {
        let config = &self.model.mission.estimator;
        let estimator = Estimator::new(config, &StartUncertainty::on_pad(), 0.0, initial);
        *self.estimator = estimator.calibrated(calibration);
    }

    /// Detects an uncommanded lift-off from the rail in this frame.
    pub(super) fn detects_lift_off(&mut self, measured: &Measurements) -> bool {
        self.ascent.detects_lift_off(measured.imu.specific_force_m_s2.x, self.model.mission.estimator.frame_s)
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

    /// The prediction for ignition and abort.
    pub fn prediction(&self) -> &Prediction {
        &self.prediction
    }

    /// The motor estimate of this flight, and the scale of the aerodynamic forces.
    pub fn motor(&self) -> &MotorEstimate {
        &self.model.motor
    }

    /// Time since the landing motor's thrust began, s.
    pub fn burning_s(&self, time_s: f64) -> Option<f64> {
        self.model.burning_s(time_s)
    }

    /// Time of the landing motor's ignition command, s.
    pub fn ignited_at_s(&self) -> Option<f64> {
        self.ignited_at_s
    }

    /// Why the landing was abandoned, with the values found.
    pub fn gave_up(&self) -> Option<&str> {
        self.gave_up.as_deref()
    }

    /// The gate check that failed at the last evaluation, if any.
    pub fn gate_refusal(&self) -> Option<&'static str> {
        self.gate_refusal
    }
}

// For replay: reads the pilot's state and changes its settings from outside the flight.

impl Pilot {
    /// The same memory with another mission: other vehicle data, gains, limits and settings. Frame
    /// length, estimator configuration and start are unchanged.
    #[must_use]
    pub fn reconfigured(&self, mission: &Mission) -> Self {
        let mass = MassModel::new(&mission.airframe.mass, mission.motor_curve.propellant_mass_kg());
        Self {
            powered: self.powered.reconfigured(&mission.powered),
            aim_loop: self.aim_loop.reconfigured(mission.aim),
            model: VehicleModel { mission: Arc::new(mission.clone()), mass, ..self.model.clone() },
            ..self.clone()
        }
    }

    /// The mission.
    pub fn mission(&self) -> &Mission {
        &self.model.mission
    }
}

// State of a pilot saved for a restart in the air, and its restoration.

/// State of a pilot saved through a reset: motor and drag estimates, the last commands, the last
/// estimate, and the monitors of ascent, fins and gimbal. Covariances of the estimator, prediction,
/// plan and gimbal loop are not saved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SavedPilot {
    motor: MotorEstimate,
    estimate: Option<Estimate>,
    accelerometer_scale: f64,
    speeds: VerticalSpeeds,
    ascent: AscentWatch,
    apogee_m: f64,
    ignited_at_s: Option<f64>,
    fin_share: f64,
    fins_rad: [f64; 4],
    fin_watch: FinWatch,
    swing_watch: SwingWatch,
    gimbal_rad: [f64; 2],
}

impl Pilot {
    pub(super) fn saved(&self) -> SavedPilot {
        SavedPilot {
            motor: self.model.motor,
            estimate: self.estimate,
            accelerometer_scale: self.estimator.calibration().accelerometer_scale,
            speeds: self.speeds,
            ascent: self.ascent,
            apogee_m: self.apogee_m,
            ignited_at_s: self.ignited_at_s,
            fin_share: self.fin_share,
            fins_rad: self.fins_rad,
            fin_watch: self.fin_watch,
            swing_watch: self.swing_watch,
            gimbal_rad: self.gimbal_rad,
        }
    }

    /// Gives this newly powered-up pilot the state saved before a reset that ended at `time_s`. The
    /// saved estimate is extrapolated over the lost time with the last measured rates and forces,
    /// and gets the same uncertainty as at apogee. The buffers of the plans remain, so that no
    /// frame allocates them.
    pub(super) fn resume(&mut self, saved: &SavedPilot, time_s: f64) {
        if let Some(estimate) = saved.estimate {
            let lost_s = (time_s - estimate.time_s).max(0.0);
            let mut initial = estimate.state;
            // The rotation rate is held constant; the force has its direction at half of the lost
            // time.
            let half = nalgebra::UnitQuaternion::from_scaled_axis(initial.rate_rad_s * (0.5 * lost_s));
            initial.world_from_body *= half;
            let force = initial.world_from_body * estimate.specific_force_m_s2;
            initial.world_from_body *= half;
            let acceleration_m_s2 = force - nalgebra::Vector3::z() * STANDARD_GRAVITY_M_S2;
            initial.position_m += initial.velocity_m_s * lost_s + acceleration_m_s2 * (0.5 * lost_s * lost_s);
            initial.velocity_m_s += acceleration_m_s2 * lost_s;
            let (settings, uncertainty) = (&self.model.mission.estimator, StartUncertainty::at_apogee());
            let estimator = Estimator::new(settings, &uncertainty, time_s, &initial);
            let calibration = ImuCalibration {
                gyro_bias_rad_s: estimate.gyro_bias_rad_s,
                accelerometer_scale: saved.accelerometer_scale,
            };
            *self.estimator = estimator.calibrated(&calibration);
        }
        self.estimate = saved.estimate;
        self.speeds = saved.speeds.resumed();
        self.ascent = saved.ascent;
        self.apogee_m = saved.apogee_m;
        self.ignited_at_s = saved.ignited_at_s;
        self.fin_share = saved.fin_share;
        self.fins_rad = saved.fins_rad;
        self.fin_watch = saved.fin_watch;
        self.swing_watch = saved.swing_watch.interrupted();
        self.gimbal_rad = saved.gimbal_rad;
        self.model.motor = saved.motor;
    }
}

#[cfg(test)]
pub(super) mod sample;

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};

    use crate::computer::pilot::sample::{falling, input, released};
    use crate::estimation::sensor_watch::SensorWatch;

    #[test]
    fn the_attitude_is_extrapolated_over_the_lost_time() {
        let mut pilot = falling();
        pilot.estimate_state((released().mode().phase, false), &input(1, 0.0), &SensorWatch::default());
        pilot.predict(&mut released(), &input(1, 0.0));
        let mut estimate = pilot.estimate.expect("the pilot has an estimate");
        estimate.state.rate_rad_s = Vector3::new(2.0, 0.5, -0.3);
        pilot.estimate = Some(estimate);
        let mut resumed = falling();
        resumed.resume(&pilot.saved(), estimate.time_s + 0.2);
        let found = resumed.estimator.estimate().state.world_from_body;
        let turned = UnitQuaternion::from_scaled_axis(estimate.state.rate_rad_s * 0.2);
        let expected = estimate.state.world_from_body * turned;
        assert!(found.angle_to(&expected) < 1e-6, "{}", found.angle_to(&expected));
    }
}
