//! When the screen is drawn: soon where a person waits for it, seldom where nobody does, and never so often that a slow line
//! carries nothing else. What must be seen at once is drawn at once, whatever it costs.

use std::collections::VecDeque;
use std::time::Duration;

use protocol::dialect::TdPhase;

use crate::model::Model;
use crate::model::command::{Acknowledged, CommandKind};
use crate::model::page::Page;
use crate::update::Msg;

/// At most ten frames a second, while it matters.
const FRAME: Duration = Duration::from_millis(100);
/// In flight, for what the radio brings: numbers that change more often than this cannot be read.
const FLIGHT_FRAME: Duration = Duration::from_millis(200);
/// On the pad and after a flight, for what only the radio brings: a slow line has other things to carry.
const CALM_FRAME: Duration = Duration::from_millis(500);
/// Ages grow even if nothing arrives.
const IDLE_FRAME: Duration = Duration::from_secs(1);

/// What is written is counted over this time.
const WINDOW: Duration = Duration::from_secs(1);
/// Cells of an 80x24 terminal.
const SMALL_CELLS: u32 = 80 * 24;
/// Bytes that frames which can wait may bring any second to. What is left below the 5 and 8 kB of every second is for the one
/// frame that cannot: another page, whole, takes up to 3 kB at 80x24.
const SMALL_ROOM_BYTES: usize = 1_400;
const LARGE_ROOM_BYTES: usize = 1_400;

/// What is drawn at once when it changes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Urgent {
    page: Page,
    phase: Option<TdPhase>,
    armed: Option<bool>,
    /// Alarms that nobody has seen, and when the newest was raised.
    alarms: (usize, Option<Duration>),
    /// What became of an abort.
    abort: Option<(Acknowledged, bool)>,
}

impl Urgent {
    fn of(model: &Model) -> Self {
        let newest = model.alarms.list().iter().map(|alarm| alarm.raised_at).max();
        let abort = model.commands.of(CommandKind::Abort);
        Self {
            page: model.page(),
            phase: model.vehicle.phase().map(|phase| phase.value),
            armed: model.vehicle.armed().map(|armed| armed.value),
            alarms: (model.alarms.unacknowledged(), newest),
            abort: abort.map(|track| (track.acknowledged, track.observed_at.is_some())),
        }
    }
}

/// Says when the next frame is due, by what has happened and what was written.
#[derive(Debug, Default)]
pub struct Pace {
    wait: Duration,
    drawn_at: Option<Duration>,
    drawn: Option<Urgent>,
    /// The next frame does not wait for room on the line.
    urgent: bool,
    cells: u32,
    /// When frames were drawn within the last second, and their bytes.
    written: VecDeque<(Duration, usize)>,
}

impl Pace {
    /// A person has done something, and waits for it.
    pub fn mark_changed(&mut self) {
        self.wait = self.wait.min(FRAME);
        self.urgent = true;
    }

    /// A message was taken into the model: how soon it must be seen.
    pub fn mark_message(&mut self, msg: &Msg, model: &Model) {
        let counting = model.vehicle.countdown_s().is_some_and(|time| time.value > 0.0);
        match msg {
            // Time and what was sent change nothing that must be seen before the next second.
            Msg::Tick | Msg::Sent { .. } | Msg::Links { .. } | Msg::HeardOver(_) => {}
            Msg::Frame(_) | Msg::Received { .. } if model.vehicle.in_flight() || counting => {
                self.wait = self.wait.min(FLIGHT_FRAME);
            }
            Msg::Frame(_) | Msg::Received { .. } => self.wait = self.wait.min(CALM_FRAME),
            _ => self.mark_changed(),
        }
    }

    /// Looks whether something must be seen at once.
    pub fn look(&mut self, model: &Model) {
        if self.drawn != Some(Urgent::of(model)) {
            self.mark_changed();
        }
    }

    /// When the next frame is due.
    pub fn redraw_at(&self) -> Duration {
        let Some(drawn_at) = self.drawn_at else { return Duration::ZERO };
        let due = drawn_at + self.wait;
        if self.urgent { due } else { due.max(self.room_at()) }
    }

    /// When a frame like the last one that could wait has room.
    fn room_at(&self) -> Duration {
        let room = if self.cells > SMALL_CELLS { LARGE_ROOM_BYTES } else { SMALL_ROOM_BYTES };
        let mut left: usize = self.written.iter().map(|(_, bytes)| bytes).sum();
        let next = self.written.iter().map(|(_, bytes)| *bytes).min().unwrap_or(0);
        let mut room_at = Duration::ZERO;
        for (at, bytes) in &self.written {
            if left + next <= room {
                break;
            }
            left -= bytes;
            room_at = *at + WINDOW;
        }
        room_at
    }

    /// The terminal has not taken the frame before yet: what is drawn later is as it is then.
    pub fn put_off(&mut self, now: Duration) {
        (self.drawn_at, self.wait) = (Some(now), FRAME);
    }

    /// A frame was drawn, of this many cells and bytes.
    pub fn drew(&mut self, model: &Model, cells: u32, bytes: usize, now: Duration) {
        (self.drawn_at, self.wait, self.urgent) = (Some(now), IDLE_FRAME, false);
        self.drawn = Some(Urgent::of(model));
        self.cells = cells;
        self.written.push_back((now, bytes));
        while self.written.front().is_some_and(|(at, _)| *at + WINDOW <= now) {
            self.written.pop_front();
        }
    }
}
