//! Flies along on the vehicle's telemetry and says where it differs from what the flight computer of this build expects.
//!
//! [`Shadow`] is pure: messages with their time in, [`Flag`]s out. It has the mission's data and uses the flight computer's
//! own parts: the certified curve, the mass and air models, the motor's filter, the choice of the ignition. A radio of
//! 57,600 baud carries a few messages a second, so it cannot compare bits ([`NOT_CARRIED`]); [`Shadow::coverage`] says which
//! checks run at the rates that are heard. Each check has its threshold with its derivation in a file of its own:
//!
//! * [`strength`]: a weak motor, in the strength that the vehicle estimates.
//! * [`thrust`]: the acceleration of the burn against the certified curve.
//! * [`following`]: gimbal and fins against their commands.
//! * [`turning`]: the turning of the vehicle against the gimbal's command.
//! * [`ignition`]: the height of the ignition.

mod coverage;
mod flag;
mod following;
mod heard;
mod ignition;
mod strength;
mod thrust;
mod turning;

use flight::estimation::estimator::VehicleNow;
use flight::rules::phase::Phase;
use flight::vehicle::airframe::MassModel;
use flight::vehicle::atmosphere::Air;
use flight::vehicle::burn::Burn;
use flight::vehicle::mission::Mission;
use nalgebra::Vector3;
use protocol::dialect::{MavMessage, TD_FINS_DATA, TD_FLIGHT_STATUS_DATA, TD_GIMBAL_DATA};

pub use self::coverage::{Coverage, NOT_CARRIED};
pub use self::flag::{Check, Flag};

use self::coverage::Rates;
use self::following::{FollowingWatch, Stuck};
use self::heard::{Attitude, Descent, Heard, Motion, boot_s, degrees};
use self::strength::{StrengthWatch, Weak};
use self::thrust::{Felt, ThrustWatch};
use self::turning::{Axis, TurningWatch};

/// A servo that stands still this far from its command is stuck ([`following`]). Fins are commanded in larger steps: what the
/// flight computer calls "not there" is 0.1 rad.
const STUCK_GIMBAL: Stuck = Stuck { gap_deg: 3.0, pairs: 1 };
const STUCK_FIN: Stuck = Stuck { gap_deg: 6.0, pairs: 2 };
/// The thrust is found by two frames above a tenth of the peak, s.
const FOUND_AFTER_S: f64 = 0.01;
/// A longer time between two phases heard does not say when the second one began, s. The status is sent five times a
/// second, and at once with a new phase.
const PHASE_AGE_S: f64 = 0.3;
/// Speed of a fall that was not heard, m/s: that of a rocket from apogee on its open fins.
const FALLS_M_S: f64 = 40.0;
/// Right after the light the gimbal goes to its first plan, and near the ground the legs and the ground turn the vehicle.
const STEADY_AFTER_S: f64 = 0.4;
const STEADY_ABOVE_M: f64 = 1.0;

/// What one mission's telemetry is held against.
#[derive(Debug, Clone)]
struct InSpace {
    mission: Mission,
    mass: MassModel,
    /// From the light on.
    strength: Option<StrengthWatch>,
    thrust: ThrustWatch,
    turning: TurningWatch,
    ignition_flagged: bool,
}

/// The shadow of one vehicle.
#[derive(Debug, Clone)]
pub struct Shadow {
    in_space: Option<Box<InSpace>>,
    boot_number: u32,
    heard: Heard,
    status_s: f64,
    rates: Rates,
    gimbal: [FollowingWatch; 2],
    fins: [FollowingWatch; 4],
}

impl Shadow {
    /// The shadow of a vehicle that flies a mission.
    pub fn of_mission(mission: &Mission) -> Self {
        let curve = &mission.motor_curve;
        let in_space = InSpace {
            mass: MassModel::new(&mission.airframe.mass, curve.propellant_mass_kg()),
            strength: None,
            thrust: ThrustWatch::default(),
            turning: TurningWatch::default(),
            ignition_flagged: false,
            mission: mission.clone(),
        };
        Self { in_space: Some(Box::new(in_space)), ..Self::of_the_planar_vehicle() }
    }

    /// The shadow of the planar vehicle, which has servos, but neither a filter of its motor nor a certified curve.
    pub fn of_the_planar_vehicle() -> Self {
        Self {
            in_space: None,
            boot_number: 0,
            heard: Heard::default(),
            status_s: 0.0,
            rates: Rates::default(),
            gimbal: <[FollowingWatch; 2]>::default(),
            fins: <[FollowingWatch; 4]>::default(),
        }
    }

