//! Uses the wall clock for pacing and timing. Nothing here affects a decision.

use std::time::{Duration, Instant};

use super::Speed;

/// Who is waiting for the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Waiting {
    /// Unlimited: as fast as requested.
    Nobody,
    /// A crew at the pad: never faster than real time, because its station works in real time.
    Crew,
    /// The flight is over.
    Over,
}

/// Paces the frames.
pub(super) struct Pace {
    speed: Speed,
    frame: Duration,
    due: Instant,
    over_since: Option<Instant>,
    pub(super) lateness: Lateness,
}

/// How late frames began, while simulated time was paced: the jitter of the control loop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lateness {
    /// Frames by lateness, in steps of [`Lateness::STEP`]; the last holds all the later ones.
    frames: Vec<u64>,
    worst: Duration,
}

impl Lateness {
    const STEP: Duration = Duration::from_micros(100);
    const STEPS: usize = 500;

    pub(crate) fn new() -> Self {
        Self { frames: vec![0; Self::STEPS], worst: Duration::ZERO }
    }

    pub(crate) fn add(&mut self, late: Duration) {
        let step = (late.as_nanos() / Self::STEP.as_nanos()) as usize;
        self.frames[step.min(Self::STEPS - 1)] += 1;
        self.worst = self.worst.max(late);
    }

    /// The median, the 99th percentile (both rounded up to a tenth of a millisecond) and the worst;
    /// `None` if no frame was paced.
    pub fn quantiles(&self) -> Option<[Duration; 3]> {
        let total: u64 = self.frames.iter().sum();
        let quantile = |percent: u64| {
            let mut seen = 0;
            let step = self.frames.iter().position(|count| {
                seen += count;
                100 * seen >= percent * total
            });
            Self::STEP * (step.unwrap_or(Self::STEPS) as u32 + 1)
        };
        (total > 0).then(|| [quantile(50), quantile(99), self.worst])
    }
}

impl Pace {
    /// After the flight the links are served this long, so that the verdict arrives.
    const LINGER: Duration = Duration::from_millis(1500);
    /// After a suspend the loop does not race to catch up.
    const MAX_LAG: Duration = Duration::from_millis(500);

    #[expect(clippy::disallowed_methods, reason = "the run loop owns the clock")]
    pub(super) fn new(speed: Speed, frame_s: f64) -> Self {
        let now = Instant::now();
        Self {
            speed,
            frame: Duration::from_secs_f64(frame_s),
            due: now,
            over_since: None,
            lateness: Lateness::new(),
        }
    }

    #[expect(clippy::disallowed_methods, reason = "the run loop owns the clock")]
    pub(super) fn has_lingered(&mut self, linked: bool) -> bool {
        let now = Instant::now();
        let since = *self.over_since.get_or_insert(now);
        !linked || now.duration_since(since) >= Self::LINGER
    }

    #[expect(clippy::disallowed_methods, reason = "the run loop owns the clock")]
    pub(super) async fn wait(&mut self, waiting: Waiting) {
        let factor = match (self.speed, waiting) {
            (Speed::Max, Waiting::Nobody) => {
                tokio::task::yield_now().await;
                self.due = Instant::now();
                return;
            }
            (Speed::Max, Waiting::Crew | Waiting::Over) => 1.0,
            (Speed::Factor(factor), Waiting::Crew) => factor.min(1.0),
            (Speed::Factor(factor), Waiting::Nobody | Waiting::Over) => factor,
        };
        self.due += self.frame.div_f64(factor);
        let now = Instant::now();
        if now > self.due + Self::MAX_LAG {
            self.due = now;
        }
        tokio::time::sleep_until(self.due.into()).await;
        self.lateness.add(Instant::now().saturating_duration_since(self.due));
    }
}
