//! Decides when the screen is drawn: soon after an input, and less often otherwise.
//!
//! A terminal that answers at once gets ten frames a second in flight. Over a slow line frames are
//! limited in bytes. Important changes are drawn at once in any case, but the pictures of a flight,
//! which are most of the bytes, once a second.

use std::collections::VecDeque;
use std::time::Duration;

use protocol::dialect::TdPhase;
use ratatui::backend::Backend;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::{CompletedFrame, Terminal};

use crate::model::{Acknowledgement, CommandKind, Model, Page};
use crate::update::Msg;
use crate::view::{self, Theme};

/// The shortest time between two frames, for input and important changes.
const FRAME: Duration = Duration::from_millis(100);
/// The same in flight, for telemetry: numbers that change faster cannot be read.
const FLIGHT_FRAME: Duration = Duration::from_millis(200);
/// The same on the pad and after a flight, for telemetry, to save a slow line.
const CALM_FRAME: Duration = Duration::from_millis(500);
/// The longest time between two frames, because ages grow even if nothing arrives.
const IDLE_FRAME: Duration = Duration::from_secs(1);
/// The shortest time between two drawings of the pictures of a flight over a slow line.
const PICTURES: Duration = Duration::from_secs(1);

/// A terminal that answers within this time is fast, if it had to take so many bytes just before: a
/// line of 2 kB/s takes 100 ms for them.
const FAST: Duration = Duration::from_millis(50);
/// A fast terminal is slow once an answer takes this long. Below it, a busy computer is more likely
/// than a slow line.
const SLOW: Duration = Duration::from_millis(150);
/// The shortest time between two frames in flight on a fast terminal: no tenth of a second of the
/// clock is left out.
const FAST_FRAME: Duration = Duration::from_millis(90);
const FAST_BYTES: usize = 200;

/// While the terminal has not taken what was written so long ago, nothing new is drawn: it would be
/// seen late.
const LATE: Duration = Duration::from_millis(500);
/// An answer that has not come for so long is lost: a whole page of 140x45 takes 3.2 s over 2 kB/s.
const LOST_AFTER: Duration = Duration::from_secs(5);

/// The bytes written are counted over this time.
const WINDOW: Duration = Duration::from_secs(1);
/// Cells of an 80x24 terminal.
const SMALL_CELLS: u32 = 80 * 24;
/// How many bytes per second frames that can wait may use: numbers and pictures once a second. The
/// rest of the 5 kB (80x24) or 8 kB per second is left for a frame that cannot wait: a change of
/// page takes up to 3 kB at 80x24.
const SMALL_ROOM_BYTES: usize = 1_000;
const LARGE_ROOM_BYTES: usize = 1_200;

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

/// The pictures of a flight, as they were drawn.
#[derive(Debug)]
struct Pictures {
    place: (Page, Rect),
    drawn_at: Duration,
    cells: Buffer,
}

/// Computes when the next frame is due, from what has happened and how much was written.
#[derive(Debug, Default)]
pub struct Pace {
    wait: Duration,
    drawn_at: Option<Duration>,
    drawn: Option<Urgent>,
    /// Whether the next frame is drawn although the line is busy.
    urgent: bool,
    /// Whether it has new pictures in any case.
    with_pictures: bool,
    pictures: Option<Pictures>,
    cells: u32,
    /// When the terminal was queried, if it has not answered yet; and how long its last answer
    /// took.
    queried_at: Option<Duration>,
    took: Option<Duration>,
    /// Bytes of the frame that was written with the open query.
    query_bytes: usize,
    /// Whether the terminal takes a frame as soon as it is written.
    is_fast: bool,
    /// Answers show nothing about the line.
    never_fast: bool,
    /// The frames of the last second: when they were drawn, and their bytes.
    written: VecDeque<(Duration, usize)>,
}

impl Pace {
    /// `never_fast` if answers show nothing about the line.
    pub fn new(never_fast: bool) -> Self {
        Self { never_fast, ..Self::default() }
    }

    /// Whether the terminal is still late with its answer: then it is slow.
    pub fn check_answer(&mut self, now: Duration) {
        self.is_fast &= self.waits(now).is_none_or(|waits| waits <= SLOW);
    }

    /// A person has pressed a key and waits for the result.
    pub fn mark_changed(&mut self) {
        self.mark_urgent();
        self.with_pictures = true;
    }

    fn mark_urgent(&mut self) {
        self.wait = self.wait.min(FRAME);
        self.urgent = true;
    }

