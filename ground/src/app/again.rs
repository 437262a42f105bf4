//! The flight just flown, again on the screen of a running station. The link, the log and the alarms go on; an alarm, the
//! abort key, or a vehicle that is armed end the replay at once.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::Duration;

use crate::key::Key;
use crate::model::{Model, Role, Settings};
use crate::replay::player::Player;
use crate::replay::recording::Recording;
use crate::update::{Action, Msg};

/// The replay of a screen.
#[derive(Default)]
pub(super) struct Again {
    /// A log is being read.
    loading: Option<(PathBuf, Receiver<Result<Recording, String>>)>,
    playing: Option<Box<Player>>,
    /// Until when the replay has been moved on.
    then: Duration,
}

impl Again {
    /// Reads the log in a thread of its own: a long one must not delay the link.
    pub(super) fn begin(&mut self, path: &Path) -> Result<(), String> {
        let (tell, told) = sync_channel(1);
        let log = path.to_owned();
        std::thread::Builder::new()
            .name("replay".to_owned())
            .spawn(move || {
                let loaded = Recording::load(&log, None, &mut |_| {}).map_err(|error| error.to_string());
                // The screen may have ended.
                let _ = tell.send(loaded);
            })
            .map_err(|error| error.to_string())?;
        self.loading = Some((path.to_owned(), told));
        Ok(())
    }

    /// Lets time pass. Returns whether the screen has to be drawn.
    ///
    /// # Errors
    /// The log cannot be shown.
    pub(super) fn pass(&mut self, model: &Model, now: Duration) -> Result<bool, String> {
        if model.is_at_risk() {
            return Ok(self.leave());
        }
        let passed = now.saturating_sub(std::mem::replace(&mut self.then, now));
        if let Some(player) = &mut self.playing {
            let before = player.position();
            player.pass(passed);
            return Ok(player.position() != before);
        }
        let Some((path, told)) = &self.loading else { return Ok(false) };
        let Ok(loaded) = told.try_recv() else { return Ok(false) };
        let name = path.display().to_string();
        self.loading = None;
        let settings = Settings {
            log_path: Some(name.clone()),
            role: Role::Replaying,
            keys: model.settings.keys.clone(),
            ..Settings::on_screen(name)
        };
        self.playing = Some(Box::new(Player::new(loaded?, settings)));
        Ok(true)
    }

    /// Ends the replay. Returns whether there was one.
    pub(super) fn leave(&mut self) -> bool {
        self.loading = None;
        self.playing.take().is_some()
    }

    /// Takes what was typed while a replay is shown. Returns what the live screen has to do, and what of the message is
    /// for it: everything but keys, and the abort.
    pub(super) fn take(&mut self, msg: Msg) -> (Vec<Action>, Option<Msg>) {
        if self.playing.is_none() {
            return (Vec::new(), Some(msg));
        }
        let typed = match &msg {
            Msg::Key(key) => vec![*key],
            Msg::Keys(keys) => keys.clone(),
            Msg::Pasted => Vec::new(),
            _ => return (Vec::new(), Some(msg)),
        };
        if typed.contains(&Key::CtrlX) {
            self.leave();
        }
        let Some(player) = &mut self.playing else { return (Vec::new(), Some(msg)) };
        // Held or pasted keys count only if they scroll or move the time.
        let several = matches!(msg, Msg::Keys(_));
        let keys = typed.into_iter().filter(|key| !several || key.scrolls());
        let actions: Vec<Action> = keys.flat_map(|key| player.on_key(key)).collect();
        if actions.contains(&Action::Quit) {
            self.leave();
        }
        let screens = |action: &Action| matches!(action, Action::Redraw | Action::NextTheme);
        (actions.into_iter().filter(screens).collect(), None)
    }

    /// What is shown instead of the live model, and its time.
    pub(super) fn shown(&self) -> Option<(&Model, Duration)> {
        self.playing.as_ref().map(|player| (&player.model, player.position()))
    }
}
