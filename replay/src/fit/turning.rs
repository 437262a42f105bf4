//! Across the nose while the motor burns: how late and how far the gimbal follows its commands, and
//! where it points when it is commanded to point along the axis.
//!
//! `I q' = -T l sin(g p + p0) + air + rest`, with the thrust `T` that was found along the nose, the
//! arm `l` and the inertia `I` of the data, the servo's angle `p`, and a rest that wanders (gusts,
//! what the exhaust does to the fins). The pilot's commands answer to that rest, so it has to be a
//! part of the model: treated as noise without memory it would pass for an effect of the commands
//! (L. Ljung, System Identification, 2nd edition, section 13.4).
//!
//! Inertia and gimbal gain cannot be separated, nor a centre of gravity off the axis and a
//! misaligned nozzle: gain and misalignment are those of the sum.

use flight::computer::FRAME_S;
use flight::vehicle::airframe::Airframe;
use flight::vehicle::fins::ROLL;
use nalgebra::{Matrix2, Vector2, Vector3};

use super::along::{Along, BLOCK, FINS, IMPULSE, falling, follows, white_variance};
use super::least_squares::{NoiseStep, Prior, Solution, Whitener, inflate, lowest, solve_from};
use super::servo::{PARTS, ServoModel};
use super::trace::Trace;

pub(super) const DELAY: usize = 0;
pub(super) const RATE: usize = 1;
pub(super) const GAIN: usize = 2;
pub(super) const PITCH: usize = 3;
pub(super) const YAW: usize = 4;
pub(super) const PLAY: usize = 5;
/// Play behind the servo, which its feedback does not see.
const LINK: usize = 6;

/// Noise of a feedback potentiometer, rad: a tenth of a degree.
const FEEDBACK_RAD: f64 = 0.001_745;
/// Fewer frames of burn (half a second) determine nothing.
const FEWEST_FRAMES: usize = 100;
/// The frames before the thrust in which the servo may already move.
const LEAD_FRAMES: usize = 60;
/// The frames before those whose commands move the model to where the servo is: the gimbal swings
/// in the fall. Longer than any delay of a servo.
const SETTLING_FRAMES: usize = 40;
/// Factors on the deviations of delay, gain and offsets. The rest is estimated from the residuals.
/// The fit has already taken a part of the rest out of them, so the deviations are too small (R. N.
/// Kackar and D. A. Harville, Journal of the American Statistical Association 79, 1984). By how
/// much was measured: without these factors the 95 % intervals hold the truth in 92, 91 and 88 % of
/// 600 `field` flights of seed 5, with them in 95 %.
const LACKING: [(usize, f64); 4] = [(DELAY, 1.12), (GAIN, 1.23), (PITCH, 1.45), (YAW, 1.45)];
/// Printed linkages have half a degree to a degree of play behind the servo.
pub(super) const LINK_RAD: f64 = 0.017_453;
/// A servo's feedback that is further off its model (rms), rad, is of a servo that does not follow:
/// half a degree, five times the noise of a potentiometer.
const FOLLOWS_RAD: f64 = 0.008_727;
const NOT_SOLVED: &str = "the model of the gimbal does not fit the rotation";

/// Play of servo and linkage together, and its standard deviation, rad.
pub(super) fn play_rad(Solution { values, covariance, .. }: &Solution) -> (f64, f64) {
    let variance = covariance[(PLAY, PLAY)] + covariance[(LINK, LINK)] + 2.0 * covariance[(PLAY, LINK)];
    (values[PLAY].max(0.0) + values[LINK].max(0.0), libm::sqrt(variance))
}

/// A frame of the burn.
struct Sample {
    measured_rad_s: [f64; 2],
    /// Angular acceleration about body y and z that the gimbal does not cause, rad/s^2.
    other_rad_s2: [f64; 2],
    /// Angular acceleration of a unit sine of the gimbal's angle, rad/s^2.
    by_gimbal_rad_s2: f64,
    /// Rate by which the body turns back for each rad/s of the gimbal.
    turned_back: f64,
    burning: bool,
    begins: bool,
}

