//! The link to the vehicle in both directions: rates, rejected frames, time of the last frame, and
//! whether the vehicle receives this station.

use std::collections::VecDeque;
use std::ops::Range;
use std::time::Duration;

use protocol::dialect::{MavMessage, RADIO_STATUS_DATA, TD_UPLINK_DATA, TdFrameRefusal};
use protocol::frame::FramerCounters;
use protocol::identity::Address;
use protocol::link_stats::{ContentAge, LinkFigures, LinkStats, SourceFigures};
use protocol::signing::SigningCounters;
use serde::{Deserialize, Serialize};

use super::{Model, Role, time_boot_ms};

/// How long a radio's last report about itself is shown.
const RADIO_FRESH: Duration = Duration::from_secs(5);

/// How long arming and starting are refused after a frame of another station under our address.
const SAME_ID_FOR: Duration = Duration::from_secs(10);

/// Silence after which an attached screen reports its station as silent: twenty of its ticks. Less
/// than the silence after which a vehicle is lost, so that the two are not mistaken for each other.
const STATION_SILENT_AFTER: Duration = Duration::from_secs(2);

/// The state of one of several links.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
    /// The hints for a link without data were reported.
    pub(crate) hints_reported: bool,
    /// The last report of a radio about itself, and its time. It is no evidence of the vehicle.
    pub(crate) radio: Option<(RADIO_STATUS_DATA, Duration)>,
    /// The number of the link that brought the last frame, if there are several.
    pub(crate) received_over: Option<usize>,
    /// From where the last frame came: a number for each link and address.
    pub(crate) source: u16,
    /// What the framer rejected.
    pub framing: FramerCounters,
    /// Frames with a correct checksum whose fields could not be decoded.
    pub undecodable: u64,
    /// Writes dropped because the send queue was full.
    pub send_drops: u64,
    /// Why no link works, if none does.
    pub trouble: Option<String>,
    /// The crew has requested an abort that reached no station. The screen sends it to the next
    /// station that it finds.
    pub abort_unsent: bool,
    /// When this attached screen has requested an abort that its station has not accepted yet.
    pub abort_requested_at: Option<Duration>,
    /// On an attached screen: the last tick of its station. `None` in the station itself.
    pub(crate) station_at: Option<Duration>,
    /// On an attached screen: its station has ended. The screen shows the past, and commands
    /// nothing.
    pub(crate) station_lost: bool,
    /// The first heartbeat of the vehicle.
    pub first_heartbeat_at: Option<Duration>,
    /// The last frame of the vehicle, of any kind.
    pub last_frame_at: Option<Duration>,
    /// Age of the vehicle's messages when they arrive.
    pub(crate) content: ContentAge,
    /// Whether the vehicle receives this station.
    pub uplink: Uplink,
    /// The stamps of the last TIMESYNC requests, ns.
    pub(crate) timesync_stamps: VecDeque<i64>,
    /// The round-trip time, measured with TIMESYNC.
    pub round_trip: Option<Duration>,
    /// Since when the downlink has been alive without a loss.
    pub(crate) alive_since: Option<Duration>,
    pub(crate) loss_reported: bool,
    /// When a frame of another station under our address last arrived.
    pub(crate) same_id_at: Option<Duration>,
    pub(crate) strangers: Vec<Address>,
}

impl Link {
    /// The name of the link that brought the last frame, if there are several.
    pub fn received_over(&self) -> Option<&str> {
        let report = self.received_over.and_then(|number| self.reports.get(number));
        report.map(|report| report.name.as_str())
    }

    /// Whether another station uses our address, or has used it recently: the vehicle may obey that
    /// one.
    pub fn shares_our_id(&self, now: Duration) -> bool {
        self.same_id_at.is_some_and(|at| now.saturating_sub(at) < SAME_ID_FOR)
    }

    /// How long the station of this attached screen has been silent, if it is.
    pub fn station_silence(&self, now: Duration) -> Option<Duration> {
        let silence = now.saturating_sub(self.station_at?);
        (silence > STATION_SILENT_AFTER && !self.station_lost).then_some(silence)
    }

