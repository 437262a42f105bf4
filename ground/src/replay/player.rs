//! Time over a film: pause, speed, seek. Pure: it is told how much time has passed.

use std::time::Duration;

use protocol::dialect::TdPhase;

use super::film::{Film, Reel, Scene};
use crate::key::Key;
use crate::model::page::Page;
use crate::model::{Model, Playing, Settings};
use crate::update::{Msg, update};

/// The clock of a replay ticks as the run loop's does.
const TICK: Duration = Duration::from_millis(100);
/// Left and Right.
const SEEK: Duration = Duration::from_secs(5);
/// Slowest and fastest, in powers of two.
const SPEED_EXPONENTS: std::ops::RangeInclusive<i32> = -3..=6;

/// A film and where it is.
pub struct Player {
    film: Film,
    settings: Settings,
    /// The state at the present position.
    pub model: Model,
    position: Duration,
    next_tick: Duration,
    /// The rest of the film; `None` if its file could not be read any more.
    reel: Option<Reel>,
    next_scene: Option<(Duration, Scene)>,
    paused: bool,
    speed_exponent: i32,
}

impl Player {
    /// At the start, running.
    pub fn new(film: Film, settings: Settings) -> Self {
        let settings = Settings { vehicle: film.vehicle.unwrap_or(settings.vehicle), ..settings };
        let mut player = Self {
            model: Model::new(settings.clone()),
            film,
            settings,
            position: Duration::ZERO,
            next_tick: Duration::ZERO,
            reel: None,
            next_scene: None,
            paused: false,
            speed_exponent: 0,
        };
        player.rewind();
        player.advance_to(Duration::ZERO);
        player
    }

    /// Where it is.
    pub fn position(&self) -> Duration {
        self.position
    }

    /// Whether everything was shown.
    pub fn ended(&self) -> bool {
        self.position >= self.film.length()
    }

    /// Times and phases of the film.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// So much real time has passed.
    pub fn pass(&mut self, elapsed: Duration) {
        if !self.paused {
            let target = self.position + elapsed.mul_f64(libm::exp2(f64::from(self.speed_exponent)));
            self.advance_to(target.min(self.film.length()));
        }
    }

    /// Goes to a time; back means: from the start again.
    pub fn seek(&mut self, to: Duration) {
        let to = to.min(self.film.length());
        if to < self.position {
            let pages = self.model.pages;
            self.model = Model::new(self.settings.clone());
            self.model.pages = pages;
            (self.position, self.next_tick) = (Duration::ZERO, Duration::ZERO);
            self.rewind();
        }
        self.advance_to(to);
    }

    /// Goes to the begin of a phase. Returns whether the film has it.
    pub fn seek_phase(&mut self, phase: TdPhase) -> bool {
        let begin = self.film.begin_of(phase);
        if let Some(at) = begin {
            self.seek(at);
        }
        begin.is_some()
    }

    /// A key. Returns whether to quit.
    pub fn on_key(&mut self, key: Key) -> bool {
        match key {
            Key::Char('q' | 'Q') | Key::CtrlC => return true,
            Key::Char(' ') => self.paused = !self.paused,
            Key::Char('+' | '=') => self.faster(1),
            Key::Char('-') => self.faster(-1),
            Key::Left => self.seek(self.position.saturating_sub(SEEK)),
            Key::Right => self.seek(self.position + SEEK),
            Key::Char('[') => self.seek(self.phase_before()),
            Key::Char(']') => self.seek(self.phase_behind()),
            Key::Char('g') => self.seek(Duration::ZERO),
            Key::Char('G') => self.seek(self.film.length()),
            Key::Char('r') if self.model.page() == Page::Parameters => {}
            // Screens and scrolling. What commands a vehicle finds none here.
            _ => drop(update(&mut self.model, Msg::Key(key), self.position)),
        }
        self.tell();
        false
    }

    fn faster(&mut self, doublings: i32) {
        let (least, most) = (*SPEED_EXPONENTS.start(), *SPEED_EXPONENTS.end());
        self.speed_exponent = (self.speed_exponent + doublings).clamp(least, most);
    }

    /// The begin of this phase, or of the one before if this has just begun.
    fn phase_before(&self) -> Duration {
        let limit = self.position.saturating_sub(Duration::from_secs(1));
        let mut begins = self.film.phases.iter().map(|(_, at)| *at);
        begins.rfind(|at| *at <= limit).unwrap_or(Duration::ZERO)
    }

    fn phase_behind(&self) -> Duration {
        let mut begins = self.film.phases.iter().map(|(_, at)| *at);
        begins.find(|at| *at > self.position).unwrap_or_else(|| self.film.length())
    }

    fn rewind(&mut self) {
        match self.film.reel() {
            Ok(reel) => self.reel = Some(reel),
            Err(error) => self.break_off(&error),
        }
        self.next_scene = self.read_scene();
    }

    fn read_scene(&mut self) -> Option<(Duration, Scene)> {
        match self.reel.as_mut()?.next_scene() {
            Ok(scene) => scene,
            Err(error) => {
                self.break_off(&error);
                None
            }
        }
    }

    fn break_off(&mut self, error: &std::io::Error) {
        self.reel = None;
        self.model.warn(self.position, format!("the log cannot be read any more: {error}"));
    }

    fn advance_to(&mut self, to: Duration) {
        loop {
            let scene_at = self.next_scene.as_ref().map(|(at, _)| *at).filter(|at| *at <= to);
            let tick_at = Some(self.next_tick).filter(|at| *at <= to);
            match (scene_at, tick_at) {
                (None, None) => break,
                (Some(scene), tick) if tick.is_none_or(|tick| scene <= tick) => {
                    let next = self.read_scene();
                    if let Some((_, shown)) = std::mem::replace(&mut self.next_scene, next) {
                        self.show(shown, scene);
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
        self.tell();
    }

    fn show(&mut self, scene: Scene, at: Duration) {
        let msgs = match scene {
            Scene::Heard(frame) => {
                let (bytes, framing) = (frame.as_bytes().len(), self.model.link.framing);
                vec![Msg::Frame(frame), Msg::Received { bytes, framing }]
            }
            Scene::Commanded(kind) => vec![Msg::Commanded(kind)],
            Scene::Sent(bytes) => vec![Msg::Sent { bytes, drops: 0 }],
        };
        for msg in msgs {
            // What the ground did then is in the film; nothing is done again.
            drop(update(&mut self.model, msg, at));
        }
    }

    fn tell(&mut self) {
        self.model.playing = Some(Playing {
            position: self.position,
            length: self.film.length(),
            speed: libm::exp2(f64::from(self.speed_exponent)),
            paused: self.paused,
        });
    }
}
