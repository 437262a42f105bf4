//! The arming checks on the pad, and the type of a check.

use arrayvec::ArrayVec;
use serde::Serialize;

use crate::estimation::sensor_watch::SENSORS;
use crate::rules::phase::UPLINK_PROVEN_S;
use crate::rules::verdict::LandingVerdict;
use crate::text::{Text, text};
use crate::vehicle::drop::LOWEST_ARMED_M;
use crate::vehicle::mission::ArmingLimits;

/// The radio link to the station that requests arming.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Uplink {
    /// The vehicle starts by itself: there is no station.
    NotNeeded,
    /// No heartbeat of the station was ever accepted.
    #[default]
    NeverReceived,
    /// Time since its last accepted heartbeat.
    Received { age_s: f64 },
}

/// The end of a rehearsed landing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PredictedLanding {
    /// Inside every touchdown limit.
    pub lands: bool,
    /// The broken limits with their values, as text.
    pub found: Text,
}

impl From<&LandingVerdict> for PredictedLanding {
    fn from(verdict: &LandingVerdict) -> Self {
        Self { lands: verdict.is_inside(), found: text!("{}", verdict.summary()) }
    }
}

/// Number of people who must have seen the surfaces move on a vehicle without servo feedback.
pub const SEERS: usize = 2;

/// The inputs of the arming checks.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmingInput {
    /// The physical pin has been pulled.
    pub pin_out: bool,
    pub abort_latched: bool,
    /// Time until the pad may be approached after an abort, also of an earlier power-up, s.
    pub pad_wait_s: Option<f64>,
    /// Tilt from the vertical, rad.
    pub tilt_rad: f64,
    /// Rotation rate, rad/s.
    pub rotation_rad_s: f64,
    pub speed_m_s: f64,
    pub self_test_passed: bool,
    /// A vehicle check moves the surfaces, or observes the sensors.
    pub is_checking: bool,
    /// The defect of each of the [`SENSORS`], as text.
    pub sensor_defects: [Option<Text>; SENSORS.len()],
    /// Height of a vehicle that hangs below a drone, m; `None` on a pad.
    pub hanging_m: Option<f64>,
    /// The estimator has settled.
    pub estimator_converged: bool,
    /// Number of fins that reached their commanded angle.
    pub fins_answering: [bool; 4],
    /// Number of people who have seen the surfaces move on a vehicle without servo feedback; `None`
    /// with feedback.
    pub seers: Option<usize>,
    /// The landing motor's igniter has continuity.
    pub igniter_continuity: bool,
    /// The log is being written.
    pub log_running: bool,
    /// Free space for the log, bytes.
    pub log_space_bytes: u64,
    /// Voltage of the flight computer's pack, V; `None` if it is not measured.
    pub battery_v: Option<f64>,
    /// The same of the pack of servos and igniters.
    pub servo_battery_v: Option<f64>,
    /// The rehearsal of the landing found plans and landed.
    pub controller_warm: bool,
    /// The rehearsal's outcome as text.
    pub controller_found: Text,
    /// The verdict on the rehearsal's end by the touchdown limits; `None` without a rehearsal.
    pub predicted_landing: Option<PredictedLanding>,
    /// The radio link to the requesting station.
    pub uplink: Uplink,
}

/// The arming checks.
pub type Checks = ArrayVec<Check, { 16 + SENSORS.len() }>;

/// Every arming check with its value, in the order in which an operator resolves them.
pub fn arming_checks(limits: &ArmingLimits, input: &ArmingInput) -> Checks {
    List { checks: Checks::new(), failing_only: false }.filled(limits, input)
}

/// The arming checks that fail: no text of the others is written.
pub fn failing_checks(limits: &ArmingLimits, input: &ArmingInput) -> Checks {
    List { checks: Checks::new(), failing_only: true }.filled(limits, input)
}

/// The name of the uplink check, the only check that depends on the ground.
pub const UPLINK_CHECK: &str = "uplink";

/// A checklist being written.
struct List {
    checks: Checks,
    failing_only: bool,
}

