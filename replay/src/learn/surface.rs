//! How the chance to land depends on the motor: a logistic regression on simulated flights.
//!
//! The log-odds of a landing are a polynomial of second order in the motor's properties, in standard deviations of the
//! next burn. Its coefficients have weakly informative normal priors (A. Gelman et al., A weakly informative default prior
//! distribution for logistic and other regression models, Annals of Applied Statistics 2, 2008), and a normal posterior
//! about its mode.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::posterior::{Chance, Lot};
use super::rate::Trial;

/// Prior standard deviations of the mean log-odds and of every other coefficient: of flights that all land or all fail
/// the rate stays a number between. With 1, intervals hold the rate of 95.5 and 95.6 % of simulated clubs (in the two
/// worlds of the test in `rate`), with 0.5 of 97.1 and 96.1 %, with 2 of 96.6 and 96.5 %.
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
pub(super) struct Surface {
    /// Expected value and standard deviation of each property.
    scales: Vec<(f64, f64)>,
    mode: DVector<f64>,
    /// Factor of the posterior's precision.
    precision: Cholesky<f64, Dyn>,
}

impl Surface {
    /// The surface of flights whose motors were drawn for the next burn of these lots; `None` if a motor is not a number.
    pub(super) fn fit(lots: &[Lot], trials: &[Trial]) -> Option<Self> {
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
        let mut fitted = Posterior::at(&rows, &landed, &prior, &mode);
        for _ in 0..STEPS {
            let step = fitted.precision()?.solve(&fitted.slope);
            let mut share = 1.0;
            let better = (0..HALVINGS).find_map(|_| {
                let tried = &mode + &step * share;
                let at = Posterior::at(&rows, &landed, &prior, &tried);
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
struct Posterior {
    log_density: f64,
    slope: DVector<f64>,
    /// The negative of the second derivative.
    curvature: DMatrix<f64>,
}

impl Posterior {
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
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha12Rng;

    use super::*;

    /// One property, and a chance of which the log-odds are 2 + 1.5 u - 0.7 u^2: 20,000 flights find the coefficients to
    /// their standard deviations, and the draws scatter by these.
    #[test]
    fn val_simulation_the_surface_of_many_flights_is_found() {
        const TRUE: [f64; 3] = [2.0, 1.5, -0.7];
        let lots = [Lot::prior(1.0, 0.03)];
        let mut chance = Chance(ChaCha12Rng::seed_from_u64(5));
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
        let lots = [Lot::prior(1.0, 0.03), Lot::prior(1.0, 0.05)];
        let trials = |value: f64| vec![Trial { drawn: vec![value, 1.01], landed: true }; 40];
        let surface = Surface::fit(&lots, &trials(1.0)).unwrap();
        let chance = surface.chance_to_land(&surface.mode, &[1.0, 1.01], &mut Vec::new());
        assert!((0.95..1.0).contains(&chance), "{chance}");
        assert!(Surface::fit(&lots, &trials(f64::NAN)).is_none());
    }
}
