//! The sensors: their noises from differences that a smooth motion does not pass, and their biases as the flight computer's
//! filter has them.

use flight::computer::FRAME_S;
use flight::estimation::estimator::GRAVITY_M_S2;
use nalgebra::Vector3;

use super::Parameter;
use super::along::{fall_and_burn, falling, follows};
use super::trace::{Frame, Trace};

/// Fewer differences than this leave a noise uncertain by a third.
const FEWEST: usize = 20;

/// Squares of differences of some order.
#[derive(Debug, Clone, Default)]
struct Differences(Vec<f64>);

impl Differences {
    /// Adds the third differences of a series without gaps. Each has 20 times the variance of a sample.
    fn thirds(&mut self, values: &[f64]) {
        let thirds = values.windows(4).map(|four| four[3] - 3.0 * four[2] + 3.0 * four[1] - four[0]);
        self.0.extend(thirds.map(|third| third * third));
    }

    /// Standard deviation of a sample, and that of this estimate. Neighbouring third differences are correlated by -15/20,
    /// 6/20 and -1/20, so that `n` of them are worth `n / (1 + 2 (0.5625 + 0.09 + 0.0025)) = n / 2.31`.
    fn sigma(&self) -> Option<(f64, f64)> {
        /// Squares of more than five deviations are outliers: reflections, grass, dust. Noise has one in two million.
        const MOST: f64 = 25.0;
        let mut squares = self.0.clone();
        squares.sort_by(f64::total_cmp);
        // The median of the squares of normal numbers is 0.4549 of their mean.
        let median = squares.get(squares.len() / 2).copied()?;
        if median > 0.0 {
            squares.retain(|square| *square < MOST / 0.454_936 * median);
        }
        if squares.len() < FEWEST {
            return None;
        }
        let count = squares.len() as f64;
        let sigma = libm::sqrt(squares.iter().sum::<f64>() / (20.0 * count));
        let freedom = count / 2.31;
        (sigma > 0.0).then(|| (sigma, sigma / libm::sqrt(2.0 * freedom)))
    }
}

/// Splits frames where one is missing.
fn unbroken(frames: &[Frame]) -> impl Iterator<Item = &[Frame]> {
    frames.chunk_by(follows)
}

/// The noises of a flight's sensors.
pub(super) fn noises(trace: &Trace) -> Vec<Parameter> {
    let (fall, burn) = fall_and_burn(trace);
    let mut found = Vec::new();
    let root_hz = libm::sqrt(FRAME_S);
    let milli_g = 1e-3 * GRAVITY_M_S2;
    let gyro: fn(&Frame) -> Vector3<f64> = |frame| frame.measured.imu.gyro_rad_s;
    let force: fn(&Frame) -> Vector3<f64> = |frame| frame.measured.imu.specific_force_m_s2;
    let to_deg = 1.0_f64.to_degrees();
    for (name, frames, of, unit, scale) in [
        ("gyro_noise", fall, gyro, "deg/s/sqrt(Hz)", to_deg * root_hz),
        ("accelerometer_noise", fall, force, "mg/sqrt(Hz)", root_hz / milli_g),
        ("burning_gyro_noise", burn, gyro, "deg/s/sqrt(Hz)", to_deg * root_hz),
        ("burning_accelerometer_noise", burn, force, "mg/sqrt(Hz)", root_hz / milli_g),
    ] {
        let mut differences = Differences::default();
        for part in unbroken(frames) {
            for axis in 0..3 {
                differences.thirds(&part.iter().map(|frame| of(frame)[axis]).collect::<Vec<_>>());
            }
        }
        found.extend(noise(name, unit, scale, &differences));
    }
    found.extend(of_slow_sensors(falling(trace)));
    found
}

/// The biases, as the flight computer has them when the motor is lit.
pub(super) fn biases(trace: &Trace) -> Vec<Parameter> {
    let (fall, burn) = fall_and_burn(trace);
    let Some(Frame { estimate, .. }) = fall.last().or(burn.last()) else { return Vec::new() };
    let sigmas = &estimate.sigmas;
    let mut found = Vec::new();
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let [value, sigma] =
            [estimate.gyro_bias_rad_s, sigmas.gyro_bias_rad_s].map(|of| of[axis].to_degrees());
        found.push(Parameter::normal(&format!("gyro_bias_{name}"), "deg/s", value, sigma));
    }
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let [value, sigma] = [estimate.accelerometer_bias_m_s2, sigmas.accelerometer_bias_m_s2]
            .map(|of| of[axis] / (1e-3 * GRAVITY_M_S2));
        found.push(Parameter::normal(&format!("accelerometer_bias_{name}"), "mg", value, sigma));
    }
    found
}

