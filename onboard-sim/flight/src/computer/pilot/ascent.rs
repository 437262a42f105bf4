//! Detects lift-off, burnout, the time to separate the booster, and apogee from the sensors; also a
//! stuck fin.

use serde::{Deserialize, Serialize};

use super::vertical_speed::{APART_OF_TWO_M_S, RATE_OVER_S, VerticalSpeeds};
use crate::computer::messages::Severity;
use crate::computer::pad::ANSWERING_RAD;
use crate::rules::phase::{Event, Phase};
use crate::text::{Text, text};
use crate::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;

/// Axial specific force above which the vehicle is under thrust, m/s^2. At rest it is 9.8; the
/// slowest lift-off that the rail guides well has 5 times the weight.
const PUSHED_M_S2: f64 = 1.5 * STANDARD_GRAVITY_M_S2;
/// Speed gained without interruption that counts as lift-off, m/s. A knock of 20 g for 10 ms gives
/// 2 m/s.
const LIFTED_OFF_M_S: f64 = 3.0;
/// Longest time from the ignition command to lift-off, s. Igniters of ascent motors need up to 2 s.
const LIFT_OFF_WITHIN_S: f64 = 3.0;
/// Deceleration time after which the motor counts as burned out, s. Drag alone decelerates at once;
/// a dip of the thrust below the drag is shorter.
const BRAKING_S: f64 = 0.1;
/// Shares of the motor's burn time between which burnout is detected; it is assumed at the second.
/// Burn times scatter by 4 %, and a failed accelerometer cannot end the boost.
const BURNS_FOR: [f64; 2] = [0.6, 1.5];
/// Consecutive falling frames that make an apogee: 15 ms, in which the vehicle falls by 1 mm.
const FALLING_FRAMES: u32 = 3;
/// Drop below the highest pressure altitude, m, that for [`SUNK_S`] indicates a passed apogee, if
/// no other source shows a climb. It is six times the noise of a barometer in its own exhaust or
/// wake.
const SUNK_M: f64 = 6.0;
const SUNK_S: f64 = 0.2;
/// Rise above the first pressure altitude, m, that for [`RISEN_S`] indicates a lift-off, whatever
/// the accelerometer shows. Gusts over the static ports show a metre or two.
const RISEN_M: f64 = 15.0;
const RISEN_S: f64 = 0.1;
/// Pressure climb rate, m/s, above which the vehicle climbs and has not sunk.
const CLIMBS_M_S: f64 = 10.0;
/// Time after the separation charge in which the internal pressure is not that of the air, s: three
/// times its time constant of 0.3 s.
const CHARGE_LASTS_S: f64 = 1.0;
/// Time in which another sensor confirms a sensed lift-off, s: the weakest motor that leaves the
/// rail rises by 10 m in it. After it, what follows the push decides: a flight falls freely, also
/// with a blocked static port.
const CONFIRMED_WITHIN_S: f64 = 2.0;
/// Specific force below which the vehicle falls freely, or deviation from gravity along the axis
/// within which it is upright on its pad, m/s^2, and how long either must last, s. Near apogee the
/// drag of the slowest ascent is smaller for longer.
const FALLS_M_S2: f64 = 0.3 * STANDARD_GRAVITY_M_S2;
const FALLS_S: f64 = 1.0;
/// Time after which a lift-off without any of these is rejected, s: no coast brakes for longer.
const DECIDED_WITHIN_S: f64 = 20.0;
/// Limits within which a vehicle is at rest: distance from its first pressure altitude, m, and
/// speed in a fix, m/s.
const STANDS_M: f64 = 5.0;
const STANDS_M_S: f64 = 3.0;
/// Sensor data of a frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct AscentReadings {
    pub(super) time_s: f64,
    pub(super) frame_s: f64,
    pub(super) phase: Phase,
    /// Along the axis, measured, m/s^2.
    pub(super) axial_specific_force_m_s2: f64,
    /// Its magnitude in all directions, m/s^2.
    pub(super) specific_force_m_s2: f64,
    pub(super) pressure_altitude_m: Option<f64>,
    pub(super) speeds: VerticalSpeeds,
    /// Estimated, upwards, m/s.
    pub(super) vertical_m_s: f64,
    /// The wire between booster and vehicle is intact.
    pub(super) booster_attached: bool,
    pub(super) separate_before_apogee_s: f64,
    /// Burn time of the ascent motor, s.
    pub(super) burn_time_s: f64,
}

