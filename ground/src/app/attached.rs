//! The run loop of a screen that shows a station which runs elsewhere on this machine.

use std::path::Path;
use std::time::Duration;

use anyhow::Context as _;
use protocol::identity::{GROUND, VEHICLE};
use protocol::log::record::{EventLevel, Record};
use tokio::io::AsyncWriteExt as _;
use tokio::net::unix::OwnedWriteHalf;
use tokio::sync::mpsc;
use tokio::time::{MissedTickBehavior, interval};

use super::clock::Clock;
use super::output::Output;
use super::server::read_one;
use super::signals::Signals;
use super::status;
use crate::attach::codec::{Asked, Hello, Told, VERSION, decode_told, encode_asked};
use crate::attach::place;
use crate::config::Config;
use crate::exit::{self, Exit};
use crate::model::command::CommandKind;
use crate::model::events::Speaker;
use crate::model::seat::Seat;
use crate::model::{Model, Role, Settings};
use crate::update::{Action, Msg, update};

/// Dialogs and chords expire on time although the station is silent.
const TICK: Duration = Duration::from_millis(100);
/// A station that is gone is looked for again this often.
const AGAIN_AFTER: Duration = Duration::from_secs(1);
/// Messages waiting to be taken into the model.
const WAITING_MAX: usize = 4_096;

/// Who sits at an attached screen.
#[derive(Debug, Clone)]
pub struct Viewer {
    /// Commands nothing.
    pub watch: bool,
    /// Their name.
    pub operator: String,
}

