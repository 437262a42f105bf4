//! Edge cases: inputs that are not numbers, silent sensors, impossible measurements.

use proptest::prelude::*;

use super::*;
use crate::vehicle::mission::LeverArms;

/// A vehicle in its fall, with open fins.
pub(super) const VEHICLE: VehicleNow = VehicleNow {
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
        lidar_m: Vector3::new(-LIDAR_BEHIND_CG_M, 0.0, 0.0),
    },
};

/// Distance of the lidar behind the centre of gravity, m.
const LIDAR_BEHIND_CG_M: f64 = 0.4;

fn at(height_m: f64) -> Estimator {
    let state = RigidState::upright(height_m);
    Estimator::new(&EstimatorConfig::default(), &StartUncertainty::at_apogee(), 0.0, &state)
}

/// The measurements of every sensor in an upright hover. No fix repeats the one before it: such a
/// fix is stale.
fn hovering(frame: u64) -> Measurements {
    let unrepeated_m = if frame.is_multiple_of(80) { 1e-9 } else { 0.0 };
    Measurements {
        imu: ImuSample {
            gyro_rad_s: Vector3::zeros(),
            specific_force_m_s2: Vector3::new(GRAVITY_M_S2, 0.0, 0.0),
        },
        pressure_altitude_m: frame.is_multiple_of(4).then_some(5.0),
        gnss: frame.is_multiple_of(40).then(|| GnssFix {
            position_m: Vector3::new(unrepeated_m, 0.0, 5.0),
            velocity_m_s: Vector3::zeros(),
            valid_at_s: frame as f64 * 0.005 - 0.12,
            quality: FixQuality::default(),
        }),
        lidar_range_m: frame.is_multiple_of(2).then_some(4.6),
    }
}

#[test]
fn the_estimate_of_a_hover_does_not_drift() {
    let mut estimator = at(5.0);
    let mut estimate = estimator.estimate();
    for frame in 1..=2000 {
        estimate = estimator.step(&hovering(frame), &VEHICLE);
    }
    assert!((estimate.time_s - 10.0).abs() < 1e-9);
    assert!((estimate.state.position_m - Vector3::new(0.0, 0.0, 5.0)).norm() < 1e-6, "{estimate:?}");
    assert!(estimate.state.velocity_m_s.norm() < 1e-6);
    assert!(estimate.health.is_good());
    let aids = estimator.aids();
    assert_eq!((aids.imu.used, aids.barometer.used, aids.lidar.used), (2000, 500, 1000));
    assert_eq!((aids.gnss_velocity.used, aids.gnss_position.refused), (150, 0));
}

#[test]
fn a_turn_on_gyro_bias_found_on_the_pad_does_not_turn_the_attitude() {
    let bias_rad_s = Vector3::new(0.004, -0.003, 0.005);
    let on_pad = |frame| {
        let mut measurements = hovering(frame);
        measurements.imu.gyro_rad_s += bias_rad_s;
        measurements
    };
    let mut alignment = alignment::PadAlignment::default();
    for frame in 1..=400_u64 {
        alignment.take(&on_pad(frame).imu);
    }
    let pad = alignment.finish(0.0).unwrap();
    let state = RigidState { world_from_body: pad.world_from_body, ..RigidState::upright(5.0) };
    let mut estimator = Estimator::new(&EstimatorConfig::default(), &StartUncertainty::on_pad(), 0.0, &state)
        .calibrated(&pad.calibration);
    for frame in 1..=2000 {
        estimator.step(&on_pad(frame), &VEHICLE);
    }
    let estimate = estimator.estimate();
    assert!(estimate.health.is_good());
    assert!(estimate.state.tilt_rad() < 1e-6, "{estimate:?}");
    assert!((estimate.gyro_bias_rad_s - bias_rad_s).norm() < 1e-6, "{estimate:?}");
}

