//! Points fins and gimbal.

use nalgebra::Vector3;

use super::swing::Swing;
use super::vehicle_model::Burning;
use super::{Pilot, Pointed};
use crate::computer::SensedInput;
use crate::control::aim::Aim;
use crate::control::fins::{Allocation, FinCommand};
use crate::estimation::estimator::Estimate;
use crate::guidance::descent::{DescentSituation, LEAST_AIRSPEED_M_S};
use crate::guidance::powered::ControlLevel;
use crate::rules::phase::{Mode, Phase};
use crate::vehicle::airframe::MassProperties;

/// Thrust below which the gimbal cannot turn the vehicle, N.
const STEERING_THRUST_N: f64 = 3.0;

/// Angle between nose and airflow, rad, beyond which the body's moment exceeds that of partly
/// closed fins: all fins are opened then.
const ACROSS_THE_AIR_RAD: f64 = 0.65;

/// Whether the sideslip is so large that only fully open fins turn the vehicle back.
fn lies_across_the_air(estimate: &Estimate) -> bool {
    let through_air = estimate.velocity_through_air_m_s();
    let airspeed_m_s = through_air.norm();
    let along_m_s = -through_air.dot(&estimate.state.nose_in_world());
    airspeed_m_s > LEAST_AIRSPEED_M_S && along_m_s < airspeed_m_s * libm::cos(ACROSS_THE_AIR_RAD)
}

impl Pilot {
    /// Points fins and gimbal.
    pub(crate) fn point(&mut self, mode: &Mode, input: &SensedInput) -> Pointed {
        let flying = mode.phase.in_landing_burn();
        if let Some(estimate) = self.estimate {
            let estimate = &estimate;
            let thrusting = self.burning(mode, input.time_s);
            let burning = thrusting.as_ref().filter(|_| flying);
            // Thrust still carries a landed vehicle: the legs then carry little, and wind could tip
            // it over. The gimbal therefore holds it upright until the thrust ends.
            let balances = self.model.mission.upright_after_contact && mode.phase == Phase::Touchdown;
            let (gimbal_rad, added_rad_s) = match (burning, thrusting.as_ref().filter(|_| balances)) {
                (Some(burning), _) => {
                    self.fin_share = self.powered.fin_share(input.time_s).unwrap_or(self.fin_share);
                    (self.gimbal(input.time_s, estimate, burning, &input.fins_rad), [0.0; 2])
                }
                (None, Some(burning)) => (self.turned_towards(&Aim::upright(), estimate, burning), [0.0; 2]),
                (None, None) => self.swing(mode, input),
            };
            self.gimbal_rad = gimbal_rad;
            let mass = self.model.mass_now(self.model.burning_s(input.time_s));
            // The rate added by a swing has ended before a fin has moved.
            let mut calm = *estimate;
            calm.state.rate_rad_s -= Vector3::new(0.0, added_rad_s[0], added_rad_s[1]);
            self.fins_rad =
                self.fins(mode, &calm, &mass, self.model.density_kg_m3(estimate), burning.is_some());
        }
        let level = if flying { self.powered.report().level } else { ControlLevel::Idle };
        Pointed { gimbal_rad: self.gimbal_rad, fins_rad: self.fins_rad, level }
    }

    /// Swings the gimbal before ignition: returns its command, rad, and the cross rates that it has
    /// added, rad/s.
    fn swing(&mut self, mode: &Mode, input: &SensedInput) -> ([f64; 2], [f64; 2]) {
        let may_light = matches!(mode.phase, Phase::AeroDescent | Phase::LandArmed)
            && !mode.interlocks.landing_motor_inhibited;
        let swing = Swing::of(&self.model.mission, &self.model.mass_now(None)).filter(|_| may_light);
        let gyro_rad_s = input.measured.imu.gyro_rad_s;
        swing.map_or_else(Default::default, |swing| {
            self.swing_watch.update(&swing, [gyro_rad_s.y, gyro_rad_s.z])
        })
    }

    fn gimbal(
        &mut self,
        time_s: f64,
        estimate: &Estimate,
        situation: &Burning,
        fins_rad: &[f64; 4],
    ) -> [f64; 2] {
        let fins_m2 = self.model.airframe().fin_drag_area_m2(fins_rad);
        let aim: Aim = self.powered.aim(
            time_s,
            &estimate.state,
            &self.model.powered_situation(estimate, situation, self.model.burn(), fins_m2),
        );
        self.turned_towards(&aim, estimate, situation)
    }

    /// The gimbal command that turns the nose towards an aim.
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
        // Without a landing to steer for, the fins brake, fully open.
        let steering = matches!(mode.phase, Phase::AeroDescent | Phase::LandArmed | Phase::Ignition)
            && !mode.interlocks.landing_motor_inhibited;
        if !(steering || burning) {
            return match mode.phase {
                phase if phase.before_apogee() => [fins.closed_rad(); 4],
                // On the ground the fins hold their position: no servo needs to move there.
                Phase::Touchdown | Phase::Safed => self.fins_rad,
                Phase::Deploy if !self.model.mission.descent.opens_fins => [fins.control_min_rad(); 4],
                _ => [fins.open_rad(); 4],
            };
        }
        let largest_m2 = self.model.airframe().open_fin_drag_area_m2();
        let fins_m2 = self.model.airframe().fin_drag_area_m2(&self.fins_rad);
        let situation = DescentSituation {
            mass_kg: mass.mass_kg,
            inertia_kg_m2: [mass.roll_inertia_kg_m2, mass.pitch_inertia_kg_m2],
            air_density_kg_m3: density_kg_m3,
            wind_m_s: estimate.wind_m_s.push(0.0),
            drag_area_m2: self.model.airframe().unfinned_drag_area_m2(0.0) + fins_m2,
            crossflow_area_m2: self.model.airframe().body.crossflow_area_m2(),
            restoring_m3: self.model.airframe().restoring_m3(fins_m2, mass.cg_station_m),
            body_behind_cg_m: mass.cg_station_m - 0.5 * self.model.airframe().body.length_m,
            time_to_go_s: self.prediction.ignition.command_in_s,
        };
        let demand = self.model.mission.descent.demand(&estimate.state, &situation);
        let (moments_n_m, drag_area_m2, min_rad) = if burning {
            // During the burn the gimbal turns the vehicle; the fins brake and cancel the roll
            // rate.
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
            min_rad,
            max_rad: fins.open_rad(),
        };
        allocation.openings_rad(&FinCommand { moments_n_m, drag_area_m2 }, demand.dynamic_pressure_pa)
    }
}
