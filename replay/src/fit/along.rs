//! Along the nose: drag of body and fins, thrust, burn time, shape of the curve, ignition, and what
//! the exhaust takes away of the drag.
//!
//! The accelerometer measures `f = (T + d_b B + d_f F) / m + bias`, with the air force on the body
//! `B` and on the fins `F` as the airframe's data have them at the estimated speed, and the mass
//! `m` of the data. While the vehicle falls there is no `T`, and the fins' changing openings tell
//! `F` from `B`; then `d_b` and `d_f` are known when the motor is ignited. All is fitted at once,
//! over the fall and the burn.
//!
//! The accelerometer cannot tell a stronger motor from a lighter vehicle: every scale is per mass
//! of the data.
//!
//! The largest error is the wind along the nose, which nothing on board measures: it is a process
//! with the spectrum of vertical gusts (MIL-F-8785C, section 3.7.3.4) and an intensity that the
//! same samples tell.

use flight::computer::FRAME_S;
use flight::estimation::estimator::VehicleNow;
use flight::vehicle::airframe::{MassModel, MassProperties};
use flight::vehicle::mission::LeverArms;
use flight::vehicle::mission::Mission;
use nalgebra::{Matrix2, Vector2};
use sim::world::wind::gusts::GustScales;

use super::burn::{Burn, SHAPE_TERMS, shape_sigmas};
use super::least_squares::{NoiseStep, Prior, Solution, Whitener, inflate, lowest, solve, solve_from};
use super::sound;
use super::trace::{Frame, Trace};

/// The fall counts from this speed on, m/s: a slower vehicle lies across a wind that is not known
/// yet. From 5 m/s on, 4 of 60 `field` flights have an error of the drag of 4 to 13 %, from 15 m/s
/// on one has 6 %.
const SLOWEST_M_S: f64 = 15.0;
const SLOWEST_OF_DROP_M_S: f64 = 5.0;
/// Samples whose residuals may be correlated by errors of the model: a quarter of a second.
pub(super) const BLOCK: usize = 50;
/// Frames before the reported contact that are left out: a switch may be 10 ms late, and the feet
/// push before it.
const FRAMES_BEFORE_CONTACT: usize = 4;
/// Fewer frames of fall (half a second) tell nothing of the drag.
const FEWEST_FRAMES: usize = 100;
/// Standard deviation of an accelerometer's scale: 0.1 % is what hobby units are calibrated to.
/// Nothing on board shows it, and it goes into every scale.
pub(super) const ACCELEROMETER_SCALE_SIGMA: f64 = 0.001;

/// Factor on the deviation of the whole drag. A fall has only a few vertical gusts, so their
/// strength is badly known, too. With this factor the 95 % intervals hold the truth in about 95 %
/// of the 1,100 `field` flights of seeds 5 and 7, without it in 91.6 %.
const DRAG_LACKING: f64 = 1.2;

pub(super) const BODY: usize = 0;
pub(super) const FINS: usize = 1;
pub(super) const BIAS: usize = 2;
pub(super) const IMPULSE: usize = 3;
pub(super) const BURN_TIME: usize = 4;
pub(super) const DELAY: usize = 5;
pub(super) const SHAPE: usize = 6;
pub(super) const BODY_LOSS: usize = SHAPE + SHAPE_TERMS;
pub(super) const FIN_LOSS: usize = BODY_LOSS + 1;
const RISE: usize = FIN_LOSS + 1;

/// A frame of the fall or the burn.
#[derive(Debug, Clone, Copy)]
struct Sample {
    end_s: f64,
    measured_m_s2: f64,
    /// Air force along the nose on body and fins by the airframe's data, N.
    body_n: f64,
    fins_n: f64,
    /// Air force along the nose for a metre per second of wind upwards, N s/m.
    by_updraught: f64,
    /// Way through the air since the frame before, as a fraction of the length of vertical gusts;
    /// `None` after a gap.
    way: Option<f64>,
    /// The cosine of the angle between thrust and nose.
    thrust_along: f64,
}

