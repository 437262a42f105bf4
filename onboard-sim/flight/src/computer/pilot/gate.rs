//! Phase changes of descent and landing: the ignition behind its gate, and the parachute while
//! there is height for it, if the landing is abandoned.

use core::fmt::Write as _;

use super::Pilot;
use crate::computer::SensedInput;
use crate::computer::messages::Severity;
use crate::computer::table::PhaseTable;
use crate::estimation::estimator::{Estimate, Health, HealthIssue};
use crate::estimation::sensor_watch::SensorWatch;
use crate::rules::gate::{self, GATE_CHECKS, GateCheck, GateInput};
use crate::rules::phase::{Effect, Effects, Event, Mode, Motor, NO_THRUST_TIMEOUT_S, Phase, Refusal};
use crate::text::{Text, text};
use crate::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;

/// Distance of a fin from its command beyond which it has not arrived, rad.
pub(super) const FIN_THERE_RAD: f64 = 0.1;
/// Largest height of a landing, m: slope of the field, pressure errors and the weather of a day.
const NEAR_GROUND_M: f64 = 15.0;
/// Burn time, s, from which on thrust is confirmed: a knock or a spike in the accelerometer that
/// lasts for a tenth of a second has been recognised by then, and the motor estimate waits again.
const CONFIRMED_S: f64 = 0.25;
/// Duration after which a failing gate check is lasting, s: it will not recover before ignition.
const LASTS_S: f64 = 0.5;
/// Time before the end of the parachute's height at which the decision is taken, s. A due ignition
/// may be refused for as long: a moving fin has inhibited it for up to 45 ms in 1500 simulated
/// flights.
const BEFORE_S: f64 = 0.1;
/// Difference below the estimate, m, at which a pressure altitude is wrong by more than its ram
/// error and a slow offset.
const HEIGHTS_APART_M: f64 = 8.0;
/// Margin of the position against the fence, standard deviations.
const PLACE_SIGMAS: f64 = 2.0;

/// Inputs of a frame besides the pilot.
#[derive(Clone, Copy)]
struct Seen<'a> {
    input: &'a SensedInput,
    estimate: &'a Estimate,
    sensors: &'a SensorWatch,
}

impl Pilot {
    /// Moves through the phases of the descent and the landing.
    pub(crate) fn decide(&mut self, table: &mut PhaseTable, input: &SensedInput, sensors: &SensorWatch) {
        let Some(estimate) = self.estimate else { return };
        let seen = Seen { input, estimate: &estimate, sensors };
        let time_s = input.time_s;
        if let Some((hopeless, why)) = self.gate_will_not_open(table.mode(), seen)
            && self.apply(table, hopeless, time_s).is_ok()
        {
            table.report(Severity::Critical, text!("no landing: {why}"));
            self.gave_up = Some(why);
        }
        match table.mode().phase {
            Phase::Deploy if self.fins_are_out(&input.fins_rad) => {
                self.try_apply(table, Event::FinsConfirmed, time_s);
            }
            Phase::AeroDescent => {
                let arm_before_s = self.model.mission.ignition.arm_before_s;
                if self.prediction.ignition.command_in_s.is_some_and(|in_s| in_s <= arm_before_s) {
                    self.try_apply(table, Event::LandArm, time_s);
                }
            }
            Phase::LandArmed => self.consider_ignition(table, seen),
            Phase::Ignition => {
                let burning_s = self.model.burning_s(time_s);
                if burning_s.is_some_and(|burning_s| burning_s >= CONFIRMED_S) {
                    self.try_apply(table, Event::ThrustConfirmed, time_s);
                } else if burning_s.is_none()
                    && !self.ignites(time_s)
                    && !table.mode().interlocks.no_light_latched
                {
                    self.try_apply(table, Event::NoThrustTimeout, time_s);
                }
            }
            _ => {}
        }
        let under_parachute = table.mode().phase == Phase::Chute;
        if input.contact
            && !matches!(table.mode().phase, Phase::Touchdown | Phase::Safed)
            && (under_parachute || self.is_near_the_ground(seen))
        {
            let (thrust_n, weight_n) = self.thrust_and_weight_n(time_s);
            let thrust_below_weight = thrust_n < weight_n;
            self.try_apply(table, Event::Contact { thrust_below_weight }, time_s);
        }
        if table.mode().motor == Motor::Burning && self.model.burn_is_over(time_s) {
            self.try_apply(table, Event::Burnout, time_s);
        }
    }

