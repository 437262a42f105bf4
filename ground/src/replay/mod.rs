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
use recording::{Reader, Recording};

// Plays a recording: pause, speed, seek. It reads no clock; the caller passes the elapsed time.

/// The tick period, as in the live run loop.
const TICK: Duration = Duration::from_millis(100);
/// How far Left and Right seek.
const SEEK: Duration = Duration::from_secs(5);
/// The range of speeds, recorded time per real time.
const SPEED_MIN: f64 = 0.125;
const SPEED_MAX: f64 = 64.0;

/// A recording and the present position in it.
pub struct Player {
    recording: Recording,
    settings: Settings,
    /// The model at the present position.
    pub model: Model,
    playing: Playback,
    next_tick: Duration,
    /// The rest of the recording; `None` after a read error.
    reader: Option<Reader>,
    next_event: Option<(Duration, Msg)>,
}

impl Player {
    /// Starts at the beginning, running.
    pub fn new(recording: Recording, settings: Settings) -> Self {
        let vehicle = recording.vehicle.unwrap_or(settings.vehicle);
        let settings = Settings { vehicle, field: recording.field.clone(), ..settings };
        let (length, began, phases) = (recording.length, recording.began, Arc::clone(&recording.phases));
        let mut player = Self {
            model: Model::new(settings.clone()),
            playing: Playback { position: Duration::ZERO, length, speed: 1.0, paused: false, began, phases },
            recording,
            settings,
            next_tick: Duration::ZERO,
            reader: None,
            next_event: None,
        };
        player.rewind();
        player.advance_to(Duration::ZERO);
        player
    }

    /// The present position.
    pub fn position(&self) -> Duration {
        self.playing.position
    }

    pub fn recording(&self) -> &Recording {
        &self.recording
    }

    /// Lets this much real time pass.
    pub fn pass(&mut self, elapsed: Duration) {
        if !self.playing.paused {
            let target = self.playing.position + elapsed.mul_f64(self.playing.speed);
            self.advance_to(target.min(self.recording.length));
        }
    }

    /// Goes to a time. To go back, the recording is played again from its start.
    pub fn seek(&mut self, to: Duration) {
        let to = to.min(self.recording.length);
        if to < self.playing.position {
            let pages = std::mem::take(&mut self.model.pages);
            self.model = Model::new(self.settings.clone());
            self.model.pages = pages;
            (self.playing.position, self.next_tick) = (Duration::ZERO, Duration::ZERO);
            self.rewind();
        }
        self.advance_to(to);
    }

    /// Goes to the start of a phase. Returns whether the recording has it.
    pub fn seek_phase(&mut self, phase: TdPhase) -> bool {
        let phases = &self.recording.phases;
        let begin = phases.iter().find(|(known, _)| *known == phase).map(|(_, at)| *at);
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
                actions = update(&mut self.model, Msg::Keys(vec![key]), self.playing.position);
            }
            Key::Char(' ') => self.playing.paused = !self.playing.paused,
            Key::Char('+' | '=') => self.faster(2.0),
            Key::Char('-') => self.faster(0.5),
            Key::Left => self.seek(self.playing.position.saturating_sub(SEEK)),
            Key::Right => self.seek(self.playing.position + SEEK),
            // The start of the present phase, or of the previous one if it has just begun.
            Key::Char('[') => {
                let limit = self.playing.position.saturating_sub(Duration::from_secs(1));
                let begins = self.recording.phases.iter().rfind(|(_, at)| *at <= limit);
                self.seek(begins.map_or(Duration::ZERO, |(_, at)| *at));
            }
            Key::Char(']') => {
                let begins = self.recording.phases.iter().find(|(_, at)| *at > self.playing.position);
                self.seek(begins.map_or(Duration::MAX, |(_, at)| *at));
            }
            Key::Char('g') => self.seek(Duration::ZERO),
            Key::Char('G') => self.seek(self.recording.length),
            // Pages and scrolling. Keys that command a vehicle have no effect in a replay.
            _ => actions = update(&mut self.model, Msg::Keys(vec![key]), self.playing.position),
        }
        // A key to quit waits for a paste to show itself; a replay has nothing to protect.
        if self.model.quit_at.take().is_some() {
            actions.push(Action::Quit);
        }
        self.model.playing = Some(self.playing.clone());
        actions
    }

    fn faster(&mut self, factor: f64) {
        self.playing.speed = (self.playing.speed * factor).clamp(SPEED_MIN, SPEED_MAX);
    }

    fn rewind(&mut self) {
        match self.recording.reader() {
            Ok(reader) => self.reader = Some(reader),
            Err(error) => self.stop_reading(&error),
        }
        self.next_event = self.read_event();
    }

    fn read_event(&mut self) -> Option<(Duration, Msg)> {
        let event = self.reader.as_mut()?.next()?;
        event.inspect_err(|error| self.stop_reading(error)).ok()
    }

    fn stop_reading(&mut self, error: &std::io::Error) {
        self.reader = None;
        self.model.warn(self.playing.position, format!("the log can no longer be read: {error}"));
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
        self.playing.position = to;
        self.model.playing = Some(self.playing.clone());
    }

    fn show(&mut self, event: Msg, at: Duration) {
        let received = match &event {
            Msg::Frame(frame) => {
                let (bytes, framing) = (frame.as_bytes().len(), self.model.link.framing);
                Some(Msg::Received { bytes, framing })
            }
            _ => None,
        };
        for msg in [event].into_iter().chain(received) {
            // The actions are dropped: what the ground did is part of the recording.
            drop(update(&mut self.model, msg, at));
        }
    }
}