with_defaults! {
    /// State of the ascent monitor.
    #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
    pub(crate) struct AscentWatch {
        /// Speed gained on the rail, m/s; zero while there is no thrust.
        pub(crate) gained_m_s: f64 = 0.0,
        lifted_off: bool = false,
        lifted_off_at_s: f64 = 0.0,
        /// Lift-off is confirmed by a second source.
        confirmed: bool = false,
        /// The sensed lift-off was rejected: the accelerometer alone is not accepted any more.
        denied: bool = false,
        /// Times since an unconfirmed lift-off for which it falls freely, and stands upright, s.
        falls_s: f64 = 0.0,
        stands_s: f64 = 0.0,
        braking_s: f64 = 0.0,
        separating_since_s: Option<f64> = None,
        parted: bool = false,
        falling_frames: u32 = 0,
        highest_m: f64 = f64::NEG_INFINITY,
        sunk_s: f64 = 0.0,
        /// Largest estimated speed since the pressure shows a fall, m/s.
        sunk_from_m_s: f64 = 0.0,
        /// The first pressure altitude.
        ground_m: Option<f64> = None,
        risen_s: f64 = 0.0,
    }
}

impl AscentWatch {
    /// The vehicle has left its rail.
    pub(crate) fn has_lifted_off(&self) -> bool {
        self.lifted_off
    }

    /// Whether the booster is to be separated: apogee is near, or has passed.
    pub(crate) fn separates(&self) -> bool {
        self.separating_since_s.is_some()
    }

    /// Returns whether the booster separates in this frame, as its wire shows.
    pub(super) fn parts(&mut self, booster_attached: bool) -> bool {
        let parts = self.separates() && !booster_attached && !self.parted;
        self.parted |= parts;
        parts
    }

    /// The event of this frame, if there is one.
    pub(super) fn update(&mut self, seen: &AscentReadings) -> Option<Event> {
        self.update_heights(seen);
        if !self.lifted_off {
            return self.wait_for_lift_off(seen);
        }
        if !self.confirmed {
            return self.confirm_the_lift_off(seen);
        }
        match seen.phase {
            Phase::Boost if self.has_burnt_out(seen) => Some(Event::Burnout),
            Phase::Coast if self.separation_is_due(seen) => {
                self.separating_since_s = Some(seen.time_s);
                Some(Event::SeparationDue)
            }
            Phase::Coast if self.has_passed_apogee(seen) => {
                Some(Event::Apogee { booster_attached: seen.booster_attached })
            }
            _ => None,
        }
    }

    /// Detects lift-off from the axial specific force of this frame, m/s^2.
    pub(super) fn detects_lift_off(&mut self, axial_m_s2: f64, frame_s: f64) -> bool {
        let gain_m_s = (axial_m_s2 - STANDARD_GRAVITY_M_S2) * frame_s;
        self.gained_m_s = if axial_m_s2 > PUSHED_M_S2 { self.gained_m_s + gain_m_s } else { 0.0 };
        self.lifted_off = self.gained_m_s >= LIFTED_OFF_M_S && !self.denied;
        self.lifted_off
    }

    fn wait_for_lift_off(&mut self, seen: &AscentReadings) -> Option<Event> {
        if self.detects_lift_off(seen.axial_specific_force_m_s2, seen.frame_s) {
            self.lifted_off_at_s = seen.time_s;
            return Some(Event::LiftOff);
        }
        // The barometer is used only while a lift-off is expected, also after an abort of the
        // ignition: over a day on the pad the weather changes it by 15 m.
        let expected = seen.phase == Phase::Boost || seen.time_s < LIFT_OFF_WITHIN_S;
        if expected && self.risen_s >= RISEN_S {
            (self.lifted_off, self.lifted_off_at_s) = (true, seen.time_s);
            return Some(Event::LiftOff);
        }
        (seen.phase == Phase::Boost && seen.time_s >= LIFT_OFF_WITHIN_S).then_some(Event::NoLiftOff)
    }

