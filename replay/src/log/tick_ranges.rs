//! The set of tick numbers in a log, without the ticks.

use std::collections::BTreeMap;

use serde::Serialize;

/// A set of tick numbers, stored as runs.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TickRanges {
    /// First number of each run, and its last.
    runs: BTreeMap<u64, u64>,
    repeated: u64,
}

/// A gap between two ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Gap {
    /// The last tick before the gap.
    pub after: u64,
    /// The first tick after the gap.
    pub before: u64,
}

impl TickRanges {
    /// Adds a number.
    pub fn insert(&mut self, tick: u64) {
        let left = self.runs.range(..=tick).next_back().map(|(first, last)| (*first, *last));
        if left.is_some_and(|(_, last)| tick <= last) {
            self.repeated += 1;
            return;
        }
        let first = match left {
            Some((first, last)) if last.checked_add(1) == Some(tick) => first,
            _ => tick,
        };
        let behind = tick.checked_add(1).and_then(|next| self.runs.remove(&next));
        self.runs.insert(first, behind.unwrap_or(tick));
    }

    /// The lowest and the highest number.
    pub fn bounds(&self) -> Option<(u64, u64)> {
        Some((*self.runs.first_key_value()?.0, *self.runs.last_key_value()?.1))
    }

    pub fn repeated(&self) -> u64 {
        self.repeated
    }

    /// The gaps between the lowest and the highest number.
    pub fn gaps(&self) -> impl Iterator<Item = Gap> {
        let behind = self.runs.keys().skip(1);
        self.runs.values().zip(behind).map(|(last, first)| Gap { after: *last, before: *first })
    }
}

impl Gap {
    /// How many ticks are missing.
    pub fn missing(&self) -> u64 {
        self.before.saturating_sub(self.after).saturating_sub(1)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn runs_and_gaps_are_those_of_a_plain_set(numbers in prop::collection::vec(0..40_u64, 1..60)) {
            let mut ranges = TickRanges::default();
            for number in &numbers {
                ranges.insert(*number);
            }
            let set: BTreeSet<u64> = numbers.iter().copied().collect();
            let (first, last) = ranges.bounds().unwrap();
            prop_assert_eq!(Some(&first), set.first());
            prop_assert_eq!(Some(&last), set.last());
            let missing: BTreeSet<u64> = ranges.gaps().flat_map(|gap| gap.after + 1..gap.before).collect();
            let expected: BTreeSet<u64> = (first..=last).filter(|number| !set.contains(number)).collect();
            prop_assert_eq!(missing, expected);
            prop_assert_eq!(ranges.repeated() as usize, numbers.len() - set.len());
        }
    }

    #[test]
    fn the_ends_of_the_numbers_do_not_overflow() {
        let mut ranges = TickRanges::default();
        for number in [u64::MAX, 0, u64::MAX - 1, u64::MAX] {
            ranges.insert(number);
        }
        assert_eq!(ranges.bounds(), Some((0, u64::MAX)));
        assert_eq!(ranges.gaps().map(|gap| gap.missing()).sum::<u64>(), u64::MAX - 2);
    }
}
