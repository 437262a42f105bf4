//! Compares two folders of logs: landing rates with intervals, flights that changed sides, and the
//! distributions of the touchdowns.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Result;
use onboard_sim::run::in_parallel;
use onboard_sim::statistics::{Share, quantile, sorted};
use protocol::program::Exit;
use serde::Serialize;
use statrs::distribution::{Binomial, DiscreteCDF as _};

use crate::cli::{Answer, logs_of};
use crate::info::described;
use crate::log::Verdict;
use crate::print::columns;

/// A chance result this rare counts as a difference.
const SIGNIFICANT: f64 = 0.05;

/// Two-sided probability that chance alone splits flips so unevenly (exact McNemar test).
pub(crate) fn chance_of_flips(saved: usize, lost: usize) -> f64 {
    let flips = Binomial::new(0.5, (saved + lost) as u64);
    flips.map_or(1.0, |flips| (2.0 * flips.cdf(saved.min(lost) as u64)).min(1.0))
}

/// Statement about flips, and whether they show a difference.
pub(crate) fn flips_in_words(saved: usize, lost: usize) -> String {
    let chance = chance_of_flips(saved, lost);
    let shows = if chance < SIGNIFICANT { "a difference" } else { "no difference" };
    format!("saves {saved} and loses {lost}: shows {shows} (exact McNemar test, p = {chance:.2})")
}

/// A flight that stands undamaged in one of the sets only.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Flip {
    pub flight: String,
    /// Outcomes in the first and in the second set.
    pub endings: [String; 2],
    pub saved: bool,
}

/// One set of flights.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FlightSet {
    pub folder: String,
    /// Flights with a verdict.
    pub flights: usize,
    pub stands: usize,
    /// Landing rate with its 95 % interval (Wilson).
    pub rate: [f64; 3],
    /// 5 %, median and 95 % of each value at contact.
    pub at_contact: BTreeMap<String, [f64; 3]>,
    /// Logs without a verdict, with the reason.
    pub without_verdict: Vec<String>,
}

/// Two sets of flights.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SetComparison {
    pub sets: [FlightSet; 2],
    /// Flights that both sets have, by seed and number, or else by file name.
    pub paired: usize,
    pub saved: usize,
    pub lost: usize,
    /// Probability of such flips by chance.
    pub chance: f64,
    pub flips: Vec<Flip>,
    /// Flights of one set only.
    pub unpaired: [Vec<String>; 2],
}

type Verdicts = BTreeMap<String, Verdict>;

/// The verdicts of a folder by flight, and the logs without one.
fn verdicts(folder: &Path) -> Result<(Verdicts, Vec<String>)> {
    let logs = logs_of(folder)?;
    let found = in_parallel(&logs, |log| described(log), &|_| {});
    let (mut verdicts, mut without) = (Verdicts::new(), Vec::new());
    for (log, found) in logs.iter().zip(found) {
        let name = log.strip_prefix(folder).unwrap_or(log).display().to_string();
        let info = match found {
            Ok(info) => info,
            Err(error) => {
                without.push(format!("{name}: {:#}", anyhow::Error::from(error)));
                continue;
            }
        };
        let drawn = info.run.get("seed").zip(info.run.get("flight"));
        let flight = drawn.map_or(name.clone(), |(seed, number)| format!("seed {seed}, flight {number}"));
        match info.verdict {
            // A second log of one flight, such as a station's, is another flight of the table.
            Some(verdict) if !verdicts.contains_key(&flight) => _ = verdicts.insert(flight, verdict),
            Some(verdict) => _ = verdicts.insert(name, verdict),
            None => without.push(format!("{name}: {}", info.ending.as_deref().unwrap_or("no verdict"))),
        }
    }
    Ok((verdicts, without))
}

fn set(folder: &Path, verdicts: &Verdicts, without_verdict: Vec<String>) -> FlightSet {
    let stands = verdicts.values().filter(|verdict| verdict.landing.stands).count();
    let Share { share, low, high, .. } = Share::new(stands as u64, verdicts.len() as u64);
    let mut values: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for limit in
        verdicts.values().flat_map(Verdict::of_the_legs).filter(|limit| limit.maximum > limit.minimum)
    {
        let name = format!("{} {}", limit.name, limit.unit);
        values.entry(name.trim_end().to_owned()).or_default().push(limit.value);
    }
    let at_contact = values.into_iter().filter_map(|(name, values)| {
        let values = sorted(values.into_iter());
        let [low, median, high] = [0.05, 0.5, 0.95].map(|share| quantile(&values, share));
        Some((name, [low?, median?, high?]))
    });
    FlightSet {
        folder: folder.display().to_string(),
        flights: verdicts.len(),
        stands,
        rate: [share, low, high],
        at_contact: at_contact.collect(),
        without_verdict,
    }
}

