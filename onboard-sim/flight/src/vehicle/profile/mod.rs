//! Profiles: a vehicle, its motor, its start, its controller and its limits, as data.
//!
//! A profile is data only. Keys carry their units; angles are in degrees in the file (`limit_deg`) and the
//! accessors return radians (`limit_rad()`). Unknown keys are errors, so a misspelt key cannot pass silently.

mod sections;

pub use nmpc::dynamics::ModelKind;
pub use nmpc::{FinalBox, SolverLimits};
pub use sections::{
    ArmingLimits, Dispersion, Environment, Fins, GateLimits, Gimbal, Motor, Nmpc, Plant, StabiliserGains,
    Start, StartPoint, StateWeights, TouchdownBox, TrajectoryLimits, Vehicle,
};

use alloc::string::String;

use serde::Deserialize;

use crate::vehicle::dynamics::{PlanarModel, PlanarParams};
use crate::vehicle::site::Site;

/// Everything that defines a simulated or real vehicle and its mission.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    /// Short name for the command line.
    pub name: String,
    /// Description in one line.
    pub summary: String,
    /// Mass, inertia and shape.
    pub vehicle: Vehicle,
    /// Gravity and air.
    pub environment: Environment,
    /// The landing motor.
    pub motor: Motor,
    /// The thrust-vectoring actuator.
    pub gimbal: Gimbal,
    /// The four aerodynamic fins.
    pub fins: Fins,
    /// The start of the flight.
    pub start: Start,
    /// The landing controller.
    pub nmpc: Nmpc,
    /// The upright law of the last degradation level.
    #[serde(default)]
    pub stabiliser: StabiliserGains,
    /// What counts as a landing.
    pub touchdown_limits: TouchdownBox,
    /// Limits of the pad checks before arming.
    #[serde(default)]
    pub arming: ArmingLimits,
    /// Limits of the checks before ignition.
    pub gate: GateLimits,
    /// Position of the pad on the Earth.
    #[serde(default)]
    pub site: Site,
    /// How the true vehicle differs from the controller's model.
    #[serde(default)]
    pub plant: Plant,
    /// One-sigma scatter for a campaign.
    #[serde(default)]
    pub dispersion: Dispersion,
}

impl Profile {
    /// The constants of the planar equations for this vehicle and its air.
    pub fn planar_params(&self) -> PlanarParams {
        let vehicle = &self.vehicle;
        let environment = &self.environment;
        PlanarParams {
            mass_kg: vehicle.mass_kg,
            pitch_inertia_kg_m2: vehicle.pitch_inertia_kg_m2,
            thrust_arm_m: vehicle.thrust_arm_m(),
            drag_per_m: environment.air_density_kg_m3 * vehicle.reference_area_m2 * vehicle.drag_coefficient
                / (2.0 * vehicle.mass_kg),
            lateral_drag_per_m: 0.0,
            crossflow_per_m: 0.0,
            gravity_m_s2: environment.gravity_m_s2,
        }
    }

    /// The planar model of this profile's controller.
    pub fn planar_model(&self) -> PlanarModel {
        PlanarModel { params: self.planar_params(), kind: self.nmpc.model }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_thrust_keeps_the_impulse_across_burn_out() {
        let motor = Motor { thrust_n: 30.0, burn_time_s: 5.0 };
        let bits = |value: f64| value.to_bits();
        assert_eq!(bits(motor.mean_thrust_n(4.9, 0.1)), bits(30.0));
        assert!((motor.mean_thrust_n(4.95, 0.1) - 15.0).abs() < 1e-9);
        assert_eq!(bits(motor.mean_thrust_n(5.0, 0.1)), bits(0.0));
    }
}
