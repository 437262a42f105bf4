//! The planar equations are the motion of the simulated world in its x-z plane.

use core::f64::consts::FRAC_PI_2;

use flight::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use flight::vehicle::rigid::{RigidState, upright};
use flight::vehicle::site::Site;
use flight::vehicle::thrust_curve::{MotorData, ThrustCurve, ThrustPoint};
use flight::vehicles::mission;
use nalgebra::{UnitQuaternion, Vector3};
use paper::plane::dynamics::{ModelKind, PlanarModel, PlanarState};
use sim::world::{Actuators, STEP_S, Truth, World};

const THRUST_N: f64 = 33.3;

fn in_space(planar: &PlanarState) -> RigidState {
    let lean = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2 - planar.theta_rad);
    let (level_m_s, up_m_s) = planar.ground_velocity_m_s();
    RigidState {
        position_m: Vector3::new(planar.x_m, 0.0, planar.z_m),
        velocity_m_s: Vector3::new(level_m_s, 0.0, up_m_s),
        world_from_body: lean * upright(),
        rate_rad_s: Vector3::new(0.0, planar.q_rad_s, 0.0),
    }
}

/// A motor of constant thrust with almost no propellant, an ideal gimbal, no crossflow, fins
/// closed, near sea level.
#[test]
fn the_planar_equations_are_the_motion_in_the_x_z_plane() {
    let mut airframe = mission::builtin_airframe("mk2").unwrap();
    airframe.body.crossflow_drag_coefficient = 0.0;
    airframe.gimbal.servo.rate_deg_s = 1e6;
    airframe.gimbal.servo.delay_s = 0.0;
    airframe.gimbal.servo.slop_deg = 0.0;
    // The paper turns the thrust at the nozzle, and its motor weighs nothing.
    airframe.gimbal.pivot_station_m = 0.0;
    // No motor file may have so little propellant: it is not read from one.
    let motor = ThrustCurve::new(MotorData {
        name: "C".to_owned(),
        manufacturer: "M".to_owned(),
        diameter_m: 0.038,
        length_m: 0.194,
        propellant_mass_kg: 1e-9,
        total_mass_kg: 2e-9,
        points: [0.0, 5.0].map(|time_s| ThrustPoint { time_s, thrust_n: THRUST_N }).to_vec(),
    })
    .unwrap();
    let truth = Truth { ignition_delay_s: 0.0, ..Truth::default() };
    let mut expected =
        PlanarState { x_m: 1.0, z_m: 20.0, theta_rad: 1.45, u_m_s: -7.0, w_m_s: 0.8, q_rad_s: -0.2 };
    let mut world = World::new(&Site::default(), &airframe, &motor, &truth, &in_space(&expected), 1).unwrap();
    let mass_kg = airframe.mass.loaded_kg;
    let model = PlanarModel {
        kind: ModelKind::Consistent,
        mass_kg,
        pitch_inertia_kg_m2: airframe.mass.loaded_pitch_inertia_kg_m2,
        thrust_arm_m: airframe.mass.loaded_cg_station_m,
        drag_per_m: 0.5 * Site::default().air_at_m(16.0).density_kg_m3 * airframe.drag_area_m2(0.0) / mass_kg,
        gravity_m_s2: STANDARD_GRAVITY_M_S2,
    };
    for step in 0_u32..1500 {
        let gimbal_rad = if step % 400 < 200 { 0.05 } else { -0.06 };
        world.step(&Actuators { gimbal_rad: [gimbal_rad, 0.0], ignite: true, ..Actuators::default() });
        expected = model.rk4_step(&expected, gimbal_rad, THRUST_N, STEP_S);
    }
    let (found, expected) = (world.state(), in_space(&expected));
    // The remaining difference comes from the density, which is constant in the planar equations.
    assert!((found.position_m - expected.position_m).norm() < 2e-4, "{found:?}\n{expected:?}");
    assert!((found.velocity_m_s - expected.velocity_m_s).norm() < 2e-4, "{found:?}\n{expected:?}");
    assert!((found.rate_rad_s - expected.rate_rad_s).norm() < 1e-6, "{found:?}\n{expected:?}");
    assert!(found.world_from_body.angle_to(&expected.world_from_body) < 1e-6);
}
