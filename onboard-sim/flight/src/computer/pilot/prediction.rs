//! The pilot's forecast for the next seconds, and the parachute if it shows that no landing will be possible.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use nalgebra::{Vector2, Vector3};
use serde::Serialize;

use super::Pilot;
use super::vehicle_model::VehicleModel;
use crate::computer::KeptInput;
use crate::estimation::estimator::Estimate;
use crate::estimation::sensor_watch::SensorWatch;
use crate::guidance::ignition::IgnitionPrediction;
use crate::guidance::vertical::fall_ends_m_s;
use crate::rules::gate::{GATE_CHECKS, GateCheck};
use crate::rules::phase::{Event, Mode, Phase};
use crate::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;

/// The commit height is the height that the parachute needs, times this: half as much again, because ejection and filling
/// scatter.
const COMMIT_MARGIN: f64 = 1.5;

/// A fall is taken to be at least this fast, m/s, so that the time to the ground is finite at apogee.
const FALL_MIN_M_S: f64 = 5.0;

/// The forecast before ignition, renewed five or twenty times a second.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Prediction {
    pub ignition: IgnitionPrediction,
    /// Height of the feet below which the parachute has no room to spare, m.
    pub commit_height_m: f64,
    /// Height of the feet, m.
    pub height_m: f64,
    /// Speed predicted for this moment from the fall alone, m/s.
    pub predicted_speed_m_s: f64,
    /// The certified motor lands from here or from farther down.
    pub lands_ahead: bool,
    /// Distance from the pad at which the vehicle would touch down without further steering, m.
    pub touchdown_distance_m: f64,
}

impl Prediction {
    /// Height of the feet below which the parachute does not fill before it reaches the ground, m.
    pub(super) fn filling_height_m(&self) -> f64 {
        self.commit_height_m / COMMIT_MARGIN
    }
}

/// Height that a parachute needs at a speed, with a margin: the fall until it is ejected, plus the distance over which
/// it inflates (T. W. Knacke, Parachute Recovery Systems Design Manual, NWC TP 6575, 1991, chapter 5).
pub(super) fn commit_height_m(speed_m_s: f64, ejection_delay_s: f64, inflation_distance_m: f64) -> f64 {
    COMMIT_MARGIN * (speed_m_s * ejection_delay_s + inflation_distance_m)
}

/// Where a vehicle would touch down without further steering, m, in the world's horizontal axes: from a place, m, with
/// a velocity, m/s, and its feet at a height, m.
pub fn touchdown_m(place_m: &Vector3<f64>, velocity_m_s: &Vector3<f64>, height_m: f64) -> Vector2<f64> {
    let to_ground_s = height_m.max(0.0) / (-velocity_m_s.z).max(FALL_MIN_M_S);
    (place_m + velocity_m_s * to_ground_s).xy()
}

/// Time in which a vehicle on its open fins takes on the wind's speed, s: a terminal speed of 40 m/s over g, and half as
/// much again while it is slower.
const TAKES_THE_WIND_S: f64 = 6.0;

/// The apogee ahead of a coasting vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ApogeeAhead {
    /// Its height, m.
    pub height_m: f64,
    /// Time until then, s.
    pub in_s: f64,
}

/// The apogee of a vehicle that coasts up from a height, m, at a vertical speed, m/s, while the air brakes it by so much,
/// m/s^2: the drag falls with the square of the speed, so in the mean over the height half of it acts.
fn apogee_ahead(height_m: f64, vertical_m_s: f64, braking_m_s2: f64) -> ApogeeAhead {
    let slowing_m_s2 = STANDARD_GRAVITY_M_S2 + 0.5 * braking_m_s2.max(0.0);
    let rising_m_s = vertical_m_s.max(0.0);
    ApogeeAhead {
        height_m: height_m + 0.5 * rising_m_s * rising_m_s / slowing_m_s2,
        in_s: rising_m_s / slowing_m_s2,
    }
}

/// Where a rising vehicle would touch down in still air without steering, m: it drifts to its apogee and until the air
/// has stopped it.
pub fn touchdown_from_below_m(place_m: &Vector3<f64>, velocity_m_s: &Vector3<f64>) -> Vector2<f64> {
    let in_s = apogee_ahead(place_m.z, velocity_m_s.z, 0.0).in_s;
    (place_m + velocity_m_s * (in_s + TAKES_THE_WIND_S)).xy()
}

