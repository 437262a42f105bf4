//! The flight computer's process: it answers frames until it is stopped.

use flight::computer::saved::Saved;
use flight::guidance::baseline::Law;
use flight::vehicle::mission::Mission;
use flight::vehicle::rigid::RigidState;
use hil::computer::{Counts, RemoteComputer};
use hil::start::{Pace, Start};
use protocol::dialect::{HEARTBEAT_DATA, MavAutopilot, MavMessage, MavModeFlag, MavState, MavType};
use protocol::mission::MissionHash;

use super::assembly::{FrameAssembly, ToComputer};
use super::messages::of_answer;

/// A flight computer at the end of a link, messages in and messages out.
#[derive(Debug, Clone)]
pub struct ComputerEnd {
    mission: Mission,
    hash: MissionHash,
    assembly: FrameAssembly,
    flying: Option<(Start, RemoteComputer)>,
    /// The flight before this one, whose start may still come late.
    flown: Option<u32>,
}

/// The flight and the record in bytes that were kept. The estimate is in the record, not in the start.
fn read_kept(bytes: &[u8]) -> Option<(Start, Saved)> {
    let (flight_id, rest) = bytes.split_first_chunk()?;
    let (pace, record) = rest.split_first()?;
    let pace = if *pace == 0 { Pace::Lockstep } else { Pace::RealTime };
    let start = Start { flight_id: u32::from_le_bytes(*flight_id), believed: RigidState::upright(0.0), pace };
    Some((start, Saved::read(record).ok()?))
}

/// What is told to whoever watches the process.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// A flight has begun.
    Began { flight_id: u32, pace: Pace },
    /// A flight has ended, because another one begins.
    Ended { flight_id: u32, counts: Counts },
    /// A world with another mission asks.
    OtherMission { theirs: MissionHash, ours: MissionHash },
}

impl ComputerEnd {
    /// A computer that waits for its first flight.
    pub fn new(mission: &Mission, mission_toml: &str) -> Self {
        let hash = MissionHash::of(mission_toml);
        Self { mission: mission.clone(), hash, assembly: FrameAssembly::default(), flying: None, flown: None }
    }

    /// The same computer after a reset, with the records that were kept through it: it goes on with the flight of the
    /// newest that is whole. Returns also the number of the frame behind which it goes on.
    #[must_use]
    pub fn resumed<'a>(mut self, kept: impl IntoIterator<Item = &'a [u8]>) -> (Self, Option<u64>) {
        let newest = kept.into_iter().filter_map(read_kept).max_by_key(|(_, saved)| saved.frame());
        let frame = newest.as_ref().map(|(_, saved)| saved.frame());
        self.flying = newest
            .map(|(start, saved)| (start, RemoteComputer::resumed(&self.mission, Law::Nmpc, &start, &saved)));
        (self, frame)
    }

    /// The record to keep through a reset, and the number of its frame; `None` without a flight.
    pub fn kept(&self) -> Option<(u64, Vec<u8>)> {
        let (start, computer) = self.flying.as_ref()?;
        let saved = computer.saved();
        let mut record = start.flight_id.to_le_bytes().to_vec();
        record.push(u8::from(start.pace == Pace::RealTime));
        record.extend(saved.write(&mut [0; Saved::MOST_BYTES]).ok()?);
        Some((saved.frame(), record))
    }

    /// Takes a message. Adds what is to be sent to `out`; returns what is to be told.
    pub fn take(&mut self, message: &MavMessage, out: &mut Vec<MavMessage>) -> Vec<Event> {
        match self.assembly.take(message) {
            None => Vec::new(),
            Some(ToComputer::Start(start, theirs)) => self.start(&start, theirs, out),
            Some(ToComputer::Frame { flight_id, frame, readings }) => {
                if let Some((start, computer)) = &mut self.flying
                    && let Some(answer) = computer.take(flight_id, frame, &readings)
                {
                    out.extend(of_answer(&answer, start.pace));
                }
                Vec::new()
            }
        }
    }

    fn start(&mut self, start: &Start, theirs: MissionHash, out: &mut Vec<MavMessage>) -> Vec<Event> {
        if theirs != self.hash {
            return vec![Event::OtherMission { theirs, ours: self.hash }];
        }
        if let Some((known, computer)) = &mut self.flying
            && known.flight_id == start.flight_id
        {
            if let Some(answer) = computer.start_again(start) {
                out.extend(of_answer(&answer, start.pace));
            }
            return Vec::new();
        }
        if self.flown == Some(start.flight_id) {
            return Vec::new();
        }
        let mut events = Vec::new();
        if let Some((start, computer)) = &self.flying {
            self.flown = Some(start.flight_id);
            events.push(Event::Ended { flight_id: start.flight_id, counts: *computer.counts() });
        }
        let computer = RemoteComputer::new(&self.mission, Law::Nmpc, start);
        out.extend(of_answer(computer.answer(), start.pace));
        self.flying = Some((*start, computer));
        events.push(Event::Began { flight_id: start.flight_id, pace: start.pace });
        events
    }

    /// The heartbeat, which tells a world that listens where its computer is.
    pub fn heartbeat(&self) -> MavMessage {
        let phase = self.flying.as_ref().map_or(0, |(_, computer)| computer.answer().phase.index());
        MavMessage::HEARTBEAT(HEARTBEAT_DATA {
            custom_mode: u32::from(phase),
            mavtype: MavType::MAV_TYPE_ROCKET,
            autopilot: MavAutopilot::MAV_AUTOPILOT_GENERIC,
            base_mode: MavModeFlag::MAV_MODE_FLAG_HIL_ENABLED,
            system_status: match self.flying {
                Some(_) => MavState::MAV_STATE_ACTIVE,
                None => MavState::MAV_STATE_STANDBY,
            },
            mavlink_version: 3,
        })
    }

    /// The number of the present flight, and what became of its frames.
    pub fn counts(&self) -> Option<(u32, &Counts)> {
        self.flying.as_ref().map(|(start, computer)| (start.flight_id, computer.counts()))
    }

    /// Frames of which a part was lost.
    pub fn broken(&self) -> u64 {
        self.assembly.broken()
    }
}
