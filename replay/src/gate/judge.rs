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
    /// Its recorded decisions are not made any more, and it has the same margin.
    Diverged,
    /// It can no longer be verified or flown again, or is no flight any more.
    Lost,
    /// The baseline does not have it.
    New,
    /// It is no flight, and none that the baseline knows.
    NoFlight,
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
            Self::NoFlight => "no flight",
            Self::Missing => "MISSING",
        }
    }

    /// Whether it fails the gate.
    fn fails(self) -> bool {
        matches!(self, Self::Worse | Self::NoLongerLands | Self::Diverged | Self::Lost | Self::Missing)
    }
}

/// A flight and what became of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judged {
    pub name: String,
    pub change: Change,
    /// The recorded decisions were made again and are not any more, whatever the margin.
    pub newly_diverged: bool,
    /// Accepted earlier.
    pub before: Option<Outcome>,
    /// Now.
    pub now: Option<Outcome>,
}

impl Judged {
    /// Whether it fails the gate; `may_diverge`: another build may decide differently as long as nothing gets worse.
    pub fn fails(&self, may_diverge: bool) -> bool {
        match self.change {
            Change::Diverged => !may_diverge,
            change => change.fails() || (self.newly_diverged && !may_diverge),
        }
    }
}

/// Holds outcomes against a baseline. A margin that changed by no more than `tolerance` is the same.
pub fn judge(outcomes: &BTreeMap<String, Outcome>, baseline: &Baseline, tolerance: f64) -> Vec<Judged> {
    // Another flight under the name of one is no change of that one.
    let same_flight = |name: &str, before: &Outcome| {
        outcomes
            .get(name)
            .is_some_and(|now| before.flight.is_none() || now.flight.is_none() || now.flight == before.flight)
    };
    let of_now = outcomes.iter().map(|(name, now)| {
        let before = baseline.flights.get(name).filter(|before| same_flight(name, before));
        let change = match before {
            Some(before) => change(before, now, tolerance),
            None if now.checked == Checked::NoFlight => Change::NoFlight,
            None => Change::New,
        };
        let newly_diverged = now.checked == Checked::Diverged
            && before.is_some_and(|before| before.checked == Checked::Identical);
        Judged { name: name.clone(), change, newly_diverged, before: before.cloned(), now: Some(now.clone()) }
    });
    let missing = baseline.flights.iter().filter(|(name, before)| !same_flight(name, before));
    let missing = missing.map(|(name, before)| Judged {
        name: name.clone(),
        change: Change::Missing,
        newly_diverged: false,
        before: Some(before.clone()),
        now: None,
    });
    let mut judged: Vec<Judged> = of_now.chain(missing).collect();
    judged.sort_by(|a, b| in_order(&a.name).cmp(&in_order(&b.name)));
    judged
}

/// Flight 10 of a campaign comes after flight 9.
fn in_order(name: &str) -> (&str, u64) {
    let numbered =
        name.rsplit_once('#').and_then(|(campaign, number)| Some((campaign, number.parse().ok()?)));
    numbered.unwrap_or((name, 0))
}