    /// Which checks run at the rates heard so far.
    pub fn coverage(&self) -> Vec<Coverage> {
        self.rates.coverage(self.in_space.is_some())
    }

    /// The phase heard last.
    pub fn phase(&self) -> Option<Phase> {
        self.heard.phase
    }

    /// Takes a message of the vehicle that arrived at a time on the caller's clock, s. Returns what it shows to be different
    /// from what is expected.
    pub fn heard(&mut self, time_s: f64, message: &MavMessage) -> Vec<Flag> {
        let mut flags = match message {
            MavMessage::TD_FLIGHT_STATUS(status) => {
                self.on_status(status);
                Vec::new()
            }
            MavMessage::ATTITUDE_QUATERNION(told) => self.on_attitude(Attitude::from(told)),
            MavMessage::LOCAL_POSITION_NED(told) => self.on_motion(Motion::from(told)),
            MavMessage::TD_DESCENT(told) => self.on_descent(Descent::from(told)),
            MavMessage::TD_CONTROLLER(told) => {
                let (at_s, strength) = (boot_s(told.time_boot_ms), f64::from(told.thrust_scale));
                self.on_strength(at_s, strength, "TD_CONTROLLER.thrust_scale")
            }
            MavMessage::TD_GIMBAL(told) => self.on_gimbal(told),
            MavMessage::TD_FINS(told) => self.on_fins(told),
            _ => Vec::new(),
        };
        for flag in &mut flags {
            flag.time_s = time_s;
        }
        flags
    }

    fn on_status(&mut self, status: &TD_FLIGHT_STATUS_DATA) {
        if self.boot_number != 0 && status.boot_number != 0 && status.boot_number != self.boot_number {
            // Another boot is another flight.
            let fresh = self.in_space.take().map(|known| Self::of_mission(&known.mission));
            *self = fresh.unwrap_or_else(Self::of_the_planar_vehicle);
        }
        if status.boot_number != 0 {
            self.boot_number = status.boot_number;
        }
        let now_s = boot_s(status.time_boot_ms);
        let phase = Phase::from_index(status.phase as u8);
        let begins = phase == Some(Phase::Powered) && self.heard.phase != Some(Phase::Powered);
        if begins && self.heard.phase.is_some() && now_s - self.status_s < PHASE_AGE_S {
            let rises_s = self.in_space.as_ref().map_or(0.0, |known| rises_s(&known.mission));
            self.heard.burns_since_s = Some(now_s - rises_s - FOUND_AFTER_S);
        }
        self.heard.phase = phase;
        self.status_s = now_s;
    }

    /// Time since the thrust began, s, while the motor burns.
    fn burning_s(&self, at_s: f64) -> Option<f64> {
        let since_s = self.heard.burns_since_s.filter(|_| self.heard.phase == Some(Phase::Powered))?;
        Some(at_s - since_s)
    }

    fn on_attitude(&mut self, now: Attitude) -> Vec<Flag> {
        self.rates.attitude.note(now.time_s);
        let burning_s = self.burning_s(now.time_s);
        let before = self.heard.attitude.replace(now);
        let high = self.heard.motion.is_some_and(|motion| motion.height_m > STEADY_ABOVE_M);
        let steady_s = burning_s.filter(|burning_s| high && *burning_s > STEADY_AFTER_S);
        let (Some(known), Some(before), Some(burning_s)) = (self.in_space.as_deref_mut(), before, steady_s)
        else {
            return Vec::new();
        };
        let scale = self.heard.descent.map_or(1.0, |descent| descent.thrust_scale);
        let burn = Burn { impulse_scale: scale, ..Burn::nominal(&known.mission.motor_curve) };
        let mass = known.mass.at(burn.burnt_kg(burning_s));
        let turning_rad_s2 = burn.thrust_n(burning_s) * mass.cg_station_m / mass.pitch_inertia_kg_m2;
        let found = known.turning.on_attitude(&before, &now, turning_rad_s2);
        let flag = found.map(|found| Flag {
            time_s: 0.0,
            boot_s: now.time_s,
            check: Check::Turning,
            signal: ["ATTITUDE_QUATERNION.pitchspeed", "ATTITUDE_QUATERNION.yawspeed"][found.axis],
            found: found.acted_deg,
            expected: found.commanded_deg,
            unit: "deg",
            means: "the vehicle turns as with this gimbal angle, not as with the commanded one".to_owned(),
        });
        flag.into_iter().collect()
    }

