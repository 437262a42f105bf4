//! Everything the ground knows, as plain data.

pub mod alarm;
pub mod boot;
pub mod chord;
pub mod command;
mod course;
pub mod crew;
pub mod dialog;
pub mod events;
pub mod flown;
pub mod hand;
pub mod history;
pub mod judgement;
pub mod link;
pub mod motion;
pub mod motor;
pub mod outcome;
pub mod page;
pub mod parameters;
pub mod reckoning;
pub mod seat;
pub mod telemetry;
pub mod too_late;
pub mod trend;
pub mod uplink;
pub mod vehicle;
pub mod words;

use std::time::Duration;

use protocol::identity::{Address, GROUND, VEHICLE};
use protocol::log::record::EventLevel;
use protocol::text::Reassembler;

use crate::update::Action;
use alarm::{Alarm, Alarms};
use chord::AbortChord;
use command::Commands;
use crew::Crew;
use dialog::Dialog;
use events::{Events, Speaker};
use hand::Hand;
use history::History;
use link::Link;
use outcome::Outcome;
use page::{Page, Pages};
use parameters::Parameters;
use seat::Seat;
use vehicle::Vehicle;

/// What the run was asked to be; never changes during it.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The link's name, as in `udpin:0.0.0.0:14550`.
    pub link_name: String,
    /// What the link can carry, bytes per second; `None` where nothing is known to bound it.
    pub link_capacity_bytes_s: Option<u32>,
    /// What flies, where that is known beforehand.
    pub vehicle_name: Option<String>,
    /// The log's path; `None` without a log.
    pub log_path: Option<String>,
    /// The telemetry log's path (`.tlog`); `None` without one.
    pub tlog_path: Option<String>,
    /// The station's own MAVLink address.
    pub us: Address,
    /// The vehicle's: nobody else on the link is shown or commanded.
    pub vehicle: Address,
    /// What this screen may do.
    pub role: Role,
    /// This screen and who sits at it.
    pub seat: Seat,
    /// The vehicle is simulated in the station's own process.
    pub demonstration: bool,
    /// Arm and start without a hand.
    pub auto: bool,
    /// Someone watches a screen: the end of a flight does not end the program.
    pub interactive: bool,
    /// Give up after this long without the end of a flight; without a screen only.
    pub time_limit: Option<Duration>,
}

impl Settings {
    /// A station with a person at its screen, and nothing else: no log, a link of unknown capacity, no time limit.
    pub fn on_screen(link_name: impl Into<String>) -> Self {
        Self {
            link_name: link_name.into(),
            link_capacity_bytes_s: None,
            vehicle_name: None,
            log_path: None,
            tlog_path: None,
            us: GROUND,
            vehicle: VEHICLE,
            role: Role::Station,
            seat: Seat::default(),
            demonstration: false,
            auto: false,
            interactive: true,
            time_limit: None,
        }
    }
}

/// What this screen may do.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Role {
    /// Holds the link: commands go out here.
    #[default]
    Station,
    /// Shows a station that runs elsewhere, and hands it the crew's commands.
    Attached,
    /// Shows a station that runs elsewhere; commands nothing.
    Watching,
    /// Shows a recorded flight; there is nothing to command.
    Replaying,
}

impl Role {
    /// Why this screen commands nothing; `None` if it may.
    pub fn why_not_command(self) -> Option<&'static str> {
        match self {
            Self::Station | Self::Attached => None,
            Self::Watching => Some("this screen only watches (--watch)"),
            Self::Replaying => Some("a replay commands nothing"),
        }
    }
}

/// Where a replay is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Playing {
    /// Time since the first frame.
    pub position: Duration,
    /// Time of the last frame.
    pub length: Duration,
    /// Flight time per real time.
    pub speed: f64,
    /// Time stands still.
    pub paused: bool,
}

/// How the log does.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LogHealth {
    /// Records that found no room.
    pub dropped: u64,
    /// The writer has failed.
    pub failed: bool,
}

/// When what is repeated is due next.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Due {
    pub(crate) heartbeat: Duration,
    pub(crate) timesync: Duration,
    pub(crate) telemetry_record: Duration,
}

/// How far the automatic mode is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AutoStep {
    /// Until the checks pass; after a refusal for now, not before some time.
    WaitForReady {
        not_before: Duration,
    },
    WaitForArmed,
    Done,
}

impl Default for AutoStep {
    fn default() -> Self {
        Self::WaitForReady { not_before: Duration::ZERO }
    }
}

