//! One frame of the flight.

use alloc::format;

use nalgebra::Vector3;

use super::ascent::{AscentReadings, words_of_ascent};
use super::vehicle_model::Burning;
use super::vertical_speed::SpeedReadings;
use super::{FRAMES_PER_PLAN, Pilot, Pointed, Prediction};
use crate::computer::KeptInput;
use crate::computer::news::Severity;
use crate::computer::table::PhaseTable;
use crate::control::aim::Aim;
use crate::control::fins::{Allocation, FinCommand, OpeningRange};
use crate::estimation::estimator::{Estimate, Measurements, VehicleNow};
use crate::estimation::motor_estimate::{MotorSample, MotorStage};
use crate::estimation::sensor_watch::SensorWatch;
use crate::guidance::descent::{DescentSituation, LEAST_AIRSPEED_M_S};
use crate::guidance::powered::ControlLevel;
use crate::rules::gate::{self, GATE_CHECKS, GateCheck, GateInput};
use crate::rules::phase::{Effect, Effects, Event, Mode, Motor, NO_THRUST_TIMEOUT_S, Phase, Refusal};
use crate::vehicle::airframe::MassProperties;
use crate::vehicle::atmosphere::Air;
use crate::vehicle::fins::Moments;
use crate::vehicle::mission::StartPoint;

/// Frames between outlooks while the ignition is seconds away.
const FRAMES_PER_FAR_LOOK: u64 = 4 * FRAMES_PER_PLAN;
/// A fin farther than this from its command has not reached it, rad.
pub(super) const FIN_THERE_RAD: f64 = 0.1;
/// Heights of a landing, m: a field's slope, the pressure's errors and the weather of a day.
const NEAR_GROUND_M: f64 = 15.0;
/// Below this thrust the gimbal cannot turn the vehicle, N.
const STEERING_THRUST_N: f64 = 3.0;

/// Beyond this angle between nose and airflow, rad, the moment of the body is larger than the moment that partly closed
/// fins can set against it: all fins are opened then.
const ACROSS_THE_AIR_RAD: f64 = 0.65;

/// Whether the air comes so far from the side that only fully open fins turn the vehicle back.
fn lies_across_the_air(estimate: &Estimate) -> bool {
    let through_air = estimate.velocity_through_air_m_s();
    let airspeed_m_s = through_air.norm();
    let along_m_s = -through_air.dot(&estimate.state.nose_in_world());
    airspeed_m_s > LEAST_AIRSPEED_M_S && along_m_s < airspeed_m_s * libm::cos(ACROSS_THE_AIR_RAD)
}

/// What the estimator may use before apogee. The booster's drag and masses are not those of the vehicle, so the air
/// shows no wind. The barometer's ram error belongs to a flow from the nose, not from the tail, and its static ports lie
/// in the booster's wake and in the charge's gas; the lidar looks into the booster.
fn on_the_way_up(
    measurements: &Measurements,
    vehicle: &VehicleNow,
    phase: Phase,
) -> (Measurements, VehicleNow) {
    let measurements = Measurements { pressure_altitude_m: None, lidar_range_m: None, ..*measurements };
    let shaken = phase == Phase::Boost;
    (measurements, VehicleNow { motor_burning: shaken, air_density_kg_m3: 0.0, ..*vehicle })
}

impl Pilot {
    /// Estimates the vehicle's state, and its motor and drag.
    pub(crate) fn estimate_state(&mut self, phase: Phase, input: &KeptInput) {
        let estimate = self.estimated(phase, input);
        self.estimate = Some(estimate);
        self.update_models(phase, input, &estimate);
    }

