//! The run loop of an attached screen: it shows a station in another process on this machine.

use std::path::Path;
use std::time::Duration;

use anyhow::Context as _;
use futures_util::StreamExt as _;
use protocol::log::record::Record;
use tokio::io::AsyncWriteExt as _;
use tokio::net::unix::{OwnedReadHalf, OwnedWriteHalf};
use tokio::time::{MissedTickBehavior, interval, timeout};
use tokio_util::codec::{FramedRead, LengthDelimitedCodec};

use super::clock::{Clock, Signals};
use super::files::{read_unfinished, write_unfinished};
use super::output::{Lines, Output, print};
use super::programs::in_a_thread;
use super::stations;
use crate::attach::codec::{CodecError, decode_to_screen, encode_to_station, messages};
use crate::attach::{Hello, ToScreen, ToStation, socket};
use crate::config::Config;
use crate::exit;
use crate::exit::Exit;
use crate::model::{
    Action, CommandKind, Model, Request, Role, Seat, Settings, Silence, Talk, Unfinished, abort_stamp,
};
use crate::update::{Msg, update};

/// The period of the screen's own ticks: dialogs and chords expire even while the station sends
/// nothing.
const TICK: Duration = Duration::from_millis(100);
/// Silence after which a station hangs: the next message of its history takes a moment.
const ANSWERS_WITHIN: Duration = Duration::from_secs(5);
/// How often a lost station is looked for again.
const AGAIN_AFTER: Duration = Duration::from_secs(1);

/// The text for a person whose terminal shows no screen.
const LINES_ONLY: &[u8] =
    b"this terminal shows lines only and takes no keys: it can neither hold nor abort, and does not count as a screen\n";

/// The person at an attached screen.
#[derive(Debug, Clone)]
pub struct Viewer {
    pub watch: bool,
    pub operator: String,
    pub talk: Talk,
}

/// Shows the station until the person at the screen quits; the station keeps running. Without a
/// terminal it prints the events as lines.
///
/// # Errors
/// No station runs there, or the terminal failed.
pub async fn session(
    named: Option<&Path>,
    viewer: &Viewer,
    config: &Config,
    interactive: bool,
) -> anyhow::Result<Exit> {
    let path = stations::the_station(named).await?;
    let serves = || format!("no ground station serves {}; start one with `ground daemon`", path.display());
    let mut link = StationConnection::open(&path, viewer).await.with_context(serves)?;
    let clock = Clock::start();
    let mut signals = Signals::listen()?;
    let mut model = Model::new(settings(&Hello::default(), viewer));
    let mut times = Times::default();
    take_history(&mut link, &mut model, (&mut times, &clock), viewer).await?;
    if !interactive {
        print(LINES_ONLY)?;
    }
    let mut output = Output::open(interactive, config)?;
    let mut ticks = interval(TICK);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let mut look_again_at: Option<Duration> = None;
    let mut is_unsent_stored = false;
    loop {
        let (redraw_at, chord_at) = (output.redraw_at(), model.abort_chord.acts_at());
        let chord_at = chord_at.map(|at| times.ours(at));
        let actions = tokio::select! {
            biased;
            signal = signals.next() => {
                model.warn(times.theirs(clock.now()), format!("{signal}: the screen ends, the station continues"));
                break;
            }
            msg = output.input() => {
                output.mark_changed();
                if matches!(msg, Msg::Terminate(_)) {
                    break;
                }
                update(&mut model, msg, times.theirs(clock.now()))
            }
            () = clock.sleep_until(chord_at) => update(&mut model, Msg::ScreenTick, times.theirs(clock.now())),
            message = link.receive(), if look_again_at.is_none() => {
                match &message {
                    Some(Ok((ToScreen::Msg(msg), _))) => output.mark_message(msg, &model),
                    _ => output.mark_changed(),
                }
                if let Some(Ok((message, at))) = message {
                    times.note_message(at, clock.now());
                    take(&mut model, message, at, viewer)
                } else {
                    look_again_at = Some(clock.now() + AGAIN_AFTER);
                    // If the lost station was repeating an abort, the next station must send it.
                    let is_pending = model.link.abort_requested_at.take().is_some() || model.commands.is_aborting();
                    model.link.abort_unsent |= !viewer.watch && is_pending;
                    // If the station went away while sending the history, the history ends here.
                    model.alarms.history_ends();
                    model.link.station_lost = true;
                    update(&mut model, Msg::ScreenTick, times.theirs(clock.now()))
                }
            },
            () = clock.sleep_until(look_again_at) => {
                look_again_at = Some(clock.now() + AGAIN_AFTER);
                if let Some(mut found) = find_again(named, &model.settings.link_name, viewer).await {
                    let abort_unsent = model.link.abort_unsent
                        && !found.send(&ToStation::Request(Request::Command(CommandKind::Abort))).await;
                    link = found;
                    // Another station has another clock and another history.
                    times = Times::default();
                    let pages = std::mem::take(&mut model.pages);
                    model = Model::new(settings(&Hello::default(), viewer));
                    model.pages = pages;
                    model.link.abort_unsent = abort_unsent;
                    output.lines = Lines::default();
                    output.mark_changed();
                    look_again_at = None;
                }
                Vec::new()
            }
            _ = ticks.tick() => {
                let answer = output.answers(clock.now());
                if answer != Err(Silence::NoAnswer) {
                    link.send(&ToStation::Here(answer)).await;
                }
                output.pass(&mut model, clock.now());
                update(&mut model, Msg::ScreenTick, times.theirs(clock.now()))
            }
            () = clock.sleep_until(redraw_at) => Vec::new(),
        };
        let quit = act(actions, &mut model, &mut link, &mut output, times.theirs(clock.now())).await;
        let unix_s = clock.unix_ns() / 1_000_000_000;
        store_unsent(&mut is_unsent_stored, &mut model, unix_s, times.theirs(clock.now()));
        let now = clock.now();
        output.show(&model, now, times.theirs(now))?;
        if quit {
            break;
        }
    }
    drop(output);
    Ok(exit::decide(&model.outcome, true))
}

