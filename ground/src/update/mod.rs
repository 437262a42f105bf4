//! Every decision of the ground: a message and the time in, a changed model and the wanted actions out.
//!
//! Nothing here reads a clock, a socket or a file; whatever arrives in whatever order is data.

pub mod alarms;
pub mod auto;
pub mod commands;
pub mod crew;
pub mod frames;
pub mod keys;
pub mod observe;
pub mod tick;

use std::time::Duration;

use protocol::dialect::MavMessage;
use protocol::frame::{Frame, FramerCounters};
use protocol::log::record::{Event, EventLevel, Record};
use protocol::signing::SigningCounters;

use crate::attach::codec::Asked;
use crate::key::Key;
use crate::model::alarm::AlarmKind;
use crate::model::command::CommandKind;
use crate::model::events::Speaker;
use crate::model::link::LinkReport;
use crate::model::seat::Seat;
use crate::model::{LogHealth, Model, Role};

/// Something that reached the ground.
#[derive(Debug, Clone, PartialEq)]
pub enum Msg {
    /// A key was pressed.
    Key(Key),
    /// Several keys came in one read of the terminal.
    Keys(Vec<Key>),
    /// Something was pasted, as the terminal says.
    Pasted,
    /// A frame arrived.
    Frame(Frame),
    /// The crew commanded this then: in a replay.
    Commanded(CommandKind),
    /// The crew has climbed the whole ladder of this on a screen of the station.
    Requested {
        /// What is asked for.
        kind: CommandKind,
        /// Who asks, and from which screen.
        by: Seat,
    },
    /// These screens can command now.
    Crew(Vec<Seat>),
    /// The crew has quit the station's own screen while the vehicle was armed or in flight; the station goes on.
    ScreenQuit,
    /// The crew has seen this alarm, on a screen elsewhere.
    Acknowledged(AlarmKind),
    /// A screen elsewhere wants the parameters.
    ParametersWanted,
    /// Time passes on a screen whose station runs elsewhere: its dialogs and chord expire.
    ScreenTick,
    /// The terminal is gone; the station goes on without it.
    ScreenGone,
    /// The frame that follows came over this link; told where there are several.
    HeardOver(usize),
    /// How each link does, once a second and when one comes or goes.
    Links {
        /// In the order of their numbers.
        links: Vec<LinkReport>,
        /// What signatures let in and kept out; `None` without a key.
        signing: Option<SigningCounters>,
    },
    /// Bytes arrived, whole frames or not.
    Received {
        /// How many.
        bytes: usize,
        /// The framer's counters after them.
        framing: FramerCounters,
    },
    /// Bytes were sent.
    Sent {
        /// How many.
        bytes: usize,
        /// Writes dropped since the start.
        drops: u64,
    },
    /// The transport works; with whom.
    LinkUp(String),
    /// The transport does not work; why.
    LinkDown(String),
    /// One of several links does not work; why.
    OneLinkDown(String),
    /// Something about the links that the crew should know.
    LinkSays(String),
    /// How the log does.
    Log(LogHealth),
    /// The embedded simulator ended by itself; why, if it failed.
    SimulatorEnded(Option<String>),
    /// The system asks to end; by which signal.
    Terminate(&'static str),
    /// Time passes; several times a second.
    Tick,
}

/// Something that the run loop is to do.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Send a message to the vehicle.
    Send(Box<MavMessage>),
    /// Write a record into the log.
    Record(Record),
    /// Put the log on the disk now.
    SyncLog,
    /// Draw the whole screen again.
    Redraw,
    /// Ask the station that runs elsewhere.
    Request(Asked),
    /// The crew has asked for this at the station's own screen: the other screens are told.
    Tell(CommandKind),
    /// Give the terminal back and go on without a screen.
    LeaveScreen,
    /// Ring the terminal's bell.
    Bell,
    /// An alarm was raised: tell whoever is not at the screen.
    Alarm(String),
    /// End the program.
    Quit,
}

impl Action {
    pub(crate) fn send(message: MavMessage) -> Self {
        Self::Send(Box::new(message))
    }

    pub(crate) fn event(speaker: Speaker, level: EventLevel, message: &str) -> Self {
        let event = Event { level, name: speaker.name().to_owned(), message: message.to_owned() };
        Self::Record(Record::Event(event))
    }
}

