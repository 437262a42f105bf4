//! Tracks how well the vehicle hears each ground station: whose frames were accepted, how long ago, and whose were
//! refused.
//!
//! A working downlink does not prove a working uplink. So the vehicle tells every station the age of the last frame it
//! accepted from that station, and why the last frame from anybody was refused. Pure: times are vehicle times, s.

use alloc::vec;
use alloc::vec::Vec;
use flight::rules::arming::Uplink;
use flight::rules::operator::Operator;
use mavlink_core::MessageData as _;
use protocol::dialect::{HEARTBEAT_DATA, MavMessage, RADIO_STATUS_DATA, TD_UPLINK_DATA, TdFrameRefusal};
use protocol::frame::Frame;
use protocol::identity::Address;
use protocol::signing::Rejection;

/// Most stations remembered: the crew's, a spare one and an observer's. Each costs a message twice a second.
pub const MAX_STATIONS: usize = 3;
/// The same with operators. No more than [`MAX_STATIONS`] are told at once: of more, each in turn.
const MAX_STATIONS_OF_A_CREW: usize = 6;

/// Interval of the uplink report to every known station, s.
const TELL_EVERY_S: f64 = 0.5;

/// A station keeps its entry for this long after its last heartbeat, s; frames of others do not push it out.
const PROVEN_FOR_S: f64 = 60.0;

/// Addressee while no frame was ever accepted: everybody.
const EVERYBODY: Address = Address { system_id: 0, component_id: 0 };

/// A station with an accepted frame.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Station {
    address: Address,
    accepted_at_s: f64,
    heartbeat_at_s: Option<f64>,
}

/// The last refused frame, whatever sender it claims.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Refused {
    from: Address,
    why: Rejection,
    at_s: f64,
}

/// All known stations.
#[derive(Debug, Clone)]
pub struct Stations {
    most: usize,
    known: Vec<Station>,
    /// The known station that is told next.
    next: usize,
    refused: Option<Refused>,
    refused_count: u16,
    commander: Option<(Address, Option<Operator>)>,
    tell_at_s: f64,
}

impl Default for Stations {
    fn default() -> Self {
        Self::at_most(MAX_STATIONS)
    }
}

impl Stations {
    /// No stations yet, of a vehicle with operators.
    pub fn of_a_crew() -> Self {
        Self::at_most(MAX_STATIONS_OF_A_CREW)
    }

    fn at_most(most: usize) -> Self {
        Self {
            most,
            known: Vec::new(),
            next: 0,
            refused: None,
            refused_count: 0,
            commander: None,
            tell_at_s: 0.0,
        }
    }

    /// Notes an accepted frame.
    pub fn accepted(&mut self, frame: &Frame, time_s: f64) {
        // A radio's own report is accepted unsigned, from any address: it does not prove a station.
        if frame.message_id() == RADIO_STATUS_DATA::ID {
            return;
        }
        let address = frame.source();
        if self.station(address).is_none() {
            if self.known.len() >= self.most {
                let Some(leaving) = self.replaceable(time_s) else { return };
                self.known.remove(leaving);
            }
            self.known.push(Station { address, accepted_at_s: time_s, heartbeat_at_s: None });
        }
        for station in self.known.iter_mut().filter(|station| station.address == address) {
            station.accepted_at_s = time_s;
            if frame.message_id() == HEARTBEAT_DATA::ID {
                station.heartbeat_at_s = Some(time_s);
            }
        }
    }

    /// The entry of a station that never proved itself or has been gone for a long time.
    fn replaceable(&self, time_s: f64) -> Option<usize> {
        let proven = |station: &Station| {
            station.heartbeat_at_s.is_some_and(|at_s| time_s - at_s <= PROVEN_FOR_S)
                || self.armed_by() == Some(station.address)
        };
        self.known.iter().position(|station| !proven(station))
    }

    /// Notes a refused frame.
    pub fn refused(&mut self, from: Address, why: Rejection, time_s: f64) {
        self.refused = Some(Refused { from, why, at_s: time_s });
        self.refused_count = self.refused_count.saturating_add(1);
    }

    fn station(&self, address: Address) -> Option<&Station> {
        self.known.iter().find(|station| station.address == address)
    }

    /// Age of the last accepted frame of a station, s; `None` if there is none.
    pub fn age_s(&self, address: Address, time_s: f64) -> Option<f64> {
        self.station(address).map(|station| time_s - station.accepted_at_s)
    }

    /// How well a station's heartbeat is heard.
    pub fn uplink(&self, address: Address, time_s: f64) -> Uplink {
        let heard = self.station(address).and_then(|station| station.heartbeat_at_s);
        heard.map_or(Uplink::NeverHeard, |at_s| Uplink::Heard { age_s: time_s - at_s })
    }

    /// How well the best station is heard.
    pub fn best_uplink(&self, time_s: f64) -> Uplink {
        let latest_s = self.known.iter().filter_map(|station| station.heartbeat_at_s).reduce(f64::max);
        latest_s.map_or(Uplink::NeverHeard, |at_s| Uplink::Heard { age_s: time_s - at_s })
    }

    /// Sets the station that armed the vehicle or has taken command, if any, and its operator.
    pub fn set_commander(&mut self, commander: Option<(Address, Option<Operator>)>) {
        self.commander = commander;
    }

    /// The station that armed the vehicle or has taken command, and its operator.
    pub fn commander(&self) -> Option<(Address, Option<Operator>)> {
        self.commander
    }

    /// The station that armed the vehicle or has taken command.
    pub fn armed_by(&self) -> Option<Address> {
        self.commander.map(|(address, _)| address)
    }

    /// The uplink reports that are due: one for each known station, but at most [`MAX_STATIONS`], or one for everybody
    /// while there is none.
    pub fn due(&mut self, time_s: f64) -> Vec<MavMessage> {
        if time_s < self.tell_at_s {
            return Vec::new();
        }
        let next_s = self.tell_at_s + TELL_EVERY_S;
        self.tell_at_s = if next_s > time_s { next_s } else { time_s + TELL_EVERY_S };
        if self.known.is_empty() {
            return vec![self.message(EVERYBODY, None, time_s)];
        }
        let told = self.known.len().min(MAX_STATIONS);
        let first = self.next % self.known.len();
        self.next = first + told;
        let known = self.known.iter().cycle().skip(first).take(told);
        known.map(|station| self.message(station.address, Some(station.accepted_at_s), time_s)).collect()
    }

    fn message(&self, to: Address, accepted_at_s: Option<f64>, time_s: f64) -> MavMessage {
        let age_ms = |at_s: Option<f64>| {
            at_s.map_or(u16::MAX, |at_s| (1000.0 * (time_s - at_s)).clamp(0.0, 65_534.0) as u16)
        };
        let refused = self.refused;
        let from = refused.map_or(EVERYBODY, |refused| refused.from);
        MavMessage::TD_UPLINK(TD_UPLINK_DATA {
            time_boot_ms: libm::round(1000.0 * time_s) as u32,
            accepted_age_ms: age_ms(accepted_at_s),
            refused_age_ms: age_ms(refused.map(|refused| refused.at_s)),
            refused_count: self.refused_count,
            target_system: to.system_id,
            target_component: to.component_id,
            commands: u8::from(self.armed_by() == Some(to)),
            refusal: refused.map_or(TdFrameRefusal::TD_FRAME_REFUSAL_NONE, |refused| refusal(refused.why)),
            refused_system: from.system_id,
            refused_component: from.component_id,
            session: 0,
            same_id: 0,
        })
    }
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
