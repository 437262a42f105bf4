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

/// The newest log that has the usual name, which begins with its date, and a flight to show. Newer
/// ones are reported.
fn newest_flight(folder: &Path, vehicle: Option<Address>) -> anyhow::Result<(PathBuf, Recording)> {
    let entries = std::fs::read_dir(folder).context("looking for the last log")?;
    let is_mcap = |name: &str| Path::new(name).extension().is_some_and(|ending| ending == "mcap");
    let is_log = |name: &String| name.starts_with("touchdown-") && is_mcap(name);
    let mut names: Vec<String> =
        entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok()).filter(is_log).collect();
    names.sort_unstable();
    for name in names.iter().rev() {
        let path = folder.join(name);
        announce(&path);
        match Recording::load(&path, vehicle) {
            Ok(recording) => return Ok((path, recording)),
            // Standard error may be closed.
            Err(error) => drop(writeln!(std::io::stderr(), "ground: left out: {error:#}")),
        }
    }
    anyhow::bail!("the current directory has no touchdown-*.mcap with a flight; give --replay a file")
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
    let (path, recording) = if path == Path::new(LAST) {
        newest_flight(Path::new("."), vehicle)?
    } else {
        announce(path);
        (path.to_owned(), Recording::load(path, vehicle)?)
    };
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
    use protocol::dialect::{HEARTBEAT_DATA, MavMessage};
    use protocol::frame::Encoder;
    use protocol::identity::VEHICLE;

    #[test]
    fn the_newest_log_with_a_vehicle_is_found_by_its_date() {
        let folder = tempfile::tempdir().unwrap();
        let found = || newest_flight(folder.path(), None);
        let none = "the current directory has no touchdown-*.mcap with a flight; give --replay a file";
        assert_eq!(found().unwrap_err().to_string(), none);
        let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
        write("touchdown-20261122-010203.mcap", b"");
        assert_eq!(found().unwrap_err().to_string(), none);
        let beat = Encoder::new(VEHICLE).encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
        let flight = [&1_000_000_u64.to_be_bytes(), beat.as_bytes()].concat().repeat(3);
        for name in
            ["touchdown-20261120-064030.mcap", "touchdown-20261121-010203.mcap", "other.mcap", "x.tlog"]
        {
            write(name, &flight);
        }
        assert_eq!(found().unwrap().0.file_name().unwrap(), "touchdown-20261121-010203.mcap");
    }
}
