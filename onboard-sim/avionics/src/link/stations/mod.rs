//! Tracks the uplink of each ground station: accepted frames, their age, and refused frames.
//!
//! A working downlink does not prove a working uplink. So the vehicle reports to every station the
//! age of the last frame accepted from it, and why the last frame of any sender was refused. Pure:
//! times are vehicle times, s.
//!
//! Two programs may use the same ids: both have the default ones, or one was restarted. They are
//! distinguished by their signing key, by the session in their heartbeats (drawn at a program's
//! start), and without a session, as for other clients, by the [path](Path) of their frames. A
//! frame other than a heartbeat belongs to the station whose heartbeats take its path.

use alloc::vec;
use alloc::vec::Vec;
use flight::rules::arming::Uplink;
use flight::rules::operator::Operator;
use flight::rules::two_person::Station;
use mavlink::MessageData as _;
use protocol::dialect::{
    HEARTBEAT_DATA, MavMessage, MavState, MavType, RADIO_STATUS_DATA, TD_UPLINK_DATA, TdFrameRefusal,
};
use protocol::frame::Frame;
use protocol::hub::Origin;
use protocol::identity::Address;
use protocol::signing::Rejection;

/// Most stations remembered: the crew's, a spare one and an observer's. Each costs a message twice
/// a second.
pub const MAX_STATIONS: usize = 3;
/// The same with operators. No more than [`MAX_STATIONS`] get reports at once: of more, each in
/// turn.
const MAX_STATIONS_OF_A_CREW: usize = 6;

/// Interval of the uplink report to every station, s.
const REPORT_INTERVAL_S: f64 = 0.5;

/// Time after its last heartbeat for which a station retains its entry, s; frames of others do not
/// displace it.
const PROVEN_FOR_S: f64 = 60.0;

/// Two stations with the same ids are there as long as a heartbeat of each is no older than this,
/// s. A station sends one a second at least, and half of them may be lost.
pub const SAME_IDS_FOR_S: f64 = 5.0;

/// Most paths remembered of a station, and most of its last heartbeats.
const MAX_PATHS: usize = 4;
const MAX_BEATS: usize = 4;

/// Addressee while no frame was ever accepted: broadcast.
const EVERYBODY: Address = Address { system_id: 0, component_id: 0 };

/// Path of a frame: the number of its link, and its sender, if the link distinguishes senders
/// (`None`: it does not).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Path {
    pub link: usize,
    pub origin: Option<Origin>,
}

impl From<usize> for Path {
    fn from(link: usize) -> Self {
        Self { link, origin: None }
    }
}

/// Who has sent a frame: its ids, the number of the operator's key that has signed it (0: the
/// shared key, or none), and its path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sender {
    pub address: Address,
    pub key: u8,
    pub path: Path,
}

/// A station with an accepted frame.
#[derive(Debug, Clone, PartialEq)]
struct Peer {
    address: Address,
    key: u8,
    /// 0: it reports none.
    session: u32,
    number: u32,
    /// The paths of its frames, the latest first.
    paths: Vec<Path>,
    /// Sequence numbers and checksums of its last heartbeats, the latest first, by which a copy is
    /// recognised.
    beats: Vec<(u8, u16)>,
    accepted_at_s: f64,
    heartbeat_at_s: Option<f64>,
    /// Its last heartbeat reports that it receives nothing from the vehicle.
    deaf: bool,
    /// Time at which the heartbeat of another station under these ids found no free entry.
    crowded_at_s: Option<f64>,
}

impl Peer {
    fn is_of(&self, sender: &Sender) -> bool {
        (self.address, self.key) == (sender.address, sender.key)
    }

    fn takes(&self, path: Path) -> bool {
        self.paths.contains(&path)
    }

    fn learn(&mut self, path: Path) {
        self.paths.retain(|other| *other != path);
        self.paths.insert(0, path);
        self.paths.truncate(MAX_PATHS);
    }

    fn station(&self) -> Station {
        station_of(self.address, self.number)
    }

    /// Whether a heartbeat was received recently.
    fn is_there(&self, time_s: f64) -> bool {
        self.heartbeat_at_s.is_some_and(|at_s| time_s - at_s <= SAME_IDS_FOR_S)
    }
}

fn station_of(address: Address, number: u32) -> Station {
    Station { system: address.system_id, component: address.component_id, number }
}

/// The last refused frame, whatever sender it claims.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Refused {
    from: Address,
    why: Rejection,
    at_s: f64,
}

