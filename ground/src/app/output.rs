//! Who looks: a full screen, or lines.

use std::time::Duration;

use anyhow::Context as _;

use super::lines::Lines;
use super::screen::Screen;
use crate::model::Model;
use crate::update::Msg;

/// Where a run is shown.
pub(super) enum Output {
    Screen(Screen),
    Lines(Lines),
}

impl Output {
    pub(super) fn redraw_at(&self) -> Option<Duration> {
        match self {
            Self::Screen(screen) => Some(screen.redraw_at()),
            Self::Lines(_) => None,
        }
    }

    /// What the person at the terminal does; never, without one.
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

    pub(super) fn bell(&self) {
        if let Self::Screen(screen) = self {
            screen.bell();
        }
    }

    pub(super) fn clear(&mut self) {
        if let Self::Screen(screen) = self {
            screen.clear();
        }
    }

    pub(super) fn show(&mut self, model: &Model, now: Duration) -> anyhow::Result<()> {
        match self {
            Self::Screen(screen) => screen.show(model, now).context("drawing on the terminal"),
            Self::Lines(lines) => {
                lines.show(model);
                Ok(())
            }
        }
    }
}
