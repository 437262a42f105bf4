//! Holds the acceleration along the nose against the certified curve.
//!
//! Two positions in a row give the mean acceleration between them; without gravity and with the air force of the flight
//! computer's own model it is the thrust over the mass. Over half a second its ratio to the certified thrust has the
//! standard deviation
//!
//! `sqrt(impulse^2 + (burn_time (1 + t T'/T))^2 + air^2 + level^2)`
//!
//! with the scatter of impulse and burn time that the mission's filter expects (2.7 % and 4 %; a burn that is longer by `b`
//! has at the time `t` the thrust `T(t/b)/b`), a tenth of the air force over the thrust, and 2 % for the velocities, which the
//! vehicle's estimator corrects in steps of some centimetres per second. The bound is six of them: about 30 % of the thrust
//! (with five, one of 100 nominal burns is flagged).
//! That is no test for a motor that is 10 % weak (two deviations): [`super::strength`] is. It finds within half a second
//! what does not burn as certified at all: a motor that goes out, a nozzle that is lost, a wrong motor; and it needs nothing
//! but the motion, so it also holds where the vehicle's filter is wrong.

use std::collections::VecDeque;

use flight::vehicle::burn::Burn;
use flight::vehicle::mission::Mission;

/// The bound, standard deviations.
const SIGMAS: f64 = 6.0;
/// Noise of the ratio over the window.
const LEVEL_SIGMA: f64 = 0.02;
/// Error of the modelled air force.
const AIR_SIGMA: f64 = 0.1;
/// The window, s.
const WINDOW_S: f64 = 0.45;
/// The igniter and the rise of the thrust are not in the curve, s.
const RISEN_S: f64 = 0.25;
/// Below this share of the peak the motor is in its tail, whose time nobody knows.
const TAIL_SHARE: f64 = 0.35;

/// What two positions in a row show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Felt {
    /// Time since the thrust began at the end, s.
    pub(super) since_s: f64,
    pub(super) interval_s: f64,
    /// Acceleration along the nose without gravity, m/s^2.
    pub(super) specific_force_m_s2: f64,
    pub(super) mass_kg: f64,
    /// The air's part of it as modelled, N.
    pub(super) air_n: f64,
}

/// Mean acceleration along the nose over the window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Off {
    pub(super) found_m_s2: f64,
    pub(super) expected_m_s2: f64,
}

#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct ThrustWatch {
    felt: VecDeque<Felt>,
    flagged: bool,
}

impl ThrustWatch {
    /// Takes what two positions show. Returns the mean accelerations if the thrust is not that of the curve; once.
    pub(super) fn take(&mut self, mission: &Mission, felt: Felt) -> Option<Off> {
        let burn = Burn::nominal(&mission.motor_curve);
        let begins_s = felt.since_s - felt.interval_s;
        let late = burn.thrust_n(felt.since_s) < TAIL_SHARE * mission.motor_curve.peak_thrust_n();
        if self.flagged || begins_s < RISEN_S || late {
            return None;
        }
        self.felt.push_back(felt);
        let end_s = felt.since_s;
        while self.felt.front().is_some_and(|first| end_s - first.since_s > WINDOW_S) {
            self.felt.pop_front();
        }
        let first = self.felt.front()?;
        if end_s - (first.since_s - first.interval_s) < WINDOW_S {
            return None;
        }
        let certified_n = |felt: &Felt| burn.mean_thrust_n(felt.since_s - felt.interval_s, felt.interval_s);
        let mean = |value: &dyn Fn(&Felt) -> f64| {
            let whole_s: f64 = self.felt.iter().map(|felt| felt.interval_s).sum();
            self.felt.iter().map(|felt| value(felt) * felt.interval_s).sum::<f64>() / whole_s
        };
        let thrust_n = mean(&certified_n);
        let found_n = mean(&|felt| felt.mass_kg * felt.specific_force_m_s2 - felt.air_n);
        let sigma = sigma(mission, end_s - 0.5 * WINDOW_S, mean(&|felt| felt.air_n.abs()) / thrust_n);
        self.flagged = (found_n / thrust_n - 1.0).abs() > SIGMAS * sigma;
        self.flagged.then(|| Off {
            found_m_s2: mean(&|felt| felt.specific_force_m_s2),
            expected_m_s2: mean(&|felt| (certified_n(felt) + felt.air_n) / felt.mass_kg),
        })
    }
}

/// Standard deviation of the ratio at a time since the thrust began; `air` is the air force over the thrust.
fn sigma(mission: &Mission, since_s: f64, air: f64) -> f64 {
    let burn = Burn::nominal(&mission.motor_curve);
    let thrust_n = burn.thrust_n(since_s);
    let slope_n_s = (burn.thrust_n(since_s + 0.1) - burn.thrust_n(since_s - 0.1)) / 0.2;
    let by_burn_time = mission.motor.burn_time_sigma * (1.0 + since_s * slope_n_s / thrust_n);
    let terms = [mission.motor.impulse_sigma, by_burn_time, AIR_SIGMA * air, LEVEL_SIGMA];
    libm::sqrt(terms.iter().map(|term| term * term).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mission() -> Mission {
        let (name, text) =
            vehicles::mission::BUILTIN.iter().find(|(name, _)| *name == "mk2").expect("built in");
        vehicles::mission::from_toml(text, name).unwrap()
    }

    /// A burn at a share of the certified thrust, without air.
    fn flagged_at_s(share: f64) -> Option<f64> {
        let (mission, mut watch) = (mission(), ThrustWatch::default());
        let burn = Burn::nominal(&mission.motor_curve);
        (1..28).find_map(|step| {
            let (since_s, interval_s) = (0.125 * f64::from(step), 0.125);
            let thrust_n = share * burn.mean_thrust_n(since_s - interval_s, interval_s);
            let felt =
                Felt { since_s, interval_s, specific_force_m_s2: thrust_n / 3.0, mass_kg: 3.0, air_n: 0.0 };
            watch.take(&mission, felt).map(|_| since_s)
        })
    }

    #[test]
    fn the_scatter_of_motors_is_no_flag_and_a_lost_third_is_one_within_a_second() {
        for share in [0.85, 1.0, 1.15] {
            assert_eq!(flagged_at_s(share), None, "{share}");
        }
        assert!(flagged_at_s(0.65).is_some_and(|since_s| since_s < 1.0));
    }
}
