//! The link to the vehicle: what it carries, what was rejected, and when the vehicle was heard.

use std::time::Duration;

use protocol::dialect::{MavMessage, RADIO_STATUS_DATA};
use protocol::frame::FramerCounters;
use protocol::identity::Address;
use protocol::link_stats::{ContentAge, LinkFigures, LinkStats, SourceFigures};
use protocol::signing::SigningCounters;

use super::boot::time_boot_ms;
use super::link_state::LinkState;
use super::uplink::Uplink;

/// How long a radio's last report about itself is shown.
pub const RADIO_FRESH: Duration = Duration::from_secs(5);

/// Nothing is armed or started for this long after another station was heard under our address.
const SAME_ID_FOR: Duration = Duration::from_secs(10);

/// An attached screen that was told nothing for longer than this has a silent station: twenty of its ticks. Less than the
/// silence after which a vehicle is lost, so that the two are not mistaken for each other.
const STATION_SILENT_AFTER: Duration = Duration::from_secs(2);

/// The state of one of several links.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkReport {
    /// The name, as in `udpin:0.0.0.0:14550`.
    pub name: String,
    pub figures: LinkFigures,
    /// The rates and losses of each component on this link.
    pub sources: Vec<SourceFigures>,
    /// The capacity of the link, bytes per second; `None` if no bound is known.
    pub capacity_bytes_s: Option<u32>,
    /// Frames that had already arrived over another link.
    pub copies: u64,
    /// Why the link does not work, if it does not.
    pub trouble: Option<String>,
}

/// The link to the vehicle, which may consist of several links.
#[derive(Debug, Default)]
pub struct Link {
    /// Rates, loss and ages over all links. A frame is lost if it arrived over none of them.
    pub stats: LinkStats,
    /// Each link by itself, at [`Self::reported_at`].
    pub reports: Vec<LinkReport>,
    /// When the links were last reported.
    pub reported_at: Duration,
    /// How many frames passed or failed the signature check; `None` without a key.
    pub signing: Option<SigningCounters>,
    /// When a frame was last refused for its signature.
    pub(crate) refused_at: Option<Duration>,
    /// The crew was told that nothing is heard.
    pub(crate) unheard_reported: bool,
    /// The last report of a radio about itself, and its time. It says nothing about the vehicle.
    pub radio: Option<(RADIO_STATUS_DATA, Duration)>,
    /// The number of the link that brought the last frame, if there are several.
    pub(crate) heard_over: Option<usize>,
    /// What the framer rejected.
    pub framing: FramerCounters,
    /// Frames with a correct checksum whose fields could not be decoded.
    pub undecodable: u64,
    /// Writes dropped because the send queue was full.
    pub send_drops: u64,
    /// Why no link works, if none does.
    pub trouble: Option<String>,
    /// The crew has asked for an abort that reached no station. The screen sends it to the next station that it
    /// finds.
    pub abort_unsent: bool,
    /// On an attached screen: the last tick of its station. `None` in the station itself.
    pub(crate) station_at: Option<Duration>,
    /// On an attached screen: its station has ended.
    pub(crate) station_gone: bool,
    /// The first heartbeat of the vehicle.
    pub first_heartbeat_at: Option<Duration>,
    /// The last frame of the vehicle, of any kind.
    pub heard_at: Option<Duration>,
    /// How old what the vehicle says is when it arrives.
    pub(crate) content: ContentAge,
    /// Whether the vehicle hears this station.
    pub uplink: Uplink,
    /// The round-trip time, measured with TIMESYNC.
    pub round_trip: Option<Duration>,
    /// Since when the vehicle has been heard without a loss of the link.
    pub(crate) alive_since: Option<Duration>,
    pub(crate) loss_reported: bool,
    /// When another station was last heard under our address.
    pub(crate) same_id_at: Option<Duration>,
    pub(crate) strangers: Vec<Address>,
}

impl Link {
    /// The name of the link that brought the last frame, if there are several.
    pub fn heard_over(&self) -> Option<&str> {
        let report = self.heard_over.and_then(|number| self.reports.get(number));
        report.map(|report| report.name.as_str())
    }

    /// Whether another station uses our address, or has used it a moment ago: it may be the one that the vehicle obeys.
    pub fn shares_our_id(&self, now: Duration) -> bool {
        self.same_id_at.is_some_and(|at| now.saturating_sub(at) < SAME_ID_FOR)
    }

    /// How long the station of this attached screen has been silent, if it is.
    pub fn station_silence(&self, now: Duration) -> Option<Duration> {
        let silence = now.saturating_sub(self.station_at?);
        (silence > STATION_SILENT_AFTER && !self.station_gone).then_some(silence)
    }

    /// Whether the station of this attached screen has ended: the screen shows the past, and commands nothing.
    pub fn is_station_gone(&self) -> bool {
        self.station_gone
    }

    /// How long ago it was last heard, if it has ended.
    pub fn station_gone_for(&self, now: Duration) -> Option<Duration> {
        self.station_gone.then(|| now.saturating_sub(self.station_at.unwrap_or(now)))
    }

    /// Until when it is known what the station hears: in an attached screen its last tick, otherwise now.
    pub(crate) fn known_until(&self, now: Duration) -> Duration {
        self.station_at.map_or(now, |at| at.min(now))
    }

    /// The state of the downlink: whether the vehicle is heard. It counts as a vehicle from its first heartbeat.
    pub fn state(&self, now: Duration) -> LinkState {
        LinkState::of(self.first_heartbeat_at.and(self.heard_at), now)
    }

    /// Takes the time on the vehicle's clock that a message carries.
    pub(crate) fn date(&mut self, message: &MavMessage, now: Duration) {
        let clock_ms = match message {
            MavMessage::TD_FLIGHT_STATUS(data) => Some(data.time_boot_ms),
            MavMessage::TD_UPLINK(data) => Some(data.time_boot_ms),
            MavMessage::ATTITUDE(data) => Some(data.time_boot_ms),
            MavMessage::GLOBAL_POSITION_INT(data) => Some(data.time_boot_ms),
            _ => time_boot_ms(message),
        };
        if let Some(clock_ms) = clock_ms {
            self.content.hear(Duration::from_millis(clock_ms.into()), now);
        }
    }

    /// The downlink as the header shows it: by the age of what the vehicle has said last, which may have waited in a queue.
    pub fn down(&self, now: Duration) -> LinkState {
        let content = self.content.age(now).map(|age| now.saturating_sub(age));
        let last = self.first_heartbeat_at.and(self.heard_at);
        LinkState::of(last.map(|at| content.unwrap_or(at).min(at)), now)
    }

    /// The share of recent frames that was lost; `None` while nothing arrives that would show it.
    pub fn loss(&self, now: Duration) -> Option<f64> {
        self.state(now).carries().then(|| self.stats.figures(now).loss)
    }
}
