//! One frame of the flight: estimates, follows the ascent, and requests plans and predictions.

use nalgebra::Vector3;

use super::ascent::{AscentReadings, words_of_ascent};
use super::planner::Problem;
use super::vehicle_model::Burning;
use super::vertical_speed::SpeedReadings;
use super::{FRAMES_PER_PLAN, Pilot, Prediction};
use crate::computer::SensedInput;
use crate::computer::table::PhaseTable;
use crate::estimation::estimator::{Estimate, Measurements};
use crate::estimation::motor_estimate::MotorSample;
use crate::estimation::sensor_watch::SensorWatch;
use crate::rules::phase::{Event, Mode, Phase};
use crate::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use crate::vehicle::mission::StartPoint;

/// Frames between predictions while ignition is still seconds away.
const FRAMES_PER_FAR_LOOK: u64 = 4 * FRAMES_PER_PLAN;

/// Longest outage of the accelerometer that the estimate tolerates, s.
const ACCELEROMETER_LOST_S: f64 = 0.5;

/// Rotation below which a vehicle on the ground is at rest, rad/s.
const STILL_RAD_S: f64 = 0.05;

/// Velocity uncertainty added per frame while the force is expected instead of measured, m/s: it is
/// off by some 0.3 m/s^2 for half a second.
const EXPECTED_FORCE_M_S: f64 = 0.02;

impl Pilot {
    /// Estimates the vehicle's state, and its motor and drag.
    pub(crate) fn estimate_state(
        &mut self,
        (phase, is_over): (Phase, bool),
        input: &SensedInput,
        sensors: &SensorWatch,
    ) {
        // Also on the ground, where the gimbal continues to balance.
        self.speeds.accelerometer_lost = sensors.accelerometer_lost_s() >= ACCELEROMETER_LOST_S;
        let thrust_sensed = !(self.model.motor.burns() && sensors.accelerometer_is_lost());
        let mut estimate = self.estimated(phase, input, thrust_sensed);
        // A vehicle may be dragged by its parachute: fixes show it, or its rotation does.
        let turns_rad_s = (sensors.turns_rad_s() - estimate.gyro_bias_rad_s).norm();
        if is_over && (!sensors.gnss_speaks() || turns_rad_s < STILL_RAD_S) {
            self.estimator.take_rest();
            estimate = self.estimator.estimate();
        }
        self.estimate = Some(estimate);
        if thrust_sensed {
            self.update_models(phase, input, &estimate);
        }
    }

    /// Follows the ascent, predicts ignition and abort, and monitors the fins. Every event goes
    /// through the `table`.
    pub(crate) fn predict(&mut self, table: &mut PhaseTable, input: &SensedInput) {
        let Some(estimate) = self.estimate else { return };
        self.watch_the_speeds(input, &estimate);
        // Before the prediction: at apogee an abort needs to know at once whether the parachute has
        // height.
        self.watch_the_ascent(table, input, &estimate);
        // A drop lasts 2 to 3 s, so it is predicted in every planning frame.
        let dropped = self.model.mission.start.at == StartPoint::Drone;
        let far = table.mode().phase == Phase::AeroDescent && !dropped;
        let due = input.frame.is_multiple_of(if far { FRAMES_PER_FAR_LOOK } else { FRAMES_PER_PLAN });
        if table.mode().phase.in_descent() {
            // Right after apogee and after a restart the parachute height for an abort is not yet
            // computed.
            let unknown = self.prediction == Prediction::default();
            if unknown {
                self.prediction = self.model.fall(&estimate, &self.fins_rad, self.apogee_m);
            }
            if due || unknown {
                let (fins_rad, apogee_m) = (self.fins_rad, self.apogee_m);
                self.request(input.time_s, &estimate, Problem::Prediction { fins_rad, apogee_m });
            }
        }
        self.fin_watch.update(&input.fins_rad, &self.fins_rad, self.model.mission.estimator.frame_s);
    }

