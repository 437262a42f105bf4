//! The output of a run: a full screen or lines.

use std::time::Duration;

use anyhow::Context as _;

use super::lines::Lines;
use super::screen::Screen;
use super::voice::VoiceEnded;
use crate::config::Config;
use crate::model::Model;
use crate::update::Msg;

/// The output of a run.
pub(super) enum Output {
    Screen(Box<Screen>),
    Lines(Lines),
}

impl Output {
    /// Opens a full screen if a person sits at the terminal, otherwise lines.
    ///
    /// # Errors
    /// The terminal cannot be prepared.
    pub(super) fn open(interactive: bool, config: &Config) -> anyhow::Result<Self> {
        if interactive {
            Screen::open(config).map(|screen| Self::Screen(Box::new(screen)))
        } else {
            Ok(Self::Lines(Lines::new()))
        }
    }

    /// Whether the terminal distinguishes a held key's repeats from presses.
    pub(super) fn reports_repeats(&self) -> bool {
        matches!(self, Self::Screen(screen) if screen.reports_repeats())
    }

    pub(super) fn redraw_at(&self) -> Option<Duration> {
        match self {
            Self::Screen(screen) => Some(screen.redraw_at()),
            Self::Lines(_) => None,
        }
    }

    /// The next input of the person at the terminal; waits for ever without one.
    pub(super) async fn input(&mut self) -> Msg {
        match self {
            Self::Screen(screen) => screen.input().await,
            Self::Lines(_) => std::future::pending().await,
        }
    }

    pub(super) fn mark_message(&mut self, msg: &Msg, model: &Model) {
        if let Self::Screen(screen) = self {
            screen.mark_message(msg, model);
        }
    }

    pub(super) fn mark_changed(&mut self) {
        if let Self::Screen(screen) = self {
            screen.mark_changed();
        }
    }

    pub(super) fn bell(&mut self) {
        if let Self::Screen(screen) = self {
            screen.bell();
        }
    }

    /// Calls a text out. Returns why nothing can be called out any more, once.
    pub(super) fn say(&mut self, text: &str) -> Option<VoiceEnded> {
        match self {
            Self::Screen(screen) => screen.say(text),
            Self::Lines(_) => None,
        }
    }

    pub(super) fn next_theme(&mut self) {
        if let Self::Screen(screen) = self {
            screen.next_theme();
        }
    }

    pub(super) fn clear(&mut self) {
        if let Self::Screen(screen) = self {
            screen.clear();
        }
    }

    /// Starts over with a new model.
    pub(super) fn start_over(&mut self) {
        match self {
            Self::Screen(screen) => screen.mark_changed(),
            Self::Lines(lines) => lines.start_over(),
        }
    }

    /// Shows the present state; `model_now` is the same moment on the model's clock.
    pub(super) fn show(&mut self, model: &Model, now: Duration, model_now: Duration) -> anyhow::Result<()> {
        match self {
            Self::Screen(screen) => screen.show(model, now, model_now).context("drawing on the terminal"),
            Self::Lines(lines) => {
                lines.show(model);
                Ok(())
            }
        }
    }
}
