//! Decides when the screen is drawn: soon after an input and at once after an important change, otherwise rarely enough for a slow
//! line and for the eye.

use std::time::Duration;

use protocol::dialect::TdPhase;

use crate::model::{Acknowledgement, CommandKind, Model, Page};
use crate::update::Msg;

/// The shortest time between two frames, for input and important changes.
const FRAME: Duration = Duration::from_millis(100);
/// The same for telemetry: numbers that change faster cannot be read.
const TELEMETRY_FRAME: Duration = Duration::from_millis(200);
/// So many bytes a frame of telemetry may write for each millisecond before it.
const BYTES_PER_MS: f64 = 1.2;
/// The longest time between two frames, because ages grow even if nothing arrives.
const IDLE_FRAME: Duration = Duration::from_secs(1);

/// The state whose changes are drawn at once.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Urgent {
    page: Page,
    phase: Option<TdPhase>,
    armed: Option<bool>,
    /// The number of unacknowledged alarms, and when the newest was raised.
    alarms: (usize, Option<Duration>),
    /// The progress of an abort.
    abort: Option<(Acknowledgement, bool)>,
}

impl Urgent {
    fn of(model: &Model) -> Self {
        let newest = model.alarms.list().iter().map(|alarm| alarm.raised_at).max();
        let abort = model.commands.of(CommandKind::Abort);
        Self {
            page: model.page(),
            phase: model.vehicle.phase_now(),
            armed: model.vehicle.armed().map(|armed| armed.value),
            alarms: (model.alarms.unacknowledged(), newest),
            abort: abort.map(|track| (track.acknowledged, track.observed_at.is_some())),
        }
    }
}

/// Computes when the next frame is due.
#[derive(Debug, Default)]
pub struct Pace {
    wait: Duration,
    /// The wait for telemetry after the frame that was drawn last.
    telemetry: Duration,
    drawn_at: Option<Duration>,
    drawn: Option<Urgent>,
}

impl Pace {
    /// A person has done something and waits for the result.
    pub fn mark_changed(&mut self) {
        self.wait = self.wait.min(FRAME);
    }

    /// A message was taken into the model; its kind decides how soon it must be drawn.
    pub fn mark_message(&mut self, msg: &Msg) {
        match msg {
            Msg::Frame(_) | Msg::Received { .. } => self.wait = self.wait.min(self.telemetry),
            // These change nothing that must be drawn within the next second.
            Msg::Tick | Msg::Sent { .. } | Msg::Links { .. } | Msg::HeardOver(_) | Msg::HeardFrom(_) => {}
            _ => self.mark_changed(),
        }
    }

    /// Checks whether an important state has changed.
    pub fn check_urgent(&mut self, model: &Model) {
        if self.drawn != Some(Urgent::of(model)) {
            self.mark_changed();
        }
    }

    /// When the next frame is due.
    pub fn redraw_at(&self) -> Duration {
        self.drawn_at.map_or(Duration::ZERO, |drawn_at| drawn_at + self.wait)
    }

    /// The terminal has not taken the previous frame yet, so drawing is postponed.
    pub fn postpone(&mut self, now: Duration) {
        (self.drawn_at, self.wait) = (Some(now), FRAME);
    }

    /// A frame of so many bytes was drawn.
    pub fn drew(&mut self, model: &Model, bytes: usize, now: Duration) {
        self.telemetry = TELEMETRY_FRAME.max(Duration::from_millis((bytes as f64 / BYTES_PER_MS) as u64));
        (self.drawn_at, self.wait, self.drawn) = (Some(now), IDLE_FRAME, Some(Urgent::of(model)));
    }
}