/// Takes a message into the model.
pub fn update(model: &mut Model, msg: Msg, now: Duration) -> Vec<Action> {
    match msg {
        Msg::Key(key) => keys::on_keys(model, &[key], now),
        Msg::Keys(keys) => keys::on_keys(model, &keys, now),
        Msg::Pasted => keys::on_paste(model, now),
        Msg::Commanded(kind) => commands::submit(model, kind, Seat::default(), now),
        Msg::Requested { kind, by } => keys::command(model, kind, &by, now),
        Msg::Crew(seats) => {
            model.crew.sit(seats, now);
            model.info(now, model.crew.words());
        }
        Msg::Acknowledged(kind) => keys::acknowledge(model, kind, now),
        Msg::ParametersWanted => keys::ask_parameters(model),
        Msg::ScreenTick => keys::pass(model, now),
        Msg::ScreenQuit => {
            let goes_on = "armed or in flight, so the station goes on";
            model.warn(now, format!("the screen was quit; {goes_on}: `ground attach` shows it"));
        }
        Msg::ScreenGone => {
            model.warn(now, "the terminal is gone: link and log go on; `ground attach` shows them");
        }
        Msg::Frame(frame) => frames::on_frame(model, &frame, now),
        Msg::Received { bytes, framing } => {
            model.link.stats.on_rx_bytes(bytes, now);
            model.link.framing = framing;
        }
        Msg::Sent { bytes, drops } => {
            model.link.stats.on_tx_bytes(bytes, now);
            model.link.send_drops = drops;
        }
        Msg::LinkUp(peer) => {
            model.link.trouble = None;
            model.info(now, format!("link up: {}", protocol::text::printable(peer.as_bytes())));
        }
        Msg::LinkDown(why) => {
            let why = protocol::text::printable(why.as_bytes());
            model.warn(now, format!("link down: {why}"));
            model.link.trouble = Some(why);
        }
        Msg::OneLinkDown(why) => {
            model.warn(now, format!("one link down: {}", protocol::text::printable(why.as_bytes())));
        }
        Msg::LinkSays(words) => model.warn(now, protocol::text::printable(words.as_bytes())),
        Msg::HeardOver(number) => model.link.heard_over = Some(number),
        Msg::Links { links, signing } => on_reports(model, links, signing, now),
        Msg::Log(health) => on_log_health(model, health, now),
        Msg::SimulatorEnded(failure) => {
            if let Some(why) = failure {
                model.say(now, Speaker::Ground, EventLevel::Error, format!("the simulator failed: {why}"));
                model.outcome.error = Some(why);
            }
        }
        Msg::Terminate("SIGINT") if outlives_ctrl_c(model) => {
            let ends = "SIGTERM or `ground stop --force` ends it";
            model.warn(now, format!("SIGINT: the station goes on while armed or in flight; {ends}"));
        }
        Msg::Terminate(signal) => {
            model.warn(now, format!("{signal}: ending; the vehicle is left as it is"));
            model.outbox.push(Action::Quit);
        }
        Msg::Tick => tick::on_tick(model, now),
    }
    alarms::watch(model, now);
    std::mem::take(&mut model.outbox)
}

/// Ctrl-C where a screen was, or where none ever was, is a hand's slip as well as its wish.
fn outlives_ctrl_c(model: &Model) -> bool {
    model.settings.role == Role::Station && !model.settings.demonstration && model.is_at_risk()
}

fn on_reports(model: &mut Model, links: Vec<LinkReport>, signing: Option<SigningCounters>, now: Duration) {
    let rejected = |counters: Option<SigningCounters>| counters.map_or(0, |counters| counters.rejected());
    if rejected(signing) > 0 && rejected(model.link.signing) == 0 {
        let what = signing.unwrap_or_default();
        model.warn(
            now,
            format!(
                "frames refused: {} unsigned, {} wrongly signed, {} replayed, {} too old, {} too new",
                what.unsigned, what.wrong, what.replayed, what.too_old, what.too_new
            ),
        );
    }
    (model.link.reports, model.link.reported_at, model.link.signing) = (links, now, signing);
}

fn on_log_health(model: &mut Model, health: LogHealth, now: Duration) {
    if health.failed && !model.log.failed {
        model.say(now, Speaker::Ground, EventLevel::Error, "the log has failed: nothing more is recorded");
    }
    if health.dropped > 0 && model.log.dropped == 0 {
        model.warn(now, "the log cannot keep up: records are dropped");
    }
    model.log = health;
}