flight::with_defaults! {
    /// All stations with an entry.
    #[derive(Debug, Clone)]
    pub struct Stations {
        most: usize = MAX_STATIONS,
        peers: Vec<Peer> = Vec::new(),
        /// How many there were.
        numbered: u32 = 0,
        /// Index of the station that gets the next report.
        next: usize = 0,
        touchdown: bool = false,
        refused: Option<Refused> = None,
        refused_count: u16 = 0,
        commander: Option<(Station, Option<Operator>)> = None,
        report_at_s: f64 = 0.0,
    }
}

impl Stations {
    /// No stations yet, of a vehicle with operators.
    pub fn of_a_crew() -> Self {
        Self { most: MAX_STATIONS_OF_A_CREW, ..Self::default() }
    }

    /// Notes an accepted frame.
    pub fn accepted(&mut self, frame: &Frame, sender: &Sender, time_s: f64) {
        // A radio's report about itself is accepted unsigned, from any address: it does not prove a
        // station.
        if frame.message_id() == RADIO_STATUS_DATA::ID {
            return;
        }
        let session = (frame.message_id() == HEARTBEAT_DATA::ID).then(|| session_of(frame));
        let place = match session {
            Some(session) => self.place_of_session(sender, session),
            None => self.place_of(sender),
        };
        let Some(place) = place.or_else(|| self.add(sender, session.unwrap_or(0), time_s)) else {
            let same = |peer: &&mut Peer| session.is_some() && peer.address == sender.address;
            self.peers.iter_mut().filter(same).for_each(|peer| peer.crowded_at_s = Some(time_s));
            return;
        };
        let peer = &mut self.peers[place];
        peer.accepted_at_s = time_s;
        let Some(session) = session else { return };
        peer.session = session;
        self.touchdown |= session != 0;
        peer.heartbeat_at_s = Some(time_s);
        peer.deaf = is_deaf(frame);
        peer.learn(sender.path);
        peer.beats.insert(0, (frame.sequence(), frame.crc()));
        peer.beats.truncate(MAX_BEATS);
        // One that was started again leaves no trace: only the one in command is still waited for.
        let (number, commander) = (peer.number, self.commander.map(|(station, _)| station.number));
        self.peers.retain(|peer| {
            peer.address != sender.address
                || peer.number == number
                || Some(peer.number) == commander
                || time_s - peer.accepted_at_s <= SAME_IDS_FOR_S
        });
    }

    /// Notes a copy of an accepted frame: the same station uses this path, too.
    pub fn copied(&mut self, frame: &Frame, sender: &Sender) {
        if frame.message_id() != HEARTBEAT_DATA::ID {
            return;
        }
        let (session, beat) = (session_of(frame), (frame.sequence(), frame.crc()));
        let original = self.peers.iter().position(|peer| {
            peer.is_of(sender) && peer.session == session && (session != 0 || peer.beats.contains(&beat))
        });
        let Some(original) = original else { return };
        // Without a session, heartbeats that the first path has lost looked like another station's.
        let twin = self.peers.iter().enumerate().position(|(place, peer)| {
            place != original
                && session == 0
                && peer.session == 0
                && peer.is_of(sender)
                && peer.takes(sender.path)
        });
        let Some(twin) = twin else { return self.peers[original].learn(sender.path) };
        let commands = |peer: &Peer| self.commander.is_some_and(|(station, _)| station == peer.station());
        let (left, removed) = if commands(&self.peers[twin]) { (twin, original) } else { (original, twin) };
        let Peer { paths, heartbeat_at_s, accepted_at_s, .. } = self.peers[removed].clone();
        let one = &mut self.peers[left];
        paths.into_iter().rev().for_each(|path| one.learn(path));
        one.heartbeat_at_s = [one.heartbeat_at_s, heartbeat_at_s].into_iter().flatten().reduce(f64::max);
        one.accepted_at_s = one.accepted_at_s.max(accepted_at_s);
        self.peers.remove(removed);
    }

    /// The station that a heartbeat belongs to. One that spoke before its first heartbeat has it
    /// now.
    fn place_of_session(&self, sender: &Sender, session: u32) -> Option<usize> {
        let of = |same: &dyn Fn(&Peer) -> bool| {
            self.peers.iter().position(|peer| peer.is_of(sender) && same(peer))
        };
        of(&|peer| {
            peer.session == session
                && peer.heartbeat_at_s.is_some()
                && (session != 0 || peer.takes(sender.path))
        })
        .or_else(|| of(&|peer| peer.heartbeat_at_s.is_none() && peer.takes(sender.path)))
    }