/// What third differences count as noise and is none: the fins' steps in the inertial unit's samples, and what a satellite
/// position wanders between its fixes (1.5 m in 200 s is 0.07 m in a fifth of a second, which adds 1.7 % to 0.2 m).
const NO_NOISE_SHARE: f64 = 0.01;

fn noise(name: &str, unit: &'static str, scale: f64, differences: &Differences) -> Option<Parameter> {
    let (sigma, uncertain) = differences.sigma()?;
    let uncertain = libm::hypot(uncertain, NO_NOISE_SHARE * sigma);
    Some(Parameter::normal(name, unit, scale * sigma, scale * uncertain))
}

/// Barometer, satellite receiver and lidar against the motion that the inertial unit integrates between their samples.
fn of_slow_sensors(frames: &[Frame]) -> Vec<Parameter> {
    let [mut barometer, mut speed, mut level, mut height, mut lidar] = <[Differences; 5]>::default();
    for part in unbroken(frames) {
        let path = integrated(part);
        let mut series: [Vec<f64>; 8] = Default::default();
        let mut range: Vec<(usize, f64)> = Vec::new();
        for (place, (frame, (_, position))) in part.iter().zip(&path).enumerate() {
            if let Some(altitude_m) = frame.measured.pressure_altitude_m.filter(|value| value.is_finite()) {
                series[0].push(altitude_m - position.z);
            }
            if let Some(range_m) = frame.measured.lidar_range_m.filter(|value| value.is_finite()) {
                range.push((place, range_m));
            }
            if let Some(fix) = &frame.measured.gnss {
                let back = libm::round((frame.time_s - fix.valid_at_s) / FRAME_S);
                let at = if back >= 0.0 { place.checked_sub(back as usize) } else { None };
                let Some((then_m_s, then_m)) = at.map(|at| path[at]) else { continue };
                // A fix lies up to half a frame from the path's nearest point.
                let part_s = frame.time_s - back * FRAME_S - fix.valid_at_s;
                let acceleration = frame_acceleration(part, at.unwrap_or(place));
                let missed_m_s = fix.velocity_m_s - then_m_s + acceleration * part_s;
                let missed_m = fix.position_m - then_m + then_m_s * part_s;
                for axis in 0..3 {
                    series[1 + axis].push(missed_m_s[axis]);
                    series[4 + axis].push(missed_m[axis]);
                }
            }
        }
        barometer.thirds(&series[0]);
        (1..4).for_each(|axis| speed.thirds(&series[axis]));
        (4..6).for_each(|axis| level.thirds(&series[axis]));
        height.thirds(&series[6]);
        for run in range.chunk_by(|one, two| two.0 - one.0 <= 2) {
            lidar.thirds(&run.iter().map(|(_, range_m)| *range_m).collect::<Vec<_>>());
        }
    }
    [
        ("barometer_noise", "m", barometer),
        ("gnss_velocity_noise", "m/s", speed),
        ("gnss_horizontal_noise", "m", level),
        ("gnss_vertical_noise", "m", height),
        ("lidar_noise", "m", lidar),
    ]
    .into_iter()
    .filter_map(|(name, unit, differences)| noise(name, unit, 1.0, &differences))
    .collect()
}

fn frame_acceleration(part: &[Frame], place: usize) -> Vector3<f64> {
    part.get(place).map_or_else(Vector3::zeros, |frame| {
        frame.estimate.state.world_from_body * frame.force_m_s2() - Vector3::z() * GRAVITY_M_S2
    })
}

/// Velocity and position at the end of each frame from the inertial unit alone, along the estimated attitude.
fn integrated(part: &[Frame]) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let Some(first) = part.first() else { return Vec::new() };
    let (mut velocity, mut position) = (first.estimate.state.velocity_m_s, first.estimate.state.position_m);
    let path = (0..part.len()).map(|place| {
        if place > 0 {
            let acceleration = frame_acceleration(part, place);
            position += (velocity + 0.5 * acceleration * FRAME_S) * FRAME_S;
            velocity += acceleration * FRAME_S;
        }
        (velocity, position)
    });
    path.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A parabola has no third difference; a single 1 in zeros has 1, 3, 3 and 1, with squares of 20.
    #[test]
    fn val_hand_third_differences() {
        let mut differences = Differences::default();
        differences.thirds(&(0..40).map(|k| f64::from(k * k) * 0.3 - 2.0).collect::<Vec<_>>());
        assert!(differences.0.iter().sum::<f64>() < 1e-20 && differences.0.len() == 37);
        let mut series = vec![0.0; 43];
        series[20] = 1.0;
        let mut differences = Differences::default();
        differences.thirds(&series);
        let (sigma, _) = differences.sigma().unwrap();
        assert!((sigma - libm::sqrt(1.0 / 40.0)).abs() < 1e-12, "{sigma}");
    }
}
