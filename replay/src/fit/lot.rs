//! How often the next day lands, from a lot's posterior ([`flight::vehicle::lot`]) and simulated
//! flights with motors of it.
//!
//! The next value of a posterior has a Student t distribution. The errors of the fits count as
//! scatter: they are a tenth of it and widen it by half a per cent. What all fits of a vehicle may
//! have in common is no scatter: it widens the mean by itself.

use flight::vehicle::lot::{Burnt, Posterior};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use serde::Serialize;
use sim::draw::Chance;

/// Mean and scatter of burns with these values, if all may be wrong by `common` in the same
/// direction.
pub fn burnt(values: &[f64], common: f64) -> Burnt {
    burnt_weighted(&values.iter().map(|value| (*value, 1.0)).collect::<Vec<_>>(), common)
}

/// The same of values with weights.
pub(super) fn burnt_weighted(values: &[(f64, f64)], common: f64) -> Burnt {
    let count: f64 = values.iter().map(|(_, weight)| weight).sum();
    let mean = values.iter().map(|(value, weight)| weight * value).sum::<f64>() / count.max(1e-9);
    let squares: f64 = values.iter().map(|(value, weight)| weight * (value - mean) * (value - mean)).sum();
    Burnt { mean, scatter: libm::sqrt(squares / (count - 1.0).max(1.0)), common }
}

/// Distance from the other burns up to which a burn has its full weight, and from which on it has
/// none, in standard deviations of a next burn.
const WEIGHED_WITHIN: [f64; 2] = [3.0, 5.0];

/// Distances of burns (value and standard deviation of its fit) from their median, in standard
/// deviations of a next burn. The prior's mean counts as one burn, and as all of them beside one.
pub(super) fn distances(prior: &Posterior, burns: &[(f64, f64)]) -> Vec<f64> {
    let mut values: Vec<f64> = burns.iter().map(|(value, _)| *value).chain([prior.mean]).collect();
    values.sort_by(f64::total_cmp);
    let middles = [(values.len() - 1) / 2, values.len() / 2].map(|place| values[place]);
    let nearer = |a: &f64, b: &f64| (a - prior.mean).abs().total_cmp(&(b - prior.mean).abs());
    let median = middles.into_iter().min_by(nearer).unwrap_or(prior.mean);
    let distance = |(value, sigma): &(f64, f64)| (value - median) / libm::hypot(prior.next_sigma(), *sigma);
    burns.iter().map(distance).collect()
}

/// Weight of a burn at a distance.
pub(super) fn weight(distance: f64) -> f64 {
    let [full, none] = WEIGHED_WITHIN;
    ((none - distance.abs()) / (none - full)).clamp(0.0, 1.0)
}

/// A mean and a standard deviation that a lot may have.
pub fn draw_lot(lot: &Posterior, chance: &mut Chance) -> (f64, f64) {
    let chi_squared: f64 = (0..lot.freedom).map(|_| libm::pow(chance.normal(), 2.0)).sum();
    let sigma = libm::sqrt(lot.squares / chi_squared.max(1e-9));
    (lot.mean + libm::hypot(sigma / libm::sqrt(lot.worth), lot.common) * chance.normal(), sigma)
}

/// Lots that are drawn from the posterior: the ends of the interval are then known to a tenth of
/// its width.
const DRAWS: usize = 800;

/// Places and weights of Gauss and Hermite for the mean over a normal variable, exact for
/// polynomials of ninth order (Abramowitz and Stegun, table 25.10, in standard deviations).
const NORMAL: [(f64, f64); 5] = [
    (-2.856_970_013_872_806, 0.011_257_411_327_720_7),
    (-1.355_626_179_974_266, 0.222_075_922_005_613),
    (0.0, 0.533_333_333_333_333),
    (1.355_626_179_974_266, 0.222_075_922_005_613),
    (2.856_970_013_872_806, 0.011_257_411_327_720_7),
];

/// A simulated flight: what its motor was drawn as, in the order of the lots, and whether it
/// landed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trial {
    pub drawn: Vec<f64>,
    pub landed: bool,
}

/// The predicted landing rate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Prediction {
    /// Expected rate.
    pub rate: f64,
    /// Ends of the 95 % interval.
    pub low: f64,
    pub high: f64,
    /// Rates that are equally likely, ascending.
    #[serde(skip)]
    pub rates: Vec<f64>,
}

