//! Phase 1: falling tail-first on four fins, steered back to the pad.
//!
//! The fins' drag acts along the wind and gives no lift, but the body gives lift: when its nose
//! leans away from the wind by an angle of attack, the air on its side pushes it the other way, by
//! `1/2 rho V^2 S_n sin^2` (H. J. Allen and E. W. Perkins, NACA Report 1048, 1951). The law
//! computes the horizontal acceleration that brings the vehicle to rest over the pad at ignition
//! (the least-effort law `a = -(6 p / t^2 + 4 v / t)`; C. N. D'Souza, "An optimal guidance law for
//! planetary landing", AIAA 97-3709). It turns the acceleration into a lean and the lean into a
//! moment, and the [allocation](crate::control::fins) finds four openings. The lean is limited,
//! because the body's own moment grows with it and the fins' moment does not.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::control::aim::turn_to_aim_rad;
use crate::vehicle::rigid::RigidState;

/// Below this airspeed the fins are too weak for steering, m/s.
pub const LEAST_AIRSPEED_M_S: f64 = 12.0;
/// A fall to less than this speed is short, m/s: fins brake little in it, and the wind is as fast
/// as half of it.
pub const SHORT_FALL_M_S: f64 = 18.0;
/// Below this airspeed they are too weak even to control the roll, m/s.
const LEAST_ROLLING_AIRSPEED_M_S: f64 = 2.0;

/// Settings of the steering.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct DescentGains {
    /// Largest commanded angle of attack, degrees.
    pub lean_max_deg: f64,
    /// Largest commanded angle of attack at ignition, because the gate needs the vehicle nearly
    /// upright, degrees.
    pub lean_at_ignition_deg: f64,
    /// Time before the ignition from which the lean is reduced, s.
    #[serde(default)]
    pub lean_fades_s: f64,
    /// Least natural frequency of the attitude loop, rad/s.
    pub natural_frequency_rad_s: f64,
    /// Stiffness of the attitude loop over the dynamic pressure, m^3. It applies where it exceeds
    /// the stiffness of the least natural frequency. An error of the aerodynamic moment grows with
    /// the dynamic pressure, and so does the authority of the fins.
    #[serde(default)]
    pub stiffness_m3: f64,
    pub damping: f64,
    /// Whether the fins open in the fall. In a short one they brake little, and turn the vehicle
    /// into the wind.
    #[serde(default)]
    pub opens_fins: bool,
    /// Decay rate of the roll rate, 1/s.
    pub roll_decay_per_s: f64,
    /// Lower limit of the time to go in the steering law, s.
    pub time_to_go_min_s: f64,
}

/// The law's data of the vehicle and the air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DescentSituation {
    pub mass_kg: f64,
    /// Moments of inertia about the roll axis and across it, kg m^2.
    pub inertia_kg_m2: [f64; 2],
    pub air_density_kg_m3: f64,
    pub wind_m_s: Vector3<f64>,
    /// Drag area of body, fins and legs along the wind, m^2.
    pub drag_area_m2: f64,
    /// Drag area of the body across its axis, m^2.
    pub crossflow_area_m2: f64,
    /// [`Airframe::restoring_m3`](crate::vehicle::airframe::Airframe::restoring_m3).
    pub restoring_m3: f64,
    /// Distance of the body's middle behind the centre of gravity, m. The crossflow acts there and
    /// turns the nose away from the wind.
    pub body_behind_cg_m: f64,
    /// Time until the vehicle should be at rest over the pad, s; `None` while not available.
    pub time_to_go_s: Option<f64>,
}

/// The demand on the fins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DescentDemand {
    /// Moments about body x, y, z, N m.
    pub moment_n_m: Vector3<f64>,
    pub dynamic_pressure_pa: f64,
    /// Commanded direction of the nose, world.
    pub nose_in_world: Vector3<f64>,
}

impl DescentGains {
    /// Whether the fins have an arm to steer by. Without one they only act against roll.
    pub fn steers(&self) -> bool {
        self.stiffness_m3 > 0.0
    }

