//! Tracks how well the vehicle hears each ground station: whose frames were accepted, how long ago,
//! and whose were refused.
//!
//! A working downlink does not prove a working uplink. So the vehicle tells every station the age
//! of the last frame it accepted from that station, and why the last frame from anybody was
//! refused. Pure: times are vehicle times, s.
//!
//! Two programs may speak under the same ids: both have the default ones, or one was started again.
//! They are told apart by the key that signs, by the session in their heartbeats (drawn at a
//! program's start), and without a session, as other people's clients have none, by the
//! [path](Path) that their frames take. A frame that is no heartbeat belongs to the station whose
//! heartbeats take its path.

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
/// The same with operators. No more than [`MAX_STATIONS`] are told at once: of more, each in turn.
const MAX_STATIONS_OF_A_CREW: usize = 6;

/// Interval of the uplink report to every known station, s.
const TELL_EVERY_S: f64 = 0.5;

/// A station keeps its entry for this long after its last heartbeat, s; frames of others do not
/// push it out.
const PROVEN_FOR_S: f64 = 60.0;

/// Two stations with the same ids are there as long as a heartbeat of each is no older than this,
/// s. A station sends one a second at least, and half of them may be lost.
pub const SAME_IDS_FOR_S: f64 = 5.0;

/// Most paths remembered of a station, and most of its last heartbeats.
const MAX_PATHS: usize = 4;
const MAX_BEATS: usize = 4;

/// Addressee while no frame was ever accepted: everybody.
const EVERYBODY: Address = Address { system_id: 0, component_id: 0 };

/// How a frame came in: the number of its link, and who sent it, as that link tells its senders
/// apart (`None`: it does not).
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
    /// 0: it tells none.
    session: u32,
    number: u32,
    /// The paths of its frames, the latest first.
    paths: Vec<Path>,
    /// Sequence numbers and checksums of its last heartbeats, the latest first, by which a copy is
    /// recognised.
    beats: Vec<(u8, u16)>,
    accepted_at_s: f64,
    heartbeat_at_s: Option<f64>,
    /// Its last heartbeat says that it hears nothing of the vehicle.
    deaf: bool,
    /// When the heartbeat of another one under these ids found no place among the known stations.
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
        self.paths.retain(|known| *known != path);
        self.paths.insert(0, path);
        self.paths.truncate(MAX_PATHS);
    }

    fn station(&self) -> Station {
        station_of(self.address, self.number)
    }

    /// A heartbeat came not long ago.
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
    /// All known stations.
    #[derive(Debug, Clone)]
    pub struct Stations {
        most: usize = MAX_STATIONS,
        known: Vec<Peer> = Vec::new(),
        /// How many there were.
        numbered: u32 = 0,
        /// The known station that is told next.
        next: usize = 0,
        refused: Option<Refused> = None,
        refused_count: u16 = 0,
        commander: Option<(Station, Option<Operator>)> = None,
        tell_at_s: f64 = 0.0,
    }
}

impl Stations {
    /// No stations yet, of a vehicle with operators.
    pub fn of_a_crew() -> Self {
        Self { most: MAX_STATIONS_OF_A_CREW, ..Self::default() }
    }

    /// Notes an accepted frame.
    pub fn accepted(&mut self, frame: &Frame, sender: &Sender, time_s: f64) {
        // A radio's own report is accepted unsigned, from any address: it does not prove a station.
        if frame.message_id() == RADIO_STATUS_DATA::ID {
            return;
        }
        let session = (frame.message_id() == HEARTBEAT_DATA::ID).then(|| session_of(frame));
        let place = match session {
            Some(session) => self.place_of_session(sender, session),
            None => self.place_of(sender),
        };
        let Some(place) = place.or_else(|| self.add(sender, session.unwrap_or(0), time_s)) else {
            let same = |known: &&mut Peer| session.is_some() && known.address == sender.address;
            self.known.iter_mut().filter(same).for_each(|known| known.crowded_at_s = Some(time_s));
            return;
        };
        let known = &mut self.known[place];
        known.accepted_at_s = time_s;
        let Some(session) = session else { return };
        known.session = session;
        known.heartbeat_at_s = Some(time_s);
        known.deaf = is_deaf(frame);
        known.learn(sender.path);
        known.beats.insert(0, (frame.sequence(), frame.crc()));
        known.beats.truncate(MAX_BEATS);
        // One that was started again leaves no trace: only the one in command is still waited for.
        let (number, commander) = (known.number, self.commander.map(|(station, _)| station.number));
        self.known.retain(|known| {
            known.address != sender.address
                || known.number == number
                || Some(known.number) == commander
                || time_s - known.accepted_at_s <= SAME_IDS_FOR_S
        });
    }

