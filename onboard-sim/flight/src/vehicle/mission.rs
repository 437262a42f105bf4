//! Missions: a vehicle, the start of its flight, and its settings, as data.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::control::aim::AimGains;
use crate::estimation::estimator::EstimatorConfig;
use crate::estimation::motor_estimate::MotorPrior;
use crate::guidance::descent::DescentGains;
use crate::guidance::ignition::IgnitionSettings;
use crate::guidance::powered::PoweredSettings;
use crate::vehicle::airframe::Airframe;
use crate::vehicle::drop::Drop;
use crate::vehicle::launch::Launch;
use crate::vehicle::lot::{Expectation, Lot};
use crate::vehicle::site::Site;
use crate::vehicle::thrust_curve::ThrustCurve;

pub use ocp::landing::SolverLimits;

numbered_enum! {
/// Where a flight begins, by its name in files and on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StartPoint {
    /// On the pad, under its ascent motor.
    Pad = "pad",
    /// Released at apogee.
    Apogee = "apogee",
    /// Hanging below a drone, which lets it go.
    Drone = "drone",
}
}

impl core::str::FromStr for StartPoint {
    type Err = UnknownStart;

    fn from_str(name: &str) -> Result<Self, UnknownStart> {
        Self::ALL.into_iter().find(|start| start.name() == name).ok_or(UnknownStart)
    }
}

/// No flight begins there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("not a start: pad, apogee or drone is accepted")]
pub struct UnknownStart;

/// Where a mission starts, and the state at apogee, nose up, if it starts there.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    /// Where the flight begins: `pad` needs the section `launch`, `drone` the section `drop`.
    pub at: StartPoint,
    /// Time from the crew's start command to the start, s, 0 to 600.
    pub countdown_s: f64,
    /// Height of the centre of gravity above the pad at apogee, m.
    pub height_m: f64,
    /// Horizontal distance from the pad, m.
    pub distance_m: f64,
    /// Horizontal speed, away from the pad, m/s.
    pub speed_m_s: f64,
    /// Fraction of the mean wind at apogee that the vehicle moves with.
    pub carried_share: f64,
    /// Tilt of the nose from the vertical, along the motion, degrees.
    pub tilt_deg: f64,
}

/// Places of the sensors in the vehicle: stations above the nozzle exit, and distances from the
/// axis along body y and z, m. A sensor without a station is taken to be at the centre of gravity.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct SensorPlaces {
    /// Inertial unit.
    pub imu_station_m: Option<f64>,
    pub imu_across_m: [f64; 2],
    /// Antenna of the satellite receiver.
    pub gnss_station_m: Option<f64>,
    pub gnss_across_m: [f64; 2],
    /// Static ports of the barometer.
    pub barometer_station_m: Option<f64>,
    pub barometer_across_m: [f64; 2],
    /// Lidar, which looks backwards along the axis.
    pub lidar_station_m: Option<f64>,
    pub lidar_across_m: [f64; 2],
}

/// Lever arms of the sensors from the centre of gravity, body axes, m.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LeverArms {
    pub imu_m: Vector3<f64>,
    pub gnss_m: Vector3<f64>,
    pub barometer_m: Vector3<f64>,
    pub lidar_m: Vector3<f64>,
}

impl SensorPlaces {
    /// The lever arms from a centre of gravity: its station and its distance from the axis, m.
    pub fn lever_arms(&self, cg_m: &Vector3<f64>) -> LeverArms {
        let from_cg = |station_m: Option<f64>, [y_m, z_m]: [f64; 2]| {
            station_m.map_or_else(Vector3::zeros, |x_m| Vector3::new(x_m, y_m, z_m) - cg_m)
        };
        LeverArms {
            imu_m: from_cg(self.imu_station_m, self.imu_across_m),
            gnss_m: from_cg(self.gnss_station_m, self.gnss_across_m),
            barometer_m: from_cg(self.barometer_station_m, self.barometer_across_m),
            lidar_m: from_cg(self.lidar_station_m, self.lidar_across_m),
        }
    }
}

/// Expected reduction of the drag by the exhaust while the motor burns, as fractions.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Exhaust {
    /// Of the body along its axis.
    pub body_loss: f64,
    pub fin_loss: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LegLimits {
    /// Largest vertical speed, m/s.
    pub vertical_m_s: f64,
    /// Largest lateral speed, m/s.
    pub lateral_m_s: f64,
    /// Largest tilt, degrees.
    pub tilt_deg: f64,
    /// Largest rotation rate, degrees per second.
    pub rate_deg_s: f64,
}