    /// Why a requested abort is not sent, and what follows.
    pub fn why_abort_not_sent(&self, now: Duration) -> Option<&'static str> {
        if self.abort_unsent {
            return Some("no station. The next one sends it; Esc cancels it");
        }
        let hangs = self.abort_requested_at.is_some() && self.station_silence(now).is_some();
        hangs.then_some("the station hangs; it sends it when it resumes")
    }

    /// Time since the station's last tick, if it has ended.
    pub fn station_lost_for(&self, now: Duration) -> Option<Duration> {
        self.station_lost.then(|| now.saturating_sub(self.station_at.unwrap_or(now)))
    }

    /// Until when the station's data are current: in an attached screen its last tick, otherwise
    /// now.
    pub(crate) fn valid_until(&self, now: Duration) -> Duration {
        self.station_at.map_or(now, |at| at.min(now))
    }

    /// The state of the downlink. It counts as a vehicle from its first heartbeat.
    pub fn state(&self, now: Duration) -> LinkState {
        let last = self.first_heartbeat_at.and(self.last_frame_at);
        LinkState::of(last.map(|at| self.uplink.pace.of_the_vehicle(at, now)), now)
    }

    /// Takes the time on the vehicle's clock that a message carries.
    pub(crate) fn date(&mut self, message: &MavMessage, is_simulated: bool, now: Duration) {
        let clock_ms = time_boot_ms(message).filter(|_| !matches!(message, MavMessage::TIMESYNC(_)));
        if let Some(clock) = clock_ms.map(|clock_ms| Duration::from_millis(clock_ms.into())) {
            self.content.received(clock, now);
            self.uplink.pace.measure(clock, now);
        }
        if !is_simulated {
            self.uplink.pace = Pace::default();
        } else if self.uplink.pace.slow.is_some() {
            // Its clock would make all content look old.
            self.content = ContentAge::default();
        }
    }

    /// The downlink as the header shows it: by the age of the newest content, which may have waited
    /// in a queue.
    pub fn down(&self, now: Duration) -> LinkState {
        let content = self.content.age(now).map(|age| now.saturating_sub(age));
        let last = self.first_heartbeat_at.and(self.last_frame_at);
        LinkState::of(last.map(|at| content.unwrap_or(at).min(at)), now)
    }

    /// The last report of a radio about itself, while it is fresh.
    pub fn radio(&self, now: Duration) -> Option<&RADIO_STATUS_DATA> {
        let fresh = self.radio.as_ref().filter(|(_, at)| now.saturating_sub(*at) < RADIO_FRESH);
        fresh.map(|(radio, _)| radio)
    }

    /// The share of recent frames that was lost; `None` while nothing arrives that would show it.
    pub fn loss(&self, now: Duration) -> Option<f64> {
        self.state(now).carries().then(|| self.stats.figures(now).loss)
    }
}

// Whether one direction of the link works, by the age of the last frame that arrived on it.

/// After this long without a frame a direction of the link is doubtful: one and a half heartbeat
/// periods.
pub const AMBER_AFTER: Duration = Duration::from_millis(1_500);
/// After longer than this without a frame a direction of the link is lost: three heartbeat periods.
pub const RED_AFTER: Duration = Duration::from_secs(3);

/// The state of one direction of the link, with the age of its last frame. Reports of a radio about
/// itself do not count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinkState {
    NeverReceived,
    Alive(Duration),
    Doubtful(Duration),
    Lost(Duration),
}

impl LinkState {
    /// The state that follows from the time of the last frame.
    pub fn of(last_at: Option<Duration>, now: Duration) -> Self {
        let Some(at) = last_at else { return Self::NeverReceived };
        let age = now.saturating_sub(at);
        if age > RED_AFTER {
            Self::Lost(age)
        } else if age >= AMBER_AFTER {
            Self::Doubtful(age)
        } else {
            Self::Alive(age)
        }
    }

    /// Whether a command can be expected to arrive.
    pub fn carries(self) -> bool {
        matches!(self, Self::Alive(_) | Self::Doubtful(_))
    }
}

// Whether the vehicle receives this station. Receiving the vehicle does not prove it.

/// How long a proof of the uplink is valid: the vehicle must have received the arming station
/// within this time.
pub const PROVEN_WITHIN: Duration = Duration::from_secs(2);

/// The last frame that the vehicle refused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refused {
    pub why: TdFrameRefusal,
    /// The sender, as given in the frame.
    pub source: Address,
    /// When it arrived at the vehicle.
    pub at: Duration,
    /// How many frames were refused since the vehicle's boot.
    pub count: u16,
}