    /// Notes a copy of an accepted frame: the same station speaks over this path, too.
    pub fn copied(&mut self, frame: &Frame, sender: &Sender) {
        if frame.message_id() != HEARTBEAT_DATA::ID {
            return;
        }
        let (session, beat) = (session_of(frame), (frame.sequence(), frame.crc()));
        let original = self.known.iter().position(|known| {
            known.is_of(sender) && known.session == session && (session != 0 || known.beats.contains(&beat))
        });
        let Some(original) = original else { return };
        // Without a session, heartbeats that the first path has lost looked like another station's.
        let twin = self.known.iter().enumerate().position(|(place, known)| {
            place != original
                && session == 0
                && known.session == 0
                && known.is_of(sender)
                && known.takes(sender.path)
        });
        let Some(twin) = twin else { return self.known[original].learn(sender.path) };
        let commands = |known: &Peer| self.commander.is_some_and(|(station, _)| station == known.station());
        let (stays, goes) = if commands(&self.known[twin]) { (twin, original) } else { (original, twin) };
        let Peer { paths, heartbeat_at_s, accepted_at_s, .. } = self.known[goes].clone();
        let one = &mut self.known[stays];
        paths.into_iter().rev().for_each(|path| one.learn(path));
        one.heartbeat_at_s = [one.heartbeat_at_s, heartbeat_at_s].into_iter().flatten().reduce(f64::max);
        one.accepted_at_s = one.accepted_at_s.max(accepted_at_s);
        self.known.remove(goes);
    }

    /// The station that a heartbeat belongs to. One that spoke before its first heartbeat has it
    /// now.
    fn place_of_session(&self, sender: &Sender, session: u32) -> Option<usize> {
        let of = |same: &dyn Fn(&Peer) -> bool| {
            self.known.iter().position(|known| known.is_of(sender) && same(known))
        };
        of(&|known| {
            known.session == session
                && known.heartbeat_at_s.is_some()
                && (session != 0 || known.takes(sender.path))
        })
        .or_else(|| of(&|known| known.heartbeat_at_s.is_none() && known.takes(sender.path)))
    }

    /// The station that any other frame belongs to: the last one whose heartbeat took this path.
    fn place_of(&self, sender: &Sender) -> Option<usize> {
        let candidates = self.known.iter().enumerate();
        let candidates = candidates.filter(|(_, known)| known.is_of(sender) && known.takes(sender.path));
        let beat_at_s = |known: &Peer| known.heartbeat_at_s.unwrap_or(f64::NEG_INFINITY);
        candidates
            .max_by(|(_, one), (_, other)| beat_at_s(one).total_cmp(&beat_at_s(other)))
            .map(|(place, _)| place)
    }

