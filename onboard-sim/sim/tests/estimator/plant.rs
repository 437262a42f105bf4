//! Tests the estimators with the simulated truth: a vehicle falls in wind and gusts with moving
//! fins. A simple law that knows the truth lights the motor and holds the vehicle upright.

use std::sync::LazyLock;

use flight::control::fins::{Allocation, FinCommand};
use flight::estimation::estimator::{Estimate, Estimator, EstimatorConfig, StartUncertainty, VehicleNow};
use flight::estimation::motor_estimate::{MotorEstimate, MotorPrior, MotorSample, MotorStage};
use flight::vehicle::airframe::{MassModel, MassProperties};
use flight::vehicle::rigid::RigidState;
use flight::vehicle::site::Site;
use flight::vehicle::thrust_curve::ThrustCurve;
use flight::vehicles::motors;
use nalgebra::{Vector2, Vector3};
use sim::world::sensors::{SensorParams, SensorTruth, Sensors, start_with_errors};
use sim::world::wind::Wind;
use sim::world::{Actuators, Truth, World};

const FLIGHTS: u64 = 100;
/// The igniter is fired below this height, m.
const IGNITE_M: f64 = 66.0;

/// The result of one frame.
#[derive(Debug, Clone, Copy)]
struct Frame {
    time_s: f64,
    truth: RigidState,
    wind_m_s: Vector2<f64>,
    since_thrust_s: Option<f64>,
    estimate: Estimate,
    nees: f64,
    motor: MotorEstimate,
    /// Thrust one second ahead, N: as predicted, and the true thrust of the drawn motor.
    ahead_n: (f64, f64),
}

/// A vehicle and its weather, spread over their ranges by the seed in a fixed pattern.
fn truth_of(seed: u64) -> Truth {
    let spread = |step: f64| libm::sin(1.0 + step * seed as f64) * core::f64::consts::SQRT_2;
    Truth {
        impulse_scale: 1.0 + 0.025 * spread(1.3),
        burn_time_scale: 1.0 + 0.04 * spread(2.1),
        ignition_delay_s: 0.15 + 0.05 * spread(0.7),
        thrust_misalignment_rad: [0.006 * spread(3.1), 0.006 * spread(1.7)],
        mass_scale: 1.0 + 0.01 * spread(0.9),
        drag_scale: 1.0 + 0.07 * spread(2.7),
        wind_m_s: 3.0 + 2.0 * spread(1.9),
        wind_towards_rad: seed as f64,
        ..Truth::default()
    }
}

/// Falling upright with the wind.
fn start(truth: &Truth) -> RigidState {
    let mut state = RigidState::upright(280.0);
    let wind = Wind::new(truth.wind_m_s, truth.wind_towards_rad, 0.0, 0).mean_m_s(280.0);
    state.velocity_m_s = wind - Vector3::z() * 15.0;
    state
}

/// Holds the true attitude upright by the gimbal, from an angle and its rate on each axis.
fn upright_gimbal_rad(state: &RigidState) -> [f64; 2] {
    let up = state.world_from_body.inverse() * Vector3::z();
    [0.15 * up.z + 0.04 * state.rate_rad_s.y, -0.15 * up.y + 0.04 * state.rate_rad_s.z]
}

/// Holds it upright by the fins, which are three quarters open on average.
fn upright_fins(state: &RigidState, mass: &MassProperties) -> FinCommand {
    let up = state.world_from_body.inverse() * Vector3::z();
    let (rate, inertia) = (&state.rate_rad_s, mass.pitch_inertia_kg_m2);
    FinCommand {
        moments_n_m: Vector3::new(
            -0.02 * rate.x,
            -inertia * (9.0 * up.z + 6.0 * rate.y),
            inertia * (9.0 * up.y - 6.0 * rate.z),
        ),
        drag_area_m2: 0.02,
    }
}