#[test]
fn a_silent_inertial_unit_is_bridged_and_then_makes_the_estimate_unhealthy() {
    let mut estimator = at(5.0);
    let mut health = Vec::new();
    for frame in 1..=20 {
        let mut measurements = hovering(frame);
        if frame > 10 {
            measurements.imu.gyro_rad_s.x = f64::NAN;
        }
        health.push(estimator.step(&measurements, &VEHICLE).health);
    }
    assert!(health[..14].iter().all(|health| health.is_good()));
    assert!(health[14..].iter().all(|health| *health == Health::Unhealthy(HealthIssue::Imu)));
    assert_eq!(health[19].to_string(), "no usable inertial samples");
    assert!(estimator.estimate().state.is_finite());
}

#[test]
fn an_outlier_is_rejected_and_counted() {
    let mut estimator = at(5.0);
    for frame in 1..=400_u64 {
        estimator.step(&hovering(frame), &VEHICLE);
    }
    let before = estimator.estimate().state.position_m.z;
    let mut wild = hovering(400);
    wild.pressure_altitude_m = Some(80.0);
    wild.lidar_range_m = Some(0.2);
    wild.gnss = Some(GnssFix {
        position_m: Vector3::new(500.0, 0.0, 0.0),
        velocity_m_s: Vector3::new(30.0, f64::NAN, f64::INFINITY),
        valid_at_s: 1.9,
        quality: FixQuality::default(),
    });
    let after = estimator.step(&wild, &VEHICLE);
    assert!((after.state.position_m.z - before).abs() < 1e-3, "{after:?}");
    assert!(after.state.velocity_m_s.norm() < 1e-3, "{after:?}");
    let aids = estimator.aids();
    assert_eq!((aids.barometer.refused, aids.lidar.refused, aids.gnss_velocity.refused), (1, 1, 3));
}

#[test]
fn fixes_from_the_future_or_long_ago_are_rejected() {
    let mut estimator = at(5.0);
    for (frame, valid_at_s) in [(1, 1.0), (2, -3.0), (3, f64::NAN)] {
        let mut measurements = hovering(1);
        measurements.gnss = Some(GnssFix {
            position_m: Vector3::new(0.0, 0.0, 5.0),
            velocity_m_s: Vector3::zeros(),
            valid_at_s,
            quality: FixQuality::default(),
        });
        estimator.step(&measurements, &VEHICLE);
        assert_eq!(estimator.aids().gnss_velocity.refused, 3 * frame);
        assert_eq!(estimator.aids().gnss_velocity.used, 0);
    }
}

#[test]
fn a_state_that_is_not_a_number_restarts_from_the_last_good_one() {
    let mut estimator = at(5.0);
    for frame in 1..=100 {
        estimator.step(&hovering(frame), &VEHICLE);
    }
    // Bad input is rejected before this point; a bug in the filter itself would not be.
    estimator.nominal.velocity_m_s.x = f64::NAN;
    let after = estimator.step(&hovering(101), &VEHICLE);
    assert!(after.state.is_finite());
    assert_eq!(after.health, Health::Unhealthy(HealthIssue::Restarted));
    assert_eq!(estimator.restarts(), 1);
    let mut health = after.health;
    for frame in 102..=600 {
        health = estimator.step(&hovering(frame), &VEHICLE).health;
    }
    assert_eq!(health, Health::Good);
    assert!((estimator.estimate().state.position_m.z - 5.0).abs() < 0.1);
}

