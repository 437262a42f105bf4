//! The link to the vehicle: alive or not, and what it carries.

use std::time::Duration;

use protocol::dialect::RADIO_STATUS_DATA;
use protocol::frame::FramerCounters;
use protocol::identity::Address;
use protocol::link::{LinkFigures, LinkStats, SourceFigures};
use protocol::signing::SigningCounters;

use super::uplink::Uplink;

/// Without a frame for this long a direction of the link is doubtful: a heartbeat a second, and half of one.
pub const AMBER_AFTER: Duration = Duration::from_millis(1_500);
/// Without a frame for longer than this a direction of the link is lost: three heartbeats.
pub const RED_AFTER: Duration = Duration::from_secs(3);

/// What a radio said of itself is shown for this long.
pub const RADIO_FRESH: Duration = Duration::from_secs(5);

/// Whether one direction of the link works, by the age of the last frame that arrived on it. A radio that reports about
/// itself is not the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinkState {
    /// Nothing ever.
    NeverHeard,
    /// Just now.
    Alive(Duration),
    /// Something is missing.
    Doubtful(Duration),
    /// Lost.
    Lost(Duration),
}

impl LinkState {
    /// By when the last frame arrived.
    pub fn of(last_at: Option<Duration>, now: Duration) -> Self {
        let Some(at) = last_at else { return Self::NeverHeard };
        let age = now.saturating_sub(at);
        if age > RED_AFTER {
            Self::Lost(age)
        } else if age >= AMBER_AFTER {
            Self::Doubtful(age)
        } else {
            Self::Alive(age)
        }
    }

    /// Whether a command may be expected to arrive.
    pub fn carries(self) -> bool {
        matches!(self, Self::Alive(_) | Self::Doubtful(_))
    }
}

/// How one of several links does.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkReport {
    /// Its name, as in `udpin:0.0.0.0:14550`.
    pub name: String,
    /// What it carries.
    pub figures: LinkFigures,
    /// What it carries of each component.
    pub sources: Vec<SourceFigures>,
    /// What it can carry, bytes per second; `None` where nothing is known to bound it.
    pub capacity_bytes_s: Option<u32>,
    /// Frames that had come over another link already.
    pub copies: u64,
    /// Why it does not work, if it does not.
    pub trouble: Option<String>,
}

/// The link: one or several that lead to the same vehicle.
#[derive(Debug, Default)]
pub struct Link {
    /// Rates, loss and age over all links: loss is what came over none.
    pub stats: LinkStats,
    /// Each link by itself, as it was at [`Self::reported_at`].
    pub reports: Vec<LinkReport>,
    /// When the links were last reported.
    pub reported_at: Duration,
    /// What signatures let in and kept out; `None` without a key.
    pub signing: Option<SigningCounters>,
    /// What a radio last said about itself, and when. It says nothing about the vehicle.
    pub radio: Option<(RADIO_STATUS_DATA, Duration)>,
    /// The link that the last frame came over, where there are several.
    pub(crate) heard_over: Option<usize>,
    /// What framing threw away.
    pub framing: FramerCounters,
    /// Frames with a right checksum whose fields could not be understood.
    pub undecodable: u64,
    /// Writes that found no room.
    pub send_drops: u64,
    /// Why the transport does not work, if it does not.
    pub trouble: Option<String>,
    /// An abort was asked for, and no station has it: a screen without one asks the next.
    pub abort_unsent: bool,
    /// The first heartbeat of the vehicle.
    pub first_heartbeat_at: Option<Duration>,
    /// The last frame of the vehicle, of any kind.
    pub heard_at: Option<Duration>,
    /// What the vehicle hears of this station.
    pub uplink: Uplink,
    /// Round trip, measured by TIMESYNC.
    pub round_trip: Option<Duration>,
    /// Since when the vehicle is heard without a break that counts as one.
    pub(crate) alive_since: Option<Duration>,
    pub(crate) lost_said: bool,
    pub(crate) twin_said_at: Option<Duration>,
    pub(crate) strangers: Vec<Address>,
}

impl Link {
    /// The name of the link that the last frame came over, where there are several.
    pub fn heard_over(&self) -> Option<&str> {
        let report = self.heard_over.and_then(|number| self.reports.get(number));
        report.map(|report| report.name.as_str())
    }

    /// Whether the vehicle is heard: the direction down. It is known as a vehicle by its first heartbeat.
    pub fn state(&self, now: Duration) -> LinkState {
        LinkState::of(self.first_heartbeat_at.and(self.heard_at), now)
    }

    /// What of the last frames was lost, as a share; `None` where nothing arrives that it could be told by.
    pub fn loss(&self, now: Duration) -> Option<f64> {
        self.state(now).carries().then(|| self.stats.figures(now).loss)
    }
}
