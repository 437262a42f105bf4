//! The run loop of a replay: a screen and a recording, without a link or a log.

use std::io::{IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context as _;
use tokio::time::{MissedTickBehavior, interval};

use super::clock::Clock;
use super::lines::{self, Lines};
use super::screen::Screen;
use super::signals::Signals;
use crate::cli::{Cli, ReplayFrom};
use crate::config::Config;
use crate::exit::{self, Exit};
use crate::model::{Role, Settings, words};
use crate::replay::player::Player;
use crate::replay::recording::{Progress, Recording};
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

/// Shows a recorded flight until the person at the screen quits; without a screen, prints its events at once.
///
/// # Errors
/// The log cannot be read, the terminal failed, or the recording has no such phase.
pub async fn session(cli: &Cli, path: &Path, config: &Config, interactive: bool) -> anyhow::Result<Exit> {
    let mut told = 0;
    let newest = (path == Path::new(LAST)).then(|| newest_log(Path::new("."))).transpose()?;
    let path = newest.as_deref().unwrap_or(path);
    let vehicle = cli.vehicle_sysid.map(|_| cli.vehicle());
    let recording = Recording::load(path, vehicle, &mut |progress| tell(path, progress, &mut told))?;
    let damage = recording.damage.clone();
    let name = path.display().to_string();
    let settings = Settings {
        log_path: Some(name.clone()),
        role: Role::Replaying,
        keys: config.keys.clone(),
        ..Settings::on_screen(name)
    };
    let mut player = Player::new(recording, settings);
    match cli.from {
        None => {}
        Some(ReplayFrom::Time(at)) => player.seek(at),
        Some(ReplayFrom::Phase(phase)) => {
            let found = player.seek_phase(phase);
            anyhow::ensure!(
                found,
                "{} has no phase {}; it has {}",
                path.display(),
                words::phase(phase),
                player
                    .recording()
                    .phases
                    .iter()
                    .map(|(phase, _)| words::phase(*phase))
                    .collect::<Vec<_>>()
                    .join(", ")
            );
        }
    }
    if let Some(damage) = damage {
        player.model.warn(player.position(), format!("the log is damaged: {damage}"));
    }
    if interactive {
        watch(&mut player, config).await?;
    } else {
        player.seek(player.recording().length());
        Lines::new().show(&player.model);
    }
    lines::closing(&player.model, interactive, Ok(&None), player.position());
    Ok(exit::decide(&player.model.outcome, interactive && std::io::stdout().is_terminal()))
}

/// Reports every tenth of the progress while a large log is read.
fn tell(path: &Path, Progress { read, total }: Progress, told: &mut u64) {
    const LARGE_BYTES: u64 = 32_000_000;
    const MEGABYTE: u64 = 1_000_000;
    let tenths = (10 * read).checked_div(total).unwrap_or(0);
    if total > LARGE_BYTES && tenths > *told {
        *told = tenths;
        let (name, read, total) = (path.display(), read / MEGABYTE, total / MEGABYTE);
        // Progress goes to standard error, which may be closed.
        let _ = writeln!(std::io::stderr(), "ground: reading {name}: {read} of {total} MB");
    }
}

async fn watch(player: &mut Player, config: &Config) -> anyhow::Result<()> {
    let clock = Clock::start();
    let mut screen = Screen::open(config)?;
    let mut signals = Signals::listen()?;
    let mut steps = interval(STEP);
    steps.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let mut then = clock.now();
    loop {
        let redraw_at = screen.redraw_at();
        tokio::select! {
            biased;
            _ = signals.next() => return Ok(()),
            msg = screen.input() => match msg {
                Msg::Key(key) => {
                    for action in player.on_key(key) {
                        match action {
                            Action::Redraw => screen.clear(),
                            Action::NextTheme => screen.next_theme(),
                            Action::Quit => return Ok(()),
                            // What the ground did is part of the recording.
                            _ => {}
                        }
                    }
                    screen.mark_changed();
                }
                // Held or pasted keys count only if they scroll or move the time.
                Msg::Keys(keys) => {
                    for key in keys.into_iter().filter(|key| key.scrolls()) {
                        player.on_key(key);
                    }
                    screen.mark_changed();
                }
                Msg::Terminate(_) => return Ok(()),
                _ => screen.mark_changed(),
            },
            _ = steps.tick() => {
                let now = clock.now();
                let before = player.position();
                player.pass(now.saturating_sub(then));
                then = now;
                if player.position() != before {
                    screen.mark_changed();
                }
            }
            () = clock.sleep_until(Some(redraw_at)) => {}
        }
        screen.show(&player.model, clock.now(), player.position()).context("drawing on the terminal")?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_log_is_found_by_its_date() {
        let folder = tempfile::tempdir().unwrap();
        assert!(newest_log(folder.path()).unwrap_err().to_string().contains("give --replay a file"));
        for name in
            ["touchdown-20261120-064030.mcap", "touchdown-20261121-010203.mcap", "other.mcap", "x.tlog"]
        {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let found = newest_log(folder.path()).unwrap();
        assert_eq!(found.file_name().unwrap(), "touchdown-20261121-010203.mcap");
    }
}