    /// Confirms a lift-off: thrust in the accelerometer alone is not enough. Any second source that
    /// shows motion confirms it, and so does free fall. Barometer or satellites at rest do not
    /// reject it: a static port may be blocked, and receivers lose track under thrust. It is
    /// rejected when the vehicle stands after the push, or when the push outlasts the motor.
    fn confirm_the_lift_off(&mut self, seen: &AscentReadings) -> Option<Event> {
        let (time_s, speeds) = (seen.time_s, &seen.speeds);
        let fix_m_s = speeds.gnss_m_s(time_s);
        let off_m =
            self.ground_m.zip(speeds.altitude_m(time_s)).map(|(ground_m, altitude_m)| altitude_m - ground_m);
        let pressure_m_s = speeds.pressure_m_s(time_s, None).unwrap_or(0.0);
        let moves = self.risen_s >= RISEN_S
            || off_m.is_some_and(|off_m| off_m.abs() > STANDS_M && pressure_m_s.abs() > STANDS_M_S)
            || fix_m_s.is_some_and(|m_s| m_s.abs() > STANDS_M_S);
        let axial_m_s2 = seen.axial_specific_force_m_s2;
        let stands = (axial_m_s2 - STANDARD_GRAVITY_M_S2).abs() < FALLS_M_S2;
        let falls = seen.specific_force_m_s2 < FALLS_M_S2;
        self.stands_s = lasts_s(self.stands_s, Some(stands), seen.frame_s);
        self.falls_s = lasts_s(self.falls_s, Some(falls), seen.frame_s);
        // A barometer needs some time before it gives a speed.
        let since_s = time_s - self.lifted_off_at_s;
        let no_other_source = off_m.is_none() && fix_m_s.is_none() && since_s > 2.0 * RATE_OVER_S;
        if moves || no_other_source {
            self.confirmed = true;
        } else if since_s >= CONFIRMED_WITHIN_S {
            let fell = self.falls_s >= FALLS_S && !speeds.accelerometer_lost;
            self.confirmed = fell || off_m.is_some_and(|off_m| off_m.abs() > STANDS_M);
            let outlasts = axial_m_s2 > PUSHED_M_S2 && since_s >= BURNS_FOR[1] * seen.burn_time_s;
            let rejected = outlasts || self.stands_s >= FALLS_S || since_s >= DECIDED_WITHIN_S;
            if rejected && !self.confirmed {
                (self.lifted_off, self.denied) = (false, true);
                return Some(Event::NoLiftOff);
            }
        }
        None
    }

    fn has_burnt_out(&mut self, seen: &AscentReadings) -> bool {
        let braking = seen.axial_specific_force_m_s2 < 0.0;
        self.braking_s = lasts_s(self.braking_s, Some(braking), seen.frame_s);
        let [early_s, late_s] = BURNS_FOR.map(|share| share * seen.burn_time_s);
        let since_s = seen.time_s - self.lifted_off_at_s;
        (self.braking_s >= BRAKING_S && since_s >= early_s) || since_s >= late_s
    }

    fn separation_is_due(&self, seen: &AscentReadings) -> bool {
        // The pressure may only delay separation: nothing separates while the vehicle climbs.
        let rises_m_s = self.rises_m_s(seen);
        let pressure_m_s = (seen.speeds.pressure_m_s(seen.time_s, None))
            .filter(|m_s| (m_s - rises_m_s).abs() <= APART_OF_TWO_M_S);
        let to_apogee_s = pressure_m_s.map_or(rises_m_s, |m_s| m_s.max(rises_m_s)) / STANDARD_GRAVITY_M_S2;
        self.separating_since_s.is_none() && to_apogee_s <= seen.separate_before_apogee_s
    }

