//! Every decision of the ground: one pure function from a message and the time to a changed model
//! and actions. This module reads no clock, socket or file. The actions are tasks for the run loop:
//! send, record, quit.

pub mod alarms;
pub mod commands;
pub mod frames;
pub mod keys;
pub mod pad;
pub mod requests;
pub mod tick;
pub mod vehicle_changes;

use std::time::Duration;

use protocol::book::SignedHead;
use protocol::frame::{Frame, Framer, FramerCounters};
use protocol::signing::SigningCounters;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use crate::key::Key;
use crate::model::{
    Act, BookState, Checklist, CommandKind, Degrees, LastPlace, LinkReport, LogHealth, LogStanding, Model,
    Role, Sample, Seat, Silence, Unfinished,
};
pub use crate::model::{Action, Request};

/// The name of a signal, or of another reason to end.
pub type SignalName = &'static str;

/// A message for the model: an input of the crew, a frame, a state of the links, or a tick. A
/// station passes its messages to its screens, except its local keys, its end, and the messages
/// that only a replay or an attached screen uses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Msg {
    /// A frame of the link.
    Frame(#[serde(with = "frame_bytes")] Frame),
    /// This operator has completed every step of this request on a screen of the station.
    Requested { request: Request, by: Seat },
    /// The seats that can command have changed: those at screens that answer, and at those that do
    /// not.
    Crew { seats: Vec<Seat>, silent: Vec<(Seat, Silence)> },
    /// The crew has quit the station's own screen while the vehicle was armed or in flight; the
    /// station keeps running.
    ScreenQuit,
    /// The station has this checklist, in this state.
    Checklist(Box<Checklist>),
    /// The report of the flight is written, or the reason why not.
    Report(Result<String, String>),
    /// The last position of the vehicle, stored before this run of the station.
    Place(Box<LastPlace>),
    /// The end of the station's book, and whether the station has a key: without one the signature
    /// is empty.
    Book { head: SignedHead, is_signed: bool },
    /// The station has not signed or voided a step of the checklist; the reason.
    SignRefused(String),
    /// The terminal is lost; the station continues without it.
    ScreenLost,
    /// The next frame came over this link; sent only if there are several links.
    OverLink(usize),
    /// The next frames come from this source: a number for each link and address.
    FromSource(u16),
    /// The state of each link in the order of their numbers, once a second and whenever one goes up
    /// or down; and how many frames passed or failed the signature check: `None` without a key.
    Links { links: Vec<LinkReport>, signing: Option<SigningCounters> },
    /// Bytes arrived, whether or not they form complete frames; the framer's counters after them.
    Received { bytes: usize, framing: FramerCounters },
    /// Bytes were sent; how many writes have been dropped since the start.
    Sent { bytes: usize, drops: u64 },
    /// The link works; the peer.
    LinkUp(String),
    /// No link works; the reason.
    LinkDown(String),
    /// A warning about the links for the crew.
    LinkWarning(String),
    /// The run loop was stalled for so long; frames that waited meanwhile are not passed on.
    StoodStill(Duration),
    /// The state of the log writer has changed.
    Log(LogHealth),
    /// The station's log continues in these files.
    LogBegins { log: String },
    /// The embedded simulator has ended; the reason, if it failed.
    SimulatorEnded(Option<String>),
    /// Time passes; sent ten times a second.
    Tick,
    /// The unfinished state of an earlier run of the station, or of its screen.
    Unfinished(Box<Unfinished>),
    /// The station's own position by its receiver, or why there is none.
    Here(Result<Degrees, String>),
    // Skipped ones come last: the others are numbered without them.
    /// The keys of one read of the terminal: one if typed by hand, several from a paste, a held key
    /// or a slow line.
    #[serde(skip)]
    Keys(Vec<Key>),
    /// The terminal reports that text was pasted.
    #[serde(skip)]
    Pasted,
    /// In a replay: the crew gave this command at this time.
    #[serde(skip)]
    Commanded(CommandKind),
    /// Time passes on an attached screen: its dialogs and its abort chord may expire.
    #[serde(skip)]
    ScreenTick,
    /// The system asks the program to end; the name of the signal.
    #[serde(skip)]
    Terminate(SignalName),
}