    /// Follows the ascent, predicts ignition and abort, and watches the fins. Every event goes through the `table`.
    pub(crate) fn predict(&mut self, table: &mut PhaseTable, input: &KeptInput) {
        let Some(estimate) = self.estimate else { return };
        self.watch_the_speeds(input, &estimate);
        // Before the prediction: at apogee an abort has to know at once whether the parachute has room.
        self.watch_the_ascent(table, input, &estimate);
        // A drop lasts 2 to 3 s, so it is predicted in every planning frame.
        let dropped = self.model.mission.start.at == StartPoint::Drone;
        let far = table.mode().phase == Phase::AeroDescent && !dropped;
        let due = input.frame.is_multiple_of(if far { FRAMES_PER_FAR_LOOK } else { FRAMES_PER_PLAN });
        if table.mode().phase.in_descent() {
            // Right after apogee and after a restart an abort would not know whether the parachute has room.
            let unknown = self.prediction == Prediction::default();
            if unknown {
                self.prediction = self.model.fall(&estimate, &self.fins_rad, self.apogee_m);
            }
            if due || unknown {
                self.pose_prediction(input.time_s, &estimate);
            }
        }
        self.fin_watch.update(&input.fins_rad, &self.fins_rad, self.model.mission.estimator.frame_s);
    }

    /// Poses a landing in the first frame of the burn, and again ten frames after the last, or later if that one takes longer: not in
    /// the frame that took it over, so that it can be looked at behind it.
    pub(crate) fn plan(&mut self, mode: &Mode, input: &KeptInput, took_over: bool) {
        let due = !took_over && input.frame >= self.plan_due && mode.phase.in_landing_burn();
        let burning = self.burning(mode, input.time_s).filter(|_| due);
        if let Some((burning, estimate)) = burning.zip(self.estimate)
            && self.pose_landing(input.time_s, &estimate, burning)
        {
            self.plan_due = input.frame + FRAMES_PER_PLAN;
        }
    }

    /// Points fins and gimbal.
    pub(crate) fn point(&mut self, mode: &Mode, input: &KeptInput) -> Pointed {
        let flying = mode.phase.in_landing_burn();
        if let Some(estimate) = self.estimate {
            let estimate = &estimate;
            let thrusting = self.burning(mode, input.time_s);
            let burning = thrusting.as_ref().filter(|_| flying);
            self.gimbal_rad = match burning {
                Some(burning) => {
                    self.fin_share = self.powered.fin_share(input.time_s).unwrap_or(self.fin_share);
                    self.gimbal(input.time_s, estimate, burning, &input.fins_rad)
                }
                None => match thrusting.as_ref().filter(|_| self.balances(mode)) {
                    Some(burning) => self.turned_towards(&Aim::upright(), estimate, burning),
                    None => [0.0; 2],
                },
            };
            let mass = self.model.mass_now(self.model.burning_s(input.time_s));
            self.fins_rad =
                self.fins(mode, estimate, &mass, self.model.density_kg_m3(estimate), burning.is_some());
        }
        let level = if flying { self.powered.report().level } else { ControlLevel::Idle };
        Pointed { gimbal_rad: self.gimbal_rad, fins_rad: self.fins_rad, level }
    }

    /// The vehicle with its motor burning; `None` if it does not burn.
    pub(super) fn burning(&self, mode: &Mode, time_s: f64) -> Option<Burning> {
        let burning_s = self.model.burning_s(time_s)?;
        Some(Burning {
            burning_s,
            mass: self.model.mass_now(Some(burning_s)),
            density_kg_m3: self.model.density_kg_m3(self.estimate.as_ref()?),
            lands_in_place: mode.interlocks.lands_in_place,
        })
    }

    fn estimated(&mut self, phase: Phase, input: &KeptInput) -> Estimate {
        let mut measurements = input.measured;
        self.silence_what_is_wrong(&mut measurements, input.time_s);
        let burning_s = self.model.burning_s(input.time_s);
        let mass = self.model.mass_now(burning_s);
        let height_m = self.estimate.map_or(0.0, |estimate| estimate.state.position_m.z);
        let air = Air::at_height_m(self.model.mission.pad_altitude_m + height_m);
        let vehicle = VehicleNow::of(
            self.model.airframe(),
            &mass,
            air.density_kg_m3,
            input.fins_rad,
            burning_s.is_some() || phase.in_landing_burn(),
            self.model.mission.lidar_ahead_of_feet_m,
        );
        let (measurements, vehicle) = if phase.before_apogee() {
            on_the_way_up(&measurements, &vehicle, phase)
        } else {
            (measurements, vehicle)
        };
        self.estimator.step(&measurements, &vehicle)
    }

