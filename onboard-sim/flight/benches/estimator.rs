//! Times the estimator: one second of flight (200 frames, with every sensor at its rate), and one
//! frame.
//!
//! `cargo bench -p flight --bench estimator`

use divan::black_box;
use flight::estimation::estimator::{
    Estimator, EstimatorConfig, FixQuality, GRAVITY_M_S2, GnssFix, ImuSample, Measurements, StartUncertainty,
    VehicleNow,
};
use flight::vehicle::mission::LeverArms;
use flight::vehicle::rigid::RigidState;
use nalgebra::{Vector2, Vector3};

fn main() {
    divan::main();
}

const VEHICLE: VehicleNow = VehicleNow {
    mass_kg: 3.0,
    air_density_kg_m3: 1.2,
    body_drag_area_m2: 0.0043,
    leg_drag_area_m2: 0.0,
    fin_drag_area_m2: 0.031,
    fin_lift_area_m2: Vector2::new(0.0, 0.0),
    fin_ahead_of_cg_m: 0.11,
    crossflow_area_m2: 0.09,
    motor_burning: false,
    levers: LeverArms {
        imu_m: Vector3::new(0.0, 0.0, 0.0),
        gnss_m: Vector3::new(0.0, 0.0, 0.0),
        barometer_m: Vector3::new(0.0, 0.0, 0.0),
        lidar_m: Vector3::new(-0.4, 0.0, 0.0),
    },
};

/// A second of upright fall at a steady 39 m/s, low enough for the lidar. It is the second with the
/// most work.
fn second() -> Vec<Measurements> {
    (1..=200_u32)
        .map(|frame| {
            let time_s = 0.005 * f64::from(frame);
            let height_m = 50.0 - 39.0 * time_s;
            let velocity_m_s = Vector3::new(0.0, 0.0, -39.0);
            Measurements {
                imu: ImuSample {
                    gyro_rad_s: Vector3::new(0.01, -0.02, 0.005),
                    specific_force_m_s2: Vector3::new(GRAVITY_M_S2, 0.1, -0.1),
                },
                pressure_altitude_m: frame.is_multiple_of(4).then_some(height_m),
                gnss: frame.is_multiple_of(40).then(|| GnssFix {
                    position_m: Vector3::new(0.0, 0.0, height_m + 39.0 * 0.12),
                    velocity_m_s,
                    valid_at_s: time_s - 0.12,
                    quality: FixQuality::default(),
                }),
                lidar_range_m: frame.is_multiple_of(2).then_some(height_m - 0.4),
            }
        })
        .collect()
}

fn falling() -> Estimator {
    let mut state = RigidState::upright(50.0);
    state.velocity_m_s.z = -39.0;
    Estimator::new(&EstimatorConfig::default(), &StartUncertainty::at_apogee(), 0.0, &state)
}

#[divan::bench(sample_count = 200)]
fn one_second_of_200_frames(bencher: divan::Bencher) {
    let log = second();
    bencher.with_inputs(falling).bench_local_refs(|estimator| {
        for measurements in &log {
            black_box(estimator.step(black_box(measurements), black_box(&VEHICLE)));
        }
    });
}

#[divan::bench(sample_count = 200, sample_size = 100)]
fn frame_with_the_inertial_unit_alone(bencher: divan::Bencher) {
    let mut estimator = falling();
    let log = second();
    let alone = Measurements::of_imu(log[0].imu);
    bencher.bench_local(|| black_box(estimator.step(black_box(&alone), black_box(&VEHICLE))));
}
