//! The wall clock's part: pacing and timing, and nothing that decides.

use std::time::{Duration, Instant};

use super::Speed;

/// Paces the frames.
pub(super) struct Pace {
    speed: Speed,
    frame: Duration,
    began: Instant,
    due: Instant,
    over_since: Option<Instant>,
}

impl Pace {
    /// After the flight the links are served this long, so that the verdict arrives.
    const LINGER: Duration = Duration::from_millis(1500);
    /// A machine that slept does not race to catch up.
    const MAX_LAG: Duration = Duration::from_millis(500);

    #[expect(clippy::disallowed_methods, reason = "the run loop owns the clock")]
    pub(super) fn new(speed: Speed, frame_s: f64) -> Self {
        let now = Instant::now();
        Self { speed, frame: Duration::from_secs_f64(frame_s), began: now, due: now, over_since: None }
    }

    pub(super) fn clock(&self) -> Instant {
        self.began
    }

    #[expect(clippy::disallowed_methods, reason = "the run loop owns the clock")]
    pub(super) fn has_lingered(&mut self, linked: bool) -> bool {
        let now = Instant::now();
        let since = *self.over_since.get_or_insert(now);
        !linked || now.duration_since(since) >= Self::LINGER
    }

    #[expect(clippy::disallowed_methods, reason = "the run loop owns the clock")]
    pub(super) async fn wait(&mut self, real_time: bool) {
        let factor = match self.speed {
            Speed::Max if real_time => 1.0,
            Speed::Max => {
                tokio::task::yield_now().await;
                self.due = Instant::now();
                return;
            }
            Speed::Factor(factor) => factor,
        };
        self.due += self.frame.div_f64(factor);
        let now = Instant::now();
        if now > self.due + Self::MAX_LAG {
            self.due = now;
        }
        tokio::time::sleep_until(self.due.into()).await;
    }
}