    /// The commanded horizontal acceleration, m/s^2, in the world.
    fn steering_m_s2(&self, state: &RigidState, situation: &DescentSituation) -> Vector3<f64> {
        let time_s = situation.time_to_go_s.unwrap_or(0.0).max(self.time_to_go_min_s);
        let wanted = state.position_m * (-6.0 / (time_s * time_s)) + state.velocity_m_s * (-4.0 / time_s);
        Vector3::new(wanted.x, wanted.y, 0.0)
    }

    /// The demand on the fins.
    pub fn demand(&self, state: &RigidState, situation: &DescentSituation) -> DescentDemand {
        let through_air_m_s = state.velocity_m_s - situation.wind_m_s;
        let airspeed_m_s = through_air_m_s.norm();
        let dynamic_pressure_pa = 0.5 * situation.air_density_kg_m3 * airspeed_m_s * airspeed_m_s;
        let [roll_inertia, inertia] = situation.inertia_kg_m2;
        let rate = state.rate_rad_s;
        let roll_n_m = -roll_inertia * self.roll_decay_per_s * rate.x;
        if airspeed_m_s < LEAST_AIRSPEED_M_S {
            let rolling = airspeed_m_s > LEAST_ROLLING_AIRSPEED_M_S;
            return DescentDemand {
                moment_n_m: Vector3::x() * if rolling { roll_n_m } else { 0.0 },
                dynamic_pressure_pa,
                nose_in_world: Vector3::z(),
            };
        }
        let upstream = -through_air_m_s / airspeed_m_s;
        let lean = self.lean(state, situation, &upstream, dynamic_pressure_pa);
        let nose_in_world = (upstream - lean).normalize();

        let error = turn_to_aim_rad(&state.world_from_body, &nose_in_world);
        // The moment that holds the commanded lean against the air: the attitude loop alone is much
        // softer than the weathercock effect.
        let wanted_lean = error - turn_to_aim_rad(&state.world_from_body, &upstream);
        let held_n_m = dynamic_pressure_pa
            * (situation.restoring_m3
                - situation.crossflow_area_m2 * situation.body_behind_cg_m * libm::sin(wanted_lean.norm()));
        let frequency = self.frequency_rad_s(dynamic_pressure_pa, inertia);
        let turn = |error: f64, rate: f64| {
            inertia * (frequency * frequency * error - 2.0 * self.damping * frequency * rate)
        };
        let moment_n_m = Vector3::new(roll_n_m, turn(error.y, rate.y), turn(error.z, rate.z))
            + Vector3::new(0.0, wanted_lean.y, wanted_lean.z) * held_n_m;
        DescentDemand { moment_n_m, dynamic_pressure_pa, nose_in_world }
    }

    /// Natural frequency of the attitude loop at a dynamic pressure, rad/s.
    fn frequency_rad_s(&self, dynamic_pressure_pa: f64, inertia_kg_m2: f64) -> f64 {
        let least = self.natural_frequency_rad_s;
        libm::sqrt((least * least).max(self.stiffness_m3 * dynamic_pressure_pa / inertia_kg_m2))
    }

    /// The lean of the nose out of the wind: the tangent of the angle of attack, along the
    /// commanded force.
    fn lean(
        &self,
        state: &RigidState,
        situation: &DescentSituation,
        upstream: &Vector3<f64>,
        dynamic_pressure_pa: f64,
    ) -> Vector3<f64> {
        let per_mass = dynamic_pressure_pa / situation.mass_kg;
        // The drag along the wind always acts.
        let carried_m_s2 = upstream * (per_mass * situation.drag_area_m2);
        let carried_m_s2 = Vector3::new(carried_m_s2.x, carried_m_s2.y, 0.0);
        let wanted_m_s2 = self.steering_m_s2(state, situation) - carried_m_s2;
        let across = wanted_m_s2 - upstream * wanted_m_s2.dot(upstream);
        let (sine, cosine) = libm::sincos(self.lean_max_deg.to_radians());
        let most = sine / cosine;
        // Linear in the lean and exact at its limit: the square root would have an infinite slope
        // at zero.
        let per_lean_m_s2 = per_mass * situation.crossflow_area_m2 * sine * sine / most;
        let lean = across / per_lean_m_s2.max(1e-6);
        let most = libm::tan(self.lean_allowed_rad(situation.time_to_go_s));
        let length = lean.norm();
        if length > most { lean * (most / length) } else { lean }
    }

