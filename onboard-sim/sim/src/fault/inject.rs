//! Injects the faults of a flight at their times.

use flight::rules::phase::Phase;

use super::{Breakage, TimedFault, When};
use crate::draw::fault_shares;

/// The faults of a flight that have not happened yet.
#[derive(Debug, Clone, Default)]
pub struct Injector {
    waiting: Vec<TimedFault>,
    /// When each phase was entered, s since the start.
    entered_s: [Option<f64>; Phase::ALL.len()],
    happened: u64,
}

impl Injector {
    /// The faults of flight `number` of a seed; none has happened yet.
    pub fn new(faults: &[TimedFault], seed: u64, number: u64) -> Self {
        let shares = fault_shares(seed, number, faults.len());
        let waiting = faults.iter().zip(shares).map(|(fault, share)| match fault.when {
            When::PhaseBetween(phase, [from_s, to_s]) => {
                TimedFault { when: When::Phase(phase, from_s + share * (to_s - from_s)), ..*fault }
            }
            When::Time(_) | When::Phase(..) => *fault,
        });
        Self { waiting: waiting.collect(), entered_s: [None; Phase::ALL.len()], happened: 0 }
    }

    /// How many have happened.
    pub fn happened(&self) -> u64 {
        self.happened
    }

    /// What breaks at a time, s since the start, in a phase. Call it before every frame.
    pub fn due(&mut self, time_s: f64, phase: Phase) -> Vec<Breakage> {
        self.entered_s[usize::from(phase.index())].get_or_insert(time_s);
        let entered_s = self.entered_s;
        let due = |fault: &TimedFault| match fault.when {
            // The start is the release.
            When::Time(at_s) => !phase.on_pad() && time_s >= at_s,
            // The delay was drawn together with the flight.
            When::PhaseBetween(since, [delay_s, _]) | When::Phase(since, delay_s) => {
                let entered_s = entered_s[usize::from(since.index())];
                // The time begins anew with the release.
                since.on_pad() == phase.on_pad()
                    && entered_s.is_some_and(|entered_s| time_s >= entered_s + delay_s)
            }
        };
        let (now, later): (Vec<_>, Vec<_>) = self.waiting.drain(..).partition(due);
        self.waiting = later;
        self.happened += now.len() as u64;
        now.into_iter().map(|fault| fault.breakage).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_random_delay_differs_between_flights_and_repeats_for_the_same_flight() {
        let faults = ["abort@ignition+1..3".parse().unwrap(), "gnss-out@ignition+1..3".parse().unwrap()];
        let drawn_s = |number| {
            Injector::new(&faults, 5, number)
                .waiting
                .iter()
                .map(|fault| match fault.when {
                    When::Phase(Phase::Ignition, delay_s) => delay_s,
                    other => panic!("not drawn: {other:?}"),
                })
                .collect::<Vec<f64>>()
        };
        let all: Vec<f64> = (0..200).flat_map(drawn_s).collect();
        assert!(all.iter().all(|delay_s| (1.0..3.0).contains(delay_s)));
        let mean_s = all.iter().sum::<f64>() / all.len() as f64;
        // Five standard deviations of the mean of 400 uniform draws over two seconds.
        assert!((mean_s - 2.0).abs() < 5.0 * 2.0 / (12.0_f64 * 400.0).sqrt(), "{mean_s}");
        assert_eq!(drawn_s(7), drawn_s(7));
        assert_ne!(drawn_s(7)[0].to_bits(), drawn_s(7)[1].to_bits(), "each fault has its own draw");
    }
}
