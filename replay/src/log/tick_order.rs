//! Sorts ticks by number, whatever their order in the file.

use std::collections::BTreeMap;

use protocol::log::v1::ControllerTick;

/// How many ticks may wait for a tick that comes later in the file. At 10 Hz this is far more than a recorder's queue
/// can reorder; a tick that is still missing then counts as lost.
const WINDOW_TICKS: usize = 256;

/// The number of the first tick a controller runs.
const FIRST_TICK: u64 = 0;

/// An item of the ordered sequence.
#[derive(Debug, Clone, PartialEq)]
pub enum Ordered {
    /// The next tick.
    Tick(Box<ControllerTick>),
    /// Ticks are missing before the next tick in the log.
    Missing {
        /// The first missing tick.
        from: u64,
        /// The next tick in the log.
        next: u64,
    },
    /// A repeated tick.
    Repeated { tick: u64 },
}

/// Orders ticks by number, with bounded memory.
#[derive(Debug, Default)]
pub struct TickOrder {
    waiting: BTreeMap<u64, Box<ControllerTick>>,
    next: u64,
}

impl TickOrder {
    /// Expects the first tick.
    pub fn new() -> Self {
        Self { waiting: BTreeMap::new(), next: FIRST_TICK }
    }

    /// Takes the next tick from the file.
    pub fn push(&mut self, tick: Box<ControllerTick>) -> Option<Ordered> {
        let number = tick.input.tick;
        if number < self.next || self.waiting.contains_key(&number) {
            return Some(Ordered::Repeated { tick: number });
        }
        self.waiting.insert(number, tick);
        None
    }

    /// The next tick in order, if it is known; call until `None` after every [`push`](Self::push), and once more
    /// with `at_end` when the log has ended.
    pub fn pop(&mut self, at_end: bool) -> Option<Ordered> {
        let first = self.waiting.first_entry()?;
        let number = *first.key();
        if number == self.next {
            self.next = number.saturating_add(1);
            return Some(Ordered::Tick(first.remove()));
        }
        if !at_end && self.waiting.len() < WINDOW_TICKS {
            return None;
        }
        let from = std::mem::replace(&mut self.next, number);
        Some(Ordered::Missing { from, next: number })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn tick(number: u64) -> Box<ControllerTick> {
        let mut tick = ControllerTick::default();
        tick.input.tick = number;
        Box::new(tick)
    }

    fn ordered(numbers: impl IntoIterator<Item = u64>) -> Vec<String> {
        let mut order = TickOrder::new();
        let mut seen = Vec::new();
        let mut note = |ordered: Ordered| {
            seen.push(match ordered {
                Ordered::Tick(tick) => tick.input.tick.to_string(),
                Ordered::Missing { from, next } => format!("{from}..{next} missing"),
                Ordered::Repeated { tick } => format!("{tick} repeated"),
            });
        };
        for number in numbers {
            order.push(tick(number)).into_iter().for_each(&mut note);
            while let Some(next) = order.pop(false) {
                note(next);
            }
        }
        while let Some(next) = order.pop(true) {
            note(next);
        }
        seen
    }

    #[test]
    fn a_gap_and_a_repetition_are_announced_where_they_are() {
        assert_eq!(ordered([0, 2, 1, 5]), ["0", "1", "2", "3..5 missing", "5"]);
        assert_eq!(ordered([3]), ["0..3 missing", "3"]);
        assert_eq!(ordered([0, 0, 1]), ["0", "0 repeated", "1"]);
        assert_eq!(ordered([u64::MAX, u64::MAX]).len(), 3);
    }

    #[test]
    fn a_lost_tick_does_not_hold_up_the_rest_for_ever() {
        let mut order = TickOrder::new();
        for number in 1..=WINDOW_TICKS as u64 {
            assert_eq!(order.pop(false), None);
            assert_eq!(order.push(tick(number)), None);
        }
        assert_eq!(order.pop(false), Some(Ordered::Missing { from: 0, next: 1 }));
    }

    proptest! {
        #[test]
        fn any_shuffle_within_the_window_comes_out_in_order(
            numbers in Just((0..200_u64).collect::<Vec<_>>()).prop_shuffle()
        ) {
            let expected: Vec<String> = (0..200_u64).map(|number| number.to_string()).collect();
            prop_assert_eq!(ordered(numbers), expected);
        }
    }
}