    fn on_motion(&mut self, now: Motion) -> Vec<Flag> {
        self.rates.position.note(now.time_s);
        let burning_s = self.burning_s(now.time_s);
        let before = self.heard.motion.replace(now);
        let felt = before.zip(burning_s).and_then(|(before, since_s)| self.felt(&before, &now, since_s));
        let (Some(known), Some(felt)) = (self.in_space.as_deref_mut(), felt) else { return Vec::new() };
        let off = known.thrust.take(&known.mission, felt);
        let flag = off.map(|off| Flag {
            time_s: 0.0,
            boot_s: now.time_s,
            check: Check::Thrust,
            signal: "LOCAL_POSITION_NED.vx, vy, vz",
            found: off.found_m_s2,
            expected: off.expected_m_s2,
            unit: "m/s2",
            means: "the acceleration along the nose is not that of the certified motor".to_owned(),
        });
        flag.into_iter().collect()
    }

    /// What two positions in a row show of the thrust.
    fn felt(&self, before: &Motion, now: &Motion, since_s: f64) -> Option<Felt> {
        let known = self.in_space.as_ref()?;
        let attitude = self.heard.attitude.as_ref()?;
        let interval_s = now.time_s - before.time_s;
        let fresh = (now.time_s - attitude.time_s).abs() < interval_s;
        if interval_s <= 0.0 || !fresh || now.height_m < STEADY_ABOVE_M {
            return None;
        }
        // To the middle of the interval.
        let mut turned = *attitude;
        let back_s = 0.5 * (before.time_s + now.time_s) - attitude.time_s;
        turned.ned_from_body *= nalgebra::UnitQuaternion::from_scaled_axis(attitude.rate_rad_s * back_s);
        let nose = turned.ned_from_body * Vector3::x();
        let gravity = Vector3::z() * known.mission.gravity_m_s2;
        let acceleration_m_s2 = (now.velocity_m_s - before.velocity_m_s) / interval_s - gravity;
        let burn = Burn::nominal(&known.mission.motor_curve);
        let mass = known.mass.at(burn.burnt_kg(since_s));
        let descent = self.heard.descent.as_ref()?;
        let through_air_m_s = turned.ned_from_body.inverse_transform_vector(
            &(0.5 * (before.velocity_m_s + now.velocity_m_s) - descent.wind_ned_m_s),
        );
        let vehicle = VehicleNow::of(
            &known.mission.airframe,
            &mass,
            Air::at_height_m(known.mission.pad_altitude_m + now.height_m).density_kg_m3,
            self.heard.fins?.measured_rad,
            true,
            known.mission.lidar_ahead_of_feet_m,
        );
        let vehicle = vehicle.in_exhaust(&known.mission.exhaust);
        let air_n = descent.drag_scale * vehicle.air_force_n(&through_air_m_s, &attitude.rate_rad_s).x;
        Some(Felt {
            since_s,
            interval_s,
            specific_force_m_s2: acceleration_m_s2.dot(&nose),
            mass_kg: mass.mass_kg,
            air_n,
        })
    }

    fn on_descent(&mut self, now: Descent) -> Vec<Flag> {
        self.rates.descent.note(now.time_s);
        self.heard.descent = Some(now);
        let mut flags = self.on_strength(now.time_s, now.thrust_scale, "TD_DESCENT.thrust_scale");
        flags.extend(self.other_ignition(&now));
        flags
    }

    fn other_ignition(&mut self, now: &Descent) -> Option<Flag> {
        let deciding = matches!(self.heard.phase, Some(Phase::AeroDescent | Phase::LandArmed));
        let known = self.in_space.as_deref_mut().filter(|known| deciding && !known.ignition_flagged)?;
        let expected_m = ignition::other_height_m(&known.mission, now, self.heard.fins.as_ref()?)?;
        known.ignition_flagged = true;
        Some(Flag {
            time_s: 0.0,
            boot_s: now.time_s,
            check: Check::Ignition,
            signal: "TD_DESCENT.chosen_height_m",
            found: now.chosen_m,
            expected: expected_m,
            unit: "m",
            means: "the flight computer of this build lights the motor at another height".to_owned(),
        })
    }

