//! What the guidance flies when no plan is good.

use super::*;
use nalgebra::UnitQuaternion;

use crate::vehicle::burn::Burn;
use crate::vehicles::mission::builtin;

/// mk2 in the middle of its burn, 7 m above the ground at 5 m/s and moving sideways at 3 m/s: it has to turn away more
/// thrust than it can without hovering.
fn too_high(high: bool) -> PoweredGuidance {
    let mission = builtin("mk2").unwrap().unwrap();
    let feet_below_cg_m = 0.44;
    let situation = PoweredSituation {
        burn: Burn::nominal(&mission.motor_curve),
        burning_s: 2.5,
        mass_at_ignition_kg: 3.1,
        inertia_kg_m2: 0.12,
        arm_m: 0.4,
        feet_below_cg_m,
        foot_radius_m: 0.4,
        gravity_m_s2: 9.80665,
        air_density_kg_m3: 1.2,
        wind_m_s: Vector3::zeros(),
        body_drag_area_m2: 0.003,
        crossflow_area_m2: 0.062,
        fin_drag_area_m2: 0.0,
        gimbal_limit_rad: 5.0_f64.to_radians(),
        lands_here: false,
        high,
    };
    let state = RigidState {
        velocity_m_s: Vector3::new(3.0, 0.0, -5.0),
        world_from_body: UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -0.07)
            * RigidState::upright(0.0).world_from_body,
        ..RigidState::upright(7.0 + feet_below_cg_m)
    };
    let mut guidance = PoweredGuidance::new(mission.powered);
    guidance.plan(0.0, &state, &situation, None);
    guidance
}

#[test]
fn a_vehicle_that_is_high_flies_a_hard_plan_and_does_not_brake_upright() {
    let low = too_high(false);
    assert!(low.report().touchdown.u_m_s < HARD_M_S, "{:?}", low.report());
    assert_eq!(low.report().level, ControlLevel::Stabiliser);

    let high = too_high(true);
    assert_eq!(high.report().level, ControlLevel::BestFeasible, "{:?}", high.report());
    assert!(high.report().largest_tilt_rad > 45.0_f64.to_radians(), "{:?}", high.report());
}