/// Compares the flights of two folders.
///
/// # Errors
/// A folder cannot be read, or holds no log.
pub fn compare_sets(first: &Path, second: &Path) -> Result<SetComparison> {
    let (before, without_before) = verdicts(first)?;
    let (after, without_after) = verdicts(second)?;
    let both = before.iter().filter_map(|(flight, then)| Some((flight, then, after.get(flight)?)));
    let both: Vec<_> = both.collect();
    let flipped = both.iter().filter(|(_, then, now)| then.landing.stands != now.landing.stands);
    let flips: Vec<Flip> = flipped
        .map(|(flight, then, now)| Flip {
            flight: (*flight).clone(),
            endings: [then.ending.clone(), now.ending.clone()],
            saved: now.landing.stands,
        })
        .collect();
    let saved = flips.iter().filter(|flip| flip.saved).count();
    let lost = flips.len() - saved;
    let only = |one: &Verdicts, other: &Verdicts| {
        one.keys().filter(|flight| !other.contains_key(*flight)).cloned().collect()
    };
    Ok(SetComparison {
        sets: [set(first, &before, without_before), set(second, &after, without_after)],
        paired: both.len(),
        saved,
        lost,
        chance: chance_of_flips(saved, lost),
        flips,
        unpaired: [only(&before, &after), only(&after, &before)],
    })
}

impl Answer for SetComparison {
    fn sentences(&self) -> Vec<String> {
        let Self { sets, paired, saved, lost, flips, unpaired, .. } = self;
        let rate = |set: &FlightSet| {
            let [rate, low, high] = set.rate.map(|share| 100.0 * share);
            let FlightSet { folder, flights, stands, .. } = set;
            format!(
                "{folder}: {stands} of {flights} stand undamaged: {rate:.1} %, 95 % interval {low:.1} to {high:.1} %"
            )
        };
        let mut lines: Vec<String> = sets.iter().map(rate).collect();
        lines.push(format!("of {paired} flights of both the second {}", flips_in_words(*saved, *lost)));
        lines.extend(flips.iter().map(|Flip { flight, endings: [then, now], saved }| {
            let what = if *saved { "saved" } else { "LOST " };
            format!("  {what}  {flight}: {then}; now {now}")
        }));
        let head = ["at contact, 5 %, median and 95 %", "first", "second"].map(str::to_owned);
        let cell = |set: &FlightSet, name: &str| {
            let values = set.at_contact.get(name);
            values.map_or("-".to_owned(), |[low, median, high]| format!("{low:.3}  {median:.3}  {high:.3}"))
        };
        let names = sets[0]
            .at_contact
            .keys()
            .chain(sets[1].at_contact.keys().filter(|name| !sets[0].at_contact.contains_key(*name)));
        let rows = names.map(|name| [name.clone(), cell(&sets[0], name), cell(&sets[1], name)]);
        lines.extend(columns(['<', '>', '>'], std::iter::once(head).chain(rows)));
        for (set, unpaired) in sets.iter().zip(unpaired) {
            let only = |flight: &String| format!("only in {}: {flight}", set.folder);
            lines.extend(unpaired.iter().map(only));
            lines.extend(set.without_verdict.iter().map(|log| format!("not counted: {}/{log}", set.folder)));
        }
        lines
    }

    /// No if the second set lands less often than chance explains, or a flight is missing in it.
    fn outcome(&self) -> Exit {
        let worse = self.lost > self.saved && self.chance < SIGNIFICANT;
        let missing =
            !self.unpaired[0].is_empty() || self.sets.iter().any(|set| !set.without_verdict.is_empty());
        Exit::of(!worse && !missing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of n fair coins none or all fall on one side with twice 2^-n; one of six with 14 of 64.
    #[test]
    fn val_hand_the_chance_of_flips() {
        let cases =
            [([0, 0], 1.0), ([1, 0], 1.0), ([5, 0], 2.0 / 32.0), ([0, 6], 2.0 / 64.0), ([5, 1], 14.0 / 64.0)];
        for ([saved, lost], expected) in cases {
            assert!((chance_of_flips(saved, lost) - expected).abs() < 1e-12, "{saved} {lost}");
        }
        assert!(
            flips_in_words(1, 0).contains("shows no difference")
                && flips_in_words(0, 6).contains("a difference")
        );
    }
}