/// Flies level over ground that rises by 2 % along x, at 8 m/s and 8 m above the pad's level, with
/// exact sensors. Returns the estimated height over the ground less the true one, and the standard
/// deviation that the filter has for it.
fn height_error_over_a_slope(ground_slope_deg: f64) -> (f64, f64) {
    const RISE: f64 = 0.02;
    const SPEED_M_S: f64 = 8.0;
    let config = EstimatorConfig { ground_slope_deg, ..EstimatorConfig::default() };
    let start = RigidState { velocity_m_s: Vector3::x() * SPEED_M_S, ..RigidState::upright(8.0) };
    let mut estimator = Estimator::new(&config, &StartUncertainty::at_apogee(), 0.0, &start);
    let mut over_ground_m = 8.0;
    for frame in 1..=400_u64 {
        let time_s = frame as f64 * 0.005;
        over_ground_m = 8.0 - RISE * SPEED_M_S * time_s;
        let fix = |valid_at_s: f64| GnssFix {
            position_m: Vector3::new(SPEED_M_S * valid_at_s, 0.0, 8.0),
            velocity_m_s: Vector3::x() * SPEED_M_S,
            valid_at_s,
            quality: FixQuality::default(),
        };
        let measurements = Measurements {
            pressure_altitude_m: frame.is_multiple_of(4).then_some(8.0),
            gnss: (frame > 40 && frame.is_multiple_of(40)).then(|| fix(time_s - 0.12)),
            lidar_range_m: frame.is_multiple_of(2).then_some(over_ground_m - LIDAR_BEHIND_CG_M),
            ..hovering(frame)
        };
        estimator.step(&measurements, &VEHICLE);
    }
    let estimate = estimator.estimate();
    (estimate.state.position_m.z - over_ground_m, estimate.sigmas.position_m.z)
}

#[test]
fn a_filter_that_expects_a_slope_is_not_deceived_by_it() {
    let (level_m, level_sigma_m) = height_error_over_a_slope(0.0);
    let (sloped_m, sloped_sigma_m) = height_error_over_a_slope(1.0);
    assert!(sloped_m.abs() < 0.5 * level_m.abs(), "{sloped_m} m, level {level_m} m");
    assert!(sloped_m.abs() < 2.0 * sloped_sigma_m, "{sloped_m} m with {sloped_sigma_m} m");
    assert!(level_m.abs() > 2.0 * level_sigma_m, "the slope must matter: {level_m} m with {level_sigma_m} m");
}

/// Brakes from 20 m/s to 8 m/s with a lidar that is 10 ms late, and otherwise only an exact
/// inertial unit. Returns the error of the estimated height and the standard deviation that the
/// filter has for it.
fn height_error_with_a_late_lidar(lidar_late_s: f64) -> (f64, f64) {
    const LATE_S: f64 = 0.01;
    const BRAKING_M_S2: f64 = 10.0;
    let config = EstimatorConfig { lidar_late_s, ..EstimatorConfig::default() };
    let start = RigidState { velocity_m_s: Vector3::z() * -20.0, ..RigidState::upright(20.0) };
    let mut estimator = Estimator::new(&config, &StartUncertainty::at_apogee(), 0.0, &start);
    let height_m = |time_s: f64| 20.0 - 20.0 * time_s + 0.5 * BRAKING_M_S2 * time_s * time_s;
    for frame in 1..=240_u64 {
        let time_s = frame as f64 * 0.005;
        let late_m = height_m(time_s - LATE_S);
        let mut measurements = hovering(frame);
        measurements.imu.specific_force_m_s2.x += BRAKING_M_S2;
        measurements.pressure_altitude_m = None;
        measurements.gnss = None;
        measurements.lidar_range_m = frame.is_multiple_of(2).then_some(late_m - LIDAR_BEHIND_CG_M);
        estimator.step(&measurements, &VEHICLE);
    }
    let estimate = estimator.estimate();
    (estimate.state.position_m.z - height_m(1.2), estimate.sigmas.position_m.z)
}

#[test]
fn a_filter_that_expects_a_late_lidar_inflates_the_variance_of_its_ranges() {
    let (expecting_m, expecting_sigma_m) = height_error_with_a_late_lidar(0.01);
    assert!(expecting_m.abs() < 2.0 * expecting_sigma_m, "{expecting_m} m with {expecting_sigma_m} m");
    let (trusting_m, trusting_sigma_m) = height_error_with_a_late_lidar(0.0);
    assert!(trusting_m.abs() > 3.0 * trusting_sigma_m, "{trusting_m} m with {trusting_sigma_m} m");
    assert!(expecting_m.abs() < trusting_m.abs(), "{expecting_m} m, trusting {trusting_m} m");
}