/// Weights of a plan's running cost, per second; SI units and radians.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PlanWeights {
    /// Distance from the landing point, 1/m^2.
    #[serde(default)]
    pub x: f64,
    /// Height, 1/m^2.
    #[serde(default)]
    pub z: f64,
    /// Vertical velocity, s^2/m^2: the paper's is along the body.
    #[serde(default)]
    pub u: f64,
    /// Velocity in each level direction, s^2/m^2: the paper's is across the body.
    #[serde(default)]
    pub w: f64,
    /// Leans, 1/rad^2.
    pub theta: f64,
    /// Rates of the leans, s^2/rad^2.
    pub q: f64,
    /// Gimbal angles, 1/rad^2.
    pub delta: f64,
    /// The fins' distance from half open.
    pub fins: f64,
}

/// The box in which a plan ends.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct FinalBox {
    /// Largest lean in each level direction, degrees.
    pub pitch_error_deg: f64,
    /// Lowest vertical velocity, m/s.
    #[serde(default)]
    pub u_min_m_s: f64,
    /// Highest vertical velocity, m/s.
    #[serde(default)]
    pub u_max_m_s: f64,
    /// Largest lateral speed in each level direction, m/s.
    pub w_m_s: f64,
    /// Largest rate of a lean, degrees per second.
    pub pitch_rate_deg_s: f64,
}

with_defaults! {
    /// Limits of the pad checks before arming.
    #[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
    #[serde(deny_unknown_fields, default)]
    pub struct ArmingLimits {
        /// Largest tilt from vertical, degrees.
        pub tilt_max_deg: f64 = 5.0,
        /// Largest rotation rate that counts as rest, degrees per second.
        pub rotation_max_deg_s: f64 = 2.0,
        /// Largest speed that counts as rest, m/s.
        pub speed_max_m_s: f64 = 0.2,
        /// Smallest free log space, bytes.
        pub log_space_min_bytes: u64 = 64 << 20,
        /// Lowest voltage of the flight computer's pack, V. The default is for two
        /// lithium-polymer cells: 3.7 V a cell at light load is about a seventh of the charge, a
        /// quarter of an hour of the simulated vehicle (1 Ah, 0.35 A), and 0.8 V above the 6.6 V at
        /// which common 5 V regulators give up.
        pub battery_min_v: f64 = 7.4,
        /// Lowest voltage of the pack of servos and igniters, V. The default is for three such
        /// cells: six moving servos and two igniters take 1.4 V of it (14.2 A through 0.1 ohm),
        /// which leaves 1.3 V above the 8.4 V that a regulator for servos of 7.4 V needs.
        pub servo_battery_min_v: f64 = 11.1,
    }
}

/// Limits of the checks before ignition.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct GateLimits {
    /// Largest tilt from vertical, degrees.
    #[serde(default)]
    pub tilt_max_deg: f64,
    /// Largest pitch rate, degrees per second.
    pub pitch_rate_max_deg_s: f64,
    /// Largest difference from the predicted speed, as a fraction of it.
    pub speed_error_max_fraction: f64,
    /// Largest disagreement of two height sources, m.
    pub height_disagreement_max_m: f64,
    /// Radius of the fence that must contain the predicted touchdown, m.
    pub fence_radius_m: f64,
}