/// What was found along the nose.
#[derive(Debug, Clone)]
pub(super) struct Along {
    pub(super) solution: Solution,
    /// Fraction of the air force that is the body's, on average over the fall.
    pub(super) body_share: f64,
    /// Standard deviation of the wind along the vertical, m/s.
    pub(super) updraught_m_s: f64,
    /// When the igniter was fired, s.
    pub(super) commanded_s: Option<f64>,
    /// How long the thrust was seen, s, or why nothing is known of it.
    pub(super) burn_seen_s: Result<f64, String>,
    /// Standard deviation of the estimated speed over the speed, which counts twice in the drag.
    speed_share: f64,
}

impl Along {
    pub(super) fn begins_s(&self) -> Option<f64> {
        // Without thrust the fit has no burn to find it in.
        let delay_s = self.solution.values.get(DELAY)?;
        Some(self.commanded_s? + delay_s)
    }

    /// Drag of body and fins together, as they were opened in this fall, over that of the data, and
    /// its standard deviation.
    pub(super) fn drag(&self) -> (f64, f64) {
        let shares = [self.body_share, 1.0 - self.body_share];
        let total: f64 = (0..2).map(|place| shares[place] * self.solution.values[place]).sum();
        let variance: f64 = (0..2)
            .flat_map(|row| (0..2).map(move |column| (row, column)))
            .map(|(row, column)| shares[row] * shares[column] * self.solution.covariance[(row, column)])
            .sum();
        let variance = variance * DRAG_LACKING * DRAG_LACKING;
        let of_speed = 2.0 * self.speed_share * total;
        let of_scale = ACCELEROMETER_SCALE_SIGMA * total;
        (total, libm::sqrt(variance + of_speed * of_speed + of_scale * of_scale))
    }

    pub(super) fn burn<'a>(&self, trace: &'a Trace) -> Burn<'a> {
        burn_of(trace, &self.solution.values)
    }
}

fn burn_of<'a>(trace: &'a Trace, values: &[f64]) -> Burn<'a> {
    Burn {
        curve: &trace.mission.motor_curve,
        impulse_scale: values[IMPULSE],
        // A trial of the iteration may be far off.
        burn_time_scale: values[BURN_TIME].max(0.2),
        rise_s: values[RISE].max(0.0),
        shape: core::array::from_fn(|k| values[SHAPE + k]),
    }
}

/// The frames of the fall and the burn: from the first fast one after apogee until the contact. A
/// vehicle that is dropped and ignited soon counts from a lower speed on.
pub(super) fn falling(trace: &Trace) -> &[Frame] {
    let from = |speed_m_s: f64| -> &[Frame] {
        let falls = |frame: &Frame| {
            !frame.phase.before_apogee() && !frame.parachute && !frame.booster_attached && !frame.contact
        };
        let fast = |frame: &Frame| falls(frame) && frame.estimate.state.velocity_m_s.norm() > speed_m_s;
        let frames = &trace.frames;
        let Some(first) = frames.iter().position(fast) else { return &[] };
        let length = frames[first..].iter().take_while(|frame| falls(frame)).count();
        &frames[first..first + length.saturating_sub(FRAMES_BEFORE_CONTACT)]
    };
    let lit_s = commanded_s(trace).unwrap_or(f64::INFINITY);
    let fast = from(SLOWEST_M_S);
    let long = fast.get(FEWEST_FRAMES).is_some_and(|frame| frame.time_s <= lit_s);
    if long { fast } else { from(SLOWEST_OF_DROP_M_S) }
}

/// When the igniter was fired, s.
pub(super) fn commanded_s(trace: &Trace) -> Option<f64> {
    trace.frames.iter().find(|frame| frame.ignite && !frame.booster_attached).map(|frame| frame.time_s)
}