    /// A sensor that repeats itself has stopped, and a fix may be outvoted.
    fn silence_what_is_wrong(&mut self, measurements: &mut Measurements, time_s: f64) {
        let said = measurements.gnss.map(|fix| (fix.position_m, fix.velocity_m_s));
        let repeated = said.is_some() && said == self.last_fix;
        self.last_fix = said.or(self.last_fix);
        let outvoted = said.zip(self.estimate).is_some_and(|((_, velocity_m_s), estimate)| {
            self.speeds.outvote(velocity_m_s.z, estimate.state.velocity_m_s.z, time_s)
        });
        measurements.gnss = measurements.gnss.filter(|_| !repeated && !outvoted);
        measurements.pressure_altitude_m =
            measurements.pressure_altitude_m.filter(|altitude_m| !self.speeds.repeats(*altitude_m));
    }

    /// Estimates motor and drag from the specific force along the axis; not on the way up, on the ground or under the
    /// parachute.
    pub(super) fn update_models(&mut self, phase: Phase, input: &KeptInput, estimate: &Estimate) {
        if input.contact || phase == Phase::Chute || phase.before_apogee() {
            return;
        }
        let mass = self.model.mass_now(self.model.burning_s(input.time_s));
        let burning = phase.in_landing_burn();
        let vehicle = VehicleNow::of(
            self.model.airframe(),
            &mass,
            self.model.density_kg_m3(estimate),
            input.fins_rad,
            burning,
            self.model.mission.lidar_ahead_of_feet_m,
        );
        let burns = self.model.motor.stage() == MotorStage::Burning;
        let vehicle = if burns { vehicle.in_exhaust(&self.model.mission.exhaust) } else { vehicle };
        let through_air_m_s =
            estimate.state.world_from_body.inverse_transform_vector(&estimate.velocity_through_air_m_s());
        let sample = MotorSample {
            time_s: input.time_s,
            axial_specific_force_m_s2: estimate.specific_force_m_s2.x,
            mass_kg: mass.mass_kg,
            axial_air_force_n: vehicle.air_force_n(&through_air_m_s, &estimate.state.rate_rad_s).x,
            gimbal_rad: self.gimbal_rad,
            may_burn: burning,
        };
        self.model.learn(&sample);
    }

    fn watch_the_speeds(&mut self, input: &KeptInput, estimate: &Estimate) {
        let Measurements { imu, pressure_altitude_m, gnss, .. } = input.measured;
        self.speeds.take(&SpeedReadings {
            time_s: input.time_s,
            frame_s: self.model.mission.estimator.frame_s,
            vertical_m_s2: (estimate.state.world_from_body * imu.specific_force_m_s2).z
                - self.model.mission.gravity_m_s2,
            pressure_altitude_m: pressure_altitude_m.filter(|_| !self.ascent.is_charged(input.time_s)),
            gnss_m_s: gnss.map(|fix| fix.velocity_m_s.z),
            estimated_m_s: estimate.state.velocity_m_s.z,
        });
    }

    /// Moves through the phases up to apogee.
    fn watch_the_ascent(&mut self, table: &mut PhaseTable, input: &KeptInput, estimate: &Estimate) {
        let phase = table.mode().phase;
        let Some(launch) = self.model.mission.launch.as_ref().filter(|_| phase.before_apogee()) else {
            return;
        };
        let seen = AscentReadings {
            time_s: input.time_s,
            frame_s: self.model.mission.estimator.frame_s,
            phase,
            axial_specific_force_m_s2: input.measured.imu.specific_force_m_s2.x,
            pressure_altitude_m: input.measured.pressure_altitude_m,
            speeds: self.speeds,
            vertical_m_s: estimate.state.velocity_m_s.z,
            booster_attached: input.booster_attached,
            separate_before_apogee_s: launch.separate_before_apogee_s,
            burn_time_s: launch.booster.motor_curve.burn_time_s(),
        };
        let Some(event) = self.ascent.update(&seen) else { return };
        if let Event::Apogee { .. } = event {
            self.apogee_m = estimate.state.position_m.z;
        }
        if let Some((severity, words)) = words_of_ascent(event, estimate) {
            table.say(severity, words);
        }
        self.try_apply(table, event, input.time_s);
    }

