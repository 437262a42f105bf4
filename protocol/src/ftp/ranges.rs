//! Which bytes of a file are there.

use alloc::collections::BTreeMap;
use core::ops::Range;

/// A set of bytes, kept as ranges that neither touch nor overlap.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Ranges {
    /// Begin and end of each.
    ranges: BTreeMap<u32, u32>,
}

impl Ranges {
    /// Adds bytes; returns how many of them were not there before.
    pub fn add(&mut self, added: Range<u32>) -> u32 {
        if added.is_empty() {
            return 0;
        }
        let (mut begin, mut end) = (added.start, added.end);
        let mut known = 0;
        // Every range that touches the new one, from the last to the first.
        while let Some((&from, &to)) = self.ranges.range(..=end).next_back() {
            if to < begin {
                break;
            }
            known += to.min(added.end).saturating_sub(from.max(added.start));
            begin = begin.min(from);
            end = end.max(to);
            self.ranges.remove(&from);
        }
        self.ranges.insert(begin, end);
        added.end - added.start - known
    }

    /// The ranges, in order.
    pub fn iter(&self) -> impl Iterator<Item = Range<u32>> {
        self.ranges.iter().map(|(begin, end)| *begin..*end)
    }

    /// The ranges of a file of this length that are not there, in order.
    pub fn missing(&self, len: u32) -> impl Iterator<Item = Range<u32>> {
        let mut from = 0;
        let ends = self.iter().chain(core::iter::once(len..len));
        ends.map(move |there| {
            let gap = from.min(len)..there.start.min(len);
            from = there.end;
            gap
        })
        .filter(|gap| !gap.is_empty())
    }

    /// How many bytes are there.
    pub fn bytes(&self) -> u32 {
        self.iter().map(|range| range.end - range.start).sum()
    }

    /// Whether all bytes of a range are there.
    pub fn contains(&self, range: &Range<u32>) -> bool {
        let before = self.ranges.range(..=range.start).next_back();
        range.is_empty() || before.is_some_and(|(_, end)| *end >= range.end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn ranges_are_the_set_of_their_bytes(
            added in proptest::collection::vec((0u32..200, 0u32..40), 0..30),
            asked in (0u32..220, 0u32..30),
        ) {
            let mut ranges = Ranges::default();
            let mut bytes = std::collections::BTreeSet::new();
            for (begin, len) in added {
                let before = bytes.len();
                bytes.extend(begin..begin + len);
                prop_assert_eq!(ranges.add(begin..begin + len) as usize, bytes.len() - before);
            }
            prop_assert_eq!(ranges.bytes() as usize, bytes.len());
            let there: Vec<u32> = ranges.iter().flatten().collect();
            prop_assert_eq!(there, bytes.iter().copied().collect::<Vec<_>>());
            let missing: Vec<u32> = ranges.missing(220).flatten().collect();
            prop_assert_eq!(missing, (0..220).filter(|byte| !bytes.contains(byte)).collect::<Vec<_>>());
            let asked = asked.0..asked.0 + asked.1;
            prop_assert_eq!(ranges.contains(&asked), asked.clone().all(|byte| bytes.contains(&byte)));
            let mut last_end = None;
            for range in ranges.iter() {
                prop_assert!(last_end.is_none_or(|end| end < range.start), "they touch");
                last_end = Some(range.end);
            }
        }
    }
}