/// The frames of the fall, and those from the igniter's firing on.
pub(super) fn fall_and_burn(trace: &Trace) -> (&[Frame], &[Frame]) {
    let lit_s = commanded_s(trace).unwrap_or(f64::INFINITY);
    let frames = falling(trace);
    frames.split_at(frames.partition_point(|frame| frame.time_s <= lit_s))
}

/// Whether a frame follows another without a gap.
pub(super) fn follows(before: &Frame, frame: &Frame) -> bool {
    frame.time_s - before.time_s < 1.5 * FRAME_S
}

fn samples(
    trace: &Trace,
    mass: &MassProperties,
    frames: &[Frame],
    thrust_along: &dyn Fn(f64) -> f64,
) -> Vec<Sample> {
    let pairs = frames.first().map(|first| (first, first)).into_iter();
    let pairs = pairs.chain(frames.windows(2).map(|pair| (&pair[0], &pair[1])));
    let sampled = pairs.map(|(before, frame)| {
        let near = follows(before, frame) && before.time_s < frame.time_s;
        let before = if near { before } else { frame };
        let through_air = 0.5 * (before.through_air_m_s() + frame.through_air_m_s());
        let state = &frame.estimate.state;
        let fins_rad = frame.fins_since_rad(before);
        let density = trace.density_kg_m3(frame);
        let vehicle =
            VehicleNow::of(&trace.mission.airframe, mass, density, fins_rad, false, LeverArms::default());
        let body = VehicleNow { fin_drag_area_m2: 0.0, fin_lift_area_m2: Vector2::zeros(), ..vehicle };
        let fins =
            VehicleNow { body_drag_area_m2: 0.0, leg_drag_area_m2: 0.0, crossflow_area_m2: 0.0, ..vehicle };
        let rate = frame.rate_rad_s();
        let up = state.world_from_body.inverse_transform_vector(&nalgebra::Vector3::z());
        let in_updraught = |m_s: f64| vehicle.air_force_n(&(through_air - up * m_s), &rate).x;
        Sample {
            end_s: frame.time_s,
            measured_m_s2: frame.measured.imu.specific_force_m_s2.x,
            body_n: body.air_force_n(&through_air, &rate).x,
            fins_n: fins.air_force_n(&through_air, &rate).x,
            by_updraught: 0.5 * (in_updraught(1.0) - in_updraught(-1.0)),
            // The length does not depend on the wind.
            way: near
                .then(|| through_air.norm() * FRAME_S / GustScales::at(state.position_m.z, 0.0).vertical_m),
            thrust_along: thrust_along(frame.time_s),
        }
    });
    sampled.collect()
}

/// Vertical gusts of unit intensity: two equal lags in a row, over a fraction of the length.
pub(super) fn gust_step(way: Option<f64>, by_gust: f64, white: f64) -> NoiseStep {
    const ROOT_3: f64 = 1.732_050_807_568_877_2;
    let stationary = Matrix2::new(0.5, 0.25, 0.25, 0.25);
    let share = way.unwrap_or(0.0);
    let decay = libm::exp(-share);
    let transition = Matrix2::new(decay, 0.0, decay * share, decay);
    NoiseStep {
        transition,
        process: stationary - transition * stationary * transition.transpose(),
        begins: way.is_none().then_some(stationary),
        seen: Vector2::new(ROOT_3, 1.0 - ROOT_3) * by_gust,
        white,
    }
}

/// Variance of the noise of each sample from the third differences of the series, which hardly see
/// a smooth motion: that of a difference is 20 times that of a sample.
pub(super) fn white_variance(values: &[f64]) -> Option<f64> {
    let thirds: Vec<f64> =
        values.windows(4).map(|four| four[3] - 3.0 * four[2] + 3.0 * four[1] - four[0]).collect();
    if thirds.is_empty() {
        return None;
    }
    // Steps of fins and igniter are outliers: the median of the squares is 0.4549 of the variance
    // of normal numbers.
    let mut squares: Vec<f64> = thirds.iter().map(|third| third * third).collect();
    squares.sort_by(f64::total_cmp);
    let median = squares[squares.len() / 2];
    (median > 0.0).then_some(median / (0.454_936 * 20.0))
}