/// What the vehicle reports about its uplink, and what its answers prove.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Uplink {
    /// Whether the vehicle reports about this station.
    pub(crate) is_reported: bool,
    /// When it last accepted a frame of this station, as it reports.
    accepted_at: Option<Duration>,
    /// When the last TIMESYNC was sent that it has answered: the proof for a vehicle of another
    /// make.
    answered_at: Option<Duration>,
    /// Whether this station armed the vehicle.
    pub armed_by_us: bool,
    /// The station that armed the vehicle, if it is another. It may have our address.
    pub armed_by_other: Option<Address>,
    /// The session of that station.
    other_session: u32,
    /// The last refused frame.
    pub refused: Option<Refused>,
    pub(crate) pace: Pace,
}

/// Time over which a vehicle's clock is compared with ours.
const PACE_OVER: Duration = Duration::from_secs(5);
/// A faster clock counts as ours: messages may have been delayed. A slower one than the other is
/// not followed.
const PACES: Range<f64> = 1.0 / 16.0..0.8;

/// How fast the clock of a simulated vehicle runs: an emulated chip may take several times as long
/// for a frame. Only a simulated vehicle has another pace than ours.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Pace {
    /// The vehicle's clock and ours when the comparison began.
    since: Option<(Duration, Duration)>,
    /// Its time in one unit of ours, if it is slow.
    slow: Option<f64>,
}

impl Pace {
    fn measure(&mut self, clock: Duration, now: Duration) {
        let (began, began_at) = *self.since.get_or_insert((clock, now));
        let took = now.saturating_sub(began_at);
        if took >= PACE_OVER {
            let pace = clock.saturating_sub(began).as_secs_f64() / took.as_secs_f64();
            let slow = Some(pace.max(PACES.start)).filter(|pace| PACES.contains(pace));
            *self = Self { since: Some((clock, now)), slow };
        }
    }

    /// A past time, as far back as the vehicle's clock has advanced since.
    pub(crate) fn of_the_vehicle(self, at: Duration, now: Duration) -> Duration {
        self.slow.map_or(at, |pace| now.saturating_sub(now.saturating_sub(at).mul_f64(pace)))
    }
}

impl Uplink {
    /// Takes a report about this station, or about no station because the vehicle has accepted
    /// nothing yet.
    pub(crate) fn on_report(&mut self, report: &TD_UPLINK_DATA, now: Duration) {
        let ago = |age_ms: u16| {
            (age_ms != u16::MAX).then(|| now.saturating_sub(Duration::from_millis(age_ms.into())))
        };
        self.is_reported = true;
        self.accepted_at = ago(report.accepted_age_ms);
        self.armed_by_us = report.commands == 1;
        if self.armed_by_us {
            self.armed_by_other = None;
        }
        self.refused = ago(report.refused_age_ms).map(|at| Refused {
            why: report.refusal,
            source: Address { system_id: report.refused_system, component_id: report.refused_component },
            at,
            count: report.refused_count,
        });
    }

    /// Takes a report about another station.
    pub(crate) fn on_other_report(&mut self, report: &TD_UPLINK_DATA) {
        let station = Address { system_id: report.target_system, component_id: report.target_component };
        if report.commands == 1 {
            (self.armed_by_other, self.other_session) = (Some(station), report.session);
        } else if self.armed_by_other == Some(station) && self.other_session == report.session {
            self.armed_by_other = None;
        }
    }

    /// The other station that armed the vehicle, unless it holds a key of this crew, as a Touchdown
    /// station on a signed link does.
    pub(crate) fn unproven(&self, is_signed: bool) -> Option<Address> {
        self.armed_by_other.filter(|_| !is_signed || self.other_session == 0)
    }

    /// A TIMESYNC that was sent at this time was answered.
    pub(crate) fn answered(&mut self, requested_at: Duration) {
        self.answered_at = self.answered_at.max(Some(requested_at));
    }

    /// The state of the uplink.
    pub fn state(&self, now: Duration) -> LinkState {
        let last = if self.is_reported { self.accepted_at } else { self.answered_at };
        LinkState::of(last.map(|at| self.pace.of_the_vehicle(at, now)), now)
    }