    fn has_passed_apogee(&mut self, seen: &AscentReadings) -> bool {
        self.falling_frames = if self.rises_m_s(seen) < 0.0 { self.falling_frames + 1 } else { 0 };
        // Apogee by pressure needs satellites that confirm it. Without satellites it is accepted if
        // the estimate climbs slowly, or after the time in which a vehicle as fast as the estimate
        // would have fallen too.
        let sunk = match seen.speeds.gnss_m_s(seen.time_s) {
            Some(gnss_m_s) => gnss_m_s < 0.0 && self.sunk_s >= SUNK_S,
            None if seen.vertical_m_s <= APART_OF_TWO_M_S => self.sunk_s >= SUNK_S,
            None => self.sunk_s >= 1.0 + self.sunk_from_m_s / STANDARD_GRAVITY_M_S2,
        };
        self.falling_frames >= FALLING_FRAMES || sunk
    }

    fn rises_m_s(&self, seen: &AscentReadings) -> f64 {
        seen.speeds.rises_m_s(seen.vertical_m_s, seen.time_s, self.through_gas_s())
    }

    /// Time for which a pressure speed from before the separation charge stays valid, s.
    pub(super) fn through_gas_s(&self) -> Option<f64> {
        self.separating_since_s.is_some().then_some(CHARGE_LASTS_S + 3.0 * RATE_OVER_S)
    }

    /// Whether gas of the separation charge is still in the vehicle.
    pub(super) fn is_charged(&self, time_s: f64) -> bool {
        self.separating_since_s.is_some_and(|since_s| time_s - since_s < CHARGE_LASTS_S)
    }

    fn update_heights(&mut self, seen: &AscentReadings) {
        let disturbed = self.is_charged(seen.time_s);
        let sample_m = seen.pressure_altitude_m.filter(|altitude_m| altitude_m.is_finite());
        if let Some(altitude_m) = sample_m.filter(|_| !disturbed) {
            self.ground_m.get_or_insert(altitude_m);
            // A climbing vehicle has not sunk: after a downward jump the pressure climbs on from
            // there.
            let climbs = seen.speeds.pressure_m_s(seen.time_s, None).is_some_and(|m_s| m_s >= CLIMBS_M_S);
            self.highest_m = if climbs { altitude_m } else { self.highest_m.max(altitude_m) };
        }
        let ground_m = self.ground_m.unwrap_or(f64::INFINITY);
        let is_now =
            |compare: &dyn Fn(f64) -> bool| if disturbed { Some(false) } else { sample_m.map(compare) };
        let risen = is_now(&|altitude_m| altitude_m > ground_m + RISEN_M);
        let sunk = is_now(&|altitude_m| altitude_m < self.highest_m - SUNK_M);
        self.risen_s = lasts_s(self.risen_s, risen, seen.frame_s);
        self.sunk_s = lasts_s(self.sunk_s, sunk, seen.frame_s);
        let before_m_s = if self.sunk_s > 0.0 { self.sunk_from_m_s } else { 0.0 };
        self.sunk_from_m_s = before_m_s.max(seen.vertical_m_s);
    }
}

/// Duration of a condition after one more frame, s. Samples arrive in some frames only; in between,
/// the last one holds.
fn lasts_s(before_s: f64, is_now: Option<bool>, frame_s: f64) -> f64 {
    if is_now.unwrap_or(before_s > 0.0) { before_s + frame_s } else { 0.0 }
}

/// The crew message for an event, with the height of the feet, m, and the vertical speed, m/s.
pub(super) fn words_of_ascent(event: Event, height_m: f64, climb_m_s: f64) -> Option<(Severity, Text)> {
    let message = match event {
        Event::LiftOff => (Severity::Notice, text!("LIFT-OFF")),
        Event::NoLiftOff => (
            Severity::Critical,
            text!("no lift-off within {LIFT_OFF_WITHIN_S} s: the ascent motor may still light"),
        ),
        Event::Burnout => {
            (Severity::Notice, text!("ascent motor burnt out at {height_m:.0} m, {climb_m_s:.0} m/s"))
        }
        Event::Apogee { booster_attached: true } => {
            (Severity::Critical, text!("the booster has not separated: no landing, parachute"))
        }
        Event::Apogee { booster_attached: false } => (Severity::Notice, text!("APOGEE at {height_m:.0} m")),
        _ => return None,
    };
    Some(message)
}