/// Draws a flight's motor from the lots.
pub fn draw_next(lots: &[Posterior], chance: &mut Chance) -> Vec<f64> {
    let next = lots.iter().map(|lot| {
        let (mean, sigma) = draw_lot(lot, chance);
        mean + sigma * chance.normal()
    });
    next.collect()
}

/// The landing rate over the posterior of the lots; `None` without flights.
pub fn predict(lots: &[Posterior], trials: &[Trial], seed: u64) -> Option<Prediction> {
    if trials.is_empty() {
        return None;
    }
    let surface = Surface::fit(lots, trials)?;
    let mut chance = Chance::of(seed, 0);
    let burns = burns(lots.len());
    let (mut motor, mut room) = (vec![0.0; lots.len()], Vec::new());
    let mut rates = (0..DRAWS)
        .map(|_| {
            let coefficients = surface.draw(&mut chance)?;
            let possible: Vec<(f64, f64)> = lots.iter().map(|lot| draw_lot(lot, &mut chance)).collect();
            let mut rate = 0.0;
            for (burn, weight) in &burns {
                for (value, ((mean, sigma), apart)) in motor.iter_mut().zip(possible.iter().zip(burn)) {
                    *value = mean + sigma * apart;
                }
                rate += weight * surface.chance_to_land(&coefficients, &motor, &mut room);
            }
            Some(rate)
        })
        .collect::<Option<Vec<f64>>>()?;
    rates.sort_by(f64::total_cmp);
    let at = |share: f64| rates[libm::round(share * (DRAWS - 1) as f64) as usize];
    Some(Prediction {
        rate: rates.iter().sum::<f64>() / DRAWS as f64,
        low: at(0.025),
        high: at(0.975),
        rates,
    })
}

/// Burns of a lot, each property in standard deviations, with the weights of their mean.
fn burns(properties: usize) -> Vec<(Vec<f64>, f64)> {
    (0..properties).fold(vec![(Vec::new(), 1.0)], |burns, _| {
        let with = |(burn, weight): &(Vec<f64>, f64)| {
            NORMAL.map(|(apart, share)| ([burn.as_slice(), &[apart]].concat(), weight * share))
        };
        burns.iter().flat_map(with).collect()
    })
}

/// Prior standard deviations of the mean log-odds and of every other coefficient: of flights that
/// all land or all fail the rate stays a number between. With 1, intervals hold the rate of 95.5
/// and 95.6 % of simulated clubs (in the two worlds of the test in `rate`), with 0.5 of 97.1 and
/// 96.1 %, with 2 of 96.6 and 96.5 %.
const MEAN_SIGMA: f64 = 5.0;
const SLOPE_SIGMA: f64 = 1.0;

/// Standard deviations beyond which the surface is as at this distance.
const FURTHEST: f64 = 4.0;

/// Newton steps at most, halvings of one at most, and the step that is none.
const STEPS: usize = 50;
const HALVINGS: usize = 20;
const STILL: f64 = 1e-9;

/// The surface, and how well it is known.
#[derive(Debug, Clone)]
struct Surface {
    /// Expected value and standard deviation of each property.
    scales: Vec<(f64, f64)>,
    mode: DVector<f64>,
    /// Factor of the posterior's precision.
    precision: Cholesky<f64, Dyn>,
}

impl Surface {
    /// The surface of flights whose motors were drawn for the next burn of these lots; `None` if a
    /// motor is not a number.
    pub(super) fn fit(lots: &[Posterior], trials: &[Trial]) -> Option<Self> {
        let scales: Vec<(f64, f64)> = lots.iter().map(|lot| (lot.mean, lot.next_sigma())).collect();
        let count = 1 + lots.len() + lots.len() * (lots.len() + 1) / 2;
        let mut rows = Vec::with_capacity(count * trials.len());
        for trial in trials {
            terms(&scales, &trial.drawn, &mut rows);
        }
        let rows = DMatrix::from_row_slice(trials.len(), count, &rows);
        let landed = DVector::from_fn(trials.len(), |k, _| f64::from(u8::from(trials[k].landed)));
        let prior = DVector::from_fn(count, |i, _| {
            let sigma = if i == 0 { MEAN_SIGMA } else { SLOPE_SIGMA };
            1.0 / (sigma * sigma)
        });
        let mut mode = DVector::zeros(count);
        let mut fitted = Fitted::at(&rows, &landed, &prior, &mode);
        for _ in 0..STEPS {
            let step = fitted.precision()?.solve(&fitted.slope);
            let mut share = 1.0;
            let better = (0..HALVINGS).find_map(|_| {
                let tried = &mode + &step * share;
                let at = Fitted::at(&rows, &landed, &prior, &tried);
                share *= 0.5;
                (at.log_density >= fitted.log_density).then_some((tried, at))
            });
            let Some((moved, at)) = better else { break };
            (mode, fitted) = (moved, at);
            if step.amax() < STILL {
                break;
            }
        }
        let precision = fitted.precision()?;
        Some(Self { scales, mode, precision })
    }