impl VehicleModel {
    /// The prediction without the ignition, for a moment: with the fins at these openings, rad, after a fall from this height, m.
    pub(super) fn fall(&self, estimate: &Estimate, fins_rad: &[f64; 4], apogee_m: f64) -> Prediction {
        let column = self.column(self.density_kg_m3(estimate), self.mission.soft_tilt_deg);
        let state = &estimate.state;
        let height_m = state.position_m.z - self.feet_below_cg_m(&self.mass.at(0.0));
        let parachute = &self.airframe().parachute;
        let touchdown = touchdown_m(&state.position_m, &state.velocity_m_s, height_m);
        // The speed after the fall from apogee so far, with drag as certified.
        let terminal_m_s = column.terminal_speed_m_s(self.fins_m2(fins_rad));
        let fallen_m = (apogee_m - state.position_m.z).max(0.0);
        let shed = libm::exp(-2.0 * self.mission.gravity_m_s2 * fallen_m / (terminal_m_s * terminal_m_s));
        Prediction {
            commit_height_m: commit_height_m(
                state.velocity_m_s.norm(),
                parachute.ejection_delay_s,
                parachute.inflation_distance_m,
            ),
            height_m,
            // Until it is known.
            lands_ahead: true,
            predicted_speed_m_s: terminal_m_s * libm::sqrt((1.0 - shed).max(0.0)),
            touchdown_distance_m: libm::hypot(touchdown.x, touchdown.y),
            ..Prediction::default()
        }
    }

    /// The whole prediction.
    pub(super) fn prediction(&self, estimate: &Estimate, fins_rad: &[f64; 4], apogee_m: f64) -> Prediction {
        let fall = self.fall(estimate, fins_rad, apogee_m);
        let (settings, curve, fins_m2) =
            (&self.mission.ignition, &self.mission.motor_curve, self.fins_m2(fins_rad));
        let column = self.column(self.density_kg_m3(estimate), self.mission.soft_tilt_deg);
        let (height_m, vertical_m_s) = (fall.height_m, estimate.state.velocity_m_s.z);
        let ignition = settings.prediction(&column, curve, height_m, vertical_m_s, fins_m2);
        let lands_ahead =
            ignition.band.is_some() || settings.lands_ahead(&column, curve, height_m, vertical_m_s, fins_m2);
        Prediction { ignition, lands_ahead, ..fall }
    }

    /// Drag area of the fins in flight, m^2.
    fn fins_m2(&self, fins_rad: &[f64; 4]) -> f64 {
        self.motor.air_scale() * self.fin_drag_area_m2(fins_rad)
    }
}

impl Pilot {
    /// The apogee as it is expected on the way up; `None` under the ascent motor, and after apogee.
    pub fn apogee_ahead(&self, phase: Phase) -> Option<ApogeeAhead> {
        let estimate = self.estimate.as_ref().filter(|_| phase == Phase::Coast)?;
        let braking_m_s2 = -estimate.specific_force_m_s2.x;
        Some(apogee_ahead(estimate.state.position_m.z, estimate.state.velocity_m_s.z, braking_m_s2))
    }

    /// Speed at the ground after a fall from here with the fins fully open and without thrust, m/s, positive downwards;
    /// `None` before the first frame.
    pub fn impact_m_s(&self) -> Option<f64> {
        let estimate = self.estimate.as_ref()?;
        let (known, state) = (&self.model, &estimate.state);
        let column = known.column(known.density_kg_m3(estimate), known.mission.soft_tilt_deg);
        let fins_m2 = known.motor.air_scale() * known.airframe().open_fin_drag_area_m2();
        let terminal_m_s = column.terminal_speed_m_s(fins_m2);
        let height_m = state.position_m.z - known.feet_below_cg_m(&known.mass.at(0.0));
        Some(fall_ends_m_s(height_m, state.velocity_m_s.z, terminal_m_s, known.mission.gravity_m_s2))
    }
}

// Releases the parachute while there is height for it, if the ignition gate will not open.

/// A reason that has kept the gate shut for this long, s, will not go away before ignition.
const LASTS_S: f64 = 0.5;
/// The decision is taken this long before the room for the parachute ends, s. As long may a due ignition be refused: a fin
/// that is still moving has kept the gate shut for up to 45 ms in 1500 simulated flights.
const BEFORE_S: f64 = 0.1;
/// A pressure altitude that is lower than the estimate by more, m, is not only its ram error and a slow offset.
const HEIGHTS_APART_M: f64 = 8.0;

