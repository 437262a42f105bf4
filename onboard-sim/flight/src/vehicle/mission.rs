//! Missions: a vehicle, the start of its flight, and its settings, as data.

use alloc::string::String;

use serde::Deserialize;

use crate::control::aim::AimGains;
use crate::estimation::estimator::EstimatorConfig;
use crate::estimation::motor_estimate::MotorPrior;
use crate::guidance::descent::DescentGains;
use crate::guidance::ignition::IgnitionSettings;
use crate::guidance::powered::PoweredSettings;
use crate::vehicle::airframe::{Airframe, BadValue};
use crate::vehicle::drop::Drop;
use crate::vehicle::launch::Launch;
use crate::vehicle::profile::{ArmingLimits, GateLimits, StartPoint, TouchdownBox};
use crate::vehicle::site::Site;
use crate::vehicle::thrust_curve::ThrustCurve;

/// Length of the countdown of a mission whose text does not say it, s: what all missions had before it was 10 s, so that their
/// logs verify. The built-in ones say it.
const COUNTDOWN_S: f64 = 5.0;

/// Where a mission starts, and the state at apogee, nose up, if it starts there.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    /// Where the flight begins: `pad` needs the section `launch`, `drone` the section `drop`.
    #[serde(default = "at_apogee")]
    pub at: StartPoint,
    /// Time from the crew's start command to the start, s, 0 to 600.
    #[serde(default = "countdown_s")]
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

/// What the exhaust is expected to take away of the drag while the motor burns, as fractions.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exhaust {
    /// Of the body along its axis.
    pub body_loss: f64,
    pub fin_loss: f64,
}

impl Exhaust {
    /// Checks that no more than all of the drag goes, and that it does not more than double.
    ///
    /// # Errors
    /// [`BadValue`] names the first key with a wrong value.
    pub fn validate(&self) -> Result<(), BadValue> {
        for (key, found) in [("exhaust.body_loss", self.body_loss), ("exhaust.fin_loss", self.fin_loss)] {
            if !(-1.0..=1.0).contains(&found) {
                return Err(BadValue { key, found, required: "-1 to 1" });
            }
        }
        Ok(())
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
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

/// Everything that defines a flight from apogee, except random differences.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mission {
    /// Short name for the command line.
    pub name: String,
    /// Description in one line.
    pub summary: String,
    /// The vehicle.
    pub airframe: Airframe,
    /// The certified thrust curve of the landing motor that the airframe names. It is not in the mission's file; the
    /// reader of the mission looks the motor up.
    #[serde(skip, default = "ThrustCurve::none")]
    pub motor_curve: ThrustCurve,
    pub gravity_m_s2: f64,
    /// Altitude of the pad above the sea, m.
    pub pad_altitude_m: f64,
    /// Position of the pad on the Earth.
    #[serde(default)]
    pub site: Site,
    /// Whether the fins steer; otherwise they stay open at equal angles (passive descent).
    pub steered: bool,
    /// Position of the lidar along the axis, ahead of the feet, m.
    pub lidar_ahead_of_feet_m: f64,
    #[serde(default)]
    pub exhaust: Exhaust,
    /// The prior of the motor before ignition.
    #[serde(default)]
    pub motor: MotorPrior,
    /// A plan assumes a motor that is weaker than the estimate by this many standard deviations of the remaining
    /// impulse.
    pub caution_sigmas: f64,
    /// This caution fades over this time before the thrust falls through the weight, s.
    pub caution_fades_s: f64,
    /// The fins leave room for a motor that is weaker or stronger by this many standard deviations of the remaining
    /// impulse.
    pub fin_sigmas: f64,
    /// Place in the remaining band at which the fins hold the vehicle, 0 at its low end, 1 at its high end.
    pub fin_place: f64,
    /// Weight of the fins' present opening in a plan; the rest is the opening that the planned motor will need.
    pub fins_kept: f64,
    /// Largest tilt that the landing may use throughout, in the band of feasible heights before the ignition, degrees.
    pub soft_tilt_deg: f64,
    /// The same for the fins' band after the ignition, degrees; the rest of the tilt is reserved for the planner.
    pub fin_soft_tilt_deg: f64,
    /// How long before touchdown the vehicle is upright in that band, s.
    pub settle_s: f64,
    pub start: Start,
    /// The rail and the booster stage, for a start from the pad.
    #[serde(default)]
    pub launch: Option<Launch>,
    /// The drone, for a start below it.
    #[serde(default)]
    pub drop: Option<Drop>,
    #[serde(default)]
    pub estimator: EstimatorConfig,
    /// Steering by fins.
    pub descent: DescentGains,
    /// The choice of the ignition.
    pub ignition: IgnitionSettings,
    /// The landing burn.
    pub powered: PoweredSettings,
    /// The gimbal loop.
    pub aim: AimGains,
    /// Whether the gimbal holds a vehicle upright that has touched down while the thrust still carries it.
    #[serde(default)]
    pub upright_after_contact: bool,
    /// Limits of the pad checks before arming.
    #[serde(default)]
    pub arming: ArmingLimits,
    /// Limits of the checks before ignition.
    pub gate: GateLimits,
    /// What counts as a landing: the landing paper's Table 2.
    pub touchdown_limits: TouchdownBox,
    pub leg_limits: LegLimits,
}

fn at_apogee() -> StartPoint {
    StartPoint::Apogee
}

fn countdown_s() -> f64 {
    COUNTDOWN_S
}
