//! The pilot's model of its vehicle: the mission's data with the motor and drag estimates. From
//! these, the motor that a plan assumes.

use alloc::sync::Arc;

use nalgebra::{Vector2, Vector3};
use serde::Serialize;

use crate::estimation::estimator::{Estimate, VehicleNow};
use crate::estimation::motor_estimate::{MotorEstimate, MotorSample};
use crate::guidance::powered::{PoweredGuidance, PoweredSituation, Search};
use crate::guidance::vertical::Column;
use crate::vehicle::airframe::{Airframe, MassModel, MassProperties};
use crate::vehicle::burn::Burn;
use crate::vehicle::mission::Mission;
use crate::vehicle::rigid::RigidState;

/// The vehicle model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct VehicleModel {
    // Skipped fields are constants of the mission.
    #[serde(skip)]
    /// Shared, because a board's memory is small.
    pub(super) mission: Arc<Mission>,
    #[serde(skip)]
    pub(super) mass: MassModel,
    /// Estimated motor and scale of the aerodynamic forces.
    pub(super) motor: MotorEstimate,
}

/// The vehicle with its motor burning, in one frame.
#[derive(Debug, Clone)]
#[expect(clippy::struct_field_names, reason = "the time since thrust began is called that everywhere")]
pub(super) struct Burning {
    pub(super) burning_s: f64,
    pub(super) mass: MassProperties,
    pub(super) density_kg_m3: f64,
    /// After an abort: land on the ground below, wherever the pad is.
    pub(super) lands_in_place: bool,
}

impl VehicleModel {
    /// Air density at the estimated height, kg/m3.
    pub(super) fn density_kg_m3(&self, estimate: &Estimate) -> f64 {
        self.mission.site.air_at_m(estimate.state.position_m.z).density_kg_m3
    }

    /// The vehicle data for the estimator, at this mass, air density and fin openings, rad, with
    /// the motor burning or not.
    pub(super) fn now(
        &self,
        mass: &MassProperties,
        density_kg_m3: f64,
        fins_rad: [f64; 4],
        burns: bool,
    ) -> VehicleNow {
        let levers = self.mission.sensors.lever_arms(&(Vector3::x() * mass.cg_station_m));
        VehicleNow::of(self.airframe(), mass, density_kg_m3, fins_rad, burns, levers)
    }

    /// Updates the motor and drag estimates with a frame.
    pub(super) fn learn(&mut self, sample: &MotorSample) {
        self.motor.update(&self.mission.motor_curve, sample);
    }

    pub(super) fn airframe(&self) -> &Airframe {
        &self.mission.airframe
    }

    /// Time since the landing motor's thrust began, s.
    pub(super) fn burning_s(&self, time_s: f64) -> Option<f64> {
        self.motor.ignition_s().map(|ignition_s| (time_s - ignition_s).max(0.0))
    }

    /// Whether the complete burn time has passed. A motor that stopped early does not count as
    /// burned out before that.
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