/// Everything that defines a flight, except random differences. A club's file has its measurements
/// and decisions; the reader of the mission adds the controller.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Mission {
    /// Short name for the command line.
    pub name: String,
    /// Description in one line.
    pub summary: String,
    /// The keys of the file that are the controller's: with one of them the mission is not flown by
    /// the standard controller.
    #[serde(skip)]
    pub changed: Vec<String>,
    /// The vehicle.
    pub airframe: Airframe,
    /// The expected thrust curve of the landing motor: the certified one of the motor that the
    /// airframe names, or that of the lot. It is not in the mission's file; the reader of the
    /// mission looks the motor up.
    #[serde(skip)]
    pub motor_curve: ThrustCurve,
    /// Motor that the landing motor may turn out to be in a simulation (`other_curve` of a
    /// dispersion): name of a built-in motor, or text of a motor file.
    pub other_motor: Option<String>,
    /// Its certified curve. The reader of the mission looks it up.
    #[serde(skip)]
    pub other_curve: Option<ThrustCurve>,
    /// Measured burns of the motor's lot. The reader of the mission applies them to the motor's
    /// curve and prior, the ignition and the mass.
    pub lot: Option<Box<Lot>>,
    /// The resulting expectation; `None` without a lot.
    #[serde(skip)]
    pub expected: Option<Box<Expectation>>,
    pub site: Site,
    /// File with the lines of the field, `site.field`, relative to the mission's. Nothing on board
    /// reads it.
    #[serde(skip)]
    pub field_file: Option<String>,
    #[serde(default)]
    pub sensors: SensorPlaces,
    pub exhaust: Exhaust,
    /// The prior of the motor before ignition.
    pub motor: MotorPrior,
    /// A plan assumes a motor that is weaker than the estimate by this many standard deviations of
    /// the remaining impulse.
    pub caution_sigmas: f64,
    /// This caution fades over this time before the thrust falls through the weight, s.
    pub caution_fades_s: f64,
    /// Largest tilt that the landing may use throughout, in the band of feasible heights before the
    /// ignition, degrees.
    #[serde(default)]
    pub soft_tilt_deg: f64,
    /// The same for the fins' band after the ignition, degrees; the rest of the tilt is reserved
    /// for the planner.
    #[serde(default)]
    pub fin_soft_tilt_deg: f64,
    /// How long before touchdown the vehicle is upright in that band, s.
    pub settle_s: f64,
    pub start: Start,
    /// The rail and the booster stage, for a start from the pad.
    pub launch: Option<Launch>,
    /// The drone, for a start below it.
    pub drop: Option<Drop>,
    pub estimator: EstimatorConfig,
    /// Steering by fins.
    pub descent: DescentGains,
    /// The choice of the ignition.
    pub ignition: IgnitionSettings,
    /// The landing burn.
    pub powered: PoweredSettings,
    /// The gimbal loop.
    pub aim: AimGains,
    /// Whether the gimbal holds a vehicle upright that has touched down while the thrust still
    /// carries it.
    pub upright_after_contact: bool,
    /// Limits of the pad checks before arming.
    #[serde(default)]
    pub arming: ArmingLimits,
    /// Limits of the checks before ignition.
    pub gate: GateLimits,
    /// The design limits of the legs, all at once. The verdict on a landing follows from the leg
    /// loads.
    #[serde(default)]
    pub leg_limits: LegLimits,
}

impl Mission {
    /// How many burns of the motor's lot have confirmed the curve that this mission expects; of a
    /// certified curve alone none has.
    pub fn motor_burns(&self) -> u32 {
        self.lot.as_ref().map_or(0, |lot| lot.burns)
    }

    /// Rail and booster of a mission that starts from them.
    pub fn launched(&self) -> Option<&Launch> {
        self.launch.as_ref().filter(|_| self.start.at == StartPoint::Pad)
    }

    /// Height of the centre of gravity above the pad at which its flight begins, m: at apogee, or
    /// where a drone releases it.
    pub fn start_height_m(&self) -> f64 {
        let dropped = self.drop.filter(|_| self.start.at == StartPoint::Drone);
        dropped.map_or(self.start.height_m, |drop| drop.height_m)
    }

    /// Applies the lot, whose scales are relative to `curve`; without a lot, that curve.
    pub(crate) fn expect(&mut self, curve: ThrustCurve) {
        let Some(lot) = &self.lot else {
            self.motor_curve = curve;
            return;
        };
        let mass = &mut self.airframe.mass;
        mass.loaded_kg = lot.weighed.vehicle_kg.unwrap_or(mass.loaded_kg);
        let expected = lot.expectation(&self.motor, mass.loaded_kg);
        let Expectation { impulse, burn_time, .. } = expected;
        let motor_kg = lot.weighed.motor_kg.unwrap_or_else(|| curve.total_mass_kg());
        self.motor_curve = curve.scaled(impulse.mean, burn_time.mean).weighing(motor_kg);
        self.motor.impulse_sigma = expected.impulse_per_mass_share();
        self.motor.burn_time_sigma = burn_time.share;
        self.expected = Some(Box::new(expected));
    }
}
