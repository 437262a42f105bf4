//! `ground download`: fetches the log over a link of its own. It sends no heartbeat: nothing that it does may look like a
//! station that watches over the vehicle.

use std::io::{IsTerminal as _, Write as _};
use std::path::Path;
use std::time::Duration;

use anyhow::Context as _;
use tokio::time::{MissedTickBehavior, interval};

use super::{Downloading, Word, in_words};
use crate::app::clock::{Clock, LogTime};
use crate::app::key_ring::KeyRing;
use crate::app::signals::Signals;
use crate::app::wire::Wire;
use crate::cli::Cli;
use crate::exit::Exit;
use crate::update::Msg;

const TICK: Duration = Duration::from_millis(20);
/// How often the progress is printed: on a terminal in place, otherwise as lines at every tenth.
const SHOW_EVERY: Duration = Duration::from_millis(500);

/// Fetches the log over this program's own link.
///
/// # Errors
/// The link cannot be opened, the vehicle refuses, or a file cannot be written.
pub(in crate::app) async fn run(cli: &Cli, name: Option<&str>, folder: &Path) -> anyhow::Result<Exit> {
    anyhow::ensure!(
        !cli.connect.is_empty(),
        "no link to a vehicle: give --connect. In a station that holds the link, the key L fetches the log"
    );
    let KeyRing { key, .. } = KeyRing::open(cli)?;
    let clock = Clock::start();
    let mut wire =
        Wire::open((cli.us(), cli.vehicle()), cli.connect.clone(), key, clock, None, LogTime::Run(clock))
            .await?;
    let mut downloading =
        Downloading::begin(name, folder.to_owned(), (cli.us(), cli.vehicle()), clock.start_unix_ns());
    let mut signals = Signals::listen()?;
    let mut ticks = interval(TICK);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let mut shown = Shown { in_place: std::io::stderr().is_terminal(), at: Duration::ZERO, len: 0 };
    loop {
        let msgs = tokio::select! {
            biased;
            signal = signals.next() => {
                downloading.stop();
                shown.end();
                anyhow::bail!("stopped by {signal}; the same command goes on with what is here");
            }
            received = wire.receive() => wire.take(received),
            _ = ticks.tick() => Vec::new(),
        };
        let now = clock.now();
        for msg in msgs {
            if let Msg::Frame(frame) = msg {
                downloading.take(&frame, now)?;
            }
        }
        let (messages, word) = downloading.poll(now);
        for message in &messages {
            wire.send(message, 0);
        }
        match word {
            Some(Word::Done(path)) => {
                shown.end();
                wire.save_timestamps();
                writeln!(std::io::stdout(), "log {}", path.display())
                    .context("writing to standard output")?;
                return Ok(Exit::Landed);
            }
            Some(Word::Failed(error)) => {
                shown.end();
                return Err(error);
            }
            Some(Word::Goes(words)) if !shown.in_place => print_line(&words),
            Some(Word::Goes(_)) | None => {}
        }
        if shown.in_place && now >= shown.at + SHOW_EVERY {
            shown.at = now;
            let words =
                downloading.progress().map_or_else(|| "asking the vehicle".to_owned(), |p| in_words(&p));
            shown.replace(&words);
        }
    }
}

/// The progress on standard error. If nobody reads it, the download goes on.
struct Shown {
    in_place: bool,
    at: Duration,
    len: usize,
}

impl Shown {
    fn replace(&mut self, words: &str) {
        let _ = write!(std::io::stderr(), "\r{words:<width$}", width = self.len);
        self.len = words.len();
    }

    fn end(&mut self) {
        if std::mem::take(&mut self.len) > 0 {
            let _ = writeln!(std::io::stderr());
        }
    }
}

fn print_line(words: &str) {
    // Nobody may read it.
    let _ = writeln!(std::io::stderr(), "{words}");
}