/// Takes the history first, so that the first drawn frame is complete.
async fn take_history(
    link: &mut StationConnection,
    model: &mut Model,
    (times, clock): (&mut Times, &Clock),
    viewer: &Viewer,
) -> anyhow::Result<()> {
    // Stored for the station by another screen of this folder.
    let stored = read_unfinished(Some(Path::new(""))).ok().flatten();
    let pending = stored.and_then(|of| of.abort).map(|at| format!("; ABORT requested at {at} NOT CONFIRMED"));
    let pending = pending.unwrap_or_default();
    let silent = format!("the station does not answer: it hangs or is stopped{pending}");
    loop {
        let message = timeout(ANSWERS_WITHIN, link.receive()).await.with_context(|| silent.clone())?;
        let Some(message) = message else { return Ok(()) };
        let (message, at) = message.context("the station")?;
        times.note_message(at, clock.now());
        let live = message == ToScreen::Live;
        take(model, message, at, viewer);
        if live {
            return Ok(());
        }
    }
}

/// Executes the actions of a screen. Returns whether to quit.
async fn act(
    actions: Vec<Action>,
    model: &mut Model,
    link: &mut StationConnection,
    output: &mut Output,
    now: Duration,
) -> bool {
    let mut quit = false;
    for action in actions {
        match action {
            Action::Request(request) => {
                let is_sent = link.send(&ToStation::Request(request.clone())).await;
                if !is_sent {
                    report_unsent(model, &request, now);
                } else if request == Request::Command(CommandKind::Abort) {
                    model.link.abort_requested_at.get_or_insert(now);
                }
            }
            Action::Record(Record::OperatorAction(action)) if action.kind == "key" => {
                link.send(&ToStation::Key(action.detail)).await;
            }
            Action::Redraw | Action::NextTheme | Action::Bell | Action::CallOut(_) => {
                output.act(&action, model, now);
            }
            Action::Quit => quit = true,
            // The station itself sends, records and reports.
            _ => {}
        }
    }
    quit
}

/// Finds the station on the named socket, otherwise the one that now holds the same link; never a
/// station of another vehicle.
async fn find_again(named: Option<&Path>, links: &str, viewer: &Viewer) -> Option<StationConnection> {
    let place = match named {
        Some(path) => path.to_owned(),
        None => stations::station_over(links).await?,
    };
    StationConnection::open(&place, viewer).await.ok()
}