fn fly(seed: u64) -> Vec<Frame> {
    let airframe = flight::vehicles::mission::builtin_airframe("mk2").expect("a built-in airframe");
    let curve: ThrustCurve = motors::builtin(&airframe.motor).expect("a built-in motor");
    let truth = truth_of(seed);
    let world = World::new(&Site::default(), &airframe, &curve, &truth, &start(&truth), seed);
    let mut world = world.expect("a valid world").with_fins_at(1.2);
    let masses = MassModel::new(&airframe.mass, curve.propellant_mass_kg());
    let params = SensorParams::default();
    let mission = flight::vehicles::mission::builtin("mk2").expect("a built-in name");
    let places = mission.expect("a valid mission").sensors;
    let mut sensors = Sensors::new(&params, &places, seed, 1.0).expect("valid sensor parameters");
    let uncertainty = StartUncertainty::at_apogee();
    let believed = start_with_errors(&start(&truth), &uncertainty, seed);
    let mut estimator = Estimator::new(&EstimatorConfig::default(), &uncertainty, 0.0, &believed);
    let mut motor = MotorEstimate::new(&MotorPrior::default());
    let allocation = Allocation {
        model: airframe.fin_model(),
        arm_m: airframe.fins.station_m - airframe.mass.loaded_cg_station_m,
        min_rad: airframe.fins.control_min_rad(),
        max_rad: airframe.fins.open_rad(),
    };
    let mut actuators = Actuators { fins_rad: [1.2; 4], ..Actuators::default() };
    let mut frames = Vec::new();
    while world.height_m() > 0.3 && world.steps() < 40_000 {
        world.step(&actuators);
        let state = *world.state();
        let seen = SensorTruth::of(&world);
        let Some(measurements) = sensors.observe(&seen) else { continue };
        let time_s = world.time_s();
        let before = motor.ignition_s().map_or(0.0, |ignition_s| time_s - ignition_s);
        let mass = masses.at(curve.propellant_burnt_kg(before));
        let height_m = estimator.estimate().state.position_m.z;
        let vehicle = VehicleNow::of(
            &airframe,
            &mass,
            Site::default().air_at_m(height_m).density_kg_m3,
            world.fins_rad(),
            actuators.ignite,
            places.lever_arms(&(Vector3::x() * mass.cg_station_m)),
        );
        let estimate = estimator.step(&measurements, &vehicle);
        let through_air = estimate.state.world_from_body.inverse() * estimate.velocity_through_air_m_s();
        let gimbal_rad = world.gimbal_rad();
        motor.update(
            &curve,
            &MotorSample {
                time_s,
                axial_specific_force_m_s2: estimate.specific_force_m_s2.x,
                mass_kg: mass.mass_kg,
                axial_air_force_n: vehicle.air_force_n(&through_air, &estimate.state.rate_rad_s).x,
                gimbal_rad,
                may_burn: actuators.ignite,
            },
        );
        let since_thrust_s = world.thrust_begins_s().map(|begins_s| time_s - begins_s).filter(|s| *s >= 0.0);
        let ahead_n = since_thrust_s.map_or(0.0, |since_s| {
            truth.impulse_scale / truth.burn_time_scale
                * curve.thrust_at_n((since_s + 1.0) / truth.burn_time_scale)
        });
        frames.push(Frame {
            time_s,
            truth: state,
            wind_m_s: world.wind_m_s().xy(),
            since_thrust_s,
            estimate,
            nees: estimator.nees_of_motion(&state).unwrap_or(f64::NAN),
            motor,
            ahead_n: (motor.predict(&curve, time_s + 1.0, f64::NAN).thrust_n, ahead_n),
        });
        let dynamic_pressure_pa = 0.5 * vehicle.air_density_kg_m3 * world.air_velocity_m_s().norm_squared();
        actuators.fins_rad = allocation.openings_rad(&upright_fins(&state, &mass), dynamic_pressure_pa);
        actuators.ignite |= world.height_m() < IGNITE_M;
        actuators.gimbal_rad = if actuators.ignite { upright_gimbal_rad(&state) } else { [0.0; 2] };
    }
    frames
}

static FLOWN: LazyLock<Vec<(Truth, Vec<Frame>)>> =
    LazyLock::new(|| (0..FLIGHTS).map(|seed| (truth_of(seed), fly(seed))).collect());

/// Every flight's truth, with its first frame at this time after the thrust began.
fn burning_for(since_s: f64) -> Vec<(&'static Truth, &'static Frame)> {
    let at = |frame: &&Frame| frame.since_thrust_s.is_some_and(|found_s| found_s >= since_s);
    FLOWN
        .iter()
        .map(|(truth, frames)| (truth, frames.iter().find(at).expect("a frame with the motor burning")))
        .collect()
}

fn rms(
    of: &[(&'static Truth, &'static Frame)],
    error: impl Fn(&'static Truth, &'static Frame) -> f64,
) -> f64 {
    (of.iter().map(|(truth, frame)| error(truth, frame).powi(2)).sum::<f64>() / of.len() as f64).sqrt()
}