impl List {
    fn filled(mut self, limits: &ArmingLimits, input: &ArmingInput) -> Checks {
        let not_clear = match input.pad_wait_s.filter(|_| !input.abort_latched) {
            Some(wait_s) => text!("keep away for {wait_s:.0} s"),
            None => text!("latched: restart to clear it"),
        };
        let is_clear = !input.abort_latched && input.pad_wait_s.is_none();
        self.condition("abort latch", is_clear, "clear", &not_clear);
        self.condition("pin", input.pin_out, "out", "in");
        let not_passed = if input.is_checking { "a check of the vehicle runs" } else { "not passed" };
        self.condition("self-test", input.self_test_passed && !input.is_checking, "passed", not_passed);
        // Before the checks of derived values: the faulty sensor is named, not the value that it
        // spoils. The defect contains the sensor's name.
        for (name, defect) in SENSORS.into_iter().zip(&input.sensor_defects) {
            self.add(name, defect.is_none(), || [defect.unwrap_or_else(|| text!("speaks")), Text::new()]);
        }
        self.at_most("rotation", input.rotation_rad_s.to_degrees(), limits.rotation_max_deg_s, "deg/s");
        self.at_most("tilt from vertical", input.tilt_rad.to_degrees(), limits.tilt_max_deg, "deg");
        self.at_most("speed", input.speed_m_s, limits.speed_max_m_s, "m/s");
        self.condition("estimator", input.estimator_converged, "converged", "not converged");
        self.fins_answering(input);
        self.condition("igniter continuity", input.igniter_continuity, "closed circuit", "open circuit");
        self.condition("log", input.log_running, "running", "not running");
        self.add("log space", input.log_space_bytes >= limits.log_space_min_bytes, || {
            let required = text!("at least {} MiB", limits.log_space_min_bytes >> 20);
            [text!("{} MiB", input.log_space_bytes >> 20), required]
        });
        let rehearsed = || [input.controller_found, text!("a rehearsal that lands")];
        self.add("controller warm", input.controller_warm, rehearsed);
        let landing = input.predicted_landing.as_ref();
        self.add("predicted touchdown", landing.is_some_and(|landing| landing.lands), || {
            let found = landing.map_or_else(|| text!("no prediction"), |landing| landing.found);
            [found, text!("inside every touchdown limit")]
        });
        self.uplink(input.uplink);
        self.battery(limits, input.battery_v, input.servo_battery_v);
        if let Some(height_m) = input.hanging_m {
            let texts = || [text!("{height_m:.1} m"), text!("at least {LOWEST_ARMED_M} m")];
            self.add("height below the drone", height_m >= LOWEST_ARMED_M, texts);
        }
        self.checks
    }

    /// Adds a check with the text of the value found and of the value required.
    fn add(&mut self, name: &'static str, passed: bool, texts: impl FnOnce() -> [Text; 2]) {
        if !(passed && self.failing_only) {
            let [found, required] = texts();
            self.checks.push(Check { name, passed, found, required });
        }
    }

    /// Adds a check of a yes-or-no condition, with a text for each result.
    fn condition(&mut self, name: &'static str, passed: bool, yes: &str, no: &str) {
        self.add(name, passed, || [text!("{}", if passed { yes } else { no }), text!("{yes}")]);
    }

    /// Adds a check of a magnitude against a limit. NaN fails.
    fn at_most(&mut self, name: &'static str, value: f64, limit: f64, unit: &str) {
        self.add(name, value.abs() <= limit, || {
            let found = if value.is_nan() { text!("not known") } else { text!("{:.2} {unit}", value.abs()) };
            [found, text!("at most {limit} {unit}")]
        });
    }