    /// Whether any height is that of a landing: a foot switch alone ends no flight.
    fn is_near_the_ground(&self, Seen { input, estimate, sensors }: Seen<'_>) -> bool {
        let time_s = input.time_s;
        let below_cg_m = estimate.state.position_m.z - self.feet_height_m(estimate);
        self.feet_height_m(estimate) <= NEAR_GROUND_M
            || self.speeds.altitude_m(time_s).is_some_and(|height_m| height_m - below_cg_m <= NEAR_GROUND_M)
            || sensors.lidar_range_m().is_some_and(|range_m| range_m <= NEAR_GROUND_M)
    }

    /// Estimated thrust of the motor, and the weight, N.
    pub(crate) fn thrust_and_weight_n(&self, time_s: f64) -> (f64, f64) {
        let burning_s = self.model.burning_s(time_s);
        let thrust_n = burning_s.map_or(0.0, |burning_s| self.model.burn().thrust_n(burning_s));
        (thrust_n, self.model.mass_now(burning_s).mass_kg * STANDARD_GRAVITY_M_S2)
    }

    fn consider_ignition(&mut self, table: &mut PhaseTable, seen: Seen<'_>) {
        if self.ignition_overdue_s(seen.estimate).is_some() {
            let checks = self.gate_checks(table.mode(), seen);
            self.gate_refusal = checks.iter().find(|check| check.shut).map(|check| check.name);
            let open = self.gate_refusal.is_none();
            self.try_apply(table, Event::IgnitionGate { open }, seen.input.time_s);
        }
    }

    /// Height of the feet, m.
    pub fn feet_height_m(&self, estimate: &Estimate) -> f64 {
        self.model.feet_height_m(estimate, &self.model.mass.at(0.0))
    }

    /// Height at which thrust would begin if ignition were commanded in the next frame, m.
    fn onset_m(&self, estimate: &Estimate) -> f64 {
        self.prediction.ignition.onset_height_m - (self.prediction.height_m - self.feet_height_m(estimate))
    }

    fn ignition_overdue_s(&self, estimate: &Estimate) -> Option<f64> {
        self.prediction.ignition.overdue_s(self.onset_m(estimate))
    }

    /// Whether the landing motor was commanded to ignite and the time of its igniter's current has
    /// not passed.
    pub(crate) fn ignites(&self, time_s: f64) -> bool {
        self.ignited_at_s.is_some_and(|at_s| time_s - at_s < NO_THRUST_TIMEOUT_S)
    }

    /// The event of an abort at this moment, from the findings of the last frame, if there was one.
    pub(crate) fn abort_event(&self, mode: &Mode, last: Option<&SensedInput>, watch: &SensorWatch) -> Event {
        let found = last.zip(self.estimate.as_ref());
        let gate_open = found.is_some_and(|(input, estimate)| {
            !self.gate_checks(mode, Seen { input, estimate, sensors: watch }).iter().any(|check| check.shut)
        });
        Event::AbortRequested {
            lifted_off: self.ascent.has_lifted_off(),
            above_commit_height: self.parachute_has_room(gate_open),
            gate_open,
        }
    }

    /// With margin where the motor is an alternative, without it otherwise.
    fn parachute_has_room(&self, gate_open: bool) -> bool {
        let prediction = &self.prediction;
        let enough_m = if gate_open { prediction.commit_height_m } else { prediction.filling_height_m() };
        prediction.height_m > enough_m
    }