    /// The motor with `sigmas` standard deviations more (positive) or less impulse than expected
    /// from now until its thrust falls below the weight. Measurements show the thrust, not its
    /// duration; at equal thrust the weaker motor burns out sooner.
    pub(super) fn dispersed_burn(&self, burning_s: f64, sigmas: f64) -> Burn<'_> {
        let burn = self.burn();
        let carried_until_s = burn.falls_through_weight_s(self.mass.at(0.0).mass_kg);
        let Some(until_s) = carried_until_s.filter(|until_s| *until_s > burning_s) else { return burn };
        let to_come_n_s = burn.mean_thrust_n(burning_s, until_s - burning_s) * (until_s - burning_s);
        let derivatives = [
            to_come_n_s / burn.impulse_scale,
            (burning_s * burn.thrust_n(burning_s) - until_s * burn.thrust_n(until_s)) / burn.time_scale,
            burn.fading_n_s(burning_s, until_s),
        ];
        self.motor.dispersed(&self.mission.motor_curve, derivatives, sigmas)
    }

    pub(super) fn column(&self, density_kg_m3: f64, soft_tilt_deg: f64) -> Column {
        let mass_kg = self.mass.at(0.0).mass_kg;
        Column::of_mission(&self.mission, mass_kg, density_kg_m3, self.motor.air_scale(), soft_tilt_deg)
    }

    pub(super) fn feet_below_cg_m(&self, mass: &MassProperties) -> f64 {
        self.airframe().above_feet_m(mass.cg_station_m)
    }

    /// Height of the feet below an upright vehicle, m.
    pub(super) fn feet_height_m(&self, estimate: &Estimate, mass: &MassProperties) -> f64 {
        estimate.state.position_m.z - self.feet_below_cg_m(mass)
    }

    /// The guidance of the landing burn before its first plan, and the search of its plans with
    /// buffers for every plan.
    pub(super) fn guidance(&self) -> (PoweredGuidance, Search) {
        let state = RigidState::upright(self.mission.start.height_m);
        let estimate = Estimate::exact(0.0, state, Vector3::zeros(), Vector2::zeros());
        let density_kg_m3 = self.mission.site.air_at_m(0.0).density_kg_m3;
        let burning =
            Burning { burning_s: 0.0, mass: self.mass.at(0.0), density_kg_m3, lands_in_place: false };
        let fins_m2 = self.airframe().open_fin_drag_area_m2();
        let situation = self.powered_situation(&estimate, &burning, self.burn(), fins_m2);
        PoweredGuidance::with_room(self.mission.powered, &state, &situation)
    }

    /// The burning vehicle, not high, with this motor, and with this drag area of the fins as
    /// certified.
    pub(super) fn powered_situation<'a>(
        &'a self,
        estimate: &Estimate,
        situation: &Burning,
        burn: Burn<'a>,
        fin_drag_area_m2: f64,
    ) -> PoweredSituation<'a> {
        let exhaust = &self.mission.exhaust;
        let height_m = self.feet_height_m(estimate, &situation.mass);
        let margin_m = ground_margin_m(height_m, estimate.sigmas.position_m.z);
        PoweredSituation {
            burn,
            burning_s: situation.burning_s,
            mass_at_ignition_kg: self.mass.at(0.0).mass_kg,
            inertia_kg_m2: situation.mass.pitch_inertia_kg_m2,
            arm_m: self.airframe().thrust_arm_m(situation.mass.cg_station_m),
            feet_below_cg_m: self.feet_below_cg_m(&situation.mass) + margin_m,
            foot_radius_m: self.airframe().legs.foot_radius_m,
            air_density_kg_m3: situation.density_kg_m3,
            wind_m_s: estimate.wind_m_s.push(0.0),
            body_drag_area_m2: self.motor.air_scale()
                * self.airframe().unfinned_drag_area_m2(exhaust.body_loss),
            crossflow_area_m2: self.airframe().body.crossflow_area_m2(),
            fin_drag_area_m2: self.motor.air_scale() * (fin_drag_area_m2 * (1.0 - exhaust.fin_loss)),
            gimbal_limit_rad: self.airframe().gimbal.limit_rad(),
            lands_in_place: situation.lands_in_place,
            high: false,
        }
    }
}

/// Height above the estimated ground at which a plan ends, m, from the present height of the feet
/// and its standard deviation. The legs bear a fall of this height, but not a burn that continues
/// into the ground: of 150 flights with a dead lidar 146 stand with the margin, and 140 without
/// (mk3, `real`, seed 771). There is none above the reach of a lidar, where every flight would have
/// one: then 267 of 300 flights without a fault touch down inside the envelope instead of 278
/// (seed 4021).
fn ground_margin_m(feet_height_m: f64, height_sigma_m: f64) -> f64 {
    /// Height below which a working lidar sees the ground, m.
    const REACH_M: f64 = 6.0;
    /// Largest height sigma with a lidar that sees the ground, m.
    const SEEN_M: f64 = 0.1;
    const MOST_M: f64 = 0.4;
    if feet_height_m > REACH_M { 0.0 } else { (height_sigma_m - SEEN_M).clamp(0.0, MOST_M) }
}