/// Fits the gimbal over the burn; an error is the reason why it cannot be.
pub(super) fn fit_turning(trace: &Trace, along: &Along) -> Result<Solution, String> {
    along.burn_seen_s.clone()?;
    let begins_s = along.begins_s().ok_or("the motor was not ignited")?;
    let frames = falling(trace);
    let ignited = frames.partition_point(|frame| frame.time_s < begins_s);
    let first = ignited.saturating_sub(LEAD_FRAMES).max(1);
    if frames.len() < ignited + FEWEST_FRAMES {
        return Err("less than half a second of burn was recorded".to_owned());
    }
    let settles = first.saturating_sub(SETTLING_FRAMES).max(1);
    if !frames[settles - 1..].windows(2).all(|pair| follows(&pair[0], &pair[1])) {
        return Err(
            "frames of the burn are lost, and with them the commands that the gimbal followed".to_owned()
        );
    }
    let samples = samples(trace, along, first, begins_s);
    let commands_rad: [Vec<f64>; 2] =
        [0, 1].map(|axis: usize| frames[settles..].iter().map(|frame| frame.gimbal_rad[axis]).collect());
    let reported_rad: Vec<[f64; 2]> = frames[first..].iter().map(|frame| frame.gimbal_reported_rad).collect();
    let gimbal = &trace.mission.airframe.gimbal;
    let servo = &gimbal.servo;
    let priors = [
        Prior { mean: servo.delay_s, sigma: 0.05 },
        // Hobby servos are sold with the rate of an unloaded one: a loaded one may have half of it.
        Prior { mean: servo.rate_rad_s(), sigma: 0.5 * servo.rate_rad_s() },
        Prior { mean: 1.0, sigma: 0.5 },
        Prior { mean: 0.0, sigma: 0.1 },
        Prior { mean: 0.0, sigma: 0.1 },
        // Printed linkages have half a degree to a degree.
        Prior { mean: servo.slop_rad(), sigma: 0.5_f64.to_radians() },
        Prior { mean: 0.5 * LINK_RAD, sigma: LINK_RAD },
    ];
    let model = Model {
        samples: &samples,
        commands_rad: &commands_rad,
        settling: first - settles,
        rests_rad: frames[settles - 1].gimbal_reported_rad,
        limit_rad: gimbal.limit_rad(),
    };
    let felt = |axis: usize| samples.iter().map(|sample| sample.measured_rad_s[axis]).collect::<Vec<_>>();
    let white = [0, 1].map(|axis| white_variance(&felt(axis)).unwrap_or(1e-6));
    let white = 0.5 * (white[0] + white[1]);
    let mut values: Vec<f64> = priors.iter().map(|prior| prior.mean).collect();
    let mut rest = Rest { sigma_rad_s2: 1.0, lasts_s: 0.3, rough: 0.01 };
    let whitened = |rest: Rest| {
        let (model, reported_rad) = (&model, &reported_rad);
        let whitener = rest.whitener(&samples, white);
        move |values: &[f64]| {
            let [pitch, yaw] = model.missed(values);
            let mut all = whitener.apply(&pitch);
            all.extend(whitener.apply(&yaw));
            all.extend(model.feedback(values, reported_rad));
            all
        }
    };
    for _ in 0..2 {
        let found = solve_from(&values, &priors, whitened(rest)).ok_or(NOT_SOLVED)?;
        values = found.values;
        rest = rest.most_likely(&samples, white, &model.missed(&values));
    }
    let mut solution = solve_from(&values, &priors, whitened(rest)).ok_or(NOT_SOLVED)?;
    model.is_a_servo(&solution.values, &reported_rad)?;
    inflate(&mut solution, whitened(rest), BLOCK);
    for (place, wider) in LACKING {
        solution.covariance.row_mut(place).scale_mut(wider);
        solution.covariance.column_mut(place).scale_mut(wider);
    }
    // The gain is that of thrust times arm over inertia, and the thrust has its own error.
    let of_thrust = along.solution.covariance[(IMPULSE, IMPULSE)]
        / (along.solution.values[IMPULSE] * along.solution.values[IMPULSE]);
    solution.covariance[(GAIN, GAIN)] += of_thrust * solution.values[GAIN] * solution.values[GAIN];
    Ok(solution)
}

/// The process of the rotation that the model does not explain.
#[derive(Clone, Copy)]
struct Rest {
    sigma_rad_s2: f64,
    lasts_s: f64,
    /// Density of what has no memory, rad/s^2/sqrt(Hz).
    rough: f64,
}

/// The process with another number.
type WithNumber = fn(Rest, f64) -> Rest;