/// Stores an abort beside the station's log while its station has not sent it, for the next station
/// and its screens. A station that resumes stores it itself.
fn store_unsent(is_stored: &mut bool, model: &mut Model, unix_s: u64, now: Duration) {
    let abort = model.link.why_abort_not_sent(now).map(|_| abort_stamp(unix_s, &model.settings.seat));
    let changes = abort.is_some() != std::mem::replace(is_stored, abort.is_some());
    if !changes || (abort.is_none() && !model.link.station_lost) {
        return;
    }
    let folder = model.settings.log_path.as_deref().and_then(|log| Path::new(log).parent());
    let stored = Unfinished { abort, ..model.unfinished(now) };
    let Some(folder) = folder.map(Path::to_owned) else { return };
    // In a thread: an abort that waits for a station must not wait for the disk.
    let written = in_a_thread("unsent abort", move || write_unfinished(&folder, &stored));
    if let Err(error) = written {
        model.warn(now, format!("this abort is not stored for the next station: {error}"));
    }
}

/// Reports to the crew that a request has not reached any station.
fn report_unsent(model: &mut Model, request: &Request, now: Duration) {
    let what = match *request {
        Request::Command(kind) => &format!("{} NOT SENT", kind.row().name),
        Request::Acknowledge(kind) => {
            model.alarms.acknowledge(kind);
            return;
        }
        Request::Sign { step, .. } => &format!("step {} NOT SIGNED", u32::from(step) + 1),
        Request::Note(_) => "the note is NOT RECORDED",
        _ => "nothing is done",
    };
    let is_abort = *request == Request::Command(CommandKind::Abort);
    // Stays in the alarm line of every page until there is a station again.
    model.link.abort_unsent |= is_abort;
    let later = if is_abort { "; it is sent as soon as there is one" } else { "" };
    let text = format!("{what}: this screen has no station{later}");
    model.error(now, text);
}

/// Applies a message of the station. Returns this screen's actions: the station executes the
/// others.
fn take(model: &mut Model, message: ToScreen, at: Duration, viewer: &Viewer) -> Vec<Action> {
    match message {
        ToScreen::Hello(hello) => model.settings = settings(&hello, viewer),
        ToScreen::Live => model.alarms.history_ends(),
        ToScreen::Msg(msg) => {
            let mut actions = update(model, msg, at);
            actions.retain(|action| matches!(action, Action::Bell | Action::CallOut(_) | Action::Alarm(_)));
            return actions;
        }
        // A screen does not request these.
        ToScreen::Status(_) | ToScreen::Stopping { .. } => {}
    }
    Vec::new()
}

/// The station's settings with those of this screen.
fn settings(hello: &Hello, viewer: &Viewer) -> Settings {
    Settings {
        role: if viewer.watch { Role::Watching } else { Role::Attached },
        seat: Seat::new(hello.screen, viewer.operator.clone()),
        talk: viewer.talk,
        interactive: true,
        ..hello.station.clone()
    }
}

/// Converts between the station's clock and the screen's own.
#[derive(Debug, Default, Clone, Copy)]
struct Times {
    theirs_at: Duration,
    ours_at: Duration,
}

impl Times {
    fn note_message(&mut self, theirs: Duration, ours: Duration) {
        if theirs >= self.theirs_at {
            (self.theirs_at, self.ours_at) = (theirs, ours);
        }
    }

    fn theirs(&self, ours: Duration) -> Duration {
        self.theirs_at + ours.saturating_sub(self.ours_at)
    }

    fn ours(&self, theirs: Duration) -> Duration {
        self.ours_at + theirs.saturating_sub(self.theirs_at)
    }
}

struct StationConnection {
    messages: FramedRead<OwnedReadHalf, LengthDelimitedCodec>,
    write: OwnedWriteHalf,
}

impl StationConnection {
    async fn open(path: &Path, viewer: &Viewer) -> std::io::Result<Self> {
        let (read, write) = socket::connect(path).await?.into_split();
        let mut link = Self { messages: messages(read), write };
        link.send(&ToStation::Hello { watch: viewer.watch, operator: viewer.operator.clone() }).await;
        Ok(link)
    }

    /// The next message of the station with its time; `None` at its end.
    async fn receive(&mut self) -> Option<Result<(ToScreen, Duration), CodecError>> {
        let bytes = self.messages.next().await?.ok()?;
        Some(decode_to_screen(&bytes))
    }

    /// Sends a message. Returns whether the station still accepts it.
    async fn send(&mut self, request: &ToStation) -> bool {
        self.write.write_all(&encode_to_station(request)).await.is_ok()
    }
}