/// The samples with what the fits of them share.
struct Series<'a> {
    trace: &'a Trace,
    frames: &'a [Frame],
    samples: Vec<Sample>,
    /// How many of them are before the igniter was fired.
    fallen: usize,
    commanded_s: Option<f64>,
    mass_model: MassModel,
    loaded_kg: f64,
    /// Variances of the accelerometer's noise in fall and burn.
    quiet: f64,
    shaken: f64,
}

impl<'a> Series<'a> {
    fn new(trace: &'a Trace, thrust_along: &dyn Fn(f64) -> f64) -> Result<Self, &'static str> {
        let commanded_s = commanded_s(trace);
        let frames = falling(trace);
        let mass_model = trace.mass_model();
        let loaded = mass_model.at(0.0);
        let samples = samples(trace, &loaded, frames, thrust_along);
        let fallen = samples.partition_point(|sample| commanded_s.is_none_or(|at_s| sample.end_s <= at_s));
        if fallen < FEWEST_FRAMES {
            return Err("the flight has less than half a second of free fall");
        }
        let felt = |samples: &[Sample]| samples.iter().map(|sample| sample.measured_m_s2).collect::<Vec<_>>();
        let quiet =
            white_variance(&felt(&samples[..fallen])).ok_or("the accelerometer's samples do not change")?;
        let shaken = white_variance(&felt(&samples[fallen..])).unwrap_or(quiet).max(quiet);
        let loaded_kg = loaded.mass_kg;
        Ok(Self { trace, frames, samples, fallen, commanded_s, mass_model, loaded_kg, quiet, shaken })
    }

    fn fall(&self) -> &[Sample] {
        &self.samples[..self.fallen]
    }

    /// The noises of the first samples in gusts of an intensity, m/s.
    fn noises(&self, count: usize, updraught_m_s: f64) -> Whitener {
        let steps: Vec<NoiseStep> = self.samples[..count]
            .iter()
            .enumerate()
            .map(|(place, sample)| {
                let by_gust = sample.by_updraught * updraught_m_s / self.loaded_kg;
                let white = if place < self.fallen { self.quiet } else { self.shaken };
                gust_step(sample.way.filter(|_| place > 0), by_gust, white)
            })
            .collect();
        Whitener::new(steps.into_iter())
    }

    /// What the drag leaves of the fall's samples.
    fn missed_in_fall(&self, values: &[f64]) -> Vec<f64> {
        let missed = self.fall().iter().map(|sample| {
            let air_n = values[BODY] * sample.body_n + values[FINS] * sample.fins_n;
            sample.measured_m_s2 - values[BIAS] - air_n / self.loaded_kg
        });
        missed.collect()
    }

    /// What drag and thrust leave of all samples.
    fn missed(&self, values: &[f64]) -> Vec<f64> {
        let burn = burn_of(self.trace, values);
        let begins_s = self.commanded_s.unwrap_or(f64::INFINITY) + values[DELAY];
        let missed = self.samples.iter().map(|sample| {
            let to_s = sample.end_s - begins_s;
            let (mut thrust_n, mut mass_kg) = (0.0, self.loaded_kg);
            // The part of the frame in which the motor burns: a whole frame's loss would be a step
            // over the delay, and would hold the delay on the grid of the frames.
            let burning = ((to_s + 0.5 * burn.rise_s) / FRAME_S).clamp(0.0, 1.0);
            if burning > 0.0 {
                thrust_n = burn.mean_n(to_s - FRAME_S, to_s);
                mass_kg = self.mass_model.at(burn.burnt_kg(to_s - 0.5 * FRAME_S)).mass_kg;
            }
            // After the burn-out there is no jet.
            let jet = if thrust_n > 0.0 { burning } else { 0.0 };
            let [body, fins] = [BODY_LOSS, FIN_LOSS].map(|place| 1.0 - jet * values[place]);
            let air_n = values[BODY] * body * sample.body_n + values[FINS] * fins * sample.fins_n;
            sample.measured_m_s2 - values[BIAS] - (thrust_n * sample.thrust_along + air_n) / mass_kg
        });
        missed.collect()
    }

    /// The most likely intensity of the gusts, m/s, with the drag's uncertainty integrated out.
    fn updraught_m_s(&self, of_fall: &[Prior]) -> f64 {
        let surprise = |logarithm: f64| {
            let whitener = self.noises(self.fallen, libm::exp(logarithm));
            let Some(found) = solve(of_fall, |values| whitener.apply(&self.missed_in_fall(values))) else {
                return f64::INFINITY;
            };
            let uncertain = found.covariance.determinant();
            whitener.surprise(&self.missed_in_fall(&found.values))
                - libm::log(uncertain.max(f64::MIN_POSITIVE))
        };
        libm::exp(lowest(libm::log(0.02), libm::log(4.0), 14, surprise))
    }

    /// Fits the fall and the burn together; an error is the reason why the burn determines nothing.
    fn burn(
        &self,
        commanded_s: f64,
        mut priors: Vec<Prior>,
        updraught_m_s: f64,
    ) -> Result<(Solution, f64), String> {
        let mission = &self.trace.mission;
        let lit_s = thrust_seen_s(&self.samples[self.fallen..], commanded_s, self.loaded_kg, mission)
            .ok_or("no thrust was seen after the igniter was fired")?;
        priors.extend([WIDE, WIDE, Prior { mean: mission.ignition.delay_s, sigma: 0.2 }]);
        // A mission that trusts its curve still gets one of the catalogue: 2 % of shape remain
        // after a club's own burn.
        let rms = if mission.motor.shape_sigma > 0.0 { mission.motor.shape_sigma } else { 0.02 };
        priors.extend(shape_sigmas(rms).map(|sigma| Prior { mean: 0.0, sigma }));
        // No data exist for a jet against the wind, and what a mission flies by is chosen to be
        // safe: the body may lose anything between nothing and all, and the fins, which sit outside
        // the jet, between -2 and 12 %.
        priors.push(Prior { mean: 0.5, sigma: 0.3 });
        priors.push(Prior { mean: 0.05, sigma: 0.05 });
        // Composite propellant comes up within a tenth of a second.
        priors.push(Prior { mean: 0.0, sigma: 0.05 });
        let whitener = self.noises(self.samples.len(), updraught_m_s);
        let residuals = |values: &[f64]| whitener.apply(&self.missed(values));
        // The thrust's corner can hold the iteration on its wrong side: it begins before and behind
        // it.
        let solved = [0.0, 0.02].into_iter().filter_map(|earlier_s| {
            let mut start: Vec<f64> = priors.iter().map(|prior| prior.mean).collect();
            start[DELAY] = (lit_s - commanded_s - earlier_s).max(0.0);
            // From no rise at all the burn changes with its square: the iteration would stay there.
            start[RISE] = 0.02;
            solve_from(&start, &priors, residuals)
        });
        let mut solution = solved.min_by(|one, other| one.cost.total_cmp(&other.cost)).ok_or(NOT_SOLVED)?;
        inflate(&mut solution, residuals, BLOCK);
        let seen_s =
            self.samples.last().map_or(0.0, |last| last.end_s - commanded_s - solution.values[DELAY]);
        self.is_of_the_curve(&solution.values)?;
        Ok((solution, seen_s))
    }

    /// Whether the model's thrust is the one that was measured; an error says where it is not.
    fn is_of_the_curve(&self, values: &[f64]) -> Result<(), String> {
        /// A chuff, a motor that goes out, a nozzle that is lost: the thrust is off by a tenth of
        /// the curve's highest for a tenth of a second. Shape, gusts and vibration together reach a
        /// third of that.
        const FRAMES: usize = 20;
        const SHARE: f64 = 0.1;
        let missed = self.missed(values);
        let means =
            missed[self.fallen..].chunks_exact(FRAMES).map(|part| part.iter().sum::<f64>() / FRAMES as f64);
        let Some((part, worst)) =
            means.enumerate().max_by(|one, other| one.1.abs().total_cmp(&other.1.abs()))
        else {
            return Ok(());
        };
        let highest_m_s2 = self.trace.mission.motor_curve.peak_thrust_n() / self.loaded_kg;
        if worst.abs() < SHARE * highest_m_s2 {
            return Ok(());
        }
        let after_s = (part * FRAMES) as f64 * FRAME_S;
        Err(format!(
            "the thrust is not its curve's, however that is scaled: {after_s:.1} s after the igniter was fired it is {:.1} \
             m/s^2 off for a tenth of a second",
            worst.abs(),
        ))
    }
}

/// Fits fall and burn.
///
/// # Errors
/// The reason why the flight determines neither drag nor thrust.
pub(super) fn fit_along(trace: &Trace, thrust_along: &dyn Fn(f64) -> f64) -> Result<Along, String> {
    let series = Series::new(trace, thrust_along)?;
    sound::check(trace, &series.frames[..series.fallen], false)?;
    let at_ignition = &series.frames[series.fallen - 1].estimate;
    let bias = Prior {
        mean: at_ignition.accelerometer_bias_m_s2.x,
        sigma: at_ignition.sigmas.accelerometer_bias_m_s2.x.max(1e-4),
    };
    let priors = vec![WIDE, WIDE, bias];
    let updraught_m_s = series.updraught_m_s(&priors);
    let sum = |value: fn(&Sample) -> f64| series.fall().iter().map(value).sum::<f64>();
    let (body_n, fins_n) = (sum(|sample| sample.body_n), sum(|sample| sample.fins_n));
    let body_share = if body_n + fins_n > 0.0 { body_n / (body_n + fins_n) } else { 0.5 };
    let speed_share =
        at_ignition.sigmas.velocity_m_s.z / at_ignition.state.velocity_m_s.norm().max(SLOWEST_M_S);
    let commanded_s = series.commanded_s;
    let burnt = match commanded_s {
        None => Err("the motor was not ignited".to_owned()),
        Some(at_s) => sound::check(trace, &series.frames[series.fallen - 1..], true)
            .and_then(|()| series.burn(at_s, priors.clone(), updraught_m_s)),
    };
    let (solution, burn_seen_s) = match burnt {
        Ok((solution, seen_s)) => (solution, Ok(seen_s)),
        Err(reason) => {
            let whitener = series.noises(series.fallen, updraught_m_s);
            let residuals = |values: &[f64]| whitener.apply(&series.missed_in_fall(values));
            let mut solution = solve(&priors, residuals).ok_or(NOT_SOLVED)?;
            inflate(&mut solution, residuals, BLOCK);
            (solution, Err(reason))
        }
    };
    Ok(Along { solution, body_share, updraught_m_s, commanded_s, burn_seen_s, speed_share })
}

/// Nothing is known of a scale but its size.
const WIDE: Prior = Prior { mean: 1.0, sigma: 0.5 };

const NOT_SOLVED: &str = "the model of drag and thrust does not fit the samples";

/// When the thrust is first seen, s: the samples rise by a tenth of the curve's highest thrust over
/// what was measured when the igniter was fired, for three frames. `None` if they do not, or if the
/// burn is not seen for half a second.
fn thrust_seen_s(samples: &[Sample], commanded_s: f64, mass_kg: f64, mission: &Mission) -> Option<f64> {
    const SEEN_FRAMES: usize = 100;
    let rise_m_s2 = 0.1 * mission.motor_curve.peak_thrust_n() / mass_kg;
    let before = samples.first()?.measured_m_s2;
    let first = samples
        .windows(3)
        .position(|three| three.iter().all(|sample| sample.measured_m_s2 > before + rise_m_s2))?;
    let seen = samples.len() - first >= SEEN_FRAMES;
    seen.then(|| (samples[first].end_s - FRAME_S).max(commanded_s))
}
