//! Judges the inputs of a flight computer: some values are impossible in any flight.
//!
//! An input that decides nothing could be changed in a log without a divergence. A value outside
//! the range of its sensor, or one that does not follow from the frame before it, reveals the
//! change.

use avionics::log::frame::phase_of;
use flight::computer::{FRAME_S, flight_time_s};
use flight::rules::phase::Phase;
use protocol::log::computer_v1::{ComputerFrame, ComputerInput};
use protocol::log::flight_v1::{GnssFix, Measurements, Vector3};

/// No servo turns further, rad.
const ANGLE_MAX_RAD: f64 = 2.0;
/// No battery of a model rocket has more, V.
const BATTERY_MAX_V: f64 = 60.0;
/// Servos change a battery's voltage by no more in one frame, V: 5 A over 0.2 ohm.
const BATTERY_STEP_V: f64 = 1.0;
/// Igniters draw what they want, V, for this long after an output was switched, s.
const FIRED_STEP_V: f64 = 10.0;
const FIRED_S: f64 = 0.2;
/// No gyro has a wider range, rad/s.
const RATE_MAX_RAD_S: f64 = 200.0;
/// No accelerometer of a model rocket has a wider range, m/s2.
const FORCE_MAX_M_S2: f64 = 5_000.0;
/// No model rocket flies higher or further, m, or faster, m/s.
const PLACE_MAX_M: f64 = 20_000.0;
const SPEED_MAX_M_S: f64 = 1_000.0;
/// No lidar of a model rocket sees further, m.
const RANGE_MAX_M: f64 = 1_000.0;
/// A fix is older than this only if the receiver is dead, s.
const FIX_AGE_MAX_S: f64 = 60.0;
/// Larger than any disk, bytes; a flight without a log says `u64::MAX`.
const SPACE_MAX_BYTES: u64 = 1 << 50;
/// Largest change of the free space of the log's disk between two queries (1 s), bytes.
const SPACE_STEP_BYTES: u64 = 1 << 35;
/// Tolerance for rounding, and for a clock that measures ages, s.
const ROUNDING_S: f64 = 1e-3;

/// What is looked at from frame to frame.
#[derive(Debug, Clone, Default)]
pub(super) struct Inputs {
    last: Option<LastInput>,
    /// The frame of the release, once it is known.
    release_frame: Option<u64>,
    /// The outputs of the last frame, and the frame that last switched one.
    outputs: [bool; 4],
    switched: u64,
}

#[derive(Debug, Clone)]
struct LastInput {
    input: ComputerInput,
    in_flight: bool,
    /// A foot touches the ground before the landing motor is ignited.
    struck: bool,
}

impl Inputs {
    /// Why the input of a frame cannot be; `None` if it can. `since_release`: the frame's number in
    /// flight.
    pub(super) fn judge(&mut self, frame: &ComputerFrame, since_release: Option<u64>) -> Option<String> {
        let ComputerFrame { input, output, .. } = frame;
        if let Some(number) = since_release {
            self.release_frame = input.frame.checked_sub(number);
        }
        let now = LastInput {
            input: input.clone(),
            in_flight: since_release.is_some(),
            struck: input.contact && phase_of(output).is_some_and(|phase| phase < Phase::Ignition),
        };
        let fired = flight_time_s(input.frame.saturating_sub(self.switched)) <= FIRED_S;
        let step_v = if fired { FIRED_STEP_V } else { BATTERY_STEP_V };
        let outputs = [output.ignite, output.parachute, output.ignite_booster, output.separate_booster];
        if outputs != self.outputs {
            (self.outputs, self.switched) = (outputs, input.frame);
        }
        let before = self.last.as_ref();
        let impossible = out_of_range(input, self.release_frame)
            .or_else(|| before.and_then(|before| out_of_order(before, &now, step_v)));
        self.last = Some(now);
        impossible
    }
}

