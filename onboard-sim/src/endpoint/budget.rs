//! How much a link carried just now, and what it has room for.

use std::collections::VecDeque;

/// The span that the budget holds for, s: a second, and the 20 ms by which a busy machine may send a frame late, so that
/// no second on the wire carries more.
pub(crate) const WINDOW_S: f64 = 1.02;

/// In a fifth of a second telemetry may take a fifth of the budget and a tenth of that, answers and texts a sixth of it: after
/// a burst the whole budget would be spent, and even what the crew lives by would wait.
pub(super) const BRIEFLY_S: f64 = 0.2;

/// That share for telemetry, bytes.
pub(super) fn telemetry_briefly_bytes(capacity_bytes_s: u32) -> usize {
    capacity_bytes_s as usize * 22 / 100
}

/// That share for answers and texts, bytes.
pub(super) fn answers_briefly_bytes(capacity_bytes_s: u32) -> usize {
    capacity_bytes_s as usize / 6
}

/// The bytes of the time just past.
#[derive(Debug, Clone)]
pub(super) struct Window {
    span_s: f64,
    limit: usize,
    sent: VecDeque<(f64, usize)>,
    bytes: usize,
}

impl Window {
    /// Of this length; it has no room until it is given a limit.
    pub(super) fn of(span_s: f64) -> Self {
        Self { span_s, limit: 0, sent: VecDeque::new(), bytes: 0 }
    }

    /// So many bytes at most in any such time, from now on.
    pub(super) fn set_limit(&mut self, limit: usize) {
        self.limit = limit;
    }

    /// What was sent longer ago no longer counts.
    pub(super) fn move_to(&mut self, now_s: f64) {
        // Times are multiples of a frame; rounding must not keep one of them for a frame more.
        while let Some((sent_s, bytes)) = self.sent.front()
            && now_s - sent_s >= self.span_s - 1e-9
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
        let mut window = Window::of(WINDOW_S);
        assert_eq!(window.room(), 0);
        window.set_limit(100);
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
