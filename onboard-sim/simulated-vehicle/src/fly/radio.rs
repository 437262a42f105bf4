//! Simulates a broken radio, by simulated time: frames are lost or arrive late.

use std::collections::VecDeque;

use sim::sortie::Radio;

/// One direction of the radio.
pub(crate) struct Delayed<T> {
    /// Frames on their way with their arrival times, s, in the order they were sent.
    on_its_way: VecDeque<(f64, T)>,
}

impl<T> Default for Delayed<T> {
    fn default() -> Self {
        Self { on_its_way: VecDeque::new() }
    }
}

impl<T> Delayed<T> {
    /// The frames that arrive at a time; takes the frames sent at that time.
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
    fn a_working_radio_delays_nothing() {
        let mut radio = Delayed::default();
        assert_eq!(radio.pass(vec![1, 2], 0.0, WHOLE), [1, 2]);
        assert!(radio.pass(Vec::new(), 0.1, WHOLE).is_empty());
    }

    #[test]
    fn late_frames_arrive_in_order_and_none_is_lost() {
        let late = Radio { delay_s: 0.5, ..WHOLE };
        let mut radio = Delayed::default();
        assert!(radio.pass(vec!['a'], 0.0, late).is_empty());
        assert!(radio.pass(vec!['b'], 0.25, late).is_empty());
        assert_eq!(radio.pass(Vec::new(), 0.5, late), ['a']);
        // The radio works again: frames sent earlier still arrive first.
        assert!(radio.pass(vec!['c'], 0.625, WHOLE).is_empty());
        assert_eq!(radio.pass(Vec::new(), 0.75, WHOLE), ['b', 'c']);
    }

    #[test]
    fn a_silent_radio_also_loses_frames_on_their_way() {
        let late = Radio { delay_s: 0.5, ..WHOLE };
        let silent = Radio { silent: true, ..late };
        let mut radio = Delayed::default();
        radio.pass(vec!['a'], 0.0, late);
        assert!(radio.pass(vec!['b'], 0.1, silent).is_empty());
        assert!(radio.pass(Vec::new(), 1.0, late).is_empty());
    }
}