    /// The checks of the gate with their present values.
    fn gate_checks(
        &self,
        mode: &Mode,
        Seen { input, estimate, sensors }: Seen<'_>,
    ) -> [GateCheck; GATE_CHECKS] {
        let state = &estimate.state;
        let onset_m = self.onset_m(estimate);
        // With no height left for the parachute, a landing on uncertain estimates is better than a
        // fall, as long as the attitude is available.
        let low = self.feet_height_m(estimate) < self.prediction.filling_height_m();
        let unknown = matches!(estimate.health, Health::Unhealthy(HealthIssue::Restarted | HealthIssue::Imu))
            || estimate.sigmas.attitude_rad.xy().max()
                > self.model.mission.estimator.health.tilt_deg.to_radians();
        let found = GateInput {
            tilt_rad: state.tilt_rad(),
            vertical_speed_m_s: state.velocity_m_s.z,
            pitch_rate_rad_s: libm::hypot(state.rate_rad_s.y, state.rate_rad_s.z),
            speed_m_s: state.velocity_m_s.norm(),
            predicted_speed_m_s: self.prediction.predicted_speed_m_s,
            // With one source left there is no disagreement; the estimator's health covers that
            // source.
            height_disagreement_m: estimate.heights.contradiction_m().unwrap_or(0.0),
            landing_feasible: self.prediction.ignition.band.is_some_and(|band| band.contains(onset_m)),
            touchdown_distance_m: self.prediction.touchdown_distance_m
                + PLACE_SIGMAS * estimate.sigmas.position_m.xy().max(),
            fins_confirmed: self.fins_there(&input.fins_rad) && !self.fin_watch.any_stuck(),
            gimbal_moves: !self.swing_watch.found_stuck(),
            parachute_stowed: mode.phase != Phase::Chute,
            igniter_continuity: input.igniter_continuity,
            estimator_healthy: estimate.health.is_good() || (low && !unknown),
            lands_ahead: self.prediction.lands_ahead,
            sensors_agree: !self.is_astray(sensors),
        };
        gate::checks(&self.model.mission.gate, &found)
    }

    /// The fins have left their closed stop and are at their commands. In the frame that enters
    /// DEPLOY they are still where the ascent had them, which proves nothing.
    fn fins_are_out(&self, fins_rad: &[f64; 4]) -> bool {
        let least_rad = self.model.airframe().fins.control_min_rad() - FIN_THERE_RAD;
        fins_rad.iter().all(|fin_rad| *fin_rad >= least_rad) && self.fins_there(fins_rad)
    }

    fn fins_there(&self, fins_rad: &[f64; 4]) -> bool {
        fins_rad.iter().zip(&self.fins_rad).all(|(there, wanted)| (there - wanted).abs() < FIN_THERE_RAD)
    }

    /// Applies an event. If the table refuses it, the mode is unchanged.
    pub(super) fn try_apply(&mut self, table: &mut PhaseTable, event: Event, time_s: f64) {
        let _ = self.apply(table, event, time_s);
    }

    /// Applies an event from any source.
    ///
    /// # Errors
    /// The table refuses the event; the mode is unchanged.
    pub(crate) fn apply(
        &mut self,
        table: &mut PhaseTable,
        event: Event,
        time_s: f64,
    ) -> Result<Effects, Refusal> {
        let effects = table.apply(event)?;
        if effects.contains(Effect::IgniteLandingMotor) {
            self.ignited_at_s = Some(time_s);
        }
        Ok(effects)
    }

