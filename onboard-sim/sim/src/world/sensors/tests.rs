//! The sensors against their parameters.

use super::*;

/// The centre of gravity is the origin of the stations here.
const PLACES: SensorPlaces = SensorPlaces {
    imu_station_m: None,
    imu_across_m: [0.0; 2],
    gnss_station_m: None,
    gnss_across_m: [0.0; 2],
    barometer_station_m: None,
    barometer_across_m: [0.0; 2],
    lidar_station_m: Some(-0.45),
    lidar_across_m: [0.0; 2],
};

fn falling(speed_m_s: f64, height_m: f64) -> SensorTruth {
    let mut state = RigidState::upright(height_m);
    state.velocity_m_s.z = -speed_m_s;
    SensorTruth::of_motion(&state, &Vector3::new(9.8, 0.1, -0.2), speed_m_s, 0.6)
}

fn frames(seed: u64, truth: &SensorTruth, frames: usize) -> Vec<Measurements> {
    frames_with(seed, truth, &[], frames)
}

fn frames_with(
    seed: u64,
    truth: &SensorTruth,
    broken: &[(Sensor, Defect)],
    frames: usize,
) -> Vec<Measurements> {
    let mut sensors = Sensors::new(&SensorParams::default(), &PLACES, seed, 1.0).unwrap();
    let mut faults = SensorFaults::default();
    for (sensor, defect) in broken {
        faults.break_down(*sensor, *defect);
    }
    let steps = frames * FRAME_MS as usize;
    (0..steps).filter_map(|_| sensors.observe(truth)).map(|measured| faults.distort(&measured)).collect()
}

#[test]
fn each_sensor_reports_at_its_rate() {
    let seen = frames(1, &falling(10.0, 5.0), 400);
    assert_eq!(seen.len(), 400);
    assert_eq!(seen.iter().filter(|m| m.pressure_altitude_m.is_some()).count(), 100);
    assert_eq!(seen.iter().filter(|m| m.lidar_range_m.is_some()).count(), 200);
    assert!((9..=10).contains(&seen.iter().filter(|m| m.gnss.is_some()).count()));
}

#[test]
fn a_fix_is_120_ms_old_at_the_frame_that_gets_it() {
    let seen = frames(2, &falling(10.0, 5.0), 400);
    for (frame, measurements) in seen.iter().enumerate() {
        if let Some(fix) = measurements.gnss {
            let age_s = (frame + 1) as f64 * 0.005 - fix.valid_at_s;
            assert!((0.12 - 1e-9..0.125).contains(&age_s), "{age_s}");
        }
    }
}

#[test]
fn the_lidar_is_silent_high_up_and_on_its_side() {
    let lidar_of = |truth: &SensorTruth| {
        frames(3, truth, 100).iter().filter_map(|m| m.lidar_range_m).collect::<Vec<_>>()
    };
    assert!(lidar_of(&falling(5.0, 13.0)).is_empty());
    let mut leaning = falling(5.0, 5.0);
    let lean = |deg: f64| nalgebra::UnitQuaternion::from_axis_angle(&Vector3::x_axis(), deg.to_radians());
    leaning.state.world_from_body = lean(46.0) * flight::vehicle::rigid::upright();
    assert!(lidar_of(&leaning).is_empty());
    // 11 m straight down are in range. The slant range of 10.7 m from 8 m is beyond 12 m times the
    // root of the cosine of 44 deg.
    assert!(!lidar_of(&falling(5.0, 11.0)).is_empty());
    let mut far = falling(5.0, 8.0);
    far.state.world_from_body = lean(44.0) * flight::vehicle::rigid::upright();
    assert!(lidar_of(&far).is_empty());
    leaning.state.world_from_body = lean(20.0) * flight::vehicle::rigid::upright();
    let ranges = lidar_of(&leaning);
    // 5 m / cos 20 deg - (0.6 - 0.15) m.
    let mean = ranges.iter().sum::<f64>() / ranges.len() as f64;
    assert!((mean - 4.870_889).abs() < 4.0 * 0.06 / (ranges.len() as f64).sqrt(), "{mean}");
}