#[test]
fn val_chi_square_of_the_error_in_the_simulated_truth() {
    // 99.9 % of chi-square with 900 degrees of freedom, over the flights, as for the flights of
    // `main`.
    let half_width = 3.29 * (18.0 / FLIGHTS as f64).sqrt();
    let of_fall = |frame: usize| FLOWN.iter().map(|(_, frames)| frames[frame].nees).sum::<f64>();
    let of_burn = |since_s: f64| burning_for(since_s).iter().map(|(_, frame)| frame.nees).sum::<f64>();
    let sums = [0, 200, 400, 800, 1200].map(of_fall).into_iter().chain([0.0, 0.5, 1.0, 1.5].map(of_burn));
    for sum in sums {
        let mean = sum / FLIGHTS as f64;
        println!("{mean:.2} of 9 +- {half_width:.2}");
        assert!((mean - 9.0).abs() < half_width, "{mean}");
    }
}

#[test]
fn wind_and_air_are_estimated_at_ignition() {
    let lit = burning_for(0.0);
    let wind_m_s = [0, 1].map(|axis| rms(&lit, |_, frame| (frame.estimate.wind_m_s - frame.wind_m_s)[axis]));
    let air = rms(&lit, |truth, frame| frame.motor.air_scale() - truth.drag_scale / truth.mass_scale);
    println!("at ignition: wind {:.2} {:.2} m/s, air scale {air:.3}", wind_m_s[0], wind_m_s[1]);
    assert!(wind_m_s.iter().all(|wind_m_s| *wind_m_s < 0.3), "{wind_m_s:?}");
    assert!(air < 0.02, "{air}");
    assert!(lit.iter().all(|(_, frame)| frame.estimate.health.is_good()));
    assert!(
        lit.iter().all(|(_, frame)| frame
            .estimate
            .heights
            .disagreement_m()
            .is_some_and(|apart_m| apart_m < 2.0))
    );
}

#[test]
fn the_motor_is_estimated_half_a_second_into_its_burn() {
    for (since_s, thrust_n) in [(0.5, 1.0), (1.0, 1.0), (1.5, 1.0)] {
        let burning = burning_for(since_s);
        // The accelerometer measures thrust over mass, so an error of the mass goes into the
        // estimated thrust.
        let ahead_n = rms(&burning, |truth, frame| frame.ahead_n.0 - frame.ahead_n.1 / truth.mass_scale);
        println!("after {since_s} s: thrust a second ahead {ahead_n:.2} N");
        assert!(ahead_n < thrust_n, "{ahead_n}");
        assert!(burning.iter().all(|(_, frame)| frame.motor.stage() == MotorStage::Burning));
    }
    let late_s = rms(&burning_for(0.5), |_, frame| {
        let found_s = frame.motor.ignition_s().unwrap_or(f64::NAN);
        frame.time_s - frame.since_thrust_s.unwrap_or(f64::NAN) - found_s
    });
    println!("ignition timed to {:.2} ms rms", 1e3 * late_s);
    assert!(late_s < 0.0025, "{late_s}");
}

#[test]
fn near_the_ground_the_estimate_is_accurate_enough_for_landing() {
    let low: Vec<(&Truth, &Frame)> = FLOWN
        .iter()
        .flat_map(|(truth, frames)| frames.iter().map(move |frame| (truth, frame)))
        .filter(|(_, frame)| frame.truth.position_m.z < 4.0 && frame.truth.tilt_rad() < 0.4)
        .collect();
    assert!(low.len() > 1000, "{}", low.len());
    let velocity_m_s = [0, 1, 2].map(|axis| {
        rms(&low, |_, frame| (frame.estimate.state.velocity_m_s - frame.truth.velocity_m_s)[axis])
    });
    let turn = |frame: &Frame| {
        (frame.truth.world_from_body * frame.estimate.state.world_from_body.inverse()).scaled_axis()
    };
    let tilt_deg = [0, 1].map(|axis| rms(&low, |_, frame| turn(frame)[axis].to_degrees()));
    let height_m = rms(&low, |_, frame| frame.estimate.state.position_m.z - frame.truth.position_m.z);
    println!("below 4 m: velocity {velocity_m_s:.3?} m/s, height {height_m:.3} m, tilt {tilt_deg:.2?} deg");
    assert!(velocity_m_s.iter().all(|error_m_s| *error_m_s < 0.05), "{velocity_m_s:?}");
    assert!(height_m < 0.05, "{height_m}");
    assert!(tilt_deg.iter().all(|error_deg| *error_deg < 0.5), "{tilt_deg:?}");
}