/// Hovers 5 m over the ground where the satellites, and the barometer if there is one, show 8 m.
/// From `first` on measures the ranges to the ground, the tenth of which is `tenth_m`. Returns the
/// estimated heights after each frame from then on.
fn heights_with_ranges_from(first: u64, tenth_m: f64, has_barometer: bool) -> Vec<f64> {
    let mut estimator = at(8.0);
    (1..first + 40)
        .map(|frame| {
            let measured = hovering(frame);
            let fix = |fix: GnssFix| GnssFix { position_m: fix.position_m + Vector3::z() * 3.0, ..fix };
            let range_m = if frame == first + 18 { tenth_m } else { 4.6 };
            let measurements = Measurements {
                pressure_altitude_m: measured.pressure_altitude_m.filter(|_| has_barometer).map(|_| 8.0),
                gnss: measured.gnss.map(fix),
                lidar_range_m: measured.lidar_range_m.filter(|_| frame >= first).map(|_| range_m),
                ..measured
            };
            estimator.step(&measurements, &VEHICLE).state.position_m.z
        })
        .skip(first as usize - 1)
        .collect()
}

/// Against one other height.
#[test]
fn ranges_that_agree_for_a_tenth_of_a_second_are_accepted() {
    for first in [402, 404] {
        // An outlier as the tenth: the next two decide.
        for (tenth_m, accepted_after) in [(4.6, 18), (30.0, 22)] {
            let heights_m = heights_with_ranges_from(first, tenth_m, false);
            let (before_m, after_m) = heights_m.split_at(accepted_after);
            assert!(before_m.iter().all(|height_m| (height_m - 8.0).abs() < 0.1), "{first}: {heights_m:?}");
            assert!(after_m.iter().all(|height_m| (height_m - 5.0).abs() < 0.3), "{first}: {heights_m:?}");
        }
    }
}

/// Barometer and satellites agree against the lidar.
#[test]
fn two_other_heights_outvote_ranges_that_agree() {
    let heights_m = heights_with_ranges_from(402, 4.6, true);
    assert!(heights_m.iter().all(|height_m| (height_m - 8.0).abs() < 0.1), "{heights_m:?}");
}

/// Hovers for 10 s at 5 m, out of the lidar's sight, and from the fifth second on the barometer and
/// the fixes are higher by these, m.
fn hover_with_heights_off(barometer_m: f64, fixes_m: f64) -> Estimate {
    let mut estimator = at(5.0);
    for frame in 1..=2000 {
        let measured = hovering(frame);
        let late = if frame > 1000 { 1.0 } else { 0.0 };
        let off =
            |fix: GnssFix| GnssFix { position_m: fix.position_m + Vector3::z() * fixes_m * late, ..fix };
        let measurements = Measurements {
            pressure_altitude_m: measured.pressure_altitude_m.map(|height_m| height_m + barometer_m * late),
            gnss: measured.gnss.map(off),
            lidar_range_m: None,
            ..measured
        };
        estimator.step(&measurements, &VEHICLE);
    }
    estimator.estimate()
}

#[test]
fn two_heights_outvote_the_third() {
    for off_m in [60.0, -60.0] {
        let barometer_off = hover_with_heights_off(off_m, 0.0);
        assert!((barometer_off.state.position_m.z - 5.0).abs() < 0.5, "{barometer_off:?}");
        assert_eq!(barometer_off.heights.barometric_m, None);
        let fixes_off = hover_with_heights_off(0.0, off_m);
        assert!((fixes_off.state.position_m.z - 5.0).abs() < 0.5, "{fixes_off:?}");
        assert!(fixes_off.heights.barometric_m.is_some(), "{fixes_off:?}");
        // Nothing shows which of two deviating sources is right.
        let both_off = hover_with_heights_off(-off_m, off_m);
        assert!(both_off.heights.contradiction_m() != Some(0.0), "{both_off:?}");
    }
}