    /// The largest lean at a time before the ignition, rad; the full lean while that time is
    /// unknown.
    fn lean_allowed_rad(&self, time_to_go_s: Option<f64>) -> f64 {
        let share = time_to_go_s.map_or(1.0, |time_s| (time_s / self.lean_fades_s - 0.5).clamp(0.0, 1.0));
        (self.lean_at_ignition_deg + share * (self.lean_max_deg - self.lean_at_ignition_deg)).to_radians()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::vehicle::rigid::upright;

    fn gains() -> DescentGains {
        DescentGains {
            lean_max_deg: 14.0,
            lean_at_ignition_deg: 6.0,
            lean_fades_s: 1.5,
            natural_frequency_rad_s: 3.0,
            stiffness_m3: 0.0,
            damping: 0.8,
            opens_fins: true,
            roll_decay_per_s: 3.0,
            time_to_go_min_s: 2.5,
        }
    }

    fn situation() -> DescentSituation {
        DescentSituation {
            mass_kg: 3.13,
            inertia_kg_m2: [0.003, 0.12],
            air_density_kg_m3: 1.2,
            wind_m_s: Vector3::zeros(),
            drag_area_m2: 0.031,
            crossflow_area_m2: 0.0622,
            restoring_m3: 0.0061,
            body_behind_cg_m: 0.05,
            time_to_go_s: Some(5.0),
        }
    }

    fn falling() -> RigidState {
        let mut state = RigidState::upright(150.0);
        state.velocity_m_s = Vector3::new(0.0, 0.0, -38.0);
        state
    }

    /// Least phase margin, degrees, and gain margins upwards and downwards, dB, of the attitude
    /// loop in a plant with this additional aerodynamic stiffness, 1/s^2, and a delay, s.
    fn margins(natural: f64, damping: f64, stiffness_per_s2: f64, delay_s: f64) -> [f64; 3] {
        use nalgebra::Complex;
        let open_loop = |rad_s: f64| {
            let s = Complex::new(0.0, rad_s);
            let (sin, cos) = libm::sincos(rad_s * delay_s);
            let late = Complex::new(cos, -sin);
            late * (s * (2.0 * damping * natural) + natural * natural) / (s * s + stiffness_per_s2)
        };
        let size = |number: Complex<f64>| libm::hypot(number.re, number.im);
        let decibels = |ratio: f64| 20.0 * libm::log10(ratio);
        let (mut phase_deg, mut upwards_db) = (f64::INFINITY, f64::INFINITY);
        // From above the plant's natural frequency: below it a stiffer plant returns by itself.
        let first = 1.0 + libm::sqrt(stiffness_per_s2.max(0.0));
        for step in 0..40_000 {
            let rad_s = first + 0.002 * f64::from(step);
            let [here, next] = [rad_s, rad_s + 0.002].map(open_loop);
            if (size(here) > 1.0) != (size(next) > 1.0) {
                // The angle beyond -180 degrees.
                phase_deg = phase_deg.min(libm::atan2(-here.im, -here.re).to_degrees());
            }
            if (here.im < 0.0) != (next.im < 0.0) && here.re < 0.0 {
                upwards_db = upwards_db.min(-decibels(size(here)));
            }
        }
        // An unstable plant needs more than its instability from the loop.
        let downwards_db = decibels(natural * natural / stiffness_per_s2.abs());
        [phase_deg, upwards_db, downwards_db]
    }

    /// Legs of 0.010 m2 missing from the data, or missing from the vehicle: 45 degrees and 6 dB at
    /// 36 m/s, and as much at lower speeds, where the aerodynamic moment is weaker in proportion.
    #[test]
    fn the_attitude_loop_has_margins_for_legs_that_nobody_measured() {
        for name in ["mk2", "mk3"] {
            let mission = crate::vehicles::mission::builtin(name).unwrap().unwrap();
            let airframe = &mission.airframe;
            let arm_m = airframe.mass.loaded_cg_station_m - 0.075;
            let pressure_pa = 0.5 * 1.2 * 36.0 * 36.0;
            let inertia_kg_m2 = airframe.mass.loaded_pitch_inertia_kg_m2;
            let stiffness_per_s2 = pressure_pa * 0.010 * arm_m / inertia_kg_m2;
            let (natural, damping) =
                (mission.descent.frequency_rad_s(pressure_pa, inertia_kg_m2), mission.descent.damping);
            // The servo, a frame, and half a frame for which a command is held.
            let delay_s = airframe.fins.servo.delay_s + 1.5 * 0.005;
            for error in [-stiffness_per_s2, stiffness_per_s2] {
                let [phase_deg, upwards_db, downwards_db] = margins(natural, damping, error, delay_s);
                assert!(phase_deg > 45.0 && upwards_db > 6.0, "{name} {error}: {phase_deg} {upwards_db}");
                // mk2 has a lower inertia, a longer arm and smaller fins.
                let least_db = if name == "mk3" { 6.0 } else { 2.0 };
                assert!(downwards_db > least_db, "{name}: {downwards_db}");
            }
            // A loop half as stiff cannot hold such a vehicle.
            assert!(margins(3.0, damping, -stiffness_per_s2, delay_s)[2] < 0.0);
        }
    }

    #[test]
    fn over_the_pad_in_still_air_the_demand_is_zero() {
        let demand = gains().demand(&falling(), &situation());
        assert!(demand.moment_n_m.norm() < 1e-12 && (demand.nose_in_world - Vector3::z()).norm() < 1e-12);
    }

    #[test]
    fn the_nose_leans_away_from_the_pad() {
        // The air then pushes it back.
        let mut state = falling();
        state.position_m.x = 10.0;
        let demand = gains().demand(&state, &situation());
        assert!(demand.nose_in_world.x > 0.05, "{}", demand.nose_in_world);
        assert!(demand.moment_n_m.y < 0.0, "the nose goes down towards +x");
        let lean = libm::acos(demand.nose_in_world.z).to_degrees();
        assert!(lean <= 14.0 + 1e-9, "{lean}");
    }

    #[test]
    fn a_vehicle_carried_by_the_wind_leans_with_the_wind_to_glide_against_it() {
        let mut situation = situation();
        situation.wind_m_s.y = 5.0;
        let upstream = (situation.wind_m_s - falling().velocity_m_s).normalize();
        let nose = gains().demand(&falling(), &situation).nose_in_world;
        assert!(upstream.y > 0.1 && nose.y > upstream.y, "leaning further than {upstream}: {nose}");
    }

    #[test]
    fn at_apogee_the_demand_on_the_fins_is_zero() {
        let demand = gains().demand(&RigidState::upright(300.0), &situation());
        assert_eq!(demand.moment_n_m, Vector3::zeros());
    }

    #[test]
    fn the_lean_is_reduced_before_the_ignition() {
        let lean_deg = |time_to_go_s| {
            let mut state = falling();
            state.position_m.x = 60.0;
            let situation = DescentSituation { time_to_go_s, ..situation() };
            libm::acos(gains().demand(&state, &situation).nose_in_world.z).to_degrees()
        };
        assert!((lean_deg(None) - 14.0).abs() < 1e-9, "the full lean while the ignition is far away");
        assert!((lean_deg(Some(4.0)) - 14.0).abs() < 1e-9);
        assert!((lean_deg(Some(0.5)) - 6.0).abs() < 1e-9, "the small lean that the gate needs");
    }

    #[test]
    fn the_wanted_lean_is_held_against_the_weathercock_effect() {
        // At the commanded lean and at rest, the demand only balances the aerodynamic moment.
        let mut state = falling();
        state.position_m.x = 60.0;
        let nose = gains().demand(&state, &situation()).nose_in_world;
        state.world_from_body = UnitQuaternion::rotation_between(&Vector3::z(), &nose)
            .expect("the directions are not opposite")
            * upright();
        let demand = gains().demand(&state, &situation());
        let lean_rad = 14.0_f64.to_radians();
        let weathercock_m3 = (0.0061 - 0.0622 * 0.05 * libm::sin(lean_rad)) * lean_rad;
        let held_n_m = demand.dynamic_pressure_pa * weathercock_m3;
        assert!((demand.moment_n_m.norm() - held_n_m).abs() < 1e-9, "{} for {held_n_m}", demand.moment_n_m);
        assert!(demand.moment_n_m.y < 0.0, "the nose is kept down towards +x");
    }
}