impl Rest {
    fn whitener(&self, samples: &[Sample], white: f64) -> Whitener {
        let kept = libm::exp(-FRAME_S / self.lasts_s);
        let variance = self.sigma_rad_s2 * self.sigma_rad_s2;
        let steps = samples.iter().map(|sample| NoiseStep {
            transition: Matrix2::new(1.0, FRAME_S, 0.0, kept),
            process: Matrix2::new(
                self.rough * self.rough * FRAME_S,
                0.0,
                0.0,
                variance * (1.0 - kept * kept),
            ),
            // The rate at the beginning, and the gyro's bias with it, is free.
            begins: sample.begins.then(|| Matrix2::new(1.0, 0.0, 0.0, variance)),
            // The gyro has the mean over the frame.
            seen: Vector2::new(1.0, -0.5 * FRAME_S),
            white,
        });
        Whitener::new(steps)
    }

    /// The most likely process for these residuals, each number in turn.
    fn most_likely(self, samples: &[Sample], white: f64, missed: &[Vec<f64>; 2]) -> Self {
        let surprise = |rest: Self| {
            let whitener = rest.whitener(samples, white);
            missed.iter().map(|axis| whitener.surprise(axis)).sum::<f64>()
        };
        let numbers: [(f64, f64, WithNumber); 3] = [
            (0.01, 30.0, |rest, sigma_rad_s2| Self { sigma_rad_s2, ..rest }),
            (0.02, 5.0, |rest, lasts_s| Self { lasts_s, ..rest }),
            (1e-4, 1.0, |rest, rough| Self { rough, ..rest }),
        ];
        numbers.repeat(2).into_iter().fold(self, |rest, (from, to, with)| {
            let found = |logarithm: f64| with(rest, libm::exp(logarithm));
            found(lowest(libm::log(from), libm::log(to), 14, |logarithm| surprise(found(logarithm))))
        })
    }
}

struct Model<'a> {
    samples: &'a [Sample],
    /// Of the settling frames, too.
    commands_rad: &'a [Vec<f64>; 2],
    settling: usize,
    /// Where the servos are before them, rad.
    rests_rad: [f64; 2],
    limit_rad: f64,
}

impl Model<'_> {
    fn angles_rad(&self, values: &[f64], axis: usize) -> Vec<([f64; PARTS], f64)> {
        let servo = ServoModel {
            delay_s: values[DELAY],
            rate_rad_s: values[RATE],
            play_rad: values[PLAY],
            limit_rad: self.limit_rad,
        };
        servo.angles_rad(self.rests_rad[axis], &self.commands_rad[axis], FRAME_S)
    }

    /// The gyro's samples about y and z less the model's.
    fn missed(&self, values: &[f64]) -> [Vec<f64>; 2] {
        let both = [0, 1].map(|axis| self.angles_rad(values, axis));
        [0, 1].map(|axis| {
            let offset_rad = values[[PITCH, YAW][axis]];
            let part_s = FRAME_S / PARTS as f64;
            let half_rad = 0.5 * values[LINK].max(0.0);
            let dragged_rad = |nozzle_rad: f64, angle_rad: f64| {
                let driven_rad = values[GAIN] * angle_rad;
                nozzle_rad.clamp(driven_rad - half_rad, driven_rad + half_rad)
            };
            let (settling, flown) = both[axis].split_at(self.settling);
            let rests_rad = values[GAIN] * self.rests_rad[axis];
            let mut nozzle_rad =
                settling.iter().flat_map(|(parts, _)| parts).copied().fold(rests_rad, dragged_rad);
            let mut rate_rad_s = 0.0;
            let missed = self.samples.iter().zip(flown).enumerate().map(|(place, (sample, (parts, _)))| {
                // The thrust turns about the pitch axis inside what the yaw axis leaves.
                let left = if axis == 0 { libm::cos(both[1][self.settling + place].1) } else { 1.0 };
                let mut mean_rad_s = 0.0;
                for angle_rad in parts {
                    let before_rad = nozzle_rad;
                    nozzle_rad = dragged_rad(nozzle_rad, *angle_rad);
                    let turn = if sample.burning {
                        -sample.by_gimbal_rad_s2 * left * libm::sin(nozzle_rad + offset_rad)
                    } else {
                        0.0
                    };
                    let by_rad_s = (turn + sample.other_rad_s2[axis]) * part_s;
                    rate_rad_s += by_rad_s;
                    // As the simulated unit, which adds up the rates at the end of each
                    // millisecond.
                    let turned_back_rad_s = sample.turned_back * (nozzle_rad - before_rad) / part_s;
                    mean_rad_s += (rate_rad_s - turned_back_rad_s) / PARTS as f64;
                }
                sample.measured_rad_s[axis] - mean_rad_s
            });
            missed.collect()
        })
    }

    /// The servos' own feedback less the model's, whitened.
    fn feedback(&self, values: &[f64], reported_rad: &[[f64; 2]]) -> Vec<f64> {
        let of_axis = |axis: usize| {
            let ends = self.angles_rad(values, axis).into_iter().skip(self.settling);
            let missed = reported_rad.iter().zip(ends);
            missed.map(move |(reported_rad, (_, end_rad))| (reported_rad[axis] - end_rad) / FEEDBACK_RAD)
        };
        of_axis(0).chain(of_axis(1)).collect()
    }

    /// Whether the feedback is that of a servo that follows these commands; an error says by how
    /// much it is not.
    fn is_a_servo(&self, values: &[f64], reported_rad: &[[f64; 2]]) -> Result<(), String> {
        let missed = self.feedback(values, reported_rad);
        let squares = missed.iter().map(|whitened| whitened * whitened).sum::<f64>();
        let rms_rad = FEEDBACK_RAD * libm::sqrt(squares / missed.len() as f64);
        if rms_rad < FOLLOWS_RAD {
            return Ok(());
        }
        Err(format!(
            "the gimbal is not its model: with any delay, rate and play its feedback stays {:.1} deg (rms) off what its \
             commands would give",
            rms_rad.to_degrees()
        ))
    }
}