impl Pilot {
    /// The event that the gate will not open any more, as soon as waiting gains nothing, and why.
    ///
    /// Above the commit height: the gate has been shut for a lasting reason, and this is the last chance for the parachute
    /// with its margin. Below: ignition is due and refused, or no landing is possible from here any more. The motor must
    /// never be lit outside the gate, so only the parachute is left, without the margin.
    pub(super) fn gate_will_not_open(
        &mut self,
        mode: &Mode,
        input: &KeptInput,
        estimate: &Estimate,
        sensors: &SensorWatch,
    ) -> Option<(Event, String)> {
        let checks = self.gate_checks(mode, input, estimate, sensors);
        for (check, since_s) in checks.iter().zip(&mut self.shut_since_s) {
            *since_s = check.shut.then(|| since_s.unwrap_or(input.time_s));
        }
        if mode.phase.in_descent() && checks.iter().any(|check| check.lasts) {
            self.gate_shut_since_s.get_or_insert(input.time_s);
        } else {
            self.gate_shut_since_s = None;
        }
        if !mode.phase.in_descent() || self.prediction.commit_height_m <= 0.0 {
            return None;
        }
        let lasts = self.gate_shut_since_s.is_some_and(|since_s| {
            // A stuck fin has already been watched for long enough.
            self.fin_watch.any_stuck() || input.time_s - since_s >= LASTS_S
        });
        // The parachute comes anyway: of two heights the lower one says when.
        let estimated_m = self.feet_height_m(estimate);
        let below_cg_m = estimate.state.position_m.z - estimated_m;
        let pressure_m = self.speeds.altitude_m(input.time_s).map(|altitude_m| altitude_m - below_cg_m);
        let feet_m = pressure_m
            .filter(|pressure_m| lasts && *pressure_m < estimated_m - HEIGHTS_APART_M)
            .unwrap_or(estimated_m);
        let decided_m = BEFORE_S * (-estimate.state.velocity_m_s.z).max(0.0);
        let filling_m = self.prediction.filling_height_m();
        let above_commit_m = feet_m - self.prediction.commit_height_m;
        let hopeless = if above_commit_m > 0.0 {
            lasts && above_commit_m < decided_m
        } else {
            let last_room = feet_m - filling_m < decided_m;
            let overdue_s = self.ignition_overdue_s(estimate);
            let refused = overdue_s.is_some() && checks.iter().any(|check| check.shut);
            let outside = self.prediction.touchdown_distance_m > self.model.mission.gate.fence_radius_m;
            let too_low =
                self.prediction.ignition.band.is_some_and(|band| self.onset_m(estimate) < band.low_m);
            (lasts && (refused || last_room))
                || (refused
                    && last_room
                    && (outside || overdue_s.is_some_and(|overdue_s| overdue_s >= BEFORE_S)))
                || too_low
        };
        // Any lower, the parachute reaches the ground before it is ejected.
        let ejected =
            feet_m.max(estimated_m) > filling_m - self.model.airframe().parachute.inflation_distance_m;
        if self.is_astray(sensors) {
            // Nobody knows the attitude, and the pressure alone knows the height: nothing is gained by waiting.
            let parachute_fills = pressure_m.is_none_or(|pressure_m| pressure_m > filling_m);
            return Some((
                Event::GateShutForGood { parachute_fills },
                self.why_given_up(&checks, input.time_s),
            ));
        }
        (hopeless && ejected).then(|| {
            let event = Event::GateShutForGood { parachute_fills: feet_m > filling_m };
            (event, self.why_given_up(&checks, input.time_s))
        })
    }

    /// Without what is felt, or with an estimate that two of three speeds contradict, no landing is tried.
    pub(super) fn is_astray(&self, sensors: &SensorWatch) -> bool {
        sensors.feels_nothing_for_s() >= LASTS_S || self.speeds.contradict_the_estimate()
    }

