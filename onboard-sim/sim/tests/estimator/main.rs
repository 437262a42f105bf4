//! Tests the estimator with the modelled sensors: it is consistent, accurate enough for landing,
//! and works when sensors fail.
#![expect(clippy::expect_used, reason = "a test says what it expected")]

mod flight;
mod plant;

use std::sync::LazyLock;

use ::flight::estimation::estimator::{Health, HealthIssue, Measurements};

use self::flight::{Frame, Scene};

/// Flights of a Monte Carlo run.
const FLIGHTS: u64 = 200;

fn fly(flights: u64, faults: fn(f64, &mut Measurements)) -> Vec<Vec<Frame>> {
    (0..flights).map(|seed| Scene { faults, ..Scene::of(seed) }.fly()).collect()
}

/// Flights without faults, shared by several tests.
static HEALTHY: LazyLock<Vec<Vec<Frame>>> = LazyLock::new(|| fly(FLIGHTS, |_, _| {}));

fn rms(frames: &[&Frame], error: impl Fn(&Frame) -> f64) -> f64 {
    (frames.iter().map(|frame| error(frame).powi(2)).sum::<f64>() / frames.len() as f64).sqrt()
}

fn last(flights: &[Vec<Frame>]) -> Vec<&Frame> {
    flights.iter().map(|frames| frames.last().expect("a flight has frames")).collect()
}

/// The frames of all flights that meet a condition.
fn frames(flights: &[Vec<Frame>], of: impl Fn(&Frame) -> bool) -> Vec<&Frame> {
    flights.iter().flatten().filter(|frame| of(frame)).collect()
}

/// Largest over the axes of the root-mean-square velocity error, m/s.
fn velocity_rms_m_s(at: &[&Frame]) -> f64 {
    (0..3).map(|axis| rms(at, |frame| frame.velocity_error_m_s()[axis])).fold(0.0, f64::max)
}

/// Larger of the root-mean-square errors of lean about the two horizontal axes, degrees.
fn tilt_rms_deg(at: &[&Frame]) -> f64 {
    (0..2).map(|axis| rms(at, |frame| frame.turn_error_rad()[axis].to_degrees())).fold(0.0, f64::max)
}

fn height_rms_m(at: &[&Frame]) -> f64 {
    rms(at, |frame| frame.estimate.state.position_m.z - frame.truth.position_m.z)
}

#[test]
fn val_chi_square_the_error_matches_the_filters_covariance() {
    let flights = &*HEALTHY;
    let shortest = flights.iter().map(Vec::len).min().expect("at least one flight");
    // Nine degrees of freedom, averaged over the flights: chi-square of 1,800 has a standard
    // deviation of 60, and 99.9 % of it lies within 3.29 of them (Bar-Shalom, Li and Kirubarajan,
    // "Estimation with Applications to Tracking and Navigation", section 5.4).
    let freedom = 9.0 * FLIGHTS as f64;
    let half_width = 3.29 * (2.0 * freedom).sqrt() / FLIGHTS as f64;
    for frame in (0..shortest).step_by(50) {
        let mean = flights.iter().map(|frames| frames[frame].nees).sum::<f64>() / FLIGHTS as f64;
        println!("{:6.3} s: {mean:.2} of 9 +- {half_width:.2}", flights[0][frame].time_s);
        assert!((mean - 9.0).abs() < half_width, "{mean} after {} s", flights[0][frame].time_s);
    }
}

#[test]
fn the_estimate_is_accurate_enough_for_landing() {
    let flights = &*HEALTHY;
    let low = frames(flights, |frame| frame.truth.position_m.z < 8.0);
    let down = last(flights);
    println!(
        "below 8 m: velocity {:.3} m/s, height {:.3} m, tilt {:.2} deg; at the ground: {:.3} {:.3} {:.2}",
        velocity_rms_m_s(&low),
        height_rms_m(&low),
        tilt_rms_deg(&low),
        velocity_rms_m_s(&down),
        height_rms_m(&down),
        tilt_rms_deg(&down),
    );
    for at in [low, down] {
        assert!(velocity_rms_m_s(&at) < 0.05, "{}", velocity_rms_m_s(&at));
        assert!(height_rms_m(&at) < 0.05, "{}", height_rms_m(&at));
        assert!(tilt_rms_deg(&at) < 0.5, "{}", tilt_rms_deg(&at));
    }
    assert!(flights.iter().flatten().all(|frame| frame.estimate.health == Health::Good));
}

#[test]
fn the_wind_is_estimated_at_ignition_despite_a_wrong_drag_coefficient() {
    let flights = &*HEALTHY;
    let burning: Vec<&Frame> = flights
        .iter()
        .map(|frames| frames.iter().find(|frame| frame.burning).expect("a frame with the motor burning"))
        .collect();
    for axis in 0..2 {
        let error_m_s = rms(&burning, |frame| (frame.estimate.wind_m_s - frame.wind_m_s)[axis]);
        println!("wind at ignition: {error_m_s:.2} m/s");
        assert!(error_m_s < 0.4, "{error_m_s}");
    }
}