fn samples(trace: &Trace, along: &Along, first: usize, begins_s: f64) -> Vec<Sample> {
    let mission = &trace.mission;
    let airframe = &mission.airframe;
    let curve = &mission.motor_curve;
    let mass_model = trace.mass_model();
    let burn = along.burn(trace);
    let flow_kg_n_s = curve.propellant_mass_kg() / (curve.total_impulse_n_s() * burn.impulse_scale);
    let frames = falling(trace);
    let pairs = frames[first - 1..].windows(2).enumerate();
    let samples = pairs.map(|(place, pair)| {
        let (before, frame) = (&pair[0], &pair[1]);
        let to_s = frame.time_s - begins_s;
        let burning = to_s > -0.5 * burn.rise_s;
        let thrust_n = if burning { burn.mean_n(to_s - FRAME_S, to_s) } else { 0.0 };
        let burnt_kg = if burning { burn.burnt_kg(to_s - 0.5 * FRAME_S) } else { 0.0 };
        let (mass, motor_kg) = (mass_model.at(burnt_kg), curve.total_mass_kg() - burnt_kg);
        let through_air = 0.5 * (before.through_air_m_s() + frame.through_air_m_s());
        let rate = frame.rate_rad_s();
        let fins_rad = frame.fins_since_rad(before);
        let density = trace.density_kg_m3(frame);
        // What was found along the nose holds for the fins across it, too.
        let air = along.solution.values[FINS]
            * air_moment_n_m(airframe, mass.cg_station_m, density, &through_air, &rate, &fins_rad);
        let inertia = mass.pitch_inertia_kg_m2;
        let exit_m = mass.cg_station_m;
        let damping = thrust_n * flow_kg_n_s * (exit_m * exit_m + mass.pitch_inertia_slope_m2) / inertia;
        let coupling = (inertia - mass.roll_inertia_kg_m2) / inertia * rate.x;
        Sample {
            measured_rad_s: [frame.measured.imu.gyro_rad_s.y, frame.measured.imu.gyro_rad_s.z],
            other_rad_s2: [
                air.y / inertia + coupling * rate.z - damping * rate.y,
                air.z / inertia - coupling * rate.y - damping * rate.z,
            ],
            by_gimbal_rad_s2: thrust_n * airframe.thrust_arm_m(mass.cg_station_m) / inertia,
            turned_back: airframe.swinging_kg_m2(curve, motor_kg, mass.cg_station_m) / inertia,
            burning,
            begins: place == 0,
        }
    });
    samples.collect()
}

/// Strips of the body: with four the damping moment is exact to 2 %.
const STRIPS: usize = 4;