    /// Requests a landing in the first frame of the burn, and again ten frames after the last, or
    /// later if that one takes longer. Never in the frame that took one over, so that it can be
    /// inspected after that frame.
    pub(crate) fn plan(&mut self, mode: &Mode, input: &SensedInput, took_over: bool) {
        let due = !took_over && input.frame >= self.plan_due && mode.phase.in_landing_burn();
        let burning = self.burning(mode, input.time_s).filter(|_| due);
        if let Some((burning, estimate)) = burning.zip(self.estimate)
            && self.request(input.time_s, &estimate, Problem::Landing(burning))
        {
            self.plan_due = input.frame + FRAMES_PER_PLAN;
        }
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

    fn estimated(&mut self, phase: Phase, input: &SensedInput, thrust_sensed: bool) -> Estimate {
        let mut measurements = input.measured;
        self.silence_what_is_wrong(&mut measurements, input.time_s);
        if let Some(estimate) = self.estimate.filter(|_| !thrust_sensed) {
            measurements.imu.specific_force_m_s2 = self.expected_force_m_s2(phase, input, &estimate);
            self.estimator.inflate_velocity(&Vector3::repeat(EXPECTED_FORCE_M_S));
        }
        let burning_s = self.model.burning_s(input.time_s);
        let mass = self.model.mass_now(burning_s);
        let height_m = self.estimate.map_or(0.0, |estimate| estimate.state.position_m.z);
        let air = self.model.mission.site.air_at_m(height_m);
        let burns = burning_s.is_some() || phase.in_landing_burn();
        let mut vehicle = self.model.now(&mass, air.density_kg_m3, input.fins_rad, burns);
        if phase.before_apogee() {
            // The booster changes drag and masses, so the specific force shows no wind. The
            // barometer's ram error is for flow from the tail, and its static ports are in the
            // booster's wake and in the charge's gas; the lidar faces the booster.
            (measurements.pressure_altitude_m, measurements.lidar_range_m) = (None, None);
            (vehicle.motor_burning, vehicle.air_density_kg_m3) = (phase == Phase::Boost, 0.0);
        }
        self.estimator.step(&measurements, &vehicle)
    }

    /// Removes a frozen pressure, and a fix that estimate and pressure outvote.
    fn silence_what_is_wrong(&mut self, measurements: &mut Measurements, time_s: f64) {
        let outvoted = measurements.gnss.zip(self.estimate).is_some_and(|(fix, estimate)| {
            self.speeds.outvote(fix.velocity_m_s.z, estimate.state.velocity_m_s.z, time_s)
        });
        measurements.gnss = measurements.gnss.filter(|_| !outvoted);
        measurements.pressure_altitude_m =
            measurements.pressure_altitude_m.filter(|altitude_m| !self.speeds.repeats(*altitude_m));
    }

    /// Estimates motor and drag from the axial specific force; not on the way up, on the ground or
    /// under the parachute.
    pub(super) fn update_models(&mut self, phase: Phase, input: &SensedInput, estimate: &Estimate) {
        if input.contact || phase == Phase::Chute || phase.before_apogee() {
            return;
        }
        let (air_force_n, mass_kg) = self.air_force_n(phase, input, estimate);
        let sample = MotorSample {
            time_s: input.time_s,
            axial_specific_force_m_s2: estimate.specific_force_m_s2.x,
            mass_kg,
            axial_air_force_n: air_force_n.x,
            gimbal_rad: self.gimbal_rad,
            may_burn: phase.in_landing_burn(),
        };
        self.model.learn(&sample);
    }

    /// The certified aerodynamic force, body axes, N, and the mass, kg.
    fn air_force_n(&self, phase: Phase, input: &SensedInput, estimate: &Estimate) -> (Vector3<f64>, f64) {
        let mass = self.model.mass_now(self.model.burning_s(input.time_s));
        let density_kg_m3 = self.model.density_kg_m3(estimate);
        let vehicle = self.model.now(&mass, density_kg_m3, input.fins_rad, phase.in_landing_burn());
        let burns = self.model.motor.burns();
        let vehicle = if burns { vehicle.in_exhaust(&self.model.mission.exhaust) } else { vehicle };
        let through_air_m_s =
            estimate.state.world_from_body.inverse_transform_vector(&estimate.velocity_through_air_m_s());
        (vehicle.air_force_n(&through_air_m_s, &estimate.state.rate_rad_s), mass.mass_kg)
    }

    /// The expected accelerometer reading from the motor and drag estimates, body, m/s^2.
    fn expected_force_m_s2(&self, phase: Phase, input: &SensedInput, estimate: &Estimate) -> Vector3<f64> {
        let (thrust_n, _) = self.thrust_and_weight_n(input.time_s);
        let [(sin_pitch, cos_pitch), (sin_yaw, cos_yaw)] = input.gimbal_rad.map(libm::sincos);
        let thrust_n = Vector3::new(cos_pitch * cos_yaw, sin_yaw, -sin_pitch * cos_yaw) * thrust_n;
        let (air_force_n, mass_kg) = self.air_force_n(phase, input, estimate);
        (thrust_n + air_force_n * self.model.motor.air_scale()) / mass_kg + estimate.accelerometer_bias_m_s2
    }

    fn watch_the_speeds(&mut self, input: &SensedInput, estimate: &Estimate) {
        let Measurements { imu, pressure_altitude_m, gnss, .. } = input.measured;
        // A fix does not follow the motion of a faulty inertial unit: the pressure confirms it
        // instead.
        let confirmed_m_s = gnss
            .map(|fix| fix.velocity_m_s.z)
            .filter(|m_s| self.speeds.pressure_confirms(*m_s, input.time_s, self.ascent.through_gas_s()));
        let admitted_m_s = self.estimator.admitted_gnss_m_s().map(|velocity_m_s| velocity_m_s.z);
        self.speeds.take(&SpeedReadings {
            time_s: input.time_s,
            frame_s: self.model.mission.estimator.frame_s,
            vertical_m_s2: (estimate.state.world_from_body * imu.specific_force_m_s2).z
                - STANDARD_GRAVITY_M_S2,
            pressure_altitude_m: pressure_altitude_m.filter(|_| !self.ascent.is_charged(input.time_s)),
            gnss_m_s: admitted_m_s.or(confirmed_m_s),
            estimated_m_s: estimate.state.velocity_m_s.z,
        });
    }

    /// Phase changes up to apogee.
    fn watch_the_ascent(&mut self, table: &mut PhaseTable, input: &SensedInput, estimate: &Estimate) {
        let phase = table.mode().phase;
        let Some(launch) = self.model.mission.launch.as_ref().filter(|_| phase.before_apogee()) else {
            return;
        };
        let seen = AscentReadings {
            time_s: input.time_s,
            frame_s: self.model.mission.estimator.frame_s,
            phase,
            axial_specific_force_m_s2: input.measured.imu.specific_force_m_s2.x,
            specific_force_m_s2: libm::sqrt(input.measured.imu.specific_force_m_s2.norm_squared()),
            pressure_altitude_m: input.measured.pressure_altitude_m,
            speeds: self.speeds,
            vertical_m_s: estimate.state.velocity_m_s.z,
            booster_attached: input.booster_attached,
            separate_before_apogee_s: launch.separate_before_apogee_s,
            burn_time_s: launch.booster.motor_curve.burn_time_s(),
        };
        if self.ascent.parts(input.booster_attached) {
            let gained_m_s = launch.booster.separation_impulse_n_s / self.model.mass.at(0.0).mass_kg;
            self.estimator.take_shock(gained_m_s);
        }
        let Some(event) = self.ascent.update(&seen) else { return };
        if let Event::Apogee { .. } = event {
            self.apogee_m = estimate.state.position_m.z;
        }
        let (height_m, climb_m_s) = (self.feet_height_m(estimate), estimate.state.velocity_m_s.z);
        if let Some((severity, words)) = words_of_ascent(event, height_m, climb_m_s) {
            table.report(severity, words);
        }
        self.try_apply(table, event, input.time_s);
    }
}