fn change(before: &Outcome, now: &Outcome, tolerance: f64) -> Change {
    // What was neither verified nor flown again did not land differently.
    let unknown = |outcome: &Outcome| {
        outcome.flown.is_none() && matches!(outcome.checked, Checked::Unverified | Checked::NoFlight)
    };
    match (unknown(before), unknown(now)) {
        (false, true) => return Change::Lost,
        // Earlier releases accepted a file without a flight.
        (true, true) if now.checked == Checked::NoFlight => return Change::NoFlight,
        _ => {}
    }
    let landed = |outcome: &Outcome| outcome.flown.as_ref().is_some_and(|flown| flown.landed);
    match (landed(before), landed(now)) {
        (true, false) => return Change::NoLongerLands,
        (false, true) => return Change::NowLands,
        _ => {}
    }
    if before.checked == Checked::Identical && now.checked == Checked::Unverified {
        return Change::Lost;
    }
    let margin = |outcome: &Outcome| outcome.flown.as_ref().and_then(Flown::margin);
    match (margin(before), margin(now)) {
        (Some(_), None) => Change::Lost,
        (None, Some(_)) => Change::Better,
        (Some(then), Some(now)) if now < then - tolerance => Change::Worse,
        (Some(then), Some(now)) if now > then + tolerance => Change::Better,
        _ if before.checked == Checked::Identical && now.checked == Checked::Diverged => Change::Diverged,
        _ => Change::Same,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(checked: Checked, landed: bool, margin: f64) -> Outcome {
        let flown = Flown { landed, ending: String::new(), margin: Some(format!("{margin:?}")) };
        Outcome { flight: None, checked, flown: Some(flown), problem: None }
    }

    fn judged(before: Outcome, now: Outcome) -> Judged {
        let named = |outcome| BTreeMap::from([("a".to_owned(), outcome)]);
        judge(&named(now), &Baseline::of(named(before)), 0.02).remove(0)
    }

    #[test]
    fn every_change_has_its_name_and_the_bad_ones_fail() {
        use Checked::{Diverged, Identical, Unverified};
        let before = outcome(Identical, true, 0.5);
        // Whether it fails, and whether it does if the decisions may differ.
        for (now, expected, fails) in [
            (outcome(Identical, true, 0.51), Change::Same, [false, false]),
            (outcome(Identical, true, 0.6), Change::Better, [false, false]),
            (outcome(Identical, true, 0.4), Change::Worse, [true, true]),
            (outcome(Diverged, true, 0.51), Change::Diverged, [true, false]),
            (outcome(Diverged, true, 0.6), Change::Better, [true, false]),
            (outcome(Diverged, true, 0.4), Change::Worse, [true, true]),
            (outcome(Unverified, true, 0.6), Change::Lost, [true, true]),
            (outcome(Identical, false, -0.1), Change::NoLongerLands, [true, true]),
        ] {
            let judged = judged(before.clone(), now);
            assert_eq!((judged.change, [false, true].map(|may| judged.fails(may))), (expected, fails));
        }
        let crashed = outcome(Diverged, false, -2.0);
        assert_eq!(judged(crashed.clone(), outcome(Diverged, true, 0.1)).change, Change::NowLands);
        // What cannot be read did not land differently.
        for checked in [Unverified, Checked::NoFlight] {
            let gone = Outcome { flight: None, checked, flown: None, problem: Some("empty".to_owned()) };
            for before in [&before, &crashed] {
                let judged = judged(before.clone(), gone.clone());
                assert_eq!((judged.change, judged.fails(true)), (Change::Lost, true), "{checked:?}");
            }
        }
        // A divergence that was accepted is no news.
        let same = judged(crashed.clone(), crashed);
        assert_eq!((same.change, same.fails(false)), (Change::Same, false));
    }

    #[test]
    fn flights_of_a_campaign_are_listed_by_their_number() {
        let flights =
            ["a#10", "a#9", "a.mcap"].map(|name| (name.to_owned(), outcome(Checked::Identical, true, 0.5)));
        let judged = judge(&BTreeMap::from(flights), &Baseline::default(), 0.0);
        let names: Vec<&str> = judged.iter().map(|judged| judged.name.as_str()).collect();
        assert_eq!(names, ["a#9", "a#10", "a.mcap"]);
    }

    /// It does not fail, whether it is new or an earlier release accepted it as a flight that cannot be verified.
    #[test]
    fn a_file_without_a_flight_is_called_that() {
        let without = |checked| {
            BTreeMap::from([(
                "ground.mcap".to_owned(),
                Outcome { flight: None, checked, flown: None, problem: None },
            )])
        };
        for before in [BTreeMap::new(), without(Checked::Unverified)] {
            let judged = judge(&without(Checked::NoFlight), &Baseline::of(before), 0.02).remove(0);
            assert_eq!((judged.change, judged.fails(false)), (Change::NoFlight, false));
        }
        assert_eq!(Baseline::of(without(Checked::NoFlight)).flights, BTreeMap::new());
    }

    #[test]
    fn another_flight_under_the_name_of_one_is_new_and_that_one_is_missing() {
        let named = |flight: &str, landed| {
            let outcome = outcome(Checked::Identical, landed, 0.5);
            BTreeMap::from([("a".to_owned(), Outcome { flight: Some(flight.to_owned()), ..outcome })])
        };
        let judged = judge(&named("landed", true), &Baseline::of(named("crashed", false)), 0.02);
        let mut changes: Vec<_> = judged.iter().map(|judged| judged.change.word()).collect();
        changes.sort_unstable();
        assert_eq!(changes, ["MISSING", "new"]);
        assert!(judged.iter().any(|judged| judged.fails(true)));
        let same = judge(&named("landed", true), &Baseline::of(named("landed", false)), 0.02);
        assert_eq!(same[0].change, Change::NowLands);
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