impl Msg {
    /// The crew has completed every step of this command.
    pub fn command(kind: CommandKind, by: Seat) -> Self {
        Self::Requested { request: Request::Command(kind), by }
    }
}

/// A frame for a screen: its bytes.
mod frame_bytes {
    use super::{Deserialize, Deserializer, Frame, Framer, Serializer, de};

    pub(super) fn serialize<S: Serializer>(frame: &Frame, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_bytes(frame.as_bytes())
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Frame, D::Error> {
        let mut framer = Framer::new();
        framer.push_datagram(<&[u8]>::deserialize(from)?);
        framer.next_frame().ok_or_else(|| de::Error::custom("not a frame"))
    }
}

/// Applies a message to the model and returns the tasks for the run loop.
pub fn update(model: &mut Model, msg: Msg, now: Duration) -> Vec<Action> {
    let (is_answered, before) = (is_answered(&msg), model.events.total());
    match msg {
        Msg::Keys(keys) => keys::on_keys(model, &keys, now),
        Msg::Pasted => keys::on_paste(model, now),
        Msg::Commanded(kind) => commands::submit(model, kind, Seat::default(), now),
        Msg::Requested { request, by } => requests::on_request(model, request, by, now),
        Msg::Crew { seats, silent } => on_crew(model, seats, silent, now),
        Msg::Checklist(list) => model.checklist = Some(*list),
        Msg::Report(Ok(path)) => model.info(now, format!("the report is written: {path}")),
        Msg::Report(Err(why)) => model.warn(now, format!("the report is not written: {why}")),
        Msg::Place(place) => model.place = Some(*place),
        Msg::Unfinished(unfinished) => model.take_unfinished(*unfinished, now),
        Msg::Book { head, is_signed } => {
            let is_another = model.book.head.is_some_and(|signed| signed.head.book != head.head.book);
            let before = if is_another { BookState::default() } else { model.book };
            model.book = BookState { head: Some(head), is_signed, ..before };
        }
        Msg::Here(Ok(at)) => {
            if model.here_trouble.take().is_some() || model.here.is_none() {
                model.info(now, "own position received");
            }
            model.here = Some(Sample::new(at, now));
        }
        Msg::Here(Err(why)) => {
            let why = protocol::text::printable(why.as_bytes());
            model.warn(now, format!("own position: {why}"));
            model.here_trouble = Some(why);
        }
        Msg::SignRefused(why) => pad::on_sign_refused(model, protocol::text::printable(why.as_bytes()), now),
        Msg::ScreenTick => keys::pass(model, now),
        Msg::ScreenQuit => {
            let why = if model.is_at_risk() { "armed or in flight" } else { "people must keep away" };
            let then = "so the station continues: `ground attach` shows it";
            model.warn(now, format!("the screen was quit; {why}, {then}"));
        }
        Msg::ScreenLost => {
            model.warn(now, "the terminal is gone: link and log continue; `ground attach` shows them");
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
        Msg::LinkWarning(words) => model.warn(now, protocol::text::printable(words.as_bytes())),
        Msg::StoodStill(stalled) => {
            let (why, stalled_s) = ("this station stood still", stalled.as_secs());
            model.warn(now, format!("{why} for {stalled_s} s: what waited is in the log only"));
            // The frames that waited count as lost, and the radio has not lost them.
            pad::pass_range_test(model, Some(why), now);
        }
        Msg::OverLink(number) => model.link.received_over = Some(number),
        Msg::FromSource(source) => model.link.source = source,
        Msg::Links { links, signing } => on_reports(model, links, signing, now),
        Msg::Log(health) => on_log_health(model, health, now),
        // The log before is complete. The flight is in it, and not in the one that is replayed and
        // reported from now on.
        Msg::LogBegins { log } => {
            model.info(now, format!("the log continues in {log}"));
            model.settings.log_path = Some(log);
            model.outcome.started = false;
        }
        Msg::SimulatorEnded(failure) => {
            if let Some(why) = failure {
                model.error(now, format!("the simulator failed: {why}"));
                model.outcome.error = Some(why);
            }
        }
        Msg::Terminate("SIGINT")
            if model.settings.role == Role::Station
                && !model.settings.demonstration
                && model.is_at_risk() =>
        {
            let ends = "SIGTERM or `ground stop --force` ends it";
            model.warn(now, format!("SIGINT: the station continues while armed or in flight; {ends}"));
        }
        Msg::Terminate(signal) => {
            model.warn(now, format!("{signal}: ending; the vehicle is not affected"));
            model.outbox.push(Action::Quit);
        }
        Msg::Tick => {
            on_station_tick(model, now);
            tick::on_tick(model, now);
        }
    }
    note_answer(model, is_answered, before, now);
    vehicle_changes::watch_approach(model, now);
    alarms::watch(model, now);
    alarms::call_out(model, now);
    std::mem::take(&mut model.outbox)
}

/// Takes who can command, and the screens that do not count.
fn on_crew(model: &mut Model, seats: Vec<Seat>, silent: Vec<(Seat, Silence)>, now: Duration) {
    model.crew.set_seats(seats, silent, now);
    let words = model.crew.words();
    match model.crew.silence(&model.settings.seat).filter(|_| model.settings.demonstration) {
        Some(why) => model.warn(now, format!("{why}: simulated, so it flies")),
        None => model.info(now, words),
    }
}

/// Whether the first event that a message causes answers a key of this screen. An acknowledgement
/// is shown in the alarm.
fn is_answered(msg: &Msg) -> bool {
    match msg {
        Msg::Keys(keys) => !keys.iter().all(|key| Act::of_key(*key) == Some(Act::Acknowledge)),
        msg => matches!(msg, Msg::Report(_)),
    }
}

/// Stores the newest event as the answer to a key. A command has a row of its own.
fn note_answer(model: &mut Model, is_answered: bool, events_before: u64, now: Duration) {
    let is_sent = model.outbox.iter().any(|action| matches!(action, Action::Send(_)));
    if is_answered && !is_sent && model.events.total() > events_before {
        let answer = model.events.newest(1).next();
        model.answer = answer.map(|event| (format!("{}{}", event.mark().trim_start(), event.text), now));
    }
}

/// Records on an attached screen that its station runs.
fn on_station_tick(model: &mut Model, now: Duration) {
    if !matches!(model.settings.role, Role::Attached | Role::Watching) {
        return;
    }
    if model.link.station_silence(now).is_some() && !model.alarms.in_history {
        model.info(now, "the station answers again");
    }
    model.link.station_at = Some(now);
}

fn on_reports(model: &mut Model, links: Vec<LinkReport>, signing: Option<SigningCounters>, now: Duration) {
    let rejected = |counters: Option<SigningCounters>| counters.map_or(0, |counters| counters.rejected());
    if rejected(signing) > 0 && rejected(model.link.signing) == 0 {
        let SigningCounters { unsigned, wrong, replayed, too_old, too_new, .. } = signing.unwrap_or_default();
        let signatures = format!("{unsigned} unsigned, {wrong} wrongly signed, {replayed} replayed");
        model.warn(now, format!("frames refused: {signatures}, {too_old} too old, {too_new} too new"));
    }
    if rejected(signing) > rejected(model.link.signing) {
        model.link.refused_at = Some(now);
    }
    (model.link.reports, model.link.reported_at, model.link.signing) = (links, now, signing);
}

fn on_log_health(model: &mut Model, health: LogHealth, now: Duration) {
    if health.failed && !model.log.failed {
        model.error(now, "the log has failed: nothing more is recorded");
    }
    if health.removed && !model.log.removed {
        let text = "the log was removed: its records are written again under its name";
        model.error(now, text);
    }
    if health.dropped > 0 && model.log.dropped == 0 {
        model.warn(now, "the log cannot keep up: records are dropped");
    }
    if health.dropped > model.log.dropped {
        model.log_loses_at = Some(now);
    }
    model.log = health;
    // A word that was typed for another fault, or before the log was fit again, does not count.
    if !matches!(model.station_log(now), LogStanding::Unfit(fault, _) if model.without_log == Some(fault)) {
        model.without_log = None;
    }
}
