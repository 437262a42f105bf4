//! Plays a recorded flight on the same screens.
//!
//! [`recording`] reads a log; [`Player`] turns its events into messages for the same `update` that
//! handles live frames. Nothing is sent or recorded.

pub mod recording;

use std::sync::Arc;
use std::time::Duration;

use protocol::dialect::TdPhase;

use crate::key::Key;
use crate::model::{Model, Playback, Settings};
use crate::update::{Action, Msg, update};
use recording::{Reader, RecordedEvent, Recording};

// Plays a recording: pause, speed, seek. It reads no clock; the caller passes the elapsed time.

/// The tick period, as in the live run loop.
const TICK: Duration = Duration::from_millis(100);
/// How far Left and Right seek.
const SEEK: Duration = Duration::from_secs(5);
/// The range of speeds, as powers of two.
const SPEED_EXPONENTS: std::ops::RangeInclusive<i32> = -3..=6;

/// A recording and the present position in it.
pub struct Player {
    recording: Recording,
    settings: Settings,
    /// The model at the present position.
    pub model: Model,
    position: Duration,
    next_tick: Duration,
    /// The rest of the recording; `None` after a read error.
    reader: Option<Reader>,
    next_event: Option<(Duration, RecordedEvent)>,
    paused: bool,
    speed_exponent: i32,
}

impl Player {
    /// Starts at the beginning, running.
    pub fn new(recording: Recording, settings: Settings) -> Self {
        let settings = Settings { vehicle: recording.vehicle.unwrap_or(settings.vehicle), ..settings };
        let mut player = Self {
            model: Model::new(settings.clone()),
            recording,
            settings,
            position: Duration::ZERO,
            next_tick: Duration::ZERO,
            reader: None,
            next_event: None,
            paused: false,
            speed_exponent: 0,
        };
        player.rewind();
        player.advance_to(Duration::ZERO);
        player
    }

    /// The present position.
    pub fn position(&self) -> Duration {
        self.position
    }

    pub fn recording(&self) -> &Recording {
        &self.recording
    }

    /// Lets this much real time pass.
    pub fn pass(&mut self, elapsed: Duration) {
        if !self.paused {
            let target = self.position + elapsed.mul_f64(libm::exp2(f64::from(self.speed_exponent)));
            self.advance_to(target.min(self.recording.length));
        }
    }

    /// Goes to a time. To go back, the recording is played again from its start.
    pub fn seek(&mut self, to: Duration) {
        let to = to.min(self.recording.length);
        if to < self.position {
            let pages = std::mem::take(&mut self.model.pages);
            self.model = Model::new(self.settings.clone());
            self.model.pages = pages;
            (self.position, self.next_tick) = (Duration::ZERO, Duration::ZERO);
            self.rewind();
        }
        self.advance_to(to);
    }

    /// Goes to the start of a phase. Returns whether the recording has it.
    pub fn seek_phase(&mut self, phase: TdPhase) -> bool {
        let begin = self.recording.begin_of(phase);
        if let Some(at) = begin {
            self.seek(at);
        }
        begin.is_some()
    }

    /// Handles a key. Returns what the screen is to do.
    pub fn on_key(&mut self, key: Key) -> Vec<Action> {
        let mut actions = Vec::new();
        match key {
            // A text that is being typed takes every key.
            _ if self.model.pages.entry.is_some() => {
                actions = update(&mut self.model, Msg::Keys(vec![key]), self.position);
            }
            Key::Char(' ') => self.paused = !self.paused,
            Key::Char('+' | '=') => self.faster(1),
            Key::Char('-') => self.faster(-1),
            Key::Left => self.seek(self.position.saturating_sub(SEEK)),
            Key::Right => self.seek(self.position + SEEK),
            // The start of the present phase, or of the previous one if it has just begun.
            Key::Char('[') => {
                let limit = self.position.saturating_sub(Duration::from_secs(1));
                let begins = self.recording.phases.iter().rfind(|(_, at)| *at <= limit);
                self.seek(begins.map_or(Duration::ZERO, |(_, at)| *at));
            }
            Key::Char(']') => {
                let begins = self.recording.phases.iter().find(|(_, at)| *at > self.position);
                self.seek(begins.map_or(Duration::MAX, |(_, at)| *at));
            }
            Key::Char('g') => self.seek(Duration::ZERO),
            Key::Char('G') => self.seek(self.recording.length),
            // Pages and scrolling. Keys that command a vehicle have no effect in a replay.
            _ => actions = update(&mut self.model, Msg::Keys(vec![key]), self.position),
        }
        // A key to quit waits for a paste to show itself; a replay has nothing to protect.
        if self.model.quit_at.take().is_some() {
            actions.push(Action::Quit);
        }
        self.update_playing();
        actions
    }

    fn faster(&mut self, doublings: i32) {
        let (least, most) = (*SPEED_EXPONENTS.start(), *SPEED_EXPONENTS.end());
        self.speed_exponent = (self.speed_exponent + doublings).clamp(least, most);
    }

    fn rewind(&mut self) {
        match self.recording.reader() {
            Ok(reader) => self.reader = Some(reader),
            Err(error) => self.stop_reading(&error),
        }
        self.next_event = self.read_event();
    }

    fn read_event(&mut self) -> Option<(Duration, RecordedEvent)> {
        match self.reader.as_mut()?.next_event() {
            Ok(event) => event,
            Err(error) => {
                self.stop_reading(&error);
                None
            }
        }
    }

    fn stop_reading(&mut self, error: &std::io::Error) {
        self.reader = None;
        self.model.warn(self.position, format!("the log can no longer be read: {error}"));
    }

    fn advance_to(&mut self, to: Duration) {
        loop {
            let event_at = self.next_event.as_ref().map(|(at, _)| *at).filter(|at| *at <= to);
            let tick_at = Some(self.next_tick).filter(|at| *at <= to);
            match (event_at, tick_at) {
                (None, None) => break,
                (Some(event), tick) if tick.is_none_or(|tick| event <= tick) => {
                    let next = self.read_event();
                    if let Some((_, shown)) = std::mem::replace(&mut self.next_event, next) {
                        self.show(shown, event);
                    }
                }
                (_, tick) => {
                    let tick = tick.unwrap_or(to);
                    drop(update(&mut self.model, Msg::Tick, tick));
                    self.next_tick = tick + TICK;
                }
            }
        }
        self.position = to;
        self.update_playing();
    }

    fn show(&mut self, event: RecordedEvent, at: Duration) {
        let msgs = match event {
            RecordedEvent::Heard(frame) => {
                let (bytes, framing) = (frame.as_bytes().len(), self.model.link.framing);
                vec![Msg::Frame(frame), Msg::Received { bytes, framing }]
            }
            RecordedEvent::Commanded(kind) => vec![Msg::Commanded(kind)],
            RecordedEvent::Sent(bytes) => vec![Msg::Sent { bytes, drops: 0 }],
        };
        for msg in msgs {
            // The actions are dropped: what the ground did is part of the recording.
            drop(update(&mut self.model, msg, at));
        }
    }

    fn update_playing(&mut self) {
        self.model.playing = Some(Playback {
            position: self.position,
            length: self.recording.length,
            speed: libm::exp2(f64::from(self.speed_exponent)),
            paused: self.paused,
            phases: Arc::clone(&self.recording.phases),
        });
    }
}