#[test]
fn a_fault_silences_its_sensor_and_does_not_change_the_noise_of_others() {
    let truth = falling(10.0, 5.0);
    let healthy = frames(4, &truth, 400);
    let step = Vector3::from_element(5f64.to_radians());
    let broken =
        frames_with(4, &truth, &[(Sensor::Gnss, Defect::Out), (Sensor::Gyro, Defect::Step(5.0))], 400);
    for (well, ill) in healthy.iter().zip(&broken) {
        assert!(ill.gnss.is_none());
        assert_eq!(ill.pressure_altitude_m, well.pressure_altitude_m);
        assert_eq!(ill.lidar_range_m, well.lidar_range_m);
        assert_eq!(ill.imu.specific_force_m_s2, well.imu.specific_force_m_s2);
        assert!((ill.imu.gyro_rad_s - well.imu.gyro_rad_s - step).norm() < 1e-12);
    }
    let silent = [(Sensor::Barometer, Defect::Out), (Sensor::Lidar, Defect::Out)];
    let silent = frames_with(4, &truth, &silent, 400);
    assert!(silent.iter().all(|m| m.pressure_altitude_m.is_none() && m.lidar_range_m.is_none()));
}

/// By the definition of each defect, on a barometer that is 10 m up and samples in every fourth
/// frame.
#[test]
fn each_defect_has_its_effect() {
    let said = |defect| {
        let frames = frames_with(4, &falling(0.0, 10.0), &[(Sensor::Barometer, defect)], 400);
        frames.iter().filter_map(|m| m.pressure_altitude_m).collect::<Vec<_>>()
    };
    let well = said(Defect::Step(0.0));
    let off = |defect| said(defect).iter().zip(&well).map(|(ill, well)| ill - well).collect::<Vec<_>>();
    assert!(said(Defect::Out).is_empty());
    assert!(said(Defect::Dead).iter().all(|height_m| height_m.abs() < 1e-12));
    assert!(said(Defect::NotANumber).iter().all(|height_m| height_m.is_nan()));
    assert!(said(Defect::Stuck).windows(2).all(|pair| pair[0].to_bits() == pair[1].to_bits()));
    assert_eq!(said(Defect::Blocked(0.3)).len(), 400);
    assert!(off(Defect::Step(-55.0)).iter().all(|off_m| (off_m + 55.0).abs() < 1e-9));
    // The last sample is the 400th frame's, 1.995 s after the first.
    assert!((off(Defect::Ramp(20.0)).last().unwrap() - 20.0 * 1.995).abs() < 1e-9);
    let spike = off(Defect::Spike(100.0));
    assert!(
        spike[..5].iter().all(|off_m| (off_m - 100.0).abs() < 1e-9)
            && spike[5..].iter().all(|off_m| off_m.abs() < 1e-9)
    );
    let noise = off(Defect::Noise(0.8));
    let sigma_m = (noise.iter().map(|off_m| off_m * off_m).sum::<f64>() / noise.len() as f64).sqrt();
    assert!((0.6..1.0).contains(&sigma_m), "{sigma_m}");
}

#[test]
fn noise_has_the_stated_size_and_a_seed_repeats_it() {
    let truth = falling(30.0, 200.0);
    let seen = frames(5, &truth, 4000);
    assert_eq!(seen, frames(5, &truth, 4000));
    assert_ne!(seen, frames(6, &truth, 4000));
    let spread = |values: Vec<f64>| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let squares = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>();
        (squares / values.len() as f64).sqrt()
    };
    // Densities over the square root of a frame's 5 ms; four standard errors of 4,000 samples are
    // 4.5 %.
    let gyro = spread(seen.iter().map(|m| m.imu.gyro_rad_s.x).collect());
    assert!((gyro.to_degrees() / (0.05 / 0.005_f64.sqrt()) - 1.0).abs() < 0.045, "{gyro}");
    let force = spread(seen.iter().map(|m| m.imu.specific_force_m_s2.y).collect());
    assert!((force / 0.090_147 - 1.0).abs() < 0.045, "{force}");
}

