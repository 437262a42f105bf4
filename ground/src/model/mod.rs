//! The complete state of the ground station, as plain data.
//!
//! Every received value carries the time of its reception. The model decides nothing, and it
//! imports neither `update` nor `view`.

mod act;
mod alarm;
mod boots;
mod checklist;
mod checks;
mod command;
mod crew;
pub mod dead_reckoning;
mod dialog;
pub(crate) mod field;
mod history;
mod identity;
mod link;
mod log;
mod motion;
mod pad_check;
mod page;
mod place;
pub mod quantity;
mod safety;
pub mod telemetry;
mod vehicle;
pub mod words;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use protocol::command::CommandSender;
use protocol::dialect::{MavMessage, TIMESYNC_DATA, TdPhase, TdRole};
use protocol::field::Field;
use protocol::identity::{Address, GROUND, VEHICLE};
use protocol::log::record::{self, EventLevel, Record};
use protocol::log::v1::OperatorAction;
use protocol::mission::MissionHash;
use protocol::text::Reassembler;
use serde::{Deserialize, Serialize};

pub use act::*;
pub use alarm::*;
pub use boots::*;
pub use checklist::*;
pub use checks::*;
pub use command::*;
pub use crew::*;
pub use dialog::*;
pub use history::*;
pub use identity::*;
pub use link::*;
pub use log::*;
pub use motion::*;
pub use pad_check::*;
pub use page::*;
pub use place::*;
pub use safety::*;
pub use vehicle::*;

pub(crate) use command::AutoStep;

/// The settings of a run, which do not change during it.
///
/// An attached screen gets those of its station, except for those that are a screen's own.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The name of the link, as in `udpin:0.0.0.0:14550`.
    pub link_name: String,
    /// The capacity of the link, bytes per second; `None` if no bound is known.
    pub link_capacity_bytes_s: Option<u32>,
    /// The name of the profile that flies, if it is given beforehand.
    #[serde(skip)]
    pub vehicle_name: Option<String>,
    /// `None` without a log.
    pub log_path: Option<String>,
    /// The station's own MAVLink address.
    pub us: Address,
    /// The session of the station: drawn at its start, so that another station with the same
    /// address is another one. 0: none, in a replay.
    pub session: u32,
    /// The vehicle's MAVLink address. No other system on the link is shown or commanded.
    pub vehicle: Address,
    #[serde(skip)]
    pub role: Role,
    /// This screen and its operator.
    #[serde(skip)]
    pub seat: Seat,
    /// The operator whose key signs what the station sends; `None` without a crew, and for an
    /// observer.
    pub key_owner: Option<KeyOwner>,
    /// The mission that the vehicle should fly, if it is given.
    pub mission: Option<MissionHash>,
    /// Where that flight should begin: pad, apogee or drone; `None` if not given.
    pub start: Option<String>,
    /// The people of the crew file by name, with their roles; empty without one.
    #[serde(skip)]
    pub crew_roles: Vec<(String, TdRole)>,
    /// The station's position on the Earth without a receiver; `None` if not given.
    pub here: Option<Degrees>,
    /// The lines of the field around the pad, if the mission names any.
    pub field: Option<Field>,
    /// When the run started: seconds since 1970, UTC.
    #[serde(skip)]
    pub start_unix_s: u64,
    /// Whether the vehicle is simulated in the station's own process.
    pub demonstration: bool,
    /// Whether the automatic mode arms and starts.
    pub auto: bool,
    /// Whether a person watches a screen; then the end of the flight does not end the program.
    #[serde(skip)]
    pub interactive: bool,
    /// Settings for callouts.
    #[serde(skip)]
    pub talk: Talk,
    /// Without a screen: give up if the flight has not ended after this time.
    #[serde(skip)]
    pub time_limit: Option<Duration>,
}

impl Settings {
    /// A station with a person at its screen, without a log or a time limit, on a link of unknown
    /// capacity.
    pub fn on_screen(link_name: impl Into<String>) -> Self {
        let link_name = link_name.into();
        Self { link_name, us: GROUND, vehicle: VEHICLE, interactive: true, ..Self::default() }
    }
}

/// What a screen may do.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Role {
    /// Holds the link and sends the commands.
    #[default]
    Station,
    /// Shows a station in another process and passes the crew's commands to it.
    Attached,
    /// Shows a station in another process and commands nothing.
    Watching,
    /// Shows a recorded flight.
    Replaying,
}