    /// All that decided, with values, and for how long: what lasts, or else what keeps the gate shut now.
    fn why_given_up(&self, checks: &[GateCheck; GATE_CHECKS], time_s: f64) -> String {
        let for_s = |since_s: &Option<f64>| since_s.map_or(0.0, |since_s| time_s - since_s);
        // A fin on its way fails for a moment and decides nothing beside what has lasted.
        let keeps: [fn(&GateCheck, f64) -> bool; 3] =
            [|check, for_s| check.lasts && for_s >= LASTS_S, |check, _| check.lasts, |check, _| check.shut];
        let told = keeps.iter().map(|keep| {
            let kept =
                checks.iter().zip(&self.shut_since_s).filter(|(check, since_s)| keep(check, for_s(since_s)));
            let words =
                kept.map(|(check, since_s)| format!("{}, for {:.1} s", check.words(), for_s(since_s)));
            words.collect::<Vec<_>>().join("; ")
        });
        told.into_iter()
            .find(|told| !told.is_empty())
            .unwrap_or_else(|| "too low for the landing motor".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Vector2, Vector3};

    use crate::computer::pilot::sample::{self, input, released};
    use crate::computer::table::PhaseTable;
    use crate::estimation::estimator::StartUncertainty;
    use crate::vehicle::rigid::RigidState;

    /// One frame, in which the crew may abort.
    fn frame_with(pilot: &mut Pilot, table: &mut PhaseTable, input: &KeptInput, abort: bool) -> [f64; 4] {
        pilot.estimate_state(table.mode().phase, input);
        fly_on(pilot, table, input, abort)
    }

    /// The same after the estimate.
    fn fly_on(pilot: &mut Pilot, table: &mut PhaseTable, input: &KeptInput, abort: bool) -> [f64; 4] {
        pilot.take_over(input.time_s);
        pilot.predict(table, input);
        if abort {
            let event = pilot.abort_event(table.mode(), Some(input), &SensorWatch::default());
            pilot.apply(table, event, input.time_s).expect("an abort is never refused in the air");
        }
        pilot.decide(table, input, &SensorWatch::default());
        pilot.plan(table.mode(), input, false);
        pilot.point(table.mode(), input).fins_rad
    }

    /// Whether an abort in the very next frame releases the parachute.
    fn abort_releases(pilot: &mut Pilot, frame: u64) -> bool {
        let mut table = released();
        frame_with(pilot, &mut table, &input(frame, 0.0), true);
        table.mode().phase == Phase::Chute
    }

    #[test]
    fn an_abort_in_the_first_frame_knows_the_height() {
        let pilot = sample::falling();
        assert!(abort_releases(&mut pilot.clone(), 1));
        assert!(abort_releases(&mut sample::falling().resumed(&pilot.saved(), 0.1), 21));
    }

    #[test]
    fn touchdown_lies_along_the_velocity_and_the_time_of_a_slow_fall_is_limited() {
        let place_m = Vector3::new(10.0, -4.0, 80.4);
        let falling = touchdown_m(&place_m, &Vector3::new(-2.0, 1.0, -40.0), 80.0);
        assert_eq!(falling, Vector2::new(6.0, -2.0));
        let at_apogee = touchdown_m(&place_m, &Vector3::new(-2.0, 1.0, 0.0), 80.0);
        assert_eq!(at_apogee, Vector2::new(-22.0, 12.0));
        assert_eq!(touchdown_m(&place_m, &Vector3::new(-2.0, 1.0, -0.2), -0.1), place_m.xy());
    }

    fn falling(time_s: f64) -> Estimate {
        let mut state = RigidState::upright(250.0 - 38.0 * time_s);
        state.velocity_m_s.z = -38.0;
        Estimate::exact(time_s, state, Vector3::new(9.8, 0.0, 0.0), Vector2::zeros())
    }

    /// What is wrong in a fall, at the height of the centre of gravity, m.
    type Wrong = fn(f64, &mut Estimate, &mut KeptInput);

    const NO_ABORT_M: f64 = 0.0;

    const NOTHING: Wrong = |_, _, _| {};

    /// How a fall at 38 m/s ended.
    #[derive(Debug, Clone, Copy, PartialEq)]
    enum Ended {
        /// With the parachute, released at a height, m; whether the loss was recorded.
        Parachute(f64, bool),
        /// With the ignition, commanded at a height, m.
        Ignition(f64),
        /// With neither.
        Unbraked,
    }

    /// A fall at 38 m/s: the commit height is at 87 m, the ignition at about 70 m, and the parachute fills in 58 m. The crew
    /// aborts below a height.
    fn fall(wrong: Wrong, abort_below_m: f64) -> Ended {
        let mission = crate::vehicles::mission::builtin("mk2").expect("built in").expect("sound");
        let start = RigidState::upright(250.0);
        let mut pilot = Pilot::starting(&mission, 0.0, &start, &StartUncertainty::at_apogee());
        let (mut table, mut fins_rad) = (released(), [0.0; 4]);
        let ended = (1..1300).find_map(|frame| {
            let time_s = frame as f64 * 0.005;
            let mut estimate = falling(time_s);
            let height_m = estimate.state.position_m.z;
            let mut input = KeptInput { fins_rad, ..sample::input(frame, 0.0) };
            wrong(height_m, &mut estimate, &mut input);
            let aborts = height_m < abort_below_m && !table.mode().interlocks.abort_latched;
            pilot.estimate = Some(estimate);
            pilot.update_models(table.mode().phase, &input, &estimate);
            fins_rad = fly_on(&mut pilot, &mut table, &input, aborts);
            let phase = table.mode().phase;
            let lost = table.take_news().iter().any(|news| format!("{news:?}").contains("will be lost"));
            match phase {
                Phase::Chute => Some(Ended::Parachute(height_m, lost)),
                Phase::Ignition => Some(Ended::Ignition(height_m)),
                _ => None,
            }
        });
        ended.unwrap_or(Ended::Unbraked)
    }

    #[track_caller]
    fn assert_parachute(wrong: Wrong, between_m: core::ops::Range<f64>) {
        assert_ended_with_the_parachute(fall(wrong, NO_ABORT_M), between_m);
    }

    #[track_caller]
    fn assert_ended_with_the_parachute(ended: Ended, between_m: core::ops::Range<f64>) {
        let filled = matches!(ended, Ended::Parachute(at_m, false) if between_m.contains(&at_m));
        assert!(filled, "{ended:?}, not between {between_m:?} m");
    }

    /// 1.5 times a second's fall and 20 m of inflation, and the feet below the centre of gravity.
    const AT_COMMIT_HEIGHT_M: core::ops::Range<f64> = 87.0..93.0;

    #[test]
    fn a_fall_with_nothing_wrong_ends_with_the_ignition() {
        let ended = fall(NOTHING, NO_ABORT_M);
        assert!(matches!(ended, Ended::Ignition(at_m) if (60.0..80.0).contains(&at_m)), "{ended:?}");
    }

    #[test]
    fn a_foot_s_switch_that_closes_high_up_ends_no_flight() {
        let ended = fall(|height_m, _, input| input.contact = height_m > 100.0, NO_ABORT_M);
        assert!(matches!(ended, Ended::Ignition(_)), "{ended:?}");
    }

    #[test]
    fn what_lasts_brings_the_parachute_above_the_commit_height() {
        assert_parachute(|_, _, input| input.fins_rad = [0.0; 4], AT_COMMIT_HEIGHT_M);
        assert_parachute(|_, _, input| input.igniter_continuity = false, AT_COMMIT_HEIGHT_M);
        // The fence is at 120 m.
        assert_parachute(|_, estimate, _| estimate.state.position_m.x = 121.0, AT_COMMIT_HEIGHT_M);
        let drifting_out: Wrong = |height_m, estimate, _| {
            estimate.state.velocity_m_s.x = 5.0;
            estimate.state.position_m.x = 121.0 - 5.0 * height_m / 38.0;
        };
        assert_parachute(drifting_out, AT_COMMIT_HEIGHT_M);
    }

    #[test]
    fn inside_the_fence_it_lands() {
        let ended = fall(|_, estimate, _| estimate.state.position_m.x = 119.0, NO_ABORT_M);
        assert!(matches!(ended, Ended::Ignition(_)), "{ended:?}");
    }

    #[test]
    fn a_gate_shut_after_the_commit_height_brings_the_parachute_while_it_fills() {
        let filling_m = 58.0..75.0;
        let out_of_the_fence: Wrong = |height_m, estimate, _| {
            estimate.state.position_m.y = if height_m < 80.0 { 121.0 } else { 119.0 };
        };
        assert_parachute(out_of_the_fence, filling_m.clone());
        let open_circuit: Wrong = |height_m, _, input| input.igniter_continuity = height_m > 73.0;
        assert_parachute(open_circuit, filling_m.clone());
        let turning: Wrong = |height_m, estimate, _| {
            estimate.state.rate_rad_s.y = if height_m < 80.0 { 1.2 } else { 0.0 };
        };
        assert_parachute(turning, filling_m);
    }

    /// A fin on its way keeps the gate shut for up to 45 ms, a gust that turns the vehicle for somewhat longer.
    #[test]
    fn a_gate_shut_for_a_moment_delays_the_ignition_only() {
        let Ended::Ignition(due_m) = fall(NOTHING, NO_ABORT_M) else { panic!("no ignition") };
        let turning: Wrong = |height_m, estimate, _| {
            estimate.state.rate_rad_s.y = if height_m > 66.0 && height_m < 80.0 { 1.2 } else { 0.0 };
        };
        let ended = fall(turning, NO_ABORT_M);
        assert!(matches!(ended, Ended::Ignition(at_m) if at_m < 66.0 && at_m < due_m), "{ended:?}");
    }

    #[test]
    fn an_operators_abort_with_the_gate_shut_brings_the_parachute_while_it_fills() {
        assert_ended_with_the_parachute(fall(NOTHING, 86.0), 85.0..86.0);
    }
}
