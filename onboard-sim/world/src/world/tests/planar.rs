//! The controller's planar equations are the world's motion in its x-z plane.

use flight::vehicle::dynamics::{ModelKind, PlanarModel, PlanarParams, PlanarState};
use flight::vehicle::thrust_curve::{MotorData, ThrustCurve, ThrustPoint};

use super::*;

/// A motor of constant thrust with almost no propellant, an ideal gimbal, no crossflow, fins closed, near sea level.
#[test]
fn the_planar_equations_are_the_motion_in_the_x_z_plane() {
    let mut airframe = vehicles::airframe::builtin("mk2").unwrap();
    airframe.body.crossflow_drag_coefficient = 0.0;
    airframe.gimbal.servo.rate_deg_s = 1e6;
    airframe.gimbal.servo.delay_s = 0.0;
    airframe.gimbal.servo.slop_deg = 0.0;
    // No motor file may have so little propellant: it is not read from one.
    let motor = ThrustCurve::new(MotorData {
        name: "C".to_owned(),
        manufacturer: "M".to_owned(),
        diameter_m: 0.038,
        length_m: 0.194,
        propellant_mass_kg: 1e-9,
        total_mass_kg: 0.1,
        points: [0.0, 5.0].map(|time_s| ThrustPoint { time_s, thrust_n: 33.3 }).to_vec(),
    })
    .unwrap();
    let truth = Truth { ignition_delay_s: 0.0, ..Truth::default() };
    let planar = PlanarState { x_m: 1.0, z_m: 20.0, theta_rad: 1.45, u_m_s: -7.0, w_m_s: 0.8, q_rad_s: -0.2 };
    let mut world = World::new(&airframe, &motor, &truth, &RigidState::from(planar), 1).unwrap();
    let model = PlanarModel {
        params: PlanarParams {
            mass_kg: airframe.mass.loaded_kg,
            pitch_inertia_kg_m2: airframe.mass.loaded_pitch_inertia_kg_m2,
            thrust_arm_m: airframe.mass.loaded_cg_station_m,
            drag_per_m: 0.5 * Air::at_height_m(16.0).density_kg_m3 * airframe.drag_area_m2(0.0)
                / airframe.mass.loaded_kg,
            lateral_drag_per_m: 0.0,
            crossflow_per_m: 0.0,
            gravity_m_s2: STANDARD_GRAVITY_M_S2,
        },
        kind: ModelKind::Consistent,
    };
    let mut expected = planar;
    for step in 0_u32..1500 {
        let gimbal_rad = if step % 400 < 200 { 0.05 } else { -0.06 };
        world.step(&Actuators { gimbal_rad: [gimbal_rad, 0.0], ignite: true, ..Actuators::default() });
        expected = model.rk4_step(&expected, gimbal_rad, 33.3, STEP_S);
    }
    let (found, expected) = (world.state(), RigidState::from(expected));
    // The remaining difference comes from the density, which is constant in the planar equations.
    assert!((found.position_m - expected.position_m).norm() < 2e-4, "{found:?}\n{expected:?}");
    assert!((found.velocity_m_s - expected.velocity_m_s).norm() < 2e-4, "{found:?}\n{expected:?}");
    assert!((found.rate_rad_s - expected.rate_rad_s).norm() < 1e-6, "{found:?}\n{expected:?}");
    assert!(found.world_from_body.angle_to(&expected.world_from_body) < 1e-6);
}