// Detects a fin that does not move when commanded.
//
// A sweeping command passes a stuck fin again and again, so a fin at its commanded angle may still
// be stuck. A fin is stuck if its command has been far away for longer than a servo needs and the
// fin has not moved.

/// Distance of the command, rad, at which a working fin moves at once: the tolerance of the
/// ignition gate.
const FAR_RAD: f64 = super::gate::FIN_THERE_RAD;
/// Total time with a distant command and no motion after which a fin is stuck, s: more than ten
/// times a servo's delay.
const STUCK_AFTER_S: f64 = 0.25;

/// State of the monitor of one fin.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct Watched {
    /// Angle after its last movement, rad.
    rests_at_rad: f64,
    /// Total time since then with a distant command, s.
    called_for_s: f64,
}

/// The monitor of all fins.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct FinWatch {
    fins: [Watched; 4],
}

impl FinWatch {
    /// Takes a frame: measured and commanded angles of the fins, rad.
    pub(super) fn update(&mut self, found_rad: &[f64; 4], told_rad: &[f64; 4], frame_s: f64) {
        for ((fin, found_rad), told_rad) in self.fins.iter_mut().zip(found_rad).zip(told_rad) {
            if (found_rad - fin.rests_at_rad).abs() > ANSWERING_RAD {
                *fin = Watched { rests_at_rad: *found_rad, called_for_s: 0.0 };
            } else if (told_rad - found_rad).abs() > FAR_RAD {
                fin.called_for_s += frame_s;
            }
        }
    }

