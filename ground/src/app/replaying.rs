//! The run loop of a replay: a screen and a film, no link and no log.

use std::io::{IsTerminal as _, Write as _};
use std::path::Path;
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
use crate::replay::film::{Film, Progress};
use crate::replay::player::Player;
use crate::update::Msg;

/// Time moves on the screen this often.
const STEP: Duration = Duration::from_millis(100);

/// Shows a recorded flight until the person at the screen quits; without a screen, its events at once.
///
/// # Errors
/// The log cannot be read, the terminal failed, or the film has no such phase.
pub async fn session(cli: &Cli, path: &Path, config: &Config, interactive: bool) -> anyhow::Result<Exit> {
    let mut told = 0;
    let vehicle = cli.vehicle_sysid.map(|_| cli.vehicle());
    let film = Film::load(path, vehicle, &mut |progress| tell(path, progress, &mut told))?;
    let damage = film.damage.clone();
    let name = path.display().to_string();
    let settings =
        Settings { log_path: Some(name.clone()), role: Role::Replaying, ..Settings::on_screen(name) };
    let mut player = Player::new(film, settings);
    match cli.from {
        None => {}
        Some(ReplayFrom::Time(at)) => player.seek(at),
        Some(ReplayFrom::Phase(phase)) => {
            let found = player.seek_phase(phase);
            anyhow::ensure!(
                found,
                "{}: has no phase {}; it has {}",
                path.display(),
                words::phase(phase),
                player
                    .film()
                    .phases
                    .iter()
                    .map(|(phase, _)| words::phase(*phase))
                    .collect::<Vec<_>>()
                    .join(", ")
            );
        }
    }
    if let Some(damage) = damage {
        player.model.warn(player.position(), format!("the log {damage}"));
    }
    if interactive {
        watch(&mut player, config).await?;
    } else {
        player.seek(player.film().length());
        Lines::new().show(&player.model);
    }
    lines::closing(&player.model, interactive, Ok(&None));
    Ok(exit::decide(&player.model.outcome, interactive && std::io::stdout().is_terminal()))
}

/// Of a log that takes more than a moment says at every tenth how far its reading is.
fn tell(path: &Path, Progress { read, total }: Progress, told: &mut u64) {
    const LARGE_BYTES: u64 = 32_000_000;
    const MEGABYTE: u64 = 1_000_000;
    let tenths = (10 * read).checked_div(total).unwrap_or(0);
    if total > LARGE_BYTES && tenths > *told {
        *told = tenths;
        let (name, read, total) = (path.display(), read / MEGABYTE, total / MEGABYTE);
        // Talk goes to standard error; nobody may be listening.
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
                Msg::Key(crate::key::Key::CtrlL) => screen.clear(),
                Msg::Key(key) if player.on_key(key) => return Ok(()),
                // Held or pasted: of such keys those count that move a list or the time.
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