    fn uplink(&mut self, uplink: Uplink) {
        let is_recent = matches!(uplink, Uplink::Received { age_s } if age_s <= UPLINK_PROVEN_S);
        let passed = uplink == Uplink::NotNeeded || is_recent;
        self.add(UPLINK_CHECK, passed, || {
            let found = match uplink {
                Uplink::NotNeeded => text!("not needed: the vehicle starts by itself"),
                Uplink::NeverReceived => text!("no heartbeat of this station"),
                Uplink::Received { age_s } => text!("heartbeat {age_s:.1} s old"),
            };
            [found, text!("a heartbeat of the asking station in the last {UPLINK_PROVEN_S} s")]
        });
    }

    /// Without feedback a servo is assumed to follow its command: then people must have seen it
    /// move.
    fn fins_answering(&mut self, input: &ArmingInput) {
        let answering = input.fins_answering.iter().filter(|answers| **answers).count();
        let all = input.fins_answering.len();
        self.add("fins answering", input.seers.map_or(answering == all, |seers| seers >= SEERS), || {
            match input.seers {
                None => [text!("{answering} of 4"), text!("4 of 4")],
                Some(seers) => [
                    text!("servos that tell nothing, seen by {seers}"),
                    text!("{SEERS} people who saw a check move them"),
                ],
            }
        });
    }

    /// The computer's pack, unless the other one alone is too low: that is found on its own limit.
    fn battery(&mut self, limits: &ArmingLimits, battery_v: Option<f64>, servo_battery_v: Option<f64>) {
        let passed = battery_v.is_none_or(|volts| volts >= limits.battery_min_v);
        let too_low = |volts: &f64| volts.is_nan() || *volts < limits.servo_battery_min_v;
        let servos_v = servo_battery_v.filter(|volts| passed && too_low(volts));
        self.add("battery", passed && servos_v.is_none(), || match (servos_v, battery_v) {
            (Some(volts), _) => {
                [text!("servos {volts:.2} V"), text!("at least {:.1} V", limits.servo_battery_min_v)]
            }
            (None, battery_v) => {
                let found = battery_v.map_or_else(|| text!("not measured"), |volts| text!("{volts:.2} V"));
                [found, text!("at least {:.1} V", limits.battery_min_v)]
            }
        });
    }
}

// One line of a checklist: what is required, and what was found.

/// A check with its result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Check {
    /// What was checked.
    pub name: &'static str,
    /// Whether it passed.
    pub passed: bool,
    /// The value found, with its unit.
    pub found: Text,
    /// The value required, with its unit.
    pub required: Text,
}

impl Check {
    /// The refusal as text, or `None` if passed.
    pub fn refusal(&self) -> Option<Text> {
        let Self { name, found, required, .. } = self;
        let words = || {
            if required.is_empty() { *found } else { text!("{name}: found {found}, required {required}") }
        };
        (!self.passed).then(words)
    }
}

/// Whether every check passed.
pub fn all_passed(checks: &[Check]) -> bool {
    checks.iter().all(|check| check.passed)
}