    /// The event that abandons the landing, with its reason, as soon as waiting gains nothing.
    ///
    /// Above the commit height: ignition has been inhibited for a lasting reason, and this is the
    /// last chance for the parachute with its margin. Below: ignition is due and refused, or no
    /// landing is possible any more. The motor must never be ignited outside the gate, so only the
    /// parachute is left, without the margin.
    fn gate_will_not_open(&mut self, mode: &Mode, seen: Seen<'_>) -> Option<(Event, Text)> {
        let checks = self.gate_checks(mode, seen);
        let Seen { input, estimate, sensors } = seen;
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
            // A stuck surface has already been observed long enough.
            self.fin_watch.any_stuck() || self.swing_watch.found_stuck() || input.time_s - since_s >= LASTS_S
        });
        // The parachute is deployed in any case: the lower of the two heights sets the time.
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
        // From any lower, the parachute reaches the ground before it is ejected.
        let ejected =
            feet_m.max(estimated_m) > filling_m - self.model.airframe().parachute.inflation_distance_m;
        let parachute_fills = if self.is_astray(sensors) {
            // The attitude is lost, and only the pressure gives a height: waiting gains nothing.
            pressure_m.is_none_or(|pressure_m| pressure_m > filling_m)
        } else if hopeless && ejected {
            feet_m > filling_m
        } else {
            return None;
        };
        Some((Event::GateShutForGood { parachute_fills }, self.why_given_up(&checks, input.time_s)))
    }

    /// Without inertial data, or with an estimate that two of three speeds contradict, no landing
    /// is attempted.
    fn is_astray(&self, sensors: &SensorWatch) -> bool {
        sensors.no_inertial_data_for_s() >= LASTS_S || self.speeds.contradict_the_estimate()
    }

    /// All causes, with values and durations: the lasting ones, or else the checks that fail now.
    fn why_given_up(&self, checks: &[GateCheck; GATE_CHECKS], time_s: f64) -> Text {
        let for_s = |since_s: &Option<f64>| since_s.map_or(0.0, |since_s| time_s - since_s);
        // A moving fin fails for a moment and is left out beside a lasting cause.
        let keeps: [fn(&GateCheck, f64) -> bool; 3] =
            [|check, for_s| check.lasts && for_s >= LASTS_S, |check, _| check.lasts, |check, _| check.shut];
        let mut causes = keeps.iter().map(|keep| {
            let lasting =
                checks.iter().zip(&self.shut_since_s).filter(|(check, since_s)| keep(check, for_s(since_s)));
            let mut words = Text::new();
            for (check, since_s) in lasting {
                let separator = if words.is_empty() { "" } else { "; " };
                let _ = write!(words, "{separator}{}, for {:.1} s", check.words(), for_s(since_s));
            }
            words
        });
        causes.find(|causes| !causes.is_empty()).unwrap_or_else(|| text!("too low for the landing motor"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Vector2, Vector3};

    use crate::computer::pilot::Pointed;
    use crate::computer::pilot::sample::{self, input, released};
    use crate::computer::pilot::swing::Swing;
    use crate::computer::pilot::swing::reaction::Reaction;
    use crate::computer::table::PhaseTable;
    use crate::estimation::estimator::StartUncertainty;
    use crate::vehicle::rigid::RigidState;

    /// One frame, in which the crew may abort.
    fn frame_with(pilot: &mut Pilot, table: &mut PhaseTable, input: &SensedInput, abort: bool) -> Pointed {
        pilot.estimate_state((table.mode().phase, false), input, &SensorWatch::default());
        fly_on(pilot, table, input, abort)
    }

    /// The same after the estimate.
    fn fly_on(pilot: &mut Pilot, table: &mut PhaseTable, input: &SensedInput, abort: bool) -> Pointed {
        pilot.take_over(input.time_s);
        pilot.predict(table, input);
        if abort {
            let event = pilot.abort_event(table.mode(), Some(input), &SensorWatch::default());
            pilot.apply(table, event, input.time_s).expect("an abort is never refused in the air");
        }
        pilot.decide(table, input, &SensorWatch::default());
        pilot.plan(table.mode(), input, false);
        pilot.point(table.mode(), input)
    }

    /// Whether an abort in the very next frame releases the parachute.
    fn abort_releases(pilot: &mut Pilot, frame: u64) -> bool {
        let mut table = released();
        frame_with(pilot, &mut table, &input(frame, 0.0), true);
        table.mode().phase == Phase::Chute
    }

    #[test]
    fn an_abort_in_the_first_frame_has_the_height() {
        let pilot = sample::falling();
        assert!(abort_releases(&mut pilot.clone(), 1));
        let mut resumed = sample::falling();
        resumed.resume(&pilot.saved(), 0.1);
        assert!(abort_releases(&mut resumed, 21));
    }

    fn falling(time_s: f64) -> Estimate {
        let mut state = RigidState::upright(250.0 - 38.0 * time_s);
        state.velocity_m_s.z = -38.0;
        Estimate::exact(time_s, state, Vector3::new(9.8, 0.0, 0.0), Vector2::zeros())
    }

    /// The fault in a fall, at the height of the centre of gravity, m.
    type Wrong = fn(f64, &mut Estimate, &mut SensedInput);

    const NO_ABORT_M: f64 = 0.0;

    const NOTHING: Wrong = |_, _, _| {};

    /// Outcome of a fall at 38 m/s.
    #[derive(Debug, Clone, Copy, PartialEq)]
    enum Ended {
        /// Parachute, released at a height, m; whether the loss was recorded.
        Parachute(f64, bool),
        /// Ignition, commanded at a height, m.
        Ignition(f64),
        /// Neither.
        Unbraked,
    }

    /// A fall at 38 m/s: the commit height is at 87 m, the ignition at about 70 m, and the
    /// parachute fills in 58 m. The crew aborts below a height.
    fn fall(wrong: Wrong, abort_below_m: f64) -> Ended {
        let mission = crate::vehicles::mission::builtin("mk2").expect("built in").expect("sound");
        let start = RigidState::upright(250.0);
        let mut pilot = Pilot::starting(&mission, 0.0, &start, &StartUncertainty::at_apogee());
        let (mut table, mut fins_rad, mut gimbal_rad) = (released(), [0.0; 4], [0.0; 2]);
        let swing = Swing::of(&mission, &pilot.model.mass_now(None)).expect("it shows");
        let mut reaction = Reaction::of(&mission, swing);
        let ended = (1..1300).find_map(|frame| {
            let time_s = frame as f64 * 0.005;
            let mut estimate = falling(time_s);
            let height_m = estimate.state.position_m.z;
            let mut input = SensedInput { fins_rad, ..sample::input(frame, 0.0) };
            let [pitch_rad_s, yaw_rad_s] = reaction.sensed_rad_s(gimbal_rad);
            input.measured.imu.gyro_rad_s = Vector3::new(0.0, pitch_rad_s, yaw_rad_s);
            wrong(height_m, &mut estimate, &mut input);
            let aborts = height_m < abort_below_m && !table.mode().interlocks.abort_latched;
            pilot.estimate = Some(estimate);
            pilot.update_models(table.mode().phase, &input, &estimate);
            Pointed { fins_rad, gimbal_rad, .. } = fly_on(&mut pilot, &mut table, &input, aborts);
            let phase = table.mode().phase;
            let lost =
                table.take_messages().iter().any(|message| format!("{message:?}").contains("will be lost"));
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
        // The gyro senses no swing.
        assert_parachute(|_, _, input| input.measured.imu.gyro_rad_s.z = 0.0, AT_COMMIT_HEIGHT_M);
        // The fence is at 120 m, and the motor brings the vehicle back by 15 m.
        assert_parachute(|_, estimate, _| estimate.state.position_m.x = 140.0, AT_COMMIT_HEIGHT_M);
        let drifting_out: Wrong = |height_m, estimate, _| {
            estimate.state.velocity_m_s.x = 5.0;
            estimate.state.position_m.x = 140.0 - 5.0 * height_m / 38.0;
        };
        assert_parachute(drifting_out, AT_COMMIT_HEIGHT_M);
    }

    #[test]
    fn inside_the_fence_it_lands_also_where_only_the_motor_brings_it_there() {
        let places: [Wrong; 2] = [
            |_, estimate, _| estimate.state.position_m.x = 119.0,
            |_, estimate, _| estimate.state.position_m.x = 130.0,
        ];
        for place in places {
            let ended = fall(place, NO_ABORT_M);
            assert!(matches!(ended, Ended::Ignition(_)), "{ended:?}");
        }
    }

    #[test]
    fn a_gate_shut_after_the_commit_height_brings_the_parachute_while_it_fills() {
        let filling_m = 58.0..75.0;
        let out_of_the_fence: Wrong = |height_m, estimate, _| {
            estimate.state.position_m.y = if height_m < 80.0 { 140.0 } else { 119.0 };
        };
        assert_parachute(out_of_the_fence, filling_m.clone());
        let open_circuit: Wrong = |height_m, _, input| input.igniter_continuity = height_m > 73.0;
        assert_parachute(open_circuit, filling_m.clone());
        let turning: Wrong = |height_m, estimate, _| {
            estimate.state.rate_rad_s.y = if height_m < 80.0 { 1.2 } else { 0.0 };
        };
        assert_parachute(turning, filling_m);
    }

    /// A moving fin inhibits ignition for up to 45 ms, a gust that turns the vehicle for somewhat
    /// longer.
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