/// Without a plan the fins leave margin for a motor that is weaker or stronger by one deviation,
/// and hold the vehicle in the middle of that band.
const FIN_SIGMAS: f64 = 1.0;
const FIN_PLACE: f64 = 0.5;

// The motor that a plan assumes.
//
// Surplus thrust can be wasted late in the burn; missing thrust cannot be recovered. A plan is
// therefore made for a motor weaker than estimated, by the number of standard deviations that the
// mission sets as its caution. The motor must not be so weak that no landing is possible: such a
// plan would turn the vehicle broadside to brake, and spoil the landing for every stronger motor.
// So the plan takes the weakest of these motors that can still land from here.
//
// High in the band of feasible heights, a hard landing in a plan has another cause: the plan has
// not found a way to sink faster. There the guidance flies a hard plan rather than braking upright,
// which helps a vehicle that is too low but makes this one hover.

/// Number of steps from full caution to none.
const CAUTION_STEPS: u32 = 3;

/// Position in the band (its middle) above which a vehicle is high.
const HIGH_PLACE: f64 = 0.5;

impl VehicleModel {
    /// The situation to plan for.
    pub(super) fn situation_to_plan<'a>(
        &'a self,
        estimate: &Estimate,
        burning: &Burning,
    ) -> PoweredSituation<'a> {
        let column = self.column(burning.density_kg_m3, self.mission.fin_soft_tilt_deg);
        let height_m = self.feet_height_m(estimate, &burning.mass);
        let band = |burn: &Burn<'_>| column.band(burn, burning.burning_s, estimate.state.velocity_m_s.z);
        let estimated = self.burn();
        let high = match band(&estimated) {
            Some(band) => band.place(height_m) > HIGH_PLACE,
            None => column.falls_too_slowly(&estimated, burning.burning_s, estimate.state.velocity_m_s.z),
        };
        let caution_sigmas = self.caution_sigmas(burning.burning_s);
        // Without caution, only the motor as estimated is tried.
        let steps = if caution_sigmas > 0.0 { CAUTION_STEPS } else { 0 };
        let weaker = (0..steps).find_map(|step| {
            let share = 1.0 - f64::from(step) / f64::from(CAUTION_STEPS);
            let burn = self.dispersed_burn(burning.burning_s, -caution_sigmas * share);
            band(&burn).is_some_and(|band| band.place(height_m) >= 0.0).then_some(burn)
        });
        let fins_m2 = self.airframe().open_fin_drag_area_m2();
        PoweredSituation {
            high,
            ..self.powered_situation(estimate, burning, weaker.unwrap_or(estimated), fins_m2)
        }
    }

    /// Standard deviations by which a plan assumes a weaker motor than estimated: the mission's
    /// full caution early, none at the end, when no thrust can be wasted any more.
    fn caution_sigmas(&self, burning_s: f64) -> f64 {
        let carried_until_s = self.burn().falls_through_weight_s(self.mass.at(0.0).mass_kg);
        let left_s = carried_until_s.unwrap_or(0.0) - burning_s;
        self.mission.caution_sigmas * (left_s / self.mission.caution_fades_s).clamp(0.0, 1.0)
    }

    /// Share of the fins' drag area from the vehicle's position in the band, if no plan has it.
    pub(super) fn fin_share(&self, estimate: &Estimate, burning: &Burning) -> f64 {
        let column = self.column(burning.density_kg_m3, self.mission.fin_soft_tilt_deg);
        let [weak, strong] =
            [-FIN_SIGMAS, FIN_SIGMAS].map(|sigmas| self.dispersed_burn(burning.burning_s, sigmas));
        column.fin_share(
            [&weak, &strong],
            burning.burning_s,
            estimate.state.velocity_m_s.z,
            self.feet_height_m(estimate, &burning.mass),
            FIN_PLACE,
        )
    }
}