#[test]
fn over_many_flights_the_ram_error_has_its_size() {
    // 30 m/s has a speed height of 45.89 m: a sigma of 2.29 m, and 0.3 m of offset.
    let n = 300;
    let squares: f64 = (0..n)
        .map(|seed| {
            let seen = frames(seed, &falling(30.0, 200.0), 4);
            let error = seen.last().and_then(|m| m.pressure_altitude_m).map_or(f64::NAN, |m| m - 200.0);
            error * error
        })
        .sum();
    let sigma = (squares / n as f64).sqrt();
    assert!((sigma / 2.316 - 1.0).abs() < 4.0 / (2.0 * n as f64).sqrt(), "{sigma}");
}

fn flawed(params: &SensorParams) -> Sensors {
    Sensors::new(params, &PLACES, 9, 1.0).unwrap()
}

/// Without noise and bias.
fn quiet() -> SensorParams {
    let none = SensorParams::default();
    SensorParams {
        imu: ImuParams {
            gyro_noise_deg_s_sqrt_hz: 0.0,
            gyro_bias_deg_s: 0.0,
            gyro_bias_walk_deg_s_sqrt_s: 0.0,
            accelerometer_noise_mg_sqrt_hz: 0.0,
            accelerometer_bias_mg: 0.0,
            accelerometer_scale_share: 0.0,
            ..none.imu
        },
        ..none
    }
}

fn one_frame(sensors: &mut Sensors, truth: &SensorTruth) -> Measurements {
    (0..FRAME_MS).find_map(|_| sensors.observe(truth)).unwrap()
}

#[test]
fn val_hand_an_offset_unit_senses_the_rotation_and_a_rotated_one_mixes_the_axes() {
    let mut sensors = flawed(&quiet());
    sensors.flaws.unit_m = Vector3::new(0.1, 0.0, 0.0);
    let mut truth = falling(10.0, 50.0);
    truth.inertial.rate_rad_s = Vector3::new(0.0, 0.0, 2.0);
    truth.inertial.angular_acceleration_rad_s2 = Vector3::new(0.0, 0.0, 5.0);
    // Centripetal -w^2 r along x, tangential a r along y.
    let measured = one_frame(&mut sensors, &truth).imu.specific_force_m_s2;
    assert!((measured - Vector3::new(9.8 - 0.4, 0.1 + 0.5, -0.2)).norm() < 1e-12, "{measured}");
    let mut turned = flawed(&quiet());
    // The unit is turned by 90 degrees about x: its y axis lies along the body's z.
    turned.flaws.unit_from_body = nalgebra::Rotation3::from_matrix_unchecked(nalgebra::Matrix3::new(
        1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0,
    ));
    let imu = one_frame(&mut turned, &falling(10.0, 50.0)).imu;
    assert!((imu.specific_force_m_s2 - Vector3::new(9.8, -0.2, -0.1)).norm() < 1e-12);
}

#[test]
fn vibration_shakes_the_unit_while_the_motor_burns() {
    let params =
        SensorParams { imu: ImuParams { vibration_g: 0.05, vibration_deg_s: 0.1, ..quiet().imu }, ..quiet() };
    let rms = |burning: bool| {
        let mut sensors = flawed(&params);
        let truth = SensorTruth { burning, ..falling(10.0, 50.0) };
        let n = 4000;
        let squares: f64 = (0..n)
            .map(|_| one_frame(&mut sensors, &truth).imu.specific_force_m_s2.x - 9.8)
            .map(|off| off * off)
            .sum();
        libm::sqrt(squares / f64::from(n))
    };
    assert!(rms(false) < 1e-9);
    // Four standard errors of 4,000 samples are 4.5 %.
    assert!((rms(true) / (0.05 * GRAVITY_M_S2) - 1.0).abs() < 0.045, "{}", rms(true));
}

