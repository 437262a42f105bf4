//! Tracks how much a link has carried recently and how much room it has left.

use alloc::collections::VecDeque;

use protocol::hub::line::slowed;

use crate::streams::is_slow;

/// In any fifth of a second telemetry may take 22 % of the budget of one second, and answers and texts a sixth of it.
/// Otherwise a burst could spend the whole budget, and even vital messages would wait.
pub(super) const BRIEFLY_S: f64 = 0.2;

/// The share of telemetry, bytes. Over a slow line frames go one by one, so that there are no bursts.
pub(super) fn telemetry_briefly_bytes(capacity_bytes_s: u32) -> usize {
    if is_slow(capacity_bytes_s) { usize::MAX } else { capacity_bytes_s as usize * 22 / 100 }
}

/// The share of answers and texts, bytes.
pub(super) fn answers_briefly_bytes(capacity_bytes_s: u32) -> usize {
    if is_slow(capacity_bytes_s) { usize::MAX } else { capacity_bytes_s as usize / 6 }
}

/// A radio that has not reported for this long has no say any more, s.
const RADIO_REPORT_HOLDS_S: f64 = 10.0;

/// What a radio leaves of the budget: less while its buffer is full (RADIO_STATUS).
#[derive(Debug, Clone, Copy)]
pub(super) struct Radio {
    share: f64,
    reported_s: Option<f64>,
}

impl Default for Radio {
    fn default() -> Self {
        Self { share: 1.0, reported_s: None }
    }
}

impl Radio {
    pub(super) fn share(self) -> f64 {
        self.share
    }

    /// Takes a report: how much of its buffer is free, percent.
    pub(super) fn hear(&mut self, free_percent: u8, now_s: f64) {
        *self = Self { share: slowed(self.share, free_percent), reported_s: Some(now_s) };
    }

    pub(super) fn is_outdated(self, now_s: f64) -> bool {
        self.reported_s.is_some_and(|at_s| now_s - at_s > RADIO_REPORT_HOLDS_S)
    }
}

/// The bytes sent in a sliding window of time.
#[derive(Debug, Clone)]
pub(super) struct Window {
    span_s: f64,
    limit: usize,
    sent: VecDeque<(f64, usize)>,
    bytes: usize,
}

impl Window {
    /// A window of this length; it has no room until it gets a limit.
    pub(super) fn of(span_s: f64) -> Self {
        Self { span_s, limit: 0, sent: VecDeque::new(), bytes: 0 }
    }

    /// Sets the most bytes in any window from now on.
    pub(super) fn set_limit(&mut self, limit: usize) {
        self.limit = limit;
    }

    /// Drops bytes that were sent before the window.
    pub(super) fn move_to(&mut self, now_s: f64) {
        // Times are multiples of a frame; rounding must not keep an entry one frame too long.
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

    /// Notes bytes sent now.
    pub(super) fn take(&mut self, bytes: usize, now_s: f64) {
        self.sent.push_back((now_s, bytes));
        self.bytes += bytes;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::streams::WINDOW_S;

    #[test]
    fn sent_bytes_count_for_a_second_and_no_longer() {
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
