//! What the model asks of the run loop: messages to send, records to write, requests to the station.

use protocol::dialect::MavMessage;
use protocol::log::record::{Event, EventLevel, Record};

use super::alarm::AlarmKind;
use super::checklist::ChecklistEntry;
use super::command::CommandKind;
use super::events::Speaker;
use super::place::LastPlace;

/// What a screen in another process asks its station to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    /// The crew has completed every step of this command: send it.
    Command(CommandKind),
    /// The crew has seen this alarm.
    Acknowledge(AlarmKind),
    /// Ask the vehicle for its parameters.
    Parameters,
    /// Write the report of the flight.
    Report,
    /// Fetch the vehicle's own log.
    Download,
    /// Begin the radio range test.
    RangeTest,
    /// Arm and start although the station's log is unfit.
    WithoutLog,
    /// The crew has signed or voided this step of the checklist, counted from zero.
    Sign { step: u8, void: bool },
}

/// A line of the book: who did what. The run loop adds the time and the chain.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BookLine {
    /// As in `key`, `commanded`, `signed`.
    pub kind: String,
    /// Who did it; empty for the station or the vehicle itself.
    pub who: String,
    pub text: String,
}

/// What `update` wants the run loop to do.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Send a message to the vehicle.
    Send(Box<MavMessage>),
    /// Write a record into the log.
    Record(Record),
    /// The checklist has changed: keep the change, and show it on every screen.
    KeepChecklist(ChecklistEntry),
    /// Tell the screens why a step of the checklist is not signed or voided.
    RefuseSignature(String),
    /// Keep the last place of the vehicle in the files for maps.
    KeepPlace(Box<LastPlace>),
    /// Show the flight just flown again, on this screen.
    ReplayFlight,
    /// Write the report of the flight.
    WriteReport,
    /// Fetch the vehicle's own log.
    FetchLog,
    /// Enter this into the book.
    Enter(BookLine),
    /// Write the log to disk now.
    SyncLog,
    /// Redraw the whole screen.
    Redraw,
    /// Change the screen's colours to the next theme.
    NextTheme,
    /// Ask the station, from a screen in another process.
    Request(Request),
    /// Tell the other screens that the crew has asked for this on the station's own screen.
    Tell(Request),
    /// Give the terminal back and continue without a screen.
    LeaveScreen,
    Bell,
    /// Call this out with the crew's voice.
    Say(String),
    /// An alarm was raised: run the alarm command with its text.
    Alarm(String),
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