#[test]
fn the_burning_motor_shifts_the_gyros_bias_by_the_stated_size() {
    let imu = ImuParams { vibration_bias_deg_s: 0.5, ..quiet().imu };
    let params = SensorParams { imu, ..quiet() };
    let n = 400;
    let squares: f64 = (0..n)
        .map(|seed| {
            let mut sensors = Sensors::new(&params, &PLACES, seed, 1.0).unwrap();
            let mut gyro = |burning: bool| {
                one_frame(&mut sensors, &SensorTruth { burning, ..falling(10.0, 50.0) }).imu.gyro_rad_s
            };
            assert!(gyro(false).norm() < 1e-12);
            let [first, later] = [gyro(true), gyro(true)];
            assert_eq!(first, later, "it stays");
            first.norm_squared() / 3.0
        })
        .sum();
    // Four standard errors of 1,200 numbers are 8 %.
    let sigma_deg_s = libm::sqrt(squares / n as f64).to_degrees();
    assert!((sigma_deg_s / 0.5 - 1.0).abs() < 0.08, "{sigma_deg_s}");
}

#[test]
fn late_samples_wrong_tags_dust_dropouts_and_switches() {
    let quiet = quiet();
    let params = SensorParams {
        barometer: BarometerParams {
            noise_m: 0.0,
            offset_m: 0.0,
            offset_walk_m_sqrt_s: 0.0,
            ram_coefficient: 0.0,
            ..quiet.barometer
        },
        lidar: LidarParams { blind_below_m: 2.0, noise_m: 0.0, dropout_share: 0.25, ..quiet.lidar },
        switches: SwitchParams { contact_late_ms: 12, ..quiet.switches },
        ..quiet
    };
    let truth = falling(10.0, 5.0);
    let mut sensors = flawed(&params);
    sensors.flaws.barometer_late_s = 0.02;
    sensors.flaws.lidar_late_s = 0.01;
    sensors.flaws.barometer_plume_m = 0.5;
    sensors.flaws.barometer_ejection_m = 8.0;
    sensors.flaws.gnss_tag_s = 0.03;
    let frames: Vec<Measurements> = (0..800).map(|_| one_frame(&mut sensors, &truth)).collect();
    // 20 ms ago the vehicle was 0.2 m higher; for the lidar 10 ms and 0.1 m, and 0.45 m from the
    // lidar to the centre.
    assert!(frames.iter().filter_map(|m| m.pressure_altitude_m).all(|m| (m - 5.2).abs() < 1e-9));
    let ranges: Vec<f64> = frames.iter().filter_map(|m| m.lidar_range_m).collect();
    assert!(ranges.iter().all(|range_m| (range_m - (5.1 - 0.45)).abs() < 1e-9));
    // 400 ranges, a quarter lost; four standard deviations are 35.
    assert!((265..=335).contains(&ranges.len()), "{}", ranges.len());
    let fix = frames.iter().position(|m| m.gnss.is_some()).unwrap();
    let age_s = (fix + 1) as f64 * 0.005 - frames[fix].gnss.unwrap().valid_at_s;
    assert!((0.12 - 0.03 - 1e-9..0.125 - 0.03).contains(&age_s), "{age_s}");

    let burning = SensorTruth { burning: true, ejected_for_s: Some(0.3), ..falling(10.0, 2.5) };
    let altitude_m = (0..4).find_map(|_| one_frame(&mut sensors, &burning).pressure_altitude_m).unwrap();
    // The plume, and the ejection's pressure after one time constant.
    assert!((altitude_m - (2.7 + 0.5 + 8.0 * libm::exp(-1.0))).abs() < 1e-9, "{altitude_m}");
    assert!((0..40).all(|_| one_frame(&mut sensors, &burning).lidar_range_m.is_none()), "dust below 2 m");

    assert!(!sensors.contact(false) && !sensors.contact(true), "reported late");
    one_frame(&mut sensors, &truth);
    one_frame(&mut sensors, &truth);
    assert!(!sensors.contact(true), "after 10 ms");
    one_frame(&mut sensors, &truth);
    assert!(sensors.contact(true), "after 15 ms");
}

