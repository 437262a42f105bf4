//! What a broken radio does to what crosses it: nothing gets through, or it arrives late. By simulated time.

use std::collections::VecDeque;

use crate::craft::Radio;

/// One direction of the radio.
pub(crate) struct Delayed<T> {
    /// What is on its way, with the time it arrives, s; in the order it was sent.
    on_its_way: VecDeque<(f64, T)>,
}

impl<T> Default for Delayed<T> {
    fn default() -> Self {
        Self { on_its_way: VecDeque::new() }
    }
}

impl<T> Delayed<T> {
    /// What arrives at a time, of what is sent then and of what was sent before.
    pub(crate) fn pass(&mut self, sent: Vec<T>, time_s: f64, radio: Radio) -> Vec<T> {
        if radio.silent {
            self.on_its_way.clear();
            return Vec::new();
        }
        self.on_its_way.extend(sent.into_iter().map(|sent| (time_s + radio.delay_s, sent)));
        let arrived = self.on_its_way.iter().take_while(|(at_s, _)| *at_s <= time_s).count();
        self.on_its_way.drain(..arrived).map(|(_, sent)| sent).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHOLE: Radio = Radio { silent: false, delay_s: 0.0 };

    #[test]
    fn a_whole_radio_delays_nothing() {
        let mut radio = Delayed::default();
        assert_eq!(radio.pass(vec![1, 2], 0.0, WHOLE), [1, 2]);
        assert!(radio.pass(Vec::new(), 0.1, WHOLE).is_empty());
    }

    #[test]
    fn what_is_late_arrives_in_order_and_nothing_is_lost() {
        let late = Radio { delay_s: 0.5, ..WHOLE };
        let mut radio = Delayed::default();
        assert!(radio.pass(vec!['a'], 0.0, late).is_empty());
        assert!(radio.pass(vec!['b'], 0.25, late).is_empty());
        assert_eq!(radio.pass(Vec::new(), 0.5, late), ['a']);
        // Whole again: what was sent before still arrives first.
        assert!(radio.pass(vec!['c'], 0.625, WHOLE).is_empty());
        assert_eq!(radio.pass(Vec::new(), 0.75, WHOLE), ['b', 'c']);
    }

    #[test]
    fn a_silent_radio_swallows_what_was_on_its_way_too() {
        let late = Radio { delay_s: 0.5, ..WHOLE };
        let silent = Radio { silent: true, ..late };
        let mut radio = Delayed::default();
        radio.pass(vec!['a'], 0.0, late);
        assert!(radio.pass(vec!['b'], 0.1, silent).is_empty());
        assert!(radio.pass(Vec::new(), 1.0, late).is_empty());
    }
}
