//! How much a link carried in the last second, and what it has room for.

use std::collections::VecDeque;

/// The span that the budget holds for, s: a second, and the 20 ms by which a busy machine may send a frame late, so that
/// no second on the wire carries more.
pub(crate) const WINDOW_S: f64 = 1.02;

/// The bytes of the last second.
#[derive(Debug, Clone)]
pub(super) struct Window {
    limit: usize,
    sent: VecDeque<(f64, usize)>,
    bytes: usize,
}

impl Window {
    /// For this many bytes in any one second.
    pub(super) fn of(limit: usize) -> Self {
        Self { limit, sent: VecDeque::new(), bytes: 0 }
    }

    /// The same history under another limit.
    pub(super) fn set_limit(&mut self, limit: usize) {
        self.limit = limit;
    }

    /// What was sent a second ago no longer counts.
    pub(super) fn move_to(&mut self, now_s: f64) {
        // Times are multiples of a frame; rounding must not keep one of them for a frame more.
        while let Some((sent_s, bytes)) = self.sent.front()
            && now_s - sent_s >= WINDOW_S - 1e-9
        {
            self.bytes -= bytes;
            self.sent.pop_front();
        }
    }

    /// Bytes that may still be sent now.
    pub(super) fn room(&self) -> usize {
        self.limit.saturating_sub(self.bytes)
    }

    /// Takes note of bytes sent now.
    pub(super) fn take(&mut self, bytes: usize, now_s: f64) {
        self.sent.push_back((now_s, bytes));
        self.bytes += bytes;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_sent_counts_for_a_second_and_no_longer() {
        let mut window = Window::of(100);
        window.take(60, 0.0);
        window.take(40, 0.5);
        window.move_to(1.0);
        assert_eq!(window.room(), 0);
        window.move_to(WINDOW_S);
        assert_eq!(window.room(), 60);
        window.set_limit(30);
        assert_eq!(window.room(), 0);
        window.move_to(0.5 + WINDOW_S);
        assert_eq!(window.room(), 30);
    }
}