impl Role {
    /// Why this screen cannot command; `None` if it can.
    pub fn why_not_command(self) -> Option<&'static str> {
        match self {
            Self::Station | Self::Attached => None,
            Self::Watching => Some("this screen only watches (--watch)"),
            Self::Replaying => Some("a replay commands nothing"),
        }
    }
}

/// The position and speed of a replay.
#[derive(Debug, Clone, PartialEq)]
pub struct Playback {
    /// Time since the first frame.
    pub position: Duration,
    /// Time of the last frame.
    pub length: Duration,
    /// Recorded time per real time.
    pub speed: f64,
    pub paused: bool,
    /// T+0 of the recording.
    pub began: Duration,
    /// Each phase of the recording and when it began.
    pub phases: Arc<[(TdPhase, Duration)]>,
}

/// Number of requests that may wait for an answer: of 10 s, one a second and those of a range test.
const TIMESYNC_STAMPS_MAX: usize = 64;

/// The longest note, in characters: a line of the smallest terminal with its name.
pub(crate) const NOTE_MAX: usize = 60;

/// When each periodic action was last due.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Due {
    pub(crate) heartbeat: Option<Duration>,
    pub(crate) timesync: Option<Duration>,
    pub(crate) telemetry_record: Option<Duration>,
}

/// The complete state of the ground station.
#[derive(Debug, Default)]
pub struct Model {
    pub settings: Settings,
    /// The vehicle, as its telemetry shows it.
    pub vehicle: Vehicle,
    /// The boots of the received vehicles.
    pub boots: Boots,
    /// The vehicles of the boots that are not shown.
    pub(crate) others: BTreeMap<BootId, Vehicle>,
    pub link: Link,
    pub commands: Commands,
    /// The open dialog, if any.
    pub dialog: Option<Dialog>,
    /// The rest of a typed word that is no longer wanted.
    pub rest_of_word: Option<RestOfWord>,
    pub abort_chord: AbortChord,
    pub key_timing: KeyTiming,
    /// Who can command, and from which screens.
    pub crew: Crew,
    /// Whether the terminal distinguishes a held key's repeats from presses, so that repeats never
    /// arrive here.
    pub repeats_reported: bool,
    /// How late the terminal shows what was drawn.
    pub screen_late: Duration,
    pub events: Events,
    pub outcome: FlightSoFar,
    /// The state of the log writer.
    pub log: LogHealth,
    /// When it last lost records.
    pub(crate) log_loses_at: Option<Duration>,
    /// The crew continues although the log has this fault.
    pub(crate) without_log: Option<LogFault>,
    /// The boot that the crew arms although no burn of its motor's lot has confirmed its curve.
    pub(crate) untested: Option<u32>,
    pub alarms: Alarms,
    pub pages: Pages,
    pub history: History,
    /// The checklist of the mission, as the station stores it; `None` without one.
    pub checklist: Option<Checklist>,
    /// Why a step was not signed or voided, and when.
    pub(crate) sign_refused: Option<(String, Duration)>,
    /// The last position of the vehicle: of this flight, or stored before a restart.
    pub place: Option<LastPlace>,
    /// The station's own position by its receiver, and why that reports none now.
    pub(crate) here: Option<Sample<Degrees>>,
    pub(crate) here_trouble: Option<String>,
    /// The other vehicles on the link that report their positions, by their system ids.
    pub(crate) trackers: BTreeMap<u8, Tracker>,
    /// An unconfirmed abort of an earlier run of this station, or of its screen.
    pub(crate) abort_before: Option<String>,
    /// When a screen that commands nothing was last given a command.
    pub(crate) nothing_sent_at: Option<Duration>,
    /// The last answer to a key of this screen, and when it was given.
    pub(crate) answer: Option<(String, Duration)>,
    /// The unfinished state last stored beside the log.
    pub(crate) stored_unfinished: Option<Unfinished>,
    /// When the last position is checked next.
    pub(crate) place_due: Option<Duration>,
    /// The radio range test, once one has begun.
    pub range_test: Option<RangeTest>,
    /// The check on the pad that is in the book.
    pub(crate) check_entered: Option<(u32, u16)>,
    /// The end of the station's book.
    pub book: BookState,
    /// The danger and the approach headline that were last reported.
    pub(crate) reported_approach: (Option<Danger>, Option<&'static str>),
    /// The callouts made so far.
    pub called: Called,
    /// `None` for a live flight.
    pub playing: Option<Playback>,
    /// The state in which the vehicle rebooted, and when.
    pub(crate) rebooted: Option<(&'static str, Duration)>,
    pub(crate) texts: Reassembler,
    pub(crate) due: Due,
    pub(crate) auto_step: AutoStep,
    /// A key to quit was pressed; the program quits at this time unless another key comes first.
    pub(crate) quit_at: Option<Duration>,
    pub(crate) outbox: Vec<Action>,
}

impl Model {
    /// A model without any received data.
    ///
    /// A screen of a station in another process first receives the history, until
    /// [`Alarms::history_ends`].
    pub fn new(settings: Settings) -> Self {
        let mut model = Self::default();
        model.alarms.in_history = matches!(settings.role, Role::Attached | Role::Watching);
        // The session decides where the numbers of the commands begin.
        model.commands.sender = CommandSender::new(settings.session);
        Self { settings, ..model }
    }

    /// Whether the vehicle is armed, in flight or being aborted, so that quitting must be
    /// confirmed.
    pub fn is_at_risk(&self) -> bool {
        let armed = self.vehicle.is_armed();
        armed || self.commands.is_aborting() || self.vehicle.in_flight()
    }

    /// When something is due before the next tick: the abort chord, or a command to resend.
    pub fn wakes_at(&self) -> Option<Duration> {
        let times = [self.abort_chord.acts_at(), self.commands.sender.due_at()];
        times.into_iter().flatten().min()
    }

    /// The page to show.
    pub fn page(&self) -> Page {
        self.pages.shown(self.vehicle.phase_now())
    }

    /// The place in the list of the alarm that Space acknowledges: the one chosen on its page,
    /// otherwise the foremost.
    pub fn pointed_at(&self) -> Option<usize> {
        let place = |kind| self.alarms.list().iter().position(|alarm| alarm.what.kind == kind);
        let chosen = self.pages.chosen.filter(|_| self.page() == Page::Alarms);
        chosen.and_then(place).or_else(|| place(self.alarms.foremost()?.what.kind))
    }

    /// Adds an event to the list, to the log and to the book.
    pub(crate) fn add_event(
        &mut self,
        now: Duration,
        speaker: Speaker,
        level: EventLevel,
        text: impl Into<String>,
    ) {
        let text = text.into();
        let is_vehicle = matches!(speaker, Speaker::Vehicle);
        let who = if is_vehicle { self.boot_beside_others(now) } else { String::new() };
        self.enter(if is_vehicle { "vehicle says" } else { "event" }, &who, &text);
        self.list_event(now, speaker, level, text);
    }

    /// Adds an event to the list and to the log, when the book has it already.
    pub(crate) fn list_event(&mut self, now: Duration, speaker: Speaker, level: EventLevel, text: String) {
        self.outbox.push(Action::event(speaker, level, &text));
        self.events.push(now, speaker, level, text);
    }

    /// Records an action of the crew in the log and the book.
    pub(crate) fn record_operator(&mut self, now: Duration, kind: &str, by: &Seat, detail: &str) {
        self.outbox.push(Action::Record(Record::OperatorAction(OperatorAction {
            time_s: now.as_secs_f64(),
            kind: kind.to_owned(),
            detail: detail.to_owned(),
        })));
        self.enter(kind, &by.operator, detail);
    }

    /// Records an action of the crew, and adds it to the list of events.
    pub(crate) fn log_act(&mut self, now: Duration, kind: &str, by: &Seat, level: EventLevel, text: String) {
        self.record_operator(now, kind, by, &text);
        self.list_event(now, Speaker::Ground, level, text);
    }

    /// The boot of the shown vehicle while others are received beside it; otherwise empty.
    pub(crate) fn boot_beside_others(&self, now: Duration) -> String {
        let boot = self.vehicle.boot.number().filter(|_| self.beside(now).is_some());
        boot.map_or_else(String::new, |boot| format!("boot {}", words::boot(boot)))
    }

    /// Enters a line into the book.
    pub(crate) fn enter(&mut self, kind: &str, who: &str, text: &str) {
        let [kind, who, text] = [kind, who, text].map(str::to_owned);
        self.outbox.push(Action::Enter(BookLine { kind, who, text }));
    }

    /// Requests the vehicle's time; the answer repeats this stamp, ns.
    pub(crate) fn request_time(&mut self, stamp: i64) {
        self.link.timesync_stamps.truncate(TIMESYNC_STAMPS_MAX - 1);
        self.link.timesync_stamps.push_front(stamp);
        self.outbox.push(Action::send(MavMessage::TIMESYNC(TIMESYNC_DATA {
            tc1: 0,
            ts1: stamp,
            target_system: self.settings.vehicle.system_id,
            target_component: self.settings.vehicle.component_id,
        })));
    }

    pub(crate) fn info(&mut self, now: Duration, text: impl Into<String>) {
        self.add_event(now, Speaker::Ground, EventLevel::Info, text);
    }

    pub(crate) fn error(&mut self, now: Duration, text: impl Into<String>) {
        self.add_event(now, Speaker::Ground, EventLevel::Error, text);
    }

    pub(crate) fn warn(&mut self, now: Duration, text: impl Into<String>) {
        self.add_event(now, Speaker::Ground, EventLevel::Warning, text);
    }
}

// Requests to the run loop: messages to send, records to write, requests to the station.

/// A request of a screen in another process to its station.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub enum Request {
    /// The crew has completed every step of this command: send it.
    Command(CommandKind),
    /// The crew has seen this alarm.
    Acknowledge(AlarmKind),
    /// Write the report of the flight.
    Report,
    /// Begin the radio range test.
    RangeTest,
    /// Show and command this boot, of several vehicles under one id.
    Choose(u32),
    /// Arm and start although the station's log is unfit.
    WithoutLog,
    /// Arm although no burn of the motor's lot has confirmed its curve.
    Untested,
    /// The crew has signed or voided this step of the checklist, counted from zero.
    Sign { step: u8, void: bool },
    /// Record this note in the log and the book.
    Note(String),
}

/// A line of the book: who did what. The run loop adds the time and the number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BookLine {
    /// As in `key`, `commanded`, `signed`.
    pub kind: String,
    /// Who did it; empty for the station or the vehicle itself.
    pub who: String,
    pub text: String,
}