    /// A message was taken into the model; its kind decides how soon it must be drawn.
    pub fn mark_message(&mut self, msg: &Msg, model: &Model) {
        match msg {
            // These change nothing that must be drawn within the next second.
            Msg::Tick
            | Msg::Sent { .. }
            | Msg::Links { .. }
            | Msg::OverLink(_)
            | Msg::FromSource(_)
            | Msg::Here(_) => {}
            Msg::Frame(_) | Msg::Received { .. }
                if model.vehicle.in_flight() || model.vehicle.counts_down() =>
            {
                self.wait = self.wait.min(FLIGHT_FRAME);
            }
            Msg::Frame(_) | Msg::Received { .. } => self.wait = self.wait.min(CALM_FRAME),
            _ => self.mark_changed(),
        }
    }

    /// Checks whether an important state has changed.
    pub fn check_urgent(&mut self, model: &Model) {
        if self.drawn != Some(Urgent::of(model)) {
            self.mark_urgent();
        }
    }

    /// Draws a frame, with the pictures of the one before if they wait. `model_now` is the same
    /// moment on the model's clock.
    ///
    /// # Errors
    /// The terminal cannot be written.
    pub fn draw<'t, B: Backend>(
        &mut self,
        terminal: &'t mut Terminal<B>,
        model: &Model,
        theme: Theme,
        (now, model_now): (Duration, Duration),
    ) -> Result<CompletedFrame<'t>, B::Error> {
        terminal.draw(|frame| {
            let place = view::draw(model, theme, model_now, frame).map(|area| (model.page(), area));
            let is_fast = self.is_fast;
            let waits = |before: &Pictures| {
                !is_fast && Some(before.place) == place && now < before.drawn_at + PICTURES
            };
            self.pictures = match self.pictures.take().filter(|before| !self.with_pictures && waits(before)) {
                Some(before) => {
                    frame.buffer_mut().merge(&before.cells);
                    Some(before)
                }
                None => place.map(|place| {
                    let cells = place.1.positions().map(|at| frame.buffer_mut()[at].clone());
                    let cells = Buffer { area: place.1, content: cells.collect() };
                    Pictures { place, drawn_at: now, cells }
                }),
            };
        })
    }

    /// When the next frame is due.
    pub fn redraw_at(&self) -> Duration {
        let Some(drawn_at) = self.drawn_at else { return Duration::ZERO };
        let due = drawn_at + self.wait;
        if self.urgent || self.is_fast { due } else { due.max(self.room_at()) }
    }

    /// When the line has room for another frame.
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

    /// Returns whether to query the terminal behind the written frame: one query at a time, so that
    /// a lost answer has no further effect.
    pub fn begins_query(&mut self, now: Duration) -> bool {
        let begins = self.waits(now).is_none_or(|waits| waits > LOST_AFTER);
        if begins {
            self.queried_at = Some(now);
            let with_it = self.written.back().filter(|(at, _)| *at == now);
            self.query_bytes = with_it.map_or(0, |(_, bytes)| *bytes);
        }
        begins
    }

    /// The terminal has answered.
    pub fn answered(&mut self, now: Duration) {
        let took = self.waits(now).unwrap_or(Duration::ZERO);
        // A few bytes pass any line quickly.
        let is_proven = self.queried_at.is_some() && self.query_bytes >= FAST_BYTES && took <= FAST;
        self.is_fast = took <= SLOW && (self.is_fast || is_proven && !self.never_fast);
        self.took = Some(took);
        self.queried_at = None;
    }

    fn waits(&self, now: Duration) -> Option<Duration> {
        self.queried_at.map(|at| now.saturating_sub(at))
    }

    /// Age of the shown frame; zero for a terminal that has never answered.
    pub fn late(&self, now: Duration) -> Duration {
        self.took.map_or(Duration::ZERO, |took| took.max(self.waits(now).unwrap_or(Duration::ZERO)))
    }

    /// Whether written frames still wait, so that a new frame would only wait behind them.
    pub fn waits_for_terminal(&self, now: Duration) -> bool {
        self.took.is_some() && self.waits(now).is_some_and(|waits| (LATE..LOST_AFTER).contains(&waits))
    }

    /// The terminal has not taken the previous frame yet, so drawing is postponed.
    pub fn postpone(&mut self, now: Duration) {
        (self.drawn_at, self.wait) = (Some(now), FRAME);
    }

    /// A frame of this many cells and bytes was drawn.
    pub fn drew(&mut self, model: &Model, cells: u32, bytes: usize, now: Duration) {
        (self.drawn_at, self.wait) = (Some(now), IDLE_FRAME);
        (self.urgent, self.with_pictures) = (false, false);
        self.drawn = Some(Urgent::of(model));
        self.cells = cells;
        if self.is_fast && (model.vehicle.in_flight() || model.vehicle.counts_down()) {
            self.wait = FAST_FRAME;
        }
        self.written.push_back((now, bytes));
        while self.written.front().is_some_and(|(at, _)| *at + WINDOW <= now) {
            self.written.pop_front();
        }
    }
}