/// The first failed check as text, or `None` if all passed.
pub fn first_refusal(checks: &[Check]) -> Option<Text> {
    checks.iter().find_map(Check::refusal)
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::*;

    fn ready() -> ArmingInput {
        ArmingInput {
            pin_out: true,
            abort_latched: false,
            pad_wait_s: None,
            tilt_rad: 0.01,
            rotation_rad_s: 0.0,
            speed_m_s: 0.0,
            self_test_passed: true,
            is_checking: false,
            sensor_defects: [const { None }; SENSORS.len()],
            hanging_m: None,
            estimator_converged: true,
            fins_answering: [true; 4],
            seers: None,
            igniter_continuity: true,
            log_running: true,
            log_space_bytes: 1 << 30,
            battery_v: Some(ArmingLimits::default().battery_min_v),
            servo_battery_v: Some(ArmingLimits::default().servo_battery_min_v),
            controller_warm: true,
            controller_found: text!("converged"),
            predicted_landing: Some(PredictedLanding { lands: true, found: Text::new() }),
            uplink: Uplink::Received { age_s: UPLINK_PROVEN_S },
        }
    }

    #[test]
    fn a_ready_vehicle_passes_every_check() {
        let checks = arming_checks(&ArmingLimits::default(), &ready());
        assert!(all_passed(&checks));
        assert_eq!(first_refusal(&checks), None);
        // Without a crew no station is needed.
        let alone = ArmingInput { uplink: Uplink::NotNeeded, ..ready() };
        assert!(all_passed(&arming_checks(&ArmingLimits::default(), &alone)));
    }

    /// A faulty input, and the check that must refuse it.
    type Spoiling = (&'static str, fn(&mut ArmingInput));

    #[test]
    fn each_check_alone_refuses_and_reports_its_name_and_value() {
        let spoilings: [Spoiling; 26] = [
            ("fins answering: found servos that tell nothing, seen by 1, required 2 people", |input| {
                input.seers = Some(1);
            }),
            ("abort latch: found latched", |input| {
                input.abort_latched = true;
            }),
            ("abort latch: found keep away for 43 s", |input| {
                input.pad_wait_s = Some(43.2);
            }),
            ("pin: found in, required out", |input| {
                input.pin_out = false;
            }),
            ("self-test: found not passed", |input| {
                input.self_test_passed = false;
            }),
            ("self-test: found a check of the vehicle runs", |input| {
                input.is_checking = true;
            }),
            ("no GNSS fix for 9 s", |input| {
                input.sensor_defects[3] = Some(text!("no GNSS fix for 9 s"));
            }),
            ("lidar silent", |input| {
                input.sensor_defects[4] = Some(text!("lidar silent for 2 s"));
            }),
            ("tilt from vertical: found 6.00 deg, required at most 5 deg", |input| {
                input.tilt_rad = 6.0_f64.to_radians();
            }),
            ("tilt from vertical: found not known", |input| {
                input.tilt_rad = f64::NAN;
            }),
            ("rotation: found", |input| {
                input.rotation_rad_s = -0.5;
            }),
            ("speed: found 1.00 m/s", |input| {
                input.speed_m_s = 1.0;
            }),
            ("estimator: found not converged", |input| {
                input.estimator_converged = false;
            }),
            ("fins answering: found 3 of 4", |input| {
                input.fins_answering[2] = false;
            }),
            ("igniter continuity: found open circuit", |input| {
                input.igniter_continuity = false;
            }),
            ("log: found not running", |input| {
                input.log_running = false;
            }),
            ("log space: found 1 MiB", |input| {
                input.log_space_bytes = 1 << 20;
            }),
            ("battery: found 7.39 V, required at least 7.4 V", |input| {
                input.battery_v = Some(7.39);
            }),
            ("battery: found servos 11.09 V, required at least 11.1 V", |input| {
                input.servo_battery_v = Some(11.09);
            }),
            ("battery: found servos NaN V", |input| {
                input.servo_battery_v = Some(f64::NAN);
            }),
            ("battery: found NaN V", |input| {
                input.battery_v = Some(f64::NAN);
            }),
            ("controller warm: found", |input| {
                input.controller_warm = false;
            }),
            ("predicted touchdown: found no prediction", |input| {
                input.predicted_landing = None;
            }),
            ("uplink: found no heartbeat", |input| {
                input.uplink = Uplink::NeverReceived;
            }),
            ("uplink: found heartbeat 2.1 s old", |input| {
                input.uplink = Uplink::Received { age_s: 2.1 };
            }),
            ("uplink: found heartbeat NaN s old", |input| {
                input.uplink = Uplink::Received { age_s: f64::NAN };
            }),
        ];
        for (expected, spoil) in spoilings {
            let mut input = ready();
            spoil(&mut input);
            let checks = arming_checks(&ArmingLimits::default(), &input);
            let failing: Vec<_> = checks.iter().filter(|check| !check.passed).cloned().collect();
            assert_eq!(failing.len(), 1, "{expected}");
            assert_eq!(failing_checks(&ArmingLimits::default(), &input)[..], failing);
            let refusal = first_refusal(&checks).unwrap();
            assert!(refusal.starts_with(expected), "{refusal}");
        }
    }
}