    /// Moves through the phases of the descent and the landing.
    pub(crate) fn decide(&mut self, table: &mut PhaseTable, input: &KeptInput, sensors: &SensorWatch) {
        let Some(estimate) = self.estimate else { return };
        let estimate = &estimate;
        let time_s = input.time_s;
        if let Some((hopeless, why)) = self.gate_will_not_open(table.mode(), input, estimate, sensors)
            && self.apply(table, hopeless, time_s).is_ok()
        {
            table.say(Severity::Critical, format!("no landing: {why}"));
            self.gave_up = Some(why);
        }
        match table.mode().phase {
            Phase::Deploy if self.fins_are_out(&input.fins_rad) => {
                self.try_apply(table, Event::FinsConfirmed, time_s);
            }
            Phase::AeroDescent => {
                let soon = self
                    .prediction
                    .ignition
                    .command_in_s
                    .is_some_and(|in_s| in_s <= self.model.mission.ignition.arm_before_s);
                if soon {
                    self.try_apply(table, Event::LandArm, time_s);
                }
            }
            Phase::LandArmed => self.consider_ignition(table, input, estimate, sensors),
            Phase::Ignition => {
                if self.model.burning_s(time_s).is_some() {
                    self.try_apply(table, Event::ThrustConfirmed, time_s);
                } else if self.ignited_at_s.is_some_and(|at_s| time_s - at_s >= NO_THRUST_TIMEOUT_S)
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
            && (under_parachute || self.is_near_the_ground(estimate, time_s, sensors))
        {
            let (thrust_n, weight_n) = self.thrust_and_weight_n(time_s);
            let thrust_below_weight = thrust_n < weight_n;
            self.try_apply(table, Event::Contact { thrust_below_weight }, time_s);
        }
        if table.mode().motor == Motor::Burning && self.model.burn_is_over(time_s) {
            self.try_apply(table, Event::Burnout, time_s);
        }
    }

    /// Whether any height is that of a landing: a foot's switch alone ends no flight.
    fn is_near_the_ground(&self, estimate: &Estimate, time_s: f64, sensors: &SensorWatch) -> bool {
        let below_cg_m = estimate.state.position_m.z - self.feet_height_m(estimate);
        self.feet_height_m(estimate) <= NEAR_GROUND_M
            || self.speeds.altitude_m(time_s).is_some_and(|height_m| height_m - below_cg_m <= NEAR_GROUND_M)
            || sensors.lidar_range_m().is_some_and(|range_m| range_m <= NEAR_GROUND_M)
    }

    /// The motor's thrust as estimated, and the weight, N.
    pub(crate) fn thrust_and_weight_n(&self, time_s: f64) -> (f64, f64) {
        let burning_s = self.model.burning_s(time_s);
        let thrust_n = burning_s.map_or(0.0, |burning_s| self.model.burn().thrust_n(burning_s));
        (thrust_n, self.model.mass_now(burning_s).mass_kg * self.model.mission.gravity_m_s2)
    }

    fn consider_ignition(
        &mut self,
        table: &mut PhaseTable,
        input: &KeptInput,
        estimate: &Estimate,
        sensors: &SensorWatch,
    ) {
        if self.ignition_overdue_s(estimate).is_some() {
            let checks = self.gate_checks(table.mode(), input, estimate, sensors);
            self.gate_refusal = checks.iter().find(|check| check.shut).map(|check| check.name);
            let open = self.gate_refusal.is_none();
            self.try_apply(table, Event::IgnitionGate { open }, input.time_s);
        }
    }

    /// Height of the feet, m.
    pub fn feet_height_m(&self, estimate: &Estimate) -> f64 {
        estimate.state.position_m.z - self.model.feet_below_cg_m(&self.model.mass.at(0.0))
    }

    /// Height at which thrust, commanded at the next frame, would begin, m.
    pub(super) fn onset_m(&self, estimate: &Estimate) -> f64 {
        self.prediction.ignition.onset_height_m - (self.prediction.height_m - self.feet_height_m(estimate))
    }

    pub(super) fn ignition_overdue_s(&self, estimate: &Estimate) -> Option<f64> {
        self.prediction.ignition.overdue_s(self.onset_m(estimate))
    }

    /// The event that an abort is now, from the findings of the last frame, if there was one.
    pub(crate) fn abort_event(&self, mode: &Mode, last: Option<&KeptInput>, sensors: &SensorWatch) -> Event {
        let found = last.zip(self.estimate.as_ref());
        let gate_open = found.is_some_and(|(input, estimate)| {
            !self.gate_checks(mode, input, estimate, sensors).iter().any(|check| check.shut)
        });
        Event::AbortRequested {
            lifted_off: self.ascent.has_lifted_off(),
            above_commit_height: self.parachute_has_room(gate_open),
            gate_open,
        }
    }

    /// Room to spare where the motor is another way down, and just enough where it is not.
    fn parachute_has_room(&self, gate_open: bool) -> bool {
        let prediction = &self.prediction;
        let enough_m = if gate_open { prediction.commit_height_m } else { prediction.filling_height_m() };
        prediction.height_m > enough_m
    }

    /// The checks of the gate with what they find now.
    pub(super) fn gate_checks(
        &self,
        mode: &Mode,
        input: &KeptInput,
        estimate: &Estimate,
        sensors: &SensorWatch,
    ) -> [GateCheck; GATE_CHECKS] {
        let state = &estimate.state;
        let onset_m = self.onset_m(estimate);
        let found = GateInput {
            tilt_rad: state.tilt_rad(),
            vertical_speed_m_s: state.velocity_m_s.z,
            pitch_rate_rad_s: libm::hypot(state.rate_rad_s.y, state.rate_rad_s.z),
            speed_m_s: state.velocity_m_s.norm(),
            predicted_speed_m_s: self.prediction.predicted_speed_m_s,
            // With one source left there is no disagreement; the estimator's health says whether that source is
            // reliable.
            height_disagreement_m: estimate.heights.disagreement_m().unwrap_or(0.0),
            landing_feasible: self.prediction.ignition.band.is_some_and(|band| band.contains(onset_m)),
            predicted_touchdown_x_m: self.prediction.touchdown_distance_m,
            fins_confirmed: self.fins_there(&input.fins_rad) && !self.fin_watch.any_stuck(),
            parachute_stowed: mode.phase != Phase::Chute,
            igniter_continuity: input.igniter_continuity,
            estimator_healthy: estimate.health.is_good(),
            lands_ahead: self.prediction.lands_ahead,
            sensors_agree: !self.is_astray(sensors),
        };
        gate::checks(&self.model.mission.gate, &found)
    }

    /// The fins have left their closed stop and stand where they are commanded to. In the frame that enters DEPLOY they still
    /// stand where the ascent had them, and that says nothing.
    fn fins_are_out(&self, fins_rad: &[f64; 4]) -> bool {
        let least_rad = self.model.airframe().fins.control_min_rad() - FIN_THERE_RAD;
        fins_rad.iter().all(|fin_rad| *fin_rad >= least_rad) && self.fins_there(fins_rad)
    }

    pub(super) fn fins_there(&self, fins_rad: &[f64; 4]) -> bool {
        fins_rad.iter().zip(&self.fins_rad).all(|(there, wanted)| (there - wanted).abs() < FIN_THERE_RAD)
    }

    /// Applies an event. If the table refuses it, nothing changes.
    fn try_apply(&mut self, table: &mut PhaseTable, event: Event, time_s: f64) {
        let _ = self.apply(table, event, time_s);
    }

    /// Applies an event, from whomever it comes.
    ///
    /// # Errors
    /// The table refuses it, and nothing has changed.
    pub(crate) fn apply(
        &mut self,
        table: &mut PhaseTable,
        event: Event,
        time_s: f64,
    ) -> Result<Effects, Refusal> {
        let effects = table.happen(event)?;
        if effects.contains(Effect::IgniteLandingMotor) {
            self.ignited_at_s = Some(time_s);
        }
        Ok(effects)
    }

    fn gimbal(
        &mut self,
        time_s: f64,
        estimate: &Estimate,
        situation: &Burning,
        fins_rad: &[f64; 4],
    ) -> [f64; 2] {
        let fins_m2 = self.model.fin_drag_area_m2(fins_rad);
        let aim: Aim = self.powered.aim(
            time_s,
            &estimate.state,
            &self.model.powered_situation(estimate, situation, self.model.burn(), fins_m2),
        );
        self.turned_towards(&aim, estimate, situation)
    }

    /// Whether the thrust still carries a vehicle that stands: the legs then carry little, and the wind tips it over. So the
    /// gimbal holds it upright until the thrust ends.
    fn balances(&self, mode: &Mode) -> bool {
        self.model.mission.upright_after_contact && mode.phase == Phase::Touchdown
    }

    /// The gimbal's command that turns the nose as an aim wants.
    fn turned_towards(&mut self, aim: &Aim, estimate: &Estimate, situation: &Burning) -> [f64; 2] {
        let thrust_n = self.model.burn().thrust_n(situation.burning_s);
        let turning_rad_s2 = if thrust_n > STEERING_THRUST_N {
            thrust_n * self.model.airframe().thrust_arm_m(situation.mass.cg_station_m)
                / situation.mass.pitch_inertia_kg_m2
        } else {
            0.0
        };
        let limit_rad = self.model.airframe().gimbal.limit_rad();
        self.aim_loop.command_rad(
            &estimate.state.world_from_body,
            &estimate.state.rate_rad_s,
            turning_rad_s2,
            aim,
            limit_rad,
        )
    }

    fn fins(
        &self,
        mode: &Mode,
        estimate: &Estimate,
        mass: &MassProperties,
        density_kg_m3: f64,
        burning: bool,
    ) -> [f64; 4] {
        let fins = &self.model.airframe().fins;
        // If no landing is steered for, the fins brake, fully open.
        let steering = matches!(mode.phase, Phase::AeroDescent | Phase::LandArmed | Phase::Ignition)
            && !mode.interlocks.landing_motor_inhibited;
        if !(steering || burning) {
            return match mode.phase {
                phase if phase.before_apogee() => [fins.closed_rad(); 4],
                // On the ground they stay where they are: no servo needs to move there.
                Phase::Touchdown | Phase::Safed => self.fins_rad,
                Phase::Deploy if !self.model.mission.descent.opens_fins => [fins.control_min_rad(); 4],
                _ => [fins.open_rad(); 4],
            };
        }
        let largest_m2 = self.model.airframe().open_fin_drag_area_m2();
        let fins_m2 = self.model.fin_drag_area_m2(&self.fins_rad);
        let situation = DescentSituation {
            mass_kg: mass.mass_kg,
            inertia_kg_m2: [mass.roll_inertia_kg_m2, mass.pitch_inertia_kg_m2],
            air_density_kg_m3: density_kg_m3,
            wind_m_s: estimate.wind_m_s.push(0.0),
            drag_area_m2: self.model.body_drag_area_m2() + fins_m2,
            crossflow_area_m2: self.model.crossflow_area_m2(),
            restoring_m3: self.model.airframe().restoring_m3(fins_m2, mass.cg_station_m),
            body_behind_cg_m: mass.cg_station_m - 0.5 * self.model.airframe().body.length_m,
            time_to_go_s: self.prediction.ignition.command_in_s,
        };
        let demand = self.model.mission.descent.demand(&estimate.state, &situation);
        let (moments, drag_area_m2, min_rad) = if burning {
            // During the burn the gimbal turns the vehicle; the fins brake and stop it from rolling.
            (Vector3::new(demand.moment_n_m.x, 0.0, 0.0), self.fin_share * largest_m2, fins.closed_rad())
        } else if !self.model.mission.descent.opens_fins {
            return [fins.control_min_rad(); 4];
        } else if !lies_across_the_air(estimate) {
            (demand.moment_n_m, largest_m2, fins.control_min_rad())
        } else {
            return [fins.open_rad(); 4];
        };
        let allocation = Allocation {
            model: self.model.airframe().fin_model(),
            arm_m: fins.station_m - mass.cg_station_m,
            range: OpeningRange { min_rad, max_rad: fins.open_rad() },
        };
        let command = FinCommand {
            moments: Moments { roll_n_m: moments.x, pitch_n_m: moments.y, yaw_n_m: moments.z },
            drag_area_m2,
        };
        allocation.openings_rad(&command, demand.dynamic_pressure_pa)
    }
}
