//! The landing rate that a lot's flights will have, from flights that were simulated once.
//!
//! Every simulated flight has motors drawn from the posterior's own prediction. They tell how the chance to land depends on
//! the motor ([`Surface`]), and that, over the burns of one mean and one scatter, is a lot's rate. The interval is over the lots
//! and the surfaces that are possible.

use rand::SeedableRng as _;
use rand_chacha::ChaCha12Rng;
use serde::Serialize;

use super::posterior::{Chance, Lot};
use super::surface::Surface;

/// Lots that are drawn from the posterior: the ends of the interval are then known to a tenth of its width.
const DRAWS: usize = 800;

/// Places and weights of Gauss and Hermite for the mean over a normal variable, exact for polynomials of ninth order
/// (Abramowitz and Stegun, table 25.10, in standard deviations).
const NORMAL: [(f64, f64); 5] = [
    (-2.856_970_013_872_806, 0.011_257_411_327_720_7),
    (-1.355_626_179_974_266, 0.222_075_922_005_613),
    (0.0, 0.533_333_333_333_333),
    (1.355_626_179_974_266, 0.222_075_922_005_613),
    (2.856_970_013_872_806, 0.011_257_411_327_720_7),
];

/// A simulated flight: what its motor was drawn as, in the order of the lots, and whether it landed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trial {
    pub drawn: Vec<f64>,
    pub landed: bool,
}

/// The predicted landing rate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Prediction {
    /// Expected rate.
    pub rate: f64,
    /// Ends of the 95 % interval.
    pub low: f64,
    pub high: f64,
    /// Probability that the rate is below the limit.
    pub risk: f64,
}

/// Draws a flight's motor from the lots.
pub fn draw_next(lots: &[Lot], chance: &mut Chance) -> Vec<f64> {
    let next = lots.iter().map(|lot| {
        let (mean, sigma) = lot.draw(chance);
        mean + sigma * chance.normal()
    });
    next.collect()
}

/// The rate over all lots that the posterior thinks possible; `None` without flights.
pub fn predict(lots: &[Lot], trials: &[Trial], limit: f64, seed: u64) -> Option<Prediction> {
    if trials.is_empty() {
        return None;
    }
    let surface = Surface::fit(lots, trials)?;
    let mut chance = Chance(ChaCha12Rng::seed_from_u64(seed));
    let burns = burns(lots.len());
    let (mut motor, mut room) = (vec![0.0; lots.len()], Vec::new());
    let mut rates = (0..DRAWS)
        .map(|_| {
            let coefficients = surface.draw(&mut chance)?;
            let possible: Vec<(f64, f64)> = lots.iter().map(|lot| lot.draw(&mut chance)).collect();
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
    let below = rates.iter().filter(|rate| **rate < limit).count();
    Some(Prediction {
        rate: rates.iter().sum::<f64>() / DRAWS as f64,
        low: at(0.025),
        high: at(0.975),
        risk: below as f64 / DRAWS as f64,
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Chance that mk2 lands in `real` with a motor of so much impulse (rows) and burn time (columns), by what its mission
    /// expects: 4,000 flights of seed 4001 with a scatter of 4.5 and 6.5 %, each weighed by its distance (normal, 1.2 and 1.7 %).
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

    /// A vehicle that lands with motors between 4 % too weak and 5 % too strong, which burn for no more than 6 % too long or
    /// too short, and never with one flight of fifty: edges that the surface cannot have.
    fn lands_within_edges(motor: [f64; 2]) -> f64 {
        let within = (0.96..1.05).contains(&motor[0]) && (0.94..1.06).contains(&motor[1]);
        if within { 0.98 } else { 0.0 }
    }

    /// The share of clubs whose interval holds their true rate. Their lots are as the prior has them; each has burnt five motors,
    /// and its mission expects what it has learnt.
    fn held(clubs: u64, lands: fn([f64; 2]) -> f64) -> f64 {
        const FLOWN: u32 = 4000;
        let priors = [Lot::prior(1.0, 0.025), Lot::prior(1.0, 0.04)];
        let holds = |club: u64| {
            let mut chance = Chance(ChaCha12Rng::seed_from_u64(1000 + club));
            let truth = priors.map(|prior| prior.draw(&mut chance));
            let burn = |chance: &mut Chance| truth.map(|(mean, sigma)| mean + sigma * chance.normal());
            let burns: Vec<[f64; 2]> = (0..5).map(|_| burn(&mut chance)).collect();
            let lots = [0, 1].map(|i| priors[i].with(&burns.iter().map(|burn| burn[i]).collect::<Vec<_>>()));
            let chance_of = |motor: &[f64]| lands([0, 1].map(|i| motor[i] / lots[i].mean));
            let mut trial = || {
                let drawn = draw_next(&lots, &mut chance);
                let landed = chance.unit() < chance_of(&drawn);
                Trial { drawn, landed }
            };
            let trials: Vec<Trial> = (0..1000).map(|_| trial()).collect();
            let found = predict(&lots, &trials, 0.9, club).unwrap();
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
        let lots = [Lot::prior(1.0, 0.02)];
        assert_eq!(predict(&lots, &[], 0.9, 1), None);
        let found = |flights| {
            let mut chance = Chance(ChaCha12Rng::seed_from_u64(3));
            let trials: Vec<Trial> =
                (0..flights).map(|_| Trial { drawn: draw_next(&lots, &mut chance), landed: true }).collect();
            predict(&lots, &trials, 0.9, 1).unwrap()
        };
        let (few, many) = (found(20), found(1000));
        assert!(few.low < 0.9 && few.high > 0.99 && few.risk > 0.02, "{few:?}");
        assert!(many.rate > 0.99 && many.low < 1.0 && many.risk < 0.02, "{many:?}");
    }
}