/// The last measurement of each sensor after 0.4 s: with the same noise for the same seed, whatever
/// the parameters.
fn last_of_each(params: &SensorParams, truth: &SensorTruth) -> Measurements {
    let mut sensors = Sensors::new(params, &PLACES, 5, 1.0).unwrap();
    let frames = (0..400).filter_map(|_| sensors.observe(truth));
    frames
        .reduce(|last, now| Measurements {
            imu: now.imu,
            pressure_altitude_m: now.pressure_altitude_m.or(last.pressure_altitude_m),
            gnss: now.gnss.or(last.gnss),
            lidar_range_m: now.lidar_range_m.or(last.lidar_range_m),
        })
        .unwrap()
}

#[test]
fn val_hand_a_flow_across_the_axis_raises_the_barometers_height() {
    let truth = SensorTruth { airspeed_across_m_s: 10.0, ..falling(40.0, 100.0) };
    let quiet = quiet();
    let barometer = BarometerParams { crossflow: [0.55; 2], ..quiet.barometer };
    let raised_m = last_of_each(&SensorParams { barometer, ..quiet }, &truth).pressure_altitude_m.unwrap()
        - last_of_each(&quiet, &truth).pressure_altitude_m.unwrap();
    // 0.55 times 10^2 / (2 times 9.80665).
    assert!((raised_m - 2.804_219).abs() < 1e-6, "{raised_m}");
}

/// A fix that is older than its tag is off by the motion since: in the fall by 40 m/s, and its
/// velocity by gravity less drag.
#[test]
fn a_fix_of_unknown_age_is_off_along_the_motion() {
    let truth = falling(40.0, 100.0);
    let quiet = quiet();
    let gnss = GnssParams { age_jitter_s: 0.02, ..quiet.gnss };
    let fix = last_of_each(&SensorParams { gnss, ..quiet }, &truth).gnss.unwrap();
    let good = last_of_each(&quiet, &truth).gnss.unwrap();
    let (moved_m, gained_m_s) = (fix.position_m - good.position_m, fix.velocity_m_s - good.velocity_m_s);
    let older_s = moved_m.z / 40.0;
    assert!(older_s.abs() > 1e-4 && older_s.abs() < 0.1, "{older_s}");
    assert!(moved_m.xy().norm() < 1e-12);
    let mut acceleration_m_s2 = truth.state.world_from_body * truth.inertial.specific_force_m_s2;
    acceleration_m_s2.z -= GRAVITY_M_S2;
    assert!((gained_m_s + acceleration_m_s2 * older_s).norm() < 1e-12, "{gained_m_s}");
}

#[test]
fn a_beam_meets_the_grass_and_leans_as_its_holder_does() {
    let truth = falling(1.0, 5.0);
    let quiet = quiet();
    let range =
        |lidar: LidarParams| last_of_each(&SensorParams { lidar, ..quiet }, &truth).lidar_range_m.unwrap();
    let good_m = range(quiet.lidar);
    assert!((good_m - range(LidarParams { grass_m: [0.15; 2], ..quiet.lidar }) - 0.15).abs() < 1e-12);
    // A beam that leans meets level ground further away; with 10 degrees each way it leans by less
    // than 45.
    let leaning_m = range(LidarParams { beam_deg: 10.0, ..quiet.lidar });
    assert!(leaning_m > good_m + 1e-3 && leaning_m < good_m + 5.0, "{leaning_m}");
}