    /// Whether it is proven that the vehicle receives this station.
    pub fn is_proven(&self, now: Duration) -> bool {
        matches!(self.state(now), LinkState::Alive(age) | LinkState::Doubtful(age) if age <= PROVEN_WITHIN)
    }

    /// Why the vehicle does not receive this station, as far as it reports.
    pub fn why_unproven(&self) -> String {
        let Some(refused) = self.refused else { return "it reports no frame".to_owned() };
        let Address { system_id, component_id } = refused.source;
        format!("it refuses frames of {system_id}/{component_id}: {}", refusal(refused.why))
    }
}

pub fn refusal(why: TdFrameRefusal) -> &'static str {
    match why {
        TdFrameRefusal::TD_FRAME_REFUSAL_NONE => "no reason reported",
        TdFrameRefusal::TD_FRAME_REFUSAL_UNSIGNED => "not signed, is the key missing here?",
        TdFrameRefusal::TD_FRAME_REFUSAL_WRONG_KEY => "signed with another key",
        TdFrameRefusal::TD_FRAME_REFUSAL_REPLAYED => "replay of a used time stamp",
        TdFrameRefusal::TD_FRAME_REFUSAL_TOO_OLD => "stamp too old, is the clock here slow?",
        TdFrameRefusal::TD_FRAME_REFUSAL_TOO_NEW => "stamp too far ahead, is the clock here fast?",
    }
}

// Hints while no telemetry has ever arrived, and while frames are refused for their signature.

/// A vehicle that is switched on sends a HEARTBEAT every second.
pub const HINTS_AFTER: Duration = Duration::from_secs(5);
/// Refused frames raise an alarm for this long after the last of them.
const REFUSED_SHOWN: Duration = Duration::from_secs(5);

/// What to check, the most likely first; `None` once telemetry has arrived, and in the first
/// seconds.
pub fn link_hints(model: &Model, now: Duration) -> Option<Vec<String>> {
    let live = model.settings.role != Role::Replaying && model.link.station_silence(now).is_none();
    if !live || now < HINTS_AFTER || model.link.state(now) != LinkState::NeverReceived {
        return None;
    }
    let id = model.settings.vehicle.system_id;
    let link = &model.settings.link_name;
    let framing = &model.link.framing;
    let mut hints = vec![format!("Nothing received from system {id} for {} s on {link}.", now.as_secs())];
    hints.extend(model.link.trouble.as_ref().map(|why| format!("The link does not work: {why}.")));
    hints.extend(refused_frames(model, now));
    let others: Vec<String> = model.link.strangers.iter().map(|other| other.system_id.to_string()).collect();
    if !others.is_empty() {
        hints
            .push(format!("Received instead: system {}. Choose it with --vehicle-sysid.", others.join(", ")));
    } else if framing.frames == 0 && framing.garbage_bytes > 0 {
        hints.push("Bytes come, but no MAVLink: is the baud rate right?".to_owned());
    }
    hints.push(what_the_link_does(link));
    hints.push("Is the vehicle switched on, and its antenna fitted?".to_owned());
    Some(hints)
}

/// The station's part of the link, and so what the other end has to do.
fn what_the_link_does(link: &str) -> String {
    let (kind, rest) = link.split_once(':').unwrap_or((link, ""));
    match kind {
        "udpin" => format!("It listens on {rest}: does the vehicle send to that port here?"),
        "udpout" => format!("It sends to {rest}: does the vehicle listen there?"),
        "tcpin" => format!("It waits on {rest}: does the vehicle connect to it?"),
        "tcpout" => format!("It connects to {rest}: does the vehicle serve there?"),
        _ => "Are port and baud rate those of the radio, and both radios paired?".to_owned(),
    }
}

/// How many frames were refused for their signature, while that continues and no telemetry arrives.
pub fn refused_frames(model: &Model, now: Duration) -> Option<String> {
    let goes_on = now.saturating_sub(model.link.refused_at?) < REFUSED_SHOWN;
    let counts: SigningCounters =
        model.link.signing.filter(|_| goes_on && !model.link.state(now).carries())?;
    let why = if counts.wrong >= counts.unsigned.max(counts.too_old) {
        "is --key the vehicle's key?"
    } else if counts.unsigned >= counts.too_old {
        "they are not signed: the vehicle has no key"
    } else {
        "their time is too old: see the clocks"
    };
    Some(format!("{} frames REFUSED, wrong signature: {why}", counts.rejected()))
}