#[test]
fn the_two_heights_agree_at_ignition_and_show_a_jump_of_the_barometer() {
    let flights = &*HEALTHY;
    for frame in frames(flights, |frame| frame.time_s > 1.0) {
        let apart_m = frame.estimate.heights.disagreement_m().expect("two heights");
        assert!(apart_m < 2.5, "{apart_m} m after {} s", frame.time_s);
    }
    let scene = Scene::of(3);
    let mut estimator = scene.estimator();
    let mut apart_m = None;
    for frame in scene.fly().iter().take_while(|frame| frame.time_s < 6.0) {
        let mut measurements = frame.measurements;
        if frame.time_s > 5.7 {
            measurements.pressure_altitude_m =
                measurements.pressure_altitude_m.map(|height_m| height_m + 5.0);
        }
        apart_m = estimator.step(&measurements, &frame.vehicle).heights.disagreement_m();
    }
    assert!(apart_m.is_some_and(|apart_m| (4.0..6.0).contains(&apart_m)), "{apart_m:?}");
}

#[test]
fn without_satellites_in_the_last_five_seconds_the_error_stays_within_the_stated_deviation() {
    let flights = &fly(FLIGHTS, |time_s, heard| heard.gnss = heard.gnss.filter(|_| time_s <= 6.9));
    let down = last(flights);
    let silent_s = down.iter().map(|frame| frame.time_s - 6.9).fold(f64::INFINITY, f64::min);
    println!(
        "{silent_s:.1} s without satellites: velocity {:.2} m/s, height {:.3} m, tilt {:.2} deg",
        velocity_rms_m_s(&down),
        height_rms_m(&down),
        tilt_rms_deg(&down)
    );
    assert!(silent_s > 4.9);
    assert!(velocity_rms_m_s(&down) < 0.35, "{}", velocity_rms_m_s(&down));
    assert!(height_rms_m(&down) < 0.05, "{}", height_rms_m(&down));
    assert!(tilt_rms_deg(&down) < 0.5, "{}", tilt_rms_deg(&down));
    let mean = down.iter().map(|frame| frame.nees).sum::<f64>() / FLIGHTS as f64;
    assert!((mean - 9.0).abs() < 3.29 * (18.0 / FLIGHTS as f64).sqrt(), "{mean}");
}

#[test]
fn one_height_sensor_is_enough_for_the_descent() {
    let no_barometer = fly(50, |time_s, heard| {
        heard.pressure_altitude_m = heard.pressure_altitude_m.filter(|_| time_s <= 3.0);
    });
    let down = last(&no_barometer);
    assert!(height_rms_m(&down) < 0.05 && velocity_rms_m_s(&down) < 0.05);
    assert!(down.iter().all(|frame| frame.estimate.heights.barometric_m.is_none()));
    let no_lidar = fly(50, |_, heard| heard.lidar_range_m = None);
    let down = last(&no_lidar);
    println!("without lidar: height {:.2} m", height_rms_m(&down));
    assert!(height_rms_m(&down) < 0.5 && velocity_rms_m_s(&down) < 0.05);
}

#[test]
fn after_a_jump_of_the_inertial_unit_the_estimate_is_unhealthy_and_then_recovers() {
    let jumps: [fn(f64, &mut Measurements); 3] = [
        |time_s, heard| gyro_jump(time_s, heard, 1.0),
        |time_s, heard| gyro_jump(time_s, heard, 5.0),
        |time_s, heard| heard.imu.specific_force_m_s2.y += if time_s > 4.0 { 0.5 } else { 0.0 },
    ];
    for jump in jumps {
        let flights = &fly(50, jump);
        let rejected = flights
            .iter()
            .filter(|frames| {
                frames.iter().any(|frame| frame.estimate.health == Health::Unhealthy(HealthIssue::Surprised))
            })
            .count();
        assert!(rejected >= 49, "rejected in {rejected} of 50");
        let down = last(flights);
        println!("velocity {:.3} m/s, tilt {:.2} deg", velocity_rms_m_s(&down), tilt_rms_deg(&down));
        assert!(velocity_rms_m_s(&down) < 0.1, "{}", velocity_rms_m_s(&down));
        assert!(tilt_rms_deg(&down) < 1.5, "{}", tilt_rms_deg(&down));
    }
}

fn gyro_jump(time_s: f64, heard: &mut Measurements, deg_s: f64) {
    heard.imu.gyro_rad_s.y += if time_s > 4.0 { deg_s.to_radians() } else { 0.0 };
}

#[test]
fn a_log_of_measurements_reproduces_the_estimate_bit_for_bit() {
    let scene = Scene::of(11);
    let flown = scene.fly();
    let mut estimator = scene.estimator();
    // Also from halfway: a clone continues exactly like the original.
    let mut frozen = None;
    for (index, frame) in flown.iter().enumerate() {
        let again = estimator.step(&frame.measurements, &frame.vehicle);
        assert_eq!(again, frame.estimate, "frame {index}");
        if index == flown.len() / 2 {
            frozen = Some(estimator.clone());
        }
    }
    let mut thawed = frozen.expect("more than one frame");
    for frame in &flown[flown.len() / 2 + 1..] {
        thawed.step(&frame.measurements, &frame.vehicle);
    }
    assert_eq!(thawed, estimator);
}

#[test]
fn a_frame_does_not_allocate() {
    let scene = Scene::of(5);
    let flown = scene.fly();
    let mut estimator = scene.estimator();
    let allocated = allocation_counter::measure(|| {
        for frame in &flown {
            estimator.step(&frame.measurements, &frame.vehicle);
        }
    });
    assert_eq!(allocated.count_total, 0);
}