/// A charge changes the velocity without a trace in the inertial unit. The fixes show it, and no
/// other state is inflated.
#[test]
fn an_expected_shock_does_not_spoil_the_attitude() {
    let deviations = [true, false].map(|expected| {
        let mut estimator = at(5.0);
        let mut estimate = estimator.estimate();
        for frame in 1..=1400 {
            if frame == 1000 && expected {
                estimator.take_shock(0.5);
            }
            let mut measurements =
                Measurements { lidar_range_m: None, pressure_altitude_m: None, ..hovering(frame) };
            if let Some(fix) = measurements.gnss.as_mut().filter(|fix| fix.valid_at_s > 5.0) {
                fix.velocity_m_s.z = 0.5;
                fix.position_m.z = 5.0 + 0.5 * (fix.valid_at_s - 5.0);
            }
            estimate = estimator.step(&measurements, &VEHICLE);
        }
        assert!((estimate.state.velocity_m_s.z - 0.5).abs() < 0.1, "{estimate:?}");
        estimate.sigmas.attitude_rad.x.to_degrees()
    });
    assert!(deviations[0] < 1.0 && deviations[1] > 2.0, "{deviations:?}");
}

/// The gyro bias is inflated once, at ignition of the motor.
#[test]
fn the_landing_motor_may_shift_the_gyros_bias() {
    let config = EstimatorConfig { burning_gyro_bias_deg_s: 0.1, ..EstimatorConfig::default() };
    let mut estimator =
        Estimator::new(&config, &StartUncertainty::at_apogee(), 0.0, &RigidState::upright(20.0));
    let rest = ImuSample { gyro_rad_s: Vector3::zeros(), specific_force_m_s2: Vector3::x() * 9.8 };
    let burning = VehicleNow { motor_burning: true, ..VEHICLE };
    let mut deviation = |vehicle: &VehicleNow| {
        estimator.step(&Measurements::of_imu(rest), vehicle).sigmas.gyro_bias_rad_s.y.to_degrees()
    };
    let [falls, lights, burns] = [&VEHICLE, &burning, &burning].map(&mut deviation);
    assert!((libm::hypot(falls, 0.1) - lights).abs() < 1e-4, "{falls} {lights}");
    assert!((burns - lights).abs() < 1e-4, "{lights} {burns}");
}

fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        5 => -50.0..50.0,
        1 => prop::num::f64::ANY,
    ]
}

fn any_vector() -> impl Strategy<Value = Vector3<f64>> {
    (any_number(), any_number(), any_number()).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

fn any_measurements() -> impl Strategy<Value = Measurements> {
    (
        (any_vector(), any_vector()),
        prop::option::of(any_number()),
        prop::option::of((any_vector(), any_vector(), 0.0..0.5)),
        prop::option::of(any_number()),
    )
        .prop_map(|((gyro_rad_s, specific_force_m_s2), pressure_altitude_m, gnss, lidar_range_m)| {
            Measurements {
                imu: ImuSample { gyro_rad_s, specific_force_m_s2 },
                pressure_altitude_m,
                gnss: gnss.map(|(position_m, velocity_m_s, valid_at_s)| GnssFix {
                    position_m,
                    velocity_m_s,
                    valid_at_s,
                    quality: FixQuality::default(),
                }),
                lidar_range_m,
            }
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn whatever_is_measured_the_estimate_is_a_number(
        log in prop::collection::vec(any_measurements(), 1..80),
        mass_kg in any_number(),
        behind_cg_m in any_number(),
        burning in any::<bool>(),
    ) {
        let vehicle = VehicleNow {
            mass_kg,
            levers: LeverArms { lidar_m: Vector3::x() * -behind_cg_m, ..VEHICLE.levers },
            motor_burning: burning,
            ..VEHICLE
        };
        let mut estimator = at(20.0);
        for measurements in &log {
            let estimate = estimator.step(measurements, &vehicle);
            prop_assert!(estimate.state.is_finite(), "{:?}", estimate);
            prop_assert!(estimate.wind_m_s.iter().all(|wind| wind.is_finite()));
            prop_assert!(estimate.sigmas.velocity_m_s.iter().all(|sigma| sigma.is_finite()));
            prop_assert!((estimate.state.world_from_body.norm() - 1.0).abs() < 1e-6);
        }
    }
}