/// Everything known.
#[derive(Debug)]
pub struct Model {
    /// What the run was asked to be.
    pub settings: Settings,
    /// The vehicle, by its telemetry.
    pub vehicle: Vehicle,
    /// The link.
    pub link: Link,
    /// Commands under way and done.
    pub commands: Commands,
    /// The open dialog.
    pub dialog: Dialog,
    /// How far the abort chord is.
    pub abort_chord: AbortChord,
    /// How the keys come.
    pub hand: Hand,
    /// The commanding screens.
    pub crew: Crew,
    /// The terminal tells a held key's repeats from presses, so that none of them arrives here.
    pub repeats_told: bool,
    /// What happened.
    pub events: Events,
    /// What became of the flight.
    pub outcome: Outcome,
    /// How the log does.
    pub log: LogHealth,
    /// What must be seen, and whether it was.
    pub alarms: Alarms,
    /// Which screen is shown.
    pub pages: Pages,
    /// Timeline and greatest values.
    pub history: History,
    /// The vehicle's parameters.
    pub parameters: Parameters,
    /// Where a replay is; `None` for a live flight.
    pub playing: Option<Playing>,
    pub(crate) rebooted_at: Option<Duration>,
    pub(crate) texts: Reassembler,
    pub(crate) due: Due,
    pub(crate) auto_step: AutoStep,
    /// A key to quit was pressed; it counts unless another key follows before this time.
    pub(crate) quit_at: Option<Duration>,
    pub(crate) outbox: Vec<Action>,
}

impl Model {
    /// Nothing known yet.
    ///
    /// A screen whose station runs elsewhere is told the past first, until [`Self::history_ends`].
    pub fn new(settings: Settings) -> Self {
        let told_the_past = matches!(settings.role, Role::Attached | Role::Watching);
        let alarms = if told_the_past { Alarms::in_history() } else { Alarms::default() };
        Self {
            settings,
            vehicle: Vehicle::default(),
            link: Link::default(),
            commands: Commands::default(),
            dialog: Dialog::Closed,
            abort_chord: AbortChord::default(),
            hand: Hand::default(),
            crew: Crew::default(),
            repeats_told: false,
            events: Events::default(),
            outcome: Outcome::default(),
            log: LogHealth::default(),
            alarms,
            pages: Pages::default(),
            history: History::default(),
            parameters: Parameters::default(),
            playing: None,
            rebooted_at: None,
            texts: Reassembler::new(),
            due: Due::default(),
            auto_step: AutoStep::default(),
            quit_at: None,
            outbox: Vec::new(),
        }
    }

    /// Everything that was told so far was the past: what holds of it rings now, what is over does not.
    pub fn history_ends(&mut self) {
        self.alarms.history_ends();
    }

    /// Armed, in flight, or being aborted: nobody may go away unawares.
    pub fn is_at_risk(&self) -> bool {
        let armed = self.vehicle.armed().is_some_and(|armed| armed.value);
        armed || self.commands.is_aborting() || self.vehicle.in_flight()
    }

    /// When time alone brings something to do before the next tick: the chord, or a command that is sent again.
    pub fn wakes_at(&self) -> Option<Duration> {
        let times = [self.abort_chord.acts_at(), self.commands.due_at()];
        times.into_iter().flatten().min()
    }

    /// The screen to show.
    pub fn page(&self) -> Page {
        self.pages.shown(self.vehicle.phase().map(|phase| phase.value))
    }

    /// The alarm that is acknowledged next: the chosen one of the list, or the foremost.
    pub fn pointed_at(&self) -> Option<&Alarm> {
        let listed = self.page() == Page::Alarms;
        let chosen = self.pages.chosen.filter(|_| listed);
        let chosen = chosen.and_then(|kind| self.alarms.list().iter().find(|alarm| alarm.kind == kind));
        chosen.or_else(|| self.alarms.foremost())
    }

    /// Notes an event for the list, the lines and the log.
    pub(crate) fn say(
        &mut self,
        now: Duration,
        speaker: Speaker,
        level: EventLevel,
        text: impl Into<String>,
    ) {
        let text = text.into();
        self.outbox.push(Action::event(speaker, level, &text));
        self.events.push(now, speaker, level, text);
    }

    pub(crate) fn info(&mut self, now: Duration, text: impl Into<String>) {
        self.say(now, Speaker::Ground, EventLevel::Info, text);
    }

    pub(crate) fn warn(&mut self, now: Duration, text: impl Into<String>) {
        self.say(now, Speaker::Ground, EventLevel::Warning, text);
    }
}
