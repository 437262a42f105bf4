//! The link to the vehicle: alive or not, and what it carries.

use std::time::Duration;

use protocol::frame::FramerCounters;
use protocol::identity::Address;
use protocol::link::LinkStats;

/// Without a heartbeat for this long the link is doubtful.
pub const AMBER_AFTER: Duration = Duration::from_millis(1_500);
/// Without a heartbeat for this long the link is lost.
pub const RED_AFTER: Duration = Duration::from_millis(3_500);

/// Whether the vehicle is heard. Only its heartbeat counts: a radio that reports about itself is not
/// the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinkState {
    /// No heartbeat ever.
    NeverHeard,
    /// Heard just now; the age of the last heartbeat.
    Alive(Duration),
    /// A heartbeat is missing.
    Doubtful(Duration),
    /// Lost.
    Lost(Duration),
}

impl LinkState {
    /// Whether a command may be expected to arrive.
    pub fn carries(self) -> bool {
        matches!(self, Self::Alive(_) | Self::Doubtful(_))
    }
}

/// The link.
#[derive(Debug, Default)]
pub struct Link {
    /// Rates, loss and age.
    pub stats: LinkStats,
    /// What framing threw away.
    pub framing: FramerCounters,
    /// Frames with a right checksum whose fields could not be understood.
    pub undecodable: u64,
    /// Writes that found no room.
    pub send_drops: u64,
    /// Why the transport does not work, if it does not.
    pub trouble: Option<String>,
    /// The first heartbeat of the vehicle.
    pub first_heartbeat_at: Option<Duration>,
    /// The last heartbeat of the vehicle.
    pub heartbeat_at: Option<Duration>,
    /// Round trip, measured by TIMESYNC.
    pub round_trip: Option<Duration>,
    pub(crate) lost_said: bool,
    pub(crate) twin_said_at: Option<Duration>,
    pub(crate) strangers: Vec<Address>,
}

impl Link {
    /// Whether the vehicle is heard.
    pub fn state(&self, now: Duration) -> LinkState {
        let Some(at) = self.heartbeat_at else { return LinkState::NeverHeard };
        let age = now.saturating_sub(at);
        if age >= RED_AFTER {
            LinkState::Lost(age)
        } else if age >= AMBER_AFTER {
            LinkState::Doubtful(age)
        } else {
            LinkState::Alive(age)
        }
    }
}
