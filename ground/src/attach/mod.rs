//! Attached screens: the messages between a station and screens in other processes, over a Unix
//! socket.
//!
//! The station sends every message that it takes into its model to every screen, with its time. The
//! screen takes the same messages into its own model and so shows the same. A screen sends back the
//! crew's requests; the station decides and acts. Killing a screen therefore loses nothing, and the
//! station keeps repeating an abort.

pub mod codec;
pub mod socket;

use serde::{Deserialize, Serialize};

use crate::model::{Request, Settings, Silence};
use crate::update::Msg;

// What a station and its screens say to each other.

/// The version of the encoding. A program of another version is refused with an explanation.
pub const VERSION: u32 = 18;
/// The longest name of an operator, in characters.
pub(crate) const OPERATOR_MAX: usize = 40;

/// What the station is; the first message to a screen.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Hello {
    /// The number that the station has given to this screen.
    pub screen: u32,
    /// The settings of the station, without what is its own screen's.
    pub station: Settings,
}

/// What a station sends to its screens.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum ToScreen {
    /// The end of the history; everything after it is live.
    Live,
    /// A message that the station has taken into its model.
    Msg(Msg),
    /// The answer to a request for the status.
    Status(StationStatus),
    /// The answer to a request to stop: whether the station stops, and the reason, or where the log
    /// is.
    Stopping { stops: bool, words: String },
    /// The first message to a screen.
    Hello(Box<Hello>),
}

/// The status of a station, for `ground status` and for finding it.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct StationStatus {
    pub pid: u32,
    pub link: String,
    /// Whether the vehicle is simulated in the station's process.
    pub demonstration: bool,
    /// LIVE, SIM or DEMO.
    pub kind: String,
    /// The vehicle's MAVLink ids, as in `1/1`, if it was received.
    pub vehicle: Option<String>,
    /// 0 if it is not known.
    pub boot_number: u32,
    /// In words.
    pub phase: String,
    pub armed: bool,
    /// Whether the vehicle is armed, in flight or being aborted.
    pub at_risk: bool,
    pub log: Option<String>,
    /// The screens with their operators.
    pub screens: Vec<String>,
}

/// What a screen, or a command without a screen, sends to a station.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub enum ToStation {
    /// The first message of a screen; with `watch` it is the only one.
    Hello { watch: bool, operator: String },
    /// Asks for the status; the only message.
    Status,
    /// Asks the station to stop, with `force` even while the vehicle is armed or in flight; the
    /// only message.
    Stop { force: bool, operator: String },
    /// A request of the crew.
    Request(Request),
    /// A key was pressed; for the log.
    Key(String),
    /// The screen's terminal answers, and whether it shows the screen. A screen that is not seen
    /// for a second does not count.
    Here(Result<(), Silence>),
}