    /// Coefficients that the surface may have.
    pub(super) fn draw(&self, chance: &mut Chance) -> Option<DVector<f64>> {
        let normal = DVector::from_fn(self.mode.len(), |_, _| chance.normal());
        let apart = self.precision.l_dirty().tr_solve_lower_triangular(&normal)?;
        Some(&self.mode + apart)
    }

    /// The chance to land with a motor, by these coefficients.
    pub(super) fn chance_to_land(
        &self,
        coefficients: &DVector<f64>,
        motor: &[f64],
        room: &mut Vec<f64>,
    ) -> f64 {
        room.clear();
        terms(&self.scales, motor, room);
        logistic(room.iter().zip(coefficients.iter()).map(|(term, factor)| term * factor).sum())
    }
}

/// Appends the polynomial's terms for a motor: 1, each property, each product of two.
fn terms(scales: &[(f64, f64)], motor: &[f64], into: &mut Vec<f64>) {
    let scaled = |i: usize| ((motor[i] - scales[i].0) / scales[i].1).clamp(-FURTHEST, FURTHEST);
    into.push(1.0);
    into.extend((0..scales.len()).map(scaled));
    for i in 0..scales.len() {
        into.extend((i..scales.len()).map(|j| scaled(i) * scaled(j)));
    }
}

fn logistic(log_odds: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-log_odds))
}

/// Log density of the coefficients, up to a constant, with its derivatives.
struct Fitted {
    log_density: f64,
    slope: DVector<f64>,
    /// The negative of the second derivative.
    curvature: DMatrix<f64>,
}

impl Fitted {
    fn at(
        rows: &DMatrix<f64>,
        landed: &DVector<f64>,
        prior: &DVector<f64>,
        coefficients: &DVector<f64>,
    ) -> Self {
        let log_odds = rows * coefficients;
        let chances = log_odds.map(logistic);
        // log(1 + e^x) without overflow.
        let normaliser = log_odds.map(|x| x.max(0.0) + libm::log1p(libm::exp(-x.abs())));
        let pulled = prior.component_mul(coefficients);
        let mut weighted = rows.clone();
        for (mut row, chance) in weighted.row_iter_mut().zip(chances.iter()) {
            row *= chance * (1.0 - chance);
        }
        Self {
            log_density: landed.dot(&log_odds) - normaliser.sum() - 0.5 * pulled.dot(coefficients),
            slope: rows.tr_mul(&(landed - &chances)) - pulled,
            curvature: rows.tr_mul(&weighted) + DMatrix::from_diagonal(prior),
        }
    }

