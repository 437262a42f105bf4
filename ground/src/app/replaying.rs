//! Replays a recording on a screen, without a link.

use std::io::{IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context as _;
use protocol::identity::Address;
use tokio::time::{MissedTickBehavior, interval};

use super::clock::{Clock, Signals};
use super::output::{self, Lines, Output};
use crate::cli::ReplayFrom;
use crate::config::Config;
use crate::exit;
use crate::exit::Exit;
use crate::model::{Role, Settings, words};
use crate::replay::Player;
use crate::replay::recording::Recording;
use crate::update::{Action, Msg};

/// How often the time moves on.
const STEP: Duration = Duration::from_millis(100);

/// Stands for the newest log in the current directory.
const LAST: &str = "last";

/// The newest log that has the usual name, which begins with its date.
fn newest_log(folder: &Path) -> anyhow::Result<PathBuf> {
    let entries = std::fs::read_dir(folder).context("looking for the last log")?;
    let is_mcap = |name: &str| Path::new(name).extension().is_some_and(|ending| ending == "mcap");
    let is_log = |name: &str| name.starts_with("touchdown-") && is_mcap(name);
    let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let newest = names.filter(|name| is_log(name)).max();
    newest
        .map(|name| folder.join(name))
        .context("the current directory has no touchdown-*.mcap; give --replay a file")
}

/// Shows a recorded flight until the person at the screen quits; without a screen, prints its
/// events at once.
///
/// # Errors
/// The log cannot be read, the terminal failed, or the recording has no such phase.
pub async fn session(
    path: &Path,
    vehicle: Option<Address>,
    from: Option<ReplayFrom>,
    config: &Config,
    interactive: bool,
) -> anyhow::Result<Exit> {
    let newest = (path == Path::new(LAST)).then(|| newest_log(Path::new("."))).transpose()?;
    let path = newest.as_deref().unwrap_or(path);
    announce(path);
    let recording = Recording::load(path, vehicle)?;
    let damage = recording.damage.clone();
    let mut player = Player::new(recording, settings(&path.display().to_string()));
    match from {
        None => {}
        Some(ReplayFrom::Time(at)) => player.seek(at),
        Some(ReplayFrom::Phase(phase)) => {
            let found = player.seek_phase(phase);
            let has = player.recording().phases.iter().map(|(phase, _)| words::phase(*phase));
            let (path, has) = (path.display(), has.collect::<Vec<_>>().join(", "));
            anyhow::ensure!(found, "{path} has no phase {}; it has {has}", words::phase(phase));
        }
    }
    if let Some(damage) = damage {
        player.model.warn(player.position(), format!("the log is damaged: {damage}"));
    }
    if interactive {
        watch(&mut player, config).await?;
    } else {
        player.seek(player.recording().length);
        Lines::default().show(&player.model);
    }
    output::closing(&player.model, interactive, Ok(&None), player.position());
    Ok(exit::decide(&player.model.outcome, interactive && std::io::stdout().is_terminal()))
}

/// The settings of a screen that shows this recording.
fn settings(log: &str) -> Settings {
    Settings { log_path: Some(log.to_owned()), role: Role::Replaying, ..Settings::on_screen(log) }
}

/// Announces that a large log takes a while.
fn announce(path: &Path) {
    const LARGE_BYTES: u64 = 32_000_000;
    let bytes = std::fs::metadata(path).map_or(0, |about| about.len());
    if bytes > LARGE_BYTES {
        // Standard error may be closed.
        let _ = writeln!(std::io::stderr(), "ground: reading {}, {} MB", path.display(), bytes / 1_000_000);
    }
}

async fn watch(player: &mut Player, config: &Config) -> anyhow::Result<()> {
    let clock = Clock::start();
    let mut output = Output::open(true, config)?;
    let mut signals = Signals::listen()?;
    let mut steps = interval(STEP);
    steps.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let mut then = clock.now();
    loop {
        let redraw_at = output.redraw_at();
        tokio::select! {
            biased;
            _ = signals.next() => return Ok(()),
            msg = output.input() => {
                output.mark_changed();
                let actions = typed(player, &msg);
                if actions.contains(&Action::Quit) || matches!(msg, Msg::Terminate(_)) {
                    return Ok(());
                }
                let now = player.position();
                for action in actions {
                    output.act(&action, &mut player.model, now);
                }
            }
            _ = steps.tick() => {
                let now = clock.now();
                let before = player.position();
                player.pass(now.saturating_sub(then));
                then = now;
                if player.position() != before {
                    output.mark_changed();
                }
            }
            () = clock.sleep_until(redraw_at) => {}
        }
        output.show(&player.model, clock.now(), player.position())?;
    }
}

/// Applies typed keys to a replay. Returns the actions for the screen: the ground's actions are
/// part of the recording. Held or pasted keys count only if they scroll or move the time.
fn typed(player: &mut Player, msg: &Msg) -> Vec<Action> {
    let Msg::Keys(keys) = msg else { return Vec::new() };
    let mut actions = Vec::new();
    for key in keys {
        // Letters of a text may come faster.
        if keys.len() == 1 || key.scrolls() || player.model.pages.entry.is_some() {
            actions.extend(player.on_key(*key));
        }
    }
    actions.retain(|one| matches!(one, Action::Bell | Action::Redraw | Action::NextTheme | Action::Quit));
    actions
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_log_is_found_by_its_date() {
        let folder = tempfile::tempdir().unwrap();
        let none = newest_log(folder.path()).unwrap_err().to_string();
        assert_eq!(none, "the current directory has no touchdown-*.mcap; give --replay a file");
        for name in
            ["touchdown-20261120-064030.mcap", "touchdown-20261121-010203.mcap", "other.mcap", "x.tlog"]
        {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let found = newest_log(folder.path()).unwrap();
        assert_eq!(found.file_name().unwrap(), "touchdown-20261121-010203.mcap");
    }
}
