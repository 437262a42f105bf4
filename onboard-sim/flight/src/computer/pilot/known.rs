//! The pilot's knowledge of its vehicle: the mission's data, and what it has learnt about motor and drag.

use nalgebra::{Vector2, Vector3};

use crate::estimation::estimator::Estimate;
use crate::estimation::motor_estimate::MotorEstimate;
use crate::guidance::powered::{PoweredGuidance, PoweredSituation};
use crate::guidance::vertical::Column;
use crate::vehicle::airframe::{Airframe, MassModel, MassProperties};
use crate::vehicle::atmosphere::Air;
use crate::vehicle::burn::Burn;
use crate::vehicle::mission::Mission;
use crate::vehicle::rigid::RigidState;

/// The vehicle as the pilot knows it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Known {
    pub(super) mission: Mission,
    pub(super) mass: MassModel,
    /// Estimated motor and scale of the aerodynamic forces.
    pub(super) motor: MotorEstimate,
}

/// The vehicle with its motor burning, in one frame.
#[expect(clippy::struct_field_names, reason = "the time since thrust began is called that everywhere")]
pub(super) struct Burning {
    pub(super) burning_s: f64,
    pub(super) mass: MassProperties,
    pub(super) density_kg_m3: f64,
    /// After an abort: land on the ground below, wherever the pad is.
    pub(super) lands_here: bool,
}

impl Known {
    pub(super) fn airframe(&self) -> &Airframe {
        &self.mission.airframe
    }

    pub(super) fn crossflow_area_m2(&self) -> f64 {
        let body = &self.airframe().body;
        body.crossflow_drag_coefficient * body.length_m * body.diameter_m
    }

    pub(super) fn body_drag_area_m2(&self) -> f64 {
        self.airframe().drag_area_m2(0.0)
    }

    fn burning_body_drag_area_m2(&self) -> f64 {
        self.body_drag_area_m2() * (1.0 - self.mission.exhaust.body_loss)
    }

    /// What the exhaust leaves of a drag area of the fins, m^2.
    fn burning_fins(&self, fin_drag_area_m2: f64) -> f64 {
        fin_drag_area_m2 * (1.0 - self.mission.exhaust.fin_loss)
    }

    pub(super) fn fin_drag_area_m2(&self, fins_rad: &[f64; 4]) -> f64 {
        self.airframe().fin_drag_area_m2(fins_rad)
    }

    pub(super) fn largest_fin_drag_area_m2(&self) -> f64 {
        self.fin_drag_area_m2(&[self.airframe().fins.open_rad(); 4])
    }

    /// Time since the landing motor's thrust began, s.
    pub(super) fn burning_s(&self, time_s: f64) -> Option<f64> {
        self.motor.ignition_s().map(|ignition_s| (time_s - ignition_s).max(0.0))
    }

    /// Whether the whole burn time has passed. A motor that went out early is not called burnt out before that either.
    pub(super) fn burn_is_over(&self, time_s: f64) -> bool {
        let whole_s = self.motor.burn_time_stretch() * self.mission.motor_curve.burn_time_s();
        self.burning_s(time_s).is_some_and(|burning_s| burning_s >= whole_s)
    }

    pub(super) fn mass_now(&self, burning_s: Option<f64>) -> MassProperties {
        self.mass.at(burning_s.map_or(0.0, |burning_s| self.burn().burnt_kg(burning_s)))
    }

    pub(super) fn burn(&self) -> Burn<'_> {
        self.motor.burn(&self.mission.motor_curve)
    }

    /// The motor with `sigmas` standard deviations less (below zero) or more impulse than expected from now until its
    /// thrust falls below the weight. Measurements show the thrust, not how long it lasts; as long as that holds, the
    /// weaker motor burns out sooner.
    pub(super) fn doubted_burn(&self, burning_s: f64, sigmas: f64) -> Burn<'_> {
        let burn = self.burn();
        let carried_until_s =
            burn.falls_through_weight_s(self.mass.at(0.0).mass_kg, self.mission.gravity_m_s2);
        let Some(until_s) = carried_until_s.filter(|until_s| *until_s > burning_s) else { return burn };
        let to_come_n_s = burn.mean_thrust_n(burning_s, until_s - burning_s) * (until_s - burning_s);
        let derivatives = [
            to_come_n_s / burn.impulse_scale,
            (burning_s * burn.thrust_n(burning_s) - until_s * burn.thrust_n(until_s)) / burn.time_scale,
            burn.fading_n_s(burning_s, until_s),
        ];
        self.motor.doubted(&self.mission.motor_curve, derivatives, sigmas)
    }

    pub(super) fn column(&self, density_kg_m3: f64, soft_tilt_deg: f64) -> Column {
        let mass_kg = self.mass.at(0.0).mass_kg;
        Column::of_mission(&self.mission, mass_kg, density_kg_m3, self.motor.air_scale(), soft_tilt_deg)
    }

    pub(super) fn feet_below_cg_m(&self, mass: &MassProperties) -> f64 {
        self.airframe().above_feet_m(mass.cg_station_m)
    }

    /// The guidance of the landing burn before its first plan, with room for every plan.
    pub(super) fn guidance(&self) -> PoweredGuidance {
        let state = RigidState::upright(self.mission.start.height_m);
        let estimate = Estimate::exact(0.0, state, Vector3::zeros(), Vector2::zeros());
        let density_kg_m3 = Air::at_height_m(self.mission.pad_altitude_m).density_kg_m3;
        let burning = Burning { burning_s: 0.0, mass: self.mass.at(0.0), density_kg_m3, lands_here: false };
        let fins_m2 = self.largest_fin_drag_area_m2();
        let situation = self.powered_situation(&estimate, &burning, self.burn(), fins_m2);
        PoweredGuidance::with_room(self.mission.powered, &state, &situation)
    }

    /// The burning vehicle, not high, with this motor, and with this drag area of the fins as certified.
    pub(super) fn powered_situation<'a>(
        &'a self,
        estimate: &Estimate,
        situation: &Burning,
        burn: Burn<'a>,
        fin_drag_area_m2: f64,
    ) -> PoweredSituation<'a> {
        PoweredSituation {
            burn,
            burning_s: situation.burning_s,
            mass_at_ignition_kg: self.mass.at(0.0).mass_kg,
            inertia_kg_m2: situation.mass.pitch_inertia_kg_m2,
            arm_m: situation.mass.cg_station_m,
            feet_below_cg_m: self.feet_below_cg_m(&situation.mass),
            foot_radius_m: self.airframe().legs.foot_radius_m,
            gravity_m_s2: self.mission.gravity_m_s2,
            air_density_kg_m3: situation.density_kg_m3,
            wind_m_s: estimate.wind_m_s.push(0.0),
            body_drag_area_m2: self.motor.air_scale() * self.burning_body_drag_area_m2(),
            crossflow_area_m2: self.crossflow_area_m2(),
            fin_drag_area_m2: self.motor.air_scale() * self.burning_fins(fin_drag_area_m2),
            gimbal_limit_rad: self.airframe().gimbal.limit_rad(),
            lands_here: situation.lands_here,
            high: false,
        }
    }
}