    fn precision(&self) -> Option<Cholesky<f64, Dyn>> {
        Cholesky::new(self.curvature.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_hand_what_burns_had() {
        let found = burnt(&[1.02, 0.99, 1.02], 0.0);
        // Distances of 0.01, 0.02 and 0.01: 0.0006 over 2.
        assert!((found.mean - 1.01).abs() < 1e-12 && (found.scatter - libm::sqrt(0.0003)).abs() < 1e-12);
        assert_eq!(burnt(&[1.02], 0.005), Burnt { mean: 1.02, scatter: 0.0, common: 0.005 });
        // A burn of half the weight: (1 + 1 + 1.3 / 2) / 2.5.
        let found = burnt_weighted(&[(1.0, 1.0), (1.0, 1.0), (1.3, 0.5)], 0.0);
        assert!((found.mean - 1.06).abs() < 1e-12, "{found:?}");
    }

    /// Medians 1, 1 (the prior decides a tie) and 0.8 (two burns outvote the prior), deviations of
    /// 0.03 and 0.04 together 0.05: 1.25 is 5 of them away, and 1.2 is 4.
    #[test]
    fn val_hand_a_distant_burn_loses_its_weight_unless_others_agree_with_it() {
        let prior = Posterior::prior(1.0, 0.03);
        let distances = |values: &[f64]| {
            distances(&prior, &values.iter().map(|value| (*value, 0.04)).collect::<Vec<_>>())
        };
        let close = |found: &[f64], expected: &[f64]| {
            found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9)
        };
        assert!(close(&distances(&[1.25]), &[5.0]) && distances(&[]).is_empty());
        assert!(close(&distances(&[1.2, 0.9, 1.0]), &[4.0, -2.0, 0.0]));
        assert!(close(&distances(&[0.8, 0.8]), &[0.0, 0.0]));
        assert!(close(&[5.0, 4.0, -4.0, 3.0].map(weight), &[0.0, 0.5, 0.5, 1.0]));
    }

    /// Draws of a mean and a scatter, and then of a value, have the next value's variance.
    #[test]
    fn val_student_draws() {
        let mut chance = Chance::of(1, 0);
        let lot =
            Posterior::prior(0.0, 1.0).with(8, &burnt(&[0.3, -0.2, 0.1, 0.5, -0.6, 0.2, 0.1, -0.4], 0.0));
        let count = 20_000;
        let squares = (0..count).map(|_| {
            let (mean, sigma) = draw_lot(&lot, &mut chance);
            libm::pow(mean + sigma * chance.normal() - lot.mean, 2.0)
        });
        let found = libm::sqrt(squares.sum::<f64>() / f64::from(count));
        assert!((found / lot.next_sigma() - 1.0).abs() < 0.03, "{found} {}", lot.next_sigma());
    }

    /// Chance that mk2 lands in `real` with a motor of so much impulse (rows) and burn time
    /// (columns), by what its mission expects: 4,000 flights of seed 4001 with a scatter of 4.5 and
    /// 6.5 %, each weighed by its distance (normal, 1.2 and 1.7 %).
    const LANDS: [[f64; 7]; 7] = [
        [0.04, 0.11, 0.45, 0.49, 0.25, 0.14, 0.04],
        [0.20, 0.44, 0.76, 0.79, 0.64, 0.35, 0.13],
        [0.38, 0.68, 0.91, 0.94, 0.86, 0.61, 0.23],
        [0.75, 0.88, 0.95, 0.95, 0.92, 0.82, 0.63],
        [0.92, 0.92, 0.96, 0.94, 0.90, 0.87, 0.70],
        [0.86, 0.92, 0.90, 0.91, 0.83, 0.80, 0.74],
        [0.86, 0.84, 0.92, 0.87, 0.88, 0.83, 0.88],
    ];
    const FIRST: [f64; 2] = [0.91, 0.88];
    const STEP: [f64; 2] = [0.03, 0.04];

    /// Linear between the entries of the table, and as at its edge beyond.
    fn lands_as_flown(motor: [f64; 2]) -> f64 {
        let places = [0, 1].map(|i| ((motor[i] - FIRST[i]) / STEP[i]).clamp(0.0, 6.0));
        let [row, column] = places.map(|place| (place as usize).min(5));
        let [down, across] = [places[0] - row as f64, places[1] - column as f64];
        let between = |of: [f64; 7]| of[column] + across * (of[column + 1] - of[column]);
        between(LANDS[row]) + down * (between(LANDS[row + 1]) - between(LANDS[row]))
    }

    /// A vehicle that lands with motors between 4 % too weak and 5 % too strong, which burn for no
    /// more than 6 % too long or too short, and never with one flight of fifty: edges that the
    /// surface cannot have.
    fn lands_within_edges(motor: [f64; 2]) -> f64 {
        let within = (0.96..1.05).contains(&motor[0]) && (0.94..1.06).contains(&motor[1]);
        if within { 0.98 } else { 0.0 }
    }

    /// The share of clubs whose interval holds their true rate. Their lots are as the prior has
    /// them; each has burnt five motors, and its mission expects what it has learnt.
    fn held(clubs: u64, lands: fn([f64; 2]) -> f64) -> f64 {
        const FLOWN: u32 = 4000;
        let priors = [Posterior::prior(1.0, 0.025), Posterior::prior(1.0, 0.04)];
        let holds = |club: u64| {
            let mut chance = Chance::of(1000 + club, 0);
            let truth = priors.map(|prior| draw_lot(&prior, &mut chance));
            let burn = |chance: &mut Chance| truth.map(|(mean, sigma)| mean + sigma * chance.normal());
            let burns: Vec<[f64; 2]> = (0..5).map(|_| burn(&mut chance)).collect();
            let lots = [0, 1].map(|i| {
                let values: Vec<f64> = burns.iter().map(|burn| burn[i]).collect();
                priors[i].with(5, &burnt(&values, 0.0))
            });
            let chance_of = |motor: &[f64]| lands([0, 1].map(|i| motor[i] / lots[i].mean));
            let mut trial = || {
                let drawn = draw_next(&lots, &mut chance);
                let landed = chance.unit() < chance_of(&drawn);
                Trial { drawn, landed }
            };
            let trials: Vec<Trial> = (0..1000).map(|_| trial()).collect();
            let found = predict(&lots, &trials, club).unwrap();
            let rate = (0..FLOWN).map(|_| chance_of(&burn(&mut chance))).sum::<f64>() / f64::from(FLOWN);
            (found.low..=found.high).contains(&rate)
        };
        (0..clubs).filter(|club| holds(*club)).count() as f64 / clubs as f64
    }

    #[test]
    fn val_simulation_the_interval_after_five_burns_holds_the_rate_of_500_clubs() {
        for lands in [lands_as_flown, lands_within_edges] {
            let share = held(500, lands);
            assert!((0.93..=0.97).contains(&share), "{share}");
        }
    }

    /// The mean of x^2 y^4 of two independent normal variables is 1 times 3.
    #[test]
    fn val_hand_moments_of_burns() {
        let burns = burns(2);
        let mean = |of: fn(&[f64]) -> f64| burns.iter().map(|(burn, weight)| weight * of(burn)).sum::<f64>();
        assert!((mean(|_| 1.0) - 1.0).abs() < 1e-12 && burns.len() == 25);
        assert!((mean(|burn| burn[0] * burn[0] * libm::pow(burn[1], 4.0)) - 3.0).abs() < 1e-11);
    }

    #[test]
    fn flights_that_all_land_are_little_risk_if_they_are_many_and_no_flights_are_no_answer() {
        let lots = [Posterior::prior(1.0, 0.02)];
        assert_eq!(predict(&lots, &[], 1), None);
        let found = |flights| {
            let mut chance = Chance::of(3, 0);
            let trials: Vec<Trial> =
                (0..flights).map(|_| Trial { drawn: draw_next(&lots, &mut chance), landed: true }).collect();
            predict(&lots, &trials, 1).unwrap()
        };
        let (few, many) = (found(20), found(1000));
        let risk = |found: &Prediction| {
            found.rates.iter().filter(|rate| **rate < 0.9).count() as f64 / found.rates.len() as f64
        };
        assert!(few.low < 0.9 && few.high > 0.99 && risk(&few) > 0.02, "{few:?}");
        assert!(many.rate > 0.99 && many.low < 1.0 && risk(&many) < 0.02, "{many:?}");
    }

    /// One property, and a chance of which the log-odds are 2 + 1.5 u - 0.7 u^2: 20,000 flights
    /// find the coefficients to their standard deviations, and the draws scatter by these.
    #[test]
    fn val_simulation_the_surface_of_many_flights_is_found() {
        const TRUE: [f64; 3] = [2.0, 1.5, -0.7];
        let lots = [Posterior::prior(1.0, 0.03)];
        let mut chance = Chance::of(5, 0);
        let trials: Vec<Trial> = (0..20_000)
            .map(|_| {
                let u = chance.normal();
                let log_odds = TRUE[0] + TRUE[1] * u + TRUE[2] * u * u;
                Trial { drawn: vec![1.0 + 0.03 * u], landed: chance.unit() < logistic(log_odds) }
            })
            .collect();
        let surface = Surface::fit(&lots, &trials).unwrap();
        let draws: Vec<DVector<f64>> = (0..2000).map(|_| surface.draw(&mut chance).unwrap()).collect();
        for (i, expected) in TRUE.into_iter().enumerate() {
            let sigma = libm::sqrt(
                draws.iter().map(|draw| libm::pow(draw[i] - surface.mode[i], 2.0)).sum::<f64>() / 2000.0,
            );
            assert!(
                sigma < 0.06 && (surface.mode[i] - expected).abs() < 3.0 * sigma,
                "{i}: {}",
                surface.mode[i]
            );
        }
    }

    #[test]
    fn flights_with_one_outcome_have_a_surface_and_no_number_has_none() {
        let lots = [Posterior::prior(1.0, 0.03), Posterior::prior(1.0, 0.05)];
        let trials = |value: f64| vec![Trial { drawn: vec![value, 1.01], landed: true }; 40];
        let surface = Surface::fit(&lots, &trials(1.0)).unwrap();
        let chance = surface.chance_to_land(&surface.mode, &[1.0, 1.01], &mut Vec::new());
        assert!((0.95..1.0).contains(&chance), "{chance}");
        assert!(Surface::fit(&lots, &trials(f64::NAN)).is_none());
    }
}