fn out_of_range(input: &ComputerInput, release_frame: Option<u64>) -> Option<String> {
    let time_s = flight_time_s(input.frame);
    if input.time_s.to_bits() != time_s.to_bits() {
        return Some(format!("time {:?} s: the frame is at {time_s} s", input.time_s));
    }
    let space = input.log.space_bytes;
    if space > SPACE_MAX_BYTES && space != u64::MAX {
        return Some(format!("{space} bytes of space for the log: no disk has as many"));
    }
    // Fixes are on the clock of the flight: from power-up, and from the release on T+.
    let clock_s = flight_time_s(input.frame.saturating_sub(release_frame.unwrap_or(0)));
    let Measurements { imu, pressure_altitude_m, gnss, lidar_range_m } = &input.measured;
    let within = |most: f64| [-most, most];
    let uplinks = input.requests.iter().map(|request| &request.uplink).chain([&input.uplink]);
    let uplink_ages: Vec<f64> = uplinks.filter_map(|uplink| uplink.as_ref()?.age_s).collect();
    let commander_age_s = commander_age_s(input);
    let [gyro, force] = [imu.gyro_rad_s, imu.specific_force_m_s2].map(vector);
    let of_fix = |value: fn(&GnssFix) -> Vector3| gnss.iter().flat_map(|fix| vector(value(fix))).collect();
    let [place, velocity]: [Vec<f64>; 2] = [of_fix(|fix| fix.position_m), of_fix(|fix| fix.velocity_m_s)];
    let fix_s = gnss.map(|fix| fix.valid_at_s);
    let ages = [-ROUNDING_S, f64::MAX];
    // What a value is, the values, the least and the greatest that it can have, and whether it is
    // of a sensor, which reports NaN if it is silent or broken.
    let rows: [(&str, &[f64], [f64; 2], bool); 12] = [
        ("angle of a servo, rad,", &input.gimbal_rad, within(ANGLE_MAX_RAD), false),
        ("angle of a servo, rad,", &input.fins_rad, within(ANGLE_MAX_RAD), false),
        ("battery, V,", input.battery_v.as_slice(), [0.0, BATTERY_MAX_V], false),
        ("age of the uplink, s,", &uplink_ages, ages, false),
        ("age of the commander, s,", commander_age_s.as_slice(), ages, false),
        ("time of a fix, s,", fix_s.as_slice(), [clock_s - FIX_AGE_MAX_S, clock_s + ROUNDING_S], false),
        ("gyro, rad/s,", &gyro, within(RATE_MAX_RAD_S), true),
        ("accelerometer, m/s2,", &force, within(FORCE_MAX_M_S2), true),
        ("pressure altitude, m,", pressure_altitude_m.as_slice(), within(PLACE_MAX_M), true),
        ("lidar range, m,", lidar_range_m.as_slice(), within(RANGE_MAX_M), true),
        ("position of GNSS, m,", &place, within(PLACE_MAX_M), true),
        ("velocity of GNSS, m/s,", &velocity, within(SPEED_MAX_M_S), true),
    ];
    rows.into_iter().find_map(|(what, values, [lowest, highest], may_be_nan)| {
        let can_be = |value: &f64| (lowest..=highest).contains(value) || may_be_nan && value.is_nan();
        let outside = values.iter().find(|value| !can_be(value))?;
        Some(format!("{what} {outside:?}: can be {lowest} to {highest}"))
    })
}

fn vector(Vector3 { x, y, z }: Vector3) -> [f64; 3] {
    [x, y, z]
}

fn commander_age_s(input: &ComputerInput) -> Option<f64> {
    input.commander.as_ref().map(|commander| commander.age_s)
}

fn out_of_order(last: &LastInput, this: &LastInput, step_v: f64) -> Option<String> {
    let (before, now) = (&last.input, &this.input);
    let passed_s = now.frame.saturating_sub(before.frame) as f64 * FRAME_S;
    // An age grows with time, or restarts with the next reception.
    let aged = |what: &str, then: Option<f64>, now: Option<f64>| {
        let (then, now) = (then?, now?);
        (now > then + passed_s + ROUNDING_S)
            .then(|| format!("{what} is {now:?} s old, {passed_s:.3} s after it was {then:?} s old"))
    };
    let flew = last.in_flight && this.in_flight;
    if flew && before.pin_out && !now.pin_out {
        return Some("the pin is in again, in flight".to_owned());
    }
    if flew && now.booster_attached && !before.booster_attached {
        return Some("the booster is attached again, in flight".to_owned());
    }
    if flew && last.struck && !this.struck {
        return Some("the contact has ended before the landing motor was ignited".to_owned());
    }
    let [then, space] = [before.log.space_bytes, now.log.space_bytes];
    // A disk that does not answer has none.
    if then.min(space) > 0 && then.abs_diff(space) > SPACE_STEP_BYTES && before.log.running == now.log.running
    {
        return Some(format!("space for the log goes from {then} to {space} bytes in {passed_s:.3} s"));
    }
    if let (Some(then), Some(now)) = (before.battery_v, now.battery_v)
        && (now - then).abs() > step_v
    {
        return Some(format!("the battery goes from {then:?} to {now:?} V in {passed_s:.3} s"));
    }
    let uplink_age_s = |input: &ComputerInput| input.uplink.as_ref()?.age_s;
    aged("the uplink", uplink_age_s(before), uplink_age_s(now))
        .or_else(|| aged("the commander", commander_age_s(before), commander_age_s(now)))
}