    /// Adds a station, if there is room.
    fn add(&mut self, sender: &Sender, session: u32, time_s: f64) -> Option<usize> {
        if self.known.len() >= self.most {
            let leaving = self.replaceable(sender.address, time_s)?;
            self.known.remove(leaving);
        }
        self.numbered += 1;
        self.known.push(Peer {
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
        Some(self.known.len() - 1)
    }

    /// The entry of a station that never proved itself or has been gone for a long time; under the
    /// same ids for a short one, as when a station was started again.
    fn replaceable(&self, address: Address, time_s: f64) -> Option<usize> {
        let proven = |known: &Peer| {
            let for_s = if known.address == address { SAME_IDS_FOR_S } else { PROVEN_FOR_S };
            known.heartbeat_at_s.is_some_and(|at_s| time_s - at_s <= for_s)
                || self.commander.is_some_and(|(station, _)| station == known.station())
        };
        self.known.iter().position(|known| !proven(known))
    }

    /// Notes a refused frame.
    pub fn refused(&mut self, from: Address, why: Rejection, time_s: f64) {
        self.refused = Some(Refused { from, why, at_s: time_s });
        self.refused_count = self.refused_count.saturating_add(1);
    }

    /// The station that a frame belongs to, other than a heartbeat; with number 0 if it is not
    /// known.
    pub fn of(&self, sender: &Sender) -> Station {
        let number = self.place_of(sender).map_or(0, |place| self.known[place].number);
        station_of(sender.address, number)
    }

    fn known(&self, station: Station) -> Option<&Peer> {
        self.known.iter().find(|known| known.station() == station)
    }

    /// How many other stations are there under the same ids; those that found no place count as
    /// one.
    pub fn same_ids(&self, station: Station, time_s: f64) -> usize {
        let same = |known: &&Peer| {
            (known.address.system_id, known.address.component_id) == (station.system, station.component)
        };
        let same: Vec<&Peer> = self.known.iter().filter(same).collect();
        let crowded = |known: &&Peer| known.crowded_at_s.is_some_and(|at_s| time_s - at_s <= SAME_IDS_FOR_S);
        let others = same.iter().filter(|known| known.station() != station && known.is_there(time_s));
        others.count() + usize::from(station.number != 0 && same.iter().any(crowded))
    }

    /// Age of the last sign of life of a station, s; `None` if there is none. One that tells its
    /// session lives as long as its heartbeats do: its other frames might be another one's.
    pub fn age_s(&self, station: Station, time_s: f64) -> Option<f64> {
        let known = self.known(station)?;
        let at_s = if known.session == 0 { Some(known.accepted_at_s) } else { known.heartbeat_at_s };
        at_s.map(|at_s| time_s - at_s)
    }

    /// Whether a station says that it hears nothing of the vehicle.
    pub fn is_deaf(&self, station: Station) -> bool {
        self.known(station).is_some_and(|known| known.deaf)
    }

    /// How well a station's heartbeat is heard.
    pub fn uplink(&self, station: Station, time_s: f64) -> Uplink {
        let heard = self.known(station).and_then(|known| known.heartbeat_at_s);
        heard.map_or(Uplink::NeverHeard, |at_s| Uplink::Heard { age_s: time_s - at_s })
    }

    /// How well the best station is heard.
    pub fn best_uplink(&self, time_s: f64) -> Uplink {
        let latest_s = self.known.iter().filter_map(|known| known.heartbeat_at_s).reduce(f64::max);
        latest_s.map_or(Uplink::NeverHeard, |at_s| Uplink::Heard { age_s: time_s - at_s })
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

    /// The uplink reports that are due: one for each known station, but at most [`MAX_STATIONS`],
    /// or one for everybody while there is none.
    pub fn due(&mut self, boot_number: u32, time_s: f64) -> Vec<MavMessage> {
        if time_s < self.tell_at_s {
            return Vec::new();
        }
        let next_s = self.tell_at_s + TELL_EVERY_S;
        self.tell_at_s = if next_s > time_s { next_s } else { time_s + TELL_EVERY_S };
        if self.known.is_empty() {
            return vec![self.message(None, boot_number, time_s)];
        }
        let told = self.known.len().min(MAX_STATIONS);
        let first = self.next % self.known.len();
        self.next = first + told;
        let known = self.known.iter().cycle().skip(first).take(told);
        known.map(|known| self.message(Some(known), boot_number, time_s)).collect()
    }

    fn message(&self, to: Option<&Peer>, boot_number: u32, time_s: f64) -> MavMessage {
        let age_ms = |at_s: Option<f64>| {
            at_s.map_or(u16::MAX, |at_s| (1000.0 * (time_s - at_s)).clamp(0.0, 65_534.0) as u16)
        };
        let refused = self.refused;
        let from = refused.map_or(EVERYBODY, |refused| refused.from);
        let address = to.map_or(EVERYBODY, |known| known.address);
        let station = to.map(Peer::station);
        let same_ids = station.map_or(0, |station| self.same_ids(station, time_s));
        MavMessage::TD_UPLINK(TD_UPLINK_DATA {
            boot_number,
            accepted_age_ms: age_ms(to.map(|known| known.accepted_at_s)),
            refused_age_ms: age_ms(refused.map(|refused| refused.at_s)),
            refused_count: self.refused_count,
            target_system: address.system_id,
            target_component: address.component_id,
            commands: u8::from(station.is_some() && self.armed_by() == station),
            refusal: refused.map_or(TdFrameRefusal::TD_FRAME_REFUSAL_NONE, |refused| refusal(refused.why)),
            refused_system: from.system_id,
            refused_component: from.component_id,
            session: to.map_or(0, |known| known.session),
            same_id: u8::try_from(same_ids).unwrap_or(u8::MAX),
        })
    }
}

/// The session that a ground station's heartbeat tells; 0 if it tells none. In anybody else's the
/// field is a mode.
fn session_of(frame: &Frame) -> u32 {
    match frame.decode() {
        Ok(MavMessage::HEARTBEAT(beat)) if beat.mavtype == MavType::MAV_TYPE_GCS => beat.custom_mode,
        _ => 0,
    }
}

/// Whether a ground station's heartbeat says that it hears nothing of the vehicle.
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