    fn on_strength(&mut self, at_s: f64, strength: f64, signal: &'static str) -> Vec<Flag> {
        let burning_s = self.burning_s(at_s);
        let (Some(known), Some(since_s)) = (self.in_space.as_deref_mut(), burning_s) else {
            return Vec::new();
        };
        let falls_m_s = self.heard.descent.map_or(FALLS_M_S, |descent| -descent.vertical_m_s);
        let watch = known.strength.get_or_insert_with(|| StrengthWatch::new(&known.mission, falls_m_s));
        let flag = watch.take(since_s, strength).map(|weak| {
            let (expected, means) = match weak {
                Weak::FromTheLight { lowest, found } => (
                    1.0,
                    format!(
                        "the motor is {:.0} % weak; the certified scatter ends at {lowest:.3}",
                        100.0 * (1.0 - found)
                    ),
                ),
                Weak::AllAtOnce { found, before } => (
                    before,
                    format!("the motor has lost {:.0} % all at once", 100.0 * (1.0 - found / before)),
                ),
            };
            Flag {
                time_s: 0.0,
                boot_s: at_s,
                check: Check::MotorStrength,
                signal,
                found: strength,
                expected,
                unit: "",
                means,
            }
        });
        flag.into_iter().collect()
    }

    fn on_gimbal(&mut self, told: &TD_GIMBAL_DATA) -> Vec<Flag> {
        let at_s = boot_s(told.time_boot_ms);
        self.rates.gimbal.note(at_s);
        let axes = [
            (told.pitch_commanded, told.pitch_measured, "TD_GIMBAL.pitch_measured"),
            (told.yaw_commanded, told.yaw_measured, "TD_GIMBAL.yaw_measured"),
        ];
        let angles = axes.map(|(commanded, measured, _)| Axis {
            commanded_deg: degrees(commanded),
            measured_deg: degrees(measured),
        });
        if self.heard.phase != Some(Phase::Powered) {
            return Vec::new();
        }
        if let Some(known) = self.in_space.as_deref_mut() {
            known.turning.on_gimbal(at_s, angles);
        }
        let servos = self.gimbal.iter_mut().zip(angles).zip(axes);
        let stuck = servos.filter_map(|((servo, angle), (_, _, signal))| {
            stuck(servo, at_s, angle, STUCK_GIMBAL, (Check::Gimbal, signal))
        });
        stuck.collect()
    }

    fn on_fins(&mut self, told: &TD_FINS_DATA) -> Vec<Flag> {
        const SIGNALS: [&str; 4] =
            ["TD_FINS.measured[0]", "TD_FINS.measured[1]", "TD_FINS.measured[2]", "TD_FINS.measured[3]"];
        let at_s = boot_s(told.time_boot_ms);
        self.rates.fins.note(at_s);
        self.heard.fins = Some(told.into());
        let steers = matches!(
            self.heard.phase,
            Some(Phase::AeroDescent | Phase::LandArmed | Phase::Ignition | Phase::Powered)
        );
        if !steers {
            return Vec::new();
        }
        let angles = told.commanded.into_iter().zip(told.measured);
        let servos = self.fins.iter_mut().zip(angles).zip(SIGNALS);
        let stuck = servos.filter_map(|((servo, (commanded, measured)), signal)| {
            let angle = Axis { commanded_deg: degrees(commanded), measured_deg: degrees(measured) };
            stuck(servo, at_s, angle, STUCK_FIN, (Check::Fins, signal))
        });
        stuck.collect()
    }
}

/// Time from the beginning of the thrust to a tenth of its peak, s.
fn rises_s(mission: &Mission) -> f64 {
    let curve = &mission.motor_curve;
    let mark_n = 0.1 * curve.peak_thrust_n();
    let steps = (0..300).map(|step| 0.001 * f64::from(step));
    steps.into_iter().find(|time_s| curve.thrust_at_n(*time_s) >= mark_n).unwrap_or(0.0)
}

/// The flag of a servo that is stuck.
fn stuck(
    servo: &mut FollowingWatch,
    at_s: f64,
    angle: Axis,
    shown_by: Stuck,
    (check, signal): (Check, &'static str),
) -> Option<Flag> {
    let Axis { commanded_deg, measured_deg } = angle;
    servo.take(at_s, commanded_deg, measured_deg, shown_by).then(|| Flag {
        time_s: 0.0,
        boot_s: at_s,
        check,
        signal,
        found: measured_deg,
        expected: commanded_deg,
        unit: "deg",
        means: "the servo stands still although its command is elsewhere".to_owned(),
    })
}