    /// The station that any other frame belongs to: the last one whose heartbeat took this path.
    fn place_of(&self, sender: &Sender) -> Option<usize> {
        let candidates = self.peers.iter().enumerate();
        let candidates = candidates.filter(|(_, peer)| peer.is_of(sender) && peer.takes(sender.path));
        let beat_at_s = |peer: &Peer| peer.heartbeat_at_s.unwrap_or(f64::NEG_INFINITY);
        candidates
            .max_by(|(_, one), (_, other)| beat_at_s(one).total_cmp(&beat_at_s(other)))
            .map(|(place, _)| place)
    }

    /// Adds a station, if there is room.
    fn add(&mut self, sender: &Sender, session: u32, time_s: f64) -> Option<usize> {
        if self.peers.len() >= self.most {
            let leaving = self.replaceable(sender.address, time_s)?;
            self.peers.remove(leaving);
        }
        self.numbered += 1;
        self.peers.push(Peer {
            address: sender.address,
            key: sender.key,
            session,
            number: self.numbered,
            paths: vec![sender.path],
            beats: Vec::new(),
            accepted_at_s: time_s,
            heartbeat_at_s: None,
            deaf: false,
            crowded_at_s: None,
        });
        Some(self.peers.len() - 1)
    }

    /// The entry of a station that never proved itself or has been silent for a long time; under
    /// the same ids for a short one, as after a restart of the station.
    fn replaceable(&self, address: Address, time_s: f64) -> Option<usize> {
        let proven = |peer: &Peer| {
            let for_s = if peer.address == address { SAME_IDS_FOR_S } else { PROVEN_FOR_S };
            peer.heartbeat_at_s.is_some_and(|at_s| time_s - at_s <= for_s)
                || self.commander.is_some_and(|(station, _)| station == peer.station())
        };
        self.peers.iter().position(|peer| !proven(peer))
    }

    /// Notes a refused frame.
    pub fn refused(&mut self, from: Address, why: Rejection, time_s: f64) {
        self.refused = Some(Refused { from, why, at_s: time_s });
        self.refused_count = self.refused_count.saturating_add(1);
    }

    /// The station that a frame other than a heartbeat belongs to; with number 0 if it has no
    /// entry.
    pub fn of(&self, sender: &Sender) -> Station {
        let number = self.place_of(sender).map_or(0, |place| self.peers[place].number);
        station_of(sender.address, number)
    }

    fn peer(&self, station: Station) -> Option<&Peer> {
        self.peers.iter().find(|peer| peer.station() == station)
    }

    /// How many other stations are there under the same ids; those that found no place count as
    /// one.
    pub fn same_ids(&self, station: Station, time_s: f64) -> usize {
        let same = |peer: &&Peer| {
            (peer.address.system_id, peer.address.component_id) == (station.system, station.component)
        };
        let same: Vec<&Peer> = self.peers.iter().filter(same).collect();
        let crowded = |peer: &&Peer| peer.crowded_at_s.is_some_and(|at_s| time_s - at_s <= SAME_IDS_FOR_S);
        let others = same.iter().filter(|peer| peer.station() != station && peer.is_there(time_s));
        others.count() + usize::from(station.number != 0 && same.iter().any(crowded))
    }

    /// Whether a Touchdown station was received since power-up: only those have a session.
    pub fn has_received_touchdown(&self) -> bool {
        self.touchdown
    }

    /// Whether there is an entry of any other station.
    pub fn has_others(&self, station: Station) -> bool {
        self.peers.iter().any(|peer| peer.station() != station)
    }

    /// Age of the last sign of life of a station, s; `None` if there is none. A station with a
    /// session lives by its heartbeats: its other frames might be another one's.
    pub fn age_s(&self, station: Station, time_s: f64) -> Option<f64> {
        let peer = self.peer(station)?;
        let at_s = if peer.session == 0 { Some(peer.accepted_at_s) } else { peer.heartbeat_at_s };
        at_s.map(|at_s| time_s - at_s)
    }

    /// Whether a station reports that it receives nothing from the vehicle.
    pub fn is_deaf(&self, station: Station) -> bool {
        self.peer(station).is_some_and(|peer| peer.deaf)
    }

    /// Uplink of a station, by its heartbeats.
    pub fn uplink(&self, station: Station, time_s: f64) -> Uplink {
        let heartbeat_at_s = self.peer(station).and_then(|peer| peer.heartbeat_at_s);
        heartbeat_at_s.map_or(Uplink::NeverReceived, |at_s| Uplink::Received { age_s: time_s - at_s })
    }