/// Moment about the centre of gravity at a station, m, in body axes, N m, for a velocity through
/// the air in body axes, m/s, a rotation rate, rad/s, and the fins' openings, rad.
pub(super) fn air_moment_n_m(
    airframe: &Airframe,
    cg_station_m: f64,
    density_kg_m3: f64,
    through_air_m_s: &Vector3<f64>,
    rate_rad_s: &Vector3<f64>,
    fins_rad: &[f64; 4],
) -> Vector3<f64> {
    let (body, fins) = (&airframe.body, airframe.fin_model());
    let half = 0.5 * density_kg_m3;
    let strip_m = body.length_m / STRIPS as f64;
    let strip_m2 = body.crossflow_drag_coefficient * body.diameter_m * strip_m;
    let mut moment = Vector3::zeros();
    for strip in 0..STRIPS {
        let place_m = Vector3::new(strip_m * (strip as f64 + 0.5) - cg_station_m, 0.0, 0.0);
        let mut across = through_air_m_s + rate_rad_s.cross(&place_m);
        across.x = 0.0;
        moment += place_m.cross(&(across * (-half * strip_m2 * across.norm())));
    }
    let legs_m = Vector3::new(airframe.legs.drag_station_m - cg_station_m, 0.0, 0.0);
    let local = through_air_m_s + rate_rad_s.cross(&legs_m);
    moment += legs_m.cross(&(local * (-half * airframe.legs.drag_area_m2 * local.norm())));
    for fin in 0..4 {
        let sine = libm::sin(fins_rad[fin]);
        let outward = Vector3::from([0.0, fins.outward(fin)[0], fins.outward(fin)[1]]);
        let mut place_m = outward * fins.radius_m(sine);
        place_m.x += airframe.fins.station_m - cg_station_m;
        let local = through_air_m_s + rate_rad_s.cross(&place_m);
        let open = half * fins.reference_area_m2 * sine * local.norm();
        let force_n = local * (-open * fins.drag_coefficient)
            - local.cross(&outward) * (open * fins.lift_coefficient * ROLL[fin]);
        moment += place_m.cross(&force_n);
    }
    moment
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fins open at 90 degrees on mk2, 30 m/s down the axis and 1 m/s along body y: the four drags
    /// are 1.55 0.0043 0.6 V (30, -1), V = 30.0167, and act 0.23 m ahead of a centre of gravity at
    /// 0.4 m; of the lifts of equal fins, 1.28 0.0043 0.6 V each, a side wind of 1 m/s leaves 4 sin
    /// 30 cos 30 times their radius of 0.087 m. The body has 1.2 0.074 0.7 m^2 in the middle, at
    /// 0.35 m: 0.6 0.06216 1, 0.05 m behind.
    #[test]
    fn val_hand_equal_fins_and_a_side_wind() {
        let mut airframe = flight::vehicles::mission::builtin_airframe("mk2").unwrap();
        airframe.body.reference_area_m2 = 0.0043;
        (airframe.fins.drag_coefficient, airframe.fins.lift_coefficient) = (1.55, 1.28);
        let open = [core::f64::consts::FRAC_PI_2; 4];
        let velocity = Vector3::new(-30.0, 1.0, 0.0);
        let moment = air_moment_n_m(&airframe, 0.4, 1.2, &velocity, &Vector3::zeros(), &open);
        let side_n = -4.0 * 1.55 * 0.0043 * 0.6 * libm::sqrt(901.0);
        let body_n = -0.6 * 0.062_16;
        let lifts_n_m = 1.28 * 0.0043 * 0.6 * libm::sqrt(901.0) * libm::sqrt(3.0) * 0.087;
        assert!((moment.z - (0.23 * side_n - 0.05 * body_n + lifts_n_m)).abs() < 1e-6, "{moment}");
    }

    /// The same side wind, with closed fins, on legs of 0.01 m^2 at 0.1 m, 0.3 m behind the centre
    /// of gravity: 0.6 0.01 V is 0.1801 N against body y. The body's part is that of above.
    #[test]
    fn val_hand_legs_in_a_side_wind() {
        let mut airframe = flight::vehicles::mission::builtin_airframe("mk2").unwrap();
        (airframe.legs.drag_area_m2, airframe.legs.drag_station_m) = (0.01, 0.1);
        let velocity = Vector3::new(-30.0, 1.0, 0.0);
        let moment = air_moment_n_m(&airframe, 0.4, 1.2, &velocity, &Vector3::zeros(), &[0.0; 4]);
        let legs_n = -0.6 * 0.01 * libm::sqrt(901.0);
        let body_n = -0.6 * 0.062_16;
        assert!((moment.z - (-0.3 * legs_n - 0.05 * body_n)).abs() < 1e-9, "{moment}");
    }
}