/// Shows the station until the person at the screen quits; the station goes on. Without a terminal for a screen it tells
/// the events in lines, and commands nothing.
///
/// # Errors
/// No station runs there, or the terminal failed.
pub async fn session(
    named: Option<&Path>,
    viewer: &Viewer,
    config: &Config,
    interactive: bool,
) -> anyhow::Result<Exit> {
    let path = status::the_station(named).await?;
    let mut link = Link::open(&path, viewer).await.with_context(|| {
        format!("no ground station serves {}; start one with `ground daemon`", path.display())
    })?;
    let clock = Clock::start();
    let mut signals = Signals::listen()?;
    let mut model = Model::new(settings(&Hello::default(), viewer));
    let mut times = Times::default();
    // The history first: the first frame shows everything.
    let mut live = false;
    while !live && let Some((told, at)) = link.told.recv().await {
        times.heard(at, clock.now());
        live = told == Told::Live;
        take(&mut model, told, at, viewer)?;
    }
    let mut output = Output::open(interactive, config)?;
    model.repeats_told = output.tells_repeats();
    let mut ticks = interval(TICK);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let mut look_again_at: Option<Duration> = None;
    loop {
        let (redraw_at, chord_at) = (output.redraw_at(), model.abort_chord.acts_at());
        let chord_at = chord_at.map(|at| times.ours(at));
        let actions = tokio::select! {
            biased;
            signal = signals.next() => {
                model.warn(times.theirs(clock.now()), format!("{signal}: the screen ends, the station goes on"));
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
            told = link.told.recv(), if look_again_at.is_none() => {
                match &told {
                    Some((Told::Msg(msg), _)) => output.mark_message(msg, &model),
                    _ => output.mark_changed(),
                }
                if let Some((told, at)) = told {
                    times.heard(at, clock.now());
                    take_live(&mut model, told, at, viewer)
                } else {
                    look_again_at = Some(clock.now() + AGAIN_AFTER);
                    // An abort that waits for its answer must not die with the station that repeats it.
                    model.link.abort_unsent |= !viewer.watch && model.commands.is_aborting();
                    // Cut off while it told the past, it tells no more of it.
                    model.history_ends();
                    let gone = Msg::LinkDown("the ground station of this screen is gone".to_owned());
                    update(&mut model, gone, times.theirs(clock.now()))
                }
            },
            () = clock.sleep_until(look_again_at) => {
                look_again_at = Some(clock.now() + AGAIN_AFTER);
                if let Some(mut found) = find_again(named, &model.settings.link_name, viewer).await {
                    let abort_unsent = model.link.abort_unsent
                        && !found.ask(&Asked::Command(CommandKind::Abort)).await;
                    link = found;
                    // Another station: another clock, another history.
                    times = Times::default();
                    let pages = model.pages;
                    model = Model::new(settings(&Hello::default(), viewer));
                    model.pages = pages;
                    model.link.abort_unsent = abort_unsent;
                    model.repeats_told = output.tells_repeats();
                    output.begin_anew();
                    look_again_at = None;
                }
                Vec::new()
            }
            _ = ticks.tick() => update(&mut model, Msg::ScreenTick, times.theirs(clock.now())),
            () = clock.sleep_until(redraw_at) => Vec::new(),
        };
        let quit = act(actions, &mut model, &mut link, &mut output, times.theirs(clock.now())).await;
        let now = clock.now();
        output.show(&model, now, times.theirs(now))?;
        if quit {
            break;
        }
    }
    drop(output);
    Ok(exit::decide(&model.outcome, true))
}

/// Does what a screen does itself. Returns whether to quit.
async fn act(
    actions: Vec<Action>,
    model: &mut Model,
    link: &mut Link,
    output: &mut Output,
    now: Duration,
) -> bool {
    let mut quit = false;
    for action in actions {
        match action {
            Action::Request(asked) => {
                if !link.ask(&asked).await {
                    unsent(model, &asked, now);
                }
            }
            Action::Record(Record::OperatorAction(action)) if action.kind == "key" => {
                link.ask(&Asked::Key(action.detail)).await;
            }
            Action::Redraw => output.clear(),
            Action::Bell => output.bell(),
            Action::Quit => quit = true,
            // The station itself sends, records and tells.
            Action::Send(_)
            | Action::Record(_)
            | Action::SyncLog
            | Action::Alarm(_)
            | Action::Tell(_)
            | Action::LeaveScreen => {}
        }
    }
    quit
}

/// The station on the named socket; else the one that holds the same link now, never another vehicle's.
async fn find_again(named: Option<&Path>, links: &str, viewer: &Viewer) -> Option<Link> {
    let place = match named {
        Some(path) => path.to_owned(),
        None => status::station_over(links).await?,
    };
    Link::open(&place, viewer).await.ok()
}

/// Says what the crew asked for and no station took.
fn unsent(model: &mut Model, asked: &Asked, now: Duration) {
    let text = match asked {
        Asked::Command(CommandKind::Abort) => {
            // Stands in the alarm line of every screen till there is a station.
            model.link.abort_unsent = true;
            "ABORT NOT SENT: this screen has no station; asked again as soon as there is one".to_owned()
        }
        Asked::Command(kind) => format!("{} NOT SENT: this screen has no station", kind.name()),
        Asked::Acknowledge(kind) => {
            model.alarms.acknowledge(*kind);
            return;
        }
        Asked::Hello { .. } | Asked::Parameters | Asked::Key(_) | Asked::Status | Asked::Stop { .. } => {
            return;
        }
    };
    model.say(now, Speaker::Ground, EventLevel::Error, text);
}

fn take(model: &mut Model, told: Told, at: Duration, viewer: &Viewer) -> anyhow::Result<()> {
    match told {
        Told::Hello(hello) => {
            let (ours, theirs) = (VERSION, hello.version);
            anyhow::ensure!(
                ours == theirs,
                "the station speaks version {theirs}, this screen {ours}; update"
            );
            model.settings = settings(&hello, viewer);
        }
        Told::Live => model.history_ends(),
        // What the station did then is done.
        Told::Msg(msg) => drop(update(model, msg, at)),
        // Answers to questions that a screen does not ask.
        Told::Status(_) | Told::Stopping { .. } => {}
    }
    Ok(())
}

fn take_live(model: &mut Model, told: Told, at: Duration, viewer: &Viewer) -> Vec<Action> {
    match told {
        Told::Hello(hello) => {
            model.settings = settings(&hello, viewer);
            Vec::new()
        }
        Told::Live => {
            model.history_ends();
            Vec::new()
        }
        Told::Msg(msg) => {
            let actions = update(model, msg, at);
            // The station asks for what the crew asks; a screen only rings.
            actions.into_iter().filter(|action| *action == Action::Bell).collect()
        }
        Told::Status(_) | Told::Stopping { .. } => Vec::new(),
    }
}

fn settings(hello: &Hello, viewer: &Viewer) -> Settings {
    let path = |path: &String| Some(path.clone()).filter(|path| !path.is_empty());
    Settings {
        link_capacity_bytes_s: Some(hello.link_capacity_bytes_s).filter(|most| *most > 0),
        log_path: path(&hello.log_path),
        tlog_path: path(&hello.tlog_path),
        us: GROUND.of_system(hello.system_ids[0]),
        vehicle: VEHICLE.of_system(hello.system_ids[1]),
        role: if viewer.watch { Role::Watching } else { Role::Attached },
        seat: Seat::new(hello.screen, viewer.operator.clone()),
        demonstration: hello.demonstration,
        auto: hello.auto,
        ..Settings::on_screen(&hello.link_name)
    }
}

/// The station's time and the screen's own.
#[derive(Debug, Default, Clone, Copy)]
struct Times {
    theirs_at: Duration,
    ours_at: Duration,
}

impl Times {
    fn heard(&mut self, theirs: Duration, ours: Duration) {
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

struct Link {
    told: mpsc::Receiver<(Told, Duration)>,
    write: OwnedWriteHalf,
}

impl Link {
    async fn open(path: &Path, viewer: &Viewer) -> std::io::Result<Self> {
        let (mut read, write) = place::connect(path).await?.into_split();
        let (tell, told) = mpsc::channel(WAITING_MAX);
        tokio::spawn(async move {
            while let Some(bytes) = read_one(&mut read).await {
                let Ok(told) = decode_told(&bytes) else { return };
                if tell.send(told).await.is_err() {
                    return;
                }
            }
        });
        let mut link = Self { told, write };
        link.ask(&Asked::Hello { watch: viewer.watch, operator: viewer.operator.clone() }).await;
        Ok(link)
    }

    /// Whether the station took it; one that is gone takes nothing.
    async fn ask(&mut self, asked: &Asked) -> bool {
        self.write.write_all(&encode_asked(asked)).await.is_ok()
    }
}