    /// Uplink of the best station.
    pub fn best_uplink(&self, time_s: f64) -> Uplink {
        let latest_s = self.peers.iter().filter_map(|peer| peer.heartbeat_at_s).reduce(f64::max);
        latest_s.map_or(Uplink::NeverReceived, |at_s| Uplink::Received { age_s: time_s - at_s })
    }

    /// Sets the station that armed the vehicle or has taken command, if any, and its operator.
    pub fn set_commander(&mut self, commander: Option<(Station, Option<Operator>)>) {
        self.commander = commander;
    }

    /// The station that armed the vehicle or has taken command, and its operator.
    pub fn commander(&self) -> Option<(Station, Option<Operator>)> {
        self.commander
    }

    /// The station that armed the vehicle or has taken command.
    pub fn armed_by(&self) -> Option<Station> {
        self.commander.map(|(station, _)| station)
    }

    /// The uplink reports that are due: one for each station, but at most [`MAX_STATIONS`], or one
    /// broadcast while there is none.
    pub fn due(&mut self, boot_number: u32, time_s: f64) -> Vec<MavMessage> {
        if time_s < self.report_at_s {
            return Vec::new();
        }
        let next_s = self.report_at_s + REPORT_INTERVAL_S;
        self.report_at_s = if next_s > time_s { next_s } else { time_s + REPORT_INTERVAL_S };
        if self.peers.is_empty() {
            return vec![self.message(None, boot_number, time_s)];
        }
        let reported = self.peers.len().min(MAX_STATIONS);
        let first = self.next % self.peers.len();
        self.next = first + reported;
        let peers = self.peers.iter().cycle().skip(first).take(reported);
        peers.map(|peer| self.message(Some(peer), boot_number, time_s)).collect()
    }

    fn message(&self, to: Option<&Peer>, boot_number: u32, time_s: f64) -> MavMessage {
        let age_ms = |at_s: Option<f64>| {
            at_s.map_or(u16::MAX, |at_s| (1000.0 * (time_s - at_s)).clamp(0.0, 65_534.0) as u16)
        };
        let refused = self.refused;
        let from = refused.map_or(EVERYBODY, |refused| refused.from);
        let address = to.map_or(EVERYBODY, |peer| peer.address);
        let station = to.map(Peer::station);
        let same_ids = station.map_or(0, |station| self.same_ids(station, time_s));
        MavMessage::TD_UPLINK(TD_UPLINK_DATA {
            boot_number,
            accepted_age_ms: age_ms(to.map(|peer| peer.accepted_at_s)),
            refused_age_ms: age_ms(refused.map(|refused| refused.at_s)),
            refused_count: self.refused_count,
            target_system: address.system_id,
            target_component: address.component_id,
            commands: u8::from(station.is_some() && self.armed_by() == station),
            refusal: refused.map_or(TdFrameRefusal::TD_FRAME_REFUSAL_NONE, |refused| refusal(refused.why)),
            refused_system: from.system_id,
            refused_component: from.component_id,
            session: to.map_or(0, |peer| peer.session),
            same_id: u8::try_from(same_ids).unwrap_or(u8::MAX),
        })
    }
}

/// The session in a ground station's heartbeat; 0 if there is none. In other heartbeats the field
/// is a mode.
fn session_of(frame: &Frame) -> u32 {
    match frame.decode() {
        Ok(MavMessage::HEARTBEAT(beat)) if beat.mavtype == MavType::MAV_TYPE_GCS => beat.custom_mode,
        _ => 0,
    }
}

/// Whether a ground station's heartbeat reports that it receives nothing from the vehicle.
fn is_deaf(beat: &Frame) -> bool {
    matches!(beat.decode(), Ok(MavMessage::HEARTBEAT(beat))
        if beat.mavtype == MavType::MAV_TYPE_GCS && beat.system_status == MavState::MAV_STATE_CRITICAL)
}

fn refusal(why: Rejection) -> TdFrameRefusal {
    match why {
        Rejection::Unsigned => TdFrameRefusal::TD_FRAME_REFUSAL_UNSIGNED,
        Rejection::Wrong => TdFrameRefusal::TD_FRAME_REFUSAL_WRONG_KEY,
        Rejection::Replayed => TdFrameRefusal::TD_FRAME_REFUSAL_REPLAYED,
        Rejection::TooOld => TdFrameRefusal::TD_FRAME_REFUSAL_TOO_OLD,
        Rejection::TooNew => TdFrameRefusal::TD_FRAME_REFUSAL_TOO_NEW,
    }
}

#[cfg(test)]
mod tests;