/// A task for the run loop.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Send a message to the vehicle.
    Send(Box<MavMessage>),
    /// Write a record into the log.
    Record(Record),
    /// The checklist has changed: store the change, and show it on every screen.
    StoreChecklist(ChecklistEntry),
    /// Report to the screens why a step of the checklist is not signed or voided.
    RefuseSignature(String),
    /// Store the last position of the vehicle in the files for maps.
    StorePlace(Box<LastPlace>),
    /// Store beside the log what must survive the end of the station.
    StoreUnfinished(Unfinished),
    /// Write the report of the flight.
    WriteReport,
    /// Move the pin of the demonstration's vehicle: out, or in.
    MovePin(bool),
    /// Enter this into the book.
    Enter(BookLine),
    /// Write the log to disk now.
    SyncLog,
    /// Redraw the whole screen.
    Redraw,
    /// Change the screen's colours to the next theme.
    NextTheme,
    /// Pass on this request of the crew: a screen in another process sends it to its station, the
    /// station to its other screens.
    Request(Request),
    /// Give the terminal back and continue without a screen.
    LeaveScreen,
    Bell,
    /// Call this out with the crew's voice.
    CallOut(String),
    /// An alarm was raised: run the alarm command with its text.
    Alarm(String),
    Quit,
}

impl Action {
    pub(crate) fn send(message: MavMessage) -> Self {
        Self::Send(Box::new(message))
    }

    pub(crate) fn event(speaker: Speaker, level: EventLevel, message: &str) -> Self {
        let event = record::Event { level, name: speaker.to_string(), message: message.to_owned() };
        Self::Record(Record::Event(event))
    }
}

// The flight's progress as received by the ground; the exit code follows from it.

/// How the flight has gone so far.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FlightSoFar {
    /// The vehicle has left the pad (or the simulation was released).
    pub started: bool,
    /// When the vehicle latched an abort.
    pub aborted_at: Option<Duration>,
    /// The last arming or start was refused: the reason and the time.
    pub refusal: Option<(String, Duration)>,
    /// The vehicle's verdict (whether it stands undamaged) and its time.
    pub verdict: Option<(bool, Duration)>,
    /// When the vehicle reached SAFED after a flight.
    pub safed_at: Option<Duration>,
    /// Why the run cannot continue.
    pub error: Option<String>,
}