    /// Whether any fin is stuck.
    pub(super) fn any_stuck(&self) -> bool {
        self.fins.iter().any(|fin| fin.called_for_s >= STUCK_AFTER_S)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;

    use crate::computer::FRAME_S;
    use crate::computer::pilot::vertical_speed::SpeedReadings;

    fn seen(time_s: f64, phase: Phase, force_m_s2: f64, vertical_m_s: f64) -> AscentReadings {
        AscentReadings {
            time_s,
            frame_s: 0.005,
            phase,
            axial_specific_force_m_s2: force_m_s2,
            specific_force_m_s2: force_m_s2.abs(),
            pressure_altitude_m: None,
            speeds: VerticalSpeeds::default(),
            vertical_m_s,
            booster_attached: false,
            separate_before_apogee_s: 2.0,
            burn_time_s: 0.8,
        }
    }

    /// The same with the three vertical speeds, for a vehicle with this acceleration, m/s^2, and
    /// this fix.
    fn with_speeds(
        speeds: &mut VerticalSpeeds,
        seen: AscentReadings,
        vertical_m_s2: f64,
        gnss_m_s: Option<f64>,
    ) -> AscentReadings {
        speeds.take(&SpeedReadings {
            time_s: seen.time_s,
            frame_s: seen.frame_s,
            vertical_m_s2,
            pressure_altitude_m: seen.pressure_altitude_m,
            gnss_m_s,
            estimated_m_s: seen.vertical_m_s,
        });
        AscentReadings { speeds: *speeds, ..seen }
    }

    fn lifted_off() -> AscentWatch {
        AscentWatch { lifted_off: true, confirmed: true, ..AscentWatch::default() }
    }

    #[test]
    fn a_knock_is_no_lift_off_and_a_push_of_five_g_is_one_after_75_ms() {
        let mut watch = AscentWatch::default();
        for (frame, force_m_s2) in [200.0, 200.0, 9.8, 9.8].into_iter().enumerate() {
            let event = watch.update(&seen(0.005 * frame as f64, Phase::Boost, force_m_s2, 0.0));
            assert_eq!(event, None, "{frame}");
        }
        // 40 m/s^2 over the weight: 3 m/s after 75 ms.
        let events: Vec<_> = (0..15)
            .filter_map(|frame| watch.update(&seen(0.005 * f64::from(frame), Phase::Boost, 49.81, 0.0)))
            .collect();
        assert_eq!(events, [Event::LiftOff]);
    }

    #[test]
    fn without_a_push_there_is_no_lift_off_after_three_seconds() {
        let mut watch = AscentWatch::default();
        assert_eq!(watch.update(&seen(2.995, Phase::Boost, 9.81, 0.0)), None);
        assert_eq!(watch.update(&seen(3.0, Phase::Boost, 9.81, 0.0)), Some(Event::NoLiftOff));
        // After an abort no lift-off is expected, but it is still detected.
        assert_eq!(watch.update(&seen(9.0, Phase::PadIdle, 9.81, 0.0)), None);
        let late = (0..15).filter_map(|_| watch.update(&seen(9.1, Phase::PadIdle, 49.81, 0.0)));
        assert_eq!(late.collect::<Vec<_>>(), [Event::LiftOff]);
    }

    #[test]
    fn a_dip_of_the_thrust_is_no_burn_out() {
        let mut watch = lifted_off();
        for frame in 0..100 {
            // 50 ms below the drag, then thrust again.
            let force_m_s2 = if frame % 20 < 10 { -5.0 } else { 30.0 };
            assert_eq!(watch.update(&seen(0.5, Phase::Boost, force_m_s2, 40.0)), None, "{frame}");
        }
        let out = (0..20).filter_map(|_| watch.update(&seen(0.5, Phase::Boost, -5.0, 40.0)));
        assert_eq!(out.collect::<Vec<_>>(), [Event::Burnout]);
    }

    #[test]
    fn the_booster_is_separated_once_and_apogee_reports_whether_it_left() {
        let mut watch = lifted_off();
        assert_eq!(watch.update(&seen(5.0, Phase::Coast, -2.0, 20.0)), None);
        assert_eq!(watch.update(&seen(5.1, Phase::Coast, -2.0, 19.6)), Some(Event::SeparationDue));
        assert!(watch.separates());
        assert_eq!(watch.update(&seen(5.2, Phase::Coast, -2.0, 18.6)), None);
        let stuck = AscentReadings { booster_attached: true, ..seen(7.2, Phase::Coast, 0.0, -0.01) };
        let events: Vec<_> = (0..3).filter_map(|_| watch.update(&stuck)).collect();
        assert_eq!(events, [Event::Apogee { booster_attached: true }]);
    }

    /// An accelerometer that reads zero, so that the estimate falls from the first frame on: the
    /// barometer alone detects the lift-off, and no apogee is accepted while it climbs.
    #[test]
    fn with_a_dead_accelerometer_the_barometer_sees_lift_off_and_apogee() {
        let (mut watch, mut speeds) = (AscentWatch::default(), VerticalSpeeds::default());
        let mut events = Vec::new();
        // 60 m/s at once, then braking by 10 m/s^2: 180 m after 6 s.
        for frame in 0..1_800 {
            let time_s = 0.005 * f64::from(frame);
            let altitude_m = 60.0 * time_s - 5.0 * time_s * time_s;
            let dead = AscentReadings {
                pressure_altitude_m: (frame % 4 == 0).then_some(altitude_m),
                booster_attached: true,
                ..seen(time_s, Phase::Boost, 0.0, -9.81 * time_s)
            };
            let phase = if events.len() < 2 { Phase::Boost } else { Phase::Coast };
            // The gas of the separation charge is not air pressure.
            let gas = watch.is_charged(time_s);
            let dead = AscentReadings {
                phase,
                pressure_altitude_m: dead.pressure_altitude_m.filter(|_| !gas),
                ..dead
            };
            let dead = with_speeds(&mut speeds, dead, -9.81, None);
            events.extend(watch.update(&dead).map(|event| (time_s, event)));
        }
        assert_eq!(events[0].1, Event::LiftOff);
        // 15 m at 0.26 s, and the 0.1 s for which it has to stay so.
        assert!((0.3..0.5).contains(&events[0].0), "{events:?}");
        // Nothing decelerates: the motor's time is over, and the booster separates two seconds
        // before the apogee of the pressure.
        assert_eq!((events[1].1, events[2].1), (Event::Burnout, Event::SeparationDue));
        assert!((1.2..1.8).contains(&events[1].0) && (4.0..4.5).contains(&events[2].0), "{events:?}");
        assert_eq!(events[3].1, Event::Apogee { booster_attached: true });
        assert!((5.9..6.5).contains(&events[3].0), "{events:?}");
    }

    /// A jump of the pressure by 20 m while it climbs at 40 m/s is no apogee.
    #[test]
    fn a_jump_of_the_pressure_is_no_apogee_while_the_estimate_rises_fast() {
        let (mut watch, mut speeds) = (lifted_off(), VerticalSpeeds::default());
        for frame in 0..400 {
            let time_s = 0.005 * f64::from(frame);
            let jump_m = if time_s < 1.0 { 0.0 } else { -20.0 };
            let climbing = AscentReadings {
                pressure_altitude_m: Some(100.0 + 40.0 * time_s + jump_m),
                ..seen(time_s, Phase::Coast, -2.0, 40.0)
            };
            assert_eq!(watch.update(&with_speeds(&mut speeds, climbing, 0.0, None)), None, "{time_s}");
        }
    }

    /// A step of the pressure in the boost, and a ramp that shows a fall: without a fix, with one,
    /// and with one that agrees with the pressure.
    #[test]
    fn a_barometer_alone_ends_no_ascent() {
        for (fix_m_s, ends) in [(None, false), (Some(50.0), false), (Some(-5.0), true)] {
            for ramp_m_s in [0.0, -80.0] {
                let (mut watch, mut speeds) = (lifted_off(), VerticalSpeeds::default());
                let apogee = (0..400).any(|frame| {
                    let time_s = 0.005 * f64::from(frame);
                    let wrong_m = if time_s < 0.5 { 0.0 } else { -60.0 + ramp_m_s * (time_s - 0.5) };
                    let lying = AscentReadings {
                        pressure_altitude_m: (frame % 4 == 0)
                            .then_some(50.0 * time_s + wrong_m + 1e-3 * time_s),
                        burn_time_s: 10.0,
                        ..seen(time_s, Phase::Coast, 9.81, 50.0)
                    };
                    let lying = with_speeds(&mut speeds, lying, 0.0, fix_m_s);
                    matches!(watch.update(&lying), Some(Event::Apogee { .. }))
                });
                assert_eq!(apogee, ends, "fix {fix_m_s:?}, ramp {ramp_m_s}");
            }
        }
    }

    /// Thrust in the accelerometer is rejected while barometer and satellites are at rest, and
    /// accepted while they are silent.
    #[test]
    fn a_push_in_the_accelerometer_alone_is_no_lift_off() {
        for (pressure, fix, denied) in
            [(true, true, true), (true, false, true), (false, true, true), (false, false, false)]
        {
            let (mut watch, mut speeds) = (AscentWatch::default(), VerticalSpeeds::default());
            let mut events = Vec::new();
            for frame in 0..600 {
                let pushed = AscentReadings {
                    pressure_altitude_m: (pressure && frame % 4 == 0)
                        .then_some(0.1 * libm::sin(f64::from(frame))),
                    ..seen(0.005 * f64::from(frame), Phase::Boost, 49.81, 40.0)
                };
                let pushed = with_speeds(&mut speeds, pushed, 40.0, fix.then_some(0.05));
                events.extend(watch.update(&pushed));
            }
            assert_eq!(events[0], Event::LiftOff);
            assert_eq!(events.contains(&Event::NoLiftOff), denied, "{pressure} {fix}: {events:?}");
            assert_eq!(watch.has_lifted_off(), !denied);
        }
    }

    /// With a blocked static port, what follows a push of 2 g for 2 s decides: axial and total
    /// specific force, m/s^2.
    #[test]
    fn a_lift_off_without_pressure_is_rejected_on_the_pad_and_accepted_in_free_fall() {
        for (axial_m_s2, total_m_s2, denied_at_s) in [
            (9.8, 9.8, Some(3.0)),   // It stands again.
            (19.6, 19.6, Some(2.4)), // The push outlasts the motor.
            (0.2, 9.8, Some(20.0)),  // It lies on its side.
            (-0.5, 0.6, None),
            (-2.5, 2.6, None),
        ] {
            let (mut watch, mut speeds) = (AscentWatch::default(), VerticalSpeeds::default());
            let mut events = Vec::new();
            for frame in 0..5_000 {
                let time_s = FRAME_S * f64::from(frame);
                let (axial_m_s2, total_m_s2) =
                    if time_s < 2.0 { (19.6, 19.6) } else { (axial_m_s2, total_m_s2) };
                let blocked = AscentReadings {
                    specific_force_m_s2: total_m_s2,
                    burn_time_s: 1.57,
                    pressure_altitude_m: (frame % 4 == 0).then_some(0.1 * libm::sin(f64::from(frame))),
                    ..seen(time_s, Phase::Boost, axial_m_s2, 40.0)
                };
                let blocked = with_speeds(&mut speeds, blocked, 0.0, None);
                events.extend(watch.update(&blocked).map(|event| (time_s, event)));
            }
            let rejected = events.iter().find(|(_, event)| *event == Event::NoLiftOff);
            assert_eq!(rejected.is_some(), denied_at_s.is_some(), "{axial_m_s2}: {events:?}");
            let near =
                |(time_s, _): &(f64, Event)| denied_at_s.is_some_and(|at_s| (time_s - at_s).abs() < 0.5);
            assert!(rejected.is_none_or(near), "{axial_m_s2}: {rejected:?}");
            assert_eq!(watch.has_lifted_off(), denied_at_s.is_none());
        }
    }

    /// The ejection charge raises the pressure: the barometer shows a fall that is none.
    #[test]
    fn the_charges_pressure_is_no_apogee_and_a_lasting_one_is() {
        let mut watch = lifted_off();
        let at = |time_s: f64, altitude_m: f64| AscentReadings {
            pressure_altitude_m: Some(altitude_m),
            ..seen(time_s, Phase::Coast, -2.0, 15.0)
        };
        assert_eq!(watch.update(&at(5.0, 280.0)), Some(Event::SeparationDue));
        for frame in 0..190 {
            let time_s = 5.005 + 0.005 * f64::from(frame);
            assert_eq!(watch.update(&at(time_s, 240.0)), None, "{time_s}");
        }
        // A stuck estimate, and a barometer that has sunk for 0.2 s.
        let events: Vec<_> = (0..45)
            .filter_map(|frame| {
                watch.update(&at(7.0 + 0.005 * f64::from(frame), 273.0)).map(|event| (frame, event))
            })
            .collect();
        assert_eq!(events.first(), Some(&(39, Event::Apogee { booster_attached: false })));
    }

    /// When the watch reports a fin that sticks from `stuck_from_s` on, in a sweep with a period of
    /// 1 s.
    fn found_after_s(stuck_from_s: f64, rate_rad_s: f64) -> Option<f64> {
        let mut watch = FinWatch::default();
        let mut fin_rad: f64 = 0.0;
        (0..2000).map(|frame| f64::from(frame) * FRAME_S).find(|time_s| {
            let told_rad = 0.6 + 0.5 * libm::sin(core::f64::consts::TAU * time_s);
            if *time_s < stuck_from_s {
                fin_rad += (told_rad - fin_rad).clamp(-rate_rad_s * FRAME_S, rate_rad_s * FRAME_S);
            }
            watch.update(&[0.6, fin_rad, 0.6, 0.6], &[0.6, told_rad, 0.6, 0.6], FRAME_S);
            watch.any_stuck()
        })
    }

    #[test]
    fn a_stuck_fin_is_found_although_the_command_sweeps_past_it() {
        let found_s = found_after_s(2.3, 5.0).expect("the stuck fin is found");
        assert!((2.5..3.3).contains(&found_s), "{found_s}");
    }

    #[test]
    fn a_fin_that_follows_slowly_is_not_stuck() {
        assert_eq!(found_after_s(f64::INFINITY, 5.0), None);
        assert_eq!(found_after_s(f64::INFINITY, 0.5), None, "a tenth of the rate");
    }
}
