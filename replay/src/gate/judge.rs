//! Says what became of each flight since the baseline.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{Baseline, Checked, Flown, Outcome};

/// What became of a flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Change {
    /// Within the tolerance of the margin.
    Same,
    /// It has more margin.
    Better,
    /// It landed neither then nor before, or has less margin.
    Worse,
    /// It lands now and did not before.
    NowLands,
    /// It does not land any more.
    NoLongerLands,
    /// Its recorded decisions are not made any more.
    Diverged,
    /// It can no longer be verified or flown again.
    Lost,
    /// The baseline does not have it.
    New,
    /// The baseline has it, and the directory does not.
    Missing,
}

impl Change {
    /// The word in the table.
    pub fn word(self) -> &'static str {
        match self {
            Self::Same => "same",
            Self::Better => "better",
            Self::Worse => "WORSE",
            Self::NowLands => "FLIPPED: lands now",
            Self::NoLongerLands => "FLIPPED: lands no longer",
            Self::Diverged => "DIVERGED",
            Self::Lost => "LOST",
            Self::New => "new",
            Self::Missing => "MISSING",
        }
    }

    /// Whether it fails the gate.
    pub fn fails(self) -> bool {
        matches!(self, Self::Worse | Self::NoLongerLands | Self::Diverged | Self::Lost | Self::Missing)
    }
}

/// A flight and what became of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judged {
    pub name: String,
    pub change: Change,
    /// Accepted earlier.
    pub before: Option<Outcome>,
    /// Now.
    pub now: Option<Outcome>,
}

/// Holds outcomes against a baseline. A margin that changed by no more than `tolerance` is the same.
pub fn judge(outcomes: &BTreeMap<String, Outcome>, baseline: &Baseline, tolerance: f64) -> Vec<Judged> {
    let of_now = outcomes.iter().map(|(name, now)| {
        let before = baseline.flights.get(name);
        let change = before.map_or(Change::New, |before| change(before, now, tolerance));
        Judged { name: name.clone(), change, before: before.cloned(), now: Some(now.clone()) }
    });
    let missing = baseline.flights.iter().filter(|(name, _)| !outcomes.contains_key(*name));
    let missing = missing.map(|(name, before)| Judged {
        name: name.clone(),
        change: Change::Missing,
        before: Some(before.clone()),
        now: None,
    });
    of_now.chain(missing).collect()
}

fn change(before: &Outcome, now: &Outcome, tolerance: f64) -> Change {
    let landed = |outcome: &Outcome| outcome.flown.as_ref().is_some_and(|flown| flown.landed);
    match (landed(before), landed(now)) {
        (true, false) => return Change::NoLongerLands,
        (false, true) => return Change::NowLands,
        _ => {}
    }
    if before.checked == Checked::Identical && now.checked != Checked::Identical {
        return if now.checked == Checked::Diverged { Change::Diverged } else { Change::Lost };
    }
    let margin = |outcome: &Outcome| outcome.flown.as_ref().and_then(Flown::margin);
    match (margin(before), margin(now)) {
        (Some(_), None) => Change::Lost,
        (None, Some(_)) => Change::Better,
        (Some(then), Some(now)) if now < then - tolerance => Change::Worse,
        (Some(then), Some(now)) if now > then + tolerance => Change::Better,
        _ => Change::Same,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(checked: Checked, landed: bool, margin: f64) -> Outcome {
        let flown = Flown { landed, ending: String::new(), margin: Some(format!("{margin:?}")) };
        Outcome { checked, flown: Some(flown), problem: None }
    }

    fn judged(before: Outcome, now: Outcome) -> Change {
        let named = |outcome| BTreeMap::from([("a".to_owned(), outcome)]);
        judge(&named(now), &Baseline::of(named(before)), 0.02)[0].change
    }

    #[test]
    fn every_change_has_its_name_and_the_bad_ones_fail() {
        use Checked::{Diverged, Identical, Unverified};
        let before = outcome(Identical, true, 0.5);
        for (now, expected, fails) in [
            (outcome(Identical, true, 0.51), Change::Same, false),
            (outcome(Identical, true, 0.6), Change::Better, false),
            (outcome(Identical, true, 0.4), Change::Worse, true),
            (outcome(Diverged, true, 0.6), Change::Diverged, true),
            (outcome(Unverified, true, 0.6), Change::Lost, true),
            (outcome(Identical, false, -0.1), Change::NoLongerLands, true),
        ] {
            let change = judged(before.clone(), now);
            assert_eq!((change, change.fails()), (expected, fails));
        }
        let crashed = outcome(Diverged, false, -2.0);
        assert_eq!(judged(crashed.clone(), outcome(Diverged, true, 0.1)), Change::NowLands);
        // A divergence that was accepted is no news.
        assert_eq!(judged(crashed.clone(), crashed), Change::Same);
    }

    #[test]
    fn a_flight_that_only_one_of_them_has_is_named() {
        let flights =
            |name: &str| BTreeMap::from([(name.to_owned(), outcome(Checked::Identical, true, 0.5))]);
        let judged = judge(&flights("a"), &Baseline::of(flights("b")), 0.0);
        let changes: Vec<_> = judged.iter().map(|judged| (judged.name.as_str(), judged.change)).collect();
        assert_eq!(changes, [("a", Change::New), ("b", Change::Missing)]);
    }
}
